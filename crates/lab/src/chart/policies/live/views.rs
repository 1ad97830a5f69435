//! Results of policies in one view: triangles, likeness to full detail, and the pictures themselves (FS93, fig. 10 and 11).
//!
//! In: a view and a policy. Out: a row; a sheet of pictures per view. Never here: paths.
//! Full detail is drawn once per view: its time sets the target of all policies there, and its picture is the reference for theirs.
//! The pictures of the sheets are those of the rows.

use super::super::super::experiment::{Experiment, Finding};
use super::super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel, headings};
use super::super::super::table::Table;
use super::super::played::walk;
use super::super::played::walk::{Still, StillRequest};
use metachron_render::{PictureFile, psnr_db, ssim};
use metachron_scene::papers::Paper;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, PoisonError};

/// The experiment.
pub(in super::super::super) struct Views;

/// A place on a scene's path, and the ratio of full detail's time to the target there.
struct View {
    name: &'static str,
    paper: Paper,
    part: f64,
    times_over: f64,
    policies: &'static [&'static str],
}

const VIEWS: [View; 3] = [
    // FS93, fig. 10: view A, 0.98 s in full, target 0.1 s
    View {
        name: "auditorium-a",
        paper: Paper::Auditorium,
        part: 40.0 / 250.0,
        times_over: 5.0,
        policies: &["full", "static", "threshold", "greedy", "adaptive"],
    },
    // FS93, fig. 11: 0.60 s in full, targets 0.15 s and 0.10 s
    View {
        name: "library-looser",
        paper: Paper::Library,
        part: 0.5,
        times_over: 1.5,
        policies: &["full", "greedy", "adaptive"],
    },
    View {
        name: "library-tighter",
        paper: Paper::Library,
        part: 0.5,
        times_over: 2.0,
        policies: &["full", "greedy", "adaptive"],
    },
];
/// Factor by which differences are brightened.
const BRIGHTER: u16 = 4;
/// Frames drawn of a view, in full and in the quick run; the last half of them counts.
const FRAMES: [usize; 2] = [40, 8];
/// Height of the names above the columns of a sheet, pixels.
const HEADING: u32 = 32;

/// A view and a policy.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super::super) struct Case {
    view: String,
    policy: String,
    frames: usize,
}

/// The pictures drawn in this run of the program.
static DRAWN: Mutex<Vec<(Case, Arc<Still>)>> = Mutex::new(Vec::new());

/// The result of a policy in a view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super::super) struct Row {
    view: String,
    policy: String,
    frames: usize,
    adapter: String,
    target_ms: f64,
    /// The median of the last frames.
    frame_ms: f64,
    triangles: u64,
    ssim: f64,
    psnr_db: f64,
}

/// The picture of a case in this run of the program; drawn now if it was not yet.
fn drawn(case: &Case, target_s: f64) -> Option<Arc<Still>> {
    let known = || DRAWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, still)) = known().iter().find(|(drawn, _)| drawn == case) {
        return Some(Arc::clone(still));
    }
    let view = VIEWS.iter().find(|view| view.name == case.view)?;
    let request = StillRequest { part: view.part, target_s, frames: case.frames };
    let still = Arc::new(walk::still(view.paper, &case.policy, request).ok()?);
    known().push((case.clone(), Arc::clone(&still)));
    Some(still)
}

/// Full detail of a view; its target does not matter.
fn full(case: &Case) -> Option<Arc<Still>> {
    drawn(&Case { policy: "full".to_owned(), ..case.clone() }, 1.0)
}

/// Full detail of a view, the result of a policy, and the target that full detail sets, milliseconds.
fn pair(case: &Case) -> Option<(Arc<Still>, Arc<Still>, f64)> {
    let view = VIEWS.iter().find(|view| view.name == case.view)?;
    let full = full(case)?;
    let target_ms = full.frame_ms / view.times_over;
    let own = drawn(case, 1e-3 * target_ms)?;
    Some((full, own, target_ms))
}

impl Experiment for Views {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = "views";
    const TITLE: &'static str = "one view by every policy: triangles, similarity to full detail, pictures";
    const ALONE: bool = true;

    fn cases(quick: bool) -> Vec<Case> {
        let frames = FRAMES[usize::from(quick)];
        let case = |view: &View, policy: &str| Case { view: view.name.to_owned(), policy: policy.to_owned(), frames };
        VIEWS.iter().flat_map(|view| view.policies.iter().map(move |policy| case(view, policy))).collect()
    }

    fn measure(case: &Case) -> Row {
        let nan = f64::NAN;
        let mut row = Row {
            view: case.view.clone(),
            policy: case.policy.clone(),
            frames: case.frames,
            adapter: String::new(),
            target_ms: nan,
            frame_ms: nan,
            triangles: 0,
            ssim: nan,
            psnr_db: nan,
        };
        if let Some((full, own, target_ms)) = pair(case) {
            row.ssim = ssim(&own.picture, &full.picture).unwrap_or(nan);
            row.psnr_db = psnr_db(&own.picture, &full.picture).unwrap_or(nan).min(walk::ALIKE_DB);
            row.adapter.clone_from(&own.adapter);
            (row.target_ms, row.frame_ms, row.triangles) = (target_ms, own.frame_ms, own.triangles);
        }
        row
    }

    fn case_of(row: &Row) -> Case {
        Case { view: row.view.clone(), policy: row.policy.clone(), frames: row.frames }
    }

    fn figure(rows: &[Row]) -> Figure {
        let panel = |view: &View| {
            let here = || rows.iter().filter(|row| row.view == view.name);
            let most = here().map(|row| row.triangles as f64).fold(1.0, f64::max);
            let least = here().map(|row| row.ssim).fold(1.0, f64::min);
            let dots = here().zip(Colour::LINES.into_iter().cycle()).map(|(row, colour)| Layer {
                label: row.policy.clone(),
                colour,
                mark: Mark::Dots(vec![(row.triangles as f64, row.ssim)]),
            });
            let x = Axis::log("triangles", 100.0, 1.2 * most);
            let y = Axis::linear("SSIM against full detail", (least - 0.02).max(0.0), 1.005);
            Panel { title: view.name.to_owned(), x, y, layers: dots.collect() }
        };
        let title = "Triangles and similarity of one view (FS93, fig. 10 and 11)".to_owned();
        Figure { title, panels: VIEWS.iter().map(panel).collect(), columns: VIEWS.len() }
    }

    fn pictures(rows: &[Row]) -> anyhow::Result<Vec<(String, PictureFile)>> {
        let sheet_of = |view: &View| {
            let here = || rows.iter().filter(|row| row.view == view.name);
            // a row reused from an earlier run is drawn again, under the target stored in it
            let pairs = here().filter_map(|row| {
                let case = Self::case_of(row);
                Some((row.policy.as_str(), full(&case)?, drawn(&case, 1e-3 * row.target_ms)?))
            });
            Ok((view.name.to_owned(), sheet(&pairs.collect::<Vec<_>>())?))
        };
        VIEWS.iter().map(sheet_of).collect()
    }

    fn table(rows: &[Row]) -> Table {
        let mut table = Table::new(&["view", "policy", "T_ms", "frame_ms", "triangles", "ssim", "psnr_db"]);
        table.rows.extend(rows.iter().map(|r| {
            vec![
                r.view.clone().into(),
                r.policy.clone().into(),
                (r.target_ms, 2).into(),
                (r.frame_ms, 2).into(),
                (r.triangles as f64, 0).into(),
                (r.ssim, 4).into(),
                (r.psnr_db, 1).into(),
            ]
        }));
        table
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let lost = |view: &View| {
            let row = rows.iter().find(|row| row.view == view.name && row.policy == "adaptive");
            let claim = format!("adaptive, {}: 1 − SSIM", view.name);
            Finding::at_most(claim, row.map_or(f64::NAN, |row| 1.0 - row.ssim), 0.05)
        };
        VIEWS.iter().map(lost).collect()
    }
}

/// Pictures side by side under the names of their policies, and below each its difference from full detail, brightened.
fn sheet(stills: &[(&str, Arc<Still>, Arc<Still>)]) -> anyhow::Result<PictureFile> {
    let Some((_, first, _)) = stills.first() else { return Ok(PictureFile::new(1, 1)) };
    let (width, height) = first.picture.dimensions();
    let names: Vec<_> = stills.iter().map(|(name, ..)| *name).collect();
    let above = headings(&names, [width, HEADING])?;
    Ok(PictureFile::from_fn(width * stills.len() as u32, HEADING + 2 * height, |x, y| {
        let Some(y) = y.checked_sub(HEADING) else {
            let [r, g, b] = above.get_pixel(x, y).0;
            return [r, g, b, 255].into();
        };
        let (_, full, own) = &stills[(x / width) as usize];
        let (x, row) = (x % width, y / height);
        let Some(pixel) = own.picture.get_pixel_checked(x, y % height) else { return [0, 0, 0, 255].into() };
        let wanted = full.picture.get_pixel_checked(x, y % height).filter(|_| row > 0);
        let Some(wanted) = wanted else { return *pixel };
        let off = |i: usize| (BRIGHTER * u16::from(pixel.0[i].abs_diff(wanted.0[i]))).min(255) as u8;
        [off(0), off(1), off(2), 255].into()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(light: u8) -> Arc<Still> {
        let picture = PictureFile::from_pixel(80, 2, [light, 10, 10, 255].into());
        Arc::new(Still { adapter: String::new(), frame_ms: 1.0, triangles: 1, picture })
    }

    #[test]
    fn a_sheet_has_names_above_pictures_and_below_what_these_lack() {
        let sheet = sheet(&[("", still(50), still(50)), ("greedy", still(50), still(60))]).unwrap();
        assert_eq!(sheet.dimensions(), (160, HEADING + 4));
        let at = |x: u32, y: u32| sheet.get_pixel(x, HEADING + y).0;
        assert_eq!((at(0, 0)[0], at(80, 1)[0]), (50, 60));
        assert_eq!((at(0, 3), at(159, 3)), ([0, 0, 0, 255], [40, 0, 0, 255]));
        let dark = |from: u32| (from..from + 80).flat_map(|x| (0..HEADING).map(move |y| (x, y)));
        let letters = |from: u32| dark(from).filter(|(x, y)| sheet.get_pixel(*x, *y).0[0] < 128).count();
        assert!(letters(0) == 0 && letters(80) > 20, "{} {}", letters(0), letters(80));
    }

    #[test]
    fn quick_and_full_runs_do_not_share_rows() {
        let (long, quick) = (Views::cases(false), Views::cases(true));
        assert_eq!(long.len(), quick.len());
        assert!(long.iter().zip(&quick).all(|(long, quick)| quick.frames < long.frames && quick.view == long.view));
    }
}
