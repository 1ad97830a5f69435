//! Kinematic objects as scene files ask for them.

use glam::{DQuat, DVec3};
use metachron_core::{Body, SimSpan};
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};

const PLATE: &str =
    "[[object]]\nname = \"plate\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.2, 0.2, 0.01]\n";

fn scene(text: &str) -> Result<Scene, String> {
    let text = format!("format = 1\n{text}");
    let source = Source::memory("kinematic", text.as_bytes()).map_err(|error| format!("{:?}", error.problems))?;
    load(&source, &[]).map_err(|error| {
        let said = error.problems.iter().map(|p| format!("line {}: {}; {}", p.line, p.message, p.expected));
        said.collect::<Vec<_>>().join("\n")
    })
}

#[test]
fn keyframes_of_a_file_lead_an_object_and_each_copy_of_it() {
    let keys = "kinematic = true\nrotation_deg = [0, 0, 90]\ngrid = [2, 1, 1]\nspacing_m = [1, 0, 0]\nkeyframe = [{ position_m = [0, 0, 1] }, \
                { at_s = 0.5, position_m = [0, 0, 1.5], rotation_deg = [0, 0, 180] }]\n";
    let world = World::start(&scene(&format!("{PLATE}{keys}")).unwrap(), ExecutorKind::Lockstep).unwrap();
    let pose = |name: &str| {
        let Body::Rigid(state) = world.latest(world.object(name).unwrap()).unwrap().body else { panic!("rigid") };
        (state.position, state.rotation)
    };
    let turned = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
    for (ms, z, degrees) in [(0, 1.0, 90.0), (600, 1.5, 180.0)] {
        world.advance(SimSpan::from_millis(ms));
        for (name, x) in [("plate-0", 0.0), ("plate-1", 1.0)] {
            let (position, rotation) = pose(name);
            // the first step is made when it starts
            assert!(position.distance(DVec3::new(x, 0.0, z)) < 1e-3, "{name}: {position}");
            assert!(rotation.angle_between(turned(degrees)) < 1e-2, "{name}: {rotation}");
        }
    }
}

#[test]
fn what_contradicts_a_kinematic_object_is_refused_with_its_place() {
    for (keys, why) in [
        ("repeat = true\n", "line 7: `repeat`"),
        ("keyframe = [{ position_m = [0, 0, 0] }]\n", "expected `kinematic = true`"),
        ("kinematic = true\nvelocity_m_s = [1, 0, 0]\n", "line 8: `velocity_m_s`"),
        ("kinematic = true\nfixed = true\n", "moves an object that is fixed"),
        (
            "kinematic = true\nkeyframe = [{ position_m = [0, 0, 0] }, { at_s = 0, position_m = [0, 0, 1] }]\n",
            "expected a time after the keyframe before, 0 s",
        ),
        ("kinematic = true\nkeyframe = [{ position_m = [0, 0, nan] }]\n", "line 8"),
        ("kinematic = true\nlock_rotation = [\"x\"]\n", "line 8: `lock_rotation`"),
        ("kinematic = true\ngravity_scale = 2\n", "has no effect on a kinematic object"),
        ("fixed = true\nlinear_damping_per_s = 2\n", "has no effect on an object that is fixed"),
        ("[[sensor]]\nname = \"f\"\nkind = \"contact-force\"\nobject = \"plate\"\nwith = \"plate\"\n", "`with`"),
        ("kinematic = true\n[[joint]]\nkind = \"fixed\"\na = \"plate\"\nb = \"world\"\n", "is moved by no force"),
    ] {
        let said = scene(&format!("{PLATE}{keys}")).expect_err(keys);
        assert!(said.contains(why) && !said.contains('\n'), "{keys}: {said}");
    }
}

/// A ball that falls onto a kinematic plate, in a pair by `law`: by how much it is above the plate's middle once it lies there, metres.
fn height_on_a_plate(keys: &str, law: &str) -> f64 {
    let text = format!(
        "{PLATE}kinematic = true\n{keys}\n\
         [[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.05\nposition_m = [0, 0, 0.1]\n\
         [[coupling]]\na = \"plate\"\nb = \"ball\"\nkind = \"contact\"\n{law}\n"
    );
    let world = World::start(&scene(&text).unwrap(), ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(1500));
    let [plate, ball] = ["plate", "ball"].map(|name| {
        let Body::Rigid(state) = world.latest(world.object(name).unwrap()).unwrap().body else { panic!("rigid") };
        state.position.z
    });
    ball - plate
}

#[test]
fn a_kinematic_object_carries_what_has_a_clock_of_its_own() {
    let rises = "keyframe = [{ position_m = [0, 0, 0] }, { at_s = 2, position_m = [0, 0, 1] }]";
    for keys in ["", rises] {
        for law in ["law = \"ledger\"", "law = \"tlm\"\nstiffness_n_m = 20000\ndamping_n_s_m = 50"] {
            let height_m = height_on_a_plate(keys, law);
            // its radius and half the plate's thickness; it falls 3.7 mm in the step of 4 ms after which a line begins to answer
            assert!((height_m - 0.06).abs() < 4e-3, "{keys} {law}: {height_m} m");
        }
    }
}
