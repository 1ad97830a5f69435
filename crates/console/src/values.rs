//! Values of arguments that several commands share, and the arguments common to the commands that judge scenes.
//!
//! In: text. Out: numbers, sizes, keys and values. Never here: whether a scene has such a key.

use clap::Args;
use metachron_scene::Limits;

/// How far a scene may go, as arguments of every command that reads one.
#[derive(Debug, Clone, Copy, Args)]
pub struct LimitArgs {
    /// Refuse a scene that is estimated to take more memory, such as 512MiB or 2GiB; half of the machine's, or of its
    /// control group's, where not given
    #[arg(long, value_name = "SIZE", value_parser = memory)]
    pub memory_limit: Option<u64>,
    /// Read files that the scene names outside of its folder, by `..` or behind links
    #[arg(long)]
    pub allow_outside: bool,
}

impl LimitArgs {
    /// The limits that they ask for.
    #[must_use]
    pub fn limits(&self) -> Limits {
        let default = Limits::default();
        Limits { memory_bytes: self.memory_limit.unwrap_or(default.memory_bytes), allow_outside: self.allow_outside }
    }
}

/// The arguments common to the commands that judge scenes: `check`, `tune`, `fit`.
#[derive(Debug, Args)]
pub struct CommonArgs {
    /// Change a key of the scene; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Print the result as JSON on standard output and nothing else there
    #[arg(long)]
    pub json: bool,
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
    /// How far the scene may go.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// Splits KEY=VALUE; white space around key and value is dropped.
///
/// # Errors
/// A sentence for text without a key or without the `=` sign.
pub fn assignment(text: &str) -> Result<(String, String), String> {
    match equals_sign(text).map(|at| (&text[..at], &text[at + 1..])) {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("expected KEY=VALUE, such as target.frame_hz=60".to_owned()),
    }
}

/// An object that one of several hosts is to step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pin {
    /// Its name.
    pub object: String,
    /// The host's name.
    pub host: String,
}

/// Splits OBJECT=HOST.
///
/// # Errors
/// A sentence for text without the `=` sign.
pub fn pin(text: &str) -> Result<Pin, String> {
    let (object, host) = text.split_once('=').ok_or("expected OBJECT=HOST, such as probe=lab2")?;
    Ok(Pin { object: object.to_owned(), host: host.to_owned() })
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

/// Parses a span of seconds, 0.001 … 1e7.
///
/// # Errors
/// A sentence that says what was expected.
pub fn seconds(text: &str) -> Result<f64, String> {
    bounded(text, 1e-3, 1e7, "seconds")
}

/// Parses frames a second, 1 … 1000.
///
/// # Errors
/// A sentence that says what was expected.
pub fn target_fps(text: &str) -> Result<f64, String> {
    bounded(text, 1.0, 1000.0, "frames a second")
}

/// Parses an amount of memory in MiB or GiB; its value is in bytes.
///
/// # Errors
/// A sentence that says what was expected.
pub fn memory(text: &str) -> Result<u64, String> {
    let least = Limits::MEMORY_LEAST_BYTES;
    let expected = || {
        format!("expected {}MiB, the least that holds an object, to 1048576GiB, such as 512MiB or 1.5GiB", least >> 20)
    };
    let units = [("MiB", 20_u32), ("GiB", 30)];
    let split = |(unit, shift)| Some((text.strip_suffix(unit)?.trim().parse::<f64>().ok()?, shift));
    let (amount, shift) = units.into_iter().find_map(split).ok_or_else(expected)?;
    let bytes = amount * f64::from(1_u32 << shift);
    (least as f64..=1.125_899_906_842_624e15).contains(&bytes).then_some(bytes as u64).ok_or_else(expected)
}

/// Parses a number from `least` to `greatest`.
///
/// # Errors
/// A sentence that says what was expected.
pub fn bounded(text: &str, least: f64, greatest: f64, unit: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|v| (least..=greatest).contains(v));
    value.ok_or_else(|| format!("expected {least} to {greatest} {unit}"))
}

/// Parses `WIDTHxHEIGHT` in pixels, each 1 … 8192.
///
/// # Errors
/// A sentence that says what was expected.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let expected = || "expected WIDTHxHEIGHT, each 1 to 8192, such as 1280x720".to_owned();
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(expected)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=8192).contains(n)).ok_or_else(expected);
    Ok([side(width)?, side(height)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_keys_may_contain_an_equals_sign() {
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

    #[test]
    fn sizes_are_two_numbers_of_pixels() {
        assert_eq!(size("640x360"), Ok([640, 360]));
        for bad in ["640", "0x360", "640x", "640x9000", "-1x2", "axb", "1x2x3"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn amounts_of_memory_have_a_unit() {
        assert_eq!(memory("512MiB"), Ok(512 << 20));
        assert_eq!(memory("1.5 GiB"), Ok(3 << 29));
        assert_eq!(memory("10MiB"), Ok(10 << 20));
        assert!(memory("9MiB").unwrap_err().starts_with("expected 10MiB, the least"));
        for bad in ["512", "0MiB", "9.99MiB", "-1GiB", "nanGiB", "2GB", "1e9GiB", "MiB"] {
            assert!(memory(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_of_seconds_are_finite_and_above_zero() {
        for bad in ["nan", "inf", "-1", "0", "1e300", "", "x"] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }
}
