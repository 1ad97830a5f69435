//! The fixed part of a scene around all clusters: static solids, joints, how deep contacts rest, how far their solves go.
//!
//! In: the obstacles and joints of a scene. Out: the same, ready for searches; shared by all clusters. Never here:
//! moving bodies.

use crate::joint::{Joint, JointError};
use crate::lists::refill;
use crate::solve::DEPTH_DEFAULT_M;
use metachron_core::{AgentId, DisjointSets};
use metachron_geometry::narrow_phase::{StaticSolid, StaticSolidError};
use metachron_geometry::{Aabb, Obstacle};
use rapier3d::parry;
use rapier3d::parry::partitioning::{Bvh, BvhBuildStrategy};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The surroundings that all clusters of a scene share.
#[derive(Debug)]
pub struct ClusterScene {
    depth_m: f64,
    budget: SolveBudget,
    statics: Vec<StaticSolid>,
    by_place: StaticTree,
    joints: Arc<[Joint]>,
    /// Numbers of joints, by their first bodies and then by themselves.
    by_body: Vec<u32>,
    /// Pairs of jointed bodies that do not collide, the lower number first, sorted.
    apart: Vec<[AgentId; 2]>,
    /// Sorted.
    passages: Vec<Passage>,
}

/// The boxes of static solids by where they are.
#[derive(Debug, Default)]
struct StaticTree {
    tree: Bvh,
    /// The numbers of the solids in the tree, by its leaves, and of endless ones, as a plane.
    bounded: Vec<u32>,
    endless: Vec<u32>,
}

impl StaticTree {
    fn of(statics: &[StaticSolid]) -> Self {
        let bounds = |number: &u32| statics[*number as usize].bounds();
        let is_bounded = |number: &u32| bounds(number).low.is_finite() && bounds(number).high.is_finite();
        let (bounded, endless): (Vec<_>, _) = (0..statics.len() as u32).partition(is_bounded);
        let boxes: Vec<_> = bounded.iter().map(|number| outward(bounds(number))).collect();
        Self { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), bounded, endless }
    }

    fn near(&self, around: Aabb, into: &mut Vec<u32>) {
        let around = outward(around);
        let leaves = self.tree.intersect_aabb(&around);
        refill(into, leaves.map(|leaf| self.bounded[leaf as usize]).chain(self.endless.iter().copied()));
        into.sort_unstable();
    }
}

/// A box in single precision with this one in it.
fn outward(Aabb { low, high }: Aabb) -> parry::bounding_volume::Aabb {
    let [low, high] = [(low, f32::next_down as fn(f32) -> f32), (high, f32::next_up)].map(|(corner, beyond)| {
        let [x, y, z] = corner.to_array().map(|x| beyond(x as f32));
        parry::math::Vec3::new(x, y, z)
    });
    parry::bounding_volume::Aabb::new(low, high)
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum SolveBudget {
    /// Until all laws hold, at any cost.
    Exact,
    /// As far as there is time in the macro step, in a run that goes by a clock.
    Timed {
        /// How many steps each solve may make in any case, within [`LEAST_STEPS_RANGE`]. After five an answer is safe.
        least_steps: u32,
    },
}

impl SolveBudget {
    /// How many steps each solve may make in any case; of an exact one, which has none to bound it, zero.
    pub(crate) const fn least_steps(self) -> u32 {
        match self {
            Self::Exact => 0,
            Self::Timed { least_steps } => least_steps,
        }
    }
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
            by_place: StaticTree::default(),
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
        let statics = obstacles.iter().map(StaticSolid::new).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { by_place: StaticTree::of(&statics), statics, ..Self::default() })
    }

    /// The same with `joints` between rigid bodies.
    ///
    /// # Errors
    /// [`JointError`] for a number outside its range.
    pub fn jointed(self, joints: Arc<[Joint]>) -> Result<Self, JointError> {
        joints.iter().try_for_each(Joint::check)?;
        let mut tied = DisjointSets::of(joints.len());
        (0..).zip(joints.iter()).try_for_each(|(number, joint)| joint.check_mimic(number, &joints, &mut tied))?;
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

    /// The joint of a number.
    pub fn joint(&self, number: u32) -> Option<&Joint> {
        self.joints.get(number as usize)
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

    /// Fills `into` with the numbers, rising, of the static solids whose boxes meet this one.
    pub(crate) fn statics_near(&self, around: Aabb, into: &mut Vec<u32>) {
        self.by_place.near(around, into);
    }

    /// The static solids, by their numbers.
    pub fn statics(&self) -> &[StaticSolid] {
        &self.statics
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use metachron_geometry::Solid;

    #[test]
    fn solids_near_a_box_are_those_whose_boxes_meet_it_and_all_without_an_end() {
        let ball =
            |x_m: f64| Obstacle { position: DVec3::X * x_m, ..Obstacle::new("ball", Solid::Ball { radius_m: 0.25 }) };
        let mut obstacles: Vec<_> = (0..200).map(|at| ball(f64::from(at * 37 % 200))).collect();
        obstacles.insert(100, Obstacle::new("floor", Solid::Plane));
        let scene = ClusterScene::new(&obstacles).unwrap();
        let mut near = vec![7];
        // up to the touch, to single precision
        let around = Aabb { low: DVec3::new(10.75, -1.0, -1.0), high: DVec3::new(13.25, 1.0, 1.0) };
        scene.statics_near(around, &mut near);
        let meets = |solid: &StaticSolid| solid.bounds().meets(around);
        let all = (0..).zip(scene.statics()).filter(|(_, solid)| meets(solid)).map(|(number, _)| number);
        assert_eq!(near, all.collect::<Vec<u32>>());
        assert_eq!(near.len(), 4);
        scene.statics_near(Aabb::about(DVec3::Y * 9.0, 1.0), &mut near);
        assert_eq!(near, [100]);
        ClusterScene::default().statics_near(around, &mut near);
        assert!(near.is_empty());
    }
}
