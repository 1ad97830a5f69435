//! The cost of drawing as two stages beside each other, of which the slower counts (FS93, §4), or one after the other, or between.
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
    /// The part of the faster stage that the slower does not hide, 0 … 1: 0 on the paper's machine, 1 where a processor does one after the
    /// other.
    pub serial: f64,
}

impl Stages {
    /// setup + max + serial · min of c₁ polygons + c₂ vertices and c₃ pixels (FS93, §4; the setup and the part that is
    /// not hidden are ours).
    #[must_use]
    pub fn time(&self, work: Work) -> f64 {
        let (geometry, fill) = (self.geometry(work), self.pixel * work.pixels);
        self.setup + geometry.max(fill) + self.serial * geometry.min(fill)
    }

    /// Time of the stage that every polygon passes.
    #[must_use]
    pub fn geometry(&self, work: Work) -> f64 {
        self.polygon * work.polygons + self.vertex * work.vertices
    }

    /// Whether the pixel stage is the slower: then fewer polygons save no more than the part of their time that it does not hide.
    #[must_use]
    pub fn is_filling(&self, work: Work) -> bool {
        self.pixel * work.pixels > self.geometry(work)
    }
}
