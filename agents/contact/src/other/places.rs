//! Where another agent is: its shape, and its material points with how they move.

use super::{Other, Pose};
use glam::DVec3;
use metachron_core::ContactJacobian;
use metachron_core::{Anchor, Body};
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapePose};

impl Other {
    /// Where it is; `None` before the first [`Self::meet`] and for a body that has no shape.
    #[must_use]
    pub fn placed(&self) -> Option<PlacedShape<'_>> {
        let neighbour = self.neighbour.as_ref()?;
        let Pose { centre, rotation } = self.pose;
        let view = match &neighbour.snapshot.body {
            Body::Nothing => return None,
            Body::Rigid(_) => ShapePose::Solid { position: centre, rotation },
            Body::Tool(tool) => ShapePose::Tool { tip: centre, rotation, jaw: tool.jaw },
            Body::Curve(curve) => ShapePose::Chain { positions: &self.positions, radii_m: &curve.radii_m },
            Body::Soft(_) => ShapePose::Surface(&self.positions),
        };
        Some(PlacedShape { form: neighbour.form.as_deref()?, view })
    }

    /// Adds the velocity of the place of a contact to what `slots` gather, as [`Place::join`] does; this body's slots begin at `base`.
    pub fn join(&self, slots: &mut ContactJacobian, base: u32, place: &Place, side: ContactSide) {
        place.join(slots, base, self.pose.centre, side);
    }

    /// Where a material point is and how it moves; `None` where there is no such point.
    #[must_use]
    pub fn point(&self, anchor: Anchor) -> Option<(DVec3, DVec3)> {
        let place = self.place(anchor)?;
        let mut slots = ContactJacobian::default();
        self.join(&mut slots, 0, &place, ContactSide::point());
        let position = match place {
            Place::Point(point) => point,
            Place::Chain { segment, share, .. } => {
                let [a, b] = [segment, segment + 1].map(|node| self.positions[node as usize]);
                a.lerp(b, share)
            }
            Place::Surface { vertices, shares } => {
                vertices.into_iter().zip(shares).map(|(vertex, share)| self.positions[vertex as usize] * share).sum()
            }
        };
        Some((position, slots.velocity(&self.velocities)))
    }

    /// Adds the velocity of a material point to what `slots` gather; this body's slots begin at zero.
    pub fn hold(&self, slots: &mut ContactJacobian, anchor: Anchor) {
        if let Some(place) = self.place(anchor) {
            self.join(slots, 0, &place, ContactSide::point());
        }
    }

    pub(super) fn place(&self, anchor: Anchor) -> Option<Place> {
        match (&self.neighbour.as_ref()?.snapshot.body, anchor) {
            (Body::Curve(curve), Anchor::Arc(arc_m)) => {
                let (segment, share) = curve.locate(arc_m)?;
                Some(Place::Chain { segment: segment as u32, share, radius_m: 0.0 })
            }
            (Body::Rigid(_) | Body::Tool(_), Anchor::Local(local)) => {
                Some(Place::Point(self.pose.centre + self.pose.rotation * local))
            }
            (Body::Soft(soft), Anchor::Vertex(vertex)) if (vertex as usize) < soft.positions.len() => {
                Some(Place::Surface { vertices: [vertex; 3], shares: [1.0, 0.0, 0.0] })
            }
            _ => None,
        }
    }
}
