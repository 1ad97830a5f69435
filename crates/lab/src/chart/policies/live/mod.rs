//! The papers' scenes drawn by the present adapter, under every policy, through the program's own frame loop.
//!
//! In: a scene's number among the plays. Out: an experiment, of rounds in which all policies take turns; full detail, which sets the target, is
//! played once. Never here: how frames are drawn ([`super::played`]), a declared machine.

pub(in super::super) mod held;
pub(in super::super) mod prediction;
mod rounds;
pub(in super::super) mod traversal;

use super::numeric::metrics::Row;
use super::played::{Case, PLAYS, Times, curves};
use crate::chart::{Experiment, Figure, Finding, Table, claims, worst_of};
use rounds::{median_of, summary, verdict};

/// The experiment on play number `P`.
pub(in super::super) struct Live<const P: usize>;

/// Rounds in full and in the quick run.
const ROUNDS: [usize; 2] = [5, 1];

/// The policies, grouped as in the figure's panels.
const KINDS: [(&str, &[&str]); 4] = [
    ("full detail", &["full"]),
    ("by size, by feedback", &["static", "threshold", "feedback", "robin-hood"]),
    (
        "by benefit over cost",
        &["greedy", "greedy-incremental", "greedy-repaired", "hierarchical", "hierarchical-flat", "maciel-shirley"],
    ),
    ("by resolution and by margin", &["convex", "convex-barrier", "marginal-stop", "marginal-fill", "adaptive"]),
];

impl<const P: usize> Experiment for Live<P> {
    type Row = Row;
    const NAME: &'static str = PLAYS[P].paper.name();
    const TITLE: &'static str = "the papers' scene on this adapter: frame-time control and similarity to full detail";
    const ALONE: bool = true;
    const TABLE: fn(&[Row]) -> Table = summary;

    fn cases(quick: bool) -> Vec<Case> {
        let rounds = 0..ROUNDS[usize::from(quick)];
        rounds.flat_map(|round| PLAYS[P].cases(quick, round)).filter(|c| c.round == 0 || c.policy != "full").collect()
    }

    fn measure(case: &Case) -> Option<Row> {
        case.play(Times::Measured)
    }

    fn figure(rows: &[Row]) -> Figure {
        let adapter = rows.first().map_or("", |row| &row.adapter);
        let title = format!("{} on {adapter}", Self::NAME);
        let panel = |(title, policies): (&str, &[&str])| {
            curves(title, rows.iter().filter(|row| row.round == 0 && policies.contains(&row.policy.as_str())))
        };
        Figure::new(title, 2, KINDS.map(panel).to_vec())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |what: fn(&Row) -> f64| median_of(rows, "adaptive", what);
        let holes = worst_of(rows, |row| row.policy == "adaptive", |row| row.holes);
        let mut findings = verdict(Self::NAME, rows);
        findings.extend(claims![
            "adaptive: longest frame / T" => of(|row| row.max), at_most 1.3;
            "adaptive: stddev / T of binding frames" => of(|row| row.binding_stddev), at_most 0.08;
            "adaptive: objects left out per object and frame" => holes, at_most 0.0;
        ]);
        findings
    }
}
