//! Promises of agents that touch, at any steps, measured by the program's own charts and held against the limits.

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
fn heavy_on_light_holds_wherever_another_engine_does_but_for_a_whip() {
    let heavy = experiment("stability", "heavy-on-light");
    let rows = heavy["table"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    let fails: Vec<_> = rows.iter().filter(|row| row["holds"] == "no").map(|row| &row["test"]).collect();
    // at 60 Hz the ends of light links under a thousand times their weight turn further in a step than their joints follow
    assert_eq!(fails, ["chain20-swing"], "{rows:#?}");
    assert!(rows.iter().filter(|row| row["holds"] == "yes").all(|row| number(row, "value").abs() <= 1e-3));
}

#[test]
fn a_tube_slips_on_a_cylinder_at_the_capstan_ratio() {
    let capstan = holds("stability", "capstan", 1);
    assert_eq!(capstan["table"].as_array().unwrap().len(), 2, "π/2, π");
}

#[test]
fn a_slope_holds_and_lets_go_at_the_angle_of_friction() {
    holds("stability", "incline", 2);
}

#[test]
fn a_tube_on_a_bar_rests_at_unequal_rates() {
    let tubes = experiment("stability", "tubes");
    let rows: Vec<_> = tubes["table"].as_array().unwrap().iter().filter(|r| r["scene"] == "tube-on-bar").collect();
    assert_eq!(rows.len(), 2, "the tube fast, and the tube slow");
    for row in rows {
        assert!(number(row, "peak") <= 1.01 && number(row, "contacts") > 0.0, "{row}");
        assert!(number(row, "depth_mm") <= 5.0, "{row}");
    }
}

#[test]
fn the_error_that_unequal_steps_make_is_reported_for_every_scene() {
    let error = holds("coupling", "error", 4);
    let rows = error["table"].as_array().unwrap();
    assert_eq!(rows.len(), 12, "four scenes, 1:1, 1:10 and 10:1");
    for row in rows.iter().filter(|r| r["scene"] == "oblique-blow") {
        // an impact acts when the sides meet, along the normal that they had when the step began: an error of first order (clusters.md, section 9)
        assert!(number(row, "max_mm") < 0.5 && number(row, "momentum_error") < 1e-9, "{row}");
    }
}
