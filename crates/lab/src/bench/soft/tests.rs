//! Small cases of `bench soft` against closed forms, and how rows stand to each other.

use super::*;

fn few(steps: u32) -> Limits {
    let bound = Bound { steps, span: Duration::from_secs(5) };
    Limits { settle: Bound { steps: 60, ..bound }, measure: bound }
}

/// The mean sag of 5 × 5 points of its top by linear elasticity, metres: quadratic elements of an independent program, 6 × 6 × 6 of them.
const SAG_M: f64 = 3.70e-3;

#[test]
fn a_held_cube_sags_as_quadratic_elements_do_and_rests_where_finer_steps_bring_it() {
    let limits = few(30);
    let settle = Bound { steps: FINE_STEPS, ..limits.settle };
    let found = held(4, &Limits { settle, ..limits }).unwrap();
    // four cells along an edge, and strains of 4 %
    assert!((found.sag_m / SAG_M - 1.0).abs() < 0.03, "{} m, not {SAG_M} m", found.sag_m);
    assert!(found.shape_error < 1e-3, "{}", found.shape_error);
    assert!((found.nodes, found.steps, found.contacts) == (125, 30, 0) && found.ms_per_step_p50 > 0.0);
    assert!(found.ms_per_step_p99 >= found.ms_per_step_p50 && found.over_plain.is_nan());
}

#[test]
fn a_plate_presses_the_lying_cube_down_and_a_shaken_floor_takes_it_along() {
    let [lying, loaded, shaken] = [LYING, LOADED, BOTH].map(|test| Case { test, cells: 3 }.measure(&few(5)).unwrap());
    // E A/L of the bar that the cube is, under 0.2 kg
    let pressed_m = 0.2 * 9.81 / (12e3 * CUBE_M);
    let more_m = loaded.sag_m - lying.sag_m;
    assert!((more_m / pressed_m - 1.0).abs() < 0.2, "{more_m} m, not {pressed_m} m");
    let contacts = [lying.contacts, loaded.contacts, shaken.contacts];
    // its lower vertices, and those under the plate
    assert!(contacts[0] == 16 && contacts[1] > 16 && contacts[2] > 16, "{contacts:?}");
    // 0.3 g is below friction: in half a second the floor has gone all of its way, and the cube with it
    let mut play = Play::new(vec![boxed(bodies::cube(3)).unwrap(), Box::new(ShakenFloor::new().unwrap())], &[], STEP_S);
    let play = play.as_mut().unwrap();
    let middle = |play: &mut Play| play.points(0).iter().map(|at| at.x).sum::<f64>() / 64.0;
    let start = middle(play);
    play.measured(Bound { steps: 25, ..few(1).measure }).unwrap();
    let gone_m = middle(play) - start;
    let way_m = 2.0 * 0.3 * 9.81 / (2.0 * std::f64::consts::TAU).powi(2);
    assert!((gone_m / way_m - 1.0).abs() < 0.3, "{gone_m} m of {way_m} m");
}

#[test]
fn rows_are_held_against_the_plain_body_of_as_many_nodes_and_against_the_peer() {
    let mut play = Play::new(vec![boxed(bodies::cube(1)).unwrap()], &[], STEP_S).unwrap();
    let mut plain = |test: &str, nodes: usize, ms: f64| Row {
        nodes,
        ms_per_step_p50: ms,
        ..row(test, nodes, &play.measured(few(1).measure).unwrap())
    };
    let before = [plain(HELD, 100, 2.0), plain(HELD, 200, 8.0)];
    let lying = placed(plain(LYING, 200, 12.0), &before, None);
    assert!(lying.over_plain == 1.5 && lying.exponent.is_nan() && lying.peer_ms_per_step.is_nan());
    let held = placed(plain(HELD, 400, 32.0), &before, None);
    assert!((held.exponent - 2.0).abs() < 1e-12 && held.over_plain.is_nan());
}

#[test]
fn every_case_has_a_test_that_a_peers_file_may_name() {
    for quick in [false, true] {
        let list = cases(quick);
        assert!(list.iter().all(|case| TESTS.contains(&case.test)));
        assert!(TESTS.iter().all(|test| list.iter().any(|case| case.test == *test)));
    }
}
