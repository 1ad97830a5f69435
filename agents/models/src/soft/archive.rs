//! What of a soft body is saved between steps, and read back into one of the same scene.
//!
//! In: an archive. Out: the nodes and the state on them, all to the bit. Never here: what a body is built from.

use super::body::SoftBody;
use super::carrier::Carrier;
use metachron_core::{Archive, ArchiveError, archive_values};

impl SoftBody {
    /// Writes or reads the state, on the cage or lattice that it was divided into last.
    pub(super) fn archive_state(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let mut eps_m = self.eps_m;
        archive_values!(archive, eps_m, self.level)?;
        self.divide_for(eps_m)?;
        // cells that were removed are not saved
        archive.fixed("the number of cells", self.cells())?;
        let nodes = self.positions.len();
        let mut turns: Vec<_> = self.mesh.turns().collect();
        archive_values!(archive, self.positions, self.velocities, turns, self.before)?;
        let lengths = [self.positions.len(), self.velocities.len(), self.before.len()];
        if let Some(found) = lengths.iter().find(|length| **length != nodes) {
            let (found, expected) = (found.to_string(), nodes.to_string());
            return Err(ArchiveError::Mismatch { what: "the number of nodes", found, expected });
        }
        self.mesh.set_turns(&turns);
        archive_values!(archive, self.grips, self.acceleration, self.at_rest, self.quiet_s, self.steps)?;
        let Self { skin, doubling, unknowns, .. } = self;
        skin.iter_mut().try_for_each(|skin| skin.archive(archive))?;
        doubling.archive(archive)?;
        unknowns.archive(archive)
    }

    /// Takes the nodes of another ε, without a state on them.
    fn divide_for(&mut self, eps_m: f64) -> Result<(), ArchiveError> {
        if eps_m.to_bits() == self.eps_m.to_bits() {
            return Ok(());
        }
        let range = self.spec.resolutions().map(|range| range.eps_m);
        let is_taken = range.is_some_and(|(finest_m, coarsest_m)| (finest_m..=coarsest_m).contains(&eps_m));
        let carrier = is_taken.then(|| Carrier::new(&self.spec, eps_m)).flatten();
        let (Some(carrier), Some(skin)) = (carrier, &mut self.skin) else {
            let (found, expected) = (format!("{eps_m} m"), format!("one of {range:?}"));
            return Err(ArchiveError::Mismatch { what: "the spacing ε of nodes", found, expected });
        };
        self.mesh = carrier.mesh(&self.spec);
        skin.set_carrier(carrier);
        self.positions.clone_from(&self.mesh.rest);
        self.system = self.mesh.system(&self.positions);
        self.eps_m = eps_m;
        Ok(())
    }
}
