//! The twist at which a tube between two clamps buckles, a straight one (Greenhill) and a ring (Michell, Zajac), found from each side.
//!
//! The middle is pushed sideways and released. Once only the slowest motion is left, the rate at which that grows or decays gives
//! its stiffness, which passes through zero where the tube buckles. Runs on one side approach that twist step by step; a run that
//! turns out to be on the other side is a failure. Theory: docs/theory/rod.md, eq. 50–53.

use crate::chart::accuracy::{Benchmark, Case, Goal, Play, metre, reference_tube, slender_tube};
use crate::chart::stability::common::dead_load;
use glam::DVec3;
use metachron_core::CurveState;
use metachron_models::rod::{Integrator, TubeSpec};
use std::f64::consts::TAU;

/// The benchmark of the straight tube.
pub(crate) struct TwistBuckling;
/// The benchmark of the ring.
pub(crate) struct MichellRing;

/// The sign of a run's twist minus the critical one, by the side from which the runs approach.
const BELOW: f64 = -1.0;
const ABOVE: f64 = 1.0;
/// Names of the straight tube's cases, and sides.
const STRAIGHT: [(&str, f64); 2] = [("from below", BELOW), ("from above", ABOVE)];
/// Names of the rings' cases, ratios of twist stiffness to bend stiffness, and sides.
const RINGS: [(&str, f64, f64); 8] = [
    ("C/B = 1 from below", 1.0, BELOW),
    ("C/B = 1 from above", 1.0, ABOVE),
    ("C/B = 1.2 from below", 1.2, BELOW),
    ("C/B = 1.2 from above", 1.2, ABOVE),
    ("C/B = 2.2 from below", 2.2, BELOW),
    ("C/B = 2.2 from above", 2.2, ABOVE),
    ("C/B = 3 from below", 3.0, BELOW),
    ("C/B = 3 from above", 3.0, ABOVE),
];
/// M L/B of a straight tube between clamps without thrust: twice the least root of tan x = x.
const GREENHILL: f64 = 8.986_818_915_818_128;
const YOUNG_PA: f64 = 1e6;
/// Points of the path around the ring.
const POINTS: u32 = 512;
/// Lets all but the slowest motion decay within the waiting time ([`SECONDS`]), and the slowest creep.
const DAMPING_PER_S: f64 = 30.0;
/// A push that displaces the middle by a tenth of a millimetre: linear theory holds.
const PUSH_N: f64 = 0.004;
/// How long the push lasts, how long the run then waits, and how long growth is observed, seconds.
const SECONDS: [f64; 3] = [0.05, 1.0, 0.25];
/// A tube of which a point is farther than this from its start has left the linear range, metres.
const LINEAR_M: f64 = 0.01;
/// Distance of the first two runs of a side from the critical twist of theory, as a share of that twist.
const STARTS: [f64; 2] = [0.1, 0.06];
/// Runs after those, each half-way from the one before to the zero of the line through the last two: the last is about 0.01 away.
const APPROACHES: usize = 3;
/// The bound of the error that was set as the goal.
const ERROR_MAX: f64 = 0.02;
/// The goal sets no bound on cost here: real time at least.
const REAL_TIME_MS: f64 = 1000.0;

/// A tube between two clamps that can be twisted against each other.
struct Twisted {
    /// The tube without its twist.
    spec: TubeSpec,
    /// The critical twist of theory, radians.
    critical_rad: f64,
    /// The direction in which its middle is pushed.
    aside: DVec3,
}

impl Twisted {
    /// The straight tube of the references without shear, but with its stretch: bowing out between fixed ends stretches the tube, and
    /// a tube stiffer in stretch would leave the linear range within a tenth of a millimetre.
    fn straight() -> Self {
        let mut spec = slender_tube(YOUNG_PA, metre());
        spec.section.ea_n = reference_tube(YOUNG_PA, metre()).section.ea_n;
        let critical_rad = GREENHILL * spec.section.ei_n_m2 / spec.section.gj_n_m2;
        Self { spec, critical_rad, aside: DVec3::Z }
    }

    /// The same tube bent to a ring of a metre around, with another twist stiffness. A push along the ring, which becomes its mirror
    /// image under half a turn about the diameter through the clamp, is measured separately from how the ring settles, and separately
    /// from its swing about the clamp, which meets no resistance.
    fn ring(ratio: f64) -> Self {
        let mut spec = TubeSpec { straight: true, ..slender_tube(YOUNG_PA, circle()) };
        spec.section.gj_n_m2 = ratio * spec.section.ei_n_m2;
        Self { spec, critical_rad: TAU * 3.0_f64.sqrt() / ratio, aside: DVec3::X }
    }

    /// The stiffness λ of the slowest motion at a share of the critical twist, over its mass, 1/s² (eq. 52); `None` where the tube is lost
    /// or has left the linear range: settling into another shape is not decay.
    fn stiffness(&self, share: f64, case: &Case) -> Option<(Play, f64)> {
        let twist_rad = share * self.critical_rad;
        let spec = TubeSpec { twist_rad, clamp: [true; 2], damping_per_s: DAMPING_PER_S, ..self.spec.clone() };
        let mut play = Play::new(spec, case)?;
        let (start, middle) = (play.curve(), play.point(0.5));
        let middle_m = 0.5 * start.arc_m.last()?;
        let aside_m = |play: &Play| (play.point(0.5) - middle).dot(self.aside);
        let [pushed_s, wait_s, watch_s] = SECONDS;
        let sound = play.run(pushed_s, &[dead_load(middle_m, self.aside * PUSH_N)]) && play.run(wait_s, &[]);
        let before_m = aside_m(&play);
        let sound = sound && play.run(watch_s, &[]);
        let rate = libm::log(aside_m(&play) / before_m) / watch_s;
        let linear = farthest_m(&start, &play.curve()) <= LINEAR_M;
        (sound && linear).then_some((play, -rate * (rate + DAMPING_PER_S)))
    }

    /// Relative error of the twist that runs on one side converge to, against theory; `None` where a run belongs to the other side or
    /// fails.
    fn error(&self, side: f64, case: &Case) -> Option<(Play, f64)> {
        let run = |share: f64| {
            let (play, stiffness) = self.stiffness(share, case)?;
            (stiffness * side < 0.0).then_some((play, (share, stiffness)))
        };
        let [far, near] = STARTS.map(|away| 1.0 + side * away);
        let (_, mut before) = run(far)?;
        let (mut play, mut now) = run(near)?;
        for _ in 0..APPROACHES {
            let (later, next) = run(0.5 * (now.0 + zero(before, now)))?;
            (play, before, now) = (later, now, next);
        }
        Some((play, (zero(before, now) - 1.0).abs()))
    }
}

/// The greatest distance between the same point in two states of a tube, metres.
fn farthest_m(a: &CurveState, b: &CurveState) -> f64 {
    a.positions.iter().zip(&b.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// The zero of the line through two points.
fn zero(a: (f64, f64), b: (f64, f64)) -> f64 {
    b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1)
}

/// A ring of a metre around that begins and ends at the origin, along x. The second point from each end is so close that the
/// path starts along the ring, not along a chord of it.
fn circle() -> Vec<DVec3> {
    const NEAR: f64 = 1e-3;
    let last = f64::from(POINTS);
    let places = [0.0, NEAR].into_iter().chain((1..POINTS).map(f64::from)).chain([last - NEAR, last]);
    let at = |angle: f64| DVec3::new(libm::sin(angle), 1.0 - libm::cos(angle), 0.0) / TAU;
    places.map(|place| at(TAU * place / last)).collect()
}

fn cases(names: &[&str], quick: bool) -> Vec<Case> {
    const DT_MS: f64 = 5.0;
    if quick {
        return Case::ladder(names, &[Integrator::ImplicitEuler], &[24, 48], DT_MS);
    }
    let methods = [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum];
    Case::ladder(names, &methods, &[24, 48, 96, 192], DT_MS)
}

fn goal(case: &'static str) -> Goal {
    Goal { case, segments: 0, error: ERROR_MAX, cpu_ms_per_s: REAL_TIME_MS }
}

impl Benchmark for TwistBuckling {
    const NAME: &'static str = "twist-buckling";
    const TITLE: &'static str = "Twist at which a straight tube between two clamps buckles, bracketed by five runs";
    const ERROR: &'static str = "error of the twist / twist";

    fn cases(quick: bool) -> Vec<Case> {
        cases(&STRAIGHT.map(|(name, _)| name), quick)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, side) = STRAIGHT.into_iter().find(|(name, _)| *name == case.case)?;
        Twisted::straight().error(side, case)
    }

    fn goals() -> Vec<Goal> {
        STRAIGHT.map(|(name, _)| goal(name)).into()
    }
}

impl Benchmark for MichellRing {
    const NAME: &'static str = "michell-ring";
    const TITLE: &'static str = "Twist at which a ring leaves its plane, bracketed by five runs";
    const ERROR: &'static str = "error of the twist / twist";

    fn cases(quick: bool) -> Vec<Case> {
        cases(&RINGS.map(|(name, ..)| name), quick)
    }

    fn play(case: &Case) -> Option<(Play, f64)> {
        let (_, ratio, side) = RINGS.into_iter().find(|(name, ..)| *name == case.case)?;
        Twisted::ring(ratio).error(side, case)
    }

    fn goals() -> Vec<Goal> {
        RINGS.map(|(name, ..)| goal(name)).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_twists_of_theory_are_those_of_the_reference() {
        let file: serde_json::Value =
            serde_json::from_str(include_str!("../../../../../../tests/reference/buckling.json")).unwrap();
        let tube = &file["tube"]["soft"];
        let natural = tube["GJ"].as_f64().unwrap() / tube["EI"].as_f64().unwrap();
        let wanted = |key: &str| tube[key].as_f64().unwrap();
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} is not {b}");
        close(Twisted::straight().critical_rad, wanted("twist_at_greenhill_clamped_rad"));
        close(Twisted::ring(natural).critical_rad, wanted("michell_ring_total_twist_rad"));
    }

    fn case() -> Case {
        Case::ladder(&[""], &[Integrator::ImplicitEuler], &[24], 5.0).remove(0)
    }

    #[test]
    fn a_run_of_the_other_side_is_no_answer() {
        let said_to_be =
            |share: f64| Twisted { critical_rad: share * Twisted::straight().critical_rad, ..Twisted::straight() };
        assert!(said_to_be(1.2).error(BELOW, &case()).is_none(), "what it calls below is above: all runs grow");
        assert!(said_to_be(0.8).error(ABOVE, &case()).is_none(), "what it calls above is below: all runs die away");
    }

    #[test]
    fn a_formula_that_is_right_at_one_stiffness_only_fails_at_another() {
        // 2π √(3 B/C) in place of 2π √3 B/C: the same for C = B, 1.7 times too much for C = 3 B, where no run dies away
        for (ratio, right) in [(1.0, true), (3.0, false)] {
            let said = Twisted { critical_rad: TAU * (3.0_f64 / ratio).sqrt(), ..Twisted::ring(ratio) };
            let found = said.error(BELOW, &case()).map(|(_, error)| error);
            assert_eq!(found.is_some_and(|error| error <= ERROR_MAX), right, "C/B {ratio}: {found:?}");
        }
    }
}
