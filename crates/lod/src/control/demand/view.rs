//! Input of control about the objects: their kind, and their appearance to the camera.
//!
//! In: plain numbers. Out: the weight by which an object shares in the picture's polygons. Never here: state.

use super::level::{IMPOSTORS_MAX, PRIMITIVE_LEVELS};
pub use metachron_core::kinds::Shading;
use metachron_core::{AgentId, ResolutionRange};

metachron_core::choices! {
    /// The cheap form of the pieces of an object (RH05, §6), in the order of their prices.
    pub enum Stroke {
        /// A point: the leaves of a tree.
        Point = "points",
        /// A line: its boughs.
        Line = "lines",
    }
}

/// The pieces of an object that are drawn as strokes where its triangles do not suffice for all of them in full: of n pieces p strokes up to
/// p = n, past it p − n pieces in full and 2n − p strokes (RH05, §6.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pieces {
    /// The stroke as which a piece is drawn where it is not drawn in full.
    pub stroke: Stroke,
    /// How many there are, ≥ 1.
    pub count: u32,
    /// Triangles of a stroke, ≥ 1.
    pub least: u32,
    /// Triangles of a piece in full, > `least`.
    pub full: u32,
}

/// An object's triangles by how they are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Parts {
    /// Triangles of the strokes.
    pub strokes: f64,
    /// Triangles of the pieces that are drawn in full.
    pub full: f64,
    /// The part of the pieces drawn that are strokes, 0 … 1.
    pub stroked: f64,
}

impl Pieces {
    /// The parts as which `polygons` triangles are drawn.
    pub(crate) fn parts(&self, polygons: f64) -> Parts {
        let [count, least, full] = [self.count.max(1), self.least.max(1), self.full.max(self.least + 1)].map(f64::from);
        let in_full = ((polygons - least * count) / (full - least)).clamp(0.0, count);
        let strokes = ((polygons - full * in_full) / least).clamp(0.0, count - in_full);
        let drawn = strokes + in_full;
        let stroked = if drawn > 0.0 { strokes / drawn } else { 1.0 };
        Parts { strokes: least * strokes, full: full * in_full, stroked }
    }
}

/// Forms of a mesh of which the loss is measured.
pub const FORMS: usize = 9;

/// What is measured to be lost of a mesh, or of the mesh that the impostors of a group are cut from, as parts of its pixels (budget.md,
/// eq. 47a).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses {
    /// Where it is drawn with fewer triangles: from the fewest to all in equal ratios; ≥ 0.
    pub forms: [f32; FORMS],
    /// The fewest triangles and all, ≥ 1.
    pub range: (u32, u32),
    /// Where it is drawn without its texture, 0 … 1.
    pub texture: f32,
}

impl Losses {
    /// That of a form of so many triangles: on the line between the forms beside it.
    pub(crate) fn of_form(&self, polygons: f64) -> f64 {
        let (least, most) = (f64::from(self.range.0.max(1)), f64::from(self.range.1));
        let last = FORMS - 1;
        let place = libm::log(polygons / least) / libm::log(most / least) * last as f64;
        let place = if place >= 0.0 { place.min(last as f64) } else { 0.0 };
        let before = (place as usize).min(last - 1);
        let [coarser, finer] = [before, before + 1].map(|form| f64::from(self.forms[form]));
        coarser + (finer - coarser) * (place - before as f64)
    }
}

/// The kind of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A tube: patches of 12·2ⁿ triangles, one for each interval ε of its length.
    Tube {
        /// Rest length, metres, > 0.
        length_m: f64,
        /// Mean radius, metres, > 0.
        radius_m: f64,
    },
    /// A shape with one mesh per level.
    Primitive {
        /// Radius of a bounding ball, metres, > 0.
        radius_m: f64,
        /// Triangles at each level n; rising, or constant from some level on.
        triangles: [u32; PRIMITIVE_LEVELS],
    },
    /// A mesh that can be drawn with any number of triangles.
    Counted {
        /// Radius of a bounding ball, metres, > 0.
        radius_m: f64,
        /// The fewest triangles to draw it with, ≥ 1.
        least: u32,
        /// All its triangles, ≥ `least`.
        most: u32,
    },
    /// Objects that can be drawn as one: at n = 0, 1 … by an impostor, at n past the last of them as themselves.
    Group {
        /// Radius of a bounding ball, metres, > 0.
        radius_m: f64,
        /// Triangles of its impostors, rising; 0 past the last.
        impostors: [u32; IMPOSTORS_MAX],
    },
}

/// An object as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectView {
    /// Id under which the object's level is stored from frame to frame.
    pub id: AgentId,
    /// The kind of the object.
    pub kind: Kind,
    /// The number of the group that it is in, among the objects given with it: a group comes after all that is in it.
    pub group: Option<usize>,
    /// Its pieces, if it is drawn by strokes; `None` for an object that is drawn by triangles alone.
    pub pieces: Option<Pieces>,
    /// What its coarser forms lose, where that was measured.
    pub losses: Option<Losses>,
    /// The pairs (ε, n) allowed for the picture. For a primitive only n counts; for a mesh with a free triangle count or a group, neither.
    pub range: ResolutionRange,
    /// The cheapest and the best shading allowed, equal if it is fixed.
    pub shading: (Shading, Shading),
    /// Covered area, pixels, ≥ 0. No object gets more than one triangle per pixel.
    pub pixels: f64,
    /// Distance of its centre from the eye, metres, > 0.
    pub distance_m: f64,
    /// Speed across the picture, pixels per second, ≥ 0, with the motion of the camera.
    pub speed_px_s: f64,
    /// The same as a camera at rest sees it.
    pub own_speed_px_s: f64,
    /// Weight against the others, > 0; 1 is usual.
    pub importance: f64,
    /// Distance of its centre from the middle of the picture, as a fraction of half the diagonal, ≥ 0.
    pub off_centre: f64,
    /// Depth of its centre along the view, metres, > 0: at least its radius.
    pub depth_m: f64,
    /// Whether any part of it may be in the picture.
    pub visible: bool,
    /// Whether it may be left out where not even the coarsest of everything fits (FS93, §3: no polygons at all).
    pub may_vanish: bool,
}

/// Least distance, metres: nearer, the eye is inside the object, and smaller polygons are pointless.
const DISTANCE_MIN_M: f64 = 0.05;

/// Speed on the screen at which an object gets half the polygons, pixels per second: at 30 frames/s 20 pixels a frame, about the size of a
/// polygon.
const SPEED_HALF_PX_S: f64 = 600.0;

impl ObjectView {
    /// Whether the object is a group.
    #[must_use]
    pub fn is_group(&self) -> bool {
        matches!(self.kind, Kind::Group { .. })
    }

    /// Area of a quad in square metres per steradian of the scene's quads (control.md, eq. 14): coarser if far or fast.
    pub(crate) fn coarseness_m2(&self) -> f64 {
        let distance = if self.distance_m.is_finite() { self.distance_m.max(DISTANCE_MIN_M) } else { 1.0 };
        let speed = if self.speed_px_s.is_finite() { self.speed_px_s.max(0.0) } else { 0.0 };
        let importance = if self.importance.is_finite() { self.importance.clamp(1e-3, 1e3) } else { 1.0 };
        distance * distance * (1.0 + speed / SPEED_HALF_PX_S) / importance
    }

    /// Surface in square metres.
    pub(crate) fn surface_m2(&self) -> f64 {
        let area = match self.kind {
            Kind::Tube { length_m, radius_m } => std::f64::consts::TAU * radius_m * length_m,
            Kind::Primitive { radius_m, .. } | Kind::Counted { radius_m, .. } | Kind::Group { radius_m, .. } => {
                2.0 * std::f64::consts::TAU * radius_m * radius_m
            }
        };
        if area.is_finite() { area.max(1e-12) } else { 1.0 }
    }
}

impl ObjectView {
    /// An object in full view at rest, a metre away, with a hundred pixels and one resolution.
    #[must_use]
    pub fn plain(id: u32, kind: Kind) -> Self {
        Self {
            id: AgentId(id),
            kind,
            group: None,
            pieces: None,
            losses: None,
            range: ResolutionRange::fixed(metachron_core::Resolution { eps_m: 1.0, n: 0 }),
            shading: Default::default(),
            pixels: 100.0,
            distance_m: 1.0,
            speed_px_s: 0.0,
            own_speed_px_s: 0.0,
            importance: 1.0,
            off_centre: 0.0,
            depth_m: 1.0,
            visible: true,
            may_vanish: false,
        }
    }
}
