//! `bench`: how much one machine carries, as CSV, JSON, SVG and PNG in a folder and a table on standard output.
//!
//! In: what to measure, which folder. Out: files, a table. Never here: what is measured (each subject is a file).

mod agents;
mod bare;
mod cast;
mod machine;

use super::Exit;
use super::args::{BenchArgs, BenchSubject};
use super::chart::figure::{self, Axis, Colour, Figure, Layer, Mark, Panel, span};
use super::chart::prepared;
use super::chart::table::Table;
use super::output::data;
use super::progress::Bar;
use agents::{Case, Executor, Row, UNPACED_HZ, cases, measure};
use anyhow::Context;
use cast::Model;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long each case runs: long enough for a few hundred frames, or only to see that all is well.
const SPANS: [Duration; 2] = [Duration::from_secs(4), Duration::from_secs(1)];

/// Runs a benchmark.
pub(super) fn command(args: &BenchArgs) -> anyhow::Result<Exit> {
    let BenchSubject::Agents = args.subject;
    let folder = prepared(&args.out)?;
    let chosen: Vec<_> = cases(args.quick).into_iter().filter(|case| wanted(args, case)).collect();
    let span = args.seconds.map_or(SPANS[usize::from(args.quick)], Duration::from_secs_f64);
    let bar = Bar::new("agents", args.quiet);
    let mut rows = Vec::with_capacity(chosen.len());
    for (at, case) in chosen.iter().enumerate() {
        let words = format!("{} {} {}", case.agents, case.model.name(), case.executor.name());
        bar.tell(at as f64 / chosen.len() as f64, words);
        rows.push(measure(case, span)?);
    }
    drop(bar);
    write(folder, &rows)?;
    if args.json {
        data(&format!("{}\n", json(&rows)?))?;
    } else if !args.quiet {
        data(&table(&rows).text())?;
    }
    Ok(Exit::Ok)
}

fn wanted(args: &BenchArgs, case: &Case) -> bool {
    let named = |names: &[String], name: &str| names.is_empty() || names.iter().any(|n| n == name);
    named(&args.executor, case.executor.name())
        && named(&args.model, case.model.name())
        && args.agents.is_none_or(|agents| case.agents <= agents)
}

fn write(folder: &Path, rows: &[Row]) -> anyhow::Result<()> {
    let path = |kind: &str| folder.join(format!("agents.{kind}"));
    let cannot = |path: &PathBuf| format!("{} cannot be written", path.display());
    let mut csv = csv::Writer::from_path(path("csv")).with_context(|| cannot(&path("csv")))?;
    rows.iter().try_for_each(|row| csv.serialize(row)).with_context(|| cannot(&path("csv")))?;
    csv.flush()?;
    let figure = drawn(rows);
    let files = [
        ("json", json(rows)?.into_bytes()),
        ("svg", figure::svg(&figure)?.into_bytes()),
        ("png", figure::png(&figure)?),
    ];
    for (kind, bytes) in files {
        std::fs::write(path(kind), bytes).with_context(|| cannot(&path(kind)))?;
    }
    Ok(())
}

/// The rows with times under names of their own.
fn json(rows: &[Row]) -> anyhow::Result<String> {
    let row = |row: &Row| {
        let mut row = serde_json::to_value(row)?;
        for name in ["age_ms", "late_ms"] {
            let part =
                |row: &mut serde_json::Value, end| row.as_object_mut().and_then(|o| o.remove(&format!("{name}_{end}")));
            let spread = serde_json::json!({ "p50": part(&mut row, "p50"), "p99": part(&mut row, "p99") });
            row[name] = spread;
        }
        anyhow::Ok(row)
    };
    let rows = rows.iter().map(row).collect::<Result<Vec<_>, _>>()?;
    Ok(serde_json::to_string_pretty(&serde_json::json!({ "bench": "agents", "rows": rows }))?)
}

fn table(rows: &[Row]) -> Table {
    let mut table = Table::new(&[
        "executor",
        "model",
        "agents",
        "rate_hz",
        "cpu_us",
        "bare_us",
        "sleeping_us",
        "steps_per_s",
        "age_p99_ms",
        "late_p50_ms",
        "late_p99_ms",
        "dropped_ms",
        "bytes",
        "switches",
        "frame_p99_ms",
        "read_ns",
        "start_ms",
        "end_ms",
    ]);
    for row in rows {
        let or_nan = |number: Option<f64>| number.unwrap_or(f64::NAN);
        table.rows.push(vec![
            row.executor.name().into(),
            row.model.name().into(),
            (row.agents as f64, 0).into(),
            (row.rate_hz, 1).into(),
            (row.cpu_us_per_step, 2).into(),
            (row.bare_us_per_step, 2).into(),
            (row.sleeping_us_per_step, 2).into(),
            (row.steps_per_s, 0).into(),
            (row.age_ms_p99, 2).into(),
            (row.late_ms_p50, 2).into(),
            (row.late_ms_p99, 2).into(),
            (row.dropped_ms, 1).into(),
            (or_nan(row.bytes_per_agent), 0).into(),
            (or_nan(row.switches_per_step), 2).into(),
            (row.frame_late_ms_p99, 2).into(),
            (row.read_ns_per_agent, 0).into(),
            (row.start_ms, 1).into(),
            (row.shutdown_ms, 1).into(),
        ]);
    }
    table
}

/// CPU a step over the number of agents, and lateness.
fn drawn(rows: &[Row]) -> Figure {
    let paced = |row: &&Row| row.model == Model::Synthetic && row.rate_hz < UNPACED_HZ && row.rate_hz != 1000.0;
    let rows: Vec<&Row> = rows.iter().filter(paced).collect();
    let of = |executor: Executor, y: fn(&Row) -> f64| -> Vec<(f64, f64)> {
        rows.iter().filter(|row| row.executor == executor).map(|row| (row.agents as f64, y(row))).collect()
    };
    let panel = |title: &str, label: &'static str, y: fn(&Row) -> f64, bare: Option<fn(&Row) -> f64>| {
        let executors = [Executor::Threads, Executor::Pool, Executor::Lockstep];
        let mut layers: Vec<Layer> = executors
            .into_iter()
            .zip(Colour::LINES)
            .map(|(executor, colour)| Layer {
                label: executor.name().to_owned(),
                colour,
                mark: Mark::Line(of(executor, y)),
            })
            .collect();
        layers.extend(bare.map(|bare| Layer {
            label: "bare loop".to_owned(),
            colour: Colour::Grey,
            mark: Mark::Dashed(of(Executor::Pool, bare)),
        }));
        let (low, high) = span(rows.iter().map(|row| row.agents as f64), true);
        let (least, most) = span(rows.iter().flat_map(|row| [Some(y(row)), bare.map(|b| b(row))]).flatten(), true);
        Panel { title: title.to_owned(), x: Axis::log("agents", low, high), y: Axis::log(label, least, most), layers }
    };
    let panels = vec![
        panel("CPU a step", "µs", |row| row.cpu_us_per_step, Some(|row| row.bare_us_per_step)),
        panel("lateness, 99 in 100", "ms", |row| row.late_ms_p99.max(1e-3), None),
    ];
    Figure { title: "What being an agent costs".to_owned(), panels, columns: 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(executor: Executor, agents: usize) -> Row {
        measure(&Case { executor, model: Model::Synthetic, agents, rate_hz: 500.0 }, Duration::from_millis(40)).unwrap()
    }

    #[test]
    fn a_row_says_what_was_measured_and_the_files_hold_it() {
        let rows: Vec<_> = [Executor::Threads, Executor::Pool, Executor::Lockstep].map(|e| row(e, 3)).into();
        assert!(rows.iter().all(|row| row.steps_per_s > 0.0 && row.bare_us_per_step > 0.0), "{rows:?}");
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &rows).unwrap();
        let read: Result<Vec<Row>, _> =
            csv::Reader::from_path(folder.path().join("agents.csv")).unwrap().deserialize().collect();
        assert_eq!(read.unwrap().len(), 3);
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("agents.json")).unwrap()).unwrap();
        assert_eq!(json["rows"][1]["executor"], "pool");
        assert!(json["rows"][1]["late_ms"]["p99"].is_number() && json["rows"][1]["late_ms_p99"].is_null());
        assert!(std::fs::read(folder.path().join("agents.png")).unwrap().len() > 1000);
    }

    #[test]
    fn every_executor_and_model_has_its_cases() {
        for quick in [true, false] {
            let cases = cases(quick);
            for executor in [Executor::Threads, Executor::Pool, Executor::Lockstep] {
                for model in [Model::Synthetic, Model::Rod, Model::Rigid] {
                    assert!(cases.iter().any(|case| case.executor == executor && case.model == model));
                }
            }
            assert!(cases.iter().all(|case| case.executor != Executor::Threads || case.agents <= 1000));
            assert!(cases.iter().any(|case| case.agents == 100_000));
        }
    }
}
