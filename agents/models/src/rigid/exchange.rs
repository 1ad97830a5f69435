//! Coupling of a rigid body to its peers: the impulses it takes and the data it publishes.
//!
//! In: ledgers of the owners of contacts with it. Out: its motion with their impulses applied, its own contacts solved for an
//! island that moves it, and the coupling part of its snapshot. Never here: how contacts are solved
//! ([`super::meeting`]). Theory: docs/theory/coupling.md.

use super::RigidBody;
use super::company::{Held, Span};
use super::conservative_advancement::Fall;
use super::footing::FEET_M;
use super::leant;
use super::meeting::{Me, Scope};
use super::motion::Motion;
use glam::{DQuat, DVec3};
use metachron_contact::Law;
use metachron_contact::beside::may_press;
use metachron_contact::{Neighbour, StepContext};
use metachron_core::snapshot::STANDING_M_S;
use metachron_core::{AgentId, Body, Bounds, Inertia, LiesOn, SimSpan, SimTime, Snapshot, Stand, Upheld};
use metachron_core::{Impulse, Mat6, Twist};

/// Limit of the published acceleration's difference from gravity, in multiples of gravity: its support can hold it up, but
/// a single hard step must not make peers predict that it flies off.
const EXPECTED_G: f64 = 3.0;

/// Look-ahead for static solids in the way of a free flight, seconds: three steps of 10 Hz; slower clocks are rare.
const LANDS_S: f64 = 0.3;

impl RigidBody {
    /// Begins a step of `dt` seconds: takes the impulses of the owners of its contacts, and brings each agent that it meets to its
    /// own time.
    ///
    /// `members`, by rising ids, are in the same island as this body: contacts between them are not coupled.
    pub fn receive(&mut self, context: &StepContext<'_>, members: &[AgentId], dt: f64) {
        let before = [self.motion.velocity, self.motion.spin(&self.spread)];
        self.company.exchange.open(context);
        self.company.pairs.open();
        if members.is_empty() {
            self.within = None;
        }
        self.late = None;
        if self.hold.is_known() {
            self.follow(context, dt);
        } else {
            self.take_impulses(context, dt);
        }
        self.received_before = self.received[0];
        self.received = [self.motion.velocity - before[0], self.motion.spin(&self.spread) - before[1]];
        // a deformable supports it through the impulses that it gives
        let given = self.received[0] != DVec3::ZERO;
        let held = given || self.touching || self.held_up || self.stand.is_some() || !self.ties.is_empty();
        self.company.span = Span { dt_s: dt, gravity: self.gravity, held };
        self.company.gather(context, (&self.world.mover, &self.motion), members);
        (self.begun, self.coupled, self.steady) = (self.motion.velocity, DVec3::ZERO, true);
        self.begun_at = (self.motion.position, self.motion.angular);
        self.held_up = !members.is_empty();
    }

    /// Takes owners' impulses, including those that act in a step of `dt` seconds, where no springs hold the body (eq. 3, 4).
    fn take_impulses(&mut self, context: &StepContext<'_>, dt: f64) {
        let until = context.time + SimSpan::from_secs_f64(dt).unwrap_or(SimSpan::ZERO);
        let Self { motion, spread, company, .. } = self;
        let mut taken = None;
        let unread_s = company.exchange.take(context, until, |_, _, sum, way| {
            motion.velocity += sum.linear / spread.mass_kg;
            motion.angular += sum.angular;
            let (given, carried) = taken.unwrap_or((Impulse::ZERO, Impulse::ZERO));
            taken = Some((given + sum, carried + way));
        });
        if let Some((given, carried)) = taken {
            let since_s = carried.linear.length() / given.linear.length();
            let [left, carried] = self.replace_static_impulses([given, carried], (context.time, unread_s));
            // impulses that the ground carries displace nothing, and impulses still to act lift nothing off it
            let carried = match self.stand {
                Some(stand) if stand.bears(self.motion.position, given) => stand.leaves(carried),
                Some(stand) => self.lift_off(&stand, left, carried, since_s.min(self.stood_s)),
                None => self.hold(carried),
            };
            if self.within.is_some() {
                self.late = Some(carried);
            } else {
                self.shift(carried);
            }
            self.world.moved();
        }
    }

    /// Moves the body by a displacement that its island computed, metres and radians.
    pub(super) fn displace_by(&mut self, [way, turn]: Twist) {
        self.motion.position += way;
        self.motion.rotation = (DQuat::from_scaled_axis(turn) * self.motion.rotation).normalize();
        self.world.moved();
    }

    /// Removes the weight that the ground carried from a body that was lifted off it `since_s` seconds ago by the remainder of an
    /// impulse, and the corresponding displacement (eq. 7f).
    fn lift_off(&mut self, stand: &Stand, left: Impulse, carried: Impulse, since_s: f64) -> Impulse {
        let mass = self.spread.mass_kg;
        let all = [left.linear, carried.linear].map(|impulse| impulse / mass);
        let [change, way] = stand.lifted(all, if since_s.is_finite() { since_s } else { 0.0 });
        self.motion.velocity += change - all[0];
        Impulse { linear: way * mass, ..carried }
    }

    /// Takes back the impulses that static solids gave in place of impulses that came late, and the corresponding displacement; returns the
    /// remainder of both. They acted at most so many seconds before now.
    fn replace_static_impulses(&mut self, [given, carried]: [Impulse; 2], since: (SimTime, f64)) -> [Impulse; 2] {
        let inverse = self.motion.inverse_inertia(&self.spread);
        let [back, way] = self.borne.in_place_of([given, carried], since, inverse);
        self.motion.velocity -= back.linear / self.spread.mass_kg;
        self.motion.angular -= back.angular;
        [given - back, carried - way]
    }

    /// Applies contact laws that act on one side alone (penalty, wave variables), for a step of `dt` seconds.
    pub fn apply_one_sided_laws(&mut self, context: &StepContext<'_>, dt: f64) {
        let Self { motion, spread, company, sided, gravity, stand, .. } = self;
        if company.guests().is_empty() {
            return;
        }
        let before = motion.velocity;
        sided.act((motion, spread), company, context, (dt, *gravity, *stand));
        if self.motion.velocity != before {
            self.coupled += self.motion.velocity - before;
            self.world.moved();
        }
    }

    /// Solves the contacts that this body owns over the next `h` seconds for an island that moves it and applies its gravity: the
    /// velocities change, no position of the body does. Call it after [`Self::receive`], once for each part of the step. Returns the
    /// resistance of pressing tools to further changes in it, if any press the body.
    pub fn meet(&mut self, h: f64) -> Option<Mat6> {
        self.leant.clear();
        if self.company.guests().is_empty() {
            return None;
        }
        let Self { motion, spread, world, company, meeting, obstacles, gravity, leant, .. } = self;
        let scope = Scope { solids: true, fixed: false };
        let before = motion.velocity;
        let mut me = Me { motion, spread, mover: &world.mover };
        if meeting.press(&mut me, company, (obstacles, scope), (h, *gravity)).is_some() {
            meeting.lean_on(company, leant);
            self.motion.velocity -= self.gravity * h;
            self.coupled += self.motion.velocity - before;
            self.world.moved();
        }
        leant::resistance(&self.leant)
    }

    /// Ends a step of `dt` seconds: books the impulses given and computes the acceleration to publish.
    pub fn settle(&mut self, context: &StepContext<'_>, dt: f64) {
        let beyond = self.support(dt).clamp_length_max(EXPECTED_G * self.gravity.length());
        self.acceleration = if self.at_rest { DVec3::ZERO } else { self.gravity + beyond };
        let seen = context.neighbours.iter().any(|n| n.form.is_some() && (!n.owned || n.law != Law::Cluster));
        let stood = self.stand.is_some();
        (self.stand, self.tips) = if seen { self.footing() } else { (None, None) };
        self.lately.pass(self.tips.is_some(), dt);
        self.stood_s = if stood && self.stand.is_some() { self.stood_s + dt } else { 0.0 };
        self.remove_supported_acceleration();
        self.lies = self.supporting_agent(context);
        if self.lies.is_some() {
            let pressing = context.neighbours.iter().filter(|n| may_press(n));
            pressing.for_each(|n| self.company.exchange.expect(n.id));
        }
        self.company.knock(context, &self.world.mover, &self.motion, dt);
        let held = self.held_up || self.received[0] != DVec3::ZERO;
        let bonded = || context.neighbours.iter().any(|n| n.snapshot.bonds.contains(&context.me));
        let stands = self.stand.is_some() || self.touching || self.company.pairs.bonds().next().is_some() || bonded();
        self.lands_s = if has_rigid_neighbour(context) && !self.held_up { self.landing_time_s() } else { None };
        let flight = (&self.world.mover, &self.motion);
        let company = Held { mass_kg: self.spread.mass_kg, now: held || stands, lands_s: self.lands_s };
        self.company.foresee(flight, (self.gravity, dt), &company);
        self.company.settle(context, dt, (self.gravity, held));
    }

    /// Sets the published state of a body that has not stepped yet: it is supported where it was placed, and does not fall into
    /// the ground.
    pub(super) fn publish_initial_support(&mut self) {
        (self.stand, self.tips) = self.footing();
        self.remove_supported_acceleration();
    }

    /// Removes the acceleration into its support, also where it has only just come down on it.
    fn remove_supported_acceleration(&mut self) {
        if let Some(Stand { normal, .. }) = self.stand {
            self.acceleration -= normal * self.acceleration.dot(normal).min(0.0);
        }
    }

    /// The agent that it rests on, where exactly one neighbour reports that it supports the body on something fixed (eq. 7l).
    fn supporting_agent(&self, context: &StepContext<'_>) -> Option<LiesOn> {
        if self.hold.is_known() || !self.ties.is_empty() || self.island.is_some() {
            return None;
        }
        let mut all = context.neighbours.iter().filter_map(|n| {
            let upheld = n.snapshot.pairs.iter().find(|pair| pair.with == context.me)?.bears?;
            Some(LiesOn { on: n.id, at: n.snapshot.time, step_s: n.step_s, upheld })
        });
        let lies = all.next().filter(|_| all.next().is_none())?;
        // the supporting agent would report a push along it, or a turn, too late
        let Upheld { stand, velocity, .. } = lies.upheld;
        let otherwise = self.motion.velocity - velocity;
        let along = otherwise - stand.normal * stand.normal.dot(otherwise);
        let swing = self.world.mover.radius_m * self.motion.spin(&self.spread).length();
        // two supporting agents divide the body between them (eq. 6c)
        let lifts = |n: &Neighbour| {
            let given = n.snapshot.given.iter().find(|ledger| ledger.with == context.me);
            n.id != lies.on && given.is_some_and(|ledger| ledger.force.linear.dot(stand.normal) > 0.0)
        };
        (along.length() + swing < STANDING_M_S && !context.neighbours.iter().any(lifts)).then_some(lies)
    }

    /// Time of free flight until a static solid may be in its way, seconds, where that is soon.
    fn landing_time_s(&self) -> Option<f64> {
        let fall = Fall { gravity: self.gravity, spin_max: self.motion.spin_max(&self.spread) };
        let free_s = self.world.free_time(&self.motion, fall, LANDS_S);
        (free_s < LANDS_S).then_some(free_s)
    }

    /// The support acceleration in lasting contact, beyond gravity and couplings, m/s²; zero in flight.
    ///
    /// The part that merely took back the impulses received in this step is left out: the support will take back the next ones too,
    /// but only those.
    fn support(&self, dt: f64) -> DVec3 {
        if let Some(within) = self.within {
            // the island also takes back part of the received impulses
            let [linear, angular] = self.received;
            let given = [linear * self.spread.mass_kg, self.motion.inertia_times(&self.spread, angular)];
            let changed = self.motion.velocity - (self.begun - linear) - self.coupled - within.times(given)[0];
            return changed / dt - self.gravity;
        }
        let held = self.touching || !self.ties.is_empty();
        if !(self.steady && held) {
            return DVec3::ZERO;
        }
        let measured = (self.motion.velocity - self.begun - self.coupled) / dt - self.gravity;
        let received = self.received[0] / dt;
        let taken_back = -(measured + self.gravity).dot(received) / received.length_squared();
        if taken_back > 0.0 { measured + received * taken_back.min(1.0) } else { measured }
    }

    /// Moves the body by the displacement that late impulses have caused; not through a static solid.
    pub(super) fn shift(&mut self, carried: Impulse) {
        let Self { motion, spread, world, gravity, touching, tips, .. } = self;
        let way = carried.linear / spread.mass_kg;
        let mut moved = Motion { velocity: way, angular: carried.angular, ..*motion };
        let turn = moved.spin_max(spread);
        // an impulse that lifts one side turns the body over its feet on the other
        let lifts = tips.filter(|tips| tips.normal.dot(way) > 0.0);
        let clear_m = FEET_M + 2.0 * world.mover.skin_m() + world.mover.radius_m * turn;
        let raised = lifts.map_or(DVec3::ZERO, |tips| tips.normal * clear_m);
        moved.position += raised;
        let share = world.free_time(&moved, Fall { gravity: DVec3::ZERO, spin_max: turn }, 1.0);
        moved.position -= raised;
        moved.fly(spread, DVec3::ZERO, share);
        (motion.position, motion.rotation) = (moved.position, moved.rotation);
        if !*touching {
            motion.slow_by(gravity.dot(way) * (1.0 - share), *gravity);
        }
    }

    /// Keeps only a `share` of the displacement by late impulses since the state `before`.
    pub(super) fn scale_displacement(&mut self, before: &Motion, share: f64) {
        let Self { motion, gravity, .. } = self;
        let way = motion.position - before.position;
        motion.position = before.position + way * share;
        motion.rotation = before.rotation.slerp(motion.rotation, share);
        if !self.touching {
            motion.slow_by(gravity.dot(way) * (1.0 - share), *gravity);
        }
        self.world.moved();
    }

    /// The box around it.
    pub(super) fn bounds(&self) -> Bounds {
        let radius_m = self.world.mover.radius_m;
        let swing = radius_m * self.motion.spin(&self.spread).length();
        Bounds {
            low: self.motion.position - radius_m,
            high: self.motion.position + radius_m,
            speed_m_s: self.motion.velocity.length() + swing,
        }
    }

    /// Whether its support will hold it up: no received impulse lifts it.
    pub(super) fn stays(&self) -> bool {
        self.stand.is_some_and(|stand| stand.normal.dot(self.received[0]) <= 0.0)
    }

    /// Writes the data that peers need for coupling.
    pub(super) fn write_coupling(&self, into: &mut Snapshot) {
        let (inverse_mass, inverse_inertia) = self.motion.inverse_inertia(&self.spread);
        into.inertia = Inertia::Rigid { inverse_mass, inverse_inertia };
        into.bounds = Some(self.bounds());
        (into.at_rest, into.acceleration, into.stand) = (self.at_rest, self.acceleration, self.stand);
        (into.shares, into.grounded) = (self.sunk_m.is_some(), self.stand.is_some() || self.lately.is_grounded());
        into.lands_s = self.lands_s;
        into.sprung.set(self.hold.published());
        into.lies.set(self.lies.filter(|_| !self.at_rest));
        into.tips.set(self.tips);
        into.within.set(self.within.filter(|_| !self.at_rest));
        into.rebound.set(self.borne.newest().filter(|_| !self.at_rest));
        self.company.exchange.write(into);
        into.touches.clear();
        into.bonds.clear();
        if !self.at_rest {
            into.touches.extend(self.company.pairs.touched());
            into.touches.extend(&self.company.knocks);
            into.bonds.extend(self.company.pairs.bonds());
        }
    }
}

/// Whether a rigid neighbour may touch this body.
fn has_rigid_neighbour(context: &StepContext<'_>) -> bool {
    context.neighbours.iter().any(|n| n.form.is_some() && matches!(n.snapshot.body, Body::Rigid(_)))
}
