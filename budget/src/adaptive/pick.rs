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

    /// What a gain per tick of the table is worth per measured tick, for an object's steps: those it had, and others.
    fn worth(&self, object: &Object) -> (f64, f64) {
        let worth = object.weight * self.per_kappa[usize::from(object.stage)];
        (worth * self.loyalty, worth)
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
        let fits = |step: &&Step| match left.checked_sub(step.cost) {
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
    /// For every stage and bucket the ticks of its steps.
    bins: Vec<[u64; BUCKETS]>,
    /// The bucket of every step on offer, object after object.
    buckets: Vec<u16>,
    /// Steps of the bucket in which the budget ends.
    edge: Vec<Edge>,
    /// Steps on offer, and then steps taken, of every object.
    taken: Vec<u16>,
}

impl Picker {
    /// Steps taken of every object, in the order of the menu.
    pub(crate) fn taken(&self) -> &[u16] {
        &self.taken
    }

    /// Chooses.
    pub(crate) fn pick(&mut self, menu: &Menu, mut terms: Terms) -> Picked {
        let mut table = menu.least;
        let spare = terms.budget - terms.cost(&table);
        terms.reach = terms.kappa.map(|k| (spare / k) as u64);
        let (feasible, mut lambda) = (spare >= 0.0, 0.0);
        if feasible {
            self.sort_into_buckets(menu, &terms);
            let edge = self.find_edge(&terms, &mut table);
            self.take_above(menu, &terms, edge);
            lambda = self.take_edge(menu, &terms, &mut table);
            if lambda > 0.0 && (menu.droppable > 0 || menu.objects().len() < FEW) {
                self.go_on(menu, &terms, &mut table);
            }
        } else {
            self.taken.clear();
            self.taken.resize(menu.objects().len(), 0);
        }
        let (value, upper) = self.certify(menu, &terms, lambda);
        Picked { feasible, table, value, upper: if feasible { upper } else { 0.0 }, lambda }
    }

    fn sort_into_buckets(&mut self, menu: &Menu, terms: &Terms) {
        self.bins.clear();
        self.bins.resize(STAGES, [0; BUCKETS]);
        self.buckets.clear();
        self.taken.clear();
        for object in menu.objects() {
            let steps = menu.steps_of(object);
            let offered = terms.on_offer(object, steps);
            let (had, other) = terms.worth(object);
            let bins = &mut self.bins[usize::from(object.stage)];
            for (at, step) in steps[..offered].iter().enumerate() {
                let bucket = bucket(step.slope * if at < usize::from(object.taken) { had } else { other });
                bins[bucket] += step.cost;
                self.buckets.push(bucket as u16);
            }
            self.taken.push(offered as u16);
        }
    }

    /// The bucket in which the budget ends, and in `table` what all above it take; 0 where everything fits.
    fn find_edge(&self, terms: &Terms, table: &mut [u64; STAGES]) -> usize {
        for at in (0..BUCKETS).rev() {
            let mut with = *table;
            with.iter_mut().zip(&self.bins).for_each(|(sum, bins)| *sum += bins[at]);
            if terms.cost(&with) > terms.budget {
                return at;
            }
            if at > 0 {
                *table = with;
            }
        }
        0
    }

    /// Takes all steps above the edge, and lays those on it aside, best first.
    fn take_above(&mut self, menu: &Menu, terms: &Terms, edge: usize) {
        self.edge.clear();
        let mut rest = self.buckets.as_slice();
        for (i, (object, taken)) in menu.objects().iter().zip(&mut self.taken).enumerate() {
            let (own, others) = rest.split_at(usize::from(*taken));
            rest = others;
            // along a hull, buckets never rise
            let above = own.iter().take_while(|&&b| usize::from(b) > edge).count();
            let on = own[above..].iter().take_while(|&&b| usize::from(b) == edge).count();
            *taken = above as u16;
            let (had, other) = terms.worth(object);
            for at in above..above + on {
                let worth = if at < usize::from(object.taken) { had } else { other };
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
    fn take_edge(&mut self, menu: &Menu, terms: &Terms, table: &mut [u64; STAGES]) -> f64 {
        for edge in &self.edge {
            let object = &menu.objects()[edge.object as usize];
            let step = &menu.steps_of(object)[usize::from(edge.step)];
            let mut with = *table;
            with[usize::from(object.stage)] += step.cost;
            if terms.cost(&with) > terms.budget {
                return step.slope * terms.worth(object).1;
            }
            *table = with;
            self.taken[edge.object as usize] = edge.step + 1;
        }
        0.0
    }

    /// After the first step that does not fit: of every object, best first, the next steps that do.
    fn go_on(&mut self, menu: &Menu, terms: &Terms, table: &mut [u64; STAGES]) {
        self.edge.clear();
        for (i, object) in menu.objects().iter().enumerate() {
            let (at, steps) = (usize::from(self.taken[i]), menu.steps_of(object));
            if at < terms.on_offer(object, steps) {
                let (had, other) = terms.worth(object);
                let merit = steps[at].slope * if at < usize::from(object.taken) { had } else { other };
                self.edge.push(Edge { merit, object: i as u32, step: at as u16 });
            }
        }
        self.sort_edge();
        for edge in &self.edge {
            let object = &menu.objects()[edge.object as usize];
            let steps = menu.steps_of(object);
            for step in &steps[usize::from(edge.step)..terms.on_offer(object, steps)] {
                let mut with = *table;
                with[usize::from(object.stage)] += step.cost;
                if terms.cost(&with) > terms.budget {
                    break;
                }
                *table = with;
                self.taken[edge.object as usize] += 1;
            }
        }
    }

    /// The value taken, and the bound that the price λ gives for any choice: each object is best for itself (eq. 33).
    fn certify(&self, menu: &Menu, terms: &Terms, lambda: f64) -> (f64, f64) {
        let (mut value, mut upper) = (0.0, lambda * terms.budget);
        for (object, &taken) in menu.objects().iter().zip(&self.taken) {
            value += menu.vertex(object, taken).gain * object.weight;
            // the best vertex is where the gain per tick falls to λ: near the one that was taken
            let (steps, worth) = (menu.steps_of(object), terms.worth(object).1);
            let mut best = usize::from(taken);
            while best > 0 && steps[best - 1].slope * worth < lambda {
                best -= 1;
            }
            while best < steps.len() && steps[best].slope * worth > lambda {
                best += 1;
            }
            let at = menu.vertex(object, best as u16);
            upper += at.gain * object.weight - lambda * terms.kappa[usize::from(object.stage)] * at.cost as f64;
        }
        (value, upper)
    }
}

/// Where a merit falls: by its exponent and the top bits of its mantissa. It is not NaN, and not below 0.
fn bucket(merit: f64) -> usize {
    const LOWEST: u64 = (1023 - OCTAVES / 2) << BITS;
    let top = merit.to_bits() >> (52 - BITS);
    top.saturating_sub(LOWEST).min(BUCKETS as u64 - 1) as usize
}
