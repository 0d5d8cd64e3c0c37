//! Projected gradient steps: what decides the sets where their exchange cycles.

use super::active_set::{Cell, Solver};

/// Pressures this close to a bound are on it, as a part of the sum of all of them.
const ON_BOUND: f64 = 1e-14;

/// Descent steps between two attempts at an elastic solve.
const DESCENT_STEPS: usize = 20;

/// Where the descent steps stand: a pressure within its bounds, its residual, the length of the next step \[Pa/m\].
pub(super) struct Descent {
    pressure: Vec<f64>,
    residual: Vec<f64>,
    step: f64,
}

impl Solver<'_, '_> {
    /// The pressure to descend from: the present one, moved into its bounds and to the load.
    pub(super) fn start_descent(&mut self) -> Descent {
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
    pub(super) fn descend(&mut self, mut state: Descent) -> Descent {
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
}
