//! What other agents gave a tube since its last step, and how the tube takes it.
//!
//! In: impulses at rest arc lengths, and how far they have carried by now. Out: the state with both in it, and what springs
//! from outside took of them. Never here: who gave them, and why. Theory: docs/theory/rod.md, eq. 37.

use super::anchor_springs::Tie;
use super::banded_ldl::Factor;
use super::contact::TubeContacts;
use super::discretization::Division;
use super::rotation::{exp, unit};
use super::state::{Config, Matter};
use glam::DVec3;
use metachron_contact::Neighbour;
use metachron_core::SimTime;
use metachron_core::foot::press;
use metachron_core::{Foot, Impulse, Site, Slots};

/// From who is ahead of a tube, or behind it, by more steps than this comes what no linear way tells: how far it has carried the tube since,
/// or is to take it back.
const TIMELY_STEPS: f64 = 2.0;
/// How often that way is halved before none of it is gone.
const WAY_HALVINGS: u32 = 6;

/// Impulses received, gathered in slots.
#[derive(Debug, Clone, Default)]
pub struct Received {
    /// dJ: N·s at nodes, N·m·s at segments.
    sum: Vec<DVec3>,
    /// t dJ − dS: seconds times that.
    carried: Vec<DVec3>,
    /// The part of dJ that acts through the step that comes; empty for none.
    fresh: Vec<DVec3>,
    /// What has acted through the substep that ended; empty for none.
    spent: Vec<DVec3>,
    slots: usize,
    any: bool,
    /// Whether any came from one whose time is another.
    untimely: bool,
    /// Room for a state that is only tried.
    trial: Config,
}

impl Received {
    /// Empties the slots of a tube of so many.
    pub fn clear(&mut self, slots: usize) {
        (self.slots, self.any, self.untimely) = (slots, false, false);
        self.fresh.clear();
        self.spent.clear();
    }

    /// Whether nothing came.
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// What came, at all nodes together, N·s.
    pub fn push(&self) -> DVec3 {
        [&self.sum, &self.fresh].into_iter().flat_map(|list| list.iter().step_by(2)).sum()
    }

    /// What of it acts through the substep that comes, N·s and N·m·s in slots; empty for nothing.
    pub fn fresh(&self) -> &[DVec3] {
        &self.fresh
    }

    /// What of it acted through the substep that ended, N·s and N·m·s in slots; empty for nothing.
    pub fn spent(&self) -> &[DVec3] {
        &self.spent
    }

    /// That substep has been made.
    pub fn spend(&mut self) {
        std::mem::swap(&mut self.spent, &mut self.fresh);
        self.fresh.clear();
    }

    /// Leaves what has not acted through a substep of `h` seconds to the one that comes (docs/theory/soft.md, eq. 16b).
    pub fn put_off(&mut self, h: f64) {
        let Self { sum, carried, fresh, .. } = self;
        fresh.clear();
        fresh.extend(sum.iter_mut().zip(&*carried).map(|(sum, carried)| {
            let past = carried.dot(*sum) / (h * sum.length_squared()).max(f64::MIN_POSITIVE);
            let fresh = *sum * (1.0 - past.clamp(0.0, 1.0));
            *sum -= fresh;
            fresh
        }));
    }

    /// Notes who gave something to a tube that is about to make a step of `dt` seconds from `now`.
    pub fn note(&mut self, giver: &Neighbour, now: SimTime, dt: f64) {
        let ahead_s = giver.snapshot.time.secs_after(now);
        // what it gave last acted at the start of its step
        self.untimely |= ahead_s - giver.step_s > TIMELY_STEPS * dt || -ahead_s > TIMELY_STEPS * dt.max(giver.step_s);
    }

    /// Adds an impulse. Between two nodes it is shared linearly, so that a change of division does not lose any of it.
    pub fn add(&mut self, division: &Division, site: Site, sum: Impulse, carried: Impulse) {
        let Site::Arc(arc_m) = site else { return };
        let (segment, share) = division.locate(arc_m);
        self.begin();
        for (list, what) in [(&mut self.sum, sum), (&mut self.carried, carried)] {
            list[2 * segment] += what.linear * (1.0 - share);
            list[2 * segment + 2] += what.linear * share;
            list[2 * segment + 1] += what.angular;
        }
    }

    /// Adds an impulse that acts now on what gathers from `slots`.
    pub fn add_slots(&mut self, slots: &Slots, impulse: DVec3) {
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

    /// v += A⁻¹ dJ, x += A⁻¹ (t dJ − dS), frames likewise; brings the strains up to date. Needs a factor of this division.
    ///
    /// `feet` are those on others that the factor knows: what they take presses the tube on them through the substep that comes.
    /// No node is carried farther than `way_m`, and what is untimely none so far that it strains the tube. `ties` are those
    /// that the factor holds: each notes what it takes.
    pub fn apply(
        &mut self,
        state: &mut Config,
        (factor, ties): (&Factor, &mut [Tie]),
        (matter, division): (&Matter, &Division),
        (walls, feet, way_m): (&TubeContacts, &[Foot], f64),
    ) {
        let Self { sum, carried, fresh, slots, .. } = self;
        for list in [&mut *sum, &mut *carried] {
            hold(list, matter.held);
            factor.solve(list);
        }
        if !(sum.iter().sum::<DVec3>() + carried.iter().sum::<DVec3>()).is_finite() {
            return; // impulses past all measure: better to lose them than the tube
        }
        if !feet.is_empty() {
            fresh.resize(*slots, DVec3::ZERO);
            press(feet, sum, fresh);
        }
        if !fresh.is_empty() {
            hold(fresh, matter.held);
        }
        let longest = carried.iter().step_by(2).map(|way| way.length_squared()).fold(0.0, f64::max).sqrt();
        let share = if longest > way_m { way_m / longest } else { 1.0 };
        let share = if self.untimely { self.unstrained(state, (matter, division), share) } else { share };
        let Self { sum, carried, .. } = self;
        state.u.iter_mut().zip(&*sum).for_each(|(u, change)| *u += *change);
        ties.iter_mut().for_each(|tie| tie.take(sum[2 * tie.segment], sum[2 * tie.segment + 2]));
        carry(state, carried, share);
        walls.hold_back(&mut state.x, carried.iter().step_by(2).map(|way| *way * share), &division.arc_m);
        state.strain(matter, division);
    }

    /// The share of what carries `state`, at most `share`, halved until the tube is strained no more by it; none where a few times do
    /// not suffice (eq. 37b).
    fn unstrained(&mut self, state: &Config, (matter, division): (&Matter, &Division), mut share: f64) -> f64 {
        let Self { carried, trial, .. } = self;
        for _ in 0..WAY_HALVINGS {
            trial.resize(state.q.len());
            trial.copy_from(state);
            carry(trial, carried, share);
            trial.strain(matter, division);
            if trial.elastic_j <= state.elastic_j {
                return share;
            }
            share *= 0.5;
        }
        0.0
    }
}

/// Moves and turns a state by a share of what each slot is carried.
fn carry(state: &mut Config, carried: &[DVec3], share: f64) {
    state.x.iter_mut().zip(carried.iter().step_by(2)).for_each(|(x, way)| *x += *way * share);
    let turns = carried.iter().skip(1).step_by(2);
    state.q.iter_mut().zip(turns).for_each(|(q, turn)| *q = unit(exp(*turn * share) * *q));
}

/// Takes held ends out of an array of slots.
fn hold(list: &mut [DVec3], held: [bool; 2]) {
    let last = list.len() - 1;
    for (end, slot) in [(0, 0), (1, last)] {
        if held[end] {
            list[slot] = DVec3::ZERO;
        }
    }
}
