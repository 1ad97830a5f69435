//! Worlds that are saved and put back while objects join, leave and jump, and worlds that many threads call at once.
//!
//! In: an executor, the amount of work, a seed. Out: the number of calls made, calls that were refused wrongly, objects
//! that failed. Never here: how much of it is enough.

use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Anchor, SimSpan};
use metachron_geometry::Solid;
use metachron_runtime::{AgentState, TimelineCommand};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{
    Cast, Checkpoint, Command, EventFilter, Events, Object, Pace, Rigid, Scene, SensorKind, Site, World, WorldError,
};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// Bodies that a world begins with, and the most that are in it at once.
const FIRST: usize = 12;
const CROWD: usize = 18;
/// Checkpoints that are kept to go back to.
const MARKS: usize = 8;
/// How long threads that should have ended are waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// How much is to be done.
#[derive(Debug, Clone, Copy)]
pub struct Amount {
    pub checkpoints: u64,
    pub restores: u64,
    /// An object joins or leaves after so many checkpoints.
    pub change_every: u64,
}

/// The number of calls made, and their failures.
#[derive(Debug, Default)]
pub struct Tally {
    pub checkpoints: u64,
    pub restores: u64,
    pub changes: u64,
    pub calls: u64,
    /// Why a checkpoint was not taken or put back, a thread panicked or did not return.
    pub lost: Vec<String>,
    /// The objects that were parked, each with its reason.
    pub parked: Vec<String>,
}

/// Random numbers by a seed (SplitMix64).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// The next one, 0 … 1.
    pub fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of 0 to `count` - 1.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count.saturating_sub(1))
    }

    fn place(&mut self) -> DVec3 {
        DVec3::new(self.share() - 0.5, self.share() - 0.5, 0.1 + 0.4 * self.share())
    }
}

fn part(random: &mut Random) -> Rigid {
    let part = if random.share() < 0.5 { Rigid::ball(0.05) } else { Rigid::cuboid([0.08; 3]) };
    part.mass_kg(0.5).at(random.place().to_array())
}

/// A dozen bodies that fall onto a floor.
fn crowd() -> Scene {
    let mut random = Random(7);
    let builder = Scene::builder().fixed("floor", Solid::Plane);
    let builder = (0..FIRST).fold(builder, |builder, k| builder.add(format!("{k}"), part(&mut random)));
    builder.build().unwrap()
}

/// The objects that are there.
fn present(world: &World) -> Vec<Object> {
    let there = world.agents().iter().filter(|agent| agent.state() != AgentState::Gone);
    there.filter_map(|agent| world.object_of(agent.id()).ok()).collect()
}

/// Lets an object jump.
fn jump(world: &World, random: &mut Random) -> Result<(), WorldError> {
    let there = present(world);
    let Some(object) = there.get(random.below(there.len())) else { return Ok(()) };
    world.command(*object, Command::teleport(random.place(), DQuat::IDENTITY))
}

/// Lets an object join or leave.
fn change(world: &World, name: String, random: &mut Random) -> Result<(), WorldError> {
    let there = present(world);
    if there.len() < 2 || there.len() < CROWD && random.share() < 0.5 {
        world.add(name, part(random)).map(drop)
    } else {
        world.remove(there[random.below(there.len())])
    }
}

/// Saves a world and puts it back while objects join, leave and jump; in lockstep a second thread lets them. A call may come too late for an object
/// that has left.
pub fn churn(executor: ExecutorKind, amount: Amount, seed: u64) -> Tally {
    let (world, mut random, mut tally) = (World::start(&crowd(), executor).unwrap(), Random(seed), Tally::default());
    world.drive(TimelineCommand::Run);
    let is_virtual = executor == ExecutorKind::Lockstep;
    let (asks, asked) = mpsc::sync_channel(1);
    let other = is_virtual.then(|| {
        let (world, mut random) = (world.clone(), Random(!seed));
        std::thread::spawn(move || {
            for number in asked {
                drop(change(&world, format!("other {number}"), &mut random));
                (0..16).for_each(|_| drop(jump(&world, &mut random)));
            }
        })
    });
    let mut marks: Vec<Checkpoint> = Vec::new();
    let restore_every = (amount.checkpoints / amount.restores).max(1);
    while tally.checkpoints < amount.checkpoints && tally.lost.is_empty() {
        drop(jump(&world, &mut random));
        if tally.checkpoints.is_multiple_of(amount.change_every) {
            drop(change(&world, format!("own {}", tally.checkpoints), &mut random));
            tally.changes += 1;
            // as often: with each number that was ever used a checkpoint is larger
            tally.changes += u64::from(is_virtual && asks.send(tally.checkpoints).is_ok());
        }
        if is_virtual {
            world.advance(SimSpan::from_millis(2));
        }
        match world.checkpoint() {
            Ok(mark) if marks.len() < MARKS => marks.push(mark),
            Ok(mark) => marks[random.below(MARKS)] = mark,
            Err(error) => tally.lost.push(format!("checkpoint {}: {error}", tally.checkpoints)),
        }
        tally.checkpoints += 1;
        if tally.checkpoints.is_multiple_of(restore_every) {
            if let Err(error) = world.restore(&marks[random.below(marks.len())]) {
                tally.lost.push(format!("restore {}: {error}", tally.restores));
            }
            tally.restores += 1;
        }
    }
    drop(asks);
    tally.note_parked(&world);
    world.stop();
    if other.is_some_and(|other| other.join().is_err()) {
        tally.lost.push("the second thread panicked".to_owned());
    }
    tally
}

/// Lets `threads` threads call every method of a world at random, `calls` times each or for so long.
pub fn storm(executor: ExecutorKind, threads: usize, calls: u64, most: Duration, seed: u64) -> Tally {
    let world = World::start(&crowd(), executor).unwrap();
    let (marks, ends) = (Arc::new(Mutex::new(vec![world.checkpoint().unwrap()])), Instant::now() + most);
    let at: Arc<Vec<AtomicUsize>> = Arc::new((0..threads).map(|_| AtomicUsize::new(0)).collect());
    let (sender, receiver) = mpsc::channel();
    for thread in 0..threads {
        let (world, marks, at, sender) = (world.clone(), Arc::clone(&marks), Arc::clone(&at), sender.clone());
        std::thread::spawn(move || {
            let events = world.events(EventFilter::all());
            let mut caller =
                Caller { world, marks, events, random: Random(seed + thread as u64), tally: Tally::default() };
            while caller.tally.calls < calls && Instant::now() < ends && caller.tally.lost.is_empty() {
                let which = caller.random.below(CALLS);
                at[thread].store(which, Relaxed);
                caller.call(which, thread);
                caller.tally.calls += 1;
            }
            let _ = sender.send((thread, caller.tally));
        });
    }
    drop(sender);
    let (mut all, mut returned, late) = (Tally::default(), vec![false; threads], ends + PATIENCE);
    while returned.contains(&false) {
        match receiver.recv_timeout(Duration::from_millis(100)) {
            Ok((thread, tally)) => {
                returned[thread] = true;
                all.checkpoints += tally.checkpoints;
                all.restores += tally.restores;
                all.changes += tally.changes;
                all.calls += tally.calls;
                all.lost.extend(tally.lost);
            }
            // a caller that advances a world which another thread has paused waits until it runs again: all of them may
            Err(_) if Instant::now() < late => world.drive(TimelineCommand::Run),
            Err(error) => {
                let missing = (0..threads).filter(|thread| !returned[*thread]);
                let calls: Vec<_> = missing.map(|thread| at[thread].load(Relaxed)).collect();
                let (timeline, time) = (world.timeline(), world.time());
                let agents: Vec<_> = world.agents().iter().map(|agent| (agent.state(), agent.lived_to())).collect();
                all.lost.push(format!(
                    "threads in the calls {calls:?} did not return: {error}; {timeline:?} at {time:?}, {agents:?}"
                ));
                return all;
            }
        }
    }
    all.note_alive(&world);
    all.note_parked(&world);
    world.stop();
    all
}

impl Tally {
    fn note_parked(&mut self, world: &World) {
        for agent in world.agents() {
            if let AgentState::Parked(reason) = agent.state() {
                self.parked.push(format!("\"{}\": {reason}", agent.name()));
            }
        }
    }

    /// Notes where a world does not go on: time, a command that every object obeys, a checkpoint and the way back to it.
    fn note_alive(&mut self, world: &World) {
        drop(world.end_recording());
        let before = world.time();
        world.advance(SimSpan::from_millis(50));
        if world.time() <= before {
            self.lost.push(format!("time stands at {before:?}"));
        }
        for object in present(world) {
            if let Err(error) = world.command(object, Command::teleport(DVec3::splat(0.5), DQuat::IDENTITY)) {
                self.lost.push(format!("a command: {error}"));
            }
        }
        let outcome = world.checkpoint().and_then(|mark| world.restore(&mark));
        self.lost.extend(outcome.err().map(|error| error.to_string()));
        world.advance(SimSpan::from_millis(50));
    }
}

/// A thread that calls a world.
struct Caller {
    world: World,
    marks: Arc<Mutex<Vec<Checkpoint>>>,
    events: Events,
    random: Random,
    tally: Tally,
}

/// How many kinds of calls there are.
const CALLS: usize = 30;

impl Caller {
    /// Makes the call of a number. An error of an object that has left is no fault.
    fn call(&mut self, which: usize, thread: usize) {
        match which {
            0..=9 => self.change(which, thread),
            10..=15 => self.let_pass(which),
            _ => self.ask(which),
        }
    }

    fn object(&mut self) -> Object {
        let count = self.world.agents().len();
        self.world.object_of(AgentId(self.random.below(count) as u32)).unwrap()
    }

    /// Calls that change the world.
    fn change(&mut self, which: usize, thread: usize) {
        let (object, world) = (self.object(), self.world.clone());
        let place = self.random.place();
        let anchor = Anchor::Local(DVec3::ZERO);
        match which {
            0 => drop(world.command(object, Command::teleport(place, DQuat::IDENTITY))),
            1 => drop(world.command(object, Command::force(anchor, DVec3::Z * 2.0).for_ms(20))),
            2 => drop(world.command(object, Command::spring(anchor, place, 50.0, 1.0).for_ms(50))),
            3 => drop(world.command(object, Command::impulse(anchor, DVec3::X * 0.1))),
            4 => {
                let state = world.latest(object).map(|state| state.body.clone());
                drop(state.and_then(|state| world.set_state(object, &state)));
            }
            5 | 6 => {
                drop(change(&world, format!("{thread}-{}", self.tally.calls), &mut self.random));
                self.tally.changes += 1;
            }
            7 => match world.checkpoint() {
                Ok(mark) => {
                    self.tally.checkpoints += 1;
                    let mut marks = self.marks.lock().unwrap_or_else(PoisonError::into_inner);
                    if marks.len() < MARKS {
                        marks.push(mark);
                    } else {
                        let at = self.random.below(MARKS);
                        marks[at] = mark;
                    }
                }
                Err(error) => self.tally.lost.push(format!("checkpoint: {error}")),
            },
            8 => {
                let mark = {
                    let marks = self.marks.lock().unwrap_or_else(PoisonError::into_inner);
                    marks[self.random.below(marks.len())].clone()
                };
                if let Err(error) = world.restore(&mark) {
                    self.tally.lost.push(format!("restore: {error}"));
                }
                self.tally.restores += 1;
            }
            _ => drop(if self.random.share() < 0.3 {
                world.record_to(Box::new(std::io::sink()), None).map(|()| true)
            } else {
                world.end_recording()
            }),
        }
    }

    /// Calls that let time pass, or stop it.
    fn let_pass(&mut self, which: usize) {
        let world = &self.world;
        match which {
            10 => world.advance(SimSpan::from_millis(5)),
            11 => drop(world.advance_while(SimSpan::from_millis(10), || self.random.share() < 0.9)),
            12 => {
                let drives = [
                    TimelineCommand::Run,
                    TimelineCommand::Pause,
                    TimelineCommand::Step(SimSpan::from_millis(5)),
                    TimelineCommand::Leap(SimSpan::from_millis(5)),
                    TimelineCommand::Speed(2.0),
                ];
                world.drive(drives[self.random.below(drives.len())]);
            }
            13 => {
                let paces = [Pace::RealTime, Pace::Free, Pace::Factor(4.0)];
                world.set_pace(paces[self.random.below(paces.len())]).unwrap();
            }
            14 => drop(world.frames(1000.0).next()),
            _ => {
                world.wait_until(world.now() + Duration::from_millis(1));
                world.spend(Duration::from_micros(50));
            }
        }
    }

    /// Calls that only ask.
    fn ask(&mut self, which: usize) {
        let (object, world, place) = (self.object(), self.world.clone(), self.random.place());
        let solid = Solid::Ball { radius_m: 0.05 };
        match which {
            16 => drop(world.latest(object)),
            17 => drop(world.contacts(object)),
            18 => drop(world.cast_ray(place, DVec3::NEG_Z, 2.0)),
            19 => {
                let rotation = DQuat::IDENTITY;
                drop(world.cast(&Cast { solid: &solid, rotation, from_m: place, direction: DVec3::X, reach_m: 1.0 }));
            }
            20 => drop(world.nearest(place, 1.0)),
            21 => drop(world.overlapping(&solid, place, DQuat::IDENTITY)),
            22 => drop(self.events.drain().count()),
            23 => drop(world.frame().body(object)),
            24 => drop((world.time(), world.now(), world.timeline(), world.hash())),
            25 => drop((world.object("3"), world.objects(["1", "2"]))),
            26 => drop((world.joined(object.id()), world.agents_of_scene(), world.executor())),
            27 => drop(world.agents().iter().map(|agent| agent.stats()).collect::<Vec<_>>()),
            28 => {
                let site = Site { at_m: None, rotation: DQuat::IDENTITY };
                let imu = SensorKind::Imu { object: object.id(), gravity_m_s2: DVec3::ZERO, site };
                drop((world.read(&imu), world.joint("none"), world.sensor("none")));
            }
            _ => drop((world.recording_failed(), world.replayed(), world.sensors().len())),
        }
    }
}
