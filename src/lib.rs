//! metachron: a real-time physics engine in which every object keeps its own time and the frame never waits.
//!
//! In: a scene, built in code or read from a file. Out: a [`world::World`] that runs, read from any thread.
//! Never here: physics. This crate re-exports the others and holds the command; the map of them is `docs/ARCHITECTURE.md`.
//!
//! ```
//! use metachron::prelude::*;
//!
//! let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.5]).restitution(0.0);
//! let scene = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).build().unwrap();
//! let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
//! world.advance(SimSpan::from_millis(2000));
//! let state = world.latest(world.object("ball").unwrap()).unwrap();
//! let (position, _) = state.body.probe(0.0).unwrap();
//! assert!((position.z - 0.05).abs() < 1e-3); // rests on the floor
//! ```

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "scene")]
pub mod scenes;

pub use glam;
pub use metachron_contact as contact;
pub use metachron_core as core;
#[cfg(feature = "devices")]
pub use metachron_devices as devices;
#[cfg(feature = "scene")]
pub use metachron_drawable as drawable;
#[cfg(feature = "export")]
pub use metachron_export as export;
pub use metachron_geometry as geometry;
#[cfg(feature = "hosts")]
pub use metachron_hosts as hosts;
#[cfg(feature = "import")]
pub use metachron_import as import;
#[cfg(feature = "lab")]
pub use metachron_lab as lab;
pub use metachron_models as models;
#[cfg(feature = "render")]
pub use metachron_render as render;
pub use metachron_runtime as runtime;
#[cfg(feature = "scene")]
pub use metachron_scene as scene;
#[cfg(any(feature = "render", feature = "cli"))]
pub use metachron_session as session;
#[cfg(feature = "viewer")]
pub use metachron_viewer as viewer;
pub use metachron_world as world;

/// The pages of worlds in programs, of a model of one's own, and of the words of other engines: their code runs as tests.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../docs/world.md")]
    struct World;
    #[doc = include_str!("../docs/own-model.md")]
    struct OwnModel;
    #[doc = include_str!("../docs/from-rapier.md")]
    struct FromRapier;
    #[doc = include_str!("../docs/from-mujoco.md")]
    struct FromMujoco;
    #[doc = include_str!("../docs/from-sofa.md")]
    struct FromSofa;
}

/// The items that a program needs which builds and runs a scene.
pub mod prelude {
    pub use glam::{DQuat, DVec3};
    pub use metachron_contact::joint::{JointKind, Motor, MotorGoal};
    pub use metachron_contact::{Agent, Input, Inputs, OwnSteps, Stepping};
    pub use metachron_core::{AgentId, Anchor, Body, Resolution, ResolutionRange, SimSpan, SimTime, Snapshot};
    pub use metachron_geometry::Solid;
    pub use metachron_runtime::TimelineCommand;
    pub use metachron_world::{
        Checkpoint, Command, Contact, Custom, Event, EventFilter, Happening, JointState, Object, Pace, Recording,
        Rigid, Scene, SensorOn, Site, Soft, Touched, Tube, World, WorldError, kinds::ExecutorKind,
    };
}
