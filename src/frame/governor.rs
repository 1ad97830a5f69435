//! The seam between the runtime, which measures an agent's turns, and control, which knows what to demand.
//!
//! In: a turn's measure. Out: a demand on dt and on the simulation's ε. Never here: the law.

use crate::control::{self, RateControl};
use crate::runtime::{Demand, Governor, TurnMeasure};
use metachron_agents::{Resolution, SimSpan};

/// An agent's own rate control as the runtime wants it.
pub(super) struct RateGovernor(pub RateControl);

impl Governor for RateGovernor {
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand {
        let turn = control::TurnMeasure {
            work_s: measure.work_s,
            wanted_period_s: measure.wanted_period_s,
            real_period_s: measure.real_period_s,
            dt_s: measure.dt.as_secs_f64(),
        };
        let Some(demand) = self.0.after_turn(&turn) else { return Demand::default() };
        let level = measure.resolution.map_or(0, |held| held.n);
        Demand {
            dt: SimSpan::from_secs_f64(demand.dt_s),
            resolution: demand.eps_m.map(|eps_m| Resolution { eps_m, n: level }),
        }
    }
}
