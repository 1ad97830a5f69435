//! Balls that bounce, against the closed form: heights e²ⁿ h, speeds after an impact by momentum and restitution.

use crate::bodies::rigid;
use crate::table::{GRAVITY, Table, placed};
use glam::{DQuat, DVec3};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};

const RADIUS_M: f64 = 0.05;
const HEIGHT_M: f64 = 1.0;

fn floor(restitution: f64) -> Obstacle {
    Obstacle { restitution, ..Obstacle::new("floor", Solid::Plane) }
}

/// Heights of the first tops of a ball after its bounces, metres above the floor.
fn tops(table: &mut Table, body: usize, count: usize) -> Vec<f64> {
    let mut tops = vec![];
    let mut rising = false;
    for _ in 0..40_000 {
        let (_, before) = table.middle(body);
        let (_, dt_s) = table.step();
        let (place, after) = table.middle(body);
        // a body sent up by an impact may come down again within the step
        rising |= after.z > before.z + GRAVITY.z * dt_s + 1e-6;
        if rising && after.z <= 0.0 {
            // the top lies within the step: from the state at its end
            tops.push(place.z - RADIUS_M + after.z * after.z / (2.0 * -GRAVITY.z));
        }
        rising = after.z > 0.0;
        if tops.len() == count {
            break;
        }
    }
    tops
}

fn ball(x: f64, restitution: f64) -> RigidSpec {
    let solid = Solid::Ball { radius_m: RADIUS_M };
    RigidSpec { restitution, ..rigid(solid, DVec3::new(x, 0.0, HEIGHT_M + RADIUS_M), 0.5) }
}

#[test]
fn a_ball_rises_to_its_share_of_the_height_at_any_rate() {
    for restitution in [0.5, 0.8, 1.0] {
        for rate_hz in [60.0, 137.0, 240.0, 1000.0] {
            let ball = placed(RigidBody::new(ball(0.0, restitution)).unwrap(), false);
            let mut table = Table::among(vec![ball], &[floor(restitution)]).at_rates(rate_hz, rate_hz);
            for (bounce, top_m) in (1..).zip(tops(&mut table, 0, 5)) {
                let exact_m = restitution.powi(2 * bounce) * HEIGHT_M;
                let off = top_m / exact_m - 1.0;
                // never above: contacts give way by some micrometres
                assert!(
                    (-1e-3..1e-9).contains(&off),
                    "e {restitution}, {rate_hz} Hz, bounce {bounce}: {top_m} of {exact_m}"
                );
            }
        }
    }
}

#[test]
fn balls_of_one_cluster_bounce_each_as_if_alone() {
    let near = |at: f64| ball(at * 5.0 * RADIUS_M, 0.8);
    for body in 0..3 {
        let balls = (0..3).map(|at| {
            let spec = near(f64::from(at));
            let position = spec.position - DVec3::Z * (0.1 * f64::from(at));
            placed(RigidBody::new(RigidSpec { position, ..spec }).unwrap(), false)
        });
        let mut table = Table::among(balls.collect(), &[floor(0.8)]);
        let height_m = HEIGHT_M - 0.1 * body as f64;
        for (bounce, top_m) in (1..).zip(tops(&mut table, body, 5)) {
            let exact_m = 0.8_f64.powi(2 * bounce) * height_m;
            let off = top_m / exact_m - 1.0;
            assert!((-1e-3..1e-9).contains(&off), "ball {body}, bounce {bounce}: {top_m} of {exact_m}");
        }
    }
}

#[test]
fn a_ball_rebounds_off_a_box_that_lies_as_off_the_ground() {
    for restitution in [0.5, 0.8] {
        for rate_hz in [60.0, 137.0, 240.0, 1000.0] {
            let half_m = 0.1;
            let slab = rigid(Solid::Box { half_extents_m: DVec3::splat(half_m) }, DVec3::Z * half_m, 2.0);
            let above =
                RigidSpec { position: ball(0.0, 0.0).position + DVec3::Z * 2.0 * half_m, ..ball(0.0, restitution) };
            let bodies = [slab, above].map(|spec| placed(RigidBody::new(spec).unwrap(), false));
            let mut table = Table::new(bodies.into()).at_rates(rate_hz, rate_hz);
            for (bounce, top_m) in (1..).zip(tops(&mut table, 1, 5)) {
                let (top_m, exact_m) = (top_m - 2.0 * half_m, restitution.powi(2 * bounce) * HEIGHT_M);
                if exact_m < 2e-3 {
                    break; // it flies for little more than a step
                }
                let (off, here) = (top_m / exact_m - 1.0, format!("e {restitution}, {rate_hz} Hz, bounce {bounce}"));
                // never above: box and ball give way by micrometres a second
                assert!((-3e-3..1e-9).contains(&off), "{here}: {top_m} of {exact_m}");
            }
        }
    }
}

#[test]
fn a_ball_without_restitution_stays_where_it_lands() {
    for rate_hz in [60.0, 240.0] {
        let ball = placed(RigidBody::new(ball(0.0, 0.0)).unwrap(), false);
        let mut table = Table::new(vec![ball]).at_rates(rate_hz, rate_hz);
        let found = table.play(1.5);
        assert!(found.rest_m < 25e-6 && found.landing_m < 25e-6, "{found:?}");
        let depth_m = RADIUS_M - table.middle(0).0.z;
        assert!((0.0..21e-6).contains(&depth_m), "{depth_m}");
    }
}

#[test]
fn two_bodies_part_by_momentum_and_restitution() {
    for restitution in [0.0, 0.3, 1.0] {
        for mass_kg in [1.0, 10.0, 1000.0] {
            for rate_hz in [10.0, 60.0, 1000.0] {
                let of = |x: f64, speed: f64, mass_kg: f64| RigidSpec {
                    restitution,
                    mass_kg,
                    gravity: DVec3::ZERO,
                    velocity: DVec3::X * speed,
                    ..ball(x, restitution)
                };
                let (first, second) = (of(0.0, 1.0, 1.0), of(0.3, -0.5, mass_kg));
                let bodies = [first, second].map(|spec| placed(RigidBody::new(spec).unwrap(), false));
                let mut table = Table::among(bodies.into(), &[]).at_rates(rate_hz, 60.0);
                while table.time.as_secs_f64() < 0.4 {
                    table.step();
                }
                let (v, w) = (table.middle(0).1.x, table.middle(1).1.x);
                let common = (1.0 - 0.5 * mass_kg) / (1.0 + mass_kg);
                let parting = 1.5 * restitution;
                let exact = [common - parting * mass_kg / (1.0 + mass_kg), common + parting / (1.0 + mass_kg)];
                let off = (v - exact[0]).abs().max((w - exact[1]).abs());
                assert!(off < 1e-3, "e {restitution}, 1 : {mass_kg}, {rate_hz} Hz: {v} {w} of {exact:?}");
            }
        }
    }
}

#[test]
fn a_ball_that_loses_nothing_bounces_for_a_minute_and_never_higher() {
    let ball = placed(RigidBody::new(ball(0.0, 1.0)).unwrap(), false);
    let mut table = Table::among(vec![ball], &[floor(1.0)]).at_rates(240.0, 240.0);
    let before_j = table.energy_j();
    let (mut least_j, mut most_j) = (before_j, before_j);
    while table.time.as_secs_f64() < 60.0 {
        table.step();
        (least_j, most_j) = (least_j.min(table.energy_j()), most_j.max(table.energy_j()));
    }
    let weight_j_m = 0.5 * -GRAVITY.z;
    // 66 bounces off contacts that give way by micrometres: 0.07 mm measured
    assert!(most_j < before_j + weight_j_m * 1e-4, "{before_j} J, then {most_j} J");
    assert!(least_j > before_j - weight_j_m * 1e-3, "{before_j} J, then {least_j} J");
}

#[test]
fn a_plate_that_falls_flat_bounces_straight_up() {
    let half_extents_m = DVec3::new(0.2, 0.15, 0.01);
    let spec = RigidSpec { restitution: 0.5, ..rigid(Solid::Box { half_extents_m }, DVec3::Z * 0.5, 1.0) };
    let plate = placed(RigidBody::new(spec).unwrap(), false);
    let mut table = Table::among(vec![plate], &[floor(0.5)]).at_rates(240.0, 240.0);
    let mut tops_m = vec![];
    let mut before_m_s = 0.0;
    while table.time.as_secs_f64() < 1.2 {
        table.step();
        let (at, velocity) = table.middle(0);
        if before_m_s > 0.0 && velocity.z <= 0.0 {
            tops_m.push(at.z - half_extents_m.z + velocity.z * velocity.z / (2.0 * -GRAVITY.z));
        }
        before_m_s = velocity.z;
        let across = DVec3::new(velocity.x, velocity.y, 0.0);
        // the solver's tolerance on velocities
        assert!(across.length() < 5e-6 && at.x.abs() + at.y.abs() < 5e-6, "{at} {velocity}");
        assert!(table.bodies[0].agent.momentum().1.length() < 5e-6);
    }
    let wanted_m = 0.25 * (0.5 - half_extents_m.z);
    assert!((tops_m[0] / wanted_m - 1.0).abs() < 1e-2 && tops_m[0] < wanted_m * 1.001, "{tops_m:?}, not {wanted_m}");
}

#[test]
fn a_pile_of_boxes_that_rebound_comes_to_rest() {
    let half_m = 0.02;
    let boxes = (0..27).map(|k| {
        let at = [k % 3, k / 3 % 3, k / 9].map(f64::from);
        let middle = DVec3::new(0.043 * at[0] + 0.003 * at[2], 0.043 * at[1], 0.05 + 0.06 * at[2]);
        let shape = Solid::Box { half_extents_m: DVec3::splat(half_m) };
        let turn = 0.1 * (12.9898 * f64::from(k + 1)).sin();
        let rotation = DQuat::from_euler(glam::EulerRot::XYZ, turn, 0.7 * turn, 2.0 * turn);
        placed(RigidBody::new(RigidSpec { rotation, restitution: 0.5, ..rigid(shape, middle, 0.05) }).unwrap(), false)
    });
    let mut table = Table::among(boxes.collect(), &[floor(0.5)]);
    let found = table.play(3.0);
    assert!(found.steps < 16 * 180, "{found:?}");
    // half a hundredth of the energy of the fall, 1.3 J: bodies that came too deep for a moment are pushed out
    assert!(found.gain_j < 6.5e-3, "{found:?}");
    assert!(found.rest_m < 5e-5 && found.lowest_m > 0.9 * half_m, "{found:?}");
    assert!((found.weight - 1.0).abs() < 1e-2, "{found:?}");
}

#[test]
fn a_light_box_that_bounces_between_a_heavy_one_and_the_floor_stays_between_them() {
    let boxed = |half_m: f64, bottom_m: f64, mass_kg: f64, restitution: f64| {
        let solid = Solid::Box { half_extents_m: DVec3::splat(half_m) };
        let spec = rigid(solid, DVec3::Z * (bottom_m + half_m), mass_kg);
        placed(RigidBody::new(RigidSpec { restitution, ..spec }).unwrap(), false)
    };
    for gap_m in [0.01, 0.02, 0.03, 0.05] {
        for (lower_hz, upper_hz) in [(60.0, 60.0), (240.0, 240.0), (240.0, 30.0), (30.0, 1000.0)] {
            let bodies = vec![boxed(0.08, 0.06, 0.4, 0.5), boxed(0.1, 0.22 + gap_m, 90.0, 0.0)];
            let found = Table::new(bodies).at_rates(lower_hz, upper_hz).play(1.0);
            let here = format!("gap {gap_m} m, {lower_hz} : {upper_hz} Hz");
            let deepest_m = found.landing_m.max(found.rest_m);
            assert!(deepest_m < 1e-3, "{here}: {deepest_m} m deep");
            assert!(found.gain_j < 0.01, "{here}: {} J made", found.gain_j);
            assert!((found.highest_m - 0.26).abs() < 1e-4, "{here}: it lies at {} m", found.highest_m);
        }
    }
}

/// Numbers between −1 and 1: the fractions of a sine.
fn drawn(number: usize, what: usize) -> f64 {
    let x = libm::sin(12.9898 * (number + 1) as f64 + 78.233 * what as f64) * 43_758.545_3;
    2.0 * (x - x.floor()) - 1.0
}

#[test]
fn fifty_balls_without_loss_keep_their_energy_in_a_room() {
    let wall = |axis: DVec3, sign: f64| Obstacle {
        position: axis * (0.6 * sign),
        restitution: 1.0,
        ..Obstacle::new("wall", Solid::Box { half_extents_m: DVec3::splat(0.7) - axis * 0.6 })
    };
    let walls: Vec<_> = DVec3::AXES.into_iter().flat_map(|axis| [-1.0, 1.0].map(|sign| wall(axis, sign))).collect();
    for rate_hz in [60.0, 240.0] {
        let balls = (0..50).map(|k| {
            let middle = DVec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64) * 0.22 - DVec3::splat(0.33);
            let velocity = DVec3::new(drawn(k, 0), drawn(k, 1), drawn(k, 2)).normalize() * 5.0;
            let spec = rigid(Solid::Ball { radius_m: 0.04 }, middle, 0.1);
            let spec = RigidSpec { velocity, restitution: 1.0, friction: 0.0, gravity: DVec3::ZERO, ..spec };
            let mut ball = placed(RigidBody::new(spec).unwrap(), false);
            ball.rate_hz = rate_hz;
            ball
        });
        let mut table = Table::among(balls.collect(), &walls);
        let before_j = table.energy_j();
        let found = table.play(1.0);
        let kept = table.energy_j() / before_j;
        // contacts give way by micrometres a second
        assert!((0.999..1.0 + 1e-9).contains(&kept), "{rate_hz} Hz: {kept} of the energy is kept");
        assert!(found.gain_j < 1e-9 * before_j, "{rate_hz} Hz: {found:?}");
        let out = (0..50).filter(|k| table.middle(*k).0.abs().max_element() > 0.5).count();
        assert_eq!(out, 0, "{rate_hz} Hz: balls that have left the room");
    }
}

#[test]
fn rough_boxes_that_collide_make_no_energy_and_keep_their_momentum() {
    let (mut deepest_m, mut rebounds) = (0.0_f64, 0);
    for seed in 0..24 {
        let boxes = (0..8).map(|k| {
            let corner = DVec3::new((k % 2) as f64, (k / 2 % 2) as f64, (k / 4) as f64) * 2.0 - DVec3::ONE;
            let number = 8 * seed + k;
            let off = DVec3::new(drawn(number, 0), drawn(number, 1), drawn(number, 2));
            let spin = DVec3::new(drawn(number, 3), drawn(number, 4), drawn(number, 5)) * 8.0;
            let spec =
                rigid(Solid::Box { half_extents_m: DVec3::splat(0.05) }, corner * 0.2 + off * 0.05, 0.5 + k as f64);
            let spec = RigidSpec { velocity: corner * -0.5, spin, gravity: DVec3::ZERO, ..spec };
            let spec = RigidSpec { restitution: 0.5 + 0.5 * drawn(number, 6), friction: 0.6, ..spec };
            placed(RigidBody::new(spec).unwrap(), false)
        });
        let mut table = Table::among(boxes.collect(), &[]);
        let momentum = |table: &Table| table.bodies.iter().map(|body| body.agent.momentum().0).sum::<DVec3>();
        let (before, mut least_j) = (momentum(&table), table.energy_j());
        for _ in 0..120 {
            let (report, _) = table.step();
            deepest_m = deepest_m.max(report.depth_m);
            rebounds += u32::from(report.solves > 0);
            let now_j = table.energy_j();
            // a push-out of overlapping bodies adds some
            assert!(now_j < least_j + 1e-3 * least_j, "seed {seed}: {now_j} J after {least_j} J");
            least_j = least_j.min(now_j);
        }
        let after = momentum(&table);
        assert!(after.distance(before) < 1e-12 * 8.0 * 4.5, "seed {seed}: {after} kg m/s, not {before}");
    }
    assert!(rebounds > 30, "{rebounds} steps with rebounds");
    // corners go by 11 mm a step
    assert!(deepest_m < 3e-3, "{deepest_m} m deep");
}

#[test]
fn a_tower_of_boxes_that_would_rebound_costs_what_one_costs_that_would_not() {
    let cost = |restitution: f64| {
        let boxes = (0..20).map(|at| {
            let middle = DVec3::new(drawn(at, 0), drawn(at, 1), 0.0) * 0.025 + DVec3::Z * (0.02 + 0.04 * at as f64);
            let spec = rigid(Solid::Box { half_extents_m: DVec3::new(0.04, 0.04, 0.02) }, middle, 0.2);
            let mut body = placed(RigidBody::new(RigidSpec { friction: 0.8, restitution, ..spec }).unwrap(), false);
            body.rate_hz = 500.0;
            body
        });
        let mut table = Table::among(boxes.collect(), &[floor(0.0)]);
        let (mut fine_steps, mut solves, mut factors) = (0, 0, 0);
        for _ in 0..500 {
            let (report, _) = table.step();
            (fine_steps, solves, factors) =
                (fine_steps + report.fine_steps, solves + report.solves, factors + report.factors);
        }
        let top_m = table.middle(19).0.z;
        assert!((top_m - 0.78).abs() < 1e-3, "e {restitution}: its top is at {top_m} m");
        (fine_steps, solves, factors)
    };
    assert_eq!(cost(0.2), cost(0.0));
}

#[test]
fn a_ball_that_meets_two_others_at_once_in_a_step_passes_through_neither() {
    // between a wall and a ball that comes towards it, a way of a step from both
    let spec = |x: f64, speed: f64| RigidSpec {
        velocity: DVec3::X * speed,
        restitution: 1.0,
        friction: 0.0,
        gravity: DVec3::ZERO,
        ..rigid(Solid::Ball { radius_m: 0.05 }, DVec3::X * x, 1.0)
    };
    let wall = Obstacle {
        position: DVec3::X * -0.5,
        restitution: 1.0,
        ..Obstacle::new("wall", Solid::Box { half_extents_m: DVec3::splat(0.3) })
    };
    for gap_m in [0.001, 0.01, 0.03] {
        let bodies = [spec(-0.15 + gap_m, -4.0), spec(-0.04 + 2.0 * gap_m, -6.0)];
        let bodies = bodies.map(|spec| placed(RigidBody::new(spec).unwrap(), false));
        let mut table = Table::among(bodies.into(), std::slice::from_ref(&wall));
        for _ in 0..30 {
            table.step();
        }
        // equal masses exchange their speeds: the first turns at the wall, hits the second, turns there and at the wall again
        let speeds = [0, 1].map(|body| table.middle(body).1.x);
        assert!((speeds[0] - 6.0).abs() < 1e-3 || (speeds[0] - 4.0).abs() < 1e-3, "{gap_m} m: {speeds:?}");
        let squares = speeds[0] * speeds[0] + speeds[1] * speeds[1];
        assert!((squares - 52.0).abs() < 1e-2 && speeds[1] > 0.0, "{gap_m} m: {speeds:?}");
        assert!(table.middle(0).0.x < table.middle(1).0.x, "{gap_m} m: the order of the balls");
    }
}
#[test]
fn boxes_that_fall_on_each_other_and_rebound_a_little_cost_little_more_than_those_that_do_not() {
    let cost = |restitution: f64| {
        let boxes = (0..64).map(|k| {
            let at = DVec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64) * 0.1;
            let off = DVec3::new(drawn(k, 0), drawn(k, 1), 0.0) * 0.009;
            let spec = rigid(Solid::Box { half_extents_m: DVec3::splat(0.04) }, at + off + DVec3::Z * 0.09, 0.05);
            placed(RigidBody::new(RigidSpec { restitution, ..spec }).unwrap(), false)
        });
        let found = Table::among(boxes.collect(), &[floor(restitution)]).play(1.0);
        assert!(found.landing_m.max(found.rest_m) < 3e-5 && found.unfinished == 0, "e {restitution}: {found:?}");
        assert!((found.highest_m - 0.28).abs() < 1e-3, "e {restitution}: they lie as columns: {found:?}");
        f64::from(found.factors)
    };
    let ratio = cost(0.1) / cost(0.0);
    assert!(ratio < 1.5, "{ratio} times the factors");
}
