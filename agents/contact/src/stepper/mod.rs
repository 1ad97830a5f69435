//! The steps of a contact cluster: bodies that touch or are joined advance together, each by steps of its own length.
//!
//! In: members at one common time, the static solids, what members remember of each other. Out: members a macro step later.
//! Never here: which bodies belong to a cluster, threads, clocks. Theory: docs/theory/clusters.md, section 9.
//!
//! plan      how many steps each member makes within the macro step; more where its free motion would strain it
//! begin     members whose step begins: matrix and velocities without contact
//! seen      velocities with the impulses that each has been given since its step began
//! search    places that may close; which members are a heap, that rapier3d steps
//! tie       springs, links, joints
//! solve     one problem for all; again with the places that bodies struck would pass, and until joints hold where bodies will be
//! rebound   contacts that close fast, by their restitution
//! divide    where the solution strains a member too far, all begins again in shorter steps
//! end       members move; those whose step ends take its velocities
//! yield     attachments that gave all that they may hold from then on where they have come to
//! tear      attachments that gave more than they can bear are gone from the next macro step on

mod arms;
mod between_steps;
mod contact_rows;
mod divide;
mod domain;
mod doubling;
mod guarded;
mod heap;
mod impacts;
mod joints;
mod links;
mod local;
mod matter;
mod member;
mod memory;
mod motors;
mod outside;
mod own_springs;
mod pair_total;
mod participant;
mod plan;
mod progress;
mod remote;
mod restart;
mod scene;
mod search;
mod solve;
mod springs;
mod stiffness;
mod tearing;
mod ties;
mod weighing;
mod yielding;

use crate::cluster::{DEPTH_DEFAULT_M, Level, Member, Settings, Solver, multiply};
use contact_rows::ContactRows;
use divide::times;
pub use doubling::StepDoubling;
use glam::DVec3;
use guarded::Lent;
pub use guarded::{BadAnswer, CallMark, GuardedMember};
use heap::{Heap, Sums};
use impacts::Impacts;
pub use joints::JointTotal;
use joints::Joints;
pub use local::LocalQuery;
pub use matter::Matter;
pub use member::{ClusterMember, Drive, Locked, MaterialPoint, OwnAttachment, OwnSpring, Pose, Role, Slid};
pub use memory::{ContactMemory, Partner};
use metachron_core::parallel::for_each;
use metachron_core::{Archive, ArchiveError, ParallelFor, SimSpan, StepError, Wrench, check_span};
pub use outside::{KnownImpulse, LineRow, Outside, RemoteImpulse};
pub use pair_total::PairTotal;
pub use participant::Participant;
pub use plan::Plan;
use progress::Progress;
pub use remote::{RemoteMember, RemoteView};
pub use scene::{
    BadDepth, BadLeastSteps, ClusterScene, DEPTH_RANGE_M, LEAST_STEPS_DEFAULT, LEAST_STEPS_RANGE, Passage, SolveBudget,
};
use search::{Judge, Round, Search};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use tearing::Tearing;
pub use tearing::Torn;
use ties::{FineStep, Ties};
pub use yielding::Yielded;
use yielding::Yielding;

/// The surroundings of a macro step, and the threads that make it.
#[derive(Clone, Copy)]
struct On<'a> {
    scene: &'a ClusterScene,
    threads: &'a dyn ParallelFor,
}

/// What a macro step was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ClusterReport {
    /// Fine steps that it was made in.
    pub fine_steps: u32,
    /// Contacts of the last fine step, those that bear nothing included.
    pub contacts: u32,
    /// Those of them that are a heap's, which rapier3d has; all others are the problem's.
    pub heap_contacts: u32,
    /// Factors of the coupled matrix in all fine steps.
    pub factors: u32,
    /// Products of conjugate gradients in all fine steps: of the iterative form, which makes no factors.
    pub products: u32,
    /// Solves in all fine steps.
    pub solves: u32,
    /// Those of them that ended within interior points, before all laws held.
    pub unfinished: u32,
    /// The dearest level of a solve.
    pub level: Level,
    /// What laws and momentum miss at most by the answer of any solve, m/s (clusters.md, eq. 9).
    pub miss_m_s: f64,
    /// The deepest overlap seen, metres.
    pub depth_m: f64,
    /// Work of all members, in the unit of [`metachron_core::StepReport::work`].
    pub work: f64,
}

/// Steps clusters one after the other, and keeps structure and storage between them.
pub struct ClusterStepper {
    /// How deep contacts rest in the scene of the macro step that is made, metres.
    depth_m: f64,
    solver: Solver,
    search: Search,
    ties: Ties,
    joints: Joints,
    contact_rows: ContactRows,
    progress: Vec<Progress>,
    members: Vec<Member<'static>>,
    lent: Vec<Option<Lent<'static>>>,
    totals: Vec<PairTotal>,
    /// What contacts gave each participant in the macro step, N·s and N·m·s.
    wrenches: Vec<Wrench>,
    efforts: Vec<JointTotal>,
    tearing: Tearing,
    yielding: Yielding,
    /// What participants remembered when the macro step began.
    kept: Vec<ContactMemory>,
    /// Whether that is of this macro step, and members have kept their states.
    is_kept: bool,
    impacts: Impacts,
    heap: Heap,
    /// The participant of each member of the problem.
    places: Vec<usize>,
    outside: Outside,
    /// Storage of local models, and of how the sides of contacts are moved.
    local: [Vec<DVec3>; 2],
    moved_m_s: Vec<DVec3>,
    /// The macro step that is made and its fine steps, seconds.
    macro_s: f64,
    fine_s: f64,
    /// How many times as many fine steps joints ask for that do not hold, or in which bodies turn too far.
    joints_ask: u32,
    /// What joints missed in this macro step when they did not hold last, metres or radians.
    joints_missed_m: f64,
}

impl Default for ClusterStepper {
    fn default() -> Self {
        Self {
            depth_m: DEPTH_DEFAULT_M,
            solver: Solver::new(Settings::default()),
            search: Search::default(),
            ties: Ties::default(),
            joints: Joints::default(),
            contact_rows: ContactRows::default(),
            progress: Vec::new(),
            members: Vec::new(),
            lent: Vec::new(),
            totals: Vec::new(),
            wrenches: Vec::new(),
            efforts: Vec::new(),
            tearing: Tearing::default(),
            yielding: Yielding::default(),
            kept: Vec::new(),
            is_kept: false,
            impacts: Impacts::default(),
            heap: Heap::default(),
            places: Vec::new(),
            outside: Outside::default(),
            local: Default::default(),
            moved_m_s: Vec::new(),
            macro_s: 0.0,
            fine_s: 0.0,
            joints_ask: 1,
            joints_missed_m: f64::INFINITY,
        }
    }
}

impl ClusterStepper {
    /// Writes or reads what the next macro step needs of those before, but for what its members and their memories know.
    ///
    /// # Errors
    /// [`ArchiveError`] for what is no state of a stepper.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.solver.archive(archive)?;
        self.heap.archive(archive)
    }

    /// The most steps of each solve from now on, each a factor or what serves gradients for one; `None` for as many as the laws take. Momentum is
    /// exact and no answer makes energy at any number.
    pub fn set_factors_max(&mut self, most: Option<u32>) {
        self.solver.set_factors_max(most);
        self.impacts.set_factors_max(most);
    }

    /// The macro step that was made last, seconds.
    #[must_use]
    pub const fn macro_s(&self) -> f64 {
        self.macro_s
    }

    /// What acts on participants of the next step from outside, and what the last one gave to remote members.
    pub fn outside(&mut self) -> &mut Outside {
        &mut self.outside
    }

    /// Advances `all`, by rising numbers and at one common time, by `dt`.
    ///
    /// A member whose motion would strain it too far makes 2, 4 … 64 times as many steps: its free motion before the solve, and what the
    /// solve makes of it after, from the start of the macro step; so do all rigid members where joints turn far or do not hold. What members do by themselves they do on `threads`, if there are enough of
    /// them; the bits are the same on however many.
    ///
    /// # Errors
    /// [`StepError::BadSpan`] for a span that no body steps by. [`StepError::Diverged`] where the state of a member stops being finite: all are
    /// as they were.
    ///
    /// # Panics
    /// Where a member does, or answers what no step goes on with ([`GuardedMember`]): all others are as they were.
    pub fn step(
        &mut self,
        scene: &ClusterScene,
        all: &mut [Participant<'_>],
        dt: SimSpan,
        threads: &dyn ParallelFor,
    ) -> Result<ClusterReport, StepError> {
        check_span(dt)?;
        self.is_kept = false;
        let made = catch_unwind(AssertUnwindSafe(|| self.make(On { scene, threads }, all, dt)));
        made.unwrap_or_else(|panic| {
            self.put_back(all);
            resume_unwind(panic)
        })
    }

    /// The same; after a panic members are where it came.
    fn make(&mut self, on: On<'_>, all: &mut [Participant<'_>], dt: SimSpan) -> Result<ClusterReport, StepError> {
        let On { scene, threads } = on;
        self.progress.resize_with(all.len(), Progress::default);
        self.progress.iter_mut().for_each(|state| state.work = 0.0);
        let mut report = ClusterReport::default();
        self.macro_s = dt.as_secs_f64();
        self.depth_m = scene.depth_m();
        self.solver.set_depth_m(self.depth_m);
        self.joints_missed_m = f64::INFINITY;
        all.iter_mut().for_each(Participant::let_go);
        self.foresee(all, self.macro_s, threads)?;
        self.keep(all);
        // each time at least one member makes twice as many steps, at most 64 times as many as it began with
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
        self.tearing.end(all, self.macro_s);
        report.work = self.progress.iter().map(|state| state.work).sum();
        Ok(report)
    }

    /// Begins the first step of every member, in as many parts as its free motion needs.
    fn foresee(&mut self, all: &mut [Participant<'_>], dt_s: f64, threads: &dyn ParallelFor) -> Result<(), StepError> {
        for_each(threads, all, &mut self.progress, &Participant::size, &|one, state| {
            let own_s = dt_s / f64::from(one.parts);
            one.member.look(&one.context, dt_s);
            state.begin(&mut one.member, own_s);
            let more = times(one.member.strain(one.member.free(), own_s));
            state.parts = one.parts * more;
            state.begun_s = if more == 1 { own_s } else { 0.0 };
        });
        self.first_failure()
    }

    /// The failure of the first participant that has failed in what all did at the same time.
    fn first_failure(&mut self) -> Result<(), StepError> {
        let failures = self.progress.iter_mut().map(|state| state.failure.take());
        failures.fold(None, Option::or).map_or(Ok(()), Err)
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
            (state.share, state.part) = (parts / own, 0);
            one.grips.clear();
        }
        self.totals.clear();
        self.wrenches.clear();
        self.efforts.clear();
        self.wrenches.resize(all.len(), Wrench::default());
        self.tearing.begin();
        self.yielding.begin();
        self.outside.begin();
        report.fine_steps = parts;
        (report.depth_m, report.heap_contacts) = (0.0, 0);
        self.fine_s = h_s;
        for fine in 0..parts {
            self.outside.after_s = f64::from(fine) * h_s;
            self.begin(all, h_s, threads)?;
            self.find(scene, all, h_s);
            self.tie(scene, all, h_s, f64::from(fine) * h_s);
            self.recall(all, h_s);
            self.impacts.begin([self.macro_s, h_s], &mut self.search, &self.ties, &self.progress);
            self.solve(on, all, h_s, report)?;
            if self.divide_joints(all) || self.divide(all, h_s) {
                return Ok(false);
            }
            let is_last = fine + 1 == parts;
            self.remember(all, h_s, is_last, dt);
            if is_last {
                self.note_stiffness(all, h_s);
            }
            self.step_heap(all, h_s, report)?;
            self.end(all, h_s, threads)?;
            self.heap.place(all);
        }
        Ok(true)
    }

    /// Finds where members may touch, but for those that are a heap: their contacts are not the problem's.
    fn find(&mut self, scene: &ClusterScene, all: &[Participant<'_>], h_s: f64) {
        let Self { search, heap, progress, .. } = self;
        let round = Round { scene, all, progress, h_s, judge: Judge::Foreseen };
        if heap.go_on(scene, all) {
            search.find(&round, heap.domains());
            heap.end_if_touched(search);
        }
        if !heap.is_on() {
            search.find(&round, &[]);
            heap.begin(scene, all, search);
            if heap.is_on() {
                search.find(&round, heap.domains());
            }
        }
        search.sense(&round);
    }

    /// Steps a heap from the velocities that its members have without contact.
    fn step_heap(&mut self, all: &[Participant<'_>], h_s: f64, report: &mut ClusterReport) -> Result<(), StepError> {
        self.heap
            .step(all, &mut self.progress, h_s, Sums { totals: &mut self.totals, wrenches: &mut self.wrenches })?
            .add_to(report);
        Ok(())
    }

    /// What pairs and links gave in the last macro step, by participants and partners.
    pub fn totals(&self) -> &[PairTotal] {
        &self.totals
    }

    /// The same of one participant.
    #[must_use]
    pub fn totals_of(&self, member: usize) -> &[PairTotal] {
        let start = self.totals.partition_point(|total| total.member < member);
        &self.totals[start..self.totals.partition_point(|total| total.member <= member)]
    }

    /// What contacts gave a participant that moves as a whole in the last macro step, about its centre of mass, N·s and N·m·s; zero of others.
    #[must_use]
    pub fn wrench_of(&self, member: usize) -> Wrench {
        self.wrenches.get(member).copied().unwrap_or_default()
    }

    /// What hinges and slides gave in the last macro step along the ways that they leave free.
    pub fn efforts(&self) -> &[JointTotal] {
        &self.efforts
    }

    /// What tore in the last macro step, by participants: no later step knows it.
    pub fn torn(&self) -> &[Torn] {
        self.tearing.torn()
    }

    /// What began to yield in the last macro step: no later step reports it again.
    pub fn yielded(&self) -> &[Yielded] {
        self.yielding.begun()
    }

    /// Whether every attachment held in the last macro step as it had held before.
    #[must_use]
    pub fn held_fast(&self) -> bool {
        self.torn().is_empty() && self.yielded().is_empty()
    }

    /// Whether members that are calm may rest: not where an attachment has just given way, which may have kept them still until now, or where
    /// a motor keeps a joint moving, however slowly.
    #[must_use]
    pub fn lets_rest(&self) -> bool {
        self.held_fast() && !self.joints.drives
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

    /// Begins the steps of members that are at the end of one, and finds what all others see of each other (eq. 24).
    fn begin(&mut self, all: &mut [Participant<'_>], h_s: f64, threads: &dyn ParallelFor) -> Result<(), StepError> {
        for_each(threads, all, &mut self.progress, &Participant::size, &|one, state| {
            let own_s = h_s * f64::from(state.share);
            if state.part == 0 && state.begun_s != own_s {
                state.begin(&mut one.member, own_s);
            }
        });
        self.first_failure()?;
        for (place, (one, state)) in all.iter().zip(&mut self.progress).enumerate() {
            if state.part == 0 {
                let own_s = h_s * f64::from(state.share);
                state.begun_s = 0.0;
                state.start(&one.member);
                self.outside.act(place, one, [own_s, self.macro_s], state);
            }
            state.part += 1;
            state.look(&one.member);
        }
        Ok(())
    }

    /// Lays out springs, links and joints of a fine step that begins `after_s` seconds into the macro step.
    fn tie(&mut self, scene: &ClusterScene, all: &[Participant<'_>], h_s: f64, after_s: f64) {
        let Self { ties, joints, progress, depth_m, .. } = self;
        ties.clear();
        let step = FineStep { all, progress, h_s, after_s, joint_miss_m: solve::joint_miss_m(*depth_m) };
        ties.gather_springs(&step);
        ties.gather_own_springs(&step);
        ties.gather_links(&step);
        ties.gather_lines(&step, &self.outside.lines);
        self.outside.give_led(h_s);
        joints.gather(scene, &step, ties);
        ties.add_inertia(&step);
    }

    /// Moves all members; the step of some ends (eq. 26, 27).
    fn end(&mut self, all: &mut [Participant<'_>], h_s: f64, threads: &dyn ParallelFor) -> Result<(), StepError> {
        for_each(threads, all, &mut self.progress, &Participant::size, &|one, state| {
            let since_s = h_s * f64::from(state.part);
            if state.part < state.share {
                one.member.move_to(&state.before, since_s);
            } else {
                one.member.leave(&state.unanswered);
                state.failure = one.member.end(&state.before, since_s, state.touched).err();
                if state.failure.is_none() && !state.late.is_empty() {
                    // by the impulses that move it so far; how it has gone is not needed any more
                    multiply(one.member.blocks(), &state.late, &mut state.going);
                    one.member.carry(&state.going);
                }
                state.part = 0;
            }
        });
        self.first_failure()?;
        let Self { progress, tearing, .. } = self;
        for (place, (one, state)) in all.iter().zip(progress).enumerate() {
            if state.part == 0 {
                tearing.note_own(place, &one.member, h_s * f64::from(state.share));
            }
        }
        Ok(())
    }
}
