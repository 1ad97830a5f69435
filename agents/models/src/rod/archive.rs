//! The part of a tube that is saved between steps, and read back into one of the same scene.
//!
//! In: an archive. Out: the division and the state on it, all to the bit. Never here: the specification of a tube.

use super::tube::Tube;
use metachron_core::{Archive, ArchiveError, archive_values};

impl Tube {
    /// Writes or reads the state, with its division and springs, which follow from past changes of ε and past slips.
    pub(super) fn archive_state(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.resolution, self.division, self.now, self.stepper.past)?;
        archive_values!(archive, self.let_go, self.springs, self.spec.pressure_pa, self.spec.pressure_keys)?;
        archive_values!(archive, self.rest, self.at_rest, self.acceleration, self.time)?;
        archive_values!(archive, self.script_from_s)?;
        let Self { wall, unknowns, .. } = self;
        archive.fixed("whether its wall gives", wall.is_some())?;
        wall.iter_mut().try_for_each(|wall| archive.value(&mut wall.now))?;
        unknowns.archive(archive)?;
        let (nodes, segments) = (self.division.arc_m.len(), self.division.segments());
        let is_whole = segments >= 2 && nodes == segments + 1 && self.now.is_of(segments);
        if is_whole {
            return Ok(());
        }
        let (found, expected) = (format!("one of {nodes} nodes"), format!("lists of {} nodes", segments + 1));
        Err(ArchiveError::Mismatch { what: "the tube", found, expected })
    }
}
