//! Embedded solids: the inside of a closed surface, in a cage of cells whose size may change.

use super::*;
use metachron_core::Resolution;
use metachron_geometry::Triangles;
use std::sync::Arc;

const BAR: SoftShape = SoftShape::Box { size_m: DVec3::new(0.4, 0.1, 0.1), segments: [16, 4, 4] };

fn at(eps_m: f64) -> Resolution {
    Resolution { eps_m, n: 0 }
}

/// A solid whose surface is the skin of a lattice.
fn embedded(lattice: &SoftShape, eps_m: f64, range_m: (f64, f64)) -> SoftShape {
    SoftShape::Embedded { surface: Arc::new(lattice.skin().unwrap()), eps_m, range_m }
}

/// A bar of fine skin in a cage.
fn bar(eps_m: f64) -> SoftShape {
    embedded(&BAR, eps_m, (0.0125, 0.1))
}

fn ball_shape(eps_m: f64) -> SoftShape {
    embedded(&SoftShape::Ball { radius_m: 0.1, segments: 10 }, eps_m, (0.02, 0.2))
}

/// The deepest point of a body held at its left after it has come to rest.
fn sag(shape: SoftShape, young_pa: f64, gravity: DVec3) -> f64 {
    let material = SoftMaterial { young_pa, damping_per_s: 20.0, ..MATERIAL };
    let mut body = SoftBody::new(SoftSpec { material, held: vec![Side::Left], gravity, ..spec(shape) }).unwrap();
    let start = state(&body);
    run(&mut body, 0.01, 600);
    state(&body).positions.iter().zip(&start.positions).map(|(now, was)| now.distance(*was)).fold(0.0, f64::max)
}

#[test]
fn a_cage_that_fits_a_box_sags_as_the_lattice_of_the_box_does() {
    let lattice = SoftShape::Box { size_m: DVec3::new(0.4, 0.1, 0.1), segments: [8, 2, 2] };
    let [caged, of_lattice] = [bar(0.05), lattice].map(|shape| sag(shape, 1e6, G));
    assert!((caged / of_lattice - 1.0).abs() < 1e-3, "{caged} {of_lattice}");
}

#[test]
fn mass_is_that_of_the_volume_and_free_fall_is_exact() {
    for eps_m in [0.2, 0.07, 0.03] {
        let mut body = SoftBody::new(SoftSpec { gravity: G, ..spec(ball_shape(eps_m)) }).unwrap();
        let SoftShape::Embedded { surface, .. } = &body.spec.shape else { panic!() };
        let mass = surface.volume_m3() * MATERIAL.density_kg_m3;
        assert!((body.mass_kg() / mass - 1.0).abs() < 1e-12);
        run(&mut body, 0.01, 50);
        for v in state(&body).velocities {
            assert!(v.distance(G * 0.5) < 1e-6, "{eps_m}: {v}");
        }
    }
}

#[test]
fn sixty_changes_of_spacing_a_second_keep_mass_and_momentum_and_never_add_energy() {
    let mut body = shaken_in_cage(ball_shape(0.05));
    let mass = body.mass_kg();
    let mut highest = body.energy_j();
    let (linear, angular) = body.momentum();
    let swing: f64 = angular.length().max(1e-4);
    for change in 0..600 {
        let eps_m = [0.05, 0.029, 0.04, 0.067, 0.1][change % 5];
        let (before, energy, spacing) = (body.momentum(), body.energy_j(), body.resolution().unwrap().eps_m);
        body.set_resolution(at(eps_m));
        let after = body.momentum();
        assert!((body.mass_kg() / mass - 1.0).abs() < 1e-12);
        assert!(after.0.distance(before.0) < 1e-12 * mass, "change {change}: momentum");
        let coarsest = body.resolution().unwrap().eps_m.max(spacing);
        let share = (coarsest / 0.2).powi(2);
        assert!(after.1.distance(before.1) <= share * swing, "change {change}: {} {}", after.1, before.1);
        assert!(body.energy_j() <= energy + 1e-9 * highest, "change {change}: {} J of {energy}", body.energy_j());
        run(&mut body, 1.0 / 120.0, 2);
        highest = highest.max(energy);
        assert!(body.energy_j() <= highest * (1.0 + 1e-6), "change {change}: {} J after a step", body.energy_j());
    }
    assert!(body.momentum().0.distance(linear) < 1e-9 * mass);
}

/// A solid that was stretched and turned at once by velocities of its own.
fn shaken_in_cage(shape: SoftShape) -> SoftBody {
    let mut body = SoftBody::new(spec(shape)).unwrap();
    for (v, x) in body.velocities.iter_mut().zip(&body.positions) {
        *v = DVec3::new(x.y - 3.0 * x.x, 2.0 * x.z + x.x, x.x * x.y * 20.0) + DVec3::splat(0.3);
    }
    body
}

#[test]
fn a_change_of_spacing_leaves_the_skin_where_it_is() {
    let material = SoftMaterial { young_pa: 1e6, damping_per_s: 20.0, ..MATERIAL };
    let mut body =
        SoftBody::new(SoftSpec { material, held: vec![Side::Left], gravity: G, ..spec(bar(0.0125)) }).unwrap();
    run(&mut body, 0.01, 300);
    let before = state(&body).positions;
    for (eps_m, within) in [(0.025, 1e-3), (0.05, 3e-3)] {
        body.set_resolution(at(eps_m));
        let off = state(&body).positions.iter().zip(&before).map(|(now, was)| now.distance(*was)).fold(0.0, f64::max);
        assert!(off < within, "ε {eps_m}: {off} m");
        assert!((body.resolution().unwrap().eps_m - eps_m).abs() < 1e-12);
    }
}

#[test]
fn a_ball_is_held_by_the_nodes_that_it_comes_near_to_and_by_no_others_at_any_spacing() {
    // half the finest ε: the bottom's plane is that near as far as 45.8 mm from where a ball of 0.1 m touches it
    let reach_m = ((0.1_f64 + 0.01).powi(2) - 0.1_f64.powi(2)).sqrt();
    for eps_m in [0.02, 0.029, 0.05] {
        let body = SoftBody::new(SoftSpec { held: vec![Side::Bottom], ..spec(ball_shape(eps_m)) }).unwrap();
        let bottom = body.mesh.rest.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        let nodes = body.mesh.rest.iter().zip(&body.mesh.held);
        assert!(body.mesh.held.contains(&true));
        for (x, held) in nodes {
            let beside_m = x.truncate().length();
            let may_be = x.z - bottom < 1e-9 && beside_m < reach_m * 1.05;
            let must_be = x.z - bottom < 1e-9 && beside_m < reach_m * 0.9;
            assert!(may_be || !held, "ε {eps_m}: {x} is held");
            assert!(*held || !must_be, "ε {eps_m}: {x} is not held");
        }
    }
}

#[test]
fn surfaces_without_an_inside_are_refused_with_the_reason() {
    let SoftShape::Embedded { surface, .. } = ball_shape(0.05) else { panic!() };
    let refused = |points: Vec<DVec3>, triangles: Vec<[u32; 3]>| {
        let shape = SoftShape::Embedded {
            surface: Arc::new(Triangles { points, triangles }),
            eps_m: 0.05,
            range_m: (0.05, 0.05),
        };
        SoftBody::new(spec(shape)).err().unwrap().to_string()
    };
    let (points, triangles) = (surface.points.clone(), surface.triangles.clone());
    assert!(refused(points.clone(), triangles[1..].to_vec()).contains("is not closed"));
    let inwards = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert!(refused(points.clone(), inwards).contains("inside out"));
    assert!(refused(points.clone(), vec![]).contains("no triangles"));
    assert!(refused(points.iter().map(|p| p.with_x(f64::NAN)).collect(), triangles.clone()).contains("not finite"));
    assert!(refused(points.iter().map(|p| p.with_x(0.0)).collect(), triangles.clone()).contains("no volume"));
    let fine = SoftShape::Embedded { surface, eps_m: 0.05, range_m: (1e-3, 0.05) };
    assert!(matches!(SoftBody::new(spec(fine)), Err(super::super::SoftError::FineCage { eps_m }) if eps_m == 1e-3));
}
