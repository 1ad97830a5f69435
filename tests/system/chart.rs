//! `metachron chart`: its files, how it is stopped and taken up again, and the arguments that it refuses.

use crate::play::{metachron, program};
use serde_json::Value;
use std::path::Path;
use std::process::{Output, Stdio};
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn chart(folder: &Path, arguments: &[&str]) -> Output {
    charted("stability", folder, arguments)
}

fn charted(subject: &str, folder: &Path, arguments: &[&str]) -> Output {
    let fixed = ["chart", subject, "--quick", "--out", folder.to_str().unwrap()];
    metachron(&[&fixed[..], arguments].concat())
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The rows of a CSV file, under the columns' names.
fn rows(path: &Path) -> Vec<std::collections::BTreeMap<String, String>> {
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_quick_map_is_written_as_rows_and_pictures_and_as_json() {
    let out = folder();
    let done = chart(out.path(), &["--only", "tube-map", "--json", "-q"]);
    assert_eq!((done.status.code(), said(&done).as_str()), (Some(0), ""));
    let json: Value = serde_json::from_slice(&done.stdout).expect("nothing but JSON on standard output");
    let map = &json["experiments"][0];
    assert_eq!(
        (json["chart"].as_str(), map["name"].as_str(), map["complete"].as_bool()),
        (Some("stability"), Some("tube-map"), Some(true))
    );
    let text = std::fs::read_to_string(out.path().join("stability-tube-map.csv")).unwrap();
    let columns = "integrator,young_pa,dt_ms,verdict,tip_error,energy_rise,stretch,substeps_per_step";
    assert_eq!(text.lines().next(), Some(columns));
    assert_eq!(map["rows"].as_u64(), Some(text.lines().count() as u64 - 1));
    let svg = std::fs::read_to_string(out.path().join("stability-tube-map.svg")).unwrap();
    for word in ["<svg", "dt, ms", "Young", "blown up"] {
        assert!(svg.contains(word), "{word} is not in the figure");
    }
    let picture = image::open(out.path().join("stability-tube-map.png")).unwrap().to_rgb8();
    let colours: std::collections::BTreeSet<_> = picture.pixels().map(|p| p.0).collect();
    assert!(picture.width() > 400 && colours.len() > 10, "{} colours", colours.len());
    assert_eq!(std::fs::read_dir(out.path()).unwrap().count(), 3, "nothing else is left behind");
}

#[test]
fn tubes_are_stable_in_the_quick_map_or_say_beforehand_that_they_are_not() {
    let out = folder();
    chart(out.path(), &["--only", "tube-map", "-q"]);
    let rows = rows(&out.path().join("stability-tube-map.csv"));
    assert_eq!(rows.len(), 5 * 9);
    for row in rows {
        let explicit = ["symplectic-euler", "xpbd"].contains(&row["integrator"].as_str());
        if explicit && row["verdict"] == "refused" {
            continue;
        }
        let error: f64 = row["tip_error"].parse().unwrap();
        assert!(row["verdict"] == "stable" && error < 0.05, "{row:?}"); // the 5 % of the length
    }
}

#[test]
fn the_quick_diagram_of_the_cantilever_converges_with_second_order_and_shows_other_engines() {
    let out = folder();
    let done = charted("accuracy", out.path(), &["--only", "cantilever", "--json", "-q"]);
    assert_eq!((done.status.code(), said(&done).as_str()), (Some(0), ""));
    let json: Value = serde_json::from_slice(&done.stdout).expect("nothing but JSON on standard output");
    let table = json["experiments"][0]["table"].as_array().unwrap();
    assert_eq!(table.len(), 5, "one line an integrator");
    for line in table.iter().filter(|line| line["method"] != "xpbd") {
        let order = line["order in segments"].as_f64().unwrap();
        assert!((order - 2.0).abs() < 0.2, "{line}"); // 8 and 16 segments are not yet where the order is 2.00
    }
    let svg = std::fs::read_to_string(out.path().join("accuracy-cantilever.svg")).unwrap();
    for word in ["implicit-euler", "mujoco 4.0.0", "pyelastica 1.0.0", "front", "tip error"] {
        assert!(svg.contains(word), "{word} is not in the figure");
    }
}

/// A chart's output as JSON.
fn told(subject: &str, out: &Path, names: &[&str]) -> Value {
    let only: Vec<&str> = names.iter().flat_map(|name| ["--only", name]).collect();
    let done = charted(subject, out, &[&only[..], &["--json", "-q"]].concat());
    assert_eq!((done.status.code(), said(&done).as_str()), (Some(0), ""));
    serde_json::from_slice(&done.stdout).expect("nothing but JSON on standard output")
}

#[test]
fn the_quick_diagrams_answer_as_theory_does() {
    // the best error of each benchmark with the few segments of `--quick`, and their spatial error
    let limits = [
        ("end-moment", 3e-3),
        ("helix", 8e-3),
        ("frequencies", 0.02),
        ("twist-buckling", 0.02),
        ("michell-ring", 0.02),
        ("inflation", 0.3),
        ("sheet", 2e-3),
        ("solid-beam", 5e-3),
    ];
    let out = folder();
    let json = told("accuracy", out.path(), &limits.map(|(name, _)| name));
    let experiments = json["experiments"].as_array().unwrap();
    for (experiment, (name, limit)) in experiments.iter().zip(limits) {
        assert_eq!(experiment["name"].as_str(), Some(name));
        for line in experiment["table"].as_array().unwrap() {
            let error = line["best error"].as_f64().unwrap_or(f64::NAN);
            assert!(error < limit, "{name}: {line}");
        }
        assert!(experiment["findings"].as_array().unwrap().iter().all(|finding| finding["holds"] != false), "{name}");
    }
    assert_eq!(experiments.len(), limits.len());
}

#[test]
fn the_quick_scaling_of_a_tube_stands_beside_a_floor() {
    let out = folder();
    let json = told("scaling", out.path(), &["segments"]);
    let table = json["experiments"][0]["table"].as_array().unwrap();
    assert_eq!(table.len(), 3 * 4, "three kinds of four sizes");
    for pair in table.windows(2).filter(|pair| pair[0]["case"] == pair[1]["case"]) {
        let [few, many] = [0, 1].map(|k| pair[k]["us"].as_f64().unwrap());
        assert!(many > few, "three to four times the segments cost more: {pair:?}");
    }
    assert!(table.iter().all(|line| line["floor ns each"].as_f64().unwrap() > 0.0 && line["exponent"].is_number()));
    let svg = std::fs::read_to_string(out.path().join("scaling-segments.svg")).unwrap();
    for word in ["held by a tool", "one pass over the same memory", "mujoco 4.0.0", "ns each"] {
        assert!(svg.contains(word), "{word} is not in the figure");
    }
}

#[test]
fn the_rows_of_two_runs_are_the_same_bytes() {
    let [first, second] = [0, 1].map(|_| {
        let out = folder();
        chart(out.path(), &["--only", "incline", "-q"]);
        ["csv", "svg", "png"].map(|kind| std::fs::read(out.path().join(format!("stability-incline.{kind}"))).unwrap())
    });
    assert!(first == second);
}

#[test]
fn people_get_a_table_and_what_holds() {
    let out = folder();
    let done = chart(out.path(), &["--only", "incline"]);
    let table = String::from_utf8_lossy(&done.stdout);
    for word in ["incline:", "tan/μ", "holds", "claim", "stability-incline.png"] {
        assert!(table.contains(word), "{word} is not in\n{table}");
    }
    assert!(chart(out.path(), &["--only", "incline", "-q"]).stdout.is_empty());
}

#[test]
fn an_unknown_experiment_is_refused_with_a_suggestion() {
    let out = folder();
    let done = chart(out.path(), &["--only", "tube-mop"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(said(&done).contains("did you mean `tube-map`?"), "{}", said(&done));
    let done = metachron(&["chart", "stabilty"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(said(&done).contains("stability"), "{}", said(&done));
}

#[test]
fn a_folder_that_cannot_be_made_is_bad_input() {
    let out = folder();
    let file = out.path().join("file");
    std::fs::write(&file, b"").unwrap();
    let done = chart(&file.join("below"), &["--only", "incline"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(said(&done).contains("cannot be written") && said(&done).contains("below"), "{}", said(&done));
}

/// A child that is interrupted once its file has two rows more than `kept`; its exit code, its standard output, and its
/// messages.
#[cfg(unix)]
fn interrupted(out: &Path, experiment: &str, kept: usize) -> (Option<i32>, String, String) {
    let mut child = program()
        .args(["chart", "stability", "--out", out.to_str().unwrap(), "--only", experiment])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let file = out.join(format!("stability-{experiment}.csv"));
    while std::fs::read_to_string(&file).map_or(0, |text| text.lines().count()) < kept + 3 {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    let interrupt = format!("kill -INT {}", child.id());
    assert!(std::process::Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    let done = child.wait_with_output().unwrap();
    let [printed, words] = [done.stdout, done.stderr].map(|text| String::from_utf8(text).unwrap());
    (done.status.code(), printed, words)
}

#[cfg(unix)]
#[test]
fn an_interrupted_sweep_keeps_its_rows_and_the_next_run_takes_them_up() {
    let out = folder();
    let (code, printed, words) = interrupted(out.path(), "tube-map", 0);
    assert_eq!(code, Some(130), "{words}");
    assert!(words.contains("same command again"), "{words}");
    assert!(printed.contains("holds so far"), "{printed}");
    let (path, mark) = (out.path().join("stability-tube-map.csv"), out.path().join("stability-tube-map.unfinished"));
    let kept = rows(&path);
    assert!(kept.len() >= 2 && mark.exists());
    // a mark in a finished row tells whether it is taken up or measured again
    let text = std::fs::read_to_string(&path).unwrap();
    let first = text.lines().nth(1).unwrap();
    let (head, _) = first.rsplit_once(',').unwrap();
    std::fs::write(&path, text.replace(first, &format!("{head},777.0"))).unwrap();
    interrupted_again(out.path(), kept.len());
    assert!(rows(&path).iter().any(|row| row["substeps_per_step"] == "777.0"), "the row was measured again");
    // other settings are another sweep
    let done = chart(out.path(), &["--only", "tube-map", "-q"]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let rows = rows(&path);
    assert!(rows.len() == 5 * 9 && rows.iter().all(|row| row["substeps_per_step"] != "777.0") && !mark.exists());
}

/// Interrupts a second run, which must begin with the rows of the first.
#[cfg(unix)]
fn interrupted_again(out: &Path, kept: usize) {
    let (code, _, words) = interrupted(out, "tube-map", kept);
    assert_eq!(code, Some(130), "{words}");
    assert!(rows(&out.join("stability-tube-map.csv")).len() >= kept + 2);
}
