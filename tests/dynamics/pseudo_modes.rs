//! Tests of pseudo-modes and of their remaining flexibility against known modes.

use std::f64::consts::TAU;

use fretwear::dynamics::DynamicsError;
use fretwear::dynamics::pseudo_modes::{PseudoModeSettings, PseudoModes, pseudo_modes};
use fretwear::linalg::{RowMatrix as Matrix, generalised_eigen};

/// Rounding of a few products of matrices with a condition number of about 1e4.
const ROUNDING: f64 = 1e-9;

/// Shape of a mode at a port: non-repeating numbers.
fn shape(port: usize, mode: usize) -> f64 {
    (1.0 + (port + 1) as f64 * (0.4 + 0.61 * mode as f64)).sin()
}

/// R₀ and R₁ of modes at these frequencies \[Hz\].
fn residual(ports: usize, hertz: &[f64]) -> [Matrix; 2] {
    let mut sums = [Matrix::zeros(ports, ports), Matrix::zeros(ports, ports)];
    for (r, f) in hertz.iter().enumerate() {
        let square = (TAU * f).powi(2);
        for (power, sum) in sums.iter_mut().enumerate() {
            for i in 0..ports {
                for j in 0..ports {
                    let share = shape(i, r) * shape(j, r) / square.powi(1 + power as i32);
                    sum.set(i, j, sum.at(i, j) + share);
                }
            }
        }
    }
    sums
}

/// Σψψᵀ/(Λ − ω²) plus the remaining flexibility.
fn receptance(pseudo: &PseudoModes, omega: f64) -> Matrix {
    let weights: Vec<f64> = pseudo
        .omega
        .iter()
        .map(|w| 1.0 / (w * w - omega * omega))
        .collect();
    let mut out = pseudo.shapes.times(&Matrix::diagonal(&weights));
    out = out.times(&pseudo.shapes.transposed());
    let pairs = out.values_mut().iter_mut().zip(pseudo.residual.values());
    pairs.for_each(|(h, r)| *h += r);
    out
}

fn size(matrix: &Matrix) -> f64 {
    matrix.values().iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn difference(a: &Matrix, b: &Matrix) -> f64 {
    let mut out = a.clone();
    let pairs = out.values_mut().iter_mut().zip(b.values());
    pairs.for_each(|(a, b)| *a -= b);
    size(&out)
}

/// With as many modes as ports, the subspace of the pseudo-modes is the whole space, and the pseudo-modes equal the modes.
#[test]
fn all_pseudo_modes_are_the_modes_left_out() {
    let hertz = [900.0, 1400.0, 2300.0, 3100.0, 5200.0];
    let [flexibility, slope] = residual(5, &hertz);
    let pseudo = pseudo_modes(&flexibility, &slope, PseudoModeSettings::of_count(5)).unwrap();
    for (found, expected) in pseudo.omega.iter().zip(hertz) {
        assert!(
            (found / TAU / expected - 1.0).abs() < ROUNDING,
            "{found} {expected}"
        );
    }
    for port in 0..5 {
        for mode in 0..5 {
            let found = pseudo.shapes.at(port, mode).abs();
            assert!((found - shape(port, mode).abs()).abs() < 1e-6, "{found}");
        }
    }
    assert!(size(&pseudo.residual) < ROUNDING * size(&flexibility));
}

/// With few of many modes, the static response stays exact, the remainder is a flexibility, and the poles are upper bounds. Near and above
/// the first omitted mode, the response is bounded and better than the response of the series.
#[test]
fn few_pseudo_modes_answer_where_the_series_diverges() {
    const PORTS: usize = 9;
    let hertz: Vec<f64> = (0..30).map(|r| 1000.0 * 1.13_f64.powi(r)).collect();
    let [flexibility, slope] = residual(PORTS, &hertz);
    let pseudo = pseudo_modes(&flexibility, &slope, PseudoModeSettings::of_count(4)).unwrap();
    assert_eq!(pseudo.omega.len(), 4);
    assert!(pseudo.omega.is_sorted());
    assert!(pseudo.omega[0] / TAU > hertz[0] * (1.0 - ROUNDING));
    let kept = difference(&receptance(&pseudo, 0.0), &flexibility);
    assert!(kept < ROUNDING * size(&flexibility), "{kept:e}");
    let identity = Matrix::identity(PORTS);
    let (values, _) = generalised_eigen(&pseudo.residual, &identity).unwrap();
    assert!(values[0] > -ROUNDING * size(&flexibility), "{values:?}");

    let error = |f: f64| {
        let omega = TAU * f;
        let mut exact = Matrix::zeros(PORTS, PORTS);
        for (r, hz) in hertz.iter().enumerate() {
            let stiff = (TAU * hz).powi(2) - omega * omega;
            for i in 0..PORTS {
                for j in 0..PORTS {
                    let share = shape(i, r) * shape(j, r) / stiff;
                    exact.set(i, j, exact.at(i, j) + share);
                }
            }
        }
        let mut series = flexibility.clone();
        let pairs = series.values_mut().iter_mut().zip(slope.values());
        pairs.for_each(|(h, s)| *h += omega * omega * s);
        [receptance(&pseudo, omega), series, flexibility.clone()]
            .map(|found| difference(&found, &exact) / size(&exact))
    };
    for (f, most) in [(100.0, 1e-3), (300.0, 1e-2), (700.0, 0.1)] {
        let [pseudo, _, constant] = error(f);
        println!("{f} Hz: {pseudo:.1e}, constant {constant:.1e}");
        assert!(
            pseudo < most && pseudo < 0.5 * constant,
            "{f} Hz: {pseudo:e}"
        );
    }
    // Above all omitted modes, the response is an inertia, which decreases; the series grows.
    let [above, series, _] = error(1e5);
    assert!(series > 100.0 * above, "{series:e} {above:e}");
}

#[test]
fn none_wanted_and_matrices_that_do_not_fit() {
    let [flexibility, slope] = residual(4, &[500.0, 700.0, 1100.0, 1900.0]);
    let none = pseudo_modes(&flexibility, &slope, PseudoModeSettings::of_count(0)).unwrap();
    assert!(none.omega.is_empty());
    assert_eq!(none.residual, flexibility);
    // Without residual mass, no mode exists.
    let massless = pseudo_modes(
        &flexibility,
        &Matrix::zeros(4, 4),
        PseudoModeSettings::of_count(3),
    )
    .unwrap();
    assert!(massless.omega.is_empty());
    let error = pseudo_modes(
        &flexibility,
        &Matrix::zeros(3, 4),
        PseudoModeSettings::of_count(2),
    )
    .unwrap_err();
    assert!(matches!(error, DynamicsError::Length { .. }), "{error}");
}

/// A port of a heavy platen: the kept modes have its whole flexibility, so its row of the residual is zero, or rounding of either sign. The
/// port gets no pseudo-mode, and the other ports stay unchanged.
#[test]
fn a_port_without_a_residual_gets_none() {
    const PORTS: usize = 6;
    let hertz: Vec<f64> = (0..12).map(|r| 1000.0 * 1.2_f64.powi(r)).collect();
    let [flexibility, slope] = residual(PORTS, &hertz);
    let alone = pseudo_modes(&flexibility, &slope, PseudoModeSettings::of_count(4)).unwrap();
    let scales = [&flexibility, &slope].map(|matrix| {
        let largest = (0..PORTS).map(|port| matrix.at(port, port));
        largest.fold(0.0, f64::max)
    });
    let sizes = [0.0, 1e-18, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6];
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let all = sizes
        .iter()
        .flat_map(|size| signs.map(|signs| signs.map(|sign| sign * size)));
    for rounding in all {
        // Adds one port in the middle.
        let with_platen = |matrix: &Matrix, rounding: f64| {
            let place = |i: usize| i - usize::from(i > 2);
            let mut out = Matrix::zeros(PORTS + 1, PORTS + 1);
            for i in 0..=PORTS {
                for j in 0..=PORTS {
                    out.set(
                        i,
                        j,
                        match (i, j) {
                            (2, 2) => rounding,
                            (2, other) | (other, 2) => 0.7 * rounding * (other as f64).sin(),
                            _ => matrix.at(place(i), place(j)),
                        },
                    );
                }
            }
            out
        };
        let flexibility = with_platen(&flexibility, rounding[0] * scales[0]);
        let slope = with_platen(&slope, rounding[1] * scales[1]);
        let pseudo = pseudo_modes(&flexibility, &slope, PseudoModeSettings::of_count(4))
            .unwrap_or_else(|error| panic!("{rounding:?}: {error}"));
        for omega in [0.0, TAU * 300.0, TAU * 700.0] {
            let expected = receptance(&alone, omega);
            let found = receptance(&pseudo, omega);
            let most = size(&expected);
            for i in 0..=PORTS {
                for j in 0..=PORTS {
                    let place = |i: usize| i - usize::from(i > 2);
                    let expected = match i == 2 || j == 2 {
                        true => 0.0,
                        false => expected.at(place(i), place(j)),
                    };
                    let off = (found.at(i, j) - expected).abs() / most;
                    // More than rounding may become one of the four pseudo-modes, which are accurate to 10 % at these frequencies.
                    let beside = match omega > 0.0 && rounding[0].abs() > 1e-9 {
                        true => 0.1,
                        false => 10.0 * rounding[0].abs(),
                    };
                    assert!(
                        off < 1e-9 + beside,
                        "{rounding:?}, {omega}: {i} {j} off by {off:e}"
                    );
                }
            }
        }
    }
}
