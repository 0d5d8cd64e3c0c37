//! Normal contact of a structure's bodies under static loads.
//!
//! The gap of a cell is g = −h + K p + A S (G − M) Sᵀ p + S u − (δ + θ_x y − θ_y x), with
//! - K the compliance of the half spaces,
//! - G the compliance of the structure between the nodes of the joint,
//! - M the compliance of the half spaces that the structure's mesh already represents between these nodes,
//! - S the mean of each node's shape function over a cell, and A the area of a cell,
//! - u the opening of the nodes by the loads,
//! - δ and θ the approach and the rotations along which the bodies are free.
//!
//! The compliance of the structure is the sum G = Q + V C Vᵀ. The matrix C is the soft compliance along the held
//! motions V ([`crate::structure::statics`]). The contact solver uses Q alone and frees all motions. Resultants r of
//! the pressure drive the held motions. Broyden's method [Broyden 1965] finds the resultants r for which the held
//! motions are −C r. Broyden's method takes a few contact solves, and the contact solver never uses a compliance far
//! softer than the contact.
//!
//! Under a prescribed *load*, the compliance of the joint is K + A S (G − M) Sᵀ. Under prescribed nodal displacements,
//! the compliance of the joint is K − A S M Sᵀ. The nodal displacements already include the compliance G
//! ([`super::cycle`]).

use std::sync::Arc;

use super::{FrettingJoint, WearError};
use crate::contact::nodes::NodalCompliance;
use crate::contact::normal::{
    self, Control, Freedom, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::{ContactError, HalfSpace};
use crate::grid::Patch;
use crate::linalg::RowMatrix;

/// Effect of static loads on a joint, node by node.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalLoad {
    /// Opening of each node by the loads alone, without contact pressure \[m\].
    pub opening: Vec<f64>,
    /// Resultant of the pressure along each free motion that balances the loads \[N m\].
    pub resultants: Vec<f64>,
    /// Two works of the nodal load without contact pressure \[N m\]. The first work is on the displacements by the
    /// preload, and the second work is on the displacements by all other static loads.
    pub work: [f64; 2],
}

/// Rigid motions between the bodies of a structure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyMotions {
    /// Motions along which the bodies are free: approach and rotations.
    pub free: Vec<[f64; 3]>,
    /// Motions that the structure holds softly, other than the `free` motions.
    pub restrained: Vec<[f64; 3]>,
    /// Compliance between the held motions, row by row \[m/N\].
    pub compliance: Vec<f64>,
}

/// Bodies of a structure, pressed together by a preload and other static loads.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedBodies {
    added: Arc<NodalCompliance>,
    bodies: BodyMotions,
    /// Opening of the cells by a preload of 1 N, and by all static loads except the preload. `resultants` has the
    /// resultants in the same order.
    opening: [Vec<f64>; 2],
    resultants: [Vec<f64>; 2],
    /// Opening of all cells at first touch \[m\].
    first_touch_opening: f64,
    /// Preload \[N\].
    pub preload: f64,
    /// Fraction of all loads that acts.
    pub load_fraction: f64,
    /// Approach of the preload's ends towards each other in the last contact \[m\].
    pub shortening: f64,
    /// Two works of a preload of 1 N. The first work is on the displacements by the preload, and the second work is on
    /// the displacements by all other static loads.
    work: [f64; 2],
    /// Ratio of the structure's compliance between neighbouring nodes to the compliance of its mesh on half spaces.
    /// `mesh_ratio` is `None` if the joint is too small for an estimate of the ratio.
    pub mesh_ratio: Option<f64>,
}

impl PressedBodies {
    /// Creates bodies whose normal compliance is `added` to the compliance of the half spaces, Q − M \[m/N\]. The two
    /// `loads` are a preload of 1 N and the sum of all other static loads. `top` is the highest point of the surface
    /// \[m\]. Bodies that are not free to approach start at the position where the highest point begins to touch. The
    /// preload starts at 0.
    pub fn new(
        added: Arc<NodalCompliance>,
        bodies: BodyMotions,
        loads: [NodalLoad; 2],
        top: f64,
    ) -> Self {
        let interpolation = &added.interpolation;
        let cells = |nodes: &[f64]| {
            let mut cells = vec![0.0; interpolation.grid().len()];
            interpolation.add_interpolated(1.0, nodes, &mut cells);
            cells
        };
        let opening = [0, 1].map(|k| cells(&loads[k].opening));
        let work = loads[0].work;
        let resultants = loads.map(|load| load.resultants);
        let closes = |[_, x, y]: &[f64; 3]| *x == 0.0 && *y == 0.0;
        let is_held = !bodies.free.iter().any(closes);
        PressedBodies {
            added,
            bodies,
            opening,
            resultants,
            first_touch_opening: if is_held { top } else { 0.0 },
            preload: 0.0,
            load_fraction: 1.0,
            shortening: 0.0,
            work,
            mesh_ratio: None,
        }
    }

    /// Returns the opening of each cell by the loads alone, without contact pressure \[m\].
    pub(super) fn opening(&self) -> Vec<f64> {
        let [preload, others] = &self.opening;
        let both = preload.iter().zip(others);
        both.map(|(by_preload, other)| {
            self.first_touch_opening + self.load_fraction * (self.preload * by_preload + other)
        })
        .collect()
    }

    /// Returns the free motions with the loads along them, and the held motions with their resultants.
    fn control(&self, held_resultants: &[f64]) -> Control {
        let mut freedom = Freedom::default();
        let [preload, others] = &self.resultants;
        for (motion, (by_preload, other)) in self.bodies.free.iter().zip(preload.iter().zip(others))
        {
            freedom.add(
                *motion,
                self.load_fraction * (self.preload * by_preload + other),
            );
        }
        for (motion, resultant) in self.bodies.restrained.iter().zip(held_resultants) {
            freedom.add(*motion, *resultant);
        }
        Control::Free(freedom)
    }

    /// Solves the contact problem `problem` under the loads of the pressed bodies. The loads of the bodies replace the
    /// control and the rotation of `problem`. The caller subtracts the opening by the loads from the heights of
    /// `problem`.
    ///
    /// # Errors
    /// [`ContactError`] if a contact solve fails. `solve` also returns [`ContactError::NotConverged`] if Broyden's
    /// method does not converge.
    pub(super) fn solve(
        &self,
        half_space: &mut HalfSpace,
        problem: NormalProblem<'_>,
        start: Option<&[f64]>,
        options: NormalOptions,
    ) -> Result<NormalSolution, WearError> {
        let added = Some(self.added.clone());
        let solved = half_space.with_nodal(added, |half_space| {
            match self.bodies.restrained.is_empty() {
                true => {
                    let problem = self.with_resultants(problem, &[]);
                    normal::solve(half_space, &problem, start, options)
                }
                false => self.solve_held(half_space, problem, start, options),
            }
        });
        Ok(solved??)
    }

    fn with_resultants<'a>(
        &self,
        problem: NormalProblem<'a>,
        held_resultants: &[f64],
    ) -> NormalProblem<'a> {
        NormalProblem {
            control: self.control(held_resultants),
            rotation: Rotation::FIXED,
            ..problem
        }
    }

    fn solve_held(
        &self,
        half_space: &mut HalfSpace,
        problem: NormalProblem<'_>,
        start: Option<&[f64]>,
        options: NormalOptions,
    ) -> Result<NormalSolution, ContactError> {
        let BodyMotions {
            restrained: held,
            compliance,
            ..
        } = &self.bodies;
        let count = held.len();
        let patch = problem.patch;
        let grid = patch.grid;
        let kept_cells: Vec<usize> = (0..grid.len()).filter(|&c| patch.is_in_joint[c]).collect();
        let fields: Vec<Vec<f64>> = held
            .iter()
            .map(|motion| approach_field(patch, &kept_cells, motion))
            .collect();
        let squares: Vec<f64> = fields
            .iter()
            .map(|f| f.iter().map(|v| v * v).sum())
            .collect();
        let reach: Vec<f64> = fields
            .iter()
            .map(|f| f.iter().fold(0.0, |m: f64, v| m.max(v.abs())))
            .collect();
        // Initial estimate of the contact's compliance along each motion: a smooth punch with the area of the
        // joint.
        let punch = half_space.pair().compliance() * std::f64::consts::PI
            / (2.0 * (patch.area() / std::f64::consts::PI).sqrt());
        let mut slope = RowMatrix::zeros(count, count);
        for k in 0..count {
            for m in 0..count {
                let own = punch * kept_cells.len() as f64 / squares[k];
                slope.set(
                    k,
                    m,
                    compliance[k * count + m] + if k == m { own } else { 0.0 },
                );
            }
        }
        let mut resultants = match start {
            Some(pressure) if kept_cells.iter().any(|&c| pressure[c] > 0.0) => fields
                .iter()
                .map(|f| {
                    f.iter()
                        .zip(&kept_cells)
                        .map(|(v, &c)| v * pressure[c])
                        .sum::<f64>()
                        * grid.cell_area()
                })
                .collect(),
            _ => self.first_resultants(&problem, &kept_cells, &fields, &squares, &slope)?,
        };
        let mut pressure = start.map(<[f64]>::to_vec);
        // The last resultants that a pressure could balance, and their residual.
        let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
        let (mut iterations, mut error) = (0, f64::INFINITY);
        let mut is_uniform = false;
        for _ in 0..MOST_SOLVES {
            let solution = normal::solve(
                half_space,
                &self.with_resultants(problem, &resultants),
                pressure.as_deref(),
                options,
            );
            let mut solution = match (solution, &last) {
                (Ok(solution), _) => solution,
                // No pressure balances the new resultants: use the mean of the new resultants and the last balanced
                // resultants.
                (Err(ContactError::MomentNotCarried { .. }), Some((before, _))) => {
                    resultants
                        .iter_mut()
                        .zip(before)
                        .for_each(|(r, b)| *r = 0.5 * (*r + b));
                    continue;
                }
                (Err(ContactError::MomentNotCarried { .. }), None) if !is_uniform => {
                    // Use the resultants of a uniform pressure, because the uniform pressure balances these resultants.
                    resultants =
                        self.uniform_pressure_resultants(patch, &kept_cells, &fields, &resultants);
                    is_uniform = true;
                    continue;
                }
                (Err(error), _) => return Err(error),
            };
            iterations += solution.iterations;
            let displacement = [
                solution.approach,
                solution.rotation[0],
                solution.rotation[1],
            ];
            let all: Vec<[f64; 3]> = held.iter().chain(&self.bodies.free).copied().collect();
            let displacement = parts_along(&all, patch, displacement);
            let residual: Vec<f64> = (0..count)
                .map(|k| {
                    let row = &compliance[k * count..(k + 1) * count];
                    displacement[k] + row.iter().zip(&resultants).map(|(c, r)| c * r).sum::<f64>()
                })
                .collect();
            let peak = solution.pressure.iter().fold(0.0, |m: f64, p| m.max(*p));
            let displaced: f64 = residual.iter().zip(&reach).map(|(o, r)| o.abs() * r).sum();
            error = displaced / (half_space.self_compliance() * peak);
            if error <= options.tolerance {
                solution.iterations = iterations;
                solution.error = solution.error.max(error);
                return Ok(solution);
            }
            if let Some((before, residual_before)) = &last {
                let step: Vec<f64> = resultants.iter().zip(before).map(|(r, b)| r - b).collect();
                let square: f64 = step.iter().map(|s| s * s).sum();
                let predicted = slope.apply(&step);
                for k in 0..count {
                    let misfit = residual[k] - residual_before[k] - predicted[k];
                    for m in 0..count {
                        slope.set(k, m, slope.at(k, m) + misfit * step[m] / square);
                    }
                }
            }
            last = Some((resultants.clone(), residual.clone()));
            let mut step = residual;
            let factors = slope.clone().factorize();
            factors
                .map_err(|_| self.not_converged(iterations, error, options))?
                .solve(&mut step);
            resultants.iter_mut().zip(&step).for_each(|(r, s)| *r -= s);
            pressure = Some(solution.pressure);
        }
        Err(self.not_converged(iterations, error, options))
    }

    fn not_converged(&self, iterations: usize, error: f64, options: NormalOptions) -> ContactError {
        ContactError::NotConverged {
            problem: "normal contact of bodies that a structure holds",
            iterations,
            error,
            tolerance: options.tolerance,
        }
    }

    /// Returns the resultants of a uniform pressure along the held motions. The pressure fits the loads along
    /// the free motions, or `resultants` if no motion is free.
    fn uniform_pressure_resultants(
        &self,
        patch: &Patch,
        kept_cells: &[usize],
        fields: &[Vec<f64>],
        resultants: &[f64],
    ) -> Vec<f64> {
        let mean = |field: &[f64]| field.iter().sum::<f64>() / kept_cells.len() as f64;
        let means: Vec<f64> = fields.iter().map(|field| mean(field)).collect();
        let Control::Free(freedom) = self.control(&[]) else {
            return means;
        };
        let free = freedom
            .motions()
            .iter()
            .map(|motion| mean(&approach_field(patch, kept_cells, motion)));
        let wanted: Vec<(f64, f64)> = match freedom.motions().is_empty() {
            true => means
                .iter()
                .copied()
                .zip(resultants.iter().copied())
                .collect(),
            false => free.zip(freedom.resultants().iter().copied()).collect(),
        };
        let along: f64 = wanted.iter().map(|(mean, r)| mean * r).sum();
        let square: f64 = wanted.iter().map(|(mean, _)| mean * mean).sum();
        let load = along.abs() / square.max(f64::MIN_POSITIVE);
        means.into_iter().map(|mean| load * mean).collect()
    }

    /// Returns initial resultants. The initial resultants move the faces apart by their mean overlap and by a part of
    /// the peaks' height.
    fn first_resultants(
        &self,
        problem: &NormalProblem<'_>,
        kept_cells: &[usize],
        fields: &[Vec<f64>],
        squares: &[f64],
        slope: &RowMatrix,
    ) -> Result<Vec<f64>, ContactError> {
        let count = kept_cells.len() as f64;
        let mean = kept_cells.iter().map(|&c| problem.height[c]).sum::<f64>() / count;
        let mut overlap: Vec<f64> = fields
            .iter()
            .zip(squares)
            .map(|(f, square)| {
                let terms = f
                    .iter()
                    .zip(kept_cells)
                    .map(|(v, &c)| v * problem.height[c]);
                terms.sum::<f64>() / square
            })
            .collect();
        let top = kept_cells
            .iter()
            .map(|&c| problem.height[c])
            .fold(f64::NEG_INFINITY, f64::max);
        for (k, overlap) in overlap.iter_mut().enumerate() {
            let uniform = fields[k].iter().sum::<f64>() / squares[k];
            *overlap += FIRST_PART * (top - mean) * uniform;
        }
        if let Ok(factors) = slope.clone().factorize() {
            factors.solve(&mut overlap);
        }
        Ok(overlap)
    }

    /// Returns by how much the ends of the preload approach each other \[m\]. The shortening equals the work of a
    /// preload of 1 N. The pressure, the loads, the approach and the rotations of the contact each do a part of the
    /// work.
    pub(super) fn shortening(&self, patch: &Patch, solution: &NormalSolution) -> f64 {
        let opening = solution.pressure.iter().zip(&self.opening[0]);
        let by_pressure: f64 = opening.map(|(p, u)| p * u).sum();
        let displacement = [
            solution.approach,
            solution.rotation[0],
            solution.rotation[1],
        ];
        let BodyMotions {
            free,
            restrained: held,
            ..
        } = &self.bodies;
        let all: Vec<[f64; 3]> = free.iter().chain(held).copied().collect();
        let by_motion: f64 = parts_along(&all, patch, displacement)
            .iter()
            .zip(&self.resultants[0])
            .map(|(m, r)| m * r)
            .sum();
        let by_loads = self.load_fraction * (self.work[0] * self.preload + self.work[1]);
        patch.grid.cell_area() * by_pressure + by_loads + by_motion
    }

    /// Returns the mean approach over `patch`, from first touch at height 0 \[m\]. The approach excludes the opening by
    /// the loads and the added compliance, as for a punch on half spaces alone.
    pub(super) fn approach(&self, patch: &Patch, solution: &NormalSolution) -> f64 {
        let mut opening = self.opening();
        self.added.add_normal(&solution.pressure, &mut opening);
        let grid = patch.grid;
        let kept_cells = (0..grid.len()).filter(|&c| patch.is_in_joint[c]);
        let [x, y] = solution.rotation;
        let closer = kept_cells.map(|c| {
            let (i, j) = grid.cell(c);
            let (at_x, at_y) = grid.centre(i, j);
            solution.approach + x * at_y - y * at_x - opening[c]
        });
        closer.sum::<f64>() / patch.cells() as f64
    }
}

/// Returns by how much a motion brings the bodies closer at each of the `cells`.
fn approach_field(patch: &Patch, cells: &[usize], motion: &[f64; 3]) -> Vec<f64> {
    let at = |&c: &usize| {
        let (i, j) = patch.grid.cell(c);
        let (x, y) = patch.grid.centre(i, j);
        motion[0] + motion[1] * y - motion[2] * x
    };
    cells.iter().map(at).collect()
}

/// Decomposes a rigid displacement into up to three independent `motions`, by their normal equations.
fn parts_along(motions: &[[f64; 3]], patch: &Patch, displacement: [f64; 3]) -> Vec<f64> {
    // A lever turns rotations into displacements, so that all entries have one unit.
    let [lx, ly] = patch.grid.size();
    let lever = lx.hypot(ly);
    let dot = |[a, x, y]: [f64; 3], [b, u, v]: [f64; 3]| a * b + lever * lever * (x * u + y * v);
    let mut parts: Vec<f64> = motions
        .iter()
        .map(|motion| dot(*motion, displacement))
        .collect();
    let mut gram = RowMatrix::zeros(motions.len(), motions.len());
    for (k, own) in motions.iter().enumerate() {
        for (m, other) in motions.iter().enumerate() {
            gram.set(k, m, dot(*own, *other));
        }
    }
    if !motions.is_empty() {
        let factors = gram.factorize().expect("independent motions");
        factors.solve(&mut parts);
    }
    parts
}

/// Largest number of contact solutions in the search for the held motions.
const MOST_SOLVES: usize = 40;

/// Fraction of the peaks' height above the mean by which the first resultants move the faces apart.
const FIRST_PART: f64 = 0.5;

/// Limits of the search for the bolt force by the secant method: the largest number of contact solutions, and two
/// relative errors of the load. The smaller error is the error at convergence. The search accepts the larger error if
/// the secant method stalls.
const MOST_SECANT_STEPS: usize = 30;
const TIGHTENING_TOLERANCE: f64 = 1e-7;
const STALLED_TIGHTENING_TOLERANCE: f64 = 1e-6;

impl FrettingJoint {
    /// Finds the preload for which the force of the unworn contact is `load` \[N\]. Returns the contact under the
    /// preload. Use `tighten_bolt` for a bolt that is a part of the structure.
    ///
    /// # Errors
    /// [`WearError::NotTightened`], or the error of a contact.
    ///
    /// # Panics
    /// Panics if no structure presses the joint.
    pub fn tighten_bolt(&mut self, load: f64) -> Result<NormalSolution, WearError> {
        let wear = vec![0.0; self.patch.grid.len()];
        let mut pressure: Option<Vec<f64>> = None;
        // Secant method, starting from no preload and a preload of the whole load.
        let (mut before, mut preload) = ([0.0, 0.0], load);
        for _ in 0..MOST_SECANT_STEPS {
            let pressing = self.pressing.as_mut();
            pressing
                .expect("a structure that presses the joint")
                .preload = preload;
            let solution = self.contact(&wear, None, load, pressure.as_deref())?;
            if (solution.load - load).abs() <= TIGHTENING_TOLERANCE * load {
                return Ok(solution);
            }
            let slope = (solution.load - before[1]) / (preload - before[0]);
            before = [preload, solution.load];
            if !(slope > 0.0 && slope.is_finite()) {
                if (solution.load - load).abs() <= STALLED_TIGHTENING_TOLERANCE * load {
                    return Ok(solution);
                }
                break;
            }
            preload += (load - solution.load) / slope;
            pressure = Some(solution.pressure);
        }
        Err(WearError::NotTightened {
            load,
            preload: before[0],
            found: before[1],
        })
    }
}
