//! What happens in a world, in the order of the objects' times.
//!
//! In: the objects' own events. Out: those that were asked for, once each. Never here: waiting.

use super::object::{Object, Touched, WorldTag};
use super::world::World;
use glam::DVec3;
use metachron_core::{ContactPartner, Removed, SimTime};
use metachron_runtime::{AgentEvent, ContactEvent, EventKind, Heard};

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// The object that it happened to; of a contact between two the one with the lower number.
    pub object: Object,
    /// When, in its own time: the end of the step in which it happened.
    pub at: SimTime,
    /// What.
    pub what: Happening,
}

/// What can happen.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Happening {
    /// It began to touch something, or ceased to.
    Contact(Contact),
    /// It came to rest.
    Rests,
    /// It moves again after a rest.
    Wakes,
    /// Its step lasts too long: it stands still until that ends ([`Scene::stall_limit`](super::Scene::stall_limit)). Not told in lockstep.
    Stalled,
    /// It failed and stands still from now on.
    Failed,
    /// It was removed.
    Gone,
    /// It steps in the cluster that this object leads.
    Joined(Object),
    /// It makes its own turns again.
    Left,
    /// One of its attachments slipped for the first time, or tore.
    AttachmentGave,
    /// It could not keep its rate, and gave up time.
    RateMissed,
    /// Cells of it were removed.
    Carved(Removed),
}

/// A contact that begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// What the object touches.
    pub with: Touched,
    /// Whether it begins.
    pub begins: bool,
    /// The place that bore most, metres; not a number where that is not known, as in heaps of a thousand contacts.
    pub point_m: DVec3,
    /// The normal there, towards the object, of length 1.
    pub normal: DVec3,
    /// The force on the object, world axes, N: the greatest in the mean of a step so far.
    pub force_n: DVec3,
}

/// Which events are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventFilter {
    contacts: bool,
    above_n: f64,
    states: bool,
    object: Option<Object>,
}

impl EventFilter {
    /// Contacts that begin and end.
    #[must_use]
    pub const fn contacts() -> Self {
        Self { contacts: true, above_n: 0.0, states: false, object: None }
    }

    /// All but contacts.
    #[must_use]
    pub const fn states() -> Self {
        Self { contacts: false, states: true, ..Self::contacts() }
    }

    /// Everything.
    #[must_use]
    pub const fn all() -> Self {
        Self { states: true, ..Self::contacts() }
    }

    /// Also all but contacts.
    #[must_use]
    pub const fn and_states(self) -> Self {
        Self { states: true, ..self }
    }

    /// Of contacts only those of at least so many newtons in the mean of a step. They begin when they press so much: to a quarter more, or at
    /// their end where they never press a quarter more than that.
    #[must_use]
    pub const fn above_n(self, above_n: f64) -> Self {
        Self { above_n, ..self }
    }

    /// Only what happens to this object.
    #[must_use]
    pub const fn of(self, object: Object) -> Self {
        Self { object: Some(object), ..self }
    }

    fn takes(&self, event: &Event) -> bool {
        let concerns = |object: Object| self.object.is_none_or(|wanted| wanted == object);
        match event.what {
            Happening::Contact(contact) => {
                let of_it = matches!(contact.with, Touched::Object(other) if self.object == Some(other));
                self.contacts && (concerns(event.object) || of_it)
            }
            _ => self.states && concerns(event.object),
        }
    }
}

/// Events of a world from the moment on when it was asked for them.
#[derive(Debug)]
pub struct Events {
    world: World,
    filter: EventFilter,
    /// How far each object was heard.
    heard: Vec<Heard>,
    lost: u64,
    found: Vec<Event>,
    /// Contacts that have begun as the filter sees them.
    begun: Vec<(Object, Touched)>,
}

impl Events {
    pub(super) fn new(world: World, filter: EventFilter) -> Self {
        let heard = world.agents().iter().map(|agent| agent.listen()).collect();
        Self { world, filter, heard, lost: 0, found: Vec::new(), begun: Vec::new() }
    }

    /// All that happened since the last call, by their times. It never waits.
    pub fn drain(&mut self) -> impl Iterator<Item = Event> + '_ {
        let Self { world, filter, heard, lost, found, begun } = self;
        found.clear();
        let tag = world.tag();
        // what joined since is heard from its first drain on
        heard.extend(world.agents().iter().skip(heard.len()).map(|agent| agent.listen()));
        for (agent, heard) in world.agents().iter().zip(heard) {
            let object = tag.object(agent.id());
            *lost += agent.hear_events(heard, |event| {
                let event = event_of(tag, object, &event);
                if filter.takes(&event) && is_news(begun, &event, filter.above_n) {
                    found.push(event);
                }
            });
        }
        found.sort_by_key(|event| (event.at, event.object));
        found.drain(..)
    }

    /// How many events were overwritten before they were drained: an object keeps its newest 128.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost
    }
}

/// Whether a contact begins or ends as one that sees only those above some newtons sees it; other events are always news.
fn is_news(begun: &mut Vec<(Object, Touched)>, event: &Event, above_n: f64) -> bool {
    let Happening::Contact(contact) = event.what else { return true };
    let name = (event.object, contact.with);
    let known = begun.iter().position(|begun| *begun == name);
    let loud = contact.force_n.length() >= above_n;
    match (known, contact.begins) {
        (Some(_), true) => false,
        (None, true) => {
            if loud {
                begun.push(name);
            }
            loud
        }
        (Some(at), false) => {
            begun.swap_remove(at);
            true
        }
        (None, false) => loud,
    }
}

fn event_of(tag: WorldTag, object: Object, event: &AgentEvent) -> Event {
    let contact = |begins: bool, contact: ContactEvent| {
        let ContactEvent { with, point_m, normal, force_n } = contact;
        Happening::Contact(Contact { with: touched(tag, with), begins, point_m, normal, force_n })
    };
    let what = match event.kind {
        EventKind::ContactBegan(began) | EventKind::ContactGrew(began) => contact(true, began),
        EventKind::ContactEnded(ended) => contact(false, ended),
        EventKind::Wakes => Happening::Wakes,
        EventKind::Stalled => Happening::Stalled,
        EventKind::Parked => Happening::Failed,
        EventKind::Gone => Happening::Gone,
        EventKind::Joined(leader) => Happening::Joined(tag.object(leader)),
        EventKind::Left => Happening::Left,
        EventKind::AttachmentGave => Happening::AttachmentGave,
        EventKind::RateMissed => Happening::RateMissed,
        EventKind::Carved(removed) => Happening::Carved(removed),
        _ => Happening::Rests,
    };
    Event { object, at: event.at, what }
}

pub(super) fn touched(tag: WorldTag, with: ContactPartner) -> Touched {
    match with {
        ContactPartner::Static(number) => Touched::Fixed(number),
        ContactPartner::Agent(id) => Touched::Object(tag.object(id)),
    }
}
