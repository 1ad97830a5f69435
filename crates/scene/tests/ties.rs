//! Which agents collide, and the clusters in which they begin, as scene files ask for them.

use metachron_core::{Body, SimSpan};
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};

/// The leader of each agent before the first step.
fn leaders(scene: &Scene) -> Vec<u32> {
    let world = World::start(scene, ExecutorKind::Lockstep).unwrap();
    world.agents().iter().map(|agent| agent.led_by().unwrap_or(agent.id()).0).collect()
}

fn balls(ties: &str) -> Scene {
    let text = format!(
        "format = 1\n{ties}\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\ngrid = [6, 1, 1]\nspacing_m = [1, 1, 1]\n"
    );
    Source::memory("balls", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap()
}

#[test]
fn jointed_agents_start_in_the_cluster_of_the_lowest_id() {
    let joint = |a, b| format!("{{ kind = \"fixed\", a = \"b-{a}\", b = \"b-{b}\" }}");
    let scene = balls(&format!("joint = [{}, {}, {}]", joint(5, 3), joint(2, 1), joint(3, 2)));
    assert_eq!(leaders(&scene), [0, 1, 1, 1, 4, 1]);
}

#[test]
fn touching_bodies_start_in_one_cluster_unless_they_pass_through_each_other() {
    let row = |x: f64, more: &str| {
        format!(
            "{{ name = \"{x}\", model = \"rigid\", shape = \"ball\", radius_m = 0.5, position_m = [{x}, 0, 0]{more} }},\n"
        )
    };
    let still =
        [row(0.0, ""), row(1.0, ""), row(2.01, ""), row(3.01, ""), row(4.01, ", velocity_m_s = [1, 0, 0]")].concat();
    let started = |ties: &str| {
        let text = format!("format = 1\n{ties}\nobject = [\n{still}]\n");
        let scene = Source::memory("row", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        leaders(&scene)
    };
    assert_eq!(started(""), [0, 0, 2, 2, 2], "one that moves away too");
    assert_eq!(started("coupling = [{ a = \"0\", b = \"1\", law = \"off\" }]"), [0, 1, 2, 2, 2]);
    assert_eq!(started("world = { contacts = false }"), [0, 1, 2, 3, 4]);
}

#[test]
fn a_heap_starts_in_one_cluster_and_a_smaller_or_sparser_one_does_not() {
    let worlds = |grid: &str, spacing: &str, more: &str| {
        let text = format!(
            "format = 1\n{more}\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.1, 0.1, 0.1]\nrate_hz = 60.0\ngrid = {grid}\nspacing_m = {spacing}\n"
        );
        let scene = Source::memory("heap", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        leaders(&scene).into_iter().collect::<std::collections::BTreeSet<_>>().len()
    };
    let near = "[0.3, 0.4, 0.4]"; // rows along x: the ball around a box is 0.35 m thick
    assert_eq!(worlds("[129, 2, 1]", near, ""), 2);
    assert_eq!(worlds("[128, 2, 1]", near, ""), 256, "too small");
    assert_eq!(worlds("[129, 2, 1]", "[0.4, 0.4, 0.4]", ""), 258, "too sparse");
    assert_eq!(worlds("[129, 2, 1]", near, "[world]\ncontacts = false"), 258, "nothing touches");
}

#[test]
fn without_contacts_only_the_pairs_that_a_coupling_names_collide() {
    // three balls of one mass in a row; the first comes, without loss
    let row = |x: f64, v: f64| {
        format!(
            "{{ name = \"{x}\", model = \"rigid\", shape = \"ball\", radius_m = 0.1, mass_kg = 1, restitution = 1, position_m = [{x}, 0, 0], velocity_m_s = [{v}, 0, 0] }},\n"
        )
    };
    let balls = [row(0.0, 1.0), row(0.5, 0.0), row(1.0, 0.0)].concat();
    let speeds = |ties: &str| {
        let text =
            format!("format = 1\n{ties}\nobject = [\n{balls}]\n[world]\ngravity_m_s2 = [0, 0, 0]\ncontacts = false");
        let scene = Source::memory("row", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        world.advance(SimSpan::from_millis(2000));
        let speed = |body: &Body| if let Body::Rigid(state) = body { state.velocity.x } else { f64::NAN };
        world.agents().iter().map(|agent| speed(&agent.latest().body)).collect::<Vec<_>>()
    };
    let near = |found: Vec<f64>, wanted: [f64; 3]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(near(speeds(""), [1.0, 0.0, 0.0]), "it passes through both");
    assert!(
        near(speeds("coupling = [{ a = \"0\", b = \"1\" }]"), [0.0, 0.0, 1.0]),
        "it passes the second and meets the third"
    );
}
