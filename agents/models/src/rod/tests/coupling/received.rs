//! What a tube is given.

use super::super::{Random, free_tube, millis, reference_spec, run};
use crate::rod::CurveInertia;
use crate::rod::Tube;
use crate::rod::TubeSpec;
use glam::DVec3;
use metachron_contact::{Agent, Neighbour, StepContext};
use metachron_core::{AgentId, ImpulseResponse, Resolution, SimTime, Snapshot};
use metachron_core::{Impulse, Ledger, Site};
use std::sync::Arc;

const ME: AgentId = AgentId(0);
const GIVER: AgentId = AgentId(1);

/// An owner that has given `sites` impulses at random, at time zero; and the sum of them.
fn giver(tube: &Tube, seed: u64) -> (Neighbour, DVec3) {
    let mut random = Random(seed);
    let mut ledger = Ledger::new(ME);
    let mut total = DVec3::ZERO;
    for k in 0..7 {
        let site = Site::Arc(tube.length_m() * (f64::from(k) + 0.3) / 7.0);
        let impulse = Impulse { linear: random.vector() * 1e-3, angular: random.vector() * 1e-6 };
        total += impulse.linear;
        ledger.give(site, SimTime::ZERO, 0.0, impulse);
    }
    let snapshot = Snapshot { given: vec![ledger], ..Snapshot::default() };
    (Neighbour::observed(GIVER, Arc::new(snapshot)), total)
}

fn step(tube: &mut Tube, time: SimTime, neighbours: &[Neighbour]) {
    let around = StepContext { neighbours, ..StepContext::alone(ME, time) };
    tube.step(millis(4.0), &around).unwrap();
}

#[test]
fn what_is_given_is_momentum_gained_before_the_first_step_and_after_a_change_of_division() {
    for (steps, wanted) in [(0.0, None), (0.1, None), (0.1, Some(1.0 / 31.0)), (0.0, Some(1.0 / 9.0))] {
        let mut tube = free_tube(20);
        run(&mut tube, 4.0, steps);
        let (giver, total) = giver(&tube, 5);
        if let Some(eps_m) = wanted {
            tube.set_resolution(Resolution { eps_m, n: 3 });
        }
        let before = tube.momentum().0;
        step(&mut tube, SimTime::ZERO + millis(4.0), std::slice::from_ref(&giver));
        let gained = tube.momentum().0 - before;
        // sums of a hundred terms through a factor of condition 1e4
        assert!((gained - total).length() < 1e-11 * total.length(), "{wanted:?}: {gained} of {total}");
        // the same again is nothing new
        step(&mut tube, SimTime::ZERO + millis(8.0), std::slice::from_ref(&giver));
        let again = tube.momentum().0 - before;
        assert!((again - total).length() < 1e-11 * total.length(), "{wanted:?}: {again} of {total}");
    }
}

#[test]
fn what_was_given_long_ago_has_carried_the_tube_since() {
    let mut tube = free_tube(20);
    let centre = |tube: &Tube| {
        let x = &tube.state().x;
        x.windows(2).map(|p| (p[0] + p[1]) * 0.5).sum::<DVec3>() / (x.len() - 1) as f64
    };
    let (giver, total) = giver(&tube, 9);
    let before = centre(&tube);
    step(&mut tube, SimTime::ZERO + millis(8.0), std::slice::from_ref(&giver));
    let way = centre(&tube) - before;
    // a tube in no field: 8 ms late and a step of 4 ms
    let want = total / tube.mass_kg() * 0.012;
    assert!((way - want).length() < 1e-9 * want.length(), "{way} is not {want}");
}

#[test]
fn a_held_end_takes_nothing() {
    let mut tube = Tube::new(TubeSpec { clamp: [true, false], ..reference_spec(1e6, 20) }).unwrap();
    let mut ledger = Ledger::new(ME);
    ledger.give(Site::Arc(0.0), SimTime::ZERO, 0.0, Impulse { linear: DVec3::Y, angular: DVec3::ZERO });
    let snapshot = Snapshot { given: vec![ledger], ..Snapshot::default() };
    let before = tube.state().x.clone();
    step(&mut tube, SimTime::ZERO + millis(8.0), &[Neighbour::observed(GIVER, Arc::new(snapshot))]);
    assert_eq!(tube.state().x[0], before[0]);
    let moved = tube.state().x.iter().zip(&before).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(moved < 1e-12, "{moved}"); // rounding of positions near 1 m
}

#[test]
fn a_tube_takes_nothing_that_is_not_finite() {
    let mut tube = free_tube(10);
    let mut ledger = Ledger::new(ME);
    ledger.give(Site::Arc(0.3), SimTime::ZERO, 0.0, Impulse { linear: DVec3::NAN, angular: DVec3::ZERO });
    let snapshot = Snapshot { given: vec![ledger], ..Snapshot::default() };
    step(&mut tube, SimTime::ZERO, &[Neighbour::observed(GIVER, Arc::new(snapshot))]);
    assert!(tube.state().is_finite());
    assert!(tube.momentum().0.length() < 1e-15);
}

#[test]
fn the_published_inertia_is_the_inverse_mass_of_every_point() {
    let spec = TubeSpec { clamp: [true, false], gravity: DVec3::NEG_Z * 9.81, ..reference_spec(1e5, 24) };
    let mut tube = Tube::new(spec).unwrap();
    let form = tube.form();
    let near = Neighbour { form, ..Neighbour::observed(GIVER, Arc::new(Snapshot::default())) };
    for k in 0..50 {
        step(&mut tube, SimTime::ZERO + millis(4.0 * f64::from(k)), std::slice::from_ref(&near));
    }
    let mut snapshot = Snapshot::default();
    tube.write_snapshot(&mut snapshot);
    let curve = snapshot.inertia.response_mut::<CurveInertia>();
    for arc_m in [0.0, 0.02, 0.31, 0.5, 0.77, 1.0] {
        let (segment, share) = tube.division().locate(arc_m);
        let want = tube.inverse_mass(arc_m).unwrap();
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let mut slots = vec![DVec3::ZERO; curve.slots()];
            slots[2 * segment] = axis * (1.0 - share);
            slots[2 * segment + 2] = axis * share;
            curve.respond(&mut slots, false);
            let got = slots[2 * segment].lerp(slots[2 * segment + 2], share);
            let want = want * axis;
            assert!((got - want).length() <= 1e-11 * want.length(), "{arc_m}: {got} is not {want}");
        }
    }
}

#[test]
fn a_tube_that_nobody_is_near_does_not_publish_its_factor() {
    let mut tube = free_tube(10);
    run(&mut tube, 4.0, 0.1);
    let mut snapshot = Snapshot::default();
    tube.write_snapshot(&mut snapshot);
    assert!(matches!(snapshot.inertia, metachron_core::Inertia::Immovable));
    assert!(snapshot.given.is_empty() && snapshot.taken.is_empty() && snapshot.pairs.is_empty());
}
