//! Forces of users on soft bodies: bodies that know how they answer, and bodies that leave it to the problem of their
//! cluster, both gain the impulse that was given.

use glam::{DQuat, DVec3};
use metachron_core::{Anchor, SimSpan};
use metachron_scene::{Source, load};
use metachron_world::Command;
use metachron_world::World;
use metachron_world::kinds::ExecutorKind;

/// A cube of soft matter that floats, with so many vertices along each edge.
fn cube(cells: u32) -> World {
    let text = format!(
        "format = 1\n[world]\ngravity_m_s2 = [0.0, 0.0, 0.0]\n[[object]]\nname = \"jelly\"\nmodel = \"solid\"\nshape = \"box\"\n\
         size_m = [0.1, 0.1, 0.1]\nsegments = [{cells}, {cells}, {cells}]\nyoung_pa = 2.0e4\npoisson = 0.4\n\
         density_kg_m3 = 1000.0\nrate_hz = 120.0\n"
    );
    let source = Source::memory("jelly", text.as_bytes()).unwrap();
    World::start(&load(&source, &[]).unwrap(), ExecutorKind::Lockstep).unwrap()
}

#[test]
fn a_force_on_a_vertex_moves_the_whole_body() {
    for cells in [3, 8] {
        let world = cube(cells);
        let jelly = world.object("jelly").unwrap();
        world.command(jelly, Command::force(Anchor::Vertex(0), DVec3::Z * 0.5).for_ms(200)).unwrap();
        world.command(jelly, Command::impulse(Anchor::Vertex(1), DVec3::X * 0.03)).unwrap();
        world.advance(SimSpan::from_millis(300));
        let centre = |world: &World| {
            let state = world.latest(jelly).unwrap();
            let metachron_core::Body::Soft(soft) = &state.body else { panic!("a soft body") };
            (soft.positions.iter().sum::<DVec3>() / soft.positions.len() as f64, state.moment())
        };
        // it swings, but its middle goes on evenly: v = (F t + J) / m with 1 kg
        let before = centre(&world);
        world.advance(SimSpan::from_millis(2000));
        let after = centre(&world);
        let velocity = (after.0 - before.0) / after.1.secs_after(before.1);
        let expected = DVec3::new(0.03, 0.0, 0.1);
        assert!((velocity - expected).length() < 0.01, "{cells} cells: {velocity} instead of {expected}");
    }
}

#[test]
fn a_soft_body_is_moved_without_a_strain() {
    let world = cube(3);
    let jelly = world.object("jelly").unwrap();
    world.command(jelly, Command::teleport(DVec3::X, DQuat::from_rotation_z(1.0))).unwrap();
    world.command(jelly, Command::velocity(DVec3::ZERO, DVec3::ZERO)).unwrap();
    world.advance(SimSpan::from_millis(100));
    let state = world.latest(jelly).unwrap();
    assert!(state.energy_j.abs() < 1e-9, "{} J", state.energy_j);
    let corner = state.body.point(Anchor::Vertex(0)).unwrap().0;
    let at_start = DQuat::from_rotation_z(-1.0) * (corner - DVec3::X);
    assert!((at_start.abs() - DVec3::splat(0.05)).length() < 1e-9, "{at_start}");
    let torque = Command::torque(Anchor::Vertex(0), DVec3::Z);
    assert!(world.command(jelly, torque).unwrap_err().to_string().contains("torque"));
}
