//! Parses the KEY=VALUE argument of `--set`.
//!
//! In: text. Out: key and value. Never here: whether there is such a key.

/// Splits KEY=VALUE; white space around key and value is dropped.
///
/// # Errors
/// A sentence for text without a key or without the `=` sign.
pub(super) fn assignment(text: &str) -> Result<(String, String), String> {
    match equals_sign(text).map(|at| (&text[..at], &text[at + 1..])) {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("expected KEY=VALUE, such as target.frame_hz=60".to_owned()),
    }
}

/// The position of the `=` between key and value; parts of the key in quotes may contain others.
fn equals_sign(text: &str) -> Option<usize> {
    let (mut open, mut before) = (None, '.');
    for (at, c) in text.char_indices() {
        match (open, c) {
            (None, '=') => return Some(at),
            (None, '"' | '\'') if before == '.' => open = Some(c),
            (Some(quote), c) if c == quote && before != '\\' => open = None,
            _ => {}
        }
        before = c;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_in_quotes_may_hold_the_sign_that_ends_a_key() {
        let pair = |key: &str, value: &str| Ok((key.to_owned(), value.to_owned()));
        assert_eq!(assignment("target.frame_hz = 60"), pair("target.frame_hz", "60"));
        assert_eq!(assignment("object.\"a=b.c\".look='x=y'"), pair("object.\"a=b.c\".look", "'x=y'"));
        assert_eq!(assignment("object.six\"inch.n=2"), pair("object.six\"inch.n", "2"));
        assert!(assignment("=2").is_err() && assignment("'a=2").is_err());
    }

    #[test]
    fn an_assignment_keeps_what_follows_the_first_equals_sign() {
        assert_eq!(assignment("a.b=c=d"), Ok(("a.b".to_owned(), "c=d".to_owned())));
        assert!(assignment("a.b").is_err());
        assert!(assignment("=1").is_err());
    }
}
