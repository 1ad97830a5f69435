//! The mechanics of a soft body, against closed forms.

mod beam;
mod embedded;
mod error;
mod halved;
mod large;
mod materials;
mod patch;
mod promises;
mod removal;
mod seen;
mod skins;
mod spaced;
mod statics;

use super::{MaterialLaw, RegionMaterial, Side, SoftBody, SoftError, SoftMaterial, SoftShape, SoftSpec};
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, SetMotion, StepContext};
use metachron_core::{AgentId, Body, SimSpan, SimTime, Snapshot, SoftState};
use metachron_geometry::{ContactTraits, ShapeKind, Tetrahedra, Triangles};
use std::sync::Arc;

const MATERIAL: SoftMaterial = SoftMaterial {
    young_pa: 1e5,
    poisson: 0.3,
    density_kg_m3: 1000.0,
    damping_per_s: 0.0,
    damping_s: 0.0,
    law: MaterialLaw::Corotational,
};
const SHEET: SoftShape = SoftShape::Sheet { size_m: [0.3, 0.2], thickness_m: 0.002, segments: [6, 4] };
const G: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// A free body in empty space.
fn spec(shape: SoftShape) -> SoftSpec {
    SoftSpec {
        shape,
        nodes: None,
        eps_touched_m: None,
        material: MATERIAL,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.5,
        traits: ContactTraits::default(),
        gravity: DVec3::ZERO,
        self_contact: false,
        sleep: false,
    }
}

fn solid() -> SoftShape {
    SoftShape::Box { size_m: DVec3::new(0.2, 0.1, 0.1), segments: [4, 2, 2] }
}

fn rope() -> SoftShape {
    SoftShape::Rope { path_m: vec![DVec3::ZERO, DVec3::X], radius_m: 0.005, segments: 20 }
}

/// A box of so many cells along each side, each of six tetrahedra about a diagonal.
fn tetrahedra(size_m: DVec3, cells: [u32; 3]) -> Tetrahedra {
    let along = cells.map(|count| count + 1);
    let number = |[i, j, k]: [u32; 3]| (k * along[1] + j) * along[0] + i;
    let places = |ends: [u32; 3]| {
        let [x, y, z] = ends;
        (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
    };
    let share =
        |place: [u32; 3]| DVec3::from_array([0, 1, 2].map(|axis| f64::from(place[axis]) / f64::from(cells[axis])));
    let points = places(along).map(|place| share(place) * size_m).collect();
    let mut corners = vec![];
    for place in places(cells) {
        for [first, second, third] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let mut at = place;
            let mut path = [number(at); 4];
            for (step, axis) in [first, second, third].into_iter().enumerate() {
                at[axis] += 1;
                path[step + 1] = number(at);
            }
            if (second + 3 - first) % 3 == 2 {
                path.swap(1, 2);
            }
            corners.push(path);
        }
    }
    Tetrahedra { points, corners, regions: vec![] }
}

fn tetrahedral() -> SoftShape {
    let mut mesh = tetrahedra(DVec3::new(0.2, 0.1, 0.1), [4, 2, 2]);
    mesh.regions = (0..mesh.corners.len() as i64).map(|at| at / 48).collect();
    let stiff =
        RegionMaterial { region: 1, material: SoftMaterial { young_pa: 3e5, density_kg_m3: 2000.0, ..MATERIAL } };
    SoftShape::Tetrahedra { mesh: Arc::new(mesh), regions: vec![stiff] }
}

/// A quarter of a cylinder along y with irregular points.
fn shell() -> SoftShape {
    let (along, around) = (5, 6);
    let point = |(i, j): (u32, u32)| {
        let inner = f64::from(u8::from(i > 0 && i < along && j > 0 && j < around));
        let shift = 0.1 * inner * libm::sin(f64::from(7 * i + 3 * j));
        let turn = (f64::from(j) + shift) / f64::from(around) * std::f64::consts::FRAC_PI_2;
        DVec3::new(0.1 * libm::sin(turn), 0.04 * (f64::from(i) + shift), 0.1 * libm::cos(turn))
    };
    let pairs = |ends: (u32, u32)| (0..ends.0).flat_map(move |i| (0..ends.1).map(move |j| (i, j)));
    let points = pairs((along + 1, around + 1)).map(point).collect();
    let triangles = pairs((along, around)).flat_map(|(i, j)| {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| (i + x) * (around + 1) + j + y);
        [[a, b, c], [a, c, d]]
    });
    let surface = Triangles { points, triangles: triangles.collect() };
    SoftShape::Shell { surface: Arc::new(surface), thickness_m: 0.002 }
}

/// Free bodies of every kind of element and law.
fn all() -> Vec<SoftSpec> {
    let shapes = [SHEET, solid(), SoftShape::Ball { radius_m: 0.1, segments: 4 }, rope(), tetrahedral(), shell()];
    let of = |law, shape| SoftSpec { material: SoftMaterial { law, ..MATERIAL }, ..spec(shape) };
    let mut all: Vec<SoftSpec> = shapes.map(spec).into();
    all.push(of(MaterialLaw::NeoHookean, solid()));
    all.push(of(MaterialLaw::NeoHookean, tetrahedral()));
    all.push(of(MaterialLaw::Ogden { exponent: 6.0 }, solid()));
    all
}

fn dt(seconds: f64) -> SimSpan {
    SimSpan::from_secs_f64(seconds).unwrap()
}

/// Steps a body alone for so many steps.
fn run(body: &mut SoftBody, dt_s: f64, steps: u32) {
    let mut stepper = LoneStepper::default();
    for _ in 0..steps {
        stepper.step(body, dt(dt_s), StepContext::alone(AgentId(0), SimTime::ZERO)).unwrap();
    }
}

fn state(body: &SoftBody) -> SoftState {
    let mut snapshot = Snapshot::default();
    body.write_snapshot(&mut snapshot);
    match snapshot.body {
        Body::Soft(soft) => soft,
        other => panic!("{other:?}"),
    }
}

/// A body that was stretched and sheared at once by velocities of its own, without momentum.
fn shaken(spec: SoftSpec) -> SoftBody {
    let mut body = SoftBody::new(spec).unwrap();
    for (v, x) in body.velocities.iter_mut().zip(&body.positions) {
        *v = DVec3::new(x.y - 3.0 * x.x, 2.0 * x.z + x.x, x.x * x.y * 20.0) + DVec3::splat(0.3);
    }
    body
}

#[test]
fn a_body_at_rest_without_loads_stays_as_it_was() {
    for spec in all() {
        let mut body = SoftBody::new(SoftSpec { rotation: DQuat::from_rotation_y(0.4), ..spec }).unwrap();
        let before = state(&body);
        run(&mut body, 0.01, 50);
        for (now, was) in state(&body).positions.iter().zip(&before.positions) {
            assert!(now.distance(*was) < 1e-12, "{now} {was}"); // rounding of lengths near 1 m
        }
        assert!(body.energy_j().abs() < 1e-12);
    }
}

#[test]
fn a_free_body_falls_and_keeps_its_shape() {
    for spec in all() {
        let mut body = SoftBody::new(SoftSpec { gravity: G, velocity: DVec3::X, ..spec }).unwrap();
        let before = state(&body);
        run(&mut body, 0.005, 100);
        // the last velocity moves each step: half a step's fall beyond the parabola
        let way = DVec3::X * 0.5 + G * (0.5 * 0.5 * 0.505);
        for (now, was) in state(&body).positions.iter().zip(&before.positions) {
            assert!((*now - *was - way).length() < 1e-10, "{} {way}", *now - *was);
        }
    }
}

#[test]
fn momentum_is_kept_and_energy_never_rises_while_it_shakes() {
    for spec in all() {
        let mut body = shaken(spec);
        let (linear, angular) = body.momentum();
        let mut energy_j = body.energy_j();
        for _ in 0..200 {
            run(&mut body, 0.002, 1);
            // one linear solve a step: the rest by the forces' curvature is far below the loss of a step
            assert!(body.energy_j() <= energy_j * (1.0 + 1e-7), "{} {energy_j}", body.energy_j());
            energy_j = body.energy_j();
        }
        let (now, turned) = body.momentum();
        assert!((now - linear).length() < 1e-11 * linear.length(), "{now} {linear}"); // rounding of a stiff solve
        // the implicit step damps the turning too: of first order in the step
        assert!((turned - angular).length() < 0.3 * angular.length().max(1e-4), "{turned} {angular}");
    }
}

/// A body that is bent and moves, with the forces of its elements there.
fn bent(spec: SoftSpec) -> SoftBody {
    let mut body = shaken(spec);
    run(&mut body, 0.005, 5);
    let SoftBody { mesh, system, positions, .. } = &mut body;
    system.begin(0.01);
    mesh.add(positions, system);
    body
}

#[test]
fn the_forces_of_a_bent_body_have_no_sum_and_no_torque() {
    for spec in all() {
        let SoftBody { system, positions, .. } = &bent(spec);
        let size: f64 = system.forces.iter().map(|f| f.length()).sum();
        let sum: DVec3 = system.forces.iter().sum();
        let torque: DVec3 = system.forces.iter().zip(positions).map(|(f, x)| x.cross(*f)).sum();
        assert!(size > 0.1 && sum.length() < 1e-12 * size && torque.length() < 1e-11 * size, "{size} {sum} {torque}");
    }
}

#[test]
fn forces_are_minus_the_slope_of_the_energy() {
    for spec in all() {
        let mut body = bent(spec);
        let SoftBody { mesh, system, positions, .. } = &mut body;
        let force = system.forces.clone();
        let way = |k: usize| DVec3::new(libm::sin(k as f64), libm::cos(3.0 * k as f64), libm::sin(5.0 * k as f64));
        let at = |by: f64| -> Vec<DVec3> { positions.iter().enumerate().map(|(k, x)| *x + way(k) * by).collect() };
        let slope = (mesh.energy_j(&at(1e-7)) - mesh.energy_j(&at(-1e-7))) / 2e-7;
        let wanted: f64 = force.iter().enumerate().map(|(k, f)| -f.dot(way(k))).sum();
        // central differences of second order in 1e-7, rounding of energies near 0.1 J
        assert!((slope - wanted).abs() < 1e-5 * force.iter().map(|f| f.length()).sum::<f64>(), "{slope} {wanted}");
    }
}

#[test]
fn a_body_that_is_put_half_a_turn_away_is_as_relaxed_there() {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, -2.0, 3.0)];
    for (axis, shape) in axes.into_iter().flat_map(|axis| [solid(), tetrahedral()].map(|shape| (axis, shape))) {
        let rotation = DQuat::from_axis_angle(axis.normalize(), std::f64::consts::PI);
        let mut built = SoftBody::new(SoftSpec { rotation, ..spec(shape.clone()) }).unwrap();
        let mut moved = SoftBody::new(spec(shape)).unwrap();
        assert!(moved.set_motion(&SetMotion { rotation: Some(rotation), ..SetMotion::default() }));
        for body in [&mut built, &mut moved] {
            run(body, 0.005, 5);
            assert!(body.energy_j() < 1e-12, "about {axis}: {} J", body.energy_j());
        }
    }
}

#[test]
fn an_invalid_spec_is_refused_with_its_limit() {
    let fails = |spec: SoftSpec| SoftBody::new(spec).err().expect("must be refused").to_string();
    let rubber = SoftMaterial { poisson: 0.5, ..MATERIAL };
    assert!(fails(SoftSpec { material: rubber, ..spec(solid()) }).contains("0.49"));
    assert!(fails(SoftSpec { held: vec![Side::Top], ..spec(SHEET) }).contains("a sheet has no side `top`"));
    let fine = SoftShape::Ball { radius_m: 0.1, segments: 40 };
    assert!(fails(spec(fine)).contains("68921 vertices; at most 10000"));
    let point = SoftShape::Rope { path_m: vec![DVec3::X; 3], radius_m: 0.01, segments: 4 };
    assert!(fails(spec(point)).contains("two different points"));
    let bad = SoftShape::Box { size_m: DVec3::new(1.0, f64::NAN, 1.0), segments: [1; 3] };
    assert!(fails(spec(bad)).contains("the size is NaN"));
}
