//! Events of a world, in the order of the objects' times.
//!
//! In: the objects' own events. Out: the events that were asked for, once each. Never here: waiting.

use super::object::{Object, Touched, WorldTag};
use crate::world::World;
use glam::DVec3;
use metachron_core::{ContactPartner, Removed, SimTime};
use metachron_runtime::{AgentEvent, AgentHandle, AgentState, ContactEvent, EventKind, StreamReader};
use std::fmt;
use std::sync::Arc;

/// Something that happened; written as a sentence with the names of the objects that took part.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// The object that it happened to; of a contact between two the one with the lower number.
    pub object: Object,
    /// The object's name.
    pub name: Arc<str>,
    /// The name of the object or solid that it touches, or of the leader of the cluster that it joined.
    pub other: Option<Arc<str>>,
    /// When, in its own time: the end of the step in which it happened.
    pub at: SimTime,
    /// The event.
    pub what: Happening,
}

/// The kinds of events.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Happening {
    /// It began to touch something, or ceased to.
    Contact(Contact),
    /// It came to rest.
    Rests,
    /// It moves again after a rest.
    Wakes,
    /// Its step lasts too long: it stands still until that ends ([`Scene::stall_limit`](crate::Scene::stall_limit)). In lockstep a
    /// reader on another thread finds it.
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
    /// The object moves too fast for its steps, and did not in the step before: its motion asked for so many times as many, more than a step may be
    /// divided into (`docs/theory/clusters.md`, section 9).
    UnderResolved(f64),
    /// Cells of it were removed.
    Carved(Removed),
    /// The world went back to a checkpoint ([`World::restore`]), in which the object is: later events happen from its
    /// time there on. Whatever the filter, this comes before all of them; contacts of the object begin there then, as
    /// if they had not been before.
    Rewound,
}

impl Happening {
    /// As programs write it, such as `contact_began`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Contact(contact) if contact.begins => "contact_began",
            Self::Contact(_) => "contact_ended",
            Self::Rests => "rests",
            Self::Wakes => "wakes",
            Self::Stalled => "stalled",
            Self::Failed => "failed",
            Self::Gone => "gone",
            Self::Joined(_) => "joined",
            Self::Left => "left",
            Self::AttachmentGave => "attachment_gave",
            Self::RateMissed => "rate_missed",
            Self::UnderResolved(_) => "under_resolved",
            Self::Carved(_) => "carved",
            Self::Rewound => "rewound",
        }
    }
}

impl Event {
    /// The same in the world of `tag`, whose objects have the same numbers.
    pub(crate) fn of(self, tag: WorldTag) -> Self {
        let with = |touched: Touched| match touched {
            Touched::Object(object) => tag.object(object.id()).into(),
            fixed @ Touched::Fixed(_) => fixed,
        };
        let what = match self.what {
            Happening::Contact(contact) => Happening::Contact(Contact { with: with(contact.with), ..contact }),
            Happening::Joined(leader) => Happening::Joined(tag.object(leader.id())),
            other => other,
        };
        Self { object: tag.object(self.object.id()), what, ..self }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} s: \"{}\" ", self.at.as_secs_f64(), self.name)?;
        let other = self.other.as_deref().unwrap_or_default();
        match self.what {
            Happening::Contact(Contact { begins: true, force_n, .. }) => {
                write!(f, "begins to touch \"{other}\" with {:.3} N", force_n.length())
            }
            Happening::Contact(Contact { force_n, .. }) => {
                write!(f, "no longer touches \"{other}\", at most with {:.3} N", force_n.length())
            }
            Happening::Rests => f.write_str("comes to rest"),
            Happening::Wakes => f.write_str("moves again"),
            Happening::Stalled => f.write_str("is in a step that lasts too long"),
            Happening::Failed => f.write_str("has failed"),
            Happening::Gone => f.write_str("was removed"),
            Happening::Joined(_) => write!(f, "joins the cluster of \"{other}\""),
            Happening::Left => f.write_str("leaves its cluster"),
            Happening::AttachmentGave => f.write_str("has an attachment that gave"),
            Happening::RateMissed => f.write_str("misses its rate"),
            Happening::UnderResolved(times) => write!(f, "moves too fast for its steps, by {times:.1} times"),
            Happening::Carved(removed) => write!(f, "has lost {} cells, {:.3} kg", removed.cells, removed.mass_kg),
            Happening::Rewound => f.write_str("is back at a checkpoint"),
        }
    }
}

/// A contact that begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The object or solid that it touches.
    pub with: Touched,
    /// Whether it begins.
    pub begins: bool,
    /// The place that bore most, metres; not a number where that is not known.
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

    /// Of contacts only the ones of at least so many newtons in the mean of a step. They begin when they press so much:
    /// to a quarter more, or at their end where they never press a quarter more than that.
    #[must_use]
    pub const fn above_n(self, above_n: f64) -> Self {
        Self { above_n, ..self }
    }

    /// Only events of this object.
    #[must_use]
    pub const fn of(self, object: Object) -> Self {
        Self { object: Some(object), ..self }
    }

    /// Whether an event of `object` is wanted.
    fn takes(&self, whose: Object, what: &Happening) -> bool {
        let concerns = |object: Object| self.object.is_none_or(|wanted| wanted == object);
        match what {
            Happening::Contact(contact) => {
                let of_it = matches!(contact.with, Touched::Object(other) if self.object == Some(other));
                self.contacts && (concerns(whose) || of_it)
            }
            Happening::Rewound => concerns(whose),
            _ => self.states && concerns(whose),
        }
    }
}

/// Events of a world from the moment on when it was asked for them.
#[derive(Debug)]
pub struct Events {
    world: World,
    sieve: EventSieve,
    /// By their numbers.
    objects: Vec<ReadObject>,
    lost: u64,
    found: Vec<Found>,
}

/// A filter that sees all events of a world, one after the other.
#[derive(Debug, Clone)]
pub struct EventSieve {
    filter: EventFilter,
    /// Contacts that have begun as the filter sees them.
    begun: Vec<(Object, Touched)>,
}

/// How far an object was heard.
#[derive(Debug)]
struct ReadObject {
    reader: StreamReader,
    /// How often the world had gone back when the last event that was heard happened.
    rewinds: u64,
}

/// An event, and how often the world had gone back when it happened: events before a world went back come first,
/// whatever the time.
#[derive(Debug, Clone)]
struct Found {
    rewinds: u64,
    event: Event,
}

impl Events {
    pub(crate) fn new(world: World, filter: EventFilter) -> Self {
        let rewinds = world.rewinds();
        let objects = world.agents().iter().map(|agent| ReadObject { reader: agent.listen(), rewinds }).collect();
        Self { world, sieve: EventSieve::new(filter), objects, lost: 0, found: Vec::new() }
    }

    /// All events since the last call, by their times; where the world went back meanwhile, the events before that come
    /// first, then [`Happening::Rewound`] of each object. It never waits.
    pub fn drain(&mut self) -> impl Iterator<Item = Event> + '_ {
        self.found.clear();
        // looked up first: where it is counted, all objects have been told of it
        let (world, rewinds) = (self.world.clone(), self.world.rewinds());
        let known = self.objects.len();
        // an object that joined since is heard from its first drain on
        let joined = world.agents().iter().skip(known);
        self.objects.extend(joined.map(|agent| ReadObject { reader: agent.listen(), rewinds }));
        let count = self.objects.len();
        world.agents().iter().take(count).for_each(|agent| self.read(agent, rewinds));
        let rank = |found: &Found| (found.rewinds, found.event.what != Happening::Rewound);
        self.found.sort_by_key(|found| (rank(found), found.event.at, found.event.object));
        self.found.drain(..).map(|found| found.event)
    }

    /// Takes in the events of an object, in a world that has gone back so often by now.
    fn read(&mut self, agent: &AgentHandle, rewinds: u64) {
        let Self { world, sieve, objects, lost, found } = self;
        let ReadObject { reader, rewinds: own } = &mut objects[agent.id().0 as usize];
        let (tag, first) = (world.tag(), found.len());
        let object = tag.object(agent.id());
        let overwritten = agent.read_events(reader, |event| {
            let what = happening(tag, &event);
            *own += u64::from(what == Happening::Rewound);
            if sieve.passes(object, &what) {
                found.push(Found { rewinds: *own, event: named(world, object, event.at, what) });
            }
        });
        *lost += overwritten;
        let missed = rewinds.saturating_sub(*own);
        if missed == 0 {
            return;
        }
        *own = rewinds;
        if agent.state() == AgentState::Gone {
            return;
        }
        // that event was overwritten before all that was heard now, or the object has left before and came back with the world
        let before = if overwritten > 0 { first } else { found.len() };
        found[before..].iter_mut().for_each(|found| found.rewinds += missed);
        sieve.begun.retain(|(whose, _)| *whose != object);
        if sieve.filter.takes(object, &Happening::Rewound) {
            let event = named(world, object, agent.latest().moment(), Happening::Rewound);
            found.push(Found { rewinds, event });
        }
    }

    /// How many events were overwritten before they were drained: an object keeps its newest 128.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost
    }
}

impl EventSieve {
    /// A sieve that has seen no event.
    #[must_use]
    pub const fn new(filter: EventFilter) -> Self {
        Self { filter, begun: Vec::new() }
    }

    /// Whether an event is news under the filter: one that has a least force sees contacts begin and end at that force.
    pub fn passes(&mut self, object: Object, what: &Happening) -> bool {
        let Self { filter, begun } = self;
        if matches!(what, Happening::Rewound | Happening::Gone) {
            begun.retain(|(whose, _)| *whose != object);
        }
        if !filter.takes(object, what) {
            return false;
        }
        let Happening::Contact(contact) = what else { return true };
        let name = (object, contact.with);
        let known = begun.iter().position(|begun| *begun == name);
        let loud = contact.force_n.length() >= filter.above_n;
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
}

/// An event, with the names of the objects that took part.
fn named(world: &World, object: Object, at: SimTime, what: Happening) -> Event {
    let name = |of: Touched| Arc::from(world.name(of).unwrap_or_default());
    let other = match what {
        Happening::Contact(contact) => Some(name(contact.with)),
        Happening::Joined(leader) => Some(name(leader.into())),
        _ => None,
    };
    Event { object, name: name(object.into()), other, at, what }
}

fn happening(tag: WorldTag, event: &AgentEvent) -> Happening {
    let contact = |begins: bool, contact: ContactEvent| {
        let ContactEvent { with, point_m, normal, force_n } = contact;
        Happening::Contact(Contact { with: touched(tag, with), begins, point_m, normal, force_n })
    };
    match event.kind {
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
        EventKind::UnderResolved(times) => Happening::UnderResolved(times),
        EventKind::Carved(removed) => Happening::Carved(removed),
        EventKind::Rewound => Happening::Rewound,
        _ => Happening::Rests,
    }
}

pub(super) fn touched(tag: WorldTag, with: ContactPartner) -> Touched {
    match with {
        ContactPartner::Static(number) => Touched::Fixed(number),
        ContactPartner::Agent(id) => Touched::Object(tag.object(id)),
    }
}
