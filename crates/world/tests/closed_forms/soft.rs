//! Soft bodies built in code behave as soft bodies of scene files.

use glam::{DQuat, DVec3};
use metachron_core::{Body, SimSpan};
use metachron_geometry::Solid;
use metachron_models::soft::Side;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, SceneBuildError, Soft, World};

fn vertices(world: &World, name: &str) -> Vec<DVec3> {
    let state = world.latest(world.object(name).unwrap()).unwrap();
    let Body::Soft(soft) = &state.body else { panic!("a soft body") };
    soft.positions.clone()
}

#[test]
fn a_sheet_a_cube_a_ball_and_a_rope_are_where_they_were_put_and_fall_on_the_floor() {
    let turned = DQuat::from_rotation_z(0.3);
    let scene = Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("sheet", Soft::sheet([0.2, 0.1], 0.002, [4, 2]).at([0.0, 0.0, 0.02]).turned(turned).young_pa(1e5))
        .add("cube", Soft::cuboid([0.1; 3], [2; 3]).at([0.5, 0.0, 0.06]).young_pa(1e5).damping(0.0, 0.01))
        .add("ball", Soft::ball(0.05, 4).at([1.0, 0.0, 0.06]).eps_m((0.025, 0.05)).damping(0.0, 0.01))
        .add("rope", Soft::rope(&[[1.5, 0.0, 0.4], [1.9, 0.0, 0.4]], 0.005, 8).hold(&[Side::Left]).young_pa(1e6));
    let world = World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap();
    let middle = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
    let sheet = vertices(&world, "sheet");
    // about its middle; the first step is made when it starts
    assert!(middle(&sheet).distance(DVec3::Z * 0.02) < 1e-3, "{}", middle(&sheet));
    let diagonal = sheet[sheet.len() - 1] - sheet[0];
    assert!(diagonal.distance(turned * DVec3::new(0.2, 0.1, 0.0)) < 1e-4, "{diagonal}");
    for (name, x) in [("cube", 0.5), ("ball", 1.0)] {
        assert!(middle(&vertices(&world, name)).distance(DVec3::new(x, 0.0, 0.06)) < 2e-3, "{name}");
    }
    world.advance(SimSpan::from_millis(1500));
    for name in ["sheet", "cube", "ball"] {
        let points = vertices(&world, name);
        let low = points.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        assert!((-1e-4..2e-3).contains(&low), "{name}: {low}");
    }
    let rope = vertices(&world, "rope");
    assert!(rope[0].distance(DVec3::new(1.5, 0.0, 0.4)) < 1e-12 && rope[8].z < 0.3, "{} {}", rope[0], rope[8]);
}

#[test]
fn a_spacing_that_no_step_can_take_is_refused_by_the_name_of_the_part() {
    let sheet = Soft::sheet([1.0, 1.0], 0.002, [1, 1]).eps_m((1e-4, 0.1));
    let error = Scene::builder().add("cloth", sheet).build().unwrap_err();
    assert_eq!(error, SceneBuildError::TooFine { name: "cloth".to_owned() });
}
