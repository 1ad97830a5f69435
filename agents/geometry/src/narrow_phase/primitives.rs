//! The pieces of a form for contact: placed strands and blocks.
//!
//! In: a form and its place. Out: its pieces with bounds. Never here: contacts.

use super::shape_cache::{PartShape, ShapeCache, ToolSolid};
use super::skins::skin_tree::PlacedSkin;
use crate::solids::capsule_chain::foot;
use crate::solids::signed_distance::{Ball, Field};
use crate::{Aabb, Place, PlacedShape, ShapeKind, ShapePose, SolidShape, SurfaceShape};
use crate::{CompoundPart, Solid, ToolShape};
use glam::{DQuat, DVec3};
use rapier3d::parry::shape::Shape;

/// The pieces of a form, each made where it is asked for: most forms have one, and a store for as many as any can have would be cleared and
/// moved about with every pair that is looked at.
#[derive(Clone, Copy)]
pub(super) enum Pieces<'a> {
    /// The piece of a form that has no others; `None` where it touches nothing.
    One(Option<Piece<'a>>),
    Compound {
        parts: &'a [CompoundPart],
        shapes: &'a [Option<PartShape>],
        /// Where its axes' origin is.
        origin: DVec3,
        rotation: DQuat,
        known: &'a ShapeCache,
    },
    Tool {
        shape: &'a ToolShape,
        solids: &'a [ToolSolid],
        tip: DVec3,
        rotation: DQuat,
        jaw: f64,
    },
}

/// A piece of a form.
#[derive(Clone, Copy)]
pub(super) enum Piece<'a> {
    Strand(Strand<'a>),
    Block(Block<'a>),
    Surface(Surface<'a>),
}

/// The skin of a soft body.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub form: &'a SurfaceShape,
    /// Where its vertices are, metres.
    pub positions: &'a [DVec3],
    /// Lowest and highest coordinates of the vertices.
    pub bounds: Aabb,
    /// Its features by place, and its normals.
    pub skin: &'a PlacedSkin,
}

/// Balls joined by spans.
#[derive(Clone, Copy)]
pub(super) struct Strand<'a> {
    nodes: Nodes<'a>,
    /// Lowest and highest coordinates of the nodes.
    pub bounds: Aabb,
    /// The largest radius, metres.
    pub widest_m: f64,
}

/// A point on the core line of a strand.
#[derive(Clone, Copy)]
pub(super) struct StrandPoint {
    /// The span.
    pub span: usize,
    /// How far along the span, 0 … 1.
    pub share: f64,
}

#[derive(Clone, Copy)]
enum Nodes<'a> {
    /// A ball or capsule: one or two nodes, and the radius.
    Solid([DVec3; 2], usize, f64),
    Tube(&'a [DVec3], &'a [f64]),
}

/// A solid that is no strand.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    /// Its distance field, in its own axes; `None` where no strand is near.
    pub field: Option<&'a Field>,
    /// Its parry shape, in its own axes.
    pub shape: &'a dyn Shape,
    /// Where its axes' origin is.
    pub origin: DVec3,
    /// From its axes to the world's.
    pub rotation: DQuat,
    /// A ball around it.
    pub around: Ball,
    /// How deep inside it a point of a chain or a skin is still pushed out, metres; a convex primitive has no limit.
    pub deep_m: f64,
    /// Whether it is a part of a tool: thin, and driven with force.
    pub pierces: bool,
}

impl<'a> Pieces<'a> {
    /// Decomposes a form.
    pub fn of(placed: &PlacedShape<'a>, known: &'a ShapeCache) -> Self {
        match (&placed.form.kind, placed.view) {
            (ShapeKind::Chain, ShapePose::Chain { positions, radii_m }) => Self::One(tube(positions, radii_m)),
            (ShapeKind::Solid(form), ShapePose::Solid { position, rotation }) => {
                let SolidShape { solid, com_local, radius_m, .. } = form;
                let origin = position - rotation * *com_local;
                if let Solid::Compound { parts } = solid {
                    let Some(shapes) = known.compound(parts) else { return Self::One(None) };
                    return Self::Compound { parts, shapes, origin, rotation, known };
                }
                let radius_m = if matches!(solid, Solid::Plane) { f64::INFINITY } else { *radius_m };
                let at = Standing { origin, rotation, around: Ball { centre: position, radius_m } };
                Self::One(Some(at.piece(solid, known.shape(form).as_ref(), known)))
            }
            (ShapeKind::Tool(shape), ShapePose::Tool { tip, rotation, jaw }) => match known.tool(shape) {
                Some(solids) => Self::Tool { shape, solids, tip, rotation, jaw },
                None => Self::One(None),
            },
            (ShapeKind::Surface(form), ShapePose::Surface(positions)) => {
                let surface = |skin: &'a PlacedSkin| Surface { form, positions, bounds: skin.bounds(), skin };
                Self::One(known.skins.placed(form, positions).map(surface).map(Piece::Surface))
            }
            _ => Self::One(None),
        }
    }

    /// The most numbers that pieces have.
    const fn count(&self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Compound { parts, .. } => parts.len(),
            Self::Tool { solids, .. } => solids.len(),
        }
    }

    /// The piece of a number; `None` where there is none, or it has no shape.
    pub fn get(&self, number: usize) -> Option<Piece<'a>> {
        match *self {
            Self::One(piece) => piece.filter(|_| number == 0),
            Self::Compound { parts, shapes, origin, rotation, known } => {
                let (part, PartShape { shape, radius_m }) = (parts.get(number)?, shapes.get(number)?.as_ref()?);
                let (origin, rotation) = (origin + rotation * part.position_m, rotation * part.rotation);
                let at = Standing { origin, rotation, around: Ball { centre: origin, radius_m: *radius_m } };
                Some(at.piece(&part.solid, shape.as_ref(), known))
            }
            Self::Tool { shape, solids, tip, rotation, jaw } => {
                let (solid, part) = (solids.get(number)?, shape.parts(jaw)[number]);
                let origin = tip + rotation * part.position;
                let rotation = rotation * part.rotation;
                let around = Ball { centre: origin + rotation * solid.around.centre, ..solid.around };
                let (field, shape, deep_m) = (Some(&solid.field), solid.shape.as_ref(), 2.0 * around.radius_m);
                Some(Piece::Block(Block { field, shape, origin, rotation, around, deep_m, pierces: true }))
            }
        }
    }

    /// The pieces with their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Piece<'a>)> {
        (0..self.count()).filter_map(|number| Some((number, self.get(number)?)))
    }
}

/// Where a solid is.
struct Standing {
    origin: DVec3,
    rotation: DQuat,
    /// A ball around it.
    around: Ball,
}

impl Standing {
    /// The piece of a solid.
    fn piece<'a>(self, solid: &'a Solid, shape: &'a dyn Shape, known: &'a ShapeCache) -> Piece<'a> {
        let Self { origin, rotation, around } = self;
        let along = |half: f64| rotation * (DVec3::Z * half);
        match solid {
            Solid::Ball { radius_m } => strand(Nodes::Solid([origin, origin], 1, *radius_m)),
            Solid::Capsule { radius_m, half_height_m: half } => {
                strand(Nodes::Solid([origin - along(*half), origin + along(*half)], 2, *radius_m))
            }
            _ => {
                let (field, deep_m, pierces) = (known.field(solid), 2.0 * around.radius_m, false);
                Piece::Block(Block { field, shape, origin, rotation, around, deep_m, pierces })
            }
        }
    }
}

fn tube<'a>(positions: &'a [DVec3], radii_m: &'a [f64]) -> Option<Piece<'a>> {
    let whole = !positions.is_empty() && positions.len() == radii_m.len();
    whole.then(|| strand(Nodes::Tube(positions, radii_m)))
}

fn strand(nodes: Nodes<'_>) -> Piece<'_> {
    let mut strand = Strand { nodes, bounds: Aabb { low: DVec3::ZERO, high: DVec3::ZERO }, widest_m: 0.0 };
    strand.bounds = Aabb::of(strand.positions());
    strand.widest_m = match &strand.nodes {
        Nodes::Solid(_, _, radius_m) => *radius_m,
        Nodes::Tube(_, radii_m) => radii_m.iter().copied().fold(0.0, f64::max),
    };
    Piece::Strand(strand)
}

impl Piece<'_> {
    /// How far the bounds of both are apart, metres; below zero where they overlap.
    pub fn bounds_apart_m(&self, other: &Self) -> f64 {
        match (self, other) {
            (Self::Strand(a), Self::Strand(b)) => {
                let apart = (b.bounds.low - a.bounds.high).max(a.bounds.low - b.bounds.high).max(DVec3::ZERO).length();
                apart - (a.widest_m + b.widest_m)
            }
            (Self::Strand(strand), Self::Block(block)) | (Self::Block(block), Self::Strand(strand)) => {
                let Aabb { low, high } = strand.bounds;
                let apart = (low - block.around.centre).max(block.around.centre - high).max(DVec3::ZERO).length();
                apart - (strand.widest_m + block.around.radius_m)
            }
            (Self::Block(a), Self::Block(b)) => {
                let apart = a.around.centre.distance(b.around.centre);
                apart - (a.around.radius_m + b.around.radius_m)
            }
            (Self::Surface(surface), other) | (other, Self::Surface(surface)) => {
                let (here, there) = (surface.bounds, other.bounds());
                let apart = (there.low - here.high).max(here.low - there.high).max(DVec3::ZERO).length();
                apart - surface.form.radius_m
            }
        }
    }

    /// Whether a part of it may be in a box, or, of a block, around it.
    pub fn is_in(&self, around: Aabb) -> bool {
        match self {
            Self::Strand(strand) => strand.is_in(around),
            Self::Block(block) => block
                .field
                .is_some_and(|field| field.is_in(around.seen_from(block.origin, block.rotation), block.deep_m)),
            Self::Surface(surface) => surface.skin.meets(around.grown(surface.form.radius_m)),
        }
    }

    /// A ball around it.
    pub fn around(&self) -> Ball {
        if let Self::Block(block) = self {
            return block.around;
        }
        let Aabb { low, high } = self.bounds();
        Ball { centre: (low + high) * 0.5, radius_m: 0.5 * low.distance(high) }
    }

    /// The box around it, including the thickness of a surface or strand.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Strand(strand) => strand.bounds.grown(strand.widest_m),
            Self::Block(block) => Aabb::about(block.around.centre, block.around.radius_m),
            Self::Surface(surface) => surface.bounds.grown(surface.form.radius_m),
        }
    }
}

impl Strand<'_> {
    /// Whether a span may be in a box: the span's box is grown by its thickness.
    fn is_in(&self, around: Aabb) -> bool {
        let is_near = |span: usize| {
            let [a, b] = self.ends(span);
            Aabb::of(&[a.centre, b.centre]).grown(2.0 * a.radius_m.max(b.radius_m)).meets(around)
        };
        (0..self.spans()).any(is_near)
    }

    /// The nodes, metres.
    pub fn positions(&self) -> &[DVec3] {
        match &self.nodes {
            Nodes::Solid(nodes, count, _) => &nodes[..*count],
            Nodes::Tube(positions, _) => positions,
        }
    }

    /// How many nodes there are, ≥ 1.
    pub fn count(&self) -> usize {
        self.positions().len()
    }

    /// How many spans there are; a ball alone counts as one without length.
    pub fn spans(&self) -> usize {
        (self.count() - 1).max(1)
    }

    /// A node with its radius.
    pub fn ball(&self, node: usize) -> Ball {
        let radius_m = match &self.nodes {
            Nodes::Solid(_, _, radius_m) => *radius_m,
            Nodes::Tube(_, radii_m) => radii_m[node],
        };
        Ball { centre: self.positions()[node], radius_m }
    }

    /// Both ends of a span.
    pub fn ends(&self, span: usize) -> [Ball; 2] {
        [self.ball(span), self.ball((span + 1).min(self.count() - 1))]
    }

    /// A node as a point of the span that begins there; the last node as the end of the last span.
    pub fn node(&self, node: usize) -> StrandPoint {
        let span = node.min(self.spans() - 1);
        StrandPoint { span, share: (node - span) as f64 }
    }

    /// The share of a span at which a point has its foot, if this span reports it ([`foot`]).
    pub fn foot(&self, point: DVec3, span: usize) -> Option<f64> {
        if self.count() == 1 { Some(0.0) } else { foot(point, self.positions(), span) }
    }

    /// The place of a ball inside a span; `normal` leads from its far side to it.
    pub fn place(&self, span: usize, share: f64, ball: Ball, normal: DVec3) -> Place {
        match self.nodes {
            Nodes::Solid(..) => Place::Point(skin(ball, normal)),
            Nodes::Tube(..) => Place::Chain { segment: span as u32, share, radius_m: ball.radius_m },
        }
    }
}

impl Block<'_> {
    /// Whether a span stays farther than `reach_m` from the ball around this block.
    pub fn misses(&self, ends: [Ball; 2], reach_m: f64) -> bool {
        let [a, b] = ends.map(|ball| ball.centre);
        let way = b - a;
        let share = ((self.around.centre - a).dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let widest_m = ends[0].radius_m.max(ends[1].radius_m);
        let apart = self.around.centre.distance(a.lerp(b, share));
        apart > self.around.radius_m + widest_m + reach_m || apart.is_nan()
    }

    /// A ball in this block's axes.
    pub fn inward(&self, ball: Ball) -> Ball {
        Ball { centre: self.rotation.conjugate() * (ball.centre - self.origin), ..ball }
    }
}

/// The point of a ball's surface opposite to `normal`.
fn skin(ball: Ball, normal: DVec3) -> DVec3 {
    ball.centre - normal * ball.radius_m
}
