//! What never changes around all clusters of a scene: static solids, joints, how deep contacts rest, how far their solves go.
//!
//! In: the obstacles and joints of a scene. Out: the same, ready for searches; shared by all clusters. Never here: what moves.

use crate::joint::{Joint, JointError};
use crate::solve::DEPTH_DEFAULT_M;
use metachron_core::AgentId;
use metachron_geometry::Obstacle;
use metachron_geometry::narrow_phase::{StaticSolid, StaticSolidError};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The surroundings that all clusters of a scene share.
#[derive(Debug)]
pub struct ClusterScene {
    depth_m: f64,
    budget: SolveBudget,
    statics: Vec<StaticSolid>,
    joints: Arc<[Joint]>,
    /// Numbers of joints, by their first bodies and then by themselves.
    by_body: Vec<u32>,
    /// Pairs of jointed bodies that do not collide, the lower number first, sorted.
    apart: Vec<[AgentId; 2]>,
    /// Sorted.
    passages: Vec<Passage>,
}

/// A static solid that a body passes through: one through which it is held on both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Passage {
    /// The body.
    pub body: AgentId,
    /// The solid's number.
    pub solid: u32,
}

/// How deep contacts may be made to rest, metres. Below it the velocity by which they give way (clusters.md, eq. 5) drowns in the tolerance of
/// a solve; above it bodies are seen to lie in each other.
pub const DEPTH_RANGE_M: RangeInclusive<f64> = 1e-6..=1e-3;

/// How far the solves of a scene's contacts go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveBudget {
    /// Until all laws hold, whatever that takes.
    Exact,
    /// As far as there is time in the macro step, in a run that goes by a clock.
    Timed {
        /// How many steps each solve may make in any case, within [`LEAST_STEPS_RANGE`]. After five an answer is safe.
        least_steps: u32,
    },
}

/// How many steps a solve may be granted in any case. No solve makes more than the most of them.
pub const LEAST_STEPS_RANGE: RangeInclusive<u32> = 1..=400;

/// How many each is granted where nothing else is said: after so many from interior points contacts are some hundredths of a millimetre deeper.
pub const LEAST_STEPS_DEFAULT: u32 = 5;

/// A least number of steps outside its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "a solve would be granted {least_steps} steps at least; it must be {} to {}",
    LEAST_STEPS_RANGE.start(),
    LEAST_STEPS_RANGE.end()
)]
pub struct BadLeastSteps {
    /// The number given.
    pub least_steps: u32,
}

/// A depth outside its range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("contacts would rest {depth_m} m deep; it must be {} to {} m", DEPTH_RANGE_M.start(), DEPTH_RANGE_M.end())]
pub struct BadDepth {
    /// The depth given.
    pub depth_m: f64,
}

impl Default for ClusterScene {
    fn default() -> Self {
        Self {
            depth_m: DEPTH_DEFAULT_M,
            budget: SolveBudget::Exact,
            statics: Vec::new(),
            joints: Arc::default(),
            by_body: Vec::new(),
            apart: Vec::new(),
            passages: Vec::new(),
        }
    }
}

impl ClusterScene {
    /// The surroundings of `obstacles`.
    ///
    /// # Errors
    /// [`StaticSolidError`] for an invalid solid.
    pub fn new(obstacles: &[Obstacle]) -> Result<Self, StaticSolidError> {
        let statics = obstacles.iter().map(StaticSolid::new).collect::<Result<_, _>>()?;
        Ok(Self { statics, ..Self::default() })
    }

    /// The same with `joints` between rigid bodies.
    ///
    /// # Errors
    /// [`JointError`] for a number outside its range.
    pub fn jointed(self, joints: Arc<[Joint]>) -> Result<Self, JointError> {
        joints.iter().try_for_each(Joint::check)?;
        let mut by_body: Vec<u32> = (0..).zip(joints.iter()).map(|(number, _)| number).collect();
        by_body.sort_by_key(|&number| joints[number as usize].a);
        let passing = joints.iter().filter(|joint| !joint.collide);
        let pairs = passing.filter_map(|joint| joint.b.map(|b| [joint.a.min(b), joint.a.max(b)]));
        let mut apart: Vec<_> = pairs.collect();
        apart.sort_unstable();
        apart.dedup();
        Ok(Self { joints, by_body, apart, ..self })
    }

    /// The same with static solids that bodies pass through.
    #[must_use]
    pub fn with_passages(mut self, passages: impl IntoIterator<Item = Passage>) -> Self {
        self.passages.extend(passages);
        self.passages.sort_unstable();
        self
    }

    /// The same with contacts that rest `depth_m` metres deep.
    ///
    /// # Errors
    /// [`BadDepth`] outside [`DEPTH_RANGE_M`].
    pub fn resting_at(self, depth_m: f64) -> Result<Self, BadDepth> {
        if DEPTH_RANGE_M.contains(&depth_m) { Ok(Self { depth_m, ..self }) } else { Err(BadDepth { depth_m }) }
    }

    /// The same with solves that go as far as `budget` says; without it they are exact.
    ///
    /// # Errors
    /// [`BadLeastSteps`] outside [`LEAST_STEPS_RANGE`].
    pub fn within(self, budget: SolveBudget) -> Result<Self, BadLeastSteps> {
        match budget {
            SolveBudget::Timed { least_steps } if !LEAST_STEPS_RANGE.contains(&least_steps) => {
                Err(BadLeastSteps { least_steps })
            }
            _ => Ok(Self { budget, ..self }),
        }
    }

    /// How far solves go.
    #[must_use]
    pub const fn budget(&self) -> SolveBudget {
        self.budget
    }

    /// How deep contacts rest, metres.
    #[must_use]
    pub const fn depth_m(&self) -> f64 {
        self.depth_m
    }

    /// Whether a body passes through a static solid.
    pub fn has_passage(&self, passage: Passage) -> bool {
        self.passages.binary_search(&passage).is_ok()
    }

    /// The joints whose first body is `id`, with their numbers.
    pub fn joints_of(&self, id: AgentId) -> impl Iterator<Item = (u32, &Joint)> {
        let first = self.by_body.partition_point(|&number| self.joints[number as usize].a < id);
        let joints = self.by_body[first..].iter().map(|&number| (number, &self.joints[number as usize]));
        joints.take_while(move |(_, joint)| joint.a == id)
    }

    /// Whether two jointed bodies pass through each other; the lower number first.
    pub fn lets_through(&self, pair: [AgentId; 2]) -> bool {
        self.apart.binary_search(&pair).is_ok()
    }

    /// The bodies that pass through a static solid or through one that `has` knows.
    pub(crate) fn passing(&self, has: impl Fn(AgentId) -> bool) -> impl Iterator<Item = AgentId> {
        let apart = self.apart.iter().filter(move |pair| pair.iter().all(|id| has(*id)));
        apart.flatten().copied().chain(self.passages.iter().map(|passage| passage.body))
    }

    /// Whether one of the static solids only senses.
    pub fn has_sensors(&self) -> bool {
        self.statics.iter().any(|solid| solid.form.traits.is_sensor)
    }

    /// The static solids, by their numbers.
    pub fn statics(&self) -> &[StaticSolid] {
        &self.statics
    }
}
