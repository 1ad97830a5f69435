//! Events of the world, as messages of Bevy.
//!
//! In: events of the objects. Out: messages in Bevy's axes, with the entities that follow the objects. Never here:
//! reactions to them.

use super::axes::to_bevy;
use super::objects::Followers;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_math::Vec3;
use metachron_core::SimTime;
use metachron_world::{Events, Happening, Object, Touched, WorldError};

/// A contact that begins or ends: once each, also where both happened since the last frame.
#[derive(Debug, Clone, Copy, PartialEq, Message)]
pub struct ContactMessage {
    /// Whether it begins.
    pub begins: bool,
    /// The object; of two the one with the lower number.
    pub object: Object,
    /// The entity that follows it.
    pub entity: Option<Entity>,
    /// The object or solid that it touches.
    pub with: Touched,
    /// The entity that follows that.
    pub with_entity: Option<Entity>,
    /// When, in the object's time: the end of the step in which it happened.
    pub at: SimTime,
    /// The place that bore most, metres; not a number where that is not known.
    pub point: Vec3,
    /// The normal there, towards the object, of length 1.
    pub normal: Vec3,
    /// The force on the object, N: the greatest in the mean of a step so far.
    pub force_n: Vec3,
}

/// Something else that happened to an object: it rests, wakes, failed, was removed, tore, went back with its world.
#[derive(Debug, Clone, Copy, PartialEq, Message)]
pub struct StateMessage {
    /// The object.
    pub object: Object,
    /// The entity that follows it.
    pub entity: Option<Entity>,
    /// When, in the object's time: the end of the step in which it happened.
    pub at: SimTime,
    /// The event; never [`Happening::Contact`].
    pub what: Happening,
}

/// Something that an entity asked for and the world does not do.
#[derive(Debug, Message)]
pub struct Refused {
    /// The entity; none where the app's time is too slow or too fast for the world.
    pub entity: Option<Entity>,
    /// Why.
    pub error: WorldError,
}

/// The events of the world since the last frame.
#[derive(Debug, Resource)]
pub(super) struct Listener(pub Events);

/// Passes on the events.
pub(super) fn send(
    mut listener: ResMut<'_, Listener>,
    followers: Res<'_, Followers>,
    mut contacts: MessageWriter<'_, ContactMessage>,
    mut states: MessageWriter<'_, StateMessage>,
) {
    for event in listener.0.drain() {
        let (object, at, entity) = (event.object, event.at, followers.of(event.object));
        let Happening::Contact(contact) = event.what else {
            states.write(StateMessage { object, entity, at, what: event.what });
            continue;
        };
        let with_entity = match contact.with {
            Touched::Object(other) => followers.of(other),
            Touched::Fixed(_) => None,
        };
        contacts.write(ContactMessage {
            begins: contact.begins,
            object,
            entity,
            with: contact.with,
            with_entity,
            at,
            point: to_bevy(contact.point_m),
            normal: to_bevy(contact.normal),
            force_n: to_bevy(contact.force_n),
        });
    }
}

/// Says why something that an entity leaves behind could not be undone; of an object that is gone, or in a world that has ended, nothing is left.
pub(super) fn refuse(world: &mut DeferredWorld<'_>, entity: Entity, outcome: Result<(), WorldError>) {
    match outcome {
        Ok(()) | Err(WorldError::Gone { .. } | WorldError::Stopped) => {}
        Err(error) => drop(world.write_message(Refused { entity: Some(entity), error })),
    }
}
