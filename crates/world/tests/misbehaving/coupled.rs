//! A model fails in the step in which another of its cluster takes the impulses of a partner with a clock of its own:
//! none of them is lost.

use super::ms;
use super::rogue::{HALF_M, Kind, Rogue, Switch};
use glam::DVec3;
use metachron_contact::Law;
use metachron_core::Body;
use metachron_runtime::AgentState;
use metachron_world::couplings::{Coupling, CouplingKind};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Custom, Pace, Rigid, Scene, World};
use std::sync::Arc;

const MASS_KG: f64 = 0.5;

/// A ball beside a rogue, which it touches without pressing on it, and a ball that flies against it and meets it by a ledger.
fn scene(switch: &Arc<Switch>, leads: bool) -> Scene {
    let mine = Arc::clone(switch);
    let beside = DVec3::new(-0.08, 0.05 + HALF_M, 0.0);
    let rogue = Custom::made_by(move |_| Box::new(Rogue::floating(&mine, beside))).rate_hz(250.0);
    let ball = |x: f64, v: f64| Rigid::ball(0.05).mass_kg(MASS_KG).at([x, 0.0, 0.0]).velocity_m_s([v, 0.0, 0.0]);
    let mut scene = Scene::builder().gravity([0.0; 3]);
    if leads {
        scene = scene.add("rogue", rogue.clone());
    }
    scene = scene.add("hit", ball(0.0, 0.0).restitution(0.5).rate_hz(250.0));
    if !leads {
        scene = scene.add("rogue", rogue);
    }
    let mut scene = scene.add("flying", ball(0.12, -1.0).restitution(0.5).rate_hz(1000.0)).build().unwrap();
    let id = |name: &str| scene.agents.iter().find(|member| member.name == name).unwrap().id;
    let [hit, rogue, flying] = ["hit", "rogue", "flying"].map(id);
    scene.couplings.extend([(hit, Law::Ledger), (rogue, Law::Off)].map(|(a, law)| Coupling {
        a,
        b: flying,
        kind: CouplingKind::Contact,
        law,
    }));
    scene
}

fn velocity(world: &World, name: &str) -> DVec3 {
    let Body::Rigid(body) = &world.latest(world.object(name).unwrap()).unwrap().body else { panic!("a rigid body") };
    body.velocity
}

#[test]
fn a_step_that_is_made_again_takes_what_it_took_first() {
    for leads in [true, false] {
        for at in 0..12 {
            let switch = Arc::<Switch>::default();
            let world = World::start(&scene(&switch, leads), ExecutorKind::Lockstep).unwrap();
            world.set_pace(Pace::Free).unwrap();
            // they meet after 20 ms
            world.advance(ms(4 + 3 * at));
            let [rogue, hit] = world.objects(["rogue", "hit"]).unwrap();
            let of = |object: metachron_world::Object| world.agents().of(object.id()).unwrap();
            let (led, leader) = if leads { (hit, rogue) } else { (rogue, hit) };
            let is_one = of(led).led_by() == Some(leader.id());
            switch.set(Kind::Begin);
            world.advance(ms(200));
            assert!(matches!(of(rogue).state(), AgentState::Parked(_)), "{at}, leads {leads}");
            let [a, b] = ["hit", "flying"].map(|name| velocity(&world, name).x);
            // closed form of a blow of equal masses at 1 m/s with restitution 0.5
            assert!((a + 0.75).abs() < 5e-3 && (b + 0.25).abs() < 5e-3, "{at}, leads {leads}, one {is_one}: {a}, {b}");
            assert!((MASS_KG * (a + b + 1.0)).abs() < 1e-14, "{at}, leads {leads}: {a} and {b} m/s");
            assert!(is_one || at > 5, "they are stepped as one: {at}, leads {leads}");
        }
    }
}
