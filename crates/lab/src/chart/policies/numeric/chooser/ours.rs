//! The default policy on a scene in numbers: things that come into view are added to it, things that leave are removed.
//!
//! In: things in view, measured times. Out: levels with a prediction and a certificate. Never here: its arithmetic.

use super::{Choice, Chooser, Pick, Time};
use crate::chart::policies::numeric::scene::{Scene, VisibleObject};
use metachron_lod::adaptive;
use metachron_lod::adaptive::{Adaptive, Offer, Settings};

/// The policy, and the things that it holds.
pub(super) struct Ours {
    adaptive: Adaptive,
    present: Vec<usize>,
    offers: Vec<Offer>,
}

/// Ticks per microsecond.
const TICKS: f64 = 100.0;

impl Default for Ours {
    fn default() -> Self {
        Self { adaptive: Adaptive::new(Settings::default()), present: Vec::new(), offers: Vec::new() }
    }
}

impl Chooser for Ours {
    fn choose(&mut self, frame: u64, scene: &Scene, seen: &[VisibleObject], time: Time) -> Choice {
        self.update_objects(scene, seen);
        let fixed = time.target - time.drawing();
        let plan = self
            .adaptive
            .choose(frame, adaptive::Time { target: TICKS * time.target, fixed: TICKS * fixed, reserved: 0.0 });
        let picks = seen.iter().map(|s| Pick::whole(self.adaptive.level(s.object as u64))).collect();
        Choice { picks, predicted: plan.predicted / TICKS, gap: plan.gap() }
    }

    fn learn(&mut self, frame: u64, took: f64, time: Time) {
        let fixed = time.target - time.drawing();
        self.adaptive.observe(frame, 0, TICKS * (took - fixed));
        self.adaptive.finished(frame, TICKS * took);
    }
}

impl Ours {
    fn update_objects(&mut self, scene: &Scene, seen: &[VisibleObject]) {
        let Self { adaptive, present, offers } = self;
        for gone in present.iter().filter(|object| seen.binary_search_by_key(*object, |s| s.object).is_err()) {
            adaptive.remove(*gone as u64);
        }
        for s in seen {
            offers.clear();
            offers.extend(s.levels.iter().map(|&(cost, gain)| Offer { cost: TICKS * cost, gain }));
            adaptive.set(s.object as u64, 0, false, offers);
            adaptive.weigh(s.object as u64, s.pixels * scene.objects[s.object].importance);
        }
        present.clear();
        present.extend(seen.iter().map(|s| s.object));
    }
}
