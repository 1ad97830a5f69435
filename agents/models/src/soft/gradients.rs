//! Conjugate gradients for large solids: some tens of products in place of a factor's N² operations.
//!
//! In: the lower half of a symmetric positive definite matrix in 3 × 3 blocks, a right side, a start. Out: a solution. Never here: elements.
//! Theory: docs/theory/soft.md, eq. 2.

use super::system::{NOT_POSITIVE, UNENDED};
use glam::{DMat3, DVec3};
use metachron_contact::solve::{Block, multiply};

/// The residual may change no vertex by itself by more than this, m/s: a hundredth of the tolerance of contacts.
const LEFT_M_S: f64 = 5e-8;
/// The most products of one solution: tens for soft tissue, thousands for a stiff body without a factor.
const PRODUCTS_MAX: u32 = 20_000;

/// The storage of conjugate gradients.
#[derive(Debug, Default)]
pub(super) struct Gradients {
    /// The inverse of each diagonal block.
    mobilities: Vec<DMat3>,
    left: Vec<DVec3>,
    direction: Vec<DVec3>,
    image: Vec<DVec3>,
    /// The inverse of the matrix of all vertices moving alike, of the blocks approached last.
    alike: DMat3,
    /// Products of the last solution.
    pub products: u32,
}

impl Gradients {
    /// Moves `x` as a whole, which is all that a free fall needs; returns the residual of A x = `right`.
    pub fn approach(&mut self, blocks: &[Block], right: &[DVec3], x: &mut [DVec3]) -> &[DVec3] {
        let Self { left, image, alike, products, .. } = self;
        image.resize(x.len(), DVec3::ZERO);
        *alike = together(blocks).inverse();
        measure(blocks, right, x, image, left);
        shift(x, *alike, left);
        measure(blocks, right, x, image, left);
        *products = 2;
        left
    }

    /// The velocity of all vertices alike that answers impulses on them in sum, m/s, by the blocks approached last.
    pub fn answer_alike(&self, impulses: &[DVec3]) -> DVec3 {
        self.alike * impulses.iter().sum::<DVec3>()
    }

    /// Moves `x` to the solution of A x = `right`, where A has `blocks` with those of the diagonal at these places.
    ///
    /// # Errors
    /// The reason why A is found not to be positive definite, or the solution not to end.
    pub fn solve(
        &mut self,
        blocks: &[Block],
        diagonal: &[u32],
        right: &[DVec3],
        x: &mut [DVec3],
    ) -> Result<(), &'static str> {
        self.approach(blocks, right, x);
        let Self { mobilities, left, direction, image, alike, products } = self;
        mobilities.clear();
        mobilities.extend(diagonal.iter().map(|at| blocks[*at as usize].value.inverse()));
        direction.clear();
        direction.resize(x.len(), DVec3::ZERO);
        let mut power = f64::INFINITY;
        while *products < PRODUCTS_MAX {
            let (mut size, mut worst) = (0.0, 0.0_f64);
            for (left, mobility) in left.iter().zip(&*mobilities) {
                let answer = *mobility * *left;
                size += left.dot(answer);
                worst = worst.max(answer.abs().max_element());
            }
            if worst <= LEFT_M_S {
                shift(x, *alike, left);
                return if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(NOT_POSITIVE) };
            }
            let kept = size / std::mem::replace(&mut power, size);
            if !(size > 0.0 && size.is_finite()) {
                return Err(NOT_POSITIVE);
            }
            for ((direction, left), mobility) in direction.iter_mut().zip(&*left).zip(&*mobilities) {
                *direction = *mobility * *left + *direction * kept;
            }
            multiply(blocks, direction, image);
            *products += 1;
            let along = power / dot(direction, image);
            if !(along > 0.0 && along.is_finite()) {
                return Err(NOT_POSITIVE);
            }
            for ((x, left), (direction, image)) in x.iter_mut().zip(&mut *left).zip(direction.iter().zip(&*image)) {
                *x += *direction * along;
                *left -= *image * along;
            }
        }
        Err(UNENDED)
    }
}

/// The residual of a solution.
fn measure(blocks: &[Block], right: &[DVec3], x: &[DVec3], image: &mut [DVec3], left: &mut Vec<DVec3>) {
    multiply(blocks, x, image);
    left.clear();
    left.extend(right.iter().zip(&*image).map(|(right, image)| *right - *image));
}

/// Moves all vertices alike, so that the residual `left` sums to nothing: momentum is kept to rounding.
fn shift(x: &mut [DVec3], alike: DMat3, left: &[DVec3]) {
    let by = alike * left.iter().sum::<DVec3>();
    x.iter_mut().for_each(|x| *x += by);
}

/// The matrix of all vertices moving alike.
fn together(blocks: &[Block]) -> DMat3 {
    let of = |Block { row, column, value }: &Block| if row == column { *value } else { *value + value.transpose() };
    blocks.iter().map(of).fold(DMat3::ZERO, |sum, value| sum + value)
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs, held at one end.
    fn chain(count: usize) -> (Vec<Block>, Vec<u32>) {
        let block =
            |row, column, k: f64| Block { row, column, value: DMat3::from_diagonal(DVec3::new(k, 2.0 * k, 3.0 * k)) };
        let mut blocks = vec![block(0, 0, 2.0)];
        (1..count).for_each(|row| blocks.extend([block(row, row - 1, -1.0), block(row, row, 2.0)]));
        let diagonal = (0..count as u32).map(|row| 2 * row).collect();
        (blocks, diagonal)
    }

    #[test]
    fn the_solution_is_that_of_a_chain_of_springs() {
        let count = 50;
        let (blocks, diagonal) = chain(count);
        let mut x = vec![DVec3::ONE; count];
        Gradients::default().solve(&blocks, &diagonal, &vec![DVec3::Z * 3e-3; count], &mut x).unwrap();
        for (at, x) in x.iter().enumerate() {
            // k u'' = −f between two walls
            let exact = 1e-3 * 0.5 * (at as f64 + 1.0) * (count - at) as f64;
            assert!(x.distance(DVec3::Z * exact) < 1e-4, "{at}: {x} is not {exact}");
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_is_told() {
        let (mut blocks, diagonal) = chain(5);
        blocks[4].value = DMat3::from_diagonal(DVec3::splat(-1.0));
        let refused = Gradients::default().solve(&blocks, &diagonal, &[DVec3::ONE; 5], &mut [DVec3::ZERO; 5]);
        assert_eq!(refused, Err(NOT_POSITIVE));
    }
}
