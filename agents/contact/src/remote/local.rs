//! The local model of a participant at the end of a macro step, for partners that compute their pairs with it: which of its blocks they may move, its
//! compliance there, and the matrix of the member that stands for it: the inverse of that.
//!
//! In: the last solve, partners' published states, their forces. Out: blocks, velocities, accelerations and W; A = W⁻¹ as a dense
//! square. Never here: ledgers. Theory: docs/theory/coupling.md, section 3 (eq. 7m).

use crate::lists::reset;
use crate::member::problem::respond;
use crate::member::{GuardedMember, Participant, Role};
use crate::remote::published_shape::PublishedShape;
use crate::solve::Side;
use crate::step::ClusterStepper;
use crate::{Law, Neighbour};
use glam::DVec3;
use metachron_core::{LocalBlock, LocalModel};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{CollisionShape, ContactSide, ShapeKind, Touch};

/// The most places of a pair whose blocks are published: W is dense.
const PLACES_MAX: usize = 12;
/// Places are looked for this far ahead, in steps of the body that publishes.
const STEPS_AHEAD: f64 = 2.0;
/// And at least so far, metres.
const NEAR_M: f64 = 2e-3;
/// The share of its largest compliance that every direction has at least: a direction held by contacts does not make
/// its matrix singular.
const YIELD_SHARE: f64 = 1e-9;

/// Reusable storage.
#[derive(Default)]
pub(crate) struct Scratch {
    pub(crate) blocks: Vec<usize>,
    pub(crate) goes_on: Vec<DVec3>,
    pub(crate) carried: Vec<DVec3>,
    pub(crate) shape: PublishedShape,
    pub(crate) narrow: NarrowPhaseScratch,
    pub(crate) touches: Vec<Touch>,
    /// Of local models.
    pub(crate) columns: [Vec<DVec3>; 2],
}

/// Blocks of a participant, with the forces of its partners on them.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalQuery<'a> {
    /// The participant.
    pub place: usize,
    /// Its blocks.
    pub blocks: &'a [usize],
    /// The persistent forces of all partners on each block, N or N·m.
    pub persistent: &'a [DVec3],
}

impl ClusterStepper {
    /// The forces that would have held the blocks of a participant still in its last step, N or N·m; none where contacts or rows touched it.
    pub(super) fn weight(&self, all: &[Participant<'_>], place: usize, into: &mut Vec<DVec3>) {
        into.clear();
        let state = &self.progress[place];
        if state.held {
            return;
        }
        into.resize(state.dv_free.len(), DVec3::ZERO);
        let own_s = self.fine_s * f64::from(state.share);
        let free = |block: usize| {
            (state.dv_free[block] - state.dv_known.get(block).copied().unwrap_or(DVec3::ZERO)) * (-1.0 / own_s)
        };
        for block in all[place].member.system().blocks.iter().filter(|block| block.row < state.dv_free.len()) {
            into[block.row] += block.value * free(block.column);
            if block.row != block.column {
                into[block.column] += block.value.transpose() * free(block.row);
            }
        }
    }

    /// Fills blocks, compliance and step of a local model from the macro step that was made last.
    pub(super) fn local_model(
        &mut self,
        all: &[Participant<'_>],
        query: &LocalQuery<'_>,
        storage: &mut [Vec<DVec3>; 2],
        into: &mut LocalModel,
    ) {
        let LocalQuery { place, blocks, .. } = *query;
        let member = &all[place].member;
        let (share, held) = (f64::from(self.progress[place].share), self.progress[place].held);
        (into.step_s, into.held) = (self.macro_s, held);
        let in_problem = self.progress[place].place.filter(|_| held);
        if in_problem.is_some_and(|place| self.solver.held_compliance(place, blocks, &mut into.compliance)) {
            into.compliance.iter_mut().for_each(|w| *w *= share.recip());
        } else {
            own_compliance(member, blocks, storage, into);
        }
        let state = &self.progress[place];
        let own_s = self.fine_s * share;
        into.blocks.clear();
        for (at, &block) in blocks.iter().enumerate() {
            let pushed = state.dv_known.get(block).copied().unwrap_or(DVec3::ZERO);
            let free = (state.dv_free[block] - pushed) / own_s;
            let row = &into.compliance[at * blocks.len()..(at + 1) * blocks.len()];
            let pushed: DVec3 = row.iter().zip(query.persistent).map(|(w, force)| *w * *force).sum();
            // a held body goes on as it does: its contacts take up any change by forces
            let acceleration = if held { DVec3::ZERO } else { free + pushed };
            into.blocks.push(LocalBlock { slot: member.slot_of(block), velocity: state.v_before[block], acceleration });
        }
    }
}

/// W of a participant that nothing touched.
fn own_compliance(member: &GuardedMember<'_>, blocks: &[usize], storage: &mut [Vec<DVec3>; 2], into: &mut LocalModel) {
    let [x, residual] = storage;
    reset(&mut into.compliance, blocks.len() * blocks.len(), glam::DMat3::ZERO);
    for (column, &pushed) in blocks.iter().enumerate() {
        for axis in 0..3 {
            reset(x, member.system().free.len(), DVec3::ZERO);
            x[pushed] = DVec3::AXES[axis];
            respond(member, x, residual);
            for (row, &block) in blocks.iter().enumerate() {
                *into.compliance[row * blocks.len() + column].col_mut(axis) = x[block];
            }
        }
    }
}

/// Adds the blocks of `one` that `other` may move within the next steps of `step_s` seconds.
pub(crate) fn find_blocks(one: &Participant<'_>, other: &Neighbour, step_s: f64, scratch: &mut Scratch) {
    let Scratch { blocks, shape, narrow, touches: found, .. } = scratch;
    if one.member.role() != Role::Deformable {
        blocks.extend(0..one.member.system().free.len());
        return;
    }
    let mut add = |side: Side| blocks.extend(side.terms().iter().map(|term| term.block));
    for link in one.context.links.iter().filter(|link| link.other == other.id && link.law == Law::Ledger) {
        one.member.anchor(link.here).into_iter().for_each(|point| add(point.side));
    }
    let (Some(skin), Some(form), Law::Ledger) = (one.member.skin(), other.form.as_deref(), other.law) else { return };
    let since_s = one.context.time.secs_after(other.snapshot.time) + step_s;
    if !shape.bring(&other.snapshot.body, since_s) {
        return;
    }
    let Some(theirs) = shape.placed(form) else { return };
    let their_m_s = other.snapshot.bounds.map_or(0.0, |bounds| bounds.speed_m_s);
    let speed_m_s = one.member.speed_bound(one.member.system().velocities) + their_m_s;
    let reach_m = NEAR_M + edge_m(skin.form) + STEPS_AHEAD * step_s * speed_m_s;
    if !skin.bounds().grown(reach_m).meets(theirs.bounds()) {
        return;
    }
    touches(&skin, &theirs, reach_m, narrow, found);
    found.sort_unstable_by(|a, b| a.gap_m.total_cmp(&b.gap_m).then(a.key.cmp(&b.key)));
    for touch in found.iter().take(PLACES_MAX) {
        add(one.member.skin_point(&touch.on_a, ContactSide::first(touch.normal)).side);
    }
}

/// How far the places of a skin are from each other, metres.
fn edge_m(form: &CollisionShape) -> f64 {
    if let ShapeKind::Surface(surface) = &form.kind { surface.edge_m } else { 0.0 }
}

/// The inverse of a model's compliance into `out`, row by row; `false` where it is not positive definite.
pub(crate) fn invert(model: &LocalModel, out: &mut Vec<f64>) -> bool {
    let (blocks, size) = (model.blocks.len(), 3 * model.blocks.len());
    if blocks == 0 || model.compliance.len() != blocks * blocks {
        return false;
    }
    // the lower half of the symmetric part, twice: the second becomes the inverse
    reset(out, 2 * size * size, 0.0);
    let entry = |i: usize, j: usize| model.compliance[(i / 3) * blocks + j / 3].col(j % 3)[i % 3];
    // blocks of points and of spins have units of their own
    for i in 0..size {
        let largest = (0..size).filter(|j| same_kind(model, i, *j)).map(|j| entry(j, j)).fold(0.0, f64::max);
        for j in 0..=i {
            out[i * size + j] = 0.5 * (entry(i, j) + entry(j, i));
        }
        out[i * size + i] += YIELD_SHARE * largest;
    }
    factor_and_invert(out, size)
}

fn same_kind(model: &LocalModel, i: usize, j: usize) -> bool {
    let kind = |at: usize| model.blocks[at / 3].slot == 1 && model.blocks.len() == 2;
    kind(i) == kind(j)
}

/// Cholesky's factor of the lower half in the first square of `out`, then the whole inverse in its place.
fn factor_and_invert(out: &mut [f64], size: usize) -> bool {
    let (l, inverse) = out.split_at_mut(size * size);
    for i in 0..size {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * size + k] * l[j * size + k]).sum();
            let rest = l[i * size + j] - dot;
            if i == j {
                if !(rest > 0.0 && rest.is_finite()) {
                    return false;
                }
                l[i * size + i] = rest.sqrt();
            } else {
                l[i * size + j] = rest / l[j * size + j];
            }
        }
    }
    for column in 0..size {
        for i in 0..size {
            let dot: f64 = (0..i).map(|k| l[i * size + k] * inverse[k * size + column]).sum();
            inverse[i * size + column] = (f64::from(u8::from(i == column)) - dot) / l[i * size + i];
        }
        for i in (0..size).rev() {
            let dot: f64 = (i + 1..size).map(|k| l[k * size + i] * inverse[k * size + column]).sum();
            inverse[i * size + column] = (inverse[i * size + column] - dot) / l[i * size + i];
        }
    }
    l.copy_from_slice(inverse);
    true
}
