//! The sparse factor against a dense one.

use super::Seeded;
use super::slow::Dense;
use crate::solve::Block;
use crate::solve::sparse::factor::{Cholesky, Pair};
use crate::solve::sparse::tiles::eliminate;
use fearless_simd::Level;
use glam::{DMat3, DVec3};
use metachron_core::{ParallelFor, PlainLoop};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A random symmetric positive definite matrix of blocks: its couplings, and all of it.
fn random_matrix(size: usize, seed: u64) -> (Vec<Pair>, Dense) {
    let mut numbers = Seeded::new(seed);
    let mut pairs: Vec<_> = (0..size).map(|row| Pair { row, column: row }).collect();
    let mut dense = Dense::zero(3 * size);
    for _ in 0..2 * size {
        let (row, column) = (numbers.below(size), numbers.below(size));
        if row != column {
            pairs.push(Pair { row, column });
            // a vector over both blocks, times its transpose: never negative
            let v: Vec<f64> = (0..6).map(|_| numbers.between(-1.0, 1.0)).collect();
            let place = |i: usize| if i < 3 { 3 * row + i } else { 3 * column + i - 3 };
            for i in 0..6 {
                for j in 0..6 {
                    *dense.at(place(i), place(j)) += v[i] * v[j];
                }
            }
        }
    }
    for i in 0..3 * size {
        *dense.at(i, i) += 0.1;
    }
    (pairs, dense)
}

/// The blocks at these places.
fn blocks(pairs: &[Pair], dense: &mut Dense) -> Vec<Block> {
    let mut seen = Vec::new();
    let mut found = Vec::new();
    for pair in pairs {
        let key = (pair.row.max(pair.column), pair.row.min(pair.column));
        if seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let mut column =
            |j| DVec3::from_array(std::array::from_fn(|i| *dense.at(3 * pair.row + i, 3 * pair.column + j)));
        let value = DMat3::from_cols(column(0), column(1), column(2));
        found.push(Block { row: pair.row, column: pair.column, value });
    }
    found
}

#[test]
fn the_sparse_factor_solves_what_the_dense_one_solves() {
    for (seed, size) in [1, 2, 5, 12, 40, 90].into_iter().enumerate() {
        let (pairs, mut dense) = random_matrix(size, 3 + seed as u64);
        let mut sparse = Cholesky::default();
        assert!(sparse.shape(size, &pairs, &[]));
        sparse.set(&blocks(&pairs, &mut dense));
        let mut numbers = Seeded::new(77);
        let mut x: Vec<_> = (0..size).map(|_| numbers.vector()).collect();
        let mut y: Vec<_> = x.iter().flat_map(|v| v.to_array()).collect();
        sparse.factor(&PlainLoop, |_, _| ()).unwrap();
        sparse.solve(&mut x);
        dense.factored().solve(&mut y);
        for (a, b) in x.iter().flat_map(|v| v.to_array()).zip(y) {
            assert!((a - b).abs() < 1e-11, "{a} is not {b} at size {size}"); // condition near 100, sums of 270
        }
    }
}

#[test]
fn the_order_is_kept_while_the_structure_holds_the_couplings() {
    let (pairs, _) = random_matrix(30, 9);
    let mut sparse = Cholesky::default();
    assert!(sparse.shape(30, &pairs, &[]));
    assert!(!sparse.shape(30, &pairs[..40], &[]));
    assert!(sparse.shape(31, &pairs, &[]));
}

#[test]
fn a_structure_that_grows_is_solved_as_well() {
    let (mut pairs, mut dense) = random_matrix(50, 12);
    let mut sparse = Cholesky::default();
    sparse.shape(50, &pairs, &[]);
    // couplings of far blocks, one by one, until a new order is made
    for k in 0..12 {
        let (row, column) = (49 - k, 2 * k);
        pairs.push(Pair { row, column });
        for i in 0..3 {
            *dense.at(3 * row + i, 3 * column + i) += 0.01;
            *dense.at(3 * column + i, 3 * row + i) += 0.01;
        }
        sparse.shape(50, &pairs, &[]);
        sparse.set(&blocks(&pairs, &mut dense));
        sparse.factor(&PlainLoop, |_, _| ()).unwrap();
        let mut x: Vec<_> = (0..50).map(|i| DVec3::new(1.0, f64::from(i), -1.0)).collect();
        let mut y: Vec<_> = x.iter().flat_map(|v| v.to_array()).collect();
        sparse.solve(&mut x);
        dense.clone().factored().solve(&mut y);
        let apart = x.iter().flat_map(|v| v.to_array()).zip(y).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(apart < 1e-9, "{apart} after {k}"); // of numbers up to some hundred
    }
}

#[test]
fn a_front_has_the_same_bits_by_vectors_of_any_width() {
    let (columns, rows) = (12, 16);
    let mut seeded = Seeded::new(3);
    let mut lower: Vec<_> = (0..columns * (columns + rows)).map(|_| seeded.between(-1.0, 1.0)).collect();
    // tile by tile, so that the diagonal is the largest
    (0..columns).for_each(|at| lower[at / 4 * 4 * columns + 4 * at + at % 4] = 40.0);
    let by = |level: Level| {
        let (mut lower, mut update) = (lower.clone(), vec![0.0; 16 * 10]);
        eliminate(level, &mut lower, &mut update, columns).unwrap();
        lower.into_iter().chain(update).map(f64::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(by(Level::baseline()), by(Level::new()));
}

#[test]
fn refactoring_and_solving_allocate_nothing() {
    let (pairs, mut dense) = random_matrix(40, 5);
    let mut sparse = Cholesky::default();
    sparse.shape(40, &pairs, &[]);
    let (first, mut second) = (blocks(&pairs, &mut dense), blocks(&pairs, &mut dense));
    second[7].value += DMat3::IDENTITY;
    let mut x = vec![DVec3::ONE; 40];
    let info = allocation_counter::measure(|| {
        for values in [&first, &second, &first] {
            assert!(!sparse.shape(40, &[Pair { row: 3, column: 3 }], &[]));
            sparse.set(values);
            sparse.factor(&PlainLoop, |_, _| ()).unwrap();
            sparse.solve(&mut x);
        }
    });
    assert_eq!(info.count_total, 0);
}

#[test]
fn what_is_factored_again_in_part_has_the_bits_of_a_whole_factor() {
    let (pairs, mut dense) = random_matrix(60, 21);
    let mut values = blocks(&pairs, &mut dense);
    let mut kept = Cholesky::default();
    kept.shape(60, &pairs, &[]);
    for (k, at) in [0, 17, 59, 3, 3].into_iter().enumerate() {
        values[at].value += DMat3::from_diagonal(DVec3::splat(0.1 * (k + 1) as f64));
        let mut whole = Cholesky::default();
        whole.shape(60, &pairs, &[]);
        let [partly, wholly] = [&mut kept, &mut whole].map(|matrix| {
            let mut x: Vec<_> = (0..60).map(|i| DVec3::new(1.0, f64::from(i), -2.0)).collect();
            matrix.set(&values);
            matrix.factor(&PlainLoop, |_, _| ()).unwrap();
            matrix.solve(&mut x);
            x
        });
        assert_eq!(partly, wholly);
    }
}

#[test]
fn what_is_added_to_a_front_is_part_of_the_matrix() {
    let (pairs, mut dense) = random_matrix(20, 8);
    let (mut added, mut given) = (Cholesky::default(), Cholesky::default());
    let mut values = blocks(&pairs, &mut dense);
    [&mut added, &mut given].into_iter().for_each(|matrix| assert!(matrix.shape(20, &pairs, &[])));
    added.set(&values);
    added.factor(&PlainLoop, |_, _| ()).unwrap();
    let more = DMat3::from_cols(DVec3::new(3.0, 1.0, 0.0), DVec3::new(1.0, 2.0, 0.5), DVec3::new(0.0, 0.5, 4.0));
    let place = added.place(Pair { row: 11, column: 11 }).unwrap();
    added.spoil(place.front);
    added
        .factor(&PlainLoop, |front, entries| {
            if front == place.front {
                entries.add(place, &more)
            }
        })
        .unwrap();
    values.push(Block { row: 11, column: 11, value: more });
    given.set(&values);
    given.factor(&PlainLoop, |_, _| ()).unwrap();
    let [a, b] = [added, given].map(|mut matrix| {
        let mut x = vec![DVec3::new(1.0, 2.0, 3.0); 20];
        matrix.solve(&mut x);
        x
    });
    let apart = a.iter().zip(&b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(apart < 1e-12, "{apart}");
}

#[test]
fn an_indefinite_matrix_is_refused_at_its_block() {
    let mut sparse = Cholesky::default();
    let pairs = [0, 1, 2].map(|row| Pair { row, column: row });
    sparse.shape(3, &pairs, &[]);
    let values: Vec<_> = [1.0, -1.0, 1.0]
        .iter()
        .enumerate()
        .map(|(k, value)| Block { row: k, column: k, value: DMat3::from_diagonal(DVec3::splat(*value)) })
        .collect();
    sparse.set(&values);
    assert_eq!(sparse.factor(&PlainLoop, |_, _| ()), Err(1));
}

/// A new thread for every second job; counts them.
#[derive(Debug, Default)]
struct Scoped {
    jobs: AtomicUsize,
}

impl ParallelFor for Scoped {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        self.jobs.fetch_add(1, Ordering::Relaxed);
        std::thread::scope(|scope| {
            scope.spawn(second);
            first();
        });
    }
}

#[test]
fn trees_of_fronts_have_the_same_bits_side_by_side() {
    // three lattices of 7 x 7 x 5, of which one stands alone
    let (sides, count) = ([7, 7, 5], 245);
    let at = |i: usize| [i % sides[0], i / sides[0] % sides[1], i / (sides[0] * sides[1])];
    let mut values = Vec::new();
    for lattice in 0..3 {
        for row in 0..count {
            for column in 0..=row {
                let apart: usize = at(row).iter().zip(at(column)).map(|(a, b)| a.abs_diff(b)).sum();
                let value = [30.0, -2.0 - lattice as f64, 0.3].get(apart).copied().unwrap_or_default();
                if value != 0.0 {
                    let (row, column) = (count * lattice + row, count * lattice + column);
                    values.push(Block { row, column, value: DMat3::from_diagonal(DVec3::new(value, 30.0, value)) });
                }
            }
        }
    }
    values.iter_mut().filter(|block| block.row != block.column).for_each(|block| block.value.y_axis.y = 0.0);
    values.push(Block { row: 300, column: 10, value: DMat3::IDENTITY });
    let pairs: Vec<_> = values.iter().map(|block| Pair { row: block.row, column: block.column }).collect();
    let solved = |threads: &dyn ParallelFor, values: &[Block]| {
        let mut matrix = Cholesky::default();
        matrix.shape(3 * count, &pairs, &[]);
        matrix.set(values);
        let made = matrix.factor(threads, |_, _| ());
        let mut x: Vec<_> = (0..3 * count).map(|i| DVec3::new(1.0, i as f64, -2.0)).collect();
        matrix.solve(&mut x);
        (made, x)
    };
    let scoped = Scoped::default();
    let (made, x) = solved(&scoped, &values);
    assert_eq!((made, x.clone()), solved(&PlainLoop, &values));
    assert!(made.is_ok() && scoped.jobs.into_inner() > 2);
    // the product with the matrix is the right side again
    let mut back = vec![DVec3::ZERO; 3 * count];
    for block in &values {
        back[block.row] += block.value * x[block.column];
        if block.row != block.column {
            back[block.column] += block.value.transpose() * x[block.row];
        }
    }
    let apart = (0..3 * count).map(|i| back[i].distance(DVec3::new(1.0, i as f64, -2.0))).fold(0.0, f64::max);
    assert!(apart < 1e-10, "{apart}");
    // of several bad blocks the same one is named
    for bad in [100, 400, 700] {
        let at = values.iter().position(|block| block.row == bad && block.column == bad).unwrap();
        values[at].value = -DMat3::IDENTITY;
    }
    let refused = solved(&PlainLoop, &values).0;
    assert!(refused.is_err());
    assert_eq!(solved(&Scoped::default(), &values).0, refused);
}
