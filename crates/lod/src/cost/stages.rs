//! The cost of drawing as two parallel stages, of which the slower counts (FS93, §4).
//!
//! In: polygons, vertices, pixels. Out: a time. Never here: where the coefficients come from ([`super::fit`]).
//! Theory: `docs/theory/budget.md`, eq. 41.

/// The work drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// Polygons.
    pub polygons: f64,
    /// Vertices.
    pub vertices: f64,
    /// Pixels covered.
    pub pixels: f64,
}

/// Coefficients of one rendering algorithm on one machine; all in the same unit of time, ≥ 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stages {
    /// Fixed time of an object.
    pub setup: f64,
    /// c₁: time of a polygon.
    pub polygon: f64,
    /// c₂: time of a vertex.
    pub vertex: f64,
    /// c₃: time of a pixel.
    pub pixel: f64,
}

impl Stages {
    /// setup + max(c₁ polygons + c₂ vertices, c₃ pixels) (FS93, §4; the setup is ours).
    #[must_use]
    pub fn time(&self, work: Work) -> f64 {
        self.setup + self.geometry(work).max(self.pixel * work.pixels)
    }

    /// Time of the stage that every polygon passes.
    #[must_use]
    pub fn geometry(&self, work: Work) -> f64 {
        self.polygon * work.polygons + self.vertex * work.vertices
    }

    /// Whether the pixel stage is the slower: then fewer polygons save no time.
    #[must_use]
    pub fn is_filling(&self, work: Work) -> bool {
        self.pixel * work.pixels > self.geometry(work)
    }
}
