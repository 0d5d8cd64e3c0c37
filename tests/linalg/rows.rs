use fretwear::linalg::{LinalgError, RowMatrix as Matrix, generalised_eigen};
use num_complex::Complex64;

/// Irregular entries from a multiplicative sequence.
fn entries(count: usize) -> Vec<f64> {
    let mut seed = 0.37_f64;
    (0..count)
        .map(|_| {
            seed = (seed * 997.0).fract();
            seed - 0.5
        })
        .collect()
}

#[test]
fn factors_solve_at_every_size_across_blocks() {
    for n in [1, 2, 5, 31, 32, 33, 64, 71] {
        let matrix = Matrix::from_rows(n, n, entries(n * n)).expect("fits");
        let factors = matrix.clone().factorize().expect("regular");
        let expected = entries(n);
        let mut found = matrix.apply(&expected);
        factors.solve(&mut found);
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-10, "{n}: {a} {b}");
        }
        let unit = matrix.times(&factors.inverse());
        for i in 0..n {
            for j in 0..n {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((unit.at(i, j) - expected).abs() < 1e-10, "{n} ({i}, {j})");
            }
        }
    }
}

#[test]
fn complex_factors_solve() {
    let n = 37;
    let parts = entries(2 * n * n);
    let values = parts
        .chunks(2)
        .map(|p| Complex64::new(p[0], p[1]))
        .collect();
    let matrix = Matrix::from_rows(n, n, values).expect("fits");
    let expected: Vec<Complex64> = entries(n)
        .iter()
        .map(|&v| Complex64::new(v, 1.0 - v))
        .collect();
    let mut found = matrix.apply(&expected);
    matrix.factorize().expect("regular").solve(&mut found);
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).norm() < 1e-10, "{a} {b}");
    }
}

#[test]
fn singular_matrices_are_refused() {
    let mut matrix =
        Matrix::from_rows(3, 3, vec![1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 1.0, 1.0, 1.0]).expect("fits");
    let error = matrix.clone().factorize().expect_err("rank 2");
    assert!(
        matches!(error, LinalgError::Singular { size: 3, .. }),
        "{error}"
    );
    matrix.set(1, 1, f64::NAN);
    assert!(matrix.factorize().is_err());
}

#[test]
fn eigenvectors_are_mass_normalised_and_right() {
    let n = 14;
    let square = |values: Vec<f64>, shift: f64| {
        let half = Matrix::from_rows(n, n, values).expect("fits");
        let mut whole = half.times(&half.transposed());
        for i in 0..n {
            whole.set(i, i, whole.at(i, i) + shift);
        }
        whole
    };
    let all = entries(2 * n * n);
    let (stiffness, mass) = (
        square(all[..n * n].to_vec(), 0.0),
        square(all[n * n..].to_vec(), 0.3),
    );
    let (values, vectors) = generalised_eigen(&stiffness, &mass).expect("positive");
    assert!(values.is_sorted());
    let (kv, mv) = (stiffness.times(&vectors), mass.times(&vectors));
    let gram = vectors.transposed().times(&mv);
    for i in 0..n {
        for j in 0..n {
            assert!((kv.at(i, j) - values[j] * mv.at(i, j)).abs() < 1e-11);
            let expected = if i == j { 1.0 } else { 0.0 };
            assert!((gram.at(i, j) - expected).abs() < 1e-11);
        }
    }
    assert!(generalised_eigen(&stiffness, &Matrix::zeros(n, n)).is_err());
}
