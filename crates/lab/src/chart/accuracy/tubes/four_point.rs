//! Four-point bending: a beam on two supports with two loads between them, against beam theory with shear.

use crate::chart::accuracy::{Benchmark, Case, Play, metre, reference_tube};
use crate::chart::stability::common::dead_load;
use glam::DVec3;
use metachron_models::rod::TubeSpec;

/// The benchmark.
pub(crate) struct FourPoint;

/// Distances of the loads from the supports, metres of 1 m.
const PLACES: [(&str, f64); 2] = [("a = L/4", 0.25), ("a = L/8", 0.125)];
/// Deflection in the middle, metres: the theory's relative error is its square over that of the radius, 1e-7.
const DEFLECTION_M: f64 = 1e-5;
const SECONDS: f64 = 4.0;

impl Benchmark for FourPoint {
    const NAME: &'static str = "four-point";
    const TITLE: &'static str = "Four-point bending, at rest after 4 s";
    const ERROR: &'static str = "error of the deflection / deflection";

    fn cases(quick: bool) -> Vec<Case> {
        Case::pulled(&PLACES.map(|(name, _)| name), quick)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, a) = PLACES.into_iter().find(|(name, _)| *name == case.case)?;
        let spec = TubeSpec { damping_per_s: 12.0, pin: [true, true], ..reference_tube(1e7, metre()) };
        // P a (3 L² − 4 a²)/24 EI, and P a/GA of shear
        let softness = a * (3.0 - 4.0 * a * a) / (24.0 * spec.section.ei_n_m2) + a / spec.section.ga_n;
        let load = DVec3::NEG_Z * (DEFLECTION_M / softness);
        let loads = [dead_load(a, load), dead_load(1.0 - a, load)];
        let mut play = Play::new(spec, case)?;
        let sound = play.run(SECONDS, &loads);
        let error = (-play.point(0.5).z / DEFLECTION_M - 1.0).abs();
        sound.then_some((play, error))
    }
}
