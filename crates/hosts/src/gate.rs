//! Which calls of which callers are let in.
//!
//! In: the name of a caller, the number of its call. Out: whether the call is let in, and counts of the refused. Never here:
//! bytes, the effect of a call.

use std::collections::HashMap;
use std::time::{Duration, Instant};

/// The most callers at a time.
pub const SESSIONS_MAX: usize = 64;
/// The most calls of a caller, and of all strangers together, in a second.
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
}

impl Refusals {
    /// All together.
    #[must_use]
    pub const fn total(&self) -> u64 {
        self.malformed + self.flooded + self.repeated + self.strangers
    }
}

/// The callers that are let in.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    callers: HashMap<String, Caller>,
    strangers: Window,
    pub refused: Refusals,
}

#[derive(Debug, Default)]
struct Caller {
    newest: u64,
    window: Window,
}

/// How many calls came in the second that began then.
#[derive(Debug, Default)]
struct Window {
    begun: Option<Instant>,
    calls: u32,
}

impl Window {
    fn admits(&mut self, now: Instant) -> bool {
        if self.begun.is_none_or(|begun| now.saturating_duration_since(begun) >= Duration::from_secs(1)) {
            (self.begun, self.calls) = (Some(now), 0);
        }
        self.calls = self.calls.saturating_add(1);
        self.calls <= CALLS_MAX
    }
}

impl Gate {
    /// Whether a caller may call again so soon; asked before its bytes are read.
    pub fn admits(&mut self, caller: &str, now: Instant) -> bool {
        let window = self.callers.get_mut(caller).map_or(&mut self.strangers, |caller| &mut caller.window);
        let admitted = window.admits(now);
        self.refused.flooded += u64::from(!admitted);
        admitted
    }

    /// Lets a caller in, whose first call has the number `sequence`.
    ///
    /// # Errors
    /// Why not.
    pub fn greet(&mut self, caller: &str, sequence: u64) -> Result<(), String> {
        if !self.callers.contains_key(caller) && self.callers.len() >= SESSIONS_MAX {
            self.refused.strangers += 1;
            return Err(format!("the host has {SESSIONS_MAX} callers already, and takes no more"));
        }
        let known = self.callers.entry(caller.to_owned()).or_default();
        if sequence <= known.newest {
            return Err(self.repeat());
        }
        known.newest = sequence;
        Ok(())
    }

    /// Takes the next call of a caller.
    ///
    /// # Errors
    /// Why not.
    pub fn pass(&mut self, caller: &str, sequence: u64, is_of_run: bool) -> Result<(), String> {
        let Some(known) = self.callers.get_mut(caller) else {
            self.refused.strangers += 1;
            return Err("a caller introduces itself first".to_owned());
        };
        if !is_of_run || sequence <= known.newest {
            return Err(self.repeat());
        }
        known.newest = sequence;
        Ok(())
    }

    fn repeat(&mut self) -> String {
        self.refused.repeated += 1;
        "the call is an old one, or for another run of the host".to_owned()
    }

    /// A caller has gone.
    pub fn leave(&mut self, caller: &str) {
        self.callers.remove(caller);
    }

    pub fn callers(&self) -> usize {
        self.callers.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caller_is_let_in_once_for_each_number_and_so_often_a_second() {
        let (mut gate, now) = (Gate::default(), Instant::now());
        assert!(gate.pass("a", 1, true).is_err());
        gate.greet("a", 1).unwrap();
        assert!(gate.pass("a", 1, true).is_err() && gate.pass("a", 2, false).is_err());
        gate.pass("a", 2, true).unwrap();
        assert_eq!((0..CALLS_MAX + 5).filter(|_| gate.admits("a", now)).count() as u32, CALLS_MAX);
        assert!(gate.admits("a", now + Duration::from_secs(1)));
        assert_eq!(gate.refused, Refusals { malformed: 0, flooded: 5, repeated: 2, strangers: 1 });
    }

    #[test]
    fn the_sixty_fifth_caller_waits_for_one_to_leave() {
        let mut gate = Gate::default();
        (0..SESSIONS_MAX).for_each(|caller| gate.greet(&caller.to_string(), 1).unwrap());
        assert!(gate.greet("one more", 1).is_err());
        gate.leave("7");
        gate.greet("one more", 1).unwrap();
    }
}
