//! Contacts between forms against brute force, closed forms and each other.

mod blocks;
mod pairs;
mod promises;
mod rounds;
mod self_touches;
mod static_solids;
mod surfaces;
mod swept;
mod tubes;

use super::*;
use crate::{Place, SolidShape};
use crate::{Solid, ToolShape};
use glam::DQuat;
use proptest::prelude::*;

/// A form of a solid without friction; its centre of mass is its origin.
fn solid(solid: Solid, radius_m: f64) -> CollisionShape {
    let shape = solid.to_shared_shape().unwrap();
    let kind = ShapeKind::Solid(SolidShape { solid, shape, com_local: DVec3::ZERO, radius_m });
    CollisionShape::new(kind, 0.0)
}

fn ball(radius_m: f64) -> CollisionShape {
    solid(Solid::Ball { radius_m }, radius_m)
}

fn capsule(radius_m: f64, half_height_m: f64) -> CollisionShape {
    solid(Solid::Capsule { radius_m, half_height_m }, radius_m + half_height_m)
}

fn cylinder(radius_m: f64, half_height_m: f64) -> CollisionShape {
    solid(Solid::Cylinder { radius_m, half_height_m }, radius_m.hypot(half_height_m))
}

fn cuboid(half_extents_m: DVec3) -> CollisionShape {
    solid(Solid::Box { half_extents_m }, half_extents_m.length())
}

/// The box as the hull of its corners.
fn hull(half: DVec3) -> CollisionShape {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let points_m = (0..8).map(|i| half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    solid(Solid::Hull { points_m }, half.length())
}

fn chain() -> CollisionShape {
    CollisionShape::new(ShapeKind::Chain, 0.0)
}

fn tool() -> CollisionShape {
    CollisionShape::new(ShapeKind::Tool(ToolShape::default()), 0.0)
}

fn at(form: &CollisionShape, position: DVec3, rotation: DQuat) -> PlacedShape<'_> {
    PlacedShape { form, view: ShapePose::Solid { position, rotation } }
}

fn along<'a>(form: &'a CollisionShape, positions: &'a [DVec3], radii_m: &'a [f64]) -> PlacedShape<'a> {
    PlacedShape { form, view: ShapePose::Chain { positions, radii_m } }
}

fn all(a: &PlacedShape<'_>, b: &PlacedShape<'_>, reach_m: f64) -> Vec<Touch> {
    let mut into = Vec::new();
    touches(a, b, reach_m, &mut NarrowPhaseScratch::default(), &mut into);
    into
}

fn nearest(a: &PlacedShape<'_>, b: &PlacedShape<'_>, reach_m: f64) -> Option<(DVec3, f64)> {
    gap(a, b, reach_m, &mut NarrowPhaseScratch::default())
}

fn lowest(touches: &[Touch]) -> Touch {
    *touches.iter().min_by(|p, q| p.gap_m.total_cmp(&q.gap_m)).expect("they touch")
}

/// The place in the world, and how far the surface is from it along the contact's normal.
fn axis(place: Place, positions: &[DVec3]) -> (DVec3, f64) {
    match place {
        Place::Point(point) => (point, 0.0),
        Place::Chain { segment, share, radius_m } => {
            let k = segment as usize;
            (positions[k].lerp(positions[k + 1], share), radius_m)
        }
        Place::Surface { vertices, shares } => {
            (vertices.into_iter().zip(shares).map(|(vertex, share)| positions[vertex as usize] * share).sum(), 0.0)
        }
    }
}

/// Whether the places of a contact are as far apart as it says, along its normal.
fn adds_up(touch: &Touch, a: &[DVec3], b: &[DVec3]) -> bool {
    let ((p, ra), (q, rb)) = (axis(touch.on_a, a), axis(touch.on_b, b));
    (touch.normal.length() - 1.0).abs() < 1e-12 && (p - q - touch.normal * (touch.gap_m + ra + rb)).length() < 1e-9
}

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from_array)
}

fn turn() -> impl Strategy<Value = DQuat> {
    (vector(1.0), -3.1..3.1).prop_map(|(axis, angle)| DQuat::from_axis_angle(axis.normalize_or(DVec3::X), angle))
}

/// Nodes of a crooked line that starts at the first point; steps of up to 2 cm.
fn crooked(nodes: usize) -> impl Strategy<Value = Vec<DVec3>> {
    (vector(0.02), prop::collection::vec(vector(0.012), nodes)).prop_map(|(start, steps)| {
        let mut at = start;
        steps
            .iter()
            .map(|step| {
                at += *step;
                at
            })
            .collect()
    })
}
