//! Small cases of `bench contact` against closed forms, and how rows stand to a peer's.

use super::*;

fn played(stage: &Stage, seconds: f64) -> Course {
    Course::of_cluster(&mut stage.play().unwrap(), seconds).unwrap()
}

#[test]
fn a_low_tower_stands_in_both_engines_and_a_pendulum_keeps_its_energy() {
    let mut stage = rigid_scenes::tower(0.012);
    stage.bodies.truncate(3);
    let ours = played(&stage, 0.6);
    assert!(ours.bodies == 3 && ours.ms.len() == 300, "{ours:?}");
    assert!(ours.rest_m < 25e-6 && ours.drift_most_m < 1e-5 && ours.sank_m.abs() < 1e-4, "{ours:?}");
    let theirs = Course::of_plain_world(&mut stage.plain_world().unwrap(), 0.6);
    assert!(theirs.bodies == 3 && theirs.contacts > 0 && theirs.drift_most_m < 1e-2, "{theirs:?}");
    let swings = played(&rigid_scenes::pendulum(), 0.5);
    // two rods of a kilogram fall by up to 1 m: 14.7 J
    assert!(swings.made_j < 0.1 && swings.contacts == 0, "{swings:?}");
    assert!(rigid_scenes::pendulum().plain_world().is_none(), "rapier3d gets no joints");
}

#[test]
fn every_scene_is_built_and_names_are_unique() {
    for quick in [false, true] {
        let all = cases(quick);
        let mut names: Vec<_> = all.iter().map(Case::name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
        // the scene of the pile belongs to the program
        for case in all.iter().filter(|case| quick && case.scene != "pile") {
            let stage = (case.stage)().unwrap();
            assert!(stage.play().is_ok(), "{}", case.name());
        }
    }
    let unknown = chosen(cases(true), &["towers".to_owned()]).err().map(|error| error.to_string()).unwrap();
    assert!(unknown.contains("--only towers") && unknown.contains("tower, pendulum"), "{unknown}");
    assert!(chosen(cases(true), &["tower".to_owned()]).unwrap().iter().all(|case| case.scene == "tower"));
}

#[test]
fn rows_are_held_against_the_peer_s_run_of_the_same_test() {
    let course = Course { ms: vec![2.0, 4.0, 6.0], bodies: 2, ..Course::default() };
    let ours = row("chain".to_owned(), "metachron", &course);
    assert_eq!((ours.ms_per_step_p50, ours.ms_most, ours.cpu_s), (4.0, 6.0, 0.012));
    let text = r#"{"engine": "E 1", "machine": "M", "rows": [{"test": "chain", "bodies": 2, "steps": 3, "ms_p50": 1,
        "ms_p99": 2, "ms_most": 2, "cpu_s": 0.006, "landing_m": 0, "rest_m": 0, "drift_mean_m": 0, "drift_most_m": 0,
        "sank_m": 0, "made_j": 0}]}"#;
    let peers: Peers<PeerRun> = serde_json::from_str(text).unwrap();
    let both = beside(vec![ours.clone()], Some(&peers));
    assert_eq!((both.len(), both[0].over_peer, both[1].over_peer), (2, 2.0, 1.0));
    assert_eq!((both[1].engine.as_str(), both[1].machine.as_str()), ("E 1", "M"));
    let other = beside(vec![Row { test: "stack".to_owned(), ..ours }], Some(&peers));
    assert!(other.len() == 1 && other[0].over_peer.is_nan());
}
