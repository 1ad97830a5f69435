//! Forces at arms of bodies that move as a whole: where they act within a step, and the inertia that such bodies lack for them.
//!
//! In: forces of springs and joints with the places where they act. Out: the same rows at arms that have turned; rows that resist changes of a
//! spin. Never here: forces themselves. Theory: docs/theory/clusters.md, eq. 22.
//!
//! A force f at an arm r turns a body back with the stiffness f·r, which no row knows. A light body that holds much swings by it faster
//! than steps can follow, and would be thrown. Such a body takes the force at the arm turned by half of the turn that the spin before the
//! step did not predict, at which swings of every frequency keep their energy. Each solve takes the turn of the last one; added inertia
//! about that turn lets them converge, and has no part in what they converge to.

use crate::constraint::{Arm, ConstraintRows, End, FineStep, ForceAtArms, GeometricStiffness, RowOwner};
use crate::lists::reset;
use crate::member::Participant;
use crate::member::participant::Progress;
use crate::solve::{Hold, JointRow, Side};
use glam::{DQuat, DVec3};

/// The share of the turn not predicted by which an arm is turned: below ¼ swings that steps do not resolve grow.
const TURN_SHARE: f64 = 0.5;
/// The least share of a body's inertia that is added, where its forces change within a step.
const LEAST_SHARE: f64 = 1e-9;
/// How much of a body's inertia the stiffness of its forces may reach before inertia is added: below it solves converge by a quarter or faster.
const BORNE_SHARE: f64 = 0.25;
/// The share of the turn of two bodies against each other by which arms are turned besides, where inertia is added: it damps swings
/// that steps do not resolve.
const DAMPING_SHARE: f64 = 0.05;
/// The key of the first row of added inertia of a tie.
const ADDED: u32 = 8;

/// A tie that pulls with a force.
#[derive(Clone, Copy)]
pub(crate) struct Tie<'a> {
    pub ends: &'a [End; 2],
    /// On the first end, N: the other has the opposite.
    pub force_n: DVec3,
    pub owner: RowOwner,
    /// Its rows in the problem, from the first to past the last.
    pub rows: [usize; 2],
    /// Whether it holds both ends at one place.
    pub is_point: bool,
}

impl GeometricStiffness {
    pub fn clear(&mut self) {
        self.pulls.clear();
    }

    /// Notes a tie, whose rows are laid out.
    pub fn note(&mut self, step: &FineStep<'_, '_>, tie: &Tie<'_>) {
        let all = step.all;
        let arm = |end: &End| {
            let member = end.member?;
            let pose = all[member].member.pose(&[], 0.0)?;
            let arm_m = end.point.position - pose.centre_m;
            let turns = pose.turns.of_member(member);
            let inverse_kg_m2 = inverse_inertia_across(all, &turns, arm_m)?;
            Some(Arm {
                point: end.side(),
                turns,
                arm_m,
                turned_m: arm_m,
                inverse_kg_m2,
                inertia_kg_m2: 0.0,
                added: None,
                is_pulled: false,
            })
        };
        let Tie { ends, force_n, owner, rows, is_point } = *tie;
        let mut pull = ForceAtArms { owner, rows, is_point, arms: [arm(&ends[0]), arm(&ends[1])] };
        pull.ask(force_n, step.h_s);
        self.pulls.push(pull);
    }

    /// Sums up how much inertia pulls ask for of each of `count` members.
    fn sum_up(&mut self, count: usize) {
        reset(&mut self.asked, count, 0.0);
        for arm in self.pulls.iter().flat_map(|pull| pull.arms.iter().flatten()) {
            self.asked[arm.turns.member] += arm.inertia_kg_m2 * arm.inverse_kg_m2;
        }
    }
}

impl ConstraintRows {
    /// Adds the inertia that bodies lack for the forces noted.
    pub fn add_inertia(&mut self, step: &FineStep<'_, '_>) {
        let mut forces = std::mem::take(&mut self.geometric_stiffness);
        forces.sum_up(step.all.len());
        for pull in &mut forces.pulls {
            for (side, arm) in pull.arms.iter_mut().enumerate() {
                let Some(arm) = arm else { continue };
                let member = arm.turns.member;
                if arm.inertia_kg_m2 == 0.0 || lacking(forces.asked[member]) == 0.0 {
                    continue;
                }
                let row = arm.added_inertia(forces.asked[member]);
                let row = JointRow { target_m_s: arm.turns.velocity(&step.progress[member].v_before), ..row };
                let owner = RowOwner { hold: None, key: ADDED + side as u32, other: Some(member), ..pull.owner };
                let at = self.rows.len();
                arm.added = self.push(step, row, owner).then_some(at);
            }
        }
        self.geometric_stiffness = forces;
    }

    /// Turns the arms of bodies that lack inertia as far as velocities `v` of members turn them, and lets what was added resist changes of
    /// these spins.
    pub fn turn_arms<'v>(&mut self, progress: &'v [Progress], v: impl Fn(usize) -> &'v [DVec3], h_s: f64) {
        let Self { rows, geometric_stiffness: forces, .. } = self;
        if forces.pulls.iter().flat_map(|pull| &pull.arms).all(|arm| arm.is_none_or(|arm| arm.added.is_none())) {
            return;
        }
        forces.pulls.iter_mut().for_each(|pull| pull.ask(pull.force_n(rows, h_s), h_s));
        forces.sum_up(progress.len());
        let before = |side: &Side| side.velocity(&progress[side.member].v_before);
        let then = |side: &Side| side.velocity(v(side.member));
        for pull in &mut forces.pulls {
            let turned_m = pull.turned_m([&before, &then], &forces.asked, h_s);
            for (side, (arm, turned_m)) in pull.arms.iter_mut().zip(turned_m).enumerate() {
                let Some(arm) = arm else { continue };
                for row in rows[pull.rows[0]..pull.rows[1]].iter_mut().filter(|row| arm.moves(&row.sides[side])) {
                    row.sides[side].lengthen(&arm.turns, turned_m - arm.turned_m);
                }
                arm.turned_m = turned_m;
                if let Some(added) = arm.added.map(|at| &mut rows[at]) {
                    let row = arm.added_inertia(forces.asked[arm.turns.member]);
                    *added = JointRow { target_m_s: then(&arm.turns), warm_n_s: added.warm_n_s, ..row };
                }
            }
        }
    }
}

impl ForceAtArms {
    /// The force on the first end by the impulses of its rows, N.
    fn force_n(&self, rows: &[JointRow], h_s: f64) -> DVec3 {
        let is_of_point = |row: &&JointRow| {
            let mut arms = self.arms.iter().zip(&row.sides);
            arms.any(|(arm, side)| arm.is_some_and(|arm| arm.moves(side)))
        };
        let of_point = rows[self.rows[0]..self.rows[1]].iter().filter(is_of_point);
        of_point.map(|row| row.warm_n_s).sum::<DVec3>() / h_s
    }

    /// Finds the inertia that a force on the first end asks for.
    fn ask(&mut self, force_n: DVec3, h_s: f64) {
        for (arm, force_n) in self.arms.iter_mut().zip([force_n, -force_n]) {
            let Some(arm) = arm else { continue };
            let along = force_n.dot(arm.arm_m);
            // the largest of its stiffnesses: a force that is not along its arm has three
            arm.inertia_kg_m2 = 0.5 * TURN_SHARE * h_s * h_s * (along + force_n.length() * arm.arm_m.length());
            arm.is_pulled = along > 0.0;
        }
    }

    /// The arms in the middle of the step with velocities of its sides before it and at its end (eq. 22).
    fn turned_m(&self, velocities: [&dyn Fn(&Side) -> DVec3; 2], asked: &[f64], h_s: f64) -> [DVec3; 2] {
        let [before, then] = velocities;
        let spins = self.arms.map(|arm| arm.map_or(DVec3::ZERO, |arm| then(&arm.turns)));
        let against = spins[0] - spins[1];
        let (mut turned_m, mut moved_m) = ([DVec3::ZERO; 2], [DVec3::ZERO; 2]);
        for (at, arm) in self.arms.iter().enumerate() {
            let Some(arm) = arm else { continue };
            let lacking = arm.added.map_or(0.0, |_| lacking(asked[arm.turns.member]));
            let damping = if arm.is_pulled { DAMPING_SHARE * lacking } else { 0.0 };
            let against = if at == 0 { against } else { -against };
            let unpredicted = (spins[at] - before(&arm.turns)) * (TURN_SHARE * lacking * h_s);
            let turn = unpredicted + against * (damping * h_s);
            turned_m[at] = DQuat::from_scaled_axis(turn) * arm.arm_m;
            // its point goes with its centre as well
            let of_point = (then(&arm.point) - before(&arm.point)) * (TURN_SHARE * lacking * h_s);
            moved_m[at] = of_point - unpredicted.cross(arm.arm_m) + turned_m[at] - arm.arm_m;
        }
        if self.is_point && self.arms.iter().all(Option::is_some) {
            // forces at one point keep the angular momentum
            let apart_m = moved_m[0] - moved_m[1];
            turned_m[0] -= apart_m * 0.5;
            turned_m[1] += apart_m * 0.5;
        }
        turned_m
    }
}

impl Arm {
    /// Whether a side is a point of its body and not a turn.
    fn moves(&self, side: &Side) -> bool {
        side.member == self.turns.member && side.terms().len() > self.turns.terms().len()
    }

    /// The row by which its body resists changes of its spin.
    fn added_inertia(&self, asked: f64) -> JointRow {
        let inertia_kg_m2 = (self.inertia_kg_m2 * lacking(asked)).max(LEAST_SHARE / self.inverse_kg_m2);
        let across = Hold::across(self.turned_m.normalize_or(DVec3::Z));
        JointRow { compliance_per_kg: Some(inertia_kg_m2.recip()), ..JointRow::new([self.turns, Side::FIXED], across) }
    }
}

/// The share of the inertia asked for that a body lacks.
fn lacking(asked: f64) -> f64 {
    (1.0 - BORNE_SHARE / asked).max(0.0)
}

/// The trace of the inverse inertia of a body across an arm, 1/(kg m²): a bound of it in every direction.
fn inverse_inertia_across(all: &[Participant<'_>], turns: &Side, arm_m: DVec3) -> Option<f64> {
    let axis = arm_m.try_normalize()?;
    let spin = turns.terms().first()?.block;
    let own =
        all[turns.member].member.system().blocks.iter().find(|block| block.row == spin && block.column == spin)?;
    let inverse = own.value.inverse();
    let trace = inverse.x_axis.x + inverse.y_axis.y + inverse.z_axis.z;
    Some(trace - axis.dot(inverse * axis))
}
