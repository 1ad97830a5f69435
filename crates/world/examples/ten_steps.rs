//! Ten steps in lockstep of one tube on one box: which files do they go through? (docs/numbers.md, "Contact")

use metachron_core::SimSpan;
use metachron_geometry::Solid;
use metachron_world::{Rigid, Scene, Tube, World, kinds::ExecutorKind};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let half_extents_m = [0.1; 3].into();
    let block = Rigid::new(Solid::Box { half_extents_m }).mass_kg(1.0).at([0.0, 0.0, 0.1]);
    let tube = Tube::along(&[[-0.2, 0.0, 0.2103], [0.2, 0.0, 0.2103]]).radius_m(0.01);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("box", block).add("tube", tube).build()?;
    let world = World::start(&scene, ExecutorKind::Lockstep)?;
    world.advance(SimSpan::from_millis(100));
    ten_steps(&world);
    println!("the tube is at {:?}", world.latest(world.object("tube")?)?.body.probe(0.5));
    Ok(())
}

/// Ten steps of 60 Hz, by a name that a profiler finds.
#[inline(never)]
fn ten_steps(world: &World) {
    world.advance(SimSpan::from_millis(167));
}
