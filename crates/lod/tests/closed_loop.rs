//! Policies in a closed loop over a declared machine: the orders and goals of the theory, section 10.

mod plant;

use metachron_core::ResolutionRange;
use metachron_lod::adaptive::Settings;
use metachron_lod::control::{FrameWork, Kind, Law, ObjectView, PictureControl, Shading};
use plant::{AdaptivePolicy, Feedback, Full, Greedy, Machine, Policy, Run, Static, WALK, run, spread};
use std::time::Duration;

const SEEDS: std::ops::Range<u64> = 1..6;

fn s1(mut policy: impl FnMut() -> Box<dyn Policy>) -> Vec<Run> {
    SEEDS.map(|seed| run(&mut *policy(), &mut Machine::s1(seed), WALK, 1)).collect()
}

fn report(name: &str, runs: &[Run]) -> (f64, f64) {
    let all: Vec<_> = runs.iter().flat_map(|r| r.times.clone()).collect();
    let binding: Vec<_> = runs.iter().flat_map(Run::binding_times).collect();
    let quality: Vec<_> = runs.iter().flat_map(|r| r.quality.clone()).filter(|q| q.is_finite()).collect();
    let part = |of: fn(&Run) -> usize| {
        runs.iter().map(of).sum::<usize>() as f64 / runs.iter().map(|r| r.object_frames).sum::<usize>() as f64
    };
    let misses = runs.iter().map(Run::misses).sum::<f64>() / runs.len() as f64;
    let err = binding.iter().map(|x| (x - 1.0).abs()).sum::<f64>() / binding.len() as f64;
    println!(
        "{name:22} {:?} binding {:?} AvgErr {err:.4} miss {misses:.4} quality {:?} changes {:.4} reversals {:.5}",
        spread(&all),
        spread(&binding),
        spread(&quality).0,
        part(|r| r.changes),
        part(|r| r.reversals)
    );
    (spread(&binding).2, misses)
}

fn ours() -> Box<dyn Policy> {
    Box::new(AdaptivePolicy::new(Settings::default()))
}

#[test]
fn walk_through_the_auditorium_ranks_the_policies_as_the_paper_does() {
    let spread_of = |name, policy: fn() -> Box<dyn Policy>| report(name, &s1(policy)).0;
    let none = spread_of("none", || Box::new(Full));
    let by_size = spread_of("static, 1024 px", || Box::new(Static(1024.0)));
    let feedback = spread_of("feedback", || Box::<Feedback>::default());
    let greedy = spread_of("greedy", || Box::new(Greedy));
    let ours = spread_of("ours", ours);
    // (FS93, table 1): 3.05 > 0.48, 0.26 > 0.08, over all frames; here over the frames in which there is something to
    // choose
    assert!(none > by_size && none > feedback, "{none} {by_size} {feedback}");
    assert!(3.0 * greedy < by_size.min(feedback), "{greedy} is not a third of {by_size} and {feedback}");
    assert!(ours < greedy, "{ours} {greedy}");
}

#[test]
fn walk_on_a_machine_with_errors_keeps_its_time() {
    let runs = s1(ours);
    let (binding, misses) = report("ours", &runs);
    // the goals; 0.0281 and 0.0048 are reached, 1.08 at most
    assert!(binding <= 0.035 && misses <= 0.01, "{binding}, {misses}");
    let times: Vec<_> = runs.iter().flat_map(|r| r.times.clone()).collect();
    assert!(spread(&times).1 <= 1.15, "{}", spread(&times).1);
    let quality: Vec<_> = runs.iter().flat_map(|r| r.quality.clone()).collect();
    assert!(spread(&quality).0 >= 0.99, "{}", spread(&quality).0);
}

#[test]
fn few_levels_are_changed_and_changed_back() {
    let runs = s1(ours);
    let sum = |of: fn(&Run) -> usize| runs.iter().map(of).sum::<usize>() as f64;
    let reversals = sum(|r| r.reversals) / sum(|r| r.object_frames);
    let shy = Settings { hysteresis: 0.0, dwell: 0, ..Settings::default() };
    let free = s1(|| Box::new(AdaptivePolicy::new(shy)));
    let freely = free.iter().map(|r| r.reversals).sum::<usize>() as f64 / sum(|r| r.object_frames);
    // the goal is 0.002; 0.00003 is reached
    assert!(reversals <= 0.0002 && 10.0 * reversals < freely, "{reversals} and {freely}");
}

#[test]
fn wrong_table_a_load_step_and_spikes_are_learnt() {
    let default = || AdaptivePolicy::new(Settings::default());
    let runs: Vec<_> = SEEDS.map(|seed| run(&mut default(), &mut Machine::s2(seed), 4 * WALK, 2)).collect();
    let (_, misses) = report("ours, S2", &runs);
    // a spike in a hundred frames and the frames until a step is believed are within the share of late frames; 0.024 is reached
    assert!(misses <= 0.03, "{misses}");
    for seed in SEEDS {
        // a spike in a hundred is near that share: the margin comes and goes with their number, and the mean time with it
        let mut machine = Machine::s2(seed);
        machine.spikes = 0.0;
        let r = run(&mut default(), &mut machine, 4 * WALK, 2);
        let (up, down) = (r.settles(300, 400..690), r.settles(700, 750..980));
        assert!(
            up.is_some_and(|k| k <= 15) && down.is_some_and(|k| k <= 15),
            "settled after {up:?} and {down:?} frames"
        );
    }
    let open_loop: Vec<_> = SEEDS.map(|seed| run(&mut Greedy, &mut Machine::s2(seed), 4 * WALK, 2)).collect();
    assert!(report("greedy, S2", &open_loop).1 > 0.9, "without learning nine of ten frames are late");
}

#[test]
fn certificate_is_below_a_hundredth_in_nearly_every_frame() {
    let mut policy = AdaptivePolicy::new(Settings::default());
    run(&mut policy, &mut Machine::s1(1), WALK, 1);
    let near = policy.gaps.iter().filter(|g| **g <= 0.01).count();
    assert!(near * 100 >= policy.gaps.len() * 95, "{near} of {}", policy.gaps.len());
}

/// n of a tube alone under feedback at 60 Hz over 20 s, on a machine whose speed is `load` of the seconds passed.
fn levels_of_a_tube(start: f64, load: impl Fn(f64, u32) -> f64) -> Vec<u8> {
    let hz = 60.0;
    let mut control = PictureControl::new(metachron_lod::control::Policy::Feedback, Law::CORRECTED, hz);
    let range = ResolutionRange { eps_m: (5e-4, 0.02), n: (0, 6) };
    let kind = Kind::Tube { length_m: 1.5, radius_m: 0.015 };
    let shading = (Shading::PerPixel, Shading::PerPixel);
    let view = ObjectView { range, shading, pixels: 1e9, distance_m: 0.5, ..ObjectView::plain(0, kind) };
    let polygon_s = 0.6 / hz / start;
    let frame = |k: u32| {
        let plan = control.plan(&[view]);
        let (n, polygons) = (plan.levels[0].resolution.n, plan.polygons);
        let work = Duration::from_secs_f64((0.3 / hz + polygon_s * polygons) * load(f64::from(k) / hz, k));
        control.observe(FrameWork { work, draw: work, beside: Duration::ZERO, skip: false });
        n
    };
    (0..1200).map(frame).collect()
}

#[test]
fn under_a_load_that_is_steady_to_a_fifth_n_changes_by_a_level_at_most_and_does_not_come_back_within_two_seconds() {
    let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1_u32 << 24);
    // trembling from frame to frame, swinging in seconds, and a neighbour that comes and goes
    let loads: [&dyn Fn(f64, u32) -> f64; 4] = [
        &|_, k| 0.8 + 0.4 * noise(k),
        &|t, _| 1.0 + 0.2 * (2.0 * std::f64::consts::PI * t / 3.0).sin(),
        &|t, _| 1.0 + 0.2 * (2.0 * std::f64::consts::PI * t / 0.5).sin(),
        &|t, _| if t % 1.0 < 0.3 { 1.2 } else { 0.8 },
    ];
    for (which, load) in loads.into_iter().enumerate() {
        // at every distance from a switch of n
        for step in 0..24 {
            let levels = levels_of_a_tube(4000.0 * 1.06_f64.powi(step), load);
            let settled = &levels[120..];
            let (least, most) = (settled.iter().min().unwrap(), settled.iter().max().unwrap());
            assert!(most - least <= 1, "load {which}, start {step}: n from {least} to {most}");
            let changes: Vec<usize> = (1..settled.len()).filter(|k| settled[*k] != settled[k - 1]).collect();
            assert!(changes.windows(2).all(|pair| pair[1] - pair[0] > 120), "load {which}, start {step}: {changes:?}");
        }
    }
}
