//! Paraboloid with capped pressure: an axisymmetric solution, dense and independent of the grid solvers.
//!
//! The pressure is limited by 0 ≤ p ≤ p_max [A eq. 4.3]. The contact circle of radius a contains a plateau p = p_max of
//! radius b. The mixed problem in b < r < a has no closed form. The axisymmetric solution uses a constant pressure on
//! each of many concentric rings. Each ring is the difference of two uniformly loaded discs. Complete elliptic
//! integrals express the surface displacement of a disc exactly (Johnson, Contact Mechanics, eq. 3.29). A primal-dual
//! active set with a dense factorisation satisfies the bounds.

use std::f64::consts::PI;

use super::elliptic;
use crate::contact::ContactError;

/// Number of steps that change every violating ring at once. About ten suffice, unless the steps cycle under
/// a wide plateau.
const BLOCK_STEPS: usize = 25;

/// Largest number of steps. The steps after the block steps change one ring each, the one with the smallest
/// index, and cannot cycle (Murty's rule).
const MAX_STEPS: usize = 2000;

/// Paraboloid on a flat, with pressure limited to `cap`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CappedHertz {
    /// Radius of curvature R at the apex \[m\].
    pub radius: f64,
    /// Normal load N \[N\].
    pub load: f64,
    /// Effective modulus E* \[Pa\].
    pub effective_modulus: f64,
    /// Largest pressure \[Pa\]; `f64::INFINITY` for no limit.
    pub cap: f64,
}

/// Solution on rings of equal width.
#[derive(Debug, Clone, PartialEq)]
pub struct RingSolution {
    /// Width of a ring \[m\]; ring i covers i·width to (i + 1)·width.
    pub width: f64,
    /// Pressure on each ring \[Pa\].
    pub pressure: Vec<f64>,
    /// Radius a of the contact \[m\]. The square root with which the pressure falls to 0 locates it within a
    /// ring.
    pub contact_radius: f64,
    /// Radius b of the plateau at the cap \[m\], located in the same way; 0 without a plateau.
    pub plateau_radius: f64,
    /// Approach from the first touch of the apex \[m\].
    pub approach: f64,
}

impl RingSolution {
    /// Returns ∫p dA \[N\].
    pub fn load(&self) -> f64 {
        self.pressure
            .iter()
            .enumerate()
            .map(|(i, p)| p * ring_area(i, self.width))
            .sum()
    }

    /// Returns the pressure at distance `r` from the axis \[Pa\], linear between the middles of the rings.
    pub fn pressure_at(&self, r: f64) -> f64 {
        let position = (r / self.width - 0.5).max(0.0);
        let below = position as usize;
        let value = |i: usize| self.pressure.get(i).copied().unwrap_or(0.0);
        value(below) + (position - below as f64) * (value(below + 1) - value(below))
    }
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    Free,
    Capped,
}

impl CappedHertz {
    /// Solves with `rings` rings over a disc somewhat larger than the contact.
    ///
    /// # Errors
    /// Returns [`ContactError::NotConverged`] if the active set keeps changing. The error value in `NotConverged` is
    /// the fraction of rings that still change.
    pub fn solve(&self, rings: usize) -> Result<RingSolution, ContactError> {
        let elastic = super::Hertz {
            radius: self.radius,
            load: self.load,
            effective_modulus: self.effective_modulus,
        }
        .contact_radius();
        let mut extent = 1.15 * elastic.max((self.load / (PI * self.cap)).sqrt());
        loop {
            let (solution, open) = self.solve_within(extent, rings)?;
            if open {
                return Ok(solution);
            }
            extent *= 1.2;
        }
    }

    /// Solves on the disc of radius `extent`. The flag is false if the contact fills the disc.
    fn solve_within(
        &self,
        extent: f64,
        rings: usize,
    ) -> Result<(RingSolution, bool), ContactError> {
        let width = extent / rings as f64;
        let middle = |i: usize| (i as f64 + 0.5) * width;
        let gap: Vec<f64> = (0..rings)
            .map(|i| 0.5 * middle(i).powi(2) / self.radius)
            .collect();
        let kernel = ring_kernel(rings, width, self.effective_modulus);
        let row = |i: usize| &kernel[i * rings..(i + 1) * rings];

        let mut state = vec![State::Free; rings];
        let mut pressure = vec![0.0; rings];
        let mut changed = 0;
        for step in 0..MAX_STEPS {
            let free: Vec<usize> = (0..rings).filter(|&i| state[i] == State::Free).collect();
            for i in 0..rings {
                pressure[i] = if state[i] == State::Capped {
                    self.cap
                } else {
                    0.0
                };
            }
            // Unknowns: the free pressures and the approach. Rows: zero gap on the free rings, then the load.
            let n = free.len() + 1;
            let mut matrix = vec![0.0; n * n];
            let mut rhs = vec![0.0; n];
            for (k, &i) in free.iter().enumerate() {
                for (l, &j) in free.iter().enumerate() {
                    matrix[k * n + l] = row(i)[j];
                }
                matrix[k * n + n - 1] = -1.0;
                matrix[(n - 1) * n + k] = ring_area(i, width);
                rhs[k] = -gap[i] - dot(row(i), &pressure);
            }
            rhs[n - 1] = self.load
                - pressure
                    .iter()
                    .enumerate()
                    .map(|(i, p)| p * ring_area(i, width))
                    .sum::<f64>();
            solve_dense(&mut matrix, &mut rhs);
            let approach = rhs[n - 1];
            for (k, &i) in free.iter().enumerate() {
                pressure[i] = rhs[k];
            }

            changed = 0;
            for i in 0..rings {
                let next = match state[i] {
                    State::Free if pressure[i] < 0.0 => State::Open,
                    State::Free if pressure[i] > self.cap => State::Capped,
                    State::Free => State::Free,
                    bound => {
                        let opening = gap[i] + dot(row(i), &pressure) - approach;
                        match bound {
                            State::Open if opening < 0.0 => State::Free,
                            State::Capped if opening > 0.0 => State::Free,
                            kept => kept,
                        }
                    }
                };
                if next != state[i] {
                    changed += 1;
                    state[i] = next;
                    if step >= BLOCK_STEPS {
                        break;
                    }
                }
            }
            if changed == 0 {
                let open = state[rings - 1] == State::Open;
                let contact = state.iter().take_while(|s| **s != State::Open).count();
                let plateau = state.iter().take_while(|s| **s == State::Capped).count();
                let falling: Vec<(f64, f64)> = (plateau..contact)
                    .rev()
                    .map(|i| (middle(i), pressure[i]))
                    .collect();
                let dropping: Vec<(f64, f64)> = (plateau..contact)
                    .map(|i| (middle(i), self.cap - pressure[i]))
                    .collect();
                let solution = RingSolution {
                    width,
                    contact_radius: edge(&falling).unwrap_or(contact as f64 * width),
                    plateau_radius: if plateau == 0 {
                        0.0
                    } else {
                        edge(&dropping).unwrap_or(plateau as f64 * width)
                    },
                    approach,
                    pressure,
                };
                return Ok((solution, open));
            }
        }
        Err(ContactError::NotConverged {
            problem: "axisymmetric normal",
            iterations: MAX_STEPS,
            error: changed as f64 / rings as f64,
            tolerance: 0.0,
        })
    }
}

/// Returns the radius at which a quantity reaches 0 like a square root. `values` contains the radius of each ring and
/// the quantity at the ring. The first ring is at the edge where the quantity reaches 0.
///
/// Near the edge, the square of the quantity is linear in r². The function skips the two rings next to the edge,
/// because the edge cuts one of the two rings.
fn edge(values: &[(f64, f64)]) -> Option<f64> {
    let (near, far) = (values.get(2)?, values.get(6)?);
    let (near_square, far_square) = (near.1 * near.1, far.1 * far.1);
    let (near_r, far_r) = (near.0 * near.0, far.0 * far.0);
    Some((near_r - near_square * (far_r - near_r) / (far_square - near_square)).sqrt())
}

fn ring_area(i: usize, width: f64) -> f64 {
    PI * width * width * (2 * i + 1) as f64
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Returns the displacement at the middle of ring i under unit pressure on ring j \[m/Pa\], row-major.
fn ring_kernel(rings: usize, width: f64, effective_modulus: f64) -> Vec<f64> {
    let mut kernel = Vec::with_capacity(rings * rings);
    for i in 0..rings {
        let r = (i as f64 + 0.5) * width;
        let mut inner = 0.0;
        for j in 0..rings {
            let outer = disc_displacement((j + 1) as f64 * width, r, effective_modulus);
            kernel.push(outer - inner);
            inner = outer;
        }
    }
    kernel
}

/// Returns the displacement at distance `r` under unit pressure on a disc of radius `disc` \[m/Pa\] (Johnson
/// eq. 3.29).
fn disc_displacement(disc: f64, r: f64, effective_modulus: f64) -> f64 {
    let scale = 4.0 / (PI * effective_modulus);
    if r < disc {
        scale * disc * elliptic::complete((r / disc).powi(2)).1
    } else {
        let m = (disc / r).powi(2);
        let (first, second) = elliptic::complete(m);
        scale * r * (second - (1.0 - m) * first)
    }
}

/// Solves by Gaussian elimination with partial pivoting. The solution replaces `rhs`.
fn solve_dense(matrix: &mut [f64], rhs: &mut [f64]) {
    let n = rhs.len();
    for column in 0..n {
        let pivot = (column..n)
            .max_by(|&a, &b| {
                matrix[a * n + column]
                    .abs()
                    .total_cmp(&matrix[b * n + column].abs())
            })
            .unwrap_or(column);
        if pivot != column {
            for k in column..n {
                matrix.swap(pivot * n + k, column * n + k);
            }
            rhs.swap(pivot, column);
        }
        let (upper, lower) = matrix.split_at_mut((column + 1) * n);
        let pivot_row = &upper[column * n + column..];
        for (below, line) in lower.chunks_exact_mut(n).enumerate() {
            let factor = line[column] / pivot_row[0];
            for (value, above) in line[column..].iter_mut().zip(pivot_row) {
                *value -= factor * above;
            }
            rhs[column + 1 + below] -= factor * rhs[column];
        }
    }
    for line in (0..n).rev() {
        let eliminated = dot(
            &matrix[line * n + line + 1..(line + 1) * n],
            &rhs[line + 1..],
        );
        rhs[line] = (rhs[line] - eliminated) / matrix[line * n + line];
    }
}
