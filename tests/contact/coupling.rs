//! Tests of the coupling of pressure and shear in K, by point forces on two separate bodies in their own axes.

use std::f64::consts::{PI, TAU};

use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair, coupling_integrals};
use fretwear::grid::Grid;

use super::{PAIR, STEEL};
use crate::quadrature::integrate_rectangle;

/// The even number of cells along x and the odd number along y cover both kinds of highest wave number.
const GRID: Grid = Grid {
    nx: 12,
    ny: 7,
    dx: 1.3e-4,
    dy: 0.8e-4,
};

/// Rounding error of the closed form, by cancellation of the corner terms at a distance of 16 cells.
const CLOSED_FORM: f64 = 1e-12;

/// Rounding error of transforms of a few hundred points.
const ROUNDING: f64 = 1e-13;

/// Surface displacement (x, y, z) of a half space under a point force at the origin, with z into the half space: Johnson, Contact
/// Mechanics, eq. 3.19 and 3.75 at z = 0, reduced to the coupling terms with 1 − 2ν.
fn point_force(body: Elastic, force: [f64; 3], x: f64, y: f64) -> [f64; 3] {
    let r = x.hypot(y);
    let factor = (1.0 - 2.0 * body.poisson_ratio) / (4.0 * PI * body.shear_modulus() * r * r);
    [
        -factor * force[2] * x,
        -factor * force[2] * y,
        factor * (force[0] * x + force[1] * y),
    ]
}

/// Surface displacement (x, y, z) under a point force at the origin, with z upwards. The upper body fills z > 0, and the lower body is
/// rotated about x.
fn body(pair: Pair, upper: bool, force: [f64; 3], x: f64, y: f64) -> [f64; 3] {
    if upper {
        point_force(pair.upper, force, x, y)
    } else {
        let [ux, uy, uz] = point_force(pair.lower, [force[0], -force[1], -force[2]], x, -y);
        [ux, -uy, -uz]
    }
}

/// Opening of the gap and loss of slip along x and y under a point force p, q_x, q_y between the bodies.
fn opening_and_lag(pair: Pair, traction: [f64; 3], x: f64, y: f64) -> [f64; 3] {
    let [p, qx, qy] = traction;
    let upper = body(pair, true, [-qx, -qy, p], x, y);
    let lower = body(pair, false, [qx, qy, -p], x, y);
    [
        upper[2] - lower[2],
        lower[0] - upper[0],
        lower[1] - upper[1],
    ]
}

/// Coupling terms of K between two cells: opening of the gap and loss of slip per unit traction, by quadrature of point forces. In the
/// loaded cell, the terms cancel.
pub fn coupling_block(pair: Pair, grid: Grid, at: usize, from: usize) -> [[f64; 3]; 3] {
    let mut block = [[0.0; 3]; 3];
    if at == from {
        return block;
    }
    let ((i, j), (k, l)) = (grid.cell(at), grid.cell(from));
    let centre = (
        (i as f64 - k as f64) * grid.dx,
        (j as f64 - l as f64) * grid.dy,
    );
    for kind in 0..3 {
        let mut traction = [0.0; 3];
        traction[kind] = 1.0;
        // The force acts on all points of its cell, so the distance varies over a cell around the offset.
        for pick in [[0, 1], [1, 2]] {
            let found = integrate_rectangle(centre, (grid.dx, grid.dy), 4, |x, y| {
                let w = opening_and_lag(pair, traction, x, y);
                [w[pick[0]], w[pick[1]]]
            });
            for (row, value) in pick.into_iter().zip(found) {
                block[row][kind] = value;
            }
        }
    }
    block
}

fn field(seed: f64) -> Vec<f64> {
    (0..GRID.len())
        .map(|k| 1e8 * (seed + 1.7 * k as f64 + 0.31 * (k * k) as f64).sin())
        .collect()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    let error = super::relative_l2(found, expected);
    assert!(error < tolerance, "{error:e}");
}

#[test]
fn integrals_are_their_quadratures() {
    let (dx, dy) = (GRID.dx, GRID.dy);
    let offsets = [
        (1, 0),
        (0, 1),
        (1, 1),
        (-2, 1),
        (3, -5),
        (11, 2),
        (-15, -4),
        (16, 1),
        (2, 27),
        (250, 9),
    ];
    for (i, j) in offsets {
        let (x, y) = (i as f64 * dx, j as f64 * dy);
        let found = coupling_integrals(x, y, dx, dy);
        let expected = integrate_rectangle((x, y), (dx, dy), 16, |x, y| {
            let square = x * x + y * y;
            [x / square, y / square]
        });
        for axis in 0..2 {
            let error = (found[axis] - expected[axis]).abs() * x.hypot(y) / (dx * dy);
            assert!(error < CLOSED_FORM, "({i}, {j}) along {axis}: {error:e}");
        }
    }
}

#[test]
fn integrals_off_the_lattice_are_the_difference_of_their_parts() {
    // For a point inside the cell, parts at equal distance on both sides cancel, and a strip on the far side remains.
    let (dx, dy) = (1.0, 0.7);
    let shift = 0.2;
    let [found, across] = coupling_integrals(shift, 0.0, dx, dy);
    let [strip, _] = integrate_rectangle((0.5 * dx, 0.0), (2.0 * shift, dy), 16, |x, y| {
        [x / (x * x + y * y), 0.0]
    });
    assert!((found - strip).abs() < CLOSED_FORM, "{found} {strip}");
    assert_eq!(across, 0.0);
    assert_eq!(coupling_integrals(0.0, 0.0, dx, dy), [0.0, 0.0]);
    // For a point on an edge, only the nearer half of the cell contributes; the integral uses the angle about the point.
    let [edge, _] = coupling_integrals(0.5 * dx, 0.0, dx, dy);
    let corner = (0.5 * dy).atan2(dx);
    let expected = crate::quadrature::integrate(-corner, corner, 8, |_| dx)
        + 2.0 * crate::quadrature::integrate(corner, 0.5 * PI, 8, |t| t.cos() * 0.5 * dy / t.sin());
    assert!((edge - expected).abs() < CLOSED_FORM, "{edge} {expected}");
}

#[test]
fn convolution_is_the_sum_over_two_bodies_in_their_own_axes() {
    let traction = [field(0.2), field(1.1), field(2.3)];
    let mut expected = vec![vec![0.0; GRID.len()]; 3];
    for at in 0..GRID.len() {
        for from in 0..GRID.len() {
            let block = coupling_block(PAIR, GRID, at, from);
            for row in 0..3 {
                for kind in 0..3 {
                    expected[row][at] += block[row][kind] * traction[kind][from];
                }
            }
        }
    }
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
    let shear = traction[1..].to_vec();
    let mut opening = vec![0.0; GRID.len()];
    half_space.normal_of_shear(&shear, &mut opening);
    // The accuracy of the quadrature beside the cell is 1e-10.
    close(&opening, &expected[0], 1e-9);
    let mut lag = vec![vec![0.0; GRID.len()]; 2];
    half_space.shear_of_normal(&traction[0], &mut lag);
    close(&lag[0], &expected[1], 1e-9);
    close(&lag[1], &expected[2], 1e-9);

    // Along one axis, the convolutions apply the same kernels and need two transforms each.
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
    let mut one = vec![vec![0.0; GRID.len()]];
    half_space.shear_of_normal(&traction[0], &mut one);
    close(&one[0], &lag[0], ROUNDING);
    half_space.normal_of_shear(&shear[..1].to_vec(), &mut opening);
    assert_eq!(half_space.take_pairs(), 2.0);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (work, back) = (dot(&opening, &traction[0]), dot(&one[0], &shear[0]));
    assert!((work - back).abs() < 1e-10 * work.abs());
}

#[test]
fn work_of_one_traction_on_the_other_is_mutual() {
    let (pressure, shear) = (field(0.4), vec![field(1.9), field(2.8)]);
    for boundary in [Boundary::Free, Boundary::Periodic] {
        let mut half_space = HalfSpace::new(GRID, PAIR, boundary);
        let mut opening = vec![0.0; GRID.len()];
        let mut lag = vec![vec![0.0; GRID.len()]; 2];
        half_space.normal_of_shear(&shear, &mut opening);
        half_space.shear_of_normal(&pressure, &mut lag);
        assert_eq!(half_space.take_pairs(), 3.0);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let there = dot(&opening, &pressure);
        let back = dot(&lag[0], &shear[0]) + dot(&lag[1], &shear[1]);
        assert!(
            (there - back).abs() < 1e-11 * there.abs(),
            "{there:e} {back:e}"
        );
    }
}

#[test]
fn a_periodic_wave_of_pressure_draws_the_surfaces_along() {
    // Under p cos kx, the surface of each half space moves by −(1 − 2ν)/(2Gk) p sin kx along x (plane strain). The loss of slip is the
    // difference between the bodies.
    let (m, n) = (2.0, 1.0);
    let [lx, ly] = GRID.size();
    let (kx, ky) = (TAU * m / lx, TAU * n / ly);
    let k = kx.hypot(ky);
    let phase = |c: usize| {
        let (x, y) = GRID.centre(GRID.cell(c).0, GRID.cell(c).1);
        kx * x + ky * y + 0.3
    };
    let pressure: Vec<f64> = (0..GRID.len()).map(|c| 1e8 * phase(c).cos()).collect();
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Periodic);
    let mut lag = vec![vec![0.0; GRID.len()]; 2];
    half_space.shear_of_normal(&pressure, &mut lag);
    let c = |m: Elastic| (1.0 - 2.0 * m.poisson_ratio) / (2.0 * m.shear_modulus());
    let size = 1e8 * (c(PAIR.lower) - c(PAIR.upper)) / k;
    for (axis, part) in [kx / k, ky / k].into_iter().enumerate() {
        let expected: Vec<f64> = (0..GRID.len())
            .map(|c| -size * part * phase(c).sin())
            .collect();
        close(&lag[axis], &expected, 1e-12);
    }
    // The highest wave number along x has no sign, so its coupling is zero.
    let highest: Vec<f64> = (0..GRID.len())
        .map(|c| {
            if GRID.cell(c).0.is_multiple_of(2) {
                1e8
            } else {
                -1e8
            }
        })
        .collect();
    half_space.shear_of_normal(&highest, &mut lag);
    assert!(lag.iter().flatten().all(|w| w.abs() < 1e-12 * size.abs()));
}

#[test]
fn uniform_pressure_on_a_disc_shrinks_the_more_compliant_surface() {
    // The radial displacement is u_r = −(1 − 2ν)(1 + ν)/(2E) p r inside the loaded circle, and decreases outside by a²/r² (Johnson, eq.
    // 3.29).
    let grid = Grid::over([2.6e-3, 2.2e-3], [91, 83]);
    let lower = Elastic {
        youngs_modulus: 70e9,
        poisson_ratio: 0.25,
    };
    let rigid = Elastic {
        youngs_modulus: 1e22,
        poisson_ratio: 0.3,
    };
    let (radius, p) = (0.7e-3, 1e8);
    let at = |c: usize| grid.centre(grid.cell(c).0, grid.cell(c).1);
    let pressure: Vec<f64> = (0..grid.len())
        .map(|c| {
            if at(c).0.hypot(at(c).1) < radius {
                p
            } else {
                0.0
            }
        })
        .collect();
    let area = pressure.iter().filter(|p| **p > 0.0).count() as f64 * grid.cell_area();
    let (nu, young) = (lower.poisson_ratio, lower.youngs_modulus);
    let slope = (1.0 - 2.0 * nu) * (1.0 + nu) / (2.0 * young) * p;
    for (pair, sign) in [
        (
            Pair {
                lower,
                upper: rigid,
            },
            -1.0,
        ),
        (
            Pair {
                lower: rigid,
                upper: lower,
            },
            1.0,
        ),
    ] {
        let mut half_space = HalfSpace::new(grid, pair, Boundary::Free);
        let mut lag = vec![vec![0.0; grid.len()]; 2];
        half_space.shear_of_normal(&pressure, &mut lag);
        let mut worst = 0.0f64;
        for c in 0..grid.len() {
            let (x, y) = at(c);
            let r = x.hypot(y);
            if (r - radius).abs() < 3.0 * grid.dx {
                continue;
            }
            let reach = (area / PI / (r * r)).min(1.0);
            for (w, x) in [(lag[0][c], x), (lag[1][c], y)] {
                // The loss of slip is the displacement of the lower surface minus the displacement of the upper surface.
                worst = worst.max((w - sign * slope * reach * x).abs() / (slope * radius));
            }
        }
        // The rim is a staircase. The error is of the order of a cell over the distance from the rim.
        assert!(worst < 1e-2, "{worst:e}");
    }
}

#[test]
fn alike_bodies_have_no_coupling() {
    let rubber = |youngs_modulus| Elastic {
        youngs_modulus,
        poisson_ratio: 0.5,
    };
    let incompressible = Pair {
        lower: rubber(1e6),
        upper: rubber(3e9),
    };
    for pair in [Pair::same(STEEL), incompressible] {
        assert!(!pair.is_coupled());
        let mut half_space = HalfSpace::new(GRID, pair, Boundary::Free);
        let mut opening = vec![1.0; GRID.len()];
        let mut lag = vec![vec![1.0; GRID.len()]; 2];
        half_space.normal_of_shear(&vec![field(0.1), field(0.2)], &mut opening);
        half_space.shear_of_normal(&field(0.3), &mut lag);
        assert!(
            opening
                .iter()
                .chain(lag.iter().flatten())
                .all(|w| *w == 0.0)
        );
        assert_eq!(half_space.take_pairs(), 0.0);
    }
}
