//! A soft body's own estimate of its error in time, metres: from time to time steps are repeated with twice the substeps.
//!
//! In: the body before a step and after it. Out: the error of the steps of a tenth of a second. Never here: errors in space
//! ([`crate::soft::fe_mesh`]), any change of its state. Theory: docs/theory/control.md, eq. 31, 32.

use super::anchor_springs::VertexSpring;
use super::body::SoftBody;
use super::system::Purpose;
use glam::DVec3;
use metachron_core::step_doubling::{DoublingSchedule, farthest};
use metachron_core::{AgentId, Archive, ArchiveError, archive_values};

/// The error in time of one soft body.
#[derive(Debug, Default)]
pub(super) struct Doubling {
    pub watch: DoublingSchedule,
    /// Positions and velocities with twice the substeps.
    finer: [Vec<DVec3>; 2],
    /// The springs of the step.
    ties: Vec<VertexSpring>,
    /// Number of substeps of the repeated step; `last` is that of the last ordinary step.
    parts: u32,
    last: u32,
}

impl Doubling {
    /// Writes or reads a row of repeated steps as far as it is.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.watch, self.finer, self.last)
    }
}

impl SoftBody {
    /// Repeats the coming step of `dt` seconds with twice the substeps of the last one, in parallel to the state, where it is the turn
    /// of the body `me`; returns the number of substeps.
    pub(super) fn repeat_step(&mut self, me: AgentId, dt: f64) -> u32 {
        let Self { doubling, positions, velocities, ties, .. } = self;
        if doubling.watch.begins(self.steps, me) {
            doubling.finer[0].clone_from(positions);
            doubling.finer[1].clone_from(velocities);
        }
        if !doubling.watch.is_on() {
            return 0;
        }
        doubling.parts = 2 * doubling.last.max(1);
        doubling.ties.clone_from(ties);
        let parts = doubling.parts;
        self.swap();
        let made = (0..parts).all(|_| self.half(dt / f64::from(parts)));
        self.swap();
        self.ties.clone_from(&self.doubling.ties);
        if !made {
            self.doubling.watch.cancel();
        }
        parts
    }

    /// Swaps the state with that of twice the substeps.
    fn swap(&mut self) {
        let Self { doubling, positions, velocities, .. } = self;
        std::mem::swap(&mut doubling.finer[0], positions);
        std::mem::swap(&mut doubling.finer[1], velocities);
    }

    /// One substep of the repetition, which is not published; returns whether it could be solved.
    fn half(&mut self, h: f64) -> bool {
        if self.predict(h, Purpose::Own).is_err() {
            return false;
        }
        let Self { positions, velocities, free, ties, .. } = self;
        velocities.clone_from(free);
        positions.iter_mut().zip(&*velocities).for_each(|(x, v)| *x += *v * h);
        ties.iter_mut().for_each(|tie| tie.book(velocities, h));
        true
    }

    /// Ends a step of `dt` seconds in `done` substeps.
    pub(super) fn estimate_error(&mut self, dt: f64, done: u32) {
        let Self { doubling, positions, .. } = self;
        doubling.last = done;
        if !doubling.watch.is_on() {
            return;
        }
        if doubling.parts != 2 * done {
            return doubling.watch.cancel();
        }
        if doubling.watch.finish_step(dt) {
            doubling.watch.record(farthest(positions, &doubling.finer[0]), 1);
        }
    }
}
