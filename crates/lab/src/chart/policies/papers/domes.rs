//! Domes of struts that turn, approach and recede, with or without a coarse ball for a group (MB97, §8).

use crate::chart::policies::numeric::{DOMES, STRUTS, geodesic, mean};
use crate::chart::{
    Axis, Experiment, Figure, Finding, Measured, Named, Panel, Table, claims, each, lines, number_of, table,
};
use metachron_lod::select::incremental::Keep;
use metachron_lod::select::tree::{Node, Tree};
use metachron_lod::select::{Entry, Level, Mode, Problem, funkhouser, mason, mason_flat, tree_exact};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct Domes;

const FRAMES: usize = 240;
const QUICK_FRAMES: usize = 24;
/// Limits of cost: half of the nominal cost, all of it and twice: 8 domes of 120 struts at 4 each cost 3840.
const LIMITS: [i64; 3] = [1920, 3840, 7680];
/// Costs of a strut's levels: the sides of a prism.
const SIDES: [u64; 6] = [4, 6, 8, 12, 16, 24];
/// Cost of the coarse ball that replaces a dome.
const BALL_COST: u64 = 20;
/// Benefit of a ball per pixel of its dome: less than that of the coarsest struts, of which it shows only the outline.
const BALL_WORTH: f64 = 0.3;
/// Units of benefit per pixel.
const BENEFIT: f64 = 100.0;

/// The selection algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Algorithm {
    /// (FS93) with a null impostor for each strut, no groups.
    Flat,
    /// (MB97, §4) from the last frame's cut.
    Hierarchical,
    /// (MB97, §6).
    HierarchicalFlat,
    /// The best vertex of the hull of all cuts: our own on trees.
    Hull,
}

const POLICIES: [Named<Algorithm>; 4] = [
    Named("greedy with null", Algorithm::Flat),
    Named("hierarchical", Algorithm::Hierarchical),
    Named("hierarchical-flat", Algorithm::HierarchicalFlat),
    Named("hull of cuts", Algorithm::Hull),
];

/// A limit and a policy.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    limit: i64,
    policy: Named<Algorithm>,
    frames: usize,
}

/// Results of a limit and a policy, means over the frames.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Share of struts that are drawn neither as prisms nor by a ball.
    holes: f64,
    /// Wrong pixels, as a share of the pixels under the struts.
    error: f64,
    /// Changes of level from frame to frame, per strut.
    changes: f64,
    spent: f64,
    /// Share of domes that are drawn as balls.
    balls: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for Domes {
    type Row = Row;
    const NAME: &'static str = "domes";
    const TITLE: &'static str =
        "eight domes of 120 struts at half, one and two times the nominal cost: groups or holes";
    const TABLE: fn(&[Row]) -> Table = table!(|r| limit: r.case.limit, policy: r.case.policy, holes(4): r.holes,
        error(4): r.error, balls(4): r.balls, changes(4): r.changes, spent(4): r.spent);

    fn cases(quick: bool) -> Vec<Case> {
        let frames = if quick { QUICK_FRAMES } else { FRAMES };
        each!(limit in LIMITS, policy in POLICIES => Case { limit, policy, frames })
    }

    fn measure(case: &Case) -> Option<Found> {
        let (mut last, mut shown): (Vec<Level>, Vec<StrutForm>) = (Vec::new(), Vec::new());
        let mut sums: [Vec<f64>; 5] = Default::default();
        for frame in 0..case.frames {
            let pixels = geodesic::pixels(frame);
            let (now, spent) = choose(case.policy.1, case.limit, &pixels, &mut last);
            let changed = now.iter().zip(&shown).filter(|(a, b)| a != b).count() as f64 / now.len() as f64;
            let count = |what: StrutForm| now.iter().filter(|s| **s == what).count() as f64 / now.len() as f64;
            let of_frame = [
                count(StrutForm::Hole),
                error(&now, &pixels),
                changed,
                spent / case.limit as f64,
                count(StrutForm::Ball),
            ];
            sums.iter_mut().zip(of_frame).for_each(|(sum, x)| sum.push(x));
            shown = now;
        }
        let [holes, error, changes, spent, balls] = sums.map(|s| mean(&s));
        Some(Found { holes, error, changes, spent, balls })
    }

    fn figure(rows: &[Row]) -> Figure {
        let panel = |title: &str, label, of: fn(&Row) -> f64| {
            let points = |name| {
                let here = rows.iter().filter(move |r| r.case.policy.0 == name);
                here.map(move |r| (r.case.limit as f64, of(r)))
            };
            let x = Axis::log("limit of cost", 1500.0, 10_000.0);
            Panel::new(title, x, Axis::linear(label, 0.0, 1.0), lines(POLICIES.map(|policy| policy.0), points))
        };
        let panels = vec![
            panel("holes", "fraction of struts not drawn", |r| r.holes),
            panel("image error", "wrong pixels / pixels of struts", |r| r.error),
        ];
        Figure::new("Domes of struts (MB97, fig. 7)", 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |limit: i64, policy: &str, what: fn(&Row) -> f64| {
            number_of(rows, |r| r.case.limit == limit && r.case.policy.0 == policy, what)
        };
        let holes =
            |limit| claims!["hierarchical at {limit}: holes" => of(limit, "hierarchical", |r| r.holes), at_most 0.0];
        let error = |limit| {
            let ratio = of(limit, "hierarchical", |r| r.error) / of(limit, "greedy with null", |r| r.error);
            claims!["image error at {limit}, hierarchical over flat: < 1" => ratio, at_most 1.0]
        };
        LIMITS.into_iter().flat_map(holes).chain(LIMITS[..2].iter().flat_map(|&limit| error(limit))).collect()
    }
}

/// The form in which a strut is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StrutForm {
    Hole,
    Ball,
    /// A prism, of this level.
    Prism(u32),
}

/// Chooses the form of every strut; returns the forms and their cost. `last` is the cut of the previous frame.
fn choose(algorithm: Algorithm, limit: i64, pixels: &[f64], last: &mut Vec<Level>) -> (Vec<StrutForm>, f64) {
    if algorithm == Algorithm::Flat {
        let mut problem = Problem::new(Mode::AtMostOne, limit);
        for (id, px) in (0..).zip(pixels) {
            problem.push(id, &pictures(*px));
        }
        let selection = funkhouser::greedy(&problem, funkhouser::Scan::Skip);
        let shown = selection.levels.iter().map(|l| l.map_or(StrutForm::Hole, StrutForm::Prism)).collect();
        return (shown, selection.cost as f64);
    }
    let Ok(tree) = Tree::new(limit, &nodes(pixels)) else { return (Vec::new(), f64::NAN) };
    let cut = match algorithm {
        Algorithm::Hull => tree_exact::lagrange(&tree),
        Algorithm::HierarchicalFlat => mason_flat::flat(&tree),
        Algorithm::Hierarchical | Algorithm::Flat => mason::incremental(&tree, last, Keep::Last).cut,
    };
    let shown = (0..DOMES * STRUTS)
        .map(|strut| match (cut.levels[1 + strut / STRUTS], cut.levels[1 + DOMES + strut]) {
            (Some(_), _) => StrutForm::Ball,
            (None, Some(level)) => StrutForm::Prism(level),
            (None, None) => StrutForm::Hole,
        })
        .collect();
    last.clone_from(&cut.levels);
    (shown, cut.cost as f64)
}

/// The tree: the scene, its domes with a ball each, their struts.
fn nodes(pixels: &[f64]) -> Vec<Node> {
    let root = Node { parent: None, impostors: Vec::new() };
    let ball = |dome: usize| {
        let all: f64 = pixels[dome * STRUTS..(dome + 1) * STRUTS].iter().sum();
        // benefit per cost above that of its struts, benefit below theirs (MB97, §3)
        let worth = Entry::new(BALL_COST, (BENEFIT * BALL_WORTH * all) as u64);
        Node { parent: Some(0), impostors: vec![worth] }
    };
    let strut = |i: usize| Node { parent: Some(1 + i / STRUTS), impostors: pictures(pixels[i]).to_vec() };
    std::iter::once(root).chain((0..DOMES).map(ball)).chain((0..pixels.len()).map(strut)).collect()
}

/// The levels of a strut that covers so many pixels; their benefit is the pixels drawn right.
fn pictures(pixels: f64) -> [Entry; 6] {
    SIDES.map(|sides| Entry::new(sides, (BENEFIT * pixels * (1.0 - geodesic::prism_error(sides as f64))) as u64))
}

/// Wrong pixels, as a share of the pixels under the struts: for a prism the part that it lacks of the circle, for a
/// ball the part that it fills between the struts, for a hole all of them.
fn error(shown: &[StrutForm], pixels: &[f64]) -> f64 {
    let wrong = |(shown, px): (&StrutForm, &f64)| match shown {
        StrutForm::Hole => *px,
        StrutForm::Ball => px * geodesic::ball_error(),
        StrutForm::Prism(level) => px * geodesic::prism_error(SIDES[*level as usize] as f64),
    };
    shown.iter().zip(pixels).map(wrong).sum::<f64>() / pixels.iter().sum::<f64>()
}
