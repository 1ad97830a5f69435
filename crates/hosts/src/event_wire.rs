//! Events on their way to a caller.
//!
//! In: an event of a world. Out: the same event of the world that a caller sees. Never here: which events are wanted.

use glam::DVec3;
use metachron_core::{AgentId, Removed, SimTime};
use metachron_world::{Contact, Event, Happening, Touched, WorldTag};
use std::sync::Arc;

/// An event, with numbers in the place of objects.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct WireEvent {
    object: AgentId,
    name: Arc<str>,
    other: Option<Arc<str>>,
    at: SimTime,
    what: WireHappening,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
enum WireHappening {
    Contact(WireContact),
    Rests,
    Wakes,
    Stalled,
    Failed,
    Gone,
    Joined(AgentId),
    Left,
    AttachmentGave,
    RateMissed,
    Carved(Removed),
    Rewound,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct WireContact {
    with: WirePartner,
    begins: bool,
    /// `None` where it is not known.
    point_m: Option<DVec3>,
    normal: DVec3,
    force_n: DVec3,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
enum WirePartner {
    Object(AgentId),
    Fixed(u32),
}

impl WireEvent {
    /// `None` for an event of a kind that has no form here.
    pub fn of(event: Event) -> Option<Self> {
        let what = match event.what {
            Happening::Contact(Contact { with, begins, point_m, normal, force_n }) => {
                let with = match with {
                    Touched::Object(object) => WirePartner::Object(object.id()),
                    Touched::Fixed(number) => WirePartner::Fixed(number),
                };
                let point_m = point_m.is_finite().then_some(point_m);
                WireHappening::Contact(WireContact { with, begins, point_m, normal, force_n })
            }
            Happening::Rests => WireHappening::Rests,
            Happening::Wakes => WireHappening::Wakes,
            Happening::Stalled => WireHappening::Stalled,
            Happening::Failed => WireHappening::Failed,
            Happening::Gone => WireHappening::Gone,
            Happening::Joined(leader) => WireHappening::Joined(leader.id()),
            Happening::Left => WireHappening::Left,
            Happening::AttachmentGave => WireHappening::AttachmentGave,
            Happening::RateMissed => WireHappening::RateMissed,
            Happening::Carved(removed) => WireHappening::Carved(removed),
            Happening::Rewound => WireHappening::Rewound,
            _ => return None,
        };
        Some(Self { object: event.object.id(), name: event.name, other: event.other, at: event.at, what })
    }

    /// Whether its numbers can be.
    pub fn is_finite(&self) -> bool {
        match &self.what {
            WireHappening::Contact(contact) => {
                let vectors = [contact.point_m.unwrap_or_default(), contact.normal, contact.force_n];
                vectors.iter().all(|vector| vector.is_finite())
            }
            WireHappening::Carved(removed) => removed.mass_kg.is_finite(),
            _ => true,
        }
    }

    /// The event of the world of `tag`.
    pub fn event(self, tag: WorldTag) -> Event {
        let what = match self.what {
            WireHappening::Contact(WireContact { with, begins, point_m, normal, force_n }) => {
                let with = match with {
                    WirePartner::Object(id) => Touched::Object(tag.object(id)),
                    WirePartner::Fixed(number) => Touched::Fixed(number),
                };
                let point_m = point_m.unwrap_or(DVec3::NAN);
                Happening::Contact(Contact { with, begins, point_m, normal, force_n })
            }
            WireHappening::Rests => Happening::Rests,
            WireHappening::Wakes => Happening::Wakes,
            WireHappening::Stalled => Happening::Stalled,
            WireHappening::Failed => Happening::Failed,
            WireHappening::Gone => Happening::Gone,
            WireHappening::Joined(leader) => Happening::Joined(tag.object(leader)),
            WireHappening::Left => Happening::Left,
            WireHappening::AttachmentGave => Happening::AttachmentGave,
            WireHappening::RateMissed => Happening::RateMissed,
            WireHappening::Carved(removed) => Happening::Carved(removed),
            WireHappening::Rewound => Happening::Rewound,
        };
        Event { object: tag.object(self.object), name: self.name, other: self.other, at: self.at, what }
    }
}
