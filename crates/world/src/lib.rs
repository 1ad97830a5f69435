//! A scene as a world that runs: the resolved scene, its start, its agents and their latest states.
//!
//! In: a [`Scene`] built in code, or read by another crate. Out: a [`World`].
//! Never here: TOML, a file other than checkpoints and recordings, the GPU, a law of control.
//!
//! ```
//! use metachron_core::SimSpan;
//! use metachron_geometry::Solid;
//! use metachron_world::{Rigid, Scene, Tube, World, kinds::ExecutorKind};
//!
//! let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.5]).restitution(0.0);
//! let tube = Tube::along(&[[-0.2, 1.0, 0.3], [0.2, 1.0, 0.3]]).radius_m(0.01).clamp([true, true]);
//! let scene = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("tube", tube).build().unwrap();
//! let [world, again] = [0, 1].map(|_| World::start(&scene, ExecutorKind::Lockstep).unwrap());
//! [&world, &again].into_iter().for_each(|world| world.advance(SimSpan::from_millis(2000)));
//! let state = world.latest(world.object("ball").unwrap()).unwrap();
//! let (position, _) = state.body.probe(0.0).unwrap();
//! assert!((position.z - 0.05).abs() < 1e-3); // the ball rests on the floor
//! assert_eq!(world.hash(), again.hash()); // the same bits
//! let mark = world.checkpoint().unwrap(); // kept in memory, or `mark.write(path)`
//! world.advance(SimSpan::from_millis(100));
//! let end = world.hash();
//! world.restore(&mark).unwrap();
//! world.advance(SimSpan::from_millis(100));
//! assert_eq!(world.hash(), end); // it did the same again
//! ```

mod calls;
mod control;
mod description;
mod error;
mod history;
mod placing;
mod reading;
mod start;
mod world;

pub use calls::{EventReader, StateLink, WorldCalls};
pub use control::pace::Pace;
pub use description::appearance::Appearance;
pub use description::builder::{
    Custom, Part, Rigid, SceneBuildError, SceneBuilder, SensorOn, Soft, Tube, static_solid,
};
pub use description::placement::{Moved, Overlap};
pub use description::scene::{
    Camera, Load, Machine, Member, NamedCamera, ObjectCost, PaceWish, Probe, Scene, ShadingCosts, Spec, StepCost, View,
};
#[cfg(feature = "scenery")]
pub use description::scenery::{GROUP_LEVELS_MAX, Group, Scenery};
pub use description::sensor::{Sensor, SensorKind, Site};
pub use description::spec::Division;
pub use description::target::{OneOrRange, RENDER_SCALE, Target};
pub use description::{couplings, kinds};
pub use error::WorldError;
pub use history::checkpoint::{BadCheckpoint, Checkpoint, CheckpointError, SceneMark};
pub use history::output_file::{OutputFile, RecordingFile, is_same_file};
pub use history::recording::{BadRecording, RecordError, Recording, SceneText};
pub use metachron_contact::detect::SolveBudget;
pub use metachron_runtime::{Command, FACTOR, PRESETS};
pub use placing::divided::{DividedCalls, PartAdvanced};
pub use placing::placed_world::{HostLoad, PlacedHost, PlacedWorld};
pub use reading::events::{Contact, Event, EventFilter, EventSieve, Events, Happening};
pub use reading::frames::{Frame, Frames};
pub use reading::joint_states::JointState;
pub use reading::object::{Object, Touched, WorldTag};
pub use reading::queries::{Cast, ContactNow, Hit};
pub use reading::sensors::{JointRef, ListedJoint, Reading};
pub use reading::stress::Stresses;
pub use start::assemble::{Govern, machine};
pub use start::ghost_world::GhostWorld;
pub use world::World;
