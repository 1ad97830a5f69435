//! A rigid body that lies on another agent which something fixed holds up: who presses it there waits for that one's answer.
//!
//! In: how the body says that it lies. Out: where it stays, and when what presses it acts. Never here: who bears it, and how.
//! Theory: docs/theory/coupling.md, eq. 7l.

use super::{Other, Pose};
use crate::StepContext;
use crate::{Exchange, Feet};
use glam::DVec3;
use metachron_core::Impulse;
use metachron_core::{Body, Stand, Upheld};

/// What begins within so many seconds has begun: clocks count whole nanoseconds.
const SOON_S: f64 = 1e-6;

/// How it lies, as seen at the start of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lying {
    pub upheld: Upheld,
    /// In how many seconds the next step begins of the one that bears it, and how long that is.
    next_s: f64,
    step_s: f64,
}

impl Other {
    /// Takes it to stay where the one that bears it has it, where what is on its way only presses it there: that one answers it.
    pub(super) fn lie(&mut self, around: &StepContext<'_>, exchange: &Exchange) {
        let Some(neighbour) = self.neighbour.as_ref().filter(|_| !self.held && self.lean.is_none()) else { return };
        let Some(lies) = neighbour.snapshot.lies.get().filter(|lies| lies.on != around.me) else { return };
        let mut given = Impulse::ZERO;
        exchange.in_flight(around.me, neighbour, around.time, |_, sum, _| given += sum);
        if given != Impulse::ZERO && !lies.upheld.bears(lies.upheld.centre, given) {
            return;
        }
        self.landing = None;
        self.lying = Some(Lying { upheld: lies.upheld, next_s: lies.at.secs_after(around.time), step_s: lies.step_s });
        let since_s = -lies.at.secs_after(around.time);
        self.pose =
            Pose { centre: lies.upheld.centre + lies.upheld.velocity * since_s, rotation: lies.upheld.rotation };
        self.velocities.clear();
        self.velocities.extend([lies.upheld.velocity, DVec3::ZERO]);
        self.height_m = None;
        self.lasting.clear();
        self.coming.clear();
    }

    /// Where its centre is.
    pub(crate) const fn centre(&self) -> DVec3 {
        self.pose.centre
    }

    /// How it rests on who looks, where its feet tell so.
    pub(crate) fn upheld(&self, feet: &Feet, friction: f64) -> Option<Upheld> {
        let neighbour = self.neighbour.as_ref().filter(|n| matches!(n.snapshot.body, Body::Rigid(_)))?;
        if self.held || self.lean.is_some() {
            return None;
        }
        let (stand, velocity) = feet.stand(|normal| -neighbour.snapshot.acceleration.dot(normal).min(0.0))?;
        Some(Upheld { stand, centre: self.pose.centre, velocity, rotation: self.pose.rotation, friction })
    }

    /// What is left of an acceleration: nothing where somebody bears the body.
    pub(super) fn held_still(&self, acceleration: DVec3) -> DVec3 {
        if self.lying.is_some() { DVec3::ZERO } else { acceleration }
    }

    /// Whether an impulse only presses it on what it stands on, as `stand` tells.
    pub(super) fn is_pressed(&self, stand: &Stand, impulse: Impulse) -> bool {
        match &self.lying {
            Some(lying) => lying.upheld.bears(self.pose.centre, impulse),
            None => stand.bears(self.pose.centre, impulse),
        }
    }

    /// When an impulse acts that is given `after_s` seconds into the step and only presses the body on who bears it, and when it may be
    /// taken, seconds: when that one looks next, and when the body reads what it then gave.
    pub(super) fn answered_s(&self, after_s: f64, impulse: Impulse) -> Option<[f64; 2]> {
        let Lying { upheld, next_s, step_s } = self.lying.filter(|_| self.grounded().is_some())?;
        if !upheld.bears(self.pose.centre, impulse) {
            return None;
        }
        let behind_s = after_s + SOON_S - next_s;
        let steps = if behind_s < 0.0 { 0.0 } else { (behind_s / step_s).floor() + 1.0 };
        let acts_s = next_s + steps * step_s;
        let reads_s = self.neighbour.as_ref().map_or(0.0, |neighbour| neighbour.step_s);
        Some([acts_s, acts_s + reads_s + SOON_S])
    }
}
