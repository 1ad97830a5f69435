//! The material points of a tube in a contact cluster, and the attachments that are its own.
//!
//! In: anchors, slips, torn attachments. Out: points and springs at its nodes, forces of attachments that may tear. Never here: attachments
//! to other bodies.

use super::super::anchor_springs::NodeSpring;
use super::super::tube::Tube;
use glam::DVec3;
use metachron_contact::member::{Attachments, MaterialPoint, OwnAttachment, OwnSpring};
use metachron_contact::solve::Side;
use metachron_core::Anchor;

impl Attachments for Tube {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Arc(arc_m) = anchor else { return None };
        let (segment, share) = self.division.locate(arc_m);
        let places = &self.unknowns.places;
        let position = places.get(segment)?.lerp(*places.get(segment + 1)?, share);
        Some(MaterialPoint::new(position, self.point_side(segment, share, DVec3::ZERO)))
    }

    fn turn(&self, anchor: Anchor) -> Option<Side> {
        let Anchor::Arc(arc_m) = anchor else { return None };
        Some(Side::node(0, 2 * self.division.locate(arc_m).0 + 1))
    }

    fn own(&self) -> &[OwnAttachment] {
        &self.unknowns.attached
    }

    fn own_spring(&self, place: usize) -> Option<OwnSpring> {
        let spring = self.springs.get(unyielding(&self.springs).len() + place)?;
        let position = *self.unknowns.places.get(spring.node)?;
        let side = if self.is_held(2 * spring.node) { Side::FIXED } else { Side::node(0, 2 * spring.node) };
        Some(OwnSpring {
            attachment: spring.attachment,
            point: MaterialPoint::new(position, side),
            place_m: spring.place(),
            slack_m: spring.slack(),
            stiffness_n_m: spring.stiffness,
            damping_n_s_m: spring.damping,
            yields_above_n: spring.yields_above_n,
            tears_above_n: self.spec.attachments[spring.attachment as usize].tears_above_n,
        })
    }
}

impl Tube {
    /// Notes the forces of attachments that may tear and never yield at the end of a step: implicit Euler has given
    /// these all along it.
    pub(super) fn note_attachments(&mut self) {
        let Self { spec, springs, now, unknowns, .. } = self;
        let attached = &mut unknowns.attached;
        attached.clear();
        for spring in unyielding(springs) {
            let (number, force_n) = (spring.attachment, spring.force(now.x[spring.node], now.u[2 * spring.node]));
            let tears_above_n = spec.attachments[number as usize].tears_above_n;
            if tears_above_n == f64::INFINITY {
                continue;
            }
            match attached.last_mut().filter(|last| last.number == number) {
                Some(last) => last.force_n += force_n,
                None => attached.push(OwnAttachment { number, force_n, tears_above_n }),
            }
        }
    }
}

/// Its springs that never yield.
pub(super) fn unyielding(springs: &[NodeSpring]) -> &[NodeSpring] {
    &springs[..springs.partition_point(|spring| !spring.yields())]
}
