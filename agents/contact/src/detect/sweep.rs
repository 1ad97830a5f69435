//! Where members that go far within a fine step first touch on their way.
//!
//! In: a pair with the velocities at which its places move. Out: when it meets, and its places at that moment. Never here: what is near from
//! the start.

use crate::detect::pair::{Against, Pair, Round};
use crate::member::ClusterMember;
use glam::DVec3;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, SweptReach, SweptShape, first_touch};
use metachron_geometry::{ShapePose, Touch};

/// A pair that comes nearer by more than this in a step is swept, metres: what is nearest at its start then says little of what it meets.
pub(crate) const FAR_M: f64 = 0.02;

/// Storage for two skins at the end of a step.
#[derive(Default)]
pub(crate) struct Sweep {
    nodes: [Vec<DVec3>; 2],
}

/// When and where a pair is at its places.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Meeting {
    /// So many seconds after the start of the fine step.
    pub after_s: f64,
    /// How far each side has gone by then as a whole, metres: places fixed to a solid are ahead of it by that much.
    pub ways: [DVec3; 2],
}

/// A pair, and the distance at which it meets, metres.
#[derive(Clone, Copy)]
pub(crate) struct Sought<'a> {
    pub pair: Pair<'a>,
    pub reach_m: f64,
}

/// What a sweep found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Sweeping {
    /// The two come within reach.
    Meets(Meeting),
    /// They do not.
    Passes,
    /// One of them does not say where its skin will be.
    Unknown,
}

impl Sweep {
    /// The first meeting of a pair within the fine step, with the places of that moment in `into`.
    pub fn meet(
        &mut self,
        round: &Round<'_, '_>,
        sought: Sought<'_>,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) -> Sweeping {
        into.clear();
        let Sought { pair, reach_m } = sought;
        let [first, second] = &mut self.nodes;
        let reach = SweptReach { reach_m, around_m: FAR_M };
        let Some(here) = swept(round, pair.member, first) else { return Sweeping::Unknown };
        let (share, their_way) = match pair.against {
            Against::Own => return Sweeping::Unknown,
            Against::Static { solid, .. } => (solid.first_touch(&here, reach, scratch, into), DVec3::ZERO),
            Against::Member(other) => {
                let Some(there) = swept(round, other, second) else { return Sweeping::Unknown };
                (first_touch(&here, &there, reach, scratch, into), way(&there))
            }
        };
        let ways = [way(&here), their_way];
        share.map_or(Sweeping::Passes, |share| {
            Sweeping::Meets(Meeting { after_s: share * round.h_s, ways: ways.map(|way| way * share) })
        })
    }
}

/// The skin of a member now and at the end of the fine step.
fn swept<'a>(round: &Round<'a, '_>, member: usize, nodes: &'a mut Vec<DVec3>) -> Option<SweptShape<'a>> {
    let body = &round.all[member].member;
    let end = body.skin_after(round.moved(member), round.h_s, nodes)?;
    Some(SweptShape { start: body.skin()?, end })
}

/// How far a solid or a tool goes, metres; what bends has no place of its own.
fn way(shape: &SweptShape<'_>) -> DVec3 {
    match (shape.start.view, shape.end.view) {
        (ShapePose::Solid { position: from, .. }, ShapePose::Solid { position: to, .. }) => to - from,
        (ShapePose::Tool { tip: from, .. }, ShapePose::Tool { tip: to, .. }) => to - from,
        _ => DVec3::ZERO,
    }
}
