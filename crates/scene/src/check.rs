//! Checks on values, collected: all problems of a scene are reported together.
//!
//! In: values and the dotted path of their key. Out: the value, or a valid one in its place together with a problem.
//! Never here: the rule of each key.

use super::demand::{Cost, Demands, FileHead};
use super::diagnostic::{Problem, did_you_mean};
use super::document::Document;
use super::limits::{self, whole};
use metachron_core::NumberRange;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::any::TypeId;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;
use std::rc::Rc;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// Characters of a name in a message.
const NAME_MAX: usize = 64;

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
    /// Schemas of tables, by their types.
    schemas: BTreeMap<TypeId, Rc<Value>>,
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
    /// The scene itself, whose keys are in no table.
    pub(super) const SCENE: Self = Self { path: String::new(), owner: String::new() };

    /// The `index`-th entry of the list under `key`.
    pub(super) fn entry(&self, key: &str, index: usize) -> Self {
        self.table(&format!("{key}.{index}"))
    }

    /// The table under `key`.
    pub(super) fn table(&self, key: &str) -> Self {
        let path = self.key(key);
        let has_no_name = self.owner == format!("of `[{}]`", self.path);
        let owner = if has_no_name { format!("of `[{path}]`") } else { self.owner.clone() };
        Self { path, owner }
    }

    /// The same place for a message in which its name would be wrong.
    pub(super) fn unnamed(&self) -> Self {
        Self { owner: String::new(), ..self.clone() }
    }

    fn key(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    fn named(&self, key: &str) -> String {
        let key = key.split('.').next().unwrap_or(key);
        if self.owner.is_empty() { format!("`{key}`") } else { format!("`{key}` {}", self.owner) }
    }
}

impl<'d, 't> Checker<'d, 't> {
    pub(super) fn new(document: &'d Document<'t>) -> Self {
        Self { document, problems: Vec::new(), unread: Vec::new(), schemas: BTreeMap::new(), draft: None }
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

    /// The place of the table at `path`: one of a list is named as it names itself, or by the two that it connects.
    pub(super) fn place(&self, path: &str) -> Place {
        let table = self.document.find(path).and_then(|found| found.get_ref().as_table());
        let text = |key: &str| Some(table?.get(key)?.get_ref().as_str()?.chars().take(NAME_MAX).collect::<String>());
        let (list, number) = path.split_once('.').unwrap_or((path, ""));
        let owner = match (text("a").zip(text("b")), text("name")) {
            (_, Some(name)) if list == "object" => format!("of `{name}`"),
            (_, Some(name)) => format!("of {list} `{name}`"),
            (Some((a, b)), None) => format!("of the {list} of `{a}` and `{b}`"),
            _ if number.parse::<usize>().is_ok() => format!("of `[[{list}]]`"),
            _ => format!("of `[{path}]`"),
        };
        Place { path: path.to_owned(), owner }
    }

    /// The place of the table under `key` of the one at `place`.
    pub(super) fn within(&self, place: &Place, key: &str) -> Place {
        if place.path.is_empty() { self.place(key) } else { place.table(key) }
    }

    /// The schema of a table, with the tables in it.
    fn schema<T: JsonSchema + 'static>(&mut self) -> Rc<Value> {
        Rc::clone(self.schemas.entry(TypeId::of::<T>()).or_insert_with(|| Rc::new(whole::<T>())))
    }

    /// The keys that the table of a type may have.
    pub(super) fn keys<T: JsonSchema + 'static>(&mut self) -> Vec<String> {
        self.schema::<T>()["properties"].as_object().into_iter().flatten().map(|(key, _)| key.clone()).collect()
    }

    /// Reads the `table` at `place`; `also` are further keys that are read apart from it. Every wrong key of it is reported, up to the
    /// first twenty: each is removed, so that the next is found. `None` where any was.
    pub(super) fn read<T: DeserializeOwned + JsonSchema + 'static>(
        &mut self,
        place: &Place,
        mut table: DeTable<'_>,
        also: &[&str],
    ) -> Option<T> {
        let (span, before) = (self.document.locate(&place.path), self.count());
        let mut taken: Vec<String> = Vec::new();
        for _ in 0..TABLE_PROBLEMS_MAX {
            let value = ValueDeserializer::from(Spanned::new(span.clone(), DeValue::Table(table.clone())));
            let error = match T::deserialize(value) {
                Ok(read) => {
                    let schema = self.schema::<T>();
                    limits::check(self, place, &schema, &table);
                    return (self.count() == before).then_some(read);
                }
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

    /// Which of `keys` the table at `place` has.
    pub(super) fn given<'k>(&self, place: &Place, keys: &[&'k str]) -> Vec<&'k str> {
        let table = self.document.find(&place.path).and_then(|found| found.get_ref().as_table());
        keys.iter().copied().filter(|key| table.is_some_and(|table| table.contains_key(*key))).collect()
    }

    /// The word under `key` of the table at `place`.
    pub(super) fn written(&self, place: &Place, key: &str) -> &'d str {
        self.document.find(&place.key(key)).and_then(|found| found.get_ref().as_str()).unwrap_or_default()
    }

    /// The number under `key` of the table at `place`, where it has one.
    pub(super) fn found(&self, place: &Place, key: &str) -> Option<f64> {
        limits::number(self.document.find(&place.key(key))?.get_ref())
    }

    /// Reports each of `keys` that the table at `place` has.
    pub(super) fn refuse(&mut self, place: &Place, keys: &[&str], what: impl Display, expected: &str) {
        self.given(place, keys).into_iter().for_each(|key| self.wrong(place, key, &what, expected));
    }

    /// Reports that `key` is wrong: its present value, and the expected one.
    pub(super) fn wrong(&mut self, place: &Place, key: &str, what: impl Display, expected: impl Into<String>) {
        let span = self.document.locate(&place.key(key));
        self.problems.push(Problem::new(span, format!("{} {what}", place.named(key))).expecting(expected));
    }

    /// A number whose range no key has for itself. One outside is reported and replaced by the nearest that is within it.
    pub(super) fn number(&mut self, place: &Place, key: &str, value: f64, range: NumberRange) -> f64 {
        if !range.contains(value) {
            self.wrong(place, key, format_args!("is {value}"), format!("expected {range}"));
        }
        range.nearest(value)
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
