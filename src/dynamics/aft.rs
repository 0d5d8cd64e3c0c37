//! Alternating frequency–time method by samples [A §2b, fig. 2b]: coefficients of displacement to coefficients of force.
//!
//! The Jacobian is the exact derivative of what was sampled: its error does not depend on the number of samples.

use super::march::Slope;
use super::{DynamicsError, Harmonics};
use crate::linalg::add_product_of_rows;

/// An element of the interface: what force it has at given displacements over a cycle.
///
/// Displacements and forces are `[x, y, n]` at the samples of one cycle; see the [module](super) for signs.
pub trait InterfaceElement {
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

    /// Coefficients of the force, and their Jacobian if asked for, of three rows of coefficients of displacement, without samples, as
    /// [`Sampling::evaluate`] has them; none where there is no closed form.
    fn by_events(
        &self,
        _harmonics: &Harmonics,
        _displacement: &[f64],
        _force: &mut [f64],
        _jacobian: Option<&mut [f64]>,
    ) -> Option<Closure> {
        None
    }

    /// Adds to the coefficients of the force, and to their Jacobian if there is one, what has a closed form whatever the motion and is
    /// neither sampled nor in [`InterfaceElement::by_events`].
    fn add_exactly(
        &self,
        _harmonics: &Harmonics,
        _displacement: &[f64],
        _force: &mut [f64],
        _jacobian: Option<&mut [f64]>,
    ) {
    }

    /// Whether the force is reference stiffness times displacement at every instant; none where that is not known without samples.
    fn follows_by_events(&self, _harmonics: &Harmonics, _displacement: &[f64]) -> Option<bool> {
        None
    }

    /// Forces \[N\] over the steady cycle, and their derivative if asked for, in arrays of any content; `scratch` is there to work
    /// in.
    fn sample(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        derivative: Option<&mut Derivative<'_>>,
        scratch: &mut Scratch,
    ) -> Closure;
}

/// How well a cycle of friction forces closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closure {
    /// Cycles marched.
    pub cycles: usize,
    /// Samples of each; 0 of a force that is not sampled.
    pub samples: usize,
    /// Change of the force from one cycle to the next, relative to its largest value.
    pub change: f64,
    /// That value \[N\].
    pub largest: f64,
}

impl Closure {
    /// That of a force without memory.
    pub const EXACT: Closure = Closure {
        cycles: 1,
        samples: 0,
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
            samples: self.samples.max(other.samples),
            change: (self.change * self.largest + other.change * other.largest) / largest,
            largest,
        }
    }
}

/// Derivatives of the sampled forces with respect to the coefficients of displacement.
pub struct Derivative<'a> {
    /// Coefficients per direction.
    pub coefficients: usize,
    /// Basis functions, `samples × coefficients`.
    pub basis: &'a [f64],
    /// ∂ force\[d\] at sample j / ∂ coefficient c of direction e, at `((j * 3 + d) * 3 + e) * coefficients + c`.
    pub values: &'a mut [f64],
}

impl Derivative<'_> {
    /// The basis functions at sample `j`.
    pub fn basis_at(&self, j: usize) -> &[f64] {
        &self.basis[j * self.coefficients..][..self.coefficients]
    }

    /// The derivatives of force `d` at sample `j`, `3 × coefficients`.
    pub fn row_mut(&mut self, j: usize, d: usize) -> &mut [f64] {
        &mut self.values[(j * 3 + d) * 3 * self.coefficients..][..3 * self.coefficients]
    }

    /// The derivatives of both tangential forces at sample `j`, one row after the other.
    pub(super) fn tangential_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * 9 * self.coefficients..][..6 * self.coefficients]
    }
}

/// Equidistant samples of one cycle, t_j = j T / samples, and the transforms between them and coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    harmonics: Harmonics,
    samples: usize,
    /// `samples × coefficients`.
    basis: Vec<f64>,
    /// The inverse of `basis` in the sense of least squares, `coefficients × samples`.
    analysis: Vec<f64>,
    /// Whether samples are taken only where there is no closed form.
    by_events: bool,
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
    derivative: Vec<f64>,
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
        let mut analysis = vec![0.0; n * samples];
        for j in 0..samples {
            for c in 0..n {
                let weight = if c == 0 { 1.0 } else { 2.0 };
                analysis[c * samples + j] = weight / samples as f64 * basis[j * n + c];
            }
        }
        Ok(Sampling {
            harmonics,
            samples,
            basis,
            analysis,
            by_events: false,
        })
    }

    /// Samples only where the law of an element has no closed form: elsewhere the instants at which its state changes are found.
    pub fn with_events(mut self) -> Sampling {
        self.by_events = true;
        self
    }

    /// Whether an element whose displacement has these three rows of coefficients follows its reference throughout the cycle.
    pub fn follows_reference<E: InterfaceElement>(
        &self,
        element: &E,
        coefficients: &[f64],
    ) -> bool {
        let exactly = match self.by_events {
            true => element.follows_by_events(&self.harmonics, coefficients),
            false => None,
        };
        exactly.unwrap_or_else(|| element.follows_reference(&self.synthesise(coefficients)))
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
        for (out, basis) in out.iter_mut().zip(self.basis.chunks_exact(n)) {
            for d in 0..3 {
                let row = &coefficients[d * n..][..n];
                out[d] = row.iter().zip(basis).map(|(a, b)| a * b).sum();
            }
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
        for d in 0..3 {
            for c in 0..n {
                let weights = &self.analysis[c * self.samples..][..self.samples];
                out[d * n + c] = weights.iter().zip(samples).map(|(w, s)| w * s[d]).sum();
            }
        }
    }

    /// Arrays for [`Self::evaluate`].
    pub fn workspace(&self) -> Workspace {
        Workspace {
            displacement: vec![[0.0; 3]; self.samples],
            force: vec![[0.0; 3]; self.samples],
            derivative: Vec::new(),
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

    /// Coefficients of the part of the force that is sampled, or integrated by events in its place, and their Jacobian.
    fn sampled<E: InterfaceElement>(
        &self,
        element: &E,
        displacement: &[f64],
        force: &mut [f64],
        mut jacobian: Option<&mut [f64]>,
        work: &mut Workspace,
    ) -> Closure {
        let n = self.harmonics.coefficients();
        if self.by_events {
            let jacobian = jacobian.as_deref_mut();
            let exact = element.by_events(&self.harmonics, displacement, force, jacobian);
            if let Some(closure) = exact {
                return closure;
            }
        }
        self.synthesise_into(displacement, &mut work.displacement);
        let Some(jacobian) = jacobian else {
            let closure =
                element.sample(&work.displacement, &mut work.force, None, &mut work.scratch);
            self.analyse_into(&work.force, force);
            return closure;
        };
        // Made where it is wanted: a force without derivatives, or without samples, needs none of it.
        work.derivative.resize(self.samples * 9 * n, 0.0);
        let mut derivative = Derivative {
            coefficients: n,
            basis: &self.basis,
            values: &mut work.derivative,
        };
        let closure = element.sample(
            &work.displacement,
            &mut work.force,
            Some(&mut derivative),
            &mut work.scratch,
        );
        self.analyse_into(&work.force, force);
        jacobian.fill(0.0);
        let width = 3 * n;
        for d in 0..3 {
            // The derivatives of one direction lie between those of the others.
            let own = &work.derivative[d * width..];
            let rows = &mut jacobian[d * n * width..][..n * width];
            let size = [n, self.samples];
            add_product_of_rows(rows, &self.analysis, own, size, 3 * width);
        }
        closure
    }
}
