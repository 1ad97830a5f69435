//! The greatest stiffness of a penalty contact from stale states, compared with the formula k < 0.55 μ/τ².
//!
//! A ball falls a centimetre onto a spring-mounted one. Contact damping is 0.64 of critical, where the formula allows the most.
//! A state becomes visible when its time has come: the slow body's is H/2 old on average when it is used, and the force that the
//! slow body computes from a fresh one is held for H, which is as old. (Where steps cost nothing, the state of the end of a step is
//! visible at its beginning; that is early by as much, and at 240 Hz unstable from a ninth of the formula on.) Bisection finds the
//! stiffness at which the motion no longer decays. A linear model of both clocks, sampled in the same way, has 0.67 of the
//! formula at 240 to 60 Hz; at lower rates the springs of the mounted body take part.

use super::drop::{FALLING_KG, MOUNTED_KG, Pair, law, pair};
use crate::chart::asynchronous::bench::Faults;
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Table, claims, each, table, worst_of};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct PenaltyLimit;

const LAWS: [&str; 2] = ["penalty", "penalty-extrapolated"];
const RATES_HZ: [f64; 6] = [240.0, 120.0, 60.0, 30.0, 20.0, 10.0];
/// The damping ratio at which the formula allows the greatest stiffness.
const DAMPING_RATIO: f64 = 0.64;
/// k τ²/μ at the limit there (docs/theory/coupling.md).
const LIMIT: f64 = 0.55;
const FALL_M: f64 = 0.01;
const SECONDS: f64 = 3.0;
/// From this time on the remaining energy must be below this share of the start's.
const LATE_S: f64 = 2.0;
const LEFT: f64 = 0.5;
const STIFFNESS_N_M: [f64; 2] = [1.0, 1e7];
const HALVINGS: u32 = 18;
/// The measured limit and the formula must differ by less than this factor.
const APART_MAX: f64 = 2.0;

/// A law and a rate.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    law: &'static str,
    rate_hz: f64,
    halvings: u32,
}

/// The result of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// The greatest stiffness at which the motion decays, N/m.
    measured_n_m: f64,
    /// 0.55 μ/τ² with τ = H/2, half a step of the slow body.
    theory_n_m: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for PenaltyLimit {
    type Row = Row;
    const NAME: &'static str = "penalty-limit";
    const TITLE: &'static str = "stability limit of penalty contact from stale states, compared with 0.55 μ/τ²";
    const TABLE: fn(&[Row]) -> Table = table!(|r| law: r.case.law, rate_hz: r.case.rate_hz,
        measured_n_m(2): r.measured_n_m, "0.55 μ/τ²"(2): r.theory_n_m,
        "measured / formula"(2): r.measured_n_m / r.theory_n_m);

    fn cases(quick: bool) -> Vec<Case> {
        let (rates_hz, halvings) = if quick { (&RATES_HZ[2..3], 8) } else { (&RATES_HZ[..], HALVINGS) };
        each!(law in LAWS, &rate_hz in rates_hz => Case { law, rate_hz, halvings })
    }

    fn measure(case: &Case) -> Option<Found> {
        let [mut low, mut high] = STIFFNESS_N_M.map(libm::log);
        for _ in 0..case.halvings {
            let middle = 0.5 * (low + high);
            if decays(case, libm::exp(middle)) { low = middle } else { high = middle }
        }
        let reduced_kg = MOUNTED_KG * FALLING_KG / (MOUNTED_KG + FALLING_KG);
        let tau_s = 0.5 / case.rate_hz;
        Some(Found { measured_n_m: libm::exp(0.5 * (low + high)), theory_n_m: LIMIT * reduced_kg / (tau_s * tau_s) })
    }

    fn figure(rows: &[Row]) -> Figure {
        let theory = rows.iter().filter(|r| r.case.law == LAWS[0]).map(|r| (r.case.rate_hz, r.theory_n_m));
        let mut layers = vec![Layer::dashed("0.55 μ/τ², τ = H/2", Colour::Grey, theory)];
        for (law, colour) in LAWS.into_iter().zip(Colour::LINES) {
            let points = rows.iter().filter(|r| r.case.law == law).map(|r| (r.case.rate_hz, r.measured_n_m));
            layers.push(Layer::line(format!("{law}, measured"), colour, points));
        }
        let (x, y) = (Axis::log("rate of the slow body, Hz", 8.0, 300.0), Axis::log("stiffest contact, N/m", 0.5, 1e5));
        Figure::single("Stability limit of penalty contact from stale states", x, y, layers)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let factor = |r: &Row| (r.measured_n_m / r.theory_n_m).max(r.theory_n_m / r.measured_n_m);
        claims!["measured limit over 0.55 μ/τ², τ = H/2, or its inverse" => worst_of(rows, |_| true, factor), at_most APART_MAX]
    }
}

/// Whether the motion decays at this stiffness.
fn decays(case: &Case, stiffness_n_m: f64) -> bool {
    let law = law(case.law, stiffness_n_m, DAMPING_RATIO);
    let faults = Faults { seed: 1, due: true, ..Faults::default() };
    let set = pair("1d", law, case.rate_hz, faults, FALL_M);
    let Some(Pair { play, zero_j, .. }) = set else { return false };
    let start_j = play.raw_j() - zero_j;
    // under the weight springs and contact sag below the zero of energy: energy above it is kinetic
    let mut is_stable = true;
    let ended = play.run(SECONDS, |play, _| {
        let left = (play.raw_j() - zero_j) / start_j;
        is_stable = is_stable && left < 10.0 && (play.time().as_secs_f64() < LATE_S || left < LEFT);
        is_stable
    });
    is_stable && ended.time().as_secs_f64() >= SECONDS - 0.2
}
