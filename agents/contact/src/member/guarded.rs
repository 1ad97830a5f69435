//! A member of a cluster whose code may be a third party's: every call of it is marked while it runs, and its answers
//! are checked.
//!
//! In: a member, the mark of its agent. Out: the same answers; from one that no step can go on with the call never returns, it unwinds like a
//! panic of the member. Its catcher finds by the marks whose code it was. Never here: the fate of the agent, catching.

use crate::member::{
    ClusterMember, Drive, Locked, MaterialPoint, OwnAttachment, OwnSpring, Pose, Role, SkinPoint, StepEnd, StepSystem,
    fastest,
};
use crate::solve::{Response, Side};
use glam::DVec3;
use metachron_core::{AgentId, Anchor, Impulse, StepError};
use metachron_geometry::narrow_phase::RestShape;
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapePose};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Whether code of an agent's model runs, readable from any thread. It stays so where that code has panicked, or has given an answer that no
/// step can use: the model is not called again then.
#[derive(Debug, Default)]
pub struct CallMark {
    running: AtomicBool,
    refused: AtomicBool,
}

/// The reason why a call of a model unwinds that has not panicked: its answer, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BadAnswer(pub String);

/// A member whose calls are marked.
pub struct GuardedMember<'a> {
    inner: &'a mut dyn ClusterMember,
    /// `None` for a member that is not watched: its panics are its caller's, and its answers are taken as they are.
    mark: Option<&'a CallMark>,
    /// How many blocks it has, of a member that is watched.
    blocks: usize,
}

impl CallMark {
    /// Runs a call of the model.
    pub fn during<T>(&self, call: impl FnOnce() -> T) -> T {
        // a plain store each: an unwinding call leaves the first one standing
        self.running.store(true, Relaxed);
        let answer = call();
        self.running.store(false, Relaxed);
        answer
    }

    /// Whether its code runs; where no call is in progress, whether the last one unwound.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.running.load(Relaxed)
    }

    /// Takes it back that a call unwound: all of the model's state was read anew.
    pub fn clear(&self) {
        self.running.store(false, Relaxed);
        self.refused.store(false, Relaxed);
    }

    /// Whether the model has refused a step, by an error, since this was asked last.
    pub fn take_refused(&self) -> bool {
        self.refused.load(Relaxed) && self.refused.swap(false, Relaxed)
    }
}

/// Runs a call of a model, marked where it is watched.
fn marked<T>(mark: Option<&CallMark>, call: impl FnOnce() -> T) -> T {
    match mark {
        Some(mark) => mark.during(call),
        None => call(),
    }
}

/// The factor that a member lends: its calls are marked, too.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lent<'a> {
    by: &'a dyn Response,
    mark: Option<&'a CallMark>,
}

impl Response for Lent<'_> {
    fn respond(&self, impulses: &mut [DVec3]) {
        marked(self.mark, || self.by.respond(impulses));
    }
}

impl<'a> From<&'a mut dyn ClusterMember> for GuardedMember<'a> {
    fn from(inner: &'a mut dyn ClusterMember) -> Self {
        Self { inner, mark: None, blocks: 0 }
    }
}

impl<'a> GuardedMember<'a> {
    /// `inner`, whose calls `mark` marks.
    ///
    /// # Panics
    /// Where `inner` does.
    pub fn new(inner: &'a mut dyn ClusterMember, mark: &'a CallMark) -> Self {
        // points of it are asked for before it begins a step
        let blocks = mark.during(|| inner.system().velocities.len());
        Self { inner, mark: Some(mark), blocks }
    }

    /// Whether a call of it has unwound: its state is not known then.
    pub(crate) fn is_broken(&self) -> bool {
        self.mark.is_some_and(CallMark::is_running)
    }

    /// Forgets a refused step, where the step was only tried.
    pub(crate) fn forgive(&self) {
        self.mark.map(CallMark::take_refused);
    }

    /// The factor of its matrix, where it lends one.
    pub(crate) fn lent(&self) -> Option<Lent<'_>> {
        self.system().response.map(|by| Lent { by, mark: self.mark })
    }

    /// Ends the step for an answer that was found to be of no use only then; nothing for a member whose calls are not marked.
    pub(crate) fn reject(&self, what: String) {
        if let Some(mark) = self.mark {
            mark.during(|| reject(what));
        }
    }

    /// Asks it, and checks the answer.
    fn ask<'s, T>(
        &'s self,
        call: impl FnOnce(&'s dyn ClusterMember) -> T,
        fault: impl FnOnce(&T) -> Option<String>,
    ) -> T {
        let inner: &'s dyn ClusterMember = &*self.inner;
        let Some(mark) = self.mark else { return call(inner) };
        mark.during(|| {
            let answer = call(inner);
            if let Some(what) = fault(&answer) {
                reject(what);
            }
            answer
        })
    }

    /// Lets it change its state.
    pub fn change<T>(&mut self, call: impl FnOnce(&mut dyn ClusterMember) -> T) -> T {
        marked(self.mark, || call(&mut *self.inner))
    }

    /// Lets it begin or end a step, and checks how it then is.
    fn step(&mut self, call: impl FnOnce(&mut dyn ClusterMember) -> Result<(), StepError>) -> Result<(), StepError> {
        let Self { inner, mark, blocks } = self;
        let Some(mark) = mark else { return call(&mut **inner) };
        let outcome = mark.during(|| {
            call(&mut **inner)?;
            *blocks = inner.system().velocities.len();
            if let Some(what) = lengths_fault(&**inner) {
                reject(what);
            }
            Ok(())
        });
        if outcome.is_err() {
            mark.refused.store(true, Relaxed);
        }
        outcome
    }

    fn side_fault(&self, side: &Side) -> Option<String> {
        let blocks = self.blocks;
        side.terms().iter().find_map(|term| match term.block {
            block if block >= blocks => Some(format!("a side with block {block}; expected one of its {blocks}")),
            _ if !term.map.is_finite() => Some("a side whose map is not finite".to_owned()),
            _ => None,
        })
    }

    fn point_fault(&self, point: &MaterialPoint) -> Option<String> {
        if !(point.position.is_finite() && point.led_m_s.is_finite()) {
            return Some(format!("a material point at {}, led by {} m/s", point.position, point.led_m_s));
        }
        self.side_fault(&point.side)
    }
}

/// Ends a call that has answered `what`.
fn reject(what: String) {
    // no message is printed: the reason to park says it
    resume_unwind(Box::new(BadAnswer(what)));
}

/// The fault in the lists of a member after a step was begun or ended, or in the place of its skin, if there is one. Its matrix is looked through where it
/// is used.
fn lengths_fault(member: &dyn ClusterMember) -> Option<String> {
    let system = member.system();
    let (size, free, unanswered) = (system.velocities.len(), system.free.len(), system.unanswered.len());
    if free != size {
        return Some(format!("{free} free velocities; expected one for each of its {size} velocities"));
    }
    if unanswered != 0 && unanswered != size {
        return Some(format!(
            "{unanswered} momenta unanswered; expected none or one for each of its {size} velocities"
        ));
    }
    if let Some(block) = system.blocks.iter().find(|block| block.row >= size || block.column > block.row) {
        return Some(format!("block {}, {} of a matrix whose lower half has {size} rows", block.row, block.column));
    }
    let is_finite = |list: &[DVec3]| list.iter().all(|v| v.is_finite());
    if !is_finite(system.velocities) || !is_finite(system.free) {
        return Some("a velocity that is not finite".to_owned());
    }
    let is_sound = match member.skin()?.view {
        ShapePose::Chain { positions, radii_m } => is_finite(positions) && radii_m.iter().all(|r| r.is_finite()),
        ShapePose::Surface(positions) => is_finite(positions),
        // seen wherever it is asked for
        ShapePose::Solid { .. } | ShapePose::Tool { .. } => true,
    };
    (!is_sound).then(|| "a skin that is not finite".to_owned())
}

fn number_fault(what: &'static str) -> impl FnOnce(&f64) -> Option<String> {
    move |x| (!x.is_finite()).then(|| format!("{what} of {x}"))
}

fn skin_fault(skin: &Option<PlacedShape<'_>>) -> Option<String> {
    let is_sound = match skin.as_ref()?.view {
        ShapePose::Solid { position, rotation } => position.is_finite() && rotation.is_finite(),
        ShapePose::Tool { tip, rotation, jaw } => tip.is_finite() && rotation.is_finite() && jaw.is_finite(),
        // their nodes are looked through once a step
        ShapePose::Chain { .. } | ShapePose::Surface(_) => true,
    };
    (!is_sound).then(|| "a skin that is not finite".to_owned())
}

/// Finds no fault: every answer will do.
fn any<T>(_: &T) -> Option<String> {
    None
}

/// Its answers, where it has any; the defaults of its optional traits where it has none of these.
impl GuardedMember<'_> {
    /// [`ClusterMember::role`].
    #[must_use]
    pub fn role(&self) -> Role {
        self.ask(|m| m.role(), any)
    }

    pub(crate) fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.step(|m| m.begin(h_s))
    }

    /// [`ClusterMember::system`]. Calls of its factor are not marked.
    #[must_use]
    pub fn system(&self) -> StepSystem<'_> {
        self.ask(|m| m.system(), any)
    }

    /// [`ClusterMember::skin`].
    #[must_use]
    pub fn skin(&self) -> Option<PlacedShape<'_>> {
        self.ask(|m| m.skin(), skin_fault)
    }

    pub(crate) fn skin_after<'b>(
        &'b self,
        v: &[DVec3],
        t_s: f64,
        nodes: &'b mut Vec<DVec3>,
    ) -> Option<PlacedShape<'b>> {
        self.ask(|m| m.motion()?.skin_after(v, t_s, nodes), skin_fault)
    }

    pub(crate) fn rest_shape(&self) -> Option<RestShape<'_>> {
        self.ask(|m| m.motion()?.rest_shape(), any)
    }

    /// [`ClusterMember::skin_point`].
    #[must_use]
    pub fn skin_point(&self, place: &Place, contact: ContactSide) -> SkinPoint {
        let fault = |point: &SkinPoint| {
            let SkinPoint { side, led_m_s, recess_m } = point;
            let is_sound = led_m_s.is_finite() && recess_m.is_finite();
            if is_sound { self.side_fault(side) } else { Some(format!("{recess_m} m inside, led by {led_m_s} m/s")) }
        };
        self.ask(|m| m.skin_point(place, contact), fault)
    }

    pub(crate) fn cell_of(&self, place: &Place) -> Option<u32> {
        self.ask(|m| m.motion()?.cell_of(place), any)
    }

    pub(crate) fn speed_bound(&self, v: &[DVec3]) -> f64 {
        self.ask(|m| m.motion().map_or_else(|| fastest(v), |m| m.speed_bound(v)), number_fault("a speed"))
    }

    /// Whether it passes through `other`, or stands for a partner of others alone.
    pub(crate) fn passes_through(&self, other: AgentId) -> bool {
        let passes = |m: &dyn ClusterMember| {
            m.remote().is_some_and(|remote| !remote.partners.contains(&other))
                || m.motion().is_some_and(|motion| motion.passes_through(other))
        };
        self.ask(passes, any)
    }

    pub(crate) fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        let fault = |pose: &Option<Pose>| {
            let Pose { centre_m, origin_m, rotation, turns, led_rad_s } = pose.as_ref()?;
            let is_sound = [centre_m, origin_m, led_rad_s].iter().all(|v| v.is_finite()) && rotation.is_finite();
            if is_sound { self.side_fault(turns) } else { Some("a pose that is not finite".to_owned()) }
        };
        self.ask(|m| m.motion()?.pose(v, t_s), fault)
    }

    pub(crate) fn locked(&self) -> Option<Locked> {
        self.ask(|m| m.motion()?.locked(), any)
    }

    pub(crate) fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        self.ask(|m| m.attachments()?.anchor(anchor), |point| self.point_fault(point.as_ref()?))
    }

    /// The sides at the material point `anchor` with their shares of an impulse and an angular one there, but for those that are zero.
    pub(crate) fn visit_sides(&self, anchor: Anchor, impulse: Impulse, mut visit: impl FnMut(Side, DVec3)) {
        if let Some(point) = self.anchor(anchor).filter(|_| impulse.linear != DVec3::ZERO) {
            visit(point.side, impulse.linear);
        }
        let turn = self.ask(|m| m.attachments()?.turn(anchor), |side| self.side_fault(side.as_ref()?));
        if let Some(side) = turn.filter(|_| impulse.angular != DVec3::ZERO) {
            visit(side, impulse.angular);
        }
    }

    pub(crate) fn slot_of(&self, block: usize) -> u32 {
        self.ask(|m| m.attachments().map_or(block as u32, |points| points.slot_of(block)), any)
    }

    pub(crate) fn drive(&self) -> Option<Drive> {
        self.ask(|m| m.attachments()?.drive(), |drive| self.point_fault(&drive.as_ref()?.point))
    }

    /// Whether the springs of users lead it instead of pulling at it. A remote member's own cluster solves its contacts with static solids.
    pub(crate) fn is_led(&self) -> bool {
        self.role() == Role::Kinematic || self.is_remote() || self.drive().is_some()
    }

    pub(crate) fn own_attachments(&self) -> &[OwnAttachment] {
        self.ask(|m| m.attachments().map_or(&[][..], |points| points.own()), any)
    }

    pub(crate) fn own_spring(&self, place: usize) -> Option<OwnSpring> {
        self.ask(|m| m.attachments()?.own_spring(place), |spring| self.point_fault(&spring.as_ref()?.point))
    }

    pub(crate) fn is_remote(&self) -> bool {
        self.ask(|m| m.remote().is_some(), any)
    }

    pub(crate) fn answers_after_s(&self) -> f64 {
        self.ask(|m| m.remote().map_or(0.0, |remote| remote.answers_after_s), number_fault("a delay"))
    }

    pub(crate) fn strain(&self, v: &[DVec3], h_s: f64) -> f64 {
        self.ask(|m| m.strain(v, h_s), any)
    }

    pub(crate) fn end(&mut self, step: &StepEnd<'_>) -> Result<(), StepError> {
        self.step(|m| m.end(step))
    }

    /// [`ClusterMember::can_sleep`].
    #[must_use]
    pub fn can_sleep(&self) -> bool {
        self.ask(|m| m.can_sleep(), any)
    }

    pub(crate) fn work(&self) -> f64 {
        self.ask(|m| m.work(), number_fault("a work"))
    }
}
