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

mod assemble;
mod builder;
mod call_lock;
mod checkpoint;
mod commands;
pub mod couplings;
mod error;
mod events;
mod frames;
mod initial_overlap;
mod initial_shape;
mod joined;
mod joint_states;
pub mod kinds;
mod log;
mod membership;
mod object;
mod overlap;
mod pace;
mod queries;
mod recorded;
mod recording;
mod recording_file;
mod replay;
mod saved;
mod scene;
mod sensors;
mod set_state;
mod spec;
mod ties;
mod world;

pub use assemble::{Govern, machine};
pub use builder::{Custom, Part, Rigid, SceneBuildError, SceneBuilder, SensorOn, Soft, Tube, static_solid};
pub use checkpoint::{BadCheckpoint, Checkpoint, CheckpointError};
pub use error::WorldError;
pub use events::{Contact, Event, EventFilter, Events, Happening};
pub use frames::{Frame, Frames};
pub use initial_overlap::Moved;
pub use joint_states::JointState;
pub use metachron_contact::detect::SolveBudget;
pub use metachron_runtime::{Command, FACTOR};
pub use object::{Object, Touched};
pub use overlap::Overlap;
pub use pace::Pace;
pub use queries::{Cast, ContactNow, Hit};
pub use recording::{BadRecording, RecordError, Recording, SceneText};
pub use recording_file::RecordingFile;
pub use scene::{
    Appearance, Camera, Factors, GROUP_LEVELS_MAX, Gains, Group, Machine, Member, NamedCamera, ObjectCost, PaceWish,
    Probe, RENDER_SCALE, Scene, Scenery, Spec, Target, View,
};
pub use sensors::{JointRef, ListedJoint, Reading, Sensor, SensorKind, Site};
pub use spec::Division;
pub use world::World;
