//! The agents that a rigid body meets, each brought to the body's own time.
//!
//! In: what the body sees at the start of a step. Out: how long it can fly before it may touch one of them (conservative
//! advancement, MIR96, in the frame of the other); who touched whom for how long. Never here: what happens at a touch
//! ([`super::meeting`]), fixed solids ([`crate::rigid::conservative_advancement`]).

use super::conservative_advancement::{Approach, Fall, ImpactTimes, MovingShape, first_root};
use super::meeting::WAKE_M_S;
use super::motion::Motion;
use super::pair::Pairs;
use glam::DVec3;
use metachron_contact::beside::is_led_on;
use metachron_contact::{Exchange, Law, Other};
use metachron_contact::{Neighbour, StepContext};
use metachron_core::Impulse;
use metachron_core::{AgentId, Body, Inertia, Snapshot};
use metachron_geometry::Solid;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, gap};
use metachron_geometry::{CollisionShape, PlacedShape, ShapeKind, ShapePose};
use std::sync::Arc;

/// Whom a body meets, and what it has with each.
pub(super) struct Company {
    /// What is given and taken.
    pub exchange: Exchange,
    /// What is remembered of each pair from step to step.
    pub pairs: Pairs,
    /// Room for searches.
    pub room: NarrowPhaseScratch,
    /// The body's own shape, as others know it.
    pub form: Arc<CollisionShape>,
    /// Who the body is.
    pub me: AgentId,
    /// Seconds since the step began.
    pub after_s: f64,
    /// Bodies at rest that own the contact with this one, and that it is about to touch.
    pub knocks: Vec<AgentId>,
    /// How long the step is, and what pulls the body together with others meanwhile.
    pub span: Span,
    guests: Vec<Guest>,
    /// How many of `guests` are in use; the rest is storage.
    count: usize,
}

/// A step, as bounces within it need it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Span {
    /// Seconds.
    pub dt_s: f64,
    /// What pulls at everybody, m/s².
    pub gravity: DVec3,
    /// Whether something holds the body up.
    pub held: bool,
}

/// A body, and whether something will hold it up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Whether something does already.
    pub now: bool,
    /// In how many seconds of free flight something fixed may be in its way.
    pub lands_s: Option<f64>,
}

/// An agent that is met in this step.
#[derive(Default)]
pub(super) struct Guest {
    /// It, at the body's own time.
    pub other: Other,
    /// Whether contact with it is to be found and solved here.
    pub touchable: bool,
    /// Coulomb friction coefficient of the pair.
    pub friction: f64,
    /// Restitution of the pair.
    pub restitution: f64,
    /// The gap at which the two count as touching, metres.
    pub skin_m: f64,
    /// Its farthest point from its centre, metres; infinite where that is not known.
    radius_m: f64,
    /// No point of its surface moves faster along a normal than its spin times this, metres.
    swing_m: f64,
    convex: bool,
    chain: bool,
}

/// Who accelerates otherwise than gravity would have it by more than this is held by something, m/s².
const HELD_M_S2: f64 = 0.1;
/// Bodies that come together by more than this share of the smaller one's size in a step are too fast for their clocks.
const COARSE_SHARE: f64 = 0.05;
/// How many steps of the slower of two ahead their meeting is foreseen: one to be told of, one to move in, one that is under way
/// meanwhile.
const FORESEEN: f64 = 3.0;
/// Who bounces by more than this does not stay where it lands.
const STAYS: f64 = 0.5;
/// The gap at which two balls touch, as a share of the radius: their distance is known to rounding.
const BALL_SKIN_SHARE: f64 = 1e-9;

impl Company {
    /// The company of a body of this shape: nobody yet.
    pub(super) fn new(form: Arc<CollisionShape>) -> Self {
        Self {
            exchange: Exchange::wary(),
            pairs: Pairs::default(),
            room: NarrowPhaseScratch::default(),
            form,
            me: AgentId(0),
            after_s: 0.0,
            knocks: Vec::new(),
            span: Span::default(),
            guests: Vec::new(),
            count: 0,
        }
    }

    /// Brings everybody that this body meets to the start of the step, but for `fellows`, by rising ids, who share its world.
    pub(super) fn gather(
        &mut self,
        around: &StepContext<'_>,
        (mover, motion): (&MovingShape, &Motion),
        fellows: &[AgentId],
    ) {
        (self.me, self.count, self.after_s) = (around.me, 0, 0.0);
        for neighbour in around.neighbours {
            if fellows.binary_search(&neighbour.id).is_ok() || !is_met(neighbour, around) {
                continue;
            }
            if self.guests.len() == self.count {
                self.guests.push(Guest::default());
            }
            let guest = &mut self.guests[self.count];
            let stale = matches!(neighbour.law, Law::Penalty { extrapolate: false, .. });
            let known = if stale {
                guest.other.see(neighbour)
            } else {
                guest.other.meet(neighbour, around, &self.exchange, Some(motion.position))
            };
            if known {
                guest.learn(neighbour, &self.form, mover);
                guest.touchable &= !lets_in(neighbour, around.me); // jaws pass through what they hold
                self.count += 1;
                if let Some(pair) = self.pairs.get(neighbour.id) {
                    let on_their_way = on_their_way(&self.exchange, around, neighbour);
                    pair.correct(guest.other.velocities(), on_their_way);
                }
            }
        }
    }

    /// Finds who sleeps where the body may get within two steps of `dt` seconds: nobody but them would see it come.
    pub(super) fn knock(&mut self, around: &StepContext<'_>, mover: &MovingShape, motion: &Motion, dt: f64) {
        self.knocks.clear();
        let reach = mover.radius_m + 2.0 * dt * motion.velocity.length();
        for neighbour in around.neighbours.iter().filter(|n| !n.owned && n.form.is_some() && n.law != Law::Off) {
            let Some(bounds) = neighbour.snapshot.bounds.filter(|_| neighbour.snapshot.at_rest) else { continue };
            let nearest = motion.position.clamp(bounds.low, bounds.high);
            let towards = nearest - motion.position;
            let closing = motion.velocity.dot(towards.normalize_or_zero());
            if towards.length() < reach && (closing > WAKE_M_S || towards == DVec3::ZERO) {
                self.knocks.push(neighbour.id);
            }
        }
    }

    /// Finds whom the body may meet within three steps of the slower of the two, while something holds one of them up or will by
    /// then: they share a world from before they touch. `flight` is that of a body of `mass_kg` after a step of `dt` seconds.
    ///
    /// Who takes steps as long as a good part of its own size would else be stopped by several at once, each of whom knows
    /// nothing yet of what the others gave it, or by nobody. Whoever is held up, or is about to be, may have come to a stop by
    /// then, though both fall alike now. And who is light, on the ground or hopping there, is thrown into it by every blow of who
    /// is heavy: it comes back before the other knows, until that has passed through it.
    pub(super) fn foresee(
        &mut self,
        (mover, motion): (&MovingShape, &Motion),
        (gravity, dt): (DVec3, f64),
        held: &Held,
    ) {
        let Self { guests, count, room, form, pairs, .. } = self;
        let fall = Fall { gravity, spin_max: 0.0 };
        for guest in guests[..*count].iter().filter(|g| g.touchable && g.is_rigid() && g.restitution <= STAYS) {
            let Some(neighbour) = guest.other.neighbour() else { continue };
            let step_s = dt.max(neighbour.step_s);
            let soon_s = FORESEEN * step_s;
            let [mine, theirs] = [motion.velocity, guest.other.velocities()[0]];
            let stops = [
                (held.within(soon_s), mine - falling(mine, gravity)),
                (is_held_within(soon_s, &neighbour.snapshot, gravity), mine + falling(theirs, gravity)),
            ];
            let meets = |velocity: DVec3, room: &mut NarrowPhaseScratch| {
                let motion = Motion { velocity, ..*motion };
                let coarse = guest.approach_m_s(velocity) * step_s > COARSE_SHARE * mover.radius_m.min(guest.radius_m);
                coarse && {
                    let Approach { free_s, closing_m_s } =
                        guest.approach(&placed(form, &motion), (mover, &motion, fall), soon_s, room);
                    free_s < soon_s && closing_m_s > 0.0
                }
            };
            if stops.into_iter().any(|(stops, velocity)| stops && meets(velocity, room)) {
                pairs.of(neighbour.id, guest.reduced_kg(held.mass_kg)).expect_contact();
            }
        }
    }

    /// Ends a step of `dt` seconds: how long pairs have touched, how everybody should move next, and the accounts. `gravity` is
    /// what pulls at everybody; `held` says whether something beside the pair held the body up.
    pub(super) fn settle(&mut self, around: &StepContext<'_>, dt: f64, (gravity, held): (DVec3, bool)) {
        for guest in &self.guests[..self.count] {
            let Some(neighbour) = guest.other.neighbour() else { continue };
            if let Some(pair) = self.pairs.get(neighbour.id) {
                pair.expect(guest.other.velocities());
                if held || neighbour.snapshot.acceleration.distance(gravity) > HELD_M_S2 {
                    pair.bond();
                }
            }
        }
        self.pairs.close(dt);
        self.exchange.close(around, dt);
        self.count = 0;
    }

    /// What acts from now on will last for `h` seconds.
    pub(super) fn foresee_springs(&mut self, h: f64) {
        self.guests[..self.count].iter_mut().for_each(|guest| guest.other.foresee(h));
    }

    /// A blow begins or ends.
    pub(super) fn strike(&mut self, struck: bool) {
        self.guests[..self.count].iter_mut().for_each(|guest| guest.other.strike(struck));
    }

    /// There is nobody until the next step.
    pub(super) const fn dismiss(&mut self) {
        self.count = 0;
    }

    /// Whether everybody that is touched moves slower than `calm_m_s`, and nobody is a tool that is led on: it would come into who sleeps.
    pub(super) fn is_calm(&self, calm_m_s: f64) -> bool {
        let touched = |guest: &&Guest| guest.id().is_some_and(|id| self.pairs.touched().any(|with| with == id));
        let calm = |guest: &Guest| guest.speed_m_s() < calm_m_s && !guest.other.neighbour().is_some_and(is_led_on);
        self.guests().iter().filter(touched).all(calm)
    }

    /// Everybody that is met.
    pub(super) fn guests(&self) -> &[Guest] {
        &self.guests[..self.count]
    }

    /// Everything that a solve needs, each part for itself.
    pub(super) fn split(
        &mut self,
    ) -> (&mut [Guest], &mut Exchange, &mut Pairs, &mut NarrowPhaseScratch, &Arc<CollisionShape>) {
        let Self { guests, count, exchange, pairs, room, form, .. } = self;
        (&mut guests[..*count], exchange, pairs, room, form)
    }

    /// Begins a solve: whether somebody stands on something fixed, which is taken to carry what presses it (eq. 7a).
    pub(super) fn press(&mut self) -> bool {
        self.guests_mut().iter_mut().map(|guest| guest.other.press(true)).filter(|stands| *stands).count() > 0
    }

    /// Whether what a solve `gives`, one impulse a slot, tips or lifts somebody who stands: the first of them. Their slots start at
    /// `bases`.
    pub(super) fn gives_way(&mut self, bases: &[u32], gives: &[DVec3]) -> bool {
        self.guests_mut().iter_mut().zip(bases).filter(|(guest, _)| guest.touchable).any(|(guest, &base)| {
            let from = base as usize;
            guest.other.gives_way(&gives[from..from + guest.other.velocities().len()])
        })
    }

    /// Ends a solve.
    pub(super) fn release(&mut self) {
        self.guests_mut().iter_mut().for_each(|guest| guest.other.release());
    }

    fn guests_mut(&mut self) -> &mut [Guest] {
        &mut self.guests[..self.count]
    }

    /// Who lies ahead of a flight of `horizon` seconds.
    ///
    /// Tubes do not bounce: contact with them is foreseen from part to part instead.
    pub(super) fn ahead(&mut self, mover: &MovingShape, motion: &Motion, fall: Fall, horizon: f64) -> ImpactTimes {
        let Self { guests, count, room, form, span, .. } = self;
        let (me, mut ahead) = (placed(form, motion), ImpactTimes::clear(horizon));
        for guest in guests[..*count].iter().filter(|guest| guest.touchable && !guest.chain) {
            let approach = guest.approach(&me, (mover, motion, fall), horizon, room);
            ahead.add(approach, guest.restitution_at(approach.closing_m_s, span));
        }
        ahead
    }

    /// Whether a tube is met.
    pub(super) fn has_tubes(&self) -> bool {
        self.guests().iter().any(|guest| guest.touchable && guest.chain)
    }

    /// Lets `h` seconds pass for everybody.
    pub(super) fn go_on(&mut self, h: f64) {
        self.guests[..self.count].iter_mut().for_each(|guest| guest.other.go_on(h));
        self.after_s += h;
    }
}

impl Held {
    /// Whether something holds it up within `soon_s` seconds.
    fn within(&self, soon_s: f64) -> bool {
        self.now || self.lands_s.is_some_and(|lands_s| lands_s < soon_s)
    }
}

/// Whether something holds a body up within `soon_s` seconds of this state.
fn is_held_within(soon_s: f64, state: &Snapshot, gravity: DVec3) -> bool {
    let held = state.acceleration.distance(gravity) > HELD_M_S2 || !state.bonds.is_empty();
    held || state.lands_s.is_some_and(|lands_s| lands_s < soon_s)
}

/// The part of a velocity that goes along gravity.
fn falling(velocity: DVec3, gravity: DVec3) -> DVec3 {
    let down = gravity.normalize_or_zero();
    down * velocity.dot(down).max(0.0)
}

/// The body itself, for a search.
pub(super) fn placed<'a>(form: &'a CollisionShape, motion: &Motion) -> PlacedShape<'a> {
    PlacedShape { form, view: ShapePose::Solid { position: motion.position, rotation: motion.rotation } }
}

/// What `neighbour` has been given and has not taken in the state that is seen.
fn on_their_way(exchange: &Exchange, around: &StepContext<'_>, neighbour: &Neighbour) -> Impulse {
    let mut sum = Impulse::ZERO;
    exchange.in_flight(around.me, neighbour, around.time, |_, impulse, _| sum += impulse);
    sum
}

/// Whether `neighbour` has to be brought to the body's own time: the body owns contact or a link with it, or is held by it.
fn is_met(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    let touched = neighbour.form.is_some() && neighbour.law != Law::Off;
    let linked = || around.links.iter().any(|link| link.other == neighbour.id);
    // by other laws than the ledger each side acts on itself
    let alone = matches!(neighbour.law, Law::Penalty { .. } | Law::Tlm { .. })
        || around.links.iter().any(|link| link.other == neighbour.id && matches!(link.law, Law::Tlm { .. }));
    let owned = neighbour.owned || alone;
    ((owned && (touched || linked())) || holds(neighbour, around.me)) && neighbour.snapshot.is_finite()
}

/// Whether `neighbour` is a tool that holds `me`, or has its jaws open for it.
fn lets_in(neighbour: &Neighbour, me: AgentId) -> bool {
    let open = matches!(&neighbour.snapshot.body, Body::Tool(tool) if tool.admits == Some(me));
    open || holds(neighbour, me)
}

/// Whether `neighbour` is a tool that holds `me`.
fn holds(neighbour: &Neighbour, me: AgentId) -> bool {
    matches!(&neighbour.snapshot.body, Body::Tool(tool) if tool.grasp.is_some_and(|grasp| grasp.target == me))
}

impl Guest {
    /// Takes in what does not change while the step lasts.
    fn learn(&mut self, neighbour: &Neighbour, mine: &CollisionShape, mover: &MovingShape) {
        self.touchable = neighbour.owned && neighbour.law == Law::Cluster && neighbour.form.is_some();
        let Some(form) = &neighbour.form else { return };
        self.friction = (mine.friction * form.friction).sqrt();
        self.restitution = mine.restitution.max(form.restitution);
        (self.skin_m, self.convex, self.chain) = (mover.skin_m(), false, false);
        (self.radius_m, self.swing_m) = (f64::INFINITY, 0.0);
        match &form.kind {
            ShapeKind::Solid(solid) => {
                let ball = matches!(solid.solid, Solid::Ball { .. });
                self.convex = !matches!(solid.solid, Solid::Mesh { .. });
                (self.radius_m, self.swing_m) = (solid.radius_m, if ball { 0.0 } else { solid.radius_m });
                if ball && mover.is_ball() {
                    self.skin_m = BALL_SKIN_SHARE * mover.radius_m;
                }
            }
            ShapeKind::Chain { .. } => (self.chain, self.restitution) = (true, 0.0),
            // its drive brings what bounces back at once, and again: pressed, a tip would never come to rest
            ShapeKind::Tool(_) => self.restitution = 0.0,
            // a soft body owns its pairs
            ShapeKind::Surface(_) => {}
        }
    }

    /// Who it is.
    pub(super) fn id(&self) -> Option<AgentId> {
        self.other.id()
    }

    /// Whether it is a rigid body that moves.
    pub(super) fn is_rigid(&self) -> bool {
        let body = self.other.neighbour().map(|neighbour| &neighbour.snapshot.body);
        matches!(body, Some(Body::Rigid(_))) && !self.other.is_held()
    }

    /// The reduced mass of it and a body of `mass_kg`, which it is alone beside what is led, and beside tubes.
    pub(super) fn reduced_kg(&self, mass_kg: f64) -> f64 {
        match self.other.neighbour().map(|n| &n.snapshot.inertia) {
            Some(Inertia::Rigid { inverse_mass, .. }) => mass_kg / (1.0 + mass_kg * inverse_mass),
            _ => mass_kg,
        }
    }

    /// Writes a scale of the inverse mass of each of its slots; a tube's are told by its contacts.
    pub(super) fn scale(&self, mobilities: &mut [f64]) {
        let inertia = self.other.neighbour().filter(|_| !self.other.is_held()).map(|n| &n.snapshot.inertia);
        if let Some(mobility) = self.other.mobility() {
            mobilities.copy_from_slice(&mobility);
        } else if let (Some(Inertia::Rigid { inverse_mass, inverse_inertia: turning }), [linear, angular]) =
            (inertia, mobilities)
        {
            *linear = *inverse_mass;
            *angular = (turning.x_axis.x + turning.y_axis.y + turning.z_axis.z) / 3.0;
        }
    }

    /// The speed of its fastest point, m/s; a tool's turning left out.
    pub(super) fn speed_m_s(&self) -> f64 {
        let slots = self.other.velocities();
        if self.chain {
            return slots.iter().step_by(2).map(|v| v.length()).fold(0.0, f64::max);
        }
        slots[0].length() + slots[1].length() * if self.radius_m.is_finite() { self.radius_m } else { 0.0 }
    }

    /// The restitution of a touch at `closing_m_s`. A hop from which gravity would have the two back within a step of `span` is
    /// none: a body that bounced in each of its steps would never press on what it lies on.
    pub(super) fn restitution_at(&self, closing_m_s: f64, span: &Span) -> f64 {
        let held = span.held || self.other.acceleration().distance(span.gravity) > HELD_M_S2;
        let hop_m_s = 2.0 * self.restitution * closing_m_s;
        if held && hop_m_s < span.gravity.length() * span.dt_s { 0.0 } else { self.restitution }
    }

    /// Whether it is a tool that its drive moves.
    pub(super) fn is_tool(&self) -> bool {
        self.touchable && self.other.is_sprung() && !self.is_rigid()
    }

    /// Whether it is a tube.
    pub(super) const fn is_chain(&self) -> bool {
        self.chain
    }

    /// How fast any point of it can come nearer to a body that moves with `velocity`, its own swing left out, m/s.
    pub(super) fn approach_m_s(&self, velocity: DVec3) -> f64 {
        let slots = self.other.velocities();
        if self.chain {
            return slots.iter().step_by(2).map(|v| v.distance(velocity)).fold(0.0, f64::max);
        }
        slots[0].distance(velocity) + slots[1].length() * self.swing_m
    }

    /// How far off this guest is: at most `horizon` seconds.
    fn approach(
        &self,
        me: &PlacedShape<'_>,
        (mover, motion, fall): (&MovingShape, &Motion, Fall),
        horizon: f64,
        room: &mut NarrowPhaseScratch,
    ) -> Approach {
        let Some(it) = self.other.placed() else { return Approach::none(horizon) };
        let slots = self.other.velocities();
        let (velocity, pull) = (motion.velocity - slots[0], fall.gravity - self.other.acceleration());
        let swing = fall.spin_max * mover.swing_m + slots[1].length() * self.swing_m;
        let reach = (velocity.length() + swing) * horizon + 0.5 * pull.length() * horizon * horizon;
        if let ShapePose::Solid { position, .. } = it.view
            && position.distance(motion.position) > mover.radius_m + self.radius_m + reach + self.skin_m
        {
            return Approach::none(horizon);
        }
        let Some((normal, gap_m)) = gap(me, &it, reach + self.skin_m, room) else { return Approach::none(horizon) };
        let closing_m_s = -normal.dot(velocity);
        let (a, b) = if self.convex && mover.is_convex() {
            (swing + closing_m_s, (-normal.dot(pull)).max(0.0))
        } else {
            (swing + velocity.length(), pull.length())
        };
        Approach { free_s: first_root(a, b, gap_m - self.skin_m).min(horizon), closing_m_s }
    }
}
