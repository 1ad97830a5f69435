//! Projections on Coulomb's disc, on a ball and on an interval, with their slopes.
//!
//! In: an impulse in the frame of a contact (x along the normal). Out: the nearest allowed one, and how it changes with the first.
//! Never here: velocities, compliance. Theory: `docs/theory/clusters.md`, eq. 7.

use glam::{DMat3, DVec3};

/// A contact sticks while its friction is below this share of the most that Coulomb allows, a row while its impulse is of the most it may give.
pub(crate) const STICK_SHARE: f64 = 0.999;

/// The impulses that a row may give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Law {
    /// Impulses in Coulomb's cone: no pull, and friction up to μ times the push.
    Coulomb {
        /// The coefficient μ.
        friction: f64,
    },
    /// All up to a length.
    Bounded {
        /// The length, N·s; infinite for all.
        limit: f64,
    },
    /// Impulses along the first axis between two bounds.
    Between {
        /// The least, ≤ 0.
        low: f64,
        /// The most, ≥ 0.
        high: f64,
    },
    /// None: nothing that the row touches moves.
    Idle,
}

/// A projection: its value, and its slope as three directions with a number each.
///
/// Of the disc the slope leaves out how the radius grows with the pressure, so that it is symmetric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Projection {
    pub value: DVec3,
    /// Orthonormal columns.
    pub axes: DMat3,
    /// The slope along each of them, 0 to 1.
    pub slopes: DVec3,
}

impl Law {
    /// The allowed impulse for `z`.
    #[inline]
    pub fn project(&self, z: DVec3) -> Projection {
        match *self {
            Self::Coulomb { friction } => disc(friction, z),
            Self::Bounded { limit } => ball(limit, z),
            Self::Between { low, high } => Projection {
                value: DVec3::X * z.x.clamp(low, high),
                axes: DMat3::IDENTITY,
                slopes: if z.x >= low && z.x <= high { DVec3::X } else { DVec3::ZERO },
            },
            Self::Idle => Projection::NONE,
        }
    }
}

impl Projection {
    const NONE: Self = Self { value: DVec3::ZERO, axes: DMat3::IDENTITY, slopes: DVec3::ZERO };

    fn whole(z: DVec3) -> Self {
        Self { value: z, axes: DMat3::IDENTITY, slopes: DVec3::ONE }
    }

    /// The slope's matrix with other numbers along the same directions.
    pub fn along_axes(&self, numbers: DVec3) -> DMat3 {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = self.axes;
        outer(x, x) * numbers.x + outer(y, y) * numbers.y + outer(z, z) * numbers.z
    }
}

/// a bᵀ.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Coulomb's law at the pressure of `z` itself.
#[inline]
fn disc(friction: f64, z: DVec3) -> Projection {
    if z.x <= 0.0 {
        return Projection::NONE;
    }
    let (slip, radius) = (tangential(z), friction * z.x);
    if slip <= radius {
        return Projection::whole(z);
    }
    let along = DVec3::new(0.0, z.y / slip, z.z / slip);
    Projection {
        value: DVec3::new(z.x, radius * along.y, radius * along.z),
        axes: DMat3::from_cols(DVec3::X, along, DVec3::X.cross(along)),
        slopes: DVec3::new(1.0, 0.0, radius / slip),
    }
}

/// The nearest impulse of a length up to `limit`.
#[inline]
fn ball(limit: f64, z: DVec3) -> Projection {
    let length = z.length();
    if length <= limit {
        return Projection::whole(z);
    }
    let (along, share) = (z / length, limit / length);
    let side = along.any_orthonormal_vector();
    Projection {
        value: z * share,
        axes: DMat3::from_cols(along, side, along.cross(side)),
        slopes: DVec3::new(0.0, share, share),
    }
}

/// The length of the part across the normal.
pub(crate) fn tangential(z: DVec3) -> f64 {
    let square = z.y * z.y + z.z * z.z;
    // `hypot` takes four times as long, and is needed where squares overflow alone
    if square.is_finite() { square.sqrt() } else { z.y.hypot(z.z) }
}
