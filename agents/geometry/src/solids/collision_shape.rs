//! The shape of an agent as others need it for contact, and its placement.
//!
//! In: solids, tubes, tools, soft surfaces. Out: [`CollisionShape`]s, which never change and are shared, and [`PlacedShape`] ones.
//! Never here: how the nearest points are found ([`crate::narrow_phase`]).

use crate::narrow_phase::{TouchKey, VoronoiRegions};
use crate::{Aabb, CombineRule, ContactTraits, ShapeError, Solid, ToolShape};
use glam::{DQuat, DVec3};
use rapier3d::parry::shape::SharedShape;
use std::sync::Arc;

/// An agent's shape and skin.
#[derive(Debug, Clone)]
pub struct CollisionShape {
    /// Its shape.
    pub kind: ShapeKind,
    /// Coulomb friction coefficient, ≥ 0; a pair takes the geometric mean, where neither side's traits say otherwise.
    pub friction: f64,
    /// Coefficient of restitution, 0 … 1; a pair takes the larger, where neither side's traits say otherwise.
    pub restitution: f64,
    /// Its groups, combine rules, spin friction, and whether it is a sensor.
    pub traits: ContactTraits,
}

impl CollisionShape {
    /// A shape of this friction that does not rebound, with the traits of most.
    #[must_use]
    pub fn new(kind: ShapeKind, friction: f64) -> Self {
        Self { kind, friction, restitution: 0.0, traits: ContactTraits::default() }
    }

    /// Whether it is the skin of a body with cells: of a sheet or a solid.
    #[must_use]
    pub fn has_cells(&self) -> bool {
        matches!(&self.kind, ShapeKind::Surface(surface) if !surface.triangles.is_empty())
    }

    /// Whether the two collide or sense each other where they meet.
    #[must_use]
    pub const fn meets(&self, other: &Self) -> bool {
        self.traits.groups.meet(other.traits.groups)
    }

    /// Whether the two only sense each other: no force acts between them.
    #[must_use]
    pub const fn senses(&self, other: &Self) -> bool {
        self.traits.is_sensor || other.traits.is_sensor
    }

    /// Whether contacts of the two give forces.
    #[must_use]
    pub const fn presses(&self, other: &Self) -> bool {
        self.meets(other) && !self.senses(other)
    }

    /// Coulomb's coefficient of the two (contact.md, eq. 13).
    #[must_use]
    pub fn friction_with(&self, other: &Self) -> f64 {
        let rules = [self.traits.friction_rule, other.traits.friction_rule];
        CombineRule::of_pair(rules, CombineRule::GeometricMean).combine([self.friction, other.friction])
    }

    /// The radius of the patch by which the two resist spin about the normals of their contacts, metres (contact.md, eq. 13).
    #[must_use]
    pub const fn spin_radius_with_m(&self, other: &Self) -> f64 {
        self.traits.spin_radius_m.max(other.traits.spin_radius_m)
    }

    /// The coefficient of restitution of the two (contact.md, eq. 13): 0 for deformables, which give back what they
    /// have stored.
    #[must_use]
    pub fn restitution_with(&self, other: &Self) -> f64 {
        if [self, other].iter().any(|side| matches!(side.kind, ShapeKind::Chain | ShapeKind::Surface(_))) {
            return 0.0;
        }
        let rules = [self.traits.restitution_rule, other.traits.restitution_rule];
        CombineRule::of_pair(rules, CombineRule::Max).combine([self.restitution, other.restitution])
    }
}

/// The kinds of shapes.
#[derive(Debug, Clone)]
pub enum ShapeKind {
    /// A rigid solid.
    Solid(SolidShape),
    /// A tube: cone-capsules between nodes, at its own radius.
    Chain,
    /// A tool: the placement of its parts depends on the jaw opening.
    Tool(ToolShape),
    /// The skin of a soft body: triangles and edges between vertices that move.
    Surface(SurfaceShape),
}

/// The topology of a soft body's skin; where matter is taken out of the body, it is another one between the same vertices.
#[derive(Debug, Clone)]
pub struct SurfaceShape {
    /// The vertices of the skin, by rising numbers.
    pub vertices: Arc<[u32]>,
    /// Pairs of vertices of the skin.
    pub edges: Arc<[[u32; 2]]>,
    /// Vertices of each triangle, counter-clockwise seen from outside where the skin is closed; none for a rope.
    pub triangles: Arc<[[u32; 3]]>,
    /// How thick the skin is about its vertices, metres, ≥ 0: half a sheet's thickness, a rope's radius.
    pub radius_m: f64,
    /// Mean length of its edges at rest, metres.
    pub edge_m: f64,
    /// Whether it encloses a volume: then nothing may be behind a triangle.
    pub closed: bool,
    /// The neighbours of each vertex and edge.
    pub fans: Arc<VoronoiRegions>,
}

/// A solid as others touch it.
#[derive(Clone)]
pub struct SolidShape {
    /// The solid.
    pub solid: Solid,
    /// The same for collision queries.
    pub shape: SharedShape,
    /// Its centre of mass in its own axes, metres.
    pub com_local: DVec3,
    /// No point is farther from the centre of mass, metres.
    pub radius_m: f64,
}

/// Placement of a form.
#[derive(Debug, Clone, Copy)]
pub enum ShapePose<'a> {
    /// A solid: its centre of mass and its rotation.
    Solid {
        /// Centre of mass, metres.
        position: DVec3,
        /// From the shape's axes to the world's.
        rotation: DQuat,
    },
    /// A tube: N + 1 nodes.
    Chain {
        /// Node positions, metres.
        positions: &'a [DVec3],
        /// Outer radius at each node, metres.
        radii_m: &'a [f64],
    },
    /// A tool.
    Tool {
        /// The point between the jaws, metres.
        tip: DVec3,
        /// From the tool's axes to the world's.
        rotation: DQuat,
        /// Opening, 0 … 1.
        jaw: f64,
    },
    /// A soft body: where its vertices are, metres.
    Surface(&'a [DVec3]),
}

/// A form at its place.
#[derive(Debug, Clone, Copy)]
pub struct PlacedShape<'a> {
    /// The form.
    pub form: &'a CollisionShape,
    /// Its placement.
    pub view: ShapePose<'a>,
}

impl PlacedShape<'_> {
    /// The point `place` of its skin, metres, where `outward` points out of it; not a number where the form has no such point.
    #[must_use]
    pub fn point(&self, place: &Place, outward: DVec3) -> DVec3 {
        match (*place, self.view) {
            (Place::Point(point), _) => point,
            (Place::Chain { segment, share, radius_m }, ShapePose::Chain { positions, .. }) => {
                let at = segment as usize;
                let ends = positions.get(at).zip(positions.get(at + 1));
                ends.map_or(DVec3::NAN, |(from, to)| from.lerp(*to, share) + outward * radius_m)
            }
            (Place::Surface { vertices, shares }, ShapePose::Surface(positions)) => {
                let corner = |(vertex, share): (u32, f64)| {
                    positions.get(vertex as usize).map_or(DVec3::NAN, |position| *position * share)
                };
                let radius_m = if let ShapeKind::Surface(surface) = &self.form.kind { surface.radius_m } else { 0.0 };
                vertices.into_iter().zip(shares).map(corner).sum::<DVec3>() + outward * radius_m
            }
            _ => DVec3::NAN,
        }
    }

    /// A box around it, with the thickness of its skin.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        match (&self.form.kind, self.view) {
            (ShapeKind::Solid(solid), ShapePose::Solid { position, .. }) => Aabb::about(position, solid.radius_m),
            (ShapeKind::Tool(tool), ShapePose::Tool { tip, .. }) => Aabb::about(tip, tool.reach_m()),
            (ShapeKind::Surface(surface), ShapePose::Surface(positions)) => {
                surface.bounds(positions).grown(surface.radius_m)
            }
            (_, ShapePose::Chain { positions, radii_m }) => {
                Aabb::of(positions).grown(radii_m.iter().copied().fold(0.0, f64::max))
            }
            // a form at a place of another kind touches nothing
            _ => Aabb::of(&[]),
        }
    }
}

/// A point of a body's skin.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Place {
    /// A point in space, fixed to a solid or a tool.
    Point(DVec3),
    /// A point of a tube's skin.
    Chain {
        /// The segment.
        segment: u32,
        /// How far along it, 0 … 1.
        share: f64,
        /// The radius there, metres.
        radius_m: f64,
    },
    /// A point of a soft body's skin, in the surface between its vertices: forces there have no lever arm from its thickness.
    Surface {
        /// Three vertices.
        vertices: [u32; 3],
        /// Weight of each vertex, in sum one; vertices of share zero do not matter.
        shares: [f64; 3],
    },
}

/// A place where two forms touch, or may touch soon.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Touch {
    /// Its name from step to step, unique among the places of the pair.
    pub key: TouchKey,
    /// Unit normal, from b towards a.
    pub normal: DVec3,
    /// Distance of the skins, metres; below zero they overlap.
    pub gap_m: f64,
    /// The point of a.
    pub on_a: Place,
    /// The point of b.
    pub on_b: Place,
}

/// One body's side of a contact: how its velocity enters the relative velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSide {
    /// Unit normal out of this body's skin.
    pub outward: DVec3,
    /// With which sign its velocity counts.
    pub sign: f64,
}

impl ContactSide {
    /// The side of the body towards which `normal` points: its velocity counts.
    #[must_use]
    pub fn first(normal: DVec3) -> Self {
        Self { outward: -normal, sign: 1.0 }
    }

    /// The side of the other body: its velocity is subtracted.
    #[must_use]
    pub const fn second(normal: DVec3) -> Self {
        Self { outward: normal, sign: -1.0 }
    }

    /// A material point without a contact: its velocity counts, a thickness has no lever arm.
    #[must_use]
    pub const fn point() -> Self {
        Self { outward: DVec3::ZERO, sign: 1.0 }
    }
}

impl SurfaceShape {
    /// The box around its vertices where these are at `positions`, metres: one that is in no triangle any more does not count.
    #[must_use]
    pub fn bounds(&self, positions: &[DVec3]) -> Aabb {
        let at = self.vertices.iter().filter_map(|vertex| positions.get(*vertex as usize));
        at.fold(Aabb::of(&[]), |Aabb { low, high }, p| Aabb { low: low.min(*p), high: high.max(*p) })
    }
}

impl std::fmt::Debug for SolidShape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SolidForm").field("solid", &self.solid).finish_non_exhaustive()
    }
}

impl SolidShape {
    /// The form of a solid with its centre of mass at `com_local`.
    ///
    /// # Errors
    /// [`ShapeError`] for an invalid solid.
    pub fn new(solid: Solid, com_local: DVec3) -> Result<Self, ShapeError> {
        let shape = solid.to_shared_shape()?;
        let ball = shape.compute_local_bounding_sphere();
        let radius_m = f64::from(ball.radius) + ball.center.as_dvec3().distance(com_local);
        Ok(Self { solid, shape, com_local, radius_m })
    }

    /// The form of a solid that moves, with its centre of mass at `com_local`: a mesh counts as its convex parts
    /// (a closed one that is not convex, divided by V-HACD) or as its hull.
    ///
    /// # Errors
    /// [`ShapeError`] for an invalid solid.
    pub fn moving(solid: &Solid, com_local: DVec3) -> Result<Self, ShapeError> {
        let shape = solid.to_moving_shape()?;
        let convex = shape.as_compound().is_none_or(|parts| parts.shapes().len() == 1);
        let mut radius_m = solid.radius_about_m(com_local);
        if !convex {
            // voxels stick out of the mesh a little
            let ball = shape.compute_local_bounding_sphere();
            radius_m = radius_m.max(f64::from(ball.radius) + ball.center.as_dvec3().distance(com_local));
        }
        let solid = match solid {
            Solid::Mesh { points_m, .. } if convex => Solid::Hull { points_m: points_m.clone() },
            solid => solid.clone(),
        };
        Ok(Self { solid, shape, com_local, radius_m })
    }
}
