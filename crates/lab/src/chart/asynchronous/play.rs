//! A step harness with energy sums: agents, their springs, and the sums over them.
//!
//! In: bodies and tubes with rates, springs from fixed points, links between them. Out: energy as each agent reports it at its
//! own time, and energy and momentum at a common time. Never here: which bodies, which claims.

use super::super::energy_bench::springs_j;
use super::bench::{Faults, PairLaw, StepHarness, Weight};
use glam::DVec3;
use metachron_contact::audit::{Audit, audit, in_flight, settled};
use metachron_contact::{AnchorSpring, Link};
use metachron_core::{AgentId, Anchor, Body, RigidState, SimTime, Snapshot};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, gap};
use metachron_geometry::{PlacedShape, ShapePose};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Tube, TubeSpec};

/// Agents, and the data for sums over them.
pub(in super::super) struct Play {
    /// The agents.
    pub(in super::super) stage: StepHarness,
    solids: Vec<Solid>,
    links: Vec<(AgentId, Link)>,
}

/// The terms of one agent's energy.
struct Solid {
    /// Zero for a tube, which reports all of its energy itself.
    mass_kg: f64,
    gravity: DVec3,
    springs: Vec<AnchorSpring>,
}

impl Play {
    /// An empty stage; all pairs touch by `law`.
    pub(in super::super) fn new(law: PairLaw, faults: Faults) -> Self {
        Self { stage: StepHarness::new(law, faults), solids: Vec::new(), links: Vec::new() }
    }

    /// Adds a rigid body that fixed springs pull; `None` where the body cannot be built.
    pub(in super::super) fn add_body(
        &mut self,
        spec: RigidSpec,
        rate_hz: f64,
        springs: Vec<AnchorSpring>,
    ) -> Option<AgentId> {
        let (mass_kg, gravity) = (spec.mass_kg, spec.gravity);
        let weight = Weight { gravity, ..Weight::default() };
        let id = self.stage.add(Box::new(RigidBody::new(spec).ok()?), rate_hz, weight);
        self.stage.attach_springs(id, springs.clone());
        self.solids.push(Solid { mass_kg, gravity, springs });
        Some(id)
    }

    /// Adds a tube; `None` where it cannot be built.
    pub(in super::super) fn add_tube(&mut self, spec: TubeSpec, rate_hz: f64) -> Option<AgentId> {
        let gravity = spec.gravity;
        let weight = Weight { mass_per_length_kg_m: spec.section.mass_per_length_kg_m, gravity };
        let id = self.stage.add(Box::new(Tube::new(spec).ok()?), rate_hz, weight);
        self.solids.push(Solid { mass_kg: 0.0, gravity, springs: Vec::new() });
        Some(id)
    }

    /// Links `of` to another agent; both have the link.
    pub(in super::super) fn link(&mut self, of: AgentId, link: Link) {
        self.stage.link(of, link);
        self.links.push((of, link));
    }

    /// Plays up to `seconds` and calls `go_on` with the agent after every step; `false` ends the run, and so does a failed step.
    pub(in super::super) fn run(mut self, seconds: f64, mut go_on: impl FnMut(&Self, AgentId) -> bool) -> Self {
        while let Some(id) = self.stage.next(seconds) {
            if self.stage.step(id).is_err() || !go_on(&self, id) {
                break;
            }
        }
        self
    }

    /// The earliest of all own times.
    pub(in super::super) fn time(&self) -> SimTime {
        let times = (0..self.solids.len() as u32).map(|id| self.stage.own(AgentId(id)).time);
        times.min().unwrap_or(SimTime::ZERO)
    }

    /// Sum of the energies that agents report, each at its own time, joules.
    pub(in super::super) fn raw_j(&self) -> f64 {
        let own = |id: u32| self.stage.own(AgentId(id));
        let one = |(id, solid): (u32, &Solid)| {
            let snapshot = own(id);
            let springs = match &snapshot.body {
                Body::Rigid(state) => springs_j(&solid.springs, state),
                _ => 0.0,
            };
            snapshot.energy_j + springs
        };
        (0..).zip(&self.solids).map(one).sum::<f64>() + self.links_j(|id, anchor| own(id.0).body.point(anchor))
    }

    /// Energy and momentum at the time `at`, with every given impulse delivered.
    pub(in super::super) fn common(&self, at: SimTime) -> Audit {
        let members = self.stage.members();
        let mut sum = audit(&members, at, &mut |id, state| {
            let Some(solid) = self.solids.get(id.0 as usize) else { return 0.0 };
            springs_j(&solid.springs, state) - solid.mass_kg * solid.gravity.dot(state.position)
        });
        sum.energy_j += self.links_j(|id, anchor| {
            let member = members.get(id.0 as usize)?;
            match settled(member, &members, at) {
                Some(state) => Body::Rigid(state).point(anchor),
                None => member.snapshot.body.point(anchor),
            }
        });
        sum
    }

    /// A rigid body at the time `at`, with every impulse given to it delivered.
    pub(in super::super) fn body(&self, id: AgentId, at: SimTime) -> Option<RigidState> {
        let members = self.stage.members();
        settled(members.get(id.0 as usize)?, &members, at)
    }

    /// How deep two rigid bodies overlap at the time `at`, metres; zero where they do not.
    pub(in super::super) fn depth_m(&self, pair: [AgentId; 2], at: SimTime, room: &mut NarrowPhaseScratch) -> f64 {
        let placed = |id: AgentId| {
            let RigidState { position, rotation, .. } = self.body(id, at)?;
            Some(PlacedShape { form: self.stage.form(id)?, view: ShapePose::Solid { position, rotation } })
        };
        let found = placed(pair[0]).zip(placed(pair[1])).and_then(|(a, b)| gap(&a, &b, 0.0, room));
        found.map_or(0.0, |(_, gap_m)| -gap_m)
    }

    /// The linear impulse that other agents have given `id` and that it has not yet taken, N·s.
    pub(in super::super) fn in_flight(&self, id: AgentId) -> DVec3 {
        let members = self.stage.members();
        let mut sum = DVec3::ZERO;
        if let Some(member) = members.get(id.0 as usize) {
            in_flight(member, &members, |_, _, dj, _| sum += dj.linear);
        }
        sum
    }

    /// Energy of the links, joules; `point` gives position and velocity of a material point of an agent.
    fn links_j(&self, point: impl Fn(AgentId, Anchor) -> Option<(DVec3, DVec3)>) -> f64 {
        let one = |(of, link): &(AgentId, Link)| {
            let ends = point(*of, link.here).zip(point(link.other, link.there));
            ends.map_or(0.0, |((a, _), (b, _))| 0.5 * link.stiffness_n_m * (a.distance(b) - link.rest_m).powi(2))
        };
        self.links.iter().map(one).sum()
    }
}

/// The impulse of contacts on a rigid body, step by step: the change of its momentum minus the parts of gravity and its springs.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct ContactImpulse {
    momentum: Option<DVec3>,
    /// The sum, N·s.
    pub(in super::super) sum: DVec3,
    /// Sum of the magnitudes, N·s.
    pub(in super::super) size: f64,
}

impl ContactImpulse {
    /// Adds the impulse up to the state after a step of `dt_s` seconds of a body of this mass under `gravity`.
    pub(in super::super) fn add(&mut self, snapshot: &Snapshot, mass_kg: f64, gravity: DVec3, dt_s: f64) {
        let Body::Rigid(state) = &snapshot.body else { return };
        let momentum = state.velocity * mass_kg;
        if let Some(before) = self.momentum.replace(momentum) {
            let pulled: DVec3 = snapshot.grips.iter().filter(|g| g.by.is_none()).map(|g| g.force_n).sum();
            let given = momentum - before - (gravity * mass_kg + pulled) * dt_s;
            self.sum += given;
            self.size += given.length();
        }
    }
}
