//! How much more contacts bear where what a user leads is led on: what a device feels between two states.
//!
//! In: the last fine step of a macro step, with its solution. Out: a stiffness of each pair with a side that a user leads now. Never here: the
//! device, what leads members. Theory: docs/theory/coupling.md, eq. 7s.

use crate::cluster::Side;
use crate::member::memory::Partner;
use crate::member::participant::place_of;
use crate::member::{ClusterMember, Drive, Participant, Role};
use crate::step::ClusterStepper;
use crate::step::pair_total::PairTotal;
use glam::DVec3;

/// The steps in which a pair is resisted.
#[derive(Clone, Copy)]
struct Steps {
    /// The step of the problem, seconds.
    problem_s: f64,
    /// The step of the side that makes longer ones, seconds.
    longer_s: f64,
}

impl Participant<'_> {
    /// Whether a user leads it in this step.
    fn is_led_by_user(&self) -> bool {
        let is_held = || self.context.hands.iter().any(|spring| spring.by.is_none());
        self.member.is_led() && (self.context.pose.is_some() || is_held())
    }

    /// A stiffness within a step along `normal`, with the drive's spring alone where mass and damping of a driven tip resist too: a hand that
    /// goes on evenly is followed without them.
    fn drive_settled(&self, within_n_m: f64, normal: DVec3, steps: Steps) -> f64 {
        let Some((drive, tip)) = self.member.drive().zip(self.member.blocks().first()) else { return within_n_m };
        let (Drive { stiffness_n_m, damping_n_s_m, .. }, Steps { problem_s, longer_s }) = (drive, steps);
        let given_kg = normal.dot(tip.value * normal) + problem_s * (damping_n_s_m + problem_s * stiffness_n_m);
        let give_m_per_n = (within_n_m.recip() - problem_s * longer_s / given_kg).max(0.0);
        (give_m_per_n + stiffness_n_m.recip()).recip()
    }
}

impl ClusterStepper {
    /// Notes the stiffness of all pairs with a side that a user leads now, one solve for each.
    pub(crate) fn note_stiffness(&mut self, all: &[Participant<'_>], h_s: f64) {
        if !all.iter().any(Participant::is_led_by_user) {
            return;
        }
        let mut totals = std::mem::take(&mut self.totals);
        for total in &mut totals {
            total.stiffness_n_m = self.stiffness_of(all, total, h_s).unwrap_or(0.0);
        }
        self.totals = totals;
    }

    /// The stiffness of a pair; `None` where nothing presses it, or where a user leads neither side.
    fn stiffness_of(&mut self, all: &[Participant<'_>], total: &PairTotal, problem_s: f64) -> Option<f64> {
        if self.search.contacts.is_empty() {
            return None;
        }
        let other = match total.partner {
            Partner::Agent(id) => place_of(all, id),
            Partner::Static(_) => None,
            _ => return None,
        };
        let both = || std::iter::once(total.member).chain(other);
        let led = both().find(|&member| all[member].is_led_by_user())?;
        // side 0 is pressed against side 1
        let towards = if led == total.member { -total.normal } else { total.normal };
        self.move_sides(all, led, towards);
        let Self { solver, search, moved_m_s, progress, .. } = self;
        let given = solver.resistance(moved_m_s)?;
        let of_pair =
            search.owners.iter().zip(given).filter(|(owner, _)| owner.pair() == (total.member, total.partner));
        let impulse_n_s = of_pair.map(|(_, given)| given.dot(total.normal)).sum::<f64>();
        let longer_s = both().map(|member| problem_s * f64::from(progress[member].share)).fold(problem_s, f64::max);
        let within_n_m = impulse_n_s / (problem_s * longer_s);
        let stiffness_n_m = all[led].drive_settled(within_n_m, total.normal, Steps { problem_s, longer_s });
        (stiffness_n_m > 0.0 && stiffness_n_m.is_finite()).then_some(stiffness_n_m)
    }

    /// Sets by which velocities side 0 of each contact moves against side 1 where the member `led` moves by `towards`, m/s, world axes.
    fn move_sides(&mut self, all: &[Participant<'_>], led: usize, towards: DVec3) {
        let role = all[led].member.role();
        let moved = |side: &Side| match role {
            Role::Kinematic => towards,
            Role::Rigid | Role::Deformable => side.velocity(&[towards, DVec3::ZERO]),
        };
        let Self { search, moved_m_s, .. } = self;
        moved_m_s.clear();
        moved_m_s.extend(search.contacts.iter().zip(&search.owners).map(|(contact, owner)| {
            let [here, there] = &contact.sides;
            if owner.member == led {
                moved(here)
            } else if owner.other == Some(led) {
                -moved(there)
            } else {
                DVec3::ZERO
            }
        }));
    }
}
