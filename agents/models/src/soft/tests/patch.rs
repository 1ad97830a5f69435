//! The patch test: a deformation that is the same all over is exact in a mesh of any shape.

use super::*;
use crate::soft::deformation::Deformation;
use crate::soft::material::{Law, Material};

/// A deformation with stretch, shear and turn.
fn deformed() -> DMat3 {
    let stretch = DMat3::from_cols_array(&[1.08, 0.03, -0.02, 0.03, 0.95, 0.04, -0.02, 0.04, 1.02]);
    DMat3::from_quat(DQuat::from_rotation_x(0.4)) * stretch
}

/// A number −1 … 1 for each vertex and axis, always the same.
fn random(vertex: usize) -> DVec3 {
    DVec3::new(1.0, 2.0, 3.0).map(|axis| libm::sin(7919.0 * (vertex as f64 + 0.37 * axis)))
}

/// Where the vertices lie once those of `held` have been moved by `of` and the others have come to rest between them, starting from where
/// they were.
fn at_rest(body: &mut SoftBody, held: &[bool], of: DMat3) -> Vec<DVec3> {
    body.mesh.held.copy_from_slice(held);
    body.system = body.mesh.system(&body.positions);
    for (at, (x, held)) in body.positions.iter_mut().zip(held).enumerate() {
        *x = of * *x + if *held { DVec3::ZERO } else { random(at) * 1e-3 };
    }
    body.velocities.fill(DVec3::ZERO);
    // a step of a second is nearly one of Newton's method for the shape at rest
    run(body, 1.0, 40);
    body.positions.clone()
}

/// Tetrahedra with inner vertices out of place.
fn distorted(law: MaterialLaw) -> SoftBody {
    let size_m = DVec3::new(0.2, 0.15, 0.1);
    let mut mesh = tetrahedra(size_m, [4, 3, 3]);
    let outside = |x: DVec3| (x.min(size_m - x)).min_element() < 1e-9;
    let cell_m = size_m / DVec3::new(4.0, 3.0, 3.0);
    for (at, point) in mesh.points.iter_mut().enumerate().filter(|(_, point)| !outside(**point)) {
        *point += random(at) * cell_m * 0.25;
    }
    let shape = SoftShape::Tetrahedra { mesh: Arc::new(mesh), regions: vec![] };
    SoftBody::new(SoftSpec { material: SoftMaterial { law, ..MATERIAL }, ..spec(shape) }).unwrap()
}

/// A ball of six-sided cells, none of them a box.
fn rounded(law: MaterialLaw) -> SoftBody {
    let shape = SoftShape::Ball { radius_m: 0.1, segments: 4 };
    SoftBody::new(SoftSpec { material: SoftMaterial { law, ..MATERIAL }, ..spec(shape) }).unwrap()
}

/// A ball in a cage whose cells it cuts.
fn caged(law: MaterialLaw) -> SoftBody {
    let surface = Arc::new(SoftShape::Ball { radius_m: 0.1, segments: 10 }.skin().unwrap());
    let shape = SoftShape::Embedded { surface, eps_m: 0.025, range_m: (0.025, 0.025) };
    SoftBody::new(SoftSpec { material: SoftMaterial { law, ..MATERIAL }, ..spec(shape) }).unwrap()
}

const LAWS: [MaterialLaw; 3] =
    [MaterialLaw::Corotational, MaterialLaw::NeoHookean, MaterialLaw::Ogden { exponent: 6.0 }];

#[test]
fn vertices_between_others_that_deform_alike_do_so_too() {
    for law in LAWS {
        for mut body in [distorted(law), rounded(law)] {
            let on_skin: Vec<u32> = body.mesh.edges.iter().flatten().copied().collect();
            let held: Vec<bool> = (0..body.positions.len() as u32).map(|vertex| on_skin.contains(&vertex)).collect();
            assert!(held.iter().filter(|held| !**held).count() > 10);
            let wanted: Vec<DVec3> = body.positions.iter().map(|x| deformed() * *x).collect();
            for (x, wanted) in at_rest(&mut body, &held, deformed()).iter().zip(wanted) {
                assert!(x.distance(wanted) < 1e-10, "{law:?}, {}: {x} {wanted}", body.model());
            }
        }
    }
}

/// Cut cells count by their volume: nodes that have whole cells alone are in balance, the skin is carried exactly, and the energy is that of the
/// volume that the surface encloses.
#[test]
fn a_cage_that_deforms_alike_all_over_carries_its_skin_and_has_the_energy_of_its_volume() {
    for law in LAWS {
        let mut body = caged(law);
        let mut held = vec![false; body.positions.len()];
        let cut = body.mesh.hexahedra.iter().filter(|cell| cell.fill < 0.999);
        cut.flat_map(|cell| cell.vertices).for_each(|vertex| held[vertex as usize] = true);
        assert!(held.iter().filter(|held| !**held).count() > 10);
        let wanted: Vec<DVec3> = body.positions.iter().map(|x| deformed() * *x).collect();
        let skin: Vec<DVec3> = body.seen().iter().map(|x| deformed() * *x).collect();
        for (x, wanted) in at_rest(&mut body, &held, deformed()).iter().zip(wanted) {
            assert!(x.distance(wanted) < 1e-10, "{law:?}: {x} {wanted}");
        }
        body.seen()
            .iter()
            .zip(skin)
            .for_each(|(x, wanted)| assert!(x.distance(wanted) < 1e-10, "{law:?}: {x} {wanted}"));
        let SoftShape::Embedded { surface, .. } = &body.spec.shape else { panic!() };
        let stretches = Deformation::of(deformed(), DQuat::from_rotation_x(0.4)).stretches;
        let wanted_j = Law::of(&body.spec.material).respond(stretches).energy * surface.volume_m3();
        assert!((body.energy_j() / wanted_j - 1.0).abs() < 1e-9, "{law:?}: {} J, {wanted_j} wanted", body.energy_j());
    }
}
