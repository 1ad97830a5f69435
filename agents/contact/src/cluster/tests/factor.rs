//! The sparse factor against a dense one.

use super::Seeded;
use super::slow::Dense;
use crate::cluster::factor::{BlockCholesky, Pair};
use glam::{DMat3, DVec3};

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

fn load(sparse: &mut BlockCholesky, pairs: &[Pair], dense: &mut Dense) {
    sparse.clear();
    let mut seen = Vec::new();
    for pair in pairs {
        let key = (pair.row.max(pair.column), pair.row.min(pair.column));
        if seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let mut column =
            |j| DVec3::from_array(std::array::from_fn(|i| *dense.at(3 * pair.row + i, 3 * pair.column + j)));
        let value = DMat3::from_cols(column(0), column(1), column(2));
        sparse.add(sparse.place(*pair).unwrap(), &value);
    }
}

#[test]
fn the_sparse_factor_solves_what_the_dense_one_solves() {
    for (seed, size) in [1, 2, 5, 12, 40, 90].into_iter().enumerate() {
        let (pairs, mut dense) = random_matrix(size, 3 + seed as u64);
        let mut sparse = BlockCholesky::default();
        assert!(sparse.shape(size, &pairs));
        load(&mut sparse, &pairs, &mut dense);
        let mut numbers = Seeded::new(77);
        let mut x: Vec<_> = (0..size).map(|_| numbers.vector()).collect();
        let mut y: Vec<_> = x.iter().flat_map(|v| v.to_array()).collect();
        sparse.factor().unwrap();
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
    let mut sparse = BlockCholesky::default();
    assert!(sparse.shape(30, &pairs));
    assert!(!sparse.shape(30, &pairs[..40]));
    assert!(sparse.shape(31, &pairs));
}

#[test]
fn refactoring_and_solving_allocate_nothing() {
    let (pairs, mut dense) = random_matrix(40, 5);
    let mut sparse = BlockCholesky::default();
    sparse.shape(40, &pairs);
    load(&mut sparse, &pairs, &mut dense);
    let values = sparse.values().to_vec();
    let mut x = vec![DVec3::ONE; 40];
    let info = allocation_counter::measure(|| {
        for _ in 0..3 {
            assert!(!sparse.shape(40, &[Pair { row: 3, column: 3 }]));
            sparse.load(&values);
            sparse.factor().unwrap();
            sparse.solve(&mut x);
        }
    });
    assert_eq!(info.count_total, 0);
}

#[test]
fn an_indefinite_matrix_is_refused_at_its_block() {
    let mut sparse = BlockCholesky::default();
    let pairs = [0, 1, 2].map(|row| Pair { row, column: row });
    sparse.shape(3, &pairs);
    for (pair, value) in pairs.iter().zip([1.0, -1.0, 1.0]) {
        sparse.add(sparse.place(*pair).unwrap(), &DMat3::from_diagonal(DVec3::splat(value)));
    }
    assert_eq!(sparse.factor(), Err(1));
}
