//! A walk among 200 meshes of any resolution with a sudden turn (GB99): accuracy of the prediction, and proof of the choice.

use crate::chart::policies::numeric::{
    Case, Fault, ObjectLevel, Path, Policy, RandomSource, Row, Scene, SceneObject, Show, common, curves, key, number,
};
use crate::chart::{Experiment, Figure, Finding, Table, claims};
use glam::DVec3;
use metachron_lod::cost::stages::Stages;

/// The experiment.
pub(crate) struct Walkthrough;

const MESHES: usize = 200;
const TRIANGLES: f64 = 1.5e6;
const FRAMES: usize = 1000;
const QUICK_PART: usize = 4;
/// T, microseconds.
const TARGET: f64 = 1e5;
const STAGES: Stages = Stages { setup: 30.0, polygon: 0.6, vertex: 0.1, pixel: 0.002, serial: 0.0 };
/// Steps of the ladder, half an octave each: down to a five-hundredth of the triangles.
const STEPS: i32 = 18;
const POLICIES: [Policy; 3] = [Policy::Greedy, Policy::Convex, Policy::Adaptive];
const SETTING: &str = "walk";

fn show(frames: usize) -> Show {
    let path = path(frames);
    let scene = Scene { objects: objects(), stages: vec![STAGES] };
    Show { scene, path, fault: Fault::NONE, target: TARGET, frames, lap: frames, delay: 1, logic: 0.0, overlap: 1.0 }
}

/// Meshes of log-normal triangle counts: 20 in front of the camera, the rest behind it.
fn objects() -> Vec<SceneObject> {
    let mut noise = RandomSource::new(99);
    let counts: Vec<f64> = (0..MESHES).map(|_| libm::exp(noise.normal())).collect();
    let scale = TRIANGLES / counts.iter().sum::<f64>();
    let mut object = |(i, count): (usize, &f64)| {
        let ahead = i % 10 == 0;
        let along = noise.uniform();
        let x = if ahead { -4.0 - 26.0 * along } else { 4.0 + 56.0 * along };
        let centre_m = DVec3::new(x, (noise.uniform() - 0.5) * 0.8 * x.abs(), 1.0);
        let triangles = (scale * count).round();
        let forms = (0..=STEPS).rev().map(|k| ObjectLevel::prefix(triangles, k)).collect();
        SceneObject { centre_m, radius_m: 1.0, fill: 0.7, importance: 1.0, complexity: triangles, forms }
    };
    counts.iter().enumerate().map(&mut object).collect()
}

/// Towards the few meshes, which leave the view one by one; at seven tenths half a turn in ten frames, towards the many.
fn path(frames: usize) -> Path {
    let turn = frames * 7 / 10;
    let keys = vec![
        key(0, [3.0, 0.0, 1.6], 180.0, 0.0),
        key(turn, [-14.0, 0.0, 1.6], 180.0, 0.0),
        key(turn + 10, [-14.0, 0.0, 1.6], 360.0, 0.0),
        key(frames, [-10.0, 2.0, 1.6], 365.0, 0.0),
    ];
    Path { keys, fov_y_deg: 50.0 }
}

impl Experiment for Walkthrough {
    type Row = Row;
    const NAME: &'static str = "walkthrough";
    const TITLE: &'static str =
        "200 meshes of 1.5 million triangles and a sudden turn: prediction, measurement and certificate";
    const TABLE: fn(&[Row]) -> Table = common::table;

    fn cases(quick: bool) -> Vec<Case> {
        let frames = FRAMES / if quick { QUICK_PART } else { 1 };
        POLICIES.map(|policy| Case::new(SETTING, policy.name(), frames)).to_vec()
    }

    fn measure(case: &Case) -> Option<Row> {
        case.measure(&show(case.frames), &POLICIES)
    }

    fn figure(_: &[Row]) -> Figure {
        let show = show(FRAMES);
        let panels = vec![
            curves("no choice", &show, &[Policy::Full], 15.0),
            curves("meshes of any resolution", &show, &[Policy::Convex, Policy::Adaptive], 1.5),
        ];
        Figure::new("A walkthrough of 200 meshes", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |what: fn(&Row) -> f64| number(rows, SETTING, "adaptive", what);
        claims![
            "adaptive: mean error of the prediction" => of(|r| r.model_error), at_most 0.05;
            "adaptive: frames whose certificate is within 1 %" => of(|r| r.certified), at_least 0.95;
            "adaptive: benefit over the bound" => of(|r| r.value_over_bound), at_least 0.99;
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_brings_from_twenty_meshes_to_nearly_all() {
        let show = show(FRAMES);
        let seen = |frame: usize| show.seen(frame).0.len();
        assert!(seen(0) >= 15 && seen(699) <= 20, "{} {}", seen(0), seen(699));
        assert!(seen(720) >= 150, "{}", seen(720));
        let all: f64 = show.scene.objects.iter().map(|t| t.complexity).sum();
        assert!((all / TRIANGLES - 1.0).abs() < 1e-3);
    }
}
