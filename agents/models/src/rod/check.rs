//! Validates a tube's specification; each error carries the value that is wrong.

use super::{Integrator, TubeSpec, WallModel};
use glam::DVec3;
use metachron_core::OutOfRange;

/// Why a tube cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TubeError {
    /// The path has fewer than two points.
    #[error("the tube's path has {count} points; expected at least 2")]
    ShortPath {
        /// Number of points.
        count: usize,
    },
    /// A point of the path is not finite, or the same as the one before it.
    #[error(
        "point {index} of the tube's path is {point}; expected finite coordinates that differ from the point before"
    )]
    BadPoint {
        /// Index of the point, from 0.
        index: usize,
        /// Its value, metres.
        point: DVec3,
    },
    /// The path turns back on itself.
    #[error("the tube's path turns by {degrees:.0}° at point {index}; expected at most 170°")]
    Cusp {
        /// Index of the point, from 0.
        index: usize,
        /// Angle of the turn, degrees.
        degrees: f64,
    },
    /// The integrator has no steps for a wall that gives.
    #[error(
        "the tube's integrator is {integrator}, whose steps take the bend stiffness as constant; a wall that gives needs an implicit one"
    )]
    StiffWall {
        /// Name of the integrator.
        integrator: &'static str,
    },
    /// A number is outside its range.
    #[error("the tube's {0}")]
    OutOfRange(#[from] OutOfRange),
}

/// The sharpest turn between two chords of a path, radians: past it the smooth curve is almost a cusp.
const TURN_MAX_RAD: f64 = 170.0 * std::f64::consts::PI / 180.0;
/// The largest twist of a whole tube, radians: some 15° per segment at the highest number of segments.
const TWIST_MAX_RAD: f64 = 1000.0;
/// Points nearer than this share of the path's extent are the same point.
const SAME_POINT: f64 = 1e-9;

impl TubeSpec {
    /// Whether a tube can be built of it.
    ///
    /// # Errors
    /// [`TubeError`].
    pub fn check(&self) -> Result<(), TubeError> {
        check_path(&self.path_m)?;
        check_section(self)?;
        check_numbers(self)?;
        check_wall(self)?;
        check_attachments(self)
    }
}

fn check_path(path: &[DVec3]) -> Result<(), TubeError> {
    if path.len() < 2 {
        return Err(TubeError::ShortPath { count: path.len() });
    }
    let extent: f64 = path.windows(2).map(|p| (p[1] - p[0]).length()).fold(0.0, f64::max);
    for (index, &point) in path.iter().enumerate() {
        let repeats = index > 0 && (point - path[index - 1]).length() <= SAME_POINT * extent;
        if !point.is_finite() || repeats {
            return Err(TubeError::BadPoint { index, point });
        }
    }
    for (i, p) in path.windows(3).enumerate() {
        let (a, b) = (p[1] - p[0], p[2] - p[1]);
        let turn = libm::atan2(a.cross(b).length(), a.dot(b));
        if turn > TURN_MAX_RAD {
            return Err(TubeError::Cusp { index: i + 1, degrees: turn.to_degrees() });
        }
    }
    Ok(())
}

/// A number that must be finite and satisfy `ok`.
fn number(name: &'static str, value: f64, ok: bool, range: &str) -> Result<(), TubeError> {
    Ok(OutOfRange::unless(value.is_finite() && ok, name, value, range)?)
}

fn positive(name: &'static str, value: f64) -> Result<(), TubeError> {
    number(name, value, value > 0.0, "finite and above zero")
}

fn not_negative(name: &'static str, value: f64) -> Result<(), TubeError> {
    number(name, value, value >= 0.0, "finite and not below zero")
}

fn check_section(spec: &TubeSpec) -> Result<(), TubeError> {
    let s = &spec.section;
    positive("radius_m", s.radius_m)?;
    number("wall_m", s.wall_m, s.wall_m > 0.0 && s.wall_m <= s.radius_m, "above zero and at most the radius")?;
    positive("young_pa", s.young_pa)?;
    number("poisson", s.poisson, s.poisson > -1.0 && s.poisson <= 0.5, "above -1 and at most 0.5")?;
    positive("ea_n", s.ea_n)?;
    positive("ga_n", s.ga_n)?;
    positive("ei_n_m2", s.ei_n_m2)?;
    positive("gj_n_m2", s.gj_n_m2)?;
    positive("rotary_kg_m", s.rotary_kg_m)?;
    positive("mass_per_length_kg_m", s.mass_per_length_kg_m)
}

fn check_numbers(spec: &TubeSpec) -> Result<(), TubeError> {
    let (fine, coarse) = spec.range.eps_m;
    positive("eps_m", spec.resolution.eps_m)?;
    positive("finest eps_m", fine)?;
    number("coarsest eps_m", coarse, coarse >= fine, "finite and at least the finest")?;
    if let Some(count) = spec.segments {
        let ok = (crate::rod::SEGMENTS_MIN..=crate::rod::SEGMENTS_MAX).contains(&count);
        number("segments", count as f64, ok, "2 to 4096")?;
    }
    let substeps = f64::from(spec.substeps);
    number("substeps", substeps, (1..=super::SUBSTEPS_MAX).contains(&spec.substeps), "1 to 1000")?;
    number("twist_rad", spec.twist_rad, spec.twist_rad.abs() <= TWIST_MAX_RAD, "-1000 to 1000")?;
    not_negative("damping_per_s", spec.damping_per_s)?;
    check_pressures(spec)?;
    not_negative("friction", spec.friction)?;
    number("gravity", spec.gravity.length(), true, "finite")?;
    if let Some(wave) = spec.peristalsis {
        let ok = (0.0..1.0).contains(&wave.amplitude);
        number("peristalsis.amplitude", wave.amplitude, ok, "at least 0 and below 1")?;
        positive("peristalsis.wavelength_m", wave.wavelength_m)?;
        number("peristalsis.speed_m_s", wave.speed_m_s, true, "finite")?;
    }
    Ok(())
}

/// Every pressure leaves the tube a radius, and a sealed one some gas; keys follow each other.
fn check_pressures(spec: &TubeSpec) -> Result<(), TubeError> {
    let keys = &spec.pressure_keys;
    for pressure_pa in keys.iter().map(|key| key.pressure_pa).chain([spec.pressure_pa]) {
        number("pressure_pa", pressure_pa, true, "finite")?;
        let widened = crate::rod::pressed_radius_m(&spec.section, pressure_pa);
        number("pressure_pa", pressure_pa, widened > 0.0, "such that the radius stays above zero")?;
        let has_gas = !spec.sealed || pressure_pa > -super::wall::AIR_PA;
        number("pressure_pa", pressure_pa, has_gas, "above -101325 in a sealed tube")?;
    }
    let first_s = keys.first().map_or(0.0, |key| key.at_s);
    number("pressure_keys.at_s", first_s, first_s >= 0.0, "at least 0")?;
    keys.windows(2).try_for_each(|two| {
        let rises = two[1].at_s > two[0].at_s;
        number("pressure_keys.at_s", two[1].at_s, rises, "above that of the key before")
    })
}

/// A wall that gives changes the stiffness of its bend: methods that need it before a step do not take one.
fn check_wall(spec: &TubeSpec) -> Result<(), TubeError> {
    let gives = spec.wall == WallModel::Gives;
    if gives && matches!(spec.integrator, Integrator::SymplecticEuler | Integrator::Xpbd) {
        return Err(TubeError::StiffWall { integrator: spec.integrator.name() });
    }
    if !spec.sealed {
        return Ok(());
    }
    let inner_m = if gives { spec.section.radius_m - spec.section.wall_m } else { 0.0 };
    number("inner radius", inner_m, inner_m > 0.0, "above zero, in a wall that gives, where it is sealed")
}

fn check_attachments(spec: &TubeSpec) -> Result<(), TubeError> {
    for a in &spec.attachments {
        number("attachment.from", a.from, a.from >= 0.0 && a.from < a.to, "at least 0 and below attachment.to")?;
        number("attachment.to", a.to, a.to <= 1.0, "at most 1")?;
        not_negative("attachment.stiffness_n_m2", a.stiffness_n_m2)?;
        not_negative("attachment.slack_m", a.slack_m)?;
        not_negative("attachment.damping_n_s_m2", a.damping_n_s_m2)?;
        // infinite is never
        if a.tears_above_n != f64::INFINITY {
            positive("attachment.tears_above_n", a.tears_above_n)?;
        }
        if a.yields_above_n != f64::INFINITY {
            let fair = a.yields_above_n > 0.0 && a.yields_above_n < a.tears_above_n;
            number("attachment.yields_above_n", a.yields_above_n, fair, "above zero and below the tearing force")?;
        }
    }
    Ok(())
}
