//! One substep of a soft body: linearly implicit Euler, contacts between solve and move.
//!
//! In: a state and its step context. Out: the state a substep later. Never here: snapshots, rest. Theory: docs/theory/soft.md.

use super::body::SoftBody;
use super::contact::Substep;
use glam::{DMat3, DVec3};
use metachron_contact::StepContext;
use metachron_core::StepError;
use metachron_core::foot::press;

/// No edge may turn or stretch in a substep by more than this share of its length: past it the linear forces are far off.
pub(super) const EDGE_CHANGE_MAX: f64 = 0.3;
/// The largest coordinate or speed accepted, metres or m/s: its square would soon overflow.
pub(super) const REACH_MAX: f64 = 1e9;
/// The most substeps of a step.
pub(super) const SUBSTEPS_MAX: u32 = 16;

impl SoftBody {
    /// Advances by `dt` seconds; returns the number of substeps, and how many more its error estimate took.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the state stops being finite.
    pub(super) fn advance(&mut self, context: &StepContext<'_>, dt: f64) -> Result<(u32, u32), StepError> {
        self.receive(context, dt)?;
        let doubled = self.repeat_step(context.me, dt);
        let (mut parts, mut left, mut done) = (1_u32, 1_u32, 0_u32);
        while left > 0 {
            let h = dt / f64::from(parts);
            self.predict(h).map_err(|what| self.diverged(what, dt))?;
            self.solve_contacts(h);
            if self.mesh.edge_change(|vertex| self.free[vertex as usize], h) > EDGE_CHANGE_MAX && parts < SUBSTEPS_MAX {
                (parts, left) = (2 * parts, 2 * left);
                self.given.iter_mut().for_each(|given| *given *= 0.5); // the impulse acts evenly through the step
                continue;
            }
            if !self.free.iter().all(|v| v.is_finite() && v.abs().max_element() <= REACH_MAX) {
                return Err(self.diverged("a vertex left the coordinate range", dt));
            }
            self.finish_substep(f64::from(parts - left) * h, h);
            (left, done) = (left - 1, done + 1);
        }
        self.estimate_error(dt, done);
        Ok((done, doubled))
    }

    /// Solves for the velocities at the end of a substep of `h` seconds without contact (eq. 1–4).
    pub(super) fn predict(&mut self, h: f64) -> Result<(), &'static str> {
        self.assemble(h);
        if !self.system.factor() {
            return Err("the stiffness matrix is not positive definite");
        }
        let Self { system, mesh, velocities, free, given, ties, company, .. } = self;
        free.clear();
        let momenta = velocities.iter().zip(&mesh.mass_kg).map(|(v, mass)| *v * *mass);
        free.extend(momenta.zip(&system.forces).map(|(momentum, force)| momentum + *force * h));
        free.iter_mut().zip(&*given).for_each(|(momentum, given)| *momentum += *given);
        system.respond(free);
        company.share(ties, free, system);
        Ok(())
    }

    /// Assembles the system of a substep of `h` seconds at the present positions.
    pub(super) fn assemble(&mut self, h: f64) {
        let Self { system, mesh, positions, spec, ties, company, contacts, .. } = self;
        company.aim(ties, positions, h);
        system.begin(h);
        mesh.add(positions, system);
        let inertia = 1.0 + h * spec.matter.damping_per_s;
        for (vertex, &mass) in mesh.mass_kg.iter().enumerate() {
            system.weigh(vertex, DMat3::from_diagonal(DVec3::splat(mass * inertia)));
            system.push(vertex as u32, spec.gravity * mass);
        }
        ties.iter_mut().for_each(|tie| tie.add(positions[tie.vertex], h, system));
        contacts.mobilities.clear();
        contacts.mobilities.extend((0..positions.len()).map(|vertex| system.mobility(vertex)));
    }

    /// Applies contact to the predicted velocities.
    pub(super) fn solve_contacts(&mut self, h: f64) {
        let Self { system, positions, free, company, contacts, .. } = self;
        contacts.solve(Substep { positions, h_s: h }, free, system, company);
    }

    /// Moves with the predicted velocities, and gives the peers their impulses.
    fn finish_substep(&mut self, start: f64, h: f64) {
        let Self { positions, velocities, free, ties, company, contacts, foretold, .. } = self;
        std::mem::swap(velocities, free);
        positions.iter_mut().zip(&*velocities).for_each(|(x, v)| *x += *v * h);
        ties.iter_mut().for_each(|tie| tie.book(velocities[tie.vertex], h));
        company.accept(contacts.impulses(), ties, (positions.len(), start, h));
        foretold.note(contacts, positions.len(), h);
    }

    /// Applies the impulses of peers since the last step, and collects the neighbours.
    fn receive(&mut self, context: &StepContext<'_>, dt: f64) -> Result<(), StepError> {
        let Self { system, positions, velocities, given, company, foretold, footing, .. } = self;
        given.clear();
        company.open(context, positions.len(), dt);
        if let Some([sums, carried]) = company.received() {
            // impulses that acted through the step before are applied as that step would have; the rest acts through this one (eq. 16b)
            let borne = footing.stance.bears(sums.iter().sum());
            let answer = footing.under(borne, system.answer());
            given.extend_from_slice(sums);
            for (sum, (given, moment)) in sums.iter_mut().zip(given.iter_mut().zip(&*carried)) {
                let past = moment.dot(*sum) / (foretold.span_s * sum.length_squared()).max(f64::MIN_POSITIVE);
                *sum *= past.clamp(0.0, 1.0);
                *given -= *sum;
            }
            answer.respond_at(sums);
            if borne {
                press(footing.stance.on_others(), sums, given);
            }
            answer.respond_at(carried);
            velocities.iter_mut().zip(&*sums).for_each(|(v, dv)| *v += *dv);
            positions.iter_mut().zip(&*carried).for_each(|(x, dx)| *x += *dx);
        }
        self.gather_springs(context);
        let bounds = self.bounds();
        self.company.gather(context, &bounds, (dt, self.spec.friction));
        Ok(())
    }

    pub(super) fn diverged(&self, what: &str, dt_s: f64) -> StepError {
        StepError::Diverged { model: self.spec.shape.model(), dt_s, what: what.to_owned() }
    }
}
