//! Springs that drag objects: one an entity, by hand or by a pointer's ray.
//!
//! In: components and messages in Bevy's axes. Out: commands to the objects. Never here: windows, cameras, buttons.

use super::MetachronWorld;
use super::axes::{to_bevy, to_metachron};
use super::messages::Refused;
use super::objects::{Followers, Follows};
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_math::Vec3;
use bevy_shape::Ray3d;
use metachron_core::Anchor;
use metachron_world::{Command, Touched, WorldError};

/// The key of the springs of drags: springs of a program's own commands have the others, 0 … 6.
const KEY: u32 = 7;
/// How far a pointer reaches, metres.
const REACH_M: f64 = 1e4;

/// How strongly a spring pulls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// N/m, > 0: m ω² leads a mass m with the angular frequency ω, 10 rad/s for a hand.
    pub stiffness_n_m: f64,
    /// N·s/m, ≥ 0: 2 m ω lets it come to rest without swinging.
    pub damping_n_s_m: f64,
}

/// Pulls the object that the entity [`Follows`] at a point, for as long as the entity has it. Kinematic bodies and synthetic agents refuse it
/// ([`Refused`]), and the component is removed again.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
#[component(on_remove = let_go)]
pub struct Drag {
    /// The point of the object.
    pub at: Anchor,
    /// Where it is pulled to, metres, Bevy's axes.
    pub to: Vec3,
    /// How strongly.
    pub spring: Spring,
}

/// A pointer that drags the nearest object that its ray meets, where it is pressed: the object gets a [`Drag`] if an
/// entity follows it.
#[derive(Debug, Clone, Copy, PartialEq, Message)]
pub enum PointerDrag {
    /// The pointer was pressed.
    Press {
        /// From the eye through the pointer: `Camera::viewport_to_world`.
        ray: Ray3d,
        /// How strongly it pulls.
        spring: Spring,
    },
    /// It has moved: the object that it holds is pulled to the ray, as far from the ray's origin as it was where it was
    /// pressed.
    Move {
        /// The ray now.
        ray: Ray3d,
    },
    /// It was released.
    Release,
}

/// The object that the pointer holds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    entity: Entity,
    distance: f32,
    drag: Drag,
}

fn let_go(world: DeferredWorld<'_>, context: HookContext) {
    take_back(&world, context.entity);
}

/// Takes the spring back that an entity's drag has sent to the object that it follows.
pub(super) fn take_back(world: &DeferredWorld<'_>, entity: Entity) {
    let (Some(drag), Some(follows)) = (world.get::<Drag>(entity).copied(), world.get::<Follows>(entity).copied())
    else {
        return;
    };
    if let Some(simulation) = world.get_resource::<MetachronWorld>() {
        // an object that takes no such command has no such spring
        let _ = simulation.command(follows.0, drag.command().taken_back());
    }
}

impl Drag {
    fn command(&self) -> Command {
        let Spring { stiffness_n_m, damping_n_s_m } = self.spring;
        Command::spring(self.at, to_metachron(self.to), stiffness_n_m, damping_n_s_m).key(KEY)
    }
}

/// Turns the pointer's presses, moves and releases into drags.
pub(super) fn take_pointer(
    world: Res<'_, MetachronWorld>,
    followers: Res<'_, Followers>,
    mut pointer: MessageReader<'_, '_, PointerDrag>,
    mut held: Local<'_, Option<Held>>,
    mut commands: Commands<'_, '_>,
) {
    for message in pointer.read() {
        match *message {
            PointerDrag::Press { ray, spring } => {
                release(&mut held, &mut commands);
                *held = seize(&world, &followers, ray, spring);
            }
            PointerDrag::Move { ray } => {
                if let Some(held) = &mut *held {
                    held.drag.to = ray.get_point(held.distance);
                }
            }
            PointerDrag::Release => release(&mut held, &mut commands),
        }
        if let Some(held) = &*held {
            commands.entity(held.entity).try_insert(held.drag);
        }
    }
}

fn release(held: &mut Option<Held>, commands: &mut Commands<'_, '_>) {
    if let Some(held) = held.take() {
        commands.entity(held.entity).try_remove::<Drag>();
    }
}

/// The object under the pointer, held where the ray meets it.
fn seize(world: &MetachronWorld, followers: &Followers, ray: Ray3d, spring: Spring) -> Option<Held> {
    // a ray of Bevy is finite and has a direction, which is all that a cast asks for
    let hit = world.cast_ray(to_metachron(ray.origin), to_metachron(*ray.direction), REACH_M).ok()??;
    let Touched::Object(object) = hit.what else { return None };
    let at = world.latest(object).ok()?.body.anchor_near(hit.point_m)?;
    let drag = Drag { at, to: to_bevy(hit.point_m), spring };
    Some(Held { entity: followers.of(object)?, distance: hit.distance_m as f32, drag })
}

/// Sends the springs of new and changed drags.
pub(super) fn pull(
    world: Res<'_, MetachronWorld>,
    drags: Query<'_, '_, (Entity, Ref<'_, Follows>, Ref<'_, Drag>)>,
    mut commands: Commands<'_, '_>,
    mut refused: MessageWriter<'_, Refused>,
) {
    let is_news =
        |(_, follows, drag): &(Entity, Ref<'_, Follows>, Ref<'_, Drag>)| follows.is_changed() || drag.is_changed();
    for (entity, follows, drag) in drags.iter().filter(is_news) {
        match world.command(follows.0, drag.command()) {
            Ok(()) | Err(WorldError::Gone { .. }) => {}
            Err(error) => {
                refused.write(Refused { entity: Some(entity), error });
                commands.entity(entity).remove::<Drag>();
            }
        }
    }
}
