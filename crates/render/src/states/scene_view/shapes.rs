//! Bounds and sizes of visible objects: balls and boxes about poses, the meshes of solids, models that copies share.
//!
//! In: solids, models, points. Out: bounds, sizes, indices of meshes. Never here: states of agents.

use super::{Appearance, StaticObject};
use glam::{DQuat, DVec3};
use metachron_drawable::{Extent, Model, Placement};
use metachron_geometry::{Aabb, Obstacle, PrimitiveMesh, Solid};
use metachron_geometry::{compound_mesh, creased_mesh, hull_mesh};

/// Width added around static solids in tests of visibility, metres.
const RIM_M: f64 = 1e-3;

/// A static solid with its drawing data.
#[derive(Debug)]
pub(crate) struct StaticShape {
    pub solid: Solid,
    pub appearance: Appearance,
    pub position: DVec3,
    pub rotation: DQuat,
    pub body: BodyShape,
    pub throws_shadow: bool,
    /// Whether the camera may see it.
    pub seen: bool,
}

/// The mesh of a solid that is not a primitive, and the size of any solid.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BodyShape {
    /// Index among the given meshes, or of scenery among the models.
    pub mesh_index: Option<u32>,
    /// Centre of a bounding ball, from the origin in body axes, metres.
    pub middle_m: DVec3,
    /// Radius of that ball, metres.
    pub radius_m: f64,
    /// A quarter of its surface, m²: the mean projected area over all view directions (Cauchy), exact for convex bodies.
    pub mean_area_m2: f64,
}

/// A bounding ball and box.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bounds {
    pub centre: DVec3,
    pub radius_m: f64,
    /// Half extents of the axis-aligned bounding box about the centre, metres.
    pub half_m: DVec3,
}

impl Bounds {
    pub(super) fn ball(centre: DVec3, radius_m: f64) -> Self {
        Self { centre, radius_m, half_m: DVec3::splat(radius_m) }
    }

    /// Bounds of a box; of nothing where it is empty.
    pub(super) fn within(Aabb { low, high }: Aabb) -> Self {
        if high.cmplt(low).any() {
            return Self::default();
        }
        Self { centre: 0.5 * (low + high), radius_m: 0.5 * low.distance(high), half_m: 0.5 * (high - low) }
    }

    /// Bounds of points, with a skin of this thickness.
    pub(super) fn of(points: &[DVec3], skin_m: f64) -> Self {
        let corners = points.iter().copied().reduce(DVec3::min).zip(points.iter().copied().reduce(DVec3::max));
        let Some((low, high)) = corners else { return Self::default() };
        let radius_m = 0.5 * low.distance(high) + skin_m;
        Self { centre: 0.5 * (low + high), radius_m, half_m: 0.5 * (high - low) + skin_m }
    }
}

impl StaticShape {
    pub(super) fn new(prop: StaticObject, meshes: &mut Vec<PrimitiveMesh>) -> Self {
        let Obstacle { solid, position, rotation, .. } = prop.obstacle;
        let body = BodyShape::of(&solid, meshes);
        let StaticObject { appearance, throws_shadow, .. } = prop;
        Self { solid, appearance, position, rotation, body, throws_shadow, seen: true }
    }

    /// A bounding ball and box, with a rim: a solid that touches a side of a cell may be that side, and is seen from
    /// beyond it too.
    pub fn bounds(&self) -> Bounds {
        let half_m = self.half_extents() + RIM_M;
        Bounds { centre: self.position, radius_m: self.body.radius_m + 2.0 * RIM_M, half_m }
    }

    /// Half extents of the axis-aligned bounding box about its position, metres.
    pub fn half_extents(&self) -> DVec3 {
        match self.solid {
            Solid::Box { half_extents_m: h } => {
                let axes = glam::DMat3::from_quat(self.rotation);
                axes.x_axis.abs() * h.x + axes.y_axis.abs() * h.y + axes.z_axis.abs() * h.z
            }
            _ => DVec3::splat(self.body.radius_m),
        }
    }
}

/// Every model once, with its extent, shared by its copies.
#[derive(Default)]
pub(crate) struct Models(pub(super) Vec<(Model, Extent)>);

impl Models {
    pub(super) fn body(&mut self, model: &Model, at: &Placement) -> BodyShape {
        let number = self.0.iter().position(|(known, _)| known.is(model)).unwrap_or_else(|| {
            self.0.push((model.clone(), model.extent()));
            self.0.len() - 1
        });
        let extent = self.0[number].1;
        BodyShape {
            mesh_index: Some(number as u32),
            middle_m: extent.centre * at.scale,
            radius_m: extent.radius * at.scale,
            mean_area_m2: 0.25 * extent.area * at.scale * at.scale,
        }
    }
}

impl BodyShape {
    /// The same body, so many times as large.
    pub fn scaled(self, scale: f64) -> Self {
        Self {
            middle_m: scale * self.middle_m,
            radius_m: scale * self.radius_m,
            mean_area_m2: scale * scale * self.mean_area_m2,
            ..self
        }
    }

    pub(super) fn of(solid: &Solid, meshes: &mut Vec<PrimitiveMesh>) -> Self {
        use std::f64::consts::PI;
        let mesh_index = |mesh: PrimitiveMesh, meshes: &mut Vec<PrimitiveMesh>| {
            let far = mesh.vertices.iter().map(|v| v.core.as_dvec3().length()).fold(0.0, f64::max);
            let area: f64 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| mesh.vertices[i as usize].core.as_dvec3());
                    0.5 * (b - a).cross(c - a).length()
                })
                .sum();
            meshes.push(mesh);
            let mesh_index = Some(meshes.len() as u32 - 1);
            Self { mesh_index, radius_m: far, mean_area_m2: 0.25 * area, ..Self::default() }
        };
        let plain = |radius_m: f64, area: f64| Self { radius_m, mean_area_m2: 0.25 * area, ..Self::default() };
        match solid {
            Solid::Ball { radius_m: r } => plain(*r, 4.0 * PI * r * r),
            Solid::Box { half_extents_m: h } => plain(h.length(), 8.0 * (h.x * h.y + h.y * h.z + h.z * h.x)),
            Solid::Capsule { radius_m: r, half_height_m: h } => plain(r + h, 4.0 * PI * r * (r + h)),
            Solid::Cylinder { radius_m: r, half_height_m: h } => {
                plain((r * r + h * h).sqrt(), 2.0 * PI * r * (r + 2.0 * h))
            }
            Solid::Plane => Self::default(),
            Solid::Hull { points_m } => hull_mesh(points_m).map_or_else(Self::default, |mesh| mesh_index(mesh, meshes)),
            Solid::Compound { parts } => mesh_index(compound_mesh(parts), meshes),
            Solid::Mesh { points_m, triangles } => mesh_index(creased_mesh(points_m, triangles), meshes),
        }
    }
}
