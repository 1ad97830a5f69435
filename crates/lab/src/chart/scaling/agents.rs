//! The cost of a round of all agents by their number, on threads, in a pool and in lockstep, compared with the bare steps.

use super::super::super::bench::agents::{Case as Run, Executor, measure};
use super::super::experiment::Finding;
use super::growth::{Case, Cost, Growth, Row};
use crate::bench::rig::cast::Model;
use metachron_runtime::Priority;
use std::time::Duration;

/// The experiment.
pub(in super::super) struct Agents;

const EXECUTORS: [Executor; 3] = [Executor::Threads, Executor::Pool, Executor::Lockstep];
/// At most a hundred threads: `bench agents` measures more.
const THREADS_MAX: u32 = 100;
/// How long each case runs; its bare steps run half as long.
const SPAN: Duration = Duration::from_millis(1500);
/// Steps of all agents per second that one core can carry.
const STEPS_PER_S: f64 = 1e5;
const RATE_MAX_HZ: f64 = 198.0;

impl Growth for Agents {
    const NAME: &'static str = "agents";
    const TITLE: &'static str = "Cost of one step of every agent, by number of agents";
    const COUNTED: &'static str = "agents";
    const COST: &'static str = "CPU µs per round";
    const FLOOR: &'static str = "their bare steps";

    fn cases(quick: bool) -> Vec<Case> {
        let sizes: &[u32] = if quick { &[1, 100] } else { &[1, 10, 100, 1000, 10_000] };
        let mut cases = Case::of(EXECUTORS.map(Executor::name), sizes);
        cases.retain(|case| case.case != Executor::Threads.name() || case.size <= THREADS_MAX);
        cases
    }

    fn measure(case: &Case) -> Option<Cost> {
        let executor = EXECUTORS.into_iter().find(|executor| executor.name() == case.case)?;
        let count = f64::from(case.size);
        let rate_hz = (STEPS_PER_S / count).min(RATE_MAX_HZ);
        let (model, priority) = (Model::Synthetic, Priority::Normal);
        let run = Run { executor, model, agents: case.size as usize, priority, rate_hz };
        let row = measure(&run, SPAN).ok()?;
        Some(Cost { count, us: row.cpu_us_per_step * count, floor_us: row.bare_us_per_step * count })
    }

    fn findings(_: &[Row]) -> Vec<Finding> {
        Vec::new()
    }
}
