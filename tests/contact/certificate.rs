//! Certificate of a normal contact: the conditions on every cell, with sums that share no code with the solver.

use std::f64::consts::{PI, TAU};

use fretwear::contact::Boundary;
use fretwear::contact::Pair;
use fretwear::contact::normal::{Control, NormalProblem, NormalSolution, Rotation};
use fretwear::grid::Grid;

/// Rounding error of the load and the moments, relative to the given values.
const RESULTANT: f64 = 1e-11;

/// Rounding error of a displacement as a sum over all cells, and of the gap as a difference of displacement, height and approach.
const ROUNDING: f64 = 1e-13;

/// Displacements by direct sums over the cells.
pub struct Direct {
    grid: Grid,
    boundary: Boundary,
    /// Displacement of a free half space under unit pressure on a cell at the distance of (i, j) cells.
    influence: Vec<f64>,
    modulus: f64,
}

impl Direct {
    pub fn new(grid: Grid, pair: Pair, boundary: Boundary) -> Direct {
        let compliance =
            |m: fretwear::contact::Elastic| (1.0 - m.poisson_ratio.powi(2)) / m.youngs_modulus;
        let modulus = 1.0 / (compliance(pair.lower) + compliance(pair.upper));
        let influence = (0..grid.len())
            .map(|index| {
                let (i, j) = grid.cell(index);
                cell(i as f64 * grid.dx, j as f64 * grid.dy, grid) / (PI * modulus)
            })
            .collect();
        Direct {
            grid,
            boundary,
            influence,
            modulus,
        }
    }

    /// Displacement of one cell under unit pressure on this cell only \[m/Pa\].
    pub fn own(&self) -> f64 {
        self.influence[0]
    }

    pub fn displacement(&self, pressure: &[f64]) -> Vec<f64> {
        match self.boundary {
            Boundary::Free => self.free(pressure),
            Boundary::Periodic => self.periodic(pressure),
        }
    }

    fn free(&self, pressure: &[f64]) -> Vec<f64> {
        let grid = self.grid;
        let mut sum = vec![0.0; grid.len()];
        for (source, &p) in pressure.iter().enumerate().filter(|(_, p)| **p != 0.0) {
            let (si, sj) = grid.cell(source);
            for (target, u) in sum.iter_mut().enumerate() {
                let (i, j) = grid.cell(target);
                *u += p * self.influence[grid.index(i.abs_diff(si), j.abs_diff(sj))];
            }
        }
        sum
    }

    /// Displacement of a periodic half space: 2/(E* |k|) for every wave except the mean, by transforms along both axes.
    fn periodic(&self, pressure: &[f64]) -> Vec<f64> {
        let Grid { nx, ny, dx, dy } = self.grid;
        let wave = |m: usize, n: usize, d: f64| TAU * m.min(n - m) as f64 / (n as f64 * d);
        let along = |field: &[[f64; 2]], sign: f64, x: bool| -> Vec<[f64; 2]> {
            let (n, other) = if x { (nx, ny) } else { (ny, nx) };
            let at = |k: usize, o: usize| if x { k * ny + o } else { o * ny + k };
            let mut out = vec![[0.0; 2]; nx * ny];
            for (m, o) in (0..n).flat_map(|m| (0..other).map(move |o| (m, o))) {
                for k in 0..n {
                    let (sin, cos) = (sign * TAU * ((m * k) % n) as f64 / n as f64).sin_cos();
                    let [re, im] = field[at(k, o)];
                    out[at(m, o)][0] += re * cos - im * sin;
                    out[at(m, o)][1] += re * sin + im * cos;
                }
            }
            out
        };
        let field: Vec<[f64; 2]> = pressure.iter().map(|p| [*p, 0.0]).collect();
        let mut spectrum = along(&along(&field, -1.0, true), -1.0, false);
        for (index, value) in spectrum.iter_mut().enumerate() {
            let k = wave(index / ny, nx, dx).hypot(wave(index % ny, ny, dy));
            let symbol = if k > 0.0 {
                2.0 / (self.modulus * k)
            } else {
                0.0
            };
            *value = value.map(|v| v * symbol / (nx * ny) as f64);
        }
        let back = along(&along(&spectrum, 1.0, true), 1.0, false);
        back.iter().map(|value| value[0]).collect()
    }
}

/// Integral ∫∫ dx dy / r over a cell whose centre has the distance (x, y) from the point.
fn cell(x: f64, y: f64, grid: Grid) -> f64 {
    let corner = |x: f64, y: f64| {
        let term = |a: f64, b: f64| {
            if a == 0.0 {
                0.0
            } else {
                a * (b / a.abs()).asinh()
            }
        };
        term(x, y) + term(y, x)
    };
    let (a, b) = (0.5 * grid.dx, 0.5 * grid.dy);
    corner(x + a, y + b) - corner(x - a, y + b) - corner(x + a, y - b) + corner(x - a, y - b)
}

/// True if a number exceeds its bound or is NaN.
pub fn beyond(value: f64, bound: f64) -> bool {
    value.is_nan() || value > bound
}

/// Checks that `found` solves `problem`: admissible pressures, gaps of the right sign and the resultants. The tolerance of the gaps is
/// `tolerance` times the displacement `own` of one cell under the peak pressure. `displacement` belongs to the computed pressures and is
/// independent of the solver.
pub fn certify(
    problem: &NormalProblem,
    found: &NormalSolution,
    displacement: &[f64],
    own: f64,
    tolerance: f64,
) -> Result<(), String> {
    let Grid { dx, dy, nx, ny } = problem.patch.grid;
    let cap = problem.pressure_cap.unwrap_or(f64::INFINITY);
    let peak = found.pressure.iter().copied().fold(0.0, f64::max);
    let [tilt_x, tilt_y] = found.rotation;
    let mut size = 0.0f64;
    let mut gaps = Vec::new();
    let (mut load, mut moment) = (0.0, [0.0; 2]);
    for c in (0..nx * ny).filter(|&c| problem.patch.is_in_joint[c]) {
        let (x, y) = problem.patch.grid.centre(c / ny, c % ny);
        let moved = found.approach + tilt_x * y - tilt_y * x;
        let own_compliance = problem.compliance.map_or(0.0, |d| d[c]) * found.pressure[c];
        gaps.push((
            c,
            displacement[c] + own_compliance - problem.height[c] - moved,
        ));
        size = size.max(displacement[c].abs() + problem.height[c].abs() + moved.abs());
        let force = found.pressure[c] * dx * dy;
        load += force;
        moment[0] += force * y;
        moment[1] -= force * x;
    }
    let slack = tolerance * own * peak + ROUNDING * size;
    for &(c, gap) in &gaps {
        let (i, j, p) = (c / ny, c % ny, found.pressure[c]);
        if !(0.0..=cap).contains(&p) {
            return Err(format!(
                "cell ({i}, {j}): a pressure of {p:e}, at most {cap:e}"
            ));
        }
        if p < cap && gap < -slack {
            return Err(format!(
                "cell ({i}, {j}) overlaps by {gap:e}, {slack:e} allowed"
            ));
        }
        if p > 0.0 && gap > slack {
            return Err(format!(
                "cell ({i}, {j}) has a pressure of {p:e} at a gap of {gap:e}, {slack:e} allowed"
            ));
        }
        if beyond((gap - found.gap[c]).abs(), 2.0 * slack) {
            return Err(format!(
                "cell ({i}, {j}): a gap of {gap:e} is reported as {:e}",
                found.gap[c]
            ));
        }
    }
    let masked = (0..nx * ny).filter(|&c| !problem.patch.is_in_joint[c]);
    if let Some(c) = masked
        .into_iter()
        .find(|&c| found.pressure[c] != 0.0 || found.gap[c] != 0.0)
    {
        return Err(format!(
            "cell {c} is outside the joint and has {:e} Pa",
            found.pressure[c]
        ));
    }
    let arm = (nx as f64 * dx).hypot(ny as f64 * dy);
    let mut sums = vec![("reported load", found.load, load, load)];
    if let Control::Load(asked) = problem.control {
        sums.push(("given load", asked, load, load));
    }
    if let Rotation::Free { moment: asked } = problem.rotation {
        sums.push(("moment x", asked[0], moment[0], load * arm));
        sums.push(("moment y", asked[1], moment[1], load * arm));
    }
    for (what, expected, sum, scale) in sums {
        if beyond((sum - expected).abs(), RESULTANT * scale) {
            return Err(format!(
                "{what}: {expected:e}, the pressures sum up to {sum:e}"
            ));
        }
    }
    Ok(())
}
