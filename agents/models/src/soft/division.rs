//! A soft body as its specification and an ε divide it, with all of its cells.
//!
//! In: a specification. Out: elements between nodes, the skin that others touch, its carrier. Never here: states, cells removed.

use super::carrier::{Carrier, SkinPoints};
use super::fe_mesh::FeMesh;
use super::skin::Skin;
use super::spec::{SoftError, SoftSpec};
use glam::DVec3;
use metachron_geometry::{CollisionShape, ShapeKind, SurfaceShape};
use std::sync::Arc;

/// A divided body at rest.
pub(super) struct Division {
    pub mesh: FeMesh,
    /// Its skin as others touch it.
    pub surface: SurfaceShape,
    /// The skin on its carrier, where it is not the mesh's own vertices.
    pub skin: Option<Skin>,
}

impl Division {
    /// The body of `spec` with cells of at most `eps_m`, which has no meaning where its shape divides it, halved about some material points.
    ///
    /// # Errors
    /// [`SoftError::FineCage`] where these are too many.
    pub fn of(spec: &SoftSpec, eps_m: f64, halved_m: &[DVec3]) -> Result<Self, SoftError> {
        if spec.spacing().is_none() {
            let mesh = FeMesh::new(&spec.shape, spec);
            return Ok(Self { surface: mesh.surface(), mesh, skin: None });
        }
        let carrier = Carrier::new(spec, eps_m, halved_m).ok_or(SoftError::FineCage { eps_m })?;
        let points = SkinPoints::of(spec);
        let (mesh, surface) = (carrier.mesh(spec), points.surface.clone());
        Ok(Self { mesh, surface, skin: Some(Skin::new(points, carrier)) })
    }
}

/// A skin with its contact traits of `spec`.
pub(super) fn form(spec: &SoftSpec, surface: SurfaceShape) -> Arc<CollisionShape> {
    let form = CollisionShape::new(ShapeKind::Surface(surface), spec.friction);
    Arc::new(CollisionShape { traits: spec.traits, ..form })
}
