//! Geomorphs: a mesh changes its cut gradually over a few frames, so that no jump is visible.
//!
//! In: the triangles requested, frame by frame. Out: the cut that is drawn, and its morph fraction towards a coarser one. Never here: the
//! choice of the count, the GPU. Theory: `docs/theory/multiresolution.md`.
//!
//! A refining mesh is drawn with all requested triangles immediately, starting at the positions of the coarser cut. A coarsening mesh keeps
//! more triangles than requested until its morph ends, as long as the frame's allowance lasts; without allowance it jumps.

use super::picture::MeshKey;
use metachron_drawable::{Cut, ProgressiveMesh};

/// Limits on morphs in a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Allowance {
    /// Morph fraction per frame; 1 and more is immediate.
    pub step: f32,
    /// Triangles that may be drawn beyond the requested ones.
    pub triangles: f64,
}

/// A mesh at a cut, or morphing from one cut to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Geomorph {
    /// The triangles last requested.
    asked: u32,
    /// Both ends of the morph; equal at rest.
    fine: Cut,
    coarse: Cut,
    /// Morph fraction from the fine end towards the coarse one, 0 … 1.
    share: f32,
    /// Whether the morph goes towards the fine end.
    rising: bool,
}

impl Geomorph {
    /// At rest at the cut for `triangles`.
    pub fn at(progressive: &ProgressiveMesh, triangles: u32) -> Self {
        Self::resting(triangles, progressive.cut(triangles))
    }

    fn resting(asked: u32, cut: Cut) -> Self {
        Self { asked, fine: cut, coarse: cut, share: 0.0, rising: false }
    }

    /// Advances by one frame towards the cut for `triangles`.
    pub fn advance(&mut self, progressive: &ProgressiveMesh, triangles: u32, allowance: &mut Allowance) {
        if triangles != self.asked {
            self.asked = triangles;
            self.aim(progressive.cut(triangles));
        }
        if self.fine == self.coarse {
            return;
        }
        let (wanted, left) = if self.rising { (self.fine, self.share) } else { (self.coarse, 1.0 - self.share) };
        let more = f64::from(self.fine.triangles - wanted.triangles);
        if left <= allowance.step || more > allowance.triangles {
            *self = Self::resting(self.asked, wanted);
            return;
        }
        allowance.triangles -= more;
        self.share += if self.rising { -allowance.step } else { allowance.step };
    }

    /// Sets the ends of the morph so that the requested cut is one of them, as near as possible to the shape last drawn.
    fn aim(&mut self, to: Cut) {
        let rests = self.fine == self.coarse;
        (self.fine, self.coarse, self.share, self.rising) = match () {
            () if rests && to > self.fine => (to, self.coarse, 1.0, true),
            () if rests => (self.fine, to, 0.0, false),
            () if to >= self.fine || (self.rising && to > self.coarse) => (to, self.coarse, self.share, true),
            // the refinement in progress is dropped: the new morph starts at its coarse end
            () if self.rising => (self.coarse, to, 0.0, false),
            () => (self.fine, to, self.share, false),
        };
    }

    /// The mesh key drawn for model number `model`, and its morph fraction towards the coarse end.
    pub fn drawn(&self, model: u32) -> (MeshKey, f32) {
        if self.share > 0.0 {
            (MeshKey::Geomorph(model, self.fine, self.coarse.vertices), self.share)
        } else {
            (MeshKey::Cut(model, self.fine), 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_drawable::{Generator, generate};

    fn progressive() -> ProgressiveMesh {
        ProgressiveMesh::new(&generate(Generator::Blob, 1, 2000)).unwrap()
    }

    fn drawn(geomorph: &Geomorph) -> (u32, f32) {
        match geomorph.drawn(0) {
            (MeshKey::Cut(_, cut) | MeshKey::Geomorph(_, cut, _), share) => (cut.triangles, share),
            (key, _) => panic!("{key:?}"),
        }
    }

    /// The cuts drawn frame by frame while `asked` is constant, with an allowance of `triangles` per frame.
    fn frames(geomorph: &mut Geomorph, progressive: &ProgressiveMesh, asked: u32, triangles: f64) -> Vec<(u32, f32)> {
        let frame = |_| {
            geomorph.advance(progressive, asked, &mut Allowance { step: 0.25, triangles });
            drawn(geomorph)
        };
        (0..6).map(frame).collect()
    }

    #[test]
    fn a_finer_cut_has_its_triangles_at_once_and_its_shape_after_the_geomorph() {
        let progressive = progressive();
        let (coarse, fine) = (progressive.cut(200).triangles, progressive.cut(900).triangles);
        let mut geomorph = Geomorph::at(&progressive, 200);
        assert_eq!(drawn(&geomorph), (coarse, 0.0));
        let seen = frames(&mut geomorph, &progressive, 900, 0.0);
        assert_eq!(seen, [0.75, 0.5, 0.25, 0.0, 0.0, 0.0].map(|share| (fine, share)));
    }

    #[test]
    fn coarser_cuts_keep_their_triangles_while_the_allowance_lasts() {
        let progressive = progressive();
        let (coarse, fine) = (progressive.cut(200).triangles, progressive.cut(900).triangles);
        let mut geomorph = Geomorph::at(&progressive, 900);
        let mut jump = geomorph;
        let seen = frames(&mut geomorph, &progressive, 200, f64::from(fine - coarse));
        assert_eq!(seen[..3], [0.25, 0.5, 0.75].map(|share| (fine, share)));
        assert_eq!(seen[3..], [(coarse, 0.0); 3]);
        assert_eq!(frames(&mut jump, &progressive, 200, f64::from(fine - coarse - 1)), [(coarse, 0.0); 6]);
    }

    #[test]
    fn a_geomorph_never_draws_more_than_requested_plus_the_allowance() {
        let progressive = progressive();
        let mut geomorph = Geomorph::at(&progressive, 300);
        let mut state = 1_u64;
        for _ in 0..3000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let asked = 40 + (state >> 40) as u32 % 1900;
            let mut allowance = Allowance { step: 0.2, triangles: 150.0 };
            geomorph.advance(&progressive, asked, &mut allowance);
            let (triangles, share) = drawn(&geomorph);
            assert!(f64::from(triangles) <= f64::from(asked) + 150.0 - allowance.triangles, "{triangles} of {asked}");
            assert!((0.0..=1.0).contains(&share) && allowance.triangles >= 0.0);
        }
        frames(&mut geomorph, &progressive, 500, 0.0);
        assert_eq!(drawn(&geomorph), (progressive.cut(500).triangles, 0.0));
    }
}
