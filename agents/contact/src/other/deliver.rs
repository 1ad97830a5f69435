//! What is on its way to another agent.
//!
//! In: the ledger of what it was given and its own copy; ledgers of others who give to it too. Out: it, with the difference in
//! its velocities and its place, and what those others will give it. Never here: what it does next.
//! Theory: docs/theory/coupling.md, eq. 5–6b.

use super::ground::LIFTED_M;
use super::{Lasting, Other};
use crate::beside::PART_MAX_S;
use crate::{Exchange, acknowledged};
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::{AgentId, Body, DT_MAX_S, Inertia, SimTime};
use metachron_core::{Impulse, Ledger, Rebound, Site, Twist};

/// What begins within so many seconds has begun: clocks count whole nanoseconds.
const SOON_S: f64 = 1e-6;

/// What has been given and not yet taken, in slots.
struct Flight<'a> {
    to: &'a Neighbour,
    slots: usize,
    /// J − J_ack, and how far that has carried.
    sums: Vec<DVec3>,
    carried: Vec<DVec3>,
}

impl Other {
    /// Adds what is on its way: W (J − J_ack) to the velocities, W ((J − J_ack) t − (S − S_ack)) to the positions.
    pub(super) fn deliver(
        &mut self,
        neighbour: &Neighbour,
        around: &StepContext<'_>,
        exchange: &Exchange,
        from: Option<DVec3>,
    ) {
        let at = around.time;
        let [mut sums, mut carried] = [&mut self.answer, &mut self.carried].map(std::mem::take);
        sums.clear();
        carried.clear();
        let mut flight = Flight { to: neighbour, slots: self.velocities.len(), sums, carried };
        exchange.in_flight(around.me, neighbour, at, |site, sum, moved| flight.add(site, sum, moved));
        if matches!(neighbour.snapshot.body, Body::Rigid(_)) && self.lean.is_none() {
            self.share(&mut flight, around, at);
        }
        if let Some(rebound) = neighbour.snapshot.rebound.get().filter(|_| !self.held && self.lean.is_none()) {
            let in_the_air = flight.leave_out(rebound, (at, self.pose.centre), (around.me, from));
            if in_the_air {
                self.take_off(neighbour);
            }
        }
        let Flight { mut sums, mut carried, .. } = flight;
        if !sums.is_empty() {
            self.carry_off(carried[0]);
            self.bear(sums.iter().step_by(self.stride()).copied());
            self.respond(&mut sums);
            self.respond(&mut carried);
            [sums[0], carried[0]] = self.rise([sums[0], carried[0]]);
            self.velocities.iter_mut().zip(&sums).for_each(|(v, dv)| *v += *dv);
            if let (Some(lean), [dv, dw], [dx, dr]) = (&mut self.lean, &sums[..], &carried[..]) {
                lean.deliver([*dv, *dw], [*dx, *dr]);
            }
            self.shift(&carried);
            self.take_back(&sums, &mut carried);
        }
        if from.is_none() {
            self.lie(around, exchange);
        }
        (self.answer, self.carried) = (sums, carried);
    }

    /// What a body that bends has not taken yet, `sums` as velocities, has moved it by `carried` in the eyes of who gave it: what of
    /// that its elastic forces take back in its next step (docs/theory/soft.md, eq. 16d, 16e).
    fn take_back(&mut self, sums: &[DVec3], carried: &mut Vec<DVec3>) {
        let Some(step_s) = self.foretold_s() else { return };
        let mut taken_back = std::mem::take(&mut self.taken_back);
        // how far it will have been carried when it takes them, and which share of them then has acted through a whole step
        carried.iter_mut().zip(sums).for_each(|(moved, v)| *moved = (*moved - *v * self.age_s) / step_s);
        taken_back.extend(
            sums.iter()
                .zip(&*carried)
                .map(|(v, moved)| *v * (moved.dot(*v) / v.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)),
        );
        self.find_change(&mut taken_back, carried);
        let so_far_s = (self.reckoned_s() + self.age_s).min(step_s);
        self.velocities.iter_mut().zip(&taken_back).for_each(|(v, a)| *v += *a * so_far_s);
        self.taken_back = taken_back;
    }

    /// The length of the step that what bends foretells, seconds; `None` where it tells of none.
    pub(super) fn foretold_s(&self) -> Option<f64> {
        let slots = self.velocities.len();
        let inertia = self.neighbour.as_ref().map(|n| &n.snapshot.inertia).filter(|_| !self.held);
        let response = inertia.and_then(Inertia::response).filter(|response| response.slots() == slots)?;
        let step_s = response.forecast_s();
        (step_s > 0.0).then_some(step_s)
    }

    /// What is on its way, `changed` as velocities that have `carried` it so far, both one a slot as shares of the step that it foretells,
    /// changes of how it accelerates in that step, m/s², which goes to `changed`.
    pub(super) fn find_change(&self, changed: &mut [DVec3], carried: &mut Vec<DVec3>) {
        if let Some(response) = self.response() {
            response.elastic_change(self.borne, changed, carried);
        }
    }

    /// Adds what other owners have given a rigid body by the time `at`, and notes what they will give (eq. 6b); nothing of who
    /// is awake and has not been heard of for longer than any step lasts.
    fn share(&mut self, flight: &mut Flight<'_>, around: &StepContext<'_>, at: SimTime) {
        let to = flight.to;
        self.coming.clear();
        self.lasting.clear();
        for giver in around.neighbours.iter().filter(|giver| giver.id != to.id) {
            let Some(ledger) = given(giver, to.id) else { continue };
            let taken = acknowledged(to, giver.id);
            if taken.is_none_or(|taken| ledger.is_beyond(taken)) {
                ledger.since(taken, at, |site, sum, moved| flight.add(site, sum, moved));
                self.put_off(flight, (ledger, taken), at);
            }
            let from_s = giver.snapshot.time.secs_after(at);
            if ledger.force != Impulse::ZERO && (from_s > -DT_MAX_S || giver.snapshot.at_rest) {
                let force = [ledger.force.linear, ledger.force.angular];
                // a tube makes no longer parts beside others
                let step_s = giver.step_s.min(PART_MAX_S);
                self.lasting.push(Lasting { after_s: from_s.max(0.0), step_s, force });
            }
        }
    }

    /// Takes what acts only after `at` out of what has been given, and lists it.
    fn put_off(&mut self, flight: &mut Flight<'_>, (ledger, taken): (&Ledger, Option<&Ledger>), at: SimTime) {
        let same = taken.filter(|taken| taken.revision == ledger.revision);
        for coming in same.unwrap_or(ledger).coming.iter().filter(|coming| coming.acts.secs_after(at) > SOON_S) {
            let Some(page) = ledger.pages.iter().find(|page| page.number == coming.page) else { continue };
            let (entry, t) = (&coming.entry, at.secs_after(page.origin));
            flight.add(entry.site, -entry.sum, entry.moment - entry.sum * t);
            self.coming.push((coming.acts.secs_after(at), [entry.sum.linear, entry.sum.angular]));
        }
    }

    /// Takes what other owners give in the last `h` seconds, which have passed already.
    pub(super) fn receive(&mut self, h: f64) {
        let mut coming = std::mem::take(&mut self.coming);
        coming.retain_mut(|(after_s, impulse)| {
            *after_s -= h;
            let due = *after_s <= 0.0;
            if due {
                self.take_late(*impulse, -*after_s);
            }
            !due
        });
        self.coming = coming;
        let mut lasting = std::mem::take(&mut self.lasting);
        for giver in &mut lasting {
            if let Some((after_s, lasts_s)) = giver.within(h) {
                self.take_late(giver.force.map(|force| force * lasts_s), h - after_s);
            }
            giver.after_s = (giver.after_s - h).max(0.0);
        }
        self.lasting = lasting;
    }

    /// Takes an impulse that has acted for `since_s` seconds.
    fn take_late(&mut self, impulse: Twist, since_s: f64) {
        let mut change = impulse;
        self.respond(&mut change);
        self.leave(change[0]);
        self.velocities[0] += change[0];
        self.velocities[1] += change[1];
        self.shift(&change.map(|change| change * since_s));
    }

    /// By how much faster a rigid body moves in the mean of the next `h` seconds by what other owners give in them, m/s and rad/s.
    pub(super) fn gain_by_others(&self, h: f64) -> Twist {
        let mut sum = [DVec3::ZERO; 2];
        let mut add = |impulse: Twist, share: f64| sum = [0, 1].map(|part| sum[part] + impulse[part] * share);
        for (after_s, impulse) in self.coming.iter().filter(|(after_s, _)| *after_s < h - SOON_S) {
            add(*impulse, 1.0 - after_s / h);
        }
        for giver in &self.lasting {
            if let Some((after_s, lasts_s)) = giver.within(h) {
                add(giver.force, lasts_s * (1.0 - after_s / h));
            }
        }
        if sum != [DVec3::ZERO; 2] {
            self.respond(&mut sum);
        }
        sum
    }

    /// How what other owners go on giving accelerates a rigid body in the mean, m/s².
    pub(super) fn carried_by_others(&self) -> DVec3 {
        let mut sum = [DVec3::ZERO; 2];
        for giver in self.lasting.iter().filter(|giver| giver.after_s <= SOON_S) {
            sum = [0, 1].map(|part| sum[part] + giver.force[part]);
        }
        if !self.lasting.is_empty() {
            self.respond(&mut sum);
        }
        sum[0]
    }
}

impl Lasting {
    /// When in the mean it gives in the next `h` seconds, seconds from now, and for how long; `None` where it does not. What it gives for
    /// a step of its own it gives at the start of that.
    fn within(&self, h: f64) -> Option<(f64, f64)> {
        let lasts_s = h - self.after_s;
        (lasts_s > SOON_S).then(|| (self.after_s + 0.5 * (lasts_s - self.step_s).max(0.0), lasts_s))
    }
}

/// What `giver` has given to `to`.
fn given(giver: &Neighbour, to: AgentId) -> Option<&Ledger> {
    giver.snapshot.given.iter().find(|ledger| ledger.with == to).filter(|ledger| ledger.is_finite())
}

impl Flight<'_> {
    /// Takes out what fixed solids would not have given a rigid body (eq. 4d), and what they gave it only after `at`, where it was
    /// on its way to whoever sees it `from` there, or past who bends, and only comes back (eq. 5a). Whether it is still in the air then.
    fn leave_out(
        &mut self,
        rebound: &Rebound,
        (at, centre): (SimTime, DVec3),
        (me, from): (AgentId, Option<DVec3>),
    ) -> bool {
        let of = |slots: &[DVec3]| match *slots {
            [linear, angular, ..] => Impulse { linear, angular },
            _ => Impulse::ZERO,
        };
        let Inertia::Rigid { inverse_mass, inverse_inertia } = self.to.snapshot.inertia else { return false };
        let before = centre - rebound.way(at) * inverse_mass;
        let ahead = |from: DVec3| (before - from).dot(rebound.given.linear) > 0.0;
        let comes = rebound.age_s(at) < 0.0 && from.map_or(rebound.past == Some(me), ahead);
        let share = if comes {
            1.0
        } else {
            rebound.spared_by([of(&self.sums), of(&self.carried)], at, (inverse_mass, inverse_inertia))
        };
        let [given, way] = rebound.part(share, at);
        if given != Impulse::ZERO {
            self.add(Site::Whole, -given, -way);
        }
        let height_m = -rebound.way(at).dot(rebound.given.linear.normalize_or_zero()) * inverse_mass;
        comes && height_m > LIFTED_M
    }

    fn add(&mut self, site: Site, sum: Impulse, moved: Impulse) {
        let Self { to, slots, sums, carried } = self;
        if sums.is_empty() {
            sums.resize(*slots, DVec3::ZERO);
            carried.resize(*slots, DVec3::ZERO);
        }
        spread(to, site, |slot, share, angular| {
            let of = |impulse: Impulse| if angular { impulse.angular } else { impulse.linear } * share;
            sums[slot] += of(sum);
            carried[slot] += of(moved);
        });
    }
}

/// Which slots of `neighbour` an impulse at `site` acts on: (slot, share, whether it is the angular part).
fn spread(neighbour: &Neighbour, site: Site, mut visit: impl FnMut(usize, f64, bool)) {
    match (&neighbour.snapshot.body, site) {
        (Body::Curve(curve), Site::Arc(arc_m)) => {
            let Some((segment, share)) = curve.locate(arc_m) else { return };
            visit(2 * segment, 1.0 - share, false);
            visit(2 * segment + 2, share, false);
            visit(2 * segment + 1, 1.0, true);
        }
        (Body::Soft(soft), Site::Vertex(vertex)) if (vertex as usize) < soft.positions.len() => {
            visit(vertex as usize, 1.0, false);
        }
        (Body::Curve(_) | Body::Soft(_), _) | (_, Site::Arc(_) | Site::Vertex(_)) => {}
        (_, Site::Whole) => {
            visit(0, 1.0, false);
            visit(1, 1.0, true);
        }
    }
}
