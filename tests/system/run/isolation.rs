//! The effect of one agent's trouble on the others: none.

use crate::play::{Folder, agent, lockstep, metachron, number, report_of};
use serde_json::Value;

/// Four agents of 0.4 ms a step at 240 Hz and one of `cost_us`.
fn company(cost_us: u32) -> Folder {
    let object = |name: &str, cost: u32| {
        format!("[[object]]\nname = \"{name}\"\nmodel = \"synthetic\"\ncost_us = {cost}\nrate_hz = 240\n")
    };
    let others = ["a", "b", "c", "d"].map(|name| object(name, 400)).concat();
    Folder::with(&(others + &object("hog", cost_us)))
}

/// The greatest relative change of the rate of an agent that is not overloaded.
fn change(before: &Value, after: &Value) -> f64 {
    let rate = |report: &Value, name: &str| number(agent(report, name), "/rate_hz");
    ["a", "b", "c", "d"].map(|n| (rate(after, n) / rate(before, n) - 1.0).abs()).into_iter().fold(0.0, f64::max)
}

#[test]
fn an_agent_of_ten_times_the_cost_leaves_the_others_their_rates_in_lockstep() {
    let [before, after] = [2_000, 20_000].map(|cost| company(cost).lockstep(&["--seconds", "5"]));
    assert!(change(&before, &after) < 0.01);
    let hog = agent(&after, "hog");
    assert!(number(hog, "/rate_hz") < 60.0 && number(hog, "/dropped_ms") > 3_000.0, "{hog}"); // 1/20 ms, 5 s of it
}

#[test]
fn an_agent_of_ten_times_the_cost_leaves_the_others_their_rates_on_threads() {
    // other programs on the machine show in a run: of three the best counts
    let run = |cost| company(cost).run_on_threads();
    let best = (0..3).map(|_| change(&run(2_000), &run(20_000))).fold(f64::MAX, f64::min);
    assert!(best < 0.05, "{best}");
}

impl Folder {
    fn run_on_threads(&self) -> Value {
        report_of(self.scene(), &["--executor", "threads", "--seconds", "0.5", "--size", "16x16"])
    }
}

#[test]
fn a_run_on_threads_steps_every_agent_at_real_rates() {
    let report = report_of("pendulum", &["--executor", "threads", "--seconds", "0.5", "--size", "64x36"]);
    for name in ["tube", "ball", "box"] {
        assert!(number(agent(&report, name), "/rate_hz") > 0.0);
        assert!(number(agent(&report, name), "/steps") > 1.0);
    }
    assert!(number(&report, "/cpu_s") > 0.0);
    assert!(number(&report, "/sim_s") >= 0.5);
}

#[test]
fn the_first_line_says_what_an_agent_gave_up_and_at_the_free_pace_none_gives_up_anything() {
    let scene = company(9000);
    let run = |executor: &str, pace: &str| {
        let (report, fixed) = (scene.file("report.json"), ["run", scene.scene(), "--headless", "--frames", "31"]);
        let asked = ["--executor", executor, "--pace", pace, "--set", "target.frame_hz=60", "--report", &report];
        let done = metachron(&[&fixed[..], &asked].concat());
        assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
        let line = String::from_utf8(done.stdout).unwrap().lines().next().unwrap_or_default().to_owned();
        (line, serde_json::from_slice::<Value>(&std::fs::read(report).unwrap()).unwrap())
    };
    let (line, late) = run("lockstep", "real-time");
    let hog = |report: &Value, pointer: &str| number(agent(report, "hog"), pointer);
    assert!(line.contains("1 of 5 agents gave up time, most of all hog"), "{line}");
    // of 31 frames at 60 Hz it lives only the share for which steps of 9 ms have time
    assert!(hog(&late, "/given_up_s") > 0.2 && hog(&late, "/lived_s") < 0.3, "{late}");
    for executor in ["lockstep", "threads", "pool"] {
        let (line, report) = run(executor, "free");
        assert!(line.ends_with(&format!("({executor} at the free pace, adaptive)")), "{line}");
        assert_eq!(report["pace"], "free");
        for name in ["a", "b", "c", "d", "hog"] {
            let one = agent(&report, name);
            assert_eq!((number(one, "/given_up_s"), number(one, "/lengthened")), (0.0, 0.0), "{executor} {name}");
            // 31 frames of 1/60 s, the last step to its end
            assert!((124.0..126.0).contains(&number(one, "/steps")), "{executor} {name}: {one}");
        }
    }
}

/// The report without times of a real clock.
fn without_cpu(mut report: Value) -> Value {
    report.as_object_mut().unwrap().remove("cpu_s").unwrap();
    for agent in report["agents"].as_array_mut().unwrap() {
        agent.as_object_mut().unwrap().remove("cpu_s").unwrap();
    }
    report
}

#[test]
fn two_lockstep_runs_of_a_built_in_scene_give_the_same_report_to_the_last_bit() {
    for scene in ["tube", "pendulum", "yard"] {
        let run = || without_cpu(lockstep(scene, &["--frames", "60", "--set", "machine.noise=0.2"]));
        let (first, second) = (run(), run());
        assert_eq!(first["frames"], 60);
        assert!(first == second, "{scene}: {} and {}", first["state_hash"], second["state_hash"]);
    }
}

#[test]
fn another_seed_changes_what_frames_cost_but_not_what_bodies_do() {
    let scene = Folder::with(
        "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [0, 0, 1]\nn = 2\n",
    );
    let run = |seed| scene.lockstep(&["--frames", "60", "--seed", seed, "--set", "machine.noise=0.2"]);
    let (one, two) = (run("1"), run("2"));
    assert_eq!(one["state_hash"], two["state_hash"]);
    assert_ne!(one["frame_ms"]["mean"], two["frame_ms"]["mean"]);
}
