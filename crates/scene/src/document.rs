//! Parses a scene's text into a tree that stores the position of every key and value in the text.
//!
//! In: text, and `key=value` overrides. Out: tables for serde, and the position in the text of any key path.
//! Never here: the meaning of keys.

use super::diagnostic::Problem;
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Name of the table that carries overrides at the end of the text; no scene may use it.
const OVERRIDES: &str = "command line";

/// Appends the overrides given on the command line to the text, so that errors can show them.
#[must_use]
pub(super) fn with_overrides(text: &str, overrides: &[(String, String)]) -> String {
    let newest: BTreeMap<&str, &str> = overrides.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
    if newest.is_empty() {
        return text.to_owned();
    }
    let mut out = format!("{text}\n[{}]\n", quoted(OVERRIDES));
    for (key, value) in newest {
        let value = if DeValue::parse(value).is_ok() { value.to_owned() } else { quoted(value) };
        out.push_str(&format!("{} = {value}\n", quoted(key)));
    }
    out
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// The tree of a scene's text.
pub(super) struct Document<'t> {
    text: &'t str,
    root: DeTable<'t>,
}

impl<'t> Document<'t> {
    /// Parses `text` and moves its overrides to the keys that they name.
    pub(super) fn parse(text: &'t str) -> Result<Self, Problem> {
        let parsed = DeTable::parse(text).map_err(|e| Problem::from_toml(&e, 0..0, &[]))?;
        let mut document = Self { text, root: parsed.into_inner() };
        if let Some(DeValue::Table(overrides)) = document.root.remove(OVERRIDES).map(Spanned::into_inner) {
            for (key, value) in overrides {
                document.set(&key, value)?;
            }
        }
        Ok(document)
    }

    fn set(&mut self, key: &Spanned<std::borrow::Cow<'t, str>>, value: Spanned<DeValue<'t>>) -> Result<(), Problem> {
        let wrong = |what: String| {
            Problem::new(key.span(), what).expecting(
                "a dotted key such as `target.frame_hz` or `object.NAME.rate_hz`; a name with a dot stands in quotes, \
                 `object.\"NA.ME\".rate_hz`",
            )
        };
        let steps = key_parts(key.get_ref());
        let Some((last, path)) = steps.as_ref().and_then(|steps| steps.split_last()) else {
            return Err(wrong(format!("`{}` is not the key of a setting", key.get_ref())));
        };
        let table = descend(&mut self.root, path, &key.span()).map_err(wrong)?;
        table.insert(Spanned::new(key.span(), last.clone().into()), value);
        Ok(())
    }

    /// The whole tree.
    pub(super) fn root(&self) -> &DeTable<'t> {
        &self.root
    }

    /// Position of a problem that has no better one: the first line.
    pub(super) fn first_line(&self) -> Range<usize> {
        0..self.text.find(['\n', '\r']).unwrap_or(self.text.len())
    }

    /// The value at the dotted `path`.
    pub(super) fn find(&self, path: &str) -> Option<&Spanned<DeValue<'t>>> {
        let mut steps = path.split('.');
        let first = self.root.get(steps.next()?)?;
        steps.try_fold(first, step)
    }

    /// Position of the value at the dotted `path`, or of the nearest thing around it that is in the text.
    pub(super) fn locate(&self, path: &str) -> Range<usize> {
        let around = std::iter::successors(Some(path), |path| Some(path.rsplit_once('.')?.0));
        let found = around.into_iter().find_map(|path| self.find(path));
        found.map_or_else(|| self.first_line(), Spanned::span)
    }
}

/// The entry of a table or list under a key or number.
fn step<'a, 't>(here: &'a Spanned<DeValue<'t>>, step: &str) -> Option<&'a Spanned<DeValue<'t>>> {
    match here.get_ref() {
        DeValue::Table(table) => table.get(step),
        DeValue::Array(items) => items.get(step.parse::<usize>().ok()?),
        _ => None,
    }
}

/// The parts of a dotted key, of which a quoted one may hold dots as in TOML; `None` where one is empty or a quote is not closed.
fn key_parts(key: &str) -> Option<Vec<String>> {
    let (mut parts, mut rest) = (Vec::new(), key.trim());
    loop {
        let end = match rest.chars().next()? {
            quote @ ('"' | '\'') => closing(rest, quote)?,
            _ => rest.find('.').unwrap_or(rest.len()),
        };
        let (part, after) = rest.split_at(end);
        parts.push(match DeValue::parse(part) {
            Ok(value) if part.starts_with(['"', '\'']) => value.into_inner().as_str()?.to_owned(),
            _ if part.trim().is_empty() => return None,
            _ => part.to_owned(),
        });
        match after.strip_prefix('.') {
            Some(next) => rest = next,
            None => return after.is_empty().then_some(parts),
        }
    }
}

/// End of the quoted string that `text` begins with, past its closing `quote`.
fn closing(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if c == quote && !escaped {
            return Some(at + 1);
        }
        escaped = c == '\\' && quote == '"' && !escaped;
    }
    None
}

/// The table that an override's path names, created where it is missing. In a list, the next part of the path names the entry.
fn descend<'a, 't>(
    table: &'a mut DeTable<'t>,
    path: &[String],
    span: &Range<usize>,
) -> Result<&'a mut DeTable<'t>, String> {
    let Some((step, rest)) = path.split_first() else { return Ok(table) };
    if !table.contains_key(step.as_str()) {
        let empty = Spanned::new(span.clone(), DeValue::Table(DeTable::new()));
        table.insert(Spanned::new(span.clone(), step.clone().into()), empty);
    }
    let slot = table.get_mut(step.as_str()).ok_or_else(|| format!("`{step}` cannot be set"))?;
    match slot.get_mut() {
        DeValue::Table(inner) => descend(inner, rest, span),
        DeValue::Array(items) => {
            let (which, rest) =
                rest.split_first().ok_or_else(|| format!("`{step}` is a list; name one of its entries"))?;
            let at = entry(items, which).ok_or_else(|| format!("`{step}` has no entry `{which}`"))?;
            match items.get_mut(at).map(Spanned::get_mut) {
                Some(DeValue::Table(inner)) => descend(inner, rest, span),
                _ => Err(format!("`{step}.{which}` is a value, not a table")),
            }
        }
        _ => Err(format!("`{step}` is a value, not a table")),
    }
}

/// The entry of a list of tables that has this name, or else this number.
fn entry(items: &[Spanned<DeValue<'_>>], which: &str) -> Option<usize> {
    let name = |item: &Spanned<DeValue<'_>>| Some(item.get_ref().as_table()?.get("name")?.get_ref().as_str()? == which);
    let named = items.iter().position(|item| name(item) == Some(true));
    named.or_else(|| which.parse().ok().filter(|i: &usize| *i < items.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_dots_and_quotes_are_set_by_keys_in_quotes() {
        let parts = |key: &str| key_parts(key).map(|parts| parts.join("|"));
        let as_they_are =
            [("target.frame_hz", "target|frame_hz"), ("object.big ball.rate_hz", "object|big ball|rate_hz")];
        let in_quotes = [
            (r#"object."v1.2".rate_hz"#, "object|v1.2|rate_hz"),
            ("object.'a \"b\".c'.n", "object|a \"b\".c|n"),
            (r#"object."a \"b\".c".n"#, "object|a \"b\".c|n"),
            (r#"object.six"inch.n"#, "object|six\"inch|n"),
        ];
        for (key, want) in as_they_are.into_iter().chain(in_quotes) {
            assert_eq!(parts(key).as_deref(), Some(want), "{key}");
        }
        for key in ["", ".", "a.", ".a", "a..b", "a.\"b", "\"a\"b.c", "a. .b"] {
            assert_eq!(parts(key), None, "{key}");
        }
    }
}
