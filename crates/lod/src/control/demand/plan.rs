//! The result of control for a frame: a level for every object, and the promise of the choice.
//!
//! In: nothing; data types only. Out: [`Plan`], and [`FrameWork`] as its measurement. Never here: a choice.

use super::level;
use super::level::Span;
use super::query::Promise;
use super::view::{ObjectView, Shading};
use metachron_core::{AgentId, Resolution};
use std::time::Duration;

/// Measured times of the last frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameWork {
    /// The work of the frame: gather, choose, draw. Without any wait for a display or for the frame's time to come.
    pub work: Duration,
    /// The part of it spent drawing the picture, which levels affect; `work` at most.
    pub draw: Duration,
    /// Logic done elsewhere while it was drawn: the next choice, and the share of each core that agents' steps took.
    pub beside: Duration,
    /// Whether the frame must not be used for learning: one of the first three, one with a new size or a new pipeline, a hidden window, the
    /// first after a gap of more than five frames.
    pub skip: bool,
}

/// The level to draw one object with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelDemand {
    /// Id of the object.
    pub id: AgentId,
    /// The pair (ε, n), inside the object's range; for a group n is the number of its impostor, or one past the last for its members.
    pub resolution: Resolution,
    /// Triangles to draw it with, exact for kinds with a free triangle count. 0: left out of the picture, as are members of a group that is
    /// drawn by an impostor, and groups that are drawn as their members. Out of view: its coarsest, for its shadow.
    pub polygons: f64,
    /// Shading to draw it with.
    pub shading: Shading,
}

/// How the objects of a picture are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Triangles that are not strokes.
    pub triangles: f64,
    /// Pieces drawn as points, and as lines (RH05, §6).
    pub strokes: [f64; 2],
    /// Objects by their shading, cheapest first, groups that are drawn by an impostor among them.
    pub shadings: [u32; 5],
}

impl Tally {
    /// Counts the objects in view; both in the same order.
    #[must_use]
    pub fn of(views: &[ObjectView], levels: &[LevelDemand]) -> Self {
        let mut tally = Self::default();
        for (view, level) in views.iter().zip(levels).filter(|(view, level)| view.visible && level.polygons > 0.0) {
            tally.shadings[level.shading as usize] += 1;
            let Some(pieces) = view.pieces else {
                tally.triangles += level.polygons;
                continue;
            };
            let parts = pieces.parts(level.polygons);
            tally.triangles += parts.full;
            tally.strokes[pieces.stroke as usize] += parts.strokes / f64::from(pieces.least.max(1));
        }
        tally
    }
}

/// Position of the level in the object's range: 0 its coarsest … 1 its finest, by the logarithm of its triangles; for a group by its
/// levels, of which the members are the finest.
#[must_use]
pub fn detail(view: &ObjectView, demand: &LevelDemand) -> f64 {
    if view.is_group() {
        return f64::from(demand.resolution.n) / f64::from(level::open(view).max(1));
    }
    let span = Span::of(view);
    let part = libm::log(demand.polygons / span.least) / libm::log(span.full / span.least);
    if part.is_nan() { 1.0 } else { part.clamp(0.0, 1.0) }
}

/// The levels for the next frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// One entry for each object, in the order they were given.
    pub levels: Vec<LevelDemand>,
    /// Triangles of everything in view.
    pub polygons: f64,
    /// Triangles of everything in view at its finest, as the policy `full` would draw it.
    pub full_polygons: f64,
    /// The promise of the choice; zeros if the policy predicts nothing.
    pub promise: Promise,
    /// Objects in view whose level differs from the frame before.
    pub changes: u32,
    /// Of these, objects that are back at a level of two or three frames before.
    pub reversals: u32,
}

/// An object as the camera sees it, with its range of polygons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SizedView {
    pub view: ObjectView,
    pub span: Span,
}

impl SizedView {
    pub fn of(view: ObjectView) -> Self {
        Self { view, span: Span::of(&view) }
    }
}

/// The objects in view.
pub(crate) fn in_view(views: &[SizedView]) -> impl Iterator<Item = &SizedView> + Clone {
    views.iter().filter(|seen| seen.view.visible)
}

/// Whether anything in view can be drawn in more than one way.
pub(crate) fn steers(views: &[SizedView]) -> bool {
    in_view(views).any(|SizedView { view, span }| span.most > span.least || view.shading.0 < view.shading.1)
}
