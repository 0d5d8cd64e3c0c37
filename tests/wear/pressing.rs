//! Contact with elastic bodies of a structure, against dense matrices and against contact without a structure.

use std::sync::Arc;

use fretwear::contact::nodes::{Interpolation, NodalCompliance};
use fretwear::contact::normal::{NormalOptions, Rotation};
use fretwear::contact::tangential::TangentialOptions;
use fretwear::contact::{Boundary, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};
use fretwear::linalg::Matrix;
use fretwear::wear::cycle::March;
use fretwear::wear::joint::FrettingOptions;
use fretwear::wear::{BodyMotions, FrettingJoint, Motion, NodalLoad, PressedBodies};

use super::STEEL;

const COUNTS: [usize; 2] = [3, 2];

fn grid() -> Grid {
    Grid::over([9e-3, 5.6e-3], [9, 7])
}

fn joint(height: Vec<f64>, load: f64) -> FrettingJoint {
    let grid = grid();
    FrettingJoint {
        half_space: HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free),
        patch: Patch::full(grid),
        height,
        pressing: None,
        rotation: Rotation::FIXED,
        pressure_cap: None,
        friction_coefficient: 0.5,
        motion: Motion::at_rest(load),
        evolving_motion: None,
        march: March::Reversal,
        options: FrettingOptions {
            normal: NormalOptions {
                tolerance: 1e-10,
                ..NormalOptions::default()
            },
            tangential: TangentialOptions::default(),
            cycle_tolerance: 1e-3,
            extrapolate: false,
            least_extrapolated: FrettingOptions::LEAST_EXTRAPOLATED,
            checks_per_span: FrettingOptions::CHECKS_PER_SPAN,
        },
    }
}

/// Compliance between the nodes \[m/N\]: positive definite, without a symmetry of the grid, `size` times the compliance of the half space.
fn compliance(size: f64) -> Arc<NodalCompliance> {
    let interpolation = Interpolation::new(grid(), COUNTS);
    let nodes = interpolation.nodes();
    let root = |a: usize, b: usize| ((a * 7 + b * 3) as f64).sin();
    let entry = |a: usize, b: usize| (0..nodes).map(|k| root(a, k) * root(b, k)).sum::<f64>();
    let normal = (0..nodes * nodes).map(|k| size * 1e-9 * entry(k / nodes, k % nodes));
    Arc::new(NodalCompliance {
        interpolation: interpolation.into(),
        normal: normal.collect(),
        shear: None,
    })
}

/// Two loads: one closes the nodes by the amounts `by` \[m\] and has the given resultants, the other is 0.
fn closing(by: impl Fn(usize) -> f64, nodes: usize, resultants: Vec<f64>) -> [NodalLoad; 2] {
    let none = resultants.iter().map(|_| 0.0).collect();
    [
        NodalLoad {
            opening: (0..nodes).map(|n| -by(n)).collect(),
            resultants,
            work: [0.0; 2],
        },
        NodalLoad {
            opening: vec![0.0; nodes],
            resultants: none,
            work: [0.0; 2],
        },
    ]
}

/// Pressure of flat faces in full contact, from the dense matrix of half spaces, nodes and restrained motions.
fn dense(added: &NodalCompliance, bodies: &BodyMotions, opening: &[f64]) -> Vec<f64> {
    let grid = grid();
    let cells = grid.len();
    let mut half_space = HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free);
    half_space
        .set_nodal(Some(Arc::new(added.clone())))
        .expect("nodes");
    let field = |k: usize, c: usize| {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        let [a, about_x, about_y] = bodies.restrained[k];
        a + about_x * y - about_y * x
    };
    let held = bodies.restrained.len();
    let columns: Vec<Vec<f64>> = (0..cells)
        .map(|c| {
            let (mut unit, mut out) = (vec![0.0; cells], vec![0.0; cells]);
            unit[c] = 1.0;
            half_space.normal(&unit, &mut out);
            for (row, out) in out.iter_mut().enumerate() {
                for k in 0..held {
                    for m in 0..held {
                        *out += field(k, row)
                            * bodies.compliance[k * held + m]
                            * field(m, c)
                            * grid.cell_area();
                    }
                }
            }
            out
        })
        .collect();
    let matrix = Matrix::from_fn(cells, cells, |i, j| 0.5 * (columns[j][i] + columns[i][j]));
    let factor = matrix.cholesky().expect("a compliance");
    let mut pressure = Matrix::from_fn(cells, 1, |c, _| -opening[c]);
    factor.solve_lower(&mut pressure);
    factor.solve_lower_transposed(&mut pressure);
    pressure.column(0).to_vec()
}

fn off(found: &[f64], expected: &[f64]) -> f64 {
    let peak = expected.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    let pairs = found.iter().zip(expected);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / peak
}

#[test]
fn held_bodies_press_as_their_dense_matrix_says() {
    let added = compliance(0.02);
    let nodes = added.interpolation.nodes();
    for softness in [1e-11, 1e-9, 1e-6] {
        let bodies = BodyMotions {
            free: Vec::new(),
            restrained: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            compliance: [1.0, 20.0, -10.0, 20.0, 2e5, 3e3, -10.0, 3e3, 1e5]
                .map(|c| c * softness)
                .to_vec(),
        };
        // The closing exceeds the deformation of the bodies, so the faces touch everywhere.
        let by = 1e-6 * (1.0 + softness / 1e-10);
        let loads = closing(|_| by, nodes, Vec::new());
        let mut opening = vec![0.0; grid().len()];
        added
            .interpolation
            .add_interpolated(1.0, &loads[0].opening, &mut opening);
        let expected = dense(&added, &bodies, &opening);
        assert!(
            expected.iter().all(|p| *p > 0.0),
            "{softness}: contact is everywhere"
        );
        let mut joint = joint(vec![0.0; grid().len()], 1.0);
        let mut pressing = PressedBodies::new(added.clone(), bodies, loads, 0.0);
        pressing.preload = 1.0;
        joint.pressing = Some(pressing);
        let found = joint
            .static_contact(&vec![0.0; grid().len()], None)
            .expect("a contact");
        let off = off(&found.pressure, &expected);
        assert!(off < 1e-7, "{softness}: {off}");
    }
}

/// A structure as stiff as its mesh on half spaces acts as a punch: it adds no compliance, and the contact bears the load.
#[test]
fn bodies_without_a_compliance_of_their_own_are_punches() {
    let cells = grid().len();
    let height: Vec<f64> = (0..cells)
        .map(|c| 1e-6 * ((c * 37 % 17) as f64 / 17.0))
        .collect();
    let wear: Vec<f64> = (0..cells).map(|c| 1e-7 * (c % 3) as f64).collect();
    let load = 2e3;
    let added = compliance(0.0);
    let nodes = added.interpolation.nodes();
    for turns in [false, true] {
        let mut punch = joint(height.clone(), load);
        let mut bodies = BodyMotions::default();
        bodies.free.push([1.0, 0.0, 0.0]);
        let mut resultants = vec![load];
        if turns {
            punch.rotation = Rotation::Free {
                moment: [0.1, -0.2],
            };
            bodies.free.extend([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
            resultants.extend([0.1, -0.2]);
        }
        let expected = punch.static_contact(&wear, None).expect("a contact");
        let mut joint = joint(height.clone(), load);
        let mut pressing = PressedBodies::new(
            added.clone(),
            bodies,
            closing(|_| 0.0, nodes, resultants),
            0.0,
        );
        pressing.preload = 1.0;
        joint.pressing = Some(pressing);
        let found = joint.static_contact(&wear, None).expect("a contact");
        assert!(off(&found.pressure, &expected.pressure) < 1e-8);
        assert!((found.approach - expected.approach).abs() < 1e-9 * height[1].abs().max(1e-6));
        assert!((found.load / load - 1.0).abs() < 1e-9);
        // Half the preload factor gives half the load.
        joint.pressing.as_mut().expect("a structure").preload = 0.5;
        let half = joint.static_contact(&wear, None).expect("a contact");
        assert!((2.0 * half.load / load - 1.0).abs() < 1e-9);
    }
}

/// The solver tightens a bolt of the structure until the joint bears its load, although a part of the bolt force goes elsewhere.
#[test]
fn a_bolt_is_tightened_until_the_joint_bears_its_load() {
    let added = compliance(0.02);
    let nodes = added.interpolation.nodes();
    let bodies = BodyMotions {
        free: Vec::new(),
        restrained: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        compliance: vec![2e-9, 0.0, 0.0, 0.0, 3e-4, 0.0, 0.0, 0.0, 3e-4],
    };
    let height: Vec<f64> = (0..grid().len())
        .map(|c| 1e-6 * ((c * 37 % 17) as f64 / 17.0))
        .collect();
    let mut joint = joint(height, 0.0);
    let loads = closing(|_| 1e-9, nodes, Vec::new());
    joint.pressing = Some(PressedBodies::new(added, bodies, loads, 1e-6));
    let found = joint.tighten_bolt(500.0).expect("a bolt");
    assert!((found.load / 500.0 - 1.0).abs() < 1e-6, "{}", found.load);
    let preload = joint.pressing.as_ref().expect("a structure").preload;
    assert!(preload > 600.0, "{preload}");
}
