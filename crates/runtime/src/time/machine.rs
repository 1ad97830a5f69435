//! The declared machine: prices of work where nothing is measured.
//!
//! In: work in each model's unit, the objects of a frame. Out: seconds, with noise that is the same on every run.
//! Never here: a clock. Lockstep charges these prices instead of measuring, so that a run is the same on every computer.

use std::borrow::Cow;
use std::time::Duration;

/// The machine assumed by lockstep.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Cores shared by agents and the frame loop; at least 1 is assumed.
    pub cores: u32,
    /// Price of a step of each model, and of a factor of the contacts of a cluster ([`FACTOR`]). A model that is not
    /// listed costs [`OTHER_STEP_US`].
    pub steps: Vec<StepPrice>,
    /// Price of a frame.
    pub draw: DrawPrice,
    /// Whether a graphics card draws: then drawing keeps no core busy.
    pub graphics_card: bool,
    /// Nanoseconds per object for the visibility test, and per visible object for choosing its level, ≥ 0.
    pub choice_ns: (f64, f64),
    /// Relative standard deviation of every cost, `0..=1`.
    pub noise_sd: f64,
    /// Relative standard deviation of a slowly varying factor on frames, nine tenths of it kept from one frame to the next, `0..=1`.
    pub wander_sd: f64,
    /// Share of frames that take 1.5 times as long, `0..=1`.
    pub spikes: f64,
    /// Load on frames: from this wall time on, seconds, a frame takes this multiple of its declared time; by rising time, 1 before the
    /// first.
    pub load: Vec<(f64, f64)>,
    /// The same for steps.
    pub step_load: Vec<(f64, f64)>,
    /// Seed of the noise: equal seeds give equal runs.
    pub seed: u64,
}

/// Price of a step of one model: base + unit · work.
#[derive(Debug, Clone, PartialEq)]
pub struct StepPrice {
    /// The model's name, as its agents report it; or [`FACTOR`].
    pub model: Cow<'static, str>,
    /// Microseconds per step, ≥ 0.
    pub base_us: f64,
    /// Microseconds per unit of the work its steps report, ≥ 0.
    pub unit_us: f64,
}

/// Price of a frame: setup + pixel · pixels drawn + enlarge · pixels enlarged to + the price of its objects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawPrice {
    /// Milliseconds per frame, ≥ 0.
    pub setup_ms: f64,
    /// Nanoseconds per pixel of the picture as drawn, whatever covers it, ≥ 0.
    pub pixel_ns: f64,
    /// Nanoseconds per pixel that a picture of fewer pixels is enlarged to, ≥ 0.
    pub enlarge_ns: f64,
    /// Part of the faster of an object's triangles and pixels that the slower does not hide, `0..=1`; policies are not told.
    pub serial: f64,
    /// Price of objects by their shading: flat, Gouraud, light at every pixel, textured.
    pub objects: [ObjectPrice; 4],
    /// Price of objects drawn as strokes: points, lines.
    pub strokes: [ObjectPrice; 2],
}

/// Price of an object: setup + the greater of triangle · triangles + vertex · vertices and pixel · pixels that it covers, and of the less the
/// part [`DrawPrice::serial`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ObjectPrice {
    /// Microseconds per object, ≥ 0.
    pub setup_us: f64,
    /// Microseconds per triangle, ≥ 0.
    pub triangle_us: f64,
    /// Microseconds per vertex, ≥ 0.
    pub vertex_us: f64,
    /// Nanoseconds per pixel, ≥ 0.
    pub pixel_ns: f64,
}

/// The name by which [`Machine::steps`] has the price of a factor of the coupled matrix of a cluster. Its work is the cluster's contacts.
pub const FACTOR: &str = "factor";

/// Price of a step of an unlisted model, microseconds.
pub const OTHER_STEP_US: f64 = 10.0;

/// The names of the predefined machines.
pub const PRESETS: [&str; 3] = ["two-cores-software", "workstation", "llvmpipe"];

impl Machine {
    /// The machine called `name`, one of [`PRESETS`].
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        match name {
            "two-cores-software" => Some(Self::two_cores_software()),
            "workstation" => Some(Self::workstation()),
            "llvmpipe" => Some(Self::llvmpipe()),
            _ => None,
        }
    }

    /// Two cores that also draw (Mesa): 1.4 ms + 6 ns per pixel of the picture + 0.22 µs per triangle.
    #[must_use]
    pub fn two_cores_software() -> Self {
        Self {
            cores: 2,
            steps: vec![
                price("tube", 2.0, 0.25),
                price("rigid", 0.0, 25.0),
                price("sheet", 5.0, 0.6),
                price("solid", 5.0, 0.6),
                price("rope", 5.0, 0.6),
                price("tool", 0.0, 3.0),
                price("synthetic", 0.0, 1.0),
                price(FACTOR, 0.0, 0.0),
            ],
            draw: DrawPrice {
                setup_ms: 1.4,
                pixel_ns: 6.0,
                enlarge_ns: 2.0,
                serial: 0.0,
                objects: SOFTWARE,
                strokes: SOFTWARE_STROKES,
            },
            graphics_card: false,
            choice_ns: (0.0, 0.0),
            noise_sd: 0.0,
            wander_sd: 0.0,
            spikes: 0.0,
            load: Vec::new(),
            step_load: Vec::new(),
            seed: 1,
        }
    }

    /// Eight cores and a graphics card that draws twenty times as fast.
    #[must_use]
    pub fn workstation() -> Self {
        let base = Self::two_cores_software();
        let DrawPrice { setup_ms, pixel_ns, enlarge_ns, serial, .. } = base.draw;
        Self {
            cores: 8,
            draw: DrawPrice {
                setup_ms: setup_ms / 20.0,
                pixel_ns: pixel_ns / 20.0,
                enlarge_ns: enlarge_ns / 20.0,
                serial,
                objects: SOFTWARE.map(|price| price.faster(20.0)),
                strokes: SOFTWARE_STROKES.map(|price| price.faster(20.0)),
            },
            graphics_card: true,
            ..base
        }
    }

    /// The two cores of [`Machine::two_cores_software`], drawing as `metachron calibrate` measured it (LLVM 15.0.6, 256 bits, two idle cores of a
    /// virtual AMD EPYC, 2026-11-27 at e7682e86): pixels, textures and the picture itself have prices of their own.
    #[must_use]
    pub fn llvmpipe() -> Self {
        let objects = [
            price_of_objects(0.20, 1.7),
            price_of_objects(0.22, 4.0),
            price_of_objects(0.22, 4.3),
            price_of_objects(0.35, 9.9),
        ];
        let strokes = [price_of_objects(0.20, 0.7), price_of_objects(0.22, 1.2)];
        Self {
            draw: DrawPrice { setup_ms: 0.24, pixel_ns: 4.8, enlarge_ns: 4.4, serial: 0.0, objects, strokes },
            ..Self::two_cores_software()
        }
    }

    /// Seconds of a step of `model` that reported `work`; `stream` is the agent's and `count` the step's number, for the noise.
    #[must_use]
    pub fn step_s(&self, model: &str, work: f64, stream: u64, count: u64) -> f64 {
        let us =
            self.steps.iter().find(|p| p.model == model).map_or(OTHER_STEP_US, |p| p.base_us + p.unit_us * sound(work));
        us * 1e-6 * self.noise(stream, count)
    }

    /// Time of the frame `count` that begins `at` and nominally takes `seconds`: with load, white noise, slowly varying noise, spikes.
    #[must_use]
    pub fn frame_time(&self, seconds: f64, count: u64, at: Duration) -> Duration {
        let spike = if uniform(self.seed, SPIKE_STREAM, count) < sound(self.spikes) { SPIKE } else { 1.0 };
        duration(seconds * factor(&self.load, at) * self.noise(FRAME_STREAM, count) * self.wander(count) * spike)
    }

    /// Load factor of a step that begins `at`.
    #[must_use]
    pub fn slower(&self, at: Duration) -> f64 {
        factor(&self.step_load, at)
    }

    /// A log-normal factor of mean 1 whose logarithm keeps nine tenths of its value from one frame to the next: the decaying sum of the
    /// last frames' random terms, so that it depends on the seed and the frame only.
    fn wander(&self, count: u64) -> f64 {
        let sd = sound(self.wander_sd).min(1.0);
        if sd == 0.0 {
            return 1.0;
        }
        let (mut left, mut sum) = (1.0, 0.0);
        for back in 0..WANDER_FRAMES {
            sum += left * normal(self.seed, WANDER_STREAM, count.wrapping_sub(back));
            left *= WANDER_KEPT;
        }
        let variance = libm::log1p(sd * sd);
        let news = libm::sqrt(variance * (1.0 - WANDER_KEPT * WANDER_KEPT));
        libm::exp(news * sum - 0.5 * variance)
    }

    /// A log-normal factor of mean 1 and relative deviation `noise_sd`, the same for equal arguments.
    #[must_use]
    pub fn noise(&self, stream: u64, count: u64) -> f64 {
        let sd = sound(self.noise_sd).min(1.0);
        if sd == 0.0 {
            return 1.0;
        }
        let variance = libm::log1p(sd * sd);
        libm::exp(libm::sqrt(variance) * normal(self.seed, stream, count) - 0.5 * variance)
    }
}

impl Default for Machine {
    fn default() -> Self {
        Self::two_cores_software()
    }
}

/// The noise stream of the frame loop; agents use their numbers, which are below.
const FRAME_STREAM: u64 = u64::MAX;
/// The stream of the slowly varying noise, and of spikes.
const WANDER_STREAM: u64 = u64::MAX - 1;
const SPIKE_STREAM: u64 = u64::MAX - 2;
/// Factor of a spike on a frame.
const SPIKE: f64 = 1.5;
/// Share of the slowly varying noise kept from one frame to the next.
const WANDER_KEPT: f64 = 0.9;
/// After so many frames a thousandth of a random term is left.
const WANDER_FRAMES: u64 = 64;

const fn price(model: &'static str, base_us: f64, unit_us: f64) -> StepPrice {
    StepPrice { model: Cow::Borrowed(model), base_us, unit_us }
}

/// Objects, whatever their shading: scenes give prices of their own where the choice of a shading matters.
const SOFTWARE: [ObjectPrice; 4] = [price_of_objects(0.22, 0.0); 4];

/// Objects drawn as points and as lines there.
const SOFTWARE_STROKES: [ObjectPrice; 2] = [price_of_objects(0.22, 0.0); 2];

const fn price_of_objects(triangle_us: f64, pixel_ns: f64) -> ObjectPrice {
    ObjectPrice { setup_us: 5.0, triangle_us, vertex_us: 0.0, pixel_ns }
}

impl ObjectPrice {
    /// The price where drawing is so many times as fast.
    fn faster(self, times: f64) -> Self {
        Self {
            setup_us: self.setup_us / times,
            triangle_us: self.triangle_us / times,
            vertex_us: self.vertex_us / times,
            pixel_ns: self.pixel_ns / times,
        }
    }
}

/// The factor in force at a time.
fn factor(load: &[(f64, f64)], at: Duration) -> f64 {
    load.iter().take_while(|(at_s, _)| *at_s <= at.as_secs_f64()).last().map_or(1.0, |(_, factor)| *factor)
}

/// `x`, or zero where it is negative or not finite: prices are not negative.
fn sound(x: f64) -> f64 {
    if x.is_finite() { x.max(0.0) } else { 0.0 }
}

/// The duration nearest to `seconds`, to the nanosecond; zero for an invalid length, an hour at most.
pub(crate) fn duration(seconds: f64) -> Duration {
    const LONGEST_S: f64 = 3600.0;
    Duration::from_nanos((sound(seconds).min(LONGEST_S) * 1e9).round() as u64)
}

/// A number of mean 0 and deviation 1 that depends only on its arguments: twelve uniform numbers less six, close to normal out to three
/// deviations and never beyond six.
fn normal(seed: u64, stream: u64, count: u64) -> f64 {
    let mut state = start(seed, stream, count);
    let mut sum = -6.0;
    for _ in 0..12 {
        state = state.wrapping_add(GOLDEN);
        sum += unit_interval(state);
    }
    sum
}

/// A number between 0 and 1 that depends only on its arguments.
fn uniform(seed: u64, stream: u64, count: u64) -> f64 {
    unit_interval(start(seed, stream, count).wrapping_add(GOLDEN))
}

fn start(seed: u64, stream: u64, count: u64) -> u64 {
    mix(mix(seed ^ mix(stream)) ^ count)
}

/// A number uniform in 0 … 1 from a state of SplitMix64.
pub(super) fn unit_interval(state: u64) -> f64 {
    const TWO_POW_53: f64 = 9_007_199_254_740_992.0;
    (mix(state) >> 11) as f64 / TWO_POW_53
}

/// 2⁶⁴ over the golden ratio: the increment of SplitMix64.
pub(super) const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The output function of SplitMix64.
pub(super) const fn mix(state: u64) -> u64 {
    let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tube_costs_its_segments() {
        let machine = Machine::two_cores_software();
        // 2 µs + 100 segments of 0.25 µs; two roundings
        assert!((machine.step_s("tube", 100.0, 0, 0) - 27e-6).abs() < 1e-18);
        assert!((machine.step_s("no such model", 100.0, 0, 0) - 10e-6).abs() < 1e-18);
    }

    #[test]
    fn noise_has_the_declared_mean_and_deviation() {
        let machine = Machine { noise_sd: 0.1, ..Machine::default() };
        let n = 20_000;
        let draws: Vec<f64> = (0..n).map(|k| machine.noise(3, k)).collect();
        let mean = draws.iter().sum::<f64>() / n as f64;
        let sd = (draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
        // standard errors: 0.1 / sqrt(n) = 7e-4 of the mean, 0.1 / sqrt(2 n) = 5e-4 of the deviation; four of them
        assert!((mean - 1.0).abs() < 2.8e-3, "mean {mean}");
        assert!((sd - 0.1).abs() < 2e-3, "deviation {sd}");
    }

    #[test]
    fn frames_wander_and_spike_as_declared() {
        let machine = Machine { wander_sd: 0.05, spikes: 0.01, ..Machine::default() };
        let n = 20_000_u64;
        let x: Vec<f64> = (0..n).map(|frame| machine.frame_time(1.0, frame, Duration::ZERO).as_secs_f64()).collect();
        let spikes = x.iter().filter(|x| **x > 1.3).count() as f64 / n as f64;
        let residuals: Vec<f64> = x.iter().map(|x| if *x > 1.3 { x / SPIKE } else { *x } - 1.0).collect();
        let moment = |lag: usize| residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum::<f64>() / n as f64;
        // 19 frames of memory leave about a thousand independent ones: errors of 2 % of the deviation, four of them
        assert!((moment(0).sqrt() - 0.05).abs() < 0.004, "deviation {}", moment(0).sqrt());
        assert!((moment(1) / moment(0) - 0.9).abs() < 0.03, "kept {}", moment(1) / moment(0));
        assert!((spikes - 0.01).abs() < 0.003, "spikes {spikes}");
    }

    #[test]
    fn a_load_counts_from_its_time_until_the_next() {
        let machine = Machine { load: vec![(1.0, 2.5), (3.0, 0.5)], ..Machine::default() };
        let took = |at_ms: u64| machine.frame_time(0.01, 0, Duration::from_millis(at_ms)).as_secs_f64();
        let expected = [(0, 0.01), (999, 0.01), (1000, 0.025), (2999, 0.025), (3000, 0.005), (9000, 0.005)];
        assert!(expected.iter().all(|&(at_ms, s)| (took(at_ms) - s).abs() < 1e-9));
        let machine = Machine { step_load: machine.load, ..Machine::default() };
        let slower = [0, 1000, 2999, 3000].map(|at_ms| machine.slower(Duration::from_millis(at_ms)));
        assert_eq!(slower, [1.0, 2.5, 2.5, 0.5]);
    }

    #[test]
    fn equal_seeds_give_equal_noise_and_streams_differ() {
        let machine = Machine { noise_sd: 0.2, ..Machine::default() };
        assert_eq!(machine.noise(1, 7).to_bits(), machine.clone().noise(1, 7).to_bits());
        assert_ne!(machine.noise(1, 7), machine.noise(2, 7));
        assert_ne!(machine.noise(1, 7), Machine { seed: 2, ..machine.clone() }.noise(1, 7));
    }

    #[test]
    fn invalid_prices_cost_nothing() {
        let machine = Machine { spikes: f64::NAN, ..Machine::default() };
        assert_eq!(machine.frame_time(f64::NAN, 0, Duration::ZERO), Duration::ZERO);
        assert_eq!(machine.step_s("tube", f64::INFINITY, 0, 0), 2e-6);
    }

    #[test]
    fn every_preset_has_its_machine() {
        assert!(PRESETS.iter().all(|name| Machine::preset(name).is_some()));
        assert_eq!(Machine::preset("abacus"), None);
        let cheapest_first = Machine::llvmpipe().draw.objects;
        let is_dearer =
            |pair: &[ObjectPrice]| pair[1].triangle_us >= pair[0].triangle_us && pair[1].pixel_ns > pair[0].pixel_ns;
        assert!(cheapest_first.windows(2).all(is_dearer), "better shading is never cheaper");
    }
}
