//! A tube's wall and its centre line: how each acts on the other in a step.
//!
//! In: a tube with the centre line of the step's end, impulses on the wall. Out: the sections then, and the bend they leave.
//! Each moves with the other's coordinates held, so neither makes energy; energy lost between the two is taken back (eq. 66).
//! Never here: how a wall is made ([`super::law`]), contacts. Theory: docs/theory/rod.md, section 15.

use super::{Drive, Filling, WallProblem};
use crate::limits::QUIET_SPEED_M_S;
use crate::rod::step::Divergence;
use crate::rod::tube::Tube;
use glam::DVec3;
use metachron_core::SimTime;

/// How much of its way a wall goes, the first of these that makes no energy; the last makes none.
const SHARES: [f64; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.0];
/// A rise of energy below this share of the energies involved is rounding.
const ENERGY_SLACK: f64 = 1e-9;

impl Tube {
    /// Its filling.
    pub(in crate::rod) fn filling(&self) -> Filling {
        Filling { pressure_pa: self.spec.pressure_pa, sealed: self.spec.sealed }
    }

    /// Prepares the wall for a step of `h_s` seconds that ends at `then`, with the curvature of the present centre line (eq. 65).
    pub(in crate::rod) fn begin_wall(&mut self, h_s: f64, then: SimTime) -> Result<(), Divergence> {
        let Some(mut wall) = self.wall.take() else { return Ok(()) };
        let radius_m = wall.law.outer_m;
        let mut squeeze_m = std::mem::take(&mut self.squeeze_m);
        squeeze_m.clear();
        squeeze_m.extend(self.division.arc_m.iter().map(|&arc_m| radius_m * self.contraction_at(arc_m, then)));
        let begun = wall.begin(&WallProblem {
            division: &self.division,
            drive: Drive { filling: self.filling(), squeeze_m: &squeeze_m },
            curvature: &self.now.curvature,
            damping_per_s: self.material.damping,
            h_s,
        });
        (self.squeeze_m, self.wall) = (squeeze_m, Some(wall));
        begun
    }

    /// Moves the wall at `rates` for the `h_s` seconds begun, as far as that makes no energy (eq. 66).
    pub(in crate::rod) fn end_wall(&mut self, rates: &[DVec3], h_s: f64) {
        let filling = self.filling();
        let Self { wall, now, material, division, squeeze_m, .. } = self;
        let Some(wall) = wall else { return };
        let work_j = wall.work_j(rates);
        let before = [now.elastic_j, wall.energy_j(division, filling), wall.muscle_j(division, squeeze_m)];
        let rounding_j = wall.rounding_j(division, filling);
        wall.keep();
        for share in SHARES {
            wall.advance(rates, share, h_s);
            wall.soften(&mut now.softening);
            now.strain(material, division);
            let after = [now.elastic_j, wall.energy_j(division, filling), wall.muscle_j(division, squeeze_m)];
            let work_j = share * work_j;
            let at_work: f64 = before.iter().chain(&after).map(|part| part.abs()).sum::<f64>() + work_j.abs();
            let rise_j =
                after.iter().sum::<f64>() - before.iter().sum::<f64>() - work_j - ENERGY_SLACK * at_work - rounding_j;
            // its motion gives back the energy that it can
            if rise_j <= 0.0 || wall.slow(rise_j, division) {
                return;
            }
        }
    }

    /// Whether the wall would be finite after `h_s` seconds at these rates.
    pub(in crate::rod) fn wall_stays_finite(&self, rates: &[DVec3], h_s: f64) -> bool {
        self.wall.as_ref().is_none_or(|wall| wall.stays_finite(rates, h_s))
    }

    /// Whether no section moves fast enough to be seen.
    pub(in crate::rod) fn has_quiet_wall(&self) -> bool {
        self.wall.as_ref().is_none_or(|wall| wall.fastest_m_s() <= QUIET_SPEED_M_S)
    }
}
