//! Gains as text: as typed after `--analyse`, and as the TOML fragment that `run --gains` and a scene take.
//!
//! In: text. Out: a candidate with its gains, or overrides of a scene. Never here: which gains are good.

use super::output::BadInput;
use metachron_core::{NumberRange, gains};
use metachron_lod::adaptive::{DEFAULT_MARGIN, MARGIN_MAX};
use metachron_lod::control::{Law, RateGains};
use metachron_lod::tune::{Candidate, NORMALISED};
use std::path::Path;

/// The keys of `[target]` that a fragment may have.
const KEYS: [&str; 8] = ["policy", "law", "alpha", "beta", "kappa", "lead", AGENT_REFINE, AGENT_YIELD];
const AGENT_REFINE: &str = "agent_refine";
const AGENT_YIELD: &str = "agent_yield";
const MARGIN: &str = "margin";
/// Longest fragment, bytes.
const BYTES_MAX: u64 = 1 << 16;

/// The names of each gain, and its key.
const GAINS: [(&[&str], &str); 7] = [
    (&["α", "alpha"], "alpha"),
    (&["β", "beta"], "beta"),
    (&["k"], "k"),
    (&["κ", "kappa"], "kappa"),
    (&["λ", "lead"], "lead"),
    (&["margin"], MARGIN),
    (&["law"], "law"),
];
/// Laws by name, each with its gains.
const LAWS: [(&str, &[&str]); 5] = [
    ("printed", &["alpha", "beta"]),
    ("normalised", &["k", "beta"]),
    ("corrected", &["kappa", "lead", MARGIN]),
    ("pi", &["kappa", "lead", MARGIN]),
    ("adaptive", &[MARGIN]),
];

/// The candidate given by `α=1e-4,β=5`, `kappa=0.5,margin=0.1` or `law=adaptive` at a target rate; other gains have the law's defaults.
pub fn parse(text: &str, target_hz: f64) -> anyhow::Result<Candidate> {
    let (mut law, mut given) = (None, Vec::new());
    for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let (name, value) = part.split_once('=').ok_or_else(|| refused(text, "each gain must be NAME=NUMBER"))?;
        let (name, value) = (canonical(name.trim()).ok_or_else(|| unknown(name.trim()))?, value.trim());
        if name == "law" {
            law = Some(LAWS.iter().find(|(known, _)| *known == value).ok_or_else(|| no_law(value))?);
            continue;
        }
        let value: f64 = value.parse().map_err(|_| refused(text, "each gain must be NAME=NUMBER"))?;
        given.push((name, value));
    }
    if law.is_none() && given.is_empty() {
        return Err(refused(text, "no gain is given"));
    }
    let has = |law: &&(&str, &[&str])| given.iter().all(|(name, _)| law.1.contains(name));
    let law = match law {
        Some(law) => Some(law).filter(has),
        None => LAWS.iter().find(has),
    };
    let (law, _) = law.ok_or_else(|| {
        refused(
            text,
            "α and β belong to the printed law, k to the normalised, κ, λ and margin to the corrected: give the gains of one law",
        )
    })?;
    candidate(law, &|name| given.iter().rev().find(|(n, _)| *n == name).map(|(_, v)| *v), target_hz)
}

fn candidate(law: &str, value: &dyn Fn(&str) -> Option<f64>, target_hz: f64) -> anyhow::Result<Candidate> {
    let gain = |shown: &str, name: &str, own: f64, range: NumberRange| {
        let gain = value(name).unwrap_or(own);
        check_range(shown, gain, range).map(|()| gain)
    };
    let beta = || gain("β", "beta", 5.0, gains::BETA);
    let lead = if law == "pi" { 0.2 } else { 0.0 };
    Ok(match law {
        "printed" => Law::Printed { alpha: gain("α", "alpha", 1e-4, gains::ALPHA)?, beta: beta()? }.into(),
        "normalised" => {
            let k = gain("k", "k", NORMALISED, NumberRange::new(1e-6, 10.0, ""))?;
            Law::Printed { alpha: k / target_hz, beta: beta()? }.into()
        }
        "adaptive" => Candidate::Adaptive {
            margin: gain(MARGIN, MARGIN, DEFAULT_MARGIN, NumberRange { greatest: MARGIN_MAX, ..gains::MARGIN })?,
        },
        _ => Law::Corrected {
            kappa: gain("κ", "kappa", 0.5, gains::KAPPA)?,
            lead: gain("λ", "lead", lead, gains::LEAD)?,
            margin: gain(MARGIN, MARGIN, 0.1, gains::MARGIN)?,
        }
        .into(),
    })
}

fn canonical(name: &str) -> Option<&'static str> {
    GAINS.iter().find(|(names, _)| names.contains(&name)).map(|(_, name)| *name)
}

fn no_law(name: &str) -> anyhow::Error {
    let laws = LAWS.map(|(name, _)| name).join(", ");
    BadInput(format!("there is no law `{name}` (there are: {laws})")).into()
}

fn check_range(name: &str, value: f64, range: NumberRange) -> anyhow::Result<()> {
    if range.contains(value) {
        return Ok(());
    }
    let NumberRange { least: low, greatest: high, .. } = range;
    Err(BadInput(format!("the gain {name} = {value} is out of range: expected {low} to {high}")).into())
}

fn unknown(name: &str) -> anyhow::Error {
    BadInput(format!(
        "there is no gain `{name}` (there are: α or alpha, β or beta, k, κ or kappa, λ or lead, margin, law)"
    ))
    .into()
}

fn refused(text: &str, why: &str) -> anyhow::Error {
    BadInput(format!("`{text}` is not a list of gains: {why}; expected for example α=1e-4,β=5 or kappa=0.5,margin=0.1"))
        .into()
}

/// The gains in one line.
pub fn gains_text(candidate: Candidate) -> String {
    match candidate {
        Candidate::Feedback(Law::Printed { alpha, beta }) => format!("α = {alpha:.3e}, β = {}", digits(beta)),
        Candidate::Feedback(Law::Corrected { kappa, lead: 0.0, margin }) => {
            format!("κ = {kappa:.3}, margin = {margin:.3}")
        }
        Candidate::Feedback(Law::Corrected { kappa, lead, margin }) => {
            format!("κ = {kappa:.3}, λ = {lead:.3}, margin = {margin:.3}")
        }
        Candidate::Adaptive { margin } => format!("margin = {margin:.3}"),
    }
}

/// A number that may be small, in a form that can be typed again.
fn digits(value: f64) -> String {
    if value < 0.01 { format!("{value:.3e}") } else { format!("{value:.3}") }
}

/// The scene fragment that selects `law`, and the gains of the `agents` where some were found, with `comment` above it.
pub fn fragment(law: Law, agents: Option<RateGains>, comment: &str) -> String {
    let comment: String = comment.lines().map(|line| format!("# {line}\n")).collect();
    let gains = match law {
        Law::Printed { alpha, beta } => format!("law = \"printed\"\nalpha = {alpha:e}\nbeta = {beta:e}\n"),
        Law::Corrected { kappa, lead, margin } => {
            format!("law = \"corrected\"\nkappa = {kappa}\nlead = {lead}\nmargin = {margin}\n")
        }
    };
    let agents = agents.map_or_else(String::new, |RateGains { refine, yielding }| {
        format!("{AGENT_REFINE} = {refine}\n{AGENT_YIELD} = {yielding}\n")
    });
    format!("{comment}[target]\npolicy = \"feedback\"\n{gains}{agents}")
}

/// The scene overrides in the fragment at `path`.
///
/// # Errors
/// [`BadInput`] where it cannot be read, or contains more than gains.
pub fn overrides(path: &Path) -> anyhow::Result<Vec<(String, String)>> {
    let bad = |why: String| BadInput(format!("the gains file {} {why}", path.display()));
    let size = std::fs::metadata(path).map_err(|e| bad(format!("cannot be read: {e}")))?.len();
    if size > BYTES_MAX {
        return Err(bad(format!("has {size} bytes; expected at most {BYTES_MAX}")).into());
    }
    let text = std::fs::read_to_string(path).map_err(|e| bad(format!("cannot be read: {e}")))?;
    let table: toml::Table =
        text.parse().map_err(|e: toml::de::Error| bad(format!("is not valid TOML: {}", e.message())))?;
    let target = match (table.len(), table.get("target").and_then(toml::Value::as_table)) {
        (1, Some(target)) => target,
        _ => return Err(bad("must contain the table `[target]` and nothing else".to_owned()).into()),
    };
    if let Some(key) = target.keys().find(|key| !KEYS.contains(&key.as_str()) && *key != MARGIN) {
        return Err(
            bad(format!("contains `{key}`, which is not a gain; expected {}, {MARGIN}", KEYS.join(", "))).into()
        );
    }
    Ok(target.iter().map(|(key, value)| (format!("target.{key}"), value.to_string())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_parsed_by_greek_letter_and_by_name() {
        let read = |text: &str| parse(text, 30.0).unwrap();
        assert_eq!(read("α=1e-3,β=2"), Law::Printed { alpha: 1e-3, beta: 2.0 }.into());
        assert_eq!(read("k=0.06"), Law::Printed { alpha: 0.002, beta: 5.0 }.into());
        assert_eq!(read("kappa=0.25"), Law::Corrected { kappa: 0.25, lead: 0.0, margin: 0.1 }.into());
        assert_eq!(read("law=pi,κ=0.25"), Law::Corrected { kappa: 0.25, lead: 0.2, margin: 0.1 }.into());
        assert_eq!(read("law=adaptive,margin=0.05"), Candidate::Adaptive { margin: 0.05 });
        assert_eq!(read("law=printed"), Law::PRINTED.into());
        assert_eq!(read("law=corrected"), Law::CORRECTED.into());
    }

    #[test]
    fn invalid_gains_are_refused_with_the_expected_form() {
        for bad in [
            "",
            "α",
            "α=x",
            "gamma=1",
            "α=1e-4,κ=0.5",
            "α=0",
            "α=-1e-4",
            "kappa=2",
            "kappa=nan",
            "margin=inf",
            "law=magic",
            "law=adaptive,κ=0.5",
            "k=0",
        ] {
            let error = parse(bad, 30.0).unwrap_err().to_string();
            assert!(error.contains("expected") || error.contains("there are"), "{bad}: {error}");
        }
    }

    #[test]
    fn a_fragment_contains_the_gains_it_was_written_from() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gains.toml");
        let law = Law::Corrected { kappa: 0.375, lead: 0.125, margin: 0.0625 };
        let agents = RateGains { refine: 0.75, yielding: 0.25 };
        std::fs::write(&path, fragment(law, Some(agents), "one\ntwo")).unwrap();
        let over = overrides(&path).unwrap();
        let value = |key: &str| over.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
        assert_eq!(value("target.kappa"), Some("0.375"));
        assert_eq!(value("target.law"), Some("\"corrected\""));
        assert_eq!((value("target.agent_refine"), value("target.agent_yield")), (Some("0.75"), Some("0.25")));
        std::fs::write(&path, "[target]\nframe_hz = 3.0\n").unwrap();
        assert!(overrides(&path).unwrap_err().to_string().contains("frame_hz"));
        std::fs::write(&path, "[[object]]\n").unwrap();
        assert!(overrides(&path).is_err());
    }
}
