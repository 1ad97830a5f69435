//! How a macro step begins anew: its members and their memories as they were at its start.
//!
//! In: members. Out: the same members where they were, after a step in parts that are too long, one that failed, or one that unwound. Never here:
//! why it begins anew, the storage of the stepper, which the next step overwrites.

use crate::member::{ClusterMember, ContactMemory, Participant};
use crate::step::ClusterStepper;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

impl ClusterStepper {
    /// Keeps what a macro step starts from.
    pub(crate) fn keep(&mut self, all: &mut [Participant<'_>]) {
        self.kept.resize_with(all.len(), ContactMemory::default);
        for (one, kept) in all.iter_mut().zip(&mut self.kept) {
            one.member.keep();
            kept.clone_from(one.memory);
        }
        self.is_kept = true;
    }

    /// As [`Self::go_back`], for all where one of them unwinds, too.
    pub(crate) fn go_back_all(&mut self, all: &mut [Participant<'_>]) {
        let gone_back = catch_unwind(AssertUnwindSafe(|| self.go_back(all)));
        gone_back.unwrap_or_else(|panic| {
            self.put_back(all);
            resume_unwind(panic)
        });
    }

    /// Puts all back to the start of the macro step but those whose code has unwound, from wherever in it that came. Until all are kept none has
    /// moved.
    pub(crate) fn put_back(&mut self, all: &mut [Participant<'_>]) {
        if !self.is_kept {
            return;
        }
        for (one, kept) in all.iter_mut().zip(&self.kept).filter(|(one, _)| !one.member.is_broken()) {
            // this one may unwind as well: its mark says so
            drop(catch_unwind(AssertUnwindSafe(|| one.member.go_back())));
            one.memory.clone_from(kept);
        }
    }

    /// Goes back to the start of the macro step.
    pub(crate) fn go_back(&mut self, all: &mut [Participant<'_>]) {
        for ((one, kept), state) in all.iter_mut().zip(&self.kept).zip(&mut self.progress) {
            one.member.go_back();
            one.memory.clone_from(kept);
            state.begun_s = 0.0;
        }
    }
}
