//! Joints of rigid bodies in a cluster, against closed forms.

use crate::bodies::rigid;
use crate::table::{GRAVITY, Table, placed};
use glam::{DQuat, DVec3};
use metachron_contact::joint::{Joint, JointKind};
use metachron_core::{AgentId, Body, RigidState, Snapshot};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};

pub const G: f64 = -GRAVITY.z;

/// Bodies on joints, far from the floor.
pub fn party(
    specs: impl IntoIterator<Item = RigidSpec>,
    joints: impl IntoIterator<Item = Joint>,
    rate_hz: f64,
) -> Table {
    let bodies = specs.into_iter().map(|spec| placed(RigidBody::new(spec).unwrap(), false)).collect();
    let mut table = Table::among(bodies, &[]).jointed(joints);
    table.bodies.iter_mut().for_each(|body| body.rate_hz = rate_hz);
    table
}

pub fn state(table: &Table, body: usize) -> RigidState {
    let mut snapshot = Snapshot::default();
    table.bodies[body].agent.write_snapshot(&mut snapshot);
    let Body::Rigid(state) = snapshot.body else { panic!("body {body} is not rigid") };
    state
}

pub fn block(half_m: DVec3, position: DVec3, mass_kg: f64) -> RigidSpec {
    rigid(Solid::Box { half_extents_m: half_m }, position, mass_kg)
}

fn rod(length_m: f64, top: DVec3) -> RigidSpec {
    block(DVec3::new(0.05, 0.05, 0.5 * length_m), top - DVec3::Z * (0.5 * length_m), 1.0)
}

pub fn on_world(kind: JointKind) -> Joint {
    Joint::new(AgentId(0), None, kind)
}

const HINGE: JointKind = JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor: None };

/// A rod of 1 m whose top is in the origin.
fn tilted_rod(tilt_rad: f64) -> RigidSpec {
    let rotation = DQuat::from_rotation_y(tilt_rad);
    let start = rod(1.0, DVec3::ZERO);
    RigidSpec { rotation, position: rotation * start.position, ..start }
}

/// A rod of 1 m on a hinge in the origin, tilted.
pub fn pendulum(tilt_rad: f64, kind: JointKind, rate_hz: f64) -> Table {
    party([tilted_rod(tilt_rad)], [Joint { anchor_a_m: DVec3::Z * 0.5, ..on_world(kind) }], rate_hz)
}

/// Moment of inertia of the rod about its end, kg m².
pub const ROD_KG_M2: f64 = (1.0 + 0.05 * 0.05) / 3.0;

/// The period of a small swing of a pendulum in 10 s, seconds, and that of its closed form with an inertia beside its own.
fn periods(armature: f64, rate_hz: f64) -> [f64; 2] {
    let hinge = Joint { anchor_a_m: DVec3::Z * 0.5, armature, ..on_world(HINGE) };
    let mut table = party([tilted_rod(0.02)], [hinge], rate_hz);
    let (mut rises, mut last) = (vec![], state(&table, 0).position.x);
    for step in 1..=(10.0 * rate_hz) as u32 {
        table.step();
        let now = state(&table, 0).position.x;
        if last < 0.0 && now >= 0.0 {
            rises.push((f64::from(step) - now / (now - last)) / rate_hz);
        }
        last = now;
    }
    let found = (rises[rises.len() - 1] - rises[0]) / (rises.len() - 1) as f64;
    let slow = 1.0 + 0.02 * 0.02 / 16.0;
    [found, std::f64::consts::TAU * ((ROD_KG_M2 + armature) / (G * 0.5)).sqrt() * slow]
}

#[test]
fn a_pendulum_on_a_hinge_swings_with_its_closed_form_period() {
    for armature in [0.0, 0.5] {
        let [period, wanted] = periods(armature, 120.0);
        // (ω h)²/24 = 4e-5, and the crossings' interpolation
        assert!((period / wanted - 1.0).abs() < 1e-4, "{period} is not {wanted}");
    }
}

#[test]
fn a_rod_let_go_from_horizontal_keeps_its_energy_and_its_joint() {
    let error = |rate_hz: f64| {
        let mut table = pendulum(-std::f64::consts::FRAC_PI_2, HINGE, rate_hz);
        let (mut worst, mut highest) = (0.0_f64, f64::NEG_INFINITY);
        for step in 0..(10.0 * rate_hz) as u32 {
            table.step();
            let RigidState { position, rotation, velocity, spin, .. } = state(&table, 0);
            let gap = (position + rotation * DVec3::Z * 0.5).length();
            assert!(gap < 1e-5, "step {step}: {gap:e} m off its joint");
            // the velocity is that of the middle of the step
            let height = position.z - 0.5 * velocity.z / rate_hz;
            let energy = 0.5 * ROD_KG_M2 * spin.y * spin.y + G * height;
            worst = worst.max(energy.abs());
            highest = highest.max(if step > 20 { position.z } else { highest });
        }
        (worst, highest)
    };
    let ((coarse, _), (fine, highest)) = (error(60.0), error(240.0));
    // of 4.9 J; second order: 1.6e-2 and 1.5e-3 in the middle of steps measured
    assert!(coarse < 0.05 && fine < 0.15 * coarse, "{coarse:e} J, {fine:e} J");
    assert!(highest.abs() < 2e-3, "it comes back to {highest:e} m");
}

/// Twenty capsules of 0.2 m on ball joints, the last one heavier by `ratio`, hung from the origin along `along`.
fn chain(ratio: f64, along: DVec3, rate_hz: f64) -> Table {
    let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, along);
    let solid = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let links = (0..20).map(|i| RigidSpec {
        rotation,
        ..rigid(solid.clone(), along * (0.1 + 0.2 * f64::from(i)), if i == 19 { ratio } else { 1.0 })
    });
    party(links, ball_joints(20), rate_hz)
}

/// Links of 0.2 m hung from each other, the first from the origin.
fn ball_joints(count: u32) -> impl Iterator<Item = Joint> {
    (0..count).map(|i| Joint {
        anchor_a_m: DVec3::Z * 0.1,
        anchor_b_m: if i == 0 { DVec3::ZERO } else { DVec3::Z * -0.1 },
        ..Joint::new(AgentId(i), i.checked_sub(1).map(AgentId), JointKind::Spherical)
    })
}

fn stretch(table: &Table, links: usize) -> f64 {
    let mut end = DVec3::ZERO;
    let gaps = (0..links).map(|link| {
        let RigidState { position, rotation, .. } = state(table, link);
        let gap = (position + rotation * DVec3::Z * 0.1).distance(end);
        end = position - rotation * DVec3::Z * 0.1;
        gap
    });
    gaps.fold(0.0, f64::max)
}

#[test]
fn a_chain_that_swings_a_weight_of_a_hundred_links_keeps_its_length() {
    for (ratio, rate_hz) in [(100.0, 60.0), (1000.0, 120.0)] {
        let mut table = chain(ratio, DVec3::new(1.0, 0.0, -1.0).normalize(), rate_hz);
        let (mut worst, mut factors, mut unfinished) = (0.0_f64, 0, 0);
        let start = table.energy_j();
        for _ in 0..(2.0 * rate_hz) as u32 {
            let (report, _) = table.step();
            worst = worst.max(stretch(&table, 20));
            factors += report.factors;
            unfinished += report.unfinished;
        }
        // on its way down it has made nothing
        assert!(table.energy_j() < start + 1e-3 * start.abs(), "{} J of {start}", table.energy_j());
        assert!(factors < 1000, "{factors} factors");
        assert!(worst < 1e-5, "1 : {ratio}: a joint opened by {worst:e} m");
        assert_eq!(unfinished, 0);
    }
}

#[test]
fn a_chain_let_go_from_level_whips_and_keeps_its_length_and_its_energy() {
    // of heavy weights the links' own swings, of up to a thousand a second, are far beyond these steps
    for (ratio, rate_hz, factors_max) in
        [(50.0, 240.0, 3000), (1000.0, 240.0, 3000), (1000.0, 60.0, 3000), (1e4, 60.0, 8000)]
    {
        let mut table = chain(ratio, DVec3::X, rate_hz);
        // velocities are those of the middle of a step
        let energy_j = |table: &mut Table| {
            let falls: f64 = table.bodies.iter().map(|body| body.agent.momentum().0.z).sum();
            table.energy_j() - 0.5 * G * falls / rate_hz
        };
        let (start_j, fall_j) = (energy_j(&mut table), (ratio + 9.5) * G * 4.0);
        let (mut worst_m, mut made, mut lost, mut factors) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
        while table.time.as_secs_f64() < 4.0 {
            factors += table.step().0.factors;
            worst_m = worst_m.max(stretch(&table, 20));
            let change = (energy_j(&mut table) - start_j) / fall_j;
            (made, lost) = (made.max(change), lost.max(-change));
        }
        let case = format!("1 : {ratio} at {rate_hz} Hz");
        assert!(worst_m < 1e-5, "{case}: a joint opened by {worst_m:e} m");
        assert!(made < 0.01 && lost < 0.03, "{case}: {made} of its fall made, {lost} lost");
        assert!(factors < factors_max, "{case}: {factors} factors");
    }
}

#[test]
fn a_free_chain_with_a_heavy_end_keeps_its_angular_momentum() {
    let solid = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, DVec3::X);
    let turn = DVec3::Y * 3.0;
    let links = (0..8).map(|i| {
        let middle = DVec3::X * (0.1 + 0.2 * f64::from(i) - 1.5);
        // far above the floor
        let spec = rigid(solid.clone(), middle + DVec3::Z * 10.0, if i == 7 { 1000.0 } else { 1.0 });
        let velocity = turn.cross(middle) + DVec3::Y * 0.02 * f64::from(7 - i);
        let spec = RigidSpec { rotation, spin: turn, velocity, gravity: DVec3::ZERO, ..spec };
        placed(RigidBody::new(spec).unwrap(), false)
    });
    let mut table = Table::new(links.collect()).jointed(ball_joints(8).skip(1));
    table.step();
    let momentum = |table: &Table| table.bodies.iter().map(|body| body.agent.momentum().1).sum::<DVec3>();
    let (start, mut off) = (momentum(&table), 0.0_f64);
    while table.time.as_secs_f64() < 4.0 {
        table.step();
        off = off.max(momentum(&table).distance(start) / start.length());
    }
    // forces are at one point to 5e-6 m, and solves end where arms move by as much
    assert!(off < 2e-5, "off by {off:e} of itself");
}

#[test]
fn links_of_a_thousandth_of_what_they_carry_do_not_begin_to_tremble() {
    // three links of 10 g above 10 kg that swings: their own swings of 600 1/s are far beyond steps of 1/60 s
    let rotation = DQuat::from_rotation_y(0.3);
    let solid = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let links = (0..4).map(|i| {
        let middle = rotation * DVec3::Z * -(0.1 + 0.2 * f64::from(i));
        RigidSpec { rotation, ..rigid(solid.clone(), middle, if i == 3 { 10.0 } else { 0.01 }) }
    });
    let mut table = party(links, ball_joints(4), 60.0);
    let start = table.energy_j();
    for step in 0..300 {
        table.step();
        let gap = stretch(&table, 4);
        assert!(gap < 1e-5, "step {step}: {gap:e} m");
        // they swing as one with the weight, by 0.3 at 3.7 1/s
        let fastest = (0..4).map(|link| state(&table, link).spin.length()).fold(0.0, f64::max);
        assert!(fastest < 1.5, "step {step}: a link turns by {fastest} 1/s");
    }
    // velocities are those of the middle of a step; 3 J swing
    let falls: f64 = table.bodies.iter().map(|body| body.agent.momentum().0.z).sum();
    let made = table.energy_j() - 0.5 * G * falls / 60.0 - start;
    assert!(made.abs() < 0.05, "{made} J");
}

#[test]
fn a_chain_that_swings_allocates_next_to_nothing() {
    let mut table = chain(10.0, DVec3::new(1.0, 0.0, -1.0).normalize(), 60.0);
    let mut allocations = 0;
    for step in 0..120 {
        table.step();
        // the first swing makes room for the rows of all links
        allocations += if step < 60 { 0 } else { table.allocations };
    }
    // room for links that come near each other for the first time
    assert!(allocations <= 8, "{allocations} allocations in 60 steps");
}

#[test]
fn a_chain_that_falls_on_the_floor_stays_joined_and_lies_as_deep_as_anything() {
    let rotation = DQuat::from_rotation_y(1.2);
    let solid = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let links = (0..8).map(|i| {
        let middle = DVec3::Z * 0.8 - rotation * DVec3::Z * (0.1 + 0.2 * f64::from(i));
        placed(RigidBody::new(RigidSpec { rotation, ..rigid(solid.clone(), middle, 0.3) }).unwrap(), false)
    });
    // no joint to the world
    let mut table = Table::new(links.collect()).jointed(ball_joints(8).skip(1));
    let mut worst = 0.0_f64;
    let mut unfinished = 0;
    while table.time.as_secs_f64() < 2.0 {
        let (report, _) = table.step();
        unfinished += report.unfinished;
        let ends = |link: usize, side: f64| {
            let RigidState { position, rotation, .. } = state(&table, link);
            position + rotation * DVec3::Z * side
        };
        worst = (1..8).map(|link| ends(link, 0.1).distance(ends(link - 1, -0.1))).fold(worst, f64::max);
        assert!(table.time.as_secs_f64() < 1.5 || report.depth_m < 2.2e-5, "{} m deep", report.depth_m);
    }
    assert!(worst < 1e-5 && unfinished == 0, "a joint opened by {worst:e} m, {unfinished} unfinished");
}

#[test]
fn a_bracket_holds_a_weight_beside_it() {
    let held = block(DVec3::new(0.1, 0.02, 0.02), DVec3::X * 0.1, 2.0);
    let joint = Joint { anchor_a_m: DVec3::X * -0.1, ..on_world(JointKind::Fixed) };
    let mut table = party([held], [joint], 60.0);
    for _ in 0..120 {
        table.step();
    }
    let RigidState { position, rotation, .. } = state(&table, 0);
    // it gives way by a fifth of the depth of contacts, as far as it turns at 0.1 m too
    assert!(position.distance(DVec3::X * 0.1) < 1e-5, "{position}");
    assert!(rotation.to_scaled_axis().length() < 1e-5, "{rotation}");
}

#[test]
fn anchors_are_places_of_the_shape_whatever_its_centre_of_mass() {
    // a wedge whose centre of mass is not its origin, on a ball joint at its tip
    let points_m = [[0.0, 0.0, 0.0], [0.1, 0.05, -0.3], [-0.1, 0.05, -0.3], [0.0, -0.05, -0.3]];
    let solid = Solid::Hull { points_m: points_m.map(DVec3::from).into() };
    let spec = RigidSpec { spin: DVec3::new(1.0, 0.5, 2.0), ..rigid(solid, DVec3::ZERO, 1.0) };
    let com = RigidBody::new(spec.clone()).unwrap().com_local();
    assert!(com.length() > 0.1);
    let mut table = party([spec], [on_world(JointKind::Spherical)], 120.0);
    for step in 0..240 {
        table.step();
        let RigidState { position, rotation, .. } = state(&table, 0);
        let tip = position - rotation * com;
        // the first step takes the velocity that does not fit the joint
        assert!(tip.length() < 1e-5, "step {step}: {:e} m", tip.length());
    }
}

#[test]
fn a_hinge_stops_at_both_ends_of_its_range() {
    // let go from horizontal it falls towards +x at first, b's angle against a is minus its own
    let range_rad = Some([-0.4, 0.3]);
    let kind = JointKind::Revolute { axis: DVec3::Y, range_rad, motor: None };
    for (tilt, push) in [(0.0, DVec3::X), (0.0, DVec3::NEG_X)] {
        let mut table = pendulum(tilt, kind, 60.0);
        let mut farthest = 0.0_f64;
        for step in 0..120 {
            if step == 0 {
                let spring = metachron_contact::AnchorSpring {
                    by: None,
                    anchor: metachron_core::Anchor::Local(DVec3::Z * -0.5),
                    target: push * 10.0,
                    target_velocity: DVec3::ZERO,
                    stiffness_n_m: 10.0,
                    damping_n_s_m: 0.0,
                };
                table.bodies[0].user_springs.push(spring);
            }
            table.step();
            let rotation = state(&table, 0).rotation;
            let angle = rotation.to_scaled_axis().y;
            farthest = if push.x * -angle > farthest.abs() { -angle } else { farthest };
        }
        // the rod's end goes to +x where it turns by −y; the world lies behind by the same
        let limit = if push.x > 0.0 { 0.3 } else { -0.4 };
        assert!((farthest - limit).abs() < 1e-5, "pushed to {push} it turned to {farthest}, not {limit}");
    }
}

#[test]
fn a_body_on_a_slide_falls_along_it_and_stops_at_its_end() {
    let slope = 0.6;
    let rotation = DQuat::from_rotation_y(slope);
    let axis = rotation * DVec3::X;
    let built = |range_m| {
        // the world is b: it lies behind a by the way that a has slid, against a's own axis
        let kind = JointKind::Prismatic { axis: DVec3::NEG_X * 2.0, range_m, motor: None };
        let tilted = RigidSpec { rotation, ..block(DVec3::splat(0.1), DVec3::ZERO, 1.0) };
        party([tilted.clone()], [on_world(kind).at_rest_in(rotation, DQuat::IDENTITY)], 100.0)
    };
    let run = |table: &mut Table| {
        for _ in 0..100 {
            table.step();
        }
        state(table, 0).position
    };
    let place = run(&mut built(None));
    // implicit Euler goes ½ g h t farther than the parabola
    let wanted = axis * (0.5 * G * libm::sin(slope) * 1.01);
    // the turn is held to 5e-6 rad, of an arm of up to 2.8 m
    assert!(place.distance(wanted) < 5e-5, "{place} is not {wanted}");
    let slid = run(&mut built(Some([-0.3, 0.5]))).dot(axis);
    assert!((slid - 0.5).abs() < 1e-5, "stopped at {slid} m");
}

#[test]
fn friction_and_an_armature_act_between_the_two_bodies_of_a_hinge_or_a_ball() {
    for kind in [JointKind::Revolute { axis: DVec3::X, range_rad: None, motor: None }, JointKind::Spherical] {
        slow_down(kind);
    }
}

/// Two bodies on a joint, of which one turns against the other about x until friction stops it.
fn slow_down(kind: JointKind) {
    let at = |x: f64| RigidSpec { gravity: DVec3::ZERO, ..block(DVec3::splat(0.1), DVec3::X * x, 1.5) };
    let spun = RigidSpec { spin: DVec3::X * 3.0, ..at(0.0) };
    let ends = Joint {
        anchor_a_m: DVec3::X * 0.1,
        anchor_b_m: DVec3::X * -0.1,
        ..Joint::new(AgentId(0), Some(AgentId(1)), kind)
    };
    let friction = 0.05;
    let mut table = party([spun, at(0.2)], [Joint { armature: 0.02, friction, ..ends }], 100.0);
    // friction turns one as much as it slows the other, and the rotor with the difference of the two
    let inertia = 1.5 * 0.2 * 0.2 / 6.0;
    let slows_rad_s2 = friction / (0.5 * inertia + 0.02);
    for step in 1..=200 {
        table.step();
        let [a, b] = [0, 1].map(|body| state(&table, body).spin.x);
        let wanted = (3.0 - slows_rad_s2 * f64::from(step) / 100.0).max(0.0);
        assert!((a - b - wanted).abs() < 2e-3, "step {step}: {} rad/s for {wanted}", a - b);
        assert!((inertia * (a + b - 3.0)).abs() < 1e-9, "step {step}");
    }
}

#[test]
fn the_friction_of_a_ball_acts_against_its_turn_about_whatever_axis_and_holds_it() {
    let axis = DVec3::new(1.0, -2.0, 2.0) / 3.0;
    let spun = RigidSpec { gravity: DVec3::ZERO, spin: axis * 3.0, ..block(DVec3::splat(0.1), DVec3::ZERO, 1.5) };
    let (friction, armature) = (0.05, 0.02);
    let mut table = party([spun], [Joint { armature, friction, ..on_world(JointKind::Spherical) }], 100.0);
    let slows_rad_s2 = friction / (1.5 * 0.2 * 0.2 / 6.0 + armature);
    for step in 1..=200 {
        table.step();
        let wanted = axis * (3.0 - slows_rad_s2 * f64::from(step) / 100.0).max(0.0);
        let found = state(&table, 0).spin;
        assert!(found.distance(wanted) < 2e-3, "step {step}: {found} rad/s for {wanted}");
    }
}

#[test]
fn a_rope_is_never_longer_than_it_is() {
    let thrown = RigidSpec { velocity: DVec3::new(3.0, 1.0, 2.0), ..block(DVec3::splat(0.05), DVec3::X * 0.3, 1.0) };
    let mut table = party([thrown], [on_world(JointKind::Rope { length_m: 0.7 })], 60.0);
    let mut longest = 0.0_f64;
    for _ in 0..300 {
        table.step();
        longest = longest.max(state(&table, 0).position.length());
    }
    assert!(longest > 0.6999 && longest < 0.7 + 1e-5, "{longest} m");
}

#[test]
fn a_free_jointed_pair_keeps_its_momentum_and_stays_joined() {
    for kind in [
        JointKind::Fixed,
        JointKind::Spherical,
        JointKind::Revolute { axis: DVec3::new(1.0, 0.3, -0.2), range_rad: Some([-0.5, 0.5]), motor: None },
        JointKind::Prismatic { axis: DVec3::X, range_m: Some([-0.2, 0.2]), motor: None },
    ] {
        let at = |x: f64| RigidSpec { gravity: DVec3::ZERO, ..block(DVec3::splat(0.1), DVec3::X * x, 1.0) };
        let first = RigidSpec { spin: DVec3::new(2.0, -3.0, 4.0), ..at(0.0) };
        let second = RigidSpec { velocity: DVec3::new(0.5, 1.0, 0.2), mass_kg: 3.0, ..at(0.3) };
        let joint = Joint {
            anchor_a_m: DVec3::X * 0.15,
            anchor_b_m: DVec3::X * -0.15,
            ..Joint::new(AgentId(0), Some(AgentId(1)), kind)
        };
        let mut table = party([first, second], [joint], 100.0);
        let momentum = |table: &Table| {
            let [a, b] = [0, 1].map(|body| table.bodies[body].agent.momentum());
            (a.0 + b.0, a.1 + b.1)
        };
        let before = momentum(&table);
        for _ in 0..200 {
            table.step();
        }
        let after = momentum(&table);
        let wrong = [after.0.distance(before.0), after.1.distance(before.1)];
        // the two points of a joint are one to 5e-6 m, where impulses of some 0.01 N s act
        assert!(wrong[0] < 1e-12 && wrong[1] < 1e-4, "{kind:?}: {wrong:?}");
        let pose = |body: usize| {
            let RigidState { position, rotation, .. } = state(&table, body);
            (position, rotation)
        };
        assert_eq!(joint.check_start(pose(0), pose(1)), Ok(()));
    }
}

#[test]
fn jointed_bodies_that_overlap_pass_through_each_other_unless_they_collide() {
    for collide in [false, true] {
        let at = |x: f64| RigidSpec { gravity: DVec3::ZERO, ..block(DVec3::splat(0.1), DVec3::X * x, 1.0) };
        // a slide along x, on which one comes to the other at 1 m/s
        let kind = JointKind::Prismatic { axis: DVec3::X, range_m: None, motor: None };
        let second = RigidSpec { velocity: DVec3::NEG_X, ..at(0.3) };
        let joint = Joint { collide, ..Joint::new(AgentId(0), Some(AgentId(1)), kind) };
        let mut table = party([at(0.0), second], [joint], 100.0);
        for _ in 0..40 {
            table.step();
        }
        let apart = state(&table, 1).position.x - state(&table, 0).position.x;
        let wanted = if collide { 0.2 } else { -0.1 };
        assert!((apart - wanted).abs() < 1e-4, "collide {collide}: {apart} m apart");
    }
}
