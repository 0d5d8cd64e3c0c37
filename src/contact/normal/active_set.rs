//! The primal–dual active set: which cells are open, elastic or capped, and the elastic solve between exchanges.

use super::descent::Descent;
use super::{NormalOptions, NormalProblem, NormalSolution};
use crate::contact::error::ContactError;
use crate::contact::half_space::HalfSpace;

/// Part of the residual that an inner solve must remove before the set of cells is looked at again.
const INNER_REDUCTION: f64 = 0.02;

/// Exchanges after which they are taken to cycle, and the sets come from descent steps instead. Sets that settle do so within
/// a dozen; those that cycle have a cap that leaves few elastic cells.
const PATIENCE: usize = 16;

/// Rounding of a sum over a transform, relative to the largest term.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Cell {
    Masked,
    Open,
    Elastic,
    Capped,
}

/// The state of a solve. `residual` is (K + D) p − h on the whole grid; the gap is `residual − approach`.
pub(super) struct Solver<'a, 'h> {
    pub(super) half_space: &'h mut HalfSpace,
    pub(super) problem: &'a NormalProblem<'a>,
    pub(super) options: NormalOptions,
    pub(super) cap: f64,
    /// Σ p over the grid that carries the load \[Pa\].
    pub(super) sum: f64,
    pub(super) cells: Vec<Cell>,
    /// Positions of the elastic cells, in order.
    pub(super) free: Vec<usize>,
    /// √(λ/(λ + D)): the preconditioner's scaling where the diagonal compliance rules.
    pub(super) scaling: Option<Vec<f64>>,
    pub(super) pressure: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) approach: f64,
    pub(super) direction: Vec<f64>,
    pub(super) image: Vec<f64>,
    pub(super) preconditioned: Vec<f64>,
    /// The preconditioner applied to 1 on the elastic cells, and its sum.
    pub(super) rigid: Vec<f64>,
    pub(super) rigid_sum: f64,
    pub(super) iterations: usize,
}

impl<'a, 'h> Solver<'a, 'h> {
    pub(super) fn new(
        half_space: &'h mut HalfSpace,
        problem: &'a NormalProblem<'a>,
        options: NormalOptions,
    ) -> Self {
        let n = problem.patch.grid.len();
        let lambda = half_space.self_compliance();
        let scaling = problem
            .compliance
            .map(|d| d.iter().map(|d| (lambda / (lambda + d)).sqrt()).collect());
        Solver {
            half_space,
            problem,
            options,
            cap: problem.pressure_cap.unwrap_or(f64::INFINITY),
            sum: problem.load / problem.patch.grid.cell_area(),
            cells: vec![Cell::Masked; n],
            free: Vec::new(),
            scaling,
            pressure: vec![0.0; n],
            residual: vec![0.0; n],
            approach: 0.0,
            direction: vec![0.0; n],
            image: vec![0.0; n],
            preconditioned: vec![0.0; n],
            rigid: vec![0.0; n],
            rigid_sum: 0.0,
            iterations: 0,
        }
    }

    pub(super) fn run(mut self, start: Option<&[f64]>) -> Result<NormalSolution, ContactError> {
        self.begin(start);
        self.carry_load();
        self.update_residual();
        let mut exchanges = 0;
        let mut descent: Option<Descent> = None;
        loop {
            self.solve_elastic();
            let error = self.error();
            if error <= self.options.tolerance {
                return Ok(self.finish(exchanges, error));
            }
            if self.iterations >= self.options.max_iterations {
                let (iterations, tolerance) = (self.iterations, self.options.tolerance);
                return Err(ContactError::NotConverged {
                    problem: "normal",
                    iterations,
                    error,
                    tolerance,
                });
            }
            if exchanges < PATIENCE {
                self.exchange();
                self.carry_load();
                self.update_residual();
            } else {
                let state = descent.take().unwrap_or_else(|| self.start_descent());
                descent = Some(self.descend(state));
            }
            exchanges += 1;
        }
    }

    /// First pressure and sets: a given pressure, or a uniform one.
    fn begin(&mut self, start: Option<&[f64]>) {
        let usable =
            start.filter(|p| (0..p.len()).any(|c| self.problem.patch.kept[c] && p[c] > 0.0));
        for (c, &kept) in self.problem.patch.kept.iter().enumerate() {
            if !kept {
                continue;
            }
            self.pressure[c] = usable.map_or(1.0, |p| p[c].clamp(0.0, self.cap));
            self.cells[c] = match self.pressure[c] {
                0.0 => Cell::Open,
                p if p >= self.cap => Cell::Capped,
                _ => Cell::Elastic,
            };
        }
    }

    /// Gives the elastic cells the load that the capped ones leave them. The start of an inner solve needs that sum alone,
    /// not pressures within bounds; only sets that cannot carry the load at all are mended.
    fn carry_load(&mut self) {
        let (mut elastic, mut capped) = (0.0, 0usize);
        for (c, cell) in self.cells.iter().enumerate() {
            match cell {
                Cell::Elastic => elastic += self.pressure[c],
                Cell::Capped => capped += 1,
                _ => (),
            }
        }
        let left = self.sum
            - if capped > 0 {
                capped as f64 * self.cap
            } else {
                0.0
            };
        if left <= 0.0 || elastic <= 0.0 {
            self.spread_load();
            return;
        }
        for (c, cell) in self.cells.iter().enumerate() {
            match cell {
                Cell::Elastic => self.pressure[c] *= left / elastic,
                Cell::Capped => self.pressure[c] = self.cap,
                _ => (),
            }
        }
    }

    /// Finds the factor f with Σ min(f p, p_max) = Σ p that carries the load, and caps the cells it says. The sum is concave
    /// in f, so Newton's method from 0 rises to the root without passing it.
    fn spread_load(&mut self) {
        let mut closed: Vec<usize> = (0..self.cells.len())
            .filter(|&c| self.pressure[c] > 0.0)
            .collect();
        if (closed.len() as f64) * self.cap <= self.sum {
            closed = (0..self.cells.len())
                .filter(|&c| self.cells[c] != Cell::Masked)
                .collect();
            let least = self.sum / closed.len() as f64;
            for &c in &closed {
                self.pressure[c] = self.pressure[c].max(least);
            }
        }
        let mut factor = 0.0;
        loop {
            let (mut sum, mut slope) = (0.0, 0.0);
            for &c in &closed {
                let scaled = factor * self.pressure[c];
                sum += scaled.min(self.cap);
                slope += if scaled < self.cap {
                    self.pressure[c]
                } else {
                    0.0
                };
            }
            let next = factor + (self.sum - sum) / slope;
            if slope == 0.0 || next <= factor * (1.0 + f64::EPSILON) {
                break;
            }
            factor = next;
        }
        for &c in &closed {
            let scaled = factor * self.pressure[c];
            self.cells[c] = if scaled < self.cap {
                Cell::Elastic
            } else {
                Cell::Capped
            };
            self.pressure[c] = scaled.min(self.cap);
        }
    }

    /// residual = (K + D) p − h.
    pub(super) fn update_residual(&mut self) {
        self.half_space.normal(&self.pressure, &mut self.residual);
        for (c, r) in self.residual.iter_mut().enumerate() {
            *r -= self.problem.height[c];
        }
        if let Some(d) = self.problem.compliance {
            for (c, r) in self.residual.iter_mut().enumerate() {
                *r += d[c] * self.pressure[c];
            }
        }
    }

    /// Displacement of a cell under the peak pressure: the scale of the error.
    fn scale(&self) -> f64 {
        let peak = self.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
        self.half_space.self_compliance() * peak
    }

    /// `preconditioned` = P M P `source` on the elastic cells, where M is the half spaces' approximate inverse.
    fn precondition(&mut self, source: impl Fn(&Self, usize) -> f64) {
        self.restrict_to_image(source);
        self.half_space
            .normal_inverse(&self.image, &mut self.preconditioned);
        if let Some(scaling) = &self.scaling {
            for &c in &self.free {
                self.preconditioned[c] *= scaling[c];
            }
        }
    }

    fn restrict_to_image(&mut self, source: impl Fn(&Self, usize) -> f64) {
        let mut image = std::mem::take(&mut self.image);
        image.fill(0.0);
        for &c in &self.free {
            image[c] = source(self, c) * self.scaling.as_ref().map_or(1.0, |s| s[c]);
        }
        self.image = image;
    }

    /// Preconditioned conjugate gradients on the elastic cells at constant load; also sets the approach.
    fn solve_elastic(&mut self) {
        self.free.clear();
        self.free
            .extend((0..self.cells.len()).filter(|&c| self.cells[c] == Cell::Elastic));
        if self.free.is_empty() {
            self.approach_of_capped();
            return;
        }
        self.precondition(|_, _| 1.0);
        self.rigid_sum = 0.0;
        for &c in &self.free {
            self.rigid[c] = self.preconditioned[c];
            self.rigid_sum += self.preconditioned[c];
        }
        self.direction.fill(0.0);
        let mut first = f64::NAN;
        let mut product = 0.0;
        loop {
            // The multiplier of the load constraint: the approach that the residual asks for in the preconditioner's metric.
            self.precondition(|s, c| s.residual[c] - s.approach);
            let shift = self
                .free
                .iter()
                .map(|&c| self.preconditioned[c])
                .sum::<f64>()
                / self.rigid_sum;
            self.approach += shift;
            let (mut largest, mut new_product) = (0.0f64, 0.0);
            for &c in &self.free {
                self.preconditioned[c] -= shift * self.rigid[c];
                let w = self.residual[c] - self.approach;
                largest = largest.max(w.abs());
                new_product += self.preconditioned[c] * w;
            }
            if first.is_nan() {
                first = largest;
            }
            let enough = (INNER_REDUCTION * first).max(0.5 * self.options.tolerance * self.scale());
            if largest <= enough
                || self.free.len() == 1
                || self.iterations >= self.options.max_iterations
            {
                return;
            }
            let beta = if product > 0.0 {
                new_product / product
            } else {
                0.0
            };
            product = new_product;
            for &c in &self.free {
                self.direction[c] = beta * self.direction[c] - self.preconditioned[c];
            }
            self.half_space.normal(&self.direction, &mut self.image);
            if let Some(d) = self.problem.compliance {
                for &c in &self.free {
                    self.image[c] += d[c] * self.direction[c];
                }
            }
            let curvature: f64 = self
                .free
                .iter()
                .map(|&c| self.direction[c] * self.image[c])
                .sum();
            if curvature <= 0.0 {
                return;
            }
            let step = product / curvature;
            for &c in &self.free {
                self.pressure[c] += step * self.direction[c];
            }
            for (r, i) in self.residual.iter_mut().zip(&self.image) {
                *r += step * i;
            }
            self.iterations += 1;
        }
    }

    /// With no elastic cell the approach is not unique: take the middle of what open and capped cells allow.
    fn approach_of_capped(&mut self) {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (c, cell) in self.cells.iter().enumerate() {
            match cell {
                Cell::Capped => low = low.max(self.residual[c]),
                Cell::Open => high = high.min(self.residual[c]),
                _ => (),
            }
        }
        self.approach = if high.is_finite() {
            0.5 * (low + high)
        } else {
            low
        };
    }

    /// How far a cell is from its conditions, as a displacement; a cell of negative pressure is as far as can be.
    fn violation(&self, c: usize) -> f64 {
        let gap = self.residual[c] - self.approach;
        match self.cells[c] {
            Cell::Masked => 0.0,
            Cell::Open => (-gap).max(0.0),
            Cell::Capped => gap.max(0.0),
            Cell::Elastic if self.pressure[c] < 0.0 || self.pressure[c] > self.cap => f64::INFINITY,
            Cell::Elastic => gap.abs(),
        }
    }

    fn error(&self) -> f64 {
        let worst = (0..self.cells.len())
            .map(|c| self.violation(c))
            .fold(0.0, f64::max);
        // A residual is a difference of heights, displacements and approach: it cannot be smaller than their rounding.
        let rounding = ROUNDING * self.approach.abs();
        if worst.is_nan() {
            f64::INFINITY
        } else {
            (worst - rounding).max(0.0) / self.scale()
        }
    }

    /// Puts each cell where its sign says it belongs.
    fn exchange(&mut self) {
        let slack = 0.5 * self.options.tolerance * self.scale();
        for c in 0..self.cells.len() {
            let gap = self.residual[c] - self.approach;
            match self.cells[c] {
                Cell::Elastic if self.pressure[c] <= 0.0 => {
                    self.pressure[c] = 0.0;
                    self.cells[c] = Cell::Open;
                }
                Cell::Elastic if self.pressure[c] >= self.cap => self.cells[c] = Cell::Capped,
                Cell::Open if gap < -slack => self.cells[c] = Cell::Elastic,
                Cell::Capped if gap > slack => self.cells[c] = Cell::Elastic,
                _ => (),
            }
        }
    }

    fn finish(self, exchanges: usize, error: f64) -> NormalSolution {
        let gap = (0..self.cells.len())
            .map(|c| {
                if self.cells[c] == Cell::Masked {
                    0.0
                } else {
                    self.residual[c] - self.approach
                }
            })
            .collect();
        NormalSolution {
            pressure: self.pressure,
            gap,
            approach: self.approach,
            iterations: self.iterations,
            exchanges,
            error,
        }
    }
}
