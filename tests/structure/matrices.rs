//! Element matrices against matrices from CalculiX for the same block. The environment variable names the folder of the files.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use fretwear::linalg::Matrix;
use fretwear::material::{Elastic, Material};
use fretwear::structure::assembly::System;
use fretwear::structure::element::Formulation;
use fretwear::structure::mesh::Mesh;

const FOLDER: &str = "FRETWEAR_REAL_DATA";
/// Relative rounding of the files, which print fourteen digits.
const PRINTED: f64 = 1e-12;

fn folder() -> Option<PathBuf> {
    let path = std::env::var_os(FOLDER).map(|f| PathBuf::from(f).join("matrices/calculix"));
    if path.is_none() {
        println!("skipped: {FOLDER} does not name a folder with matrices/calculix");
    }
    path
}

/// Block of the decks: 30×20×20 mm with 3×2×2 elements and the node numbers of the decks.
fn block(formulation: Formulation) -> System {
    let steel = Material {
        elastic: Elastic {
            youngs_modulus: 198.4e9,
            poisson_ratio: 0.3,
        },
        density: 7949.0,
    };
    let mesh = Mesh::block([0.03, 0.02, 0.02], [3, 2, 2], steel);
    System::assemble(&mesh, formulation, &[]).unwrap()
}

/// Degrees of freedom as (node from 0, axis), in the order of the matrix rows.
fn freedoms(path: &Path) -> Vec<(usize, usize)> {
    let text = std::fs::read_to_string(path).unwrap();
    let parse = |line: &str| {
        let (node, axis) = line.trim().split_once('.').unwrap();
        let number = |text: &str| text.parse::<usize>().unwrap() - 1;
        (number(node), number(axis))
    };
    text.lines().map(parse).collect()
}

/// Full symmetric matrix from row, column and value of its upper triangle, scaled to SI.
fn upper(path: &Path, size: usize, scale: f64) -> Matrix {
    let mut matrix = Matrix::zeros(size, size);
    for line in std::fs::read_to_string(path).unwrap().lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let index = |word: &str| word.parse::<usize>().unwrap() - 1;
        let (i, j) = (index(words[0]), index(words[1]));
        let value: f64 = words[2].parse().unwrap();
        matrix[(i, j)] = scale * value;
        matrix[(j, i)] = scale * value;
    }
    matrix
}

/// Scale from N/mm and t to SI.
const SCALE: f64 = 1e3;

fn assert_same(found: &Matrix, expected: &Matrix) {
    let largest = expected
        .as_slice()
        .iter()
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    for (a, b) in found.as_slice().iter().zip(expected.as_slice()) {
        assert!((a - b).abs() < PRINTED * largest, "{a} {b}");
    }
}

fn selected(full: &Matrix, freedoms: &[(usize, usize)]) -> Matrix {
    let dof = |p: usize| 3 * freedoms[p].0 + freedoms[p].1;
    Matrix::from_fn(freedoms.len(), freedoms.len(), |i, j| {
        full[(dof(i), dof(j))]
    })
}

#[test]
fn plain_elements_are_those_of_calculix() {
    let Some(folder) = folder() else { return };
    for name in ["block_free", "block_clamped"] {
        let freedoms = freedoms(&folder.join(format!("{name}.dof")));
        let read = |kind| {
            upper(
                &folder.join(format!("{name}.{kind}")),
                freedoms.len(),
                SCALE,
            )
        };
        let system = block(Formulation::Plain);
        assert_same(
            &selected(&super::dense(&system.stiffness), &freedoms),
            &read("sti"),
        );
        assert_same(
            &selected(&super::dense(&system.mass), &freedoms),
            &read("mas"),
        );
    }
    // First frequency of these matrices in CalculiX.
    let freedoms = freedoms(&folder.join("block_clamped.dof"));
    let system = block(Formulation::Plain);
    let [stiffness, mass] =
        [&system.stiffness, &system.mass].map(|m| selected(&super::dense(m), &freedoms));
    let first = super::frequencies(&stiffness, &mass)[0] / TAU;
    assert!((first - 15579.46).abs() < 0.01, "{first}");
}

/// CalculiX stores the nine internal unknowns of each C3D8I as rows after the rows of the nodes. Their elimination must give the condensed
/// stiffness of this program.
#[test]
fn incompatible_modes_are_those_of_calculix() {
    let Some(folder) = folder() else { return };
    let path = |kind| folder.join(format!("block_clamped_c3d8i.{kind}"));
    let freedoms = freedoms(&path("dof"));
    let nodes = freedoms.iter().filter(|f| f.0 < 36).count();
    assert_eq!((nodes, freedoms.len()), (81, 81 + 12 * 9));
    let mut full = upper(&path("sti"), freedoms.len(), SCALE);
    for pivot in (nodes..freedoms.len()).rev() {
        for i in 0..pivot {
            let factor = full[(i, pivot)] / full[(pivot, pivot)];
            for j in 0..pivot {
                let value = factor * full[(pivot, j)];
                full[(i, j)] -= value;
            }
        }
    }
    let expected = Matrix::from_fn(nodes, nodes, |i, j| full[(i, j)]);
    let system = block(Formulation::IncompatibleModes);
    let own = selected(&super::dense(&system.stiffness), &freedoms[..nodes]);
    assert_same(&own, &expected);
}
