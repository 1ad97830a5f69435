//! The boxes that members of a cluster may be in within a fine step, and which of them meet.
//!
//! In: members, how fast each may move. Out: their boxes, pairs whose boxes may meet. Never here: places of skins.

use super::super::Participant;
use metachron_geometry::Aabb;

/// Bodies whose boxes come closer than this within the time looked ahead belong together, metres.
const NEAR_M: f64 = 2e-3;

/// Where a member may be in a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Its skin now.
    pub skin: Aabb,
    /// The fastest speed of any point of it, m/s.
    pub speed_m_s: f64,
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
        self.reaches.clear();
        let reach = |(member, one): (usize, &Participant<'_>)| {
            let skin = one.member.skin()?.bounds();
            Some(Reach { skin, speed_m_s: speed_m_s(member) })
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

    /// Adds the pairs whose boxes may meet within `after_s` seconds, the lower member first, sorted.
    pub fn pairs(&self, after_s: f64, into: &mut Vec<[usize; 2]>) {
        let reach = |&member: &usize| self.reaches[member].map(|reach| (member, reach));
        let grown = |reach: &Reach| reach.skin.grown(reach.speed_m_s * after_s + 0.5 * NEAR_M);
        let fastest = self.along_x.iter().filter_map(reach).map(|(_, reach)| reach.speed_m_s).fold(0.0, f64::max);
        let widest = fastest * after_s + NEAR_M;
        for (at, (member, here)) in self.along_x.iter().filter_map(reach).enumerate() {
            let mine = grown(&here);
            for (other, there) in self.along_x[at + 1..].iter().filter_map(reach) {
                if there.skin.low.x - widest > mine.high.x {
                    break;
                }
                if mine.meets(grown(&there)) {
                    into.push([member.min(other), member.max(other)]);
                }
            }
        }
        into.sort_unstable();
    }
}
