//! Costs and benefits against machines and values that are known.

use metachron_lod::adaptive::joint::{
    Between, Choice, Drawing, SharedPrice, Worker, even_split, pairs, price, taken, temporal_error_px,
};
use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};
use metachron_lod::cost::benefit::{Picture, Shading, Sliders, View, accuracy, benefit};
use metachron_lod::cost::curve;
use metachron_lod::cost::curve::Curve;
use metachron_lod::cost::fit::{Sample, fit};
use metachron_lod::cost::overlap::Overlap;
use metachron_lod::cost::pipeline::Pipeline;
use metachron_lod::cost::prior::Prior;
use metachron_lod::cost::stages::{Stages, Work};
use metachron_lod::cost::value::Value;
use proptest::prelude::*;

/// Uniform numbers 0 … 1 from a seed.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Log-uniform between two numbers.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }
}

const MACHINE: Stages = Stages { setup: 20.0, polygon: 0.9, vertex: 0.5, pixel: 0.02, serial: 0.0 };

/// Draws of all sizes on a machine that trembles by 3 % and takes three times as long once in twenty draws.
fn benchmark(seed: u64, count: usize, wild: f64, ratio: Option<f64>) -> Vec<Sample> {
    let mut random = Random(seed);
    (0..count)
        .map(|_| {
            let polygons = random.between(2.0, 20_000.0).round();
            let vertices = (polygons * ratio.unwrap_or_else(|| 0.5 + 2.5 * random.uniform())).round();
            let work = Work { polygons, vertices, pixels: random.between(1.0, 2e6).round() };
            let tremble = 1.0 + 0.03 * (random.uniform() + random.uniform() + random.uniform() - 1.5) * 2.0;
            let stall = if random.uniform() < wild { 3.0 } else { 1.0 };
            Sample { work, time: MACHINE.time(work) * tremble * stall }
        })
        .collect()
}

#[test]
fn fit_finds_the_machine_among_outliers() {
    for seed in 1..9 {
        let got = fit(&benchmark(seed, 300, 0.05, None), 0.0).unwrap().stages;
        for (name, got, want, part) in [
            ("polygon", got.polygon, MACHINE.polygon, 0.05),
            ("vertex", got.vertex, MACHINE.vertex, 0.05),
            ("pixel", got.pixel, MACHINE.pixel, 0.02),
            ("setup", got.setup, MACHINE.setup, 0.10),
        ] {
            // 3 % of tremble over some hundred draws of each stage
            assert!((got / want - 1.0).abs() < part, "{name}: {got}, seed {seed}");
        }
    }
}

#[test]
fn stages_one_after_the_other_are_told_from_stages_beside_each_other() {
    let errors = |seed, serial: f64| {
        let machine = Stages { serial, ..MACHINE };
        let draws = benchmark(seed, 200, 0.05, None).into_iter();
        let slower = draws.map(|s| Sample { time: s.time * machine.time(s.work) / MACHINE.time(s.work), ..s });
        let slower: Vec<_> = slower.collect();
        [0.0, 1.0].map(|serial| fit(&slower, serial).unwrap().error50)
    };
    for seed in 1..5 {
        let ([beside, wrong], [wrong_too, after]) = (errors(seed, 0.0), errors(seed, 1.0));
        // the tremble of 3 % is in each
        assert!(beside < 0.7 * wrong && after < 0.7 * wrong_too, "{beside} {wrong}, {wrong_too} {after}");
    }
}

#[test]
fn held_out_draws_are_predicted_within_a_tenth() {
    for seed in 1..9 {
        let model = fit(&benchmark(seed, 200, 0.05, None), 0.0).unwrap().stages;
        let mut errors: Vec<_> =
            benchmark(seed + 100, 500, 0.0, None).iter().map(|s| (model.time(s.work) / s.time - 1.0).abs()).collect();
        errors.sort_by(f64::total_cmp);
        assert!(errors[475] <= 0.10, "95 % within {}", errors[475]); // (FS93, §4)
    }
}

#[test]
fn vertices_proportional_to_polygons_are_counted_as_polygons() {
    let got = fit(&benchmark(3, 300, 0.0, Some(2.0)), 0.0).unwrap();
    let both = got.stages.polygon + 2.0 * got.stages.vertex;
    assert!((both / (0.9 + 2.0 * 0.5) - 1.0).abs() < 0.02 && got.error95 < 0.1, "{got:?}");
}

#[test]
fn fit_of_too_few_or_invalid_numbers_is_none() {
    let good = benchmark(1, 7, 0.0, None);
    assert_eq!(fit(&good, 0.0), None);
    let mut all = benchmark(1, 100, 0.0, None);
    for (i, bad) in [f64::NAN, f64::INFINITY, -1.0, 0.0].into_iter().enumerate() {
        all.push(Sample { time: bad, ..all[i] });
        let work = Work { pixels: if bad == 0.0 { f64::NAN } else { bad }, ..all[i].work };
        all.push(Sample { work, ..all[i] });
    }
    assert_eq!(fit(&all, 0.0).unwrap().samples, 100);
}

#[test]
fn curve_gives_what_was_measured_and_lines_between() {
    // a curve that bends: half of a straight line's value in the middle
    let bent = |x: f64| 1.0 + x * x / 100.0;
    let points: Vec<_> = (0..=10).rev().map(|i| (10.0 * f64::from(i), bent(10.0 * f64::from(i)))).collect();
    let curve = Curve::through(&points).unwrap();
    for x in 0..=100 {
        // a chord of a parabola over ten lies at most 5²/100 above it
        assert!((0.0..=0.25).contains(&(curve.at(f64::from(x)) - bent(f64::from(x)))), "{x}");
    }
    assert_eq!((curve.at(-5.0), curve.at(f64::NAN)), (1.0, 1.0));
    assert!((curve.at(110.0) - 120.0).abs() < 1e-9, "the last slope is 19 in ten: {}", curve.at(110.0));
    assert_eq!(curve::instance(&curve, 0, 50.0), 0.0);
    assert!((curve::instance(&curve, 4, 200.0) - 4.0 * bent(50.0)).abs() < 1e-9);
}

#[test]
fn curve_takes_the_median_and_never_falls() {
    let curve =
        Curve::through(&[(1.0, 5.0), (1.0, 900.0), (1.0, 4.0), (2.0, 3.0), (f64::NAN, 1.0), (3.0, -1.0)]).unwrap();
    assert_eq!(curve.points(), [(1.0, 5.0), (2.0, 5.0)]);
    assert_eq!(Curve::through(&[(f64::NAN, 1.0)]), None);
    assert_eq!(Curve::through(&[(3.0, 7.0)]).unwrap().at(100.0), 7.0);
}

fn picture(polygons: f64, shading: Shading) -> Picture {
    Picture { level: 0, polygons, vertices: polygons, shading }
}

const VIEW: View = View { pixels: 1e6, importance: 1.0, off_centre: 0.0, motion_px: 0.0, last: None, levels: 5 };

#[test]
fn accuracy_is_that_of_the_paper() {
    assert_eq!(accuracy(1e6, &picture(4.0, Shading::Flat)), 0.875);
    assert_eq!(accuracy(1e6, &picture(100.0, Shading::Flat)), 0.995);
    assert_eq!(accuracy(1e6, &picture(10.0, Shading::Gouraud)), 0.995);
    assert_eq!(accuracy(50.0, &picture(1.0, Shading::PerPixel)), 0.99);
    for pixels in [0.0, 1.0, f64::NAN, -3.0] {
        let got = accuracy(pixels, &picture(1000.0, Shading::PerPixel));
        assert_eq!(got, 0.5, "{pixels} px: one sample at least");
    }
}

#[test]
fn benefit_falls_with_every_factor_by_its_slider() {
    let (all, none) = (
        Sliders { size: 1.0, accuracy: 1.0, importance: 1.0, focus: 1.0, motion: 1.0, hysteresis: 1.0 },
        Sliders { size: 1.0, accuracy: 0.0, importance: 0.0, focus: 0.0, motion: 0.0, hysteresis: 0.0 },
    );
    let level = picture(4.0, Shading::Flat);
    let poor = View { importance: 0.5, off_centre: 0.4, motion_px: 50.0, last: Some(2), ..VIEW };
    assert_eq!(benefit(&poor, &level, &none), 1e6);
    // 500 px a polygon's edge, a tenth of it in a frame; two of four levels away
    let want = 1e6 * 0.875 * 0.5 * 0.6 * 0.9 * 0.5;
    assert!((benefit(&poor, &level, &all) - want).abs() < 1e-6);
    assert!((benefit(&VIEW, &level, &all) - 875_000.0).abs() < 1e-6);
    assert_eq!(benefit(&View { pixels: 0.0, ..VIEW }, &level, &all), 0.0);
}

#[test]
fn size_slider_counts_from_none_to_every_pixel() {
    let worth = |size: f64, pixels: f64| {
        let sliders = Sliders { size, accuracy: 0.0, ..Sliders::default() };
        benefit(&View { pixels, ..VIEW }, &picture(4.0, Shading::Flat), &sliders)
    };
    assert_eq!([worth(1.0, 100.0), worth(0.5, 100.0), worth(0.0, 100.0)], [100.0, 10.0, 1.0]);
    // an object smaller than a pixel is worth no more than there is of it, whatever the slider says
    assert_eq!([worth(1.0, 0.25), worth(0.0, 0.25), worth(0.0, 0.0)], [0.25, 0.25, 0.0]);
}

proptest! {
    #[test]
    fn benefit_is_between_nothing_and_the_pixels(
        n in prop::array::uniform6(prop_oneof![any::<f64>(), 0.0..2.0_f64, Just(f64::NAN)]), level in any::<u32>(), last in prop::option::of(any::<u32>()),
    ) {
        let view = View { pixels: n[0], importance: n[1], off_centre: n[2], motion_px: n[3], last, levels: level };
        let picture = Picture { level, polygons: n[4], vertices: n[5], shading: Shading::Gouraud };
        let sliders = Sliders { size: n[1], accuracy: n[5], importance: n[4], focus: n[3], motion: n[2], hysteresis: n[1] };
        let got = benefit(&view, &picture, &sliders);
        let most = if n[0] > 0.0 { n[0].min(f64::MAX) } else { 0.0 };
        prop_assert!((0.0..=most).contains(&got), "{}", got);
    }

    #[test]
    fn value_of_an_instance_is_a_number(a in any::<f64>(), z in any::<f64>(), d in any::<f64>(), i in any::<f64>()) {
        for value in [Value::Gentle, Value::Plain, Value::Steep, Value::Focus, Value::FocusSteep] {
            let got = value.of(a, z, d, i);
            prop_assert!(got.is_finite() && got >= 0.0);
        }
    }
}

#[test]
fn values_fall_with_depth_in_their_four_strengths() {
    let fall = |value: Value| value.of(4.0, 1.0, 1.0, 1.0) / value.of(4.0, 16.0, 16.0, 1.0);
    let all = [Value::Gentle, Value::Plain, Value::Steep, Value::Focus, Value::FocusSteep];
    assert_eq!(all.map(fall), [4.0, 16.0, 256.0, 16.0, 256.0]);
    assert_eq!(Value::Plain.of(4.0, -1.0, 1.0, 1.0), 0.0, "behind the eye");
}

#[test]
fn printed_overlap_gives_953_of_1000_where_it_says_two_thirds() {
    let drawing = Overlap::Printed(1.0).drawing(0.953 * 2.0, 1.0);
    assert!((drawing - 1.0).abs() < 2e-3, "{drawing}");
    let claimed = Overlap::Printed(0.255).drawing(2.0 * 2.0 / 3.0, 1.0);
    assert!((claimed - 1.0).abs() < 2e-3, "{claimed}");
    for (frame, logic) in [(0.0, 1.0), (1.0, 1.0), (1.0, 2.0), (f64::NAN, 0.0), (1.0, f64::NAN)] {
        assert_eq!(Overlap::Printed(1.0).drawing(frame, logic), 0.0);
        assert_eq!(Overlap::Fitted(0.5).drawing(frame, logic), 0.0);
    }
}

#[test]
fn fitted_overlap_inverts_its_own_prediction() {
    let mut random = Random(5);
    for serial in [0.0, 0.3, 0.8, 1.0] {
        let frames: Vec<_> = (0..50)
            .map(|_| (random.between(0.1, 10.0), random.between(0.1, 10.0)))
            .map(|(l, r)| (l, r, Overlap::frame(serial, l, r)))
            .collect();
        let Overlap::Fitted(found) = Overlap::fit(&frames) else { panic!("the fit is fitted") };
        assert!((found - serial).abs() < 1e-9);
        for (logic, drawing, frame) in frames {
            let got = Overlap::Fitted(serial).drawing(frame, logic);
            // with z = 0 any drawing shorter than the logic takes the same frame
            let want = if serial == 0.0 && drawing < logic { got } else { drawing };
            assert!((got - want).abs() < 1e-9, "{got} for {drawing}");
        }
    }
    assert_eq!(Overlap::fit(&[]), Overlap::Fitted(1.0));
}

#[test]
fn lag_is_shared_without_remainder() {
    let pipeline = Pipeline { lag: 100.0, share: 0.05, overlapped: false };
    let split = pipeline.split(20.0);
    assert_eq!((split.choose, split.draw, split.extrapolate), (4.0, 76.0, 100.0));
    let beside = Pipeline { overlapped: true, ..pipeline }.split(20.0);
    assert_eq!((beside.choose, beside.draw), (4.0, 80.0));
    for cull in [200.0, f64::NAN, f64::INFINITY] {
        let split = pipeline.split(cull);
        assert_eq!((split.choose, split.draw), (0.0, 0.0));
    }
}

#[test]
fn an_invalid_cost_is_twice_the_typical_cost_and_is_counted() {
    let mut prior = Prior::new(10.0);
    assert_eq!((prior.sound(f64::NAN), prior.sound(-1.0), prior.sound(f64::INFINITY)), (20.0, 20.0, 20.0));
    (0..200).for_each(|_| assert_eq!(prior.sound(50.0), 50.0));
    assert!((prior.typical() - 50.0).abs() < 0.01 && prior.made_up() == 3);
    assert!((prior.sound(f64::NAN) - 100.0).abs() < 0.02);
}

#[test]
fn error_between_steps_is_the_mean_over_a_step() {
    let (speed, acceleration, rate) = (300.0, 900.0, 30.0);
    // the mean of |x(t) − shown(t)| over a step, by summing it up
    let mean = |error: fn(f64, f64, f64, f64) -> f64| {
        (0..1000)
            .map(|i| error((f64::from(i) + 0.5) / 1000.0 / rate, speed, acceleration, 1.0 / rate).abs())
            .sum::<f64>()
            / 1000.0
    };
    let hold = mean(|t, v, _, _| v * t);
    assert!((hold / temporal_error_px(Between::Hold, speed, acceleration, rate) - 1.0).abs() < 1e-3);
    let carried = mean(|t, _, a, _| 0.5 * a * t * t);
    assert!((carried / temporal_error_px(Between::Extrapolate, speed, acceleration, rate) - 1.0).abs() < 1e-3);
    // of the line between two states it is the greatest error, a step's middle
    let middle = acceleration / 2.0 * (0.5 / rate) * (0.5 / rate);
    assert!((middle / temporal_error_px(Between::Interpolate, speed, acceleration, rate) - 1.0).abs() < 1e-12);
    assert_eq!(temporal_error_px(Between::Hold, 1.0, 1.0, 0.0), f64::INFINITY);
}

#[test]
fn pairs_gain_the_product_of_their_accuracies() {
    let rates = [Choice { cost: 1.0, error: 0.5 }, Choice { cost: 2.0, error: 0.0 }];
    let levels = [Choice { cost: 10.0, error: 0.4 }, Choice { cost: 30.0, error: f64::NAN }];
    let (offers, which) = pairs(&rates, &levels);
    assert_eq!(which, [(0, 0), (0, 1), (1, 0), (1, 1)]);
    assert!((offers[0].gain - 0.3).abs() < 1e-12 && offers[0].cost == 11.0);
    assert!(offers[1].gain == 0.0 && (offers[2].gain - 0.6).abs() < 1e-12);
}

/// A controller for the choice alone.
fn bare() -> Adaptive {
    Adaptive::new(Settings { margin: 0.0, late: 1.0, hysteresis: 0.0, dwell: 0, trim: false })
}

/// Forty agents, each with five rates (stage 0) and five levels (stage 1): the joint budget, and each budget alone.
fn joint(seed: u64) -> (Adaptive, Adaptive, Adaptive, f64, f64) {
    let mut random = Random(seed);
    let (mut both, mut simulate, mut draw) = (bare(), bare(), bare());
    let (mut least, mut most) = (0.0, 0.0);
    // whole scenes lean to one side, in the weight of a step and in its cost beside a picture
    let (lean, heavy) = (random.between(0.1, 10.0), random.between(0.2, 5.0));
    for id in 0..40 {
        let mut ladder = |scale: f64, weight: f64| {
            let offers: Vec<_> = (0..5)
                .map(|l| f64::from(1_u32 << l))
                .map(|x| Offer { cost: (scale * x).ceil(), gain: weight * (1.0 - 0.7 / x) })
                .collect();
            (least, most) = (least + offers[0].cost, most + offers[4].cost);
            offers
        };
        let rates = ladder(heavy * random.between(20.0, 200.0), lean * random.between(0.1, 10.0));
        let levels = ladder(random.between(20.0, 200.0), random.between(0.1, 10.0));
        both.set(2 * id, 0, false, &rates);
        both.set(2 * id + 1, 1, false, &levels);
        simulate.set(id, 0, false, &rates);
        draw.set(id, 0, false, &levels);
    }
    (both, simulate, draw, least, most)
}

#[test]
fn one_budget_for_simulation_and_drawing_is_better_than_two_halves() {
    let (mut joint_sum, mut halves_sum, mut even_sum) = (0.0, 0.0, 0.0);
    const INSTANCES: u64 = 200;
    for seed in 0..INSTANCES {
        let (mut both, mut simulate, mut draw, least, most) = joint(seed);
        let total = least + 0.15 * (most - least);
        let time = |target| Time { target, fixed: 0.0, reserved: 0.0 };
        let base = both.choose(0, time(least)).value;
        let plan = both.choose(1, time(total));
        let gain = plan.upper - base;
        let mut frame = 0;
        let mut split = |first: f64| {
            frame += 1;
            let (a, b) = (simulate.choose(frame, time(first)), draw.choose(frame, time(total - first)));
            (a.feasible && b.feasible, a.value + b.value, a.lambda, b.lambda)
        };
        let (feasible, value, ..) = split(0.5 * total);
        joint_sum += (plan.value - base) / gain;
        halves_sum += if feasible { (value - base) / gain } else { 0.0 };
        // a budget that cannot pay for the least of everything would pay any price
        let price = |feasible: bool, first: f64, second: f64| if feasible { (first, second) } else { (1.0, 0.0) };
        let best = even_split(total, |first, _| {
            let (feasible, _, a, b) = split(first);
            let starved = first < 0.5 * total;
            if feasible {
                price(true, a, b)
            } else if starved {
                (1.0, 0.0)
            } else {
                (0.0, 1.0)
            }
        });
        even_sum += (split(best).1 - base) / gain;
    }
    let n = INSTANCES as f64;
    let (joint, halves, even) = (joint_sum / n, halves_sum / n, even_sum / n);
    println!("of the bound's gain: one budget {joint:.4}, two halves {halves:.4}, two budgets at one price {even:.4}");
    assert!(joint >= 0.99 && joint >= halves + 0.03 && even >= 0.99, "{joint} {halves} {even}");
}

/// Agents of many sizes, and the gain of a picture by its logarithm: `worth` / ticks is its price.
fn workers(dearer: f64) -> Vec<Worker> {
    (1..=12)
        .map(|k| Worker {
            full: dearer * 300.0 * f64::from(k % 4 + 1),
            least: 0.02,
            loss: 40.0 * f64::from(k * 7 % 5 + 1),
        })
        .collect()
}

/// Plays the shared price with a picture worth `worth` ln(ticks) that wants `wants` ticks: price of the picture, of the agents, ticks of both.
fn play_shared_price(workers: &[Worker], (capacity, wants, worth): (f64, f64, f64)) -> Option<[f64; 4]> {
    let (mut shared_price, mut limit, mut last) = (SharedPrice::default(), wants, None);
    for _ in 0..600 {
        let lambda = if limit < wants { worth / limit.max(1.0) } else { 0.0 };
        let settled = shared_price.settle(workers, capacity, Drawing { wants, lambda });
        limit = settled.map_or(wants, |(_, ticks)| ticks.min(wants));
        last = settled.map(|(price, _)| [worth / limit, price, limit, taken(workers, price)]);
    }
    last
}

#[test]
fn shared_price_finds_the_split_of_equal_marginal_gain() {
    let (capacity, wants, worth) = (8000.0, 6000.0, 900.0);
    for dearer in [1.0, 2.0, 4.0, 8.0] {
        let workers = workers(dearer);
        let [drawing, agents, ticks, taken] =
            play_shared_price(&workers, (capacity, wants, worth)).expect("short of time");
        assert!((drawing / agents - 1.0).abs() < 0.02, "{dearer}: {drawing} and {agents}");
        assert!((ticks + taken - capacity).abs() < 1e-6 * capacity);
        // by halving, without frames
        let wanted = even_split(capacity, |first, second| (price(&workers, first), worth / second));
        assert!((taken / wanted - 1.0).abs() < 0.02, "{dearer}: {taken} and {wanted}");
    }
}

#[test]
fn shared_price_is_none_with_time_for_all_and_accepts_any_worker() {
    let workers = workers(1.0);
    let full = taken(&workers, 0.0);
    assert_eq!(play_shared_price(&workers, (full + 500.0, 500.0, 1.0)), None);
    assert!(play_shared_price(&workers, (full + 499.0, 500.0, 1.0)).is_some());
    // a picture that wants more than there is, and no agent that could give it any
    assert_eq!(play_shared_price(&[], (900.0, 1000.0, 1.0)), None);
    for (full, least, loss) in
        [(f64::NAN, 0.1, 1.0), (9e9, f64::NAN, 1.0), (9e9, 0.0, 0.0), (9e9, 2.0, f64::NAN), (-1.0, 0.5, 1.0)]
    {
        let odd = [Worker { full, least, loss }, workers[0]];
        for _ in 0..50 {
            if let Some((lambda, ticks)) =
                SharedPrice::default().settle(&odd, 1000.0, Drawing { wants: 900.0, lambda: f64::NAN })
            {
                assert!(
                    lambda.is_finite() && ticks.is_finite() && ticks >= 0.0,
                    "{full} {least} {loss}: {lambda} {ticks}"
                );
            }
        }
    }
}
