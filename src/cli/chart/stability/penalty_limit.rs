//! How stiff a penalty contact from stale states may be, beside the formula k < 0.55 μ/τ².
//!
//! A ball is let fall a centimetre on a spring-mounted one. Contact damping is 0.64 of the critical, where the formula allows
//! the most. The stiffness at which the motion no longer dies away is found by halving.

use super::super::experiment::{Experiment, Finding};
use super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel};
use super::super::stage::Faults;
use super::super::table::Table;
use super::drop::{FALLING_KG, MOUNTED_KG, Pair, law, pair};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct PenaltyLimit;

const LAWS: [&str; 2] = ["penalty", "penalty-extrapolated"];
const RATES_HZ: [f64; 6] = [240.0, 120.0, 60.0, 30.0, 20.0, 10.0];
/// The damping at which most stiffness is allowed, as a share of the critical.
const DAMPING_RATIO: f64 = 0.64;
/// k τ²/μ at the limit there (docs/theory/coupling.md).
const LIMIT: f64 = 0.55;
const FALL_M: f64 = 0.01;
const SECONDS: f64 = 3.0;
/// What of the energy is left from here on must be below this share of the start's.
const LATE_S: f64 = 2.0;
const LEFT: f64 = 0.5;
const STIFFNESS_N_M: [f64; 2] = [1.0, 1e7];
const HALVINGS: u32 = 18;
/// Up to here the age of what the slow body sends decides; above, that of what it gets, and the springs it stands on.
const CLAIMED_HZ: f64 = 60.0;

/// A law and a rate.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Case {
    law: String,
    rate_hz: f64,
    halvings: u32,
}

/// The limit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Row {
    law: String,
    rate_hz: f64,
    halvings: u32,
    /// The stiffest contact that dies away, N/m.
    measured_n_m: f64,
    /// 0.55 μ/τ² with τ = H, a step of the slow body: what it acts on is so old at the end of its step.
    step_old_n_m: f64,
    /// The same with τ = H/2: so old it is on average.
    half_step_old_n_m: f64,
}

impl Experiment for PenaltyLimit {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = "penalty-limit";
    const TITLE: &'static str = "how stiff a penalty contact from stale states may be, beside 0.55 μ/τ²";

    fn cases(quick: bool) -> Vec<Case> {
        let (rates, halvings) = if quick { (&RATES_HZ[2..3], 8) } else { (&RATES_HZ[..], HALVINGS) };
        let of = |law: &'static str| rates.iter().map(move |&rate_hz| Case { law: law.to_owned(), rate_hz, halvings });
        LAWS.into_iter().flat_map(of).collect()
    }

    fn measure(case: &Case) -> Row {
        let [mut low, mut high] = STIFFNESS_N_M.map(libm::log);
        for _ in 0..case.halvings {
            let middle = 0.5 * (low + high);
            if dies_away(case, libm::exp(middle)) { low = middle } else { high = middle }
        }
        let reduced_kg = MOUNTED_KG * FALLING_KG / (MOUNTED_KG + FALLING_KG);
        let limit = |tau_s: f64| LIMIT * reduced_kg / (tau_s * tau_s);
        let Case { law, rate_hz, halvings } = case.clone();
        Row {
            law,
            rate_hz,
            halvings,
            measured_n_m: libm::exp(0.5 * (low + high)),
            step_old_n_m: limit(1.0 / rate_hz),
            half_step_old_n_m: limit(0.5 / rate_hz),
        }
    }

    fn case_of(row: &Row) -> Case {
        Case { law: row.law.clone(), rate_hz: row.rate_hz, halvings: row.halvings }
    }

    fn figure(rows: &[Row]) -> Figure {
        let line = |get: fn(&Row) -> f64| {
            let here = rows.iter().filter(|r| r.law == LAWS[0]).map(|r| (r.rate_hz, get(r)));
            Mark::Dashed(here.collect())
        };
        let mut layers = vec![
            Layer { label: "0.55 μ/τ², τ = H".to_owned(), colour: Colour::Grey, mark: line(|r| r.step_old_n_m) },
            Layer {
                label: "0.55 μ/τ², τ = H/2".to_owned(),
                colour: Colour::Orange,
                mark: line(|r| r.half_step_old_n_m),
            },
        ];
        for (law, colour) in LAWS.into_iter().zip(Colour::LINES) {
            let points = rows.iter().filter(|r| r.law == law).map(|r| (r.rate_hz, r.measured_n_m)).collect();
            layers.push(Layer { label: format!("{law}, measured"), colour, mark: Mark::Line(points) });
        }
        let (x, y) = (Axis::log("rate of the slow body, Hz", 8.0, 300.0), Axis::log("stiffest contact, N/m", 0.5, 1e5));
        let panel = Panel { title: String::new(), x, y, layers };
        Figure { title: "Penalty from stale states is stable below".to_owned(), panels: vec![panel], columns: 1 }
    }

    fn table(rows: &[Row]) -> Table {
        let mut table = Table::new(&["law", "rate_hz", "measured_n_m", "0.55 μ/H²", "0.55 μ/(H/2)²"]);
        table.rows.extend(rows.iter().map(|r| {
            let numbers = [r.measured_n_m, r.step_old_n_m, r.half_step_old_n_m].map(|k| (k, 2).into());
            [vec![r.law.clone().into(), (r.rate_hz, 0).into()], numbers.to_vec()].concat()
        }));
        table
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let naive = || rows.iter().filter(|r| r.law == LAWS[0] && r.rate_hz <= CLAIMED_HZ);
        let factor = |r: &Row| (r.measured_n_m / r.half_step_old_n_m).max(r.half_step_old_n_m / r.measured_n_m);
        let apart = naive().map(factor).fold(0.0, f64::max);
        vec![Finding::at_most(
            "penalty at 60 Hz and less: measured limit and 0.55 μ/τ², τ = H/2, apart by a factor",
            apart,
            4.0,
        )]
    }
}

/// Whether the motion dies away at this stiffness.
fn dies_away(case: &Case, stiffness_n_m: f64) -> bool {
    let law = law(&case.law, stiffness_n_m, DAMPING_RATIO);
    let set = pair("1d", law, case.rate_hz, (Faults { seed: 1, ..Faults::default() }, FALL_M));
    let Some(Pair { play, zero_j, .. }) = set else { return false };
    let start_j = play.raw_j() - zero_j;
    // where springs and contact have given under the weight there is less energy than none: what is left is kinetic
    let mut calm = true;
    let ended = play.run(SECONDS, |play, _| {
        let left = (play.raw_j() - zero_j) / start_j;
        calm = calm && left < 10.0 && (play.time().as_secs_f64() < LATE_S || left < LEFT);
        calm
    });
    calm && ended.time().as_secs_f64() >= SECONDS - 0.2
}
