//! How a body gets through a part of a step: it flies, takes blows, and stays in contact.
//!
//! In: the body, a span, gravity. Out: its motion after the span, and what it gave to others. Never here: how a touch is
//! foreseen ([`super::clearance`], [`super::company`]) or solved ([`super::world`], [`super::meeting`]), springs.

use super::RigidBody;
use super::clearance::Fall;
use super::meeting::{Me, Scope};
use glam::DVec3;

/// A touching body has left when it would fly for at least this long, seconds.
const LEAVE_S: f64 = 4e-3;
/// A flight shorter than this is a touch, seconds.
const TOUCH_S: f64 = 1e-7;
/// After this many flights and blows within one part the contact solver carries the body to the part's end.
const EVENTS_MAX: u32 = 64;

impl RigidBody {
    /// Flies, takes blows and stays in contact for `h` seconds in all.
    pub(super) fn advance(&mut self, h: f64, gravity: DVec3) -> Result<(), &'static str> {
        let mut left = h;
        for _ in 0..EVENTS_MAX {
            let horizon = if self.touching { left.max(LEAVE_S) } else { left };
            let [fixed, met] = self.free_times(gravity, horizon);
            let free = fixed.min(met);
            if self.touching && free < LEAVE_S {
                return self.linger(left, gravity, [fixed < horizon, met < horizon]);
            }
            self.touching = free < left && free < TOUCH_S;
            if self.touching {
                self.take_blow(met < fixed)?;
                continue;
            }
            let span = free.min(left);
            self.travel(span, gravity);
            left -= span;
            if left <= 0.0 {
                return if self.motion.is_sane(&self.spread) { Ok(()) } else { Err("it flew out of reach") };
            }
        }
        self.touching = true;
        let near = self.free_times(gravity, left.max(LEAVE_S)).map(|free| free < left.max(LEAVE_S));
        self.linger(left, gravity, near)
    }

    /// Seconds of certainly free flight past the fixed solids, and past everybody that can bounce; at most `horizon`.
    pub(super) fn free_times(&mut self, gravity: DVec3, horizon: f64) -> [f64; 2] {
        let fall = Fall { gravity, spin_max: self.motion.spin_max(&self.spread) };
        let fixed = self.world.free_time(&self.motion, fall, horizon);
        [fixed, self.company.free_time(&self.world.mover, &self.motion, fall, horizon)]
    }

    /// The blow of a first touch, with others where `met`.
    fn take_blow(&mut self, met: bool) -> Result<(), &'static str> {
        self.steady = false;
        if !met {
            return self.world.blow(&mut self.motion, &self.spread);
        }
        let Self { motion, spread, world, company, meeting, obstacles, .. } = self;
        meeting.blow(&mut Me { motion, spread, mover: &world.mover }, company, obstacles);
        self.world.flew();
        Ok(())
    }

    /// Flies for `h` seconds; tubes on the way are pressed on.
    fn travel(&mut self, h: f64, gravity: DVec3) {
        if !self.press(h, gravity, Scope { solids: false, fixed: true }) {
            self.steady = false;
            self.motion.fly(&self.spread, gravity, h);
            self.company.go_on(h);
        }
        self.world.flew();
    }

    /// Stays in contact for `h` seconds: with fixed solids where they are near, with others where `met`, or with both.
    fn linger(&mut self, h: f64, gravity: DVec3, [fixed, met]: [bool; 2]) -> Result<(), &'static str> {
        if self.press(h, gravity, Scope { solids: met, fixed: true }) {
            self.world.moved();
        } else if fixed {
            self.company.go_on(h);
            return self.world.contact(&mut self.motion, &self.spread, h, gravity);
        } else {
            // others came near, but not near enough to touch
            self.motion.fly(&self.spread, gravity, h);
            self.company.go_on(h);
            self.world.flew();
        }
        if self.motion.is_sane(&self.spread) { Ok(()) } else { Err("it was thrown out of reach") }
    }

    /// Presses on whatever may touch within `h` seconds, and moves; `false`, and nothing done, where nothing may.
    fn press(&mut self, h: f64, gravity: DVec3, scope: Scope) -> bool {
        let Self { motion, spread, world, company, meeting, obstacles, .. } = self;
        if company.guests().is_empty() || !(scope.solids || company.has_tubes()) {
            return false;
        }
        let before = motion.velocity;
        let mut me = Me { motion, spread, mover: &world.mover };
        let Some(pressed) = meeting.press(&mut me, company, (obstacles, scope), (h, gravity)) else { return false };
        self.coupled += self.motion.velocity - before - gravity * h - pressed.fixed / self.spread.mass_kg;
        self.motion.fly(&self.spread, DVec3::ZERO, h);
        // the velocity is that of the end; what it is pressed on goes along a parabola, so the body does too
        self.motion.position -= pressed.carried * (0.5 * h * h);
        self.company.go_on(h);
        true
    }
}
