//! Heavy on light: stacks and chains whose far end weighs a hundred or a thousand times as much, compared with other engines.
//!
//! Cubes of 1 m on a floor, each an agent; twenty links on ball joints. Measurements of the other engines, made once, are in
//! `peers.csv`: for each engine the best of its variants at this mass ratio and step.

use super::super::lockstep_run::LockstepRun;
use super::common::{GRAVITY, plain_body};
use crate::chart::accuracy::peers::stored;
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, claims, count_of, each, table, worst,
};
use glam::{DQuat, DVec3};
use metachron_contact::detect::ClusterScene;
use metachron_core::{AgentId, Body, RigidState, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{Joint, JointKind, RigidBody, RigidSpec};
use metachron_runtime::AgentSpawn;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The experiment.
pub(in super::super) struct Heavy;

const PEERS: &str = include_str!("peers.csv");
const TESTS: [&str; 4] = ["stack2", "stack10", "chain20-hang", "chain20-swing"];
const RATIOS: [f64; 3] = [1.0, 100.0, 1000.0];
const RATES_HZ: [f64; 2] = [60.0, 240.0];
/// Length of each run, seconds, and the interval of samples.
const SECONDS: f64 = 5.0;
const LOOK_S: f64 = 1.0 / 60.0;
/// A stack holds whose top has sunk less than this, metres, and none of whose boxes has moved sideways by more than this.
const SINK_MAX_M: f64 = 0.1;
const ASIDE_MAX_M: f64 = 0.25;
/// A chain holds that is never stretched by more than this share of its length, and whose energy never exceeds that of the start
/// by more than this share of the energy that its fall can give.
const STRETCH_MAX: f64 = 1e-3;
const GAIN_MAX: f64 = 0.01;
/// Half the length of a link, metres.
const HALF_LINK_M: f64 = 0.1;
const LINKS: u32 = 20;

/// A test.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    test: &'static str,
    ratio: f64,
    rate_hz: f64,
}

/// The results of a test.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(in super::super) struct Found {
    /// Sink of the top, metres, or greatest stretch of the chain as a share of its length.
    value: f64,
    /// Greatest sideways displacement of a box, metres.
    aside_m: f64,
    /// Greatest energy above that of the start, as a share of the energy that the fall can give.
    gain: f64,
    holds: bool,
    /// Number of agents led by another one, in a cluster.
    led: usize,
    /// The least value of another engine that holds at this mass ratio and step.
    best_peer_value: Option<f64>,
    best_peer: String,
}

type Row = Measured<Case, Found>;

/// One measurement of another engine.
#[derive(Debug, Clone, Deserialize)]
struct Peer {
    test: String,
    ratio: f64,
    inv_dt: f64,
    peer: String,
    variant: String,
    value: Option<f64>,
    status: String,
}

/// All measurements of other engines.
fn peers() -> Vec<Peer> {
    stored(PEERS)
}

/// The best of the other engines that hold.
fn best_peer(case: &Case) -> Option<Peer> {
    let same =
        |p: &Peer| p.test == case.test && p.ratio == case.ratio && p.inv_dt == case.rate_hz && p.status == "holds";
    let value = |p: &Peer| p.value.unwrap_or(f64::INFINITY);
    peers().into_iter().filter(same).min_by(|a, b| value(a).total_cmp(&value(b)))
}

impl Experiment for Heavy {
    type Row = Row;
    const NAME: &'static str = "heavy-on-light";
    const TITLE: &'static str = "stacks and chains with a heavy end: sink and stretch, compared with other engines";
    const TABLE: fn(&[Row]) -> Table = table!(|r| test: r.case.test, ratio: r.case.ratio, rate_hz: r.case.rate_hz,
        value(6): r.value, aside_m(6): r.aside_m, gain(6): r.gain, holds: r.holds, "best peer"(6): r.best_peer_value,
        peer: r.best_peer);

    fn cases(quick: bool) -> Vec<Case> {
        let (ratios, rates_hz) = if quick { (&RATIOS[2..], &RATES_HZ[..1]) } else { (&RATIOS[..], &RATES_HZ[..]) };
        each!(test in TESTS, &ratio in ratios, &rate_hz in rates_hz => Case { test, ratio, rate_hz })
    }

    fn measure(case: &Case) -> Option<Found> {
        let is_stack = case.test.starts_with("stack");
        let result = if is_stack { cube_stack(case) } else { hanging_chain(case) };
        let peer = best_peer(case);
        let mut found = Found {
            best_peer_value: peer.as_ref().and_then(|p| p.value),
            best_peer: peer.map_or_else(String::new, |p| format!("{} {}", p.peer, p.variant)),
            ..result.unwrap_or(Found { value: f64::NAN, ..Found::default() })
        };
        found.holds = if is_stack {
            found.value.abs() <= SINK_MAX_M && found.aside_m <= ASIDE_MAX_M
        } else {
            found.value <= STRETCH_MAX && found.gain <= GAIN_MAX
        };
        Some(found)
    }

    fn figure(rows: &[Row]) -> Figure {
        let panels = TESTS.into_iter().map(|test| panel(test, rows)).collect();
        Figure::new("Heavy on light, steps of 1/60 s (large) and 1/240 s", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let worse = |r: &Row| r.best_peer_value.is_some_and(|best| r.value.abs() > best.max(STRETCH_MAX));
        claims![
            "cases that fail where another engine holds" => count_of(rows, |r| !r.holds && !r.best_peer.is_empty()), at_most 0.0;
            "cases that fail" => count_of(rows, |r| !r.holds), at_most 0.0;
            "cases that sink or stretch by more than 0.001 and more than the best engine" => count_of(rows, worse), at_most 0.0;
        ]
    }
}

fn rigid(snapshot: &Snapshot) -> Option<RigidState> {
    match snapshot.body {
        Body::Rigid(state) => Some(state),
        _ => None,
    }
}

/// Stacks cubes a millimetre apart; the top one is heavier.
fn cube_stack(case: &Case) -> Option<Found> {
    let count: u32 = case.test.strip_prefix("stack")?.parse().ok()?;
    let scene = Arc::new(ClusterScene::new(&[Obstacle::new("floor", Solid::Plane)]).ok()?);
    let mut spawns = Vec::new();
    for i in 0..count {
        let mass = if i + 1 == count { 1000.0 * case.ratio } else { 1000.0 };
        let half_extents_m = DVec3::splat(0.5);
        let plain = plain_body(Solid::Box { half_extents_m }, DVec3::Z * (0.5 + 1.001 * f64::from(i)), mass);
        let gravity = DVec3::NEG_Z * GRAVITY;
        let spec = RigidSpec { friction: 0.5, gravity, ..plain };
        let one = AgentSpawn::alone(format!("box-{i}"), Box::new(RigidBody::new(spec).ok()?), case.rate_hz);
        spawns.push(AgentSpawn { scene: Arc::clone(&scene), ..one });
    }
    let mut run = LockstepRun::start(spawns).ok()?;
    run.run_to(SECONDS);
    let states: Vec<RigidState> = run.snapshots().iter().filter_map(|s| rigid(s)).collect();
    let top = states.last()?.position.z;
    Some(Found {
        value: f64::from(count) - 0.5 - top,
        aside_m: worst(states.iter().map(|s| s.position.truncate().length())),
        led: run.steps().iter().filter(|(_, leader)| leader.is_some()).count(),
        ..Found::default()
    })
}

/// Hangs a chain from the origin, straight down or horizontal; the last link is heavier.
fn hanging_chain(case: &Case) -> Option<Found> {
    let along = if case.test.ends_with("swing") { DVec3::X } else { DVec3::NEG_Z };
    let joint = |i: u32| Joint {
        anchor_a_m: DVec3::Z * HALF_LINK_M,
        anchor_b_m: if i == 0 { DVec3::ZERO } else { DVec3::NEG_Z * HALF_LINK_M },
        ..Joint::new(AgentId(i), i.checked_sub(1).map(AgentId), JointKind::Spherical)
    };
    let scene = Arc::new(ClusterScene::default().jointed((0..LINKS).map(joint).collect()).ok()?);
    let mass = |i: u32| if i + 1 == LINKS { case.ratio } else { 1.0 };
    let mut spawns = Vec::new();
    for i in 0..LINKS {
        let solid = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
        let plain = plain_body(solid, along * (HALF_LINK_M * (1.0 + 2.0 * f64::from(i))), mass(i));
        let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, along);
        let spec = RigidSpec { rotation, gravity: DVec3::NEG_Z * GRAVITY, ..plain };
        let body = Box::new(RigidBody::new(spec).ok()?);
        let mut one = AgentSpawn::alone(format!("link-{i}"), body, case.rate_hz);
        one.scene = Arc::clone(&scene);
        spawns.push(one);
    }
    let mut run = LockstepRun::start(spawns).ok()?;
    let mut result = Found::default();
    let length = 2.0 * HALF_LINK_M * f64::from(LINKS);
    let scale = GRAVITY * length * (case.ratio + 0.5 * f64::from(LINKS - 1));
    let (mut start_j, mut t) = (None, 0.0);
    while t < SECONDS {
        let snapshots = run.snapshots();
        let gap = gaps_m(&snapshots)?;
        // velocities are those of the middle of a step
        let falls_m_s = |(i, s): (u32, &Arc<Snapshot>)| Some(mass(i) * rigid(s)?.velocity.z);
        let falls_kg_m_s: f64 = (0..).zip(&snapshots).filter_map(falls_m_s).sum();
        let energy_j = snapshots.iter().map(|s| s.energy_j).sum::<f64>() - 0.5 * GRAVITY * falls_kg_m_s / case.rate_hz;
        let start_j = *start_j.get_or_insert(energy_j);
        result.value = worst([result.value, gap / length]);
        result.gain = worst([result.gain, (energy_j - start_j) / scale]);
        t += LOOK_S;
        run.run_to(t);
    }
    result.led = run.steps().iter().filter(|(_, leader)| leader.is_some()).count();
    Some(result)
}

/// Sum of the gaps of all joints, metres.
fn gaps_m(snapshots: &[Arc<Snapshot>]) -> Option<f64> {
    let (mut sum, mut end) = (0.0, DVec3::ZERO);
    for snapshot in snapshots {
        let RigidState { position, rotation, .. } = rigid(snapshot)?;
        let half = rotation * DVec3::Z * HALF_LINK_M;
        sum += (position + half).distance(end);
        end = position - half;
    }
    Some(sum)
}

/// Sink or stretch over the mass ratio: our own as lines, other engines that hold as dots.
fn panel(test: &str, rows: &[Row]) -> Panel {
    const FLOOR: f64 = 1e-9;
    let mut layers = Vec::new();
    for (rate_hz, colour) in RATES_HZ.into_iter().zip([Colour::Blue, Colour::Sky]) {
        let here = rows.iter().filter(|r| r.case.test == test && r.case.rate_hz == rate_hz);
        let points = here.map(|r| (r.case.ratio, r.value.abs().max(FLOOR)));
        layers.push(Layer::line(format!("metachron, {rate_hz} Hz"), colour, points));
    }
    let others = [("mujoco 4.0.0", Colour::Red), ("pybullet 3.2.7", Colour::Orange), ("rapier3d 0.36", Colour::Green)];
    let all = peers();
    for (name, colour) in others {
        let here = all.iter().filter(|p| p.test == test && p.peer == name && p.status == "holds");
        let points: Vec<_> = here.filter_map(|p| Some((p.ratio, p.value?.max(FLOOR)))).collect();
        if !points.is_empty() {
            layers.push(Layer::dots(name, colour, points));
        }
    }
    let what = if test.starts_with("stack") { "sink, m" } else { "stretch / length" };
    Panel::new(test, Axis::log("mass ratio", 0.7, 1500.0), Axis::log(what, FLOOR, 100.0), layers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_values_of_other_engines() {
        for case in Heavy::cases(false) {
            let here = |p: &&Peer| p.test == case.test && p.ratio == case.ratio && p.inv_dt == case.rate_hz;
            assert!(peers().iter().filter(here).count() >= 2, "{case:?}");
        }
    }
}
