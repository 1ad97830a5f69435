//! The blocks of A⁻¹ inside the band, without computing the rest (Takahashi's recurrence).
//!
//! In: the factor. Out: the blocks of each slot with itself and with the next two. Theory: docs/theory/rod.md, eq. 18.

use super::Factor;
use crate::rod::block::{Matrix, Number, Symmetric};
use crate::rod::sym3::Sym3;
use glam::DMat3;

/// The blocks of A⁻¹ inside the band.
#[derive(Debug, Clone, Default)]
pub struct InverseBlocks {
    /// A⁻¹(i, i).
    pub diag: Vec<Sym3>,
    /// A⁻¹(i + 1, i); one entry fewer.
    pub near: Vec<DMat3>,
    /// A⁻¹(i + 2, i); two entries fewer.
    pub far: Vec<DMat3>,
}

impl Factor {
    /// The blocks of A⁻¹ inside the band, from the middle to both ends (eq. 18).
    pub fn inverse_blocks(&self, into: &mut InverseBlocks) {
        let (n, pairs) = (self.slots(), self.pairs());
        into.diag.resize(n, Sym3::ZERO);
        into.near.resize(n - 1, DMat3::ZERO);
        into.far.resize(n - 2, DMat3::ZERO);
        self.invert_middle(into, pairs);
        let mut behind = Behind {
            next: Symmetric::of(&into.diag[pairs], &into.diag[pairs + 2]),
            beside: Matrix::of(&into.near[pairs], &into.near[pairs + 1].transpose()),
            after: Symmetric::of(&into.diag[pairs + 1], &into.diag[pairs + 1]),
        };
        for i in (0..pairs).rev() {
            let j = n - 1 - i;
            let far = behind.go_on(&self.ends[i].inverse, &self.ends[i + 1].near, &self.ends[i + 2].far);
            [into.diag[i], into.diag[j]] = behind.next.apart().map(Sym3::from);
            let ([near, mirrored_near], [far, mirrored_far]) = (behind.beside.apart(), far.apart());
            (into.near[i], into.near[j - 1]) = (near.into(), mirrored_near.transposed().into());
            (into.far[i], into.far[j - 2]) = (far.into(), mirrored_far.transposed().into());
        }
    }

    /// The same for the three rows in the middle, which begin at slot `first`.
    fn invert_middle(&self, into: &mut InverseBlocks, first: usize) {
        let [a, b, c] = &*self.middle;
        let mut behind = Behind { next: c.inverse, beside: Matrix::ZERO, after: Symmetric::ZERO };
        into.diag[first + 2] = behind.next.into();
        behind.go_on(&b.inverse, &c.near, &Matrix::ZERO);
        (into.diag[first + 1], into.near[first + 1]) = (behind.next.into(), behind.beside.into());
        into.far[first] = behind.go_on(&a.inverse, &b.near, &c.far).into();
        (into.diag[first], into.near[first]) = (behind.next.into(), behind.beside.into());
    }
}

/// The blocks Z of A⁻¹ of the two rows after row i.
struct Behind<T> {
    /// Z(i + 1, i + 1).
    next: Symmetric<T>,
    /// Z(i + 2, i + 1).
    beside: Matrix<T>,
    /// Z(i + 2, i + 2).
    after: Symmetric<T>,
}

impl<T: Number> Behind<T> {
    /// Advances to row i, given the inverse of its pivot, L(i + 1, i) and L(i + 2, i); returns Z(i + 2, i) (eq. 18).
    #[inline(always)]
    fn go_on(&mut self, inverse: &Symmetric<T>, l1: &Matrix<T>, l2: &Matrix<T>) -> Matrix<T> {
        let Self { next, beside, after } = self;
        let near = Matrix::ZERO.minus(&next.full(), l1).minus(&beside.transposed(), l2);
        let far = Matrix::ZERO.minus(beside, l1).minus(&after.full(), l2);
        let diag = inverse.minus_along(l2, &far).minus_along(l1, &near);
        *self = Self { next: diag, beside: near, after: *next };
        far
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_blocks_are_those_of_the_columns() {
        for n in [3, 5, 9] {
            let mut factor = Factor::default();
            factor.factor(&example(n)).unwrap();
            let mut blocks = InverseBlocks::default();
            factor.inverse_blocks(&mut blocks);
            for i in 0..n {
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    let mut column = vec![DVec3::ZERO; n];
                    column[i] = axis;
                    factor.solve(&mut column);
                    let close = |got: DVec3, at: usize| assert!((got - column[at]).length() < 1e-14, "{i} {at}");
                    close(blocks.diag[i] * axis, i);
                    if i + 1 < n {
                        close(blocks.near[i] * axis, i + 1);
                    }
                    if i + 2 < n {
                        close(blocks.far[i] * axis, i + 2);
                    }
                }
            }
        }
    }
}
