//! `metachron fit`: the cheapest settings within a tolerance, checked by running the scene that it writes; and objects that hold
//! an error by themselves.

use crate::play::{Folder, agent, metachron, number};
use serde_json::Value;

/// A clamped soft tube, damped, far finer than a millimetre needs.
const TUBE: &str = r#"
# a comment that stays
[[object]]
name = "tube"
model = "tube"
path_m = [[0, 0, 0], [0.5, 0, 0]]
radius_m = 0.015
wall_m = 0.002
young_pa = 1e6 # so soft
density_kg_m3 = 1050
damping_per_s = 6
clamp = ["start"]
self_contact = false
segments = 64   # too many
dt_ms = 1.0     # too short
sleep = false

[[probe]]
object = "tube"
at = 1.0
every_ms = 20
"#;

/// `fit` of a scene with these arguments: exit code, its output as JSON, and its messages.
fn fit(scene: &str, arguments: &[&str]) -> (i32, Value, String) {
    let done = metachron(&[&["fit", scene, "--json", "-q"], arguments].concat());
    let said = serde_json::from_slice(&done.stdout).unwrap_or(Value::Null);
    (done.status.code().unwrap(), said, String::from_utf8_lossy(&done.stderr).into_owned())
}

/// Where the scene's first probe is, sample by sample.
fn samples(report: &Value) -> Vec<[f64; 4]> {
    let samples = report["probes"][0]["samples"].as_array().unwrap();
    samples.iter().map(|s| [0, 1, 2, 3].map(|k| s[k].as_f64().unwrap())).collect()
}

#[test]
fn a_tube_that_is_too_fine_is_written_coarser_and_still_holds() {
    let folder = Folder::with(TUBE);
    let tolerance = 2e-3;
    let (code, said, errors) = fit(folder.scene(), &["--tolerance", "2e-3", "--seconds", "0.6", "--write"]);
    assert_eq!(code, 0, "{errors}");
    let [pays, needs] = ["pays", "needs"].map(|side| &said["objects"][0][side]);
    assert_eq!((number(pays, "/dt_ms"), number(pays, "/segments")), (1.0, 64.0));
    assert!(number(needs, "/dt_ms") > 1.0 && number(needs, "/segments") < 64.0, "{needs}");
    assert!(number(needs, "/ms_per_s") < 0.25 * number(pays, "/ms_per_s"), "{said}");
    assert!(number(&said, "/needs/error_m") + number(&said, "/known_m") <= tolerance, "{said}");
    assert_eq!(number(&said, "/solves/implicit-euler"), 1.0, "the unit of what was measured");
    assert!(number(&said, "/solves/bdf2") > 0.0);

    // the file: the fitted values, and no other change
    let text = std::fs::read_to_string(folder.scene()).unwrap();
    for kept in ["# a comment that stays", "young_pa = 1e6 # so soft", "# too many", "# too short", "every_ms = 20"] {
        assert!(text.contains(kept), "{kept} is gone from {text}");
    }
    assert_eq!(text.lines().count(), TUBE.lines().count() + 1 + usize::from(text.contains("integrator")));

    // the scene that was written, beside a finer one of another rule, which errs by a tenth of that itself
    let finest = TUBE.replace("segments = 64", "segments = 128").replace("dt_ms = 1.0", "dt_ms = 0.5");
    let finest = finest.replace("every_ms = 20", "every_ms = 0.5").replace("sleep = false", "integrator = \"bdf2\"");
    holds(&folder, &finest, tolerance);
}

/// Whether the first probe of a scene that was written stays within 1.1 tolerances of where a finer scene has it.
fn holds(written: &Folder, finest: &str, tolerance: f64) {
    let fine = samples(&Folder::with(finest).lockstep(&["--seconds", "0.6"]));
    let coarse = samples(&written.lockstep(&["--seconds", "0.6"]));
    assert!(coarse.len() > 8, "{coarse:?}");
    for at in coarse.iter().filter(|at| at[0] < fine[fine.len() - 1][0]) {
        let after = fine.partition_point(|there| there[0] < at[0]).max(1);
        let [a, b] = [fine[after - 1], fine[after]];
        let share = (at[0] - a[0]) / (b[0] - a[0]);
        let apart = (1..4).map(|k| (at[k] - a[k] - share * (b[k] - a[k])).powi(2)).sum::<f64>().sqrt();
        assert!(apart < 1.1 * tolerance, "{apart} m at {} s", at[0]);
    }
}

#[test]
fn a_tolerance_that_cannot_be_met_says_the_best_reached_and_what_limits_it() {
    let folder = Folder::with(TUBE);
    let coarse = ["--set", "object.tube.segments=4", "--set", "object.tube.dt_ms=20"];
    let (code, said, errors) =
        fit(folder.scene(), &[&["--tolerance", "1e-9", "--seconds", "0.2"], &coarse[..]].concat());
    assert_eq!((code, &said), (1, &Value::Null), "{errors}");
    assert!(errors.contains("the least error reached is") && errors.contains("the limit is"), "{errors}");
}

/// A cord between two nails that swings to where it hangs.
const CORD: &str = r#"
[[object]]
name = "cord"
model = "tube"
path_m = [[0, 0, 0], [0.1, 0, -0.22], [0.2, 0, -0.05], [0.3, 0, 0]]
radius_m = 0.001
young_pa = 1e5
density_kg_m3 = 1000
damping_per_s = 10
pin = ["start", "end"]
segments = 24
dt_ms = 2.0
self_contact = false
"#;

#[test]
fn simpler_models_are_named_where_they_would_do() {
    let folder = Folder::with(&format!(
        "{CORD}{}",
        r#"
[[object]]
name = "ball"
model = "rigid"
shape = "ball"
radius_m = 0.05
position_m = [3, 0, 0]
velocity_m_s = [0, 0, 4]
dt_ms = 1.0

[[object]]
name = "block"
model = "rigid"
shape = "box"
half_extents_m = [0.1, 0.1, 0.1]
position_m = [-3, 0, -0.9]
dt_ms = 5.0

[[object]]
name = "floor"
model = "rigid"
shape = "plane"
position_m = [0, 0, -1]
"#
    ));
    let (code, said, errors) = fit(folder.scene(), &["--tolerance", "1e-2", "--seconds", "0.5"]);
    assert_eq!(code, 0, "{errors}");
    let notes = said["notes"].as_array().unwrap();
    let told = |start: &str| notes.iter().any(|note| note.as_str().unwrap().starts_with(start));
    assert!(told("torsion and bending of `cord`"), "{notes:?}");
    assert!(told("`ball` touches nothing"), "{notes:?}");
    assert!(told("`block` does not move"), "{notes:?}");
    let word =
        |name: &str| said["objects"].as_array().unwrap().iter().find(|o| o["name"] == name).unwrap()["simpler"].clone();
    assert_eq!(["cord", "ball", "block"].map(word), ["rope", "flight: no solver", "fixed: no agent"]);
    let table = metachron(&["fit", folder.scene(), "--tolerance", "1e-2", "--seconds", "0.1", "-q"]);
    let table = String::from_utf8_lossy(&table.stdout).into_owned();
    assert!(table.contains("simpler") && table.contains("fixed: no agent"), "{table}");
}

#[test]
fn a_tube_that_hangs_as_a_rope_does_is_written_as_one_where_that_is_cheaper_and_still_holds() {
    let probe =
        "[[probe]]\nobject = \"cord\"\nat = 0.5\nevery_ms = 10\n[machine.step.rope]\nunit_us = 0.01\nbase_us = 0.1\n";
    let scene = format!("{CORD}{probe}");
    let folder = Folder::with(&scene);
    let (code, said, errors) = fit(folder.scene(), &["--tolerance", "1e-2", "--seconds", "0.6", "--write"]);
    assert_eq!(code, 0, "{errors}");
    let [pays, needs] = ["pays", "needs"].map(|side| &said["objects"][0][side]);
    assert_eq!((pays["model"].as_str(), needs["model"].as_str()), (Some("tube"), Some("rope")), "{said}");
    assert!(number(&said, "/needs/error_m") + number(&said, "/known_m") <= 1e-2, "{said}");
    let text = std::fs::read_to_string(folder.scene()).unwrap();
    assert!(text.contains("model = \"rope\"") && !text.contains("self_contact") && !text.contains("pin ="), "{text}");
    let fine = scene.replace("segments = 24", "segments = 96\nintegrator = \"bdf2\"");
    holds(&folder, &fine.replace("dt_ms = 2.0", "dt_ms = 0.25").replace("every_ms = 10", "every_ms = 0.25"), 1e-2);
}

#[test]
fn a_tool_that_meets_nobody_takes_the_longest_steps() {
    let tool = "[[object]]\nname = \"tool\"\nmodel = \"instrument\"\nrate_hz = 200\n\
                keyframe = [{ tip_m = [0, 1, 0] }, { at_s = 0.5, tip_m = [0.5, 1, 0] }]\n";
    let folder = Folder::with(&format!("{TUBE}{tool}"));
    let (code, said, errors) = fit(folder.scene(), &["--tolerance", "5e-3", "--seconds", "0.4", "--write"]);
    assert_eq!(code, 0, "{errors}");
    let [pays, needs] = ["pays", "needs"].map(|side| &said["objects"][1][side]);
    assert_eq!(pays["model"].as_str(), Some("tool"));
    assert!(number(needs, "/dt_ms") >= 30.0 && number(needs, "/ms_per_s") < 0.2 * number(pays, "/ms_per_s"), "{said}");
    let report = folder.lockstep(&["--seconds", "0.4"]);
    assert_eq!(number(agent(&report, "tool"), "/dt_ms"), number(needs, "/dt_ms"));
}

#[test]
fn what_cannot_be_fitted_is_refused_with_a_sentence() {
    let folder = Folder::with(TUBE);
    for (arguments, sentence) in [
        (&["--tolerance", "0"][..], "expected a length above zero"),
        (&["--tolerance", "-1e-3"], "expected a length above zero"),
        (&["--tolerance", "nan"], "expected a length above zero"),
        (&["--tolerance", "1e-3", "--probe", "tbe"], "is not a moving object"),
    ] {
        let (code, _, errors) = fit(folder.scene(), arguments);
        assert!(code == 2 && errors.contains(sentence), "{arguments:?}: {code}, {errors}");
    }
    let (code, _, errors) = fit("pendulum", &["--tolerance", "1e-3", "--write"]);
    assert!(code == 2 && errors.contains("is a built-in scene"), "{code}, {errors}");
    let (code, _, errors) = fit(Folder::with("").scene(), &["--tolerance", "1e-3"]);
    assert!(code == 2 && errors.contains("no object moves"), "{code}, {errors}");
}

/// The tube of [`TUBE`] let swing, with ranges to choose from, and a tolerance.
fn holding(tolerance: &str, more: &str) -> Folder {
    let keys = format!("eps_m = [0.004, 0.12]\ndt_ms = [0.5, 16.0]\n{more}");
    let tolerance = if tolerance.is_empty() { String::new() } else { format!("tolerance_m = {tolerance}\n") };
    let text = TUBE.replace("segments = 64   # too many\n", &tolerance);
    Folder::with(
        &text.replace("dt_ms = 1.0     # too short\n", &keys).replace("damping_per_s = 6", "damping_per_s = 0.5"),
    )
}

#[test]
fn an_object_that_holds_an_error_takes_no_more_than_that_needs() {
    let folder = holding("4e-3", "hold = \"error\"\n");
    let report = folder.lockstep(&["--seconds", "12"]);
    let held = agent(&report, "tube");
    assert!(number(held, "/residual_m") <= 4e-3, "{held}");
    assert!(number(held, "/drift_m") <= number(held, "/residual_m"), "{held}");
    assert_eq!(number(held, "/tolerance_m"), 4e-3);
    assert!(held["rests"] != "finest", "{held}");
    // the finest of its ranges would be 24000 steps of 125 segments
    assert!(number(held, "/steps") < 12_000.0, "{held}");
    assert!(number(held, "/eps_m") > 0.008, "{held}");
    let again = folder.lockstep(&["--seconds", "12"]);
    assert_eq!(report["state_hash"], again["state_hash"]);
}

#[test]
fn an_error_out_of_reach_is_held_as_well_as_can_be_and_told() {
    let folder = holding("1e-9", "hold = \"error\"\n");
    let report = folder.lockstep(&["--seconds", "6"]);
    let held = agent(&report, "tube");
    assert_eq!((held["rests"].as_str(), number(held, "/dt_ms"), number(held, "/eps_m")), (Some("finest"), 0.5, 0.004));
    let done = metachron(&["run", folder.scene(), "--headless", "--executor", "lockstep", "--seconds", "6"]);
    let said = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    assert!(said.contains("`tube` cannot meet"), "{said}");
}

#[test]
fn an_error_that_cannot_be_held_is_refused_on_its_line() {
    for (folder, key, sentence) in [
        (holding("", "hold = \"error\"\n"), "hold = \"error\"", "`tolerance_m` is missing"),
        (holding("1e-3", "hold = \"rate\"\n"), "tolerance_m = 1e-3", "contradicts"),
        (holding("-1", "hold = \"error\"\n"), "tolerance_m = -1", "expected a number from"),
        (Folder::with(&TUBE.replace("sleep = false", "tolerance_m = 1e-3")), "tolerance_m = 1e-3", "cannot be held"),
    ] {
        let done = metachron(&["check", folder.scene()]);
        let said = unwrapped(&done);
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains(sentence) && said.contains(key), "{key}: {said}");
    }
}

/// The output of a command, without the line breaks and the frame of its picture.
fn unwrapped(done: &std::process::Output) -> String {
    let said = String::from_utf8_lossy(&done.stderr).into_owned() + &String::from_utf8_lossy(&done.stdout);
    said.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

#[test]
fn a_step_past_the_limit_of_an_explicit_integrator_is_told_before_the_run() {
    // every implicit integrator takes the step that explicit ones refuse
    for (integrator, refused) in [
        ("symplectic-euler", true),
        ("xpbd", true),
        ("implicit-euler", false),
        ("bdf2", false),
        ("energy-momentum", false),
    ] {
        let integrator = format!("integrator = \"{integrator}\"\n");
        let text = TUBE.replace("dt_ms = 1.0 ", "dt_ms = 20.0 ").replace("sleep = false", &integrator);
        let folder = Folder::with(&text);
        let done = metachron(&["check", folder.scene()]);
        let said = unwrapped(&done);
        assert_eq!(done.status.code(), Some(if refused { 2 } else { 0 }), "{integrator}: {said}");
        if refused {
            assert!(said.contains("stable for substeps up to") && said.contains("an implicit integrator"), "{said}");
        }
    }
}

#[test]
fn no_more_runs_are_made_than_are_asked_for() {
    let folder = Folder::with(TUBE);
    let fixed = ["--tolerance", "5e-3", "--seconds", "0.2", "--runs"];
    let (code, said, errors) = fit(folder.scene(), &[&fixed[..], &["14"]].concat());
    assert!(code == 0 && number(&said, "/runs") <= 14.0, "{said} {errors}");
    let (code, _, errors) = fit(folder.scene(), &[&fixed[..], &["3"]].concat());
    assert!(code == 1 && errors.contains("3 runs are too few"), "{errors}");
}
