//! The contact traits of bodies and static solids: groups, rules of pairs, sensors, friction about normals. Against closed forms.

use crate::bodies::{rigid, solid};
use crate::joints::{G, state};
use crate::table::{GRAVITY, Placed, Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, ContactPartner, SensorTouch};
use metachron_geometry::{CollisionGroups, CombineRule, ContactTraits, Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};
use metachron_models::soft::{SoftBody, SoftSpec};

const TOOLS: u32 = 0b01;
const TISSUE: u32 = 0b10;

fn floor(traits: ContactTraits) -> Obstacle {
    Obstacle { traits, ..plane(DQuat::IDENTITY, 0.5) }
}

fn grouped(member_of: u32, collides_with: u32) -> ContactTraits {
    ContactTraits { groups: CollisionGroups { member_of, collides_with }, ..ContactTraits::default() }
}

fn ball(radius_m: f64, middle: DVec3) -> RigidSpec {
    rigid(Solid::Ball { radius_m }, middle, 1.0)
}

fn body(spec: RigidSpec) -> Placed {
    placed(RigidBody::new(spec).unwrap(), false)
}

fn at_rate(mut table: Table, rate_hz: f64) -> Table {
    table.bodies.iter_mut().for_each(|body| body.rate_hz = rate_hz);
    table
}

/// One body of each kind, 2 mm over the floor.
fn one_of_each(traits: ContactTraits) -> [Placed; 3] {
    let cube = SoftSpec { traits, ..solid(DVec3::Z * 0.052, DVec3::splat(0.1), [2; 3], 1e5) };
    let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
    let path_m = vec![DVec3::new(-0.1, 0.0, 0.012), DVec3::new(0.1, 0.0, 0.012)];
    let tube =
        TubeSpec { gravity: GRAVITY, traits, ..TubeSpec::free(path_m, Section::hollow(0.01, 0.01, material), 4) };
    [
        body(RigidSpec { traits, ..ball(0.05, DVec3::Z * 0.052) }),
        placed(SoftBody::new(cube).unwrap(), false),
        placed(Tube::new(tube).unwrap(), false),
    ]
}

#[test]
fn bodies_of_every_kind_fall_through_a_floor_of_a_group_that_they_do_not_collide_with() {
    for (traits, falls) in
        [(grouped(TOOLS, TISSUE), false), (grouped(TOOLS, TOOLS), true), (grouped(TISSUE, TISSUE), true)]
    {
        for one in one_of_each(traits) {
            let model = one.agent.model();
            // a floor of tissue that tools alone collide with
            let mut table = Table::among(vec![one], &[floor(grouped(TISSUE, TOOLS))]);
            let before = table.middle(0).0.z;
            table.play(0.3);
            let fell = before - table.middle(0).0.z;
            let free = 0.5 * G * 0.3 * 0.3;
            let good = if falls { (fell / free - 1.0).abs() < 0.07 } else { fell < 0.01 };
            assert!(good, "{model} fell by {fell} m, {free} m is free, {traits:?}");
        }
    }
}

#[test]
fn two_bodies_pass_through_each_other_unless_each_collides_with_a_group_of_the_other() {
    let meets = |mine: ContactTraits, theirs: ContactTraits| {
        let at = |x: f64, v: f64, traits| RigidSpec {
            velocity: DVec3::X * v,
            restitution: 1.0,
            traits,
            gravity: DVec3::ZERO,
            ..ball(0.1, DVec3::X * x)
        };
        let mut table = Table::among(vec![body(at(-0.5, 1.0, mine)), body(at(0.0, 0.0, theirs))], &[]);
        table.play(0.5);
        state(&table, 1).velocity.x > 0.5
    };
    let any = ContactTraits::default();
    assert!(meets(any, any) && meets(grouped(TOOLS, TISSUE), grouped(TISSUE, TOOLS)));
    assert!(meets(any, grouped(TOOLS, TISSUE)), "what names no group is in all of them");
    assert!(!meets(grouped(TOOLS, TISSUE), grouped(TOOLS, TISSUE)) && !meets(any, grouped(TOOLS, 0)));
    assert!(!meets(grouped(TOOLS, TISSUE), grouped(TISSUE, TISSUE)), "one side alone is not enough");
}

#[test]
fn a_box_slides_by_the_friction_that_its_pairs_rule_makes() {
    use CombineRule::{Average, GeometricMean, Max, Min, Multiply};
    let slope = 0.6;
    let cases = [
        (None, None, 0.15),
        (Some(Min), None, 0.1),
        (None, Some(Average), 0.5),
        (Some(Multiply), Some(Min), 0.09),
        (Some(Average), Some(GeometricMean), 0.3),
    ];
    for (at, (mine, theirs, friction)) in cases.into_iter().enumerate() {
        // 0.1 and 0.9, and where no rule is given 0.045 and 0.5
        let coefficients = if at == 0 { [0.045, 0.5] } else { [0.1, 0.9] };
        let rotation = DQuat::from_rotation_y(slope);
        let traits = |friction_rule| ContactTraits { friction_rule, ..ContactTraits::default() };
        let solid = Solid::Box { half_extents_m: DVec3::splat(0.05) };
        let spec = RigidSpec {
            rotation,
            friction: coefficients[0],
            traits: traits(mine),
            ..rigid(solid, rotation * DVec3::Z * 0.05, 1.0)
        };
        let slope_solid = Obstacle { traits: traits(theirs), ..plane(rotation, coefficients[1]) };
        let mut table = at_rate(Table::among(vec![body(spec)], &[slope_solid]), 240.0);
        table.play(0.5);
        let speed = state(&table, 0).velocity.dot(rotation * DVec3::X);
        let wanted = 0.5 * G * (libm::sin(slope) - friction * libm::cos(slope));
        assert!((speed / wanted - 1.0).abs() < 1e-3, "{mine:?} and {theirs:?}: {speed} m/s, {wanted} m/s wanted");
    }
    assert_eq!(CombineRule::of_pair([Some(Max), Some(Average)], GeometricMean), Max);
}

#[test]
fn a_ball_rebounds_by_the_restitution_that_its_pairs_rule_makes() {
    for (rule, restitution) in [(None, 0.8), (Some(CombineRule::Multiply), 0.4), (Some(CombineRule::Average), 0.65)] {
        let traits = ContactTraits { restitution_rule: rule, ..ContactTraits::default() };
        let spec = RigidSpec { restitution: 0.5, ..ball(0.05, DVec3::Z * 0.55) };
        let hard = Obstacle { restitution: 0.8, ..floor(traits) };
        let mut table = at_rate(Table::among(vec![body(spec)], &[hard]), 240.0);
        let mut highest = 0.0_f64;
        while table.time.as_secs_f64() < 0.75 {
            table.step();
            if table.time.as_secs_f64() > 0.33 {
                highest = highest.max(state(&table, 0).position.z - 0.05);
            }
        }
        // a flight is exact, its top is looked at every 1/240 s
        let wanted = 0.5 * restitution * restitution;
        assert!((highest / wanted - 1.0).abs() < 2e-3, "{rule:?}: {highest} m, {wanted} m wanted");
    }
}

/// The touch of a body with one partner that senses it or that it senses, after some seconds.
fn sensed(table: &mut Table, body: usize, with: ContactPartner, seconds: f64) -> SensorTouch {
    table.play(seconds);
    let found: Vec<_> = table.sensed(body).iter().filter(|touch| touch.with == with).collect();
    assert_eq!(found.len(), 1, "{with:?} once: {:?}", table.sensed(body));
    *found[0]
}

#[test]
fn a_static_sensor_counts_what_falls_through_it_and_gives_no_force() {
    let traits = ContactTraits { is_sensor: true, ..ContactTraits::default() };
    let gate = Obstacle {
        solid: Solid::Box { half_extents_m: DVec3::new(1.0, 1.0, 0.1) },
        position: DVec3::Z * -0.5,
        ..floor(traits)
    };
    for one in one_of_each(ContactTraits::default()) {
        let model = one.agent.model();
        let mut table = at_rate(Table::among(vec![one], std::slice::from_ref(&gate)), 240.0);
        let start = table.middle(0).0.z;
        let inside = sensed(&mut table, 0, ContactPartner::Static(0), 0.3);
        assert_eq!((inside.touching, inside.begins, inside.ends), (true, 1, 0), "{model}");
        // its lower side, 2 mm over the origin, falls by 0.402 m
        let meets_s = (2.0 * 0.402 / G).sqrt();
        assert!((inside.changed.as_secs_f64() - meets_s).abs() < 1.1 / 240.0 + 0.003, "{model}: {:?}", inside.changed);
        let outside = sensed(&mut table, 0, ContactPartner::Static(0), 0.6);
        assert_eq!((outside.touching, outside.begins, outside.ends), (false, 1, 1), "{model}");
        let (fell, free) = (start - table.middle(0).0.z, 0.5 * G * 0.6 * 0.6);
        assert!((fell / free - 1.0).abs() < 0.02, "{model} fell by {fell} m of {free} m");
    }
}

#[test]
fn a_sensor_sees_what_shoots_through_it_within_a_step() {
    let traits = ContactTraits { is_sensor: true, ..ContactTraits::default() };
    let solid = Solid::Box { half_extents_m: DVec3::new(5e-4, 1.0, 1.0) };
    let gate = Obstacle { solid, position: DVec3::X, ..floor(traits) };
    let bullet = RigidSpec { velocity: DVec3::X * 300.0, gravity: DVec3::ZERO, ..ball(0.005, DVec3::Y * 0.3) };
    let mut table = Table::among(vec![body(bullet)], &[gate]);
    let seen = sensed(&mut table, 0, ContactPartner::Static(0), 0.1);
    assert_eq!((seen.touching, seen.begins, seen.ends), (false, 1, 1));
    assert_eq!(state(&table, 0).velocity, DVec3::X * 300.0);
}

#[test]
fn a_small_static_sensor_is_sensed_from_within_a_large_body() {
    let traits = ContactTraits { is_sensor: true, ..ContactTraits::default() };
    let small = Solid::Box { half_extents_m: DVec3::splat(0.01) };
    // a hull whose origin is beside it
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|at| DVec3::X + at * 0.01);
    let hull = Solid::Hull { points_m: corners.into() };
    for (solid, position) in [(small, DVec3::ZERO), (hull, -DVec3::X)] {
        let probe = Obstacle { solid, position, ..floor(traits) };
        let large = RigidSpec { velocity: DVec3::X, gravity: DVec3::ZERO, ..ball(0.3, -DVec3::X) };
        let mut table = at_rate(Table::among(vec![body(large)], &[probe]), 240.0);
        let inside = sensed(&mut table, 0, ContactPartner::Static(0), 1.0);
        assert_eq!((inside.touching, inside.begins, inside.ends), (true, 1, 0));
        let beyond = sensed(&mut table, 0, ContactPartner::Static(0), 1.5);
        assert_eq!((beyond.touching, beyond.begins, beyond.ends), (false, 1, 1));
    }
}

#[test]
fn a_body_that_is_a_sensor_tells_of_another_body_each_time_and_neither_is_moved() {
    let traits = ContactTraits { is_sensor: true, ..ContactTraits::default() };
    let eye = RigidSpec { traits, gravity: DVec3::ZERO, ..ball(0.1, DVec3::ZERO) };
    let bob = RigidSpec { ..ball(0.05, DVec3::X * 0.3) };
    // a bob on a spring without gravity goes to and fro through the eye
    let bob = RigidSpec { gravity: DVec3::ZERO, ..bob };
    let mut table = at_rate(Table::among(vec![body(eye), body(bob)], &[]), 240.0);
    let spring = metachron_contact::AnchorSpring {
        by: None,
        anchor: metachron_core::Anchor::Local(DVec3::ZERO),
        target: DVec3::ZERO,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 40.0,
        damping_n_s_m: 0.0,
    };
    table.bodies[1].user_springs.push(spring);
    // the period of 1 kg on 40 N/m is 0.993 s: it is in the eye twice in each
    let seen = sensed(&mut table, 0, ContactPartner::Agent(AgentId(1)), 1.05);
    assert_eq!((seen.touching, seen.begins, seen.ends), (false, 2, 2));
    assert_eq!(state(&table, 0).velocity, DVec3::ZERO);
    assert!(table.sensed(1).is_empty(), "the agent of lower number tells of it");
}

#[test]
fn a_ball_loses_its_spin_by_friction_r_times_its_weight_and_stops() {
    let (radius_m, spin_radius_m, spin) = (0.05, 0.01, 20.0);
    let traits = ContactTraits { spin_radius_m, ..ContactTraits::default() };
    let inertia = 0.4 * radius_m * radius_m;
    let slows = 0.5 * spin_radius_m * G / inertia;
    for rate_hz in [60.0, 240.0, 1000.0] {
        let spec = RigidSpec { spin: DVec3::Z * spin, traits, ..ball(radius_m, DVec3::Z * (radius_m - 20e-6)) };
        let mut table = at_rate(Table::among(vec![body(spec)], &[floor(ContactTraits::default())]), rate_hz);
        let mut last = table.energy_j();
        while table.time.as_secs_f64() < 0.6 {
            table.step();
            let (now, time) = (state(&table, 0).spin, table.time.as_secs_f64());
            let wanted = (spin - slows * time).max(0.0);
            // the first steps settle the load; the slip that is owed is some 2e-5 rad
            assert!(
                (now.z - wanted).abs() < 0.02 && now.with_z(0.0).length() < 1e-6,
                "{now} at {time} s and {rate_hz} Hz, not {wanted}"
            );
            let energy = table.energy_j();
            assert!(energy <= last + 1e-7, "{:e} J made at {time} s", energy - last);
            last = energy;
        }
        assert!(state(&table, 0).spin.length() < 1e-3, "it stands in the end: {}", state(&table, 0).spin);
    }
}

#[test]
fn a_ball_that_rebounds_loses_spin_by_each_blow_and_none_in_flight() {
    let (radius_m, spin_radius_m, spin, height_m) = (0.05, 0.01, 50.0, 0.1);
    let traits = ContactTraits { spin_radius_m, ..ContactTraits::default() };
    let spec = RigidSpec {
        spin: DVec3::Z * spin,
        restitution: 1.0,
        traits,
        ..ball(radius_m, DVec3::Z * (radius_m + height_m))
    };
    let mut table = at_rate(Table::among(vec![body(spec)], &[floor(ContactTraits::default())]), 240.0);
    let fall_s = (2.0 * height_m / G).sqrt();
    // an impact of 2 m v has a torque of μ r of it
    let by_blow = 0.5 * spin_radius_m * 2.0 * G * fall_s / (0.4 * radius_m * radius_m);
    for blows in 0..3 {
        // in the middle of the flight before the next impact, and a little later
        for later_s in [0.0, 0.3 * fall_s] {
            table.play(2.0 * f64::from(blows) * fall_s + later_s);
            let (now, wanted) = (state(&table, 0).spin.z, spin - f64::from(blows) * by_blow);
            assert!((now - wanted).abs() < 1e-3 * by_blow, "{now} rad/s after {blows} blows, {wanted} wanted");
        }
    }
}

#[test]
fn what_spins_on_a_plate_gives_it_all_the_spin_that_it_loses() {
    let traits = ContactTraits { spin_radius_m: 0.02, ..ContactTraits::default() };
    let disc = Solid::Cylinder { radius_m: 0.1, half_height_m: 0.01 };
    // without gravity a ball that is pressed on nothing keeps its spin: here it rests on a plate that rests without
    // friction
    let plate = RigidSpec { friction: 0.5, ..rigid(disc, DVec3::Z * 0.01, 2.0) };
    let top = RigidSpec { spin: DVec3::Z * 10.0, traits, ..ball(0.05, DVec3::Z * 0.07) };
    let smooth = Obstacle { friction: 0.0, ..floor(ContactTraits::default()) };
    // a cylinder lies along z
    let mut table = at_rate(Table::among(vec![body(plate), body(top)], &[smooth]), 240.0);
    let momentum = |table: &Table| {
        let (plate, top) = (state(table, 0).spin.z, state(table, 1).spin.z);
        (0.5 * 2.0 * 0.01 * plate + 0.4 * 0.0025 * top, top - plate)
    };
    let (before, _) = momentum(&table);
    table.play(1.0);
    let (after, apart) = momentum(&table);
    assert!((after / before - 1.0).abs() < 1e-6, "{after} of {before} N m s");
    assert!(apart.abs() < 1e-4, "they turn as one in the end: {apart} rad/s");
}

#[test]
fn a_heap_knows_groups_and_sensors() {
    // four contacts each
    let traits = |member_of| grouped(member_of, member_of);
    let flat = Solid::Box { half_extents_m: DVec3::new(0.04, 0.04, 0.01) };
    let at = |i: u32| DVec3::new(f64::from(i % 20) * 0.1, f64::from(i / 20) * 0.1, 0.01 - 2e-5);
    let boxes = (0..300).map(|i| RigidSpec {
        traits: if i < 295 { traits(TISSUE) } else { traits(TOOLS) },
        ..rigid(flat.clone(), at(i), 0.1)
    });
    let sensor = ContactTraits { is_sensor: true, ..ContactTraits::default() };
    let gate = Obstacle {
        solid: Solid::Box { half_extents_m: DVec3::splat(0.02) },
        position: DVec3::Z * 0.01,
        ..floor(sensor)
    };
    let mut table = Table::among(boxes.map(body).collect(), &[floor(traits(TISSUE)), gate]).hurried();
    assert!(table.step().0.pile_contacts > 1000, "rapier3d has it");
    table.play(0.2);
    let heights: Vec<f64> = (0..300).map(|i| state(&table, i).position.z).collect();
    assert!(heights[..295].iter().all(|z| (z - 0.01).abs() < 1e-3), "those of the floor's group lie");
    assert!(heights[295..].iter().all(|z| *z < -0.1), "the others fall through it: {:?}", &heights[295..]);
    let seen = sensed(&mut table, 0, ContactPartner::Static(1), 0.21);
    assert!(seen.touching && seen.begins == 1, "{seen:?}");
}
