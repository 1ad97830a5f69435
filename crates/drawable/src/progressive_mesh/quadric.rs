//! The quadric error of a point: its squared distances from planes, weighted and summed (GH97).
//!
//! In: planes. Out: the error at a point. Never here: meshes.

use glam::DVec3;
use std::ops::AddAssign;

/// Σ w (n·p + d)², stored as pᵀAp + 2 bᵀp + c.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// xx, yy, zz, xy, yz, zx of A.
    a: [f64; 6],
    b: DVec3,
    c: f64,
}

impl Quadric {
    /// The plane through `point` with the unit normal `normal`, weighted.
    pub fn plane(normal: DVec3, point: DVec3, weight: f64) -> Self {
        let (n, d) = (normal, -normal.dot(point));
        let a = [n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.y * n.z, n.z * n.x];
        Self { a: a.map(|x| x * weight), b: n * (d * weight), c: d * d * weight }
    }

    /// The error at a point, ≥ 0.
    pub fn at(&self, p: DVec3) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = self.a;
        let square = xx * p.x * p.x + yy * p.y * p.y + zz * p.z * p.z;
        let mixed = 2.0 * (xy * p.x * p.y + yz * p.y * p.z + zx * p.z * p.x);
        (square + mixed + 2.0 * self.b.dot(p) + self.c).max(0.0)
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.a.iter_mut().zip(other.a).for_each(|(to, from)| *to += from);
        self.b += other.b;
        self.c += other.c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_the_weighted_sum_of_squared_distances() {
        let planes = [(DVec3::Z, DVec3::new(0.0, 0.0, 2.0), 3.0), (DVec3::new(0.6, 0.8, 0.0), DVec3::ONE, 0.5)];
        let mut sum = Quadric::default();
        planes.iter().for_each(|&(n, p, w)| sum += Quadric::plane(n, p, w));
        let at = DVec3::new(-1.0, 4.0, 0.5);
        let expected: f64 = planes.iter().map(|&(n, p, w)| w * n.dot(at - p).powi(2)).sum();
        assert!((sum.at(at) - expected).abs() < 1e-12 * expected); // a few dozen roundings
    }
}
