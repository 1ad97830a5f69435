//! `[[cell]]` and `[[portal]]`: the rooms of a building and the openings between them.

use super::Point;
use metachron_world::kinds::Material;
use schemars::JsonSchema;
use serde::Deserialize;

/// A room: a box along the axes, whose sides hide everything beyond them but for portals. Cells do not overlap.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellFile {
    /// The cell's name: unique among cells, and not `outside`.
    #[schemars(length(min = 1, max = 64))]
    pub name: String,
    /// Its lower corner, metres.
    pub from_m: Point,
    /// Its upper corner, metres: each coordinate above that of `from_m`.
    pub to_m: Point,
    /// Thickness of walls that are built on its sides, within it, metres: fixed boxes, with the portals left open. A portal
    /// through them is a rectangle along the axes. Default: no walls, for sides that objects of the scene stand for.
    pub walls_m: Option<f64>,
    /// Sides without a wall. Default none.
    #[serde(default)]
    pub without: Vec<SideKind>,
    /// Colour of the walls as `#rrggbb` (sRGB). Default: a warm white.
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"))]
    pub colour: Option<String>,
    /// Material of the walls. Default `plastic`.
    pub material: Option<Material>,
}

/// An opening between two cells, or between a cell and the outside: a flat convex polygon on a side of each.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PortalFile {
    /// The two cells that it is between, of which one may be `outside`.
    pub between: [String; 2],
    /// Corner of a rectangle along the axes, metres; with `to_m`.
    pub from_m: Option<Point>,
    /// The opposite corner, metres: one coordinate is that of `from_m`.
    pub to_m: Option<Point>,
    /// Corners of a polygon in their order around it, metres, 3 … 100; instead of `from_m` and `to_m`.
    #[schemars(length(min = 3, max = 100))]
    pub corners_m: Option<Vec<Point>>,
}

// in the order of `metachron_geometry::Side::ALL`
/// A side of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SideKind {
    /// The lower one along x.
    West,
    /// The upper one along x.
    East,
    /// The lower one along y.
    South,
    /// The upper one along y.
    North,
    /// The lower one along z.
    Floor,
    /// The upper one along z.
    Ceiling,
}
