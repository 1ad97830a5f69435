//! What control says of a frame: a level for every object, and what the choice promises.
//!
//! In: nothing but words. Out: [`Plan`], and [`FrameWork`] that answers it. Never here: a choice.

use super::ask::Promise;
use super::level::{self, Span};
use super::view::{ObjectView, Shading};
use metachron_core::{AgentId, Resolution};
use std::time::Duration;

/// What the last frame took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameWork {
    /// The work of the frame: gather, choose, draw. Without any wait for a display or for the frame's time to come.
    pub work: Duration,
    /// Of it the drawing of the picture, which is what levels change; `work` at most.
    pub draw: Duration,
    /// Whether the frame must not teach: one of the first three, one with a new size or a new pipeline, a hidden window,
    /// the first after a gap of more than five frames.
    pub skip: bool,
}

/// What to draw one object with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelDemand {
    /// Which one.
    pub id: AgentId,
    /// Its pair (ε, n), inside its range; of a group n is the number of its impostor, past the last its members.
    pub resolution: Resolution,
    /// Triangles to draw it with: of what is cut by triangles exactly so many. 0: it is left out of the picture, as members of a group
    /// are that is drawn by an impostor, and groups that are drawn as their members. Out of sight: its coarsest, for its shadow.
    pub polygons: f64,
    /// How to shade it.
    pub shading: Shading,
}

/// How much of what it can have an object is drawn with: 0 its coarsest … 1 its finest, by the logarithm of its triangles; of a group
/// by its levels, of which its members are the finest.
#[must_use]
pub fn detail(view: &ObjectView, demand: &LevelDemand) -> f64 {
    if view.is_group() {
        return f64::from(demand.resolution.n) / f64::from(level::open(view).max(1));
    }
    let span = Span::of(view);
    let part = libm::log(demand.polygons / span.least) / libm::log(span.full / span.least);
    if part.is_nan() { 1.0 } else { part.clamp(0.0, 1.0) }
}

/// What to draw the next frame with.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// One entry for each object, in the order they were given.
    pub levels: Vec<LevelDemand>,
    /// Triangles of everything in view.
    pub polygons: f64,
    /// Triangles of everything in view at its finest: what the policy `full` would draw.
    pub full_polygons: f64,
    /// What the choice promises; zeros where the policy predicts nothing.
    pub promise: Promise,
    /// Objects in view whose level is another than in the frame before.
    pub changes: u32,
    /// Of these, objects that are back at a level which they had two or three frames before.
    pub reversals: u32,
}

/// An object and the polygons that it can have.
pub(super) type Seen = (ObjectView, Span);

/// Those in view.
pub(super) fn in_view(views: &[Seen]) -> impl Iterator<Item = &Seen> + Clone {
    views.iter().filter(|(view, _)| view.visible)
}

/// Whether anything in view can be drawn in more than one way.
pub(super) fn steers(views: &[Seen]) -> bool {
    in_view(views).any(|(view, span)| span.most > span.least || view.shading.0 < view.shading.1)
}
