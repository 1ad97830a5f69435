//! Another agent as its neighbour expects it: brought to the neighbour's own time, with the impulses that are on their way.
//!
//! In: the newest snapshot, however old, and the ledger of what it does not know yet. Out: positions, velocities in slots, and
//! how it answers impulses; it goes on with its neighbour's substeps. Never here: which impulses it gets.
//! Theory: docs/theory/coupling.md, eq. 5–7d: v* = v + a τ + W (J − J_ack), x* = x + v τ + a τ²/2 + W ((J − J_ack) t − (S − S_ack)).

mod answer;
mod astray;
mod deliver;
mod ground;
mod held;
mod lying;
mod motion;
mod places;

pub use astray::Astray;

use super::Exchange;
use crate::{Neighbour, StepContext};
use glam::{DQuat, DVec3};
use lying::Lying;
use metachron_core::Twist;
use metachron_core::sprung::SprungPrediction;
use metachron_core::{AgentId, Body, ImpulseResponse, Inertia, ToolState};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

/// A neighbour at one's own time.
#[derive(Debug, Clone, Default)]
pub struct Other {
    neighbour: Option<Neighbour>,
    pose: Pose,
    /// Velocities in slots: a rigid body's or tool's centre and spin; a tube's nodes and segments in turn; a soft body's vertices.
    velocities: Vec<DVec3>,
    /// A rigid body's springs.
    lean: Option<SprungPrediction>,
    /// A tube's nodes, a soft body's vertices.
    positions: Vec<DVec3>,
    /// How a tube's segments are turned.
    frames: Vec<DQuat>,
    /// Room for two answers.
    answer: Vec<DVec3>,
    carried: Vec<DVec3>,
    /// Of what bends: by how much what is on its way changes how each slot accelerates, m/s² and rad/s²; empty for nothing.
    taken_back: Vec<DVec3>,
    age_s: f64,
    held: bool,
    /// It is a tool that holds the neighbour or is linked to it: led, whatever pushes it.
    led: bool,
    /// How far impulses have lifted it off what it stood on, metres, ≥ 0; `None` while none has.
    height_m: Option<f64>,
    /// Whether impulses only press it on what it stands on, while a solve takes that for granted.
    pressed: Option<bool>,
    /// Whether what it lies on bears what it is given, of what bends.
    borne: bool,
    /// How it lies on another agent that something fixed holds up.
    lying: Option<Lying>,
    /// Its weight, m/s², where it is seen in the air and has come down since on what it now stands on, which carries that.
    landing: Option<DVec3>,
    /// What other owners have announced for a rigid body: in how many seconds it acts.
    coming: Vec<(f64, Twist)>,
    /// What is expected of them after that.
    lasting: Vec<Lasting>,
}

/// What another owner goes on giving, a blow at the start of each of its steps (eq. 6e).
#[derive(Debug, Clone, Copy)]
struct Lasting {
    /// In how many seconds its next step begins, and how long its steps are.
    after_s: f64,
    step_s: f64,
    /// N and N·m.
    force: Twist,
}

/// A body at rest is immovable until something comes at it faster than this, m/s: what is laid down gently is not noticed.
pub const WAKE_M_S: f64 = 5e-3;

/// Where a body of one piece is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pose {
    centre: DVec3,
    rotation: DQuat,
}

impl Default for Pose {
    fn default() -> Self {
        Self { centre: DVec3::ZERO, rotation: DQuat::IDENTITY }
    }
}

impl Other {
    /// Takes in the newest state of `neighbour`, brought to the time of `around`; whether it is one that can be touched or held.
    /// A rigid body says `from` where it looks: what it stands in the way of has not been on the other side of it.
    ///
    /// Storage is used again: nothing is allocated once the sizes settle.
    pub fn meet(
        &mut self,
        neighbour: &Neighbour,
        around: &StepContext<'_>,
        exchange: &Exchange,
        from: Option<DVec3>,
    ) -> bool {
        let known = self.see(neighbour);
        if known {
            self.reckon();
            if holds_on(neighbour, around) {
                (self.held, self.led, self.lean) = (true, true, None);
            }
            self.age_s = around.time.secs_after(neighbour.snapshot.time);
            self.foresee(self.age_s);
            self.catch_up();
            self.deliver(neighbour, around, exchange, from);
        }
        known
    }

    /// Takes in the newest state of `neighbour` as it was published; whether it is one that can be touched or held.
    pub fn see(&mut self, neighbour: &Neighbour) -> bool {
        let snapshot = &neighbour.snapshot;
        let known = self.id() == Some(neighbour.id);
        self.neighbour = Some(neighbour.clone());
        // a tool that rests is pushed as any that moves: its drive keeps it there
        let sleeps = snapshot.at_rest && !matches!(snapshot.body, Body::Tool(_));
        (self.held, self.led) = (sleeps || matches!(snapshot.inertia, Inertia::Immovable), false);
        (self.age_s, self.height_m, self.lean, self.pressed) = (0.0, None, None, None);
        self.borne |= !known;
        (self.lying, self.landing) = (None, None);
        self.coming.clear();
        self.lasting.clear();
        self.taken_back.clear();
        self.positions.clear();
        self.velocities.clear();
        self.frames.clear();
        match &snapshot.body {
            Body::Nothing => false,
            Body::Rigid(body) => {
                self.pose = Pose { centre: body.position, rotation: body.rotation };
                self.velocities.extend([body.velocity, body.spin]);
                self.lean = self.lean_of(snapshot.sprung.get().copied(), [body.velocity, body.spin]);
                true
            }
            Body::Tool(ToolState { tip, rotation, velocity, .. }) => {
                self.pose = Pose { centre: *tip, rotation: *rotation };
                self.velocities.extend([*velocity, DVec3::ZERO]);
                self.lean = self.lean_of(snapshot.sprung.get().copied(), [*velocity, DVec3::ZERO]);
                true
            }
            Body::Curve(curve) => {
                self.positions.extend_from_slice(&curve.positions);
                self.frames.extend_from_slice(&curve.frames);
                self.interleave(&curve.velocities);
                !self.positions.is_empty()
            }
            Body::Soft(soft) => {
                self.positions.extend_from_slice(&soft.positions);
                self.velocities.extend_from_slice(&soft.velocities);
                !self.positions.is_empty()
            }
        }
    }

    /// Whether it is made of many points and not one piece.
    #[must_use]
    pub fn is_many(&self) -> bool {
        !self.positions.is_empty()
    }

    /// From one point to the next, how many slots: between those of a tube's nodes stand its spins. A rigid body has one point.
    #[must_use]
    pub fn stride(&self) -> usize {
        if self.neighbour.as_ref().is_some_and(|n| matches!(n.snapshot.body, Body::Soft(_))) { 1 } else { 2 }
    }

    /// Who.
    #[must_use]
    pub fn id(&self) -> Option<AgentId> {
        self.neighbour.as_ref().map(|n| n.id)
    }

    /// The neighbour as it was seen.
    #[must_use]
    pub const fn neighbour(&self) -> Option<&Neighbour> {
        self.neighbour.as_ref()
    }

    /// Its shape.
    #[must_use]
    pub fn form(&self) -> Option<&Arc<CollisionShape>> {
        self.neighbour.as_ref().and_then(|n| n.form.as_ref())
    }

    /// How old its state was, seconds; negative where it was ahead.
    #[must_use]
    pub const fn age_s(&self) -> f64 {
        self.age_s
    }

    /// Over how long a depth is taken back from it, seconds: until what was pushed out can show. Springs show it a step later.
    #[must_use]
    pub fn answers_within_s(&self) -> f64 {
        self.age_s.max(self.lean.as_ref().map_or(0.0, SprungPrediction::span_s))
    }

    /// Whether impulses do not move it: it is led, held, or at rest.
    #[must_use]
    pub const fn is_held(&self) -> bool {
        self.held
    }

    /// Whether it only rests: impulses would move it if it woke.
    #[must_use]
    pub fn is_asleep(&self) -> bool {
        let moves = |n: &Neighbour| !matches!(n.snapshot.inertia, Inertia::Immovable);
        self.held && !self.led && self.neighbour.as_ref().is_some_and(moves)
    }

    /// Whether springs hold it, as its owner knows.
    #[must_use]
    pub const fn is_sprung(&self) -> bool {
        self.lean.is_some()
    }

    /// Wakes a body that rests: from now on impulses move it.
    pub fn wake(&mut self) {
        let stays = |n: &Neighbour| matches!(n.snapshot.inertia, Inertia::Immovable);
        self.held = self.led || self.neighbour.as_ref().is_none_or(stays);
    }

    /// Wakes a body that rests if a blow is on its way to it: it only rests until it reads of that.
    pub fn stir(&mut self, around: &StepContext<'_>, exchange: &Exchange) {
        let Some(neighbour) = self.neighbour.clone().filter(|n| self.held && n.snapshot.at_rest) else { return };
        self.wake();
        self.deliver(&neighbour, around, exchange, None);
        let moves = self.velocities.iter().step_by(self.stride()).any(|v| v.length_squared() > WAKE_M_S * WAKE_M_S);
        self.held = self.held || !moves;
    }

    /// Its velocities in slots, m/s and rad/s.
    #[must_use]
    pub fn velocities(&self) -> &[DVec3] {
        &self.velocities
    }

    /// The same, to be written on by a solve.
    pub fn velocities_mut(&mut self) -> &mut [DVec3] {
        &mut self.velocities
    }

    /// The published response of a deformable.
    pub(super) fn response(&self) -> Option<&dyn ImpulseResponse> {
        self.neighbour.as_ref().and_then(|n| n.snapshot.inertia.response())
    }

    /// A tube's velocities in slots: nodes as published, segments as its inertia tells.
    fn interleave(&mut self, nodes: &[DVec3]) {
        let response = self.neighbour.as_ref().and_then(|n| n.snapshot.inertia.response());
        let spins = response.and_then(|response| response.curve()).map_or(&[][..], |curve| curve.spins());
        for (k, v) in nodes.iter().enumerate() {
            self.velocities.push(*v);
            if k + 1 < nodes.len() {
                self.velocities.push(spins.get(k).copied().unwrap_or(DVec3::ZERO));
            }
        }
    }
}

/// Whether `neighbour` is a tool that holds who looks, or is linked to them.
fn holds_on(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    let Body::Tool(tool) = &neighbour.snapshot.body else { return false };
    let linked = || around.links.iter().any(|link| link.other == neighbour.id);
    tool.grasp.is_some_and(|grasp| grasp.target == around.me) || linked()
}
