//! The groups that the default policy draws by an impostor: groups whose members gain less than their time costs at the
//! present price.
//!
//! In: groups, λ and γ of the last plan. Out: which groups are closed. Never here: the choice of the impostor, or levels of members.
//! Theory: `docs/theory/control.md`, eq. 24.
//!
//! At a price λ of a second every part of a tree can be decided by itself: a group is closed if the best of its impostors leaves more net
//! benefit (benefit minus cost at λ) than its members at their best. If even the least of all open groups does not fit,
//! groups close that lose least. A group that was opened too soon waits longer the next time.
//!
//! A closed group closes the groups inside it, so that opening it is charged with its cheapest cut, their impostors:
//! these open afterwards, each for its own cost.

use super::groups::{Groups, Impostors};
use crate::control::demand::query::{FrameQuery, TICKS};
use crate::control::prices::ladder::Rung;

/// A group changes if that gains at least this fraction of its members' least cost: the price fluctuates.
const MIN_GAIN: f64 = 0.1;

/// Share of a new price in the smoothed one that groups use, about ten frames of memory. One group changes the price of all others, so with
/// the price of a single frame all would change simultaneously.
const PRICE_SMOOTHING: f64 = 0.1;

/// Frames that a closed group waits before it may open again: initial and greatest.
const PATIENCE: (u32, u32) = (8, 512);

/// The open or closed state of one group.
#[derive(Debug, Clone, Copy)]
struct GroupState {
    closed: bool,
    /// Frames since it last changed.
    still: u32,
    patience: u32,
}

/// Totals of an object, or of all of a group.
#[derive(Debug, Clone, Copy, Default)]
struct Totals {
    /// Benefit minus cost at the present price, each part at its best.
    net: f64,
    /// Least cost, ticks by the prices.
    least: f64,
}

/// All groups, by the numbers of their objects.
#[derive(Debug, Clone, Default)]
pub(super) struct ImpostorChoice {
    states: Vec<Option<GroupState>>,
    totals: Vec<Totals>,
    impostors: Impostors,
    /// Gain of a tick by the prices, smoothed; 0 before anything had a price.
    price: f64,
}

impl ImpostorChoice {
    /// Decides at `lambda` (gain of a tick) and `slowness` (measured ticks per tick by the prices).
    pub fn decide(&mut self, query: &FrameQuery<'_>, groups: &Groups, lambda: f64, slowness: f64) {
        self.states.resize(query.views.len(), None);
        if groups.all().is_empty() {
            return;
        }
        self.impostors.update(query, groups);
        let now = lambda * slowness;
        let price = if self.price > 0.0 { self.price + PRICE_SMOOTHING * (now - self.price) } else { now };
        self.price = price;
        self.sum_leaves(query, groups, price);
        let mut spare = self.spare(query, groups, slowness);
        for &group in groups.all() {
            if !self.impostors.is_in_view(group) {
                continue;
            }
            let (open, closed) = (self.totals[group], self.closed(query, group, price));
            let hidden = self.is_hidden(groups, group);
            let state = self.states[group].get_or_insert(GroupState::OPEN);
            state.still = state.still.saturating_add(1);
            let taken = match closed {
                Some(closed) if hidden => closed,
                Some(closed) => state.update(open, closed, MIN_GAIN * price * open.least, &mut spare),
                None => {
                    // the members cost less than any impostor
                    if state.closed {
                        state.open();
                    }
                    open
                }
            };
            if let Some(parent) = groups.parent(group) {
                self.totals[parent].add(taken);
            }
        }
        self.make_room(query, groups, slowness);
        for &group in groups.all() {
            if self.is_hidden(groups, group) {
                self.states[group].get_or_insert(GroupState::OPEN).closed = true;
            }
        }
    }

    /// Whether a group above this object is closed.
    fn is_hidden(&self, groups: &Groups, at: usize) -> bool {
        groups.is_within(at, |group| self.is_closed(group))
    }

    /// Closes groups until the least levels of the open ones fit, first those groups that lose least for the time they
    /// save.
    fn make_room(&mut self, query: &FrameQuery<'_>, groups: &Groups, slowness: f64) {
        let mut spare = self.spare(query, groups, slowness);
        while spare < 0.0 {
            let hidden = |at: usize| self.is_closed(at) || self.is_hidden(groups, at);
            let open = groups.all().iter().filter(|group| !hidden(**group));
            let saves = |&group: &usize| {
                let coarsest = self.impostors.rungs(query, group).first()?;
                let saved = self.totals[group].least - TICKS * coarsest.cost_s;
                let lost = self.impostors.members_worth(group) - self.impostors.worth(group) * coarsest.accuracy;
                (saved > 0.0).then(|| (group, saved, lost / saved))
            };
            let Some((group, saved, _)) = open.filter_map(saves).min_by(|a, b| a.2.total_cmp(&b.2)) else { return };
            if let Some(state) = &mut self.states[group] {
                state.close();
            }
            for above in groups.above(group) {
                self.totals[above].least -= saved;
            }
            spare += saved;
        }
    }

    /// Ticks by the prices left over when everything open or closed has its least cost; below 0 if that does not fit.
    fn spare(&self, query: &FrameQuery<'_>, groups: &Groups, slowness: f64) -> f64 {
        TICKS * query.budget_s() / slowness - self.least(query, groups)
    }

    /// A group drawn by the best impostor at this price; `None` if its members in their lowest forms are cheaper than any.
    fn closed(&self, query: &FrameQuery<'_>, group: usize, price: f64) -> Option<Totals> {
        let (rungs, worth) = (self.impostors.rungs(query, group), self.impostors.worth(group));
        let nets = rungs.iter().map(|rung| worth * rung.accuracy - price * (TICKS * rung.cost_s));
        Some(Totals { net: nets.fold(f64::NEG_INFINITY, f64::max), least: TICKS * rungs.first()?.cost_s })
    }

    /// Sums objects that are drawn as themselves into their groups.
    fn sum_leaves(&mut self, query: &FrameQuery<'_>, groups: &Groups, price: f64) {
        self.totals.clear();
        self.totals.resize(query.views.len(), Totals::default());
        for at in query.drawable() {
            let (rungs, weight) = (&query.ladders.of(at).rungs, query.weight(at));
            let nets = rungs.iter().map(|rung| weight * rung.accuracy - price * TICKS * rung.cost_s);
            let leaf = Totals { net: nets.fold(f64::NEG_INFINITY, f64::max), least: TICKS * rungs[0].cost_s };
            self.totals[at] = leaf;
            if let Some(group) = groups.parent(at) {
                self.totals[group].add(leaf);
            }
        }
    }

    /// Least cost of everything at the present open and closed groups, ticks.
    fn least(&self, query: &FrameQuery<'_>, groups: &Groups) -> f64 {
        let cost = |at: usize| {
            let hidden = self.is_hidden(groups, at);
            match () {
                () if hidden => 0.0,
                () if !query.views[at].view.is_group() => self.totals[at].least,
                () if self.is_closed(at) => self.impostors.rungs(query, at).first().map_or(0.0, |it| TICKS * it.cost_s),
                () => 0.0,
            }
        };
        (0..self.totals.len()).map(cost).sum()
    }

    /// Whether this object is a group that is drawn by an impostor.
    pub fn is_closed(&self, at: usize) -> bool {
        self.states.get(at).copied().flatten().is_some_and(|state| state.closed)
    }

    /// The impostors that a closed group can be drawn by, and the benefit of its finest; only its coarsest if nothing of it is in view.
    pub fn impostors<'a>(&self, query: &FrameQuery<'a>, group: usize) -> (&'a [Rung], f64) {
        let (rungs, ladder) = (self.impostors.rungs(query, group), query.ladders.of(group));
        let drawn = if rungs.is_empty() { &ladder.rungs[..ladder.rungs.len().min(1)] } else { rungs };
        (drawn, self.impostors.worth(group))
    }
}

impl Totals {
    fn add(&mut self, other: Self) {
        self.net += other.net;
        self.least += other.least;
    }
}

impl GroupState {
    /// A group in view for the first time.
    const OPEN: Self = Self { closed: false, still: u32::MAX, patience: PATIENCE.0 };

    /// Closes or opens the group if that gains more than `bar` and `spare` ticks allow it; gives the resulting totals.
    fn update(&mut self, open: Totals, closed: Totals, bar: f64, spare: &mut f64) -> Totals {
        let more = open.least - closed.least;
        if !self.closed && closed.net > open.net + bar {
            self.close();
            *spare += more;
        } else if self.closed && open.net > closed.net + bar && self.still > self.patience && *spare >= more {
            self.open();
            *spare -= more;
        }
        if self.closed { closed } else { open }
    }

    fn close(&mut self) {
        // a short time since the last change means that it was opened too soon
        let soon = self.still < 4 * self.patience;
        self.patience = if soon { (2 * self.patience).min(PATIENCE.1) } else { PATIENCE.0 };
        (self.closed, self.still) = (true, 0);
    }

    fn open(&mut self) {
        (self.closed, self.still) = (false, 0);
    }
}
