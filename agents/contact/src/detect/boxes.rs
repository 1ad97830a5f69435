//! The boxes that members of a cluster may be in within a fine step, and which of them meet.
//!
//! In: members, how fast each may move. Out: their boxes, pairs whose boxes may meet. Never here: places of skins.

use crate::member::{ClusterMember, Participant};
use metachron_geometry::Aabb;

/// Bodies whose boxes come closer than this within the time looked ahead belong together, metres.
const NEAR_M: f64 = 2e-3;

/// Where a member may be in a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// Its skin now.
    pub skin: Aabb,
    /// The fastest speed of any point of it, m/s.
    pub speed_m_s: f64,
    /// How long a step it makes alone, seconds.
    alone_s: f64,
}

/// The boxes of all members that have a skin.
#[derive(Default)]
pub(crate) struct Boxes {
    reaches: Vec<Option<Reach>>,
    /// Members with a box, along x.
    along_x: Vec<usize>,
}

impl Boxes {
    /// Places the boxes of `all` anew; `speed_m_s` says how fast each member may move.
    pub fn place(&mut self, all: &[Participant<'_>], speed_m_s: impl Fn(usize) -> f64) {
        self.reaches.clear();
        let reach = |(member, one): (usize, &Participant<'_>)| {
            let skin = one.member.skin()?.bounds();
            Some(Reach { skin, speed_m_s: speed_m_s(member), alone_s: one.alone_s })
        };
        self.reaches.extend(all.iter().enumerate().map(reach));
        self.along_x.clear();
        self.along_x.extend((0..all.len()).filter(|&member| self.reaches[member].is_some()));
        let low_x = |member: usize| self.reaches[member].map_or(0.0, |reach| reach.skin.low.x);
        self.along_x.sort_unstable_by(|&a, &b| low_x(a).total_cmp(&low_x(b)).then(a.cmp(&b)));
    }

    /// The box of a member; `None` where nothing can touch it.
    pub fn of(&self, member: usize) -> Option<Reach> {
        self.reaches[member]
    }

    /// Adds the pairs whose boxes may meet within a step of `step_s` seconds, the lower member first, sorted.
    pub fn meeting(&self, step_s: f64, into: &mut Vec<[usize; 2]>) {
        self.pairs(|_| step_s, into);
    }

    /// Adds the pairs whose boxes may meet within `steps` steps of one of `step_s` seconds, or of those that either makes alone.
    pub fn near(&self, steps: f64, step_s: f64, into: &mut Vec<[usize; 2]>) {
        self.pairs(|reach| steps * step_s.max(reach.alone_s), into);
    }

    fn pairs(&self, after_s: impl Fn(&Reach) -> f64, into: &mut Vec<[usize; 2]>) {
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
