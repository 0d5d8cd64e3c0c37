//! Tests of the line that the elements of a joint follow approximately.

use std::f64::consts::TAU;

use fretwear::dynamics::cycle::Line;
use fretwear::dynamics::{Harmonics, Sampling};

const SAMPLES: usize = 256;
/// An end lies at most half a sample from the nearest sample, and a cosine is flat there: (π/256)²/2 of the reach.
const BY_SAMPLES: f64 = 1e-4;
const ROUNDING: f64 = 1e-12;
const ORDER: u32 = 3;
const COEFFICIENTS: usize = 2 * ORDER as usize + 1;
/// Shares of the area, all different.
const SHARES: [f64; 4] = [0.1, 0.2, 0.3, 0.4];

/// Motion of element `e` along x and y: coefficients cos θ, sin θ and cos 3θ of each axis \[m\].
type Ways = fn(usize) -> [[f64; 3]; 2];

fn line(ways: Ways) -> Line {
    let sampling = Sampling::new(Harmonics::up_to(ORDER), SAMPLES).expect("samples");
    let mut displacement = Vec::new();
    for e in 0..SHARES.len() {
        for axis in ways(e) {
            let mut row = [0.0; COEFFICIENTS];
            row[0] = 0.3e-6;
            [row[1], row[2], row[5]] = axis;
            displacement.extend(row);
        }
        displacement.extend([7.0; COEFFICIENTS]);
    }
    // Ports after the elements do not belong to the joint.
    displacement.extend([9.0; COEFFICIENTS]);
    Line::of(&SHARES, &displacement, &sampling)
}

/// Displacement of the elements in a rotation about the normal that does not move the mean over the area.
fn turning(e: usize) -> [f64; 2] {
    let places = [[3.0, 1.0], [-1.0, 2.0], [1.0, -3.0], [-1.0, 1.0]];
    let middle = [0, 1].map(|d| (0..4).map(|k| SHARES[k] * places[k][d]).sum::<f64>());
    [-(places[e][1] - middle[1]), places[e][0] - middle[0]]
}

#[test]
fn a_joint_that_turns_about_its_normal_moves_along_a_line() {
    // In addition to the rotation, cos(θ − 1), the mean moves on a circle of one hundredth of its size: the line is the line of the
    // rotation.
    let found = line(|e| {
        let [x, y] = turning(e);
        let (c, s) = (1f64.cos(), 1f64.sin());
        [
            [1e-6 * x * c + 1e-8, 1e-6 * x * s, 0.0],
            [1e-6 * y * c, 1e-6 * y * s + 1e-8, 0.0],
        ]
    });
    let square = |e: usize| turning(e).map(|u| u * u).iter().sum::<f64>();
    let size = (0..4).map(|e| SHARES[e] * square(e)).sum::<f64>().sqrt();
    assert!(
        (found.half_length / (1e-6 * size) - 1.0).abs() < BY_SAMPLES,
        "{found:?}"
    );
    let top = TAU * found.ends[0] as f64 / SAMPLES as f64;
    assert!(
        ((top - 1.0).cos().abs() - 1.0).abs() < BY_SAMPLES,
        "{found:?}"
    );
    // The circle deviates from the line by its radius.
    assert!(
        (found.largest_deviation - 1e-2 / size).abs() < 1e-3 * 1e-2,
        "{found:?}"
    );
    let sign = (top - 1.0).cos().signum();
    for (e, along) in found.direction.iter().enumerate() {
        for (a, u) in along.iter().zip(turning(e)) {
            assert!((sign * a - u / size).abs() < 2e-2 / size, "{found:?}");
        }
    }
    let square = |[x, y]: [f64; 2]| x * x + y * y;
    let all = SHARES
        .iter()
        .zip(&found.direction)
        .map(|(w, d)| w * square(*d));
    assert!((all.sum::<f64>() - 1.0).abs() < ROUNDING);
}

#[test]
fn elements_out_of_phase_leave_the_line_by_their_quadrature() {
    // u_e = cos θ ± 0.2 sin θ: the mean over both signs is straight, but the field is not.
    let found = line(|e| {
        let beside = if e == 0 || e == 3 { 0.2e-6 } else { -0.2e-6 };
        [[1e-6, beside, 0.0], [0.0; 3]]
    });
    assert!(
        (found.largest_deviation - 0.2).abs() < BY_SAMPLES,
        "{found:?}"
    );
    // An orbit deviates from every line by its radius.
    let found = line(|_| [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0]]);
    assert!(
        (found.largest_deviation - 1.0).abs() < BY_SAMPLES,
        "{found:?}"
    );
}

#[test]
fn ways_back_count_as_leaving_the_line() {
    // cos θ + 0.4 cos 3θ reverses between its ends.
    let b: f64 = 0.4;
    let found = line(|_| [[1e-6, 0.0, 0.4e-6], [0.0; 3]]);
    // u(θ) = c + b(4c³ − 3c) with c = cos θ; du/dc = 0 at c² = (3b − 1)/(12 b).
    let c = ((3.0 * b - 1.0) / (12.0 * b)).sqrt();
    let value = |c: f64| c + b * (4.0 * c.powi(3) - 3.0 * c);
    let back = (value(-c) - value(c)).abs() / value(1.0);
    assert!((found.half_length / (1e-6 * value(1.0)) - 1.0).abs() < BY_SAMPLES);
    assert!(
        (found.largest_deviation - back).abs() < 1e-3,
        "{found:?} {back}"
    );
}

#[test]
fn a_joint_at_rest_has_no_direction() {
    let found = line(|_| [[0.0; 3]; 2]);
    assert_eq!((found.half_length, found.largest_deviation), (0.0, 0.0));
    assert!(found.direction.iter().flatten().all(|d| *d == 0.0));
}
