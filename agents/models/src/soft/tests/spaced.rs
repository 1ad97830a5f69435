//! Sheets and ropes with an ε: a fixed skin on nodes whose spacing may change.

use super::*;
use crate::conformance::{Suite, check, fall_deviation};
use crate::soft::{NodeSpacing, SoftError};
use metachron_contact::AnchorSpring;
use metachron_contact::step::LoneStepper;
use metachron_core::{Anchor, Resolution};

/// The spacings that tests go through, metres, as shares of the length of a body.
const SHARES: [f64; 5] = [1.0 / 12.0, 1.0 / 20.0, 1.0 / 8.0, 1.0 / 14.0, 1.0 / 5.0];

/// A sheet or a rope with nodes of this spacing; its skin is its lattice.
fn spaced(shape: SoftShape, eps_m: f64) -> SoftSpec {
    SoftSpec { nodes: Some(NodeSpacing { eps_m, range_m: (0.01, 1.0) }), ..spec(shape) }
}

fn fine_sheet() -> SoftShape {
    SoftShape::Sheet { size_m: [0.3, 0.2], thickness_m: 0.002, segments: [20, 14] }
}

fn fine_rope() -> SoftShape {
    SoftShape::Rope { path_m: vec![DVec3::ZERO, DVec3::X], radius_m: 0.005, segments: 40 }
}

fn both() -> [(SoftShape, f64); 2] {
    [(fine_sheet(), 0.3), (fine_rope(), 1.0)]
}

fn at(eps_m: f64) -> Resolution {
    Resolution { eps_m, n: 0 }
}

fn shaken_on(spec: SoftSpec) -> SoftBody {
    let mut body = SoftBody::new(spec).unwrap();
    let held = body.mesh.held.clone();
    for ((v, x), held) in body.velocities.iter_mut().zip(&body.positions).zip(held) {
        let bend = DVec3::new(x.y - x.x, 2.0 * x.z + x.x, libm::sin(9.0 * x.x) + 5.0 * x.x * x.y);
        *v = if held { DVec3::ZERO } else { bend * 0.3 + DVec3::splat(0.3) };
    }
    body
}

#[test]
fn the_finest_spacing_moves_as_the_lattice_itself() {
    for (shape, finest) in [(fine_sheet(), 0.015), (fine_rope(), 0.025)] {
        let mut bodies = [spaced(shape.clone(), finest), spec(shape)].map(|spec| {
            let material = SoftMaterial { young_pa: 1e6, ..MATERIAL };
            shaken_on(SoftSpec { material, gravity: G, held: vec![Side::Left], ..spec })
        });
        bodies.iter_mut().for_each(|body| run(body, 0.005, 40));
        assert_eq!(state(&bodies[0]).positions, state(&bodies[1]).positions);
    }
}

#[test]
fn a_coarse_spacing_moves_as_the_coarse_lattice_and_the_skin_lies_on_its_elements() {
    let coarse = [
        SoftShape::Sheet { size_m: [0.3, 0.2], thickness_m: 0.002, segments: [6, 4] },
        SoftShape::Rope { path_m: vec![DVec3::ZERO, DVec3::X], radius_m: 0.005, segments: 20 },
    ];
    for ((fine, eps_m), coarse) in [(fine_sheet(), 0.05), (fine_rope(), 0.05)].into_iter().zip(coarse) {
        let made = |spec: SoftSpec| shaken_on(SoftSpec { gravity: G, held: vec![Side::Left], ..spec });
        let (mut on_nodes, mut plain) = (made(spaced(fine, eps_m)), made(spec(coarse)));
        [&mut on_nodes, &mut plain].into_iter().for_each(|body| run(body, 0.005, 40));
        assert_eq!(on_nodes.positions, plain.positions);
        // distances along a coarse element are shared by the skin: the area or length of both is the same
        let measure = |body: &SoftBody| {
            let form = body.form().unwrap();
            let metachron_geometry::ShapeKind::Surface(surface) = &form.kind else { panic!() };
            let at = |i: u32| body.seen()[i as usize];
            let areas = surface.triangles.iter().map(|t| {
                let [a, b, c] = t.map(at);
                0.5 * (b - a).cross(c - a).length()
            });
            let lengths = surface.edges.iter().map(|[a, b]| at(*a).distance(at(*b)));
            if surface.triangles.is_empty() { lengths.sum::<f64>() } else { areas.sum() }
        };
        let (skin, elements) = (measure(&on_nodes), measure(&plain));
        // triangles of the skin that cross a fold of the lattice cut it short
        assert!(skin <= elements * (1.0 + 1e-12) && skin > 0.98 * elements, "{skin} {elements}");
    }
}

#[test]
fn sixty_changes_of_spacing_a_second_keep_mass_and_momentum_and_never_add_energy() {
    for (shape, length_m) in both() {
        let mut body = shaken_on(spaced(shape, SHARES[0] * length_m));
        let mass = body.mass_kg();
        let mut highest = body.energy_j();
        let (linear, angular) = body.momentum();
        let swing: f64 = angular.length();
        for change in 0..600 {
            let (before, energy, spacing) = (body.momentum(), body.energy_j(), body.resolution().unwrap().eps_m);
            body.set_resolution(at(SHARES[change % 5] * length_m));
            let after = body.momentum();
            assert!((body.mass_kg() / mass - 1.0).abs() < 1e-12);
            assert!(after.0.distance(before.0) < 1e-12 * mass, "change {change}: momentum");
            let share = (body.resolution().unwrap().eps_m.max(spacing) / length_m).powi(2);
            let off = after.1.distance(before.1);
            assert!(off <= share * swing, "{change}: {} {}", after.1, before.1);
            assert!(body.energy_j() <= energy + 1e-9 * highest, "{change}: {} J of {energy}", body.energy_j());
            run(&mut body, 1.0 / 120.0, 2);
            highest = highest.max(energy);
            assert!(body.energy_j() <= highest * (1.0 + 1e-6), "{change}: {} J after a step", body.energy_j());
        }
        assert!(body.momentum().0.distance(linear) < 1e-9 * mass);
    }
}

#[test]
fn held_under_gravity_no_change_of_spacing_leaves_more_energy_than_there_was_or_rest_has() {
    let material = SoftMaterial { young_pa: 1e6, damping_per_s: 3.0, ..MATERIAL };
    for (shape, length_m) in both() {
        let held = |eps_m| SoftSpec { material, gravity: G, held: vec![Side::Left], ..spaced(shape.clone(), eps_m) };
        // another path to the least energy that each spacing can have: steps from the start until it hangs still
        let rest_j = SHARES.map(|share| {
            let mut body = SoftBody::new(held(share * length_m)).unwrap();
            run(&mut body, 0.05, 400);
            body.energy_j()
        });
        let mut body = shaken_on(held(SHARES[0] * length_m));
        let mass = body.mass_kg();
        let scale = 9.81 * mass * length_m;
        for change in 0..600 {
            let (before, energy) = (body.momentum().0, body.energy_j());
            body.set_resolution(at(SHARES[change % 5] * length_m));
            assert!((body.mass_kg() / mass - 1.0).abs() < 1e-12);
            // momentum goes to the hold where no deformation is left to be slowed
            let deforms = body.velocities.iter().zip(&body.mesh.held).filter(|(_, held)| !**held);
            let first = deforms.clone().next().unwrap().0;
            let deforms = deforms.map(|(v, _)| v.distance(*first)).fold(0.0, f64::max);
            let off = body.momentum().0.distance(before);
            assert!(off < 1e-11 * mass || deforms < 1e-12, "change {change}: momentum {off}, {deforms} m/s");
            let most = energy.max(rest_j[change % 5]);
            // the last of ten steps from rest is half a second long: its rest of a swing of some hertz
            assert!(body.energy_j() <= most + 1e-7 * scale, "{change}: {} J of {most}", body.energy_j());
            run(&mut body, 1.0 / 120.0, 2);
        }
    }
}

#[test]
fn a_change_of_spacing_leaves_the_skin_where_it_is() {
    let material = SoftMaterial { young_pa: 1e6, damping_per_s: 20.0, ..MATERIAL };
    for (shape, length_m) in both() {
        let spec =
            SoftSpec { material, gravity: G, held: vec![Side::Left, Side::Right], ..spaced(shape, length_m / 20.0) };
        let mut body = SoftBody::new(spec).unwrap();
        run(&mut body, 0.01, 300);
        let before = state(&body).positions;
        for cells in [10.0, 5.0] {
            body.set_resolution(at(length_m / cells));
            let now = state(&body).positions;
            let off = now.iter().zip(&before).map(|(now, was)| now.distance(*was)).fold(0.0, f64::max);
            // of second order in the spacing: the sag of a piece of a hanging rope
            assert!(off < 0.5 * length_m / (cells * cells), "{} in {cells} cells: {off} m", body.model());
            assert!((body.resolution().unwrap().eps_m - length_m / cells).abs() < 1e-12);
        }
    }
}

#[test]
fn a_hand_keeps_its_vertex_of_the_skin_through_changes_of_spacing() {
    for (shape, length_m) in both() {
        let material = SoftMaterial { young_pa: 1e6, damping_per_s: 10.0, ..MATERIAL };
        let mut body = SoftBody::new(SoftSpec { material, ..spaced(shape, length_m / 20.0) }).unwrap();
        let vertex = 7;
        let target = body.seen()[vertex as usize] + DVec3::Z * 0.05;
        let (stiffness_n_m, damping_n_s_m, anchor) = (50.0, 1.0, Anchor::Vertex(vertex));
        let pull =
            AnchorSpring { by: None, anchor, target, target_velocity: DVec3::ZERO, stiffness_n_m, damping_n_s_m };
        let mut stepper = LoneStepper::default();
        for cells in [5.0, 20.0, 8.0, 3.0] {
            body.set_resolution(at(length_m / cells));
            let context = StepContext { user_springs: &[pull], ..StepContext::alone(AgentId(0), SimTime::ZERO) };
            for _ in 0..200 {
                stepper.step(&mut body, dt(0.01), context).unwrap();
            }
            let off = body.seen()[vertex as usize].distance(target);
            assert!(off < 1e-4, "{} in {cells} cells: {off} m from the hand", body.model());
        }
    }
}

#[test]
fn every_conformance_check_passes_at_every_spacing() {
    for (shape, length_m) in both() {
        let make = || {
            let made = SoftBody::new(SoftSpec { gravity: G, ..spaced(shape.clone(), length_m / 8.0) }).unwrap();
            Box::new(made) as Box<dyn Agent>
        };
        let fall = |agent: &dyn Agent, t: f64| fall_deviation(agent, G, t);
        let count = |f: &mut dyn FnMut()| allocation_counter::measure(f).count_total;
        let suite = Suite {
            steps: 60,
            closed_form: Some((&fall, 1e-11)),
            allocations: Some((&count, 0.0)),
            resolutions: [20.0, 8.0, 4.0].map(|cells| at(length_m / cells)).to_vec(),
            ..Suite::new(&make, dt(0.005))
        };
        assert_eq!(check(&suite), [], "{shape:?}");
    }
}

#[test]
fn spacings_that_cannot_be_are_refused_with_the_reason() {
    let nodes = |range_m: (f64, f64)| Some(NodeSpacing { eps_m: range_m.0, range_m });
    let fails = |spec: SoftSpec| SoftBody::new(spec).err().expect("must be refused");
    let lattice = SoftSpec { nodes: nodes((0.01, 0.1)), ..spec(solid()) };
    assert!(fails(lattice).to_string().contains("only sheets and ropes"));
    let fine = fails(SoftSpec { nodes: nodes((1e-3, 0.1)), ..spec(fine_sheet()) });
    assert!(matches!(fine, SoftError::TooFine { vertices: 60_501 }), "{fine}");
    let none = fails(SoftSpec { nodes: nodes((f64::NAN, 0.1)), ..spec(fine_rope()) });
    assert!(none.to_string().contains("ε is NaN"), "{none}");
}

#[test]
fn the_work_of_a_step_falls_by_the_power_that_the_rate_control_is_told() {
    for (shape, length_m, power) in [(fine_sheet(), 0.3, 2.5), (fine_rope(), 1.0, 1.0)] {
        let work = |cells: f64| SoftBody::new(spaced(shape.clone(), length_m / cells)).unwrap().work();
        let found = [(8.0, 16.0), (16.0, 32.0)].map(|(coarse, fine): (f64, f64)| (work(fine) / work(coarse)).log2());
        // a sheet's elements grow with the power 2, the products of its factor with 3
        assert!(found.iter().all(|found| (found - power).abs() < 0.6), "{found:?}, {power} stated");
    }
}
