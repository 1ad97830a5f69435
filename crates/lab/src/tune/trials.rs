//! The file of a search: the verdict on every candidate so far, so that a search that was ended goes on from where it was.
//!
//! In: what is searched on, verdicts. Out: verdicts that the same search has reached before. The file stands beside the gains while the search
//! lasts. Never here: how a candidate is judged, which is tried next.

use super::super::chart::build;
use super::{Identified, extent};
use crate::args::TuneArgs;
use anyhow::Context;
use metachron_console::output::message;
use metachron_lod::control::Law;
use metachron_lod::tune::{Candidate, Margins, Verdict};
use metachron_world::OutputFile;
use std::fs::{self, File, OpenOptions};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The file while the search lasts.
pub(super) struct Trials {
    path: PathBuf,
    file: File,
    known: Vec<Verdict>,
    failed: io::Result<()>,
}

impl Trials {
    /// Opens the file beside `gains` and reads what a search of the same plant, target and extent left there.
    ///
    /// # Errors
    /// A file that cannot be written, or one of something else that cannot be renamed.
    pub(super) fn open(args: &TuneArgs, on: &Identified, gains: &Path) -> anyhow::Result<Self> {
        let path = gains.with_extension("trials");
        let of = identity(args, on);
        let text = fs::read(&path).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let same = text.lines().next() == Some(&of);
        let known: Vec<Verdict> = if same { text.lines().skip(1).filter_map(read).collect() } else { Vec::new() };
        if same {
            message(&format!("going on after the {} trials in {}", known.len(), path.display()));
        } else if !text.is_empty() {
            let (why, kept) = ("is no search of this scene with these settings", path.with_extension("trials.old"));
            fs::rename(&path, &kept).with_context(|| format!("{} cannot be renamed", path.display()))?;
            message(&format!("note: {} {why}: it is now {}, the search begins anew", path.display(), kept.display()));
        }
        let open = || -> anyhow::Result<File> {
            OutputFile::write(&path, format!("{of}\n{}", known.iter().map(line).collect::<String>()))?;
            Ok(OpenOptions::new().append(true).open(&path)?)
        };
        let file = open().with_context(|| format!("{} cannot be written", path.display()))?;
        Ok(Self { path, file, known, failed: Ok(()) })
    }

    /// The verdict on a candidate: the known one, or that of `judge`, which is on file when this returns.
    pub(super) fn verdict(&mut self, candidate: Candidate, judge: impl FnOnce() -> Verdict) -> Verdict {
        if let Some(known) = self.known.iter().find(|verdict| verdict.candidate == candidate) {
            return known.clone();
        }
        let verdict = judge();
        if self.failed.is_ok() {
            self.failed = self.file.write_all(line(&verdict).as_bytes());
        }
        verdict
    }

    /// Removes the file of a search that came to its end; that of another one stays.
    ///
    /// # Errors
    /// A verdict that could not be written, a file that cannot be removed.
    pub(super) fn close(self, ended: bool) -> anyhow::Result<()> {
        let removed = self.failed.and_then(|()| if ended { fs::remove_file(&self.path) } else { Ok(()) });
        removed.with_context(|| format!("{} cannot be written", self.path.display()))
    }
}

/// Ends a line: one that was cut off is no verdict.
const END: &str = ";";

/// A verdict as a line of numbers, each with the digits that tell it from every other.
fn line(verdict: &Verdict) -> String {
    let law = match verdict.candidate {
        Candidate::Feedback(Law::Printed { alpha, beta }) => [0.0, alpha, beta, 0.0],
        Candidate::Feedback(Law::Corrected { kappa, lead, margin }) => [1.0, kappa, lead, margin],
        Candidate::Adaptive { margin } => [2.0, margin, 0.0, 0.0],
    };
    let margins = verdict.margins.map_or([f64::NAN; 2], |margins| [margins.gain, margins.delay as f64]);
    let v = verdict;
    let own = [v.settle_s.unwrap_or(f64::NAN), v.overshoot, v.miss_share, v.reversals, v.quality];
    let rest = [v.at_speed, v.shortfall, v.objective, v.asked.len() as f64];
    let numbers = [&law[..], &own, &margins, &rest, &v.asked, &v.robust_to].concat();
    numbers.iter().map(|number| format!("{number:?} ")).collect::<String>() + END + "\n"
}

/// The verdict of a line; `None` of one that is not whole.
fn read(line: &str) -> Option<Verdict> {
    let numbers = line.strip_suffix(END)?.split_whitespace().map(str::parse);
    let numbers = numbers.collect::<Result<Vec<f64>, _>>().ok()?;
    let (&[law, a, b, c, settle_s, overshoot, miss_share, reversals, quality], rest) = numbers.split_first_chunk()?;
    let (&[gain, delay, at_speed, shortfall, objective, asked], speeds) = rest.split_first_chunk()?;
    let (asked, robust_to) = speeds.split_at_checked(asked as usize)?;
    let candidate = match law as u8 {
        0 => Law::Printed { alpha: a, beta: b }.into(),
        1 => Law::Corrected { kappa: a, lead: b, margin: c }.into(),
        _ => Candidate::Adaptive { margin: a },
    };
    let (asked, robust_to) = (asked.to_vec(), robust_to.to_vec());
    let settle_s = Some(settle_s).filter(|s| !s.is_nan());
    let margins = Some(Margins { gain, delay: delay as usize }).filter(|_| !delay.is_nan());
    Some(Verdict {
        candidate,
        settle_s,
        overshoot,
        miss_share,
        reversals,
        quality,
        margins,
        robust_to,
        asked,
        at_speed,
        shortfall,
        objective,
    })
}

/// The search that verdicts are of, in one line: the plant with all that it was identified on, the target, the extent of a trial, the program.
fn identity(args: &TuneArgs, on: &Identified) -> String {
    let mut plant = DefaultHasher::new();
    format!("{:?}", on.plant).hash(&mut plant);
    let (scene, hz, extent) = (&on.scene.name, on.target_hz, extent(args));
    format!("{scene} at {hz} Hz, {extent:?}, plant {:016x}, {}", plant.finish(), build())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_is_read_as_it_was_written_to_the_bit() {
        let third = 1.0 / 3.0;
        let whole = Verdict {
            candidate: Candidate::Adaptive { margin: 0.1 + 0.2 },
            settle_s: Some(third),
            overshoot: 5e-324,
            miss_share: third.sqrt(),
            reversals: 0.0,
            quality: 1.0,
            margins: Some(Margins { gain: f64::INFINITY, delay: 12 }),
            robust_to: vec![0.5],
            asked: vec![0.25, 0.5, 1.0],
            at_speed: 1.0,
            shortfall: 0.0,
            objective: 1e300,
        };
        let bare = Verdict {
            candidate: Law::CORRECTED.into(),
            settle_s: None,
            margins: None,
            robust_to: Vec::new(),
            asked: Vec::new(),
            ..whole.clone()
        };
        for verdict in [whole, bare] {
            let line = line(&verdict);
            let line = line.trim_end();
            assert_eq!(read(line), Some(verdict), "{line}");
            assert!((0..line.len()).all(|k| read(&line[..k]).is_none()), "a line that was cut off");
        }
    }
}
