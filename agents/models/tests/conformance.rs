//! Every model against the promises of an agent (`metachron_models::conformance`).

use glam::{DQuat, DVec3};
use metachron_contact::{Agent, AnchorSpring, Neighbour};
use metachron_core::{AgentId, Anchor, Resolution, ResolutionRange, SimSpan, Snapshot};
use metachron_geometry::{ContactTraits, Solid};
use metachron_models::conformance::fall_deviation;
use metachron_models::conformance::{Load, Suite, check};
use metachron_models::rigid::{KinematicBody, Led, Restraint, RigidBody, RigidSpec};
use metachron_models::rod::Integrator;
use metachron_models::rod::Tube;
use metachron_models::rod::{Material, Section, TubeSpec, WallModel};
use metachron_models::soft::{MaterialLaw, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use metachron_models::synthetic::{Synthetic, SyntheticSpec};
use metachron_models::tool::Tool;
use metachron_models::tool::{Keyframe, ToolSpec};
use std::sync::Arc;

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);
const DT: SimSpan = SimSpan::from_nanos(4_000_000);

fn count(work: &mut dyn FnMut()) -> u64 {
    allocation_counter::measure(work).count_total
}

fn hand(anchor: Anchor, target: DVec3) -> AnchorSpring {
    AnchorSpring { by: None, anchor, target, target_velocity: DVec3::ZERO, stiffness_n_m: 50.0, damping_n_s_m: 0.5 }
}

/// Hands that no state survives.
fn absurd(anchor: Anchor) -> Vec<AnchorSpring> {
    [DVec3::NAN, DVec3::INFINITY, DVec3::splat(1e300), DVec3::splat(-f64::MAX)]
        .map(|target| hand(anchor, target))
        .to_vec()
}

fn falls(agent: &dyn Agent, t: f64) -> f64 {
    fall_deviation(agent, GRAVITY, t)
}

fn brick() -> RigidSpec {
    RigidSpec {
        solid: Solid::Box { half_extents_m: DVec3::new(0.1, 0.05, 0.02) },
        position: DVec3::Z,
        rotation: DQuat::from_rotation_x(0.3),
        velocity: DVec3::ZERO,
        spin: DVec3::new(1.0, 2.0, 3.0),
        mass_kg: 0.7,
        inertia: None,
        restitution: 0.5,
        friction: 0.4,
        traits: ContactTraits::default(),
        gravity: GRAVITY,
        sleep: true,
        restraint: Restraint::default(),
        led: None,
    }
}

fn tube(clamp: bool, damping_per_s: f64) -> Box<dyn Agent> {
    tube_by(Integrator::ImplicitEuler, 1, (clamp, damping_per_s))
}

fn tube_by(integrator: Integrator, substeps: u32, held: (bool, f64)) -> Box<dyn Agent> {
    Box::new(Tube::new(tube_spec(integrator, substeps, held)).unwrap())
}

fn tube_spec(integrator: Integrator, substeps: u32, (clamp, damping_per_s): (bool, f64)) -> TubeSpec {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(0.015, 0.002, material);
    TubeSpec {
        resolution: Resolution { eps_m: 1.0 / 16.0, n: 3 },
        range: ResolutionRange { eps_m: (1e-3, 1.0), n: (0, 5) },
        segments: None,
        integrator,
        substeps,
        damping_per_s,
        clamp: [clamp, false],
        friction: 0.3,
        gravity: GRAVITY,
        ..TubeSpec::free(vec![DVec3::ZERO, DVec3::X], section, 16)
    }
}

fn soft_spec(shape: SoftShape) -> SoftSpec {
    let material = SoftMaterial {
        young_pa: 2e4,
        poisson: 0.4,
        density_kg_m3: 1050.0,
        damping_per_s: 0.0,
        damping_s: 0.0,
        law: MaterialLaw::Corotational,
    };
    SoftSpec {
        shape,
        nodes: None,
        eps_touched_m: None,
        material,
        position: DVec3::Z,
        rotation: DQuat::from_rotation_x(0.3),
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.3,
        traits: ContactTraits::default(),
        gravity: GRAVITY,
        self_contact: false,
        sleep: false,
    }
}

fn segments(counts: &[u32]) -> Vec<Resolution> {
    counts.iter().map(|&n| Resolution { eps_m: 1.0 / f64::from(n), n: 3 }).collect()
}

#[test]
fn a_flying_body_keeps_every_promise() {
    let make = || Box::new(RigidBody::new(brick()).unwrap()) as Box<dyn Agent>;
    let suite = Suite {
        closed_form: Some((&falls, 1e-12)), // a few hundred roundings of an ulp
        pull: Some(hand(Anchor::Local(DVec3::X * 0.05), DVec3::new(0.2, 0.1, 1.2))),
        absurd: absurd(Anchor::Local(DVec3::ZERO)),
        allocations: Some((&count, 0.0)),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_kinematic_body_keeps_every_promise() {
    let key = |at_s, x: f64| Keyframe { at_s, tip_m: DVec3::X * x, rotation: DQuat::from_rotation_y(x), jaw: 0.0 };
    let led = Led { keyframes: vec![key(0.0, 0.0), key(0.3, 1.0), key(1.0, 0.2)], repeat: true };
    let make =
        || Box::new(KinematicBody::new(&RigidSpec { led: Some(led.clone()), ..brick() }).unwrap()) as Box<dyn Agent>;
    let suite = Suite { allocations: Some((&count, 0.0)), ..Suite::new(&make, DT) };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_kinematic_body_and_a_held_solid_carry_a_load_of_any_rate() {
    let still = || {
        let spec = RigidSpec { position: DVec3::ZERO, rotation: DQuat::IDENTITY, led: Some(Led::default()), ..brick() };
        Box::new(KinematicBody::new(&spec).unwrap()) as Box<dyn Agent>
    };
    let held = || {
        let shape = SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.05), segments: [4, 4, 2] };
        let corner = DVec3::new(-0.05, -0.05, 0.0);
        let spec = SoftSpec { position: corner, rotation: DQuat::IDENTITY, ..soft_spec(shape) };
        let material = SoftMaterial { young_pa: 2e5, damping_s: 0.01, ..spec.material };
        Box::new(SoftBody::new(SoftSpec { material, held: vec![Side::Bottom], ..spec }).unwrap()) as Box<dyn Agent>
    };
    for (make, stands_m) in [(&still as &dyn Fn() -> Box<dyn Agent>, DVec3::Z * 0.02), (&held, DVec3::Z * 0.05)] {
        let load = Load { make, stands_m, half_m: 0.02, mass_kg: 0.3, settles_s: 1.0 };
        let suite = Suite { load: Some(load), steps: 10, ..Suite::new(make, DT) };
        assert_eq!(check(&suite), [], "{}", make().model());
    }
}

#[test]
fn a_falling_tube_keeps_every_promise() {
    let make = || tube(false, 0.0);
    let hanging = || tube(true, 6.0);
    let suite = Suite {
        closed_form: Some((&falls, 1e-9)), // the band solve: conditioning 1e5 over 1e-16, a few hundred steps
        pull: Some(hand(Anchor::Arc(0.3), DVec3::new(0.3, 0.2, 0.1))),
        absurd: absurd(Anchor::Arc(0.3)),
        resolutions: segments(&[8, 16, 32, 64]),
        converging: Some((&hanging, 2000)),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_falling_tube_whose_wall_gives_keeps_every_promise_by_every_implicit_integrator() {
    for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum] {
        let giving = |held| {
            let spec = tube_spec(integrator, 1, held);
            let wall = TubeSpec { wall: WallModel::Gives, sealed: true, pressure_pa: 500.0, ..spec };
            Box::new(Tube::new(wall).unwrap()) as Box<dyn Agent>
        };
        let make = || giving((false, 0.0));
        let hanging = || giving((true, 12.0));
        let suite = Suite {
            closed_form: Some((&falls, 1e-9)), // as for a prescribed wall
            pull: Some(hand(Anchor::Arc(0.3), DVec3::new(0.3, 0.2, 0.1))),
            absurd: absurd(Anchor::Arc(0.3)),
            allocations: Some((&count, 0.0)),
            resolutions: segments(&[8, 16, 32, 64]),
            converging: Some((&hanging, 2000)),
            ..Suite::new(&make, DT)
        };
        assert_eq!(check(&suite), [], "{}", integrator.name());
    }
}

/// The other integrators, each with the substeps that twice [`DT`] needs at 64 segments.
const OTHERS: [(Integrator, u32); 4] =
    [(Integrator::SymplecticEuler, 40), (Integrator::Xpbd, 64), (Integrator::Bdf2, 1), (Integrator::EnergyMomentum, 1)];

#[test]
fn a_falling_tube_keeps_every_promise_by_every_integrator() {
    for (integrator, substeps) in OTHERS {
        let make = || tube_by(integrator, substeps, (false, 0.0));
        let hanging = || tube_by(integrator, substeps, (true, 12.0));
        let suite = Suite {
            closed_form: Some((&falls, 1e-9)), // as for implicit Euler
            pull: Some(hand(Anchor::Arc(0.3), DVec3::new(0.3, 0.2, 0.1))),
            absurd: absurd(Anchor::Arc(0.3)),
            resolutions: segments(&[8, 16, 32, 64]),
            converging: Some((&hanging, 500)),
            ..Suite::new(&make, DT)
        };
        assert_eq!(check(&suite), [], "{}", integrator.name());
    }
}

#[test]
fn a_tube_of_one_size_allocates_nothing_once_warm_by_any_integrator() {
    for (integrator, substeps) in OTHERS {
        let make = || tube_by(integrator, substeps, (true, 0.0));
        for pull in [None, Some(hand(Anchor::Arc(0.7), DVec3::new(0.6, 0.2, 0.1)))] {
            let suite = Suite { pull, allocations: Some((&count, 0.0)), ..Suite::new(&make, DT) };
            assert_eq!(check(&suite), [], "{}", integrator.name());
        }
    }
}

#[test]
fn a_tube_of_one_size_allocates_nothing_once_warm() {
    let make = || tube(true, 0.0);
    let suite = Suite {
        pull: Some(hand(Anchor::Arc(0.7), DVec3::new(0.6, 0.2, 0.1))),
        allocations: Some((&count, 0.0)),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}

/// A tool that grasps a tube, with this pivot.
fn check_grasping(pivot_m: Option<DVec3>) {
    let curve = tube(false, 0.0);
    let mut snapshot = Snapshot::default();
    curve.write_snapshot(&mut snapshot);
    let held = AgentId(1);
    let key = |at_s, z, jaw| Keyframe { at_s, tip_m: DVec3::new(0.5, 0.0, z), rotation: DQuat::IDENTITY, jaw };
    let spec = ToolSpec {
        keyframes: vec![key(0.0, 0.1, 1.0), key(0.2, 0.02, 0.0), key(0.6, 0.2, 0.0), key(0.7, 0.2, 1.0)],
        repeat: true,
        reach_m: 0.02,
        stiffness_n_m: 100.0,
        damping_n_s_m: 1.0,
        max_force_n: 50.0,
        graspable: vec![held],
        pivot_m,
        starts_off_m: DVec3::ZERO,
        traits: ContactTraits::default(),
    };
    let make = || Box::new(Tool::new(spec.clone()).unwrap()) as Box<dyn Agent>;
    let suite = Suite {
        neighbours: vec![Neighbour::observed(held, Arc::new(snapshot))],
        pull: Some(hand(Anchor::Local(DVec3::ZERO), DVec3::new(0.4, 0.1, 0.1))),
        absurd: absurd(Anchor::Local(DVec3::ZERO)),
        allocations: Some((&count, 0.0)),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_tool_that_grasps_keeps_every_promise() {
    check_grasping(None);
}

#[test]
fn a_tool_in_a_pivot_keeps_every_promise() {
    check_grasping(Some(DVec3::new(0.45, 0.05, 0.3)));
}

#[test]
fn a_tool_driven_at_constant_speed_keeps_every_promise() {
    // collinear keyframes at even times: between the second and the last but one the curve is a straight line in time
    let key = |i: u32| Keyframe {
        at_s: 0.1 * f64::from(i),
        tip_m: DVec3::new(0.3, 0.1, 0.05) * f64::from(i),
        rotation: DQuat::IDENTITY,
        jaw: 1.0,
    };
    let spec = ToolSpec {
        keyframes: (0..20).map(key).collect(),
        repeat: false,
        reach_m: 0.02,
        stiffness_n_m: 100.0,
        damping_n_s_m: 1.0,
        max_force_n: 50.0,
        graspable: vec![],
        pivot_m: None,
        starts_off_m: DVec3::ZERO,
        traits: ContactTraits::default(),
    };
    let make = || Box::new(Tool::new(spec.clone()).unwrap()) as Box<dyn Agent>;
    let straight = |agent: &dyn Agent, t: f64| {
        let mut now = Snapshot::default();
        agent.write_snapshot(&mut now);
        let tip = now.body.probe(0.0).map_or(DVec3::NAN, |(tip, _)| tip);
        tip.distance(DVec3::new(3.0, 1.0, 0.5) * t)
    };
    let suite = Suite {
        closed_form: Some((&straight, 1e-12)), // rounding of the cubic
        allocations: Some((&count, 0.0)),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_synthetic_agent_keeps_every_promise() {
    let range = ResolutionRange { eps_m: (0.01, 0.08), n: (0, 3) };
    let spec = SyntheticSpec { cost_us: 5.0, cost_order: 1.0, error_m: 1e-3, error_order: 2.0 };
    let start = Resolution { eps_m: 0.08, n: 0 };
    let make = || Box::new(Synthetic::new(spec, range, start).unwrap()) as Box<dyn Agent>;
    let suite = Suite {
        resolutions: [0.08, 0.04, 0.02, 0.01].map(|eps_m| Resolution { eps_m, n: 1 }).to_vec(),
        converging: Some((&make, 1)),
        allocations: Some((&count, 0.0)),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}

#[test]
fn a_solid_in_a_cage_keeps_every_promise_at_every_spacing() {
    let surface = Arc::new(SoftShape::Ball { radius_m: 0.1, segments: 8 }.skin().unwrap());
    let make = || {
        let shape = SoftShape::Embedded { surface: surface.clone(), eps_m: 0.1, range_m: (0.034, 0.1) };
        Box::new(SoftBody::new(soft_spec(shape)).unwrap()) as Box<dyn Agent>
    };
    let spacings = [0.1, 0.05, 0.034].map(|eps_m| Resolution { eps_m, n: 0 });
    let suite = Suite {
        closed_form: Some((&falls, 1e-6)), // conjugate gradients end at 5e-8 m/s
        pull: Some(hand(Anchor::Vertex(3), DVec3::new(0.2, 0.1, 1.2))),
        absurd: absurd(Anchor::Vertex(0)),
        resolutions: spacings.to_vec(),
        ..Suite::new(&make, DT)
    };
    assert_eq!(check(&suite), []);
}
