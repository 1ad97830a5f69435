//! A solid clamped to a wall at one end, under its own weight, against Timoshenko's beam.

use super::super::stability::common::{GRAVITY, plain_soft};
use super::diagram::{Benchmark, Case};
use super::play::Play;
use glam::DVec3;
use metachron_models::rod::Integrator;
use metachron_models::soft::{MaterialLaw, Side, SoftMaterial, SoftShape, SoftSpec};

/// The benchmark.
pub(in super::super) struct SolidBeam;

/// Names, and heights in units of the length.
const HEIGHTS: [(&str, f64); 2] = [("h = L/10", 0.1), ("h = L/20", 0.05)];
const LENGTH_M: f64 = 0.4;
/// So stiff that the sag is below 0.2 % of the length: beam theory is one of small angles.
const MATERIAL: SoftMaterial = SoftMaterial {
    young_pa: 1e9,
    poisson: 0.0,
    density_kg_m3: 1000.0,
    damping_per_s: 20.0,
    damping_s: 0.0,
    law: MaterialLaw::Corotational,
};
const SECONDS: f64 = 4.0;

impl Benchmark for SolidBeam {
    const NAME: &'static str = "solid-beam";
    const TITLE: &'static str = "Solid beam clamped at a wall under its own weight, at rest after 4 s";
    const ERROR: &'static str = "error of the sag / sag";

    fn cases(quick: bool) -> Vec<Case> {
        let sizes = if quick { &[4, 8][..] } else { &[4, 8, 16, 32] };
        Case::ladder(&HEIGHTS.map(|(name, _)| name), &[Integrator::ImplicitEuler], sizes, 20.0)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, slenderness) = HEIGHTS.into_iter().find(|(name, _)| *name == case.case)?;
        let side = slenderness * LENGTH_M;
        let across = if case.segments < 16 { 1 } else { 2 };
        let shape =
            SoftShape::Box { size_m: DVec3::new(LENGTH_M, side, side), segments: [case.segments, across, across] };
        let mut play = Play::soft(SoftSpec { held: vec![Side::Left], ..plain_soft(shape, MATERIAL) }, case)?;
        let before = play.point(1.0).z;
        let sound = play.run(SECONDS, &[]);
        let error = ((before - play.point(1.0).z) / sag_m(side) - 1.0).abs();
        sound.then_some((play, error))
    }
}

/// w L⁴/8EI + w L²/2κGA, κ = 5/6, G = E/2.
fn sag_m(side: f64) -> f64 {
    let (area, young) = (side * side, MATERIAL.young_pa);
    let weight_n_m = MATERIAL.density_kg_m3 * GRAVITY * area;
    let bend = young * area * area / 12.0;
    let shear = 5.0 / 6.0 * 0.5 * young * area;
    weight_n_m * LENGTH_M.powi(4) / (8.0 * bend) + weight_n_m * LENGTH_M.powi(2) / (2.0 * shear)
}
