//! What is on its way to another agent.
//!
//! In: the ledger of what it was given and its own copy. Out: it, with the difference in its velocities and its place. Never
//! here: who gave, what it does next. Theory: docs/theory/coupling.md, eq. 5 and 6.

use super::Other;
use crate::coupling::{Exchange, Impulse, Site};
use crate::{AgentId, Body, Neighbour, SimTime};
use glam::DVec3;

impl Other {
    /// Adds what is on its way: W (J − J_ack) to the velocities, W ((J − J_ack) t − (S − S_ack)) to the positions.
    pub(super) fn deliver(&mut self, neighbour: &Neighbour, me: AgentId, exchange: &Exchange, at: SimTime) {
        let slots = self.velocities.len();
        let (mut sums, mut carried) = (std::mem::take(&mut self.answer), std::mem::take(&mut self.carried));
        sums.clear();
        carried.clear();
        exchange.in_flight(me, neighbour, at, |site, sum, moved| {
            if sums.is_empty() {
                sums.resize(slots, DVec3::ZERO);
                carried.resize(slots, DVec3::ZERO);
            }
            spread(neighbour, site, |slot, share, angular| {
                let of = |impulse: Impulse| if angular { impulse.angular } else { impulse.linear } * share;
                sums[slot] += of(sum);
                carried[slot] += of(moved);
            });
        });
        if !sums.is_empty() {
            self.respond(&mut sums);
            self.respond(&mut carried);
            self.velocities.iter_mut().zip(&sums).for_each(|(v, dv)| *v += *dv);
            if let (Some(lean), [dv, dw], [dx, dr]) = (&mut self.lean, &sums[..], &carried[..]) {
                lean.deliver([*dv, *dw], [*dx, *dr]);
            }
            self.shift(&carried);
        }
        (self.answer, self.carried) = (sums, carried);
    }
}

/// Which slots of `neighbour` an impulse at `site` acts on: (slot, share, whether it is the angular part).
fn spread(neighbour: &Neighbour, site: Site, mut visit: impl FnMut(usize, f64, bool)) {
    match (&neighbour.snapshot.body, site) {
        (Body::Curve(curve), Site::Arc(arc_m)) => {
            let Some((segment, share)) = curve.locate(arc_m) else { return };
            visit(2 * segment, 1.0 - share, false);
            visit(2 * segment + 2, share, false);
            visit(2 * segment + 1, 1.0, true);
        }
        (Body::Soft(soft), Site::Vertex(vertex)) if (vertex as usize) < soft.positions.len() => {
            visit(vertex as usize, 1.0, false);
        }
        (Body::Curve(_) | Body::Soft(_), _) | (_, Site::Arc(_) | Site::Vertex(_)) => {}
        (_, Site::Whole) => {
            visit(0, 1.0, false);
            visit(1, 1.0, true);
        }
    }
}
