//! The local model of a participant at the end of a macro step, for partners that compute their pairs with it.
//!
//! In: the last solve, blocks of a participant, what partners give it. Out: velocities, accelerations and W of these blocks. Never here:
//! who the partners are, which blocks. Theory: docs/theory/coupling.md, section 3 (eq. 7m).

use crate::member::problem::respond;
use crate::member::{ClusterMember, Participant};
use crate::step::ClusterStepper;
use glam::DVec3;
use metachron_core::{LocalBlock, LocalModel};

/// Blocks of a participant, with what its partners give them.
#[derive(Debug, Clone, Copy)]
pub struct LocalQuery<'a> {
    /// The participant.
    pub place: usize,
    /// Its blocks.
    pub blocks: &'a [usize],
    /// What all partners go on giving each block, N or N·m.
    pub lasting: &'a [DVec3],
}

impl ClusterStepper {
    /// The forces that would have held the blocks of a participant still in its last step, N or N·m; none where contacts or rows touched it.
    pub fn weight(&self, all: &[Participant<'_>], place: usize, into: &mut Vec<DVec3>) {
        into.clear();
        let state = &self.progress[place];
        if state.held {
            return;
        }
        into.resize(state.dv_free.len(), DVec3::ZERO);
        let own_s = self.fine_s * f64::from(state.share);
        let free = |block: usize| {
            (state.dv_free[block] - state.dv_known.get(block).copied().unwrap_or(DVec3::ZERO)) * (-1.0 / own_s)
        };
        for block in all[place].member.blocks().iter().filter(|block| block.row < state.dv_free.len()) {
            into[block.row] += block.value * free(block.column);
            if block.row != block.column {
                into[block.column] += block.value.transpose() * free(block.row);
            }
        }
    }

    /// Fills blocks, compliance and step of a local model from the macro step that was made last.
    pub fn local_model(&mut self, all: &[Participant<'_>], query: &LocalQuery<'_>, into: &mut LocalModel) {
        let LocalQuery { place, blocks, .. } = *query;
        let member = &all[place].member;
        let (share, held) = (f64::from(self.progress[place].share), self.progress[place].held);
        (into.step_s, into.held) = (self.macro_s, held);
        let in_problem = self.progress[place].place.filter(|_| held);
        if in_problem.is_some_and(|place| self.solver.held_compliance(place, blocks, &mut into.compliance)) {
            into.compliance.iter_mut().for_each(|w| *w *= share.recip());
        } else {
            self.own_compliance(all, query, into);
        }
        let state = &self.progress[place];
        let own_s = self.fine_s * share;
        into.blocks.clear();
        for (at, &block) in blocks.iter().enumerate() {
            let pushed = state.dv_known.get(block).copied().unwrap_or(DVec3::ZERO);
            let free = (state.dv_free[block] - pushed) / own_s;
            let row = &into.compliance[at * blocks.len()..(at + 1) * blocks.len()];
            let pushed: DVec3 = row.iter().zip(query.lasting).map(|(w, force)| *w * *force).sum();
            // what is held goes on as it does: its contacts take what its forces would change
            let acceleration = if held { DVec3::ZERO } else { free + pushed };
            into.blocks.push(LocalBlock { slot: member.slot_of(block), velocity: state.v_before[block], acceleration });
        }
    }

    /// W of a participant that nothing touched.
    fn own_compliance(&mut self, all: &[Participant<'_>], query: &LocalQuery<'_>, into: &mut LocalModel) {
        let (member, blocks) = (&all[query.place].member, query.blocks);
        let Self { local, .. } = self;
        let [x, residual] = local;
        into.compliance.clear();
        into.compliance.resize(blocks.len() * blocks.len(), glam::DMat3::ZERO);
        for (column, &pushed) in blocks.iter().enumerate() {
            for axis in 0..3 {
                x.clear();
                x.resize(member.free().len(), DVec3::ZERO);
                x[pushed] = DVec3::AXES[axis];
                respond(member, x, residual);
                for (row, &block) in blocks.iter().enumerate() {
                    *into.compliance[row * blocks.len() + column].col_mut(axis) = x[block];
                }
            }
        }
    }
}
