//! The convex elements of a shape in motion: where one is at a moment, and how its extents change.
//!
//! In: a shape at the start and at the end of a motion. Out: its elements, boxes around their whole ways, cores at a moment with the least
//! extents along a direction. Never here: a second shape, the search.

use super::super::primitives::{Piece, Pieces};
use super::super::shape_cache::ShapeCache;
use super::SweptShape;
use crate::narrow_phase::blocks::convex_convex;
use crate::narrow_phase::blocks::gjk::{Convex, Part, Rounded};
use crate::{Aabb, ShapePose};
use glam::{DQuat, DVec3};

/// Swing of a jaw from shut to wide open, radians, at most.
const JAW_RAD: f64 = 0.6;
/// How many pieces of a tool are jaws: the first ones.
const JAWS: usize = 2;

/// The shortest rotation from one to another, radians.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub axis: DVec3,
    pub angle: f64,
}

impl Turn {
    pub fn between(from: DQuat, to: DQuat) -> Self {
        let way = (to * from.conjugate()).normalize();
        let way = if way.w < 0.0 { -way } else { way };
        let sine = way.xyz().length();
        Self { axis: way.xyz().try_normalize().unwrap_or(DVec3::Z), angle: 2.0 * libm::atan2(sine, way.w) }
    }
}

/// The convex elements of a shape in motion.
pub(in super::super) struct Elements<'a> {
    shape: &'a SweptShape<'a>,
    known: &'a ShapeCache,
    /// Its pieces at the start.
    pieces: Pieces<'a>,
    /// How a rigid body or tool moves; `None` for a deformable.
    rigid: Option<RigidWay>,
}

/// The motion of a solid or tool.
#[derive(Clone, Copy)]
pub(in super::super) struct RigidWay {
    /// The point about which it turns, at the start, and its way, metres.
    pivot: DVec3,
    way: DVec3,
    /// How all of it turns.
    turn: Turn,
    /// How far a jaw of a tool swings about the hinge besides, radians.
    swing: f64,
}

/// A convex element of a shape in motion.
pub(in super::super) enum Element<'a> {
    /// Corners that go straight, each with a ball.
    Corners {
        /// At the start, metres.
        start: [DVec3; 3],
        /// Their ways, metres.
        ways: [DVec3; 3],
        /// The radius at each, metres.
        radii_m: [f64; 3],
    },
    /// A part of a solid or tool: its number, and that of its piece.
    Rigid {
        elements: &'a Elements<'a>,
        way: RigidWay,
        piece: usize,
        part: usize,
        /// No extent of it along the axis and across it changes by more than this by turning, metres.
        turned_m: [f64; 2],
    },
    /// All that is behind a plane at rest.
    HalfSpace {
        /// A point of the plane, metres.
        point: DVec3,
        /// Its normal.
        up: DVec3,
    },
}

/// A convex element at one moment: a core, and the ball that is swept over it.
pub(super) struct Moment<'a> {
    core: Core<'a>,
    pub radius_m: f64,
}

enum Core<'a> {
    Rounded(Rounded),
    Part(Part<'a>),
}

/// The extent of a corner or part along a direction: its value and how it may change over the whole motion, metres.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub value_m: f64,
    pub slope_m: f64,
}

impl Moment<'_> {
    pub fn convex(&self) -> &dyn Convex {
        match &self.core {
            Core::Rounded(rounded) => rounded,
            Core::Part(part) => part,
        }
    }
}

impl<'a> Elements<'a> {
    /// The elements of a shape; `None` where start and end do not fit together.
    pub(in super::super) fn of(shape: &'a SweptShape<'a>, known: &'a ShapeCache) -> Option<Self> {
        let rigid = match (shape.start.view, shape.end.view) {
            (
                ShapePose::Solid { position: from, rotation: from_turn },
                ShapePose::Solid { position: to, rotation: to_turn },
            ) => Some(RigidWay { pivot: from, way: to - from, turn: Turn::between(from_turn, to_turn), swing: 0.0 }),
            (
                ShapePose::Tool { tip: from, rotation: from_turn, jaw: from_jaw },
                ShapePose::Tool { tip: to, rotation: to_turn, jaw: to_jaw },
            ) => {
                let (turn, swing) = (Turn::between(from_turn, to_turn), JAW_RAD * (to_jaw - from_jaw).abs());
                Some(RigidWay { pivot: from, way: to - from, turn, swing })
            }
            (ShapePose::Chain { positions: from, .. }, ShapePose::Chain { positions: to, radii_m }) => {
                (from.len() == to.len() && radii_m.len() == to.len()).then_some(())?;
                None
            }
            (ShapePose::Surface(from), ShapePose::Surface(to)) => {
                (from.len() == to.len()).then_some(())?;
                None
            }
            _ => return None,
        };
        Some(Self { shape, known, pieces: Pieces::of(&shape.start, known), rigid })
    }

    /// How many elements there are.
    pub(in super::super) fn count(&self) -> usize {
        self.pieces.iter().map(|(_, piece)| piece.elements()).sum()
    }

    /// An element by its number.
    pub(in super::super) fn element(&'a self, number: usize) -> Element<'a> {
        let mut part = number;
        let mut pieces = self.pieces.iter().skip_while(|(_, piece)| {
            let before = part >= piece.elements();
            part -= if before { piece.elements() } else { 0 };
            before
        });
        let Some((number, piece)) = pieces.next() else {
            return Element::Corners { start: [DVec3::NAN; 3], ways: [DVec3::ZERO; 3], radii_m: [0.0; 3] };
        };
        if let Some(way) = self.rigid {
            return Element::Rigid { elements: self, way, piece: number, part, turned_m: piece.turned_m(way, number) };
        }
        let (start, radii_m, nodes) = match piece {
            Piece::Strand(strand) => {
                let [a, b] = strand.ends(part);
                let nodes = [part, (part + 1).min(strand.count() - 1)].map(|node| node as u32);
                ([a.centre, b.centre, b.centre], [a.radius_m, b.radius_m, b.radius_m], [nodes[0], nodes[1], nodes[1]])
            }
            Piece::Surface(surface) => {
                let form = surface.form;
                let nodes = match form.triangles.get(part) {
                    Some(triangle) => *triangle,
                    None => form.edges.get(part).map_or([0; 3], |[a, b]| [*a, *b, *b]),
                };
                (nodes.map(|node| surface.positions[node as usize]), [form.radius_m; 3], nodes)
            }
            Piece::Block(_) => ([DVec3::NAN; 3], [0.0; 3], [0; 3]),
        };
        let (end, end_m) = match self.shape.end.view {
            ShapePose::Chain { positions, radii_m } => (positions, Some(radii_m)),
            ShapePose::Surface(positions) => (positions, None),
            _ => (&[][..], None),
        };
        let at_end = |i: usize| end.get(nodes[i] as usize).copied().unwrap_or(DVec3::NAN);
        let ways = [0, 1, 2].map(|i| at_end(i) - start[i]);
        // a tube that widens counts as wide as it becomes
        let wide_m = |i: usize| end_m.map_or(radii_m[i], |radii| radii[nodes[i] as usize].max(radii_m[i]));
        Element::Corners { start, ways, radii_m: [0, 1, 2].map(wide_m) }
    }

    /// The box around an element all along its motion.
    pub(in super::super) fn bounds(&self, number: usize) -> Aabb {
        match self.element(number) {
            Element::Corners { start, ways, radii_m } => {
                let end = [0, 1, 2].map(|i| start[i] + ways[i]);
                let wide_m = radii_m.iter().copied().fold(0.0, f64::max);
                if !(Aabb::of(&start).low + Aabb::of(&end).low).is_finite()
                    || start.iter().chain(&end).any(|p| p.is_nan())
                {
                    return Aabb { low: DVec3::NAN, high: DVec3::NAN };
                }
                Aabb::of(&start).union(Aabb::of(&end)).grown(wide_m)
            }
            Element::Rigid { way, piece, turned_m, .. } => {
                let around = self.pieces.get(piece).map(|piece| piece.around());
                let Some(around) = around else { return Aabb { low: DVec3::NAN, high: DVec3::NAN } };
                let wide_m = around.radius_m + turned_m[1];
                Aabb::about(around.centre, wide_m).union(Aabb::about(around.centre + way.way, wide_m))
            }
            Element::HalfSpace { .. } => Aabb::everywhere(),
        }
    }
}

impl Piece<'_> {
    /// How many convex elements it has.
    fn elements(&self) -> usize {
        match self {
            Self::Strand(strand) => strand.spans(),
            Self::Surface(surface) if surface.form.triangles.is_empty() => surface.form.edges.len(),
            Self::Surface(surface) => surface.form.triangles.len(),
            Self::Block(block) => convex_convex::parts(block).count(),
        }
    }

    /// By how much a motion may change its extents by turning, along the axis of the turn and across it, metres. A ball about the pivot does not
    /// change. Of a tool the first two pieces are jaws.
    fn turned_m(&self, way: RigidWay, number: usize) -> [f64; 2] {
        let arm_m = match self {
            Self::Strand(strand) => strand.positions().iter().map(|node| node.distance(way.pivot)).fold(0.0, f64::max),
            _ => self.around().centre.distance(way.pivot) + self.around().radius_m,
        };
        // the hinge is in the jaw
        let swung_m = if number < JAWS { way.swing * 2.0 * self.around().radius_m } else { 0.0 };
        [swung_m, swung_m + way.turn.angle * arm_m]
    }
}

impl<'a> Element<'a> {
    /// The element at a share of its motion.
    pub(super) fn at(&self, share: f64) -> Option<Moment<'a>> {
        match *self {
            Self::Corners { start, ways, radii_m } => {
                Some(Moment::rounded([0, 1, 2].map(|i| start[i] + ways[i] * share), radii_m))
            }
            Self::Rigid { elements, piece, part, .. } => {
                let placed = elements.shape.rigid_within(share)?;
                match &Pieces::of(&placed, elements.known).get(piece)? {
                    Piece::Strand(strand) => {
                        let [a, b] = strand.ends(part);
                        let radii_m = [a.radius_m, b.radius_m, b.radius_m];
                        Some(Moment::rounded([a.centre, b.centre, b.centre], radii_m))
                    }
                    Piece::Block(block) => {
                        let part = convex_convex::parts(block).nth(part)?;
                        Some(Moment { core: Core::Part(part), radius_m: 0.0 })
                    }
                    Piece::Surface(_) => None,
                }
            }
            Self::HalfSpace { .. } => None,
        }
    }

    /// The least extents along a direction of the element at a share of its motion, and how they change.
    pub(super) fn least(&self, moment: &Moment<'_>, along: DVec3) -> [Extent; 3] {
        match (self, &moment.core) {
            (Self::Corners { ways, radii_m, .. }, Core::Rounded(rounded)) => [0, 1, 2]
                .map(|i| Extent { value_m: along.dot(rounded.corners[i]) - radii_m[i], slope_m: along.dot(ways[i]) }),
            (Self::Rigid { way, turned_m, .. }, _) => {
                let core = moment.convex();
                let value_m =
                    along.dot(core.origin()) + along.dot(core.support(-along, core.origin())) - moment.radius_m;
                // a point at r moves along n by n·(ω × r)
                let across = along.cross(way.turn.axis).length();
                let turned_m = turned_m[0] + (turned_m[1] - turned_m[0]) * across;
                [Extent { value_m, slope_m: along.dot(way.way) - turned_m }; 3]
            }
            (Self::Corners { .. } | Self::HalfSpace { .. }, _) => {
                [Extent { value_m: f64::NEG_INFINITY, slope_m: 0.0 }; 3]
            }
        }
    }
}

impl Moment<'_> {
    /// The hull of three balls: the least of them is swept over the core.
    fn rounded(corners: [DVec3; 3], radii_m: [f64; 3]) -> Self {
        let radius_m = radii_m.iter().copied().fold(f64::INFINITY, f64::min);
        Self { core: Core::Rounded(Rounded { corners, radii_m: radii_m.map(|wide_m| wide_m - radius_m) }), radius_m }
    }
}
