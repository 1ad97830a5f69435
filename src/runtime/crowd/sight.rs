//! Whom one agent may touch next.
//!
//! In: the agent's own box and time, the crowd. Out: the others near enough, by rising numbers.
//! Each other has an appointment: the time before which the two cannot be near, from their distance and the speeds that are
//! said of them (the kinetic form of a Verlet list). Nobody is looked at before. Never here: why they are listed.

use super::berth::{Berth, Reach, Seen};
use super::{Crowd, SPEED_LEAST_M_S};
use metachron_agents::{AgentId, Bounds, SimSpan, SimTime};

/// What one agent knows of where the others are.
#[derive(Debug)]
pub(in super::super) struct Sight {
    me: AgentId,
    mine: Option<Reach>,
    /// The speed at the end of the step before, m/s: the way to the newest state may have begun with it.
    speed_before_m_s: f64,
    others: Vec<Other>,
    /// No appointment is earlier.
    soonest: SimTime,
    /// The first note of the log that has not been read.
    unread: u64,
    near: Vec<AgentId>,
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

/// An appointment that is never due: both stand still, apart.
const NEVER: SimTime = SimTime::from_nanos(u64::MAX);

impl Sight {
    /// The sight of `me`, who could touch `others`, by rising numbers.
    pub fn new(me: AgentId, others: impl Iterator<Item = AgentId>) -> Self {
        let others: Vec<_> = others.map(|id| Other { id, at: SimTime::ZERO, near: false }).collect();
        let near = Vec::with_capacity(others.len().min(16));
        Self { me, mine: None, speed_before_m_s: 0.0, others, soonest: SimTime::ZERO, unread: 0, near }
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
            self.look_at_all();
        }
    }

    /// Looks at those whose appointment has come, before a step of `dt` from `now`; says how many that were.
    pub fn look(&mut self, crowd: &Crowd, now: SimTime, dt: SimSpan) -> usize {
        self.read_notes(crowd);
        if self.soonest > now {
            return 0;
        }
        let Some(mine) = self.mine else { return 0 };
        let (mut looks, mut soonest) = (0, NEVER);
        for other in &mut self.others {
            if other.at <= now {
                looks += 1;
                let seen = crowd.berths.get(other.id.0 as usize).map_or(Seen::Nowhere, Berth::read);
                (other.at, other.near) = appointment(&mine, seen, other.near, (now, dt));
            }
            soonest = soonest.min(other.at);
        }
        self.soonest = soonest;
        self.near.clear();
        self.near.extend(self.others.iter().filter(|other| other.near).map(|other| other.id));
        looks
    }

    fn read_notes(&mut self, crowd: &Crowd) {
        let (others, soonest) = (&mut self.others, &mut self.soonest);
        let (next, whole) = crowd.notes(self.unread, |id| {
            if let Ok(at) = others.binary_search_by_key(&id, |other| other.id) {
                others[at].at = SimTime::ZERO;
                *soonest = SimTime::ZERO;
            }
        });
        self.unread = next;
        if whole.is_none() {
            self.look_at_all();
        }
    }

    fn look_at_all(&mut self) {
        self.others.iter_mut().for_each(|other| other.at = SimTime::ZERO);
        self.soonest = SimTime::ZERO;
    }
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
