//! An app without a window whose entities follow a world in lockstep: their places, the messages that they get, the
//! springs by which they pull.

use bevy_app::{App, TaskPoolPlugin};
use bevy_asset::Assets;
use bevy_ecs::message::Messages;
use bevy_ecs::prelude::{Entity, Message};
use bevy_math::{Dir3, Vec3};
use bevy_mesh::{Indices, Mesh, Mesh3d, VertexAttributeValues};
use bevy_shape::Ray3d;
use bevy_time::{Time, TimePlugin, TimeUpdateStrategy, Virtual};
use bevy_transform::{TransformPlugin, components::GlobalTransform};
use metachron::geometry::Obstacle;
use metachron::prelude::*;
use metachron::world::static_solid;
use metachron_bevy::{
    ContactMessage, Drag, Follows, MetachronPlugin, MetachronWorld, PointerDrag, Refused, Simulated, Spring,
    StateMessage, SurfaceMesh,
};
use std::time::Duration;

const FRAME: Duration = Duration::from_micros(16_667);
const G: f64 = 9.81;

/// An app with a floor, whose frames take 1/60 s of its own time.
fn app(executor: ExecutorKind) -> App {
    let floor = Obstacle { restitution: 0.0, ..static_solid("floor", Solid::Plane) };
    let scene = Scene::builder().obstacle(floor).build().unwrap();
    let mut app = App::new();
    app.add_plugins((TaskPoolPlugin::default(), TimePlugin, TransformPlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(FRAME))
        .init_resource::<Assets<Mesh>>()
        .add_plugins(MetachronPlugin::start(&scene, executor).unwrap());
    app
}

fn ball() -> Rigid {
    Rigid::ball(0.1).mass_kg(0.5).restitution(0.0).at([0.0, 0.0, 1.0])
}

/// Lets so many seconds pass, and returns the messages of one kind that came meanwhile.
fn run<M: Message>(app: &mut App, seconds: f64) -> Vec<M> {
    let mut came = Vec::new();
    for _ in 0..(seconds / FRAME.as_secs_f64()).round() as u32 {
        app.update();
        came.extend(app.world_mut().resource_mut::<Messages<M>>().drain());
    }
    came
}

/// Where an entity is drawn.
fn place(app: &App, entity: Entity) -> Vec3 {
    app.world().get::<GlobalTransform>(entity).unwrap().translation()
}

/// Triangles and points of an entity's mesh.
fn mesh(app: &App, entity: Entity) -> (Vec<u32>, Vec<Vec3>) {
    let handle = app.world().get::<Mesh3d>(entity).unwrap();
    let mesh = app.world().resource::<Assets<Mesh>>().get(handle).unwrap();
    let Some(Indices::U32(triangles)) = mesh.indices() else { panic!("no triangles") };
    let Some(VertexAttributeValues::Float32x3(points)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
        panic!("no points")
    };
    (triangles.clone(), points.iter().map(|p| Vec3::from(*p)).collect())
}

fn ray_down(x: f32, y: f32) -> Ray3d {
    Ray3d::new(Vec3::new(x, y, 0.0), Dir3::NEG_Y)
}

#[test]
fn a_ball_falls_as_gravity_says_and_rests_on_its_radius() {
    let mut app = app(ExecutorKind::Lockstep);
    let ball = app.world_mut().spawn(Simulated::new(ball()).named("ball")).id();
    let early = run::<ContactMessage>(&mut app, 0.4);
    assert_eq!(early, []);
    let t = app.world().resource::<Time<Virtual>>().elapsed_secs_f64();
    // its newest state is led on by at most a step of 1/240 s, in which gravity adds less than 9e-5 m
    let fallen = 1.0 - G * t * t / 2.0;
    assert!((f64::from(place(&app, ball).y) - fallen).abs() < 1e-4, "{} {fallen}", place(&app, ball));
    let contacts = run::<ContactMessage>(&mut app, 1.5);
    assert!(place(&app, ball).distance(Vec3::Y * 0.1) < 1e-4, "{}", place(&app, ball));
    let [contact] = contacts[..] else { panic!("{contacts:?}") };
    assert!(contact.begins && contact.entity == Some(ball) && contact.with == Touched::Fixed(0));
    assert!(contact.normal.distance(Vec3::Y) < 1e-6 && contact.force_n.y > 0.0, "{contact:?}");
}

#[test]
fn the_mesh_of_a_soft_cube_moves_and_keeps_its_triangles() {
    let mut app = app(ExecutorKind::Lockstep);
    let cube = Soft::cuboid([0.2; 3], [2; 3]).young_pa(2e4).at([0.0, 0.0, 0.2]);
    let cube = app.world_mut().spawn((Simulated::new(cube), SurfaceMesh::default())).id();
    app.update();
    let (triangles, before) = mesh(&app, cube);
    assert!(before.iter().all(|p| (0.1 - 1e-3..0.3 + 1e-3).contains(&p.y)), "the cube is where it began");
    run::<StateMessage>(&mut app, 1.0);
    let (same, after) = mesh(&app, cube);
    assert_eq!(triangles, same);
    let lowest = |points: &[Vec3]| points.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    assert!((lowest(&before) - 0.1).abs() < 1e-3 && lowest(&after).abs() < 1e-3, "it came down to the floor");
    assert_eq!(place(&app, cube), Vec3::ZERO);
}

#[test]
fn a_mesh_has_other_triangles_when_cells_are_removed() {
    let mut app = app(ExecutorKind::Lockstep);
    let block = Soft::cuboid([0.2; 3], [3; 3]).young_pa(2e4).at([0.0, 0.0, 0.1]);
    let block = app.world_mut().spawn((Simulated::new(block).named("block"), SurfaceMesh::default())).id();
    app.update();
    let (before, _) = mesh(&app, block);
    let world = app.world().resource::<MetachronWorld>();
    // the cell at a corner: its three outer faces go, and three inner ones come
    let corner = DVec3::new(0.0667, 0.0667, 0.1667);
    world.command(world.object("block").unwrap(), Command::carve(corner, corner, 0.01)).unwrap();
    run::<StateMessage>(&mut app, 0.1);
    let (after, points) = mesh(&app, block);
    assert_ne!(before, after);
    assert!(points.iter().all(|p| p.distance(Vec3::new(0.1, 0.2, -0.1)) > 0.05), "the corner is gone");
}

#[test]
fn an_object_of_the_scene_is_followed_and_drawn_in_its_own_axes() {
    let capsule = Rigid::capsule(0.1, 0.3).at([0.0, 2.0, 1.0]).turned(DQuat::from_rotation_x(0.5)).gravity_scale(0.0);
    let scene = Scene::builder().add("capsule", capsule).build().unwrap();
    let mut app = App::new();
    app.add_plugins((TaskPoolPlugin::default(), TimePlugin, TransformPlugin))
        .init_resource::<Assets<Mesh>>()
        .add_plugins(MetachronPlugin::start(&scene, ExecutorKind::Lockstep).unwrap());
    let object = app.world().resource::<MetachronWorld>().object("capsule").unwrap();
    let entity = app.world_mut().spawn((Follows(object), SurfaceMesh::default())).id();
    app.update();
    let shown = app.world().get::<GlobalTransform>(entity).unwrap();
    assert!(shown.translation().distance(Vec3::new(0.0, 1.0, -2.0)) < 1e-6, "{shown:?}");
    assert!((shown.rotation() * Vec3::Y).distance(Vec3::new(0.0, 0.5_f32.cos(), 0.5_f32.sin())) < 1e-6);
    let (_, points) = mesh(&app, entity);
    let reach = |of: fn(&Vec3) -> f32| points.iter().map(|p| of(p).abs()).fold(0.0, f32::max);
    assert!((reach(|p| p.y) - 0.4).abs() < 1e-3 && (reach(|p| p.x) - 0.1).abs() < 1e-3, "it stands along y");
}

#[test]
fn a_pointer_lifts_a_ball_to_where_its_spring_bears_it_and_lets_it_fall() {
    let mut app = app(ExecutorKind::Lockstep);
    let ball = app.world_mut().spawn(Simulated::new(ball().at([0.0, 0.0, 0.1]))).id();
    run::<StateMessage>(&mut app, 0.1);
    let spring = Spring { stiffness_n_m: 50.0, damping_n_s_m: 10.0 };
    app.world_mut().write_message(PointerDrag::Press { ray: ray_down(0.0, 1.0), spring });
    app.update();
    // seized where the ray meets its top
    assert!(app.world().get::<Drag>(ball).unwrap().to.distance(Vec3::Y * 0.2) < 1e-4);
    app.world_mut().write_message(PointerDrag::Move { ray: ray_down(0.0, 1.5) });
    run::<StateMessage>(&mut app, 2.0);
    let hanging = 0.1 + 0.5 - 0.5 * G / spring.stiffness_n_m;
    assert!((f64::from(place(&app, ball).y) - hanging).abs() < 1e-3, "{} {hanging}", place(&app, ball));
    app.world_mut().write_message(PointerDrag::Release);
    run::<StateMessage>(&mut app, 1.5);
    assert!(app.world().get::<Drag>(ball).is_none());
    assert!((place(&app, ball).y - 0.1).abs() < 1e-3, "{}", place(&app, ball));
}

#[test]
fn a_despawned_entity_takes_its_object_with_it() {
    let mut app = app(ExecutorKind::Lockstep);
    let ball = app.world_mut().spawn(Simulated::new(ball()).named("ball")).id();
    app.update();
    let world = app.world().resource::<MetachronWorld>().clone();
    let object = world.object("ball").unwrap();
    assert_eq!(app.world().get::<Follows>(ball), Some(&Follows(object)));
    app.world_mut().despawn(ball);
    let told = run::<StateMessage>(&mut app, 0.1);
    assert!(world.object("ball").is_err());
    assert!(told.iter().any(|message| message.object == object && message.what == Happening::Gone), "{told:?}");
}

#[test]
fn what_the_world_refuses_is_told_with_its_entity() {
    let mut app = app(ExecutorKind::Lockstep);
    let drag =
        Drag { at: Anchor::Local(DVec3::ZERO), to: Vec3::Y, spring: Spring { stiffness_n_m: 1.0, damping_n_s_m: 0.0 } };
    let plate = app.world_mut().spawn((Simulated::new(ball().kinematic()).named("plate"), drag)).id();
    app.update();
    let twin = app.world_mut().spawn(Simulated::new(ball()).named("plate")).id();
    app.update();
    let refused: Vec<Refused> = app.world_mut().resource_mut::<Messages<Refused>>().drain().collect();
    let [of_drag, of_name] = &refused[..] else { panic!("{refused:?}") };
    assert_eq!((of_drag.entity, of_name.entity), (Some(plate), Some(twin)));
    assert!(of_drag.error.to_string().contains("kinematic"), "{}", of_drag.error);
    assert!(matches!(of_name.error, WorldError::SameName { .. }));
    assert!(app.world().get::<Drag>(plate).is_none() && app.world().get::<Follows>(twin).is_none());
}

#[test]
fn a_world_in_real_time_stands_and_runs_with_the_app() {
    let mut app = app(ExecutorKind::Pool);
    let world = app.world().resource::<MetachronWorld>().clone();
    let runs = |app: &mut App| {
        app.update();
        world.timeline().runs_at(world.now())
    };
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    assert!(!runs(&mut app));
    let mut time = app.world_mut().resource_mut::<Time<Virtual>>();
    time.set_relative_speed(4.0);
    time.unpause();
    assert!(runs(&mut app));
    assert_eq!(world.timeline().speed(), 4.0);
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    assert!(!runs(&mut app));
}
