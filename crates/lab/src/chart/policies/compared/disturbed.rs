//! The same walk on a machine that is a quarter slower than its table, has 40 % more load for a while, and stalls.

use crate::chart::policies::numeric::auditorium_model::{LAP, show};
use crate::chart::policies::numeric::{
    Case, Fault, Frame, Policy, Row, Show, common, curves, number, overshoot, settled,
};
use crate::chart::{Experiment, Figure, Finding, Shown, Table, claims, worst};

/// The experiment.
pub(crate) struct Disturbed;

const POLICIES: [Policy; 3] = [Policy::Threshold, Policy::Greedy, Policy::Adaptive];
const SEEDS: usize = 5;
const FRAMES: usize = 4 * LAP;
const SETTING: &str = "disturbed";
/// Frames with 40 % more load.
const LOADED: std::ops::Range<usize> = 300..700;
/// The frames whose mean is the settled time after each of the two steps.
const LATER: [std::ops::Range<usize>; 2] = [400..690, 750..980];
/// Frames until the time of one is known.
const DELAY: usize = 2;

/// Stalls: near the share of late frames that the default's margin allows, which therefore comes and goes with their number.
const SPIKES: f64 = 0.01;

fn disturbed(spikes: f64) -> Show {
    let fault = Fault { slow: 1.25, load: (LOADED, 1.4), spikes, ..Fault::NONE };
    show(fault, FRAMES, DELAY)
}

impl Experiment for Disturbed {
    type Row = Row;
    const NAME: &'static str = "disturbed";
    const TITLE: &'static str =
        "cost table 25 % too low, 40 % more load in frames 300 to 700, stalls of 50 % in 1 % of frames";
    const TABLE: fn(&[Row]) -> Table =
        |rows| common::table(rows).with("settled", rows.iter().map(|row| row.settled.cell(0)));

    fn cases(quick: bool) -> Vec<Case> {
        let seeds = if quick { 1 } else { SEEDS };
        POLICIES.map(|policy| Case::new(SETTING, policy.name(), seeds * FRAMES)).to_vec()
    }

    fn measure(case: &Case) -> Option<Row> {
        let (seeds, policy) = (1..=(case.frames / FRAMES) as u64, case.policy_of(&POLICIES)?);
        let played = |spikes| seeds.clone().map(|seed| disturbed(spikes).play(policy, seed)).collect::<Vec<_>>();
        let runs = played(SPIKES);
        let settles = |run: &Vec<Frame>| {
            let times: Vec<f64> = run.iter().map(|f| f.time).collect();
            worst([LOADED.start, LOADED.end].into_iter().zip(LATER).map(|(step, later)| settled(&times, step, later)))
        };
        Some(Row {
            settled: worst(played(0.0).iter().map(settles)),
            overshoot: worst(runs.iter().map(|run| overshoot(run, LOADED.start))),
            ..Row::of(&case.setting, case.policy, &runs)
        })
    }

    fn figure(_: &[Row]) -> Figure {
        let panels = POLICIES.map(|policy| curves(policy.name(), &disturbed(SPIKES), &[policy], 2.5));
        Figure::new("Cost table too low, load step, stalls", 3, panels.to_vec())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |policy: &str, what: fn(&Row) -> f64| number(rows, SETTING, policy, what);
        claims![
            "adaptive: frames past 1.05 T" => of("adaptive", |r| r.misses), at_most 0.05;
            "adaptive, without stalls: frames until settled after a step" => of("adaptive", |r| r.settled), at_most 15.0;
            "greedy (no learning): frames past 1.05 T" => of("greedy", |r| r.misses), at_least 0.9;
        ]
    }
}
