//! What a tool feels: the impulses that others gave it, as a force.
//!
//! In: the ledgers of those who touch it or are held by it. Out: a force. Never here: where the tool goes; nothing moves it.

use crate::coupling::{Exchange, Impulse};
use crate::{AgentId, SimTime, Snapshot, Surroundings};
use glam::DVec3;

/// The forces on one tool.
#[derive(Debug, Clone, Default)]
pub(super) struct Felt {
    exchange: Exchange,
    from: Vec<From>,
}

/// The force of one agent.
#[derive(Debug, Clone, Copy)]
struct From {
    id: AgentId,
    /// How far its account has been read.
    until: SimTime,
    /// Given since then, N·s.
    given: DVec3,
    force_n: DVec3,
    /// Whether it is still near.
    here: bool,
}

impl Felt {
    /// Reads what was given since the last reading: a force is the mean over the giver's own time between two readings.
    pub(super) fn read(&mut self, around: &Surroundings<'_>) {
        let Self { exchange, from, .. } = self;
        from.iter_mut().for_each(|f| (f.here, f.given) = (false, DVec3::ZERO));
        exchange.open(around);
        for other in around.neighbours {
            match from.iter_mut().find(|f| f.id == other.id) {
                Some(known) => known.here = true,
                None if other.snapshot.given.iter().any(|ledger| ledger.with == around.me) => {
                    let until = around.time.min(other.snapshot.time);
                    from.push(From { id: other.id, until, given: DVec3::ZERO, force_n: DVec3::ZERO, here: true });
                }
                None => {}
            }
        }
        from.retain(|f| f.here);
        // all of it, what is still to act too: the mean is over all of the giver's time
        let newest = around.neighbours.iter().map(|other| other.snapshot.time).fold(around.time, SimTime::max);
        exchange.take(around, newest, |id, _, Impulse { linear, .. }, _| {
            from.iter_mut().filter(|f| f.id == id).for_each(|f| f.given += linear);
        });
        for other in around.neighbours {
            let Some(known) = from.iter_mut().find(|f| f.id == other.id) else { continue };
            let since_s = other.snapshot.time.secs_after(known.until);
            if since_s > 0.0 {
                (known.force_n, known.until) = (known.given / since_s, other.snapshot.time);
            }
        }
    }

    /// The magnitude of all forces on the tool, newtons.
    pub(super) fn force_n(&self) -> f64 {
        self.from.iter().map(|f| f.force_n).sum::<DVec3>().length()
    }

    /// Writes what was taken.
    pub(super) fn write(&self, into: &mut Snapshot) {
        self.exchange.write(into);
    }
}
