//! Principal axes of symmetric matrices.
//!
//! In: a matrix. Out: its eigenvalues and axes. Never here: their meaning.

use glam::{DMat3, DVec3};

/// The eigenvalues of a symmetric matrix, and a rotation whose columns are its eigenvectors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PrincipalAxes {
    pub values: DVec3,
    pub axes: DMat3,
}

/// The principal axes of a symmetric matrix, by Jacobi rotations.
pub(crate) fn principal_axes(mut matrix: DMat3) -> PrincipalAxes {
    /// Number of sweeps. Each squares the off-diagonal part: from any start, double precision is reached in six.
    const SWEEPS: usize = 8;
    let mut axes = DMat3::IDENTITY;
    for (p, q) in (0..SWEEPS).flat_map(|_| [(0, 1), (0, 2), (1, 2)]) {
        let off = matrix.col(q)[p];
        let (low, high) = (matrix.col(p)[p], matrix.col(q)[q]);
        // an entry lost against the diagonal turns nothing
        if off.abs() <= 1e-3 * f64::EPSILON * (low.abs() + high.abs()) {
            continue;
        }
        let theta = (high - low) / (2.0 * off);
        let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
        let cos = 1.0 / (t * t + 1.0).sqrt();
        let mut turn = DMat3::IDENTITY;
        turn.col_mut(p)[p] = cos;
        turn.col_mut(q)[q] = cos;
        turn.col_mut(q)[p] = t * cos;
        turn.col_mut(p)[q] = -t * cos;
        matrix = turn.transpose() * matrix * turn;
        axes *= turn;
    }
    PrincipalAxes { values: matrix.diagonal(), axes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn principal_axes_bring_the_matrix_back() {
        let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0));
        let matrix = turn * DMat3::from_diagonal(DVec3::new(3.0, 1.0, 2.0)) * turn.transpose();
        let PrincipalAxes { values, axes } = principal_axes(matrix);
        let back = axes * DMat3::from_diagonal(values) * axes.transpose();
        assert!(back.abs_diff_eq(matrix, 1e-14), "{back}"); // rounding of numbers near 3
        assert!((axes.determinant() - 1.0).abs() < 1e-14, "{axes}");
    }
}
