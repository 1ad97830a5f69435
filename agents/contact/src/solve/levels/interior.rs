//! Interior points: Mehrotra's predictor and corrector on Coulomb's cones and on all bounds of rows, by one factor a step.
//!
//! In: an iterate. Out: the same nearer to where all laws hold, its impulses inside the bounds of each law after every step.
//! Never here: when to stop, the last digits (`newton.rs`), cones themselves. Theory: `docs/theory/clusters.md`, eq. C1–C5.

use super::iterate::{Iterate, Kept};
use super::newton::Aim;
use crate::lists::refill;
use crate::solve::cones::lorentz::Lorentz;
use crate::solve::equations::bound::{Bound, Inside};

/// How far inside their cones impulses and dual points start, in means of the miss of laws and momentum, √J, so that
/// λ·y is the same for all rows and none moves another by more than its own share; and the least of it, m/s.
const INSIDE: f64 = 3.0;
const INSIDE_MIN_M_S: f64 = 1e-5;
/// The most of the way to the nearest edge that a step goes.
const REACH: f64 = 0.98;
/// A step that goes no further is stuck between edges.
const SHORT: f64 = 0.1;
/// From where it was stuck it begins again up to 2 to this power times as far inside, or as little: from another distance it seldom sticks.
const SPREAD: f64 = 3.0;
/// The fraction whose multiples lie evenly between 0 and 1, however many there are.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// The least share of the gap that a step aims at.
const CENTRING_MIN: f64 = 1e-6;
/// The share of its right side that a step may leave: by gradients, and where it follows slopes that no factor holds.
const LEAVE: f64 = 1e-3;

/// Storage of the way.
#[derive(Debug, Clone, Default)]
pub(crate) struct Interior {
    rows: Vec<Inside>,
    /// How often it was stuck, the best place of these, and the miss there, √J.
    stuck: u32,
    best: Kept,
    least: f64,
    /// Whether steps know how shifts follow slips.
    follows: bool,
}

/// The mean miss of all cones.
#[derive(Debug, Clone, Copy, Default)]
struct Gap {
    /// λ·y, J.
    mean_j: f64,
    /// By how much shifts have moved it since the last step, J.
    moved_j: f64,
}

impl Interior {
    /// Begins from where an iterate is.
    pub fn begin(&mut self, iterate: &mut Iterate) {
        (self.stuck, self.least) = (0, f64::INFINITY);
        iterate.keep(&mut self.best);
        refill(&mut self.rows, iterate.rows.rows.iter().map(Inside::of));
        self.enter(iterate);
    }

    /// Goes back to the best place at which it was stuck where that is better.
    pub fn finish(&mut self, iterate: &mut Iterate) {
        if self.stuck > 0 && self.least < iterate.missed() {
            iterate.go_back(&self.best);
        }
    }

    /// One step, from which the iterate is taken up; `false` where there is none.
    pub fn step(&mut self, iterate: &mut Iterate, aim: &Aim<'_>) -> bool {
        // where the slopes of shifts lead to an edge, shifts that are held for a step lead elsewhere
        self.follows = self.stuck.is_multiple_of(2);
        let gap = self.measure(iterate);
        self.rows.iter_mut().for_each(Inside::aim_at_the_edge);
        self.pull(iterate);
        let leave = |size: f64| LEAVE * size;
        if !iterate.factor(aim.threads) || !iterate.solve(aim.threads, leave) {
            return false;
        }
        let free = self.take_steps(iterate).min(1.0);
        // as long as shifts move and steps are short, points stay that far inside: edges move too
        let moving = ((1.0 - free) * gap.moved_j / gap.mean_j).min(1.0);
        let centre_j = 0.5 * gap.mean_j * (1.0 - free).powi(3).max(CENTRING_MIN).max(moving);
        for (inside, impulse) in self.rows.iter_mut().zip(&iterate.state.lambda) {
            inside.aim_inside(*impulse, centre_j);
        }
        self.pull(iterate);
        if !iterate.solve(aim.threads, leave) {
            return false;
        }
        let share = (REACH * self.take_steps(iterate)).min(1.0);
        iterate.advance(share);
        self.rows.iter_mut().for_each(|inside| inside.advance(share));
        if share < SHORT {
            self.leave(iterate);
        }
        self.follow(iterate, aim.yield_m_s);
        true
    }

    /// Begins again from the best place at which it was stuck, at another distance from the edges.
    fn leave(&mut self, iterate: &mut Iterate) {
        self.stuck += 1;
        let here = iterate.missed();
        if here < self.least {
            iterate.keep(&mut self.best);
            self.least = here;
        } else {
            iterate.go_back(&self.best);
        }
        self.enter(iterate);
    }

    /// Pushes impulses and dual points into their cones.
    fn enter(&mut self, iterate: &mut Iterate) {
        iterate.press();
        let spread = SPREAD * (2.0 * (f64::from(self.stuck) * GOLDEN + 0.5).fract() - 1.0);
        let by = INSIDE * spread.exp2() * iterate.missed() / (iterate.rows.len() as f64).sqrt();
        for (k, inside) in self.rows.iter_mut().enumerate() {
            if k == iterate.rows.contacts {
                iterate.press();
            }
            let at = iterate.state.point(k);
            let row = &iterate.rows.rows[k];
            inside.enter(row, at, (by * row.scale.sqrt()).max(INSIDE_MIN_M_S));
            iterate.state.lambda[k] = inside.impulse;
        }
        iterate.remeasure();
    }

    /// Lets bounds and compliances follow the impulses; an impulse between bounds that move keeps its place between
    /// them.
    fn follow(&mut self, iterate: &mut Iterate, yield_m_s: f64) {
        iterate.press();
        let mut moved = false;
        for ((inside, row), impulse) in self.rows.iter_mut().zip(&mut iterate.rows.rows).zip(&mut iterate.state.lambda)
        {
            let share = inside.follow(row);
            moved |= share != 1.0;
            *impulse *= share;
            row.compliance = inside.compliance.min(row.compliance_under(impulse.length(), yield_m_s));
        }
        if moved {
            iterate.remeasure();
        }
    }

    /// Scalings and gains of all rows.
    fn measure(&mut self, iterate: &Iterate) -> Gap {
        let (mut gap, mut cones) = (Gap::default(), 0.0);
        for (k, inside) in self.rows.iter_mut().enumerate() {
            let at = iterate.state.point(k);
            let row = &iterate.rows.rows[k];
            gap.moved_j += inside.shift(row, at);
            gap.mean_j += inside.scale(row, at.impulse);
            cones += f64::from(u8::from(matches!(inside.bound, Bound::Cone(_))));
        }
        let count = f64::max(cones, 1.0);
        Gap { mean_j: gap.mean_j / count, moved_j: gap.moved_j / count }
    }

    /// λ + G (c − r_p) of all rows.
    fn pull(&self, iterate: &mut Iterate) {
        for (k, inside) in self.rows.iter().enumerate() {
            let missing = inside.missing(&iterate.rows.rows[k], iterate.state.point(k));
            iterate.pull_on(k, missing, inside.gain, self.follows);
        }
    }

    /// The steps of all points; returns how much of them leads to the nearest edge.
    fn take_steps(&mut self, iterate: &Iterate) -> f64 {
        let mut reach = f64::INFINITY;
        for (k, inside) in self.rows.iter_mut().enumerate() {
            let Bound::Cone(chart) = inside.bound else { continue };
            let (row, at, impulse) = (&iterate.rows.rows[k], iterate.state.point(k), iterate.step.lambda[k]);
            let mut velocity = iterate.step.velocity[k] + impulse * row.compliance;
            if self.follows {
                velocity.x += row.shift_by(at, velocity);
            }
            let velocity = velocity + inside.off(row, at);
            inside.primal_step = chart.along(impulse);
            inside.dual_step = chart.dual_step(velocity, inside);
            let point: Lorentz = chart.point(at.impulse);
            reach = reach.min(point.reach(inside.primal_step)).min(inside.dual.reach(inside.dual_step));
        }
        reach
    }
}
