//! The level of detail of one actor and its shading.
//!
//! In: a policy's decision. Out: numbers at which [`crate::SceneView::compose`] draws. Never here: the choice of the level.

pub use metachron_core::kinds::Shading;
use metachron_core::{N_MAX, Resolution};

/// The level at which an actor is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// (ε, n) of a tube; only n for a single mesh with levels, a rope or the skin of a soft body.
    pub resolution: Resolution,
    /// Number of triangles, for forms that take any number. An actor with 0 is left out of the picture, with its shadow.
    pub triangles: u32,
    /// Shading.
    pub shading: Shading,
    /// Fraction of its possible detail: 0 is its coarsest, 1 its finest. Shown in [`crate::Colouring::Detail`] alone.
    pub detail: f32,
}

impl Level {
    /// The level with n clamped to `0..=N_MAX`.
    pub(crate) fn safe(self) -> Self {
        let Resolution { eps_m, n } = self.resolution;
        Self { resolution: Resolution { eps_m, n: n.min(N_MAX) }, ..self }
    }
}

impl From<Resolution> for Level {
    /// All triangles, lit per pixel.
    fn from(resolution: Resolution) -> Self {
        Self { resolution, triangles: u32::MAX, shading: Shading::default(), detail: 1.0 }
    }
}
