//! A declared machine and a walk through an auditorium, to run policies in a closed loop: S1 and S2 of the theory (section 10).
//!
//! In: a policy. Out: the times of its frames as parts of T. Never here: a real clock; seeds are fixed.

use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};
use metachron_lod::select::{Entry, Level, Mode, Problem, funkhouser, linear, threshold};

/// T, ticks of a microsecond.
pub const TARGET: f64 = 100_000.0;
/// Parts of an object's polygons in its levels.
const PARTS: [f64; 5] = [0.02, 0.06, 0.18, 0.45, 1.0];
/// Microseconds of a polygon, of an object.
const POLYGON: f64 = 13.5;
const SETUP: f64 = 20.0;
/// Frames of one walk.
pub const WALK: usize = 250;

/// Uniform and normal numbers from a seed: xorshift, and the sum of twelve uniforms.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// An object in view.
#[derive(Clone, Copy)]
pub struct VisibleObject {
    pub id: u64,
    pub pixels: f64,
    pub polygons: [u32; 5],
}

impl VisibleObject {
    pub fn cost(&self, level: usize) -> f64 {
        SETUP + POLYGON * f64::from(self.polygons[level])
    }

    /// Accuracy of flat shading (FS93, §5).
    pub fn accuracy(&self, level: usize) -> f64 {
        1.0 - 0.5 / f64::from(self.polygons[level].max(1))
    }
}

/// 384 seats and 16 pieces of a stage, 87,565 polygons.
pub struct Auditorium {
    polygons: Vec<u32>,
    /// Which come into view first.
    rank: Vec<usize>,
}

impl Auditorium {
    pub fn new() -> Self {
        let polygons = (0..400).map(|i| if i < 384 { 186 } else { 1008 + u32::from(i == 384) * 13 }).collect();
        // a fixed mixing of the rows; the stage comes first where only it is seen
        let rank = (0..400).map(|i| if i < 384 { (i * 157) % 384 } else { i }).collect();
        Self { polygons, rank }
    }

    /// Seats in view, and whether the stage is: rows across (A), far and small (B), the stage, a turn in six frames (C).
    fn view(frame: usize) -> (f64, bool, f64) {
        let between = |a: f64, b: f64, from: usize, to: usize| {
            a + (b - a) * (frame.saturating_sub(from) as f64 / (to - from) as f64).min(1.0)
        };
        match frame {
            0..60 => (between(300.0, 375.0, 0, 40), false, 40.0),
            60..125 => (between(375.0, 60.0, 60, 125), false, between(40.0, 8.0, 60, 125)),
            125..150 => (60.0, false, 8.0),
            150..178 => (between(60.0, 5.0, 150, 160), true, 20.0),
            178..184 => (between(5.0, 235.0, 178, 184), false, 40.0),
            _ => (between(235.0, 255.0, 184, 250), false, 40.0),
        }
    }

    pub fn seen(&self, frame: usize) -> Vec<VisibleObject> {
        let (count, stage, size) = Self::view(frame);
        let visible = |i: usize| if i < 384 { (self.rank[i] as f64) < count } else { stage && i < 384 + 5 };
        let of = |i: usize| {
            // the nearest is some five times as large as the farthest, and the walk goes on
            let depth = 1.0 + 4.0 * (0.5 + 0.5 * ((self.rank[i] as f64) * 2.399 + 0.01 * frame as f64).sin());
            let pixels = size * size * 25.0 / (depth * depth);
            let polygons = PARTS.map(|p| ((p * f64::from(self.polygons[i])) as u32).max(2));
            VisibleObject { id: i as u64, pixels, polygons }
        };
        (0..400).filter(|&i| visible(i)).map(of).collect()
    }
}

/// How the machine differs from the table.
pub struct Machine {
    noise: Random,
    wander: f64,
    /// The table is this much too low.
    pub low: f64,
    /// Frames with 40 % more load.
    pub load: std::ops::Range<usize>,
    /// How often a frame takes half as long again.
    pub spikes: f64,
}

impl Machine {
    pub fn s1(seed: u64) -> Self {
        Self { noise: Random::new(seed), wander: 0.0, low: 1.0, load: 0..0, spikes: 0.0 }
    }

    pub fn s2(seed: u64) -> Self {
        Self { low: 1.25, load: 300..700, spikes: 0.01, ..Self::s1(seed) }
    }

    /// The time now of a frame that takes `table` by the table: an error of 5 % that wanders, 1 % that does not.
    pub fn takes(&mut self, frame: usize, table: f64) -> f64 {
        const MEMORY: f64 = 0.9;
        self.wander = MEMORY * self.wander + (1.0_f64 - MEMORY * MEMORY).sqrt() * 0.05 * self.noise.normal();
        let load = if self.load.contains(&frame) { 1.4 } else { 1.0 };
        let spike = if self.noise.uniform() < self.spikes { 1.5 } else { 1.0 };
        table * self.low * load * spike * (1.0 + self.wander) * (1.0 + 0.01 * self.noise.normal())
    }
}

/// The input of a policy for a frame, and its answer.
pub trait Policy {
    fn choose(&mut self, frame: usize, seen: &[VisibleObject]) -> Vec<Level>;
    fn learn(&mut self, _frame: usize, _took: f64) {}
}

pub fn problem(seen: &[VisibleObject], budget: f64) -> Problem {
    let mut problem = Problem::new(Mode::ExactlyOne, budget as i64);
    for s in seen {
        let entry = |l: usize| Entry::measured(s.cost(l), 1000.0 * s.pixels * s.accuracy(l), 0.0).0;
        problem.push(s.id, &[0, 1, 2, 3, 4].map(entry));
    }
    problem
}

pub struct Full;

impl Policy for Full {
    fn choose(&mut self, _: usize, seen: &[VisibleObject]) -> Vec<Level> {
        vec![Some(4); seen.len()]
    }
}

pub struct Static(pub f64);

impl Policy for Static {
    fn choose(&mut self, _: usize, seen: &[VisibleObject]) -> Vec<Level> {
        seen.iter().map(|s| threshold::level(s.pixels, &s.polygons, self.0)).collect()
    }
}

#[derive(Default)]
pub struct Feedback(pub threshold::Feedback);

impl Policy for Feedback {
    fn choose(&mut self, frame: usize, seen: &[VisibleObject]) -> Vec<Level> {
        Static(self.0.threshold_px()).choose(frame, seen)
    }

    fn learn(&mut self, _: usize, took: f64) {
        self.0.observe(took, TARGET);
    }
}

pub struct Greedy;

impl Policy for Greedy {
    fn choose(&mut self, _: usize, seen: &[VisibleObject]) -> Vec<Level> {
        funkhouser::greedy(&problem(seen, 0.98 * TARGET), funkhouser::Scan::Skip).levels
    }
}

/// AdaptivePolicy.
pub struct AdaptivePolicy {
    pub adaptive: Adaptive,
    present: Vec<u64>,
    pub gaps: Vec<f64>,
}

impl AdaptivePolicy {
    pub fn new(settings: Settings) -> Self {
        Self { adaptive: Adaptive::new(settings), present: Vec::new(), gaps: Vec::new() }
    }
}

impl Policy for AdaptivePolicy {
    fn choose(&mut self, frame: usize, seen: &[VisibleObject]) -> Vec<Level> {
        let now: Vec<_> = seen.iter().map(|s| s.id).collect();
        for gone in self.present.iter().filter(|id| now.binary_search(id).is_err()) {
            self.adaptive.remove(*gone);
        }
        for s in seen {
            if self.present.binary_search(&s.id).is_err() {
                self.adaptive.set(
                    s.id,
                    0,
                    false,
                    &[0, 1, 2, 3, 4].map(|l| Offer { cost: s.cost(l), gain: s.accuracy(l) }),
                );
            }
            self.adaptive.weigh(s.id, s.pixels);
        }
        self.present = now;
        let plan = self.adaptive.choose(frame as u64, Time { target: TARGET, fixed: 0.0, reserved: 0.0 });
        assert!(!plan.feasible || plan.predicted <= plan.budget || plan.held, "over the budget: {plan:?}");
        self.gaps.push(plan.gap());
        seen.iter().map(|s| self.adaptive.level(s.id)).collect()
    }

    fn learn(&mut self, frame: usize, took: f64) {
        self.adaptive.observe(frame as u64, 0, took);
        self.adaptive.finished(frame as u64, took);
    }
}

/// One run.
pub struct Run {
    /// Times as parts of T.
    pub times: Vec<f64>,
    /// Frames whose full detail takes more than 1.15 T.
    pub binding: Vec<bool>,
    /// Σ benefit over the bound at the true cost, every fifth frame.
    pub quality: Vec<f64>,
    /// Changes and A→B→A within three frames, and how many object-frames there were.
    pub changes: usize,
    pub reversals: usize,
    pub object_frames: usize,
}

/// Runs a policy for `frames` frames; the time of a frame is known `delay` frames after it was chosen.
pub fn run(policy: &mut dyn Policy, machine: &mut Machine, frames: usize, delay: usize) -> Run {
    let hall = Auditorium::new();
    let mut run = Run { times: vec![], binding: vec![], quality: vec![], changes: 0, reversals: 0, object_frames: 0 };
    let mut past: [Vec<Option<u32>>; 4] = Default::default();
    for frame in 0..frames {
        if frame >= delay {
            policy.learn(frame - delay, run.times[frame - delay] * TARGET);
        }
        let seen = hall.seen(frame % WALK);
        let levels = policy.choose(frame, &seen);
        let sum = |level: &dyn Fn(usize) -> usize| seen.iter().enumerate().map(|(i, s)| s.cost(level(i))).sum::<f64>();
        let table = sum(&|i| levels[i].unwrap() as usize);
        let took = machine.takes(frame, table);
        if frame % 5 == 0 {
            let worth: f64 =
                seen.iter().zip(&levels).map(|(s, l)| 1000.0 * s.pixels * s.accuracy(l.unwrap() as usize)).sum();
            let truly = linear(&problem(&seen, TARGET * table / took));
            run.quality.push(truly.map_or(f64::NAN, |b| worth / b.value));
        }
        run.binding.push(sum(&|_| 4) * took / table > 1.15 * TARGET);
        run.times.push(took / TARGET);
        let mut now = vec![None; 400];
        seen.iter().zip(&levels).for_each(|(s, l)| now[s.id as usize] = *l);
        count(&mut run, &past, &now);
        past.rotate_right(1);
        past[0] = now;
    }
    run
}

fn count(run: &mut Run, past: &[Vec<Level>; 4], now: &[Level]) {
    for (i, level) in now.iter().enumerate().filter(|(_, l)| l.is_some()) {
        let was = |back: usize| past[back].get(i).copied().flatten();
        run.object_frames += 1;
        let changed = was(0).is_some() && was(0) != *level;
        run.changes += usize::from(changed);
        // it was this level two or three frames ago, and another since
        let back = (1..4).any(|b| was(b) == *level && (0..b).all(|between| was(between).is_some()));
        run.reversals += usize::from(changed && back);
    }
}

/// Mean, greatest and standard deviation.
pub fn spread(x: &[f64]) -> (f64, f64, f64) {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let variance = x.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    (mean, x.iter().copied().fold(f64::MIN, f64::max), variance.sqrt())
}

impl Run {
    /// Times of the frames in which there is something to choose.
    pub fn binding_times(&self) -> Vec<f64> {
        self.times.iter().zip(&self.binding).filter(|(_, b)| **b).map(|(t, _)| *t).collect()
    }

    /// Part of the frames past 1.05 T.
    pub fn misses(&self) -> f64 {
        self.times.iter().filter(|t| **t > 1.05).count() as f64 / self.times.len() as f64
    }

    /// Frames after `step` until the median of nine stays within 6 % of the mean of the frames `later` for twenty frames.
    pub fn settles(&self, step: usize, later: std::ops::Range<usize>) -> Option<usize> {
        let goal = spread(&self.times[later]).0;
        let median = |at: usize| {
            let mut nine = self.times[at - 4..at + 5].to_vec();
            nine.sort_by(f64::total_cmp);
            nine[4]
        };
        (0..200).find(|k| (0..20).all(|j| (median(step + k + j) / goal - 1.0).abs() <= 0.06))
    }
}
