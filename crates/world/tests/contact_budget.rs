//! How far solves of contact go by a declared machine: as far as there is time, to their end where nothing bounds them, the same on every run.

use metachron_core::{ClusterSolves, SimSpan, SolveLevel};
use metachron_geometry::Solid;
use metachron_runtime::FACTOR;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Pace, Rigid, Scene, SolveBudget, StepCost, World};

const BUDGET: SolveBudget = SolveBudget::Timed { least_steps: 5 };

/// Boxes of 500 Hz that fall on each other, on a machine on which a factor takes so long and everything else next to nothing.
fn pile(budget: SolveBudget, factor_us: f64) -> Scene {
    let empty = Scene::builder().fixed("floor", Solid::Plane).contact_budget(budget);
    let places = (0..27_u32).map(|k| [k % 3, k / 3 % 3, k / 9].map(f64::from));
    let scene = places.fold(empty, |scene, [x, y, z]| {
        let at = [0.101 * x + 0.02 * z, 0.101 * y, 0.05 + 0.103 * z];
        scene.add(format!("{x} {y} {z}"), Rigid::cuboid([0.05; 3]).at(at).rate_hz(500.0))
    });
    let mut scene = scene.build().unwrap();
    let cost = |base_us, unit_us| StepCost { base_us: Some(base_us), unit_us: Some(unit_us) };
    let steps = [(FACTOR, cost(factor_us, 0.0)), ("rigid", cost(0.0, 0.1))];
    scene.machine.step = steps.map(|(model, cost)| (model.to_owned(), cost)).into();
    scene
}

struct Played {
    hash: u64,
    solves: ClusterSolves,
    /// How much longer than asked for steps were.
    lengthened: u64,
}

fn played(scene: &Scene, pace: Pace) -> Played {
    let world = World::start(scene, ExecutorKind::Lockstep).unwrap();
    world.set_pace(pace).unwrap();
    world.advance(SimSpan::from_millis(400));
    let first = &world.agents()[0];
    let solves = first.latest().cluster.and_then(|cluster| cluster.solves).unwrap();
    assert!(solves.contacts > 50, "they touch: {solves:?}");
    Played { hash: world.hash(), solves, lengthened: first.stats().lengthened }
}

#[test]
fn dear_factors_end_solves_and_cheap_ones_do_not() {
    let [dear, cheap] = [300.0, 0.01].map(|factor_us| played(&pile(BUDGET, factor_us), Pace::RealTime).solves);
    // before a factor has been made its price is not known
    assert!(dear.unfinished > 20 && cheap.unfinished <= 1, "{dear:?}, {cheap:?}");
    assert!(dear.deepest_m < 1e-3, "{dear:?}");
}

#[test]
fn where_the_budget_ends_solves_steps_are_as_long_as_asked_for() {
    let budgets = [SolveBudget::Exact, SolveBudget::Timed { least_steps: 1 }];
    // where boxes land an exact solve takes two factors and more, and a step lasts for one
    let [exact, budget] = budgets.map(|budget| played(&pile(budget, 1900.0), Pace::RealTime));
    assert_eq!(exact.solves.unfinished, 0);
    // no solve has time for three: the boxes are rapier3d's
    assert_eq!(budget.solves.level, SolveLevel::RigidPile, "{:?}", budget.solves);
    assert!(exact.lengthened > 4 * budget.lengthened, "{} of {} steps", budget.lengthened, exact.lengthened);
}

#[test]
fn a_run_repeats_its_bits_and_at_the_free_pace_solves_are_exact() {
    let hash = |budget, pace| played(&pile(budget, 300.0), pace).hash;
    assert_eq!(hash(BUDGET, Pace::RealTime), hash(BUDGET, Pace::RealTime));
    assert_eq!(hash(BUDGET, Pace::Free), hash(SolveBudget::Exact, Pace::Free));
    assert_eq!(played(&pile(BUDGET, 300.0), Pace::Free).solves.unfinished, 0);
}
