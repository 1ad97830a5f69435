//! Visibility through portals against rays: no object that a ray reaches is missed.

use super::super::bounds_tree::Random;
use super::*;
use crate::states::scene_view::{Actor, Appearance, Form, Material, States, StaticObject};
use metachron_core::{RigidState, SimTime, Snapshot};
use metachron_geometry::{Obstacle, Portal, Solid};
use std::sync::Arc;

const SIZE: Size = Size { width: 160, height: 90 };
const BALLS: u32 = 300;

/// The cells and portals of a built-in scene.
fn cells_of(scene: &str) -> Cells {
    let file = format!("{}/../../scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(file).unwrap();
    let rooms = text.split("\n\n").filter(|table| table.starts_with("[[cell]]") || table.starts_with("[[portal]]"));
    let text = ["format = 1"].into_iter().chain(rooms).collect::<Vec<_>>().join("\n\n");
    let source = metachron_scene::Source::memory(scene, text.as_bytes()).unwrap();
    metachron_scene::load(&source, &[]).unwrap().cells
}

/// Five by five rooms of 4 × 4 × 3 m with triangular openings between some, and some to the outside.
fn maze(random: &mut Random) -> Cells {
    let at = |i: usize, j: usize| DVec3::new(4.0 * i as f64, 4.0 * j as f64, 0.0);
    let number = |i: usize, j: usize| 5 * i + j;
    let (mut cells, mut portals) = (Vec::new(), Vec::new());
    for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
        cells.push(Cell { low_m: at(i, j), high_m: at(i, j) + DVec3::new(4.0, 4.0, 3.0) });
        let beyond = |i: usize, j: usize| if i < 5 && j < 5 { Region::Cell(number(i, j)) } else { Region::Outside };
        for (along, next) in [(DVec3::Y, beyond(i + 1, j)), (DVec3::X, beyond(i, j + 1))] {
            let middle = at(i, j) + (DVec3::X + DVec3::Y) * 2.0 + (DVec3::X + DVec3::Y - along) * 2.0;
            let (left, right, up) = (1.8 * random.next(), 1.8 * random.next(), 0.5 + 2.0 * random.next());
            let corners_m = vec![middle - along * left, middle + along * right, middle + DVec3::Z * up];
            if random.next() < 0.7 {
                portals.push(Portal { corners_m, between: [Region::Cell(number(i, j)), next] });
            }
        }
    }
    Cells::new(cells, portals).unwrap()
}

/// Balls at random in and around the cells.
fn balls(cells: &Cells, random: &mut Random) -> (SceneView, Vec<(DVec3, f64)>) {
    let low = cells.all().iter().map(|cell| cell.low_m).reduce(DVec3::min).unwrap() - 2.0;
    let high = cells.all().iter().map(|cell| cell.high_m).reduce(DVec3::max).unwrap() + 2.0;
    let places: Vec<_> = (0..BALLS).map(|_| (low + (high - low) * random.point(), 0.1 + 0.9 * random.next())).collect();
    let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
    let actor = |(id, (_, radius_m)): (u32, &(DVec3, f64))| Actor {
        id: AgentId(id),
        form: Form::Solid(Solid::Ball { radius_m: *radius_m }),
        appearance,
    };
    let mut view = SceneView::new((0..).zip(&places).map(actor).collect(), vec![]);
    view.set_cells(cells.clone());
    for (id, (position, _)) in (0..).zip(&places) {
        let body = Body::Rigid(RigidState { position: *position, ..RigidState::default() });
        view.set_snapshot(AgentId(id), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
    }
    view.pose(SimTime::ZERO, States::Latest);
    (view, places)
}

/// Times at which a ray enters and leaves a box; `None` where it misses.
fn pass(cell: &Cell, eye: DVec3, ray: DVec3) -> Option<(f64, f64)> {
    let (a, b) = ((cell.low_m - eye) / ray, (cell.high_m - eye) / ray);
    let (enters, leaves) = (a.min(b).max_element(), a.max(b).min_element());
    (enters < leaves && leaves > 0.0).then_some((enters, leaves))
}

/// Whether a point in the plane of a portal is inside it, by the sum of angles around the point.
fn is_through(portal: &Portal, point: DVec3) -> bool {
    let plane = (portal.corners_m[1] - portal.corners_m[0]).cross(portal.corners_m[2] - portal.corners_m[0]);
    let arms: Vec<_> = portal.corners_m.iter().map(|corner| *corner - point).collect();
    let turn: f64 = (0..arms.len()).map(|k| arms[k].angle_between(arms[(k + 1) % arms.len()])).sum();
    (point - portal.corners_m[0]).dot(plane.normalize()).abs() < 1e-6 && (turn - std::f64::consts::TAU).abs() < 1e-6
}

/// How far a ray from the eye reaches before a wall.
fn reach_of(cells: &Cells, eye: DVec3, ray: DVec3) -> f64 {
    let inside = cells.all().iter().position(|cell| cell.holds(eye));
    let mut region = inside.map_or(Region::Outside, Region::Cell);
    let mut now = 0.0;
    loop {
        let (wall, cell) = match region {
            Region::Cell(cell) => (pass(&cells.all()[cell], eye, ray).map(|(_, leaves)| leaves), cell),
            Region::Outside => {
                let enters = |(number, cell)| pass(cell, eye, ray).map(|(enters, _)| (enters, number));
                let ahead =
                    cells.all().iter().enumerate().filter_map(enters).filter(|(enters, _)| *enters > now + 1e-9);
                let Some((enters, cell)) = ahead.min_by(|a, b| a.0.total_cmp(&b.0)) else { return f64::INFINITY };
                (Some(enters), cell)
            }
        };
        let Some(wall) = wall else { return now };
        let opens =
            |portal: &&Portal| portal.between.contains(&Region::Cell(cell)) && is_through(portal, eye + ray * wall);
        let Some(beyond) = cells.portals().iter().filter(opens).find_map(|portal| portal.beyond(region)) else {
            return wall;
        };
        (region, now) = (beyond, wall);
    }
}

/// The balls with a part in a region that the eye reaches, one by one; of balls that are outside alone the ones in
/// view.
fn in_reach(view: &SceneView) -> u64 {
    let outside = view.survey.reach.is_reached(Region::Outside);
    let is_in_reach = |seen: &&Visibility| {
        let (low, high) = (seen.centre_m - seen.radius_m, seen.centre_m + seen.radius_m);
        let is_in = |(cell, is_reached): (Cell, bool)| is_reached && cell.overlaps(low, high);
        match view.survey.cells.exposure(low, high) {
            Exposure::Outside => seen.visible,
            exposure => outside && exposure == Exposure::Partly || view.cells().any(is_in),
        }
    };
    view.seen().iter().filter(is_in_reach).count() as u64
}

#[test]
fn impostors_of_groups_are_not_counted_and_what_moves_is_counted_anew() {
    let cell = Cell { low_m: DVec3::ZERO, high_m: DVec3::splat(4.0) };
    let cells = Cells::new(
        vec![cell, Cell { low_m: cell.low_m + DVec3::X * 4.0, high_m: cell.high_m + DVec3::X * 4.0 }],
        vec![],
    );
    let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
    let ball = |id| Actor { id: AgentId(id), form: Form::Solid(Solid::Ball { radius_m: 0.1 }), appearance };
    let mut view = SceneView::new((0..4).map(ball).collect(), vec![]);
    view.set_cells(cells.unwrap());
    view.set_groups(&[vec![]]);
    let put = |view: &mut SceneView, id: u32, at: DVec3, steps: u64| {
        let body = Body::Rigid(RigidState { position: at, ..RigidState::default() });
        let time = SimTime::from_nanos(1_000_000 * steps);
        view.set_snapshot(AgentId(id), &Arc::new(Snapshot { time, steps, body, ..Snapshot::default() }), true);
        view.pose(time, States::Latest);
        view.survey(&Camera::looking(DVec3::new(0.5, 2.0, 2.0), DVec3::new(2.0, 2.0, 2.0), 0.8), SIZE);
        let VisibleCounts { potentially_visible, visible } = view.visible_counts();
        (potentially_visible, visible)
    };
    // in view, behind the eye, in the next room, and an impostor in view
    let places = [DVec3::new(2.0, 2.0, 2.0), DVec3::new(0.2, 2.0, 2.0), DVec3::new(6.0, 2.0, 2.0), DVec3::splat(2.0)];
    let all: Vec<_> = (0..4).map(|id| put(&mut view, id, places[id as usize], 1)).collect();
    assert_eq!(all[3], (2, 1));
    assert_eq!(put(&mut view, 2, DVec3::new(3.0, 2.0, 2.0), 2), (3, 2), "into the room of the eye");
    assert_eq!(put(&mut view, 0, DVec3::new(6.0, 2.0, 2.0), 3), (2, 1), "out of it");
}

#[test]
fn no_object_that_a_ray_sees_is_missed() {
    let mut random = Random(1993);
    for (name, views) in [("auditorium", 350), ("library", 300), ("maze", 350)] {
        let cells = if name == "maze" { maze(&mut random) } else { cells_of(name) };
        let (mut scene_view, balls) = balls(&cells, &mut random);
        let (mut in_frustum, mut found, mut hit) = (0, 0, 0);
        for _ in 0..views {
            // mostly within a cell, at times out of all
            let cell = cells.all()[(random.next() * cells.all().len() as f64) as usize];
            let eye = cell.low_m + (cell.high_m - cell.low_m) * (1.2 * random.point() - 0.1);
            let camera = Camera::looking(eye, eye + random.point() - 0.5, 0.9);
            scene_view.survey(&camera, SIZE);
            assert_eq!(scene_view.visible_counts().potentially_visible, in_reach(&scene_view), "{name} from {eye}");
            let frustum = camera.frustum(SIZE);
            let is_seen = |at: usize| scene_view.seen()[at].visible;
            in_frustum += balls.iter().filter(|(centre, radius_m)| frustum.sees(*centre, *radius_m)).count();
            found += (0..balls.len()).filter(|at| is_seen(*at)).count();
            for _ in 0..60 {
                let pixel = glam::DVec2::new(160.0 * random.next(), 90.0 * random.next());
                let ray = camera.ray(pixel, SIZE).direction;
                let most = reach_of(&cells, eye, ray);
                for (at, (centre, radius_m)) in balls.iter().enumerate() {
                    let (along, from) = ((*centre - eye).dot(ray), *centre - eye);
                    let inner = radius_m * radius_m - (from.length_squared() - along * along);
                    let touches = along - inner.max(0.0).sqrt();
                    let is_hit = inner > 0.0 && touches < most && touches * ray.dot(camera.forward()) > camera.near_m();
                    hit += usize::from(is_hit);
                    assert!(!is_hit || is_seen(at), "{name}: ball {at} at {centre} from {eye}");
                }
            }
        }
        assert!(hit > 1000 && found < in_frustum, "{name}: {hit} hits, {found} of {in_frustum} in the frustum");
        if name == "maze" {
            assert!(4 * found < 3 * in_frustum, "{found} of {in_frustum}: a maze hides more than a quarter");
        }
    }
}

#[test]
fn a_wall_on_a_side_of_a_cell_is_seen_from_both_sides() {
    let cell = Cell { low_m: DVec3::ZERO, high_m: DVec3::new(4.0, 4.0, 3.0) };
    let wall = |x: f64, half_m: DVec3| StaticObject {
        obstacle: Obstacle {
            position: DVec3::new(x, 2.0, 1.5),
            ..Obstacle::new("", Solid::Box { half_extents_m: half_m })
        },
        appearance: Appearance { colour: [200; 3], material: Material::Plastic },
        throws_shadow: false,
    };
    // one within the sides of the cell, and a shelf amid it that touches none of them
    let walls = vec![wall(0.05, DVec3::new(0.05, 2.0, 1.5)), wall(2.0, DVec3::new(0.05, 1.0, 1.0))];
    let mut scene_view = SceneView::new(vec![], walls);
    scene_view.set_cells(Cells::new(vec![cell], vec![]).unwrap());
    for (eye, seen) in [(DVec3::new(-3.0, 2.0, 1.5), [true, false]), (DVec3::new(3.5, 2.0, 1.5), [true, true])] {
        scene_view.survey(&Camera::looking(eye, DVec3::new(1.0, 2.0, 1.5), 0.9), SIZE);
        assert_eq!([0, 1].map(|at| scene_view.statics[at].seen), seen, "from {eye}");
    }
}

#[test]
fn counts_fall_from_potentially_visible_to_visible() {
    let cells = cells_of("auditorium");
    let (mut scene_view, _) = balls(&cells, &mut Random(3));
    let eye = cells.all()[1].low_m + 1.0;
    scene_view.survey(&Camera::looking(eye, eye + DVec3::new(0.3, 1.0, 0.1), 0.9), SIZE);
    let VisibleCounts { potentially_visible, visible } = scene_view.visible_counts();
    assert!(potentially_visible > visible && visible > 0, "{potentially_visible} {visible}");
    // turned to the wall, the eye reaches no other cell
    scene_view.survey(&Camera::looking(eye, eye - DVec3::Y, 0.9), SIZE);
    assert!(scene_view.visible_counts().potentially_visible < potentially_visible);
}
