//! What an agent is started with: its model, its rate, its ties.
//!
//! In: what a scene or a program says of it. Out: the same as plain data. Never here: its checks, its start.

use crate::records::governor::Governor;
use crate::records::probe::WatchedPoint;
use crate::time::faults::Faults;
use metachron_contact::detect::ClusterScene;
use metachron_contact::{Agent, Law, Link};
use metachron_core::{AgentId, ResolutionRange, SimSpan};
use std::sync::Arc;

/// Description of an agent to be started.
pub struct AgentSpawn {
    /// Its name in the scene.
    pub name: String,
    /// The agent.
    pub agent: Box<dyn Agent>,
    /// Requested steps per simulated second, `0 < rate <=` [`RATE_MAX_HZ`].
    pub rate_hz: f64,
    /// The length of its first step; clamped to `dt_range`.
    pub dt: SimSpan,
    /// The shortest and the longest allowed step; `0 < shortest <= longest <=` [`DT_MAX_S`](metachron_core::DT_MAX_S).
    pub dt_range: (SimSpan, SimSpan),
    /// The allowed resolutions; `None` for an agent that is never retuned.
    pub range: Option<ResolutionRange>,
    /// Agents whose newest states it always sees. Its own number and repeats are ignored.
    pub links: Vec<AgentId>,
    /// Laws between it and its peers, where not [`Law::Cluster`]. Given by one side; if both give one, that of the lower number counts.
    pub laws: Vec<(AgentId, Law)>,
    /// Permanent links to peers. Given by one side; the peer is informed, and both always see each other.
    pub attached: Vec<Link>,
    /// The surroundings of the clusters in which it is stepped; without effect for an agent that is no member
    /// ([`metachron_contact::Agent::member`]).
    pub scene: Arc<ClusterScene>,
    /// Faults injected on purpose; in clusters only into agents that have asynchronous pairs.
    pub faults: Faults,
    /// Points of it that are recorded ([`AgentHandle::samples`](crate::AgentHandle::samples)).
    pub watches: Vec<WatchedPoint>,
    /// Governor of its rate; `None` for an agent with fixed settings.
    pub governor: Option<Box<dyn Governor>>,
}

impl AgentSpawn {
    /// An agent that steps `rate_hz` times a second with a fixed step, without surroundings, links and a governor.
    #[must_use]
    pub fn alone(name: impl Into<String>, agent: Box<dyn Agent>, rate_hz: f64) -> Self {
        // an invalid rate is reported when the run begins
        let dt = SimSpan::from_secs_f64(1.0 / rate_hz).unwrap_or(SimSpan::ZERO);
        Self {
            name: name.into(),
            agent,
            rate_hz,
            dt,
            dt_range: (dt, dt),
            range: None,
            links: Vec::new(),
            laws: Vec::new(),
            attached: Vec::new(),
            scene: Arc::default(),
            faults: Faults::default(),
            watches: Vec::new(),
            governor: None,
        }
    }
}

/// The highest allowed rate: a step of a microsecond is less than a thread needs to wake.
pub const RATE_MAX_HZ: f64 = 1e6;
