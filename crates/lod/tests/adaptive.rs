//! Promises of the default policy: of its choice, of its estimates, and of a picture in which nothing moves.

use metachron_lod::adaptive::{Adaptive, FilterUpdate, Offer, Plan, Settings, SpeedEstimator, Time, Trim, is_late};
use metachron_lod::select::Level;
use proptest::prelude::*;

const T: f64 = 100_000.0;

fn time(target: f64) -> Time {
    Time { target, fixed: 0.0, reserved: 0.0 }
}

/// No margin, no hysteresis: the choice alone.
fn bare() -> Settings {
    Settings { margin: 0.0, late: 1.0, hysteresis: 0.0, dwell: 0, trim: false }
}

fn offers(levels: &[(f64, f64)]) -> Vec<Offer> {
    levels.iter().map(|&(cost, gain)| Offer { cost, gain }).collect()
}

type Objects = Vec<(Vec<(f64, f64)>, f64)>;

fn put(adaptive: &mut Adaptive, id: usize, droppable: bool, (levels, weight): &(Vec<(f64, f64)>, f64)) {
    adaptive.set(id as u64, id % 4, droppable, &offers(levels));
    adaptive.weigh(id as u64, *weight);
}

fn levels(adaptive: &Adaptive, n: usize) -> Vec<Level> {
    (0..n).map(|id| adaptive.level(id as u64)).collect()
}

fn any_objects(most: usize) -> impl Strategy<Value = Objects> {
    let level = (0..300_u32, 0..100_u32).prop_map(|(c, g)| (f64::from(c), f64::from(g)));
    let weight = prop_oneof![4 => 0.0..10.0_f64, 1 => Just(0.0)];
    prop::collection::vec((prop::collection::vec(level, 0..6), weight), 0..most)
}

/// The best weighted gain within the budget, by trying everything.
fn brute(objects: &Objects, droppable: bool, budget: f64) -> Option<f64> {
    let mut sums = vec![(0.0, 0.0)];
    for (levels, weight) in objects {
        let none = (droppable || levels.is_empty()).then_some((0.0, 0.0));
        let choices: Vec<_> = levels.iter().copied().chain(none).collect();
        sums = sums.iter().flat_map(|&(c, v)| choices.iter().map(move |l| (c + l.0, v + weight * l.1))).collect();
        sums.retain(|s| s.0 <= budget);
    }
    sums.iter().map(|s| s.1).fold(None, |best, v| Some(best.map_or(v, |b: f64| b.max(v))))
}

proptest! {
    #[test]
    fn choice_is_never_over_the_budget_and_its_bound_is_never_below_the_best(
        objects in any_objects(6), droppable in any::<bool>(), budget in 0.0..1500.0_f64,
    ) {
        let mut adaptive = Adaptive::new(bare());
        objects.iter().enumerate().for_each(|(id, o)| put(&mut adaptive, id, droppable, o));
        let plan = adaptive.choose(0, time(budget.max(1.0)));
        let best = brute(&objects, droppable, budget.max(1.0));
        prop_assert_eq!(plan.feasible, best.is_some());
        let Some(best) = best else { return Ok(()) };
        let entry = |id: usize| adaptive.level(id as u64).map_or((0.0, 0.0), |l| objects[id].0[l as usize]);
        let spent: f64 = (0..objects.len()).map(|id| entry(id).0).sum();
        let value: f64 = (0..objects.len()).map(|id| entry(id).1 * objects[id].1).sum();
        prop_assert!(spent <= plan.budget && spent == plan.predicted, "{} of {}", spent, plan.budget);
        // a few roundings of doubles
        prop_assert!((value - plan.value).abs() <= 1e-9 * best.max(1.0));
        prop_assert!(value <= best * (1.0 + 1e-9) && best <= plan.upper * (1.0 + 1e-9), "{} {} {}", value, best, plan.upper);
    }

    #[test]
    fn choice_loses_less_than_one_step_where_every_level_can_fit(
        objects in any_objects(60), part in 0.0..1.0_f64,
    ) {
        let mut adaptive = Adaptive::new(bare());
        objects.iter().enumerate().for_each(|(id, o)| put(&mut adaptive, id, true, o));
        let all: f64 = objects.iter().map(|o| o.0.iter().map(|l| l.0).fold(0.0, f64::max)).sum();
        let plan = adaptive.choose(0, time((part * all).max(300.0)));
        let step = objects.iter().flat_map(|(ls, w)| ls.iter().map(move |l| l.1 * w)).fold(0.0, f64::max);
        prop_assert!(plan.upper - plan.value <= step * (1.0 + 1e-9) + 1e-9, "{} below {}", plan.value, plan.upper);
    }

    #[test]
    fn warm_start_equals_cold_start(
        objects in any_objects(50), other in any_objects(50), budgets in prop::collection::vec(1.0..5000.0_f64, 1..5), order in any::<u64>(),
    ) {
        let n = objects.len();
        let mut cold = Adaptive::new(bare());
        objects.iter().enumerate().for_each(|(id, o)| put(&mut cold, id, false, o));
        let last = *budgets.last().unwrap();
        let expected = cold.choose(0, time(last));
        // another life, other objects, other weights, in another order
        let mut warm = Adaptive::new(bare());
        for (frame, budget) in budgets.iter().enumerate() {
            other.iter().enumerate().for_each(|(id, o)| put(&mut warm, (id * 7 + frame) % 60, false, o));
            warm.choose(frame as u64, time(*budget));
        }
        (n..60).for_each(|id| { warm.remove(id as u64); });
        let mut mixed: Vec<_> = (0..n).collect();
        mixed.sort_by_key(|&i| (order ^ i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 7);
        mixed.iter().for_each(|&id| put(&mut warm, id, false, &objects[id]));
        let plan = warm.choose(99, time(last));
        prop_assert_eq!(levels(&warm, n), levels(&cold, n));
        prop_assert_eq!((plan.value.to_bits(), plan.upper.to_bits()), (expected.value.to_bits(), expected.upper.to_bits()));
    }

    #[test]
    fn by_default_a_warm_start_equals_another_with_the_same_levels_and_loses_no_more_than_its_certificate_says(
        objects in any_objects(50), budget in 1.0..5000.0_f64, other in 1.0..5000.0_f64, order in any::<u64>(),
    ) {
        let n = objects.len();
        let mut mixed: Vec<_> = (0..n).collect();
        mixed.sort_by_key(|&i| (order ^ i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 7);
        let filled = |order: &[usize]| {
            let mut adaptive = Adaptive::new(Settings::default());
            order.iter().for_each(|&id| put(&mut adaptive, id, false, &objects[id]));
            adaptive
        };
        let sorted: Vec<_> = (0..n).collect();
        let mut lives = [filled(&sorted), filled(&mixed)];
        let warm = lives.each_mut().map(|life| { life.choose(0, time(other)); life.choose(1, time(budget)) });
        prop_assert_eq!(levels(&lives[0], n), levels(&lives[1], n));
        prop_assert_eq!(warm[0].value.to_bits(), warm[1].value.to_bits());
        let cold = filled(&sorted).choose(0, time(budget));
        prop_assert_eq!(cold.feasible, warm[0].feasible);
        if cold.feasible && !warm[0].held {
            // a few roundings of doubles
            prop_assert!(cold.value <= warm[0].upper * (1.0 + 1e-9) && warm[0].value <= cold.upper * (1.0 + 1e-9));
        }
    }

    #[test]
    fn no_numbers_make_the_choice_fail(
        objects in prop::collection::vec((prop::collection::vec((any_number(), any_number()), 0..5), any_number()), 0..40),
        frames in prop::collection::vec((any_number(), any_number(), any_number()), 1..20), droppable in any::<bool>(),
    ) {
        let mut adaptive = Adaptive::new(Settings { margin: f64::NAN, late: f64::INFINITY, ..Settings::default() });
        for (frame, (target, fixed, took)) in frames.into_iter().enumerate() {
            objects.iter().enumerate().for_each(|(id, o)| put(&mut adaptive, id, droppable, o));
            let plan = adaptive.choose(frame as u64, Time { target, fixed, reserved: 0.0 });
            adaptive.observe(frame as u64, frame % 5, took);
            adaptive.finished(frame as u64, took);
            let sound = target.is_finite() && target > 0.0;
            prop_assert!(sound || !plan.feasible || plan.predicted <= 1.0);
            prop_assert!(!plan.feasible || plan.held || plan.predicted <= target.max(1.0) * (1.0 + 1e-9));
            let slowness = adaptive.estimator(0).slowness();
            prop_assert!(slowness.is_finite() && slowness > 0.0 && adaptive.margin() <= 0.75);
        }
    }
}

/// Hysteresis is memory: the default also chooses by the levels of the frame before.
#[test]
fn by_default_a_warm_start_keeps_what_a_cold_one_would_not_choose() {
    let chosen = |weights: &[[f64; 2]]| {
        let mut adaptive = Adaptive::new(Settings { dwell: 0, margin: 0.0, late: 1.0, ..Settings::default() });
        (0..2).for_each(|id| adaptive.set(id, 0, false, &offers(&[(1.0, 0.0), (100.0, 1.0)])));
        for (frame, weight) in (0..).zip(weights) {
            (0..2).for_each(|id| _ = adaptive.weigh(id, weight[id as usize]));
            adaptive.choose(frame, time(110.0));
        }
        levels(&adaptive, 2)
    };
    // time for one of two; the second gains 1.1 times as much, and the first is in the picture already
    assert_eq!(chosen(&[[1.0, 1.1]]), [Some(0), Some(1)]);
    assert_eq!(chosen(&[[1.0, 0.5], [1.0, 1.1]]), [Some(1), Some(0)]);
    // past 1 + h it goes over
    assert_eq!(chosen(&[[1.0, 0.5], [1.0, 1.3]]), [Some(0), Some(1)]);
}

/// Two objects, the second of worth `second`: there is time for one, after ten frames for both, and then for one again;
/// the levels at the end.
fn after_a_short_rise(second: f64) -> Vec<Level> {
    let mut adaptive = Adaptive::new(Settings { margin: 0.0, late: 1.0, ..Settings::default() });
    (0..2).for_each(|id| adaptive.set(id, 0, false, &offers(&[(1.0, 0.0), (100.0, 1.0)])));
    for frame in 0..12 {
        (0..2).for_each(|id| _ = adaptive.weigh(id, [1.0, second][id as usize]));
        adaptive.choose(frame, time(if frame == 10 { 220.0 } else { 110.0 }));
    }
    levels(&adaptive, 2)
}

/// An object that has just risen does not fall at once: others fall that are worth a little more, but not four times as
/// much.
#[test]
fn object_that_has_just_risen_falls_after_others_unless_they_are_worth_four_times_as_much() {
    assert_eq!(after_a_short_rise(0.9), [Some(0), Some(1)]);
    // 0.2 · 4 is less than 1 + h
    assert_eq!(after_a_short_rise(0.2), [Some(1), Some(0)]);
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => 0.0..1000.0_f64, 1 => Just(0.0), 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => Just(-1.0), 1 => any::<f64>()]
}

/// A scene of `n` objects with the same ladder and other weights.
fn scene(n: u64, settings: Settings) -> Adaptive {
    let mut adaptive = Adaptive::new(settings);
    for id in 0..n {
        adaptive.set(id, 0, false, &offers(&[(50.0, 0.5), (200.0, 0.8), (800.0, 0.95), (3000.0, 1.0)]));
        adaptive.weigh(id, 1000.0 / (1.0 + id as f64));
    }
    adaptive
}

/// Plays `frames` frames on a machine that takes `machine(frame)` times the table; gives the plans and how often a level changed.
fn play(adaptive: &mut Adaptive, frames: u64, machine: impl Fn(u64) -> f64) -> (Vec<Plan>, usize) {
    let (mut plans, mut changes, mut last) = (vec![], 0, vec![]);
    for frame in 0..frames {
        let plan = adaptive.choose(frame, time(T));
        let now = levels(adaptive, 200);
        changes += usize::from(frame > 0 && now != last);
        last = now;
        let took = (plan.predicted / slowness(adaptive)) * machine(frame);
        adaptive.observe(frame, 0, took);
        adaptive.finished(frame, took);
        plans.push(plan);
    }
    (plans, changes)
}

/// γ as a plan was made with: its prediction for one tick of the table.
fn slowness(adaptive: &Adaptive) -> f64 {
    adaptive.planned_slowness(0)
}

#[test]
fn still_picture_on_a_steady_machine_never_changes() {
    let mut adaptive = scene(200, Settings::default());
    let (plans, changes) = play(&mut adaptive, 300, |_| 1.0);
    assert_eq!(changes, 0);
    assert!(plans[1..].iter().all(|p| p.held));
}

#[test]
fn camera_that_stands_still_but_for_rounding_is_a_still_picture() {
    let (mut adaptive, mut held) = (scene(200, Settings::default()), 0);
    let weights: Vec<f64> = (0..200).map(|id| 50.0 + 7.0 * (id * 37 % 101) as f64).collect();
    for frame in 0..100 {
        let rounding = |id: usize| 1.0 + 1e-16 * 2.0_f64.powi((frame + id as u64) as i32 % 7);
        weights.iter().enumerate().for_each(|(id, w)| assert!(adaptive.weigh(id as u64, w * rounding(id))));
        let plan = adaptive.choose(frame, Time { target: T, fixed: 300.0 * rounding(frame as usize), reserved: 0.0 });
        held += usize::from(plan.held);
        adaptive.observe(frame, 0, plan.predicted - 300.0);
    }
    assert_eq!(held, 99);
    // an object that has moved is chosen anew
    adaptive.weigh(3, 1.01 * weights[3]);
    assert!(!adaptive.choose(100, Time { target: T, fixed: 300.0, reserved: 0.0 }).held);
}

#[test]
fn still_picture_on_a_noisy_machine_never_changes_once_the_noise_is_known() {
    // 1 % up and down, without a pattern
    let tremble = |frame: u64| 1.0 + 0.01 * ((frame as f64 * 12.9898).sin() * 43_758.547).sin();
    let mut adaptive = scene(200, Settings::default());
    play(&mut adaptive, 30, tremble);
    let before = levels(&adaptive, 200);
    for frame in 30..600 {
        let plan = adaptive.choose(frame, time(T));
        adaptive.observe(frame, 0, plan.predicted / slowness(&adaptive) * tremble(frame));
        assert_eq!(levels(&adaptive, 200), before, "frame {frame}");
    }
}

#[test]
fn still_picture_on_a_drifting_machine_changes_ever_less_often_and_is_not_late() {
    // 5 % that stay by nine tenths from frame to frame; news without a pattern, of variance 1
    let news = |frame: u64| {
        2.45 * (((frame as f64 * 12.9898).sin() * 43_758.547).rem_euclid(1.0)
            + ((frame as f64 * 78.233).sin() * 12_543.123).rem_euclid(1.0)
            - 1.0)
    };
    let mut slower = vec![0.0];
    (1..1200).for_each(|k| slower.push(0.9 * slower[k as usize - 1] + 0.19_f64.sqrt() * 0.05 * news(k)));
    let (mut adaptive, mut changed, mut late, mut last) = (scene(200, Settings::default()), vec![], 0, vec![]);
    for frame in 0..1200 {
        let plan = adaptive.choose(frame, time(T));
        let now = levels(&adaptive, 200);
        if frame > 0 && now != last {
            changed.push(frame);
        }
        last = now;
        let took = plan.predicted / slowness(&adaptive) * (1.0 + slower[frame as usize]);
        late += usize::from(frame >= 30 && took > 1.05 * T);
        adaptive.observe(frame, 0, took);
        adaptive.finished(frame, took);
    }
    let after = |frame: u64| changed.iter().filter(|k| **k >= frame).count();
    // 90 changes after the first hundred frames where it always waits for eight
    assert!(after(100) <= 3 && late <= 12, "changed at {changed:?}, {late} of 1170 late");
}

#[test]
fn still_picture_falls_at_once_where_the_machine_slows_and_rises_where_it_recovers() {
    let mut adaptive = scene(200, Settings::default());
    let (plans, _) = play(&mut adaptive, 300, |frame| if (100..200).contains(&frame) { 1.4 } else { 1.0 });
    let spent = |p: &Plan| p.predicted / T;
    // three outliers, then it is believed; two frames later the picture is within its time again
    assert!(
        plans[106..200].iter().all(|p| spent(p) <= 1.0),
        "{:?}",
        plans[106..120].iter().map(spent).collect::<Vec<_>>()
    );
    let ends: Vec<_> = [99, 199, 299].iter().map(|&k| plans[k].value).collect();
    assert!(ends[1] < ends[0] && ends[2] > ends[1], "{ends:?}");
    assert!(plans[240..].iter().all(|p| spent(p) > 0.9), "time to spare is taken up");
}

#[test]
fn table_that_is_wrong_is_corrected_within_ten_frames() {
    for wrong in [0.5, 0.8, 1.25, 2.0] {
        let mut adaptive = scene(200, Settings::default());
        play(&mut adaptive, 13, |_| wrong); // three frames teach nothing
        let slowness = adaptive.estimator(0).slowness();
        assert!((slowness / wrong - 1.0).abs() < 0.02, "{slowness} for {wrong}");
    }
}

#[test]
fn one_spike_is_an_outlier_and_three_are_a_new_regime() {
    let mut estimator = SpeedEstimator::default();
    (0..20).for_each(|_| assert_eq!(estimator.observe(0.9, 0.9), FilterUpdate::Accepted));
    let before = estimator.slowness();
    assert_eq!(estimator.observe(0.9, 1.8), FilterUpdate::Outlier);
    assert_eq!((estimator.slowness(), estimator.observe(0.9, 0.9)), (before, FilterUpdate::Accepted));
    assert_eq!(estimator.observe(0.9, 1.8), FilterUpdate::Outlier);
    assert_eq!(estimator.observe(0.9, 0.1), FilterUpdate::Outlier, "on the other side, so not the second in a row");
    assert_eq!(estimator.observe(0.9, 1.8), FilterUpdate::Outlier);
    assert_eq!(estimator.observe(0.9, 1.8), FilterUpdate::Outlier);
    assert_eq!(estimator.observe(0.9, 1.8), FilterUpdate::NewRegime);
    assert!((estimator.slowness() - 2.0).abs() < 0.01, "{}", estimator.slowness());
}

#[test]
fn invalid_measurements_are_rejected() {
    let mut estimator = SpeedEstimator::default();
    for (table, took) in [(f64::NAN, 1.0), (0.0, 1.0), (-1.0, 1.0), (1.0, f64::NAN), (1.0, -1.0), (1.0, f64::INFINITY)]
    {
        assert_eq!(estimator.observe(table, took), FilterUpdate::Rejected);
    }
    assert_eq!(estimator, SpeedEstimator::default());
    let mut adaptive = scene(200, Settings::default());
    for frame in 0..10 {
        adaptive.choose(frame, time(T));
    }
    assert_eq!(adaptive.observe(9, 0, 0.9 * T), FilterUpdate::Accepted);
    assert_eq!(adaptive.observe(1, 0, 0.9 * T), FilterUpdate::Rejected, "frame 1 is forgotten");
    assert_eq!(adaptive.observe(40, 0, 0.9 * T), FilterUpdate::Rejected, "frame 40 is still to come");
    adaptive.disturb();
    assert_eq!(adaptive.observe(9, 0, 0.9 * T), FilterUpdate::Rejected);
    adaptive.choose(10, time(T));
    assert_eq!(adaptive.observe(10, 0, 0.9 * T), FilterUpdate::Rejected, "the first frames after a disturbance");
}

#[test]
fn objects_come_and_go_by_their_ids() {
    let mut adaptive = scene(100, Settings::default());
    let plan = adaptive.choose(0, time(T));
    assert!(adaptive.remove(3) && !adaptive.remove(3) && !adaptive.weigh(3, 1.0));
    assert_eq!(adaptive.level(3), None);
    let fewer = adaptive.choose(1, time(T));
    assert!(!fewer.held && fewer.value < plan.value);
    adaptive.set(1000, 0, false, &offers(&[(10.0, 1.0)]));
    adaptive.choose(2, time(T));
    assert_eq!((adaptive.level(1000), adaptive.lowest(1000)), (Some(0), Some(0)));
}

#[test]
fn one_giant_does_not_affect_the_rest() {
    let mut adaptive = scene(100, bare());
    adaptive.set(7, 0, false, &offers(&[(10.0, 0.1), (1e9, 1.0)]));
    adaptive.weigh(7, 1e12); // its second level has by far the most gain per time, and never fits
    let plan = adaptive.choose(0, time(T));
    assert!(plan.feasible && adaptive.level(7) == Some(0));
    assert!(plan.predicted > 0.9 * T, "{}", plan.predicted);
}

#[test]
fn no_objects_and_no_time_give_a_plan() {
    let mut adaptive = Adaptive::new(Settings::default());
    let plan = adaptive.choose(0, time(T));
    assert!(plan.feasible && plan.predicted == 0.0 && plan.lambda == 0.0);
    let mut adaptive = scene(5, Settings::default());
    for (frame, target) in [f64::NAN, 0.0, -1.0, f64::INFINITY, 100.0].into_iter().enumerate() {
        let plan = adaptive.choose(frame as u64, time(target));
        assert!(!plan.feasible && plan.upper == 0.0, "{target}");
        assert!((0..5).all(|id| adaptive.level(id) == Some(0)), "the lowest of everything");
    }
}

#[test]
fn object_without_pixels_has_its_lowest_form_or_none() {
    let mut adaptive = Adaptive::new(Settings::default());
    for (id, droppable) in [(0, false), (1, true)] {
        adaptive.set(id, 0, droppable, &offers(&[(10.0, 0.5), (20.0, 1.0)]));
        adaptive.weigh(id, 0.0);
    }
    adaptive.choose(0, time(T));
    assert_eq!((adaptive.level(0), adaptive.level(1)), (Some(0), None));
}

#[test]
fn stages_share_one_price() {
    // drawing and simulation of equal worth, one stage twice as slow as its table says
    let mut adaptive = Adaptive::new(bare());
    for id in 0..200 {
        let ladder: Vec<_> = (1..20).map(|l| (100.0 * f64::from(l), f64::from(l).sqrt())).collect();
        adaptive.set(id, (id % 2) as usize, false, &offers(&ladder));
    }
    for frame in 0..40 {
        let plan = adaptive.choose(frame, time(T));
        let cost = |id: u64| 100.0 * f64::from(adaptive.level(id).unwrap() + 1);
        let fast: f64 = (0..200).step_by(2).map(cost).sum();
        let slow: f64 = (1..200).step_by(2).map(cost).sum();
        if frame == 39 {
            // gain √l at 100 γ l ticks: l is ∝ 1/γ², a fourth where γ is 2; a step to l has the slope of √ at l − ½
            let (fast, slow) = (fast / 1e4 - 0.5, slow / 1e4 - 0.5);
            assert!((fast / slow - 4.0).abs() < 0.8, "{fast} {slow}: levels are whole");
        }
        assert!(plan.predicted <= T);
        adaptive.observe(frame, 0, fast);
        adaptive.observe(frame, 1, 2.0 * slow);
    }
}

#[test]
fn deadline_is_at_85_parts_of_100() {
    assert!(!is_late(0.85, 1.0) && is_late(0.851, 1.0) && is_late(f64::NAN, 1.0));
}

#[test]
fn trim_holds_where_there_is_nothing_to_spend_time_on() {
    let mut trim = Trim::default();
    (0..1000).for_each(|_| trim.observe(0.5, true));
    assert_eq!(trim.part(), 0.0);
    (0..1000).for_each(|_| trim.observe(0.5, false));
    assert_eq!(trim.part(), 0.05);
    (0..1000).for_each(|_| trim.observe(-0.5, true));
    assert_eq!(trim.part(), -0.10);
}

#[test]
fn frames_allocate_nothing_once_the_buffers_have_grown() {
    let mut adaptive = scene(500, Settings::default());
    let mut frame = 0;
    let mut step = |adaptive: &mut Adaptive| {
        for id in 0..500 {
            adaptive.weigh(id, 1.0 + ((id * 31 + frame * 17) % 97) as f64);
        }
        let plan = adaptive.choose(frame, time(T));
        adaptive.observe(frame, 0, plan.predicted);
        adaptive.finished(frame, plan.predicted);
        frame += 1;
    };
    (0..200).for_each(|_| step(&mut adaptive));
    let counted = allocation_counter::measure(|| (0..50).for_each(|_| step(&mut adaptive)));
    assert_eq!(counted.count_total, 0);
}
