//! MJCF models.

use crate::play::{advance, left_out, position, start};
use metachron_import::{ImportError, Imported, mjcf};
use std::path::Path;

fn import(text: &str) -> Result<Imported, ImportError> {
    mjcf(text, Path::new("."))
}

/// What MuJoCo makes of `arm.xml` (`reference.py`).
#[derive(Debug)]
struct Reference {
    joints: Vec<String>,
    moments: Vec<Moment>,
}

#[derive(Debug)]
struct Moment {
    at_s: f64,
    positions: Vec<f64>,
}

fn reference() -> Reference {
    let json: serde_json::Value = serde_json::from_str(include_str!("arm.json")).unwrap();
    let list = |value: &serde_json::Value| value.as_array().unwrap().clone();
    let moment = |value: &serde_json::Value| Moment {
        at_s: value["at_s"].as_f64().unwrap(),
        positions: list(&value["positions"]).iter().map(|q| q.as_f64().unwrap()).collect(),
    };
    Reference {
        joints: list(&json["joints"]).iter().map(|name| name.as_str().unwrap().to_owned()).collect(),
        moments: list(&json["moments"]).iter().map(moment).collect(),
    }
}

#[test]
fn an_arm_with_springs_dampers_and_a_servo_moves_as_in_mujoco() {
    let reference = reference();
    let imported = import(include_str!("arm.xml")).unwrap();
    assert_eq!(left_out(&imported), [""; 0]);
    let joints: Vec<&str> = reference.joints.iter().map(String::as_str).collect();
    let worst = |rate_hz: f64| {
        let world = start(&imported, &joints, rate_hz);
        let (mut worst, mut at_s) = (0.0_f64, 0.0);
        for moment in &reference.moments {
            advance(&world, moment.at_s - at_s);
            at_s = moment.at_s;
            for (joint, expected) in joints.iter().zip(&moment.positions) {
                worst = worst.max((position(&world, joint) - expected).abs());
            }
        }
        worst
    };
    let (coarse, fine) = (worst(1000.0), worst(2000.0));
    // joints move by up to a radian; a step of first order errs by half as much at half the step
    assert!(fine < 5e-3, "{coarse} {fine}");
    assert!(fine < 0.65 * coarse, "{coarse} {fine}");
}
