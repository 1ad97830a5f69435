//! How a rigid body resists impulses: the inverse of its mass and of its inertia.
//!
//! In: masses, locked axes. Out: plain data. Never here: where a body is, what acts on it.

use glam::{DMat3, DVec3};

/// How a rigid body resists: the inverse of its mass and of its inertia about its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseMass {
    /// Inverse of the mass, 1/kg, ≥ 0.
    pub linear_per_kg: f64,
    /// Inverse of the inertia tensor in world axes, 1/(kg·m²).
    pub angular_per_kg_m2: DMat3,
}

/// The inverse of the part of a symmetric `matrix` along the axes that are not `locked`, and zero along the locked ones: the response of a
/// body that moves along, or turns about, the free axes alone.
#[must_use]
pub fn inverse_of_free(matrix: DMat3, locked: [bool; 3]) -> DMat3 {
    let mut free = matrix;
    for axis in (0..3).filter(|axis| locked[*axis]) {
        *free.col_mut(axis) = DVec3::AXES[axis];
        (0..3).filter(|other| *other != axis).for_each(|other| free.col_mut(other)[axis] = 0.0);
    }
    let mut inverse = free.inverse();
    (0..3).filter(|axis| locked[*axis]).for_each(|axis| inverse.col_mut(axis)[axis] = 0.0);
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_locked_answers_nothing_and_the_rest_as_if_it_were_all_there_is() {
        let matrix = DMat3::from_cols_array(&[4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0]);
        let inverse = inverse_of_free(matrix, [false, true, false]);
        // by hand: the inverse of [[4, 0.5], [0.5, 2]] is [[2, -0.5], [-0.5, 4]] / 7.75
        let (xx, xz, zz) = (2.0 / 7.75, -0.5 / 7.75, 4.0 / 7.75);
        let by_hand = DMat3::from_cols_array(&[xx, 0.0, xz, 0.0, 0.0, 0.0, xz, 0.0, zz]);
        assert!(inverse.abs_diff_eq(by_hand, 1e-15), "{inverse}");
        assert_eq!(inverse_of_free(matrix, [true; 3]), DMat3::ZERO);
        assert_eq!(inverse_of_free(matrix, [false; 3]), matrix.inverse());
    }
}
