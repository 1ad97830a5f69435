//! The coupling error: the same scene with members of unequal steps, and with very fine ones for all.
//!
//! Both runs are compared at every whole multiple of the longer step. The error of each agent's own longer step is included; at a ratio
//! of 1 there is little else.

use super::super::energy_bench::Play;
use super::super::scenes::{Scene, scene, ways};
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, claims, count_of, each, span, table,
    worst, worst_of,
};
use glam::DVec3;
use metachron_core::{AgentId, Anchor};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct CouplingError;

const SCENES: [&str; 4] = ["oblique-blow", "ball-on-box", "tube-on-bar", "crossing"];
const RATIOS: [u32; 5] = [1, 3, 10, 30, 100];
const QUICK_RATIOS: [u32; 2] = [1, 10];
/// The shorter step, and that of the other run, a quarter of it, nanoseconds.
const FAST_NS: u64 = 1_000_000;
const ORACLE_NS: u64 = FAST_NS / 4;
const SECONDS: f64 = 1.0;
const QUICK_SECONDS: f64 = 0.4;
/// Bounds for two balls: of the impulse, as close as against the closed form, and of the momentum, closer.
const BLOW_MAX: f64 = 0.01;
const MOMENTUM_MAX: f64 = 0.005;
/// How far a body that rests on another may be from its place with fine steps, metres.
const REST_MAX_M: f64 = 2e-3;

/// A scene, the ratio of the steps, and which agent has the short one.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    scene: &'static str,
    ratio: u32,
    first_is_fast: bool,
    seconds: f64,
}

/// The difference of the two runs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    /// The number of comparisons of both runs.
    looks: usize,
    /// Positions of the followed points: root mean square and greatest distance, metres.
    position_rms_m: f64,
    position_max_m: f64,
    /// Difference of the total momenta at the last comparison, as a share of the impulse exchanged with fine steps.
    momentum: f64,
    /// Difference of the impulses exchanged up to there, as the same share.
    impulse: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for CouplingError {
    type Row = Row;
    const NAME: &'static str = "error";
    const TITLE: &'static str = "coupling error: the same scene with unequal steps and with very fine ones for all";
    const TABLE: fn(&[Row]) -> Table = table!(|r| scene: r.case.scene, ratio: r.case.ratio,
        first_is_fast: r.case.first_is_fast, looks: r.looks, rms_mm(4): 1e3 * r.position_rms_m,
        max_mm(4): 1e3 * r.position_max_m, momentum_error(6): r.momentum, impulse_error(6): r.impulse);

    fn cases(quick: bool) -> Vec<Case> {
        let (ratios, seconds) = if quick { (&QUICK_RATIOS[..], QUICK_SECONDS) } else { (&RATIOS[..], SECONDS) };
        each!(scene in SCENES, &ratio in ratios, &first_is_fast in ways(ratio == 1) =>
            Case { scene, ratio, first_is_fast, seconds })
    }

    fn measure(case: &Case) -> Option<Found> {
        let slow_ns = FAST_NS * u64::from(case.ratio);
        let steps_ns = if case.first_is_fast { [FAST_NS, slow_ns] } else { [slow_ns, FAST_NS] };
        let coupled = trail(case, slow_ns, steps_ns)?;
        let oracle = trail(case, slow_ns, [ORACLE_NS; 2])?;
        let pairs = coupled.samples.iter().flatten().zip(oracle.samples.iter().flatten());
        let squares: Vec<f64> = pairs.map(|(a, b)| a.distance_squared(*b)).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        Some(Found {
            looks: coupled.samples.len(),
            position_rms_m: mean.sqrt(),
            position_max_m: worst(squares).sqrt(),
            momentum: coupled.momentum.distance(oracle.momentum) / oracle.impulse_n_s,
            impulse: (coupled.impulse_n_s - oracle.impulse_n_s).abs() / oracle.impulse_n_s,
        })
    }

    fn figure(rows: &[Row]) -> Figure {
        let panels = vec![
            panel(rows, "position", "position, rms over the run, mm", |r| 1e3 * r.position_rms_m),
            panel(rows, "impulse", "impulse error / impulse with fine steps", |r| r.impulse),
        ];
        Figure::new("Coupling error against steps of 4 kHz for all", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |scene: &str, number: fn(&Row) -> f64| worst_of(rows, |r| r.case.scene == scene, number);
        claims![
            "runs that stopped early" => count_of(rows, |r| !r.position_rms_m.is_finite()), at_most 0.0;
            "two balls: impulse error over the impulse with fine steps" => of(SCENES[0], |r| r.impulse), at_most BLOW_MAX;
            "two balls: momentum error over the impulse" => of(SCENES[0], |r| r.momentum), at_most MOMENTUM_MAX;
            "ball on box: position error, m" => of(SCENES[1], |r| r.position_max_m), at_most REST_MAX_M;
        ]
    }
}

/// One quantity of all scenes over the ratio.
fn panel(rows: &[Row], title: &str, label: &'static str, get: fn(&Row) -> f64) -> Panel {
    let least = |v: f64| if v < 1e-9 { 1e-9 } else { v };
    let mut layers = Vec::new();
    for (name, colour) in SCENES.into_iter().zip(Colour::LINES) {
        let points = |way: bool| {
            let there = move |r: &&Row| r.case.scene == name && (r.case.first_is_fast == way || r.case.ratio == 1);
            rows.iter().filter(there).map(|r| (f64::from(r.case.ratio), least(get(r))))
        };
        layers.push(Layer::line(name, colour, points(true)));
        layers.push(Layer::dashed(format!("{name}, first slow"), colour, points(false)));
    }
    let (low, high) = span(rows.iter().map(|r| least(get(r))), true);
    let x = Axis::log("ratio of step rates", 0.8, 125.0);
    Panel::new(title, x, Axis::log(label, low, 30.0 * high), layers)
}

/// The record of one run: positions at every comparison, momentum and impulse at the last one.
#[derive(Default)]
struct Trail {
    samples: Vec<Vec<DVec3>>,
    momentum: DVec3,
    impulse_n_s: f64,
}

/// Plays the scene and records it at every whole multiple of `every_ns`, up to the case's length; `None` where it broke off.
fn trail(case: &Case, every_ns: u64, steps_ns: [u64; 2]) -> Option<Trail> {
    let Scene { mut play, points, .. } = scene(case.scene, steps_ns.map(|ns| 1e9 / ns as f64))?;
    let mut trail = Trail::default();
    for sample in 1..=libm::round(case.seconds * 1e9) as u64 / every_ns {
        play.stage.run_to((sample * every_ns) as f64 * 1e-9).ok()?;
        trail.samples.push(points.iter().map(|(id, anchor)| position_m(&play, *id, *anchor)).collect());
    }
    (trail.momentum, trail.impulse_n_s) = (play.stage.momentum_n_s(), play.stage.impulse_n_s());
    Some(trail)
}

fn position_m(play: &Play, id: AgentId, anchor: Anchor) -> DVec3 {
    play.stage.own(id).body.point(anchor).map_or(DVec3::NAN, |(x, _)| x)
}
