//! Every policy on every scene of the papers, from the scenes themselves, in lockstep on one declared machine.
//!
//! In: nothing. Out: a row for each pair, with the metrics common to all. Never here: how frames are played
//! ([`crate::chart::policies::played`]), a model of a scene. Without an adapter everything but the likeness of pictures is measured.

use crate::chart::policies::numeric::common::number;
use crate::chart::policies::numeric::metrics::Row;
use crate::chart::policies::played::{COLUMNS, Case, PLAYS, Times, curves, primitives};
use crate::chart::{Experiment, Figure, Finding};

/// The experiment.
pub(crate) struct Every;

/// The policies in the figure.
const SHOWN: [&str; 5] = ["threshold", "feedback", "robin-hood", "greedy", "adaptive"];

impl Experiment for Every {
    type Row = Row;
    const NAME: &'static str = "every";
    const TITLE: &'static str = "every policy on every scene of the papers, through the frame loop in lockstep";
    const COLUMNS: &'static str = COLUMNS;

    fn cases(quick: bool) -> Vec<Case> {
        PLAYS.iter().flat_map(|play| play.cases(quick, 0)).collect()
    }

    fn measure(case: &Case) -> Row {
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
        let unplayed = rows.iter().filter(|row| row.frames == 0).count();
        let mut findings = vec![Finding::at_most("policies and scenes that were not run", unplayed as f64, 0.0)];
        for play in &PLAYS {
            let scene = play.paper.name();
            let of = |what: fn(&Row) -> f64| number(rows, scene, "adaptive", what);
            let claim = |words: &str| format!("adaptive, {scene}: {words}");
            findings.extend([
                Finding::at_most(claim("binding stddev"), of(|r| r.binding_stddev), 0.035),
                Finding::at_most(claim("frames past 1.05 T"), of(|r| r.misses), 0.01),
                Finding::at_most(claim("reversals per object and frame"), of(|r| r.reversals), 0.002),
                Finding::at_least(claim("benefit over the bound"), of(|r| r.value_over_bound), 0.99),
                Finding::at_most(claim("objects left out per object and frame"), of(|r| r.holes), 0.0),
            ]);
        }
        findings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_lod::control::Policy;

    #[test]
    fn every_policy_runs_on_every_scene_once() {
        for quick in [true, false] {
            let cases = Every::cases(quick);
            assert_eq!(cases.len(), Policy::ALL.len() * 5);
            assert!(cases.iter().enumerate().all(|(k, case)| !cases[..k].contains(case)));
        }
    }
}
