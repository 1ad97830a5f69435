//! Which agents collide, and the clusters in which they begin, as scene files ask for them.

use metachron_core::{AgentId, AttachmentEventKind, AttachmentId, Body, SimSpan};
use metachron_scene::{SceneError, Source, load};
use metachron_world::couplings::CouplingKind;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, Spec, World};

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
    // the contact of an impact without loss gives way by 2 µm/s
    let near = |found: Vec<f64>, wanted: [f64; 3]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 2e-6);
    assert_eq!(speeds(""), [1.0, 0.0, 0.0], "it passes through both");
    assert!(
        near(speeds("coupling = [{ a = \"0\", b = \"1\" }]"), [0.0, 0.0, 1.0]),
        "it passes the second and meets the third"
    );
}

/// A ball of 1 kg and a post; the tests add the joint or link that holds the ball, and a tube where they need one.
const HELD: &str = r#"format = 1
object = [
    { name = "ball", model = "rigid", shape = "ball", radius_m = 0.1, mass_kg = 1, position_m = [0, 0, 5] },
    { name = "beam", model = "rigid", shape = "ball", radius_m = 0.1, mass_kg = 1e6, position_m = [0, 0, 6] },
    { name = "hose", model = "tube", path_m = [[0, 1, 5], [1, 1, 5]], radius_m = 0.01, young_pa = 1e6, density_kg_m3 = 1000, clamp = ["start"], attach = [{ from = 0, to = 1, stiffness_n_m2 = 100ATTACH }] },
]
"#;

fn held(ties: &str, attach: &str) -> Result<Scene, SceneError> {
    let text = format!("{}{ties}\n", HELD.replace("ATTACH", attach));
    Source::memory("held", text.as_bytes()).and_then(|source| load(&source, &[]))
}

#[test]
fn the_tearing_force_of_joints_couplings_and_attached_parts_is_read_and_infinite_where_none_is_given() {
    let tie = |tears: &str| {
        format!(
            "joint = [{{ kind = \"spherical\", a = \"ball\", b = \"world\"{tears} }}]\ncoupling = [{{ kind = \"attach\", a = \"ball\", b = \"beam\", at_a = [0, 0, 0], at_b = [0, 0, 0], stiffness_n_m = 100{tears} }}]"
        )
    };
    let read = |tears: &str| {
        let scene = held(&tie(tears), tears).unwrap();
        let CouplingKind::Attach { tears_above_n, .. } = scene.couplings[0].kind else { panic!("an attachment") };
        let Spec::Tube(tube) = &scene.agents[2].spec else { panic!("a tube") };
        [scene.joints[0].tears_above_n, tears_above_n, tube.attachments[0].tears_above_n]
    };
    assert_eq!(read(", tears_above_n = 12.5"), [12.5; 3]);
    assert_eq!(read(""), [f64::INFINITY; 3]);
}

#[test]
fn a_tearing_force_outside_its_range_or_out_of_place_is_refused_where_it_stands() {
    let refused = |ties: &str, attach: &str, shown: &str, words: &[&str]| {
        let problems = held(ties, attach).unwrap_err().problems;
        let [problem] = &problems[..] else { panic!("{ties}{attach}: {problems:#?}") };
        assert_eq!(problem.text, shown, "{ties}{attach}");
        let said = format!("{}; {}", problem.message, problem.expected);
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    };
    let range = ["`tears_above_n`", "a number from 0.000001 to 1000000000 N"];
    let joint =
        |value: &str| format!("joint = [{{ kind = \"fixed\", a = \"ball\", b = \"world\", tears_above_n = {value} }}]");
    for value in ["0", "-1", "2e9", "nan"] {
        refused(&joint(value), "", value, &range);
        refused("", &format!(", tears_above_n = {value}"), value, &range);
    }
    let attach = |keys: &str| {
        format!(
            "coupling = [{{ kind = \"attach\", a = \"ball\", b = \"beam\", at_a = [0, 0, 0], at_b = [0, 0, 0], stiffness_n_m = 100, {keys} }}]"
        )
    };
    refused(&attach("tears_above_n = 0"), "", "0", &range);
    for law in ["ledger", "tlm"] {
        refused(
            &attach(&format!("law = \"{law}\", tears_above_n = 9")),
            "",
            "9",
            &["`tears_above_n`", law, "no `law`"],
        );
    }
    let contact = "coupling = [{ a = \"ball\", b = \"beam\", tears_above_n = 9 }]";
    refused(contact, "", "9", &["`tears_above_n`", "does not belong to contact"]);
}

#[test]
fn the_yield_force_of_joints_and_couplings_is_read_and_is_below_the_tearing_force() {
    let tie = |keys: &str| {
        format!(
            "joint = [{{ kind = \"spherical\", a = \"ball\", b = \"world\"{keys} }}]\ncoupling = [{{ kind = \"attach\", a = \"ball\", b = \"beam\", at_a = [0, 0, 0], at_b = [0, 0, 0], stiffness_n_m = 100{keys} }}]"
        )
    };
    let read = |keys: &str| {
        let scene = held(&tie(keys), "").unwrap();
        let CouplingKind::Attach { yields_above_n, .. } = scene.couplings[0].kind else { panic!("an attachment") };
        [scene.joints[0].yields_above_n, yields_above_n]
    };
    assert_eq!(read(", yields_above_n = 12.5, tears_above_n = 13"), [12.5; 2]);
    assert_eq!(read(", tears_above_n = 13"), [f64::INFINITY; 2]);
    for (keys, word) in [
        (", yields_above_n = 13, tears_above_n = 13", "below `tears_above_n`, 13 N"),
        (", yields_above_n = 0", "a number from 0.000001 to 1000000000 N"),
    ] {
        let problems = held(&tie(keys), "").unwrap_err().problems;
        assert!(problems.len() == 2 && problems.iter().all(|problem| problem.expected.contains(word)), "{problems:#?}");
    }
    let contact = "coupling = [{ a = \"ball\", b = \"beam\", yields_above_n = 9 }]";
    assert!(held(contact, "").unwrap_err().problems[0].message.contains("does not belong to contact"));
}

#[test]
fn what_yields_slides_down_and_one_of_the_two_reports_it() {
    let joints = "joint = [{ kind = \"fixed\", a = \"beam\", b = \"world\" }, { kind = \"fixed\", a = \"ball\", b = \"beam\", yields_above_n = 8.829 }]";
    let world = World::start(&held(joints, "").unwrap(), ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(500));
    let [ball, beam] = [0, 1].map(|at| world.agents()[at].latest());
    let [event] = ball.events[..] else { panic!("{:?}", ball.events) };
    assert_eq!((event.kind, event.attachment), (AttachmentEventKind::Yielded, AttachmentId::Joint(1)));
    assert!(beam.events.is_empty() && event.force_n == 8.829 && event.at.as_secs_f64() < 0.0168, "{event:?}");
    let Body::Rigid(state) = &ball.body else { panic!("a rigid body") };
    let time_s = ball.moment().as_secs_f64();
    assert!((state.velocity.z / (-0.981 * time_s) - 1.0).abs() < 0.01, "{} m/s at {time_s} s", state.velocity);
}

#[test]
fn what_a_joint_held_together_falls_and_parts_once_it_has_torn() {
    // the beam is fixed to the world, and the ball to the beam
    let joints = |between_n: &str| {
        format!(
            "joint = [{{ kind = \"fixed\", a = \"beam\", b = \"world\" }}, {{ kind = \"fixed\", a = \"ball\", b = \"beam\", tears_above_n = {between_n} }}]"
        )
    };
    let play = |between_n: &str| {
        let world = World::start(&held(&joints(between_n), "").unwrap(), ExecutorKind::Lockstep).unwrap();
        world.advance(SimSpan::from_millis(1000));
        let states = world.agents().iter().take(2).map(|agent| (agent.latest(), agent.led_by()));
        (states.collect::<Vec<_>>(), world.hash())
    };
    let (holding, _) = play("10.8");
    assert_eq!((holding[0].0.events.len(), holding[1].1), (0, Some(AgentId(0))), "1.1 times its weight");
    let (torn, hash) = play("8.8");
    // the joint's first body alone reports it, with its weight
    let [event] = torn[0].0.events[..] else { panic!("{:?}", torn[0].0.events) };
    assert_eq!((event.attachment, event.with), (AttachmentId::Joint(1), Some(AgentId(1))));
    // joints hold to 5 µm: in a step of 1/240 s up to 0.3 N of 1 kg, and 1.2 mm/s afterwards
    assert!((event.force_n - 9.81).abs() < 0.3, "{} N", event.force_n);
    let at_s = event.at.as_secs_f64();
    assert!(at_s < 0.0168, "{at_s} s: a step of the slowest rate at most");
    assert!(torn[1].0.events.is_empty() && torn.iter().all(|(_, led_by)| led_by.is_none()), "they parted");
    let Body::Rigid(ball) = &torn[0].0.body else { panic!("a rigid body") };
    let fallen_s = torn[0].0.moment().as_secs_f64() - at_s;
    let late_m = ball.position.z - (5.0 - 0.5 * 9.81 * fallen_s * fallen_s);
    assert!(late_m.abs() < 1.2e-3, "{late_m} m");
    assert_eq!(play("8.8").1, hash, "the same bits");
}

#[test]
fn a_tool_that_pulls_ever_harder_tears_its_attachment_within_a_step_of_the_threshold() {
    // a beam that is fixed to the world, and a tool on a spring of 100 N/m that goes up by 0.2 m in a second, half of it in half a second,
    // where it is fastest: 30 N a second
    let text = r#"format = 1
object = [
    { name = "beam", model = "rigid", shape = "ball", radius_m = 0.1, mass_kg = 1 },
    { name = "tool", model = "tool", rate_hz = 240, keyframe = [{ at_s = 0, tip_m = [0, 0, 1] }, { at_s = 1, tip_m = [0, 0, 1.2] }] },
]
joint = [{ kind = "fixed", a = "beam", b = "world" }]
coupling = [{ kind = "attach", a = "beam", b = "tool", at_a = [0, 0, 0], at_b = [0, 0, 0], stiffness_n_m = 100, rest_m = 1, tears_above_n = 10 }]
"#;
    let scene = Source::memory("pull", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
    for executor in [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool] {
        let world = World::start(&scene, executor).unwrap();
        world.advance(SimSpan::from_millis(1000));
        let [beam, tool] = [0, 1].map(|at| world.agents()[at].latest());
        let [event] = beam.events[..] else { panic!("{executor:?}: {:?}", beam.events) };
        assert_eq!((event.attachment, event.with), (AttachmentId::Coupling(0), Some(AgentId(1))), "{executor:?}");
        // a cluster that is late makes steps of up to 1/60 s
        let step_s = beam.cluster.unwrap().step_s.max(1.0 / 60.0);
        assert!((10.0..=10.0 + 30.0 * step_s).contains(&event.force_n), "{executor:?}: {} N", event.force_n);
        // the tip is a little behind its path
        let at_s = event.at.as_secs_f64();
        assert!((0.5..0.5 + 2.0 * step_s).contains(&at_s), "{executor:?}: {at_s} s");
        assert!(tool.events.is_empty() && tool.grips.is_empty() && beam.grips.is_empty(), "{executor:?}");
        assert_eq!(world.agents()[1].led_by(), None, "{executor:?}: they parted");
    }
}

#[test]
fn the_world_says_how_deep_contacts_rest() {
    assert_eq!(balls("").contact_depth_m, 20e-6);
    assert_eq!(balls("world.contact_depth_m = 3e-6").contact_depth_m, 3e-6);
    let source = Source::memory("deep", b"format = 1\nworld.contact_depth_m = 0.1").unwrap();
    let SceneError { problems, .. } = load(&source, &[]).unwrap_err();
    let said = format!("{}; {}", problems[0].message, problems[0].expected);
    assert!(said.contains("`contact_depth_m` of `[world]` is 0.1") && said.contains("0.000001 to 0.001 m"), "{said}");
}
