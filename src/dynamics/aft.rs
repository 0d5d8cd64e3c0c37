//! Alternating frequency–time method by samples [A §2b, fig. 2b]: coefficients of displacement to coefficients of force.
//!
//! The Jacobian is the exact derivative of what was sampled: its error does not depend on the number of samples.

use super::march::Slope;
use super::{DynamicsError, Harmonics};
use crate::linalg::{add_product_of_rows, add_scaled};

/// An element of the interface: what force it has at given displacements over a cycle.
///
/// Displacements and forces are `[x, y, n]` at the samples of one cycle; see the [module](super) for signs.
pub trait InterfaceElement: Sync {
    /// Checks parameters; `element` is the index for the error.
    ///
    /// # Errors
    /// [`DynamicsError::Element`].
    fn check(&self, element: usize) -> Result<(), DynamicsError>;

    /// Stiffness per direction \[N/m\] of the state about which it is linearised: stuck if loaded, open if it has a gap.
    fn reference_stiffness(&self) -> [f64; 3];

    /// Whether at every sample the force is exactly reference stiffness times displacement.
    fn follows_reference(&self, displacement: &[[f64; 3]]) -> bool;

    /// Share of it that follows the reference at every sample, where it does not as a whole.
    fn following_share(&self, _displacement: &[[f64; 3]]) -> f64 {
        0.0
    }

    /// Whether its derivative costs so much that it is to do for several states near each other.
    fn is_costly(&self) -> bool {
        false
    }

    /// Adds to the coefficients of the force, and to their Jacobian if there is one, what has a closed form and is
    /// not sampled.
    fn add_exactly(
        &self,
        _harmonics: &Harmonics,
        _displacement: &[f64],
        _force: &mut [f64],
        _jacobian: Option<&mut [f64]>,
    ) {
    }

    /// Forces \[N\] over the steady cycle, in an array of any content, and their derivative if asked for, which is zero before; `scratch` is
    /// there to work in.
    fn sample(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> Closure;
}

/// How well a cycle of friction forces closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closure {
    /// Cycles marched.
    pub cycles: usize,
    /// Change of the force from one cycle to the next, relative to its largest value.
    pub change: f64,
    /// That value \[N\].
    pub largest: f64,
}

impl Closure {
    /// That of a force without memory.
    pub const EXACT: Closure = Closure {
        cycles: 1,
        change: 0.0,
        largest: 0.0,
    };

    /// That of two forces which add up: the largest values do, and so do the changes.
    pub(super) fn and(self, other: Closure) -> Closure {
        if self.largest == 0.0 {
            return other;
        }
        let largest = self.largest + other.largest;
        Closure {
            cycles: self.cycles.max(other.cycles),
            change: (self.change * self.largest + other.change * other.largest) / largest,
            largest,
        }
    }
}

/// Derivatives of the sampled forces with respect to the coefficients of displacement, as what each part of them is: a stiffness throughout
/// the cycle, a stiffness at one sample, or a change that lasts from a sample to the end of the cycle. Forces along the normal have no memory:
/// changes that last are those of tangential forces.
pub struct ForceDerivatives<'a> {
    /// Coefficients per direction.
    pub coefficients: usize,
    /// Basis functions, `samples × coefficients`.
    pub basis: &'a [f64],
    parts: &'a mut Parts,
}

/// The parts of a derivative.
#[derive(Debug, Clone, Default)]
struct Parts {
    /// Stiffness of each direction throughout the cycle.
    stiffness: [f64; 3],
    /// Samples, directions and stiffnesses at one sample alone.
    at: Vec<(usize, usize, f64)>,
    /// Samples from which on there is a change, in the order in which they were asked for.
    from: Vec<usize>,
    /// Of each sample, its place in `from` and one more, or 0.
    place: Vec<usize>,
    /// The changes of the tangential forces, x then y, each by `3 × coefficients`.
    lasting: Vec<f64>,
}

impl ForceDerivatives<'_> {
    /// Adds a stiffness \[N/m\] throughout the cycle.
    pub fn add_stiffness(&mut self, direction: usize, stiffness: f64) {
        self.parts.stiffness[direction] += stiffness;
    }

    /// Adds a stiffness \[N/m\] at sample `j` alone.
    pub fn add_stiffness_at(&mut self, j: usize, direction: usize, stiffness: f64) {
        self.parts.at.push((j, direction, stiffness));
    }

    /// What the derivatives of both tangential forces change by at sample `j` and keep to the end of the cycle: the row of x, then that
    /// of y, `3 × coefficients` each.
    pub fn persistent_derivatives(&mut self, j: usize) -> &mut [f64] {
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

/// Equidistant samples of one cycle, t_j = j T / samples, and the transforms between them and coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    harmonics: Harmonics,
    samples: usize,
    /// `samples × coefficients`.
    basis: Vec<f64>,
    /// Its transpose, `coefficients × samples`.
    waves: Vec<f64>,
    /// Coefficients of a force that is one from a sample to the last, and nothing before, `samples × coefficients`.
    tails: Vec<f64>,
}

/// Arrays that the law of an element works in, of any content between its uses.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// Tangential forces of a slider at the samples.
    pub(super) force: Vec<[f64; 2]>,
    /// What its steps depend on.
    pub(super) slopes: Vec<Slope>,
    /// Derivative of its force with respect to the coefficients, x then y, beyond that of one that sticks.
    pub(super) offset: Vec<f64>,
    /// That after the next step.
    pub(super) next: Vec<f64>,
}

/// Arrays that [`Sampling::evaluate`] works in.
#[derive(Debug, Clone)]
pub struct Workspace {
    displacement: Vec<[f64; 3]>,
    force: Vec<[f64; 3]>,
    parts: Parts,
    /// Weights of the changes that last, `coefficients × changes`.
    weights: Vec<f64>,
    scratch: Scratch,
}

impl Sampling {
    /// `samples` per cycle.
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

    /// Whether an element whose displacement has these three rows of coefficients follows its reference throughout the cycle.
    pub fn follows_reference<E: InterfaceElement>(
        &self,
        element: &E,
        coefficients: &[f64],
    ) -> bool {
        element.follows_reference(&self.synthesise(coefficients))
    }

    /// The harmonics.
    pub fn harmonics(&self) -> &Harmonics {
        &self.harmonics
    }

    /// Samples per cycle.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Inverse transform: samples of the three rows of coefficients of an element.
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

    /// Transform: the three rows of coefficients of samples.
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

    /// Arrays for [`Self::evaluate`].
    pub fn workspace(&self) -> Workspace {
        Workspace {
            displacement: vec![[0.0; 3]; self.samples],
            force: vec![[0.0; 3]; self.samples],
            parts: Parts::default(),
            weights: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Coefficients of the force of `element` and their Jacobian.
    ///
    /// `displacement` and `force` are three rows of coefficients (x, y, n); `jacobian`, if given, is the square matrix
    /// ∂force/∂displacement of `3 × coefficients` rows, row by row.
    pub fn evaluate<E: InterfaceElement>(
        &self,
        element: &E,
        displacement: &[f64],
        force: &mut [f64],
        mut jacobian: Option<&mut [f64]>,
        work: &mut Workspace,
    ) -> Closure {
        let closure = self.sampled(element, displacement, force, jacobian.as_deref_mut(), work);
        element.add_exactly(&self.harmonics, displacement, force, jacobian);
        closure
    }

    /// Coefficients of the part of the force that is sampled, and their Jacobian.
    fn sampled<E: InterfaceElement>(
        &self,
        element: &E,
        displacement: &[f64],
        force: &mut [f64],
        jacobian: Option<&mut [f64]>,
        work: &mut Workspace,
    ) -> Closure {
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

    /// The Jacobian of the coefficients whose derivative has these parts; `weights` are there to work in.
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
                // The rows of one direction lie between those of the other.
                let own = &parts.lasting[d * width..];
                let rows = &mut jacobian[d * n * width..][..n * width];
                add_product_of_rows(rows, weights, own, [n, count], 2 * width);
            }
        }
    }
}

impl Parts {
    /// Those of a derivative that is zero, over so many samples.
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
