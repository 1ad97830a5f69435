//! A textured room in which the shading is chosen as well (FS93, fig. 11): levels with flat, Gouraud and textured shading.

use crate::chart::policies::numeric::{
    BenefitModel, Case, Fault, ObjectLevel, Path, Policy, RandomSource, Row, Scene, SceneObject, Show, curves, key,
    number,
};
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Panel, Table, claims, each, number_of, table};
use glam::DVec3;
use metachron_lod::cost::stages::Stages;

/// The experiment.
pub(crate) struct Library;

/// The paper's targets, microseconds, and its numbers of polygons there; all of its polygons take 0.60 s.
const TARGETS: [(&str, f64, f64); 2] = [("150 ms", 150e3, 4217.0), ("100 ms", 100e3, 1389.0)];
const POLICIES: [Policy; 3] = [Policy::Full, Policy::Greedy, Policy::Adaptive];
const FRAMES: usize = 60;
/// Costs of flat, Gouraud and textured drawing, microseconds: the room of 19,821 polygons takes 0.6 s textured.
const STAGES: [Stages; 3] = [of(9.0, 0.03), of(13.0, 0.05), of(20.0, 0.12)];
/// Accuracy of each shading, as a share of the best.
const SHOWS: [f64; 3] = [0.6, 0.8, 1.0];
/// Chairs, tables, shelves, doors and walls, books: how many, polygons of each, radius, and whether they are textured.
const FURNITURE: [(usize, f64, f64, bool); 5] = [
    (32, 186.0, 0.5, false),
    (8, 240.0, 0.9, false),
    (24, 120.0, 1.1, true),
    (10, 60.0, 1.2, true),
    (96, 88.0, 0.35, true),
];
/// Share of all polygons in each level.
const PARTS: [f64; 4] = [0.05, 0.2, 0.5, 1.0];

const fn of(polygon: f64, pixel: f64) -> Stages {
    Stages { setup: 30.0, polygon, vertex: 0.0, pixel, serial: 0.0 }
}

fn show(target: f64) -> Show {
    let path = Path {
        keys: vec![key(0, [-7.0, -0.5, 1.7], 0.0, -4.0), key(FRAMES, [-6.5, 0.5, 1.7], 4.0, -4.0)],
        fov_y_deg: 60.0,
    };
    let scene = Scene { objects: objects(), stages: STAGES.to_vec() };
    Show { scene, path, fault: Fault::NONE, target, frames: FRAMES, lap: FRAMES, delay: 1, logic: 0.0, overlap: 1.0 }
}

fn objects() -> Vec<SceneObject> {
    let mut noise = RandomSource::new(11);
    let mut objects = Vec::new();
    for (count, polygons, radius_m, textured) in FURNITURE {
        for _ in 0..count {
            let centre_m =
                DVec3::new(noise.uniform() * 10.0 - 2.0, noise.uniform() * 6.0 - 3.0, 0.4 + 1.6 * noise.uniform());
            let forms = forms(polygons, textured);
            objects.push(SceneObject { centre_m, radius_m, fill: 0.6, importance: 1.0, complexity: polygons, forms });
        }
    }
    objects
}

/// Every level with every shading; for an untextured thing Gouraud shading is as accurate as texture is for a textured one.
fn forms(polygons: f64, textured: bool) -> Vec<ObjectLevel> {
    let mut forms = Vec::new();
    for (algorithm, shows) in SHOWS.into_iter().enumerate().take(if textured { 3 } else { 2 }) {
        let shows = if textured { shows } else { shows / SHOWS[1] };
        forms.extend(PARTS.map(|part| {
            let polygons = (part * polygons).round().max(2.0);
            // base error of one half, reduced by the samples, as for flat polygons (FS93, §5)
            ObjectLevel { polygons, algorithm, worth: BenefitModel::Part(shows * (1.0 - 0.5 / polygons.sqrt())) }
        }));
    }
    forms
}

impl Experiment for Library {
    type Row = Row;
    const NAME: &'static str = "library";
    const TITLE: &'static str = "textured room of about 20,000 polygons: levels and shading chosen together";
    const TABLE: fn(&[Row]) -> Table = table!(|r| target: r.setting, policy: r.policy, mean(3): r.mean, max(3): r.max,
        miss(4): r.misses, polygons: r.polygons, value(4): r.value_over_bound, proven(3): r.certified,
        paper: paper_polygons(r));

    fn cases(_: bool) -> Vec<Case> {
        each!((target, ..) in TARGETS, policy in POLICIES => Case::new(target, policy.name(), FRAMES))
    }

    fn measure(case: &Case) -> Option<Row> {
        case.measure(&show(TARGETS.iter().find(|t| t.0 == case.setting)?.1), &POLICIES)
    }

    fn figure(_: &[Row]) -> Figure {
        let mut panels: Vec<Panel> = TARGETS.iter().map(|t| shares(t.0, &show(t.1))).collect();
        panels.extend(TARGETS.iter().map(|t| curves(t.0, &show(t.1), &[Policy::Greedy, Policy::Adaptive], 1.5)));
        Figure::new("The library: shading of the drawn objects (FS93, fig. 11)", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let claims = |name: &str| {
            claims![
                "adaptive, {name}: longest frame / T" => number(rows, name, "adaptive", |r| r.max), at_most 1.15;
                "adaptive, {name}: benefit over the bound" => number(rows, name, "adaptive", |r| r.value_over_bound), at_least 0.99;
            ]
        };
        TARGETS.into_iter().flat_map(|target| claims(target.0)).collect()
    }
}

/// The paper's number of polygons for a row.
fn paper_polygons(row: &Row) -> f64 {
    if row.policy == "full" { 19_821.0 } else { number_of(&TARGETS, |t| t.0 == row.setting, |t| t.2) }
}

/// Number of things drawn with each shading, along the path.
fn shares(title: &str, show: &Show) -> Panel {
    let mut counts: [Vec<(f64, f64)>; 3] = Default::default();
    show.watch(Policy::Adaptive, 1, &mut |frame, seen, choice| {
        let ways = seen
            .iter()
            .zip(&choice.picks)
            .filter_map(|(s, p)| show.scene.objects[s.object].forms.get(p.level? as usize).map(|form| form.algorithm));
        let mut sums = [0.0; 3];
        ways.for_each(|way| sums[way] += 1.0);
        counts.iter_mut().zip(sums).for_each(|(line, sum)| line.push((frame as f64, sum)));
    });
    let named = ["flat", "Gouraud", "textured"].into_iter().zip(Colour::LINES).zip(counts);
    let layers = named.map(|((name, colour), points)| Layer::line(name, colour, points));
    let (x, y) = (Axis::linear("frame", 0.0, FRAMES as f64), Axis::linear("objects drawn", 0.0, 170.0));
    Panel::new(format!("{title}, adaptive"), x, y, layers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_has_about_the_papers_polygons_and_takes_four_and_six_targets() {
        let objects = objects();
        let all: f64 = objects.iter().map(|t| t.complexity).sum();
        assert!((all / 19_821.0 - 1.0).abs() < 0.01, "{all}");
        let seen = show(1e5).seen(0).0;
        let full = 1e-6 * Scene::full(&seen);
        assert!((0.3..0.9).contains(&full), "{full} s, the paper: 0.60 s");
    }
}
