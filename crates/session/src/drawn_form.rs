//! How an agent of each model is drawn: its form for the renderer, its triangles for control.
//!
//! In: a [`Spec`]. Out: a [`Form`], counts of triangles. Never here: states, levels, frames.

use metachron_contact::Agent;
use metachron_core::Body;
use metachron_geometry::{Primitive, ShapeKind, Solid, ToolShape, patch};
use metachron_lod::control::PRIMITIVE_LEVELS;
use metachron_models::soft::{SoftBody, SoftShape, SoftSpec};
use metachron_render::{Form, SkinForm, skin_divisions};
use metachron_world::Spec;
use std::collections::BTreeSet;

/// The form of an agent.
pub(super) fn form(spec: &Spec) -> Form {
    match spec {
        Spec::Tube(_) => Form::Tube,
        Spec::Rigid(body) => Form::Solid(body.solid.clone()),
        Spec::Soft(soft) => soft_form(soft),
        Spec::Tool(_) => Form::Tool(ToolShape::default()),
        Spec::Synthetic(_) => Form::Unseen,
    }
}

/// A rope is drawn as a tube, any other soft body as its skin; nothing if it cannot be built, which is reported elsewhere.
fn soft_form(spec: &SoftSpec) -> Form {
    if let SoftShape::Rope { radius_m, .. } = spec.shape {
        return Form::Rope { radius_m };
    }
    let Ok(body) = SoftBody::new(spec.clone()) else { return Form::Unseen };
    match (body.form().as_deref().map(|form| &form.kind), body.start()) {
        (Some(ShapeKind::Surface(skin)), Body::Soft(start)) => {
            Form::Skin(SkinForm::new(skin.clone(), &start.positions))
        }
        _ => Form::Unseen,
    }
}

/// Triangles at every level, for an object that is one mesh per level.
pub(super) fn triangles(spec: &Spec) -> [u32; PRIMITIVE_LEVELS] {
    let of_tool = |n: u8| ToolShape::default().parts(0.0).iter().map(|part| part.primitive.triangles(n)).sum();
    std::array::from_fn(|n| {
        let n = n as u8;
        match spec {
            Spec::Rigid(body) => solid_triangles(&body.solid, n),
            Spec::Tool(_) => of_tool(n),
            Spec::Soft(body) => soft_triangles(&body.shape, n),
            Spec::Tube(_) | Spec::Synthetic(_) => 0,
        }
    })
}

/// Triangles drawn for a soft body at level `n`: a sheet has two faces and a rim, a rope is drawn as a tube.
fn soft_triangles(shape: &SoftShape, n: u8) -> u32 {
    let parts = skin_divisions(n);
    let each = parts * parts;
    match shape {
        SoftShape::Embedded { surface, .. } => surface.triangles.len() as u32 * each,
        SoftShape::Tetrahedra { mesh, .. } => mesh.boundary().len() as u32 * each,
        // both faces, and two for each edge of the rim
        SoftShape::Shell { surface, .. } => {
            let sides = || surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
            let known: BTreeSet<[u32; 2]> = sides().collect();
            let rim = sides().filter(|[a, b]| !known.contains(&[*b, *a])).count() as u32;
            2 * (surface.triangles.len() as u32 * each + rim * parts)
        }
        SoftShape::Sheet { segments: [x, y], .. } => 4 * x * y * each + 4 * (x + y) * parts,
        SoftShape::Box { segments: [x, y, z], .. } => 4 * (x * y + y * z + z * x) * each,
        SoftShape::Ball { segments: n, .. } => 12 * n * n * each,
        SoftShape::Rope { segments, .. } => segments * patch::triangles(n),
    }
}

fn solid_triangles(solid: &Solid, n: u8) -> u32 {
    match (Primitive::of(solid, n), solid) {
        (Some((primitive, _)), _) => primitive.triangles(n),
        (None, Solid::Mesh { triangles, .. }) => triangles.len() as u32,
        // Euler: a closed triangle mesh of p corners has 2p - 4 faces
        (None, Solid::Hull { points_m }) => (2 * points_m.len() as u32).saturating_sub(4),
        (None, _) => 0,
    }
}
