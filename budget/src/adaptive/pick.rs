//! The choice of a frame: hull steps in falling gain per time, in linear time.
//!
//! In: a menu, κ of every stage, a budget. Out: steps taken of every object, λ, and a bound.
//! Never here: where the budget comes from. Theory: `docs/theory/budget.md`, eq. 32 and 33.
//!
//! Steps whose gain per time is far above the last price are taken, steps far below it are not; those near it fall into buckets by the
//! leading bits of their gain per time. Whole buckets are taken from the top while they fit; only the steps of the one bucket that does
//! not fit whole are sorted, and those that fit are taken. Where the price is not near the last one, all steps are near. So the answer is the one of a full sort,
//! without its time.

use alloc::vec::Vec;
use core::ops::Range;

use super::STAGES;
use super::menu::{Menu, Object, Step};

/// Buckets to an octave: the top bits of the mantissa. A bucket spans 9 %.
const BITS: u32 = 3;
/// Octaves that are told apart, about 1; what is above or below falls into the outermost bucket.
const OCTAVES: u64 = 192;
const BUCKETS: usize = (OCTAVES << BITS) as usize;

/// Fewer objects than this go on below the bucket in which the budget ends: with few, large steps much would stay unspent.
const FEW: usize = 32;

/// What the steps count of an object that has just risen: where accuracy is 1 − ½/polygons, it falls again once it is an octave too fine.
const YOUNG: f64 = 4.0;

/// What a choice came to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Picked {
    /// Whether the least of everything fits.
    pub feasible: bool,
    /// What each stage takes by the table, ticks.
    pub table: [u64; STAGES],
    /// Weighted gain.
    pub value: f64,
    /// No choice within the budget is worth more.
    pub upper: f64,
    /// Gain of one more tick; 0 where everything is at its most.
    pub lambda: f64,
}

impl Picked {
    /// Takes one more step where it fits.
    fn take(&mut self, terms: &Terms, object: &Object, step: &Step) -> bool {
        let mut with = self.table;
        with[usize::from(object.stage)] += u64::from(step.cost);
        let fits = terms.cost(&with) <= terms.budget;
        if fits {
            self.table = with;
        }
        fits
    }
}

/// What a choice depends on besides the menu.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Terms {
    /// What may be spent, measured ticks.
    pub budget: f64,
    /// Measured ticks to one of the table, for each stage; > 0.
    pub kappa: [f64; STAGES],
    /// What a step that was taken last time counts: 1 + h.
    pub loyalty: f64,
    /// 1/κ of each stage: a division an object would take longer than all else.
    pub per_kappa: [f64; STAGES],
    /// What one object can take at most above its least, by the table of each stage: what is dearer can never fit.
    pub reach: [u64; STAGES],
}

impl Terms {
    /// Terms without a menu: what one object can take is known once there is one.
    pub(crate) fn new(budget: f64, kappa: [f64; STAGES], loyalty: f64) -> Self {
        Self { budget, kappa, loyalty, per_kappa: kappa.map(|k| 1.0 / k), reach: [0; STAGES] }
    }

    fn cost(&self, table: &[u64; STAGES]) -> f64 {
        table.iter().zip(&self.kappa).map(|(&t, k)| t as f64 * k).sum()
    }

    /// What a gain per tick of the table is worth per measured tick, for an object's steps: others, and those it had.
    fn worth(&self, object: &Object) -> [f64; 2] {
        let worth = object.weight * self.per_kappa[usize::from(object.stage)];
        [worth, worth * if object.just_rose() { YOUNG.max(self.loyalty) } else { self.loyalty }]
    }

    /// How many steps of an object are on offer: all that are worth something and can ever fit; having just fallen, those it had.
    fn on_offer(&self, object: &Object, steps: &[Step]) -> usize {
        let most = match (object.weight > 0.0, object.just_fell()) {
            (false, _) => 0,
            (true, false) => object.steps,
            (true, true) => object.taken,
        };
        let mut left = self.reach[usize::from(object.stage)];
        if object.span <= left {
            return usize::from(most);
        }
        let fits = |step: &&Step| match left.checked_sub(u64::from(step.cost)) {
            Some(rest) => {
                left = rest;
                true
            }
            None => false,
        };
        steps[..usize::from(most)].iter().take_while(fits).count()
    }
}

/// A step on the edge of the budget.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    merit: f64,
    object: u32,
    step: u16,
}

/// Gains per time that are told apart: from the first on, below the second. What is above is taken, what is below is not.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Near(f64, f64);

impl Near {
    const ALL: Self = Self(0.0, f64::INFINITY);

    /// A fifth of the last price up and down, to the bottom of a bucket; where all was had, all is taken again.
    fn to(price: f64) -> Self {
        Self(bottom(bucket(price / 1.2)), 1.2 * price)
    }

    /// The buckets that it reaches into.
    fn buckets(self) -> Range<usize> {
        bucket(self.0)..bucket(self.1) + 1
    }
}

/// Buffers of the choice, kept from frame to frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Picker {
    /// The price of the last choice.
    price: f64,
    /// What the near steps of every stage and bucket take by the table.
    bins: Vec<[u64; BUCKETS]>,
    /// Steps whose gain per time is near the price, object after object.
    near: Vec<Edge>,
    /// Steps of the bucket in which the budget ends.
    edge: Vec<Edge>,
    /// Steps taken of every object.
    taken: Vec<u16>,
}

impl Picker {
    /// Chooses; the menu remembers what was taken, and what changed is slow to turn back.
    pub(crate) fn pick(&mut self, menu: &mut Menu, mut terms: Terms, dwell: u8) -> Picked {
        let mut picked = Picked { table: menu.least, ..Picked::default() };
        let spare = terms.budget - terms.cost(&menu.least);
        terms.reach = terms.kappa.map(|k| (spare / k) as u64);
        if spare < 0.0 || spare.is_nan() {
            self.taken.clear();
            self.taken.resize(menu.objects().len(), 0);
            picked.value = menu.objects().iter().map(|o| o.base.gain * o.weight).sum();
            menu.objects_mut().iter_mut().for_each(|object| object.settle(0, dwell));
            return picked;
        }
        picked.feasible = true;
        let found = self.find_edge(menu, &terms, Near::to(self.price));
        picked.table = found.unwrap_or_else(|| self.find_edge(menu, &terms, Near::ALL).unwrap_or(menu.least));
        self.sort_edge();
        picked.lambda = self.take_edge(menu, &terms, &mut picked);
        self.price = picked.lambda;
        if picked.lambda > 0.0 && (menu.droppable > 0 || menu.objects().len() < FEW) {
            self.go_on(menu, &terms, &mut picked);
        }
        self.settle(menu, &terms, &mut picked, dwell);
        picked
    }

    /// Takes all steps above the bucket in which the budget ends, and lays those in it aside: what is taken comes to, by the table.
    /// `None` where that bucket is not among the near ones.
    fn find_edge(&mut self, menu: &Menu, terms: &Terms, near: Near) -> Option<[u64; STAGES]> {
        let (mut table, all) = self.take_far(menu, terms, near);
        if terms.cost(&table) > terms.budget {
            return None;
        }
        self.sort_into_buckets(menu, near);
        for at in near.buckets().rev() {
            let mut with = table;
            with.iter_mut().zip(&self.bins).for_each(|(sum, bins)| *sum += bins[at]);
            if terms.cost(&with) > terms.budget {
                self.take_above(at);
                return Some(table);
            }
            table = with;
        }
        self.take_above(0);
        all.then_some(table)
    }

    /// Takes the steps above the near ones and collects those: what is taken comes to, and whether no step is below.
    fn take_far(&mut self, menu: &Menu, terms: &Terms, Near(low, high): Near) -> ([u64; STAGES], bool) {
        self.near.clear();
        self.near.reserve(menu.room());
        self.taken.clear();
        let (mut table, mut all) = (menu.least, true);
        for (i, object) in (0..).zip(menu.objects()) {
            let steps = menu.steps_of(object);
            let offered = &steps[..terms.on_offer(object, steps)];
            let worth = terms.worth(object);
            let merit = |at: usize| offered[at].slope * worth[usize::from(at < usize::from(object.taken))];
            let (mut at, mut cost) = (0, 0);
            while at < offered.len() && merit(at) >= high {
                cost += u64::from(offered[at].cost);
                at += 1;
            }
            table[usize::from(object.stage)] += cost;
            self.taken.push(at as u16);
            while at < offered.len() && merit(at) >= low {
                self.near.push(Edge { merit: merit(at), object: i, step: at as u16 });
                at += 1;
            }
            all &= at == offered.len();
        }
        (table, all)
    }

    /// Fills the bins.
    fn sort_into_buckets(&mut self, menu: &Menu, near: Near) {
        self.bins.resize(STAGES, [0; BUCKETS]);
        self.bins.iter_mut().for_each(|bins| bins[near.buckets()].fill(0));
        for step in &self.near {
            let object = &menu.objects()[step.object as usize];
            let cost = menu.steps_of(object)[usize::from(step.step)].cost;
            self.bins[usize::from(object.stage)][bucket(step.merit)] += u64::from(cost);
        }
    }

    /// Takes the near steps above a bucket, and lays those in it aside.
    fn take_above(&mut self, edge: usize) {
        self.edge.clear();
        // along a hull buckets never rise: of every object those above come first
        for step in &self.near {
            let at = bucket(step.merit);
            self.taken[step.object as usize] += u16::from(at > edge);
            if at == edge {
                self.edge.push(*step);
            }
        }
    }

    /// Best first; objects stand in the order of their ids, and that decides between equals.
    fn sort_edge(&mut self) {
        let place = |e: &Edge| (e.object, e.step);
        self.edge.sort_unstable_by(|a, b| b.merit.total_cmp(&a.merit).then(place(a).cmp(&place(b))));
    }

    /// Takes the steps on the edge that fit; the gain per tick of the first that does not. Those after it are worth nearly as much, and
    /// one large step must not keep them all out; but of its object nothing more is taken.
    fn take_edge(&mut self, menu: &Menu, terms: &Terms, picked: &mut Picked) -> f64 {
        let mut lambda = 0.0;
        for edge in &self.edge {
            let object = &menu.objects()[edge.object as usize];
            let step = &menu.steps_of(object)[usize::from(edge.step)];
            let taken = &mut self.taken[edge.object as usize];
            if *taken == edge.step && picked.take(terms, object, step) {
                *taken += 1;
            } else if lambda == 0.0 {
                lambda = step.slope * terms.worth(object)[0];
            }
        }
        lambda
    }

    /// Below the bucket in which the budget ends: of every object, best first, the next steps that do.
    fn go_on(&mut self, menu: &Menu, terms: &Terms, picked: &mut Picked) {
        self.edge.clear();
        for (i, object) in menu.objects().iter().enumerate() {
            let (at, steps) = (usize::from(self.taken[i]), menu.steps_of(object));
            if at < terms.on_offer(object, steps) {
                let merit = steps[at].slope * terms.worth(object)[usize::from(at < usize::from(object.taken))];
                self.edge.push(Edge { merit, object: i as u32, step: at as u16 });
            }
        }
        self.sort_edge();
        for edge in &self.edge {
            let object = &menu.objects()[edge.object as usize];
            let steps = menu.steps_of(object);
            let next = &steps[usize::from(edge.step)..terms.on_offer(object, steps)];
            let taken = next.iter().take_while(|step| picked.take(terms, object, step)).count();
            self.taken[edge.object as usize] += taken as u16;
        }
    }

    /// Writes down what was taken, what it is worth, and the bound that the price λ gives for any choice, each object being best for
    /// itself (eq. 33): what was taken, the price of what is left over, and what hysteresis kept from being best.
    fn settle(&self, menu: &mut Menu, terms: &Terms, picked: &mut Picked, dwell: u8) {
        let mut astray = 0.0;
        for (i, &taken) in self.taken.iter().enumerate() {
            let object = &menu.objects()[i];
            picked.value += object.weight * menu.gain(object, taken);
            let (steps, worth) = (menu.steps_of(object), terms.worth(object)[0]);
            let kappa = terms.kappa[usize::from(object.stage)];
            let net = |step: &Step| (step.slope * worth - picked.lambda) * (kappa * f64::from(step.cost));
            let (had, rest) = steps.split_at(usize::from(taken));
            astray -= had.iter().rev().take_while(|s| s.slope * worth < picked.lambda).map(net).sum::<f64>();
            astray += rest.iter().take_while(|s| s.slope * worth > picked.lambda).map(net).sum::<f64>();
            menu.objects_mut()[i].settle(taken, dwell);
        }
        picked.upper = picked.value + picked.lambda * (terms.budget - terms.cost(&picked.table)) + astray;
    }
}

/// The exponent and the top bits of the mantissa of what falls into the lowest bucket but for what is below that.
const LOWEST: u64 = (1023 - OCTAVES / 2) << BITS;

/// The least merit that falls into a bucket.
fn bottom(bucket: usize) -> f64 {
    if bucket > 0 { f64::from_bits((LOWEST + bucket as u64) << (52 - BITS)) } else { 0.0 }
}

/// Where a merit falls: by its exponent and the top bits of its mantissa. It is not NaN, and not below 0.
fn bucket(merit: f64) -> usize {
    let top = merit.to_bits() >> (52 - BITS);
    top.saturating_sub(LOWEST).min(BUCKETS as u64 - 1) as usize
}
