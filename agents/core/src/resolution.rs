//! The pair (ε, n) that sets how finely an object is simulated or drawn (GDC04).

/// The highest primitive level: 2¹⁰ polygons for every O(1) of level 0; past it a patch outgrows 16-bit indices.
pub const N_MAX: u8 = 10;

/// How finely an object is divided: the pair (ε, n) of (GDC04).
///
/// A controller requests a pair; the holder of the shape answers with the nearest one that it supports.
/// The simulation and the picture of an object each have one.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Resolution {
    /// Requested spacing ε of samples along the shape, in metres; finite, > 0. Larger is coarser.
    pub eps_m: f64,
    /// Level n of the primitive drawn over one interval, O(2ⁿ) polygons; `0..=N_MAX`.
    pub n: u8,
}

/// The pairs (ε, n) that an object supports, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolutionRange {
    /// Finest and coarsest spacing in metres; `0 < min <= max`.
    pub eps_m: (f64, f64),
    /// Lowest and highest primitive level; `min <= max <= N_MAX`.
    pub n: (u8, u8),
}

impl ResolutionRange {
    /// A range of one pair: the object does not adapt.
    #[must_use]
    pub fn fixed(at: Resolution) -> Self {
        Self { eps_m: (at.eps_m, at.eps_m), n: (at.n, at.n) }
    }

    /// The pair of this range nearest to `wanted`. A NaN spacing gives the coarsest.
    #[must_use]
    pub fn clamp(&self, wanted: Resolution) -> Resolution {
        let eps_m = if wanted.eps_m.is_nan() { self.eps_m.1 } else { wanted.eps_m.clamp(self.eps_m.0, self.eps_m.1) };
        Resolution { eps_m, n: wanted.n.clamp(self.n.0, self.n.1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_outside_the_range_gets_the_nearest_pair_inside() {
        let range = ResolutionRange { eps_m: (0.01, 0.1), n: (1, 4) };
        let got = range.clamp(Resolution { eps_m: 1.0, n: 9 });
        assert_eq!(got, Resolution { eps_m: 0.1, n: 4 });
        let got = range.clamp(Resolution { eps_m: f64::NAN, n: 0 });
        assert_eq!(got, Resolution { eps_m: 0.1, n: 1 });
    }
}
