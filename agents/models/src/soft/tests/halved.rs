//! Embedded solids whose cells are halved where something touches them.

use super::*;
use metachron_contact::AnchorSpring;
use metachron_contact::member::ClusterMember;
use metachron_core::{Anchor, Archive, Resolution};

const CUBE: SoftShape = SoftShape::Box { size_m: DVec3::splat(0.25), segments: [10; 3] };
const BALL: SoftShape = SoftShape::Ball { radius_m: 0.1, segments: 12 };

/// The inside of the skin of a lattice, halved where it is touched and its cells are longer than 15 mm.
fn solid_of(lattice: &SoftShape, eps_m: f64) -> SoftSpec {
    let surface = Arc::new(lattice.skin().unwrap());
    let shape = SoftShape::Embedded { surface, eps_m, range_m: (0.025, 0.2) };
    SoftSpec { eps_touched_m: Some(0.015), ..spec(shape) }
}

/// Touches a body where its skin is nearest to a point at rest, 0.3 s after its last change.
fn touch(body: &mut SoftBody, at_m: DVec3) {
    let points = body.skin.as_ref().unwrap().rest();
    let apart = |vertex: &u32| points[*vertex as usize].distance(at_m);
    let nearest = (0..points.len() as u32).min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap();
    body.note_held(Anchor::Vertex(nearest));
    body.note_pressed(&[], 0.3);
    body.adapt();
}

fn touched(spec: SoftSpec, at_m: DVec3) -> SoftBody {
    let mut body = SoftBody::new(spec).unwrap();
    touch(&mut body, at_m);
    assert!(body.mesh.hanging.len() > 10, "{}", body.mesh.hanging.len());
    body
}

/// Moves all nodes but hanging ones, which go with them, somewhere by a tenth of a millimetre.
fn way(body: &SoftBody) -> Vec<DVec3> {
    let of = |k: f64| DVec3::new(libm::sin(7.0 * k), libm::cos(3.0 * k), libm::sin(5.0 * k));
    let mut way: Vec<DVec3> = (0..body.positions.len()).map(|k| of(k as f64)).collect();
    body.system.spread(&mut way);
    way
}

#[test]
fn nodes_across_the_change_of_cells_deform_alike_with_those_around_them() {
    let stretch = DMat3::from_cols_array(&[1.08, 0.03, -0.02, 0.03, 0.95, 0.04, -0.02, 0.04, 1.02]);
    let deformed = DMat3::from_quat(DQuat::from_rotation_x(0.4)) * stretch;
    for law in [MaterialLaw::Corotational, MaterialLaw::NeoHookean, MaterialLaw::Ogden { exponent: 6.0 }] {
        let spec = SoftSpec { material: SoftMaterial { law, ..MATERIAL }, ..solid_of(&CUBE, 0.05) };
        // at a corner: nodes hang on faces, and on edges of whole cells that share no face with a halved place
        let mut body = touched(spec, DVec3::splat(0.25));
        // its cells stay as they are for a step of a second
        body.spec.eps_touched_m = None;
        let outside = |x: &DVec3| (*x - 0.125).abs().max_element() > 0.1249;
        body.mesh.held = body.mesh.rest.iter().map(outside).collect();
        let free = body.mesh.held.iter().filter(|held| !**held).count();
        assert!(free > 100, "{free} nodes");
        body.system = body.mesh.system(&body.positions);
        let wanted: Vec<DVec3> = body.positions.iter().map(|x| deformed * *x).collect();
        let off = way(&body);
        for (at, x) in body.positions.iter_mut().enumerate() {
            *x = wanted[at] + if body.mesh.held[at] { DVec3::ZERO } else { off[at] * 1e-3 };
        }
        // a step of a second is nearly one of Newton's method for the shape at rest
        run(&mut body, 1.0, 40);
        for (x, wanted) in body.positions.iter().zip(&wanted) {
            assert!(x.distance(*wanted) < 1e-10, "{law:?}: {x} {wanted}");
        }
    }
}

#[test]
fn a_halved_body_has_the_mass_of_a_whole_one_and_no_force_wherever_it_is_turned() {
    for (lattice, at_m) in [(CUBE, DVec3::ZERO), (BALL, DVec3::Z * 0.1)] {
        let whole = SoftBody::new(solid_of(&lattice, 0.05)).unwrap();
        let mut body = touched(solid_of(&lattice, 0.05), at_m);
        assert!((body.mass_kg() / whole.mass_kg() - 1.0).abs() < 1e-13);
        // the quadrature of halves is finer: their centres differ by that
        let centre = |body: &SoftBody| {
            let moments = body.mesh.rest.iter().zip(&body.mesh.mass_kg).map(|(x, mass)| *x * *mass);
            moments.sum::<DVec3>() / body.mass_kg()
        };
        assert!(centre(&body).distance(centre(&whole)) < 1e-4, "{} {}", centre(&body), centre(&whole));
        let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.2);
        assert!(body.set_motion(&SetMotion { rotation: Some(rotation), ..SetMotion::default() }));
        body.assemble(0.01);
        let most = body.system.forces.iter().map(|force| force.length()).fold(0.0, f64::max);
        assert!(most < 1e-9 && body.energy_j() < 1e-12, "{most} N, {} J", body.energy_j());
    }
}

#[test]
fn forces_across_the_change_of_cells_are_minus_the_slope_of_the_energy_and_have_no_torque() {
    let mut body = touched(solid_of(&BALL, 0.05), DVec3::new(0.07, 0.0, 0.07));
    for (v, x) in body.velocities.iter_mut().zip(&body.positions) {
        *v = DVec3::new(x.y - 3.0 * x.x, 2.0 * x.z + x.x, x.x * x.y * 20.0);
    }
    body.hang();
    run(&mut body, 0.005, 5);
    body.assemble(0.01);
    let force = body.system.forces.clone();
    let size: f64 = force.iter().map(|f| f.length()).sum();
    let torque: DVec3 = force.iter().zip(&body.positions).map(|(f, x)| x.cross(*f)).sum();
    assert!(size > 0.1 && force.iter().sum::<DVec3>().length() < 1e-12 * size && torque.length() < 1e-11 * size);
    let way = way(&body);
    let at = |by: f64| -> Vec<DVec3> { body.positions.iter().zip(&way).map(|(x, way)| *x + *way * by).collect() };
    let slope = (body.mesh.energy_j(&at(1e-7)) - body.mesh.energy_j(&at(-1e-7))) / 2e-7;
    let wanted: f64 = force.iter().zip(&way).map(|(f, way)| -f.dot(*way)).sum();
    // central differences of second order in 1e-7, rounding of energies near 0.1 J
    assert!((slope - wanted).abs() < 1e-5 * size, "{slope} {wanted}");
}

/// Where the ball is touched in turn.
fn places() -> [DVec3; 7] {
    let all = [
        [1.0, 0.0, 0.0],
        [0.8, 0.5, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, -1.0, 0.2],
        [-0.7, 0.3, -0.7],
        [0.0, 0.1, -1.0],
        [0.6, 0.6, 0.6],
    ];
    all.map(|place| DVec3::from_array(place).normalize() * 0.1)
}

#[test]
fn six_hundred_changes_by_touches_and_spacings_keep_mass_and_momentum_and_never_add_energy() {
    let mut body = SoftBody::new(solid_of(&BALL, 0.05)).unwrap();
    for (v, x) in body.velocities.iter_mut().zip(&body.positions) {
        *v = DVec3::new(x.y - 3.0 * x.x, 2.0 * x.z + x.x, x.x * x.y * 20.0) + DVec3::splat(0.3);
    }
    let (mass, linear) = (body.mass_kg(), body.momentum().0);
    let (mut highest, mut nodes) = (body.energy_j(), vec![]);
    for change in 0..600 {
        let (before, energy) = (body.momentum().0, body.energy_j());
        if change % 4 == 3 {
            body.set_resolution(Resolution { eps_m: [0.05, 0.04, 0.067, 0.1][change / 4 % 4], n: 0 });
        } else if change % 7 == 0 {
            // all that was touched is let go
            body.note_pressed(&[], 1.1);
            body.adapt();
        } else {
            touch(&mut body, places()[change % 7]);
        }
        nodes.push(body.nodes());
        assert!((body.mass_kg() / mass - 1.0).abs() < 1e-12);
        assert!(body.momentum().0.distance(before) < 1e-12 * mass, "change {change}: momentum");
        assert!(body.energy_j() <= energy + 1e-9 * highest, "change {change}: {} J of {energy}", body.energy_j());
        run(&mut body, 1.0 / 120.0, 2);
        highest = highest.max(energy);
        assert!(body.energy_j() <= highest * (1.0 + 1e-6), "change {change}: {} J after a step", body.energy_j());
    }
    assert!(body.momentum().0.distance(linear) < 1e-9 * mass);
    let changes = nodes.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(changes > 400, "{changes} changes");
}

#[test]
fn cells_are_whole_again_a_second_after_the_last_touch_and_change_four_times_a_second_at_most() {
    let mut body = SoftBody::new(solid_of(&BALL, 0.05)).unwrap();
    let (vertex, whole, h_s) = (Anchor::Vertex(0), body.nodes(), 0.01);
    let mut changed_s = vec![];
    for step in 0..250 {
        let before = body.nodes();
        if step < 100 {
            // it goes on from place to place
            let Anchor::Vertex(first) = vertex else { panic!() };
            body.note_held(Anchor::Vertex(first + step / 5));
        }
        run(&mut body, h_s, 1);
        if body.nodes() != before {
            changed_s.push(f64::from(step + 1) * h_s);
        }
    }
    let apart = changed_s.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    assert!(apart > 0.2499 && changed_s.len() > 3, "{changed_s:?}");
    assert!((changed_s.last().unwrap() - 2.0).abs() < 0.26 && body.nodes() == whole, "{changed_s:?}");
}

#[test]
fn a_halved_body_is_read_back_and_goes_on_to_the_bit() {
    let made = || SoftBody::new(SoftSpec { gravity: G, held: vec![Side::Bottom], ..solid_of(&BALL, 0.05) }).unwrap();
    let mut body = made();
    let mut other = made();
    for (change, place) in places().into_iter().enumerate() {
        touch(&mut body, place);
        if change == 3 {
            body.set_resolution(Resolution { eps_m: 0.04, n: 0 });
        }
        if change == 5 {
            body.remove_cells(&[3, 40, 41]).unwrap();
        }
        run(&mut body, 0.005, 3);
        let mut archive = Archive::writer();
        body.archive(&mut archive).unwrap();
        let bytes = archive.into_bytes();
        // one that is in another state, and one that is in that of the last round
        for other in [&mut made(), &mut other] {
            other.archive(&mut Archive::reader(&bytes)).unwrap();
            other.follow();
            let mut again = Archive::writer();
            other.archive(&mut again).unwrap();
            assert!(again.into_bytes() == bytes, "change {change}: other bytes");
        }
        [&mut body, &mut other].into_iter().for_each(|body| {
            body.note_held(Anchor::Vertex(change as u32));
            run(body, 0.005, 60);
        });
        assert!(body.positions == other.positions && body.velocities == other.velocities, "change {change}");
        assert!(body.seen() == other.seen(), "change {change}");
        assert_eq!((body.nodes(), body.mass_kg()), (other.nodes(), other.mass_kg()));
    }
}

#[test]
fn a_change_of_cells_leaves_the_skin_where_it_is_and_a_body_at_rest_stays_at_rest() {
    let material = SoftMaterial { young_pa: 2e4, damping_per_s: 20.0, ..MATERIAL };
    let mut body =
        SoftBody::new(SoftSpec { material, held: vec![Side::Bottom], gravity: G, ..solid_of(&CUBE, 0.05) }).unwrap();
    run(&mut body, 0.01, 300);
    let before = state(&body).positions;
    touch(&mut body, DVec3::new(0.125, 0.125, 0.25));
    let off = |body: &SoftBody| {
        let now = state(body).positions;
        now.iter().zip(&before).map(|(now, was)| now.distance(*was)).fold(0.0, f64::max)
    };
    assert!(body.mesh.hanging.len() > 10 && off(&body) < 1e-12, "{}", off(&body));
    // it sags by 4 mm; finer cells by a little more
    let unloaded = body.skin.as_ref().unwrap().rest();
    let sag = unloaded.iter().zip(&before).map(|(x, was)| x.distance(*was)).fold(0.0, f64::max);
    run(&mut body, 0.01, 60);
    assert!(off(&body) < 0.05 * sag, "{} of {sag}", off(&body));
}

#[test]
fn mass_and_momentum_of_halves_that_are_removed_are_what_went() {
    let mut body = touched(solid_of(&BALL, 0.05), DVec3::Z * 0.1);
    for (v, x) in body.velocities.iter_mut().zip(&body.positions) {
        *v = DVec3::new(x.y, x.z * 3.0, x.x) + DVec3::splat(0.3);
    }
    body.hang();
    run(&mut body, 0.002, 5);
    let (mass, momentum) = (body.mass_kg(), body.linear_momentum());
    let gone: Vec<usize> = (0..body.cells()).filter(|cell| cell % 5 == 2).collect();
    let gone = body.remove_cells(&gone).unwrap();
    assert!((body.mass_kg() + gone.mass_kg - mass).abs() < 1e-14 * mass, "{gone:?}");
    assert!((body.linear_momentum() + gone.momentum - momentum).length() < 1e-13 * momentum.length(), "{gone:?}");
    let (momentum, mut energy_j) = (body.linear_momentum(), body.energy_j());
    for _ in 0..100 {
        run(&mut body, 0.002, 1);
        assert!(body.energy_j() <= energy_j * (1.0 + 1e-7), "{} {energy_j}", body.energy_j());
        energy_j = body.energy_j();
    }
    assert!((body.linear_momentum() - momentum).length() < 1e-10 * momentum.length());
    // a body that has lost cells keeps the others as they are
    let nodes = body.nodes();
    touch(&mut body, DVec3::X * 0.1);
    assert_eq!(body.nodes(), nodes);
}

#[test]
fn an_eps_where_it_is_touched_needs_a_cage_and_a_length() {
    let fails = |spec: SoftSpec| SoftBody::new(spec).err().expect("must be refused").to_string();
    let zero = SoftSpec { eps_touched_m: Some(0.0), ..solid_of(&BALL, 0.05) };
    assert!(fails(zero).contains("ε where it is touched is 0"));
    let sheet = SoftSpec { eps_touched_m: Some(0.01), ..spec(SHEET) };
    assert!(fails(sheet).contains("a sheet without a cage"));
}

#[test]
fn a_spring_that_pulls_at_a_vertex_counts_as_a_touch() {
    let mut body = SoftBody::new(solid_of(&BALL, 0.05)).unwrap();
    let target = body.seen()[7] + DVec3::Z * 0.05;
    let (stiffness_n_m, damping_n_s_m, anchor) = (50.0, 1.0, Anchor::Vertex(7));
    let pull = AnchorSpring { by: None, anchor, target, target_velocity: DVec3::ZERO, stiffness_n_m, damping_n_s_m };
    let context = StepContext { user_springs: &[pull], ..StepContext::alone(AgentId(0), SimTime::ZERO) };
    let (mut stepper, whole) = (LoneStepper::default(), body.nodes());
    for _ in 0..30 {
        stepper.step(&mut body, dt(0.01), context).unwrap();
    }
    let halves = body.mesh.hexahedra.iter().filter(|cell| cell.kind == 1);
    let near = |cell: &crate::soft::hexahedron::Hexahedron| {
        let middle = cell.vertices.iter().map(|node| body.mesh.rest[*node as usize]).sum::<DVec3>() / 8.0;
        (middle - body.skin.as_ref().unwrap().rest()[7]).abs().max_element() < 0.1
    };
    assert!(body.nodes() > whole && halves.clone().count() > 30 && halves.clone().all(near));
}
