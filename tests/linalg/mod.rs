//! Tests of factorizations of small matrices, by products and by comparison of the factorizations.

mod rows;

use fretwear::linalg::{LinalgError, Matrix, SparseCholesky, SparseIndefinite, SparseSymmetric};

/// Rounding error of a few hundred operations on numbers of order one.
const ROUNDING: f64 = 1e-12;

/// Chain of masses with springs to first and second neighbours, with a shifted diagonal.
fn chain(size: usize, shift: f64) -> SparseSymmetric {
    let mut matrix = SparseSymmetric {
        starts: vec![0],
        rows: Vec::new(),
        values: Vec::new(),
    };
    for j in 0..size {
        for (away, value) in [(0, 4.0 + shift), (1, -1.3), (2, -0.6 - 0.01 * j as f64)] {
            if j + away < size {
                matrix.rows.push(j + away);
                matrix.values.push(value);
            }
        }
        matrix.starts.push(matrix.rows.len());
    }
    matrix
}

fn dense(matrix: &SparseSymmetric) -> Matrix {
    let mut full = Matrix::zeros(matrix.size(), matrix.size());
    for j in 0..matrix.size() {
        for (i, v) in matrix.column(j) {
            full[(i, j)] = v;
            full[(j, i)] = v;
        }
    }
    full
}

/// Unusual order of elimination: every third row first, then the other rows backwards.
fn odd_order(size: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..size).filter(|i| i % 3 == 0).collect();
    order.extend((0..size).rev().filter(|i| i % 3 != 0));
    order
}

fn difference(a: &Matrix, b: &Matrix) -> f64 {
    assert_eq!((a.rows(), a.columns()), (b.rows(), b.columns()));
    let pairs = a.as_slice().iter().zip(b.as_slice());
    pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

fn right_sides(rows: usize) -> Matrix {
    Matrix::from_fn(rows, 5, |i, j| ((3 * i + 7 * j) % 11) as f64 - 4.5)
}

#[test]
fn sparse_products_are_dense_products() {
    let (a, b) = (chain(23, 0.0), chain(23, 1.5));
    let x = right_sides(23);
    assert!(difference(&a.times(&x), &dense(&a).times(&x)) < ROUNDING);
    let mut sum = dense(&a);
    sum.add(-2.5, &dense(&b));
    assert!(difference(&dense(&a.plus(-2.5, &b)), &sum) < ROUNDING);
}

#[test]
fn sums_of_different_patterns_keep_both() {
    let diagonal = SparseSymmetric {
        starts: (0..=23).collect(),
        rows: (0..23).collect(),
        values: vec![0.5; 23],
    };
    let sum = diagonal.plus(2.0, &chain(23, 0.0));
    let mut expected = dense(&diagonal);
    expected.add(2.0, &dense(&chain(23, 0.0)));
    assert!(difference(&dense(&sum), &expected) < ROUNDING);
}

#[test]
fn a_sparse_factor_solves_in_any_order() {
    let matrix = chain(41, 0.5);
    for order in [odd_order(41), (0..41).collect()] {
        let factor = SparseCholesky::new(&matrix, &order).unwrap();
        let mut x = right_sides(41);
        factor.solve(&mut x);
        assert!(difference(&matrix.times(&x), &right_sides(41)) < ROUNDING);
    }
}

#[test]
fn the_trailing_factor_has_the_inverse_on_the_last_rows() {
    let matrix = chain(41, 0.5);
    let factor = SparseCholesky::new(&matrix, &odd_order(41)).unwrap();
    for count in [1, 2, 7, 30, 41] {
        let last = factor.last_rows(count).to_vec();
        let mut unit = Matrix::zeros(41, count);
        for (c, &row) in last.iter().enumerate() {
            unit[(row, c)] = 1.0;
        }
        factor.solve(&mut unit);
        let inverse = Matrix::from_fn(count, count, |i, j| unit[(last[i], j)]);
        let trailing = factor.trailing_factor(count);
        let identity = Matrix::from_fn(count, count, |i, j| if i == j { 1.0 } else { 0.0 });
        let product = trailing.times_transpose(&trailing).times(&inverse);
        assert!(difference(&product, &identity) < ROUNDING, "{count}");
    }
}

#[test]
fn an_indefinite_matrix_is_solved() {
    let matrix = chain(41, -3.1);
    let lowest = dense(&matrix).symmetric_eigen().unwrap().0[0];
    assert!(lowest < -1.0, "the matrix must be indefinite: {lowest}");
    let factor = SparseIndefinite::new(&matrix, &odd_order(41)).unwrap();
    let mut x = right_sides(41);
    factor.solve(&mut x);
    assert!(difference(&matrix.times(&x), &right_sides(41)) < 100.0 * ROUNDING);
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_refused() {
    let order = odd_order(41);
    let found = SparseCholesky::new(&chain(41, -3.1), &order).err();
    assert!(
        matches!(found, Some(LinalgError::NotPositiveDefinite { size: 41, row }) if row < 41),
        "{found:?}"
    );
    let found = dense(&chain(12, -30.0)).cholesky().err();
    assert!(
        matches!(
            found,
            Some(LinalgError::NotPositiveDefinite { size: 12, row: 0 })
        ),
        "{found:?}"
    );
}

#[test]
fn an_order_that_is_no_permutation_is_refused() {
    let wrong: [Vec<usize>; 3] = [vec![0, 1, 1], vec![0, 1], vec![0, 1, 3]];
    for order in wrong {
        let found = SparseCholesky::new(&chain(3, 0.0), &order).err();
        let expected = LinalgError::NotAPermutation {
            size: 3,
            length: order.len(),
        };
        assert_eq!(found, Some(expected));
    }
}

#[test]
fn eigenvectors_and_dense_factors_give_the_matrix_back() {
    let matrix = dense(&chain(17, 0.7));
    let (values, vectors) = matrix.symmetric_eigen().unwrap();
    let scaled = Matrix::from_fn(17, 17, |i, j| vectors[(i, j)] * values[j]);
    assert!(difference(&scaled.times_transpose(&vectors), &matrix) < ROUNDING);
    assert!(values.windows(2).all(|w| w[0] <= w[1]));
    let lower = matrix.cholesky().unwrap();
    assert!(difference(&lower.times_transpose(&lower), &matrix) < ROUNDING);
    let mut solved = right_sides(17);
    lower.solve_lower(&mut solved);
    assert!(difference(&lower.times(&solved), &right_sides(17)) < ROUNDING);
    // The matrix X solves X Lᵀ = A.
    let wide = Matrix::from_fn(4, 17, |i, j| (i + 2 * j) as f64 - 7.0);
    let mut solved = wide.clone();
    lower.solve_upper_right(&mut solved);
    assert!(difference(&solved.times_transpose(&lower), &wide) < 10.0 * ROUNDING);
}

/// Four copies of a chain, mixed by an orthogonal matrix. Every eigenvalue has multiplicity four.
#[test]
fn repeated_eigenvalues_are_all_found() {
    let (single, copies) = (dense(&chain(41, 0.0)), 4);
    let size = 41 * copies;
    let mut apart = Matrix::zeros(size, size);
    for copy in 0..copies {
        for i in 0..41 {
            for j in 0..41 {
                apart[(copies * i + copy, copies * j + copy)] = single[(i, j)];
            }
        }
    }
    let axis = Matrix::from_fn(size, 1, |i, _| ((7 * i) % 13) as f64 - 5.5);
    let length = axis.transpose_times(&axis)[(0, 0)];
    let mut mirror = Matrix::from_fn(size, size, |i, j| if i == j { 1.0 } else { 0.0 });
    mirror.add(-2.0 / length, &axis.times_transpose(&axis));
    let mixed = mirror.times(&apart).times(&mirror);
    let (values, vectors) = mixed.symmetric_eigen().unwrap();
    let expected = single.symmetric_eigen().unwrap().0;
    for (i, value) in values.iter().enumerate() {
        assert!((value - expected[i / copies]).abs() < ROUNDING, "{i}");
    }
    let scaled = Matrix::from_fn(size, size, |i, j| vectors[(i, j)] * values[j]);
    assert!(difference(&scaled.times_transpose(&vectors), &mixed) < ROUNDING);
}
