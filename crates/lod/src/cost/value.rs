//! The value of an instance in Robin Hood (RH05, §5.4): area over depth, in four strengths.
//!
//! In: unprojected area, depth, distance, importance. Out: a value. Never here: levels; every form of an instance has one value.
//! Theory: `docs/theory/budget.md`, eq. 49.

/// How fast value falls with depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Value {
    /// a/√z (RH05, eq. 8): distant objects keep much; little time stays unspent.
    Gentle,
    /// a/z (RH05, eq. 9).
    Plain,
    /// a/z² (RH05, eq. 10): near objects take nearly all; much time stays unspent.
    Steep,
    /// √(a/d²) by the distance from the eye (RH05, eq. 11, one reading).
    Focus,
    /// √a/d² (RH05, eq. 11, the other reading).
    FocusSteep,
}

/// The least depth and distance, in the scene's unit: anything nearer counts as this near.
const NEAREST: f64 = 1e-3;

impl Value {
    /// The value of an instance of unprojected area `a` at depth `z` along the view, at distance `d` from the eye, times its importance.
    ///
    /// 0 if a number is invalid, the area or the importance is not above 0, or the instance is behind the eye.
    #[must_use]
    pub fn of(self, a: f64, z: f64, d: f64, importance: f64) -> f64 {
        let (z_near, d_near) = (z.max(NEAREST), d.max(NEAREST));
        let value = importance
            * match self {
                Self::Gentle => a / libm::sqrt(z_near),
                Self::Plain => a / z_near,
                Self::Steep => a / (z_near * z_near),
                Self::Focus => libm::sqrt(a) / d_near,
                Self::FocusSteep => libm::sqrt(a) / (d_near * d_near),
            };
        let seen = a > 0.0 && z > 0.0 && importance > 0.0 && !d.is_nan();
        if seen && value.is_finite() { value } else { 0.0 }
    }
}
