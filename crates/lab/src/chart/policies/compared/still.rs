//! A fixed camera in front of a scene in which nothing moves: no level may change.

use crate::chart::policies::numeric::{
    Case, Fault, Path, Policy, Row, Show, auditorium_model, common, curves, key, number,
};
use crate::chart::{Experiment, Figure, Finding, Table, each};

/// The experiment.
pub(crate) struct Still;

const POLICIES: [Policy; 3] = [Policy::Threshold, Policy::Greedy, Policy::Adaptive];
const SEEDS: usize = 5;
const FRAMES: usize = 300;
/// Frames in which levels may change, while the policy learns the machine's factor and first misses make its budget cautious; only
/// later frames are judged.
const LEARNT: usize = 60;
/// Faults of the machine, and whether levels must stay. An error that wanders as with a moving view, although nothing moves, no
/// longer makes a still picture: it is reported, not judged.
const SETTINGS: [(&str, Fault, bool); 3] = [
    ("exact", Fault { wander: 0.0, tremble: 0.0, ..Fault::NONE }, true),
    ("a quarter slow, trembles by 1 %", Fault { slow: 1.25, wander: 0.0, ..Fault::NONE }, true),
    ("wanders by 5 %", Fault::NONE, false),
];

fn still(setting: &str) -> Show {
    let fault = SETTINGS.iter().find(|s| s.0 == setting).map_or(Fault::NONE, |s| s.1.clone());
    let path = Path { keys: vec![key(0, [-0.5, -9.0, 2.2], 42.0, -8.0)], fov_y_deg: 60.0 };
    Show { path, ..auditorium_model::show(fault, FRAMES, 1) }
}

impl Experiment for Still {
    type Row = Row;
    const NAME: &'static str = "still";
    const TITLE: &'static str = "static scene: changes of level by policy";
    const TABLE: fn(&[Row]) -> Table = common::table;

    fn cases(quick: bool) -> Vec<Case> {
        let seeds = if quick { 1 } else { SEEDS };
        each!((setting, ..) in SETTINGS, policy in POLICIES => Case::new(setting, policy.name(), seeds * (FRAMES - LEARNT)))
    }

    fn measure(case: &Case) -> Option<Row> {
        let (show, policy) = (still(&case.setting), case.policy_of(&POLICIES)?);
        let seeds = (case.frames / (FRAMES - LEARNT)) as u64;
        let runs: Vec<_> = (1..=seeds).map(|seed| show.play(policy, seed).split_off(LEARNT)).collect();
        Some(Row::of(&case.setting, case.policy, &runs))
    }

    fn figure(_: &[Row]) -> Figure {
        let panels = SETTINGS.iter().map(|s| curves(s.0, &still(s.0), &POLICIES, 1.5)).collect();
        Figure::new("A static scene", 3, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let changes = |setting: &str| number(rows, setting, "adaptive", |r| r.changes);
        let judged = SETTINGS.iter().filter(|s| s.2);
        judged.map(|s| Finding::at_most(format!("adaptive, {}: levels changed", s.0), changes(s.0), 0.0)).collect()
    }
}
