//! The skins of soft bodies against brute force and closed forms.

use super::*;
use crate::SurfaceShape;
use crate::narrow_phase::VoronoiRegions;
use crate::near_triangle;

const CELLS: u32 = 4;
const EDGE: f64 = 0.05;

/// A wavy grid of triangles of 1 mm half thickness, from the origin on.
fn sheet() -> (CollisionShape, Vec<DVec3>) {
    let at = |i: u32, j: u32| i * (CELLS + 1) + j;
    let places = (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| (i, j)));
    let point = |(i, j): (u32, u32)| {
        let (x, y) = (f64::from(i) * EDGE, f64::from(j) * EDGE);
        DVec3::new(x, y, 0.01 * libm::sin(30.0 * x) * libm::cos(20.0 * y))
    };
    let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
    let halves =
        |(i, j): (u32, u32)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles: Vec<[u32; 3]> = cells.flat_map(halves).collect();
    (skin_of(&triangles, (CELLS + 1).pow(2), 1e-3, false), places.map(point).collect())
}

/// The same grid at z = 0.
pub(super) fn flat_sheet() -> (CollisionShape, Vec<DVec3>) {
    let (form, mut positions) = sheet();
    positions.iter_mut().for_each(|at| at.z = 0.0);
    (form, positions)
}

/// The closed skin of a block of 10 cm about (0, 0, 5 cm), two triangles a side, and its corners.
pub(super) fn block_skin() -> (CollisionShape, Vec<DVec3>) {
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - DVec3::splat(0.5);
    let positions: Vec<_> = (0..8).map(|i| corner(i) * 0.1 + DVec3::Z * 0.05).collect();
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<_> = sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    (skin_of(&triangles, 8, 0.0, true), positions)
}

/// The skin of these triangles over so many vertices.
pub(super) fn skin_of(triangles: &[[u32; 3]], vertices: u32, radius_m: f64, closed: bool) -> CollisionShape {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    let surface = SurfaceShape {
        fans: VoronoiRegions::of(&edges, triangles).into(),
        vertices: (0..vertices).collect(),
        edges: edges.into(),
        triangles: triangles.into(),
        radius_m,
        edge_m: EDGE,
        closed,
    };
    CollisionShape::new(ShapeKind::Surface(surface), 0.5)
}

/// The distance of a point from the nearest triangle.
fn apart(form: &CollisionShape, positions: &[DVec3], point: DVec3) -> f64 {
    let ShapeKind::Surface(surface) = &form.kind else { panic!("a surface") };
    let corners = surface.triangles.iter().map(|triangle| triangle.map(|vertex| positions[vertex as usize]));
    corners.map(|corners| near_triangle(point, corners).distance(point)).fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// The lowest place is the nearest point of the surface.
    #[test]
    fn a_ball_and_a_box_s_corner_touch_where_they_are_nearest(x in 0.01_f64..0.19, y in 0.01_f64..0.19, z in 0.03_f64..0.06) {
        let (form, positions) = sheet();
        let (mut scratch, mut list) = (NarrowPhaseScratch::default(), vec![]);
        let here = PlacedShape { form: &form, view: ShapePose::Surface(&positions) };
        let at = DVec3::new(x, y, z);
        let round = ball(0.02);
        let there = PlacedShape { form: &round, view: ShapePose::Solid { position: at, rotation: DQuat::IDENTITY } };
        touches(&here, &there, 0.1, &mut scratch, &mut list);
        let nearest = lowest(&list);
        let wanted = apart(&form, &positions, at) - 0.02 - 1e-3;
        // near an edge a place takes the normal of the face beside it: some 1e-8 m in one of a thousand places
        let slack_m = 1e-6;
        prop_assert!((nearest.gap_m - wanted).abs() <= slack_m, "{} {wanted}", nearest.gap_m);
        prop_assert!(list.iter().all(|touch| touch.gap_m >= wanted - slack_m));
        prop_assert!(list.windows(2).all(|pair| pair[0].key < pair[1].key));
        // both sides see the same, turned round
        let mut back = vec![];
        touches(&there, &here, 0.1, &mut scratch, &mut back);
        prop_assert_eq!(list.len(), back.len());
        for (one, two) in list.iter().zip(&back) {
            prop_assert_eq!((one.gap_m, one.normal, one.on_a, one.on_b), (two.gap_m, -two.normal, two.on_b, two.on_a));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn on_a_flat_skin_every_place_pushes_straight_out_of_it(x in 0.05_f64..0.15, y in 0.05_f64..0.15, lean in -0.05_f64..0.05) {
        let (form, mut positions) = sheet();
        positions.iter_mut().for_each(|x| x.z = 0.0);
        let (mut scratch, mut list) = (NarrowPhaseScratch::default(), vec![]);
        let here = PlacedShape { form: &form, view: ShapePose::Surface(&positions) };
        for (solid, height) in [
            (ball(0.02), 0.02),
            (cuboid(DVec3::new(0.03, 0.04, 0.02)), 0.02 + 0.04 * lean.abs()),
            (cylinder(0.03, 0.02), 0.02 + 0.04 * lean.abs()),
        ] {
            let rotation = DQuat::from_rotation_y(lean);
            let position = DVec3::new(x, y, height + 1.5e-3);
            touches(&here, &at(&solid, position, rotation), 0.02, &mut scratch, &mut list);
            prop_assert!(!list.is_empty());
            // a feature of the skin beneath a face pushes along that face's normal
            let face = rotation * DVec3::NEG_Z;
            // of a ball the slack of eq. 8 stays: a thousandth of a diagonal over its radius
            let off = if matches!(solid.kind, ShapeKind::Solid(SolidShape { solid: Solid::Ball { .. }, .. })) { 1.5e-3 * EDGE / 0.02 } else { 1e-9 };
            let straight = |normal: DVec3| normal.distance(DVec3::NEG_Z) < off || normal.distance(face) < off;
            prop_assert!(list.iter().all(|touch| straight(touch.normal)), "{list:?}");
        }
    }
}

#[test]
fn a_corner_that_slides_over_a_sheet_keeps_its_name_from_triangle_to_triangle() {
    let (form, positions) = flat_sheet();
    let cube = cuboid(DVec3::splat(0.02));
    let down = DQuat::from_rotation_arc(DVec3::ONE.normalize(), DVec3::NEG_Z);
    let here = PlacedShape { form: &form, view: ShapePose::Surface(&positions) };
    let mut triangles = Vec::new();
    let names: Vec<_> = (0..60)
        .map(|step| {
            let position = DVec3::new(0.03 + 2e-3 * f64::from(step), 0.06, 0.02 * 3.0_f64.sqrt() + 1.1e-3);
            let found = all(&here, &at(&cube, position, down), 5e-4);
            let inside = found.iter().find(|touch| touch.key.kind == TouchKind::Triangle).unwrap();
            triangles.push(inside.key.features[0]);
            inside.key.anywhere()
        })
        .collect();
    assert!(names.iter().all(|name| *name == names[0]), "{names:?}");
    triangles.dedup();
    assert!(triangles.len() > 3, "{triangles:?}");
}

#[test]
fn edges_touch_where_both_stand_out_and_nowhere_on_flat_skins() {
    let (form, flat) = flat_sheet();
    let middle = DVec3::new(0.5 * f64::from(CELLS) * EDGE, 0.5 * f64::from(CELLS) * EDGE, 0.0);
    let turned = DQuat::from_rotation_z(0.4);
    // the crest of the lower one is above its y axis, that of the upper one under its x axis, which is turned and moved aside: they cross within
    // edges
    let aside = DVec3::new(0.05, 0.1, 0.0) * EDGE;
    let touches = |slope: f64| {
        let from_middle = || flat.iter().map(|x| *x - middle);
        let below: Vec<_> = from_middle().map(|x| x - DVec3::Z * (slope * x.x.abs() + 1.5e-3)).collect();
        let above: Vec<_> =
            from_middle().map(|x| turned * x + aside + DVec3::Z * (slope * x.y.abs() + 1.5e-3)).collect();
        let placed = [&below, &above].map(|at| PlacedShape { form: &form, view: ShapePose::Surface(at) });
        all(&placed[1], &placed[0], 2e-3)
    };
    let crossings = |found: &[Touch]| found.iter().filter(|touch| touch.key.kind == TouchKind::Edge).count();
    let found = touches(0.0);
    assert!(found.len() > 20);
    assert_eq!(crossings(&found), 8, "of the borders of two squares");
    let found = touches(0.3);
    assert!(crossings(&found) > 0);
    // two half thicknesses less than the crests are apart
    assert!((lowest(&found).gap_m - 1e-3).abs() < 1e-9, "{}", lowest(&found).gap_m);
}

#[test]
fn a_box_s_corner_over_a_triangle_touches_inside_it() {
    let (form, mut positions) = sheet();
    positions.iter_mut().for_each(|x| x.z = 0.0);
    let (mut scratch, mut list) = (NarrowPhaseScratch::default(), vec![]);
    let cube = cuboid(DVec3::splat(0.02));
    // a corner down: half a diagonal under the middle
    let down = DQuat::from_rotation_arc(DVec3::ONE.normalize(), DVec3::NEG_Z);
    let (x, y) = (0.068, 0.06);
    let position = DVec3::new(x, y, 0.02 * 3.0_f64.sqrt() + 0.003);
    let there = PlacedShape { form: &cube, view: ShapePose::Solid { position, rotation: down } };
    touches(&PlacedShape { form: &form, view: ShapePose::Surface(&positions) }, &there, 0.01, &mut scratch, &mut list);
    let nearest = lowest(&list);
    assert!((nearest.gap_m - 0.002).abs() < 1e-4, "{nearest:?}"); // eight projections from the middle of the triangle
    assert!(matches!(nearest.on_a, Place::Surface { shares, .. } if shares.iter().all(|share| *share > 0.02)));
}

/// The closed skin of a tetrahedron whose sides are counter-clockwise seen from outside.
fn tetrahedron(triangles: [[u32; 3]; 4]) -> CollisionShape {
    let edges = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    let surface = SurfaceShape {
        fans: VoronoiRegions::of(&edges, &triangles).into(),
        vertices: [0, 1, 2, 3].into(),
        edges: edges.into(),
        triangles: triangles.into(),
        radius_m: 0.0,
        edge_m: 1.0,
        closed: true,
    };
    CollisionShape::new(ShapeKind::Surface(surface), 0.5)
}

#[test]
fn a_ball_s_middle_behind_a_closed_skin_is_pushed_out_of_it() {
    let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let form = tetrahedron([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
    let (mut scratch, mut list) = (NarrowPhaseScratch::default(), vec![]);
    let round = ball(0.02);
    for depth in [-0.015, 0.01] {
        let position = DVec3::new(0.2, 0.2, depth);
        let there = PlacedShape { form: &round, view: ShapePose::Solid { position, rotation: DQuat::IDENTITY } };
        touches(
            &PlacedShape { form: &form, view: ShapePose::Surface(&positions) },
            &there,
            0.0,
            &mut scratch,
            &mut list,
        );
        let nearest = lowest(&list);
        // the surface is above the ball, which has to go down, whichever side its middle is on
        assert!(nearest.normal.distance(DVec3::Z) < 1e-12, "{depth}: {nearest:?}");
        assert!((nearest.gap_m - (-depth - 0.02)).abs() < 1e-12, "{depth}: {nearest:?}");
    }
}

/// A tetrahedron with a ridge along x at z = 0 from −1 m to 1 m, and its touches with `there`.
fn on_a_ridge(there: &PlacedShape<'_>) -> Vec<Touch> {
    let positions = [DVec3::NEG_X, DVec3::X, DVec3::new(0.0, 1.0, -1.0), DVec3::new(0.0, -1.0, -1.0)];
    let form = tetrahedron([[0, 1, 2], [1, 0, 3], [0, 2, 3], [1, 3, 2]]);
    let (mut scratch, mut list) = (NarrowPhaseScratch::default(), vec![]);
    let here = PlacedShape { form: &form, view: ShapePose::Surface(&positions) };
    touches(&here, there, 0.01, &mut scratch, &mut list);
    list
}

#[test]
fn an_edge_of_a_box_across_a_ridge_is_one_place_with_the_normal_of_both() {
    let cube = cuboid(DVec3::splat(0.1));
    let rotation = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
    for depth_m in [-0.002, 1e-6, 2e-5, 0.002] {
        let position = DVec3::new(0.3, 0.02, 0.1 * 2.0_f64.sqrt() - depth_m);
        let list = on_a_ridge(&PlacedShape { form: &cube, view: ShapePose::Solid { position, rotation } });
        let [touch] = list[..] else { panic!("{list:?}") };
        assert!((touch.gap_m + depth_m).abs() < 1e-12 && touch.normal.distance(DVec3::NEG_Z) < 1e-12, "{touch:?}");
        let Place::Surface { vertices, shares } = touch.on_a else { panic!("{touch:?}") };
        let across = vertices.into_iter().zip(shares).map(|(vertex, share)| [-share, share, 0.0, 0.0][vertex as usize]);
        assert!((across.sum::<f64>() - 0.3).abs() < 1e-12, "{touch:?}");
    }
}

#[test]
fn a_corner_of_a_box_over_a_face_is_on_its_outer_side() {
    let cube = cuboid(DVec3::splat(0.1));
    // a corner down onto the face between the ridge and y = 1: along its normal
    let out = DVec3::new(0.0, 1.0, 1.0).normalize();
    let rotation = DQuat::from_rotation_arc(DVec3::ONE.normalize(), -out);
    let foot = DVec3::new(0.1, 0.3, -0.3);
    for depth_m in [-0.002, 2e-5, 0.002] {
        let position = foot + out * (0.1 * 3.0_f64.sqrt() - depth_m);
        let list = on_a_ridge(&PlacedShape { form: &cube, view: ShapePose::Solid { position, rotation } });
        let [touch] = list[..] else { panic!("{list:?}") };
        assert!((touch.gap_m + depth_m).abs() < 1e-12 && touch.normal.distance(-out) < 1e-12, "{touch:?}");
    }
}
