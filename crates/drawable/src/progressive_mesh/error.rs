//! The measured distance of cuts from the full mesh.
//!
//! In: an ordered mesh. Out: a table of counts and errors, monotone. Never here: estimates.

use super::ProgressiveMesh;
use glam::DVec3;
use metachron_geometry::near_triangle;
use rapier3d::parry::bounding_volume::Aabb;
use rapier3d::parry::partitioning::{Bvh, BvhBuildStrategy, TraversalAction};

/// Rows of the table per doubling of the count.
const ROWS: f64 = 1.5;
/// Most vertices whose distance is measured per row.
const SAMPLES: usize = 500;

/// (triangles, error in metres) from coarse to fine; the error never increases.
pub(super) fn table(tom: &ProgressiveMesh) -> Vec<(u32, f32)> {
    let (least, most) = tom.range();
    let doublings = libm::log2(f64::from(most) / f64::from(least.max(1)));
    let rows = (ROWS * doublings).ceil().max(1.0) as u32;
    let count = |row: u32| {
        let share = f64::from(row) / f64::from(rows);
        (f64::from(least.max(1)) * libm::exp2(doublings * share)).round() as u32
    };
    let mut table: Vec<(u32, f32)> = Vec::with_capacity(rows as usize + 1);
    let mut worst = 0.0_f32;
    for row in (0..=rows).rev() {
        let triangles = if row == rows { most } else { tom.cut(count(row)).triangles };
        worst = if triangles == most { 0.0 } else { worst.max(distance(tom, triangles) as f32) };
        table.push((triangles, worst));
    }
    table.reverse();
    table.dedup_by_key(|row| row.0);
    table
}

/// The error of a count between the rows, by the power law through the neighbouring two.
pub(super) fn at(table: &[(u32, f32)], triangles: u32) -> f64 {
    let right = table.partition_point(|row| row.0 <= triangles);
    let Some(&(n0, e0)) = right.checked_sub(1).and_then(|left| table.get(left)) else {
        return table.first().map_or(0.0, |row| f64::from(row.1));
    };
    let Some(&(n1, e1)) = table.get(right) else { return f64::from(e0) };
    let share = libm::log(f64::from(triangles) / f64::from(n0)) / libm::log(f64::from(n1) / f64::from(n0));
    let (e0, e1) = (f64::from(e0), f64::from(e1));
    // an error of zero has no logarithm: the last interval is linear
    if e1 > 0.0 { e0 * libm::pow(e1 / e0, share) } else { e0 * (1.0 - share) }
}

/// The greatest distance of sampled vertices of the full mesh from a cut, metres.
pub(super) fn distance(tom: &ProgressiveMesh, triangles: u32) -> f64 {
    let mut corners = Vec::with_capacity(triangles as usize);
    tom.resolve(tom.cut(triangles), &mut corners);
    let faces: Vec<[DVec3; 3]> =
        corners.iter().map(|t| t.map(|i| tom.vertices()[i as usize].core.as_dvec3())).collect();
    let boxes: Vec<Aabb> = faces.iter().map(|[a, b, c]| around([a.min(*b).min(*c), a.max(*b).max(*c)])).collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    // corners of a box that is the coarsest cut are not of the full mesh
    let first = tom.triangles.iter().flatten().min().map_or(0, |&i| i as usize);
    let own = &tom.vertices()[first..];
    let stride = own.len().div_ceil(SAMPLES);
    own.iter().rev().step_by(stride).map(|v| nearest(&tree, &faces, v.core.as_dvec3())).fold(0.0, f64::max)
}

fn around([low, high]: [DVec3; 2]) -> Aabb {
    Aabb::new(low.as_vec3(), high.as_vec3())
}

fn nearest(tree: &Bvh, faces: &[[DVec3; 3]], point: DVec3) -> f64 {
    let mut best = f64::INFINITY;
    tree.traverse(|node| {
        let (low, high) = (node.mins().as_dvec3(), node.maxs().as_dvec3());
        if (low - point).max(point - high).max(DVec3::ZERO).length_squared() >= best {
            return TraversalAction::Prune;
        }
        if let Some(leaf) = node.leaf_data() {
            best = best.min(near_triangle(point, faces[leaf as usize]).distance_squared(point));
        }
        TraversalAction::Continue
    });
    best.sqrt()
}
