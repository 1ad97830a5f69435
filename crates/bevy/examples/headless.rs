//! A ball, a hose and a jelly that entities follow, without a window: the transforms and meshes of frames, five times a
//! second, for two seconds.
//!
//! `cargo run --example headless`. With a window `DefaultPlugins` take the place of the plugins here, and each entity gets a material.

use bevy_app::prelude::*;
use bevy_app::{ScheduleRunnerPlugin, TaskPoolPlugin};
use bevy_asset::Assets;
use bevy_ecs::prelude::*;
use bevy_math::Vec3;
use bevy_mesh::{Mesh, Mesh3d, VertexAttributeValues};
use bevy_time::common_conditions::on_timer;
use bevy_time::{Time, TimePlugin};
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use metachron::prelude::{ExecutorKind, Rigid, Scene, Soft, Solid, Tube};
use metachron_bevy::{ContactMessage, MetachronPlugin, Refused, Simulated, SurfaceMesh, to_metachron};
use std::time::Duration;

const FRAME: Duration = Duration::from_micros(16_667);
const END_S: f64 = 2.0;

#[derive(Component)]
struct Label(&'static str);

fn main() -> Result<AppExit, Box<dyn std::error::Error>> {
    let scene = Scene::builder().fixed("floor", Solid::Plane).build()?;
    Ok(App::new()
        .add_plugins((TaskPoolPlugin::default(), TimePlugin, TransformPlugin, ScheduleRunnerPlugin::run_loop(FRAME)))
        .init_resource::<Assets<Mesh>>()
        .add_plugins(MetachronPlugin::start(&scene, ExecutorKind::Lockstep)?)
        .add_systems(Startup, spawn)
        .add_systems(Update, (show.run_if(on_timer(Duration::from_millis(200))), listen, end))
        .run())
}

fn spawn(mut commands: Commands<'_, '_>) {
    let at = |x: f32, y: f32, z: f32| to_metachron(Vec3::new(x, y, z)).to_array();
    let ball = Rigid::ball(0.05).mass_kg(0.2).at(at(0.0, 0.8, 0.0));
    let hose = Tube::along(&[at(-0.3, 0.4, 0.0), at(0.3, 0.4, 0.0)]).radius_m(0.02).young_pa(3e5).clamp([true, true]);
    let jelly = Soft::ball(0.06, 4).young_pa(2e4).at(at(0.5, 0.3, 0.0));
    commands.spawn((Label("ball"), Simulated::new(ball)));
    commands.spawn((Label("hose"), Simulated::new(hose), SurfaceMesh::default()));
    commands.spawn((Label("jelly"), Simulated::new(jelly), SurfaceMesh::default()));
}

/// Prints how high the origin of each entity is, and the highest and lowest point of each mesh, metres.
fn show(
    time: Res<'_, Time>,
    meshes: Res<'_, Assets<Mesh>>,
    drawn: Query<'_, '_, (&Label, &Transform, Option<&Mesh3d>)>,
) {
    print!("{:.2} s", time.elapsed_secs());
    for (label, transform, mesh) in &drawn {
        let mesh = mesh.and_then(|mesh| meshes.get(mesh)).and_then(|mesh| mesh.attribute(Mesh::ATTRIBUTE_POSITION));
        match mesh {
            Some(VertexAttributeValues::Float32x3(points)) => {
                let heights = || points.iter().map(|point| point[1]);
                let (low, high) = (heights().fold(f32::MAX, f32::min), heights().fold(f32::MIN, f32::max));
                print!("   {} {low:.3} to {high:.3}", label.0);
            }
            _ => print!("   {} {:.3}", label.0, transform.translation.y),
        }
    }
    println!();
}

fn listen(mut contacts: MessageReader<'_, '_, ContactMessage>, mut refused: MessageReader<'_, '_, Refused>) {
    for contact in contacts.read().filter(|contact| contact.begins) {
        println!("{:?} touches {:?} with {:.1} N", contact.entity, contact.with_entity, contact.force_n.length());
    }
    refused.read().for_each(|refused| eprintln!("{:?}: {}", refused.entity, refused.error));
}

fn end(time: Res<'_, Time>, mut exit: MessageWriter<'_, AppExit>) {
    if time.elapsed_secs_f64() > END_S {
        exit.write(AppExit::Success);
    }
}
