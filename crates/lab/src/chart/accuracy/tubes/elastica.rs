//! A cantilever with a load at its tip: the elastica, computed by shooting with another code (tests/reference/elastica.json).

use crate::chart::accuracy::{Benchmark, Case, Play, metre, slender_tube};
use crate::chart::stability::common::dead_load;
use glam::DVec3;
use metachron_models::rod::TubeSpec;

/// The benchmark.
pub(crate) struct Elastica;

/// P L²/EI, and the position of the tip: sideways and down, metres for a length of 1 m.
const LOADS: [(&str, f64, [f64; 2]); 3] = [
    ("PL²/EI = 1", 1.0, [0.943_566_763_716_623_1, 0.301_720_773_799_813_8]),
    ("PL²/EI = 5", 5.0, [0.612_371_639_275_570_1, 0.713_791_523_612_911_8]),
    ("PL²/EI = 10", 10.0, [0.445_004_402_246_248_76, 0.810_609_024_880_296_6]),
];
const SECONDS: f64 = 8.0;

impl Benchmark for Elastica {
    const NAME: &'static str = "elastica";
    const TITLE: &'static str = "Cantilever with a load at its tip, at rest after 8 s";
    const ERROR: &'static str = "tip error / L";

    fn cases(quick: bool) -> Vec<Case> {
        Case::pulled(&LOADS.map(|(name, ..)| name), quick)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, load, [side, down]) = LOADS.into_iter().find(|(name, ..)| *name == case.case)?;
        let spec = TubeSpec { damping_per_s: 6.0, clamp: [true, false], ..slender_tube(1e7, metre()) };
        let load_at_tip = dead_load(1.0, DVec3::NEG_Z * (load * spec.section.ei_n_m2));
        let mut play = Play::new(spec, case)?;
        let sound = play.run(SECONDS, &[load_at_tip]);
        let error = play.point(1.0).distance(DVec3::new(side, 0.0, -down));
        sound.then_some((play, error))
    }
}
