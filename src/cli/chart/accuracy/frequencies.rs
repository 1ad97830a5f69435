//! How fast a clamped tube vibrates, against beam and wave theory: the first bending and the first axial frequency.

use super::super::stability::common::dead_load;
use super::diagram::{Benchmark, Case, Goal};
use super::play::{Play, reference_tube};
use glam::DVec3;
use metachron_agents::rod::{Integrator, TubeSpec};

/// The benchmark.
pub(in super::super) struct Frequencies;

const YOUNG_PA: f64 = 1e7;
/// Of the first bending mode, Hz: (βL)² √(EI/μL⁴)/2π with βL = 1.875104 (tests/reference/frequencies.json, firm).
const BENDING_HZ: f64 = 0.541_993_838_868_306_1;
/// Of the first axial mode, Hz: √(E/ρ)/4L.
const AXIAL_HZ: f64 = 24.397_501_823_713_327;
/// How far the tip is pulled before it is let go, metres: small beside everything.
const PULLED_M: f64 = 1e-5;
/// Periods that are counted, after one that is left to the higher modes.
const PERIODS: usize = 8;

/// A mode: how it is set off and how long it takes to get there.
struct Mode {
    name: &'static str,
    hz: f64,
    axis: DVec3,
    /// Steps a period, coarse to fine.
    steps: [f64; 3],
}

fn modes() -> [Mode; 2] {
    let steps = [25.0, 50.0, 100.0];
    [
        Mode { name: "bending", hz: BENDING_HZ, axis: DVec3::Z, steps },
        Mode { name: "axial", hz: AXIAL_HZ, axis: DVec3::X, steps },
    ]
}

impl Benchmark for Frequencies {
    const NAME: &'static str = "frequencies";
    const TITLE: &'static str = "First bending and first axial frequency of a clamped tube, eight periods";
    const ERROR: &'static str = "error of the frequency / frequency";

    fn cases(quick: bool) -> Vec<Case> {
        let mut list = Vec::new();
        for mode in modes() {
            for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum] {
                for &segments in if quick { &[16][..] } else { &[16, 32, 64] } {
                    for steps in mode.steps {
                        let (case, method) = (mode.name.to_owned(), integrator.name().to_owned());
                        list.push(Case { case, method, segments, dt_ms: 1e3 / (mode.hz * steps), substeps: 1 });
                    }
                }
            }
        }
        list
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let mode = modes().into_iter().find(|mode| mode.name == case.case)?;
        let spec = TubeSpec { clamp: [true, false], ..reference_tube(YOUNG_PA, vec![DVec3::ZERO, DVec3::X]) };
        let stiffness = if mode.axis.x > 0.0 { spec.section.ea_n } else { 3.0 * spec.section.ei_n_m2 };
        let force = mode.axis * (PULLED_M * stiffness);
        let mut play = Play::new(spec, case)?;
        // a pull of a quarter period sets the mode off
        let mut sound = play.run(0.25 / mode.hz, &[dead_load(1.0, force)]);
        let offset = DVec3::X.dot(mode.axis);
        let mut crossings = Vec::new();
        let (mut before, mut then_s) = (play.point(1.0).dot(mode.axis) - offset, play.time_s());
        while sound && crossings.len() < 2 * PERIODS + 3 && play.time_s() * mode.hz < 2.0 * PERIODS as f64 {
            sound = play.run(case.dt_ms * 1e-3, &[]);
            let (now, now_s) = (play.point(1.0).dot(mode.axis) - offset, play.time_s());
            if before * now < 0.0 {
                crossings.push(then_s + (now_s - then_s) * before / (before - now));
            }
            (before, then_s) = (now, now_s);
        }
        let (first, last) = (crossings.get(2)?, crossings.get(2 * PERIODS + 2)?);
        let hz = PERIODS as f64 / (last - first);
        sound.then_some((play, (hz / mode.hz - 1.0).abs()))
    }

    fn goals() -> Vec<Goal> {
        vec![]
    }
}
