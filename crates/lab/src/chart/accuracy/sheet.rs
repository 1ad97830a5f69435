//! A sheet between two walls under its own weight, against the elastic catenary.

use super::super::stability::common::{GRAVITY, plain_soft};
use super::diagram::{Benchmark, Case};
use super::play::Play;
use metachron_models::rod::Integrator;
use metachron_models::soft::{MaterialLaw, Side, SoftMaterial, SoftShape, SoftSpec};

/// The benchmark.
pub(in super::super) struct Sheet;

/// Names and Young's moduli, Pa.
const MODULI: [(&str, f64); 2] = [("E = 1e6 Pa", 1e6), ("E = 1e7 Pa", 1e7)];
const SPAN_M: f64 = 0.4;
const WIDTH_M: f64 = 0.1;
/// So thin that it hangs without bending stiffness.
const THICKNESS_M: f64 = 1e-4;
const DENSITY_KG_M3: f64 = 1000.0;
const SECONDS: f64 = 12.0;

impl Benchmark for Sheet {
    const NAME: &'static str = "sheet";
    const TITLE: &'static str = "Sheet between two walls under its own weight, at rest after 12 s";
    const ERROR: &'static str = "error of the sag / span";

    fn cases(quick: bool) -> Vec<Case> {
        let sizes = if quick { &[8, 16][..] } else { &[8, 16, 32, 64] };
        Case::ladder(&MODULI.map(|(name, _)| name), &[Integrator::ImplicitEuler], sizes, 20.0)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, young_pa) = MODULI.into_iter().find(|(name, _)| *name == case.case)?;
        let segments = [case.segments, (case.segments / 4).max(1)];
        let shape = SoftShape::Sheet { size_m: [SPAN_M, WIDTH_M], thickness_m: THICKNESS_M, segments };
        let material = SoftMaterial {
            young_pa,
            poisson: 0.0,
            density_kg_m3: DENSITY_KG_M3,
            damping_per_s: 20.0,
            damping_s: 0.0,
            law: MaterialLaw::Corotational,
        };
        let mut play =
            Play::soft(SoftSpec { held: vec![Side::Left, Side::Right], ..plain_soft(shape, material) }, case)?;
        let sound = play.run(SECONDS, &[]);
        let error = (-play.lowest_m() - sag_m(young_pa)).abs() / SPAN_M;
        sound.then_some((play, error))
    }
}

/// The sag of an elastic cable as long as its span d at rest, with weight w and stiffness S: with the tension H that solves
/// H d/S + 2 H/w asinh(w d/2H) = d, it is w d²/8S + H/w (√(1 + (w d/2H)²) − 1).
fn sag_m(young_pa: f64) -> f64 {
    let (weight, stiffness) = (DENSITY_KG_M3 * GRAVITY * THICKNESS_M, young_pa * THICKNESS_M);
    let half = |pull: f64| 0.5 * weight * SPAN_M / pull;
    let reach_m = |pull: f64| pull * SPAN_M / stiffness + 2.0 * pull / weight * libm::asinh(half(pull));
    let (mut low, mut high) = (0.0, stiffness);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if reach_m(middle) < SPAN_M { low = middle } else { high = middle }
    }
    let (u, pull) = (half(high), high);
    weight * SPAN_M * SPAN_M / (8.0 * stiffness) + pull / weight * u * u / (1.0 + libm::sqrt(1.0 + u * u))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shallow_sag_is_that_of_a_parabola() {
        // s³ = 3 w d⁴/64 S, to the second order of s/d = 0.01
        let young_pa = 1e8;
        let (weight, stiffness) = (DENSITY_KG_M3 * GRAVITY, young_pa);
        let parabola = (3.0 * weight * SPAN_M.powi(4) / (64.0 * stiffness)).cbrt();
        assert!((sag_m(young_pa) / parabola - 1.0).abs() < 1e-3, "{} {parabola}", sag_m(young_pa));
    }
}
