//! Incline: a box and a tube on a slope stick below tan(angle) = μ and slide above, as far as Coulomb's law predicts.

use super::super::bench::StepHarness;
use super::common::{GRAVITY, plain_body, plain_tube};
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Table, each, span, table, worst};
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_core::{Body, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Tube, TubeSpec};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct Incline;

const BODIES: [&str; 2] = ["box", "tube"];
const FRICTION: f64 = 0.3;
/// tan(angle)/μ.
const SLOPES: [f64; 13] = [0.9, 0.94, 0.96, 0.97, 0.98, 0.99, 1.0, 1.01, 1.02, 1.03, 1.04, 1.06, 1.1];
const QUICK_SLOPES: [f64; 2] = [0.98, 1.02];
/// The claim's tolerance on tan(angle).
const TOLERANCE: f64 = 0.02;
/// A body that moves less than this in a second sticks, metres: a thirtieth of its distance at 2 % above the angle.
const STICKS_M: f64 = 1e-3;
const SECONDS: f64 = 1.0;
const DT_S: f64 = 0.004;

/// A body on a slope.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    body: &'static str,
    /// tan(angle)/μ.
    slope: f64,
}

/// The result of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    /// Distance slid in a second, metres.
    slid_m: Option<f64>,
    /// Distance by Coulomb's law.
    theory_m: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for Incline {
    type Row = Row;
    const NAME: &'static str = "incline";
    const TITLE: &'static str = "box and tube on a slope: angle at which sliding begins, μ = 0.3";
    const TABLE: fn(&[Row]) -> Table = table!(|r| body: r.case.body, "tan/μ"(2): r.case.slope,
        slid_mm(3): r.slid_m.map(|slid_m| 1e3 * slid_m), Coulomb_mm(3): 1e3 * r.theory_m);

    fn cases(quick: bool) -> Vec<Case> {
        let slopes = if quick { &QUICK_SLOPES[..] } else { &SLOPES[..] };
        each!(body in BODIES, &slope in slopes => Case { body, slope })
    }

    fn measure(case: &Case) -> Option<Found> {
        let angle = libm::atan(case.slope * FRICTION);
        let pull = GRAVITY * (libm::sin(angle) - FRICTION * libm::cos(angle));
        let theory_m = 0.5 * pull.max(0.0) * SECONDS * SECONDS;
        Some(Found { slid_m: slid(case, angle), theory_m })
    }

    fn figure(rows: &[Row]) -> Figure {
        let mut theory: Vec<_> = rows.iter().map(|r| (r.case.slope, 1e3 * r.theory_m)).collect();
        theory.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (low, high) = span(theory.iter().map(|p| p.1), false);
        let mut layers = vec![Layer::dashed("Coulomb", Colour::Grey, theory)];
        for (body, colour) in BODIES.into_iter().zip(Colour::LINES) {
            let here = rows.iter().filter(|r| r.case.body == body);
            layers.push(Layer::dots(body, colour, here.filter_map(|r| Some((r.case.slope, 1e3 * r.slid_m?)))));
        }
        let (x, y) =
            (Axis::linear("tan(angle)/μ", 0.89, 1.11), Axis::linear("displacement in the first second, mm", low, high));
        Figure::single("On a slope, μ = 0.3", x, y, layers)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |body: &str| {
            let here = || rows.iter().filter(|r| r.case.body == body);
            let slides = |r: &&Row| r.slid_m.is_none_or(|slid| slid.abs() > STICKS_M);
            let slid_below = here().filter(slides).map(|r| 1.0 - r.case.slope);
            let stuck_above = here().filter(|r| !slides(r)).map(|r| r.case.slope - 1.0);
            let off = worst(slid_below.chain(stuck_above).chain([0.0]));
            let claim = format!("{body}: transition from stick to slip at tan(angle) = μ, relative error");
            Finding::at_most(claim, off, TOLERANCE * 0.999)
        };
        BODIES.into_iter().map(of).collect()
    }
}

/// The distance that the body slides down the slope.
fn slid(case: &Case, angle: f64) -> Option<f64> {
    let rotation = DQuat::from_rotation_y(angle);
    let ground = Obstacle { rotation, friction: FRICTION, ..Obstacle::new("slope", Solid::Plane) };
    let (down, up) = (rotation * DVec3::X, rotation * DVec3::Z);
    let gravity = DVec3::NEG_Z * GRAVITY;
    let agent: Box<dyn Agent> = if case.body == "box" {
        let half_extents_m = DVec3::new(0.1, 0.1, 0.02);
        let plain = plain_body(Solid::Box { half_extents_m }, up * half_extents_m.z, 1.0);
        let spec = RigidSpec { rotation, friction: FRICTION, gravity, ..plain };
        Box::new(RigidBody::new(spec).ok()?)
    } else {
        let radius_m = 0.015;
        let plain = plain_tube(vec![up * radius_m, up * radius_m + down * 0.4], radius_m, 20);
        Box::new(Tube::new(TubeSpec { friction: FRICTION, gravity, ..plain }).ok()?)
    };
    let mut stage = StepHarness::among(&[ground])?;
    let id = stage.add(agent, 1.0 / DT_S)?;
    let before = middle(stage.own(id))?;
    stage.run_to(SECONDS).ok()?;
    Some((middle(stage.own(id))? - before).dot(down))
}

/// The centre of mass; for a tube, the mean of its nodes weighted by length.
fn middle(snapshot: &Snapshot) -> Option<DVec3> {
    match &snapshot.body {
        Body::Curve(curve) => {
            let halves = curve.positions.windows(2).zip(curve.arc_m.windows(2));
            let (sum, length) = halves.fold((DVec3::ZERO, 0.0), |(sum, length), (x, s)| {
                (sum + (x[0] + x[1]) * (0.5 * (s[1] - s[0])), length + s[1] - s[0])
            });
            Some(sum / length)
        }
        other => other.probe(0.0).map(|(x, _)| x),
    }
}
