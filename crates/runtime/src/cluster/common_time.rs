//! How agents that may touch come to one time, so that they can step as one.
//!
//! In: which agents are near, and how far behind each of them is. Out: whether an agent waits for others, and the time
//! that it takes for its own: a newcomer takes the time of the agents that it comes near, and an agent that is alone
//! again that of the scene.
//! Never here: how late an agent is ([`crate::time::agent_clock`]), steps. Theory: docs/theory/clusters.md, section 9.

use super::holds;
use super::membership::Membership;
use crate::neighbours::broad_phase::PlannedStep;
use crate::turn::agent_runner::AgentRunner;
use metachron_contact::Neighbour;
use metachron_core::{AgentId, SimSpan, SimTime};
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

/// An agent whose time is farther behind than this is not only late, seconds: a newcomer takes its time for its own.
const FAR_BEHIND_S: f64 = 0.1;

/// Nobody runs ahead of others that are near by more than this and one of their steps, seconds: as long as a system lets a thread wait now
/// and then, and as short as a fall from rest makes 2 mm in.
const AHEAD_S: f64 = 0.02;

impl AgentRunner {
    /// Whether it waits for others that are behind, with all it leads.
    pub fn waits(&mut self, wall: Duration) -> bool {
        // the states that it saw last are older than the newest: an agent that was not behind in them is not behind now
        let news = self.awaited().and_then(|_| {
            self.observer.refresh();
            self.led.each(|actor| actor.observer.refresh());
            self.awaited()
        });
        let waits = news.is_some_and(|news| self.pace.wait(wall, news));
        if waits {
            // agents that it waits for may wait for news of it: a state that was lost is shown again
            self.show_withheld();
            self.led.each(Self::show_withheld);
        }
        waits
    }

    /// The newest states of the agents that it, or one it leads, would leave behind: the sum of their times.
    fn awaited(&self) -> Option<u64> {
        let time = self.pace.time();
        let is_behind = |n: &&Neighbour| time.secs_after(n.snapshot.time) > AHEAD_S + self.step_of(n.id);
        let awaited = self.others_near(|actor| actor.pace.time() == time).filter(is_behind);
        let awaited = awaited.filter(|n| !n.snapshot.at_rest && self.runs(n.id));
        awaited.map(|n| n.snapshot.time.as_nanos()).reduce(u64::wrapping_add)
    }

    /// Whether it keeps one time with others: it leads some, or some are near that do not step with it, or have not
    /// taken its impulses yet. Not asked where nobody is late.
    pub fn keeps_common_time(&mut self, now: SimTime, late: bool) -> bool {
        let is_any_behind = self.pace.clock_offset() > SimSpan::ZERO || self.shared.sleep.is_any_far_behind(now);
        let was_near = self.was_near.take();
        if !(late || is_any_behind) {
            return false;
        }
        if is_any_behind && was_near != Some(true) {
            self.look_around();
        }
        let is_near = self.others_near(|_| true).next().is_some();
        self.was_near = Some(is_near);
        if !self.is_settled() {
            return true;
        }
        if is_any_behind {
            self.agree_on_time(was_near, is_near);
        }
        is_near || !self.led.is_empty()
    }

    /// A newcomer takes the time of the agents that it comes near, and an agent that is alone again that of the scene.
    /// One that was near them before it was asked, or leads others, keeps its own: it has a share in what they do.
    fn agree_on_time(&mut self, was_near: Option<bool>, is_near: bool) {
        let clock_offset = match (was_near, is_near) {
            (Some(false), true) => self.offset_of_last(),
            (_, false) if self.led.is_empty() => SimSpan::ZERO,
            _ => return,
        };
        if clock_offset != self.pace.clock_offset() {
            self.shift_clock(clock_offset);
            self.led.each(|actor| actor.shift_clock(clock_offset));
        }
    }

    /// Whether no impulse is in flight between it, or the agents that it leads, and any other.
    fn is_settled(&self) -> bool {
        let settled = |actor: &Self| actor.observer.is_settled(actor.id(), &actor.writer, |id| actor.runs(id));
        settled(self) && self.led.all().all(settled)
    }

    /// Whether another agent is at its time, as far as steps and hiccups allow: only then the two may step as one.
    pub fn is_at_the_time_of(&self, id: AgentId) -> bool {
        let Some(peer) = self.peers.get(id) else { return false };
        let theirs = peer.slot.latest();
        let allowed_s = FAR_BEHIND_S + self.pace.dt().as_secs_f64() + self.step_of(id);
        theirs.at_rest || self.pace.time().secs_after(theirs.time).abs() <= allowed_s
    }

    /// Its clock offset at the time of the neighbour farthest behind; its present one where none is far behind.
    fn offset_of_last(&self) -> SimSpan {
        let moment = self.pace.scene_time();
        let far = |n: &&Neighbour| self.pace.time().secs_after(n.snapshot.time) > FAR_BEHIND_S;
        let last = self.others_near(|_| true).filter(|n| !n.snapshot.at_rest && self.runs(n.id)).filter(far);
        last.map(|n| n.snapshot.time).min().map_or(self.pace.clock_offset(), |time| moment.since(time))
    }

    fn shift_clock(&mut self, clock_offset: SimSpan) {
        let by_s = self.pace.set_clock_offset(clock_offset);
        // one that panics there is parked at its next call
        drop(self.model.call(|agent| agent.shift_clock(by_s)));
    }

    /// Looks around for itself and for the agents that it leads.
    fn look_around(&mut self) {
        let (time, moment, dt) = (self.pace.time(), self.pace.scene_time(), self.pace.dt());
        let step = PlannedStep { start: moment, dt };
        if self.led.is_empty() {
            self.observe(step, &Membership::default());
            return;
        }
        let mut led = std::mem::take(&mut self.led);
        led.note_membership(self.shared.id, time);
        self.observe(step, led.membership());
        led.each_at(time, |actor, membership| actor.observe(step, membership));
        self.led = led;
    }

    /// The neighbours that do not step with it: its own, and those of the agents it leads of which `which` is true.
    fn others_near(&self, which: impl Fn(&Self) -> bool) -> impl Iterator<Item = &Neighbour> {
        let led = self.led.all().filter(move |actor| which(actor));
        let all = std::iter::once(self).chain(led).flat_map(Self::near_or_tied);
        all.filter(|n| self.led.is_empty() || self.shared.sleep.leader(n.id) != self.id())
    }

    /// Peers that may soon touch it, and peers that it is linked with or held by.
    fn near_or_tied(&self) -> impl Iterator<Item = &Neighbour> {
        let Self { observer, links, .. } = self;
        observer.neighbours().iter().filter(move |n| {
            let is_linked = || links.iter().any(|link| link.other == n.id);
            observer.near().binary_search(&n.id).is_ok() || is_linked() || holds(n, observer.me()).is_some()
        })
    }

    /// How long the steps are that another agent wants now, seconds.
    fn step_of(&self, id: AgentId) -> f64 {
        self.peers.get(id).map_or(0.0, |peer| SimSpan::from_nanos(peer.gauges.dt.load(Relaxed)).as_secs_f64())
    }

    fn runs(&self, id: AgentId) -> bool {
        self.peers.get(id).is_some_and(|peer| peer.gauges.is_running())
    }
}
