//! Where objects of a scene start: those that were moved clear of others, and those that overlap.
//!
//! In: what the search for room has found. Out: the same, by names. Never here: the search.

use glam::DVec3;

/// An agent that starts elsewhere than the scene puts it, because there it would be inside another object.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Its name.
    pub object: String,
    /// From the position in the scene to the position at start, metres.
    pub by_m: DVec3,
}

/// An agent that starts inside another agent or inside a static solid.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// Name of the agent; of two agents the one with the lower id.
    pub a: String,
    /// Name of the other.
    pub b: String,
    /// Depth at the deepest point, metres.
    pub depth_m: f64,
}
