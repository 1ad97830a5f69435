//! How an object of a scene looks.
//!
//! In: what a scene says. Out: the same as plain data. Never here: pictures.

use super::kinds::{Material, ShadingKind};

/// How an object looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Red, green, blue (sRGB).
    pub colour: [u8; 3],
    /// Its material.
    pub material: Material,
    /// Weight of its picture relative to that of others, 0.001 … 1000.
    pub importance: f64,
    /// Whether it may be left out of the picture; `None`: as [`Target::may_vanish`](crate::Target::may_vanish) says.
    pub may_vanish: Option<bool>,
    /// Its shading.
    pub shading: ShadingKind,
}
