//! Solids that are solved by conjugate gradients, against a factor and against the quantities that every step keeps.

use super::super::system::Purpose;
use super::*;
use metachron_contact::solve::{Response, SparseFactor};
use metachron_core::PlainLoop;

fn cube(cells: u32) -> SoftShape {
    SoftShape::Box { size_m: DVec3::splat(0.1), segments: [cells; 3] }
}

const ORGAN: SoftMaterial = SoftMaterial {
    young_pa: 12e3,
    poisson: 0.4,
    density_kg_m3: 1050.0,
    damping_per_s: 2.0,
    damping_s: 0.0,
    law: MaterialLaw::Corotational,
};

#[test]
fn gradients_give_the_velocities_of_a_factor() {
    let held = SoftSpec { material: ORGAN, gravity: G, held: vec![Side::Bottom], ..spec(cube(8)) };
    let mut body = SoftBody::new(held).unwrap();
    let mut factor = SparseFactor::default();
    for step in 0..100 {
        body.predict(0.01, Purpose::Own).unwrap();
        assert!(body.system.response().is_none(), "a factor was made");
        let moving =
            || body.system.rows().iter().enumerate().filter(|(_, row)| row.is_some()).map(|(vertex, _)| vertex);
        let mut exact: Vec<DVec3> = moving().map(|vertex| body.impulses[vertex]).collect();
        factor.factor(exact.len(), body.system.blocks(), &PlainLoop).unwrap();
        factor.respond(&mut exact);
        let off = moving().zip(&exact).map(|(vertex, exact)| body.free[vertex].distance(*exact)).fold(0.0, f64::max);
        assert!(off < 2e-6, "step {step}: {off:e} m/s off");
        let SoftBody { positions, velocities, free, .. } = &mut body;
        velocities.clone_from(free);
        positions.iter_mut().zip(&*velocities).for_each(|(x, v)| *x += *v * 0.01);
    }
    let sag_m = 0.1 - body.positions.iter().map(|at| at.z).fold(0.0, f64::max);
    assert!(sag_m > 3e-3, "it sags by {sag_m} m");
}

#[test]
fn what_is_stiff_is_factored() {
    let stiff = SoftMaterial { young_pa: 1e8, ..ORGAN };
    let mut body = SoftBody::new(SoftSpec { material: stiff, held: vec![Side::Bottom], ..spec(cube(8)) }).unwrap();
    body.predict(0.01, Purpose::Own).unwrap();
    assert!(body.system.response().is_some(), "gradients would take thousands of products");
}

#[test]
fn a_large_solid_that_wobbles_keeps_its_momentum_and_makes_no_energy() {
    let material = SoftMaterial { damping_per_s: 0.0, ..ORGAN };
    let mut body = SoftBody::new(SoftSpec { material, velocity: DVec3::X, ..spec(cube(9)) }).unwrap();
    for (v, x) in body.velocities.iter_mut().zip(&body.positions) {
        *v += DVec3::new(2.0 * x.z, -x.x, 3.0 * x.y);
    }
    let (before, mut energy_j) = (body.linear_momentum(), body.energy_j());
    for _ in 0..50 {
        run(&mut body, 2e-3, 1);
        let off = body.linear_momentum().distance(before);
        assert!(off < 1e-13 * before.length(), "momentum is off by {off:e} kg m/s");
        let now_j = body.energy_j();
        assert!(now_j <= energy_j * (1.0 + 1e-9), "{now_j} J after {energy_j}");
        energy_j = now_j;
    }
    assert!(body.system.response().is_none(), "no factor was made");
}

#[test]
fn a_large_solid_falls_as_anything_falls() {
    let mut body = SoftBody::new(SoftSpec { gravity: G, ..spec(cube(9)) }).unwrap();
    let start = body.positions.clone();
    run(&mut body, 1e-3, 100);
    let fallen = G * (0.5 * 0.1 * 0.101);
    let off = body.positions.iter().zip(&start).map(|(now, start)| now.distance(*start + fallen)).fold(0.0, f64::max);
    assert!(off < 1e-12, "{off:e} m off");
}
