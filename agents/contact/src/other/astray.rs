//! How far another agent is from where it was expected, for friction to take back.
//!
//! In: where it was expected when a step ended, and where it is when the next begins. Out: what is owed, in slots.
//! Never here: contacts. Theory: docs/theory/soft.md, eq. 16g.

use super::Other;
use glam::{DQuat, DVec3};
use metachron_core::SimTime;

/// Steps follow each other to the nanosecond: farther apart time was given up between them, seconds.
const NEXT_S: f64 = 1e-6;

/// How far another is from where friction holds it.
#[derive(Debug, Clone, Default)]
pub struct Astray {
    points: Vec<DVec3>,
    turns: Vec<DQuat>,
    at: Option<SimTime>,
    /// How far each slot has come from where friction holds it, metres and radians.
    owed: Vec<DVec3>,
}

impl Astray {
    /// Notes where another is expected at `at`.
    pub fn expect(&mut self, other: &Other, at: SimTime) {
        self.at = Some(at);
        self.points.clear();
        self.turns.clear();
        if other.is_many() {
            self.points.extend_from_slice(&other.positions);
            self.turns.extend_from_slice(&other.frames);
        } else {
            self.points.push(other.pose.centre);
            self.turns.push(other.pose.rotation);
        }
    }

    /// Adds how far it turned out to be from there.
    pub fn learn(&mut self, other: &Other, now: SimTime) {
        let slots = other.velocities.len();
        if self.owed.len() != slots {
            self.owed.clear();
            self.owed.resize(slots, DVec3::ZERO);
        }
        let same = self.at.take().is_some_and(|at| at.secs_after(now).abs() < NEXT_S);
        let (stride, many) = (other.stride(), other.is_many());
        let count = if many { other.positions.len() } else { 1 };
        let turns = if many { other.frames.len() } else { 1 };
        if !same || self.points.len() != count || self.turns.len() != turns || other.is_held() {
            return;
        }
        for (k, was) in self.points.iter().enumerate() {
            self.owed[k * stride] += if many { other.positions[k] } else { other.pose.centre } - *was;
        }
        for (k, was) in self.turns.iter().enumerate() {
            let now = if many { other.frames[k] } else { other.pose.rotation };
            self.owed[k * stride + 1] += shortest(now * was.inverse());
        }
    }

    /// What is owed in slots.
    pub fn owed(&self) -> &[DVec3] {
        &self.owed
    }

    /// Takes `share` of it.
    pub fn pay(&mut self, share: f64) {
        self.owed.iter_mut().for_each(|owed| *owed *= 1.0 - share);
    }

    /// Forgets it all.
    pub fn forget(&mut self) {
        self.owed.clear();
        self.at = None;
    }
}

/// The shortest small rotation vector of a unit quaternion.
fn shortest(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    DVec3::new(q.x, q.y, q.z) * 2.0
}
