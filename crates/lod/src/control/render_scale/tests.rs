//! The law of the scale on declared plants: a frame takes a + b s², and u more where it is enlarged.

use super::*;

/// A machine: seconds of a frame that pixels do not change, of all its pixels, and of enlarging.
#[derive(Clone, Copy)]
struct Plant {
    fixed_s: f64,
    pixels_s: f64,
    enlarge_s: f64,
}

impl Plant {
    fn frame_s(self, scale: f64) -> f64 {
        self.fixed_s + self.pixels_s * scale * scale + if scale < 1.0 { self.enlarge_s } else { 0.0 }
    }
}

const PERIOD_S: f64 = 1.0 / 30.0;

/// A loop of a controller, a machine, and prices which say that it is another one.
struct Loop {
    law: RenderScale,
    plant: Plant,
    priced: Plant,
    state: u64,
    /// Seconds and scale of every change.
    changes: Vec<(f64, f64)>,
    time_s: f64,
}

impl Loop {
    fn new(plant: Plant) -> Self {
        let law = RenderScale::new((0.35, 1.0));
        Self { law, plant, priced: plant, state: 7, changes: Vec::new(), time_s: 0.0 }
    }

    /// Uniform, −1 … 1.
    fn random(&mut self) -> f64 {
        self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Plays seconds with all else at its coarsest and noise of this standard deviation.
    fn play(&mut self, seconds: f64, noise: f64) -> f64 {
        for _ in 0..(seconds / PERIOD_S) as usize {
            let before = self.law.rung().scale;
            // a sum of twelve is nearly normal, of variance 4
            let tremble = (0..12).map(|_| self.random()).sum::<f64>() / 2.0;
            let took_s = self.plant.frame_s(before) * (1.0 + noise * tremble).max(0.1);
            let frame =
                ScaledFrame { coarsest_s: took_s, draw_s: took_s, spent: true, set_s: PERIOD_S, period_s: PERIOD_S };
            let priced = self.priced;
            self.law.observe(frame, |rung| priced.frame_s(rung.scale));
            self.time_s += PERIOD_S;
            if self.law.rung().scale != before {
                self.changes.push((self.time_s, self.law.rung().scale));
            }
        }
        self.law.rung().scale
    }
}

const SLOW: Plant = Plant { fixed_s: 0.012, pixels_s: 0.040, enlarge_s: 0.002 };

#[test]
fn it_settles_on_the_largest_scale_in_time() {
    for (fixed_ms, pixels_ms) in [(5.0, 30.0), (12.0, 40.0), (20.0, 40.0), (25.0, 60.0)] {
        let plant = Plant { fixed_s: 1e-3 * fixed_ms, pixels_s: 1e-3 * pixels_ms, enlarge_s: 0.002 };
        let scale = Loop::new(plant).play(5.0, 0.0);
        // a + u + b s² = 0.97 T, down to a step
        let closed = ((FIT * PERIOD_S - plant.fixed_s - plant.enlarge_s) / plant.pixels_s).sqrt().max(0.35);
        let expected = SCALES.iter().rev().find(|s| **s <= closed + 1e-9).copied().unwrap_or(0.35);
        assert_eq!(scale, expected, "{fixed_ms} + {pixels_ms} s² ms, closed form {closed}");
    }
}

#[test]
fn wrong_prices_still_end_in_time_and_near_the_largest_scale() {
    for wrong in [0.4, 2.5] {
        let mut run = Loop::new(SLOW);
        run.priced = Plant { pixels_s: wrong * SLOW.pixels_s, ..SLOW };
        let scale = run.play(30.0, 0.0);
        let took = SLOW.frame_s(scale) / PERIOD_S;
        // 0.693 is the largest in time
        assert!(took <= 1.0 && scale >= 0.6, "prices × {wrong}: {scale}, {took} of the time");
        let late = run.changes.len();
        run.play(60.0, 0.0);
        assert_eq!(run.changes.len(), late, "it rests: {:?}", run.changes);
    }
}

#[test]
fn steady_load_under_noise_of_a_fifth_reverses_nothing() {
    let mut run = Loop::new(SLOW);
    run.play(120.0, 0.2);
    let rises = run.changes.windows(2).filter(|pair| pair[1].1 > pair[0].1).count();
    assert_eq!(rises, 0, "{:?}", run.changes);
    let took = SLOW.frame_s(run.law.rung().scale) / PERIOD_S;
    // it is not taken for late by less than two errors of the mean of a second, 0.08
    assert!((0.75..1.08).contains(&took), "{took} of the time at {}", run.law.rung().scale);
}

#[test]
fn pixels_come_back_after_the_load_has_gone_and_not_at_once() {
    let mut run = Loop::new(SLOW);
    run.play(4.0, 0.05);
    let (low, then) = (run.law.rung().scale, run.time_s);
    run.plant = Plant { fixed_s: 0.002, pixels_s: 0.015, enlarge_s: 0.002 };
    assert_eq!(run.play(15.0, 0.05), 1.0, "{:?}", run.changes);
    let after: Vec<_> = run.changes.iter().filter(|(at, _)| *at > then).collect();
    // the load's end is seen after three frames
    assert!(low < 0.75 && after.windows(2).all(|pair| pair[1].0 - pair[0].0 >= STEP_S - 1e-9), "{after:?}");
    assert!(after[after.len() - 1].0 - then < 0.6, "{after:?}");
}

#[test]
fn nothing_is_taken_that_saves_nothing_and_nothing_while_levels_can_be() {
    // enlarging costs more than all pixels
    let dear = Plant { fixed_s: 0.040, pixels_s: 0.003, enlarge_s: 0.008 };
    assert_eq!(Loop::new(dear).play(5.0, 0.0), 1.0);
    let mut law = RenderScale::new((0.35, 1.0));
    let late = ScaledFrame { coarsest_s: 0.1, draw_s: 0.1, spent: false, set_s: PERIOD_S, period_s: PERIOD_S };
    (0..100).for_each(|_| law.observe(late, |rung| rung.scale * rung.scale));
    assert!(!law.is_reduced());
    (0..100).for_each(|_| law.observe(ScaledFrame { spent: true, ..late }, |rung| rung.scale * rung.scale));
    assert!(law.is_reduced());
}

#[test]
fn a_load_that_comes_and_goes_is_one() {
    let mut law = RenderScale::new((0.35, 1.0));
    let frame = |ms: f64| ScaledFrame {
        coarsest_s: 1e-3 * ms,
        draw_s: 1e-3 * ms,
        spent: true,
        set_s: PERIOD_S,
        period_s: PERIOD_S,
    };
    (0..90).for_each(|_| law.observe(frame(20.0), |rung| rung.scale * rung.scale));
    (0..40).for_each(|_| {
        [60.0, 60.0, 20.0].into_iter().for_each(|ms| law.observe(frame(ms), |rung| rung.scale * rung.scale))
    });
    assert!(law.is_reduced(), "two frames of three are late");
}

#[test]
fn a_range_bounds_it_and_no_number_moves_it() {
    assert_eq!(RenderScale::new((0.62, 0.9)).bounds(), (0.65, 0.9));
    for (range, scale) in [((0.37, 0.37), 0.35), ((0.97, 1.0), 1.0), ((0.1, 0.2), 0.35)] {
        assert_eq!(rungs(range), [PictureRung { scale, shadows: true }], "{range:?}");
    }
    let mut law = RenderScale::new((0.6, 0.9));
    let late = ScaledFrame { coarsest_s: 0.5, draw_s: 0.4, spent: true, set_s: PERIOD_S, period_s: PERIOD_S };
    (0..50).for_each(|_| law.observe(ScaledFrame { coarsest_s: f64::NAN, ..late }, |rung| rung.scale));
    (0..50).for_each(|_| law.observe(late, |_| f64::NAN));
    assert_eq!(law.rung().scale, 0.9);
    (0..50).for_each(|_| law.observe(late, |rung| rung.scale * rung.scale));
    assert_eq!(law.rung().scale, 0.6);
    let mut fixed = RenderScale::default();
    (0..50).for_each(|_| fixed.observe(late, |rung| rung.scale * rung.scale));
    assert_eq!((fixed.rung().scale, fixed.most().scale), (1.0, 1.0));
}

#[test]
fn shadows_go_when_half_the_width_is_left_and_come_back_first() {
    let all = |range| rungs(range).iter().map(|rung| (rung.scale, rung.shadows)).collect::<Vec<_>>();
    let from_half = &all((0.35, 1.0))[..6];
    assert_eq!(from_half, [(0.35, false), (0.4, false), (0.45, false), (0.5, false), (0.5, true), (0.55, true)]);
    assert_eq!(all((0.9, 1.0)), [(0.9, true), (0.95, true), (1.0, true)]);
    assert_eq!(all((0.35, 0.4)), [(0.35, false), (0.4, false), (0.4, true)]);
    let mut unlit = RenderScale::new((0.35, 1.0));
    unlit.set_throws_shadows(false);
    unlit.release();
    assert_eq!(unlit.rungs, SCALES.map(|scale| PictureRung { scale, shadows: false }));
    // of a frame of 32 ms at half the width 4 ms are shadows: 28 fit
    let mut law = RenderScale::new((0.35, 1.0));
    let frame_s = |rung: PictureRung| 0.026 + 0.008 * rung.scale * rung.scale + if rung.shadows { 0.004 } else { 0.0 };
    let mut play = |set_s: f64| {
        for _ in 0..300 {
            let took_s = frame_s(law.rung());
            let frame = ScaledFrame { coarsest_s: took_s, draw_s: took_s, spent: true, set_s, period_s: PERIOD_S };
            law.observe(frame, frame_s);
        }
        law.rung()
    };
    assert_eq!(play(0.029), PictureRung { scale: 0.5, shadows: false });
    assert_eq!(play(0.050), PictureRung { scale: 1.0, shadows: true });
}

#[test]
fn a_load_that_comes_is_answered_after_three_frames_and_a_stall_is_not() {
    let calm = Plant { fixed_s: 0.003, pixels_s: 0.020, enlarge_s: 0.001 };
    let mut run = Loop::new(calm);
    run.play(3.0, 0.02);
    run.plant = Plant { fixed_s: 0.1, ..calm };
    run.play(2.5 * PERIOD_S, 0.02);
    run.plant = calm;
    assert_eq!(run.play(3.0, 0.02), 1.0, "a stall of two frames: {:?}", run.changes);
    let then = run.time_s;
    run.plant = Plant { fixed_s: 0.006, pixels_s: 0.050, enlarge_s: 0.001 };
    run.play(1.0, 0.02);
    assert!(run.changes[0].0 - then < 5.0 * PERIOD_S && run.law.rung().scale < 0.75, "{:?} after {then}", run.changes);
}
