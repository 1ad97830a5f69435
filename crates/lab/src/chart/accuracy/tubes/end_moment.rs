//! A moment at the end of a straight tube: M = 2π EI/L bends it to a circle.

use crate::chart::accuracy::{Benchmark, Case, Play, metre, slender_tube};
use crate::chart::stability::common::dead_load;
use glam::DVec3;
use metachron_contact::AnchorForce;
use metachron_models::rod::TubeSpec;
use std::f64::consts::TAU;

/// The benchmark.
pub(crate) struct EndMoment;

/// Names, and the angle M L/EI by which the end is turned.
const ANGLES: [(&str, f64); 3] = [("a quarter circle", 0.25 * TAU), ("half a circle", 0.5 * TAU), ("a circle", TAU)];
/// How long the moment rises, and how long it is then constant, seconds.
const SECONDS: [f64; 2] = [3.0, 7.0];
/// Points at which the tube is compared with the circle, shares of the length.
const LOOKS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

impl Benchmark for EndMoment {
    const NAME: &'static str = "end-moment";
    const TITLE: &'static str = "A moment at the end bends a straight tube to a circle, at rest after 10 s";
    const ERROR: &'static str = "greatest distance of four points from the circle / L";

    fn cases(quick: bool) -> Vec<Case> {
        Case::pulled(&ANGLES.map(|(name, _)| name), quick)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, angle) = ANGLES.into_iter().find(|(name, _)| *name == case.case)?;
        let spec = TubeSpec { damping_per_s: 12.0, clamp: [true, false], ..slender_tube(1e8, metre()) };
        let moment = angle * spec.section.ei_n_m2;
        let mut play = Play::new(spec, case)?;
        let [rises, stays] = SECONDS;
        let mut sound = true;
        while sound && play.time_s() < rises + stays {
            let torque_n_m = DVec3::NEG_Y * (moment * (play.time_s() / rises).min(1.0));
            sound = play.run(case.dt_ms * 1e-3, &[AnchorForce { torque_n_m, ..dead_load(1.0, DVec3::ZERO) }]);
        }
        let error = LOOKS.map(|s| play.point(s).distance(circle_m(angle, s))).into_iter().fold(0.0, f64::max);
        sound.then_some((play, error))
    }
}

/// A point of a circle that leaves the origin along x and turns upwards by `angle` over one metre.
fn circle_m(angle: f64, arc_m: f64) -> DVec3 {
    let turned = angle * arc_m;
    DVec3::new(libm::sin(turned), 0.0, 1.0 - libm::cos(turned)) / angle
}
