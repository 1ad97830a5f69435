//! A cantilever with a load at its tip: the elastica, computed by shooting with another code (tests/reference/elastica.json).

use super::super::stability::common::dead_load;
use super::diagram::{Benchmark, Case, Goal};
use super::play::{Play, reference_tube};
use glam::DVec3;
use metachron_agents::rod::{Integrator, TubeSpec};

/// The benchmark.
pub(in super::super) struct Elastica;

/// P L²/EI, and where the tip is: to the side and down, metres of a length of 1 m.
const LOADS: [(&str, f64, [f64; 2]); 3] = [
    ("PL²/EI = 1", 1.0, [0.943_566_763_716_623_1, 0.301_720_773_799_813_8]),
    ("PL²/EI = 5", 5.0, [0.612_371_639_275_570_1, 0.713_791_523_612_911_8]),
    ("PL²/EI = 10", 10.0, [0.445_004_402_246_248_76, 0.810_609_024_880_296_6]),
];
/// Stretch and shear are this much stiffer than the reference tube's: the elastica has neither.
const STIFFER: f64 = 1e3;
const SECONDS: f64 = 8.0;

impl Benchmark for Elastica {
    const NAME: &'static str = "elastica";
    const TITLE: &'static str = "Cantilever with a load at its tip, at rest after 8 s";
    const ERROR: &'static str = "tip error / L";

    fn cases(quick: bool) -> Vec<Case> {
        let mut list = Vec::new();
        for (case, ..) in LOADS {
            // while it is pulled a tube moves by implicit Euler, whichever method of second order it has
            let method = Integrator::ImplicitEuler.name();
            for &segments in if quick { &[8, 16][..] } else { &[8, 16, 32, 64, 128] } {
                let (case, method) = (case.to_owned(), method.to_owned());
                list.push(Case { case, method, segments, dt_ms: 10.0, substeps: 1 });
            }
        }
        list
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, load, [side, down]) = LOADS.into_iter().find(|(name, ..)| *name == case.case)?;
        let mut spec =
            TubeSpec { damping_per_s: 6.0, clamp: [true, false], ..reference_tube(1e7, vec![DVec3::ZERO, DVec3::X]) };
        (spec.section.ea_n, spec.section.ga_n) = (spec.section.ea_n * STIFFER, spec.section.ga_n * STIFFER);
        let hand = dead_load(1.0, DVec3::NEG_Z * (load * spec.section.ei_n_m2));
        let mut play = Play::new(spec, case)?;
        let sound = play.run(SECONDS, &[hand]);
        let error = play.point(1.0).distance(DVec3::new(side, 0.0, -down));
        sound.then_some((play, error))
    }

    fn goals() -> Vec<Goal> {
        vec![]
    }
}
