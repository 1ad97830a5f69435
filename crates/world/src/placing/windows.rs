//! How time passes on several hosts: windows, objects that change hosts, states that are kept and gone back to.
//!
//! In: the hosts of a placed world, an act. Out: the same act done once, whatever was done again for it. Never here: the calls of a world.

use super::divided::{DividedCalls, PartAdvanced};
use super::groups::{PlacedGroup, fences, groups, place};
use super::placed_world::{PlacedHost, PlacedWorld};
use crate::Part;
use crate::error::WorldError;
use crate::history::checkpoint::{Checkpoint, CheckpointError};
use crate::reading::object::Object;
use metachron_core::{AgentId, Body, SimSpan, SimTime};
use metachron_runtime::{Command, Reach, side_by_side};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// States are kept so often: that much is done again where a host falls silent, or an object leaves its box. More seldom where it takes more than
/// one part in so many of the time.
const KEEP_EVERY: SimSpan = SimSpan::from_millis(500);
const KEEP_SHARE: u32 = 20;

/// So many objects are packed at first, and the rest of their group; then as many as take about so many bytes: a message has its bound.
const PACKED_AT_FIRST: usize = 256;
const PACKED_BYTES: usize = 2 << 20;

/// How much room for more speed objects have at first; twice as much each time that one has left its box, and from window to window less again.
const ROOM: f64 = 2.0;
const ROOM_RISES: f64 = 2.0;
const ROOM_FALLS: f64 = 0.98;

/// By this rate the cost of an object that joined is reckoned.
const RATE_JOINED_HZ: f64 = 60.0;

/// The hosts' parts, and how far time has come.
pub(super) struct Placing {
    pub seen: PlacingSeen,
    /// Where objects may be found, and which belong together, by hosts.
    reaches: Vec<Vec<Reach>>,
    bonds: Vec<Vec<[AgentId; 2]>>,
    room: f64,
    kept: Kept,
    /// Acts since states were kept.
    since: Vec<Act>,
    /// Objects that leave at their next steps.
    leaving: Vec<AgentId>,
    /// The hosts that are to step some objects, and what is with them.
    pub pins: BTreeMap<AgentId, usize>,
    /// Whether others see how far time has come, and the states then, after this window.
    shows: bool,
    /// Whether loads are evened before the next window.
    evens: bool,
}

/// The part of it that others look at while time passes: copies share the owners until these change.
#[derive(Clone)]
pub(super) struct PlacingSeen {
    pub time: SimTime,
    /// Of each object that is there.
    pub owners: Arc<BTreeMap<AgentId, Owner>>,
    /// Why each host steps nothing any more.
    pub lost: Vec<Option<String>>,
    /// How often an object has left its box.
    pub escapes: u64,
    pub records: Vec<HostRecord>,
}

/// The host that steps an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Owner {
    /// Its number.
    pub host: usize,
    /// The cost of the object: its places times its rate.
    cost: f64,
}

/// States of all objects at one moment.
#[derive(Default)]
struct Kept {
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
    fn is_old(&self, time: SimTime) -> bool {
        time >= self.time + KEEP_EVERY && self.at.is_none_or(|at| at.elapsed() >= KEEP_SHARE * self.took)
    }
}

/// The outcome of a window on one host.
struct HostWindow {
    advanced: PartAdvanced,
    waited: Duration,
}

/// How a host went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct HostRecord {
    /// CPU time of all steps so far.
    pub cpu: Duration,
    /// The newest window's wall time beside its steps: the link there and back.
    pub waited: Duration,
    /// Objects that came to it, and of these those whose host was lost.
    pub moved: u64,
    pub reborn: u64,
}

/// From which host to which one objects go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Route {
    from: usize,
    to: usize,
}

/// Objects that one host has packed.
struct Pack {
    host: usize,
    objects: Vec<AgentId>,
    bytes: Vec<u8>,
}

/// A thing that is done to the world.
#[derive(Clone)]
pub(super) enum Act {
    Pass(SimSpan),
    Command(AgentId, Box<Command>),
    SetState(AgentId, Box<Body>),
    Remove(AgentId),
}

/// Why an act was not done.
enum Fault {
    /// An object has left its box.
    Escaped,
    /// The host of this number does not step its part any more.
    Lost(usize, WorldError),
    Refused(WorldError),
}

/// The outcome of a command to the host of this number, which may refuse it.
fn outcome_of<T>(host: usize, outcome: Result<T, WorldError>) -> Result<T, Fault> {
    outcome.map_err(|error| match error {
        error @ (WorldError::Silent { .. } | WorldError::Stopped) => Fault::Lost(host, error),
        other => Fault::Refused(other),
    })
}

impl Placing {
    /// All objects on the first of `hosts`, at `time`; `rates_hz` are those of the first numbers.
    pub fn of(hosts: &[PlacedHost], time: SimTime, rates_hz: &[f64]) -> Result<Self, WorldError> {
        let mut owners = BTreeMap::new();
        let of_first = hosts
            .iter()
            .take(1)
            .flat_map(|host| host.world.all_objects().into_iter().map(move |object| (host, object)));
        for (host, object) in of_first {
            let places = match &host.world.latest(object)?.body {
                Body::Curve(curve) => curve.positions.len(),
                Body::Soft(soft) => soft.positions.len(),
                Body::Nothing | Body::Rigid(_) | Body::Tool(_) => 1,
            };
            let rate_hz = rates_hz.get(object.id().0 as usize).copied().unwrap_or(RATE_JOINED_HZ);
            owners.insert(object.id(), Owner { host: 0, cost: places as f64 * rate_hz });
        }
        let (lost, reaches, bonds) =
            (vec![None; hosts.len()], vec![Vec::new(); hosts.len()], vec![Vec::new(); hosts.len()]);
        let records = vec![HostRecord::default(); hosts.len()];
        let (kept, since, leaving) = (Kept::default(), Vec::new(), Vec::new());
        let seen = PlacingSeen { time, owners: Arc::new(owners), lost, escapes: 0, records };
        Ok(Self {
            seen,
            reaches,
            bonds,
            room: ROOM,
            kept,
            since,
            leaving,
            pins: BTreeMap::new(),
            shows: true,
            evens: true,
        })
    }

    fn objects(&self) -> Vec<AgentId> {
        self.seen.owners.keys().copied().collect()
    }

    /// The objects of boxes and ties, and those that are pinned.
    fn objects_of(&self, boxes: &[Reach], ties: &[[AgentId; 2]]) -> Vec<AgentId> {
        let all =
            boxes.iter().map(|reach| reach.id).chain(ties.iter().flatten().copied()).chain(self.pins.keys().copied());
        let there: BTreeSet<_> = all.filter(|id| self.seen.owners.contains_key(id)).collect();
        there.into_iter().collect()
    }

    fn living(&self) -> Vec<usize> {
        self.seen.living()
    }
}

impl PlacingSeen {
    /// The hosts that step their parts.
    pub fn living(&self) -> Vec<usize> {
        (0..self.lost.len()).filter(|host| self.lost[*host].is_none()).collect()
    }
}

impl PlacedWorld {
    /// So much time passes at once on all hosts.
    pub(super) const WINDOW: SimSpan = SimSpan::from_nanos(16_666_667);

    /// Goes on from a state that all hosts have: each object has its host, and all states are kept.
    pub(super) fn begin(&self, placing: &mut Placing) -> Result<(), WorldError> {
        for host in placing.living() {
            let is_elsewhere = |(_, owner): &(&AgentId, &Owner)| owner.host != host;
            let elsewhere: Vec<_> = placing.seen.owners.iter().filter(is_elsewhere).map(|(id, _)| *id).collect();
            self.hosts[host].divided()?.release(&elsewhere)?;
        }
        placing.since.clear();
        placing.leaving.clear();
        match self.look(placing) {
            Err(Fault::Refused(error) | Fault::Lost(_, error)) => return Err(error),
            Ok(()) | Err(Fault::Escaped) => {}
        }
        self.act(placing, Act::Pass(SimSpan::ZERO))?;
        self.keep_or_go_back(placing)
    }

    /// Calls a host for its part; one that does not answer is lost.
    fn part<T>(&self, host: usize, call: impl FnOnce(&dyn DividedCalls) -> Result<T, WorldError>) -> Result<T, Fault> {
        self.hosts[host].divided().and_then(call).map_err(|error| match error {
            error @ WorldError::Undivided { .. } => Fault::Refused(error),
            other => Fault::Lost(host, other),
        })
    }

    /// Looks where objects may be found. States are seen then, unless later ones follow.
    fn look(&self, placing: &mut Placing) -> Result<(), Fault> {
        let shows = placing.since.is_empty();
        placing.reaches.iter_mut().for_each(Vec::clear);
        placing.bonds.iter_mut().for_each(Vec::clear);
        for host in placing.living() {
            let looked = self.part(host, |divided| divided.advance_within(SimSpan::ZERO, &[], shows))?;
            (placing.reaches[host], placing.bonds[host]) = (looked.reaches, looked.bonds);
        }
        Ok(())
    }

    /// Lets `span` pass, window by window, of which others see the last.
    pub(super) fn pass(&self, placing: &mut Placing, span: SimSpan) -> Result<(), WorldError> {
        let passed = self.pass_windows(placing, span);
        placing.shows = true;
        passed
    }

    fn pass_windows(&self, placing: &mut Placing, span: SimSpan) -> Result<(), WorldError> {
        let mut left = span;
        while left > SimSpan::ZERO {
            let window = left.min(Self::WINDOW);
            // objects that leave are seen to
            placing.shows = window == left || !placing.leaving.is_empty();
            self.act(placing, Act::Pass(window))?;
            if placing.kept.is_old(placing.seen.time) {
                self.keep_or_go_back(placing)?;
            }
            left = SimSpan::from_nanos(left.as_nanos() - window.as_nanos());
        }
        Ok(())
    }

    /// Does `act`, and again all that was done since states were kept where it takes that.
    pub(super) fn act(&self, placing: &mut Placing, act: Act) -> Result<(), WorldError> {
        let mut to_do = VecDeque::from([act]);
        while let Some(act) = to_do.pop_front() {
            match self.try_act(placing, &act) {
                Ok(()) => placing.since.push(act),
                Err(Fault::Refused(error)) => return Err(error),
                Err(fault) => {
                    self.go_back(placing, fault)?;
                    let mut again = std::mem::take(&mut placing.since);
                    again.push(act);
                    again.extend(to_do);
                    to_do = again.into();
                }
            }
        }
        if placing.shows {
            self.show(&placing.seen);
        }
        Ok(())
    }

    fn try_act(&self, placing: &mut Placing, act: &Act) -> Result<(), Fault> {
        let gone = |id: AgentId| Fault::Refused(WorldError::NoAgent(id));
        let owner = |id: AgentId| placing.seen.owners.get(&id).map(|owner| owner.host).ok_or_else(|| gone(id));
        match act {
            Act::Pass(span) => self.pass_window(placing, *span),
            Act::Command(id, command) => {
                let (host, world) = (owner(*id)?, &self.hosts[owner(*id)?].world);
                outcome_of(host, world.object_of(*id).and_then(|object| world.command(object, **command)))
            }
            Act::SetState(id, state) => {
                let (host, world) = (owner(*id)?, &self.hosts[owner(*id)?].world);
                outcome_of(host, world.object_of(*id).and_then(|object| world.set_state(object, state)))
            }
            Act::Remove(id) => {
                placing.leaving.push(*id);
                placing.living().into_iter().try_for_each(|host| {
                    let world = &self.hosts[host].world;
                    match world.object_of(*id).and_then(|object| world.remove(object)) {
                        // it has left there before all went back
                        Err(WorldError::Gone { .. }) => Ok(()),
                        outcome => outcome_of(host, outcome),
                    }
                })
            }
        }
    }

    /// Lets a window pass on all hosts at once.
    fn pass_window(&self, placing: &mut Placing, window: SimSpan) -> Result<(), Fault> {
        let fences = self.place_for(placing, window)?;
        let (owners, shows) = (&placing.seen.owners, placing.shows);
        let advance = |host: usize| {
            let is_own = |fence: &&Reach| owners.get(&fence.id).is_some_and(|owner| owner.host == host);
            let own: Vec<Reach> = fences.iter().filter(is_own).copied().collect();
            let asked = Instant::now();
            let advanced = self.part(host, |divided| divided.advance_within(window, &own, shows))?;
            let waited = asked.elapsed().saturating_sub(advanced.took);
            Ok(HostWindow { advanced, waited })
        };
        let living = placing.living();
        let outcomes = side_by_side(&living, |host| advance(*host));
        let mut escaped = false;
        for (host, outcome) in living.into_iter().zip(outcomes) {
            let HostWindow { advanced, waited } = outcome.unwrap_or(Err(Fault::Lost(host, WorldError::Stopped)))?;
            escaped |= advanced.escaped.is_some();
            (placing.reaches[host], placing.bonds[host]) = (advanced.reaches, advanced.bonds);
            let record = &mut placing.seen.records[host];
            (record.cpu, record.waited) = (advanced.cpu.unwrap_or(record.cpu), waited);
        }
        if escaped {
            return Err(Fault::Escaped);
        }
        placing.seen.time += window;
        self.forget_left(placing);
        placing.room = (placing.room * ROOM_FALLS).max(ROOM);
        Ok(())
    }

    /// Forgets objects that were to leave, and have.
    fn forget_left(&self, placing: &mut Placing) {
        let PlacingSeen { owners, .. } = &mut placing.seen;
        placing.leaving.retain(|id| {
            let world = owners.get(id).map(|owner| &self.hosts[owner.host].world);
            let latest = world.map(|world| world.object_of(*id).and_then(|object| world.latest(object)));
            let is_there = latest.is_some_and(|latest| !matches!(latest, Err(WorldError::Gone { .. })));
            if !is_there {
                Arc::make_mut(owners).remove(id);
            }
            is_there
        });
    }

    /// Brings objects that may meet within a window to one host; the boxes that they may not leave in it, none where one host steps all.
    fn place_for(&self, placing: &mut Placing, window: SimSpan) -> Result<Vec<Reach>, Fault> {
        let living = placing.living();
        if living.is_empty() {
            return Err(Fault::Refused(self.silent()));
        }
        let reaches: Vec<Reach> = placing.reaches.iter().flatten().copied().collect();
        let fences = fences(&reaches, window, placing.room);
        let (ties, evens) = (self.ties_of(placing), std::mem::take(&mut placing.evens));
        // those that can meet nothing stay where they are until loads are evened
        let objects = if evens { placing.objects() } else { placing.objects_of(&fences, &ties) };
        let mut placed: Vec<PlacedGroup> =
            groups(&objects, &fences, &ties).into_iter().map(|objects| placing.group(objects)).collect();
        let lives: Vec<bool> = placing.seen.lost.iter().map(Option::is_none).collect();
        place(&mut placed, &lives, evens);
        let mut moves: BTreeMap<Route, Vec<Vec<AgentId>>> = BTreeMap::new();
        for PlacedGroup { objects, host, .. } in &placed {
            let mut from: BTreeMap<usize, Vec<AgentId>> = BTreeMap::new();
            for id in objects {
                from.entry(placing.seen.owners[id].host).or_default().push(*id);
            }
            let Some(to) = *host else { continue };
            for (from, objects) in from.into_iter().filter(|(from, _)| *from != to) {
                moves.entry(Route { from, to }).or_default().push(objects);
            }
        }
        for (Route { from, to }, groups) in moves {
            for Pack { objects, bytes, .. } in self.pack(from, &groups)? {
                self.part(to, |divided| divided.adopt(&bytes))?;
                self.part(from, |divided| divided.release(&objects))?;
                placing.seen.records[to].moved += objects.len() as u64;
                placing.give(&objects, to);
            }
        }
        let mut hosts = placing.seen.owners.values().map(|owner| owner.host);
        let first = hosts.next();
        let is_one = hosts.all(|host| Some(host) == first);
        Ok(if is_one { Vec::new() } else { fences })
    }

    /// Objects that one host steps, however far apart they are.
    fn ties_of(&self, placing: &Placing) -> Vec<[AgentId; 2]> {
        self.ties.iter().chain(placing.bonds.iter().flatten()).copied().collect()
    }

    /// Groups of objects as a host packs them.
    fn pack(&self, host: usize, groups: &[Vec<AgentId>]) -> Result<Vec<Pack>, Fault> {
        let (mut packs, mut at_once, mut groups) = (Vec::new(), PACKED_AT_FIRST, groups.iter().peekable());
        while groups.peek().is_some() {
            let mut objects: Vec<AgentId> = Vec::new();
            while let Some(group) = groups.next_if(|_| objects.len() < at_once) {
                objects.extend(group);
            }
            objects.sort_unstable();
            let bytes = self.part(host, |divided| divided.pack(&objects))?;
            // others may be larger
            let by_bytes = PACKED_BYTES * objects.len() / bytes.len().max(1);
            at_once = by_bytes.clamp(1, 4 * objects.len());
            packs.push(Pack { host, objects, bytes });
        }
        Ok(packs)
    }

    /// Keeps the states of all objects, or does again what was done since the last ones and keeps those then.
    fn keep_or_go_back(&self, placing: &mut Placing) -> Result<(), WorldError> {
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
        let moment = self.part(first, |divided| divided.pack(&[]))?;
        self.take_back(placing, &moment);
        let living = placing.living();
        let mut kept = Kept { time: placing.seen.time, moment, ..Kept::default() };
        // without another host they could not go on
        if living.len() > 1 {
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
    fn go_back(&self, placing: &mut Placing, fault: Fault) -> Result<(), WorldError> {
        let (mut fault, mut lost) = (Some(fault), None);
        while let Some(why) = fault.take() {
            match why {
                Fault::Refused(error) => return Err(error),
                Fault::Escaped => {
                    placing.seen.escapes += 1;
                    placing.room *= ROOM_RISES;
                }
                Fault::Lost(host, error) => {
                    placing.seen.lost[host] = Some(error.to_string());
                    lost = Some(error);
                }
            }
            if placing.living().is_empty() || (placing.kept.packs.is_empty() && !placing.seen.owners.is_empty()) {
                return Err(lost.unwrap_or_else(|| self.silent()));
            }
            fault = self.try_back(placing).err();
        }
        Ok(())
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
}

impl Placing {
    /// A group with the host that it is pinned to, or else that steps most of it.
    fn group(&self, objects: Vec<AgentId>) -> PlacedGroup {
        let mut shares = vec![0.0; self.seen.lost.len()];
        objects.iter().filter_map(|id| self.seen.owners.get(id)).for_each(|owner| shares[owner.host] += owner.cost);
        let cost = shares.iter().sum();
        let most = (0..shares.len()).rev().max_by(|one, other| shares[*one].total_cmp(&shares[*other]));
        let lives = |host: &usize| self.seen.lost[*host].is_none();
        let pinned = objects.iter().find_map(|id| self.pins.get(id).copied().filter(lives));
        PlacedGroup { objects, host: pinned.or(most), is_pinned: pinned.is_some(), cost }
    }

    fn give(&mut self, objects: &[AgentId], to: usize) {
        for id in objects {
            Arc::make_mut(&mut self.seen.owners).entry(*id).and_modify(|owner| owner.host = to);
        }
    }
}

impl PlacedWorld {
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
        placing.seen.time = checkpoint.time();
        let objects = placing.objects();
        placing.give(&objects, first);
        Ok(self.begin(placing)?)
    }
}
