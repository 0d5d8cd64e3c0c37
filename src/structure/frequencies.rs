//! Natural frequencies of K φ = ω² M φ for matrices from elsewhere: singular stiffness, mass on some rows only, units of any kind.
//!
//! Both are met by (K + s·M)⁻¹ M, s > 0: a rigid mode has there the eigenvalue 1/s, what has no mass the eigenvalue 0, so that rows
//! without mass are condensed statically without being sought out. s is found from the lowest elastic mode itself.

use crate::linalg::{LinalgError, Matrix, SparseCholesky, SparseSymmetric};
use crate::structure::StructureError;
use crate::structure::matrices::Matrices;
use crate::structure::modes::{ModeOptions, lowest_of};
use crate::structure::order::elimination_order;

/// A diagonal of the stiffness from here on is no spring but holds a row: Abaqus writes 1e36 there.
const HELD: f64 = 1e30;
/// Rows up to which all eigenvalues are computed densely: some seconds.
pub(super) const DENSE: usize = 450;
/// The first shift is this share of the smallest ratio of the diagonals of K and M, which the lowest frequency squared is not above.
const FIRST_SHARE: f64 = 1e-3;
/// Ratios of diagonals below this share of the largest are rounding of zero.
const NO_RATIO: f64 = 1e-14;
/// The shift may be so much above, and below, the lowest elastic ω²: the digits lost are those of the ratio.
const SHIFTS: [f64; 2] = [1e-4, 10.0];
/// A shift under which K + s·M is not positive definite but for rounding is made so much larger, so many times.
const LARGER: f64 = 100.0;
const TRIALS: usize = 8;
/// Where no shift helps, massless rows have nothing that resists them: this share of the diagonal of K is added to it.
const STEADYING: f64 = 1e-11;
/// A mode is rigid if φᵀKφ is below this times the precision of the entries, as a share of Σ|φᵢKᵢⱼφⱼ|: rounding of the entries
/// leaves up to their precision.
const RIGID: f64 = 20.0;
/// A program that has reduced a structure leaves more than the rounding of its entries. Modes that nearly nothing resists, by this share,
/// are rigid too where those above them are so much faster.
const NEARLY_RIGID: f64 = 1e-10;
const GAP: f64 = 1e3;
/// The precision of entries that a program has summed up in double precision, on average.
pub(super) const SUMMED: f64 = 5e-16;
/// Modes are sought in excess of those asked for, by the rigid modes of a body.
const BODY: usize = 6;
/// An eigenvalue of (K + sM)⁻¹M below this share of the largest is that of no mass.
const NO_MASS: f64 = 1e-13;
/// Vectors of a block of the Lanczos process: the rigid modes of a body are equal.
const BLOCK: usize = 6;

/// What vibrates, and how fast.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frequencies {
    /// Lowest elastic frequencies over the unit of time, ascending: hertz if that is the second.
    pub elastic: Vec<f64>,
    /// What rounding has left of the frequencies of rigid modes, zero where ω² came out negative.
    pub rigid: Vec<f64>,
    /// ω² of modes that the stiffness drives away, but for rounding.
    pub unstable: Vec<f64>,
    /// Rows that took part.
    pub rows: usize,
    /// Rows held by the user's choice.
    pub fixed: usize,
    /// Rows that the file holds by a penalty on the diagonal.
    pub held: usize,
    /// Rows without any entry that is not zero, left out.
    pub empty: usize,
    /// Rows of bodies that have no mass at all, left out.
    pub massless: usize,
    /// Something was added to the stiffness of rows without mass that nothing resists.
    pub is_steadied: bool,
    /// Some motion is resisted by no stiffness.
    pub is_singular: bool,
}

/// Which rows the stiffness holds by a penalty.
pub fn held(matrices: &Matrices) -> Vec<bool> {
    let diagonal = matrices.stiffness.as_ref().map(|k| k.diagonal());
    (diagonal.unwrap_or_default().iter())
        .map(|v| v.abs() >= HELD)
        .collect()
}

/// The lowest `count` elastic frequencies with some rows held; `None` where a file gives no stiffness or no mass.
///
/// # Errors
/// [`StructureError`] where nothing has mass, memory does not suffice or the modes do not converge.
pub fn lowest_frequencies(
    matrices: &Matrices,
    is_fixed: &[bool],
    count: usize,
) -> Result<Option<Frequencies>, StructureError> {
    let (Some(stiffness), Some(mass)) = (&matrices.stiffness, &matrices.mass) else {
        return Ok(None);
    };
    let held = held(matrices);
    let mut has_entry = vec![false; matrices.size];
    for &(i, j, v) in stiffness.entries.iter().chain(&mass.entries) {
        if v != 0.0 {
            has_entry[i as usize] = true;
            has_entry[j as usize] = true;
        }
    }
    let mut found = Frequencies::default();
    let mut place = vec![None; matrices.size];
    for row in 0..matrices.size {
        if is_fixed.get(row).copied().unwrap_or(false) {
            found.fixed += 1;
        } else if held[row] {
            found.held += 1;
        } else if !has_entry[row] {
            found.empty += 1;
        } else {
            place[row] = Some(found.rows as u32);
            found.rows += 1;
        }
    }
    if count == 0 {
        return Ok(Some(found));
    }
    let precision = stiffness.precision.max(SUMMED);
    let (k, m) = (stiffness.lower(&place), mass.lower(&place));
    let places = matrices.places(&place);
    let whole = Whole {
        rows: found.rows,
        k: &k,
        m: &m,
        precision,
        places: places.as_deref(),
    };
    let whole = whole.spectrum(count)?;
    (found.massless, found.is_steadied) = (whole.massless, whole.is_steadied);
    if found.massless == found.rows {
        return Err(StructureError::TooManyModes {
            wanted: count,
            available: 0,
        });
    }
    let hertz = |square: f64| square.max(0.0).sqrt() / (2.0 * std::f64::consts::PI);
    for mode in &whole.modes {
        if mode.is_rigid {
            found.rigid.push(hertz(mode.square));
        } else if mode.square < 0.0 {
            found.unstable.push(mode.square);
        } else if found.elastic.len() < count {
            found.elastic.push(hertz(mode.square));
        }
    }
    found.is_singular = found.empty > 0 || !found.rigid.is_empty() || found.is_steadied;
    Ok(Some(found))
}

/// Lowest modes of all bodies together.
pub(super) struct Lowest {
    /// In order of ω².
    modes: Vec<Mode>,
    /// Rows of bodies without any mass.
    pub massless: usize,
    /// Something was added to the stiffness of rows without mass that nothing resists.
    pub is_steadied: bool,
}

impl Lowest {
    /// How many modes nothing resists.
    pub fn rigid(&self) -> usize {
        self.modes.iter().filter(|mode| mode.is_rigid).count()
    }

    /// ω² of the elastic ones, ascending.
    pub fn elastic(&self) -> impl Iterator<Item = f64> + '_ {
        let elastic = self.modes.iter().filter(|mode| !mode.is_rigid);
        elastic.map(|mode| mode.square)
    }
}

/// Stiffness and mass of all bodies, by their lower triangles, sorted.
pub(super) struct Whole<'a> {
    pub rows: usize,
    pub k: &'a [(u32, u32, f64)],
    pub m: &'a [(u32, u32, f64)],
    /// Half a unit of the last digit of the stiffness's entries, over them.
    pub precision: f64,
    /// Where each row is, where that is known of all.
    pub places: Option<&'a [[f64; 3]]>,
}

impl Whole<'_> {
    /// The lowest modes, `count` elastic ones of each body at least.
    pub(super) fn spectrum(&self, count: usize) -> Result<Lowest, StructureError> {
        let mut lowest = Lowest {
            modes: Vec::new(),
            massless: 0,
            is_steadied: false,
        };
        for pencil in self.apart() {
            let Some(spectrum) = pencil.lowest(count)? else {
                lowest.massless += pencil.k.size();
                continue;
            };
            lowest.is_steadied |= spectrum.is_steadied;
            lowest.modes.extend(spectrum.modes);
        }
        let by_square = |a: &Mode, b: &Mode| a.square.total_cmp(&b.square);
        lowest.modes.sort_by(by_square);
        Ok(lowest)
    }

    /// The matrices of each body by itself: bodies that are alike have modes of one frequency, more of them than Lanczos would find.
    fn apart(&self) -> Vec<Pencil> {
        let (body, bodies) = bodies(self.rows, self.k, self.m);
        let mut rows_of = vec![Vec::new(); bodies];
        let mut place = Vec::with_capacity(body.len());
        for (row, &of) in body.iter().enumerate() {
            place.push(rows_of[of as usize].len() as u32);
            rows_of[of as usize].push(row);
        }
        let shared = |entries: &[(u32, u32, f64)]| {
            let mut parts = vec![Vec::new(); bodies];
            for &(j, i, v) in entries.iter().filter(|e| e.2 != 0.0) {
                parts[body[j as usize] as usize].push((place[j as usize], place[i as usize], v));
            }
            parts
        };
        let parts = shared(self.k).into_iter().zip(shared(self.m)).zip(rows_of);
        let pencil = |((k, m), rows): ((Vec<_>, Vec<_>), Vec<usize>)| Pencil {
            k: SparseSymmetric::from_sorted(rows.len(), &k),
            m: SparseSymmetric::from_sorted(rows.len(), &m),
            precision: self.precision,
            places: (self.places).map(|places| rows.iter().map(|&row| places[row]).collect()),
        };
        parts.map(pencil).collect()
    }
}

/// Which body each row belongs to, rows that an entry joins being of one, and how many bodies there are.
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
            // The first row of a body stands for it.
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
    /// φᵀKφ as a share of Σ|φᵢKᵢⱼφⱼ|.
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
    /// Takes the slowest modes for rigid that rounding alone can have made elastic, up to the gap above them.
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
    /// The lowest modes, the shift being brought near the lowest elastic one; `None` without any mass.
    fn lowest(&self, count: usize) -> Result<Option<Spectrum>, StructureError> {
        let Some(mut shift) = self.first_shift() else {
            return Ok(None);
        };
        let mut wanted = count + BODY;
        let mut best: Option<Spectrum> = None;
        for _ in 0..TRIALS {
            let mut spectrum = match self.solve(shift, wanted) {
                Ok(spectrum) => spectrum,
                // A smaller shift than the last, which did: no more digits are to be had.
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
                // Unless it was tried before.
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
        let sound = ratios.iter().copied().filter(|&r| r > NO_RATIO * largest);
        let smallest = sound.fold(f64::INFINITY, f64::min);
        // No stiffness at all on what has mass: any shift will do.
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
                // A pivot of nothing but rounding divides by next to nothing.
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
        // Back to the first shift, on a stiffness that resists a little everywhere.
        let typical = self
            .k
            .diagonal()
            .iter()
            .fold(0.0, |a: f64, v| a.max(v.abs()));
        let diagonal: Vec<(u32, u32, f64)> = (self.k.diagonal().iter().enumerate())
            .map(|(j, v)| {
                (
                    j as u32,
                    j as u32,
                    STEADYING * v.abs().max(STEADYING * typical),
                )
            })
            .collect();
        let steady = SparseSymmetric::from_sorted(self.k.size(), &diagonal);
        let matrix = self.k.plus(first, &self.m).plus(1.0, &steady);
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
            dense(&self.m, shifted, shift, wanted)?
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

    /// φᵀKφ and Σ|φᵢKᵢⱼφⱼ|.
    fn energy(&self, shape: &[f64]) -> (f64, f64) {
        let (mut energy, mut scale) = (0.0, 0.0);
        for j in 0..self.k.size() {
            for (i, v) in self.k.column(j) {
                let both = if i == j { 1.0 } else { 2.0 };
                let part = both * shape[i] * v * shape[j];
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
        let massive = self.m.diagonal().iter().filter(|v| **v > 0.0).count();
        let mut options = ModeOptions::new(wanted.min(massive));
        options.block = BLOCK;
        let rigid = Matrix::zeros(self.k.size(), 0);
        let modes = lowest_of(&self.m, &factor, shift, &rigid, &options, true)?;
        // ω is cut off at zero there; the Rayleigh quotient is not.
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

/// ω² and shapes of the lowest modes, by all of them; φᵀ(K + shift·M)φ = 1.
pub(super) fn dense(
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
    let sound: Vec<usize> = (0..size)
        .rev()
        .filter(|&k| theta[k] > NO_MASS * largest)
        .take(wanted)
        .collect();
    let squares = sound.iter().map(|&k| 1.0 / theta[k] - shift).collect();
    let shapes = Matrix::from_fn(size, sound.len(), |i, mode| vectors[(i, sound[mode])]);
    Ok((squares, shapes))
}
