//! Tubes and tools: what is held, what is pushed, what is let in.

use super::meetings::{RADIUS, nodes, thrown};
use crate::harness::{Faults, Stage};
use crate::tool::Tool;
use crate::tool::{Keyframe, ToolSpec};
use glam::{DQuat, DVec3};
use metachron_core::PairKind;
use metachron_core::{AgentId, Body, Snapshot, ToolState};

const TUBE: AgentId = AgentId(0);

/// A tool along x, its tip from `from` to `to` in half a second, its jaws from open to `jaw` on the way.
fn tool(from: DVec3, to: DVec3, jaw: f64, graspable: Vec<AgentId>) -> Tool {
    let key = |at_s, tip_m, jaw| Keyframe { at_s, tip_m, rotation: DQuat::from_rotation_y(1.2), jaw };
    let keyframes = vec![key(0.0, from, if jaw > 0.0 { jaw } else { 0.4 }), key(0.1, from, jaw), key(0.5, to, jaw)];
    let (stiffness_n_m, damping_n_s_m) = (100.0, 0.5);
    let (repeat, reach_m, max_force_n, starts_off_m) = (false, 0.02, 50.0, DVec3::ZERO);
    let spec =
        ToolSpec { keyframes, repeat, reach_m, stiffness_n_m, damping_n_s_m, max_force_n, graspable, starts_off_m };
    Tool::new(spec).unwrap()
}

fn state(snapshot: &Snapshot) -> ToolState {
    let Body::Tool(tool) = &snapshot.body else { panic!("a tool") };
    *tool
}

/// All that the tube has given to `to` so far, N·s: within the first second it stands on one page.
fn given(stage: &Stage, to: AgentId) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for ledger in stage.newest(TUBE).given.iter().filter(|ledger| ledger.with == to) {
        ledger.since(None, stage.newest(TUBE).time, |_, impulse, _| sum += impulse.linear);
    }
    sum
}

#[test]
fn what_a_tool_pulls_on_a_tube_the_tube_gives_to_the_tool() {
    for rates in [(1000.0, 1000.0), (1000.0, 120.0), (120.0, 1000.0)] {
        let mut stage = Stage::new(Faults::default());
        let path = vec![DVec3::X * -0.2, DVec3::X * 0.2];
        let tube = stage.add(thrown(path, 20, DVec3::ZERO), rates.0);
        let above = DVec3::new(0.05, 0.0, RADIUS);
        let held = stage.add(tool(above, above + DVec3::Z * 0.1, 0.0, vec![tube]), rates.1);
        let (mut drift, mut felt) = (0.0_f64, 0.0_f64);
        stage.run(0.9, |stage| {
            let mut on_its_way = DVec3::ZERO;
            stage.on_their_way(held, stage.newest(held).time, |sum, _| on_its_way += sum.linear);
            let gained = stage.momentum() - on_its_way;
            drift = drift.max((gained + given(stage, held)).length());
            felt = felt.max(state(stage.newest(held)).force_n);
        });
        let lifted = stage.momentum().z;
        println!("{rates:?}: drift {drift:e} felt {felt} lifted {lifted}");
        assert!(state(stage.newest(held)).grasp.is_some(), "it holds");
        assert!(felt > 0.1, "{rates:?}: it feels {felt} N");
        assert!(drift < 1e-12, "{rates:?}: both sides differ by {drift} N·s"); // of 0.05 N·s
        assert!(stage.newest(tube).pairs.iter().any(|pair| pair.with == held && pair.kind == PairKind::Grasp));
    }
}

#[test]
fn shut_jaws_push_a_tube_and_open_ones_let_it_in() {
    for (jaw, pushed) in [(0.0, true), (1.0, false)] {
        let mut stage = Stage::new(Faults::default());
        let tube = stage.add(thrown(vec![DVec3::X * -0.2, DVec3::X * 0.2], 20, DVec3::ZERO), 500.0);
        let above = DVec3::new(0.0, 0.0, 0.06);
        let tool = stage.add(tool(above, above - DVec3::Z * 0.05, jaw, vec![]), 120.0);
        stage.run(0.5, |_| {});
        let z = nodes(stage.newest(tube))[10].z;
        let felt = given(&stage, tool).length();
        println!("jaw {jaw}: z {z} given {felt}");
        assert_eq!((z < -5e-3, felt > 0.0), (pushed, pushed), "jaws {jaw} open: {z} m, {felt} N·s");
    }
}
