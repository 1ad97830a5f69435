//! Which calls of which callers are let in.
//!
//! In: the name of a caller, the number of its call. Out: whether the call is let in, and counts of the refused. Never here:
//! bytes, the effect of a call.

use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};

/// The most callers at a time.
pub const SESSIONS_MAX: usize = 64;
/// The most calls of a peer in a second: the holder of a certificate with all its sessions; a caller where there are no certificates, and all
/// strangers together.
pub const CALLS_MAX: u32 = 10_000;

/// How many messages were refused, by their faults.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Refusals {
    /// Bytes that mean nothing, of another version or too many, and numbers that cannot be.
    pub malformed: u64,
    /// Beyond [`CALLS_MAX`], or while too many calls waited.
    pub flooded: u64,
    /// Calls that were not newer than the one before, or for another run of the host.
    pub repeated: u64,
    /// Of callers that have not introduced themselves, whose program is another, or beyond [`SESSIONS_MAX`].
    pub strangers: u64,
    /// Commands of callers that may only read.
    pub forbidden: u64,
}

impl Refusals {
    /// All together.
    #[must_use]
    pub const fn total(&self) -> u64 {
        self.malformed + self.flooded + self.repeated + self.strangers + self.forbidden
    }

    fn of(&mut self, fault: Fault) -> &mut u64 {
        match fault {
            Fault::Malformed => &mut self.malformed,
            Fault::Flooded => &mut self.flooded,
            Fault::Repeated => &mut self.repeated,
            Fault::Stranger => &mut self.strangers,
            Fault::Forbidden => &mut self.forbidden,
        }
    }
}

/// Why a message is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    Malformed,
    Flooded,
    Repeated,
    Stranger,
    Forbidden,
}

/// The callers that are let in, each by its name and its session: `name/session`.
#[derive(Debug)]
pub(crate) struct Gate {
    /// Whether names are those of certificates.
    is_certified: bool,
    callers: HashMap<String, Caller>,
    peers: BTreeMap<String, Peer>,
    pub refused: Refusals,
}

#[derive(Debug)]
struct Caller {
    /// The number of its newest call.
    newest: u64,
    is_looking: bool,
}

/// How many callers there are, by the states that they are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Callers {
    /// Callers that are sent whole states.
    pub whole: usize,
    /// Callers that only look.
    pub looking: usize,
}

/// The calls of a peer in the second that began then, and its messages that were refused since that was last said.
#[derive(Debug, Default)]
struct Peer {
    begun: Option<Instant>,
    calls: u32,
    refused: Refusals,
}

impl Peer {
    fn admits(&mut self, now: Instant) -> bool {
        if self.begun.is_none_or(|begun| now.saturating_duration_since(begun) >= Duration::from_secs(1)) {
            (self.begun, self.calls) = (Some(now), 0);
        }
        self.calls = self.calls.saturating_add(1);
        self.calls <= CALLS_MAX
    }
}

/// All callers that no other peer is.
const STRANGERS: &str = "strangers";

impl Gate {
    pub fn new(is_certified: bool) -> Self {
        let (callers, peers) = (HashMap::new(), BTreeMap::new());
        Self { is_certified, callers, peers, refused: Refusals::default() }
    }

    /// The peer that a caller is of: there are no more of them than names of certificates, or callers.
    fn peer(&mut self, caller: &str) -> &mut Peer {
        let peer = match caller.split_once('/') {
            Some((name, _)) if self.is_certified => name,
            _ if self.callers.contains_key(caller) => caller,
            _ => STRANGERS,
        };
        self.peers.entry(peer.to_owned()).or_default()
    }

    /// Counts a message of a caller that was refused.
    pub fn refuse(&mut self, caller: &str, fault: Fault) {
        *self.refused.of(fault) += 1;
        *self.peer(caller).refused.of(fault) += 1;
    }

    /// The peers of which messages were refused since the last call of this, and how many.
    pub fn take_refused(&mut self) -> Vec<(String, Refusals)> {
        let refused = self.peers.iter_mut().map(|(name, peer)| (name.clone(), std::mem::take(&mut peer.refused)));
        refused.filter(|(_, refused)| refused.total() > 0).collect()
    }

    /// Whether a caller may call again so soon; asked before its bytes are read.
    pub fn admits(&mut self, caller: &str, now: Instant) -> bool {
        let admitted = self.peer(caller).admits(now);
        if !admitted {
            self.refuse(caller, Fault::Flooded);
        }
        admitted
    }

    /// Lets a caller in, whose first call has the number `sequence`.
    ///
    /// # Errors
    /// Why not.
    pub fn greet(&mut self, caller: &str, sequence: u64, is_looking: bool) -> Result<(), String> {
        if !self.callers.contains_key(caller) && self.callers.len() >= SESSIONS_MAX {
            self.refuse(caller, Fault::Stranger);
            return Err(format!("the host has {SESSIONS_MAX} callers already, and takes no more"));
        }
        if self.callers.get(caller).is_some_and(|known| sequence <= known.newest) || sequence == 0 {
            return Err(self.repeat(caller));
        }
        self.callers.insert(caller.to_owned(), Caller { newest: sequence, is_looking });
        Ok(())
    }

    /// Takes the next call of a caller.
    ///
    /// # Errors
    /// Why not.
    pub fn pass(&mut self, caller: &str, sequence: u64, is_of_run: bool) -> Result<(), String> {
        let Some(known) = self.callers.get_mut(caller) else {
            self.refuse(caller, Fault::Stranger);
            return Err("a caller introduces itself first".to_owned());
        };
        if !is_of_run || sequence <= known.newest {
            return Err(self.repeat(caller));
        }
        known.newest = sequence;
        Ok(())
    }

    fn repeat(&mut self, caller: &str) -> String {
        self.refuse(caller, Fault::Repeated);
        "the call is an old one, or for another run of the host".to_owned()
    }

    /// A caller has gone. What was refused of it and not yet said is said of strangers.
    pub fn leave(&mut self, caller: &str) {
        self.callers.remove(caller);
        let Some(mut left) = self.peers.remove(caller) else { return };
        let strangers = &mut self.peers.entry(STRANGERS.to_owned()).or_default().refused;
        for fault in [Fault::Malformed, Fault::Flooded, Fault::Repeated, Fault::Stranger, Fault::Forbidden] {
            *strangers.of(fault) += *left.refused.of(fault);
        }
    }

    pub fn callers(&self) -> Callers {
        let looking = self.callers.values().filter(|caller| caller.is_looking).count();
        Callers { whole: self.callers.len() - looking, looking }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caller_is_let_in_once_for_each_number_and_so_often_a_second() {
        let (mut gate, now) = (Gate::new(false), Instant::now());
        assert!(gate.pass("any/a", 1, true).is_err());
        gate.greet("any/a", 1, false).unwrap();
        assert!(gate.pass("any/a", 1, true).is_err() && gate.pass("any/a", 2, false).is_err());
        gate.pass("any/a", 2, true).unwrap();
        assert_eq!((0..CALLS_MAX + 5).filter(|_| gate.admits("any/a", now)).count() as u32, CALLS_MAX);
        assert!(gate.admits("any/a", now + Duration::from_secs(1)));
        assert_eq!(gate.refused, Refusals { flooded: 5, repeated: 2, strangers: 1, ..Refusals::default() });
        let said: Vec<_> = gate.take_refused().into_iter().map(|(peer, refused)| (peer, refused.total())).collect();
        assert_eq!(said, [("any/a".to_owned(), 7), (STRANGERS.to_owned(), 1)]);
        assert!(gate.take_refused().is_empty());
    }

    #[test]
    fn the_sessions_of_a_certificate_share_its_calls() {
        let (mut gate, now) = (Gate::new(true), Instant::now());
        let sessions: Vec<_> = (0..5).map(|session| format!("bob/{session}")).collect();
        sessions.iter().for_each(|session| gate.greet(session, 1, false).unwrap());
        let calls = sessions.iter().cycle().take(2 * CALLS_MAX as usize);
        assert_eq!(calls.filter(|session| gate.admits(session, now)).count() as u32, CALLS_MAX);
        assert!(gate.admits("eve/0", now), "another holder has its own");
        assert_eq!(gate.take_refused().len(), 1);
    }

    #[test]
    fn the_sixty_fifth_caller_waits_for_one_to_leave() {
        let mut gate = Gate::new(false);
        (0..SESSIONS_MAX).for_each(|caller| gate.greet(&caller.to_string(), 1, false).unwrap());
        assert!(gate.greet("one more", 1, false).is_err());
        gate.leave("7");
        gate.greet("one more", 1, false).unwrap();
    }
}
