//! Tests of normal contact at extreme inputs. The tests certify each solution by direct sums and check the type of each error.

use fretwear::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use fretwear::contact::{Boundary, ContactError, Elastic, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};

use super::PAIR;
use super::certificate::{Direct, certify};
use super::random::Random;

pub const GRID: Grid = Grid {
    nx: 23,
    ny: 17,
    dx: 1.1e-4,
    dy: 1.6e-4,
};

/// Bound of the gap error: the solver's bound, plus the same amount for the different sums of the test.
const GAP: f64 = 2e-6;

/// Bound of the pressure error at the gap error `GAP`, relative to the largest pressure, for contact spots of about ten cells.
const PRESSURE: f64 = 1e-4;

/// Rounding error of a contact with a closed solution.
const EXACT: f64 = 1e-9;

/// Rounding error between solutions in different units.
const SCALED: f64 = 1e-9;

/// Uncorrelated heights with the given root mean square.
pub fn rough(grid: Grid, seed: u64, rq: f64) -> Vec<f64> {
    let mut random = Random::new(seed);
    (0..grid.len()).map(|_| rq * random.normal()).collect()
}

fn solve(
    problem: &NormalProblem,
    pair: Pair,
    boundary: Boundary,
) -> Result<NormalSolution, ContactError> {
    let mut half_space = HalfSpace::new(problem.patch.grid, pair, boundary);
    normal::solve(&mut half_space, problem, None, NormalOptions::default())
}

/// Solves a problem and certifies the solution.
fn certified(problem: &NormalProblem, pair: Pair, boundary: Boundary) -> NormalSolution {
    let about = || {
        format!(
            "{:?} {:?} {boundary:?} {pair:?}",
            problem.control, problem.patch.grid
        )
    };
    let found =
        solve(problem, pair, boundary).unwrap_or_else(|error| panic!("{error}: {}", about()));
    let direct = Direct::new(problem.patch.grid, pair, boundary);
    let displacement = direct.displacement(&found.pressure);
    certify(problem, &found, &displacement, direct.own(), GAP)
        .unwrap_or_else(|fault| panic!("{fault}: {}", about()));
    found
}

fn touching(found: &NormalSolution) -> usize {
    found.pressure.iter().filter(|p| **p > 0.0).count()
}

/// Largest difference, relative to the largest expected value.
pub fn apart(found: &[f64], expected: impl Iterator<Item = f64>) -> f64 {
    let (mut difference, mut largest) = (0.0f64, 0.0f64);
    for (a, b) in found.iter().zip(expected) {
        difference = difference.max((a - b).abs());
        largest = largest.max(b.abs());
    }
    difference / largest
}

pub const BOTH: [Boundary; 2] = [Boundary::Free, Boundary::Periodic];

/// Cell sizes: nearly square, and fifty times as long as wide \[m\].
pub const CELLS: [(f64, f64); 3] = [(1e-4, 1.3e-4), (1e-5, 5e-4), (5e-4, 1e-5)];

/// Units of length and pressure, relative to metre and pascal: millimetres and megapascals, powers of two, and others.
pub const UNITS: [(f64, f64); 5] = [
    (1e3, 1e-6),
    (1e6, 1e-12),
    (1e9, 1.0),
    (1e-9, 1e9),
    // These units are 2²⁰ and 2⁻³⁰.
    (1_048_576.0, 1.0 / 1_073_741_824.0),
];

/// The bodies with moduli in another unit of pressure.
pub fn in_units_of(modulus: f64) -> Pair {
    let body = |m: Elastic| Elastic {
        youngs_modulus: m.youngs_modulus * modulus,
        ..m
    };
    Pair {
        lower: body(PAIR.lower),
        upper: body(PAIR.upper),
    }
}

/// Pairs of two soft bodies, two hard bodies, a soft and a hard body, and two bodies with a Poisson's ratio of 0.
pub fn rubber_to_diamond() -> [Pair; 4] {
    let body = |youngs_modulus: f64, poisson_ratio: f64| Elastic {
        youngs_modulus,
        poisson_ratio,
    };
    let (rubber, diamond) = (body(1e6, 0.4999), body(1.2e12, 0.07));
    [
        Pair::same(rubber),
        Pair::same(diamond),
        Pair {
            lower: rubber,
            upper: diamond,
        },
        Pair::same(body(70e9, 0.0)),
    ]
}

#[test]
fn from_a_nanometre_to_a_millimetre_over_twelve_decades_of_load() {
    let patch = Patch::full(GRID);
    for boundary in BOTH {
        for rq in (-9..=-3).map(|e| 10f64.powi(e)) {
            let height = rough(GRID, 5, rq);
            let mut before = 0;
            for load in (-6..=6).map(|e| 10f64.powi(e)) {
                let found = certified(&NormalProblem::new(&patch, &height, load), PAIR, boundary);
                // A larger load does not reduce the number of cells in contact.
                assert!(touching(&found) >= before, "Rq {rq:e} m, {load:e} N");
                before = touching(&found);
            }
            assert!(before > 0);
        }
    }
}

#[test]
fn full_contact_of_a_periodic_wave_and_just_less() {
    let patch = Patch::full(GRID);
    let wave =
        |index: usize| (std::f64::consts::TAU * GRID.cell(index).0 as f64 / GRID.nx as f64).cos();
    let amplitude = 1e-6;
    let height: Vec<f64> = (0..GRID.len()).map(|c| amplitude * wave(c)).collect();
    // The pressure is p = p̄ + π E* Δ/λ cos kx, with full contact if p̄ closes the trough [K. L. Johnson, Contact Mechanics, eq. 13.7].
    let swing = std::f64::consts::PI * PAIR.effective_modulus() * amplitude / GRID.size()[0];
    // With an odd number of cells, the centre of the deepest cell is not exactly in the trough.
    let trough = (0..GRID.len()).map(wave).fold(1.0, f64::min);
    let complete = -swing * trough * patch.area();
    for share in [1.0 + 1e-6, 1.5, 1e3] {
        let found = certified(
            &NormalProblem::new(&patch, &height, share * complete),
            PAIR,
            Boundary::Periodic,
        );
        assert_eq!(touching(&found), GRID.len(), "{share}");
        let mean = share * complete / patch.area();
        let expected = (0..GRID.len()).map(|c| mean + swing * wave(c));
        assert!(apart(&found.pressure, expected) < PRESSURE);
        assert!((found.approach / amplitude).abs() < GAP * share);
    }
    let less = NormalProblem::new(&patch, &height, 0.98 * complete);
    let found = certified(&less, PAIR, Boundary::Periodic);
    // The open part of the trough is one cell wide, or two cells wide if the cells are symmetric about the trough.
    let open = GRID.len() - touching(&found);
    assert!(open == 2 * GRID.ny || open == GRID.ny, "{open}");
}

#[test]
fn full_and_nearly_full_contact_with_free_edges() {
    let patch = Patch::full(GRID);
    let height = rough(GRID, 8, 1e-9);
    for load in [2e2, 2e3, 1e4, 1e6] {
        let found = certified(
            &NormalProblem::new(&patch, &height, load),
            PAIR,
            Boundary::Free,
        );
        let expected = if load >= 1e4 {
            GRID.len()
        } else {
            GRID.len() / 2
        };
        assert!(touching(&found) >= expected, "{load}: {}", touching(&found));
    }
}

#[test]
fn a_flat_surface_at_any_height() {
    let patch = Patch::full(GRID);
    let reference = certified(
        &NormalProblem::new(&patch, &vec![0.0; GRID.len()], 10.0),
        PAIR,
        Boundary::Free,
    );
    for level in [-1e-3, -1e-9, 1e-9, 1e-3] {
        let height = vec![level; GRID.len()];
        let found = certified(
            &NormalProblem::new(&patch, &height, 10.0),
            PAIR,
            Boundary::Free,
        );
        assert_eq!(touching(&found), GRID.len());
        assert!(apart(&found.pressure, reference.pressure.iter().copied()) < PRESSURE);
        // The offset of 1 mm reduces the accuracy of the approach by rounding.
        let approach = found.approach + level;
        assert!(
            (approach / reference.approach - 1.0).abs()
                < GAP + 1e-15 * level.abs() / reference.approach
        );
        let found = certified(
            &NormalProblem::new(&patch, &height, 10.0),
            PAIR,
            Boundary::Periodic,
        );
        let uniform = std::iter::repeat_n(10.0 / patch.area(), GRID.len());
        assert!(apart(&found.pressure, uniform) < EXACT);
    }
}

#[test]
fn one_cell_in_contact_and_none() {
    let patch = Patch::full(GRID);
    let mut height = rough(GRID, 3, 1e-9);
    let top = GRID.index(19, 4);
    height[top] = 1e-6;
    for boundary in BOTH {
        let problem = NormalProblem::new(&patch, &height, 1e-4);
        let found = certified(&problem, PAIR, boundary);
        assert_eq!(touching(&found), 1);
        let pressure = 1e-4 / GRID.cell_area();
        assert!((found.pressure[top] / pressure - 1.0).abs() < EXACT);
        let own = Direct::new(GRID, PAIR, boundary).displacement(&found.pressure)[top];
        assert!((found.approach - (own - 1e-6)).abs() < GAP * own);

        let found = certified(&NormalProblem::new(&patch, &height, 0.0), PAIR, boundary);
        assert_eq!((touching(&found), found.approach), (0, -1e-6));
        // The bodies are far apart, or just do not touch.
        for approach in [-1.0, -1.0001e-6] {
            let apart = NormalProblem {
                control: Control::Approach(approach),
                ..problem
            };
            let found = certified(&apart, PAIR, boundary);
            assert_eq!((touching(&found), found.load), (0, 0.0));
        }
    }
}

#[test]
fn bodies_that_turn_until_the_load_is_where_it_acts() {
    let patch = Patch::full(GRID);
    for (rq, load) in [(1e-8, 1.0), (1e-7, 100.0), (1e-5, 1e3), (1e-9, 1e5)] {
        let height = rough(GRID, 9, rq);
        // The load acts at the centre or near the edge of the joint.
        for share in [0.0, 0.1, 0.3] {
            let [lx, ly] = GRID.size();
            let problem = NormalProblem {
                rotation: Rotation::Free {
                    moment: [share * load * ly, -0.5 * share * load * lx],
                },
                ..NormalProblem::new(&patch, &height, load)
            };
            certified(&problem, PAIR, Boundary::Free);
        }
    }
}

#[test]
fn a_cap_below_at_and_above_the_mean_pressure() {
    let patch = Patch::with_hole(GRID, 8e-4);
    let height = rough(GRID, 4, 1e-7);
    let (load, mean) = (500.0, 500.0 / patch.area());
    for boundary in BOTH {
        let capped = |cap: f64| NormalProblem {
            pressure_cap: Some(cap),
            ..NormalProblem::new(&patch, &height, load)
        };
        match solve(&capped(0.999 * mean), PAIR, boundary) {
            Err(ContactError::CapExceeded {
                load: asked,
                capacity,
                cells,
                ..
            }) => {
                assert_eq!((asked, cells), (load, patch.cells()));
                assert!((capacity / (0.999 * load) - 1.0).abs() < EXACT);
            }
            other => panic!("{other:?}"),
        }
        // The smallest cap for which the rounded product of cap and area is at least the load.
        let just = mean * (1.0 + 4.0 * f64::EPSILON);
        let found = certified(&capped(just), PAIR, boundary);
        assert_eq!(touching(&found), patch.cells());
        let kept = (0..GRID.len()).filter(|&c| patch.is_in_joint[c]);
        assert!(
            kept.map(|c| found.pressure[c])
                .all(|p| (p / just - 1.0).abs() < EXACT)
        );
        for factor in [1.0 + 1e-9, 1.0 + 1e-3, 1.5, 10.0, 1e6] {
            certified(&capped(factor * mean), PAIR, boundary);
        }
    }
}

#[test]
fn grids_of_every_awkward_shape() {
    let shapes = [
        (1, 1),
        (1, 2),
        (2, 1),
        (2, 2),
        (1, 3),
        (1, 64),
        (101, 1),
        (2, 61),
        (31, 37),
        (53, 2),
        (3, 128),
        (40, 7),
    ];
    for (nx, ny) in shapes {
        for (dx, dy) in CELLS {
            let grid = Grid { nx, ny, dx, dy };
            let patch = Patch::full(grid);
            let height = rough(grid, 2, 1e-7);
            for boundary in BOTH {
                for pressure in [1e4, 1e7, 1e9] {
                    let problem = NormalProblem::new(&patch, &height, pressure * patch.area());
                    certified(&problem, PAIR, boundary);
                    let capped = NormalProblem {
                        pressure_cap: Some(1.2 * pressure),
                        ..problem
                    };
                    certified(&capped, PAIR, boundary);
                }
            }
        }
    }
}

#[test]
fn from_rubber_to_diamond() {
    let patch = Patch::full(GRID);
    let height = rough(GRID, 7, 2e-7);
    for pair in rubber_to_diamond() {
        for boundary in BOTH {
            for load in [1e-3, 1.0, 1e3] {
                certified(&NormalProblem::new(&patch, &height, load), pair, boundary);
            }
        }
    }
}

#[test]
fn masks_that_leave_one_cell_islands_or_nothing() {
    let height = rough(GRID, 11, 1e-7);
    let masks: [fn(usize, usize) -> bool; 4] = [
        |i, j| (i, j) == (22, 0),
        // The masks are four corners, a chequerboard and one line.
        |i, j| !(3..=19).contains(&i) && !(3..=13).contains(&j),
        |i, j| (i + j) % 2 == 0,
        |_, j| j == 8,
    ];
    for kept in masks {
        let mut patch = Patch::full(GRID);
        for c in 0..GRID.len() {
            let (i, j) = GRID.cell(c);
            patch.is_in_joint[c] = kept(i, j);
        }
        // The solver does not read heights outside the joint.
        let mut height = height.clone();
        for (c, h) in height
            .iter_mut()
            .enumerate()
            .filter(|(c, _)| !patch.is_in_joint[*c])
        {
            *h = if c % 2 == 0 { 1.0 } else { f64::NAN };
        }
        for boundary in BOTH {
            for load in [1e-3, 1.0, 1e3] {
                certified(&NormalProblem::new(&patch, &height, load), PAIR, boundary);
            }
        }
    }
    let mut nothing = Patch::full(GRID);
    nothing.is_in_joint.fill(false);
    let refused = solve(
        &NormalProblem::new(&nothing, &height, 1.0),
        PAIR,
        Boundary::Free,
    );
    assert!(matches!(
        refused,
        Err(ContactError::OutOfRange {
            name: "number of kept cells",
            ..
        })
    ));
}

/// Problem of an implicit wear step: the gap of a loaded cell is K p + D p − h − δ = 0.
#[test]
fn a_compliance_of_each_cell() {
    let patch = Patch::full(GRID);
    let height = rough(GRID, 11, 2e-6);
    let compliance: Vec<f64> = (0..GRID.len())
        .map(|c| f64::from(u8::from(c % 3 != 0)) * 3e-14 * (c % 7) as f64)
        .collect();
    for boundary in BOTH {
        for pressure in [4e5, 4e7, 1e9] {
            let problem = NormalProblem {
                compliance: Some(&compliance),
                ..NormalProblem::new(&patch, &height, pressure * patch.area())
            };
            certified(&problem, PAIR, boundary);
        }
    }
}

#[test]
fn input_without_sense_is_named() {
    let patch = Patch::full(GRID);
    let height = rough(GRID, 1, 1e-7);
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut height = height.clone();
        // The error names the first wrong cell.
        for (i, j) in [(20, 3), (4, 16), (4, 5)] {
            height[GRID.index(i, j)] = wrong;
        }
        match solve(
            &NormalProblem::new(&patch, &height, 1.0),
            PAIR,
            Boundary::Free,
        ) {
            Err(ContactError::NotFinite {
                field: "height",
                i: 4,
                j: 5,
                value,
            }) => assert_eq!(value.to_bits(), wrong.to_bits()),
            other => panic!("{wrong}: {other:?}"),
        }
        for control in [Control::Load(wrong), Control::Approach(wrong)] {
            let problem = NormalProblem {
                control,
                ..NormalProblem::new(&patch, &height[..], 1.0)
            };
            assert!(solve(&problem, PAIR, Boundary::Free).is_err());
        }
    }
    let good = NormalProblem::new(&patch, &height, 1.0);
    let short = NormalProblem::new(&patch, &height[1..], 1.0);
    let negative = NormalProblem::new(&patch, &height, -1.0);
    let capped = NormalProblem {
        pressure_cap: Some(0.0),
        ..good
    };
    for (problem, said) in [(short, "390"), (negative, "load"), (capped, "pressure cap")] {
        let error = solve(&problem, PAIR, Boundary::Free).unwrap_err();
        assert!(error.to_string().contains(said), "{said}: {error}");
    }
}

/// A solution does not depend on the units: metres and pascals, millimetres and megapascals, and powers of two.
#[test]
fn units_do_not_matter() {
    for (rq, load, cap) in [
        (1e-8, 1.0, None),
        (1e-6, 300.0, None),
        (1e-6, 300.0, Some(6e8)),
    ] {
        let height = rough(GRID, 12, rq);
        let solved = |length: f64, modulus: f64| {
            let grid = Grid {
                dx: GRID.dx * length,
                dy: GRID.dy * length,
                ..GRID
            };
            let patch = Patch::full(grid);
            let scaled: Vec<f64> = height.iter().map(|h| h * length).collect();
            let pair = in_units_of(modulus);
            let problem = NormalProblem {
                pressure_cap: cap.map(|cap| cap * modulus),
                ..NormalProblem::new(&patch, &scaled, load * modulus * length * length)
            };
            certified(&problem, pair, Boundary::Free)
        };
        let metres = solved(1.0, 1.0);
        for (length, modulus) in UNITS {
            let found = solved(length, modulus);
            let pressure = metres.pressure.iter().map(|p| p * modulus);
            assert!(
                apart(&found.pressure, pressure) < SCALED,
                "{length:e} {modulus:e}"
            );
            assert!((found.approach / (metres.approach * length) - 1.0).abs() < SCALED);
            assert_eq!(
                found.iterations, metres.iterations,
                "{length:e} {modulus:e}"
            );
        }
    }
}

/// The following command runs this test: `cargo test --release --test main -- --ignored contact::extremes`
#[test]
#[ignore = "long: some seconds and 600 MB"]
fn four_million_cells() {
    let grid = Grid::over([40e-3, 30e-3], [2048, 2048]);
    let patch = Patch::full(grid);
    let mut random = Random::new(1);
    let height = super::battery::waves(grid, &mut random, 5e-6, [0.5e-3, 0.4e-3]);
    let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Free);
    let problem = NormalProblem::new(&patch, &height, 30e3);
    let begin = std::time::Instant::now();
    let found = normal::solve(&mut half_space, &problem, None, NormalOptions::default()).unwrap();
    println!(
        "{:?}, {:.1} FFT pairs",
        begin.elapsed(),
        half_space.take_pairs()
    );
    let mut displacement = vec![0.0; grid.len()];
    half_space.normal(&found.pressure, &mut displacement);
    certify(
        &problem,
        &found,
        &displacement,
        half_space.self_compliance(),
        GAP,
    )
    .unwrap();
}
