//! Surfaces of objects as meshes of Bevy.
//!
//! In: shapes and newest states. Out: meshes whose points move; triangles are written again only where they changed.
//! Never here: materials, places of entities.

use super::MetachronWorld;
use super::axes::to_bevy;
use super::objects::Follows;
use bevy_asset::{Assets, Handle, RenderAssetUsages};
use bevy_ecs::prelude::*;
use bevy_mesh::{Indices, Mesh, Mesh3d, PrimitiveTopology};
use glam::{DQuat, DVec3};
use metachron_core::{Body, RigidState, SimTime, ToolState};
use metachron_export::Surface;
use metachron_world::{Frame, Object, Scene};

/// Gives an entity that [`Follows`] an object a [`Mesh3d`] of the object's surface: that of a rigid body in its own axes, made once; those of
/// tubes, ropes, sheets and solids in the world's axes and those of tools in their own, written again whenever they move.
///
/// Where cells are removed or a body divides itself otherwise the triangles are new too. Bevy finds the box of a changed mesh anew by itself.
/// Without `Assets<Mesh>` in the app nothing is made.
#[derive(Debug, Default, Component)]
pub struct SurfaceMesh {
    handle: Option<Handle<Mesh>>,
    drawn: Option<Drawn>,
}

/// What a mesh shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Drawn {
    object: Object,
    state: SimTime,
}

/// The solids of a scene that never move as one mesh, for an entity at the origin; a plane is a square of 4 m.
#[must_use]
pub fn fixed_mesh(scene: &Scene) -> Mesh {
    mesh_of(&Surface::fixed(scene))
}

fn mesh_of(surface: &Surface) -> Mesh {
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    write(&mut mesh, surface);
    mesh
}

/// Writes the meshes of all that has moved.
pub(super) fn redraw(
    world: Res<'_, MetachronWorld>,
    meshes: Option<ResMut<'_, Assets<Mesh>>>,
    mut drawn: Query<'_, '_, (Entity, &Follows, &mut SurfaceMesh)>,
    mut commands: Commands<'_, '_>,
) {
    let Some(mut meshes) = meshes else { return };
    let frame = world.frame();
    for (entity, follows, mut of) in &mut drawn {
        let object = follows.0;
        let Ok(state) = frame.state(object) else { continue };
        let now = Drawn { object, state: state.moment() };
        let is_still = matches!(state.body, Body::Rigid(_)) || (state.at_rest && of.drawn == Some(now));
        if is_still && of.drawn.is_some_and(|before| before.object == object) {
            continue;
        }
        let Some(surface) = surface(&world, &frame, object) else { continue };
        of.drawn = Some(now);
        if let Some(mut mesh) = of.handle.as_ref().and_then(|handle| meshes.get_mut(handle)) {
            write(&mut mesh, &surface);
            continue;
        }
        let handle = meshes.add(mesh_of(&surface));
        commands.entity(entity).insert(Mesh3d(handle.clone()));
        of.handle = Some(handle);
    }
}

/// The surface of an object in the axes in which it is drawn; `None` for what has no shape.
fn surface(world: &MetachronWorld, frame: &Frame, object: Object) -> Option<Surface> {
    let shape = world.agents().of(object.id())?.form()?;
    let body = match frame.body(object).ok()? {
        Body::Rigid(_) => Body::Rigid(RigidState::default()),
        Body::Tool(tool) => Body::Tool(ToolState { tip: DVec3::ZERO, rotation: DQuat::IDENTITY, ..tool }),
        bends => bends,
    };
    Some(Surface::of(&shape.kind, &body))
}

fn write(mesh: &mut Mesh, surface: &Surface) {
    let corners = || surface.triangles.iter().flatten();
    let is_known = matches!(mesh.indices(), Some(Indices::U32(known)) if known.iter().eq(corners()));
    if !is_known {
        mesh.insert_indices(Indices::U32(corners().copied().collect()));
    }
    let positions: Vec<_> = surface.points.iter().map(|point| to_bevy(*point).to_array()).collect();
    mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
    mesh.compute_smooth_normals();
}
