//! The first moment at which two shapes in motion touch.
//!
//! In: two shapes at the start and at the end of a motion. Out: the share of the motion at which they first come within reach, and where they
//! touch then. Never here: velocities after a touch, which pairs are asked.
//!
//! Vertices, nodes and centres of mass go straight, rotations turn evenly. Both shapes are convex elements: spans, triangles, convex parts.
//! For a pair of elements the direction n between their nearest points parts them as long as their extents along n stay apart, and extents
//! change by at most n·d of each corner, and the turn times its arm, in a motion by d: so the pair leaps to the moment at which they may meet,
//! looks again, and never passes a touch, however thin both are. The search is conservative advancement (MIR96).

mod elements;

use super::blocks::epa::Hull;
use super::blocks::gjk::Difference;
use super::shape_cache::ShapeCache;
use super::{NarrowPhaseScratch, touches};
use crate::{Aabb, BoxGrid, PlacedShape, ShapePose, Touch};
pub(super) use elements::{Element, Elements};
use elements::{Extent, Turn};
use glam::{DQuat, DVec3};

/// Shapes this much nearer than the reach count as touching, metres: a twentieth of the depth at which contacts rest.
pub(super) const NEAR_M: f64 = 1e-6;
/// Leaps of a pair of elements; two to four bring most together, but one that turns by radians about a far pivot takes hundreds. One that
/// takes more touches where it is then: early, not late.
const LEAPS: usize = 1000;

/// How near two shapes in motion have to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweptReach {
    /// They touch once they are this near, metres, ≥ 0.
    pub reach_m: f64,
    /// Contacts at the moment of a touch have up to so much more gap, metres, ≥ 0: a span may leave its nearest place to its end, which is a
    /// little farther, and the place that touches next is at hand.
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

/// Two elements that may meet.
pub(super) struct ElementPair<'a> {
    pub elements: [Element<'a>; 2],
    pub reach_m: f64,
    /// A meeting at this share of the motion or later does not matter.
    pub latest: Option<f64>,
}

/// The moment at which two elements first come within reach.
pub(super) struct Meeting {
    /// The share of the motion.
    pub share: f64,
    /// From the second towards the first; zero where their cores overlap at the start.
    pub normal: DVec3,
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
