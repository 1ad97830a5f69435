//! `bench scenes`: CPU time of the built-in scenes in lockstep, beside another build of this program.
//!
//! In: programs, each of which plays a scene by itself. Out: rows of CPU time a scene. Never here: how a scene is played.

use super::super::args::BenchArgs;
use super::rig::machine::processor;
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Panel, Table, median, span, table};
use anyhow::Context;
use metachron_console::output::{BadInput, message};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::{Command, Stdio};

/// The subject.
pub(super) struct Scenes;

/// The built-in scenes in which something is stepped, the expensive ones last.
const PLAYED: [&str; 13] = [
    "tube",
    "pendulum",
    "yard",
    "crossing",
    "gripper",
    "catenary",
    "stack",
    "chain",
    "mesentery",
    "cavity",
    "pile",
    "organ",
    "overload",
];
/// From here on they are played once, and with `--quick` not at all.
const EXPENSIVE_FROM: usize = 10;
/// How often each of the others is played by each program, the two alternately.
const ROUNDS: usize = 5;

/// Simulated seconds.
const SECONDS: f64 = 2.0;

/// A scene, played by one build or two.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Row {
    pub scene: String,
    /// The median of the CPU time of the agents' turns, seconds.
    pub cpu_s: f64,
    /// The same of the other build, and the ratio to it; NaN without one.
    pub other_cpu_s: f64,
    pub over_other: f64,
    /// Whether all runs of both ended in the same state.
    pub same_state: Option<bool>,
    pub machine: String,
}

/// The part of a run's report that is needed.
#[derive(Debug, Clone, Deserialize)]
struct Report {
    cpu_s: f64,
    state_hash: String,
}

/// Has a program play a scene.
fn play(program: &Path, scene: &str, seconds: f64) -> anyhow::Result<Report> {
    let shown = program.display();
    let mut command = Command::new(program);
    command.args(["run", scene, "--headless", "--executor", "lockstep", "--quiet", "--report", "-", "--seconds"]);
    let done = command.arg(seconds.to_string()).stdin(Stdio::null()).output();
    let done = done.map_err(|error| BadInput(format!("{shown} cannot be started: {error}")))?;
    if !done.status.success() {
        let said = String::from_utf8_lossy(&done.stderr);
        return Err(BadInput(format!("{shown} does not play {scene} ({}): {}", done.status, said.trim())).into());
    }
    let report = serde_json::from_slice(&done.stdout);
    Ok(report.map_err(|error| BadInput(format!("{shown} wrote no report of {scene}: {error}")))?)
}

/// Plays a scene with each program alternately, each first in turn; reports of each.
fn alternately(programs: &[&Path], scene: &str, rounds: usize, seconds: f64) -> anyhow::Result<Vec<Vec<Report>>> {
    let mut reports = vec![Vec::new(); programs.len()];
    for round in 0..rounds {
        for at in 0..programs.len() {
            let at = (at + round) % programs.len();
            reports[at].push(play(programs[at], scene, seconds)?);
        }
    }
    Ok(reports)
}

fn row(scene: &str, reports: &[Vec<Report>]) -> Row {
    let times = |at: usize| reports.get(at).into_iter().flatten().map(|report| report.cpu_s).collect();
    let [cpu_s, other_cpu_s] = [0, 1].map(|at| median(times(at)));
    let mut states: Vec<_> = reports.iter().flatten().map(|report| &report.state_hash).collect();
    states.dedup();
    let same_state = reports.get(1).map(|_| states.len() == 1);
    let over_other = cpu_s / other_cpu_s;
    Row { scene: scene.to_owned(), cpu_s, other_cpu_s, over_other, same_state, machine: processor() }
}

impl Subject for Scenes {
    type Row = Row;
    const NAME: &'static str = "scenes";
    const TABLE: fn(&[Row]) -> Table = table!(|r| scene: r.scene, cpu_s(2): r.cpu_s, other_cpu_s(2): r.other_cpu_s,
        over_other(2): r.over_other, same_state: r.same_state);

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let own = std::env::current_exe().context("this program's own file")?;
        let programs: Vec<_> = std::iter::once(own.as_path()).chain(args.against.as_deref()).collect();
        let scenes = if args.quick { &PLAYED[..EXPENSIVE_FROM] } else { &PLAYED[..] };
        let mut rows = Vec::new();
        for (at, scene) in scenes.iter().enumerate() {
            let done = at as f64 / scenes.len() as f64;
            if !progress.continues(done, (*scene).to_owned()) {
                break;
            }
            let rounds = if at < EXPENSIVE_FROM { ROUNDS } else { 1 };
            match alternately(&programs, scene, rounds, args.seconds.unwrap_or(SECONDS)) {
                Ok(reports) => rows.push(row(scene, &reports)),
                // Ctrl-C ends the scene that plays, too
                Err(_) if !progress.continues(done, String::new()) => break,
                Err(error) if rows.is_empty() => return Err(error),
                // an older build does not know every scene
                Err(error) => message(&format!("{error:#}")),
            }
        }
        Ok(rows)
    }

    fn figure(rows: &[Row]) -> Figure {
        let times = || rows.iter().flat_map(|row| [row.cpu_s, row.other_cpu_s]).filter(|time| time.is_finite());
        let (least, most) = span(times(), true);
        let bars = |of: fn(&Row) -> f64, from: f64| {
            let bar = |(at, row): (usize, &Row)| [at as f64 + from, at as f64 + from + 0.4, least, of(row)];
            rows.iter().enumerate().map(bar).filter(|cell| cell[3].is_finite()).collect::<Vec<_>>()
        };
        let names: Vec<_> = rows.iter().map(|row| row.scene.as_str()).collect();
        let layers = [
            Layer::cells("this build", Colour::LINES[0], bars(|row| row.cpu_s, 0.1)),
            Layer::cells("other build", Colour::LINES[1], bars(|row| row.other_cpu_s, 0.5)),
        ];
        let x = Axis::linear("", 0.0, rows.len().max(1) as f64);
        let panel = Panel::new(names.join(", "), x, Axis::log("CPU time, s", least, most), layers);
        Figure::new("Built-in scenes in lockstep", 1, vec![panel])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reports(times: &[f64], state: &str) -> Vec<Report> {
        times.iter().map(|cpu_s| Report { cpu_s: *cpu_s, state_hash: state.to_owned() }).collect()
    }

    #[test]
    fn a_row_holds_medians_their_ratio_and_whether_states_agree() {
        let Row { cpu_s, other_cpu_s, over_other, same_state, .. } =
            row("tube", &[reports(&[0.5, 9.0, 0.4], "a"), reports(&[0.25, 0.2, 0.3], "b")]);
        assert_eq!((cpu_s, other_cpu_s, over_other, same_state), (0.5, 0.25, 2.0, Some(false)));
        let alone = row("tube", &[reports(&[0.5], "a")]);
        assert!(alone.over_other.is_nan() && alone.same_state.is_none());
    }

    #[test]
    fn what_is_no_program_or_writes_no_report_is_named() {
        let error = play(Path::new("/nowhere/metachron"), "tube", 0.1).unwrap_err().to_string();
        assert!(error.starts_with("/nowhere/metachron cannot be started"), "{error}");
        #[cfg(unix)]
        {
            let error = play(Path::new("/bin/echo"), "tube", 0.1).unwrap_err().to_string();
            assert!(error.starts_with("/bin/echo wrote no report of tube"), "{error}");
        }
    }
}
