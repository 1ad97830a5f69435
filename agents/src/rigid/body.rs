//! The agent: one step of a rigid body, told as a contents page.
//!
//! In: a span and what pulls. Out: a new [`Motion`] and a snapshot. Never here: how a contact or a spring is solved.

use super::clearance::Fall;
use super::mass::Spread;
use super::motion::Motion;
use super::world::World;
use super::{RigidError, RigidSpec, springs};
use crate::{
    Agent, Body, Grip, Pull, Resolution, RigidState, SimSpan, Snapshot, StepError, StepReport, Surroundings, check_span,
};
use glam::DVec3;

/// A rigid body that lives by its own steps.
pub struct RigidBody {
    spread: Spread,
    gravity: DVec3,
    may_sleep: bool,
    motion: Motion,
    world: World,
    /// Whether the last event was a touch that has not ended.
    touching: bool,
    calm_s: f64,
    steps: u64,
    grips: Vec<Grip>,
    pulls: Vec<Pull>,
}

/// A stretch of contact or of a spring's pull is solved in parts no longer than this, seconds.
const PART_MAX_S: f64 = 1.0 / 240.0;
/// A touching body has left when it would fly for at least this long, seconds.
const LEAVE_S: f64 = 4e-3;
/// A flight shorter than this is a touch, seconds.
const TOUCH_S: f64 = 1e-7;
/// After this many flights and blows within one part the contact solver carries the body to the part's end.
const EVENTS_MAX: u32 = 64;
/// A body that touches something and moves slower than this everywhere is calm, m/s: above the solver's own jitter
/// (measured: below 1e-4 m/s for a box of 1 m at rest), below what an eye sees.
const CALM_M_S: f64 = 2e-3;
/// A body that was calm for this long of its own time is at rest, seconds.
const REST_S: f64 = 0.5;
/// A step shorter than this share of [`PART_MAX_S`] too long is not split once more.
const SPLIT_SLACK: f64 = 1.01;

impl RigidBody {
    /// Builds the body of `spec` in its own world.
    ///
    /// # Errors
    /// [`RigidError`] for a shape without volume, a plane, a number outside its range and an obstacle that is no shape.
    pub fn new(spec: RigidSpec) -> Result<Self, RigidError> {
        spec.check()?;
        let spread = Spread::of(&spec.solid, spec.mass_kg)?;
        let rotation = spec.rotation.normalize();
        let mut motion = Motion {
            position: spec.position + rotation * spread.com,
            rotation,
            velocity: spec.velocity,
            angular: DVec3::ZERO,
        };
        motion.set_spin(&spread, spec.spin);
        let world = World::new(&spec, &spread)?;
        Ok(Self {
            spread,
            gravity: spec.gravity,
            may_sleep: spec.sleep,
            motion,
            world,
            touching: false,
            calm_s: 0.0,
            steps: 0,
            grips: Vec::with_capacity(4),
            pulls: Vec::with_capacity(4),
        })
    }

    /// The centre of mass in the shape's own axes, metres.
    ///
    /// A snapshot tells where the centre of mass is: a point `p` of the shape is at `position + rotation * (p − com_local)`.
    #[must_use]
    pub fn com_local(&self) -> DVec3 {
        self.spread.com
    }

    /// Advances by `h` seconds, springs first: pull, then fly and touch.
    fn part(&mut self, h: f64) -> Result<(), &'static str> {
        let pulled = springs::pull(&mut self.motion, &self.spread, (&self.pulls, self.gravity), h, &mut self.grips);
        if pulled {
            self.world.moved();
        }
        if !self.motion.is_sane(&self.spread) {
            return Err("a spring threw it out of reach");
        }
        // the spring's solution has the gravity of this part in its velocity already
        self.advance(h, if pulled { DVec3::ZERO } else { self.gravity })
    }

    /// Flies, takes blows and stays in contact for `h` seconds in all.
    fn advance(&mut self, h: f64, gravity: DVec3) -> Result<(), &'static str> {
        let mut left = h;
        for _ in 0..EVENTS_MAX {
            let fall = Fall { gravity, spin_max: self.motion.spin_max(&self.spread) };
            let horizon = if self.touching { left.max(LEAVE_S) } else { left };
            let free = self.world.free_time(&self.motion, fall, horizon);
            if self.touching && free < LEAVE_S {
                return self.world.contact(&mut self.motion, &self.spread, left, gravity);
            }
            self.touching = free < left && free < TOUCH_S;
            if self.touching {
                self.world.blow(&mut self.motion, &self.spread)?;
                continue;
            }
            let span = free.min(left);
            self.motion.fly(&self.spread, gravity, span);
            self.world.flew();
            left -= span;
            if left <= 0.0 {
                return if self.motion.is_sane(&self.spread) { Ok(()) } else { Err("it flew out of reach") };
            }
        }
        self.touching = true;
        self.world.contact(&mut self.motion, &self.spread, left, gravity)
    }

    /// How many parts a step of `dt` seconds takes: one in free flight, more in contact or under a spring.
    fn parts(&self, dt: f64) -> u32 {
        let fall = Fall { gravity: self.gravity, spin_max: self.motion.spin_max(&self.spread) };
        let free = self.pulls.is_empty() && self.world.free_time(&self.motion, fall, dt) >= dt;
        if free { 1 } else { (dt / (PART_MAX_S * SPLIT_SLACK)).ceil().max(1.0) as u32 }
    }

    /// Counts calm time, and brings a body that has been calm long enough to a stop.
    fn rest(&mut self, dt: f64) -> bool {
        let swing = self.world.mover.radius_m * self.motion.spin(&self.spread).length();
        let still = self.motion.velocity == DVec3::ZERO && self.motion.angular == DVec3::ZERO;
        let held = self.touching && self.motion.velocity.length() + swing < CALM_M_S;
        let calm = self.pulls.is_empty() && (held || (still && self.gravity == DVec3::ZERO));
        self.calm_s = if calm { self.calm_s + dt } else { 0.0 };
        let at_rest = self.may_sleep && self.calm_s >= REST_S;
        if at_rest {
            (self.motion.velocity, self.motion.angular) = (DVec3::ZERO, DVec3::ZERO);
            self.world.moved();
        }
        at_rest
    }
}

impl Agent for RigidBody {
    fn model(&self) -> &'static str {
        "rigid"
    }

    /// Advances the body by `dt`: parts of at most 1/240 s where something touches or pulls, one part in free flight.
    fn step(&mut self, dt: SimSpan, around: &Surroundings<'_>) -> Result<StepReport, StepError> {
        let dt_s = check_span(dt)?;
        let (before, touching) = (self.motion, self.touching);
        self.pulls.clear();
        self.pulls.extend(around.pulls());
        self.grips.clear();
        let parts = self.parts(dt_s);
        for _ in 0..parts {
            if let Err(what) = self.part(dt_s / f64::from(parts)) {
                (self.motion, self.touching) = (before, touching);
                self.grips.clear();
                self.world.flew();
                return Err(StepError::Diverged { model: "rigid", dt_s, what: what.to_owned() });
            }
        }
        self.steps += 1;
        let at_rest = self.rest(dt_s);
        Ok(StepReport { work: 1.0, substeps: parts, at_rest })
    }

    fn resolution(&self) -> Option<Resolution> {
        None
    }

    /// A rigid body has no samples to spread: nothing changes.
    fn retune(&mut self, _wanted: Resolution) {}

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.steps = self.steps;
        into.resolution = None;
        into.body = Body::Rigid(RigidState {
            position: self.motion.position,
            rotation: self.motion.rotation,
            velocity: self.motion.velocity,
            spin: self.motion.spin(&self.spread),
        });
        into.energy_j = self.motion.energy_j(&self.spread, self.gravity);
        into.residual_m = self.residual_m();
        into.touches.clear();
        into.grips.clear();
        into.grips.extend_from_slice(&self.grips);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.motion.velocity * self.spread.mass_kg;
        (linear, self.motion.position.cross(linear) + self.motion.angular)
    }

    fn mass_kg(&self) -> f64 {
        self.spread.mass_kg
    }
}

impl RigidBody {
    /// What the body knows of its own error: the rounding of its coordinates, and in contact how deep it sank in.
    fn residual_m(&self) -> f64 {
        let size = self.motion.position.abs().max_element() + self.world.mover.radius_m;
        if self.touching {
            self.world.depth_m(&self.motion) + size * f64::from(f32::EPSILON)
        } else {
            size * f64::EPSILON
        }
    }
}
