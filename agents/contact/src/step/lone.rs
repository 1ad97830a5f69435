//! Steps of an agent that meets no other, as a run makes them: by itself, or in a cluster of one.
//!
//! In: an agent, what it sees. Out: the agent a step later, the forces of springs on it. Never here: other agents.

use super::ClusterStepper;
use crate::agent::{Agent, Stepping};
use crate::detect::ClusterScene;
use crate::member::{ContactMemory, Participant};
use crate::{Law, StepContext};
use metachron_core::{AgentId, Archive, ArchiveError, Grip, PlainLoop, SimSpan, StepError, StepReport};

/// Steps one agent, and remembers what it touches between steps.
#[derive(Default)]
pub struct LoneStepper {
    scene: ClusterScene,
    stepper: ClusterStepper,
    memory: ContactMemory,
    grips: Vec<Grip>,
    laws: Vec<(AgentId, Law)>,
}

impl LoneStepper {
    /// Advances `agent` by exactly `dt`, and stops it where it may rest.
    ///
    /// # Errors
    /// The errors of [`ClusterStepper::step`] and of [`crate::OwnSteps::step`].
    pub fn step(
        &mut self,
        agent: &mut dyn Agent,
        dt: SimSpan,
        context: StepContext<'_>,
    ) -> Result<StepReport, StepError> {
        let member = match agent.stepping() {
            Stepping::Own(own) => return own.step(dt, &context),
            Stepping::Cluster(member) => member,
        };
        let Self { scene, stepper, memory, grips, laws } = self;
        let id = context.me;
        laws.clear();
        laws.extend(context.neighbours.iter().map(|other| (other.id, other.law)));
        let mut all = [Participant {
            id,
            member: member.into(),
            context,
            laws,
            memory,
            parts: 1,
            alone_s: dt.as_secs_f64(),
            grips,
        }];
        let report = stepper.step(scene, &mut all, dt, &PlainLoop)?;
        let [Participant { member, .. }] = &mut all;
        let at_rest = stepper.lets_rest() && member.can_sleep();
        if at_rest {
            member.change(|m| m.sleep());
        } else {
            member.change(|m| m.adapt());
        }
        Ok(StepReport { work: report.work, substeps: report.fine_steps, at_rest })
    }

    /// The mean forces of springs and grasps on the agent over the last step.
    #[must_use]
    pub fn grips(&self) -> &[Grip] {
        &self.grips
    }

    /// Writes or reads the state that the next step starts from.
    ///
    /// # Errors
    /// [`ArchiveError`] for what is no state of one.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.memory)?;
        self.stepper.archive(archive)
    }
}
