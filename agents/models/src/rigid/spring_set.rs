//! Springs on a rigid body from user springs, tools and links, and their reactions on the other ends.
//!
//! In: hands, tools that hold the body, links whose pair it owns. Out: springs aimed at where the other ends are now, and the
//! impulses of those ends, booked. Never here: how springs are solved ([`crate::rigid::linear_spring`]).

use super::company::Company;
use super::linear_spring::LinearSpring;
use super::orientation_spring::OrientationSpring;
use glam::{DMat3, DVec3};
use metachron_contact::agent::tool_extrapolation_s;
use metachron_contact::{AnchorSpring, StepContext};
use metachron_contact::{Law, Link, Other};
use metachron_core::{Anchor, Body};
use metachron_core::{ContactJacobian, PairKind};

/// All springs on a body.
#[derive(Default)]
pub(super) struct SpringSet {
    /// The springs.
    pub all: Vec<LinearSpring>,
    /// The agent at the other end of each.
    ends: Vec<Option<End>>,
    /// Scratch storage for one response.
    scratch: Vec<DVec3>,
}

/// The other end of a spring.
#[derive(Debug, Clone, Copy)]
struct End {
    guest: usize,
    anchor: Anchor,
    /// Whether it is a tool's grasp or a link of the scene.
    kind: PairKind,
}

impl SpringSet {
    /// Whether there are no springs.
    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The impulse of springs to coupled peers on this body in the last part, N·s; user springs and tools are driven and do not count.
    pub(super) fn linked(&self) -> DVec3 {
        let linked = self.all.iter().zip(&self.ends).filter(|(tie, end)| end.is_some() && tie.yields != DMat3::ZERO);
        linked.map(|(tie, _)| tie.impulse).sum()
    }

    /// Gathers every spring of this step.
    pub(super) fn gather(&mut self, context: &StepContext<'_>, company: &Company) {
        self.all.clear();
        self.ends.clear();
        for pull in context.anchor_springs() {
            let by = pull.by.map(|by| company.guests().iter().position(|guest| guest.id() == Some(by)));
            if by == Some(None) {
                continue; // a tool with a non-finite state holds nothing
            }
            let guest = by.flatten();
            let turn = guest.and_then(|guest| orientation_spring_of(&company.guests()[guest].other, &pull, context));
            self.all.push(LinearSpring { turn, ..LinearSpring::driven(pull) });
            self.ends.push(guest.map(|guest| End { guest, anchor: Anchor::Local(DVec3::ZERO), kind: PairKind::Grasp }));
        }
        for link in context.links.iter().filter(|link| !matches!(link.law, Law::Tlm { .. } | Law::Off)) {
            let owned = context.neighbours.iter().any(|n| n.id == link.other && n.owned);
            let guest = company.guests().iter().position(|guest| guest.id() == Some(link.other));
            if let Some(guest) = guest.filter(|_| owned) {
                self.all.push(LinearSpring { rest_m: link.rest_m, ..LinearSpring::driven(spring_of(link)) });
                self.ends.push(Some(End { guest, anchor: link.there, kind: PairKind::Attachment }));
            }
        }
    }

    /// Aims the springs at the positions of their other ends, and queries the compliance of those ends.
    ///
    /// Where several springs pull at one agent, each sees its inverse mass times their number: together they never pull
    /// harder than it can follow.
    pub(super) fn update_targets(&mut self, company: &Company) {
        let Self { all, ends, scratch } = self;
        for (tie, end) in all.iter_mut().zip(ends.iter()) {
            // a tool's end moves on by itself, as a user spring's does
            let Some(End { guest: i, anchor, .. }) = end.filter(|end| end.kind != PairKind::Grasp) else { continue };
            let other = &company.guests()[i].other;
            let Some((target, velocity)) = other.point(anchor) else { continue };
            (tie.pull.target, tie.pull.target_velocity) = (target, velocity);
            let shared = ends.iter().flatten().filter(|end| end.guest == i).count();
            let mut slots = ContactJacobian::default();
            other.hold(&mut slots, anchor);
            let column = |axis: DVec3| {
                scratch.clear();
                scratch.resize(other.velocities().len(), DVec3::ZERO);
                slots.scatter(axis, scratch);
                other.respond(scratch);
                slots.velocity(scratch) * shared as f64
            };
            let [x, y, z] = DVec3::AXES.map(column);
            tie.yields = DMat3::from_cols(x, y, z);
        }
    }

    /// Advances the targets of user springs and tools by `h` seconds.
    pub(super) fn advance(&mut self, h: f64) {
        for tie in &mut self.all {
            tie.pull.target += tie.pull.target_velocity * h;
            tie.turn.iter_mut().for_each(|turn| turn.advance(h));
        }
    }

    /// Gives the other ends the reactions to the springs' impulses in `h` seconds from `after_s` seconds into the step on.
    pub(super) fn apply_reactions(&mut self, company: &mut Company, after_s: f64, h: f64) {
        let Self { all, ends, scratch } = self;
        for (tie, end) in all.iter().zip(ends.iter()) {
            let Some(End { guest: i, anchor, kind }) = *end else { continue };
            let (guests, exchange, ..) = company.split();
            let other = &mut guests[i].other;
            let mut slots = ContactJacobian::default();
            other.hold(&mut slots, anchor);
            scratch.clear();
            scratch.resize(other.velocities().len(), DVec3::ZERO);
            slots.scatter(-tie.impulse, scratch);
            if let Some(turn) = &tie.turn {
                scratch[1] -= turn.impulse;
            }
            other.book(exchange, (after_s, h), scratch);
            other.push(scratch, h);
            if let Some(id) = other.id() {
                let state = exchange.pair_mut(id);
                state.kind = kind;
                state.contacts = state.contacts.max(1);
            }
        }
    }
}

/// The torsional spring by which a tool, brought to the body's own time, keeps the body that it pulls from turning.
fn orientation_spring_of(tool: &Other, pull: &AnchorSpring, context: &StepContext<'_>) -> Option<OrientationSpring> {
    let seen = &tool.neighbour()?.snapshot;
    let Body::Tool(state) = &seen.body else { return None };
    let clasp = state.grasp.and_then(|grasp| grasp.orientation)?;
    Some(OrientationSpring::of(state, &clasp, pull, tool_extrapolation_s(context.time, seen.time)))
}

/// A link as a spring; its target is set later.
const fn spring_of(link: &Link) -> AnchorSpring {
    AnchorSpring {
        by: Some(link.other),
        anchor: link.here,
        target: DVec3::ZERO,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: link.stiffness_n_m,
        damping_n_s_m: link.damping_n_s_m,
    }
}
