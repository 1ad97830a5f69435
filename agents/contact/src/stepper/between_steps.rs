//! What a fine step starts from of the one before, and leaves to the next: impulses, slip owed, what sensors saw.
//!
//! In: what participants remember; a solution. Out: contacts that start from it; memories, totals of pairs. Never here: rows of joints as they
//! are laid out, the solve.

use super::contact_rows::Spin;
use super::memory::{Partner, Remembered};
use super::pair_total::total_of;
use super::ties::place_key;
use super::{ClusterMember, ClusterStepper, Participant, search};
use glam::DVec3;
use metachron_core::{SimSpan, Wrench};

/// Bodies that meet deeper inside each other than this many times the depth of contacts began so: a load in motion goes less deep.
const OVERLAP_SHARE: f64 = 2.0;

impl ClusterStepper {
    /// Starts every contact from what the last step gave.
    pub(super) fn recall(&mut self, all: &[Participant<'_>], h_s: f64) {
        for (owner, contact) in self.search.owners.iter_mut().zip(&mut self.search.contacts) {
            let place = all[owner.member].memory.recall(owner.partner, owner.key);
            (contact.warm_n_s, contact.owed_slip_m) = (place.force_n * h_s, place.owed_slip_m);
            contact.load_n_s = place.load_n * h_s;
            let lies_m = if contact.gap_m < -OVERLAP_SHARE * self.depth_m { -contact.gap_m } else { 0.0 };
            contact.overlap_m = place.overlap_m.min(lies_m);
            owner.push_n = place.push_n;
            owner.spin = Spin { radius_m: owner.spin.radius_m, ..place.spin };
        }
    }

    /// Notes what the next step starts from.
    pub(super) fn remember(&mut self, all: &mut [Participant<'_>], h_s: f64, last: bool, dt: SimSpan) {
        self.remember_spins(all, h_s);
        self.remember_contacts(all, h_s);
        self.remember_ties(all, h_s);
        let Self { solver, search, ties, outside, .. } = self;
        for &[a, b] in &search.near {
            let (now, other) = (all[a].context.time + dt, all[b].id);
            all[a].memory.meet(other, now);
        }
        let mut sensed = search.sensed.as_slice();
        for (member, one) in all.iter_mut().enumerate() {
            let (mine, others) = sensed.split_at(sensed.partition_point(|pair| pair.member <= member));
            sensed = others;
            let begins = SimSpan::from_secs_f64(outside.after_s).unwrap_or(SimSpan::ZERO);
            one.memory.sense(mine.iter().map(|pair| pair.partner), one.context.time + begins);
            one.memory.turn(one.context.time + dt);
            if last {
                ties.grips(member, &solver.solution().rows_n_s, h_s, one.grips);
            }
        }
    }

    /// Notes what contacts hand to the next step, and adds up what they gave, push-outs and impacts included.
    fn remember_contacts(&mut self, all: &mut [Participant<'_>], h_s: f64) {
        let Self { solver, search, ties, contact_rows, outside, impacts, .. } = self;
        let solution = solver.solution();
        let mut pushes = contact_rows.pushes(ties).peekable();
        for (k, (owner, contact)) in search.owners.iter().zip(&search.contacts).enumerate() {
            let impulse = solution.contacts_n_s[k];
            let owed_slip_m = contact.owed_slip_after(impulse, solution.contacts_m_s[k], h_s);
            // sides that rebound hold each other no more
            let (lasting, spin) =
                if impacts.of(k).is_some() { (DVec3::ZERO, Spin::default()) } else { (impulse, owner.spin) };
            let load_n = contact.load_n_s / h_s;
            let (key, force_n, overlap_m) = (owner.key.anywhere(), lasting / h_s, contact.overlap_m);
            let push =
                pushes.next_if(|(pushed, _)| *pushed == k).map_or(DVec3::ZERO, |(_, row)| solution.rows_n_s[row]);
            let push_n = push.length() / h_s;
            let place = Remembered { key, force_n, load_n, overlap_m, push_n, owed_slip_m, spin };
            all[owner.member].memory.pair(owner.partner).next.push(place);
            let impulse = impulse + push + impacts.contacts_n_s.get(k).copied().unwrap_or_default();
            outside.note(all, owner.member, &contact.sides[1], -impulse);
            if impulse != DVec3::ZERO {
                let total = total_of(&mut self.totals, owner.member, owner.partner);
                total.add(impulse, -contact.gap_m);
                let skin = all[owner.member].member.skin();
                let point_m = skin.map_or(DVec3::NAN, |skin| skin.point(&owner.place, -contact.normal));
                let given = std::iter::once((owner.member, impulse)).chain(owner.other.map(|at| (at, -impulse)));
                for (member, impulse_n_s) in given {
                    give(&mut self.wrenches[member], &all[member].member, impulse_n_s, point_m);
                }
                if impulse.length() > total.most_n_s {
                    (total.most_n_s, total.point_m, total.normal) = (impulse.length(), point_m, contact.normal);
                    total.inverse_mass_per_kg = solver.inverse_masses(k, self.progress[owner.member].place);
                }
            } else if contact.gap_m < self.depth_m {
                // no nearer than what bears something lies deep: the two touch, though nothing presses them together now
                total_of(&mut self.totals, owner.member, owner.partner);
            }
        }
    }

    /// Notes what rows of ties hand to the next step, and what they gave.
    fn remember_ties(&mut self, all: &mut [Participant<'_>], h_s: f64) {
        let Self { solver, ties, joints, outside, tearing, yielding, efforts, impacts, .. } = self;
        let solution = solver.solution();
        for (k, (owner, row)) in ties.owners.iter().zip(&ties.rows).enumerate() {
            let impulse = solution.rows_n_s[k];
            let given = impulse + impacts.rows_n_s.get(k).copied().unwrap_or_default();
            outside.note(all, owner.member, &row.sides[1], -given);
            outside.note_line(owner, given);
            tearing.note(owner, given);
            if let Partner::Link(_) = owner.partner {
                total_of(&mut self.totals, owner.member, owner.partner).add(given, 0.0);
            }
            let owed_slip_m = owner.owed_slip_m(row, impulse, &self.progress, h_s);
            let place = Remembered { owed_slip_m, ..Remembered::new(place_key(owner.key), impulse / h_s) };
            all[owner.member].memory.pair(owner.partner).next.push(place);
        }
        joints.note_efforts(ties, &solution.rows_n_s, efforts);
        yielding.slip(all, ties, &solution.rows_n_s, &self.progress);
    }

    /// Notes what the spins of contacts were given.
    fn remember_spins(&mut self, all: &[Participant<'_>], h_s: f64) {
        let Self { solver, search, ties, contact_rows, outside, progress, .. } = self;
        let solution = solver.solution();
        for (contact, row) in contact_rows.spins(ties) {
            let (impulse, row) = (solution.rows_n_s[row], &ties.rows[row]);
            let owner = &mut search.owners[contact];
            let (normal, pressed) = (search.contacts[contact].normal, row.pressed.map_or(0.0, |by| by.reach_m));
            let most = pressed * solution.contacts_n_s[contact].dot(normal);
            let [a, b] = row.sides.map(|side| search::velocity(&side, |member| &progress[member].solved[..]));
            owner.spin.owed_rad = row.owed_slip_after(impulse, a - b, most, h_s).dot(normal);
            owner.spin.torque_n_m = impulse.dot(normal) / h_s;
            outside.note(all, owner.member, &row.sides[1], -impulse);
        }
    }
}

/// Adds an impulse at a point to what contacts gave a body, if that moves as a whole.
fn give(wrench: &mut Wrench, member: &dyn ClusterMember, impulse_n_s: DVec3, point_m: DVec3) {
    if let Some(pose) = member.pose(&[], 0.0) {
        wrench.add(impulse_n_s, point_m - pose.centre_m);
    }
}
