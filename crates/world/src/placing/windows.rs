//! How time passes on several hosts: windows, objects that change hosts, states that are kept and gone back to.
//!
//! In: the hosts of a placed world, an act. Out: the same act done once, whatever was done again for it. Never here: the calls of a world.

use super::divided::{DividedCalls, PartAdvanced};
use super::groups::{PlacedGroup, fences, groups, place, share_speeds};
use super::kept::{Kept, Pack};
use super::placed_world::{PlacedHost, PlacedWorld};
use crate::error::WorldError;
use metachron_core::{AgentId, Body, SimSpan, SimTime};
use metachron_runtime::{Command, Reach, side_by_side};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How much room for more speed objects have at first; what there is more falls from window to window, past the one from which an object escaped.
const ROOM: f64 = 2.0;
const ROOM_FALLS: f64 = 0.98;

/// By this rate the cost of an object that joined is reckoned.
pub(super) const RATE_JOINED_HZ: f64 = 60.0;

/// The hosts' parts, and how far time has come.
pub(super) struct Placing {
    pub seen: PlacingSeen,
    /// Where objects may be found, and which belong together, by hosts.
    pub(super) reaches: Vec<Vec<Reach>>,
    bonds: Vec<Vec<[AgentId; 2]>>,
    pub(super) room: f64,
    /// How far time had come when an object left its box last.
    pub(super) escaped: SimTime,
    pub(super) kept: Kept,
    /// Acts since states were kept.
    pub(super) since: Vec<Act>,
    /// Objects that leave at their next steps.
    pub(super) leaving: Vec<AgentId>,
    /// The hosts that are to step some objects, and what is with them.
    pub pins: BTreeMap<AgentId, usize>,
    /// Whether others see how far time has come, and the states then, after this window.
    shows: bool,
    /// Whether loads are evened before the next window.
    pub(super) evens: bool,
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
    pub(super) cost: f64,
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

/// A thing that is done to the world.
#[derive(Clone)]
pub(super) enum Act {
    Pass(SimSpan),
    Command(AgentId, Box<Command>),
    SetState(AgentId, Box<Body>),
    Remove(AgentId),
}

/// Why an act was not done.
pub(super) enum Fault {
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
            escaped: SimTime::ZERO,
            kept,
            since,
            leaving,
            pins: BTreeMap::new(),
            shows: true,
            evens: true,
        })
    }

    pub(super) fn objects(&self) -> Vec<AgentId> {
        self.seen.owners.keys().copied().collect()
    }

    /// The objects of boxes and ties, and those that are pinned.
    fn objects_of(&self, boxes: &[Reach], ties: &[[AgentId; 2]]) -> Vec<AgentId> {
        let all =
            boxes.iter().map(|reach| reach.id).chain(ties.iter().flatten().copied()).chain(self.pins.keys().copied());
        let there: BTreeSet<_> = all.filter(|id| self.seen.owners.contains_key(id)).collect();
        there.into_iter().collect()
    }

    pub(super) fn living(&self) -> Vec<usize> {
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
    pub(super) fn part<T>(
        &self,
        host: usize,
        call: impl FnOnce(&dyn DividedCalls) -> Result<T, WorldError>,
    ) -> Result<T, Fault> {
        self.hosts[host].divided().and_then(call).map_err(|error| match error {
            error @ WorldError::Undivided { .. } => Fault::Refused(error),
            other => Fault::Lost(host, other),
        })
    }

    /// Looks where objects may be found. States are seen then, unless later ones follow.
    pub(super) fn look(&self, placing: &mut Placing) -> Result<(), Fault> {
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
        if placing.seen.time > placing.escaped {
            placing.room = (placing.room * ROOM_FALLS).max(ROOM);
        }
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
        let mut reaches: Vec<Reach> = placing.reaches.iter().flatten().copied().collect();
        let (ties, evens) = (self.ties_of(placing), std::mem::take(&mut placing.evens));
        let near = fences(&reaches, window, placing.room);
        share_speeds(&mut reaches, &groups(&placing.objects_of(&near, &ties), &near, &ties));
        let fences = fences(&reaches, window, placing.room);
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
    pub(super) fn ties_of(&self, placing: &Placing) -> Vec<[AgentId; 2]> {
        self.ties.iter().chain(placing.bonds.iter().flatten()).copied().collect()
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

    pub(super) fn give(&mut self, objects: &[AgentId], to: usize) {
        for id in objects {
            Arc::make_mut(&mut self.seen.owners).entry(*id).and_modify(|owner| owner.host = to);
        }
    }
}
