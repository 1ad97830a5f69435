//! Impulses that other agents gave a tube since its last step, and their effect on its state.
//!
//! In: impulses at rest arc lengths, and the displacements they have caused by now. Out: the state with both applied, and the impulses
//! that external springs took of them. Never here: which agent gave them, and why. Theory: docs/theory/rod.md, eq. 37.

use super::anchor_springs::Tie;
use super::banded_ldl::Factor;
use super::contact::TubeContacts;
use super::discretization::Discretization;
use super::rotation::{exp, unit};
use super::state::{DividedRod, RodState};
use glam::DVec3;
use metachron_contact::Neighbour;
use metachron_core::SimTime;
use metachron_core::foot::press;
use metachron_core::{ContactJacobian, Foot, Impulse, Site};

/// A giver whose clock differs from the tube's by more steps than this makes impulses untimely: the displacement since (or its reversal)
/// is then too long for a linear response.
const TIMELY_STEPS: f64 = 2.0;
/// How often that displacement is halved before it is dropped.
const WAY_HALVINGS: u32 = 6;

/// A factored system, with the springs and supports that it includes.
pub struct FactoredSystem<'a> {
    /// The factor of its matrix.
    pub factor: &'a Factor,
    /// Springs: each records the impulse that it takes.
    pub ties: &'a mut [Tie],
    /// Contact points on moving supports: the impulses that they take act on the tube through the coming substep.
    pub feet: &'a [Foot],
}

/// What limits the displacement of a tube by received impulses.
#[derive(Clone, Copy)]
pub struct DisplacementLimit<'a> {
    /// Contacts with fixed solids, which no node may enter.
    pub walls: &'a TubeContacts,
    /// The longest displacement of a node, metres; may be infinite.
    pub way_m: f64,
}

/// Received impulses, gathered in slots.
#[derive(Debug, Clone, Default)]
pub struct ReceivedImpulses {
    /// dJ: N·s at nodes, N·m·s at segments.
    sum: Vec<DVec3>,
    /// t dJ − dS: seconds times that.
    carried: Vec<DVec3>,
    /// The part of dJ that acts through the coming step; may be empty.
    fresh: Vec<DVec3>,
    /// The part that acted through the last substep; may be empty.
    spent: Vec<DVec3>,
    slots: usize,
    any: bool,
    /// Whether any came from a giver whose clock is too far off.
    untimely: bool,
    /// A trial state.
    trial: RodState,
}

impl ReceivedImpulses {
    /// Empties the slots of a tube with that many.
    pub fn clear(&mut self, slots: usize) {
        (self.slots, self.any, self.untimely) = (slots, false, false);
        self.fresh.clear();
        self.spent.clear();
    }

    /// Whether nothing was received.
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// The sum of the impulses at all nodes, N·s.
    pub fn push(&self) -> DVec3 {
        [&self.sum, &self.fresh].into_iter().flat_map(|list| list.iter().step_by(2)).sum()
    }

    /// The part that acts through the coming substep, N·s and N·m·s in slots; may be empty.
    pub fn fresh(&self) -> &[DVec3] {
        &self.fresh
    }

    /// The part that acted through the last substep, N·s and N·m·s in slots; may be empty.
    pub fn spent(&self) -> &[DVec3] {
        &self.spent
    }

    /// Marks that substep as done.
    pub fn spend(&mut self) {
        std::mem::swap(&mut self.spent, &mut self.fresh);
        self.fresh.clear();
    }

    /// Defers the part that has not yet acted for a substep of `h` seconds to the coming one (docs/theory/soft.md, eq. 16b).
    pub fn defer(&mut self, h: f64) {
        let Self { sum, carried, fresh, .. } = self;
        fresh.clear();
        fresh.extend(sum.iter_mut().zip(&*carried).map(|(sum, carried)| {
            let past = carried.dot(*sum) / (h * sum.length_squared()).max(f64::MIN_POSITIVE);
            let fresh = *sum * (1.0 - past.clamp(0.0, 1.0));
            *sum -= fresh;
            fresh
        }));
    }

    /// Checks the clock of an agent that gave impulses, for a tube about to make a step of `dt` seconds from `now`.
    pub fn check_clock(&mut self, giver: &Neighbour, now: SimTime, dt: f64) {
        let ahead_s = giver.snapshot.time.secs_after(now);
        // its last impulse acted at the start of its step
        self.untimely |= ahead_s - giver.step_s > TIMELY_STEPS * dt || -ahead_s > TIMELY_STEPS * dt.max(giver.step_s);
    }

    /// Adds an impulse. Between two nodes it is shared linearly, so that a change of division loses none of it.
    pub fn add(&mut self, division: &Discretization, site: Site, sum: Impulse, carried: Impulse) {
        let Site::Arc(arc_m) = site else { return };
        let (segment, share) = division.locate(arc_m);
        self.begin();
        for (list, what) in [(&mut self.sum, sum), (&mut self.carried, carried)] {
            list[2 * segment] += what.linear * (1.0 - share);
            list[2 * segment + 2] += what.linear * share;
            list[2 * segment + 1] += what.angular;
        }
    }

    /// Adds an impulse that acts now on the velocities that `slots` gathers.
    pub fn add_slots(&mut self, slots: &ContactJacobian, impulse: DVec3) {
        self.begin();
        slots.scatter(impulse, &mut self.sum);
    }

    fn begin(&mut self) {
        if !self.any {
            for list in [&mut self.sum, &mut self.carried] {
                list.clear();
                list.resize(self.slots, DVec3::ZERO);
            }
        }
        self.any = true;
    }

    /// v += A⁻¹ dJ, x += A⁻¹ (t dJ − dS), frames likewise; recomputes the strains. Needs a factor of this division.
    ///
    /// Displacements stay within `limit`, and untimely ones are shortened until they do not strain the tube.
    pub fn apply(
        &mut self,
        state: &mut RodState,
        system: FactoredSystem<'_>,
        rod: DividedRod<'_>,
        limit: DisplacementLimit<'_>,
    ) {
        let FactoredSystem { factor, ties, feet } = system;
        let DividedRod { matter, division } = rod;
        let DisplacementLimit { walls, way_m } = limit;
        let Self { sum, carried, fresh, slots, .. } = self;
        for list in [&mut *sum, &mut *carried] {
            zero_held_ends(list, matter.held);
            factor.solve(list);
        }
        if !(sum.iter().sum::<DVec3>() + carried.iter().sum::<DVec3>()).is_finite() {
            return; // overflowing impulses: losing them is better than losing the tube
        }
        if !feet.is_empty() {
            fresh.resize(*slots, DVec3::ZERO);
            press(feet, sum, fresh);
        }
        if !fresh.is_empty() {
            zero_held_ends(fresh, matter.held);
        }
        let longest = carried.iter().step_by(2).map(|way| way.length_squared()).fold(0.0, f64::max).sqrt();
        let share = if longest > way_m { way_m / longest } else { 1.0 };
        let share = if self.untimely { self.unstrained(state, rod, share) } else { share };
        let Self { sum, carried, .. } = self;
        state.u.iter_mut().zip(&*sum).for_each(|(u, change)| *u += *change);
        ties.iter_mut().for_each(|tie| tie.absorb(sum[2 * tie.segment], sum[2 * tie.segment + 2]));
        displace(state, carried, share);
        walls.hold_back(&mut state.x, carried.iter().step_by(2).map(|way| *way * share), &division.arc_m);
        state.strain(matter, division);
    }

    /// The share of the displacement of `state`, at most `share`, halved until it does not increase the tube's strain energy; zero where a
    /// few halvings do not suffice (eq. 37b).
    fn unstrained(&mut self, state: &RodState, rod: DividedRod<'_>, mut share: f64) -> f64 {
        let Self { carried, trial, .. } = self;
        for _ in 0..WAY_HALVINGS {
            trial.resize(state.q.len());
            trial.copy_from(state);
            displace(trial, carried, share);
            trial.strain(rod.matter, rod.division);
            if trial.elastic_j <= state.elastic_j {
                return share;
            }
            share *= 0.5;
        }
        0.0
    }
}

/// Moves and turns a state by a share of each slot's displacement.
fn displace(state: &mut RodState, carried: &[DVec3], share: f64) {
    state.x.iter_mut().zip(carried.iter().step_by(2)).for_each(|(x, way)| *x += *way * share);
    let turns = carried.iter().skip(1).step_by(2);
    state.q.iter_mut().zip(turns).for_each(|(q, turn)| *q = unit(exp(*turn * share) * *q));
}

/// Zeroes held ends in an array of slots.
fn zero_held_ends(list: &mut [DVec3], held: [bool; 2]) {
    let last = list.len() - 1;
    for (end, slot) in [(0, 0), (1, last)] {
        if held[end] {
            list[slot] = DVec3::ZERO;
        }
    }
}
