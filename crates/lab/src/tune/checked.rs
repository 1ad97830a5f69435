//! Checks the gains found on the scene's own frames: settling after a push, predicted and measured.
//!
//! In: a plant and the gains found on it. Out: settling times, predicted and measured. Never here: a judgement of them.

use super::super::args::TuneArgs;
use super::{Identified, live};
use metachron_console::progress::Bar;
use metachron_lod::control::Law;
use metachron_lod::tune::{Start, Trial, Tuning, play, settled_after};
use metachron_session::{After, Drawing, Pushes, Session, median, push};
use metachron_world::Pace;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};

/// Frame rates after a push, as parts of the target rate.
const RATES: [f64; 2] = [0.4, 2.5];
/// Number of pushes where frames scatter: by 7 % there, so that the median of so many scatters by 1.8 %, a third of the band.
const TIMES_LIVE: usize = 25;
/// Duration of the observation in predicted settling times, and its bounds in seconds.
const WATCH: f64 = 4.0;
const WATCH_S: (f64, f64) = (1.0, 2.0);

/// One push.
pub(super) struct Checked {
    rate: f64,
    predicted_s: Option<f64>,
    measured_s: Option<f64>,
}

impl Checked {
    /// A line of text.
    pub fn text(&self) -> String {
        let text = |settle: Option<f64>| settle.map_or_else(|| "never".to_owned(), |s| format!("{s:.2} s"));
        format!(
            "on measured frames the loop settles from {} of the rate in {}; predicted: {}\n",
            self.rate,
            text(self.measured_s),
            text(self.predicted_s)
        )
    }

    /// The same as JSON.
    pub fn json(&self) -> Value {
        json!({ "rate": self.rate, "predicted_s": self.predicted_s, "measured_s": self.measured_s })
    }
}

/// Pushes the scene from its target on the machine on which the plant was identified; empty where that machine leaves nothing to control,
/// or where it was stopped.
pub(super) fn check(
    args: &TuneArgs,
    on: &Identified,
    tuned: &Tuning,
    stopped: &AtomicBool,
) -> anyhow::Result<Vec<Checked>> {
    if tuned.best.at_speed != 1.0 {
        return Ok(Vec::new());
    }
    let set_s = tuned.law.set_share() / on.target_hz;
    let times = if on.live { TIMES_LIVE } else { 1 };
    let predicted_s = RATES.map(|rate| predicted_s(on, tuned.law, rate, times));
    let slowest_s = predicted_s.iter().flatten().fold(0.0_f64, |most, s| most.max(*s));
    let pushes = Pushes {
        law: tuned.law,
        polygons: RATES.iter().map(|rate| on.plant.line.x_of(set_s / rate).max(1.0)).collect(),
        times,
        watch_s: if on.live { (WATCH * slowest_s).clamp(WATCH_S.0, WATCH_S.1) } else { WATCH_S.1 },
        size: on.size,
        drawing: if on.live { live(on.size)? } else { Drawing::Nothing },
    };
    let bar = Bar::new("measured frames", args.common.quiet || args.common.json);
    let runs = push(Session::open(on.scene.clone(), Pace::RealTime)?, pushes, &mut |share| {
        bar.set(share, "step response".to_owned());
        !stopped.load(Ordering::Relaxed)
    })?;
    let measured = runs.iter().map(|frames| settled_s(frames, set_s));
    Ok(RATES
        .into_iter()
        .zip(predicted_s)
        .zip(measured)
        .map(|((rate, predicted_s), measured_s)| Checked { rate, predicted_s, measured_s })
        .collect())
}

/// Settling time of the fitted plant after the same pushes: as many of them, with its scatter, and by the same median.
fn predicted_s(on: &Identified, law: Law, rate: f64, times: usize) -> Option<f64> {
    let noise = if on.live { on.plant.line.scatter } else { 0.0 };
    let trial = Trial { start: Start::Rate(rate), seconds: WATCH_S.1, noise, ..Trial::undisturbed(law, on.target_hz) };
    let played = |seed| -> Vec<After> {
        let beats = play(&on.plant, &Trial { seed, ..trial });
        beats.iter().map(|beat| (beat.time_s, beat.part / on.target_hz)).collect()
    };
    let runs: Vec<_> = (0..times as u64).map(played).collect();
    settled_s(&median(&runs), law.set_share() / on.target_hz)
}

/// Seconds after which frames stay within ± 5 % of their target time.
fn settled_s(frames: &[After], set_s: f64) -> Option<f64> {
    let rows: Vec<_> = frames.iter().map(|(time_s, work_s)| (*time_s, work_s / set_s)).collect();
    settled_after(&rows, |_| false)
}
