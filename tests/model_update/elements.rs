use fretwear::grid::Grid;
use fretwear::model_update::{ContactElements, ModelUpdateError};
use fretwear::structure::reduction::{ContactPorts, Ports};
use fretwear::structure::resonator::Resonator;
use proptest::prelude::*;

use super::{ROUNDING, assert_close, facings, noise, resonator, small, small_faces};

/// Rectangle of a cell of `grid` about a centre: low and high corner \[m\].
fn rectangle(grid: Grid, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
    let half = [0.5 * grid.dx, 0.5 * grid.dy];
    [[x - half[0], y - half[1]], [x + half[0], y + half[1]]]
}

/// Common area of two rectangles \[m²\].
fn common(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> f64 {
    [0, 1]
        .map(|d| (a[1][d].min(b[1][d]) - a[0][d].max(b[0][d])).max(0.0))
        .iter()
        .product()
}

/// Sums over elements by a double loop over all pairs of cells and rectangles.
fn naive_sums(elements: &ContactElements, counts: [usize; 2], field: &[f64]) -> Vec<f64> {
    let grid = elements.grid();
    let array = Grid::over(grid.size(), counts);
    let mut sums = vec![0.0; elements.len()];
    for (c, value) in field.iter().enumerate() {
        if !elements.patch().is_in_joint[c] {
            continue;
        }
        let (i, j) = grid.cell(c);
        let cell = rectangle(grid, grid.centre(i, j).into());
        let overlaps: Vec<f64> = elements
            .centres()
            .iter()
            .map(|&e| common(cell, rectangle(array, e)))
            .collect();
        let whole: f64 = overlaps.iter().sum();
        for (sum, overlap) in sums.iter_mut().zip(&overlaps) {
            *sum += value * overlap / whole;
        }
    }
    sums
}

/// Fine cells with their centre in the element.
fn naive_centred(elements: &ContactElements, counts: [usize; 2], element: usize) -> Vec<usize> {
    let grid = elements.grid();
    let array = Grid::over(grid.size(), counts);
    let [low, high] = rectangle(array, elements.centres()[element]);
    (0..grid.len())
        .filter(|&c| {
            let (i, j) = grid.cell(c);
            let (x, y) = grid.centre(i, j);
            x > low[0] && x < high[0] && y > low[1] && y < high[1]
        })
        .collect()
}

#[test]
fn the_resonators_staircase_is_its_mask() {
    let grid = Grid::over([40e-3, 40e-3], [256, 192]);
    let elements = resonator(grid);
    assert_eq!(elements.len(), 340);
    // Rows of cells of the hole, from its middle outwards, as in the mesh.
    let pitch = 40e-3 / 19.0;
    let half_width = |y: f64| match (y.abs() / pitch + 0.5).floor() as usize {
        0 | 1 => 2.5 * pitch,
        2 => 1.5 * pitch,
        _ => 0.0,
    };
    for c in 0..grid.len() {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        assert_eq!(
            elements.patch().is_in_joint[c],
            x.abs() > half_width(y),
            "({i}, {j})"
        );
    }
    // The difference in area is less than the cells along a circumference of the hole.
    let area: f64 = elements.areas().iter().sum();
    assert_close(elements.patch().area(), area, 2e-3, "area of the patch");
}

#[test]
fn elements_lie_where_the_structure_has_them() {
    let elements = resonator(Grid::over([40e-3, 40e-3], [40, 23]));
    let (centres, areas) = (elements.centres(), elements.areas());
    for (e, facing) in facings().iter().enumerate() {
        for d in [0, 1] {
            let miss = centres[e][d] - facing.centre[d];
            assert!(miss.abs() < ROUNDING * 40e-3, "element {e} along {d}");
        }
        assert_close(areas[e], facing.area, ROUNDING, "area");
    }
}

#[test]
fn sums_and_gaps_are_those_of_a_double_loop() {
    let single = ContactElements::single(Grid::over([3e-3, 2e-3], [9, 7])).expect("one element");
    for (elements, counts) in [
        (resonator(Grid::over([40e-3, 30e-3], [64, 48])), [19, 19]),
        (small(), [5, 3]),
        (single, [1, 1]),
    ] {
        let field = noise(elements.grid().len());
        let (sums, naive) = (elements.sums(&field), naive_sums(&elements, counts, &field));
        let gaps = elements.gaps(&field);
        for e in 0..elements.len() {
            assert_close(sums[e], naive[e], ROUNDING, "sum");
            let centred = naive_centred(&elements, counts, e);
            let least = centred
                .iter()
                .fold(f64::INFINITY, |least, &c| least.min(field[c]));
            assert_eq!(gaps[e], least, "gap of element {e}");
        }
    }
}

/// Elements at the nodes around the faces of [`small`], which lack the middle face and one corner face.
#[test]
fn elements_at_nodes_share_what_a_cell_bears_by_its_place_between_them() {
    let grid = Grid::over([6e-3, 4e-3], [17, 14]);
    let elements = ContactElements::at_nodes(grid, [5, 3], &small_faces()).expect("elements");
    // 6 × 4 nodes without the corner node; the nodes around the hole in the middle belong to other faces.
    assert_eq!(elements.len(), 23);
    let area: f64 = elements.areas().iter().sum();
    assert_close(
        area,
        13.0 * 1.2e-3 * 4e-3 / 3.0,
        ROUNDING,
        "area of the faces",
    );
    // The elements have the force and first moments of the cells for any field: the shares are bilinear weights.
    let mut field = noise(grid.len());
    for (value, kept) in field.iter_mut().zip(&elements.patch().is_in_joint) {
        *value *= f64::from(u8::from(*kept));
    }
    let loads = elements.loads(&field);
    let moment = |of: &dyn Fn([f64; 2]) -> f64| {
        let cells = (0..grid.len()).map(|c| {
            let (i, j) = grid.cell(c);
            field[c] * grid.cell_area() * of(grid.centre(i, j).into())
        });
        let nodes = elements
            .centres()
            .iter()
            .zip(&loads)
            .map(|(c, n)| n * of(*c));
        (cells.sum::<f64>(), nodes.sum::<f64>())
    };
    for of in [
        |_: [f64; 2]| 1.0,
        |c: [f64; 2]| 1e-2 + c[0],
        |c: [f64; 2]| 1e-2 + c[1],
    ] {
        let (fine, coarse) = moment(&of);
        assert_close(coarse, fine, ROUNDING, "resultant");
    }
    let nodes = elements.nodes().expect("nodes");
    assert_eq!(nodes.interpolation.nodes(), 24);
    assert!(nodes.numbers.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(elements.gaps(&field).iter().all(|gap| gap.is_finite()));
}

/// The pairs of nodes of the structure are the elements of the fine grid, in the same order.
#[test]
fn nodes_of_the_resonator_are_those_of_its_elements() {
    let geometry = Resonator::default();
    let grid = Grid::over([40e-3, 40e-3], [64, 80]);
    let array = geometry.contact_array();
    let elements = ContactElements::at_nodes(grid, array.counts, &array.cells()).expect("elements");
    let nodes = array.nodes();
    assert_eq!(nodes.len(), elements.len());
    for (e, (centre, area)) in nodes.iter().enumerate() {
        assert_close(elements.areas()[e], *area, ROUNDING, "area");
        for d in [0, 1] {
            let miss = elements.centres()[e][d] - centre[d];
            assert!(miss.abs() < ROUNDING * 40e-3, "element {e} along {d}");
        }
    }
    let mesh = geometry.mesh().expect("a mesh");
    let ports = Ports::new(&mesh.contacts, &[], ContactPorts::Nodes);
    assert_eq!(ports.contacts, nodes.len());
    for (e, (centre, _)) in nodes.iter().enumerate() {
        let [(lower, below), (upper, above)] = ports.combinations[3 * e][..] else {
            panic!("a pair of nodes");
        };
        assert_eq!([below, above], [-1.0, 1.0]);
        for node in [lower / 3, upper / 3] {
            let place = mesh.mesh.nodes[node];
            assert!((place[0] - centre[0]).abs() < 1e-12 && (place[1] - centre[1]).abs() < 1e-12);
        }
    }
}

#[test]
fn a_load_on_one_cell_is_shared_by_area() {
    // Cell 3 of 7 covers the border of two elements, with half of it in each; along y the grids fit.
    let grid = Grid::over([7e-3, 3e-3], [7, 6]);
    let cells = [[0, 0], [0, 1], [1, 0], [1, 1]];
    let elements = ContactElements::new(grid, [2, 2], &cells).expect("elements");
    let mut pressure = vec![0.0; grid.len()];
    pressure[grid.index(3, 1)] = 2e6;
    let force = 2e6 * grid.cell_area();
    let loads = elements.loads(&pressure);
    assert_close(loads[0], 0.5 * force, ROUNDING, "one half");
    assert_close(loads[2], 0.5 * force, ROUNDING, "the other half");
    assert_eq!([loads[1], loads[3]], [0.0, 0.0]);
    // Next to a hole, the element takes the whole load of the cell.
    let elements = ContactElements::new(grid, [2, 2], &cells[..3]).expect("elements");
    pressure[grid.index(3, 1)] = 0.0;
    pressure[grid.index(3, 4)] = 2e6;
    let loads = elements.loads(&pressure);
    assert_close(loads[1], force, ROUNDING, "all");
}

#[test]
fn a_centre_on_a_border_belongs_to_both_sides() {
    // With three cells over two elements, the middle cell has its centre on the border.
    let grid = Grid::over([3e-3, 1e-3], [3, 2]);
    let both = ContactElements::new(grid, [2, 1], &[[0, 0], [1, 0]]).expect("elements");
    let mut gap = vec![1e-6; 6];
    gap[grid.index(1, 1)] = 2e-7;
    assert_eq!(both.gaps(&gap), [2e-7, 2e-7]);
    // A joint and its mirror image have the same cells.
    let left = ContactElements::new(grid, [2, 1], &[[0, 0]]).expect("elements");
    let right = ContactElements::new(grid, [2, 1], &[[1, 0]]).expect("elements");
    assert_eq!(
        left.patch().is_in_joint,
        [true, true, true, true, false, false]
    );
    assert_eq!(
        right.patch().is_in_joint,
        [false, false, true, true, true, true]
    );
}

#[test]
fn elements_that_make_no_joint_are_refused() {
    let grid = Grid::over([40e-3, 40e-3], [32, 18]);
    let refused = |counts, cells: &[[usize; 2]]| {
        ContactElements::new(grid, counts, cells).expect_err("no joint")
    };
    assert_eq!(refused([19, 18], &[]), ModelUpdateError::NoElements);
    let coarse = refused([19, 19], &[[0, 0]]);
    assert_eq!(
        coarse,
        ModelUpdateError::GridTooCoarse {
            axis: "y",
            cells: 18,
            elements: 19,
        }
    );
    let message = coarse.to_string();
    assert!(message.contains("joint.grid has 18 cells along y for joint.elements = 19"));
    assert_eq!(
        refused([19, 18], &[[0, 0], [19, 0]]),
        ModelUpdateError::Outside {
            element: 1,
            cell: [19, 0],
            counts: [19, 18],
        }
    );
    assert_eq!(
        refused([19, 18], &[[3, 4], [0, 0], [3, 4]]),
        ModelUpdateError::DuplicateCell {
            first: 0,
            second: 2,
            cell: [3, 4],
        }
    );
}

#[test]
fn a_grid_as_fine_as_the_elements_is_fine_enough() {
    let elements = resonator(Grid::over([40e-3, 30e-3], [19, 20]));
    assert!(elements.gaps(&vec![1.0; 380]).iter().all(|&g| g == 1.0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// ΣN₀ = N, and every element has a gap, for any grid, array and hole.
    #[test]
    fn no_load_is_lost(
        counts in [1_usize..9, 1_usize..9],
        finer in [0_usize..30, 0_usize..30],
        present in proptest::collection::vec(prop::bool::weighted(0.7), 64),
        pressure in proptest::collection::vec(0.0..3e9_f64, 38 * 38),
    ) {
        let grid = Grid::over([40e-3, 30e-3], [counts[0] + finer[0], counts[1] + finer[1]]);
        let cells: Vec<[usize; 2]> = (0..counts[0] * counts[1])
            .filter(|&c| c == 0 || present[c])
            .map(|c| [c / counts[1], c % counts[1]])
            .collect();
        let elements = ContactElements::new(grid, counts, &cells).expect("elements");
        let pressure = &pressure[..grid.len()];
        let load: f64 = (0..grid.len())
            .filter(|&c| elements.patch().is_in_joint[c])
            .map(|c| pressure[c] * grid.cell_area())
            .sum();
        let loads = elements.loads(pressure);
        prop_assert!(loads.iter().all(|&n| n >= 0.0));
        let sum: f64 = loads.iter().sum();
        prop_assert!((sum - load).abs() <= ROUNDING * load, "{sum:e} of {load:e} N");
        prop_assert!(elements.gaps(pressure).iter().all(|g| g.is_finite()));
    }
}
