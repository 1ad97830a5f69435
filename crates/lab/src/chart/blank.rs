//! A record of which nothing is known, in place of a measurement that could not be made.
//!
//! In: its type. Out: numbers that are NaN, counts of 0, empty texts, no options. Never here: why it could not be made.

use serde::de::value::{Error, MapDeserializer};
use serde::de::{DeserializeOwned, Deserializer, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;

/// The record; of fields that are numbers, texts, flags and options of these.
pub fn blank<T: DeserializeOwned>() -> T {
    T::deserialize(Unknown).expect("a record of numbers, texts, flags and options")
}

/// The value of every field.
struct Unknown;

impl IntoDeserializer<'_, Error> for Unknown {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Unknown {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_u64(0)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f64(f64::NAN)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_str("")
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_bool(false)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_none()
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_map(MapDeserializer::new(fields.iter().map(|field| (*field, Self))))
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str bytes byte_buf unit unit_struct newtype_struct seq tuple
        tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    struct Found {
        error_m: f64,
        steps: u32,
        led: usize,
        limit: Option<f64>,
        kind: String,
        holds: bool,
    }

    #[test]
    fn nothing_is_known_of_a_blank_record() {
        let Found { error_m, steps, led, limit, kind, holds } = blank();
        assert!(error_m.is_nan());
        assert_eq!((steps, led, limit, kind.as_str(), holds), (0, 0, None, "", false));
    }
}
