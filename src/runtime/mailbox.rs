//! What others tell an agent: the newest demand of each kind, taken at its next turn.
//!
//! In: [`Command`]s from any thread. Out: the newest of each kind, once. Storage is bounded by construction: a kind has one
//! place, a newer command takes it. Never here: what an agent does with them ([`super::turn`] does).

use crossbeam::queue::ArrayQueue;
use metachron_agents::{AgentId, Anchor, Pull, Resolution, SimSpan};

/// What an agent can be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Simulate at this resolution; clamped to the agent's range.
    Retune(Resolution),
    /// Step by this span; clamped to the agent's range.
    SetDt(SimSpan),
    /// The user's hand pulls at the agent until told otherwise; `None` lets go.
    Hand(Option<Pull>),
    /// Stop resting.
    Wake,
}

/// Why a command was not delivered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// There is no such agent.
    #[error("there is no agent {} in this run", .0.0)]
    NoAgent(AgentId),
    /// The command holds a number that is not finite, or a negative stiffness or damping.
    #[error("refused {0:?}: every number must be finite, stiffness and damping not negative")]
    BadNumber(Command),
}

/// The newest command of each kind, waiting for one agent.
#[derive(Debug)]
pub(super) struct Mailbox {
    retune: ArrayQueue<Resolution>,
    dt: ArrayQueue<SimSpan>,
    hand: ArrayQueue<Option<Pull>>,
}

impl Mailbox {
    pub fn new() -> Self {
        Self { retune: ArrayQueue::new(1), dt: ArrayQueue::new(1), hand: ArrayQueue::new(1) }
    }

    /// Puts `command` in the place of its kind.
    ///
    /// # Errors
    /// [`SendError::BadNumber`]; nothing is delivered then.
    pub fn post(&self, command: Command) -> Result<(), SendError> {
        if !is_sound(&command) {
            return Err(SendError::BadNumber(command));
        }
        match command {
            Command::Retune(resolution) => drop(self.retune.force_push(resolution)),
            Command::SetDt(dt) => drop(self.dt.force_push(dt)),
            Command::Hand(pull) => drop(self.hand.force_push(pull)),
            Command::Wake => {}
        }
        Ok(())
    }

    /// The newest resolution asked for since the last call.
    pub fn take_retune(&self) -> Option<Resolution> {
        self.retune.pop()
    }

    /// The newest step length asked for since the last call.
    pub fn take_dt(&self) -> Option<SimSpan> {
        self.dt.pop()
    }

    /// What the hand did last since the last call.
    pub fn take_hand(&self) -> Option<Option<Pull>> {
        self.hand.pop()
    }
}

fn is_sound(command: &Command) -> bool {
    match command {
        Command::Retune(wanted) => wanted.eps_m.is_finite(),
        Command::SetDt(_) | Command::Hand(None) | Command::Wake => true,
        Command::Hand(Some(pull)) => {
            let anchor = match pull.anchor {
                Anchor::Arc(arc_m) => arc_m.is_finite(),
                Anchor::Local(point) => point.is_finite(),
                Anchor::Vertex(_) => true,
            };
            let springs = [pull.stiffness_n_m, pull.damping_n_s_m];
            anchor
                && pull.target.is_finite()
                && pull.target_velocity.is_finite()
                && springs.iter().all(|k| k.is_finite() && *k >= 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn pull(target: DVec3) -> Pull {
        let anchor = Anchor::Local(DVec3::ZERO);
        Pull { by: None, anchor, target, target_velocity: DVec3::ZERO, stiffness_n_m: 1.0, damping_n_s_m: 0.0 }
    }

    #[test]
    fn the_newest_command_of_a_kind_takes_the_place_of_the_older() {
        let mail = Mailbox::new();
        for eps_m in [0.1, 0.2, 0.3] {
            mail.post(Command::Retune(Resolution { eps_m, n: 1 })).unwrap();
        }
        mail.post(Command::SetDt(SimSpan::from_nanos(5))).unwrap();
        assert_eq!(mail.take_retune().unwrap().eps_m, 0.3);
        assert_eq!(mail.take_retune(), None);
        assert_eq!(mail.take_dt(), Some(SimSpan::from_nanos(5)));
    }

    #[test]
    fn letting_go_is_a_command_too() {
        let mail = Mailbox::new();
        mail.post(Command::Hand(Some(pull(DVec3::X)))).unwrap();
        mail.post(Command::Hand(None)).unwrap();
        assert_eq!(mail.take_hand(), Some(None));
        assert_eq!(mail.take_hand(), None);
    }

    #[test]
    fn a_pull_that_is_not_finite_is_refused_at_the_door() {
        let mail = Mailbox::new();
        let bad = Command::Hand(Some(pull(DVec3::NAN)));
        assert!(matches!(mail.post(bad), Err(SendError::BadNumber(_))));
        let negative = Pull { stiffness_n_m: -1.0, ..pull(DVec3::X) };
        assert!(mail.post(Command::Hand(Some(negative))).is_err());
        assert!(mail.post(Command::Retune(Resolution { eps_m: f64::NAN, n: 0 })).is_err());
        assert_eq!(mail.take_hand(), None);
    }
}
