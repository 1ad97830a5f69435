//! The promises of every pair of shapes: both sides see the same, names last, motion is smooth, nothing breaks or
//! allocates.

use super::*;

/// One of each kind, with its place.
fn cast() -> Vec<CollisionShape> {
    let half = DVec3::new(0.02, 0.03, 0.04);
    vec![ball(0.03), capsule(0.02, 0.04), cuboid(half), cylinder(0.02, 0.04), hull(half), chain(), tool()]
}

fn place<'a>(form: &'a CollisionShape, (position, rotation): (DVec3, DQuat), nodes: &'a [DVec3]) -> PlacedShape<'a> {
    let view = match form.kind {
        ShapeKind::Solid(_) => ShapePose::Solid { position, rotation },
        ShapeKind::Chain => ShapePose::Chain { positions: nodes, radii_m: &RADII[..nodes.len()] },
        ShapeKind::Tool(_) => ShapePose::Tool { tip: position, rotation, jaw: 0.3 },
        ShapeKind::Surface(_) => ShapePose::Surface(nodes),
    };
    PlacedShape { form, view }
}

const RADII: [f64; 8] = [8e-3; 8];

/// A gently curved tube through a place.
fn curved((position, rotation): (DVec3, DQuat)) -> Vec<DVec3> {
    let node = |i: i32| DVec3::new(0.015 * f64::from(i), 0.002 * f64::from(i * i), 0.0);
    (-3..=4).map(|i| position + rotation * node(i)).collect()
}

fn is_cylinder(form: &CollisionShape) -> bool {
    matches!(&form.kind, ShapeKind::Solid(form) if matches!(form.solid, Solid::Cylinder { .. }))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn both_sides_see_the_same(p in vector(0.04), q in vector(0.04), r in turn(), s in turn()) {
        let (u, v) = (curved((p, r)), curved((q, s)));
        let cast = cast();
        for first in &cast {
            for second in &cast {
                let (a, b) = (place(first, (p, r), &u), place(second, (q, s), &v));
                let (here, there) = (all(&a, &b, 5e-3), all(&b, &a, 5e-3));
                let single = here.iter().any(|t| matches!((t.on_a, t.on_b), (Place::Point(_), Place::Point(_))));
                let nearly = |m: &Touch, n: &Touch| {
                    let same = (m.gap_m - n.gap_m).abs() < 1e-5 && (m.normal + n.normal).length() < 1e-3;
                    let ((x, _), (y, _)) = (axis(m.on_a, &u), axis(n.on_b, &u));
                    same && x.distance(y) < 1e-4
                };
                if !single {
                    prop_assert_eq!(here.len(), there.len());
                    prop_assert!(here.iter().all(|m| there.iter().any(|n| nearly(m, n))));
                }
                prop_assert!(here.is_sorted_by(|m, n| m.key < n.key), "names are unique and sorted");
                prop_assert!(here.iter().chain(&there).all(|m| m.normal.is_normalized() && m.gap_m <= 5e-3));
                prop_assert_eq!(here.is_empty(), there.is_empty());
                if let Some(m) = here.iter().min_by(|m, n| m.gap_m.total_cmp(&n.gap_m)) {
                    // the hull of round parts that overlap stops growing a ten-thousandth of a millimetre short
                    prop_assert!((m.gap_m - lowest(&there).gap_m).abs() < 1e-6, "{} {}", m.gap_m, lowest(&there).gap_m);
                }
            }
        }
    }

    #[test]
    fn nothing_comes_within_reach_before_a_pair_has_moved_by_the_bound(
        p in vector(0.3), r in turn(), s in turn(), way in vector(1.0),
    ) {
        let (v, reach_m, mut scratch) = (curved((DVec3::ZERO, s)), 1e-3, NarrowPhaseScratch::default());
        let cast = cast();
        for first in &cast {
            for second in &cast {
                let mut at = |p: DVec3| {
                    let (u, mut found) = (curved((p, r)), Vec::new());
                    let (a, b) = (place(first, (p, r), &u), place(second, (DVec3::ZERO, s), &v));
                    let clear_m = touches(&a, &b, reach_m, &mut scratch, &mut found);
                    (clear_m, found.is_empty())
                };
                let (clear_m, is_far) = at(p);
                prop_assert!(clear_m >= reach_m, "{}", clear_m);
                for way in [way, -p].into_iter().filter(|_| is_far) {
                    let moved = p + way.normalize_or_zero() * (0.999 * (clear_m - reach_m));
                    prop_assert!(at(moved).1, "{} m towards {}", clear_m, way);
                }
            }
        }
    }

    #[test]
    fn contact_keys_survive_small_motions(p in vector(0.03), r in turn(), s in turn(), shift in vector(1e-7)) {
        let (u, v, w) = (curved((p, r)), curved((DVec3::ZERO, s)), curved((p + shift, r)));
        let cast = cast();
        for first in &cast {
            for second in &cast {
                let b = place(second, (DVec3::ZERO, s), &v);
                let before = all(&place(first, (p, r), &u), &b, 4e-3);
                let after = all(&place(first, (p + shift, r), &w), &b, 4e-3);
                let round = is_cylinder(first) || is_cylinder(second);
                for m in before.iter().filter(|m| m.gap_m < 3.9e-3) {
                    let Some(n) = after.iter().find(|n| n.key == m.key) else { continue };
                    // the corners that stand for a cylinder's rim turn with the place where the parts face each other, which
                    // is any of a whole line where they lie flat: a gap then changes by the way to the other corner at most
                    let turned_m = if round { axis(m.on_a, &u).0.distance(axis(n.on_a, &w).0) } else { 0.0 };
                    prop_assert!((m.gap_m - n.gap_m).abs() < 1e-4 + turned_m, "{} and {}", m.gap_m, n.gap_m);
                }
            }
        }
    }
}

#[test]
fn gaps_and_normals_change_smoothly_along_a_motion() {
    let cast = cast();
    let turned = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.2, 0.1);
    for first in &cast {
        for second in &cast {
            let v = curved((DVec3::ZERO, DQuat::IDENTITY));
            let mut last: Option<(DVec3, f64)> = None;
            for i in 0..400 {
                let p = DVec3::new(-0.1 + 5e-4 * f64::from(i), 0.01, 0.09);
                let u = curved((p, turned));
                let (a, b) = (place(first, (p, turned), &u), place(second, (DVec3::ZERO, DQuat::IDENTITY), &v));
                let now = nearest(&a, &b, 0.2);
                if let (Some((n, g)), Some((m, f))) = (now, last) {
                    // a gap changes by no more than the way, and spans are found to a millionth
                    assert!((g - f).abs() < 5e-4 + 2e-6, "step {i}: {f} and {g} {:?} {:?}", a.view, b.view);
                    // the lowest places of round things apart: the normal turns by the way over the distance at most
                    assert!(f < 5e-3 || m.dot(n) > 0.0, "step {i}: {m} and {n}");
                }
                last = now;
            }
            assert!(last.is_some());
        }
    }
}

#[test]
fn coincident_shapes_still_have_normals() {
    let cast = cast();
    let v = curved((DVec3::ZERO, DQuat::IDENTITY));
    let stuck = [DVec3::ZERO; 8];
    for first in &cast {
        for second in &cast {
            for nodes in [v.as_slice(), &stuck] {
                let b = place(second, (DVec3::ZERO, DQuat::IDENTITY), &v);
                let a = place(first, (DVec3::ZERO, DQuat::IDENTITY), nodes);
                let found = all(&a, &b, 1e-3);
                assert!(found.iter().all(|m| (m.normal.length() - 1.0).abs() < 1e-9 && m.gap_m.is_finite()));
                assert!(found.iter().any(|m| m.gap_m < 0.0), "{:?} {:?}: {found:?}", a.view, b.view);
                let (normal, gap_m) = nearest(&a, &b, 1e-3).unwrap();
                assert!((normal.length() - 1.0).abs() < 1e-9 && gap_m < 0.0);
            }
        }
    }
}

#[test]
fn places_that_are_not_finite_and_views_of_another_kind_touch_nothing() {
    let cast = cast();
    let v = curved((DVec3::ZERO, DQuat::IDENTITY));
    let lost = [DVec3::NAN; 8];
    for first in &cast {
        for second in &cast {
            let b = place(second, (DVec3::ZERO, DQuat::IDENTITY), &v);
            let a = place(first, (DVec3::NAN, DQuat::IDENTITY), &lost);
            assert!(all(&a, &b, 1e-3).is_empty() && all(&b, &a, 1e-3).is_empty());
            assert!(nearest(&a, &b, 1e-3).is_none_or(|(n, g)| n.is_finite() && g.is_finite()));
        }
    }
    let wrong =
        PlacedShape { form: &cast[5], view: ShapePose::Solid { position: DVec3::ZERO, rotation: DQuat::IDENTITY } };
    assert!(all(&wrong, &place(&cast[0], (DVec3::ZERO, DQuat::IDENTITY), &v), 1.0).is_empty());
    let short = PlacedShape { form: &cast[5], view: ShapePose::Chain { positions: &v, radii_m: &RADII[..3] } };
    assert!(all(&short, &place(&cast[0], (DVec3::ZERO, DQuat::IDENTITY), &v), 1.0).is_empty());
}

#[test]
fn nothing_is_allocated_once_everything_is_known() {
    let cast = cast();
    let v = curved((DVec3::ZERO, DQuat::IDENTITY));
    let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
    let mut run = |lift: f64, known: bool| {
        for first in &cast {
            for second in &cast {
                let p = DVec3::Y * lift;
                let u = curved((p, DQuat::IDENTITY));
                let (a, b) =
                    (place(first, (p, DQuat::IDENTITY), &u), place(second, (DVec3::ZERO, DQuat::IDENTITY), &v));
                let info = allocation_counter::measure(|| {
                    touches(&a, &b, 0.01, &mut scratch, &mut found);
                    gap(&a, &b, 0.01, &mut scratch);
                });
                assert!(!known || info.count_total == 0, "{} allocations", info.count_total);
            }
        }
    };
    // storage grows to the most that the motion needs, once
    for known in [false, true] {
        (0..20).for_each(|i| run(5e-3 * f64::from(i), known));
    }
}
