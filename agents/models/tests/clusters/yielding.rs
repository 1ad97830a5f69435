//! Links and joints that yield, against closed forms: weights that hang or slide down, sliders that stop, energy, equal bits.

use crate::bodies::tube;
use crate::hung::{self, ALL, CENTRE, G, Held, Limits, MASS_KG, WEIGHT_N, ball, balls};
use crate::table::{Table, spring};
use glam::DVec3;
use metachron_contact::joint::{Joint, JointKind};
use metachron_contact::member::Partner;
use metachron_contact::step::StepDoubling;
use metachron_contact::{AnchorSpring, Link};
use metachron_core::{AgentId, Anchor, Resolution, Snapshot};
use metachron_models::rigid::RigidSpec;

/// The ball on a hold that yields above some force.
fn hung(held: Held, yields_above_n: f64) -> Table {
    hung::hung(held, Limits { yields_above_n, tears_above_n: f64::INFINITY })
}

#[test]
fn a_weight_below_the_yield_force_hangs() {
    hung::check_hangs(Limits { yields_above_n: 1.1 * WEIGHT_N, tears_above_n: f64::INFINITY });
}

#[test]
fn a_weight_above_the_yield_force_slides_down_at_the_rest_of_its_weight() {
    for rate_hz in [60.0, 240.0] {
        for held in ALL {
            let mut table = hung(held, 0.9 * WEIGHT_N);
            table.bodies[0].rate_hz = rate_hz;
            let mut begun = vec![];
            while table.time.as_secs_f64() < 0.5 {
                table.step();
                begun.extend_from_slice(table.yielded());
            }
            let [yielded] = begun[..] else { panic!("{held:?}: {begun:?}") };
            let other = matches!(held, Held::Beam(_) | Held::Link { .. }).then_some(1);
            let partner = if matches!(held, Held::Link { .. }) { Partner::Link(0) } else { Partner::Joint(0) };
            assert_eq!((yielded.member, yielded.other, yielded.partner), (0, other, partner), "{held:?}");
            assert_eq!(yielded.force_n, 0.9 * WEIGHT_N, "{held:?}");
            // from the first step on: 0.9 m g of m g; a link's spring gives way a little before it gives that much
            let (place, velocity) = table.middle(0);
            let (wanted_m, wanted_m_s) = (-0.05 * G * 0.25, -0.1 * G * 0.5);
            assert!((velocity.z - wanted_m_s).abs() < 0.02 * G * 0.5, "{held:?} at {rate_hz} Hz: {velocity} m/s");
            assert!(
                (place.z - wanted_m).abs() < 0.02 * 0.5 * G * 0.25 + 1.0 / rate_hz * 0.1 * G,
                "{held:?} at {rate_hz} Hz: {place}"
            );
        }
    }
}

#[test]
fn a_slider_stops_where_its_motion_is_used_up_and_is_held_there() {
    for kind in [
        JointKind::Fixed,
        JointKind::Spherical,
        JointKind::Prismatic { axis: DVec3::Y, range_m: None, motor: None },
        JointKind::Spring { stiffness_n_m: 1e5, damping_n_s_m: 0.0, rest_m: 0.0 },
    ] {
        let (speed_m_s, yields_above_n) = (1.0, 8.0);
        let slider = RigidSpec { velocity: DVec3::X * speed_m_s, ..ball(DVec3::ZERO, MASS_KG, DVec3::ZERO) };
        let joint = Joint { yields_above_n, ..Joint::new(AgentId(0), None, kind) };
        let mut table = balls([slider]).jointed([joint]);
        table.bodies[0].rate_hz = 240.0;
        let mut least_j = table.energy_j();
        while table.time.as_secs_f64() < 1.0 {
            table.step();
            let energy_j = table.energy_j();
            // F²/2k of the spring comes back, and 5 µm at 8 N of a joint that holds
            assert!(energy_j < least_j + 4e-4, "{kind:?}: {energy_j} J after {least_j} J");
            least_j = least_j.min(energy_j);
        }
        let (place, velocity) = table.middle(0);
        // F s = m v²/2, and half a step at its speed
        let stop_m = 0.5 * MASS_KG * speed_m_s * speed_m_s / yields_above_n;
        assert!(
            (place.x - stop_m).abs() < 0.6 / 240.0 * speed_m_s && place.reject_from(DVec3::X).length() < 1e-9,
            "{kind:?}: {place}"
        );
        assert!(velocity.length() < 0.01, "{kind:?}: {velocity} m/s");
    }
}

#[test]
fn what_yields_keeps_momentum_and_turns_with_the_body_that_it_slipped_on() {
    // a ball is dragged off the anchor that it had on a body which turns, and then goes round with that
    let (spin_rad_s, yields_above_n) = (2.0, 0.5);
    let wheel = RigidSpec { spin: DVec3::Z * spin_rad_s, ..ball(DVec3::ZERO, 1e6, DVec3::ZERO) };
    let orbiting = DVec3::new(0.3, 0.0, 0.0);
    let velocity = DVec3::new(0.2, spin_rad_s * orbiting.x, 0.0);
    let mut table = balls([RigidSpec { velocity, ..ball(orbiting, 0.1, DVec3::ZERO) }, wheel]);
    let link = Link { yields_above_n, ..spring(1e4, 20.0, 0.0) };
    table.link([(0, CENTRE), (1, Anchor::Local(orbiting))], link);
    table.bodies.iter_mut().for_each(|body| body.rate_hz = 240.0);
    let momentum = |table: &Table| (0..2).map(|body| table.bodies[body].agent.momentum().0).sum::<DVec3>();
    let before = momentum(&table);
    while table.time.as_secs_f64() < 2.0 {
        table.step();
    }
    assert!(momentum(&table).distance(before) < 1e-9, "{} N s", momentum(&table) - before);
    // m ω² r = 0.12 N below the bound: it goes round, farther out than it began by the way in which 0.5 − 0.12 N stop
    // it
    let (place, velocity) = table.middle(0);
    let (radius_m, out_m_s) = (place.length(), velocity.dot(place.normalize()));
    assert!(radius_m > 0.303 && radius_m < 0.312, "{radius_m} m");
    assert!(
        out_m_s.abs() < 5e-3 && (velocity.length() / radius_m - spin_rad_s).abs() < 0.02,
        "{velocity} m/s at {place}"
    );
}

#[test]
fn a_tube_slides_off_the_links_that_it_hangs_by_and_the_same_bits_come_again() {
    let play = |doubling: bool| {
        let hook = |y: f64| ball(DVec3::new(0.0, y, 0.4), 1e6, DVec3::ZERO);
        let mut table = balls([hook(-0.08), hook(0.08)]);
        let hose = tube(DVec3::Z * 0.3, DVec3::new(0.0, 0.08, 0.0), 0.01);
        let weight_n = hose.agent.mass_kg() * G;
        table.bodies.push(hose);
        table.touching = false;
        table.doubling = doubling.then(StepDoubling::default);
        for (end, arc_m) in [(0, 0.0), (1, 0.16)] {
            let link = Link { yields_above_n: 0.45 * weight_n, ..spring(1e4, 0.0, 0.1) };
            table.link([(end, CENTRE), (2, Anchor::Arc(arc_m))], link);
        }
        let (mut begun, mut late_n_s) = (0, 0.0);
        while table.time.as_secs_f64() < 0.5 {
            table.step();
            begun += table.yielded().len();
            if table.time.as_secs_f64() < 0.1 {
                late_n_s = table.bodies[2].agent.momentum().0.z + 0.1 * weight_n * table.time.as_secs_f64();
            }
        }
        // together they bear 0.9 of its weight, once they do
        let left_n_s = table.bodies[2].agent.momentum().0.z + 0.1 * weight_n * table.time.as_secs_f64() - late_n_s;
        assert!(
            left_n_s.abs() < 1e-3 * weight_n && late_n_s.abs() < 0.01 * weight_n,
            "{left_n_s} N s, {late_n_s} N s of {weight_n} N"
        );
        (begun, table.middle(2))
    };
    let once = play(false);
    assert_eq!(once.0, 2);
    assert_eq!(play(false), once);
    assert_eq!(play(true), once);
}

#[test]
fn steps_that_are_cut_short_make_nothing_yield_that_holds() {
    for rate_hz in [60.0, 240.0] {
        for share in [0.1, 1e-3] {
            for held in ALL {
                let mut table = hung(held, 1.1 * WEIGHT_N);
                table.bodies.iter_mut().for_each(|body| body.rate_hz = rate_hz);
                for step in 0..100 {
                    table.step_share(if step % 7 == 3 { share } else { 1.0 });
                    assert_eq!(table.yielded(), [], "{rate_hz} Hz, every seventh step {share} of it, {held:?}");
                }
            }
        }
    }
}

/// A tube that hangs along all of its length, and yields at this share of its weight.
fn mesentery(share: f64, slack_m: f64) -> Table {
    hung::mesentery(slack_m, |weight_n| Limits { yields_above_n: share * weight_n, tears_above_n: f64::INFINITY })
}

#[test]
fn a_tube_hangs_by_its_attachment_below_the_yield_force_and_slides_down_above_it() {
    for slack_m in [0.0, 0.01] {
        let mut table = mesentery(1.1, slack_m);
        while table.time.as_secs_f64() < 2.0 {
            table.step();
            // a tube that falls on it slips a little before it hangs
            assert!(slack_m > 0.0 || table.yielded().is_empty());
        }
        let z = table.middle(0).0.z;
        let most_m = slack_m * 12.0;
        assert!(z < -1e-3 - slack_m + 1e-6 && z > -1e-3 - slack_m - most_m - 1e-6, "slack {slack_m}: {z}");
        assert!(table.middle(0).1.length() < 1e-4, "slack {slack_m}: it hangs");

        let mut table = mesentery(0.9, slack_m);
        let weight_n = table.bodies[0].agent.mass_kg() * G;
        let mut begun = vec![];
        let mut since = None;
        while table.time.as_secs_f64() < 0.6 {
            if table.time.as_secs_f64() > 0.3 && since.is_none() {
                // it slides on from where it is once it is divided anew
                table.bodies[0].agent.set_resolution(Resolution { eps_m: 0.04, n: 0 });
                since = Some((table.time.as_secs_f64(), table.bodies[0].agent.momentum().0));
            }
            table.step();
            begun.extend_from_slice(table.yielded());
        }
        let [yielded] = begun[..] else { panic!("slack {slack_m}: {begun:?}") };
        assert_eq!((yielded.member, yielded.other, yielded.partner), (0, None, Partner::Attachment(0)));
        let (from_s, momentum) = since.unwrap();
        let wanted = momentum - DVec3::Z * (0.1 * weight_n * (table.time.as_secs_f64() - from_s));
        let found = table.bodies[0].agent.momentum().0;
        assert!(found.distance(wanted) < 1e-6 * weight_n, "slack {slack_m}: {found} is not {wanted}");
    }
}

#[test]
fn an_attachment_that_yields_where_it_is_pulled_holds_beside_that() {
    let mut table = mesentery(1.5, 0.0);
    let weight_n = table.bodies[0].agent.mass_kg() * G;
    let start = table.middle(0).0;
    // a hand takes one end down, with a force below the yield of the whole, and lets it go
    let (anchor, target) = (Anchor::Arc(0.2), DVec3::new(0.2, 0.0, -0.04));
    let hand = AnchorSpring {
        by: None,
        anchor,
        target,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 0.4 * weight_n / 0.04,
        damping_n_s_m: 0.0,
    };
    table.bodies[0].user_springs = vec![hand];
    while table.time.as_secs_f64() < 0.5 {
        table.step();
    }
    table.bodies[0].user_springs.clear();
    while table.time.as_secs_f64() < 3.0 {
        table.step();
    }
    let mut snapshot = Snapshot::default();
    table.bodies[0].agent.write_snapshot(&mut snapshot);
    let [left, right] = [0.0, 1.0].map(|share| snapshot.body.probe(share).unwrap().0.z);

    assert!(start.z.abs() < 1e-12 && right < -0.003 && left > -0.003, "the ends are at {left} and {right} m");
}
