//! Walls that give, as scene files ask for them.

use metachron_core::{Body, CurveState, SimSpan};
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};

const TUBE: &str = r#"format = 1
[[object]]
name = "pipe"
model = "tube"
path_m = [[-0.1, 0, 0.0095], [0.1, 0, 0.0095]]
radius_m = 0.01
wall_m = 0.001
young_pa = 1e5
density_kg_m3 = 1050
segments = 20
[[object]]
name = "brick"
model = "rigid"
shape = "box"
half_extents_m = [0.03, 0.03, 0.005]
mass_kg = 0.01
position_m = [0, 0, 0.03]
[[object]]
name = "floor"
model = "rigid"
shape = "plane"
"#;

fn scene(keys: &str) -> Result<Scene, String> {
    let text = TUBE.replacen("segments = 20\n", &format!("segments = 20\n{keys}\n"), 1);
    let source = Source::memory("pipe", text.as_bytes()).map_err(|error| format!("{:?}", error.problems))?;
    load(&source, &[]).map_err(|error| format!("{:?}", error.problems))
}

/// The pipe after half a second, and the hash of all states.
fn played(keys: &str) -> (CurveState, u64) {
    let world = World::start(&scene(keys).unwrap(), ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(500));
    let pipe = world.latest(world.object("pipe").unwrap()).unwrap();
    let Body::Curve(curve) = &pipe.body else { panic!("a tube is a curve") };
    (curve.clone(), world.hash())
}

#[test]
fn a_wall_that_gives_shows_how_a_brick_flattens_it() {
    let (given, _) = played("wall = \"gives\"");
    let flattest_m = given.flattening_m.iter().map(|flat| flat.length()).fold(0.0, f64::max);
    assert!(flattest_m > 1e-4, "{flattest_m} m");
    let (prescribed, _) = played("wall = \"prescribed\"");
    assert!(prescribed.flattening_m.is_empty() && prescribed.radii_m.iter().all(|r| *r == 0.01));
}

#[test]
fn walls_that_give_keep_lockstep_to_the_bit_and_prescribed_ones_are_the_default() {
    let wave =
        "wall = \"gives\"\nsealed = true\nperistalsis = { amplitude = 0.2, wavelength_m = 0.1, speed_m_s = 0.05 }";
    assert_eq!(played(wave).1, played(wave).1);
    assert_eq!(played("").1, played("wall = \"prescribed\"").1);
    assert_ne!(played("").1, played("wall = \"gives\"").1);
}

#[test]
fn what_a_wall_cannot_do_is_refused() {
    let said = |keys: &str| scene(keys).err().unwrap_or_default();
    assert!(said("sealed = true").contains("a `wall_m` below `radius_m`"), "{}", said("sealed = true"));
    let explicit = "wall = \"gives\"\nintegrator = \"xpbd\"\nsubsteps = 500";
    assert!(said(explicit).contains("has no steps for"), "{}", said(explicit));
    assert!(said("wall = \"giving\"").contains("gives"), "{}", said("wall = \"giving\""));
}

#[test]
fn pressure_over_time_widens_the_pipe_by_lames_law() {
    let per_pa_m = 0.009_f64.powi(2) * 0.01 * (2.0 - 0.45) / (1e5 * (0.01_f64.powi(2) - 0.009_f64.powi(2)));
    let scene = scene("wall = \"gives\"\npressure_pa = [[0, 0], [0.3, 400]]").unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let pipe = world.object("pipe").unwrap();
    for (wanted_pa, after_ms) in [(200.0, 150), (400.0, 1350)] {
        world.advance(SimSpan::from_millis(after_ms));
        let Body::Curve(curve) = &world.latest(pipe).unwrap().body else { panic!("a tube is a curve") };
        // the end, which the brick does not touch; a wall of soft tissue follows within milliseconds
        let off = (curve.radii_m[0] - 0.01) / (wanted_pa * per_pa_m) - 1.0;
        assert!(off.abs() < 0.05, "{off} of {wanted_pa} Pa");
    }
}

#[test]
fn a_pressure_out_of_range_or_out_of_order_is_refused_where_it_stands() {
    for (value, words) in [
        ("-1", &["pressure_pa", "0 to 10000000 Pa"][..]),
        ("[]", &["pressure_pa", "has 0 entries"]),
        ("[[0, 1], [2, 1e9]]", &["text: \"1e9\"", "0 to 10000000 Pa"]),
        ("[[0, 1], [2, 1], [2, 3]]", &["is 2", "column: 33", "after the one before, 2 s"]),
        ("[[-1, 1]]", &["text: \"-1\"", "0 to 1000000 s"]),
        ("[0, 1]", &["[[0.0, 0.0], [1.0, 4000.0]]"]),
        ("\"high\"", &["[[0.0, 0.0], [1.0, 4000.0]]"]),
    ] {
        let said = scene(&format!("pressure_pa = {value}")).map(|_| value).unwrap_err();
        words.iter().for_each(|word| assert!(said.contains(word), "{value}: {word} is not in {said}"));
    }
}
