//! Worlds go on from checkpoints bit for bit: in the same world, again, in a new one, and from a file in another process.

use super::assemble::Governors;
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::{Anchor, Resolution, SimSpan, SolveLevel};
use metachron_runtime::{AgentState, Command, Keyed};
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Checkpoint, CheckpointError, Scene, World};
use std::path::Path;
use std::process::Command as Process;

fn built_in(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.toml"));
    load(&Source::open(file.to_str().unwrap()).unwrap(), &[]).unwrap()
}

fn written(name: &str, text: &str) -> Scene {
    load(&Source::memory(name, format!("format = 1\n{text}").as_bytes()).unwrap(), &[]).unwrap()
}

fn start(scene: &Scene) -> World {
    let mut governors = Governors::of(scene);
    World::start_governed(scene, ExecutorKind::Lockstep, &mut |member| governors.governor(member)).unwrap()
}

fn open(scene: &Scene, mark: &Checkpoint) -> Result<World, CheckpointError> {
    let mut governors = Governors::of(scene);
    World::open_governed(scene, ExecutorKind::Lockstep, &mut |member| governors.governor(member), mark)
}

/// The objects whose states differ in two worlds.
fn apart(a: &World, b: &World) -> Vec<String> {
    let pairs = a.agents().iter().zip(b.agents());
    let differ = pairs.filter(|(a, b)| a.latest().fold_hash(0) != b.latest().fold_hash(0));
    differ.map(|(a, _)| format!("{} ({})", a.name(), a.model())).collect()
}

/// Simulated milliseconds before the checkpoint, and after it.
#[derive(Clone, Copy)]
struct Spans {
    before: u64,
    after: u64,
}

/// A scene goes on from a checkpoint in all ways. Just before it `act` acts on the world, and `then` where it goes on.
fn goes_on(scene: &Scene, Spans { before, after }: Spans, act: impl Fn(&World), then: impl Fn(&World)) {
    let (name, after) = (&scene.name, SimSpan::from_millis(after));
    let go_on = |world: &World| {
        then(world);
        world.advance(after);
        world.hash()
    };
    let world = start(scene);
    world.advance(SimSpan::from_millis(before));
    act(&world);
    let mark = world.checkpoint().unwrap();
    let at = world.hash();
    let end = go_on(&world);
    assert!(scene.agents.is_empty() || at != end, "{name}: nothing moves");
    let fresh = open(scene, &mark).unwrap();
    assert_eq!(fresh.hash(), at, "{name}: the state itself");
    assert_eq!(fresh.checkpoint().unwrap(), mark, "{name}: saved again");
    assert_eq!(go_on(&fresh), end, "{name}: a new world; apart: {:?}", apart(&fresh, &world));
    world.restore(&mark).unwrap();
    assert_eq!(world.checkpoint().unwrap(), mark, "{name}: rewound");
    assert_eq!(go_on(&world), end, "{name}: the same world; apart: {:?}", apart(&fresh, &world));
}

const SHORT: Spans = Spans { before: 150, after: 100 };
/// Of scenes that take long.
const SHORTER: Spans = Spans { before: 40, after: 60 };

#[test]
fn built_in_scenes_go_on() {
    // auditorium, domes, grove and walkthrough have no agents that move
    for name in ["catenary", "chain", "crossing", "gripper", "library", "pendulum", "stack", "tube"] {
        goes_on(&built_in(name), SHORT, |_| (), |_| ());
    }
}

#[test]
fn large_built_in_scenes_go_on() {
    for name in ["cavity", "mesentery", "organ", "overload", "yard"] {
        goes_on(&built_in(name), SHORTER, |_| (), |_| ());
    }
    // its thousand boxes take one turn together, of a tenth of a second of the declared machine
    goes_on(&built_in("pile"), Spans { before: 40, after: 150 }, |_| (), |_| ());
}

#[test]
fn what_was_divided_anew_goes_on_divided() {
    let finer = |world: &World| {
        for agent in world.agents() {
            let Some(Resolution { eps_m, n }) = agent.latest().resolution else { continue };
            agent.send(Command::resolution(Resolution { eps_m: 0.6 * eps_m, n })).unwrap();
        }
    };
    for name in ["crossing", "mesentery", "tube"] {
        let divided = |world: &World| {
            finer(world);
            world.advance(SimSpan::from_millis(40));
        };
        goes_on(&built_in(name), SHORT, divided, |_| ());
        // a command that still waits is in the checkpoint
        goes_on(&built_in(name), SHORT, finer, |_| ());
    }
}

#[test]
fn a_hand_that_holds_holds_on() {
    let hand = |world: &World| {
        let (agent, state) = (world.agents()[0].id(), world.agents()[0].latest());
        let (target, _) = state.body.probe(0.5).unwrap();
        let pull = AnchorSpring {
            by: None,
            anchor: Anchor::Arc(0.3),
            target: target + DVec3::Z * 0.05,
            target_velocity: DVec3::ZERO,
            stiffness_n_m: 50.0,
            damping_n_s_m: 0.5,
        };
        world.agents()[agent.0 as usize].send(Command::Spring(Keyed::first(Some(pull)))).unwrap();
    };
    let held = |world: &World| {
        hand(world);
        world.advance(SimSpan::from_millis(50));
    };
    goes_on(&built_in("crossing"), SHORT, hand, |_| ());
    goes_on(&built_in("crossing"), SHORT, held, |_| ());
}

const FLOOR: &str = "[[object]]\nname = 'floor'\nmodel = 'rigid'\nshape = 'plane'\n";

#[test]
fn what_rests_rests_on_and_wakes_as_it_would_have() {
    let ball = |name: &str, x: f64| {
        format!(
            "[[object]]\nname = '{name}'\nmodel = 'rigid'\nshape = 'ball'\nradius_m = 0.05\nrestitution = 0.0\nposition_m = [{x}, 0, 0.051]\n"
        )
    };
    let scene = written("resting", &format!("{FLOOR}{}{}", ball("one", 0.0), ball("other", 0.12)));
    let rested = |world: &World| {
        assert!(world.agents().iter().all(|agent| agent.state() == AgentState::Resting));
    };
    let push = |world: &World| {
        let state = world.agents()[0].latest();
        let (at, _) = state.body.probe(0.0).unwrap();
        let (by, anchor, target_velocity) = (None, Anchor::Local(DVec3::ZERO), DVec3::ZERO);
        let pull = AnchorSpring {
            by,
            anchor,
            target: at + DVec3::X * 0.1,
            target_velocity,
            stiffness_n_m: 500.0,
            damping_n_s_m: 1.0,
        };
        world.agents()[0].send(Command::Spring(Keyed::first(Some(pull)))).unwrap();
    };
    goes_on(&scene, Spans { before: 2000, after: 300 }, rested, push);
}

#[test]
fn a_heap_of_rapier3d_goes_on() {
    let box_ = "[[object]]\nname = 'box'\nmodel = 'rigid'\nshape = 'box'\nhalf_extents_m = [0.02, 0.02, 0.02]\nposition_m = [0, 0, 0.0205]\ngrid = [7, 7, 8]\nspacing_m = [0.042, 0.042, 0.0405]\nscatter_m = 0.0002\nrestitution = 0.0\nrate_hz = 60\n";
    // a factor of all takes longer than there is
    let hurried = "[world]\ncontact = 'budget'\n[machine.step.factor]\nbase_us = 0\nunit_us = 5\n";
    let scene = written("heap", &format!("{FLOOR}{box_}{hurried}"));
    let contacts = |world: &World| {
        let solves = world.agents()[0].latest().cluster.and_then(|cluster| cluster.solves).unwrap();
        assert!(solves.contacts > 1000 && solves.level == SolveLevel::RigidPile, "not a heap: {solves:?}");
    };
    goes_on(&scene, Spans { before: 200, after: 100 }, contacts, |_| ());
}

/// Bodies between which impulses and waves are on their way, some of them lost.
const ASYNCHRONOUS: &str = "
[[object]]
name = 'slow'
model = 'rigid'
shape = 'box'
half_extents_m = [0.2, 0.2, 0.05]
position_m = [0, 0, 0.05]
rate_hz = 90
faults = { jitter = 0.1, loss = 0.1 }
[[object]]
name = 'fast'
model = 'rigid'
shape = 'ball'
radius_m = 0.05
position_m = [0.02, 0, 0.2]
restitution = 0.0
rate_hz = 480
[[object]]
name = 'hose'
model = 'tube'
path_m = [[-0.3, 0.5, 0.5], [0.3, 0.5, 0.5]]
radius_m = 0.01
wall_m = 0.002
young_pa = 1e6
density_kg_m3 = 1000
clamp = ['start', 'end']
rate_hz = 120
[[object]]
name = 'hung'
model = 'rigid'
shape = 'ball'
radius_m = 0.03
position_m = [0.0, 0.5, 0.4]
rate_hz = 200
[[object]]
name = 'pressed'
model = 'rigid'
shape = 'ball'
radius_m = 0.05
position_m = [0.05, 0, 0.33]
restitution = 0.0
rate_hz = 300
[[coupling]]
a = 'slow'
b = 'fast'
law = 'ledger'
[[coupling]]
a = 'hose'
b = 'hung'
kind = 'attach'
at_a = 0.5
at_b = [0, 0, 0.03]
stiffness_n_m = 50
law = 'tlm'
[[coupling]]
a = 'fast'
b = 'pressed'
law = 'tlm'
stiffness_n_m = 2000
damping_n_s_m = 2
";

#[test]
fn asynchronous_pairs_with_lost_states_go_on() {
    let scene = written("asynchronous", &format!("{FLOOR}{ASYNCHRONOUS}"));
    for before in [150, 260, 417] {
        goes_on(&scene, Spans { before, after: 200 }, |_| (), |_| ());
    }
}

/// A tube that hangs: small, so that every byte of its file can be tried.
fn small() -> Scene {
    let tube = "[[object]]\nname = 'hose'\nmodel = 'tube'\npath_m = [[0, 0, 0], [0.3, 0, 0]]\nradius_m = 0.01\nwall_m = 0.002\nyoung_pa = 1e6\ndensity_kg_m3 = 1000\nclamp = ['start']\nsegments = 4\n";
    written("small", tube)
}

#[test]
fn a_file_with_any_byte_changed_or_missing_is_refused() {
    let (scene, folder) = (small(), tempfile::tempdir().unwrap());
    let world = start(&scene);
    world.advance(SimSpan::from_millis(50));
    let (mark, path) = (world.checkpoint().unwrap(), folder.path().join("mark"));
    mark.write(&path).unwrap();
    assert_eq!(Checkpoint::read(&path).unwrap(), mark);
    let whole = std::fs::read(&path).unwrap();
    let is_refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let error = Checkpoint::read(&path).unwrap_err();
        assert!(matches!(error, CheckpointError::BadFile { .. }) && error.to_string().contains("mark"), "{error}");
    };
    for at in (0..whole.len()).step_by(1 + whole.len() / 400) {
        let mut changed = whole.clone();
        changed[at] ^= 1 << (at % 8);
        is_refused(&changed);
        is_refused(&whole[..at]);
    }
    is_refused(&[whole.clone(), vec![0]].concat());
    let gone = Checkpoint::read(folder.path().join("none")).unwrap_err();
    assert!(matches!(gone, CheckpointError::File { .. }), "{gone}");
}

#[test]
fn a_checkpoint_of_another_scene_changes_nothing() {
    let (small, crossing) = (start(&small()), start(&built_in("crossing")));
    let (mark, before) = (crossing.checkpoint().unwrap(), small.hash());
    let error = small.restore(&mark).unwrap_err();
    assert_eq!(error.to_string(), "what was saved is of another scene: the number of moving objects is 2; expected 1");
    small.advance(SimSpan::from_millis(20));
    assert_ne!(small.hash(), before, "it runs on");
    small.stop();
    assert!(matches!(small.checkpoint(), Err(CheckpointError::Stopped)));
}

const FILE: &str = "METACHRON_TEST_CHECKPOINT";

#[test]
fn another_process_goes_on_from_a_file() {
    let (scene, after) = (built_in("crossing"), SimSpan::from_millis(100));
    if let Some(path) = std::env::var_os(FILE) {
        let world = open(&scene, &Checkpoint::read(path).unwrap()).unwrap();
        world.advance(after);
        println!("hash {:016x}", world.hash());
        return;
    }
    let (world, folder) = (start(&scene), tempfile::tempdir().unwrap());
    world.advance(SimSpan::from_millis(150));
    let path = folder.path().join("mark");
    world.checkpoint().unwrap().write(&path).unwrap();
    world.advance(after);
    let name = "checkpoint_tests::another_process_goes_on_from_a_file";
    let mut other = Process::new(std::env::current_exe().unwrap());
    let output = other.args(["--exact", name, "--nocapture"]).env(FILE, &path).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains(&format!("hash {:016x}", world.hash())), "{said}");
}
