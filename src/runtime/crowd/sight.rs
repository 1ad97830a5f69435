//! Whom one agent may touch next.
//!
//! In: the agent's own box and time, the crowd. Out: the others near enough, by rising numbers.
//! Each other has an appointment: the time before which the two cannot be near, from their distance and the speeds that are
//! said of them (the kinetic form of a Verlet list). Nobody is looked at before. The few whose appointments come first are
//! remembered one by one; all others share one, the earliest of theirs, at which everybody is looked at: what an agent
//! remembers does not grow with the crowd. Never here: why they are listed.

use super::super::fellows::{Fellows, World};
use super::berth::{Reach, Seen};
use super::{Crowd, SPEED_LEAST_M_S};
use metachron_core::{AgentId, Bounds, SimSpan, SimTime};

/// What one agent knows of where the others are.
#[derive(Debug)]
pub(in super::super) struct Sight {
    me: AgentId,
    mine: Option<Reach>,
    /// The speed at the end of the step before, m/s: the way to the newest state may have begun with it.
    speed_before_m_s: f64,
    /// Those with appointments before the common one, by rising numbers.
    listed: Vec<Other>,
    /// No appointment in the list is earlier.
    soonest: SimTime,
    /// The appointment with all who are not listed.
    everybody: SimTime,
    /// The step that appointments were made for.
    dt: SimSpan,
    /// The first note of the log that has not been read.
    unread: u64,
    near: Vec<AgentId>,
    /// The world whose members were passed over last.
    world: World,
}

/// Another agent, and when it is looked at again.
#[derive(Debug, Clone, Copy)]
struct Other {
    id: AgentId,
    at: SimTime,
    near: bool,
}

/// Skins closer than this are near whatever the speeds, metres: contact laws look that far ahead.
const SKIN_M: f64 = 0.005;

/// Speeds may change by so much a second before anybody says so, m/s²: free fall, and as much again.
const ACCELERATION_M_S2: f64 = 20.0;

/// Who could touch within so many of one's steps is near.
const NEAR_STEPS: f64 = 2.0;

/// Who is near stays so until he could not touch within so many.
const FAR_STEPS: f64 = 4.0;

/// What is surely far is so with this factor to spare: more than roundings of times and distances.
const FAR_ROOM: f64 = 1.001;

/// So many are remembered besides those who are near.
const LISTED: usize = 8;

/// An appointment that is never due: both stand still, apart.
const NEVER: SimTime = SimTime::from_nanos(u64::MAX);

impl Sight {
    /// The sight of `me`.
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

    /// Those who were near when it last looked, by rising numbers.
    pub fn near(&self) -> &[AgentId] {
        &self.near
    }

    /// This agent is inside `bounds` at its time `time` (`None`: nowhere), and lets the crowd know.
    pub fn stand(&mut self, crowd: &Crowd, bounds: Option<&Bounds>, time: SimTime) {
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

    /// Looks at those whose appointment has come, before a step of `dt` from `now`; says how many that were. Only those that
    /// it `may_touch` are near, and `fellows` are passed over.
    pub fn look(
        &mut self,
        crowd: &Crowd,
        (now, dt): (SimTime, SimSpan),
        fellows: &Fellows,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
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
            self.survey(crowd, &mine, now, (fellows, may_touch))
        } else {
            self.listed.retain(|other| !fellows.has(other.id));
            self.keep_appointments(crowd, &mine, now, may_touch)
        };
        self.soonest = self.listed.iter().map(|other| other.at).min().unwrap_or(NEVER);
        self.near.clear();
        self.near.extend(self.listed.iter().filter(|other| other.near).map(|other| other.id));
        looks
    }

    /// Looks at those in the list whose time has come; who is out of the way again is left to the common appointment.
    fn keep_appointments(
        &mut self,
        crowd: &Crowd,
        mine: &Reach,
        now: SimTime,
        may_touch: impl Fn(AgentId) -> bool,
    ) -> usize {
        let (mut looks, dt, everybody) = (0, self.dt, self.everybody);
        self.listed.retain_mut(|other| {
            let is_new = other.at == SimTime::ZERO;
            if other.at <= now {
                looks += 1;
                (other.at, other.near) = appointment(mine, crowd.seen(other.id), other.near, (now, dt));
            }
            (other.near || other.at < everybody) && (!is_new || may_touch(other.id))
        });
        looks
    }

    /// Looks at everybody, and lists those whose appointments come first.
    fn survey(
        &mut self,
        crowd: &Crowd,
        mine: &Reach,
        now: SimTime,
        (fellows, may_touch): (&Fellows, impl Fn(AgentId) -> bool),
    ) -> usize {
        let (mut room, mut looks) = (2 * LISTED, 0);
        self.everybody = NEVER;
        self.listed.clear();
        let me = self.me;
        for (id, berth) in (0..).map(AgentId).zip(&crowd.berths).filter(|(id, _)| *id != me && !fellows.has(*id)) {
            let seen = berth.read();
            looks += 1;
            if is_far(mine, &seen, self.everybody, (now, self.dt)) {
                continue;
            }
            let was_near = self.near.binary_search(&id).is_ok();
            let (at, near) = appointment(mine, seen, was_near, (now, self.dt));
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

    /// Leaves all but the first appointments, and those who are near, to the common one; says at how many to do so again.
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

    /// Makes new appointments with those who have become faster than they had said.
    fn read_notes(&mut self, crowd: &Crowd, fellows: &Fellows) {
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

/// Whether the appointment with one who is `seen` would not be before `everybody`, nor he near: told without a root or a
/// quotient, as most of a crowd is far from anyone. What it cannot tell so it denies.
fn is_far(mine: &Reach, seen: &Seen, everybody: SimTime, (now, dt): (SimTime, SimSpan)) -> bool {
    let Seen::There(theirs) = seen else { return false };
    if everybody == NEVER {
        return false;
    }
    let dt_s = dt.as_secs_f64();
    // the common appointment, with the steps before it in which one is near already
    let until_s = (everybody.secs_after(now) + NEAR_STEPS * dt_s).max(FAR_STEPS * dt_s);
    let way_m = until_s * (mine.speed_m_s + theirs.speed_m_s);
    let least_m = FAR_ROOM * (way_m + SKIN_M + drift_m(theirs, now) + 0.5 * ACCELERATION_M_S2 * dt_s * dt_s);
    mine.gap_vector(theirs).length_squared() > least_m * least_m
}

/// When one who is `seen` is looked at again, and whether he is near now, before a step of `dt` from `now`.
fn appointment(mine: &Reach, seen: Seen, was_near: bool, (now, dt): (SimTime, SimSpan)) -> (SimTime, bool) {
    let next_turn = now + SimSpan::from_nanos(1);
    let theirs = match seen {
        // a note tells when he comes
        Seen::Nowhere => return (NEVER, false),
        Seen::Unsure => return (next_turn, true),
        Seen::There(reach) => reach,
    };
    let dt_s = dt.as_secs_f64();
    // one's own matter is where it was last said to be, however long that was ago: time dropped or slept moves nothing
    let slack_m = mine.gap_m(&theirs) - SKIN_M - drift_m(&theirs, now) - 0.5 * ACCELERATION_M_S2 * dt_s * dt_s;
    let until_s = slack_m / (mine.speed_m_s + theirs.speed_m_s);
    let near = until_s <= dt_s * if was_near { FAR_STEPS } else { NEAR_STEPS };
    let at = SimSpan::from_secs_f64(until_s - NEAR_STEPS * dt_s).map_or(NEVER, |span| now + span);
    (if near { next_turn } else { at.max(next_turn) }, near)
}

/// How far matter may have come from its box by `now`, metres; what rests stays.
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
