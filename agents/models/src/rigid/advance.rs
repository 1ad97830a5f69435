//! A part of a rigid body's step: flight, impacts and lasting contact.
//!
//! In: the body, a span, gravity. Out: its motion after the span, and what it gave to others. Never here: how a touch is
//! foreseen ([`crate::rigid::conservative_advancement`], [`super::company`]) or solved ([`super::world`], [`super::meeting`]), springs.

use super::RigidBody;
use super::conservative_advancement::{Fall, ImpactTimes};
use super::meeting::{Me, Scope, Strike};
use glam::DVec3;
use metachron_core::Twist;

/// A touching body has left contact when it would fly for at least this long, seconds.
const LEAVE_S: f64 = 4e-3;
/// A flight shorter than this is a touch, seconds.
pub(super) const TOUCH_S: f64 = 1e-7;
/// An impact of static solids that changes the velocity by less than this counts as no change, m/s.
const CHANGED_M_S: f64 = 1e-3;
/// After this many flights and impacts within one part the contact solver carries the body to the part's end.
const EVENTS_MAX: u32 = 64;

impl RigidBody {
    /// Alternates flight, impacts and lasting contact for `h` seconds in all.
    pub(super) fn advance(&mut self, h: f64, gravity: DVec3) -> Result<(), &'static str> {
        let mut left = h;
        for _ in 0..EVENTS_MAX {
            let horizon = if self.touching { left.max(LEAVE_S) } else { left };
            let ahead = self.ahead(gravity, horizon);
            let free = ahead.map(|side| side.free_s());
            let soonest = free[0].min(free[1]);
            let span = if self.touching && soonest < LEAVE_S {
                let coming = ahead[0].coming_s.min(ahead[1].coming_s);
                if coming < TOUCH_S && self.solve_touch(ahead[1].coming_s < ahead[0].coming_s) {
                    continue;
                }
                // until then it stays in contact with solids that do not bounce, and with those that an impact did not send away
                let here = coming < TOUCH_S;
                let span = if here { left } else { coming.min(left) };
                let within = horizon.min(span.max(LEAVE_S));
                let near = |side: ImpactTimes| if here { side.free_s() } else { side.near_s };
                self.stay_in_contact(span, gravity, ahead.map(|side| near(side) < within))?;
                span
            } else {
                self.touching = soonest < left && soonest < TOUCH_S;
                if self.touching {
                    self.solve_touch(free[1] < free[0]);
                    continue;
                }
                let span = soonest.min(left);
                self.fly_on(span, gravity);
                span
            };
            left -= span;
            if left <= 0.0 {
                return if self.motion.is_sane(&self.spread) {
                    Ok(())
                } else {
                    Err("the free flight left the coordinate range")
                };
            }
        }
        self.touching = true;
        let horizon = left.max(LEAVE_S);
        let near = self.ahead(gravity, horizon).map(|side| side.free_s() < horizon);
        self.keep_contact(left, gravity, near)
    }

    /// Contacts ahead of a flight of `horizon` seconds: with static solids, and with agents that can bounce.
    fn ahead(&mut self, gravity: DVec3, horizon: f64) -> [ImpactTimes; 2] {
        let fall = Fall { gravity, spin_max: self.motion.spin_max(&self.spread) };
        let fixed = self.world.ahead(&self.motion, fall, horizon);
        [fixed, self.company.ahead(&self.world.mover, &self.motion, fall, horizon)]
    }

    /// Whether no contact occurs for `h` seconds.
    pub(super) fn is_free(&mut self, gravity: DVec3, h: f64) -> bool {
        self.ahead(gravity, h).iter().all(|side| side.free_s() >= h)
    }

    /// Solves the impact of a touch, with peers where `met`. Returns whether it changed anything.
    fn solve_touch(&mut self, met: bool) -> bool {
        self.steady = false;
        let before = self.motion.velocity;
        let approached = self.solve_impact(Strike { met, pressed: self.pressing_part(), stood: self.stand.is_some() });
        approached && (met || self.motion.velocity.distance(before) > CHANGED_M_S)
    }

    /// Solves an impact; returns whether any contact approached.
    fn solve_impact(&mut self, strike: Strike) -> bool {
        let Self { motion, spread, world, company, meeting, obstacles, .. } = self;
        let approached = meeting.blow(&mut Me { motion, spread, mover: &world.mover }, company, obstacles, strike);
        self.world.moved();
        approached
    }

    /// Lets the ground take the impulses received while the body was supported, as they have pressed it there all the time: before
    /// its island moves any body.
    pub(super) fn transmit_to_ground(&mut self) {
        if self.received[0] != DVec3::ZERO && (self.touching || self.stand.is_some()) {
            self.solve_impact(Strike { met: false, pressed: self.received, stood: true });
        }
    }

    /// The part of the velocity and spin received in this step that keeps pressing it: all of it where it is supported, otherwise
    /// only as far as the step before received it too, as an impact comes once.
    fn pressing_part(&self) -> Twist {
        let [now, before] = [self.received[0], self.received_before];
        let lasts = (before.dot(now) / now.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let share = if self.stand.is_some() { 1.0 } else { lasts };
        self.received.map(|all| all * share)
    }

    /// Stays in contact for `h` seconds with the groups that are `near`; flies if none is.
    fn stay_in_contact(&mut self, h: f64, gravity: DVec3, near: [bool; 2]) -> Result<(), &'static str> {
        if near == [false; 2] {
            self.fly_on(h, gravity);
            return Ok(());
        }
        self.keep_contact(h, gravity, near)
    }

    /// Flies for `h` seconds; presses on tubes in the way.
    fn fly_on(&mut self, h: f64, gravity: DVec3) {
        if !self.solve_with_all(h, gravity, Scope { solids: false, fixed: true }) {
            self.steady = false;
            self.motion.fly(&self.spread, gravity, h);
            self.company.go_on(h);
        }
        self.world.moved();
    }

    /// Stays in contact for `h` seconds: with static solids where they are near, with peers where `met`, or with both.
    fn keep_contact(&mut self, h: f64, gravity: DVec3, [fixed, met]: [bool; 2]) -> Result<(), &'static str> {
        if self.solve_with_all(h, gravity, Scope { solids: met, fixed: true }) {
            self.world.moved();
        } else if fixed {
            self.company.go_on(h);
            return self.world.contact(&mut self.motion, &self.spread, h, gravity);
        } else {
            // peers came near, but not near enough to touch
            self.motion.fly(&self.spread, gravity, h);
            self.company.go_on(h);
            self.world.moved();
        }
        if self.motion.is_sane(&self.spread) { Ok(()) } else { Err("the contact motion left the coordinate range") }
    }

    /// Solves contact with all bodies that may touch within `h` seconds, and moves; `false`, with no change, if there are none.
    fn solve_with_all(&mut self, h: f64, gravity: DVec3, scope: Scope) -> bool {
        let Self { motion, spread, world, company, meeting, obstacles, .. } = self;
        if company.guests().is_empty() || !(scope.solids || company.has_tubes()) {
            return false;
        }
        let before = motion.velocity;
        let mut me = Me { motion, spread, mover: &world.mover };
        let Some(pressed) = meeting.press(&mut me, company, (obstacles, scope), (h, gravity)) else {
            return false;
        };
        self.coupled += self.motion.velocity - before - gravity * h - pressed.fixed / self.spread.mass_kg;
        self.held_up |= pressed.fixed != DVec3::ZERO;
        self.motion.fly(&self.spread, DVec3::ZERO, h);
        // the velocity is that of the end; the support moves along a parabola, so the body does too
        self.motion.position -= pressed.carried * (0.5 * h * h);
        self.company.go_on(h);
        true
    }
}
