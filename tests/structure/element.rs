//! Patch test, rigid motions, eigenvalues and bending of single elements and small patches.

use fretwear::linalg::Matrix;
use fretwear::material::{Elastic, Material};
use fretwear::structure::StructureError;
use fretwear::structure::assembly::System;
use fretwear::structure::element::{ElementMatrices, Formulation, matrices};
use fretwear::structure::mesh::Mesh;

use super::STEEL;

const BOTH: [Formulation; 2] = [Formulation::Plain, Formulation::IncompatibleModes];
const SHEAR: f64 = 198.4e9 / 2.6;
/// Rounding of the 8 × 33 × 33 sums of an element, relative to the largest number.
const ROUNDING: f64 = 1e-12;

/// Box with corners at ±size/2.
fn brick(size: [f64; 3]) -> [[f64; 3]; 8] {
    fretwear::structure::element::CORNERS.map(|c| [0, 1, 2].map(|a| 0.5 * size[a] * c[a]))
}

fn distorted() -> [[f64; 3]; 8] {
    let shifts = [
        [0.1, -0.2, 0.05],
        [-0.15, 0.1, 0.2],
        [0.2, 0.15, -0.1],
        [-0.05, -0.1, 0.15],
        [0.0, 0.2, -0.15],
        [0.15, 0.05, 0.1],
        [-0.2, 0.1, 0.05],
        [0.1, -0.15, -0.2],
    ];
    let mut nodes = brick([1.3, 1.0, 0.8]);
    for (x, s) in nodes.iter_mut().zip(shifts) {
        for a in 0..3 {
            x[a] += 0.7 * s[a];
        }
    }
    nodes
}

fn matrices_of(nodes: &[[f64; 3]; 8], formulation: Formulation) -> ElementMatrices {
    matrices(nodes, &STEEL, formulation, 0).unwrap()
}

fn stiffness_of(element: &ElementMatrices) -> Matrix {
    Matrix::from_fn(24, 24, |i, j| element.stiffness[i][j])
}

fn energy(element: &ElementMatrices, u: &[f64]) -> f64 {
    let rows = 0..24;
    rows.map(|i| u[i] * (0..24).map(|j| element.stiffness[i][j] * u[j]).sum::<f64>())
        .sum()
}

#[test]
fn a_distorted_element_has_exactly_six_rigid_motions() {
    for formulation in BOTH {
        let element = matrices_of(&distorted(), formulation);
        let (values, _) = stiffness_of(&element).symmetric_eigen().unwrap();
        let largest = values[23];
        assert!(values[..6].iter().all(|v| v.abs() < ROUNDING * largest));
        // The softest deformation mode of a distorted element is far above rounding.
        assert!(values[6] > 1e-3 * largest, "{values:?}");
    }
}

/// Uniform dilatation and the five uniform shears of a cube of side h are eigenvectors. The nodal forces of a uniform stress σ are σ·x
/// times h²/2 over h/2, so λ = E h/(2(1 − 2ν)) and λ = G h.
#[test]
fn a_cube_has_its_closed_form_eigenvalues() {
    let h = 0.7;
    for formulation in BOTH {
        let element = matrices_of(&brick([h; 3]), formulation);
        let (values, _) = stiffness_of(&element).symmetric_eigen().unwrap();
        let dilatation = 198.4e9 * h / (2.0 * (1.0 - 2.0 * 0.3));
        assert!((values[23] / dilatation - 1.0).abs() < ROUNDING);
        let shears = values
            .iter()
            .filter(|v| (**v / (SHEAR * h) - 1.0).abs() < 1e-9);
        assert!(shears.count() >= 5, "{values:?}");
    }
}

/// Bending about z with curvature κ: u_x = κxy, and the anticlastic u_z = −νκyz. The energy of a beam is E I κ² L. The plain element bends
/// only with shear and is much too stiff.
#[test]
fn incompatible_modes_bend_like_a_beam() {
    let [length, height, width] = [1.9, 0.6, 0.45];
    let nodes = brick([length, height, width]);
    let bending: Vec<f64> = nodes
        .iter()
        .flat_map(|x| [x[0] * x[1], 0.0, -0.3 * x[1] * x[2]])
        .collect();
    let beam = 198.4e9 * width * height.powi(3) / 12.0 * length;
    let found = energy(
        &matrices_of(&nodes, Formulation::IncompatibleModes),
        &bending,
    );
    assert!((found / beam - 1.0).abs() < 1e-10, "{}", found / beam);
    let plain = energy(&matrices_of(&nodes, Formulation::Plain), &bending);
    assert!(plain > 3.0 * beam, "{}", plain / beam);
}

#[test]
fn consistent_mass_is_that_of_the_box() {
    let size = [1.9, 0.6, 0.45];
    let element = matrices_of(&brick(size), Formulation::IncompatibleModes);
    let mass = STEEL.density * size.iter().product::<f64>();
    assert!((element.volume / size.iter().product::<f64>() - 1.0).abs() < ROUNDING);
    // Shapes are linear along each axis: 1/3 on the diagonal and 1/6 off the diagonal, per axis.
    for (p, a) in brick(size).iter().enumerate() {
        for (q, b) in brick(size).iter().enumerate() {
            let same = (0..3).filter(|&m| a[m] * b[m] > 0.0).count();
            let expected = mass / 27.0 * 0.5_f64.powi(3 - same as i32);
            assert!((element.mass[p][q] / expected - 1.0).abs() < ROUNDING);
        }
    }
}

/// Box of 3×2×2 elements. The two inner nodes are moved off the grid. The outer nodes are moved within flat faces.
fn patch() -> Mesh {
    let mut mesh = Mesh::block([1.2, 1.0, 0.9], [3, 2, 2], STEEL);
    let mut turn = 0.0_f64;
    for x in &mut mesh.nodes {
        for (a, length) in [1.2, 1.0, 0.9].into_iter().enumerate() {
            turn += 1.0;
            let inner = x[a] > 1e-9 && x[a] < length - 1e-9;
            if inner {
                x[a] += 0.07 * (2.4 * turn).sin();
            }
        }
    }
    mesh
}

/// Each uniform strain, imposed on all nodes, causes no force at the inner nodes and gives the energy of the exact stress. Elements of any
/// shape reproduce uniform strain.
#[test]
fn distorted_elements_pass_the_patch_test() {
    let mesh = patch();
    let inner: Vec<usize> = (0..mesh.nodes.len())
        .filter(|&n| {
            let lengths = [1.2, 1.0, 0.9];
            (0..3).all(|a| mesh.nodes[n][a] > 1e-9 && mesh.nodes[n][a] < lengths[a] - 1e-9)
        })
        .collect();
    assert_eq!(inner.len(), 2);
    let lame = 2.0 * SHEAR * 0.3 / (1.0 - 2.0 * 0.3);
    for formulation in BOTH {
        let system = System::assemble(&mesh, formulation, &[]).unwrap();
        for i in 0..3 {
            for j in 0..=i {
                let mut strain = [[0.0; 3]; 3];
                strain[i][j] = 1e-3;
                strain[j][i] = 1e-3;
                let u = Matrix::from_fn(system.size(), 1, |dof, _| {
                    let x = mesh.nodes[dof / 3];
                    (0..3).map(|b| strain[dof % 3][b] * x[b]).sum()
                });
                let force = system.stiffness.times(&u);
                let largest = force.as_slice().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                for &n in &inner {
                    for a in 0..3 {
                        let residual = force[(3 * n + a, 0)].abs() / largest;
                        assert!(residual < 1e-12, "{formulation:?} {i}{j} {residual}");
                    }
                }
                let trace: f64 = (0..3).map(|a| strain[a][a]).sum();
                let squares: f64 = strain.iter().flatten().map(|e| e * e).sum();
                let exact = (lame * trace * trace + 2.0 * SHEAR * squares) * 1.2 * 1.0 * 0.9;
                let found = u.transpose_times(&force)[(0, 0)];
                assert!((found / exact - 1.0).abs() < 1e-11, "{}", found / exact);
            }
        }
    }
}

#[test]
fn an_element_inside_out_is_refused() {
    let mut nodes = brick([1.0, 0.8, 0.6]);
    nodes.swap(0, 4);
    nodes.swap(1, 5);
    nodes.swap(2, 6);
    nodes.swap(3, 7);
    let found = matrices(&nodes, &STEEL, Formulation::Plain, 7).err();
    assert!(
        matches!(found, Some(StructureError::InvertedElement { element: 7, jacobian }) if jacobian < 0.0),
        "{found:?}"
    );
    nodes = brick([1.0, 0.8, 0.6]);
    nodes[3][1] = f64::NAN;
    assert!(matrices(&nodes, &STEEL, Formulation::Plain, 0).is_err());
}

#[test]
fn a_material_that_none_is_is_refused() {
    let mut mesh = Mesh::block([1.0, 0.5, 0.7], [1, 1, 2], STEEL);
    let refused = |mesh: &Mesh| match System::assemble(mesh, Formulation::Plain, &[]) {
        Err(StructureError::OutOfRange { name, .. }) => name,
        other => panic!("{:?}", other.err()),
    };
    mesh.materials[0].elastic.poisson_ratio = 0.5;
    assert_eq!(refused(&mesh), "poisson_ratio");
    mesh.materials[0] = Material {
        elastic: Elastic {
            youngs_modulus: 0.0,
            ..STEEL.elastic
        },
        ..STEEL
    };
    assert_eq!(refused(&mesh), "youngs_modulus");
    mesh.materials[0] = Material {
        density: f64::NAN,
        ..STEEL
    };
    assert_eq!(refused(&mesh), "density");
}

#[test]
fn a_point_between_nodes_weighs_its_neighbours() {
    let mesh = Mesh::block([1.0, 0.6, 0.9], [2, 3, 3], STEEL);
    let point = mesh.point("quarter", [1.0, 0.25, 0.3]).unwrap();
    let mut at = [0.0; 3];
    for &(n, w) in &point.weights {
        for a in 0..3 {
            at[a] += w * mesh.nodes[n][a];
        }
    }
    assert_eq!(point.weights.len(), 2);
    assert!((0..3).all(|a| (at[a] - point.position[a]).abs() < 1e-12));
    let outside = mesh.point("beyond", [1.001, 0.25, 0.3]).err();
    assert!(matches!(outside, Some(StructureError::PointOutside { name, .. }) if name == "beyond"));
    // Inside a distorted element, the weights also reproduce the position.
    let patch = patch();
    let point = patch.point("inside", [0.52, 0.41, 0.37]).unwrap();
    for a in 0..3 {
        let at: f64 = point
            .weights
            .iter()
            .map(|&(n, w)| w * patch.nodes[n][a])
            .sum();
        assert!((at - point.position[a]).abs() < 1e-9);
    }
}
