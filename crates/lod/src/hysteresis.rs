//! An integer level from a real number, with hysteresis: no chatter when the number fluctuates about an integer.
//!
//! In: ρ. Out: ⌊ρ⌋, held until ρ is half a level past an edge. Never here: where ρ comes from.
//! Theory: `docs/theory/control.md`, eq. 15.

/// How far past an edge ρ must be, in levels. Two switches of the same edge are a level apart, a factor 2 of polygons: a load that is steady to
/// a fifth changes a tube's polygons by a factor 1.9.
pub const BAND: f64 = 0.5;

/// The level for `rho` when `held` is the present one: `held` as long as held − ½ ≤ ρ < held + 1½, otherwise ⌊ρ⌋.
///
/// With no level held, ⌊ρ⌋. The result is inside `0..=255`; a NaN keeps the level, or gives 0.
#[must_use]
pub fn floor(held: Option<u8>, rho: f64) -> u8 {
    match held {
        Some(n) if rho.is_nan() || (f64::from(n) - BAND <= rho && rho < f64::from(n) + 1.0 + BAND) => n,
        _ => libm::floor(rho) as u8, // a cast of floats saturates, and takes NaN to 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_fluctuates_about_an_edge_switches_once() {
        let mut held = Some(2);
        let mut switches = 0;
        for k in 0..1000 {
            // slowly from 2.9 to 3.9, with an alternating ± 0.2 < BAND
            let rho = 2.9 + 0.001 * f64::from(k) + if k % 2 == 0 { 0.2 } else { -0.2 };
            let n = floor(held, rho);
            switches += u32::from(held != Some(n));
            held = Some(n);
        }
        assert_eq!((held, switches), (Some(3), 1));
    }

    #[test]
    fn a_level_changes_half_a_level_past_its_edges() {
        assert_eq!(floor(Some(3), 4.499), 3);
        assert_eq!(floor(Some(3), 4.5), 4);
        assert_eq!(floor(Some(3), 2.5), 3);
        assert_eq!(floor(Some(3), 2.499), 2);
    }

    #[test]
    fn an_invalid_number_keeps_the_level() {
        assert_eq!(floor(Some(4), f64::NAN), 4);
        assert_eq!(floor(None, f64::NAN), 0);
        assert_eq!(floor(Some(4), f64::NEG_INFINITY), 0);
        assert_eq!(floor(None, f64::INFINITY), 255);
    }
}
