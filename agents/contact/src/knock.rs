//! Whom a mover wakes: who owns the contact with it, sleeps, and so does not see it come.
//!
//! In: a mover after its step, what is around. Out: the sleepers it may touch next, for [`metachron_core::Snapshot::touches`].
//! Never here: forces; rigid bodies, who look along their own flight (`agents/models/src/rigid/company.rs`), and tubes (`agents/models/src/rod/company.rs`).

use super::{Law, Other, WAKE_M_S};
use crate::{Neighbour, StepContext};
use metachron_core::{AgentId, Bounds};
use metachron_geometry::PlacedShape;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, gap};
use std::fmt;

/// Who sleeps in a mover's way.
#[derive(Default)]
pub struct Knock {
    on: Vec<AgentId>,
    other: Other,
    room: NarrowPhaseScratch,
}

/// How many of its own steps a mover looks ahead: one to be seen, one to be answered.
const STEPS: f64 = 2.0;

impl Knock {
    /// Finds anew who sleeps within two steps of `dt_s` seconds of one who is at `placed`, inside `bounds`; who is slow wakes nobody.
    pub fn find(&mut self, placed: &PlacedShape<'_>, bounds: &Bounds, (around, dt_s): (&StepContext<'_>, f64)) {
        self.on.clear();
        if bounds.speed_m_s <= WAKE_M_S {
            return;
        }
        let reach_m = STEPS * dt_s * bounds.speed_m_s;
        for neighbour in around.neighbours.iter().filter(|n| sleeps(n)) {
            let is_apart = neighbour
                .snapshot
                .bounds
                .is_none_or(|there| (there.low - bounds.high).max(bounds.low - there.high).max_element() > reach_m);
            if is_apart || !self.other.see(neighbour) {
                continue;
            }
            let Some(there) = self.other.placed() else { continue };
            if gap(placed, &there, reach_m, &mut self.room).is_some() {
                self.on.push(neighbour.id);
            }
        }
    }

    /// Those found last.
    pub fn on(&self) -> &[AgentId] {
        &self.on
    }
}

/// Whether it sleeps and owns what happens between the two.
fn sleeps(neighbour: &Neighbour) -> bool {
    neighbour.snapshot.at_rest && !neighbour.owned && neighbour.form.is_some() && neighbour.law != Law::Off
}

/// A copy of a mover knows nobody yet: its next step finds them.
impl Clone for Knock {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Knock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Knock").field("on", &self.on).finish_non_exhaustive()
    }
}
