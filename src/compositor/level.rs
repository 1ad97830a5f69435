//! How finely one actor is drawn, and by which shading.
//!
//! In: what a policy asks for. Out: numbers that [`super::Stage::compose`] draws at. Never here: which level is right.

use metachron_core::{N_MAX, Resolution};

/// How the light on a surface is worked out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Shading {
    /// One colour a triangle.
    Flat,
    /// Colours at corners, interpolated between them.
    Gouraud,
    /// Light at every pixel.
    #[default]
    PerPixel,
    /// The same on what is painted on it; what nothing is painted on is drawn as [`Shading::PerPixel`].
    Textured,
    /// Better than anybody asks for: what is painted on it, shadows with soft rims, corners darker than what the sky reaches.
    Shadowed,
}

/// The level that an actor is drawn at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Of a tube its (ε, n); of what is one mesh a level its n.
    pub resolution: Resolution,
    /// Of what can have any number of triangles, how many. Whatever has 0 is left out of the picture, with its shadow.
    pub triangles: u32,
    /// How it is shaded.
    pub shading: Shading,
    /// How much of what it can have it is drawn with: 0 its coarsest … 1 its finest. It shows in [`super::Colouring::Detail`] alone.
    pub detail: f32,
}

impl Level {
    /// The level with its n brought inside `0..=N_MAX`.
    pub(super) fn safe(self) -> Self {
        let Resolution { eps_m, n } = self.resolution;
        Self { resolution: Resolution { eps_m, n: n.min(N_MAX) }, ..self }
    }
}

impl From<Resolution> for Level {
    /// All triangles that there are, lit at every pixel.
    fn from(resolution: Resolution) -> Self {
        Self { resolution, triangles: u32::MAX, shading: Shading::default(), detail: 1.0 }
    }
}
