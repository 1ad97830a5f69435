//! Time that passes on several hosts by itself: beside the clock on the wall, or as fast as they step.
//!
//! In: a placed world, commands of its time. Out: windows, one after the other, on a thread of their own. Never here: a window.

use super::placed_world::PlacedWorld;
use crate::calls::WorldCalls;
use crate::error::WorldError;
use metachron_core::{SimSpan, SimTime};
use metachron_runtime::{SPEED_RANGE, SystemClock, TimelineCommand, on_a_thread, wait_until};
use std::sync::{Arc, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

/// Windows follow each other at least so often, wall time, where time stands or the clock is awaited.
const LOOKS_EVERY: Duration = Duration::from_millis(2);

/// A window that is later than this is not made up for: time passes more slowly then.
const LATE_MAX: Duration = Duration::from_millis(100);

/// How time passes by itself.
#[derive(Debug, Default)]
pub(super) struct Flow {
    /// Whether it has its thread.
    is_begun: bool,
    runs: bool,
    /// Seconds a second; `None` for as fast as hosts step.
    speed: Option<f64>,
    until: Option<SimTime>,
    /// Why it passes no more.
    ended: Option<String>,
}

impl PlacedWorld {
    /// Lets time pass by itself from now on, once it is let run ([`WorldCalls::drive`]), for as long as somebody else holds the world: a second a
    /// second, or as fast as hosts step where it `is_free`; it stands from `until` on.
    ///
    /// # Errors
    /// [`WorldError::Undivided`] where the system gives no thread.
    pub fn let_flow(self: &Arc<Self>, is_free: bool, until: Option<SimTime>) -> Result<(), WorldError> {
        let speed = (!is_free).then_some(1.0);
        let before =
            std::mem::replace(&mut *self.flow(), Flow { is_begun: true, runs: false, speed, until, ended: None });
        if before.is_begun {
            return Ok(());
        }
        let placed = Arc::downgrade(self);
        on_a_thread("placed-flow", move || flow(&placed))
            .map_err(|error| WorldError::Undivided { reason: format!("no thread: {error}") })
    }

    fn flow(&self) -> MutexGuard<'_, Flow> {
        self.flow.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Obeys a command of its time.
    pub(super) fn change_flow(&self, drive: TimelineCommand) -> Result<(), WorldError> {
        let mut flow = self.flow();
        match drive {
            TimelineCommand::Run => (flow.runs, flow.ended) = (true, None),
            TimelineCommand::Pause => flow.runs = false,
            TimelineCommand::Speed(speed) if speed.is_nan() => {}
            TimelineCommand::Speed(speed) => flow.speed = Some(speed.clamp(SPEED_RANGE.0, SPEED_RANGE.1)),
            TimelineCommand::Free => flow.speed = None,
            TimelineCommand::Step(span) | TimelineCommand::Leap(span) => {
                flow.runs = false;
                drop(flow);
                return self.advance(span);
            }
        }
        Ok(())
    }

    /// Why its time passes no more.
    pub(super) fn flows(&self) -> Result<(), WorldError> {
        self.flow().ended.clone().map_or(Ok(()), |why| Err(WorldError::Elsewhere(why)))
    }

    /// The span that is to pass now, of which `owed` has passed on the clock; `None` where time stands.
    fn next_span(&self, owed: Duration) -> Option<SimSpan> {
        let left = |until: SimTime| until.since(self.time());
        let flow = self.flow();
        let window = match flow.speed {
            _ if !flow.runs => return None,
            None => Self::WINDOW,
            Some(speed) if owed.mul_f64(speed) >= Duration::from_nanos(Self::WINDOW.as_nanos()) => Self::WINDOW,
            Some(_) => return None,
        };
        let until = flow.until;
        drop(flow);
        Some(until.map_or(window, |until| window.min(left(until)))).filter(|span| *span > SimSpan::ZERO)
    }
}

/// Lets time pass for as long as another holds the world.
fn flow(placed: &Weak<PlacedWorld>) {
    let mut since = Instant::now();
    while let Some(world) = placed.upgrade() {
        let Some(span) = world.next_span(since.elapsed()) else {
            if !world.flow().runs {
                since = Instant::now();
            }
            drop(world);
            wait_until(&SystemClock::new(), LOOKS_EVERY);
            continue;
        };
        let speed = world.flow().speed.unwrap_or(1.0);
        since += Duration::from_nanos(span.as_nanos()).div_f64(speed);
        if since.elapsed() > LATE_MAX {
            since = Instant::now();
        }
        if let Err(error) = world.advance(span) {
            let mut flow = world.flow();
            (flow.runs, flow.ended) = (false, Some(error.to_string()));
        }
    }
}
