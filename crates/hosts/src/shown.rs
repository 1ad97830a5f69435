//! The states and events of a world that callers are shown.
//!
//! In: a world, again and again. Out: what has changed since the last time, and all. Never here: callers, a connection.

use crate::event_wire::WireEvent;
use crate::wire::{Moment, ObjectState};
use metachron_core::{AgentId, LocalModel, Snapshot};
use metachron_world::{EventReader, WorldCalls};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// So many events wait to be shown; of more the oldest are lost.
const GATHERED_MAX: usize = 4096;

/// States that have changed, and as they were shown before.
pub(crate) struct Changes {
    pub moment: Moment,
    pub before: HashMap<AgentId, Arc<Snapshot>>,
}

/// The states that callers were shown.
pub(crate) struct Shown {
    /// The number of the next message.
    pub sequence: u64,
    objects: BTreeMap<AgentId, (Arc<str>, Arc<Snapshot>)>,
    pub events: Box<dyn EventReader>,
    /// Events that wait to be shown, the newest of them.
    pub gathered: Vec<WireEvent>,
    /// Whether there was a caller at the last message: without one nothing is looked at.
    pub is_followed: bool,
    /// States that were too long for a message.
    pub too_long: u64,
    /// Bytes of all messages of states.
    pub sent: u64,
}

impl Shown {
    /// Nothing yet; events come from this reader.
    pub fn new(events: Box<dyn EventReader>) -> Self {
        Self {
            sequence: 1,
            objects: BTreeMap::new(),
            events,
            gathered: Vec::new(),
            is_followed: false,
            too_long: 0,
            sent: 0,
        }
    }

    pub fn gather_events(&mut self) {
        self.gathered.extend(self.events.take().into_iter().filter_map(WireEvent::of));
        self.gathered.drain(..self.gathered.len().saturating_sub(GATHERED_MAX));
    }

    /// Takes up the states that are there now: what has changed since the last time.
    pub fn changes(&mut self, world: &dyn WorldCalls, run: u64) -> Changes {
        let (time, mut present, mut states) = (world.time(), BTreeSet::new(), Vec::new());
        let mut before = HashMap::new();
        for object in world.all_objects() {
            // an object may leave meanwhile
            let Ok(state) = world.latest(object) else { continue };
            let id = object.id();
            present.insert(id);
            let known = self.objects.get(&id);
            if known.is_some_and(|(_, shown)| Arc::ptr_eq(shown, &state)) {
                continue;
            }
            let name = known.map(|(name, _)| Ok(Arc::clone(name))).unwrap_or_else(|| world.name(object.into()));
            let Ok(name) = name else { continue };
            states.push(ObjectState { id, name: Arc::clone(&name), state: travelling(&state) });
            before.extend(self.objects.insert(id, (name, state)).map(|(_, state)| (id, state)));
        }
        let gone: Vec<_> = self.objects.keys().filter(|id| !present.contains(id)).copied().collect();
        gone.iter().for_each(|id| drop(self.objects.remove(id)));
        self.gather_events();
        let events = std::mem::take(&mut self.gathered);
        Changes { moment: Moment { run, sequence: 0, time, states, gone, events }, before }
    }

    /// All states as they were last shown.
    pub fn all(&self, world: &dyn WorldCalls, run: u64) -> Moment {
        let state = |(id, (name, state)): (&AgentId, &(Arc<str>, Arc<Snapshot>))| ObjectState {
            id: *id,
            name: Arc::clone(name),
            state: travelling(state),
        };
        let states = self.objects.iter().map(state).collect();
        Moment { run, time: world.time(), states, ..Moment::default() }
    }
}

/// A state without what only partners of asynchronous pairs read: ledgers, and the local model with its factor.
fn travelling(state: &Arc<Snapshot>) -> Arc<Snapshot> {
    if state.given.is_empty() && state.taken.is_empty() && state.local_model.blocks.is_empty() {
        return Arc::clone(state);
    }
    let (given, taken, local_model) = (Vec::new(), Vec::new(), LocalModel::default());
    Arc::new(Snapshot { given, taken, local_model, ..Snapshot::clone(state) })
}
