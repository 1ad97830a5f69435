//! The time integrators of a tube, all of them on the same staggered rod.
//!
//! In: a name, a material and a division. Out: the method, and the longest substep it allows. Never here: its
//! steps ([`super::step`]). Theory: docs/theory/rod.md, 3 and 13.

use super::discretization::Discretization;
use super::spec::Integrator;
use super::state::RodMaterial;
use super::tube::Tube;

/// Share by which bending may be too soft because of substep length (XPBD).
const SOFTER: f64 = 0.1;
/// The bend stiffness that one projection forth and back reaches, in ρI l²/h²: measured at 16 and 32 segments, 0.81 and 0.80.
const PROJECTED: f64 = 0.8;

impl Integrator {
    /// The longest substep for a valid result while nothing is stretched, seconds; `None` where any length
    /// is allowed (eq. 38, 39).
    pub(super) fn longest_substep_s(self, material: &RodMaterial, division: &Discretization) -> Option<f64> {
        match self {
            Self::SymplecticEuler => Some(2.0 / fastest_rad_s(material, division)),
            Self::Xpbd => {
                let finest = division.length.iter().copied().fold(f64::INFINITY, f64::min);
                let slow = material.rotary / material.ei.max(0.5 * material.gj);
                Some(finest * libm::sqrt(SOFTER * PROJECTED * slow))
            }
            Self::ImplicitEuler | Self::Bdf2 | Self::EnergyMomentum => None,
        }
    }
}

impl Tube {
    /// The longest substep for a valid result with the present division, seconds; `None` where the
    /// integrator takes any: below it `symplectic-euler` is stable and `xpbd` bends less than a tenth too softly.
    ///
    /// A stretched tube needs shorter ones: it halves its substeps by itself.
    #[must_use]
    pub fn longest_substep_s(&self) -> Option<f64> {
        self.spec.integrator.longest_substep_s(&self.material, &self.division)
    }

    /// Whether the substeps of a step of `dt_s` seconds are short enough for the integrator.
    pub(super) fn substep_is_short(&self, dt_s: f64) -> bool {
        self.longest_substep_s().is_none_or(|limit_s| dt_s / f64::from(self.spec.substeps) <= limit_s)
    }
}

/// An upper bound of every frequency of the divided tube at rest, rad/s: the frequency of a single segment bounds stretch and shear,
/// the greatest row sum bounds bend and twist, and both together bound their sum (eq. 38).
fn fastest_rad_s(material: &RodMaterial, division: &Discretization) -> f64 {
    let RodMaterial { ea, ga, ei, gj, mu, rotary, clamp, .. } = *material;
    let count = division.segments();
    let bend = ei.max(0.5 * gj);
    let square = |k: usize| {
        let l = division.length[k];
        let ends = 12.0 / (mu * l * l);
        let stretch = (ea * ends).max(ga * (ends + 1.0 / rotary));
        // an inner joint counts twice, for its own row and the adjacent one; a wall does not move
        let joint = |j: usize, wall: bool| if j > 0 && j < count { 2.0 } else { f64::from(u8::from(wall)) };
        let joints = joint(k, clamp[0]) * division.joint[k] + joint(k + 1, clamp[1]) * division.joint[k + 1];
        stretch + bend * joints / (rotary * l)
    };
    libm::sqrt((0..count).map(square).fold(0.0, f64::max))
}
