//! Contacts of strands with blocks: nodes and spans in the block's distance field, in double precision.
//!
//! In: a strand and a block. Out: touching nodes, the lowest place of each span, and the ends of the stretch where a span lies flat.
//! Never here: parry. Theory: `docs/theory/contact.md`, eq. 1–3.

use crate::Touch;
use crate::narrow_phase::primitives::{Block, Strand, StrandPoint};
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::solids::signed_distance;
use crate::solids::signed_distance::{Ball, Field};
use glam::DVec3;

/// A span counts as flat on a block wherever its gap is above the lowest by at most this share of its radius.
const FLAT_SHARE: f64 = 2e-3;
/// A stretch whose normal turns by more than this in a quarter of the way to its edge is curved, radians: the lowest place bears it alone.
const FLAT_RAD: f64 = 5e-4;
/// The edges of a flat stretch count if they are at least this many radii from other places.
const APART_RADII: f64 = 0.25;
/// Halvings of the search for such an edge: a thousandth of a span.
const EDGE_HALVINGS: usize = 10;
/// The places of a span in keys, after those of nodes: the lowest, and the edges before and after it.
const LOWEST: u32 = 8;

/// Every place within `reach_m`, with normals from the block towards the strand.
pub(crate) fn touches(strand: &Strand<'_>, block: &Block<'_>, reach_m: f64, into: &mut Vec<Touch>) {
    let Some(field) = block.field else { return };
    let pair = StrandOnBlock { strand, block, field, reach_m };
    let mut last = None;
    for span in 0..strand.spans() {
        if block.misses(strand.ends(span), reach_m) {
            continue;
        }
        let left = last.filter(|&(node, _)| node == span).map_or_else(|| pair.node(span, into), |(_, near)| near);
        if strand.count() > 1 {
            let right = pair.node(span + 1, into);
            last = Some((span + 1, right));
            if field.needs_span_tests() {
                pair.span(span, [left, right], into);
            }
        }
    }
}

/// The nearest place: its normal from the block towards the strand, and a lower bound of the gap.
pub(crate) fn gap(strand: &Strand<'_>, block: &Block<'_>, reach_m: f64) -> Option<(DVec3, f64)> {
    let field = block.field?;
    // search depth: a hull or mesh is searched down to its whole size
    let look_m = reach_m.max(2.0 * block.around.radius_m);
    let mut nearest: Option<signed_distance::Touch> = None;
    for span in 0..strand.spans() {
        let within_m = nearest.map_or(reach_m, |near| near.distance_m.min(reach_m));
        if block.misses(strand.ends(span), within_m) {
            continue;
        }
        let found = field.gap_of_span(strand.ends(span).map(|end| block.inward(end)), look_m);
        nearest = found.filter(|f| nearest.is_none_or(|n| f.distance_m < n.distance_m)).or(nearest);
    }
    nearest.map(|near| (block.rotation * near.normal, near.distance_m))
}

/// The key of a place of a node or span.
fn key(index: usize, place: u32) -> TouchKey {
    TouchKey { place, ..TouchKey::new(TouchKind::SpanOnSolid, [index as u32, 0]) }
}

/// A strand and a block that may touch.
struct StrandOnBlock<'a> {
    strand: &'a Strand<'a>,
    block: &'a Block<'a>,
    field: &'a Field,
    reach_m: f64,
}

impl StrandOnBlock<'_> {
    /// Adds the places of a node; returns the nearest.
    fn node(&self, node: usize, into: &mut Vec<Touch>) -> Option<signed_distance::Touch> {
        let ball = self.block.inward(self.strand.ball(node));
        let mut places = self.field.touches(ball.centre, ball.radius_m + self.reach_m);
        if places.iter().next().is_none() {
            // a hull or mesh is searched as deep as the reach; for a node deeper inside the nearest way out is added
            self.field.inside(ball.centre, self.block.deep_m).into_iter().for_each(|touch| places.push(touch));
        }
        for (place, touch) in (0..).zip(places.iter()) {
            let key = key(node, place);
            self.report(key, self.strand.node(node), touch, into);
        }
        places.iter().next()
    }

    /// Adds the lowest place of a span and the edges of its flat stretch.
    fn span(&self, span: usize, near: [Option<signed_distance::Touch>; 2], into: &mut Vec<Touch>) {
        let ends = self.strand.ends(span).map(|end| self.block.inward(end));
        let lowest = self.field.touches_span(ends, self.reach_m).filter(|(share, touch)| {
            let ball = ends[0].toward(ends[1], *share);
            !near.iter().zip(ends).any(|(near, end)| {
                let lower_m =
                    |near: &signed_distance::Touch| near.distance_m - end.radius_m - (touch.distance_m - ball.radius_m);
                let beside = end.centre.distance(ball.centre) < ball.radius_m;
                beside
                    && near.is_some_and(|near| {
                        near.hides(end, ball, *touch) && lower_m(&near) < FLAT_SHARE * ball.radius_m
                    })
            })
        });
        if let Some((share, touch)) = lowest {
            self.report(key(span, LOWEST), StrandPoint { span, share }, touch, into);
        }
        let end_gap = |side: usize| near[side].map_or(f64::INFINITY, |near| near.distance_m - ends[side].radius_m);
        let (from, least_m) = match lowest {
            Some((share, touch)) => (share, touch.distance_m - ends[0].toward(ends[1], share).radius_m),
            None if end_gap(0) <= end_gap(1) => (0.0, end_gap(0)),
            None => (1.0, end_gap(1)),
        };
        for (place, to) in [(1, 0.0), (2, 1.0)] {
            if let Some((share, touch)) = self.edge(ends, from, to, least_m) {
                self.report(key(span, LOWEST + place), StrandPoint { span, share }, touch, into);
            }
        }
    }

    /// The edge of a flat stretch: where a span that is flat on the block at the share `from` leaves it towards `to`, if that place is
    /// apart from both.
    fn edge(&self, ends: [Ball; 2], from: f64, to: f64, least_m: f64) -> Option<(f64, signed_distance::Touch)> {
        let length_m = ends[0].centre.distance(ends[1].centre);
        let radius_m = ends[0].radius_m.max(ends[1].radius_m);
        let apart = APART_RADII * radius_m / length_m;
        let level_m = least_m + FLAT_SHARE * radius_m;
        if level_m > self.reach_m || (to - from).abs() <= 2.0 * apart {
            return None;
        }
        let at = |share: f64| {
            let ball = ends[0].toward(ends[1], share);
            let touch = self.field.touch(ball.centre, ball.radius_m + self.reach_m);
            touch.filter(|touch| touch.distance_m - ball.radius_m <= level_m).map(|touch| (share, touch))
        };
        let toward = (to - from).signum();
        let mut flat = at(from + toward * apart)?;
        if at(to).is_some() {
            return None;
        }
        let mut off = to;
        for _ in 0..EDGE_HALVINGS {
            match at(0.5 * (flat.0 + off)) {
                Some(next) => flat = next,
                None => off = 0.5 * (flat.0 + off),
            }
        }
        let [quarter, half] = [0.25, 0.5].map(|part| at(from + (flat.0 - from) * part));
        let is_curved = quarter?.1.normal.distance(half?.1.normal) > FLAT_RAD;
        ((to - flat.0).abs() > apart && !is_curved).then_some(flat)
    }

    /// Adds a place, unless it is too far.
    fn report(&self, key: TouchKey, at: StrandPoint, touch: signed_distance::Touch, into: &mut Vec<Touch>) {
        let StrandPoint { span, share } = at;
        let [a, b] = self.strand.ends(span);
        let ball = if share == 1.0 { b } else { a.toward(b, share) };
        let gap_m = touch.distance_m - ball.radius_m;
        if gap_m <= self.reach_m {
            let normal = self.block.rotation * touch.normal;
            let on_b = crate::Place::Point(ball.centre - normal * touch.distance_m);
            into.push(Touch { key, normal, gap_m, on_a: self.strand.place(span, share, ball, normal), on_b });
        }
    }
}
