//! The grove of (RH05) in numbers: trees of three types, with trunk and leaves as separate things, and the two paths.
//!
//! In: number of trees, a path, a target, the forms. Out: a show. Counts of triangles, targets and the frames of the jumps
//! are the paper's; positions, times and the paths' courses are our own.

use super::camera::{Path, key};
use super::closed_loop::Show;
use super::machine::{Fault, RandomSource};
use super::scene::{BenefitModel, ObjectLevel, Scene, SceneObject};
use glam::DVec3;
use metachron_lod::cost::stages::Stages;

/// Triangles of the trunk and of the leaves of each type (RH05, table 1).
const TRIANGLES: [[f64; 2]; 3] = [[620.0, 480.0], [890.0, 720.0], [1740.0, 1800.0]];
/// Side of the square of 600 trees, metres; more trees take a larger one.
const SIDE_M: f64 = 240.0;
const TREES: f64 = 600.0;
/// Importance of leaves: half that of the trunk, which identifies a tree; the paper gives no number.
const LEAVES_IMPORTANCE: f64 = 0.5;
/// Costs of triangles, lines and points, microseconds: 600 trees take half a second.
const STAGES: [Stages; 3] = [of(0.4), of(0.25), of(0.15)];
/// Logic of a visible instance, microseconds, and the share of the shorter of logic and drawing that adds to the longer.
const LOGIC: f64 = 2.0;
const OVERLAP: f64 = 0.25;
/// Widths of lines and sizes of points, pixels (RH05, §7.2: 1 … 20).
const WIDTHS: [f64; 12] = [20.0, 16.0, 13.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0];

const fn of(polygon: f64) -> Stages {
    Stages { setup: 1.0, polygon, vertex: 0.0, pixel: 0.0, serial: 0.0 }
}

/// The forms in which a tree can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Forms {
    /// All its triangles, or as many of them as the time pays for.
    Whole,
    /// The first triangles, in steps of half an octave: the same for policies that choose among levels.
    Prefixes,
    /// Lines for the trunk and points for the leaves, wider the fewer they are, and all triangles.
    Levels,
}

/// The two paths through the grove.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CameraPath {
    /// Along one side: most trees are in view in the middle.
    Linear,
    /// Back and forth with two sudden turns.
    Zigzag,
}

/// A walk of `frames` frames through a grove, `target` microseconds per frame.
pub(crate) fn show(trees: usize, path: CameraPath, target: f64, forms: Forms, frames: usize) -> Show {
    let side_m = SIDE_M * (trees as f64 / TREES).sqrt();
    let scene = Scene { objects: objects(trees, side_m, forms), stages: STAGES.to_vec() };
    let path = keyed_path(path, side_m, frames);
    Show { scene, path, fault: Fault::NONE, target, frames, lap: frames, delay: 1, logic: LOGIC, overlap: OVERLAP }
}

fn objects(trees: usize, side_m: f64, forms: Forms) -> Vec<SceneObject> {
    let mut noise = RandomSource::new(trees as u64);
    let tree = |i: usize| {
        let at = DVec3::new(noise.uniform() * side_m, noise.uniform() * side_m, 4.0);
        let [trunk, leaves] = TRIANGLES[i % 3];
        let part = |triangles, fill, importance, simpler| SceneObject {
            centre_m: at,
            radius_m: 4.0,
            fill,
            importance,
            complexity: triangles,
            forms: list(forms, triangles, simpler),
        };
        [part(trunk, 0.1, 1.0, 1), part(leaves, 0.5, LEAVES_IMPORTANCE, 2)]
    };
    (0..trees).flat_map(tree).collect()
}

/// The forms of a thing of so many triangles, coarsest first; `simpler` is the algorithm that draws lines or points.
fn list(forms: Forms, triangles: f64, simpler: usize) -> Vec<ObjectLevel> {
    let whole = ObjectLevel { polygons: triangles, algorithm: 0, worth: BenefitModel::Part(1.0) };
    // as many as cover the same pixels at their width; the benefit falls with the width
    let wide =
        |w: f64| ObjectLevel { polygons: triangles / w, algorithm: simpler, worth: BenefitModel::Part(0.9 / w.sqrt()) };
    match forms {
        Forms::Whole => vec![whole],
        Forms::Prefixes => (0..=16).rev().map(|k| ObjectLevel::prefix(triangles, k)).collect(),
        Forms::Levels => WIDTHS.into_iter().map(wide).chain([whole]).collect(),
    }
}

fn keyed_path(path: CameraPath, side_m: f64, frames: usize) -> Path {
    let at = |part: f64| (part * frames as f64) as usize;
    let place = |x: f64, y: f64| [x * side_m, y * side_m, 6.0];
    let keys = match path {
        CameraPath::Linear => vec![key(0, place(-0.1, -0.1), 90.0, -3.0), key(frames, place(1.1, -0.1), 90.0, -3.0)],
        // frames 560 and 1120 of 1680
        CameraPath::Zigzag => vec![
            key(0, place(0.1, 0.1), 60.0, -3.0),
            key(at(1.0 / 3.0), place(0.35, 0.6), 60.0, -3.0),
            key(at(1.0 / 3.0) + 1, place(0.35, 0.6), -70.0, -3.0),
            key(at(2.0 / 3.0), place(0.6, 0.2), -70.0, -3.0),
            key(at(2.0 / 3.0) + 1, place(0.6, 0.2), 80.0, -3.0),
            key(frames, place(0.8, 0.5), 80.0, -3.0),
        ],
    };
    Path { keys, fov_y_deg: 50.0 }
}
