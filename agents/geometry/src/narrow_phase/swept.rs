//! The first moment at which two shapes in motion touch.
//!
//! In: two shapes at the start and at the end of a motion. Out: the share of the motion at which they first come within reach, and where they
//! touch then. Never here: velocities after a touch, which pairs are asked.
//!
//! Vertices, nodes and centres of mass go straight, rotations turn evenly. Both shapes are convex elements: spans, triangles, convex parts.
//! For a pair of elements the direction n between their nearest points parts them as long as their extents along n stay apart, and extents
//! change by at most n·d of each corner, and the turn times its arm, in a motion by d: so the pair leaps to the moment at which they may meet,
//! looks again, and never passes a touch, however thin both are. The search is conservative advancement (MIR96).

use super::epa::Hull;
use super::gjk::{Convex, Difference, Part, Rounded};
use super::primitives::{Piece, Pieces};
use super::shape_cache::ShapeCache;
use super::{NarrowPhaseScratch, touches};
use crate::{Aabb, BoxGrid, PlacedShape, ShapePose, Touch};
use glam::{DQuat, DVec3};

/// Shapes this much nearer than the reach count as touching, metres: a twentieth of the depth at which contacts rest.
pub(super) const NEAR_M: f64 = 1e-6;
/// Leaps of a pair of elements; two to four bring most together, but one that turns by radians about a far pivot takes hundreds. One that
/// takes more touches where it is then: early, not late.
const LEAPS: usize = 1000;
/// Swing of a jaw from shut to wide open, radians, at most.
const JAW_RAD: f64 = 0.6;
/// How many pieces of a tool are jaws: the first ones.
const JAWS: usize = 2;

/// How near two shapes in motion have to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweptReach {
    /// They touch once they are this near, metres, ≥ 0.
    pub reach_m: f64,
    /// Contacts at the moment of a touch have up to so much more gap, metres, ≥ 0: a span may leave its nearest place to its end, which is a
    /// little farther, and what touches next is at hand.
    pub around_m: f64,
}

/// A shape in motion.
#[derive(Debug, Clone, Copy)]
pub struct SweptShape<'a> {
    /// Where it is first.
    pub start: PlacedShape<'a>,
    /// Where it is last: of the same form, with as many nodes or vertices.
    pub end: PlacedShape<'a>,
}

/// Storage for the search.
#[derive(Default)]
pub(super) struct SweptScratch {
    pub(super) hull: Hull,
    grid: BoxGrid,
    boxes: Vec<Aabb>,
    pub(super) placed: [Between; 2],
}

/// A shape within its motion.
#[derive(Default)]
pub(super) struct Between {
    positions: Vec<DVec3>,
    radii_m: Vec<f64>,
}

/// The share 0 … 1 of the motion of `a` and `b` at which they first come within reach of each other, and their contacts at that moment, by
/// rising keys; `None` and no contacts where they do not. 0 where they touch at the start.
///
/// A moment is up to a micrometre of gap early and never late. Nothing is allocated once the numbers of nodes and contacts settle.
pub fn first_touch(
    a: &SweptShape<'_>,
    b: &SweptShape<'_>,
    reach: SweptReach,
    scratch: &mut NarrowPhaseScratch,
    into: &mut Vec<Touch>,
) -> Option<f64> {
    into.clear();
    let mut swept = std::mem::take(&mut scratch.swept);
    let share = first_share(a, b, reach.reach_m, &mut scratch.known, &mut swept);
    if let Some(share) = share {
        let [first, second] = &mut swept.placed;
        if let (Some(first), Some(second)) = (a.within(share, first), b.within(share, second)) {
            touches(&first, &second, reach.reach_m + reach.around_m, scratch, into);
        }
    }
    scratch.swept = swept;
    share
}

/// The share of the motion at which two shapes first come within reach.
pub(super) fn first_share(
    a: &SweptShape<'_>,
    b: &SweptShape<'_>,
    reach_m: f64,
    known: &mut ShapeCache,
    scratch: &mut SweptScratch,
) -> Option<f64> {
    known.prepare(&a.start, &b.start);
    let [first, second] = [a, b].map(|shape| Elements::of(shape, known));
    let (first, second) = (first?, second?);
    let SweptScratch { hull, grid, boxes, .. } = scratch;
    boxes.clear();
    boxes.extend((0..second.count()).map(|number| second.bounds(number)));
    let extents = boxes.iter().map(|around| (around.high - around.low).max_element()).filter(|size| size.is_finite());
    let cell_m = extents.sum::<f64>() / boxes.len().max(1) as f64 + reach_m;
    grid.fill(boxes.iter().copied(), cell_m.max(f64::MIN_POSITIVE));
    let mut earliest: Option<f64> = None;
    for number in 0..first.count() {
        let around = first.bounds(number).grown(reach_m + NEAR_M);
        if !(around.low.is_finite() && around.high.is_finite()) {
            continue;
        }
        grid.visit(around, |other| {
            if !boxes[other as usize].meets(around) {
                return;
            }
            let pair = ElementPair {
                elements: [first.element(number), second.element(other as usize)],
                reach_m,
                latest: earliest,
            };
            earliest = pair.meeting(hull).map(|meeting| meeting.share).or(earliest);
        });
    }
    earliest
}

impl<'a> SweptShape<'a> {
    /// The shape at a share of its motion; `None` where start and end do not fit together.
    pub(super) fn within<'b>(&self, share: f64, storage: &'b mut Between) -> Option<PlacedShape<'b>>
    where
        'a: 'b,
    {
        let Between { positions, radii_m } = storage;
        let form = self.start.form;
        let between = |from: &[DVec3], to: &[DVec3], into: &mut Vec<DVec3>| {
            into.clear();
            into.extend(from.iter().zip(to).map(|(from, to)| from.lerp(*to, share)));
        };
        let view = match (self.start.view, self.end.view) {
            (
                ShapePose::Chain { positions: from, radii_m: from_m },
                ShapePose::Chain { positions: to, radii_m: to_m },
            ) if from.len() == to.len() && from_m.len() == to_m.len() => {
                between(from, to, positions);
                radii_m.clear();
                radii_m.extend(from_m.iter().zip(to_m).map(|(from_m, to_m)| from_m + (to_m - from_m) * share));
                ShapePose::Chain { positions, radii_m }
            }
            (ShapePose::Surface(from), ShapePose::Surface(to)) if from.len() == to.len() => {
                between(from, to, positions);
                ShapePose::Surface(positions)
            }
            _ => return self.rigid_within(share),
        };
        Some(PlacedShape { form, view })
    }

    /// The same for a solid or tool.
    fn rigid_within(&self, share: f64) -> Option<PlacedShape<'a>> {
        let turned = |from: DQuat, to: DQuat| {
            let way = Turn::between(from, to);
            DQuat::from_axis_angle(way.axis, way.angle * share) * from
        };
        let view = match (self.start.view, self.end.view) {
            (
                ShapePose::Solid { position: from, rotation: from_turn },
                ShapePose::Solid { position: to, rotation: to_turn },
            ) => ShapePose::Solid { position: from.lerp(to, share), rotation: turned(from_turn, to_turn) },
            (
                ShapePose::Tool { tip: from, rotation: from_turn, jaw: from_jaw },
                ShapePose::Tool { tip: to, rotation: to_turn, jaw: to_jaw },
            ) => ShapePose::Tool {
                tip: from.lerp(to, share),
                rotation: turned(from_turn, to_turn),
                jaw: from_jaw + (to_jaw - from_jaw) * share,
            },
            _ => return None,
        };
        Some(PlacedShape { form: self.start.form, view })
    }
}

/// The shortest rotation from one to another, radians.
#[derive(Clone, Copy)]
struct Turn {
    axis: DVec3,
    angle: f64,
}

impl Turn {
    fn between(from: DQuat, to: DQuat) -> Self {
        let way = (to * from.conjugate()).normalize();
        let way = if way.w < 0.0 { -way } else { way };
        let sine = way.xyz().length();
        Self { axis: way.xyz().try_normalize().unwrap_or(DVec3::Z), angle: 2.0 * libm::atan2(sine, way.w) }
    }
}

/// The convex elements of a shape in motion.
pub(super) struct Elements<'a> {
    shape: &'a SweptShape<'a>,
    known: &'a ShapeCache,
    /// Its pieces at the start.
    pieces: Pieces<'a>,
    /// How a rigid body or tool moves; `None` for what deforms.
    rigid: Option<RigidWay>,
}

/// The motion of a solid or tool.
#[derive(Clone, Copy)]
pub(super) struct RigidWay {
    /// The point about which it turns, at the start, and its way, metres.
    pivot: DVec3,
    way: DVec3,
    /// How all of it turns.
    turn: Turn,
    /// How far a jaw of a tool swings about the hinge besides, radians.
    swing: f64,
}

/// A convex element of a shape in motion.
pub(super) enum Element<'a> {
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

/// The moment at which two elements first come within reach.
pub(super) struct Meeting {
    /// The share of the motion.
    pub share: f64,
    /// From the second towards the first; zero where their cores overlap at the start.
    pub normal: DVec3,
}

/// A convex element at one moment: a core, and the ball that is swept over it.
struct Moment<'a> {
    core: Core<'a>,
    radius_m: f64,
}

enum Core<'a> {
    Rounded(Rounded),
    Part(Part<'a>),
}

/// The extent of a corner or part along a direction: its value and how it may change over the whole motion, metres.
#[derive(Clone, Copy)]
struct Extent {
    value_m: f64,
    slope_m: f64,
}

impl Moment<'_> {
    fn convex(&self) -> &dyn Convex {
        match &self.core {
            Core::Rounded(rounded) => rounded,
            Core::Part(part) => part,
        }
    }
}

impl<'a> Elements<'a> {
    /// The elements of a shape; `None` where start and end do not fit together.
    pub(super) fn of(shape: &'a SweptShape<'a>, known: &'a ShapeCache) -> Option<Self> {
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
    pub(super) fn count(&self) -> usize {
        self.pieces.iter().map(|(_, piece)| piece.elements()).sum()
    }

    /// An element by its number.
    pub(super) fn element(&'a self, number: usize) -> Element<'a> {
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
    pub(super) fn bounds(&self, number: usize) -> Aabb {
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
            Self::Block(block) => super::convex_convex::parts(block).count(),
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
    fn at(&self, share: f64) -> Option<Moment<'a>> {
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
                        let part = super::convex_convex::parts(block).nth(part)?;
                        Some(Moment { core: Core::Part(part), radius_m: 0.0 })
                    }
                    Piece::Surface(_) => None,
                }
            }
            Self::HalfSpace { .. } => None,
        }
    }

    /// The least extents along a direction of the element at a share of its motion, and how they change.
    fn least(&self, moment: &Moment<'_>, along: DVec3) -> [Extent; 3] {
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

/// Two elements that may meet.
pub(super) struct ElementPair<'a> {
    pub elements: [Element<'a>; 2],
    pub reach_m: f64,
    /// A meeting at this share of the motion or later does not matter.
    pub latest: Option<f64>,
}

/// How two elements are parted at a moment.
struct Parted {
    /// From the second towards the first.
    normal: DVec3,
    gap_m: f64,
    /// The least extents of the first along the normal, and of the second against it.
    least: [[Extent; 3]; 2],
}

impl ElementPair<'_> {
    /// Where the two first come within reach.
    pub(super) fn meeting(&self, hull: &mut Hull) -> Option<Meeting> {
        let Self { reach_m, latest, .. } = self;
        let mut share = 0.0;
        let mut normal = DVec3::ZERO;
        for _ in 0..LEAPS {
            let Some(parted) = self.parted(share, hull) else { return Some(Meeting { share, normal }) };
            normal = parted.normal;
            if parted.gap_m <= reach_m + NEAR_M {
                return Some(Meeting { share, normal });
            }
            let target_m = reach_m + 0.5 * NEAR_M;
            let [low, high] = parted.least;
            let mut leap = f64::INFINITY;
            for one in low {
                for two in high {
                    let (apart_m, closing_m) = (one.value_m + two.value_m - target_m, -(one.slope_m + two.slope_m));
                    if closing_m > 0.0 {
                        leap = leap.min(apart_m / closing_m);
                    }
                }
            }
            share += leap;
            if share.is_nan() || share > 1.0 || latest.is_some_and(|latest| share >= latest) {
                return None;
            }
        }
        Some(Meeting { share, normal })
    }

    /// How the two are parted at a share of the motion; `None` where their cores overlap.
    fn parted(&self, share: f64, hull: &mut Hull) -> Option<Parted> {
        let [a, b] = &self.elements;
        let first = a.at(share)?;
        if let Element::HalfSpace { point, up } = b {
            let low = a.least(&first, *up);
            let floor = [Extent { value_m: -up.dot(*point), slope_m: 0.0 }; 3];
            let gap_m = low.iter().map(|extent| extent.value_m).fold(f64::INFINITY, f64::min) - up.dot(*point);
            return Some(Parted { normal: *up, gap_m, least: [low, floor] });
        }
        let second = b.at(share)?;
        let cores = Difference::new(first.convex(), second.convex()).apart(f64::INFINITY, hull)?;
        let gap_m = cores.gap_m - first.radius_m - second.radius_m;
        let normal = cores.normal;
        (cores.gap_m > 0.0).then(|| Parted {
            normal,
            gap_m,
            least: [a.least(&first, normal), b.least(&second, -normal)],
        })
    }
}
