//! What policies make of one view: its triangles, its likeness to full detail, and the pictures themselves (FS93, fig. 10 and 11).
//!
//! In: a view and a policy. Out: a row; a sheet of pictures a view. Never here: paths.

use super::super::super::experiment::{Experiment, Finding};
use super::super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel};
use super::super::super::table::Table;
use super::super::played::walk::{self, Still};
use crate::compositor::{PictureFile, psnr_db, ssim};
use crate::scene::papers::Paper;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super::super) struct Views;

/// A place on a scene's path, and how many targets full detail takes there.
struct View {
    name: &'static str,
    paper: Paper,
    part: f64,
    times_over: f64,
    policies: &'static [&'static str],
}

const VIEWS: [View; 3] = [
    // FS93, fig. 10: view A, 0.98 s in full, 0.1 s wanted
    View {
        name: "auditorium-a",
        paper: Paper::Auditorium,
        part: 40.0 / 250.0,
        times_over: 5.0,
        policies: &["full", "static", "threshold", "greedy", "adaptive"],
    },
    // FS93, fig. 11: 0.60 s in full, 0.15 s and 0.10 s wanted
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
/// Differences are shown so many times as bright.
const BRIGHTER: u16 = 4;

/// A view and a policy.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super::super) struct Case {
    view: String,
    policy: String,
}

/// What a policy made of a view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super::super) struct Row {
    view: String,
    policy: String,
    adapter: String,
    target_ms: f64,
    /// The median of the last frames.
    frame_ms: f64,
    triangles: u64,
    ssim: f64,
    psnr_db: f64,
}

/// Full detail of a view, and what a policy makes of it.
fn pair(case: &Case) -> Option<(Still, Still)> {
    let view = VIEWS.iter().find(|view| view.name == case.view)?;
    let full = walk::still(view.paper, view.part, "full", 1.0).ok()?;
    let target_s = 1e-3 * full.frame_ms / view.times_over;
    let own = walk::still(view.paper, view.part, &case.policy, target_s).ok()?;
    Some((full, own))
}

impl Experiment for Views {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = "views";
    const TITLE: &'static str = "what policies make of one view: triangles, likeness to full detail, pictures";
    const ALONE: bool = true;

    fn cases(_: bool) -> Vec<Case> {
        let of = |view: &View| {
            let name = view.name.to_owned();
            view.policies
                .iter()
                .map(move |&policy| Case { view: name.clone(), policy: policy.to_owned() })
                .collect::<Vec<_>>()
        };
        VIEWS.iter().flat_map(of).collect()
    }

    fn measure(case: &Case) -> Row {
        let (view, policy) = (case.view.clone(), case.policy.clone());
        let nan = f64::NAN;
        let Some((full, own)) = pair(case) else {
            let adapter = String::new();
            return Row { view, policy, adapter, target_ms: nan, frame_ms: nan, triangles: 0, ssim: nan, psnr_db: nan };
        };
        Row {
            view,
            policy,
            ssim: ssim(&own.picture, &full.picture).unwrap_or(nan),
            psnr_db: psnr_db(&own.picture, &full.picture).unwrap_or(nan).min(walk::ALIKE_DB),
            adapter: own.adapter,
            target_ms: 1e3 * own.target_s,
            frame_ms: own.frame_ms,
            triangles: own.triangles,
        }
    }

    fn case_of(row: &Row) -> Case {
        Case { view: row.view.clone(), policy: row.policy.clone() }
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
        let title = "Triangles and likeness of one view (FS93, fig. 10 and 11)".to_owned();
        Figure { title, panels: VIEWS.iter().map(panel).collect(), columns: VIEWS.len() }
    }

    fn pictures(rows: &[Row]) -> Vec<(String, PictureFile)> {
        let sheet_of = |view: &View| {
            let cases = rows.iter().filter(|row| row.view == view.name).map(Self::case_of);
            let stills: Vec<_> =
                cases.filter_map(|case| pair(&case)).map(|(full, own)| (full.picture, own.picture)).collect();
            (view.name.to_owned(), sheet(&stills))
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

/// Pictures side by side, and below each how it differs from full detail, brightened.
fn sheet(stills: &[(PictureFile, PictureFile)]) -> PictureFile {
    let Some((first, _)) = stills.first() else { return PictureFile::new(1, 1) };
    let (width, height) = first.dimensions();
    PictureFile::from_fn(width * stills.len() as u32, 2 * height, |x, y| {
        let (full, own) = &stills[(x / width) as usize];
        let (x, row) = (x % width, y / height);
        let Some(pixel) = own.get_pixel_checked(x, y % height) else { return [0, 0, 0, 255].into() };
        let Some(wanted) = full.get_pixel_checked(x, y % height).filter(|_| row > 0) else { return *pixel };
        let off = |i: usize| (BRIGHTER * u16::from(pixel.0[i].abs_diff(wanted.0[i]))).min(255) as u8;
        [off(0), off(1), off(2), 255].into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_pictures_above_and_what_they_lack_below() {
        let of = |light: u8| PictureFile::from_pixel(3, 2, [light, 10, 10, 255].into());
        let sheet = sheet(&[(of(50), of(50)), (of(50), of(60))]);
        assert_eq!(sheet.dimensions(), (6, 4));
        assert_eq!((sheet.get_pixel(0, 0).0[0], sheet.get_pixel(5, 1).0[0]), (50, 60));
        assert_eq!((sheet.get_pixel(0, 3).0, sheet.get_pixel(5, 3).0), ([0, 0, 0, 255], [40, 0, 0, 255]));
    }
}
