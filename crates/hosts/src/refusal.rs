//! Errors of a world on their way to a caller.
//!
//! In: the error that a world has. Out: the same error at the caller; one that has no form here, as its sentence. Never here:
//! errors of a connection.

use metachron_contact::{Input, Inputs};
use metachron_core::{AgentId, Anchor};
use metachron_runtime::SendError;
use metachron_world::{CheckpointError, SceneBuildError, WorldError};
use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

/// An error of a world, or a host's own.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) enum Refusal {
    NoAgent(AgentId),
    Foreign,
    Gone(String),
    SameName(String),
    NoName,
    Stalled(String, Duration),
    Stopped,
    NoPoint {
        name: String,
        anchor: Anchor,
        wanted: String,
    },
    NotTaken {
        name: String,
        model: String,
        lacks: Input,
        takes: Inputs,
    },
    NoMotor {
        name: String,
        joint: String,
        drives: String,
    },
    Refused {
        name: String,
        reason: String,
    },
    NoObject {
        name: String,
        known: String,
    },
    Undivided(String),
    /// Another error of a world, or one of the host.
    Other(String),
}

impl From<WorldError> for Refusal {
    fn from(error: WorldError) -> Self {
        match error {
            WorldError::NoAgent(id) => Self::NoAgent(id),
            WorldError::Foreign => Self::Foreign,
            WorldError::Gone { name } => Self::Gone(name),
            WorldError::SameName { name } => Self::SameName(name),
            WorldError::Part(SceneBuildError::NoName) => Self::NoName,
            WorldError::Stalled { name, lasts } => Self::Stalled(name, lasts),
            WorldError::Stopped => Self::Stopped,
            WorldError::NoPoint { name, anchor, wanted } => Self::NoPoint { name, anchor, wanted },
            WorldError::NotTaken(SendError::NotTaken { name, model, lacks, takes }) => {
                Self::NotTaken { name: name.to_string(), model: model.into_owned(), lacks, takes }
            }
            WorldError::NoMotor { name, joint, drives } => Self::NoMotor { name, joint, drives },
            WorldError::Refused { name, reason } => Self::Refused { name, reason },
            WorldError::NoObject { name, known } => Self::NoObject { name, known },
            WorldError::Undivided { reason } => Self::Undivided(reason),
            other => Self::Other(other.to_string()),
        }
    }
}

impl From<CheckpointError> for Refusal {
    fn from(error: CheckpointError) -> Self {
        match error {
            CheckpointError::Stopped => Self::Stopped,
            other => Self::Other(other.to_string()),
        }
    }
}

impl From<Refusal> for WorldError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::NoAgent(id) => Self::NoAgent(id),
            Refusal::Foreign => Self::Foreign,
            Refusal::Gone(name) => Self::Gone { name },
            Refusal::SameName(name) => Self::SameName { name },
            Refusal::NoName => Self::Part(SceneBuildError::NoName),
            Refusal::Stalled(name, lasts) => Self::Stalled { name, lasts },
            Refusal::Stopped => Self::Stopped,
            Refusal::NoPoint { name, anchor, wanted } => Self::NoPoint { name, anchor, wanted },
            Refusal::NotTaken { name, model, lacks, takes } => {
                let (name, model) = (Arc::from(name), Cow::Owned(model));
                Self::NotTaken(SendError::NotTaken { name, model, lacks, takes })
            }
            Refusal::NoMotor { name, joint, drives } => Self::NoMotor { name, joint, drives },
            Refusal::Refused { name, reason } => Self::Refused { name, reason },
            Refusal::NoObject { name, known } => Self::NoObject { name, known },
            Refusal::Undivided(reason) => Self::Undivided { reason },
            Refusal::Other(sentence) => Self::Elsewhere(sentence),
        }
    }
}
