//! A device beside a world in lockstep: each tick of a millisecond of virtual time, no thread, no sleep.

use glam::{DQuat, DVec3};
use metachron_core::{SimSpan, Wrench};
use metachron_devices::{
    ContactModel, Device, DeviceError, DeviceLoop, DeviceReport, DeviceState, Hand, HandPath, Limits, Link,
    LoopOptions, SimulatedDevice,
};
use metachron_models::soft::Side;
use metachron_models::tool::Keyframe;
use metachron_world::{Rigid, Scene, Soft, World, kinds::ExecutorKind};
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

#[test]
fn between_two_states_the_force_follows_the_pose_by_the_stiffness_of_the_contact() {
    for (tissue_hz, plate_hz) in [(60.0, 60.0), (500.0, 1000.0)] {
        between(tissue_hz, plate_hz);
    }
}

fn between(tissue_hz: f64, plate_hz: f64) {
    let world = world(tissue_hz, plate_hz);
    let hand = Hand { stiffness_n_m: 3000.0, damping_n_s_m: 30.0, ..Hand::default() };
    let _ = serve(
        &world,
        Box::new(SimulatedDevice::new(hand, press(0.005), Link::default(), 20.0)),
        LoopOptions::default(),
        1500,
    );
    let plate = world.object("plate").unwrap();
    let mut model = ContactModel::default();
    assert!(model.refresh(&world, plate).unwrap());
    assert!(!model.refresh(&world, plate).unwrap(), "no other state");
    let at = |z| model.wrench(DVec3::Z * z, DQuat::IDENTITY).force_n.z;
    let metachron_core::Body::Rigid(body) = &world.latest(plate).unwrap().body else { panic!("a plate") };
    let (z, off_m) = (body.position.z, 1e-4);
    let slope_n_m = (at(z - off_m) - at(z)) / off_m;
    // within a step of the block half of its mass and its damping resist as well; but each of the four corners counts as if it were pressed
    // alone, which takes what the others bear for free
    let (h_s, half_kg) = (tissue_hz.recip(), 0.05);
    let wanted_n_m = STIFFNESS_N_M + (2.0 * half_kg + 0.002 * STIFFNESS_N_M) / h_s + half_kg / (h_s * h_s);
    assert!(slope_n_m > 0.5 * wanted_n_m && slope_n_m < 1.1 * wanted_n_m, "{slope_n_m} N/m of {wanted_n_m} N/m");
    assert_eq!(at(z + 0.02), 0.0, "a contact never pulls");
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
