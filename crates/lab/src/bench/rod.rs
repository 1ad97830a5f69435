//! `bench rod`: the cost of a tube's step, by number of segments, with and without the search for self-contact.
//!
//! In: numbers of segments. Out: rows of CPU time per step. Never here: agents, threads.

use super::super::args::BenchArgs;
use super::rig::bare::step;
use super::rig::cast::{ROD_SEGMENTS, rod};
use super::rig::machine::own_cpu;
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Table, exponent, table};
use glam::DVec3;
use metachron_contact::step::LoneStepper;
use metachron_core::SimSpan;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The subject.
pub(super) struct Rod;

const SEGMENTS: [usize; 6] = [16, 32, ROD_SEGMENTS, 128, 256, 512];

/// CPU time of each case, in full and with `--quick`, seconds.
const SPANS_S: [f64; 2] = [2.0, 0.3];

/// The length of a step: 198 Hz.
const DT: SimSpan = SimSpan::from_nanos(1_000_000_000 / 198);

/// Steps between two readings of the clock.
const BATCH: u32 = 20;

/// The cost of one tube's steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    pub segments: usize,
    pub self_contact: bool,
    pub us_per_step: f64,
    pub ns_per_segment: f64,
    pub steps_per_s: f64,
}

impl Subject for Rod {
    type Row = Row;
    const NAME: &'static str = "rod";
    const TABLE: fn(&[Row]) -> Table = table!(|r| segments: r.segments, self_contact: r.self_contact,
        us_per_step(2): r.us_per_step, ns_per_segment: r.ns_per_segment, steps_per_s: r.steps_per_s);

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let span = Duration::from_secs_f64(args.seconds.unwrap_or(SPANS_S[usize::from(args.quick)]));
        let cases = [false, true].into_iter().flat_map(|contact| SEGMENTS.map(|segments| (segments, contact)));
        let words = |(segments, _): &(usize, bool)| format!("{segments} segments");
        progress.rows(cases.collect(), words, |(segments, contact)| measure(segments, contact, span))
    }

    fn figure(rows: &[Row]) -> Figure {
        let points = |contact| -> Vec<(f64, f64)> {
            let here = rows.iter().filter(|row| row.self_contact == contact);
            here.map(|row| (row.segments as f64, row.us_per_step)).collect()
        };
        let lines =
            [("without self-contact", false), ("with self-contact search", true)].into_iter().zip(Colour::LINES);
        let layers = lines.map(|((label, contact), colour)| {
            let points = points(contact);
            let label = format!("{label}: segments^{:.2}", exponent(&points).unwrap_or(f64::NAN));
            Layer::line(label, colour, points)
        });
        Figure::single(
            "Cost of a tube's step",
            Axis::log_fit("segments"),
            Axis::log_fit("CPU time per step, µs"),
            layers,
        )
    }
}

fn measure(segments: usize, self_contact: bool, span: Duration) -> anyhow::Result<Row> {
    let mut tube = rod(DVec3::ZERO, segments, self_contact)?;
    let mut stepper = LoneStepper::default();
    // fills caches and sizes buffers
    (0..BATCH).try_for_each(|_| step(&mut tube, &mut stepper, DT))?;
    let (from, mut steps) = (own_cpu(), 0_u32);
    while own_cpu() - from < span {
        (0..BATCH).try_for_each(|_| step(&mut tube, &mut stepper, DT))?;
        steps += BATCH;
    }
    let step_s = (own_cpu() - from).as_secs_f64() / f64::from(steps.max(1));
    let ns_per_segment = step_s * 1e9 / segments as f64;
    Ok(Row { segments, self_contact, us_per_step: step_s * 1e6, ns_per_segment, steps_per_s: step_s.recip() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_segments_take_more_and_every_row_is_a_number() {
        let [few, many] = [16, 512].map(|segments| measure(segments, false, Duration::from_millis(20)).unwrap());
        assert!(many.us_per_step > few.us_per_step && few.steps_per_s > 0.0 && few.ns_per_segment > 0.0);
    }
}
