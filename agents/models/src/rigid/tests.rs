//! The motion of a rigid body by itself, against closed forms.

use super::{Restraint, RigidBody, RigidError, RigidSpec};
use glam::{DQuat, DVec3};
use metachron_contact::member::ClusterMember;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, StepContext};
use metachron_core::{AgentId, Body, Inertia, RigidState, SimSpan, SimTime, Snapshot, StepError, StepReport};
use metachron_geometry::Solid;
use std::sync::Arc;

const G: f64 = 9.81;
const UP: DVec3 = DVec3::Z;

fn spec(solid: Solid, position: DVec3) -> RigidSpec {
    RigidSpec { gravity: UP * -G, sleep: true, ..RigidSpec::free(solid, position, 0.5) }
}

fn cube(half: f64, at: DVec3) -> RigidSpec {
    spec(Solid::Box { half_extents_m: DVec3::splat(half) }, at)
}

fn span(seconds: f64) -> SimSpan {
    SimSpan::from_secs_f64(seconds).unwrap()
}

fn step(body: &mut RigidBody, dt: f64) -> StepReport {
    LoneStepper::default().step(body, span(dt), StepContext::alone(AgentId(0), SimTime::ZERO)).unwrap()
}

fn snapshot(body: &RigidBody) -> Snapshot {
    let mut snapshot = Snapshot::default();
    body.write_snapshot(&mut snapshot);
    snapshot
}

fn state(body: &RigidBody) -> RigidState {
    let Body::Rigid(state) = snapshot(body).body else { panic!("a rigid body writes a rigid state") };
    state
}

#[test]
fn free_fall_is_the_parabola_at_any_step() {
    for dt in [0.000_1, 0.001, 0.016, 0.25] {
        let mut body = RigidBody::new(RigidSpec { velocity: DVec3::X, ..cube(0.1, UP * 100.0) }).unwrap();
        let steps = (2.0_f64 / dt).round();
        (0..steps as u32).for_each(|_| {
            step(&mut body, dt);
        });
        let t = steps * dt;
        let expected = DVec3::new(t, 0.0, 100.0 - 0.5 * G * t * t);
        let wrong = state(&body).position.distance(expected);
        assert!(wrong < 1e-10, "dt {dt}: {wrong:e} m off"); // double precision: 20,000 roundings of an ulp of 100
    }
}

#[test]
fn a_spinning_body_keeps_its_angular_momentum() {
    let solid = Solid::Box { half_extents_m: DVec3::new(0.1, 0.2, 0.05) };
    let free = RigidSpec { spin: DVec3::new(0.1, 0.2, 9.0), gravity: DVec3::ZERO, ..spec(solid, DVec3::ZERO) };
    let mut body = RigidBody::new(free).unwrap();
    let (before, energy) = (body.momentum().1, snapshot(&body).energy_j);
    (0..60_000).for_each(|_| {
        step(&mut body, 0.01);
    });
    assert_eq!(body.momentum().1, before);
    let change = snapshot(&body).energy_j / energy - 1.0;
    assert!(change.abs() < 1e-6, "energy changed by {change:e}"); // the splitting's bounded error
}

#[test]
fn a_step_of_no_length_or_of_hours_is_refused_and_leaves_the_state() {
    let mut body = RigidBody::new(cube(0.1, UP)).unwrap();
    step(&mut body, 0.01);
    let before = state(&body);
    for bad in [SimSpan::ZERO, span(1.5), span(1e6), SimSpan::from_nanos(u64::MAX)] {
        let alone = StepContext::alone(AgentId(0), SimTime::ZERO);
        let error = LoneStepper::default().step(&mut body, bad, alone).unwrap_err();
        assert!(matches!(error, StepError::BadSpan { .. }), "{error}");
        assert_eq!(state(&body), before);
    }
}

#[test]
fn numbers_outside_their_range_are_refused() {
    let good = cube(0.1, UP);
    let refuse = |bad: RigidSpec| RigidBody::new(bad).err().expect("it is refused");
    for mass_kg in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refuse(RigidSpec { mass_kg, ..good.clone() }), RigidError::BadNumber(_)));
    }
    for restitution in [-0.1, 1.1, f64::NAN] {
        assert!(matches!(refuse(RigidSpec { restitution, ..good.clone() }), RigidError::BadNumber(_)));
    }
    let vectors = [
        RigidSpec { position: DVec3::NAN, ..good.clone() },
        RigidSpec { velocity: DVec3::splat(1e300), ..good.clone() },
    ];
    for bad in vectors {
        assert!(matches!(refuse(bad), RigidError::BadVector { .. }));
    }
    let bad = RigidSpec { rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good.clone() };
    assert_eq!(refuse(bad), RigidError::BadRotation { what: "the rotation" });
    assert_eq!(refuse(RigidSpec { solid: Solid::Plane, ..good }), RigidError::MovingPlane);
}

/// An L of three cubes of 0.1 m, closed and not convex.
fn l_mesh() -> Solid {
    let outline =
        [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)].map(|(x, z)| (f64::from(x) * 0.1, f64::from(z) * 0.1));
    let points_m: Arc<[DVec3]> = [0.0, 0.1].iter().flat_map(|&y| outline.map(|(x, z)| DVec3::new(x, y, z))).collect();
    let caps = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let near = caps;
    let far = caps.map(|[a, b, c]| [a + 6, c + 6, b + 6]);
    let sides = (0..6_u32).flat_map(|i| {
        let j = (i + 1) % 6;
        [[i, j + 6, j], [i, i + 6, j + 6]]
    });
    Solid::Mesh { points_m, triangles: near.into_iter().chain(far).chain(sides).collect() }
}

#[test]
fn an_l_shaped_mesh_keeps_its_hollow_and_its_centre() {
    let body = RigidBody::new(spec(l_mesh(), DVec3::ZERO)).unwrap();
    // three cubes: their centres are (0.05, 0.05), (0.15, 0.05), (0.05, 0.15)
    let centre = DVec3::new(0.25 / 3.0, 0.05, 0.25 / 3.0);
    assert!(body.com_local().distance(centre) < 1e-12, "{}", body.com_local()); // double precision
    assert!((snapshot(&body).body.probe(0.0).unwrap().0 - centre).length() < 1e-12);
}

#[test]
fn the_same_steps_give_the_same_bits() {
    let run = || {
        let spun = RigidSpec { spin: DVec3::new(3.0, 2.0, 1.0), ..cube(0.1, UP * 0.4) };
        let mut body = RigidBody::new(spun).unwrap();
        (0..300).for_each(|_| {
            step(&mut body, 0.007);
        });
        snapshot(&body).fold_hash(metachron_core::HASH_START)
    };
    assert_eq!(run(), run());
}

#[test]
fn the_publication_is_that_of_free_flight() {
    let mut flying = RigidBody::new(RigidSpec { velocity: DVec3::X, ..cube(0.1, UP * 9.0) }).unwrap();
    let report = step(&mut flying, 0.1);
    let seen = snapshot(&flying);
    assert_eq!((report.at_rest, report.substeps), (false, 1));
    assert_eq!(seen.drift_m, 0.0, "the flight is exact");
    assert!((seen.acceleration - UP * -G).length() < 1e-12, "{}", seen.acceleration); // one difference over 0.1 s
}

#[test]
fn a_body_that_nothing_moves_comes_to_rest_unless_it_may_not_sleep() {
    for sleep in [true, false] {
        let mut body = RigidBody::new(RigidSpec { gravity: DVec3::ZERO, sleep, ..cube(0.1, UP) }).unwrap();
        assert_eq!((0..60).any(|_| step(&mut body, 0.01).at_rest), sleep);
    }
}

#[test]
fn a_body_with_locked_axes_answers_impulses_along_the_others_alone() {
    let locked_rotation = [true, true, false];
    let restraint = Restraint { locked_translation: [false, true, false], locked_rotation, ..Restraint::default() };
    let turned = DQuat::from_scaled_axis(DVec3::new(0.4, 0.3, 0.2));
    let solid = Solid::Box { half_extents_m: DVec3::new(0.3, 0.1, 0.2) };
    let mut body = RigidBody::new(RigidSpec { restraint, rotation: turned, ..spec(solid, DVec3::ZERO) }).unwrap();
    let Inertia::Rigid { inverse_mass, inverse_inertia } = snapshot(&body).inertia else { panic!("it moves") };
    assert_eq!(inverse_mass, DVec3::new(1.0, 0.0, 1.0) / body.mass_kg());
    // about an axis that alone is free it is as heavy as the inertia about that axis
    let moments = DVec3::new(0.05, 0.13, 0.1) * (body.mass_kg() / 3.0);
    let along = turned.conjugate() * DVec3::Z;
    let about_z = (along * along).dot(moments);
    assert!((inverse_inertia.z_axis.z * about_z - 1.0).abs() < 1e-12 && inverse_inertia.x_axis == DVec3::ZERO);
    let given = DVec3::new(3.0, 2.0, 1.0) * 1e-3;
    body.carry(&[DVec3::ZERO, given]);
    let by = (state(&body).rotation * turned.conjugate()).to_scaled_axis();
    assert!((by - DVec3::Z * (given.z / about_z)).length() < 1e-12, "{by}");
}
