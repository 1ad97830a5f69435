//! How members answer what others give them while contact and joints hold them to the rest: all of a stack moves with its lowest box.
//!
//! In: the solve of a part's way, who wants to know. Out: the inverse mass of a member among its fellows, and by how much all move with
//! it. Never here: who gives what. Theory: docs/theory/coupling.md, eq. 7m.

use super::super::member::Member;
use super::newton::Newton;
use super::row::{Law, Mass, NOBODY, Row, Twist};
use glam::DVec3;
use metachron_core::Mat6;

/// The answers in a step.
#[derive(Default)]
pub(super) struct Answers {
    /// Of each member that was asked: which, and the velocities of all, six numbers a body, for each of six unit impulses.
    columns: Vec<(usize, [Vec<f64>; 6])>,
    count: usize,
    /// Something was given since: the next part finds them anew, in which it presses. In others all fall together.
    are_due: bool,
}

impl Answers {
    /// A step begins in which something is given.
    pub(super) fn ask(&mut self) {
        self.are_due = true;
    }

    /// Nobody is known.
    pub(super) fn forget(&mut self, members: &mut [Member]) {
        self.count = 0;
        members.iter_mut().for_each(|member| member.answer = None);
    }

    /// Finds how the members that are asked answer: nobody does where something fixed holds one of them.
    pub(super) fn find(&mut self, newton: &mut Newton, (rows, masses): (&[Row], &[Mass]), members: &mut [Member]) {
        if !std::mem::take(&mut self.are_due) {
            return;
        }
        self.forget(members);
        let fixed = rows.iter().any(|row| row.b == NOBODY && row.lambda != 0.0 && !matches!(row.law, Law::Spring(_)));
        if fixed || rows.is_empty() || !members.iter().any(|member| member.asked) || !newton.hold(rows, masses) {
            return;
        }
        let bodies = members.len();
        for (index, member) in members.iter_mut().enumerate().filter(|(_, member)| member.asked) {
            if self.columns.len() == self.count {
                self.columns.push(Default::default());
            }
            let (who, columns) = &mut self.columns[self.count];
            self.count += 1;
            *who = index;
            let mut answer = Mat6::ZERO;
            for (axis, column) in columns.iter_mut().enumerate() {
                column.clear();
                column.resize(6 * bodies, 0.0);
                column[6 * index + axis] = 1.0;
                newton.respond(column);
                (0..6).for_each(|row| answer.0[row][axis] = column[6 * index + row]);
            }
            member.answer = Some(answer);
        }
    }

    /// By how much an impulse on the member `index` moves each; `None` where it is not known.
    pub(super) fn moves(&self, index: usize, [linear, angular]: Twist) -> Option<impl Iterator<Item = Twist>> {
        let (_, columns) = self.columns[..self.count].iter().find(|(who, _)| *who == index)?;
        let weights = [linear.to_array(), angular.to_array()];
        let bodies = columns[0].len() / 6;
        let sum =
            move |at: usize| weights.as_flattened().iter().zip(columns).map(|(w, column)| w * column[at]).sum::<f64>();
        let vector = move |at: usize| DVec3::new(sum(at), sum(at + 1), sum(at + 2));
        Some((0..bodies).map(move |body| [vector(6 * body), vector(6 * body + 3)]))
    }
}
