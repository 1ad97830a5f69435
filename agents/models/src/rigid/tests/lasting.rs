//! Rigid bodies with different clocks in lasting contact and on links: what carries, pushes, rests and wakes.

use super::*;
use crate::harness::{Faults, Stage};
use metachron_contact::{Exchange, Law, Link};
use metachron_core::ToolState;
use metachron_geometry::ToolShape;
use metachron_geometry::{CollisionShape, ShapeKind};

const RADIUS: f64 = 0.05;

/// A light fast ball on a heavy slow box that stands on the floor.
#[test]
fn a_ball_that_lies_on_a_slow_box_neither_sinks_nor_creeps_and_is_bonded_to_it() {
    for (box_hz, ball_hz) in [(60.0, 1000.0), (30.0, 240.0), (1000.0, 60.0), (240.0, 240.0)] {
        let mut stage = Stage::new(Faults::default());
        let table = RigidSpec { mass_kg: 2.0, obstacles: [floor(0.5)].into(), ..cube(0.1, UP * 0.1) };
        let solid = Solid::Ball { radius_m: RADIUS };
        let on_it = RigidSpec { mass_kg: 0.1, friction: 0.5, sleep: false, ..spec(solid, UP * 0.27) };
        let table = stage.add(RigidBody::new(RigidSpec { sleep: false, ..table }).unwrap(), box_hz);
        let ball = stage.add(RigidBody::new(on_it).unwrap(), ball_hz);
        let (mut lowest, mut farthest, mut bonded) = (0.0_f64, 0.0_f64, false);
        stage.run(3.0, |stage| {
            let now = stage.newest(ball).time.as_secs_f64();
            let [box_, ball_] = [table, ball].map(|id| stage.settled(id, now).state.position);
            if now > 1.5 {
                lowest = lowest.min(ball_.z - box_.z - 0.15);
                farthest = farthest.max((ball_ - box_).truncate().length());
                bonded |= [(table, ball), (ball, table)].iter().any(|(a, b)| stage.newest(*a).bonds == [*b]);
            }
        });
        println!("{box_hz} Hz under {ball_hz} Hz: {lowest:.2e} m, {farthest:.2e} m, {:?}", stage.newest(ball).pairs);
        assert!(lowest > -2e-3, "{box_hz} Hz under {ball_hz} Hz: {lowest} m");
        assert!(farthest < 1e-3, "{box_hz} Hz under {ball_hz} Hz: {farthest} m aside");
        assert!(bonded, "{box_hz} Hz under {ball_hz} Hz");
    }
}

#[test]
fn two_bodies_on_a_spring_between_two_clocks_swing_at_its_frequency_and_keep_momentum() {
    for rates in [[1000.0, 1000.0], [1000.0, 240.0], [240.0, 1000.0], [1000.0, 60.0]] {
        let (masses, stiffness) = ([0.1, 0.3], 20.0);
        let mut stage = Stage::new(Faults::default());
        let make = |x: f64, i: usize| {
            let solid = Solid::Ball { radius_m: 0.01 };
            RigidBody::new(RigidSpec { mass_kg: masses[i], gravity: DVec3::ZERO, ..spec(solid, DVec3::X * x) }).unwrap()
        };
        let first = stage.add(make(0.0, 0), rates[0]);
        let second = stage.add(make(0.25, 1), rates[1]);
        let centre = Anchor::Local(DVec3::ZERO);
        let link = Link {
            other: second,
            here: centre,
            there: centre,
            stiffness_n_m: stiffness,
            damping_n_s_m: 0.0,
            rest_m: 0.2,
            law: Law::Cluster,
        };
        stage.link(first, link);
        let frequency = (stiffness * (1.0 / masses[0] + 1.0 / masses[1])).sqrt();
        let (mut crossings, mut last) = (vec![], None);
        stage.run(2.0, |stage| {
            let now = stage.newest(first).time.as_secs_f64();
            let [a, b] = [first, second].map(|id| stage.settled(id, now).state.position.x);
            let stretch = b - a - 0.2;
            if let Some((then, before)) = last
                && now > then
                && before > 0.0
                && stretch <= 0.0
            {
                crossings.push(then + (now - then) * before / (before - stretch));
            }
            last = Some((now, stretch));
        });
        let periods = crossings.len() - 1;
        let measured = std::f64::consts::TAU * periods as f64 / (crossings[periods] - crossings[0]);
        println!("{rates:?}: {measured} rad/s for {frequency}");
        // implicit springs: a few per cent at 240 Hz
        assert!((measured / frequency - 1.0).abs() < 0.03, "{rates:?}: {measured} rad/s for {frequency}");
        assert!(stage.momentum().length() < 1e-14, "{rates:?}: {}", stage.momentum()); // rounding
    }
}

#[test]
fn a_stiff_link_between_clocks_never_blows_up() {
    for (rates, stiffness) in
        [[1000.0, 60.0], [60.0, 1000.0], [240.0, 10.0]].into_iter().flat_map(|r| [(r, 1e3), (r, 1e7)])
    {
        let mut stage = Stage::new(Faults { jitter: 0.2, loss: 0.02, late: 0, seed: 5 });
        let make = |x: f64, speed: f64| {
            let thrown = RigidSpec { velocity: UP * speed, gravity: DVec3::ZERO, ..cube(0.02, DVec3::X * x) };
            RigidBody::new(thrown).unwrap()
        };
        let first = stage.add(make(0.0, 0.0), rates[0]);
        let second = stage.add(make(0.1, 1.0), rates[1]);
        let [here, there] = [0.05, -0.05].map(|x| Anchor::Local(DVec3::X * x));
        let link = Link {
            other: second,
            here,
            there,
            stiffness_n_m: stiffness,
            damping_n_s_m: 0.0,
            rest_m: 0.0,
            law: Law::Cluster,
        };
        stage.link(first, link);
        let mut most = 0.0_f64;
        let start = 0.25;
        stage.run(2.0, |stage| {
            let now = stage.newest(first).time.as_secs_f64();
            let kinetic: f64 = [first, second].map(|id| stage.settled(id, now).kinetic_j()).iter().sum();
            most = most.max(kinetic / start);
        });
        println!("{rates:?}, {stiffness:e} N/m: kinetic energy at most {most} of the start");
        assert!(most < 1.05, "{rates:?}, {stiffness:e} N/m: {most}");
    }
}

/// A slow ball that lies on a fast box on the floor, until both rest; then a second ball falls beside it and wakes nobody,
/// or on the box and wakes it.
#[test]
fn bodies_that_touch_rest_together_and_a_blow_wakes_them() {
    let mut stage = Stage::new(Faults::default());
    let slab = Solid::Box { half_extents_m: DVec3::new(0.3, 0.3, 0.05) };
    let slab = RigidSpec { mass_kg: 2.0, obstacles: [floor(0.5)].into(), ..spec(slab, UP * 0.05) };
    let slab = stage.add(RigidBody::new(slab).unwrap(), 240.0);
    let on_it = RigidSpec { mass_kg: 0.1, ..cube(0.05, UP * 0.151) };
    let fast = stage.add(RigidBody::new(on_it).unwrap(), 500.0);
    stage.run(3.0, |_| {});
    assert!(stage.newest(slab).at_rest, "{:?}", stage.newest(slab).body);
    assert!(stage.newest(fast).at_rest, "{:?}", stage.newest(fast).body);
    let falling = RigidSpec { mass_kg: 0.5, velocity: UP * -1.0, ..spec(Solid::Ball { radius_m: 0.03 }, UP * 0.6) };
    let falling = RigidSpec { position: DVec3::new(0.2, 0.0, 0.6), ..falling };
    let falling = stage.add(RigidBody::new(falling).unwrap(), 1000.0);
    let mut woken = false;
    stage.run(4.0, |stage| woken |= !stage.newest(slab).at_rest);
    assert!(woken, "{:?}", stage.newest(falling).pairs);
    let Body::Rigid(state) = stage.newest(falling).body else { panic!("rigid") };
    assert!((state.position.z - 0.13).abs() < 2e-3, "{state:?}"); // on the slab, not in it
}

/// A tool without an instrument: it moves evenly and takes what it is given.
struct Pusher {
    state: ToolState,
    exchange: Exchange,
    taken: DVec3,
}

impl Agent for Pusher {
    fn model(&self) -> &'static str {
        "tool"
    }

    fn step(&mut self, dt: SimSpan, around: &StepContext<'_>) -> Result<StepReport, StepError> {
        self.exchange.open(around);
        let taken = &mut self.taken;
        self.exchange.take(around, around.time + dt, |_, _, sum, _| *taken += sum.linear);
        self.state.tip += self.state.velocity * dt.as_secs_f64();
        self.exchange.close(around, dt.as_secs_f64());
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        let kind = ShapeKind::Tool(ToolShape { shaft_radius_m: 5e-3, shaft_length_m: 0.3 });
        Some(Arc::new(CollisionShape { kind, friction: 0.3, restitution: 0.0 }))
    }

    fn resolution(&self) -> Option<metachron_core::Resolution> {
        None
    }

    fn set_resolution(&mut self, _wanted: metachron_core::Resolution) {}

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.body = Body::Tool(self.state);
        self.exchange.write(into);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ZERO)
    }

    fn mass_kg(&self) -> f64 {
        0.0
    }
}

#[test]
fn a_tool_pushes_a_body_at_its_own_speed_and_feels_what_it_gives() {
    for (tool_hz, body_hz) in [(1000.0, 60.0), (60.0, 1000.0), (120.0, 120.0)] {
        let mut stage = Stage::new(Faults::default());
        let velocity = DVec3::X * 0.1;
        let state = ToolState {
            tip: DVec3::ZERO,
            rotation: DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2),
            velocity,
            spin: DVec3::ZERO,
            jaw: 0.0,
            grasp: None,
            admits: None,
            force_n: 0.0,
            is_idle: false,
        };
        let tool = stage.add(Pusher { state, exchange: Exchange::wary(), taken: DVec3::ZERO }, tool_hz);
        let pushed = RigidSpec { gravity: DVec3::ZERO, mass_kg: 0.2, friction: 0.3, ..cube(0.03, DVec3::X * 0.07) };
        let pushed = stage.add(RigidBody::new(pushed).unwrap(), body_hz);
        stage.run(1.0, |_| {});
        let end = stage.settled(pushed, 1.0);
        assert!(end.state.velocity.distance(velocity) < 1e-3, "{tool_hz}, {body_hz} Hz: {end:?}");
        let pair = stage.newest(pushed).pairs.iter().find(|pair| pair.with == tool).copied();
        let given = pair.expect("they touch").impulse_n_s;
        assert!((given - 0.2 * 0.1).abs() < 0.2 * 0.1 * 0.05, "{tool_hz}, {body_hz} Hz: {given} N·s");
        assert!(pair.unwrap().tank_j.is_some_and(|tank| tank > 0.0));
    }
}

/// A light fast box between the floor and a heavy slow one: nothing but the ledger holds the two apart.
#[test]
fn a_light_box_holds_a_slow_one_ten_times_its_mass() {
    for (light_hz, heavy_hz) in [(1000.0, 60.0), (240.0, 240.0)] {
        let mut stage = Stage::new(Faults::default());
        let below = RigidSpec { mass_kg: 0.5, obstacles: [floor(0.5)].into(), sleep: false, ..cube(0.05, UP * 0.05) };
        let above = RigidSpec { mass_kg: 5.0, sleep: false, ..cube(0.05, UP * 0.151) };
        let below = stage.add(RigidBody::new(below).unwrap(), light_hz);
        let above = stage.add(RigidBody::new(above).unwrap(), heavy_hz);
        let mut deepest = 0.0_f64;
        stage.run(2.0, |stage| {
            let now = stage.newest(above).time.as_secs_f64().min(stage.newest(below).time.as_secs_f64());
            let [low, high] = [below, above].map(|id| stage.settled(id, now).state.position);
            deepest = deepest.max(0.1 - (high.z - low.z));
        });
        println!("light {light_hz} Hz, heavy {heavy_hz} Hz: {deepest:.2e} m");
        assert!(deepest < 5e-3, "light {light_hz} Hz, heavy {heavy_hz} Hz: {deepest} m");
    }
}

#[test]
fn a_body_that_comes_near_wakes_the_sleeping_owner_of_their_contact() {
    let mut stage = Stage::new(Faults::default());
    let owner = RigidSpec { obstacles: [floor(0.5)].into(), ..cube(0.05, UP * 0.05) };
    let owner = stage.add(RigidBody::new(owner).unwrap(), 1000.0);
    let solid = Solid::Ball { radius_m: 0.03 };
    let flying = RigidSpec { velocity: DVec3::X, gravity: DVec3::ZERO, ..spec(solid, DVec3::new(-0.9, 0.0, 0.05)) };
    let flying = stage.add(RigidBody::new(flying).unwrap(), 60.0);
    let (mut slept, mut knocked_at) = (false, None);
    stage.run(0.8, |stage| {
        let knocks = stage.newest(flying).touches == [owner];
        slept |= stage.newest(owner).at_rest;
        if knocks && knocked_at.is_none() {
            knocked_at = Some(stage.settled(flying, stage.newest(flying).time.as_secs_f64()).state.position.x);
        }
    });
    let at: f64 = knocked_at.expect("it knocks");
    assert!(slept && at > -0.2 && at < -0.08, "it knocks at {at} m, the other slept: {slept}");
}

/// The other way round the ledger alone does not hold for long: the light box answers each load a step late and rocks.
/// It only has to last until the two share one world.
#[test]
fn a_heavy_fast_box_sinks_little_into_a_slow_light_one_before_they_are_bonded() {
    for (light_hz, heavy_hz) in [(60.0, 240.0), (60.0, 1000.0)] {
        let mut stage = Stage::new(Faults::default());
        let below = RigidSpec { mass_kg: 0.5, obstacles: [floor(0.5)].into(), ..cube(0.05, UP * 0.05) };
        let above = RigidSpec { mass_kg: 5.0, ..cube(0.05, UP * 0.151) };
        let below = stage.add(RigidBody::new(below).unwrap(), light_hz);
        let above = stage.add(RigidBody::new(above).unwrap(), heavy_hz);
        let (mut deepest, mut bonded) = (0.0_f64, false);
        stage.run(0.3, |stage| {
            let [low, high] = [below, above].map(|id| stage.newest(id).body.probe(0.0).unwrap().0);
            bonded |= !stage.newest(above).bonds.is_empty();
            deepest = if bonded { deepest } else { deepest.max(0.1 - (high.z - low.z)) };
        });
        println!("light {light_hz} Hz under heavy {heavy_hz} Hz: {deepest:.2e} m before they are bonded");
        assert!(bonded && deepest < 1e-2, "light {light_hz} Hz, heavy {heavy_hz} Hz: {deepest} m, bonded {bonded}");
    }
}

#[test]
fn a_body_of_a_millionth_of_the_mass_bonds_with_what_carries_it() {
    for (light_hz, heavy_hz) in [(100.0, 240.0), (240.0, 100.0)] {
        let mut stage = Stage::new(Faults::default());
        let below = RigidSpec { mass_kg: 1e3, obstacles: [floor(0.5)].into(), ..cube(0.05, UP * 0.05) };
        let above = RigidSpec { mass_kg: 1e-3, ..cube(0.05, UP * 0.1505) };
        let below = stage.add(RigidBody::new(below).unwrap(), heavy_hz);
        let above = stage.add(RigidBody::new(above).unwrap(), light_hz);
        let mut bonded = false;
        stage.run(0.4, |stage| bonded |= [below, above].into_iter().any(|id| !stage.newest(id).bonds.is_empty()));
        assert!(bonded, "light {light_hz} Hz, heavy {heavy_hz} Hz");
    }
}

#[test]
fn boxes_that_start_on_each_other_are_bonded_at_once_and_colliding_ones_are_not() {
    let mut stage = Stage::new(Faults::default());
    let ids: Vec<_> = (0..5)
        .map(|i| {
            let at = UP * (0.05 + 0.1 * f64::from(i));
            let part = RigidSpec { obstacles: [floor(0.5)].into(), ..cube(0.05, at) };
            stage.add(RigidBody::new(part).unwrap(), 240.0)
        })
        .collect();
    stage.run(2.5 / 240.0, |_| {});
    for pair in ids.windows(2) {
        assert_eq!(stage.newest(pair[0]).bonds, [pair[1]]);
    }
    for id in &ids {
        let Body::Rigid(state) = stage.newest(*id).body else { panic!("rigid") };
        assert!(state.position.truncate().length() < 1e-5, "{state:?}");
    }

    let mut stage = Stage::new(Faults::default());
    let thrown = |x: f64, speed: f64| {
        let still = RigidSpec { gravity: DVec3::ZERO, ..cube(0.05, DVec3::X * x) };
        RigidBody::new(RigidSpec { velocity: DVec3::X * speed, ..still }).unwrap()
    };
    let ids = [(stage.add(thrown(-0.1, 1.0), 240.0)), stage.add(thrown(0.1, -1.0), 60.0)];
    stage.run(0.5, |stage| assert!(ids.iter().all(|id| stage.newest(*id).bonds.is_empty())));
}

/// Gravity would have a bounce of these speeds back within a step: a body that bounced in each of its steps would never press on
/// what it lies on, and sink.
#[test]
fn a_box_that_bounces_a_little_comes_to_lie_on_another() {
    for rates in [[240.0, 240.0], [60.0, 60.0], [240.0, 60.0], [60.0, 240.0], [1000.0, 100.0]] {
        for restitution in [0.0, 0.2, 0.5] {
            let mut stage = Stage::new(Faults::default());
            let body = |spec: RigidSpec| {
                RigidBody::new(RigidSpec { mass_kg: 1.0, restitution, obstacles: [floor(0.5)].into(), ..spec }).unwrap()
            };
            let low = stage.add(body(cube(0.1, UP * 0.1)), rates[0]);
            let high = stage.add(body(cube(0.2, UP * 0.42)), rates[1]);
            let mut deepest = 0.0_f64;
            stage.run(3.0, |stage| {
                let owner = if rates[1] > rates[0] { high } else { low };
                let now = stage.newest(owner).time.as_secs_f64();
                let apart = stage.settled(high, now).state.position.z - stage.settled(low, now).state.position.z - 0.3;
                deepest = deepest.max(-apart);
            });
            let height = stage.settled(high, 3.0).state.position.z - 0.4;
            let case = format!("{rates:?} Hz, e = {restitution}: {height} m high, {deepest} m deep");
            println!("{case}");
            assert!(height.abs() < 1e-3 && deepest < 2e-3, "{case}");
        }
    }
}
