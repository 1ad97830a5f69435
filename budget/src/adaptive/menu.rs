//! What there is to choose among: objects by id, each with its concave hull, made once.
//!
//! In: levels with cost and gain, weights that change every frame. Out: hull steps, in the order of ids.
//! Never here: a choice ([`super::pick`]). Theory: `docs/theory/budget.md`, eq. 32.

use alloc::vec::Vec;
use core::ops::Range;

/// One level of an object as it is offered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offer {
    /// What the table says it takes, ticks; NaN, infinite or negative: twice the dearest sound cost of the same object.
    pub cost: f64,
    /// What it gives at weight 1, 0 or more; what is NaN or negative counts as 0.
    pub gain: f64,
}

/// One step along an object's hull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Gain per tick at weight 1; infinite where it is free.
    pub slope: f64,
    /// Ticks that it adds.
    pub cost: u64,
    /// Gain that it adds at weight 1.
    pub gain: f64,
    /// The level after it.
    pub level: u32,
}

/// An object on the menu.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Object {
    pub id: u64,
    /// Which gauge its costs belong to.
    pub stage: usize,
    /// What all its gains are multiplied by; finite, ≥ 0.
    pub weight: f64,
    /// Cost, gain and level before the first step; no level where it may be left out.
    pub base: (u64, f64, Option<u32>),
    first: u32,
    pub steps: u16,
    /// Steps taken in the last choice.
    pub taken: u16,
    /// Frames for which it may not rise.
    pub dwell: u8,
}

/// Objects in the order of their ids, and the steps of their hulls.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Menu {
    objects: Vec<Object>,
    steps: Vec<Step>,
    /// Steps of objects that went or changed, still in `steps`.
    unused: usize,
    /// Counts what could change the choice: objects, hulls, weights.
    pub changes: u64,
    points: Vec<(u64, f64, u32)>,
}

impl Menu {
    pub(crate) fn objects(&self) -> &[Object] {
        &self.objects
    }

    pub(crate) fn objects_mut(&mut self) -> &mut [Object] {
        &mut self.objects
    }

    pub(crate) fn steps_of(&self, object: &Object) -> &[Step] {
        &self.steps[range(object)]
    }

    pub(crate) fn find(&self, id: u64) -> Option<&Object> {
        self.objects.binary_search_by_key(&id, |o| o.id).ok().map(|at| &self.objects[at])
    }

    /// Puts an object on the menu, or gives it other levels. What it had taken stays as near as the new hull allows.
    pub(crate) fn set(&mut self, id: u64, stage: usize, droppable: bool, levels: &[Offer]) {
        let (base, kept) = self.hull(droppable, levels);
        let first = self.steps.len() as u32;
        let mut from = (base.0, base.1);
        for at in 0..kept {
            let (cost, gain, level) = self.points[at];
            let (dc, dg) = (cost - from.0, gain - from.1);
            let slope = if dc == 0 { f64::INFINITY } else { dg / dc as f64 };
            self.steps.push(Step { slope, cost: dc, gain: dg, level });
            from = (cost, gain);
        }
        let steps = kept.min(usize::from(u16::MAX)) as u16;
        let new = Object { id, stage, weight: 1.0, base, first, steps, taken: 0, dwell: 0 };
        match self.objects.binary_search_by_key(&id, |o| o.id) {
            Ok(at) => {
                let old = self.objects[at];
                if self.steps[range(&old)] == self.steps[range(&new)] && old.base == base && old.stage == stage {
                    self.steps.truncate(first as usize);
                    return;
                }
                self.unused += usize::from(old.steps);
                let taken = old.taken.min(steps);
                self.objects[at] = Object { weight: old.weight, taken, dwell: old.dwell, ..new };
            }
            Err(at) => self.objects.insert(at, new),
        }
        self.changes += 1;
        self.compact();
    }

    /// Changes what an object's gains are multiplied by; `false` where there is no such object.
    pub(crate) fn weigh(&mut self, id: u64, weight: f64) -> bool {
        let Ok(at) = self.objects.binary_search_by_key(&id, |o| o.id) else { return false };
        let sound = if weight > 0.0 { weight.min(f64::MAX) } else { 0.0 };
        self.changes += u64::from(self.objects[at].weight.to_bits() != sound.to_bits());
        self.objects[at].weight = sound;
        true
    }

    /// Takes an object off the menu; `false` where there is no such object.
    pub(crate) fn remove(&mut self, id: u64) -> bool {
        let Ok(at) = self.objects.binary_search_by_key(&id, |o| o.id) else { return false };
        self.unused += usize::from(self.objects.remove(at).steps);
        self.changes += 1;
        self.compact();
        true
    }

    /// The base of an object's hull, and how many vertices above it now lie in `points`.
    fn hull(&mut self, droppable: bool, levels: &[Offer]) -> ((u64, f64, Option<u32>), usize) {
        let is_sound = |c: f64| c.is_finite() && c >= 0.0;
        let dearest = levels.iter().map(|l| l.cost).filter(|c| is_sound(*c)).fold(0.0, f64::max);
        self.points.clear();
        self.points.extend((0..).zip(levels).map(|(level, offer)| {
            let cost = if is_sound(offer.cost) { offer.cost } else { 2.0 * dearest };
            let gain = if offer.gain > 0.0 { offer.gain.min(1e30) } else { 0.0 };
            ((libm::ceil(cost) as u64).min(1 << 44), gain, level)
        }));
        self.points.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
        let base = match self.points.first() {
            Some(&(cost, gain, level)) if !droppable => (cost, gain, Some(level)),
            _ => (0, 0.0, None),
        };
        let mut kept = 0;
        for at in 0..self.points.len() {
            let to = self.points[at];
            let last = if kept > 0 { self.points[kept - 1] } else { (base.0, base.1, 0) };
            if to.1 <= last.1 {
                continue;
            }
            while kept > 0 {
                let before = if kept > 1 { self.points[kept - 2] } else { (base.0, base.1, 0) };
                if slope(before, self.points[kept - 1]) > slope(self.points[kept - 1], to) {
                    break;
                }
                kept -= 1;
            }
            self.points[kept] = to;
            kept += 1;
        }
        (base, kept)
    }

    /// Closes the gaps once they are as large as what is used: constant time a change, in the long run.
    fn compact(&mut self) {
        if self.unused <= self.steps.len() / 2 {
            return;
        }
        let mut steps = Vec::with_capacity(self.steps.len() - self.unused);
        for object in &mut self.objects {
            let range = range(object);
            object.first = steps.len() as u32;
            steps.extend_from_slice(&self.steps[range]);
        }
        (self.steps, self.unused) = (steps, 0);
    }
}

fn range(object: &Object) -> Range<usize> {
    object.first as usize..object.first as usize + usize::from(object.steps)
}

fn slope(from: (u64, f64, u32), to: (u64, f64, u32)) -> f64 {
    let ticks = to.0 - from.0;
    if ticks == 0 { f64::INFINITY } else { (to.1 - from.1) / ticks as f64 }
}
