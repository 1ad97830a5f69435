//! Accuracy of an adapter's prices (its cost model) on pictures to which they were not fitted (FS93, fig. 3).
//!
//! In: a scene, a set of prices. Out: predicted and measured times of pictures at random places of its path, under random targets. The
//! prices are those of the adapter's benchmark, which draws none of these objects; nothing is learnt during the run.
//! Each picture is drawn several times: no prices can predict the scatter of these times.

use super::super::played::walk;
use super::super::played::walk::{PathPoint, Predicted};
use crate::chart::policies::numeric::{RandomSource, within};
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Named, Panel, Table, claims, each, span, table,
    worst_of,
};
use metachron_lod::control::Policy;
use metachron_scene::papers::Paper;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super::super) struct Prediction;

/// Pictures per scene, in full and in the quick run.
const PICTURES: [usize; 2] = [60, 8];
/// Range of targets, from one that nothing fits to one that everything does, seconds; drawn log-uniformly.
const TARGETS_S: (f64, f64) = (4e-3, 0.3);
/// How often each picture is drawn.
const TIMES: usize = 5;
/// Prices by two stages and by areas, each with a policy that predicts by them and learns nothing.
const PRICES: [Named<Policy>; 2] = [Named("lines", Policy::MarginalFill), Named("areas", Policy::RobinHood)];
/// Bound of the prediction error for 19 of 20 pictures (FS93, §4).
const WANTED: f64 = 0.1;
const SEED: u64 = 3;

/// A scene, the prices that predict it, and the number of pictures.
#[derive(Debug, Clone, Serialize)]
pub(in super::super::super) struct Case {
    scene: Named<Paper>,
    prices: Named<Policy>,
    #[serde(skip)]
    pictures: usize,
}

/// Measured and predicted times of a scene's pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super::super) struct Found {
    adapter: String,
    pictures: usize,
    /// |predicted − measured| over measured, for the first drawing of each picture: the mean, and the bound that 19 of 20 keep.
    error: f64,
    error95: f64,
    /// The same with all predictions multiplied by `factor`, the median of measured over predicted: the error that a learnt γ leaves.
    scaled_error95: f64,
    factor: f64,
    /// Deviation from their median that 19 of 20 times of the same picture keep: no prices can predict better.
    scatter95: f64,
    /// Predicted and measured, milliseconds, with a colon between the two and spaces between pictures.
    pairs: String,
}

type Row = Measured<Case, Found>;

impl Found {
    fn of(adapter: String, pictures: &[Predicted]) -> Self {
        let pairs: Vec<_> = pictures.iter().filter_map(|p| Some((p.predicted_ms, *p.measured_ms.first()?))).collect();
        let factor = within(&pairs.iter().map(|(predicted, measured)| measured / predicted).collect::<Vec<_>>(), 0.5);
        let errors = |by: f64| {
            pairs.iter().map(|(predicted, measured)| (by * predicted / measured - 1.0).abs()).collect::<Vec<_>>()
        };
        let plain = errors(1.0);
        Self {
            adapter,
            pictures: pictures.len(),
            error: plain.iter().sum::<f64>() / plain.len() as f64,
            error95: within(&plain, 0.95),
            scaled_error95: within(&errors(factor), 0.95),
            factor,
            scatter95: scatter95(pictures),
            pairs: pairs
                .iter()
                .map(|(predicted, measured)| format!("{predicted:.3}:{measured:.3}"))
                .collect::<Vec<_>>()
                .join(" "),
        }
    }

    fn pairs(&self) -> Vec<(f64, f64)> {
        let pair = |text: &str| text.split_once(':').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        self.pairs.split(' ').filter_map(pair).collect()
    }
}

/// Deviation from their median that 19 of 20 times of the same picture keep.
fn scatter95(pictures: &[Predicted]) -> f64 {
    let about = |picture: &Predicted| {
        let middle = within(&picture.measured_ms, 0.5);
        picture.measured_ms.iter().map(|measured| (measured / middle - 1.0).abs()).collect::<Vec<_>>()
    };
    within(&pictures.iter().flat_map(about).collect::<Vec<_>>(), 0.95)
}

impl Experiment for Prediction {
    type Row = Row;
    const NAME: &'static str = "prediction";
    const TITLE: &'static str = "predicted and measured drawing times, by the adapter's cost model";
    const ALONE: bool = true;
    const TABLE: fn(&[Row]) -> Table = table!(|r| scene: r.case.scene, prices: r.case.prices, pictures: r.pictures,
        error(3): r.error, error95(3): r.error95, factor(3): r.factor, scaled95(3): r.scaled_error95,
        scatter95(3): r.scatter95);

    fn cases(quick: bool) -> Vec<Case> {
        let named = |paper: Paper| Named(paper.name(), paper);
        each!(scene in Paper::ALL.map(named), prices in PRICES => Case { scene, prices, pictures: PICTURES[usize::from(quick)] })
    }

    fn measure(case: &Case) -> Option<Found> {
        let mut noise = RandomSource::new(SEED);
        let (low, high) = TARGETS_S;
        let mut point = || PathPoint { part: noise.uniform(), target_s: low * libm::pow(high / low, noise.uniform()) };
        let asked: Vec<_> = (0..case.pictures).map(|_| point()).collect();
        let (adapter, pictures) = walk::predicted(case.scene.1, case.prices.1, &asked, TIMES).ok()?;
        Some(Found::of(adapter, &pictures))
    }

    fn figure(rows: &[Row]) -> Figure {
        let adapter = rows.first().map_or("", |row| &row.adapter);
        let (low, high) =
            span(rows.iter().flat_map(|row| row.pairs()).flat_map(|(predicted, measured)| [predicted, measured]), true);
        let grey = |label: &str, by: f64| Layer::dashed(label, Colour::Grey, [low, high].map(|ms| (ms, by * ms)));
        let panel = |prices: Named<Policy>| {
            let mut layers = vec![grey("exact, and 10 % off", 1.0), grey("", 1.0 - WANTED), grey("", 1.0 + WANTED)];
            let here = rows.iter().filter(|row| row.case.prices == prices).zip(Colour::LINES.into_iter().cycle());
            layers.extend(here.map(|(row, colour)| Layer::dots(row.case.scene.0, colour, row.pairs())));
            let (x, y) = (Axis::log("predicted, ms", low, high), Axis::log("measured, ms", low, high));
            Panel::new(format!("cost model: {}", prices.0), x, y, layers)
        };
        let title = format!("Predicted and measured on {adapter} (FS93, fig. 3)");
        Figure::new(title, 2, PRICES.map(panel).to_vec())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let all = |what: fn(&Row) -> f64| worst_of(rows, |row| row.case.prices.0 == "areas", what);
        claims![
            "19 of 20 pictures of every scene: error of the prediction" => all(|r| r.error95), at_most WANTED;
            "the same with one factor per scene" => all(|r| r.scaled_error95), at_most WANTED;
            "19 of 20 drawings of the same picture: scatter" => all(|r| r.scatter95), at_most WANTED;
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniformly_slower_machine_is_distinguished_from_prediction_errors() {
        let measured = |k: u32| f64::from(k) * if k == 7 { 2.0 } else { 1.5 };
        let picture = |k: u32| Predicted {
            predicted_ms: f64::from(k),
            measured_ms: vec![measured(k), 0.98 * measured(k), 1.01 * measured(k)],
        };
        let row = Found::of(String::new(), &(1..=40).map(picture).collect::<Vec<_>>());
        assert!((row.error95 - 1.0 / 3.0).abs() < 1e-12 && (row.factor - 1.5).abs() < 1e-12);
        assert!(row.scaled_error95 < 1e-12, "one of forty is past the 95th of a hundred");
        assert!((row.scatter95 - 0.02).abs() < 1e-12 && row.pairs().len() == 40);
    }
}
