//! A soft solid whose file has few triangles rests on a body by its faces, not by its corners alone.

use metachron_core::{Body, SimSpan};
use metachron_scene::{Source, load};
use metachron_world::World;
use metachron_world::kinds::ExecutorKind;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

const SCENE: &str = r#"
format = 1
object = [
    { name = "cube", model = "solid", shape = "mesh", file = "cube.obj", scale = 0.1, position_m = [0, 0, 0.0001], eps_m = 0.05,
      young_pa = 3e4, poisson = 0, density_kg_m3 = 1000, damping_per_s = 10, rate_hz = 60, sleep = false },
    { name = "floor", model = "rigid", shape = "plane" },
]
"#;

#[test]
fn a_soft_cube_of_six_faces_sinks_by_its_weight_and_not_through_the_floor() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cube.obj"), CUBE).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, SCENE).unwrap();
    let scene = load(&Source::open(path.to_str().unwrap()).unwrap(), &[]).unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(1500));
    let state = world.latest(world.object("cube").unwrap()).unwrap();
    let Body::Soft(soft) = &state.body else { panic!("a soft body") };
    // the points of the file come first, the top ones last among them
    let top_m = soft.positions[4..8].iter().map(|x| 0.25 * x.z).sum::<f64>();
    // a column of this height sinks by ρ g l²/2E; free sides change that by some tenths
    let (sank, wanted) = (0.1 - top_m, 1000.0 * 9.81 * 0.01 / (2.0 * 3e4));
    assert!((0.8..1.5).contains(&(sank / wanted)), "it sank by {sank} m, {wanted} m wanted");
}
