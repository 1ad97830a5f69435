//! Cache of per-form geometry: fields of solids, the solids that make up a tool, skins where they are.
//!
//! In: forms at their places. Out: fields and parts in their own axes, and skins in the world's. Never here: contacts.

use super::skins::skin_tree::SkinCache;
use crate::solids::signed_distance::{Ball, Field};
use crate::{Aabb, PlacedShape, ShapeKind, ShapePose, SolidShape};
use crate::{CompoundPart, Primitive, ShapeError, Solid, ToolPart, ToolShape, is_closed, mesh_triangles};
use glam::DVec3;
use rapier3d::parry::shape::SharedShape;
use std::sync::Arc;

/// How many parts a tool has.
const TOOL_PARTS: usize = 6;
/// The level of the jaw's mesh whose hull touches: past it the hull grows by less than a hundredth of the jaw's thickness.
const JAW_LEVEL: u8 = 2;

/// The cached geometry of forms; it grows with the number of different ones.
#[derive(Default)]
pub(super) struct ShapeCache {
    fields: Vec<(Solid, Option<Field>)>,
    hulls: Vec<(Solid, Option<SharedShape>)>,
    compounds: Vec<CompoundShapes>,
    tools: Vec<(ToolShape, Option<[ToolSolid; TOOL_PARTS]>)>,
    /// Skins where they were last.
    pub skins: SkinCache,
}

/// The shapes of the parts of a compound, `None` of a part that has none.
struct CompoundShapes {
    parts: Arc<[CompoundPart]>,
    shapes: Box<[Option<PartShape>]>,
}

/// The shape of a part of a compound, and how far it reaches from its own origin, metres.
pub(super) struct PartShape {
    pub shape: SharedShape,
    pub radius_m: f64,
}

/// A part of a tool as a solid.
pub(super) struct ToolSolid {
    pub field: Field,
    pub shape: SharedShape,
    /// A ball around it, in its axes.
    pub around: Ball,
}

impl ShapeCache {
    /// Caches the data that a search between `a` and `b` needs.
    pub fn prepare(&mut self, a: &PlacedShape<'_>, b: &PlacedShape<'_>) {
        for (placed, other) in [(a, b), (b, a)] {
            match &placed.form.kind {
                ShapeKind::Solid(SolidShape { solid: Solid::Compound { parts }, .. }) => {
                    parts.iter().for_each(|part| self.prepare_solid(&part.solid));
                    self.prepare_pieces(placed);
                }
                ShapeKind::Solid(SolidShape { solid, .. }) if is_strand(&other.form.kind) => self.prepare_solid(solid),
                _ => self.prepare_pieces(placed),
            }
        }
    }

    /// Caches the data that the pieces of a form need where its own field is not asked.
    pub fn prepare_pieces(&mut self, placed: &PlacedShape<'_>) {
        match (&placed.form.kind, placed.view) {
            (ShapeKind::Solid(SolidShape { solid: Solid::Compound { parts }, .. }), _) => {
                self.prepare_compound(parts);
            }
            (ShapeKind::Solid(SolidShape { solid, shape, .. }), _) if shape.as_trimesh().is_some() => {
                self.prepare_hull(solid)
            }
            (ShapeKind::Tool(shape), _) => self.prepare_tool(shape),
            (ShapeKind::Surface(form), ShapePose::Surface(positions)) => self.skins.prepare(form, positions),
            _ => {}
        }
    }

    fn prepare_solid(&mut self, solid: &Solid) {
        let is_new = !self.fields.iter().any(|(known, _)| is_same(known, solid));
        if is_new && !matches!(solid, Solid::Ball { .. } | Solid::Capsule { .. }) {
            self.fields.push((solid.clone(), field(solid).ok()));
        }
    }

    fn prepare_hull(&mut self, solid: &Solid) {
        if let Solid::Mesh { points_m, .. } = solid
            && !self.hulls.iter().any(|(known, _)| is_same(known, solid))
        {
            let hull = Solid::Hull { points_m: points_m.clone() }.to_shared_shape().ok();
            self.hulls.push((solid.clone(), hull));
        }
    }

    fn prepare_compound(&mut self, parts: &Arc<[CompoundPart]>) {
        if self.compound(parts).is_none() {
            let shape = |CompoundPart { solid, .. }: &CompoundPart| {
                Some(PartShape { shape: solid.to_moving_shape().ok()?, radius_m: solid.radius_about_m(DVec3::ZERO) })
            };
            self.compounds.push(CompoundShapes { parts: Arc::clone(parts), shapes: parts.iter().map(shape).collect() });
        }
    }

    fn prepare_tool(&mut self, shape: &ToolShape) {
        if !self.tools.iter().any(|(known, _)| known == shape) {
            let solids: Result<Vec<_>, _> = shape.parts(0.0).iter().map(ToolSolid::new).collect();
            self.tools.push((*shape, solids.ok().and_then(|solids| solids.try_into().ok())));
        }
    }

    /// The cached field of a solid.
    pub fn field(&self, solid: &Solid) -> Option<&Field> {
        self.fields.iter().find(|(known, _)| is_same(known, solid))?.1.as_ref()
    }

    /// The shape used for collisions of a solid: its own, or the hull of a mesh that was not divided into convex parts.
    pub fn shape<'a>(&'a self, SolidShape { solid, shape, .. }: &'a SolidShape) -> &'a SharedShape {
        let hull = self.hulls.iter().find(|(known, _)| shape.as_trimesh().is_some() && is_same(known, solid));
        hull.and_then(|(_, hull)| hull.as_ref()).unwrap_or(shape)
    }

    /// The cached shapes of the parts of a compound, `None` of a part that has none.
    pub fn compound(&self, parts: &Arc<[CompoundPart]>) -> Option<&[Option<PartShape>]> {
        Some(&self.compounds.iter().find(|known| Arc::ptr_eq(&known.parts, parts))?.shapes)
    }

    /// The cached solids of a tool.
    pub fn tool(&self, shape: &ToolShape) -> Option<&[ToolSolid]> {
        Some(self.tools.iter().find(|(known, _)| known == shape)?.1.as_ref()?)
    }
}

/// Whether a form consists of points and spans that are looked up in the fields of others.
fn is_strand(kind: &ShapeKind) -> bool {
    let is_round = |solid: &Solid| matches!(solid, Solid::Ball { .. } | Solid::Capsule { .. });
    let round = |solid: &Solid| match solid {
        Solid::Compound { parts } => parts.iter().any(|part| is_round(&part.solid)),
        solid => is_round(solid),
    };
    matches!(kind, ShapeKind::Chain | ShapeKind::Surface(_))
        || matches!(kind, ShapeKind::Solid(SolidShape { solid, .. }) if round(solid))
}

/// The field of a body: an open mesh is represented by its hull, as for its mass.
fn field(solid: &Solid) -> Result<Field, ShapeError> {
    if let Solid::Mesh { points_m, triangles } = solid
        && !is_closed(&mesh_triangles(points_m, triangles)?)
    {
        return Field::of(&Solid::Hull { points_m: points_m.clone() });
    }
    Field::of(solid)
}

/// Whether two solids are the same: meshes and hulls are compared by the address of their points, at the same cost for every size.
fn is_same(a: &Solid, b: &Solid) -> bool {
    match (a, b) {
        (Solid::Hull { points_m: a }, Solid::Hull { points_m: b }) => Arc::ptr_eq(a, b),
        (Solid::Mesh { points_m: a, triangles: s }, Solid::Mesh { points_m: b, triangles: t }) => {
            Arc::ptr_eq(a, b) && Arc::ptr_eq(s, t)
        }
        (Solid::Compound { parts: a }, Solid::Compound { parts: b }) => Arc::ptr_eq(a, b),
        _ => a == b,
    }
}

impl ToolSolid {
    fn new(part: &ToolPart) -> Result<Self, ShapeError> {
        let size = part.size;
        let rim_m = f64::from(size.radius_m);
        let solid = if part.primitive == Primitive::Jaw {
            let mesh = part.primitive.mesh(JAW_LEVEL);
            Solid::Hull { points_m: mesh.vertices.iter().map(|v| (v.core * size.extents).as_dvec3()).collect() }
        } else {
            let (across, along) = (f64::from(size.extents.x), f64::from(size.extents.z));
            Solid::Cylinder { radius_m: across + rim_m, half_height_m: along + rim_m }
        };
        Ok(Self { field: Field::of(&solid)?, shape: solid.to_shared_shape()?, around: around(&solid) })
    }
}

/// A ball around a part of a tool.
fn around(solid: &Solid) -> Ball {
    match solid {
        Solid::Hull { points_m } => {
            let Aabb { low, high } = Aabb::of(points_m);
            let centre = (low + high) * 0.5;
            Ball { centre, radius_m: points_m.iter().map(|p| p.distance(centre)).fold(0.0, f64::max) }
        }
        Solid::Cylinder { radius_m, half_height_m } => {
            Ball { centre: DVec3::ZERO, radius_m: radius_m.hypot(*half_height_m) }
        }
        _ => Ball { centre: DVec3::ZERO, radius_m: f64::INFINITY },
    }
}
