//! The grove of (RH05, §6): trees of three kinds on a square, and two camera paths through it.
//!
//! In: the number of trees, which path, whether trees have levels, a seed. Out: the scene's text. At twenty frames a second the linear
//! path has 1000 frames, with most trees in view in the middle; the zigzag 1680, with sudden turns at 560 and 1120.

use super::camera_path::{CameraPath, stop};
use super::{Choices, head};

/// A kind of tree.
struct Kind {
    name: &'static str,
    /// Boughs, of 10 triangles each.
    branches: u32,
    /// Leaves, of 2 triangles each.
    leaves: u32,
    leaves_colour: &'static str,
}

/// The kinds of the paper: 620 + 480, 890 + 720, 1740 + 1800 triangles.
const KINDS: [Kind; 3] = [
    Kind { name: "birch", branches: 62, leaves: 240, leaves_colour: "#7fa650" },
    Kind { name: "beech", branches: 89, leaves: 360, leaves_colour: "#5a8a42" },
    Kind { name: "oak", branches: 174, leaves: 900, leaves_colour: "#47713c" },
];
/// The sky, and the ground.
const SKY: &str = "\n[world]\nenvironment = \"sky\"\n";
const MEADOW: &str = "\n[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\ncolour = \"#67743a\"\n";
/// Side of the square for 600 trees, metres; the area grows with their number.
const SIDE_M: f64 = 240.0;
const TREES: f64 = 600.0;

pub(super) fn text(choices: &Choices) -> String {
    let side_m = (SIDE_M * (f64::from(choices.trees) / TREES).sqrt()).round();
    let mut text = head(
        &format!(
            "{} trees of three kinds, each a trunk and leaves, from points and lines up to triangles (RH05).",
            choices.trees
        ),
        &format!("a walk along a grove of {} trees", choices.trees),
        &path(choices.zigzag, side_m),
    );
    text += SKY;
    for (number, kind) in (0..).zip(KINDS) {
        text += &trees(choices, number, &kind, 0.5 * side_m);
    }
    text + MEADOW
}

fn trees(choices: &Choices, number: u32, kind: &Kind, half_m: f64) -> String {
    let Kind { name, branches, leaves, leaves_colour } = kind;
    let count = (choices.trees + 2 - number) / 3;
    let (seed, lod) = (choices.seed + number, if choices.prefix { "prefix" } else { "levels" });
    format!(
        r##"
[[object]]
name = "{name}"
model = "tree"
seed = {seed}
height_m = 8.0
branches = {branches}
leaves = {leaves}
lod = "{lod}"
position_m = [{half_m:?}, {half_m:?}, 0.0]
grid = [{count}, 1, 1]
spacing_m = [0.0, 0.0, 0.0]
scatter_m = [{half_m:?}, {half_m:?}, 0.0]
scatter_seed = {seed}
leaves_colour = "{leaves_colour}"
"##
    )
}

fn path(zigzag: bool, side_m: f64) -> CameraPath {
    let place = |x: f64, y: f64| [x * side_m, y * side_m, 6.0];
    let stops = if zigzag {
        vec![
            stop(0.0, place(0.1, 0.1), 60.0, -3.0),
            stop(28.0, place(0.35, 0.6), 60.0, -3.0),
            stop(28.05, place(0.35, 0.6), -70.0, -3.0),
            stop(56.0, place(0.6, 0.2), -70.0, -3.0),
            stop(56.05, place(0.6, 0.2), 80.0, -3.0),
            stop(84.0, place(0.8, 0.5), 80.0, -3.0),
        ]
    } else {
        vec![stop(0.0, place(-0.1, -0.1), 90.0, -3.0), stop(50.0, place(1.1, -0.1), 90.0, -3.0)]
    };
    CameraPath { stops, fov_deg: 50.0 }
}
