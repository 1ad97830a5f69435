//! Reads cells and portals, and builds the walls of cells.
//!
//! In: `[[cell]]` and `[[portal]]` tables. Out: checked [`Cells`], walls as fixed boxes. Never here: a view.

use super::common::parse_colour;
use super::objects::{OBSTACLES_MAX, Objects, too_many};
use crate::check::{Checker, Place};
use crate::format::{CellFile, PortalFile};
use glam::{DQuat, DVec3};
use metachron_geometry::{Cell, Cells, CellsError, ContactTraits, Obstacle, Portal, Region, Side, Solid};
use metachron_world::Appearance;
use metachron_world::kinds::{Material, ShadingKind};

/// Longest name of a cell, in characters.
const NAME_MAX: usize = 64;
/// The region outside all cells, in `between`.
const OUTSIDE: &str = "outside";
/// Default colour of walls: a warm white.
const WALL_COLOUR: [u8; 3] = [0xd8, 0xd2, 0xc4];
/// Friction and restitution of walls.
const WALL_SURFACE: (f64, f64) = (0.5, 0.0);

/// Reads cells and portals, and adds the walls of the cells to the fixed objects.
pub(crate) fn cells(
    c: &mut Checker<'_, '_>,
    cells: &[CellFile],
    portals: &[PortalFile],
    objects: &mut Objects,
) -> Cells {
    let before = c.count();
    let boxes: Vec<_> = cells.iter().enumerate().map(|(at, file)| cell(c, at, file, &cells[..at])).collect();
    let openings: Vec<_> = portals.iter().enumerate().filter_map(|(at, file)| portal(c, at, file, cells)).collect();
    if c.count() > before {
        return Cells::default();
    }
    match Cells::new(boxes, openings) {
        Ok(found) => {
            build_walls(c, cells, &found, objects);
            found
        }
        Err(faults) => {
            faults.iter().for_each(|fault| report(c, fault, cells, portals));
            Cells::default()
        }
    }
}

fn cell(c: &mut Checker<'_, '_>, at: usize, file: &CellFile, earlier: &[CellFile]) -> Cell {
    let place = c.place(&format!("cell.{at}"));
    let length = file.name.chars().count();
    if file.name.trim().is_empty() || length > NAME_MAX || file.name.chars().any(char::is_control) {
        let expected = format!("expected 1 to {NAME_MAX} printable characters");
        c.wrong(&place.unnamed(), "name", "is not a valid name", expected);
    } else if file.name == OUTSIDE {
        let what = format_args!("is `{OUTSIDE}`, the name of what is in no cell");
        c.wrong(&place, "name", what, "expected another name");
    } else if earlier.iter().any(|other| other.name == file.name) {
        c.wrong(&place, "name", format_args!("is `{}`, the name of another cell", file.name), "expected a unique name");
    }
    let (low_m, high_m) = (DVec3::from(file.from_m), DVec3::from(file.to_m));
    let least = (high_m - low_m).min_element();
    if let Some(thickness) = file.walls_m.filter(|thickness| least > 0.0 && 2.0 * thickness >= least) {
        let expected = format!("expected less than {}, half the least side of the cell", 0.5 * least);
        c.wrong(&place, "walls_m", format_args!("is {thickness}: nothing is left between the walls"), expected);
    }
    if file.walls_m.is_none() {
        let keys = ["without", "colour", "material"];
        c.refuse(&place, &keys, "has no effect alone", "expected `walls_m` beside it");
    }
    if let Some(text) = file.colour.as_ref().filter(|text| parse_colour(text).is_none()) {
        c.wrong(&place, "colour", format_args!("is `{text}`"), "expected `#rrggbb`, such as `#c9776b`");
    }
    Cell { low_m, high_m }
}

fn portal(c: &mut Checker<'_, '_>, at: usize, file: &PortalFile, cells: &[CellFile]) -> Option<Portal> {
    let place = c.place(&format!("portal.{at}"));
    let known = || cells.iter().map(|cell| cell.name.as_str()).chain([OUTSIDE]);
    let mut region = |k: usize| {
        let name = &file.between[k];
        if name == OUTSIDE {
            return Some(Region::Outside);
        }
        c.reference(&place, &format!("between.{k}"), name, known());
        cells.iter().position(|cell| cell.name == *name).map(Region::Cell)
    };
    let between = (region(0), region(1));
    let corners_m = corners(c, &place, file)?;
    Some(Portal { corners_m, between: [between.0?, between.1?] })
}

fn corners(c: &mut Checker<'_, '_>, place: &Place, file: &PortalFile) -> Option<Vec<DVec3>> {
    let rectangle = "expected `from_m` and `to_m`, or `corners_m`";
    match (&file.corners_m, file.from_m, file.to_m) {
        (Some(corners), None, None) => Some(corners.iter().map(|at| DVec3::from(*at)).collect()),
        (None, Some(from), Some(to)) => {
            let (from, to) = (DVec3::from(from), DVec3::from(to));
            let across = (0..3).find(|axis| from[*axis] == to[*axis]);
            let Some(across) = across else {
                let expected = "expected one coordinate as in `from_m`: a portal is flat";
                c.wrong(place, "to_m", "shares no coordinate with `from_m`", expected);
                return None;
            };
            let (u, v) = ((across + 1) % 3, (across + 2) % 3);
            let corner = |along_u: DVec3, along_v: DVec3| {
                let mut at = from;
                (at[u], at[v]) = (along_u[u], along_v[v]);
                at
            };
            Some(vec![from, corner(to, from), to, corner(from, to)])
        }
        (Some(_), ..) => {
            c.wrong(place, "corners_m", "contradicts `from_m` and `to_m`", rectangle);
            None
        }
        _ => {
            c.wrong(place, "between", "has no opening", rectangle);
            None
        }
    }
}

/// Reports a fault at the cell or portal that has it.
fn report(c: &mut Checker<'_, '_>, fault: &CellsError, cells: &[CellFile], portals: &[PortalFile]) {
    let cell_place = |c: &Checker<'_, '_>, at: usize| c.place(&format!("cell.{at}"));
    let portal_place = |c: &Checker<'_, '_>, at: usize| c.place(&format!("portal.{at}"));
    let corner_key = |portal: usize| if portals[portal].corners_m.is_some() { "corners_m" } else { "from_m" };
    let name = |cell: usize| cells.get(cell).map_or("", |cell| cell.name.as_str());
    match *fault {
        CellsError::Flat { cell } => {
            let expected = "expected each coordinate above that of `from_m`";
            c.wrong(&cell_place(c, cell), "to_m", "leaves the cell no volume", expected);
        }
        CellsError::Overlap { cell, with } => {
            let what = format_args!("is within cell `{}`, or the cell reaches into it", name(with));
            c.wrong(&cell_place(c, cell), "from_m", what, "expected cells that touch at most");
        }
        CellsError::Nowhere { portal } => {
            c.wrong(
                &portal_place(c, portal),
                "between",
                "names one cell twice",
                "expected two cells, or one and `outside`",
            );
        }
        CellsError::Unknown { portal, .. } => {
            c.wrong(&portal_place(c, portal), "between", "names a cell that does not exist", "expected names of cells");
        }
        CellsError::NotConvex { portal } => {
            let expected = "expected the corners of a convex polygon in their order around it";
            c.wrong(&portal_place(c, portal), corner_key(portal), "is not a convex polygon", expected);
        }
        CellsError::Off { portal, cell } => {
            let what = format_args!("is not on a side of cell `{}` that faces the other one", name(cell));
            let expected = "expected all corners on a side that both cells share";
            c.wrong(&portal_place(c, portal), corner_key(portal), what, expected);
        }
        CellsError::Inside { portal, cell } => {
            let what = format_args!("names `{OUTSIDE}`, but cell `{}` is behind the portal", name(cell));
            c.wrong(&portal_place(c, portal), "between", what, format!("expected `{}` in its place", name(cell)));
        }
    }
}

/// Adds the walls of all cells that have some to the fixed objects.
fn build_walls(c: &mut Checker<'_, '_>, files: &[CellFile], cells: &Cells, objects: &mut Objects) {
    let mut obstacles: Vec<Obstacle> = objects.obstacles.to_vec();
    for (number, file) in files.iter().enumerate() {
        let Some(thickness_m) = file.walls_m else { continue };
        let is_open = |side: &Side| file.without.iter().any(|kind| Side::ALL[*kind as usize] == *side);
        let sides: Vec<_> = Side::ALL.into_iter().filter(|side| !is_open(side)).collect();
        check_openings(c, number, cells, &sides);
        let appearance = Appearance {
            colour: file.colour.as_deref().and_then(parse_colour).unwrap_or(WALL_COLOUR),
            material: file.material.unwrap_or(Material::Plastic),
            importance: 1.0,
            may_vanish: None,
            shading: ShadingKind::default(),
        };
        for (low, high) in cells.walls(number, &sides, thickness_m) {
            let half_extents_m = 0.5 * (high - low);
            obstacles.push(Obstacle {
                name: format!("{}.walls", file.name),
                solid: Solid::Box { half_extents_m },
                position: 0.5 * (low + high),
                rotation: DQuat::IDENTITY,
                friction: WALL_SURFACE.0,
                restitution: WALL_SURFACE.1,
                traits: ContactTraits::default(),
            });
            objects.obstacle_appearances.push(appearance);
        }
    }
    if obstacles.len() > OBSTACLES_MAX {
        let found = format!("{} fixed objects, walls of cells among them", obstacles.len());
        too_many(c, "cell", &found, OBSTACLES_MAX);
    }
    objects.obstacles = obstacles.into();
}

/// Reports portals through walls that are not rectangles along the axes: a wall would leave more of them open than is looked through.
fn check_openings(c: &mut Checker<'_, '_>, cell: usize, cells: &Cells, walls: &[Side]) {
    for (number, portal) in cells.portals().iter().enumerate() {
        let is_of = portal.between.contains(&Region::Cell(cell));
        if is_of && cells.side(cell, portal).is_some_and(|side| walls.contains(&side)) && !portal.is_rectangle() {
            let expected = "expected `from_m` and `to_m`, or cells without `walls_m` on this side";
            c.wrong(
                &c.place(&format!("portal.{number}")),
                "corners_m",
                "is not a rectangle along the axes, in a wall",
                expected,
            );
        }
    }
}
