//! Messages between a host and its callers, and their bytes.
//!
//! In: a message. Out: its bytes, and the message in bytes of any origin, or the fault of them. Never here: whether its
//! numbers can be ([`crate::check`]), a connection.
//!
//! A message: one byte of [`VERSION`], then the fields in postcard's form.

use crate::event_wire::WireEvent;
use crate::refusal::Refusal;
use crate::serving::{Role, SceneFiles};
use metachron_core::{AgentId, Body, SimSpan, SimTime, Snapshot};
use metachron_runtime::{Command, Reach, TimelineCommand};
use metachron_world::{Part, PartAdvanced};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// The version of all messages: it changes with the meaning of their bytes.
pub(crate) const VERSION: u8 = 7;
/// The version of the program, whose parts and states each version has its own of.
pub(crate) const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// The most bytes of one message.
pub const MESSAGE_MAX: usize = 16 << 20;
/// The most bytes of packed objects: a call with them has a head.
pub(crate) const PACKED_MAX: usize = MESSAGE_MAX - 64;

/// A call, with its place among those of its caller.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Request {
    /// The run of the host that it is for; 0 of the first.
    pub run: u64,
    /// Rises from call to call.
    pub sequence: u64,
    pub call: Call,
}

/// A call of a world.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) enum Call {
    /// The first of each caller, with the version of its program, and whether it only looks: rounded states are sent to it then.
    Hello {
        program: String,
        is_looking: bool,
    },
    /// All states.
    All,
    Command(AgentId, Command),
    SetState(AgentId, Box<Body>),
    Drive(TimelineCommand),
    Advance(SimSpan),
    Add(String, Box<Part>),
    Remove(AgentId),
    Checkpoint,
    Restore(Vec<u8>),
    Hash,
    /// The part as which an object joined.
    Part(AgentId),
    Scene,
    /// A scene to step a part of, of a host that waits for work.
    Begin(Box<SceneFiles>),
    /// The calls of a part of a world ([`metachron_world::DividedCalls`]).
    Release(Vec<AgentId>),
    Pack(Vec<AgentId>),
    Adopt(Vec<u8>),
    AdvanceWithin {
        span: SimSpan,
        boxes: Vec<Reach>,
        /// Whether its states are sent then.
        shows: bool,
    },
}

impl Call {
    /// The role that it needs: what changes the world, or lets all of it wait, needs an operator.
    pub const fn needs(&self) -> Role {
        match self {
            Self::Hello { .. } | Self::All | Self::Hash | Self::Part(_) | Self::Scene => Role::Viewer,
            Self::Command(..)
            | Self::SetState(..)
            | Self::Drive(_)
            | Self::Advance(_)
            | Self::Add(..)
            | Self::Remove(_)
            | Self::Checkpoint
            | Self::Restore(_)
            | Self::Begin(_)
            | Self::Release(_)
            | Self::Pack(_)
            | Self::Adopt(_)
            | Self::AdvanceWithin { .. } => Role::Operator,
        }
    }

    /// Whether it is one of a part of a world.
    pub const fn is_of_a_part(&self) -> bool {
        matches!(self, Self::Release(_) | Self::Pack(_) | Self::Adopt(_) | Self::AdvanceWithin { .. })
    }

    /// Whether it lets the time of a whole world pass.
    pub const fn lets_time_pass(&self) -> bool {
        matches!(self, Self::Drive(_) | Self::Advance(_))
    }
}

/// An answer to a call.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) enum Reply {
    Hello(Welcome),
    Moment(Moment),
    /// The call is done: its changes are in the messages up to this number.
    Done(u64),
    Added(AgentId, u64),
    Checkpoint(Vec<u8>),
    Hash(u64),
    Part(Option<Box<Part>>),
    Scene(Option<Box<SceneFiles>>),
    /// Packed objects; `None` where these are more than [`PACKED_MAX`] bytes.
    Packed(Option<Vec<u8>>),
    /// How far a part has come; its states are in the messages up to this number, if they are sent.
    Advanced(PartAdvanced, Option<u64>),
    Refused(Refusal),
}

/// The world that a caller has reached.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Welcome {
    pub run: u64,
    pub world: String,
    pub program: String,
    pub scene: String,
    pub scene_hash: u64,
    pub fixed: Vec<Arc<str>>,
}

/// States that changed, or all, at one moment.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Moment {
    /// The run of the host.
    pub run: u64,
    /// One more than the message before; of all states that of the newest message.
    pub sequence: u64,
    pub time: SimTime,
    pub states: Vec<ObjectState>,
    /// Objects that have left since.
    pub gone: Vec<AgentId>,
    pub events: Vec<WireEvent>,
}

/// A message of states and its bytes.
#[derive(Debug)]
pub(crate) struct Encoded {
    pub moment: Moment,
    pub bytes: Vec<u8>,
}

/// An object and its newest state.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct ObjectState {
    pub id: AgentId,
    pub name: Arc<str>,
    pub state: Arc<Snapshot>,
}

/// A fault of the bytes of a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BadMessage {
    #[error("a message has {0} bytes; expected at most {MESSAGE_MAX}")]
    TooLong(usize),
    #[error("messages are of version {0}; this program has version {VERSION}")]
    OtherVersion(u8),
    #[error("a message means nothing: {0}")]
    Malformed(String),
}

/// The bytes of a message.
///
/// # Errors
/// [`BadMessage::TooLong`], and [`BadMessage::Malformed`] for a part that no message can have.
pub(crate) fn encode(message: &impl Serialize) -> Result<Vec<u8>, BadMessage> {
    let bytes =
        postcard::to_extend(message, vec![VERSION]).map_err(|error| BadMessage::Malformed(error.to_string()))?;
    if bytes.len() > MESSAGE_MAX { Err(BadMessage::TooLong(bytes.len())) } else { Ok(bytes) }
}

/// The message in these bytes.
///
/// # Errors
/// [`BadMessage`].
pub(crate) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, BadMessage> {
    if bytes.len() > MESSAGE_MAX {
        return Err(BadMessage::TooLong(bytes.len()));
    }
    let malformed = |reason: &str| BadMessage::Malformed(reason.to_owned());
    let (version, rest) = bytes.split_first().ok_or_else(|| malformed("it is empty"))?;
    if *version != VERSION {
        return Err(BadMessage::OtherVersion(*version));
    }
    match postcard::take_from_bytes(rest) {
        Ok((message, [])) => Ok(message),
        Ok(_) => Err(malformed("bytes are left behind it")),
        Err(error) => Err(malformed(&error.to_string())),
    }
}

impl Moment {
    /// The message in parts that are short enough, each with its bytes; the first has the number `sequence`, which rises by `step` after each.
    /// An object whose state alone is too long is left out; returned is how many were.
    pub fn encode_parts(mut self, sequence: &mut u64, step: u64, out: &mut Vec<Encoded>) -> u64 {
        self.sequence = *sequence;
        let reply = Reply::Moment(self);
        let encoded = encode(&reply);
        let Reply::Moment(mut first) = reply else { return 1 };
        if let Ok(bytes) = encoded {
            *sequence += step;
            out.push(Encoded { moment: first, bytes });
            return 0;
        }
        if first.states.len() < 2 {
            return 1;
        }
        let states = first.states.split_off(first.states.len() / 2);
        let second = Self { run: first.run, time: first.time, states, ..Self::default() };
        first.encode_parts(sequence, step, out) + second.encode_parts(sequence, step, out)
    }
}
