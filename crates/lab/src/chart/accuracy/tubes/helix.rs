//! A helical spring pulled along its axis, against the theory of wires: k = 1/(R² L (cos² α/C + sin² α/B)).
//!
//! The force must act on the axis, where there is no tube: it is shared evenly by points around the last turn, whose centre is on
//! the axis. The turns before it then feel only the force on the axis and stay an even helix; these are measured.

use crate::chart::accuracy::{Benchmark, Case, Play, slender_tube};
use crate::chart::stability::common::dead_load;
use glam::DVec3;
use metachron_contact::AnchorForce;
use metachron_models::rod::{Integrator, TubeSpec};
use std::f64::consts::TAU;

/// The benchmark.
pub(crate) struct Helix;

/// Names and pitch angles, degrees.
const PITCHES: [(&str, f64); 3] = [("pitch 5°", 5.0), ("pitch 20°", 20.0), ("pitch 45°", 45.0)];
const RADIUS_M: f64 = 0.1;
/// Turns, including the last one, which is pulled.
const TURNS: u32 = 4;
/// Points of the path per turn.
const POINTS: u32 = 64;
/// Pulls on the last turn.
const HANDS: u32 = 16;
/// Extension of the turns as a share of their height: the relative error of the linear theory is of that size.
const DRAWN: f64 = 1e-5;
const SECONDS: f64 = 10.0;

impl Benchmark for Helix {
    const NAME: &'static str = "helix";
    const TITLE: &'static str = "Helical spring pulled along its axis, at rest after 10 s";
    const ERROR: &'static str = "error of the extension / extension";

    fn cases(quick: bool) -> Vec<Case> {
        // segments per turn: 12 … 96
        let sizes: Vec<u32> = if quick { &[12, 24][..] } else { &[12, 24, 48, 96] }.iter().map(|n| n * TURNS).collect();
        Case::ladder(&PITCHES.map(|(name, _)| name), &[Integrator::ImplicitEuler], &sizes, 10.0)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, degrees) = PITCHES.into_iter().find(|(name, _)| *name == case.case)?;
        let pitch = degrees.to_radians();
        let spec = TubeSpec { damping_per_s: 12.0, clamp: [true, false], ..slender_tube(1e8, path_m(pitch)) };
        let (twist, bend) = (spec.section.gj_n_m2, spec.section.ei_n_m2);
        let (cos, sin) = (libm::cos(pitch), libm::sin(pitch));
        let turn_m = TAU * RADIUS_M / cos;
        let softness = RADIUS_M * RADIUS_M * turn_m * (cos * cos / twist + sin * sin / bend);
        let load_n = DRAWN * turn_m * sin / softness;
        let mut play = Play::new(spec, case)?;
        let length_m = play.curve().arc_m.last().copied()?;
        let share = length_m / f64::from(TURNS);
        let loads: Vec<AnchorForce> = (0..HANDS)
            .map(|k| length_m - share * (f64::from(k) + 0.5) / f64::from(HANDS))
            .map(|arc_m| dead_load(arc_m, DVec3::Z * (load_n / f64::from(HANDS))))
            .collect();
        let seen = f64::from(TURNS - 1) / f64::from(TURNS);
        let before = play.point(seen).z;
        let sound = play.run(SECONDS, &loads);
        let error = ((play.point(seen).z - before) / (load_n * softness * f64::from(TURNS - 1)) - 1.0).abs();
        sound.then_some((play, error))
    }
}

/// A helix about z.
fn path_m(pitch: f64) -> Vec<DVec3> {
    let climb = RADIUS_M * libm::tan(pitch);
    let at = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(POINTS);
        DVec3::new(RADIUS_M * libm::cos(angle), RADIUS_M * libm::sin(angle), climb * angle)
    };
    (0..=TURNS * POINTS).map(at).collect()
}
