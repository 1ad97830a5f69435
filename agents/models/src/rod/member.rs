//! A tube in a contact cluster: blocks for nodes and spins in turn, as in its own system.
//!
//! In: steps and velocities. Out: the matrix of linearly implicit Euler, velocities without contact, its skin. Never here: contacts.
//! Theory: docs/theory/rod.md, eq. 11–20; docs/theory/clusters.md, section 9.

mod attachments;

use super::banded_ldl::Row;
use super::energy_limiter;
use super::history::History;
use super::rest::RestDetector;
use super::spec::Integrator;
use super::state::RodState;
use super::step::{Divergence, Setting, Stepper, TURN_MAX_RAD};
use super::system::SubstepProblem;
use super::tube::Tube;
use super::wall::{Sections, Wall};
use attachments::unyielding;
use glam::{DMat3, DVec2, DVec3};
use metachron_contact::member::{
    Attachments, ClusterMember, MemberMotion, OwnAttachment, OwnFailure, Role, SkinPoint, Slid, StepEnd, StepSystem,
};
use metachron_contact::solve::{Block, Response, SIDE_TERMS_MAX, Side, SideTerm};
use metachron_contact::{Agent, StepContext};
use metachron_core::{Archive, ArchiveError, SimSpan, SimTime, StepError, archive_values};
use metachron_geometry::narrow_phase::RestShape;
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapePose};

/// Its unknowns in a cluster: one for each slot.
#[derive(Debug, Clone, Default)]
pub(super) struct Unknowns {
    blocks: Vec<Block>,
    free: Vec<DVec3>,
    /// Present velocities of all slots, those of a wall that gives included; empty without one.
    present: Vec<DVec3>,
    /// Positions of its nodes where its skin is now, and the radius there, metres.
    places: Vec<DVec3>,
    radii_m: Vec<f64>,
    /// Whether its free motion in the step begun is good in one piece: there is a factor, and its energy does not rise.
    is_whole: bool,
    /// Substeps that its own integrator made in the step before: the cluster counts their work with this one's.
    own_substeps: u32,
    was_at_rest: bool,
    /// The forces of its attachments that may tear in the last step.
    attached: Vec<OwnAttachment>,
    saved: SavedState,
}

/// A state to go back to.
#[derive(Debug, Clone, Default)]
struct SavedState {
    now: RodState,
    wall: Sections,
    past: History,
    /// Slips of its springs.
    slid: Vec<Slid>,
    rest: RestDetector,
    time: SimTime,
    was_at_rest: bool,
    acceleration: DVec3,
    at_rest: bool,
    own_substeps: u32,
}

/// Velocities differ by less than this through rounding alone, as a share of them and of 1 m/s or rad/s.
const ROUNDING: f64 = 1e-9;
/// The most by which a section may change in a step, as a share of its radius: its forces are linear in it.
const WALL_REACH: f64 = 0.05;
/// The strain of a step in which its free motion raises its energy: it is made in two.
const RISES: f64 = 2.0;

impl Tube {
    /// Whether the node at this slot is held in place.
    fn is_held(&self, slot: usize) -> bool {
        (slot == 0 && self.material.held[0]) || (slot + 1 == self.now.u.len() && self.material.held[1])
    }

    /// The side of a point a share along a segment, `radius` from the centre line (a vector, metres).
    fn point_side(&self, segment: usize, share: f64, radius: DVec3) -> Side {
        let mut terms = [SideTerm::weighted(0, 0.0); 3];
        let mut count = 0;
        for (slot, weight) in [(2 * segment, 1.0 - share), (2 * segment + 2, share)] {
            if weight != 0.0 && !self.is_held(slot) {
                terms[count] = SideTerm::weighted(slot, weight);
                count += 1;
            }
        }
        if radius != DVec3::ZERO {
            terms[count] = SideTerm::spin(2 * segment + 1, radius);
            count += 1;
        }
        Side::new(0, &terms[..count]).unwrap_or(Side::FIXED)
    }
}

impl ClusterMember for Tube {
    fn role(&self) -> Role {
        Role::Deformable
    }

    fn look(&mut self, context: &StepContext<'_>, _dt_s: f64) {
        self.time = context.time;
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        let solved = self.step_by(h_s, |stepper, now, setting| {
            let problem = whole_step(setting, h_s);
            stepper.take_sections(now);
            if stepper.solve(now, &problem, true).is_err() {
                // far out the whole system has no factor: that of masses alone stands for it
                stepper.assemble_light(now, &problem, false);
                return stepper.factor_and_solve().map(|()| false);
            }
            stepper.advance(now, &problem, true);
            if stepper.energy_rise(now, &problem) <= 0.0 {
                return Ok(true);
            }
            let rise_j = stepper.follow(now, &problem);
            // the cluster's problem is about the state that the step starts from
            stepper.solve(now, &problem, true)?;
            Ok(rise_j <= 0.0)
        });
        self.unknowns.is_whole = solved.map_err(|divergence| self.diverged(divergence, h_s))?;
        let then = self.time + SimSpan::from_secs_f64(h_s).unwrap_or(SimSpan::ZERO);
        self.follow_pressure(then);
        self.begin_wall(h_s, then).map_err(|divergence| self.diverged(divergence, h_s))?;
        let mut unknowns = std::mem::take(&mut self.unknowns);
        unknowns.take(&self.stepper.rows, &self.stepper.rhs, &self.now.x);
        unknowns.radii_m.clear();
        match &self.wall {
            Some(wall) => {
                unknowns.take_wall(wall);
                unknowns.radii_m.extend((0..wall.now.shape.len()).map(|node| wall.reach_m(node)));
            }
            None => {
                let radius_m = |&arc_m: &f64| self.radius_at_time_m(arc_m, then);
                unknowns.radii_m.extend(self.division.arc_m.iter().map(radius_m));
            }
        }
        self.unknowns = unknowns;
        self.present_velocities();
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        let Unknowns { blocks, free, present, .. } = &self.unknowns;
        let (response, velocities): (&dyn Response, &[DVec3]) =
            if self.wall.is_some() { (self, present) } else { (self.stepper.factor(), &self.now.u) };
        StepSystem { blocks, response: Some(response), free, unanswered: &[], velocities }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let Unknowns { places, radii_m, .. } = &self.unknowns;
        (!places.is_empty())
            .then(|| PlacedShape { form: &self.form, view: ShapePose::Chain { positions: places, radii_m } })
    }

    fn skin_point(&self, place: &Place, contact: ContactSide) -> SkinPoint {
        match *place {
            Place::Chain { segment, share, radius_m } => {
                let (node, outward) = (segment as usize, contact.outward);
                let Some(wall) = &self.wall else { return self.point_side(node, share, outward * radius_m).into() };
                let at = |node: usize| wall.radius_m(node, self.across(node, outward));
                let recess_m = radius_m - (at(node) * (1.0 - share) + at(node + 1) * share);
                let side = self.point_side(node, share, outward * (radius_m - recess_m));
                SkinPoint { recess_m, ..self.skin_side(side, [node, node + 1], share, outward).into() }
            }
            Place::Point(_) | Place::Surface { .. } => Side::FIXED.into(),
        }
    }

    fn strain(&self, v: &[DVec3], h_s: f64) -> f64 {
        let divides_itself = self.has_own_substeps() && self.substep_is_short(h_s) && self.unknowns.are_free(v);
        let (v, rates) = v.split_at(self.now.u.len());
        let reaches_m = self.wall.as_ref().map_or(f64::INFINITY, |wall| WALL_REACH * wall.law.outer_m);
        let fastest_m_s = rates.iter().map(|rate| rate.length_squared()).fold(0.0, f64::max).sqrt();
        let spins = v.iter().skip(1).step_by(2).map(|w| w.length_squared()).fold(0.0, f64::max).sqrt();
        let ends = v.iter().step_by(2).zip(v.iter().skip(2).step_by(2));
        let pulls = ends.zip(&self.division.length).map(|((a, b), length_m)| a.distance_squared(*b) / length_m.powi(2));
        // the turn or stretch of a segment, as a share of it
        let bent = spins.max(pulls.fold(0.0, f64::max).sqrt()) * h_s / TURN_MAX_RAD;
        let widened = fastest_m_s * h_s / reaches_m;
        if divides_itself {
            return widened;
        }
        let changes = bent.max(widened);
        if self.unknowns.is_whole { changes } else { changes.max(RISES) }
    }

    fn keep(&mut self) {
        let Self { now, wall, rest, time, acceleration, at_rest, unknowns, stepper, springs, .. } = self;
        let saved = &mut unknowns.saved;
        saved.slid.clear();
        saved.slid.extend(springs.iter().map(|spring| spring.slid));
        saved.now.copy_from(now);
        wall.iter().for_each(|wall| saved.wall.copy_from(&wall.now));
        saved.past.copy_from(&stepper.past);
        saved.rest.copy_from(rest);
        (saved.time, saved.at_rest, saved.was_at_rest) = (*time, *at_rest, unknowns.was_at_rest);
        saved.acceleration = *acceleration;
        saved.own_substeps = unknowns.own_substeps;
    }

    fn go_back(&mut self) {
        let Self { now, wall, rest, time, acceleration, at_rest, unknowns, material, division, stepper, .. } = self;
        let saved = &unknowns.saved;
        self.springs.iter_mut().zip(&saved.slid).for_each(|(spring, slid)| spring.slid = *slid);
        now.copy_from(&saved.now);
        wall.iter_mut().for_each(|wall| wall.now.copy_from(&saved.wall));
        stepper.past.copy_from(&saved.past);
        // a copy has no forces
        now.strain(material, division);
        rest.copy_from(&saved.rest);
        (*time, *at_rest, unknowns.was_at_rest) = (saved.time, saved.at_rest, saved.was_at_rest);
        *acceleration = saved.acceleration;
        unknowns.own_substeps = saved.own_substeps;
        self.follow_pressure(self.time);
        self.present_velocities();
    }

    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        let Self { unknowns, now, .. } = self;
        for ((place, x), v) in unknowns.places.iter_mut().zip(&now.x).zip(v.iter().step_by(2)) {
            *place = *x + *v * t_s;
        }
    }

    fn end(&mut self, &StepEnd { v, h_s, touched, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        let before = self.momentum().0;
        let integrates_freely = self.integrates_free_motion(h_s);
        let unknowns = std::mem::take(&mut self.unknowns);
        let (is_free, mut own_substeps) = (unknowns.are_free(v), 0);
        let (of_rod, of_wall) = v.split_at(self.now.u.len());
        let finite = self.wall_stays_finite(of_wall, h_s)
            && if is_free && !touched && integrates_freely {
                let taken = self.step_by(h_s, Stepper::step);
                own_substeps = *taken.as_ref().unwrap_or(&0);
                taken.is_ok()
            } else {
                self.advance_with([of_rod, &unknowns.free], h_s, is_free)
            };
        self.unknowns = unknowns;
        self.unknowns.own_substeps = own_substeps;
        if !finite {
            return Err(self.diverged(Divergence { slot: None }, h_s));
        }
        self.end_wall(of_wall, h_s);
        self.unknowns.places.clone_from(&self.now.x);
        self.note_attachments();
        self.acceleration = (self.momentum().0 - before) / (self.mass_kg() * h_s);
        self.time += SimSpan::from_secs_f64(h_s).unwrap_or(SimSpan::ZERO);
        self.unknowns.was_at_rest = self.observe_rest(h_s);
        self.at_rest = false;
        self.present_velocities();
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        self.unknowns.was_at_rest
    }

    fn sleep(&mut self) {
        self.at_rest = true;
        self.acceleration = DVec3::ZERO;
        self.stop();
        self.present_velocities();
    }

    fn work(&self) -> f64 {
        (self.division.segments() as f64) * f64::from(1 + self.unknowns.own_substeps)
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }

    fn give_way(&mut self, failure: OwnFailure) {
        match failure {
            OwnFailure::Slips(place, by) => {
                let first = unyielding(&self.springs).len();
                self.springs.iter_mut().skip(first).nth(place).into_iter().for_each(|spring| spring.slid += by);
            }
            OwnFailure::Tears(number) if !self.let_go.contains(&number) => {
                self.let_go.push(number);
                self.lay_out_springs();
                self.rest.wake();
            }
            OwnFailure::Tears(_) => {}
        }
    }
}

impl MemberMotion for Tube {
    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        let PlacedShape { form, view: ShapePose::Chain { positions, radii_m } } = self.skin()? else { return None };
        nodes.clear();
        nodes.extend(positions.iter().zip(v.iter().step_by(2)).map(|(at, v)| *at + *v * t_s));
        Some(PlacedShape { form, view: ShapePose::Chain { positions: nodes, radii_m } })
    }

    fn rest_shape(&self) -> Option<RestShape<'_>> {
        self.spec.self_contact.then_some(RestShape::Chain(&self.division.arc_m))
    }

    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        let (v, wall) = v.split_at(self.now.u.len());
        let nodes = v.iter().step_by(2).map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
        let spins = v.iter().skip(1).step_by(2).map(|w| w.length_squared()).fold(0.0, f64::max).sqrt();
        let rates = wall.iter().map(|rate| rate.length_squared()).fold(0.0, f64::max).sqrt();
        nodes + spins * self.widest_m() + 2.0 * rates
    }
}

impl Tube {
    /// The direction `outward` in the axes of the section at a node, across the tube.
    fn across(&self, node: usize, outward: DVec3) -> DVec2 {
        let axes = self.now.q[node.saturating_sub(1)];
        (axes.conjugate() * outward).truncate().normalize_or_zero()
    }

    /// Adds the motion of the skin where the sections of two nodes widen and flatten: in and out, and along itself, for it does not stretch
    /// as it flattens (eq. 67).
    fn skin_side(&self, side: Side, nodes: [usize; 2], share: f64, outward: DVec3) -> Side {
        let mut terms = [SideTerm::weighted(0, 0.0); SIDE_TERMS_MAX];
        let mut count = side.terms().len();
        terms[..count].copy_from_slice(side.terms());
        for (node, weight) in nodes.into_iter().zip([1.0 - share, share]) {
            if weight != 0.0 {
                let axes = self.now.q[node.saturating_sub(1)];
                let e = self.across(node, outward);
                let (out, along) = (axes * e.extend(0.0) * weight, axes * e.perp().extend(0.0) * weight);
                let (cos, sin) = (e.x * e.x - e.y * e.y, 2.0 * e.x * e.y);
                let map = DMat3::from_cols(out, out * cos - along * (0.5 * sin), out * sin + along * (0.5 * cos));
                terms[count] = SideTerm { block: self.now.u.len() + node, map };
                count += 1;
            }
        }
        Side::new(0, &terms[..count]).unwrap_or(side)
    }

    /// Gathers the velocities of all slots, of a tube with a wall that gives.
    pub(super) fn present_velocities(&mut self) {
        let Some(wall) = &self.wall else { return };
        let present = &mut self.unknowns.present;
        present.clear();
        present.extend(self.now.u.iter().chain(&wall.now.rate));
    }

    /// Whether its free motion is in substeps of its own from the start, and not one step of implicit Euler.
    fn has_own_substeps(&self) -> bool {
        self.spec.integrator != Integrator::ImplicitEuler || self.spec.substeps > 1
    }

    /// Whether its own integrator makes a step of `h_s` seconds in which nothing acts on it, in as many substeps as that takes. In contact all of
    /// them are implicit Euler in one piece.
    fn integrates_free_motion(&self, h_s: f64) -> bool {
        (self.has_own_substeps() || !self.unknowns.is_whole) && self.substep_is_short(h_s)
    }

    /// Ends the step begun with the velocities `v`, which are the free ones where it `is_free`; whether its state is finite then.
    fn advance_with(&mut self, velocities: [&[DVec3]; 2], h_s: f64, is_free: bool) -> bool {
        self.step_by(h_s, |stepper, now, setting| {
            let problem = whole_step(setting, h_s);
            let rise_j = stepper.follow_cluster(now, &problem, velocities, is_free);
            if rise_j > 0.0 {
                energy_limiter::remove(rise_j, &mut stepper.next, setting.material, setting.division);
            }
            // the next step has no two steps of one kind before it
            stepper.past.forget();
            let finite = stepper.next.is_finite();
            if finite {
                std::mem::swap(now, &mut stepper.next);
            }
            finite
        })
    }
}

/// A step of `h_s` seconds in one piece. Springs on the tube, and its own springs that yield, are rows of the cluster's problem.
fn whole_step<'a>(setting: &Setting<'a>, h_s: f64) -> SubstepProblem<'a> {
    let Setting { material, division, integrator, .. } = *setting;
    let springs = unyielding(setting.springs);
    SubstepProblem { material, division, springs, h: h_s, integrator }
}

/// Nothing joins the centre line to a wall that gives within a step (eq. 66).
impl Response for Tube {
    fn respond(&self, impulses: &mut [DVec3]) {
        let (rod, rates) = impulses.split_at_mut(self.now.u.len());
        self.stepper.factor().solve(rod);
        self.wall.iter().for_each(|wall| wall.factor().solve(rates));
    }
}

impl Unknowns {
    /// Whether `v` are its velocities without contact, but for the rounding of those that are gained in parts.
    fn are_free(&self, v: &[DVec3]) -> bool {
        v.iter().zip(&self.free).all(|(v, free)| v.distance(*free) <= ROUNDING * (1.0 + free.length()))
    }

    /// Writes or reads the state that is known between steps.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.places, self.radii_m, self.present, self.was_at_rest, self.own_substeps)
    }

    /// Adds the system of a wall that gives, with its solution.
    fn take_wall(&mut self, wall: &Wall) {
        let first = self.free.len();
        let block = |(row, column, value): (usize, usize, DVec3)| Block {
            row: first + row,
            column: first + column,
            value: DMat3::from_diagonal(value),
        };
        self.blocks.extend(wall.entries().map(block));
        self.free.extend_from_slice(wall.free());
    }

    /// Takes over a system with its solution, and the places of the nodes.
    fn take(&mut self, rows: &[Row], free: &[DVec3], places: &[DVec3]) {
        self.blocks.clear();
        for (row, numbers) in rows.iter().enumerate() {
            let Row { diag, near, far } = *numbers;
            let mut add = |back: usize, value: DMat3| {
                if back <= row && value != DMat3::ZERO {
                    self.blocks.push(Block { row, column: row - back, value });
                }
            };
            add(0, diag.full());
            add(1, near);
            add(2, far.full());
        }
        self.free.clear();
        self.free.extend_from_slice(free);
        self.places.clear();
        self.places.extend_from_slice(places);
    }
}
