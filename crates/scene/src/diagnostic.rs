//! Problems of a scene, shown at their positions: file, line, column, the text underlined, the expected value.
//!
//! In: positions in the text and messages. Out: [`SceneError`], for people (miette) and for programs.
//! Never here: the rules themselves.

use super::snippet::{Excerpt, readable};
use miette::{Diagnostic, SourceSpan};
use std::ops::Range;
use thiserror::Error;

/// Most problems that are shown; further ones are counted.
const SHOWN_MAX: usize = 50;

/// Text longer than this is cut where a problem quotes it, in characters.
const QUOTE_MAX: usize = 80;

/// A scene that cannot be used, with all its problems.
#[derive(Debug, Error, Diagnostic)]
#[error("{}", headline(name, problems.len() + hidden))]
pub struct SceneError {
    /// The scene's name or file.
    pub name: String,
    /// The problems, in the order of the text; at least one.
    #[related]
    pub problems: Vec<SceneProblem>,
    /// Number of further problems that are not shown.
    pub hidden: usize,
}

fn headline(name: &str, count: usize) -> String {
    match count {
        1 => format!("the scene {name} cannot be used"),
        n => format!("the scene {name} cannot be used: {n} problems"),
    }
}

/// One problem of a scene.
#[derive(Debug, Error, Diagnostic)]
#[error("{message}")]
pub struct SceneProblem {
    /// Description of the problem.
    pub message: String,
    /// The expected value, shown under the text.
    pub expected: String,
    /// A further hint.
    #[help]
    pub help: Option<String>,
    /// Line of the offending text, from 1; 0 where a file could not be read at all.
    pub line: usize,
    /// Column of its first character, from 1; 0 where a file could not be read at all.
    pub column: usize,
    /// The offending text, cut after 80 characters.
    pub text: String,
    #[source_code]
    source_code: Option<Excerpt>,
    #[label("{expected}")]
    span: Option<SourceSpan>,
}

impl SceneError {
    /// The error of a scene that could not be read at all.
    #[must_use]
    pub fn unreadable(name: &str, message: String, help: Option<String>) -> Self {
        let problem = SceneProblem {
            message,
            expected: String::new(),
            help,
            line: 0,
            column: 0,
            text: String::new(),
            source_code: None,
            span: None,
        };
        Self { name: name.to_owned(), problems: vec![problem], hidden: 0 }
    }

    /// `problems` shown in `text`, in the order of the text.
    pub(super) fn new(name: &str, text: &str, mut problems: Vec<Problem>) -> Self {
        problems.sort_by_key(|p| (p.span.start, p.span.end));
        let hidden = problems.len().saturating_sub(SHOWN_MAX);
        problems.truncate(SHOWN_MAX);
        let problems = problems.into_iter().map(|p| p.shown(name, text)).collect();
        Self { name: name.to_owned(), problems, hidden }
    }
}

/// A problem before it is shown: a position in the text, and messages.
#[derive(Debug)]
pub(super) struct Problem {
    span: Range<usize>,
    message: String,
    expected: String,
    help: Option<String>,
}

impl Problem {
    pub(super) fn new(span: Range<usize>, message: String) -> Self {
        Self { span, message, expected: "here".to_owned(), help: None }
    }

    pub(super) fn expecting(mut self, expected: impl Into<String>) -> Self {
        self.expected = expected.into();
        self
    }

    pub(super) fn helped(mut self, help: Option<String>) -> Self {
        self.help = help;
        self
    }

    /// A problem that TOML or serde found; `nearby` is its position if the error has none, `also` are further keys of the table.
    pub(super) fn from_toml(error: &toml::de::Error, nearby: Range<usize>, also: &[&str]) -> Self {
        let span = error.span().unwrap_or(nearby);
        let message = error.message();
        if message.starts_with("unknown field") {
            return Self::unknown_key(span, &quoted_words(message), also);
        }
        let (text, expected) = plain_words(message);
        let words = quoted_words(message);
        let help = words.split_first().and_then(|(wrong, known)| did_you_mean(wrong, known.iter().copied()));
        let problem = Self::new(span, text).helped(help);
        match expected {
            Some(expected) => problem.expecting(expected),
            None => problem,
        }
    }

    fn unknown_key(span: Range<usize>, words: &[&str], also: &[&str]) -> Self {
        let Some((wrong, known)) = words.split_first() else { return Self::new(span, "unknown key".to_owned()) };
        let mut known: Vec<&str> = also.iter().chain(known).copied().collect();
        known.sort_unstable();
        known.dedup();
        let near = did_you_mean(wrong, known.iter().copied());
        let expected = near.unwrap_or_else(|| "expected one of the keys below".to_owned());
        let problem = Self::new(span, format!("there is no key `{wrong}` in this table")).expecting(expected);
        problem.helped(Some(format!("keys of this table: {}", known.join(", "))))
    }

    fn shown(self, name: &str, source: &str) -> SceneProblem {
        let start = floor_boundary(source, self.span.start);
        let end = floor_boundary(source, self.span.end.max(start));
        let excerpt = Excerpt::of(name, source, &(start..end));
        SceneProblem {
            message: readable(&self.message),
            expected: readable(&self.expected),
            help: self.help.as_deref().map(readable),
            line: excerpt.line,
            column: excerpt.column,
            text: source[start..end].chars().take(QUOTE_MAX).collect(),
            span: Some(SourceSpan::from(excerpt.span.clone())),
            source_code: Some(excerpt),
        }
    }
}

fn floor_boundary(text: &str, at: usize) -> usize {
    let at = at.min(text.len());
    (0..=at).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0)
}

/// Translates serde's message into terms of a scene: the message, and the expected value if it has one.
fn plain_words(message: &str) -> (String, Option<String>) {
    let first_line = message.lines().next().unwrap_or_default();
    // every choice in a scene is one of a list of words, and toml requests one in a wording of its own
    if first_line.starts_with("wanted ") {
        return (
            "the value must be a single word".to_owned(),
            Some("expected a word in quotes, such as \"auto\"".to_owned()),
        );
    }
    let (found, expected) = match first_line.split_once(", expected ") {
        Some((found, expected)) => (found, Some(format!("expected {}", plain_type(expected)))),
        None => (first_line, None),
    };
    if let Some(key) = found.strip_prefix("missing field ") {
        return (format!("the key {key} is missing"), Some(format!("expected {key} in this table")));
    }
    // serde names the type that it read a huge integer as
    (found.replace("unknown variant", "unknown value").replace(" as i128", "").replace(" as u128", ""), expected)
}

fn plain_type(expected: &str) -> String {
    match expected {
        "f64" => "a number".to_owned(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or above".to_owned(),
        "i64" => "a whole number".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list [ … ]".to_owned(),
        "an array of length 3" => "3 numbers: [x, y, z]".to_owned(),
        other if other.starts_with("struct ") => "a table".to_owned(),
        other => other.to_owned(),
    }
}

/// The words between backquotes.
fn quoted_words(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

/// A suggestion for `wrong` out of `known`, if one is near enough.
pub(super) fn did_you_mean<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    const NEAR_ENOUGH: f64 = 0.75;
    let (score, word) =
        known.into_iter().map(|word| (strsim::jaro_winkler(wrong, word), word)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (score >= NEAR_ENOUGH && word != wrong).then(|| format!("did you mean `{word}`?"))
}
