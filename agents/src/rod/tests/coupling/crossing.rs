//! A tube that falls across another one and lies on it, each by its own clock.

use super::super::reference_spec;
use super::meetings::GRAVITY;
use crate::coupling::audit::{Member, audit};
use crate::coupling::harness::{Faults, Stage};
use crate::rod::{Material, Section, Tube, TubeSpec};
use crate::{AgentId, SimTime};
use glam::DVec3;

/// A tube of this radius and wall, metres, and modulus, Pa, in 24 segments.
fn tube(path_m: Vec<DVec3>, (radius_m, wall_m, young_pa): (f64, f64, f64), clamp: [bool; 2]) -> TubeSpec {
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let (section, mass_per_length_kg_m) = Section::hollow(radius_m, wall_m, material);
    let base = TubeSpec { friction: 0.4, damping_per_s: 1.0, clamp, ..reference_spec(young_pa, 24) };
    TubeSpec { path_m, section, mass_per_length_kg_m, gravity: GRAVITY, ..base }
}

#[test]
fn a_tube_lies_across_another_one_whatever_their_clocks() {
    let held_is_fast = [(1000.0, 200.0), (1000.0, 60.0), (1000.0, 30.0)];
    let held_is_slow = [(200.0, 1000.0), (60.0, 360.0), (30.0, 1000.0), (20.0, 1000.0), (10.0, 1000.0), (10.0, 20.0)];
    let equal = [(60.0, 60.0), (30.0, 30.0), (20.0, 20.0), (10.0, 10.0)];
    for rates in held_is_fast.into_iter().chain(held_is_slow).chain(equal) {
        let mut stage = Stage::new(Faults::default());
        let rope = tube(vec![DVec3::new(-0.3, 0.0, 0.2), DVec3::new(0.3, 0.0, 0.2)], (0.014, 0.003, 4e5), [true; 2]);
        let across = vec![DVec3::new(0.02, -0.2, 0.24), DVec3::new(0.02, 0.2, 0.24)];
        let hose = tube(across, (0.011, 0.002, 1e5), [true, false]);
        let specs = [rope.clone(), hose.clone()];
        let ids = [stage.add(Tube::new(rope).unwrap(), rates.0), stage.add(Tube::new(hose).unwrap(), rates.1)];
        let energy_j = |stage: &Stage| {
            let member = |id: AgentId| {
                let TubeSpec { mass_per_length_kg_m, section, .. } = &specs[id.0 as usize];
                let (mass_per_length_kg_m, rotary_kg_m) = (*mass_per_length_kg_m, section.rotary_kg_m);
                Member { id, snapshot: stage.newest(id), mass_per_length_kg_m, rotary_kg_m }
            };
            audit(&ids.map(member), SimTime::ZERO, &mut |_, _| 0.0).energy_j
        };
        let first_j = energy_j(&stage);
        let mut rise_j = f64::MIN;
        stage.run(1.2, |stage| rise_j = rise_j.max(energy_j(stage) - first_j));
        let given = |stage: &Stage| -> f64 {
            ids.iter().flat_map(|id| &stage.newest(*id).pairs).map(|pair| pair.impulse_n_s).sum()
        };
        let (before, mut depth_m) = (given(&stage), 0.0_f64);
        stage.run(2.0, |stage| {
            rise_j = rise_j.max(energy_j(stage) - first_j);
            let pairs = ids.iter().flat_map(|id| &stage.newest(*id).pairs);
            depth_m = pairs.map(|pair| pair.penetration_m).fold(depth_m, f64::max);
        });
        let borne = (given(&stage) - before) / 0.8 / (0.4 * specs[1].mass_per_length_kg_m * 9.81);
        println!("{rates:?}: depth {depth_m:e} borne {borne} rise {rise_j:e}");
        assert!(depth_m < 2e-3, "{rates:?}: {depth_m} m deep");
        // its clamp bears the rest: a quarter to a third while it still swings
        assert!(borne > 0.6 && borne < 1.1, "{rates:?}: {borne} of its weight");
        assert!(rise_j < 0.01 * first_j, "{rates:?}: {rise_j} J above {first_j} J");
    }
}
