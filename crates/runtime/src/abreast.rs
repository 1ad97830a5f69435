//! How agents that are near each other live at one pace.
//!
//! In: who is near, and how far behind each of them is. Out: whether an agent waits for others, and what it calls its own time: a
//! newcomer takes the time of those it comes near for its own, and who is alone again that of the scene.
//! Never here: how late an agent is ([`crate::agent_clock`]), steps. Theory: docs/theory/coupling.md, section 3.

use super::agent_runner::AgentRunner;
use super::broad_phase::PlannedStep;
use super::fellows::Fellows;
use super::observation::newest;
use metachron_contact::beside::{is_beside, leaves_behind};
use metachron_contact::{Neighbour, StepContext};
use metachron_core::{AgentId, Bounds, SimSpan, SimTime};
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

/// Whose time is farther behind than this is not only late, seconds: a newcomer takes it for its own.
const FAR_BEHIND_S: f64 = 0.1;

impl AgentRunner {
    /// Whether it waits for others that are behind, with all it leads.
    pub fn waits(&mut self, wall: Duration) -> bool {
        // what it saw last was behind by more than it is now: who was not is not
        let heard = self.awaited().and_then(|_| {
            self.observer.refresh();
            self.company.each(|seat| seat.observer.refresh());
            self.awaited()
        });
        let waits = heard.is_some_and(|heard| self.pace.wait(wall, heard));
        if waits {
            // those it waits for may wait for news of it: a state that was lost is told again
            self.show_withheld();
            self.company.each(Self::show_withheld);
        }
        waits
    }

    /// What was heard last of those whom it, or one it leads, would leave behind: the sum of their times.
    fn awaited(&self) -> Option<u64> {
        let (time, dt) = (self.pace.time(), self.pace.dt());
        let fellows = self.company.all().filter(|actor| actor.pace.time() == time);
        let all = std::iter::once(self)
            .chain(fellows)
            .flat_map(move |actor| actor.met(dt, |n, steps, around, bounds| leaves_behind(n, steps, around, bounds)));
        let strangers = all.filter(|n| self.runs(n.id));
        let strangers = strangers.filter(|n| self.company.is_empty() || self.shared.sleep.leader(n.id) != self.id());
        strangers.map(|n| n.snapshot.time.as_nanos()).reduce(u64::wrapping_add)
    }

    /// Those it sees of whom `which` is true before a step of `dt`.
    fn met(
        &self,
        dt: SimSpan,
        which: impl Fn(&Neighbour, (SimSpan, f64), &StepContext<'_>, &dyn Fn() -> Option<Bounds>) -> bool,
    ) -> impl Iterator<Item = &Neighbour> {
        let Self { observer, hands, links, writer, pace, .. } = self;
        let (me, time) = (self.shared.id, pace.time());
        let around = StepContext { me, time, neighbours: observer.neighbours(), hands, links };
        let bounds = move || newest(writer, |state| state.bounds);
        let steps = move |n: &Neighbour| (dt, n.step_s.max(self.step_of(n.id)));
        around.neighbours.iter().filter(move |n| which(n, steps(n), &around, &bounds))
    }

    /// Whether it lives at one pace with others: somebody is beside it who does not step with it, or has not taken yet what it gave.
    /// Not asked where nobody is late.
    pub fn keeps_company(&mut self, now: SimTime, late: bool) -> bool {
        let somebody_is = self.pace.clock_offset() > SimSpan::ZERO || self.shared.sleep.is_any_far_behind(now);
        let was_beside = self.beside.take();
        if !(late || somebody_is) {
            return false;
        }
        if somebody_is && was_beside != Some(true) {
            self.look_around();
        }
        let is_beside = self.is_beside_others();
        self.beside = Some(is_beside);
        if !self.is_settled() {
            return true;
        }
        if somebody_is {
            self.agree_on_time(was_beside, is_beside);
        }
        is_beside
    }

    /// Who comes beside others takes their time for its own, and who has nobody beside it any more that of the scene. Who was beside them
    /// before it was asked keeps its own: it has a share in what they do.
    fn agree_on_time(&mut self, was_beside: Option<bool>, is_beside: bool) {
        let clock_offset = match (was_beside, is_beside) {
            (_, false) => SimSpan::ZERO,
            (Some(false), true) => self.put_off_beside(),
            _ => return,
        };
        if clock_offset != self.pace.clock_offset() {
            self.shift_clock(clock_offset);
            self.company.each(|seat| seat.shift_clock(clock_offset));
        }
    }

    /// Whether nothing is on its way between it, with those it leads, and anybody.
    fn is_settled(&self) -> bool {
        let settled = |actor: &Self| actor.observer.is_settled(actor.id(), &actor.writer, |id| actor.runs(id));
        settled(self) && self.company.all().all(settled)
    }

    /// Whether another agent is at its time, as far as steps and hiccups allow: only then the two may step as one.
    pub fn is_at_the_time_of(&self, id: AgentId) -> bool {
        let Some(peer) = self.peers.get(id) else { return false };
        let theirs = peer.shared.slot.latest();
        let allowed_s = FAR_BEHIND_S + self.pace.dt().as_secs_f64() + self.step_of(id);
        theirs.at_rest || self.pace.time().secs_after(theirs.time).abs() <= allowed_s
    }

    /// By how much it would have to be put off to be at the time of the one farthest behind of those beside it; as it is where
    /// nobody is far behind.
    fn put_off_beside(&self) -> SimSpan {
        let moment = self.pace.scene_time();
        let far = |n: &&Neighbour| self.pace.time().secs_after(n.snapshot.time) > FAR_BEHIND_S;
        let last = self.strangers().filter(|n| !n.snapshot.at_rest && self.runs(n.id)).filter(far);
        last.map(|n| n.snapshot.time).min().map_or(self.pace.clock_offset(), |time| moment.since(time))
    }

    fn shift_clock(&mut self, clock_offset: SimSpan) {
        let by_s = self.pace.set_clock_offset(clock_offset);
        self.agent.shift_clock(by_s);
    }

    /// Looks around for itself and for those it leads.
    fn look_around(&mut self) {
        let nobody = Fellows::default();
        let (time, moment, dt) = (self.pace.time(), self.pace.scene_time(), self.pace.dt());
        if !self.company.is_empty() {
            self.company.gather_fellows(self.id(), time);
        }
        let Self { observer, peers, writer, company, .. } = self;
        observer.update(peers, writer, PlannedStep { start: moment, dt }, company.fellows().unwrap_or(&nobody));
        company.each_beside(|seat, fellows| {
            if seat.pace.time() == time {
                seat.observer.update(&seat.peers, &seat.writer, PlannedStep { start: moment, dt }, fellows);
            }
        });
    }

    /// Those beside it, or beside one it leads, who do not step with it.
    fn strangers(&self) -> impl Iterator<Item = &Neighbour> {
        let dt = self.pace.dt();
        let all = std::iter::once(self)
            .chain(self.company.all())
            .flat_map(move |actor| actor.met(dt, |n, steps, around, bounds| is_beside(n, steps, around, bounds)));
        all.filter(|n| self.company.is_empty() || self.shared.sleep.leader(n.id) != self.id())
    }

    fn is_beside_others(&self) -> bool {
        self.strangers().next().is_some()
    }

    /// How long the steps are that another agent wants now, seconds.
    fn step_of(&self, id: AgentId) -> f64 {
        self.peers.get(id).map_or(0.0, |peer| SimSpan::from_nanos(peer.shared.gauges.dt.load(Relaxed)).as_secs_f64())
    }

    fn runs(&self, id: AgentId) -> bool {
        self.peers.get(id).is_some_and(|peer| peer.shared.gauges.is_running())
    }
}
