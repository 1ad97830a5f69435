//! Which regions of a building the eye reaches through its portals, and the part of the view that remains in each.
//!
//! In: cells with portals, a view. Out: views clipped by the portals on the way, by which objects are tested. Never here: objects.
//! Theory: (TS91), (FS93, §2.1): eye-to-cell visibility; the part of a cell within its clipped view is the
//! eye-to-object visibility. All tests err to the side of visible: a wall hides, an object never does.

use super::bounds_tree::BoundingBox;
use super::view::Frustum;
use glam::DVec3;
use metachron_geometry::{Cells, Exposure, Portal, Region};

/// An eye nearer than this to the plane of a portal is in it, metres.
const IN_PLANE_M: f64 = 1e-6;

/// Least sine of the angle under which an edge of an opening is seen, or the opening from an edge, that it bounds a
/// view: rounding turns the plane through a shorter edge, by up to a billionth at this length, and then hides visible
/// objects.
const EDGE_MIN: f64 = 1e-6;

/// Most clipped views of one eye: the ways through a maze of rooms grow without end. Past it every region is reached with the whole view.
const VIEWS_MAX: usize = 4096;

/// Some of the planes of a [`Reach`]: the first, and how many.
type Planes = (u32, u32);

/// The sides of the picture.
const WHOLE: Planes = (0, 4);

/// The bounds by which an object is tested.
#[derive(Debug, Clone, Copy)]
pub struct Bounded {
    /// Its bounding box.
    pub bounds: BoundingBox,
    /// Centre and radius of its bounding ball, metres.
    pub ball: (DVec3, f64),
    /// Where that box is among the cells.
    pub exposure: Exposure,
}

/// A region and one of the views that reach it.
#[derive(Debug, Clone, Copy)]
struct ClippedView {
    region: Region,
    planes: Planes,
}

/// The views of one eye into every region that it reaches.
#[derive(Debug, Default)]
pub struct Reach {
    eye: DVec3,
    forward: DVec3,
    near_m: f64,
    views: Vec<ClippedView>,
    /// Unit normals, inwards, of planes through the eye. The first four are the sides of the picture.
    planes: Vec<DVec3>,
    /// The portals on the way to the view that is being followed.
    way: Vec<usize>,
    polygon: Vec<DVec3>,
    clipped: Vec<DVec3>,
}

impl Reach {
    /// Follows the view through the portals of `cells`.
    pub fn find(&mut self, cells: &Cells, frustum: &Frustum) {
        self.eye = frustum.eye();
        (self.forward, self.near_m) = frustum.near();
        self.views.clear();
        self.planes.clear();
        self.planes.extend(frustum.sides());
        // an eye on the side between two cells is in both
        for (number, _) in cells.all().iter().enumerate().filter(|(_, cell)| cell.holds(frustum.eye())) {
            self.follow(cells, ClippedView { region: Region::Cell(number), planes: WHOLE });
        }
        if self.views.is_empty() {
            self.follow(cells, ClippedView { region: Region::Outside, planes: WHOLE });
        }
        if self.views.len() > VIEWS_MAX {
            self.views.clear();
            let all = (0..cells.all().len()).map(Region::Cell).chain([Region::Outside]);
            self.views.extend(all.map(|region| ClippedView { region, planes: WHOLE }));
        }
    }

    /// Enters a region, and follows the view through its portals. No way leads through a portal twice: a line of sight cannot.
    fn follow(&mut self, cells: &Cells, view: ClippedView) {
        self.views.push(view);
        for (number, portal) in cells.portals().iter().enumerate() {
            if self.views.len() > VIEWS_MAX {
                return;
            }
            let Some(beyond) = portal.beyond(view.region).filter(|_| !self.way.contains(&number)) else { continue };
            if let Some(planes) = self.pass(portal, view, cells) {
                self.way.push(number);
                self.follow(cells, ClippedView { region: beyond, planes });
                self.way.pop();
            }
        }
    }

    /// The planes of a view beyond a portal; `None` where nothing of it is seen, or from behind.
    fn pass(&mut self, portal: &Portal, view: ClippedView, cells: &Cells) -> Option<Planes> {
        let distance_m = distance_from_behind(portal, view.region, cells, self.eye);
        if distance_m < -IN_PLANE_M {
            return None;
        }
        if distance_m < IN_PLANE_M {
            // in the opening itself the eye sees whatever is beyond; beside it nothing
            return encloses(portal, self.eye).then_some(view.planes);
        }
        self.polygon.clear();
        self.polygon.extend(portal.corners_m.iter().map(|corner| *corner - self.eye));
        let (first, count) = (view.planes.0 as usize, view.planes.1 as usize);
        for plane in &self.planes[first..first + count] {
            clip(&self.polygon, *plane, &mut self.clipped);
            std::mem::swap(&mut self.polygon, &mut self.clipped);
        }
        if self.polygon.len() < 3 {
            return None;
        }
        Some(self.planes_through(view))
    }

    /// The planes through the eye and the edges of the clipped opening; the planes of the view before it where too few
    /// are certain.
    fn planes_through(&mut self, view: ClippedView) -> Planes {
        let middle: DVec3 = self.polygon.iter().sum();
        let first = self.planes.len();
        for (k, &corner) in self.polygon.iter().enumerate() {
            let next = self.polygon[(k + 1) % self.polygon.len()];
            let normal = corner.cross(next);
            let edge = normal.length();
            let inwards = normal.dot(middle);
            // also where it is not a number
            let bounds =
                edge > EDGE_MIN * corner.length() * next.length() && inwards.abs() > EDGE_MIN * edge * middle.length();
            if bounds {
                self.planes.push(normal * (inwards.signum() / edge));
            }
        }
        let count = self.planes.len() - first;
        if count < 3 {
            self.planes.truncate(first);
            return view.planes;
        }
        (first as u32, count as u32)
    }

    /// Whether any view reaches a region.
    pub fn is_reached(&self, region: Region) -> bool {
        self.views.iter().any(|view| view.region == region)
    }

    /// Whether an object may be seen: by a view of a region that it has a part in. One that is in no cell is seen through walls.
    pub fn sees(&self, cells: &Cells, object: &Bounded) -> bool {
        match object.exposure {
            Exposure::Outside => self.is_in_view(object, WHOLE),
            exposure => self.views.iter().any(|view| {
                let has_part = match view.region {
                    Region::Outside => exposure == Exposure::Partly,
                    Region::Cell(cell) => cells.all()[cell].overlaps(object.bounds.low, object.bounds.high),
                };
                has_part && self.is_in_view(object, view.planes)
            }),
        }
    }

    /// Whether a box may be in the picture where nothing hides it.
    pub fn may_show(&self, bounds: &BoundingBox) -> bool {
        let furthest = |normal: DVec3| {
            let corner = DVec3::select(normal.cmpgt(DVec3::ZERO), bounds.high, bounds.low);
            // of a box without end this is no number, which is not below anything
            (corner - self.eye).dot(normal)
        };
        let beside = self.planes_of(WHOLE).iter().any(|plane| furthest(*plane) < 0.0);
        let is_near = furthest(self.forward) <= self.near_m;
        !beside && !is_near
    }

    fn is_in_view(&self, object: &Bounded, planes: Planes) -> bool {
        let (centre, radius_m) = object.ball;
        let from_eye = centre - self.eye;
        let half = 0.5 * (object.bounds.high - object.bounds.low);
        // of its ball and its box the one that reaches less far
        let reach = |normal: DVec3| from_eye.dot(normal) + radius_m.min(normal.abs().dot(half));
        reach(self.forward) > self.near_m && !self.planes_of(planes).iter().any(|plane| reach(*plane) < 0.0)
    }

    fn planes_of(&self, planes: Planes) -> &[DVec3] {
        let (first, count) = planes;
        &self.planes[first as usize..(first + count) as usize]
    }
}

/// How far the eye is on the side of a portal that `from` is on, metres; below 0 on the other.
fn distance_from_behind(portal: &Portal, from: Region, cells: &Cells, eye: DVec3) -> f64 {
    // a portal is on a side of a cell: of the one on this side, or else of the one beyond
    let named = |region: Region| match region {
        Region::Cell(cell) => cells.side(cell, portal).map(|side| (cell, side)),
        Region::Outside => None,
    };
    let inwards = |(cell, side): (usize, metachron_geometry::Side)| {
        let from_side = eye[side.axis] - cells.all()[cell].side_m(side);
        if side.upper { -from_side } else { from_side }
    };
    match named(from) {
        Some(here) => inwards(here),
        None => portal.beyond(from).and_then(named).map_or(f64::NEG_INFINITY, |there| -inwards(there)),
    }
}

/// Whether a point in the plane of a portal is in it or at its rim.
fn encloses(portal: &Portal, point: DVec3) -> bool {
    let corners = &portal.corners_m;
    let next = |k: usize| corners[(k + 1) % corners.len()];
    let normal: DVec3 = (0..corners.len()).map(|k| corners[k].cross(next(k))).sum();
    let Some(normal) = normal.try_normalize() else { return false };
    let inside = |k: usize| (next(k) - corners[k]).normalize_or_zero().cross(point - corners[k]).dot(normal);
    (0..corners.len()).all(|k| inside(k) >= -IN_PLANE_M)
}

/// The part of a polygon on the inner side of a plane through the origin (Sutherland and Hodgman).
fn clip(polygon: &[DVec3], plane: DVec3, into: &mut Vec<DVec3>) {
    into.clear();
    for (k, corner) in polygon.iter().enumerate() {
        let next = polygon[(k + 1) % polygon.len()];
        let (here, there) = (corner.dot(plane), next.dot(plane));
        if here >= 0.0 {
            into.push(*corner);
        }
        if (here >= 0.0) != (there >= 0.0) {
            into.push(*corner + (next - *corner) * (here / (here - there)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bounds_tree::Random;
    use super::*;

    #[test]
    fn no_length_of_an_edge_hides_what_is_seen_through_the_opening() {
        let mut random = Random(1991);
        for at in 0..4000 {
            let eye = DVec3::new(-4.0, -2.0, -2.0) + DVec3::new(3.5, 4.0, 4.0) * random.point();
            // an opening of 1 m² of which a view has cut a corner off, by an edge of 1e-16 to 1e-4 m
            let cut = 10.0_f64.powi(-4 - at % 13);
            let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5 - cut), (0.5 - cut, 0.5), (-0.5, 0.5)];
            let polygon = corners.iter().map(|(y, z)| DVec3::new(0.0, *y, *z) - eye).collect();
            let mut reach = Reach { polygon, ..Reach::default() };
            let planes = reach.planes_through(ClippedView { region: Region::Outside, planes: WHOLE });
            assert!(planes.1 >= 4, "four edges are long: {planes:?}");
            let through = (DVec3::new(0.0, -0.499, -0.499) + DVec3::new(0.0, 0.998, 0.998) * random.point()) - eye;
            let hides = reach.planes_of(planes).iter().find(|plane| through.dot(**plane) < 0.0);
            assert_eq!(hides, None, "{through} from {eye}, an edge of {cut} m");
            let beside = DVec3::new(0.0, 0.501, random.next() - 0.5) - eye;
            assert!(reach.planes_of(planes).iter().any(|plane| beside.dot(*plane) < 0.0), "{beside} from {eye}");
        }
    }
}
