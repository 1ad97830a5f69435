//! The gains that were found, held against the scene's own frames: what was predicted of a push, and what came of it.
//!
//! In: a plant and what was found on it. Out: settling times, predicted and measured. Never here: a judgement of them.

use super::super::args::TuneArgs;
use super::super::progress::Bar;
use super::{Identified, Tuned, live};
use crate::frame::{Drawing, Pushes, Session, push};
use crate::tune::{Contender, Measures, Start, Trial, play, settled_after};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};

/// Parts of the wanted rate at which frames come after a push.
const RATES: [f64; 2] = [0.4, 2.5];
/// How often a push is made where frames scatter.
const TIMES_LIVE: usize = 7;

/// One push.
pub(super) struct Checked {
    rate: f64,
    predicted_s: Option<f64>,
    measured_s: Option<f64>,
}

impl Checked {
    /// A line for people.
    pub fn told(&self) -> String {
        let told = |settle: Option<f64>| settle.map_or_else(|| "never".to_owned(), |s| format!("{s:.2} s"));
        format!(
            "on its own frames it settles from {} of the rate in {}; predicted was {}\n",
            self.rate,
            told(self.measured_s),
            told(self.predicted_s)
        )
    }

    /// The same for programs.
    pub fn json(&self) -> Value {
        json!({ "rate": self.rate, "predicted_s": self.predicted_s, "measured_s": self.measured_s })
    }
}

/// Pushes the scene from its target on the machine on which the plant was found; nothing where that leaves nothing to control, or where
/// it was stopped.
pub(super) fn check(
    args: &TuneArgs,
    on: &Identified,
    tuned: &Tuned,
    stopped: &AtomicBool,
) -> anyhow::Result<Vec<Checked>> {
    if tuned.verdict().is_none_or(|v| v.at_speed != 1.0) {
        return Ok(Vec::new());
    }
    let set_s = tuned.best.set_share() / on.target_hz;
    let pushes = Pushes {
        law: tuned.best,
        polygons: RATES.iter().map(|rate| on.plant.line.x_of(set_s / rate).max(1.0)).collect(),
        times: if on.live { TIMES_LIVE } else { 1 },
        size: on.size,
        drawing: if on.live { live(on.size)? } else { Drawing::Nothing },
    };
    let bar = Bar::new("its own frames", args.quiet || args.json);
    let runs = push(Session::open(on.scene.clone())?, pushes, &mut |share| {
        bar.tell(share, "pushed away from its target".to_owned());
        !stopped.load(Ordering::Relaxed)
    })?;
    let of = |(rate, frames): (&f64, &Vec<(f64, f64)>)| {
        let rows: Vec<_> = frames.iter().map(|(time_s, work_s)| (*time_s, work_s / set_s)).collect();
        Checked {
            rate: *rate,
            predicted_s: predicted_s(on, tuned.best.into(), *rate),
            measured_s: settled_after(&rows, |_| false),
        }
    };
    Ok(RATES.iter().zip(&runs).map(of).collect())
}

fn predicted_s(on: &Identified, contender: Contender, rate: f64) -> Option<f64> {
    let trial = Trial { start: Start::Rate(rate), seconds: 2.0, ..Trial::calm(contender, on.target_hz) };
    Measures::of(&play(&on.plant, &trial)).settle_s
}
