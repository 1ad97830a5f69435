//! Tubes meet solids and each other.

use super::super::reference_spec;
use super::Prop;
use crate::harness::{Faults, Stage};
use crate::rod::Tube;
use crate::rod::TubeSpec;
use glam::{DQuat, DVec3};
use metachron_contact::Neighbour;
use metachron_contact::{Law, Link, acknowledged};
use metachron_core::Site;
use metachron_core::{AgentId, Anchor, Body, Snapshot};
use metachron_geometry::Solid;
use std::sync::Arc;

pub(super) const RADIUS: f64 = 0.015;
pub(super) const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);
/// Rates of the tube and of the other, Hz: 1:1 to 1:100 both ways.
const RATES: [(f64, f64); 6] =
    [(1000.0, 1000.0), (1000.0, 100.0), (1000.0, 10.0), (250.0, 60.0), (100.0, 1000.0), (20.0, 1000.0)];

/// A free tube of 1 MPa along `path_m` that moves by `velocity`.
pub(super) fn thrown(path_m: Vec<DVec3>, segments: usize, velocity: DVec3) -> Tube {
    let mut tube = Tube::new(TubeSpec { path_m, friction: 0.3, ..reference_spec(1e6, segments) }).unwrap();
    let mut state = tube.state().clone();
    state.u.iter_mut().step_by(2).for_each(|v| *v = velocity);
    tube.set_state(state);
    tube
}

/// A round bar along y.
pub(super) fn bar(mass_kg: f64, position: DVec3, friction: f64) -> Prop {
    let mut bar = Prop::new(Solid::Cylinder { radius_m: 0.02, half_height_m: 0.15 }, mass_kg, position, friction);
    bar.state.rotation = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    bar
}

pub(super) fn nodes(snapshot: &Snapshot) -> &[DVec3] {
    let Body::Curve(curve) = &snapshot.body else { panic!("a tube") };
    &curve.positions
}

/// Throws a tube at a bar; faults end before the last tenth of a second. The drift of momentum at the end, the highest energy at
/// a common time as a share of the first, and how fast the bar was left.
fn throw_at_bar(rates: (f64, f64), faults: Faults) -> (f64, f64, f64) {
    let mut stage = Stage::new(faults);
    let path = vec![DVec3::new(-0.2, 0.02, 0.1), DVec3::new(0.25, 0.02, 0.1)];
    let tube = stage.add(thrown(path, 20, DVec3::new(0.2, 0.1, -1.0)), rates.0);
    let bar = stage.add(bar(0.1, DVec3::ZERO, 0.5), rates.1);
    let start = stage.momentum();
    let energy = |stage: &Stage| {
        let tube = stage.newest(tube);
        tube.energy_j + stage.settled(bar, tube.time.as_secs_f64()).kinetic_j()
    };
    let first = energy(&stage);
    let mut peak = 0.0_f64;
    stage.run(0.4, |stage| peak = peak.max(energy(stage) / first));
    stage.set_faults(Faults::default());
    let mut drift = 0.0_f64;
    stage.run(0.45, |_| {});
    stage.run(0.5, |stage| {
        drift = drift.max((stage.momentum() - start).length() / start.length());
        peak = peak.max(energy(stage) / first);
    });
    (drift, peak, stage.settled(bar, 0.5).state.velocity.z)
}

#[test]
fn a_tube_and_a_free_bar_keep_their_momentum_and_gain_no_energy_at_any_rates() {
    for rates in RATES {
        let (drift, peak, pushed) = throw_at_bar(rates, Faults::default());
        println!("{rates:?}: drift {drift:e} peak {peak} pushed {pushed}");
        assert!(pushed < -0.2, "{rates:?}: they never met: {pushed} m/s");
        assert!(drift < 1e-9, "{rates:?}: momentum drifts by {drift}"); // rounding through a factor of condition 1e5
        assert!(peak < 1.01, "{rates:?}: energy rises to {peak}");
    }
}

#[test]
fn lost_and_late_states_change_neither_momentum_nor_bring_energy() {
    for seed in 1..6 {
        let faults = Faults { jitter: 0.2, loss: 0.1, late: 2, seed };
        let (drift, peak, pushed) = throw_at_bar((1000.0, 120.0), faults);
        println!("{seed}: drift {drift:e} peak {peak} pushed {pushed}");
        assert!(pushed < -0.2, "they never met: {pushed} m/s");
        assert!(drift < 1e-9, "momentum drifts by {drift}");
        assert!(peak < 1.01, "energy rises to {peak}");
    }
}

#[test]
fn a_tube_lies_over_an_immovable_bar_at_any_rates() {
    for rates in [(60.0, 60.0), (60.0, 1000.0), (250.0, 10.0), (1000.0, 10.0)] {
        let mut stage = Stage::new(Faults::default());
        let path_m = vec![DVec3::new(-0.2, 0.0, 0.04), DVec3::new(0.2, 0.0, 0.04)];
        let base = TubeSpec { friction: 1.0, damping_per_s: 3.0, ..reference_spec(2e5, 40) };
        let tube = stage.add(Tube::new(TubeSpec { path_m, gravity: GRAVITY, ..base }).unwrap(), rates.0);
        stage.add(bar(f64::INFINITY, DVec3::ZERO, 1.0), rates.1);
        let start = stage.newest(tube).energy_j;
        let mut most = f64::MIN;
        stage.run(3.0, |stage| most = most.max(stage.newest(tube).energy_j));
        let distance = nodes(stage.newest(tube)).windows(2).map(|x| {
            // of an axis in the plane y = 0 from the bar's
            let (a, along) = (x[0], x[1] - x[0]);
            let share = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (a + along * share).length()
        });
        let deep = 0.02 + RADIUS - distance.fold(f64::INFINITY, f64::min);
        let fast = stage.newest(tube).bounds.unwrap().speed_m_s;
        println!("{rates:?}: deep {deep} fast {fast} energy {start} {most}");
        assert!(deep < 5e-3 && deep > -1e-3, "{rates:?}: {deep} m deep");
        assert!(fast < 1e-2, "{rates:?}: still moves at {fast} m/s");
        // lifted by a tenth of a millimetre at most
        assert!(most < start + 0.4 * 0.185 * 9.81 * 1e-4, "{rates:?}: {start} J rises to {most} J");
    }
}

/// The energy of a tube with all that `owner` has given it and it has not taken, J: v·J + ½ J·A⁻¹ J more.
fn with_mail(stage: &Stage, tube: AgentId, owner: AgentId) -> f64 {
    let snapshot = stage.newest(tube);
    let Body::Curve(curve) = &snapshot.body else { panic!("a tube") };
    let response = snapshot.inertia.response();
    let known = response.and_then(|response| Some((response, response.curve()?.spins())));
    let Some((inertia, spins)) = known else { return snapshot.energy_j };
    let mut impulses = vec![DVec3::ZERO; inertia.slots()];
    let seen = Neighbour::observed(tube, Arc::new(snapshot.clone()));
    for ledger in stage.newest(owner).given.iter().filter(|ledger| ledger.with == tube) {
        ledger.since(acknowledged(&seen, owner), snapshot.time, |site, sum, _| {
            let Site::Arc(arc_m) = site else { panic!("a site of a tube") };
            let (segment, share) = curve.locate(arc_m).unwrap();
            impulses[2 * segment] += sum.linear * (1.0 - share);
            impulses[2 * segment + 2] += sum.linear * share;
            impulses[2 * segment + 1] += sum.angular;
        });
    }
    let mut answer = impulses.clone();
    inertia.respond(&mut answer, false);
    let velocity = |slot: usize| if slot.is_multiple_of(2) { curve.velocities[slot / 2] } else { spins[slot / 2] };
    let work = impulses.iter().zip(&answer).enumerate().map(|(slot, (j, dv))| j.dot(velocity(slot) + *dv * 0.5));
    snapshot.energy_j + work.sum::<f64>()
}

#[test]
fn two_tubes_that_cross_part_again_with_their_momentum_at_any_rates() {
    for rates in RATES {
        let mut stage = Stage::new(Faults::default());
        let low = thrown(vec![DVec3::X * -0.2, DVec3::X * 0.2], 20, DVec3::ZERO);
        let across = vec![DVec3::new(0.03, -0.25, 0.05), DVec3::new(0.03, 0.25, 0.05)];
        let high = thrown(across, 24, DVec3::new(0.1, 0.05, -1.0));
        let (low, high) = (stage.add(low, rates.0), stage.add(high, rates.1));
        let start = stage.momentum();
        let first = stage.newest(low).energy_j + stage.newest(high).energy_j;
        let (mut drift, mut raw, mut peak) = (0.0_f64, 0.0_f64, 0.0_f64);
        stage.run(0.6, |stage| {
            drift = drift.max((stage.momentum() - start).length() / start.length());
            raw = raw.max((stage.newest(low).energy_j + stage.newest(high).energy_j) / first);
            peak = peak.max((with_mail(stage, low, high) + with_mail(stage, high, low)) / first);
        });
        let last = (stage.newest(low).energy_j + stage.newest(high).energy_j) / first;
        let [a, b] = [low, high].map(|id| nodes(stage.newest(id))[10].z);
        println!("{rates:?}: drift {drift:e} raw {raw} peak {peak} last {last} z {a} {b}");
        assert!(a < -0.05, "{rates:?}: they never met");
        assert!(b > a, "{rates:?}: they passed through each other: {a} {b}");
        assert!(drift < 1e-9, "{rates:?}: momentum drifts by {drift}");
        assert!(last < 1.01, "{rates:?}: energy ends at {last}");
        assert!(peak < 1.01, "{rates:?}: energy rises to {peak}");
    }
}

/// How far a tube of 54 g sinks in half a second between two fingers that press it with `press_n` each.
fn sink(press_n: f64, finger_rate: f64) -> f64 {
    let mut stage = Stage::new(Faults::default());
    let path_m = vec![DVec3::new(0.0, -0.15, 0.0), DVec3::new(0.0, 0.15, 0.0)];
    let spec = TubeSpec { path_m, gravity: GRAVITY, friction: 0.5, damping_per_s: 5.0, ..reference_spec(5e6, 20) };
    let tube = stage.add(Tube::new(spec).unwrap(), 500.0);
    for side in [-1.0, 1.0] {
        let at = DVec3::X * (side * (RADIUS + 0.0101));
        let mut finger = Prop::new(Solid::Box { half_extents_m: DVec3::new(0.01, 0.03, 0.02) }, 0.5, at, 0.5);
        finger.force = DVec3::X * (-side * press_n);
        finger.guided = Some((at, 1e5, 400.0));
        stage.add(finger, finger_rate);
    }
    let middle = |stage: &Stage| nodes(stage.newest(tube))[10].z;
    stage.run(0.5, |_| {});
    let before = middle(&stage);
    stage.run(1.0, |_| {});
    println!("{press_n} {finger_rate}: {before} -> {}", middle(&stage));
    before - middle(&stage)
}

#[test]
fn two_fingers_hold_a_tube_against_gravity_by_friction() {
    for finger_rate in [500.0, 100.0, 50.0] {
        // weight 0.54 N; friction at both sides can carry twice 0.5 × 2 N, or twice 0.5 × 0.3 N
        let (held, slipped) = (sink(2.0, finger_rate), sink(0.3, finger_rate));
        assert!(held.abs() < 1e-3, "{finger_rate} Hz: sank by {held} m");
        assert!(slipped > 0.02, "{finger_rate} Hz: sank by {slipped} m only");
    }
}

#[test]
fn a_link_pulls_both_ends_alike_and_brings_them_together() {
    for (rates, rest_m) in [((1000.0, 1000.0), 0.0), ((1000.0, 60.0), 0.0), ((250.0, 60.0), 0.05), ((60.0, 60.0), 0.0)]
    {
        let mut stage = Stage::new(Faults::default());
        let path = vec![DVec3::X * -0.2, DVec3::X * 0.2];
        let tube = stage.add(thrown(path, 20, DVec3::new(0.1, 0.3, 0.0)), rates.0);
        let other = stage.add(bar(0.05, DVec3::new(0.25, 0.0, 0.0), 0.5), rates.1);
        stage.law(tube, other, Law::Off);
        let link = Link {
            other,
            here: Anchor::Arc(0.4),
            there: Anchor::Local(DVec3::ZERO),
            stiffness_n_m: 200.0,
            damping_n_s_m: 1.0,
            rest_m,
            law: Law::Cluster,
        };
        stage.link(tube, link);
        let start = stage.momentum();
        let energy = |stage: &Stage| {
            let tube = stage.newest(tube);
            tube.energy_j + stage.settled(other, tube.time.as_secs_f64()).kinetic_j()
        };
        let first = energy(&stage) + 0.5 * 200.0 * 0.05 * 0.05;
        let (mut drift, mut peak) = (0.0_f64, 0.0_f64);
        stage.run(2.0, |stage| {
            drift = drift.max((stage.momentum() - start).length() / start.length());
            peak = peak.max(energy(stage) / first);
        });
        let [a, b] = [nodes(stage.newest(tube))[20], stage.settled(other, 2.0).state.position];
        println!("{rates:?}: drift {drift:e} peak {peak} apart {}", a.distance(b));
        assert!(drift < 1e-9, "{rates:?}: momentum drifts by {drift}");
        assert!(peak < 1.01, "{rates:?}: energy rises to {peak}");
        assert!((a.distance(b) - rest_m).abs() < 0.01, "{rates:?}: {} m apart", a.distance(b));
    }
}

#[test]
fn a_body_at_rest_is_woken_by_a_blow_and_not_by_a_touch() {
    for (speed, wakes) in [(0.003, false), (0.5, true)] {
        let mut stage = Stage::new(Faults::default());
        let path = vec![DVec3::new(-0.2, 0.0, 0.0351), DVec3::new(0.2, 0.0, 0.0351)];
        let tube = stage.add(thrown(path, 20, DVec3::Z * -speed), 500.0);
        let mut sleeper = bar(0.1, DVec3::ZERO, 0.5);
        sleeper.at_rest = true;
        let sleeper = stage.add(sleeper, 500.0);
        let mut woken = false;
        stage.run(0.1, |stage| woken |= stage.newest(tube).touches.contains(&sleeper));
        let moved = stage.settled(sleeper, 0.1).state.velocity.length() > 0.0;
        assert_eq!((woken, moved), (wakes, wakes), "at {speed} m/s");
        assert!(wakes || nodes(stage.newest(tube))[10].z > 0.0349, "it went through");
    }
}
