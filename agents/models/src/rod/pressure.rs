//! A tube's pressure as a function of time: keys, and straight lines between them.
//!
//! In: keys by rising times, a time. Out: the pressure then. Never here: the effect of a pressure ([`super::wall`]).

/// A pressure at a time.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PressureKey {
    /// The tube's own time, seconds, ≥ 0; above that of the key before.
    pub at_s: f64,
    /// Inside minus outside pressure then, Pa, in the range of [`super::TubeSpec::pressure_pa`].
    pub pressure_pa: f64,
}

/// The pressure at a time: that of the first key before it, that of the last after it; `None` without keys.
pub(super) fn pressure_at_pa(keys: &[PressureKey], time_s: f64) -> Option<f64> {
    let after = keys.partition_point(|key| key.at_s <= time_s);
    let (last, next) = (after.checked_sub(1).map(|at| keys[at]), keys.get(after).copied());
    match (last, next) {
        (Some(last), Some(next)) => {
            let share = (time_s - last.at_s) / (next.at_s - last.at_s);
            Some(last.pressure_pa + share * (next.pressure_pa - last.pressure_pa))
        }
        (last, next) => last.or(next).map(|key| key.pressure_pa),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_is_linear_between_keys_and_constant_beyond_them() {
        let keys =
            [(1.0, 100.0), (2.0, 300.0), (4.0, 0.0)].map(|(at_s, pressure_pa)| PressureKey { at_s, pressure_pa });
        let found = [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|time_s| pressure_at_pa(&keys, time_s).unwrap());
        assert_eq!(found, [100.0, 100.0, 200.0, 300.0, 150.0, 0.0, 0.0]);
        assert_eq!((pressure_at_pa(&keys[..1], 7.0), pressure_at_pa(&[], 0.0)), (Some(100.0), None));
    }
}
