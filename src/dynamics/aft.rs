//! Alternating frequency–time method with samples [A §2b, fig. 2b]: from coefficients of displacement to coefficients
//! of force.
//!
//! The Jacobian is the exact derivative of the sampled forces, so its error does not depend on the number of samples.

use super::march::Slope;
use super::{DynamicsError, Harmonics};
use crate::linalg::{add_product_of_rows, add_scaled};

/// Element of the interface. An element computes its forces over a cycle from its displacements over the cycle.
///
/// Displacements and forces are `[x, y, n]` at the samples of one cycle. The [module](super) defines the signs.
pub trait InterfaceElement: Sync {
    /// Checks the parameters. `element` is the index for the error.
    fn check(&self, element: usize) -> Result<(), DynamicsError>;

    /// Returns the stiffness per direction \[N/m\] of the reference state. The solver linearises the element about the
    /// reference state. The reference state of a loaded element is stuck; the reference state of an element with a gap
    /// is open.
    fn reference_stiffness(&self) -> [f64; 3];

    /// Returns true if the force is exactly the reference stiffness times the displacement at every sample.
    fn follows_reference(&self, displacement: &[[f64; 3]]) -> bool;

    /// Returns the share of the element that follows the reference at every sample, for an element that does not follow
    /// the reference as a whole.
    fn reference_share(&self, _displacement: &[[f64; 3]]) -> f64 {
        0.0
    }

    /// Returns true if the derivative is so expensive that several nearby states should share one derivative.
    fn is_costly(&self) -> bool {
        false
    }

    /// Adds the part of the force that has a closed form and is not sampled. The function adds to the coefficients of
    /// the force, and to the Jacobian of the coefficients if given.
    fn add_exactly(
        &self,
        _harmonics: &Harmonics,
        _displacement: &[f64],
        _force: &mut [f64],
        _jacobian: Option<&mut [f64]>,
    ) {
    }

    /// Computes the forces \[N\] over the steady cycle, and the derivative of the forces if `derivative` is given.
    ///
    /// The array of forces may have any content before; the derivative must be zero before. `scratch` is working
    /// memory.
    fn sample(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> PeriodicityError;
}

/// Periodicity error of a cycle of friction forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicityError {
    /// Number of simulated cycles.
    pub cycles: usize,
    /// Change of the force from one cycle to the next, relative to the largest force.
    pub change: f64,
    /// Largest value of the force \[N\].
    pub largest: f64,
}

impl PeriodicityError {
    /// Closure of a force without memory.
    pub const EXACT: PeriodicityError = PeriodicityError {
        cycles: 1,
        change: 0.0,
        largest: 0.0,
    };

    /// Returns the closure of the sum of two forces: the largest values add up, and so do the changes.
    pub(super) fn and(self, other: PeriodicityError) -> PeriodicityError {
        if self.largest == 0.0 {
            return other;
        }
        let largest = self.largest + other.largest;
        PeriodicityError {
            cycles: self.cycles.max(other.cycles),
            change: (self.change * self.largest + other.change * other.largest) / largest,
            largest,
        }
    }
}

/// Derivatives of the sampled forces with respect to the coefficients of displacement, stored by kind.
///
/// A contribution is a stiffness throughout the cycle, a stiffness at one sample, or a persistent change. A persistent
/// change begins at a sample and lasts until the end of the cycle. Normal forces have no memory, so only tangential
/// forces have persistent changes.
pub struct ForceDerivatives<'a> {
    /// Coefficients per direction.
    pub coefficients: usize,
    /// Basis functions, `samples × coefficients`.
    pub basis: &'a [f64],
    parts: &'a mut Parts,
}

/// Contributions to a derivative, by kind.
#[derive(Debug, Clone, Default)]
struct Parts {
    /// Stiffness of each direction throughout the cycle.
    stiffness: [f64; 3],
    /// Sample, direction and stiffness of each contribution at one sample.
    at: Vec<(usize, usize, f64)>,
    /// Samples at which a persistent change begins, in the order in which the element requests the samples.
    from: Vec<usize>,
    /// Index of each sample in `from` plus one, or 0 if no persistent change begins at the sample.
    place: Vec<usize>,
    /// The persistent changes of the tangential forces, x then y, `3 × coefficients` each.
    lasting: Vec<f64>,
}

impl ForceDerivatives<'_> {
    /// Adds a stiffness \[N/m\] throughout the cycle.
    pub fn add_stiffness(&mut self, direction: usize, stiffness: f64) {
        self.parts.stiffness[direction] += stiffness;
    }

    /// Adds a stiffness \[N/m\] at sample `j` only.
    pub fn add_stiffness_at(&mut self, j: usize, direction: usize, stiffness: f64) {
        self.parts.at.push((j, direction, stiffness));
    }

    /// Returns the persistent changes of the derivatives of the tangential forces from sample `j`. The row of x comes
    /// first, then the row of y. Each row has `3 × coefficients` values.
    pub fn lasting_change(&mut self, j: usize) -> &mut [f64] {
        let width = 6 * self.coefficients;
        let Parts {
            from,
            place,
            lasting,
            ..
        } = &mut *self.parts;
        if place[j] == 0 {
            from.push(j);
            place[j] = from.len();
            lasting.resize(from.len() * width, 0.0);
        }
        &mut lasting[(place[j] - 1) * width..][..width]
    }
}

/// Equidistant samples of one cycle, t_j = j T / samples, and the transforms between samples and coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    harmonics: Harmonics,
    samples: usize,
    /// `samples × coefficients`.
    basis: Vec<f64>,
    /// Transpose of `basis`, `coefficients × samples`.
    waves: Vec<f64>,
    /// Coefficients of step forces, `samples × coefficients`. Step force j is 0 before sample j, and 1 from sample j to
    /// the last sample.
    tails: Vec<f64>,
}

/// Working arrays of the law of an element, of any content between calls.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// Tangential forces of a slider at the samples.
    pub(super) force: Vec<[f64; 2]>,
    /// Derivatives of the steps of the slider.
    pub(super) slopes: Vec<Slope>,
    /// Derivative of the slider's force minus the derivative of a sticking slider's force. Both derivatives are with
    /// respect to the coefficients, x then y.
    pub(super) offset: Vec<f64>,
    /// `offset` after the next step.
    pub(super) next: Vec<f64>,
}

/// Working arrays of [`Sampling::evaluate`].
#[derive(Debug, Clone)]
pub struct Workspace {
    displacement: Vec<[f64; 3]>,
    force: Vec<[f64; 3]>,
    parts: Parts,
    /// Weights of the persistent changes, `coefficients × changes`.
    weights: Vec<f64>,
    scratch: Scratch,
}

impl Sampling {
    /// Creates a sampling of `samples` per cycle.
    ///
    /// # Errors
    /// [`DynamicsError::Samples`] unless there are more than twice the highest harmonic.
    pub fn new(harmonics: Harmonics, samples: usize) -> Result<Sampling, DynamicsError> {
        let least = 2 * harmonics.highest() as usize;
        if samples <= least {
            return Err(DynamicsError::Samples {
                samples,
                highest: harmonics.highest(),
                least,
            });
        }
        let n = harmonics.coefficients();
        let mut basis = Vec::with_capacity(samples * n);
        for j in 0..samples {
            let theta = 2.0 * std::f64::consts::PI * j as f64 / samples as f64;
            basis.extend(harmonics.basis(theta));
        }
        let mut waves = vec![0.0; n * samples];
        let mut tails = vec![0.0; samples * n];
        let mut tail = vec![0.0; n];
        for j in (0..samples).rev() {
            for c in 0..n {
                waves[c * samples + j] = basis[j * n + c];
                tail[c] += Harmonics::weight(c) / samples as f64 * basis[j * n + c];
            }
            tails[j * n..][..n].copy_from_slice(&tail);
        }
        Ok(Sampling {
            harmonics,
            samples,
            basis,
            waves,
            tails,
        })
    }

    /// Returns true if an element follows its reference throughout the cycle of a displacement. Three rows of
    /// coefficients give the displacement of the element.
    pub fn follows_reference<E: InterfaceElement>(
        &self,
        element: &E,
        coefficients: &[f64],
    ) -> bool {
        element.follows_reference(&self.synthesise(coefficients))
    }

    /// Returns the harmonics.
    pub fn harmonics(&self) -> &Harmonics {
        &self.harmonics
    }

    /// Returns the number of samples per cycle.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Inverse transform: computes samples from the three rows of coefficients of an element.
    pub fn synthesise(&self, coefficients: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.samples];
        self.synthesise_into(coefficients, &mut out);
        out
    }

    fn synthesise_into(&self, coefficients: &[f64], out: &mut [[f64; 3]]) {
        let n = self.harmonics.coefficients();
        let mut rows = vec![0.0; 3 * self.samples];
        add_product_of_rows(&mut rows, coefficients, &self.waves, [3, n], self.samples);
        for (j, out) in out.iter_mut().enumerate() {
            *out = [0, 1, 2].map(|d| rows[d * self.samples + j]);
        }
    }

    /// Transform: computes the three rows of coefficients of samples.
    pub fn analyse(&self, samples: &[[f64; 3]]) -> Vec<f64> {
        let n = self.harmonics.coefficients();
        let mut out = vec![0.0; 3 * n];
        self.analyse_into(samples, &mut out);
        out
    }

    fn analyse_into(&self, samples: &[[f64; 3]], out: &mut [f64]) {
        let n = self.harmonics.coefficients();
        let along = |d: usize| samples.iter().map(move |sample| sample[d]);
        let rows: Vec<f64> = (0..3).flat_map(along).collect();
        out.fill(0.0);
        add_product_of_rows(out, &rows, &self.basis, [3, self.samples], n);
        for (i, out) in out.iter_mut().enumerate() {
            *out *= Harmonics::weight(i % n) / self.samples as f64;
        }
    }

    /// Creates the working arrays for [`Self::evaluate`].
    pub fn workspace(&self) -> Workspace {
        Workspace {
            displacement: vec![[0.0; 3]; self.samples],
            force: vec![[0.0; 3]; self.samples],
            parts: Parts::default(),
            weights: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Computes the coefficients of the force of `element` and their Jacobian.
    ///
    /// `displacement` and `force` are three rows of coefficients (x, y, n). `jacobian` is optional: the square matrix
    /// ∂force/∂displacement with `3 × coefficients` rows, stored row by row.
    pub fn evaluate<E: InterfaceElement>(
        &self,
        element: &E,
        displacement: &[f64],
        force: &mut [f64],
        mut jacobian: Option<&mut [f64]>,
        work: &mut Workspace,
    ) -> PeriodicityError {
        let closure = self.sampled(element, displacement, force, jacobian.as_deref_mut(), work);
        element.add_exactly(&self.harmonics, displacement, force, jacobian);
        closure
    }

    /// Computes the coefficients of the sampled part of the force, and their Jacobian.
    fn sampled<E: InterfaceElement>(
        &self,
        element: &E,
        displacement: &[f64],
        force: &mut [f64],
        jacobian: Option<&mut [f64]>,
        work: &mut Workspace,
    ) -> PeriodicityError {
        let n = self.harmonics.coefficients();
        self.synthesise_into(displacement, &mut work.displacement);
        let Some(jacobian) = jacobian else {
            let closure =
                element.sample(&work.displacement, &mut work.force, None, &mut work.scratch);
            self.analyse_into(&work.force, force);
            return closure;
        };
        let mut derivative = ForceDerivatives {
            coefficients: n,
            basis: &self.basis,
            parts: work.parts.cleared(self.samples),
        };
        let closure = element.sample(
            &work.displacement,
            &mut work.force,
            Some(&mut derivative),
            &mut work.scratch,
        );
        self.analyse_into(&work.force, force);
        self.analyse_parts(&work.parts, &mut work.weights, jacobian);
        closure
    }

    /// Computes the Jacobian of the coefficients from the contributions to the derivative. `weights` is working memory.
    fn analyse_parts(&self, parts: &Parts, weights: &mut Vec<f64>, jacobian: &mut [f64]) {
        let n = self.harmonics.coefficients();
        let width = 3 * n;
        jacobian.fill(0.0);
        for (i, row) in jacobian.chunks_exact_mut(width).enumerate() {
            row[i] = parts.stiffness[i / n];
        }
        for &(j, d, stiffness) in &parts.at {
            let basis = &self.basis[j * n..][..n];
            let rows = &mut jacobian[d * n * width..][..n * width];
            for (c, row) in rows.chunks_exact_mut(width).enumerate() {
                let factor = stiffness * Harmonics::weight(c) / self.samples as f64 * basis[c];
                add_scaled(&mut row[d * n..][..n], factor, basis);
            }
        }
        let count = parts.from.len();
        weights.clear();
        weights.resize(n * count, 0.0);
        for (k, j) in parts.from.iter().enumerate() {
            for (c, tail) in self.tails[j * n..][..n].iter().enumerate() {
                weights[c * count + k] = *tail;
            }
        }
        if count > 0 {
            for d in 0..2 {
                // The rows of x and y alternate.
                let changes = &parts.lasting[d * width..];
                let rows = &mut jacobian[d * n * width..][..n * width];
                add_product_of_rows(rows, weights, changes, [n, count], 2 * width);
            }
        }
    }
}

impl Parts {
    /// Resets the parts to a zero derivative of a cycle with `samples` samples.
    fn cleared(&mut self, samples: usize) -> &mut Parts {
        self.stiffness = [0.0; 3];
        self.at.clear();
        self.from.clear();
        self.lasting.clear();
        self.place.clear();
        self.place.resize(samples, 0);
        self
    }
}
