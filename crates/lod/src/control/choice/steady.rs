//! A price for each change of level, for policies that choose every frame anew: no level comes and goes within a few frames.
//!
//! In: a choice, the levels of the frame before. Out: the choice in which levels stay where that is worth more than what it costs. Never here:
//! a policy's own rule. Theory: `docs/theory/budget.md`, eq. 16a.
//!
//! Two frames are one problem: every object has the level of the frame before or the new one, a change costs all pixels of the object at
//! first and less in every frame that its level lasts, and the time is bounded. It is solved by its relaxation: what has just changed stays, and
//! until that fits, what loses least for a second gives way: a level that stays, or a rise, which waits.

use super::groups::Groups;
use super::hierarchy::leave_out_members;
use crate::control::choice::feedback::unseen;
use crate::control::demand::plan::LevelDemand;
use crate::control::demand::query::{FrameQuery, Promise};
use crate::control::flicker::Changes;

/// Frames after which a change costs nothing: twice those within which a level that returns flickers. With four `hierarchical-flat` has 0.54 % of
/// reversals in the grove, with eight every policy is slower to use time that comes free.
const DWELL: f64 = 6.0;

/// The fraction of the budget that rises leave free, so that no small move of the camera takes them back; with 2 % the library under
/// `hierarchical` has 0.7 % of reversals, with this 0.5 %.
const ROOM: f64 = 0.03;

/// Cost and benefit of levels that are drawn.
pub(crate) struct Worth<'a> {
    /// Seconds of an object at a level, and the pixels of its benefit.
    pub of: &'a dyn Fn(usize, &LevelDemand) -> [f64; 2],
    /// Pixels of an object drawn without error.
    pub most_px: &'a dyn Fn(usize) -> f64,
    /// The unit of [`Promise::value`] in a pixel.
    pub parts: f64,
}

/// A frame, and the one before.
pub(crate) struct TwoFrames<'a> {
    pub query: &'a FrameQuery<'a>,
    pub groups: &'a Groups,
    pub changes: &'a Changes,
}

/// Objects whose levels can only stay together: one, or all of a group whose cut changes.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    /// Price of its changes, pixels.
    changes_px: f64,
    /// Time and benefit that staying adds, seconds and pixels.
    more_s: f64,
    more_px: f64,
    /// Objects that staying leaves out.
    holes: i32,
    /// Whether a member was not in view before, so that there is no level to stay at.
    is_new: bool,
    stays: bool,
}

impl TwoFrames<'_> {
    /// Keeps levels of the frame before where that is worth more.
    pub fn keep_levels(&self, worth: &Worth<'_>, levels: &mut [LevelDemand], promise: &mut Promise) {
        let mut parts = self.parts(worth, levels);
        parts.iter_mut().for_each(|part| part.stays = part.is_worth_more());
        let spare_s = promise.budget_s - (promise.predicted_s - self.query.fixed_s);
        let more_s: f64 = parts.iter().filter(|part| part.stays).map(|part| part.more_s).sum();
        let (mut lacking_s, room_s) = (more_s - spare_s.max(0.0), ROOM * promise.budget_s);
        let mut order: Vec<usize> = (0..parts.len()).filter(|at| parts[*at].saves_turned()).collect();
        order.sort_by(|a, b| parts[*a].px_a_second().total_cmp(&parts[*b].px_a_second()));
        for at in order {
            let part = &mut parts[at];
            let saved_s = part.more_s.abs();
            // no rise waits for the room that takes more than all of it
            if lacking_s > if part.stays || saved_s > room_s { 0.0 } else { -room_s } {
                part.stays = !part.stays;
                lacking_s -= saved_s;
            }
        }
        for part in parts.iter().filter(|part| part.stays) {
            promise.predicted_s += part.more_s;
            promise.value += worth.parts * part.more_px;
            // members of a closed group are no holes
            if self.groups.all().is_empty() {
                promise.holes = promise.holes.saturating_add_signed(part.holes);
            }
        }
        self.take_back(&parts, levels);
    }

    fn parts(&self, worth: &Worth<'_>, levels: &[LevelDemand]) -> Vec<Part> {
        let mut parts = vec![Part::default(); levels.len()];
        for (at, new) in levels.iter().enumerate().filter(|(at, _)| self.query.is_offered(*at)) {
            let part = &mut parts[self.part_of(at, new)];
            let Some((last, lasted)) = self.last(at) else {
                part.is_new = true;
                continue;
            };
            if last == *new {
                continue;
            }
            let of = |level: &LevelDemand| if level.polygons > 0.0 { (worth.of)(at, level) } else { [0.0; 2] };
            let ([last_s, last_px], [new_s, new_px]) = (of(&last), of(new));
            part.changes_px += (worth.most_px)(at) * (1.0 - f64::from(lasted) / DWELL).max(0.0);
            part.more_s += last_s - new_s;
            part.more_px += last_px - new_px;
            part.holes += i32::from(last.polygons == 0.0) - i32::from(new.polygons == 0.0);
        }
        parts
    }

    /// The part that an object with this new level is in: what is drawn in both frames, or in neither, stands for itself; the cut of a group
    /// changes with all that is drawn in one of them.
    fn part_of(&self, at: usize, new: &LevelDemand) -> usize {
        let same_cut = self.last(at).is_some_and(|(last, _)| (last.polygons > 0.0) == (new.polygons > 0.0));
        if same_cut { at } else { self.groups.above(at).last().unwrap_or(at) }
    }

    fn last(&self, at: usize) -> Option<(LevelDemand, u8)> {
        self.changes.last(at, self.query.id(at))
    }

    /// Sets the levels of the frame before in the parts that stay.
    fn take_back(&self, parts: &[Part], levels: &mut [LevelDemand]) {
        for at in 0..levels.len() {
            if parts[self.part_of(at, &levels[at])].stays {
                let last = self.last(at).filter(|_| self.query.is_offered(at));
                levels[at] = last.map_or_else(|| unseen(&self.query.views[at].view), |(last, _)| last);
            }
        }
        leave_out_members(self.query, self.groups, levels);
    }
}

impl Part {
    fn is_worth_more(&self) -> bool {
        !self.is_new && self.changes_px > 0.0 && self.changes_px + self.more_px > 0.0
    }

    /// Whether it takes less time the other way round: not to stay, or to stay.
    fn saves_turned(&self) -> bool {
        !self.is_new && if self.stays { self.more_s > 0.0 } else { self.more_s < 0.0 }
    }

    /// The pixels that this loses, for each second that it saves.
    fn px_a_second(&self) -> f64 {
        (self.changes_px + self.more_px) / self.more_s
    }
}
