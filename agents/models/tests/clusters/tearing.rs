//! Links and joints that tear, against closed forms: weights that hang or fall, ramps, momentum, equal bits.

use crate::bodies::tube;
use crate::hung::{self, ALL, CENTRE, G, Held, Limits, WEIGHT_N, ball, balls};
use crate::table::{GRAVITY, Table, spring};
use glam::DVec3;
use metachron_contact::constraint::FailedAttachment;
use metachron_contact::joint::{Joint, JointKind};
use metachron_contact::member::Partner;
use metachron_contact::step::StepDoubling;
use metachron_contact::{AnchorSpring, Link};
use metachron_core::{AgentId, Anchor, Resolution};
use metachron_models::rigid::RigidSpec;

/// The ball on a hold that tears above some force.
fn hung(held: Held, tears_above_n: f64) -> Table {
    hung::hung(held, Limits { tears_above_n, yields_above_n: f64::INFINITY })
}

/// The ball's place above its start, metres.
fn height_m(table: &mut Table) -> f64 {
    table.middle(0).0.z
}

#[test]
fn a_weight_below_the_tearing_force_hangs() {
    hung::check_hangs(Limits { tears_above_n: 1.1 * WEIGHT_N, yields_above_n: f64::INFINITY });
}

#[test]
fn a_weight_above_the_tearing_force_tears_it_at_once_and_falls_freely() {
    for held in ALL {
        let mut table = hung(held, 0.9 * WEIGHT_N);
        let (_, h_s) = table.step();
        let [torn] = *table.torn() else { panic!("{held:?}: {:?}", table.torn()) };
        let other = matches!(held, Held::Beam(_) | Held::Link { .. }).then_some(1);
        let partner = if matches!(held, Held::Link { .. }) { Partner::Link(0) } else { Partner::Joint(0) };
        assert_eq!((torn.member, torn.other, torn.partner), (0, other, partner), "{held:?}");
        // a spring gives way in its step: by k h² of its mass, 14 % at 60 Hz
        assert!(torn.force_n > 0.9 * WEIGHT_N && torn.force_n < 1.001 * WEIGHT_N, "{held:?}: {} N", torn.force_n);
        let (start, speed) = table.middle(0);
        let begun_s = table.time.as_secs_f64();
        for step in 0..60 {
            table.step();
            assert_eq!(table.torn(), [], "{held:?}: once only");
            let t_s = table.time.as_secs_f64() - begun_s;
            let fallen = start + speed * t_s + GRAVITY * (0.5 * t_s * t_s);
            assert!(table.middle(0).0.distance(fallen) < 1e-9, "{held:?}, step {step}");
        }
        // from the moment of the event to within a step
        let late_m = (height_m(&mut table) + 0.5 * G * 1.0).abs();
        assert!(late_m < G * h_s, "{held:?}: {late_m} m");
    }
}

#[test]
fn a_ramp_tears_a_joint_within_one_step_of_its_threshold() {
    for rate_hz in [60.0, 240.0] {
        // between two steps of either rate
        let (threshold_n, stiffness_n_m, speed_m_s) = (49.0, 100.0, 1.0);
        let kind = JointKind::Fixed;
        let joint = Joint { tears_above_n: threshold_n, ..Joint::new(AgentId(0), None, kind) };
        let mut table = balls([ball(DVec3::ZERO, 1.0, DVec3::ZERO)]).jointed([joint]);
        table.bodies[0].rate_hz = rate_hz;
        loop {
            let target = DVec3::X * (speed_m_s * table.time.as_secs_f64());
            let (anchor, target_velocity) = (CENTRE, DVec3::X * speed_m_s);
            let hand = AnchorSpring { by: None, anchor, target, target_velocity, stiffness_n_m, damping_n_s_m: 0.0 };
            table.bodies[0].user_springs = vec![hand];
            table.step();
            if let [torn] = *table.torn() {
                // the hand's force at the end of a step is that of the whole step, 100 N a second
                let late_n = torn.force_n - threshold_n;
                assert!(late_n > 0.0 && late_n <= 100.0 / rate_hz + 1e-6, "{rate_hz} Hz: {} N", torn.force_n);
                let late_s = table.time.as_secs_f64() - threshold_n / (stiffness_n_m * speed_m_s);
                assert!((-1e-9..=1.0 / rate_hz + 1e-9).contains(&late_s), "{rate_hz} Hz: {late_s} s late");
                break;
            }
            assert!(table.time.as_secs_f64() < 1.0, "{rate_hz} Hz: it holds");
        }
    }
}

/// Two balls that fly apart at 2 m/s, 1 kg and 3 kg, on a spring of 100 N/m that tears above 5 N.
fn parting() -> Table {
    let apart = |x: f64, mass_kg: f64, m_s: f64| RigidSpec {
        velocity: DVec3::X * m_s,
        ..ball(DVec3::X * x, mass_kg, DVec3::ZERO)
    };
    let mut table = balls([apart(0.0, 1.0, -1.5), apart(0.2, 3.0, 0.5)]);
    let link = Link { tears_above_n: 5.0, ..spring(100.0, 0.0, 0.2) };
    table.link([(0, CENTRE), (1, CENTRE)], link);
    table
}

#[test]
fn what_tears_keeps_momentum_and_both_ends_fly_on() {
    let mut table = parting();
    let mut flight = None;
    for step in 0..60 {
        table.step();
        let momentum: DVec3 = (0..2).map(|body| table.bodies[body].agent.momentum().0).sum();
        assert!(momentum.length() < 1e-14, "step {step}: {momentum}");
        let speeds = [0, 1].map(|body| table.middle(body).1);
        if let Some(flight) = flight {
            assert_eq!(speeds, flight, "step {step}");
            assert!(table.grips(0).is_empty() && table.grips(1).is_empty(), "step {step}");
        }
        if !table.torn().is_empty() {
            flight = Some(speeds);
        }
    }
    let [first, second] = flight.unwrap();
    // they stretched it to 5 N at least: 0.125 J of the 1.5 J that they had
    let left_j = 0.5 * first.length_squared() + 1.5 * second.length_squared();
    assert!(left_j < 1.5 - 0.125 && left_j > 1.0, "{left_j} J");
}

#[test]
fn the_same_run_tears_in_the_same_step_with_the_same_bits_repeated_in_halves_or_not() {
    let play = |doubling: bool| {
        let mut table = parting();
        table.doubling = doubling.then(StepDoubling::default);
        let mut seen: Vec<(usize, FailedAttachment)> = vec![];
        for step in 0..60 {
            table.step();
            seen.extend(table.torn().iter().map(|torn| (step, *torn)));
        }
        (seen, [0, 1].map(|body| table.middle(body)))
    };
    let once = play(false);
    assert_eq!(once.0.len(), 1);
    assert_eq!(play(false), once);
    assert_eq!(play(true), once);
}

#[test]
fn a_tube_hung_by_two_links_tears_the_one_that_is_weaker_then_the_other() {
    // either link bears half of its weight, and all of it once it is alone
    let hook = |y: f64| ball(DVec3::new(0.0, y, 0.4), 1e6, DVec3::ZERO);
    let mut table = balls([hook(-0.08), hook(0.08)]);
    let hose = tube(DVec3::Z * 0.3, DVec3::new(0.0, 0.08, 0.0), 0.01);
    let weight_n = hose.agent.mass_kg() * G;
    table.bodies.push(hose);
    table.touching = false;
    for (end, arc_m, share) in [(0, 0.0, 0.3), (1, 0.16, 0.8)] {
        let link = Link { tears_above_n: share * weight_n, ..spring(200.0, 1.0, 0.05) };
        table.link([(end, CENTRE), (2, Anchor::Arc(arc_m))], link);
    }
    let mut torn = vec![];
    while table.time.as_secs_f64() < 2.0 {
        table.step();
        torn.extend_from_slice(table.torn());
    }
    let order: Vec<_> = torn.iter().map(|torn| (torn.member, torn.other, torn.partner)).collect();
    assert_eq!(order, [(0, Some(2), Partner::Link(0)), (1, Some(2), Partner::Link(1))]);
    assert!(table.middle(2).1.z < -5.0, "it falls");
}

/// A tube that hangs along all of its length, and tears off at this share of its weight.
fn mesentery(share: f64) -> Table {
    hung::mesentery(0.0, |weight_n| Limits { tears_above_n: share * weight_n, yields_above_n: f64::INFINITY })
}

#[test]
fn a_tube_hangs_by_its_attachment_below_the_tearing_force_and_falls_above_it() {
    let mut table = mesentery(1.1);
    while table.time.as_secs_f64() < 2.0 {
        table.step();
        assert_eq!(table.torn(), []);
    }
    assert!((table.middle(0).0.z + 1e-3).abs() < 1e-6, "{}", table.middle(0).0);

    let mut table = mesentery(0.9);
    table.doubling = Some(StepDoubling::default());
    let weight_n = table.bodies[0].agent.mass_kg() * G;
    let (torn, given_n) = loop {
        let before = table.bodies[0].agent.momentum().0;
        let (_, h_s) = table.step();
        if let [torn] = *table.torn() {
            break (torn, (table.bodies[0].agent.momentum().0 - before).z / h_s + weight_n);
        }
        assert!(table.time.as_secs_f64() < 1.0, "it holds");
    };
    assert_eq!((torn.member, torn.other, torn.partner), (0, None, Partner::Attachment(0)));
    // its weight, and the force that slows it down
    assert!((torn.force_n - given_n).abs() < 1e-9 * weight_n, "{} N is not {given_n} N", torn.force_n);
    assert!(torn.force_n > 0.9 * weight_n && torn.force_n < 1.05 * weight_n, "{} of {weight_n} N", torn.force_n);
    // it falls from that moment on, and goes on falling once it is divided anew
    let (begun_s, momentum) = (table.time.as_secs_f64(), table.bodies[0].agent.momentum().0);
    for step in 0..60 {
        if step == 30 {
            table.bodies[0].agent.set_resolution(Resolution { eps_m: 0.04, n: 0 });
        }
        table.step();
        assert_eq!(table.torn(), [], "once only");
        let wanted = momentum + DVec3::Z * (-weight_n * (table.time.as_secs_f64() - begun_s));
        let found = table.bodies[0].agent.momentum().0;
        assert!(found.distance(wanted) < 1e-9 * weight_n, "step {step}: {found} is not {wanted}");
    }
}

#[test]
fn steps_that_are_cut_short_tear_nothing_that_holds() {
    // a joint that is off by a micrometre takes that back in whatever step is next: in one of 17 µs by a thousand weights
    for rate_hz in [60.0, 240.0, 1000.0, 4000.0] {
        for share in [0.5, 0.1, 1e-2, 1e-3] {
            for held in ALL {
                let mut table = hung(held, 1.1 * WEIGHT_N);
                table.bodies.iter_mut().for_each(|body| body.rate_hz = rate_hz);
                for step in 0..200 {
                    table.step_share(if step % 7 == 3 { share } else { 1.0 });
                    assert_eq!(table.torn(), [], "{rate_hz} Hz, every seventh step {share} of it, {held:?}");
                }
            }
        }
    }
}
