//! How an agent of each model is drawn: its form for the renderer, its triangles for control.
//!
//! In: a [`Spec`]. Out: a [`Form`], counts of triangles. Never here: states, levels, frames.

use metachron_contact::Agent;
use metachron_core::Body;
use metachron_geometry::{Primitive, ShapeKind, Solid, ToolShape, compound_mesh, patch};
use metachron_lod::control::PRIMITIVE_LEVELS;
use metachron_models::soft::{SoftBody, SoftShape, SoftSpec};
use metachron_render::{Form, SkinForm, skin_divisions};
use metachron_world::Spec;
use std::collections::BTreeSet;

/// The form of an agent.
pub(super) fn form(spec: &Spec) -> Form {
    match spec {
        Spec::Tube(_) => Form::Tube,
        // a state has the centre of mass
        Spec::Rigid(body) => Form::Solid(body.solid.shifted(-body.com_local())),
        Spec::Soft(soft) => soft_form(soft),
        Spec::Tool(_) => Form::Tool(ToolShape::default()),
        Spec::Synthetic(_) | Spec::Custom(_) => Form::Unseen,
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
    let skin = if let Spec::Soft(body) = spec { Some(SkinCounts::of(&body.shape)) } else { None };
    std::array::from_fn(|n| {
        let n = n as u8;
        match spec {
            Spec::Rigid(body) => solid_triangles(&body.solid, n),
            Spec::Tool(_) => of_tool(n),
            Spec::Soft(body) => match body.shape {
                SoftShape::Rope { segments, .. } => segments * patch::triangles(n),
                _ => skin.map_or(0, |skin| skin.at(n)),
            },
            Spec::Tube(_) | Spec::Synthetic(_) | Spec::Custom(_) => 0,
        }
    })
}

/// The triangles of a skin as it is, of both faces where it is open, and the edges of its rim.
#[derive(Debug, Clone, Copy)]
struct SkinCounts {
    triangles: u32,
    rim: u32,
}

impl SkinCounts {
    fn of(shape: &SoftShape) -> Self {
        let closed = |triangles: u32| Self { triangles, rim: 0 };
        match shape {
            SoftShape::Embedded { surface, .. } => closed(surface.triangles.len() as u32),
            SoftShape::Tetrahedra { mesh, .. } => closed(mesh.boundary().len() as u32),
            SoftShape::Shell { surface, .. } => {
                let sides = || surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
                let known: BTreeSet<[u32; 2]> = sides().collect();
                let rim = sides().filter(|[a, b]| !known.contains(&[*b, *a])).count() as u32;
                Self { triangles: 2 * surface.triangles.len() as u32, rim }
            }
            SoftShape::Sheet { segments: [x, y], .. } => Self { triangles: 4 * x * y, rim: 2 * (x + y) },
            SoftShape::Box { segments: [x, y, z], .. } => closed(4 * (x * y + y * z + z * x)),
            SoftShape::Ball { segments: n, .. } => closed(12 * n * n),
            SoftShape::Rope { .. } => closed(0), // it is drawn as a tube
        }
    }

    /// Triangles drawn at level `n`; a part of the rim has two.
    fn at(self, n: u8) -> u32 {
        let parts = skin_divisions(n);
        self.triangles * parts * parts + 2 * self.rim * parts
    }
}

fn solid_triangles(solid: &Solid, n: u8) -> u32 {
    match (Primitive::of(solid, n), solid) {
        (Some((primitive, _)), _) => primitive.triangles(n),
        (None, Solid::Mesh { triangles, .. }) => triangles.len() as u32,
        (None, Solid::Compound { parts }) => compound_mesh(parts).triangles.len() as u32,
        // Euler: a closed triangle mesh of p corners has 2p - 4 faces
        (None, Solid::Hull { points_m }) => (2 * points_m.len() as u32).saturating_sub(4),
        (None, _) => 0,
    }
}
