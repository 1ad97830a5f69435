//! Who has come apart: whom nobody else has been near, nor a joint held, for a while.
//!
//! In: pairs that touch, are near or are jointed, step after step. Out: a number for each companion. Never here: contacts.

use super::groups::Groups;
use super::member::Member;

/// Who has touched whom since it was last told who has come apart.
#[derive(Default)]
pub(super) struct Watch {
    groups: Groups,
    age_s: f64,
}

/// Members that have not hung together for this long have come apart, seconds.
const APART_S: f64 = 0.2;

impl Watch {
    /// Begins anew: nobody has touched anybody.
    pub(super) fn start(&mut self, members: usize) {
        self.groups.scatter(members);
        self.age_s = 0.0;
    }

    /// `a` and `b` touch.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        self.groups.join(a, b);
    }

    /// A step has passed: every [`APART_S`] tells who has come apart.
    pub(super) fn pass(&mut self, members: &mut [Member], dt_s: f64, apart: &mut Vec<u32>) {
        self.age_s += dt_s;
        members.iter_mut().for_each(|m| m.joined_s += dt_s);
        apart.clear();
        apart.resize(members.len().saturating_sub(1), 0);
        if self.age_s >= APART_S {
            self.tell(members, apart);
            self.start(members.len());
        }
    }

    /// Numbers the companions by whom they hang together with: zero is the leader; newcomers have not had the time to part.
    fn tell(&mut self, members: &[Member], apart: &mut [u32]) {
        let Some(leader) = members.iter().position(|m| m.seat == 0) else { return };
        for (index, _) in members.iter().enumerate().filter(|(_, m)| m.joined_s < APART_S) {
            self.groups.join(index as u32, leader as u32);
        }
        let home = self.groups.root(leader as u32);
        for (index, member) in members.iter().enumerate().filter(|(_, m)| m.seat > 0) {
            let root = self.groups.root(index as u32);
            apart[member.seat - 1] = if root == home { 0 } else { root + 1 };
        }
    }
}
