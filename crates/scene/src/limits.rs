//! Checks a table of a scene against its schema: every number is within its range, every list within its length.
//!
//! In: the schema of a table ([`whole`]) and the table as it is written. Out: problems to the [`Checker`].
//! Never here: types, which serde checks before, but for lists of fixed length that are too long; rules between keys (`build`).

use crate::check::{Checker, Place};
use crate::format::ranges::say_everywhere;
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;
use std::fmt::Display;
use std::ops::RangeInclusive;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The schema of a table with those of the tables in it, for reading.
pub(super) fn whole<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>().to_value();
    say_everywhere(&mut schema);
    schema
}

/// Reports what of `table` is not as `schema` has it.
pub(super) fn check(c: &mut Checker<'_, '_>, place: &Place, schema: &Value, table: &DeTable<'_>) {
    for (key, found) in table {
        let key = key.get_ref().as_ref();
        if let Some(schema) = schema["properties"].get(key).or_else(|| schema.get("additionalProperties")) {
            value(c, place, key, schema, found.get_ref());
        }
    }
}

fn value(c: &mut Checker<'_, '_>, place: &Place, key: &str, schema: &Value, found: &DeValue<'_>) {
    let schema = form(schema, found);
    match found {
        DeValue::Table(table) => check(c, &c.within(place, key), schema, table),
        DeValue::Array(items) => list(c, place, key, schema, items),
        _ => {
            if let (Some(number), Some((range, allowed))) = (number(found), range(schema))
                && !range.contains(&number)
            {
                c.wrong(place, key, format_args!("is {number}"), format!("expected a number {allowed}"));
            }
        }
    }
}

/// A list: one of fixed length is checked as a whole, any other by its length and entry by entry.
fn list(c: &mut Checker<'_, '_>, place: &Place, key: &str, schema: &Value, items: &[Spanned<DeValue<'_>>]) {
    let (entry, count) = (&schema["items"], items.len());
    let length = |bound| schema[bound].as_u64().map(|length| length as usize);
    let (least, most) = (length("minItems").unwrap_or(0), length("maxItems").unwrap_or(usize::MAX));
    let numbers: Option<Vec<f64>> = items.iter().map(|item| number(item.get_ref())).collect();
    if let Some(numbers) = numbers.filter(|_| least == most) {
        let beyond = |range: &RangeInclusive<f64>| count != most || numbers.iter().any(|n| !range.contains(n));
        if let Some((_, allowed)) = range(entry).filter(|(range, _)| beyond(range)) {
            let expected = format!("expected {most} numbers {allowed}");
            c.wrong(place, key, format_args!("is [{}]", listed(&numbers)), expected);
        } else if schema["x-rises"] == true && numbers[0] > numbers[1] {
            let expected = format!("expected the lesser number first: [{}, {}]", numbers[1], numbers[0]);
            c.wrong(place, key, format_args!("runs from {} down to {}", numbers[0], numbers[1]), expected);
        }
    } else if (least..=most).contains(&count) {
        items.iter().enumerate().for_each(|(i, item)| value(c, place, &format!("{key}.{i}"), entry, item.get_ref()));
    } else {
        let entries = if entry["maxItems"] == 3 { "points" } else { "entries" };
        let expected = match (least, most) {
            (0, _) => format!("at most {most}"),
            (_, usize::MAX) => format!("at least {least} {entries}"),
            _ => format!("{least} … {most} {entries}"),
        };
        c.wrong(place, key, format_args!("has {count} {entries}"), format!("expected {expected}"));
    }
}

fn listed(numbers: &[impl Display]) -> String {
    numbers.iter().map(|number| number.to_string()).collect::<Vec<_>>().join(", ")
}

/// The schema of the form that a value has, of those that it may have.
fn form<'s>(schema: &'s Value, found: &DeValue<'_>) -> &'s Value {
    let kinds: &[&str] = match found {
        DeValue::Table(_) => &["object"],
        DeValue::Array(_) => &["array"],
        _ => &["number", "integer"],
    };
    let has_kind = |form: &&Value| kinds.iter().any(|kind| form["type"].to_string().contains(kind));
    let forms = schema["anyOf"].as_array().into_iter().flatten();
    forms.map(|choice| form(choice, found)).find(has_kind).unwrap_or(schema)
}

/// The range of a number, and its words: `from 0 to 1 m`.
fn range(schema: &Value) -> Option<(RangeInclusive<f64>, String)> {
    let (least, most) = (schema["minimum"].as_f64()?, schema["maximum"].as_f64()?);
    let unit = schema["x-unit"].as_str().unwrap_or_default();
    Some((least..=most, format!("from {least} to {most} {unit}").trim_end().to_owned()))
}

/// A number as it is written.
pub(super) fn number(found: &DeValue<'_>) -> Option<f64> {
    match found {
        DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).ok().map(|n| n as f64),
        DeValue::Float(x) => x.as_str().parse().ok(),
        _ => None,
    }
}
