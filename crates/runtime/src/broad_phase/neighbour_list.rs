//! Candidates for contact of one agent.
//!
//! In: the agent's own box and time, the crowd. Out: the peers near enough, by rising numbers.
//! Every peer has an appointment: the time before which the two cannot be near, from their distance and their published speeds (the kinetic
//! form of a Verlet list). It is not checked earlier. The few earliest appointments are stored one by one; all other peers share one, the
//! earliest of theirs, at which all agents are checked: memory per agent does not grow with the crowd. Never here: the purpose of the list.

use super::super::fellows::{Fellows, World};
use super::published_bounds::{Reach, Seen};
use super::{BroadPhase, PlannedStep, SPEED_LEAST_M_S};
use metachron_core::{AgentId, Bounds, SimSpan, SimTime};

/// Knowledge of one agent about the boxes of the others.
#[derive(Debug)]
pub(in super::super) struct NeighbourList {
    me: AgentId,
    mine: Option<Reach>,
    /// The speed at the end of the previous step, m/s: the motion to the newest state may have started with it.
    speed_before_m_s: f64,
    /// Peers with appointments before the common one, by rising numbers.
    listed: Vec<Other>,
    /// No listed appointment is earlier.
    soonest: SimTime,
    /// The common appointment of all peers that are not listed.
    everybody: SimTime,
    /// The step length for which appointments were made.
    dt: SimSpan,
    /// The first log entry that has not been read.
    unread: u64,
    near: Vec<AgentId>,
    /// The island whose members were skipped last.
    world: World,
}

/// A peer, and when it is checked again.
#[derive(Debug, Clone, Copy)]
struct Other {
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

/// An appointment that is never due: both are at rest, apart.
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
            everybody: SimTime::ZERO,
            dt: SimSpan::ZERO,
            unread: 0,
            near: Vec::new(),
            world: World::default(),
        }
    }

    /// The near peers at the last check, by rising numbers.
    pub fn near(&self) -> &[AgentId] {
        &self.near
    }

    /// Publishes to the crowd that this agent is inside `bounds` at its time `time` (`None`: without bounds).
    pub fn stand(&mut self, crowd: &BroadPhase, bounds: Option<&Bounds>, time: SimTime) {
        let said = self.mine.map_or(0.0, |mine| mine.speed_m_s);
        self.mine = bounds.filter(|b| is_sound(b)).map(|bounds| {
            let speed_m_s = bounds.speed_m_s.max(self.speed_before_m_s);
            let said_m_s = crowd.stand(self.me, &Bounds { speed_m_s, ..*bounds }, time).max(SPEED_LEAST_M_S);
            Reach::new(bounds, said_m_s, time)
        });
        self.speed_before_m_s = bounds.map_or(0.0, |b| b.speed_m_s);
        if self.mine.is_some_and(|mine| mine.speed_m_s > said) {
            self.everybody = SimTime::ZERO;
        }
    }

    /// Checks the peers whose appointment is due, before a `step`; returns how many were checked. Only peers that it `may_touch` are near;
    /// members of its own island (`fellows`) are skipped.
    pub fn look(
        &mut self,
        crowd: &BroadPhase,
        step: PlannedStep,
        fellows: &Fellows,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let PlannedStep { start: now, dt } = step;
        if self.world != fellows.world() {
            (self.world, self.everybody) = (fellows.world(), SimTime::ZERO);
        }
        self.read_notes(crowd, fellows);
        // appointments leave time for two steps
        if dt.as_nanos() > 2 * self.dt.as_nanos() {
            self.everybody = SimTime::ZERO;
        }
        if self.soonest.min(self.everybody) > now {
            return 0;
        }
        let Some(mine) = self.mine else { return 0 };
        let looks = if self.everybody <= now {
            self.dt = dt;
            self.survey(crowd, now, fellows, may_touch)
        } else {
            self.listed.retain(|other| !fellows.has(other.id));
            self.keep_appointments(crowd, &mine, now, may_touch)
        };
        self.soonest = self.listed.iter().map(|other| other.at).min().unwrap_or(NEVER);
        self.near.clear();
        self.near.extend(self.listed.iter().filter(|other| other.near).map(|other| other.id));
        looks
    }

    /// Checks the listed peers whose appointment is due; a peer that is distant again falls back to the common appointment.
    fn keep_appointments(
        &mut self,
        crowd: &BroadPhase,
        mine: &Reach,
        now: SimTime,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let (mut looks, everybody) = (0, self.everybody);
        let step = PlannedStep { start: now, dt: self.dt };
        self.listed.retain_mut(|other| {
            let is_new = other.at == SimTime::ZERO;
            if other.at <= now {
                looks += 1;
                (other.at, other.near) = appointment(mine, crowd.seen(other.id), other.near, step);
            }
            (other.near || other.at < everybody) && (!is_new || may_touch(other.id))
        });
        looks
    }

    /// Checks all agents, and lists those with the earliest appointments.
    fn survey(
        &mut self,
        crowd: &BroadPhase,
        now: SimTime,
        fellows: &Fellows,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let Some(mine) = self.mine else { return 0 };
        let step = PlannedStep { start: now, dt: self.dt };
        let (mut room, mut looks) = (2 * LISTED, 0);
        self.everybody = NEVER;
        self.listed.clear();
        let me = self.me;
        for (id, berth) in (0..).map(AgentId).zip(&crowd.berths).filter(|(id, _)| *id != me && !fellows.has(*id)) {
            let seen = berth.read();
            looks += 1;
            if is_far(&mine, &seen, self.everybody, step) {
                continue;
            }
            let was_near = self.near.binary_search(&id).is_ok();
            let (at, near) = appointment(&mine, seen, was_near, step);
            if (!near && at >= self.everybody) || !may_touch(id) {
                continue;
            }
            self.listed.push(Other { id, at, near });
            if self.listed.len() == room {
                room = self.shorten();
            }
        }
        self.shorten();
        self.listed.sort_unstable_by_key(|other| other.id);
        looks
    }

    /// Moves all but the earliest appointments and the near peers to the common one; returns the length of the list at which to do so
    /// again.
    fn shorten(&mut self) -> usize {
        let kept = LISTED + 2 * self.listed.iter().filter(|other| other.near).count();
        if self.listed.len() > kept {
            let rank = |other: &Other| (!other.near, other.at, other.id);
            let (_, first_left, _) = self.listed.select_nth_unstable_by_key(kept, rank);
            self.everybody = first_left.at;
            self.listed.truncate(kept);
        }
        kept + LISTED
    }

    /// Makes the peers that became faster than their published speed due for a check.
    fn read_notes(&mut self, crowd: &BroadPhase, fellows: &Fellows) {
        let Self { me, listed, soonest, everybody, near, .. } = self;
        let most = 2 * (LISTED + near.len());
        let (next, whole) = crowd.notes(self.unread, |id| {
            if id == *me || *everybody == SimTime::ZERO || fellows.has(id) {
                return;
            }
            *soonest = SimTime::ZERO;
            match listed.binary_search_by_key(&id, |other| other.id) {
                Ok(at) => listed[at].at = SimTime::ZERO,
                Err(at) if listed.len() < most => listed.insert(at, Other { id, at: SimTime::ZERO, near: false }),
                Err(_) => *everybody = SimTime::ZERO,
            }
        });
        self.unread = next;
        if whole.is_none() {
            self.everybody = SimTime::ZERO;
        }
    }
}

/// Whether a peer that is `seen` is certainly not near and its appointment not before `everybody`: without a square root or a division, as
/// most peers in a crowd are distant. If in doubt it returns `false`.
fn is_far(mine: &Reach, seen: &Seen, everybody: SimTime, step: PlannedStep) -> bool {
    let PlannedStep { start: now, dt } = step;
    let Seen::There(theirs) = seen else { return false };
    if everybody == NEVER {
        return false;
    }
    let dt_s = dt.as_secs_f64();
    // the common appointment, plus the steps ahead of contact at which a peer already counts as near
    let until_s = (everybody.secs_after(now) + NEAR_STEPS * dt_s).max(FAR_STEPS * dt_s);
    let way_m = until_s * (mine.speed_m_s + theirs.speed_m_s);
    let least_m = FAR_ROOM * (way_m + SKIN_M + drift_m(theirs, now) + 0.5 * ACCELERATION_M_S2 * dt_s * dt_s);
    mine.gap_vector(theirs).length_squared() > least_m * least_m
}

/// When a peer that is `seen` is checked again, and whether it is near now, before a `step`.
fn appointment(mine: &Reach, seen: Seen, was_near: bool, step: PlannedStep) -> (SimTime, bool) {
    let PlannedStep { start: now, dt } = step;
    let next_turn = now + SimSpan::from_nanos(1);
    let theirs = match seen {
        // a log entry announces its first box
        Seen::Nowhere => return (NEVER, false),
        Seen::Unsure => return (next_turn, true),
        Seen::There(reach) => reach,
    };
    let dt_s = dt.as_secs_f64();
    // own matter is where its box was last published, however long ago: time dropped or slept moves nothing
    let slack_m = mine.gap_m(&theirs) - SKIN_M - drift_m(&theirs, now) - 0.5 * ACCELERATION_M_S2 * dt_s * dt_s;
    let until_s = slack_m / (mine.speed_m_s + theirs.speed_m_s);
    let near = until_s <= dt_s * if was_near { FAR_STEPS } else { NEAR_STEPS };
    let at = SimSpan::from_secs_f64(until_s - NEAR_STEPS * dt_s).map_or(NEVER, |span| now + span);
    (if near { next_turn } else { at.max(next_turn) }, near)
}

/// How far matter may have moved out of its box by `now`, metres; zero for a box at rest.
fn drift_m(reach: &Reach, now: SimTime) -> f64 {
    if reach.speed_m_s == 0.0 {
        return 0.0;
    }
    let age_s = now.secs_after(reach.time).abs();
    reach.speed_m_s * age_s + 0.5 * ACCELERATION_M_S2 * age_s * age_s
}

fn is_sound(bounds: &Bounds) -> bool {
    bounds.low.is_finite() && bounds.high.is_finite() && bounds.speed_m_s.is_finite() && bounds.speed_m_s >= 0.0
}
