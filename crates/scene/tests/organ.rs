//! The scene `organ` at its finest: a soft body of hundreds of nodes, with a rigid ball, a tool, a tube and another soft body in its cluster, is
//! solved by conjugate gradients.

use metachron_core::SimSpan;
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{SolveBudget, World};
use std::path::Path;

#[test]
fn the_finest_organ_is_solved_by_gradients_with_a_rigid_ball_on_it() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/organ.toml");
    let source = Source::memory("organ", &std::fs::read(file).unwrap()).unwrap();
    let finest = [("object.organ.eps_m".to_owned(), "0.014".to_owned())];
    let mut scene = load(&source, &finest).unwrap();
    scene.contact_budget = SolveBudget::Exact;
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(400));
    let state = |name: &str| world.latest(world.object(name).unwrap()).unwrap();
    let [organ, marble] = ["organ", "marble"].map(state);
    let leader = organ.cluster.unwrap().leader;
    assert_eq!(marble.cluster.unwrap().leader, leader, "they are one problem");
    let solves = world.agents()[leader.0 as usize].latest().cluster.unwrap().solves.unwrap();
    assert!(solves.contacts > 0 && solves.products > solves.problems, "{solves:?}");
    assert_eq!(solves.unfinished, 0, "{solves:?}");
    let marble = world.object("marble").unwrap().id();
    assert!(
        organ.pairs.iter().any(|pair| pair.with == marble && pair.contacts > 0),
        "the marble lies on it: {:?}",
        organ.pairs
    );
}
