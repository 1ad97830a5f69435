//! Impacts: contacts that close fast, and part by their coefficient of restitution.
//!
//! In: the solution of a fine step, in which bodies that meet stop. Out: by how much impacts change velocities at the end of the step, and
//! where bodies that fly have come to by then. Never here: the search, the solve of the step. Theory: docs/theory/clusters.md, section 9.

mod meeting;

use crate::constraint::{ConstraintRows, contact_rows, is_rigid};
use crate::detect::{Owner, Search};
use crate::lists::{refill, reset};
use crate::member::memory::Partner;
use crate::member::participant::{Progress, relative, velocity};
use crate::member::problem::{Posed, ProblemMembers, Velocities};
use crate::member::{Participant, Role};
use crate::push_out::PUSH_OUT_SHARE;
use crate::solve::{Contact, JointRow, Report, Settings, Side, Solution, Solver};
use glam::DVec3;
use meeting::{Closing, Meeting, Work};
use metachron_core::{DisjointSets, ParallelFor, StepError};

/// The share of the speed lost in an impact by which its contact gives way (eq. 5), and the least by which it does,
/// m/s.
const YIELD_SHARE: f64 = 3e-5;
const YIELD_MIN_M_S: f64 = 2e-6;
/// The miss at which the solve ends, in multiples of the velocity by which contacts give way.
const MISS_YIELDS: f64 = 0.1;

/// The impacts of a fine step.
#[derive(Default)]
pub(crate) struct Impacts {
    solver: Solver,
    /// The most steps of a solve.
    pub factors_max: Option<u32>,
    /// The macro step and the fine step, seconds, and how deep contacts rest, metres.
    macro_s: f64,
    step_s: f64,
    depth_m: f64,
    /// Whether anything held each participant in the last step.
    supported: Vec<bool>,
    found: Vec<Impact>,
    /// The flight of each participant, until something holds it.
    flights: Vec<Flight>,
    /// Participants that touch or are joined, and the work of the forces between them where any of them collide.
    touching: DisjointSets,
    works: Vec<Option<Work>>,
    /// The problem, with the contact and the row of the step that each of its own is.
    contacts: Vec<Contact>,
    contacts_of: Vec<usize>,
    rows: Vec<JointRow>,
    rows_of: Vec<usize>,
    /// The impulses that impacts gave each contact and row of the step beside its solution, N·s; empty where there were none.
    pub contacts_n_s: Vec<DVec3>,
    pub rows_n_s: Vec<DVec3>,
}

/// A contact of the step whose sides rebound.
#[derive(Debug, Clone, Copy)]
struct Impact {
    at: usize,
    meeting: Meeting,
}

/// How a participant moves before and after its impacts: exactly (eq. 27) where nothing else acts on it, and they are of one pair.
#[derive(Debug, Clone, Copy, Default)]
struct Flight {
    is_free: bool,
    pair: Option<(usize, Partner)>,
    /// When it meets its partner first.
    after_s: Option<f64>,
}

/// A fine step after its solve.
pub(crate) struct SolvedStep<'a, 'p> {
    pub all: &'a [Participant<'p>],
    pub search: &'a Search,
    pub constraints: &'a ConstraintRows,
    pub solution: &'a Solution,
    pub members: &'a mut ProblemMembers,
    pub progress: &'a mut [Progress],
    pub threads: &'a dyn ParallelFor,
    /// Whether bodies may be where a flight brings them: bodies that pass into others are stopped only by another
    /// solve.
    pub may_fly: bool,
}

impl Impacts {
    /// Lets contacts that close fast rebound, after the solve of a fine step by which they close no more; `None` where none does.
    pub fn rebound(&mut self, step: SolvedStep<'_, '_>) -> Result<Option<Report>, StepError> {
        let SolvedStep { all, search, constraints, solution, members, progress, threads, may_fly } = step;
        self.clear();
        for state in &mut *progress {
            state.dv_impacts.clear();
            state.dx_impacts.clear();
        }
        self.find(search, progress);
        if self.found.is_empty() {
            return Ok(None);
        }
        let flies =
            |(one, state): (&Participant<'_>, &Progress)| may_fly && one.member.role() == Role::Rigid && !state.touched;
        self.note_flights(all.iter().zip(&*progress).map(flies), search, constraints);
        self.pose(all, search, constraints, progress);
        let h_s = self.aim();
        let (contacts, rows) = (&mut self.contacts[..], &mut self.rows[..]);
        let (free, open): (Velocities, Velocities) = (|state| &state.v_solved, |_| &[]);
        let took =
            Posed { all, progress, contacts, rows, h_s, threads, free, open }.solve(&mut self.solver, members)?;
        self.weigh(search, constraints, solution, progress);
        self.take(all, search, constraints, progress);
        self.land(search, progress);
        Ok(Some(took))
    }

    /// Begins a fine step, of a macro step and with contacts that rest as deep as given. Its problem goes by the velocities at its end, and would stop too early sides that fly and meet in a later one: it
    /// has none of their contacts.
    pub fn begin(
        &mut self,
        [macro_s, step_s, depth_m]: [f64; 3],
        search: &mut Search,
        constraints: &ConstraintRows,
        progress: &[Progress],
    ) {
        (self.macro_s, self.step_s, self.depth_m) = (macro_s, step_s, depth_m);
        self.clear();
        reset(&mut self.supported, progress.len(), false);
        if search.owners.iter().all(|owner| owner.restitution == 0.0) {
            return;
        }
        let contacts = search.contacts.iter().map(|contact| (&contact.sides, contact.warm_n_s));
        let rows = constraints.rows.iter().map(|row| (&row.sides, row.warm_n_s));
        let bearing = contacts.chain(rows).filter(|(_, warm_n_s)| *warm_n_s != DVec3::ZERO);
        for member in bearing.flat_map(|(sides, _)| movers(sides)) {
            self.supported[member] = true;
        }
        search.retain(|contact, owner| {
            let flies = movers(&contact.sides).any(|member| !self.supported[member] && !progress[member].touched);
            let meets_later = |meeting: Meeting| meeting.after_s >= step_s;
            !(flies && self.meeting(contact, owner, progress).is_some_and(meets_later))
        });
    }

    fn clear(&mut self) {
        self.found.clear();
        self.contacts_n_s.clear();
        self.rows_n_s.clear();
    }

    /// The meeting of a contact of the step, where its sides rebound.
    pub fn of(&self, contact: usize) -> Option<&Meeting> {
        let found = self.found.binary_search_by_key(&contact, |impact| impact.at);
        found.ok().map(|at| &self.found[at].meeting)
    }

    /// How the sides of a contact that has a coefficient of restitution meet, in this step or later; `None` where they do not.
    fn meeting(&self, contact: &Contact, owner: &Owner, progress: &[Progress]) -> Option<Meeting> {
        let Self { supported, macro_s, step_s, .. } = self;
        if owner.restitution == 0.0 {
            return None;
        }
        let along = |of: Velocities| {
            contact.sides.each_ref().map(|side| velocity(side, |at| of(&progress[at])).dot(contact.normal))
        };
        let (now, then) = (along(|state| &state.v_before), along(|state| &state.v_predicted));
        let falls = [0, 1].map(|at| (then[at] - now[at]) / step_s);
        let held = contact.sides.each_ref().map(|side| side.terms().is_empty() || supported[side.member]);
        let gains = [0, 1].map(|at| if held[at] { 0.0 } else { falls[at] });
        let closing = Closing {
            gap_m: contact.gap_m,
            speed_m_s: contact.surface_m_s.dot(contact.normal) - now[0] + now[1],
            gain_m_s2: gains[1] - gains[0],
            fall_m_s2: (falls[1] - falls[0]).max(-falls[0]).max(falls[1]),
        };
        closing.meeting(owner.restitution, [*macro_s, *step_s])
    }

    /// Finds the bouncing contacts: they bear, and met fast.
    fn find(&mut self, search: &Search, progress: &[Progress]) {
        for (at, (contact, owner)) in search.contacts.iter().zip(&search.owners).enumerate() {
            let bears = contact.warm_n_s != DVec3::ZERO;
            let meeting = if bears { self.meeting(contact, owner, progress) } else { None };
            self.found.extend(meeting.filter(|meeting| meeting.rebounds).map(|meeting| Impact { at, meeting }));
        }
    }

    /// Finds which of the bodies that may fly do so.
    fn note_flights(&mut self, may_fly: impl Iterator<Item = bool>, search: &Search, constraints: &ConstraintRows) {
        let mut flights = std::mem::take(&mut self.flights);
        refill(&mut flights, may_fly.map(|is_free| Flight { is_free, ..Flight::default() }));
        for (at, (contact, owner)) in search.contacts.iter().zip(&search.owners).enumerate() {
            // sides that come back in the step fly on in the next
            let meeting = self.of(at).filter(|meeting| meeting.parts_at_end_m_s() > 0.0);
            for body in movers(&contact.sides).filter(|_| contact.warm_n_s != DVec3::ZERO) {
                let flight = &mut flights[body];
                flight.is_free &= meeting.is_some() && flight.pair.is_none_or(|pair| pair == owner.pair());
                flight.pair = Some(owner.pair());
                let first_s = flight.after_s.unwrap_or(self.step_s);
                flight.after_s = meeting.map(|meeting| meeting.after_s.min(first_s));
            }
        }
        // the rows beyond those of owners are friction of these contacts
        let held = constraints.rows[..constraints.owners.len()].iter().filter(|row| row.warm_n_s != DVec3::ZERO);
        held.flat_map(|row| movers(&row.sides)).for_each(|body| flights[body].is_free = false);
        self.flights = flights;
    }

    /// Lays out the problem of velocities: impacts, and all that holds the bodies that collide or that touch them.
    fn pose(&mut self, all: &[Participant<'_>], search: &Search, constraints: &ConstraintRows, progress: &[Progress]) {
        self.join(search, constraints, progress);
        self.contacts.clear();
        self.contacts_of.clear();
        for (at, contact) in search.contacts.iter().enumerate() {
            if !(self.touches(contact, progress) && self.collides(&contact.sides)) {
                continue;
            }
            let parting_m_s = self.of(at).map_or(0.0, |meeting| {
                let flies = movers(&contact.sides).any(|body| self.flights[body].is_free);
                if flies { meeting.parts_at_end_m_s().max(0.0) } else { meeting.parting_m_s }
            });
            let (gap_m, overlap_m, load_n_s, owed_slip_m) = (0.0, 0.0, 0.0, DVec3::ZERO);
            let warm_n_s = contact.warm_n_s * search.owners[at].restitution;
            self.contacts.push(Contact { parting_m_s, gap_m, overlap_m, load_n_s, owed_slip_m, warm_n_s, ..*contact });
            self.contacts_of.push(at);
        }
        self.rows.clear();
        self.rows_of.clear();
        for (at, row) in constraints.rows.iter().enumerate().filter(|(_, row)| is_rigid(row)) {
            if self.collides(&row.sides) {
                let target_m_s = relative(&row.sides, |body| &progress[body].v_solved);
                self.rows.push(JointRow { target_m_s, warm_n_s: DVec3::ZERO, owed_slip_m: DVec3::ZERO, ..*row });
                self.rows_of.push(at);
            }
        }
        // the friction of these contacts about their normals
        let spins = self.contacts.iter().zip(&self.contacts_of).enumerate();
        let spins = spins.filter_map(|(k, (contact, at))| contact_rows::spin_row(all, &search.owners[*at], contact, k));
        self.rows.extend(spins);
    }

    /// Whether the sides of a contact touch at the end of the step.
    fn touches(&self, contact: &Contact, progress: &[Progress]) -> bool {
        let opening_m_s = relative(&contact.sides, |body| &progress[body].v_solved) - contact.surface_m_s;
        let ends_m = contact.gap_m + opening_m_s.dot(contact.normal) * self.step_s;
        contact.warm_n_s != DVec3::ZERO || ends_m < self.depth_m
    }

    /// Finds which bodies touch or are joined, and which of them collide.
    fn join(&mut self, search: &Search, constraints: &ConstraintRows, progress: &[Progress]) {
        let mut touching = std::mem::take(&mut self.touching);
        touching.reset(progress.len());
        let holding = search.contacts.iter().filter(|contact| self.touches(contact, progress));
        let joined = constraints.rows.iter().filter(|row| is_rigid(row));
        for sides in holding.map(|contact| &contact.sides).chain(joined.map(|row| &row.sides)) {
            let mut all = movers(sides);
            let Some(first) = all.next() else { continue };
            all.for_each(|other| {
                touching.join(first, other);
            });
        }
        self.touching = touching;
        reset(&mut self.works, progress.len(), None);
        for body in self.found.iter().filter_map(|impact| movers(&search.contacts[impact.at].sides).next()) {
            self.works[self.touching.lowest(body)] = Some(Work::default());
        }
    }

    fn collides(&mut self, sides: &[Side; 2]) -> bool {
        movers(sides).next().is_some_and(|body| self.works[self.touching.lowest(body)].is_some())
    }

    /// Sets up the solver; the time in which contacts give way by their depth, seconds.
    fn aim(&mut self) -> f64 {
        let lost_m_s = |impact: &Impact| impact.meeting.closing_m_s - impact.meeting.parting_m_s;
        let least_m_s = self.found.iter().map(lost_m_s).fold(f64::INFINITY, f64::min);
        let yield_m_s = (YIELD_SHARE * least_m_s).max(YIELD_MIN_M_S);
        let (depth_m, tolerance_m_s) = (self.depth_m, MISS_YIELDS * yield_m_s);
        self.solver =
            Solver::new(Settings { depth_m, tolerance_m_s, factors_max: self.factors_max, ..Settings::default() });
        PUSH_OUT_SHARE * depth_m / yield_m_s
    }

    /// Finds the work of bodies that touch, by the impulses of the step's solution and of impacts.
    fn weigh(&mut self, search: &Search, constraints: &ConstraintRows, step: &Solution, progress: &[Progress]) {
        let Self { solver, found, touching, works, contacts, contacts_of, rows_of, .. } = self;
        let solution = solver.solution();
        let struck = |body: usize| progress[body].place.map_or(&[][..], |place| solution.velocities(place));
        // with the velocities of sides against each other where they meet, beside those at the start and at the end of the step
        let mut add = |sides: &[Side; 2], [solved, given]: [DVec3; 2], [at_start, at_end]: [DVec3; 2]| {
            let body = movers(sides).next();
            let Some(work) = body.and_then(|body| works[touching.lowest(body)].as_mut()) else { return };
            let stopped = relative(sides, |at| &progress[at].v_solved);
            let both = relative(sides, |at| &progress[at].v_before) + stopped - at_start - at_end;
            let change = relative(sides, struck) - stopped;
            work.solved_j += 0.5 * solved.dot(both);
            work.slope_j += 0.5 * (given.dot(both) + solved.dot(change));
            work.curve_j += given.dot(change);
        };
        let mut impacts = found.iter().peekable();
        for (k, (contact, at)) in contacts.iter().zip(&*contacts_of).enumerate() {
            let impact = impacts.next_if(|impact| impact.at == *at);
            let beside_m_s = impact.map_or([0.0; 2], |Impact { meeting, .. }| {
                [meeting.gained_m_s, contact.parting_m_s - meeting.parting_m_s]
            });
            let beside = beside_m_s.map(|along_m_s| contact.normal * along_m_s + contact.surface_m_s);
            add(&search.contacts[*at].sides, [step.contacts_n_s[*at], solution.contacts_n_s[k]], beside);
        }
        for (k, at) in rows_of.iter().enumerate() {
            add(&constraints.rows[*at].sides, [step.rows_n_s[*at], solution.rows_n_s[k]], [DVec3::ZERO; 2]);
        }
    }

    /// Gives bodies the changes of their velocities by impacts, and moves flying bodies to where they have come to (eq.
    /// 27). Others are where the solution of the step leaves them.
    fn take(
        &mut self,
        all: &[Participant<'_>],
        search: &Search,
        constraints: &ConstraintRows,
        progress: &mut [Progress],
    ) {
        let Self { solver, flights, touching, works, contacts_of, rows_of, step_s, .. } = self;
        let solution = solver.solution();
        let mut share = |body: usize| works[touching.lowest(body)].map(|work| work.share());
        let mut of = |sides: &[Side; 2]| movers(sides).next().and_then(&mut share).unwrap_or(0.0);
        self.contacts_n_s.resize(search.contacts.len(), DVec3::ZERO);
        self.rows_n_s.resize(constraints.rows.len(), DVec3::ZERO);
        for (at, given) in contacts_of.iter().zip(&solution.contacts_n_s) {
            self.contacts_n_s[*at] = *given * of(&search.contacts[*at].sides);
        }
        for (at, given) in rows_of.iter().zip(&solution.rows_n_s) {
            self.rows_n_s[*at] = *given * of(&constraints.rows[*at].sides);
        }
        for (body, state) in progress.iter_mut().enumerate() {
            let Some((place, share)) = state.place.zip(share(body)) else { continue };
            state.strike(solution.velocities(place), share);
            match flights[body] {
                Flight { is_free: true, after_s: Some(after_s), .. } => state.fly_on(after_s, *step_s),
                _ if all[body].member.role() == Role::Rigid => state.wait(*step_s),
                _ => {}
            }
        }
    }

    /// Lets bodies whose flight would bring them into others be where the solution of the step leaves them, and those others.
    fn land(&mut self, search: &Search, progress: &mut [Progress]) {
        let Self { flights, step_s, depth_m, .. } = self;
        let flies = |flight: Flight| flight.is_free && flight.after_s.is_some();
        let mut any = true;
        while std::mem::take(&mut any) {
            for contact in &search.contacts {
                if !movers(&contact.sides).any(|body| flies(flights[body])) {
                    continue;
                }
                let opening_m_s = relative(&contact.sides, |body| &progress[body].v_mean) - contact.surface_m_s;
                if contact.gap_m + opening_m_s.dot(contact.normal) * *step_s >= -*depth_m {
                    continue;
                }
                for body in movers(&contact.sides) {
                    if flies(flights[body]) {
                        progress[body].wait(*step_s);
                        any = true;
                    }
                    flights[body].is_free = false;
                }
            }
        }
    }

    /// Adds the momentum that impacts leave to the momentum that members do not answer yet.
    pub fn leave(&self, progress: &mut [Progress]) {
        for state in progress.iter_mut().filter(|state| !state.dv_impacts.is_empty()) {
            let left = state.place.map_or(&[][..], |place| self.solver.solution().unanswered(place));
            state.unanswered.iter_mut().zip(left).for_each(|(r, more)| *r += *more);
        }
    }
}

/// The members that a row moves.
fn movers(sides: &[Side; 2]) -> impl Iterator<Item = usize> + use<> {
    let of = |side: &Side| {
        let own = (!side.terms().is_empty()).then_some(side.member);
        own.into_iter().chain(side.second().map(|part| part.member))
    };
    of(&sides[0]).chain(of(&sides[1]))
}
