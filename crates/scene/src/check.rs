//! Checks on values, collected: all problems of a scene are reported together.
//!
//! In: values and the dotted path of their key. Out: the value, or a valid one in its place together with a problem.
//! Never here: the rule of each key.

use super::demand::{Cost, Demands, FileHead};
use super::diagnostic::{Problem, did_you_mean};
use super::document::Document;
use super::format::{OneOrRange, Point};
use glam::DVec3;
use metachron_core::{NumberRange, Ranges};
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// More names than this are counted, not listed.
const LISTED_MAX: usize = 20;

/// Most wrong keys of one table that are reported: each is found by reading the table once more.
const TABLE_PROBLEMS_MAX: usize = 20;

/// Removes from `table` the innermost key owner key or value spans `at`, and returns its name; `None` where there is none.
fn remove_innermost(table: &mut DeTable<'_>, at: &Range<usize>) -> Option<String> {
    for (_, value) in table.iter_mut() {
        let inner = match value.get_mut() {
            DeValue::Table(inner) => remove_innermost(inner, at),
            DeValue::Array(items) => items.iter_mut().find_map(|item| match item.get_mut() {
                DeValue::Table(inner) => remove_innermost(inner, at),
                _ => None,
            }),
            _ => None,
        };
        if inner.is_some() {
            return inner;
        }
    }
    let within = |span: Range<usize>| span.start <= at.start && at.end <= span.end;
    let mut found = table.iter().filter(|(key, value)| within(key.span()) || within(value.span()));
    let name = found.next()?.0.get_ref().to_string();
    table.remove(name.as_str());
    Some(name)
}

/// Collects problems of one scene.
pub(super) struct Checker<'d, 't> {
    document: &'d Document<'t>,
    problems: Vec<Problem>,
    /// Names of objects that could not be read.
    unread: Vec<String>,
    /// In a draft, which makes nothing that takes memory or time: the memory that a scene would take.
    draft: Option<Demands>,
}

/// The dotted path of a table, and its name for messages.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Dotted path, such as `object.2`.
    pub(super) path: String,
    /// For messages, such as ``of `intestine` ``; may be empty.
    pub(super) owner: String,
}

impl Place {
    pub(super) fn new(path: impl Into<String>, owner: impl Into<String>) -> Self {
        Self { path: path.into(), owner: owner.into() }
    }

    /// The `index`-th entry of the list under `key`.
    pub(super) fn entry(&self, key: &str, index: usize) -> Self {
        Self { path: format!("{}.{key}.{index}", self.path), owner: self.owner.clone() }
    }

    /// The table under `key`.
    pub(super) fn table(&self, key: &str) -> Self {
        Self { path: format!("{}.{key}", self.path), owner: self.owner.clone() }
    }

    fn key(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    fn named(&self, key: &str) -> String {
        let key = key.split('.').next().unwrap_or(key);
        if self.owner.is_empty() { format!("`{key}`") } else { format!("`{key}` {}", self.owner) }
    }
}

/// The range of a number: one for all keys, or the one that a list has for the key.
pub(super) trait Allowed {
    /// The range of the number under `key`.
    fn of(self, key: &str) -> NumberRange;
}

impl Allowed for NumberRange {
    fn of(self, _key: &str) -> NumberRange {
        self
    }
}

impl Allowed for Ranges {
    fn of(self, key: &str) -> NumberRange {
        let name = key.split('.').next().unwrap_or(key);
        self.get(name).unwrap_or_else(|| unreachable!("a key with a number has a range: {key}"))
    }
}

impl<'d, 't> Checker<'d, 't> {
    pub(super) fn new(document: &'d Document<'t>) -> Self {
        Self { document, problems: Vec::new(), unread: Vec::new(), draft: None }
    }

    /// A checker of a scene of which nothing is made.
    pub(super) fn draft(document: &'d Document<'t>) -> Self {
        Self { draft: Some(Demands::default()), ..Self::new(document) }
    }

    /// Whether nothing of the scene is made.
    pub(super) const fn is_draft(&self) -> bool {
        self.draft.is_some()
    }

    /// Whether data of this cost, by the number under `key`, may be made now: not in a draft, which adds it up instead.
    pub(super) fn may_make(&mut self, place: &Place, key: &str, cost: Cost) -> bool {
        let Some(demands) = &mut self.draft else { return true };
        demands.add(self.document.locate(&place.key(key)), place.named(key), cost);
        false
    }

    /// The same of data made from a file; the reader of one that cannot be read says why.
    pub(super) fn may_read(
        &mut self,
        place: &Place,
        key: &str,
        head: Result<FileHead, String>,
        cost: impl Fn(&FileHead) -> Cost,
    ) -> bool {
        head.map_or(true, |head| self.may_make(place, key, cost(&head)))
    }

    /// An object of so many copies is read, all of which take the same memory.
    pub(super) fn begin_object(&mut self, copies: usize) {
        self.draft.iter_mut().for_each(|demands| demands.begin(copies as u64));
    }

    /// Reports a scene that asks for more than `limit_bytes`.
    pub(super) fn check_memory(&mut self, limit_bytes: u64) {
        self.problems.extend(self.draft.as_ref().and_then(|demands| demands.beyond(limit_bytes)));
    }

    pub(super) fn document(&self) -> &'d Document<'t> {
        self.document
    }

    pub(super) fn finish(self) -> Vec<Problem> {
        self.problems
    }

    /// Records an object of this name that could not be read; that is reported already, so references to it are no problems.
    pub(super) fn unread(&mut self, name: &str) {
        self.unread.push(name.to_owned());
    }

    /// The number of problems so far.
    pub(super) fn count(&self) -> usize {
        self.problems.len()
    }

    pub(super) fn push(&mut self, problem: Problem) {
        self.problems.push(problem);
    }

    /// Reads a `table` at `span`; `also` are further keys that it may have. Every wrong key of it is reported, up to the first twenty:
    /// each is removed, so that the next is found.
    pub(super) fn read<T: DeserializeOwned>(
        &mut self,
        mut table: DeTable<'_>,
        span: Range<usize>,
        also: &[&str],
    ) -> Option<T> {
        let mut taken: Vec<String> = Vec::new();
        for _ in 0..TABLE_PROBLEMS_MAX {
            let value = ValueDeserializer::from(Spanned::new(span.clone(), DeValue::Table(table.clone())));
            let error = match T::deserialize(value) {
                Ok(read) => return taken.is_empty().then_some(read),
                Err(error) => error,
            };
            let missing = error.message().strip_prefix("missing field `").and_then(|rest| rest.split('`').next());
            // a key that is reported wrong, also one that is this key misspelt, is not reported missing as well
            let reported = |key: &str| taken.iter().any(|one| one == key || did_you_mean(one, [key]).is_some());
            if !missing.is_some_and(reported) {
                // tables within it have keys of their own
                let is_own = |at| table.keys().any(|key| key.span() == at);
                let also = if error.span().is_some_and(is_own) { also } else { &[] };
                self.push(Problem::from_toml(&error, span.clone(), also));
            }
            taken.extend(missing.map(str::to_owned));
            taken.push(remove_innermost(&mut table, &error.span()?)?);
        }
        None
    }

    /// Reports that `key` is wrong: its present value, and the expected one.
    pub(super) fn wrong(&mut self, place: &Place, key: &str, what: impl Display, expected: impl Into<String>) {
        let span = self.document.locate(&place.key(key));
        self.problems.push(Problem::new(span, format!("{} {what}", place.named(key))).expecting(expected));
    }

    /// A number within its range. One outside is reported and replaced by the nearest that is within it.
    pub(super) fn number(&mut self, place: &Place, key: &str, value: f64, allowed: impl Allowed) -> f64 {
        let range = allowed.of(key);
        if !range.contains(value) {
            self.wrong(place, key, format_args!("is {value}"), format!("expected {range}"));
        }
        range.nearest(value)
    }

    /// As [`Self::number`], for a value that may be left out.
    pub(super) fn optional(
        &mut self,
        place: &Place,
        key: &str,
        value: Option<f64>,
        allowed: impl Allowed,
    ) -> Option<f64> {
        value.map(|given| self.number(place, key, given, allowed))
    }

    /// A point or direction, every coordinate within ± `most`.
    pub(super) fn point(&mut self, place: &Place, key: &str, value: Point, most: f64) -> DVec3 {
        if value.iter().all(|x| x.abs() <= most) {
            return DVec3::from_array(value);
        }
        let expected = format!("expected 3 numbers from -{most} to {most}");
        self.wrong(place, key, format_args!("is {value:?}"), expected);
        DVec3::ZERO
    }

    /// One number or a range, both ends within `allowed` and in order.
    pub(super) fn ends(
        &mut self,
        place: &Place,
        key: &str,
        value: OneOrRange<f64>,
        allowed: impl Allowed,
    ) -> (f64, f64) {
        let range = allowed.of(key);
        let (least, greatest) = value.ends();
        if !(range.contains(least) && range.contains(greatest)) {
            let bad = if range.contains(least) { greatest } else { least };
            self.wrong(place, key, format_args!("has the value {bad}"), format!("expected {range}"));
        } else if least > greatest {
            let expected = format!("expected the lesser number first: [{greatest}, {least}]");
            self.wrong(place, key, format_args!("runs from {least} down to {greatest}"), expected);
        } else {
            return (least, greatest);
        }
        (range.least, range.greatest)
    }

    /// Whether `name` is one of `known`; one that is neither known nor an object that could not be read is reported.
    pub(super) fn reference<'n>(
        &mut self,
        place: &Place,
        key: &str,
        name: &str,
        known: impl Iterator<Item = &'n str> + Clone,
    ) -> bool {
        if known.clone().any(|n| n == name) {
            return true;
        }
        // an object on a grid is referred to by the names of its copies
        let is_copy = |of: &str| name.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'));
        if self.unread.iter().any(|unread| is_copy(unread)) {
            return false;
        }
        let span = self.document.locate(&place.key(key));
        let list = known.clone().take(LISTED_MAX).map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
        let more = known.clone().count().saturating_sub(LISTED_MAX);
        let expected = match (list.is_empty(), more) {
            (true, _) => "there is none in this scene".to_owned(),
            (_, 0) => format!("expected one of {list}"),
            _ => format!("expected one of {list} and {more} more"),
        };
        let problem = Problem::new(span, format!("{} names `{name}`, which does not exist", place.named(key)));
        self.problems.push(problem.expecting(expected).helped(did_you_mean(name, known)));
        false
    }
}
