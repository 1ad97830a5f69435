//! A tool and a tube, each seeing only what the other last published: grasp, drag, feel, let go.

use glam::{DQuat, DVec3};
use metachron_contact::{Agent, Neighbour, StepContext};
use metachron_core::{AgentId, Body, Resolution, ResolutionRange, SimSpan, SimTime, Snapshot, ToolState};
use metachron_models::rod::Tube;
use metachron_models::rod::{Material, Section, TubeSpec};
use metachron_models::tool::Tool;
use metachron_models::tool::{Keyframe, ToolSpec};
use std::sync::Arc;

const TUBE: AgentId = AgentId(0);
const TOOL: AgentId = AgentId(1);
const DT: SimSpan = SimSpan::from_nanos(4_000_000);
const STIFFNESS_N_M: f64 = 40.0;

/// Half a metre of soft tube along x, held at both ends, no gravity: nothing but the tool moves it.
fn tube() -> Tube {
    let material = Material { young_pa: 1e5, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(0.015, 0.002, material);
    let resolution = Resolution { eps_m: 0.02, n: 3 };
    let free = TubeSpec::free(vec![DVec3::ZERO, DVec3::X * 0.5], section, 25);
    let range = ResolutionRange::fixed(resolution);
    Tube::new(TubeSpec { resolution, range, damping_per_s: 8.0, clamp: [true; 2], sleep: true, ..free }).unwrap()
}

/// Shuts over the tube, lifts it by 4 cm, waits, and opens at 6 s.
fn tool() -> Tool {
    let key = |at_s, z, jaw| Keyframe { at_s, tip_m: DVec3::new(0.21, 0.0, z), rotation: DQuat::IDENTITY, jaw };
    let keyframes =
        vec![key(0.0, 0.02, 1.0), key(0.5, 0.0, 0.0), key(2.0, 0.04, 0.0), key(6.0, 0.04, 0.0), key(6.5, 0.04, 1.0)];
    Tool::new(ToolSpec {
        keyframes,
        repeat: false,
        reach_m: 0.02,
        stiffness_n_m: STIFFNESS_N_M,
        damping_n_s_m: 0.5,
        max_force_n: 50.0,
        graspable: vec![TUBE],
        starts_off_m: DVec3::ZERO,
    })
    .unwrap()
}

/// One agent's view of the other, always one turn old.
struct Pair {
    tube: Tube,
    tool: Tool,
    time: SimTime,
    rested: bool,
}

impl Pair {
    fn published(agent: &dyn Agent, time: SimTime) -> Arc<Snapshot> {
        let mut snapshot = Snapshot { time, ..Snapshot::default() };
        agent.write_snapshot(&mut snapshot);
        Arc::new(snapshot)
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / DT.as_secs_f64()).round() as u32 {
            let tube = [Neighbour::observed(TUBE, Self::published(&self.tube, self.time))];
            let tool = [Neighbour::observed(TOOL, Self::published(&self.tool, self.time))];
            let around = |me, neighbours| StepContext { neighbours, ..StepContext::alone(me, self.time) };
            self.rested = self.tube.step(DT, &around(TUBE, &tool)).unwrap().at_rest;
            self.tool.step(DT, &around(TOOL, &tube)).unwrap();
            self.time += DT;
        }
    }

    fn tool_state(&self) -> ToolState {
        let Body::Tool(state) = Self::published(&self.tool, self.time).body else { panic!("a tool") };
        state
    }
}

#[test]
fn a_tool_lifts_a_tube_feels_its_spring_and_lets_it_sink_back() {
    let mut pair = Pair { tube: tube(), tool: tool(), time: SimTime::ZERO, rested: false };
    pair.run(0.3);
    assert_eq!(pair.tool_state().grasp, None, "the jaws are still open");
    pair.run(5.7);

    let (tool, body) = (pair.tool_state(), Pair::published(&pair.tube, pair.time).body.clone());
    let grasp = tool.grasp.expect("it holds");
    let point = body.point(grasp.anchor).expect("a tube has such a point").0;
    assert!(point.z > 0.01, "it lifts the tube to {point}");
    // at rest the spring carries all: what the tool feels, one turn late, is k × how far the tube lags behind
    let spring_n = STIFFNESS_N_M * tool.tip.distance(point);
    assert!((tool.force_n - spring_n).abs() < 1e-3 * spring_n, "{} N, not {spring_n} N", tool.force_n);
    assert!(!pair.rested, "a tube in the jaws must not sleep");

    pair.run(9.0);
    assert_eq!((pair.tool_state().grasp, pair.tool_state().force_n), (None, 0.0));
    let sag = Pair::published(&pair.tube, pair.time).body.probe(0.42).unwrap().0.z;
    assert!(sag.abs() < 1e-3, "let go it comes back to {sag} m"); // 9 s of damping at 4/s are e⁻³⁶; what is left is creep
    assert!(pair.rested, "and sleeps");
}
