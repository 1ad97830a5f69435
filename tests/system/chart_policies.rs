//! `metachron chart policies`: the limits of the papers' experiments, on their quick versions.

use crate::play::metachron;
use serde_json::Value;

/// Runs experiments and returns the JSON of each by its name.
fn quick(experiments: &[&str]) -> impl Fn(&str) -> Value {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let only = experiments.iter().flat_map(|name| ["--only", name]);
    let arguments = ["chart", "policies", "--quick", "--json", "-q", "--out", folder];
    let done = metachron(&arguments.into_iter().chain(only).collect::<Vec<_>>());
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let json: Value = serde_json::from_slice(&done.stdout).unwrap();
    let all = json["experiments"].as_array().unwrap().clone();
    move |name| all.iter().find(|e| e["name"] == name).unwrap().clone()
}

/// Every claim of an experiment holds, and there are so many of them.
fn holds(experiment: &Value, claims: usize) {
    let findings = experiment["findings"].as_array().unwrap();
    assert_eq!(findings.len(), claims, "{findings:#?}");
    for finding in findings {
        assert_eq!(finding["holds"], true, "{finding:#}");
    }
}

#[test]
fn every_limit_of_the_closed_loop_is_kept() {
    let of = quick(&["auditorium", "disturbed", "still"]);
    holds(&of("auditorium"), 8);
    holds(&of("disturbed"), 3);
    holds(&of("still"), 2);
}

#[test]
fn every_limit_of_groves_meshes_and_bounds_is_kept() {
    let of = quick(&["grove", "domes", "library", "walkthrough", "values", "bound"]);
    holds(&of("grove"), 3);
    holds(&of("domes"), 5);
    holds(&of("library"), 4);
    holds(&of("walkthrough"), 3);
    holds(&of("values"), 2);
    holds(&of("bound"), 3);
}
