//! The papers' figures of pictures, one experiment each: the same view under several policies or limits, side by side.
//!
//! In: a figure. Out: a row for each picture, and a sheet of them. In lockstep on one declared machine, where an adapter draws pictures alone;
//! with `--live` the adapter's own times count. Never here: drawing, the frame loop.

mod figures;
mod sheet;

use super::played::still::{Approach, Sight, Still, StillRequest, still};
use super::played::walk::{ALIKE_DB, Opening, Times};
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Named, Table, blank, claims, table, worst_of,
};
use figures::{Changes, Limit, PLATES, Panel, Plate};
use metachron_lod::control::Policy;
use metachron_render::{PictureFile, flip, psnr_db, ssim};
use serde::{Deserialize, Serialize};
use sheet::{difference, sheet};
use std::sync::{Arc, Mutex, PoisonError};

/// The experiment on figure number `F`, drawn and timed on the present adapter if `LIVE`.
pub(in super::super) struct Figures<const F: usize, const LIVE: bool>;

/// The longest frame of the optimization algorithm over its target in (FS93, table 1).
const LONGEST: f64 = 1.3;

/// A picture of a figure.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    panel: Named<&'static Panel>,
    policy: Named<Policy>,
    frames: usize,
}

/// Numbers of a picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    adapter: String,
    target_ms: f64,
    frame_ms: f64,
    triangles: u64,
    /// Triangles that the paper says of it; NaN where it says none.
    paper_triangles: f64,
    /// Objects in view that are left out, and groups that are drawn as one.
    holes: u32,
    impostors: usize,
    /// Objects in view that are drawn with a texture.
    textured: u32,
    /// Likeness to full detail; NaN without an adapter.
    ssim: f64,
    /// Difference from it that is seen, likewise.
    flip: f64,
    psnr_db: f64,
}

type Row = Measured<Case, Found>;

/// The play behind a picture: figure, panel (none: full detail), frames, whether live.
type Played = (&'static str, Option<&'static str>, usize, bool);

/// The pictures of this run of the program.
static PLAYED: Mutex<Vec<(Played, Arc<Still>)>> = Mutex::new(Vec::new());

impl Plate {
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
            policy: panel.map_or(Policy::Full, |panel| panel.policy),
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
        let Named(_, panel) = case.panel;
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
    const TABLE: fn(&[Row]) -> Table = table!(|r| panel: r.case.panel, policy: r.case.policy, T_ms(3): r.target_ms,
        frame_ms(3): r.frame_ms, triangles: r.triangles, paper: r.paper_triangles, left_out: r.holes,
        impostors: r.impostors, textured: r.textured, ssim(4): r.ssim, flip(4): r.flip, psnr_db(1): r.psnr_db);

    fn cases(quick: bool) -> Vec<Case> {
        let frames = PLATES[F].approach(quick).frames;
        let case = |panel: &'static Panel| Case {
            panel: Named(panel.label, panel),
            policy: Named(panel.policy.name(), panel.policy),
            frames,
        };
        PLATES[F].panels.iter().map(case).collect()
    }

    fn measure(case: &Case) -> Option<Found> {
        let paper_triangles = case.panel.1.polygons.map_or(f64::NAN, f64::from);
        let Some((full, own, target_s)) = PLATES[F].pair(case, LIVE) else {
            return Some(Found { paper_triangles, ..blank() });
        };
        let pictures = own.picture(Sight::Eye).zip(full.picture(Sight::Eye));
        let psnr_db = |(picture, full)| psnr_db(picture, full).unwrap_or(f64::NAN).min(ALIKE_DB);
        Some(Found {
            adapter: own.adapter.clone(),
            target_ms: 1e3 * target_s,
            frame_ms: own.frame_ms,
            triangles: own.triangles,
            paper_triangles,
            holes: own.holes,
            impostors: own.impostors,
            textured: own.textured,
            ssim: pictures.and_then(|(picture, full)| ssim(picture, full)).unwrap_or(f64::NAN),
            flip: pictures.and_then(|(picture, full)| flip(full, picture)).unwrap_or(f64::NAN),
            psnr_db: pictures.map_or(f64::NAN, psnr_db),
        })
    }

    fn figure(rows: &[Row]) -> Figure {
        let most = rows.iter().map(|row| row.triangles as f64).fold(1.0, f64::max);
        let slowest = rows.iter().map(|row| row.frame_ms / row.target_ms).fold(1.2, f64::max);
        let dots = rows.iter().zip(Colour::LINES.into_iter().cycle()).map(|(row, colour)| {
            Layer::dots(row.case.panel.0, colour, [(row.triangles as f64, row.frame_ms / row.target_ms)])
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
            let (full, own, _) = plate.pair(&row.case, LIVE)?;
            let (eye, full) = (own.picture(Sight::Eye)?, full.picture(Sight::Eye)?);
            let shown = |sight: &Sight| match sight {
                Sight::Difference => Some(difference(eye, full)),
                drawn => own.picture(*drawn).cloned(),
            };
            let pictures = plate.sights.iter().filter_map(shown).collect();
            Some(sheet::Column {
                name: format!("{}: {} triangles, {:.2} ms", row.case.panel.0, row.triangles, row.frame_ms),
                pictures,
            })
        };
        let columns: Vec<sheet::Column> = rows.iter().filter_map(column).collect();
        Ok(if columns.is_empty() { Vec::new() } else { vec![("pictures".to_owned(), sheet(&columns)?)] })
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let late = worst_of(rows, |row| row.case.policy.1.predicts(), |row| row.frame_ms / row.target_ms);
        let mut findings = claims!["frame / T of policies that predict" => late, at_most LONGEST];
        let holes = |policy| worst_of(rows, |row| row.case.policy.1 == policy, |row| f64::from(row.holes));
        if rows.iter().any(|row| row.case.policy.1 == Policy::Hierarchical) {
            findings.extend(claims![
                "objects left out where groups may be drawn as one" => holes(Policy::Hierarchical), at_most 0.0;
                "objects left out where they may not" => holes(Policy::Greedy), at_least 1.0;
            ]);
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
                let changes = [plate.changes, panel.changes].concat();
                let changes: Vec<_> = changes.iter().map(|(key, to)| ((*key).to_owned(), (*to).to_owned())).collect();
                assert!(load(&tiny, &changes).is_ok(), "{}: {changes:?}", plate.name);
            }
        }
    }
}
