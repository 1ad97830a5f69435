//! Mass properties that a rigid object is given.

use glam::{DMat3, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::GivenInertia;
use metachron_scene::{Source, load};
use metachron_world::Spec;

fn given(keys: &str) -> Result<Option<GivenInertia>, String> {
    let text =
        format!("format = 1\n[[object]]\nname = \"a\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n{keys}");
    let source = Source::memory("inertia", text.as_bytes()).unwrap();
    let scene =
        load(&source, &[]).map_err(|error| format!("{} {}", error.problems[0].line, error.problems[0].message))?;
    let Spec::Rigid(body) = &scene.agents[0].spec else { panic!("it is not rigid") };
    Ok(body.inertia)
}

#[test]
fn six_numbers_are_the_tensor_about_the_centre_of_mass() {
    let keys = "mass_kg = 2\ncentre_of_mass_m = [0.1, 0, 0]\ninertia_kg_m2 = [3, 4, 5, 0.1, 0.2, 0.3]";
    let expected = DMat3::from_cols(DVec3::new(3.0, 0.1, 0.2), DVec3::new(0.1, 4.0, 0.3), DVec3::new(0.2, 0.3, 5.0));
    assert_eq!(given(keys), Ok(Some(GivenInertia { com_m: DVec3::X * 0.1, about_com_kg_m2: expected })));
    assert_eq!(given("mass_kg = 2"), Ok(None));
}

#[test]
fn what_no_body_has_is_refused_where_it_is() {
    for (keys, expected) in [
        ("mass_kg = 2\ninertia_kg_m2 = [1, 1, 3, 0, 0, 0]", "8 `inertia_kg_m2` of `a` cannot be had by a body"),
        ("mass_kg = 2\ninertia_kg_m2 = [1, 1, 0, 0, 0, 0]", "8 `inertia_kg_m2` of `a` cannot be had by a body"),
        ("mass_kg = 2\ninertia_kg_m2 = [1, 1, nan, 0, 0, 0]", "8 `inertia_kg_m2` of `a` cannot be had by a body"),
        ("mass_kg = 2\ncentre_of_mass_m = [0, 0, 1]", "8 `centre_of_mass_m` of `a` has no moments of inertia"),
        ("inertia_kg_m2 = [1, 1, 1, 0, 0, 0]", "7 `inertia_kg_m2` of `a` has no mass"),
    ] {
        let said = given(keys).expect_err(keys);
        assert!(said.starts_with(expected), "{said}\nis not {expected}");
    }
}

#[test]
fn the_density_of_a_compound_is_one_with_a_mass_too_and_is_reported_once() {
    for mass in ["", "mass_kg = 2\n"] {
        for density in ["-5", "0", "nan"] {
            let text = format!(
                "format = 1\n[[object]]\nname = \"a\"\nmodel = \"rigid\"\nshape = \"compound\"\n{mass}density_kg_m3 = {density}\n\
                 part = [{{ shape = \"ball\", radius_m = 0.1 }}, {{ shape = \"ball\", radius_m = 0.1, density_kg_m3 = 7, position_m = [1, 0, 0] }}]\n"
            );
            let source = Source::memory("density", text.as_bytes()).unwrap();
            let problems = load(&source, &[]).unwrap_err().problems;
            let said = &problems[0].message;
            assert!(problems.len() == 1 && said.starts_with("`density_kg_m3` of `a` is "), "{density}: {problems:?}");
        }
    }
}

/// The corners of the hull of a generated ball of half a decimetre, or its fault.
fn corners(shape: &str, keys: &str) -> Result<usize, String> {
    let text = format!(
        "format = 1\n[[object]]\nname = \"a\"\nmodel = \"rigid\"\nshape = \"{shape}\"\ngenerate = \"sphere\"\ntriangles = 8000\nscale = 0.05\n{keys}"
    );
    let source = Source::memory("hull", text.as_bytes()).unwrap();
    let scene = load(&source, &[]).map_err(|error| error.problems[0].message.clone())?;
    let Spec::Rigid(body) = &scene.agents[0].spec else { panic!("it is not rigid") };
    let Solid::Hull { points_m } = &body.solid else { return Ok(0) };
    Ok(points_m.len())
}

#[test]
fn a_hull_has_the_corners_that_its_tolerance_tells_apart() {
    let all = corners("hull", "hull_within_m = 0.0").unwrap();
    // triangles of caps of 0.1 mm and of 1 mm would need 1200 and 120 corners
    let usual = corners("hull", "").unwrap();
    let few = corners("hull", "hull_within_m = 1e-3").unwrap();
    assert!(all > 3500 && (1000..3000).contains(&usual) && (100..400).contains(&few), "{all}, {usual}, {few} corners");
    let said = corners("hull", "hull_within_m = -1.0").unwrap_err();
    assert!(said.starts_with("`hull_within_m` of `a` is -1"), "{said}");
    let said = corners("mesh", "hull_within_m = 1e-3").unwrap_err();
    assert!(said.starts_with("`hull_within_m` of `a` does not belong to a mesh"), "{said}");
}

#[test]
fn the_mass_of_a_hull_of_many_corners_is_that_of_what_it_encloses() {
    for keys in ["", "hull_within_m = 0.0\n"] {
        let text = format!(
            "format = 1\n[[object]]\nname = \"a\"\nmodel = \"rigid\"\nshape = \"hull\"\ngenerate = \"sphere\"\ntriangles = 40000\nscale = 0.5\ndensity_kg_m3 = 1000\n{keys}"
        );
        let source = Source::memory("hull", text.as_bytes()).unwrap();
        let scene = load(&source, &[]).unwrap();
        let Spec::Rigid(body) = &scene.agents[0].spec else { panic!("it is not rigid") };
        let ball_kg = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((body.mass_kg / ball_kg - 1.0).abs() < 2e-3, "{} kg with {keys}", body.mass_kg);
    }
}
