//! Symmetric 3×3 matrices: six numbers.
//!
//! Never here: anything but arithmetic.

use super::block::{Symmetric, positive};
use glam::{DMat3, DVec3};
use std::ops::{Add, AddAssign, Mul};

/// A symmetric 3×3 matrix.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sym3 {
    /// The diagonal: xx, yy, zz.
    pub d: DVec3,
    /// The off-diagonal entries: yz, xz, xy.
    pub o: DVec3,
}

impl Sym3 {
    /// The zero matrix.
    pub const ZERO: Self = Self { d: DVec3::ZERO, o: DVec3::ZERO };

    /// The matrix with this diagonal.
    #[inline]
    pub fn diagonal(d: DVec3) -> Self {
        Self { d, o: DVec3::ZERO }
    }

    /// `scale` times the identity.
    #[inline]
    pub fn identity(scale: f64) -> Self {
        Self::diagonal(DVec3::splat(scale))
    }

    /// scale · v vᵀ.
    #[inline]
    pub fn outer(v: DVec3, scale: f64) -> Self {
        let w = v * scale;
        Self { d: w * v, o: DVec3::new(w.y * v.z, w.x * v.z, w.x * v.y) }
    }

    /// The same matrix with all nine entries.
    #[inline]
    pub fn full(&self) -> DMat3 {
        let Self { d, o } = *self;
        DMat3::from_cols(DVec3::new(d.x, o.z, o.y), DVec3::new(o.z, d.y, o.x), DVec3::new(o.y, o.x, d.z))
    }

    /// The inverse; `None` where the matrix is not positive definite or not finite.
    #[inline]
    pub fn inverse(&self) -> Option<Self> {
        let (inverse, minors) = Symmetric::from(*self).inverse();
        positive(minors).then(|| inverse.into())
    }
}

impl Mul<DVec3> for Sym3 {
    type Output = DVec3;
    #[inline]
    fn mul(self, v: DVec3) -> DVec3 {
        let Self { d, o } = self;
        DVec3::new(
            d.x * v.x + o.z * v.y + o.y * v.z,
            o.z * v.x + d.y * v.y + o.x * v.z,
            o.y * v.x + o.x * v.y + d.z * v.z,
        )
    }
}

impl Mul<f64> for Sym3 {
    type Output = Self;
    #[inline]
    fn mul(self, scale: f64) -> Self {
        Self { d: self.d * scale, o: self.o * scale }
    }
}

impl Add for Sym3 {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self { d: self.d + other.d, o: self.o + other.o }
    }
}

impl AddAssign for Sym3 {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_matrix() {
        let m = Sym3::diagonal(DVec3::new(2.0, 3.0, 4.0)) + Sym3::outer(DVec3::new(1.0, -2.0, 0.5), 0.7);
        let product = m.full() * m.inverse().unwrap().full();
        assert!((product - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 1e-14), "{product}"); // condition 3
        assert_eq!(Sym3::diagonal(DVec3::new(1.0, 1.0, -1.0)).inverse(), None);
    }
}
