//! Islands that a spring from outside bears: what hangs on one member weighs on the spring as closed forms have it.

use super::*;
use crate::tool::Tool;
use crate::tool::{Keyframe, ToolSpec};
use metachron_core::PairKind;
use metachron_core::{Anchor, ToolState};

/// So many rods of 0.1 m on ball joints one after the other along `along`, the first end at the origin; the last weighs `ratio`
/// times the 0.1 kg of each other one. A hand holds that end.
fn chain(links: u32, ratio: f64, along: DVec3, (stiffness_n_m, damping_n_s_m): (f64, f64)) -> Party {
    let solid = Solid::Capsule { radius_m: 0.01, half_height_m: 0.03 };
    let rods = (0..links).map(|i| RigidSpec {
        rotation: DQuat::from_rotation_arc(DVec3::NEG_Z, along),
        mass_kg: if i + 1 == links { 0.1 * ratio } else { 0.1 },
        ..spec(solid.clone(), along * (0.05 + 0.1 * f64::from(i)))
    });
    let joints = (1..links).map(|i| Joint {
        anchor_a_m: DVec3::Z * 0.05,
        anchor_b_m: DVec3::Z * -0.05,
        ..Joint::new(AgentId(i), Some(AgentId(i - 1)), JointKind::Spherical)
    });
    let hand = AnchorSpring {
        by: None,
        anchor: Anchor::Local(DVec3::Z * 0.05),
        target: DVec3::ZERO,
        target_velocity: DVec3::ZERO,
        stiffness_n_m,
        damping_n_s_m,
    };
    Party { hands: vec![hand], ..Party::jointed(rods, joints) }
}

/// Where the held end is.
fn end(party: &Party) -> DVec3 {
    let state = party.state(0);
    state.position + state.rotation * DVec3::Z * 0.05
}

#[test]
fn a_chain_hangs_from_a_spring_by_all_of_its_weight_and_is_still() {
    for (links, ratio) in [(1, 1.0), (3, 1.0), (8, 1.0), (3, 100.0)] {
        for (stiffness, dt) in [(1e3, 1.0 / 60.0), (1e3, 1.0 / 600.0), (1e5, 1.0 / 240.0)] {
            let weight_n = 0.1 * (f64::from(links) - 1.0 + ratio) * G;
            let damping = 2.0 * (stiffness * weight_n / G).sqrt();
            let mut party = chain(links, ratio, DVec3::NEG_Z, (stiffness, damping));
            party.run(dt, 6.0);
            let (sag_m, wanted_m) = (-end(&party).z, weight_n / stiffness);
            let force_n = party.snapshot(0).grips[0].force_n.z;
            let speed_m_s = (0..links as usize).map(|i| party.state(i).velocity.length()).fold(0.0, f64::max);
            println!(
                "{links}, {ratio}, {stiffness}, {dt}: {sag_m} m of {wanted_m}, {force_n} N of {weight_n}, {speed_m_s:e} m/s"
            );
            let what = format!("{links} links, ratio {ratio}, {stiffness} N/m, dt {dt}");
            assert!((sag_m - wanted_m).abs() < 1e-3 * wanted_m, "{what}: {sag_m} m, not {wanted_m} m");
            assert!((force_n - weight_n).abs() < 1e-3 * weight_n, "{what}: {force_n} N, not {weight_n} N");
            assert!(speed_m_s < 1e-4, "{what}: {speed_m_s} m/s");
        }
    }
}

#[test]
fn a_chain_that_swings_from_an_undamped_spring_gains_no_energy() {
    for stiffness in [1e2, 1e4, 1e6] {
        let mut party = chain(5, 10.0, DVec3::X, (stiffness, 0.0));
        let before_j = party.energy_j();
        // what the fall of the heavy end through the length of the chain gives
        let (scale_j, mut gained_j) = (1.4 * 0.5 * G, f64::NEG_INFINITY);
        for _ in 0..1200 {
            party.step(1.0 / 240.0);
            let sprung_j = 0.5 * stiffness * end(&party).length_squared();
            gained_j = gained_j.max(party.energy_j() + sprung_j - before_j);
        }
        println!("{stiffness} N/m: {:e} of the fall gained", gained_j / scale_j);
        assert!(gained_j < 0.01 * scale_j, "{stiffness} N/m: {gained_j} J of {scale_j} J");
    }
}

/// A chain and a tool above its first link, shut from the start, each at its own time.
struct Hanging {
    party: Party,
    tool: Tool,
    time: SimTime,
}

const TOOL: AgentId = AgentId(99);

impl Hanging {
    fn new(party: Party, stiffness_n_m: f64) -> Self {
        let down = DQuat::from_rotation_x(std::f64::consts::PI);
        let spec = ToolSpec {
            keyframes: vec![Keyframe { at_s: 0.0, tip_m: DVec3::ZERO, rotation: down, jaw: 0.0 }],
            repeat: false,
            reach_m: 0.05,
            stiffness_n_m,
            damping_n_s_m: 20.0,
            max_force_n: 50.0,
            graspable: vec![AgentId(0)],
            starts_off_m: DVec3::ZERO,
        };
        Self { party, tool: Tool::new(spec).unwrap(), time: SimTime::ZERO }
    }

    fn state(&self) -> ToolState {
        let mut seen = Snapshot::default();
        self.tool.write_snapshot(&mut seen);
        let Body::Tool(state) = seen.body else { panic!("a tool") };
        state
    }

    /// Steps whoever is behind, until `seconds`.
    fn run(&mut self, (chain_s, tool_s): (f64, f64), seconds: f64) {
        while self.time.as_secs_f64() < seconds {
            if self.time <= self.party.time {
                let link = Snapshot { time: self.party.time, ..self.party.snapshot(0) };
                let form = self.party.bodies[0].form();
                let near = [Neighbour { form, ..Neighbour::observed(AgentId(0), Arc::new(link)) }];
                let around = StepContext { neighbours: &near, ..StepContext::alone(TOOL, self.time) };
                let dt = SimSpan::from_secs_f64(tool_s).unwrap();
                self.tool.step(dt, &around).unwrap();
                self.time += dt;
            } else {
                let mut seen = Snapshot::default();
                self.tool.write_snapshot(&mut seen);
                seen.time = self.time;
                let (form, owned) = (self.tool.form(), true);
                self.party.near = vec![Neighbour { form, owned, ..Neighbour::observed(TOOL, Arc::new(seen)) }];
                self.party.step(chain_s);
                self.party.time += SimSpan::from_secs_f64(chain_s).unwrap();
            }
        }
    }
}

#[test]
fn a_chain_hangs_from_the_link_in_the_jaws_and_the_tool_reports_all_of_its_weight() {
    for (links, steps) in [(3, (240.0, 240.0)), (3, (60.0, 600.0)), (3, (600.0, 60.0)), (8, (240.0, 24.0))] {
        let (stiffness, weight_n) = (1000.0, 0.1 * f64::from(links) * G);
        let mut hanging = Hanging::new(chain(links, 1.0, DVec3::NEG_Z, (0.0, 0.0)), stiffness);
        hanging.party.hands.clear();
        hanging.run((1.0 / steps.0, 1.0 / steps.1), 6.0);
        let (tool, link) = (hanging.state(), hanging.party.snapshot(0));
        let Some(Anchor::Local(local)) = tool.grasp.map(|grasp| grasp.anchor) else { panic!("{steps:?}: {tool:?}") };
        let state = hanging.party.state(0);
        let (sag_m, wanted_m) = (-(state.position + state.rotation * local).z, weight_n / stiffness);
        println!("{links}, {steps:?}: {sag_m} m of {wanted_m}, {} N of {weight_n}", tool.force_n);
        assert!((tool.force_n - weight_n).abs() < 0.01 * weight_n, "{links}, {steps:?}: {} N", tool.force_n);
        assert!((sag_m - wanted_m).abs() < 0.01 * wanted_m, "{links}, {steps:?}: {sag_m} m, not {wanted_m} m");
        let pair = link.pairs.iter().find(|pair| pair.with == TOOL).expect("a pair");
        assert_eq!((pair.kind, pair.contacts), (PairKind::Grasp, 1));
    }
}

#[test]
fn a_tool_presses_what_shares_a_world_as_hard_as_a_lone_body() {
    const LIMIT_N: f64 = 20.0;
    for steps in [(240.0, 240.0), (240.0, 120.0), (60.0, 600.0), (600.0, 60.0)] {
        let standing = |z: f64| RigidSpec { obstacles: floor(0.5, DQuat::IDENTITY), ..cube(0.05, DVec3::Z * z) };
        let down = DQuat::from_rotation_x(std::f64::consts::PI);
        let key = |at_s, z: f64| Keyframe { at_s, tip_m: DVec3::Z * z, rotation: down, jaw: 0.0 };
        let spec = ToolSpec {
            // to 20 mm below the top of the upper one
            keyframes: vec![key(0.0, 0.3), key(1.0, 0.18)],
            repeat: false,
            reach_m: 0.02,
            stiffness_n_m: 100.0,
            damping_n_s_m: 1.0,
            max_force_n: LIMIT_N,
            graspable: vec![],
            starts_off_m: DVec3::ZERO,
        };
        let (tool, party) = (Tool::new(spec).unwrap(), Party::new([standing(0.15), standing(0.05)]));
        let mut pressing = Hanging { party, tool, time: SimTime::ZERO };
        pressing.run((1.0 / steps.0, 1.0 / steps.1), 3.0);
        let (tip, force_n) = (pressing.state().tip, pressing.state().force_n);
        let sunk_m = [0, 1].map(|i| 0.15 - 0.1 * i as f64 - pressing.party.state(i).position.z);
        println!("{steps:?}: tip at {tip}, {force_n} N, boxes {sunk_m:?} m deep");
        // the jaws reach 5 mm before the tip
        assert!((tip.z - 0.205).abs() < 1e-3, "{steps:?}: {tip}");
        // at one moment; a tool whose steps are ten times the island's stutters
        assert!(force_n > 0.7 * LIMIT_N && force_n < 1.1 * LIMIT_N, "{steps:?}: {force_n} N");
        assert!(sunk_m.iter().all(|m| m.abs() < 2e-4), "{steps:?}: {sunk_m:?}");
    }
}
