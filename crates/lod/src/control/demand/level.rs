//! Conversion of an object's share of the polygons to the pair (ε, n) with quads nearest to square, with hysteresis.
//!
//! In: a requested number of polygons. Out: (ε, n), and the polygons that they make. Never here: the amount to share. Theory:
//! `docs/theory/control.md`, eq. 15 and 16.

use super::view::{Kind, ObjectView};
use crate::hysteresis;
use crate::hysteresis::BAND;
use metachron_core::{N_MAX, Resolution, ResolutionRange};
use std::f64::consts::PI;

/// Number of levels n of a primitive: `0..=N_MAX`.
pub const PRIMITIVE_LEVELS: usize = N_MAX as usize + 1;

/// Most impostors of a group.
pub const IMPOSTORS_MAX: usize = 8;

/// Triangles of a tube's patch at level 0; level n has 2ⁿ times as many (6·2^⌈n/2⌉ sides, 2^⌊n/2⌋ rings of quads).
const PATCH_TRIANGLES: f64 = 12.0;

/// A picture is recut only if the request moved by this much, |Δ ln polygons|: less than the width of the law's dead zone (0.04), so that
/// there is always a picture at which the loop rests.
const HOLD: f64 = 0.03;

/// Ranges of ε narrower than this factor leave no room between two switches of n (a level and the band at both its ends).
const NARROW: f64 = 4.0;

/// Shares are met to 1e-9: a request this near to an end of its range, relatively, counts as that end.
const AT_AN_END: f64 = 1e-6;

/// The range of an object's polygon count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    /// At its coarsest.
    pub least: f64,
    /// At its finest, or one polygon per pixel if that is fewer.
    pub most: f64,
    /// At its finest.
    pub full: f64,
}

impl Span {
    pub fn of(view: &ObjectView) -> Self {
        let (eps, n) = (view.range.eps_m, view.range.n);
        let (least, full) = match view.kind {
            Kind::Tube { length_m, .. } => (count(length_m, eps.1, n.0), count(length_m, eps.0, n.1)),
            Kind::Primitive { triangles, .. } => (f64::from(triangles[level(n.0)]), f64::from(triangles[level(n.1)])),
            Kind::Counted { least, most, .. } => (f64::from(least.max(1)), f64::from(most)),
            // the members have polygons of their own
            Kind::Group { .. } => (0.0, 0.0),
        };
        let full = full.max(least);
        let most = if view.pixels.is_nan() { full } else { full.min(view.pixels).max(least) };
        Self { least, most, full }
    }
}

/// A pair (ε, n), and the polygons that it makes of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    pub resolution: Resolution,
    pub polygons: f64,
}

/// The last cut of an object.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LastCut {
    /// The polygons requested when it was last cut, and the level n chosen; `None` while it is out of view.
    cut: Option<(f64, u8)>,
}

impl LastCut {
    /// Clears the last cut when the object goes out of view.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// The cut with about `wish` polygons.
    pub fn choose(&mut self, view: &ObjectView, span: Span, wish: f64) -> Cut {
        let resolution = self.resolution(view, span, wish);
        let makes = match (view.kind, self.cut) {
            // any count is possible: no rounding to a level
            (Kind::Counted { .. }, Some((cut, _))) => libm::floor(within(cut, span)),
            _ => polygons(view, resolution),
        };
        Cut { resolution, polygons: makes }
    }

    fn resolution(&mut self, view: &ObjectView, span: Span, wish: f64) -> Resolution {
        let end = if wish <= span.least * (1.0 + AT_AN_END) {
            Some(Resolution { eps_m: view.range.eps_m.1, n: view.range.n.0 })
        } else if wish >= span.full * (1.0 - AT_AN_END) {
            Some(Resolution { eps_m: view.range.eps_m.0, n: view.range.n.1 })
        } else {
            None
        };
        if let Some(end) = end {
            self.cut = Some((wish, end.n));
            return end;
        }
        let polygons = match self.cut {
            Some((held, _)) if libm::log(wish / held).abs() <= HOLD => held,
            _ => wish,
        };
        let before = self.cut.map(|(_, n)| n);
        let n = match view.kind {
            Kind::Tube { length_m, radius_m } => {
                hysteresis::floor(before, tube_rho(polygons, length_m, radius_m, view.range))
            }
            Kind::Primitive { ref triangles, .. } => primitive_level(polygons, triangles, view.range.n, before),
            Kind::Counted { least, .. } => octaves(polygons / f64::from(least.max(1))),
            Kind::Group { .. } => open(view),
        };
        let n = n.clamp(view.range.n.0, view.range.n.1);
        self.cut = Some((polygons, n));
        view.range.clamp(Resolution { eps_m: spacing_m(view, polygons, n), n })
    }
}

/// ε at which an object of level `n` has about `polygons` (control.md, eq. 16); kinds without a spacing give their coarsest.
fn spacing_m(view: &ObjectView, polygons: f64, n: u8) -> f64 {
    match view.kind {
        Kind::Tube { length_m, .. } => PATCH_TRIANGLES * two_to(n) * length_m / polygons,
        Kind::Primitive { .. } | Kind::Counted { .. } | Kind::Group { .. } => view.range.eps_m.1,
    }
}

/// The actual number of triangles of an object at `at`.
pub(crate) fn polygons(view: &ObjectView, at: Resolution) -> f64 {
    match view.kind {
        Kind::Tube { length_m, .. } => count(length_m, at.eps_m, at.n),
        Kind::Primitive { triangles, .. } => f64::from(triangles[level(at.n)]),
        Kind::Counted { least, most, .. } => {
            (f64::from(least.max(1)) * two_to(at.n)).min(f64::from(most.max(least).max(1)))
        }
        // the members have polygons of their own; an open group has none
        Kind::Group { impostors, .. } => impostors.get(usize::from(at.n)).map_or(0.0, |count| f64::from(*count)),
    }
}

/// Level n at which a group's members are drawn as themselves, one past its finest impostor; 0 for other kinds.
pub(crate) fn open(view: &ObjectView) -> u8 {
    let Kind::Group { impostors, .. } = view.kind else { return 0 };
    impostors.iter().take_while(|count| **count > 0).count() as u8
}

fn within(polygons: f64, span: Span) -> f64 {
    polygons.max(span.least).min(span.full)
}

/// Whole doublings, 0 if there is none.
fn octaves(times: f64) -> u8 {
    // a cast of floats saturates, and maps NaN to 0
    (libm::floor(libm::log2(times)) as u8).min(N_MAX)
}

/// ⌈L/ε⌉ patches of level n.
fn count(length_m: f64, eps_m: f64, n: u8) -> f64 {
    let patches = libm::ceil(length_m / eps_m);
    PATCH_TRIANGLES * two_to(n) * if patches.is_finite() { patches.max(1.0) } else { 1.0 }
}

fn two_to(n: u8) -> f64 {
    f64::from(1_u32 << n.min(N_MAX))
}

fn level(n: u8) -> usize {
    usize::from(n.min(N_MAX))
}

/// Whether ε has so little room that n makes a tube's polygons.
pub(crate) fn is_narrow(range: ResolutionRange) -> bool {
    range.eps_m.1 < NARROW * range.eps_m.0
}

/// The pair nearest to level `n` that has these polygons, to the rounding of one interval.
pub(crate) fn tube_cut(range: ResolutionRange, length_m: f64, polygons: f64, n: u8) -> Resolution {
    let (finest, coarsest) = range.eps_m;
    let per_m = polygons / (PATCH_TRIANGLES * length_m);
    let (least, most) = (libm::ceil(libm::log2(finest * per_m)), libm::floor(libm::log2(coarsest * per_m)));
    // ε is inside its range at these; casts of floats saturate
    let n = n.max(least as u8).min(most as u8).clamp(range.n.0, range.n.1);
    let intervals = libm::round(polygons / (PATCH_TRIANGLES * two_to(n))).max(1.0);
    // a hair longer than an interval, so that rounding makes no further one
    range.clamp(Resolution { eps_m: length_m / intervals * (1.0 + 1e-12), n })
}

/// The level at which a tube's quads are nearest to square: ρ, whose floor is n (control.md, eq. 15), where ε stays in its range.
pub(crate) fn tube_rho(polygons: f64, length_m: f64, radius_m: f64, range: ResolutionRange) -> f64 {
    // ε at level n is 2ⁿ / per_m
    let per_m = polygons / (PATCH_TRIANGLES * length_m);
    let (finest, coarsest) = range.eps_m;
    if is_narrow(range) {
        return libm::log2(coarsest * per_m);
    }
    let square = libm::log2(PI * radius_m * polygons / (36.0 * length_m));
    square.max(libm::log2(finest * per_m) + 1.0 + BAND).min(libm::log2(coarsest * per_m) - BAND)
}

/// The highest level whose triangles fit, with hysteresis of half an octave in both directions.
fn primitive_level(wish: f64, triangles: &[u32; PRIMITIVE_LEVELS], range: (u8, u8), before: Option<u8>) -> u8 {
    let band = if before.is_some() { libm::exp2(BAND) } else { 1.0 };
    let at = |n: u8| f64::from(triangles[level(n)]);
    let mut n = before.unwrap_or(range.0).clamp(range.0, range.1);
    while n > range.0 && at(n) > wish * band {
        n -= 1;
    }
    while n < range.1 && (at(n + 1) * band <= wish || at(n + 1) <= at(n)) {
        n += 1;
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tube(eps_m: (f64, f64), n: (u8, u8)) -> ObjectView {
        let range = ResolutionRange { eps_m, n };
        let kind = Kind::Tube { length_m: 1.5, radius_m: 0.015 };
        ObjectView { range, pixels: 1e9, distance_m: 0.5, ..ObjectView::plain(0, kind) }
    }

    /// Length of a ring over length of a side.
    fn aspect(at: Resolution) -> f64 {
        let (rings, sides) = (two_to(at.n / 2), 6.0 * two_to(at.n.div_ceil(2)));
        (at.eps_m / rings) / (2.0 * PI * 0.015 / sides)
    }

    #[test]
    fn a_switch_of_n_keeps_the_polygons_and_the_quads_near_square() {
        let view = tube((1e-4, 0.5), (0, 10));
        let (span, mut held) = (Span::of(&view), LastCut::default());
        let mut levels = Vec::new();
        let mut wish = 1300.0;
        while wish < 5.7e5 {
            let at = held.choose(&view, span, wish).resolution;
            // HOLD, and the rounding of one interval in the 45 or more that there are
            assert!((polygons(&view, at) / wish).ln().abs() <= HOLD + 1.0 / 45.0, "{wish}: {at:?}");
            // half an octave to either side of the level, and the band
            assert!(libm::log2(aspect(at)).abs() <= 1.0 + BAND + 0.05, "{wish}: {at:?} aspect {}", aspect(at));
            levels.push(at.n);
            wish *= 1.01;
        }
        assert!(levels.is_sorted() && levels[0] == 0 && *levels.last().unwrap() == 8, "{levels:?}");
    }

    #[test]
    fn a_request_that_fluctuates_switches_n_at_most_once() {
        let view = tube((5e-4, 0.02), (1, 5));
        let span = Span::of(&view);
        for start in 0..200 {
            let (middle, mut held) = (3000.0 * 1.02_f64.powi(start), LastCut::default());
            let wish = |k: i32| middle * if k % 2 == 0 { 0.93 } else { 1.07 }; // less than the band, a factor 2 wide
            let mut levels: Vec<_> = (0..20).map(|k| held.choose(&view, span, wish(k)).resolution.n).collect();
            levels.dedup();
            assert!(levels.len() <= 2, "{middle}: {levels:?}");
        }
    }

    #[test]
    fn the_ends_of_the_range_are_reached() {
        for (eps_m, n) in
            [((5e-4, 0.02), (1, 5)), ((0.01, 0.01), (0, 6)), ((1e-3, 0.05), (3, 3)), ((0.01, 0.02), (1, 4))]
        {
            let view = tube(eps_m, n);
            let (span, mut held) = (Span::of(&view), LastCut::default());
            let mut ends = |wish| held.choose(&view, span, wish).resolution;
            assert_eq!(ends(span.least), Resolution { eps_m: eps_m.1, n: n.0 });
            assert_eq!(ends(span.full), Resolution { eps_m: eps_m.0, n: n.1 });
            assert_eq!(ends(span.least), Resolution { eps_m: eps_m.1, n: n.0 });
        }
    }

    #[test]
    fn a_tube_of_one_spacing_climbs_by_levels() {
        let view = tube((0.01, 0.01), (0, 6));
        let (span, mut held) = (Span::of(&view), LastCut::default());
        let levels: Vec<_> =
            (0..160).map(|k| held.choose(&view, span, span.least * 1.03_f64.powi(k)).resolution.n).collect();
        assert!(levels.is_sorted() && levels[0] == 0 && *levels.last().unwrap() == 6, "{levels:?}");
    }

    #[test]
    fn a_mesh_with_free_triangle_count_has_as_many_as_requested() {
        let kind = Kind::Counted { radius_m: 0.1, least: 40, most: 100_000 };
        let view = ObjectView { kind, ..tube((1.0, 1.0), (0, 10)) };
        let (span, mut held) = (Span::of(&view), LastCut::default());
        for wish in [1.0, 40.0, 123.4, 9_999.0, 1e9] {
            let polygons = held.choose(&view, span, wish).polygons;
            assert_eq!(polygons, wish.floor().clamp(40.0, 100_000.0));
        }
        assert_eq!(polygons(&view, Resolution { eps_m: 1.0, n: 3 }), 320.0);
        assert_eq!(polygons(&view, Resolution { eps_m: 1.0, n: 10 }), 40_960.0);
    }

    #[test]
    fn a_primitive_takes_the_level_that_fits_and_keeps_it_for_an_octave() {
        let triangles: [u32; PRIMITIVE_LEVELS] = std::array::from_fn(|n| 48 << n);
        assert_eq!(primitive_level(400.0, &triangles, (0, 6), None), 3); // 384 of 400
        assert_eq!(primitive_level(800.0, &triangles, (0, 6), Some(3)), 3); // 768 fits, but not by half an octave
        assert_eq!(primitive_level(1090.0, &triangles, (0, 6), Some(3)), 4);
        assert_eq!(primitive_level(550.0, &triangles, (0, 6), Some(4)), 4);
        assert_eq!(primitive_level(540.0, &triangles, (0, 6), Some(4)), 3);
        assert_eq!(primitive_level(1.0, &triangles, (2, 6), Some(4)), 2);
        assert_eq!(primitive_level(12.0, &[12; PRIMITIVE_LEVELS], (1, 6), None), 6, "levels that cost the same");
    }
}
