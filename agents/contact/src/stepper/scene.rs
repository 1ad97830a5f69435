//! What never changes around all clusters of a scene: static solids.
//!
//! In: the obstacles of a scene. Out: the same, ready for searches; shared by all clusters. Never here: what moves.

use metachron_geometry::Obstacle;
use metachron_geometry::narrow_phase::{StaticSolid, StaticSolidError};

/// The surroundings that all clusters of a scene share.
#[derive(Debug, Default)]
pub struct ClusterScene {
    statics: Vec<StaticSolid>,
}

impl ClusterScene {
    /// The surroundings of `obstacles`.
    ///
    /// # Errors
    /// [`StaticSolidError`] for an invalid solid.
    pub fn new(obstacles: &[Obstacle]) -> Result<Self, StaticSolidError> {
        let statics = obstacles.iter().map(StaticSolid::new).collect::<Result<_, _>>()?;
        Ok(Self { statics })
    }

    /// The static solids, by their numbers.
    pub fn statics(&self) -> &[StaticSolid] {
        &self.statics
    }
}
