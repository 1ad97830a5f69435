//! Physics through scene file, runtime and report.

use crate::play::{Folder, agent, lockstep, number, point, reference};
use serde_json::Value;

/// The reference cantilever as a scene.
fn cantilever(young_pa: f64, segments: u32) -> Folder {
    Folder::with(&format!(
        "[[object]]\nname = \"rod\"\nmodel = \"tube\"\npath_m = [[0, 0, 0], [1, 0, 0]]\nradius_m = 0.015\nwall_m = 0.002\n\
         young_pa = {young_pa:e}\npoisson = 0.45\ndensity_kg_m3 = 1050\nclamp = [\"start\"]\nsegments = {segments}\n\
         damping_per_s = 6\ndt_ms = 10\nrate_hz = 100\nsleep = false\n[[probe]]\nobject = \"rod\"\n"
    ))
}

/// Distance of the tip from the reference, as a share of the length, after 12 s: e⁻³⁶ of the motion is left.
fn tip_error(reference: &Value, young_pa: f64, segments: u32) -> f64 {
    let report = cantilever(young_pa, segments).lockstep(&["--seconds", "12"]);
    let rod = agent(&report, "rod");
    assert_eq!((number(rod, "/dt_ms"), number(rod, "/dropped_ms")), (10.0, 0.0));
    let [x, y, z] = point(&report, "/probes/0/position_m");
    let [dx, dz] = [x - number(reference, "/x_tip"), z - number(reference, "/z_tip")];
    dx.hypot(dz).hypot(y)
}

#[test]
fn the_reference_cantilever_comes_to_rest_at_the_reference_with_second_order() {
    let all = reference("cosserat_tube.json");
    for (case, young_pa) in [("soft", 1e6), ("firm", 1e7)] {
        let laws = all["cases"][case]["cosserat"].as_array().unwrap();
        let law = laws.iter().find(|l| l["law"] == "simo_reissner").unwrap();
        let errors = [16, 32, 64, 128].map(|n| tip_error(law, young_pa, n));
        assert!(errors[2] <= 5e-4, "{case}: {errors:?}"); // the bound of the project for 64 segments
        // least squares through (ln N, ln error) at ln N = -3/2, -1/2, 1/2, 3/2 of ln 2
        let log = errors.map(f64::log2);
        let order = (1.5 * (log[0] - log[3]) + 0.5 * (log[1] - log[2])) / 5.0;
        assert!(order >= 1.9, "{case}: order {order}, errors {errors:?}");
    }
}

/// A ball of 0.1 m radius with these lines, and a probe with a sample every 100 ms; steps of 5 ms are whole nanoseconds.
fn ball(lines: &str) -> String {
    format!(
        "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nrate_hz = 200\ndt_ms = 5\n{lines}\n\
         [[probe]]\nobject = \"ball\"\nevery_ms = 100\n"
    )
}

const FLOOR: &str = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nrestitution = 1\n";

#[test]
fn a_thrown_ball_is_where_the_closed_form_says_at_every_sample() {
    let scene = Folder::with(&ball("position_m = [0, 0, 2]\nvelocity_m_s = [1, -2, 3]"));
    let report = scene.lockstep(&["--seconds", "1", "--target-fps", "50"]);
    let samples = report["probes"][0]["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 11);
    for (k, sample) in samples.iter().enumerate() {
        let t = 0.1 * k as f64;
        let place = [t, t, -2.0 * t, 2.0 + 3.0 * t - 4.905 * t * t];
        for (axis, expected) in place.into_iter().enumerate() {
            let found = number(sample, &format!("/{axis}"));
            assert!((found - expected).abs() < 1e-9, "sample {k}, {axis}: {found} for {expected}");
        }
    }
    let velocity = point(&report, "/probes/0/velocity_m_s");
    assert!((velocity[2] - (3.0 - 9.81)).abs() < 1e-9, "{velocity:?}");
}

#[test]
fn a_ball_of_restitution_one_comes_back_to_where_it_fell_from() {
    let scene = Folder::with(&(ball("position_m = [0, 0, 1.1]\nrestitution = 1") + FLOOR));
    // it falls 1 m in sqrt(2/g) = 0.4515 s and is back after twice that: 0.9030 s
    let report = scene.lockstep(&["--seconds", "0.905", "--target-fps", "200"]);
    let height = point(&report, "/probes/0/position_m")[2];
    let energy = number(agent(&report, "ball"), "/energy_j") / number(&ball_energy(&scene), "/energy_j");
    // an impact is met within a step of 5 ms: at 4.4 m/s that is up to 22 mm of height, and as much of the energy
    assert!((height - 1.1).abs() < 0.022, "{height} m");
    assert!((energy - 1.0).abs() < 0.022, "{energy} of the energy");
}

/// The ball's entry after one frame: before anything was lost.
fn ball_energy(scene: &Folder) -> Value {
    agent(&scene.lockstep(&["--frames", "1"]), "ball").clone()
}

#[test]
fn a_ball_at_rest_takes_no_steps_and_its_rest_is_counted() {
    let scene = Folder::with(&(ball("position_m = [0, 0, 0.1]") + FLOOR));
    let report = scene.lockstep(&["--seconds", "20", "--target-fps", "20"]);
    let at_rest = agent(&report, "ball");
    assert_eq!(at_rest["state"], "resting");
    assert!(number(at_rest, "/steps") < 400.0, "{at_rest}"); // 2 s of 20
    let (slept, awake) = (number(at_rest, "/rested_ms"), 5.0 * number(at_rest, "/steps"));
    assert!((slept + awake - 20_000.0).abs() < 10.0, "{slept} ms asleep, {awake} ms awake"); // two steps
    assert_eq!(report["probes"][0]["samples"].as_array().unwrap().len(), 201, "a sample every 100 ms, asleep or not");
}

#[test]
fn a_ball_that_may_not_sleep_keeps_stepping() {
    let scene = Folder::with(&(ball("position_m = [0, 0, 0.1]\nsleep = false") + FLOOR));
    let report = scene.lockstep(&["--seconds", "20", "--target-fps", "20"]);
    let awake = agent(&report, "ball");
    assert_eq!((awake["state"].as_str(), number(awake, "/rested_ms")), (Some("running"), 0.0));
    assert!((number(awake, "/steps") - 4000.0).abs() <= 1.0, "{awake}"); // one for the ends of the interval
}

#[test]
fn the_instrument_of_the_tube_scene_grasps_pulls_lets_go_and_grasps_again() {
    let held_at = |seconds: &str| {
        let report = lockstep("tube", &["--seconds", seconds]);
        let grasp = &report["couplings"][0];
        assert_eq!(
            (&grasp["a"], &grasp["b"], &grasp["kind"]),
            (&"grasper".into(), &"intestine".into(), &"grasp".into())
        );
        assert!(number(&agent(&report, "intestine").clone(), "/rate_hz") >= 240.0);
        (number(grasp, "/contacts"), number(grasp, "/force_n"), number(grasp, "/force_max_n"))
    };
    // by the scene's keyframes: shut from 1.9 s, pulling until 6 s, open from 6.2 s, again from 8 s
    let (holds, force, most) = held_at("5");
    assert!(holds == 1.0 && force > 0.01 && most >= force, "{holds}, {force} N, {most} N");
    assert_eq!(held_at("7.2"), (0.0, 0.0, most), "let go, and the greatest force is remembered");
    assert_eq!(held_at("12").0, 1.0, "the script repeats");
}
