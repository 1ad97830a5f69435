//! Narrow phase: the contacts between the shapes of any two forms.
//!
//! In: two placed forms. Out: contacts with normals, gaps and places, each with a key that persists; the nearest gap.
//! Never here: velocities, forces. Theory: `docs/theory/contact.md`.
//!
//! Each form is decomposed into strands (balls joined by spans: a ball, a capsule, a tube), the surfaces of soft bodies, and
//! blocks (all the rest).
//! All gaps are found in double precision; where blocks rest on blocks the corners and edges are clipped by parry.
//! A half space belongs to the static solids: blocks ignore it here, strands do not.

mod blocks;
mod primitives;
mod shape_cache;
mod skins;
mod static_solid;
mod strands;
mod swept;
#[cfg(test)]
mod tests;
mod touch_key;

#[cfg(test)]
use crate::solids::collision_shape::{CollisionShape, ShapeKind};
use crate::solids::collision_shape::{PlacedShape, ShapePose, Touch};
use blocks::convex_convex::ConvexScratch;
use glam::DVec3;
use primitives::{Piece, Pieces};
use shape_cache::ShapeCache;
use skins::surface::SurfaceScratch;
pub use skins::voronoi_regions::VoronoiRegions;
pub use static_solid::{StaticSolid, StaticSolidError};
use strands::chain_chain::ChainScratch;
pub use strands::self_chain::{FacingPoints, PLACES, RestedChain, SegmentPairs};
use swept::SweptScratch;
pub use swept::{SweptReach, SweptShape, first_touch};
pub use touch_key::{TouchKey, TouchKind};

/// Reusable storage for contact searches: one for each agent.
#[derive(Default)]
pub struct NarrowPhaseScratch {
    known: ShapeCache,
    searches: Searches,
    swept: SweptScratch,
}

/// The searches between kinds of pieces, with their storage.
#[derive(Default)]
struct Searches {
    chains: ChainScratch,
    blocks: ConvexScratch,
    surfaces: SurfaceScratch,
    segments: SegmentPairs,
}

/// Every contact with a gap of at most `reach_m` (metres, ≥ 0), by rising keys; the previous contents of `into` are dropped.
/// Returns how far at least all that was left out is, metres: where nothing was found, a bound of the distance of the two.
///
/// Nothing is allocated once the numbers of nodes and contacts settle.
/// Forms without a shape and places that are not finite touch nothing.
pub fn touches(
    a: &PlacedShape<'_>,
    b: &PlacedShape<'_>,
    reach_m: f64,
    scratch: &mut NarrowPhaseScratch,
    into: &mut Vec<Touch>,
) -> f64 {
    into.clear();
    let NarrowPhaseScratch { known, searches, .. } = scratch;
    known.prepare(a, b);
    let (first, second) = (Pieces::of(a, known), Pieces::of(b, known));
    let mut clear_m = f64::INFINITY;
    for (i, piece) in first.iter() {
        for (j, other) in second.iter() {
            clear_m = clear_m.min(searches.touches([(i, &piece), (j, &other)], reach_m, into));
        }
    }
    finish(into);
    clear_m
}

impl Searches {
    /// Adds every place within `reach_m` of two pieces, given with their numbers. Returns how far at least all others are, metres.
    fn touches(&mut self, pieces: [(usize, &Piece<'_>); 2], reach_m: f64, into: &mut Vec<Touch>) -> f64 {
        let Self { chains, blocks, surfaces, .. } = self;
        let [(i, piece), (j, other)] = pieces;
        let bounds_m = piece.bounds_apart_m(other);
        if bounds_m > reach_m || bounds_m.is_nan() {
            return bounds_m.max(reach_m);
        }
        let (from, mut clear_m) = (into.len(), reach_m);
        match (piece, other) {
            (Piece::Strand(a), Piece::Strand(b)) => chains.touches(a, b, reach_m, into),
            (Piece::Strand(a), Piece::Block(b)) => strands::chain_convex::touches(a, b, reach_m, into),
            (Piece::Block(a), Piece::Strand(b)) => {
                strands::chain_convex::touches(b, a, reach_m, into);
                into[from..].iter_mut().for_each(|touch| *touch = flipped(*touch));
            }
            // clipping depends on the order: the larger block is first, whichever agent calls
            (Piece::Block(a), Piece::Block(b)) if a.around.radius_m < b.around.radius_m => {
                clear_m = blocks.touches(b, a, reach_m, into);
                into[from..].iter_mut().for_each(|touch| *touch = flipped(*touch));
            }
            (Piece::Block(a), Piece::Block(b)) => clear_m = blocks.touches(a, b, reach_m, into),
            (Piece::Surface(a), other) => surfaces.touches(a, other, reach_m, into),
            (other, Piece::Surface(b)) => {
                surfaces.touches(b, other, reach_m, into);
                into[from..].iter_mut().for_each(|touch| *touch = flipped(*touch));
            }
        }
        into[from..].iter_mut().for_each(|touch| touch.key.pieces = [i as u8, j as u8]);
        clear_m
    }

    /// The nearest place of two pieces: its normal from the second towards the first, and a gap that is never larger than the true one.
    fn gap(&mut self, piece: &Piece<'_>, other: &Piece<'_>, reach_m: f64) -> Option<(DVec3, f64)> {
        let Self { chains, blocks, .. } = self;
        let bounds_m = piece.bounds_apart_m(other);
        if bounds_m > reach_m || bounds_m.is_nan() {
            return None;
        }
        match (piece, other) {
            (Piece::Strand(a), Piece::Strand(b)) => chains.gap(a, b, reach_m),
            (Piece::Strand(a), Piece::Block(b)) => strands::chain_convex::gap(a, b, reach_m),
            (Piece::Block(a), Piece::Strand(b)) => {
                strands::chain_convex::gap(b, a, reach_m).map(|(n, gap_m)| (-n, gap_m))
            }
            (Piece::Block(a), Piece::Block(b)) => blocks.gap(a, b, reach_m),
            (Piece::Surface(a), other) => Some(skins::surface::gap(a, other)),
            (other, Piece::Surface(b)) => Some(skins::surface::gap(b, other)).map(|(n, gap_m)| (-n, gap_m)),
        }
    }
}

/// Drops touches that are not finite, sorts by rising keys and makes equal keys differ.
fn finish(into: &mut Vec<Touch>) {
    into.retain(|touch| touch.gap_m.is_finite() && touch.normal.is_finite());
    name(into);
}

/// A deformable at rest: its parts that are near each other there never touch.
#[derive(Debug, Clone, Copy)]
pub enum RestShape<'a> {
    /// The arc length of each node of a tube, metres.
    Chain(&'a [f64]),
    /// The vertices of a soft body, in any axes, metres.
    Surface(&'a [DVec3]),
}

/// Every contact of a deformable with itself with a gap of at most `reach_m` (metres, ≥ 0), by rising keys; the previous contents of `into` are
/// dropped. Both places are on the same shape; of two segments or edges the lower number is on the first side, of a vertex and a triangle the
/// vertex. Nothing touches itself that is rigid, not finite or of another kind than its rest.
pub fn self_touches(
    placed: &PlacedShape<'_>,
    rest: RestShape<'_>,
    reach_m: f64,
    scratch: &mut NarrowPhaseScratch,
    into: &mut Vec<Touch>,
) {
    into.clear();
    let NarrowPhaseScratch { known, searches, .. } = scratch;
    match (placed.view, rest) {
        (ShapePose::Chain { positions, radii_m }, RestShape::Chain(arc_m)) => {
            let chain = RestedChain { positions, radii_m, arc_m };
            if chain.is_whole() {
                searches.segments.touches(&chain, reach_m, into);
            }
        }
        (ShapePose::Surface(positions), RestShape::Surface(rest)) if positions.len() == rest.len() => {
            known.prepare_pieces(placed);
            for (_, piece) in Pieces::of(placed, known).iter() {
                if let Piece::Surface(surface) = piece {
                    searches.surfaces.self_touches(&surface, rest, reach_m, into);
                }
            }
        }
        _ => {}
    }
    finish(into);
}

/// The same contact seen from the other side.
fn flipped(touch: Touch) -> Touch {
    Touch { normal: -touch.normal, on_a: touch.on_b, on_b: touch.on_a, ..touch }
}

/// Sorts contacts by their keys and makes equal keys differ.
fn name(touches: &mut [Touch]) {
    touches.sort_unstable_by_key(|touch| touch.key);
    for i in 1..touches.len() {
        let (before, key) = (touches[i - 1].key, &mut touches[i].key);
        if *key <= before {
            *key = TouchKey { place: before.place + 1, ..before };
        }
    }
}

/// The normal from b towards a where they are nearest, and a gap that is never larger than the true one there, metres;
/// `None` beyond `reach_m`. For conservative advancement: near its end the bound is within a millionth of the sizes.
pub fn gap(
    a: &PlacedShape<'_>,
    b: &PlacedShape<'_>,
    reach_m: f64,
    scratch: &mut NarrowPhaseScratch,
) -> Option<(DVec3, f64)> {
    let NarrowPhaseScratch { known, searches, .. } = scratch;
    known.prepare(a, b);
    let (first, second) = (Pieces::of(a, known), Pieces::of(b, known));
    let mut nearest: Option<(DVec3, f64)> = None;
    for (_, piece) in first.iter() {
        for (_, other) in second.iter() {
            let reach_m = nearest.map_or(reach_m, |(_, gap_m)| gap_m.min(reach_m));
            let found = searches.gap(&piece, &other, reach_m);
            nearest = found.filter(|&(_, gap_m)| nearest.is_none_or(|(_, least)| gap_m < least)).or(nearest);
        }
    }
    nearest.filter(|&(_, gap_m)| gap_m <= reach_m)
}
