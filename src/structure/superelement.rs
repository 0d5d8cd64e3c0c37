//! A reduced structure as stiffness and mass between the displacements of its ports and the amplitudes of its modes: what another program
//! takes as a superelement.
//!
//! Ports move by u = Φq + r, the modes and what is left, r = R₀ f. With u and q as coordinates the energies are ½ qᵀΩ²q + ½ rᵀR₀⁻¹r and
//! ½ q̇ᵀq̇ + ½ ṙᵀR₀⁻¹R₁R₀⁻¹ṙ (Rubin, AIAA J. 13, 1975). With the modes eliminated the ports have the receptance
//! Φ(Ω² − ω²)⁻¹Φᵀ + R₀(R₀ − ω²R₁)⁻¹R₀. Where R₀ is next to nothing, as of combinations of ports that only modes move, it is rounding: those follow
//! the modes behind a spring as stiff as the least flexibility, without mass.

use crate::linalg::{LinalgError, Matrix, RowMatrix};
use crate::structure::reduction::Reduced;

/// The least flexibility of a combination of ports that is none of rounding, over the largest: what rigid modes leave in it is 1e-6.
const LEAST: f64 = 1e-5;

/// Matrices of a reduced structure. Rows are its ports in their order, then the modes, rigid ones first.
#[derive(Debug, Clone, PartialEq)]
pub struct Superelement {
    /// \[N/m\] between ports, rad²/s² between modes of mass 1 kg.
    pub stiffness: Matrix,
    /// \[kg\] between ports, 1 between modes.
    pub mass: Matrix,
    /// \[N s/m\], of the modes alone; none where the structure has no damping of its own.
    pub damping: Option<Matrix>,
    /// Hysteretic damping \[N/m\], of the modes alone; none where the structure has none.
    pub hysteretic: Option<Matrix>,
}

impl Superelement {
    /// Of a reduced structure.
    ///
    /// # Errors
    /// [`LinalgError`] for a residual flexibility that is not finite.
    pub fn new(reduced: &Reduced) -> Result<Superelement, LinalgError> {
        let ports = reduced.ports.len();
        let mut shapes = reduced.rigid.clone();
        shapes.append(&reduced.shapes);
        let (flexibility, vectors) = reduced.residual.symmetric_eigen()?;
        let least = LEAST * flexibility.iter().fold(0.0_f64, |most, r| most.max(*r));
        let weighted = |weight: &dyn Fn(f64) -> f64| {
            let columns = Matrix::from_fn(ports, ports, |i, r| {
                vectors[(i, r)] * weight(flexibility[r])
            });
            columns.times_transpose(&vectors)
        };
        let inverse = weighted(&|r| 1.0 / r.max(least));
        let without_rounding = weighted(&|r| if r > least { 1.0 / r } else { 0.0 });
        let inertia = without_rounding
            .times(&reduced.residual_slope)
            .times(&without_rounding);
        let held = reduced.rigid.columns();
        let mut stiffness = between(&inverse, &shapes);
        let mut mass = between(&inertia, &shapes);
        for mode in 0..shapes.columns() {
            let row = ports + mode;
            mass[(row, row)] += 1.0;
            if mode >= held {
                stiffness[(row, row)] += reduced.omega[mode - held].powi(2);
            }
        }
        let size = ports + shapes.columns();
        let of_modes = |own: &Matrix| {
            Matrix::from_fn(size, size, |i, j| match (i.min(j)).checked_sub(ports) {
                Some(_) => own[(i - ports, j - ports)],
                None => 0.0,
            })
        };
        Ok(Superelement {
            stiffness,
            mass,
            damping: reduced.damping.as_ref().map(of_modes),
            hysteretic: reduced.hysteretic.as_ref().map(of_modes),
        })
    }
}

/// Stiffness, mass, and both dampings of `M q̈ + C q̇ + K q = Bᵀf`, `u = B q + R f` between the displacements of its ports and q: the ports follow B q behind
/// R⁻¹, without mass and damping. Without R the ports are q, in another order. Of the first `contact` ports every third is reversed, so that it is positive where the joint opens.
///
/// # Errors
/// [`LinalgError`] for a residual flexibility that is not finite.
pub fn of_model(
    matrices: [&RowMatrix; 4],
    basis: &RowMatrix,
    residual: Option<&RowMatrix>,
    contact: usize,
) -> Result<[Matrix; 4], LinalgError> {
    let (ports, modes) = (basis.rows(), basis.columns());
    let sign = |port: usize| match port < contact && port % 3 == 2 {
        true => -1.0,
        false => 1.0,
    };
    let Some(residual) = residual else {
        // Ports that are the coordinates themselves, as of a mass.
        let own = |matrix: &RowMatrix| {
            let moved = basis.times(matrix).times(&basis.transposed());
            Matrix::from_fn(ports, ports, |i, j| sign(i) * sign(j) * moved.at(i, j))
        };
        return Ok(matrices.map(own));
    };
    let shapes = Matrix::from_fn(ports, modes, |i, j| sign(i) * basis.at(i, j));
    let flexibility = Matrix::from_fn(ports, ports, |i, j| sign(i) * sign(j) * residual.at(i, j));
    let (values, vectors) = flexibility.symmetric_eigen()?;
    let least = LEAST * values.iter().fold(0.0_f64, |most, r| most.max(*r));
    let weighted = Matrix::from_fn(ports, ports, |i, r| vectors[(i, r)] / values[r].max(least));
    let mut behind = between(&weighted.times_transpose(&vectors), &shapes);
    let of_modes = |own: &RowMatrix| {
        Matrix::from_fn(ports + modes, ports + modes, |i, j| {
            match i.min(j).checked_sub(ports) {
                Some(_) => own.at(i - ports, j - ports),
                None => 0.0,
            }
        })
    };
    let [stiffness, mass, damping, hysteretic] = matrices.map(of_modes);
    behind.add(1.0, &stiffness);
    Ok([behind, mass, damping, hysteretic])
}

/// (u − Φq)ᵀA(u − Φq) as a matrix of u and q, symmetric to the last digit.
fn between(a: &Matrix, shapes: &Matrix) -> Matrix {
    let (ports, modes) = (a.rows(), shapes.columns());
    let across = a.times(shapes);
    let inner = shapes.transpose_times(&across);
    Matrix::from_fn(ports + modes, ports + modes, |i, j| {
        let (i, j) = (i.max(j), i.min(j));
        match (i.checked_sub(ports), j.checked_sub(ports)) {
            (None, None) => 0.5 * (a[(i, j)] + a[(j, i)]),
            (Some(mode), None) => -across[(j, mode)],
            (Some(m), Some(n)) => 0.5 * (inner[(m, n)] + inner[(n, m)]),
            (None, Some(_)) => unreachable!("the larger is first"),
        }
    })
}
