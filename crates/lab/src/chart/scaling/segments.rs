//! The cost of a step of a tube by its segments: alone, searching for self-contact, and also held by a tool.

use super::super::accuracy::peers;
use super::growth::{Case, Cost, Growth, Row, pace, power};
use super::tubes::{grasp, hanging, straight};
use crate::chart::{Finding, claims, floor_us, least_us, worst_of};
use std::ops::RangeInclusive;
use std::time::Duration;

/// The experiment.
pub(in super::super) struct Segments;

const ALONE: &str = "alone";
const WARY: &str = "may touch itself";
const HELD: &str = "held by a tool";
/// Claims for the whole step at numbers of segments in the range [`CLAIMED`].
const CLAIMED_NS: f64 = 160.0;
const CLAIMED_POWER: f64 = 1.05;
const CLAIMED: RangeInclusive<f64> = 100.0..=4000.0;
/// How long each case is measured.
const SPAN: Duration = Duration::from_millis(200);
/// Steps before the measurement, so that all tubes hang alike: they come to rest in the first half of these.
const WARM: u32 = 500;
const DT_S: f64 = 0.01;

impl Growth for Segments {
    const NAME: &'static str = "segments";
    const TITLE: &'static str = "Cost of a tube's step, by number of segments";
    const COUNTED: &'static str = "segments";
    const COST: &'static str = "CPU µs per step";
    const FLOOR: &'static str = "one pass over the same memory";

    fn cases(quick: bool) -> Vec<Case> {
        let sizes: &[u32] = if quick {
            &[8, 32, 100, 400]
        } else {
            &[8, 16, 32, 64, 100, 128, 256, 400, 512, 1000, 1024, 2048, 4000, 4096]
        };
        Case::of([ALONE, WARY, HELD], sizes)
    }

    fn measure(case: &Case) -> Option<Cost> {
        let tube = straight(case.size, case.case != ALONE)?;
        let (bytes, length_m) = (tube.memory_bytes(), tube.length_m());
        let mut stage = hanging(tube, DT_S)?;
        if case.case == HELD {
            grasp(&mut stage, length_m)?;
        }
        for _ in 0..WARM {
            stage.step().ok()?;
        }
        let us = least_us(SPAN, || stage.step().ok())?;
        let floor_us = floor_us(bytes, SPAN / 10)?;
        Some(Cost { count: f64::from(case.size), us, floor_us })
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let inside = |row: &Row| row.case.case == ALONE && CLAIMED.contains(&f64::from(row.case.size));
        let slowest = pace(rows) * worst_of(rows, inside, |row| row.ns_each());
        let (from, to) = (CLAIMED.start(), CLAIMED.end());
        claims![
            "ns per segment and step by calibration, {from} … {to} segments, alone" => slowest, at_most CLAIMED_NS;
            "exponent, {from} … {to} segments, alone" => power(rows, ALONE, CLAIMED), at_most CLAIMED_POWER;
        ]
    }

    fn peers() -> Vec<(String, f64, f64)> {
        let soft = peers::of("cantilever").into_iter().filter(|peer| peer.case == "soft");
        soft.map(|peer| (peer.peer.clone(), peer.segments, peer.us_per_step())).collect()
    }
}
