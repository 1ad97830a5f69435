//! Where members may be within a fine step: their boxes, which of these meet, and where members that go far first touch on their way.
//!
//! In: members, the velocities at which their places move. Out: pairs whose boxes may meet, when a pair meets and its places at that moment. Never here:
//! places of skins that are near from the start.

use crate::detect::pair::{Against, Pair, Round};
use crate::lists::refill;
use crate::member::Participant;
use glam::DVec3;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, SweptReach, SweptShape, first_touch};
use metachron_geometry::{Aabb, ShapePose, Touch};

/// Bodies whose boxes come closer than this within the time looked ahead belong together, metres.
const NEAR_M: f64 = 2e-3;
/// A pair that comes nearer by more than this in a step is swept, metres: the nearest places at its start then say
/// little of those that meet.
pub(super) const FAR_M: f64 = 0.02;

/// Where a member may be in a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Its skin now.
    pub skin: Aabb,
    /// The fastest speed of any point of it, m/s.
    pub speed_m_s: f64,
    /// How long a step it makes alone, seconds.
    pub alone_s: f64,
}

/// The boxes of all members that have a skin.
#[derive(Default)]
pub(super) struct Boxes {
    reaches: Vec<Option<Reach>>,
    /// Members with a box, along x.
    along_x: Vec<usize>,
}

impl Boxes {
    /// Places the boxes of `all` anew; `speed_m_s` says how fast each member may move.
    pub fn place(&mut self, all: &[Participant<'_>], speed_m_s: impl Fn(usize) -> f64) {
        let reach = |(member, one): (usize, &Participant<'_>)| {
            let skin = one.member.skin()?.bounds();
            Some(Reach { skin, speed_m_s: speed_m_s(member), alone_s: one.alone_s })
        };
        refill(&mut self.reaches, all.iter().enumerate().map(reach));
        refill(&mut self.along_x, (0..all.len()).filter(|&member| self.reaches[member].is_some()));
        let low_x = |member: usize| self.reaches[member].map_or(0.0, |reach| reach.skin.low.x);
        self.along_x.sort_unstable_by(|&a, &b| low_x(a).total_cmp(&low_x(b)).then(a.cmp(&b)));
    }

    /// The box of a member; `None` where nothing can touch it.
    pub fn of(&self, member: usize) -> Option<Reach> {
        self.reaches[member]
    }

    /// Adds the pairs whose boxes may meet within the longer of the times that `after_s` says of the two, seconds, the lower member first, sorted.
    pub fn pairs(&self, after_s: impl Fn(&Reach) -> f64, into: &mut Vec<[usize; 2]>) {
        let reach = |&member: &usize| self.reaches[member].map(|reach| (member, reach));
        let most = |of: &dyn Fn(&Reach) -> f64| self.reaches.iter().flatten().map(of).fold(0.0, f64::max);
        let (fastest, longest_s) = (most(&|reach| reach.speed_m_s), most(&|reach| after_s(reach)));
        let grown = |reach: &Reach, after_s: f64| reach.skin.grown(reach.speed_m_s * after_s + 0.5 * NEAR_M);
        let widest = fastest * longest_s + NEAR_M;
        for (at, (member, here)) in self.along_x.iter().filter_map(reach).enumerate() {
            let farthest = grown(&here, longest_s).high.x;
            for (other, there) in self.along_x[at + 1..].iter().filter_map(reach) {
                if there.skin.low.x - widest > farthest {
                    break;
                }
                let after_s = after_s(&here).max(after_s(&there));
                if grown(&here, after_s).meets(grown(&there, after_s)) {
                    into.push([member.min(other), member.max(other)]);
                }
            }
        }
        into.sort_unstable();
    }
}

/// Storage for two skins at the end of a step.
#[derive(Default)]
pub(super) struct Sweep {
    nodes: [Vec<DVec3>; 2],
}

/// When and where a pair is at its places.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Meeting {
    /// So many seconds after the start of the fine step.
    pub after_s: f64,
    /// How far each side has gone by then as a whole, metres: places fixed to a solid are ahead of it by that much.
    pub ways: [DVec3; 2],
}

/// A pair, and the distance at which it meets, metres.
#[derive(Clone, Copy)]
pub(super) struct Sought<'a> {
    pub pair: Pair<'a>,
    pub reach_m: f64,
}

/// The result of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sweeping {
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

/// How far a solid or a tool goes, metres; zero for a deformable, which has no pose of its own.
fn way(shape: &SweptShape<'_>) -> DVec3 {
    match (shape.start.view, shape.end.view) {
        (ShapePose::Solid { position: from, .. }, ShapePose::Solid { position: to, .. }) => to - from,
        (ShapePose::Tool { tip: from, .. }, ShapePose::Tool { tip: to, .. }) => to - from,
        _ => DVec3::ZERO,
    }
}
