//! Finite elements, modes and reduction, against closed forms, an independent program and direct solves.

mod beam;
mod deck;
mod element;
mod frequencies;
mod fuzz;
mod half_space;
mod imported;
mod matrices;
mod outline;
mod readers;
mod real_matrices;
mod reduction;
mod resonator;
mod solids;
mod statics;
mod superelement;
mod ties;

use std::collections::HashMap;

use fretwear::linalg::{Matrix, SparseSymmetric};
use fretwear::material::{Elastic, Material};
use fretwear::structure::assembly::System;
use fretwear::structure::matrices::{Matrices, Triplets};

const STEEL: Material = Material {
    elastic: Elastic {
        youngs_modulus: 198.4e9,
        poisson_ratio: 0.3,
    },
    density: 7949.0,
};

/// Matrices that contain only stiffness and mass.
fn only_matrices(stiffness: Triplets, mass: Triplets) -> Matrices {
    Matrices {
        size: stiffness.size,
        dofs: None,
        stiffness: Some(stiffness),
        mass: Some(mass),
        damping: None,
        hysteretic: None,
        unit: None,
        sets: HashMap::new(),
        positions: HashMap::new(),
        notes: Vec::new(),
        outline: Vec::new(),
        faces: Vec::new(),
        hexahedra: None,
        local_axes: Vec::new(),
        unread: Vec::new(),
        formats: Vec::new(),
    }
}

fn dense(matrix: &SparseSymmetric) -> Matrix {
    let mut full = Matrix::zeros(matrix.size(), matrix.size());
    for j in 0..matrix.size() {
        for (i, v) in matrix.column(j) {
            full[(i, j)] = v;
            full[(j, i)] = v;
        }
    }
    full
}

/// All angular frequencies of dense matrices \[rad/s\], ascending, by Cholesky factorization of the mass.
fn frequencies(stiffness: &Matrix, mass: &Matrix) -> Vec<f64> {
    let factor = mass.cholesky().unwrap();
    let mut reduced = stiffness.clone();
    factor.solve_lower(&mut reduced);
    factor.solve_upper_right(&mut reduced);
    let (values, _) = reduced.symmetric_eigen().unwrap();
    values.iter().map(|v| v.max(0.0).sqrt()).collect()
}

fn dense_frequencies(system: &System) -> Vec<f64> {
    frequencies(&dense(&system.stiffness), &dense(&system.mass))
}
