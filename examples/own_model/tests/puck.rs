//! The least model keeps the promises of an agent, rests on a plane and bears a box.

use metachron::models::conformance::{Suite, check};
use metachron::prelude::*;
use own_model::puck::Puck;

const HALF_M: f64 = 0.1;
const MASS_KG: f64 = 3.0;

fn puck() -> Box<dyn Agent> {
    Box::new(Puck::new(HALF_M, MASS_KG, DVec3::Z * HALF_M).expect("a cube"))
}

#[test]
fn a_puck_keeps_every_promise() {
    assert_eq!(check(&Suite::new(&puck, SimSpan::from_millis(4))), []);
}

#[test]
fn a_puck_rests_on_a_plane_and_bears_a_box() {
    let stage = Custom::new(Puck::new(HALF_M, MASS_KG, DVec3::Z * (HALF_M + 0.05)).unwrap()).rate_hz(240.0);
    let load = Rigid::cuboid([0.05; 3]).mass_kg(1.0).at([0.0, 0.0, 3.0 * HALF_M + 0.05]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("puck", stage).add("box", load).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let [puck, load] = world.objects(["puck", "box"]).unwrap();
    world.advance(SimSpan::from_millis(3000));
    let height_m = |object| world.frame().point(object, Anchor::Local(DVec3::ZERO)).unwrap().z;
    assert!((height_m(puck) - HALF_M).abs() < 1e-4, "{} m high", height_m(puck));
    assert!((height_m(load) - 2.0 * HALF_M - 0.05).abs() < 2e-4, "the box {} m high", height_m(load));
}
