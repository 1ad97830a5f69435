//! Dense kernels of a factor, over tiles of 4 × 4 numbers.
//!
//! In: columns of a front that are to be eliminated, and room for their update. Out: their factor and that update. Never here: where
//! numbers come from. Plain loops over tiles of fixed size, compiled for the widest vectors that a processor has. Products and sums are
//! rounded one by one and in one order whatever the width, so the bits are the same everywhere.
//!
//! Rows come in chunks of four; a chunk has its columns one after the other. Numbers that fill a chunk up are those of the identity.

use fearless_simd::{Level, dispatch};

/// Rows and columns of a tile.
pub(super) const TILE: usize = 4;
/// Numbers of a tile, column by column.
pub(super) const TILE_SIZE: usize = TILE * TILE;
type Tile = [f64; TILE_SIZE];

/// Where the tiles of a row of tiles start in a lower triangle of tiles, and how many numbers so many rows hold.
pub(crate) fn triangle(tiles: usize) -> usize {
    TILE_SIZE * (tiles * (tiles + 1) / 2)
}

/// A number of rows or columns, filled up to whole tiles.
pub(super) fn filled(size: usize) -> usize {
    size.next_multiple_of(TILE)
}

/// Factors the `columns` columns of `lower`, whose first rows are a square, and takes from the triangle `update` their terms in
/// the rows below. A diagonal tile is left as the inverse of its factor.
///
/// # Errors
/// The column at which the matrix is not positive definite.
pub(crate) fn eliminate(level: Level, lower: &mut [f64], update: &mut [f64], columns: usize) -> Result<(), usize> {
    dispatch!(level, _ => eliminate_by(lower, update, columns))
}

#[inline(always)]
fn eliminate_by(lower: &mut [f64], update: &mut [f64], columns: usize) -> Result<(), usize> {
    let tiles = columns / TILE;
    if tiles == 0 {
        return Ok(());
    }
    let lower = lower.as_chunks_mut::<TILE_SIZE>().0;
    for tile in 0..tiles {
        let (done, below) = lower.split_at_mut((tile + 1) * tiles);
        let (left, own) = done[tile * tiles..].split_at_mut(tile);
        let own = &mut own[0];
        subtract(own, left, left);
        invert_factor(own).map_err(|column| tile * TILE + column)?;
        // two at a time keep more sums under way; loops, as closures would not be compiled for wide vectors
        let mut pairs = below.chunks_exact_mut(2 * tiles);
        for pair in &mut pairs {
            let (first, second) = pair.split_at_mut(tiles);
            let [(before, here), (other_before, there)] = [first, second].map(|row| row.split_at_mut(tile));
            let (here, there) = (&mut here[0], &mut there[0]);
            subtract_both([here, there], [before, other_before], [left, left]);
            divide(here, own);
            divide(there, own);
        }
        if let Some((before, [here, ..])) = pairs.into_remainder().split_at_mut_checked(tile) {
            subtract(here, before, left);
            divide(here, own);
        }
    }
    let below = &lower[tiles * tiles..];
    let mut update = update.as_chunks_mut::<TILE_SIZE>().0;
    for (row, a) in below.chunks_exact(tiles).enumerate() {
        let (here, rest) = update.split_at_mut(row + 1);
        let mut pairs = here.chunks_exact_mut(2);
        let mut others = below.chunks_exact(tiles);
        while let (Some([first, second]), Some(b), Some(c)) = (pairs.next(), others.next(), others.next()) {
            subtract_both([first, second], [a, a], [b, c]);
        }
        if row % 2 == 0 {
            subtract(&mut here[row], a, a);
        }
        update = rest;
    }
    Ok(())
}

/// tile −= a bᵀ, of two chunks of equal length.
#[inline(always)]
fn subtract(tile: &mut Tile, a: &[Tile], b: &[Tile]) {
    let mut sums = [0.0; TILE_SIZE];
    for (a, b) in a.iter().zip(b) {
        for (a, b) in a.as_chunks::<TILE>().0.iter().zip(b.as_chunks::<TILE>().0) {
            for (column, b) in b.iter().enumerate() {
                for (row, a) in a.iter().enumerate() {
                    sums[TILE * column + row] += a * b;
                }
            }
        }
    }
    for (value, sum) in tile.iter_mut().zip(sums) {
        *value -= sum;
    }
}

/// The same of two tiles.
#[inline(always)]
fn subtract_both(tiles: [&mut Tile; 2], a: [&[Tile]; 2], b: [&[Tile]; 2]) {
    let mut sums = [[0.0; TILE_SIZE]; 2];
    for ((a0, b0), (a1, b1)) in a[0].iter().zip(b[0]).zip(a[1].iter().zip(b[1])) {
        let first = a0.as_chunks::<TILE>().0.iter().zip(b0.as_chunks::<TILE>().0);
        let second = a1.as_chunks::<TILE>().0.iter().zip(b1.as_chunks::<TILE>().0);
        for ((a0, b0), (a1, b1)) in first.zip(second) {
            for column in 0..TILE {
                for row in 0..TILE {
                    sums[0][TILE * column + row] += a0[row] * b0[column];
                    sums[1][TILE * column + row] += a1[row] * b1[column];
                }
            }
        }
    }
    for (tile, sums) in tiles.into_iter().zip(sums) {
        for (value, sum) in tile.iter_mut().zip(sums) {
            *value -= sum;
        }
    }
}

/// tile ← tile L⁻ᵀ, of the inverse of a lower factor.
#[inline(always)]
fn divide(tile: &mut Tile, inverse: &Tile) {
    let mut out = [0.0; TILE_SIZE];
    for column in 0..TILE {
        for other in 0..=column {
            let share = inverse[TILE * other + column];
            for row in 0..TILE {
                out[TILE * column + row] += tile[TILE * other + row] * share;
            }
        }
    }
    *tile = out;
}

/// A symmetric tile, of which the lower half is read, becomes the inverse of its lower Cholesky factor.
#[inline(always)]
fn invert_factor(tile: &mut Tile) -> Result<(), usize> {
    let mut l = [0.0; TILE_SIZE];
    let at = |row: usize, column: usize| TILE * column + row;
    // the diagonal holds reciprocals
    for column in 0..TILE {
        let own = (0..column).fold(tile[at(column, column)], |left, k| left - l[at(column, k)] * l[at(column, k)]);
        if !(own > 0.0 && own.is_finite()) {
            return Err(column);
        }
        l[at(column, column)] = 1.0 / own.sqrt();
        for row in column + 1..TILE {
            let left = (0..column).fold(tile[at(row, column)], |left, k| left - l[at(row, k)] * l[at(column, k)]);
            l[at(row, column)] = left * l[at(column, column)];
        }
    }
    *tile = [0.0; TILE_SIZE];
    for column in 0..TILE {
        tile[at(column, column)] = l[at(column, column)];
        for row in column + 1..TILE {
            let sum: f64 = (column..row).map(|k| l[at(row, k)] * tile[at(k, column)]).sum();
            tile[at(row, column)] = -sum * l[at(row, row)];
        }
    }
    Ok(())
}

/// x ← L⁻¹ x of the square, and takes its terms from the rows below.
#[inline(always)]
pub(super) fn solve_down(lower: &[f64], columns: usize, x: &mut [f64]) {
    for (row, chunk) in lower.chunks_exact(TILE * columns).enumerate() {
        let own = row * TILE < columns;
        let length = if own { row * TILE } else { columns };
        let mut sums = [0.0; TILE];
        for (column, x) in chunk.as_chunks::<TILE>().0.iter().zip(&x[..length]) {
            for (sum, l) in sums.iter_mut().zip(column) {
                *sum += l * x;
            }
        }
        let here = &mut x[row * TILE..(row + 1) * TILE];
        for (x, sum) in here.iter_mut().zip(sums) {
            *x -= sum;
        }
        if own {
            let inverse = &chunk[row * TILE_SIZE..(row + 1) * TILE_SIZE];
            let mut out = [0.0; TILE];
            for (column, x) in inverse.as_chunks::<TILE>().0.iter().zip(&*here) {
                for (out, l) in out.iter_mut().zip(column) {
                    *out += l * x;
                }
            }
            here.copy_from_slice(&out);
        }
    }
}

/// x ← L⁻ᵀ x of the square, the rows below being known.
#[inline(always)]
pub(super) fn solve_up(lower: &[f64], columns: usize, x: &mut [f64]) {
    for (row, chunk) in lower.chunks_exact(TILE * columns).enumerate().rev() {
        let own = row * TILE < columns;
        let (before, rest) = x.split_at_mut(row * TILE);
        let here = &mut rest[..TILE];
        let dot = |column: &[f64; TILE], x: &[f64]| {
            let [a, b, c, d] = *column;
            (a * x[0] + b * x[1]) + (c * x[2] + d * x[3])
        };
        if own {
            let inverse = &chunk[row * TILE_SIZE..(row + 1) * TILE_SIZE];
            let mut out = [0.0; TILE];
            for (out, column) in out.iter_mut().zip(inverse.as_chunks::<TILE>().0) {
                *out = dot(column, here);
            }
            here.copy_from_slice(&out);
        }
        let length = if own { row * TILE } else { columns };
        for (column, x) in chunk.as_chunks::<TILE>().0.iter().zip(&mut before[..length]) {
            *x -= dot(column, here);
        }
    }
}
