use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::grid::Grid;
use fretwear::model_update::{
    Compliance, ContactElements, Distribution, ElementParameters, Springs,
};

use super::{ROUNDING, assert_close, half_space, small};
use crate::contact::paraboloid;

const SPRINGS: Springs<'static> = Springs::Total {
    total: Compliance {
        normal: 1.0 / 3606e6,
        tangential: 1.0 / 2973e6,
    },
    distribution: Distribution::Uniform,
};

/// Under a paraboloid off the middle, some elements are loaded and the others are open.
#[test]
fn an_element_has_load_or_a_gap() {
    let elements = small();
    let grid = elements.grid();
    let height = paraboloid(grid, 0.3, (-2e-3, 1e-3));
    let load = 500.0;
    let problem = NormalProblem::new(elements.patch(), &height, load);
    let solution = normal::solve(
        &mut half_space(grid),
        &problem,
        None,
        NormalOptions::default(),
    )
    .expect("contact");
    let parameters = ElementParameters::new(&elements, &solution.pressure, &solution.gap, SPRINGS)
        .expect("parameters");
    assert_close(parameters.normal_load.iter().sum(), load, ROUNDING, "N₀");
    let (mut loaded, mut open) = (0, 0);
    let gaps = elements.gaps(&solution.gap);
    for e in 0..elements.len() {
        let (n, g) = (parameters.normal_load[e], parameters.gap[e]);
        if n > 0.0 {
            assert_eq!(g, 0.0);
            loaded += 1;
        } else {
            assert_eq!(g, gaps[e]);
            assert!(g > 0.0);
            open += 1;
        }
    }
    assert!(loaded >= 3 && open >= 3, "{loaded} loaded, {open} open");
    assert_close(parameters.kn.iter().sum(), 3606e6, ROUNDING, "kn");
    assert_close(parameters.kt.iter().sum(), 2973e6, ROUNDING, "kt");
}

/// A loaded cell with its centre in a neighbouring element loads an element whose own cells are all open; an overlap is not a gap.
#[test]
fn what_is_loaded_has_no_gap() {
    // Cells 1 and 3 of 5 extend over the borders of three elements, with their centres in the outer elements.
    let grid = Grid::over([5e-3, 2e-3], [5, 3]);
    let cells = [[0, 0], [1, 0], [2, 0]];
    let elements = ContactElements::new(grid, [3, 1], &cells).expect("elements");
    let (mut pressure, mut gap) = (vec![0.0; 15], vec![1e-6; 15]);
    pressure[grid.index(1, 1)] = 1e7;
    gap[grid.index(1, 1)] = -1e-7;
    assert_eq!(elements.gaps(&gap), [-1e-7, 1e-6, 1e-6]);
    let parameters =
        ElementParameters::new(&elements, &pressure, &gap, SPRINGS).expect("parameters");
    assert!(parameters.normal_load[1] > 0.0);
    assert_eq!(parameters.normal_load[2], 0.0);
    assert_eq!(parameters.gap, [0.0, 0.0, 1e-6]);
}
