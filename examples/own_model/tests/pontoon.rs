//! The pontoon keeps the promises of an agent, and floats and carries as Archimedes says, whatever the rates.

use metachron::models::conformance::{Load, Suite, check};
use metachron::prelude::*;
use metachron::world::Pace;
use own_model::{Hull, Pontoon};

const HULL: Hull = Hull { half_m: DVec3::new(0.5, 0.5, 0.1), mass_kg: 40.0, drag_n_s_m: 600.0 };
const LOAD_KG: f64 = 20.0;

fn pontoon() -> Box<dyn Agent> {
    Box::new(Pontoon::new(HULL).expect("a hull that is a box"))
}

/// How high its deck is without a load, metres.
fn deck_m() -> f64 {
    2.0 * HULL.half_m.z - HULL.draught_m(0.0)
}

#[test]
fn a_pontoon_keeps_every_promise() {
    let stands_m = DVec3::Z * deck_m();
    let load = Load { make: &pontoon, stands_m, half_m: 0.1, mass_kg: LOAD_KG, settles_s: 4.0 };
    let suite = Suite { load: Some(load), ..Suite::new(&pontoon, SimSpan::from_millis(4)) };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_pontoon_lies_as_deep_as_archimedes_says_under_a_load_of_any_rate() {
    use ExecutorKind::{Lockstep, Pool, Threads};
    for (executor, pontoon_hz, load_hz) in [
        (Lockstep, 50.0, 1000.0),
        (Lockstep, 240.0, 240.0),
        (Lockstep, 1000.0, 50.0),
        (Pool, 50.0, 1000.0),
        (Threads, 1000.0, 50.0),
    ] {
        let load = Rigid::cuboid([0.1; 3]).mass_kg(LOAD_KG).at([0.0, 0.0, deck_m() + 0.1]).rate_hz(load_hz);
        let stage = Custom::new(Pontoon::new(HULL).unwrap()).rate_hz(pontoon_hz);
        let scene = Scene::builder().add("pontoon", stage).add("load", load).build().unwrap();
        let world = World::start(&scene, executor).unwrap();
        world.set_pace(Pace::Free).unwrap();
        let [pontoon, load] = world.objects(["pontoon", "load"]).unwrap();
        world.advance(SimSpan::from_millis(4000));

        let case = format!("{executor:?}, {pontoon_hz} Hz under {load_hz} Hz");
        let middle = |object| world.frame().point(object, Anchor::Local(DVec3::ZERO)).unwrap();
        let draught_m = HULL.half_m.z - middle(pontoon).z;
        let wanted_m = HULL.draught_m(LOAD_KG);
        assert!((draught_m - wanted_m).abs() < 1e-4, "{case}: {draught_m} m deep; expected {wanted_m} m");
        let gap_m = middle(load).z - middle(pontoon).z - HULL.half_m.z - 0.1;
        assert!(gap_m.abs() < 1e-4, "{case}: the load rests {gap_m} m above the deck");
        let given_n = world.latest(pontoon).unwrap().contact_wrench.force_n.z;
        assert!((given_n + LOAD_KG * 9.81).abs() < 0.01 * LOAD_KG * 9.81, "{case}: the load gives {given_n} N");
    }
}

#[test]
fn the_page_shows_the_code_of_this_package() {
    let (page, code) = (include_str!("../../../docs/own-model.md"), include_str!("../src/lib.rs"));
    let own = include_str!("pontoon.rs");
    let blocks: Vec<_> = page.split("```rust,ignore\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 3, "{} blocks", blocks.len());
    for block in blocks {
        for line in block.lines().map(str::trim) {
            assert!(code.contains(line) || own.contains(line), "the page shows `{line}`");
        }
    }
}
