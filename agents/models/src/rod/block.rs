//! 3×3 blocks of scalars or of SIMD lanes: one code for a single block and for two simultaneously in one register.
//!
//! Never here: anything but arithmetic.

use super::sym3::Sym3;
use glam::{DMat3, DVec3};
use std::array::from_fn;
use std::ops::{Add, Div, Mul, Sub};
use wide::f64x2;

/// A scalar, or SIMD lanes that take part in the same arithmetic.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    /// Zero in every lane.
    const ZERO: Self;
    /// One in every lane.
    const ONE: Self;
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
}

impl Number for f64x2 {
    const ZERO: Self = Self::ZERO;
    const ONE: Self = Self::ONE;
}

/// A vector of three.
#[derive(Debug, Clone, Copy)]
pub struct Column<T>(pub [T; 3]);

/// A matrix of three columns.
#[derive(Debug, Clone, Copy)]
pub struct Matrix<T>(pub [[T; 3]; 3]);

/// A symmetric matrix: its diagonal, and the off-diagonal entries yz, xz, xy.
#[derive(Debug, Clone, Copy)]
pub struct Symmetric<T> {
    d: [T; 3],
    o: [T; 3],
}

impl<T: Number> Column<T> {
    /// The zero vector.
    pub const ZERO: Self = Self([T::ZERO; 3]);

    /// self − m v, summed in pairs: keeps the dependency chain from `v` short where each row waits for the one before it.
    #[inline(always)]
    pub fn minus(self, Matrix([x, y, z]): &Matrix<T>, Self(v): Self) -> Self {
        Self(from_fn(|i| (self.0[i] - x[i] * v[0]) - (y[i] * v[1] + z[i] * v[2])))
    }

    /// self − mᵀ v.
    #[inline(always)]
    pub fn minus_transposed(self, Matrix(m): &Matrix<T>, Self(v): Self) -> Self {
        Self(from_fn(|i| (self.0[i] - m[i][0] * v[0]) - (m[i][1] * v[1] + m[i][2] * v[2])))
    }
}

impl<T: Number> Matrix<T> {
    /// The zero matrix.
    pub const ZERO: Self = Self([[T::ZERO; 3]; 3]);

    /// The transpose.
    #[inline(always)]
    pub fn transposed(&self) -> Self {
        let Self(m) = self;
        Self(from_fn(|j| from_fn(|i| m[i][j])))
    }

    /// self − a b.
    #[inline(always)]
    pub fn minus(&self, Self([x, y, z]): &Self, Self(b): &Self) -> Self {
        Self(from_fn(|j| from_fn(|i| self.0[j][i] - (x[i] * b[j][0] + y[i] * b[j][1] + z[i] * b[j][2]))))
    }

    /// self + other.
    #[inline(always)]
    pub fn plus(&self, Self(other): Self) -> Self {
        Self(from_fn(|j| from_fn(|i| self.0[j][i] + other[j][i])))
    }

    /// self − a bᵀ.
    #[inline(always)]
    pub fn minus_across(&self, Self([x, y, z]): &Self, Self([u, v, w]): &Self) -> Self {
        Self(from_fn(|j| from_fn(|i| self.0[j][i] - (x[i] * u[j] + y[i] * v[j] + z[i] * w[j]))))
    }
}

impl<T: Number> Symmetric<T> {
    /// The zero matrix.
    pub const ZERO: Self = Self { d: [T::ZERO; 3], o: [T::ZERO; 3] };

    /// The same matrix with all nine entries.
    #[inline(always)]
    pub fn full(&self) -> Matrix<T> {
        let Self { d, o } = *self;
        Matrix([[d[0], o[2], o[1]], [o[2], d[1], o[0]], [o[1], o[0], d[2]]])
    }

    /// m · self.
    #[inline(always)]
    pub fn after(&self, Matrix([x, y, z]): &Matrix<T>) -> Matrix<T> {
        let Matrix(s) = self.full();
        Matrix(from_fn(|j| from_fn(|i| x[i] * s[j][0] + y[i] * s[j][1] + z[i] * s[j][2])))
    }

    /// self · v.
    #[inline(always)]
    pub fn times(&self, Column(v): Column<T>) -> Column<T> {
        let Matrix([x, y, z]) = self.full();
        Column(from_fn(|i| x[i] * v[0] + y[i] * v[1] + z[i] * v[2]))
    }

    /// self − a bᵀ, where a bᵀ is known to be symmetric.
    #[inline(always)]
    pub fn minus_across(&self, Matrix(a): &Matrix<T>, Matrix(b): &Matrix<T>) -> Self {
        let entry = |i: usize, j: usize| a[0][i] * b[0][j] + a[1][i] * b[1][j] + a[2][i] * b[2][j];
        self.minus([entry(0, 0), entry(1, 1), entry(2, 2)], [entry(1, 2), entry(0, 2), entry(0, 1)])
    }

    /// self + other.
    #[inline(always)]
    pub fn plus(&self, Self { d, o }: Self) -> Self {
        Self { d: from_fn(|i| self.d[i] + d[i]), o: from_fn(|i| self.o[i] + o[i]) }
    }

    #[inline(always)]
    fn minus(&self, d: [T; 3], o: [T; 3]) -> Self {
        Self { d: from_fn(|i| self.d[i] - d[i]), o: from_fn(|i| self.o[i] - o[i]) }
    }

    /// The inverse, by cofactors, and the leading minors, which are all positive and finite if the matrix is positive definite.
    #[inline(always)]
    pub fn inverse(&self) -> (Self, [T; 3]) {
        let Self { d: [xx, yy, zz], o: [yz, xz, xy] } = *self;
        let c = [yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy];
        let e = [xz * xy - xx * yz, yz * xy - yy * xz, yz * xz - zz * xy];
        let det = xx * c[0] + xy * e[2] + xz * e[1];
        let scale = T::ONE / det;
        (Self { d: c.map(|c| c * scale), o: e.map(|e| e * scale) }, [xx, c[2], det])
    }
}

/// Whether all minors of [`Symmetric::inverse`] are positive and finite.
#[inline(always)]
pub fn positive(minors: [f64; 3]) -> bool {
    minors.iter().all(|&m| m > 0.0 && m < f64::INFINITY)
}

impl Symmetric<f64> {}

/// The same entry of two blocks, side by side.
#[inline(always)]
fn pair(front: f64, back: f64) -> f64x2 {
    f64x2::new([front, back])
}

impl Column<f64x2> {
    /// Two columns side by side.
    #[inline(always)]
    pub fn of(front: DVec3, back: DVec3) -> Self {
        Self(from_fn(|i| pair(front[i], back[i])))
    }

    /// Both lanes, separated.
    #[inline(always)]
    pub fn apart(&self) -> [Column<f64>; 2] {
        let [x, y, z] = self.0.map(f64x2::to_array);
        from_fn(|lane| Column([x[lane], y[lane], z[lane]]))
    }
}

impl Matrix<f64x2> {
    /// Two matrices side by side.
    #[inline(always)]
    pub fn of(front: &DMat3, back: &DMat3) -> Self {
        Self(from_fn(|j| from_fn(|i| pair(front.col(j)[i], back.col(j)[i]))))
    }

    /// Both lanes, separated.
    #[inline(always)]
    pub fn apart(&self) -> [Matrix<f64>; 2] {
        let columns = self.0.map(|column| Column(column).apart());
        from_fn(|lane| Matrix(from_fn(|j| columns[j][lane].0)))
    }
}

impl Symmetric<f64x2> {
    /// Two matrices side by side.
    #[inline(always)]
    pub fn of(front: &Sym3, back: &Sym3) -> Self {
        Self { d: Column::of(front.d, back.d).0, o: Column::of(front.o, back.o).0 }
    }

    /// Both lanes, separated.
    #[inline(always)]
    pub fn apart(&self) -> [Symmetric<f64>; 2] {
        let (d, o) = (Column(self.d).apart(), Column(self.o).apart());
        from_fn(|lane| Symmetric { d: d[lane].0, o: o[lane].0 })
    }
}

impl From<DVec3> for Column<f64> {
    #[inline(always)]
    fn from(v: DVec3) -> Self {
        Self(v.to_array())
    }
}

impl From<Column<f64>> for DVec3 {
    #[inline(always)]
    fn from(Column(v): Column<f64>) -> Self {
        Self::from_array(v)
    }
}

impl From<DMat3> for Matrix<f64> {
    #[inline(always)]
    fn from(m: DMat3) -> Self {
        Self(m.to_cols_array_2d())
    }
}

impl From<Matrix<f64>> for DMat3 {
    #[inline(always)]
    fn from(Matrix(m): Matrix<f64>) -> Self {
        Self::from_cols_array_2d(&m)
    }
}

impl From<Sym3> for Symmetric<f64> {
    #[inline(always)]
    fn from(Sym3 { d, o }: Sym3) -> Self {
        Self { d: d.to_array(), o: o.to_array() }
    }
}

impl From<Symmetric<f64>> for Sym3 {
    #[inline(always)]
    fn from(Symmetric { d, o }: Symmetric<f64>) -> Self {
        Self { d: d.into(), o: o.into() }
    }
}
