//! One cluster on every executor: a model of a user's own is touched on each as on a bare table, and nobody's time or thread changes a bit.
//! Reference: weights; lockstep.

#[path = "../../../../agents/models/tests/clusters/plate.rs"]
mod plate;

use crate::turn::watchdog::StallLimit;
use crate::{
    AgentHandle, AgentSpawn, AgentState, Agents, Lockstep, Machine, ManualClock, Pool, Priority, Run, Threads,
    TimelineCommand, state_hash,
};
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_contact::detect::ClusterScene;
use metachron_core::{AgentId, SimTime};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};
use metachron_models::soft::{MaterialLaw, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use plate::Plate;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// The executors that make the turns of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Executor {
    Lockstep,
    Threads,
    /// With so many workers.
    Pool(usize),
}

const EXECUTORS: [Executor; 5] =
    [Executor::Lockstep, Executor::Threads, Executor::Pool(1), Executor::Pool(2), Executor::Pool(8)];

/// A slice of time in which nobody gets late: no longer than a macro step of these scenes.
const SLICE: Duration = Duration::from_millis(4);

impl Executor {
    /// The agents after so many slices, and their states' hash. In real time the clock waits for all of them, so that nobody is late however
    /// busy the machine is.
    fn play(self, spawns: Vec<AgentSpawn>, slices: u32) -> (Agents, u64) {
        let clock = Arc::new(ManualClock::new());
        let mut run: Box<dyn Run> = match self {
            Self::Lockstep => Box::new(Lockstep::start(spawns, quick_machine()).unwrap()),
            Self::Threads => Box::new(Threads::start(spawns, clock.clone(), Priority::Normal).unwrap()),
            Self::Pool(workers) => {
                let limit = StallLimit::of(Duration::from_secs(60));
                Box::new(Pool::with_workers(spawns, clock.clone(), workers, limit, Priority::Normal).unwrap())
            }
        };
        run.drive(TimelineCommand::Run);
        if self == Self::Lockstep {
            run.wait_until(SLICE * slices);
        } else {
            (0..slices).for_each(|_| pass(&mut *run, &clock));
        }
        let agents = run.agents().clone();
        let hash = state_hash(&agents);
        for stats in run.shutdown() {
            assert_eq!(stats.state, AgentState::Running, "{self:?}: {}", stats.name);
        }
        (agents, hash)
    }
}

/// Lets a slice pass, and all agents live through it.
fn pass(run: &mut dyn Run, clock: &ManualClock) {
    clock.advance(SLICE);
    // sleepers see the hand of the clock move
    run.drive(TimelineCommand::Run);
    let until = SimTime::from_nanos(run.now().as_nanos() as u64);
    let deadline = Instant::now() + Duration::from_secs(60);
    while run.agents().iter().any(|agent| agent.latest().time <= until) {
        assert!(Instant::now() < deadline, "an agent has not lived to {until:?}");
        thread::yield_now();
    }
}

/// Steps that take no time to speak of: nobody is late in lockstep either.
fn quick_machine() -> Machine {
    let mut machine = Machine::two_cores_software();
    machine.steps.iter_mut().for_each(|price| (price.base_us, price.unit_us) = (1.0, 0.0));
    machine
}

fn spawn(name: &str, agent: impl Agent + 'static, rate_hz: f64, floor: bool) -> AgentSpawn {
    let floor = floor.then(|| Obstacle::new("floor", Solid::Plane));
    let scene = Arc::new(ClusterScene::new(floor.as_slice()).unwrap());
    AgentSpawn { scene, ..AgentSpawn::alone(name, Box::new(agent), rate_hz) }
}

fn tube(middle: DVec3, half: DVec3) -> Tube {
    let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
    let spec = TubeSpec::free(vec![middle - half, middle + half], Section::hollow(0.01, 0.01, material), 10);
    Tube::new(TubeSpec { gravity: GRAVITY, friction: 0.5, ..spec }).unwrap()
}

fn rigid(solid: Solid, middle: DVec3, mass_kg: f64) -> RigidBody {
    RigidBody::new(RigidSpec { gravity: GRAVITY, friction: 0.5, ..RigidSpec::free(solid, middle, mass_kg) }).unwrap()
}

fn position(agent: &AgentHandle) -> DVec3 {
    agent.latest().body.probe(0.5).unwrap().0
}

#[test]
fn a_plate_of_ones_own_carries_a_ball_and_a_tube_and_feels_their_weight_on_every_executor() {
    const WEIGHT_N: f64 = 3.05;
    const PLATE_KG: f64 = 0.5;
    for plate_hz in [60.0, 240.0, 1000.0] {
        for executor in [Executor::Lockstep, Executor::Threads, Executor::Pool(2)] {
            let at = format!("{executor:?}, {plate_hz} Hz");
            let plate = Plate::new(DVec3::new(0.1, 0.1, 0.005), PLATE_KG);
            let lying = tube(DVec3::new(-0.05, 0.0, 0.0152), DVec3::Y * 0.08);
            let ball_kg = WEIGHT_N / -GRAVITY.z - lying.mass_kg();
            let ball = rigid(Solid::Ball { radius_m: 0.02 }, DVec3::new(0.05, 0.0, 0.0252), ball_kg);
            let spawns = vec![
                spawn("plate", plate, plate_hz, false),
                spawn("ball", ball, 240.0, false),
                spawn("tube", lying, 240.0, false),
            ];
            let (agents, _) = executor.play(spawns, 500);
            let leaders: Vec<_> = agents.iter().map(|agent| agent.latest().cluster.unwrap().leader).collect();
            assert_eq!(leaders, [AgentId(0); 3], "{at}");
            let plate_m = position(&agents[0]).z;
            let felt_n = Plate::felt_n(plate_m, PLATE_KG);
            assert!((felt_n - WEIGHT_N).abs() < 0.01 * WEIGHT_N, "{at}: it feels {felt_n} N");
            for (agent, radius_m) in agents.iter().skip(1).zip([0.02, 0.01]) {
                let depth_m = plate_m + 0.005 + radius_m - position(agent).z;
                assert!((0.0..1e-4).contains(&depth_m), "{at}: {} is {depth_m} m deep", agent.name());
            }
        }
    }
}

/// Bodies of every kind that touch or fall on each other, large enough for helpers.
fn heaped() -> Vec<AgentSpawn> {
    let material = SoftMaterial {
        young_pa: 1e5,
        poisson: 0.3,
        density_kg_m3: 1000.0,
        damping_per_s: 0.0,
        damping_s: 0.0,
        law: MaterialLaw::Corotational,
    };
    let slab = SoftSpec {
        traits: metachron_geometry::ContactTraits::default(),
        shape: SoftShape::Box { size_m: DVec3::new(0.2, 0.2, 0.05), segments: [6, 6, 2] },
        nodes: None,
        eps_touched_m: None,
        material,
        position: DVec3::new(-0.1, -0.1, 1e-4),
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.5,
        gravity: GRAVITY,
        self_contact: false,
        sleep: false,
    };
    let block = |x: f64| rigid(Solid::Box { half_extents_m: DVec3::splat(0.02) }, DVec3::new(x, 0.0, 0.094), 0.3);
    vec![
        spawn("block", block(0.03), 240.0, true),
        spawn("slab", SoftBody::new(slab).unwrap(), 60.0, true),
        spawn("tube", tube(DVec3::Z * 0.062, DVec3::Y * 0.08), 240.0, true),
        spawn("other", block(-0.035), 120.0, true),
    ]
}

#[test]
fn one_cluster_has_the_same_bits_on_every_executor_and_any_number_of_workers() {
    // the end is well within a step of each: none of them is about to begin one
    let hashes: Vec<_> = EXECUTORS.iter().map(|executor| executor.play(heaped(), 102).1).collect();
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}
