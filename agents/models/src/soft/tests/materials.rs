//! Materials and meshes against closed forms: bars, beams, cylinders, buckling back from inside out.

use super::*;
use crate::soft::material::{Law, Material};

fn damped(law: MaterialLaw, poisson: f64) -> SoftMaterial {
    SoftMaterial { damping_per_s: 20.0, poisson, law, young_pa: 1e4, ..MATERIAL }
}

/// The pull P at a stretch along a bar that is free across, Pa.
fn pull(law: &Law, along: f64) -> f64 {
    let (mut low, mut high) = (0.2, 3.0);
    for _ in 0..60 {
        let across = 0.5 * (low + high);
        if law.respond([along, across, across]).slope[1] > 0.0 { high = across } else { low = across }
    }
    law.respond([along, low, low]).slope[0]
}

/// How much longer a bar hung by its end gets under its weight: P(λ(X)) = ρ g (L − X), by Simpson's rule.
fn hung_longer(material: &SoftMaterial, length_m: f64) -> f64 {
    let law = Law::of(material);
    let stretch = |pulled: f64| {
        let (mut low, mut high) = (0.5, 4.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if pull(&law, middle) > pulled { high = middle } else { low = middle }
        }
        low
    };
    let count = 40;
    let at = |i: u32| stretch(material.density_kg_m3 * 9.81 * length_m * f64::from(i) / f64::from(count)) - 1.0;
    let weight = |i: u32| if i == 0 || i == count { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    (0..=count).map(|i| weight(i) * at(i)).sum::<f64>() * length_m / (3.0 * f64::from(count))
}

#[test]
fn a_bar_hung_by_one_end_stretches_as_its_law_says() {
    let size_m = DVec3::new(0.8, 0.1, 0.1);
    for (law, least) in [
        (MaterialLaw::NeoHookean, 0.35),
        (MaterialLaw::Ogden { exponent: 6.0 }, 0.15),
        (MaterialLaw::Corotational, 0.2),
    ] {
        let material = damped(law, 0.1);
        let wanted = hung_longer(&material, size_m.x);
        assert!(wanted / size_m.x > least, "{wanted}"); // far from small strains
        let box_of = SoftShape::Box { size_m, segments: [16, 2, 2] };
        let mesh = SoftShape::Tetrahedra { mesh: Arc::new(tetrahedra(size_m, [16, 2, 2])), regions: vec![] };
        // the held end cannot grow narrow, least of all that of tetrahedra
        for (shape, most) in [(box_of, 0.015), (mesh, 0.025)] {
            let spec = SoftSpec { material, gravity: DVec3::X * 9.81, held: vec![Side::Left], ..spec(shape) };
            let mut body = SoftBody::new(spec).unwrap();
            run(&mut body, 0.01, 600);
            let ends = state(&body).positions.into_iter().zip(&body.mesh.rest).filter(|(_, rest)| rest.x == size_m.x);
            let longer = ends.map(|(now, _)| now.x - size_m.x).sum::<f64>() / 9.0;
            assert!((longer / wanted - 1.0).abs() < most, "{law:?}: {longer} {wanted}");
        }
    }
}

#[test]
fn tetrahedra_come_to_the_sag_of_a_beam_at_second_order() {
    let (length, side) = (0.4_f64, 0.1_f64);
    // w L⁴/8EI + w L²/(2 κ G A), κ = 5/6, ν = 0
    let (w, i, a) = (1000.0 * 0.981 * side * side, side.powi(4) / 12.0, side * side);
    let wanted = w * length.powi(4) / (8.0 * 1e5 * i) + w * length * length / (2.0 * 5.0 / 6.0 * 5e4 * a);
    let errors = [2, 4].map(|across| {
        let mesh = Arc::new(tetrahedra(DVec3::new(length, side, side), [4 * across, across, across]));
        let material = SoftMaterial { young_pa: 1e5, poisson: 0.0, damping_per_s: 20.0, ..MATERIAL };
        let shape = SoftShape::Tetrahedra { mesh, regions: vec![] };
        let spec = SoftSpec { material, gravity: G * 0.1, held: vec![Side::Left], ..spec(shape) };
        let mut body = SoftBody::new(spec).unwrap();
        // only the face itself is held
        body.mesh.held = body.mesh.rest.iter().map(|rest| rest.x == 0.0).collect();
        body.system = body.mesh.system(&body.positions);
        run(&mut body, 0.02, 300);
        let tip = state(&body).positions.last().unwrap().z - side;
        // how much stiffer it is than the beam
        wanted / -tip - 1.0
    });
    let order = (errors[0] / errors[1]).log2();
    assert!(errors[1] > 0.0 && errors[1] < 0.22 && order > 1.85, "{errors:?}: order {order}");
}

#[test]
fn a_strip_of_an_irregular_mesh_bends_like_a_plate() {
    // an irregular strip of triangles, held along its first two rows
    let (length, width, thickness, cells) = (0.1_f64, 0.03, 0.002_f64, [20_u32, 6_u32]);
    let point = |i: u32, j: u32| {
        let inner = f64::from(u8::from(i > 1 && i < cells[0] && j > 0 && j < cells[1]));
        let shift = 0.15 * inner * libm::sin(f64::from(5 * i + 3 * j));
        DVec3::new(
            (f64::from(i) + shift) * length / f64::from(cells[0]),
            (f64::from(j) - shift) * width / f64::from(cells[1]),
            0.0,
        )
    };
    let pairs = |ends: [u32; 2]| (0..ends[0]).flat_map(move |i| (0..ends[1]).map(move |j| (i, j)));
    let points = pairs(cells.map(|count| count + 1)).map(|(i, j)| point(i, j)).collect();
    let triangles = pairs(cells).flat_map(|(i, j)| {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| (i + x) * (cells[1] + 1) + j + y);
        if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    });
    let surface = Arc::new(Triangles { points, triangles: triangles.collect() });
    let material = SoftMaterial { young_pa: 1e8, poisson: 0.0, damping_per_s: 20.0, ..MATERIAL };
    let shape = SoftShape::Shell { surface, thickness_m: thickness };
    let mut body = SoftBody::new(SoftSpec { material, gravity: G, ..spec(shape) }).unwrap();
    let first = length / f64::from(cells[0]);
    body.mesh.held = body.mesh.rest.iter().map(|rest| rest.x < 1.5 * first).collect();
    body.system = body.mesh.system(&body.positions);
    run(&mut body, 0.02, 400);
    let tip = state(&body).positions.last().unwrap().z;
    let free = length - 0.5 * first;
    let rigidity = 1e8 * thickness.powi(3) / 12.0;
    let wanted = 1000.0 * thickness * 9.81 * free.powi(4) / (8.0 * rigidity);
    assert!((-tip / wanted - 1.0).abs() < 0.05, "{tip} {wanted}");
}

#[test]
fn what_is_turned_inside_out_comes_back() {
    for spec in all().into_iter().filter(|spec| spec.shape.model() == "solid") {
        let spec = SoftSpec { material: SoftMaterial { damping_per_s: 20.0, ..spec.material }, ..spec };
        let mut body = SoftBody::new(spec).unwrap();
        let middle = body.mesh.rest.iter().sum::<DVec3>() / body.mesh.rest.len() as f64;
        body.positions.iter_mut().for_each(|x| x.x = 2.0 * middle.x - x.x);
        run(&mut body, 0.005, 300);
        assert!(
            body.energy_j() < 1e-6,
            "{:?} {:?}: {} J",
            body.spec.shape.model(),
            body.spec.material.law,
            body.energy_j()
        );
    }
}
