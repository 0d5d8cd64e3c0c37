//! Operators of the half spaces, restricted to the cells in contact.

use super::vector::Vector;
use super::{compliance, stiffness};
use crate::contact::half_space::HalfSpace;
use crate::grid::ByAxis;

/// Compliance and preconditioner for values on contact cells.
pub(super) struct Operator<'h, const A: usize> {
    half_space: &'h mut HalfSpace,
    /// Positions of the contact cells in the grid.
    cells: Vec<usize>,
    /// Input field; zero off the contact between two calls.
    input: ByAxis<Vec<f64>>,
    output: ByAxis<Vec<f64>>,
    /// Displacement on all cells: the last result of [`Operator::displacement`], plus what [`Operator::add`] added
    /// since.
    field: ByAxis<Vec<f64>>,
}

impl<'h, const A: usize> Operator<'h, A> {
    pub(super) fn new(half_space: &'h mut HalfSpace, cells: Vec<usize>) -> Self {
        let zeros = || vec![vec![0.0; half_space.grid().len()]; A];
        Operator {
            input: zeros(),
            output: zeros(),
            field: zeros(),
            half_space,
            cells,
        }
    }

    pub(super) fn half_space(&self) -> &HalfSpace {
        self.half_space
    }

    pub(super) fn cells(&self) -> &[usize] {
        &self.cells
    }

    /// Returns the compliance of a cell alone \[m/Pa\].
    pub(super) fn self_compliance(&self) -> f64 {
        self.half_space.self_shear_compliance()
    }

    fn scatter(&mut self, source: &[Vector<A>]) {
        for axis in 0..A {
            let input = &mut self.input[axis];
            for (value, &c) in source.iter().zip(&self.cells) {
                input[c] = value[axis];
            }
        }
    }

    fn gather(&self, target: &mut [Vector<A>]) {
        gather(&self.output, &self.cells, target);
    }

    /// Computes `target` = K `source`.
    pub(super) fn compliance(&mut self, source: &[Vector<A>], target: &mut [Vector<A>]) {
        self.scatter(source);
        compliance(self.half_space, &self.input, &mut self.output);
        self.gather(target);
    }

    /// Computes `values` = M `values`, with M the approximate inverse of K.
    pub(super) fn stiffness(&mut self, values: &mut [Vector<A>]) {
        self.scatter(values);
        stiffness(self.half_space, &self.input, &mut self.output);
        self.gather(values);
    }

    /// Adds `part` times the last result of [`Operator::compliance`] to the displacement of all cells, including cells
    /// outside the contact.
    pub(super) fn add(&mut self, part: f64) {
        for (field, output) in self.field.iter_mut().zip(&self.output) {
            for (u, increment) in field.iter_mut().zip(output) {
                *u += part * increment;
            }
        }
    }

    /// Computes `target` = K (`shear` − `previous`). The previous shear may lie on any cell. [`Operator::into_field`]
    /// returns the displacement on every cell, including later additions to the displacement.
    pub(super) fn displacement(
        &mut self,
        shear: &[Vector<A>],
        previous: Option<&ByAxis<Vec<f64>>>,
        target: &mut [Vector<A>],
    ) {
        self.scatter(shear);
        if let Some(previous) = previous {
            for (input, previous) in self.input.iter_mut().zip(previous) {
                for (q, q0) in input.iter_mut().zip(previous) {
                    *q -= q0;
                }
            }
        }
        if self.input.iter().flatten().all(|q| *q == 0.0) {
            self.field.iter_mut().for_each(|u| u.fill(0.0));
        } else {
            compliance(self.half_space, &self.input, &mut self.field);
        }
        self.input.iter_mut().for_each(|q| q.fill(0.0));
        gather(&self.field, &self.cells, target);
    }

    /// Returns the displacement on every cell of the grid.
    pub(super) fn into_field(self) -> ByAxis<Vec<f64>> {
        self.field
    }
}

fn gather<const A: usize>(field: &ByAxis<Vec<f64>>, cells: &[usize], target: &mut [Vector<A>]) {
    for (axis, field) in field.iter().enumerate() {
        for (value, &c) in target.iter_mut().zip(cells) {
            value[axis] = field[c];
        }
    }
}
