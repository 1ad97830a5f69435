//! The perceptual benefit of a level (FS93, §5): size, accuracy, importance, focus, motion, hysteresis.
//!
//! In: an object's appearance on the screen. Out: a benefit. Never here: perception; the benefit is a heuristic with sliders, as its
//! authors say.
//! Theory: `docs/theory/budget.md`, eq. 46 … 48.

/// How a surface is shaded; this decides what counts as a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shading {
    /// One colour per polygon: samples are polygons, m = 1.
    Flat,
    /// Colours at vertices, interpolated: samples are vertices, m = 2.
    Gouraud,
    /// Lighting computed at every pixel: samples are pixels, m = 1.
    PerPixel,
}

/// An object's appearance on the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Pixels covered; ≥ 0.
    pub pixels: f64,
    /// Inherent importance, 0 … 1.
    pub importance: f64,
    /// Distance of the object's centre from the middle of the screen, as a fraction of half the diagonal; ≥ 0.
    pub off_centre: f64,
    /// Motion on the screen in a frame, pixels; ≥ 0.
    pub motion_px: f64,
    /// The level of the frame before, if there was one.
    pub last: Option<u32>,
    /// How many levels the object has.
    pub levels: u32,
}

/// One level as it would be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    /// Which level.
    pub level: u32,
    /// Its polygons.
    pub polygons: f64,
    /// Its vertices.
    pub vertices: f64,
    /// How it is shaded.
    pub shading: Shading,
}

/// Sliders: how much each factor may take from a benefit, 0 (nothing) … 1 (all of it).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sliders {
    /// Size: the exponent of the pixels; at 0 all objects in view count the same, at 1 in proportion to the pixels covered.
    pub size: f64,
    /// Accuracy; at 0 all levels of an object have the same benefit.
    pub accuracy: f64,
    /// Importance.
    pub importance: f64,
    /// Focus: away from the middle of the screen.
    pub focus: f64,
    /// Motion blur.
    pub motion: f64,
    /// Hysteresis: unlike the frame before.
    pub hysteresis: f64,
}

impl Default for Sliders {
    /// Size and accuracy alone: presumably the setting of the timed test of (FS93, §7).
    fn default() -> Self {
        Self { size: 1.0, accuracy: 1.0, importance: 0.0, focus: 0.0, motion: 0.0, hysteresis: 0.0 }
    }
}

/// Sliders that scene or user has set; the others follow the policy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GivenSliders {
    /// [`Sliders::size`], if set.
    pub size: Option<f64>,
    /// [`Sliders::accuracy`], if set.
    pub accuracy: Option<f64>,
    /// [`Sliders::importance`], if set.
    pub importance: Option<f64>,
    /// [`Sliders::focus`], if set.
    pub focus: Option<f64>,
    /// [`Sliders::motion`], if set.
    pub motion: Option<f64>,
    /// [`Sliders::hysteresis`], if set.
    pub hysteresis: Option<f64>,
}

impl GivenSliders {
    /// All sliders; sliders that are not set come from `usual`.
    #[must_use]
    pub fn over(self, usual: Sliders) -> Sliders {
        Sliders {
            size: self.size.unwrap_or(usual.size),
            accuracy: self.accuracy.unwrap_or(usual.accuracy),
            importance: self.importance.unwrap_or(usual.importance),
            focus: self.focus.unwrap_or(usual.focus),
            motion: self.motion.unwrap_or(usual.motion),
            hysteresis: self.hysteresis.unwrap_or(usual.hysteresis),
        }
    }

    /// The same after sliders that stood at `from` were moved to `to`: the moved ones are set as well.
    #[must_use]
    pub fn moved(self, from: Sliders, to: Sliders) -> Self {
        let set = |given: Option<f64>, from: f64, to: f64| if from == to { given } else { Some(to) };
        Self {
            size: set(self.size, from.size, to.size),
            accuracy: set(self.accuracy, from.accuracy, to.accuracy),
            importance: set(self.importance, from.importance, to.importance),
            focus: set(self.focus, from.focus, to.focus),
            motion: set(self.motion, from.motion, to.motion),
            hysteresis: set(self.hysteresis, from.hysteresis, to.hysteresis),
        }
    }
}

impl From<Sliders> for GivenSliders {
    /// All of them are set.
    fn from(all: Sliders) -> Self {
        let Sliders { size, accuracy, importance, focus, motion, hysteresis } = all;
        Self {
            size: Some(size),
            accuracy: Some(accuracy),
            importance: Some(importance),
            focus: Some(focus),
            motion: Some(motion),
            hysteresis: Some(hysteresis),
        }
    }
}

/// The error of a surface drawn with one sample.
pub const BASE_ERROR: f64 = 0.5;

/// Accuracy = 1 − 0.5 / samples^m, samples at least 1 and never more than pixels (eq. 47); 0.5 … 1.
#[must_use]
pub fn accuracy(pixels: f64, picture: &Picture) -> f64 {
    let (samples, m) = match picture.shading {
        Shading::Flat => (picture.polygons, 1.0),
        Shading::Gouraud => (picture.vertices, 2.0),
        Shading::PerPixel => (pixels, 1.0),
    };
    // max and min ignore a NaN
    let samples = samples.min(pixels).max(1.0);
    (1.0 - BASE_ERROR / libm::pow(samples, m)).clamp(0.0, 1.0)
}

/// The benefit of a level (eq. 46), in pixels; ≥ 0. An invalid number takes its whole factor: 0 pixels, no importance.
#[must_use]
pub fn benefit(view: &View, picture: &Picture, sliders: &Sliders) -> f64 {
    let size = if view.pixels > 0.0 { view.pixels.min(f64::MAX) } else { 0.0 };
    let polygon_px = libm::sqrt(size / picture.polygons.max(1.0));
    let blur = if view.motion_px > 0.0 { view.motion_px / polygon_px } else { 0.0 };
    let change =
        view.last.map_or(0.0, |last| f64::from(picture.level.abs_diff(last)) / f64::from(view.levels.max(2) - 1));
    let factors = [
        (accuracy(size, picture), sliders.accuracy),
        (view.importance, sliders.importance),
        (1.0 - view.off_centre, sliders.focus),
        (1.0 - blur, sliders.motion),
        (1.0 - change, sliders.hysteresis),
    ];
    factors.into_iter().map(|(factor, slider)| weighed(factor, slider)).product::<f64>()
        * size_worth(size, sliders.size)
}

/// The benefit of a number of pixels, ≥ 0: pixels^slider, slider 0 … 1 (eq. 48a); below one pixel the number itself.
#[must_use]
pub fn size_worth(pixels: f64, slider: f64) -> f64 {
    if pixels > 1.0 { libm::pow(pixels, part(slider)) } else { pixels.max(0.0) }
}

/// A factor attenuated by its slider: 1 − slider (1 − factor) (eq. 48).
fn weighed(factor: f64, slider: f64) -> f64 {
    1.0 - part(slider) * (1.0 - part(factor))
}

/// A number clamped to 0 … 1; 0 if invalid.
fn part(x: f64) -> f64 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}
