//! The papers' scenes drawn by the adapter that is present, under every policy, through the program's own frame loop.
//!
//! In: a scene's number among the plays. Out: an experiment. Never here: how frames are drawn ([`walk`]), a declared machine.

pub(in super::super) mod prediction;
mod row;
pub(in super::super) mod traversal;
pub(in super::super) mod views;
mod walk;

use super::super::experiment::{Experiment, Finding};
use super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel};
use super::super::table::Table;
use crate::scene::papers::Paper;
use row::Row;

/// The experiment on play number `P`.
pub(in super::super) struct Live<const P: usize>;

/// A scene, its frames, and who is to choose.
#[derive(Debug, Clone, Copy)]
struct Play {
    paper: Paper,
    /// Frames along the path, and of the quick run.
    frames: [usize; 2],
    /// How many targets full detail takes in the mean.
    times_over: f64,
    policies: &'static [&'static str],
}

/// In (FS93, table 1) full detail takes 4.3 targets in the mean and 9.9 at most.
const PLAYS: [Play; 5] = [
    Play {
        paper: Paper::Auditorium,
        frames: [250, 50],
        times_over: 4.3,
        policies: &[
            "full",
            "static",
            "threshold",
            "feedback",
            "robin-hood",
            "greedy",
            "convex",
            "marginal-fill",
            "adaptive",
        ],
    },
    Play {
        paper: Paper::Grove,
        frames: [250, 25],
        times_over: 4.0,
        policies: &["full", "robin-hood", "greedy", "adaptive"],
    },
    Play {
        paper: Paper::Domes,
        frames: [240, 24],
        times_over: 2.5,
        policies: &["full", "greedy", "hierarchical", "hierarchical-flat", "maciel-shirley", "adaptive"],
    },
    Play {
        paper: Paper::Walkthrough,
        frames: [200, 20],
        times_over: 4.0,
        policies: &["full", "greedy", "convex", "adaptive"],
    },
    Play {
        paper: Paper::Library,
        frames: [60, 20],
        times_over: 2.5,
        policies: &["full", "threshold", "greedy", "adaptive"],
    },
];

/// A policy on a play of so many frames.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Case {
    policy: String,
    frames: usize,
}

impl<const P: usize> Experiment for Live<P> {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = PLAYS[P].paper.name();
    const TITLE: &'static str =
        "the papers' scene on this adapter: who keeps to the time, and how like full detail it looks";
    const ALONE: bool = true;

    fn cases(quick: bool) -> Vec<Case> {
        let frames = PLAYS[P].frames[usize::from(quick)];
        PLAYS[P].policies.iter().map(|&policy| Case { policy: policy.to_owned(), frames }).collect()
    }

    fn measure(case: &Case) -> Row {
        walk::measure(&PLAYS[P], case)
    }

    fn case_of(row: &Row) -> Case {
        Case { policy: row.policy.clone(), frames: row.frames }
    }

    fn figure(rows: &[Row]) -> Figure {
        let adapter = rows.first().map_or("", |row| &row.adapter);
        let title = format!("{} on {adapter}", Self::NAME);
        let full = |row: &&Row| row.policy == "full";
        let panels = vec![
            times("full detail", rows.iter().filter(full)),
            times("policies", rows.iter().filter(|row| !full(row))),
        ];
        Figure { title, panels, columns: 2 }
    }

    fn table(rows: &[Row]) -> Table {
        row::table(rows)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |what: fn(&Row) -> f64| rows.iter().find(|row| row.policy == "adaptive").map_or(f64::NAN, what);
        vec![
            Finding::at_most("adaptive: longest frame / T", of(|row| row.max), 1.3),
            Finding::at_most("adaptive: stddev / T of binding frames", of(|row| row.binding_stddev), 0.08),
            Finding::at_most("adaptive: objects left out, to an object and frame", of(|row| row.holes), 0.0),
        ]
    }
}

/// The time of every frame, by policy.
fn times<'a>(title: &str, rows: impl Iterator<Item = &'a Row> + Clone) -> Panel {
    let frames = rows.clone().map(|row| row.frames).max().unwrap_or(1) as f64;
    let greatest = rows.clone().map(|row| row.max).fold(1.5, f64::max);
    let target = Mark::Dashed(vec![(0.0, 1.0), (frames, 1.0)]);
    let mut layers = vec![Layer { label: "target".to_owned(), colour: Colour::Grey, mark: target }];
    layers.extend(rows.zip(Colour::LINES.into_iter().cycle()).map(|(row, colour)| {
        let line = row.times().into_iter().enumerate().map(|(k, time)| (k as f64, time)).collect();
        Layer { label: row.policy.clone(), colour, mark: Mark::Line(line) }
    }));
    let (x, y) = (Axis::linear("frame", 0.0, frames), Axis::linear("time of a frame / target", 0.0, 1.05 * greatest));
    Panel { title: title.to_owned(), x, y, layers }
}
