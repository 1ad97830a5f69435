//! Every policy against the worked cases (`reference/budget_cases.json`): computed independently, with exact integers.

#[path = "../examples/solve/answer.rs"]
mod answer;

use serde_json::{Map, Value};

const CASES: &str = include_str!("reference/budget_cases.json");

fn cases() -> Value {
    serde_json::from_str(CASES).unwrap()
}

/// The answer of one policy to one case.
fn answer_to<'a>(answers: &'a [Value], case: &Value, policy: &str) -> &'a Value {
    let mut found = answers.iter().filter(|a| a["id"] == case["id"] && a["policy"] == policy);
    let answer = found.next().unwrap_or_else(|| panic!("{} has no answer for {policy}", case["id"]));
    assert!(found.next().is_none(), "{} has two answers for {policy}", case["id"]);
    answer
}

fn near(got: &Value, want: &Value, relative: f64) -> bool {
    match (got, want) {
        (Value::Array(got), Value::Array(want)) => {
            got.len() == want.len() && got.iter().zip(want).all(|(g, w)| near(g, w, relative))
        }
        _ => match (got.as_f64(), want.as_f64()) {
            (Some(got), Some(want)) => (got - want).abs() <= relative * want.abs().max(1e-9),
            _ => got == want,
        },
    }
}

/// Fields of `want` that the answer must give to within `relative`.
fn check(case: &Value, got: &Value, want: &Value, fields: &[&str], relative: f64) {
    for field in fields {
        assert!(
            near(&got[field], &want[field], relative),
            "{} {field}: {} is not {}",
            case["id"],
            got[field],
            want[field]
        );
    }
}

fn of_kind(kind: &str) -> Vec<Value> {
    let cases = cases();
    let list: Vec<_> = cases["cases"].as_array().unwrap().iter().filter(|c| c["kind"] == kind).cloned().collect();
    assert!(!list.is_empty());
    list
}

fn answers() -> Vec<Value> {
    answer::answers(&cases()).unwrap()
}

#[test]
fn every_policy_of_every_case_has_one_answer() {
    let answers = answers();
    let mut wanted = 0;
    for case in cases()["cases"].as_array().unwrap() {
        let expect: &Map<_, _> = case["expect"].as_object().unwrap();
        let policies = match case["kind"].as_str().unwrap() {
            "mckp" | "tree" if expect.len() > 1 => expect.keys().filter(|k| *k != "feasible").cloned().collect(),
            _ => vec!["main".to_owned()],
        };
        wanted += policies.len();
        policies.iter().for_each(|p| assert!(answer_to(&answers, case, p).is_object()));
    }
    assert_eq!(answers.len(), wanted);
}

#[test]
fn knapsacks_give_the_values_always_and_the_choices_where_no_ratios_tie() {
    let answers = answers();
    for case in of_kind("mckp") {
        let expect = &case["expect"];
        if expect["feasible"] == false {
            let got = answer_to(&answers, &case, "main");
            assert!(got["feasible"] == false && got["choice"] == serde_json::json!([0, 0]), "{got}");
            continue;
        }
        for (policy, want) in expect.as_object().unwrap().iter().filter(|(k, _)| *k != "feasible") {
            let got = answer_to(&answers, &case, policy);
            assert_eq!(got["feasible"], true, "{} {policy}", case["id"]);
            match policy.as_str() {
                "best_single" => assert_eq!(&got["value"], want, "{} {policy}", case["id"]),
                "lp" => check(&case, got, want, &["value", "lambda"], 1e-12), // a few roundings of doubles
                // the optimum's choice is one of several
                "opt" => check(&case, got, want, &["value"], 0.0),
                _ if case["distinct"] == true => check(&case, got, want, &["value", "cost", "choice"], 0.0),
                _ => check(&case, got, want, &["value", "cost"], 0.0),
            }
        }
    }
}

#[test]
fn trees_give_the_values_and_the_cuts() {
    let answers = answers();
    for case in of_kind("tree") {
        for (policy, want) in case["expect"].as_object().unwrap().iter().filter(|(k, _)| *k != "feasible") {
            let got = answer_to(&answers, &case, policy);
            assert_eq!(got["feasible"], case["expect"]["feasible"], "{} {policy}", case["id"]);
            match policy.as_str() {
                _ if want.is_null() => assert!(got["cut"].is_object() || policy == "lp", "{got}"),
                "lp" => assert!(near(&got["value"], want, 1e-12), "{} lp: {} is not {want}", case["id"], got["value"]),
                "opt" => check(&case, got, want, &["value"], 0.0),
                _ => check(&case, got, want, &["value", "cost", "cut"], 0.0),
            }
        }
    }
}

#[test]
fn robin_hood_matches_the_worked_cases() {
    let answers = answers();
    for case in of_kind("robinhood") {
        let got = answer_to(&answers, &case, "main");
        check(&case, got, &case["expect"], &["order", "lod"], 0.0);
        check(&case, got, &case["expect"], &["alloc", "leftover"], 1e-9); // sums of some twenty doubles
    }
}

#[test]
fn resolutions_and_rates_match_the_worked_cases() {
    let answers = answers();
    for (kind, fields) in [("gobbetti", ["r", "value", "lambda"]), ("rates", ["f", "cost", "lambda"])] {
        for case in of_kind(kind) {
            let got = answer_to(&answers, &case, "main");
            assert_eq!(got["feasible"], case["expect"]["feasible"], "{}", case["id"]);
            if case["expect"]["feasible"] == true {
                check(&case, got, &case["expect"], &fields, 1e-9); // the file's own tolerance
            }
        }
    }
}

#[test]
fn printed_rate_law_matches_the_traces() {
    let answers = answers();
    for case in of_kind("grisoni") {
        check(&case, answer_to(&answers, &case, "main"), &case["expect"], &["trace"], 1e-9);
    }
}

#[test]
fn one_level_of_everything_is_infeasible_where_an_object_has_none() {
    let solved = |mode: &str| {
        let file = serde_json::json!({"format": 1, "cases": [{
            "id": "bare", "kind": "mckp", "mode": mode, "budget": 100, "objects": [[[1, 2], [3, 9]], []],
            "expect": {"feasible": false, "opt": {}, "fs_skip": {}, "marg_fill": {}, "lp": {}},
        }]});
        answer::answers(&file).unwrap()
    };
    let (all, some) = (solved("exactly_one"), solved("at_most_one"));
    assert!(all.len() == 4 && all.iter().all(|a| a["feasible"] == false), "{all:?}");
    // the cheapest set beside it
    assert_eq!(all.iter().filter(|a| a["choice"] == serde_json::json!([0, -1])).count(), 3, "{all:?}");
    assert!(some.iter().all(|a| a["feasible"] == true), "{some:?}");
}

#[test]
fn a_file_of_another_format_is_refused() {
    for format in [serde_json::json!(2), serde_json::json!("1"), Value::Null] {
        let refused = answer::answers(&serde_json::json!({"format": format, "cases": []})).unwrap_err();
        assert!(refused.contains("format is"), "{refused}");
    }
    assert_eq!(answer::answers(&serde_json::json!({"format": 1, "cases": []})).unwrap(), Vec::<Value>::new());
}
