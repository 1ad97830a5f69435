//! The turns of an agent, for readers: when it stepped, how far, and when it waited.
//!
//! In: turns, from the thread that makes them. Out: the same to each reader ([`crate::lock_free::ring`]). Never here: statistics ([`super::metrics`]).

use crate::lock_free::ring::{RingEntry, WORDS};
use metachron_core::{AgentId, SimSpan, SimTime};
use std::time::Duration;

/// How many turns of one agent are kept for readers.
pub const TURNS_KEPT: usize = 256;

/// A turn of an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Wall time at which it began; virtual in lockstep.
    pub begun: Duration,
    /// Wall time at which it ended.
    pub ended: Duration,
    /// The agent's own time at its end.
    pub time: SimTime,
    /// Its step; zero of a turn in which it only waited for others that are behind.
    pub dt: SimSpan,
    /// The spacing ε that it was simulated at, metres; `None` of a model that has none.
    pub eps_m: Option<f64>,
    /// The agent whose turn it was, which leads the cluster.
    pub led_by: AgentId,
    /// How late it began, wall time.
    pub late: Duration,
    /// The simulated time that was given up before it, because it began too late.
    pub dropped: SimSpan,
}

impl RingEntry for Turn {
    const KEPT: usize = TURNS_KEPT;

    fn words(&self) -> [u64; WORDS] {
        let nanos = |time: Duration| time.as_nanos() as u64;
        [
            nanos(self.begun),
            nanos(self.ended),
            self.time.as_nanos(),
            self.dt.as_nanos(),
            u64::from(self.eps_m.is_some()),
            self.eps_m.unwrap_or_default().to_bits(),
            self.led_by.0.into(),
            nanos(self.late),
            self.dropped.as_nanos(),
            0,
            0,
        ]
    }

    fn of_words(words: &[u64; WORDS]) -> Option<Self> {
        let [begun, ended, time, dt, has_eps, eps_m, led_by, late, dropped, ..] = *words;
        Some(Self {
            begun: Duration::from_nanos(begun),
            ended: Duration::from_nanos(ended),
            time: SimTime::from_nanos(time),
            dt: SimSpan::from_nanos(dt),
            eps_m: (has_eps == 1).then(|| f64::from_bits(eps_m)),
            led_by: AgentId(u32::try_from(led_by).ok()?),
            late: Duration::from_nanos(late),
            dropped: SimSpan::from_nanos(dropped),
        })
    }
}

/// The wall time that a turn took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Took {
    pub begun: Duration,
    pub ended: Duration,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_comes_out_as_it_went_in() {
        let ms = Duration::from_millis;
        let turn = Turn {
            begun: ms(5),
            ended: ms(7),
            time: SimTime::from_nanos(11),
            dt: SimSpan::from_nanos(3),
            eps_m: Some(0.25),
            led_by: AgentId(u32::MAX),
            late: ms(1),
            dropped: SimSpan::from_nanos(2),
        };
        for turn in [turn, Turn { eps_m: None, ..turn }] {
            assert_eq!(Turn::of_words(&turn.words()), Some(turn));
        }
    }
}
