//! Generated surfaces.
//!
//! A random surface is a sum of plane waves that are periodic over the joint:
//!
//! h(x, y) = Σ a_mn exp(2πi (m x / Lx + n y / Ly)),   a_mn ~ √(S_mn / 2) (g + i g'),   a_-m,-n = conj(a_mn).
//!
//! The coordinates x and y are measured from the corner of the joint. S is the power spectral density, and g and g' are
//! standard normal numbers. The random numbers of the wave (m, n) depend only on the seed, m and n. Therefore **the
//! same seed gives the same surface on every grid**. A finer grid adds shorter waves and does not change the longer
//! waves. A grid of nx cells resolves |m| < nx / 2. On a grid with an even number of cells, the generation omits the
//! Nyquist wave. The grid would represent only one phase of the Nyquist wave. Only the last step of the generation
//! depends on the grid. A factor and a shift of the heights give the exact Rq and a zero mean over the kept cells. The
//! factor and the shift tend to limits as the grid is refined.
//!
//! ```
//! use fretwear::grid::{Grid, Patch};
//! use fretwear::surface::generate::{RandomSurface, Spectrum, random};
//! use fretwear::surface::statistics::roughness;
//!
//! // A joint of 8 x 6 mm with a hole, Rq 5 µm.
//! let patch = Patch::with_hole(Grid::over([8e-3, 6e-3], [160, 100]), 3e-3);
//! let surface = RandomSurface {
//!     rq: 5e-6,
//!     spectrum: Spectrum::Gaussian { correlation_length: [0.5e-3, 0.4e-3] },
//!     seed: 1,
//! };
//! let generated = random(&patch, &surface)?;
//! assert!(generated.warnings.is_empty());
//! // Rq is exact over the cells outside the hole, and the mean is zero.
//! assert!((roughness(&patch, &generated.heights)?.rq / 5e-6 - 1.0).abs() < 1e-12);
//! # Ok::<(), fretwear::surface::SurfaceError>(())
//! ```

use std::f64::consts::PI;

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::error::SurfaceError;
use crate::fft::{self, Complex64, FftDirection};
use crate::grid::{Grid, Patch};

/// Smallest number of cells per correlation length (or half a wavelength) that represents the shape of the
/// surface.
const FEWEST_CELLS_PER_LENGTH: f64 = 2.0;

/// Smallest number of correlation lengths along a side. A surface with fewer correlation lengths has few independent
/// patches, so Sk and Ku scatter widely. The heights then also correlate with the periodic images of the surface.
const FEWEST_LENGTHS_PER_SIDE: f64 = 5.0;

/// Distribution of a random surface's heights over wavelengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spectrum {
    /// Autocorrelation Rq² exp(-(x²/clx² + y²/cly²)): 1/e at the correlation length.
    Gaussian {
        /// Correlation length along x and y \[m\].
        correlation_length: [f64; 2],
    },
    /// Autocorrelation Rq² exp(-√(x²/clx² + y²/cly²)): 1/e at the correlation length. The exponential spectrum falls
    /// slowly (as k⁻³). The grid omits short waves, which rounds off the cusp of the autocorrelation at lag zero.
    Exponential {
        /// Correlation length along x and y \[m\].
        correlation_length: [f64; 2],
    },
    /// Isotropic power spectral density: constant above the roll-off wavelength, ∝ q^(-2 - 2H) below it, 0
    /// below the cut-off wavelength.
    SelfAffine {
        /// Hurst exponent H, 0 < H ≤ 1.
        hurst: f64,
        /// Wavelength above which the spectrum is flat \[m\].
        rolloff_wavelength: f64,
        /// Shortest wavelength \[m\]; `None`: down to the grid.
        cutoff_wavelength: Option<f64>,
    },
}

/// Random surface with normally distributed heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomSurface {
    /// Root mean square height over the kept cells \[m\].
    pub rq: f64,
    /// Distribution over wavelengths.
    pub spectrum: Spectrum,
    /// Seed. Equal seeds give equal surfaces.
    pub seed: u64,
}

/// Warning about a generated surface. `Display` writes the warning as a sentence.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Warning {
    /// The grid is too coarse for the shortest length of the requested surface.
    #[error(
        "{name} along {axis} is {length:.4e} m, {cells:.2} cells of {cell:.4e} m: the grid does not resolve it, use at least {FEWEST_CELLS_PER_LENGTH} cells"
    )]
    UnderResolved {
        /// Name of the length.
        name: &'static str,
        /// `'x'` or `'y'`.
        axis: char,
        /// Requested length \[m\].
        length: f64,
        /// Cell width \[m\].
        cell: f64,
        /// Length in cells.
        cells: f64,
    },
    /// The joint is too small for the longest length of the requested surface.
    #[error(
        "{name} along {axis} is {length:.4e} m, and the joint is {size:.4e} m long: a side needs at least {FEWEST_LENGTHS_PER_SIDE} of these lengths, or the statistics depend on the seed; use several seeds"
    )]
    FewLengths {
        /// Name of the length.
        name: &'static str,
        /// `'x'` or `'y'`.
        axis: char,
        /// Requested length \[m\].
        length: f64,
        /// Side of the joint \[m\].
        size: f64,
    },
}

/// Generated surface.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneratedSurface {
    /// Heights \[m\], one per cell; 0 outside the patch.
    pub heights: Vec<f64>,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

/// Generates a random surface on the patch. The surface is periodic over the sides of the grid. Over the kept cells,
/// the mean height is zero and Rq is exact.
///
/// # Errors
/// [`SurfaceError::OutOfRange`] for invalid numbers, [`SurfaceError::TooFewCells`] for less than two kept
/// cells, [`SurfaceError::NoPower`] if no resolved wave has a height.
pub fn random(patch: &Patch, surface: &RandomSurface) -> Result<GeneratedSurface, SurfaceError> {
    check(surface)?;
    let kept = patch.cells();
    if kept < 2 {
        return Err(SurfaceError::TooFewCells {
            kept,
            needed: 2,
            purpose: "a random surface",
        });
    }
    let grid = patch.grid;
    check_power(&grid, &surface.spectrum)?;
    let mut waves = amplitudes(&grid, &surface.spectrum, surface.seed);
    fft::transform(&mut waves, grid.nx, grid.ny, FftDirection::Inverse);
    let mut heights: Vec<f64> = waves.iter().map(|h| h.re).collect();
    if !normalise(patch, &mut heights, surface.rq) {
        return Err(no_power(&grid));
    }
    Ok(GeneratedSurface {
        heights,
        warnings: warnings(&grid, &surface.spectrum),
    })
}

/// Rejects a spectrum if no wave that the grid resolves has a height, without generating the surface.
///
/// # Errors
/// [`SurfaceError::NoPower`]
pub fn check_power(grid: &Grid, spectrum: &Spectrum) -> Result<(), SurfaceError> {
    let [lx, ly] = grid.size();
    // No spectrum grows with the wave number, so the longest waves are the strongest. Three cells resolve one
    // wave.
    let longest = [
        (grid.nx, [2.0 * PI / lx, 0.0]),
        (grid.ny, [0.0, 2.0 * PI / ly]),
    ];
    let mut resolved = longest.into_iter().filter(|(cells, _)| *cells > 2);
    match resolved.any(|(_, [kx, ky])| spectrum.density(kx, ky) > 0.0) {
        true => Ok(()),
        false => Err(no_power(grid)),
    }
}

fn no_power(grid: &Grid) -> SurfaceError {
    SurfaceError::NoPower {
        nx: grid.nx,
        ny: grid.ny,
        dx: grid.dx,
        dy: grid.dy,
    }
}

/// Returns the smooth surface: height 0 everywhere \[m\].
pub fn flat(patch: &Patch) -> Vec<f64> {
    vec![0.0; patch.grid.len()]
}

/// Returns the heights h = -r² / (2 `radius`) of a paraboloid \[m\]. The paraboloid represents a sphere in the Hertz
/// theory, and r is the distance from the centre of the grid. The apex of the paraboloid has height 0. If the number of
/// cells is even, the apex lies between cells. The highest cell is then a little below 0.
///
/// # Errors
/// [`SurfaceError::OutOfRange`] if the radius is not a positive number.
pub fn sphere(patch: &Patch, radius: f64) -> Result<Vec<f64>, SurfaceError> {
    positive("radius", radius)?;
    let grid = patch.grid;
    Ok((0..grid.len())
        .map(|index| {
            if !patch.is_in_joint[index] {
                return 0.0;
            }
            let (i, j) = grid.cell(index);
            let (x, y) = grid.centre(i, j);
            -(x * x + y * y) / (2.0 * radius)
        })
        .collect())
}

/// Returns the amplitudes of the resolved waves in the order of the transform, shifted to the cell centres.
fn amplitudes(grid: &Grid, spectrum: &Spectrum, seed: u64) -> Vec<Complex64> {
    let [lx, ly] = grid.size();
    let mut waves = vec![Complex64::new(0.0, 0.0); grid.len()];
    let mut random = ModeNumbers::new(seed);
    let highest = |cells: usize| (cells.saturating_sub(1) / 2) as i64;
    for m in 0..=highest(grid.nx) {
        random.row(m);
        for position in 0..=2 * highest(grid.ny) {
            // The numbers n have the order 0, 1, -1, 2, -2, … The position of a number n does not depend on the number
            // of waves.
            let n = if position % 2 == 1 {
                (position + 1) / 2
            } else {
                -position / 2
            };
            let [g, h] = random.next_pair();
            // For m = 0, the amplitude of the wave −n is the conjugate of the amplitude of the wave n. The wave (0, 0)
            // would change the mean height.
            if m == 0 && n <= 0 {
                continue;
            }
            let (kx, ky) = (2.0 * PI * m as f64 / lx, 2.0 * PI * n as f64 / ly);
            let scale = (0.5 * spectrum.density(kx, ky)).sqrt();
            let phase = PI * (m as f64 / grid.nx as f64 + n as f64 / grid.ny as f64);
            let wave = scale * Complex64::new(g, h) * Complex64::cis(phase);
            let wrap = |k: i64, cells: usize| k.rem_euclid(cells as i64) as usize;
            waves[grid.index(wrap(m, grid.nx), wrap(n, grid.ny))] = wave;
            waves[grid.index(wrap(-m, grid.nx), wrap(-n, grid.ny))] = wave.conj();
        }
    }
    waves
}

/// Shifts and scales the kept cells to zero mean and the requested root mean square; sets the others to 0.
/// Returns false if all heights are zero or not finite.
fn normalise(patch: &Patch, heights: &mut [f64], rq: f64) -> bool {
    let n = patch.cells() as f64;
    let mean = |values: &[f64]| {
        let kept = values
            .iter()
            .zip(&patch.is_in_joint)
            .filter(|(_, kept)| **kept);
        kept.map(|(h, _)| h).sum::<f64>() / n
    };
    // The first pass subtracts the mean, the second its rounding error.
    for _ in 0..2 {
        let shift = mean(heights);
        for (h, &kept) in heights.iter_mut().zip(&patch.is_in_joint) {
            *h = if kept { *h - shift } else { 0.0 };
        }
    }
    let square = heights.iter().map(|h| h * h).sum::<f64>() / n;
    if !(square.is_finite() && square > 0.0) {
        return false;
    }
    let factor = rq / square.sqrt();
    for h in heights.iter_mut() {
        *h *= factor;
    }
    true
}

impl Spectrum {
    /// Returns the power spectral density at a wave vector \[1/m\], up to a constant factor that the exact Rq
    /// determines.
    pub fn density(&self, kx: f64, ky: f64) -> f64 {
        let scaled = |[x, y]: [f64; 2]| (kx * x).powi(2) + (ky * y).powi(2);
        match *self {
            Spectrum::Gaussian { correlation_length } => (-0.25 * scaled(correlation_length)).exp(),
            Spectrum::Exponential { correlation_length } => {
                (1.0 + scaled(correlation_length)).powf(-1.5)
            }
            Spectrum::SelfAffine {
                hurst,
                rolloff_wavelength,
                cutoff_wavelength,
            } => {
                let k = kx.hypot(ky);
                let rolloff = 2.0 * PI / rolloff_wavelength;
                if cutoff_wavelength.is_some_and(|cutoff| k > 2.0 * PI / cutoff) {
                    0.0
                } else {
                    (k / rolloff).max(1.0).powf(-2.0 - 2.0 * hurst)
                }
            }
        }
    }

    /// Returns the shortest length to resolve and the longest to fit, each as (name, lengths along x and y).
    fn extremes(&self) -> [(&'static str, [f64; 2]); 2] {
        match *self {
            Spectrum::Gaussian { correlation_length }
            | Spectrum::Exponential { correlation_length } => {
                [("the correlation length", correlation_length); 2]
            }
            Spectrum::SelfAffine {
                rolloff_wavelength,
                cutoff_wavelength,
                ..
            } => {
                // Without a cut-off the grid limits the waves.
                let shortest = cutoff_wavelength.unwrap_or(f64::INFINITY);
                [
                    ("half the cut-off wavelength", [0.5 * shortest; 2]),
                    ("the roll-off wavelength", [rolloff_wavelength; 2]),
                ]
            }
        }
    }
}

fn warnings(grid: &Grid, spectrum: &Spectrum) -> Vec<Warning> {
    let [(short, shortest), (long, longest)] = spectrum.extremes();
    let mut warnings = Vec::new();
    for (axis, a) in ['x', 'y'].into_iter().enumerate() {
        let (cell, size) = ([grid.dx, grid.dy][axis], grid.size()[axis]);
        if shortest[axis] < FEWEST_CELLS_PER_LENGTH * cell {
            warnings.push(Warning::UnderResolved {
                name: short,
                axis: a,
                length: shortest[axis],
                cell,
                cells: shortest[axis] / cell,
            });
        }
        if longest[axis] * FEWEST_LENGTHS_PER_SIDE > size {
            warnings.push(Warning::FewLengths {
                name: long,
                axis: a,
                length: longest[axis],
                size,
            });
        }
    }
    warnings
}

fn check(surface: &RandomSurface) -> Result<(), SurfaceError> {
    positive("rq", surface.rq)?;
    match surface.spectrum {
        Spectrum::Gaussian { correlation_length }
        | Spectrum::Exponential { correlation_length } => {
            positive("correlation_length along x", correlation_length[0])?;
            positive("correlation_length along y", correlation_length[1])
        }
        Spectrum::SelfAffine {
            hurst,
            rolloff_wavelength,
            cutoff_wavelength,
        } => {
            if !(hurst > 0.0 && hurst <= 1.0) {
                return Err(SurfaceError::OutOfRange {
                    name: "hurst",
                    value: hurst,
                    expected: "above 0 and at most 1",
                });
            }
            if let Some(cutoff) = cutoff_wavelength {
                positive("cutoff_wavelength", cutoff)?;
            }
            positive("rolloff_wavelength", rolloff_wavelength)?;
            if cutoff_wavelength.is_some_and(|cutoff| rolloff_wavelength < cutoff) {
                return Err(SurfaceError::OutOfRange {
                    name: "rolloff_wavelength",
                    value: rolloff_wavelength,
                    expected: "at least as long as cutoff_wavelength",
                });
            }
            Ok(())
        }
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), SurfaceError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SurfaceError::OutOfRange {
            name,
            value,
            expected: "a positive, finite number (a smooth surface is kind = \"flat\")",
        })
    }
}

/// Generator of normal random numbers for the wave (m, n). The seed is the key of the generator, and m is the stream.
/// The number n determines the position in the stream.
struct ModeNumbers {
    generator: ChaCha12Rng,
}

impl ModeNumbers {
    fn new(seed: u64) -> Self {
        // Our own key, because the library's `seed_from_u64` may change between versions.
        let mut key = *b"--seed--fretwear/surface/random\0";
        key[..8].copy_from_slice(&seed.to_le_bytes());
        ModeNumbers {
            generator: ChaCha12Rng::from_seed(key),
        }
    }

    /// Moves to the first wave of row m.
    fn row(&mut self, m: i64) {
        self.generator.set_stream(m as u64);
        self.generator.set_word_pos(0);
    }

    /// Returns two independent standard normal numbers (Box–Muller) from the next two 64-bit words.
    fn next_pair(&mut self) -> [f64; 2] {
        const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
        // In (0, 1], so that the logarithm exists.
        let u = ((self.generator.next_u64() >> 11) + 1) as f64 * UNIT;
        let v = (self.generator.next_u64() >> 11) as f64 * UNIT;
        let radius = (-2.0 * u.ln()).sqrt();
        let (sin, cos) = (2.0 * PI * v).sin_cos();
        [radius * cos, radius * sin]
    }
}
