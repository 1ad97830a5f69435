//! All objects of a world at one moment.
//!
//! In: the newest states. Out: points at a common time. Never here: drawing.

use super::object::Object;
use crate::error::WorldError;
use crate::world::World;
use glam::DVec3;
use metachron_core::{Anchor, Body, SimTime, Snapshot};
use metachron_runtime::TimelineCommand;
use std::sync::Arc;
use std::time::Duration;

/// A state is led on by its velocities for at most so long, seconds: a body that has stopped must not fly apart.
const AHEAD_MAX_S: f64 = 0.1;

/// All objects at one moment: each one's newest state, led on to it by its velocities.
#[derive(Debug, Clone)]
pub struct Frame {
    world: World,
    time: SimTime,
    states: Vec<Arc<Snapshot>>,
}

impl Frame {
    pub(crate) fn now(world: World) -> Self {
        let (time, states) = (world.time(), world.agents().iter().map(|agent| agent.latest()).collect());
        Self { world, time, states }
    }

    /// The world.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// The moment.
    #[must_use]
    pub const fn time(&self) -> SimTime {
        self.time
    }

    /// The newest state of an object when the frame was made.
    ///
    /// # Errors
    /// [`WorldError::Foreign`], [`WorldError::Gone`], and [`WorldError::Later`] for one that joined since.
    pub fn state(&self, object: Object) -> Result<&Snapshot, WorldError> {
        let agent = self.world.agent(object)?;
        let state = self.states.get(agent.id().0 as usize);
        state.map(|state| &**state).ok_or_else(|| WorldError::Later { name: agent.name().to_owned() })
    }

    /// A material point of an object at the frame's moment, metres.
    ///
    /// # Errors
    /// The errors of [`Frame::state`], and [`WorldError::NoPoint`] for a point that the object does not have.
    pub fn point(&self, object: Object, anchor: Anchor) -> Result<DVec3, WorldError> {
        let state = self.state(object)?;
        let (position, velocity) = state.body.point(anchor).ok_or_else(|| self.world.no_point(object, anchor))?;
        Ok(position + velocity * self.ahead_s(state))
    }

    /// The matter of an object at the frame's moment.
    ///
    /// # Errors
    /// The errors of [`Frame::state`].
    pub fn body(&self, object: Object) -> Result<Body, WorldError> {
        let state = self.state(object)?;
        let mut body = state.body.clone();
        body.lead(self.ahead_s(state));
        Ok(body)
    }

    /// How long a state is led on, seconds.
    fn ahead_s(&self, state: &Snapshot) -> f64 {
        if state.at_rest { 0.0 } else { self.time.secs_after(state.moment()).clamp(-AHEAD_MAX_S, AHEAD_MAX_S) }
    }
}

/// Frames at a steady rate; they end when the world is stopped.
#[derive(Debug)]
pub struct Frames {
    world: World,
    period: Duration,
    next: Duration,
}

impl Frames {
    pub(crate) fn new(world: World, rate_hz: f64) -> Self {
        world.drive(TimelineCommand::Run);
        let period = Duration::try_from_secs_f64(rate_hz.recip()).ok().filter(|period| !period.is_zero());
        let period = period.unwrap_or(Duration::from_secs(1));
        let next = world.now() + period;
        Self { world, period, next }
    }
}

impl Iterator for Frames {
    type Item = Frame;

    fn next(&mut self) -> Option<Frame> {
        self.world.wait_until(self.next);
        // frames that came too late are left out
        self.next = (self.next + self.period).max(self.world.now());
        (!self.world.has_stopped()).then(|| Frame::now(self.world.clone()))
    }
}
