//! The controller that holds an error, against agents whose error is declared.

use super::*;

/// An agent whose error in space is a ε² and whose error in time follows b dtᵖ within a second.
struct Plant {
    control: ErrorControl,
    now: RateDemand,
    space: f64,
    time: (f64, f64),
    /// The drift of its steps so far, metres.
    drift_m: f64,
    clock_s: f64,
    demands: Vec<f64>,
    worst_m: f64,
}

const DT_S: (f64, f64) = (1e-3, 16e-3);
const EPS_M: (f64, f64) = (2e-3, 5e-2);

impl Plant {
    fn new(tolerance_m: f64, now: (f64, f64), time: (f64, f64)) -> Self {
        let now = RateDemand { dt_s: now.0, eps_m: Some(now.1) };
        let limits = ErrorLimits { tolerance_m, dt_s: DT_S, eps_m: Some(EPS_M) };
        let control = ErrorControl::new(&limits, now);
        Self { control, now, space: 1.0, time, drift_m: 0.0, clock_s: 0.0, demands: vec![], worst_m: 0.0 }
    }

    fn error_m(&self) -> (f64, f64) {
        let eps_m = self.now.eps_m.unwrap();
        (self.space * eps_m * eps_m, self.time.0 * self.now.dt_s.powf(self.time.1))
    }

    fn run(&mut self, seconds: f64) {
        let end = self.clock_s + seconds;
        (self.worst_m, self.demands) = (0.0, vec![]);
        while self.clock_s < end {
            let (space_m, steady_m) = self.error_m();
            let dt_s = self.now.dt_s;
            self.clock_s += dt_s;
            self.drift_m += (steady_m - self.drift_m) * (1.0 - (-dt_s).exp());
            self.worst_m = self.worst_m.max(space_m + self.drift_m);
            let turn = ErrorMeasure { space_m, time_m: self.drift_m, dt_s };
            if let Some(demand) = self.control.after_turn(&turn) {
                self.now = demand;
                self.demands.push(self.clock_s);
            }
        }
    }
}

#[test]
fn the_error_settles_within_the_tolerance_from_both_sides() {
    for order in [1.0, 2.0] {
        // at 4 ms of steps the error in time is half a millimetre, at ε of 2 cm the one in space
        let time = (5e-4 / 4e-3_f64.powf(order), order);
        for start in [(DT_S.0, EPS_M.0), (DT_S.1, EPS_M.1), (DT_S.0, EPS_M.1)] {
            let mut plant = Plant::new(1e-3, start, time);
            plant.run(60.0);
            plant.run(120.0);
            let (space_m, time_m) = plant.error_m();
            assert!(plant.demands.is_empty(), "order {order}, from {start:?}: still asks at {:?} s", plant.demands);
            assert!(plant.worst_m <= 1e-3, "order {order}, from {start:?}: {} m", plant.worst_m);
            // no finer than it must be: each part uses a good part of its half
            assert!(space_m + time_m > 0.45e-3, "order {order}, from {start:?}: only {space_m} m and {time_m} m");
            assert_eq!(plant.control.rest(), None);
        }
    }
}

#[test]
fn an_unreachable_tolerance_rests_at_the_finest_and_is_reported() {
    let mut plant = Plant::new(1e-7, (4e-3, 1e-2), (0.1, 1.0));
    plant.run(30.0);
    assert_eq!((plant.control.rest(), plant.now.dt_s, plant.now.eps_m), (Some(Bound::Finest), DT_S.0, Some(EPS_M.0)));
    plant.run(30.0);
    assert!(plant.demands.is_empty());
}

#[test]
fn a_tolerance_above_every_error_rests_at_the_coarsest() {
    let mut plant = Plant::new(10.0, (4e-3, 1e-2), (0.1, 1.0));
    plant.run(60.0);
    assert_eq!((plant.control.rest(), plant.now.dt_s, plant.now.eps_m), (Some(Bound::Coarsest), DT_S.1, Some(EPS_M.1)));
}

#[test]
fn an_intermittent_motion_causes_no_oscillation() {
    let mut plant = Plant::new(1e-3, (4e-3, 1e-2), (0.1, 1.0));
    let mut asked = [0, 0];
    for cycle in 0..60 {
        plant.time.0 = if cycle % 2 == 0 { 0.3 } else { 0.01 };
        plant.run(4.0);
        asked[usize::from(cycle >= 30)] += plant.demands.len();
    }
    // patience doubles with every step that was coarsened too soon
    assert!(asked[1] < asked[0] && asked[1] <= 30, "{asked:?} demands in two minutes each");
}

#[test]
fn invalid_numbers_are_ignored() {
    let mut plant = Plant::new(1e-3, (4e-3, 1e-2), (0.1, 1.0));
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        for turn in [(bad, 0.0, 4e-3), (0.0, bad, 4e-3), (0.0, 0.0, bad)] {
            let (space_m, time_m, dt_s) = turn;
            for _ in 0..2000 {
                assert_eq!(plant.control.after_turn(&ErrorMeasure { space_m, time_m, dt_s }), None);
            }
        }
    }
}
