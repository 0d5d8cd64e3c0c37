//! Frictionless normal contact under a given load, elastic or elastic–perfectly plastic.
//!
//! Find the pressure p and the approach δ with gap g = (K + D) p − h − δ such that, on every kept cell,
//!
//! - p = 0 and g ≥ 0 (open), or 0 < p < p_max and g = 0 (elastic), or p = p_max and g ≤ 0 (capped) [A eq. 4.3],
//!
//! and Σ p dA = N. K is the half spaces' compliance, D an optional diagonal one (the implicit wear step's), h the heights.
//! This is a convex problem; it is solved by a primal–dual active set: solve for p on the elastic cells in the subspace of
//! constant load by preconditioned conjugate gradients, then exchange the cells of the wrong sign. Where the exchange cycles,
//! the sets come from projected gradient steps, along which the energy falls.

use super::error::ContactError;
use super::half_space::HalfSpace;
use crate::grid::Patch;

/// Part of the residual that an inner solve must remove before the set of cells is looked at again.
const INNER_REDUCTION: f64 = 0.02;

/// Exchanges after which they are taken to cycle, and the sets come from descent steps instead. Sets that settle do so within
/// a dozen; those that cycle have a cap that leaves few elastic cells.
const PATIENCE: usize = 16;

/// Pressures this close to a bound are on it, as a part of the sum of all of them.
const ON_BOUND: f64 = 1e-14;

/// Descent steps between two attempts at an elastic solve.
const DESCENT_STEPS: usize = 20;

/// Rounding of a sum over a transform, relative to the largest term.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// What is pressed on what.
#[derive(Debug, Clone, Copy)]
pub struct NormalProblem<'a> {
    /// Grid and kept cells.
    pub patch: &'a Patch,
    /// Composite height, positive towards the other body \[m\]; read on kept cells only.
    pub height: &'a [f64],
    /// Diagonal compliance D in addition to the half spaces', ≥ 0 \[m/Pa\].
    pub compliance: Option<&'a [f64]>,
    /// Total load N ≥ 0 \[N\].
    pub load: f64,
    /// Largest pressure p_max \[Pa\].
    pub pressure_cap: Option<f64>,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalOptions {
    /// Bound on [`NormalSolution::error`].
    pub tolerance: f64,
    /// Bound on the conjugate gradient iterations.
    pub max_iterations: usize,
}

impl Default for NormalOptions {
    fn default() -> Self {
        NormalOptions {
            tolerance: 1e-6,
            max_iterations: 4000,
        }
    }
}

/// A converged normal contact.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalSolution {
    /// Pressure, exactly 0 on open and masked cells and exactly the cap on capped ones \[Pa\].
    pub pressure: Vec<f64>,
    /// Gap g, 0 on masked cells; on contact cells the residual, on capped cells ≤ 0 (the overlap) \[m\].
    pub gap: Vec<f64>,
    /// Approach δ of the bodies, from first touch of height 0 \[m\].
    pub approach: f64,
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Exchanges of the active set.
    pub exchanges: usize,
    /// Largest violation of the conditions on any cell, as a displacement over that of one cell under the peak pressure.
    pub error: f64,
}

/// Where the descent steps stand: a pressure within its bounds, its residual, the length of the next step \[Pa/m\].
struct Descent {
    pressure: Vec<f64>,
    residual: Vec<f64>,
    step: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Cell {
    Masked,
    Open,
    Elastic,
    Capped,
}

/// Solves for pressure and gap. `start` is a pressure to begin from (a similar problem's), used for speed alone.
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &NormalProblem,
    start: Option<&[f64]>,
    options: NormalOptions,
) -> Result<NormalSolution, ContactError> {
    check(half_space, problem, start)?;
    if problem.load == 0.0 {
        return Ok(untouched(problem));
    }
    Solver::new(half_space, problem, options).run(start)
}

fn check(
    half_space: &HalfSpace,
    problem: &NormalProblem,
    start: Option<&[f64]>,
) -> Result<(), ContactError> {
    let grid = problem.patch.grid;
    let cells = grid.len();
    let length = |field: &'static str, found: usize| {
        if found == cells {
            Ok(())
        } else {
            Err(ContactError::Length {
                field,
                found,
                expected: cells,
            })
        }
    };
    length("half space", half_space.grid().len())?;
    length("mask", problem.patch.kept.len())?;
    length("height", problem.height.len())?;
    length("compliance", problem.compliance.map_or(cells, <[f64]>::len))?;
    length("starting pressure", start.map_or(cells, <[f64]>::len))?;
    let fields = [
        ("height", Some(problem.height)),
        ("compliance", problem.compliance),
        ("starting pressure", start),
    ];
    for (field, values) in fields.into_iter().filter_map(|(name, v)| Some((name, v?))) {
        let wrong = (0..cells).find(|&c| problem.patch.kept[c] && !values[c].is_finite());
        if let Some(index) = wrong {
            let (i, j) = grid.cell(index);
            return Err(ContactError::NotFinite {
                field,
                i,
                j,
                value: values[index],
            });
        }
    }
    if !(problem.load.is_finite() && problem.load >= 0.0) {
        return Err(ContactError::OutOfRange {
            name: "load",
            value: problem.load,
            expected: "finite and ≥ 0 N",
        });
    }
    let kept = problem.patch.cells();
    if kept == 0 {
        return Err(ContactError::OutOfRange {
            name: "number of kept cells",
            value: 0.0,
            expected: "at least 1",
        });
    }
    if let Some(cap) = problem.pressure_cap {
        if !(cap.is_finite() && cap > 0.0) {
            return Err(ContactError::OutOfRange {
                name: "pressure cap",
                value: cap,
                expected: "finite and > 0 Pa",
            });
        }
        let capacity = cap * problem.patch.area();
        if problem.load > capacity {
            let cell_area = grid.cell_area();
            return Err(ContactError::CapExceeded {
                load: problem.load,
                capacity,
                cells: kept,
                cell_area,
                cap,
            });
        }
    }
    Ok(())
}

/// No load: the highest point just touches.
fn untouched(problem: &NormalProblem) -> NormalSolution {
    let kept = &problem.patch.kept;
    let top = (0..kept.len())
        .filter(|&c| kept[c])
        .map(|c| problem.height[c])
        .fold(f64::NEG_INFINITY, f64::max);
    let gap = (0..kept.len())
        .map(|c| {
            if kept[c] {
                top - problem.height[c]
            } else {
                0.0
            }
        })
        .collect();
    let pressure = vec![0.0; kept.len()];
    NormalSolution {
        pressure,
        gap,
        approach: -top,
        iterations: 0,
        exchanges: 0,
        error: 0.0,
    }
}

/// The state of a solve. `residual` is (K + D) p − h on the whole grid; the gap is `residual − approach`.
struct Solver<'a, 'h> {
    half_space: &'h mut HalfSpace,
    problem: &'a NormalProblem<'a>,
    options: NormalOptions,
    cap: f64,
    /// Σ p over the grid that carries the load \[Pa\].
    sum: f64,
    cells: Vec<Cell>,
    /// Positions of the elastic cells, in order.
    free: Vec<usize>,
    /// √(λ/(λ + D)): the preconditioner's scaling where the diagonal compliance rules.
    scaling: Option<Vec<f64>>,
    pressure: Vec<f64>,
    residual: Vec<f64>,
    approach: f64,
    direction: Vec<f64>,
    image: Vec<f64>,
    preconditioned: Vec<f64>,
    /// The preconditioner applied to 1 on the elastic cells, and its sum.
    rigid: Vec<f64>,
    rigid_sum: f64,
    iterations: usize,
}

impl<'a, 'h> Solver<'a, 'h> {
    fn new(
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

    fn run(mut self, start: Option<&[f64]>) -> Result<NormalSolution, ContactError> {
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
    fn update_residual(&mut self) {
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

    /// The pressure to descend from: the present one, moved into its bounds and to the load.
    fn start_descent(&mut self) -> Descent {
        let mut pressure = std::mem::take(&mut self.pressure);
        self.project(&mut pressure);
        self.pressure = pressure.clone();
        self.update_residual();
        Descent {
            pressure,
            residual: self.residual.clone(),
            step: 1.0 / self.half_space.self_compliance(),
        }
    }

    /// A few projected gradient steps, each with the minimum on its chord and the length of Barzilai and Borwein: the energy
    /// falls at every one of them, so that the sets they leave for the elastic solve cannot cycle.
    fn descend(&mut self, mut state: Descent) -> Descent {
        for _ in 0..DESCENT_STEPS {
            let mut trial: Vec<f64> = state
                .pressure
                .iter()
                .zip(&state.residual)
                .map(|(p, r)| p - state.step * r)
                .collect();
            self.project(&mut trial);
            for (d, (t, p)) in self
                .direction
                .iter_mut()
                .zip(trial.iter().zip(&state.pressure))
            {
                *d = t - p;
            }
            self.half_space.normal(&self.direction, &mut self.image);
            if let Some(d) = self.problem.compliance {
                for (c, image) in self.image.iter_mut().enumerate() {
                    *image += d[c] * self.direction[c];
                }
            }
            self.iterations += 1;
            let (mut slope, mut curvature, mut square) = (0.0, 0.0, 0.0);
            for (c, d) in self.direction.iter().enumerate() {
                slope += d * state.residual[c];
                curvature += d * self.image[c];
                square += d * d;
            }
            if !(slope < 0.0 && curvature > 0.0) {
                break;
            }
            let part = (-slope / curvature).min(1.0);
            for c in 0..self.direction.len() {
                state.pressure[c] += part * self.direction[c];
                state.residual[c] += part * self.image[c];
            }
            state.step = square / curvature;
        }
        for c in 0..self.cells.len() {
            if self.cells[c] == Cell::Masked {
                continue;
            }
            // A load of a whole number of capped cells leaves no elastic one, but for rounding.
            let p = state.pressure[c];
            (self.cells[c], self.pressure[c]) = if p <= ON_BOUND * self.sum {
                (Cell::Open, 0.0)
            } else if self.cap - p <= ON_BOUND * self.sum {
                (Cell::Capped, self.cap)
            } else {
                (Cell::Elastic, p)
            };
        }
        self.residual.copy_from_slice(&state.residual);
        state
    }

    /// The nearest pressure within the bounds that carries the load: all are shifted alike, then cut.
    fn project(&self, pressure: &mut [f64]) {
        let kept: Vec<usize> = (0..pressure.len())
            .filter(|&c| self.cells[c] != Cell::Masked)
            .collect();
        let carried = |shift: f64| {
            kept.iter()
                .map(|&c| (pressure[c] + shift).clamp(0.0, self.cap))
                .sum::<f64>()
        };
        let highest = kept
            .iter()
            .map(|&c| pressure[c])
            .fold(f64::NEG_INFINITY, f64::max);
        let lowest = kept
            .iter()
            .map(|&c| pressure[c])
            .fold(f64::INFINITY, f64::min);
        let (mut low, mut high) = (-highest, self.cap.min(self.sum) - lowest);
        // More halvings than a double has bits.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if carried(middle) < self.sum {
                low = middle
            } else {
                high = middle
            }
        }
        for (p, cell) in pressure.iter_mut().zip(&self.cells) {
            *p = if *cell == Cell::Masked {
                0.0
            } else {
                (*p + high).clamp(0.0, self.cap)
            };
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
