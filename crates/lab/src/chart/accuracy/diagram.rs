//! A work-precision diagram: error against CPU time for every method of a benchmark, with other engines and the Pareto front.
//!
//! In: a [`Benchmark`]. Out: an experiment. Never here: what a benchmark is.

use super::front::front;
use super::peers;
use super::play::Play;
use crate::chart::{
    Axis, Cell, Colour, Experiment, Figure, Finding, Layer, LiveColumns, Measured, Named, Panel, Shown, Table,
    calibration_us, distinct, each, exponent, lines, pace_for_goals, span, table,
};
use metachron_models::rod::Integrator;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// A problem whose answer is known from an independent source.
pub(in super::super) trait Benchmark: Send + Sync + 'static {
    /// As [`Experiment::NAME`].
    const NAME: &'static str;
    /// As [`Experiment::TITLE`].
    const TITLE: &'static str;
    /// Label of the error axis.
    const ERROR: &'static str;

    /// The problems given to every method.
    fn cases(quick: bool) -> Vec<Case>;

    /// Plays a case; the run and its error, `None` where the tube was lost.
    fn play(case: &Case) -> Option<(Play, f64)>;

    /// The goals, one line each.
    fn goals() -> Vec<Goal> {
        Vec::new()
    }
}

/// One run of a benchmark.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    /// Which problem of the benchmark.
    pub(super) case: String,
    /// Which integrator.
    pub(super) method: Named<Integrator>,
    pub(super) segments: u32,
    pub(super) dt_ms: f64,
    /// The least number of substeps.
    pub(super) substeps: u32,
}

impl Case {
    /// Every problem by every method with every number of segments, in steps of `dt_ms`.
    pub(super) fn ladder(cases: &[&str], methods: &[Integrator], sizes: &[u32], dt_ms: f64) -> Vec<Self> {
        each!(case in cases, &method in methods, &segments in sizes =>
            Self { case: (*case).to_owned(), method: Named(method.name(), method), segments, dt_ms, substeps: 1 })
    }

    /// The same for problems with user pulls: under these every implicit method falls back to implicit Euler.
    pub(super) fn pulled(cases: &[&str], quick: bool) -> Vec<Self> {
        let sizes = if quick { &[8, 16][..] } else { &[8, 16, 32, 64, 128] };
        Self::ladder(cases, &[Integrator::ImplicitEuler], sizes, 10.0)
    }
}

/// A bound that some method should reach.
pub(in super::super) struct Goal {
    pub(super) case: &'static str,
    /// Only rows with this many segments; any where it is zero.
    pub(super) segments: u32,
    pub(super) error: f64,
    /// Greatest CPU milliseconds per simulated second, scaled to the machine on which goals were set.
    pub(super) cpu_ms_per_s: f64,
}

impl Goal {
    /// Compares the goal with the rows; `None` where no row is of its case.
    fn finding(self, rows: &[Row]) -> Option<Finding> {
        let Self { case, segments, error, cpu_ms_per_s } = self;
        let asked = || rows.iter().filter(|r| r.case.case == case && (segments == 0 || r.case.segments == segments));
        asked().next()?;
        let size = if segments == 0 { String::new() } else { format!(", {segments} segments") };
        let claim =
            format!("{case}{size}: CPU ms per simulated second by calibration for an error of at most {error:e}");
        let pace = pace_for_goals(rows.iter().map(|row| row.calibration_us));
        Some(Finding::at_most(claim, cheapest(asked(), error).map_or(f64::NAN, |ms| ms * pace), cpu_ms_per_s))
    }
}

/// The results of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    substeps_per_step: f64,
    /// Empty where the tube was lost.
    error: Option<f64>,
    cpu_ms_per_s: f64,
    /// The calibration measured right after it ([`calibration_us`]).
    calibration_us: Option<f64>,
}

pub(in super::super) type Row = Measured<Case, Found>;

/// The diagram of a benchmark.
pub(in super::super) struct Diagram<B>(PhantomData<B>);

impl<B: Benchmark> Experiment for Diagram<B> {
    type Row = Row;
    const NAME: &'static str = B::NAME;
    const TITLE: &'static str = B::TITLE;
    const ALONE: bool = true;
    const LIVE: LiveColumns = LiveColumns::These(&["ms/s to 1e-3", "ms/s to 1e-4"]);
    const TABLE: fn(&[Row]) -> Table = |rows| {
        let of = |case, method| -> Vec<&Row> {
            rows.iter().filter(|r| r.case.case == case && r.case.method.0 == method).collect()
        };
        let all = each!(case in distinct(rows.iter().map(|r| &*r.case.case)), method in distinct(rows.iter().map(|r| r.case.method.0)) =>
            (case, method, of(case, method)));
        table!(all.iter().filter(|(.., here)| !here.is_empty()), |(case, method, here)| case: case, method: method,
            "order in dt": optional(dt_order(here), 2), "order in segments": optional(segment_order(here), 2),
            "best error"(6): here.iter().filter_map(|r| r.error).fold(f64::INFINITY, f64::min),
            "ms/s to 1e-3": optional(cheapest(here.iter().copied(), 1e-3), 3),
            "ms/s to 1e-4": optional(cheapest(here.iter().copied(), 1e-4), 3))
    };

    fn cases(quick: bool) -> Vec<Case> {
        B::cases(quick)
    }

    fn measure(case: &Case) -> Option<Found> {
        let played = B::play(case);
        let cpu_ms_per_s = played.as_ref().map_or(0.0, |(play, _)| cost::<B>(case, play));
        let substeps_per_step = played.as_ref().map_or(0.0, |(play, _)| play.substeps_per_step());
        let error = played.map(|(_, error)| error).filter(|error| error.is_finite());
        Some(Found { substeps_per_step, error, cpu_ms_per_s, calibration_us: calibration_us() })
    }

    fn figure(rows: &[Row]) -> Figure {
        let panels: Vec<Panel> =
            distinct(rows.iter().map(|r| &*r.case.case)).into_iter().map(|case| panel::<B>(case, rows)).collect();
        let columns = panels.len().clamp(1, 3);
        let others =
            if peers::of(B::NAME).is_empty() { String::new() } else { format!(" (others: {})", peers::MACHINE) };
        Figure::new(format!("{}{others}", B::TITLE), columns, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        B::goals().into_iter().filter_map(|goal| goal.finding(rows)).collect()
    }
}

/// CPU milliseconds per simulated second: the least of several repetitions where a run takes only milliseconds, because load of
/// a shared machine only ever adds time.
fn cost<B: Benchmark>(case: &Case, first: &Play) -> f64 {
    const SHORT_S: f64 = 0.02;
    const REPETITIONS: usize = 4;
    let count = if first.cpu_s() < SHORT_S { REPETITIONS } else { 0 };
    let more = (0..count).filter_map(|_| B::play(case)).map(|(play, _)| play.cpu_ms_per_s());
    more.fold(first.cpu_ms_per_s(), f64::min)
}

/// A number in a cell, or a dash where there is none.
fn optional(value: Option<f64>, digits: usize) -> Cell {
    value.map_or_else(|| "–".cell(0), |value| value.cell(digits))
}

/// The least cost of a run whose error is at most `error`.
fn cheapest<'a>(rows: impl Iterator<Item = &'a Row>, error: f64) -> Option<f64> {
    rows.filter(|r| r.error.is_some_and(|e| e <= error)).map(|r| r.cpu_ms_per_s).min_by(f64::total_cmp)
}

/// The power of the substep with which errors fall, at the greatest number of segments.
fn dt_order(rows: &[&Row]) -> Option<f64> {
    let most = rows.iter().map(|r| r.case.segments).max()?;
    let points = rows.iter().filter(|r| r.case.segments == most && r.substeps_per_step > 0.0);
    exponent(&points.filter_map(|r| Some((r.case.dt_ms / r.substeps_per_step, r.error?))).collect::<Vec<_>>())
}

/// The power of the segment length with which errors fall, at the shortest substeps.
fn segment_order(rows: &[&Row]) -> Option<f64> {
    let least = |r: &&&Row| r.case.dt_ms / f64::from(r.case.substeps);
    let shortest = rows.iter().map(|r| least(&r)).min_by(f64::total_cmp)?;
    let points = rows.iter().filter(|r| least(r) == shortest);
    exponent(&points.filter_map(|r| Some((1.0 / f64::from(r.case.segments), r.error?))).collect::<Vec<_>>())
}

/// One problem of the benchmark: methods as lines, other engines as dots, the front of all as a dashed line.
fn panel<B: Benchmark>(case: &str, rows: &[Row]) -> Panel {
    let here = || rows.iter().filter(|r| r.case.case == case);
    let ours = |method: &str| {
        let of = here().filter(|r| r.case.method.0 == method);
        front(of.filter_map(|r| Some((r.cpu_ms_per_s, r.error?))))
    };
    let others: Vec<_> = peers::of(B::NAME).into_iter().filter(|peer| peer.case == case).collect();
    let theirs = || others.iter().map(|peer| (peer.cpu_ms_per_s, peer.error));
    let all = || here().filter_map(|r| Some((r.cpu_ms_per_s, r.error?))).chain(theirs());
    let engines = distinct(others.iter().map(|peer| peer.peer.as_str())).into_iter().enumerate();
    let dots = engines.map(|(k, engine)| {
        let here = others.iter().filter(|peer| peer.peer == engine);
        Layer::dots(engine, Colour::behind(k), here.map(|peer| (peer.cpu_ms_per_s, peer.error)))
    });
    let methods = lines(distinct(rows.iter().map(|r| r.case.method.0)), ours);
    let layers = dots.chain(methods).chain([Layer::dashed("front", Colour::Grey, front(all()))]);
    let ((left, right), (low, high)) = (span(all().map(|p| p.0), true), span(all().map(|p| p.1), true));
    let (x, y) = (Axis::log("CPU ms per simulated second", left, right), Axis::log(B::ERROR, low, high));
    Panel::new(case, x, y, layers)
}
