//! Excerpts of a scene's text around one position, cut to a readable length: a file may be one line of a megabyte.
//!
//! In: a text and a position in it. Out: an [`Excerpt`] with its own offsets, and its line and column in the whole text; shortened words
//! and numbers. Never here: the fault there.

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use std::ops::Range;

/// Longest line that is shown whole, and the length shown of a longer one, in characters.
const WIDTH: usize = 120;
/// Characters of a longer line that are shown before the position.
const BEFORE: usize = 40;
/// Words longer than this are cut, in characters.
const WORDS_MAX: usize = 1500;
/// A number with more digits is written as a power of ten: twice the digits that distinguish any two numbers.
const DIGITS_MAX: usize = 34;

/// A line with its neighbours before and after.
#[derive(Debug)]
pub(super) struct Excerpt {
    name: String,
    text: String,
    /// Range of the position in `text`; at most to the end of its line.
    pub(super) span: Range<usize>,
    /// Line and column of the position in the whole text, from 1.
    pub(super) line: usize,
    pub(super) column: usize,
    /// Lines of `text` above the position.
    above: usize,
}

impl Excerpt {
    /// The excerpt around `place` in `source`; both ends of `place` are boundaries of characters.
    pub(super) fn of(name: &str, source: &str, place: &Range<usize>) -> Self {
        let begin = source[..place.start].rfind('\n').map_or(0, |at| at + 1);
        let (above, from) = (&source[..begin], place.start - begin);
        let mut below = source[begin..].lines();
        let here = below.next().unwrap_or_default();
        let to = from.max(here.len().min(place.end - begin));
        let (here, span) = cut(here, from.min(here.len())..to.min(here.len()));
        let mut text = String::new();
        if let Some(before) = above.lines().next_back() {
            text = cut(before, 0..0).0 + "\n";
        }
        let start = text.len();
        text += &here;
        if let Some(next) = below.next() {
            text += "\n";
            text += &cut(next, 0..0).0;
        }
        Self {
            name: name.to_owned(),
            span: start + span.start..start + span.end,
            line: above.matches('\n').count() + 1,
            column: source[begin..place.start].chars().count() + 1,
            above: usize::from(start > 0),
            text,
        }
    }
}

/// A line cut to the characters around `place`, and the range of `place` in the result.
fn cut(line: &str, place: Range<usize>) -> (String, Range<usize>) {
    let at = |chars: usize| line.char_indices().nth(chars).map_or(line.len(), |(at, _)| at);
    let whole = at(WIDTH) == line.len();
    let first = if whole { 0 } else { at(line[..place.start].chars().count().saturating_sub(BEFORE)) };
    let last = line[first..].char_indices().nth(WIDTH).map_or(line.len(), |(at, _)| first + at);
    let mark = |is_cut: bool| if is_cut { "…" } else { "" };
    let (before, after) = (mark(first > 0), mark(last < line.len()));
    let moved = |at: usize| at.min(last) - first + before.len();
    (format!("{before}{}{after}", &line[first..last]), moved(place.start)..moved(place.end))
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        _: &SourceSpan,
        lines_before: usize,
        _: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let all = SourceSpan::from(0..self.text.len());
        // without lines around it only the position of the place is requested
        let (line, column) =
            if lines_before == 0 { (self.line - 1, self.column - 1) } else { (self.line - 1 - self.above, 0) };
        let (name, text) = (self.name.clone(), self.text.as_bytes());
        Ok(Box::new(MietteSpanContents::new_named(name, text, all, line, column, self.text.lines().count())))
    }
}

/// Shortens a message: numbers of many digits become powers of ten, and words past a page are cut.
pub(super) fn readable(words: &str) -> String {
    let mut out = String::with_capacity(words.len().min(4 * WORDS_MAX));
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.';
    for part in words.split_inclusive(|c| !is_of_number(c)) {
        let digits = part.trim_end_matches(|c| !is_of_number(c));
        let number = (digits.len() > DIGITS_MAX).then(|| digits.parse::<f64>().ok()).flatten();
        match number {
            Some(number) => out += &format!("{number:e}{}", &part[digits.len()..]),
            None => out += part,
        }
    }
    match out.char_indices().nth(WORDS_MAX) {
        Some((end, _)) => format!("{} …", &out[..end]),
        None => out,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_is_cut_around_its_position_and_keeps_its_column() {
        let line = format!("x = \"{}ä-1\"{}", "ö".repeat(500), "b".repeat(500));
        let source = format!("{}\n{line}\nshort\n", "a".repeat(300));
        let at = source.find("-1").unwrap();
        let excerpt = Excerpt::of("x.toml", &source, &(at..at + 2));
        assert_eq!((&excerpt.text[excerpt.span.clone()], excerpt.line, excerpt.column), ("-1", 2, 507));
        let lengths: Vec<_> = excerpt.text.lines().map(|line| line.chars().count()).collect();
        assert_eq!(lengths, [WIDTH + 1, WIDTH + 2, 5], "each with a mark where it is cut");
    }

    #[test]
    fn positions_at_both_ends_of_a_text_are_shown() {
        for (source, place, line) in [("", 0..0, 1), ("a\n", 2..2, 2), ("a", 0..1, 1), ("a\r\nb", 3..4, 2)] {
            let excerpt = Excerpt::of("x", source, &place);
            assert_eq!((&excerpt.text[excerpt.span.clone()], excerpt.line), (&source[place], line), "{source:?}");
        }
    }

    #[test]
    fn numbers_are_shown_without_a_line_of_zeros() {
        let said = format!("`radius_m` is {}, from {} to 10000.", 1e308, -1e-300);
        assert_eq!(readable(&said), "`radius_m` is 1e308, from -1e-300 to 10000.");
        assert!(readable(&"ä b ".repeat(100_000)).chars().count() < 1600);
    }
}
