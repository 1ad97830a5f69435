//! The tube as an agent: its step by itself, its states, another resolution.
//!
//! In: steps, pulls, motions and states that are set, requests for a resolution. Out: reports, snapshots ([`super::super::publish`]). Never
//! here: its step in a cluster ([`super::super::member`]).

use super::super::anchor_springs::Tie;
use super::super::discretization;
use super::super::remesh::MeshedRod;
use super::super::state::RodState;
use super::super::step::{Divergence, Setting, Stepper};
use super::{Tube, nearest_resolution};
use crate::set_motion::WholeMotion;
use glam::DVec3;
use metachron_contact::member::ClusterMember;
use metachron_contact::{Agent, Input, Inputs, SetMotion, StepContext};
use metachron_core::{
    Archive, ArchiveError, Body, Grip, Resolution, SimSpan, SimTime, Snapshot, StepError, StepReport, check_span,
};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

impl Tube {
    /// Repeats a step of `dt` seconds in twice `substeps`, if its turn has come.
    fn repeat_step(&mut self, dt: f64, substeps: u32) {
        if !self.doubling.is_on() {
            return;
        }
        let mut doubling = std::mem::take(&mut self.doubling);
        self.step_by(dt, |stepper, now, setting, _| doubling.end(stepper, now, &Setting { substeps, ..*setting }));
        self.doubling = doubling;
    }

    /// A step of the wall that nothing touches, after that of the centre line.
    fn step_wall(&mut self, dt_s: f64, then: SimTime) -> Result<(), Divergence> {
        self.follow_pressure(then);
        self.begin_wall(dt_s, then)?;
        let finite = self.wall.as_ref().is_none_or(|wall| wall.stays_finite(wall.free(), dt_s));
        if !finite {
            return Err(Divergence { slot: None });
        }
        self.end_wall(None, dt_s);
        self.present_velocities();
        Ok(())
    }

    fn record_grips(&mut self, dt: f64) {
        self.grips.clear();
        self.grips.extend(self.ties.iter().map(|tie| Grip { by: tie.by, force_n: tie.impulse / dt }));
    }

    /// Whether it is held somewhere, so that nothing puts it elsewhere.
    fn stays(&self) -> bool {
        self.matter.held.contains(&true) || !self.spec.attachments.is_empty()
    }

    /// Whether the tube is at rest after a step of `dt` seconds; it is then stopped exactly.
    fn update_rest(&mut self, dt: f64) -> bool {
        if !self.spec.sleep || self.changes_by_itself() || !self.ties.is_empty() {
            self.rest.wake();
            return false;
        }
        let at_rest = self.observe_rest(dt);
        if at_rest {
            self.doubling.rest();
            self.stop();
        }
        at_rest
    }
}

impl Agent for Tube {
    fn model(&self) -> &'static str {
        "tube"
    }

    /// Advances the tube by exactly `dt` (docs/theory/rod.md, eq. 11–28).
    ///
    /// pulls    the springs of the user and of tools on this tube
    /// step     substeps of its integrator (`Stepper::step`)
    /// doubling the error in time, estimated now and then
    /// grips    the mean force of each pull
    /// rest     whether it may sleep
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let dt_s = check_span(dt)?;
        self.check_substep(dt_s)?;
        self.ties.clear();
        self.ties.extend(context.anchor_springs().filter_map(|pull| Tie::new(&pull, &self.division)));
        let before = self.momentum().0;
        self.stepper.solves = 0;
        let begins = self.doubling.begins(self.steps, context.me);
        self.doubling.begin(begins, &self.now, &self.ties, &self.stepper);
        let taken = self.step_by(dt_s, Stepper::step);
        let substeps = taken.map_err(|divergence| self.diverged(divergence, dt_s))?;
        self.repeat_step(dt_s, substeps);
        self.record_grips(dt_s);
        self.step_wall(dt_s, context.time + dt).map_err(|divergence| self.diverged(divergence, dt_s))?;
        self.acceleration = (self.momentum().0 - before) / (self.mass_kg() * dt_s);
        self.time = context.time + dt;
        self.steps += 1;
        self.at_rest = self.update_rest(dt_s);
        let work = self.segments() as f64 * f64::from(self.stepper.solves);
        Ok(StepReport { work, substeps, at_rest: self.at_rest })
    }

    fn shift_clock(&mut self, by_s: f64) {
        self.script_from_s += by_s;
    }

    fn inputs(&self) -> Inputs {
        use Input::{Force, Place, Pressure, Resolution, Spring, State, Torque, Velocity};
        let all = Inputs::of(&[Spring, Force, Torque, Place, Velocity, State, Pressure, Resolution]);
        all.with(Place, !self.stays())
    }

    fn set_pressure_pa(&mut self, pressure_pa: f64) -> bool {
        Self::set_pressure_pa(self, pressure_pa).is_ok()
    }

    /// A tube of which an end or a part is held stays where it is, and takes velocities.
    fn set_motion(&mut self, set: &SetMotion) -> bool {
        let stays = self.stays();
        let Self { now, matter, division, .. } = self;
        let whole = WholeMotion::new(set, division.node_lengths_m().zip(now.x.iter().copied()));
        if whole.shifts() && stays {
            return false;
        }
        let count = now.q.len();
        now.x.iter_mut().for_each(|x| *x = whole.place(*x));
        now.q.iter_mut().for_each(|q| *q = (whole.turn() * *q).normalize());
        for (slot, u) in now.u.iter_mut().enumerate() {
            let part = slot / 2;
            let end = if part == 0 { 0 } else { 1 };
            let is_end = if slot % 2 == 0 { part == 0 || part == count } else { part == 0 || part + 1 == count };
            *u = match slot % 2 {
                0 if is_end && matter.held[end] => DVec3::ZERO,
                0 => whole.velocity(now.x[part], *u),
                _ if is_end && matter.clamp[end] => DVec3::ZERO,
                _ => whole.spin(*u),
            };
        }
        now.strain(matter, division);
        self.begin_anew();
        true
    }

    fn set_state(&mut self, state: &Body) -> Result<(), String> {
        let Body::Curve(curve) = state else { return Err("a tube has the state of a curve".to_owned()) };
        self.take_curve(curve)
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(self.resolution)
    }

    fn set_resolution(&mut self, wanted: Resolution) {
        let wanted = self.spec.range.clamp(wanted);
        let (fine, coarse) = self.spec.range.eps_m;
        self.resolution.n = wanted.n;
        if fine == coarse {
            return; // a fixed spacing: the scene sets the division
        }
        let count = discretization::segments_for(&self.skeleton, wanted.eps_m);
        self.resolution = nearest_resolution(wanted, &self.skeleton, count);
        if count == self.segments() {
            return;
        }
        let old = self.division.clone();
        let arcs = self.remesher.arcs(&self.now, &old, count);
        self.division.rebuild(&self.skeleton, arcs);
        let mut next = RodState::default();
        let old = MeshedRod { state: &self.now, division: &old };
        self.remesher.transfer(&self.matter, old, &mut next, &self.division);
        if let Some(wall) = &mut self.wall {
            wall.transfer(old.division, &self.division);
            wall.soften(&mut next.softening);
        }
        next.strain(&self.matter, &self.division);
        self.now = next;
        self.lay_out_springs();
        self.begin_anew();
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        self.publish(into);
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.archive_state(archive)
    }

    fn member(&mut self) -> Option<&mut dyn ClusterMember> {
        Some(self)
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        self.now.momentum(&self.matter, &self.division)
    }

    fn mass_kg(&self) -> f64 {
        self.matter.mu * self.length_m()
    }
}
