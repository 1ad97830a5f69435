//! Commands have the effect that mechanics predicts, for as long as they were sent for, whatever the steps of the
//! object that obeys them.

use glam::{DQuat, DVec3};
use metachron_contact::joint::{JointKind, Motor, MotorGoal};
use metachron_contact::{Agent, OwnSteps, StepContext, Stepping};
use metachron_core::{Anchor, Body, Resolution, RigidState, SimSpan, Snapshot, SoftState, StepError, StepReport};
use metachron_geometry::Solid;
use metachron_models::soft::Side;
use metachron_world::Command;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Custom, Object, Rigid, Scene, Soft, Tube, World, WorldError};

const RATES_HZ: [f64; 3] = [60.0, 240.0, 1000.0];
const CENTRE: Anchor = Anchor::Local(DVec3::ZERO);

/// A world without gravity that holds one body of 0.5 kg.
fn lone(rigid: Rigid) -> (World, Object) {
    let scene = Scene::builder().gravity([0.0; 3]).add("body", rigid.mass_kg(0.5)).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let body = world.object("body").unwrap();
    (world, body)
}

fn state(world: &World, object: Object) -> RigidState {
    let Body::Rigid(state) = world.latest(object).unwrap().body else { panic!("a rigid body") };
    state
}

#[test]
fn a_force_and_a_torque_give_what_they_were_sent_for() {
    for rate_hz in RATES_HZ {
        let (world, body) = lone(Rigid::ball(0.1).rate_hz(rate_hz));
        world.command(body, Command::force(CENTRE, DVec3::X * 2.0).for_ms(55)).unwrap();
        world.command(body, Command::torque(CENTRE, DVec3::Z * 0.01).key(1).for_ms(100)).unwrap();
        world.advance(SimSpan::from_millis(500));
        let state = state(&world, body);
        // v = F t / m, and w = T t / I with I = 2/5 m r²
        assert!((state.velocity - DVec3::X * 0.22).length() < 1e-9, "{rate_hz} Hz: {}", state.velocity);
        assert!((state.spin - DVec3::Z * 0.5).length() < 1e-9, "{rate_hz} Hz: {}", state.spin);
    }
}

#[test]
fn an_impulse_beside_the_centre_pushes_and_turns_once() {
    for rate_hz in RATES_HZ {
        let (world, body) = lone(Rigid::cuboid([0.1; 3]).rate_hz(rate_hz));
        let at = DVec3::new(0.0, 0.1, 0.0);
        world.command(body, Command::impulse(Anchor::Local(at), DVec3::X * 0.05)).unwrap();
        world.command(body, Command::impulse(Anchor::Local(at), DVec3::X * 0.05)).unwrap();
        world.advance(SimSpan::from_millis(100));
        let state = state(&world, body);
        // J / m, and r × J / I with I = m a²/6 of a cube of edge a
        assert!((state.velocity - DVec3::X * 0.2).length() < 1e-9, "{rate_hz} Hz: {}", state.velocity);
        let spin = at.cross(DVec3::X * 0.1) / (0.5 * 0.2 * 0.2 / 6.0);
        assert!((state.spin - spin).length() < 1e-6, "{rate_hz} Hz: {} instead of {spin}", state.spin);
    }
}

#[test]
fn a_box_is_pushed_along_the_floor_against_its_friction() {
    // as rough as the floor is by default, so that every rule for pairs gives the same
    let crate_ = Rigid::cuboid([0.1; 3]).mass_kg(2.0).at([0.0, 0.0, 0.1]).friction(0.5).rate_hz(240.0);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("crate", crate_).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let body = world.object("crate").unwrap();
    world.advance(SimSpan::from_millis(500));
    world.command(body, Command::force(CENTRE, DVec3::X * 30.0).for_ms(400)).unwrap();
    let speeds = [450, 200].map(|span_ms| {
        world.advance(SimSpan::from_millis(span_ms));
        state(&world, body).velocity.x
    });
    let rub_m_s2 = 0.5 * 9.81;
    let expected = (15.0 - rub_m_s2) * 0.4 - rub_m_s2 * 0.05;
    // the agent takes the command at its next step
    assert!((speeds[0] - expected).abs() < 15.0 / 240.0, "{} instead of {expected} m/s", speeds[0]);
    assert!((speeds[0] - speeds[1] - rub_m_s2 * 0.2).abs() < 0.01 * rub_m_s2, "{speeds:?}");
}

#[test]
fn a_force_on_a_tube_gives_it_momentum() {
    for rate_hz in [60.0, 240.0] {
        let gut = Tube::along(&[[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]]).segments(20).density_kg_m3(1000.0).rate_hz(rate_hz);
        let scene = Scene::builder().gravity([0.0; 3]).add("gut", gut).build().unwrap();
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        let gut = world.object("gut").unwrap();
        world.command(gut, Command::force(Anchor::Arc(0.37), DVec3::Z * 0.2).for_ms(300)).unwrap();
        world.advance(SimSpan::from_millis(600));
        let Body::Curve(curve) = &world.latest(gut).unwrap().body else { panic!("a tube") };
        // nodes of equal lengths but the two at the ends, and linear elements: the momentum is that of the trapezium
        let mass_kg = 1000.0 * std::f64::consts::PI * 0.01 * 0.01 * 0.6;
        let last = curve.velocities.len() - 1;
        let weight = |k: usize| if k == 0 || k == last { 0.5 } else { 1.0 };
        let mean_z = (0..=last).map(|k| weight(k) * curve.velocities[k].z).sum::<f64>() / last as f64;
        assert!((mean_z - 0.06 / mass_kg).abs() < 1e-6, "{rate_hz} Hz: {mean_z} m/s");
    }
}

#[test]
fn a_spring_holds_a_ball_where_its_weight_stretches_it_and_lets_go_when_its_time_is_over() {
    let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 1.0]);
    let scene = Scene::builder().add("ball", ball).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let ball = world.object("ball").unwrap();
    world.command(ball, Command::spring(CENTRE, DVec3::Z, 50.0, 6.0).for_ms(3000)).unwrap();
    world.advance(SimSpan::from_millis(3000));
    let held = state(&world, ball);
    assert!((held.position.z - (1.0 - 0.2 * 9.81 / 50.0)).abs() < 1e-5, "{}", held.position.z);
    world.advance(SimSpan::from_millis(200));
    let fallen = state(&world, ball);
    assert!((fallen.velocity.z + 9.81 * 0.2).abs() < 0.1, "{}", fallen.velocity.z);
}

#[test]
fn what_is_moved_goes_on_from_there() {
    let ball = Rigid::ball(0.05).at([0.0, 0.0, 0.05]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let ball = world.object("ball").unwrap();
    world.advance(SimSpan::from_millis(2000));
    assert!(world.latest(ball).unwrap().at_rest);
    world.command(ball, Command::teleport(DVec3::new(1.0, 2.0, 10.0), DQuat::from_rotation_x(1.0))).unwrap();
    world.command(ball, Command::velocity(DVec3::X, DVec3::Z)).unwrap();
    let before = world.time();
    world.advance(SimSpan::from_millis(500));
    let (now, t) = (state(&world, ball), world.latest(ball).unwrap().moment().secs_after(before));
    let expected = DVec3::new(1.0 + t, 2.0, 10.0 - 0.5 * 9.81 * t * t);
    // a step may begin before the command comes in
    assert!((now.position - expected).length() < 0.06, "{} instead of {expected}", now.position);
    assert!((now.spin - DVec3::Z).length() < 1e-9);
}

#[test]
fn a_tube_is_moved_as_a_whole_and_one_that_is_held_is_not() {
    let along = Tube::along(&[[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]]).segments(8);
    let scene = Scene::builder().gravity([0.0; 3]).add("free", along.clone());
    let held = Tube::along(&[[-0.1, 1.0, 0.0], [0.1, 1.0, 0.0]]).segments(8).clamp([true, false]);
    let scene = scene.add("held", held).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let [free, held] = world.objects(["free", "held"]).unwrap();
    let at_start = world.latest(held).unwrap();
    let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    world.command(free, Command::teleport(DVec3::Z * 3.0, turn)).unwrap();
    let refused = world.command(held, Command::teleport(DVec3::Z * 3.0, turn));
    assert!(matches!(refused, Err(WorldError::NotTaken(_))), "{refused:?}");
    world.advance(SimSpan::from_millis(100));
    let frame = world.frame();
    assert!((frame.point(free, Anchor::Arc(0.2)).unwrap() - DVec3::new(0.0, 0.1, 3.0)).length() < 1e-9);
    let [now, before] = [frame.state(held).unwrap(), &*at_start].map(|state| state.body.probe(1.0).unwrap().0);
    assert!(now.distance(before) < 1e-9);
    // no strain came of it
    assert!(frame.state(free).unwrap().energy_j.abs() < 1e-9);
}

#[test]
fn a_motor_turns_its_hinge_as_long_as_it_was_sent_for() {
    let wheel = Rigid::cuboid([0.2, 0.2, 0.02]).mass_kg(1.0);
    let hinge = JointKind::Revolute { axis: DVec3::Z, range_rad: None, motor: None };
    let scene = Scene::builder().gravity([0.0; 3]).add("wheel", wheel).joint("wheel", None, hinge, [0.0; 3]);
    let scene = scene.build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let wheel = world.object("wheel").unwrap();
    // b is the world: it turns backwards, so the wheel forwards
    let motor = Motor { goal: MotorGoal::Velocity(-3.0), max_effort: 0.1 };
    world.command(wheel, Command::motor(0, motor).for_ms(200)).unwrap();
    world.advance(SimSpan::from_millis(200));
    // I = m (a² + a²)/12 with edges of 0.4 m
    let inertia = 0.32 / 12.0;
    let spin = state(&world, wheel).spin.z;
    assert!((spin - 0.1 * 0.2 / inertia).abs() < 0.02, "as its bound allows: {spin}");
    world.advance(SimSpan::from_millis(500));
    assert!((state(&world, wheel).spin.z - spin).abs() < 0.02, "it turns on without the motor");
    world.command(wheel, Command::motor(0, motor)).unwrap();
    world.advance(SimSpan::from_millis(2000));
    assert!((state(&world, wheel).spin.z - 3.0).abs() < 1e-6);
}

#[test]
fn a_motor_for_a_joint_that_an_object_does_not_drive_names_the_joints() {
    let hinge = JointKind::Revolute { axis: DVec3::Z, range_rad: None, motor: None };
    let scene = Scene::builder()
        .add("upper", Rigid::ball(0.1).at([0.0, 0.0, 1.0]))
        .add("lower", Rigid::ball(0.1).at([0.0, 0.0, 0.5]))
        .joint("upper", None, hinge, [0.0, 0.0, 1.2])
        .joint_name("shoulder")
        .joint("lower", Some("upper"), hinge, [0.0, 0.0, 0.75])
        .joint_name("elbow")
        .build()
        .unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let upper = world.object("upper").unwrap();
    let motor = Motor { goal: MotorGoal::Velocity(1.0), max_effort: 1.0 };
    let elbow = world.joint("elbow").unwrap().number();
    let error = world.command(upper, Command::motor(elbow, motor)).unwrap_err();
    let said = error.to_string();
    assert!(matches!(error, WorldError::NoMotor { .. }), "{said}");
    assert!(said.contains("\"upper\" has no motor on joint \"elbow\""), "{said}");
    assert!(said.ends_with("\"upper\" drives: \"shoulder\""), "{said}");
    assert!(world.command(upper, Command::motor(7, motor)).unwrap_err().to_string().contains("joint 7:"));
}

/// An agent of a model that takes nothing.
#[derive(Clone)]
struct Idle;

impl Agent for Idle {
    fn model(&self) -> &'static str {
        "idle"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
    }
}

impl OwnSteps for Idle {
    fn step(&mut self, _dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }
}

/// An object, and the inputs that its documentation lists.
struct Taker {
    name: &'static str,
    model: &'static str,
    point: Anchor,
    takes: &'static [&'static str],
}

const TAKERS: [Taker; 6] = [
    Taker {
        name: "ball",
        model: "rigid",
        point: CENTRE,
        takes: &["springs", "forces", "torques", "other places", "other velocities", "other states"],
    },
    Taker { name: "lift", model: "rigid", point: CENTRE, takes: &["poses", "other places"] },
    Taker {
        name: "hose",
        model: "tube",
        point: Anchor::Arc(0.1),
        takes: &[
            "springs",
            "forces",
            "torques",
            "other places",
            "other velocities",
            "other states",
            "pressures",
            "other resolutions",
        ],
    },
    Taker {
        name: "held",
        model: "tube",
        point: Anchor::Arc(0.1),
        takes: &["springs", "forces", "torques", "other velocities", "other states", "pressures", "other resolutions"],
    },
    Taker {
        name: "block",
        model: "solid",
        point: Anchor::Vertex(0),
        takes: &["springs", "forces", "other places", "other velocities", "other states", "carving"],
    },
    Taker { name: "idle", model: "idle", point: CENTRE, takes: &[] },
];

/// A world of [`TAKERS`].
fn takers(executor: ExecutorKind) -> World {
    let tube = |y: f64| Tube::along(&[[-0.2, y, 1.0], [0.2, y, 1.0]]).radius_m(0.01).segments(4);
    let scene = Scene::builder()
        .gravity([0.0; 3])
        .add("ball", Rigid::ball(0.05))
        .add("lift", Rigid::cuboid([0.1; 3]).kinematic().at([1.0, 0.0, 0.0]))
        .add("hose", tube(0.0))
        .add("held", tube(0.5).clamp([true, false]))
        .add("block", Soft::cuboid([0.1; 3], [2; 3]).young_pa(1e4).at([2.0, 0.0, 0.0]))
        .add("idle", Custom::new(Idle))
        .build()
        .unwrap();
    World::start(&scene, executor).unwrap()
}

#[test]
fn a_command_that_its_object_does_not_take_names_it_its_model_and_what_it_takes() {
    let world = takers(ExecutorKind::Lockstep);
    for Taker { name, model, point, takes } in TAKERS {
        let object = world.object(name).unwrap();
        let finer = Resolution { eps_m: 0.05, n: 1 };
        let commands = [
            ("springs", Command::spring(point, DVec3::Z, 1.0, 0.1)),
            ("springs", Command::spring(point, DVec3::Z, 1.0, 0.1).taken_back()),
            ("forces", Command::force(point, DVec3::X)),
            ("forces", Command::impulse(point, DVec3::X * 1e-3)),
            ("torques", Command::torque(point, DVec3::X * 1e-3)),
            ("poses", Command::pose(DVec3::X, DQuat::IDENTITY)),
            ("other places", Command::teleport(DVec3::X * 3.0, DQuat::IDENTITY)),
            ("other velocities", Command::velocity(DVec3::X, DVec3::ZERO)),
            ("pressures", Command::pressure(10.0)),
            ("carving", Command::carve(DVec3::X * 9.0, DVec3::X * 9.0, 0.01)),
            ("other resolutions", Command::resolution(finer)),
        ];
        for (needs, command) in commands {
            let sent = world.command(object, command);
            if takes.contains(&needs) {
                assert!(sent.is_ok(), "{name}, {needs}: {sent:?}");
                continue;
            }
            let error = sent.expect_err(needs);
            let said = error.to_string();
            assert!(matches!(error, WorldError::NotTaken(_)), "{said}");
            let lacks = if takes.contains(&"forces") || needs != "torques" { needs } else { "forces" };
            let begins = format!("\"{name}\" (model \"{model}\") takes no {lacks}; it takes ");
            assert!(said.starts_with(&begins) && takes.iter().all(|word| said.contains(word)), "{said}");
        }
        // commands that all take
        world.command(object, Command::step(SimSpan::from_millis(2))).unwrap();
        world.command(object, Command::wake()).unwrap();
        let state = world.latest(object).unwrap().body.clone();
        let set = world.set_state(object, &state);
        assert_eq!(set.is_ok(), takes.contains(&"other states"), "{name}: {set:?}");
        assert!(set.is_ok() || matches!(set, Err(WorldError::NotTaken(_))));
    }
    world.advance(SimSpan::from_millis(20));
    assert!(world.agents().iter().all(|agent| agent.steps() > 0));
}

#[test]
fn a_world_that_was_stopped_takes_no_commands() {
    for executor in [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool] {
        let world = takers(executor);
        world.advance(SimSpan::from_millis(20));
        let ball = world.object("ball").unwrap();
        let state = world.latest(ball).unwrap().body.clone();
        world.command(ball, Command::force(CENTRE, DVec3::X)).unwrap();
        world.stop();
        let hash = world.hash();
        for sent in [
            world.command(ball, Command::force(CENTRE, DVec3::X)),
            world.command(ball, Command::wake()),
            world.set_state(ball, &state),
        ] {
            assert!(matches!(sent, Err(WorldError::Stopped)), "{executor:?}: {sent:?}");
        }
        let sent = world.agents()[0].send(Command::wake()).unwrap_err();
        assert_eq!(sent.to_string(), "the run of \"ball\" has ended: it takes no command any more");
        assert_eq!(world.hash(), hash, "{executor:?}");
    }
}

#[test]
fn commands_that_cannot_be_say_why_and_do_nothing() {
    let (world, body) = lone(Rigid::ball(0.1));
    let (_, foreign) = lone(Rigid::ball(0.1));
    let push = Command::force(CENTRE, DVec3::X);
    let message = |object: Object, command: Command| world.command(object, command).unwrap_err().to_string();
    assert!(message(foreign, push).contains("another world"));
    assert!(message(body, Command::force(CENTRE, DVec3::NAN)).contains("finite"));
    assert!(message(body, push.key(8)).contains("keys are 0 to 7"));
    assert!(message(body, Command::force(Anchor::Arc(0.1), DVec3::X)).contains("Local"));
    assert!(message(body, Command::spring(CENTRE, DVec3::ZERO, -1.0, 0.0)).contains("from 0e0 to 1e12 N/m"));
    assert!(message(body, Command::impulse(CENTRE, DVec3::X * 1e154)).contains("the impulse is 1e154 N·s"));
    assert!(message(body, Command::teleport(DVec3::INFINITY, DQuat::IDENTITY)).contains("finite"));
    world.advance(SimSpan::from_millis(100));
    assert_eq!(state(&world, body).velocity, DVec3::ZERO);
}

#[test]
fn a_body_a_tube_and_a_rope_go_back_to_the_states_that_they_had() {
    let tube = Tube::along(&[[-0.2, 1.0, 0.5], [0.2, 1.0, 0.5]]).segments(8).clamp([true, false]);
    let rope = Soft::rope(&[[0.0, 2.0, 0.5], [0.4, 2.0, 0.5]], 0.005, 8).hold(&[Side::Left]);
    let brick = Rigid::new(Solid::Box { half_extents_m: DVec3::new(0.1, 0.2, 0.3) }).velocity_m_s([1.0, 0.0, 3.0]);
    let scene = Scene::builder().add("brick", brick).add("tube", tube).add("rope", rope).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(200));
    let objects = world.objects(["brick", "tube", "rope"]).unwrap();
    let states = objects.map(|object| world.latest(object).unwrap().body.clone());
    let point = [CENTRE, Anchor::Arc(0.3), Anchor::Vertex(6)];
    let places = |world: &World| {
        let at = |(object, anchor): (&Object, Anchor)| world.latest(*object).unwrap().body.point(anchor).unwrap();
        objects.iter().zip(point).map(at).collect::<Vec<_>>()
    };
    let before = places(&world);
    world.advance(SimSpan::from_millis(500));
    for (object, state) in objects.iter().zip(&states) {
        world.set_state(*object, state).unwrap();
    }
    world.advance(SimSpan::from_millis(5));
    for ((place, velocity), (then, then_m_s)) in places(&world).into_iter().zip(before) {
        // up to two steps of 1/240 s on from there
        assert!((place - then).length() < 0.02 * (0.1 + then_m_s.length()), "{place} instead of {then}");
        assert!((velocity - then_m_s).length() < 0.2 + 0.2 * then_m_s.length(), "{velocity} instead of {then_m_s}");
    }
    let refused = |object, state: &Body| world.set_state(object, state).unwrap_err().to_string();
    assert!(refused(objects[0], &states[1]).contains("that of a tube; expected that of a rigid body"));
    let Body::Soft(mut short) = states[2].clone() else { panic!("a rope") };
    short.velocities.pop();
    assert!(refused(objects[2], &Body::Soft(short)).contains("8 velocities; expected 9 positions, 9 velocities"));
    let endless = RigidState { position: DVec3::NAN, ..RigidState::default() };
    assert!(refused(objects[0], &Body::Rigid(endless)).contains("finite"));
}

#[test]
fn what_a_cage_or_a_lattice_carries_goes_back_to_its_nodes_and_does_the_same_again() {
    let ball = Soft::ball(0.05, 4).eps_m((0.05, 0.1)).young_pa(2e4).at([0.0, 0.0, 9.0]).rate_hz(250.0);
    let sheet =
        Soft::sheet([0.2, 0.1], 0.002, [8, 4]).eps_m((0.05, 0.1)).young_pa(1e6).hold(&[Side::Left]).rate_hz(250.0);
    let scene = Scene::builder().add("ball", ball).add("sheet", sheet).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let objects = world.objects(["ball", "sheet"]).unwrap();
    // it wobbles while it falls
    world.command(objects[0], Command::impulse(Anchor::Vertex(0), DVec3::new(0.05, 0.02, 0.1))).unwrap();
    world.advance(SimSpan::from_millis(100));
    let soft = |object: Object| match &world.latest(object).unwrap().body {
        Body::Soft(soft) => soft.clone(),
        other => panic!("soft, and not {other:?}"),
    };
    let states = objects.map(|object| world.latest(object).unwrap());
    world.advance(SimSpan::from_millis(192));
    // a state is taken up with the next turn, which may be a step later
    let first = [(); 3].map(|()| {
        world.advance(SimSpan::from_millis(4));
        objects.map(soft)
    });
    let again = || {
        objects.iter().zip(&states).for_each(|(object, state)| world.set_state(*object, &state.body).unwrap());
        world.advance(SimSpan::from_millis(200));
        objects.map(soft)
    };
    let [second, third] = [again(), again()];
    for (at, (second, third)) in second.iter().zip(&third).enumerate() {
        let far = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        let nearest = first.iter().map(|was| far(&was[at].positions, &second.positions)).fold(f64::INFINITY, f64::min);
        // rounding, which grows as it wobbles
        assert!(nearest < 1e-9, "{nearest} m from what it did before");
        assert!(second.nodes.is_some(), "it is carried");
        assert_eq!((&second.positions, &second.velocities), (&third.positions, &third.velocities));
    }
    let Body::Soft(mut other) = states[0].body.clone() else { panic!("soft") };
    let nodes = other.nodes.as_mut().unwrap();
    let count = nodes.positions.len();
    nodes.positions.pop();
    let refused = |state: SoftState| world.set_state(objects[0], &Body::Soft(state)).unwrap_err().to_string();
    assert!(refused(other.clone()).contains(&format!("expected {count} positions of nodes")));
    assert!(refused(SoftState { nodes: None, ..other }).contains("the state has 0 positions of nodes"));
}
