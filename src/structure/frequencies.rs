//! Natural frequencies of K φ = ω² M φ for imported matrices. The stiffness matrix K can be singular, and the mass
//! matrix M can have rows without mass. The matrices can be in any units.
//!
//! The operator (K + s·M)⁻¹ M with s > 0 exists for a singular K and for a singular M. A rigid mode has the eigenvalue
//! 1/s. Motions without mass have the eigenvalue 0, so massless rows are condensed statically and need no search. The
//! shift s is found from the lowest elastic mode.

use crate::linalg::{LinalgError, Matrix, SparseCholesky, SparseSymmetric};
use crate::structure::StructureError;
use crate::structure::matrices::Matrices;
use crate::structure::modes::{ModeOptions, lowest_of};
use crate::structure::order::elimination_order;

/// A larger diagonal of the stiffness is a penalty that fixes the row. Abaqus writes 1e36.
const PENALTY: f64 = 1e30;
/// A dense method computes all eigenvalues of matrices of up to `DENSE` rows in some seconds.
pub(super) const DENSE: usize = 450;
/// The first shift is `FIRST_SHARE` times the smallest ratio of the diagonals of K and M. The smallest ratio of the
/// diagonals is an upper bound of the lowest ω².
const FIRST_SHARE: f64 = 1e-3;
/// The estimate of the shift ignores ratios of diagonals of K and M below `NO_RATIO` times the largest ratio.
const NO_RATIO: f64 = 1e-14;
/// Valid range of the shift divided by the lowest elastic ω². The number of digits that the solver loses depends on the
/// shift divided by the lowest elastic ω².
const SHIFTS: [f64; 2] = [1e-4, 10.0];
/// If rounding makes K + s·M not positive definite, the solver multiplies the shift s by `LARGER`, [`TRIALS`] times at
/// most.
const LARGER: f64 = 100.0;
const TRIALS: usize = 8;
/// If K + s·M is not positive definite at any shift s, some massless rows have no stiffness. For such massless rows,
/// the solver increases the diagonal of K by the share `STEADYING`.
const STEADYING: f64 = 1e-11;
/// A mode φ is rigid if φᵀKφ / Σ|φᵢKᵢⱼφⱼ| is below `RIGID` times the precision of the entries of K. Rounding of the
/// entries gives a rigid mode a ratio φᵀKφ / Σ|φᵢKᵢⱼφⱼ| up to the precision of the entries.
const RIGID: f64 = 20.0;
/// A stiffness that a program has condensed has larger errors than the rounding of its entries. Modes with φᵀKφ /
/// Σ|φᵢKᵢⱼφⱼ| below `NEARLY_RIGID` are also rigid if the next frequency is larger by the factor [`GAP`].
const NEARLY_RIGID: f64 = 1e-10;
const GAP: f64 = 1e3;
/// Average precision of entries that a program has summed in double precision.
pub(super) const SUMMED_PRECISION: f64 = 5e-16;
/// Number of modes computed in addition to the requested ones: the rigid modes of a body.
const BODY: usize = 6;
/// An eigenvalue of (K + sM)⁻¹M below `NO_MASS` times the largest eigenvalue belongs to a motion without mass.
const NO_MASS: f64 = 1e-13;
/// Block size of the Lanczos process, equal to the number of rigid modes of a free body.
const BLOCK: usize = 6;

/// Natural frequencies, and how many rows were used or left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frequencies {
    /// Lowest elastic frequencies, ascending, in cycles per unit of time (hertz if the unit is the second).
    pub elastic: Vec<f64>,
    /// Computed frequencies of the rigid modes, which are rounding errors. Zero if ω² is negative.
    pub rigid: Vec<f64>,
    /// ω² of unstable modes: negative beyond rounding.
    pub unstable: Vec<f64>,
    /// Number of rows in the eigenproblem.
    pub rows: usize,
    /// Number of rows fixed by the user.
    pub fixed: usize,
    /// Number of rows fixed by a penalty on the diagonal in the file.
    pub penalty_fixed: usize,
    /// Number of rows left out because they have no nonzero entry.
    pub empty: usize,
    /// Number of rows left out because their body has no mass.
    pub massless: usize,
    /// True if the solver added stiffness because massless rows had no stiffness.
    pub is_stabilized: bool,
    /// True if some motion has no stiffness.
    pub is_singular: bool,
}

/// Returns for each row whether the stiffness fixes it by a penalty.
pub fn penalty_fixed_rows(matrices: &Matrices) -> Vec<bool> {
    let diagonal = matrices.stiffness.as_ref().map(|k| k.diagonal());
    (diagonal.unwrap_or_default().iter())
        .map(|v| v.abs() >= PENALTY)
        .collect()
}

/// Computes the lowest `count` elastic frequencies with some rows fixed. Returns `None` without a stiffness or a
/// mass.
///
/// # Errors
/// [`StructureError`] if no row has mass, if the memory does not suffice, or if the modes do not converge.
pub fn lowest_frequencies(
    matrices: &Matrices,
    is_fixed: &[bool],
    count: usize,
) -> Result<Option<Frequencies>, StructureError> {
    let (Some(stiffness), Some(mass)) = (&matrices.stiffness, &matrices.mass) else {
        return Ok(None);
    };
    let is_held = penalty_fixed_rows(matrices);
    let mut has_entry = vec![false; matrices.size];
    for &(i, j, v) in stiffness.entries.iter().chain(&mass.entries) {
        if v != 0.0 {
            has_entry[i as usize] = true;
            has_entry[j as usize] = true;
        }
    }
    let mut frequencies = Frequencies::default();
    let mut place = vec![None; matrices.size];
    for row in 0..matrices.size {
        if is_fixed.get(row).copied().unwrap_or(false) {
            frequencies.fixed += 1;
        } else if is_held[row] {
            frequencies.penalty_fixed += 1;
        } else if !has_entry[row] {
            frequencies.empty += 1;
        } else {
            place[row] = Some(frequencies.rows as u32);
            frequencies.rows += 1;
        }
    }
    if count == 0 {
        return Ok(Some(frequencies));
    }
    let precision = stiffness.precision.max(SUMMED_PRECISION);
    let (k, m) = (stiffness.lower(&place), mass.lower(&place));
    let places = matrices.places(&place);
    let whole = UnsplitPencil {
        rows: frequencies.rows,
        k: &k,
        m: &m,
        precision,
        places: places.as_deref(),
    };
    let whole = whole.lowest_modes(count)?;
    (frequencies.massless, frequencies.is_stabilized) = (whole.massless, whole.is_stabilized);
    if frequencies.massless == frequencies.rows {
        return Err(StructureError::TooManyModes {
            wanted: count,
            available: 0,
        });
    }
    let hertz = |square: f64| square.max(0.0).sqrt() / (2.0 * std::f64::consts::PI);
    for mode in &whole.modes {
        if mode.is_rigid {
            frequencies.rigid.push(hertz(mode.square));
        } else if mode.square < 0.0 {
            frequencies.unstable.push(mode.square);
        } else if frequencies.elastic.len() < count {
            frequencies.elastic.push(hertz(mode.square));
        }
    }
    frequencies.is_singular =
        frequencies.empty > 0 || !frequencies.rigid.is_empty() || frequencies.is_stabilized;
    Ok(Some(frequencies))
}

/// Lowest modes of all bodies.
pub(super) struct LowestModes {
    /// Modes in ascending order of ω².
    modes: Vec<Mode>,
    /// Number of rows of bodies without mass.
    pub massless: usize,
    /// True if the solver added stiffness because massless rows had no stiffness.
    pub is_stabilized: bool,
}

impl LowestModes {
    /// Returns the number of rigid modes.
    pub fn rigid(&self) -> usize {
        self.modes.iter().filter(|mode| mode.is_rigid).count()
    }

    /// Returns ω² of the elastic modes, ascending.
    pub fn elastic(&self) -> impl Iterator<Item = f64> + '_ {
        let elastic = self.modes.iter().filter(|mode| !mode.is_rigid);
        elastic.map(|mode| mode.square)
    }
}

/// Stiffness and mass of all bodies as sorted lower triangles.
pub(super) struct UnsplitPencil<'a> {
    pub rows: usize,
    pub k: &'a [(u32, u32, f64)],
    pub m: &'a [(u32, u32, f64)],
    /// Relative precision of the stiffness entries: half a unit of the last digit.
    pub precision: f64,
    /// Position of each row, if all positions are known.
    pub places: Option<&'a [[f64; 3]]>,
}

impl UnsplitPencil<'_> {
    /// Computes the lowest modes, with at least `count` elastic modes of each body.
    pub(super) fn lowest_modes(&self, count: usize) -> Result<LowestModes, StructureError> {
        let mut lowest = LowestModes {
            modes: Vec::new(),
            massless: 0,
            is_stabilized: false,
        };
        for pencil in self.pencils() {
            let Some(spectrum) = pencil.lowest(count)? else {
                lowest.massless += pencil.k.size();
                continue;
            };
            lowest.is_stabilized |= spectrum.is_steadied;
            lowest.modes.extend(spectrum.modes);
        }
        let by_square = |a: &Mode, b: &Mode| a.square.total_cmp(&b.square);
        lowest.modes.sort_by(by_square);
        Ok(lowest)
    }

    /// Splits the matrices by bodies. Identical bodies have equal modes, more than one Lanczos block would find.
    fn pencils(&self) -> Vec<Pencil> {
        let (body, bodies) = bodies(self.rows, self.k, self.m);
        let mut rows_of = vec![Vec::new(); bodies];
        let mut place = Vec::with_capacity(body.len());
        for (row, &body_number) in body.iter().enumerate() {
            place.push(rows_of[body_number as usize].len() as u32);
            rows_of[body_number as usize].push(row);
        }
        let split_by_body = |entries: &[(u32, u32, f64)]| {
            let mut parts = vec![Vec::new(); bodies];
            for &(j, i, v) in entries.iter().filter(|e| e.2 != 0.0) {
                parts[body[j as usize] as usize].push((place[j as usize], place[i as usize], v));
            }
            parts
        };
        let parts = split_by_body(self.k)
            .into_iter()
            .zip(split_by_body(self.m))
            .zip(rows_of);
        let pencil = |((k, m), rows): ((Vec<_>, Vec<_>), Vec<usize>)| Pencil {
            k: SparseSymmetric::from_sorted(rows.len(), &k),
            m: SparseSymmetric::from_sorted(rows.len(), &m),
            precision: self.precision,
            places: (self.places).map(|places| rows.iter().map(|&row| places[row]).collect()),
        };
        parts.map(pencil).collect()
    }
}

/// Returns the number of each row's body, and the number of bodies. An entry of K or M connects the bodies of its row
/// and its column to one body.
pub(super) fn bodies(
    size: usize,
    k: &[(u32, u32, f64)],
    m: &[(u32, u32, f64)],
) -> (Vec<u32>, usize) {
    let mut parent: Vec<u32> = (0..size as u32).collect();
    fn root(parent: &mut [u32], mut row: u32) -> u32 {
        while parent[row as usize] != row {
            parent[row as usize] = parent[parent[row as usize] as usize];
            row = parent[row as usize];
        }
        row
    }
    for &(i, j, v) in k.iter().chain(m) {
        if v != 0.0 && i != j {
            let (a, b) = (root(&mut parent, i), root(&mut parent, j));
            // The first row of a body is the root of the body.
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut number = vec![u32::MAX; size];
    let mut count = 0;
    for row in 0..size as u32 {
        let first = root(&mut parent, row);
        if first == row {
            number[row as usize] = count;
            count += 1;
        } else {
            number[row as usize] = number[first as usize];
        }
    }
    (number, count as usize)
}

struct Pencil {
    k: SparseSymmetric,
    m: SparseSymmetric,
    precision: f64,
    places: Option<Vec<[f64; 3]>>,
}

struct Mode {
    square: f64,
    /// Relative resistance φᵀKφ / Σ|φᵢKᵢⱼφⱼ|.
    resistance: f64,
    is_rigid: bool,
}

#[derive(Default)]
struct Spectrum {
    modes: Vec<Mode>,
    shift: f64,
    is_steadied: bool,
}

impl Spectrum {
    /// Marks modes as rigid that lie below a large frequency gap and have a small resistance.
    fn mark_below_gap(&mut self) {
        let squares: Vec<f64> = self.modes.iter().map(|mode| mode.square).collect();
        let below = (1..squares.len()).rev().find(|&k| {
            let slowest = squares[..k].iter().fold(0.0, |a: f64, s| a.max(s.abs()));
            squares[k] > GAP * GAP * slowest
                && self.modes[..k]
                    .iter()
                    .all(|mode| mode.resistance.abs() < NEARLY_RIGID)
        });
        for mode in &mut self.modes[..below.unwrap_or(0)] {
            mode.is_rigid = true;
        }
    }
}

impl Pencil {
    /// Computes the lowest modes with a shift near the lowest elastic ω². Returns `None` without mass.
    fn lowest(&self, count: usize) -> Result<Option<Spectrum>, StructureError> {
        let Some(mut shift) = self.first_shift() else {
            return Ok(None);
        };
        let mut wanted = count + BODY;
        let mut best: Option<Spectrum> = None;
        for _ in 0..TRIALS {
            let mut spectrum = match self.solve(shift, wanted) {
                Ok(spectrum) => spectrum,
                // The smaller shift failed and the previous one succeeded, so no better accuracy is possible.
                Err(_) if best.is_some() => break,
                Err(error) => return Err(error),
            };
            spectrum.mark_below_gap();
            let elastic = || spectrum.modes.iter().filter(|mode| !mode.is_rigid);
            let first = elastic()
                .find(|mode| mode.square > 0.0)
                .map(|mode| mode.square);
            let is_short = elastic().count() < count && spectrum.modes.len() >= wanted;
            let used = spectrum.shift;
            best = Some(spectrum);
            match first {
                _ if is_short => wanted *= 2,
                // A shift that was already tried is not repeated.
                Some(first)
                    if (used < SHIFTS[0] * first || used > SHIFTS[1] * first)
                        && (shift / first - 1.0).abs() > 0.5 =>
                {
                    shift = first;
                }
                _ => break,
            }
        }
        Ok(best)
    }

    fn first_shift(&self) -> Option<f64> {
        let (k, m) = (self.k.diagonal(), self.m.diagonal());
        let ratios: Vec<f64> = (k.iter().zip(&m))
            .filter(|r| *r.1 > 0.0)
            .map(|(k, m)| k / m)
            .collect();
        let largest = ratios.iter().copied().fold(0.0, f64::max);
        if ratios.is_empty() {
            return None;
        }
        let valid_ratios = ratios.iter().copied().filter(|&r| r > NO_RATIO * largest);
        let smallest = valid_ratios.fold(f64::INFINITY, f64::min);
        // The rows with mass have no stiffness, so any shift works.
        Some(if smallest.is_finite() {
            FIRST_SHARE * smallest
        } else {
            1.0
        })
    }

    fn solve(&self, shift: f64, wanted: usize) -> Result<Spectrum, StructureError> {
        let first = shift;
        let mut shift = shift;
        let mut failure = None;
        for _ in 0..TRIALS {
            match self.attempt(&self.k.plus(shift, &self.m), shift, wanted) {
                Err(StructureError::Factorization {
                    source: LinalgError::NotPositiveDefinite { .. },
                    ..
                }) => shift *= LARGER,
                // A pivot that is only rounding makes the entries huge, and the eigenvalues do not converge.
                Err(StructureError::Factorization {
                    source: LinalgError::NoEigenvalues { .. },
                    ..
                }) => break,
                Err(error) => {
                    failure = Some(error);
                    break;
                }
                done => return done,
            }
        }
        if let Some(error) = failure {
            return Err(error);
        }
        // Restart from the first shift with a small stiffness added on the whole diagonal.
        let largest = self
            .k
            .diagonal()
            .iter()
            .fold(0.0, |a: f64, v| a.max(v.abs()));
        let diagonal: Vec<(u32, u32, f64)> = (self.k.diagonal().iter().enumerate())
            .map(|(j, v)| {
                (
                    j as u32,
                    j as u32,
                    STEADYING * v.abs().max(STEADYING * largest),
                )
            })
            .collect();
        let added_stiffness = SparseSymmetric::from_sorted(self.k.size(), &diagonal);
        let matrix = self.k.plus(first, &self.m).plus(1.0, &added_stiffness);
        let mut spectrum = self.attempt(&matrix, first, wanted)?;
        spectrum.is_steadied = true;
        Ok(spectrum)
    }

    fn attempt(
        &self,
        shifted: &SparseSymmetric,
        shift: f64,
        wanted: usize,
    ) -> Result<Spectrum, StructureError> {
        let (omega_squared, shapes) = if self.k.size() <= DENSE {
            dense_modes(&self.m, shifted, shift, wanted)?
        } else {
            self.sparse(shifted, shift, wanted)?
        };
        let modes = omega_squared.iter().enumerate().map(|(mode, &square)| {
            let (energy, scale) = self.energy(shapes.column(mode));
            let resistance = if scale > 0.0 { energy / scale } else { 0.0 };
            Mode {
                square,
                resistance,
                is_rigid: resistance.abs() <= RIGID * self.precision,
            }
        });
        Ok(Spectrum {
            modes: modes.collect(),
            shift,
            is_steadied: false,
        })
    }

    /// Returns φᵀKφ and Σ|φᵢKᵢⱼφⱼ|.
    fn energy(&self, shape: &[f64]) -> (f64, f64) {
        let (mut energy, mut scale) = (0.0, 0.0);
        for j in 0..self.k.size() {
            for (i, v) in self.k.column(j) {
                let multiplicity = if i == j { 1.0 } else { 2.0 };
                let part = multiplicity * shape[i] * v * shape[j];
                energy += part;
                scale += part.abs();
            }
        }
        (energy, scale)
    }

    fn sparse(
        &self,
        shifted: &SparseSymmetric,
        shift: f64,
        wanted: usize,
    ) -> Result<(Vec<f64>, Matrix), StructureError> {
        let fail = |source| StructureError::Factorization {
            matrix: "the shifted stiffness",
            source,
        };
        let order = elimination_order(shifted, self.places.as_deref(), &[])?;
        let factor = SparseCholesky::new(shifted, &order).map_err(fail)?;
        let rows_with_mass = self.m.diagonal().iter().filter(|v| **v > 0.0).count();
        let mut options = ModeOptions::new(wanted.min(rows_with_mass));
        options.block = BLOCK;
        let rigid = Matrix::zeros(self.k.size(), 0);
        let modes = lowest_of(&self.m, &factor, shift, &rigid, &options, true)?;
        // `omega` is zero where ω² is negative. The Rayleigh quotient keeps the sign.
        let squares = (0..modes.omega.len()).map(|mode| {
            let square = modes.omega[mode] * modes.omega[mode];
            if square > 0.0 {
                square
            } else {
                self.energy(modes.shapes.column(mode)).0
            }
        });
        Ok((squares.collect(), modes.shapes))
    }
}

/// Computes ω² and the shapes of the lowest modes by a dense method, with φᵀ(K + shift·M)φ = 1.
pub(super) fn dense_modes(
    mass: &SparseSymmetric,
    shifted: &SparseSymmetric,
    shift: f64,
    wanted: usize,
) -> Result<(Vec<f64>, Matrix), StructureError> {
    let fail = |matrix, source| StructureError::Factorization { matrix, source };
    let size = mass.size();
    let full = |sparse: &SparseSymmetric| {
        let mut full = Matrix::zeros(size, size);
        for j in 0..size {
            for (i, v) in sparse.column(j) {
                full[(i, j)] = v;
                full[(j, i)] = v;
            }
        }
        full
    };
    let factor = full(shifted)
        .cholesky()
        .map_err(|e| fail("the shifted stiffness", e))?;
    let mut inner = full(mass);
    factor.solve_lower(&mut inner);
    factor.solve_upper_right(&mut inner);
    let (theta, mut vectors) = inner.symmetric_eigen().map_err(|e| fail("the mass", e))?;
    factor.solve_lower_transposed(&mut vectors);
    let largest = theta.last().copied().unwrap_or(0.0);
    let kept_modes: Vec<usize> = (0..size)
        .rev()
        .filter(|&k| theta[k] > NO_MASS * largest)
        .take(wanted)
        .collect();
    let squares = kept_modes.iter().map(|&k| 1.0 / theta[k] - shift).collect();
    let shapes = Matrix::from_fn(size, kept_modes.len(), |i, mode| {
        vectors[(i, kept_modes[mode])]
    });
    Ok((squares, shapes))
}
