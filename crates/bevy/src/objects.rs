//! Entities and objects: which entity brought an object into the world, and which one follows which.
//!
//! In: components. Out: objects that join and leave, transforms of a frame. Never here: the points of meshes, time.

use super::MetachronWorld;
use super::axes::{rotation_to_bevy, to_bevy};
use super::drag::take_back;
use super::messages::{Refused, refuse};
use super::surfaces::SurfaceMesh;
use bevy_asset::Assets;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_mesh::Mesh;
use bevy_transform::components::Transform;
use metachron_core::Body;
use metachron_world::{Frame, Object, Part, WorldError};
use std::collections::HashMap;

/// An object that joins the world with this entity, and leaves it with this component: when the entity is despawned, or the component removed
/// or put anew.
///
/// The part says where it begins, in metachron's axes ([`super::to_metachron`]). The entity [`Follows`] it from the frame on in which it was
/// spawned. Where it cannot join a message [`Refused`] says why.
#[derive(Debug, Component)]
#[component(on_discard = leave)]
pub struct Simulated {
    part: Part,
    name: Option<String>,
    object: Option<Object>,
}

impl Simulated {
    /// A rigid body, a tube, a soft body or an agent of your own, named after its entity.
    #[must_use]
    pub fn new(part: impl Into<Part>) -> Self {
        Self { part: part.into(), name: None, object: None }
    }

    /// The same under a name, by which [`metachron_world::World::object`] finds it; no other object of the world may have it.
    #[must_use]
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }
}

/// Leads the entity's [`Transform`] by an object: centre of mass and rotation of a rigid body, tip and rotation of a
/// tool. A deformable has no place of its own: its entity stays at the origin, where its [`SurfaceMesh`] is in the
/// world's axes.
///
/// The newest state of the object is led on by its velocities to the world's time, for at most 0.1 s. The scale is left as it is. A parent's
/// transform comes on top: entities that follow have none, or one at the origin. When the object has left the entity stays where it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Component)]
#[component(immutable, on_insert = begin_to_follow, on_discard = cease_to_follow)]
#[require(Transform)]
pub struct Follows(pub Object);

/// The entity that follows an object; of several the last.
#[derive(Debug, Default, Resource)]
pub(super) struct Followers(HashMap<Object, Entity>);

impl Followers {
    pub(super) fn of(&self, object: Object) -> Option<Entity> {
        self.0.get(&object).copied()
    }
}

fn begin_to_follow(mut world: DeferredWorld<'_>, context: HookContext) {
    let followed = world.get::<Follows>(context.entity).map(|follows| follows.0);
    if let (Some(object), Some(mut followers)) = (followed, world.get_resource_mut::<Followers>()) {
        followers.0.insert(object, context.entity);
    }
}

fn cease_to_follow(mut world: DeferredWorld<'_>, context: HookContext) {
    take_back(&world, context.entity);
    let followed = world.get::<Follows>(context.entity).map(|follows| follows.0);
    if let (Some(object), Some(mut followers)) = (followed, world.get_resource_mut::<Followers>())
        && followers.of(object) == Some(context.entity)
    {
        followers.0.remove(&object);
    }
}

fn leave(mut world: DeferredWorld<'_>, context: HookContext) {
    let object = world.get::<Simulated>(context.entity).and_then(|simulated| simulated.object);
    let (Some(object), Some(simulation)) = (object, world.get_resource::<MetachronWorld>()) else { return };
    let removed = simulation.remove(object);
    refuse(&mut world, context.entity, removed);
    world.commands().entity(context.entity).try_remove::<Follows>();
}

/// Takes up the objects of entities that are new.
pub(super) fn join(
    world: Res<'_, MetachronWorld>,
    mut fresh: Query<'_, '_, (Entity, &mut Simulated), Added<Simulated>>,
    mut commands: Commands<'_, '_>,
    mut refused: MessageWriter<'_, Refused>,
) {
    for (entity, mut simulated) in &mut fresh {
        let name = simulated.name.clone().unwrap_or_else(|| entity.to_string());
        match world.add(name, simulated.part.clone()) {
            Ok(object) => {
                simulated.object = Some(object);
                commands.entity(entity).insert(Follows(object));
            }
            Err(error) => drop(refused.write(Refused { entity: Some(entity), error })),
        }
    }
}

/// Leads the entities by their objects, and bends their meshes, all at one moment.
pub(super) fn show(
    world: Res<'_, MetachronWorld>,
    mut meshes: Option<ResMut<'_, Assets<Mesh>>>,
    mut followers: Query<'_, '_, (Entity, &Follows, &mut Transform, Option<&mut SurfaceMesh>)>,
    mut commands: Commands<'_, '_>,
) {
    let frame = world.frame();
    for (entity, follows, mut transform, mesh) in &mut followers {
        // an object that has left stays where it was
        let Ok(place) = place_of(&frame, follows.0) else { continue };
        transform.set_if_neq(place.with_scale(transform.scale));
        if let (Some(mut mesh), Some(meshes)) = (mesh, &mut meshes)
            && let Some(fresh) = mesh.redraw(&frame, follows.0, meshes)
        {
            commands.entity(entity).insert(fresh);
        }
    }
}

/// Where the axes are in which an object is drawn.
fn place_of(frame: &Frame, object: Object) -> Result<Transform, WorldError> {
    if !matches!(frame.state(object)?.body, Body::Rigid(_) | Body::Tool(_)) {
        return Ok(Transform::IDENTITY);
    }
    Ok(match frame.body(object)? {
        Body::Rigid(rigid) => {
            Transform::from_translation(to_bevy(rigid.position)).with_rotation(rotation_to_bevy(rigid.rotation))
        }
        Body::Tool(tool) => {
            Transform::from_translation(to_bevy(tool.tip)).with_rotation(rotation_to_bevy(tool.rotation))
        }
        Body::Nothing | Body::Curve(_) | Body::Soft(_) => Transform::IDENTITY,
    })
}
