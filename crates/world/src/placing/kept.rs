//! States of all objects that are kept, and gone back to.
//!
//! In: the hosts of a placed world, why an act was not done. Out: packed states; all hosts in them again; what takes all states at once: objects that
//! join, checkpoints. Never here: how time passes.

use super::divided::DividedCalls;
use super::groups::groups;
use super::placed_world::PlacedWorld;
use super::windows::{Fault, Owner, Placing, RATE_JOINED_HZ};
use crate::Part;
use crate::error::WorldError;
use crate::history::checkpoint::{Checkpoint, CheckpointError};
use crate::reading::object::Object;
use metachron_core::{AgentId, SimSpan, SimTime};
use metachron_runtime::{Reach, SystemClock, wait_until};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// States are kept so often: that much is done again where a host falls silent, or an object leaves its box. More seldom where it takes more than
/// one part in so many of the time.
const KEEP_EVERY: SimSpan = SimSpan::from_millis(500);
const KEEP_SHARE: u32 = 20;

/// So many objects are packed at first, and the rest of their group; then as many as take about so many bytes: a message has its bound.
const PACKED_AT_FIRST: usize = 256;
const PACKED_BYTES: usize = 2 << 20;

/// Where no host answers, one that does is waited for so long, and looked for so often.
const BACK_WITHIN: Duration = Duration::from_secs(5);
const BACK_EVERY: Duration = Duration::from_millis(20);

/// The room for more speed rises so each time that an object has left its box.
const ROOM_RISES: f64 = 2.0;

/// Calls hosts on which nothing is placed yet, and calls them again for 5 s where one is silent.
pub(super) fn patient<T>(mut call: impl FnMut() -> Result<T, WorldError>) -> Result<T, WorldError> {
    let begun = Instant::now();
    loop {
        match call() {
            Err(WorldError::Silent { .. }) if begun.elapsed() < BACK_WITHIN => {
                wait_until(&SystemClock::new(), BACK_EVERY);
            }
            answer => return answer,
        }
    }
}

/// States of all objects at one moment.
#[derive(Default)]
pub(super) struct Kept {
    time: SimTime,
    /// The moment, without objects.
    moment: Vec<u8>,
    packs: Vec<Pack>,
    /// When they were kept, and how long that took.
    at: Option<Instant>,
    took: Duration,
}

impl Kept {
    /// Whether states of `time` are to be kept in their place.
    pub fn is_old(&self, time: SimTime) -> bool {
        time >= self.time + KEEP_EVERY && self.at.is_none_or(|at| at.elapsed() >= KEEP_SHARE * self.took)
    }
}

/// Objects that one host has packed.
pub(super) struct Pack {
    host: usize,
    pub objects: Vec<AgentId>,
    pub bytes: Vec<u8>,
}

impl PlacedWorld {
    /// Groups of objects as a host packs them.
    pub(super) fn pack(&self, host: usize, groups: &[Vec<AgentId>]) -> Result<Vec<Pack>, Fault> {
        let (mut packs, mut at_once, mut left) = (Vec::new(), PACKED_AT_FIRST, groups);
        while !left.is_empty() {
            let mut objects: Vec<AgentId> = Vec::new();
            let taken = left.iter().take_while(|group| {
                let is_taken = objects.len() < at_once;
                objects.extend(group.iter().filter(|_| is_taken));
                is_taken
            });
            let taken = taken.count();
            objects.sort_unstable();
            match self.part(host, |divided| divided.pack(&objects))? {
                Some(bytes) => {
                    // others may be larger
                    let by_bytes = PACKED_BYTES * objects.len() / bytes.len().max(1);
                    at_once = by_bytes.clamp(1, 4 * objects.len());
                    packs.push(Pack { host, objects, bytes });
                    left = &left[taken..];
                }
                None if taken > 1 => at_once = (at_once.min(objects.len()) / 2).max(1),
                None => {
                    let reason =
                        format!("{} objects belong together that are more than a message holds", objects.len());
                    return Err(Fault::Refused(WorldError::Undivided { reason }));
                }
            }
        }
        Ok(packs)
    }

    /// Keeps the states of all objects, or does again what was done since the last ones and keeps those then.
    pub(super) fn keep_or_go_back(&self, placing: &mut Placing) -> Result<(), WorldError> {
        loop {
            match self.keep(placing) {
                Ok(()) => return Ok(()),
                Err(Fault::Refused(error)) => return Err(error),
                Err(fault) => {
                    self.go_back(placing, fault)?;
                    for act in std::mem::take(&mut placing.since) {
                        self.act(placing, act)?;
                    }
                }
            }
        }
    }

    /// Takes hosts into service again that were lost and answer, at the `moment` now: their objects live elsewhere. One that has missed an object
    /// that joined stays lost.
    fn take_back(&self, placing: &mut Placing, moment: &[u8]) {
        let objects = placing.objects();
        for (host, placed) in self.hosts.iter().enumerate() {
            let is_back = placing.seen.lost[host].is_some() && placed.world.answers().is_ok();
            let knows_all = || objects.iter().all(|id| placed.world.object_of(*id).is_ok());
            let rejoin = |divided: &dyn DividedCalls| divided.release(&objects).and_then(|()| divided.adopt(moment));
            if is_back && knows_all() && self.part(host, rejoin).is_ok() {
                placing.seen.lost[host] = None;
            }
        }
    }

    fn keep(&self, placing: &mut Placing) -> Result<(), Fault> {
        let (first, begun) = (*placing.living().first().ok_or_else(|| Fault::Refused(self.silent()))?, Instant::now());
        let moment = self.part(first, |divided| divided.pack(&[]))?.unwrap_or_default();
        self.take_back(placing, &moment);
        let living = placing.living();
        let mut kept = Kept { time: placing.seen.time, moment, ..Kept::default() };
        // where there is one host they could not go on without it; of several a lost one may come back
        if self.hosts.len() > 1 {
            let reaches: Vec<Reach> = placing.reaches.iter().flatten().copied().collect();
            let groups = groups(&placing.objects(), &reaches, &self.ties_of(placing));
            for host in living {
                let is_own = |group: &&Vec<AgentId>| group.iter().all(|id| placing.seen.owners[id].host == host);
                let own: Vec<_> = groups.iter().filter(is_own).cloned().collect();
                kept.packs.extend(self.pack(host, &own)?);
            }
        }
        (kept.at, kept.took) = (Some(Instant::now()), begun.elapsed());
        (placing.kept, placing.since, placing.evens) = (kept, Vec::new(), true);
        Ok(())
    }

    /// Puts all hosts that live back to the states that were kept; a host that has fallen silent is none of them any more.
    pub(super) fn go_back(&self, placing: &mut Placing, fault: Fault) -> Result<(), WorldError> {
        let (mut fault, mut lost) = (Some(fault), None);
        while let Some(why) = fault.take() {
            match why {
                Fault::Refused(error) => return Err(error),
                Fault::Escaped => {
                    placing.seen.escapes += 1;
                    placing.room *= ROOM_RISES;
                    placing.escaped = placing.seen.time;
                }
                Fault::Lost(host, error) => {
                    placing.seen.lost[host] = Some(error.to_string());
                    lost = Some(error);
                }
            }
            let has_states = !placing.kept.packs.is_empty() || placing.seen.owners.is_empty();
            if !has_states || !self.await_any(placing) {
                self.show(&placing.seen);
                return Err(lost.filter(|_| !placing.living().is_empty()).unwrap_or_else(|| self.silent()));
            }
            fault = self.try_back(placing).err();
        }
        Ok(())
    }

    /// Waits for a host that answers where none does: one process that stood still for a while has lost all of them, and they live. Whether there
    /// is one.
    fn await_any(&self, placing: &mut Placing) -> bool {
        let (begun, moment) = (Instant::now(), placing.kept.moment.clone());
        while placing.living().is_empty() && begun.elapsed() < BACK_WITHIN {
            wait_until(&SystemClock::new(), BACK_EVERY);
            self.take_back(placing, &moment);
        }
        !placing.living().is_empty()
    }

    fn try_back(&self, placing: &mut Placing) -> Result<(), Fault> {
        let (objects, living) = (placing.objects(), placing.living());
        for &host in &living {
            self.part(host, |divided| {
                divided.release(&objects)?;
                divided.adopt(&placing.kept.moment)
            })?;
        }
        let mut packs = std::mem::take(&mut placing.kept.packs);
        let put = packs.iter_mut().try_for_each(|pack| {
            if placing.seen.lost[pack.host].is_some() {
                let count = |host: &usize| placing.seen.owners.values().filter(|owner| owner.host == *host).count();
                pack.host = living.iter().copied().min_by_key(count).unwrap_or_default();
                let record = &mut placing.seen.records[pack.host];
                (record.moved, record.reborn) =
                    (record.moved + pack.objects.len() as u64, record.reborn + pack.objects.len() as u64);
            }
            placing.give(&pack.objects, pack.host);
            self.part(pack.host, |divided| divided.adopt(&pack.bytes))
        });
        placing.kept.packs = packs;
        put?;
        placing.seen.time = placing.kept.time;
        placing.leaving.clear();
        self.look(placing)
    }

    /// Takes up an object on all hosts; one of them steps it. A host that does not is lost, unless it is the first to be asked.
    pub(super) fn join(&self, placing: &mut Placing, name: &str, part: &Part) -> Result<AgentId, WorldError> {
        // from these states all goes on where a host is lost meanwhile
        self.keep_or_go_back(placing)?;
        let mut joined: Option<AgentId> = None;
        for host in placing.living() {
            let added = self.hosts[host].world.add(name, part.clone()).map(Object::id);
            let other = || WorldError::Undivided { reason: format!("\"{name}\" has another number on each host") };
            let lost = match added {
                Ok(id) if joined.is_none_or(|joined| joined == id) => {
                    joined = Some(id);
                    continue;
                }
                Ok(_) => other(),
                Err(error @ (WorldError::Silent { .. } | WorldError::Stopped)) => error,
                Err(error) if joined.is_none() => return Err(error),
                Err(error) => error,
            };
            self.go_back(placing, Fault::Lost(host, lost))?;
        }
        let id = joined.ok_or_else(|| self.silent())?;
        let host = *placing.living().first().ok_or_else(|| self.silent())?;
        Arc::make_mut(&mut placing.seen.owners).insert(id, Owner { host, cost: RATE_JOINED_HZ });
        self.begin(placing)?;
        Ok(id)
    }

    /// The state of all, on one host for as long as it is written.
    pub(super) fn gather(&self, placing: &mut Placing) -> Result<Checkpoint, CheckpointError> {
        self.keep_or_go_back(placing)?;
        let first = *placing.living().first().ok_or_else(|| self.silent())?;
        let (host, divided) = (&self.hosts[first], self.hosts[first].divided()?);
        let elsewhere: Vec<&Pack> = placing.kept.packs.iter().filter(|pack| pack.host != first).collect();
        let adopted = elsewhere.iter().try_for_each(|pack| divided.adopt(&pack.bytes));
        let checkpoint = adopted.map_err(CheckpointError::from).and_then(|()| host.world.checkpoint());
        elsewhere.iter().try_for_each(|pack| divided.release(&pack.objects))?;
        checkpoint
    }

    /// Puts all hosts back into one state, and places its objects anew.
    pub(super) fn put_all_back(&self, placing: &mut Placing, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        for host in placing.living() {
            match self.hosts[host].world.restore(checkpoint) {
                Err(CheckpointError::Start(error @ WorldError::Silent { .. })) => {
                    placing.seen.lost[host] = Some(error.to_string());
                }
                restored => restored?,
            }
        }
        let first = *placing.living().first().ok_or_else(|| self.silent())?;
        placing.seen.owners = Placing::of(&self.hosts[first..=first], checkpoint.time(), &self.rates_hz)?.seen.owners;
        (placing.seen.time, placing.escaped) = (checkpoint.time(), checkpoint.time());
        let objects = placing.objects();
        placing.give(&objects, first);
        Ok(self.begin(placing)?)
    }
}
