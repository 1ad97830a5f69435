//! What agents with different clocks promise, measured by the program's own charts and held against the limits.

use crate::play::metachron;
use serde_json::Value;

/// The quick sweep of one experiment.
fn experiment(subject: &str, name: &str) -> Value {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let done = metachron(&["chart", subject, "--quick", "--only", name, "--json", "-q", "--out", folder]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let json: Value = serde_json::from_slice(&done.stdout).unwrap();
    json["experiments"][0].clone()
}

/// Every claim of the experiment holds.
fn holds(subject: &str, name: &str, claims: usize) -> Value {
    let experiment = experiment(subject, name);
    let findings = experiment["findings"].as_array().unwrap();
    assert_eq!(findings.len(), claims, "{findings:#?}");
    for finding in findings {
        assert_eq!(finding["holds"], true, "{finding:#}");
    }
    experiment
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no {key} in {row}"))
}

#[test]
fn a_drop_on_a_spring_mounted_body_gains_nothing_by_the_ledger_and_much_by_stale_penalty() {
    let drop = holds("stability", "drop", 4);
    let rows = drop["table"].as_array().unwrap();
    let peaks = |law: &str, k: f64| -> Vec<f64> {
        let here = rows.iter().filter(|r| r["law"] == law && number(r, "k_n_m") == k);
        here.map(|r| number(r, "peak")).collect()
    };
    assert_eq!(peaks("ledger", 0.0).len(), 2, "one and three dimensions");
    assert!(peaks("ledger", 0.0).iter().all(|p| *p <= 1.01), "{rows:#?}");
    assert!(peaks("penalty", 5000.0).iter().all(|p| *p > 10.0), "a stiff stale penalty explodes: {rows:#?}");
}

#[test]
fn a_stale_penalty_is_stable_about_as_far_as_the_formula_says() {
    holds("stability", "penalty-limit", 1);
}

#[test]
fn a_blow_between_two_clocks_is_the_closed_form_and_no_island() {
    let impact = holds("stability", "impact", 2);
    let rows = impact["table"].as_array().unwrap();
    assert_eq!(rows.len(), 9, "e = 0, 0.5, 1 and mass ratios 1, 10, 1000");
    for row in rows {
        assert!(number(row, "worst momentum error") < 1e-12 && row["kinds"] == "ledger", "{row}");
    }
}

#[test]
fn heavy_on_light_holds_wherever_another_engine_does() {
    let heavy = holds("stability", "heavy-on-light", 3);
    assert_eq!(heavy["table"].as_array().unwrap().len(), 4);
}

#[test]
fn a_closed_system_of_five_clocks_keeps_its_momentum_and_gains_no_energy() {
    let closed = holds("stability", "closed", 4);
    let rows = closed["table"].as_array().unwrap();
    assert_eq!(rows.len(), 2, "plates and a ring");
    for row in rows {
        assert!(number(row, "blows") > 0.0 && number(row, "in flight") > 0.0, "{row}");
    }
}

#[test]
fn a_tube_slips_on_a_cylinder_at_the_capstan_ratio() {
    let capstan = holds("stability", "capstan", 1);
    assert_eq!(capstan["table"].as_array().unwrap().len(), 3, "π/2, π, 2π");
}

#[test]
fn a_slope_holds_and_lets_go_at_the_angle_of_friction() {
    holds("stability", "incline", 2);
}

#[test]
fn a_tube_on_a_bar_between_two_clocks_lies_still() {
    let tubes = experiment("stability", "tubes");
    let rows: Vec<_> = tubes["table"].as_array().unwrap().iter().filter(|r| r["scene"] == "tube-on-bar").collect();
    assert_eq!(rows.len(), 2, "the tube fast, and the tube slow");
    for row in rows {
        assert!(number(row, "peak") <= 1.01 && number(row, "contacts") > 0.0, "{row}");
        assert!(number(row, "depth_mm") <= 5.0, "{row}");
    }
}

#[test]
fn the_error_that_clocks_apart_make_is_told_for_every_scene() {
    let error = holds("coupling", "error", 4);
    let rows = error["table"].as_array().unwrap();
    assert_eq!(rows.len(), 12, "four scenes, 1:1, 1:10 and 10:1");
    for row in rows.iter().filter(|r| r["scene"] == "oblique-blow") {
        // everything delivered at a common time: what is left is where the blow was found, to a thousandth of a millimetre
        assert!(number(row, "max_mm") < 1e-2 && number(row, "momentum_error") < 1e-9, "{row}");
    }
}
