//! Contact stiffness by exact linearisation on the contact set. No cell enters the set, leaves the set or slips.
//!
//! kn is the slope dN/dδ of the indentation curve, kt the slope dT/dδ at full stick. Capped cells carry a fixed
//! pressure, so they count in kt but not in kn.
//!
//! [`normal`] and [`tangential`] use the diagonal blocks of K: kn where the surfaces slide freely, kt at given
//! pressures. [`coupled`] uses the whole K, for bodies with different elastic constants. [`coupled`] assumes that all
//! cells stick. With the whole K, a normal motion causes shear and a tangential motion causes pressure. The normal and
//! the tangential stiffness increase by a fraction of order β².
//!
//! ```
//! use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair, stiffness};
//! use fretwear::grid::Grid;
//! use fretwear::reference::CircularPunch;
//!
//! // A flat round punch of 0.4 mm radius, on cells.
//! let (radius, grid) = (0.4e-3, Grid::over([1e-3, 0.9e-3], [80, 64]));
//! let steel = Pair::same(Elastic { youngs_modulus: 198.4e9, poisson_ratio: 0.3 });
//! let under = |c| {
//!     let (i, j) = grid.cell(c);
//!     let (x, y) = grid.centre(i, j);
//!     x.hypot(y) <= radius
//! };
//! let cells: Vec<bool> = (0..grid.len()).map(under).collect();
//! let mut half_space = HalfSpace::new(grid, steel, Boundary::Free);
//! let kn = stiffness::normal(&mut half_space, &cells)?.total;
//!
//! // Exact stiffness: 2 E* a.
//! let exact = CircularPunch { radius, pair: steel }.normal_stiffness();
//! assert!((kn / exact - 1.0).abs() < 0.01);
//! # Ok::<(), fretwear::contact::ContactError>(())
//! ```

mod linearise;

use self::linearise::{Field, Traction, linearise};
use super::error::ContactError;
use super::half_space::{Boundary, HalfSpace, Shear};
use super::tangential::{compliance, stiffness};
use crate::grid::ByAxis;

/// Relative error of the tractions, in the energy norm, at which a solve stops. The stiffness is that energy, so the
/// relative error of the stiffness is at most the square of the tolerance. The estimated energy of further iterations
/// is added to the stiffness, so that the stiffness is accurate to 1e-7.
pub const TOLERANCE: f64 = 2e-4;

/// Tolerance of the tractions for a stiffness that is reported for a contact. The contact itself is solved to some
/// 1e-6.
pub const FIGURE_TOLERANCE: f64 = 1e-3;

/// Tolerance of the tractions for a stiffness that serves only for comparison with another stiffness. The relative
/// error of the stiffness is about 1e-4, the square of the tolerance.
pub const COMPARISON_TOLERANCE: f64 = 1e-2;

/// Tolerance of the tractions where the densities of single cells are used. The relative error of the densities is
/// about the tolerance of the tractions.
const LOCAL_TOLERANCE: f64 = 3e-6;

/// Tolerance of the tractions where several motions are combined. The relative error of each motion's resultants is the
/// square of the tolerance. Differences of resultants lose some digits.
const COMBINED_MOTIONS_TOLERANCE: f64 = 1e-4;

/// Smallest rotational stiffness, as a fraction of the sum of the stiffness's terms. A smaller stiffness is rounding,
/// and the cells do not resist the rotation.
const SINGULAR: f64 = 1e-6;

/// Fraction of cells in contact from which a periodic contact is nearly rigid. The pressures of kn are then almost
/// uniform and no useful start for kt.
const NEARLY_FULL: f64 = 0.8;

/// Tractions under a unit displacement of a set of cells, and their resultant.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness {
    /// Traction per displacement on each cell, 0 off the set; one field per axis \[Pa/m\]. If only the total was
    /// requested, the densities are accurate to some 1e-4 of the whole.
    pub density: ByAxis<Vec<f64>>,
    /// Resultant along the displacement \[N/m\]. The stiffness is infinite for a full periodic contact, where no load
    /// causes a displacement relative to the mean.
    pub total: f64,
    /// Conjugate gradient iterations.
    pub iterations: usize,
}

impl Stiffness {
    /// Replaces the total by the sum of the densities, for densities that are as accurate as the total.
    fn of_density(self, cell_area: f64) -> Self {
        let total = match self.total.is_finite() {
            true => self.density[0].iter().sum::<f64>() * cell_area,
            false => self.total,
        };
        Stiffness { total, ..self }
    }
}

/// Tractions under a motion, and the residual: the part of the displacement that they do not reach.
struct MotionSolution {
    density: Field,
    residual: Field,
    /// Energy of the motion divided by the cell area.
    energy: f64,
    iterations: usize,
}

impl MotionSolution {
    fn stiffness(self, cell_area: f64) -> Stiffness {
        Stiffness {
            density: self.density,
            total: self.energy * cell_area,
            iterations: self.iterations,
        }
    }
}

/// Returns the cells in contact below the pressure cap, whose pressure a higher load would increase.
pub fn elastic_cells(pressure: &[f64], pressure_cap: Option<f64>) -> Vec<bool> {
    let cap = pressure_cap.unwrap_or(f64::INFINITY);
    pressure.iter().map(|&p| p > 0.0 && p < cap).collect()
}

/// Computes the normal stiffness kn = 1ᵀ K_CC⁻¹ 1 dA of bodies that do not rotate. C is the set of cells in `set`.
pub fn normal(half_space: &mut HalfSpace, set: &[bool]) -> Result<Stiffness, ContactError> {
    normal_to(half_space, set, TOLERANCE)
}

/// Computes [`normal`] to a given relative error of the tractions.
pub fn normal_to(
    half_space: &mut HalfSpace,
    set: &[bool],
    tolerance: f64,
) -> Result<Stiffness, ContactError> {
    let moved = normal_under(half_space, set, tolerance, |_| 1.0)?;
    Ok(moved.stiffness(half_space.grid().cell_area()))
}

/// Computes [`normal`] with densities as accurate as the total.
pub fn local_normal(half_space: &mut HalfSpace, set: &[bool]) -> Result<Stiffness, ContactError> {
    Ok(normal_to(half_space, set, LOCAL_TOLERANCE)?.of_density(half_space.grid().cell_area()))
}

/// Computes the normal stiffness kn = dN/dδ of bodies that can rotate, over the cells of `set`. The moments about the
/// grid's centre stay constant.
///
/// The matrix S contains the resultants of the pressures under a unit approach and unit rotations. The result is
/// 1/(S⁻¹)₀₀. A rotation that the cells do not resist stays zero.
pub fn normal_with_rotation(
    half_space: &mut HalfSpace,
    set: &[bool],
) -> Result<Stiffness, ContactError> {
    let grid = half_space.grid();
    let field = |c: usize| {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        [1.0, y, -x]
    };
    let moved = [0, 1, 2]
        .map(|k| normal_under(half_space, set, COMBINED_MOTIONS_TOLERANCE, |c| field(c)[k]))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    Ok(condense(moved, grid.cell_area(), |motion, _, c| {
        field(c)[motion]
    }))
}

/// Returns the stiffness against the first of several motions, while the others adjust so that their resultants vanish.
/// `field` returns the displacement of a motion along an axis at a cell. A motion that the cells do not resist is left
/// out.
fn condense(
    mut moved: Vec<MotionSolution>,
    cell_area: f64,
    field: impl Fn(usize, usize, usize) -> f64,
) -> Stiffness {
    let sum = |density: &Field, part: &dyn Fn(usize, usize, f64) -> f64| -> f64 {
        let on_axis = |(axis, density): (usize, &Vec<f64>)| {
            let cells = density.iter().enumerate().filter(|(_, q)| **q != 0.0);
            cells.map(|(c, q)| part(axis, c, *q)).sum::<f64>()
        };
        density.iter().enumerate().map(on_axis).sum()
    };
    // Compute the resultant of motion a's tractions along motion b. Add the work of motion b's tractions on the
    // residual of motion a. The sum is accurate, and symmetric, to second order.
    let count = moved.len();
    let resultant = |a: usize, b: usize| {
        sum(&moved[a].density, &|axis, c, q| q * field(b, axis, c))
            + sum(&moved[b].density, &|axis, c, q| {
                q * moved[a].residual[axis][c]
            })
    };
    let mut resultants = vec![vec![0.0; count]; count];
    for a in 0..count {
        for b in 0..=a {
            resultants[a][b] = resultant(a, b);
            resultants[b][a] = resultants[a][b];
        }
    }
    let terms = |motion: usize| {
        sum(&moved[motion].density, &|axis, c, q| {
            (q * field(motion, axis, c)).abs()
        })
    };
    let terms: Vec<f64> = (0..count).map(terms).collect();
    while moved.len() > 1
        && let Some(follower) = moved.pop()
    {
        let motion = moved.len();
        let own = resultants[motion][motion];
        let is_resisted = own > SINGULAR * terms[motion];
        for (k, other) in moved.iter_mut().enumerate() {
            other.iterations += follower.iterations;
            if !is_resisted {
                continue;
            }
            let part = resultants[k][motion] / own;
            for (density, follower_density) in other.density.iter_mut().zip(&follower.density) {
                for (density, follower_density) in density.iter_mut().zip(follower_density) {
                    *density -= part * follower_density;
                }
            }
            for l in 0..motion {
                resultants[k][l] -= part * resultants[motion][l];
            }
        }
    }
    let mut first = moved.remove(0);
    first.energy = resultants[0][0];
    first.stiffness(cell_area)
}

/// Computes the pressures on the cells of `set` that cause the displacement `motion` of each cell.
fn normal_under(
    half_space: &mut HalfSpace,
    set: &[bool],
    tolerance: f64,
    motion: impl Fn(usize) -> f64,
) -> Result<MotionSolution, ContactError> {
    linearise(
        half_space,
        &[set],
        tolerance,
        None,
        &[Traction::Pressure],
        |_, c| motion(c),
        |h, p, u| h.normal(&p[0], &mut u[0]),
        |h, u, p| h.normal_inverse(&u[0], &mut p[0]),
    )
}

/// Computes kt along x over the cells of `set`. With [`Shear::InPlane`] the transverse displacement is zero.
pub fn tangential(
    half_space: &mut HalfSpace,
    set: &[bool],
    shear: Shear,
) -> Result<Stiffness, ContactError> {
    tangential_to(half_space, set, shear, TOLERANCE)
}

/// Computes [`tangential`] with densities as accurate as the total.
pub fn local_tangential(
    half_space: &mut HalfSpace,
    set: &[bool],
    shear: Shear,
) -> Result<Stiffness, ContactError> {
    let result = tangential_to(half_space, set, shear, LOCAL_TOLERANCE)?;
    Ok(result.of_density(half_space.grid().cell_area()))
}

/// Computes [`tangential`] to a given relative error of the tractions.
pub fn tangential_to(
    half_space: &mut HalfSpace,
    set: &[bool],
    shear: Shear,
    tolerance: f64,
) -> Result<Stiffness, ContactError> {
    tangential_from(half_space, set, shear, tolerance, None)
}

/// Computes [`tangential_to`], starting from kn of the same contact. The pressures of kn are nearly proportional to the
/// shear of kt.
pub fn tangential_from(
    half_space: &mut HalfSpace,
    set: &[bool],
    shear: Shear,
    tolerance: f64,
    normal: Option<&Stiffness>,
) -> Result<Stiffness, ContactError> {
    let fields = shear.tractions();
    let share = set.iter().filter(|c| **c).count() as f64 / set.len() as f64;
    let nearly_full = half_space.boundary() == Boundary::Periodic && share > NEARLY_FULL;
    let normal = normal.filter(|_| !nearly_full);
    let moved = linearise(
        half_space,
        &vec![set; fields.len()],
        tolerance,
        normal.map(|normal| &normal.density[0][..]),
        fields,
        |axis, _| if axis == 0 { 1.0 } else { 0.0 },
        compliance,
        stiffness,
    )?;
    Ok(moved.stiffness(half_space.grid().cell_area()))
}

/// Rigid motion by a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Unit approach, with no tangential motion.
    Normal,
    /// Unit displacement along x, at a constant approach and with no motion along y.
    AlongX,
}

/// Computes kn or kt of the whole K. The elastic cells `pressed` keep their gap closed, and the cells `stuck` do not
/// slip. The pressure changes only on the cells `pressed`, and the shear changes only on the cells `stuck`. The
/// densities are the pressure, then the shear along each axis. The solve stops at `tolerance`, a relative error of the
/// tractions.
pub fn coupled(
    half_space: &mut HalfSpace,
    direction: Direction,
    pressed: &[bool],
    stuck: &[bool],
    shear: Shear,
    tolerance: f64,
) -> Result<Stiffness, ContactError> {
    let mut unit = match shear {
        Shear::AlongX => vec![0.0; 2],
        Shear::InPlane => vec![0.0; 3],
    };
    unit[usize::from(direction == Direction::AlongX)] = 1.0;
    let mut sets = vec![stuck; unit.len()];
    sets[0] = pressed;
    let cells = half_space.grid().len();
    let mut lag = vec![vec![0.0; cells]; unit.len() - 1];
    let mut opening = vec![0.0; cells];
    let moved = linearise(
        half_space,
        &sets,
        tolerance,
        None,
        &[&[Traction::Pressure], shear.tractions()].concat(),
        |axis, _| unit[axis],
        |half_space, traction, displacement| {
            let shear = traction[1..].to_vec();
            let mut along = displacement.split_off(1);
            half_space.normal(&traction[0], &mut displacement[0]);
            compliance(half_space, &shear, &mut along);
            displacement.extend(along);
            half_space.normal_of_shear(&shear, &mut opening);
            half_space.shear_of_normal(&traction[0], &mut lag);
            for (u, w) in displacement
                .iter_mut()
                .zip([&opening].into_iter().chain(&lag))
            {
                u.iter_mut().zip(w).for_each(|(u, w)| *u += w);
            }
        },
        |half_space, displacement, traction| {
            let mut shear = traction.split_off(1);
            half_space.normal_inverse(&displacement[0], &mut traction[0]);
            stiffness(half_space, &displacement[1..].to_vec(), &mut shear);
            traction.extend(shear);
        },
    )?;
    Ok(moved.stiffness(half_space.grid().cell_area()))
}
