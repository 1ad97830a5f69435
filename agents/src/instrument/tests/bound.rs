//! What bounds what a tool does to others: the skin of what it has pierced.

use super::pushes::{cube, tool};
use super::rigid::{G, down, on_floor};
use super::*;
use crate::coupling::harness::{Faults, Stage};
use crate::soft::{SoftBody, SoftMatter, SoftShape, SoftSpec};

#[test]
fn a_tool_that_has_pierced_a_solid_comes_out_without_it() {
    for (rates, depth_m) in [((240.0, 60.0), 0.02), ((60.0, 240.0), 0.035), ((240.0, 240.0), 0.035)] {
        let block = SoftSpec {
            shape: SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.04), segments: [4, 4, 2] },
            matter: SoftMatter { young_pa: 1e4, poisson: 0.3, density_kg_m3: 1000.0, damping_per_s: 4.0 },
            position: DVec3::new(-0.05, -0.05, 0.0),
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            held: vec![],
            friction: 0.5,
            gravity: DVec3::Z * -G,
            obstacles: on_floor(cube(DVec3::Z, 1.0)).obstacles,
            sleep: false,
        };
        let mut stage = Stage::new(Faults::default());
        let block = stage.add(SoftBody::new(block).unwrap(), rates.0);
        // a jump into it, from 40 mm above, and one out of it
        let key = |at_s, z: f64| down(at_s, DVec3::new(0.003, 0.002, z), 0.0);
        let (high_m, low_m) = (0.08, 0.04 - depth_m);
        let keys = vec![key(0.0, high_m), key(0.02, low_m), key(1.0, low_m), key(1.02, high_m), key(1.6, 0.2)];
        stage.add(tool(keys, 50.0), rates.1);
        let middle_m = |stage: &Stage| {
            let Body::Soft(soft) = &stage.newest(block).body else { panic!("a soft body") };
            soft.positions.iter().map(|at| at.z).sum::<f64>() / soft.positions.len() as f64
        };
        let mut high_m = 0.0_f64;
        stage.run(2.0, |stage| high_m = high_m.max(middle_m(stage)));
        let end_m = middle_m(&stage);
        println!("{rates:?} {depth_m} m: its middle {high_m} m high at most, {end_m} m at the end");
        // it stands 40 mm high
        assert!(high_m < 0.022 && (end_m - 0.02).abs() < 1e-3, "{rates:?} {depth_m} m: {high_m} m, {end_m} m");
    }
}
