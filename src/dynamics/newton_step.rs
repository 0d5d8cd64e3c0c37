//! One Newton step of the harmonic balance: residual, Jacobian, and what solves with it.

use std::cell::RefCell;

use num_complex::Complex64;

use super::aft::{Closure, InterfaceElement, Workspace};
use super::closed_model::{Among, Precision};
use super::krylov::{self, Learned};
use super::preconditioner::{ElementPart, Preconditioner};
use super::{DynamicsError, HarmonicBalance};
use crate::linalg::{Blocks, Factors, RowMatrix as Matrix, add_scaled};

/// Relative tolerance of a Newton step solved by GMRES. Steps of a nearly linear problem then gain four digits each.
pub(super) const STEP_TOLERANCE: f64 = 1e-4;
/// Least share of the tangential stiffness that is left, in the Jacobian alone, to a mean displacement of full slip. Full slip
/// forgets its mean, and a motion that friction alone holds would otherwise run away; what something else holds converges hardly
/// slower.
pub(super) const LEAST_GRIP: f64 = 1e-6;
/// Unknowns up to which a step that Krylov iterations do not find is found by elimination: half a gigabyte.
const MOST_DENSE: usize = 6000;
/// Elements that a thread evaluates at once.
const AT_ONCE: usize = 8;
/// Share of the largest square that regularises a step whose matrix is singular.
const REGULARISATION: f64 = 1e-13;

/// Unknowns: contact displacements (all of them; those of passive elements follow) and frequency.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) omega: f64,
    pub(super) contact: Vec<f64>,
    pub(super) active: Vec<bool>,
}

/// What fixes the frequency.
#[derive(Debug, Clone)]
pub(super) enum Condition {
    /// It is given.
    Frequency,
    /// The sum of the terms and `by_omega` ω is `value`.
    Linear {
        terms: Vec<Term>,
        by_omega: f64,
        value: f64,
    },
}

/// `weights · (cosine, sine)` of the harmonic of a slot at a port.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub(super) port: usize,
    pub(super) slot: usize,
    pub(super) weights: [f64; 2],
}

impl Term {
    fn of(&self, row: &[f64]) -> f64 {
        self.weights[0] * row[self.slot] + self.weights[1] * row[self.slot + 1]
    }
}

impl Condition {
    /// That a term is zero.
    pub(super) fn zero(term: Term) -> Condition {
        Condition::Linear {
            terms: vec![term],
            by_omega: 0.0,
            value: 0.0,
        }
    }

    pub(super) fn terms(&self) -> &[Term] {
        match self {
            Condition::Frequency => &[],
            Condition::Linear { terms, .. } => terms,
        }
    }

    /// The sum of the terms, of rows of `n` coefficients of all ports.
    pub(super) fn of_ports(&self, rows: &[f64], n: usize) -> f64 {
        let terms = self.terms().iter();
        terms.map(|term| term.of(&rows[term.port * n..])).sum()
    }
}

/// Everything that Newton's method wants to know about a state.
pub(super) struct Evaluation {
    pub(super) cores: Vec<Matrix<Complex64>>,
    pub(super) elements: Vec<usize>,
    /// Contact degrees of freedom of the active elements, then ports with loads.
    pub(super) ports: Vec<usize>,
    /// Forces on them: what is beyond the reference with the sign of a load, then loads.
    pub(super) forces: Vec<f64>,
    /// Share of the loads.
    pub(super) factor: f64,
    /// Jacobians of what is beyond the reference, one per active element; none if not asked for.
    pub(super) beyond: Vec<Matrix>,
    /// Contact forces of the active elements, and how well their cycles close.
    pub(super) contact: Vec<(Vec<f64>, Closure)>,
    pub(super) displacement: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) condition: f64,
}

/// What an element adds to an evaluation.
struct OfElement {
    /// Beyond the reference with the sign of a load.
    force: Vec<f64>,
    beyond: Option<Matrix>,
    contact: (Vec<f64>, Closure),
}

impl Evaluation {
    /// Whether it was asked for with Jacobians.
    pub(super) fn has_jacobians(&self) -> bool {
        self.beyond.len() == self.elements.len()
    }
}

/// What depends on the active elements alone.
pub(super) struct Frame {
    elements: Vec<usize>,
    /// Among their degrees of freedom.
    among: Among,
    /// The element part of the preconditioner, if there is one by now.
    part: Option<ElementPart>,
    /// What solving with it has learned.
    learned: RefCell<Learned>,
}

impl Frame {
    /// The element part of the preconditioner is to be made anew.
    pub(super) fn forget(&mut self) {
        self.part = None;
        *self.learned.borrow_mut() = Learned::default();
    }

    /// Solves `operator(x) = right` with what was learned before, and learns from it; x and the Krylov iterations. All systems of a frame
    /// have as many unknowns.
    ///
    /// It is preconditioned from the left, so that what is left is small as a correction, which is what Newton's method measures: a mean
    /// displacement that little holds is much of that for next to no residual.
    pub(super) fn solve(
        &self,
        operator: impl Fn(&[f64]) -> Vec<f64>,
        precondition: impl Fn(&[f64]) -> Vec<f64>,
        right: &[f64],
        tolerance: f64,
    ) -> Result<(Vec<f64>, usize), DynamicsError> {
        let mut memory = self.learned.borrow_mut();
        let solved = krylov::solve(
            |v| precondition(&operator(v)),
            |v| memory.apply(v),
            &precondition(right),
            tolerance,
        )?;
        memory.add(solved.learned);
        Ok((solved.x, solved.iterations))
    }
}

pub(super) enum Solver<'a> {
    Dense(Factors),
    Regularised {
        matrix: Matrix,
        normal: Factors,
    },
    Krylov {
        /// G.
        beyond: Blocks,
        preconditioner: Preconditioner<'a>,
    },
}

/// A change of the active unknowns and of the frequency.
pub(super) struct Change {
    pub(super) unknowns: Vec<f64>,
    pub(super) omega: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Receptances of the coordinates at every harmonic of the angular frequency `omega`.
    pub(super) fn cores(&self, omega: f64) -> Result<Vec<Matrix<Complex64>>, DynamicsError> {
        let orders = self.harmonics().orders();
        let receptance = |order: &u32| self.model.core.receptance(f64::from(*order) * omega);
        self.threads.map(orders, receptance).into_iter().collect()
    }

    /// Unknowns per element.
    pub(super) fn width(&self) -> usize {
        3 * self.harmonics().coefficients()
    }

    /// Residual of a state; with a `grip` (see [`LEAST_GRIP`]) Jacobians of the elements too.
    pub(super) fn evaluate(
        &self,
        state: &State,
        factor: f64,
        condition: &Condition,
        grip: Option<f64>,
    ) -> Result<Evaluation, DynamicsError> {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let width = self.width();
        let cores = self.cores(state.omega)?;
        let elements: Vec<usize> = (0..self.elements.len())
            .filter(|e| state.active[*e])
            .collect();
        self.effort.add(1);
        let mut ports: Vec<usize> = elements.iter().flat_map(|e| 3 * e..3 * e + 3).collect();
        let mut forces = Vec::with_capacity(elements.len() * width);
        let mut beyond = Vec::new();
        let mut contact = Vec::with_capacity(elements.len());
        let parts = self.threads.map(elements.chunks(AT_ONCE), |part| {
            let mut work = self.sampling.workspace();
            let own = |element: &usize| self.evaluate_element(*element, state, grip, &mut work);
            part.iter().map(own).collect::<Vec<_>>()
        });
        for own in parts.into_iter().flatten() {
            forces.extend(own.force);
            beyond.extend(own.beyond);
            contact.push(own.contact);
        }
        ports.extend(&self.load_ports);
        forces.extend(self.loads_at(state.omega, factor));
        let displacement = self.model.respond(harmonics, &cores, &ports, &forces, true);
        let mut residual = Vec::with_capacity(elements.len() * width);
        for &element in &elements {
            let range = element * width..(element + 1) * width;
            let pairs = state.contact[range.clone()]
                .iter()
                .zip(&displacement[range]);
            residual.extend(pairs.map(|(u, linear)| u - linear));
        }
        let condition = match condition {
            Condition::Frequency => 0.0,
            Condition::Linear {
                by_omega, value, ..
            } => condition.of_ports(&displacement, n) + by_omega * state.omega - value,
        };
        Ok(Evaluation {
            cores,
            elements,
            ports,
            forces,
            factor,
            beyond,
            contact,
            displacement,
            residual,
            condition,
        })
    }

    /// One element of [`Self::evaluate`].
    fn evaluate_element(
        &self,
        element: usize,
        state: &State,
        grip: Option<f64>,
        work: &mut Workspace,
    ) -> OfElement {
        let n = self.harmonics().coefficients();
        let width = self.width();
        let u = &state.contact[element * width..][..width];
        let law = &self.elements[element];
        let mut g = vec![0.0; width];
        let mut jacobian = grip.map(|_| Matrix::zeros(width, width));
        let values = jacobian.as_mut().map(Matrix::values_mut);
        let closure = self.sampling.evaluate(law, u, &mut g, values, work);
        let contact = (g.clone(), closure);
        for d in 0..3 {
            let stiffness = self.reference[element][d];
            for i in d * n..(d + 1) * n {
                g[i] = stiffness * u[i] - g[i];
                if let Some(jacobian) = &mut jacobian {
                    jacobian.row_mut(i)[i] -= stiffness;
                }
            }
            if let (Some(jacobian), Some(grip)) = (&mut jacobian, grip)
                && d < 2
            {
                jacobian.row_mut(d * n)[d * n] += grip * stiffness;
            }
        }
        OfElement {
            force: g,
            beyond: jacobian,
            contact,
        }
    }

    /// The frame of the active elements of `at`: the one at hand if it is theirs.
    pub(super) fn frame(
        &self,
        at: &Evaluation,
        old: Option<Frame>,
    ) -> Result<Frame, DynamicsError> {
        let mut frame = match old {
            Some(frame) if frame.elements == at.elements => frame,
            _ => {
                let elements = at.elements.iter();
                let ports: Vec<usize> = elements.flat_map(|e| 3 * e..3 * e + 3).collect();
                let precision = match self.wants_krylov(at.residual.len()) {
                    true => Precision::Single,
                    false => Precision::Double,
                };
                Frame {
                    elements: at.elements.clone(),
                    among: self.model.among(&ports, precision),
                    part: None,
                    learned: RefCell::default(),
                }
            }
        };
        if let (true, None, Some(basis)) = (
            self.wants_krylov(at.residual.len()),
            &frame.part,
            &self.model.basis,
        ) {
            let harmonics = self.harmonics();
            let (model, elements) = (&self.model, &at.elements);
            let part =
                ElementPart::new(&self.threads, model, basis, harmonics, elements, &at.beyond)?;
            frame.part = Some(part);
        }
        Ok(frame)
    }

    fn wants_krylov(&self, unknowns: usize) -> bool {
        let modal = self.model.leading * self.harmonics().coefficients();
        // The modal part is eliminated: it must be the smaller part.
        self.model.basis.is_some()
            && unknowns > self.settings.dense_unknowns
            && 2 * modal < unknowns
    }

    pub(super) fn solver<'a>(
        &'a self,
        at: &'a Evaluation,
        frame: &'a Frame,
    ) -> Result<Solver<'a>, DynamicsError> {
        if let (true, Some(part)) = (self.wants_krylov(at.residual.len()), &frame.part) {
            let harmonics = self.harmonics();
            return Ok(Solver::Krylov {
                beyond: Blocks::new(self.width(), at.beyond.iter()),
                preconditioner: Preconditioner::new(&self.threads, part, harmonics, &at.cores)?,
            });
        }
        self.dense(at, frame)
    }

    fn dense(&self, at: &Evaluation, frame: &Frame) -> Result<Solver<'static>, DynamicsError> {
        let matrix = self.jacobian(at, frame);
        let of_matrix = DynamicsError::of_matrix("Jacobian of the harmonic balance");
        match matrix.clone().factorize().map_err(of_matrix) {
            Ok(factors) => Ok(Solver::Dense(factors)),
            // A mean position that friction leaves free (full sliding without a spring) has no equation: least squares with the
            // smallest step.
            Err(error) if error.is_singular() => {
                let mut normal = Matrix::zeros(matrix.columns(), matrix.columns());
                normal.add_transposed_product(&matrix, &matrix);
                let largest = (0..normal.rows()).fold(0.0_f64, |m, i| m.max(normal.at(i, i)));
                for i in 0..normal.rows() {
                    normal.set(i, i, normal.at(i, i) + REGULARISATION * largest);
                }
                let of_matrix =
                    DynamicsError::of_matrix("regularised Jacobian of the harmonic balance");
                let normal = normal.factorize().map_err(of_matrix)?;
                Ok(Solver::Regularised { matrix, normal })
            }
            Err(error) => Err(error),
        }
    }

    /// 1 + H G on the active unknowns.
    fn jacobian(&self, at: &Evaluation, frame: &Frame) -> Matrix {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let width = self.width();
        let size = at.residual.len();
        let mut matrix = Matrix::identity(size);
        let dofs = size / n;
        for (index, core) in at.cores.iter().enumerate() {
            let block = frame.among.receptance(core);
            let slot = harmonics.slot(index);
            for i in 0..dofs {
                for j in 0..dofs {
                    let value = block.at(i, j);
                    let (element, d) = (j / 3, j % 3);
                    let columns = element * width..(element + 1) * width;
                    let source = |c: usize| at.beyond[element].row(d * n + c);
                    let target = &mut matrix.row_mut(i * n + slot)[columns.clone()];
                    add_scaled(target, value.re, source(slot));
                    if index > 0 {
                        add_scaled(target, value.im, source(slot + 1));
                        let target = &mut matrix.row_mut(i * n + slot + 1)[columns];
                        add_scaled(target, -value.im, source(slot));
                        add_scaled(target, value.re, source(slot + 1));
                    }
                }
            }
        }
        matrix
    }

    /// (1 + H G) v of v and `forces` G v.
    pub(super) fn operate(
        &self,
        at: &Evaluation,
        frame: &Frame,
        forces: &[f64],
        v: &[f64],
    ) -> Vec<f64> {
        let mut out = frame.among.respond(self.harmonics(), &at.cores, forces);
        add_scaled(&mut out, 1.0, v);
        out
    }

    /// −J⁻¹ `residual`, to a tolerance relative to it where that takes Krylov iterations, and how many.
    pub(super) fn step(
        &self,
        solver: &Solver<'_>,
        at: &Evaluation,
        frame: &Frame,
        residual: &[f64],
        tolerance: f64,
    ) -> Result<(Vec<f64>, usize), DynamicsError> {
        let Solver::Krylov {
            beyond,
            preconditioner,
        } = solver
        else {
            return Ok((solver.approximate(residual), 0));
        };
        let right: Vec<f64> = residual.iter().map(|r| -r).collect();
        let operator = |v: &[f64]| self.operate(at, frame, &beyond.apply(v), v);
        let precondition = |v: &[f64]| preconditioner.apply(v);
        let solved = match self.is_costly {
            true => frame.solve(operator, precondition, &right, tolerance),
            false => krylov::solve(operator, precondition, &right, tolerance)
                .map(|solved| (solved.x, solved.iterations)),
        };
        match solved {
            Err(error @ DynamicsError::Krylov { .. }) => {
                let solver = self.dense_instead(at, frame, error)?;
                // As many iterations as failed, so that the preconditioner is made anew.
                Ok((solver.approximate(residual), krylov::MOST_ITERATIONS))
            }
            solved => solved,
        }
    }

    /// A solver by elimination where Krylov iterations end in `error`, if its matrix fits into memory.
    ///
    /// # Errors
    /// `error` if it does not.
    pub(super) fn dense_instead(
        &self,
        at: &Evaluation,
        frame: &Frame,
        error: DynamicsError,
    ) -> Result<Solver<'static>, DynamicsError> {
        match at.residual.len() <= MOST_DENSE {
            true => self.dense(at, frame),
            false => Err(error),
        }
    }
}

impl Solver<'_> {
    /// −J⁻¹ `residual` with what is at hand, without iterating.
    pub(super) fn approximate(&self, residual: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = residual.iter().map(|r| -r).collect();
        match self {
            Solver::Dense(factors) => factors.solve(&mut out),
            Solver::Regularised { matrix, normal } => {
                out = matrix.transposed().apply(&out);
                normal.solve(&mut out);
            }
            Solver::Krylov { preconditioner, .. } => out = preconditioner.apply(&out),
        }
        out
    }
}
