use std::f64::consts::PI;

use fretwear::contact::{CellIntegrals, cell_integrals};

use crate::quadrature::{integrate, integrate_rectangle};

const DX: f64 = 1.3e-4;
const DY: f64 = 0.8e-4;

/// Rounding error of the closed form, by cancellation of sixteen corner terms at a distance of 16 cells: (r/cell)² · 1e-16 per term.
const CLOSED_FORM: f64 = 1e-12;

/// The integrands are 1/r, x²/r³, y²/r³ and xy/r³.
fn integrands(x: f64, y: f64) -> [f64; 4] {
    let r = x.hypot(y);
    [
        1.0 / r,
        x * x / r.powi(3),
        y * y / r.powi(3),
        x * y / r.powi(3),
    ]
}

fn fields(cell: CellIntegrals) -> [f64; 4] {
    [cell.inverse, cell.xx, cell.yy, cell.xy]
}

/// Polar quadrature about the centre of the cell: the integrands are f(θ)/r, so ∫ = ∫ f(θ) R(θ) dθ.
fn polar(dx: f64, dy: f64) -> [f64; 4] {
    let corner = dy.atan2(dx);
    let breaks = [-corner, corner, PI - corner, PI + corner, 2.0 * PI - corner];
    let edge = |theta: f64| (0.5 * dx / theta.cos().abs()).min(0.5 * dy / theta.sin().abs());
    std::array::from_fn(|which| {
        breaks
            .windows(2)
            .map(|side| {
                integrate(side[0], side[1], 8, |theta| {
                    integrands(theta.cos(), theta.sin())[which] * edge(theta)
                })
            })
            .sum()
    })
}

#[test]
fn own_cell_is_its_polar_integral() {
    for (dx, dy) in [(DX, DY), (DY, DX), (1.0, 7.0)] {
        let (found, expected) = (fields(cell_integrals(0.0, 0.0, dx, dy)), polar(dx, dy));
        for which in 0..3 {
            assert!(
                (found[which] / expected[which] - 1.0).abs() < CLOSED_FORM,
                "{found:?} {expected:?}"
            );
        }
        assert_eq!(found[3], 0.0);
    }
}

#[test]
fn other_cells_are_their_tensor_integrals() {
    let offsets = [
        (1, 0),
        (0, 1),
        (1, 1),
        (-2, 1),
        (3, -5),
        (7, 7),
        (11, 2),
        (-15, -4),
        (16, 1),
        (2, 27),
        (40, 33),
        (250, 9),
    ];
    for (i, j) in offsets {
        let (x, y) = (i as f64 * DX, j as f64 * DY);
        let found = fields(cell_integrals(x, y, DX, DY));
        let expected = integrate_rectangle((x, y), (DX, DY), 16, integrands);
        for which in 0..4 {
            let error = (found[which] - expected[which]).abs() / expected[0];
            assert!(
                error < CLOSED_FORM,
                "integral {which} at ({i}, {j}): {:e} against {:e}",
                found[which],
                expected[which]
            );
        }
    }
}

#[test]
fn offsets_off_the_lattice_and_shared_edges_hold() {
    // For a point on an edge, on a corner or inside the cell, the integral is the sum of rectangles with the point on a corner.
    for (x, y) in [
        (0.5 * DX, 0.0),
        (0.5 * DX, 0.5 * DY),
        (0.2 * DX, -0.3 * DY),
        (0.0, 0.5 * DY),
    ] {
        let found = fields(cell_integrals(x, y, DX, DY));
        let mut expected = [0.0; 4];
        for (sx, wx) in [(1.0, 0.5 * DX + x), (-1.0, 0.5 * DX - x)] {
            for (sy, wy) in [(1.0, 0.5 * DY + y), (-1.0, 0.5 * DY - y)] {
                if wx > 0.0 && wy > 0.0 {
                    let quarter = corner_rectangle(wx, wy);
                    for which in 0..4 {
                        expected[which] += quarter[which] * if which == 3 { sx * sy } else { 1.0 };
                    }
                }
            }
        }
        for which in 0..4 {
            let error = (found[which] - expected[which]).abs() / expected[0];
            assert!(
                error < CLOSED_FORM,
                "integral {which} at ({x:e}, {y:e}): {found:?} against {expected:?}"
            );
        }
    }
}

/// Integrals over \[0, wx\] × \[0, wy\] by polar quadrature.
fn corner_rectangle(wx: f64, wy: f64) -> [f64; 4] {
    let corner = wy.atan2(wx);
    std::array::from_fn(|which| {
        integrate(0.0, corner, 8, |t| {
            integrands(t.cos(), t.sin())[which] * wx / t.cos()
        }) + integrate(corner, 0.5 * PI, 8, |t| {
            integrands(t.cos(), t.sin())[which] * wy / t.sin()
        })
    })
}

#[test]
fn integrals_have_the_symmetries_of_the_kernel() {
    for (i, j) in [(1, 2), (9, 4), (14, 30)] {
        let (x, y) = (i as f64 * DX, j as f64 * DY);
        let cell = cell_integrals(x, y, DX, DY);
        let [inverse, xx, yy, xy] = fields(cell);
        for (sx, sy) in [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
            let [m_inverse, m_xx, m_yy, m_xy] = fields(cell_integrals(sx * x, sy * y, DX, DY));
            for (mirrored, plain) in [
                (m_inverse, inverse),
                (m_xx, xx),
                (m_yy, yy),
                (m_xy, sx * sy * xy),
            ] {
                assert!((mirrored - plain).abs() < CLOSED_FORM * inverse);
            }
        }
        let swapped = fields(cell_integrals(y, x, DY, DX));
        for (a, b) in swapped.iter().zip([inverse, yy, xx, xy]) {
            assert!((a - b).abs() < CLOSED_FORM * inverse);
        }
        assert!(
            (xx + yy - inverse).abs() < CLOSED_FORM * inverse,
            "x² + y² = r²"
        );
    }
}
