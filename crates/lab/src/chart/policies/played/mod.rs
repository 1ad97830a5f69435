//! The papers' actual scenes, played through the program's own frame loop: every policy on every scene, the same frames for all.
//!
//! In: a scene, a policy, the source of times. Out: a row of [`Row`]. Never here: a model of a scene.

mod row;
pub(super) mod still;
pub(super) mod walk;

pub(super) use super::numeric::common::Case;
use super::numeric::metrics::Row;
use crate::chart::{Axis, Colour, Layer, Panel};
use metachron_lod::control::Policy;
use metachron_scene::papers::{Choices, Paper};
pub(super) use row::{of_frames, table};
pub(super) use walk::{Shown, Times};

/// A scene, its frames, and the ratio of full detail's time to the target.
#[derive(Debug, Clone, Copy)]
pub(super) struct Play {
    pub(super) paper: Paper,
    /// Frames along the path, in full and in the quick run.
    frames: [usize; 2],
    /// Mean time of full detail over the target.
    times_over: f64,
}

/// In (FS93, table 1) full detail takes 4.3 targets on average and 9.9 at most.
pub(super) const PLAYS: [Play; 5] = [
    Play { paper: Paper::Auditorium, frames: [250, 25], times_over: 4.3 },
    Play { paper: Paper::Grove, frames: [250, 25], times_over: 20.0 },
    Play { paper: Paper::Domes, frames: [240, 24], times_over: 2.5 },
    Play { paper: Paper::Walkthrough, frames: [200, 20], times_over: 4.0 },
    Play { paper: Paper::Library, frames: [60, 10], times_over: 2.5 },
];

impl Case {
    /// Measures the row; one without frames where the case could not be played.
    pub(super) fn play(&self, times: Times) -> Option<Row> {
        let play = PLAYS.iter().find(|play| play.paper.name() == self.setting)?;
        let row = walk::measure(&play.shown(&play.paper.text(&Choices::default())), self, times);
        Some(Row { asked: self.frames, round: self.round, ..row })
    }
}

impl Play {
    fn shown<'a>(&self, text: &'a str) -> Shown<'a> {
        Shown { name: self.paper.name(), text, times_over: self.times_over }
    }

    /// One case for every policy of the program in one round.
    pub(super) fn cases(&self, quick: bool, round: usize) -> impl Iterator<Item = Case> {
        let (setting, frames) = (self.paper.name(), self.frames[usize::from(quick)]);
        Policy::ALL.into_iter().map(move |policy| Case { round, ..Case::new(setting, policy.name(), frames) })
    }
}

/// The time of every frame, for some of a scene's rows.
pub(super) fn curves<'a>(title: &str, rows: impl Iterator<Item = &'a Row> + Clone) -> Panel {
    let frames = rows.clone().map(|row| row.frames).max().unwrap_or(1) as f64;
    let greatest = rows.clone().map(|row| row.max).fold(1.5, f64::max);
    let line = |(row, colour): (&'a Row, Colour)| Layer::line(&row.policy, colour, row::of_frames(&row.times, 0));
    let drawn = rows.zip(Colour::LINES.into_iter().cycle()).map(line);
    let (x, y) = (Axis::linear("frame", 0.0, frames), Axis::linear("time of a frame / target", 0.0, 1.05 * greatest));
    Panel::new(title, x, y, [Layer::limit("target", [0.0, frames], 1.0)].into_iter().chain(drawn))
}

/// Triangles, lines and points of every frame of a row (RH05, fig. 6).
pub(super) fn primitives(row: &Row) -> Panel {
    let counts = [0, 1, 2].map(|kind| row::of_frames(&row.primitives, kind).collect::<Vec<_>>());
    let most = counts.iter().flatten().map(|(_, count)| *count).fold(1.0, f64::max);
    let named = ["triangles", "lines", "points"].into_iter().zip(Colour::LINES).zip(counts);
    let layers = named.map(|((name, colour), points)| Layer::line(name, colour, points));
    let (x, y) = (Axis::linear("frame", 0.0, row.frames as f64), Axis::linear("primitives", 0.0, 1.05 * most));
    Panel::new(format!("{}: primitives, {}", row.setting, row.policy), x, y, layers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Cell, Table};
    use metachron_render::Gpu;

    fn row(scene: &str, policy: Policy) -> Row {
        Case::new(scene, policy.name(), 6).play(Times::Declared).unwrap()
    }

    #[test]
    fn a_policy_plays_a_scene_to_the_bit_and_every_number_is_there() {
        let policies = [Policy::RobinHood, Policy::Adaptive];
        let rows = policies.map(|policy| row("library", policy));
        for (row, again) in rows.iter().zip(policies.map(|policy| self::row("library", policy))) {
            // NaN is not equal to itself, so the rows are compared as text
            assert_eq!(format!("{row:?}"), format!("{again:?}"));
            assert_eq!((row.frames, row::of_frames(&row.times, 0).count(), row.setting.as_str()), (6, 6, "library"));
        }
        let drawn = Gpu::headless().is_ok();
        for row in &rows {
            let Table { columns, rows } = table(std::slice::from_ref(row));
            let is_nan = |cell: &Cell| matches!(cell, Cell::Number(value, _) if value.is_nan());
            let unknown: Vec<_> =
                columns.iter().zip(&rows[0]).filter(|(_, cell)| is_nan(cell)).map(|(name, _)| name.as_str()).collect();
            // only a policy with a bound has `value` and `proven`, and only measured times have a spread
            let mut expected = vec!["spread95"];
            expected.extend(["value", "proven"].iter().filter(|_| row.policy == "robin-hood"));
            expected.extend(["ssim", "ssim_least", "flip", "psnr_db"].iter().filter(|_| !drawn));
            assert_eq!(unknown, expected, "{}", row.policy);
        }
    }

    #[test]
    fn full_detail_takes_the_target_so_many_times_and_is_like_itself() {
        let full = row("library", Policy::Full);
        let [triangles, lines, points] =
            [0, 1, 2].map(|kind| row::of_frames(&full.primitives, kind).map(|(_, n)| n).collect::<Vec<_>>());
        // 19,800 triangles are the whole library, walls and what is out of view apart; it has neither boughs nor leaves
        assert!(triangles.len() == 6 && triangles.iter().all(|n| (5000.0..25_000.0).contains(n)), "{triangles:?}");
        assert_eq!((lines, points), (vec![0.0; 6], vec![0.0; 6]));
        assert!((full.mean - 2.5).abs() < 1e-9 && full.holes == 0.0 && full.changes == 0.0, "{full:?}");
        assert!(full.adapter.is_empty() || (full.ssim - 1.0).abs() < 1e-12, "{}", full.ssim);
    }
}
