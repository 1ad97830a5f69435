//! A cable without bending stiffness between two points, against the catenary in closed form.

use crate::chart::accuracy::{Benchmark, Case, Play, reference_tube};
use crate::chart::stability::common::GRAVITY;
use glam::DVec3;
use metachron_models::rod::{Integrator, TubeSpec};

/// The benchmark.
pub(crate) struct Catenary;

const SPAN_M: f64 = 0.8;
/// Bend and twist stiffness, N·m²: so small that the boundary layers at the ends are micrometres.
const BENDING_N_M2: f64 = 1e-7;
const SECONDS: f64 = 20.0;

impl Benchmark for Catenary {
    const NAME: &'static str = "catenary";
    const TITLE: &'static str = "Cable between two points, at rest after 20 s";
    const ERROR: &'static str = "error of the sag / span";

    fn cases(quick: bool) -> Vec<Case> {
        let methods = [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum];
        let sizes = if quick { &[16, 32][..] } else { &[16, 32, 64, 128] };
        Case::ladder(&["span 0.8 m"], &methods, sizes, 10.0)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let path = vec![DVec3::ZERO, DVec3::new(0.5 * SPAN_M, 0.0, -0.3), DVec3::X * SPAN_M];
        let mut spec = TubeSpec {
            damping_per_s: 6.0,
            pin: [true, true],
            gravity: DVec3::NEG_Z * GRAVITY,
            ..reference_tube(1e9, path)
        };
        (spec.section.ei_n_m2, spec.section.gj_n_m2) = (BENDING_N_M2, BENDING_N_M2);
        let mut play = Play::new(spec, case)?;
        let sound = play.run(SECONDS, &[]);
        let length_m = play.curve().arc_m.last().copied()?;
        let lowest = (0..=1000).map(|k| play.point(f64::from(k) * 1e-3).z).fold(f64::INFINITY, f64::min);
        let error = (-lowest - sag_m(length_m)).abs() / SPAN_M;
        sound.then_some((play, error))
    }
}

/// The sag of an inextensible cable: sinh u / u = L/d, sag = d/(2u) (cosh u − 1), by Newton's method.
fn sag_m(length_m: f64) -> f64 {
    let mut u: f64 = 1.0;
    for _ in 0..50 {
        let (sinh, cosh) = (libm::sinh(u), libm::cosh(u));
        u -= (sinh / u - length_m / SPAN_M) / (cosh / u - sinh / (u * u));
    }
    SPAN_M / (2.0 * u) * (libm::cosh(u) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sag_is_that_of_the_reference() {
        // tests/reference/catenary.json: span 0.8 L, sag 0.26544 L
        let length_m = 1.0;
        assert!((sag_m(length_m) - 0.265_437_509_139_823_7).abs() < 1e-14);
    }
}
