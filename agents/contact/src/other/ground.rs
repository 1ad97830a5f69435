//! What another body stands on: it carries the body, and it cannot hold it down.
//!
//! In: how the body stands, and what impulses are expected to have lifted it by. Out: how it falls back. Never here: pushes
//! towards the ground, which the body does not feel ([`Other::respond`]). Theory: docs/theory/coupling.md, eq. 7f.

use super::Other;
use crate::Neighbour;
use glam::DVec3;
use metachron_core::foot::is_borne;
use metachron_core::{Foot, Impulse};
use metachron_core::{Inertia, Stand, Tips};

/// Who is expected higher than this above what it stands on is off it, metres.
pub(super) const LIFTED_M: f64 = 1e-4;

/// How a body that was lifted off the ground moves along its normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fall {
    pub normal: DVec3,
    /// How fast it rises at first, m/s, and how much faster at the end.
    pub speed_m_s: f64,
    pub gain_m_s: f64,
    /// How far it rises, metres.
    pub way_m: f64,
}

impl Other {
    /// How it falls in the next `h` seconds: `None` where it was not lifted off what it stands on, and where it stands on
    /// nothing. Back on the ground it stays there.
    pub(super) fn fall(&self, h: f64) -> Option<Fall> {
        let (height_m, Stand { normal, weight_m_s2, .. }) = (self.height_m?, self.footing()?);
        let speed_m_s = self.velocities[0].dot(normal);
        if h <= 0.0 {
            return None;
        }
        let way_m = speed_m_s * h - 0.5 * weight_m_s2 * h * h;
        let lands = height_m + way_m <= 0.0;
        let (way_m, gain_m_s) = if lands { (-height_m, -speed_m_s) } else { (way_m, -weight_m_s2 * h) };
        Some(Fall { normal, speed_m_s, gain_m_s, way_m })
    }

    /// Corrects a motion of `h` seconds without weight by it.
    pub(super) fn settle(&mut self, fall: &Fall, h: f64) {
        self.pose.centre += fall.normal * (fall.way_m - fall.speed_m_s * h);
        self.velocities[0] += fall.normal * fall.gain_m_s;
        self.height_m = self.height_m.map(|height_m| height_m + fall.way_m).filter(|height_m| *height_m > 0.0);
    }

    /// An impulse has changed its velocity: it is lifted where that leads off the ground.
    pub(super) fn leave(&mut self, change: DVec3) {
        if self.footing().is_some_and(|stand| change.dot(stand.normal) > 0.0) {
            self.height_m.get_or_insert(0.0);
        }
    }

    /// What is on its way has carried it so far, kg·m: it is in the air where that leads off the ground, however it then moves.
    pub(super) fn carry_off(&mut self, carried: DVec3) {
        let Some(Inertia::Rigid { inverse_mass, .. }) = self.neighbour.as_ref().map(|n| &n.snapshot.inertia) else {
            return;
        };
        let height_m = self.footing().map_or(0.0, |stand| carried.dot(stand.normal) * *inverse_mass);
        if height_m > LIFTED_M {
            self.height_m = Some(height_m);
        }
    }

    /// What is left of a change of velocity and of the way that it has carried the body where both lift it off the ground.
    pub(super) fn rise(&mut self, all: [DVec3; 2]) -> [DVec3; 2] {
        let Some(stand) = self.footing() else { return all };
        let since_s = all[1].length() / all[0].length().max(f64::MIN_POSITIVE);
        let left = stand.lifted(all, since_s);
        self.leave(left[0]);
        self.height_m = self.height_m.map(|_| left[1].dot(stand.normal).max(0.0));
        left
    }

    /// By how much faster than it is to move in the mean of the next `h` seconds a push along `normal` from it has to part it
    /// from the ground that it stands on, m/s: its weight is on who lifts it.
    #[must_use]
    pub fn lift_m_s(&self, normal: DVec3, h: f64) -> f64 {
        let stand = self.footing().filter(|_| self.fall(h).is_none());
        stand.map_or(0.0, |stand| 0.5 * h * stand.weight_m_s2 * (-normal.dot(stand.normal)).max(0.0))
    }

    /// Takes in whom it touches by their pushes, a direction each: whether what it lies on bears them, where it bends (eq. 7k). One that is
    /// to be lifted off that answers as if it lay on nothing.
    pub fn bear(&mut self, pushes: impl Iterator<Item = DVec3>) {
        let mut pushes = pushes.peekable();
        if pushes.peek().is_some() && self.lies() {
            self.borne = is_borne(self.feet(), pushes.sum());
        }
    }

    /// Whether something fixed carries it: what bends as it lies there or is held, a rigid body as it stands there.
    pub fn is_carried(&self) -> bool {
        if !self.is_many() {
            return self.lying.is_none() && self.grounded().is_some();
        }
        (self.borne && self.lies()) || self.form().is_some_and(|form| form.is_held())
    }

    /// Whether what carries it also bears such impulses, in its slots: of what bends that is known by where it is touched ([`Self::bear`]).
    pub fn stays_under(&self, impulses: &[DVec3]) -> bool {
        let presses = |stand: Stand| self.is_pressed(&stand, Impulse { linear: impulses[0], angular: impulses[1] });
        self.is_many() || self.grounded().is_some_and(presses)
    }

    /// Whether it bends and lies on something.
    pub fn lies(&self) -> bool {
        !self.feet().is_empty()
    }

    /// Where it lies, if it bends.
    pub(super) fn feet(&self) -> &[Foot] {
        self.response().map_or(&[], |response| response.supports())
    }

    /// Begins a solve: what it stands on is taken to carry all that presses it (eq. 7a), and where `tips`, the feet over which it tips to
    /// hold (eq. 7n); whether there is either. While a solve looks for impulses its answer to them must be linear: one that changed with the
    /// line on which they act would have no end.
    pub fn press(&mut self, tips: bool) -> bool {
        self.pressed = (self.grounded().is_some() || (tips && self.tips().is_some())).then_some(true);
        self.pressed.is_some()
    }

    /// Takes the sum of the impulses that a solve found, in its slots: whether they tip it or lift it, and so meet the free body
    /// in another solve.
    pub fn gives_way(&mut self, impulses: &[DVec3]) -> bool {
        let (Some(true), [linear, angular]) = (self.pressed, impulses) else { return false };
        let sum = Impulse { linear: *linear, angular: *angular };
        let holds = match (self.footing(), self.tips(), self.neighbour.as_ref().map(|n| &n.snapshot.inertia)) {
            (Some(stand), ..) => self.is_pressed(&stand, sum),
            (None, Some(tips), Some(Inertia::Rigid { inverse_mass, inverse_inertia })) => {
                tips.is_pressed((*inverse_mass, *inverse_inertia), sum)
            }
            _ => return false,
        };
        let gives_way = sum != Impulse::ZERO && !holds;
        self.pressed = Some(!gives_way);
        gives_way
    }

    /// Ends a solve: each impulse tells by itself again how it meets the ground.
    pub const fn release(&mut self) {
        self.pressed = None;
    }

    /// It is seen before it came down where it now stands or tips: it falls as it did, with what of its acceleration the ground has taken.
    pub(super) fn take_off(&mut self, neighbour: &Neighbour) {
        let (snapshot, turning) = (&neighbour.snapshot, self.turning());
        let of_stand = |stand: &Stand| stand.normal * (-stand.weight_m_s2 - snapshot.acceleration.dot(stand.normal));
        let of_tips = |tips: &Tips| tips.gravity - snapshot.acceleration;
        let taken = snapshot.stand.as_ref().map(of_stand).or(self.tips().map(of_tips));
        let Some(weight) = taken else { return };
        self.landing = Some(weight);
        let age_s = self.age_s;
        self.shift(&[weight, -turning].map(|a| a * (0.5 * age_s * age_s)));
        self.velocities[0] += weight * age_s;
        self.velocities[1] -= turning * age_s;
    }

    /// How it stands, where it has not been lifted off that.
    pub(super) fn grounded(&self) -> Option<Stand> {
        self.footing().filter(|_| self.height_m.is_none_or(|height_m| height_m < LIFTED_M))
    }

    /// How it tips over an edge or a corner, where impulses may move it.
    pub(super) fn tips(&self) -> Option<&Tips> {
        let free = !self.held && self.lean.is_none() && self.lying.is_none() && self.landing.is_none();
        self.neighbour.as_ref().filter(|_| free).and_then(|n| n.snapshot.tips.get())
    }

    /// How it stands, where impulses may move it.
    fn footing(&self) -> Option<Stand> {
        if self.landing.is_some() {
            return None;
        }
        let lies = self.lying.as_ref().map(|lying| lying.upheld.stand);
        let stand = lies.or(self.neighbour.as_ref()?.snapshot.stand)?;
        (!self.held && self.lean.is_none()).then_some(stand)
    }
}
