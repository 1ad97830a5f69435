//! The matrix of a remote member: the inverse of the compliance that it has published.
//!
//! In: a local model. Out: A = W⁻¹ as a dense square. Never here: where the compliance comes from.

use metachron_core::LocalModel;

/// The share of its largest compliance that every direction has at least: what its contacts hold does not make its matrix singular.
const YIELD_SHARE: f64 = 1e-9;

/// The inverse of a model's compliance into `out`, row by row; `false` where it is not positive definite.
pub(crate) fn invert(model: &LocalModel, out: &mut Vec<f64>) -> bool {
    let (blocks, size) = (model.blocks.len(), 3 * model.blocks.len());
    if blocks == 0 || model.compliance.len() != blocks * blocks {
        return false;
    }
    // the lower half of the symmetric part, twice: the second becomes the inverse
    out.clear();
    out.resize(2 * size * size, 0.0);
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
