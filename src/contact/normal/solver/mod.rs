//! Projected conjugate gradients, with the approximate inverse of the half spaces as preconditioner.
//!
//! Each step leads from an admissible pressure with the required resultants to another one of lower energy. The solver
//! computes β of Hestenes and Stiefel from the true change of the residual. With β of Hestenes and Stiefel, the search
//! direction remains conjugate while cells enter and leave the free set. A trial step of the predicted length is
//! projected onto the admissible pressures. The solver moves along the chord to the projected point, up to the minimum
//! of the energy on the chord. The only convolution of an iteration computes the displacement of the chord. On a
//! constant set of cells the solver is the conjugate gradient method, and always descends. The projection may bend a
//! direction so far that the chord does not descend. If the chord does not descend, the solver tries shorter steps and
//! simpler directions. The simplest direction is the projected gradient, and the projected gradient always descends.
//! The trials of shorter steps and simpler directions cost no convolution. If bounds cut off most of a step, the next
//! step uses the gradient on all cells. The gradient step is so long that most cells reach a bound. The module [`step`]
//! computes the steps of the solver.

mod step;

use super::projection::project;
use super::rigid::{Motions, RigidMotions, displacement, load_and_moments};
use super::settle::{Bound, least_violation};
use super::{Control, NormalOptions, NormalProblem, NormalSolution, Rotation};
use crate::contact::cells::{gather, scatter};
use crate::contact::coarse::FarFieldCorrection;
use crate::contact::error::ContactError;
use crate::contact::half_space::HalfSpace;
use crate::contact::sums::{LANES, extremes, sum};

/// Rounding of a gap, relative to the approach: from the sums in a transform and the last digit of pressures.
const ROUNDING: f64 = 128.0 * f64::EPSILON;

/// Rounding error of a resultant, divided by the largest pressure or by the sum of all pressures. Smaller pressures and
/// steps are noise.
const NOISE: f64 = 1e-13;

/// Number of cells in a block. The solver skips a block if all cells of the block are open and stay open.
const BLOCK: usize = 8;

/// State of a solve. The gap is `residual` − the unknown motions.
///
/// Fields have one value per cell of the grid. Arrays of [`OnFree`] have one value per free cell, in the order of
/// `free`. Only few cells carry load. Sums over contiguous values are an order of magnitude faster than sums over
/// listed cells.
pub(super) struct Solver<'a, 'h> {
    half_space: &'h mut HalfSpace,
    problem: &'a NormalProblem<'a>,
    options: NormalOptions,
    cap: f64,
    /// Given approach and rotations; unknown motions, with the resultants that they must reach \[Pa, Pa m\].
    given: Motions,
    motions: RigidMotions,
    target: Motions,
    motion: Motions,
    kept: Vec<usize>,
    /// √(λ/(λ + D)): scaling of the preconditioner where the diagonal compliance dominates.
    scaling: Option<Vec<f64>>,
    coarse: FarFieldCorrection,
    pressure: Vec<f64>,
    /// (K + D) p − h − the given motions; ∞ on masked cells, which always stay open.
    residual: Vec<f64>,
    /// Last pressure step, and the displacement under the last pressure step.
    step: Vec<f64>,
    image: Vec<f64>,
    /// Σ residual over the elastic cells, and their number.
    elastic: [f64; 2],
    peak: f64,
    /// Cells whose pressure can change: elastic cells, and cells whose pressure must leave a bound.
    free: Vec<usize>,
    /// Free cells of the last step, which is 0 on all other cells.
    last_free: Vec<usize>,
    /// Cells that stay at the cap.
    capped_cells: Vec<usize>,
    on_free: OnFree,
    /// Length of the next trial step: in units of the direction, and along the gradient in units of 1/λ.
    predicted: f64,
    predicted_gradient: f64,
    /// Length of a long step along the gradient, in units of 1/λ, if one is worth a trial.
    long_step_length: Option<f64>,
    iterations: usize,
}

/// Values on the free cells.
#[derive(Default)]
struct OnFree {
    gap: Vec<f64>,
    pressure: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
    trial: Vec<f64>,
    step: Vec<f64>,
}

impl<'a, 'h> Solver<'a, 'h> {
    pub(super) fn new(
        half_space: &'h mut HalfSpace,
        problem: &'a NormalProblem<'a>,
        options: NormalOptions,
    ) -> Self {
        let grid = problem.patch.grid;
        let n = grid.len();
        let lambda = half_space.self_compliance();
        let compliance = half_space.pair().compliance();
        let coarse = FarFieldCorrection::new(half_space, |cell| compliance * cell.inverse);
        let scaling = problem
            .compliance
            .map(|d| d.iter().map(|d| (lambda / (lambda + d)).sqrt()).collect());
        let mut given = [0.0; 3];
        let mut free: Vec<(Motions, f64)> = Vec::new();
        match problem.control {
            Control::Load(load) => free.push(([1.0, 0.0, 0.0], load)),
            Control::Approach(approach) => given[0] = approach,
            Control::Free(freedom) => {
                let motions = freedom.motions().iter().copied();
                free.extend(motions.zip(freedom.resultants().iter().copied()));
            }
        }
        match problem.rotation {
            Rotation::Given(rotation) => given[1..].copy_from_slice(&rotation),
            Rotation::Free { moment: [x, y] } => {
                free.extend([([0.0, 1.0, 0.0], x), ([0.0, 0.0, 1.0], y)]);
            }
        }
        let mut target = [0.0; 3];
        for (target, (_, resultant)) in target.iter_mut().zip(&free) {
            *target = resultant / grid.cell_area();
        }
        let free: Vec<Motions> = free.into_iter().map(|(motion, _)| motion).collect();
        let motions = RigidMotions::new(grid, &free);
        Solver {
            half_space,
            problem,
            options,
            cap: problem.pressure_cap.unwrap_or(f64::INFINITY),
            given,
            motions,
            target,
            motion: [0.0; 3],
            kept: (0..n).filter(|&c| problem.patch.is_in_joint[c]).collect(),
            scaling,
            coarse,
            pressure: vec![0.0; n],
            residual: vec![f64::INFINITY; n],
            step: vec![0.0; n],
            image: vec![0.0; n],
            elastic: [0.0; 2],
            peak: 0.0,
            free: Vec::new(),
            last_free: Vec::new(),
            capped_cells: Vec::new(),
            on_free: OnFree::default(),
            predicted: 1.0,
            predicted_gradient: 1.0,
            long_step_length: None,
            iterations: 0,
        }
    }

    pub(super) fn run(mut self, start: Option<&[f64]>) -> Result<NormalSolution, ContactError> {
        self.begin(start)?;
        // True if the residual was computed from the pressure, false if it was updated over some iterations.
        let mut is_fresh = true;
        loop {
            let error = self.assess();
            let done = error <= self.options.tolerance;
            if done && (is_fresh || self.drift() <= 0.1 * self.options.tolerance) {
                return self.finish(error);
            }
            if !done && self.iterations < self.options.max_iterations && self.advance() {
                is_fresh = false;
            } else if is_fresh || self.iterations >= self.options.max_iterations {
                return Err(self.not_converged(error));
            } else {
                self.update_residual();
                is_fresh = true;
            }
        }
    }

    /// Sets the first pressure: `start`, a uniform one, or zero if only the approach is given.
    fn begin(&mut self, start: Option<&[f64]>) -> Result<(), ContactError> {
        let usable_start = start.filter(|p| self.kept.iter().any(|&c| p[c] > 0.0));
        // Roughly the pressure that the resultants require.
        let uniform = self.motions.distance(&self.target, &[0.0; 3]) / self.kept.len() as f64;
        // Keep the open cells of `start` open if possible. A shift that corrects the last digits of the load would
        // close all.
        let loaded = usable_start.map(|p| self.kept.iter().copied().filter(|&c| p[c] > 0.0));
        let loaded: Vec<usize> = loaded.into_iter().flatten().collect();
        let mut is_met = false;
        for cells in [&loaded, &self.kept] {
            if is_met || cells.is_empty() {
                continue;
            }
            let first_pressure = cells.iter();
            let mut first_pressure: Vec<f64> = first_pressure
                .map(|&c| usable_start.map_or(uniform, |p| p[c].clamp(0.0, self.cap)))
                .collect();
            is_met = project(
                &self.motions,
                cells,
                &mut first_pressure,
                self.cap,
                &self.target,
            );
            snap(&mut first_pressure, self.cap, 0.0);
            self.pressure.fill(0.0);
            scatter(&first_pressure, cells, &mut self.pressure);
        }
        let is_free = matches!(self.problem.control, Control::Free(_));
        if !is_met && (self.motions.rotates() || is_free) {
            let area = self.problem.patch.grid.cell_area();
            let [load, x, y] = self.motions.combined(&self.target).map(|sum| sum * area);
            let moment = [x, y];
            return Err(ContactError::MomentNotCarried { moment, load });
        }
        if self.pressure.iter().any(|p| *p > 0.0) {
            self.update_residual();
        } else {
            self.set_residual(|s, c| -s.problem.height[c]);
            self.move_residual(0.0);
        }
        Ok(())
    }

    /// Sets the residual on the kept cells to `value` less the given motions.
    fn set_residual(&mut self, value: impl Fn(&Self, usize) -> f64) {
        let [approach, ..] = self.given;
        let is_rotated = self.given[1] != 0.0 || self.given[2] != 0.0;
        for k in 0..self.kept.len() {
            let c = self.kept[k];
            let motion = if is_rotated {
                displacement(self.problem.patch.grid, self.given, c)
            } else {
                approach
            };
            self.residual[c] = value(self, c) - motion;
        }
    }

    /// Computes the residual from the pressure.
    fn update_residual(&mut self) {
        self.half_space.normal(&self.pressure, &mut self.image);
        let image = std::mem::take(&mut self.image);
        let compliance = self.problem.compliance;
        self.set_residual(|s, c| {
            let own = compliance.map_or(0.0, |d| d[c] * s.pressure[c]);
            image[c] + own - s.problem.height[c]
        });
        self.image = image;
        self.step.fill(0.0);
        self.move_residual(0.0);
    }

    /// Adds a part of the image to the residual. In the same pass, sums what the motion and the error need from all
    /// cells.
    fn move_residual(&mut self, part: f64) {
        let cap = self.cap;
        let (mut total, mut count, mut peak) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut visit = |k: usize, residual: &mut f64, image: f64, p: f64| {
            *residual += part * image;
            let elastic = p > 0.0 && p < cap;
            total[k] += if elastic { *residual } else { 0.0 };
            count[k] += if elastic { 1.0 } else { 0.0 };
            peak[k] = if p > peak[k] { p } else { peak[k] };
        };
        let mut residuals = self.residual.chunks_exact_mut(LANES);
        let mut images = self.image.chunks_exact(LANES);
        let mut pressures = self.pressure.chunks_exact(LANES);
        for ((residual, image), p) in residuals
            .by_ref()
            .zip(images.by_ref())
            .zip(pressures.by_ref())
        {
            for k in 0..LANES {
                visit(k, &mut residual[k], image[k], p[k]);
            }
        }
        let rest = residuals
            .into_remainder()
            .iter_mut()
            .zip(images.remainder());
        for (k, ((residual, image), p)) in rest.zip(pressures.remainder()).enumerate() {
            visit(k, residual, *image, *p);
        }
        self.elastic = [total.iter().sum(), count.iter().sum()];
        self.peak = peak.into_iter().fold(0.0, f64::max);
    }

    /// Returns the displacement of a cell under the peak pressure, the scale of the error.
    fn scale(&self) -> f64 {
        self.half_space.self_compliance() * self.peak
    }

    /// Returns the rounding of a residual, which is a difference of heights, displacements and approach.
    fn rounding(&self) -> f64 {
        ROUNDING * (self.motions.combined(&self.motion)[0].abs() + self.given[0].abs())
    }

    /// Bounds the accumulated rounding of all updates of the residual, in units of the error.
    fn drift(&self) -> f64 {
        self.iterations as f64 * self.rounding() / self.scale()
    }

    /// Determines the unknown motions and the free cells. Returns the largest violation of the conditions on any cell.
    fn assess(&mut self) -> f64 {
        self.find_motion();
        let rotates = self.motions.rotates();
        let (cap, level) = (self.cap, self.motion[0]);
        std::mem::swap(&mut self.free, &mut self.last_free);
        self.free.clear();
        self.capped_cells.clear();
        self.on_free.gap.clear();
        for (block, (pressure, residual)) in self
            .pressure
            .chunks(BLOCK)
            .zip(self.residual.chunks(BLOCK))
            .enumerate()
        {
            // Evaluate all conditions of a block at once: an early exit would add a branch that is hard to predict.
            let cells = pressure.iter().zip(residual);
            let is_active = cells.fold(false, |is_active, (p, r)| {
                is_active | (*p > 0.0) | (*r < level)
            });
            if !is_active && !rotates {
                continue;
            }
            // Write every cell, and advance the count past free cells only. A branch would be unpredictable.
            let (mut cells, mut gaps, mut count) = ([0; BLOCK], [0.0; BLOCK], 0);
            for (k, (&p, residual)) in pressure.iter().zip(residual).enumerate() {
                let c = block * BLOCK + k;
                let motion = if rotates {
                    self.motions.displacement_at(&self.motion, c)
                } else {
                    level
                };
                let gap = residual - motion;
                let (open, capped) = (p <= 0.0, p >= cap);
                let leaves = (open & (gap < 0.0)) | (capped & (gap > 0.0));
                (cells[count], gaps[count]) = (c, gap);
                count += usize::from(leaves | !(open | capped));
                if capped & !leaves {
                    self.capped_cells.push(c);
                }
            }
            self.free.extend_from_slice(&cells[..count]);
            self.on_free.gap.extend_from_slice(&gaps[..count]);
        }
        let (low, high) = extremes(&self.on_free.gap);
        let worst = high.max(-low).max(0.0);
        let violation = (worst - self.rounding()).max(0.0);
        if sum(&self.on_free.gap).is_nan() {
            f64::INFINITY
        } else if violation == 0.0 {
            0.0
        } else {
            violation / self.scale()
        }
    }

    /// Finds the motions that minimise the gap of the elastic cells. Without an elastic cell, the approach is the
    /// middle of the range that open and capped cells permit. If the elastic cells do not determine the rotations,
    /// `find_motion` takes the motion of least violation on all cells.
    fn find_motion(&mut self) {
        if self.motions.is_empty() {
            return;
        }
        let cap = self.cap;
        if self.motions.rotates() {
            let inside = |c: &usize| self.pressure[*c] > 0.0 && self.pressure[*c] < cap;
            let elastic: Vec<usize> = self.kept.iter().copied().filter(inside).collect();
            let residual: Vec<f64> = elastic.iter().map(|&c| self.residual[c]).collect();
            let resultants = self.motions.resultants(&elastic, &residual);
            let determined = self.motions.with_resultants(&elastic, resultants);
            self.motion = determined.unwrap_or_else(|| self.settled_motion());
            return;
        }
        let [total, count] = self.elastic;
        if count > 0.0 {
            self.motion[0] = total / count;
            return;
        }
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for &c in &self.kept {
            if self.pressure[c] > 0.0 {
                low = low.max(self.residual[c]);
            } else {
                high = high.min(self.residual[c]);
            }
        }
        self.motion[0] = if high.is_finite() {
            0.5 * (low + high)
        } else {
            low
        };
    }

    /// Returns the motion of least violation on all cells.
    fn settled_motion(&self) -> Motions {
        let bound = |c: usize| {
            if self.pressure[c] <= 0.0 {
                Bound::Open
            } else if self.pressure[c] >= self.cap {
                Bound::Capped
            } else {
                Bound::Elastic
            }
        };
        let residual = |c: usize| self.residual[c];
        least_violation(&self.motions, self.motion, &self.kept, residual, bound)
    }

    fn not_converged(&self, error: f64) -> ContactError {
        ContactError::NotConverged {
            problem: "normal",
            iterations: self.iterations,
            error,
            tolerance: self.options.tolerance,
        }
    }

    /// Returns the error of the load and the moments relative to the load. Moments are divided by half the diagonal.
    fn imbalance(&self) -> f64 {
        let mut pressure = Vec::new();
        gather(&self.pressure, &self.kept, &mut pressure);
        let resultants = self.motions.resultants(&self.kept, &pressure);
        let distance = self.motions.distance(&resultants, &self.target);
        if distance == 0.0 {
            0.0
        } else {
            distance / sum(&pressure).max(self.target[0])
        }
    }

    /// Returns the solution if the pressures have the required resultants.
    fn finish(self, error: f64) -> Result<NormalSolution, ContactError> {
        let error = error.max(self.imbalance());
        if error.is_nan() || error > self.options.tolerance {
            return Err(self.not_converged(error));
        }
        let grid = self.problem.patch.grid;
        let mut gap = vec![0.0; grid.len()];
        for &c in &self.kept {
            gap[c] = self.residual[c] - self.motions.displacement_at(&self.motion, c);
        }
        let [load, x, y] = load_and_moments(grid, &self.pressure).map(|sum| sum * grid.cell_area());
        let moment = [x, y];
        let motion = self.motions.combined(&self.motion);
        let [approach, x, y] = [0, 1, 2].map(|k| self.given[k] + motion[k]);
        Ok(NormalSolution {
            pressure: self.pressure,
            gap,
            approach,
            rotation: [x, y],
            load,
            moment,
            iterations: self.iterations,
            error,
        })
    }
}

/// Sets a pressure to a bound if the pressure differs from the bound only by rounding. `largest` is the largest
/// pressure of other cells.
fn snap(pressure: &mut [f64], cap: f64, largest: f64) {
    let noise = NOISE * extremes(pressure).1.max(largest);
    for p in pressure {
        *p = if *p <= noise {
            0.0
        } else if *p >= cap - noise {
            cap
        } else {
            *p
        };
    }
}
