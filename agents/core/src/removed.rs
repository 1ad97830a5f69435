//! The matter taken out of a body: a sum since the start, so that a state read late, twice or never does no harm.
//!
//! In: the matter removed in each step. Out: its sum. Never here: where it was.

use glam::DVec3;

/// Matter that was removed from a body, all since the start or all in one step.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Removed {
    /// How many of its cells.
    pub cells: u32,
    /// How many triangles its skin has lost, net of new ones that close it: below zero where these are more.
    pub triangles: i32,
    /// Their mass, kg.
    pub mass_kg: f64,
    /// Their momentum when they went, kg·m/s, world axes.
    pub momentum: DVec3,
}

impl Removed {
    /// The two together.
    #[must_use]
    pub fn and(self, more: Self) -> Self {
        Self {
            cells: self.cells + more.cells,
            triangles: self.triangles + more.triangles,
            mass_kg: self.mass_kg + more.mass_kg,
            momentum: self.momentum + more.momentum,
        }
    }
}
