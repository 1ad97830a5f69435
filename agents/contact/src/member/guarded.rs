//! A member of a cluster whose code may be a third party's: every call of it is marked while it runs, and its answers
//! are checked.
//!
//! In: a member, the mark of its agent. Out: the same answers; from one that no step can go on with the call never returns, it unwinds like a
//! panic of the member. Its catcher finds by the marks whose code it was. Never here: the fate of the agent, catching.

use crate::StepContext;
use crate::member::{ClusterMember, Drive, Locked, MaterialPoint, OwnAttachment, OwnSpring, Pose, Role, Slid};
use crate::solve::{Block, Response, Side};
use glam::DVec3;
use metachron_core::{AgentId, Anchor, StepError};
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

impl<'a, M: ClusterMember> From<&'a mut M> for GuardedMember<'a> {
    fn from(inner: &'a mut M) -> Self {
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
        let blocks = mark.during(|| inner.velocities().len());
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
        self.response().map(|by| Lent { by, mark: self.mark })
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
    fn tell<T>(&mut self, call: impl FnOnce(&mut dyn ClusterMember) -> T) -> T {
        marked(self.mark, || call(&mut *self.inner))
    }

    /// Lets it begin or end a step, and checks how it then is.
    fn step(&mut self, call: impl FnOnce(&mut dyn ClusterMember) -> Result<(), StepError>) -> Result<(), StepError> {
        let Self { inner, mark, blocks } = self;
        let Some(mark) = mark else { return call(&mut **inner) };
        let outcome = mark.during(|| {
            call(&mut **inner)?;
            *blocks = inner.velocities().len();
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
    let (size, free, unanswered) = (member.velocities().len(), member.free().len(), member.unanswered().len());
    if free != size {
        return Some(format!("{free} free velocities; expected one for each of its {size} velocities"));
    }
    if unanswered != 0 && unanswered != size {
        return Some(format!(
            "{unanswered} momenta unanswered; expected none or one for each of its {size} velocities"
        ));
    }
    if let Some(block) = member.blocks().iter().find(|block| block.row >= size || block.column > block.row) {
        return Some(format!("block {}, {} of a matrix whose lower half has {size} rows", block.row, block.column));
    }
    let is_finite = |list: &[DVec3]| list.iter().all(|v| v.is_finite());
    if !is_finite(member.velocities()) || !is_finite(member.free()) {
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

fn vector_fault(what: &'static str) -> impl FnOnce(&DVec3) -> Option<String> {
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

impl ClusterMember for GuardedMember<'_> {
    fn role(&self) -> Role {
        self.ask(|m| m.role(), any)
    }

    fn look(&mut self, context: &StepContext<'_>, dt_s: f64) {
        self.tell(|m| m.look(context, dt_s));
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.step(|m| m.begin(h_s))
    }

    fn blocks(&self) -> &[Block] {
        self.ask(|m| m.blocks(), any)
    }

    fn locked(&self) -> Option<Locked> {
        self.ask(|m| m.locked(), any)
    }

    fn response(&self) -> Option<&dyn Response> {
        self.ask(|m| m.response(), any)
    }

    fn free(&self) -> &[DVec3] {
        self.ask(|m| m.free(), any)
    }

    fn unanswered(&self) -> &[DVec3] {
        self.ask(|m| m.unanswered(), any)
    }

    fn velocities(&self) -> &[DVec3] {
        self.ask(|m| m.velocities(), any)
    }

    fn leave(&mut self, unanswered: &[DVec3]) {
        self.tell(|m| m.leave(unanswered));
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        self.ask(|m| m.skin(), skin_fault)
    }

    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        self.ask(|m| m.skin_after(v, t_s, nodes), skin_fault)
    }

    fn rest_shape(&self) -> Option<RestShape<'_>> {
        self.ask(|m| m.rest_shape(), any)
    }

    fn side(&self, place: &Place, contact: ContactSide) -> Side {
        self.ask(|m| m.side(place, contact), |side| self.side_fault(side))
    }

    fn cell_of(&self, place: &Place) -> Option<u32> {
        self.ask(|m| m.cell_of(place), any)
    }

    fn recess_m(&self, place: &Place, contact: ContactSide) -> f64 {
        self.ask(|m| m.recess_m(place, contact), number_fault("a recess"))
    }

    fn led_m_s(&self, place: &Place) -> DVec3 {
        self.ask(|m| m.led_m_s(place), vector_fault("a led velocity"))
    }

    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        self.ask(|m| m.anchor(anchor), |point| self.point_fault(point.as_ref()?))
    }

    fn turn(&self, anchor: Anchor) -> Option<Side> {
        self.ask(|m| m.turn(anchor), |side| self.side_fault(side.as_ref()?))
    }

    fn slot_of(&self, block: usize) -> u32 {
        self.ask(|m| m.slot_of(block), any)
    }

    fn answers_after_s(&self) -> f64 {
        self.ask(|m| m.answers_after_s(), number_fault("a delay"))
    }

    fn is_remote(&self) -> bool {
        self.ask(|m| m.is_remote(), any)
    }

    fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        let fault = |pose: &Option<Pose>| {
            let Pose { centre_m, origin_m, rotation, turns, led_rad_s } = pose.as_ref()?;
            let is_sound = [centre_m, origin_m, led_rad_s].iter().all(|v| v.is_finite()) && rotation.is_finite();
            if is_sound { self.side_fault(turns) } else { Some("a pose that is not finite".to_owned()) }
        };
        self.ask(|m| m.pose(v, t_s), fault)
    }

    fn drive(&self) -> Option<Drive> {
        self.ask(|m| m.drive(), |drive| self.point_fault(&drive.as_ref()?.point))
    }

    fn is_led(&self) -> bool {
        self.ask(|m| m.is_led(), any)
    }

    fn spares(&self, other: AgentId) -> bool {
        self.ask(|m| m.spares(other), any)
    }

    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        self.ask(|m| m.speed_bound(v), number_fault("a speed"))
    }

    fn strain(&self, v: &[DVec3], h_s: f64) -> f64 {
        self.ask(|m| m.strain(v, h_s), any)
    }

    fn carry(&mut self, impulses_n_s2: &[DVec3]) {
        self.tell(|m| m.carry(impulses_n_s2));
    }

    fn keep(&mut self) {
        self.tell(|m| m.keep());
    }

    fn go_back(&mut self) {
        self.tell(|m| m.go_back());
    }

    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        self.tell(|m| m.move_to(v, t_s));
    }

    fn end(&mut self, v: &[DVec3], h_s: f64, touched: bool) -> Result<(), StepError> {
        self.step(|m| m.end(v, h_s, touched))
    }

    fn attachments(&self) -> &[OwnAttachment] {
        self.ask(|m| m.attachments(), any)
    }

    fn own_spring(&self, place: usize) -> Option<OwnSpring> {
        self.ask(|m| m.own_spring(place), |spring| self.point_fault(&spring.as_ref()?.point))
    }

    fn slip(&mut self, place: usize, by: Slid) {
        self.tell(|m| m.slip(place, by));
    }

    fn let_go(&mut self, number: u32) {
        self.tell(|m| m.let_go(number));
    }

    fn is_calm(&self) -> bool {
        self.ask(|m| m.is_calm(), any)
    }

    fn rest(&mut self) {
        self.tell(|m| m.rest());
    }

    fn work(&self) -> f64 {
        self.ask(|m| m.work(), number_fault("a work"))
    }
}

#[cfg(test)]
mod tests {
    /// The names of the methods in the block of `text` that begins with `head`.
    fn methods(text: &str, head: &str) -> Vec<String> {
        let block = text.split(head).nth(1).and_then(|rest| rest.split("\n}\n").next()).unwrap();
        let heads = block.lines().filter_map(|line| line.strip_prefix("    fn "));
        let mut names: Vec<_> = heads.map(|head| head.split(['(', '<']).next().unwrap().to_owned()).collect();
        names.sort_unstable();
        names
    }

    #[test]
    fn every_method_of_a_member_is_passed_on() {
        let wanted = methods(include_str!("mod.rs"), "pub trait ClusterMember");
        assert!(wanted.len() > 30, "{wanted:?}");
        assert_eq!(methods(include_str!("guarded.rs"), "impl ClusterMember for GuardedMember"), wanted);
    }
}
