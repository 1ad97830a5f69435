//! The part of a soft body that is saved between steps, and read back into one of the same scene.
//!
//! In: an archive. Out: the nodes and the state on them, all to the bit. Never here: the specification of a body.

use super::body::SoftBody;
use super::division::{Division, form};
use super::touched::Touches;
use metachron_core::{Archive, ArchiveError, archive_values};

impl SoftBody {
    /// Writes or reads the state, on the cage or lattice that it was divided into last, without the cells that were removed.
    pub(super) fn archive_state(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let (mut eps_m, mut gone) = (self.eps_m, self.gone.clone());
        archive_values!(archive, eps_m, gone, self.removed, self.level)?;
        let mut touches = self.touches.clone();
        if self.spec.eps_touched_m.is_some() {
            archive.value(&mut touches)?;
        }
        self.divide_for(eps_m, &gone, touches)?;
        archive.fixed("the number of cells", self.cells())?;
        let nodes = self.positions.len();
        let mut turns: Vec<_> = self.mesh.turns().collect();
        archive_values!(archive, self.positions, self.velocities, turns)?;
        let lengths = [self.positions.len(), self.velocities.len()];
        if let Some(found) = lengths.iter().find(|length| **length != nodes) {
            let (found, expected) = (found.to_string(), nodes.to_string());
            return Err(ArchiveError::Mismatch { what: "the number of nodes", found, expected });
        }
        self.mesh.set_turns(&turns);
        archive_values!(archive, self.acceleration, self.at_rest, self.quiet_s)?;
        let Self { skin, unknowns, .. } = self;
        skin.iter_mut().try_for_each(|skin| skin.archive(archive))?;
        unknowns.archive(archive)
    }

    /// Takes the nodes of another ε and the cells but for those that are `gone`, halved as after these touches, without a state on them. A skin
    /// that has lost nothing before or after stays the same.
    fn divide_for(&mut self, eps_m: f64, gone: &[bool], touches: Touches) -> Result<(), ArchiveError> {
        let before = std::mem::replace(&mut self.touches, touches);
        let halved_m = &self.touches.halved_m;
        if eps_m.to_bits() == self.eps_m.to_bits() && gone == self.gone && *halved_m == before.halved_m {
            return Ok(());
        }
        let mismatch =
            |what: &'static str, found: String, expected: String| Err(ArchiveError::Mismatch { what, found, expected });
        let range = self.spec.resolutions().map(|range| range.eps_m);
        let is_taken = eps_m.to_bits() == self.eps_m.to_bits()
            || range.is_some_and(|(finest_m, coarsest_m)| (finest_m..=coarsest_m).contains(&eps_m));
        let division = if is_taken { Division::of(&self.spec, eps_m, halved_m).ok() } else { None };
        let Some(Division { mesh, surface, skin }) = division else {
            return mismatch("the spacing ε of nodes", format!("{eps_m} m"), format!("one of {range:?}"));
        };
        if !(gone.is_empty() && self.gone.is_empty()) {
            self.form = form(&self.spec, surface);
        }
        (self.mesh, self.skin, self.eps_m) = (mesh, skin, eps_m);
        self.positions.clone_from(&self.mesh.rest);
        self.gone.clear();
        if gone.is_empty() {
            self.system = self.mesh.system(&self.positions);
            return Ok(());
        }
        let cells = self.cells();
        if gone.len() != cells || !gone.contains(&false) {
            return mismatch("the number of cells that there were", gone.len().to_string(), cells.to_string());
        }
        self.leave_out(gone);
        Ok(())
    }
}
