//! What friction that follows its pressure adds to a Newton step: the part of the laws' slope that no symmetric factor holds.
//!
//! In: a skew of each row, a step without them, the factor that it came from. Out: the step with them. Never here: laws of contact.
//! Each sliding contact adds a matrix of rank one, so the unknowns are one number for each, found by minimal residuals (SS86) with the
//! symmetric factor in the place of the whole matrix. Theory: `docs/theory/clusters.md`, eq. 8b.

use super::cone::{Law, Projection};
use super::rows::{Point, Row, Rows};
use glam::DMat3;
use glam::DVec3;

/// The most numbers of a solution's basis: that many times the factor is used for one step.
const BASIS_MAX: usize = 30;

/// By how much the impulse of a row changes beyond its symmetric gain: by `gives` for each unit of the velocity along `sees`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Skew {
    /// In the row's frame.
    pub gives: DVec3,
    /// In the row's frame, 1/kg times the reciprocal unit of `gives`.
    pub sees: DVec3,
}

/// A direction of the basis: numbers of sliding rows, and the velocities that these impulses cause.
#[derive(Debug, Clone, Default)]
struct Direction {
    numbers: Vec<f64>,
    caused: Vec<DVec3>,
}

/// One step's equations.
pub(super) struct Sliding<'a> {
    pub rows: &'a Rows,
    pub skews: &'a [Skew],
    /// What may be left of them, √J.
    pub goal: f64,
}

/// Storage, and the numbers of the last step.
#[derive(Debug, Clone, Default)]
pub(super) struct Residuals {
    /// Rows with a skew, and the size of what each one gives, √J for each unit.
    sliding: Vec<usize>,
    sizes: Vec<f64>,
    basis: Vec<Direction>,
    /// The triangle that rotations make of the basis, column by column, the rotations, and the right side.
    columns: Vec<f64>,
    turns: Vec<[f64; 2]>,
    right: Vec<f64>,
    /// How much of its `gives` each sliding row gives.
    numbers: Vec<f64>,
}

/// What the exact slope of a row adds to its symmetric gain.
pub(super) struct Followed {
    pub skew: Skew,
    pub more: DVec3,
}

impl Skew {
    pub const NONE: Self = Self { gives: DVec3::ZERO, sees: DVec3::ZERO };
}

/// How the friction of a sliding contact follows its pressure, of a row with this image; `None` for all else.
pub(super) fn follow_pressure(row: &Row, image: &Projection, pulled: DVec3) -> Option<Followed> {
    let Law::Coulomb { friction } = row.law else { return None };
    let slides = image.slopes.x == 1.0 && image.slopes.y == 0.0 && friction > 0.0;
    let (w, r) = (row.scale, row.compliance);
    let gives = image.axes.y_axis * friction;
    slides.then(|| Followed { skew: Skew { gives, sees: DVec3::X / r }, more: gives * (1.0 - r / w) * pulled.x })
}

/// How the shift of a contact follows its slip, of a row of this gain; `pulled` is the change of its impulse if no velocity changed.
pub(super) fn follow_slip(row: &Row, at: Point, gain: DMat3, pulled: DVec3) -> Option<Followed> {
    let Law::Coulomb { friction } = row.law else { return None };
    let r = row.compliance;
    let slip = (at.velocity + at.impulse * r).with_x(0.0).try_normalize()?;
    let pushed = gain.x_axis;
    let gives = pushed * (friction / (1.0 + r * friction * slip.dot(pushed)));
    Some(Followed { skew: Skew { gives, sees: slip - gain * slip * r }, more: gives * (-r * slip.dot(pulled)) })
}

impl Residuals {
    /// Changes a step `change` of all blocks to what it is with the skews. `solve` applies the symmetric factor.
    pub fn correct(&mut self, of: &Sliding<'_>, change: &mut [DVec3], mut solve: impl FnMut(&mut [DVec3])) {
        let Self { sliding, sizes, basis, columns, turns, right, numbers } = self;
        let Sliding { rows, skews, goal } = *of;
        sliding.clear();
        sliding.extend((0..skews.len()).filter(|&row| skews[row] != Skew::NONE));
        sizes.clear();
        sizes.extend(sliding.iter().map(|&row| skews[row].gives.length() * rows.rows[row].scale.sqrt()));
        numbers.clear();
        numbers.resize(sliding.len(), 0.0);
        columns.clear();
        turns.clear();
        right.clear();
        let seen = |at: usize, x: &[DVec3]| skews[sliding[at]].sees.dot(rows.velocity(sliding[at], x)) * sizes[at];
        let first = direction(basis, 0);
        first.numbers.clear();
        first.numbers.extend((0..sliding.len()).map(|at| seen(at, change)));
        let size = normalise(&mut first.numbers);
        if !(size > goal && size.is_finite()) {
            return;
        }
        right.push(size);
        for step in 0..BASIS_MAX.min(sliding.len()) {
            let caused = &mut basis[step].caused;
            caused.clear();
            caused.resize(change.len(), DVec3::ZERO);
            for (at, &row) in sliding.iter().enumerate() {
                let impulse = skews[row].gives * (basis[step].numbers[at] / sizes[at]);
                for term in rows.terms(row) {
                    basis[step].caused[term.block] += term.map.mul_transpose_vec3(impulse);
                }
            }
            solve(&mut basis[step].caused);
            direction(basis, step + 1);
            let (known, next) = basis.split_at_mut(step + 1);
            let (last, next) = (&known[step], &mut next[0].numbers);
            next.clear();
            next.extend((0..sliding.len()).map(|at| last.numbers[at] + seen(at, &last.caused)));
            let start = columns.len();
            for other in &*known {
                let along = dot(next, &other.numbers);
                next.iter_mut().zip(&other.numbers).for_each(|(value, by)| *value -= along * by);
                columns.push(along);
            }
            let beyond = normalise(next);
            let left = turn(&mut columns[start..], beyond, turns);
            let before = right[step];
            right[step] = turns[step][0] * before;
            right.push(-turns[step][1] * before);
            if !left || right[step + 1].abs() <= goal || !beyond.is_finite() {
                break;
            }
        }
        self.take(change);
    }

    /// Takes what the basis gives.
    fn take(&mut self, change: &mut [DVec3]) {
        let Self { basis, columns, turns, right, numbers, sizes, .. } = self;
        // column k of the triangle starts after those of 1, 2 … k numbers
        let at = |row: usize, column: usize| columns[column * (column + 1) / 2 + row];
        for row in (0..turns.len()).rev() {
            let known: f64 = (row + 1..turns.len()).map(|column| at(row, column) * right[column]).sum();
            right[row] = (right[row] - known) / at(row, row);
        }
        if !right.iter().all(|share| share.is_finite()) {
            return;
        }
        for (direction, share) in basis.iter().zip(&right[..turns.len()]) {
            numbers.iter_mut().zip(&direction.numbers).for_each(|(number, by)| *number += share * by);
            change.iter_mut().zip(&direction.caused).for_each(|(v, by)| *v -= *by * *share);
        }
        numbers.iter_mut().zip(sizes).for_each(|(number, size)| *number /= *size);
    }

    /// The impulse of each sliding row beyond what its symmetric gain gives, by its number.
    pub fn impulses<'a>(&'a self, skews: &'a [Skew]) -> impl Iterator<Item = (usize, DVec3)> + 'a {
        self.sliding.iter().zip(&self.numbers).map(|(&row, number)| (row, skews[row].gives * *number))
    }
}

/// A direction of the basis, with storage of its own.
fn direction(basis: &mut Vec<Direction>, at: usize) -> &mut Direction {
    if basis.len() <= at {
        basis.resize_with(at + 1, Direction::default);
    }
    &mut basis[at]
}

/// Turns a new column, whose last number is `beyond`, as those before it; whether the basis goes on.
fn turn(column: &mut [f64], beyond: f64, turns: &mut Vec<[f64; 2]>) -> bool {
    for (at, [along, across]) in turns.iter().enumerate() {
        let (a, b) = (column[at], column[at + 1]);
        column[at] = along * a + across * b;
        column[at + 1] = along * b - across * a;
    }
    let last = column.len() - 1;
    let size = (column[last] * column[last] + beyond * beyond).sqrt();
    turns.push([column[last] / size, beyond / size]);
    column[last] = size;
    beyond > 0.0
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Makes a list one of size 1; returns its size before.
fn normalise(list: &mut [f64]) -> f64 {
    let size = dot(list, list).sqrt();
    if size > 0.0 {
        list.iter_mut().for_each(|value| *value /= size);
    }
    size
}
