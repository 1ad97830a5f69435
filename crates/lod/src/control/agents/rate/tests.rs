//! An agent's controller against declared agents: a step takes base + c/ε.

use super::*;

const PERIOD_S: f64 = 1.0 / 240.0;

fn limits() -> RateLimits {
    RateLimits { dt_wanted_s: PERIOD_S, dt_max_s: 0.016, eps_m: Some((0.005, 0.02)), work_power: 1.0, share: 0.5 }
}

/// The dead zone of the load is 0.8 … 1.05; a demand that is not worth it leaves the rest.
/// Work that comes in bursts: in every `every_s` seconds until `until_s` turns take `times` as long for `for_s`.
#[derive(Clone, Copy)]
struct Bursts {
    every_s: f64,
    for_s: f64,
    times: f64,
    until_s: f64,
}

/// An agent alone on a core: a turn of `full_s` at the finest ε, and periods that its work makes longer.
struct Agent {
    control: RateControl,
    full_s: f64,
    bursts: Option<Bursts>,
    now: RateDemand,
    time_s: f64,
    demands: Vec<(f64, RateDemand)>,
}

impl Agent {
    fn new(full_s: f64) -> Self {
        let now = RateDemand { dt_s: PERIOD_S, eps_m: Some(0.005) };
        let control = RateControl::new(limits(), RateGains::default(), now.eps_m);
        Self { control, full_s, bursts: None, now, time_s: 0.0, demands: Vec::new() }
    }

    fn from_coarsest(full_s: f64) -> Self {
        let control = RateControl::from_coarsest(limits(), RateGains::default());
        let now = control.begins_with().expect("a beginning");
        Self { control, now, ..Self::new(full_s) }
    }

    fn work_s(&self) -> f64 {
        let in_one = |b: &Bursts| self.time_s < b.until_s && self.time_s % b.every_s < b.for_s;
        let times = self.bursts.filter(in_one).map_or(1.0, |b| b.times);
        times * self.full_s * 0.005 / self.now.eps_m.unwrap()
    }

    fn run(&mut self, seconds: f64) {
        let end = self.time_s + seconds;
        while self.time_s < end {
            let (work_s, dt_s) = (self.work_s(), self.now.dt_s);
            let real_period_s = work_s.max(dt_s);
            self.time_s += real_period_s;
            let turn = TurnMeasure { work_s, wanted_period_s: PERIOD_S, real_period_s, dt_s };
            if let Some(demand) = self.control.after_turn(&turn) {
                self.now = demand;
                self.demands.push((self.time_s, demand));
            }
        }
    }

    fn load(&self) -> f64 {
        self.work_s() / (0.5 * self.now.dt_s)
    }
}

#[test]
fn an_agent_with_spare_time_keeps_its_resolution() {
    let mut agent = Agent::new(0.1 * PERIOD_S);
    agent.run(20.0);
    assert!(agent.demands.is_empty() && agent.control.rest() == Some(Bound::Finest));
}

#[test]
fn a_late_agent_coarsens_before_it_slows_down() {
    // at the coarsest ε the work is half the period, all of its share
    let mut agent = Agent::new(1.9 * PERIOD_S);
    agent.run(10.0);
    assert_eq!(agent.now.dt_s, PERIOD_S, "{:?}", agent.demands);
    assert!(agent.now.eps_m.unwrap() > 0.01 && (0.8..=1.06).contains(&agent.load()), "load {}", agent.load());
}

#[test]
fn an_agent_ten_times_too_slow_slows_down_last_and_comes_back_in_the_reverse_order() {
    let mut agent = Agent::new(6.0 * PERIOD_S);
    agent.run(20.0);
    assert_eq!(agent.now.eps_m, Some(0.02));
    assert!(agent.now.dt_s > 2.0 * PERIOD_S && (0.8..=1.06).contains(&agent.load()), "{:?}", agent.now);
    let first_slow = agent.demands.iter().position(|(_, d)| d.dt_s > PERIOD_S).unwrap();
    assert!(agent.demands[..first_slow].iter().all(|(_, d)| d.eps_m < Some(0.02)), "{:?}", agent.demands);
    agent.demands.clear();
    agent.full_s = 0.1 * PERIOD_S;
    agent.run(120.0);
    assert_eq!(agent.now, RateDemand { dt_s: PERIOD_S, eps_m: Some(0.005) });
    let finer = agent.demands.iter().position(|(_, d)| d.eps_m < Some(0.02)).unwrap();
    assert!(agent.demands[finer..].iter().all(|(_, d)| d.dt_s == PERIOD_S), "{:?}", agent.demands);
}

#[test]
fn an_agent_that_takes_many_cores_is_at_its_coarsest_after_a_window() {
    for times in [10.0, 33.0] {
        let mut agent = Agent::new(times * PERIOD_S);
        agent.run(0.5);
        let (at_s, first) = agent.demands[0];
        assert!(at_s < 0.25 + times * PERIOD_S && first.eps_m == Some(0.02), "{times}: {:?}", agent.demands);
        assert!(first.dt_s > 0.9 * 0.016, "{times}: {first:?}");
    }
}

#[test]
fn an_agent_that_begins_at_its_coarsest_is_where_one_from_its_finest_comes_to_within_seven_turns_and_never_late() {
    for part in [0.01, 0.3, 0.7, 1.5, 6.0] {
        let full_s = part * PERIOD_S;
        let (mut agent, mut other) = (Agent::from_coarsest(full_s), Agent::new(full_s));
        assert!((agent.now.dt_s - 0.016).abs() < 1e-12 && agent.now.eps_m == Some(0.02), "{:?}", agent.now);
        for turn in 0..7 {
            agent.run(1e-9); // one turn
            assert!(agent.load() < 1.06, "{part}, turn {turn}: {}", agent.load());
        }
        other.run(20.0);
        let z = |of: &RateDemand| limits().z_of(of);
        // both rest within the dead zone, which is 0.27 wide
        assert!((z(&agent.now) - z(&other.now)).abs() < 0.28, "{part}: {:?} {:?}", agent.now, other.now);
        let early = agent.demands.len();
        agent.run(20.0);
        assert!(agent.demands.len() <= early + 1, "{part}: {:?}", agent.demands);
    }
    // from the coarsest to the finest is a factor of 15.4: two steps of a factor of four, however little there is to do
    let mut idle = Agent::from_coarsest(1e-6 * PERIOD_S);
    (0..7).for_each(|_| idle.run(1e-9));
    assert_eq!((idle.demands.len(), idle.now), (2, RateDemand { dt_s: PERIOD_S, eps_m: Some(0.005) }));
}

#[test]
fn demands_stop_once_the_load_is_on_target() {
    for full in [0.7, 1.0, 1.7, 3.0, 6.0] {
        let mut agent = Agent::new(full * PERIOD_S);
        agent.run(20.0);
        agent.demands.clear();
        agent.run(60.0);
        assert!(agent.demands.is_empty(), "{full}: {:?}", agent.demands);
    }
}

#[test]
fn an_agent_delayed_by_others_refines_ever_more_rarely() {
    let mut control = RateControl::new(limits(), RateGains::default(), Some(0.005));
    let (mut now, mut time_s, mut retunes) = (control.demand(), 0.0, Vec::new());
    while time_s < 240.0 {
        // others leave it a core's time only while it is coarse: its own work is small all along
        let real_period_s = if now.eps_m < Some(0.009) { 1.3 * now.dt_s } else { now.dt_s };
        time_s += real_period_s;
        let turn = TurnMeasure { work_s: 0.05 * PERIOD_S, wanted_period_s: PERIOD_S, real_period_s, dt_s: now.dt_s };
        if let Some(demand) = control.after_turn(&turn) {
            now = demand;
            retunes.push(time_s);
        }
    }
    // one retune finer and one back, every 128 windows of a quarter of a second
    let late_ones = retunes.iter().filter(|t| **t > 120.0).count();
    assert!(late_ones <= 2 * (120 / 32 + 1), "{retunes:?}");
}

#[test]
fn one_delay_by_the_scheduler_changes_nothing() {
    let mut control = RateControl::new(limits(), RateGains::default(), Some(0.005));
    for turn in 0..5000 {
        let work_s = if turn == 2500 { 0.05 } else { 0.45 * PERIOD_S };
        let measure = TurnMeasure { work_s, wanted_period_s: PERIOD_S, real_period_s: PERIOD_S, dt_s: PERIOD_S };
        assert_eq!(control.after_turn(&measure), None, "turn {turn}");
    }
}

#[test]
fn fixed_values_switch_the_controller_off() {
    let fixed = RateLimits { dt_max_s: PERIOD_S, eps_m: Some((0.01, 0.01)), ..limits() };
    for limits in [fixed, RateLimits { eps_m: None, ..fixed }] {
        let mut control = RateControl::new(limits, RateGains::default(), Some(0.01));
        let turn = TurnMeasure { work_s: 1.0, wanted_period_s: PERIOD_S, real_period_s: 1.0, dt_s: PERIOD_S };
        assert!(!control.steers() && (0..100).all(|_| control.after_turn(&turn).is_none()));
    }
}

#[test]
fn a_model_without_eps_slows_down() {
    let mut control = RateControl::new(RateLimits { eps_m: None, ..limits() }, RateGains::default(), None);
    let mut dt_s = PERIOD_S;
    for _ in 0..5000 {
        let turn = TurnMeasure { work_s: PERIOD_S, wanted_period_s: PERIOD_S, real_period_s: dt_s, dt_s };
        dt_s = control.after_turn(&turn).map_or(dt_s, |d| d.dt_s);
    }
    assert!((PERIOD_S / (0.5 * dt_s)).ln().abs() <= 0.23, "{dt_s}"); // inside the dead zone
}

#[test]
fn invalid_turns_are_left_out() {
    let mut control = RateControl::new(limits(), RateGains::default(), Some(0.005));
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        for at in 0..4 {
            let mut x = [PERIOD_S; 4];
            x[at] = bad;
            let turn = TurnMeasure { work_s: x[0], wanted_period_s: x[1], real_period_s: x[2], dt_s: x[3] };
            assert!((0..500).all(|_| control.after_turn(&turn).is_none()));
        }
    }
    assert_eq!(control.demand(), RateDemand { dt_s: PERIOD_S, eps_m: Some(0.005) });
}

#[test]
fn demands_stay_in_their_ranges_whatever_is_measured() {
    let mut control = RateControl::new(limits(), RateGains::default(), Some(0.005));
    let mut seed = 1_u64;
    for _ in 0..100_000 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = [0, 8, 16, 24].map(|shift| 10.0_f64.powf(f64::from((seed >> (shift + 16)) as u8) / 25.0 - 6.0));
        let turn = TurnMeasure { work_s: x[0], wanted_period_s: x[1], real_period_s: x[2], dt_s: x[3] };
        if let Some(RateDemand { dt_s, eps_m }) = control.after_turn(&turn) {
            assert!((PERIOD_S..=0.016).contains(&dt_s) && (0.005..=0.02).contains(&eps_m.unwrap()));
        }
    }
}

#[test]
fn no_resolution_finer_than_visible_is_demanded_and_the_own_target_returns() {
    // one with time to spare, and one that rests at an ε which its share pays for
    for full in [0.1, 0.9] {
        let mut agent = Agent::new(full * PERIOD_S);
        agent.run(20.0);
        let held = agent.now;
        for (plain_m, eps_m) in
            [(0.015, 0.015), (f64::INFINITY, limits().eps_m.unwrap().1), (0.001, held.eps_m.unwrap())]
        {
            agent.control.set_visible(VisibleDetail { eps_m: plain_m, dt_s: 0.0 });
            agent.run(1.0);
            let now = agent.now.eps_m.unwrap();
            assert!((now / eps_m - 1.0).abs() < 1e-9, "{full}: as fine as {plain_m} m can be seen, {now} for {eps_m}");
            agent.run(20.0);
        }
        assert_eq!(agent.now, held, "{full}");
    }
}

#[test]
fn steps_are_as_long_as_can_be_seen_once_the_coarsest_spacing_is_fine_enough() {
    let mut agent = Agent::new(0.1 * PERIOD_S);
    agent.run(20.0);
    let held = agent.now;
    let RateLimits { dt_wanted_s, dt_max_s, eps_m, .. } = limits();
    let coarse_m = eps_m.unwrap().1;
    for (seen_m, seen_s, dt_s) in [
        (0.5 * coarse_m, 1.0, dt_wanted_s),
        (coarse_m, 1.5 * dt_wanted_s, 1.5 * dt_wanted_s),
        (f64::INFINITY, f64::INFINITY, dt_max_s),
        (f64::INFINITY, 0.0, dt_wanted_s),
    ] {
        agent.control.set_visible(VisibleDetail { eps_m: seen_m, dt_s: seen_s });
        agent.run(1.0);
        assert!((agent.now.dt_s / dt_s - 1.0).abs() < 1e-9, "{seen_m} m, {seen_s} s: {:?}", agent.now);
    }
    agent.control.set_visible(VisibleDetail { eps_m: 1e-6, dt_s: 0.0 });
    agent.run(20.0);
    assert_eq!(agent.now, held);
}

#[test]
fn a_late_agent_out_of_view_still_slows_down() {
    let mut agent = Agent::new(4.0 * PERIOD_S);
    agent.control.set_visible(VisibleDetail { eps_m: 0.01, dt_s: 0.0 });
    agent.run(20.0);
    assert!(agent.load() < 1.06 && agent.now.eps_m.unwrap() > 0.01, "{:?}", agent.now);
}

/// Bursts that last for a turn or for half a second, every fifth of a second to every four, and how many times the mean of all work is
/// that between them.
const BURSTS: [(Bursts, f64); 5] = {
    const fn bursts(every_s: f64, for_s: f64, times: f64) -> (Bursts, f64) {
        (Bursts { every_s, for_s, times, until_s: 60.0 }, 1.0 + (times - 1.0) * for_s / every_s)
    }
    [
        bursts(0.2, 0.02, 5.0),
        bursts(1.0, 0.1, 5.0),
        bursts(2.0, 0.25, 5.0),
        bursts(4.0, 0.4, 5.0),
        bursts(4.0, 0.05, 8.0),
    ]
};

#[test]
fn continued_bursts_count_by_their_mean() {
    for (bursts, mean) in BURSTS {
        let mut agent = Agent { bursts: Some(bursts), ..Agent::new(0.7 * PERIOD_S) };
        agent.run(30.0);
        agent.demands.clear();
        agent.run(29.0);
        agent.bursts = None;
        let load = mean * agent.load();
        // the dead zone, and the effect of a window more or less of bursts among sixteen
        assert!((0.7..1.1).contains(&load), "every {} s: {load}", bursts.every_s);
        assert!(agent.demands.is_empty(), "every {} s it comes to rest: {:?}", bursts.every_s, agent.demands);
    }
}

#[test]
fn after_bursts_an_agent_is_as_fine_as_before_within_ten_seconds() {
    let mut calm = Agent::new(0.7 * PERIOD_S);
    calm.run(30.0);
    let long = Bursts { every_s: 1e9, for_s: 60.0, times: 6.0, until_s: 60.0 };
    for bursts in BURSTS.map(|(bursts, _)| bursts).into_iter().chain([long]) {
        let mut agent = Agent { bursts: Some(bursts), ..Agent::new(0.7 * PERIOD_S) };
        agent.run(60.0);
        let during = agent.now;
        agent.run(10.0);
        let load = agent.load();
        assert!((0.8..=1.05).contains(&load), "every {} s: {during:?}, then {:?}", bursts.every_s, agent.now);
        assert!(agent.now.dt_s == PERIOD_S && agent.now.eps_m.unwrap() < 1.3 * calm.now.eps_m.unwrap());
    }
}

#[test]
fn an_agent_delayed_now_and_then_by_bursts_of_others_keeps_its_resolution() {
    let mut control = RateControl::new(limits(), RateGains::default(), Some(0.005));
    for turn in 0..20_000 {
        // every second for a tenth of one
        let real_period_s = if turn % 240 < 24 { 3.0 * PERIOD_S } else { PERIOD_S };
        let measure = TurnMeasure { work_s: 0.4 * PERIOD_S, wanted_period_s: PERIOD_S, real_period_s, dt_s: PERIOD_S };
        assert_eq!(control.after_turn(&measure), None, "turn {turn}");
    }
}

#[test]
fn work_that_falls_as_the_cube_of_spacing_finds_its_spacing_at_once() {
    let limits = RateLimits { work_power: 3.0, dt_max_s: PERIOD_S, ..limits() };
    let mut control = RateControl::new(limits, RateGains::default(), Some(0.005));
    let mut eps_m = 0.005_f64;
    let mut demands = 0;
    for _ in 0..2000 {
        // four times the time that it may take at the finest
        let work_s = 4.0 * 0.5 * PERIOD_S * (0.005 / eps_m).powi(3);
        let turn =
            TurnMeasure { work_s, wanted_period_s: PERIOD_S, real_period_s: work_s.max(PERIOD_S), dt_s: PERIOD_S };
        if let Some(demand) = control.after_turn(&turn) {
            eps_m = demand.eps_m.unwrap();
            demands += 1;
        }
    }
    let exact = 0.005 * 4.0_f64.cbrt();
    assert!((eps_m / exact - 1.0).abs() < 0.1, "{eps_m} m, {exact} exact");
    assert!(demands < 10, "{demands} demands");
}
