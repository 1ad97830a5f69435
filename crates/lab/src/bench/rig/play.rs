//! Bodies that are stepped as one cluster, step by step on this thread, and the cost of their steps.
//!
//! In: bodies, static solids, joints, the length of a step. Out: CPU time of each step, contacts, states. Never here: which bodies.

use super::machine::own_cpu;
use crate::chart::{Cluster, Member};
use anyhow::Context;
use glam::DVec3;
use metachron_contact::Agent;
use metachron_contact::detect::ClusterScene;
use metachron_contact::joint::Joint;
use metachron_contact::step::ClusterReport;
use metachron_core::{Body, SimSpan, Snapshot};
use metachron_geometry::Obstacle;
use std::time::Duration;

/// The cost of a series of steps.
pub(crate) struct Series {
    /// CPU milliseconds of each step, in rising order.
    ms: Vec<f64>,
    /// The most contacts of a step.
    pub(crate) contacts: u32,
}

/// The bound of a series: whichever comes first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bound {
    pub(crate) steps: u32,
    pub(crate) span: Duration,
}

/// A cluster of bodies.
pub(crate) struct Play {
    cluster: Cluster,
    snapshot: Snapshot,
}

impl Play {
    /// Bodies among static solids, in steps of `step_s` seconds.
    pub(crate) fn new(bodies: Vec<Box<dyn Agent>>, obstacles: &[Obstacle], step_s: f64) -> anyhow::Result<Self> {
        let mut cluster = Cluster::new(ClusterScene::new(obstacles).context("the static solids")?);
        for body in bodies {
            cluster.add(body, step_s).context("a body that touches nothing")?;
        }
        Ok(Self { cluster, snapshot: Snapshot::default() })
    }

    /// The same with steps of another length from now on.
    pub(crate) fn in_steps_of(mut self, step_s: f64) -> Self {
        self.cluster.members.iter_mut().for_each(|body| body.step_s = step_s);
        self
    }

    /// The same with steps of its own length of each body.
    pub(crate) fn in_own_steps(mut self, steps_s: &[f64]) -> Self {
        self.cluster.members.iter_mut().zip(steps_s).for_each(|(body, step_s)| body.step_s = *step_s);
        self
    }

    /// The same with joints between its bodies, which are numbered in their order.
    pub(crate) fn jointed(mut self, joints: Vec<Joint>) -> anyhow::Result<Self> {
        self.cluster.scene = self.cluster.scene.jointed(joints.into()).context("the joints")?;
        Ok(self)
    }

    /// The same with at most so many factors of each solve; `None` for as many as the laws of contact take.
    pub(crate) fn within(mut self, factors_max: Option<u32>) -> Self {
        self.cluster.stepper.set_factors_max(factors_max);
        self
    }

    /// The time so far, seconds.
    pub(crate) fn time_s(&self) -> f64 {
        self.cluster.time.as_secs_f64()
    }

    /// Makes one macro step.
    pub(crate) fn step(&mut self) -> anyhow::Result<ClusterReport> {
        Ok(self.cluster.step(SimSpan::from_nanos(u64::MAX))?)
    }

    /// Steps on within a bound and measures each step; at least one.
    pub(crate) fn measured(&mut self, bound: Bound) -> anyhow::Result<Series> {
        let begun = own_cpu();
        let (mut ms, mut contacts) = (Vec::with_capacity(bound.steps as usize), 0);
        for _ in 0..bound.steps.max(1) {
            let from = own_cpu();
            contacts = contacts.max(self.step()?.contacts);
            let now = own_cpu();
            ms.push((now - from).as_secs_f64() * 1e3);
            if now - begun > bound.span {
                break;
            }
        }
        ms.sort_by(f64::total_cmp);
        Ok(Series { ms, contacts })
    }

    /// Kinetic, potential and stored energy of all bodies, J.
    pub(crate) fn energy_j(&mut self) -> f64 {
        let Self { cluster, snapshot } = self;
        let of = |body: &Member| {
            body.agent.write_snapshot(snapshot);
            snapshot.energy_j
        };
        cluster.members.iter().map(of).sum()
    }

    /// Where the middle of each body is that has one, metres: its centre of mass, or the mean of its points.
    pub(crate) fn middles(&mut self) -> Vec<DVec3> {
        let Self { cluster, snapshot } = self;
        let mean = |list: &[DVec3]| list.iter().sum::<DVec3>() / list.len() as f64;
        let of = |body: &Member| {
            body.agent.write_snapshot(snapshot);
            match &snapshot.body {
                Body::Rigid(state) => Some(state.position),
                Body::Soft(soft) => Some(mean(&soft.positions)),
                Body::Curve(curve) => Some(mean(&curve.positions)),
                _ => None,
            }
        };
        cluster.members.iter().filter_map(of).collect()
    }

    /// Where the points of a soft body are.
    pub(crate) fn points(&mut self, body: usize) -> Vec<DVec3> {
        self.cluster.members[body].agent.write_snapshot(&mut self.snapshot);
        match &self.snapshot.body {
            Body::Soft(soft) => soft.positions.clone(),
            Body::Curve(curve) => curve.positions.clone(),
            _ => Vec::new(),
        }
    }
}

impl Series {
    /// Milliseconds that a share of the steps does not exceed.
    pub(crate) fn ms_at(&self, share: f64) -> f64 {
        let last = self.ms.len() - 1;
        self.ms[((share * last as f64).round() as usize).min(last)]
    }

    pub(crate) fn steps(&self) -> usize {
        self.ms.len()
    }
}
