//! Walks through the grove: how close to its target time every policy stays (RH05, tables 2 and 3).

use crate::chart::policies::numeric::{CameraPath, Case, Forms, Policy, Row, Show, common, curves, forest, number};
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Panel, Shown, Table, claims, number_of, span};
use metachron_lod::cost::value::Value;

/// The experiment.
pub(crate) struct Grove;

/// A walk; `paper` is the paper's mean |t − T|/T.
struct Setting {
    name: &'static str,
    trees: usize,
    path: CameraPath,
    target: f64,
    levels: bool,
    paper: f64,
    limit: f64,
}

const fn plain(name: &'static str, path: CameraPath, target: f64, paper: f64) -> Setting {
    Setting { name, trees: 600, path, target, levels: false, paper, limit: 0.03 }
}

const SETTINGS: [Setting; 13] = [
    plain("linear, 12.5 ms", CameraPath::Linear, 12.5e3, 0.0651),
    plain("linear, 25 ms", CameraPath::Linear, 25e3, 0.0738),
    plain("linear, 50 ms", CameraPath::Linear, 50e3, 0.0551),
    plain("linear, 100 ms", CameraPath::Linear, 100e3, 0.0296),
    plain("linear, 200 ms", CameraPath::Linear, 200e3, 0.0094),
    plain("zigzag, 12.5 ms", CameraPath::Zigzag, 12.5e3, 0.0735),
    plain("zigzag, 25 ms", CameraPath::Zigzag, 25e3, 0.0674),
    plain("zigzag, 50 ms", CameraPath::Zigzag, 50e3, 0.0485),
    plain("zigzag, 100 ms", CameraPath::Zigzag, 100e3, 0.0243),
    plain("zigzag, 200 ms", CameraPath::Zigzag, 200e3, 0.0109),
    Setting {
        name: "linear with levels, 40 ms",
        levels: true,
        limit: 0.04,
        ..plain("", CameraPath::Linear, 40e3, 0.0887)
    },
    Setting { name: "linear, 1000 trees, 50 ms", trees: 1000, ..plain("", CameraPath::Linear, 50e3, f64::NAN) },
    Setting { name: "linear, 2000 trees, 50 ms", trees: 2000, ..plain("", CameraPath::Linear, 50e3, f64::NAN) },
];
const QUICK: [&str; 3] = ["linear, 12.5 ms", "zigzag, 100 ms", "linear with levels, 40 ms"];
/// Frames of the two paths; the quick run takes the same paths in steps four times as long.
const FRAMES: [usize; 2] = [1000, 1680];
const QUICK_PART: usize = 4;
/// Least benefit of a choice, as a share of the upper bound.
const VALUE_WANTED: f64 = 0.99;
/// Range of the figure in parts of the target: full detail stays inside too.
const TIMES: (f64, f64) = (0.5, 50.0);

/// Robin Hood as in the paper: eq. 8 without levels, eq. 11 with them.
const POLICIES: [Policy; 2] = [Policy::RobinHood(Value::Gentle), Policy::Adaptive];
const WITH_LEVELS: [Policy; 2] = [Policy::RobinHood(Value::Focus), Policy::Adaptive];

impl Setting {
    fn policies(&self) -> [Policy; 2] {
        if self.levels { WITH_LEVELS } else { POLICIES }
    }

    fn frames(&self, quick: bool) -> usize {
        FRAMES[usize::from(self.path == CameraPath::Zigzag)] / if quick { QUICK_PART } else { 1 }
    }

    fn show(&self, policy: Policy, frames: usize) -> Show {
        let forms = match (self.levels, policy) {
            (true, _) => Forms::Levels,
            (false, Policy::RobinHood(_)) => Forms::Whole,
            (false, _) => Forms::Prefixes,
        };
        forest::show(self.trees, self.path, self.target, forms, frames)
    }
}

impl Experiment for Grove {
    type Row = Row;
    const NAME: &'static str = "grove";
    const TITLE: &'static str = "600 to 2000 trees, five targets, two paths, with levels and without";
    const TABLE: fn(&[Row]) -> Table = |rows| {
        let paper = |row: &Row| number_of(&SETTINGS, |s| s.name == row.setting, |s| s.paper);
        common::table(rows).with("paper_avg_err", rows.iter().map(|row| paper(row).cell(4)))
    };

    fn cases(quick: bool) -> Vec<Case> {
        let asked = |s: &&Setting| !quick || QUICK.contains(&s.name);
        let of = |s: &Setting| s.policies().map(|policy| Case::new(s.name, policy.name(), s.frames(quick)));
        SETTINGS.iter().filter(asked).flat_map(of).collect()
    }

    fn measure(case: &Case) -> Option<Row> {
        let setting = SETTINGS.iter().find(|s| s.name == case.setting)?;
        let policies = setting.policies();
        case.measure(&setting.show(case.policy_of(&policies)?, case.frames), &policies)
    }

    fn figure(_: &[Row]) -> Figure {
        let frames = FRAMES[0] / QUICK_PART;
        let panel = |s: &Setting, policy: Policy| {
            let title = format!("{}, {}", s.name, policy.name());
            let plain = curves(&title, &s.show(policy, frames), &[Policy::Full, policy], TIMES.1);
            Panel { y: Axis::log(plain.y.label, TIMES.0, TIMES.1), ..plain }
        };
        let levels = &SETTINGS[10];
        let [hood, ours] = levels.policies();
        let panels = vec![
            panel(&SETTINGS[2], POLICIES[0]),
            panel(&SETTINGS[2], POLICIES[1]),
            panel(levels, hood),
            panel(levels, ours),
            primitives(&levels.show(hood, frames), hood),
            primitives(&levels.show(ours, frames), ours),
        ];
        Figure::new("Fly-throughs of the grove (RH05, fig. 3, 6 and 7)", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let there = SETTINGS.iter().filter(|s| rows.iter().any(|r| r.setting == s.name));
        let claims = |Setting { name, limit, .. }: &Setting| {
            let of = |what: fn(&Row) -> f64| number(rows, name, "adaptive", what);
            claims![
                "adaptive, {name}: AvgErr" => of(|r| r.avg_err), at_most *limit;
                "adaptive, {name}: benefit over the bound" => of(|r| r.value_over_bound), at_least VALUE_WANTED;
            ]
        };
        there.flat_map(claims).collect()
    }
}

/// Triangles, lines and points of every frame (RH05, fig. 6).
fn primitives(show: &Show, policy: Policy) -> Panel {
    let mut counts: [Vec<(f64, f64)>; 3] = Default::default();
    show.watch(policy, 1, &mut |frame, seen, choice| {
        let mut sums = [0.0; 3];
        for (s, pick) in seen.iter().zip(&choice.picks) {
            if let Some(form) = pick.level.and_then(|l| show.scene.objects[s.object].forms.get(l as usize)) {
                sums[form.algorithm] += pick.part * form.polygons;
            }
        }
        counts.iter_mut().zip(sums).for_each(|(line, sum)| line.push((frame as f64, sum)));
    });
    let (low, high) = span(counts.iter().flatten().map(|c| c.1), false);
    let named = ["triangles", "lines", "points"].into_iter().zip(Colour::LINES).zip(counts);
    let layers = named.map(|((name, colour), points)| Layer::line(name, colour, points));
    let x = Axis::linear("frame", 0.0, show.frames as f64);
    let y = Axis::linear("primitives per frame", low.max(0.0), high);
    Panel::new(format!("primitives, {}", policy.name()), x, y, layers)
}
