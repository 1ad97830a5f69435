//! The library of (FS93, fig. 11): a textured room whose shading is chosen with its triangles.
//!
//! In: nothing. Out: the scene's text. 32 chairs, 8 tables, 24 shelves, 10 doors and 96 sets of books are 19,800 triangles; the paper has
//! 19,821.

use super::camera_path::{CameraPath, stop};
use super::{FLOOR, head};

/// A grid of equal pieces.
struct Row {
    /// Position of the first, metres.
    position_m: [f64; 3],
    /// Numbers along x, y, z.
    grid: [u32; 3],
    spacing_m: [f64; 3],
    /// Rotation of each about z, degrees.
    yaw_deg: f64,
}

/// Furniture of one kind.
struct Furniture {
    kind: &'static str,
    /// Triangles of each.
    triangles: u32,
    colour: &'static str,
    texture: Option<&'static str>,
    rows: &'static [Row],
}

const SEATS: &[Row] = &[
    Row { position_m: [0.0, -1.75, 0.0], grid: [8, 1, 1], spacing_m: [1.0, 0.0, 0.0], yaw_deg: 0.0 },
    Row { position_m: [0.0, -0.45, 0.0], grid: [8, 1, 1], spacing_m: [1.0, 0.0, 0.0], yaw_deg: 180.0 },
    Row { position_m: [0.0, 0.45, 0.0], grid: [8, 1, 1], spacing_m: [1.0, 0.0, 0.0], yaw_deg: 0.0 },
    Row { position_m: [0.0, 1.75, 0.0], grid: [8, 1, 1], spacing_m: [1.0, 0.0, 0.0], yaw_deg: 180.0 },
];
const TABLES: &[Row] =
    &[Row { position_m: [0.5, -1.1, 0.0], grid: [4, 2, 1], spacing_m: [2.0, 2.2, 0.0], yaw_deg: 0.0 }];
const SHELVES: &[Row] = &[
    Row { position_m: [-1.4, 2.9, 0.0], grid: [12, 1, 1], spacing_m: [1.0, 0.0, 0.0], yaw_deg: 0.0 },
    Row { position_m: [-1.4, -2.9, 0.0], grid: [12, 1, 1], spacing_m: [1.0, 0.0, 0.0], yaw_deg: 180.0 },
];
const DOORS: &[Row] = &[
    Row { position_m: [10.5, -2.4, 0.0], grid: [1, 5, 1], spacing_m: [0.0, 1.2, 0.0], yaw_deg: 90.0 },
    Row { position_m: [10.5, -2.4, 2.1], grid: [1, 5, 1], spacing_m: [0.0, 1.2, 0.0], yaw_deg: 90.0 },
];
const BOOKS: &[Row] = &[
    Row { position_m: [-1.65, 2.85, 1.015], grid: [24, 1, 2], spacing_m: [0.5, 0.0, 0.7], yaw_deg: 0.0 },
    Row { position_m: [-1.65, -2.85, 1.015], grid: [24, 1, 2], spacing_m: [0.5, 0.0, 0.7], yaw_deg: 180.0 },
];

const FURNITURE: [Furniture; 5] = [
    Furniture { kind: "seat", triangles: 186, colour: "#8a5a3c", texture: None, rows: SEATS },
    Furniture { kind: "table", triangles: 240, colour: "#c9a070", texture: Some("planks"), rows: TABLES },
    Furniture { kind: "shelf", triangles: 120, colour: "#9c7450", texture: Some("planks"), rows: SHELVES },
    Furniture { kind: "door", triangles: 60, colour: "#ab9474", texture: Some("planks"), rows: DOORS },
    Furniture { kind: "books", triangles: 88, colour: "#ffffff", texture: Some("books"), rows: BOOKS },
];

/// The room, and a corridor beside it behind a door.
const ROOMS: &str = r##"
[[cell]]
name = "library"
from_m = [-6.2, -3.4, 0.0]
to_m = [10.8, 3.4, 4.4]
walls_m = 0.1
without = ["floor"]
colour = "#cdbfa6"

[[cell]]
name = "corridor"
from_m = [-6.2, -6.4, 0.0]
to_m = [10.8, -3.4, 3.0]
walls_m = 0.1
without = ["floor"]
colour = "#b4b8b0"

[[portal]]
between = ["library", "corridor"]
from_m = [-5.0, -3.4, 0.0]
to_m = [-3.6, -3.4, 2.2]

[[portal]]
between = ["library", "outside"]
from_m = [-5.4, 3.4, 1.0]
to_m = [-2.8, 3.4, 2.8]
"##;

pub(super) fn text() -> String {
    let mut text = head(
        "A textured room of 19,800 triangles in which the policy chooses the shading as well (FS93, fig. 11).",
        "a library whose triangles and shading are chosen together",
        &path(),
    );
    text += ROOMS;
    for furniture in &FURNITURE {
        for (number, row) in furniture.rows.iter().enumerate() {
            text += &furniture.row(number, row);
        }
    }
    text + FLOOR
}

impl Furniture {
    fn row(&self, number: usize, row: &Row) -> String {
        let Row { position_m, grid, spacing_m, yaw_deg } = row;
        let Self { kind, triangles, colour, texture, .. } = self;
        let painted = texture.map_or(String::new(), |name| format!("\ntexture = \"{name}\""));
        format!(
            r##"
[[object]]
name = "{kind}-{number}"
model = "mesh"
generate = "{kind}"
triangles = {triangles}
position_m = {position_m:?}
rotation_deg = [0.0, 0.0, {yaw_deg:?}]
grid = {grid:?}
spacing_m = {spacing_m:?}
shading = "any"{painted}
colour = "{colour}"
"##
        )
    }
}

fn path() -> CameraPath {
    let stops = vec![stop(0.0, [-5.0, -0.5, 1.7], 0.0, -4.0), stop(6.0, [-4.5, 0.5, 1.7], 4.0, -4.0)];
    CameraPath { stops, fov_deg: 60.0 }
}
