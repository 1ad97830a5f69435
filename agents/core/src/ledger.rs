//! The ledger of a coupling: all impulses that its owner has given to one peer since the start, so that no reading can go wrong.
//!
//! In: impulses with the times at which they acted. Out: the impulses given since an earlier reading. Counters are cumulative: a
//! reading that is lost, late or repeated changes nothing (docs/theory/coupling.md, eq. 1–4). Never here: which agents touch.
//!
//! Sums of impulse and of impulse × time grow without end and would cancel badly; they are stored on pages, each with its own
//! time origin. A page is closed after a second and dropped once the peer has acknowledged all of it.
//!
//! A slow owner publishes a step when it begins: impulses that act late in it are also listed separately (`coming`), so that a faster
//! reader takes each impulse when it is due, and not all of them together.

use crate::{AgentId, SimSpan, SimTime};
use glam::DVec3;
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// An impulse on a body: N·s, and N·m·s about its centre of mass (about its own middle for a segment of a tube).
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Impulse {
    /// The change of linear momentum, N·s.
    pub linear: DVec3,
    /// The change of angular momentum, N·m·s.
    pub angular: DVec3,
}

/// Where on a body an impulse acts.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Site {
    /// A rigid body or a tool, as a whole.
    Whole,
    /// A tube at this rest arc length, metres: the linear part acts on its axis there, the angular part on the segment there.
    Arc(f64),
    /// A vertex of a soft body: only the linear part acts.
    Vertex(u32),
}

/// The sums that one site was given on one page.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Entry {
    /// Which site.
    pub site: Site,
    /// J = Σ λ.
    pub sum: Impulse,
    /// S = Σ λ (t − origin), in seconds times the units of an impulse.
    pub moment: Impulse,
}

/// A stretch of a ledger with its own origin of time.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Page {
    /// Pages of a ledger are numbered from zero.
    pub number: u64,
    /// Origin of the times in [`Entry::moment`].
    pub origin: SimTime,
    /// The sums of each site, by rising sites.
    pub entries: Vec<Entry>,
}

/// An impulse that acts late in the owner's newest step.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Scheduled {
    /// The earliest time at which it may be taken.
    pub due: SimTime,
    /// When it acts.
    pub acts: SimTime,
    /// The number of the page that contains it.
    pub page: u64,
    /// Its contribution to that page.
    pub entry: Entry,
}

/// The difference between the impulse that a rigid body has taken and the booked one, of either sign: it lets a force continue evenly.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ahead {
    /// The impulse taken beyond the ledger.
    pub sum: Impulse,
    /// Start of the time over which it acts: evenly around `middle_s` seconds after this.
    pub from: SimTime,
    /// See [`Self::from`]; negative before it.
    pub middle_s: f64,
}

impl Ahead {
    /// Its effect on positions by the time `at`: its impulse times the seconds since.
    #[must_use]
    pub fn carried(&self, at: SimTime) -> Impulse {
        self.sum * (at.secs_after(self.from) - self.middle_s)
    }
}

/// All that the owner of a coupling has given to the peer; the peer keeps a copy of all that it has taken.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ledger {
    /// The agent on the other side.
    pub with: AgentId,
    /// Rises with every publication that differs from the one before.
    pub revision: u64,
    /// Pages not yet acknowledged and the one in use, by rising numbers: two at most.
    pub pages: Vec<Page>,
    /// In the owner's ledger: the parts of the page in use that act late in its newest step. In a copy: the parts not yet taken.
    pub coming: Vec<Scheduled>,
    /// In a copy: the impulse taken beyond it.
    pub ahead: Option<Ahead>,
    /// In the owner's ledger: the force and torque on a rigid body that it expects to go on giving, N and N·m.
    pub force: Impulse,
}

/// How long a page is in use, seconds.
const PAGE_S: f64 = 1.0;
/// Impulses that act within this time of each other are taken together, nanoseconds: a millisecond, in which a body falls 5 µm.
const GRAIN_NS: u64 = 1_000_000;

impl Impulse {
    /// No impulse.
    pub const ZERO: Self = Self { linear: DVec3::ZERO, angular: DVec3::ZERO };

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.linear.is_finite() && self.angular.is_finite()
    }
}

impl Add for Impulse {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }
}

impl AddAssign for Impulse {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Impulse {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Impulse {
    type Output = Self;
    fn neg(self) -> Self {
        Self { linear: -self.linear, angular: -self.angular }
    }
}

impl Mul<f64> for Impulse {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { linear: self.linear * factor, angular: self.angular * factor }
    }
}

impl Site {
    fn order(&self, other: &Self) -> Ordering {
        let kind = |site: &Self| match site {
            Self::Whole => 0,
            Self::Arc(_) => 1,
            Self::Vertex(_) => 2,
        };
        match (self, other) {
            (Self::Arc(a), Self::Arc(b)) => a.total_cmp(b),
            (Self::Vertex(a), Self::Vertex(b)) => a.cmp(b),
            _ => kind(self).cmp(&kind(other)),
        }
    }
}

impl Entry {
    fn add(&mut self, part: &Self) {
        self.sum += part.sum;
        self.moment += part.moment;
    }
}

impl Page {
    fn find(&self, site: Site) -> Result<usize, usize> {
        self.entries.binary_search_by(|entry| entry.site.order(&site))
    }

    fn add(&mut self, part: Entry) {
        let at = self.find(part.site).unwrap_or_else(|at| {
            self.entries.insert(at, Entry { sum: Impulse::ZERO, moment: Impulse::ZERO, ..part });
            at
        });
        self.entries[at].add(&part);
    }

    fn subtract(&mut self, part: &Entry) {
        if let Ok(at) = self.find(part.site) {
            let entry = &mut self.entries[at];
            (entry.sum, entry.moment) = (entry.sum - part.sum, entry.moment - part.moment);
        }
    }
}

impl Ledger {
    /// An empty ledger with the agent `with`.
    #[must_use]
    pub const fn new(with: AgentId) -> Self {
        Self { with, revision: 0, pages: Vec::new(), coming: Vec::new(), ahead: None, force: Impulse::ZERO }
    }

    /// Books an impulse that acted `after_s` seconds after `time`.
    pub fn give(&mut self, site: Site, time: SimTime, after_s: f64, impulse: Impulse) {
        let (page, entry) = self.record(site, time, after_s, impulse);
        let grains = SimSpan::from_secs_f64(after_s).map_or(0, |after| after.as_nanos() / GRAIN_NS);
        if grains > 0 {
            let due = time + SimSpan::from_nanos(grains * GRAIN_NS);
            self.schedule(Scheduled { due, acts: due, page, entry });
        }
    }

    /// Books an impulse that acts `acts_s` and may be taken `due_s` seconds after `time`, possibly past the end of the owner's step.
    pub fn give_late(&mut self, site: Site, time: SimTime, [acts_s, due_s]: [f64; 2], impulse: Impulse) {
        let (page, entry) = self.record(site, time, acts_s, impulse);
        let [acts, due] = [acts_s, due_s].map(|s| time + SimSpan::from_secs_f64(s).unwrap_or(SimSpan::ZERO));
        self.schedule(Scheduled { due, acts, page, entry });
    }

    /// Books on the page in use; returns its number and the booked entry.
    fn record(&mut self, site: Site, time: SimTime, after_s: f64, impulse: Impulse) -> (u64, Entry) {
        if self.pages.is_empty() {
            self.pages.push(Page { number: 0, origin: time, entries: Vec::new() });
        }
        let page = self.pages.last_mut().expect("one was made");
        let after_origin_s = time.secs_after(page.origin) + after_s;
        let entry = Entry { site, sum: impulse, moment: impulse * after_origin_s };
        page.add(entry);
        self.revision += 1;
        (page.number, entry)
    }

    /// Lists a part of a page that acts late.
    fn schedule(&mut self, part: Scheduled) {
        let same = |known: &&mut Scheduled| {
            (known.due, known.acts, known.page) == (part.due, part.acts, part.page)
                && known.entry.site == part.entry.site
        };
        match self.coming.iter_mut().find(same) {
            Some(known) => known.entry.add(&part.entry),
            None => self.coming.push(part),
        }
    }

    /// Begins a step of the owner at `now`: removes late parts from `coming`, as they have acted, but for parts that
    /// still wait for a peer's answer. Drops the pages that the peer has taken completely, and starts a new page where
    /// the present one is full.
    ///
    /// `taken` is the peer's copy, `None` where it has none yet. A new page starts only when no older one waits:
    /// a peer that has stopped acknowledging costs two pages and no more.
    pub fn turn(&mut self, taken: Option<&Self>, now: SimTime) {
        self.coming.retain(|coming| coming.due > coming.acts && coming.due > now);
        let settled = |page: &Page| taken.and_then(|t| t.page(page.number)).is_some_and(|t| t.entries == page.entries);
        if self.pages.len() > 1 && settled(&self.pages[0]) {
            self.pages.remove(0);
            self.revision += 1;
        }
        if let [page] = &self.pages[..]
            && !page.entries.is_empty()
            && now.secs_after(page.origin) > PAGE_S
        {
            let number = page.number + 1;
            self.pages.push(Page { number, origin: now, entries: Vec::new() });
            self.revision += 1;
        }
    }

    /// The contents of this ledger beyond `earlier` (`None`: all of it): dJ, and dJ t − dS at the time `at`. The impulse that `earlier`
    /// took ahead is returned with the opposite sign.
    ///
    /// A page that only `earlier` has was dropped because all of it was taken: it counts for nothing.
    pub fn since(&self, earlier: Option<&Self>, at: SimTime, mut visit: impl FnMut(Site, Impulse, Impulse)) {
        if let Some(ahead) = earlier.and_then(|e| e.ahead) {
            visit(Site::Whole, -ahead.sum, -ahead.carried(at));
        }
        self.beyond(earlier, at, visit);
    }

    /// The same without the impulse taken ahead.
    pub fn beyond(&self, earlier: Option<&Self>, at: SimTime, mut visit: impl FnMut(Site, Impulse, Impulse)) {
        for page in &self.pages {
            let known = earlier.and_then(|e| e.page(page.number));
            let t = at.secs_after(page.origin);
            for entry in &page.entries {
                let known_entry = known.and_then(|k| k.find(entry.site).ok().map(|i| k.entries[i]));
                let (sum, moment) = match known_entry {
                    Some(known_entry) => (entry.sum - known_entry.sum, entry.moment - known_entry.moment),
                    None => (entry.sum, entry.moment),
                };
                if sum != Impulse::ZERO || moment != Impulse::ZERO {
                    visit(entry.site, sum, sum * t - moment);
                }
            }
        }
    }

    /// Whether this ledger is later than the copy `taken`, or that copy has left out impulses that may be due by now.
    #[must_use]
    pub fn is_beyond(&self, taken: &Self) -> bool {
        let open = !taken.coming.is_empty() || taken.ahead.is_some();
        self.revision > taken.revision || (self.revision == taken.revision && open)
    }

    /// Whether `taken` contains all of this ledger.
    #[must_use]
    pub fn is_settled(&self, taken: Option<&Self>) -> bool {
        let mut settled = true;
        self.since(taken, SimTime::ZERO, |_, _, _| settled = false);
        settled
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let entries = self.pages.iter().flat_map(|p| &p.entries);
        entries.map(|e| [e.sum, e.moment]).chain([[self.force; 2]]).flatten().all(|i| i.is_finite())
    }

    /// Copies `given` into the storage of this one, except the impulses that are due at `until` or later.
    pub fn read(&mut self, given: &Self, until: SimTime) {
        self.copy_from(given);
        let Self { pages, coming, .. } = self;
        coming.retain(|coming| coming.due >= until);
        for late in coming.iter() {
            pages.iter_mut().filter(|page| page.number == late.page).for_each(|page| page.subtract(&late.entry));
        }
    }

    /// Copies `other` into the storage of this one.
    pub fn copy_from(&mut self, other: &Self) {
        (self.with, self.revision, self.ahead) = (other.with, other.revision, other.ahead);
        self.force = other.force;
        self.pages.truncate(other.pages.len());
        let kept = self.pages.len();
        for (mine, theirs) in self.pages.iter_mut().zip(&other.pages) {
            (mine.number, mine.origin) = (theirs.number, theirs.origin);
            mine.entries.clone_from(&theirs.entries);
        }
        self.pages.extend(other.pages[kept..].iter().cloned());
        self.coming.clone_from(&other.coming);
    }

    fn page(&self, number: u64) -> Option<&Page> {
        self.pages.iter().find(|page| page.number == number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pushed(x: f64) -> Impulse {
        Impulse { linear: DVec3::X * x, angular: DVec3::ZERO }
    }

    fn at(seconds: f64) -> SimTime {
        SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
    }

    #[test]
    fn a_difference_is_the_impulse_and_how_far_it_has_carried_since() {
        let mut ledger = Ledger::new(AgentId(1));
        ledger.give(Site::Whole, at(0.5), 0.25, pushed(2.0));
        let mut seen = vec![];
        ledger.since(None, at(2.0), |site, sum, carried| seen.push((site, sum.linear.x, carried.linear.x)));
        assert_eq!(seen, [(Site::Whole, 2.0, 2.0 * (2.0 - 0.75))]);
    }

    #[test]
    fn sums_do_not_lose_digits_over_a_day() {
        let (mut given, mut taken) = (Ledger::new(AgentId(1)), Ledger::new(AgentId(0)));
        let day = 86_400;
        for second in 0..day {
            let now = at(f64::from(second));
            given.turn(Some(&taken), now);
            given.give(Site::Whole, now, 0.0, pushed(0.1));
            if second < day - 1 {
                taken.copy_from(&given);
            }
        }
        let mut carried = 0.0;
        given.since(Some(&taken), at(f64::from(day)), |_, _, moved| carried += moved.linear.x);
        assert!((carried - 0.1).abs() < 1e-15, "{carried}"); // one second of one impulse: roundings of 0.1
        assert!(given.pages.len() <= 2 && given.pages.iter().all(|p| p.entries.len() == 1));
    }

    #[test]
    fn an_impulse_late_in_a_step_is_taken_when_it_is_due() {
        let (mut given, mut taken) = (Ledger::new(AgentId(1)), Ledger::new(AgentId(0)));
        given.turn(None, at(1.0));
        for part in 0..6 {
            given.give(Site::Whole, at(1.0), f64::from(part) / 60.0, pushed(0.5));
        }
        let mut read_until = |given: &Ledger, until: f64| {
            let mut reading = Ledger::new(AgentId(0));
            reading.read(given, at(until));
            let mut sum = 0.0;
            reading.since(Some(&taken), at(until), |_, impulse, _| sum += impulse.linear.x);
            taken = reading;
            (sum, given.is_beyond(&taken), given.is_settled(Some(&taken)))
        };
        assert_eq!(read_until(&given, 1.01), (0.5, true, false));
        assert_eq!(read_until(&given, 1.04), (1.0, true, false));
        assert_eq!(read_until(&given, 1.041), (0.0, true, false), "nothing is due in that millisecond");
        given.turn(None, at(1.1));
        assert_eq!(read_until(&given, 1.042), (1.5, false, true), "the owner's next step begins: all has acted");
    }

    #[test]
    fn a_waiting_impulse_is_taken_when_due_however_often_its_owner_steps() {
        let (mut given, mut taken) = (Ledger::new(AgentId(1)), Ledger::new(AgentId(0)));
        given.give_late(Site::Whole, at(1.0), [0.1, 0.2], pushed(0.5));
        given.turn(None, at(1.15));
        let mut read_until = |until: f64| {
            let mut reading = Ledger::new(AgentId(0));
            reading.read(&given, at(until));
            let mut seen = (0.0, 0.0);
            reading.since(Some(&taken), at(until), |_, sum, way| seen = (sum.linear.x, way.linear.x));
            taken = reading;
            seen
        };
        assert_eq!(read_until(1.2), (0.0, 0.0));
        let (sum, way) = read_until(1.3);
        assert!((sum - 0.5).abs() < 1e-15 && (way - 0.1).abs() < 1e-12, "{sum} {way}"); // it has acted for 0.2 s
    }

    proptest! {
        /// The peer ends with every impulse exactly once, and at its time, whether readings are lost, repeated, late
        /// or not due yet.
        #[test]
        fn every_schedule_delivers_each_impulse_once(
            steps in prop::collection::vec(
                (0.001_f64..0.4, -1.0_f64..1.0, 0_u8..4, 0_usize..5, 0_u8..3, 0.0_f64..0.1), 1..200),
        ) {
            let mut given = Ledger::new(AgentId(1));
            let mut published = vec![given.clone()];
            let mut acknowledged = vec![];
            let mut taken: Option<Ledger> = None;
            let (mut now, mut total, mut moment) = (0.0, 0.0, 0.0);
            let (mut received, mut arrived, mut until) = (0.0, 0.0, 0.0_f64);
            let mut take = |ledger: &Ledger, taken: &mut Option<Ledger>, now: f64, until: f64| {
                if taken.as_ref().is_some_and(|known| !ledger.is_beyond(known)) {
                    return; // an older reading
                }
                let mut reading = Ledger::new(AgentId(0));
                reading.read(ledger, at(until));
                reading.since(taken.as_ref(), at(now), |_, sum, moved| {
                    received += sum.linear.x;
                    arrived += sum.linear.x * now - moved.linear.x;
                });
                *taken = Some(reading);
            };
            for (gap, size, site, late, what, after) in steps {
                now = at(now + gap).as_secs_f64(); // times are whole nanoseconds
                // the peer's copy as the owner sees it may be old
                let seen: Option<&Ledger> = acknowledged.len().checked_sub(1 + late).and_then(|i| acknowledged.get(i));
                given.turn(seen, at(now));
                for (after, size) in [(0.0, size), (after, 0.5 * size), (after, size)] {
                    given.give(Site::Arc(f64::from(site)), at(now), after, pushed(size));
                    total += size;
                    moment += size * (now + after);
                }
                given.give_late(Site::Arc(f64::from(site)), at(now), [after, after + 0.05], pushed(size));
                total += size;
                moment += size * (now + after);
                published.push(given.clone());
                // the peer reads the newest, an old one, or nothing
                let read = match what { 0 => None, 1 => published.last(), _ => published.get(published.len().saturating_sub(1 + late)) };
                if let Some(ledger) = read {
                    until = now.max(until) + 0.5 * gap; // no step of a reader ends before its previous one
                    take(ledger, &mut taken, now, until);
                    acknowledged.extend(taken.clone());
                }
            }
            take(&given, &mut taken, now, until.max(now) + 0.2);
            prop_assert!((received - total).abs() < 1e-12 * 200.0, "{received} {total}");
            prop_assert!((arrived - moment).abs() < 1e-9, "{arrived} {moment}");
            prop_assert!(given.is_settled(taken.as_ref()));
        }
    }
}
