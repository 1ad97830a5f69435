//! Blocks of a document: what stands between `<!-- metachron … -->` and `<!-- end -->` is what that command prints.
//!
//! In: the text of a document. Out: its prose and its blocks, in order. Never here: what a command prints.

use anyhow::{Context, bail};

/// Begins a block; the command follows, then, each after a `|`, what of it is shown.
const OPENS: &str = "<!-- metachron ";
const CLOSES: &str = "<!-- end -->";

/// A part of a document.
#[derive(Debug, PartialEq)]
pub(super) enum Part<'a> {
    /// Lines that people write.
    Prose(&'a str),
    /// Lines that a command prints.
    Block(Block<'a>),
}

/// Lines that a command prints.
#[derive(Debug, PartialEq)]
pub(super) struct Block<'a> {
    /// The line that names the command, and its number from 1.
    pub(super) opening: &'a str,
    pub(super) line: usize,
    /// The command's words after `metachron`.
    pub(super) words: Vec<&'a str>,
    /// Only rows with one of these values in this column.
    pub(super) only: Vec<(&'a str, Vec<&'a str>)>,
    /// The parts shown; the whole table where nothing is named.
    pub(super) views: Vec<View<'a>>,
    /// The lines that stand in the document.
    pub(super) body: &'a str,
}

/// A part of an experiment's result.
#[derive(Debug, PartialEq)]
pub(super) enum View<'a> {
    /// These columns of its table.
    Columns(Vec<&'a str>),
    /// Its claims, what was measured and whether they hold.
    Claims,
    /// Its figure, which stands beside the document in `figures`.
    Figure,
}

/// A document as prose and blocks. Code between fences is prose, whatever is in it.
///
/// # Errors
/// A block or a fence that is not closed, a line that nearly opens or closes a block.
pub(super) fn parts(text: &str) -> anyhow::Result<Vec<Part<'_>>> {
    let (mut parts, mut rest, mut line) = (Vec::new(), text, 1);
    while let Some(from) = opening(rest, line)? {
        let (prose, block) = rest.split_at(from);
        line += prose.matches('\n').count();
        let place = || format!("line {line}: `{}`", block.lines().next().unwrap_or_default());
        let (opening, after) = block.split_once('\n').with_context(|| format!("{} has no end", place()))?;
        let end = after.find(CLOSES).with_context(|| format!("{} is not closed by `{CLOSES}`", place()))?;
        let body = &after[..end];
        if body.contains(OPENS) {
            bail!("{} is not closed by `{CLOSES}` before the next", place());
        }
        parts.extend([Part::Prose(prose), Part::Block(read(opening, line, body).with_context(place)?)]);
        line += 1 + body.matches('\n').count();
        rest = &after[end..];
    }
    parts.push(Part::Prose(rest));
    Ok(parts)
}

/// Where the next block of `text` opens; its first line, of this number, may close the block before.
fn opening(text: &str, number: usize) -> anyhow::Result<Option<usize>> {
    let (mut from, mut within, mut opened) = (0, None, 0);
    for (k, line) in text.split_inclusive('\n').enumerate() {
        let inner = line.trim();
        match within {
            Some((mark, length)) if inner.chars().all(|c| c == mark) && inner.len() >= length => within = None,
            Some(_) => {}
            None if line.starts_with(OPENS) => return Ok(Some(from)),
            None if (from, line.starts_with(CLOSES)) == (0, true) && number > 1 => {}
            None if resembles(inner) => bail!(
                "line {}: `{inner}` is no block; expected `{OPENS}COMMAND -->` or `{CLOSES}` of one, at the beginning of a line",
                number + k
            ),
            None => (within, opened) = (fence(inner), number + k),
        }
        from += line.len();
    }
    // what is behind an open fence would be prose, its blocks too
    within.map_or(Ok(None), |_| bail!("line {opened}: this fence is not closed"))
}

/// The mark of a fence that a line opens, and how many of it; the line that closes it has no fewer.
fn fence(line: &str) -> Option<(char, usize)> {
    let mark = line.chars().next().filter(|first| ['`', '~'].contains(first))?;
    let length = line.len() - line.trim_start_matches(mark).len();
    (length >= 3 && !line[length..].contains('`')).then_some((mark, length))
}

/// Whether a line looks as if it were meant to open or close a block: a comment of one of the two words, or nearly.
fn resembles(line: &str) -> bool {
    const NEAR_ENOUGH: f64 = 0.85;
    let Some(comment) = line.strip_prefix("<!").map(|rest| rest.trim_start_matches(['-', ' '])) else { return false };
    let mut words = comment.split(|c: char| c.is_whitespace() || c == '-' || c == '>').filter(|word| !word.is_empty());
    let word = words.next().unwrap_or_default().to_lowercase();
    word == "end" && words.next().is_none() || strsim::jaro_winkler(&word, "metachron") >= NEAR_ENOUGH
}

/// A block from the line that opens it.
fn read<'a>(opening: &'a str, line: usize, body: &'a str) -> anyhow::Result<Block<'a>> {
    let inner = opening.trim_end().strip_prefix(OPENS).and_then(|rest| rest.strip_suffix("-->"));
    let mut told = inner.context("a block begins with one line, `<!-- metachron … -->`")?.split('|').map(str::trim);
    let words = told.next().unwrap_or_default().split_whitespace().collect();
    let list = |text: &'a str| text.split(',').map(str::trim).collect::<Vec<_>>();
    let (mut only, mut views) = (Vec::new(), Vec::new());
    for one in told {
        match (one, one.split_once(" = ")) {
            (_, Some((column, values))) => only.push((column.trim(), list(values))),
            ("claims", None) => views.push(View::Claims),
            ("figure", None) => views.push(View::Figure),
            (columns, None) => views.push(View::Columns(list(columns))),
        }
    }
    Ok(Block { opening, line, words, only, views, body })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_is_its_prose_and_its_blocks() {
        let text = "A\n<!-- metachron chart stability --only incline | body = box, tube | body, tan/μ | claims -->\nold\n<!-- end -->\nB\n";
        let parts = parts(text).unwrap();
        let [Part::Prose("A\n"), Part::Block(block), Part::Prose("<!-- end -->\nB\n")] = &parts[..] else {
            panic!("{parts:?}")
        };
        assert_eq!((block.line, block.body, block.words.len()), (2, "old\n", 4));
        assert_eq!(block.only, [("body", vec!["box", "tube"])]);
        assert_eq!(block.views, [View::Columns(vec!["body", "tan/μ"]), View::Claims]);
    }

    #[test]
    fn an_open_block_is_refused_with_its_line() {
        for text in
            ["A\n<!-- metachron list -->\nB\n", "A\n<!-- metachron list -->\n<!-- metachron list -->\n<!-- end -->\n"]
        {
            let why = parts(text).unwrap_err().to_string();
            assert!(why.starts_with("line 2: `<!-- metachron list -->` is not closed"), "{why}");
        }
        assert_eq!(parts("in `<!-- metachron list -->` prose\n").unwrap().len(), 1);
    }

    #[test]
    fn a_line_that_nearly_opens_or_closes_a_block_is_refused_with_its_number() {
        for line in [
            "<!--metachron list -->",
            " <!-- metachron list -->",
            "<!-- Metachron list -->",
            "<!-- metacron list -->",
            "<!-  metachron list -->",
            "<!-- metachron: list -->",
            "<!-- metachron-->",
            "<!-- end -->",
            "<!--end-->",
            "<!-- END -->",
        ] {
            let why = parts(&format!("A\n\n{line}\nB\n")).unwrap_err().to_string();
            assert!(why.starts_with(&format!("line 3: `{}` is no block", line.trim())), "{why}");
        }
        let closed_twice = "<!-- metachron list -->\n<!-- end -->\n<!-- end -->\n";
        assert!(parts(closed_twice).unwrap_err().to_string().starts_with("line 3: "));
        for prose in ["<!-- a remark -->\n", "<!-- ends here -->\n", "metachron\n"] {
            assert_eq!(parts(prose).unwrap(), [Part::Prose(prose)]);
        }
    }

    #[test]
    fn code_between_fences_is_not_run() {
        let code = "```md\n<!-- metachron list -->\n<!--metachron list-->\n```\n~~~~\n```\n~~~\n<!-- metachron list -->\n~~~~~\n";
        assert_eq!(parts(code).unwrap(), [Part::Prose(code)]);
        let after = format!("{code}<!-- metachron list -->\n<!-- end -->\n");
        let parts = parts(&after).unwrap();
        let [Part::Prose(before), Part::Block(block), _] = &parts[..] else { panic!("{parts:?}") };
        assert_eq!((*before, block.line), (code, 10));
        let open = "A\n\n```sh\n<!-- metachron list -->\n<!-- end -->\n";
        assert!(super::parts(open).unwrap_err().to_string().starts_with("line 3: this fence is not closed"));
    }
}
