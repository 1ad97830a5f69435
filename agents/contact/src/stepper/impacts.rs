//! Impacts: contacts that close fast, and part by their coefficient of restitution.
//!
//! In: the solution of a fine step, in which bodies that meet stop. Out: by how much impacts change velocities at the end of the step, and
//! where bodies that fly have come to by then. Never here: the search, the solve of the step. Theory: docs/theory/clusters.md, section 9.

use super::memory::Partner;
use super::search::{Owner, Search, velocity};
use super::ties::{Ties, is_rigid};
use super::{spin_friction, ClusterMember, ClusterReport, ClusterStepper, On, Participant, Progress, Role, solve::Posed};
use crate::cluster::{Contact, JointRow, Settings, Side, Solver};
use crate::push_out::PUSH_OUT_SHARE;
use glam::DVec3;
use metachron_core::{DisjointSets, StepError};

/// Sides that would part no faster than this do not rebound, m/s: a body would rise by 0.13 mm.
const IMPACT_M_S: f64 = 0.05;
/// By which share of the speed that an impact loses its contact gives way (eq. 5), and the least by which it does, m/s.
const YIELD_SHARE: f64 = 3e-5;
const YIELD_MIN_M_S: f64 = 2e-6;
/// At how many times what contacts give way by the solve ends.
const MISS_YIELDS: f64 = 10.0;

/// The impacts of a fine step.
#[derive(Default)]
pub(super) struct Impacts {
    solver: Solver,
    /// The macro step and the fine step, seconds.
    macro_s: f64,
    step_s: f64,
    /// Whether anything held each participant in the last step.
    supported: Vec<bool>,
    found: Vec<Impact>,
    /// The flight of each participant on which anything acts.
    flights: Vec<Option<Flight>>,
    /// Participants that touch or are joined, and the work of what acts between them.
    touching: DisjointSets,
    works: Vec<Work>,
    /// The problem, with the contact and the row of the step that each of its own is.
    contacts: Vec<Contact>,
    contacts_of: Vec<usize>,
    rows: Vec<JointRow>,
    rows_of: Vec<usize>,
    /// What impacts gave each contact and row of the step beside its solution, N·s; empty where there were none.
    pub contacts_n_s: Vec<DVec3>,
    pub rows_n_s: Vec<DVec3>,
}

/// A contact of the step whose sides rebound.
#[derive(Debug, Clone, Copy)]
struct Impact {
    at: usize,
    meeting: Meeting,
}

/// Two sides that meet fast enough to rebound.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Meeting {
    /// When, seconds from the start of the fine step; before it where they are in each other.
    after_s: f64,
    /// How fast they close then, and part after, m/s.
    closing_m_s: f64,
    parting_m_s: f64,
    /// How much faster they close then than at the start of the step, and by how much faster they part at its end than after the impact, if
    /// they fly, m/s.
    gained_m_s: f64,
    gains_m_s: f64,
    /// Whether they rebound (eq. 27a).
    rebounds: bool,
}

/// A participant that meets others.
#[derive(Debug, Clone, Copy)]
struct Flight {
    pair: (usize, Partner),
    /// When it meets the first.
    after_s: f64,
    /// Whether nothing acts on it but impacts of this pair: its flight before and after is then exact (eq. 27).
    is_free: bool,
}

/// The work of bodies that touch, J: that of the solution, and its first and second derivative by the share of the impacts that acts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Work {
    collides: bool,
    solved_j: f64,
    slope_j: f64,
    curve_j: f64,
}

impl Work {
    /// The greatest share of the impacts by which the work is not above zero (eq. 12a).
    fn share(&self) -> f64 {
        let Self { slope_j: b, curve_j: c, .. } = *self;
        // push-out makes some, which is not for impacts to give back
        let a = self.solved_j.min(0.0);
        if a + b + 0.5 * c <= 0.0 {
            return 1.0;
        }
        let root = (b * b - 2.0 * a * c).max(0.0).sqrt();
        // the form that loses no digits where the curve is small
        if b + root > 0.0 { (-2.0 * a / (b + root)).clamp(0.0, 1.0) } else { 0.0 }
    }
}

impl ClusterStepper {
    /// Lets contacts that close fast rebound, after the solve of a fine step by which they close no more.
    pub(super) fn rebound(
        &mut self,
        on: On<'_>,
        all: &[Participant<'_>],
        may_fly: bool,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        let Self { impacts, search, ties, solver, progress, members, lent, places, depth_m, .. } = self;
        impacts.contacts_n_s.clear();
        impacts.rows_n_s.clear();
        for state in &mut *progress {
            state.jump.clear();
            state.late.clear();
        }
        impacts.find(search, progress);
        if impacts.found.is_empty() {
            return Ok(());
        }
        impacts.note_flights(all, search, ties, progress, may_fly);
        impacts.pose(all, search, ties, progress, *depth_m);
        let yield_m_s = impacts.yield_m_s();
        impacts.solver = Solver::new(Settings {
            depth_m: *depth_m,
            tolerance_m_s: MISS_YIELDS * yield_m_s,
            ..Settings::default()
        });
        let (contacts, rows) = (&mut impacts.contacts[..], &mut impacts.rows[..]);
        let h_s = PUSH_OUT_SHARE * *depth_m / yield_m_s;
        let free: fn(&Progress) -> &[DVec3] = |state| &state.solved;
        let posed = Posed { all, progress, places, contacts, rows, h_s, threads: on.threads, free, open: |_| &[] };
        report.add(&posed.solve(&mut impacts.solver, members, lent)?);
        impacts.weigh(&solver.solution().contacts_n_s, &solver.solution().rows_n_s, progress);
        impacts.take(all, search, ties, progress);
        impacts.land(search, progress, *depth_m);
        Ok(())
    }
}

impl Impacts {
    /// Begins a fine step. Its problem goes by the velocities at its end, and would stop too early sides that fly and meet in a later one: it
    /// has none of their contacts.
    pub fn begin(&mut self, [macro_s, step_s]: [f64; 2], search: &mut Search, ties: &Ties, progress: &[Progress]) {
        (self.macro_s, self.step_s) = (macro_s, step_s);
        self.found.clear();
        self.contacts_n_s.clear();
        self.rows_n_s.clear();
        self.supported.clear();
        self.supported.resize(progress.len(), false);
        if search.owners.iter().all(|owner| owner.restitution == 0.0) {
            return;
        }
        let contacts = search.contacts.iter().map(|contact| (&contact.sides, contact.warm_n_s));
        let rows = ties.rows.iter().map(|row| (&row.sides, row.warm_n_s));
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

    /// Whether the sides of a contact of the step have rebounded.
    pub fn rebounds(&self, at: usize) -> bool {
        self.found.binary_search_by_key(&at, |impact| impact.at).is_ok()
    }

    /// How the sides of a contact that has a coefficient of restitution meet, in this step or later; `None` where they do not.
    fn meeting(&self, contact: &Contact, owner: &Owner, progress: &[Progress]) -> Option<Meeting> {
        if owner.restitution == 0.0 {
            return None;
        }
        let along = |of: fn(&Progress) -> &[DVec3]| {
            contact.sides.each_ref().map(|side| velocity(side, |at| of(&progress[at])).dot(contact.normal))
        };
        let (now, then) = (along(|state| &state.before), along(|state| &state.seen));
        let falls = [0, 1].map(|at| (then[at] - now[at]) / self.step_s);
        // another body holds one that it held in the last step
        let gains = [0, 1].map(|at| match contact.sides[at].terms() {
            [] => 0.0,
            _ if self.supported[contact.sides[at].member] => 0.0,
            _ => falls[at],
        });
        let (gain_m_s2, now_m_s) = (gains[1] - gains[0], contact.surface_m_s.dot(contact.normal) - now[0] + now[1]);
        let after_s = first_root(contact.gap_m, now_m_s, gain_m_s2)?.max(-self.step_s);
        // sides that others drive together in this step have no more than they gain in it
        let gained_m_s = gain_m_s2 * after_s.min(self.step_s);
        let closing_m_s = now_m_s + gained_m_s;
        let (parting_m_s, fall_m_s2) = (owner.restitution * closing_m_s, (falls[1] - falls[0]).max(-falls[0]).max(falls[1]));
        let gains_m_s = -gain_m_s2 * (self.step_s - after_s).max(0.0);
        // sides that come back within a macro step would hop at every step
        let rebounds = parting_m_s > IMPACT_M_S && 2.0 * parting_m_s > fall_m_s2 * self.macro_s;
        Some(Meeting { after_s, closing_m_s, parting_m_s, gained_m_s, gains_m_s, rebounds })
    }

    /// Finds the contacts that rebound: those that bear, and met fast.
    fn find(&mut self, search: &Search, progress: &[Progress]) {
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        let all = search.contacts.iter().zip(&search.owners).enumerate();
        let bearing = all.filter(|(_, (contact, _))| contact.warm_n_s != DVec3::ZERO);
        found.extend(bearing.filter_map(|(at, (contact, owner))| {
            let meeting = self.meeting(contact, owner, progress)?;
            meeting.rebounds.then_some(Impact { at, meeting })
        }));
        self.found = found;
    }

    /// Finds which bodies fly before and after their impacts.
    fn note_flights(
        &mut self,
        all: &[Participant<'_>],
        search: &Search,
        ties: &Ties,
        progress: &[Progress],
        may_fly: bool,
    ) {
        let Self { found, flights, .. } = self;
        flights.clear();
        flights.resize(all.len(), None);
        let mut note = |sides: &[Side; 2], pair: (usize, Partner), meets_s: Option<f64>| {
            for member in movers(sides) {
                let flies = may_fly && all[member].member.role() == Role::Rigid && !progress[member].touched;
                let flight = flights[member].get_or_insert(Flight { pair, after_s: f64::INFINITY, is_free: flies });
                flight.is_free &= meets_s.is_some() && pair == flight.pair;
                flight.after_s = flight.after_s.min(meets_s.unwrap_or(f64::INFINITY));
            }
        };
        let mut impacts = found.iter().peekable();
        for (at, (contact, owner)) in search.contacts.iter().zip(&search.owners).enumerate() {
            let impact = impacts.next_if(|impact| impact.at == at);
            if contact.warm_n_s != DVec3::ZERO {
                let flies = impact.filter(|impact| impact.meeting.parting_m_s + impact.meeting.gains_m_s > 0.0);
                note(&contact.sides, owner.pair(), flies.map(|impact| impact.meeting.after_s));
            }
        }
        for (row, owner) in ties.rows.iter().zip(&ties.owners).filter(|(row, _)| row.warm_n_s != DVec3::ZERO) {
            note(&row.sides, (owner.member, owner.partner), None);
        }
    }

    /// By how much contacts may give way, m/s.
    fn yield_m_s(&self) -> f64 {
        let lost_m_s = |impact: &Impact| impact.meeting.closing_m_s - impact.meeting.parting_m_s;
        let least_m_s = self.found.iter().map(lost_m_s).fold(f64::INFINITY, f64::min);
        (YIELD_SHARE * least_m_s).max(YIELD_MIN_M_S)
    }

    /// Lays out the problem of velocities: impacts, and all that holds the bodies that collide or that touch them.
    fn pose(&mut self, all: &[Participant<'_>], search: &Search, ties: &Ties, progress: &[Progress], depth_m: f64) {
        let Self { found, flights, touching, works, contacts, contacts_of, rows, rows_of, step_s, .. } = self;
        let touches = |contact: &Contact| {
            let opening_m_s = relative(&contact.sides, |at| &progress[at].solved).dot(contact.normal);
            contact.warm_n_s != DVec3::ZERO || contact.gap_m + opening_m_s * *step_s < depth_m
        };
        touching.reset(progress.len());
        let holding = search.contacts.iter().filter(|contact| touches(contact)).map(|contact| &contact.sides);
        for sides in holding.chain(ties.rows.iter().filter(|row| is_rigid(row)).map(|row| &row.sides)) {
            let mut both = movers(sides);
            if let (Some(a), Some(b)) = (both.next(), both.next()) {
                touching.join(a, b);
            }
        }
        works.clear();
        works.resize(progress.len(), Work::default());
        for body in found.iter().filter_map(|impact| movers(&search.contacts[impact.at].sides).next()) {
            works[touching.lowest(body)].collides = true;
        }
        let mut collides = |sides: &[Side; 2]| movers(sides).next().is_some_and(|at| works[touching.lowest(at)].collides);
        contacts.clear();
        contacts_of.clear();
        let mut impacts = found.iter().peekable();
        for (at, contact) in search.contacts.iter().enumerate() {
            let impact = impacts.next_if(|impact| impact.at == at);
            if !(touches(contact) && collides(&contact.sides)) {
                continue;
            }
            let flies = movers(&contact.sides).any(|at| flights[at].is_some_and(|flight| flight.is_free));
            let parting_m_s = impact.map_or(0.0, |Impact { meeting, .. }| {
                (meeting.parting_m_s + if flies { meeting.gains_m_s } else { 0.0 }).max(0.0)
            });
            let warm_n_s = contact.warm_n_s * search.owners[at].restitution;
            let owed_slip_m = DVec3::ZERO;
            contacts.push(Contact { parting_m_s, gap_m: 0.0, load_n_s: 0.0, owed_slip_m, warm_n_s, ..*contact });
            contacts_of.push(at);
        }
        rows.clear();
        rows_of.clear();
        for (at, row) in ties.rows.iter().enumerate().filter(|(_, row)| is_rigid(row)) {
            if collides(&row.sides) {
                let target_m_s = relative(&row.sides, |at| &progress[at].solved);
                rows.push(JointRow { target_m_s, warm_n_s: DVec3::ZERO, owed_slip_m: DVec3::ZERO, ..*row });
                rows_of.push(at);
            }
        }
        // the friction of these contacts about their normals
        let spins = contacts.iter().zip(&*contacts_of).enumerate();
        rows.extend(spins.filter_map(|(k, (contact, at))| spin_friction::row(all, &search.owners[*at], contact, k)));
    }

    /// Finds the work of bodies that touch, by what the solution of the step and impacts gave.
    fn weigh(&mut self, contacts_n_s: &[DVec3], rows_n_s: &[DVec3], progress: &[Progress]) {
        let Self { solver, found, touching, works, contacts, contacts_of, rows, rows_of, .. } = self;
        let solution = solver.solution();
        let struck = |at: usize| progress[at].place.map_or(&[][..], |place| solution.velocities(place));
        let mut add = |sides: &[Side; 2], [solved, given]: [DVec3; 2], gained: [DVec3; 2]| {
            let Some(body) = movers(sides).next() else { return };
            let work = &mut works[touching.lowest(body)];
            let before = relative(sides, |at| &progress[at].before) - gained[0];
            let between = relative(sides, |at| &progress[at].solved) - gained[1];
            let change = relative(sides, struck) - relative(sides, |at| &progress[at].solved);
            work.solved_j += 0.5 * solved.dot(before + between);
            work.slope_j += 0.5 * (given.dot(before + between) + solved.dot(change));
            work.curve_j += given.dot(change);
        };
        for (k, contact) in contacts.iter().enumerate() {
            let at = contacts_of[k];
            let impact = found.binary_search_by_key(&at, |impact| impact.at);
            let [gained, gains] = impact.map_or([0.0; 2], |impact| {
                let Meeting { parting_m_s, gained_m_s, .. } = found[impact].meeting;
                [gained_m_s, contact.parting_m_s - parting_m_s]
            });
            let gained = [gained, gains].map(|along_m_s| contact.normal * along_m_s + contact.surface_m_s);
            add(&contact.sides, [contacts_n_s[at], solution.contacts_n_s[k]], gained);
        }
        for (k, (row, at)) in rows.iter().zip(&*rows_of).enumerate() {
            add(&row.sides, [rows_n_s[*at], solution.rows_n_s[k]], [DVec3::ZERO; 2]);
        }
    }

    /// Gives bodies what impacts change of their velocities, and moves those that fly to where they have come to (eq. 27). Others are where the
    /// solution of the step leaves them.
    fn take(&mut self, all: &[Participant<'_>], search: &Search, ties: &Ties, progress: &mut [Progress]) {
        let Self { solver, flights, touching, works, contacts_of, rows_of, contacts_n_s, rows_n_s, step_s, .. } = self;
        let solution = solver.solution();
        contacts_n_s.resize(search.contacts.len(), DVec3::ZERO);
        rows_n_s.resize(ties.rows.len(), DVec3::ZERO);
        let mut share = |body: usize| works[touching.lowest(body)].share();
        for (k, at) in contacts_of.iter().enumerate() {
            let body = movers(&search.contacts[*at].sides).next();
            contacts_n_s[*at] = solution.contacts_n_s[k] * body.map_or(1.0, &mut share);
        }
        for (k, at) in rows_of.iter().enumerate() {
            let body = movers(&ties.rows[*at].sides).next();
            rows_n_s[*at] = solution.rows_n_s[k] * body.map_or(1.0, &mut share);
        }
        for (body, state) in progress.iter_mut().enumerate() {
            let Some(place) = state.place.filter(|_| works[touching.lowest(body)].collides) else { continue };
            state.strike(solution.velocities(place), works[touching.lowest(body)].share());
            if let Some(flight) = flights[body].filter(|flight| flight.is_free) {
                state.fly_on(flight.after_s, *step_s);
            } else if all[body].member.role() == Role::Rigid {
                state.wait(*step_s);
            }
        }
    }

    /// Lets bodies whose flight would bring them into others be where the solution of the step leaves them, and those others.
    fn land(&mut self, search: &Search, progress: &mut [Progress], depth_m: f64) {
        let Self { flights, step_s, .. } = self;
        let mut lands = true;
        while lands {
            lands = false;
            for contact in &search.contacts {
                if !movers(&contact.sides).any(|at| flights[at].is_some_and(|flight| flight.is_free)) {
                    continue;
                }
                let opening = relative(&contact.sides, |at| &progress[at].going) - contact.surface_m_s;
                if contact.gap_m + opening.dot(contact.normal) * *step_s >= -depth_m {
                    continue;
                }
                for body in movers(&contact.sides) {
                    let Some(flight) = flights[body].as_mut().filter(|flight| flight.is_free) else { continue };
                    flight.is_free = false;
                    progress[body].wait(*step_s);
                    lands = true;
                }
            }
        }
    }

    /// Adds to what members do not answer what impacts leave.
    pub fn leave(&self, progress: &mut [Progress]) {
        for state in progress.iter_mut().filter(|state| !state.jump.is_empty()) {
            let left = state.place.map_or(&[][..], |place| self.solver.solution().unanswered(place));
            state.unanswered.iter_mut().zip(left).for_each(|(r, more)| *r += *more);
        }
    }
}

/// The members that a row moves.
fn movers(sides: &[Side; 2]) -> impl Iterator<Item = usize> + use<> {
    let of = |side: &Side| (!side.terms().is_empty()).then_some(side.member);
    of(&sides[0]).into_iter().chain(of(&sides[1]))
}

/// The velocity of side 0 against side 1 with the velocities `of` members, m/s.
fn relative<'a>(sides: &[Side; 2], of: impl Fn(usize) -> &'a [DVec3]) -> DVec3 {
    velocity(&sides[0], &of) - velocity(&sides[1], &of)
}

/// When a gap g closes that does so at a speed v, which grows by a: the root t of g = v t + ½ a t² at which it closes, t < 0 for g < 0.
fn first_root(gap: f64, speed: f64, gain: f64) -> Option<f64> {
    let inside = speed * speed + 2.0 * gain * gap;
    // the form that loses no digits where the gain is small
    let below = speed + inside.max(0.0).sqrt();
    (inside >= 0.0 && below > 0.0).then(|| 2.0 * gap / below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_from_rest_takes_its_time() {
        let t = first_root(1.0, 0.0, 9.81).unwrap();
        assert!((t - (2.0_f64 / 9.81).sqrt()).abs() < 1e-15);
        assert_eq!(first_root(1.0, -1.0, 0.0), None, "it parts");
        assert_eq!(first_root(0.5, 2.0, 0.0), Some(0.25));
        assert_eq!(first_root(-0.5, 2.0, 0.0), Some(-0.25), "it has met");
        assert_eq!(first_root(1.0, 1.0, -1.0), None, "it turns before");
        assert_eq!(first_root(-2e-5, 0.0, 9.81), None, "it lies");
    }

    #[test]
    fn impacts_are_shortened_to_where_they_make_no_work() {
        let work = |solved_j: f64, slope_j: f64, curve_j: f64| Work { collides: true, solved_j, slope_j, curve_j };
        assert_eq!(work(-1.0, 0.25, 1.0).share(), 1.0);
        let share = work(-1.0, 1.0, 1.0).share();
        assert!((-1.0 + share + 0.5 * share * share).abs() < 1e-15, "{share}");
        assert_eq!(work(0.5, 1.0, 1.0).share(), 0.0, "nothing was lost that it could give back");
    }
}
