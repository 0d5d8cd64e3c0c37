//! The table of `fretwear validate`: errors and orders that must not get worse.

use fretwear::validate::{self, Row, fitted_order};

/// Case, quantity, least order, largest relative error on the finest grid. Edges of contact are known to a cell, and what
/// jumps or has a vertical slope there converges with the first order; integrals converge with the second. Orders have 0.15
/// to spare (0.3 in one dimension, where six placements average less), errors half of themselves.
const EXPECTED: &[(&str, &str, f64, f64)] = &[
    ("Hertz", "contact radius", 0.85, 2.5e-3),
    ("Hertz", "approach", 1.8, 1.4e-5),
    ("Hertz", "peak pressure", 1.8, 3.1e-5),
    ("Hertz", "pressure field", 0.85, 3.4e-3),
    ("Hertz", "gap field", 1.75, 8.2e-5),
    ("Hertz", "normal stiffness", 0.85, 3.0e-4),
    ("circular punch", "normal stiffness", 0.85, 2.0e-3),
    (
        "circular punch",
        "tangential stiffness, along x",
        0.85,
        2.0e-3,
    ),
    (
        "circular punch",
        "tangential stiffness, in plane",
        0.85,
        2.0e-3,
    ),
    ("capped Hertz", "contact radius", 0.85, 2.5e-3),
    ("capped Hertz", "plateau radius", 0.8, 3.0e-3),
    ("capped Hertz", "approach", 1.7, 1.4e-5),
    ("capped Hertz", "pressure field", 0.85, 4.4e-3),
    ("Westergaard", "area fraction", 0.5, 1.5e-2),
    ("Westergaard", "mean gap", 1.7, 1.0e-4),
    ("Westergaard", "pressure field", 0.7, 3.5e-3),
    ("Westergaard", "gap field", 1.7, 1.0e-4),
    ("Cattaneo-Mindlin", "force", 1.6, 4.0e-6),
    ("Cattaneo-Mindlin", "stick radius", 0.8, 4.3e-3),
    ("Cattaneo-Mindlin", "shear field", 0.85, 5.4e-3),
    ("Cattaneo-Mindlin", "slip field", 1.75, 7.0e-5),
    ("Cattaneo-Mindlin", "energy per cycle", 2.0, 2.0e-5),
    ("Jenkins oscillator", "force", 1.6, 1e-4),
    ("Jenkins oscillator", "frequency", 1.6, 5e-6),
    ("Jenkins oscillator", "damping ratio", 1.6, 1e-4),
];

#[test]
fn every_quantity_converges_with_its_order() {
    let rows = validate::run().unwrap();
    let mut wrong = Vec::new();
    for &(case, quantity, least_order, largest_error) in EXPECTED {
        let finest = rows
            .iter()
            .rfind(|row| row.case == case && row.quantity == quantity)
            .expect(quantity);
        if !(finest.relative_error < largest_error
            && finest.order.is_some_and(|order| order > least_order))
        {
            wrong.push(format!(
                "{case}, {quantity}: error {:.2e}, order {:?}",
                finest.relative_error, finest.order
            ));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");

    // The load is a constraint of the solve and no result of the grid: rounding, and so no order.
    let load: Vec<&Row> = rows.iter().filter(|row| row.quantity == "load").collect();
    assert!(
        load.len() == 4
            && load
                .iter()
                .all(|row| row.relative_error < 1e-10 && row.order.is_none())
    );
    assert_eq!(
        rows.len(),
        4 * (EXPECTED.len() + 1),
        "a quantity without an expectation"
    );
    assert!(
        rows.iter()
            .all(|row| row.grid[0] != row.grid[1] && row.exact > 0.0)
    );
}

#[test]
fn a_power_law_has_its_exponent_for_an_order() {
    let widths = [0.8, 0.4, 0.2, 0.05];
    let errors = widths.map(|h: f64| 3.0 * h.powf(1.7));
    assert!((fitted_order(&widths, &errors).unwrap() - 1.7).abs() < 1e-12);
    assert_eq!(fitted_order(&widths[..1], &errors), None);
    assert_eq!(fitted_order(&widths, &[1.0, 0.0, 1.0, 1.0]), None);
    assert_eq!(fitted_order(&[0.5, 0.5], &[1.0, 2.0]), None);
}
