//! Solids too large for a factor, solved by conjugate gradients with all that they touch: exact weights, energy, momentum.

use crate::bodies::{block, solid, tube};
use crate::table::{Placed, Table, placed};
use glam::DVec3;
use metachron_models::soft::{SoftBody, SoftMaterial, SoftSpec};

/// A cube of 0.1 m of so many cells along each edge, of the stuff of an organ, above the floor.
fn organ(cells: u32, bottom_m: f64) -> Placed {
    let spec = solid(DVec3::Z * (bottom_m + 0.05), DVec3::splat(0.1), [cells; 3], 12e3);
    let material = SoftMaterial { poisson: 0.4, density_kg_m3: 1050.0, damping_per_s: 0.2, ..spec.material };
    placed(SoftBody::new(SoftSpec { material, ..spec }).unwrap(), false)
}

#[test]
fn a_solid_of_1728_vertices_lies_on_the_floor_and_bears_a_plate_and_a_tube() {
    let plate = block(DVec3::Z * 0.1055, DVec3::new(0.05, 0.05, 0.005), 0.2, 0.0);
    let tube = tube(DVec3::Z * 0.1105, DVec3::X * 0.08, 0.01);
    for (name, above) in [("a plate", plate), ("a tube", tube)] {
        let found = Table::new(vec![organ(11, 0.0002), above]).play(0.8);
        assert_eq!(found.factors, 0, "{name}: it was solved by factors");
        assert!(found.rest_m < 0.05e-3, "{name}: {} m deep", found.rest_m);
        assert!((found.weight - 1.0).abs() < 0.02, "{name}: it weighs {}", found.weight);
        assert!(found.gain_j < 1e-3, "{name}: {} J made", found.gain_j);
    }
}
