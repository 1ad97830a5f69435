//! Why a world could not be started, or refuses something.

use crate::description::builder::SceneBuildError;
use metachron_core::{AgentId, Anchor, ArchiveError};
use metachron_runtime::{RunError, SendError};
use std::time::Duration;

/// Why a world could not be started, or refuses something.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// A model rejected its object.
    #[error("object \"{name}\": {reason}")]
    Build {
        /// The object's name.
        name: String,
        /// The model's message.
        reason: String,
    },
    /// The agents could not be started.
    #[error(transparent)]
    Run(#[from] RunError),
    /// There is no agent of that number.
    #[error("the world has no agent {}", .0.0)]
    NoAgent(AgentId),
    /// The object is another world's.
    #[error("the object was named by another world")]
    Foreign,
    /// The object joined after the frame was made.
    #[error("\"{name}\" joined the world after this frame")]
    Later {
        /// Its name.
        name: String,
    },
    /// The object was removed.
    #[error("\"{name}\" has been removed from the world")]
    Gone {
        /// The name that it had.
        name: String,
    },
    /// An object of that name is in the world already.
    #[error("the world has an object \"{name}\" already; one that was removed leaves at its next step")]
    SameName {
        /// The name.
        name: String,
    },
    /// An object's step in lockstep has kept the thread that lets time pass for longer than a step may last
    /// ([`Scene::stall_limit`](super::Scene::stall_limit)): the world is waited for no longer, and goes on where that step ends.
    #[error("the step of \"{name}\" has lasted for {:.1} s, and nothing can be done to the world before it ends", lasts.as_secs_f64())]
    Stalled {
        /// The object.
        name: String,
        /// For how long, wall time.
        lasts: Duration,
    },
    /// The host of a world that runs elsewhere does not answer: its objects stay as they were last seen.
    #[error("the host of the world \"{world}\" has been silent for {:.1} s", lasts.as_secs_f64())]
    Silent {
        /// The world's name.
        world: String,
        /// For how long, wall time.
        lasts: Duration,
    },
    /// The host of a world that runs elsewhere refused something, for a reason that has no other form there.
    #[error("{0}")]
    Elsewhere(String),
    /// Several processes cannot step the world together.
    #[error("the world's steps cannot be shared among hosts: {reason}")]
    Undivided {
        /// Why.
        reason: String,
    },
    /// A world that was stopped takes nothing any more.
    #[error("the world has been stopped")]
    Stopped,
    /// An object cannot be built.
    #[error(transparent)]
    Part(#[from] SceneBuildError),
    /// The object has no such point.
    #[error("\"{name}\" has no point {anchor:?}: {wanted}")]
    NoPoint {
        /// The object's name.
        name: String,
        /// The point asked for.
        anchor: Anchor,
        /// Which points it has.
        wanted: String,
    },
    /// The object takes no such command.
    #[error(transparent)]
    NotTaken(SendError),
    /// The object drives no such joint.
    #[error(
        "\"{name}\" has no motor on joint {joint}: it must be a hinge or a slide, and \"{name}\" the first of the two that it joins; the joints that \"{name}\" drives: {drives}"
    )]
    NoMotor {
        /// The object's name.
        name: String,
        /// The joint's name, or its number where it has none.
        joint: String,
        /// The joints that it drives.
        drives: String,
    },
    /// A command was refused.
    #[error("\"{name}\" takes no such command: {reason}")]
    Refused {
        /// The object's name.
        name: String,
        /// Why.
        reason: String,
    },
    /// The world has no joint of that name.
    #[error("the world has no joint \"{name}\"; its joints with names are [{known}]")]
    NoJoint {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A joint without a coordinate.
    #[error("joint {joint} has no coordinate: only hinges and slides have one")]
    NoCoordinate {
        /// The joint's name, or its number where it has none.
        joint: String,
    },
    /// A coordinate of a joint that it cannot have.
    #[error("the {what} of joint {joint} is {value}; expected {wanted}")]
    BadCoordinate {
        /// The joint's name, or its number where it has none.
        joint: String,
        /// Its position or its velocity.
        what: &'static str,
        /// The value.
        value: f64,
        /// The range that it must be in.
        wanted: String,
    },
    /// Coordinates that do not close a loop of joints.
    #[error(
        "joint {joint} closes a loop of joints, and would be open by {apart}: the coordinates of a loop depend on each other, and are set together"
    )]
    OpenLoop {
        /// The joint's name, or its number where it has none.
        joint: String,
        /// By how much, in metres and radians.
        apart: String,
    },
    /// Coordinates of joints were set while time passes.
    #[error("coordinates of joints are set while time stands: pause the world first")]
    TimePasses,
    /// The world has no sensor of that name.
    #[error("the world has no sensor \"{name}\"; its sensors are [{known}]")]
    NoSensor {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A pace that no machine keeps, or that is a pause.
    #[error("the factor of time is {factor}; expected 0.001 to 100")]
    BadPace {
        /// The factor.
        factor: f64,
    },
    /// A query that asks for nothing that can be found.
    #[error("{0}")]
    BadQuery(String),
    /// The world has no moving object of that name.
    #[error("the world has no moving object \"{name}\"; its moving objects are {known}")]
    NoObject {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
}

/// The agent whose step in lockstep has kept another thread for too long: it is waited for no longer.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Waited {
    pub name: String,
    pub lasts: Duration,
}

impl From<Waited> for WorldError {
    fn from(Waited { name, lasts }: Waited) -> Self {
        Self::Stalled { name, lasts }
    }
}

impl From<Waited> for ArchiveError {
    fn from(Waited { name, .. }: Waited) -> Self {
        Self::Refused { what: format!("agent \"{name}\", whose step does not end,") }
    }
}

impl WorldError {
    pub(super) fn bad_query(reason: &str) -> Self {
        Self::BadQuery(reason.to_owned())
    }
}
