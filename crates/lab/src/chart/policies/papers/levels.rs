//! Gain from levels of groups: woods that may each be drawn as one object, with no level of their own, one, or four (MB97, §4).
//!
//! In: nothing. Out: a row for each setting and policy, all against full detail of the same trees, in lockstep on the declared machine.
//! Never here: how frames are played ([`crate::chart::policies::played`]). Without an adapter everything but the likeness of pictures is measured.

use crate::chart::policies::numeric::{Row, number};
use crate::chart::policies::played;
use crate::chart::policies::played::{Case, Shown, Times, curves, of_frames, walk};
use crate::chart::{Experiment, Figure, Finding, Table, claims, each};
use metachron_lod::control::Policy;
use metachron_session::report::MISS;
use std::fmt::Write;

/// The experiment.
pub(crate) struct Levels;

const POLICIES: [Policy; 2] = [Policy::Adaptive, Policy::Hierarchical];
/// Frames along the path, in full and in the quick run.
const FRAMES: [usize; 2] = [150, 10];
/// Ratios of the mean time of full detail to the target.
const TIMES_OVER: [f64; 3] = [100.0, 200.0, 400.0];
/// A ratio that no cut keeps: everything is in its lowest form, whatever the policy.
const CHEAPEST: f64 = 1e4;
/// The levels of every wood, with the line of its table in the scene file.
const LEVELS: [(&str, &str); 4] =
    [("none", ""), ("20", "levels = [20]"), ("80", "levels = [80]"), ("20 to 160", "levels = [20, 40, 80, 160]")];

/// Woods along x and y, trees of each along x and y, metres between trees and between the centres of woods.
const WOODS: [u32; 2] = [6, 6];
const TREES: [u32; 2] = [5, 5];
const APART_M: (f64, f64) = (7.0, 42.0);

/// The scene: woods in rows, and a path between them from one end to the other, with the eye looking ahead.
fn text(levels: &str) -> String {
    let length_m = f64::from(WOODS[1]) * APART_M.1;
    let mut text = format!(
        "format = 1\n[target]\nframe_hz = 60.0\n[camera]\nfov_deg = 50.0\neven = true\nkeyframe = [\n\
         {{ at_s = 0.0, eye_m = [0, -30, 9], look_at_m = [0, 20, 4] }},\n\
         {{ at_s = 10.0, eye_m = [0, {:?}, 9], look_at_m = [0, {:?}, 4] }},\n]\n",
        0.5 * length_m,
        0.5 * length_m + 50.0,
    );
    for wood in 0..WOODS[0] * WOODS[1] {
        let middle = |k: u32, of: u32| APART_M.1 * (f64::from(k) - 0.5 * f64::from(of - 1));
        let corner = |trees: u32| 0.5 * APART_M.0 * f64::from(trees - 1);
        let x = middle(wood % WOODS[0], WOODS[0]) - corner(TREES[0]);
        let y = 0.5 * length_m + middle(wood / WOODS[0], WOODS[1]) - corner(TREES[1]);
        let _ = write!(
            text,
            "[[object]]\nname = \"tree-{wood}\"\nmodel = \"tree\"\nseed = {}\nheight_m = 8.0\nposition_m = [{x:?}, {y:?}, 0.0]\n\
             grid = [{}, {}, 1]\nspacing_m = [{:?}, {:?}, 0.0]\nscatter_m = [1.5, 1.5, 0.0]\nscatter_seed = {wood}\n",
            wood % 3,
            TREES[0],
            TREES[1],
            APART_M.0,
            APART_M.0,
        );
        if !levels.is_empty() {
            let _ = write!(text, "[[group]]\nname = \"wood-{wood}\"\nmembers = [\"tree-{wood}-*\"]\n{levels}\n");
        }
    }
    text
}

fn setting(name: &str, times_over: f64) -> String {
    format!("levels {name}, full detail / {times_over:.0}")
}

fn settings() -> impl Iterator<Item = (String, &'static str, f64)> {
    let all = TIMES_OVER.into_iter().chain([CHEAPEST]);
    all.flat_map(|over| LEVELS.map(|levels| (setting(levels.0, over), levels.1, over)))
}

/// Of the frames that the cheapest cut keeps, the share that the default is late in; both past 1.05 T.
fn avoidable_misses(rows: &[Row], levels: &str, over: f64) -> f64 {
    let times = |ratio: f64| {
        let row = rows.iter().find(|row| row.setting == setting(levels, ratio) && row.policy == "adaptive");
        row.into_iter().flat_map(|row| of_frames(&row.times, 0)).map(move |(_, time)| time * over / ratio)
    };
    let kept: Vec<f64> = times(over).zip(times(CHEAPEST)).filter(|(_, least)| *least <= MISS).map(|it| it.0).collect();
    kept.iter().filter(|time| **time > MISS).count() as f64 / kept.len() as f64
}

impl Experiment for Levels {
    type Row = Row;
    const NAME: &'static str = "levels";
    const TITLE: &'static str = "impostors for whole woods: benefit of levels of groups";
    const TABLE: fn(&[Row]) -> Table = played::table;

    fn cases(quick: bool) -> Vec<Case> {
        let frames = FRAMES[usize::from(quick)];
        let policies = |over: f64| if over < CHEAPEST { &POLICIES[..] } else { &POLICIES[..1] };
        each!((setting, _, over) in settings(), policy in policies(over) => Case::new(&setting, policy.name(), frames))
    }

    fn measure(case: &Case) -> Option<Row> {
        let (_, levels, times_over) = settings().find(|setting| setting.0 == case.setting)?;
        Some(walk::measure(&Shown { name: "woods", text: &text(levels), times_over }, case, Times::Declared))
    }

    fn figure(rows: &[Row]) -> Figure {
        let panel = |over: f64| {
            let here = LEVELS.map(|(name, _)| setting(name, over));
            curves(
                &format!("full detail / {over:.0}"),
                rows.iter().filter(|row| row.policy == "adaptive" && here.contains(&row.setting)),
            )
        };
        Figure::new("Levels of groups", 3, TIMES_OVER.map(panel).to_vec())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let claims = |over: f64| {
            let of =
                |levels: usize, what: fn(&Row) -> f64| number(rows, &setting(LEVELS[levels].0, over), "adaptive", what);
            let single = f64::max(of(1, |row| row.ssim), of(2, |row| row.ssim));
            claims![
                "adaptive, four levels, full detail / {over:.0}: frames past 1.05 T, of those that the cheapest cut keeps" =>
                    avoidable_misses(rows, LEVELS[3].0, over), at_most 0.01;
                "adaptive, four levels, full detail / {over:.0}: objects left out" => of(3, |row| row.holes), at_most 0.0;
                "adaptive, four levels, full detail / {over:.0}: SSIM minus the better single level's" =>
                    of(3, |row| row.ssim) - single, at_least -0.01;
            ]
        };
        TIMES_OVER.into_iter().flat_map(claims).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_scene::{Source, load};

    #[test]
    fn the_woods_are_a_scene_and_their_groups_hold_all_of_it() {
        // without groups: building the groups' meshes takes seconds in a debug build
        let source = Source::memory("woods", text("").as_bytes()).unwrap();
        let scene = load(&source, &[]).unwrap_or_else(|why| panic!("{:?}", why.problems));
        assert_eq!(scene.scenery.len(), 2 * 900);
        let grouped = text("levels = [20]");
        assert_eq!(grouped.matches("[[group]]").count(), 36);
        let members = grouped.lines().filter_map(|line| line.strip_prefix("members = [\"")?.strip_suffix("*\"]"));
        let held: usize =
            members.map(|start| scene.scenery.iter().filter(|it| it.name.starts_with(start)).count()).sum();
        assert_eq!(held, 2 * 900);
    }
}
