use std::f64::consts::TAU;

use fretwear::contact::{Boundary, HalfSpace};
use fretwear::grid::{Grid, Patch};

use super::{PAIR, influence, relative_l2};

/// The even number of cells along x and the odd number along y cover both kinds of highest wave number.
const GRID: Grid = Grid {
    nx: 12,
    ny: 7,
    dx: 1.3e-4,
    dy: 0.8e-4,
};

/// Rounding error of transforms of a few hundred points.
const ROUNDING: f64 = 1e-13;

/// A field without symmetry.
fn field(seed: f64) -> Vec<f64> {
    (0..GRID.len())
        .map(|k| 1e8 * (seed + 1.7 * k as f64 + 0.31 * (k * k) as f64).sin())
        .collect()
}

/// Sum of a compliance term in G and ν over both bodies.
fn both(term: impl Fn(f64, f64) -> f64) -> f64 {
    [PAIR.lower, PAIR.upper]
        .iter()
        .map(|body| term(body.shear_modulus(), body.poisson_ratio))
        .sum()
}

/// Displacement u = Σ K p of a free half space, by a sum over all pairs of cells. The order of the kernels is zz, xx, yy, xy.
fn direct_free(which: usize, traction: &[f64]) -> Vec<f64> {
    let (row, column) = [(0, 0), (1, 1), (2, 2), (1, 2)][which];
    let at = |at: usize| {
        let terms = (0..GRID.len())
            .map(|from| influence(PAIR, GRID, at, from)[row][column] * traction[from]);
        terms.sum()
    };
    (0..GRID.len()).map(at).collect()
}

/// Displacement u = Σ K p of a periodic half space, by a sum over wave numbers. The order of the kernels is zz, xx, yy, xy.
fn direct_periodic(which: usize, traction: &[f64]) -> Vec<f64> {
    let mut displacement = vec![0.0; GRID.len()];
    let signed = |m: usize, n: usize| {
        if 2 * m > n {
            m as f64 - n as f64
        } else {
            m as f64
        }
    };
    for m in 0..GRID.nx {
        for n in 0..GRID.ny {
            if m == 0 && n == 0 {
                continue;
            }
            let (kx, ky) = (
                TAU * signed(m, GRID.nx) / GRID.size()[0],
                TAU * signed(n, GRID.ny) / GRID.size()[1],
            );
            let k = kx.hypot(ky);
            // A shear wave displaces the surface by (1 − ν)/Gk along its wave vector and by 1/Gk across its wave vector.
            let (along, across) = (
                both(|g, nu| (1.0 - nu) / (g * k)),
                both(|g, _| 1.0 / (g * k)),
            );
            let (cx, cy) = (kx / k, ky / k);
            let symbol = match which {
                0 => both(|g, nu| (1.0 - nu) / (g * k)),
                1 => along * cx * cx + across * cy * cy,
                2 => along * cy * cy + across * cx * cx,
                // The highest wave number of an even length has no sign, so the odd kernel is zero there.
                _ if 2 * m == GRID.nx => 0.0,
                _ => (along - across) * cx * cy,
            };
            let phase = |index: usize| {
                let (i, j) = GRID.cell(index);
                TAU * (m as f64 * i as f64 / GRID.nx as f64 + n as f64 * j as f64 / GRID.ny as f64)
            };
            let (mut re, mut im) = (0.0, 0.0);
            for (index, t) in traction.iter().enumerate() {
                re += t * phase(index).cos();
                im -= t * phase(index).sin();
            }
            for (index, u) in displacement.iter_mut().enumerate() {
                *u += symbol * (re * phase(index).cos() - im * phase(index).sin())
                    / GRID.len() as f64;
            }
        }
    }
    displacement
}

fn compare(boundary: Boundary, direct: impl Fn(usize, &[f64]) -> Vec<f64>) {
    let mut half_space = HalfSpace::new(GRID, PAIR, boundary);
    let (x, y) = (field(0.4), field(2.9));
    let mut found = vec![0.0; GRID.len()];
    half_space.normal(&x, &mut found);
    assert!(relative_l2(&found, &direct(0, &x)) < ROUNDING, "normal");
    half_space.shear_x(&x, &mut found);
    assert!(
        relative_l2(&found, &direct(1, &x)) < ROUNDING,
        "shear along x"
    );
    let (mut ux, mut uy) = (vec![0.0; GRID.len()], vec![0.0; GRID.len()]);
    half_space.shear([&x, &y], [&mut ux, &mut uy]);
    let sum =
        |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> { a.iter().zip(&b).map(|(a, b)| a + b).collect() };
    assert!(
        relative_l2(&ux, &sum(direct(1, &x), direct(3, &y))) < ROUNDING,
        "u_x"
    );
    assert!(
        relative_l2(&uy, &sum(direct(3, &x), direct(2, &y))) < ROUNDING,
        "u_y"
    );
    // The coupling between x and y is small, so a separate comparison is necessary.
    let zero = vec![0.0; GRID.len()];
    half_space.shear([&x, &zero], [&mut ux, &mut uy]);
    assert!(relative_l2(&uy, &direct(3, &x)) < ROUNDING, "u_y from q_x");
}

#[test]
fn free_convolution_is_the_direct_sum() {
    compare(Boundary::Free, direct_free);
}

#[test]
fn periodic_convolution_is_the_sum_over_waves() {
    compare(Boundary::Periodic, direct_periodic);
}

#[test]
fn compliance_is_symmetric_and_positive() {
    for boundary in [Boundary::Free, Boundary::Periodic] {
        let mut half_space = HalfSpace::new(GRID, PAIR, boundary);
        let (a, b) = ([field(0.4), field(1.9)], [field(5.2), field(3.3)]);
        let mut apply = |q: &[Vec<f64>; 2]| {
            let mut u = [vec![0.0; GRID.len()], vec![0.0; GRID.len()]];
            let [ux, uy] = &mut u;
            half_space.shear([&q[0], &q[1]], [ux, uy]);
            u
        };
        let dot = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| -> f64 {
            a.iter()
                .flatten()
                .zip(b.iter().flatten())
                .map(|(a, b)| a * b)
                .sum()
        };
        let (ka, kb) = (apply(&a), apply(&b));
        let size = (dot(&a, &ka) * dot(&b, &kb)).sqrt();
        assert!(dot(&a, &ka) > 0.0 && dot(&b, &kb) > 0.0);
        assert!(
            (dot(&a, &kb) - dot(&b, &ka)).abs() < ROUNDING * size,
            "{boundary:?}"
        );
    }
}

#[test]
fn preconditioner_inverts_the_periodic_compliance() {
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Periodic);
    let mut pressure = field(0.7);
    let mean = pressure.iter().sum::<f64>() / GRID.len() as f64;
    pressure.iter_mut().for_each(|p| *p -= mean);
    let (mut displacement, mut back) = (vec![0.0; GRID.len()], vec![0.0; GRID.len()]);
    half_space.normal(&pressure, &mut displacement);
    half_space.normal_inverse(&displacement, &mut back);
    assert!(relative_l2(&back, &pressure) < ROUNDING);
}

#[test]
fn displacement_far_away_is_that_of_a_point_force() {
    let grid = Grid {
        nx: 40,
        ny: 3,
        dx: 1.1e-4,
        dy: 0.7e-4,
    };
    let mut half_space = HalfSpace::new(Patch::full(grid).grid, PAIR, Boundary::Free);
    let mut pressure = vec![0.0; grid.len()];
    pressure[grid.index(0, 1)] = 1e6;
    let mut displacement = vec![0.0; grid.len()];
    half_space.normal(&pressure, &mut displacement);
    let force = 1e6 * grid.cell_area();
    for i in [10, 39] {
        let r = i as f64 * grid.dx;
        let expected = force * both(|g, nu| (1.0 - nu) / (TAU * g)) / r;
        // The first correction for a rectangle is of order (cell/r)²/24.
        let tolerance = 1.0 / (10.0 * (i * i) as f64);
        assert!((displacement[grid.index(i, 1)] / expected - 1.0).abs() < tolerance);
    }
}

/// Threads process rows in pairs and columns in blocks. The number of threads does not change the result.
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let sizes = [(12, 7), (1, 9), (2, 1), (17, 16), (30, 41)];
    for (boundary, (nx, ny)) in [Boundary::Free, Boundary::Periodic]
        .into_iter()
        .flat_map(|boundary| sizes.map(|size| (boundary, size)))
    {
        let grid = Grid { nx, ny, ..GRID };
        let traction = |seed: f64| -> Vec<f64> {
            (0..grid.len())
                .map(|k| (seed + 1.7 * k as f64).sin())
                .collect()
        };
        let (a, b) = (traction(0.3), traction(1.1));
        let displacements = |threads: usize| {
            let mut half_space = HalfSpace::new(grid, PAIR, boundary);
            half_space.set_threads(threads);
            let mut u = vec![vec![0.0; grid.len()]; 4];
            let [normal, inverse, x, y] = &mut u[..] else {
                unreachable!()
            };
            half_space.normal(&a, normal);
            half_space.normal_inverse(&a, inverse);
            half_space.shear([&a, &b], [x, y]);
            (u, half_space.take_pairs())
        };
        let alone = displacements(1);
        for threads in [2, 3, 8] {
            assert!(
                displacements(threads) == alone,
                "{threads} threads, {nx} x {ny}, {boundary:?}"
            );
        }
    }
}
