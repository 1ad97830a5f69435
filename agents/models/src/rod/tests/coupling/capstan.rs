//! A thin cord around a fixed cylinder, both ends pulled: when it slips.

use super::super::{millis, reference_spec};
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use glam::{DQuat, DVec3};
use metachron_contact::{Agent, AnchorSpring, StepContext};
use metachron_core::{AgentId, Anchor, SimTime};
use metachron_geometry::{Obstacle, Solid};

const BAR_M: f64 = 0.1;
/// A hundredth of the bar's: friction works at the skin and tension at the axis, one part in a hundred apart.
const CORD_M: f64 = 1e-3;
const FRICTION: f64 = 0.3;
/// The straight ends, metres.
const ENDS_M: f64 = 0.05;

/// The load of the end that follows, N.
const LOAD_N: f64 = 0.02;
/// Both loads come on in this time; then one grows from 0.9 to 1.1 of what is expected, seconds.
const DRAW_S: f64 = 0.2;
const RAMP_S: f64 = 1.5;

/// A cord that touches the cylinder along y over an angle, climbing along it by three radii a turn.
fn cord(angle: f64, segments: usize) -> Tube {
    let reach = BAR_M + CORD_M;
    let climb = |a: f64| DVec3::Y * (a / std::f64::consts::TAU * 3.0 * CORD_M);
    let on = |a: f64| DVec3::new(reach * a.sin(), 0.0, reach * a.cos()) + climb(a);
    let along = |a: f64| DVec3::new(a.cos(), 0.0, -a.sin());
    let count = (angle / 0.15).ceil() as u32;
    let mut path_m = vec![on(0.0) - along(0.0) * ENDS_M, on(0.0) - along(0.0) * (0.5 * ENDS_M)];
    path_m.extend((0..=count).map(|i| on(angle * f64::from(i) / f64::from(count))));
    path_m.extend([0.5, 1.0].map(|share| on(angle) + along(angle) * (share * ENDS_M)));
    let young_pa = 2e6;
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let mut section = Section::hollow(CORD_M, CORD_M, material);
    // limp: to bend onto the bar takes a thousandth of the tension
    (section.ei_n_m2, section.gj_n_m2) = (1e-7, 1e-7);
    let cylinder = Obstacle {
        name: String::new(),
        solid: Solid::Cylinder { radius_m: BAR_M, half_height_m: 0.5 },
        position: DVec3::ZERO,
        rotation: DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2),
        friction: FRICTION,
        restitution: 0.0,
    };
    let spec = TubeSpec {
        path_m,
        section,
        friction: FRICTION,
        damping_per_s: 20.0,
        obstacles: vec![cylinder].into(),
        ..reference_spec(young_pa, segments)
    };
    Tube::new(spec).unwrap()
}

/// T₂/T₁ when the cord begins to slip: both ends are pulled by dead loads, one of which grows slowly.
fn ratio(angle: f64, segments: usize) -> f64 {
    let mut tube = cord(angle, segments);
    let ends = [0, segments].map(|node| tube.state().x[node]);
    let ways = [[0, 1], [segments, segments - 1]].map(|[a, b]| (tube.state().x[a] - tube.state().x[b]).normalize());
    let (length, want) = (tube.length_m(), (FRICTION * angle).exp());
    // so short that no wave along the cord passes a segment in a step: friction then settles within a solve
    let dt = millis(0.2);
    let (mut time, mut at) = (SimTime::ZERO, 0.0);
    loop {
        let t = time.as_secs_f64();
        let grown = 0.9 + 0.2 * ((t - DRAW_S) / RAMP_S).max(0.0);
        let tension = [1.0, want * grown].map(|share| LOAD_N * share * (t / DRAW_S).min(1.0));
        // a spring so long that its force does not change while the cord slips by millimetres
        let pull = |anchor, end: usize| AnchorSpring {
            by: None,
            anchor: Anchor::Arc(anchor),
            target: ends[end] + ways[end] * 10.0,
            target_velocity: DVec3::ZERO,
            stiffness_n_m: 0.1 * tension[end],
            damping_n_s_m: 0.0,
        };
        let hands = [pull(0.0, 0), pull(length, 1)];
        let around = StepContext { hands: &hands, ..StepContext::alone(AgentId(0), time) };
        tube.step(dt, &around).unwrap();
        time += dt;
        let moved = (tube.state().x[0] - ends[0]).dot(ways[0]);
        if t < DRAW_S + 0.1 {
            at = moved;
        } else if at - moved > 1e-3 || t > RAMP_S + DRAW_S {
            return tension[1] / tension[0];
        }
    }
}

#[test]
fn a_cord_around_a_cylinder_slips_at_the_capstan_ratio() {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};
    for (angle, segments) in [(FRAC_PI_2, 30), (PI, 48), (TAU, 84)] {
        let (got, want) = (ratio(angle, segments), (FRICTION * angle).exp());
        println!("{angle}: {got} want {want}");
        // it slips by a millimetre while the load grows by one part in a hundred
        assert!((got / want - 1.0).abs() < 0.05, "over {angle} rad: {got}, not {want}");
    }
}
