//! Where the skins of two soft bodies touch: flat faces, whose gaps are known.

use super::*;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{CollisionShape, PlacedShape, ShapePose, Touch};
use proptest::prelude::*;
use std::sync::Arc;

/// How far the search looks, metres.
const REACH_M: f64 = 1e-3;

/// The slack of contact.md, eq. 8: a thousandth of an edge, metres.
const LEFT_M: f64 = 5e-5;
/// The cosine of the same over the half thickness of a sheet.
const STRAIGHT: f64 = 0.98;

/// A skin where it stands, all of it turned by `turn` about the upright through `middle`.
fn skin(shape: SoftShape, (middle, turn): (DVec3, f64)) -> (Arc<CollisionShape>, Vec<DVec3>) {
    let body = SoftBody::new(spec(shape)).unwrap();
    let rest = state(&body).positions;
    let metachron_geometry::Aabb { low, high } = metachron_geometry::Aabb::of(&rest);
    let turn = DQuat::from_rotation_z(turn);
    (body.form().unwrap(), rest.iter().map(|x| middle + turn * (*x - 0.5 * (low + high))).collect())
}

fn slab(size_m: DVec3, segments: [u32; 3], place: (DVec3, f64)) -> (Arc<CollisionShape>, Vec<DVec3>) {
    skin(SoftShape::Box { size_m, segments }, place)
}

/// Every place of the two, and that the other side sees the same.
fn met(a: &(Arc<CollisionShape>, Vec<DVec3>), b: &(Arc<CollisionShape>, Vec<DVec3>)) -> Vec<Touch> {
    let placed = [a, b].map(|(form, positions)| PlacedShape { form, view: ShapePose::Surface(positions) });
    let (mut scratch, mut list) = (NarrowPhaseScratch::default(), vec![]);
    touches(&placed[0], &placed[1], REACH_M, &mut scratch, &mut list);
    list
}

/// Whether three places or more push along `normal` with this gap, and nothing overlaps more: a place a little way beside an edge
/// may be near to that.
fn agree(list: &[Touch], normal: DVec3, gap_m: f64) -> Result<(), TestCaseError> {
    let (along, aside): (Vec<&Touch>, Vec<&Touch>) = list.iter().partition(|touch| touch.normal.dot(normal) > STRAIGHT);
    let exact = along.iter().filter(|touch| touch.normal.distance(normal) < 1e-9 && (touch.gap_m - gap_m).abs() < 1e-9);
    prop_assert!(exact.count() >= 3, "{along:?}");
    for touch in along {
        prop_assert!(touch.gap_m > gap_m - 0.2 * LEFT_M, "{touch:?} is deeper than {gap_m} m");
    }
    for touch in aside {
        prop_assert!(touch.gap_m > gap_m.min(0.0) - LEFT_M, "{touch:?} is aside of {normal}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    /// Edges of a side that cross edges of the face below once reported depths of half an edge, aside.
    #[test]
    fn a_face_on_a_face_has_its_gap_everywhere_and_pushes_straight(
        (x, y) in (-0.1_f64..0.1, -0.1_f64..0.1),
        turn in prop_oneof![Just(0.0), -1.6_f64..1.6],
        gap_m in -3e-4_f64..3e-4,
        high_m in prop_oneof![Just(0.1), Just(0.004)],
    ) {
        let low = slab(DVec3::new(0.2, 0.2, high_m), [4, 4, 1], (DVec3::NEG_Z * (0.5 * high_m), 0.0));
        let high = slab(DVec3::new(0.1, 0.1, high_m), [3, 3, 1], (DVec3::new(x, y, 0.5 * high_m + gap_m), turn));
        agree(&met(&high, &low), DVec3::Z, gap_m)?;
        agree(&met(&low, &high), DVec3::NEG_Z, gap_m)?;
    }

    #[test]
    fn a_body_beside_another_is_pushed_sideways_only(y in -0.05_f64..0.05, z in -0.05_f64..0.05, gap_m in -3e-4_f64..3e-4) {
        let shape = |x: f64, y: f64, z: f64| slab(DVec3::splat(0.1), [3, 3, 3], (DVec3::new(x, y, z), 0.0));
        agree(&met(&shape(0.1 + gap_m, y, z), &shape(0.0, 0.0, 0.0)), DVec3::X, gap_m)?;
    }

    /// An open skin does not tell its sides: the closed one does.
    #[test]
    fn a_sheet_over_or_under_a_slab_is_on_that_side_of_it(
        (x, y) in (-0.08_f64..0.08, -0.08_f64..0.08),
        turn in prop_oneof![Just(0.0), -1.6_f64..1.6],
        // as far as the sheet's middle: past it edges may be found a tenth deeper, aside
        gap_m in -5e-4_f64..3e-4,
        high_m in prop_oneof![Just(0.1), Just(0.004)],
        over in any::<bool>(),
    ) {
        let half_m = 0.5e-3;
        let sheet = SoftShape::Sheet { size_m: [0.2, 0.2], thickness_m: 2.0 * half_m, segments: [5, 4] };
        let sheet = skin(sheet, (DVec3::ZERO, 0.0));
        let away_m = 0.5 * high_m + half_m + gap_m;
        let up = if over { 1.0 } else { -1.0 };
        let slab = slab(DVec3::new(0.1, 0.1, high_m), [3, 3, 1], (DVec3::new(x, y, up * away_m), turn));
        agree(&met(&slab, &sheet), DVec3::Z * up, gap_m)?;
    }

    /// A vertex beside a rope that had come in was once pushed along the skin, half an edge deep.
    #[test]
    fn a_rope_over_or_in_a_slab_is_pushed_out_of_its_top(
        (x, y) in (-0.03_f64..0.03, -0.03_f64..0.03),
        turn in prop_oneof![Just(0.0), -1.6_f64..1.6],
        under_m in -1.9e-3_f64..2e-3,
    ) {
        let radius_m = 2e-3;
        let gap_m = -radius_m - under_m;
        let path_m = vec![DVec3::X * -0.06, DVec3::X * 0.06];
        let rope = skin(SoftShape::Rope { path_m, radius_m, segments: 7 }, (DVec3::new(x, y, radius_m + gap_m), turn));
        let low = slab(DVec3::new(0.2, 0.2, 0.1), [6, 6, 3], (DVec3::NEG_Z * 0.05, 0.0));
        let list = met(&rope, &low);
        prop_assert!(list.len() >= 3, "{list:?}");
        // a normal that leans out of the skin by 60 degrees at most is twice as far from the axis as that is deep
        let deepest_m = if under_m > 0.0 { -radius_m - 2.0 * under_m } else { gap_m };
        for touch in &list {
            prop_assert!(touch.gap_m > deepest_m - LEFT_M, "{touch:?}, {under_m} m under");
        }
    }
}
