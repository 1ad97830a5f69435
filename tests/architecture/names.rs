//! Names and parameters: words of the field alone, and no parameter that takes a tuple apart.
//!
//! In: the text of source files. Out: the names that they define, the parameters that they take. Never here: which file uses which.

use super::{is_test, sources};
use std::path::Path;

/// Words that no file, type, function and field may have in its name: `docs/GLOSSARY.md` has the words to use.
const DENIED: [&str; 33] = [
    "hall",
    "desk",
    "bell",
    "staff",
    "shelf",
    "berth",
    "fellow",
    "fellows",
    "abreast",
    "switchboard",
    "knock",
    "company",
    "guest",
    "guests",
    "mate",
    "mates",
    "leant",
    "borne",
    "lies",
    "presses",
    "purse",
    "told",
    "heed",
    "hear",
    "heard",
    "diary",
    "upheld",
    "foretell",
    "foretold",
    "tell",
    "blow",
    "whom",
    "sitting",
];

/// Of these the ones that a function or a field may have: buttons have presses.
const NOUNS: [&str; 1] = ["presses"];

/// The words of a name: split at capitals, underscores and digits.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = '_';
    for c in name.chars() {
        let starts = !before.is_alphabetic() || (c.is_uppercase() && !before.is_uppercase());
        if c.is_alphabetic() {
            if starts {
                words.push(String::new());
            }
            words.last_mut().unwrap().extend(c.to_lowercase());
        }
        before = c;
    }
    words
}

/// The names of the types that a file defines.
fn types(text: &str) -> Vec<&str> {
    let kinds = ["struct ", "enum ", "trait ", "type "];
    let name = |line: &'_ str| {
        let code = line.trim_start();
        let code =
            code.strip_prefix("pub ").or_else(|| Some(code.strip_prefix("pub(")?.split_once(") ")?.1)).unwrap_or(code);
        let at = kinds.iter().find_map(|kind| code.strip_prefix(kind))?.len();
        Some(line.len() - at)
    };
    text.lines()
        .filter_map(|line| Some(&line[name(line)?..]))
        .map(|rest| &rest[..rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len())])
        .collect()
}

/// The names of the functions and fields of a file: of fields those that stand on lines of their own.
fn functions_and_fields(text: &str) -> impl Iterator<Item = &str> {
    let name = |rest: &'_ str| rest.len() - rest.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_').len();
    let functions = text.match_indices("fn ").map(move |(at, _)| &text[at + 3..][..name(&text[at + 3..])]);
    let fields = text.lines().filter_map(move |line| {
        let code = line.trim_start().strip_suffix(',')?;
        let code = code.strip_prefix("pub ").or_else(|| Some(code.strip_prefix("pub(")?.split_once(") ")?.1));
        let code = code.unwrap_or(line.trim_start());
        let (field, rest) = code.split_at(name(code));
        rest.starts_with(": ").then_some(field)
    });
    functions.chain(fields)
}

#[test]
fn names_are_words_of_the_field() {
    let mut found = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !is_test(path)) {
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let stem = Path::new(&path).file_stem().unwrap().to_str().unwrap();
        let used = functions_and_fields(text).map(|name| (name, &NOUNS[..]));
        for (name, nouns) in [stem].into_iter().chain(types(text)).map(|name| (name, &[][..])).chain(used) {
            for word in
                words(name).iter().filter(|word| DENIED.contains(&word.as_str()) && !nouns.contains(&word.as_str()))
            {
                found.push(format!("{path}: {name}: {word}"));
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn names_are_compared_word_by_word() {
    assert_eq!(words("TouchRoom2d"), ["touch", "room", "d"]);
    assert_eq!(words("cast_ray"), ["cast", "ray"]);
    assert_eq!(types("pub struct Hall {\n    pub(super) enum B;\nfn type_of() {}"), ["Hall", "B"]);
    let text = "struct A {\n    pub told_m: f64,\n    b: u8,\n}\npub const fn tell<T>(c: u8) {}\n    f(d, e),";
    assert_eq!(functions_and_fields(text).collect::<Vec<_>>(), ["tell", "told_m", "b"]);
}

/// Where the parenthesis of the parameters is, if generics or it begin at `at`.
fn after_generics(text: &str, at: usize) -> Option<usize> {
    let mut depth = 0;
    for (offset, c) in text[at..].char_indices() {
        match c {
            '<' => depth += 1,
            '>' if !text[..at + offset].ends_with('-') => depth -= 1,
            '(' if depth == 0 => return Some(at + offset),
            _ if depth == 0 => return None,
            _ => {}
        }
    }
    None
}

/// Parameters of every function of `text`, as written.
fn parameters(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("fn ") {
        let name = text[at + 3..].find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or_default();
        let Some(open) = after_generics(text, at + 3 + name).filter(|_| name > 0) else { continue };
        let (mut depth, mut start) = (0_u32, open + 1);
        for (offset, c) in text[open..].char_indices() {
            match c {
                '(' | '[' | '{' | '<' => depth += 1,
                ')' | ']' | '}' => depth -= 1,
                // of `->` in a bound
                '>' if !text[..open + offset].ends_with('-') => depth -= 1,
                _ => {}
            }
            if depth == 0 || (c == ',' && depth == 1) {
                found.push(text[start..open + offset].trim());
                start = open + offset + 1;
            }
            if depth == 0 {
                break;
            }
        }
    }
    found
}

/// A parameter that takes a tuple apart is a missing type with named fields.
fn is_tuple(parameter: &str) -> bool {
    parameter.trim_start_matches('&').starts_with('(')
}

#[test]
fn no_function_takes_a_tuple_apart() {
    for (path, text) in sources().iter().filter(|(path, _)| !is_test(path)) {
        let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
        let tuples: Vec<_> = parameters(code).into_iter().filter(|parameter| is_tuple(parameter)).collect();
        assert!(tuples.is_empty(), "{path}: a struct with named fields instead of {tuples:?}");
    }
}

#[test]
fn parameters_that_are_tuples_are_found() {
    let code =
        "fn a<F: Fn(u8) -> u8>(x: Vec<(u8, u8)>, (y, z): (u8, [u8; 2])) {}\nfn b(f: impl Fn((u8, u8)) -> u8, w: u8) {}";
    let found = parameters(code);
    assert_eq!(found.iter().filter(|parameter| is_tuple(parameter)).count(), 1, "{found:?}");
    assert!(found.contains(&"(y, z): (u8, [u8; 2])") && found.contains(&"w: u8"), "{found:?}");
}
