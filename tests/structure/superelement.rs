//! The reduced structure as matrices, against the whole structure.

use std::f64::consts::TAU;

use fretwear::dynamics::reduced::reduction_error;
use fretwear::linalg::Matrix;
use fretwear::structure::modes::ModeOptions;
use fretwear::structure::reduction::{ReducedStructure, reduce};
use fretwear::structure::superelement::Superelement;

use super::reduction::{coarse, direct};

/// Largest error of the superelement's flexibility from the truncated series, relative to the largest entry: a few times the estimate of
/// the model.
const OFF: f64 = 1e-3;
/// Requested error of a reduction, and the largest factor at a real frequency. At a real frequency, the terms of the series add up, and a
/// resonance may be near.
const RIGHT: f64 = 1e-3;
const AT_REAL: f64 = 10.0;

fn reduced(modes: usize) -> ReducedStructure {
    let (system, ports) = coarse();
    reduce(&system, ports, &ModeOptions::new(modes)).expect("a structure")
}

/// (K + sM)⁻¹ between the ports.
fn flexibility(of: &Superelement, shift: f64, ports: usize) -> Matrix {
    let mut shifted = of.stiffness.clone();
    shifted.add(shift, &of.mass);
    let factor = shifted.cholesky().expect("positive definite");
    let mut columns = Matrix::from_fn(shifted.rows(), ports, |i, j| f64::from(u8::from(i == j)));
    factor.solve_lower(&mut columns);
    columns.transpose_times(&columns)
}

fn off(found: &Matrix, expected: &Matrix) -> f64 {
    let largest = |m: &Matrix| m.as_slice().iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    let mut difference = found.clone();
    difference.add(-1.0, expected);
    largest(&difference) / largest(expected)
}

#[test]
fn a_superelement_answers_at_its_ports_as_the_structure_does() {
    let reduced = reduced(30);
    let ports = reduced.ports.len();
    let superelement = Superelement::new(&reduced).expect("matrices");
    let checked = reduced.reference.as_ref().expect("a check");
    let found = flexibility(&superelement, checked.shift, ports);
    let off = off(&found, &checked.flexibility);
    assert!(off < OFF, "{off:e}");
    // The lowest frequencies are frequencies of the structure: K − (ω² − ε) M and K − (ω² + ε) M differ by one negative eigenvalue.
    let count = |square: f64| {
        let mut shifted = superelement.stiffness.clone();
        shifted.add(-square, &superelement.mass);
        let (values, _) = shifted.symmetric_eigen().expect("eigenvalues");
        values.iter().filter(|value| **value < 0.0).count()
    };
    for mode in [0, 3, 9] {
        let square = reduced.omega[mode].powi(2);
        assert_eq!(count(1.0001 * square), 6 + mode + 1);
        assert_eq!(count(0.9999 * square), 6 + mode);
    }
}

/// More modes raise the frequency up to which a reduction is accurate to 1e-3. The frequency follows from the self-check with a quadratic
/// law. A direct solve at a real frequency confirms the accuracy.
#[test]
fn a_reduction_knows_its_error() {
    let mut before = 0.0;
    for modes in [10, 30, 60] {
        let reduced = reduced(modes);
        let error = reduction_error(&reduced)
            .expect("a model")
            .expect("a check");
        let checked = reduced.reference.as_ref().expect("a check").frequency();
        let right = checked * (RIGHT / error).sqrt();
        assert!(
            right > 1.2 * before,
            "{modes} modes: {right} Hz after {before} Hz"
        );
        before = right;
        // A frequency between the resonances.
        let omega = TAU * 0.93 * right;
        let (system, ports) = coarse();
        let columns = [0, 1, 2, 90, 91, 92];
        let expected = direct(&system, &ports, omega, &columns);
        let found = reduced.receptance(omega, 0.0).0;
        let found = Matrix::from_fn(ports.len(), columns.len(), |i, c| found[(i, columns[c])]);
        let off = off(&found, &expected);
        println!(
            "{modes} modes: {error:.1e} at {checked:.0} Hz; {off:.1e} at {:.0} Hz",
            0.93 * right
        );
        assert!(
            off < AT_REAL * RIGHT,
            "{modes} modes: {off:e} at {right} Hz"
        );
    }
    // With half of the residual, the structure differs. The check must detect the difference.
    let mut without = reduced(30);
    let half = |i, j| 0.5 * without.residual[(i, j)];
    without.residual = Matrix::from_fn(without.ports.len(), without.ports.len(), half);
    let [wrong, right] =
        [without, reduced(30)].map(|of| reduction_error(&of).expect("a model").expect("a check"));
    assert!(wrong > 10.0 * right, "{wrong:e} {right:e}");
}
