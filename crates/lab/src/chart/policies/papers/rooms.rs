//! The eye's view of a building from above: rooms that it reaches through portals, and the objects that remain in view (FS93, §2.1).
//!
//! In: the built-in scene `auditorium` at three places of its walk. Out: counts, and a plan for each place. Never here: a policy.

use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Mark, Measured, Named, Panel, Table, claims, number_of, table,
};
use glam::DVec3;
use metachron_geometry::Cell;
use metachron_render::{Size, VisibleCounts};
use metachron_scene::papers::{Choices, Paper};
use metachron_scene::{Source, load};
use metachron_session::Session;
use metachron_world::Pace;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct Rooms;

/// Places of the walk and their times, seconds: the viewpoints of (FS93, §8).
const PLACES: [Named<f64>; 3] =
    [Named("A, seats across the view", 4.0), Named("B, from the foyer", 13.0), Named("C, after the turn", 18.4)];
const SIZE: Size = Size { width: 1280, height: 720 };

/// A place.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    place: Named<f64>,
}

/// The counts at a place.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// All objects of the scene.
    objects: u64,
    /// Objects in the frustum, as if nothing hid them.
    in_frustum: u64,
    potentially_visible: u64,
    visible: u64,
}

/// One object in a plan.
struct Spot {
    at_m: DVec3,
    in_frustum: bool,
    visible: bool,
}

/// The view from a place.
struct Plan {
    eye_m: DVec3,
    /// Ends of the borders of the view, on the ground.
    borders_m: [DVec3; 2],
    cells: Vec<(Cell, bool)>,
    spots: Vec<Spot>,
    counts: VisibleCounts,
}

/// The session of the scene; `None` where it cannot be opened, which is a fault of the program.
fn auditorium() -> Option<Session> {
    let text = Paper::Auditorium.text(&Choices::default());
    let source = Source::memory("auditorium", text.as_bytes()).ok()?;
    let lockstep = ("executor".to_owned(), "lockstep".to_owned());
    Session::open(load(&source, &[lockstep]).ok()?, Pace::RealTime).ok()
}

/// Looks from the scene's camera at a time.
fn plan(session: &mut Session, at_s: f64) -> Plan {
    let camera = session.camera_at(at_s);
    session.survey(&camera, SIZE);
    let (view, frustum) = (session.scene_view(), camera.frustum(SIZE));
    let border = |x: f64| {
        let ray = camera.ray(glam::DVec2::new(x * f64::from(SIZE.width), 0.5 * f64::from(SIZE.height)), SIZE);
        camera.eye() + ray.direction * 40.0
    };
    let spot = |seen: &metachron_render::Visibility| Spot {
        at_m: seen.centre_m,
        in_frustum: frustum.sees(seen.centre_m, seen.radius_m),
        visible: seen.visible,
    };
    Plan {
        eye_m: camera.eye(),
        borders_m: [border(0.0), border(1.0)],
        cells: view.cells().collect(),
        spots: view.seen().iter().map(spot).collect(),
        counts: view.visible_counts(),
    }
}

impl Plan {
    /// The plan from above.
    fn panel(&self, title: &str) -> Panel {
        let flat = |at: DVec3| (at.x, at.y);
        let layer = |label: &str, colour, mark| Layer { label: label.to_owned(), colour, mark };
        let rooms = |reached: bool| {
            let outline = |cell: &Cell| [cell.low_m.x, cell.high_m.x, cell.low_m.y, cell.high_m.y];
            Mark::Cells(self.cells.iter().filter(|(_, is)| *is == reached).map(|(cell, _)| outline(cell)).collect())
        };
        let spots = |of: fn(&Spot) -> bool| {
            Mark::Dots(self.spots.iter().filter(|spot| of(spot)).map(|spot| flat(spot.at_m)).collect())
        };
        let border = |end: DVec3| Mark::Dashed(vec![flat(self.eye_m), flat(end)]);
        let layers = vec![
            layer("room reached", Colour::Sky, rooms(true)),
            layer("room not reached", Colour::Grey, rooms(false)),
            layer("out of view", Colour::Grey, spots(|spot| !spot.in_frustum)),
            layer("hidden by walls", Colour::Orange, spots(|spot| spot.in_frustum && !spot.visible)),
            layer("visible", Colour::Blue, spots(|spot| spot.visible)),
            layer("eye", Colour::Red, Mark::Dots(vec![flat(self.eye_m)])),
            layer("", Colour::Red, border(self.borders_m[0])),
            layer("", Colour::Red, border(self.borders_m[1])),
        ];
        let (x, y) = (Axis::linear("x, m", -20.0, 22.0), Axis::linear("y, m", -20.0, 12.0));
        Panel::new(title, x, y, layers)
    }
}

type Row = Measured<Case, Found>;

impl Experiment for Rooms {
    type Row = Row;
    const NAME: &'static str = "rooms";
    const TITLE: &'static str = "the auditorium from above: rooms that the eye reaches and objects that are in view";
    const TABLE: fn(&[Row]) -> Table = table!(|r| place: r.case.place, objects: r.objects,
        "in the frustum": r.in_frustum, "potentially visible": r.potentially_visible, visible: r.visible);

    fn cases(_: bool) -> Vec<Case> {
        PLACES.map(|place| Case { place }).to_vec()
    }

    fn measure(case: &Case) -> Option<Found> {
        let plan = plan(&mut auditorium()?, case.place.1);
        Some(Found {
            objects: plan.spots.len() as u64,
            in_frustum: plan.spots.iter().filter(|spot| spot.in_frustum).count() as u64,
            potentially_visible: plan.counts.potentially_visible,
            visible: plan.counts.visible,
        })
    }

    fn figure(_: &[Row]) -> Figure {
        let panels = auditorium()
            .map(|mut session| PLACES.map(|Named(name, at_s)| plan(&mut session, at_s).panel(name)).to_vec());
        Figure::new("The auditorium from above", 3, panels.unwrap_or_default())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |k: usize, what: fn(&Row) -> u64| number_of(rows, |r| r.case.place == PLACES[k], |r| what(r) as f64);
        claims![
            "A: objects in view" => of(0, |r| r.visible), at_least 100.0;
            "B: objects in view, of those in the frustum" => of(1, |r| r.visible) / of(1, |r| r.in_frustum), at_most 0.5;
            "C: objects in view" => of(2, |r| r.visible), at_least 100.0;
        ]
    }
}
