//! Candidates for contact of one agent.
//!
//! In: the agent's own box and time, the broad phase. Out: the peers near enough, by rising numbers.
//! Every peer has a next check: the time before which the two cannot be near, from their distance and their published speeds (the kinetic
//! form of a Verlet list). It need not be checked earlier, and where it is, it is not near: which peers are near does not depend on when
//! others are checked. The few earliest checks are stored one by one; all other peers share one, the
//! earliest of theirs, at which all agents are checked: memory per agent does not grow with the number of agents. Never here: the purpose of the list.

use super::published_bounds::{MovingBox, ReadBounds};
use super::{BroadPhase, PlannedStep};
use crate::cluster::{Epoch, Membership};
use metachron_core::{AgentId, Archive, ArchiveError, Bounds, SimSpan, SimTime, archive_values};
use std::sync::atomic::Ordering::SeqCst;

/// Knowledge of one agent about the boxes of the others.
#[derive(Debug)]
pub(crate) struct NeighbourList {
    me: AgentId,
    mine: Option<MovingBox>,
    /// The speed at the end of the previous step, m/s: the motion to the newest state may have started with it.
    speed_before_m_s: f64,
    /// Peers with checks before the common one, by rising numbers.
    listed: Vec<ListedPeer>,
    /// No listed next check is earlier.
    soonest: SimTime,
    /// The common next check of all peers that are not listed.
    common_check: SimTime,
    /// Next checks are early enough for steps of up to this length.
    longest: SimSpan,
    /// The first log entry that has not been read.
    unread: u64,
    near: Vec<AgentId>,
    /// The epoch of the members that were skipped last.
    epoch: Epoch,
}

/// A peer, and when it is checked again.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct ListedPeer {
    id: AgentId,
    at: SimTime,
    near: bool,
}

/// Boxes closer than this are near at any speed, metres: contact laws look that far ahead.
const SKIN_M: f64 = 0.005;

/// Unpublished change of speed that is allowed for, m/s²: free fall, and as much again.
const ACCELERATION_M_S2: f64 = 20.0;

/// A peer that could touch within this many own steps becomes near.
const NEAR_STEPS: f64 = 2.0;

/// A near peer stays near until it could not touch within this many steps.
const FAR_STEPS: f64 = 4.0;

/// Safety factor of the test for distant peers: more than the rounding of times and distances.
const FAR_ROOM: f64 = 1.001;

/// Number of peers listed in addition to the near ones.
const LISTED: usize = 8;

/// A check that is never due: both are at rest, apart.
const NEVER: SimTime = SimTime::from_nanos(u64::MAX);

impl NeighbourList {
    /// The candidate list of `me`.
    pub fn new(me: AgentId) -> Self {
        Self {
            me,
            mine: None,
            speed_before_m_s: 0.0,
            listed: Vec::new(),
            soonest: SimTime::ZERO,
            common_check: SimTime::ZERO,
            longest: SimSpan::ZERO,
            unread: 0,
            near: Vec::new(),
            epoch: Epoch::default(),
        }
    }

    /// Writes or reads the agents near, and when others are looked at again.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let Self { me: _, mine, speed_before_m_s, listed, soonest, common_check, longest, unread, near, epoch } = self;
        archive_values!(archive, *mine, *speed_before_m_s, *listed, *soonest, *common_check)?;
        archive_values!(archive, *longest, *unread, *near, *epoch)
    }

    /// Looks at all agents before its next step: it comes from another process, whose log has other numbers.
    pub fn arrive(&mut self, broad_phase: &BroadPhase) {
        (self.common_check, self.unread) = (SimTime::ZERO, broad_phase.noted.load(SeqCst));
    }

    /// The near peers at the last check, by rising numbers.
    pub fn near(&self) -> &[AgentId] {
        &self.near
    }

    /// Publishes to the broad phase that this agent is inside `bounds` before a `step` (`None`: without bounds).
    pub fn publish(&mut self, broad_phase: &BroadPhase, bounds: Option<&Bounds>, step: PlannedStep) {
        let mut is_new = false;
        self.mine = bounds.filter(|b| is_sound(b)).map(|bounds| {
            let speed_m_s = bounds.speed_m_s.max(self.speed_before_m_s);
            let published = broad_phase.publish(self.me, &Bounds { speed_m_s, ..*bounds }, step);
            is_new = published.is_new;
            published.bounds
        });
        self.speed_before_m_s = bounds.map_or(0.0, |b| b.speed_m_s);
        if is_new {
            self.common_check = SimTime::ZERO;
        }
    }

    /// Checks the peers whose next check is due, before a `step`; returns how many were checked. Only peers that it `may_touch` are near;
    /// members of its own cluster (`members`) are skipped.
    pub fn update(
        &mut self,
        broad_phase: &BroadPhase,
        step: PlannedStep,
        members: &Membership,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let PlannedStep { start: now, dt } = step;
        if self.epoch != members.epoch() {
            (self.epoch, self.common_check) = (members.epoch(), SimTime::ZERO);
        }
        self.read_log(broad_phase, members);
        if dt > self.longest {
            self.common_check = SimTime::ZERO;
        }
        if self.soonest.min(self.common_check) > now {
            return 0;
        }
        let Some(mine) = self.mine else { return 0 };
        let checked = if self.common_check <= now {
            self.longest = SimSpan::from_nanos(dt.as_nanos().saturating_mul(2));
            self.check_all(broad_phase, step, members, may_touch)
        } else {
            self.listed.retain(|other| !members.has(other.id));
            self.check_due(broad_phase, &mine, step, may_touch)
        };
        self.soonest = self.listed.iter().map(|other| other.at).min().unwrap_or(NEVER);
        self.near.clear();
        self.near.extend(self.listed.iter().filter(|other| other.near).map(|other| other.id));
        checked
    }

    /// Checks the listed peers whose next check is due; a peer that is distant again falls back to the common next check.
    fn check_due(
        &mut self,
        broad_phase: &BroadPhase,
        mine: &MovingBox,
        step: PlannedStep,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let (mut checked, common_check, longest) = (0, self.common_check, self.longest);
        self.listed.retain_mut(|other| {
            let is_new = other.at == SimTime::ZERO;
            if other.at <= step.start {
                checked += 1;
                (other.at, other.near) = next_check(mine, broad_phase.bounds_of(other.id), other.near, step, longest);
            }
            (other.near || other.at < common_check) && (!is_new || may_touch(other.id))
        });
        checked
    }

    /// Checks all agents, and lists the ones with the earliest checks.
    fn check_all(
        &mut self,
        broad_phase: &BroadPhase,
        step: PlannedStep,
        members: &Membership,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let Some(mine) = self.mine else { return 0 };
        let longest = self.longest;
        let (mut limit, mut checked) = (2 * LISTED, 0);
        self.common_check = NEVER;
        self.listed.clear();
        let me = self.me;
        for (id, published) in
            (0..).map(AgentId).zip(broad_phase.bounds.iter()).filter(|(id, _)| *id != me && !members.has(*id))
        {
            let seen = published.read();
            checked += 1;
            if is_far(&mine, &seen, self.common_check, step.start, longest) {
                continue;
            }
            let was_near = self.near.binary_search(&id).is_ok();
            let (at, near) = next_check(&mine, seen, was_near, step, longest);
            if (!near && at >= self.common_check) || !may_touch(id) {
                continue;
            }
            self.listed.push(ListedPeer { id, at, near });
            if self.listed.len() == limit {
                limit = self.shorten();
            }
        }
        self.shorten();
        self.listed.sort_unstable_by_key(|other| other.id);
        checked
    }

    /// Moves all but the earliest checks and the near peers to the common one; returns the length of the list at which to do so
    /// again.
    fn shorten(&mut self) -> usize {
        let kept = LISTED + 2 * self.listed.iter().filter(|other| other.near).count();
        if self.listed.len() > kept {
            let rank = |other: &ListedPeer| (!other.near, other.at, other.id);
            let (_, first_left, _) = self.listed.select_nth_unstable_by_key(kept, rank);
            self.common_check = first_left.at;
            self.listed.truncate(kept);
        }
        kept + LISTED
    }

    /// Makes the peers due for a check that are not where their published boxes led.
    fn read_log(&mut self, broad_phase: &BroadPhase, members: &Membership) {
        let Self { me, listed, soonest, common_check, near, .. } = self;
        let most = 2 * (LISTED + near.len());
        let (next, whole) = broad_phase.read_log(self.unread, |id| {
            if id == *me || *common_check == SimTime::ZERO || members.has(id) {
                return;
            }
            *soonest = SimTime::ZERO;
            match listed.binary_search_by_key(&id, |other| other.id) {
                Ok(at) => listed[at].at = SimTime::ZERO,
                Err(at) if listed.len() < most => listed.insert(at, ListedPeer { id, at: SimTime::ZERO, near: false }),
                Err(_) => *common_check = SimTime::ZERO,
            }
        });
        self.unread = next;
        if whole.is_none() {
            self.common_check = SimTime::ZERO;
        }
    }
}

/// By how much the box of an agent is widened to its reach, metres: two that are apart with it are not near, in steps of at most `dt`, even where
/// they were ([`next_check`] of both).
pub(super) fn reach_m(speed_m_s: f64, dt: SimSpan) -> f64 {
    let dt_s = dt.as_secs_f64();
    SKIN_M + FAR_ROOM * ((FAR_STEPS + 1.0) * dt_s * speed_m_s + surplus_m(dt))
}

/// Whether a peer that is `seen` is certainly not near and its next check not before `common_check`: without a square root or a division, as
/// most peers in a large scene are distant. If in doubt it returns `false`.
fn is_far(mine: &MovingBox, seen: &ReadBounds, common_check: SimTime, now: SimTime, longest: SimSpan) -> bool {
    let ReadBounds::Known(theirs) = seen else { return false };
    if common_check == NEVER {
        return false;
    }
    // two of the longest steps are four of its own at least, for which a near one stays near
    let until_s = common_check.secs_after(now) + NEAR_STEPS * longest.as_secs_f64();
    let way_m = until_s * (mine.speed_m_s + theirs.speed_m_s) + leap_m(theirs);
    let least_m = FAR_ROOM * (way_m + SKIN_M + drift_m(theirs, now) + surplus_m(longest));
    mine.gap_vector(theirs).length_squared() > least_m * least_m
}

/// When a peer that is `seen` is checked again, before a step that is longer than `longest`, and whether it is near now, before a `step`.
/// Until then it is not near at any check (`docs/theory/clusters.md`, section 11).
fn next_check(
    mine: &MovingBox,
    seen: ReadBounds,
    was_near: bool,
    step: PlannedStep,
    longest: SimSpan,
) -> (SimTime, bool) {
    let PlannedStep { start: now, dt } = step;
    let next_turn = now + SimSpan::from_nanos(1);
    let theirs = match seen {
        // a log entry announces its first box
        ReadBounds::Unpublished => return (NEVER, false),
        ReadBounds::Changing => return (next_turn, true),
        ReadBounds::Known(reach) => reach,
    };
    let (dt_s, longest_s) = (dt.as_secs_f64(), longest.as_secs_f64());
    let speed_m_s = mine.speed_m_s + theirs.speed_m_s;
    // own matter is where its box was last published, however long ago: time dropped or slept moves nothing
    let slack_m = mine.gap_m(&theirs) - SKIN_M - drift_m(&theirs, now);
    let near = slack_m - surplus_m(dt) <= speed_m_s * dt_s * if was_near { FAR_STEPS } else { NEAR_STEPS };
    let until_s = (slack_m - surplus_m(longest) - leap_m(&theirs)) / speed_m_s - NEAR_STEPS * longest_s;
    let at = SimSpan::from_secs_f64((until_s / FAR_ROOM).max(0.0)).map_or(NEVER, |span| now + span);
    (if near { next_turn } else { at.max(next_turn) }, near)
}

/// How far an unpublished change of speed leads within a step, metres.
fn surplus_m(dt: SimSpan) -> f64 {
    0.5 * ACCELERATION_M_S2 * dt.as_secs_f64() * dt.as_secs_f64()
}

/// How far matter may have moved out of its box by `now`, metres; zero for a box at rest.
fn drift_m(reach: &MovingBox, now: SimTime) -> f64 {
    reach.speed_m_s * now.secs_after(reach.time).abs()
}

/// How much nearer a box that is published before its time comes may be than it is then, metres: a step ahead, and led a step back.
fn leap_m(reach: &MovingBox) -> f64 {
    2.0 * reach.speed_m_s * reach.step_s
}

fn is_sound(bounds: &Bounds) -> bool {
    bounds.low.is_finite() && bounds.high.is_finite() && bounds.speed_m_s.is_finite() && bounds.speed_m_s >= 0.0
}
