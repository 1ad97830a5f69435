//! Solids in cages whose skins are far finer than their cells: as many contacts as the cage can tell apart, and the same dent.

use crate::bodies::solid;
use crate::table::{Findings, Table, placed};
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::Anchor;
use metachron_models::soft::{SoftBody, SoftMaterial, SoftShape, SoftSpec};
use std::sync::Arc;

const RADIUS_M: f64 = 0.05;
const EPS_M: f64 = 0.017;

/// A soft ball that has come to rest on the floor; its skin has 12 n² triangles.
fn rested(segments: u32) -> Findings {
    let surface = Arc::new(SoftShape::Ball { radius_m: RADIUS_M, segments }.skin().unwrap());
    let base = solid(DVec3::Z * (RADIUS_M + 1e-4), DVec3::ZERO, [1; 3], 8e3);
    let material = SoftMaterial { damping_per_s: 8.0, damping_s: 0.01, ..base.material };
    let shape = SoftShape::Embedded { surface, eps_m: EPS_M, range_m: (EPS_M, EPS_M) };
    let mut table = Table::new(vec![placed(SoftBody::new(SoftSpec { shape, material, ..base }).unwrap(), false)]);
    table.play(0.7)
}

#[test]
fn a_skin_of_many_triangles_has_no_more_contacts_than_its_cage_tells_apart_and_sinks_as_a_coarse_one() {
    let [coarse, fine, finer] = [12, 36, 72].map(rested);
    for found in [coarse, fine, finer] {
        // six cells across its dent are 13 patches of 16 contacts at most
        assert!(found.contacts < 13 * 16 && found.unfinished == 0, "{found:?}");
        assert!(found.rest_m < 2e-5 && found.gain_j < 1e-6 && (found.weight - 1.0).abs() < 5e-3, "{found:?}");
    }
    assert!(finer.contacts <= 2 * fine.contacts, "{fine:?} {finer:?}");
    // its middle has come down by 11 mm; skins of edges of 5 and of 1 mm differ by a sagitta of the coarse one
    let sunk_m = |found: Findings| RADIUS_M - found.lowest_m;
    assert!((sunk_m(finer) / sunk_m(coarse) - 1.0).abs() < 0.01, "{coarse:?} {finer:?}");
}

/// A cube of a few cells with a fine skin, its middle over the floor.
fn cube(push_n: f64) -> (Table, Findings) {
    let size_m = DVec3::splat(0.06);
    let surface = Arc::new(SoftShape::Box { size_m, segments: [24; 3] }.skin().unwrap());
    let base = solid(DVec3::new(0.0, 0.0, 0.0301), size_m, [1; 3], 2e5);
    let material = SoftMaterial { damping_per_s: 2.0, damping_s: 0.005, ..base.material };
    let shape = SoftShape::Embedded { surface, eps_m: 0.03, range_m: (0.03, 0.03) };
    let mut body = placed(SoftBody::new(SoftSpec { shape, material, ..base }).unwrap(), false);
    let side = Anchor::Vertex(side_middle(size_m));
    body.user_springs.push(AnchorSpring {
        by: None,
        anchor: side,
        target: DVec3::new(1e3 + 0.03, 0.0, 0.03),
        target_velocity: DVec3::ZERO,
        stiffness_n_m: push_n / 1e3,
        damping_n_s_m: 0.0,
    });
    let mut table = Table::new(vec![body]);
    let found = table.play(0.8);
    (table, found)
}

/// The vertex of the skin at the middle of the side of a cube where x is greatest.
fn side_middle(size_m: DVec3) -> u32 {
    let skin = SoftShape::Box { size_m, segments: [24; 3] }.skin().unwrap();
    let wanted = DVec3::new(size_m.x, 0.5 * size_m.y, 0.5 * size_m.z);
    let off = |at: &usize| skin.points[*at].distance(wanted);
    (0..skin.points.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap() as u32
}

#[test]
fn a_cube_with_a_fine_skin_stands_and_slips_as_coulomb_says() {
    // 0.216 kg at μ = 0.5: it slips above 1.06 N, pulled at the height of its middle it does not turn over
    for (push_n, slips) in [(0.0, false), (0.85, false), (1.25, true)] {
        let (mut table, found) = cube(push_n);
        let (middle, velocity) = table.middle(0);
        assert!((found.weight - 1.0).abs() < 0.02 && found.rest_m < 1e-4, "{push_n} N: {found:?}");
        assert!(velocity.x.abs() < 1e-3 || slips, "{push_n} N: {middle} {velocity}");
        if slips {
            // m v' = F − μ m g − c m v, with c = 2 a second, for 0.8 s
            let expected = (push_n / 0.216 - 0.5 * 9.81) / 2.0 * (1.0 - libm::exp(-1.6));
            assert!((velocity.x / expected - 1.0).abs() < 0.02, "{push_n} N: {velocity} {expected}");
        }
        assert!(velocity.y.abs() < 1e-3 && middle.y.abs() < 2e-4, "{push_n} N: {middle} {velocity}");
    }
}
