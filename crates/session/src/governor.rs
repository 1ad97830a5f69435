//! Adapters between the runtime, which measures an agent's turns, and control, which computes the demands.
//!
//! In: a turn's measure. Out: a demand on dt and on the simulation's ε. Never here: the law.

use super::cpu_budget::AgentBudget;
use super::error_control::ErrorStatus;
use metachron_core::{Archive, ArchiveError, Resolution, SimSpan};
use metachron_lod::control;
use metachron_lod::control::{ErrorControl, ErrorMeasure, RateControl, RateDemand};
use metachron_runtime::{Demand, Governor, TurnMeasure};
use std::sync::Arc;

/// An agent's rate control as a governor of the runtime, and the data it shares with the frame loop.
pub(super) struct RateGovernor(pub RateControl, pub Arc<AgentBudget>);

impl Governor for RateGovernor {
    fn begins_with(&self) -> Demand {
        self.0.begins_with().map_or_else(Demand::default, |demand| demanded(demand, None))
    }

    fn after_step(&mut self, measure: &TurnMeasure) -> Demand {
        let Self(control, budget) = self;
        control.set_share(budget.share());
        control.set_visible(budget.visible());
        let turn = control::TurnMeasure {
            work_s: measure.work_s,
            wanted_period_s: measure.wanted_period_s,
            real_period_s: measure.real_period_s,
            dt_s: measure.dt.as_secs_f64(),
        };
        let demand = control.after_turn(&turn);
        if let Some(load) = control.full_load() {
            budget.report_load(load);
        }
        demand.map_or_else(Demand::default, |demand| demanded(demand, measure.resolution))
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let Self(control, budget) = self;
        archive.value(control)?;
        budget.archive(archive)
    }
}

/// An agent's error control as a governor of the runtime, and the data it publishes for the frame loop.
pub(super) struct ErrorGovernor(pub ErrorControl, pub Arc<ErrorStatus>);

impl Governor for ErrorGovernor {
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand {
        let Self(control, status) = self;
        let TurnMeasure { residual_m, drift_m, .. } = *measure;
        let space_m = (residual_m - drift_m).max(0.0);
        let turn = ErrorMeasure { space_m, time_m: drift_m, dt_s: measure.dt.as_secs_f64() };
        let demand = control.after_turn(&turn);
        status.publish(control.rest());
        demand.map_or_else(Demand::default, |demand| demanded(demand, measure.resolution))
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let Self(control, status) = self;
        archive.value(control)?;
        status.publish(control.rest());
        Ok(())
    }
}

/// Converts control's demand to the runtime's type; the primitive level n stays as `held` has it.
fn demanded(demand: RateDemand, held: Option<Resolution>) -> Demand {
    let n = held.map_or(0, |held| held.n);
    Demand { dt: SimSpan::from_secs_f64(demand.dt_s), resolution: demand.eps_m.map(|eps_m| Resolution { eps_m, n }) }
}
