//! Ranges of the numbers that users give, each named once: where the specification that has the number is.
//!
//! In: the least and the greatest value and their unit. Out: a check, whose error names the number, its value and its range.
//! Never here: the range of a number.
//!
//! ```
//! use metachron_core::{NumberRange, Ranges};
//!
//! const MATERIAL: Ranges = Ranges(&[("poisson", NumberRange::new(0.0, 0.499, ""))]);
//! assert!(MATERIAL.check([0.3]).is_ok());
//! let error = MATERIAL.check([0.5]).unwrap_err();
//! assert_eq!(error.to_string(), "poisson is 0.5; expected a number from 0 to 0.499");
//! ```

use std::fmt::{Display, Formatter};

/// The values that a number may have: from the least to the greatest, both included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberRange {
    /// The least value.
    pub least: f64,
    /// The greatest value.
    pub greatest: f64,
    /// Unit of both; empty for a number without a dimension.
    pub unit: &'static str,
}

impl NumberRange {
    /// From `least` to `greatest`, in `unit`.
    #[must_use]
    pub const fn new(least: f64, greatest: f64, unit: &'static str) -> Self {
        Self { least, greatest, unit }
    }

    /// Whether `value` is one of them; NaN is none.
    #[must_use]
    pub const fn contains(self, value: f64) -> bool {
        self.least <= value && value <= self.greatest
    }

    /// The nearest of them; of NaN the least.
    #[must_use]
    pub const fn nearest(self, value: f64) -> f64 {
        if value.is_nan() { self.least } else { value.clamp(self.least, self.greatest) }
    }

    /// Whether the number that is called `what` has one of these values.
    ///
    /// # Errors
    /// [`OutOfRange`] where it has not.
    pub fn check(self, what: &'static str, value: f64) -> Result<(), OutOfRange> {
        if self.contains(value) { Ok(()) } else { Err(OutOfRange::new(what, value, self)) }
    }
}

impl Display for NumberRange {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "a number from {} to {}", self.least, self.greatest)?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

/// The ranges of the numbers of a specification, by the names that the numbers have in it and in files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranges(pub &'static [(&'static str, NumberRange)]);

impl Ranges {
    /// The range of the number of this name.
    #[must_use]
    pub fn get(self, name: &str) -> Option<NumberRange> {
        self.0.iter().find(|(known, _)| *known == name).map(|(_, range)| *range)
    }

    /// Whether the values, in the order of the names, are all in their ranges.
    ///
    /// # Errors
    /// [`OutOfRange`] with the first that is not.
    pub fn check<const N: usize>(self, values: [f64; N]) -> Result<(), OutOfRange> {
        debug_assert_eq!(self.0.len(), N, "a value for each range");
        self.0.iter().zip(values).try_for_each(|((name, range), value)| range.check(name, value))
    }
}

/// A number that is outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} is {value}; expected {expected}")]
pub struct OutOfRange {
    /// The name of the number.
    pub what: &'static str,
    /// The value given.
    pub value: f64,
    /// The values that it may have.
    pub expected: String,
}

impl OutOfRange {
    /// The error of a number of this value, where it may have the `expected` ones.
    pub fn new(what: &'static str, value: f64, expected: impl Display) -> Self {
        Self { what, value, expected: expected.to_string() }
    }

    /// An error unless `is_good`: for conditions that are no range.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn unless(is_good: bool, what: &'static str, value: f64, expected: &str) -> Result<(), Self> {
        if is_good { Ok(()) } else { Err(Self::new(what, value, expected)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: NumberRange = NumberRange::new(1e-6, 1e4, "m");

    #[test]
    fn a_number_outside_its_range_is_named_with_its_value_and_its_range() {
        assert_eq!(LENGTH.check("radius_m", 1e-6), Ok(()));
        for value in [0.0, 2e4, f64::NAN, f64::INFINITY] {
            let error = LENGTH.check("radius_m", value).unwrap_err().to_string();
            assert_eq!(error, format!("radius_m is {value}; expected a number from 0.000001 to 10000 m"));
        }
    }

    #[test]
    fn the_nearest_allowed_number_is_allowed() {
        for value in [-1.0, 3.0, 1e9, f64::NAN, f64::NEG_INFINITY] {
            assert!(LENGTH.contains(LENGTH.nearest(value)), "{value}");
        }
        assert_eq!(LENGTH.nearest(3.0), 3.0);
    }
}
