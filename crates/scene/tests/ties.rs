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
fn what_may_soon_touch_starts_in_one_cluster_unless_it_passes_through() {
    // two that touch, two that come nearer by 0.1 m in two steps of 1/60 s, and one far away
    let row = |x: f64, v: f64| {
        format!(
            "{{ name = \"{x}\", model = \"rigid\", shape = \"ball\", radius_m = 0.5, rate_hz = 60, position_m = [{x}, 0, 0], velocity_m_s = [{v}, 0, 0] }},\n"
        )
    };
    let balls = [row(0.0, 0.0), row(1.0, 0.0), row(3.0, 1.5), row(4.05, -1.5), row(9.0, 0.0)].concat();
    let started = |ties: &str| {
        let text = format!("format = 1\n{ties}\nobject = [\n{balls}]\n");
        leaders(&Source::memory("row", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap())
    };
    assert_eq!(started(""), [0, 0, 2, 2, 4]);
    assert_eq!(started("coupling = [{ a = \"0\", b = \"1\", law = \"off\" }]"), [0, 1, 2, 2, 4]);
    assert_eq!(started("world = { contacts = false }"), [0, 1, 2, 3, 4]);
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
