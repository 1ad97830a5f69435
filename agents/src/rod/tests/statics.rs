//! Rest shapes against references computed with independent codes.

use super::*;
use glam::DVec3;

fn reference(file: &str) -> serde_json::Value {
    let path = format!("{}/../tests/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The tip of the clamped reference tube after it came to rest under gravity.
fn hanging_tip(young_pa: f64, segments: usize, dt_ms: f64) -> DVec3 {
    let mut spec = reference_spec(young_pa, segments);
    spec.clamp = [true, false];
    spec.gravity = DVec3::NEG_Z * 9.81;
    spec.damping_per_s = 6.0;
    let mut tube = Tube::new(spec).unwrap();
    run(&mut tube, dt_ms, 8.0);
    *tube.state().x.last().unwrap()
}

fn tip_error(case: &str, young_pa: f64, segments: usize, dt_ms: f64) -> f64 {
    let file = reference("cosserat_tube.json");
    let answer = &file["cases"][case]["cosserat"][0];
    assert_eq!(answer["law"], "simo_reissner");
    let want = DVec3::new(answer["x_tip"].as_f64().unwrap(), 0.0, answer["z_tip"].as_f64().unwrap());
    (hanging_tip(young_pa, segments, dt_ms) - want).length()
}

#[test]
fn a_clamped_tube_hangs_as_the_reference_does() {
    for (case, young_pa) in [("soft", 1e6), ("firm", 1e7)] {
        let error = tip_error(case, young_pa, 64, 10.0);
        assert!(error <= 5e-4, "{case}: {error}"); // the bound; 3.8e-4 and less is the static floor of 64 segments
    }
}

#[test]
fn the_hanging_tip_converges_with_second_order() {
    let errors: Vec<f64> = [16, 32, 64, 128].iter().map(|&n| tip_error("soft", 1e6, n, 10.0)).collect();
    let order = (errors[0] / errors[3]).log2() / 3.0;
    assert!(order >= 1.9, "order {order} of {errors:?}");
}

#[test]
fn a_tube_held_at_its_end_moves_as_the_mirror_image_of_one_held_at_its_start() {
    for clamped in [false, true] {
        let swung = |ends: [bool; 2]| {
            let mut spec = reference_spec(1e6, 16);
            (spec.clamp, spec.pin) = if clamped { (ends, [false; 2]) } else { ([false; 2], ends) };
            spec.gravity = DVec3::NEG_Z * 9.81;
            let mut tube = Tube::new(spec).unwrap();
            run(&mut tube, 5.0, 0.3);
            tube.state().x.clone()
        };
        let (start, end) = (swung([true, false]), swung([false, true]));
        for (a, b) in start.iter().zip(end.iter().rev()) {
            let mirrored = DVec3::new(1.0 - b.x, b.y, b.z);
            assert!(a.distance(mirrored) < 1e-9, "clamped {clamped}: {a} and {mirrored}"); // elimination runs the other way
        }
    }
}

#[test]
fn a_tube_clamped_at_both_ends_sags_evenly() {
    let mut spec = reference_spec(1e6, 32);
    (spec.clamp, spec.gravity, spec.damping_per_s) = ([true, true], DVec3::NEG_Z * 9.81, 6.0);
    let mut tube = Tube::new(spec).unwrap();
    run(&mut tube, 10.0, 6.0);
    let mut snapshot = crate::Snapshot::default();
    crate::Agent::write_snapshot(&tube, &mut snapshot);
    let at = |share: f64| snapshot.body.probe(share).unwrap().0;
    assert_eq!((at(0.0), at(1.0)), (DVec3::ZERO, DVec3::X));
    // mirror images step by step up to rounding, which the rest does not amplify
    assert!((at(0.25).z - at(0.75).z).abs() < 1e-9, "{} is not {}", at(0.25).z, at(0.75).z);
    assert!(at(0.5).z < -0.05, "{}", at(0.5).z);
}
