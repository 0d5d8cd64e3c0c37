//! Tests of the nodal compliance of a coarse mesh in addition to the compliance of the half spaces.

use std::sync::Arc;

use fretwear::contact::nodes::{Interpolation, NodalCompliance, ShearCompliance};
use fretwear::contact::{Boundary, ContactError, HalfSpace, Pair};
use fretwear::grid::Grid;
use fretwear::linalg::Matrix;
use fretwear::structure::element::Formulation;
use fretwear::structure::half_space::{FaceCompliance, FaceResolution};

use super::STEEL;

/// Rounding error of a sum over a grid, relative to its largest term.
const ROUNDING: f64 = 1e-12;

fn noise(count: usize, seed: f64) -> Vec<f64> {
    let value = |c: usize| ((c as f64 + seed) * 12.9898).sin() * 43_758.545_3;
    (0..count)
        .map(|c| value(c) - value(c).floor() - 0.5)
        .collect()
}

/// Random symmetric compliance matrices.
fn nodal(interpolation: Interpolation) -> NodalCompliance {
    let n = interpolation.nodes();
    let symmetric = |seed: f64| -> Vec<f64> {
        let any = noise(n * n, seed);
        (0..n * n)
            .map(|k| 1e-9 * (any[k] + any[k % n * n + k / n]))
            .collect()
    };
    NodalCompliance {
        normal: symmetric(0.3),
        shear: Some(ShearCompliance {
            xx: symmetric(0.5),
            yy: symmetric(0.7),
            xy: noise(n * n, 0.9).iter().map(|v| 1e-9 * v).collect(),
        }),
        interpolation: Arc::new(interpolation),
    }
}

/// Half spaces without the compliance of their meshes. Each mesh has `counts` boxes along x and y, in layers with these thicknesses \[m\].
pub fn without_mesh(
    grid: Grid,
    counts: [usize; 2],
    thickness: &[f64],
    formulation: Formulation,
) -> HalfSpace {
    let [lx, ly] = grid.size();
    let sides = [lx / counts[0] as f64, ly / counts[1] as f64];
    let mesh = FaceCompliance::of_layered_half_space(
        STEEL,
        sides,
        thickness,
        counts,
        formulation,
        FaceResolution::default(),
    );
    let mut mesh = mesh.expect("a mesh");
    mesh.add(&mesh.clone());
    let [normal, xx, yy, xy] = mesh.matrices().map(|m| m.into_iter().map(|c| -c).collect());
    let nodal = NodalCompliance {
        interpolation: Interpolation::new(grid, counts).into(),
        normal,
        shear: Some(ShearCompliance { xx, yy, xy }),
    };
    let mut half_space = HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free);
    half_space
        .set_nodal(Some(Arc::new(nodal)))
        .expect("nodes of the grid");
    half_space
}

/// Mean of the hat function of a node over a cell along one axis: exact trapezoids between the corners of the hat function.
fn mean_hat(cells: usize, rectangles: usize, cell: usize, node: usize) -> f64 {
    let hat = |at: f64| (1.0 - (at - node as f64).abs()).max(0.0);
    let [low, high] = [cell, cell + 1].map(|end| end as f64 * rectangles as f64 / cells as f64);
    let corners = [-1.0, 0.0, 1.0].map(|k| node as f64 + k);
    let mut ends: Vec<f64> = corners
        .into_iter()
        .filter(|c| *c > low && *c < high)
        .collect();
    ends.insert(0, low);
    ends.push(high);
    let pieces = ends
        .windows(2)
        .map(|p| 0.5 * (hat(p[0]) + hat(p[1])) * (p[1] - p[0]));
    pieces.sum::<f64>() / (high - low)
}

/// Entry of the interpolation matrix S, from the hat functions of the nodes.
fn weight(grid: Grid, counts: [usize; 2], cell: usize, node: usize) -> f64 {
    let (i, j) = grid.cell(cell);
    let (m, n) = (node / (counts[1] + 1), node % (counts[1] + 1));
    mean_hat(grid.nx, counts[0], i, m) * mean_hat(grid.ny, counts[1], j, n)
}

#[test]
fn interpolation_is_that_of_hats() {
    for (cells, counts) in [([13, 10], [4, 3]), ([6, 5], [6, 5]), ([5, 4], [1, 1])] {
        let grid = Grid::over([6e-3, 5e-3], cells);
        let interpolation = Interpolation::new(grid, counts);
        let field = noise(grid.len(), 0.1);
        let sums = interpolation.apply_transpose(&field);
        for (node, sum) in sums.iter().enumerate() {
            let terms = field.iter().enumerate();
            let naive: f64 = terms.map(|(c, v)| v * weight(grid, counts, c, node)).sum();
            assert!((sum - naive).abs() < ROUNDING * grid.len() as f64);
        }
        // A field on the cells and its sums on the nodes do the same work on a motion of the nodes.
        let moved = noise(interpolation.nodes(), 0.2);
        let mut cells = vec![0.0; grid.len()];
        interpolation.add_interpolated(1.0, &moved, &mut cells);
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        assert!((dot(&field, &cells) - dot(&sums, &moved)).abs() < ROUNDING * grid.len() as f64);
        for c in 0..grid.len() {
            let whole: f64 = interpolation.nodal_weights(c).map(|(_, w)| w).sum();
            assert!((whole - 1.0).abs() < ROUNDING);
        }
    }
}

/// Each kernel of the half space with added nodal compliance equals direct sums over cells and nodes.
#[test]
fn displacements_are_those_of_a_double_sum_more() {
    let (grid, counts) = (Grid::over([6e-3, 5e-3], [13, 10]), [4, 3]);
    let added = nodal(Interpolation::new(grid, counts));
    let (n, cells) = (added.interpolation.nodes(), grid.len());
    let mut half_space = HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free);
    let shear = [noise(cells, 0.1), noise(cells, 0.6)];
    let run = |half_space: &mut HalfSpace| {
        let mut out = vec![vec![0.0; cells]; 4];
        half_space.normal(&shear[0], &mut out[0]);
        half_space.shear_x(&shear[0], &mut out[1]);
        let [x, y] = out.get_disjoint_mut([2, 3]).expect("two fields");
        half_space.shear([&shear[0], &shear[1]], [x, y]);
        out
    };
    let plain = run(&mut half_space);
    half_space
        .set_nodal(Some(Arc::new(added.clone())))
        .expect("nodes of the grid");
    let with = run(&mut half_space);
    let without = half_space.without_nodal(run);
    assert_eq!(plain, without);
    assert!(half_space.nodal().is_some());
    let sums = |q: &[f64]| -> Vec<f64> {
        let terms = |node: usize| (0..cells).map(move |c| (c, node));
        (0..n)
            .map(|node| {
                terms(node)
                    .map(|(c, m)| q[c] * weight(grid, counts, c, m))
                    .sum()
            })
            .collect()
    };
    let forces = [sums(&shear[0]), sums(&shear[1])];
    let times = |matrix: &[f64], turned: bool, v: &[f64]| -> Vec<f64> {
        let at = |a: usize, b: usize| {
            if turned {
                matrix[b * n + a]
            } else {
                matrix[a * n + b]
            }
        };
        (0..n)
            .map(|a| (0..n).map(|b| at(a, b) * v[b]).sum())
            .collect()
    };
    let plus =
        |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> { a.iter().zip(&b).map(|(a, b)| a + b).collect() };
    let of = added.shear.expect("a shear compliance");
    let moved = [
        times(&added.normal, false, &forces[0]),
        times(&of.xx, false, &forces[0]),
        plus(
            times(&of.xx, false, &forces[0]),
            times(&of.xy, false, &forces[1]),
        ),
        plus(
            times(&of.yy, false, &forces[1]),
            times(&of.xy, true, &forces[0]),
        ),
    ];
    for (k, moved) in moved.iter().enumerate() {
        let largest = with[k].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for c in 0..cells {
            let more: f64 = (0..n)
                .map(|node| weight(grid, counts, c, node) * moved[node])
                .sum();
            let expected = plain[k][c] + more * grid.cell_area();
            assert!(
                (with[k][c] - expected).abs() < ROUNDING * largest,
                "field {k}, cell {c}"
            );
        }
    }
}

#[test]
fn matrices_and_grids_that_do_not_fit_are_refused() {
    let grid = Grid::over([6e-3, 5e-3], [13, 10]);
    let mut half_space = HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free);
    // One grid has the same number of cells in the other order, and the other grid has longer cells.
    let turned = Grid::over([6e-3, 5e-3], [10, 13]);
    let longer = Grid::over([7e-3, 5e-3], [13, 10]);
    for wrong in 0..6 {
        let over = match wrong {
            4 => turned,
            5 => longer,
            _ => grid,
        };
        let mut added = nodal(Interpolation::new(over, [4, 3]));
        let of = added.shear.as_mut().expect("a shear compliance");
        let matrices = [&mut added.normal, &mut of.xx, &mut of.yy, &mut of.xy];
        if let Some(matrix) = matrices.into_iter().nth(wrong) {
            matrix.pop();
        }
        let error = half_space.set_nodal(Some(Arc::new(added)));
        let refused = match wrong {
            5 => matches!(error, Err(ContactError::OutOfRange { .. })),
            _ => matches!(error, Err(ContactError::Length { .. })),
        };
        assert!(refused, "{wrong}: {error:?}");
    }
}

/// At a hole, the weights of a cell conserve force and moments, and refer only to existing nodes.
#[test]
fn cells_at_a_hole_belong_to_the_nodes_that_are_there() {
    let (grid, counts) = (Grid::over([7e-3, 5e-3], [17, 11]), [4, 3]);
    let absent = [7, 8, 19];
    let whole = Interpolation::new(grid, counts);
    let interpolation = whole
        .clone()
        .without_missing_nodes(|node| !absent.contains(&node));
    let width = counts[1] + 1;
    let place = |node: usize| {
        let at = |k: usize, axis: usize| grid.size()[axis] * (k as f64 / counts[axis] as f64 - 0.5);
        [at(node / width, 0), at(node % width, 1)]
    };
    let mut changed = 0;
    for c in 0..grid.len() {
        let around: Vec<(usize, f64)> = interpolation.nodal_weights(c).collect();
        let before: Vec<(usize, f64)> = whole.nodal_weights(c).collect();
        if around.iter().any(|(node, _)| absent.contains(node)) {
            // Each of these cells has its centre beside a missing node, so the cell lies outside the joint.
            assert_eq!(around, before);
            continue;
        }
        changed += usize::from(around != before);
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        let sum = |of: &dyn Fn([f64; 2]) -> f64| -> f64 {
            around
                .iter()
                .map(|(node, part)| part * of(place(*node)))
                .sum()
        };
        assert!((sum(&|_| 1.0) - 1.0).abs() < ROUNDING, "cell {c}");
        assert!((sum(&|at| at[0]) - x).abs() < ROUNDING, "cell {c}");
        assert!((sum(&|at| at[1]) - y).abs() < ROUNDING, "cell {c}");
    }
    assert!(
        changed > 5,
        "the hole changed the weights of {changed} cells"
    );
    let field = noise(grid.len(), 0.1);
    let sums = interpolation.apply_transpose(&field);
    let moved = noise(interpolation.nodes(), 0.2);
    let mut cells = vec![0.0; grid.len()];
    interpolation.add_interpolated(1.0, &moved, &mut cells);
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    assert!((dot(&field, &cells) - dot(&sums, &moved)).abs() < ROUNDING * grid.len() as f64);
    for (c, value) in cells.iter().enumerate() {
        let expected: f64 = interpolation
            .nodal_weights(c)
            .map(|(node, part)| part * moved[node])
            .sum();
        assert!((value - expected).abs() < ROUNDING, "cell {c}");
    }
}

/// The compliance of a half space minus the compliance of its mesh is positive definite on every contact. Both types of hexahedra are
/// tested; boxes are as thick as long, or as thick as the boxes of the shipped resonator; cells lie within boxes or across their borders.
#[test]
fn what_a_mesh_leaves_of_a_half_space_is_positive_on_any_contact() {
    use Formulation::{IncompatibleModes, Plain};
    for (cells, counts, layer, formulation) in [
        ([24, 20], [6, 5], 2e-3, IncompatibleModes),
        ([24, 20], [6, 5], 6e-3, IncompatibleModes),
        ([25, 21], [6, 5], 2e-3, Plain),
        ([27, 23], [12, 10], 1e-3, IncompatibleModes),
        ([24, 20], [24, 20], 0.5e-3, Plain),
    ] {
        let grid = Grid::over([12e-3, 10e-3], cells);
        let cells = grid.len();
        let mut half_space = without_mesh(grid, counts, &[layer; 5], formulation);
        let column = |half_space: &mut HalfSpace, c: usize, tangential: bool| {
            let (mut unit, mut out) = (vec![0.0; cells], vec![0.0; cells]);
            unit[c] = 1.0;
            match tangential {
                true => half_space.shear_x(&unit, &mut out),
                false => half_space.normal(&unit, &mut out),
            }
            out
        };
        for tangential in [false, true] {
            let columns: Vec<Vec<f64>> = (0..cells)
                .map(|c| column(&mut half_space, c, tangential))
                .collect();
            // The eigenvalues of the complete face bound the eigenvalues of every part.
            let block = Matrix::from_fn(cells, cells, |i, j| 0.5 * (columns[j][i] + columns[i][j]));
            let (values, _) = block.symmetric_eigen().expect("eigenvalues");
            let (least, largest) = values
                .iter()
                .fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(*v), m.max(*v)));
            let case = format!("{counts:?}, layer {layer}, {formulation:?}, {tangential}");
            println!("{case}: {:.2e}", least / largest);
            assert!(least > 0.0, "{case}: {least:e} of {largest:e}");
        }
    }
}
