//! Pairs whose sides keep clocks of their own: each sees the other's newest published state, one of them computes the
//! impulses between them, and a ledger or a transmission line carries these across.
//!
//! In: partners outside a cluster, as its members see them. Out: remote members and known impulses for the cluster's
//! step; after it, the data that partners read. Never here: contacts, solves, clocks. Theory: docs/theory/coupling.md.
//!
//! join     takes the impulses of partners, sees the partners that are met here, lays out lines
//! (step)   the cluster's problem, with partners as remote members
//! part     settles the impulses taken, books those given to remote members, publishes local models
//!
//! A step that is not made has taken nothing: the next join finds the same.

mod ledgers;
mod lines;
mod local;
mod member;
mod published_shape;
mod transmission_line;

use crate::lists::{entry, reset};
use crate::member::memory::Partner;
use crate::member::{ClusterMember, ContactMemory, Participant};
use crate::remote::ledgers::state_of;
use crate::remote::local::Scratch;
use crate::remote::published_shape::anchor_of;
use crate::solve::Side;
use crate::step::{ClusterStepper, KnownImpulse};
use crate::{Law, Neighbour, StepContext};
pub use ledgers::{GivenAt, Ledgers, TakenImpulse, acknowledged};
use local::LocalQuery;
pub use member::{RemoteMember, RemoteView};
pub use published_shape::PublishedShape;

use glam::DVec3;
use lines::Lines;
use metachron_core::{
    AgentId, Archive, ArchiveError, Body, Grip, Impulse, LocalModel, LocalPartner, PairKind, PairState, SimTime, Site,
    Snapshot, archive_values,
};

use std::sync::Arc;

/// The share of its weight from which on a force counts as bearing a body.
const BEARS_SHARE: f64 = 0.5;

/// Whether `me` computes an asynchronous pair: the side with the shorter wanted step does, at equal steps the lower number.
#[must_use]
pub fn computes(me: PairClock, other: PairClock) -> bool {
    me.step_s.total_cmp(&other.step_s).then(me.id.cmp(&other.id)).is_lt()
}

/// An agent and the step that its scene wants, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairClock {
    /// The agent.
    pub id: AgentId,
    /// Its wanted step.
    pub step_s: f64,
}

/// The asynchronous pairs of one agent.
#[derive(Default)]
pub struct Pairs {
    ledgers: Ledgers,
    lines: Lines,
    states: Vec<PairState>,
    model: LocalModel,
    /// For each block of a body that nothing of its cluster held in its last step the force that would hold it still, N or N·m; empty of
    /// one that was held.
    weight: Vec<DVec3>,
    scratch: Scratch,
}

/// The partners of a cluster's members that are met in its problem.
#[derive(Debug, Default)]
pub struct Remotes {
    /// By rising numbers.
    all: Vec<Remote>,
}

#[derive(Debug)]
struct Remote {
    seen: Neighbour,
    member: RemoteMember,
    memory: ContactMemory,
    grips: Vec<Grip>,
    /// Whether it takes part in this macro step.
    met: bool,
}

/// A macro step as asynchronous pairs see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MacroStep {
    /// How long it is meant to be, seconds.
    pub dt_s: f64,
    /// The most steps that a member makes in it.
    pub parts: u32,
}

/// Whether the two touch, or are linked, by a ledger.
fn by_ledger(context: &StepContext<'_>, other: &Neighbour) -> bool {
    let linked = || context.links.iter().any(|link| link.other == other.id && link.law == Law::Ledger);
    (other.law == Law::Ledger && other.form.is_some()) || linked()
}

impl Remote {
    /// One that is not met yet.
    fn new(seen: Neighbour) -> Self {
        let (member, memory) = (RemoteMember::default(), ContactMemory::default());
        Self { seen, member, memory, grips: Vec::new(), met: false }
    }
}

impl Remotes {
    /// Writes or reads the state that the next macro step needs: the memory of each partner is kept, the partner is
    /// seen anew.
    ///
    /// # Errors
    /// [`ArchiveError::Malformed`].
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let unseen = |id| Remote::new(Neighbour::observed(id, Arc::default()));
        archive.list(
            &mut self.all,
            || unseen(AgentId(0)),
            |remote, archive| {
                let mut id = remote.seen.id;
                archive_values!(archive, id, remote.memory, remote.grips)?;
                if archive.is_reading() {
                    let read = std::mem::replace(remote, unseen(id));
                    (remote.memory, remote.grips) = (read.memory, read.grips);
                }
                Ok(())
            },
        )
    }

    /// Before a macro step: takes the impulses of partners on `locals`, and adds the partners that they meet as remote
    /// members.
    pub fn join<'a>(
        &'a mut self,
        locals: &mut Vec<Participant<'a>>,
        pairs: &mut [Option<&mut Pairs>],
        stepper: &mut ClusterStepper,
        step: MacroStep,
    ) {
        stepper.external().clear();
        self.all.iter_mut().for_each(|remote| remote.met = false);
        let Some(time) = locals.first().map(|first| first.context.time) else { return };
        for (place, (one, pairs)) in locals.iter_mut().zip(&mut *pairs).enumerate() {
            let Some(pairs) = pairs else { continue };
            pairs.take(place, one, stepper, step.dt_s);
            pairs.lines.lay_out(place, one, stepper, step.dt_s);
            let context = one.context;
            for other in context.neighbours.iter().filter(|other| other.computed_here && by_ledger(&context, other)) {
                self.see(other, &context, &pairs.ledgers);
            }
        }
        for Remote { seen, member, memory, grips, .. } in self.all.iter_mut().filter(|remote| remote.met) {
            member.predict(seen, time);
            let (id, context) = (seen.id, StepContext::alone(seen.id, time));
            locals.push(Participant {
                id,
                member: (member as &mut dyn ClusterMember).into(),
                context,
                laws: &[],
                memory,
                parts: step.parts,
                alone_s: step.dt_s,
                grips,
            });
        }
    }

    /// Sees a partner, for one of the participants that meet it.
    fn see(&mut self, other: &Neighbour, context: &StepContext<'_>, ledgers: &Ledgers) {
        let remote = entry(&mut self.all, &other.id, |remote| remote.seen.id, || Remote::new(other.clone()));
        if !remote.met {
            remote.seen.clone_from(other);
            remote.met = remote.member.see(other);
        }
        if remote.met {
            let Remote { seen, member, .. } = &mut *remote;
            let view = RemoteView { id: context.me, neighbour: seen, time: context.time };
            member.add_partner(&view, |visit| ledgers.in_flight(context.me, seen, context.time, visit));
        }
    }
}

/// After a macro step that took `dt_s` seconds: books the impulses on remote members, and makes the local models that partners read.
/// `all` are the participants of the step, remote members last.
pub fn part(all: &[Participant<'_>], pairs: &mut [Option<&mut Pairs>], stepper: &mut ClusterStepper, dt_s: f64) {
    // first of all: the step is made, whatever a member's code does now
    for pairs in pairs.iter_mut().flatten() {
        pairs.ledgers.settle();
        pairs.lines.settle();
    }
    let locals = all.partition_point(|one| !one.member.is_remote());
    for (place, pairs) in pairs.iter_mut().enumerate().take(locals) {
        let Some(pairs) = pairs else { continue };
        stepper.weight(all, place, &mut pairs.weight);
        pairs.book(place, all, stepper, dt_s);
        pairs.lines.answer(place, stepper, &mut pairs.states, dt_s);
        pairs.publish(place, all, stepper);
    }
}

impl Pairs {
    /// Writes or reads the state that the next macro step needs.
    ///
    /// # Errors
    /// [`ArchiveError::Malformed`].
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.ledgers, self.states, self.model, self.weight)?;
        self.lines.archive(archive)
    }

    /// Takes the impulses of partners as forces that act evenly over the step. A block that nothing holds goes to where
    /// impacts would have carried it, had they come when the impulses acted (eq. 4).
    fn take(&mut self, place: usize, one: &mut Participant<'_>, stepper: &mut ClusterStepper, dt_s: f64) {
        self.ledgers.open(&one.context);
        let known = &mut stepper.external().known;
        let Self { weight, scratch: Scratch { carried, goes_on: sums, .. }, .. } = self;
        for list in [&mut *carried, &mut *sums] {
            reset(list, weight.len(), DVec3::ZERO);
        }
        self.ledgers.take(&one.context, dt_s, |taken| {
            let add = |list: &mut [DVec3], side: &Side, impulse: DVec3| {
                for term in side.terms() {
                    list.get_mut(term.block).into_iter().for_each(|sum| *sum += term.map.transpose() * impulse);
                }
            };
            one.member.visit_sides(anchor_of(taken.site), taken.impulse, |side, impulse| {
                known.push(KnownImpulse { member: place, side, impulse });
                add(sums, &side, impulse);
            });
            one.member.visit_sides(anchor_of(taken.site), taken.carried, |side, way| add(carried, &side, way));
        });
        for ((way, sum), weight) in carried.iter_mut().zip(&*sums).zip(&*weight) {
            let force = *sum / dt_s;
            let lasts = persistent(force, *weight).dot(force) / force.length_squared().max(f64::MIN_POSITIVE);
            *way *= 1.0 - lasts.clamp(0.0, 1.0);
        }
        if carried.iter().any(|way| *way != DVec3::ZERO) {
            one.member.change(|m| m.carry(carried));
        }
    }

    /// Books the impulses of this agent on remote members.
    fn book(&mut self, place: usize, all: &[Participant<'_>], stepper: &mut ClusterStepper, dt_s: f64) {
        let Self { ledgers, states, .. } = self;
        let context = all[place].context;
        for state in &mut *states {
            (state.contacts, state.force_n, state.penetration_m) = (0, 0.0, 0.0);
        }
        for given in stepper.external().given.iter().filter(|given| given.member == place) {
            let remote = &all[given.remote];
            let Some(other) = context.neighbours.iter().find(|other| other.id == remote.id) else { continue };
            let slot = remote.member.slot_of(given.block);
            let Some((site, impulse)) = site_of(&other.snapshot.body, slot, given.impulse) else { continue };
            let at = GivenAt { site, time: context.time, after_s: given.after_s };
            ledgers.give(remote.id, at, impulse);
            let state = state_of(states, remote.id, PairKind::Ledger);
            state.force_n += impulse.linear.length() / dt_s;
            state.impulse_n_s += impulse.linear.length();
        }
        for total in stepper.totals_of(place).iter().filter(|total| total.contacts > 0) {
            if let Partner::Agent(with) = total.partner
                && let Some(state) = states.iter_mut().find(|state| state.with == with)
            {
                (state.contacts, state.penetration_m) = (total.contacts, total.depth_m);
                state.force_n = total.impulse_n_s.length() / dt_s;
                state.inverse_mass_per_kg = total.inverse_mass_per_kg.or(state.inverse_mass_per_kg);
            }
        }
        for state in states.iter_mut().filter(|state| state.kind == PairKind::Ledger) {
            let other = context.neighbours.iter().find(|other| other.id == state.with);
            state.in_flight_n_s = other.map_or(0.0, |other| ledgers.in_flight_n_s(context.me, other));
        }
    }

    /// Makes the local model for partners that compute their pairs with this agent.
    fn publish(&mut self, place: usize, all: &[Participant<'_>], stepper: &mut ClusterStepper) {
        let Self { ledgers, model, weight, scratch, .. } = self;
        let one = &all[place];
        let context = one.context;
        scratch.blocks.clear();
        model.blocks.clear();
        let mut partners = 0;
        for other in context.neighbours.iter().filter(|other| !other.computed_here && by_ledger(&context, other)) {
            local::find_blocks(one, other, stepper.macro_s(), scratch);
            partner_mut(model, partners, other.id).read = ledgers.read_of(other.id).unwrap_or(SimTime::ZERO);
            partners += 1;
        }
        model.partners.truncate(partners);
        scratch.blocks.sort_unstable();
        scratch.blocks.dedup();
        if scratch.blocks.is_empty() {
            model.partners.clear();
            return;
        }
        let Scratch { blocks, goes_on, columns, .. } = scratch;
        reset(goes_on, blocks.len(), DVec3::ZERO);
        for partner in &mut model.partners {
            reset(&mut partner.forces, blocks.len(), DVec3::ZERO);
            let add = |site: Site, force: Impulse, list: &mut [DVec3]| {
                one.member.visit_sides(anchor_of(site), force, |side, force| {
                    for term in side.terms() {
                        if let Ok(at) = blocks.binary_search(&term.block) {
                            list[at] += term.map.transpose() * force;
                        }
                    }
                });
            };
            ledgers.forces(partner.id, |site, force| add(site, force, &mut partner.forces));
            goes_on.iter_mut().zip(&partner.forces).for_each(|(all, force)| *all += *force);
        }
        for (at, all) in goes_on.iter_mut().enumerate() {
            let Some(weight) = weight.get(blocks[at]) else { continue };
            // the persistent force is shared as the whole was given
            let (lasts, whole) = (persistent(*all, *weight), all.dot(*weight));
            for partner in &mut model.partners {
                let share = if whole > 0.0 { partner.forces[at].dot(*weight) / whole } else { 0.0 };
                partner.forces[at] = lasts * share;
            }
            *all = lasts;
        }
        let query = LocalQuery { place, blocks, persistent: goes_on };
        stepper.local_model(all, &query, columns, model);
    }

    /// Completes a state that its agent has written.
    pub fn write(&self, into: &mut Snapshot) {
        self.ledgers.write(into);
        into.local_model.copy_from(&self.model);
        into.pairs.extend_from_slice(&self.states);
    }

    /// Whether anything acts between it and a partner: then it must not rest, as a resting agent gives and takes nothing.
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.ledgers.has_taken() || self.states.iter().any(|state| state.force_n > 0.0 || state.in_flight_n_s > 0.0)
    }

    /// Whether it gave `other` something in the last step, as to a partner outside its cluster.
    #[must_use]
    pub fn meets(&self, other: AgentId) -> bool {
        self.states.iter().any(|state| state.with == other && state.contacts > 0)
    }
}

impl std::fmt::Debug for Pairs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pairs").field("states", &self.states).finish_non_exhaustive()
    }
}

/// The persistent part of a force on a free block: the block's weight where the force bears it, and no impact (docs/theory/coupling.md,
/// section 3). A force of half the weight bears it already: a body that hops a little is not let fall.
fn persistent(force: DVec3, weight: DVec3) -> DVec3 {
    let square = weight.length_squared();
    if square > 0.0 { weight * (force.dot(weight) / (BEARS_SHARE * square)).clamp(0.0, 1.0) } else { DVec3::ZERO }
}

/// The partner at a place of a model, in the storage that is there.
fn partner_mut(model: &mut LocalModel, at: usize, id: AgentId) -> &mut LocalPartner {
    if model.partners.len() == at {
        model.partners.push(LocalPartner { id, read: SimTime::ZERO, forces: Vec::new() });
    }
    let partner = &mut model.partners[at];
    partner.id = id;
    partner
}

/// The site of a body that a slot is about, with the impulse there.
fn site_of(body: &Body, slot: u32, impulse: DVec3) -> Option<(Site, Impulse)> {
    let (linear, angular) =
        (Impulse { linear: impulse, ..Impulse::ZERO }, Impulse { angular: impulse, ..Impulse::ZERO });
    match body {
        Body::Nothing => None,
        Body::Rigid(_) | Body::Tool(_) => Some((Site::Whole, if slot == 0 { linear } else { angular })),
        Body::Soft(_) => Some((Site::Vertex(slot), linear)),
        Body::Curve(curve) => {
            let at = slot as usize / 2;
            let here = *curve.arc_m.get(at)?;
            if slot.is_multiple_of(2) {
                return Some((Site::Arc(here), linear));
            }
            Some((Site::Arc(0.5 * (here + curve.arc_m.get(at + 1)?)), angular))
        }
    }
}
