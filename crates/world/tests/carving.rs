//! Cells that are removed from a body of a running world: contacts, queries and checkpoints after see the body without
//! them.

use glam::{DQuat, DVec3};
use metachron_core::{Body, SimSpan};
use metachron_geometry::{ContactTraits, ShapeKind, Solid};
use metachron_models::soft::{MaterialLaw, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Command, Custom, EventFilter, Happening, Object, Rigid, Scene, World, WorldError};
use std::sync::Arc;

/// Length of a cell, metres, and its mass, kg.
const CELL_M: f64 = 0.05;
const CELL_KG: f64 = 1000.0 * CELL_M * CELL_M * CELL_M;
/// How far the body that flies is from the others, and how fast it is.
const AWAY: DVec3 = DVec3::new(5.0, 0.0, 0.0);
const FLIES_M_S: DVec3 = DVec3::new(0.1, -0.2, 0.05);

/// A slab of 7 × 7 × 2 cells whose middle is 0.5 m above the origin.
fn slab(at: DVec3) -> SoftSpec {
    let size_m = DVec3::new(7.0, 7.0, 2.0) * CELL_M;
    SoftSpec {
        shape: SoftShape::Box { size_m, segments: [7, 7, 2] },
        nodes: None,
        eps_touched_m: None,
        material: SoftMaterial {
            young_pa: 1e5,
            poisson: 0.3,
            density_kg_m3: 1000.0,
            damping_per_s: 2.0,
            damping_s: 0.01,
            law: MaterialLaw::Corotational,
        },
        position: at + DVec3::Z * 0.5 - 0.5 * size_m,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.5,
        traits: ContactTraits::default(),
        gravity: DVec3::ZERO,
        self_contact: false,
        sleep: true,
    }
}

/// A slab held by its sides with a ball on it, one that flies, and a rope.
fn scene() -> Scene {
    let soft = |spec: SoftSpec| Custom::made_by(move |_| Box::new(SoftBody::new(spec.clone()).unwrap())).rate_hz(60.0);
    let held = vec![Side::Left, Side::Right, Side::Near, Side::Far];
    let lies = SoftSpec { held, gravity: DVec3::Z * -9.81, ..slab(DVec3::ZERO) };
    let shape = SoftShape::Rope { path_m: vec![DVec3::ZERO, DVec3::X], radius_m: 0.005, segments: 4 };
    // damping would slow it
    let undamped = SoftMaterial { damping_per_s: 0.0, ..slab(AWAY).material };
    let ball = Rigid::ball(0.03).mass_kg(0.05).at([0.0, 0.0, 0.5 + CELL_M + 0.03]).rate_hz(120.0);
    Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("slab", soft(lies))
        .add("ball", ball)
        .add("flier", soft(SoftSpec { velocity: FLIES_M_S, material: undamped, ..slab(AWAY) }))
        .add("rope", soft(SoftSpec { shape, ..slab(DVec3::Y * 9.0) }))
        .build()
        .unwrap()
}

/// The middle cells and their neighbours in both layers.
fn cross(at: DVec3) -> Command {
    let at = at + DVec3::Z * 0.5;
    Command::carve(at - DVec3::Z * CELL_M, at + DVec3::Z * CELL_M, 1.2 * CELL_M)
}

fn height_m(world: &World, ball: Object) -> f64 {
    let Body::Rigid(state) = world.latest(ball).unwrap().body else { panic!("a rigid body") };
    state.position.z
}

fn triangles(world: &World, slab: Object) -> Arc<[[u32; 3]]> {
    let ShapeKind::Surface(skin) = &world.agents().of(slab.id()).unwrap().form().unwrap().kind else {
        panic!("a skin")
    };
    Arc::clone(&skin.triangles)
}

#[test]
fn a_ball_falls_through_the_hole_and_what_went_is_booked() {
    for executor in [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool] {
        let world = World::start(&scene(), executor).unwrap();
        let [slab, ball, flier] = world.objects(["slab", "ball", "flier"]).unwrap();
        let mut events = world.events(EventFilter::states());
        world.advance(SimSpan::from_millis(300));
        let (lies_m, whole) = (height_m(&world, ball), triangles(&world, slab));
        assert!((lies_m - 0.58).abs() < 0.01, "{executor:?}: {lies_m}");
        let above = world.cast_ray(DVec3::new(0.0, 0.0, 0.7) + DVec3::X * CELL_M, -DVec3::Z, 2.0).unwrap().unwrap();
        world.command(slab, cross(DVec3::ZERO)).unwrap();
        world.command(flier, cross(AWAY + FLIES_M_S * 0.3)).unwrap();
        world.advance(SimSpan::from_millis(500));
        assert!(height_m(&world, ball) < 0.4, "{executor:?}: {}", height_m(&world, ball));
        for object in [slab, flier] {
            let removed = world.latest(object).unwrap().removed;
            assert_eq!(removed.cells, 10, "{executor:?}");
            assert!((removed.mass_kg - 10.0 * CELL_KG).abs() < 1e-12, "{executor:?}: {removed:?}");
        }
        let flown = world.latest(flier).unwrap().removed;
        assert!((flown.momentum - FLIES_M_S * 10.0 * CELL_KG).length() < 1e-12, "{executor:?}: {flown:?}");
        let told: Vec<_> = events.drain().filter(|event| matches!(event.what, Happening::Carved(_))).collect();
        assert_eq!(told.len(), 2, "{executor:?}");
        assert!(told.iter().any(|event| (event.object, event.what) == (flier, Happening::Carved(flown))));
        assert_ne!(whole, triangles(&world, slab));
        // a ray that met the slab meets the floor through the hole
        let below = world.cast_ray(DVec3::new(0.0, 0.0, 0.7) + DVec3::X * CELL_M, -DVec3::Z, 2.0).unwrap().unwrap();
        assert!(above.point_m.z > 0.5 && below.point_m.z < 0.1, "{executor:?}: {above:?} {below:?}");
    }
}

#[test]
fn the_same_cut_gives_the_same_bits_and_a_checkpoint_goes_back_before_it_and_on_after_it() {
    let ms = SimSpan::from_millis;
    let played = || {
        let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
        let slab = world.object("slab").unwrap();
        world.advance(ms(200));
        let before = world.checkpoint().unwrap();
        world.command(slab, cross(DVec3::ZERO)).unwrap();
        world.advance(ms(50));
        world.command(slab, Command::carve(DVec3::new(0.1, 0.1, 0.5), DVec3::new(0.1, 0.1, 0.5), 0.04)).unwrap();
        world.advance(ms(50));
        let after = world.checkpoint().unwrap();
        world.advance(ms(200));
        (world, before, after)
    };
    let ((one, before, after), (two, ..)) = (played(), played());
    let hash = one.hash();
    assert_eq!(hash, two.hash());
    let [slab, ball] = one.objects(["slab", "ball"]).unwrap();
    let cut = triangles(&one, slab);
    one.restore(&before).unwrap();
    one.advance(ms(400));
    assert!(height_m(&one, ball) > 0.5, "it lies on the whole slab: {}", height_m(&one, ball));
    assert_ne!(triangles(&one, slab), cut);
    one.restore(&after).unwrap();
    one.advance(ms(200));
    assert_eq!((one.hash(), triangles(&one, slab)), (hash, cut));
    let opened = World::open(&scene(), ExecutorKind::Lockstep, &after).unwrap();
    opened.advance(ms(200));
    assert_eq!(opened.hash(), hash);
}

#[test]
fn what_has_no_cells_and_what_is_no_region_is_refused() {
    let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
    let [slab, ball, rope] = world.objects(["slab", "ball", "rope"]).unwrap();
    for object in [ball, rope] {
        let error = world.command(object, cross(DVec3::ZERO)).unwrap_err();
        assert!(matches!(error, WorldError::NotTaken(_)) && error.to_string().contains("takes no carving"), "{error}");
    }
    for radius_m in [0.0, -1.0, f64::NAN] {
        let none = Command::carve(DVec3::ZERO, DVec3::ZERO, radius_m);
        assert!(matches!(world.command(slab, none), Err(WorldError::Refused { .. })), "{radius_m}");
    }
    // all of it, and nothing of it: the slab stays as it is
    world.command(slab, Command::carve(DVec3::ZERO, DVec3::ZERO, 9.0)).unwrap();
    world.command(slab, Command::carve(AWAY, AWAY, 0.1)).unwrap();
    world.advance(SimSpan::from_millis(50));
    assert_eq!(world.latest(slab).unwrap().removed.cells, 0);
    let nine = (0..9).map(|_| world.command(slab, Command::carve(AWAY, AWAY, 0.1)));
    assert_eq!(nine.filter(Result::is_err).count(), 1);
}
