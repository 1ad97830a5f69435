//! The promises of a totally ordered mesh, against the mesh it was made of and brute force.

use super::{Cut, ProgressiveMesh, ProgressiveMeshError};
use crate::Generator;
use crate::generate;
use glam::{DVec3, Vec3};
use metachron_geometry::{PrimitiveMesh, PrimitiveVertex, creased_mesh, near_triangle};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Positions of a cut's triangles, as bits.
type Face = [[u32; 3]; 3];

fn bits(v: Vec3) -> [u32; 3] {
    (v + Vec3::ZERO).to_array().map(f32::to_bits)
}

fn faces(tom: &ProgressiveMesh, cut: Cut) -> Vec<[Vec3; 3]> {
    let mut corners = Vec::new();
    tom.resolve(cut, &mut corners);
    assert!(corners.iter().flatten().all(|&i| i < cut.vertices));
    corners.iter().map(|t| t.map(|i| tom.vertices()[i as usize].core)).collect()
}

/// Every directed edge between positions, with how often it is there.
fn edges(faces: &[[Vec3; 3]]) -> BTreeMap<[[u32; 3]; 2], u32> {
    let mut found = BTreeMap::new();
    for f in faces {
        for i in 0..3 {
            *found.entry([bits(f[i]), bits(f[(i + 1) % 3])]).or_default() += 1;
        }
    }
    found
}

/// Directed edges without one the other way: the rim.
fn rim(faces: &[[Vec3; 3]]) -> Vec<[[u32; 3]; 2]> {
    let edges = edges(faces);
    edges.keys().filter(|[a, b]| !edges.contains_key(&[*b, *a])).copied().collect()
}

/// A face from its least corner on, so that equal faces are equal.
fn canonical(vertices: [PrimitiveVertex; 3]) -> [(Face, [u32; 3]); 1] {
    let first = (0..3).min_by_key(|&i| bits(vertices[i].core)).unwrap();
    let turned = [0, 1, 2].map(|i| vertices[(first + i) % 3]);
    [(turned.map(|v| bits(v.core)), bits(turned[0].normal))]
}

fn all_counts(tom: &ProgressiveMesh) -> Vec<Cut> {
    let (least, most) = tom.range();
    let mut cuts: Vec<Cut> = (least..=most).map(|n| tom.cut(n)).collect();
    cuts.dedup();
    cuts
}

#[test]
fn full_count_is_the_mesh_that_was_given() {
    for kind in Generator::ALL {
        let mesh = generate(kind, 1, 600);
        let tom = ProgressiveMesh::new(&mesh).unwrap();
        let cut = tom.cut(u32::MAX);
        let mut corners = Vec::new();
        tom.resolve(cut, &mut corners);
        let own = |t: &[u32; 3]| canonical(t.map(|i| tom.vertices()[i as usize]));
        let given = |t: &[u32; 3]| canonical(t.map(|i| mesh.vertices[i as usize]));
        let (mut own, mut given) = (
            corners.iter().flat_map(own).collect::<Vec<_>>(),
            mesh.triangles.iter().flat_map(given).collect::<Vec<_>>(),
        );
        own.sort_unstable();
        given.sort_unstable();
        assert_eq!(own, given, "{kind:?}");
    }
}

#[test]
fn every_cut_is_a_sound_surface_of_the_kind_that_was_given() {
    for kind in Generator::ALL {
        let tom = ProgressiveMesh::new(&generate(kind, 5, 500)).unwrap();
        let open = matches!(kind, Generator::Terrain | Generator::Cavity);
        let mut before = 0;
        for cut in all_counts(&tom) {
            let faces = faces(&tom, cut);
            assert_eq!(faces.len(), cut.triangles as usize);
            assert!(cut.triangles > before);
            before = cut.triangles;
            for f in &faces {
                assert!(f[0] != f[1] && f[1] != f[2] && f[2] != f[0], "{kind:?} {cut:?}");
            }
            assert!(edges(&faces).values().all(|&n| n == 1), "{kind:?} {cut:?} is not manifold");
            assert_eq!(!rim(&faces).is_empty(), open, "{kind:?} {cut:?}");
        }
    }
}

#[test]
fn a_cut_has_at_most_a_few_triangles_fewer_than_asked_for() {
    let tom = ProgressiveMesh::new(&generate(Generator::Blob, 2, 900)).unwrap();
    let (least, most) = tom.range();
    assert!(least <= 8, "{least}");
    for n in least..=most {
        let cut = tom.cut(n);
        assert!(cut.triangles <= n && n - cut.triangles <= 2, "{n}: {cut:?}");
    }
    assert_eq!(tom.cut(0).triangles, least);
}

#[test]
fn a_boundary_shrinks_along_itself_and_stays_one_loop() {
    let tom = ProgressiveMesh::new(&generate(Generator::Terrain, 9, 400)).unwrap();
    for cut in all_counts(&tom) {
        let rim = rim(&faces(&tom, cut));
        let next: BTreeMap<_, _> = rim.iter().map(|[a, b]| (*a, *b)).collect();
        assert_eq!(next.len(), rim.len(), "a rim that crosses itself at {cut:?}");
        let (start, mut at, mut steps) = (rim[0][0], rim[0][1], 1);
        while at != start {
            at = next[&at];
            steps += 1;
        }
        assert_eq!(steps, rim.len(), "more than one rim at {cut:?}");
        for corner in rim.iter().flatten() {
            // the square's border: a coordinate of exactly ±1
            let at = corner.map(f32::from_bits);
            assert!(at[0].abs() == 1.0 || at[1].abs() == 1.0, "{at:?} at {cut:?}");
        }
    }
}

/// The greatest distance of the full mesh's vertices from a cut, looking at every triangle.
fn brute_error(tom: &ProgressiveMesh, triangles: u32) -> f64 {
    let faces = faces(tom, tom.cut(triangles));
    let nearest = |p: DVec3| {
        let to = |f: &[Vec3; 3]| near_triangle(p, f.map(|v| v.as_dvec3())).distance(p);
        faces.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    tom.vertices().iter().map(|v| nearest(v.core.as_dvec3())).fold(0.0, f64::max)
}

#[test]
fn the_error_falls_with_the_count_and_is_what_brute_force_finds() {
    let tom = ProgressiveMesh::new(&generate(Generator::Blob, 3, 1500)).unwrap();
    let (least, most) = tom.range();
    let mut before = f64::INFINITY;
    for n in (least..=most).step_by(50) {
        assert!(tom.error_m(n) <= before, "{n}");
        before = tom.error_m(n);
    }
    assert_eq!(tom.error_m(most), 0.0);
    for n in [8, 20, 60, 200, 600] {
        let (told, found) = (tom.error_m(n), brute_error(&tom, n));
        // rows are a factor of 1.6 apart, and 500 of 750 vertices are looked at
        assert!(told <= 1.8 * found && found <= 1.8 * told, "{n}: {told} and {found}");
    }
}

#[test]
fn a_sphere_of_few_triangles_is_near_the_sphere() {
    let tom = ProgressiveMesh::new(&generate(Generator::Sphere, 0, 4000)).unwrap();
    for n in [50, 200, 800] {
        let sagitta = 2.0 * std::f64::consts::TAU / (3.0_f64.sqrt() * f64::from(n));
        // n equilateral triangles with corners on the sphere: the middle of one is about 4π/(√3·n)·2/3 inside it;
        // the order is greedy, so a factor of 2 is left to it
        assert!(tom.error_m(n) < 2.0 * sagitta, "{n}: {} against {sagitta}", tom.error_m(n));
    }
}

#[test]
fn a_flat_square_needs_two_triangles() {
    let points: Vec<DVec3> = (0..121).map(|i| DVec3::new(f64::from(i % 11), f64::from(i / 11), 0.0)).collect();
    let quad = |a: u32| [[a, a + 1, a + 12], [a, a + 12, a + 11]];
    let triangles: Vec<[u32; 3]> = (0..110).filter(|a| a % 11 != 10).flat_map(quad).collect();
    let tom = ProgressiveMesh::new(&creased_mesh(&points, &triangles)).unwrap();
    assert!(tom.cut(2).triangles <= 2 && tom.error_m(2) < 1e-9, "{:?} {}", tom.cut(2), tom.error_m(2));
}

#[test]
fn memory_is_at_most_a_tenth_more_than_a_plain_mesh_needs() {
    for kind in [Generator::Sphere, Generator::Torus, Generator::Blob, Generator::Terrain] {
        let (own, plain) = ProgressiveMesh::new(&generate(kind, 1, 2000)).unwrap().bytes();
        assert!(own as f64 <= 1.10 * plain as f64, "{kind:?}: {own} of {plain}");
    }
    // a word beside the eight of a vertex and the three of a triangle: at most 1/9 for three vertices a triangle, where every edge is
    // sharp; the table of errors is a hundredth of so small a mesh
    let tetrahedra = many_tetrahedra(100);
    for mesh in [generate(Generator::Seat, 1, 2000), tetrahedra] {
        let (own, plain) = ProgressiveMesh::new(&mesh).unwrap().bytes();
        assert!(own as f64 <= 1.12 * plain as f64, "{own} of {plain}");
    }
}

/// Tetrahedra side by side, every edge of them a crease.
fn many_tetrahedra(count: u32) -> PrimitiveMesh {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let points: Vec<DVec3> = (0..count).flat_map(|i| corners.map(|p| p + DVec3::X * (2.0 * f64::from(i)))).collect();
    let faces = |i: u32| [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|t| t.map(|k: u32| k + 4 * i));
    creased_mesh(&points, &(0..count).flat_map(faces).collect::<Vec<_>>())
}

#[test]
fn a_mesh_cut_short_has_the_same_cuts_below() {
    let tom = ProgressiveMesh::new(&generate(Generator::Blob, 4, 600)).unwrap();
    let short = tom.clone().truncated(300);
    assert_eq!(short.range(), (tom.range().0, tom.cut(300).triangles));
    for n in [10, 77, 299] {
        assert_eq!(short.cut(n), tom.cut(n));
        assert_eq!(faces(&short, short.cut(n)), faces(&tom, tom.cut(n)));
    }
    assert_eq!(short.error_m(300), 0.0);
}

#[test]
fn a_morph_leads_from_the_finer_cut_to_the_coarser_one() {
    let tom = ProgressiveMesh::new(&generate(Generator::Blob, 4, 600)).unwrap();
    let (fine, coarse) = (tom.cut(400), tom.cut(150));
    let mut corners = Vec::new();
    tom.resolve(fine, &mut corners);
    let moved = |share: f32| -> Vec<[Vec3; 3]> {
        corners.iter().map(|t| t.map(|i| tom.morphed(i, coarse.vertices, share).core)).collect()
    };
    assert_eq!(moved(0.0), faces(&tom, fine));
    let area = |f: &[Vec3; 3]| (f[1] - f[0]).cross(f[2] - f[0]).length();
    let set = |faces: &[[Vec3; 3]]| -> BTreeSet<Face> {
        faces.iter().filter(|f| area(f) > 0.0).map(|f| turned(*f)).collect()
    };
    // at the end of its way the finer mesh is the coarser one, face by face
    assert_eq!(set(&moved(1.0)), set(&faces(&tom, coarse)));
}

fn turned(f: [Vec3; 3]) -> Face {
    let first = (0..3).min_by_key(|&i| bits(f[i])).unwrap();
    [0, 1, 2].map(|i| bits(f[(first + i) % 3]))
}

#[test]
fn many_parts_go_one_by_one_down_to_the_last() {
    let one = generate(Generator::Seat, 0, 60);
    let mut mesh = PrimitiveMesh::default();
    for i in 0..20 {
        let first = mesh.vertices.len() as u32;
        let away = Vec3::X * (2.0 * i as f32);
        mesh.vertices.extend(one.vertices.iter().map(|v| PrimitiveVertex { core: v.core + away, ..*v }));
        mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|k| k + first)));
    }
    let tom = ProgressiveMesh::new(&mesh).unwrap();
    // twelve where the last is the box around all
    assert!(tom.range().0 <= 12, "{:?}", tom.range());
}

#[test]
fn furniture_ends_in_the_box_around_it_and_every_finer_cut_is_nearer() {
    for kind in [Generator::Seat, Generator::Table, Generator::Shelf, Generator::Door, Generator::Books] {
        for triangles in [60, 240, 1000] {
            let mesh = generate(kind, 0, triangles);
            let tom = ProgressiveMesh::new(&mesh).unwrap();
            let coarsest = faces(&tom, tom.cut(0));
            let low = mesh.vertices.iter().map(|v| v.core).reduce(Vec3::min).unwrap();
            let high = mesh.vertices.iter().map(|v| v.core).reduce(Vec3::max).unwrap();
            let volume: f32 = coarsest.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum();
            let box_m3 = (high - low).element_product();
            assert_eq!(coarsest.len(), 12, "{kind:?} {triangles}");
            // twelve triangles on the corners of a box that enclose its volume are its faces; f32: some ulp of the sum
            assert!((volume / box_m3 - 1.0).abs() < 1e-5, "{kind:?} {triangles}: {volume} of {box_m3}");
            let on_corner = |p: &Vec3| (0..3).all(|i| p[i] == low[i] || p[i] == high[i]);
            assert!(coarsest.iter().flatten().all(on_corner), "{kind:?} {triangles}");
            for n in (13..tom.range().1).filter(|&n| tom.cut(n).triangles > 12) {
                assert!(tom.error_m(n) < tom.error_m(0), "{kind:?} {triangles}: {n}");
            }
        }
    }
}

#[test]
fn an_invalid_mesh_is_refused_with_its_reason() {
    let vertex = |x: f32| PrimitiveVertex::bare(Vec3::new(x, 0.0, 0.0), Vec3::Z);
    let mesh = |vertices, triangles| PrimitiveMesh { vertices, triangles };
    assert_eq!(ProgressiveMesh::new(&PrimitiveMesh::default()), Err(ProgressiveMeshError::Empty { triangles: 0 }));
    let far = mesh(vec![vertex(0.0), vertex(1.0)], vec![[0, 1, 7]]);
    assert_eq!(
        ProgressiveMesh::new(&far),
        Err(ProgressiveMeshError::BadCorner { triangle: 0, corner: 7, vertices: 2 })
    );
    let nan = mesh(vec![vertex(0.0), vertex(f32::NAN), vertex(2.0)], vec![[0, 1, 2]]);
    assert_eq!(ProgressiveMesh::new(&nan), Err(ProgressiveMeshError::NotFinite { vertex: 1 }));
    let flat = mesh(vec![vertex(0.0), vertex(0.0), vertex(2.0)], vec![[0, 1, 2]]);
    assert_eq!(ProgressiveMesh::new(&flat), Err(ProgressiveMeshError::Empty { triangles: 1 }));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Random triangles on few points: branches, fans that cross, faces twice, both ways round.
    #[test]
    fn any_set_of_triangles_is_ordered(triangles in proptest::collection::vec([0..12_u32, 0..12, 0..12], 1..40)) {
        let place = |i: u32| Vec3::new((i % 3) as f32, (i / 3 % 2) as f32, (i / 6) as f32 + 0.1 * (i % 5) as f32);
        let vertices = (0..12).map(|i| PrimitiveVertex::bare(place(i), Vec3::Z)).collect();
        let mesh = PrimitiveMesh { vertices, triangles };
        if let Ok(tom) = ProgressiveMesh::new(&mesh) {
            for cut in all_counts(&tom) {
                for f in faces(&tom, cut) {
                    prop_assert!(f[0] != f[1] && f[1] != f[2] && f[2] != f[0]);
                }
            }
        }
    }
}

#[test]
fn cuts_below_the_floor_are_the_floor() {
    let tom = ProgressiveMesh::new(&generate(Generator::Bar, 0, 24)).unwrap().no_coarser(4);
    assert_eq!(tom.range(), (4, 24));
    assert_eq!(tom.cut(0).triangles, 4);
    assert_eq!(tom.clone().no_coarser(2).range(), (4, 24));
}

/// A cone of so many faces about a tip at (0, 0, 1) on a disc of as many about its middle.
fn cone(sides: u32) -> PrimitiveMesh {
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(sides);
    let rim = (0..sides).map(|i| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.0));
    let points: Vec<DVec3> = [DVec3::Z, DVec3::ZERO].into_iter().chain(rim).collect();
    let side = |i: u32| [2 + i, 2 + (i + 1) % sides];
    let faces: Vec<[u32; 3]> = (0..sides).map(side).flat_map(|[a, b]| [[0, a, b], [1, b, a]]).collect();
    creased_mesh(&points, &faces)
}

#[test]
fn fans_of_ten_thousand_triangles_around_one_vertex_are_ordered() {
    // in the square of the count, let alone its cube, this would take minutes
    let sides = 20_000;
    let tom = ProgressiveMesh::new(&cone(sides)).unwrap();
    assert!(tom.range().0 <= 8 && tom.range().1 == 2 * sides, "{:?}", tom.range());
    for n in [40, 400, 4000] {
        let cut = tom.cut(n);
        let faces = faces(&tom, cut);
        assert!(n - cut.triangles <= 4 && rim(&faces).is_empty());
        // a rim of n/2 chords is off by 1 − cos(2π/n); the order is greedy, so a chord may be twice as long as another
        let sagitta = 1.0 - libm::cos(std::f64::consts::TAU / f64::from(n));
        assert!(tom.error_m(n) < 4.0 * sagitta, "{n}: {} against {sagitta}", tom.error_m(n));
    }
}

#[test]
fn thousands_of_triangles_on_one_edge_are_ordered() {
    let pages = 5000_u32;
    let angle = |i: u32| 6.0 * f64::from(i) / f64::from(pages);
    let edge = [Vec3::ZERO, Vec3::Z].into_iter();
    let ends = (0..pages).map(|i| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.5).as_vec3());
    let vertices = edge.chain(ends).map(|core| PrimitiveVertex::bare(core, Vec3::X)).collect();
    let tom = ProgressiveMesh::new(&PrimitiveMesh { vertices, triangles: (0..pages).map(|i| [0, 1, 2 + i]).collect() })
        .unwrap();
    assert_eq!(tom.range().1, pages);
    for cut in [pages, pages / 2, tom.range().0].map(|n| tom.cut(n)) {
        assert!(faces(&tom, cut).iter().all(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0]));
    }
}
