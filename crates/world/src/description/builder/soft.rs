//! Sheets, solids and ropes of a scene built in code.
//!
//! In: measures. Out: a [`SoftSpec`] with the defaults of scene files. Never here: the scene, files.

use super::RATE_DEFAULT_HZ;
use glam::{DQuat, DVec3};
use metachron_geometry::{ContactTraits, Triangles};
use metachron_models::soft::{MaterialLaw, Side, SoftMaterial, SoftShape, SoftSpec};
use std::sync::Arc;

/// Friction, Poisson's ratio and density (kg/m³) of a soft body where it does not say otherwise.
const FRICTION: f64 = 0.3;
const POISSON: f64 = 0.4;
const DENSITY_KG_M3: f64 = 1050.0;
/// Young's modulus of a soft body where it does not say otherwise, Pa: soft tissue.
const YOUNG_PA: f64 = 1e5;

/// A sheet, solid or rope before it is added.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Soft {
    pub(super) spec: SoftSpec,
    /// From the first corner of its shape to its middle, in its own axes, metres.
    half_m: DVec3,
    eps_m: Option<(f64, f64)>,
    pub(super) rate_hz: f64,
}

impl Soft {
    /// A body of this shape, about its middle at the origin, at rest; a rope and a mesh are where their points are.
    #[must_use]
    pub fn new(shape: SoftShape) -> Self {
        let half_m = match shape {
            SoftShape::Sheet { size_m: [x, y], .. } => DVec3::new(0.5 * x, 0.5 * y, 0.0),
            SoftShape::Box { size_m, .. } => 0.5 * size_m,
            _ => DVec3::ZERO,
        };
        let self_contact = !matches!(shape.model(), "solid");
        let material = SoftMaterial {
            young_pa: YOUNG_PA,
            poisson: POISSON,
            density_kg_m3: DENSITY_KG_M3,
            damping_per_s: 0.0,
            damping_s: 0.0,
            law: MaterialLaw::default(),
        };
        let spec = SoftSpec {
            shape,
            nodes: None,
            eps_touched_m: None,
            material,
            position: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            held: Vec::new(),
            friction: FRICTION,
            traits: ContactTraits::NONE,
            gravity: DVec3::ZERO,
            self_contact,
            sleep: true,
        };
        Self { spec, half_m, eps_m: None, rate_hz: RATE_DEFAULT_HZ }
    }

    /// A flat sheet of these lengths along x and y and this thickness, metres, of so many cells along both.
    #[must_use]
    pub fn sheet(size_m: [f64; 2], thickness_m: f64, segments: [u32; 2]) -> Self {
        Self::new(SoftShape::Sheet { size_m, thickness_m, segments })
    }

    /// A box of these lengths, metres, of so many cells along each.
    #[must_use]
    pub fn cuboid(size_m: [f64; 3], segments: [u32; 3]) -> Self {
        Self::new(SoftShape::Box { size_m: size_m.into(), segments })
    }

    /// A ball of this radius, metres, of so many cells across it.
    #[must_use]
    pub fn ball(radius_m: f64, segments: u32) -> Self {
        Self::new(SoftShape::Ball { radius_m, segments })
    }

    /// The volume within a closed surface, in a cage of cells of at most the first of these lengths at the start, which
    /// later stay between both, metres.
    #[must_use]
    pub fn mesh(surface: Arc<Triangles>, range_m: (f64, f64)) -> Self {
        Self::new(SoftShape::Embedded { surface, eps_m: range_m.0, range_m })
    }

    /// A rope along these points, metres, of this radius, in so many equal pieces.
    #[must_use]
    pub fn rope(path_m: &[[f64; 3]], radius_m: f64, segments: u32) -> Self {
        let path_m = path_m.iter().map(|point| DVec3::from_array(*point)).collect();
        Self::new(SoftShape::Rope { path_m, radius_m, segments })
    }

    setters! {
        /// Position of its middle, metres; of a rope or a mesh of the origin of its points.
        at: [f64; 3] => spec.position;
        /// Rotation from its own axes to the world's, about its middle.
        turned: DQuat => spec.rotation;
        /// Velocity at the start, m/s.
        velocity_m_s: [f64; 3] => spec.velocity;
        /// Young's modulus, Pa; its range is in [`MATERIAL`](metachron_models::soft::MATERIAL), as are the next three.
        young_pa: f64 => spec.material.young_pa;
        /// Poisson's ratio.
        poisson: f64 => spec.material.poisson;
        /// Density, kg/m³.
        density_kg_m3: f64 => spec.material.density_kg_m3;
        /// How the stress of a solid follows from its strain.
        law: MaterialLaw => spec.material.law;
        /// The sides that never move; of a rope left is its start and right its end.
        hold: &[Side] => spec.held;
        /// Coulomb friction coefficient of its skin, within [`FRICTION`](metachron_geometry::FRICTION).
        friction: f64 => spec.friction;
        /// Whether it touches itself; by default sheets and ropes do.
        self_contact: bool => spec.self_contact;
        /// Where something touches it, cells of its cage longer than this are halved, metres.
        eps_touched_m: f64 => spec.eps_touched_m;
        /// Its contact traits.
        contact: ContactTraits => spec.traits;
        /// Steps a simulated second, 1 … 100000.
        rate_hz: f64 => rate_hz;
    }

    /// Damping of its motion, 1/s, and of its strains, s.
    #[must_use]
    pub const fn damping(mut self, per_s: f64, of_strain_s: f64) -> Self {
        (self.spec.material.damping_per_s, self.spec.material.damping_s) = (per_s, of_strain_s);
        self
    }

    /// The finest and the coarsest spacing of its nodes, metres, instead of a fixed number of cells: it begins with the finest.
    #[must_use]
    pub const fn eps_m(mut self, range_m: (f64, f64)) -> Self {
        self.eps_m = Some(range_m);
        self
    }

    /// The body, and the spacings that it may take; `None` where its finest is too fine for its size.
    pub(super) fn spec(self, gravity: DVec3) -> Option<(SoftSpec, Option<(f64, f64)>)> {
        let Self { spec, half_m, eps_m, .. } = self;
        let position = spec.position - spec.rotation * half_m;
        let spec = SoftSpec { position, gravity, ..spec };
        let Some(range_m) = eps_m else {
            let own = spec.spacing().map(|spacing| spacing.range_m);
            return Some((spec, own));
        };
        Some((spec.spaced(range_m)?, Some(range_m)))
    }
}
