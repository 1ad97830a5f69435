//! What is in the place of an agent that has left.

use metachron_contact::{Agent, StepContext};
use metachron_core::{Archive, ArchiveError, Body, SimSpan, Snapshot, StepError, StepReport, check_span};

/// Its model.
pub(super) const REMOVED: &str = "removed";

/// No matter, no time, nothing to save.
pub(super) struct RemovedAgent;

impl Agent for RemovedAgent {
    fn model(&self) -> &'static str {
        REMOVED
    }

    fn step(&mut self, dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        check_span(dt).map(|_| StepReport { work: 0.0, substeps: 0, at_rest: true })
    }

    fn archive(&mut self, _archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        Ok(())
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.body = Body::Nothing;
    }
}
