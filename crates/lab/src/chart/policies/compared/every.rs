//! Every policy on every scene of the papers, from the scenes themselves, in lockstep on one declared machine.
//!
//! In: nothing. Out: a row for each pair, with the metrics common to all. Never here: how frames are played
//! ([`crate::chart::policies::played`]), a model of a scene. Without an adapter everything but the likeness of pictures is measured.

use crate::chart::policies::numeric::{Row, number};
use crate::chart::policies::played;
use crate::chart::policies::played::{Case, PLAYS, Times, curves, primitives};
use crate::chart::{Experiment, Figure, Finding, Table, claims, count_of};

/// The experiment.
pub(crate) struct Every;

/// The policies in the figure.
const SHOWN: [&str; 5] = ["threshold", "feedback", "robin-hood", "greedy", "adaptive"];

impl Experiment for Every {
    type Row = Row;
    const NAME: &'static str = "every";
    const TITLE: &'static str = "every policy on every scene of the papers, through the frame loop in lockstep";
    const TABLE: fn(&[Row]) -> Table = played::table;

    fn cases(quick: bool) -> Vec<Case> {
        PLAYS.iter().flat_map(|play| play.cases(quick, 0)).collect()
    }

    fn measure(case: &Case) -> Option<Row> {
        case.play(Times::Declared)
    }

    fn figure(rows: &[Row]) -> Figure {
        let panel = |scene: &str| {
            let shown = |row: &&Row| row.setting == scene && SHOWN.contains(&row.policy.as_str());
            curves(scene, rows.iter().filter(shown))
        };
        // the grove alone has boughs and leaves, which may be lines and points
        let of_kinds = rows.iter().find(|row| row.setting == "grove" && row.policy == "adaptive").map(primitives);
        let panels = PLAYS.iter().map(|play| panel(play.paper.name())).chain(of_kinds).collect();
        Figure::new("The papers' scenes in lockstep", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let mut findings =
            claims!["policies and scenes that were not run" => count_of(rows, |row| row.frames == 0), at_most 0.0];
        for scene in PLAYS.map(|play| play.paper.name()) {
            let of = |what: fn(&Row) -> f64| number(rows, scene, "adaptive", what);
            findings.extend(claims![
                "adaptive, {scene}: binding stddev" => of(|r| r.binding_stddev), at_most 0.035;
                "adaptive, {scene}: frames past 1.05 T" => of(|r| r.misses), at_most 0.01;
                "adaptive, {scene}: reversals per object and frame" => of(|r| r.reversals), at_most 0.002;
                "adaptive, {scene}: benefit over the bound" => of(|r| r.value_over_bound), at_least 0.99;
                "adaptive, {scene}: objects left out per object and frame" => of(|r| r.holes), at_most 0.0;
            ]);
        }
        findings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_lod::control::Policy;
    use std::collections::BTreeSet;

    #[test]
    fn every_policy_runs_on_every_scene_once() {
        for quick in [true, false] {
            let cases = Every::cases(quick);
            assert_eq!(cases.len(), Policy::ALL.len() * 5);
            let names: BTreeSet<_> = cases.iter().map(|case| (&case.setting, case.policy)).collect();
            assert_eq!(names.len(), cases.len());
        }
    }
}
