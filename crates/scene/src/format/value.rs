//! Values that a scene may write in more than one form.

use metachron_core::N_MAX;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// A point or a direction: `[x, y, z]`.
pub type Point = [f64; 3];

/// One number, which fixes a value, or `[least, greatest]`, within which a controller chooses.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum OneOrRange<T> {
    /// The value never changes.
    One(T),
    /// The controller may choose any value from the first to the second, both included.
    Range([T; 2]),
}

/// One number for all axes, or `[x, y, z]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or one an axis: [x, y, z]")]
pub enum OneOrEach {
    /// The same along every axis.
    One(f64),
    /// Along x, y and z.
    Each(Point),
}

impl<T: Copy> OneOrRange<T> {
    /// The least and the greatest value.
    #[must_use]
    pub fn ends(self) -> (T, T) {
        match self {
            Self::One(value) => (value, value),
            Self::Range([least, greatest]) => (least, greatest),
        }
    }
}

/// A number type that [`OneOrRange`] reads: its conversion from TOML's integers and floats.
pub trait Number: Sized {
    /// Name of the type in error messages.
    fn name() -> String;
    /// The value of a TOML integer, if it has one.
    fn from_integer(value: i64) -> Option<Self>;
    /// The value of a TOML float, if it has one.
    fn from_float(value: f64) -> Option<Self>;
}

impl Number for f64 {
    fn name() -> String {
        "a number, or a range [least, greatest]".to_owned()
    }
    fn from_integer(value: i64) -> Option<Self> {
        Some(value as Self)
    }
    fn from_float(value: f64) -> Option<Self> {
        Some(value)
    }
}

/// Only levels of primitives have this type.
impl Number for u8 {
    fn name() -> String {
        format!("a whole number from 0 to {N_MAX}, or a range [least, greatest]")
    }
    fn from_integer(value: i64) -> Option<Self> {
        Self::try_from(value).ok()
    }
    fn from_float(_: f64) -> Option<Self> {
        None
    }
}

impl<'de, T: Number + Deserialize<'de>> Deserialize<'de> for OneOrRange<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrRangeVisitor(PhantomData))
    }
}

struct OneOrRangeVisitor<T>(PhantomData<T>);

impl<'de, T: Number + Deserialize<'de>> Visitor<'de> for OneOrRangeVisitor<T> {
    type Value = OneOrRange<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&T::name())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        let found = T::from_integer(value).map(OneOrRange::One);
        found.ok_or_else(|| E::invalid_value(serde::de::Unexpected::Signed(value), &self))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        let found = T::from_float(value).map(OneOrRange::One);
        found.ok_or_else(|| E::invalid_type(serde::de::Unexpected::Float(value), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut ends = Vec::with_capacity(2);
        while let Some(end) = seq.next_element()? {
            ends.push(end);
            if ends.len() > 2 {
                break;
            }
        }
        <[T; 2]>::try_from(ends)
            .map(OneOrRange::Range)
            .map_err(|wrong| A::Error::custom(format!("a range has 2 ends, not {}: [least, greatest]", count(&wrong))))
    }
}

fn count<T>(ends: &[T]) -> String {
    if ends.len() > 2 { "more".to_owned() } else { ends.len().to_string() }
}
