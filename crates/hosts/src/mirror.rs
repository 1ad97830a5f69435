//! A world that runs elsewhere, as it was last seen.
//!
//! In: messages of its host. Out: its objects with their newest states, its events. Never here: a connection, calls.

use crate::check;
use crate::wire::{Moment, Welcome};
use metachron_core::{AgentId, Body, SimTime, Snapshot};
use metachron_world::{Event, EventFilter, EventReader, EventSieve, Object, SceneMark, Touched, WorldError, WorldTag};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

/// So many events wait for a reader; of more the oldest are lost.
const EVENTS_KEPT: usize = 4096;
/// A state is led on by its velocities for at most so long, seconds, as in a world's own frames.
const AHEAD_MAX_S: f64 = 0.1;

/// All objects of a world elsewhere at one moment.
#[derive(Debug, Clone)]
pub struct RemoteFrame {
    /// The moment.
    pub time: SimTime,
    /// Each object that is there, with its newest state.
    pub states: Vec<(Object, Arc<Snapshot>)>,
}

impl RemoteFrame {
    /// The matter of an object at the frame's moment: its newest state, led on by its velocities for 0.1 s at most;
    /// `None` for an object that is not in the frame.
    #[must_use]
    pub fn body(&self, object: Object) -> Option<Body> {
        let state = &self.states.iter().find(|(of, _)| *of == object)?.1;
        let ahead_s = self.time.secs_after(state.moment()).clamp(-AHEAD_MAX_S, AHEAD_MAX_S);
        let mut body = state.body.clone();
        body.lead(if state.at_rest { 0.0 } else { ahead_s });
        Some(body)
    }
}

/// A world elsewhere, as it was last seen.
#[derive(Debug)]
pub(crate) struct Mirror {
    pub tag: WorldTag,
    pub run: u64,
    pub world: String,
    pub scene: SceneMark,
    fixed: Vec<Arc<str>>,
    seen: Mutex<Seen>,
    changed: Condvar,
}

#[derive(Debug)]
struct Seen {
    objects: BTreeMap<AgentId, SeenObject>,
    time: SimTime,
    /// The number of the newest message whose states are here, and of that whose events were given to readers.
    sequence: u64,
    events_sequence: u64,
    /// When the newest message came.
    came: Instant,
    /// Since when the host is silent: at first until its sign of life comes.
    silent: Option<Instant>,
    /// How often it has fallen silent.
    silences: u64,
    /// A message was missed, or the host was silent: all states are to be asked for.
    is_stale: bool,
    refused: u64,
    readers: Vec<Weak<Mutex<Waiting>>>,
}

/// Events that wait for their reader, and how many did not get a place.
#[derive(Debug, Default)]
struct Waiting {
    events: VecDeque<Event>,
    lost: u64,
}

/// A reader of events.
struct Listener {
    waiting: Arc<Mutex<Waiting>>,
    sieve: EventSieve,
}

impl Listener {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl EventReader for Listener {
    fn take(&mut self) -> Vec<Event> {
        let mut events = std::mem::take(&mut self.waiting().events);
        events.retain(|event| self.sieve.passes(event.object, &event.what));
        events.into()
    }

    fn lost(&self) -> u64 {
        self.waiting().lost
    }
}

#[derive(Debug)]
struct SeenObject {
    name: Arc<str>,
    /// `None` once it has left.
    state: Option<Arc<Snapshot>>,
}

impl Mirror {
    pub fn new(welcome: Welcome) -> Self {
        let Welcome { run, world, scene, scene_hash, fixed, .. } = welcome;
        let seen = Seen {
            objects: BTreeMap::new(),
            time: SimTime::ZERO,
            sequence: 0,
            events_sequence: 0,
            came: Instant::now(),
            silent: Some(Instant::now()),
            silences: 0,
            is_stale: true,
            refused: 0,
            readers: Vec::new(),
        };
        let scene = SceneMark { name: scene, hash: scene_hash };
        Self { tag: WorldTag::new(), run, world, scene, fixed, seen: Mutex::new(seen), changed: Condvar::new() }
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a message of changes; returns whether its numbers can be.
    pub fn take(&self, moment: Moment) -> bool {
        let mut seen = self.seen();
        if moment.run != self.run || check::moment(&moment).is_err() {
            seen.refused += 1;
            return false;
        }
        seen.came = Instant::now();
        if moment.sequence > seen.events_sequence {
            seen.events_sequence = moment.sequence;
            seen.give(moment.events.iter().map(|event| event.clone().event(self.tag)));
        }
        if moment.sequence > seen.sequence {
            seen.is_stale |= moment.sequence > seen.sequence + 1;
            (seen.sequence, seen.time) = (moment.sequence, moment.time);
            seen.apply(moment);
            self.changed.notify_all();
        }
        true
    }

    /// Takes all states, in messages of one answer.
    pub fn take_all(&self, parts: Vec<Moment>) {
        let mut seen = self.seen();
        let Some(first) = parts.first() else { return };
        if parts.iter().any(|part| part.run != self.run || check::moment(part).is_err()) {
            seen.refused += 1;
            return;
        }
        (seen.sequence, seen.time) = (first.sequence, first.time);
        seen.events_sequence = seen.events_sequence.max(first.sequence);
        let present: BTreeSet<_> = parts.iter().flat_map(|part| part.states.iter().map(|state| state.id)).collect();
        let left = seen.objects.iter_mut().filter(|(id, _)| !present.contains(id));
        left.for_each(|(_, object)| object.state = None);
        parts.into_iter().for_each(|part| seen.apply(part));
        (seen.is_stale, seen.came) = (false, Instant::now());
        self.changed.notify_all();
    }

    /// The host lives, or is silent.
    pub fn set_alive(&self, is_alive: bool) {
        let mut seen = self.seen();
        seen.is_stale |= seen.silent.is_some() && is_alive;
        seen.silences += u64::from(!is_alive);
        seen.silent = if is_alive { None } else { seen.silent.or_else(|| Some(Instant::now())) };
        self.changed.notify_all();
    }

    /// Why it cannot be called.
    pub fn silence(&self) -> Option<WorldError> {
        let silent = self.seen().silent?;
        Some(self.silent_for(silent.elapsed()))
    }

    /// Waits for the host's sign of life; whether it came.
    pub fn lives_within(&self, patience: Duration) -> bool {
        let waited = self.changed.wait_timeout_while(self.seen(), patience, |seen| seen.silent.is_some());
        waited.unwrap_or_else(PoisonError::into_inner).0.silent.is_none()
    }

    /// How often the host has fallen silent.
    pub fn silences(&self) -> u64 {
        self.seen().silences
    }

    pub fn silent_for(&self, lasts: Duration) -> WorldError {
        WorldError::Silent { world: self.world.clone(), lasts }
    }

    pub fn is_stale(&self) -> bool {
        self.seen().is_stale
    }

    /// A message was missed.
    pub fn miss(&self) {
        self.seen().is_stale = true;
    }

    /// A message could not be read.
    pub fn refuse(&self) {
        self.seen().refused += 1;
    }

    pub fn refused(&self) -> u64 {
        self.seen().refused
    }

    pub fn age(&self) -> Duration {
        self.seen().came.elapsed()
    }

    pub fn time(&self) -> SimTime {
        self.seen().time
    }

    pub fn frame(&self) -> RemoteFrame {
        self.seen().frame(self.tag)
    }

    /// The first frame that is later than `since`.
    ///
    /// # Errors
    /// [`WorldError::Silent`] if there is none within `patience`.
    pub fn next_frame(&self, since: SimTime, patience: Duration) -> Result<RemoteFrame, WorldError> {
        let waits = |seen: &mut Seen| seen.time <= since && seen.silent.is_none();
        let waited = self.changed.wait_timeout_while(self.seen(), patience, waits);
        let (seen, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match seen.silent {
            None if seen.time > since => Ok(seen.frame(self.tag)),
            silent => Err(self.silent_for(silent.map_or(patience, |silent| silent.elapsed()))),
        }
    }

    /// Waits for the messages up to this number, or all states after them, but not for long: one may be lost. Whether they came.
    pub fn reach(&self, sequence: u64, patience: Duration) -> bool {
        let has_all = |seen: &Seen| seen.sequence >= sequence && !seen.is_stale;
        let waits = |seen: &mut Seen| !has_all(seen) && seen.silent.is_none();
        let waited = self.changed.wait_timeout_while(self.seen(), patience, waits);
        let (seen, _) = waited.unwrap_or_else(PoisonError::into_inner);
        has_all(&seen)
    }

    pub fn all_objects(&self) -> Vec<Object> {
        self.frame().states.into_iter().map(|(object, _)| object).collect()
    }

    pub fn object(&self, name: &str) -> Result<Object, WorldError> {
        let seen = self.seen();
        let mut there = seen.objects.iter().filter(|(_, object)| object.state.is_some());
        if let Some((id, _)) = there.clone().find(|(_, object)| &*object.name == name) {
            return Ok(self.tag.object(*id));
        }
        let first: Vec<_> = there.by_ref().take(20).map(|(_, object)| &*object.name).collect();
        let further = match there.count() {
            0 => String::new(),
            count => format!(" and {count} more"),
        };
        Err(WorldError::NoObject { name: name.to_owned(), known: format!("{}{further}", first.join(", ")) })
    }

    pub fn object_of(&self, id: AgentId) -> Result<Object, WorldError> {
        let known = self.seen().objects.contains_key(&id);
        if known { Ok(self.tag.object(id)) } else { Err(WorldError::NoAgent(id)) }
    }

    pub fn name(&self, of: Touched) -> Result<Arc<str>, WorldError> {
        let name = match of {
            Touched::Object(object) if object.is_of(self.tag) => {
                self.seen().objects.get(&object.id()).map(|object| Arc::clone(&object.name))
            }
            Touched::Object(_) => None,
            Touched::Fixed(number) => self.fixed.get(number as usize).cloned(),
        };
        name.ok_or(WorldError::Foreign)
    }

    pub fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError> {
        let seen = self.seen();
        let known = seen.objects.get(&object.id()).filter(|_| object.is_of(self.tag)).ok_or(WorldError::Foreign)?;
        known.state.clone().ok_or_else(|| WorldError::Gone { name: known.name.to_string() })
    }

    pub fn listen(&self, filter: EventFilter) -> Box<dyn EventReader> {
        let waiting = Arc::<Mutex<Waiting>>::default();
        self.seen().readers.push(Arc::downgrade(&waiting));
        Box::new(Listener { waiting, sieve: EventSieve::new(filter) })
    }
}

impl Seen {
    fn apply(&mut self, moment: Moment) {
        for object in moment.states {
            self.objects.insert(object.id, SeenObject { name: object.name, state: Some(object.state) });
        }
        moment.gone.iter().filter_map(|id| self.objects.get_mut(id).map(|object| object.state = None)).for_each(drop);
    }

    fn frame(&self, tag: WorldTag) -> RemoteFrame {
        let there = self.objects.iter().filter_map(|(id, object)| Some((tag.object(*id), object.state.clone()?)));
        RemoteFrame { time: self.time, states: there.collect() }
    }

    fn give(&mut self, events: impl Iterator<Item = Event> + Clone) {
        self.readers.retain(|reader| {
            let Some(waiting) = reader.upgrade() else { return false };
            let Waiting { events: kept, lost } = &mut *waiting.lock().unwrap_or_else(PoisonError::into_inner);
            kept.extend(events.clone());
            let surplus = kept.len().saturating_sub(EVENTS_KEPT);
            kept.drain(..surplus);
            *lost += surplus as u64;
            true
        });
    }
}
