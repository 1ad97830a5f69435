//! Tubes in contact at two rates: on a bar, between two fingers, across another tube, rates 1:1 to 1:100 in both directions.

use super::super::energy_bench::Play;
use super::super::scenes::{Scene, WITH_TUBES, scene, ways};
use super::common::COMMON_ENERGY_MAX;
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, blank, claims, count_of, each, table,
    worst, worst_of,
};
use glam::DVec3;
use metachron_core::{AgentId, Anchor};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct Pairs;

const RATIOS: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
const FAST_HZ: f64 = 1000.0;
const SECONDS: f64 = 2.5;
/// From here on everything is at rest.
const REST_S: f64 = 2.0;
const DEPTH_MAX_M: f64 = 0.005;

/// A scene, the ratio of its rates, and which agent has the fast one.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    scene: &'static str,
    ratio: f64,
    /// Whether the tube (of two tubes the one clamped at both ends) has the fast rate.
    first_is_fast: bool,
}

/// The results of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    slow_hz: f64,
    /// Peak of the energy above that at rest, as a multiple of the start's.
    peak: f64,
    /// The deepest overlap of a pair at rest, metres.
    depth_m: f64,
    /// Mean speed at rest of the fastest followed point, m/s.
    creep_m_s: f64,
    contacts: u32,
}

type Row = Measured<Case, Found>;

impl Experiment for Pairs {
    type Row = Row;
    const NAME: &'static str = "tubes";
    const TITLE: &'static str = "tubes on a bar, in a gripper and across each other, step rates 1:1 to 1:100";
    const TABLE: fn(&[Row]) -> Table = table!(|r| scene: r.case.scene, ratio: r.case.ratio,
        first_is_fast: r.case.first_is_fast, peak(4): r.peak, depth_mm(4): 1e3 * r.depth_m,
        creep_mm_s(4): 1e3 * r.creep_m_s, contacts: r.contacts);

    fn cases(quick: bool) -> Vec<Case> {
        let ratios = if quick { &RATIOS[3..4] } else { &RATIOS[..] };
        each!(scene in WITH_TUBES, &ratio in ratios, &first_is_fast in ways(ratio == 1.0) => Case { scene, ratio, first_is_fast })
    }

    fn measure(case: &Case) -> Option<Found> {
        let slow_hz = FAST_HZ / case.ratio;
        let unsettled = Found { slow_hz, ..blank() };
        Some(settle_pair(case, slow_hz).unwrap_or(unsettled))
    }

    fn figure(rows: &[Row]) -> Figure {
        let panel = |label, (low, high), limit: f64, get: fn(&Row) -> f64| {
            let mut layers = Vec::new();
            for (name, colour) in WITH_TUBES.into_iter().zip(Colour::LINES) {
                let here = |way| rows.iter().filter(move |r| r.case.scene == name && r.case.first_is_fast == way);
                let points = |way| here(way).map(|r| (r.case.ratio, get(r).max(low)));
                layers.push(Layer::line(format!("{name}, tube fast"), colour, points(true)));
                layers.push(Layer::dots(format!("{name}, tube slow"), colour, points(false)));
            }
            layers.push(Layer::limit("limit", [0.8, 125.0], limit));
            Panel::new("", Axis::log("ratio of step rates", 0.8, 125.0), Axis::log(label, low, high), layers)
        };
        let panels = vec![
            panel("peak energy / start", (0.5, 100.0), COMMON_ENERGY_MAX, |r| r.peak),
            panel("overlap at rest, m", (1e-7, 0.1), DEPTH_MAX_M, |r| r.depth_m),
            panel("creep at rest, m/s", (1e-7, 1.0), 1e-3, |r| r.creep_m_s),
        ];
        Figure::new("Tubes in contact at two rates, the faster of 1 kHz", 3, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        claims![
            "peak energy over the start's" => worst_of(rows, |_| true, |r| r.peak), at_most COMMON_ENERGY_MAX;
            "overlap at rest at 50 Hz and more, m" => worst_of(rows, |r| r.slow_hz >= 50.0, |r| r.depth_m), at_most DEPTH_MAX_M;
            "pairs without contact at the end" => count_of(rows, |r| r.contacts == 0), at_most 0.0;
        ]
    }
}

fn settle_pair(case: &Case, slow_hz: f64) -> Option<Found> {
    let rates_hz = if case.first_is_fast { [FAST_HZ, slow_hz] } else { [slow_hz, FAST_HZ] };
    let Scene { mut play, points, zero_j } = scene(case.scene, rates_hz)?;
    let start_j = play.energy_j() - zero_j;
    let (mut peak, mut depth_m, mut contacts) = (1.0, 0.0_f64, 0_u32);
    let mut since: Option<(f64, Vec<DVec3>)> = None;
    let places = |play: &Play| -> Vec<DVec3> {
        let place = |(id, anchor): &(AgentId, Anchor)| play.stage.own(*id).body.point(*anchor).map(|(x, _)| x);
        points.iter().filter_map(place).collect()
    };
    while play.stage.time().as_secs_f64() < SECONDS && peak < 1e3 {
        play.stage.step().ok()?;
        peak = worst([peak, (play.energy_j() - zero_j) / start_j]);
        let now_s = play.stage.time().as_secs_f64();
        if now_s > REST_S {
            since.get_or_insert_with(|| (now_s, places(&play)));
            let pairs = play.stage.pairs();
            (depth_m, contacts) = (depth_m.max(pairs.depth_m), contacts.max(pairs.contacts));
        }
    }
    let (from_s, before) = since?;
    let span_s = play.stage.time().as_secs_f64() - from_s;
    let creep = before.iter().zip(places(&play)).map(|(a, b)| a.distance(b) / span_s);
    Some(Found { slow_hz, peak, depth_m, creep_m_s: worst(creep), contacts })
}
