//! Members are taken out of a cluster whose step was not made, so that the others make it in the same turn.
//!
//! In: a leader, the reason of a failure, models that are broken or have refused. Out: a leader whose cluster steps again, or why that is parked.
//! One whose code has panicked is parked; one that has refused steps by itself, to fail alone or not at all. Never here: the step
//! ([`super::macro_step`]), agents that lose touch ([`super::handover`]).

use super::Span;
use crate::turn::agent_runner::{AgentRunner, StepOutcome};
use metachron_core::SimSpan;

impl AgentRunner {
    /// Takes the members out of its cluster that are to blame for `reason`; where none is, all part.
    ///
    /// # Errors
    /// Why it is to be parked itself.
    pub fn exclude(&mut self, reason: String) -> Result<(), String> {
        if let Some(broken) = self.model.broken() {
            return Err(broken.to_owned());
        }
        if self.led.is_empty() {
            return Err(reason);
        }
        let led = self.led.len();
        self.led.each(|actor| {
            if let Some(broken) = actor.model.broken().map(str::to_owned) {
                actor.park(broken);
            }
        });
        self.led.release_parked();
        self.led.release_refusing();
        if self.model.take_refused() {
            self.release_together();
        }
        if self.led.len() == led {
            self.release_all();
        }
        Ok(())
    }

    /// Makes a step of the `wanted` length after one that was not made for `reason`, without the members to blame, each
    /// solve by at most so many steps; how many step with it.
    ///
    /// # Errors
    /// Why it is to be parked itself.
    pub fn step_without_failed(
        &mut self,
        reason: String,
        wanted: SimSpan,
        factors_max: Option<u32>,
    ) -> Result<(StepOutcome, u32), String> {
        let mut reason = reason;
        // each time fewer are left
        loop {
            self.exclude(reason)?;
            match self.step_alone(Span::Wanted(wanted), factors_max) {
                Ok(outcome) => {
                    let time = self.pace.time();
                    return Ok((outcome, self.led.members_at(time).count() as u32));
                }
                Err(again) => reason = again,
            }
        }
    }
}
