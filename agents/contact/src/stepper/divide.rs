//! Shorter steps for members that ask for them: for joints, under strain.
//!
//! In: members, what a solve made of them. Out: how many steps each makes when the macro step begins anew. Never here: going back to its start.
//! Theory: docs/theory/clusters.md, section 9.

use super::{ClusterMember, ClusterStepper, Participant, Role};

/// The most times as many steps that a member makes whose motion strains it too far.
const DIVIDED_MAX: u32 = 64;

impl ClusterStepper {
    /// Gives shorter steps to rigid members where joints ask for them; whether it does.
    pub(super) fn divide_joints(&mut self, all: &[Participant<'_>]) -> bool {
        if self.joints_ask <= 1 {
            return false;
        }
        let mut any = false;
        for (one, state) in all.iter().zip(&mut self.progress).filter(|(one, _)| one.member.role() == Role::Rigid) {
            let most = one.parts * DIVIDED_MAX;
            any |= state.parts < most;
            state.parts = (state.parts * self.joints_ask).min(most);
        }
        any
    }

    /// Gives shorter steps to members that the solution strains too far; whether there are any.
    pub(super) fn divide(&mut self, all: &[Participant<'_>], h_s: f64) -> bool {
        let mut any = false;
        for (one, state) in all.iter().zip(&mut self.progress) {
            let so_far = one.member.strain(&state.before, h_s * f64::from(state.part));
            // what is too much already grows through the rest of its step
            let more = if so_far > 1.0 { times(so_far * f64::from(state.share) / f64::from(state.part)) } else { 1 };
            // what its free motion asked for counts
            let most = one.parts * DIVIDED_MAX;
            if more > 1 && state.parts < most {
                state.parts = (state.parts * more).min(most);
                any = true;
            }
        }
        any
    }
}

/// How many times as many steps a member needs that this one strains so far, as a share of what it can take.
pub(super) fn times(strain: f64) -> u32 {
    let mut times = 1;
    while times < DIVIDED_MAX && strain > f64::from(times) {
        times *= 2;
    }
    times
}
