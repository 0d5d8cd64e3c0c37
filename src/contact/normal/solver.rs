//! Projected conjugate gradients with the half spaces' approximate inverse as preconditioner.
//!
//! Every step leads from a pressure within its bounds, with the resultants asked for, to another one of lower energy. The
//! search direction keeps its conjugacy while cells come and go (β of Hestenes and Stiefel, from the true change of the
//! residual). A trial step of the predicted length is projected onto the admissible pressures, and the chord to the
//! projected point, whose displacement is the one convolution of the iteration, is followed to its minimum: on a steady set of
//! cells this is the conjugate gradient method, and everywhere a descent. Where the projection bends a direction so far that
//! the chord does not descend, shorter and plainer ones are tried, down to the projected gradient, which always does; these
//! trials cost no convolution.

use super::projection::project;
use super::rigid::{Motions, RigidMotions, displacement, load_and_moments};
use super::settle::{Bound, least_violation};
use super::{Control, NormalOptions, NormalProblem, NormalSolution, Rotation};
use crate::contact::error::ContactError;
use crate::contact::half_space::HalfSpace;

/// Rounding of a gap relative to the approach: that of the sums over a transform, and of pressures in their last digit.
const ROUNDING: f64 = 128.0 * f64::EPSILON;

/// A chord descends if its slope is this part of the sum of its terms' sizes; less is rounding.
const LEAST_SLOPE: f64 = 1e-12;

/// Shorter trials along one direction before a plainer one is taken, each a quarter as long.
const TRIALS: usize = 3;

/// Of the largest pressure, or of the sum of all: a pressure or a step below it is the rounding of resultants.
const NOISE: f64 = 1e-13;

/// How far a chord that projection has bent is followed beyond its end. The rounding of its resultants grows as much.
const EXTENSION: f64 = 4.0;

/// Bounds on the length of a trial step along a preconditioned direction, whose natural length is one. Where the projection
/// cuts most of a step off, no length is the best one, and the prediction would run away.
const LENGTHS: (f64, f64) = (0.05, 4.0);

/// The state of a solve. The gap is `residual` − the unknown motions.
pub(super) struct Solver<'a, 'h> {
    half_space: &'h mut HalfSpace,
    problem: &'a NormalProblem<'a>,
    options: NormalOptions,
    cap: f64,
    /// The given motions, and the unknown ones with the resultants they must bring \[Pa, Pa m\].
    given: Motions,
    motions: RigidMotions,
    target: Motions,
    motion: Motions,
    kept: Vec<usize>,
    /// Cells whose pressure may change: elastic ones, and those on a bound that are to leave it.
    free: Vec<usize>,
    /// √(λ/(λ + D)): the preconditioner's scaling where the diagonal compliance rules.
    scaling: Option<Vec<f64>>,
    pressure: Vec<f64>,
    /// (K + D) p − h − the given motions.
    residual: Vec<f64>,
    /// The last step and its displacement.
    step: Vec<f64>,
    image: Vec<f64>,
    /// Gap on the free cells, 0 elsewhere.
    gap: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    trial: Vec<f64>,
    /// Length of the next trial step, in units of the direction.
    predicted: f64,
    iterations: usize,
}

/// A step that descends.
struct Trial {
    way: Way,
    length: f64,
    /// Whether it was projected.
    bent: bool,
}

/// Which way a trial step goes.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Conjugate,
    Preconditioned,
    Gradient,
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
        let scaling = problem
            .compliance
            .map(|d| d.iter().map(|d| (lambda / (lambda + d)).sqrt()).collect());
        let (mut given, mut target) = ([0.0; 3], [0.0; 3]);
        match problem.control {
            Control::Load(load) => target[0] = load / grid.cell_area(),
            Control::Approach(approach) => given[0] = approach,
        }
        match problem.rotation {
            Rotation::Given(rotation) => given[1..].copy_from_slice(&rotation),
            Rotation::Free { moment } => {
                target[1..].copy_from_slice(&moment.map(|m| m / grid.cell_area()))
            }
        }
        let motions = RigidMotions::new(
            grid,
            matches!(problem.control, Control::Load(_)),
            matches!(problem.rotation, Rotation::Free { .. }),
        );
        Solver {
            half_space,
            problem,
            options,
            cap: problem.pressure_cap.unwrap_or(f64::INFINITY),
            given,
            motions,
            target,
            motion: [0.0; 3],
            kept: (0..n).filter(|&c| problem.patch.kept[c]).collect(),
            free: Vec::with_capacity(n),
            scaling,
            pressure: vec![0.0; n],
            residual: vec![0.0; n],
            step: vec![0.0; n],
            image: vec![0.0; n],
            gap: vec![0.0; n],
            preconditioned: vec![0.0; n],
            direction: vec![0.0; n],
            trial: vec![0.0; n],
            predicted: 1.0,
            iterations: 0,
        }
    }

    pub(super) fn run(mut self, start: Option<&[f64]>) -> Result<NormalSolution, ContactError> {
        self.begin(start)?;
        // Whether the residual is that of the pressure, or what was summed up over some iterations.
        let mut anew = true;
        loop {
            let error = self.look();
            let done = error <= self.options.tolerance;
            if done && (anew || self.drift() <= 0.1 * self.options.tolerance) {
                return Ok(self.finish(error));
            }
            if !done && self.iterations < self.options.max_iterations && self.advance() {
                anew = false;
            } else if anew || self.iterations >= self.options.max_iterations {
                return Err(ContactError::NotConverged {
                    problem: "normal",
                    iterations: self.iterations,
                    error,
                    tolerance: self.options.tolerance,
                });
            } else {
                self.update_residual();
                anew = true;
            }
        }
    }

    /// First pressure: a given one, a uniform one, or none where the approach decides.
    fn begin(&mut self, start: Option<&[f64]>) -> Result<(), ContactError> {
        let usable = start.filter(|p| self.kept.iter().any(|&c| p[c] > 0.0));
        let uniform = match self.problem.control {
            Control::Load(_) => self.target[0] / self.kept.len() as f64,
            Control::Approach(_) => 0.0,
        };
        for &c in &self.kept {
            self.pressure[c] = usable.map_or(uniform, |p| p[c].clamp(0.0, self.cap));
        }
        let met = project(
            &self.motions,
            &self.kept,
            &mut self.pressure,
            self.cap,
            &self.target,
        );
        if let (false, Rotation::Free { moment }) = (met, self.problem.rotation) {
            return Err(ContactError::MomentNotCarried {
                moment,
                load: self.target[0] * self.problem.patch.grid.cell_area(),
            });
        }
        self.snap();
        if self.pressure.iter().any(|p| *p > 0.0) {
            self.update_residual();
        } else {
            self.displace(|s, c| -s.problem.height[c]);
        }
        Ok(())
    }

    /// Puts pressures that meet their bounds on them, not beside them by rounding.
    fn snap(&mut self) {
        let peak = self.kept.iter().map(|&c| self.pressure[c]);
        let noise = NOISE * peak.fold(0.0, f64::max);
        for &c in &self.kept {
            let p = self.pressure[c];
            self.pressure[c] = if p <= noise {
                0.0
            } else if p >= self.cap - noise {
                self.cap
            } else {
                p
            };
        }
    }

    /// Sets the residual on the kept cells, less the given motions.
    fn displace(&mut self, value: impl Fn(&Self, usize) -> f64) {
        let [approach, ..] = self.given;
        let tilted = self.given[1] != 0.0 || self.given[2] != 0.0;
        for k in 0..self.kept.len() {
            let c = self.kept[k];
            let motion = if tilted {
                displacement(self.problem.patch.grid, self.given, c)
            } else {
                approach
            };
            self.residual[c] = value(self, c) - motion;
        }
    }

    /// The residual from the pressure.
    fn update_residual(&mut self) {
        self.half_space.normal(&self.pressure, &mut self.image);
        let image = std::mem::take(&mut self.image);
        let compliance = self.problem.compliance;
        self.displace(|s, c| {
            let own = compliance.map_or(0.0, |d| d[c] * s.pressure[c]);
            image[c] + own - s.problem.height[c]
        });
        self.image = image;
        self.step.fill(0.0);
    }

    /// Displacement of a cell under the peak pressure: the scale of the error.
    fn scale(&self) -> f64 {
        let peak = self.kept.iter().map(|&c| self.pressure[c]);
        self.half_space.self_compliance() * peak.fold(0.0, f64::max)
    }

    /// A residual is a difference of heights, displacements and approach: it cannot be smaller than their rounding.
    fn rounding(&self) -> f64 {
        ROUNDING * (self.motion[0].abs() + self.given[0].abs())
    }

    /// What the rounding of all updates of the residual may have left, in units of the error.
    fn drift(&self) -> f64 {
        self.iterations as f64 * self.rounding() / self.scale()
    }

    /// Determines the unknown motions, the free cells, and the largest violation of the conditions on any cell.
    fn look(&mut self) -> f64 {
        self.find_motion();
        let rotates = self.motions.rotates();
        let mut worst = 0.0f64;
        self.free.clear();
        for &c in &self.kept {
            let p = self.pressure[c];
            let motion = if rotates {
                self.motions.at(&self.motion, c)
            } else {
                self.motion[0]
            };
            let gap = self.residual[c] - motion;
            let free = if p <= 0.0 {
                gap < 0.0
            } else if p >= self.cap {
                gap > 0.0
            } else {
                true
            };
            if free {
                worst = worst.max(gap.abs());
                self.free.push(c);
            }
        }
        let violation = (worst - self.rounding()).max(0.0);
        if worst.is_nan() {
            f64::INFINITY
        } else if violation == 0.0 {
            0.0
        } else {
            violation / self.scale()
        }
    }

    /// The motions that leave the elastic cells the least gap. Without an elastic cell the approach is the middle of what
    /// open and capped cells allow; with so few that they leave rotations undetermined, the motion of least violation on all.
    fn find_motion(&mut self) {
        if self.motions.none() {
            return;
        }
        let elastic = || {
            let inside = |c: &usize| self.pressure[*c] > 0.0 && self.pressure[*c] < self.cap;
            self.kept.iter().copied().filter(inside)
        };
        let resultants = self.motions.resultants(elastic(), |c| self.residual[c]);
        if let Some(motion) = self.motions.with_resultants(elastic(), resultants) {
            self.motion = motion;
            return;
        }
        if self.motions.rotates() {
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
            self.motion = least_violation(&self.motions, self.motion, &self.kept, residual, bound);
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

    /// One iteration. False where no direction descends: rounding is all that is left.
    fn advance(&mut self) -> bool {
        self.precondition();
        let Some(Trial { way, length, bent }) = self.descending_trial() else {
            return false;
        };
        self.half_space.normal(&self.step, &mut self.image);
        if let Some(d) = self.problem.compliance {
            for &c in &self.free {
                self.image[c] += d[c] * self.step[c];
            }
        }
        let (mut slope, mut curvature, mut reach) = (0.0, 0.0, f64::INFINITY);
        for &c in &self.free {
            let step = self.step[c];
            slope -= step * self.gap[c];
            curvature += step * self.image[c];
            if step < 0.0 {
                reach = reach.min(self.pressure[c] / -step);
            } else if step > 0.0 {
                reach = reach.min((self.cap - self.pressure[c]) / step);
            }
        }
        let best = if curvature > 0.0 {
            slope / curvature
        } else {
            f64::INFINITY
        };
        let part = best
            .min(reach)
            .min(if bent { EXTENSION } else { f64::INFINITY });
        if !part.is_finite() {
            return false;
        }
        for k in 0..self.free.len() {
            let c = self.free[k];
            self.pressure[c] += part * self.step[c];
        }
        self.snap();
        for &c in &self.kept {
            self.residual[c] += part * self.image[c];
        }
        if way != Way::Gradient {
            self.predicted = (length * best).clamp(LENGTHS.0, LENGTHS.1);
        }
        self.iterations += 1;
        true
    }

    /// The preconditioned gap and the conjugate direction, both without resultants, on the free cells.
    fn precondition(&mut self) {
        let free = || self.free.iter().copied();
        let level = self.motions.resultants(free(), |c| self.residual[c]);
        // Too few cells for all motions (or none unknown): those of the elastic cells will do.
        let level = self
            .motions
            .with_resultants(free(), level)
            .unwrap_or(self.motion);
        self.gap.fill(0.0);
        self.trial.fill(0.0);
        for &c in &self.free {
            let gap = self.residual[c] - self.motions.at(&level, c);
            self.gap[c] = gap;
            self.trial[c] = gap * self.scaling.as_ref().map_or(1.0, |s| s[c]);
        }
        self.half_space
            .normal_inverse(&self.trial, &mut self.preconditioned);
        if let Some(scaling) = &self.scaling {
            for &c in &self.free {
                self.preconditioned[c] *= scaling[c];
            }
        }
        without_resultants(&self.motions, &self.free, &mut self.preconditioned);
        let (mut change, mut curvature) = (0.0, 0.0);
        for &c in &self.free {
            change += self.preconditioned[c] * self.image[c];
            curvature += self.step[c] * self.image[c];
        }
        let beta = if curvature > 0.0 {
            (change / curvature).max(0.0)
        } else {
            0.0
        };
        for &c in &self.free {
            self.direction[c] = beta * self.step[c] - self.preconditioned[c];
        }
        without_resultants(&self.motions, &self.free, &mut self.direction);
    }

    /// Finds a step whose chord descends, and leaves it in `step` and its end in `trial`.
    fn descending_trial(&mut self) -> Option<Trial> {
        for way in [Way::Conjugate, Way::Preconditioned, Way::Gradient] {
            let mut length = match way {
                Way::Gradient => 1.0 / self.half_space.self_compliance(),
                _ => self.predicted,
            };
            for _ in 0..TRIALS {
                if let Some(bent) = self.descends(way, length) {
                    return Some(Trial { way, length, bent });
                }
                length *= 0.25;
            }
        }
        None
    }

    /// Whether the step is bent by the projection, if it descends.
    fn descends(&mut self, way: Way, length: f64) -> Option<bool> {
        let mut outside = false;
        for &c in &self.free {
            let direction = match way {
                Way::Conjugate => self.direction[c],
                Way::Preconditioned => -self.preconditioned[c],
                Way::Gradient => -self.gap[c],
            };
            let p = self.pressure[c] + length * direction;
            outside |= p < 0.0 || p > self.cap;
            self.trial[c] = p;
        }
        let bent = outside || way == Way::Gradient;
        if bent {
            // Cells that stay on a bound carry their part: none, or the cap.
            let mut target = self.target;
            if self.cap.is_finite() && !self.motions.none() {
                let is_free = &mut self.step;
                is_free.fill(0.0);
                self.free.iter().for_each(|&c| is_free[c] = 1.0);
                let held = self
                    .kept
                    .iter()
                    .copied()
                    .filter(|&c| is_free[c] == 0.0 && self.pressure[c] > 0.0);
                let held = self.motions.resultants(held, |c| self.pressure[c]);
                target = [0, 1, 2].map(|k| target[k] - held[k]);
            }
            // A trial so long that its digits do not hold the resultants would lose them.
            if !project(
                &self.motions,
                &self.free,
                &mut self.trial,
                self.cap,
                &target,
            ) {
                return None;
            }
        }
        self.step.fill(0.0);
        let (mut slope, mut size, mut moved, mut sum) = (0.0, 0.0, 0.0, 0.0);
        for &c in &self.free {
            let step = self.trial[c] - self.pressure[c];
            self.step[c] = step;
            slope -= step * self.gap[c];
            size += (step * self.gap[c]).abs();
            moved += step.abs();
            sum += self.pressure[c];
        }
        (slope > LEAST_SLOPE * size && moved > NOISE * sum).then_some(bent)
    }

    fn finish(self, error: f64) -> NormalSolution {
        let grid = self.problem.patch.grid;
        let mut gap = vec![0.0; grid.len()];
        for &c in &self.kept {
            gap[c] = self.residual[c] - self.motions.at(&self.motion, c);
        }
        let [load, x, y] = load_and_moments(grid, &self.pressure).map(|sum| sum * grid.cell_area());
        let moment = [x, y];
        let [approach, x, y] = [0, 1, 2].map(|k| self.given[k] + self.motion[k]);
        NormalSolution {
            pressure: self.pressure,
            gap,
            approach,
            rotation: [x, y],
            load,
            moment,
            iterations: self.iterations,
            error,
        }
    }
}

/// Takes the rigid motion out of a field on some cells that gives it its resultants.
fn without_resultants(motions: &RigidMotions, cells: &[usize], field: &mut [f64]) {
    let own = motions.resultants(cells.iter().copied(), |c| field[c]);
    if let Some(motion) = motions.with_resultants(cells.iter().copied(), own) {
        for &c in cells {
            field[c] -= motions.at(&motion, c);
        }
    }
}
