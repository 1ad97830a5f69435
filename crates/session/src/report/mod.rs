//! The output of a run: the report, statistics of frames, and goals on the report's numbers.
//!
//! In: measured numbers. Out: JSON, CSV rows, verdicts. Never here: measuring (the frame loop does), and where files go.

mod choices;
mod frames;
mod goal;
mod summary;

pub use choices::{ChoiceSummary, PrimitiveSummary, ScaleSummary, ShadingSummary, summarise_choices};
pub use frames::{
    BINDING, FrameSummary, MISS, SETTLE_BAND, SETTLE_HOLD, SETTLE_MEDIAN, Statistics, summarise, summarise_undrawn,
};
pub use goal::{Goal, GoalError, Verdict};

use metachron_devices::DeviceReport;
use metachron_world::{Moved, Overlap};
use serde::Serialize;

/// The report of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The scene's name.
    pub scene: String,
    /// The policy that chose levels.
    pub policy: String,
    /// The feedback law.
    pub law: String,
    /// The executor of the agents.
    pub executor: String,
    /// How time passed at the end: `free` where it waited for agents, else `real-time`, whatever its speed.
    pub pace: &'static str,
    /// The adapter that drew; `None` where nothing was drawn.
    pub adapter: Option<String>,
    /// Frames made.
    pub frames: u64,
    /// Simulated seconds.
    pub sim_s: f64,
    /// Wall-clock seconds from the first step on; in lockstep, seconds of the virtual clock.
    pub wall_s: f64,
    /// Seconds before that: opening the adapter, measuring it, a first picture.
    pub start_up_s: f64,
    /// CPU seconds of the agents' turns alone, as measured.
    pub cpu_s: f64,
    /// Hash of every agent's last state, 16 hexadecimal digits: equal hashes mean equal bits.
    pub state_hash: String,
    /// Target time of a frame, milliseconds.
    pub target_ms: f64,
    /// Work, intervals and misses of the frames.
    #[serde(flatten)]
    pub summary: FrameSummary,
    /// The agents, in the scene's order.
    pub agents: Vec<AgentReport>,
    /// The couplings between agents.
    pub couplings: Vec<CouplingReport>,
    /// Events of attachments, in the order of time; left out where there were none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<EventReport>,
    /// Touches of sensors, and how often; left out where there were none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<SensorReport>,
    /// The readings of the scene's sensors at the end; left out where it has none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub readings: Vec<ReadingReport>,
    /// Devices that led objects, and the forces that they felt; left out where there were none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub devices: Vec<DeviceReport>,
    /// The hosts that stepped the world together; left out where there were none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hosts: Vec<HostReport>,
    /// How often these went back to states that they had kept, as an object moved farther than was reckoned with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub escapes: Option<u64>,
    /// Warnings about its figures, of a world elsewhere: a link that anybody may listen to, objects that were not shown; left out where
    /// there is nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Agents that failed and stepped no more.
    pub parked: u32,
    /// The contact clusters of the last states.
    pub clusters: Vec<ClusterRow>,
    /// Agents that started inside each other or fixed solids.
    pub overlaps: Vec<OverlapReport>,
    /// Objects that start elsewhere than the scene puts them, because of that.
    pub moved: Vec<MovedReport>,
    /// The effect of different clocks, where requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub oracle: Option<ReferenceReport>,
    /// How the frame budget was spent.
    pub budget: BudgetReport,
    /// The scene's probes.
    pub probes: Vec<ProbeReport>,
}

/// One of the hosts that stepped a world together.
#[derive(Debug, Clone, Default, Serialize)]
pub struct HostReport {
    /// Its name.
    pub name: String,
    /// Objects that it stepped at the end.
    pub agents: usize,
    /// CPU seconds of its steps.
    pub cpu_s: f64,
    /// The newest window's time beside its steps, milliseconds: the link there and back, and what was said on it.
    pub link_ms: f64,
    /// Objects that came to it from other hosts.
    pub moved: u64,
    /// Of these those whose host was lost.
    pub reborn: u64,
    /// Why it was lost; `None` of one that stepped to the end.
    pub lost: Option<String>,
}

/// One agent of a run.
#[derive(Debug, Clone, Default, Serialize)]
pub struct AgentReport {
    /// Its name in the scene.
    pub name: String,
    /// Its model.
    pub model: String,
    /// The host that steps it, where several do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host: Option<String>,
    /// Its state at the end: `running`, `resting` or `parked`.
    pub state: &'static str,
    /// Steps taken.
    pub steps: u64,
    /// Steps per simulated second while it was awake.
    pub rate_hz: f64,
    /// Requested steps per second.
    pub wanted_hz: f64,
    /// Last step length, milliseconds.
    pub dt_ms: f64,
    /// Last spacing of its simulation, metres; `None` for a model without one.
    pub eps_m: Option<f64>,
    /// Number of nodes that its last state was solved at; `None` for a model without nodes.
    pub nodes: Option<u32>,
    /// Level of the primitive that its picture was last drawn with; `None` where it was never drawn.
    pub n: Option<u8>,
    /// Spacing that its picture was last drawn with, metres; `None` for a model without one.
    pub picture_eps_m: Option<f64>,
    /// CPU seconds of its turns, as measured.
    pub cpu_s: f64,
    /// Age of its state when drawn.
    pub age_ms: Quantiles,
    /// Lateness of the starts of its turns.
    pub late_ms: Quantiles,
    /// Simulated seconds that it has lived, ≥ 0: its steps, longer ones by their length, and its time at rest. It may be more than `sim_s` by
    /// less than a step: a state covers the step that leads to it.
    pub lived_s: f64,
    /// Simulated seconds since its start that it has not lived, ≥ 0: its dropped time, and its lag when the run ended;
    /// 0 where it failed.
    pub given_up_s: f64,
    /// Steps, of `steps`, that were longer than was asked for then, by its rate or by control within the range that the
    /// scene allows: steps of an agent that is late are, by up to 2.5 times near others.
    pub lengthened: u64,
    /// Steps of its cluster in which its motion asked for more division than a step may have; `None` where there were none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub under_resolved: Option<u64>,
    /// Simulated milliseconds that could not be made up, ≥ 0.
    pub dropped_ms: f64,
    /// Simulated milliseconds at rest.
    pub rested_ms: f64,
    /// Name of the agent that led it and whose clock it shared at the end; `None` where it kept its own clock.
    pub led_by: Option<String>,
    /// Whether it was removed from the run after a failed step.
    pub parked: bool,
    /// The reason for parking.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parked_reason: Option<String>,
    /// Mechanical energy, joules, gravity included, zero at the origin.
    pub energy_j: f64,
    /// Its own estimate of its error, metres.
    pub residual_m: f64,
    /// The part of that error caused by its steps, metres.
    pub drift_m: f64,
    /// Its error tolerance, metres; `None` where it kept a rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance_m: Option<f64>,
    /// The end of its ranges at which it rested under a tolerance: `finest` (out of reach) or `coarsest`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rests: Option<&'static str>,
}

/// Median and tail of a measured time, milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
}

/// A contact cluster: agents that touched or were joined at the end of the run, and were stepped as one problem.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ClusterRow {
    /// The name of the member that led it.
    pub id: String,
    /// The names of all members.
    pub members: Vec<String>,
    /// The last macro step, milliseconds.
    pub h_ms: f64,
    /// Share of the macro step that its turn leaves unused, by the wall time of its leader's turns, in which threads may help: 1 where they
    /// cost nothing, below zero where it cannot keep up with time.
    pub slack: f64,
    /// Steps of each member within it.
    pub steps: Vec<u32>,
    /// Contacts of the last step, including contacts that bear nothing.
    pub contacts: u32,
    /// Problems that its leader has solved in the run.
    pub problems: u64,
    /// Factors of the coupled matrix, for each problem.
    pub factors: f64,
    /// Products of conjugate gradients with the coupled matrix, for each problem: large soft bodies are solved by these, without factors.
    pub products: f64,
    /// Problems whose solve ended before all laws of contact held to the tolerance.
    pub unfinished: u64,
    /// How far the solves of the last step went: `kept`, `near`, `polished` or, where one ended before all laws held, `interior`; `rigid-pile` where rapier3d stepped a heap.
    pub level: &'static str,
    /// The greatest miss of the laws and of momentum by their answers, m/s.
    pub miss_m_s: f64,
    /// The deepest overlap of the last step, metres.
    pub depth_m: f64,
    /// The deepest overlap of the run, metres.
    pub depth_max_m: f64,
    /// How deep its contacts are made to rest, metres.
    pub depth_wanted_m: f64,
}

/// The coupling of two agents.
#[derive(Debug, Clone, Default, Serialize)]
pub struct CouplingReport {
    /// The first agent's name.
    pub a: String,
    /// The second agent's name.
    pub b: String,
    /// The kind of coupling: `cluster`, `ledger`, `tlm`, `grasp` or `attach`.
    pub kind: String,
    /// Contacts, grasps, attachments or joints at the end of the run.
    pub contacts: u64,
    /// Difference between both sides' records of the same impulses, as a share of the impulse exchanged, without impulses in flight;
    /// `None` where there are no two records, as in a cluster.
    pub momentum_error: Option<f64>,
    /// Impulses exchanged, magnitudes summed, newton seconds.
    pub impulse_n_s: f64,
    /// Impulse that one side had given and the other not yet taken in the last states, newton seconds.
    pub in_flight_n_s: f64,
    /// Inverse effective masses of `a` and `b` along the normal at the contact with the greatest load, 1/kg, when they last pressed on
    /// each other: the sum is the contact's W, its inverse the effective mass there. `None` in heaps, and where no contact was solved
    /// between the two.
    pub inverse_mass_per_kg: Option<[f64; 2]>,
    /// Overlap at the end of the run, metres.
    pub penetration_m: f64,
    /// Greatest overlap found in a frame, metres.
    pub penetration_max_m: f64,
    /// Force at the end of the run, newtons.
    pub force_n: f64,
    /// Greatest force found in a frame, newtons.
    pub force_max_n: f64,
    /// Mass that the law added, kilograms.
    pub parasitic_kg: f64,
}

/// Something that happened once in a run.
#[derive(Debug, Clone, Default, Serialize)]
pub struct EventReport {
    /// Simulated time, seconds: the end of the step in which it happened.
    pub at_s: f64,
    /// The event: `yielded`, an attachment for the first time by its `yields_above_n`, or `tore`, by its
    /// `tears_above_n`.
    pub kind: &'static str,
    /// The attachment, as its place in the scene: `joint.0`, `coupling.2`, `attach.1` of the tube `a`.
    pub attachment: String,
    /// The first object's name.
    pub a: String,
    /// The second object's name, or `world`.
    pub b: String,
    /// Force that it gave in that step, newtons.
    pub force_n: f64,
}

/// Two objects of which one, or both, only senses, and that have touched.
#[derive(Debug, Clone, Default, Serialize)]
pub struct SensorReport {
    /// The name of the one that moves; of two that do, that of the first in the scene.
    pub a: String,
    /// The other one's name.
    pub b: String,
    /// Whether they touched at the end.
    pub touching: bool,
    /// How often they began to touch.
    pub begins: u32,
    /// How often they ceased to.
    pub ends: u32,
    /// When they last began or ceased to, seconds of the first one's time.
    pub changed_s: f64,
}

/// Two agents that started inside each other.
#[derive(Debug, Clone, Default, Serialize)]
pub struct OverlapReport {
    /// The first agent's name.
    pub a: String,
    /// The second agent's name, or the fixed solid's.
    pub b: String,
    /// Depth, metres.
    pub depth_m: f64,
}

/// An object that was moved from its place in the scene, to start clear of others.
#[derive(Debug, Clone, Default, Serialize)]
pub struct MovedReport {
    /// Its name.
    pub object: String,
    /// Displacement from its place in the scene to its start, metres.
    pub by_m: [f64; 3],
}

impl OverlapReport {
    /// Of an overlap of the scene.
    #[must_use]
    pub fn of(overlap: &Overlap) -> Self {
        Self { a: overlap.a.clone(), b: overlap.b.clone(), depth_m: overlap.depth_m }
    }
}

impl MovedReport {
    /// Of an agent that the scene moved.
    #[must_use]
    pub fn of(moved: &Moved) -> Self {
        Self { object: moved.object.clone(), by_m: moved.by_m.to_array() }
    }
}

/// The same scene under one very fine common clock, and the difference from its own clocks.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ReferenceReport {
    /// Step of the common clock, milliseconds.
    pub dt_ms: f64,
    /// Simulated seconds that both runs have played: all of the run, unless Ctrl-C ended the second one.
    pub sim_s: f64,
    /// Points compared.
    pub states: u64,
    /// The greatest distance of any point on the common clock from where it is with every start moved by 1 µm, metres: smaller errors say
    /// nothing.
    pub sensitivity_m: f64,
    /// Every pair that was coupled in either run.
    pub couplings: Vec<CouplingError>,
}

/// The effect of different clocks on two coupled agents.
#[derive(Debug, Clone, Default, Serialize)]
pub struct CouplingError {
    /// The first agent's name.
    pub a: String,
    /// The second agent's name.
    pub b: String,
    /// Root mean square distance of both agents from their positions under the common clock, metres.
    pub position_rms_m: f64,
    /// Greatest such distance, metres.
    pub position_max_m: f64,
    /// Greatest difference of either agent's momentum, newton seconds.
    pub momentum_max_n_s: f64,
    /// Impulse exchanged in the run, newton seconds.
    pub impulse_n_s: f64,
    /// Impulse exchanged under the common clock, newton seconds.
    pub impulse_oracle_n_s: f64,
}

/// How the frame budget was spent.
#[derive(Debug, Clone, Default, Serialize)]
pub struct BudgetReport {
    /// Mean frame work as a share of the target; `None` where `frame_ms` is.
    pub spent_share: Option<f64>,
    /// The limit at which the control rested at the end, as text; `None` where it did not.
    pub clamped: Option<String>,
    /// Summary of the choices of levels.
    #[serde(flatten)]
    pub choices: ChoiceSummary,
}

/// A sensor's reading at the end.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ReadingReport {
    /// Its name.
    pub name: String,
    /// Its kind, as scene files write it.
    pub kind: String,
    /// Time of the state that it is of, seconds.
    pub at_s: f64,
    /// The numbers, in the order that its kind gives; none where its object has gone.
    pub values: Vec<f64>,
}

/// The motion of a probe.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ProbeReport {
    /// Name of the object.
    pub object: String,
    /// 0 start … 1 end of a tube's rest length.
    pub at: f64,
    /// Last position, metres.
    pub position_m: [f64; 3],
    /// Last velocity, m/s.
    pub velocity_m_s: [f64; 3],
    /// `[t, x, y, z]` in seconds and metres, where the scene requests samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<Vec<[f64; 4]>>,
}

impl Report {
    /// A report with one of every entry, to distinguish names that exist from others.
    #[must_use]
    fn template() -> Self {
        let frame = crate::FrameRecord { gpu_ms: Some(0.0), ..Default::default() };
        let summary = summarise(&[frame], 1.0);
        let name = String::new;
        let oracle = ReferenceReport { couplings: vec![CouplingError::default()], ..ReferenceReport::default() };
        Self {
            scene: name(),
            policy: name(),
            law: name(),
            executor: name(),
            pace: "real-time",
            adapter: None,
            frames: 0,
            sim_s: 0.0,
            wall_s: 0.0,
            start_up_s: 0.0,
            cpu_s: 0.0,
            state_hash: name(),
            target_ms: 0.0,
            summary,
            agents: vec![AgentReport { host: Some(name()), ..AgentReport::default() }],
            couplings: vec![CouplingReport::default()],
            events: vec![EventReport::default()],
            sensors: vec![SensorReport::default()],
            readings: vec![ReadingReport { values: vec![0.0], ..ReadingReport::default() }],
            devices: vec![DeviceReport::default()],
            hosts: vec![HostReport::default()],
            escapes: Some(0),
            notes: vec![name()],
            parked: 0,
            clusters: vec![ClusterRow { members: vec![name()], steps: vec![1], ..ClusterRow::default() }],
            overlaps: vec![OverlapReport::default()],
            moved: vec![MovedReport::default()],
            oracle: Some(oracle),
            budget: BudgetReport { choices: summarise_choices(&[frame]), ..BudgetReport::default() },
            probes: vec![ProbeReport::default()],
        }
    }
}

#[cfg(test)]
mod tests;
