//! What a soft body foretells of its next step: how it answers impulses in it, and how each vertex will accelerate.
//!
//! In: the substep that ended last, what touched the body in it and before. Out: A and a of a whole step for snapshots, and for
//! what it is given until it steps again. Never here: how long that step will be. Theory: docs/theory/soft.md, eq. 16a, 16i, 16j.

use super::body::SoftBody;
use super::contact::Contacts;
use glam::DVec3;
use metachron_contact::Presses;

/// A substep that is shorter than its step by less than this is all of it.
const WHOLE: f64 = 1.0 + 1e-9;

/// The step that a soft body foretells.
#[derive(Debug, Clone, Default)]
pub(super) struct Foretold {
    /// Its length, seconds: that of the last one.
    pub span_s: f64,
    /// How each vertex will accelerate in it without what others give, m/s²; empty where nobody wants to know.
    pub accelerations: Vec<DVec3>,
    /// The same where what it lies on carries it; empty where it lies on nothing.
    pub standing: Vec<DVec3>,
    /// The length of the last substep, seconds.
    last_s: f64,
    presses: Presses,
}

impl Foretold {
    /// Notes a substep of `h` seconds of a body of so many `vertices`.
    pub fn note(&mut self, contacts: &Contacts, vertices: usize, h: f64) {
        self.last_s = h;
        self.presses.note(contacts.impulses(), vertices, h);
    }
}

impl SoftBody {
    /// Works out what it foretells of a step of `dt` seconds, as long as the last one, where somebody wants to know (eq. 16a, 16i); how
    /// many substeps more that took.
    pub(super) fn foretell(&mut self, dt: f64) -> u32 {
        self.foretold.accelerations.clear();
        self.foretold.standing.clear();
        self.foretold.span_s = self.foretold.last_s;
        if !self.company.is_watched() {
            self.footing.stance.forget();
            return 0;
        }
        let divided = dt > self.foretold.last_s * WHOLE;
        self.footing.find(&self.contacts, &mut self.company);
        if divided {
            self.assemble(dt);
            self.system.factor();
            self.foretold.span_s = dt;
        }
        let Self { foretold, system, mesh, velocities, free: before, given, .. } = self;
        let mut momenta = std::mem::take(&mut foretold.accelerations);
        let (last_s, span_s) = (foretold.last_s, foretold.span_s);
        let damped = 1.0 + last_s * self.spec.matter.damping_per_s;
        let moves = velocities.iter().zip(&*before).zip(&mesh.mass_kg);
        momenta.extend(moves.map(|((now, before), mass)| (*now * damped - *before) * *mass));
        momenta.iter_mut().zip(&*given).for_each(|(momentum, given)| *momentum -= *given);
        momenta.iter_mut().zip(foretold.presses.blows()).for_each(|(momentum, blow)| *momentum -= blow * last_s);
        let still = velocities.iter().zip(&mesh.mass_kg).map(|(now, mass)| *now * *mass);
        momenta.iter_mut().zip(still).for_each(|(momentum, still)| *momentum = still + *momentum * (span_s / last_s));
        let lies = !self.footing.stance.is_empty();
        foretold.standing.extend(momenta.iter().filter(|_| lies));
        system.respond(&mut momenta);
        foretold.accelerations = momenta;
        if lies {
            self.footing.keep(self.system.answer());
            self.assemble(dt);
            self.footing.bear(&mut self.system);
            self.system.factor();
            self.system.respond(&mut self.foretold.standing);
        }
        for list in [&mut self.foretold.accelerations, &mut self.foretold.standing] {
            list.iter_mut().zip(&self.velocities).for_each(|(a, now)| *a = (*a - *now) / span_s);
        }
        u32::from(divided) + u32::from(lies)
    }
}
