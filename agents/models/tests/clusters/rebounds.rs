//! Balls that bounce, against the closed form: heights e²ⁿ h, speeds after a blow by momentum and restitution.

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
        // what a blow sends up may come down again within the step
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
                    break; // what flies for little more than a step
                }
                let (off, here) = (top_m / exact_m - 1.0, format!("e {restitution}, {rate_hz} Hz, bounce {bounce}"));
                // never above: box and ball give way by a five-hundredth of the blow
                assert!((-1e-2..1e-9).contains(&off), "{here}: {top_m} of {exact_m}");
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
    // half a hundredth of what falls, 1.3 J: what came too deep for a moment is pushed out
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
