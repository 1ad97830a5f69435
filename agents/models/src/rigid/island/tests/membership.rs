//! Coming and going: nobody's motion jumps, and who has come apart is told.

use super::*;

fn drifting(x: f64, v: f64) -> RigidSpec {
    let spin = DVec3::new(0.3, 0.2, -0.1);
    RigidSpec { velocity: DVec3::X * v, spin, gravity: DVec3::ZERO, ..cube(0.1, DVec3::new(x, 0.01 * x, 1.0 / 3.0)) }
}

/// The bits of a body's state.
fn bits(party: &Party, index: usize) -> u64 {
    party.snapshot(index).fold_hash(metachron_core::HASH_START)
}

#[test]
fn a_body_enters_and_leaves_without_a_jump() {
    let mut party = Party::new([drifting(0.0, 0.2), drifting(1.0, -0.2), drifting(3.0, 0.0)]);
    let mut third = party.bodies.pop().unwrap();
    let still = |body: &RigidBody| {
        let mut snapshot = Snapshot::default();
        body.write_snapshot(&mut snapshot);
        (snapshot.fold_hash(metachron_core::HASH_START), snapshot.energy_j)
    };
    party.run(0.01, 0.3);
    let before = still(&third);
    party.bodies.push(third);
    assert_eq!((bits(&party, 2), party.snapshot(2).energy_j), before);
    // nothing touches: a step of the island is the same flight as alone, to the solver's precision
    let (start, spin) = (party.state(2), party.state(2).spin);
    party.run(0.01, 0.1);
    let after = party.state(2);
    assert!(after.position.distance(start.position + start.velocity * 0.1) < 1e-12);
    assert!((after.spin - spin).length() < 1e-6, "{} is not {spin}", after.spin);
    let before = bits(&party, 2);
    third = party.bodies.pop().unwrap();
    party.run(0.01, 0.1);
    assert_eq!(still(&third).0, before, "who has left is not moved by the others");
    let alone = third.step(SimSpan::from_secs_f64(0.01).unwrap(), &StepContext::alone(AgentId(2), SimTime::ZERO));
    alone.unwrap();
}

#[test]
fn those_who_do_not_touch_for_a_while_have_come_apart() {
    // two pairs that touch, drifting away from each other, and a loner
    let mut party = Party::new([
        drifting(0.0, 0.0),
        drifting(2.0, 0.3),
        drifting(0.2, 0.0),
        drifting(2.2, 0.3),
        drifting(9.0, 0.0),
    ]);
    let spinless = party.bodies.iter_mut();
    spinless.for_each(|body| body.motion.angular = DVec3::ZERO);
    let mut told = None;
    for _ in 0..60 {
        party.step(0.01);
        assert_eq!(party.apart.len(), 4);
        if party.apart.iter().any(|&group| group != 0) {
            told = Some(party.apart.clone());
            break;
        }
    }
    let apart = told.expect("they come apart within 0.6 s");
    assert_eq!(apart[1], 0, "the second touches the leader: {apart:?}");
    assert!(apart[0] != 0 && apart[0] == apart[2], "a pair leaves together: {apart:?}");
    assert!(apart[3] != 0 && apart[3] != apart[0], "the loner leaves alone: {apart:?}");
}

#[test]
fn the_same_steps_give_the_same_bits() {
    let run = || {
        let at = |i: u32| DVec3::new(0.03 * f64::from(i), 0.0, 0.1 + 0.25 * f64::from(i));
        let mut party =
            Party::new((0..6).map(|i| RigidSpec { obstacles: floor(0.5, DQuat::IDENTITY), ..cube(0.1, at(i)) }));
        party.run(0.008, 1.0);
        (0..6).map(|i| bits(&party, i)).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn a_companion_that_is_lost_leaves_everybody_as_before() {
    let mut party = Party::new([drifting(0.0, 0.2), drifting(1.0, -0.2)]);
    party.run(0.01, 0.1);
    party.bodies[1].motion.velocity = DVec3::splat(f64::NAN);
    let before = bits(&party, 0);
    let (leader, others) = party.bodies.split_first_mut().unwrap();
    let id = AgentId(1);
    let mut others = [IslandMember { id, agent: &mut others[0], context: StepContext::alone(id, SimTime::ZERO) }];
    let dt = SimSpan::from_secs_f64(0.01).unwrap();
    let error =
        leader.step_island(dt, &StepContext::alone(AgentId(0), SimTime::ZERO), &mut others, &mut vec![]).unwrap_err();
    assert!(matches!(error, metachron_core::StepError::Diverged { .. }), "{error}");
    assert_eq!(bits(&party, 0), before);
}
