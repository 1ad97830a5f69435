//! The walk through the auditorium under every policy (FS93, §8, table 1 and fig. 7).

use crate::chart::policies::numeric::auditorium_model::{LAP, show};
use crate::chart::policies::numeric::{Case, Fault, Policy, Row, common, curves, number};
use crate::chart::{Experiment, Figure, Finding, Table, claims};
use metachron_lod::cost::value::Value;

/// The experiment.
pub(crate) struct Auditorium;

const POLICIES: [Policy; 9] = [
    Policy::Full,
    Policy::Static,
    Policy::StaticFine,
    Policy::Threshold,
    Policy::RobinHood(Value::Steep),
    Policy::Convex,
    Policy::Greedy,
    Policy::MarginalFill,
    Policy::Adaptive,
];
const SEEDS: usize = 5;
const SETTING: &str = "walk";

impl Experiment for Auditorium {
    type Row = Row;
    const NAME: &'static str = "auditorium";
    const TITLE: &'static str = "frame-time control on a walkthrough of 384 seats with half a turn in six frames";
    const TABLE: fn(&[Row]) -> Table = common::table;

    fn cases(quick: bool) -> Vec<Case> {
        let seeds = if quick { 1 } else { SEEDS };
        POLICIES.map(|policy| Case::new(SETTING, policy.name(), seeds * LAP)).to_vec()
    }

    fn measure(case: &Case) -> Option<Row> {
        case.measure(&show(Fault::NONE, LAP, 1), &POLICIES)
    }

    fn figure(_: &[Row]) -> Figure {
        let show = show(Fault::NONE, LAP, 1);
        let panels = vec![
            curves("no choice (four times the scale)", &show, &[Policy::Full], 12.0),
            curves("by size", &show, &[Policy::StaticFine, Policy::Threshold], 3.0),
            curves("by prediction", &show, &[Policy::Greedy, Policy::Adaptive], 3.0),
        ];
        Figure::new("Walkthrough of the auditorium (FS93, fig. 7)", 1, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |policy: &str, what: fn(&Row) -> f64| number(rows, SETTING, policy, what);
        let spread = |policy: &str| of(policy, |r| r.binding_stddev);
        let (greedy, ours) = (spread("greedy"), spread("adaptive"));
        let by_size = spread("static-64-px").min(spread("threshold"));
        let none_over_size = spread("full") / spread("static-64-px").max(spread("threshold"));
        claims![
            "binding stddev, none over the greater by size: > 1" => none_over_size, at_least 1.0;
            "binding stddev, greedy over the least of the first three: < 1/3" => greedy / by_size.min(spread("full")), at_most 1.0 / 3.0;
            "binding stddev, adaptive over greedy: < 1" => ours / greedy, at_most 1.0;
            "adaptive: longest frame / T" => of("adaptive", |r| r.max), at_most 1.15;
            "adaptive: binding stddev" => ours, at_most 0.035;
            "adaptive: frames past 1.05 T" => of("adaptive", |r| r.misses), at_most 0.01;
            "adaptive: benefit over the bound" => of("adaptive", |r| r.value_over_bound), at_least 0.99;
            "adaptive: reversals per object and frame" => of("adaptive", |r| r.reversals), at_most 0.002;
        ]
    }
}
