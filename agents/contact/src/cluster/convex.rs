//! The convex way (CPH22), (TOD14): Newton with a line search on a convex function of velocity, passes of De Saxcé's shift around it.
//!
//! In: an iterate, started from impulses of the last step. Out: impulses of the last pass that was finished; no others are used.
//! Never here: the primal-dual way. Theory: `docs/theory/clusters.md`, eq. 10 and 11.

use super::cone::Form;
use super::iterate::{Iterate, Kept, Quadratic};
use super::newton::{Aim, harden, largest_miss};
use super::problem::Member;
use super::shifts::Shifts;
use glam::DVec3;
use metachron_core::ParallelFor;

/// Most steps of the first pass from the last step's impulses: it knows the answer or it does not.
const WARM_STEPS: usize = 6;
/// Most steps at the softness of [`SOFT_SHARE`], where twelve were always enough in what was measured.
const SOFT_STEPS: usize = 12;
/// Most steps from a soft answer to that at the wanted compliance, at [`SOFTEST_SHARE`], and of each later pass.
const FULL_STEPS: usize = 60;
/// Compliances in shares of the scale at which the iteration is sure to end; the second where the first did not.
const SOFT_SHARE: f64 = 1e-2;
const SOFTEST_SHARE: f64 = 1e-1;
/// The share of the tolerance to which a pass is solved, so that the passes' own error remains visible.
const PASS_TOLERANCE: f64 = 0.25;
/// Looks along a step.
const LOOKS: usize = 20;
/// The share of the first slope that may be left where a line search ends, and of the descent it foretells that must be met.
const SLOPE_LEFT: f64 = 0.5;
const DESCENT: f64 = 1e-4;
/// The share of a gradient that an inexact step may leave. Impulses are velocities over R here, so most of a gradient is an error
/// that the next step would have again.
const LEAVE: f64 = 1e-3;
/// Rounding of the sum of energies, in shares of it.
const ROUNDING: f64 = 1e-14;

/// How the convex way ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Passes {
    /// Passes that were finished.
    pub finished: usize,
    /// Whether Coulomb's law holds to the tolerance at the compliance of eq. 5.
    pub settled: bool,
}

/// Storage of the way.
#[derive(Debug, Clone, Default)]
pub(super) struct Stores {
    shifts: Shifts,
    pass: Kept,
    rest: Kept,
    soft: Kept,
}

/// One convex problem: its limits.
#[derive(Debug, Clone, Copy)]
struct Pass<'a> {
    members: &'a [Member<'a>],
    steps: usize,
    tolerance_m_s: f64,
    threads: &'a dyn ParallelFor,
}

/// Solves by up to `passes_max` passes. The iterate holds the impulses of the last finished one, or of a softer problem.
pub(super) fn solve(iterate: &mut Iterate, stores: &mut Stores, aim: &Aim<'_>, passes_max: usize) -> Passes {
    stores.shifts.reset(iterate.rows.len());
    let first = Pass {
        members: aim.members,
        steps: WARM_STEPS,
        tolerance_m_s: PASS_TOLERANCE * aim.tolerance_m_s,
        threads: aim.threads,
    };
    let later = Pass { steps: FULL_STEPS, ..first };
    if !descend(iterate, &stores.shifts.values, first) && !restart(iterate, stores, later) {
        return Passes { finished: 0, settled: false };
    }
    for finished in 1..passes_max {
        iterate.keep(&mut stores.pass);
        iterate.press();
        let hardened = harden(iterate, aim.yield_m_s);
        if !hardened && largest_miss(iterate, Form::Disc) < aim.tolerance_m_s {
            return Passes { finished, settled: true };
        }
        let rows = iterate.rows.rows.iter().enumerate();
        stores.shifts.follow(rows.map(|(k, row)| row.shift(iterate.state.point(k))));
        if !descend(iterate, &stores.shifts.values, later) {
            iterate.restore(aim.members, &stores.pass);
            return Passes { finished, settled: false };
        }
    }
    iterate.press();
    Passes { finished: passes_max, settled: largest_miss(iterate, Form::Disc) < aim.tolerance_m_s }
}

/// The first pass again from rest: soft first, then at the wanted compliance. Where that is not reached the soft answer stands,
/// and where not even that is found there are no impulses.
fn restart(iterate: &mut Iterate, stores: &mut Stores, full: Pass<'_>) -> bool {
    let Stores { shifts: Shifts { values: shifts, .. }, rest, soft: answer, .. } = stores;
    iterate.state.lambda.fill(DVec3::ZERO);
    iterate.keep(rest);
    let soft = [(SOFT_SHARE, SOFT_STEPS), (SOFTEST_SHARE, FULL_STEPS)].iter().any(|&(share, steps)| {
        iterate.restore(full.members, rest);
        iterate.rows.rows.iter_mut().for_each(|row| row.compliance = row.softened(share));
        descend(iterate, shifts, Pass { steps, ..full })
    });
    if !soft {
        iterate.restore(full.members, rest);
        return false;
    }
    iterate.keep(answer);
    // the soft impulses' velocities are where the harder problem starts
    iterate.restore_compliances(rest);
    let found = descend(iterate, shifts, full);
    if !found {
        iterate.restore(full.members, answer);
    }
    found
}

/// Minimises eq. 10; on success impulses and velocities are those of its minimum, else neither is of use.
fn descend(iterate: &mut Iterate, shifts: &[f64], pass: Pass<'_>) -> bool {
    iterate.press();
    for step in 0..=pass.steps {
        evaluate(iterate, shifts);
        let mut led = iterate.look_ahead(pass.members, false);
        if led.off.max_element() < pass.tolerance_m_s {
            led = iterate.look_ahead(pass.members, true);
        }
        if led.answered && led.off.max_element() < pass.tolerance_m_s {
            iterate.take_pulls();
            return true;
        }
        if step == pass.steps || !led.off.is_finite() || !iterate.take_step(LEAVE * led.gradient, pass.threads) {
            return false;
        }
        let share = line_search(iterate, shifts);
        iterate.advance(share);
    }
    false
}

/// The impulses that a velocity asks for, and how they change with it: pulls and gains.
fn evaluate(iterate: &mut Iterate, shifts: &[f64]) {
    for (k, shift) in shifts.iter().enumerate() {
        let row = &iterate.rows.rows[k];
        let compliance = row.compliance;
        let asked = -(iterate.state.velocity[k] + DVec3::X * *shift) / compliance;
        let image = row.law.project(Form::Cone, asked);
        iterate.linearise(k, &image, compliance);
    }
}

/// What a look along a step sees.
#[derive(Debug, Clone, Copy)]
struct Look {
    /// ℓ of eq. 10, J.
    energy: f64,
    /// Its slope along the step.
    slope: f64,
}

/// The convex function along the step.
struct Line<'a> {
    iterate: &'a Iterate,
    shifts: &'a [f64],
    members: Quadratic,
}

impl Line<'_> {
    fn look(&self, share: f64) -> Look {
        let Iterate { rows, state, step, .. } = self.iterate;
        let mut energy = share * self.members.cross + 0.5 * share * share * self.members.curve;
        let mut slope = self.members.cross + share * self.members.curve;
        for (k, row) in rows.rows.iter().enumerate() {
            let velocity = state.velocity[k] + step.velocity[k] * share + DVec3::X * self.shifts[k];
            let asked = -velocity / row.compliance;
            let given = row.law.project(Form::Cone, asked).value;
            energy += 0.5 * row.compliance * (asked.length_squared() - (asked - given).length_squared());
            slope -= given.dot(step.velocity[k]);
        }
        Look { energy, slope }
    }
}

/// How far to go along a step: where the function has fallen and its slope has flattened.
fn line_search(iterate: &mut Iterate, shifts: &[f64]) -> f64 {
    let members = iterate.quadratic();
    let line = Line { iterate, shifts, members };
    let start = line.look(0.0);
    let slack = ROUNDING * start.energy.abs();
    let (mut share, mut low, mut high) = (1.0, 0.0, f64::INFINITY);
    for _ in 0..LOOKS {
        let here = line.look(share);
        let fallen = here.energy - start.energy <= DESCENT * share * start.slope + slack;
        if fallen && here.slope.abs() <= SLOPE_LEFT * start.slope.abs() {
            break;
        }
        if here.slope > 0.0 || !fallen {
            high = share;
        } else {
            low = share;
        }
        if high.is_infinite() {
            break;
        }
        share = 0.5 * (low + high);
    }
    share
}
