//! The rigid body agent: the sequence of one step.
//!
//! In: a span and the step context. Out: a new [`Motion`] and a snapshot. Never here: how a contact or a spring is solved.

use super::borne::Borne;
use super::company::Company;
use super::conservative_advancement::Fall;
use super::hold::Hold;
use super::island;
use super::island::Island;
use super::leant;
use super::leant::Leant;
use super::mass_properties::MassDistribution;
use super::meeting::Meeting;
use super::member::Unknowns;
use super::motion::Motion;
use super::sided::Sided;
use super::spring_set::SpringSet;
use super::world::{PASSES, World};
use super::{Joint, RigidError, RigidSpec, linear_spring};
use crate::limits::PART_MAX_S;
use glam::DVec3;
use metachron_contact::beside;
use metachron_contact::beside::{bends, is_driven};
use metachron_contact::crowd;
use metachron_contact::crowd::Lately;
use metachron_contact::stepper::ClusterMember;
use metachron_contact::{Agent, IslandMember, Neighbour, StepContext};
use metachron_core::DRIFT_S;
use metachron_core::{
    AgentId, Body, Grip, LiesOn, Resolution, RigidState, SimSpan, Snapshot, Stand, StepError, StepReport, Tips,
    check_span,
};
use metachron_core::{Impulse, Mat6, Twist};
use metachron_geometry::{CollisionShape, ShapeKind, SolidShape, StaticSolid};
use metachron_geometry::{Obstacle, Solid};
use std::any::Any;
use std::sync::Arc;

/// A rigid body with its own clock.
pub struct RigidBody {
    pub(super) spread: MassDistribution,
    pub(super) gravity: DVec3,
    pub(super) may_sleep: bool,
    pub(super) motion: Motion,
    /// The static solids, for flights and for contact with them alone.
    pub(super) world: World,
    /// The same as forms, for simultaneous contact with them and other agents.
    pub(super) obstacles: Vec<StaticSolid>,
    /// The neighbours that it meets.
    pub(super) company: Company,
    pub(super) meeting: Meeting,
    pub(super) sided: Sided,
    /// Whether the last event was a touch that has not ended.
    pub(super) touching: bool,
    /// Whether only contact has acted since the step began.
    pub(super) steady: bool,
    /// Whether a static solid or its island has supported it since the step began.
    pub(super) held_up: bool,
    /// The velocity after the impulses received at the step's start, and the changes by its own couplings since, m/s.
    pub(super) begun: DVec3,
    pub(super) coupled: DVec3,
    /// Its position at that time, metres, and its angular momentum, kg·m²/s.
    pub(super) begun_at: (DVec3, DVec3),
    /// The changes of velocity and spin by impulses received at the step's start, m/s and rad/s.
    pub(super) received: Twist,
    /// The change of velocity received at the start of the step before, m/s.
    pub(super) received_before: DVec3,
    /// Recent impulses of static solids.
    pub(super) borne: Borne,
    /// The published acceleration, m/s².
    pub(super) acceleration: DVec3,
    pub(super) stand: Option<Stand>,
    /// The published state of tipping over an edge or corner, if it tips.
    pub(super) tips: Option<Tips>,
    /// The agent that it rests on.
    pub(super) lies: Option<LiesOn>,
    /// Its inverse mass within its island, where that is known, about its centre.
    pub(super) within: Option<Mat6>,
    /// Displacement by late impulses, kg·m and kg·m², until its island applies it.
    pub(super) late: Option<Impulse>,
    /// Time of free flight until a static solid may be in its way, seconds, where peers need it.
    pub(super) lands_s: Option<f64>,
    /// How long it has been supported (`stand`), seconds.
    pub(super) stood_s: f64,
    /// The state published while springs hold it in contacts that peers own.
    pub(super) hold: Hold,
    pub(super) at_rest: bool,
    pub(super) calm_s: f64,
    pub(super) steps: u64,
    /// Its recent contact history.
    pub(super) lately: Lately,
    pub(super) grips: Vec<Grip>,
    pub(super) ties: SpringSet,
    /// The tools that pressed it in the last part of an island's step.
    pub(super) leant: Vec<Leant>,
    /// The static solids and the joints of the scene, for its island.
    pub(super) scenery: (Arc<[Obstacle]>, Arc<[Joint]>),
    /// The island, where this body leads it or a joint holds it.
    pub(super) island: Option<Box<Island>>,
    /// Whether a joint of the scene holds the body; known from its first step on.
    jointed: Option<bool>,
    /// How deep it sank into any body in the last step of its island, metres; `None` without an island.
    pub(super) sunk_m: Option<f64>,
    /// Error of its steps in contact and under springs over a tenth of a second, metres.
    drift_m: f64,
    /// What it is in a contact cluster.
    pub(super) unknowns: Unknowns,
}

/// A body in contact that moves slower than this everywhere is calm, m/s: above the solver's own jitter
/// (measured: below 1e-4 m/s for a box of 1 m at rest), below the visible.
pub(super) const CALM_M_S: f64 = 2e-3;
/// A body that was calm for this long of its own time is at rest, seconds.
pub(super) const REST_S: f64 = 0.5;
/// A step longer than [`PART_MAX_S`] by less than this factor is not split once more.
const SPLIT_SLACK: f64 = 1.01;

impl RigidBody {
    /// Builds the body of `spec` in its own world.
    ///
    /// # Errors
    /// [`RigidError`] for a shape without volume, a plane, a number outside its range and an invalid obstacle shape.
    pub fn new(spec: RigidSpec) -> Result<Self, RigidError> {
        spec.check()?;
        let spread = MassDistribution::of(&spec.solid, spec.mass_kg)?;
        let rotation = spec.rotation.normalize();
        let mut motion = Motion {
            position: spec.position + rotation * spread.com,
            rotation,
            velocity: spec.velocity,
            angular: DVec3::ZERO,
        };
        motion.set_spin(&spread, spec.spin);
        let world = World::new(&spec, &spread)?;
        let form = form_of(&spec, &spread, &world);
        let obstacles = spec.obstacles.iter().map(StaticSolid::new).collect::<Result<_, _>>()?;
        let mut body = Self {
            spread,
            gravity: spec.gravity,
            may_sleep: spec.sleep,
            motion,
            world,
            obstacles,
            company: Company::new(Arc::new(form)),
            meeting: Meeting::default(),
            sided: Sided::default(),
            touching: false,
            steady: false,
            held_up: false,
            begun: spec.velocity,
            coupled: DVec3::ZERO,
            begun_at: (spec.position, DVec3::ZERO),
            received: [DVec3::ZERO; 2],
            received_before: DVec3::ZERO,
            borne: Borne::default(),
            acceleration: spec.gravity,
            stand: None,
            tips: None,
            lies: None,
            within: None,
            late: None,
            lands_s: None,
            stood_s: 0.0,
            hold: Hold::default(),
            at_rest: false,
            calm_s: 0.0,
            steps: 0,
            lately: Lately::default(),
            grips: Vec::with_capacity(4),
            ties: SpringSet::default(),
            leant: Vec::new(),
            scenery: (spec.obstacles, spec.joints),
            island: None,
            jointed: None,
            sunk_m: None,
            drift_m: 0.0,
            unknowns: Unknowns::default(),
        };
        body.unknowns.start([body.motion.velocity, body.motion.spin(&body.spread)]);
        body.publish_initial_support();
        Ok(body)
    }

    /// The centre of mass in the shape's own axes, metres.
    ///
    /// A snapshot holds the position of the centre of mass: a point `p` of the shape is at `position + rotation * (p − com_local)`.
    #[must_use]
    pub fn com_local(&self) -> DVec3 {
        self.spread.com
    }

    /// Advances by `h` seconds: springs first, then flight and contact.
    fn part(&mut self, h: f64) -> Result<(), &'static str> {
        let pulled = self.pull(h)?;
        // the solution of the spring already has the gravity of this part in its velocity
        self.advance(h, if pulled.is_some() { DVec3::ZERO } else { self.gravity })
    }

    /// Begins a step of `dt` seconds: takes impulses of peers, and gathers springs; `members`, by rising ids, are in the same island.
    pub(super) fn begin(&mut self, context: &StepContext<'_>, members: &[AgentId], dt: f64) {
        self.receive(context, members, dt);
        self.apply_one_sided_laws(context, dt);
        self.ties.gather(context, &self.company);
        self.grips.clear();
    }

    /// Applies springs and gravity for `h` seconds; returns their resistance to further changes in this part, if there are springs.
    pub(super) fn pull(&mut self, h: f64) -> Result<Option<Mat6>, &'static str> {
        self.ties.update_targets(&self.company);
        let under = self.hold.under(h, self.gravity);
        let pulled = linear_spring::pull(&mut self.motion, &self.spread, &mut self.ties.all, &under, &mut self.grips);
        if let Some(pulled) = &pulled {
            self.hold.note(pulled, h);
            let after_s = self.company.after_s;
            self.ties.apply_reactions(&mut self.company, after_s, h);
            self.ties.advance(h);
            self.coupled += self.ties.linked() / self.spread.mass_kg;
            self.world.moved();
        }
        let resistance = pulled.map(|pulled| pulled.resistance);
        if self.motion.is_sane(&self.spread) {
            Ok(resistance)
        } else {
            Err("a spring moved the body out of the coordinate range")
        }
    }

    /// Books the additional impulses of the springs and pressing tools in the last part, of `h` seconds, that follow from the `change` of
    /// the velocities by the island within it.
    pub(super) fn react_to_change(&mut self, change: Twist, h: f64) {
        linear_spring::react_to_change(&self.motion, &self.spread, &mut self.ties.all, change, h);
        for (grip, tie) in self.grips.iter_mut().zip(&self.ties.all) {
            grip.force_n += tie.impulse / h;
        }
        let after_s = self.company.after_s;
        self.ties.apply_reactions(&mut self.company, after_s, h);
        let pushed = leant::give(&self.leant, &mut self.company, change, (after_s, h));
        self.coupled += (self.ties.linked() + pushed) / self.spread.mass_kg;
    }

    /// Ends a step in which its island has moved it.
    pub(super) fn finish_island_step(&mut self, context: &StepContext<'_>, dt: f64, touching: bool, sunk_m: f64) {
        (self.touching, self.sunk_m, self.calm_s) = (touching, Some(sunk_m), 0.0);
        // the island moves it by parts at the speed of their ends
        self.drift_m = drift_of_parts_m(PART_MAX_S.min(dt), self.motion.velocity.distance(self.begun), dt);
        self.steps += 1;
        self.world.moved();
        self.hold.forget();
        self.borne.forget();
        self.settle(context, dt);
        self.lies = None; // other bodies of the island hold it too
    }

    /// The number of parts in a step of `dt` seconds: one in free flight, more in contact or under a spring.
    fn parts(&mut self, dt: f64) -> u32 {
        let alone = self.ties.is_empty() && !self.company.has_tubes();
        let free = alone && self.is_free(self.gravity, dt);
        if free { 1 } else { (dt / (PART_MAX_S * SPLIT_SLACK)).ceil().max(1.0) as u32 }
    }

    /// Whether a joint of the scene holds the body, which is agent `me`.
    fn is_jointed(&mut self, me: AgentId) -> bool {
        let joints = &self.scenery.1;
        *self.jointed.get_or_insert_with(|| joints.iter().any(|joint| joint.holds(me)))
    }

    /// Counts calm time, and stops a body that has been calm long enough.
    fn update_rest(&mut self, dt: f64) -> bool {
        let swing = self.world.mover.radius_m * self.motion.spin(&self.spread).length();
        let still = self.motion.velocity == DVec3::ZERO && self.motion.angular == DVec3::ZERO;
        let held = self.touching && self.motion.velocity.length() + swing < CALM_M_S;
        let calm = self.ties.is_empty() && (held || (still && self.gravity == DVec3::ZERO));
        let calm = calm && self.company.is_calm(CALM_M_S);
        self.calm_s = if calm { self.calm_s + dt } else { 0.0 };
        self.at_rest = self.may_sleep && self.calm_s >= REST_S;
        if self.at_rest {
            (self.motion.velocity, self.motion.angular) = (DVec3::ZERO, DVec3::ZERO);
            self.world.moved();
            self.drift_m = 0.0;
        }
        self.at_rest
    }

    /// Estimates the error of a step of `dt` seconds in so many parts. Flight and impacts are exact; in lasting contact and
    /// under a spring a part's displacement is computed with the speed at its end.
    fn estimate_drift(&mut self, before: &Motion, touched: bool, dt: f64, parts: u32) {
        let pulled = !self.ties.is_empty();
        let part_s = dt / f64::from(parts) / if pulled { 1.0 } else { PASSES as f64 };
        self.drift_m = if pulled || (touched && self.touching) {
            drift_of_parts_m(part_s, self.motion.velocity.distance(before.velocity), dt)
        } else {
            0.0
        };
    }
}

/// The error over [`DRIFT_S`] of parts of this length that use the speed at their ends, where a step of `dt` seconds changed the
/// velocity by `gain_m_s`: ½ h Δv each (docs/theory/control.md, eq. 33).
fn drift_of_parts_m(part_s: f64, gain_m_s: f64, dt: f64) -> f64 {
    0.5 * part_s * gain_m_s * DRIFT_S / dt
}

impl Agent for RigidBody {
    fn model(&self) -> &'static str {
        "rigid"
    }

    /// Advances the body by `dt`: parts of at most 1/240 s in contact or under springs, one part in free flight.
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let dt_s = check_span(dt)?;
        if self.is_jointed(context.me) {
            return island::lead(self, dt, context, &mut [], &mut Vec::new());
        }
        (self.island, self.sunk_m) = (None, None);
        let (before, touching) = (self.motion, self.touching);
        self.begin(context, &[], dt_s);
        if !self.hold.is_known() {
            self.tell(context, dt_s);
        }
        let leans = self.hold.is_known() && !self.ties.is_empty();
        let parts = if leans { 1 } else { self.parts(dt_s) };
        for _ in 0..parts {
            let h = dt_s / f64::from(parts);
            if let Err(what) = if leans { self.lean(h) } else { self.part(h) } {
                (self.motion, self.touching) = (before, touching);
                self.grips.clear();
                self.world.moved();
                return Err(StepError::Diverged { model: "rigid", dt_s, what: what.to_owned() });
            }
        }
        self.steps += 1;
        self.note_borne(context, dt);
        self.estimate_drift(&before, touching, dt_s, parts);
        let at_rest = self.update_rest(dt_s);
        self.tell(context, dt_s);
        self.settle(context, dt_s);
        Ok(StepReport { work: 1.0, substeps: parts, at_rest })
    }

    /// Publishes how springs hold it before it has moved.
    fn observe(&mut self, dt: SimSpan, context: &StepContext<'_>) {
        if let (Ok(dt_s), false) = (check_span(dt), self.is_jointed(context.me)) {
            self.company.gather(context, (&self.world.mover, &self.motion), &[]);
            self.ties.gather(context, &self.company);
            self.tell(context, dt_s);
            self.company.dismiss();
        }
    }

    /// Shortens the step where predictions fail: neither a deformable nor this body can predict how the deformable squeezes it on a static
    /// solid. Nor can a rigid peer predict the ground's reaction to its impacts on this body, nor this body the effect of a tool's drive.
    fn longest_step(&self, dt: SimSpan, context: &StepContext<'_>) -> SimSpan {
        let fall = Fall { gravity: self.gravity, spin_max: self.motion.spin_max(&self.spread) };
        // a body caught in this step may fall in the next
        let soon_s = 2.0 * dt.as_secs_f64();
        let lands = || self.world.free_time(&self.motion, fall, soon_s) < soon_s;
        let owners = context.neighbours.iter().filter(|n| !n.owned && bends(n)).count();
        let squeezes = |n: &Neighbour| bends(n) && (owners > 1 || (!self.stays() && lands()));
        let strikes = |n: &Neighbour| matches!(n.snapshot.body, Body::Rigid(_)) && lands();
        let driven = |n: &Neighbour| is_driven(n, context);
        let wild = |n: &Neighbour| driven(n) || (!n.owned && (squeezes(n) || strikes(n)));
        let part = beside::longest_step(dt, context, || self.bounds(), wild);
        let part = beside::no_longer(part, context, || self.bounds(), |n| driven(n).then_some(PART_MAX_S));
        crowd::crowded(
            part,
            context,
            || self.bounds(),
            crowd::Member {
                bends: false,
                hung: false,
                shares: self.sunk_m.is_some(),
                lies: self.lies.is_some(),
                grounded: self.stand.is_some() || self.lately.is_grounded(),
                lately: self.lately,
            },
        )
    }

    fn shift_clock(&mut self, _by_s: f64) {
        self.borne.forget();
    }

    fn resolution(&self) -> Option<Resolution> {
        None
    }

    /// A rigid body has no nodes to redistribute: nothing changes.
    fn set_resolution(&mut self, _wanted: Resolution) {}

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.company.form.clone())
    }

    fn member(&mut self) -> Option<&mut dyn ClusterMember> {
        Some(self)
    }

    fn island_body(&mut self) -> Option<&mut dyn Any> {
        Some(self)
    }

    fn step_island(
        &mut self,
        dt: SimSpan,
        context: &StepContext<'_>,
        others: &mut [IslandMember<'_>],
        apart: &mut Vec<u32>,
    ) -> Result<StepReport, StepError> {
        island::lead(self, dt, context, others, apart)
    }

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
        (into.residual_m, into.drift_m) = (self.residual_m(), self.drift_m);
        self.write_coupling(into);
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
    /// The body's estimate of its own error: the rounding of its coordinates, the drift of contact and springs
    /// in a tenth of a second, and in contact its penetration depth.
    fn residual_m(&self) -> f64 {
        let size = self.motion.position.abs().max_element() + self.world.mover.radius_m;
        if self.touching {
            let sunk_m = self.sunk_m.unwrap_or_else(|| self.world.depth_m(&self.motion));
            sunk_m + size * f64::from(f32::EPSILON) + self.drift_m
        } else {
            size * f64::EPSILON + self.drift_m
        }
    }
}

/// The shape of `spec` as peers touch it: the one that its own contact solver uses.
fn form_of(spec: &RigidSpec, spread: &MassDistribution, world: &World) -> CollisionShape {
    let (shape, radius_m) = (world.mover.shape.clone(), world.mover.radius_m);
    let solid = match &spec.solid {
        Solid::Mesh { points_m, .. } if world.mover.is_convex() => Solid::Hull { points_m: points_m.clone() },
        solid => solid.clone(),
    };
    let kind = ShapeKind::Solid(SolidShape { solid, shape, com_local: spread.com, radius_m });
    CollisionShape { kind, friction: spec.friction, restitution: spec.restitution }
}
