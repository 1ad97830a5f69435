//! The cost of a step of a tube folded on itself by its contacts, free and held by a tool.

use super::growth::{Case, Cost, Growth, Row, pace};
use super::tubes::{TUBE, folded, grasp, on_ground};
use crate::chart::{Finding, claims, floor_us, least_us, number_of};
use std::time::Duration;

/// The experiment.
pub(in super::super) struct Contacts;

const FREE: &str = "free, steps of 4 ms";
const HELD: &str = "held by a tool, steps of 1 ms";
const DT_S: f64 = 4e-3;
const HELD_DT_S: f64 = 1e-3;
/// How long each case is measured, and steps of 4 ms until the tube rests on itself.
const SPAN: Duration = Duration::from_millis(500);
const FALLS: u32 = 1500;
/// Steps in the tool's grasp before the measurement.
const HOLDS: u32 = 200;

impl Growth for Contacts {
    const NAME: &'static str = "contacts";
    const TITLE: &'static str = "Cost of a folded tube's step, by number of contacts";
    const COUNTED: &'static str = "contacts";
    const COST: &'static str = "CPU µs per step";
    const FLOOR: &'static str = "one pass over the same memory";

    /// Sizes are segments, 14 per strand.
    fn cases(quick: bool) -> Vec<Case> {
        let sizes: &[u32] = if quick { &[28, 100] } else { &[28, 56, 100, 200, 400, 800] };
        Case::of([FREE, HELD], sizes)
    }

    fn measure(case: &Case) -> Option<Cost> {
        let tube = folded(case.size)?;
        let (bytes, length_m) = (tube.memory_bytes(), tube.length_m());
        let mut stage = on_ground(tube, DT_S)?;
        for _ in 0..FALLS {
            stage.step().ok()?;
        }
        if case.case == HELD {
            grasp(&mut stage, length_m)?;
            stage.member(TUBE).step_s = HELD_DT_S;
            for _ in 0..HOLDS {
                stage.step().ok()?;
            }
        }
        let us = least_us(SPAN, || stage.step().ok())?;
        let floor_us = floor_us(bytes, SPAN / 10)?;
        Some(Cost { count: f64::from(stage.report().contacts), us, floor_us })
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let us = |case: &str, size: u32| {
            pace(rows) * number_of(rows, |row| row.case.case == case && row.case.size == size, |row| row.point().1)
        };
        let mut list =
            claims!["100 segments in self-contact: µs per step of 4 ms by calibration" => us(FREE, 100), at_most 300.0];
        if rows.iter().any(|row| row.case.size == 400) {
            list.extend(claims![
                "400 segments in self-contact and in a grasp: µs per step of 1 ms by calibration" => us(HELD, 400), at_most 5000.0;
            ]);
        }
        list
    }
}
