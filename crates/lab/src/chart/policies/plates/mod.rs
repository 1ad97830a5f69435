//! The papers' figures of pictures, one experiment each: the same view under several policies or limits, side by side.
//!
//! In: a figure. Out: a row for each picture, and a sheet of them. In lockstep on one declared machine, where an adapter draws pictures alone;
//! with `--live` the adapter's own times count. Never here: drawing, the frame loop.

mod figures;
mod sheet;

use super::played::still::{Approach, Sight, Still, StillRequest, still};
use super::played::walk::{ALIKE_DB, Opening, Times};
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Record, worst};
use csv::StringRecord;
use figures::{Changes, Limit, PLATES, Panel, Plate};
use metachron_lod::control::Policy;
use metachron_render::{PictureFile, psnr_db, ssim};
use serde::{Deserialize, Serialize};
use sheet::{difference, sheet};
use std::sync::{Arc, Mutex, PoisonError};

/// The experiment on figure number `F`, drawn and timed on the present adapter if `LIVE`.
pub(in super::super) struct Figures<const F: usize, const LIVE: bool>;

/// The longest frame of the optimization algorithm over its target in (FS93, table 1).
const LONGEST: f64 = 1.3;

/// A picture of a figure.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Case {
    panel: String,
    frames: usize,
}

/// Numbers of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super) struct Row {
    panel: String,
    policy: String,
    frames: usize,
    adapter: String,
    target_ms: f64,
    frame_ms: f64,
    triangles: u64,
    /// Triangles that the paper says of it; NaN where it says none.
    paper_triangles: f64,
    /// Objects in view that are left out, and groups that are drawn as one.
    holes: u32,
    impostors: usize,
    /// Likeness to full detail; NaN without an adapter.
    ssim: f64,
    psnr_db: f64,
}

impl Record for Row {
    type Case = Case;

    fn case(&self) -> Case {
        Case { panel: self.panel.clone(), frames: self.frames }
    }

    fn read(names: &StringRecord, line: &StringRecord) -> csv::Result<Self> {
        line.deserialize(Some(names))
    }
}

/// The play behind a picture: figure, panel (none: full detail), frames, whether live.
type Played = (&'static str, Option<&'static str>, usize, bool);

/// The pictures of this run of the program.
static PLAYED: Mutex<Vec<(Played, Arc<Still>)>> = Mutex::new(Vec::new());

impl Plate {
    fn panel(&self, case: &Case) -> Option<&'static Panel> {
        self.panels.iter().find(|panel| panel.label == case.panel)
    }

    /// The still of a panel, or of full detail at the same place; played now if it was not yet.
    fn still(&self, panel: Option<&'static Panel>, frames: usize, target_s: f64, live: bool) -> Option<Arc<Still>> {
        let key = (self.name, panel.map(|panel| panel.label), frames, live);
        let known = || PLAYED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, still)) = known().iter().find(|(played, _)| *played == key) {
            return Some(Arc::clone(still));
        }
        let text = self.paper.text(&self.choices);
        let changes: Vec<Changes> = vec![self.changes, panel.map_or(&[], |panel| panel.changes)];
        let request = StillRequest {
            scene: Opening { name: self.paper.name(), text: &text, changes: &changes.concat() },
            policy: panel.map_or("full", |panel| panel.policy),
            target_s,
            approach: Approach { frames, ..self.approach(false) },
            times: if live { Times::Measured } else { Times::Declared },
            sights: if panel.is_some() { self.sights } else { &[Sight::Eye] },
        };
        let still = Arc::new(still(&request).ok()?);
        known().push((key, Arc::clone(&still)));
        Some(still)
    }

    /// Full detail at the place, the still of a panel, and the panel's target, seconds.
    fn pair(&self, case: &Case, live: bool) -> Option<(Arc<Still>, Arc<Still>, f64)> {
        let panel = self.panel(case)?;
        // the target has no effect on full detail
        let full = self.still(None, case.frames, 1.0, live)?;
        let target_s = match panel.limit {
            Limit::TimesOver([_, times_over]) if live => 1e-3 * full.frame_ms / times_over,
            Limit::TimesOver([times_over, _]) => 1e-3 * full.frame_ms / times_over,
            Limit::Triangles(count) => 1e-6 * count,
        };
        let own = self.still(Some(panel), case.frames, target_s, live)?;
        Some((full, own, target_s))
    }
}

impl<const F: usize, const LIVE: bool> Experiment for Figures<F, LIVE> {
    type Row = Row;
    const NAME: &'static str = PLATES[F].name;
    const TITLE: &'static str = PLATES[F].title;
    // full detail is played once for all of them
    const ALONE: bool = true;
    const COLUMNS: &'static str = "\
        panel, policy, target_ms.3 as T_ms, frame_ms.3, triangles.0, paper_triangles.0 as paper, \
        holes.0 as left_out, impostors.0, ssim.4, psnr_db.1";

    fn cases(quick: bool) -> Vec<Case> {
        let frames = PLATES[F].approach(quick).frames;
        PLATES[F].panels.iter().map(|panel| Case { panel: panel.label.to_owned(), frames }).collect()
    }

    fn measure(case: &Case) -> Row {
        let panel = PLATES[F].panel(case);
        let mut row = Row {
            panel: case.panel.clone(),
            policy: panel.map_or("", |panel| panel.policy).to_owned(),
            frames: case.frames,
            adapter: String::new(),
            target_ms: f64::NAN,
            frame_ms: f64::NAN,
            triangles: 0,
            paper_triangles: panel.and_then(|panel| panel.polygons).map_or(f64::NAN, f64::from),
            holes: 0,
            impostors: 0,
            ssim: f64::NAN,
            psnr_db: f64::NAN,
        };
        let Some((full, own, target_s)) = PLATES[F].pair(case, LIVE) else { return row };
        (row.target_ms, row.frame_ms, row.triangles) = (1e3 * target_s, own.frame_ms, own.triangles);
        (row.holes, row.impostors) = (own.holes, own.impostors);
        row.adapter.clone_from(&own.adapter);
        if let Some((picture, full)) = own.picture(Sight::Eye).zip(full.picture(Sight::Eye)) {
            row.ssim = ssim(picture, full).unwrap_or(f64::NAN);
            row.psnr_db = psnr_db(picture, full).unwrap_or(f64::NAN).min(ALIKE_DB);
        }
        row
    }

    fn figure(rows: &[Row]) -> Figure {
        let most = rows.iter().map(|row| row.triangles as f64).fold(1.0, f64::max);
        let slowest = rows.iter().map(|row| row.frame_ms / row.target_ms).fold(1.2, f64::max);
        let dots = rows.iter().zip(Colour::LINES.into_iter().cycle()).map(|(row, colour)| {
            Layer::dots(&row.panel, colour, [(row.triangles as f64, row.frame_ms / row.target_ms)])
        });
        let (x, y) = (
            Axis::log("triangles", 100.0, 1.2 * most.max(100.0)),
            Axis::linear("time of the frame / target", 0.0, 1.05 * slowest),
        );
        Figure::single(PLATES[F].title, x, y, dots)
    }

    fn pictures(rows: &[Row]) -> anyhow::Result<Vec<(String, PictureFile)>> {
        let plate = &PLATES[F];
        let column = |row: &Row| {
            let (full, own, _) = plate.pair(&row.case(), LIVE)?;
            let (eye, full) = (own.picture(Sight::Eye)?, full.picture(Sight::Eye)?);
            let shown = |sight: &Sight| match sight {
                Sight::Difference => Some(difference(eye, full)),
                drawn => own.picture(*drawn).cloned(),
            };
            let pictures = plate.sights.iter().filter_map(shown).collect();
            Some(sheet::Column {
                name: format!("{}: {} triangles, {:.2} ms", row.panel, row.triangles, row.frame_ms),
                pictures,
            })
        };
        let columns: Vec<sheet::Column> = rows.iter().filter_map(column).collect();
        Ok(if columns.is_empty() { Vec::new() } else { vec![("pictures".to_owned(), sheet(&columns)?)] })
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let predicts = |row: &&Row| row.policy.parse().is_ok_and(Policy::predicts);
        let late = worst(rows.iter().filter(predicts).map(|row| row.frame_ms / row.target_ms));
        let mut findings = vec![Finding::at_most("frame / T of policies that predict", late, LONGEST)];
        let with_groups = |row: &&Row| row.policy == "hierarchical";
        if rows.iter().any(|row| with_groups(&row)) {
            let out = worst(rows.iter().filter(with_groups).map(|row| f64::from(row.holes)));
            findings.push(Finding::at_most("objects left out where groups may be drawn as one", out, 0.0));
            let flat = worst(rows.iter().filter(|row| row.policy == "greedy").map(|row| f64::from(row.holes)));
            findings.push(Finding::at_least("objects left out where they may not", flat, 1.0));
        }
        findings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_scene::{Source, load};

    #[test]
    fn figures_and_panels_have_names_of_their_own_and_policies_and_keys_that_exist() {
        let tiny = Source::memory("tiny", b"format = 1\n").unwrap();
        for (at, plate) in PLATES.iter().enumerate() {
            assert!(PLATES[..at].iter().all(|other| other.name != plate.name));
            for (k, panel) in plate.panels.iter().enumerate() {
                assert!(plate.panels[..k].iter().all(|other| other.label != panel.label), "{}", plate.name);
                assert!(panel.policy.parse::<Policy>().is_ok(), "{}: {}", plate.name, panel.policy);
                let changes = [plate.changes, panel.changes].concat();
                let changes: Vec<_> = changes.iter().map(|(key, to)| ((*key).to_owned(), (*to).to_owned())).collect();
                assert!(load(&tiny, &changes).is_ok(), "{}: {changes:?}", plate.name);
            }
        }
    }
}
