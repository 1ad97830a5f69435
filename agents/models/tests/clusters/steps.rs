//! The effect of the length of steps: errors fall with it, and steps of changing length are harmless.

use crate::bodies::{block, cloth, cube, solid, tube};
use crate::scenes::scene;
use crate::stacks::Draw;
use crate::table::{GRAVITY, Table, placed};
use glam::DVec3;
use metachron_contact::member::StepEnd;
use metachron_models::rod::{Integrator, Material, Section, Tube, TubeSpec};
use metachron_models::soft::{Side, SoftBody, SoftSpec};

/// Where a box that is let go on a soft block is while it sinks and comes up again, once in a tenth of a second: it swings without
/// damping of its own, so that later the damping by the steps would be all that is seen.
fn swing(rate_hz: u32) -> Vec<DVec3> {
    let block_of = SoftSpec { held: vec![Side::Bottom], ..solid(DVec3::Z * 0.04, DVec3::splat(0.08), [3; 3], 1e4) };
    let soft = placed(SoftBody::new(block_of).unwrap(), true);
    let cuboid = block(DVec3::new(0.003, 0.002, 0.11), DVec3::splat(0.03), 0.5, 0.1);
    let mut table = Table::new(vec![soft, cuboid]).at_rates(f64::from(rate_hz), f64::from(rate_hz));
    let mut places = vec![];
    for _ in 0..12 {
        for _ in 0..rate_hz / 120 {
            table.step();
        }
        places.push(table.middle(1).0);
    }
    places
}

#[test]
fn errors_fall_with_the_length_of_steps() {
    let paths = [240, 480, 960, 1920].map(swing);
    let apart = |pair: &[Vec<DVec3>]| {
        let sum: f64 = pair[0].iter().zip(&pair[1]).map(|(a, b)| a.distance(*b)).sum();
        sum / pair[0].len() as f64
    };
    let changes: Vec<f64> = paths.windows(2).map(apart).collect();
    // implicit Euler is of first order; bounces on a soft block are a little off it (measured: order 0.84)
    assert!(changes.windows(2).all(|pair| pair[1] < pair[0] / 1.6), "{changes:?}");
}

#[test]
fn a_box_on_two_tubes_comes_to_rest_at_one_height_by_steps_of_any_length() {
    let rest = |rate_hz: f64| {
        let mut table = scene("box on two tubes on a held slab").at_rates(rate_hz, rate_hz);
        table.play(0.8);
        table.middle(3).0
    };
    let rests = [60.0, 240.0, 960.0].map(rest);
    for pair in rests.windows(2) {
        // aside it may have crept by some depths of a contact
        assert!((pair[0].z - pair[1].z).abs() < 1e-5 && pair[0].distance(pair[1]) < 2e-4, "{rests:?}");
    }
}

#[test]
fn steps_of_changing_length_are_harmless() {
    let mut draw = Draw::new(7);
    for name in ["box on two tubes on a slab", "box between two soft blocks", "100 : 1 on a slab", "ten boxes"] {
        let found = scene(name).play_by(1.5, || draw.between(0.3, 1.0));
        assert!(found.rest_m <= 5e-5 && found.landing_m <= 3.5e-4, "{name}: {found:?}");
        assert!((found.weight - 1.0).abs() <= 1e-2, "{name}: {found:?}");
        assert!(found.gain_j <= 1e-3, "{name}: {found:?}");
    }
}

#[test]
fn a_step_that_is_made_again_begins_with_the_same_forces() {
    let half = DVec3::X * 0.1;
    let all = [
        tube(DVec3::Z, half, 0.01),
        cloth(DVec3::Z, 0.2, 6),
        cube(DVec3::Z, 0.08),
        block(DVec3::Z, DVec3::splat(0.03), 0.5, 0.1),
    ];
    for mut body in all {
        let model = body.agent.model();
        let member = body.agent.member().unwrap();
        let h_s = 2e-3;
        member.keep();
        member.begin(h_s).unwrap();
        let first = member.system().free.to_vec();
        // far from where it was: its forces are others
        let struck: Vec<_> = (0..).zip(&first).map(|(k, v)| *v + DVec3::Y * f64::from(k % 5)).collect();
        member.end(&StepEnd { v: &struck, h_s, touched: true, ..StepEnd::default() }).unwrap();
        member.go_back();
        member.begin(h_s).unwrap();
        assert_eq!(member.system().free, first, "{model}");
    }
}

/// A strand between two pins that falls through the line between them and is stretched to 1.4 times its length, by steps of `rate_hz`.
fn swinging_strand(rate_hz: f64) -> Table {
    let path: Vec<DVec3> =
        [[-0.4, 0.0, 0.0], [-0.2, 0.28, -0.03], [0.0, 0.38, -0.05], [0.2, 0.28, -0.03], [0.4, 0.0, 0.0]]
            .map(|at| DVec3::from_array(at) + DVec3::Z)
            .to_vec();
    let material = Material { young_pa: 5e4, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 1.0 };
    let spec = TubeSpec::free(path, Section::hollow(0.012, 0.003, material), 700);
    let spec = TubeSpec { pin: [true; 2], gravity: GRAVITY, damping_per_s: 0.05, ..spec };
    Table::among(vec![placed(Tube::new(spec).unwrap(), true)], &[]).at_rates(rate_hz, rate_hz)
}

#[test]
fn a_fine_strand_that_its_swing_stretches_gains_no_energy() {
    for rate_hz in [500.0, 120.0, 60.0] {
        let mut table = swinging_strand(rate_hz);
        let mut least_j = table.energy_j();
        let begun_j = least_j;
        for _ in 0..rate_hz as u32 {
            table.step();
            let energy_j = table.energy_j();
            // rounding of sums of seven hundred segments
            assert!(
                energy_j <= least_j + 1e-8 * begun_j.abs(),
                "{rate_hz} Hz, {:?}: {energy_j} J after {least_j}",
                table.time
            );
            least_j = energy_j;
        }
    }
}

#[test]
fn a_tube_that_nothing_touches_is_moved_by_its_own_integrator() {
    let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
    let lost = |integrator| {
        let spec = TubeSpec::free(vec![DVec3::ZERO, DVec3::X * 0.2], Section::hollow(0.005, 0.001, material), 8);
        let spec = TubeSpec { gravity: GRAVITY, pin: [true, false], integrator, ..spec };
        let mut table = Table::among(vec![placed(Tube::new(spec).unwrap(), true)], &[]).at_rates(240.0, 240.0);
        let start_j = table.energy_j();
        table.play(0.5);
        // the height of its fall, from level to hanging
        (start_j - table.energy_j()) / (table.bodies[0].agent.mass_kg() * -GRAVITY.z * 0.1)
    };
    let (kept, damped) = (lost(Integrator::EnergyMomentum), lost(Integrator::ImplicitEuler));
    assert!(kept.abs() < 1e-6 && damped > 0.01, "{kept} and {damped} of its fall");
}
