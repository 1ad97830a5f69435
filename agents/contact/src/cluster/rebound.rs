//! Which contacts may not rebound as they would: those by which a blow would make energy.
//!
//! In: an answer with all rebounds. Out: rows without theirs. Never here: when a contact rebounds, solving.
//! Theory: `docs/theory/clusters.md`, section 5.

use super::cone::Law;
use super::iterate::Iterate;
use super::rows::{Point, Row};
use glam::DVec3;

/// By how many tolerances of a law the mean velocity of a blow may be off: what is heavy moves what is light by some of its own.
const SLACK: f64 = 10.0;

/// Takes back the rebound of each contact that does work, or of all where none does by itself but all contacts and joints together
/// do. Returns how many; none once the answer is passive. Without rebounds every answer is.
pub(super) fn refuse(iterate: &mut Iterate, tolerance_m_s: f64) -> usize {
    if iterate.rows.rows.iter().all(|row| row.calm.is_none()) {
        return 0;
    }
    let slack = |at: Point| SLACK * tolerance_m_s * at.impulse.length();
    let (mut refused, mut work, mut most) = (0, 0.0, 0.0);
    for (k, row) in iterate.rows.rows.iter_mut().enumerate() {
        let at = iterate.state.point(k);
        let own = row.calm_work_j(at);
        work += own;
        most += slack(at);
        if row.calm.is_some() && own > slack(at) {
            row.calm_down();
            refused += 1;
        }
    }
    if refused == 0 && work > most {
        let rebounding = iterate.rows.rows.iter_mut().filter(|row| row.calm.is_some());
        rebounding.for_each(|row| {
            row.calm_down();
            refused += 1;
        });
    }
    refused
}

impl Row {
    /// λ·(û + u)/2: the energy that the row gives, J. Push-out, slip owed and targets are part of both velocities, so that what they
    /// give is not counted; rebounds and gaps are not.
    fn calm_work_j(&self, at: Point) -> f64 {
        let counted = self.calm.unwrap_or(self.bias.x);
        let counted = if matches!(self.law, Law::Coulomb { .. }) { counted.min(0.0) } else { counted };
        let less = DVec3::X * (self.bias.x - counted);
        at.impulse.dot(self.free + at.velocity - less * 2.0) * 0.5
    }
}
