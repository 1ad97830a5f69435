//! Which groups the default draws by their proxy: those whose members are worth less than their time at its price.
//!
//! In: groups, λ and κ of the last plan. Out: which are closed. Never here: levels of what is not in a closed group.
//! Theory: `docs/theory/control.md`, eq. 24.
//!
//! At a price λ of a second every part of a tree can be decided by itself: it is closed where its proxy leaves more of its worth after
//! its cost is paid than the best of its members do. Where even the least of what is open does not fit, those are closed that lose
//! least. A group that was opened too soon waits longer the next time.

use super::ask::{Ask, TICKS};
use super::groups::Groups;

/// A group changes where that gains this part of what its members cost at least: the price trembles.
const WORTH_IT: f64 = 0.1;

/// The share of a new price in the one that groups go by, about ten frames of memory: one group changes the price of all others, and by
/// the price of one frame they would all change at once.
const PRICE_NEWS: f64 = 0.1;

/// Frames that a closed group waits at first and at most before it may open again.
const PATIENCE: (u32, u32) = (8, 512);

/// One group.
#[derive(Debug, Clone, Copy)]
struct Door {
    closed: bool,
    /// Frames since it last changed.
    still: u32,
    patience: u32,
}

/// What an object, or all of a group, comes to.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    /// Worth that is left after the price is paid, each part at its best.
    net: f64,
    /// What it costs at least, ticks by the prices.
    least: f64,
}

/// All groups, by the numbers of their objects.
#[derive(Debug, Clone, Default)]
pub(super) struct Closing {
    doors: Vec<Option<Door>>,
    sums: Vec<Sum>,
    worth: Vec<f64>,
    /// Gain of a tick by the prices, smoothed; 0 before anything had a price.
    price: f64,
}

impl Closing {
    /// Decides at `lambda` (gain of a tick) and `kappa` (ticks for one by the prices).
    pub fn decide(&mut self, ask: &Ask<'_>, groups: &Groups, (lambda, kappa): (f64, f64)) {
        self.doors.resize(ask.views.len(), None);
        if groups.all().is_empty() {
            return;
        }
        groups.lowest_worth(ask, &mut self.worth);
        let now = lambda * kappa;
        let price = if self.price > 0.0 { self.price + PRICE_NEWS * (now - self.price) } else { now };
        self.price = price;
        self.sum_leaves(ask, groups, price);
        let mut spare = TICKS * ask.budget_s() / kappa - self.least(ask, groups);
        for &group in groups.all() {
            let Some(closed) = self.proxy(ask, group, price) else { continue };
            let open = self.sums[group];
            let door = self.doors[group].get_or_insert(Door { closed: false, still: u32::MAX, patience: PATIENCE.0 });
            let (bar, more) = (WORTH_IT * price * open.least, open.least - closed.least);
            door.still = door.still.saturating_add(1);
            if !door.closed && closed.net > open.net + bar {
                door.close();
                spare += more;
            } else if door.closed && open.net > closed.net + bar && door.still > door.patience && spare >= more {
                door.open();
                spare -= more;
            }
            let taken = if door.closed { closed } else { open };
            if let Some(parent) = groups.parent(group) {
                self.sums[parent].add(taken);
            }
        }
        self.make_room(ask, groups, spare);
    }

    /// Closes groups until the least of what is open fits, those first that lose least for the time they save.
    fn make_room(&mut self, ask: &Ask<'_>, groups: &Groups, mut spare: f64) {
        while spare < 0.0 {
            let open = groups.all().iter().filter(|group| !self.is_closed(**group));
            let saves = |&group: &usize| {
                let saved = self.sums[group].least - self.proxy(ask, group, 0.0)?.least;
                (saved > 0.0).then(|| (group, saved, self.worth[group] / saved))
            };
            let Some((group, saved, _)) = open.filter_map(saves).min_by(|a, b| a.2.total_cmp(&b.2)) else { return };
            if let Some(door) = &mut self.doors[group] {
                door.close();
            }
            spare += saved;
        }
    }

    /// A group drawn by its proxy; `None` where nothing of it is in view.
    fn proxy(&self, ask: &Ask<'_>, group: usize, price: f64) -> Option<Sum> {
        let proxy = ask.ladders.of(group).proxy.filter(|_| self.worth[group] > 0.0)?;
        let least = TICKS * proxy.cost_s;
        Some(Sum { net: self.worth[group] - price * least, least })
    }

    /// What is drawn by itself, summed into its group.
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

    /// What everything costs at least as the doors are, ticks.
    fn least(&self, ask: &Ask<'_>, groups: &Groups) -> f64 {
        let cost = |at: usize| {
            let hidden = groups.parent(at).is_some() && groups.is_within(at, |group| self.is_closed(group));
            match ask.ladders.of(at).proxy {
                _ if hidden => 0.0,
                Some(_) if !self.is_closed(at) => 0.0,
                Some(_) => self.proxy(ask, at, 0.0).map_or(0.0, |proxy| proxy.least),
                None => self.sums[at].least,
            }
        };
        (0..self.sums.len()).map(cost).sum()
    }

    /// Whether this object is a group that is drawn by its proxy.
    pub fn is_closed(&self, at: usize) -> bool {
        self.doors.get(at).copied().flatten().is_some_and(|door| door.closed)
    }

    /// What the proxy of a group is worth.
    pub fn proxy_worth(&self, at: usize) -> f64 {
        self.worth[at]
    }
}

impl Sum {
    fn add(&mut self, other: Self) {
        self.net += other.net;
        self.least += other.least;
    }
}

impl Door {
    fn close(&mut self) {
        // it was opened too soon
        let soon = self.still < 4 * self.patience;
        self.patience = if soon { (2 * self.patience).min(PATIENCE.1) } else { PATIENCE.0 };
        (self.closed, self.still) = (true, 0);
    }

    fn open(&mut self) {
        (self.closed, self.still) = (false, 0);
    }
}
