//! The error that a macro step of a cluster makes, of each member: the step made a second time in halves, without a trace.
//!
//! In: members at the start of a macro step. Out: how far each is from where the same steps in twice as many parts would leave it, over a row of
//! them. Never here: which steps are repeated, the use of the error. Theory: docs/theory/control.md, eq. 31; docs/theory/clusters.md, section 9.

use crate::detect::ClusterScene;
use crate::member::{GuardedMember, Participant};
use crate::step::ClusterStepper;
use glam::DVec3;
use metachron_core::{AgentId, Archive, ArchiveError, ParallelFor, SimSpan, StepError, archive_values};
use metachron_geometry::{ShapeKind, ShapePose};

/// A macro step in twice as many parts.
#[derive(Default)]
pub struct StepDoubling {
    /// Its own, so that a step leaves the same bits whether it is repeated or not.
    stepper: ClusterStepper,
    /// Where the finer step left the members.
    finer: Vec<Vec<DVec3>>,
    /// Whether there was one.
    made: bool,
    now: Vec<DVec3>,
    /// The members of the row so far, and by how much each point of theirs is off.
    row: Vec<AgentId>,
    off: Vec<Vec<DVec3>>,
    apart_m: Vec<f64>,
}

impl StepDoubling {
    /// Writes or reads the state that the next macro step needs.
    ///
    /// # Errors
    /// [`ArchiveError`] for a state of another kind.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.row, self.off)?;
        self.stepper.archive(archive)
    }

    /// Bounds its solves as those of the step that it repeats ([`ClusterStepper::set_factors_max`]): it costs no more, and the rest that a bound
    /// leaves is no error of the time step.
    pub fn set_factors_max(&mut self, most: Option<u32>) {
        self.stepper.set_factors_max(most);
    }

    /// Begins a row: the errors of steps so far no longer count.
    pub fn begin_row(&mut self) {
        self.row.clear();
    }

    /// Makes the coming macro step of `dt` with every member in twice as many parts, and takes it back. Its work, in the unit of
    /// [`metachron_core::StepReport::work`].
    ///
    /// # Errors
    /// [`StepError::Diverged`] where a member has no finite state then: all members are as they were.
    pub fn foresee(
        &mut self,
        scene: &ClusterScene,
        all: &mut [Participant<'_>],
        dt: SimSpan,
        threads: &dyn ParallelFor,
    ) -> Result<f64, StepError> {
        let Self { stepper, finer, made, .. } = self;
        *made = false;
        stepper.keep(all);
        all.iter_mut().for_each(|one| one.parts *= 2);
        let outcome = stepper.step(scene, all, dt, threads);
        // a step that cannot be made in shorter parts may be made in these
        all.iter().for_each(|one| one.member.forgive());
        if outcome.is_ok() {
            finer.resize_with(all.len(), Vec::new);
            all.iter().zip(finer).for_each(|(one, places)| probe(&one.member, places));
        }
        all.iter_mut().for_each(|one| one.parts /= 2);
        stepper.guard(all, ClusterStepper::go_back);
        let report = outcome?;
        *made = true;
        Ok(report.work)
    }

    /// Compares the members with where the finer step left them, after the same macro step. The error of a step adds to the errors of its row
    /// before, point by point: a jittering body is off to the other side in the next step.
    pub fn compare(&mut self, all: &[Participant<'_>]) {
        let Self { finer, made, now, row, off, apart_m, .. } = self;
        apart_m.clear();
        let goes_on = row.iter().copied().eq(all.iter().map(|one| one.id));
        if !std::mem::take(made) || finer.len() != all.len() || !(row.is_empty() || goes_on) {
            return;
        }
        off.resize_with(all.len(), Vec::new);
        if !goes_on {
            row.extend(all.iter().map(|one| one.id));
            off.iter_mut().for_each(Vec::clear);
        }
        for ((one, finer), off) in all.iter().zip(finer).zip(off) {
            probe(&one.member, now);
            off.resize(now.len(), DVec3::ZERO);
            off.iter_mut().zip(now.iter().zip(finer)).for_each(|(off, (now, finer))| *off += *now - *finer);
            apart_m.push(off.iter().map(|off| off.length_squared()).fold(0.0, f64::max).sqrt());
        }
    }

    /// How far each member was from where the finer steps of the row so far would have left it, metres; empty where there was no finer step,
    /// or where the members are no longer those with which the row began.
    #[must_use]
    pub fn apart_m(&self) -> &[f64] {
        &self.apart_m
    }
}

/// The points by which the places of a member are compared: nodes, vertices, three points as far from its middle as the farthest of its shape.
fn probe(member: &GuardedMember<'_>, into: &mut Vec<DVec3>) {
    into.clear();
    let Some(skin) = member.skin() else {
        return into.extend(member.pose(&[], 0.0).map(|pose| pose.centre_m));
    };
    match skin.view {
        ShapePose::Chain { positions, .. } | ShapePose::Surface(positions) => into.extend_from_slice(positions),
        ShapePose::Solid { position, rotation } => {
            let arm_m = if let ShapeKind::Solid(solid) = &skin.form.kind { solid.radius_m } else { 0.0 };
            into.extend(DVec3::AXES.map(|axis| position + rotation * axis * arm_m));
        }
        ShapePose::Tool { tip, .. } => into.push(tip),
    }
}
