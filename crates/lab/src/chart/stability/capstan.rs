//! Capstan: the load at which a tube around a fixed cylinder slips.
//!
//! Both ends are pulled by dead loads; one is raised slowly until the other end moves. Euler and Eytelwein: T₂/T₁ = exp(μφ).
//! The tube is thin compared with the cylinder, so that it does not matter that its tension acts at its axis and friction at its
//! surface (docs/theory/contact.md, eq. 14, gives the difference for thicker tubes).

use super::super::bench::StepHarness;
use super::common::{dead_load, plain_tube};
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Table, claims, each, table, worst_of};
use glam::{DQuat, DVec3};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rod::{Tube, TubeSpec};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The experiment.
pub(in super::super) struct Capstan;

/// Angles of wrap, radians, and coefficients of friction.
const WRAPS: [f64; 5] = [FRAC_PI_2, PI, 1.5 * PI, TAU, 1.25 * TAU];
const FRICTIONS: [f64; 3] = [0.1, 0.3, 0.5];
/// Values of the claim. From a full turn on the tube creeps by tens of micrometres in a second and slips 9 % early.
const CLAIMED_WRAPS: [f64; 2] = [FRAC_PI_2, PI];
const CLAIMED_FRICTION: f64 = 0.3;
const TOLERANCE: f64 = 0.05;
/// Radii of the cylinder and of the tube, metres.
const DRUM_M: f64 = 0.1;
const TUBE_M: f64 = 0.001;
/// How far a turn lies beside the one before, metres: they do not touch, and the angle of contact is that of a circle to 5e-5.
const PITCH_M: f64 = 0.005;
/// Straight part at each end, metres.
const TAIL_M: f64 = 0.05;
/// Segments per radian of wrap: 2.4° each.
const SEGMENTS_A_RADIAN: f64 = 24.0;
/// The load at the end that is not raised, newtons.
const LOAD_N: f64 = 2.0;
/// The other load starts at the first share of the theoretical one, below all that the claim allows, and rises by the second share per second up to
/// the third.
const RAMP: [f64; 3] = [0.92, 0.2, 1.4];
const DT_S: f64 = 0.002;
/// Seconds for both loads to come on and the tube to settle.
const SETTLE_S: f64 = 0.4;
/// The end that is not raised has slipped when it moved so far, metres.
const SLIP_M: f64 = 5e-4;

/// An angle and a coefficient.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    friction: f64,
    wrap_rad: f64,
}

/// The result of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    /// exp(μφ).
    theory: f64,
    /// T₂/T₁ at which the tube slipped; empty if it never did.
    ratio: Option<f64>,
}

type Row = Measured<Case, Found>;

impl Found {
    fn error(&self) -> f64 {
        self.ratio.map_or(f64::NAN, |ratio| (ratio / self.theory - 1.0).abs())
    }
}

impl Experiment for Capstan {
    type Row = Row;
    const NAME: &'static str = "capstan";
    const TITLE: &'static str = "capstan: tension ratio at which a tube around a fixed cylinder slips";
    const TABLE: fn(&[Row]) -> Table = table!(|r| friction(1): r.case.friction, wrap_rad(4): r.case.wrap_rad,
        "exp(μφ)"(4): r.theory, ratio(4): r.ratio, "ratio / exp(μφ)"(4): r.ratio.map(|ratio| ratio / r.theory));

    fn cases(quick: bool) -> Vec<Case> {
        let frictions = if quick { &[CLAIMED_FRICTION][..] } else { &FRICTIONS[..] };
        let wraps = if quick { &CLAIMED_WRAPS[..] } else { &WRAPS[..] };
        each!(&friction in frictions, &wrap_rad in wraps => Case { friction, wrap_rad })
    }

    fn measure(case: &Case) -> Option<Found> {
        Some(Found { theory: libm::exp(case.friction * case.wrap_rad), ratio: slip_ratio(case) })
    }

    fn figure(rows: &[Row]) -> Figure {
        let top = rows.iter().flat_map(|r| [r.theory, r.ratio.unwrap_or(1.0)]).fold(2.0, f64::max) * 1.2;
        let mut layers = Vec::new();
        for (friction, colour) in FRICTIONS.into_iter().zip(Colour::LINES) {
            let here: Vec<&Row> = rows.iter().filter(|r| r.case.friction == friction).collect();
            let Some(far) = here.iter().map(|r| r.case.wrap_rad).reduce(f64::max) else { continue };
            let theory = (0..=60).map(|k| far * f64::from(k) / 60.0).map(|phi| (phi, libm::exp(friction * phi)));
            let dots = here.iter().filter_map(|r| Some((r.case.wrap_rad, r.ratio?)));
            layers.push(Layer::dashed(format!("exp(μφ), μ = {friction}"), colour, theory));
            layers.push(Layer::dots(format!("measured, μ = {friction}"), colour, dots));
        }
        let (x, y) = (Axis::linear("angle of wrap φ, rad", 0.0, 8.0), Axis::log("T₂/T₁ at which it slips", 1.0, top));
        Figure::single("Capstan: slip of a tube around a fixed cylinder", x, y, layers)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let claimed = |r: &Row| r.case.friction == CLAIMED_FRICTION && CLAIMED_WRAPS.contains(&r.case.wrap_rad);
        claims![
            "T₂/T₁ at slip against exp(μφ), μ = 0.3, φ = π/2, π: relative error" =>
                worst_of(rows, claimed, |r| r.error()), at_most TOLERANCE;
        ]
    }
}

/// The path: a tail along the tangent, the wrap, another tail. The cylinder's axis is y.
fn path(wrap_rad: f64) -> Vec<DVec3> {
    let reach = DRUM_M + TUBE_M;
    let on = |phi: f64| DVec3::new(libm::sin(phi) * reach, PITCH_M * phi / TAU, libm::cos(phi) * reach);
    let along = |phi: f64| DVec3::new(libm::cos(phi), 0.0, -libm::sin(phi));
    let count = libm::ceil(wrap_rad / 0.1) as u32;
    let mut path = vec![on(0.0) - along(0.0) * TAIL_M, on(0.0) - along(0.0) * 0.5 * TAIL_M];
    path.extend((0..=count).map(|k| on(wrap_rad * f64::from(k) / f64::from(count))));
    path.extend([0.5, 1.0].map(|share| on(wrap_rad) + along(wrap_rad) * (share * TAIL_M)));
    path
}

fn drum(case: &Case) -> Obstacle {
    let solid = Solid::Cylinder { radius_m: DRUM_M, half_height_m: 0.5 };
    let rotation = DQuat::from_rotation_x(FRAC_PI_2);
    Obstacle { rotation, friction: case.friction, ..Obstacle::new("drum", solid) }
}

fn tube(case: &Case) -> Option<Tube> {
    let segments = (case.wrap_rad * SEGMENTS_A_RADIAN * (1.0 + 2.0 * TAIL_M / (case.wrap_rad * DRUM_M))) as usize;
    let mut spec =
        TubeSpec { friction: case.friction, damping_per_s: 5.0, ..plain_tube(path(case.wrap_rad), TUBE_M, segments) };
    // its rest shape follows the drum, so bending takes no force; with even less stiffness a taut tube chatters and creeps
    (spec.section.ea_n, spec.section.ga_n) = (2e3, 1e3);
    (spec.section.ei_n_m2, spec.section.gj_n_m2) = (1e-3, 1e-3);
    spec.section.mass_per_length_kg_m = 0.05;
    Tube::new(spec).ok()
}

/// Raises the load at the end until the start has moved; returns the ratio of the loads then.
fn slip_ratio(case: &Case) -> Option<f64> {
    let tube = tube(case)?;
    let theory = libm::exp(case.friction * case.wrap_rad);
    let [from, rate, to] = RAMP;
    let length = tube.length_m();
    let (first, last) = (DVec3::NEG_X, DVec3::new(libm::cos(case.wrap_rad), 0.0, -libm::sin(case.wrap_rad)));
    let mut stage = StepHarness::among(&[drum(case)])?;
    let id = stage.add(Box::new(tube), 1.0 / DT_S)?;
    let mut rested = None;
    loop {
        let t = stage.time().as_secs_f64();
        let ratio = theory * (from + rate * (t - SETTLE_S).max(0.0));
        if ratio > theory * to {
            return None;
        }
        let on = (t / (0.5 * SETTLE_S)).min(1.0);
        let loads = [dead_load(0.0, first * (LOAD_N * on)), dead_load(length, last * (LOAD_N * on * ratio))];
        stage.member(id).forces = loads.into();
        stage.step().ok()?;
        let (start, _) = stage.own(id).body.probe(0.0)?;
        if t < SETTLE_S {
            rested = Some(start);
        } else if rested.is_some_and(|rested| start.distance(rested) > SLIP_M) {
            return Some(ratio);
        }
    }
}
