//! Tests of the doctor's closed forms on four grids: every error converges with its order, and the tolerances follow from the doctor's
//! grid.

use fretwear::doctor::closed_forms::{CASES, Measure, RESOLUTION, Resolution};

/// Grids from 26 × 20 to 208 × 160 cells.
const REFINEMENTS: [usize; 4] = [1, 2, 4, 8];

/// Offset of the closed form from a corner of the cells, in cells, by an additive recurrence. The edge of the contact cuts the cells at
/// random, and the root mean square error over the offsets has a clear order.
const PLACEMENTS: [(f64, f64); 6] = [
    (0.0, 0.0),
    (0.75, 0.57),
    (0.51, 0.14),
    (0.26, 0.71),
    (0.02, 0.28),
    (0.77, 0.85),
];

/// Quantity, smallest order, and largest relative error on the finest grid. The grid resolves edges of the contact to one cell, so fields
/// with a jump or a vertical slope at the edge converge with first order. Integrals converge with second order. The orders have a margin of
/// 0.15 (0.3 in one dimension, because six offsets average less), and the errors have a margin of 50 %. `dynamics::backbone` tests the
/// order of the Jenkins oscillator in its samples.
const EXPECTED: [(&str, f64, f64); 22] = [
    ("Hertz: contact radius", 0.85, 2.5e-3),
    ("Hertz: approach", 1.8, 1.4e-5),
    ("Hertz: peak pressure", 1.8, 3.1e-5),
    ("Hertz: pressure field", 0.85, 3.4e-3),
    ("Hertz: gap field", 1.75, 8.2e-5),
    ("Hertz: normal stiffness", 0.85, 3.0e-4),
    ("circular punch: normal stiffness", 0.85, 2.0e-3),
    ("circular punch: stiffness along x", 0.85, 2.0e-3),
    ("circular punch: stiffness in plane", 0.85, 2.0e-3),
    ("capped Hertz: contact radius", 0.85, 2.5e-3),
    ("capped Hertz: plateau radius", 0.8, 3.0e-3),
    ("capped Hertz: approach", 1.7, 1.4e-5),
    ("capped Hertz: pressure field", 0.85, 4.4e-3),
    ("Westergaard: area fraction", 0.5, 1.5e-2),
    ("Westergaard: mean gap", 1.7, 1.0e-4),
    ("Westergaard: pressure field", 0.7, 3.5e-3),
    ("Westergaard: gap field", 1.7, 1.0e-4),
    ("Cattaneo-Mindlin: force", 1.6, 4.0e-6),
    ("Cattaneo-Mindlin: stick radius", 0.8, 4.3e-3),
    ("Cattaneo-Mindlin: shear field", 0.85, 5.4e-3),
    ("Cattaneo-Mindlin: slip field", 1.75, 7.0e-5),
    ("Cattaneo-Mindlin: energy per cycle", 2.0, 2.0e-5),
];

/// Measures of a case on a grid, with root mean square errors over the offsets.
fn placed(case: usize, refinement: usize) -> Vec<Measure> {
    let solve = |placement| {
        let at = Resolution {
            refinement,
            placement,
        };
        CASES[case].1(at).unwrap_or_else(|error| panic!("{error}"))
    };
    let all = PLACEMENTS.map(solve);
    let mut measures = all[0].clone();
    for (k, measure) in measures.iter_mut().enumerate() {
        let squares = all.iter().map(|placed| placed[k].error.powi(2));
        measure.error = (squares.sum::<f64>() / PLACEMENTS.len() as f64).sqrt();
    }
    measures
}

#[test]
fn every_quantity_converges_with_its_order_and_tolerances_are_twice_its_error() {
    let mut expected = EXPECTED.iter();
    let mut wrong = Vec::new();
    for case in (0..CASES.len()).filter(|case| CASES[*case].0 != "Jenkins oscillator") {
        let grids = REFINEMENTS.map(|refinement| placed(case, refinement));
        for k in 0..grids[0].len() {
            let name = grids[0][k].name;
            let errors = [0, 1, 2, 3].map(|grid: usize| grids[grid][k].error);
            // The order is the least-squares slope of log error over log cell width; each grid halves the cell width.
            let logs = errors.map(f64::log2);
            let order = 0.3 * (logs[0] - logs[3]) + 0.1 * (logs[1] - logs[2]);
            println!("{name}: {errors:?}, order {order:.2}");
            let (expected, least_order, largest_error) = *expected.next().expect("an expectation");
            assert_eq!(name, expected);
            if !(order > least_order && errors[3] < largest_error) {
                wrong.push(format!("{name}: {errors:?}, order {order:.2}"));
            }
            let of_doctor = REFINEMENTS.iter().position(|k| *k == RESOLUTION.refinement);
            let error = errors[of_doctor.expect("one of the grids")];
            if let Some(tolerance) = grids[0][k].tolerance
                && !(1.9..2.1).contains(&(tolerance / error))
            {
                wrong.push(format!("{name}: tolerance {tolerance:e} for {error:.3e}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(expected.next(), None);
}
