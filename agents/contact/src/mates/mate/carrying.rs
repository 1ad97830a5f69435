//! How an agent that something fixed carries carries who lies on it.
//!
//! In: contacts and impulses of a substep that stands. Out: the feet of the owner on it. Never here: what the owner makes of them.
//! Theory: docs/theory/coupling.md, eq. 7p.

use super::Mate;
use crate::Contact;
use crate::crowd::touches;
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::Foot;

impl Mate {
    /// Appends to `feet` the contacts with it that pressed in the last substep, if something fixed carries it: what each joins of the `own`
    /// slots of the owner, and how much it stands against being pressed there. `room` is for impulses in slots of all.
    pub fn carry<'a>(
        &self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)> + Clone,
        (own, room): (usize, &mut Vec<DVec3>),
        feet: &mut Vec<Foot>,
    ) {
        if self.lifted || !self.other.is_carried() {
            return;
        }
        let presses =
            |(contact, impulse): &(&Contact, &DVec3)| self.is_of(contact) && impulse.dot(contact.normal) > 0.0;
        let pressed = contacts.filter(presses);
        room.clear();
        room.resize(self.end(), DVec3::ZERO);
        pressed.clone().for_each(|(contact, impulse)| contact.jacobian.scatter(*impulse, room));
        let given = &room[self.slots.0..];
        if given.iter().any(|given| *given != DVec3::ZERO) && self.other.stays_under(given) {
            self.respond(room);
            feet.extend(pressed.map(|(contact, impulse)| self.foot(contact, (*impulse, room), own)));
        }
    }

    /// The foot by a contact with this impulse, where that and all others of the owner together `move` it.
    fn foot(&self, contact: &Contact, (impulse, moved): (DVec3, &[DVec3]), own: usize) -> Foot {
        let Contact { jacobian: slots, normal, .. } = *contact;
        let yields_m_s = normal.dot(slots.velocity_from(self.slots.0, moved));
        let stiffness = if yields_m_s > 0.0 { impulse.dot(normal) / yields_m_s } else { f64::INFINITY };
        Foot { slots: slots.own(own), normal, stiffness }
    }
}

/// Whether somebody who started lower owns a contact with `neighbour` and has pressed it within a second: what carries it is told by that
/// contact, not by where it touches something fixed.
pub(super) fn is_lifted(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    let height = |n: &Neighbour| n.form.as_ref().map(|form| form.height_j_kg());
    around.neighbours.iter().any(|n| touches(n, neighbour.id) && height(n) < height(neighbour))
}
