//! Every built-in scene goes on from a checkpoint bit for bit, with its governors: in the same world, again, and in a new one.

use super::assemble::Governors;
use metachron_core::{AgentId, Anchor, Resolution, SimSpan};
use metachron_runtime::Command;
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Checkpoint, Scene, World};
use std::path::Path;

/// Simulated time before the checkpoint, and after it.
const BEFORE: SimSpan = SimSpan::from_millis(300);
const AFTER: SimSpan = SimSpan::from_millis(200);

fn scene(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.toml"));
    load(&Source::open(file.to_str().unwrap()).unwrap(), &[]).unwrap()
}

fn start(scene: &Scene) -> World {
    let mut governors = Governors::of(scene);
    World::start_governed(scene, ExecutorKind::Lockstep, &mut |member| governors.governor(member)).unwrap()
}

fn open(scene: &Scene, mark: &Checkpoint) -> World {
    let mut governors = Governors::of(scene);
    let governor = &mut |member: &_| governors.governor(member);
    World::open_governed(scene, ExecutorKind::Lockstep, governor, mark).unwrap()
}

/// The objects whose states differ in two worlds.
fn apart(a: &World, b: &World) -> Vec<String> {
    let pairs = a.agents().iter().zip(b.agents());
    let differ = pairs.filter(|(a, b)| a.latest().fold_hash(0) != b.latest().fold_hash(0));
    differ.map(|(a, _)| format!("{} ({})", a.name(), a.model())).collect()
}

/// Goes on from a checkpoint in all ways, after `act` on the world.
fn goes_on(scene: &Scene, before: SimSpan, act: impl Fn(&World)) {
    let world = start(scene);
    world.advance(before);
    act(&world);
    let mark = world.checkpoint().unwrap();
    let at = world.hash();
    world.advance(AFTER);
    let end = world.hash();
    let fresh = open(scene, &mark);
    assert_eq!(fresh.hash(), at, "{}: the state itself", scene.name);
    fresh.advance(AFTER);
    assert_eq!(fresh.hash(), end, "{}: a new world; apart: {:?}", scene.name, apart(&fresh, &world));
    for round in 1..=2 {
        world.restore(&mark).unwrap();
        assert_eq!(world.hash(), at, "{}: rewound for the {round}. time", scene.name);
        assert_eq!(world.checkpoint().unwrap(), mark, "{}: saved again", scene.name);
        world.advance(AFTER);
        assert_eq!(world.hash(), end, "{}: the {round}. time; apart: {:?}", scene.name, apart(&fresh, &world));
    }
}

fn each_goes_on(names: &[&str]) {
    names.iter().for_each(|name| goes_on(&scene(name), BEFORE, |_| ()));
}

#[test]
fn thin_bodies_go_on() {
    each_goes_on(&["catenary", "crossing", "mesentery", "pendulum", "tube"]);
}

#[test]
fn rigid_bodies_go_on() {
    each_goes_on(&["chain", "pile", "stack", "overload"]);
}

#[test]
fn tools_and_tissue_go_on() {
    each_goes_on(&["gripper", "cavity", "organ"]);
}

#[test]
fn scenes_to_look_at_go_on() {
    each_goes_on(&["auditorium", "domes", "grove", "library", "walkthrough", "yard"]);
}
