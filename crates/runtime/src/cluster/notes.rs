//! The notes that a macro step leaves with the members of a cluster: how it was solved, its error, impulses of pairs,
//! groups that still belong together.
//!
//! In: a stepper after a macro step. Out: the published data of each member. Never here: the step itself.

use super::attachments::held_by_links;
use super::solve_budget::Solved;
use super::{AgentRunner, MemberState};
use crate::records::events::{AgentEvent, EventKind};
use crate::records::metrics::add;
use metachron_contact::constraint::FailedAttachment;
use metachron_contact::member::Partner;
use metachron_contact::step::{ClusterReport, ClusterStepper, PairTotal, StepDoubling};
use metachron_core::step_doubling::drift_m;
use metachron_core::{
    AgentId, AttachmentEvent, AttachmentEventKind, AttachmentId, ClusterState, JointEffort, PairKind, PairState,
    SimSpan, SimTime,
};

impl MemberState {
    /// Notes the impulses between it and `with` in a step of `dt_s` seconds: by contact, or by one of the links between
    /// them.
    fn note_pair(&mut self, total: &PairTotal, with: AgentId, kind: PairKind, dt_s: f64) {
        let at = self.pairs.iter().position(|pair| pair.with == with && pair.kind == kind).unwrap_or_else(|| {
            self.pairs.push(PairState::new(with, kind));
            self.pairs.len() - 1
        });
        let pair = &mut self.pairs[at];
        let impulse_n_s = total.impulse_n_s.length();
        pair.contacts += if kind == PairKind::Attachment { 1 } else { total.contacts };
        pair.force_n += impulse_n_s / dt_s;
        pair.penetration_m = pair.penetration_m.max(total.depth_m);
        pair.impulse_n_s += impulse_n_s;
        pair.inverse_mass_per_kg = total.inverse_mass_per_kg.or(pair.inverse_mass_per_kg);
    }
}

impl AgentRunner {
    /// Notes how the step was made and solved.
    pub(super) fn note_solves(&mut self, report: &ClusterReport, dt: SimSpan) {
        let (leader, step_s) = (self.shared.id, dt.as_secs_f64());
        let Some(member) = &mut self.cluster else { return };
        let ClusterReport { contacts, factors, products, unfinished, level, miss_m_s, depth_m, .. } = *report;
        member.solved = Some(Solved::from(report));
        let solves = &mut member.solves;
        solves.contacts = contacts;
        solves.problems += u64::from(report.fine_steps);
        solves.factors += u64::from(factors);
        solves.products += u64::from(products);
        solves.unfinished += u64::from(unfinished);
        (solves.level, solves.last_factors, solves.miss_m_s) = (level, factors, miss_m_s);
        (solves.depth_m, solves.deepest_m) = (depth_m, solves.deepest_m.max(depth_m));
        let mut solves = Some(*solves);
        self.each_member(|actor| {
            if let Some(member) = &mut actor.cluster {
                // the solves of the leader, which is the first
                member.state = Some(ClusterState { leader, parts: member.parts, step_s, solves: solves.take() });
            }
        });
    }

    /// Hands every member how far a step of `dt` is from the same in halves.
    pub(super) fn note_errors(&mut self, doubling: &StepDoubling, dt: SimSpan) {
        let Some(member) = &mut self.cluster else { return };
        let span_s = member.schedule.finish_step(dt.as_secs_f64()).then_some(member.schedule.span_s());
        if doubling.apart_m().is_empty() {
            member.schedule.cancel();
        }
        let mut apart_m = doubling.apart_m().iter();
        self.each_member(|actor| {
            if let (Some(member), Some(apart_m)) = (&mut actor.cluster, apart_m.next())
                && let Some(span_s) = span_s
            {
                member.drift_m = drift_m(*apart_m, span_s);
            }
        });
    }

    /// Hands every pair its impulses, and every member its work.
    pub(super) fn note_pairs(&mut self, stepper: &ClusterStepper, dt: SimSpan) {
        let (dt_s, now) = (dt.as_secs_f64(), self.pace.time() + dt);
        let mut place = 0;
        self.each_member(|actor| {
            let (me, Some(member)) = (place, &mut actor.cluster) else { return };
            member.pairs.retain_mut(|pair| {
                (pair.contacts, pair.force_n, pair.penetration_m) = (0, 0.0, 0.0);
                pair.kind == PairKind::Attachment || member.memory.near(now).any(|id| id == pair.with)
            });
            for total in stepper.totals_of(me).iter().filter(|total| total.contacts > 0) {
                let apart = |with: AgentId| member.asynchronous.as_ref().is_some_and(|pairs| pairs.meets(with));
                let pair = match total.partner {
                    Partner::Agent(with) => Some((with, PairKind::Cluster)),
                    Partner::Link(number) => {
                        let link = actor.links.iter().find(|link| link.number == number);
                        link.map(|link| (link.other, PairKind::Attachment))
                    }
                    _ => None,
                };
                if let Some((with, kind)) = pair.filter(|(with, _)| !apart(*with)) {
                    member.note_pair(total, with, kind, dt_s);
                }
            }
            member.wrench = stepper.wrench_of(me) * dt_s.recip();
            let own = stepper.efforts().iter().filter(|total| total.member == me);
            member.efforts.clear();
            member.efforts.extend(own.map(|total| JointEffort { joint: total.joint, effort: total.impulse / dt_s }));
            member.note_contacts(stepper.totals_of(me), dt, now, &actor.shared.streams);
            member.work = stepper.work_of(me);
            let done = &actor.shared.gauges.work;
            done.set(done.get() + member.work);
            let times = stepper.strain_left(me);
            let began = times > 0.0 && !member.under_resolved;
            member.under_resolved = times > 0.0;
            add(&actor.shared.gauges.under_resolved, u64::from(times > 0.0));
            if began {
                let kind = EventKind::UnderResolved(times);
                actor.shared.streams.event(&AgentEvent { at: actor.pace.time() + dt, kind });
            }
            place += 1;
        });
    }

    /// Notes which of the agents that it leads still belong together at the end of a step, `now`.
    pub(super) fn note_groups(&mut self, now: SimTime) {
        let Some(member) = &mut self.cluster else { return };
        let (mut groups, mut ids) = (std::mem::take(&mut member.groups), std::mem::take(&mut member.ids));
        ids.clear();
        self.each_member(|actor| ids.push(actor.shared.id));
        groups.reset(ids.len());
        let mut places = 0..;
        self.each_member(|actor| {
            let (Some(place), Some(member)) = (places.next(), &actor.cluster) else { return };
            let tied = held_by_links(&actor.links, &member.memory);
            for other in member.memory.near(now).chain(tied).chain(member.bonds.iter().copied()) {
                if let Ok(other) = ids.binary_search(&other) {
                    groups.join(place, other);
                }
            }
        });
        self.led.note_groups(self.pace.time(), &mut groups);
        if let Some(member) = &mut self.cluster {
            (member.groups, member.ids) = (groups, ids);
        }
    }
}

impl AgentRunner {
    /// Hands the attachments that yielded and tore in the last step, of `dt`, to the members that report them.
    pub(super) fn note_events(&mut self, stepper: &ClusterStepper, dt: SimSpan) {
        if stepper.held_fast() {
            return;
        }
        let (at, mut ids) = (self.pace.scene_time() + dt, Vec::new());
        self.each_member(|actor| ids.push(actor.shared.id));
        let mut places = 0..;
        self.each_member(|actor| {
            let (Some(place), Some(member)) = (places.next(), &mut actor.cluster) else { return };
            let yielded = stepper.yielded().iter().map(|one| (one, AttachmentEventKind::Yielded));
            let all = yielded.chain(stepper.torn().iter().map(|one| (one, AttachmentEventKind::Tore)));
            for (failed, kind) in all.filter(|(one, _)| one.member == place) {
                let FailedAttachment { other, partner, force_n, .. } = *failed;
                let attachment = match partner {
                    Partner::Link(number) => AttachmentId::Coupling(number),
                    Partner::Joint(number) => AttachmentId::Joint(number),
                    Partner::Attachment(number) => AttachmentId::Part(number),
                    _ => continue,
                };
                let with = other.map(|other| ids[other]);
                member.events.push(AttachmentEvent { attachment, kind, with, at, force_n });
                actor.shared.streams.event(&AgentEvent { at: actor.pace.time() + dt, kind: EventKind::AttachmentGave });
            }
        });
    }
}
