//! A device beside a world in lockstep: each tick of a millisecond of virtual time, no thread, no sleep.

use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body, SimSpan, Wrench};
use metachron_devices::{
    ContactModel, Device, DeviceError, DeviceLoop, DeviceReport, DeviceState, Hand, HandPath, Limits, Link,
    LoopOptions, SimulatedDevice,
};
use metachron_geometry::{ContactTraits, Solid};
use metachron_models::soft::Side;
use metachron_models::tool::{Keyframe, Tool, ToolSpec};
use metachron_world::{Command, Custom, Rigid, Scene, SceneBuilder, Soft, World, kinds::ExecutorKind};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A block without lateral strain on the ground: a plate that covers it meets a spring of E A / L.
const SIDE_M: f64 = 0.1;
const YOUNG_PA: f64 = 1e4;
const STIFFNESS_N_M: f64 = YOUNG_PA * SIDE_M;
/// Two sums of the same energies in another order.
const ROUNDED: f64 = 1.0 + 1e-9;

fn world(tissue_hz: f64, plate_hz: f64) -> World {
    let tissue = Soft::cuboid([SIDE_M; 3], [1, 1, 1]).at([0.0, 0.0, 0.5 * SIDE_M]).young_pa(YOUNG_PA).poisson(0.0);
    let tissue = tissue.damping(2.0, 0.002).hold(&[Side::Bottom]).rate_hz(tissue_hz).density_kg_m3(100.0);
    let plate = Rigid::cuboid([0.2, 0.2, 0.01]).kinematic().at([0.0, 0.0, SIDE_M + 0.02]).rate_hz(plate_hz);
    let scene = Scene::builder().gravity([0.0; 3]).add("tissue", tissue).add("plate", plate).build().unwrap();
    World::start(&scene, ExecutorKind::Lockstep).unwrap()
}

/// Down to a depth within half a second, and still there.
fn press(depth_m: f64) -> HandPath {
    let key = |at_s, z| Keyframe { at_s, tip_m: DVec3::Z * z, rotation: DQuat::IDENTITY, jaw: 1.0 };
    HandPath::along(&[key(0.0, SIDE_M + 0.02), key(0.5, SIDE_M + 0.01 - depth_m)], false).unwrap()
}

/// Up and down, `times` a second, into the block.
fn pump(times: f64) -> HandPath {
    let key = |share: f64| Keyframe {
        at_s: share / times,
        tip_m: DVec3::Z * (SIDE_M + 0.008 + 0.01 * (std::f64::consts::TAU * share).cos()),
        rotation: DQuat::IDENTITY,
        jaw: 1.0,
    };
    HandPath::along(&(0..=32).map(|at| key(f64::from(at) / 32.0)).collect::<Vec<_>>(), true).unwrap()
}

fn serve(world: &World, device: Box<dyn Device>, options: LoopOptions, ticks: u32) -> DeviceReport {
    let mut device_loop = DeviceLoop::new(world, "plate", device, options).unwrap();
    for _ in 0..ticks {
        device_loop.tick(Duration::from_millis(1), Duration::ZERO);
        world.advance(SimSpan::from_millis(1));
    }
    device_loop.report()
}

/// A device that can be looked at while a loop has it.
#[derive(Clone)]
struct Watched(Arc<Mutex<SimulatedDevice>>);

impl Device for Watched {
    fn name(&self) -> &str {
        "watched"
    }

    fn read(&mut self, elapsed_s: f64) -> Result<DeviceState, DeviceError> {
        self.0.lock().unwrap().read(elapsed_s)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.0.lock().unwrap().write(wrench)
    }

    fn limits(&self) -> Limits {
        self.0.lock().unwrap().limits()
    }
}

#[test]
fn the_force_at_rest_is_that_of_the_spring_that_is_pressed() {
    let hand = Hand { stiffness_n_m: 3000.0, damping_n_s_m: 30.0, ..Hand::default() };
    for (tissue_hz, plate_hz) in [(60.0, 60.0), (500.0, 1000.0), (500.0, 500.0), (60.0, 1000.0)] {
        let world = world(tissue_hz, plate_hz);
        let device = Watched(Arc::new(Mutex::new(SimulatedDevice::new(hand, press(0.005), Link::default(), 20.0))));
        let report = serve(&world, Box::new(device.clone()), LoopOptions::default(), 1500);
        let state = device.0.lock().unwrap().read(1e-3).unwrap();
        let depth_m = SIDE_M + 0.01 - state.position_m.z;
        // the hand's spring has as much in it as the block
        let hand_n = 3000.0 * (0.005 - depth_m);
        let block_n = STIFFNESS_N_M * depth_m;
        let case =
            format!("{tissue_hz}, {plate_hz} Hz: {hand_n:.3} N in the hand, {block_n:.3} N in the block, {report:?}");
        println!("{case}");
        assert!((hand_n - block_n).abs() < 0.03 * block_n, "{case}");
        assert!(report.age_steps.max <= 2.0 && report.stale == 0 && report.failures == 0, "{case}");
    }
}

/// One step of all in the scenes below.
const STEP: SimSpan = SimSpan::from_millis(10);

/// By how much a force grows on the way on which its object is led, N/m.
struct Stiffness {
    /// As the world's states have it.
    solved_n_m: f64,
    /// As the local model of the state before says.
    model_n_m: f64,
}

/// Leads an object down by 6 mm, where it rests, and on: the force in z grows in the step in which it is led on, or, of a tool, which gets there in
/// several, once it rests.
fn led_on(scene: &Scene, lead: &dyn Fn(f64) -> Command, on_m: f64) -> Stiffness {
    let (name, depth_m) = ("led", 0.006);
    let pressed = |on_m: f64| {
        let world = World::start(scene, ExecutorKind::Lockstep).unwrap();
        let (object, mut model) = (world.object(name).unwrap(), ContactModel::default());
        for step in 1..=100 {
            world.command(object, lead(depth_m * (f64::from(step) / 40.0).min(1.0))).unwrap();
            world.advance(STEP);
        }
        model.refresh(&world, object).unwrap();
        let before = world.latest(object).unwrap();
        world.command(object, lead(depth_m + on_m)).unwrap();
        // the step that takes the command is the next or that after it
        let force_n = |_| {
            world.advance(SimSpan::from_millis(1));
            world.latest(object).unwrap().contact_wrench.force_n.z
        };
        ((0..300).map(force_n).collect::<Vec<_>>(), model, before)
    };
    let (still, model, state) = pressed(0.0);
    let (further, ..) = pressed(on_m);
    let mut led = still.iter().zip(&further).filter(|(still_n, further_n)| still_n != further_n);
    let is_tool = matches!(state.body, Body::Tool(_));
    let (still_n, further_n) = if is_tool { led.next_back() } else { led.next() }.unwrap();
    let (place_m, rotation) = match &state.body {
        Body::Tool(tool) => (tool.led, tool.rotation),
        Body::Rigid(body) => (body.position, body.rotation),
        other => panic!("{other:?}"),
    };
    let felt_n = |by_m: f64| model.wrench(place_m - DVec3::Z * by_m, rotation).force_n.z;
    assert!(*still_n > 0.05, "{name} presses on nothing: {still_n} N");
    assert_eq!(felt_n(-0.05), 0.0, "a contact never pulls");
    Stiffness { solved_n_m: (further_n - still_n) / on_m, model_n_m: (felt_n(on_m) - felt_n(0.0)) / on_m }
}

fn jelly(cells: u32) -> Soft {
    let jelly = Soft::cuboid([SIDE_M; 3], [cells; 3]).at([0.0, 0.0, 0.5 * SIDE_M]).young_pa(YOUNG_PA).poisson(0.3);
    jelly.damping(2.0, 0.002).hold(&[Side::Bottom]).density_kg_m3(100.0)
}

/// A tool through a trocar above.
fn probe() -> Custom {
    let keyframe = Keyframe { at_s: 0.0, tip_m: DVec3::Z * (SIDE_M + 0.01), rotation: DQuat::IDENTITY, jaw: 0.0 };
    let spec = ToolSpec {
        keyframes: vec![keyframe],
        repeat: false,
        reach_m: 0.01,
        stiffness_n_m: 200.0,
        damping_n_s_m: 1.0,
        max_force_n: 10.0,
        graspable: Vec::new(),
        pivot_m: Some(DVec3::Z * (SIDE_M + 0.2)),
        starts_off_m: DVec3::ZERO,
        traits: ContactTraits::default(),
    };
    Custom::made_by(move |_| Box::new(Tool::new(spec.clone()).unwrap()))
}

/// An object `led` in a scene, and how it is led to a depth.
struct Case {
    what: &'static str,
    scene: Scene,
    lead: Box<dyn Fn(f64) -> Command>,
    /// How far it is led on, metres.
    on_m: f64,
}

impl Case {
    /// A kinematic body that begins at `from_m`.
    fn body(what: &'static str, builder: SceneBuilder, part: Rigid, from_m: f64) -> Self {
        let lead = Box::new(move |depth_m| Command::pose(DVec3::Z * (from_m - depth_m), DQuat::IDENTITY));
        Self { what, scene: builder.add("led", part).build().unwrap(), lead, on_m: 1e-6 }
    }

    fn tool(what: &'static str, builder: SceneBuilder) -> Self {
        let at = |depth_m: f64| DVec3::Z * (SIDE_M + 0.004 - depth_m);
        let lead = Box::new(move |depth_m| Command::spring(Anchor::Local(DVec3::ZERO), at(depth_m), 0.0, 0.0));
        Self { what, scene: builder.add("led", probe().rate_hz(100.0)).build().unwrap(), lead, on_m: 1e-4 }
    }
}

#[test]
fn the_local_model_has_the_stiffness_of_the_force_whatever_bears() {
    let weightless = || Scene::builder().gravity([0.0; 3]);
    let soft = |cells: u32| weightless().add("jelly", jelly(cells).rate_hz(100.0));
    let slow = weightless().add("jelly", jelly(1).rate_hz(50.0));
    let lid = || Rigid::cuboid([0.2, 0.2, 0.01]).kinematic().at([0.0, 0.0, SIDE_M + 0.02]).rate_hz(100.0);
    let ball = Rigid::ball(0.02).kinematic().at([0.0, 0.0, SIDE_M + 0.03]).rate_hz(100.0);
    let apart = |x_m: f64| jelly(1).at([x_m, 0.0, 0.5 * SIDE_M]).rate_hz(100.0);
    let two = weightless().add("left", apart(-0.1)).add("right", apart(0.1));
    let board = Rigid::cuboid([0.1, 0.1, 0.01]).at([0.0, 0.0, SIDE_M + 0.01]).mass_kg(0.1).rate_hz(100.0);
    // nothing but its stiffness resists for long
    let light = jelly(4).damping(2.0, 0.0).density_kg_m3(1.0).rate_hz(100.0);
    let plate = Rigid::cuboid([0.1, 0.1, 0.5 * SIDE_M]).at([0.0, 0.0, 0.5 * SIDE_M]).rate_hz(100.0);
    let cases = [
        Case::body("a ball on jelly", soft(4), ball, SIDE_M + 0.02),
        Case::body("four corners", soft(1), lid(), SIDE_M + 0.01),
        Case::body("four corners of slower steps", slow, lid(), SIDE_M + 0.01),
        Case::body("twenty-five places", soft(4), lid(), SIDE_M + 0.01),
        Case::body("two bodies", two, lid(), SIDE_M + 0.01),
        Case::body("a board that rests on jelly", soft(2).add("board", board), lid(), SIDE_M + 0.03),
        Case::tool("a tool on jelly", weightless().add("jelly", light)),
        Case::tool("a tool on a plate", Scene::builder().fixed("floor", Solid::Plane).add("plate", plate)),
    ];
    for Case { what, scene, lead, on_m } in cases {
        let Stiffness { solved_n_m, model_n_m } = led_on(&scene, &lead, on_m);
        assert!((model_n_m / solved_n_m - 1.0).abs() < 0.1, "{what}: {model_n_m} N/m of {solved_n_m} N/m");
    }
}

#[test]
fn a_late_link_gives_the_hand_no_more_than_the_tank_has() {
    for delay_ms in [0, 1, 2, 3, 5] {
        for (jitter_s, tank_j) in [(0.0, 0.02), (0.002, 0.02), (0.0, 0.002)] {
            let world = world(60.0, 60.0);
            let link = Link { delay_s: f64::from(delay_ms) * 1e-3, jitter_s, seed: 7 };
            let device = Watched(Arc::new(Mutex::new(SimulatedDevice::new(Hand::default(), pump(2.0), link, 20.0))));
            let report =
                serve(&world, Box::new(device.clone()), LoopOptions { tank_j, ..LoopOptions::default() }, 2000);
            let out_j = device.0.lock().unwrap().energy_out_j();
            let case = format!("{delay_ms} ms, ± {jitter_s} s, {tank_j} J: handle {out_j:.5} J, {report:?}");
            println!("{case}");
            assert!(out_j <= tank_j * ROUNDED && report.energy_out_j <= tank_j * ROUNDED, "{case}");
            assert!(report.force_max_n > 0.5 && report.age_steps.max <= 2.0, "{case}");
        }
    }
}

#[test]
fn the_same_seeds_give_the_same_bits() {
    let run = || {
        let world = world(60.0, 1000.0);
        let link = Link { delay_s: 0.002, jitter_s: 0.003, seed: 3 };
        let device = Box::new(SimulatedDevice::new(Hand::default(), pump(2.0), link, 20.0));
        (serve(&world, device, LoopOptions::default(), 500), world.hash())
    };
    assert_eq!(run(), run());
}

/// A device that works, fails, gives no numbers, and works again.
struct Faulty {
    sound: SimulatedDevice,
    reads: u32,
}

impl Device for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }

    fn read(&mut self, elapsed_s: f64) -> Result<DeviceState, DeviceError> {
        self.reads += 1;
        let state = self.sound.read(elapsed_s)?;
        match self.reads {
            101..=110 => Err(DeviceError("unplugged".to_owned())),
            111..=120 => Ok(DeviceState { position_m: DVec3::NAN, ..state }),
            _ => Ok(state),
        }
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if self.reads > 190 { Err(DeviceError("gone".to_owned())) } else { self.sound.write(wrench) }
    }

    fn limits(&self) -> Limits {
        self.sound.limits()
    }
}

#[test]
fn a_device_that_fails_is_reported_and_nothing_stops() {
    let world = world(60.0, 1000.0);
    let sound = SimulatedDevice::new(Hand::default(), pump(5.0), Link::default(), 20.0);
    let report = serve(&world, Box::new(Faulty { sound, reads: 0 }), LoopOptions::default(), 200);
    assert_eq!((report.ticks, report.failures), (200, 30));
    assert_eq!(report.first_failure.as_deref(), Some("the device gave no state: unplugged"));
    assert!(report.force_max_n.is_finite() && world.latest(world.object("plate").unwrap()).unwrap().is_finite());
    assert_eq!(world.time().as_nanos(), 200_000_000);
}

#[test]
fn what_no_device_can_lead_is_refused() {
    let world = world(60.0, 1000.0);
    let device = || Box::new(SimulatedDevice::new(Hand::default(), pump(1.0), Link::default(), 1.0));
    let refused = |name, options| DeviceLoop::new(&world, name, device(), options).unwrap_err().to_string();
    let wrong = refused("tissue", LoopOptions::default());
    assert!(wrong.contains("\"tissue\"") && wrong.contains("kinematic bodies and tools"), "{wrong}");
    assert!(refused("nothing", LoopOptions::default()).contains("plate"));
    let wrong = refused("plate", LoopOptions { tank_j: 0.0, ..LoopOptions::default() });
    assert!(wrong.contains("above 0 J"), "{wrong}");
}
