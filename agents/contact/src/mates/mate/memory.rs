//! What a body that bends recalls from step to step of one that it touches.
//!
//! In: the accounts of its pairs, impulses of a substep. Out: what friction owes, what lasts. Never here: contacts, ledgers.
//! Theory: docs/theory/soft.md, eq. 16f–16h; docs/theory/coupling.md, section 3.

use super::super::tanks::Tanks;
use super::Mate;
use crate::{Exchange, PUSH_OUT_SHARE};
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::SimTime;

/// The share of the way that a place came from where friction holds it that is taken back in a step, or in one of the other's where that
/// is longer: as of a depth.
const BACK_SHARE: f64 = PUSH_OUT_SHARE;

impl Mate {
    /// Recalls for a step of `dt` seconds from `now` what the pair's last step left: how far the other is from where friction holds it,
    /// and what it was given.
    pub fn recall(&mut self, tanks: &mut Tanks, (now, dt): (SimTime, f64)) {
        // a tube that is ahead of who owns it, or linked to it, takes what it is given in blows (agents/models/src/rod/horizon.rs)
        let blows =
            |n: &Neighbour| n.snapshot.inertia.response().is_some_and(|r| r.curve().is_some() && r.forecast_s() == 0.0);
        self.evenly = !self.other.neighbour().is_some_and(blows);
        if self.evenly {
            self.look_back(tanks, (now, dt));
            self.remember(tanks);
        }
    }

    /// Recalls the second of these, of what foretells its next step and makes no shorter ones (eq. 16h).
    pub fn regain(&mut self, tanks: &mut Tanks, dt: f64) {
        self.evenly = self.other.is_foretold() && self.other.parts(dt) == 1;
        if self.evenly {
            self.remember(tanks);
        }
    }

    /// Divides a rigid body among those who press on it, once this owner is one of them, but for one that lies on this owner, who answers
    /// alone for all that presses it (docs/theory/coupling.md, eq. 6c, 7l).
    pub fn divide(&mut self, exchange: &Exchange, tanks: &mut Tanks, around: &StepContext<'_>) {
        let Some(it) = self.other.neighbour().filter(|_| !self.other.is_many()) else { return };
        let bears = it.snapshot.lies.get().is_some_and(|lies| lies.on == around.me);
        if bears || !tanks.get(it.id).is_some_and(|account| account.presses()) {
            return;
        }
        let presses = |n: &&Neighbour| n.snapshot.pairs.iter().any(|pair| pair.with == it.id && pair.contacts > 0);
        let others = around.neighbours.iter().filter(|n| n.id != it.id).filter(presses).count();
        let goes_on = exchange.goes_on(it.id);
        self.split = (1 + others) as f64;
        self.part = [goes_on.linear, goes_on.angular];
    }

    /// Recalls what it was given a second.
    fn remember(&mut self, tanks: &mut Tanks) {
        if let Some(account) = self.other.id().and_then(|id| tanks.get(id)) {
            self.lasts.extend_from_slice(&account.last);
        }
    }

    /// Recalls how far the other is from where friction holds it.
    fn look_back(&mut self, tanks: &mut Tanks, (now, dt): (SimTime, f64)) {
        self.minds = true;
        let Some(account) = self.other.id().and_then(|id| tanks.get(id)) else { return };
        account.astray.learn(&self.other, now);
        let span_s = self.other.neighbour().map_or(dt, |n| n.step_s.max(dt));
        self.back_share = BACK_SHARE * dt / span_s;
        self.back.extend(account.astray.owed().iter().map(|owed| *owed * (BACK_SHARE / span_s)));
    }

    /// Keeps that for the step that begins at `end`.
    pub fn keep(&mut self, tanks: &mut Tanks, end: SimTime) {
        let account = self.other.id().filter(|_| self.acted).and_then(|id| tanks.get(id));
        if let Some(account) = account {
            std::mem::swap(&mut account.last, &mut self.lasts);
            if self.minds {
                account.astray.pay(self.back_share);
                account.astray.expect(&self.other, end);
            }
        }
    }

    /// Takes from the impulses of a substep what lasts since the one before, where it acts evenly, a part in each of the other's
    /// steps (docs/theory/soft.md, eq. 16f), and notes them for the substep after.
    pub(super) fn spread(&mut self, list: &mut [DVec3], h: f64) {
        if self.other.parts(h) == 1 {
            self.lasts.clear();
            self.lasts.extend(list.iter().map(|all| *all / h));
            return;
        }
        let same = self.lasts.len() == list.len();
        let size: f64 = self.lasts.iter().map(|l| l.length_squared()).sum::<f64>() * h;
        let along: f64 = self.lasts.iter().zip(&*list).map(|(l, now)| l.dot(*now)).sum();
        let share = if same && size > 0.0 { (along / size).clamp(0.0, 1.0) } else { 0.0 };
        self.lasting.resize(list.len(), DVec3::ZERO);
        self.lasts.resize(list.len(), DVec3::ZERO);
        for ((now, lasting), before) in list.iter_mut().zip(&mut self.lasting).zip(&mut self.lasts) {
            let (all, part) = (*now, *before * (h * share));
            *now -= part;
            *lasting += part;
            *before = all / h;
        }
    }
}
