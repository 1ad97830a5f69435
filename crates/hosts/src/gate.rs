//! Which calls of which callers are let in.
//!
//! In: the name of a caller, the number of its call. Out: whether the call is let in, and counts of the refused. Never here:
//! bytes, the effect of a call.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The places for callers, which the names of certificates that a host lets in share evenly, each having one at least; callers without certificates
/// are one holder.
pub const SESSIONS_MAX: usize = 64;
/// The most calls of a peer in a second: the holder of a certificate with all its sessions; a caller where there are no certificates, and all
/// strangers together.
pub const CALLS_MAX: u32 = 10_000;

/// How many messages were refused, by their faults.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Refusals {
    /// Bytes that mean nothing, of another version or too many, and numbers that cannot be.
    pub malformed: u64,
    /// Beyond [`CALLS_MAX`], or while too many calls waited.
    pub flooded: u64,
    /// Calls that were not newer than the one before, or for another run of the host.
    pub repeated: u64,
    /// Of callers that have not introduced themselves, whose program is another, or that have no place ([`SESSIONS_MAX`]).
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

/// The callers that live, each by its name and its session: `name/session`, first those that came first. Of each name the first have a place, and as
/// many more wait for one. A caller has its place for as long as its sign of life lasts.
#[derive(Debug)]
pub(crate) struct Gate {
    /// Whether names are those of certificates.
    is_certified: bool,
    /// The places of each name.
    share: usize,
    callers: Vec<Caller>,
    peers: BTreeMap<String, Peer>,
    pub refused: Refusals,
}

#[derive(Debug)]
struct Caller {
    name: String,
    /// The number of its newest call; 0 until it has introduced itself.
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
    /// For callers of so many names, which are those of certificates, or one for all.
    pub fn new(is_certified: bool, names: usize) -> Self {
        let (callers, peers, share) = (Vec::new(), BTreeMap::new(), (SESSIONS_MAX / names.max(1)).max(1));
        Self { is_certified, share, callers, peers, refused: Refusals::default() }
    }

    /// The name of the peer that a caller is of: there are no more of them than names of certificates, or callers.
    pub fn peer_of<'a>(&self, caller: &'a str) -> &'a str {
        match caller.split_once('/') {
            Some((name, _)) if self.is_certified => name,
            _ if self.callers.iter().any(|one| one.name == caller) => caller,
            _ => STRANGERS,
        }
    }

    fn peer(&mut self, caller: &str) -> &mut Peer {
        let peer = self.peer_of(caller).to_owned();
        self.peers.entry(peer).or_default()
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

    /// A caller shows a sign of life, and has a place if one of its name is left, or waits for one.
    pub fn arrive(&mut self, caller: &str) {
        if self.living(caller) < 2 * self.share && self.callers.iter().all(|one| one.name != caller) {
            self.callers.push(Caller { name: caller.to_owned(), newest: 0, is_looking: false });
        }
    }

    /// How many callers of the holder of a caller's name have a place or wait for one.
    fn living(&self, caller: &str) -> usize {
        self.callers.iter().filter(|one| holder(&one.name) == holder(caller)).count()
    }

    /// A caller that has a place.
    fn placed(&mut self, caller: &str) -> Option<&mut Caller> {
        let of_name = self.callers.iter_mut().filter(|one| holder(&one.name) == holder(caller));
        of_name.take(self.share).find(|one| one.name == caller)
    }

    /// Lets a caller in that has a place, whose first call has the number `sequence`.
    ///
    /// # Errors
    /// Why not.
    pub fn greet(&mut self, caller: &str, sequence: u64, is_looking: bool) -> Result<(), String> {
        let Some(known) = self.placed(caller) else {
            self.refuse(caller, Fault::Stranger);
            return Err(if self.living(caller) < self.share {
                "a caller shows a sign of life before it introduces itself".to_owned()
            } else {
                format!("the host has {} callers of \"{}\" already, and takes no more", self.share, holder(caller))
            });
        };
        if sequence <= known.newest {
            return Err(self.repeat(caller));
        }
        (known.newest, known.is_looking) = (sequence, is_looking);
        Ok(())
    }

    /// Takes the next call of a caller.
    ///
    /// # Errors
    /// Why not.
    pub fn pass(&mut self, caller: &str, sequence: u64, is_of_run: bool) -> Result<(), String> {
        let Some(known) = self.placed(caller).filter(|known| known.newest > 0) else {
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

    /// A caller has gone, and the first of its name that waits has its place. What was refused of it and not yet said is said of strangers.
    pub fn leave(&mut self, caller: &str) {
        self.callers.retain(|one| one.name != caller);
        let Some(mut left) = self.peers.remove(caller) else { return };
        let strangers = &mut self.peers.entry(STRANGERS.to_owned()).or_default().refused;
        for fault in [Fault::Malformed, Fault::Flooded, Fault::Repeated, Fault::Stranger, Fault::Forbidden] {
            *strangers.of(fault) += *left.refused.of(fault);
        }
    }

    /// The callers that have introduced themselves.
    pub fn callers(&self) -> Callers {
        let known = self.callers.iter().filter(|caller| caller.newest > 0);
        let looking = known.clone().filter(|caller| caller.is_looking).count();
        Callers { whole: known.count() - looking, looking }
    }
}

/// The holder of the certificate by which a caller is known.
fn holder(caller: &str) -> &str {
    caller.split_once('/').map_or(caller, |(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caller_is_let_in_once_for_each_number_and_so_often_a_second() {
        let (mut gate, now) = (Gate::new(false, 1), Instant::now());
        assert!(gate.pass("any/a", 1, true).is_err());
        gate.arrive("any/a");
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
        let (mut gate, now) = (Gate::new(true, 2), Instant::now());
        let sessions: Vec<_> = (0..5).map(|session| format!("bob/{session}")).collect();
        sessions.iter().for_each(|session| gate.arrive(session));
        let calls = sessions.iter().cycle().take(2 * CALLS_MAX as usize);
        assert_eq!(calls.filter(|session| gate.admits(session, now)).count() as u32, CALLS_MAX);
        assert!(gate.admits("eve/0", now), "another holder has its own");
        assert_eq!(gate.take_refused().len(), 1);
    }

    #[test]
    fn a_caller_beyond_the_share_of_its_name_waits_for_one_of_it_to_leave() {
        let mut gate = Gate::new(true, 2);
        (0..100).for_each(|session| gate.arrive(&format!("eye/{session}")));
        let full = gate.greet("eye/99", 1, true).unwrap_err();
        assert!(full.contains("32 callers of \"eye\""), "{full}");
        let unseen = gate.greet("op/0", 1, false).unwrap_err();
        assert!(unseen.contains("sign of life"), "{unseen}");
        gate.arrive("op/0");
        gate.greet("op/0", 1, false).unwrap();
        gate.leave("eye/7");
        assert!(gate.greet("eye/33", 1, true).is_err(), "another one came before it");
        gate.greet("eye/32", 1, true).unwrap();
        assert_eq!((gate.callers(), gate.refused.strangers), (Callers { whole: 1, looking: 1 }, 3));
        // those that have gone wait no more, and a place of another name is none of theirs
        gate.leave("eye/33");
        gate.leave("op/0");
        assert!(gate.greet("eye/34", 1, true).is_err());
        gate.leave("eye/32");
        gate.greet("eye/34", 1, true).unwrap();
    }

    #[test]
    fn a_caller_that_shows_its_sign_of_life_again_takes_no_more_than_its_place() {
        let mut gate = Gate::new(true, SESSIONS_MAX);
        (0..3).for_each(|_| gate.arrive("eye/0"));
        gate.leave("eye/0");
        assert!(gate.callers.is_empty());
    }

    #[test]
    fn a_caller_that_never_introduces_itself_is_none() {
        let mut gate = Gate::new(false, 1);
        gate.arrive("any/a");
        assert!(gate.pass("any/a", 1, true).is_err());
        assert_eq!(gate.callers(), Callers { whole: 0, looking: 0 });
    }
}
