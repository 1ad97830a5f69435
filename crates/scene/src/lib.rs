//! Reads and checks scene files and the meshes next to them, as the only crate that does.
//!
//! In: a built-in name, a path, or bytes; overrides from the command line. Out: a [`Scene`] that can be run, or a
//! [`SceneError`] that shows every problem at its position. Never here: running agents, drawing, the command line.
//!
//! ```
//! use metachron_scene::{Source, load};
//!
//! let text = br#"format = 1
//! [[object]]
//! name = "ball"
//! model = "rigid"
//! shape = "ball"
//! mass_kg = 2.0
//! radius_m = 0.1"#;
//! let source = Source::memory("example", text).unwrap();
//! assert_eq!(load(&source, &[]).unwrap().agents.len(), 1);
//! let error = load(&source, &[("object.ball.radius_m".to_owned(), "-1".to_owned())]).unwrap_err();
//! assert_eq!(error.problems[0].text, "-1"); // the problem names the text at fault
//! ```

mod build;
pub mod builtin;
mod check;
mod demand;
mod diagnostic;
mod document;
pub mod format;
mod limits;
pub mod papers;
mod schema;
mod snippet;
mod source;

pub use build::surface as read_surface;
pub use diagnostic::{SceneError, SceneProblem};
pub use schema::json_schema;
pub use source::{FileVersion, Limits, SCENE_BYTES_MAX, Source, SourceFile};

use build::{Entry, Objects, SceneContext};
use check::{Checker, Place};
use diagnostic::Problem;
use document::Document;
use format::{ContactsFile, SceneFile, SolvesFile, WorldFile};
use glam::DVec3;
use metachron_contact::detect::{LEAST_STEPS_DEFAULT, SolveBudget};
use metachron_contact::solve::DEPTH_DEFAULT_M;
use metachron_world::Scene;
use metachron_world::kinds::ExecutorKind;
use std::time::Duration;

/// The only version of the format.
const FORMAT: i64 = 1;
/// Most agents that may have a thread each, as in the runtime.
pub const THREADED_MAX: usize = 1000;
/// Default gravity, m/s².
const GRAVITY_DEFAULT: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// Reads a scene. Each override is a dotted key, such as `target.frame_hz` or `object.NAME.rate_hz`, and a TOML value
/// (text that is not TOML is a string); of equal keys the last counts.
///
/// # Errors
/// [`SceneError`] with every problem found.
pub fn load(source: &Source, overrides: &[(String, String)]) -> Result<Scene, SceneError> {
    let text = document::with_overrides(source.text(), overrides);
    read(source, &text).map_err(|problems| SceneError::new(source.name(), &text, problems))
}

/// Reads a scene, and resolves what was read first in a draft: keys that are wrong, or take too much memory, are found before anything is made.
fn read(source: &Source, text: &str) -> Result<Scene, Vec<Problem>> {
    let document = Document::parse(text).map_err(|problem| vec![problem])?;
    let mut draft = Checker::draft(&document);
    let (file, entries) = (read_stage(&mut draft), build::read_objects(&mut draft));
    resolve(&mut draft, source, file.as_ref(), &entries);
    draft.check_memory(source.limits().memory_bytes);
    let problems = draft.finish();
    if !problems.is_empty() {
        return Err(problems);
    }
    let mut c = Checker::new(&document);
    match (resolve(&mut c, source, file.as_ref(), &entries), c.finish()) {
        (Some(mut scene), problems) if problems.is_empty() => {
            scene.resolve_initial_overlaps();
            Ok(scene)
        }
        (_, problems) => Err(problems),
    }
}

fn resolve(c: &mut Checker<'_, '_>, source: &Source, file: Option<&SceneFile>, entries: &[Entry]) -> Option<Scene> {
    let world = file.map(|f| &f.world);
    let gravity = world.and_then(|w| w.gravity_m_s2).map_or(GRAVITY_DEFAULT, DVec3::from);
    let faults = world.and_then(|w| w.faults.as_ref());
    let objects = build::make_objects(c, entries, &SceneContext { source, gravity, faults });
    file.map(|file| assemble(c, source, file, gravity, objects))
}

/// Reads everything but the objects.
fn read_stage(c: &mut Checker<'_, '_>) -> Option<SceneFile> {
    let document = c.document();
    let others = document.root().iter().filter(|(key, _)| key.get_ref() != "object");
    let table = others.map(|(key, value)| (key.clone(), value.clone())).collect();
    c.read(&Place::SCENE, table, &[])
}

/// Whether the executor that was asked for takes so many agents.
fn check_executor(c: &mut Checker<'_, '_>, executor: ExecutorKind, agents: usize) {
    if executor == ExecutorKind::Threads && agents > THREADED_MAX {
        let what = format!("is `threads`, with {agents} agents");
        let expected = format!("expected `pool` or `auto`: at most {THREADED_MAX} agents have a thread each");
        c.wrong(&Place::SCENE, "executor", what, expected);
    }
}

fn assemble(c: &mut Checker<'_, '_>, source: &Source, file: &SceneFile, gravity: DVec3, mut objects: Objects) -> Scene {
    if file.format != FORMAT {
        let what = format!("is {}, which this version does not support", file.format);
        c.wrong(&Place::SCENE, "format", what, format!("expected {FORMAT}"));
    }
    build::check_target(c, &file.target);
    check_executor(c, file.executor, objects.names.agents().count());
    let probes = build::probes(c, &file.probe, &objects.names);
    // ties between objects that are wrong themselves, or not made yet, would give spurious problems
    let sound = c.count() == 0;
    let made = sound && !c.is_draft();
    let joints = if made { build::joints(c, &file.joint, &objects) } else { Vec::new() };
    let joint_names = build::joint_names(c, &file.joint);
    let sensors = if made { build::sensors(c, &file.sensor, &objects, &joint_names) } else { Vec::new() };
    let couplings = if made { build::couplings(c, &file.coupling, &objects) } else { Vec::new() };
    let groups = if sound { build::groups(c, &file.group, &mut objects, source) } else { Vec::new() };
    let fixed = objects.obstacles.len();
    let cells = build::cells(c, &file.cell, &file.portal, &mut objects);
    let walls = fixed..objects.obstacles.len();
    let contacts = file.world.contacts;
    if let Some(ContactsFile::By(_)) = contacts {
        let expected =
            "expected no such key: contacts are solved in clusters; or false, for those that a coupling names alone";
        c.wrong(&c.place("world"), "contacts", "is neither true nor false", expected);
    }
    Scene {
        name: source.name().to_owned(),
        description: file.description.clone().unwrap_or_default(),
        executor: file.executor,
        priority: file.priority,
        stall_limit: file.stall_s.map(Duration::from_secs_f64),
        states: file.states,
        environment: file.world.environment,
        gravity,
        target: file.target,
        cameras: build::cameras(c, &file.camera),
        machine: build::machine(c, file.machine.clone()),
        agents: objects.agents,
        obstacles: objects.obstacles,
        obstacle_appearances: objects.obstacle_appearances,
        scenery: objects.scenery,
        groups,
        cells,
        walls,
        contacts: contacts != Some(ContactsFile::Whether(false)),
        contact_depth_m: file.world.contact_depth_m.unwrap_or(DEPTH_DEFAULT_M),
        contact_budget: contact_budget(&file.world),
        joints: joints.into(),
        joint_names,
        sensors,
        couplings,
        probes,
        overlaps: Vec::new(),
        moved: Vec::new(),
    }
}

/// How far the solves of contacts go.
fn contact_budget(world: &WorldFile) -> SolveBudget {
    match world.contact {
        SolvesFile::Budget => {
            SolveBudget::Timed { least_steps: world.contact_least_steps.unwrap_or(LEAST_STEPS_DEFAULT) }
        }
        SolvesFile::Exact => SolveBudget::Exact,
    }
}
