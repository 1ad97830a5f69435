//! Faults of a user's own model, in each of its calls: it is parked and an event says so, all others step on as they
//! would have, and the world takes checkpoints, goes back, and lets objects join and leave. And loads that no step can follow.

mod coupled;
mod lockstep_stalls;
mod rogue;
mod stalls;
mod step_cost;

use glam::DVec3;
use metachron_core::{Body, SimSpan};
use metachron_geometry::Solid;
use metachron_runtime::AgentState;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{
    Checkpoint, Command, Custom, EventFilter, Events, Happening, Object, Pace, Rigid, Scene, Touched, World,
};
use rogue::{HALF_M, Kind, Rogue, Switch};
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;
use std::time::{Duration, Instant};

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

/// How often each case is made; `METACHRON_REPEATS` says otherwise.
fn repeats() -> u32 {
    std::env::var("METACHRON_REPEATS").ok().and_then(|text| text.parse().ok()).unwrap_or(1)
}

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

/// A rogue on a floor that bears a ball and touches a box; far away, out of its reach, a box with a ball on it and a ball that flies. The rogue
/// leads its cluster, or is led in it.
fn scene(switch: &Arc<Switch>, leads: bool) -> Scene {
    let mine = Arc::clone(switch);
    let rogue = Custom::made_by(move |_| Box::new(Rogue::new(&mine, DVec3::Z * HALF_M))).rate_hz(250.0);
    let rider = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.25]).rate_hz(250.0);
    let beside = Rigid::cuboid([0.1; 3]).mass_kg(1.0).at([0.2005, 0.0, 0.1]).rate_hz(500.0);
    let mut scene = Scene::builder().fixed("floor", Solid::Plane);
    if leads {
        scene = scene.add("rogue", rogue.clone());
    }
    scene = scene.add("rider", rider).add("beside", beside);
    if !leads {
        scene = scene.add("rogue", rogue);
    }
    let flying = Rigid::ball(0.05).mass_kg(1.0).at([-9.0, 0.0, 5.0]).velocity_m_s([0.5, 0.0, 2.0]);
    scene
        .add("far box", Rigid::cuboid([0.1; 3]).mass_kg(1.0).at([9.0, 0.0, 0.1]).rate_hz(500.0))
        .add("far ball", Rigid::ball(0.05).mass_kg(0.2).at([9.0, 0.0, 0.255]).rate_hz(250.0))
        .add("flying", flying.rate_hz(200.0))
        .build()
        .unwrap()
}

/// A state.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    steps: u64,
    time_ns: u64,
    position: DVec3,
    hash: u64,
}

/// The outcome of a case.
#[derive(Debug, PartialEq, Default)]
struct Left {
    /// The states of bodies that touch nothing that touches the rogue.
    far: Vec<Seen>,
    /// The states of bodies that touch it.
    near: Vec<Seen>,
    is_parked: bool,
    times: u64,
}

fn hashes(world: &World, names: &[&str]) -> Vec<Seen> {
    let of = |name: &&str| {
        let state = world.latest(world.object(name).unwrap()).unwrap();
        let Body::Rigid(body) = &state.body else { panic!("a rigid body") };
        let hash = state.fold_hash(metachron_core::HASH_START);
        Seen { steps: state.steps, time_ns: state.time.as_nanos(), position: body.position, hash }
    };
    names.iter().map(of).collect()
}

/// Lets it live for so long; whether it has done so within ten seconds: no more than ends a test that hangs.
fn advance(world: &World, span_ms: u64) -> bool {
    let begun = Instant::now();
    world.advance_while(ms(span_ms), || begun.elapsed() < Duration::from_secs(10))
}

/// The state, time and leader of each object.
fn lived(world: &World) -> String {
    let agents = world.agents().iter();
    let of = |agent: &metachron_runtime::AgentHandle| {
        format!("{} {:?} at {:?} of {:?}", agent.name(), agent.state(), agent.lived_to(), agent.led_by())
    };
    agents.map(of).collect::<Vec<_>>().join("; ")
}

/// Where the distant bodies are at each millisecond, in a world where nobody misbehaves.
fn far_paths() -> Vec<Vec<Seen>> {
    let world = World::start(&scene(&Arc::default(), true), ExecutorKind::Lockstep).unwrap();
    let at = |_| {
        world.advance(ms(1));
        hashes(&world, &FAR)
    };
    (0..300).map(at).collect()
}

const FAR: [&str; 3] = ["far box", "far ball", "flying"];

/// A world with a rogue in it, and the promises broken in it.
struct Case<'a> {
    world: World,
    switch: Arc<Switch>,
    kind: Kind,
    name: String,
    faults: &'a mut Vec<String>,
}

impl Case<'_> {
    fn check(&mut self, holds: bool, what: &str) {
        if !holds {
            self.faults.push(format!("{}: {what}", self.name));
        }
    }

    fn check_lives(&mut self, span_ms: u64, after: &str) {
        let ended = advance(&self.world, span_ms);
        self.check(ended, &format!("{span_ms} ms do not end {after}: {}", lived(&self.world)));
    }

    /// Lets the rogue misbehave from now on, and makes a call that runs its code.
    fn misbehave(&mut self, rogue: Object, now: &Checkpoint) {
        self.switch.set(self.kind);
        match self.kind {
            Kind::SetMotion => self.world.command(rogue, Command::velocity(DVec3::Y, DVec3::ZERO)).unwrap(),
            Kind::SetState => {
                let body = self.world.latest(rogue).unwrap().body.clone();
                self.world.set_state(rogue, &body).unwrap();
            }
            Kind::Archive => {
                let error = self.world.checkpoint().map(drop);
                let names_it = error.as_ref().err().is_some_and(|error| error.to_string().contains("rogue"));
                self.check(names_it, &format!("the checkpoint says {error:?}"));
            }
            // its shape is asked for where it comes back
            Kind::Form => {
                let back = self.world.restore(now);
                self.check(back.is_ok(), &format!("it cannot be put back: {:?}", back.err()));
            }
            _ => {}
        }
    }

    /// Checks which agents are parked, their events, and the states now.
    fn check_parked(&mut self, events: &mut Events) -> Left {
        let [rogue, rider] = self.world.objects(["rogue", "rider"]).unwrap();
        let at = self.world.agents().of(rogue.id()).unwrap();
        let (is_parked, times) = (matches!(at.state(), AgentState::Parked(_)), self.switch.times.load(SeqCst));
        let stands = matches!(self.kind, Kind::None | Kind::Sleeps | Kind::Momentum | Kind::Drop);
        self.check(is_parked || stands || times == 0, "it is not parked");
        // one that is led goes on with its leader: by a step of that at most, or two
        let time_s = self.world.time().as_secs_f64();
        self.check((0.2..0.21).contains(&time_s), &format!("time is {time_s}"));
        for name in ["rider", "beside", "far box", "far ball", "flying"] {
            let other = self.world.object(name).unwrap().id();
            let is_parked = matches!(self.world.agents().of(other).unwrap().state(), AgentState::Parked(_));
            self.check(!is_parked, &format!("{name} is parked"));
        }
        let is_told = events.drain().any(|event| event.object == rogue && event.what == Happening::Failed);
        self.check(!is_parked || is_told, "no event says that it is parked");
        let touches = self.world.contacts(rider).unwrap().iter().any(|c| c.with == Touched::Object(rogue));
        self.check(is_parked || touches, "its rider does not touch it any more, and nothing says so");
        Left { far: hashes(&self.world, &FAR), near: hashes(&self.world, &["rider", "beside"]), is_parked, times }
    }

    /// Checks that the world goes on: checkpoints, newcomers, ways back to `good`, removal.
    fn check_goes_on(&mut self, good: &Checkpoint, is_parked: bool) {
        if self.kind != Kind::Archive || is_parked {
            let error = self.world.checkpoint().err();
            self.check(error.is_none(), &format!("no checkpoint afterwards: {error:?}"));
        }
        let added = self.world.add("new", Rigid::ball(0.05).at([0.0, 3.0, 1.0]));
        self.check(added.is_ok(), "nothing can be added");
        self.check_lives(20, "an object has joined");
        let removed = self.world.remove(self.world.object("new").unwrap());
        self.check(removed.is_ok(), "nothing can be removed");
        self.switch.set(if self.kind == Kind::Drop { self.kind } else { Kind::None });
        let back = self.world.restore(good);
        self.check(back.is_ok(), &format!("it cannot be put back: {:?}", back.err()));
        self.check_lives(20, "it was put back");
        let rogue = self.world.object("rogue").unwrap();
        let state = self.world.agents().of(rogue.id()).unwrap().state();
        self.check(state == AgentState::Running, &format!("put back, it is {state:?}"));
        let gone = self.world.remove(rogue);
        self.check(gone.is_ok(), &format!("it cannot be removed: {:?}", gone.err()));
        self.check_lives(20, "it was removed");
    }
}

/// Lets the rogue misbehave after 100 ms; broken promises are added to `faults`.
fn case(executor: ExecutorKind, kind: Kind, leads: bool, faults: &mut Vec<String>) -> Left {
    let switch = Arc::<Switch>::default();
    let world = World::start(&scene(&switch, leads), executor).unwrap();
    world.set_pace(Pace::Free).unwrap();
    let name = format!("{kind:?} on {executor:?}, {}", if leads { "leading" } else { "led" });
    let mut events = world.events(EventFilter::all());
    let mut case = Case { world, switch, kind, name, faults };
    case.check_lives(100, "at the start");
    let good = case.world.checkpoint().unwrap();
    case.misbehave(case.world.object("rogue").unwrap(), &good);
    if !advance(&case.world, 100) {
        case.check(false, "the world is lost");
        return Left::default();
    }
    let left = case.check_parked(&mut events);
    case.check_goes_on(&good, left.is_parked);
    case.world.stop();
    left
}

#[test]
fn one_that_misbehaves_is_parked_and_all_others_step_as_without_it() {
    let (mut faults, paths) = (Vec::new(), far_paths());
    for executor in EXECUTORS {
        for leads in [true, false] {
            let [clean, refuses] = [Kind::None, Kind::Diverges].map(|kind| case(executor, kind, leads, &mut faults));
            for kind in Kind::ALL {
                for _ in 0..repeats() {
                    let left = case(executor, kind, leads, &mut faults);
                    let name = format!("{kind:?} on {executor:?}, leads {leads}");
                    // in real time the members of a cluster may differ now and then, and so the length and rounding of
                    // its steps; nobody is faster than 4 m/s
                    let is_on_path = |(path, seen): (&Seen, &Seen)| {
                        let apart_s = path.time_ns.abs_diff(seen.time_ns) as f64 * 1e-9;
                        let allowed_m = 1e-4 + 4.0 * apart_s;
                        apart_s <= 0.0025 && (path.position - seen.position).length() < allowed_m
                    };
                    let holds = |at: usize| paths.iter().any(|path| is_on_path((&path[at], &left.far[at])));
                    let holds_all = match executor {
                        ExecutorKind::Lockstep => left.far == clean.far,
                        _ => left.far.iter().enumerate().all(|(at, _)| holds(at)),
                    };
                    if !holds_all {
                        faults.push(format!("{name}: far away {:?}, on no path of theirs", left.far));
                    }
                    // in virtual time bodies that touch it step as if it had refused the step at its start, but where
                    // it fails at its end or later
                    let wanted = if left.is_parked { &refuses.near } else { &clean.near };
                    let at_end = matches!(
                        kind,
                        Kind::GoBack
                            | Kind::Snapshot
                            | Kind::NanBody
                            | Kind::NanEnergy
                            | Kind::NanBounds
                            | Kind::CanSleep
                    );
                    if executor == ExecutorKind::Lockstep && !at_end && left.near != *wanted {
                        faults.push(format!("{name}: near {:?} instead of {wanted:?}", left.near));
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}
