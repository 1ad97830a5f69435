//! The choice of a frame: hull steps in falling gain per time, in linear time.
//!
//! In: the options, γ of every stage, a budget. Out: steps taken for every object, λ, and a bound.
//! Never here: where the budget comes from. Theory: `docs/theory/budget.md`, eq. 32 and 33.
//!
//! Steps whose gain per time is far above the last price are taken, steps far below it are not; steps near it fall into
//! buckets by the leading bits of their gain per time. Whole buckets are taken from the top while they fit; only the
//! steps of the one bucket that does not fit whole are sorted, and taken as far as they fit. If the price is not near
//! the last one, all steps count as near. So the result equals a full sort's, in linear time.

use alloc::vec::Vec;
use core::ops::Range;

use super::STAGES;
use super::options::{Object, Options, Step};

/// Buckets to an octave: the top bits of the mantissa. A bucket spans 9 %.
const BITS: u32 = 3;
/// Octaves that are resolved, centred at 1; values above or below fall into the outermost bucket.
const OCTAVES: u64 = 192;
const BUCKETS: usize = (OCTAVES << BITS) as usize;

/// With fewer objects than this the choice continues below the bucket in which the budget ends: with few, large steps much would stay
/// unspent.
const FEW_OBJECTS: usize = 32;

/// Factor for the steps of an object that has just risen: where accuracy is 1 − ½/polygons, it falls again once it is an octave too fine.
const JUST_ROSE_FACTOR: f64 = 4.0;

/// The result of a choice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PickResult {
    /// Whether every object at its least fits.
    pub feasible: bool,
    /// Ticks of each stage by the table.
    pub table: [u64; STAGES],
    /// Weighted gain.
    pub value: f64,
    /// No choice within the budget has a greater value.
    pub upper: f64,
    /// Gain of one more tick; 0 where everything is at its finest.
    pub lambda: f64,
}

impl PickResult {
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

/// Inputs of a choice in addition to the options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Terms {
    /// Measured ticks that may be spent.
    pub budget: f64,
    /// Measured ticks per tick of the table, for each stage; > 0.
    pub slowness: [f64; STAGES],
    /// Factor for a step that was taken last time: 1 + h.
    pub stay_factor: f64,
    /// 1/γ of each stage: a division per object would dominate the time.
    pub per_slowness: [f64; STAGES],
    /// Most ticks that one object can take above its least, by the table of each stage: a more expensive object can never fit.
    pub reach: [u64; STAGES],
}

impl Terms {
    /// Terms without the options: `reach` is set once there is one.
    pub(crate) fn new(budget: f64, slowness: [f64; STAGES], stay_factor: f64) -> Self {
        Self { budget, slowness, stay_factor, per_slowness: slowness.map(|k| 1.0 / k), reach: [0; STAGES] }
    }

    fn cost(&self, table: &[u64; STAGES]) -> f64 {
        table.iter().zip(&self.slowness).map(|(&t, k)| t as f64 * k).sum()
    }

    /// Factors from gain per tick of the table to gain per measured tick, for an object's steps: new ones, and steps
    /// taken last time.
    fn worth(&self, object: &Object) -> [f64; 2] {
        let worth = object.weight * self.per_slowness[usize::from(object.stage)];
        [worth, worth * if object.just_rose() { JUST_ROSE_FACTOR.max(self.stay_factor) } else { self.stay_factor }]
    }

    /// How many steps of an object are on offer: all that have a gain and can ever fit; if the object has just fallen,
    /// the steps it had.
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

/// The range of gains per time that is resolved: from the first on, below the second. Steps above it are taken, steps below it are not.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Near(f64, f64);

impl Near {
    const ALL: Self = Self(0.0, f64::INFINITY);

    /// The last price divided and multiplied by 1.2, the lower end rounded down to the bottom of a bucket; if all was taken last time, all
    /// is taken again.
    fn to(price: f64) -> Self {
        Self(bottom(bucket(price / 1.2)), 1.2 * price)
    }

    /// The buckets that the range covers.
    fn buckets(self) -> Range<usize> {
        bucket(self.0)..bucket(self.1) + 1
    }
}

/// Buffers of the choice, kept from frame to frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Picker {
    /// The price of the last choice.
    price: f64,
    /// Cost of the near steps of every stage and bucket by the table.
    bins: Vec<[u64; BUCKETS]>,
    /// Steps whose gain per time is near the price, object after object.
    near: Vec<Edge>,
    /// Steps of the bucket in which the budget ends.
    edge: Vec<Edge>,
    /// Steps taken of every object.
    taken: Vec<u16>,
}

impl Picker {
    /// Chooses; the options store the steps taken, and objects that changed are reluctant to reverse.
    pub(crate) fn pick(&mut self, options: &mut Options, mut terms: Terms, dwell: u8) -> PickResult {
        let mut result = PickResult { table: options.least, ..PickResult::default() };
        let spare = terms.budget - terms.cost(&options.least);
        terms.reach = terms.slowness.map(|k| (spare / k) as u64);
        if spare < 0.0 || spare.is_nan() {
            self.taken.clear();
            self.taken.resize(options.objects().len(), 0);
            result.value = options.objects().iter().map(|o| o.base.gain * o.weight).sum();
            options.objects_mut().iter_mut().for_each(|object| object.settle(0, dwell));
            return result;
        }
        result.feasible = true;
        let found = self.find_edge(options, &terms, Near::to(self.price));
        result.table = found.unwrap_or_else(|| self.find_edge(options, &terms, Near::ALL).unwrap_or(options.least));
        self.sort_edge();
        result.lambda = self.take_edge(options, &terms, &mut result);
        self.price = result.lambda;
        if result.lambda > 0.0 && (options.droppable > 0 || options.objects().len() < FEW_OBJECTS) {
            self.fill_below_edge(options, &terms, &mut result);
        }
        self.settle(options, &terms, &mut result, dwell);
        result
    }

    /// Takes all steps above the bucket in which the budget ends, and collects the steps in it in `edge`. Gives the
    /// ticks taken by the table;
    /// `None` where that bucket is not among the near ones.
    fn find_edge(&mut self, options: &Options, terms: &Terms, near: Near) -> Option<[u64; STAGES]> {
        let (mut table, all) = self.take_far(options, terms, near);
        if terms.cost(&table) > terms.budget {
            return None;
        }
        self.sort_into_buckets(options, near);
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

    /// Takes the steps above the near ones and collects the near ones. Gives the ticks taken, and whether no step is below.
    fn take_far(&mut self, options: &Options, terms: &Terms, Near(low, high): Near) -> ([u64; STAGES], bool) {
        self.near.clear();
        self.near.reserve(options.room());
        self.taken.clear();
        let (mut table, mut all) = (options.least, true);
        for (i, object) in (0..).zip(options.objects()) {
            let steps = options.steps_of(object);
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
    fn sort_into_buckets(&mut self, options: &Options, near: Near) {
        self.bins.resize(STAGES, [0; BUCKETS]);
        self.bins.iter_mut().for_each(|bins| bins[near.buckets()].fill(0));
        for step in &self.near {
            let object = &options.objects()[step.object as usize];
            let cost = options.steps_of(object)[usize::from(step.step)].cost;
            self.bins[usize::from(object.stage)][bucket(step.merit)] += u64::from(cost);
        }
    }

    /// Takes the near steps above a bucket, and collects the steps in it in `edge`.
    fn take_above(&mut self, edge: usize) {
        self.edge.clear();
        // along a hull buckets never rise: each object's steps above the edge come first
        for step in &self.near {
            let at = bucket(step.merit);
            self.taken[step.object as usize] += u16::from(at > edge);
            if at == edge {
                self.edge.push(*step);
            }
        }
    }

    /// Best first; ties are broken by the order of ids.
    fn sort_edge(&mut self) {
        let place = |e: &Edge| (e.object, e.step);
        self.edge.sort_unstable_by(|a, b| b.merit.total_cmp(&a.merit).then(place(a).cmp(&place(b))));
    }

    /// Takes the steps on the edge that fit, and gives the gain per tick of the first that does not. One large step
    /// must not block the steps after it, whose gains are nearly as high; but no further step of its object is taken.
    fn take_edge(&mut self, options: &Options, terms: &Terms, result: &mut PickResult) -> f64 {
        let mut lambda = 0.0;
        for edge in &self.edge {
            let object = &options.objects()[edge.object as usize];
            let step = &options.steps_of(object)[usize::from(edge.step)];
            let taken = &mut self.taken[edge.object as usize];
            if *taken == edge.step && result.take(terms, object, step) {
                *taken += 1;
            } else if lambda == 0.0 {
                lambda = step.slope * terms.worth(object)[0];
            }
        }
        lambda
    }

    /// Below the bucket in which the budget ends: takes each object's next steps that fit, best first.
    fn fill_below_edge(&mut self, options: &Options, terms: &Terms, result: &mut PickResult) {
        self.edge.clear();
        for (i, object) in options.objects().iter().enumerate() {
            let (at, steps) = (usize::from(self.taken[i]), options.steps_of(object));
            if at < terms.on_offer(object, steps) {
                let merit = steps[at].slope * terms.worth(object)[usize::from(at < usize::from(object.taken))];
                self.edge.push(Edge { merit, object: i as u32, step: at as u16 });
            }
        }
        self.sort_edge();
        for edge in &self.edge {
            let object = &options.objects()[edge.object as usize];
            let steps = options.steps_of(object);
            let next = &steps[usize::from(edge.step)..terms.on_offer(object, steps)];
            let taken = next.iter().take_while(|step| result.take(terms, object, step)).count();
            self.taken[edge.object as usize] += taken as u16;
        }
    }

    /// Stores the steps taken, their value, and the bound that the price λ gives for any choice, with each object optimised on its own (eq.
    /// 33): the value taken, the price of the time left over, and the loss caused by hysteresis.
    fn settle(&self, options: &mut Options, terms: &Terms, result: &mut PickResult, dwell: u8) {
        let mut missed_gain = 0.0;
        for (i, &taken) in self.taken.iter().enumerate() {
            let object = &options.objects()[i];
            result.value += object.weight * options.gain(object, taken);
            let (steps, worth) = (options.steps_of(object), terms.worth(object)[0]);
            let slowness = terms.slowness[usize::from(object.stage)];
            let net = |step: &Step| (step.slope * worth - result.lambda) * (slowness * f64::from(step.cost));
            let (had, rest) = steps.split_at(usize::from(taken));
            missed_gain -= had.iter().rev().take_while(|s| s.slope * worth < result.lambda).map(net).sum::<f64>();
            missed_gain += rest.iter().take_while(|s| s.slope * worth > result.lambda).map(net).sum::<f64>();
            options.objects_mut()[i].settle(taken, dwell);
        }
        result.upper = result.value + result.lambda * (terms.budget - terms.cost(&result.table)) + missed_gain;
    }
}

/// Exponent and top bits of the mantissa at the bottom of the lowest bucket; smaller values fall into it too.
const LOWEST: u64 = (1023 - OCTAVES / 2) << BITS;

/// The least merit that falls into a bucket.
fn bottom(bucket: usize) -> f64 {
    if bucket > 0 { f64::from_bits((LOWEST + bucket as u64) << (52 - BITS)) } else { 0.0 }
}

/// The bucket of a merit: by its exponent and the top bits of its mantissa. The merit is not NaN, and not below 0.
fn bucket(merit: f64) -> usize {
    let top = merit.to_bits() >> (52 - BITS);
    top.saturating_sub(LOWEST).min(BUCKETS as u64 - 1) as usize
}
