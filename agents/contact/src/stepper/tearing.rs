//! Attachments that tear: a link or joint that gave more than it can bear over a macro step is gone from the next one on.
//!
//! In: rows with the impulses that they gave. Out: what tore; its members remember nothing of it but that. Never here: what a row is made
//! of, who is told. Theory: docs/theory/clusters.md, eq. 28.

use super::Participant;
use super::memory::Partner;
use super::ties::RowOwner;
use glam::DVec3;

/// A link or joint that tore at the end of a macro step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torn {
    /// The participant that remembered it, by its place in the list: of a joint the first body, of a link the lower number.
    pub member: usize,
    /// The participant at its other end; `None` is the world.
    pub other: Option<usize>,
    /// The link or joint.
    pub partner: Partner,
    /// The force that it gave: the mean over the macro step, N.
    pub force_n: f64,
}

/// What can tear, in one macro step.
#[derive(Debug, Default)]
pub(super) struct Tearing {
    /// By participants and partners.
    loads: Vec<Load>,
    torn: Vec<Torn>,
}

/// What an attachment that may tear has given since the macro step began.
#[derive(Debug, Clone, Copy)]
struct Load {
    owner: RowOwner,
    impulse_n_s: DVec3,
}

impl Tearing {
    /// Begins a macro step, for the first time or again.
    pub fn begin(&mut self) {
        self.loads.clear();
        self.torn.clear();
    }

    /// Adds what a row gave.
    pub fn note(&mut self, owner: &RowOwner, impulse_n_s: DVec3) {
        if owner.tears_above_n == f64::INFINITY {
            return;
        }
        let order = |load: &Load| (load.owner.member, load.owner.partner);
        match self.loads.binary_search_by_key(&(owner.member, owner.partner), order) {
            Ok(at) => self.loads[at].impulse_n_s += impulse_n_s,
            Err(at) => self.loads.insert(at, Load { owner: *owner, impulse_n_s }),
        }
    }

    /// Ends a macro step of `macro_s` seconds: what gave too much has torn (eq. 28), and both its members are told.
    pub fn end(&mut self, all: &mut [Participant<'_>], macro_s: f64) {
        for Load { owner, impulse_n_s } in &self.loads {
            let force_n = impulse_n_s.length() / macro_s;
            if force_n > owner.tears_above_n {
                let RowOwner { member, other, partner, .. } = *owner;
                owner.both().for_each(|one| all[one].memory.tear(partner));
                self.torn.push(Torn { member, other, partner, force_n });
            }
        }
    }

    pub fn torn(&self) -> &[Torn] {
        &self.torn
    }
}
