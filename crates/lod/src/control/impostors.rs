//! The groups that the default policy draws by an impostor: those whose members gain less than their time costs at the present price.
//!
//! In: groups, λ and κ of the last plan. Out: which groups are closed. Never here: the choice of the impostor, or levels of members.
//! Theory: `docs/theory/control.md`, eq. 24.
//!
//! At a price λ of a second every part of a tree can be decided by itself: a group is closed if the best of its impostors leaves more net
//! benefit (benefit minus cost at λ) than its members at their best. If even the least of all open groups does not fit, those are closed
//! that lose least. A group that was opened too soon waits longer the next time.

use super::groups::{Groups, Impostors};
use super::ladder::Rung;
use super::query::{Ask, TICKS};

/// A group changes if that gains at least this fraction of its members' least cost: the price fluctuates.
const WORTH_IT: f64 = 0.1;

/// Share of a new price in the smoothed one that groups use, about ten frames of memory. One group changes the price of all others, so with
/// the price of a single frame all would change simultaneously.
const PRICE_NEWS: f64 = 0.1;

/// Frames that a closed group waits before it may open again: initial and greatest.
const PATIENCE: (u32, u32) = (8, 512);

/// The open or closed state of one group.
#[derive(Debug, Clone, Copy)]
struct Door {
    closed: bool,
    /// Frames since it last changed.
    still: u32,
    patience: u32,
}

/// Totals of an object, or of all of a group.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    /// Benefit minus cost at the present price, each part at its best.
    net: f64,
    /// Least cost, ticks by the prices.
    least: f64,
}

/// All groups, by the numbers of their objects.
#[derive(Debug, Clone, Default)]
pub(super) struct ImpostorChoice {
    doors: Vec<Option<Door>>,
    sums: Vec<Sum>,
    impostors: Impostors,
    /// Gain of a tick by the prices, smoothed; 0 before anything had a price.
    price: f64,
}

impl ImpostorChoice {
    /// Decides at `lambda` (gain of a tick) and `kappa` (measured ticks per tick by the prices).
    pub fn decide(&mut self, ask: &Ask<'_>, groups: &Groups, lambda: f64, kappa: f64) {
        self.doors.resize(ask.views.len(), None);
        if groups.all().is_empty() {
            return;
        }
        self.impostors.update(ask, groups);
        let now = lambda * kappa;
        let price = if self.price > 0.0 { self.price + PRICE_NEWS * (now - self.price) } else { now };
        self.price = price;
        self.sum_leaves(ask, groups, price);
        let mut spare = self.spare(ask, groups, kappa);
        for &group in groups.all() {
            if !self.impostors.is_in_view(group) {
                continue;
            }
            let (open, closed) = (self.sums[group], self.closed(ask, group, price));
            let door = self.doors[group].get_or_insert(Door { closed: false, still: u32::MAX, patience: PATIENCE.0 });
            door.still = door.still.saturating_add(1);
            let taken = match closed {
                Some(closed) => door.pass(open, closed, WORTH_IT * price * open.least, &mut spare),
                None => {
                    // the members cost less than any impostor
                    if door.closed {
                        door.open();
                    }
                    open
                }
            };
            if let Some(parent) = groups.parent(group) {
                self.sums[parent].add(taken);
            }
        }
        self.make_room(ask, groups, kappa);
    }

    /// Closes groups until the least of what is open fits, those first that lose least for the time they save.
    fn make_room(&mut self, ask: &Ask<'_>, groups: &Groups, kappa: f64) {
        let mut spare = self.spare(ask, groups, kappa);
        while spare < 0.0 {
            let shut = |at: usize| self.is_closed(at) || groups.is_within(at, |group| self.is_closed(group));
            let open = groups.all().iter().filter(|group| !shut(**group));
            let saves = |&group: &usize| {
                let coarsest = self.impostors.rungs(ask, group).first()?;
                let saved = self.sums[group].least - TICKS * coarsest.cost_s;
                let lost = self.impostors.members_worth(group) - self.impostors.worth(group) * coarsest.accuracy;
                (saved > 0.0).then(|| (group, saved, lost / saved))
            };
            let Some((group, saved, _)) = open.filter_map(saves).min_by(|a, b| a.2.total_cmp(&b.2)) else { return };
            if let Some(door) = &mut self.doors[group] {
                door.close();
            }
            for above in groups.above(group) {
                self.sums[above].least -= saved;
            }
            spare += saved;
        }
    }

    /// Ticks by the prices left over when everything open or closed has its least cost; below 0 if that does not fit.
    fn spare(&self, ask: &Ask<'_>, groups: &Groups, kappa: f64) -> f64 {
        TICKS * ask.budget_s() / kappa - self.least(ask, groups)
    }

    /// A group drawn by the best impostor at this price; `None` if its members in their lowest forms are cheaper than any.
    fn closed(&self, ask: &Ask<'_>, group: usize, price: f64) -> Option<Sum> {
        let (rungs, worth) = (self.impostors.rungs(ask, group), self.impostors.worth(group));
        let nets = rungs.iter().map(|rung| worth * rung.accuracy - price * (TICKS * rung.cost_s));
        Some(Sum { net: nets.fold(f64::NEG_INFINITY, f64::max), least: TICKS * rungs.first()?.cost_s })
    }

    /// Sums objects that are drawn as themselves into their groups.
    fn sum_leaves(&mut self, ask: &Ask<'_>, groups: &Groups, price: f64) {
        self.sums.clear();
        self.sums.resize(ask.views.len(), Sum::default());
        for at in ask.drawable() {
            let (rungs, weight) = (&ask.ladders.of(at).rungs, ask.weight(at));
            let nets = rungs.iter().map(|rung| weight * rung.accuracy - price * TICKS * rung.cost_s);
            let leaf = Sum { net: nets.fold(f64::NEG_INFINITY, f64::max), least: TICKS * rungs[0].cost_s };
            self.sums[at] = leaf;
            if let Some(group) = groups.parent(at) {
                self.sums[group].add(leaf);
            }
        }
    }

    /// Least cost of everything at the present open and closed groups, ticks.
    fn least(&self, ask: &Ask<'_>, groups: &Groups) -> f64 {
        let cost = |at: usize| {
            let hidden = groups.parent(at).is_some() && groups.is_within(at, |group| self.is_closed(group));
            match () {
                () if hidden => 0.0,
                () if !ask.views[at].view.is_group() => self.sums[at].least,
                () if self.is_closed(at) => self.impostors.rungs(ask, at).first().map_or(0.0, |it| TICKS * it.cost_s),
                () => 0.0,
            }
        };
        (0..self.sums.len()).map(cost).sum()
    }

    /// Whether this object is a group that is drawn by an impostor.
    pub fn is_closed(&self, at: usize) -> bool {
        self.doors.get(at).copied().flatten().is_some_and(|door| door.closed)
    }

    /// The impostors that a closed group can be drawn by, and the benefit of its finest; only its coarsest if nothing of it is in view.
    pub fn impostors<'a>(&self, ask: &Ask<'a>, group: usize) -> (&'a [Rung], f64) {
        let (rungs, ladder) = (self.impostors.rungs(ask, group), ask.ladders.of(group));
        let drawn = if rungs.is_empty() { &ladder.rungs[..ladder.rungs.len().min(1)] } else { rungs };
        (drawn, self.impostors.worth(group))
    }
}

impl Sum {
    fn add(&mut self, other: Self) {
        self.net += other.net;
        self.least += other.least;
    }
}

impl Door {
    /// Closes or opens the group if that gains more than `bar` and `spare` ticks allow it; gives the resulting totals.
    fn pass(&mut self, open: Sum, closed: Sum, bar: f64, spare: &mut f64) -> Sum {
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
