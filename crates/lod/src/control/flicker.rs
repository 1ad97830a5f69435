//! How often levels change, and change back: a measure of visible flicker.
//!
//! In: the levels of every frame. Out: counts. Never here: a choice.

use super::demand::plan::{LevelDemand, SizedView};
use metachron_core::AgentId;

/// A level that returns within this many frames is a reversal.
const REMEMBERED: usize = 3;

/// The last levels of one object, newest first.
#[derive(Debug, Clone, Copy)]
struct LevelHistory {
    id: AgentId,
    levels: [Option<LevelDemand>; REMEMBERED],
    /// Frames since its level changed; many for one that has just come into view.
    lasted: u8,
}

/// The last levels of all objects, in the order in which they are given.
#[derive(Debug, Clone, Default)]
pub(super) struct Changes {
    past: Vec<LevelHistory>,
}

impl Changes {
    /// The level of object `at` in the frame before and for how many frames it has had it; `None` where it was not in view.
    pub fn last(&self, at: usize, id: u64) -> Option<(LevelDemand, u8)> {
        let past = self.past.get(at).filter(|past| u64::from(past.id.0) == id)?;
        Some((past.levels[0]?, past.lasted))
    }

    /// Stores the levels of a frame; gives how many objects in view changed, and how many of these went back (A, B, A).
    pub fn count(&mut self, views: &[SizedView], levels: &[LevelDemand]) -> (u32, u32) {
        let unknown = LevelHistory { id: AgentId(0), levels: [None; REMEMBERED], lasted: u8::MAX };
        self.past.resize(views.len(), unknown);
        let (mut changes, mut reversals) = (0, 0);
        for ((SizedView { view, .. }, level), past) in views.iter().zip(levels).zip(&mut self.past) {
            if past.id != view.id || !view.visible {
                *past = LevelHistory { id: view.id, ..unknown };
            }
            if !view.visible {
                continue;
            }
            let changed = past.levels[0].is_some_and(|last| last != *level);
            let had_it = past.levels[1..].iter().flatten().any(|before| before == level);
            changes += u32::from(changed);
            reversals += u32::from(changed && had_it);
            past.lasted = if changed { 1 } else { past.lasted.saturating_add(1) };
            past.levels.rotate_right(1);
            past.levels[0] = Some(*level);
        }
        (changes, reversals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::demand::view::{Kind, ObjectView, Shading};
    use metachron_core::{Resolution, ResolutionRange};

    #[test]
    fn a_level_that_returns_is_a_reversal_and_an_object_back_in_view_is_new() {
        let at = |n| Resolution { eps_m: 1.0, n };
        let view = |visible| ObjectView {
            id: AgentId(3),
            kind: Kind::Counted { radius_m: 1.0, least: 4, most: 100 },
            range: ResolutionRange { eps_m: (1.0, 1.0), n: (0, 10) },
            shading: Default::default(),
            pixels: 1.0,
            distance_m: 1.0,
            speed_px_s: 0.0,
            own_speed_px_s: 0.0,
            importance: 1.0,
            off_centre: 0.0,
            depth_m: 1.0,
            visible,
            group: None,
            may_vanish: false,
            pieces: None,
            losses: None,
        };
        let mut changes = Changes::default();
        let mut frame = |n, visible| {
            let level = LevelDemand { id: AgentId(3), resolution: at(n), polygons: 4.0, shading: Shading::Flat };
            changes.count(&[SizedView::of(view(visible))], &[level])
        };
        assert_eq!(frame(1, true), (0, 0));
        assert_eq!(frame(2, true), (1, 0));
        assert_eq!(frame(1, true), (1, 1));
        assert_eq!(frame(1, true), (0, 0));
        assert_eq!(frame(5, false), (0, 0));
        assert_eq!(frame(2, true), (0, 0));
    }
}
