//! Parts of a tube that pass through a solid from the start: pushing them out would tear the tube.
//!
//! In: a tube's axis and a solid. Out: the parts of it that pass through without contact, until they have left the solid.
//! Never here: contacts. Theory: `docs/theory/contact.md`, eq. 25.

use super::Skin;
use metachron_geometry::PARTED;
use metachron_geometry::signed_distance::Field;
use metachron_geometry::signed_distance::Touch;
use std::ops::RangeInclusive;

/// Number of sample points of the axis per segment.
const PLACES: usize = 8;

/// The parts of a tube that started through one solid and have not left it since.
#[derive(Debug, Clone, Default)]
pub(super) struct Bores {
    /// Rest arc lengths, metres.
    parts: Vec<[f64; 2]>,
}

impl Bores {
    /// Finds the parts of a tube that start through the solid.
    pub fn new(skin: &Skin<'_>, field: &Field) -> Self {
        let axis = Axis { skin, field };
        let mut parts = Vec::new();
        let mut at = 0;
        while at <= axis.last() {
            let run = axis.run(at);
            if axis.is_parted(at..=run) {
                parts.push(axis.ends(at, run));
            }
            at = run + 1;
        }
        Self { parts }
    }

    /// Whether no part passes through.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Whether any part between two arc lengths passes through.
    pub fn overlap(&self, from_m: f64, to_m: f64) -> bool {
        self.parts.iter().any(|[low, high]| *low <= to_m && from_m <= *high)
    }

    /// Drops or shortens the parts that have left the solid.
    pub fn leave(&mut self, skin: &Skin<'_>, field: &Field) {
        let axis = Axis { skin, field };
        self.parts.retain_mut(|part| {
            let within = |at: &usize| (part[0]..=part[1]).contains(&axis.arc_m(*at)) && axis.way_out(*at).is_some();
            let mut still = (0..=axis.last()).filter(within);
            let Some(first) = still.next() else { return false };
            let last = still.next_back().unwrap_or(first);
            let [low, high] = axis.ends(first, last);
            *part = [part[0].max(low), part[1].min(high)];
            true
        });
    }
}

/// Sample points of a tube's axis, numbered from its start, with the solid they are tested against.
struct Axis<'a> {
    skin: &'a Skin<'a>,
    field: &'a Field,
}

impl Axis<'_> {
    fn last(&self) -> usize {
        PLACES * self.skin.segments()
    }

    /// The segment of a sample point, and its share of that segment.
    fn place(&self, at: usize) -> (usize, f64) {
        let segment = (at / PLACES).min(self.skin.segments() - 1);
        (segment, (at - PLACES * segment) as f64 / PLACES as f64)
    }

    fn arc_m(&self, at: usize) -> f64 {
        let (segment, share) = self.place(at);
        self.skin.arc_m[segment] + share * (self.skin.arc_m[segment + 1] - self.skin.arc_m[segment])
    }

    /// Where a run of inside points leaves the solid on both sides: the skin leaves one radius after the axis.
    fn ends(&self, first: usize, last: usize) -> [f64; 2] {
        let radius_m = self.skin.widest_m();
        let (before, after) = (first.saturating_sub(1), (last + 1).min(self.last()));
        [self.arc_m(before) - radius_m, self.arc_m(after) + radius_m]
    }

    /// The shortest way out of the solid, for a sample point inside it.
    fn way_out(&self, at: usize) -> Option<Touch> {
        let (segment, share) = self.place(at);
        let ball = self.skin.ball(segment).toward(self.skin.ball(segment + 1), share);
        self.field.touches(ball.centre, ball.radius_m).iter().next().filter(|touch| touch.distance_m < 0.0)
    }

    /// The last point of the run of inside points that begins at `at`; `at` itself where that is outside.
    fn run(&self, at: usize) -> usize {
        let inside = (at..=self.last()).take_while(|&place| self.way_out(place).is_some());
        inside.last().unwrap_or(at)
    }

    fn is_parted(&self, mut run: RangeInclusive<usize>) -> bool {
        let Some(first) = self.way_out(*run.start()) else { return false };
        run.any(|at| self.way_out(at).is_some_and(|touch| touch.normal.dot(first.normal) < PARTED))
    }
}
