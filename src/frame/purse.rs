//! Agents' steps and the picture's levels bought at one price, where both come out of one processor.
//!
//! In: what agents would take at their finest, what the picture wants and its λ. Out: a share for every agent, and what the picture may
//! take. Never here: the market's law (`metachron_budget::adaptive::joint` has it), steps, drawing. Theory: `docs/theory/budget.md`, eq. 54 … 59.
//!
//! Agents tell and are told through numbers that nobody waits for.

use super::cast::ROOM;
use crate::control::ObjectView;
use metachron_budget::adaptive::joint::{Between, Drawing, Market, Worker, temporal_error_px};
use metachron_core::AgentId;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What an agent that can be steered and the frame loop tell each other.
#[derive(Debug)]
pub(super) struct Tally {
    /// Whose it is.
    id: AgentId,
    /// The rate at which the scene wants its steps, a second.
    rate_hz: f64,
    /// The least part of its full work that it can do with.
    least: f64,
    /// Its share where there is time for all.
    fair: f64,
    /// What it would take of a core at its finest, and the share of its period that its work may take; bits of f64.
    full: AtomicU64,
    share: AtomicU64,
    /// The ε that is as fine as anybody can see, metres, +∞ where nobody looks; bits of f64.
    plain: AtomicU64,
}

impl Tally {
    /// Nothing is told yet.
    pub fn new(id: AgentId, rate_hz: f64, (least, fair): (f64, f64)) -> Self {
        let [full, share, plain] = [0.0, fair, 0.0].map(|x: f64| AtomicU64::new(x.to_bits()));
        Self { id, rate_hz, least, fair, full, share, plain }
    }

    /// Whose it is.
    pub fn id(&self) -> AgentId {
        self.id
    }

    /// The frame loop tells the ε that is as fine as anybody can see, metres.
    pub fn show(&self, plain_m: f64) {
        self.plain.store(plain_m.to_bits(), Ordering::Relaxed);
    }

    /// The ε that is as fine as anybody can see, metres, +∞ where nobody looks; 0 until it is told.
    pub fn plain_m(&self) -> f64 {
        f64::from_bits(self.plain.load(Ordering::Relaxed))
    }

    /// The agent tells what it would take of a core at its finest.
    pub fn tell(&self, full: f64) {
        self.full.store(full.to_bits(), Ordering::Relaxed);
    }

    /// What the agent's work may take of its period.
    pub fn share(&self) -> f64 {
        f64::from_bits(self.share.load(Ordering::Relaxed))
    }

    fn full(&self) -> f64 {
        f64::from_bits(self.full.load(Ordering::Relaxed))
    }

    fn allow(&self, share: f64) {
        self.share.store(share.to_bits(), Ordering::Relaxed);
    }
}

/// The processor that agents and pictures share.
#[derive(Debug, Default)]
pub(super) struct Purse {
    tallies: Vec<Arc<Tally>>,
    workers: Vec<Worker>,
    market: Market,
    open: bool,
}

/// Pixels that an agent counts as which nobody sees: it will be seen again.
const UNSEEN_PX: f64 = 100.0;
/// The part of its pixels that an agent at its finest draws wrong, however slowly it moves.
const ERROR_LEAST: f64 = 0.01;

impl Purse {
    /// The purse of these agents.
    pub fn new(tallies: Vec<Arc<Tally>>) -> Self {
        Self { tallies, ..Self::default() }
    }

    /// Shares the processor out for the next frame of `period_s` on so many cores; the seconds that the picture may take of it, `None`
    /// where there is enough for all. `weight` is what an object in view is worth to the picture, pixels.
    pub fn settle(
        &mut self,
        (cores, period_s): (u32, f64),
        drawing: Drawing,
        views: &[ObjectView],
        weight: impl Fn(usize) -> f64,
    ) -> Option<f64> {
        self.workers.clear();
        self.workers.extend(self.tallies.iter().map(|tally| {
            let at = tally.id.0 as usize;
            let loss = views.get(at).map_or(0.0, |view| loss(view, weight(at), tally.rate_hz));
            Worker { full: period_s * tally.full(), least: tally.least, loss }
        }));
        // agents' work is told with what they wait for a core: the picture's own is on top of what they may plan with
        let capacity = (ROOM * f64::from(cores) + 1.0) * period_s;
        let settled = self.market.settle(&self.workers, capacity, drawing);
        if settled.is_some() || self.open {
            for (tally, worker) in self.tallies.iter().zip(&self.workers) {
                let bought = settled.map(|(lambda, _)| tally.full() * worker.part(lambda));
                tally.allow(bought.filter(|share| *share > 0.0).unwrap_or(tally.fair));
            }
        }
        self.open = settled.is_some();
        settled.map(|(_, limit_s)| limit_s)
    }

    /// Nothing is shared out any more: everybody has the share that is fair.
    pub fn close(&mut self) {
        if std::mem::take(&mut self.open) {
            self.tallies.iter().for_each(|tally| tally.allow(tally.fair));
        }
        self.market = Market::default();
    }
}

/// Pixels that an agent's own error makes wrong at its finest: it is off by what it moves in half a step along an outline of twice the
/// root of its area.
fn loss(view: &ObjectView, weight: f64, rate_hz: f64) -> f64 {
    if !view.visible || view.pixels.is_nan() || view.pixels < 1.0 {
        return ERROR_LEAST * UNSEEN_PX * view.importance;
    }
    let off_px = temporal_error_px(Between::Hold, view.speed_px_s, 0.0, rate_hz);
    let wrong = ERROR_LEAST + 2.0 * off_px / view.pixels.sqrt();
    weight * if wrong < 1.0 { wrong } else { 1.0 }
}
