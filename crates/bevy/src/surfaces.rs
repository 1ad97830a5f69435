//! Surfaces of objects as meshes of Bevy.
//!
//! In: shapes and newest states. Out: meshes whose points move; triangles are written again only where they changed.
//! Never here: materials, places of entities.

use super::axes::to_bevy;
use bevy_asset::{Assets, Handle, RenderAssetUsages};
use bevy_ecs::prelude::*;
use bevy_mesh::{Indices, Mesh, Mesh3d, PrimitiveTopology};
use glam::{DQuat, DVec3};
use metachron_core::{Body, RigidState, SimTime, ToolState};
use metachron_export::Surface;
use metachron_world::{Frame, Object, Scene};

/// Gives an entity that [`super::Follows`] an object a [`Mesh3d`] of the object's surface: of a rigid body in its own
/// axes, made once; of tubes, ropes, sheets and solids in the world's axes and of tools in their own, written again
/// whenever they move.
///
/// Where cells are removed or a body divides itself otherwise the triangles are new too. Bevy finds the box of a changed mesh anew by itself.
/// Without `Assets<Mesh>` in the app nothing is made.
#[derive(Debug, Default, Component)]
pub struct SurfaceMesh {
    handle: Option<Handle<Mesh>>,
    drawn: Option<Drawn>,
}

/// The state that a mesh shows.
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

impl SurfaceMesh {
    /// Writes the mesh if the object has moved; the mesh where it is a new one.
    pub(super) fn redraw(
        &mut self,
        frame: &Frame,
        object: Object,
        into: &mut ResMut<'_, Assets<Mesh>>,
    ) -> Option<Mesh3d> {
        let state = frame.state(object).ok()?;
        let now = Drawn { object, state: state.moment() };
        let is_same = |before: Drawn| match state.body {
            Body::Rigid(_) => before.object == object,
            _ => before == now && state.at_rest,
        };
        if self.drawn.is_some_and(is_same) {
            return None;
        }
        let surface = surface(frame, object)?;
        self.drawn = Some(now);
        if let Some(mut mesh) = self.handle.as_ref().and_then(|handle| into.get_mut(handle)) {
            write(&mut mesh, &surface);
            return None;
        }
        let handle = into.add(mesh_of(&surface));
        self.handle = Some(handle.clone());
        Some(Mesh3d(handle))
    }
}

/// The surface of an object in the axes in which it is drawn; `None` for an object without a shape.
fn surface(frame: &Frame, object: Object) -> Option<Surface> {
    let shape = frame.world().agents().of(object.id())?.form()?;
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
