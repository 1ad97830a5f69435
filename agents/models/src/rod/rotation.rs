//! Conversions between unit quaternions and rotation vectors, by series where angles are small.
//!
//! In and out: pure numbers, the same bits on every machine (series and libm only). Never here: state.
//! Theory: docs/theory/rod.md, eq. 5, 6, 20.

use glam::{DQuat, DVec3};

/// Below this square of the half angle the error of the terms of [`exp`] is less than 1 ulp.
const EXP_SERIES_MAX: f64 = 0.02;
/// Below this square of the half angle's sine the error of the eight terms of [`log`] is less than 1 ulp.
const LOG_SERIES_MAX: f64 = 0.01;
/// Below this square of the angle the error of the five terms of [`bend_share`] is less than 1e-14.
const SHARE_SERIES_MAX: f64 = 0.1;

/// The rotation by `phi` radians about the direction of `phi`.
pub fn exp(phi: DVec3) -> DQuat {
    let a2 = 0.25 * phi.length_squared();
    let (sinc, cos) = if a2 < EXP_SERIES_MAX {
        const SINC: [f64; 5] = [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5_040.0, 1.0 / 362_880.0];
        const COS: [f64; 6] = [1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0, -1.0 / 3_628_800.0];
        (polynomial(&SINC, a2), polynomial(&COS, a2))
    } else {
        let a = a2.sqrt();
        (libm::sin(a) / a, libm::cos(a))
    };
    let v = phi * (0.5 * sinc);
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}

/// The shortest rotation vector of the unit quaternion `q`: angle 0 … π.
pub fn log(q: DQuat) -> DVec3 {
    let v = DVec3::new(q.x, q.y, q.z);
    let (v, w) = if q.w < 0.0 { (-v, -q.w) } else { (v, q.w) };
    let s2 = v.length_squared();
    if s2 < LOG_SERIES_MAX {
        const C: [f64; 8] =
            [1.0, 1.0 / 6.0, 3.0 / 40.0, 5.0 / 112.0, 35.0 / 1152.0, 63.0 / 2816.0, 231.0 / 13312.0, 143.0 / 10240.0];
        return v * (2.0 * polynomial(&C, s2));
    }
    let s = s2.sqrt();
    v * (2.0 * libm::atan2(s, w) / s)
}

/// (1 − (θ/2) cot(θ/2)) / θ² for `theta2` = θ², 0 ≤ θ ≤ π (eq. 6).
pub fn bend_share(theta2: f64) -> f64 {
    if theta2 < SHARE_SERIES_MAX {
        const C: [f64; 5] = [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0];
        return polynomial(&C, theta2);
    }
    let half = 0.5 * theta2.sqrt();
    (1.0 - half * libm::cos(half) / libm::sin(half)) / theta2
}

/// Σ c_i x^i.
#[inline]
fn polynomial(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The third axis of the frame `q`: the axial director.
#[inline]
pub fn director(q: DQuat) -> DVec3 {
    DVec3::new(2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
}

/// The rotation vector of Cayley's map: 2 tan(θ/2) along the axis of `q`; R − 1 = [c]ₓ (R + 1)/2.
#[inline]
pub fn cayley(q: DQuat) -> DVec3 {
    DVec3::new(q.x, q.y, q.z) * (2.0 / q.w)
}

/// `q` normalised to first order; exact to rounding for a length within 1e-8 of one.
#[inline]
pub fn unit(q: DQuat) -> DQuat {
    q * (1.5 - 0.5 * q.length_squared())
}

/// The smallest rotation that takes the unit vector `a` to the unit vector `b`; about any axis where they are opposite.
pub fn shortest_arc(a: DVec3, b: DVec3) -> DQuat {
    let w = 1.0 + a.dot(b);
    if w < 1e-12 {
        let axis = a.any_orthonormal_vector();
        return DQuat::from_xyzw(axis.x, axis.y, axis.z, 0.0);
    }
    let v = a.cross(b);
    DQuat::from_xyzw(v.x, v.y, v.z, w).normalize()
}

/// Interpolates from rotation `a` to `b` by the share `w`; extrapolates where `w` is outside 0 … 1.
pub fn between(a: DQuat, b: DQuat, w: f64) -> DQuat {
    unit(exp(log(b * a.conjugate()) * w) * a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_undoes_exp_on_both_sides_of_every_series() {
        for angle in [0.0, 1e-9, 1e-3, 0.1, 0.199, 0.201, 0.27, 0.29, 0.5, 1.0, 3.0] {
            let phi = DVec3::new(0.6, -0.48, 0.64) * angle;
            // one ulp of the angle for each of about four roundings
            assert!((log(exp(phi)) - phi).length() <= 4.0 * f64::EPSILON * angle.max(1e-300), "{angle}");
        }
    }

    #[test]
    fn cayleys_vector_turns_the_mean_into_the_difference() {
        let (q, v) = (exp(DVec3::new(0.5, -0.3, 0.4)), DVec3::new(0.2, 0.9, -0.4));
        assert!((q * v - v - cayley(q).cross(q * v + v) * 0.5).length() < 1e-15); // a few roundings of 1
    }

    #[test]
    fn the_bend_share_is_smooth_across_its_series() {
        let (below, above) = (SHARE_SERIES_MAX * (1.0 - 1e-12), SHARE_SERIES_MAX * (1.0 + 1e-12));
        // the closed form loses 1/θ² ulp to cancellation
        assert!((bend_share(below) - bend_share(above)).abs() < 1e-14);
    }

    #[test]
    fn the_director_is_the_third_axis() {
        let q = exp(DVec3::new(0.3, -1.2, 0.7));
        assert!((director(q) - q * DVec3::Z).length() < 1e-15); // a few roundings of 1
        let (a, b) = (DVec3::X, DVec3::new(-0.6, 0.8, 0.0));
        assert!((shortest_arc(a, b) * a - b).length() < 1e-15);
        assert!((shortest_arc(a, -a) * a + a).length() < 1e-15);
    }
}
