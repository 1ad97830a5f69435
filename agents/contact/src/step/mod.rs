//! The steps of a contact cluster: bodies that touch or are joined advance together, each by steps of its own length.
//!
//! In: members at one common time, the static solids, members' memories of each other. Out: members a macro step later.
//! Never here: which bodies belong to a cluster, threads, clocks. Theory: docs/theory/clusters.md, section 9.
//!
//! plan        how many steps each member makes within the macro step; more where its free motion would strain it
//! begin       members whose step begins: matrix and velocities without contact; of all, the velocities predicted without the impulses sought
//! detect      places that may close; which members are a rigid pile, that rapier3d steps
//! assemble    rows of springs, links, lines and joints
//! warm start  contacts begin from the impulses of the last step
//! solve       one problem for all; again with the places that bodies struck would pass, and until joints hold where bodies will be; then contacts
//!             that close fast rebound
//! (plan)      where the solution strains a member too far, all begins again in shorter steps
//! record      impulses that the next step starts from, sums of pairs, yielded attachments
//! integrate   members move; members whose step ends take its velocities
//! tear        attachments that gave more than they can bear are gone from the next macro step on

mod doubling;
mod external;
mod lone;
mod phases;
mod plan;
mod record;
mod report;
mod rigid_pile;
mod solve;

use crate::constraint::failure::Failures;
use crate::constraint::joint::Joints;
use crate::constraint::{ConstraintRows, FailedAttachment, JointTotal};
use crate::detect::{ClusterScene, Search};
use crate::impact::Impacts;
use crate::member::memory::Partner;
use crate::member::participant::Progress;
use crate::member::problem::ProblemMembers;
use crate::member::{ContactMemory, Participant, Role};
use crate::solve::Solver;
use crate::step::report::Sums;
pub use doubling::StepDoubling;
pub use external::{ExternalImpulses, KnownImpulse, LineRow, RemoteImpulse};
use glam::DVec3;
pub use lone::LoneStepper;
use metachron_core::{Archive, ArchiveError, ParallelFor, SimSpan, StepError, Wrench, check_span};
use metachron_geometry::narrow_phase::TouchKey;
pub use plan::{FINE_STEPS_MAX, Plan, STEP_FACTORS_MAX};
pub use report::{ClusterReport, PairTotal};
pub use rigid_pile::FACTORS_SAFE;
use rigid_pile::RigidPile;

/// The surroundings of a macro step, and the threads that make it.
#[derive(Clone, Copy)]
struct On<'a> {
    pub scene: &'a ClusterScene,
    pub threads: &'a dyn ParallelFor,
}

/// Steps clusters one after the other, and keeps structure and storage between them.
#[derive(Default)]
pub struct ClusterStepper {
    /// How many factors each solve has time for; `None` for as many as it takes.
    factors_max: Option<u32>,
    /// How deep contacts rest in the scene of the macro step that is made, metres.
    depth_m: f64,
    pub(crate) solver: Solver,
    search: Search,
    constraints: ConstraintRows,
    joints: Joints,
    pub(crate) progress: Vec<Progress>,
    members: ProblemMembers,
    sums: Sums,
    failures: Failures,
    /// The memories of participants when the macro step began.
    kept: Vec<ContactMemory>,
    /// Whether that is of this macro step, and members have kept their states.
    is_kept: bool,
    impacts: Impacts,
    pile: RigidPile,
    external: ExternalImpulses,
    /// Storage of the places that contacts have taken over in this fine step, and of how their sides are moved.
    taken_over: Vec<(usize, Partner, TouchKey)>,
    moved_m_s: Vec<DVec3>,
    /// The macro step that is made and its fine steps, seconds.
    pub(crate) macro_s: f64,
    pub(crate) fine_s: f64,
}

impl ClusterStepper {
    /// Writes or reads the state that the next macro step needs, but for the part of its members and their memories.
    ///
    /// # Errors
    /// [`ArchiveError`] for a state of another kind.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.solver.archive(archive)?;
        self.pile.archive(archive)
    }

    /// How many steps each solve of the next macro steps has time for, each a factor or its counterpart for gradients; `None` for as many as the
    /// laws take. It makes as many as the scene grants in any case ([`SolveBudget`](crate::detect::SolveBudget)); with time for fewer than three,
    /// rigid bodies that nothing else touches are stepped by rapier3d. Momentum is exact and no answer makes energy at any number.
    pub fn set_factors_max(&mut self, most: Option<u32>) {
        self.factors_max = most;
    }

    /// The macro step that was made last, seconds.
    #[must_use]
    pub const fn macro_s(&self) -> f64 {
        self.macro_s
    }

    /// External impulses on participants of the next step, and the impulses of the last one on remote members.
    pub fn external(&mut self) -> &mut ExternalImpulses {
        &mut self.external
    }

    /// Advances `all`, by rising numbers and at one common time, by `dt`.
    ///
    /// A member whose motion would strain it too far makes 2, 4 … 64 times as many steps: by its free motion before the
    /// solve, and by its solved motion after, from the start of the macro step; so do all rigid members where joints
    /// turn far or do not hold. Members' own work is done on `threads`, if there are enough of them; the bits are the
    /// same on however many.
    ///
    /// # Errors
    /// [`StepError::BadSpan`] for a span that no body steps by. [`StepError::Diverged`] where the state of a member stops being finite: all are
    /// as they were.
    ///
    /// # Panics
    /// Where a member does, or gives an answer that no step can use ([`GuardedMember`](crate::member::GuardedMember)):
    /// all others are as they were.
    pub fn step(
        &mut self,
        scene: &ClusterScene,
        all: &mut [Participant<'_>],
        dt: SimSpan,
        threads: &dyn ParallelFor,
    ) -> Result<ClusterReport, StepError> {
        check_span(dt)?;
        self.is_kept = false;
        self.guard(all, |stepper, all| stepper.make(On { scene, threads }, all, dt))
    }

    /// The same; after a panic members are where it came.
    fn make(&mut self, on: On<'_>, all: &mut [Participant<'_>], dt: SimSpan) -> Result<ClusterReport, StepError> {
        let On { scene, threads } = on;
        self.progress.resize_with(all.len(), Progress::default);
        self.progress.iter_mut().for_each(|state| state.work = 0.0);
        let mut report = ClusterReport::default();
        self.macro_s = dt.as_secs_f64();
        self.depth_m = scene.depth_m();
        self.solver.settings.depth_m = self.depth_m;
        self.joints.missed_m = f64::INFINITY;
        all.iter_mut().for_each(Participant::let_go);
        self.plan(all, self.macro_s, threads)?;
        self.keep(all);
        // each time at least one member makes twice as many steps, at most 64 times as many as it began with, and within the bounds of all
        loop {
            match self.advance(on, all, dt, &mut report) {
                Ok(true) => break,
                Ok(false) => self.go_back(all),
                Err(error) => {
                    self.go_back(all);
                    return Err(error);
                }
            }
        }
        self.failures.end(all, self.macro_s);
        report.work = self.progress.iter().map(|state| state.work).sum();
        Ok(report)
    }

    /// Makes all fine steps of a macro step; false where it was left because a member needs shorter steps.
    fn advance(
        &mut self,
        on: On<'_>,
        all: &mut [Participant<'_>],
        dt: SimSpan,
        report: &mut ClusterReport,
    ) -> Result<bool, StepError> {
        let On { scene, threads } = on;
        let bent = |one: &Participant<'_>| one.member.role() == Role::Deformable;
        let parts = self.progress.iter().map(|state| state.parts).max().unwrap_or(1);
        let h_s = dt.as_secs_f64() / f64::from(parts);
        for (one, state) in all.iter_mut().zip(&mut self.progress) {
            let own = if bent(one) { state.parts } else { parts };
            (state.share, state.part, state.strain_left) = (parts / own, 0, 0.0);
            one.grips.clear();
        }
        self.sums.begin(all.len());
        self.failures.begin();
        self.external.begin();
        report.fine_steps = parts;
        (report.depth_m, report.pile_contacts) = (0.0, 0);
        self.fine_s = h_s;
        for fine in 0..parts {
            report.begun_steps += 1;
            self.external.after_s = f64::from(fine) * h_s;
            self.bound_solves(scene, report);
            self.begin(all, h_s, threads)?;
            self.detect(scene, all, h_s);
            self.assemble(scene, all, h_s, f64::from(fine) * h_s);
            self.warm_start(all, h_s);
            let given = [self.macro_s, h_s, self.depth_m];
            self.impacts.begin(given, &mut self.search, &self.constraints, &self.progress);
            self.solve(on, all, h_s, report)?;
            let most = plan::parts_left(report);
            if self.divide_joints(all, most) || self.divide(all, h_s, most) {
                return Ok(false);
            }
            self.record(all, h_s, dt);
            if fine + 1 == parts {
                self.note_stiffness(all, h_s);
            }
            self.step_pile(all, h_s, report)?;
            self.integrate(all, h_s, threads)?;
            self.pile.place(all);
        }
        Ok(true)
    }

    /// The impulses of pairs and links in the last macro step, by participants and partners.
    pub fn totals(&self) -> &[PairTotal] {
        &self.sums.totals
    }

    /// The same of one participant.
    #[must_use]
    pub fn totals_of(&self, member: usize) -> &[PairTotal] {
        let start = self.sums.totals.partition_point(|total| total.member < member);
        &self.sums.totals[start..self.sums.totals.partition_point(|total| total.member <= member)]
    }

    /// The contact impulse on a participant that moves as a whole in the last macro step, about its centre of mass, N·s
    /// and N·m·s; zero of others.
    #[must_use]
    pub fn wrench_of(&self, member: usize) -> Wrench {
        self.sums.wrenches.get(member).copied().unwrap_or_default()
    }

    /// The impulses of hinges and slides in the last macro step along the directions that they leave free.
    pub fn efforts(&self) -> &[JointTotal] {
        &self.sums.efforts
    }

    /// Attachments that tore in the last macro step, by participants: no later step knows them.
    pub fn torn(&self) -> &[FailedAttachment] {
        &self.failures.torn
    }

    /// Attachments that began to yield in the last macro step: no later step reports them again.
    pub fn yielded(&self) -> &[FailedAttachment] {
        &self.failures.yielded
    }

    /// Whether every attachment held in the last macro step as it had held before.
    #[must_use]
    pub fn held_fast(&self) -> bool {
        self.torn().is_empty() && self.yielded().is_empty()
    }

    /// Whether members that hardly move may rest: not where an attachment has just given way, which may have kept them still until now, or where
    /// a motor keeps a joint moving, however slowly.
    #[must_use]
    pub fn lets_rest(&self) -> bool {
        self.held_fast() && !self.joints.drives
    }

    /// How many times as many steps as it made in the last macro step the motion of a participant asked for, > 1, where that were more than a
    /// step may be divided into; 0 where they were not.
    #[must_use]
    pub fn strain_left(&self, member: usize) -> f64 {
        self.progress.get(member).map_or(0.0, |state| state.strain_left)
    }

    /// Work of a participant's own steps in the last macro step, in the unit of its model.
    #[must_use]
    pub fn work_of(&self, member: usize) -> f64 {
        self.progress.get(member).map_or(0.0, |state| state.work)
    }

    /// Pairs of participants of the last step that are near each other, by their places in its list.
    pub fn near(&self) -> &[[usize; 2]] {
        &self.search.near
    }
}
