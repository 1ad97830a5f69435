//! `model = "tube"`: a soft tube, cable or rod.

use super::ranges::within;
use super::{OneOrRange, Point};
use metachron_models::rod::{Attachment, Integrator, LIMITS, Peristalsis, WallModel};
use schemars::JsonSchema;
use serde::Deserialize;

/// A soft tube, cable or rod: a Cosserat rod with a radius.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(LIMITS))]
pub struct TubeFile {
    /// Points of the centre line at the start, metres: 2 … 100000, no two consecutive ones equal; free of stress unless
    /// `straight` or `twist_deg` is given. Two points make a straight line, more a smooth curve through all of them.
    #[schemars(length(min = 2, max = 100_000))]
    pub path_m: Vec<Point>,
    /// Whether its rest shape is straight: the path is then a bent shape under stress. Default false.
    pub straight: Option<bool>,
    /// Angle by which its end is turned about the tube relative to its start when the scene begins, degrees, uniform
    /// along it; it springs back unless both ends are clamped. Default 0.
    pub twist_deg: Option<f64>,
    /// Outer radius at rest, metres.
    pub radius_m: f64,
    /// Wall thickness, metres, above 0 and at most `radius_m`. Default: `radius_m`, a solid rod.
    pub wall_m: Option<f64>,
    /// Young's modulus, Pa. May be left out where `ea_n` is given.
    pub young_pa: Option<f64>,
    /// Poisson's ratio. Default 0.45.
    pub poisson: Option<f64>,
    /// Density, kg/m³. May be left out where `mass_per_length_kg_m` is given.
    pub density_kg_m3: Option<f64>,
    /// Shear coefficient κ. Default 27/28.
    pub shear_factor: Option<f64>,
    /// Stretch stiffness EA, newtons; overrides modulus and section.
    pub ea_n: Option<f64>,
    /// Shear stiffness κGA, newtons; overrides modulus and section.
    pub ga_n: Option<f64>,
    /// Bend stiffness EI, N·m²; overrides modulus and section.
    pub ei_n_m2: Option<f64>,
    /// Twist stiffness GJ, N·m²; overrides modulus and section.
    pub gj_n_m2: Option<f64>,
    /// Mass per length, kg/m; overrides density and section.
    pub mass_per_length_kg_m: Option<f64>,
    /// Spacing ε of the simulation along the tube, metres, length / 4096 … 10 lengths: one number fixes it; `[finest, coarsest]` is the
    /// range that the controller may use, starting at the finest. Default: length / 64, fixed.
    // its range depends on the length
    #[schemars(extend("x-unit" = "m"))]
    pub eps_m: Option<OneOrRange<f64>>,
    /// Fixed number of segments of the simulation; `eps_m` then applies to the picture only.
    pub segments: Option<u32>,
    /// Spacing ε of the picture, metres, with the form and limits of `eps_m`. Default: `eps_m`, or `[length / 400, length / 8]` without it.
    pub picture_eps_m: Option<OneOrRange<f64>>,
    /// Time integrator. Default `implicit-euler`.
    pub integrator: Option<Integrator>,
    /// Least number of substeps in a step. Default 1.
    pub substeps: Option<u32>,
    /// Mass-proportional damping, 1/s: dv/dt = … − damping·v. Default 0.
    pub damping_per_s: Option<f64>,
    /// Ends held in place and direction. Default none.
    pub clamp: Option<Vec<End>>,
    /// Ends held in place, free to turn. Default none.
    pub pin: Option<Vec<End>>,
    /// Springs between parts of the tube and their rest positions (a mesentery).
    #[schemars(length(max = 1000))]
    pub attach: Option<Vec<Attachment>>,
    /// A travelling wave of the radius; where the wall gives, of the tension that would narrow it so if nothing resisted.
    pub peristalsis: Option<Peristalsis>,
    /// The motion of the sections. Default `prescribed`.
    pub wall: Option<WallModel>,
    /// Pressure inside relative to outside, Pa: widens the tube. One number, or times in seconds, each above the one before, with
    /// the pressures then: `[[0, 0], [1, 4000]]`; between them it changes evenly. Default 0.
    pub pressure_pa: Option<PressureFile>,
    /// Whether a gas fills the tube that cannot leave: `pressure_pa` is then that in the undeformed tube, and rises as the tube is squeezed.
    /// Only of a hollow tube whose wall gives. Default false.
    pub sealed: Option<bool>,
    /// Whether the tube collides with itself. Default true.
    pub self_contact: Option<bool>,
    /// Coulomb friction coefficient of the surface; a pair takes the geometric mean. Default 0.2.
    pub friction: Option<f64>,
}

/// A tube's pressure: constant, or over time.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number of pascals, or times and pressures as [[0.0, 0.0], [1.0, 4000.0]]")]
#[schemars(inline)]
pub enum PressureFile {
    /// One pressure, Pa.
    Constant(f64),
    /// Times, seconds, 0 … 1e6, each with the pressure then, Pa.
    Keys(#[schemars(length(min = 1, max = 10_000))] Vec<(f64, f64)>),
}

metachron_core::choices! {
    /// An end of a tube or rope.
    #[derive(JsonSchema)]
    pub enum End {
        /// Where the path begins.
        Start = "start",
        /// Where the path ends.
        End = "end",
    }
}
