//! The scale of the picture and its shadows, where everything else is as coarse as it may be and frames are still late.
//!
//! In: the time that a frame would have taken with all else at its coarsest, and its time drawn otherwise by the
//! prices.
//! Out: a [`PictureRung`]. Never here: levels of objects, drawing, enlarging. Theory: `docs/theory/control.md`, section 11.
//!
//! Pixels are the last to be taken and the first to be given back. The saving of a scale is known from the prices, and
//! its error is learnt from the time before and after each change; whether a frame is late is decided by the mean of
//! the frames since the last change and its uncertainty, so that a machine that trembles does not move the picture.

/// Fractions of the picture's width and height that can be drawn: steps of a twentieth, which are not seen.
pub(super) const SCALES: [f64; 14] = [0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0];

/// Least fraction with which shadows are drawn: they are missed less than more pixels would be.
const SHADOWED: f64 = 0.5;

/// The scale and shadows of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PictureRung {
    /// Fraction of its width and height, one of [`SCALES`].
    pub scale: f64,
    /// Whether objects throw shadows.
    pub shadows: bool,
}

/// From the least to the most: all scales of a range, without shadows up to half the width and height, with them from
/// there on. A range of one scale alone is fixed, with its shadows.
fn rungs(range: (f64, f64)) -> Vec<PictureRung> {
    let most = SCALES.iter().rposition(|scale| *scale <= range.1 + NEAR).unwrap_or(0);
    let least = SCALES.iter().position(|scale| *scale >= range.0 - NEAR).map_or(most, |least| least.min(most));
    let shadowed_from = SHADOWED.min(SCALES[most]);
    let of = |shadows: bool| move |scale: &f64| PictureRung { scale: *scale, shadows };
    let bare =
        SCALES[least..most].iter().chain(&SCALES[most..=most]).filter(|scale| **scale <= shadowed_from && least < most);
    let lit = SCALES[least..=most].iter().filter(|scale| **scale >= shadowed_from);
    bare.map(of(false)).chain(lit.map(of(true))).collect()
}

/// Frames of the means, in seconds …
const WINDOW_S: f64 = 1.0;
/// … and at least.
const WINDOW_FRAMES: f64 = 16.0;
/// Fewest frames that anything is decided by.
const FRAMES_MIN: f64 = 3.0;
/// A frame past the mean by this many standard deviations, and by this logarithm at least, is a stall, and so many of them in a row are
/// another load.
const STALL: (f64, f64) = (4.0, 0.1);
/// Standard errors by which a mean must be past a threshold, and the addition for few frames, over their number less
/// one: near Student's 0.975 quantile.
const CERTAIN: (f64, f64) = (2.0, 4.6);
/// A scale is gone to if it is predicted to need this fraction of the time, or less: the rest, and the uncertainty,
/// keep pixels from being taken and given in turn.
const FIT: f64 = 0.97;
/// Seconds before pixels that were taken are given back; doubled, up to the second, each time that they have to be taken again within four
/// times as long.
const PATIENCE_S: (f64, f64) = (0.5, 16.0);
/// Seconds from one change upward to the next.
const STEP_S: f64 = 0.2;
/// Variance of the pixels' unknown part at first, as a square of a factor; and the addition of each change to it,
/// because scenes move.
const DOUBT: (f64, f64) = (0.25, 0.02);
/// The range of the learnt factor.
const FACTOR: (f64, f64) = (0.25, 4.0);

/// Distance of two fractions that are one.
const NEAR: f64 = 1e-9;
/// Frames over which stalls are counted, and the part of them from which on stalls are the load.
const ODD: (f64, f64) = (16.0, 0.25);

/// One frame, as the controller of the scale sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ScaledFrame {
    /// Time that it would have taken with all else at its coarsest, seconds, > 0.
    pub coarsest_s: f64,
    /// The part of that spent on drawing, seconds, > 0.
    pub draw_s: f64,
    /// Whether nothing but pixels is left to take.
    pub spent: bool,
    /// Time that it should take, seconds, > 0.
    pub set_s: f64,
    /// Time between frames, seconds, > 0.
    pub period_s: f64,
}

/// Mean and variance of logarithms of times of the newest frames since a change: a stall counts for less than in a mean of times.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Window {
    frames: f64,
    mean: f64,
    variance: f64,
}

impl Window {
    fn add(&mut self, seconds: f64, most: f64) {
        let x = libm::log(seconds);
        self.frames = (self.frames + 1.0).min(most);
        let share = 1.0 / self.frames;
        let error = x - self.mean;
        self.mean += share * error;
        self.variance = (1.0 - share) * (self.variance + share * error * error);
    }

    fn mean_s(&self) -> f64 {
        libm::exp(self.mean)
    }

    /// Whether a time is unlike the others.
    fn excludes(&self, seconds: f64) -> bool {
        let far = (STALL.0 * libm::sqrt(self.variance)).max(STALL.1);
        self.frames >= FRAMES_MIN && (libm::log(seconds) - self.mean).abs() > far
    }

    /// Standard error of the mean.
    fn error(&self) -> f64 {
        libm::sqrt(self.variance / (self.frames - 1.0).max(1.0))
    }

    /// The time that the frames surely take at least, and at most, seconds.
    fn surely_s(&self) -> (f64, f64) {
        let doubt = (CERTAIN.0 + CERTAIN.1 / (self.frames - 1.0).max(1.0)) * self.error();
        (libm::exp(self.mean - doubt), libm::exp(self.mean + doubt))
    }
}

/// Times of frames and of their drawing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Times {
    work: Window,
    draw: Window,
}

impl Times {
    fn add(&mut self, frame: &ScaledFrame) {
        let most = (WINDOW_S / frame.period_s).max(WINDOW_FRAMES);
        self.work.add(frame.coarsest_s, most);
        self.draw.add(frame.draw_s, most);
    }
}

/// The times before a change, kept until the times after it are known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    before: Window,
    /// By how much the time was to change by the prices.
    priced_s: f64,
}

/// Chooses the scale of every picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RenderScale {
    /// From the least to the most; there is one at least.
    rungs: Vec<PictureRung>,
    at: usize,
    /// Times of the frames at this scale, and of the newest that are unlike them.
    times: Times,
    unlike: Times,
    /// The part of the newest frames that were unlike them.
    odd: f64,
    /// Seconds at this scale, since pixels were taken, and since they were given back.
    held_s: f64,
    taken_s: f64,
    given_s: f64,
    patience_s: f64,
    change: Option<Change>,
    /// Whether frames are late by their mean.
    late: bool,
    /// How much more the pixels' part changes than by the prices, and the variance of that.
    factor: f64,
    doubt: f64,
}

impl Default for RenderScale {
    /// Every pixel, always.
    fn default() -> Self {
        Self::new((1.0, 1.0))
    }
}

impl RenderScale {
    /// A controller that stays inside `range`; at the scale below it where none lies inside.
    pub fn new(range: (f64, f64)) -> Self {
        let rungs = rungs(range);
        Self {
            at: rungs.len() - 1,
            rungs,
            times: Times::default(),
            unlike: Times::default(),
            odd: 0.0,
            held_s: 0.0,
            taken_s: f64::INFINITY,
            given_s: f64::INFINITY,
            patience_s: PATIENCE_S.0,
            change: None,
            late: false,
            factor: 1.0,
            doubt: DOUBT.0,
        }
    }

    /// The next picture.
    pub fn rung(&self) -> PictureRung {
        self.rungs[self.at]
    }

    /// Whether anything is taken of the picture: then no other part may take the time that it needs.
    pub fn is_reduced(&self) -> bool {
        self.at + 1 < self.rungs.len()
    }

    /// A picture of which nothing is taken.
    pub fn most(&self) -> PictureRung {
        self.rungs[self.rungs.len() - 1]
    }

    /// Whether something is taken, and frames are in time.
    pub fn helps(&self) -> bool {
        self.is_reduced() && !self.late
    }

    /// The least and the most that the scale may be.
    pub fn bounds(&self) -> (f64, f64) {
        (self.rungs[0].scale, self.most().scale)
    }

    /// Gives all back, and starts anew: others choose now.
    pub fn release(&mut self) {
        self.bound(self.bounds());
    }

    /// Starts anew inside other bounds.
    pub fn bound(&mut self, range: (f64, f64)) {
        let throws = self.most().shadows;
        *self = Self::new(range);
        self.set_throws_shadows(throws);
    }

    /// Says whether the light throws shadows; where it does not, there are none to take, and one rung for each scale.
    pub fn set_throws_shadows(&mut self, throws: bool) {
        if throws != self.most().shadows {
            let mut rungs = rungs(self.bounds());
            if !throws {
                rungs.iter_mut().for_each(|rung| rung.shadows = false);
                rungs.dedup();
            }
            (self.at, self.rungs) = (rungs.len() - 1, rungs);
            self.disturb();
        }
    }

    /// Whether there is nothing to choose.
    pub fn is_fixed(&self) -> bool {
        self.rungs.len() == 1
    }

    /// Forgets the frames at this scale: they were unlike later ones.
    pub fn disturb(&mut self) {
        (self.times, self.unlike, self.odd, self.change) = (Times::default(), Times::default(), 0.0, None);
    }

    /// Takes a frame, and chooses. `priced_s` is the time of drawing the picture so by the prices, with all else at its coarsest.
    pub fn observe(&mut self, frame: ScaledFrame, priced_s: impl Fn(PictureRung) -> f64) {
        let ScaledFrame { coarsest_s, draw_s, spent, set_s, period_s } = frame;
        let sound = [coarsest_s, draw_s, set_s, period_s].iter().all(|s| s.is_finite() && *s > 0.0);
        if self.is_fixed() || !sound {
            return;
        }
        [&mut self.held_s, &mut self.taken_s, &mut self.given_s].into_iter().for_each(|s| *s += period_s);
        if !spent && !self.is_reduced() {
            return self.disturb();
        }
        self.add(&frame);
        self.learn();
        let work = self.times.work;
        self.late = work.mean_s() > set_s;
        if work.frames < FRAMES_MIN {
            return;
        }
        let (least_s, most_s) = work.surely_s();
        if spent && least_s > set_s {
            self.take(least_s, set_s, &priced_s);
        } else if self.held_s >= STEP_S && self.taken_s >= self.patience_s && most_s <= FIT * set_s {
            self.give(most_s, set_s, &priced_s);
        }
    }

    /// Counts a frame: among the frames at this scale, or, if it is unlike them, among such, which replace them once
    /// they are enough in a row. Where too many are unlike the others all count.
    fn add(&mut self, frame: &ScaledFrame) {
        let Times { work, .. } = self.times;
        let is_odd = work.excludes(frame.coarsest_s);
        self.odd += (f64::from(u8::from(is_odd)) - self.odd) / ODD.0;
        if self.odd > ODD.1 {
            self.disturb();
        }
        if !is_odd || self.times.work.frames == 0.0 {
            self.unlike = Times::default();
            return self.times.add(frame);
        }
        let side = |mean: f64| mean > work.mean;
        if side(self.unlike.work.mean) != side(libm::log(frame.coarsest_s)) {
            self.unlike = Times::default();
        }
        self.unlike.add(frame);
        if self.unlike.work.frames >= FRAMES_MIN {
            self.times = std::mem::take(&mut self.unlike);
        }
    }

    /// Goes to the largest scale that frames of `most_s` are predicted to be early with, were pixels a standard deviation dearer than is known.
    fn give(&mut self, most_s: f64, set_s: f64, priced_s: &impl Fn(PictureRung) -> f64) {
        let factor = self.factor + libm::sqrt(self.doubt);
        let early = |at: &usize| most_s + factor * self.priced_change_s(*at, priced_s) <= FIT * set_s;
        if let Some(to) = (self.at + 1..self.rungs.len()).rev().find(early) {
            self.given_s = 0.0;
            self.go(to, priced_s);
        }
    }

    /// Goes to the largest scale that frames of `least_s` are predicted to be in time with; to the fastest if there is none.
    fn take(&mut self, least_s: f64, set_s: f64, priced_s: &impl Fn(PictureRung) -> f64) {
        let change_s = |at: usize| self.factor * self.priced_change_s(at, priced_s);
        let smaller = (0..self.at).rev();
        let fits = smaller.clone().find(|at| least_s + change_s(*at) <= FIT * set_s);
        let fastest = smaller.min_by(|a, b| change_s(*a).total_cmp(&change_s(*b)));
        let Some(to) = fits.or(fastest).filter(|to| change_s(*to) < 0.0) else { return };
        if self.given_s < 4.0 * self.patience_s {
            self.patience_s = (2.0 * self.patience_s).min(PATIENCE_S.1);
        } else {
            self.patience_s = PATIENCE_S.0;
        }
        self.taken_s = 0.0;
        self.go(to, priced_s);
    }

    /// By how much a frame takes longer at another scale by the prices, seconds.
    fn priced_change_s(&self, at: usize, priced_s: &impl Fn(PictureRung) -> f64) -> f64 {
        let here_s = priced_s(self.rung());
        if here_s > 0.0 { self.times.draw.mean_s() * (priced_s(self.rungs[at]) / here_s - 1.0) } else { 0.0 }
    }

    fn go(&mut self, to: usize, priced_s: &impl Fn(PictureRung) -> f64) {
        let change = Change { before: self.times.work, priced_s: self.priced_change_s(to, priced_s) };
        (self.at, self.held_s) = (to, 0.0);
        self.disturb();
        self.change = Some(change);
    }

    /// Learns the factor from the last change, once the times after it are known.
    fn learn(&mut self) {
        let Some(Change { before, priced_s }) = self.change.filter(|_| self.held_s >= STEP_S) else { return };
        self.change = None;
        // no mean is better known than to a hundredth
        let square = |w: Window| (w.error() * w.error() + 1e-4) * w.mean_s() * w.mean_s();
        let noise_s2 = square(before) + square(self.times.work);
        self.doubt += DOUBT.1;
        let gain = self.doubt / (self.doubt + noise_s2 / (priced_s * priced_s));
        let measured = (self.times.work.mean_s() - before.mean_s()) / priced_s;
        if measured.is_finite() && gain.is_finite() {
            self.factor = crate::within(self.factor + gain * (measured - self.factor), FACTOR.0, FACTOR.1);
            self.doubt *= 1.0 - gain;
        }
    }
}

#[cfg(test)]
mod tests;
