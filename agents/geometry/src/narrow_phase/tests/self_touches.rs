//! Deformables against themselves: tubes, sheets and solids against closed forms and brute force.

use super::surfaces::skin_of;
use super::*;
use crate::{near_segments, near_triangle};
use std::f64::consts::PI;

fn own(placed: &PlacedShape<'_>, rest: RestShape<'_>, reach_m: f64) -> Vec<Touch> {
    let mut into = Vec::new();
    self_touches(placed, rest, reach_m, &mut NarrowPhaseScratch::default(), &mut into);
    into
}

/// A tube there and back: two straight strands of so many segments each, this far apart, and the half circle between them.
fn hairpin(segments: usize, length_m: f64, apart_m: f64) -> Vec<DVec3> {
    let bend = 24;
    let there = (0..=segments).map(|i| DVec3::X * (length_m * (i as f64 - segments as f64)));
    let turn = (1..bend).map(|i| {
        let angle = PI * f64::from(i) / f64::from(bend);
        DVec3::new(libm::sin(angle), 1.0 - libm::cos(angle), 0.0) * (0.5 * apart_m)
    });
    let back = (0..=segments).map(|i| DVec3::new(-length_m * i as f64 - 0.3 * length_m, apart_m, 0.0));
    there.chain(turn).chain(back).collect()
}

/// The arc lengths of a line of nodes.
fn arc(nodes: &[DVec3]) -> Vec<f64> {
    let mut sum_m = 0.0;
    let steps = nodes.windows(2).map(|pair| pair[0].distance(pair[1]));
    std::iter::once(0.0)
        .chain(steps.map(|step| {
            sum_m += step;
            sum_m
        }))
        .collect()
}

#[test]
fn both_strands_of_a_hairpin_touch_all_along_and_a_straight_tube_never() {
    let (radius_m, length_m, form) = (0.005, 0.01, chain());
    for gap_m in [4e-4, -1e-4] {
        let nodes = hairpin(30, length_m, 2.0 * radius_m + gap_m);
        let radii = vec![radius_m; nodes.len()];
        let arc_m = arc(&nodes);
        let found = own(&along(&form, &nodes, &radii), RestShape::Chain(&arc_m), 1e-3);
        assert!(found.iter().all(|touch| adds_up(touch, &nodes, &nodes)));
        assert!(found.windows(2).all(|pair| pair[0].key < pair[1].key));
        let strands = found.iter().filter(|touch| (touch.gap_m - gap_m).abs() < 1e-12);
        // each node of either strand over the other, but for those at the ends
        assert!(strands.count() >= 56, "{found:?}");
        assert!(found.iter().all(|touch| touch.gap_m > gap_m - 1e-12));
    }
    let straight: Vec<_> = (0..100).map(|i| DVec3::X * (0.001 * f64::from(i))).collect();
    let (radii, arc_m) = (vec![radius_m; 100], arc(&straight));
    assert!(own(&along(&form, &straight, &radii), RestShape::Chain(&arc_m), 1e-3).is_empty());
}

#[test]
fn a_sliding_contact_of_a_tube_keeps_its_key_or_passes_to_a_neighbouring_segment() {
    let (radius_m, length_m, form) = (0.005, 0.01, chain());
    let start = hairpin(20, length_m, 2.0 * radius_m + 1e-4);
    let radii = vec![radius_m; start.len()];
    let arc_m = arc(&start);
    let half = start.len() / 2;
    let mut before: Vec<Touch> = Vec::new();
    for step in 0..200 {
        let mut nodes = start.clone();
        // the second strand slides along the first by two segments in all
        nodes[half..].iter_mut().for_each(|node| node.x += 0.01 * length_m * f64::from(step));
        let now = own(&along(&form, &nodes, &radii), RestShape::Chain(&arc_m), 1e-3);
        for touch in now.iter().filter(|touch| !before.is_empty() && touch.on_a != touch.on_b) {
            let (at, _) = axis(touch.on_a, &nodes);
            // at the free end and in the bend places begin and end
            let inner = at.x > -0.15 && at.x < -0.05;
            let names = |old: &Touch| old.key == touch.key || old.key.beside().contains(&touch.key);
            assert!(!inner || before.iter().any(names), "step {step}: {touch:?}");
        }
        before = now;
    }
}

#[test]
fn no_two_contacts_of_a_tube_of_seventy_thousand_segments_share_a_key() {
    let (radius_m, length_m, form) = (0.005, 0.01, chain());
    let nodes = hairpin(35_000, length_m, 2.0 * radius_m + 1e-4);
    let (radii, arc_m) = (vec![radius_m; nodes.len()], arc(&nodes));
    let found = own(&along(&form, &nodes, &radii), RestShape::Chain(&arc_m), 1e-3);
    assert!(found.len() > 69_000, "{}", found.len());
    assert!(found.windows(2).all(|pair| pair[0].key < pair[1].key));
    // no key was moved to make it unique
    assert!(found.iter().all(|touch| touch.key.place < PLACES));
}

const CELL: f64 = 0.01;

/// A grid of squares of 1 cm, each of two triangles, whose vertices lie where `place` says.
fn sheet(cells: [u32; 2], radius_m: f64, place: impl Fn(DVec3) -> DVec3) -> (CollisionShape, Vec<DVec3>, Vec<DVec3>) {
    let [nx, ny] = cells;
    let at = |i: u32, j: u32| i * (ny + 1) + j;
    let rest: Vec<_> = (0..=nx)
        .flat_map(|i| (0..=ny).map(move |j| DVec3::new(f64::from(i) * CELL, f64::from(j) * CELL, 0.0)))
        .collect();
    let square = |i, j| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles: Vec<_> = (0..nx).flat_map(|i| (0..ny).flat_map(move |j| square(i, j))).collect();
    let form = skin_of(&triangles, (nx + 1) * (ny + 1), radius_m, false);
    let placed = rest.iter().map(|point| place(*point)).collect();
    (form, rest, placed)
}

/// A sheet folded about x = `fold_m`, its layers this far apart.
fn folded(point: DVec3, fold_m: f64, apart_m: f64) -> DVec3 {
    let (radius_m, past_m) = (0.5 * apart_m, point.x - fold_m);
    let bend_m = PI * radius_m;
    if past_m <= 0.0 {
        point
    } else if past_m < bend_m {
        let angle = past_m / radius_m;
        DVec3::new(fold_m + radius_m * libm::sin(angle), point.y, radius_m * (1.0 - libm::cos(angle)))
    } else {
        DVec3::new(fold_m - (past_m - bend_m), point.y, apart_m)
    }
}

#[test]
fn the_layers_of_a_folded_sheet_touch_at_their_gap() {
    let radius_m = 1e-3;
    for gap_m in [3e-4, 1e-6, -5e-5] {
        let (form, rest, places) = sheet([20, 8], radius_m, |point| folded(point, 0.098, 2.0 * radius_m + gap_m));
        let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
        let found = own(&placed, RestShape::Surface(&rest), 5e-4);
        assert!(found.windows(2).all(|pair| pair[0].key < pair[1].key));
        assert!(found.iter().all(|touch| touch.normal.is_normalized()));
        let flat = found.iter().filter(|touch| (touch.gap_m - gap_m).abs() < 1e-12);
        let flat: Vec<_> = flat.filter(|touch| touch.normal.z.abs() > 1.0 - 1e-9).collect();
        // each vertex of either layer over the other
        assert!(flat.len() > 2 * 8 * 8, "{} of {}", flat.len(), found.len());
        // a vertex of the upper layer is pushed up, of the lower one down
        for touch in flat.iter().filter(|touch| touch.key.kind == TouchKind::Vertex) {
            let (on_vertex, _) = axis(touch.on_a, &places);
            assert_eq!(touch.normal.z > 0.0, on_vertex.z > radius_m, "{touch:?}");
        }
        let least_m = found.iter().map(|touch| touch.gap_m).fold(f64::INFINITY, f64::min);
        assert!(least_m > gap_m - 1e-4, "{least_m}");
    }
}

#[test]
fn a_sheet_that_lies_flat_or_curls_gently_does_not_touch_itself_however_far_it_looks() {
    let flat = sheet([12, 8], 1e-3, |point| point);
    let curled = sheet([12, 8], 1e-3, |point| {
        let angle = point.x / 0.05;
        DVec3::new(0.05 * libm::sin(angle), point.y, 0.05 * (1.0 - libm::cos(angle)))
    });
    for (form, rest, places) in [flat, curled] {
        let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
        let found = own(&placed, RestShape::Surface(&rest), 0.02);
        assert!(found.iter().all(|touch| touch.gap_m > 5e-3), "{found:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// No contact of a crumpled sheet is nearer than brute force finds, and a vertex whose nearest place is inside a triangle reports it.
    #[test]
    fn a_crumpled_sheet_touches_where_brute_force_finds_it(bumps in prop::collection::vec(vector(0.006), 91), apart_m in 0.004..0.012) {
        let radius_m = 5e-4;
        let (form, rest, flat) = sheet([12, 6], radius_m, |point| folded(point, 0.055, apart_m));
        let places: Vec<_> = flat.iter().zip(&bumps).map(|(at, bump)| *at + *bump * DVec3::new(0.3, 0.3, 0.5)).collect();
        let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
        let reach_m = 3e-3;
        let found = own(&placed, RestShape::Surface(&rest), reach_m);
        let ShapeKind::Surface(surface) = &form.kind else { unreachable!() };
        let excluded_m = PI * radius_m;
        for touch in &found {
            let ((p, _), (q, _)) = (axis(touch.on_a, &places), axis(touch.on_b, &places));
            // a normal that leads out of its own skin leans by the slack of a region
            prop_assert!(touch.gap_m <= p.distance(q) - 2.0 * radius_m + 1e-12, "{touch:?}");
            prop_assert!(touch.gap_m >= p.distance(q) * 0.9 - 2.0 * radius_m, "{touch:?} {}", p.distance(q));
        }
        for &vertex in surface.vertices.iter() {
            let at = |v: u32| places[v as usize];
            let at_rest = |v: u32| rest[v as usize];
            let foot_on = |triangle: &[u32; 3]| near_triangle(at(vertex), triangle.map(at));
            let apart = surface.triangles.iter().filter(|triangle| {
                let rest_m = near_triangle(at_rest(vertex), triangle.map(at_rest)).distance(at_rest(vertex));
                !triangle.contains(&vertex) && rest_m >= excluded_m
            });
            let nearest = apart.min_by(|a, b| {
                foot_on(a).distance(at(vertex)).total_cmp(&foot_on(b).distance(at(vertex)))
            });
            // a vertex reports its nearest place
            if let Some(triangle) = nearest {
                let corners = triangle.map(at);
                let foot = foot_on(triangle);
                let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                let way = at(vertex) - foot;
                let inside = way.normalize_or_zero().dot(face).abs() > 0.9999;
                let gap_m = way.length() - 2.0 * radius_m;
                // at the edge of the reach the slack of a region decides
                if !inside || gap_m > 0.95 * reach_m {
                    continue;
                }
                // the vertex itself reports a place at least as near, unless its own skin is in the way
                let reports = |touch: &Touch| touch.key.features[0] == vertex && touch.key.kind == TouchKind::Vertex;
                let own_skin = surface.edges.iter().filter(|edge| edge.contains(&vertex)).any(|edge| {
                    let other = at(edge[0] + edge[1] - vertex);
                    (other - at(vertex)).dot(-way) > 0.0
                });
                let told = found.iter().any(|touch| reports(touch) && touch.gap_m <= gap_m + 1e-9);
                prop_assert!(own_skin || told, "vertex {vertex} over {triangle:?} at {gap_m}");
            }
        }
    }

    #[test]
    fn crossing_edges_of_a_crumpled_sheet_are_reported_at_their_distance(bumps in prop::collection::vec(vector(0.004), 91)) {
        let radius_m = 5e-4;
        let (form, rest, flat) = sheet([12, 6], radius_m, |point| folded(point, 0.055, 6e-3));
        let places: Vec<_> = flat.iter().zip(&bumps).map(|(at, bump)| *at + *bump).collect();
        let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
        let found = own(&placed, RestShape::Surface(&rest), 4e-3);
        let ShapeKind::Surface(surface) = &form.kind else { unreachable!() };
        for touch in found.iter().filter(|touch| touch.key.kind == TouchKind::Edge) {
            let [a, b] = touch.key.features.map(|edge| surface.edges[edge as usize].map(|v| places[v as usize]));
            let (s, t) = near_segments(a, b);
            let apart_m = a[0].lerp(a[1], s).distance(b[0].lerp(b[1], t));
            prop_assert!((touch.gap_m - (apart_m - 2.0 * radius_m)).abs() < 1e-12);
            prop_assert!(touch.key.features[0] < touch.key.features[1]);
        }
    }
}

/// The width of a leg of an arch, metres.
const LEG: f64 = 0.05;

/// The closed skin of an arch of square section: two legs and a beam, from cells that are filled.
fn arch(legs_apart: usize, height: usize) -> (CollisionShape, Vec<DVec3>) {
    let size = [legs_apart + 2, 1, height];
    let filled = |x: isize, y: isize, z: isize| {
        let within = |at: isize, of: usize| at >= 0 && at < of as isize;
        within(x, size[0])
            && within(y, size[1])
            && within(z, size[2])
            && (x == 0 || x + 1 == size[0] as isize || z + 1 == size[2] as isize)
    };
    let mut positions: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    let mut vertex = |at: [isize; 3]| {
        let at = DVec3::new(at[0] as f64, at[1] as f64, at[2] as f64) * LEG;
        positions.iter().position(|known| *known == at).unwrap_or_else(|| {
            positions.push(at);
            positions.len() - 1
        }) as u32
    };
    for x in 0..size[0] as isize {
        for z in 0..size[2] as isize {
            if !filled(x, 0, z) {
                continue;
            }
            let cell = [x, 0, z];
            for axis in 0..3 {
                for side in [0, 1] {
                    let mut beside = cell;
                    beside[axis] += 2 * side - 1;
                    if filled(beside[0], beside[1], beside[2]) {
                        continue;
                    }
                    let corner = |u: isize, v: isize| {
                        let mut at = cell;
                        at[axis] += side;
                        at[(axis + 1) % 3] += u;
                        at[(axis + 2) % 3] += v;
                        at
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)].map(&mut vertex);
                    let quad = if side == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                    triangles.extend(quad);
                }
            }
        }
    }
    (skin_of(&triangles, positions.len() as u32, 0.0, true), positions)
}

#[test]
fn the_legs_of_a_soft_arch_touch_where_they_meet_and_a_crushed_block_does_not() {
    let (form, rest) = arch(2, 4);
    let placed = |places: &[DVec3], reach_m| {
        own(&PlacedShape { form: &form, view: ShapePose::Surface(places) }, RestShape::Surface(&rest), reach_m)
    };
    assert!(placed(&rest, 5e-3).is_empty());
    for gap_m in [1e-3, 1e-5, -2e-5, -1e-3] {
        // the legs, from 2 to 4 cells, are drawn together as far as they hang free
        let bent: Vec<_> = rest
            .iter()
            .map(|at| {
                let hangs = (3.0 - at.z / LEG).clamp(0.0, 1.0);
                let by_m = (LEG - 0.5 * gap_m) * hangs;
                *at + DVec3::X * if at.x < 1.5 * LEG { by_m } else { -by_m }
            })
            .collect();
        let found = placed(&bent, 2e-3);
        let nearest = lowest(&found);
        assert!((nearest.gap_m - gap_m).abs() < 1e-12, "{gap_m}: {nearest:?}");
        assert!(nearest.normal.x.abs() > 1.0 - 1e-9);
        for touch in found.iter().filter(|touch| touch.key.kind == TouchKind::Vertex) {
            let (at, _) = axis(touch.on_a, &rest);
            // the left leg's vertices are pushed to the left
            assert_eq!(touch.normal.x < 0.0, at.x < 1.5 * LEG, "{touch:?}");
        }
        let vertices = found.iter().filter(|touch| touch.key.kind == TouchKind::Vertex);
        assert!(vertices.count() >= 12, "{found:?}");
    }
    // pressed flat to half its height it is nowhere near itself
    let crushed: Vec<_> = rest.iter().map(|at| *at * DVec3::new(1.0, 0.5, 1.0)).collect();
    assert!(placed(&crushed, 2e-3).is_empty());
}

#[test]
fn a_skin_that_moves_touches_itself_where_a_first_search_finds_it() {
    let (form, rest, flat) = sheet([12, 6], 5e-4, |point| point);
    let (mut kept, mut found, mut most) = (NarrowPhaseScratch::default(), vec![], 0);
    for step in 0..400 {
        // it closes, is thrown away as a whole, and shakes in between
        let at = f64::from(step);
        let apart_m = 0.001 + 0.011 * libm::cos(at / 60.0).powi(2);
        let shake = |k: usize| DVec3::new(0.0, 0.0, 4e-5 * libm::sin(1.3 * at + 7.0 * k as f64));
        let thrown = DVec3::new(0.01, -0.02, 0.05) * at;
        let places: Vec<_> =
            flat.iter().enumerate().map(|(k, p)| folded(*p, 0.055, apart_m) + shake(k) + thrown).collect();
        let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
        let reach_m = 1e-3 * (1.0 + libm::sin(0.2 * at));
        self_touches(&placed, RestShape::Surface(&rest), reach_m, &mut kept, &mut found);
        assert_eq!(found, own(&placed, RestShape::Surface(&rest), reach_m), "step {step}");
        most = most.max(found.len());
    }
    assert!(most > 20, "{most}");
}

#[test]
fn nothing_is_allocated_by_a_skin_against_itself_once_everything_is_known() {
    let (form, rest, places) = sheet([20, 8], 1e-3, |point| folded(point, 0.098, 2.2e-3));
    let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
    let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
    let mut run = || {
        let rest = RestShape::Surface(&rest);
        allocation_counter::measure(|| self_touches(&placed, rest, 5e-4, &mut scratch, &mut found)).count_total
    };
    run();
    assert_eq!(run(), 0);
}

#[test]
fn rests_of_another_kind_or_size_touch_nothing() {
    let (form, rest, places) = sheet([4, 4], 1e-3, |point| point * 0.1);
    let placed = PlacedShape { form: &form, view: ShapePose::Surface(&places) };
    assert!(own(&placed, RestShape::Surface(&rest[1..]), 1.0).is_empty());
    assert!(own(&placed, RestShape::Chain(&[0.0; 25]), 1.0).is_empty());
    let (form, nodes) = (chain(), hairpin(5, 0.01, 0.01));
    let radii = vec![0.005; nodes.len()];
    assert!(own(&along(&form, &nodes, &radii), RestShape::Chain(&[0.0, 1.0]), 1.0).is_empty());
    let lost = vec![DVec3::NAN; nodes.len()];
    assert!(own(&along(&form, &lost, &radii), RestShape::Chain(&arc(&nodes)), 1.0).is_empty());
}
