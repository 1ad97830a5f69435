//! Momentum and energy of agents with different clocks at one common time, against closed forms.

use glam::{DQuat, DVec3};
use metachron_contact::audit::*;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, AnchorSpring, StepContext};
use metachron_core::{AgentId, Anchor, Body, Impulse, Ledger, RigidState, SimSpan, SimTime, Site, Snapshot};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};

const MOMENTS: DVec3 = DVec3::new(0.02, 0.03, 0.04);

fn at(seconds: f64) -> SimTime {
    SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
}

fn ball(time: f64, position: DVec3, velocity: DVec3, spin: DVec3) -> Snapshot {
    let rotation = DQuat::from_rotation_x(0.3);
    let state = RigidState { position, rotation, velocity, spin };
    let inertia = rigid_inertia(2.0, MOMENTS, rotation);
    Snapshot { time: at(time), body: Body::Rigid(state), inertia, ..Snapshot::default() }
}

fn member(id: u32, snapshot: &Snapshot) -> Member<'_> {
    Member { id: AgentId(id), snapshot, mass_per_length_kg_m: 0.0 }
}

#[test]
fn falling_bodies_of_different_clocks_keep_the_energy_of_the_fall() {
    let g = DVec3::NEG_Z * 9.81;
    let dropped = |time: f64| {
        let (x, v) = (DVec3::Z - DVec3::Z * (0.5 * 9.81 * time * time), g * time);
        Snapshot { acceleration: g, ..ball(time, x, v, DVec3::ZERO) }
    };
    let (early, late) = (dropped(0.1), dropped(0.25));
    let members = [member(0, &early), member(1, &late)];
    let sum = audit(&members, at(0.3), &mut |_, state| -2.0 * g.dot(state.position));
    assert!((sum.energy_j - 2.0 * 2.0 * 9.81).abs() < 1e-12, "{sum:?}");
    assert!((sum.momentum - g * (0.3 * 4.0)).length() < 1e-12, "{sum:?}");
}

#[test]
fn an_impulse_that_only_its_owner_has_applied_is_counted_once() {
    // one of two equal bodies meets the other, elastically, at 0.15 s: it has stopped, and the other has not received its impulse
    let blow = DVec3::X * 2.0;
    let mut owner = ball(0.2, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let mut ledger = Ledger::new(AgentId(1));
    ledger.give(Site::Whole, at(0.15), 0.0, Impulse { linear: blow, angular: DVec3::ZERO });
    owner.given.push(ledger.clone());
    let mut other = ball(0.1, DVec3::X * 0.1, DVec3::ZERO, DVec3::ZERO);
    let sum =
        |owner: &Snapshot, other: &Snapshot| audit(&[member(0, owner), member(1, other)], at(0.2), &mut |_, _| 0.0);
    let before = sum(&owner, &other);
    assert!((before.energy_j - 1.0).abs() < 1e-12 && before.momentum == blow, "{before:?}"); // 2 kg at 1 m/s
    assert_eq!(before.in_flight_n_s, 2.0);
    // 0.05 s after the impact at 1 m/s, on the line through the origin: no angular momentum
    assert!(before.angular.length() < 1e-15);
    other.taken.push(Ledger { with: AgentId(0), ..ledger });
    assert_eq!(sum(&owner, &other).momentum, DVec3::ZERO, "what was taken is not delivered again");
}

#[test]
fn an_angular_impulse_turns_the_body_about_its_own_axes() {
    let (owner, other) = (ball(0.0, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO), ball(0.0, DVec3::Y, DVec3::X, DVec3::Z));
    let mut ledger = Ledger::new(AgentId(1));
    let twist = DVec3::new(0.1, -0.2, 0.3);
    ledger.give(Site::Whole, at(0.0), 0.0, Impulse { linear: DVec3::ZERO, angular: twist });
    let pushed = Snapshot { given: vec![ledger], ..owner.clone() };
    let of = |owner: &Snapshot| audit(&[member(0, owner), member(1, &other)], at(0.0), &mut |_, _| 0.0);
    assert!((of(&pushed).angular - of(&owner).angular - twist).length() < 1e-15);
}

/// A free tube that a user spring has swung for a while.
fn swung() -> Tube {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(0.015, 0.002, material);
    let mut tube = Tube::new(TubeSpec::free(vec![DVec3::ZERO, DVec3::X], section, 12)).unwrap();
    let hand = AnchorSpring {
        by: None,
        anchor: Anchor::Arc(0.8),
        target: DVec3::new(1.0, 0.7, 0.4),
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 5.0,
        damping_n_s_m: 0.0,
    };
    let mut stepper = LoneStepper::default();
    for k in 0..40 {
        let around = StepContext { user_springs: &[hand], ..StepContext::alone(AgentId(0), at(0.004 * f64::from(k))) };
        stepper.step(&mut tube, SimSpan::from_secs_f64(0.004).unwrap(), around).unwrap();
    }
    tube
}

#[test]
fn the_audit_of_a_tube_gives_its_own_energy_and_momentum() {
    let tube = swung();
    let mut snapshot = Snapshot::default();
    tube.write_snapshot(&mut snapshot);
    let spec = tube.spec();
    let mass_per_length_kg_m = spec.section.mass_per_length_kg_m;
    let member = Member { id: AgentId(0), snapshot: &snapshot, mass_per_length_kg_m };
    let sum = audit(&[member], SimTime::ZERO, &mut |_, _| 0.0);
    let (momentum, angular) = tube.momentum();
    assert!(momentum.length() > 0.1 && (sum.momentum - momentum).length() < 1e-14, "{sum:?} {momentum}");
    // a tube does not publish how its segments turn: a tenth of a thousandth of the whole
    assert!((sum.angular - angular).length() < 1e-3 * angular.length(), "{sum:?} {angular}");
    assert!((sum.energy_j - tube.energy_j()).abs() < 1e-14); // one sum and one difference
}
