//! The choice of a frame: hull steps in falling gain per time, in linear time.
//!
//! In: a menu, κ of every stage, a budget. Out: steps taken of every object, λ, and a bound.
//! Never here: where the budget comes from. Theory: `docs/theory/budget.md`, eq. 32 and 33.
//!
//! Steps fall into buckets by the leading bits of their gain per time. Whole buckets are taken from the top while they fit; only the
//! steps of the one bucket that does not fit whole are sorted. So the answer is the one of a full sort, without its time.

use alloc::vec::Vec;

use super::STAGES;
use super::menu::{Menu, Object, Step};

/// Buckets to an octave: the top bits of the mantissa. A bucket spans 9 %.
const BITS: u32 = 3;
/// Octaves that are told apart, about 1; what is above or below falls into the outermost bucket.
const OCTAVES: u64 = 192;
const BUCKETS: usize = (OCTAVES << BITS) as usize;

/// Fewer objects than this go on after the first step that does not fit: with few, large steps much would stay unspent.
const FEW: usize = 32;

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
        [worth, worth * self.loyalty]
    }

    /// How many steps of an object are on offer: all that are worth something and can ever fit; while it dwells, those it had.
    fn on_offer(&self, object: &Object, steps: &[Step]) -> usize {
        let most = match (object.weight > 0.0, object.dwell) {
            (false, _) => 0,
            (true, 0 | 1) => object.steps,
            (true, _) => object.taken,
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

/// Buffers of the choice, kept from frame to frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Picker {
    /// What the steps of every stage and bucket take by the table.
    bins: Vec<[u64; BUCKETS]>,
    /// The bucket of every step on offer, where the menu has the step.
    buckets: Vec<u16>,
    /// Steps of the bucket in which the budget ends.
    edge: Vec<Edge>,
    /// Steps on offer, and then steps taken, of every object.
    taken: Vec<u16>,
}

impl Picker {
    /// Chooses; the menu remembers what was taken, and an object that fell dwells.
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
        self.sort_into_buckets(menu, &terms);
        let edge = self.find_edge(&terms, &mut picked);
        self.take_above(menu, &terms, edge);
        picked.lambda = self.take_edge(menu, &terms, &mut picked);
        if picked.lambda > 0.0 && (menu.droppable > 0 || menu.objects().len() < FEW) {
            self.go_on(menu, &terms, &mut picked);
        }
        self.settle(menu, &terms, &mut picked, dwell);
        picked
    }

    /// Fills the bins.
    fn sort_into_buckets(&mut self, menu: &Menu, terms: &Terms) {
        self.bins.clear();
        self.bins.resize(STAGES, [0; BUCKETS]);
        self.buckets.resize(menu.room(), 0);
        self.taken.clear();
        for object in menu.objects() {
            let steps = menu.steps_of(object);
            let offered = terms.on_offer(object, steps);
            let worth = terms.worth(object);
            let bins = &mut self.bins[usize::from(object.stage)];
            let buckets = &mut self.buckets[menu.range_of(object)][..offered];
            for (at, (step, place)) in steps[..offered].iter().zip(buckets).enumerate() {
                // an index, not a branch: what an object had cannot be foreseen
                let bucket = bucket(step.slope * worth[usize::from(at < usize::from(object.taken))]);
                bins[bucket] += u64::from(step.cost);
                *place = bucket as u16;
            }
            self.taken.push(offered as u16);
        }
    }

    /// The bucket in which the budget ends, and in `picked` what all above it come to; 0 where everything fits.
    fn find_edge(&self, terms: &Terms, picked: &mut Picked) -> u16 {
        for at in (1..BUCKETS).rev() {
            if self.bins.iter().all(|bins| bins[at] == 0) {
                continue;
            }
            let mut with = picked.table;
            with.iter_mut().zip(&self.bins).for_each(|(sum, bins)| *sum += bins[at]);
            if terms.cost(&with) > terms.budget {
                return at as u16;
            }
            picked.table = with;
        }
        0
    }

    /// Takes all steps above the edge, and lays those on it aside, best first.
    fn take_above(&mut self, menu: &Menu, terms: &Terms, edge: u16) {
        self.edge.clear();
        for (i, (object, taken)) in menu.objects().iter().zip(&mut self.taken).enumerate() {
            let own = &self.buckets[menu.range_of(object)][..usize::from(*taken)];
            // along a hull buckets never rise
            let above = own.partition_point(|bucket| *bucket > edge);
            *taken = above as u16;
            for (at, _) in own.iter().enumerate().skip(above).take_while(|(_, bucket)| **bucket == edge) {
                let worth = terms.worth(object)[usize::from(at < usize::from(object.taken))];
                let merit = menu.steps_of(object)[at].slope * worth;
                self.edge.push(Edge { merit, object: i as u32, step: at as u16 });
            }
        }
        self.sort_edge();
    }

    /// Best first; objects stand in the order of their ids, and that decides between equals.
    fn sort_edge(&mut self) {
        let place = |e: &Edge| (e.object, e.step);
        self.edge.sort_unstable_by(|a, b| b.merit.total_cmp(&a.merit).then(place(a).cmp(&place(b))));
    }

    /// Takes the steps on the edge until one does not fit; its gain per tick.
    fn take_edge(&mut self, menu: &Menu, terms: &Terms, picked: &mut Picked) -> f64 {
        for edge in &self.edge {
            let object = &menu.objects()[edge.object as usize];
            let step = &menu.steps_of(object)[usize::from(edge.step)];
            if !picked.take(terms, object, step) {
                return step.slope * terms.worth(object)[0];
            }
            self.taken[edge.object as usize] = edge.step + 1;
        }
        0.0
    }

    /// After the first step that does not fit: of every object, best first, the next steps that do.
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
            astray -= had.iter().rev().map(net).take_while(|n| *n < 0.0).sum::<f64>();
            astray += rest.iter().map(net).take_while(|n| *n > 0.0).sum::<f64>();
            menu.objects_mut()[i].settle(taken, dwell);
        }
        picked.upper = picked.value + picked.lambda * (terms.budget - terms.cost(&picked.table)) + astray;
    }
}

/// Where a merit falls: by its exponent and the top bits of its mantissa. It is not NaN, and not below 0.
fn bucket(merit: f64) -> usize {
    const LOWEST: u64 = (1023 - OCTAVES / 2) << BITS;
    let top = merit.to_bits() >> (52 - BITS);
    top.saturating_sub(LOWEST).min(BUCKETS as u64 - 1) as usize
}
