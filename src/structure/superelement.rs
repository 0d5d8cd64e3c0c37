//! Export of a reduced structure as a superelement. The superelement has a stiffness matrix and a mass matrix. The
//! degrees of freedom are the displacements of the ports and the amplitudes of the modes.
//!
//! The displacements of the ports are u = Φq + r, the modes and the residual r = R₀ f. In the coordinates u and q, the
//! potential energy is ½ qᵀΩ²q + ½ rᵀR₀⁻¹r. The kinetic energy is ½ q̇ᵀq̇ + ½ ṙᵀR₀⁻¹R₁R₀⁻¹ṙ (Rubin, AIAA J. 13, 1975).
//! Elimination of the modes gives the receptance Φ(Ω² − ω²)⁻¹Φᵀ + R₀(R₀ − ω²R₁)⁻¹R₀.
//!
//! If only modes move a combination of ports, the residual R₀ of the combination is a rounding error. A massless spring
//! then couples the combination to the modes. The flexibility of the spring is `LEAST` times the largest flexibility.

use crate::linalg::{LinalgError, Matrix, RowMatrix};
use crate::structure::reduction::ReducedStructure;

/// A flexibility of a combination of ports is a rounding error if it is below `LEAST` times the largest flexibility.
/// Rigid modes have a relative flexibility of about 1e-6.
const LEAST: f64 = 1e-5;

/// Matrices of a reduced structure. The rows of the matrices are the ports in order, then the modes, with the rigid
/// modes first.
#[derive(Debug, Clone, PartialEq)]
pub struct Superelement {
    /// Stiffness: \[N/m\] between ports, rad²/s² between modes of mass 1 kg.
    pub stiffness: Matrix,
    /// Mass: \[kg\] between ports, 1 between modes.
    pub mass: Matrix,
    /// Viscous damping \[N s/m\] of the modes only. `None` without damping of the structure.
    pub damping: Option<Matrix>,
    /// Hysteretic damping \[N/m\] of the modes only. `None` without hysteretic damping of the structure.
    pub hysteretic: Option<Matrix>,
}

impl Superelement {
    /// Computes the matrices of a reduced structure.
    ///
    /// # Errors
    /// [`LinalgError`] if the residual flexibility is not finite.
    pub fn new(reduced: &ReducedStructure) -> Result<Superelement, LinalgError> {
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
        let rigid_count = reduced.rigid.columns();
        let mut stiffness = quadratic_form(&inverse, &shapes);
        let mut mass = quadratic_form(&inertia, &shapes);
        for mode in 0..shapes.columns() {
            let row = ports + mode;
            mass[(row, row)] += 1.0;
            if mode >= rigid_count {
                stiffness[(row, row)] += reduced.omega[mode - rigid_count].powi(2);
            }
        }
        let size = ports + shapes.columns();
        let extended = |modal_matrix: &Matrix| {
            Matrix::from_fn(size, size, |i, j| match (i.min(j)).checked_sub(ports) {
                Some(_) => modal_matrix[(i - ports, j - ports)],
                None => 0.0,
            })
        };
        Ok(Superelement {
            stiffness,
            mass,
            damping: reduced.damping.as_ref().map(extended),
            hysteretic: reduced.hysteretic.as_ref().map(extended),
        })
    }
}

/// Computes stiffness, mass and both damping matrices of a model. The degrees of freedom are the displacements of the
/// ports and the coordinates q.
///
/// The model is `M q̈ + C q̇ + K q = Bᵀf`, `u = B q + R f`. The ports are coupled to B q by R⁻¹, without mass or
/// damping. Without R the ports are q in another order. Among the first `contact` ports, the sign of every third port
/// is reversed. A port with a reversed sign has a positive displacement if the joint opens.
///
/// # Errors
/// [`LinalgError`] if the residual flexibility is not finite.
pub fn model_matrices(
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
        // The ports are the coordinates themselves, for example for a single mass.
        let modal_matrix = |matrix: &RowMatrix| {
            let moved = basis.times(matrix).times(&basis.transposed());
            Matrix::from_fn(ports, ports, |i, j| sign(i) * sign(j) * moved.at(i, j))
        };
        return Ok(matrices.map(modal_matrix));
    };
    let shapes = Matrix::from_fn(ports, modes, |i, j| sign(i) * basis.at(i, j));
    let flexibility = Matrix::from_fn(ports, ports, |i, j| sign(i) * sign(j) * residual.at(i, j));
    let (values, vectors) = flexibility.symmetric_eigen()?;
    let least = LEAST * values.iter().fold(0.0_f64, |most, r| most.max(*r));
    let weighted = Matrix::from_fn(ports, ports, |i, r| vectors[(i, r)] / values[r].max(least));
    let mut coupled = quadratic_form(&weighted.times_transpose(&vectors), &shapes);
    let extended = |modal_matrix: &RowMatrix| {
        Matrix::from_fn(ports + modes, ports + modes, |i, j| {
            match i.min(j).checked_sub(ports) {
                Some(_) => modal_matrix.at(i - ports, j - ports),
                None => 0.0,
            }
        })
    };
    let [stiffness, mass, damping, hysteretic] = matrices.map(extended);
    coupled.add(1.0, &stiffness);
    Ok([coupled, mass, damping, hysteretic])
}

/// Returns (u − Φq)ᵀA(u − Φq) as an exactly symmetric matrix of u and q.
fn quadratic_form(a: &Matrix, shapes: &Matrix) -> Matrix {
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
