//! Odd scenes, bad scenes, failures and interrupts: every one ends as the help says.

use crate::play::{Folder, agent, metachron, number, program, report_of};
use std::io::Read;
use std::process::Stdio;

const BALL: &str = "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n";

/// Two tubes that fall: one of stuff that exists, and one whose numbers cannot be computed with.
const IMPOSSIBLE: &str = "\
[world]\ngravity_m_s2 = [0, 0, -1e4]\n\
[[object]]\nname = \"impossible\"\nmodel = \"tube\"\npath_m = [[0, 0, 9e4], [1e-3, 0, 9e4], [2e-3, 1e-3, 9e4]]\nradius_m = 1e-6\n\
young_pa = 1e13\ndensity_kg_m3 = 1e-3\nsegments = 2\nrate_hz = 1\ndt_ms = 1000\npressure_pa = 1e7\n";

#[test]
fn scenes_with_nothing_that_moves_play() {
    let floor = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\n";
    for text in ["", floor] {
        let report = Folder::with(text).lockstep(&["--frames", "3"]);
        assert_eq!((report["frames"].as_u64(), report["agents"].as_array().unwrap().len()), (Some(3), 0));
        assert!(number(&report, "/cpu_s").is_sign_positive());
    }
}

#[test]
fn the_least_and_the_greatest_of_every_flag_plays() {
    let scene = Folder::with(BALL);
    for arguments in [
        ["--frames", "1", "--size", "1x1"],
        ["--frames", "2", "--size", "8192x8192"],
        ["--frames", "2", "--target-fps", "1"],
        ["--frames", "2", "--target-fps", "1000"],
        ["--seconds", "0.001", "--size", "1x8192"],
        ["--frames", "2", "--seed", "4294967295"],
    ] {
        assert!(number(&scene.lockstep(&arguments), "/frames") >= 1.0, "{arguments:?}");
    }
}

#[test]
fn extreme_tubes_stay_finite_or_are_parked() {
    let tube = |lines: &str| {
        format!(
            "[[object]]\nname = \"t\"\nmodel = \"tube\"\npath_m = [[0, 0, 1], [1, 0, 1]]\nclamp = [\"start\"]\n\
             density_kg_m3 = 1e3\n{lines}\n[[probe]]\nobject = \"t\"\n"
        )
    };
    for lines in [
        "radius_m = 0.01\nyoung_pa = 1e12\nsegments = 64",
        "radius_m = 0.01\nyoung_pa = 1\nsegments = 64",
        "radius_m = 10\nyoung_pa = 1e6\nsegments = 64",
        "radius_m = 1e-6\nyoung_pa = 1e6\nsegments = 64",
        "radius_m = 0.01\nyoung_pa = 1e6\nsegments = 2",
        "radius_m = 0.01\nyoung_pa = 1e6\nsegments = 4096",
        "radius_m = 0.01\nyoung_pa = 1e6\nrate_hz = 1\ndt_ms = 1000",
        "radius_m = 0.01\nyoung_pa = 1e6\nattach = [{ from = 0, to = 1, stiffness_n_m2 = 1e9 }]",
    ] {
        let report = Folder::with(&tube(lines)).lockstep(&["--frames", "20"]);
        let tube = agent(&report, "t");
        assert!(number(tube, "/steps") > 0.0 && number(tube, "/energy_j").is_finite(), "{lines}: {tube}");
        assert!(report["probes"][0]["position_m"].as_array().unwrap().iter().all(|x| x.is_number()), "{lines}");
    }
}

#[test]
fn an_object_that_diverges_is_parked_and_the_others_go_on() {
    let scene = Folder::with(&format!("{IMPOSSIBLE}{BALL}rate_hz = 100\n"));
    let report = scene.lockstep(&["--seconds", "10", "--target-fps", "10"]);
    let parked = agent(&report, "impossible");
    assert_eq!((parked["parked"].as_bool(), parked["state"].as_str()), (Some(true), Some("parked")), "{parked}");
    assert!(!parked["parked_reason"].as_str().unwrap().is_empty());
    assert_eq!(agent(&report, "ball")["state"], "running");
    assert!(number(agent(&report, "ball"), "/steps") >= 1000.0);
}

/// The messages of `run` and `check` about a bad scene; both must end with 2.
fn refusal(text: &str, arguments: &[&str]) -> String {
    let scene = Folder::with(text);
    let run = metachron(&[&["run", scene.scene(), "--headless", "--frames", "1"], arguments].concat());
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(2), "{said}");
    let check = metachron(&[&["check", scene.scene()], arguments].concat());
    assert_eq!(check.status.code(), Some(2), "check accepts what run refuses: {said}");
    said
}

#[test]
fn what_cannot_be_played_is_refused_by_run_and_by_check_alike() {
    let tube = "[[object]]\nname = \"t\"\nmodel = \"tube\"\nradius_m = 0.01\nyoung_pa = 1e6\ndensity_kg_m3 = 1e3\n";
    let cusp = refusal(&format!("{tube}path_m = [[0, 0, 1], [1, 0, 1], [0, 0, 1]]\n"), &[]);
    for word in ["scene.toml:8", "turns back on itself at point 1", "at most 170°"] {
        assert!(cusp.contains(word), "{word} is not in:\n{cusp}");
    }
    for (text, word) in [
        (format!("{BALL}[[probe]]\nobject = \"ball\"\nat = 1.5\n"), "1.5"),
        (format!("{BALL}[[probe]]\nobject = \"bell\"\n"), "ball"),
        (format!("{BALL}{BALL}"), "the name of another object"),
        (format!("{BALL}radius_m = 2\n"), "duplicate"),
        (format!("{BALL}name\u{0} = 1\n"), "scene.toml"),
        ("[[object]]\nname = \"\\u0007\"\nmodel = \"rigid\"\nshape = \"plane\"\n".to_owned(), "name"),
    ] {
        let said = refusal(&text, &[]);
        assert!(said.contains(word), "{word} is not in:\n{said}");
    }
    assert!(refusal(BALL, &["--set", "object.ball.radius_m=nan"]).contains("NaN"));
    assert!(refusal(BALL, &["--set", "object.ball.radius_m"]).contains("KEY=VALUE"));
}

#[test]
fn names_of_any_script_are_names() {
    let scene = Folder::with(&BALL.replace("ball\"\nmodel", "кишка 🐍 \\\"x\\\"\"\nmodel"));
    assert!(number(agent(&scene.lockstep(&["--frames", "2"]), "кишка 🐍 \"x\""), "/steps") > 0.0);
}

#[test]
fn a_thousand_agents_play_in_lockstep() {
    let object =
        |k: u32| BALL.replace("\"ball\"\nmodel", &format!("\"b{k}\"\nmodel")) + &format!("position_m = [{k}, 0, 0]\n");
    let report = Folder::with(&(0..1000).map(object).collect::<String>()).lockstep(&["--frames", "1"]);
    assert_eq!(report["agents"].as_array().unwrap().len(), 1000);
}

#[test]
fn a_missed_goal_ends_with_four_and_a_kept_one_with_nought() {
    let scene = Folder::with(BALL);
    for (goal, code) in [("frames<5", 4), ("frames>5", 0), ("agents.ball.rate_hz<1", 0), ("agents.bell.rate_hz<1", 2)] {
        let fixed = ["run", scene.scene(), "--headless", "--executor", "lockstep", "--frames", "3", "-q"];
        let done = metachron(&[&fixed[..], &["--fail-on", goal]].concat());
        assert_eq!(done.status.code(), Some(code), "{goal}: {}", String::from_utf8_lossy(&done.stderr));
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_with_130_and_leaves_the_report() {
    let scene = Folder::with(BALL);
    let report = scene.file("report.json");
    let mut child = program()
        .args(["run", scene.scene(), "--headless", "--executor", "threads", "--size", "16x16", "--seconds", "1e6"])
        .args(["--frames-csv", &scene.file("frames.csv"), "--report", &report])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // the agents' threads stand once Ctrl-C is caught: the handler is set before the run begins
    let tasks = format!("/proc/{}/task", child.id());
    while std::fs::read_dir(&tasks).is_ok_and(|list| list.count() < 3) {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    // the shell's own kill: not every system has the program
    let interrupt = format!("kill -INT {}", child.id());
    let killed = std::process::Command::new("sh").args(["-c", &interrupt]).status().unwrap();
    assert!(killed.success());
    let code = child.wait().unwrap().code();
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(code, Some(130), "{said}");
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert!(number(&report, "/frames") >= 1.0);
    assert!(std::fs::read_to_string(scene.file("frames.csv")).unwrap().lines().count() >= 2);
}

#[test]
fn a_run_on_threads_of_one_pixel_plays() {
    let scene = Folder::with(BALL);
    let report = report_of(scene.scene(), &["--executor", "threads", "--frames", "2", "--size", "1x1"]);
    assert_eq!(report["frames"], 2);
}
