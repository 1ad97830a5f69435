//! A closed tube under pressure: the widening of its outside, against the exact solution for any wall (Lamé).
//!
//! The tube follows the law of thin walls, dr = p r² (1 − ν/2)/(E t): its error is that of the law, and grows with the wall.

use crate::chart::accuracy::{Benchmark, Case, Play, metre};
use metachron_models::rod::{Integrator, Material, Section, TubeSpec};

/// The benchmark.
pub(crate) struct Inflation;

/// Names, and wall thicknesses in outer radii.
const WALLS: [(&str, f64); 5] = [
    ("t/r = 0.133", 2.0 / 15.0),
    ("t/r = 0.067", 1.0 / 15.0),
    ("t/r = 0.033", 1.0 / 30.0),
    ("t/r = 0.017", 1.0 / 60.0),
    ("t/r = 0.008", 1.0 / 120.0),
];
const RADIUS_M: f64 = 0.015;
const MATERIAL: Material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
/// The stress of the wall over its modulus: small, so that both theories are linear.
const STRAIN: f64 = 1e-3;

impl Benchmark for Inflation {
    const NAME: &'static str = "inflation";
    const TITLE: &'static str = "Closed tube under pressure";
    const ERROR: &'static str = "error of the radial expansion / expansion";

    fn cases(_: bool) -> Vec<Case> {
        Case::ladder(&WALLS.map(|(name, _)| name), &[Integrator::ImplicitEuler], &[16], 10.0)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, wall) = WALLS.into_iter().find(|(name, _)| *name == case.case)?;
        let section = Section::hollow(RADIUS_M, wall * RADIUS_M, MATERIAL);
        let pressure_pa = STRAIN * MATERIAL.young_pa * wall;
        let free = TubeSpec::free(metre(), section, 16);
        let mut play = Play::new(TubeSpec { pressure_pa, clamp: [true, false], ..free }, case)?;
        let sound = play.run(1.0, &[]);
        let widened = play.curve().radii_m.first()? - RADIUS_M;
        sound.then_some((play, (widened / widening_m(wall, pressure_pa) - 1.0).abs()))
    }
}

/// Lamé: the outside of a closed cylinder moves by p a² b (2 − ν)/(E (b² − a²)).
fn widening_m(wall: f64, pressure_pa: f64) -> f64 {
    let inner = RADIUS_M * (1.0 - wall);
    let area = RADIUS_M * RADIUS_M - inner * inner;
    pressure_pa * inner * inner * RADIUS_M * (2.0 - MATERIAL.poisson) / (MATERIAL.young_pa * area)
}
