//! A haptic tip of 1 kHz, driven by the local model alone that a slow soft body on the floor publishes.

use super::clocks::{Clocks, GRAVITY, Tamper};
use glam::{DQuat, DVec3};
use metachron_contact::member::StepSystem;
use metachron_contact::{Agent, AnchorSpring, Law};
use metachron_core::{Anchor, Snapshot};
use metachron_geometry::{ContactTraits, Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{MaterialLaw, SoftBody, SoftMaterial, SoftShape, SoftSpec};

/// The column: its edges, metres.
const SIZE_M: DVec3 = DVec3::new(0.06, 0.06, 0.06);
const TIP_KG: f64 = 0.05;
const TIP_M: f64 = 0.01;
const SPRING_N_M: f64 = 2000.0;
const PRESS_M: f64 = 0.005;

pub fn floor() -> Obstacle {
    Obstacle::new("floor", Solid::Plane)
}

/// The force of the tip on the column, N.
#[derive(Debug, Clone, Copy)]
struct Felt {
    /// In the last half second: the least, the mean, and the standard deviation.
    least_n: f64,
    mean_n: f64,
    spread_n: f64,
    /// The most ever.
    most_n: f64,
}

/// Presses a column of a modulus and a rate for a second and a half.
fn press(young_pa: f64, rate_hz: f64, due: bool, tamper: Option<Tamper>) -> Felt {
    let mut clocks = Clocks::new(Law::Ledger, &[floor()]);
    (clocks.due, clocks.tamper) = (due, tamper);
    clocks.add(column(young_pa), rate_hz);
    let plate = Solid::Box { half_extents_m: DVec3::new(0.035, 0.035, TIP_M) };
    let spec = RigidSpec::free(plate, DVec3::Z * (SIZE_M.z + TIP_M + 0.002), TIP_KG);
    let tip = clocks.add(RigidBody::new(RigidSpec { gravity: DVec3::ZERO, ..spec }).unwrap(), 1000.0);
    let mut forces = vec![];
    while clocks.all[tip].time.as_secs_f64() < 1.5 {
        let at_s = clocks.all[tip].time.as_secs_f64();
        clocks.all[tip].user_springs = vec![AnchorSpring {
            by: None,
            anchor: Anchor::Local(DVec3::ZERO),
            target: DVec3::Z * (SIZE_M.z + TIP_M - PRESS_M * (at_s / 0.2).min(1.0)),
            target_velocity: DVec3::ZERO,
            stiffness_n_m: SPRING_N_M,
            damping_n_s_m: 2.0 * (SPRING_N_M * TIP_KG).sqrt(),
        }];
        if clocks.step() == tip {
            let pair = clocks.all[tip].own.pairs.iter().find(|pair| pair.contacts > 0);
            forces.push(pair.map_or(0.0, |pair| pair.force_n));
        }
    }
    let last = &forces[forces.len() - 500..];
    let mean_n = last.iter().sum::<f64>() / 500.0;
    let variance = last.iter().map(|force| (force - mean_n).powi(2)).sum::<f64>() / 500.0;
    let [least_n, most_n] = [last, &forces].map(|forces| {
        let (low, high) = (f64::INFINITY, 0.0);
        forces.iter().fold([low, high], |[low, high], force| [f64::min(low, *force), f64::max(high, *force)])
    });
    Felt { least_n: least_n[0], mean_n, spread_n: variance.sqrt(), most_n: most_n[1] }
}

fn column(young_pa: f64) -> SoftBody {
    let spec = SoftSpec {
        shape: SoftShape::Box { size_m: SIZE_M, segments: [2, 2, 4] },
        nodes: None,
        eps_touched_m: None,
        material: SoftMaterial {
            young_pa,
            poisson: 0.3,
            density_kg_m3: 1000.0,
            damping_per_s: 0.2,
            damping_s: 0.0,
            law: MaterialLaw::Corotational,
        },
        position: DVec3::new(-0.5 * SIZE_M.x, -0.5 * SIZE_M.y, 0.0),
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.5,
        traits: ContactTraits::default(),
        gravity: GRAVITY,
        self_contact: false,
        sleep: false,
    };
    SoftBody::new(spec).unwrap()
}

/// Publishes the member's own W instead of that of its cluster with the floor held.
fn own(agent: &mut dyn Agent, shown: &mut Snapshot) {
    let Some(member) = agent.member() else { return };
    let StepSystem { response: Some(response), free, .. } = member.system() else { return };
    let model = &mut shown.local_model;
    let count = model.blocks.len();
    for column in 0..count {
        for axis in 0..3 {
            let mut x = vec![DVec3::ZERO; free.len()];
            x[model.blocks[column].slot as usize] = DVec3::AXES[axis]; // no vertex is held: slots are blocks
            response.respond(&mut x);
            for row in 0..count {
                *model.compliance[row * count + column].col_mut(axis) = x[model.blocks[row].slot as usize];
            }
        }
    }
}

#[test]
fn a_device_on_a_local_model_is_steady() {
    for young_pa in [1e4, 1e5, 1e6] {
        // both springs share the press on the tip: at rest no clock matters
        let wanted_n = press(young_pa, 500.0, false, None).mean_n;
        for rate_hz in [60.0, 30.0] {
            let felt = press(young_pa, rate_hz, false, None);
            let case = format!("{young_pa:e} Pa, {rate_hz} Hz: {felt:.3?} of {wanted_n:.3} N");
            println!("{case}");
            assert!((felt.mean_n - wanted_n).abs() < 0.05 * wanted_n, "{case}");
            assert!(felt.spread_n < 0.2 * felt.mean_n && felt.most_n < 2.0 * wanted_n, "{case}");
        }
    }
}

/// The whole of a step late, as where it takes as long as the time that it covers: the limit of what a device may see. A stiff column is
/// steady there with the W of its cluster; softer ones let go of the tip with either.
#[test]
fn a_device_that_sees_states_at_their_time_diverges_on_the_bodys_own_w() {
    for (young_pa, wanted_n) in [(1e4, 1.67), (1e5, 7.4), (1e6, 9.63)] {
        for rate_hz in [60.0, 30.0] {
            let free = press(young_pa, rate_hz, true, Some(own));
            let case = format!("{young_pa:e} Pa, {rate_hz} Hz, own W: {free:.2?}");
            println!("{case}");
            assert!(free.spread_n >= free.mean_n && free.least_n == 0.0 && free.most_n > 5.0 * wanted_n, "{case}");
        }
    }
    for rate_hz in [60.0, 30.0] {
        let held = press(1e6, rate_hz, true, None);
        println!("{rate_hz} Hz: {held:.2?}");
        // how deep its lightest moment is differs by rounding; it never lets go
        assert!(held.spread_n < 0.25 * held.mean_n && held.least_n > 0.0, "{rate_hz} Hz: {held:?}");
    }
}
