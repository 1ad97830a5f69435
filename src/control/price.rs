//! What drawing costs: two stages for each shading, of which the slower counts, and the picture itself.
//!
//! In: coefficients, declared or fitted. Out: seconds. Never here: a measurement. Theory: `docs/theory/budget.md`, eq. 41.

use super::view::Shading;
use metachron_budget::cost::stages::{Stages, Work};

/// Vertices of a closed mesh for each of its triangles (Euler: half as many and two more).
const VERTICES_A_TRIANGLE: f64 = 0.5;

/// What drawing costs on one machine, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prices {
    /// A picture with nothing in it, ≥ 0.
    pub frame_s: f64,
    /// Each pixel of the picture, whatever covers it, ≥ 0.
    pub pixel_s: f64,
    /// An object by its shading, flat first: setup + max(c₁ polygons + c₂ vertices, c₃ pixels that it covers).
    pub shading: [Stages; 3],
}

/// What is in a picture whatever is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Backdrop {
    /// Pixels of the picture, ≥ 0.
    pub pixels: f64,
    /// Triangles that nobody chooses: fixed solids, the floor; ≥ 0.
    pub triangles: f64,
}

impl Default for Prices {
    /// Two cores with Mesa, as they were measured once: what to believe before anything better is known.
    fn default() -> Self {
        let object = Stages { setup: 5e-6, polygon: 0.22e-6, vertex: 0.0, pixel: 0.0 };
        Self { frame_s: 1.4e-3, pixel_s: 6e-9, shading: [object; 3] }
    }
}

impl Prices {
    /// The same prices; a number that is none, or below 0, is twice what the default has in its place.
    #[must_use]
    pub fn sound(self) -> Self {
        let usual = Self::default();
        let of = |x: f64, prior: f64| if x.is_finite() && x >= 0.0 { x } else { 2.0 * prior };
        let stages = |s: Stages, p: Stages| Stages {
            setup: of(s.setup, p.setup),
            polygon: of(s.polygon, p.polygon),
            vertex: of(s.vertex, p.vertex),
            pixel: of(s.pixel, p.pixel),
        };
        Self {
            frame_s: of(self.frame_s, usual.frame_s),
            pixel_s: of(self.pixel_s, usual.pixel_s),
            shading: std::array::from_fn(|i| stages(self.shading[i], usual.shading[i])),
        }
    }

    /// The coefficients of a shading.
    #[must_use]
    pub fn of(&self, shading: Shading) -> &Stages {
        &self.shading[shading as usize]
    }

    /// Seconds of an object with so many triangles that covers so many pixels.
    #[must_use]
    pub fn object_s(&self, shading: Shading, polygons: f64, pixels: f64) -> f64 {
        let work = Work { polygons, vertices: VERTICES_A_TRIANGLE * polygons + 2.0, pixels };
        self.of(shading).time(work)
    }

    /// Seconds of a picture in which nothing is chosen.
    #[must_use]
    pub fn backdrop_s(&self, backdrop: Backdrop) -> f64 {
        let part = |x: f64| if x > 0.0 { x } else { 0.0 };
        let polygon_s = self.of(Shading::PerPixel).polygon;
        self.frame_s + self.pixel_s * part(backdrop.pixels) + polygon_s * part(backdrop.triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slower_stage_counts() {
        let stages = Stages { setup: 1.0, polygon: 2.0, vertex: 4.0, pixel: 0.5 };
        let prices = Prices { frame_s: 0.0, pixel_s: 0.0, shading: [stages; 3] };
        // 1 + max(2·10 + 4·(5 + 2), 0.5 px)
        assert_eq!(prices.object_s(Shading::Flat, 10.0, 10.0), 49.0);
        assert_eq!(prices.object_s(Shading::Flat, 10.0, 200.0), 101.0);
    }

    #[test]
    fn a_price_that_is_none_is_twice_the_usual_one() {
        let mut prices = Prices { frame_s: f64::NAN, pixel_s: -1.0, ..Prices::default() };
        prices.shading[1].polygon = f64::INFINITY;
        let sound = prices.sound();
        assert_eq!((sound.frame_s, sound.pixel_s, sound.shading[1].polygon), (2.8e-3, 12e-9, 0.44e-6));
        assert_eq!(sound.shading[0], Prices::default().shading[0]);
        assert!(sound.backdrop_s(Backdrop { pixels: f64::NAN, triangles: -1.0 }) == 2.8e-3);
    }
}
