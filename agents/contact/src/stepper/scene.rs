//! What never changes around all clusters of a scene: static solids and joints.
//!
//! In: the obstacles and joints of a scene. Out: the same, ready for searches; shared by all clusters. Never here: what moves.

use crate::joint::{Joint, JointError};
use metachron_core::AgentId;
use metachron_geometry::Obstacle;
use metachron_geometry::narrow_phase::{StaticSolid, StaticSolidError};
use std::sync::Arc;

/// The surroundings that all clusters of a scene share.
#[derive(Debug, Default)]
pub struct ClusterScene {
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

    /// Whether none of the bodies that `has` knows passes through another of them or through a static solid.
    pub(super) fn stops_all_of(&self, has: impl Fn(AgentId) -> bool) -> bool {
        let apart = self.apart.iter().any(|pair| pair.iter().all(|id| has(*id)));
        !(apart || self.passages.iter().any(|passage| has(passage.body)))
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
