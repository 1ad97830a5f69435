//! `model = "tube"`: a soft tube, cable or rod.

use super::ranges::{DAMPING_RATE, DENSITY, FRICTION, SHARE, TEARING, within};
use super::{OneOrRange, Point};
use metachron_core::{NumberRange, Ranges};
use metachron_models::rod::{Integrator, WallModel};
use schemars::JsonSchema;
use serde::Deserialize;

const RIGIDITY: NumberRange = NumberRange::new(1e-15, 1e15, "");

/// Ranges of keys of [`TubeFile`].
pub const TUBE: Ranges = Ranges(&[
    ("twist_deg", NumberRange::new(-36_000.0, 36_000.0, "°")),
    ("radius_m", NumberRange::new(1e-6, 100.0, "m")),
    ("young_pa", NumberRange::new(1.0, 1e13, "Pa")),
    ("poisson", NumberRange::new(-0.999, 0.5, "")),
    ("density_kg_m3", DENSITY),
    ("shear_factor", NumberRange::new(1e-3, 2.0, "")),
    ("ea_n", RIGIDITY),
    ("ga_n", RIGIDITY),
    ("ei_n_m2", RIGIDITY),
    ("gj_n_m2", RIGIDITY),
    ("mass_per_length_kg_m", NumberRange::new(1e-9, 1e9, "kg/m")),
    ("segments", NumberRange::new(2.0, 4096.0, "")),
    ("substeps", NumberRange::new(1.0, 1000.0, "")),
    ("damping_per_s", DAMPING_RATE),
    ("pressure_pa", NumberRange::new(0.0, 1e7, "Pa")),
    ("friction", FRICTION),
]);

/// Ranges of keys of [`AttachFile`].
pub const ATTACH: Ranges = Ranges(&[
    ("from", SHARE),
    ("to", SHARE),
    ("stiffness_n_m2", NumberRange::new(0.0, 1e9, "N/m²")),
    ("slack_m", NumberRange::new(0.0, 100.0, "m")),
    ("damping_n_s_m2", NumberRange::new(0.0, 1e6, "N·s/m²")),
    ("tears_above_n", TEARING),
    ("yields_above_n", TEARING),
]);

/// Ranges of keys of [`PeristalsisFile`].
pub const PERISTALSIS: Ranges = Ranges(&[
    ("amplitude", NumberRange::new(0.0, 0.95, "")),
    ("wavelength_m", NumberRange::new(1e-4, 100.0, "m")),
    ("speed_m_s", NumberRange::new(-100.0, 100.0, "m/s")),
]);

/// A soft tube, cable or rod: a Cosserat rod with a radius.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(TUBE))]
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
    pub attach: Option<Vec<AttachFile>>,
    /// A travelling wave of the radius; where the wall gives, of the tension that would narrow it so if nothing resisted.
    pub peristalsis: Option<PeristalsisFile>,
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
pub enum PressureFile {
    /// One pressure, Pa.
    Constant(f64),
    /// Times, seconds, 0 … 1e6, each with the pressure then, Pa.
    Keys(Vec<[f64; 2]>),
}

/// An end of a tube.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// Where the path begins.
    Start,
    /// Where the path ends.
    End,
}

/// Springs along a part of a tube.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(ATTACH))]
pub struct AttachFile {
    /// Start of the part, as a share of the rest length.
    pub from: f64,
    /// End of the part, likewise; above `from`.
    pub to: f64,
    /// Stiffness per length, N/m².
    pub stiffness_n_m2: f64,
    /// Distance within which the spring does not act, metres. Default 0.
    pub slack_m: Option<f64>,
    /// Damping per length, N·s/m². Default 0.
    pub damping_n_s_m2: Option<f64>,
    /// Force of the whole part above which all of it tears off, N: the mean over a common step of the
    /// bodies that the tube touches. It is gone then for good, and the report has it under `events`. Default: never.
    pub tears_above_n: Option<f64>,
    /// Greatest force that the whole part gives, N; below `tears_above_n`, spread evenly along it: where more would be taken it
    /// slips, and holds from then on where it has come to. Default: as much as it takes.
    pub yields_above_n: Option<f64>,
}

/// A travelling wave of contraction: r = r₀ (1 − a (1 + cos(2π (s − c t)/λ))/2).
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(PERISTALSIS))]
pub struct PeristalsisFile {
    /// Deepest contraction a as a share of the radius.
    pub amplitude: f64,
    /// Wave length λ, metres.
    pub wavelength_m: f64,
    /// Wave speed c, m/s; negative runs from the end to the start.
    pub speed_m_s: f64,
}
