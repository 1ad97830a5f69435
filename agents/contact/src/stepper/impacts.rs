//! Impacts: contacts whose sides meet fast and part by their coefficient of restitution.
//!
//! In: the contacts and rows of a fine step, velocities as it begins. Out: velocities after the impacts, by how much a flying body is
//! behind, how many fine steps the macro step needs. Never here: the search, the solve of the fine step.
//! Theory: docs/theory/clusters.md, section 9.
//!
//! which contacts     those that meet within the fine step, and then part for longer than a macro step ([`Meeting::collides`])
//! what energy        one problem of velocities: what touches is held by the same laws, impacts part at e times their speed; the impulses of
//!                    bodies that touch are shortened together where they would add kinetic energy
//! when in the step   velocities jump at its start; a body that nothing holds is carried back by what it went too far since (eq. 27), so
//!                    its flight is exact. Impacts of a flying body that follow each other are in fine steps of their own, up to [`PARTS_MAX`]

mod meeting;

use super::memory::Partner;
use super::progress::Progress;
use super::search::{Judge, Owner, Round, Search, solved_gap_m, velocity};
use super::solve::{Posed, Store};
use super::ties::{Ties, is_rigid};
use super::{ClusterMember, ClusterReport, ClusterStepper, On, Participant, Role, spin_friction};
use crate::cluster::{Contact, JointRow, Side, Solver};
use crate::push_out::PUSH_OUT_SHARE;
use glam::DVec3;
use meeting::{Meeting, first_root};
use metachron_core::{Archive, ArchiveError, DisjointSets, StepError};

/// Sides that come nearer by more than this in a fine step are swept to where they meet, and impacts of a flying body between which they part
/// by more are in fine steps of their own, metres.
pub(super) const APART_M: f64 = 5e-3;
/// The most fine steps of a macro step that impacts ask for.
const PARTS_MAX: u32 = 16;
/// The most solves of a fine step: what is struck may strike others.
const ROUNDS_MAX: u32 = 6;
/// Impacts that keep this share of their speed, a quarter of their energy, go on to others in the fine step, and their contacts are not in the
/// solve of the step, which would stop the shortest flights.
const KEEPS_MOST: f64 = 0.5;
/// By which share of the speed that an impact loses its contacts give way (eq. 5), and the least by which they do, m/s.
const YIELD_SHARE: f64 = 3e-5;
const YIELD_MIN_M_S: f64 = 2e-6;
/// At how many times what contacts give way by an impact is solved.
const MISS_YIELDS: f64 = 10.0;

/// The impacts of a fine step.
#[derive(Default)]
pub(super) struct Impacts {
    solver: Solver,
    /// The macro step and the fine step that are made, seconds, and how deep contacts rest, metres.
    macro_s: f64,
    step_s: f64,
    depth_m: f64,
    /// How many fine steps the macro step is made in, and how many impacts ask for.
    made: u32,
    parts: u32,
    /// Whether anything held each participant in the last step.
    supported: Vec<bool>,
    /// When each participant collides in the fine step.
    collisions: Vec<Option<Collisions>>,
    /// Those of the round, by their contacts.
    found: Vec<Impact>,
    /// The problem of the round, with the contact and the row of the step that each of its own is.
    contacts: Vec<Contact>,
    contacts_of: Vec<usize>,
    rows: Vec<JointRow>,
    rows_of: Vec<usize>,
    /// Participants that touch or are joined, what their impulses do together, and when.
    touching: DisjointSets,
    groups: Vec<Group>,
    events: DisjointSets,
    times_s: Vec<f64>,
    /// Participants that have collided in the fine step, in whatever round, and which of them land in it.
    partners: DisjointSets,
    lands: Vec<bool>,
    /// Contacts of the step that have parted, and those of flying bodies that meet in a later one.
    parted: Vec<usize>,
    later: Vec<usize>,
    /// What contacts gave in the impacts of the fine step, and rows, N·s.
    pub struck: Vec<Struck>,
    pub jolts: Vec<(usize, DVec3)>,
}

/// When a participant collides.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Collisions {
    first_s: f64,
    last_s: f64,
    /// The greatest speed at which it parts from another, m/s.
    parts_m_s: f64,
    /// The pair that collides first.
    pair: (usize, Partner),
}

/// A contact whose sides collide.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Impact {
    /// The contact of the step.
    at: usize,
    meeting: Meeting,
}

/// What the impulses of bodies that touch do together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Group {
    collides: bool,
    /// λᵀu⁻ and λᵀ(u⁺ − u⁻), J.
    on_before_j: f64,
    on_change_j: f64,
}

/// What a contact gave in an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Struck {
    pub owner: Owner,
    pub contact: Contact,
    pub impulse_n_s: DVec3,
    pub inverse_mass_per_kg: [f64; 2],
}

impl Group {
    /// The share of the impulses by which they make no kinetic energy.
    fn share(&self) -> f64 {
        if self.on_before_j + 0.5 * self.on_change_j <= 0.0 {
            1.0
        } else {
            (-2.0 * self.on_before_j / self.on_change_j).clamp(0.0, 1.0)
        }
    }
}

impl ClusterStepper {
    /// Lets sides that meet fast collide, before the fine step is solved.
    pub(super) fn strike(
        &mut self,
        on: On<'_>,
        all: &[Participant<'_>],
        h_s: f64,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        let Self { impacts, search, ties, progress, members, lent, places, macro_s, depth_m, .. } = self;
        impacts.begin(*macro_s, h_s);
        if search.owners.iter().all(|owner| owner.restitution == 0.0) {
            return Ok(());
        }
        impacts.note_supported(search, ties, all.len());
        impacts.depth_m = *depth_m;
        impacts.solver.set_depth_m(*depth_m);
        for round in 0..ROUNDS_MAX {
            impacts.find(search, progress, round > 0);
            if impacts.found.is_empty() || impacts.wanted_parts().is_some() {
                break;
            }
            impacts.pose(all, search, ties, progress);
            let yield_s = impacts.aim();
            let posed = Posed {
                contacts: &mut impacts.contacts,
                rows: &mut impacts.rows,
                h_s: yield_s,
                threads: on.threads,
                free: Progress::at_impact,
                open: |_| &[],
            };
            report.add(&posed.solve(&mut impacts.solver, all, progress, Store { members, lent, places })?);
            impacts.take(search, progress);
            // bodies that were struck move as nobody foresaw
            for (one, state) in all.iter().zip(&mut *progress) {
                state.bears = false;
                state.solved.clone_from(&state.seen);
                state.go(one.member.role() == Role::Rigid);
            }
            search.add_passed(&Round { scene: on.scene, all, progress, h_s, judge: Judge::Struck });
        }
        // a flight is exact: the solve, which goes by the velocities at the end of the step, would stop one that ends in the next
        search.retain(|at| impacts.later.binary_search(&at).is_err());
        search.move_late(progress, solved_gap_m);
        Ok(())
    }
}

impl Impacts {
    /// Writes or reads what the next impacts need of those before.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.solver.archive(archive)
    }

    /// Lets bodies that the last solve holds, and those that they collided with, be where their velocities bring them: they do not fly on after
    /// their impacts. Whether there are any; the gaps of their contacts are then others.
    pub fn land(&mut self, search: &mut Search, progress: &mut [Progress]) -> bool {
        let Self { partners, lands, .. } = self;
        if partners.is_empty() {
            return false;
        }
        lands.clear();
        lands.resize(progress.len(), false);
        let is_late = |state: &Progress| state.late.iter().any(|late| *late != DVec3::ZERO);
        for (body, _) in progress.iter().enumerate().filter(|(_, state)| state.bears && is_late(state)) {
            lands[partners.lowest(body)] = true;
        }
        let mut any = false;
        for (body, state) in progress.iter_mut().enumerate().filter(|(_, state)| is_late(state)) {
            if lands[partners.lowest(body)] {
                state.late.clear();
                any = true;
            }
        }
        if any {
            search.move_late(progress, solved_gap_m);
        }
        any
    }

    /// How many fine steps the macro step has to be made in; `None` where those that it is made in are enough.
    pub fn wanted_parts(&self) -> Option<u32> {
        (self.parts > self.made).then_some(self.parts)
    }

    /// Begins a fine step.
    fn begin(&mut self, macro_s: f64, step_s: f64) {
        (self.macro_s, self.step_s) = (macro_s, step_s);
        (self.made, self.parts) = ((macro_s / step_s).round() as u32, 1);
        self.struck.clear();
        self.jolts.clear();
        self.partners.reset(0);
    }

    /// Notes which participants something held in the last step.
    fn note_supported(&mut self, search: &Search, ties: &Ties, count: usize) {
        let Self { supported, collisions, partners, .. } = self;
        partners.reset(count);
        collisions.clear();
        collisions.resize(count, None);
        supported.clear();
        supported.resize(count, false);
        let contacts = search.contacts.iter().map(|contact| (&contact.sides, contact.warm_n_s));
        let rows = ties.rows.iter().map(|row| (&row.sides, row.warm_n_s));
        let bearing = contacts.chain(rows).filter(|(_, warm_n_s)| *warm_n_s != DVec3::ZERO);
        for side in bearing.flat_map(|(sides, _)| sides).filter(|side| !side.terms().is_empty()) {
            supported[side.member] = true;
        }
    }

    /// Finds the contacts that collide by the velocities as they are; after a first round those that keep much of their speed, of bodies that
    /// fly: others do not move on to where they could collide again.
    fn find(&mut self, search: &Search, progress: &[Progress], further: bool) {
        let rests = |contact: &Contact, owner: &Owner| {
            owner.restitution < KEEPS_MOST || owner.movers(contact).any(|member| progress[member].held)
        };
        self.found.clear();
        self.later.clear();
        for (at, (contact, owner)) in search.contacts.iter().zip(&search.owners).enumerate() {
            if owner.restitution == 0.0 {
                continue;
            }
            let Some(meeting) = self.meeting(contact, owner.restitution, progress) else { continue };
            if meeting.after_s >= self.step_s {
                let flies = owner.movers(contact).any(|member| !self.supported[member]);
                if flies && (owner.restitution >= KEEPS_MOST || meeting.collides()) {
                    self.later.push(at);
                }
            } else if meeting.collides() && !(further && rests(contact, owner)) {
                self.note(contact, owner, &meeting);
                self.found.push(Impact { at, meeting });
            }
        }
    }

    /// How the sides of a contact meet, in this step or later; `None` where they do not.
    fn meeting(&self, contact: &Contact, restitution: f64, progress: &[Progress]) -> Option<Meeting> {
        let Self { macro_s, step_s, supported, .. } = self;
        // along the normal, of side 0 against side 1
        let along = |of: &dyn Fn(&Side) -> DVec3| {
            let [a, b] =
                contact.sides.each_ref().map(|side| if side.terms().is_empty() { DVec3::ZERO } else { of(side) });
            (a - b).dot(contact.normal)
        };
        let now_m_s = along(&|side| side.velocity(progress[side.member].at_impact()));
        let gains_m_s = contact.sides.each_ref().map(|side| match side.terms() {
            [] => 0.0,
            _ if supported[side.member] => 0.0,
            _ => {
                let state = &progress[side.member];
                (side.velocity(&state.seen) - side.velocity(state.at_impact())).dot(contact.normal)
            }
        });
        let gain_m_s = gains_m_s[0] - gains_m_s[1];
        let alone_m_s = along(&|side| {
            if supported[side.member] { DVec3::ZERO } else { side.velocity(progress[side.member].at_impact()) }
        });
        let [approach_m_s, alone_m_s] = [now_m_s, alone_m_s].map(|v| contact.surface_m_s.dot(contact.normal) - v);
        // a body that has just landed still has some of its speed, and stops where it is
        let soonest_m_s = approach_m_s.max(alone_m_s);
        let after_s = first_root(contact.gap_m, soonest_m_s, -gain_m_s / step_s)?.max(-step_s);
        let gained_m_s = -gain_m_s / step_s * after_s;
        let lost_m_s = (-gain_m_s).max(-gains_m_s[0]).max(gains_m_s[1]) / step_s * macro_s;
        Some(Meeting { after_s, closing_m_s: approach_m_s + gained_m_s, gained_m_s, lost_m_s, restitution })
    }

    /// Notes a collision of flying bodies, and asks for steps that are no longer than what is between it and their others.
    fn note(&mut self, contact: &Contact, owner: &Owner, meeting: &Meeting) {
        let (after_s, parts_m_s) = (meeting.after_s, meeting.restitution * meeting.closing_m_s);
        if owner.movers(contact).any(|member| self.supported[member]) {
            return;
        }
        let pair = owner.pair();
        for member in owner.movers(contact) {
            let known = self.collisions[member].get_or_insert(Collisions {
                first_s: after_s,
                last_s: after_s,
                parts_m_s,
                pair,
            });
            known.parts_m_s = known.parts_m_s.max(parts_m_s);
            if after_s < known.first_s {
                (known.first_s, known.pair) = (after_s, pair);
            } else if pair == known.pair {
                continue;
            }
            known.last_s = known.last_s.max(after_s);
            let apart_s = known.last_s - known.first_s;
            // steps are whole nanoseconds
            let finest_s = self.macro_s / f64::from(PARTS_MAX) * (1.0 + 1e-6);
            if apart_s > finest_s && apart_s * known.parts_m_s > APART_M {
                let parts = (self.macro_s / apart_s).ceil() as u32;
                self.parts = self.parts.max(parts.next_power_of_two().min(PARTS_MAX));
            }
        }
    }

    /// The time in which contacts give way by their depth while they collide, seconds. The solve ends at what they give way by, as the step ends
    /// what it leaves.
    fn aim(&mut self) -> f64 {
        let lost_m_s = |impact: &Impact| (1.0 - impact.meeting.restitution) * impact.meeting.closing_m_s;
        let least_m_s = self.found.iter().map(lost_m_s).fold(f64::INFINITY, f64::min);
        let yield_m_s = (YIELD_SHARE * least_m_s).max(YIELD_MIN_M_S);
        self.solver.set_tolerance_m_s(MISS_YIELDS * yield_m_s);
        PUSH_OUT_SHARE * self.depth_m / yield_m_s
    }

    /// Lays out the problem of velocities: impacts, and all that holds the bodies that collide or that touch them.
    fn pose(&mut self, all: &[Participant<'_>], search: &Search, ties: &Ties, progress: &[Progress]) {
        let Self { found, touching, groups, contacts, contacts_of, rows, rows_of, depth_m, .. } = self;
        let touches = |contact: &Contact| contact.warm_n_s != DVec3::ZERO || contact.gap_m < *depth_m;
        let movers = |sides: &[Side; 2]| sides.each_ref().map(|side| (!side.terms().is_empty()).then_some(side.member));
        let first = |sides: &[Side; 2]| movers(sides).into_iter().flatten().next();
        touching.reset(progress.len());
        let holding = search.contacts.iter().filter(|contact| touches(contact)).map(|contact| &contact.sides);
        let joined = ties.rows.iter().filter(|row| is_rigid(row)).map(|row| &row.sides);
        let colliding = found.iter().map(|impact| &search.contacts[impact.at].sides);
        for sides in holding.chain(joined).chain(colliding) {
            if let [Some(a), Some(b)] = movers(sides) {
                touching.join(a, b);
            }
        }
        groups.clear();
        groups.resize(progress.len(), Group::default());
        for body in found.iter().filter_map(|impact| first(&search.contacts[impact.at].sides)) {
            groups[touching.lowest(body)].collides = true;
        }
        let mut collides = |sides: &[Side; 2]| first(sides).is_some_and(|body| groups[touching.lowest(body)].collides);
        contacts.clear();
        contacts_of.clear();
        let mut impacts = found.iter().peekable();
        for (at, contact) in search.contacts.iter().enumerate() {
            let impact = impacts.next_if(|impact| impact.at == at);
            if impact.is_some() || touches(contact) && collides(&contact.sides) {
                let parting_m_s = impact.map_or(0.0, |impact| impact.meeting.parting_m_s());
                let (gap_m, load_n_s, none) = (0.0, 0.0, DVec3::ZERO);
                contacts.push(Contact { parting_m_s, gap_m, load_n_s, owed_slip_m: none, warm_n_s: none, ..*contact });
                contacts_of.push(at);
            }
        }
        rows.clear();
        rows_of.clear();
        for (at, row) in ties.rows.iter().enumerate().filter(|(_, row)| is_rigid(row)) {
            if collides(&row.sides) {
                let [a, b] = row.sides.map(|side| velocity(&side, |member| progress[member].at_impact()));
                rows.push(JointRow { target_m_s: a - b, warm_n_s: DVec3::ZERO, owed_slip_m: DVec3::ZERO, ..*row });
                rows_of.push(at);
            }
        }
        // the friction of these contacts about their normals
        let spins = contacts.iter().zip(&*contacts_of).enumerate();
        rows.extend(spins.filter_map(|(k, (contact, at))| spin_friction::row(all, &search.owners[*at], contact, k)));
    }

    /// Gives members what the solve found.
    fn take(&mut self, search: &mut Search, progress: &mut [Progress]) {
        self.weigh(progress);
        self.time(search, progress.len());
        let Self { solver, found, contacts, contacts_of, rows_of, touching, groups, events, times_s, .. } = self;
        let solution = solver.solution();
        self.parted.clear();
        self.later.clear();
        let mut impacts = found.iter().peekable();
        for (k, at) in contacts_of.iter().enumerate() {
            let owner = search.owners[*at];
            let share = owner.movers(&contacts[k]).next().map_or(1.0, |body| groups[touching.lowest(body)].share());
            let impulse_n_s = solution.contacts_n_s[k] * share;
            let impact = impacts.next_if(|impact| impact.at == *at);
            if impulse_n_s == DVec3::ZERO {
                continue;
            }
            match impact {
                Some(Impact { meeting, .. }) => {
                    let parts_m_s = solution.contacts_m_s[k].dot(contacts[k].normal) - meeting.gained_m_s;
                    // what its group is shortened by is still closing
                    if meeting.restitution >= KEEPS_MOST && share > 0.5 && meeting.flies(parts_m_s) {
                        self.parted.push(*at);
                    }
                }
                None => owner.both().for_each(|member| progress[member].hold()),
            }
            let inverse_mass_per_kg = solver.inverse_masses(k, progress[owner.member].place);
            self.struck.push(Struck { owner, contact: search.contacts[*at], impulse_n_s, inverse_mass_per_kg });
        }
        for (k, at) in rows_of.iter().enumerate() {
            let bodies = self.rows[k].sides.iter().filter(|side| !side.terms().is_empty()).map(|side| side.member);
            let share = bodies.clone().next().map_or(1.0, |body| groups[touching.lowest(body)].share());
            bodies.for_each(|member| progress[member].hold());
            self.jolts.push((*at, solution.rows_n_s[k] * share));
        }
        for (body, state) in progress.iter_mut().enumerate() {
            let Some(place) = state.place else { continue };
            let share = groups[touching.lowest(body)].share();
            let after_s = times_s[events.lowest(body)];
            // what is held does not fly before and after
            let after_s = if state.held || !after_s.is_finite() { 0.0 } else { after_s };
            state.strike(solution.velocities(place), solution.unanswered(place), share, after_s);
        }
        let parted = &self.parted;
        search.retain(|at| parted.binary_search(&at).is_err());
        search.move_late(progress, |gap_m, late_m| gap_m + late_m);
    }

    /// Finds what the impulses of bodies that touch do together.
    fn weigh(&mut self, progress: &[Progress]) {
        let Self { solver, found, contacts, contacts_of, rows, touching, groups, .. } = self;
        let solution = solver.solution();
        let before = |sides: &[Side; 2]| {
            let [a, b] = sides.each_ref().map(|side| velocity(side, |member| progress[member].at_impact()));
            a - b
        };
        let after = |sides: &[Side; 2]| {
            let of = |member: usize| progress[member].place.map_or(&[][..], |place| solution.velocities(place));
            let [a, b] = sides.each_ref().map(|side| velocity(side, of));
            a - b
        };
        // sides that collide later have gained speed by then
        let gained_m_s = |k: usize| {
            let impact = found.binary_search_by_key(&contacts_of[k], |impact| impact.at);
            contacts[k].normal * impact.map_or(0.0, |impact| found[impact].meeting.gained_m_s)
        };
        let of_contacts = contacts.iter().enumerate().map(|(k, contact)| {
            let before_m_s = before(&contact.sides) - contact.surface_m_s;
            let [before_m_s, after_m_s] = [before_m_s, solution.contacts_m_s[k]].map(|v| v - gained_m_s(k));
            (&contact.sides, solution.contacts_n_s[k], before_m_s, after_m_s)
        });
        let of_rows = rows.iter().zip(&solution.rows_n_s);
        let of_rows = of_rows.map(|(row, impulse)| (&row.sides, *impulse, before(&row.sides), after(&row.sides)));
        for (sides, impulse, before_m_s, after_m_s) in of_contacts.chain(of_rows) {
            let Some(side) = sides.iter().find(|side| !side.terms().is_empty()) else { continue };
            let group = &mut groups[touching.lowest(side.member)];
            group.on_before_j += impulse.dot(before_m_s);
            group.on_change_j += impulse.dot(after_m_s - before_m_s);
        }
    }

    /// Finds when bodies collide: impacts of one solve that share a body come at one time, that of the first. At times of their own the
    /// impulses of a light body between two heavy ones, that cancel but for its own momentum, would carry it through both.
    fn time(&mut self, search: &Search, count: usize) {
        let Self { solver, found, contacts_of, events, times_s, partners, .. } = self;
        let solution = solver.solution();
        let given = |at: usize| contacts_of.binary_search(&at).is_ok_and(|k| solution.contacts_n_s[k] != DVec3::ZERO);
        let acting = || found.iter().filter(|impact| given(impact.at));
        let movers = |impact: &Impact| search.owners[impact.at].movers(&search.contacts[impact.at]);
        events.reset(count);
        for impact in acting() {
            let first = movers(impact).next();
            for (first, body) in first.into_iter().flat_map(|first| movers(impact).map(move |body| (first, body))) {
                events.join(first, body);
                partners.join(first, body);
            }
        }
        times_s.clear();
        times_s.resize(count, f64::INFINITY);
        for impact in acting() {
            if let Some(body) = movers(impact).next() {
                let time_s = &mut times_s[events.lowest(body)];
                *time_s = time_s.min(impact.meeting.after_s);
            }
        }
    }
}
