//! The data that a fine step takes from the one before, and leaves to the next and to reports: impulses, slip owed, touches of sensors, the
//! stiffness of contacts.
//!
//! In: participants' memories; a solution. Out: contacts that start from it; memories, totals of pairs. Never here: rows of joints as they
//! are laid out, the solve. Theory of the stiffness: docs/theory/coupling.md, eq. 7s.

use crate::constraint::place_key;
use crate::detect::{Owner, Search};
use crate::lists::refill;
use crate::member::memory::{Partner, Remembered, Spin};
use crate::member::participant::{place_of, relative};
use crate::member::{Drive, Participant, Role};
use crate::solve::Side;
use crate::step::ClusterStepper;
use crate::step::report::{PairTotal, give, total_of};
use glam::DVec3;
use metachron_core::{SimSpan, SimTime};
use metachron_geometry::Place;

/// Bodies that meet deeper inside each other than this many times the depth of contacts began so: a load in motion goes less deep.
const OVERLAP_SHARE: f64 = 2.0;

impl ClusterStepper {
    /// Starts every contact from its impulse in the last step.
    pub(super) fn warm_start(&mut self, all: &[Participant<'_>], h_s: f64) {
        let Self { search: Search { owners, contacts, .. }, taken_over, .. } = self;
        taken_over.clear();
        for (at, contact) in contacts.iter_mut().enumerate() {
            let Owner { member, partner, key, .. } = owners[at];
            let is_left = |key| {
                let name = (member, partner, key);
                owners.binary_search_by_key(&name, Owner::name).is_err() && !taken_over.contains(&name)
            };
            let place = all[member].memory.recall_left(partner, key, is_left);
            if place.key != key {
                taken_over.push((member, partner, place.key));
            }
            let owner = &mut owners[at];
            (contact.warm_n_s, contact.owed_slip_m) = (place.force_n * h_s, place.owed_slip_m);
            contact.load_n_s = place.load_n * h_s;
            // a body that is stepped elsewhere is found deep because it comes on in steps of its own, and is let go by these
            let lies = contact.gap_m < -OVERLAP_SHARE * self.depth_m && owner.late_s <= h_s;
            contact.overlap_m = if lies { place.overlap_m.min(-contact.gap_m) } else { 0.0 };
            owner.push_n = place.push_n;
            owner.spin = Spin { radius_m: owner.spin.radius_m, ..place.spin };
        }
    }

    /// Notes the data from which the next step starts.
    pub(super) fn record(&mut self, all: &mut [Participant<'_>], h_s: f64, dt: SimSpan) {
        self.record_spins(all, h_s);
        self.record_contacts(all, h_s);
        self.record_constraints(all, h_s);
        let now = all.first().map_or(SimTime::ZERO, |one| one.context.time + dt);
        self.search.recycled.note(all, now);
        let Self { solver, search, constraints, external, macro_s, .. } = self;
        for &[a, b] in &search.near {
            let (now, other) = (all[a].context.time + dt, all[b].id);
            all[a].memory.meet(other, now);
        }
        let mut sensed = search.sensed.as_slice();
        let holds = constraints.owners.iter().any(|owner| owner.hold.is_some());
        for (member, one) in all.iter_mut().enumerate() {
            let (mine, others) = sensed.split_at(sensed.partition_point(|pair| pair.member <= member));
            sensed = others;
            let begins = SimSpan::from_secs_f64(external.after_s).unwrap_or(SimSpan::ZERO);
            one.memory.sense(mine.iter().map(|pair| pair.partner), one.context.time + begins);
            one.memory.turn(one.context.time + dt);
            if holds {
                constraints.grips(member, &solver.solution().rows_n_s, *macro_s, one.grips);
            }
        }
    }

    /// Notes the data that contacts hand to the next step, and adds up their impulses, push-outs and impacts included.
    fn record_contacts(&mut self, all: &mut [Participant<'_>], h_s: f64) {
        let Self { solver, search, external, impacts, .. } = self;
        let solution = solver.solution();
        for (k, (owner, contact)) in search.owners.iter().zip(&search.contacts).enumerate() {
            let impulse = solution.contacts_n_s[k];
            let owed_slip_m = contact.owed_slip_after(impulse, solution.contacts_m_s[k], h_s);
            // sides that rebound hold each other no more
            let (persistent, spin) =
                if impacts.of(k).is_some() { (DVec3::ZERO, Spin::default()) } else { (impulse, owner.spin) };
            let load_n = contact.load_n_s / h_s;
            let (key, force_n, overlap_m) = (owner.key, persistent / h_s, contact.overlap_m);
            let push = owner.push_row.map_or(DVec3::ZERO, |row| solution.rows_n_s[row]);
            let push_n = push.length() / h_s;
            let place = Remembered { key, force_n, load_n, overlap_m, push_n, owed_slip_m, spin, travels: [0.0; 2] };
            all[owner.member].memory.pair(owner.partner).next.push(place);
            let impulse = impulse + push + impacts.contacts_n_s.get(k).copied().unwrap_or_default();
            external.note(all, owner.member, &contact.sides[1], -impulse);
            if impulse != DVec3::ZERO {
                let total = total_of(&mut self.sums.totals, owner.member, owner.partner);
                total.add(impulse, -contact.gap_m);
                let skin = all[owner.member].member.skin();
                let point_m = skin.map_or(DVec3::NAN, |skin| skin.point(&owner.places[0], -contact.normal));
                let given = std::iter::once((owner.member, impulse)).chain(owner.other.map(|at| (at, -impulse)));
                for (member, impulse_n_s) in given {
                    give(&mut self.sums.wrenches[member], &all[member].member, impulse_n_s, point_m);
                }
                for (member, place) in owner.both().zip(owner.places) {
                    if let Place::Surface { .. } = place {
                        self.progress[member].pressed.push(place);
                    }
                }
                if impulse.length() > total.most_n_s {
                    (total.most_n_s, total.point_m, total.normal) = (impulse.length(), point_m, contact.normal);
                    total.inverse_mass_per_kg = Some(solver.inverse_masses(k, self.progress[owner.member].place));
                }
            } else if contact.gap_m < self.depth_m {
                // no nearer than loaded contacts lie deep: the two touch, though nothing presses them together now
                total_of(&mut self.sums.totals, owner.member, owner.partner);
            }
        }
    }

    /// Notes the data that rows of constraints hand to the next step, and their impulses.
    fn record_constraints(&mut self, all: &mut [Participant<'_>], h_s: f64) {
        let Self { solver, constraints, joints, external, failures, sums, impacts, .. } = self;
        let solution = solver.solution();
        for (k, (owner, row)) in constraints.owners.iter().zip(&constraints.rows).enumerate() {
            let impulse = solution.rows_n_s[k];
            let given = impulse + impacts.rows_n_s.get(k).copied().unwrap_or_default();
            external.note(all, owner.member, &row.sides[1], -given);
            external.note_line(owner, given);
            failures.note(owner, given);
            if let Partner::Link(_) = owner.partner {
                total_of(&mut sums.totals, owner.member, owner.partner).add(given, 0.0);
            }
            let owed_slip_m = owner.owed_slip_m(row, impulse, &self.progress, h_s);
            let (key, force_n) = (place_key(owner.key), impulse / h_s);
            let place = Remembered { key, force_n, owed_slip_m, travels: owner.travels, ..Remembered::default() };
            all[owner.member].memory.pair(owner.partner).next.push(place);
        }
        joints.note_efforts(constraints, &solution.rows_n_s, &mut sums.efforts);
        failures.slip(all, constraints, &solution.rows_n_s, &self.progress);
    }

    /// Notes the impulses of the spins of contacts.
    fn record_spins(&mut self, all: &[Participant<'_>], h_s: f64) {
        let Self { solver, search, constraints, external, progress, .. } = self;
        let solution = solver.solution();
        for (k, (owner, contact)) in search.owners.iter_mut().zip(&search.contacts).enumerate() {
            let Some(row) = owner.spin_row else { continue };
            let (impulse, row) = (solution.rows_n_s[row], &constraints.rows[row]);
            let (normal, pressed) = (contact.normal, row.pressed.map_or(0.0, |by| by.reach_m));
            let most = pressed * solution.contacts_n_s[k].dot(normal);
            let slip = relative(&row.sides, |member| &progress[member].v_solved);
            owner.spin.owed_rad = row.owed_slip_after(impulse, slip, most, h_s).dot(normal);
            owner.spin.torque_n_m = impulse.dot(normal) / h_s;
            external.note(all, owner.member, &row.sides[1], -impulse);
        }
    }
}

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
        let is_held = || self.context.user_springs.iter().any(|spring| spring.by.is_none());
        self.member.is_led() && (self.context.pose.is_some() || is_held())
    }

    /// A stiffness within a step along `normal`, with the drive's spring alone where mass and damping of a driven tip resist too: a hand that
    /// goes on evenly is followed without them.
    fn drive_settled(&self, within_n_m: f64, normal: DVec3, steps: Steps) -> f64 {
        let Some((drive, tip)) = self.member.drive().zip(self.member.system().blocks.first()) else {
            return within_n_m;
        };
        let (Drive { stiffness_n_m, damping_n_s_m, .. }, Steps { problem_s, longer_s }) = (drive, steps);
        let given_kg = normal.dot(tip.value * normal) + problem_s * (damping_n_s_m + problem_s * stiffness_n_m);
        let give_m_per_n = (within_n_m.recip() - problem_s * longer_s / given_kg).max(0.0);
        (give_m_per_n + stiffness_n_m.recip()).recip()
    }
}

impl ClusterStepper {
    /// Notes the stiffness of all pairs with a side that a user leads now, one solve for each.
    pub(super) fn note_stiffness(&mut self, all: &[Participant<'_>], h_s: f64) {
        if !all.iter().any(Participant::is_led_by_user) {
            return;
        }
        let mut totals = std::mem::take(&mut self.sums.totals);
        for total in &mut totals {
            total.stiffness_n_m = self.stiffness_of(all, total, h_s).unwrap_or(0.0);
        }
        self.sums.totals = totals;
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
        refill(
            moved_m_s,
            search.contacts.iter().zip(&search.owners).map(|(contact, owner)| {
                let [here, there] = &contact.sides;
                if owner.member == led {
                    moved(here)
                } else if owner.other == Some(led) {
                    -moved(there)
                } else {
                    DVec3::ZERO
                }
            }),
        );
    }
}
