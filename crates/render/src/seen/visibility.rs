//! Visibility, screen size and screen speed of every actor: the input of a policy that divides a budget.
//!
//! In: posed objects and a camera. Out: one [`Visibility`] per actor. Never here: levels.

use super::bounds_tree::{BoundingBox, BoundsTree};
use super::portals::{Bounded, Reach};
use super::view::{Camera, CameraMotion, Frustum, Size};
use crate::states::scene_view::{Bounds, Form, SceneView, StaticShape, Track};
use glam::DVec3;
use metachron_core::{AgentId, Body, CurveState};
use metachron_geometry::{Cell, Cells, Exposure, Region};

/// The view of an actor by the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visibility {
    /// The agent.
    pub id: AgentId,
    /// Whether any part of it may be in the picture.
    pub visible: bool,
    /// Covered area, pixels, ≥ 0, hidden parts included; at most the picture's.
    pub pixels: f64,
    /// Distance of its centre from the eye, metres.
    pub distance_m: f64,
    /// Speed across the picture, pixels per second, with the motion of the camera: the root mean square over its points.
    pub speed_px_s: f64,
    /// The same as a camera at rest sees it, per second of simulated time.
    pub own_speed_px_s: f64,
    /// Rest length and mean radius of a tube, metres.
    pub tube_m: Option<(f64, f64)>,
    /// Distance of its centre from the middle of the picture, as a fraction of half the diagonal.
    pub off_centre: f64,
    /// Depth of its centre along the view, metres; at least its radius, for what surrounds the eye is near.
    pub depth_m: f64,
    /// Centre of a bounding ball, metres.
    pub centre_m: DVec3,
    /// Radius of that ball, metres.
    pub radius_m: f64,
}

/// How many actors a view may show, without impostors, by tests of which the second is stricter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VisibleCounts {
    /// Objects with a part in a cell that the eye reaches through portals, or in no cell and in the frustum
    /// (eye-to-cell visibility).
    pub potentially_visible: u64,
    /// Objects in the part of the frustum that portals leave in their cells (eye-to-object visibility).
    pub visible: u64,
}

/// The visibility of all actors and static solids, and the structures by which it is found.
#[derive(Debug, Default)]
pub(crate) struct Survey {
    cells: Cells,
    /// Everything that can be drawn: actors, then static solids.
    items: Vec<Bounded>,
    tree: BoundsTree,
    reach: Reach,
    /// The items that the last camera may see, and the items with a part in a region that it reaches.
    in_sight: Vec<bool>,
    in_reach: Vec<bool>,
    /// The cells that it reaches.
    cells_reached: Vec<Cell>,
    counts: VisibleCounts,
}

impl Survey {
    /// Updates the bounds of the actors that were posed again.
    fn refit(&mut self, tracks: &[Track], statics: &[StaticShape]) {
        let Self { cells, items, tree, in_sight, in_reach, .. } = self;
        let count = tracks.len() + statics.len();
        if tree.len() != count {
            items.clear();
            items.extend(tracks.iter().map(|track| bounded(&track.bounds, cells)));
            items.extend(statics.iter().map(|prop| bounded(&prop.bounds(), cells)));
            tree.build(items.iter().map(|item| item.bounds));
            for found in [in_sight, in_reach] {
                found.clear();
                found.resize(count, false);
            }
            return;
        }
        for (at, track) in tracks.iter().enumerate().filter(|(_, track)| track.fresh) {
            items[at] = bounded(&track.bounds, cells);
            tree.set(at, items[at].bounds);
        }
    }

    /// Finds the items that the camera may see.
    fn look(&mut self, frustum: &Frustum) {
        let Self { cells, items, tree, reach, in_sight, in_reach, cells_reached, .. } = self;
        reach.find(cells, frustum);
        in_sight.fill(false);
        tree.find(|bounds| reach.may_show(bounds), |item| in_sight[item] = reach.sees(cells, &items[item]));
        let reached = cells.all().iter().enumerate().filter(|(number, _)| reach.is_reached(Region::Cell(*number)));
        cells_reached.clear();
        cells_reached.extend(reached.map(|(_, cell)| *cell));
        let outside = reach.is_reached(Region::Outside);
        for ((found, item), seen) in in_reach.iter_mut().zip(items.iter()).zip(in_sight.iter()) {
            *found = match item.exposure {
                Exposure::Outside => *seen,
                exposure => outside && exposure == Exposure::Partly,
            };
        }
        tree.find(
            |bounds| is_within(cells_reached, bounds),
            |item| in_reach[item] |= items[item].exposure != Exposure::Outside,
        );
    }

    /// Tests an item again that moved while the camera did not.
    fn look_at(&mut self, item: usize) {
        let Bounded { bounds, exposure, .. } = self.items[item];
        self.in_sight[item] = self.reach.sees(&self.cells, &self.items[item]);
        self.in_reach[item] = match exposure {
            Exposure::Outside => self.in_sight[item],
            Exposure::Partly if self.reach.is_reached(Region::Outside) => true,
            _ => is_within(&self.cells_reached, &bounds),
        };
    }
}

/// Whether a box has a part in any of these cells.
fn is_within(cells: &[Cell], bounds: &BoundingBox) -> bool {
    cells.iter().any(|cell| cell.overlaps(bounds.low, bounds.high))
}

/// The bounds by which an object is tested; one without a size is nowhere.
fn bounded(bounds: &Bounds, cells: &Cells) -> Bounded {
    let ball = (bounds.centre, bounds.radius_m);
    let bounds = BoundingBox::around(bounds.centre, bounds.half_m);
    Bounded { bounds, ball, exposure: cells.exposure(bounds.low, bounds.high) }
}

impl SceneView {
    /// Gives the scene its cells and portals: walls then hide the objects in cells.
    pub fn set_cells(&mut self, cells: Cells) {
        (self.survey, self.eye) = (Survey { cells, ..Survey::default() }, None);
    }

    /// Says how the camera moves from the next survey on; `None` if it rests.
    pub fn set_camera_motion(&mut self, motion: Option<CameraMotion>) {
        if motion != self.camera_motion {
            (self.camera_motion, self.eye) = (motion, None);
        }
    }

    /// Updates [`SceneView::seen`]: of the actors that are in view, that came out of it, or that were posed again
    /// ([`SceneView::updated`] lists the updated ones). The others keep their last visibility, of when they were in
    /// view. Stores the visibility for [`SceneView::compose`].
    pub fn survey(&mut self, camera: &Camera, size: Size) {
        let eye = Some((*camera, size));
        let moved = self.eye != eye;
        self.eye = eye;
        let frustum = camera.frustum(size);
        let sight = Sight { camera, size, motion: self.camera_motion.as_ref() };
        let is_first = self.found.len() != self.tracks.len();
        self.survey.refit(&self.tracks, &self.statics);
        if moved {
            self.survey.look(&frustum);
        }
        self.updated.clear();
        for (at, track) in self.tracks.iter_mut().enumerate() {
            if track.fresh && !moved {
                self.survey.look_at(at);
            }
            let in_sight = self.survey.in_sight[at];
            let is_new = track.fresh || is_first || moved && (track.seen || in_sight);
            if !is_new {
                continue;
            }
            let view = visibility_of(track, &sight, &frustum, in_sight);
            (track.seen, track.fresh) = (view.visible, false);
            if !track.seen {
                track.geomorph = None;
            }
            match self.found.get_mut(at) {
                Some(before) => *before = view,
                None => self.found.push(view),
            }
            self.updated.push(at);
        }
        for (prop, in_sight) in self.statics.iter_mut().zip(&self.survey.in_sight[self.tracks.len()..]) {
            prop.seen = *in_sight || prop.body.radius_m == 0.0;
        }
        self.count();
    }

    /// The cells, each with whether the eye of the last survey reaches it.
    pub fn cells(&self) -> impl Iterator<Item = (Cell, bool)> + '_ {
        let Survey { cells, reach, .. } = &self.survey;
        let cells = cells.all().iter().enumerate();
        cells.map(|(number, cell)| (*cell, reach.is_reached(Region::Cell(number))))
    }

    /// How many actors the last survey found.
    #[must_use]
    pub fn visible_counts(&self) -> VisibleCounts {
        self.survey.counts
    }

    fn count(&mut self) {
        let objects = self.tracks.len().saturating_sub(self.impostors);
        let mut counts = VisibleCounts::default();
        for (track, in_reach) in self.tracks[..objects].iter().zip(&self.survey.in_reach) {
            counts.visible += u64::from(track.seen);
            counts.potentially_visible += u64::from(*in_reach && !is_unseen(track));
        }
        self.survey.counts = counts;
    }

    /// The indices of the actors that the last [`SceneView::survey`] updated, ascending.
    #[must_use]
    pub fn updated(&self) -> &[usize] {
        &self.updated
    }

    /// Results of the last [`SceneView::survey`], one entry per actor in their order.
    #[must_use]
    pub fn seen(&self) -> &[Visibility] {
        &self.found
    }

    /// Centre and radius in metres of a bounding ball of one actor, or of all; `None` where nothing is drawn.
    #[must_use]
    pub fn bounds(&self, of: Option<AgentId>) -> Option<(DVec3, f64)> {
        let wanted = |track: &&Track| of.is_none_or(|id| track.actor.id == id) && track.bounds.radius_m > 0.0;
        let balls = || self.tracks.iter().filter(wanted).map(|track| (track.bounds.centre, track.bounds.radius_m));
        let count = balls().count();
        let centre = balls().map(|(centre, _)| centre).sum::<DVec3>() / count as f64;
        (count > 0).then(|| (centre, balls().map(|(c, r)| c.distance(centre) + r).fold(0.0, f64::max)))
    }
}

/// Whether an actor has nothing to draw.
fn is_unseen(track: &Track) -> bool {
    matches!(track.actor.form, Form::Unseen) || matches!(track.pose, Body::Nothing)
}

/// The camera of a survey.
struct Sight<'a> {
    camera: &'a Camera,
    size: Size,
    motion: Option<&'a CameraMotion>,
}

impl Sight<'_> {
    /// Speeds across the picture of points near `at` with these velocities, as a camera at rest and as this one sees them, pixels per second:
    /// root mean squares.
    fn speeds_px_s(&self, at: DVec3, velocities: &[DVec3]) -> (f64, f64) {
        let (camera, from_eye) = (self.camera, self.camera.seen(at));
        let scale = camera.pixels_per_metre((at - camera.eye()).dot(camera.forward()), self.size);
        // a point that comes nearer moves away from the middle of the picture; nothing is seen beyond its corners
        let corner = half_diagonal_px(self.size) / camera.pixels_per_metre(1.0, self.size);
        let beside = from_eye.truncate().clamp_length_max(corner * from_eye.z.max(camera.near_m()));
        let beside = beside / from_eye.z.max(camera.near_m());
        let drift = self.motion.map_or(DVec3::ZERO, |motion| motion.drift(at));
        let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
        let (mut own, mut apparent) = (0.0, 0.0);
        for v in velocities {
            own += (v - forward * v.dot(forward)).length_squared();
            let all = DVec3::new(v.dot(right), v.dot(up), v.dot(forward)) + drift;
            apparent += (all.truncate() - beside * all.z).length_squared();
        }
        let mean = |sum: f64| (sum / velocities.len().max(1) as f64).sqrt() * scale;
        (mean(own), mean(apparent))
    }
}

fn visibility_of(track: &Track, sight: &Sight<'_>, frustum: &Frustum, in_sight: bool) -> Visibility {
    let (bounds, &Sight { camera, size, .. }) = (track.bounds, sight);
    let visible = in_sight && !is_unseen(track) && !size.is_empty();
    let scale = camera.pixels_per_metre((bounds.centre - camera.eye()).dot(camera.forward()), size);
    let across = |v: DVec3| (v - camera.forward() * v.dot(camera.forward())).length_squared();
    let speeds = |velocities: &[DVec3]| sight.speeds_px_s(bounds.centre, velocities);
    let (area, (own_speed_px_s, speed_px_s), tube_m) = match &track.pose {
        Body::Curve(curve) if !visible => (0.0, (0.0, 0.0), tube_measures(curve)),
        Body::Curve(curve) => {
            (curve_pixels(curve, camera, size, frustum), speeds(&curve.velocities), tube_measures(curve))
        }
        Body::Rigid(rigid) => (track.body.mean_area_m2 * scale * scale, speeds(&[rigid.velocity]), None),
        Body::Tool(tool) => (track.body.mean_area_m2 * scale * scale, speeds(&[tool.velocity]), None),
        Body::Soft(soft) => {
            let half = bounds.half_m;
            // the mean side of its bounding box: more than a sheet covers, about as much as a ball covers
            let area = 4.0 / 3.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
            (area * scale * scale, speeds(&soft.velocities), None)
        }
        Body::Nothing => (0.0, (0.0, 0.0), None),
    };
    Visibility {
        id: track.actor.id,
        visible,
        pixels: if visible { area.clamp(0.0, size.pixels()) } else { 0.0 },
        distance_m: bounds.centre.distance(camera.eye()),
        speed_px_s,
        own_speed_px_s,
        tube_m,
        off_centre: across(bounds.centre - camera.eye()).sqrt() * scale / half_diagonal_px(size),
        depth_m: camera.seen(bounds.centre).z.max(bounds.radius_m),
        centre_m: bounds.centre,
        radius_m: bounds.radius_m,
    }
}

/// Half the diagonal of the picture, pixels, at least 1.
fn half_diagonal_px(size: Size) -> f64 {
    (0.5 * f64::from(size.width).hypot(f64::from(size.height))).max(1.0)
}

/// Area of a tube on the screen: the sum over segments of projected length times projected width.
fn curve_pixels(curve: &CurveState, camera: &Camera, size: Size, frustum: &Frustum) -> f64 {
    let (eye, forward, near_m) = (camera.eye(), camera.forward(), camera.near_m());
    // pixels per metre across the view at a depth of one metre
    let pixels_m = camera.pixels_per_metre(1.0, size);
    let segment = |i: usize| {
        let (a, b) = (curve.positions[i], curve.positions[i + 1]);
        let middle = 0.5 * (a + b) - eye;
        let depth = middle.dot(forward);
        let radius = curve.radii_m[i];
        if depth < near_m || !frustum.sees(middle + eye, radius) {
            return 0.0;
        }
        let (chord, sight) = (b - a, middle.normalize());
        let width = 2.0 * radius;
        let length = (chord - sight * chord.dot(sight)).length();
        let scale = pixels_m / depth;
        length * width * scale * scale
    };
    (0..curve.positions.len().saturating_sub(1)).map(segment).sum()
}

fn tube_measures(curve: &CurveState) -> Option<(f64, f64)> {
    let mean = curve.radii_m.iter().sum::<f64>() / curve.radii_m.len() as f64;
    curve.arc_m.last().map(|&length| (length, mean))
}

#[cfg(test)]
mod against_rays;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::states::scene_view::{Actor, Appearance, Material, States};
    use metachron_core::{RigidState, SimTime, Snapshot};
    use metachron_geometry::Solid;
    use std::sync::Arc;

    const SIZE: Size = Size { width: 800, height: 600 };

    fn scene_view(position: DVec3, velocity: DVec3) -> SceneView {
        let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
        let form = Form::Solid(Solid::Ball { radius_m: 0.1 });
        let mut scene_view = SceneView::new(vec![Actor { id: AgentId(0), form, appearance }], vec![]);
        let body = Body::Rigid(RigidState { position, velocity, ..RigidState::default() });
        scene_view.set_snapshot(AgentId(0), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
        scene_view.pose(SimTime::ZERO, States::Latest);
        scene_view
    }

    fn ball_at(position: DVec3, velocity: DVec3) -> Visibility {
        let mut scene_view = scene_view(position, velocity);
        scene_view.survey(&Camera::looking(DVec3::new(4.0, 0.0, 0.0), DVec3::ZERO, 0.8), SIZE);
        scene_view.seen()[0]
    }

    #[test]
    fn the_camera_s_motion_counts_as_the_projection_moves() {
        let dt = 1e-4;
        let place = |i: u32| {
            let number = |k: u32| f64::from((i * 7919 + k * 104_729) % 1000) / 1000.0 - 0.5;
            (DVec3::new(number(1), 2.0 * number(2), number(3)), DVec3::new(number(4), number(5), number(6)))
        };
        let camera = |eye: DVec3, look_at: DVec3| Camera::looking(eye, look_at, 0.8);
        for i in 0..40 {
            let ((at, velocity), (step, turn)) = (place(i), place(i + 100));
            let (eye, look_at) = (DVec3::new(4.0, 0.3, 0.5), DVec3::ZERO);
            let before = camera(eye - dt * 3.0 * step, look_at - dt * turn);
            let now = camera(eye, look_at);
            let (then_px, _) = before.project(at - dt * velocity, SIZE).unwrap();
            let (now_px, _) = now.project(at, SIZE).unwrap();
            let expected = (now_px - then_px).length() / dt;
            let mut scene_view = scene_view(at, velocity);
            scene_view.set_camera_motion(CameraMotion::between(before, now, dt));
            scene_view.survey(&now, SIZE);
            let seen = scene_view.seen()[0];
            assert!((seen.speed_px_s - expected).abs() < 1e-2 * expected, "{i}: {} {expected}", seen.speed_px_s);
            scene_view.set_camera_motion(None);
            scene_view.survey(&now, SIZE);
            let (still_px, _) = now.project(at - dt * velocity, SIZE).unwrap();
            let expected = (now_px - still_px).length() / dt;
            let speed = scene_view.seen()[0].speed_px_s;
            assert!((speed - expected).abs() < 1e-2 * expected, "{i}: at rest {speed} {expected}");
        }
    }

    #[test]
    fn a_resting_actor_is_posed_once_and_updated_when_the_camera_or_its_state_changes() {
        let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
        let form = Form::Solid(Solid::Ball { radius_m: 0.1 });
        let actor = |id| Actor { id: AgentId(id), form: form.clone(), appearance };
        let mut scene_view = SceneView::new((0..1010).map(actor).collect(), vec![]);
        let state = |id: u32, ms: u64| {
            let position = DVec3::new(f64::from(id), 1e-3 * ms as f64, 0.0);
            let body = Body::Rigid(RigidState { position, ..RigidState::default() });
            let time = SimTime::from_nanos(ms * 1_000_000);
            Arc::new(Snapshot { time, steps: ms / 10, body, ..Snapshot::default() })
        };
        let camera = |x: f64| Camera::looking(DVec3::new(x, -4.0, 0.0), DVec3::new(x, 0.0, 0.0), 0.8);
        let mut plain = SceneView::new((0..1010).map(actor).collect(), vec![]);
        (0..1010).for_each(|id| plain.set_snapshot(AgentId(id), &state(id, 0), true));
        plain.pose(SimTime::ZERO, States::Latest);
        // ten keep moving, a thousand have come to rest
        let mut frame = |ms: u64, news: &[u32], x: f64| {
            (0..10).for_each(|id| scene_view.set_snapshot(AgentId(id), &state(id, ms), true));
            news.iter().for_each(|id| scene_view.set_snapshot(AgentId(*id), &state(*id, ms), false));
            let posed = scene_view.pose(SimTime::from_nanos(ms * 1_000_000), States::Interpolate);
            scene_view.survey(&camera(x), SIZE);
            let looks = scene_view.updated().len();
            plain.survey(&camera(x), SIZE);
            let same = |(a, b): (&Visibility, &Visibility)| a.id.0 < 10 || a.id.0 == 700 || a == b;
            assert!(scene_view.seen().len() == 1010 && scene_view.seen().iter().zip(plain.seen()).all(same));
            (posed, looks, (1e3 * scene_view.seen()[700].centre_m.y).round())
        };
        let all: Vec<u32> = (10..1010).collect();
        assert_eq!(frame(0, &all, 0.0), (1010, 1010, 0.0));
        assert_eq!(frame(10, &[], 0.0), (10, 10, 0.0));
        assert_eq!(frame(20, &[], 0.0), (10, 10, 0.0));
        // the ten, and of the others the five that came into view; three of the ten went out of it
        assert_eq!(frame(30, &[], 500.0), (10, 15, 0.0), "another camera");
        assert_eq!(frame(40, &[], 500.0), (10, 10, 0.0));
        // speed after five steps of 10 ms; a frame shows one step less
        assert_eq!(frame(50, &[700], 500.0), (11, 11, 40.0));
        assert_eq!(frame(60, &[], 500.0), (11, 11, 50.0));
        assert_eq!(frame(70, &[], 500.0), (10, 10, 50.0));
    }

    #[test]
    fn a_ball_covers_the_circle_it_projects_to() {
        let near = ball_at(DVec3::ZERO, DVec3::ZERO);
        let radius_px = 0.1 * 600.0 / (2.0 * 0.4_f64.tan() * 4.0);
        assert!((near.pixels / (std::f64::consts::PI * radius_px * radius_px) - 1.0).abs() < 1e-12);
        let far = ball_at(DVec3::new(-4.0, 0.0, 0.0), DVec3::ZERO);
        assert!((near.pixels / far.pixels - 4.0).abs() < 1e-9);
    }

    #[test]
    fn speed_counts_across_the_view_only() {
        let scale = 600.0 / (2.0 * 0.4_f64.tan() * 4.0);
        assert!((ball_at(DVec3::ZERO, DVec3::Y).speed_px_s - scale).abs() < 1e-9);
        assert!(ball_at(DVec3::ZERO, DVec3::X).speed_px_s < 1e-9);
    }

    #[test]
    fn the_corner_of_the_picture_is_one_away_from_its_middle() {
        let scale = 600.0 / (2.0 * 0.4_f64.tan() * 4.0);
        let corner = ball_at(DVec3::new(0.0, 400.0 / scale, 300.0 / scale), DVec3::ZERO);
        assert!((corner.off_centre - 1.0).abs() < 1e-9 && (corner.depth_m - 4.0).abs() < 1e-9);
        assert!((corner.distance_m - 4.0_f64.hypot(500.0 / scale)).abs() < 1e-9);
        assert!(ball_at(DVec3::ZERO, DVec3::ZERO).off_centre < 1e-9);
    }

    #[test]
    fn an_actor_out_of_view_covers_no_pixels() {
        let behind = ball_at(DVec3::new(9.0, 0.0, 0.0), DVec3::ZERO);
        assert!(!behind.visible && behind.pixels == 0.0);
    }
}
