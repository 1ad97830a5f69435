//! `chart contact`: the error of contacts over their cost, by levels of the solve, beside rapier3d, MuJoCo and PyBullet.
//!
//! In: scenes of `bench contact`, the most factors of a solve, files of peers. Out: rows of CPU time, depth, drift and energy made, in one chart.
//! Never here: how a scene is stepped and measured.

use super::course::Course;
use super::peer::PeerRun;
use super::stage::Stage;
use super::{Case as BenchCase, Row as BenchRow, cases, peer_row, row};
use crate::bench::rig::peers::Peers;
use crate::chart::{
    Axis, Experiment, Figure, Finding, LiveColumns, Mark, Measured, Panel, Table, claims, distinct, lines, span, table,
    worst_of,
};
use anyhow::Context;
use metachron_console::output::message;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct SolveLevels;

/// The most factors of a solve; `None` for as many as the laws take.
const FACTORS: [Option<u32>; 7] = [Some(1), Some(2), Some(3), Some(5), Some(8), Some(12), None];
/// Iterations of rapier3d's solver.
const ITERATIONS: [usize; 4] = [1, 4, 16, 64];
/// CPU time and errors of other engines in the same scenes, on one core and by their default settings.
const PEERS: [&str; 2] = [include_str!("mujoco.json"), include_str!("pybullet.json")];

const OURS: &str = "metachron";
const RAPIER: &str = "rapier3d";
/// The level of other engines.
const DEFAULT_SETTINGS: &str = "default settings";
const EXACT: &str = "exact";
/// Smaller errors are drawn here, in the unit of the measure.
const LEAST: f64 = 1e-5;

/// The error that is charted of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Measure {
    /// Depth at rest, mm.
    Depth,
    /// How far a body went in the last half second at most, mm.
    Drift,
    /// By how much the highest body sank, mm.
    Sinking,
    /// Energy made, J.
    Energy,
}

/// A scene of `bench contact`, and what counts in it.
struct Shown {
    test: &'static str,
    title: &'static str,
    measure: Measure,
}

const fn shown(test: &'static str, title: &'static str, measure: Measure) -> Shown {
    Shown { test, title, measure }
}

/// In quick charts the first two.
const SHOWN: [Shown; 6] = [
    shown("tower, off by 12 mm, e 0", "a tower of 20 boxes: how far it sank, mm", Measure::Sinking),
    shown("pendulum", "a double pendulum, 20 s: energy made, J", Measure::Energy),
    shown("ropes", "40 ropes: depth at rest, mm", Measure::Depth),
    shown("mess_small", "a jam of 216 boxes: depth at rest, mm", Measure::Depth),
    shown("bin, seed 2", "12 unlike bodies in a bin: depth at rest, mm", Measure::Depth),
    shown("pile, one problem, e 0", "a pile of 1000 boxes: drift at rest, mm", Measure::Drift),
];

/// A scene stepped by an engine at one of its levels.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    test: &'static str,
    engine: String,
    /// Our factors or rapier3d's iterations, "exact", or "default settings".
    level: String,
}

/// Its measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Found {
    /// CPU milliseconds a simulated second.
    cpu_ms_per_s: f64,
    /// Median and 99th percentile of a step, CPU milliseconds.
    ms_p50: f64,
    ms_p99: f64,
    /// The deepest overlap before and within the last half second, mm.
    landing_mm: f64,
    rest_mm: f64,
    /// How far a body went in the last half second at most, mm.
    drift_mm: f64,
    /// By how much the highest body sank, mm.
    sank_mm: f64,
    /// The most energy above its least so far, and how much was lost, J; NaN of a peer's loss.
    made_j: f64,
    lost_j: f64,
}

type Row = Measured<Case, Found>;

impl Found {
    fn of(run: &BenchRow, seconds: f64) -> Self {
        Self {
            cpu_ms_per_s: run.cpu_s * 1e3 / seconds,
            ms_p50: run.ms_per_step_p50,
            ms_p99: run.ms_per_step_p99,
            landing_mm: run.landing_m * 1e3,
            rest_mm: run.rest_m * 1e3,
            drift_mm: run.drift_most_m * 1e3,
            sank_mm: run.sank_m * 1e3,
            made_j: run.made_j,
            lost_j: run.lost_j,
        }
    }

    fn error(&self, measure: Measure) -> f64 {
        match measure {
            Measure::Depth => self.rest_mm,
            Measure::Drift => self.drift_mm,
            Measure::Sinking => self.sank_mm.abs(),
            Measure::Energy => self.made_j,
        }
    }
}

/// The scene of `bench contact` of this name.
fn scene(test: &str) -> Option<BenchCase> {
    cases(false).into_iter().find(|case| case.name() == test)
}

fn peers() -> impl Iterator<Item = Peers<PeerRun>> {
    PEERS.iter().map(|text| serde_json::from_str(text).expect("a file that the tests have read"))
}

fn measured(case: &Case) -> anyhow::Result<Found> {
    let BenchCase { seconds, stage, .. } = scene(case.test).context("no such scene")?;
    if let Some(peer) = peers().find(|peer| name(peer) == case.engine) {
        return Ok(Found::of(&peer_row(&peer, peer.of(case.test).context("no such run of it")?), seconds));
    }
    let stage: Stage = stage()?;
    let course = if case.engine == RAPIER {
        let mut world = stage.plain_world().context("rapier3d does not take it")?;
        world.integration_parameters.num_solver_iterations = case.level.parse()?;
        Course::of_plain_world(&mut world, seconds)
    } else {
        Course::of_cluster(&mut stage.play()?.within(case.level.parse().ok()), seconds)?
    };
    Ok(Found::of(&row(case.test.to_owned(), &case.engine, &course), seconds))
}

/// An engine and the processor that it ran on.
fn name(peer: &Peers<PeerRun>) -> String {
    format!("{} on {}", peer.engine, peer.machine)
}

impl Experiment for SolveLevels {
    type Row = Row;
    const NAME: &'static str = "levels";
    const TITLE: &'static str = "Error of contacts over their cost, by levels of the solve";
    const ALONE: bool = true;
    const LIVE: LiveColumns = LiveColumns::These(&["ms_per_s", "p50_ms", "p99_ms"]);
    const TABLE: fn(&[Row]) -> Table = table!(|r| test: r.case.test, engine: r.case.engine, level: r.case.level,
        ms_per_s(1): r.cpu_ms_per_s, p50_ms(3): r.ms_p50, p99_ms(3): r.ms_p99, landing_mm(3): r.landing_mm,
        rest_mm(3): r.rest_mm, drift_mm(4): r.drift_mm, sank_mm(2): r.sank_mm, made_j(5): r.made_j);

    fn cases(quick: bool) -> Vec<Case> {
        let mut all = Vec::new();
        for Shown { test, .. } in &SHOWN[..if quick { 2 } else { SHOWN.len() }] {
            let mut add = |engine: &str, level: String| {
                all.push(Case { test, engine: engine.to_owned(), level });
            };
            for most in FACTORS {
                add(OURS, most.map_or_else(|| EXACT.to_owned(), |most| most.to_string()));
            }
            if scene(test).and_then(|case| (case.stage)().ok()).is_some_and(|stage| stage.plain_world().is_some()) {
                ITERATIONS.iter().for_each(|count| add(RAPIER, count.to_string()));
            }
            peers()
                .filter(|peer| peer.of(test).is_some())
                .for_each(|peer| add(&name(&peer), DEFAULT_SETTINGS.to_owned()));
        }
        all
    }

    fn measure(case: &Case) -> Option<Found> {
        let reported = |error| message(&format!("{}, {} at {}: {error:#}", case.test, case.engine, case.level));
        measured(case).map_err(reported).ok()
    }

    fn figure(rows: &[Row]) -> Figure {
        let engines = distinct(rows.iter().map(|row| row.case.engine.as_str()));
        let panel = |Shown { test, title, measure }: &Shown| {
            let here: Vec<_> = rows.iter().filter(|row| row.case.test == *test).collect();
            let error = |row: &Row| if row.error(*measure) < LEAST { LEAST } else { row.error(*measure) };
            let (least, most) = span(here.iter().map(|row| error(row)), true);
            let (low, high) = span(here.iter().map(|row| row.cpu_ms_per_s), true);
            let points = |engine: &str| {
                let own = here.iter().filter(|row| row.case.engine == engine);
                let points = own.map(|row| (row.cpu_ms_per_s, error(row)));
                points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect::<Vec<_>>()
            };
            let layers = lines(engines.iter().copied(), points);
            let layers = layers.filter(|layer| !matches!(&layer.mark, Mark::Line(points) if points.is_empty()));
            let x = Axis::log("CPU time a simulated second, ms", low, high);
            Panel::new(*title, x, Axis::log("", least, most), layers)
        };
        let measured = |shown: &&Shown| rows.iter().any(|row| row.case.test == shown.test);
        let panels: Vec<_> = SHOWN.iter().filter(measured).map(panel).collect();
        Figure::new(Self::TITLE, panels.len().clamp(1, 3), panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let from_five = |level: &str| level == EXACT || level.parse().is_ok_and(|most: u32| most >= 5);
        let tower = |row: &Row| row.case.test == SHOWN[0].test && row.case.engine == OURS && from_five(&row.case.level);
        let most = |of: fn(&Row) -> f64| worst_of(rows, tower, of);
        claims![
            "from five factors a solve on: by how much the tower sinks, mm" => most(|row| row.sank_mm.abs()), at_most 1.0;
            "how far a box of it creeps in half a second at rest, mm" => most(|row| row.drift_mm), at_most 0.01;
            "energy that it makes, J (a box falls by its height with 0.08 J)" => most(|row| row.made_j), at_most 2e-3;
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_of_the_chart_is_one_of_the_benchmark_and_every_peers_file_is_read() {
        assert!(SHOWN.iter().all(|shown| scene(shown.test).is_some()));
        assert_eq!(peers().count(), PEERS.len());
        let cases = SolveLevels::cases(true);
        for engine in peers().map(|peer| name(&peer)).chain([OURS.to_owned(), RAPIER.to_owned()]) {
            assert!(cases.iter().any(|case| case.engine == engine), "{engine}");
        }
    }
}
