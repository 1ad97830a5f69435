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
    /// What one object can take at most above its least, by the table of each stage: what is dearer can never fit.
    pub reach: [u64; STAGES],
}

impl Terms {
    fn cost(&self, table: &[u64; STAGES]) -> f64 {
        table.iter().zip(&self.kappa).map(|(&t, k)| t as f64 * k).sum()
    }

    /// Gain per measured tick of a step.
    fn merit(&self, object: &Object, at: usize, step: &Step) -> f64 {
        let loyal = if at < usize::from(object.taken) { self.loyalty } else { 1.0 };
        step.slope * (object.weight / self.kappa[object.stage] * loyal)
    }
}

/// Buffers of the choice, kept from frame to frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Picker {
    /// For every bucket and stage the ticks of its steps.
    bins: Vec<[u64; STAGES]>,
    /// Steps of the bucket in which the budget ends: merit, object, step.
    edge: Vec<(f64, u32, u16)>,
    /// Steps taken of every object.
    taken: Vec<u16>,
}

impl Picker {
    /// Steps taken of every object, in the order of the menu.
    pub(crate) fn taken(&self) -> &[u16] {
        &self.taken
    }

    /// Chooses.
    pub(crate) fn pick(&mut self, menu: &Menu, mut terms: Terms) -> Picked {
        self.taken.clear();
        self.taken.resize(menu.objects().len(), 0);
        let mut table = [0; STAGES];
        menu.objects().iter().for_each(|o| table[o.stage] += o.base.0);
        let spare = terms.budget - terms.cost(&table);
        let feasible = spare >= 0.0;
        terms.reach = terms.kappa.map(|k| (spare / k) as u64);
        let terms = &terms;
        let mut lambda = 0.0;
        if feasible {
            self.fill_bins(menu, terms);
            let edge = self.find_edge(terms, &mut table);
            self.take_above(menu, terms, edge);
            lambda = self.take_edge(menu, terms, &mut table);
            let droppable = menu.objects().iter().any(|o| o.base.2.is_none());
            if lambda > 0.0 && (droppable || menu.objects().len() < FEW) {
                self.go_on(menu, terms, &mut table);
            }
        }
        let (value, upper) = self.certify(menu, terms, lambda);
        Picked { feasible, table, value, upper: if feasible { upper } else { 0.0 }, lambda }
    }

    fn fill_bins(&mut self, menu: &Menu, terms: &Terms) {
        self.bins.clear();
        self.bins.resize(BUCKETS, [0; STAGES]);
        for object in menu.objects() {
            for (at, step) in open_steps(menu, object, terms) {
                self.bins[bucket(terms.merit(object, at, step))][object.stage] += step.cost;
            }
        }
    }

    /// The bucket in which the budget ends, and in `table` what all above it take; `None` where everything fits.
    fn find_edge(&self, terms: &Terms, table: &mut [u64; STAGES]) -> Option<usize> {
        for (at, bin) in self.bins.iter().enumerate().rev() {
            let mut with = *table;
            with.iter_mut().zip(bin).for_each(|(sum, ticks)| *sum += ticks);
            if terms.cost(&with) > terms.budget {
                return Some(at);
            }
            *table = with;
        }
        None
    }

    /// Takes all steps above the edge, and lays those on it aside.
    fn take_above(&mut self, menu: &Menu, terms: &Terms, edge: Option<usize>) {
        self.edge.clear();
        for (i, object) in menu.objects().iter().enumerate() {
            for (at, step) in open_steps(menu, object, terms) {
                let merit = terms.merit(object, at, step);
                match edge {
                    Some(edge) if bucket(merit) < edge => break,
                    Some(edge) if bucket(merit) == edge => self.edge.push((merit, i as u32, at as u16)),
                    _ => self.taken[i] = at as u16 + 1,
                }
            }
        }
        // objects stand in the order of their ids
        self.edge.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    }

    /// Takes the steps on the edge until one does not fit; its gain per tick.
    fn take_edge(&mut self, menu: &Menu, terms: &Terms, table: &mut [u64; STAGES]) -> f64 {
        for &(_, i, at) in &self.edge {
            let object = &menu.objects()[i as usize];
            let step = &menu.steps_of(object)[usize::from(at)];
            let mut with = *table;
            with[object.stage] += step.cost;
            if terms.cost(&with) > terms.budget {
                return step.slope * (object.weight / terms.kappa[object.stage]);
            }
            *table = with;
            self.taken[i as usize] = at + 1;
        }
        0.0
    }

    /// After the first step that does not fit: every object's next step that does, best first.
    fn go_on(&mut self, menu: &Menu, terms: &Terms, table: &mut [u64; STAGES]) {
        self.edge.clear();
        for (i, object) in menu.objects().iter().enumerate() {
            let next = open_steps(menu, object, terms).nth(usize::from(self.taken[i]));
            self.edge.extend(next.map(|(at, step)| (terms.merit(object, at, step), i as u32, at as u16)));
        }
        self.edge.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for &(_, i, at) in &self.edge {
            let object = &menu.objects()[i as usize];
            for (at, step) in open_steps(menu, object, terms).skip(usize::from(at)) {
                let mut with = *table;
                with[object.stage] += step.cost;
                if terms.cost(&with) > terms.budget {
                    break;
                }
                *table = with;
                self.taken[i as usize] = at as u16 + 1;
            }
        }
    }

    /// The value taken, and the bound that the price λ gives for any choice: each object is best for itself (eq. 33).
    fn certify(&self, menu: &Menu, terms: &Terms, lambda: f64) -> (f64, f64) {
        let (mut value, mut upper) = (0.0, lambda * terms.budget);
        for (object, &taken) in menu.objects().iter().zip(&self.taken) {
            let kappa = terms.kappa[object.stage];
            let (mut gain, mut bound) =
                (object.base.1, object.base.1 * object.weight - lambda * kappa * object.base.0 as f64);
            for (at, step) in menu.steps_of(object).iter().enumerate() {
                let net = step.gain * object.weight - lambda * kappa * step.cost as f64;
                let (takes, pays) = (at < usize::from(taken), net > 0.0);
                if !takes && !pays {
                    break;
                }
                gain += if takes { step.gain } else { 0.0 };
                bound += if pays { net } else { 0.0 };
            }
            value += gain * object.weight;
            upper += bound;
        }
        (value, upper)
    }
}

/// The steps that an object may take, best first: all that are worth something and can ever fit, while it dwells only those it had.
fn open_steps<'a>(menu: &'a Menu, object: &Object, terms: &Terms) -> impl Iterator<Item = (usize, &'a Step)> {
    let most = match (object.weight > 0.0, object.dwell) {
        (false, _) => 0,
        (true, 0) => object.steps,
        (true, _) => object.taken,
    };
    let mut left = terms.reach[object.stage];
    let fits = move |(_, step): &(usize, &Step)| match left.checked_sub(step.cost) {
        Some(rest) => {
            left = rest;
            true
        }
        None => false,
    };
    menu.steps_of(object)[..usize::from(most)].iter().enumerate().take_while(fits)
}

/// Where a merit falls: by its exponent and the top bits of its mantissa. It is not NaN, and not below 0.
fn bucket(merit: f64) -> usize {
    const LOWEST: u64 = (1023 - OCTAVES / 2) << BITS;
    let top = merit.to_bits() >> (52 - BITS);
    top.saturating_sub(LOWEST).min(BUCKETS as u64 - 1) as usize
}
