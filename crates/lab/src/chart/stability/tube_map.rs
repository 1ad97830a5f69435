//! dt × stiffness: where each integrator of the tube is stable, bounded but wrong, or blown up.
//!
//! A tube of 1 m, 15 mm radius, 2 mm wall is clamped at one end, released from the horizontal and left to come to rest. A step
//! that is too long may end in non-finite numbers; it may also end at a wrong place, so the tip is compared with the rest
//! shape of an independent computation ([`super::hanging`]).

use super::common::{GRAVITY, plain_tube};
use super::hanging::Hanging;
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table};
use glam::DVec3;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, StepContext};
use metachron_core::{AgentId, SimSpan, SimTime, Snapshot};
use metachron_models::rod::{Integrator, Material, Section, Tube, TubeSpec};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct TubeMap;

const YOUNG_PA: [f64; 14] = [5e4, 1e5, 2e5, 5e5, 1e6, 2e6, 5e6, 1e7, 2e7, 5e7, 1e8, 2e8, 5e8, 1e9];
const DT_MS: [f64; 9] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
const QUICK_YOUNG_PA: [f64; 3] = [5e4, 1e7, 1e9];
const QUICK_DT_MS: [f64; 3] = [1.0, 10.0, 50.0];
const LENGTH_M: f64 = 1.0;
/// Segments: their own error at rest is below 1 % of the length for every stiffness here.
const SEGMENTS: usize = 32;
/// Mass-proportional damping, 1/s, and the time in which the tube comes to rest.
const DAMPING_PER_S: f64 = 6.0;
const SECONDS: f64 = 6.0;
/// A tip farther off than this share of the length counts as wrong.
const WRONG: f64 = 0.05;
/// A motion has blown up past this rise of energy, in multiples of the energy that the fall can give.
const BLOWN_UP: f64 = 10.0;
/// Past this stretch the sections of a soft tube tilt (docs/theory/rod.md).
const TILT: f64 = 1.5;

/// A square of the map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super) struct Case {
    integrator: String,
    young_pa: f64,
    dt_ms: f64,
}

/// The result of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    verdict: Verdict,
    /// Distance of the tip from its rest position, as a share of the length; empty where it blew up.
    tip_error: Option<f64>,
    /// The greatest rise of the mechanical energy above that of the start, as a share of the energy that the fall can
    /// give.
    energy_rise: f64,
    /// The greatest stretch on the way.
    stretch: f64,
    substeps_per_step: f64,
}

type Row = Measured<Case, Found>;

/// The verdicts on a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Verdict {
    Stable,
    Wrong,
    BlownUp,
    /// The integrator refused such a step beforehand.
    Refused,
}

impl Experiment for TubeMap {
    type Row = Row;
    const NAME: &'static str = "tube-map";
    const TITLE: &'static str = "dt × stiffness of the tube: stable, bounded but wrong, or blown up";

    fn cases(quick: bool) -> Vec<Case> {
        let (young, dt) = if quick { (&QUICK_YOUNG_PA[..], &QUICK_DT_MS[..]) } else { (&YOUNG_PA[..], &DT_MS[..]) };
        let of = |integrator: Integrator| {
            young.iter().flat_map(move |&young_pa| {
                dt.iter().map(move |&dt_ms| Case { integrator: integrator.name().to_owned(), young_pa, dt_ms })
            })
        };
        Integrator::ALL.into_iter().flat_map(of).collect()
    }

    fn measure(case: &Case) -> Row {
        let fall = fall(case);
        let tip_error = fall.tip.map(|tip| tip.distance(rest_of(case.young_pa)) / LENGTH_M);
        let verdict = match tip_error {
            None if fall.refused => Verdict::Refused,
            None => Verdict::BlownUp,
            Some(error) if error <= WRONG => Verdict::Stable,
            Some(_) => Verdict::Wrong,
        };
        let Fall { energy_rise, stretch, substeps_per_step, .. } = fall;
        Row { case: case.clone(), found: Found { verdict, tip_error, energy_rise, stretch, substeps_per_step } }
    }

    fn figure(rows: &[Row]) -> Figure {
        let panels = Integrator::ALL.into_iter().map(|integrator| panel(integrator.name(), rows)).collect();
        Figure::new("Clamped tube released from the horizontal, 6 s", 3, panels)
    }

    fn table(rows: &[Row]) -> Table {
        let line = |(integrator, young_pa): (&'static str, f64)| {
            let here = || {
                let same = move |r: &&Row| r.case.integrator == integrator && r.case.young_pa == young_pa;
                rows.iter().filter(same)
            };
            let count = |verdict| (here().filter(|r| r.verdict == verdict).count() as f64, 0).into();
            let bad =
                here().filter(|r| r.verdict != Verdict::Stable).map(|r| r.case.dt_ms).fold(f64::INFINITY, f64::min);
            let stable_ms = here().map(|r| r.case.dt_ms).filter(|dt| *dt < bad).fold(0.0, f64::max);
            let ran = || here().filter(|r| r.verdict != Verdict::Refused);
            let greatest = |of: fn(&Row) -> f64| ran().map(of).fold(0.0, f64::max);
            vec![
                ("integrator", integrator.into()),
                ("young_pa", (young_pa, 0).into()),
                ("stable to dt_ms", (stable_ms, 1).into()),
                ("refused", count(Verdict::Refused)),
                ("wrong", count(Verdict::Wrong)),
                ("blown up", count(Verdict::BlownUp)),
                ("worst tip error", (greatest(|r| r.tip_error.unwrap_or(f64::INFINITY)), 4).into()),
                ("most substeps", (greatest(|r| r.substeps_per_step), 1).into()),
                ("stretch", (greatest(|r| r.stretch), 2).into()),
            ]
        };
        let moduli = moduli(rows);
        let of = |integrator: Integrator| moduli.iter().map(move |young_pa| (integrator.name(), *young_pa));
        Table::named(Integrator::ALL.into_iter().flat_map(of).map(line))
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let implicit = [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::EnergyMomentum].map(Integrator::name);
        let bad =
            rows.iter().filter(|r| implicit.contains(&r.case.integrator.as_str()) && r.verdict != Verdict::Stable);
        let unsaid = rows.iter().filter(|r| matches!(r.verdict, Verdict::Wrong | Verdict::BlownUp));
        Finding::all_at_most([
            ("implicit methods: cells of the map that are not stable", bad.count() as f64, 0.0),
            ("all methods: cells that fail without being refused beforehand", unsaid.count() as f64, 0.0),
        ])
    }
}

/// The moduli in the rows, rising.
fn moduli(rows: &[Row]) -> Vec<f64> {
    YOUNG_PA.into_iter().filter(|young| rows.iter().any(|r| r.case.young_pa == *young)).collect()
}

/// The reference tube along +x.
fn spec(young_pa: f64) -> TubeSpec {
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(0.015, 0.002, material);
    TubeSpec {
        section,
        damping_per_s: DAMPING_PER_S,
        clamp: [true, false],
        gravity: DVec3::NEG_Z * GRAVITY,
        ..plain_tube(vec![DVec3::ZERO, DVec3::X * LENGTH_M], 0.015, SEGMENTS)
    }
}

/// The rest position of the tip.
fn rest_of(young_pa: f64) -> DVec3 {
    let spec = spec(young_pa);
    let Section { ea_n, ga_n, ei_n_m2, .. } = spec.section;
    let weight_n_m = spec.section.mass_per_length_kg_m * GRAVITY;
    let (side, down) = Hanging { length_m: LENGTH_M, weight_n_m, ea_n, ga_n, ei_n_m2 }.tip_m();
    DVec3::new(side, 0.0, -down)
}

/// The result of a fall.
struct Fall {
    tip: Option<DVec3>,
    energy_rise: f64,
    stretch: f64,
    substeps_per_step: f64,
    refused: bool,
}

/// Releases the tube; the tip is `None` where the motion blew up.
fn fall(case: &Case) -> Fall {
    let integrator = case.integrator.parse().unwrap_or_default();
    let spec = TubeSpec { integrator, ..spec(case.young_pa) };
    let given_j = spec.section.mass_per_length_kg_m * GRAVITY * LENGTH_M * LENGTH_M;
    let mut out = Fall { tip: None, energy_rise: 0.0, stretch: 1.0, substeps_per_step: 0.0, refused: false };
    let (Ok(mut tube), Some(dt)) = (Tube::new(spec), SimSpan::from_secs_f64(case.dt_ms * 1e-3)) else { return out };
    if tube.longest_substep_s().is_some_and(|limit_s| dt.as_secs_f64() > limit_s) {
        return Fall { refused: true, ..out };
    }
    let start_j = tube.energy_j();
    let mut stepper = LoneStepper::default();
    let (mut time, mut steps, mut substeps) = (SimTime::ZERO, 0_u32, 0_u32);
    while time.as_secs_f64() < SECONDS {
        let Ok(report) = stepper.step(&mut tube, dt, StepContext::alone(AgentId(0), time)) else { return out };
        substeps += report.substeps;
        (time, steps) = (time + dt, steps + 1);
        out.substeps_per_step = f64::from(substeps) / f64::from(steps);
        out.stretch = out.stretch.max(tube.stretch());
        out.energy_rise = out.energy_rise.max((tube.energy_j() - start_j) / given_j);
        if out.energy_rise.is_nan() || out.energy_rise > BLOWN_UP {
            return out;
        }
    }
    let mut snapshot = Snapshot::default();
    tube.write_snapshot(&mut snapshot);
    out.tip = snapshot.body.probe(1.0).map(|(tip, _)| tip).filter(|tip| tip.is_finite());
    out
}

/// The map of one integrator.
fn panel(integrator: &str, rows: &[Row]) -> Panel {
    let here: Vec<&Row> = rows.iter().filter(|r| r.case.integrator == integrator).collect();
    let edges = |of: fn(&Row) -> f64| {
        let mut values: Vec<f64> = here.iter().map(|r| of(r)).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let (young, dt) = (edges(|r| r.case.young_pa), edges(|r| r.case.dt_ms));
    let cell = |r: &Row| {
        let ([a, b], [c, d]) = (cell_bounds(&young, r.case.young_pa), cell_bounds(&dt, r.case.dt_ms));
        [a, b, c, d]
    };
    let squares = |label: &str, colour, verdict| {
        Layer::cells(label, colour, here.iter().filter(|r| r.verdict == verdict).map(|r| cell(r)))
    };
    let tilted = here.iter().filter(|r| r.stretch > TILT).map(|r| (r.case.young_pa, r.case.dt_ms));
    let layers = vec![
        squares("stable", Colour::Sky, Verdict::Stable),
        squares("bounded but wrong", Colour::Orange, Verdict::Wrong),
        squares("blown up", Colour::Red, Verdict::BlownUp),
        squares("refused beforehand", Colour::Grey, Verdict::Refused),
        Layer::dots(format!("stretched past {TILT}"), Colour::Blue, tilted),
    ];
    let axis = |label, values: &[f64]| {
        let ends = |v: Option<&f64>| v.copied().unwrap_or(1.0);
        let ([low, _], [_, high]) =
            (cell_bounds(values, ends(values.first())), cell_bounds(values, ends(values.last())));
        Axis::log(label, low, high)
    };
    Panel::new(integrator, axis("Young's modulus, Pa", &young), axis("dt, ms", &dt), layers)
}

/// The range of a value's square: half way to its neighbours, in ratios.
fn cell_bounds(values: &[f64], value: f64) -> [f64; 2] {
    let k = values.iter().position(|v| *v == value).unwrap_or(0);
    let up = values.get(k + 1).map(|next| (next / value).sqrt());
    let down = k.checked_sub(1).and_then(|k| values.get(k)).map(|last| (value / last).sqrt());
    let (up, down) = (up.or(down).unwrap_or(2.0), down.or(up).unwrap_or(2.0));
    [value / down, value * up]
}
