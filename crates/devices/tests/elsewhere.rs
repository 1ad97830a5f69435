//! A hand far from the world that it acts in: commands and states take their time, and some are lost. In lockstep, each tick of a millisecond of
//! virtual time.

use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Body, SimSpan, SimTime, Snapshot, Wrench};
use metachron_devices::{
    Device, DeviceError, DeviceLoop, DeviceState, Hand, HandPath, Limits, Link, LoopOptions, SimulatedDevice,
};
use metachron_runtime::TimelineCommand;
use metachron_world::{
    Checkpoint, CheckpointError, Command, EventFilter, EventReader, GhostWorld, Object, Part, Rigid, Scene, SceneMark,
    StateLink, Touched, World, WorldCalls, WorldError, kinds::ExecutorKind,
};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A message of states comes so often, milliseconds.
const PERIOD_MS: u64 = 16;

/// Two sums of the same energies in another order.
const ROUNDED: f64 = 1.0 + 1e-9;

/// A world at the end of a link.
struct Distant {
    world: World,
    delay_ms: u64,
    loss: f64,
    line: Mutex<Line>,
}

/// Messages that are on their way, and those that have come, at a time in milliseconds.
#[derive(Default)]
struct Line {
    now_ms: u64,
    random: u64,
    commands: VecDeque<(u64, Object, Command)>,
    frames: VecDeque<(u64, Frame)>,
    shown: Frame,
    came_ms: u64,
    /// Nothing arrives any more.
    is_cut: bool,
}

/// All states at a time.
#[derive(Default)]
struct Frame {
    time: SimTime,
    states: BTreeMap<AgentId, Arc<Snapshot>>,
}

impl Line {
    /// Whether a message is lost: a share of them, by splitmix64.
    fn loses(&mut self, share: f64) -> bool {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.random ^ (self.random >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        self.is_cut || ((mixed ^ (mixed >> 31)) as f64) < share * u64::MAX as f64
    }
}

impl Distant {
    fn new(world: World, delay_ms: u64, loss: f64) -> Self {
        let distant = Self { world, delay_ms, loss, line: Mutex::default() };
        distant.line.lock().unwrap().shown = distant.frame();
        distant
    }

    fn frame(&self) -> Frame {
        let states = self.world.all_objects().map(|object| (object.id(), self.world.latest(object).unwrap()));
        Frame { time: self.world.time(), states: states.collect() }
    }

    /// A millisecond passes, there and on the way.
    fn tick(&self) {
        let mut line = self.line.lock().unwrap();
        line.now_ms += 1;
        let now_ms = line.now_ms;
        while line.commands.front().is_some_and(|(due_ms, ..)| *due_ms <= now_ms) {
            let (_, object, command) = line.commands.pop_front().unwrap();
            self.world.command(object, command).unwrap();
        }
        self.world.advance(SimSpan::from_millis(1));
        if now_ms.is_multiple_of(PERIOD_MS) && !line.loses(self.loss) {
            line.frames.push_back((now_ms + self.delay_ms, self.frame()));
        }
        while line.frames.front().is_some_and(|(due_ms, _)| *due_ms <= now_ms) {
            line.shown = line.frames.pop_front().unwrap().1;
            line.came_ms = now_ms;
        }
    }
}

impl WorldCalls for Distant {
    fn scene(&self) -> SceneMark {
        WorldCalls::scene(&self.world)
    }
    fn all_objects(&self) -> Vec<Object> {
        WorldCalls::all_objects(&self.world)
    }
    fn object(&self, name: &str) -> Result<Object, WorldError> {
        self.world.object(name)
    }
    fn object_of(&self, id: AgentId) -> Result<Object, WorldError> {
        self.world.object_of(id)
    }
    fn name(&self, of: Touched) -> Result<Arc<str>, WorldError> {
        WorldCalls::name(&self.world, of)
    }
    fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError> {
        Ok(Arc::clone(&self.line.lock().unwrap().shown.states[&object.id()]))
    }
    fn part(&self, object: Object) -> Result<Option<Part>, WorldError> {
        WorldCalls::part(&self.world, object)
    }
    fn time(&self) -> SimTime {
        self.line.lock().unwrap().shown.time
    }
    fn hash(&self) -> Result<u64, WorldError> {
        WorldCalls::hash(&self.world)
    }
    fn drive(&self, drive: TimelineCommand) -> Result<(), WorldError> {
        WorldCalls::drive(&self.world, drive)
    }
    fn advance(&self, span: SimSpan) -> Result<(), WorldError> {
        WorldCalls::advance(&self.world, span)
    }
    fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        let mut line = self.line.lock().unwrap();
        if !line.loses(self.loss) {
            let due_ms = line.now_ms + self.delay_ms;
            line.commands.push_back((due_ms, object, command));
        }
        Ok(())
    }
    fn link(&self) -> Option<StateLink> {
        let line = self.line.lock().unwrap();
        let age = Duration::from_millis(line.now_ms - line.came_ms);
        let round_trip = Duration::from_millis(2 * self.delay_ms);
        Some(StateLink { age, period: Duration::from_millis(PERIOD_MS), round_trip })
    }
    fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError> {
        self.world.set_state(object, state)
    }
    fn add(&self, name: &str, part: Part) -> Result<Object, WorldError> {
        self.world.add(name, part)
    }
    fn remove(&self, object: Object) -> Result<(), WorldError> {
        self.world.remove(object)
    }
    fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        self.world.checkpoint()
    }
    fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.world.restore(checkpoint)
    }
    fn answers(&self) -> Result<(), WorldError> {
        Ok(())
    }
    fn listen(&self, filter: EventFilter) -> Box<dyn EventReader> {
        WorldCalls::listen(&self.world, filter)
    }
}

/// A device whose forces are kept.
struct Kept {
    device: SimulatedDevice,
    forces_n: Arc<Mutex<Vec<DVec3>>>,
}

impl Device for Kept {
    fn name(&self) -> &str {
        self.device.name()
    }

    fn read(&mut self, elapsed_s: f64) -> Result<DeviceState, DeviceError> {
        self.device.read(elapsed_s)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.forces_n.lock().unwrap().push(wrench.force_n);
        self.device.write(wrench)
    }

    fn limits(&self) -> Limits {
        self.device.limits()
    }
}

/// A hand of 1 kHz that holds a plate with a load on it, in a world at the end of a link; and the forces that it was given, N.
struct Held {
    distant: Arc<Distant>,
    ghosts: GhostWorld,
    device_loop: DeviceLoop,
    forces_n: Arc<Mutex<Vec<DVec3>>>,
}

impl Held {
    fn at(load_kg: f64, delay_ms: u64, loss: f64) -> Self {
        let at_m = DVec3::Z * 0.1;
        let plate = Rigid::cuboid([0.1, 0.1, 0.01]).kinematic().at(at_m.into()).rate_hz(500.0);
        let load = Rigid::cuboid([0.02; 3]).mass_kg(load_kg).at((at_m + DVec3::Z * 0.03).into()).rate_hz(500.0);
        let scene = Scene::builder().add("plate", plate).add("load", load).build().unwrap();
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        let distant = Arc::new(Distant::new(world, delay_ms, loss));
        let ghosts = GhostWorld::of(&scene).unwrap();
        let forces_n = Arc::<Mutex<Vec<DVec3>>>::default();
        let path = HandPath::still(at_m, DQuat::IDENTITY);
        let device = SimulatedDevice::new(Hand::default(), path, Link::default(), 10.0);
        let device = Box::new(Kept { device, forces_n: Arc::clone(&forces_n) });
        let device_loop = DeviceLoop::new(ghosts.world(), "plate", device, LoopOptions::default()).unwrap();
        let device_loop = device_loop.elsewhere(Arc::clone(&distant) as Arc<dyn WorldCalls>).unwrap();
        Self { distant, ghosts, device_loop, forces_n }
    }

    fn play(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.device_loop.tick(Duration::from_millis(1), Duration::ZERO);
            self.distant.tick();
            self.ghosts.follow(&*self.distant).unwrap();
        }
    }
}

#[test]
fn a_remote_hand_feels_the_weight_that_it_holds_and_is_given_no_more_than_its_tank() {
    // the handle has 0.1 kg
    for load_kg in [0.02, 0.05, 0.1, 0.2] {
        for (delay_ms, loss) in [(0, 0.0), (20, 0.0), (20, 0.02)] {
            let mut held = Held::at(load_kg, delay_ms, loss);
            held.play(10_000);
            let forces_n = held.forces_n.lock().unwrap();
            let last = &forces_n[4_000..];
            let mean_n = last.iter().sum::<DVec3>() / last.len() as f64;
            let (report, weight_n) = (held.device_loop.report(), load_kg * 9.81);
            let case = format!("{load_kg} kg, {delay_ms} ms, loss {loss}: {mean_n} N of {weight_n} N, {report:?}");
            println!("{case}");
            assert!(report.energy_out_j <= report.tank_j * ROUNDED && report.failures == 0, "{case}");
            // what weighs as much as the handle answers late with as much as moves it: that hums within its tank
            assert!(load_kg > 0.05 || (-mean_n.z / weight_n - 1.0).abs() < 0.02, "{case}");
        }
    }
}

#[test]
fn a_hand_whose_world_has_gone_silent_is_let_go() {
    let mut held = Held::at(0.05, 20, 0.0);
    held.play(2_000);
    held.distant.line.lock().unwrap().is_cut = true;
    held.play(300);
    let forces_n = held.forces_n.lock().unwrap();
    // 20 ms of states on their way, two periods in which the force is whole, 100 ms in which it fades
    assert!(forces_n[1_999].length() > 0.1 && forces_n[2_180..].iter().all(|force| *force == DVec3::ZERO));
}
