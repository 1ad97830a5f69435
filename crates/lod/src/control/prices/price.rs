//! Cost of drawing: by lines, two stages for each shading of which the slower counts; by areas, a price per triangle for every area that it
//! may cover; and the picture itself.
//!
//! In: coefficients, declared, or fitted to measured pictures. Out: seconds. Never here: a measurement.
//! Theory: `docs/theory/budget.md`, eq. 41 … 44.

use super::area::Areas;
use crate::control::demand::plan::LevelDemand;
use crate::control::demand::view::{ObjectView, Pieces, Shading, Stroke};
use crate::cost::fit::{BETTER, SERIAL, Sample, fit, quantile};
use crate::cost::stages::{Stages, Work};

/// Vertices of a closed mesh per triangle (Euler: half as many and two more).
const VERTICES_A_TRIANGLE: f64 = 0.5;

/// Cost factor of a pixel in soft shadow: thirteen more comparisons and four more depths.
const SOFTER: f64 = 2.5;

/// Cost of drawing on one machine, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prices {
    /// An empty picture, ≥ 0.
    pub frame_s: f64,
    /// Each pixel of the picture, independent of its content, ≥ 0.
    pub pixel_s: f64,
    /// Each pixel that a smaller picture is enlarged to, ≥ 0.
    pub enlarge_s: f64,
    /// An object by its shading, flat first: setup + max(c₁ polygons + c₂ vertices, c₃ pixels that it covers).
    pub shading: [Stages; 4],
    /// An object drawn as points, and one drawn as lines; its pixels are its strokes' pixels.
    pub strokes: [Stages; Stroke::ALL.len()],
    /// An object of each shading by the area of its triangles, if that was measured: then it replaces the stages.
    pub areas: Option<[Areas; 4]>,
}

/// A measured picture of equal objects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Pixels of the picture as drawn.
    pub picture_px: f64,
    /// Pixels that it was enlarged to; 0 for one that was not.
    pub enlarged_px: f64,
    /// Objects in the picture; 0 to measure the cost of an empty picture.
    pub objects: f64,
    /// Triangles of each.
    pub polygons: f64,
    /// Pixels that each covers.
    pub pixels: f64,
    /// How they are shaded.
    pub shading: Shading,
    /// The strokes that they are drawn as instead of shaded triangles.
    pub stroke: Option<Stroke>,
    /// Measured time of the picture.
    pub seconds: f64,
}

/// Relative errors of predicted times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Misses {
    /// Half of the pictures are nearer than this fraction of their time.
    pub half: f64,
    /// 19 of 20 are.
    pub most: f64,
}

/// The part of a picture that is independent of the choice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Backdrop {
    /// Pixels of the picture as drawn, ≥ 0.
    pub pixels: f64,
    /// Pixels that it is enlarged to, ≥ 0; 0 for one that is not.
    pub enlarged: f64,
    /// Triangles that are not subject to a choice: fixed solids, the floor; ≥ 0.
    pub triangles: f64,
}

impl Default for Prices {
    /// Two cores with Mesa, from one measurement: the assumption until better prices are known.
    fn default() -> Self {
        let object = Stages { setup: 5e-6, polygon: 0.22e-6, vertex: 0.0, pixel: 0.0, serial: 0.0 };
        Self {
            frame_s: 1.4e-3,
            pixel_s: 6e-9,
            enlarge_s: 2e-9,
            shading: [object; 4],
            strokes: [object; 2],
            areas: None,
        }
    }
}

impl Prices {
    /// The same prices; an invalid or negative number is replaced by twice the default.
    #[must_use]
    pub fn sound(self) -> Self {
        let usual = Self::default();
        let of = |x: f64, prior: f64| if x.is_finite() && x >= 0.0 { x } else { 2.0 * prior };
        let stages = |s: Stages, p: Stages| Stages {
            setup: of(s.setup, p.setup),
            polygon: of(s.polygon, p.polygon),
            vertex: of(s.vertex, p.vertex),
            pixel: of(s.pixel, p.pixel),
            serial: crate::within(s.serial, 0.0, 1.0),
        };
        Self {
            frame_s: of(self.frame_s, usual.frame_s),
            pixel_s: of(self.pixel_s, usual.pixel_s),
            enlarge_s: of(self.enlarge_s, usual.enlarge_s),
            shading: std::array::from_fn(|i| stages(self.shading[i], usual.shading[i])),
            strokes: std::array::from_fn(|i| stages(self.strokes[i], usual.strokes[i])),
            areas: self.areas.filter(|areas| areas.iter().all(Areas::is_sound)),
        }
    }

    /// The part of the faster stage of drawing that the slower does not hide; `None` where pixels of objects have no price, so that nothing is
    /// hidden.
    #[must_use]
    pub fn serial(&self) -> Option<f64> {
        let mut stages = self.shading.iter().chain(&self.strokes);
        stages.any(|stages| stages.pixel > 0.0).then(|| self.shading[0].serial)
    }

    /// The same prices where the slower stage of drawing does not hide this part of the faster, 0 … 1.
    #[must_use]
    pub fn with_serial(self, serial: f64) -> Self {
        let part = |stages: Stages| Stages { serial: crate::within(serial, 0.0, 1.0), ..stages };
        Self { shading: self.shading.map(part), strokes: self.strokes.map(part), ..self }
    }

    /// The same prices without prices by area: for policies that use two stages only (FS93, MB97, GB99).
    #[must_use]
    pub fn by_lines(self) -> Self {
        Self { areas: None, ..self }
    }

    /// The same prices for pictures with shadows, as which they are measured, or without: the shadow map draws every triangle once more.
    #[must_use]
    pub fn with_shadows(self, shadows: bool) -> Self {
        if shadows {
            return self;
        }
        let once = |s: Stages| Stages { polygon: 0.5 * s.polygon, vertex: 0.5 * s.vertex, ..s };
        // points and lines throw none
        Self { shading: self.shading.map(once), areas: self.areas.map(|areas| areas.map(Areas::drawn_once)), ..self }
    }

    /// The prices that fit measured pictures best; `None` with too few of them: needs two sizes without an object, one enlarged, and for each
    /// shading, for points and for lines eight pictures of objects.
    #[must_use]
    pub fn fitted(pictures: &[Measured]) -> Option<Self> {
        let (enlarged, plain): (Vec<Measured>, Vec<Measured>) =
            pictures.iter().copied().partition(|p| p.enlarged_px > 0.0);
        let (pixel_s, frame_s) = line(plain.iter().filter(|p| p.objects == 0.0).map(|p| (p.picture_px, p.seconds)))?;
        let enlarging = |p: &Measured| (p.seconds - frame_s - pixel_s * p.picture_px) / p.enlarged_px;
        let enlarge_s = enlarged.first().map(enlarging).filter(|s| s.is_finite())?.max(0.0);
        let drawn_as = |stroke: Option<Stroke>, shading: Option<Shading>| {
            let of = plain.iter().filter(move |p| p.objects > 0.0 && p.stroke == stroke);
            let of = of.filter(move |p| shading.is_none_or(|shading| p.shading == shading));
            of.map(move |p| (p.polygons, p.pixels, (p.seconds - frame_s - pixel_s * p.picture_px) / p.objects))
        };
        let sample = |(polygons, pixels, time): (f64, f64, f64)| Sample { work: work(polygons, pixels), time };
        let draws = |shading: Shading| drawn_as(None, Some(shading));
        let samples = Shading::PRICED.map(|shading| draws(shading).map(sample).collect::<Vec<_>>());
        let strokes = Stroke::ALL.map(|stroke| drawn_as(Some(stroke), None).map(sample).collect::<Vec<_>>());
        // whether stages work beside each other is the machine's, whatever the shading
        let fits = |serial: f64| {
            let [flat, gouraud, per_pixel, textured] = samples.each_ref().map(|of| fit(of, serial));
            let all = [flat?, gouraud?, per_pixel?, textured?];
            Some((all.iter().map(|fit| fit.error50).sum::<f64>(), all.map(|fit| fit.stages)))
        };
        let best = SERIAL.into_iter().filter_map(fits);
        let (_, shading) = best.reduce(|best, next| if next.0 < BETTER * best.0 { next } else { best })?;
        let [points, lines] = strokes.each_ref().map(|of| fit(of, shading[0].serial));
        let strokes = [points?.stages, lines?.stages];
        let [flat, gouraud, per_pixel, textured] =
            Shading::PRICED.map(|shading| Areas::fitted(&draws(shading).collect::<Vec<_>>()));
        let areas = || Some([flat?, gouraud?, per_pixel?, textured?]);
        Some(Self { frame_s, pixel_s, enlarge_s, shading, strokes, areas: areas() })
    }

    /// How far these prices are from measured pictures.
    #[must_use]
    pub fn misses(&self, pictures: &[Measured]) -> Misses {
        let miss = |picture: &Measured| (self.predict_s(picture) / picture.seconds - 1.0).abs();
        let all = || pictures.iter().filter(|picture| picture.seconds > 0.0).map(miss);
        Misses { half: quantile(all(), 0.5), most: quantile(all(), 0.95) }
    }

    /// Predicted time of a measured picture, seconds.
    #[must_use]
    pub fn predict_s(&self, picture: &Measured) -> f64 {
        let backdrop = Backdrop { pixels: picture.picture_px, enlarged: picture.enlarged_px, triangles: 0.0 };
        let Measured { shading, polygons, pixels, .. } = *picture;
        let object_s = match picture.stroke {
            Some(stroke) => self.stroke(stroke).time(work(polygons, pixels)),
            None => self.object_s(shading, polygons, pixels),
        };
        self.backdrop_s(backdrop) + picture.objects * object_s
    }

    /// The coefficients of a shading; for [`Shading::Shadowed`] the coefficients of textured light with 2.5 times the
    /// time per pixel.
    #[must_use]
    pub fn of(&self, shading: Shading) -> Stages {
        match shading {
            Shading::Shadowed => {
                let textured = self.of(Shading::Textured);
                Stages { pixel: SOFTER * textured.pixel, ..textured }
            }
            asked => self.shading[asked as usize],
        }
    }

    /// The coefficients of an object drawn as strokes.
    #[must_use]
    pub fn stroke(&self, stroke: Stroke) -> Stages {
        self.strokes[stroke as usize]
    }

    /// Seconds of an object with `polygons` triangles that covers `pixels`, by how its pieces are drawn: strokes and
    /// pieces in full are two draws, of which each covers the pixels of its share of the pieces.
    #[must_use]
    pub fn pieces_s(&self, pieces: Option<Pieces>, shading: Shading, polygons: f64, pixels: f64) -> f64 {
        let Some(pieces) = pieces else { return self.object_s(shading, polygons, pixels) };
        let parts = pieces.parts(polygons);
        let strokes_s = match parts.strokes > 0.0 || parts.full <= 0.0 {
            true => self.stroke(pieces.stroke).time(work(parts.strokes, parts.stroked * pixels)),
            false => 0.0,
        };
        let full_s = match parts.full > 0.0 {
            true => self.object_s(shading, parts.full, (1.0 - parts.stroked) * pixels),
            false => 0.0,
        };
        strokes_s + full_s
    }

    /// Seconds of an object with `polygons` shaded triangles that covers `pixels`.
    #[must_use]
    pub fn object_s(&self, shading: Shading, polygons: f64, pixels: f64) -> f64 {
        match (&self.areas, shading) {
            (None, _) => self.of(shading).time(work(polygons, pixels)),
            (Some(areas), Shading::Shadowed) => areas[Shading::Textured as usize].time(polygons, SOFTER * pixels),
            (Some(areas), _) => areas[shading as usize].time(polygons, pixels),
        }
    }

    /// Triangles below which fewer save no time of an object that covers `pixels`, by the stages: its pixels take as long (GB99). 0 where a
    /// machine does one stage after the other, so that every triangle takes time.
    #[must_use]
    pub fn free_polygons(&self, shading: Shading, pixels: f64) -> f64 {
        let Stages { polygon, vertex, pixel, serial, .. } = self.of(shading);
        let each = polygon + VERTICES_A_TRIANGLE * vertex;
        if serial > 0.0 || each <= 0.0 { 0.0 } else { ((pixel * pixels - 2.0 * vertex) / each).max(0.0) }
    }

    /// Seconds of the objects in view at these levels; both in the same order.
    #[must_use]
    pub fn objects_s<'a>(&self, views: impl Iterator<Item = &'a ObjectView>, levels: &[LevelDemand]) -> f64 {
        let drawn = views.zip(levels).filter(|(view, level)| view.visible && level.polygons > 0.0);
        drawn
            .map(|(view, level)| self.pieces_s(view.pieces, level.shading, level.polygons, view.pixels))
            .fold(0.0, |sum, s| sum + s)
    }

    /// Seconds of a picture's part that is independent of the choice.
    #[must_use]
    pub fn backdrop_s(&self, backdrop: Backdrop) -> f64 {
        let part = |x: f64| if x > 0.0 { x } else { 0.0 };
        let polygon_s = self.of(Shading::PerPixel).polygon;
        let Backdrop { pixels, enlarged, triangles } = backdrop;
        self.frame_s + self.pixel_s * part(pixels) + self.enlarge_s * part(enlarged) + polygon_s * part(triangles)
    }
}

fn work(polygons: f64, pixels: f64) -> Work {
    Work { polygons, vertices: VERTICES_A_TRIANGLE * polygons + 2.0, pixels }
}

/// Slope and intercept of the least-squares line through points, neither below 0; `None` with fewer than two abscissas.
fn line(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<(f64, f64)> {
    let sound = points.filter(|(x, y)| x.is_finite() && y.is_finite());
    let (n, x, y) = sound.clone().fold((0.0, 0.0, 0.0), |(n, x, y), p| (n + 1.0, x + p.0, y + p.1));
    let (mean_x, mean_y) = (x / n, y / n);
    let sums =
        sound.fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - mean_x) * (x - mean_x), xy + (x - mean_x) * (y - mean_y)));
    let slope = (sums.1 / sums.0).max(0.0);
    (sums.0 > 0.0).then(|| (slope, (mean_y - slope * mean_x).max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures of a machine with noise of 3 %; one of twenty is interrupted.
    fn pictures(seed: u32, machine: &Prices) -> Vec<Measured> {
        let (mut state, mut all) = (u64::from(seed), Vec::new());
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for shading in Shading::PRICED {
            for k in 0..40 {
                let objects = if k % 10 == 0 { 0.0 } else { 36.0 };
                let (polygons, pixels) = (10.0 * 400.0_f64.powf(random()), 10.0 * 500.0_f64.powf(random()));
                let (picture_px, enlarged_px) = (1e5 + 9e5 * random(), if k == 0 { 2e6 } else { 0.0 });
                // every fifth picture of points, every fifth of lines
                let stroke = [Some(Stroke::Point), Some(Stroke::Line)].get(k % 5).copied().flatten();
                let mut picture =
                    Measured { picture_px, enlarged_px, objects, polygons, pixels, shading, stroke, seconds: 0.0 };
                let stall = if random() < 0.05 && objects > 0.0 { 1.6 } else { 1.0 };
                picture.seconds = machine.predict_s(&picture) * stall * (1.0 + 0.06 * (random() - 0.5));
                all.push(picture);
            }
        }
        all
    }

    #[test]
    fn held_out_pictures_are_predicted_within_a_tenth_in_nineteen_of_twenty() {
        let stages = |polygon, pixel| Stages { setup: 4e-6, polygon, vertex: 0.0, pixel, serial: 0.0 };
        let machine = Prices {
            frame_s: 1.4e-3,
            pixel_s: 6e-9,
            enlarge_s: 2e-9,
            shading: [stages(0.2e-6, 5e-9), stages(0.25e-6, 8e-9), stages(0.3e-6, 40e-9), stages(0.3e-6, 55e-9)],
            strokes: [stages(0.08e-6, 2e-9), stages(0.1e-6, 3e-9)],
            areas: None,
        };
        let found = Prices::fitted(&pictures(1, &machine)).unwrap().by_lines();
        // without interruptions: no model predicts these
        let others = pictures(2, &machine);
        let ordinary = others.iter().filter(|p| p.seconds < 1.3 * machine.predict_s(p));
        let mut errors: Vec<_> = ordinary.map(|p| (found.predict_s(p) / p.seconds - 1.0).abs()).collect();
        errors.sort_by(f64::total_cmp);
        assert!(errors[errors.len() * 95 / 100] < 0.1, "{:?} of {found:?}", errors[errors.len() * 95 / 100]);
    }

    #[test]
    fn too_few_pictures_give_no_prices() {
        let all = pictures(3, &Prices::default());
        assert_eq!(Prices::fitted(&[]), None);
        assert_eq!(Prices::fitted(&all.iter().copied().filter(|p| p.objects > 0.0).collect::<Vec<_>>()), None);
        let without = all.iter().copied().filter(|p| p.objects == 0.0 || p.shading != Shading::Gouraud);
        assert_eq!(Prices::fitted(&without.collect::<Vec<_>>()), None);
    }

    #[test]
    fn the_slower_stage_counts() {
        let stages = Stages { setup: 1.0, polygon: 2.0, vertex: 4.0, pixel: 0.5, serial: 0.0 };
        let prices = Prices {
            frame_s: 0.0,
            pixel_s: 0.0,
            enlarge_s: 0.0,
            shading: [stages; 4],
            strokes: [stages; 2],
            areas: None,
        };
        // 1 + max(2·10 + 4·(5 + 2), 0.5 px)
        assert_eq!(prices.object_s(Shading::Flat, 10.0, 10.0), 49.0);
        assert_eq!(prices.object_s(Shading::Flat, 10.0, 200.0), 101.0);
    }

    #[test]
    fn an_invalid_price_is_replaced_by_twice_the_default() {
        let mut prices = Prices { frame_s: f64::NAN, pixel_s: -1.0, ..Prices::default() };
        prices.shading[1].polygon = f64::INFINITY;
        let sound = prices.sound();
        assert_eq!((sound.frame_s, sound.pixel_s, sound.shading[1].polygon), (2.8e-3, 12e-9, 0.44e-6));
        assert_eq!(sound.shading[0], Prices::default().shading[0]);
        assert!(sound.backdrop_s(Backdrop { pixels: f64::NAN, enlarged: -1.0, triangles: -1.0 }) == 2.8e-3);
    }
}
