//! The shifts of convex passes: a fixed point, found faster by what the last passes changed (AND65).
//!
//! In: the shifts that a pass ended with. Out: those of the next pass. Never here: the passes themselves.
//! Theory: `docs/theory/clusters.md`, eq. 11.

/// Passes whose changes are combined.
const DEPTH: usize = 5;
/// What is added to the squares of changes, in shares of the largest: directions that repeat each other are left alone.
const RIDGE: f64 = 1e-10;

/// Shifts, and how they and what became of them changed in the last passes.
#[derive(Debug, Clone, Default)]
pub(super) struct Shifts {
    /// Those of the pass to come, m/s, ≥ 0.
    pub values: Vec<f64>,
    /// What the last pass made of its shifts, and by how much these differ.
    made: Vec<f64>,
    off: Vec<f64>,
    changes: [Change; DEPTH],
    /// The square of how much the last pass was off, and passes since the changes were learnt anew.
    size_before: f64,
    passes: usize,
}

/// Of one pass to the next: what was made, and by how much it was off.
#[derive(Debug, Clone, Default)]
struct Change {
    made: Vec<f64>,
    off: Vec<f64>,
}

impl Shifts {
    /// Starts from no shift of so many rows.
    pub fn reset(&mut self, rows: usize) {
        self.values.clear();
        self.values.resize(rows, 0.0);
        (self.passes, self.size_before) = (0, f64::INFINITY);
    }

    /// Takes up the shifts that a pass ended with.
    pub fn follow(&mut self, made: impl Iterator<Item = f64>) {
        let Self { values, made: last, off: last_off, changes, passes, size_before } = self;
        let change = &mut changes[passes.saturating_sub(1) % DEPTH];
        std::mem::swap(&mut change.made, last);
        std::mem::swap(&mut change.off, last_off);
        last.clear();
        last.extend(made);
        last_off.clear();
        last_off.extend(last.iter().zip(&*values).map(|(made, value)| made - value));
        values.clone_from(last);
        let size = last_off.iter().map(|off| off * off).sum::<f64>();
        // where it is off by more than before, what was learnt on the way is of no use
        *passes = if size > *size_before { 1 } else { *passes + 1 };
        *size_before = size;
        if *passes < 2 {
            return;
        }
        change.made.iter_mut().zip(&*last).for_each(|(before, now)| *before = now - *before);
        change.off.iter_mut().zip(&*last_off).for_each(|(before, now)| *before = now - *before);
        let known = (*passes - 1).min(DEPTH);
        let shares = least_squares(&changes[..known], last_off);
        for (change, share) in changes[..known].iter().zip(shares) {
            values.iter_mut().zip(&change.made).for_each(|(value, made)| *value -= share * made);
        }
        // a shift below zero would pull
        values.iter_mut().for_each(|value| *value = value.max(0.0));
    }
}

/// The shares of changes that come nearest to what is off.
fn least_squares(changes: &[Change], off: &[f64]) -> [f64; DEPTH] {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (mut squares, mut x) = ([[0.0; DEPTH]; DEPTH], [0.0; DEPTH]);
    let size = changes.len();
    for row in 0..size {
        x[row] = dot(&changes[row].off, off);
        (0..size).for_each(|column| squares[row][column] = dot(&changes[row].off, &changes[column].off));
    }
    let largest = (0..size).fold(0.0_f64, |most, k| most.max(squares[k][k]));
    if largest <= 0.0 {
        return [0.0; DEPTH];
    }
    (0..size).for_each(|k| squares[k][k] += RIDGE * largest);
    for pivot in 0..size {
        for row in pivot + 1..size {
            let share = squares[row][pivot] / squares[pivot][pivot];
            (pivot..size).for_each(|column| squares[row][column] -= share * squares[pivot][column]);
            x[row] -= share * x[pivot];
        }
    }
    for row in (0..size).rev() {
        let known: f64 = (row + 1..size).map(|column| squares[row][column] * x[column]).sum();
        x[row] = (x[row] - known) / squares[row][row];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::Shifts;

    #[test]
    fn a_fixed_point_that_passes_near_slowly_is_found_in_few() {
        let rates = [0.97, 0.9, -0.8, 0.5, 0.1];
        let mut shifts = Shifts::default();
        shifts.reset(rates.len());
        for _ in 0..12 {
            let values = shifts.values.clone();
            shifts.follow(values.iter().zip(rates).map(|(value, rate)| 1.0 - rate + rate * value));
        }
        // by itself the slowest would be off by 0.97 to the twelfth, 0.7
        assert!(shifts.values.iter().all(|value| (value - 1.0).abs() < 1e-6), "{:?}", shifts.values);
    }
}
