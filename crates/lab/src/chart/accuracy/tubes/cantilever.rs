//! A clamped tube at rest under its own weight, against shooting ([`crate::chart::stability::hanging`]).

use crate::chart::accuracy::{Benchmark, Case, Goal, Play, metre, reference_tube};
use crate::chart::stability::common::GRAVITY;
use crate::chart::stability::hanging::Hanging;
use glam::DVec3;
use metachron_models::rod::{Integrator, Section, TubeSpec};

/// The benchmark.
pub(crate) struct Cantilever;

/// Names and moduli, Pa: the two that other engines were measured with, and a ladder of loads.
const MODULI: [(&str, f64); 6] = [
    ("soft", 1e6),
    ("firm", 1e7),
    ("E = 1e5 Pa", 1e5),
    ("E = 1e8 Pa", 1e8),
    ("E = 1e9 Pa", 1e9),
    ("E = 1e10 Pa", 1e10),
];
const DAMPING_PER_S: f64 = 6.0;
/// Time for the tube to come to rest: the same as for the other engines.
const SECONDS: f64 = 8.0;

impl Benchmark for Cantilever {
    const NAME: &'static str = "cantilever";
    const TITLE: &'static str = "Clamped tube under its own weight, at rest after 8 s";
    const ERROR: &'static str = "tip error / L";

    fn cases(quick: bool) -> Vec<Case> {
        let mut list = Vec::new();
        for (case, young_pa) in MODULI.into_iter().take(if quick { 1 } else { MODULI.len() }) {
            for integrator in Integrator::ALL {
                let explicit = matches!(integrator, Integrator::SymplecticEuler | Integrator::Xpbd);
                let sizes: &[u32] = match (quick, explicit) {
                    (true, _) => &[8, 16],
                    (false, true) => &[8, 16, 32],
                    // 40 and 48: the fewest that err by less than 1e-3, and a little more
                    (false, false) => &[8, 16, 32, 40, 48, 64, 128, 256],
                };
                // an explicit step of a stiff tube is microseconds: its cost is known without running the case
                if explicit && young_pa > 1e7 {
                    continue;
                }
                let steps: &[f64] = if explicit { &[10.0] } else { &[10.0, 40.0] };
                let of_size = |&segments: &u32| {
                    steps.iter().flat_map(move |&dt_ms| Case::ladder(&[case], &[integrator], &[segments], dt_ms))
                };
                list.extend(sizes.iter().flat_map(of_size));
            }
        }
        list
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, young_pa) = MODULI.into_iter().find(|(name, _)| *name == case.case)?;
        let spec = TubeSpec {
            damping_per_s: DAMPING_PER_S,
            clamp: [true, false],
            gravity: DVec3::NEG_Z * GRAVITY,
            ..reference_tube(young_pa, metre())
        };
        let Section { ea_n, ga_n, ei_n_m2, .. } = spec.section;
        let weight_n_m = spec.section.mass_per_length_kg_m * GRAVITY;
        let (side, down) = Hanging { length_m: 1.0, weight_n_m, ea_n, ga_n, ei_n_m2 }.tip_m();
        let mut play = Play::new(spec, case)?;
        let sound = play.run(SECONDS, &[]);
        let error = play.point(1.0).distance(DVec3::new(side, 0.0, -down));
        sound.then_some((play, error))
    }

    fn goals() -> Vec<Goal> {
        let goal = |segments, error, limit| Goal { case: "soft", segments, error, cpu_ms_per_s: limit };
        vec![goal(0, 1e-3, 0.2), goal(0, 1e-4, 0.6), goal(256, 3e-5, 3.0)]
    }
}
