//! The options to choose among: objects by id, each with its concave hull, computed once.
//!
//! In: levels with cost and gain, weights that change every frame. Out: hull steps, in the order of ids.
//! Never here: a choice ([`super::pick`]). Theory: `docs/theory/budget.md`, eq. 32.

use alloc::vec::Vec;
use core::ops::Range;

use super::{ROUNDING, STAGES};

/// One level of an object as offered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offer {
    /// Ticks by the table, 2³² at most; NaN, infinite or negative: twice the most expensive valid cost of the same object.
    pub cost: f64,
    /// Gain at weight 1, ≥ 0; NaN and negative values count as 0.
    pub gain: f64,
}

/// One step along an object's hull: only the fields that the choice reads for every step, so that they stay in the cache.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Gain per tick at weight 1; > 0, finite.
    pub slope: f64,
    /// Ticks that the step adds; 32 bits because they become doubles in one instruction.
    pub cost: u32,
}

/// Cost and gain of an object after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vertex {
    /// Ticks by the table.
    pub cost: u64,
    /// Gain at weight 1.
    pub gain: f64,
    /// The level after the step; `None` where the object is left out.
    pub level: Option<u32>,
}

/// An object among the options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Object {
    pub id: u64,
    /// Which estimator its costs belong to, below [`super::STAGES`].
    pub stage: u8,
    /// Factor of all the object's gains; finite, ≥ 0.
    pub weight: f64,
    /// The object's state before the first step.
    pub base: Vertex,
    /// Cost of all steps together, ticks by the table.
    pub span: u64,
    first: u32,
    pub steps: u16,
    /// Steps taken in the last choice.
    pub taken: u16,
    /// The object is reluctant to reverse its last change while this is above 1; counts down every frame.
    pub dwell: u8,
    /// Whether the last change was to a finer level.
    pub rose: bool,
}

impl Object {
    /// Sets the number of steps taken; after a change the object is reluctant to reverse it for `dwell` frames.
    pub(crate) fn settle(&mut self, taken: u16, dwell: u8) {
        if taken == self.taken {
            self.dwell = self.dwell.saturating_sub(1);
        } else {
            (self.dwell, self.rose) = (dwell, taken > self.taken);
        }
        self.taken = taken;
    }

    /// Whether the object fell so recently that it may not rise.
    pub(crate) fn just_fell(&self) -> bool {
        self.dwell > 1 && !self.rose
    }

    /// Whether the object rose so recently that others fall before it.
    pub(crate) fn just_rose(&self) -> bool {
        self.dwell > 1 && self.rose
    }
}

/// Objects in the order of their ids, and the steps of their hulls.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Options {
    objects: Vec<Object>,
    steps: Vec<Step>,
    /// Where each step leads.
    vertices: Vec<Vertex>,
    /// Steps of removed or changed objects, still in `steps`.
    unused: usize,
    /// Ticks by the table of every object at its least, for each stage.
    pub least: [u64; STAGES],
    /// How many objects may be left out.
    pub droppable: usize,
    /// Counts changes that could affect the choice: objects, hulls, weights.
    pub changes: u64,
    points: Vec<Vertex>,
}

impl Options {
    pub(crate) fn objects(&self) -> &[Object] {
        &self.objects
    }

    pub(crate) fn objects_mut(&mut self) -> &mut [Object] {
        &mut self.objects
    }

    /// Whether every object is at its least, and one of them because it has just fallen.
    pub(crate) fn are_all_fallen(&self) -> bool {
        // in the frame after its dwell it is on offer for the first time
        let may_rise = |object: &Object| object.dwell > 0 && !object.rose && object.steps > 0 && object.weight > 0.0;
        self.objects.iter().all(|object| object.taken == 0) && self.objects.iter().any(may_rise)
    }

    /// Number of places that all steps take, unused ones included.
    pub(crate) fn room(&self) -> usize {
        self.steps.len()
    }

    pub(crate) fn steps_of(&self, object: &Object) -> &[Step] {
        &self.steps[range(object)]
    }

    /// Cost, gain and level of an object after `taken` steps.
    pub(crate) fn vertex(&self, object: &Object, taken: u16) -> Vertex {
        match taken.checked_sub(1) {
            Some(at) => self.vertices[object.first as usize + usize::from(at)],
            None => object.base,
        }
    }

    /// Gain of an object after `taken` steps, at weight 1.
    pub(crate) fn gain(&self, object: &Object, taken: u16) -> f64 {
        // reads both and then selects: a branch here would be unpredictable
        let last = (object.first as usize + usize::from(taken)).wrapping_sub(1);
        let after = self.vertices.get(last).map_or(0.0, |v| v.gain);
        if taken > 0 { after } else { object.base.gain }
    }

    pub(crate) fn find(&self, id: u64) -> Option<&Object> {
        self.objects.binary_search_by_key(&id, |o| o.id).ok().map(|at| &self.objects[at])
    }

    /// Adds an object, or replaces its levels. Taken are the steps of the new hull that come nearest to the gain of those taken before, so that
    /// what has just changed is still known by what it changed to.
    pub(crate) fn set(&mut self, id: u64, stage: usize, droppable: bool, levels: &[Offer]) {
        let (base, kept) = self.hull(droppable, levels);
        let (first, steps) = (self.steps.len() as u32, kept.min(usize::from(u16::MAX)) as u16);
        let mut from = base;
        for &to in &self.points[..usize::from(steps)] {
            self.steps.push(Step { slope: slope(from, to), cost: (to.cost - from.cost) as u32 });
            self.vertices.push(to);
            from = to;
        }
        let new = Object {
            id,
            weight: 1.0,
            base,
            span: from.cost - base.cost,
            first,
            steps,
            taken: 0,
            stage: stage as u8,
            dwell: 0,
            rose: false,
        };
        match self.objects.binary_search_by_key(&id, |o| o.id) {
            Ok(at) => {
                let old = self.objects[at];
                if self.vertices[range(&old)] == self.vertices[range(&new)]
                    && old.base == base
                    && old.stage == new.stage
                {
                    self.steps.truncate(first as usize);
                    self.vertices.truncate(first as usize);
                    return;
                }
                self.forget(&old);
                let gain = self.gain(&old, old.taken);
                let off = |taken: &u16| (self.gain(&new, *taken) - gain).abs();
                let taken = (0..=steps).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0);
                let Object { weight, dwell, rose, .. } = old;
                self.objects[at] = Object { weight, taken, dwell, rose, ..new };
            }
            Err(at) => self.objects.insert(at, new),
        }
        self.least[stage] += base.cost;
        self.droppable += usize::from(base.level.is_none());
        self.changes += 1;
        self.compact();
    }

    /// Removes an object from the sums.
    fn forget(&mut self, old: &Object) {
        self.unused += usize::from(old.steps);
        self.least[usize::from(old.stage)] -= old.base.cost;
        self.droppable -= usize::from(old.base.level.is_none());
    }

    /// Sets the factor of an object's gains; `false` where there is no such object.
    pub(crate) fn weigh(&mut self, id: u64, weight: f64) -> bool {
        let Ok(at) = self.objects.binary_search_by_key(&id, |o| o.id) else { return false };
        let sound = if weight > 0.0 { weight.min(f64::MAX) } else { 0.0 };
        let held = &mut self.objects[at].weight;
        // rounding errors of a camera at rest are no change
        if (sound - *held).abs() > ROUNDING * *held {
            *held = sound;
            self.changes += 1;
        }
        true
    }

    /// Removes an object; `false` where there is no such object.
    pub(crate) fn remove(&mut self, id: u64) -> bool {
        let Ok(at) = self.objects.binary_search_by_key(&id, |o| o.id) else { return false };
        let old = self.objects.remove(at);
        self.forget(&old);
        self.changes += 1;
        self.compact();
        true
    }

    /// The base of an object's hull, and how many vertices above it are now in `points`.
    fn hull(&mut self, droppable: bool, levels: &[Offer]) -> (Vertex, usize) {
        let is_sound = |c: f64| c.is_finite() && c >= 0.0;
        let dearest = levels.iter().map(|l| l.cost).filter(|c| is_sound(*c)).fold(0.0, f64::max);
        self.points.clear();
        self.points.extend((0..).zip(levels).map(|(level, offer)| {
            let cost = if is_sound(offer.cost) { offer.cost } else { 2.0 * dearest };
            let gain = if offer.gain > 0.0 { offer.gain.min(1e30) } else { 0.0 };
            Vertex { cost: (libm::ceil(cost) as u64).min(u64::from(u32::MAX)), gain, level: Some(level) }
        }));
        self.points
            .sort_unstable_by(|a, b| a.cost.cmp(&b.cost).then(b.gain.total_cmp(&a.gain)).then(a.level.cmp(&b.level)));
        let nothing = Vertex { cost: 0, gain: 0.0, level: None };
        // a free level with a gain is the base, so no step costs 0
        let drawn = |v: &Vertex| !droppable || (v.cost == 0 && v.gain > 0.0);
        let base = self.points.first().copied().filter(drawn).unwrap_or(nothing);
        let mut kept: usize = 0;
        for at in 0..self.points.len() {
            let to = self.points[at];
            if to.gain <= kept.checked_sub(1).map_or(base, |last| self.points[last]).gain {
                continue;
            }
            while kept > 0 {
                let before = if kept > 1 { self.points[kept - 2] } else { base };
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

    /// Removes unused steps once they outnumber the used ones: amortised constant time per change.
    fn compact(&mut self) {
        if self.unused <= self.steps.len() / 2 {
            return;
        }
        let used = self.steps.len() - self.unused;
        let (mut steps, mut vertices) = (Vec::with_capacity(used), Vec::with_capacity(used));
        for object in &mut self.objects {
            let range = range(object);
            object.first = steps.len() as u32;
            steps.extend_from_slice(&self.steps[range.clone()]);
            vertices.extend_from_slice(&self.vertices[range]);
        }
        (self.steps, self.vertices, self.unused) = (steps, vertices, 0);
    }
}

fn range(object: &Object) -> Range<usize> {
    object.first as usize..object.first as usize + usize::from(object.steps)
}

fn slope(from: Vertex, to: Vertex) -> f64 {
    (to.gain - from.gain) / (to.cost - from.cost) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_whose_hull_loses_a_vertex_keeps_the_level_that_it_had() {
        let offers = |gains: &[(f64, f64)]| gains.iter().map(|&(cost, gain)| Offer { cost, gain }).collect::<Vec<_>>();
        let mut options = Options::default();
        options.set(1, 0, false, &offers(&[(1.0, 0.5), (2.0, 0.7), (3.0, 0.8), (4.0, 0.85), (6.0, 0.9)]));
        options.objects_mut()[0].settle(3, 4);
        // the second and the fourth level are on the hull no longer: three steps would be the finest
        options.set(1, 0, false, &offers(&[(1.0, 0.5), (2.0, 0.55), (3.0, 0.8), (4.0, 0.81), (6.0, 0.9)]));
        let object = options.objects()[0];
        assert_eq!((object.steps, object.taken, options.vertex(&object, object.taken).gain), (2, 1, 0.8));
        assert_eq!((object.dwell, object.rose), (4, true));
    }
}
