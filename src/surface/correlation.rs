//! Spatial correlation of heights: autocorrelation and power spectral density, estimated from a field.

use std::f64::consts::PI;

use super::error::SurfaceError;
use super::statistics::{check, roughness};
use crate::fft::{Complex64, FftDirection, transform, wave_number};
use crate::grid::Patch;

/// Autocorrelation of a surface, normalised to 1 at lag zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Autocorrelation {
    nx: usize,
    ny: usize,
    dx: f64,
    dy: f64,
    /// Autocorrelation on the padded grid of (2 nx) x (2 ny) lags. The value is NaN if no pair of kept cells has the
    /// lag.
    values: Vec<f64>,
}

impl Autocorrelation {
    /// Returns the autocorrelation at a lag in cells along x and y. Returns `None` if the patch has no pair
    /// of cells at that lag. The autocorrelation is even in the whole lag: `at(a, b) == at(-a, -b)`.
    pub fn at(&self, lag_x: isize, lag_y: isize) -> Option<f64> {
        let (nx, ny) = (self.nx as isize, self.ny as isize);
        if lag_x.abs() >= nx || lag_y.abs() >= ny {
            return None;
        }
        let row = lag_x.rem_euclid(2 * nx) as usize;
        let column = lag_y.rem_euclid(2 * ny) as usize;
        let value = self.values[row * 2 * self.ny + column];
        value.is_finite().then_some(value)
    }

    /// Returns the lag along x and along y \[m\] at which the autocorrelation first falls to 1/e, by linear
    /// interpolation. Returns `None` if the autocorrelation does not fall to 1/e within the patch.
    pub fn correlation_length(&self) -> [Option<f64>; 2] {
        let target = (-1.0f64).exp();
        let along = |cell: f64, lags: usize, at: &dyn Fn(isize) -> Option<f64>| {
            let mut before = 1.0;
            for lag in 1..lags as isize {
                let value = at(lag)?;
                if value <= target {
                    let part = (before - target) / (before - value);
                    return Some(((lag - 1) as f64 + part) * cell);
                }
                before = value;
            }
            None
        };
        [
            along(self.dx, self.nx, &|lag| self.at(lag, 0)),
            along(self.dy, self.ny, &|lag| self.at(0, lag)),
        ]
    }
}

/// Computes the autocorrelation of the deviations of the heights from the mean height. The function uses all pairs of
/// kept cells and does not assume a periodic surface. At each lag, the autocorrelation is the mean product over the
/// existing pairs of cells. Holes and edges therefore do not bias the autocorrelation. Large lags have few pairs and
/// scatter.
///
/// # Errors
/// Errors of [`roughness`], and [`SurfaceError::OutOfRange`] for a flat surface, which has no
/// autocorrelation.
pub fn autocorrelation(patch: &Patch, heights: &[f64]) -> Result<Autocorrelation, SurfaceError> {
    let about = deviations(patch, heights)?;
    let grid = patch.grid;
    // On twice the grid, cyclic products do not wrap around.
    let (px, py) = (2 * grid.nx, 2 * grid.ny);
    let products = |values: &dyn Fn(usize) -> f64| {
        let mut padded = vec![Complex64::new(0.0, 0.0); px * py];
        for index in 0..grid.len() {
            let (i, j) = grid.cell(index);
            padded[i * py + j].re = values(index);
        }
        transform(&mut padded, px, py, FftDirection::Forward);
        for value in &mut padded {
            *value = Complex64::new(value.norm_sqr(), 0.0);
        }
        transform(&mut padded, px, py, FftDirection::Inverse);
        padded
    };
    let sums = products(&|index| about.values[index]);
    let pairs = products(&|index| f64::from(patch.is_in_joint[index]));
    let scale = (px * py) as f64;
    let square = about.rq * about.rq;
    let values = sums
        .iter()
        .zip(&pairs)
        .map(|(sum, pairs)| {
            // The count is an integer, so that a value below one half is 0.
            let count = (pairs.re / scale).round();
            if count < 0.5 {
                f64::NAN
            } else {
                sum.re / scale / count / square
            }
        })
        .collect();
    Ok(Autocorrelation {
        nx: grid.nx,
        ny: grid.ny,
        dx: grid.dx,
        dy: grid.dy,
        values,
    })
}

/// Ring of the power spectral density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralRing {
    /// Mean wave number of the ring's waves \[rad/m\].
    pub wave_number: f64,
    /// Mean power spectral density over the ring \[m⁴\].
    pub density: f64,
    /// Number of waves in the ring.
    pub waves: usize,
}

/// Computes the power spectral density C(q). The density is averaged over rings of wave vectors of similar length. The
/// first ring has the longest wave of the joint. The density is normalised: the sum Σ C Δqx Δqy / (2π)² over all waves
/// is Rq². The function assumes a periodic field and uses no window. The assumption of a periodic field suits generated
/// surfaces. The edges of a measured surface add a background ∝ q⁻² to the spectrum. Cells outside the patch count as
/// mean height.
///
/// # Errors
/// Errors of [`autocorrelation`].
pub fn power_spectral_density(
    patch: &Patch,
    heights: &[f64],
) -> Result<Vec<SpectralRing>, SurfaceError> {
    let about = deviations(patch, heights)?;
    let grid = patch.grid;
    let [lx, ly] = grid.size();
    let mut waves: Vec<_> = about
        .values
        .iter()
        .map(|&h| Complex64::new(h, 0.0))
        .collect();
    transform(&mut waves, grid.nx, grid.ny, FftDirection::Forward);
    let width = 2.0 * PI / lx.min(ly);
    let scale = grid.cell_area() / patch.cells() as f64;
    let mut rings: Vec<(f64, f64, usize)> = Vec::new();
    for (index, wave) in waves.iter().enumerate().skip(1) {
        let (i, j) = grid.cell(index);
        let kx = 2.0 * PI * wave_number(i, grid.nx) as f64 / lx;
        let ky = 2.0 * PI * wave_number(j, grid.ny) as f64 / ly;
        let k = kx.hypot(ky);
        let ring = (k / width).round() as usize;
        if rings.len() <= ring {
            rings.resize(ring + 1, (0.0, 0.0, 0));
        }
        rings[ring].0 += k;
        rings[ring].1 += wave.norm_sqr() * scale;
        rings[ring].2 += 1;
    }
    Ok(rings
        .into_iter()
        .filter(|&(_, _, waves)| waves > 0)
        .map(|(k, density, waves)| SpectralRing {
            wave_number: k / waves as f64,
            density: density / waves as f64,
            waves,
        })
        .collect())
}

struct Deviations {
    values: Vec<f64>,
    rq: f64,
}

/// Computes the heights minus the mean height of the patch. Cells outside the patch get 0.
fn deviations(patch: &Patch, heights: &[f64]) -> Result<Deviations, SurfaceError> {
    check(patch, heights)?;
    let statistics = roughness(patch, heights)?;
    if statistics.rq == 0.0 {
        return Err(SurfaceError::OutOfRange {
            name: "Rq",
            value: 0.0,
            expected: "positive for an autocorrelation or a spectrum",
        });
    }
    let about = |(&h, &kept): (&f64, &bool)| if kept { h - statistics.mean } else { 0.0 };
    Ok(Deviations {
        values: heights.iter().zip(&patch.is_in_joint).map(about).collect(),
        rq: statistics.rq,
    })
}
