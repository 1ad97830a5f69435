//! The interface of a body to the cluster that steps it.
//!
//! In: steps, velocities. Out: a matrix, velocities without contact, a skin, how points of it move. Never here: contacts, other bodies.

pub(crate) mod found_places;
pub(crate) mod guarded;
pub(crate) mod memory;
pub(crate) mod participant;
pub(crate) mod problem;

use crate::StepContext;
use crate::solve::{Block, Response, Side};
use glam::{DMat3, DQuat, DVec3};
pub use guarded::{BadAnswer, CallMark, GuardedMember};
pub use memory::{ContactMemory, Partner};
use metachron_core::{AgentId, Anchor, StepError};
use metachron_geometry::narrow_phase::RestShape;
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapePose};
pub use participant::Participant;

/// A body that a cluster steps together with all that it touches. Its unknowns are blocks of three velocities: nodes (m/s), spins (rad/s).
///
/// A step is `begin`, then `move_to` within it where others make shorter steps, then `end`. A refused `begin` leaves the state as it was,
/// and so does a `begin` with no `end`. `keep` and `go_back` frame several steps that may have to be made again.
///
/// A model on which others rest needs the first eight methods and, where it bends, [`Self::move_to`]. What more there is to say of it is
/// in optional traits: [`MemberMotion`], [`Attachments`].
pub trait ClusterMember: Send {
    /// How it takes part.
    fn role(&self) -> Role;

    /// Prepares a step of `h_s` seconds from its present state: its matrix A and the velocities at the step's end without contact.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the matrix has no factor.
    fn begin(&mut self, h_s: f64) -> Result<(), StepError>;

    /// The linear system of the step begun; the empty one of a kinematic body. Its velocities are asked for before a step is begun, too.
    fn system(&self) -> StepSystem<'_> {
        StepSystem::default()
    }

    /// Its skin where it is now; `None` where nothing can touch it.
    fn skin(&self) -> Option<PlacedShape<'_>>;

    /// How the point `place` of its skin moves, for one side of a contact.
    fn skin_point(&self, place: &Place, contact: ContactSide) -> SkinPoint;

    /// Ends the step begun.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the state would not be finite; it is then as it was before.
    fn end(&mut self, step: &StepEnd<'_>) -> Result<(), StepError>;

    /// Keeps the present state, at the end of a step.
    fn keep(&mut self);

    /// Goes back to the state kept last.
    fn go_back(&mut self);

    /// Places the skin where it is `t_s` seconds into the step begun, having moved with the velocities `v` from its start. Only a
    /// deformable is ever within a step: the steps of all others are the shortest of their cluster.
    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        let _ = (v, t_s);
    }

    /// Reads its surroundings at the start of a macro step of `dt_s` seconds: its goal, the bodies that it may grasp.
    fn look(&mut self, context: &StepContext<'_>, dt_s: f64) {
        let _ = (context, dt_s);
    }

    /// By how much the velocities `v` would turn or stretch it in a step of `h_s` seconds, as a share of the most that
    /// its linear forces can take: above 1 the step should be divided. Zero for a body whose forces are exact.
    fn strain(&self, v: &[DVec3], h_s: f64) -> f64 {
        let _ = (v, h_s);
        0.0
    }

    /// Moves it by A⁻¹ of these, N·s² and N·m·s²: impulses times the seconds for which they should have moved it longer; its velocities
    /// stay. A body whose flight is not its centre's alone stays where it is.
    fn carry(&mut self, impulses_n_s2: &[DVec3]) {
        let _ = impulses_n_s2;
    }

    /// Whether it has been still long enough to sleep, as far as it can tell by itself; never of a body that does not sleep.
    fn can_sleep(&self) -> bool {
        false
    }

    /// Stops it: it sleeps until something wakes it.
    fn sleep(&mut self) {}

    /// Divides itself otherwise where it wishes to, after a macro step: the one moment at which the number of its blocks may change by itself.
    fn adapt(&mut self) {}

    /// The cost of the step begun, in the unit of [`metachron_core::StepReport::work`].
    fn work(&self) -> f64 {
        1.0
    }

    /// Its motion as a whole; `None` where [`Self::skin_point`] says all.
    fn motion(&self) -> Option<&dyn MemberMotion> {
        None
    }

    /// Its material points; `None` where nothing is attached to it.
    fn attachments(&self) -> Option<&dyn Attachments> {
        None
    }

    /// Lets an attachment of its own slip or tear.
    fn give_way(&mut self, failure: OwnFailure) {
        let _ = failure;
    }

    /// The partner of an asynchronous pair that it stands for, which is stepped elsewhere; `None` of all others.
    fn remote(&self) -> Option<Remote<'_>> {
        None
    }
}

/// The motion of a body: as a whole, and of its skin.
pub trait MemberMotion: ClusterMember {
    /// Where it is once it has moved for `t_s` seconds with the velocities `v`, of which there need be none where `t_s` is zero; `None` for a
    /// body that does not move as a whole.
    fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        let _ = (v, t_s);
        None
    }

    /// The axes of the world along and about which nothing moves it: its matrix is as good as unbounded there.
    fn locked(&self) -> Option<Locked> {
        None
    }

    /// Its skin once it has gone on from where it is for `t_s` seconds with the velocities `v`; `nodes` is storage for it. `None` for a body
    /// that does not say: its contacts are found near it at the start of a step, however far it goes.
    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        let _ = nodes;
        let skin = self.skin()?;
        let ShapePose::Solid { .. } = skin.view else { return None };
        let Pose { centre_m, rotation, .. } = self.pose(v, t_s)?;
        Some(PlacedShape { view: ShapePose::Solid { position: centre_m, rotation }, ..skin })
    }

    /// Its skin at rest, for a body that touches itself; `None` for one that passes through itself.
    fn rest_shape(&self) -> Option<RestShape<'_>> {
        None
    }

    /// The cell that carries the point `place` of its skin, by its number: all points of one move with the same few blocks. `None` where each
    /// moves by itself.
    fn cell_of(&self, place: &Place) -> Option<u32> {
        let _ = place;
        None
    }

    /// The speed of its fastest point where its blocks have the velocities `v`, m/s.
    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        fastest(v)
    }

    /// Whether it passes through `other` where the two meet, as jaws do through a body that they hold.
    fn passes_through(&self, other: AgentId) -> bool {
        let _ = other;
        false
    }
}

/// The material points of a body, by which others hold it, and the attachments that are its own.
pub trait Attachments {
    /// The material point `anchor`; `None` for one that the body does not have.
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint>;

    /// How the body turns at the material point `anchor` with its blocks; `None` where no block is a spin there.
    fn turn(&self, anchor: Anchor) -> Option<Side> {
        let _ = anchor;
        None
    }

    /// The block as its published state counts it ([`metachron_core::LocalBlock::slot`]).
    fn slot_of(&self, block: usize) -> u32 {
        block as u32
    }

    /// The spring by which it follows its goal, and by which users lead it; `None` for a body that nothing drives.
    fn drive(&self) -> Option<Drive> {
        None
    }

    /// Its own attachments to the world that may tear, with their forces over the step that ended last. Springs to other members, and
    /// springs that yield, are rows of the problem.
    fn own(&self) -> &[OwnAttachment] {
        &[]
    }

    /// The spring of that place among those of its own attachments that yield: a row of the cluster's problem; `None` past the last one.
    fn own_spring(&self, place: usize) -> Option<OwnSpring> {
        let _ = place;
        None
    }
}

/// The linear system of a step begun; all velocities of blocks in one order.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepSystem<'a> {
    /// The lower half of A = M + h C + h² K: symmetric and positive definite, kg or kg·m². Blocks that never move stand for themselves,
    /// and no side refers to them.
    pub blocks: &'a [Block],
    /// The factor of that matrix, where `begin` has made one. Of up to 200 blocks without one the problem makes it; beyond, conjugate
    /// gradients solve the whole cluster.
    pub response: Option<&'a dyn Response>,
    /// The velocity of each block at the end of the step, if nothing touched the body. Where there are momenta unanswered, this is an
    /// estimate: it predicts places, and the solution tells into how many parts the step is divided.
    pub free: &'a [DVec3],
    /// A (v − v̂): the momentum that free velocities v̂ do not answer, where the body leaves it to the cluster to find v, N·s on each block.
    /// Empty for none.
    pub unanswered: &'a [DVec3],
    /// The velocity of each block now.
    pub velocities: &'a [DVec3],
}

/// The end of a step begun, as the cluster found it.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepEnd<'a> {
    /// The velocity of each block.
    pub v: &'a [DVec3],
    /// The step, seconds, > 0.
    pub h_s: f64,
    /// False where nothing acted on the body but impacts at the start, which make the difference of `v` from its free velocities: its
    /// motion after them is then its own.
    pub touched: bool,
    /// The momentum that `v` leaves unanswered, N·s on each block (eq. 17); empty for none.
    pub unanswered: &'a [DVec3],
    /// The places of its skin, as a surface, on which contacts gave impulses.
    pub pressed: &'a [Place],
}

/// The partner of an asynchronous pair.
#[derive(Debug, Clone, Copy)]
pub struct Remote<'a> {
    /// How long an impulse on it takes to show, seconds: a step of its own; 0 of one that answers none.
    pub answers_after_s: f64,
    /// The participants that compute their pairs with it.
    pub partners: &'a [AgentId],
}

/// The greatest of some velocities, m/s.
fn fastest(v: &[DVec3]) -> f64 {
    v.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt()
}

/// How a member takes part in its cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Moves as it is led; whatever it touches gives way. It has no blocks.
    Kinematic,
    /// Moves as a whole: its steps cost next to nothing, so it takes the shortest of its cluster.
    Rigid,
    /// Bends: it keeps steps of its own length.
    Deformable,
}

/// A rigid body that does not move along or about some axes of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Locked {
    /// Whether it is kept from moving along x, y, z.
    pub locked_translation: [bool; 3],
    /// Whether it is kept from turning about x, y, z.
    pub locked_rotation: [bool; 3],
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Its inertia without locks, world axes, kg·m².
    pub inertia: DMat3,
}

/// A point of a body's skin, as one side of a contact sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinPoint {
    /// How it moves with the body's blocks. Its member is left to the caller.
    pub side: Side,
    /// Its velocity beyond that in the step begun, m/s: of a body that is led, all of it.
    pub led_m_s: DVec3,
    /// By how much the skin is there inside the shape that [`ClusterMember::skin`] gives, metres: for a section that is not round the shape
    /// is the round one about it.
    pub recess_m: f64,
}

impl From<Side> for SkinPoint {
    fn from(side: Side) -> Self {
        Self { side, led_m_s: DVec3::ZERO, recess_m: 0.0 }
    }
}

/// A point of a body's matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint {
    /// Its position, metres.
    pub position: DVec3,
    /// How it moves with the body's blocks.
    pub side: Side,
    /// Its velocity beyond that, m/s: of a body that is led.
    pub led_m_s: DVec3,
}

/// A body that moves as a whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Its centre of mass, metres: the origin of [`Anchor::Local`].
    pub centre_m: DVec3,
    /// The origin of its shape's axes, metres.
    pub origin_m: DVec3,
    /// From its shape's axes to the world's.
    pub rotation: DQuat,
    /// How its spin follows from its blocks.
    pub turns: Side,
    /// Its spin beyond that, rad/s: of a body that is led.
    pub led_rad_s: DVec3,
}

/// An attachment that is a body's own, with its force over a step, and the most that it can bear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnAttachment {
    /// Its number among those of the body.
    pub number: u32,
    /// The force on the body, world axes, N: the sum over all of the attachment, and the mean over the step.
    pub force_n: DVec3,
    /// The force above which it tears, N, > 0.
    pub tears_above_n: f64,
}

/// A spring between a point of a body and a place of the world, of an attachment that is the body's own and yields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnSpring {
    /// The number of the attachment among those of the body; it may have other springs.
    pub attachment: u32,
    /// The point that is held.
    pub point: MaterialPoint,
    /// Where it is held, slips included, metres.
    pub place_m: DVec3,
    /// The distance within which it gives nothing, slips included, metres, ≥ 0.
    pub slack_m: f64,
    /// Stiffness, N/m, ≥ 0.
    pub stiffness_n_m: f64,
    /// Damping, N s/m, ≥ 0.
    pub damping_n_s_m: f64,
    /// The most that this spring gives, N, > 0.
    pub yields_above_n: f64,
    /// The force of the whole attachment above which it tears, N; infinite where it never does.
    pub tears_above_n: f64,
}

/// The failure of an attachment that is a body's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OwnFailure {
    /// The spring of this place ([`Attachments::own_spring`]) has slipped.
    Slips(usize, Slid),
    /// The attachment of this number is let go of, for good; it may be so already.
    Tears(u32),
}

/// How far an attachment has slipped.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Slid {
    /// How far the point that it holds at its far end has moved, in that end's axes, metres.
    pub moved_m: DVec3,
    /// How much longer its length at rest, or its greatest length, is, metres.
    pub longer_m: f64,
}

impl std::ops::AddAssign for Slid {
    fn add_assign(&mut self, by: Self) {
        self.moved_m += by.moved_m;
        self.longer_m += by.longer_m;
    }
}

/// A spring between a point of a body and a place that is led, which gives no more than it can.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// The point that is driven.
    pub point: MaterialPoint,
    /// Where it is led to when the step begins, metres.
    pub target_m: DVec3,
    /// How that moves within the step, m/s.
    pub target_m_s: DVec3,
    /// Stiffness, N/m, ≥ 0.
    pub stiffness_n_m: f64,
    /// Damping, N s/m, ≥ 0; one of both above zero.
    pub damping_n_s_m: f64,
    /// The most force that it gives, N, ≥ 0.
    pub limit_n: f64,
}

impl MaterialPoint {
    /// A point that moves with its body's blocks alone.
    #[must_use]
    pub fn new(position: DVec3, side: Side) -> Self {
        Self { position, side, led_m_s: DVec3::ZERO }
    }

    /// A point that no impulse moves.
    #[must_use]
    pub fn led(position: DVec3, led_m_s: DVec3) -> Self {
        Self { position, side: Side::FIXED, led_m_s }
    }
}

impl Pose {
    /// The pose of the world: at rest, at the origin.
    pub const WORLD: Self = Self {
        centre_m: DVec3::ZERO,
        origin_m: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        turns: Side::FIXED,
        led_rad_s: DVec3::ZERO,
    };
}
