//! What never changes around all clusters of a scene: static solids and gravity.
//!
//! In: the obstacles of a scene. Out: the same, ready for searches; shared by all clusters. Never here: what moves.

use glam::DVec3;
use metachron_geometry::Obstacle;
use metachron_geometry::narrow_phase::{StaticSolid, StaticSolidError};

/// The surroundings that all clusters of a scene share.
#[derive(Debug, Default)]
pub struct ClusterScene {
    /// The strength of gravity, m/s², ≥ 0: what closes no faster than it does within a macro step does not rebound.
    pub gravity_m_s2: f64,
    statics: Vec<StaticSolid>,
}

impl ClusterScene {
    /// The surroundings of `obstacles`.
    ///
    /// # Errors
    /// [`StaticSolidError`] for an invalid solid.
    pub fn new(obstacles: &[Obstacle], gravity: DVec3) -> Result<Self, StaticSolidError> {
        let statics = obstacles.iter().map(StaticSolid::new).collect::<Result<_, _>>()?;
        Ok(Self { gravity_m_s2: gravity.length(), statics })
    }

    /// The static solids, by their numbers.
    pub fn statics(&self) -> &[StaticSolid] {
        &self.statics
    }
}
