//! A solid of a scene file whose cells are halved where something touches it, in a running world.

use metachron_core::{Body, SimSpan};
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};

/// A block on which a tool presses from the first half second to the second one, and goes.
fn text(keys: &str) -> String {
    format!(
        r#"
format = 1
object = [
    {{ name = "block", model = "solid", shape = "box", size_m = [0.4, 0.4, 0.15], {keys}, young_pa = 1e4, damping_per_s = 5,
      damping_s = 0.01, hold = ["bottom"], rate_hz = 60 }},
    {{ name = "probe", model = "tool", grasps = [], rate_hz = 120, keyframe = [
        {{ at_s = 0, tip_m = [0.03, 0.02, 0.15], rotation_deg = [180, 0, 0], jaw = 0 }}, {{ at_s = 0.5, tip_m = [0.03, 0.02, 0.068] }},
        {{ at_s = 1, tip_m = [0.05, 0.02, 0.068] }}, {{ at_s = 1.2, tip_m = [0.03, 0.02, 0.15] }},
    ] }},
]
"#
    )
}

fn scene(keys: &str) -> Result<Scene, String> {
    load(&Source::memory("touched", text(keys).as_bytes()).unwrap(), &[])
        .map_err(|error| format!("{:?}", error.problems))
}

fn nodes(world: &World) -> u32 {
    world.latest(world.object("block").unwrap()).unwrap().nodes.unwrap()
}

#[test]
fn cells_are_halved_under_a_tool_until_a_second_after_it_is_gone_and_a_checkpoint_holds_them() {
    let scene = scene("eps_m = 0.05, eps_touched_m = 0.03").unwrap();
    let ms = SimSpan::from_millis;
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(ms(100));
    let whole = nodes(&world);
    world.advance(ms(800));
    let halved = nodes(&world);
    assert!(halved > whole + 20, "{halved} nodes of {whole}");
    let mark = world.checkpoint().unwrap();
    world.advance(ms(300));
    let hash = world.hash();
    let opened = World::open(&scene, ExecutorKind::Lockstep, &mark).unwrap();
    opened.advance(ms(300));
    assert_eq!((opened.hash(), nodes(&opened)), (hash, nodes(&world)));
    world.advance(ms(1400));
    assert_eq!(nodes(&world), whole);
    // from a state with whole cells back to one with halves
    world.restore(&mark).unwrap();
    world.advance(ms(300));
    assert_eq!(world.hash(), hash);
}

#[test]
fn an_eps_where_it_is_touched_is_refused_without_a_cage_and_out_of_its_range() {
    for (keys, words) in [
        ("segments = [4, 4, 2], eps_touched_m = 0.02", "has no cage whose cells it would halve"),
        ("eps_m = 0.05, eps_touched_m = 0", "`eps_touched_m` of `block` is 0"),
        ("eps_m = 0.05, eps_touched_m = nan", "eps_touched_m"),
    ] {
        let said = scene(keys).expect_err("must be refused");
        assert!(said.contains(words), "{words:?} is not said: {said}");
    }
}

/// A soft block that is put onto a floor.
fn lying(keys: &str) -> World {
    let text = format!(
        "format = 1\n\
         object = [ {{ name = 'floor', model = 'rigid', shape = 'plane' }}, {{ name = 'block', model = 'solid', shape = 'box', \
         size_m = [0.2, 0.2, 0.1], position_m = [0, 0, 0.001], {keys}, young_pa = 1e4, damping_per_s = 5, damping_s = 0.01, rate_hz = 60 }} ]"
    );
    let scene = load(&Source::memory("lies", text.as_bytes()).unwrap(), &[]).unwrap();
    World::start(&scene, ExecutorKind::Lockstep).unwrap()
}

/// How high it ends up, metres.
fn height_m(keys: &str) -> f64 {
    let world = lying(keys);
    world.advance(SimSpan::from_millis(3000));
    let state = world.latest(world.object("block").unwrap()).unwrap();
    let Body::Soft(soft) = &state.body else { panic!("it is soft") };
    soft.positions.iter().map(|at| at.z).fold(0.0, f64::max)
}

#[test]
fn a_block_whose_cells_are_halved_along_its_bottom_lies_as_high_as_one_of_fine_cells() {
    let [fine, halved] = ["eps_m = 0.025", "eps_m = 0.05, eps_touched_m = 0.03"].map(height_m);
    assert!((fine - halved).abs() < 5e-4, "{fine} and {halved} m");
}

#[test]
fn a_block_whose_cells_are_halved_along_its_bottom_sleeps() {
    let world = lying("eps_m = 0.05, eps_touched_m = 0.03");
    let block = world.object("block").unwrap();
    world.advance(SimSpan::from_millis(8000));
    let state = world.latest(block).unwrap();
    assert!(state.at_rest && state.nodes > Some(300), "{} nodes, {} s", state.nodes.unwrap(), state.time.as_secs_f64());
    // its skin is not yet where its nodes carry it, and waits there
    let Body::Soft(soft) = &state.body else { panic!("it is soft") };
    assert!(soft.velocities.iter().all(|v| *v == [0.0; 3].into()));
}
