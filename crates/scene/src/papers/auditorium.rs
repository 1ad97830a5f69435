//! The auditorium of (FS93, §8): 384 seats in rising rows, 16 pieces of a stage, and a walk with half a turn in six frames.
//!
//! In: a seed. Out: the scene's text. At ten frames a second the walk has the paper's 250: A, many seats across the view (frame 40);
//! B, few and small ones, from the foyer (130); C, the sudden turn from the stage to the seats (178 … 184).

use super::camera_path::{CameraPath, stop};
use super::{FLOOR, head};

/// Triangles of a seat; the pieces of the stage have the rest of 87,565.
const SEAT: u32 = 186;
const SINGER: u32 = 1004;
const WREATH: u32 = 1014;
/// A mesh with an open border can have an odd number of triangles, as the sum has.
const CURTAIN: u32 = 1011;
const CURTAIN_SEED: u32 = 3;

/// The room, a foyer beside it with a door and an arch, the stage, and a step under each row of seats.
const ROOMS: &str = r##"
[[cell]]
name = "auditorium"
from_m = [-12.0, -10.0, 0.0]
to_m = [19.0, 9.0, 9.5]
walls_m = 0.2
without = ["floor"]
colour = "#b9a58c"

[[cell]]
name = "foyer"
from_m = [-17.0, -17.0, 0.0]
to_m = [4.0, -10.0, 4.0]
walls_m = 0.2
without = ["floor"]
colour = "#a8b0b4"

[[portal]]
between = ["auditorium", "foyer"]
from_m = [-2.6, -10.0, 0.0]
to_m = [0.6, -10.0, 2.8]

[[portal]]
between = ["auditorium", "foyer"]
from_m = [-11.8, -10.0, 0.0]
to_m = [-8.4, -10.0, 3.4]

[[object]]
name = "stage"
model = "rigid"
shape = "box"
fixed = true
half_extents_m = [4.6, 7.5, 0.35]
position_m = [-7.1, 0.0, 0.35]
colour = "#8a6a48"

[[object]]
name = "step"
model = "rigid"
shape = "box"
fixed = true
half_extents_m = [0.5, 7.4, 1.2]
position_m = [2.0, 0.0, -1.2]
grid = [16, 1, 1]
spacing_m = [1.0, 0.0, 0.0]
rise_m = [0.15, 0.0]
colour = "#7d7468"
"##;

pub(super) fn text(seed: u32) -> String {
    let head = head(
        "384 seats in rising rows before a stage, 87,565 triangles, and a walk that turns round in six frames (FS93).",
        "an auditorium of 384 seats, and a walk that turns round suddenly",
        &path(),
    );
    format!(
        r##"{head}{ROOMS}
[[object]]
name = "seat"
model = "mesh"
generate = "seat"
triangles = {SEAT}
position_m = [2.0, -6.9, 0.0]
rotation_deg = [0.0, 0.0, 90.0]
grid = [16, 24, 1]
spacing_m = [1.0, 0.6, 0.0]
rise_m = [0.15, 0.0]
colour = "#9c4a44"

[[object]]
name = "singer"
model = "mesh"
generate = "blob"
seed = {seed}
triangles = {SINGER}
scale = 0.8
position_m = [-4.0, -6.3, 1.5]
grid = [1, 8, 1]
spacing_m = [0.0, 1.8, 0.0]
colour = "#c9a86a"

[[object]]
name = "wreath"
model = "mesh"
generate = "torus"
triangles = {WREATH}
scale = 0.7
position_m = [-6.5, -5.4, 1.5]
rotation_deg = [0.0, 90.0, 0.0]
grid = [1, 7, 1]
spacing_m = [0.0, 1.8, 0.0]
colour = "#6a8f7a"

[[object]]
name = "curtain"
model = "mesh"
generate = "terrain"
seed = {CURTAIN_SEED}
triangles = {CURTAIN}
scale = 5.0
position_m = [-9.0, 0.0, 4.0]
rotation_deg = [0.0, 90.0, 0.0]
colour = "#4a4f78"
{FLOOR}"##
    )
}

fn path() -> CameraPath {
    let stops = vec![
        stop(0.0, [-0.5, -9.0, 2.2], 42.0, -8.0),
        stop(6.0, [0.5, -9.5, 2.2], 44.0, -8.0),
        stop(11.5, [-10.4, -15.5, 2.4], 90.0, -4.0),
        stop(15.0, [-10.6, -16.0, 2.4], 91.0, -4.0),
        stop(15.4, [-9.5, -9.3, 2.2], 120.0, -2.0),
        stop(15.7, [-2.0, -8.0, 2.0], 150.0, -1.0),
        stop(16.0, [0.8, 0.0, 1.7], 180.0, 0.0),
        stop(17.8, [1.0, 0.0, 1.7], 180.0, 0.0),
        stop(18.4, [1.0, 0.0, 1.9], 0.0, 5.0),
        stop(25.0, [-0.5, 0.0, 2.1], -8.0, 3.0),
    ];
    CameraPath { stops, fov_deg: 60.0 }
}
