//! The beginning of a tube's step: received impulses, neighbours, pulls.
//!
//! In: its surroundings. Out: the tube with everything received, its peers and its ties. Never here: the step itself
//! ([`super::step`]), contacts ([`super::company`]). Theory: docs/theory/rod.md, eq. 24, 35–37.

use super::anchor_springs::Tie;
use super::publish::bounds;
use super::sided::{Now, is_sided};
use super::step::Divergence;
use super::tube::Tube;
use metachron_contact::StepContext;
use metachron_contact::{Law, Link};
use metachron_core::{SimSpan, StepError};

impl Tube {
    /// Lists this step's pulls, each of them exactly once.
    pub(super) fn take_pulls(&mut self, context: &StepContext<'_>) {
        std::mem::swap(&mut self.ties, &mut self.ties_before);
        self.ties.clear();
        self.ties.extend(context.anchor_springs().filter_map(|pull| Tie::new(&pull, &self.division)));
        let owned = |link: &&Link| context.neighbours.iter().any(|n| n.id == link.other && n.owned);
        let links = context.links.iter().filter(|link| link.law == Law::Cluster).filter(owned);
        self.ties.extend(links.filter_map(|link| Tie::of_link(link, &self.division)));
        self.ties.iter_mut().for_each(|tie| tie.continue_from(&self.ties_before));
    }

    /// Applies what others gave since the last step, and collects the neighbours in reach.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the impulses received cannot be applied.
    pub(super) fn receive(&mut self, context: &StepContext<'_>, dt: SimSpan) -> Result<(), StepError> {
        let dt_s = dt.as_secs_f64();
        self.dt_s = dt_s;
        self.stepper.company.open(context, &self.division, context.time + dt);
        if self.ahead_s > 0.0 && !self.stepper.company.received().is_empty() {
            // matches the predicted step that was published to the givers
            self.stepper.company.received().defer(dt_s / f64::from(self.spec.substeps));
        }
        // a displacement of more than a radius could put a tube on the far side of a wall
        let way_m = if self.spec.obstacles.is_empty() { f64::INFINITY } else { self.spec.section.radius_m };
        if context.neighbours.iter().any(|neighbour| is_sided(neighbour, context)) {
            self.act_on_itself(context, dt_s).map_err(|divergence| self.diverged(divergence, dt_s))?;
        }
        let taken = self.step_by(dt_s, |stepper, now, setting, ties| stepper.receive(now, setting, ties, way_m));
        taken.map_err(|divergence| self.diverged(divergence, dt_s))?;
        if context.neighbours.iter().any(|n| n.form.is_some() || n.owned) {
            let bounds = bounds(&self.now, self.widest_m());
            self.stepper.company.gather(context, &bounds, dt_s);
        } else {
            self.stepper.company.dismiss();
        }
        Ok(())
    }

    /// Adds the forces of pair laws that need no ledger to the impulses that the tube receives.
    fn act_on_itself(&mut self, context: &StepContext<'_>, dt: f64) -> Result<(), Divergence> {
        self.step_by(dt, |stepper, now, setting, _| stepper.prepare(now, setting))?;
        let mut company = std::mem::take(&mut self.stepper.company);
        let mut radii_m = std::mem::take(&mut company.sided().radii_m);
        radii_m.clear();
        radii_m.extend(self.division.arc_m.iter().map(|&s| self.radius_at_time_m(s, context.time)));
        let Self { stepper, now, division, spec, .. } = self;
        let start = Now {
            division,
            positions: &now.x,
            slots: &now.u,
            radii_m: &radii_m,
            factor: stepper.factor(),
            dt,
            gravity: spec.gravity,
        };
        company.act_on_itself(context, &start);
        company.sided().radii_m = radii_m;
        stepper.company = company;
        Ok(())
    }
}
