//! The coupling error: the same scene with clocks apart, and with all of them tiny and alike.

use super::super::experiment::{Experiment, Finding, worst};
use super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel};
use super::super::scenes::{Scene, scene};
use super::super::stage::Faults;
use super::super::table::Table;
use glam::DVec3;
use metachron_agents::AgentId;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct CouplingError;

const SCENES: [&str; 4] = ["oblique-blow", "tube-on-bar", "gripper", "crossing"];
const RATIOS: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
const FAST_HZ: f64 = 1000.0;
/// The common clock of the other run.
const ORACLE_HZ: f64 = 4000.0;
const SECONDS: f64 = 1.0;
const QUICK_SECONDS: f64 = 0.5;

/// A scene, how much slower the second clock is, and which is which.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Case {
    scene: String,
    ratio: f64,
    first_is_fast: bool,
    seconds: f64,
}

/// How far the two runs are apart.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Row {
    scene: String,
    ratio: f64,
    first_is_fast: bool,
    seconds: f64,
    /// Positions of the points that are followed: root of the mean square and greatest, metres.
    position_rms_m: f64,
    position_max_m: f64,
    /// Momentum of the whole at the end, kg·m/s.
    momentum_n_s: f64,
    /// Impulse exchanged so far, as a share of the oracle's.
    impulse: f64,
}

impl Experiment for CouplingError {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = "error";
    const TITLE: &'static str = "the same scene with clocks apart and under one tiny clock: the coupling error";

    fn cases(quick: bool) -> Vec<Case> {
        let (ratios, seconds) = if quick { (&RATIOS[3..4], QUICK_SECONDS) } else { (&RATIOS[..], SECONDS) };
        let mut cases = Vec::new();
        for name in SCENES {
            for &ratio in ratios {
                let ways = if ratio == 1.0 { &[true][..] } else { &[true, false][..] };
                let of = |&first_is_fast: &bool| Case { scene: name.to_owned(), ratio, first_is_fast, seconds };
                cases.extend(ways.iter().map(of));
            }
        }
        cases
    }

    fn measure(case: &Case) -> Row {
        let Case { scene, ratio, first_is_fast, seconds } = case.clone();
        let [position_rms_m, position_max_m, momentum_n_s, impulse] = apart(case).unwrap_or([f64::NAN; 4]);
        Row { scene, ratio, first_is_fast, seconds, position_rms_m, position_max_m, momentum_n_s, impulse }
    }

    fn case_of(row: &Row) -> Case {
        Case { scene: row.scene.clone(), ratio: row.ratio, first_is_fast: row.first_is_fast, seconds: row.seconds }
    }

    fn figure(rows: &[Row]) -> Figure {
        let mut layers = Vec::new();
        for (name, colour) in SCENES.into_iter().zip(Colour::LINES) {
            for way in [true, false] {
                let here = rows.iter().filter(|r| r.scene == name && r.first_is_fast == way);
                let points: Vec<_> = here.map(|r| (r.ratio, 1e3 * r.position_rms_m)).collect();
                let mark = if way { Mark::Line(points) } else { Mark::Dots(points) };
                let label = if way { format!("{name}, first fast") } else { format!("{name}, first slow") };
                layers.push(Layer { label, colour, mark });
            }
        }
        let (x, y) = (Axis::log("ratio of the clocks", 0.8, 125.0), Axis::log("position error, rms, mm", 1e-6, 1e3));
        let panel = Panel { title: String::new(), x, y, layers };
        Figure { title: "Coupling error against one clock of 4 kHz".to_owned(), panels: vec![panel], columns: 1 }
    }

    fn table(rows: &[Row]) -> Table {
        let mut table = Table::new(&["scene", "ratio", "first", "rms_mm", "max_mm", "momentum_n_s", "impulse"]);
        table.rows.extend(rows.iter().map(|r| {
            vec![
                r.scene.clone().into(),
                (r.ratio, 0).into(),
                if r.first_is_fast { "fast" } else { "slow" }.into(),
                (1e3 * r.position_rms_m, 4).into(),
                (1e3 * r.position_max_m, 4).into(),
                (r.momentum_n_s, 6).into(),
                (r.impulse, 4).into(),
            ]
        }));
        table
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let lost = rows.iter().filter(|r| !r.position_rms_m.is_finite()).count() as f64;
        vec![Finding::at_most("runs that did not come to their end", lost, 0.0)]
    }
}

/// What one run leaves: of every point its places with their times, momentum and impulse at the end.
struct Trail {
    places: Vec<Vec<(f64, DVec3)>>,
    momentum: DVec3,
    impulse_n_s: f64,
}

fn apart(case: &Case) -> Option<[f64; 4]> {
    let slow_hz = FAST_HZ / case.ratio;
    let rates_hz = if case.first_is_fast { [FAST_HZ, slow_hz] } else { [slow_hz, FAST_HZ] };
    let (coupled, oracle) = (trail(case, rates_hz)?, trail(case, [ORACLE_HZ; 2])?);
    let pairs = coupled.places.iter().zip(&oracle.places);
    let mut squares = Vec::new();
    for (mine, theirs) in pairs {
        let within = mine.iter().filter(|(t, _)| *t <= case.seconds);
        squares.extend(within.filter_map(|(t, x)| Some(x.distance_squared(at(theirs, *t)?))));
    }
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    let impulse = (coupled.impulse_n_s - oracle.impulse_n_s).abs() / oracle.impulse_n_s.max(f64::MIN_POSITIVE);
    Some([mean.sqrt(), worst(squares).sqrt(), coupled.momentum.distance(oracle.momentum), impulse])
}

/// Plays the scene and notes where its points are after every step of whom they belong to.
fn trail(case: &Case, rates_hz: [f64; 2]) -> Option<Trail> {
    let Scene { play, points, .. } = scene(&case.scene, rates_hz, Faults::default())?;
    let agents = play.stage.members().len() as u32;
    let mut places = vec![Vec::new(); points.len()];
    let ended = play.run(case.seconds, |play, who| {
        let t = play.stage.own(who).time.as_secs_f64();
        for (trail, (id, anchor)) in places.iter_mut().zip(&points).filter(|(_, (id, _))| *id == who) {
            trail.extend(play.stage.own(*id).body.point(*anchor).map(|(x, _)| (t, x)));
        }
        true
    });
    let pairs = (0..agents).flat_map(|id| &ended.stage.own(AgentId(id)).pairs);
    let impulse_n_s = pairs.map(|pair| pair.impulse_n_s).sum();
    Some(Trail { places, momentum: ended.common(ended.time()).momentum, impulse_n_s })
}

/// The place at a time, on a straight line between the two known ones about it: of the oracle these are a quarter of a
/// millisecond apart.
fn at(places: &[(f64, DVec3)], t: f64) -> Option<DVec3> {
    let after = places.partition_point(|(known, _)| *known < t);
    let (before, after) = (places.get(after.checked_sub(1)?)?, places.get(after)?);
    Some(before.1.lerp(after.1, (t - before.0) / (after.0 - before.0)))
}
