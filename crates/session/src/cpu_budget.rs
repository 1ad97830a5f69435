//! The CPU budget: shares the cores among agents' steps at one price, which the picture pays too where it is drawn on them.
//!
//! In: the agents' load at their finest, the time that the frame loop takes or would like to. Out: a share for every
//! agent, and the time budget of the picture.
//! Never here: the market's law (`metachron_lod::adaptive::joint` has it), steps, drawing. Theory: `docs/theory/budget.md`, eq. 54 … 59.
//!
//! Agents and the frame loop exchange these numbers through atomics, without waiting.

use super::assemble::{ROOM, SHARE_MAX};
use metachron_core::{AgentId, Archive, ArchiveError};
use metachron_lod::adaptive::joint::{Between, Drawing, SharedPrice, Worker, price, temporal_error_px};
use metachron_lod::control::{ObjectView, VisibleDetail};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Numbers exchanged between a steered agent and the frame loop.
#[derive(Debug)]
pub(super) struct AgentBudget {
    /// The agent.
    id: AgentId,
    /// Its requested step rate, Hz.
    rate_hz: f64,
    /// The least fraction of its full work that it can run with.
    least: f64,
    /// Its share when the budget suffices for all.
    fair: f64,
    /// Its load at its finest as a share of one core, and the share of its period that its work may take; bits of f64.
    full: AtomicU64,
    share: AtomicU64,
    /// The finest ε and step that make a visible difference, metres and seconds, +∞ out of view; bits of f64.
    visible_eps: AtomicU64,
    visible_dt: AtomicU64,
}

impl AgentBudget {
    /// Nothing is reported yet.
    pub fn new(id: AgentId, rate_hz: f64, least: f64, fair: f64) -> Self {
        let [full, share, visible_eps, visible_dt] = [0.0, fair, 0.0, 0.0].map(|x: f64| AtomicU64::new(x.to_bits()));
        Self { id, rate_hz, least, fair, full, share, visible_eps, visible_dt }
    }

    /// Writes or reads the numbers exchanged.
    pub fn archive(&self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        for number in [&self.full, &self.share, &self.visible_eps, &self.visible_dt] {
            let mut bits = number.load(Ordering::Relaxed);
            archive.value(&mut bits)?;
            number.store(bits, Ordering::Relaxed);
        }
        Ok(())
    }

    /// The agent.
    pub fn id(&self) -> AgentId {
        self.id
    }

    /// The frame loop sets the ε and step that make a visible difference.
    pub fn set_visible(&self, detail: VisibleDetail) {
        self.visible_eps.store(detail.eps_m.to_bits(), Ordering::Relaxed);
        self.visible_dt.store(detail.dt_s.to_bits(), Ordering::Relaxed);
    }

    /// The ε and step that make a visible difference: all, until they are set.
    pub fn visible(&self) -> VisibleDetail {
        let of = |bits: &AtomicU64| f64::from_bits(bits.load(Ordering::Relaxed));
        VisibleDetail { eps_m: of(&self.visible_eps), dt_s: of(&self.visible_dt) }
    }

    /// The agent reports its load at its finest, as a share of one core.
    pub fn report_load(&self, full: f64) {
        self.full.store(full.to_bits(), Ordering::Relaxed);
    }

    /// The share of its period that the agent's work may take.
    pub fn share(&self) -> f64 {
        f64::from_bits(self.share.load(Ordering::Relaxed))
    }

    fn full(&self) -> f64 {
        f64::from_bits(self.full.load(Ordering::Relaxed))
    }

    fn set_share(&self, share: f64) {
        self.share.store(share.to_bits(), Ordering::Relaxed);
    }
}

/// The processor time of one frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct FramePeriod {
    /// Cores that agents and the frame loop share.
    pub cores: u32,
    /// Time until the next frame is due, seconds.
    pub period_s: f64,
}

/// The frame loop's use of the cores.
#[derive(Debug, Clone, Copy)]
pub(super) enum FrameLoop {
    /// It draws on them, and pays the agents' price for more than the rest.
    Draws(Drawing),
    /// A graphics card draws; so many seconds of a core go into a frame beside it.
    Takes(f64),
}

/// The processor shared by agents and pictures.
#[derive(Debug, Clone, Default)]
pub(super) struct CpuBudget {
    agents: Vec<Arc<AgentBudget>>,
    workers: Vec<Worker>,
    market: SharedPrice,
    open: bool,
}

/// Pixels assumed for an agent out of view: it will come into view again.
const UNSEEN_PX: f64 = 100.0;
/// Fraction of its pixels that an agent at its finest draws wrong, however slowly it moves.
const ERROR_LEAST: f64 = 0.01;

impl CpuBudget {
    /// The CPU budget of these agents.
    pub fn new(agents: Vec<Arc<AgentBudget>>) -> Self {
        Self { agents, ..Self::default() }
    }

    /// Shares the processor for the next frame; returns the seconds that a picture drawn on it may take, `None` if there is enough for all
    /// or a card draws. `weight` is the weight of an object in view in the picture's value, pixels.
    pub fn settle(
        &mut self,
        frame: FramePeriod,
        frame_loop: FrameLoop,
        views: &[ObjectView],
        weight: impl Fn(usize) -> f64,
    ) -> Option<f64> {
        let FramePeriod { cores, period_s } = frame;
        self.workers.clear();
        self.workers.extend(self.agents.iter().map(|agent| {
            let at = agent.id.0 as usize;
            let loss = views.get(at).map_or(0.0, |view| loss(view, weight(at), agent.rate_hz));
            Worker { full: period_s * agent.full(), least: agent.least, loss }
        }));
        let (lambda, limit_s) = match frame_loop {
            FrameLoop::Draws(drawing) => {
                // the agents' reported work includes waiting for a core: the picture's own core comes on top of their share
                let capacity = (ROOM * f64::from(cores) + 1.0) * period_s;
                self.market.settle(&self.workers, capacity, drawing).unzip()
            }
            FrameLoop::Takes(taken_s) => {
                // time outside the agents' room is the frame loop's; if that takes more, they have less
                let capacity = (ROOM * f64::from(cores) * period_s).min(f64::from(cores) * period_s - taken_s);
                (Some(price(&self.workers, capacity)).filter(|lambda| *lambda > 0.0), None)
            }
        };
        self.pay(lambda);
        limit_s
    }

    /// Gives every agent the share that it buys at a price; its fair share where there is none.
    fn pay(&mut self, lambda: Option<f64>) {
        if lambda.is_some() || self.open {
            for (agent, worker) in self.agents.iter().zip(&self.workers) {
                let bought = lambda.map(|lambda| agent.full() * worker.part(lambda)).filter(|share| *share > 0.0);
                // an agent steps on one core
                agent.set_share(bought.map_or(agent.fair, |share| share.min(SHARE_MAX)));
            }
        }
        self.open = lambda.is_some();
    }

    /// Ends the sharing: every agent returns to its fair share.
    pub fn close(&mut self) {
        if std::mem::take(&mut self.open) {
            self.agents.iter().for_each(|agent| agent.set_share(agent.fair));
        }
        self.market = SharedPrice::default();
    }
}

/// Pixels drawn wrong because of an agent's own error at its finest: the offset of half a step's motion, along an outline of twice the root
/// of its area.
fn loss(view: &ObjectView, weight: f64, rate_hz: f64) -> f64 {
    if !view.visible || view.pixels.is_nan() || view.pixels < 1.0 {
        return ERROR_LEAST * UNSEEN_PX * view.importance;
    }
    let off_px = temporal_error_px(Between::Hold, view.own_speed_px_s, 0.0, rate_hz);
    let wrong = ERROR_LEAST + 2.0 * off_px / view.pixels.sqrt();
    weight * if wrong < 1.0 { wrong } else { 1.0 }
}
