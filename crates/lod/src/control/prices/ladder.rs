//! The levels that an object can be drawn at, as rungs with a cost and an accuracy: the options of a selection.
//!
//! In: descriptions of objects, prices. Out: a [`Ladder`] per object, recomputed only if something it depends on has changed. Never here: a
//! choice, or the present benefit of an object ([`crate::control::prices::benefit`]). Theory: `docs/theory/control.md`, eq. 23.

use super::benefit;
use super::benefit::Seen;
use super::price::Prices;
use crate::control::demand::level::{Cut, LastCut, Span, open, polygons};
use crate::control::demand::plan::{LevelDemand, SizedView};
use crate::control::demand::view::{Kind, Losses, ObjectView, Pieces, Shading};
use crate::cost::benefit::Sliders;
use crate::hysteresis;
use metachron_core::{AgentId, N_MAX, Resolution, ResolutionRange};

/// Total rungs per octave of polygons, divided by the number of objects: a single object may have fine steps, hundreds get coarse ones.
const STEPS: usize = 256;

/// Fewest and most rungs per octave: past the most, a step is below a twentieth of an object.
const STEPS_AN_OCTAVE: (usize, usize) = (2, 16);

/// Accuracy added by each step beyond the object's requested range.
const RAISED: f64 = 1e-12;

/// Lengths and radii that differ by less than this factor give the same ladder: a tube that stretches slightly keeps its own.
const SAME: f64 = 1.1;

/// Pixels that an object of every type is assumed to cover where types are ordered by complexity: the constant area A of (RH05, §5.1).
const COMPLEXITY_PX: f64 = 4096.0;

/// One level of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rung {
    pub resolution: Resolution,
    pub polygons: f64,
    pub shading: Shading,
    /// Seconds by the prices.
    pub cost_s: f64,
    /// Fraction of the object's pixels drawn correctly, 0 … 1; for an impostor, relative to the finest impostor.
    pub accuracy: f64,
}

/// The inputs that the rungs depend on.
#[derive(Debug, Clone, Copy)]
struct Key {
    id: AgentId,
    kind: Kind,
    pieces: Option<Pieces>,
    losses: Option<Losses>,
    range: ResolutionRange,
    shading: (Shading, Shading),
    /// Pixels covered, in half octaves.
    size: u8,
    steps: usize,
    /// Whether the object may be drawn better than its requested range.
    raise: bool,
}

/// Seconds of an object in its best shading as a line over its triangles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CostLine {
    /// Of the object without a triangle or a pixel.
    pub setup_s: f64,
    /// Triangles below which fewer save no time: at least the object's fewest (GB99).
    pub from: f64,
    /// At that number.
    pub from_s: f64,
    /// Of a triangle more.
    pub polygon_s: f64,
}

impl CostLine {
    fn of(prices: &Prices, view: &ObjectView, span: Span, pixels: f64) -> Self {
        let shading = view.shading.1;
        let from = prices.free_polygons(shading, pixels).clamp(span.least, span.full);
        let to = span.full.min(pixels).max(from + 1.0);
        let [from_s, to_s] = [from, to].map(|polygons| prices.pieces_s(view.pieces, shading, polygons, pixels));
        Self { setup_s: prices.object_s(shading, 0.0, 0.0), from, from_s, polygon_s: (to_s - from_s) / (to - from) }
    }

    /// Seconds at a number of triangles.
    pub fn at(&self, polygons: f64) -> f64 {
        self.from_s + self.polygon_s * (polygons - self.from).max(0.0)
    }
}

/// The levels of one object, cheapest first; for a group its impostors.
#[derive(Debug, Clone)]
pub(crate) struct Ladder {
    key: Key,
    /// Changes whenever the rungs change.
    pub version: u64,
    pub rungs: Vec<Rung>,
    /// Number of rungs inside the object's requested range; the rungs after them raise its quality further.
    pub asked: usize,
    /// Complexity of the object's type: seconds of its finest form in its best shading where it covers an area that is the same for all
    /// types, whatever the camera sees of it (RH05, §5.1).
    pub complexity_s: f64,
    pub line: CostLine,
}

/// The ladders of all objects, in the order in which they are given.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ladders {
    all: Vec<Ladder>,
    made: u64,
    /// Distinct ladders made for this frame: after a turn of the camera hundreds of objects need a new one simultaneously, and copies of
    /// one object at one size share it.
    new: Vec<usize>,
}

impl Ladders {
    /// Updates the ladders of all objects in view.
    pub fn update(&mut self, views: &[SizedView], raise: bool, prices: &Prices, sliders: &Sliders) {
        let steps = steps_an_octave(views);
        self.all.truncate(views.len());
        self.new.clear();
        for (at, seen) in views.iter().enumerate() {
            let before = self.all.get(at).map(|ladder| ladder.key);
            let view = &seen.view;
            let known = before.filter(|before| before.id == view.id);
            // an object out of view keeps its ladder
            if known.is_some() && !view.visible {
                continue;
            }
            let key = Key::of(view, steps, raise, before);
            if known.is_some_and(|known| known.is_same(&key)) {
                continue;
            }
            self.made += 1;
            let alike = self.new.iter().map(|&at| &self.all[at]).find(|ladder| ladder.key.is_copy(&key));
            let ladder = match alike {
                Some(ladder) => Ladder { key, version: self.made, ..ladder.clone() },
                None => Ladder::new(key, self.made, seen, prices, sliders),
            };
            if alike.is_none() {
                self.new.push(at);
            }
            match self.all.get_mut(at) {
                Some(place) => *place = ladder,
                None => self.all.push(ladder),
            }
        }
    }

    /// Deletes all ladders: prices or sliders have changed.
    pub fn clear(&mut self) {
        self.all.clear();
    }

    /// The ladder of object `at`, if there is one.
    pub fn get(&self, at: usize) -> Option<&Ladder> {
        self.all.get(at)
    }

    /// The ladder of the object given as number `at`.
    pub fn of(&self, at: usize) -> &Ladder {
        &self.all[at]
    }
}

/// Rungs per octave: the more objects there are, the less the rounding of a single one matters.
fn steps_an_octave(views: &[SizedView]) -> usize {
    let objects = views.iter().filter(|seen| seen.span.full > seen.span.least).count().max(1);
    let wish = (STEPS / objects).clamp(STEPS_AN_OCTAVE.0, STEPS_AN_OCTAVE.1);
    1 << wish.ilog2()
}

impl Key {
    fn of(view: &ObjectView, steps: usize, raise: bool, before: Option<Self>) -> Self {
        let held = before.filter(|before| before.id == view.id).map(|before| before.size);
        let size = hysteresis::floor(held, 2.0 * libm::log2(benefit::pixels(view).max(1.0)));
        let ObjectView { id, kind, pieces, losses, range, shading, .. } = *view;
        Self { id, kind, pieces, losses, range, shading, size, steps, raise }
    }

    fn is_same(&self, other: &Self) -> bool {
        let kinds = match (self.kind, other.kind) {
            (Kind::Tube { length_m: l, radius_m: r }, Kind::Tube { length_m, radius_m }) => {
                is_near(l, length_m) && is_near(r, radius_m)
            }
            (Kind::Primitive { triangles: a, .. }, Kind::Primitive { triangles: b, .. }) => a == b,
            (Kind::Counted { least: a, most: b, .. }, Kind::Counted { least, most, .. }) => (a, b) == (least, most),
            (Kind::Group { impostors: a, .. }, Kind::Group { impostors: b, .. }) => a == b,
            _ => false,
        };
        kinds
            && self.pieces == other.pieces
            && self.losses == other.losses
            && (self.range, self.shading, self.size, self.steps, self.raise)
                == (other.range, other.shading, other.size, other.steps, other.raise)
    }

    /// Whether both keys give bit-identical rungs: meshes of one size.
    fn is_copy(&self, other: &Self) -> bool {
        matches!((self.kind, other.kind), (Kind::Counted { .. }, Kind::Counted { .. })) && self.is_same(other)
    }

    /// Pixels at the middle of the half octave.
    fn pixels(&self) -> f64 {
        libm::exp2(0.5 * f64::from(self.size) + 0.25)
    }
}

fn is_near(a: f64, b: f64) -> bool {
    a <= SAME * b && b <= SAME * a
}

impl Ladder {
    fn new(key: Key, version: u64, seen: &SizedView, prices: &Prices, sliders: &Sliders) -> Self {
        let SizedView { view, span } = seen;
        let rung = |cut, shading| key.rung(cut, shading, prices, sliders);
        if view.is_group() {
            let rungs = key.impostors(view, rung);
            return Self { key, version, asked: rungs.len(), rungs, complexity_s: 0.0, line: CostLine::default() };
        }
        let allowed = move |s: &Shading| (key.shading.0..=key.shading.1).contains(s) || *s == key.shading.1;
        let mut rungs: Vec<Rung> = Vec::new();
        for cut in key.cuts(view, *span) {
            rungs.extend(Shading::PRICED.into_iter().filter(allowed).map(|shading| rung(cut, shading)));
        }
        rungs.sort_by(|a, b| a.cost_s.total_cmp(&b.cost_s).then(a.accuracy.total_cmp(&b.accuracy)));
        let asked = rungs.len();
        if key.raise {
            key.raise(view, &mut rungs, rung);
        }
        let complexity_s = prices.pieces_s(view.pieces, view.shading.1, span.full, COMPLEXITY_PX);
        let line = CostLine::of(prices, view, *span, key.pixels());
        Self { key, version, rungs, asked, complexity_s, line }
    }

    /// A level of the object as a rung, which may have been one of an earlier ladder.
    pub fn rung_of(&self, level: &LevelDemand, prices: &Prices, sliders: &Sliders) -> Rung {
        let LevelDemand { resolution, polygons, shading, .. } = *level;
        let same = |rung: &&Rung| rung.polygons == polygons && rung.shading == shading;
        let own = || self.key.rung(Cut { resolution, polygons }, shading, prices, sliders);
        self.rungs.iter().find(same).copied().unwrap_or_else(own)
    }

    /// Size of a triangle on the screen, pixels across, at the geometric middle of the ladder: used for motion blur.
    pub fn polygon_px(&self) -> f64 {
        let ends =
            self.rungs.first().zip(self.rungs[..self.asked].last()).map(|(a, b)| libm::sqrt(a.polygons * b.polygons));
        libm::sqrt(self.key.pixels() / ends.unwrap_or(1.0).max(1.0)).max(1e-3)
    }
}

impl Key {
    /// The distinct shapes that the object can be cut to, in ascending polygons.
    fn cuts(&self, view: &ObjectView, span: Span) -> Vec<Cut> {
        // below one pixel per triangle no difference is visible
        let most = span.full.min(self.pixels()).max(span.least);
        let fine = 1.0 / self.steps as f64;
        let octaves = libm::log2(most / span.least);
        let count = if octaves.is_finite() { libm::ceil(octaves / fine) as usize } else { 0 };
        let wishes = (0..count).map(|k| span.least * libm::exp2(fine * k as f64)).chain([most]);
        let mut cuts: Vec<_> = wishes.map(|wish| LastCut::default().choose(view, span, wish)).collect();
        cuts.sort_by(|a, b| a.polygons.total_cmp(&b.polygons));
        cuts.dedup_by(|a, b| a.polygons <= b.polygons);
        cuts
    }

    /// The impostors of a group, each with the best shading; accuracy is relative to the finest, whose benefit is in [`crate::control::choice::groups`].
    fn impostors(&self, view: &ObjectView, rung: impl Fn(Cut, Shading) -> Rung) -> Vec<Rung> {
        let at = |n| Resolution { eps_m: self.range.eps_m.1, n };
        let one = |n| rung(Cut { resolution: at(n), polygons: polygons(view, at(n)) }, self.shading.1);
        let mut rungs: Vec<_> = (0..open(view)).map(one).collect();
        let finest = rungs.last().map_or(1.0, |finest| finest.accuracy);
        // where the finest is all wrong none is better than another
        let part = |accuracy: f64| if finest > 0.0 { accuracy / finest } else { 1.0 };
        rungs.iter_mut().for_each(|rung| rung.accuracy = part(rung.accuracy));
        rungs
    }

    /// Adds rungs above the requested range: a smoother shape, soft shadows, both. Their added accuracy is negligible, so none is taken
    /// while anything else can use the time.
    fn raise(&self, view: &ObjectView, rungs: &mut Vec<Rung>, rung: impl Fn(Cut, Shading) -> Rung) {
        let Some(full) = rungs.iter().copied().max_by(|a, b| a.accuracy.total_cmp(&b.accuracy)) else { return };
        let Resolution { eps_m, n } = full.resolution;
        let finer = match self.kind {
            Kind::Tube { .. } => Resolution { eps_m: 0.5 * eps_m, n },
            _ => Resolution { eps_m, n: (n + 1).min(N_MAX) },
        };
        let polygons = match self.kind {
            Kind::Counted { .. } | Kind::Group { .. } => full.polygons,
            _ => polygons(view, finer),
        };
        let smoother =
            (polygons > full.polygons && polygons <= self.pixels()).then_some(Cut { resolution: finer, polygons });
        let plain = Cut { resolution: full.resolution, polygons: full.polygons };
        let better = [
            smoother.map(|cut| rung(cut, full.shading)),
            Some(rung(plain, Shading::Shadowed)),
            smoother.map(|cut| rung(cut, Shading::Shadowed)),
        ];
        for (k, rung) in better.into_iter().flatten().enumerate() {
            rungs.push(Rung { accuracy: full.accuracy + RAISED * (k + 1) as f64, ..rung });
        }
    }

    fn rung(&self, cut: Cut, shading: Shading, prices: &Prices, sliders: &Sliders) -> Rung {
        let Cut { resolution, polygons } = cut;
        let pixels = self.pixels();
        let seen = Seen { kind: self.kind, losses: self.losses, best: self.shading.1, pixels };
        let accuracy = benefit::accuracy(&seen, polygons, shading);
        let slid = 1.0 - sliders.accuracy.clamp(0.0, 1.0) * (1.0 - accuracy);
        let cost_s = prices.pieces_s(self.pieces, shading, polygons, pixels);
        Rung { resolution, polygons, shading, cost_s, accuracy: slid }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ladder(impostors: [u32; 8]) -> Ladder {
        measured(impostors, None)
    }

    fn measured(impostors: [u32; 8], losses: Option<Losses>) -> Ladder {
        let range = ResolutionRange { eps_m: (1.0, 1.0), n: (0, N_MAX) };
        let kind = Kind::Group { radius_m: 1.0, impostors };
        let view = ObjectView { range, losses, pixels: 1e4, ..ObjectView::plain(0, kind) };
        let mut ladders = Ladders::default();
        ladders.update(&[SizedView::of(view)], true, &Prices::default(), &Sliders::default());
        ladders.of(0).clone()
    }

    #[test]
    fn a_group_has_a_rung_for_each_impostor_and_the_finest_has_accuracy_one() {
        let Ladder { rungs, asked, .. } = ladder([20, 80, 320, 0, 0, 0, 0, 0]);
        assert_eq!(
            rungs.iter().map(|r| (r.resolution.n, r.polygons)).collect::<Vec<_>>(),
            [(0, 20.0), (1, 80.0), (2, 320.0)]
        );
        // 1 - 1/2 a coarsest: half, 7/8 and 31/32 of the covered pixels; a group gets no rungs above its range
        let parts: Vec<f64> = rungs.iter().map(|rung| rung.accuracy).collect();
        let expected = [0.5 / (31.0 / 32.0), (7.0 / 8.0) / (31.0 / 32.0), 1.0];
        assert!(parts.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12) && asked == 3, "{parts:?}");
        let costs: Vec<f64> = rungs.iter().map(|rung| 1e6 * rung.cost_s).collect();
        let by_hand = [20.0, 80.0, 320.0].map(|polygons| 5.0 + 0.22 * polygons);
        assert!(costs.iter().zip(by_hand).all(|(a, b)| (a - b).abs() < 1e-9), "{costs:?}");
    }

    #[test]
    fn a_single_impostor_has_accuracy_one_and_no_impostor_gives_no_rung() {
        let one = ladder([37, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(one.rungs.iter().map(|rung| rung.accuracy).collect::<Vec<_>>(), [1.0]);
        assert!(ladder([0; 8]).rungs.is_empty());
        assert_eq!(ladder([1, 2, 3, 4, 5, 6, 7, 8]).rungs.len(), 8);
    }

    #[test]
    fn impostors_lose_what_was_measured_of_the_mesh_that_they_are_cut_from() {
        let forms = [1.0, 1.0, 1.0, 0.9, 0.8, 0.6, 0.4, 0.2, 0.0];
        let losses = Losses { forms, range: (2, 512), texture: 0.0 };
        let Ladder { rungs, .. } = measured([32, 128, 256, 0, 0, 0, 0, 0], Some(losses));
        // 0.6, 0.8 and 0.9 of the pixels of the whole mesh, over those of the finest impostor
        let parts = rungs.iter().map(|rung| rung.accuracy);
        assert!(parts.zip([0.6 / 0.9, 0.8 / 0.9, 1.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{rungs:?}");
        let worse_than_nothing = measured([2, 8, 0, 0, 0, 0, 0, 0], Some(Losses { forms: [2.5; 9], ..losses }));
        assert!(worse_than_nothing.rungs.iter().all(|rung| rung.accuracy == 1.0), "{worse_than_nothing:?}");
    }

    #[test]
    fn a_rung_loses_what_was_measured_of_the_forms_beside_it_and_of_the_texture() {
        let rungs = |losses: Option<Losses>| {
            let kind = Kind::Counted { radius_m: 1.0, least: 2, most: 512 };
            let shading = (Shading::PerPixel, Shading::Textured);
            let view = ObjectView { losses, shading, pixels: 1e6, ..ObjectView::plain(0, kind) };
            let mut ladders = Ladders::default();
            ladders.update(&[SizedView::of(view)], false, &Prices::default(), &Sliders::default());
            let of = |polygons: f64, shading| {
                let found =
                    ladders.of(0).rungs.iter().find(|rung| (rung.polygons, rung.shading) == (polygons, shading));
                found.unwrap().accuracy
            };
            [of(2.0, Shading::Textured), of(32.0, Shading::Textured), of(512.0, Shading::PerPixel)]
        };
        // of 2, 4 … 512 triangles; the coarsest covers more wrongly than the object has pixels
        let forms = [1.6, 0.9, 0.8, 0.7, 0.6, 0.3, 0.2, 0.1, 0.0];
        let measured = rungs(Some(Losses { forms, range: (2, 512), texture: 0.02 }));
        assert!(measured.iter().zip([0.2, 0.7, 0.98]).all(|(a, b)| (a - b).abs() < 1e-6), "{measured:?}");
        assert_eq!(rungs(None), [0.5, 1.0 - 0.5 / 16.0, (1.0 - 0.5 / 256.0) * 0.75]);
        let between = Losses { forms, range: (2, 512), texture: 0.0 }.of_form(32.0 * libm::sqrt(2.0));
        assert!((between - 0.45).abs() < 1e-6, "{between}");
        // a mesh of one form only loses nothing
        assert_eq!(Losses { forms: [0.0; 9], range: (7, 7), texture: 0.0 }.of_form(7.0), 0.0);
    }

    #[test]
    fn the_complexity_of_a_type_is_the_same_wherever_its_objects_are() {
        let complexity = |pixels: f64, most: u32| {
            let kind = Kind::Counted { radius_m: 1.0, least: 4, most };
            let mut ladders = Ladders::default();
            ladders.update(
                &[SizedView::of(ObjectView { pixels, ..ObjectView::plain(0, kind) })],
                false,
                &Prices::default(),
                &Sliders::default(),
            );
            ladders.of(0).complexity_s
        };
        // 5 µs and 0.22 µs a triangle at any area, by the default prices
        for pixels in [1.0, 300.0, 1e6] {
            assert!((complexity(pixels, 500) - (5e-6 + 500.0 * 0.22e-6)).abs() < 1e-12);
            assert!(complexity(pixels, 500) < complexity(1e6 / pixels, 800));
        }
    }
}
