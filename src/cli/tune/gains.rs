//! Gains in words: as they are typed after `--analyse`, and as the TOML fragment that `run --gains` and a scene take.
//!
//! In: text. Out: a law with its gains, or overrides of a scene. Never here: which gains are good.

use super::super::output::BadInput;
use crate::control::Law;
use anyhow::Context;
use std::path::Path;

/// The keys of `[target]` that a fragment may have.
const KEYS: [&str; 6] = ["policy", "law", "alpha", "beta", "kappa", "lead"];
const MARGIN: &str = "margin";
/// Longest fragment, bytes.
const BYTES_MAX: u64 = 1 << 16;

/// The law that `α=1e-4,β=5` or `kappa=0.5,margin=0.1` means; what is not said is the law's own.
pub(super) fn parsed(text: &str) -> anyhow::Result<Law> {
    let mut given = Vec::new();
    for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let (name, value) = part.split_once('=').ok_or_else(|| refused(text, "each gain is NAME=NUMBER"))?;
        let value: f64 = value.trim().parse().map_err(|_| refused(text, "each gain is NAME=NUMBER"))?;
        given.push((canonical(name.trim()).ok_or_else(|| unknown(name.trim()))?, value));
    }
    let value = |name: &str| given.iter().rev().find(|(n, _)| *n == name).map(|(_, v)| *v);
    let has = |names: &[&str]| given.iter().any(|(n, _)| names.contains(n));
    match (has(&["alpha", "beta"]), has(&["kappa", "lead", MARGIN])) {
        (true, true) => {
            Err(refused(text, "α and β are of the printed law, κ, λ and margin of the corrected one: give one law's"))
        }
        (false, false) => Err(refused(text, "no gain is given")),
        (true, false) => {
            let Law::Printed { alpha, beta } = Law::PRINTED else { return Err(refused(text, "")) };
            let (alpha, beta) = (value("alpha").unwrap_or(alpha), value("beta").unwrap_or(beta));
            inside("α", alpha, (1e-9, 1.0))?;
            inside("β", beta, (1e-6, 1e3))?;
            Ok(Law::Printed { alpha, beta })
        }
        (false, true) => {
            let Law::Corrected { kappa, lead, margin } = Law::CORRECTED else { return Err(refused(text, "")) };
            let of = |name, own| value(name).unwrap_or(own);
            let (kappa, lead, margin) = (of("kappa", kappa), of("lead", lead), of(MARGIN, margin));
            inside("κ", kappa, (1e-3, 0.999))?;
            inside("λ", lead, (0.0, 0.99))?;
            inside(MARGIN, margin, (0.0, 0.9))?;
            Ok(Law::Corrected { kappa, lead, margin })
        }
    }
}

fn canonical(name: &str) -> Option<&'static str> {
    match name {
        "α" | "alpha" => Some("alpha"),
        "β" | "beta" => Some("beta"),
        "κ" | "kappa" => Some("kappa"),
        "λ" | "lead" => Some("lead"),
        "margin" => Some(MARGIN),
        _ => None,
    }
}

fn inside(name: &str, value: f64, (low, high): (f64, f64)) -> anyhow::Result<()> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(BadInput(format!("the gain {name} = {value} is none: expected {low} to {high}")).into())
}

fn unknown(name: &str) -> anyhow::Error {
    BadInput(format!("there is no gain `{name}` (there are: α or alpha, β or beta, κ or kappa, λ or lead, margin)"))
        .into()
}

fn refused(text: &str, why: &str) -> anyhow::Error {
    BadInput(format!("`{text}` gives no gains: {why}; expected such as α=1e-4,β=5 or kappa=0.5,margin=0.1")).into()
}

/// The law in one line.
pub(super) fn told(law: Law) -> String {
    match law {
        Law::Printed { alpha, beta } => format!("α = {alpha:.3e}, β = {beta:.3}"),
        Law::Corrected { kappa, lead: 0.0, margin } => format!("κ = {kappa:.3}, margin = {margin:.3}"),
        Law::Corrected { kappa, lead, margin } => format!("κ = {kappa:.3}, λ = {lead:.3}, margin = {margin:.3}"),
    }
}

/// The fragment of a scene that asks for `law`, with `comment` above it.
pub(super) fn fragment(law: Law, comment: &str) -> String {
    let comment: String = comment.lines().map(|line| format!("# {line}\n")).collect();
    let gains = match law {
        Law::Printed { alpha, beta } => format!("law = \"printed\"\nalpha = {alpha:e}\nbeta = {beta:e}\n"),
        Law::Corrected { kappa, lead, margin } => {
            format!("law = \"corrected\"\nkappa = {kappa}\nlead = {lead}\nmargin = {margin}\n")
        }
    };
    format!("{comment}[target]\npolicy = \"feedback\"\n{gains}")
}

/// The overrides of a scene that the fragment in `path` means.
///
/// # Errors
/// [`BadInput`] where it cannot be read, or says more than gains.
pub(in crate::cli) fn overrides(path: &Path) -> anyhow::Result<Vec<(String, String)>> {
    let bad = |why: String| BadInput(format!("the gains {}: {why}", path.display()));
    let size = std::fs::metadata(path).map_err(|e| bad(format!("cannot be read: {e}")))?.len();
    if size > BYTES_MAX {
        return Err(bad(format!("has {size} bytes, a fragment at most {BYTES_MAX}")).into());
    }
    let text = std::fs::read_to_string(path).map_err(|e| bad(format!("cannot be read: {e}")))?;
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| bad(format!("is no TOML: {}", e.message())))?;
    let target = match (table.len(), table.get("target").and_then(toml::Value::as_table)) {
        (1, Some(target)) => target,
        _ => return Err(bad("expected the table `[target]` and nothing else".to_owned()).into()),
    };
    if let Some(key) = target.keys().find(|key| !KEYS.contains(&key.as_str()) && *key != MARGIN) {
        return Err(bad(format!("`{key}` is no gain; expected {}, {MARGIN}", KEYS.join(", "))).into());
    }
    Ok(target.iter().map(|(key, value)| (format!("target.{key}"), value.to_string())).collect())
}

/// Writes the fragment; what is there is overwritten with `force` alone.
pub(super) fn write(path: &Path, fragment: &str) -> anyhow::Result<()> {
    std::fs::write(path, fragment).with_context(|| format!("the gains {} cannot be written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_read_by_greek_and_by_name() {
        assert_eq!(parsed("α=1e-3,β=2").unwrap(), Law::Printed { alpha: 1e-3, beta: 2.0 });
        assert_eq!(parsed("kappa=0.25").unwrap(), Law::Corrected { kappa: 0.25, lead: 0.0, margin: 0.1 });
    }

    #[test]
    fn gains_that_are_none_are_refused_with_what_is_expected() {
        for bad in ["", "α", "α=x", "gamma=1", "α=1e-4,κ=0.5", "α=0", "α=-1e-4", "kappa=1", "kappa=nan", "margin=inf"]
        {
            let error = parsed(bad).unwrap_err().to_string();
            assert!(error.contains("expected") || error.contains("there are"), "{bad}: {error}");
        }
    }

    #[test]
    fn a_fragment_means_the_gains_it_was_made_of() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gains.toml");
        let law = Law::Corrected { kappa: 0.375, lead: 0.125, margin: 0.0625 };
        write(&path, &fragment(law, "one\ntwo")).unwrap();
        let over = overrides(&path).unwrap();
        let value = |key: &str| over.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
        assert_eq!(value("target.kappa"), Some("0.375"));
        assert_eq!(value("target.law"), Some("\"corrected\""));
        std::fs::write(&path, "[target]\nframe_hz = 3.0\n").unwrap();
        assert!(overrides(&path).unwrap_err().to_string().contains("frame_hz"));
        std::fs::write(&path, "[[object]]\n").unwrap();
        assert!(overrides(&path).is_err());
    }
}
