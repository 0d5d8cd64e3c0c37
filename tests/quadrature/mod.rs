//! Quadrature for tests, independent of the closed forms of the crate.

/// Gauss-Legendre nodes and weights on \[-1, 1\].
fn gauss_legendre(order: usize) -> Vec<(f64, f64)> {
    (0..order)
        .map(|k| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (order as f64 + 0.5)).cos();
            let mut slope = 1.0;
            // Newton's iteration converges quadratically from this start, so eight steps suffice.
            for _ in 0..8 {
                let (mut low, mut high) = (1.0, x);
                for degree in 2..=order {
                    let degree = degree as f64;
                    (low, high) = (
                        high,
                        ((2.0 * degree - 1.0) * x * high - (degree - 1.0) * low) / degree,
                    );
                }
                slope = order as f64 * (x * high - low) / (x * x - 1.0);
                x -= high / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Integral of f over \[from, to\] with `panels` equal panels of 20 nodes.
pub fn integrate(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let rule = gauss_legendre(20);
    let half = 0.5 * (to - from) / panels as f64;
    (0..panels)
        .map(|panel| {
            let middle = from + (2 * panel + 1) as f64 * half;
            rule.iter()
                .map(|(x, w)| w * half * f(middle + half * x))
                .sum::<f64>()
        })
        .sum()
}

/// Integral of f(r, θ) dA over the annulus from `inner` to `outer`. The substitution r = mid + half·sin φ removes the square roots at both
/// rims.
pub fn integrate_annulus(inner: f64, outer: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, PI};
    const ANGLES: usize = 48;
    let (middle, half) = (0.5 * (outer + inner), 0.5 * (outer - inner));
    integrate(-FRAC_PI_2, FRAC_PI_2, 8, |phi| {
        let r = middle + half * phi.sin();
        // The trapezoidal rule on a full turn is exact for the few harmonics of the integrands.
        let around: f64 = (0..ANGLES)
            .map(|k| f(r, 2.0 * PI * (k as f64 + 0.5) / ANGLES as f64))
            .sum();
        around * 2.0 * PI / ANGLES as f64 * r * half * phi.cos()
    })
}

/// Integral of N functions of (x, y) over a rectangle around `centre`, with `panels`² panels of 10² nodes.
pub fn integrate_rectangle<const N: usize>(
    centre: (f64, f64),
    size: (f64, f64),
    panels: usize,
    f: impl Fn(f64, f64) -> [f64; N],
) -> [f64; N] {
    let rule = gauss_legendre(10);
    let nodes = |middle: f64, width: f64| -> Vec<(f64, f64)> {
        let half = 0.5 * width / panels as f64;
        let panel = |k: usize| middle - 0.5 * width + (2 * k + 1) as f64 * half;
        let of_panel = |k| {
            rule.iter()
                .map(move |(t, w)| (panel(k) + half * t, half * w))
        };
        (0..panels).flat_map(of_panel).collect()
    };
    let mut sum = [0.0; N];
    for &(px, wx) in &nodes(centre.0, size.0) {
        for &(py, wy) in &nodes(centre.1, size.1) {
            for (s, f) in sum.iter_mut().zip(f(px, py)) {
                *s += wx * wy * f;
            }
        }
    }
    sum
}

#[test]
fn polynomials_are_integrated_exactly() {
    let found = integrate(-0.5, 2.0, 1, |x| x.powi(9) - 3.0 * x * x);
    let primitive = |x: f64| x.powi(10) / 10.0 - x.powi(3);
    let expected = primitive(2.0) - primitive(-0.5);
    assert!((found / expected - 1.0).abs() < 1e-13);
}
