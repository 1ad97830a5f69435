//! Frequencies of a clamped tube, against beam and wave theory: the first four modes of bending, of stretch and of twist.
//!
//! A mode is excited by pulls in its own shape, or released from an even twist, and is measured by projection onto the same shape:
//! other motion does not count.

use crate::chart::accuracy::{Benchmark, Case, Play, metre, reference_tube, slender_tube};
use crate::chart::stability::common::dead_load;
use glam::{DQuat, DVec3};
use metachron_contact::AnchorForce;
use metachron_core::CurveState;
use metachron_models::rod::{Integrator, TubeSpec};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The benchmark.
pub(crate) struct Frequencies;

const YOUNG_PA: f64 = 1e7;
/// Rotary inertia is reduced to this share in bending: the theory of slender beams has none.
const ROTARY_SHARE: f64 = 1e-3;
/// How far the tip is pulled before it is released, metres: small compared with every other length.
const PULLED_M: f64 = 1e-5;
/// Twist of the tip before release, radians.
const TWISTED_RAD: f64 = 1e-2;
/// Periods that are counted, after one in which other excited motion passes.
const PERIODS: usize = 8;
/// Steps per period.
const STEPS: [f64; 3] = [25.0, 50.0, 100.0];
/// βL of the bending modes: cos βL cosh βL = −1 (tests/reference/frequencies.json).
const BETA: [f64; 4] = [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613, 10.995_540_734_875_47];

/// The motion of a mode.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Bending,
    Axial,
    Torsion,
}

/// A mode of a tube of 1 m, clamped at its start.
struct Mode {
    kind: Kind,
    /// βL of bending; (2n − 1) π/2 of waves.
    beta: f64,
}

const KINDS: [(Kind, &str); 3] = [(Kind::Bending, "bending"), (Kind::Axial, "axial"), (Kind::Torsion, "torsion")];

impl Mode {
    /// The mode with the name of a case.
    fn named(name: &str) -> Option<Self> {
        let (kind, number) = name.split_once(' ')?;
        let index = number.parse::<usize>().ok()?.checked_sub(1)?;
        let (kind, _) = KINDS.into_iter().find(|(_, name)| *name == kind)?;
        let beta = *BETA.get(index)?;
        Some(Self { kind, beta: if kind == Kind::Bending { beta } else { (2.0 * index as f64 + 1.0) * FRAC_PI_2 } })
    }

    /// The tube of the mode.
    fn spec(&self) -> TubeSpec {
        let mut spec = match self.kind {
            Kind::Bending => slender_tube(YOUNG_PA, metre()),
            Kind::Axial | Kind::Torsion => reference_tube(YOUNG_PA, metre()),
        };
        match self.kind {
            Kind::Bending => spec.section.rotary_kg_m *= ROTARY_SHARE,
            Kind::Axial => {}
            Kind::Torsion => spec.twist_rad = TWISTED_RAD,
        }
        TubeSpec { clamp: [true, false], ..spec }
    }

    /// Its frequency in theory, Hz: β² √(EI/μ)/2π, β √(EA/μ)/2π, β √(GJ/2ρI)/2π.
    fn hz(&self, spec: &TubeSpec) -> f64 {
        let (section, mu) = (&spec.section, spec.section.mass_per_length_kg_m);
        let speed = match self.kind {
            Kind::Bending => self.beta * (section.ei_n_m2 / mu).sqrt(),
            Kind::Axial => (section.ea_n / mu).sqrt(),
            Kind::Torsion => (section.gj_n_m2 / (2.0 * section.rotary_kg_m)).sqrt(),
        };
        self.beta * speed / TAU
    }

    /// The mode's displacement at `s` metres from the clamp; of size 2 or 1 at the tip.
    fn shape(&self, s: f64) -> f64 {
        let (b, x) = (self.beta, self.beta * s);
        if self.kind != Kind::Bending {
            return libm::sin(x);
        }
        let share = (libm::sinh(b) - libm::sin(b)) / (libm::cosh(b) + libm::cos(b));
        libm::cosh(x) - libm::cos(x) - share * (libm::sinh(x) - libm::sin(x))
    }

    /// Pulls at every node that excite the mode.
    fn loads(&self, spec: &TubeSpec, nodes: u32) -> Vec<AnchorForce> {
        let axis = if self.kind == Kind::Axial { DVec3::X } else { DVec3::Z };
        let force = PULLED_M * spec.section.mass_per_length_kg_m * (TAU * self.hz(spec)).powi(2) / f64::from(nodes);
        let at = |k: u32| f64::from(k) / f64::from(nodes);
        (1..=nodes).map(|k| dead_load(at(k), axis * (force * self.shape(at(k))))).collect()
    }

    /// The amplitude of the mode in the curve: the mean displacement weighted by the shape.
    fn seen(&self, curve: &CurveState) -> f64 {
        let last = curve.positions.len() - 1;
        let sum: f64 = match self.kind {
            Kind::Torsion => {
                let level = DQuat::from_rotation_arc(DVec3::Z, DVec3::X).conjugate();
                let middle = |k: usize| 0.5 * (curve.arc_m[k] + curve.arc_m[k + 1]);
                curve.frames.iter().enumerate().map(|(k, q)| (*q * level).x * self.shape(middle(k))).sum()
            }
            kind => {
                let moved = |x: DVec3, s: f64| if kind == Kind::Axial { x.x - s } else { x.z };
                let one = |k: usize| moved(curve.positions[k], curve.arc_m[k]) * self.shape(curve.arc_m[k]);
                (0..last).map(one).sum::<f64>() + 0.5 * one(last)
            }
        };
        sum / last as f64
    }
}

impl Benchmark for Frequencies {
    const NAME: &'static str = "frequencies";
    const TITLE: &'static str = "First frequencies of a clamped tube in bending, stretch and twist, eight periods";
    const ERROR: &'static str = "error of the frequency / frequency";

    fn cases(quick: bool) -> Vec<Case> {
        let numbers = if quick { 1..=1 } else { 1..=BETA.len() };
        let names = KINDS.iter().flat_map(|(_, kind)| numbers.clone().map(move |n| format!("{kind} {n}")));
        let methods = [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum];
        let sizes = if quick { &[16][..] } else { &[16, 32, 64] };
        let of = |name: String| {
            let hz = Mode::named(&name).map_or(f64::NAN, |mode| mode.hz(&mode.spec()));
            STEPS.into_iter().flat_map(move |steps| Case::ladder(&[&name], &methods, sizes, 1e3 / (hz * steps)))
        };
        names.flat_map(of).collect()
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let mode = Mode::named(&case.case)?;
        let spec = mode.spec();
        let hz = mode.hz(&spec);
        let loads = mode.loads(&spec, case.segments);
        let mut play = Play::new(spec, case)?;
        // a pull of a quarter period excites the mode
        let mut sound = mode.kind == Kind::Torsion || play.run(0.25 / hz, &loads);
        let mut crossings = Vec::new();
        let (mut before, mut then_s) = (mode.seen(&play.curve()), play.time_s());
        while sound && crossings.len() < 2 * PERIODS + 3 && play.time_s() * hz < 2.0 * PERIODS as f64 {
            sound = play.run(case.dt_ms * 1e-3, &[]);
            let (now, now_s) = (mode.seen(&play.curve()), play.time_s());
            if before * now < 0.0 {
                crossings.push(then_s + (now_s - then_s) * before / (before - now));
            }
            (before, then_s) = (now, now_s);
        }
        let (first, last) = (crossings.get(2)?, crossings.get(2 * PERIODS + 2)?);
        let found_hz = PERIODS as f64 / (last - first);
        sound.then_some((play, (found_hz / hz - 1.0).abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frequencies_are_those_of_the_reference() {
        // tests/reference/frequencies.json, firm
        let wanted = [
            ("bending 1", 0.541_993_838_868_306_1),
            ("bending 4", 18.637_033_290_152_807),
            ("axial 1", 24.397_501_823_713_327),
            ("axial 3", 121.987_509_118_566_63),
            ("torsion 2", 42.980_119_129_593_96),
        ];
        for (name, hz) in wanted {
            let mode = Mode::named(name).unwrap();
            assert!((mode.hz(&mode.spec()) / hz - 1.0).abs() < 1e-12, "{name}");
        }
    }

    #[test]
    fn a_shape_stands_still_at_the_clamp_and_has_no_moment_at_the_tip() {
        for name in ["bending 1", "bending 4", "axial 2"] {
            let mode = Mode::named(name).unwrap();
            assert!(mode.shape(0.0).abs() < 1e-15);
            let (h, bends) = (1e-4, mode.kind == Kind::Bending);
            let [a, b, c] = [1.0 - 2.0 * h, 1.0 - h, 1.0].map(|s| mode.shape(s));
            // moment of a beam, force of a bar; first order in h
            let left = if bends { (a - 2.0 * b + c) / (h * h) } else { (c - b) / h };
            assert!(left.abs() < 0.5, "{name}: {left}");
        }
    }
}
