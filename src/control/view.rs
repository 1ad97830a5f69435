//! What control is told: the objects in view, the policy, the law and its gains.
//!
//! In: plain numbers. Out: the weight by which an object shares in the picture's polygons. Never here: state.

use super::level::PRIMITIVE_LEVELS;
use metachron_agents::{AgentId, ResolutionRange};
use metachron_budget::{grisoni, log_law};

/// Who chooses the level of every visible object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Policy {
    /// The finest of everything, whatever it costs.
    Full,
    /// Feedback on (ε, n) from the measured work of frames (GDC04).
    #[default]
    Feedback,
}

/// How the light on a surface is worked out: the rendering algorithm of (FS93), cheapest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Shading {
    /// One colour a triangle.
    Flat,
    /// Colours at corners, interpolated between them.
    Gouraud,
    /// Light at every pixel.
    #[default]
    PerPixel,
}

/// The feedback law and its gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// The law as printed (GDC04, eq. 1), on ε̂ = 40 ε/L.
    Printed {
        /// α: change of ε̂ for each frame per second that is missing, > 0. Past 2/(df/dε̂) the loop swings for ever.
        alpha: f64,
        /// β: change of ρ for each unit of ε̂, > 0.
        beta: f64,
    },
    /// The law on the logarithm of the measured time (control.md, eq. 7).
    Corrected {
        /// κ, 0.01 … 0.99: the share of an error that one frame removes.
        kappa: f64,
        /// The share of the frame that is left free, 0 … 0.9: T_set = (1 − margin) T.
        margin: f64,
    },
}

impl Law {
    /// The printed law with the gains of (GDC04).
    pub const PRINTED: Self = Self::Printed { alpha: 1e-4, beta: 5.0 };

    /// The corrected law; a tenth of the frame stays free: work that scatters by 5 % then misses
    /// (is past 1.05 T in) fewer than 1 frame in 100.
    pub const CORRECTED: Self = Self::Corrected { kappa: 0.5, margin: 0.1 };

    /// The share of the frame's time that the work is to take: T_set/T.
    #[must_use]
    pub fn set_share(self) -> f64 {
        match self {
            Self::Printed { .. } => 1.0,
            Self::Corrected { margin, .. } if margin.is_finite() => 1.0 - margin.clamp(0.0, 0.9),
            Self::Corrected { .. } => 0.9,
        }
    }

    pub(super) fn log_gains(self) -> log_law::Gains {
        let default = log_law::Gains::default();
        match self {
            Self::Corrected { kappa, .. } => log_law::Gains { kappa, ..default },
            Self::Printed { .. } => default,
        }
    }

    pub(super) fn printed_gains(self) -> grisoni::Gains {
        match self {
            Self::Printed { alpha, beta } => grisoni::Gains { alpha, beta },
            Self::Corrected { .. } => grisoni::Gains::default(),
        }
    }
}

impl Default for Law {
    fn default() -> Self {
        Self::CORRECTED
    }
}

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A tube: patches of 12·2ⁿ triangles, one for each interval ε of its length.
    Tube {
        /// Rest length, metres, > 0.
        length_m: f64,
        /// Mean radius, metres, > 0.
        radius_m: f64,
    },
    /// Anything that is one mesh a level.
    Primitive {
        /// Radius of a ball that holds it, metres, > 0.
        radius_m: f64,
        /// Triangles at each level n; rising, or the same from some level on.
        triangles: [u32; PRIMITIVE_LEVELS],
    },
    /// A mesh that can be cut at any number of triangles.
    Counted {
        /// Radius of a ball that holds it, metres, > 0.
        radius_m: f64,
        /// The fewest triangles that it is drawn with, ≥ 1.
        least: u32,
        /// All its triangles, ≥ `least`.
        most: u32,
    },
    /// Objects that can be drawn as one: at n = 0 by a proxy, at n = 1 as themselves.
    Group {
        /// Radius of a ball that holds it, metres, > 0.
        radius_m: f64,
        /// Its members among the objects given with it: the number of the first, and how many.
        members: (usize, usize),
        /// Triangles of its proxy, ≥ 1.
        proxy_triangles: u32,
    },
}

/// An object as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectView {
    /// Which one: its level is remembered under this number from frame to frame.
    pub id: AgentId,
    /// What is drawn.
    pub kind: Kind,
    /// The pairs (ε, n) that its picture may have. Of a primitive, n alone counts; of what is cut by triangles or a group, neither.
    pub range: ResolutionRange,
    /// The cheapest and the best shading that it may have, alike where it is fixed.
    pub shading: (Shading, Shading),
    /// Area it covers, pixels, ≥ 0. No object gets more than one triangle a pixel.
    pub pixels: f64,
    /// Distance of its centre from the eye, metres, > 0.
    pub distance_m: f64,
    /// How fast it crosses the picture, pixels a second, ≥ 0.
    pub speed_px_s: f64,
    /// Weight against the others, > 0; 1 is usual.
    pub importance: f64,
    /// Whether any of it may be in the picture.
    pub visible: bool,
}

/// Nearer than this the eye is inside the object, metres; polygons are not made smaller still.
const DISTANCE_MIN_M: f64 = 0.05;

/// Speed on the screen at which an object gets half the polygons, pixels a second: at 30 frames/s it moves by 20 pixels a frame,
/// about the size of a polygon.
const SPEED_HALF_PX_S: f64 = 600.0;

impl ObjectView {
    /// Area of a quad in square metres for each steradian of the scene's quads (control.md, eq. 14): far or fast is coarser.
    pub(super) fn coarseness_m2(&self) -> f64 {
        let distance = if self.distance_m.is_finite() { self.distance_m.max(DISTANCE_MIN_M) } else { 1.0 };
        let speed = if self.speed_px_s.is_finite() { self.speed_px_s.max(0.0) } else { 0.0 };
        let importance = if self.importance.is_finite() { self.importance.clamp(1e-3, 1e3) } else { 1.0 };
        distance * distance * (1.0 + speed / SPEED_HALF_PX_S) / importance
    }

    /// Surface in square metres.
    pub(super) fn surface_m2(&self) -> f64 {
        let area = match self.kind {
            Kind::Tube { length_m, radius_m } => std::f64::consts::TAU * radius_m * length_m,
            Kind::Primitive { radius_m, .. } | Kind::Counted { radius_m, .. } | Kind::Group { radius_m, .. } => {
                2.0 * std::f64::consts::TAU * radius_m * radius_m
            }
        };
        if area.is_finite() { area.max(1e-12) } else { 1.0 }
    }
}
