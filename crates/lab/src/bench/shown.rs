//! `bench agents`: which cases are measured, and how their rows are shown.
//!
//! In: the arguments. Out: rows, a table, a figure. Never here: what a case measures ([`super::agents`]).

use super::super::args::BenchArgs;
use super::agents::{Case, Executor, Row, TENTH_HZ, UNPACED_HZ, cases, measure};
use super::rig::cast::Model;
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Panel, Table, exponent, span, table};
use metachron_console::output::{BadInput, message};
use metachron_runtime::{Priority, ask_priority};
use std::time::Duration;

/// The subject.
pub(super) struct Agents;

/// How long each case runs: long enough for a few hundred frames, or, with `--quick`, only to see that it works.
const SPANS: [Duration; 2] = [Duration::from_secs(4), Duration::from_secs(1)];

impl Subject for Agents {
    type Row = Row;
    const NAME: &'static str = "agents";
    const TABLE: fn(&[Row]) -> Table = table!(|r| executor: r.executor.name(), model: r.model.name(),
        realtime: r.realtime, agents: r.agents, rate_hz(1): r.rate_hz, cpu_us(2): r.cpu_us_per_step, cores(3): r.cores,
        bare_us(2): r.bare_us_per_step, sleeping_us(2): r.sleeping_us_per_step, thread_us(2): r.thread_us_per_step,
        over_thread(2): r.over_thread, steps_per_s: r.steps_per_s, age_p99_ms(2): r.age_ms_p99,
        late_p50_ms(2): r.late_ms_p50, late_p99_ms(2): r.late_ms_p99, dropped_ms(1): r.dropped_ms,
        bytes: r.bytes_per_agent, switches(2): r.switches_per_step, frame_p99_ms(2): r.frame_late_ms_p99,
        read_ns: r.read_ns_per_agent, start_ms(1): r.start_ms, end_ms(1): r.shutdown_ms);

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let granted = ask_priority(Priority::Realtime);
        let possible = |case: &Case| case.priority == Priority::Normal || granted.is_ok();
        let all = cases(args.quick).into_iter();
        let chosen: Vec<_> = all.filter(|case| is_selected(args, case) && possible(case)).collect();
        if chosen.is_empty() {
            let why = "no case has this executor, this model and so few agents: the smallest case has 1 agent, with --quick 10";
            return Err(BadInput(why.to_owned()).into());
        }
        let span = args.seconds.map_or(SPANS[usize::from(args.quick)], Duration::from_secs_f64);
        let words = |case: &Case| format!("{} {} {}", case.agents, case.model.name(), case.executor.name());
        let rows = progress.rows(chosen, words, |case| measure(&case, span))?;
        if let Err(refused) = granted
            && !args.quiet
        {
            message(&format!("note: {refused}; the case was skipped"));
        }
        Ok(rows)
    }

    fn figure(rows: &[Row]) -> Figure {
        figure_of(rows)
    }
}

fn is_selected(args: &BenchArgs, case: &Case) -> bool {
    let named = |names: &[String], name: &str| names.is_empty() || names.iter().any(|n| n == name);
    named(&args.executor, case.executor.name())
        && named(&args.model, case.model.name())
        && args.agents.is_none_or(|agents| case.agents <= agents)
}

/// CPU per step and lateness over the number of agents, and the cost of a round where agents are unpaced.
fn figure_of(all: &[Row]) -> Figure {
    let of_a_kind = |row: &&Row| row.model == Model::Synthetic && ![1000.0, TENTH_HZ].contains(&row.rate_hz);
    let (free, rows): (Vec<&Row>, Vec<&Row>) = all.iter().filter(of_a_kind).partition(|row| row.rate_hz == UNPACED_HZ);
    let of = |executor: Executor, y: fn(&Row) -> f64| -> Vec<(f64, f64)> {
        rows.iter().filter(|row| row.executor == executor).map(|row| (row.agents as f64, y(row))).collect()
    };
    let panel = |title: &str, label: &'static str, y: fn(&Row) -> f64, bare: Option<fn(&Row) -> f64>| {
        let executors = [Executor::Threads, Executor::Pool, Executor::Lockstep];
        let line = |(executor, colour): (Executor, Colour)| Layer::line(executor.name(), colour, of(executor, y));
        let floor = bare.map(|bare| Layer::dashed("bare loop", Colour::Grey, of(Executor::Pool, bare)));
        let layers = executors.into_iter().zip(Colour::LINES).map(line).chain(floor);
        let (low, high) = span(rows.iter().map(|row| row.agents as f64), true);
        let (least, most) = span(rows.iter().flat_map(|row| [Some(y(row)), bare.map(|b| b(row))]).flatten(), true);
        Panel::new(title, Axis::log("agents", low, high), Axis::log(label, least, most), layers)
    };
    let mut panels = vec![
        panel("CPU time per step", "µs", |row| row.cpu_us_per_step, Some(|row| row.bare_us_per_step)),
        panel("lateness, 99th percentile", "ms", |row| row.late_ms_p99.max(1e-3), None),
    ];
    panels.extend((free.len() > 1).then(|| growth(&free)));
    Figure::new("Overhead per agent", 2, panels)
}

/// CPU time of a round (one step of every agent), where agents step as fast as they can.
fn growth(rows: &[&Row]) -> Panel {
    let line = |y: fn(&Row) -> f64| rows.iter().map(|row| (row.agents as f64, y(row) * row.agents as f64)).collect();
    let (ours, bare): (Vec<_>, Vec<_>) = (line(|row| row.cpu_us_per_step), line(|row| row.bare_us_per_step));
    let title = format!("unpaced: a round costs agents^{:.2}", exponent(&ours).unwrap_or(f64::NAN));
    let layers = [Layer::line("pool", Colour::LINES[1], ours), Layer::dashed("bare loop", Colour::Grey, bare)];
    Panel::new(title, Axis::log_fit("agents"), Axis::log_fit("µs per round"), layers)
}

#[cfg(test)]
mod tests {
    use super::super::subject::write;
    use super::*;

    fn row(executor: Executor, agents: usize) -> Row {
        let case = Case { executor, model: Model::Synthetic, priority: Priority::Normal, agents, rate_hz: 500.0 };
        measure(&case, Duration::from_millis(40)).unwrap()
    }

    #[test]
    fn a_row_says_what_was_measured_and_the_files_hold_it() {
        let rows: Vec<_> = [Executor::Threads, Executor::Pool, Executor::Lockstep].map(|e| row(e, 3)).into();
        assert!(rows.iter().all(|row| row.steps_per_s > 0.0 && row.bare_us_per_step > 0.0), "{rows:?}");
        let floors: Vec<_> = rows.iter().map(|row| row.thread_us_per_step.is_some_and(|floor| floor > 0.0)).collect();
        assert_eq!(floors, [true, false, false], "a plain thread each stands beside threads alone");
        let folder = tempfile::tempdir().unwrap();
        write::<Agents>(folder.path(), &rows).unwrap();
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
