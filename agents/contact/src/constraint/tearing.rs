//! Attachments that tear: what gave more than it can bear over a macro step is gone from the next one on.
//!
//! In: rows with the impulses that they gave, what members say of their own attachments. Out: what tore; its members remember nothing of it
//! but that. Never here: what a row is made of, how events are reported. Theory: docs/theory/clusters.md, eq. 28.

use crate::constraint::RowOwner;
use crate::member::memory::{Partner, UnfinishedLoad};
use crate::member::{ClusterMember, Participant};
use glam::DVec3;

/// A macro step of at least this share of the shortest time that a member's own steps fill in it is no cut one. By (23) it is half of that
/// or more: the shortest n h is no less than h_longest/√2, the own steps of the fastest fill no more than √2 h_longest.
const WHOLE: f64 = 0.5;

/// An attachment that tore at the end of a macro step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torn {
    /// The participant that remembered it, by its place in the list: of a joint the first body, of a link the lower number, else whose own
    /// it is.
    pub member: usize,
    /// The participant at its other end; `None` is the world.
    pub other: Option<usize>,
    /// A link, a joint, or an attachment that is the participant's own.
    pub partner: Partner,
    /// The force that it gave: the mean over the macro step, and over those cut short before it, N.
    pub force_n: f64,
}

/// What can tear, in one macro step.
#[derive(Debug, Default)]
pub(crate) struct Tearing {
    /// By participants and partners.
    loads: Vec<Load>,
    torn: Vec<Torn>,
}

/// What an attachment that may tear has given since the macro step began.
#[derive(Debug, Clone, Copy)]
struct Load {
    member: usize,
    other: Option<usize>,
    partner: Partner,
    tears_above_n: f64,
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
        let RowOwner { member, other, partner, tears_above_n, .. } = *owner;
        self.add(Load { member, other, partner, tears_above_n, impulse_n_s });
    }

    /// Adds what the own attachments of a member gave over its step of `h_s` seconds, which has ended.
    pub fn note_own(&mut self, member: usize, body: &dyn ClusterMember, h_s: f64) {
        for own in body.attachments() {
            let (partner, impulse_n_s) = (Partner::Attachment(own.number), own.force_n * h_s);
            self.add(Load { member, other: None, partner, tears_above_n: own.tears_above_n, impulse_n_s });
        }
    }

    fn add(&mut self, load: Load) {
        if load.tears_above_n == f64::INFINITY {
            return;
        }
        match self.loads.binary_search_by_key(&(load.member, load.partner), |load| (load.member, load.partner)) {
            Ok(at) => self.loads[at].impulse_n_s += load.impulse_n_s,
            Err(at) => self.loads.insert(at, load),
        }
    }

    /// Ends a macro step of `macro_s` seconds: what gave too much has torn (eq. 28), and both its members remember that. What was given in
    /// a step that was cut short counts together with the next: a joint that takes back what it is off gives that as a blow.
    pub fn end(&mut self, all: &mut [Participant<'_>], macro_s: f64) {
        if self.loads.is_empty() {
            return;
        }
        let whole_s = WHOLE * filled_s(all);
        for Load { member, other, partner, tears_above_n, impulse_n_s } in self.loads.iter().copied() {
            let load = UnfinishedLoad { partner, impulse_n_s, span_s: macro_s };
            let Some(UnfinishedLoad { impulse_n_s, span_s, .. }) = all[member].memory.bear(load, whole_s) else {
                continue;
            };
            let force_n = impulse_n_s.length() / span_s;
            if force_n > tears_above_n {
                std::iter::once(member).chain(other).for_each(|one| all[one].memory.tear(partner));
                self.torn.push(Torn { member, other, partner, force_n });
            }
        }
    }

    pub fn torn(&self) -> &[Torn] {
        &self.torn
    }
}

/// The shortest time that a member's own steps within a macro step fill where nothing cuts it short, seconds.
fn filled_s(all: &[Participant<'_>]) -> f64 {
    let here = all.iter().filter(|one| !one.member.is_remote());
    here.map(|one| f64::from(one.parts) * one.alone_s).fold(f64::INFINITY, f64::min)
}

impl Participant<'_> {
    /// Lets go of its own attachments that have torn.
    pub(crate) fn let_go(&mut self) {
        for torn in self.memory.torn() {
            if let Partner::Attachment(number) = torn {
                self.member.let_go(*number);
            }
        }
    }
}
