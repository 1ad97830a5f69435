//! The specification of a tube: material, section, supports and options, as a scene gives them.

use super::PressureKey;
use glam::DVec3;
use metachron_core::{NumberRange, Ranges, Resolution, ResolutionRange};
use metachron_geometry::ContactTraits;

const RIGIDITY: NumberRange = NumberRange::new(1e-15, 1e15, "");

/// Ranges of the numbers of a tube as files give them; what is built in code may be past them.
pub const LIMITS: Ranges = Ranges(&[
    ("radius_m", NumberRange::new(1e-6, 100.0, "m")),
    ("young_pa", NumberRange::new(1.0, 1e13, "Pa")),
    ("poisson", NumberRange::new(-0.999, 0.5, "")),
    ("segments", NumberRange::new(2.0, 4096.0, "")),
    ("twist_deg", NumberRange::new(-36_000.0, 36_000.0, "°")),
    ("wall_m", NumberRange::new(1e-12, 100.0, "m")),
    ("shear_factor", NumberRange::new(1e-3, 2.0, "")),
    ("ea_n", RIGIDITY),
    ("ga_n", RIGIDITY),
    ("ei_n_m2", RIGIDITY),
    ("gj_n_m2", RIGIDITY),
    ("mass_per_length_kg_m", NumberRange::new(1e-9, 1e9, "kg/m")),
    ("substeps", NumberRange::new(1.0, 1000.0, "")),
    ("pressure_pa", NumberRange::new(0.0, 1e7, "Pa")),
]);

/// A tube, cable or rod before it is divided into segments.
#[derive(Debug, Clone)]
pub struct TubeSpec {
    /// Initial points of the centre line in metres, at least two, adjacent ones distinct; free of stress there
    /// unless one of the next two fields says otherwise.
    /// Two points make a straight line, more a smooth curve through all of them.
    pub path_m: Vec<DVec3>,
    /// Whether the unloaded tube is straight: the path is then a bent shape, not the one it springs back to.
    pub straight: bool,
    /// Initial twist of the sections about the centre line, radians, evenly from 0 to this at the end;
    /// the tube springs back unless both ends are clamped; −1000 … 1000.
    pub twist_rad: f64,
    /// The cross section: its stiffnesses and its inertia.
    pub section: Section,
    /// Initial resolution of the simulation.
    pub resolution: Resolution,
    /// The resolutions that `set_resolution` may take.
    pub range: ResolutionRange,
    /// Initial number of segments where a scene fixes it; else ⌈L/ε⌉.
    pub segments: Option<usize>,
    /// Time integrator.
    pub integrator: Integrator,
    /// The least number of substeps in a step, ≥ 1.
    pub substeps: u32,
    /// Mass-proportional damping in 1/s, ≥ 0: dv/dt = … − damping·v.
    pub damping_per_s: f64,
    /// Ends held in position and direction: start, end.
    pub clamp: [bool; 2],
    /// Ends held in position, free to turn: start, end.
    pub pin: [bool; 2],
    /// Springs along the length to the rest positions (a mesentery).
    pub attachments: Vec<Attachment>,
    /// A travelling wave of the radius; of a wall that gives, of the tension that would narrow it so if nothing resisted.
    pub peristalsis: Option<Peristalsis>,
    /// Whether its sections have freedoms of their own.
    pub wall: WallModel,
    /// Inside minus outside pressure, Pa: widens a prescribed wall by dr = p r² (1 − ν/2) / (E t), and a wall that gives by Lamé's law.
    pub pressure_pa: f64,
    /// The pressure over time by rising times, linear between them; it takes the place of the one number. Empty where that stays.
    pub pressure_keys: Vec<PressureKey>,
    /// Whether a gas fills the tube that cannot leave: `pressure_pa` is then that in the undeformed tube, and p V = const from there on.
    /// Only of a hollow tube with a wall that gives.
    pub sealed: bool,
    /// Whether the tube collides with itself.
    pub self_contact: bool,
    /// Coulomb friction coefficient of its skin, ≥ 0; a pair takes the geometric mean.
    pub friction: f64,
    /// Its groups, combine rules, spin friction, and whether it is a sensor.
    pub traits: ContactTraits,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Whether the tube may report that it is at rest.
    pub sleep: bool,
}

metachron_core::choices! {
    /// How a tube's sections behave.
    #[derive(Hash, Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum WallModel {
        /// They stay round, and their radius is given: pressure and peristalsis widen and narrow them, and nothing else does.
        #[default]
        Prescribed = "prescribed",
        /// They widen and flatten under pressure, bending, contact and the tension of their muscles (docs/theory/rod.md, section 15).
        Gives = "gives",
    }
}

/// A tube's section: dimensions, stiffnesses of stretch, shear, bend and twist, and inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Outer radius at rest, metres, > 0.
    pub radius_m: f64,
    /// Wall thickness, metres, `0 < wall <= radius`; equal to the radius for a solid rod.
    pub wall_m: f64,
    /// Young's modulus, Pa, > 0: for the pressure law and for warnings.
    pub young_pa: f64,
    /// Poisson's ratio, −1 < ν ≤ 0.5.
    pub poisson: f64,
    /// Stretch stiffness E·A, newtons, > 0.
    pub ea_n: f64,
    /// Shear stiffness κ·G·A, newtons, > 0.
    pub ga_n: f64,
    /// Bend stiffness E·I, N·m², > 0.
    pub ei_n_m2: f64,
    /// Twist stiffness G·J, N·m², > 0.
    pub gj_n_m2: f64,
    /// Mass per length ρ·A, kg/m, > 0.
    pub mass_per_length_kg_m: f64,
    /// Rotary inertia ρ·I about a diameter, per length, kg·m, > 0.
    pub rotary_kg_m: f64,
}

/// Springs between an interval of the tube and its rest position (a mesentery).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(deny_unknown_fields))]
pub struct Attachment {
    /// Start of the interval, as a share of the rest length.
    pub from: f64,
    /// End of the interval, likewise; above `from`.
    pub to: f64,
    /// Stiffness per length, N/m².
    pub stiffness_n_m2: f64,
    /// Slack, metres: within it the spring does not act, as a mesentery hangs loose. Default 0.
    #[cfg_attr(feature = "schema", serde(default))]
    pub slack_m: f64,
    /// Damping per length, N·s/m². Default 0.
    #[cfg_attr(feature = "schema", serde(default))]
    pub damping_n_s_m2: f64,
    /// Force of the whole interval above which all of it tears off, N: the mean over a common step of the bodies that the tube touches. It is gone
    /// then for good, and the report has it under `events`. Infinite, the default, where it never does.
    #[cfg_attr(feature = "schema", serde(default = "never"), schemars(extend("default" = "never")))]
    pub tears_above_n: f64,
    /// Greatest force that the whole interval gives, N; below `tears_above_n`, spread evenly along it: a part that would take more slips,
    /// and holds from then on where it has come to. Infinite, the default, where it takes as much as it gets.
    #[cfg_attr(feature = "schema", serde(default = "never"), schemars(extend("default" = "never")))]
    pub yields_above_n: f64,
}

/// The force at which an attachment tears or yields that never does, N.
#[cfg(feature = "schema")]
const fn never() -> f64 {
    f64::INFINITY
}

/// A travelling wave of contraction: r(s, t) = r₀ (1 − a·(1 + cos(2π (s − c t)/λ))/2).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(deny_unknown_fields))]
pub struct Peristalsis {
    /// Deepest contraction a as a share of the radius; below 1.
    pub amplitude: f64,
    /// Wave length λ, metres.
    pub wavelength_m: f64,
    /// Wave speed c, m/s; negative runs from the end to the start.
    pub speed_m_s: f64,
}

/// A hollow round section of one elastic material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus, Pa, > 0.
    pub young_pa: f64,
    /// Poisson's ratio, −1 < ν ≤ 0.5.
    pub poisson: f64,
    /// Density, kg/m³, > 0.
    pub density_kg_m3: f64,
    /// Shear coefficient κ, > 0; 27/28 is used for thin walls.
    pub shear_factor: f64,
}

impl TubeSpec {
    /// A free tube along `path_m` of this section, in `segments` equal parts: no supports, pulls, damping or friction, no contact with itself
    /// or fixed solids, constant resolution, no sleep.
    #[must_use]
    pub fn free(path_m: Vec<DVec3>, section: Section, segments: usize) -> Self {
        let length_m: f64 = path_m.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
        let resolution = Resolution { eps_m: length_m / segments.max(1) as f64, n: 0 };
        Self {
            path_m,
            straight: false,
            twist_rad: 0.0,
            section,
            resolution,
            range: ResolutionRange::fixed(resolution),
            segments: Some(segments),
            integrator: Integrator::ImplicitEuler,
            substeps: 1,
            damping_per_s: 0.0,
            clamp: [false; 2],
            pin: [false; 2],
            attachments: Vec::new(),
            peristalsis: None,
            wall: WallModel::Prescribed,
            pressure_pa: 0.0,
            pressure_keys: Vec::new(),
            sealed: false,
            self_contact: false,
            friction: 0.0,
            traits: ContactTraits::default(),
            gravity: DVec3::ZERO,
            sleep: false,
        }
    }
}

impl Section {
    /// The section of a round tube.
    #[must_use]
    pub fn hollow(radius_m: f64, wall_m: f64, material: Material) -> Self {
        let Material { young_pa, poisson, density_kg_m3, shear_factor } = material;
        let inner = (radius_m - wall_m).max(0.0);
        let area = std::f64::consts::PI * (radius_m * radius_m - inner * inner);
        let second_moment = std::f64::consts::FRAC_PI_4 * (radius_m.powi(4) - inner.powi(4));
        let shear_pa = young_pa / (2.0 * (1.0 + poisson));
        Self {
            radius_m,
            wall_m,
            young_pa,
            poisson,
            ea_n: young_pa * area,
            ga_n: shear_factor * shear_pa * area,
            ei_n_m2: young_pa * second_moment,
            gj_n_m2: shear_pa * 2.0 * second_moment,
            mass_per_length_kg_m: density_kg_m3 * area,
            rotary_kg_m: density_kg_m3 * second_moment,
        }
    }
}

metachron_core::choices! {
    /// Time integration of a tube, the cheapest step first.
    #[derive(Hash, Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum Integrator {
        /// Explicit, first order: for soft, coarse tubes with substeps below `Tube::longest_substep_s`; scene
        /// files with longer ones are refused.
        SymplecticEuler = "symplectic-euler",
        /// Compliant constraints, projected forth and back once per substep (MMC16): for comparison, as it bends too softly where substeps are
        /// longer than `Tube::longest_substep_s`.
        Xpbd = "xpbd",
        /// Linearly implicit Euler, usually one Newton step: stable at any step, exact at rest, damps fast motion.
        #[default]
        ImplicitEuler = "implicit-euler",
        /// Backward differences of second order, with little damping; implicit Euler while the tube is in contact or held.
        Bdf2 = "bdf2",
        /// Conserves energy and momentum of a tube without contact; implicit Euler while it is in contact or held.
        EnergyMomentum = "energy-momentum",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_tube_has_the_reference_stiffnesses() {
        // computed independently from the same radius, wall and modulus (tests/reference/cosserat_tube.json, case soft)
        let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
        let section = Section::hollow(0.015, 0.002, material);
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} is not {b}");
        close(section.ea_n, 175.929_188_601_028_45);
        close(section.ga_n, 58.498_621_825_465_13);
        close(section.ei_n_m2, 0.017_329_025_077_201_295);
        close(section.gj_n_m2, 0.011_951_051_777_380_206);
        close(section.mass_per_length_kg_m, 0.184_725_648_031_079_88);
    }
}
