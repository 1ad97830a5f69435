//! A cable pinned at one end and released from the horizontal, undamped, against the trajectory extrapolated from rigid links
//! (tests/reference/swing_cable.json).

use crate::chart::accuracy::{Benchmark, Case, Goal, Play, metre, slender_tube};
use crate::chart::each;
use crate::chart::stability::common::GRAVITY;
use glam::DVec3;
use metachron_models::rod::{Integrator, TubeSpec};
use serde::Deserialize;

/// The benchmark.
pub(crate) struct Swing;

/// The reference.
#[derive(Deserialize)]
struct Trajectory {
    tip_xz_every_10ms: Vec<[f64; 2]>,
}

const REFERENCE: &str = include_str!("../swing_cable.json");
/// Number of comparisons of the tip, every 10 ms in the first second.
const LOOKS: usize = 100;

impl Benchmark for Swing {
    const NAME: &'static str = "swing";
    const TITLE: &'static str = "Cable released from the horizontal, steps of 10 ms";
    const ERROR: &'static str = "RMS of the tip in the first second, m";

    fn cases(quick: bool) -> Vec<Case> {
        let methods = [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum];
        let sizes = if quick { &[16][..] } else { &[16, 32, 64] };
        let substeps: &[u32] = if quick { &[1, 4] } else { &[1, 2, 4, 5, 8, 16, 32] };
        each!(case in Case::ladder(&["cable"], &methods, sizes, 10.0), &substeps in substeps => Case { substeps, ..case.clone() })
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let tips = serde_json::from_str::<Trajectory>(REFERENCE).ok()?.tip_xz_every_10ms;
        // the reference has neither stretch nor shear
        let spec = TubeSpec { pin: [true, false], gravity: DVec3::NEG_Z * GRAVITY, ..slender_tube(1e6, metre()) };
        let mut play = Play::new(spec, case)?;
        let mut sum = 0.0;
        for [x, z] in tips.into_iter().skip(1).take(LOOKS) {
            if !play.run(0.01, &[]) {
                return None;
            }
            sum += play.point(1.0).distance_squared(DVec3::new(x, 0.0, z));
        }
        Some((play, (sum / LOOKS as f64).sqrt()))
    }

    fn goals() -> Vec<Goal> {
        vec![Goal { case: "cable", segments: 32, error: 5e-4, cpu_ms_per_s: 6.0 }]
    }
}
