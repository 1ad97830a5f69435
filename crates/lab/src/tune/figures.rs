//! The figure of a tuning: the plant, step responses, the map of gains, and late frames over the speed of the machine.
//!
//! In: a plant and the gains found. Out: SVG and PNG in a folder. Never here: numbers neither in the table nor played for the figure.

use super::super::chart::figure;
use super::super::chart::figure::{Axis, Colour, Figure, Layer, Mark, Panel, span};
use super::{Identified, origin_name};
use metachron_lod::control::Law;
use metachron_lod::tune::{Candidate, Disturbance, Measures, Origin, Plant, Start, Trial, Tuning, measure, play};
use std::path::{Path, PathBuf};

/// Starting rates shown, in parts of the target rate.
const STARTS: [f64; 2] = [0.4, 2.5];
/// Seconds shown of a step response.
const SHOWN_S: f64 = 2.0;
/// Cells of the map along α and along β.
const CELLS: [usize; 2] = [24, 12];
/// The map's ranges of α and β, unless the gains found need more room.
const ALPHA: (f64, f64) = (1e-6, 1e-1);
const BETA: (f64, f64) = (0.05, 50.0);
/// Seconds of a map cell's trial.
const MAP_S: f64 = 3.0;
/// Speeds of the machine in the chart.
const SPEEDS: [f64; 9] = [0.25, 0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0];

/// Draws and writes the figure.
pub(super) fn write(folder: &Path, stem: &str, on: &Identified, tuned: &Tuning) -> anyhow::Result<[PathBuf; 2]> {
    let panels = vec![fit(&on.plant), responses(on, tuned), map(on, tuned), late_frames(on, tuned)];
    let title = format!("{} at {} Hz on {}", on.scene.name, on.target_hz, on.machine);
    figure::write(folder, &format!("tune-{stem}"), &Figure::new(title, 2, panels))
}

fn layer(label: impl Into<String>, colour: Colour, mark: Mark) -> Layer {
    Layer { label: label.into(), colour, mark }
}

/// The measured points and the fitted line.
fn fit(plant: &Plant) -> Panel {
    let points: Vec<_> = plant.points.iter().map(|&(x, y)| (1e-3 * x, 1e3 * y)).collect();
    let x = span(points.iter().map(|p| p.0).chain([0.0]), false);
    let y = span(points.iter().map(|p| p.1).chain([0.0]), false);
    let at = |thousands: f64| (thousands, 1e3 * plant.line.at(1e3 * thousands));
    let layers =
        [Layer::dots("frames", Colour::Sky, points), Layer::dashed("fit", Colour::Grey, [at(x.0.max(0.0)), at(x.1)])];
    let (x, y) =
        (Axis::linear("polygons, thousands", x.0.max(0.0), x.1), Axis::linear("frame time, ms", y.0.max(0.0), y.1));
    Panel::new("plant: measured frames and fitted line", x, y, layers)
}

fn undisturbed_trial(on: &Identified, candidate: impl Into<Candidate>, rate: f64, seconds: f64) -> Trial {
    Trial { start: Start::Rate(rate), seconds, ..Trial::undisturbed(candidate, on.target_hz) }
}

/// How a law's points are drawn.
type Drawn = fn(Vec<(f64, f64)>) -> Mark;

/// A colour for every law of the table: laws that were found as lines, laws for comparison dashed.
fn styles(tuned: &Tuning) -> impl Iterator<Item = (Colour, Drawn)> {
    let found = tuned.found.len();
    let mark = move |k: usize| if k < found { Mark::Line } else { Mark::Dashed };
    Colour::LINES.into_iter().cycle().enumerate().map(move |(k, colour)| (colour, mark(k) as Drawn))
}

/// Step responses from 0.4 and from 2.5 times the target rate.
fn responses(on: &Identified, tuned: &Tuning) -> Panel {
    let plant = evaluated_plant(on, tuned);
    let mut layers = vec![Layer::limit("", [0.0, SHOWN_S], 1.0)];
    for (row, (colour, mark)) in tuned.rows.iter().zip(styles(tuned)) {
        for (k, rate) in STARTS.into_iter().enumerate() {
            let beats = play(&plant, &undisturbed_trial(on, row.verdict.candidate, rate, SHOWN_S));
            let line = beats.iter().map(|b| (b.time_s, b.ratio)).collect();
            layers.push(layer(if k == 0 { origin_name(row.origin) } else { "" }, colour, mark(line)));
        }
    }
    let (x, y) = (Axis::linear("time, s", 0.0, SHOWN_S), Axis::log("frame time / target", 0.2, 4.0));
    Panel::new("step responses from 0.4 and from 2.5 times the rate", x, y, layers)
}

/// The plant on the machine on which the gains were judged.
fn evaluated_plant(on: &Identified, tuned: &Tuning) -> Plant {
    on.plant.on(tuned.best.at_speed)
}

/// The printed law over (α, β): where it settles, is slow, or swings; the chosen gains as a dot.
fn map(on: &Identified, tuned: &Tuning) -> Panel {
    let ([columns, rows], plant) = (CELLS, evaluated_plant(on, tuned));
    let step = |(low, high): (f64, f64), count: usize, at: usize| low * (high / low).powf(at as f64 / count as f64);
    let found = tuned.rows.iter().filter_map(|row| match row.verdict.candidate {
        Candidate::Feedback(Law::Printed { alpha, beta }) if matches!(row.origin, Origin::Found(_)) => {
            Some((alpha, beta))
        }
        _ => None,
    });
    let found: Vec<_> = found.collect();
    let (alphas, betas) = (widened(ALPHA, found.iter().map(|at| at.0)), widened(BETA, found.iter().map(|at| at.1)));
    let corners = (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row)));
    let cells: Vec<[f64; 4]> = corners
        .map(|(column, row)| {
            let (a, b) = (step(alphas, columns, column), step(betas, rows, row));
            [a, step(alphas, columns, column + 1), b, step(betas, rows, row + 1)]
        })
        .collect();
    let starts = cells.iter().flat_map(|[a, a_end, b, b_end]| {
        let law = Law::Printed { alpha: (a * a_end).sqrt(), beta: (b * b_end).sqrt() };
        STARTS.map(|rate| undisturbed_trial(on, law, rate, MAP_S))
    });
    let measured = measure(&plant, &starts.collect::<Vec<_>>(), None);
    let kinds: Vec<usize> = measured.chunks(STARTS.len()).map(kind).collect();
    let of =
        |kind: usize| cells.iter().zip(&kinds).filter(|(_, k)| **k == kind).map(|(cell, _)| *cell).collect::<Vec<_>>();
    let [good, slow, swings] = [0, 1, 2].map(of);
    let (x, y) = (Axis::log("α", alphas.0, alphas.1), Axis::log("β", betas.0, betas.1));
    let layers = [
        Layer::cells("settles within 1 s", Colour::Green, good),
        Layer::cells("settles later or elsewhere", Colour::Sky, slow),
        Layer::cells("limit cycle", Colour::Red, swings),
        Layer::dots("chosen", Colour::Blue, found),
    ];
    Panel::new("stability map of the printed law", x, y, layers)
}

/// A range extended to contain these values, with half a decade of room around each.
fn widened(range: (f64, f64), values: impl Iterator<Item = f64>) -> (f64, f64) {
    const ROOM: f64 = 3.2;
    values.fold(range, |(low, high), value| (low.min(value / ROOM), high.max(value * ROOM)))
}

/// 0: settles within a second from both starts; 1: later, or not; 2: swings.
fn kind(measured: &[Measures]) -> usize {
    if measured.iter().any(|m| m.cycle.is_some()) {
        2
    } else {
        usize::from(!measured.iter().all(|m| m.settle_s.is_some_and(|s| s <= 1.0)))
    }
}

/// Late frames over the speed of the machine, with 40 % more load for a third of the time.
fn late_frames(on: &Identified, tuned: &Tuning) -> Panel {
    let trial = |candidate: Candidate, speed: f64| Trial {
        speed,
        disturbance: Disturbance::Load(1.4),
        noise: on.plant.line.scatter,
        seed: 1,
        start: Start::Rate(speed),
        ..undisturbed_trial(on, candidate, 1.0, 4.0)
    };
    let trials = tuned.rows.iter().flat_map(|row| SPEEDS.map(|speed| trial(row.verdict.candidate, speed)));
    let measured = measure(&on.plant, &trials.collect::<Vec<_>>(), None);
    let lines = tuned.rows.iter().zip(styles(tuned)).zip(measured.chunks(SPEEDS.len()));
    let lines = lines.map(|((row, (colour, mark)), measured)| {
        let points = SPEEDS.iter().zip(measured).map(|(speed, m)| (*speed, 100.0 * m.miss_share)).collect();
        layer(origin_name(row.origin), colour, mark(points))
    });
    let layers: Vec<_> = lines.collect();
    let high = 100.0 * measured.iter().map(|m| m.miss_share).fold(0.01, f64::max);
    let (x, y) = (
        Axis::log("speed of the machine", SPEEDS[0], SPEEDS[SPEEDS.len() - 1]),
        Axis::linear("late frames, %", 0.0, 1.05 * high),
    );
    Panel::new("gains tuned at speed 1, on machines of other speeds, load + 40 %", x, y, layers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_found_gains_are_inside_the_map() {
        assert_eq!(widened(BETA, [1.0].into_iter()), BETA);
        let (low, high) = widened(BETA, [50.0, 0.01].into_iter());
        assert!(low < 0.004 && high > 150.0, "{low} {high}");
        assert_eq!(widened(ALPHA, std::iter::empty()), ALPHA);
    }
}
