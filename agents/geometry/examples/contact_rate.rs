//! How long do the contact searches of deformables take, against their size? Prints CSV.
//!
//! `cargo run --release -p metachron-geometry --example contact_rate`

use glam::{DQuat, DVec3};
use metachron_geometry::narrow_phase::{
    NarrowPhaseScratch, RestShape, SweptReach, SweptShape, VoronoiRegions, first_touch, self_touches, touches,
};
use metachron_geometry::{
    CollisionShape, Obstacle, PlacedShape, ShapeError, ShapeKind, ShapePose, Solid, SolidShape, StaticSolid,
    SurfaceShape, Touch,
};
use std::error::Error;
use std::time::Instant;

const CELL_M: f64 = 0.01;
const RADIUS_M: f64 = 1e-3;
const SKIN: SweptReach = SweptReach { reach_m: 0.0, around_m: 1e-4 };

fn main() -> Result<(), Box<dyn Error>> {
    println!("search,size,touches,search_us");
    for segments in [100, 400, 1600] {
        time("tube_with_itself", segments, coil(segments));
    }
    for cells in [16, 32, 64] {
        let (form, rest) = sheet(cells);
        let fold = |x: &DVec3| {
            let past_m = x.x - 0.5 * CELL_M * (f64::from(cells) - 0.6);
            if past_m > 0.0 { DVec3::new(x.x - 2.0 * past_m, x.y, 2.1 * RADIUS_M) } else { *x }
        };
        let folded: Vec<DVec3> = rest.iter().map(fold).collect();
        time("sheet_with_itself", cells * cells, |scratch, into| {
            let placed = PlacedShape { form: &form, view: ShapePose::Surface(&folded) };
            self_touches(&placed, RestShape::Surface(&rest), 5e-4, scratch, into);
        });
        let over: Vec<DVec3> = rest.iter().map(|x| *x + DVec3::new(0.003, 0.004, 2.1 * RADIUS_M)).collect();
        time("sheet_on_sheet", cells * cells, |scratch, into| {
            let at = |points| PlacedShape { form: &form, view: ShapePose::Surface(points) };
            touches(&at(&over), &at(&rest), 5e-4, scratch, into);
        });
        let round = rigid(Solid::Ball { radius_m: 0.005 })?;
        time("ball_through_sheet", cells * cells, |scratch, into| {
            let at = |z: f64| {
                let position = DVec3::new(0.05, 0.05, z);
                PlacedShape { form: &round, view: ShapePose::Solid { position, rotation: DQuat::IDENTITY } }
            };
            let still = PlacedShape { form: &form, view: ShapePose::Surface(&rest) };
            let (flight, still) =
                (SweptShape { start: at(0.25), end: at(-0.25) }, SweptShape { start: still, end: still });
            first_touch(&flight, &still, SKIN, scratch, into);
        });
        time("sheets_fly_together", cells * cells, |scratch, into| {
            let raised: Vec<DVec3> = rest.iter().map(|x| *x + DVec3::new(0.003, 0.004, 0.05)).collect();
            let fallen: Vec<DVec3> = raised.iter().map(|x| *x - DVec3::Z * 0.1).collect();
            let at = |points| PlacedShape { form: &form, view: ShapePose::Surface(points) };
            let flight = SweptShape { start: at(&raised), end: at(&fallen) };
            first_touch(&flight, &SweptShape { start: at(&rest), end: at(&rest) }, SKIN, scratch, into);
        });
        let block = rigid(Solid::Box { half_extents_m: DVec3::splat(0.02) })?;
        let ground = ground(cells)?;
        time("box_on_static_mesh", 2 * cells * cells, |scratch, into| {
            let position = DVec3::new(0.053, 0.057, 0.02);
            let view = ShapePose::Solid { position, rotation: DQuat::from_rotation_z(0.3) };
            ground.touches(&PlacedShape { form: &block, view }, 5e-4, scratch, into);
        });
    }
    Ok(())
}

/// Prints the mean time of a search that has its storage.
fn time(what: &str, size: u32, mut search: impl FnMut(&mut NarrowPhaseScratch, &mut Vec<Touch>)) {
    let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
    search(&mut scratch, &mut found);
    let start = Instant::now();
    let mut repeats = 0;
    while repeats < 3 || (repeats < 1000 && start.elapsed().as_secs_f64() < 0.2) {
        search(&mut scratch, &mut found);
        repeats += 1;
    }
    println!("{what},{size},{},{:.1}", found.len(), start.elapsed().as_secs_f64() * 1e6 / f64::from(repeats));
}

/// The search of a tube that is wound up in turns that touch.
fn coil(segments: u32) -> impl FnMut(&mut NarrowPhaseScratch, &mut Vec<Touch>) {
    let kind = ShapeKind::Chain;
    let form = CollisionShape::new(kind, 0.5);
    let node = |i: u32| {
        let angle = 0.25 * f64::from(i);
        let rise_m = 0.0101 / std::f64::consts::TAU * angle;
        DVec3::new(0.04 * libm::cos(angle), 0.04 * libm::sin(angle), rise_m)
    };
    let positions: Vec<DVec3> = (0..=segments).map(node).collect();
    let length_m = positions[0].distance(positions[1]);
    let arc_m: Vec<f64> = (0..=segments).map(|i| length_m * f64::from(i)).collect();
    let radii_m = vec![0.005; positions.len()];
    move |scratch, into| {
        let view = ShapePose::Chain { positions: &positions, radii_m: &radii_m };
        self_touches(&PlacedShape { form: &form, view }, RestShape::Chain(&arc_m), 5e-4, scratch, into);
    }
}

fn rigid(solid: Solid) -> Result<CollisionShape, ShapeError> {
    let kind = ShapeKind::Solid(SolidShape::new(solid, DVec3::ZERO)?);
    Ok(CollisionShape::new(kind, 0.5))
}

/// The points and triangles of a flat square of so many cells a side.
fn square(cells: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corner = |i: u32, j: u32| i * (cells + 1) + j;
    let points =
        (0..=cells).flat_map(|i| (0..=cells).map(move |j| DVec3::new(f64::from(i), f64::from(j), 0.0) * CELL_M));
    let cell = |i, j| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    (points.collect(), (0..cells).flat_map(|i| (0..cells).flat_map(move |j| cell(i, j))).collect())
}

fn ground(cells: u32) -> Result<StaticSolid, Box<dyn Error>> {
    let (points, triangles) = square(cells);
    let solid = Solid::Mesh { points_m: points.into(), triangles: triangles.into() };
    Ok(StaticSolid::new(&Obstacle::new("ground", solid))?)
}

/// A flat sheet of so many cells a side, and its vertices.
fn sheet(cells: u32) -> (CollisionShape, Vec<DVec3>) {
    let (points, triangles) = square(cells);
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    let surface = SurfaceShape {
        fans: VoronoiRegions::of(&edges, &triangles).into(),
        vertices: (0..points.len() as u32).collect(),
        edges: edges.into(),
        triangles: triangles.into(),
        radius_m: RADIUS_M,
        edge_m: 1.14 * CELL_M,
        closed: false,
    };
    (CollisionShape::new(ShapeKind::Surface(surface), 0.5), points)
}
