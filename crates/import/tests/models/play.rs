//! Imported scenes in lockstep.

use metachron_core::SimSpan;
use metachron_import::{Folders, Imported, Overlap};
use metachron_models::rigid::RigidSpec;
use metachron_scene::{Source, load, read_surface};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, Spec, World};
use std::path::Path;

/// The imported scene with a sensor for each joint's position, and a step rate for each object.
pub fn scene(imported: &Imported, joints: &[&str], rate_hz: f64) -> Scene {
    let sensor =
        |joint: &&str| format!("\n[[sensor]]\nname = \"{joint}\"\nkind = \"joint-position\"\njoint = \"{joint}\"\n");
    let text = imported.toml.clone() + &joints.iter().map(sensor).collect::<String>();
    let source = Source::memory("imported", text.as_bytes()).unwrap();
    let files = imported.files.iter().map(|file| (file.path.clone(), file.bytes.clone()));
    let source = source.with_files(files.collect());
    let mut scene = load(&source, &[]).unwrap_or_else(|error| panic!("{:?}\n{text}", error.problems));
    for agent in &mut scene.agents {
        let dt = SimSpan::from_secs_f64(1.0 / rate_hz).unwrap();
        (agent.pace.rate_hz, agent.pace.dt, agent.pace.dt_range) = (rate_hz, dt, (dt, dt));
    }
    scene
}

/// A folder whose files are read from the disk.
pub fn read_from(folder: &Path) -> Folders<'_> {
    Folders { read: Some(&|path| std::fs::read(path)), surface: Some(&read_surface), ..Folders::from(folder) }
}

/// The mass properties of a rigid object.
pub fn body(scene: &Scene, name: &str) -> RigidSpec {
    let agent = scene.agents.iter().find(|agent| agent.name == name).unwrap();
    let Spec::Rigid(body) = &agent.spec else { panic!("{name} is not rigid") };
    body.clone()
}

/// The objects of an imported scene that start inside each other.
pub fn overlaps(imported: &Imported) -> Vec<Overlap> {
    let found = scene(imported, &[], 500.0).overlaps.into_iter();
    found.map(|metachron_world::Overlap { a, b, depth_m }| Overlap { a, b, depth_m }).collect()
}

pub fn start(imported: &Imported, joints: &[&str], rate_hz: f64) -> World {
    World::start(&scene(imported, joints, rate_hz), ExecutorKind::Lockstep).unwrap()
}

pub fn position(world: &World, joint: &str) -> f64 {
    world.sensor(joint).unwrap().values[0]
}

pub fn advance(world: &World, seconds: f64) {
    world.advance(SimSpan::from_secs_f64(seconds).unwrap());
}

pub fn left_out(imported: &Imported) -> Vec<String> {
    imported.left_out.iter().map(ToString::to_string).collect()
}

/// Where the centre of mass of a body is.
pub fn centre(world: &metachron_world::World, name: &str) -> glam::DVec3 {
    let metachron_core::Body::Rigid(state) = world.latest(world.object(name).unwrap()).unwrap().body else {
        panic!("a rigid body")
    };
    state.position
}
