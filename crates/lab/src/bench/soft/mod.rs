//! `bench soft`: the cost of a step of soft bodies, by number of nodes and by their contacts, beside another engine's.
//!
//! In: cubes of tissue held, lying, loaded and shaken, a sheet hung and folded, the demonstration's tube with both kinds of wall.
//! Out: rows of CPU time a step on one core, and how far the cube sags. Never here: how a step is made, how peers are run.

pub(super) mod bodies;
mod peer;

use super::super::args::BenchArgs;
use super::rig::machine::processor;
use super::rig::peers::Peers;
use super::rig::play::{Bound, Play, Series};
use super::rig::shaken_floor::ShakenFloor;
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Table, blank, exponent, table};
use anyhow::Context;
use bodies::{CUBE_M, DemoTube};
use glam::DVec3;
use metachron_console::output::message;
use metachron_contact::Agent;
use metachron_models::rod::WallModel;
use metachron_models::soft::{SoftBody, SoftMaterial, SoftSpec};
use peer::Cube;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The subject.
pub(super) struct Soft;

/// Length of a step of soft bodies, seconds.
const STEP_S: f64 = 0.01;
/// Length of a step of the tube, seconds: as its scene asks for.
const TUBE_STEP_S: f64 = 1.0 / 300.0;
/// Length of a step while a sheet falls and folds, seconds: its layers must not pass each other in one.
const FOLDING_STEP_S: f64 = 1.0 / 480.0;
/// How long it takes a sheet to fold and lie still, seconds.
const FOLDING_S: f64 = 1.2;
/// Length of a step of the finer solution that shapes at rest are held against, seconds, and how many of these it makes.
const FINE_STEP_S: f64 = 2.5e-3;
const FINE_STEPS: u32 = 200;
/// Damping of the finer solution, 1/s: near the critical one of the cube, and without effect on where it rests.
const FINE_DAMPING_PER_S: f64 = 80.0;
/// Cubes of more nodes are not solved a second time: some minutes.
const CHECKED_NODES_MAX: usize = 2500;

const HELD: &str = "cube held";
const LYING: &str = "cube on the floor";
const LOADED: &str = "cube on the floor, a plate on it";
const SHAKEN: &str = "cube on the floor, shaken by 0.3 g";
const BOTH: &str = "cube on the floor, a plate on it, shaken by 0.3 g";
const HUNG: &str = "sheet held";
const FOLDED: &str = "sheet folded on itself";
const PRESCRIBED: &str = "tube, its wall prescribed";
const GIVES: &str = "tube, its wall gives";
const TESTS: [&str; 9] = [HELD, LYING, LOADED, SHAKEN, BOTH, HUNG, FOLDED, PRESCRIBED, GIVES];

/// A test of one size.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Case {
    test: &'static str,
    /// Cells along an edge; of the tube none are given.
    cells: u32,
}

/// Cells of cubes that are held, and of the lying ones, in full and with `--quick`.
const HELD_CELLS: [&[u32]; 2] = [&[4, 6, 8, 10, 12, 15, 19], &[4, 6, 8, 10]];
const LYING_CELLS: [&[u32]; 2] = [&[10, 15], &[6]];
const LOADED_CELLS: [u32; 2] = [10, 6];
const SHEET_CELLS: u32 = 30;
const FOLDED_CELLS: [u32; 2] = [30, 16];

/// How long each part of a case may take.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Until it lies still, or has warmed up.
    settle: Bound,
    /// While it is measured.
    measure: Bound,
}

/// The cost of a test's steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    pub test: String,
    pub nodes: usize,
    /// The most contacts of a measured step.
    pub contacts: u32,
    pub steps: usize,
    pub ms_per_step_p50: f64,
    pub ms_per_step_p99: f64,
    /// Ratio to the same body without the addition of the test: held, hung, or with a prescribed wall; NaN without one.
    pub over_plain: f64,
    /// The exponent of the cost in the number of nodes, over the test's rows up to this one; NaN for fewer than two.
    pub exponent: f64,
    /// How far the cube's top has sunk at the end, its mean, metres; NaN of other bodies.
    pub sag_m: f64,
    /// The largest distance of a point from where finer steps bring it to rest, over the sag; NaN where that was not computed.
    pub shape_error: f64,
    /// The other engine's median and sag; NaN without one.
    pub peer_ms_per_step: f64,
    pub peer_sag_m: f64,
    /// The processor of the row, and the other engine with its own.
    pub machine: String,
    pub peer: String,
}

impl Subject for Soft {
    type Row = Row;
    const NAME: &'static str = "soft";
    const TABLE: fn(&[Row]) -> Table = table!(|r| test: r.test, nodes: r.nodes, contacts: r.contacts,
        ms_per_step_p50(3): r.ms_per_step_p50, ms_per_step_p99(3): r.ms_per_step_p99, over_plain(2): r.over_plain,
        exponent(2): r.exponent, sag_mm(3): 1e3 * r.sag_m, shape_error(5): r.shape_error,
        peer_ms(2): r.peer_ms_per_step, peer_sag_mm(3): 1e3 * r.peer_sag_m);

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let peers = args.peers.as_deref().map(|path| Peers::<Cube>::read(path, &TESTS)).transpose()?;
        if let Some(Peers { engine, machine, .. }) = peers.as_ref().filter(|_| !args.quiet) {
            message(&format!("beside {engine} on {machine}"));
        }
        let (cases, limits) = (cases(args.quick), limits(args));
        let total = cases.len() as f64;
        let mut rows: Vec<Row> = Vec::new();
        for (at, case) in cases.iter().enumerate() {
            if !progress.continues(at as f64 / total, format!("{}, {} cells", case.test, case.cells)) {
                break;
            }
            let row = case.measure(&limits).with_context(|| case.test)?;
            rows.push(placed(row, &rows, peers.as_ref()));
        }
        Ok(rows)
    }

    fn figure(rows: &[Row]) -> Figure {
        let of = |test: &str, value: fn(&Row) -> f64| -> Vec<(f64, f64)> {
            let here = rows.iter().filter(|row| row.test == test);
            here.map(|row| (row.nodes as f64, value(row))).filter(|(_, ms)| ms.is_finite()).collect()
        };
        let curves = [
            ("held", of(HELD, |row| row.ms_per_step_p50)),
            ("on the floor", of(LYING, |row| row.ms_per_step_p50)),
            ("peer, held", of(HELD, |row| row.peer_ms_per_step)),
        ];
        let drawn = curves.into_iter().zip(Colour::LINES).filter(|((_, points), _)| !points.is_empty());
        let layers = drawn.map(|((name, points), colour)| {
            let power = exponent(&points).map(|power| format!(": nodes^{power:.2}"));
            Layer::line(name.to_owned() + &power.unwrap_or_default(), colour, points)
        });
        Figure::single(
            "Cost of a soft cube's step",
            Axis::log_fit("nodes"),
            Axis::log_fit("CPU time per step, ms"),
            layers,
        )
    }
}

fn limits(args: &BenchArgs) -> Limits {
    let [settle_s, measure_s] = if args.quick { [1.0, 0.5] } else { [5.0, 3.0] };
    let bound = |steps, span_s| Bound { steps, span: Duration::from_secs_f64(span_s) };
    Limits { settle: bound(60, settle_s), measure: bound(60, args.seconds.unwrap_or(measure_s)) }
}

fn cases(quick: bool) -> Vec<Case> {
    let quick = usize::from(quick);
    let sizes = |test, list: &[u32]| list.iter().map(|cells| Case { test, cells: *cells }).collect::<Vec<_>>();
    let mut all = sizes(HELD, HELD_CELLS[quick]);
    all.extend(sizes(LYING, LYING_CELLS[quick]));
    all.extend([LOADED, SHAKEN, BOTH].map(|test| Case { test, cells: LOADED_CELLS[quick] }));
    all.push(Case { test: HUNG, cells: SHEET_CELLS });
    all.push(Case { test: FOLDED, cells: FOLDED_CELLS[quick] });
    all.extend([PRESCRIBED, GIVES].map(|test| Case { test, cells: 0 }));
    all
}

/// A row among those before it and beside the other engine's.
fn placed(row: Row, before: &[Row], peers: Option<&Peers<Cube>>) -> Row {
    let plain = match row.test.as_str() {
        LYING | LOADED | SHAKEN | BOTH => Some(HELD),
        FOLDED => Some(HUNG),
        GIVES => Some(PRESCRIBED),
        _ => None,
    };
    let plain = plain.and_then(|test| before.iter().find(|other| other.test == test && other.nodes == row.nodes));
    let points = before.iter().chain([&row]).filter(|other| other.test == row.test);
    let points: Vec<_> = points.map(|other| (other.nodes as f64, other.ms_per_step_p50)).collect();
    let peer = peers.and_then(|peers| Some((peers, peers.of(&row.test, row.nodes)?)));
    Row {
        over_plain: plain.map_or(f64::NAN, |plain| row.ms_per_step_p50 / plain.ms_per_step_p50),
        exponent: exponent(&points).unwrap_or(f64::NAN),
        peer_ms_per_step: peer.map_or(f64::NAN, |(_, peer)| peer.ms_a_step),
        peer_sag_m: peer.map_or(f64::NAN, |(_, peer)| peer.sag_m),
        peer: peer.map_or_else(String::new, |(peers, _)| format!("{}, {}", peers.engine, peers.machine)),
        ..row
    }
}

impl Case {
    fn measure(&self, limits: &Limits) -> anyhow::Result<Row> {
        let Self { test, cells } = *self;
        match test {
            HELD => held(cells, limits),
            LYING | LOADED | SHAKEN | BOTH => self.lying(limits),
            HUNG => {
                let spec = bodies::hung_sheet(cells);
                let nodes = spec.shape.vertices() as usize;
                let mut play = Play::new(vec![boxed(spec)?], &[], STEP_S)?;
                play.measured(limits.settle)?;
                Ok(row(test, nodes, &play.measured(limits.measure)?))
            }
            FOLDED => {
                let spec = bodies::falling_sheet(cells);
                let nodes = spec.shape.vertices() as usize;
                let mut play = Play::new(vec![boxed(spec)?], &[bodies::floor()], FOLDING_STEP_S)?;
                let steps = (FOLDING_S / FOLDING_STEP_S).round() as u32;
                play.measured(Bound { steps, span: 6 * limits.settle.span })?;
                let mut play = play.in_steps_of(STEP_S);
                Ok(row(test, nodes, &play.measured(limits.measure)?))
            }
            _ => {
                let demo = DemoTube::load()?;
                let wall = if test == GIVES { WallModel::Gives } else { WallModel::Prescribed };
                let tube = demo.with(wall)?;
                let nodes = tube.segments() + 1;
                let mut play = Play::new(vec![Box::new(tube)], &demo.obstacles, TUBE_STEP_S)?;
                play.measured(Bound { steps: 5 * limits.settle.steps, ..limits.settle })?;
                Ok(row(test, nodes, &play.measured(Bound { steps: 5 * limits.measure.steps, ..limits.measure })?))
            }
        }
    }

    /// The cube on a floor, with a plate on it or not, shaken or not.
    fn lying(&self, limits: &Limits) -> anyhow::Result<Row> {
        let spec = bodies::cube(self.cells);
        let nodes = spec.shape.vertices() as usize;
        let mut all = vec![boxed(spec)?];
        if matches!(self.test, LOADED | BOTH) {
            all.push(Box::new(bodies::plate()?));
        }
        let shaken = matches!(self.test, SHAKEN | BOTH);
        if shaken {
            all.push(Box::new(ShakenFloor::new().context("the floor")?));
        }
        let floor = [bodies::floor()];
        let mut play = Play::new(all, if shaken { &[] } else { &floor }, STEP_S)?;
        let before = play.points(0);
        play.measured(limits.settle)?;
        let series = play.measured(limits.measure)?;
        let sag_m = if shaken { f64::NAN } else { sag_m(&before, &play.points(0)) };
        Ok(Row { sag_m, ..row(self.test, nodes, &series) })
    }
}

/// The cube with its bottom held, and where it comes to rest.
fn held(cells: u32, limits: &Limits) -> anyhow::Result<Row> {
    let spec = bodies::held_cube(cells);
    let nodes = spec.shape.vertices() as usize;
    let material = SoftMaterial { damping_per_s: FINE_DAMPING_PER_S, ..spec.material };
    let finer = SoftSpec { material, ..spec.clone() };
    let mut play = Play::new(vec![boxed(spec)?], &[], STEP_S)?;
    let before = play.points(0);
    play.measured(limits.settle)?;
    let series = play.measured(limits.measure)?;
    let after = play.points(0);
    let sag_m = sag_m(&before, &after);
    let mut shape_error = f64::NAN;
    if nodes <= CHECKED_NODES_MAX {
        let mut finer = Play::new(vec![boxed(finer)?], &[], FINE_STEP_S)?;
        let made = finer.measured(Bound { steps: FINE_STEPS, ..limits.settle })?.steps();
        if made == FINE_STEPS as usize {
            let off = after.iter().zip(finer.points(0)).map(|(here, there)| here.distance(there));
            shape_error = off.fold(0.0, f64::max) / sag_m;
        }
    }
    Ok(Row { sag_m, shape_error, ..row(HELD, nodes, &series) })
}

/// How far the top of the cube has sunk, the mean over its points, metres.
fn sag_m(before: &[DVec3], after: &[DVec3]) -> f64 {
    let top_m = before.iter().map(|at| at.z).fold(f64::NEG_INFINITY, f64::max) - 1e-6 * CUBE_M;
    let sunk = before.iter().zip(after).filter(|(before, _)| before.z >= top_m);
    let (count, sum_m) = sunk.fold((0.0, 0.0), |(count, sum), (before, after)| (count + 1.0, sum + before.z - after.z));
    sum_m / count
}

fn boxed(spec: SoftSpec) -> anyhow::Result<Box<dyn Agent>> {
    Ok(Box::new(SoftBody::new(spec)?))
}

/// A row by itself.
fn row(test: &str, nodes: usize, series: &Series) -> Row {
    Row {
        test: test.to_owned(),
        nodes,
        contacts: series.contacts,
        steps: series.steps(),
        ms_per_step_p50: series.ms_at(0.5),
        ms_per_step_p99: series.ms_at(0.99),
        machine: processor(),
        ..blank()
    }
}

#[cfg(test)]
mod tests;
