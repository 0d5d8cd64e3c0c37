//! How the bodies of a structure press each other under loads that stay.
//!
//! The gap of a cell is g = −h + K p + A S (G − M) Sᵀ p + S u − (δ + θ_x y − θ_y x): K is the half spaces' compliance, M what the structure's mesh has
//! of it between the nodes of the joint, G the structure's flexibility there, u what the loads open, S the mean of the nodes' hats over each
//! cell, and A the area of a cell. Approach δ and rotations θ are those along which the bodies are free.
//!
//! G = Q + V C Vᵀ, with the soft compliance C of the motions V that are held ([`crate::structure::statics`]). Contact is solved with Q and with all motions
//! free, the held ones in exchange for resultants r, which are found such that these motions are −C r: a few solves by Broyden's method
//! [Broyden 1965]. A softness far beyond that of the contact never enters its solver.
//!
//! A given *load* acts through this. Displacements that are given to the nodes act through K − A S M Sᵀ, because they have G already
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

/// What loads that stay do at a joint, node by node.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalLoad {
    /// By how much it opens each node, where no pressure answers it \[m\].
    pub opening: Vec<f64>,
    /// For each free motion the resultant of the pressure that bears it \[N m\].
    pub resultants: Vec<f64>,
    /// Its work under the preload, and under the other loads, where no pressure answers them \[N m\].
    pub work: [f64; 2],
}

/// What a structure leaves its bodies to do against each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bodies {
    /// Motions along which they are free: approach and rotations.
    pub free: Vec<[f64; 3]>,
    /// Other motions, along which the structure holds them softly.
    pub held: Vec<[f64; 3]>,
    /// Compliance between these, row by row \[m/N\].
    pub compliance: Vec<f64>,
}

/// The bodies of a structure, which press each other under a preload and other loads that stay.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressing {
    added: Arc<NodalCompliance>,
    bodies: Bodies,
    /// The opening of the cells and the resultants, of a preload of 1 N and of the other loads.
    opening: [Vec<f64>; 2],
    resultants: [Vec<f64>; 2],
    /// Opening of all cells where the bodies first touch \[m\].
    touch: f64,
    /// The preload \[N\].
    pub preload: f64,
    /// Part of all loads that acts.
    pub part: f64,
    /// By how much the ends of the preload are closer in the last contact \[m\].
    pub shortening: f64,
    /// Work of a preload of 1 N under itself and under the other loads.
    work: [f64; 2],
    /// The structure's flexibility between neighbouring nodes over that of its mesh on half spaces; none of a joint too small to tell.
    pub mesh_ratio: Option<f64>,
}

impl Pressing {
    /// Bodies with the compliance `added` to that of half spaces along the normal, Q − M \[m/N\]. The loads
    /// are a preload of 1 N, and the others. Bodies that are not free to come closer begin where a surface first touches whose highest point
    /// is `top` \[m\]. The preload is 0 at first.
    pub fn new(
        added: Arc<NodalCompliance>,
        bodies: Bodies,
        loads: [NodalLoad; 2],
        top: f64,
    ) -> Self {
        let interpolation = &added.interpolation;
        let cells = |nodes: &[f64]| {
            let mut cells = vec![0.0; interpolation.grid().len()];
            interpolation.add(1.0, nodes, &mut cells);
            cells
        };
        let opening = [0, 1].map(|k| cells(&loads[k].opening));
        let work = loads[0].work;
        let resultants = loads.map(|load| load.resultants);
        let closes = |[_, x, y]: &[f64; 3]| *x == 0.0 && *y == 0.0;
        let is_held = !bodies.free.iter().any(closes);
        Pressing {
            added,
            bodies,
            opening,
            resultants,
            touch: if is_held { top } else { 0.0 },
            preload: 0.0,
            part: 1.0,
            shortening: 0.0,
            work,
            mesh_ratio: None,
        }
    }

    /// By how much the loads open each cell, without an answer of the pressure \[m\].
    pub(super) fn opening(&self) -> Vec<f64> {
        let [preload, others] = &self.opening;
        let both = preload.iter().zip(others);
        both.map(|(of_preload, other)| self.touch + self.part * (self.preload * of_preload + other))
            .collect()
    }

    /// What the bodies are free to do under the loads, and with the `held` resultants in exchange for the motions that are held.
    fn control(&self, held: &[f64]) -> Control {
        let mut freedom = Freedom::default();
        let [preload, others] = &self.resultants;
        for (motion, (of_preload, other)) in self.bodies.free.iter().zip(preload.iter().zip(others))
        {
            freedom.add(*motion, self.part * (self.preload * of_preload + other));
        }
        for (motion, resultant) in self.bodies.held.iter().zip(held) {
            freedom.add(*motion, *resultant);
        }
        Control::Free(freedom)
    }

    /// The contact of a `problem` without what presses it, of heights from which the opening by the loads is taken.
    ///
    /// # Errors
    /// [`ContactError`] of a contact; [`ContactError::NotConverged`] too where the held motions are not found.
    pub(super) fn solve(
        &self,
        half_space: &mut HalfSpace,
        problem: NormalProblem<'_>,
        start: Option<&[f64]>,
        options: NormalOptions,
    ) -> Result<NormalSolution, WearError> {
        let added = Some(self.added.clone());
        let solved = half_space.with_nodal(added, |half_space| match self.bodies.held.is_empty() {
            true => {
                let problem = self.with(problem, &[]);
                normal::solve(half_space, &problem, start, options)
            }
            false => self.solve_held(half_space, problem, start, options),
        });
        Ok(solved??)
    }

    fn with<'a>(&self, problem: NormalProblem<'a>, held: &[f64]) -> NormalProblem<'a> {
        NormalProblem {
            control: self.control(held),
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
        let Bodies {
            held, compliance, ..
        } = &self.bodies;
        let count = held.len();
        let patch = problem.patch;
        let grid = patch.grid;
        let kept: Vec<usize> = (0..grid.len()).filter(|&c| patch.kept[c]).collect();
        let fields: Vec<Vec<f64>> = held
            .iter()
            .map(|motion| field_of(patch, &kept, motion))
            .collect();
        let squares: Vec<f64> = fields
            .iter()
            .map(|f| f.iter().map(|v| v * v).sum())
            .collect();
        let reach: Vec<f64> = fields
            .iter()
            .map(|f| f.iter().fold(0.0, |m: f64, v| m.max(v.abs())))
            .collect();
        // A smooth punch as large as the joint is a first guess of what the contact yields along each motion.
        let punch = half_space.pair().compliance() * std::f64::consts::PI
            / (2.0 * (patch.area() / std::f64::consts::PI).sqrt());
        let mut slope = RowMatrix::zeros(count, count);
        for k in 0..count {
            for m in 0..count {
                let own = punch * kept.len() as f64 / squares[k];
                slope.set(
                    k,
                    m,
                    compliance[k * count + m] + if k == m { own } else { 0.0 },
                );
            }
        }
        let mut resultants = match start {
            Some(pressure) if kept.iter().any(|&c| pressure[c] > 0.0) => fields
                .iter()
                .map(|f| {
                    f.iter()
                        .zip(&kept)
                        .map(|(v, &c)| v * pressure[c])
                        .sum::<f64>()
                        * grid.cell_area()
                })
                .collect(),
            _ => self.first_resultants(&problem, &kept, &fields, &squares, &slope)?,
        };
        let mut pressure = start.map(<[f64]>::to_vec);
        // The last resultants that a pressure had, and what they left.
        let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
        let (mut iterations, mut left) = (0, f64::INFINITY);
        let mut is_even = false;
        for _ in 0..MOST_SOLVES {
            let found = normal::solve(
                half_space,
                &self.with(problem, &resultants),
                pressure.as_deref(),
                options,
            );
            let mut found = match (found, &last) {
                (Ok(found), _) => found,
                // Beyond what a pressure can have.
                (Err(ContactError::MomentNotCarried { .. }), Some((before, _))) => {
                    resultants
                        .iter_mut()
                        .zip(before)
                        .for_each(|(r, b)| *r = 0.5 * (*r + b));
                    continue;
                }
                (Err(ContactError::MomentNotCarried { .. }), None) if !is_even => {
                    // An even pressure has all resultants.
                    resultants = self.even_resultants(patch, &kept, &fields, &resultants);
                    is_even = true;
                    continue;
                }
                (Err(error), _) => return Err(error),
            };
            iterations += found.iterations;
            let moved = [found.approach, found.rotation[0], found.rotation[1]];
            let all: Vec<[f64; 3]> = held.iter().chain(&self.bodies.free).copied().collect();
            let moved = parts_along(&all, patch, moved);
            let off: Vec<f64> = (0..count)
                .map(|k| {
                    let row = &compliance[k * count..(k + 1) * count];
                    moved[k] + row.iter().zip(&resultants).map(|(c, r)| c * r).sum::<f64>()
                })
                .collect();
            let peak = found.pressure.iter().fold(0.0, |m: f64, p| m.max(*p));
            let displaced: f64 = off.iter().zip(&reach).map(|(o, r)| o.abs() * r).sum();
            left = displaced / (half_space.self_compliance() * peak);
            if left <= options.tolerance {
                found.iterations = iterations;
                found.error = found.error.max(left);
                return Ok(found);
            }
            if let Some((before, off_before)) = &last {
                let step: Vec<f64> = resultants.iter().zip(before).map(|(r, b)| r - b).collect();
                let square: f64 = step.iter().map(|s| s * s).sum();
                let told = slope.apply(&step);
                for k in 0..count {
                    let missed = off[k] - off_before[k] - told[k];
                    for m in 0..count {
                        slope.set(k, m, slope.at(k, m) + missed * step[m] / square);
                    }
                }
            }
            last = Some((resultants.clone(), off.clone()));
            let mut step = off;
            let factors = slope.clone().factorize();
            factors
                .map_err(|_| self.not_held(iterations, left, options))?
                .solve(&mut step);
            resultants.iter_mut().zip(&step).for_each(|(r, s)| *r -= s);
            pressure = Some(found.pressure);
        }
        Err(self.not_held(iterations, left, options))
    }

    fn not_held(&self, iterations: usize, error: f64, options: NormalOptions) -> ContactError {
        ContactError::NotConverged {
            problem: "normal contact of bodies that a structure holds",
            iterations,
            error,
            tolerance: options.tolerance,
        }
    }

    /// Resultants along the held motions of an even pressure, as large as the loads along the free ones want it, or where there are none these
    /// `resultants`.
    fn even_resultants(
        &self,
        patch: &Patch,
        kept: &[usize],
        fields: &[Vec<f64>],
        resultants: &[f64],
    ) -> Vec<f64> {
        let mean = |field: &[f64]| field.iter().sum::<f64>() / kept.len() as f64;
        let means: Vec<f64> = fields.iter().map(|field| mean(field)).collect();
        let Control::Free(freedom) = self.control(&[]) else {
            return means;
        };
        let free = freedom
            .motions()
            .iter()
            .map(|motion| mean(&field_of(patch, kept, motion)));
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

    /// Resultants to begin with: those by which the held motions take the faces apart as far as they overlap, in part.
    fn first_resultants(
        &self,
        problem: &NormalProblem<'_>,
        kept: &[usize],
        fields: &[Vec<f64>],
        squares: &[f64],
        slope: &RowMatrix,
    ) -> Result<Vec<f64>, ContactError> {
        let count = kept.len() as f64;
        let mean = kept.iter().map(|&c| problem.height[c]).sum::<f64>() / count;
        let mut overlap: Vec<f64> = fields
            .iter()
            .zip(squares)
            .map(|(f, square)| {
                let terms = f.iter().zip(kept).map(|(v, &c)| v * problem.height[c]);
                terms.sum::<f64>() / square
            })
            .collect();
        let top = kept
            .iter()
            .map(|&c| problem.height[c])
            .fold(f64::NEG_INFINITY, f64::max);
        for (k, overlap) in overlap.iter_mut().enumerate() {
            let of_one = fields[k].iter().sum::<f64>() / squares[k];
            *overlap += FIRST_PART * (top - mean) * of_one;
        }
        if let Ok(factors) = slope.clone().factorize() {
            factors.solve(&mut overlap);
        }
        Ok(overlap)
    }

    /// By how much the ends of the preload come closer in a contact of bodies that moved by its approach and rotations \[m\]: by the work of the
    /// preload under the pressure, the loads and these motions.
    pub(super) fn shortening(&self, patch: &Patch, solution: &NormalSolution) -> f64 {
        let opening = solution.pressure.iter().zip(&self.opening[0]);
        let by_pressure: f64 = opening.map(|(p, u)| p * u).sum();
        let moved = [
            solution.approach,
            solution.rotation[0],
            solution.rotation[1],
        ];
        let Bodies { free, held, .. } = &self.bodies;
        let all: Vec<[f64; 3]> = free.iter().chain(held).copied().collect();
        let by_motion: f64 = parts_along(&all, patch, moved)
            .iter()
            .zip(&self.resultants[0])
            .map(|(m, r)| m * r)
            .sum();
        let by_loads = self.part * (self.work[0] * self.preload + self.work[1]);
        patch.grid.cell_area() * by_pressure + by_loads + by_motion
    }

    /// By how much the bodies are closer on average over a `patch` than at first touch of height 0, beside what half spaces give \[m\]: the approach
    /// of a punch, if these bodies were one.
    pub(super) fn approach(&self, patch: &Patch, solution: &NormalSolution) -> f64 {
        let mut opening = self.opening();
        self.added.add_normal(&solution.pressure, &mut opening);
        let grid = patch.grid;
        let kept = (0..grid.len()).filter(|&c| patch.kept[c]);
        let [x, y] = solution.rotation;
        let closer = kept.map(|c| {
            let (i, j) = grid.cell(c);
            let (at_x, at_y) = grid.centre(i, j);
            solution.approach + x * at_y - y * at_x - opening[c]
        });
        closer.sum::<f64>() / patch.cells() as f64
    }
}

/// By how much a motion brings the bodies closer on some cells.
fn field_of(patch: &Patch, cells: &[usize], motion: &[f64; 3]) -> Vec<f64> {
    let at = |&c: &usize| {
        let (i, j) = patch.grid.cell(c);
        let (x, y) = patch.grid.centre(i, j);
        motion[0] + motion[1] * y - motion[2] * x
    };
    cells.iter().map(at).collect()
}

/// The parts of up to three independent motions that a combination of them has: by their normal equations.
fn parts_along(motions: &[[f64; 3]], patch: &Patch, moved: [f64; 3]) -> Vec<f64> {
    // Rotations count by a lever, so that all entries are displacements.
    let [lx, ly] = patch.grid.size();
    let lever = lx.hypot(ly);
    let dot = |[a, x, y]: [f64; 3], [b, u, v]: [f64; 3]| a * b + lever * lever * (x * u + y * v);
    let mut parts: Vec<f64> = motions.iter().map(|motion| dot(*motion, moved)).collect();
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

/// Contact solutions in which held motions are found at most.
const MOST_SOLVES: usize = 40;

/// Part of the height of peaks above the mean that first resultants push away.
const FIRST_PART: f64 = 0.5;

/// Contact solutions in which the forces of a bolt are found at most, and the error of the load that is left, over the load; and the one that does
/// where the errors of the contacts keep from less.
const MOST_TIGHTENINGS: usize = 30;
const TIGHTENED: f64 = 1e-7;
const ALL_BUT_TIGHTENED: f64 = 1e-6;

impl FrettingJoint {
    /// The contact of the unworn surface whose preload is found such that the pressure has the `load` \[N\]: a bolt that is a part of the structure
    /// is tightened.
    ///
    /// # Errors
    /// [`WearError::NotTightened`], and those of a contact.
    ///
    /// # Panics
    /// Where no structure presses the joint.
    pub fn tighten_bolt(&mut self, load: f64) -> Result<NormalSolution, WearError> {
        let wear = vec![0.0; self.patch.grid.len()];
        let mut pressure: Option<Vec<f64>> = None;
        // Secants, from no preload and one that bears all of the load.
        let (mut before, mut preload) = ([0.0, 0.0], load);
        for _ in 0..MOST_TIGHTENINGS {
            let pressing = self.pressing.as_mut();
            pressing
                .expect("a structure that presses the joint")
                .preload = preload;
            let found = self.contact(&wear, None, load, pressure.as_deref())?;
            if (found.load - load).abs() <= TIGHTENED * load {
                return Ok(found);
            }
            let slope = (found.load - before[1]) / (preload - before[0]);
            before = [preload, found.load];
            if !(slope > 0.0 && slope.is_finite()) {
                if (found.load - load).abs() <= ALL_BUT_TIGHTENED * load {
                    return Ok(found);
                }
                break;
            }
            preload += (load - found.load) / slope;
            pressure = Some(found.pressure);
        }
        Err(WearError::NotTightened {
            load,
            preload: before[0],
            found: before[1],
        })
    }
}
