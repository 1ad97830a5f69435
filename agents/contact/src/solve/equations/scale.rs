//! The scale of each row: the size of its own block of W.
//!
//! In: members and rows. Out: a scale of each row, in the row. Never here: how equations are solved.
//! Theory: `docs/theory/clusters.md`, eq. 6.

use super::gradients::Task;
use super::members::Members;
use super::rows::{Rows, Term};
use super::system::System;
use crate::lists::reset;
use crate::solve::statement::problem::Member;
use glam::{DMat3, DVec3};
use std::ops::Range;

/// Contacts of a member whose exact compliance is compared with the estimate of its diagonal.
const SAMPLES: usize = 4;
/// The directions, in the frames of rows, along which they are. A sum over these is one over axes, as terms that join
/// two axes have both signs; and their own sum is as long as they are together, so that a motion of a whole member
/// counts as if each were alone.
const DIRECTIONS: [DVec3; SAMPLES] =
    [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0)];
/// Up to so many blocks there is a solve for each sample; of more, one for all: they are far apart then, and each solve is dear.
const APART_MAX: usize = 500;

/// The most that an iterative solve may leave of a sample's impulses, in shares of them, and that by the velocity that responses may leave,
/// s/m: a scale is off by about the square.
const SAMPLE_SHARE: f64 = 0.1;
const SAMPLE_FINER: f64 = 2e6;

/// Storage for the samples.
#[derive(Debug, Clone, Default)]
pub(super) struct Scales {
    samples: Vec<Sample>,
    right: Vec<DVec3>,
    x: Vec<DVec3>,
    left: Vec<DVec3>,
}

/// The rows of one member at which it is sampled, and the results.
#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    /// Rows that touch the member.
    count: usize,
    /// Rows seen so far, and the last of them.
    seen: usize,
    last: Option<usize>,
    chosen: [Option<usize>; SAMPLES],
    exact: f64,
    estimate: f64,
}

impl Scales {
    /// The estimate of the members' diagonals, put right by some exact ones.
    pub fn set(&mut self, system: &mut System, members: &[Member<'_>], rows: &mut Rows) {
        reset(&mut self.samples, system.members.rigid.len(), Sample::default());
        if system.members.blocks.iter().any(|block| block.row != block.column) {
            self.choose(&system.members, rows);
            let at_once = if system.members.size() > APART_MAX { SAMPLES } else { 1 };
            for from in (0..SAMPLES).step_by(at_once) {
                self.sample(system, members, rows, from..from + at_once);
            }
        }
        let members = &system.members;
        for row in 0..rows.len() {
            let terms = rows.terms(row).iter();
            let trace: f64 =
                terms.map(|t| self.samples[members.owners[t.block]].ratio() * estimate(members, &t.map, t.block)).sum();
            rows.set_scale(row, trace);
        }
    }

    /// How easily each side of a row gives way along the first axis of its frame, 1/kg: that of the member `first`, and all others.
    pub fn along_normal(&self, members: &Members, terms: &[Term], first: Option<usize>) -> [f64; 2] {
        let mut found = [0.0; 2];
        for term in terms {
            let owner = members.owners[term.block];
            let given = term.map.mul_transpose_vec3(DVec3::X);
            let gives = self.samples[owner].ratio() * given.dot(members.mobilities[term.block] * given);
            found[usize::from(Some(owner) != first)] += gives;
        }
        found
    }

    /// Chooses rows of each member that lie evenly among all of its rows.
    fn choose(&mut self, members: &Members, rows: &Rows) {
        for row in 0..rows.len() {
            for term in rows.terms(row) {
                let sample = &mut self.samples[members.owners[term.block]];
                sample.count += usize::from(sample.last.replace(row) != Some(row));
            }
        }
        self.samples.iter_mut().for_each(|sample| sample.last = None);
        for row in 0..rows.len() {
            for term in rows.terms(row) {
                self.samples[members.owners[term.block]].meet(row);
            }
        }
    }

    /// Adds the mobility of every member at some of its rows, each along a direction of its own; all members and rows share a solution.
    fn sample(&mut self, system: &mut System, members: &[Member<'_>], rows: &Rows, which: Range<usize>) {
        let Self { samples, right, x, left } = self;
        for list in [&mut *right, &mut *x, &mut *left] {
            reset(list, system.members.size(), DVec3::ZERO);
        }
        for (member, at) in samples.iter_mut().enumerate() {
            for (direction, term) in at.terms(&which, member, &system.members, rows) {
                let given = term.map.mul_transpose_vec3(direction);
                right[term.block] += given;
                at.estimate += given.dot(system.members.mobilities[term.block] * given);
            }
        }
        let share = (SAMPLE_FINER * system.still_m_s).min(SAMPLE_SHARE);
        let goal = share * system.members.measure(right).root();
        system.respond(members, &mut Task { right, x, left, goal });
        for (member, at) in samples.iter_mut().enumerate() {
            for (direction, term) in at.terms(&which, member, &system.members, rows) {
                at.exact += direction.dot(term.map * x[term.block]);
            }
        }
    }
}

impl Sample {
    /// Counts a row, and keeps it where it is a wanted one.
    fn meet(&mut self, row: usize) {
        if self.last.replace(row) == Some(row) {
            return;
        }
        for (sample, chosen) in self.chosen.iter_mut().enumerate() {
            if sample * self.count / SAMPLES == self.seen {
                *chosen = Some(row);
            }
        }
        self.seen += 1;
    }

    /// The terms of some of its rows on the member, with the direction of each.
    fn terms<'a>(
        self,
        which: &Range<usize>,
        member: usize,
        members: &'a Members,
        rows: &'a Rows,
    ) -> impl Iterator<Item = (DVec3, &'a Term)> {
        let chosen = DIRECTIONS.into_iter().zip(self.chosen).skip(which.start).take(which.len());
        let terms =
            chosen.filter_map(|(direction, row)| Some(rows.terms(row?).iter().map(move |term| (direction, term))));
        terms.flatten().filter(move |(_, term)| members.owners[term.block] == member)
    }

    /// Exact over estimated mobility; 1 where nothing was sampled.
    fn ratio(&self) -> f64 {
        let ratio = self.exact / self.estimate;
        if ratio > 0.0 && ratio.is_finite() { ratio } else { 1.0 }
    }
}

/// The trace of M diag(A)⁻¹ Mᵀ.
fn estimate(members: &Members, map: &DMat3, block: usize) -> f64 {
    let product = *map * members.mobilities[block] * map.transpose();
    product.x_axis.x + product.y_axis.y + product.z_axis.z
}
