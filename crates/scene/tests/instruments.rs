//! Instruments on trocars, environments and generated walls, as scene files ask for them.

use glam::DVec3;
use metachron_core::SimSpan;
use metachron_geometry::Solid;
use metachron_scene::{Source, load};
use metachron_world::kinds::{EnvironmentKind, ExecutorKind};
use metachron_world::{Scene, World};

const TOOL: &str = "[[object]]\nname = \"grasper\"\nmodel = \"tool\"\n";
const KEYS: &str =
    "keyframe = [{ at_s = 0, tip_m = [0.05, 0, 0.1], jaw = 0 }, { at_s = 1, tip_m = [-0.03, 0.06, 0.15] }]\n";

fn scene(text: &str) -> Result<Scene, String> {
    let text = format!("format = 1\n{text}");
    let source = Source::memory("instruments", text.as_bytes()).map_err(|error| format!("{:?}", error.problems))?;
    load(&source, &[]).map_err(|error| {
        let said = error.problems.iter().map(|p| format!("line {}: {}; {}", p.line, p.message, p.expected));
        said.collect::<Vec<_>>().join("\n")
    })
}

#[test]
fn a_shaft_in_a_trocar_passes_through_it_while_its_tip_follows_the_script() {
    let pivot = DVec3::new(0.02, 0.01, 0.3);
    let world =
        World::start(&scene(&format!("{TOOL}pivot_m = [0.02, 0.01, 0.3]\n{KEYS}")).unwrap(), ExecutorKind::Lockstep)
            .unwrap();
    for _ in 0..12 {
        world.advance(SimSpan::from_millis(100));
        let tool = *world.latest(world.object("grasper").unwrap()).unwrap().body.tool().unwrap();
        let local = tool.rotation.conjugate() * (pivot - tool.tip);
        assert!(local.distance(DVec3::NEG_Z * tool.tip.distance(pivot)) < 1e-12, "{local}"); // rounding
    }
    let end = world.latest(world.object("grasper").unwrap()).unwrap();
    assert!(end.body.tool().unwrap().tip.distance(DVec3::new(-0.03, 0.06, 0.15)) < 1e-9);
}

#[test]
fn a_pivot_that_is_not_on_the_shaft_is_refused_with_its_place() {
    let refused = |pivot: &str| scene(&format!("{TOOL}pivot_m = {pivot}\n{KEYS}")).expect_err(pivot);
    for (pivot, why) in [
        ("[-0.03, 0.06, 0.15]", "is 0 m from the tip of keyframe 2; expected 0.025 … 0.325 m"),
        ("[0.05, 0.0, 1.1]", "is 1 m from the tip of keyframe 1"),
        ("[0.05, 0.0, inf]", "expected 3 numbers from"),
        ("[nan, 0.0, 0.0]", "expected 3 numbers from"),
    ] {
        let said = refused(pivot);
        assert!(said.starts_with("line 5: ") && said.contains(why) && !said.contains('\n'), "{pivot}: {said}");
    }
}

#[test]
fn a_scene_is_in_the_environment_that_it_names_and_else_in_a_room() {
    let environment = |text: &str| scene(&format!("{text}{TOOL}{KEYS}")).map(|scene| scene.environment);
    assert_eq!(environment(""), Ok(EnvironmentKind::Room));
    assert_eq!(environment("[world]\nenvironment = \"endoscope\"\n"), Ok(EnvironmentKind::Endoscope));
    let said = environment("[world]\nenvironment = \"cellar\"\n").unwrap_err();
    assert!(said.contains("line 3") && said.contains("endoscope"), "{said}");
}

#[test]
fn a_fixed_mesh_may_be_generated_and_has_no_file_beside_it() {
    let wall = "[[object]]\nname = \"wall\"\nmodel = \"rigid\"\nshape = \"mesh\"\nfixed = true\n";
    let made = scene(&format!("{wall}generate = \"cavity\"\ntriangles = 500\nscale = 0.1\n{TOOL}{KEYS}")).unwrap();
    let Solid::Mesh { points_m, triangles } = &made.obstacles[0].solid else { panic!("a mesh") };
    assert_eq!(triangles.len(), 512); // 16² squares
    // a bowl that is 0.1 m wide to either side, with bumps of a fiftieth, seen from within
    let wide = points_m.iter().map(|p| p.x.abs()).fold(0.0, f64::max);
    assert!((wide - 0.1).abs() < 3e-3, "{wide}");
    let inward = triangles.iter().all(|t| {
        let [a, b, c] = t.map(|i| points_m[i as usize]);
        (b - a).cross(c - a).dot(a + b + c) < 0.0
    });
    assert!(inward);
    for (keys, why) in [
        ("", "`file` of `wall` is missing"),
        ("generate = \"cavity\"\nfile = \"wall.stl\"\n", "contradicts `file`"),
        ("generate = \"cavity\"\ntriangles = 3\n", "expected a number from 4 to 100000"),
    ] {
        let said = scene(&format!("{wall}{keys}{TOOL}{KEYS}")).unwrap_err();
        assert!(said.contains(why), "{keys}: {said}");
    }
}
