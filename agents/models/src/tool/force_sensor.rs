//! Forces on a tool: the impulses that peers gave it, as a force, and the part of them that moves the tool.
//!
//! In: the ledgers of the agents that touch it or are held by it. Out: a force, and the contact impulses for the drive ([`super::drive`]).
//! Never here: the path of the tool.
//!
//! Agents that the tool grasps or is linked to see it as driven; it takes their impulses without yielding.

use super::drive::ReceivedImpulses;
use glam::DVec3;
use metachron_contact::Exchange;
use metachron_contact::{Neighbour, StepContext};
use metachron_core::Impulse;
use metachron_core::{AgentId, SimTime, Snapshot};

/// The forces on one tool.
#[derive(Debug, Clone, Default)]
pub(super) struct ContactForces {
    exchange: Exchange,
    /// Every agent to which the tool is driven, by rising ids: agents that give nothing yet are read too, so that it is known since
    /// when their first impulses count.
    from: Vec<Source>,
    /// The agents that see the tool as driven, and the others (`touching`), during a reading.
    held: Vec<Neighbour>,
    touching: Vec<Neighbour>,
    /// The force of contact, newtons.
    pushed_n: DVec3,
    /// Whether only agents at rest push it.
    supports_sleepers: bool,
}

/// The force of one agent.
#[derive(Debug, Clone, Copy)]
struct Source {
    id: AgentId,
    /// Up to which time its ledger has been read.
    until: SimTime,
    /// Given since then, N·s.
    given: DVec3,
    force_n: DVec3,
    /// Whether it is still near.
    here: bool,
}

impl ContactForces {
    /// Reads the impulses given since the last reading, by the agents to which the tool `is_led` and by the others; returns those that the
    /// others give in a step of `dt` seconds.
    pub(super) fn read(
        &mut self,
        context: &StepContext<'_>,
        is_led: impl Fn(&Neighbour) -> bool,
        dt: f64,
    ) -> ReceivedImpulses {
        self.exchange.open(context);
        let [mut held, mut touching] = [&mut self.held, &mut self.touching].map(std::mem::take);
        for other in context.neighbours {
            if is_led(other) { held.push(other.clone()) } else { touching.push(other.clone()) }
        }
        self.hold(&StepContext { neighbours: &held, ..*context });
        let given = self.touch(&StepContext { neighbours: &touching, ..*context }, dt);
        held.clear();
        touching.clear();
        (self.held, self.touching) = (held, touching);
        given
    }

    /// Takes contact impulses, as forces that go on.
    fn touch(&mut self, context: &StepContext<'_>, dt: f64) -> ReceivedImpulses {
        let (mut given, mut awake) = (ReceivedImpulses::default(), false);
        self.exchange.follow(context, dt, |id, [sum, carried, lasting]| {
            given.sum += sum.linear;
            given.carried += carried.linear;
            given.lasting += lasting.linear;
            let rests = context.neighbours.iter().any(|other| other.id == id && other.snapshot.at_rest);
            awake |= !rests && lasting != Impulse::ZERO;
        });
        self.pushed_n = given.lasting / dt;
        self.supports_sleepers = !awake && given.lasting != DVec3::ZERO;
        given
    }

    /// Reads the impulses of the agents to which the tool is driven: a force is the mean over the giver's own time between two readings.
    fn hold(&mut self, context: &StepContext<'_>) {
        let Self { exchange, from, .. } = self;
        from.iter_mut().for_each(|f| (f.here, f.given) = (false, DVec3::ZERO));
        for other in context.neighbours {
            match from.binary_search_by_key(&other.id, |f| f.id) {
                Ok(at) => from[at].here = true,
                Err(at) => from.insert(at, Source::new(other, context.me)),
            }
        }
        from.retain(|f| f.here);
        // all of it, including impulses that are still to act: the mean is over all of the giver's time
        let newest = context.neighbours.iter().map(|other| other.snapshot.time).fold(context.time, SimTime::max);
        exchange.take(context, newest, |id, _, Impulse { linear, .. }, _| {
            if let Ok(at) = from.binary_search_by_key(&id, |f| f.id) {
                from[at].given += linear;
            }
        });
        for other in context.neighbours {
            let Ok(at) = from.binary_search_by_key(&other.id, |f| f.id) else { continue };
            let since_s = other.snapshot.time.secs_after(from[at].until);
            if since_s > 0.0 {
                (from[at].force_n, from[at].until) = (from[at].given / since_s, other.snapshot.time);
            }
        }
    }

    /// The magnitude of all forces on the tool, newtons.
    pub(super) fn force_n(&self) -> f64 {
        (self.from.iter().map(|f| f.force_n).sum::<DVec3>() + self.pushed_n).length()
    }

    /// Whether only agents at rest push it: they rest on it.
    pub(super) const fn is_supporting(&self) -> bool {
        self.supports_sleepers
    }

    /// Writes the ledgers of taken impulses.
    pub(super) fn write(&self, into: &mut Snapshot) {
        self.exchange.write(into);
    }
}

impl Source {
    /// An agent seen for the first time: the impulses it has already given count from the origin of the ledger page in use.
    fn new(other: &Neighbour, me: AgentId) -> Self {
        let account = other.snapshot.given.iter().find(|ledger| ledger.with == me);
        let since = account.and_then(|ledger| ledger.pages.last()).map(|page| page.origin);
        let until = since.map_or(other.snapshot.time, |since| since.min(other.snapshot.time));
        Self { id: other.id, until, given: DVec3::ZERO, force_n: DVec3::ZERO, here: true }
    }
}
