//! The tube as an agent: its states, another resolution.
//!
//! In: motions and states that are set, requests for a resolution. Out: snapshots ([`super::super::publish`]). Never here: its steps
//! ([`super::super::member`]).

use super::super::discretization;
use super::super::remesh::MeshedRod;
use super::super::state::RodState;
use super::{Tube, nearest_resolution};
use crate::set_motion::WholeMotion;
use glam::DVec3;
use metachron_contact::{Agent, Input, Inputs, SetMotion, Stepping};
use metachron_core::{Archive, ArchiveError, Body, Resolution, Snapshot};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

impl Tube {
    /// Whether it is held somewhere, so that nothing puts it elsewhere.
    fn stays(&self) -> bool {
        self.material.held.contains(&true) || !self.spec.attachments.is_empty()
    }
}

impl Agent for Tube {
    fn model(&self) -> &'static str {
        "tube"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
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
        let Self { now, material, division, .. } = self;
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
                0 if is_end && material.held[end] => DVec3::ZERO,
                0 => whole.velocity(now.x[part], *u),
                _ if is_end && material.clamp[end] => DVec3::ZERO,
                _ => whole.spin(*u),
            };
        }
        now.strain(material, division);
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
        self.remesher.transfer(&self.material, old, &mut next, &self.division);
        if let Some(wall) = &mut self.wall {
            wall.transfer(old.division, &self.division);
            wall.soften(&mut next.softening);
        }
        next.strain(&self.material, &self.division);
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

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        self.now.momentum(&self.material, &self.division)
    }

    fn mass_kg(&self) -> f64 {
        self.material.mu * self.length_m()
    }
}
