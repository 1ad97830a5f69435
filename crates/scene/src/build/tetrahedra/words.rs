//! The words of a text, each with its line.
//!
//! In: bytes. Out: words and numbers, or the line where another one was expected. Never here: their meaning.

use std::fmt::Display;
use std::str::FromStr;

/// Words separated by white space.
pub(super) struct Words<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Words<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, line: 1 }
    }

    /// The next word; `None` at the end.
    pub fn word(&mut self) -> Option<&'a str> {
        while let Some(byte) = self.text.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n');
            self.at += 1;
        }
        let rest = &self.text[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| str::from_utf8(&rest[..length]).unwrap_or("\u{fffd}"))
    }

    /// The rest of the line, and its end.
    pub fn rest_of_line(&mut self) -> &'a str {
        let rest = &self.text[self.at..];
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        self.line += 1;
        str::from_utf8(&rest[..length]).unwrap_or("\u{fffd}").trim()
    }

    /// The next number.
    pub fn number<T: FromStr>(&mut self, what: impl Display) -> Result<T, String> {
        let word = self.word();
        let found = || word.map_or_else(|| "the end of the file".to_owned(), |word| format!("`{word}`"));
        word.and_then(|word| word.parse().ok())
            .ok_or_else(|| self.wrong(format_args!("expected {what}, found {}", found())))
    }

    /// A fault at this line.
    pub fn wrong(&self, what: impl Display) -> String {
        format!("line {}: {what}", self.line)
    }

    /// So many bytes that follow the end of this line as they are.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], String> {
        let found = self.text.get(self.at..).and_then(|rest| rest.get(..count));
        self.at += count;
        found.ok_or_else(|| format!("it ends within a block of {count} bytes after line {}", self.line - 1))
    }
}
