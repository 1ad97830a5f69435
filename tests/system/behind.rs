//! Agents that touch others and cannot keep up: steps that take longer than they last grow, and hold what they held.

use crate::play::{agent, lockstep, number, point};

/// Where the first probe of a built-in scene ends where each step of `model` takes so many milliseconds; nobody drops any time.
fn slowed(scene: &str, seconds: &str, (model, step_ms): (&str, u32), watched: &str) -> [f64; 3] {
    let slow = format!("machine.step.{model}.base_us={}", 1000 * step_ms);
    let report = lockstep(scene, &["--seconds", seconds, "--set", &slow]);
    for agent in report["agents"].as_array().unwrap() {
        assert!(!agent["parked"].as_bool().unwrap(), "{scene}: {agent}");
        assert!(number(agent, "/dropped_ms") < 20.0, "{scene}: {agent}");
    }
    let probes = report["probes"].as_array().unwrap();
    let probe = probes.iter().position(|probe| probe["object"] == watched).expect("it is watched");
    point(&report, &format!("/probes/{probe}/position_m"))
}

#[test]
fn a_marble_stays_on_an_organ_that_steps_at_a_quarter_of_its_rate() {
    // 6.9 cm at the full rate
    let at = slowed("organ", "2", ("solid", 10), "marble");
    assert!(at[2] > 0.06, "{at:?}");
}

#[test]
fn a_marble_waits_for_an_organ_whose_step_is_held_up() {
    // as a system does that gives a thread no time: the organ's step takes 30 to 200 ms, once, before or after the marble lands
    for (begin_s, held_ms) in [(0.0, 30), (0.0, 80), (0.0, 150), (0.02, 80), (0.03, 150), (0.4, 80), (0.4, 200)] {
        let load = format!("[{{at_s={begin_s},factor={}}},{{at_s={},factor=1}}]", held_ms / 3, begin_s + 0.01);
        let step_load = format!("machine.step_load={load}");
        let slow = [
            "--set",
            "machine.step.solid.base_us=3000",
            "--set",
            "machine.step.solid.unit_us=0",
            "--set",
            "machine.step.rigid.base_us=1",
            "--set",
            &step_load,
        ];
        let report = lockstep("organ", &[&["--seconds", "2"], &slow[..]].concat());
        let probes = report["probes"].as_array().unwrap();
        let marble = probes.iter().position(|probe| probe["object"] == "marble").unwrap();
        let at = point(&report, &format!("/probes/{marble}/position_m"));
        assert!(at[2] > 0.06, "held up for {held_ms} ms at {begin_s} s: {at:?}");
    }
}

#[test]
fn a_hose_stays_on_a_rope_though_both_cannot_keep_their_rates() {
    let at = slowed("crossing", "2", ("tube", 3), "hose");
    assert!((at[2] - 0.169).abs() < 5e-3, "{at:?}");
}

#[test]
fn fingers_that_step_at_a_third_of_their_rate_hold_what_they_lift() {
    let at = slowed("gripper", "4", ("rigid", 4), "tube");
    assert!((at[2] - 0.136).abs() < 2e-3, "{at:?}");
}

#[test]
fn a_gut_hangs_on_a_sheet_that_cannot_keep_its_rate() {
    for step_ms in [10, 15] {
        let at = slowed("mesentery", "2", ("sheet", step_ms), "gut");
        assert!(at[2] > 0.05 && at[2] < 0.2, "{step_ms} ms: {at:?}");
    }
    let report = lockstep("mesentery", &["--seconds", "0.5", "--set", "machine.step.sheet.base_us=10000"]);
    assert!(number(agent(&report, "mesentery"), "/rate_hz") < 101.0, "a step takes 10 ms");
}
