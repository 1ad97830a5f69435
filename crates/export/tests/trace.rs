//! A trace is read back: slices against the steps that were made, lanes that do not overlap, frames that hold their parts.

use metachron_core::SimSpan;
use metachron_export::{Frame, PerfettoFile};
use metachron_geometry::Solid;
use metachron_world::{Rigid, Scene, Tube, World, kinds::ExecutorKind};
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::Duration;

const FRAMES: u64 = 40;
const MILLIS: u64 = 20;

/// Plays 0.8 s: a ball falls on a tube, which lies on the floor; another object joins on the way.
fn trace() -> (World, Vec<Value>) {
    let ball = Rigid::ball(0.05).at([0.0, 0.0, 0.2]).rate_hz(500.0);
    let tube = Tube::along(&[[-0.2, 0.0, 0.02], [0.2, 0.0, 0.02]]).radius_m(0.01).segments(6);
    let parts = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("tube", tube);
    let world = World::start(&parts.build().unwrap(), ExecutorKind::Lockstep).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trace.json");
    let mut file = PerfettoFile::create(&path, &world).unwrap();
    for k in 0..FRAMES {
        if k == 10 {
            world.add("late", Rigid::ball(0.05).at([1.0, 0.0, 0.3])).unwrap();
        }
        world.advance(SimSpan::from_millis(MILLIS));
        let work = Duration::from_millis(5);
        let parts = vec![("cull", Duration::from_millis(1)), ("draw", Duration::from_millis(9))];
        let frame = Frame { begun: world.now() - work, work, parts, counters: vec![("n", 2.5)] };
        file.write(Some(&frame)).unwrap();
    }
    file.finish().unwrap();
    assert_eq!((file.lost(), file.is_full()), (0, false));
    (world, serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap())
}

fn number(event: &Value, key: &str) -> f64 {
    event[key].as_f64().unwrap_or_else(|| panic!("{key} of {event}"))
}

#[test]
fn a_trace_has_a_lane_of_every_step_an_object_made_and_the_frames() {
    let (world, events) = trace();
    let of = |phase: &str| events.iter().filter(|one| one["ph"] == phase).collect::<Vec<_>>();
    let lanes: BTreeMap<u64, &str> = of("M")
        .into_iter()
        .filter(|one| one["name"] == "thread_name" && one["pid"] == 2)
        .map(|one| (one["tid"].as_u64().unwrap(), one["args"]["name"].as_str().unwrap()))
        .collect();
    assert_eq!(lanes.values().copied().collect::<Vec<_>>(), ["ball", "tube", "late"]);
    for (lane, name) in &lanes {
        let slices: Vec<_> = of("X").into_iter().filter(|one| one["pid"] == 2 && one["tid"] == *lane).collect();
        let steps: Vec<_> = slices.iter().filter(|one| one["name"] == "step").collect();
        let agent = &world.agents()[*lane as usize - 1];
        let (made, lived_s) = (agent.steps(), agent.latest().time.as_secs_f64() - number(&steps[0]["args"], "time_s"));
        // of a step of a cluster its members may make several, and steps made alone to catch up with a leader are no turns
        assert!(steps.len() as u64 <= made, "{name}: {} of {made}", steps.len());
        let stepped_s: f64 = steps[1..].iter().map(|one| 1e-3 * number(&one["args"], "dt_ms")).sum();
        assert!(stepped_s > 0.95 * lived_s - 0.01 && stepped_s < lived_s + 1e-6, "{name}: {stepped_s} of {lived_s} s");
        let last = steps.last().unwrap();
        assert!((number(&last["args"], "time_s") - agent.latest().time.as_secs_f64()).abs() < 0.011, "{name}: {last}");
        for pair in slices.windows(2) {
            let end = number(pair[0], "ts") + number(pair[0], "dur");
            assert!(end <= number(pair[1], "ts") + 1e-6, "{name}: {} {}", pair[0], pair[1]);
        }
        assert!(steps.iter().all(|one| number(&one["args"], "dt_ms") > 0.0 && number(&one["args"], "late_ms") >= 0.0));
    }
    let led = of("X").into_iter().filter(|one| one["args"]["led_by"] == "ball").count();
    assert!(led > 10, "the ball leads the tube in {led} turns");
    let eps: Vec<_> = of("X").into_iter().filter(|one| !one["args"]["eps_m"].is_null()).collect();
    assert!(!eps.is_empty() && eps.iter().all(|one| one["tid"] == 2), "only the tube has ε");
}

#[test]
fn a_trace_has_events_as_instants_and_frames_that_hold_their_parts() {
    let (_, events) = trace();
    let instants: Vec<_> = events.iter().filter(|one| one["ph"] == "i").collect();
    let touch = instants.iter().find(|one| one["name"] == "contact_began" && one["tid"] == 1).unwrap();
    assert_eq!(touch["args"]["with"], "tube");
    // ½·g·t² = 0.12 m, to a step or two
    assert!((number(touch, "ts") * 1e-6 - 0.156).abs() < 0.01, "{touch}");
    let frames: Vec<_> = events.iter().filter(|one| one["ph"] == "X" && one["pid"] == 1).collect();
    assert_eq!(frames.iter().filter(|one| one["name"] == "frame").count() as u64, FRAMES);
    for part in frames.chunks(3) {
        let [frame, cull, draw] = part else { panic!("a frame and its parts: {part:?}") };
        let end = |one: &Value| number(one, "ts") + number(one, "dur");
        assert_eq!((&cull["name"], number(cull, "dur")), (&Value::from("cull"), 1000.0));
        assert!(number(frame, "ts") <= number(cull, "ts") && (end(cull) - number(draw, "ts")).abs() < 1e-6);
        assert!(end(draw) <= end(frame) + 1e-6, "{draw} in {frame}");
    }
    let curve: Vec<_> = events.iter().filter(|one| one["ph"] == "C").collect();
    assert!(curve.len() as u64 == FRAMES && curve.iter().all(|one| one["args"]["value"] == 2.5));
}
