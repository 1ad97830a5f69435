//! Joints against closed forms.

use super::*;

/// A thin rod along z with its upper end at `top`.
fn rod(length: f64, top: DVec3) -> RigidSpec {
    let half_extents_m = DVec3::new(0.005, 0.005, 0.5 * length);
    spec(Solid::Box { half_extents_m }, top - DVec3::Z * (0.5 * length))
}

/// A hinge about y at the upper end of `a`.
fn hinge(a: u32, b: Option<u32>, length: f64, anchor_b_m: DVec3) -> Joint {
    let kind = JointKind::Revolute { axis: DVec3::Y, range_rad: None };
    Joint { anchor_a_m: DVec3::Z * (0.5 * length), anchor_b_m, ..Joint::new(AgentId(a), b.map(AgentId), kind) }
}

/// The times at which a value rises through zero, seconds.
fn rises(mut value: impl FnMut() -> f64, dt: f64, steps: u32) -> Vec<f64> {
    let (mut times, mut last) = (vec![], value());
    for step in 1..=steps {
        let now = value();
        if last < 0.0 && now >= 0.0 {
            times.push(dt * (f64::from(step) - now / (now - last)));
        }
        last = now;
    }
    times
}

fn period(times: &[f64]) -> f64 {
    (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64
}

#[test]
fn a_pendulum_on_a_hinge_swings_with_its_closed_form_period() {
    let length = 1.0;
    let tilt = DQuat::from_rotation_y(0.02);
    let start = rod(length, DVec3::ZERO);
    let hung = RigidSpec { rotation: tilt, position: tilt * start.position, ..start };
    let mut party = Party::jointed([hung], [hinge(0, None, length, DVec3::ZERO)]);
    let dt = 1.0 / 120.0;
    let times = rises(
        || {
            party.step(dt);
            party.state(0).position.x
        },
        dt,
        2400,
    );
    // a bar of half width w: I = m (l²/3 + w²/3) about its end; amplitude 0.02 rad lengthens it by 0.02²/16
    let arm = 0.5 * length;
    let inertia = length * length / 3.0 + 0.005_f64.powi(2) / 3.0;
    let closed = std::f64::consts::TAU * (inertia / (G * arm)).sqrt() * (1.0 + 0.02 * 0.02 / 16.0);
    let wrong = period(&times) / closed - 1.0;
    assert!(wrong.abs() < 1e-4, "period wrong by {wrong:e}"); // (ω h)²/24 = 1e-5, and the crossings' interpolation
}

#[test]
fn a_double_pendulum_swings_with_its_two_frequencies() {
    // two rods of length 1 m and mass 1: M = [[4/3, 1/2], [1/2, 1/3]], K = g [[3/2, 0], [0, 1/2]]
    let (a, b, c) = (4.0 / 9.0 - 0.25, -G * (4.0 / 6.0 + 0.5), 0.75 * G * G);
    let root = (b * b - 4.0 * a * c).sqrt();
    for square in [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)] {
        let second = (1.5 * G - square * 4.0 / 3.0) / (square * 0.5);
        let angles = [1e-3, 1e-3 * second];
        let turns = angles.map(|x| DQuat::from_rotation_y(-x));
        let mut specs = [rod(1.0, DVec3::ZERO), rod(1.0, DVec3::Z * -1.0)];
        specs[0].position = turns[0] * DVec3::new(0.0, 0.0, -0.5);
        specs[1].position = turns[0] * DVec3::new(0.0, 0.0, -1.0) + turns[1] * DVec3::new(0.0, 0.0, -0.5);
        specs.iter_mut().zip(turns).for_each(|(spec, turn)| spec.rotation = turn);
        let mut party =
            Party::jointed(specs, [hinge(0, None, 1.0, DVec3::ZERO), hinge(1, Some(0), 1.0, DVec3::Z * -0.5)]);
        let dt = 1.0 / 240.0;
        let times = rises(
            || {
                party.step(dt);
                party.state(0).position.x
            },
            dt,
            2400,
        );
        let wrong = period(&times) * square.sqrt() / std::f64::consts::TAU - 1.0;
        // (ω h)²/24 is 5e-5 of the fast mode; the rods' width adds 2.5e-5 of inertia
        assert!(wrong.abs() < 2e-4, "ω² {square}: period wrong by {wrong:e}");
    }
}

/// Rods of 0.2 m on ball joints, let go from horizontal.
fn let_go(count: u32) -> Party {
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let at = |i: u32| DVec3::X * -(0.2 * f64::from(i) + 0.1);
    let links = (0..count).map(|i| RigidSpec { rotation: turn, position: at(i), ..rod(0.2, DVec3::ZERO) });
    let joints = (0..count).map(|i| match i {
        0 => Joint { kind: JointKind::Spherical, ..hinge(0, None, 0.2, DVec3::ZERO) },
        _ => Joint { kind: JointKind::Spherical, ..hinge(i, Some(i - 1), 0.2, DVec3::Z * -0.1) },
    });
    Party::jointed(links, joints)
}

#[test]
fn a_double_pendulum_let_go_from_horizontal_keeps_its_energy() {
    let mut party = let_go(2);
    let before = party.energy_j();
    let scale = 2.0 * G * 0.2; // what falls, from horizontal to hanging
    for _ in 0..2400 {
        party.step(1.0 / 240.0);
        let change = (party.energy_j() - before) / scale;
        assert!(change.abs() < 0.01, "energy changed by {change:e} of the fall"); // second order, parts of 0.1 rad
    }
}

#[test]
fn a_whip_of_five_links_gains_no_energy_and_keeps_its_length() {
    let mut party = let_go(5);
    let (before, scale) = (party.energy_j(), 5.0 * G * 0.5);
    for _ in 0..2400 {
        party.step(1.0 / 240.0);
        // it loses what its links knock out of each other where it folds
        let gained = (party.energy_j() - before) / scale;
        assert!(gained < 0.01, "energy grew by {gained:e} of the fall");
        let mut end = DVec3::ZERO;
        for i in 0..5 {
            let state = party.state(i);
            let gap = (state.position + state.rotation * DVec3::Z * 0.1).distance(end);
            assert!(gap < 1e-5, "link {i} is {gap:e} m off its joint");
            end = state.position - state.rotation * DVec3::Z * 0.1;
        }
    }
}

#[test]
fn a_body_on_a_slide_falls_along_it_and_stops_at_its_end() {
    let slope = 0.6;
    let axis = DQuat::from_rotation_y(slope) * DVec3::X;
    let kind = |range_m| JointKind::Prismatic { axis: DVec3::NEG_X * 2.0, range_m };
    // the world is b: it lies behind a by what a has slid, against a's own axis
    let slide = |range_m| Joint { rest: DQuat::IDENTITY, ..Joint::new(AgentId(0), None, kind(range_m)) };
    let tilted = RigidSpec { rotation: DQuat::from_rotation_y(slope), ..cube(0.1, DVec3::ZERO) };
    let built = |range_m| {
        let joint = slide(range_m).at_rest_in(tilted.rotation, DQuat::IDENTITY);
        Party::jointed([tilted.clone()], [joint])
    };
    let mut party = built(None);
    party.run(0.01, 1.0);
    let wrong = party.state(0).position.distance(axis * (0.5 * G * libm::sin(slope)));
    assert!(wrong < 1e-9, "{wrong:e} m off"); // exact for a constant force; the solve's 1e-9 m/s
    let mut party = built(Some([-0.3, 0.5]));
    party.run(0.01, 1.0);
    let slid = party.state(0).position.dot(axis);
    assert!((slid - 0.5).abs() < 1e-6, "stopped at {slid} m");
}

#[test]
fn a_rope_is_never_longer_than_it_is() {
    let joint = Joint::new(AgentId(0), None, JointKind::Rope { length_m: 0.7 });
    let thrown = RigidSpec { velocity: DVec3::new(3.0, 1.0, 2.0), ..cube(0.05, DVec3::X * 0.3) };
    let mut party = Party::jointed([thrown], [joint]);
    let mut longest = 0.0_f64;
    for _ in 0..1000 {
        party.step(0.004);
        longest = longest.max(party.state(0).position.length());
    }
    assert!(longest > 0.6999, "it never came to its end: {longest}");
    assert!(longest < 0.7 + 1e-6, "the rope grew to {longest} m"); // single corrections leave 1e-10; the first jerk more
}

#[test]
fn a_spring_swings_with_its_own_frequency_and_keeps_its_amplitude() {
    let kind = JointKind::Spring { stiffness_n_m: 40.0, damping_n_s_m: 0.0, rest_m: 1.0 };
    let joint = Joint { anchor_b_m: DVec3::Z * 2.0, ..Joint::new(AgentId(0), None, kind) };
    let hang = G / 40.0;
    let mut party = Party::jointed([cube(0.05, DVec3::Z * (1.0 - hang + 0.1))], [joint]);
    let dt = 1.0 / 240.0;
    let times = rises(
        || {
            party.step(dt);
            party.state(0).position.z - 1.0 + hang
        },
        dt,
        4800,
    );
    let wrong = period(&times) / (std::f64::consts::TAU / 40.0_f64.sqrt()) - 1.0;
    assert!(wrong.abs() < 1e-4, "period wrong by {wrong:e}"); // (ω h)²/24 = 3e-5
    let swing = (0..400).map(|_| {
        party.step(dt);
        party.state(0).position.z - 1.0 + hang
    });
    let amplitude = swing.fold(0.0, f64::max);
    assert!((amplitude - 0.1).abs() < 1e-3, "amplitude {amplitude} m after 20 s");
}

#[test]
fn a_stiff_spring_does_not_blow_up() {
    let kind = JointKind::Spring { stiffness_n_m: 1e8, damping_n_s_m: 10.0, rest_m: 0.5 };
    let mut party = Party::jointed([cube(0.05, DVec3::X * 0.6)], [Joint::new(AgentId(0), None, kind)]);
    let before = party.energy_j() + 0.5 * 1e8 * 0.01;
    for _ in 0..500 {
        party.step(0.016);
        assert!(party.energy_j() < before);
    }
    let length = party.state(0).position.length();
    assert!((length - 0.5).abs() < 1e-3, "{length} m");
}

#[test]
fn a_free_jointed_pair_keeps_its_momentum() {
    for kind in [
        JointKind::Fixed,
        JointKind::Spherical,
        JointKind::Revolute { axis: DVec3::new(1.0, 0.3, -0.2), range_rad: Some([-0.5, 0.5]) },
        JointKind::Prismatic { axis: DVec3::X, range_m: Some([-0.2, 0.2]) },
    ] {
        let gravity = DVec3::ZERO;
        let first = RigidSpec { spin: DVec3::new(2.0, -3.0, 4.0), gravity, ..cube(0.1, DVec3::ZERO) };
        let second =
            RigidSpec { velocity: DVec3::new(0.5, 1.0, 0.2), gravity, mass_kg: 3.0, ..cube(0.1, DVec3::X * 0.3) };
        let joint = Joint {
            anchor_a_m: DVec3::X * 0.15,
            anchor_b_m: DVec3::X * -0.15,
            ..Joint::new(AgentId(0), Some(AgentId(1)), kind)
        };
        let mut party = Party::jointed([first, second], [joint]);
        let (linear, angular) = party.momentum();
        party.run(0.01, 5.0);
        let (now, turned) = party.momentum();
        assert!((now - linear).length() < 1e-9, "{kind:?}: linear changed by {:e}", (now - linear).length());
        // the anchors are one point to 1e-9 m, where impulses of some N·s act
        assert!((turned - angular).length() < 1e-6, "{kind:?}: angular changed by {:e}", (turned - angular).length());
    }
}
