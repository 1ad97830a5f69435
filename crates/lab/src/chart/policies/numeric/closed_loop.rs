//! A policy run through a scene: it chooses, the machine draws, and the measured time comes back a frame or two later.
//!
//! In: a show (scene, path, machine, target) and a policy. Out: the results of every frame. Never here: statistics.

use super::camera::Path;
use super::chooser::{Choice, Pick, Policy, Time, benefit, problem};
use super::machine::{Fault, Machine};
use super::scene::{Scene, VisibleObject};
use metachron_lod::select::{Level, linear};
use std::collections::BTreeMap;

/// Everything that a run depends on in addition to its policy and its seed.
#[derive(Debug, Clone)]
pub(crate) struct Show {
    pub(crate) scene: Scene,
    pub(crate) path: Path,
    pub(crate) fault: Fault,
    /// T, microseconds.
    pub(crate) target: f64,
    pub(crate) frames: usize,
    /// The path starts again after this many frames.
    pub(crate) lap: usize,
    /// Frames until the time of one is known.
    pub(crate) delay: usize,
    /// Logic of a visible thing, microseconds, and the share of the shorter of logic and drawing that adds to the longer.
    pub(crate) logic: f64,
    pub(crate) overlap: f64,
}

/// The results of a frame; NaN where there was nothing to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    /// Its time, and the time of full detail, as parts of T.
    pub(crate) time: f64,
    pub(crate) full: f64,
    /// Its predicted time, as a part of T.
    pub(crate) predicted: f64,
    /// Upper bound of the loss against the best choice, by the choice's own certificate.
    pub(crate) gap: f64,
    /// Benefit over the bound at the true costs.
    pub(crate) quality: f64,
    /// Things in view, and the things among them that were left out.
    pub(crate) objects: usize,
    pub(crate) holes: usize,
    /// Changes of level, and changes that were reversed within three frames.
    pub(crate) changes: usize,
    pub(crate) reversals: usize,
    /// Polygons that were drawn.
    pub(crate) polygons: f64,
    /// Time for choosing levels, as a part of T.
    pub(crate) choosing: f64,
}

/// The bound at the true costs is computed once in so many frames.
const JUDGED: usize = 10;

impl Show {
    /// The things seen in a frame, and the frame's time.
    pub(crate) fn seen(&self, frame: usize) -> (Vec<VisibleObject>, Time) {
        let seen = self.scene.seen(&self.path.camera(frame % self.lap));
        let logic = self.logic * seen.len() as f64;
        (seen, Time { target: self.target, logic, overlap: self.overlap })
    }

    /// Plays all frames.
    pub(crate) fn play(&self, policy: Policy, seed: u64) -> Vec<Frame> {
        self.watch(policy, seed, &mut |_, _, _| {})
    }

    /// Plays all frames and calls `watch` with the number of each, the things in view and the choice.
    pub(crate) fn watch(
        &self,
        policy: Policy,
        seed: u64,
        watch: &mut dyn FnMut(usize, &[VisibleObject], &Choice),
    ) -> Vec<Frame> {
        let (mut chooser, mut machine) = (policy.chooser(), Machine::new(seed, self.fault.clone()));
        let (mut frames, mut memory): (Vec<Frame>, _) = (Vec::with_capacity(self.frames), Memory::default());
        let mut times: Vec<Time> = Vec::with_capacity(self.frames);
        for frame in 0..self.frames {
            if let Some(known) = frame.checked_sub(self.delay) {
                chooser.learn(known as u64, frames[known].time * self.target, times[known]);
            }
            let (seen, time) = self.seen(frame);
            let choice = chooser.choose(frame as u64, &self.scene, &seen, time);
            watch(frame, &seen, &choice);
            let slower = machine.slower(frame);
            let mut done = self.draw(&seen, time, &choice, slower);
            if frame.is_multiple_of(JUDGED) {
                done.quality = self.quality(&seen, time.drawing() / slower, &choice);
            }
            (done.changes, done.reversals) = memory.count(&seen, &choice.picks);
            frames.push(done);
            times.push(time);
        }
        frames
    }

    fn draw(&self, seen: &[VisibleObject], time: Time, choice: &Choice, slower: f64) -> Frame {
        let form = |s: &VisibleObject, level: u32| self.scene.objects[s.object].forms[level as usize];
        let sum = |of: &dyn Fn(&VisibleObject, u32, f64) -> f64| {
            let drawn = seen.iter().zip(&choice.picks).filter_map(|(s, p)| Some(of(s, p.level?, p.part)));
            drawn.sum::<f64>()
        };
        let drawing = sum(&|s, level, part| self.scene.cost(&form(s, level), part, s.pixels));
        Frame {
            time: time.frame(slower * drawing) / self.target,
            full: time.frame(slower * Scene::full(seen)) / self.target,
            predicted: choice.predicted / self.target,
            gap: choice.gap,
            quality: f64::NAN,
            objects: seen.len(),
            holes: choice.picks.iter().filter(|p| p.level.is_none()).count(),
            changes: 0,
            reversals: 0,
            polygons: sum(&|s, level, part| part * form(s, level).polygons),
            choosing: f64::NAN,
        }
    }

    /// Benefit over the bound within a budget, microseconds by the table; NaN where even the cheapest levels of everything exceed it.
    fn quality(&self, seen: &[VisibleObject], budget: f64, choice: &Choice) -> f64 {
        let bound = linear(&problem(&self.scene, seen, budget));
        bound.map_or(f64::NAN, |bound| benefit(&self.scene, seen, &choice.picks) / bound.value)
    }
}

/// The levels of the last frames, to count changes and reversals.
#[derive(Default)]
struct Memory {
    past: [BTreeMap<usize, Level>; 4],
}

impl Memory {
    /// Levels that changed since the previous frame, and the number of these that return to their level of up to three frames
    /// before that.
    fn count(&mut self, seen: &[VisibleObject], picks: &[Pick]) -> (usize, usize) {
        let (mut changes, mut reversals) = (0, 0);
        for (s, pick) in seen.iter().zip(picks) {
            let was = |back: usize| self.past[back].get(&s.object);
            let changed = was(0).is_some_and(|before| *before != pick.level);
            let back = (1..4).any(|b| was(b) == Some(&pick.level) && (0..b).all(|between| was(between).is_some()));
            changes += usize::from(changed);
            reversals += usize::from(changed && back);
        }
        self.past.rotate_right(1);
        self.past[0] = seen.iter().zip(picks).map(|(s, p)| (s.object, p.level)).collect();
        (changes, reversals)
    }
}
