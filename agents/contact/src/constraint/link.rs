//! Links between agents as springs of the cluster's problem.
//!
//! In: the links that members see. Out: rows of springs. Never here: links by wave variables, which are no part of a cluster.
//! Theory: docs/theory/clusters.md, eq. 14.

use crate::agent::tool_extrapolation_s;
use crate::constraint::{ConstraintRows, End, FineStep, Frame, Holders, Name, Pull, YieldLimit};
use crate::law::{Law, Link};
use crate::member::memory::Partner;
use crate::member::participant::place_of;
use crate::member::{ClusterMember, MaterialPoint, Participant};
use glam::DVec3;
use metachron_core::{Anchor, Body};

impl ConstraintRows {
    /// Lays out all links. Both agents see a link: of two participants the lower number takes it.
    pub fn gather_links(&mut self, step: &FineStep<'_, '_>) {
        let all = step.all;
        for (member, one) in all.iter().enumerate() {
            for link in one.context.links {
                let other = place_of(all, link.other);
                let is_mine = other.is_none_or(|other| member < other);
                if is_mine && computes_link(all, one, link) && !one.memory.has_torn(Partner::Link(link.number)) {
                    self.link(step, [Some(member), other], link);
                }
            }
        }
    }

    fn link(&mut self, step: &FineStep<'_, '_>, ends: [Option<usize>; 2], link: &Link) {
        let [Some(member), other] = ends else { return };
        let all = step.all;
        let partner = Partner::Link(link.number);
        let slip = all[member].memory.slipped(partner);
        let (link, beside_m) = (&slip.link(link), slip.beside(link));
        let there = match other {
            Some(other) => all[other].member.anchor(link.there),
            None => seen_point(&all[member], link, step.after_s),
        };
        let (Some(here), Some(there)) = (all[member].member.anchor(link.here), there) else { return };
        let there = MaterialPoint { position: there.position + beside_m, ..there };
        let Link { stiffness_n_m, damping_n_s_m, rest_m, .. } = *link;
        let hold = Some(Holders { side_0: all[member].id, side_1: Some(link.other) });
        // it tears and yields where both ends are in this problem: what one of them does not see would go on holding it
        let there_too = other.filter(|other| !all[*other].member.is_remote());
        let lasting = Name::lasting(member, partner, hold);
        let name = match there_too {
            Some(other) => {
                let frame = Frame::of_link(all, [member, other], link);
                let yields = YieldLimit { above_n: link.yields_above_n, frame };
                Name { tears_above_n: link.tears_above_n, yields, ..lasting }
            }
            None => lasting,
        };
        let ends = [End { member: Some(member), point: here }, End { member: other, point: there }];
        self.spring(step, &ends, &Pull { stiffness_n_m, damping_n_s_m, rest_m }, name);
    }
}

/// Whether a link is the cluster's: one that is asynchronous only where its far end is a participant, or a remote member that is met here.
fn computes_link(all: &[Participant<'_>], one: &Participant<'_>, link: &Link) -> bool {
    let far = place_of(all, link.other).map(|other| &all[other].member);
    match link.law {
        Law::Cluster => far.is_none_or(|far| !far.is_remote()),
        Law::Ledger => far.is_some_and(|far| !far.spares(one.id)),
        Law::Tlm { .. } => far.is_some_and(|far| !far.is_remote()),
        Law::Off => false,
    }
}

/// Where the far end of a link is that is no participant: it moves on as it was last published.
fn seen_point(one: &Participant<'_>, link: &Link, after_s: f64) -> Option<MaterialPoint> {
    let seen = &one.context.neighbours.iter().find(|other| other.id == link.other)?.snapshot;
    let MaterialPoint { position, led_m_s, .. } = published_point(&seen.body, link.there)?;
    let age_s = tool_extrapolation_s(one.context.time, seen.time) + after_s;
    let point = MaterialPoint::led(position + led_m_s * age_s, led_m_s);
    (point.position.is_finite() && led_m_s.is_finite()).then_some(point)
}

/// A material point of a published body.
fn published_point(body: &Body, anchor: Anchor) -> Option<MaterialPoint> {
    let of_whole = |centre: DVec3, arm: DVec3, velocity: DVec3, spin: DVec3| {
        MaterialPoint::led(centre + arm, velocity + spin.cross(arm))
    };
    match (body, anchor) {
        (Body::Curve(curve), Anchor::Arc(arc_m)) => {
            let (segment, share) = curve.locate(arc_m)?;
            let mix = |list: &[DVec3]| Some(list.get(segment)?.lerp(*list.get(segment + 1)?, share));
            Some(MaterialPoint::led(mix(&curve.positions)?, mix(&curve.velocities)?))
        }
        (Body::Soft(soft), Anchor::Vertex(vertex)) => {
            let at = vertex as usize;
            Some(MaterialPoint::led(*soft.positions.get(at)?, *soft.velocities.get(at)?))
        }
        (Body::Rigid(rigid), Anchor::Local(local)) => {
            Some(of_whole(rigid.position, rigid.rotation * local, rigid.velocity, rigid.spin))
        }
        (Body::Tool(tool), Anchor::Local(local)) => {
            Some(of_whole(tool.tip, tool.rotation * local, tool.velocity, tool.spin))
        }
        _ => None,
    }
}
