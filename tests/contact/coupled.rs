//! Tests of frictional contact of elastically different bodies, by a dense solution, by closed forms and by the limit without coupling.

use fretwear::contact::coupled::{self, CoupledOptions, CoupledProblem, CoupledSolution};
use fretwear::contact::normal::{self, Control, NormalOptions, NormalProblem};
use fretwear::contact::stiffness::{self, Direction};
use fretwear::contact::tangential::{self, CellState, Drive, TangentialOptions};
use fretwear::contact::{Boundary, ContactError, Elastic, HalfSpace, Pair, Shear};
use fretwear::grid::{ByAxis, Grid, Patch};
use fretwear::reference::elliptic;

use super::coupling::coupling_block;
use super::{distance, influence, limit_of, moved_by, paraboloid, relative_l2, sheared};

/// A body so stiff that its displacement is below the rounding error.
const RIGID: Elastic = Elastic {
    youngs_modulus: 1e22,
    poisson_ratio: 0.3,
};

fn on_rigid(poisson_ratio: f64) -> Pair {
    Pair {
        lower: Elastic {
            youngs_modulus: 70e9,
            poisson_ratio,
        },
        upper: RIGID,
    }
}

/// Tolerances that are below the errors of grid and rounding.
fn tight() -> CoupledOptions {
    CoupledOptions {
        normal: NormalOptions {
            tolerance: 1e-8,
            ..NormalOptions::default()
        },
        tangential: TangentialOptions {
            tolerance: 1e-8,
            ..TangentialOptions::default()
        },
        ..CoupledOptions::default()
    }
}

/// Complete matrix K of a small grid: uncoupled terms from the cell integrals, coupling terms from quadrature of point forces on single
/// bodies. The rows are the opening of the gap and the loss of slip along x and y.
struct Dense {
    grid: Grid,
    blocks: Vec<[[f64; 3]; 3]>,
}

impl Dense {
    fn new(grid: Grid, pair: Pair) -> Self {
        let n = grid.len();
        let mut blocks = Vec::with_capacity(n * n);
        for at in 0..n {
            for from in 0..n {
                let mut block = coupling_block(pair, grid, at, from);
                let alone = influence(pair, grid, at, from).into_iter().flatten();
                let sums = block.as_flattened_mut().iter_mut().zip(alone);
                sums.for_each(|(sum, more)| *sum += more);
                blocks.push(block);
            }
        }
        Dense { grid, blocks }
    }

    /// Tractions (p, q_x, q_y) at a given approach, by relaxation of single cells until no traction changes.
    fn solve(
        &self,
        height: &[f64],
        approach: f64,
        friction: f64,
        previous: &[[f64; 3]],
        displacement: [f64; 2],
    ) -> Vec<[f64; 3]> {
        let n = self.grid.len();
        let mut traction = previous.to_vec();
        for _ in 0..20_000 {
            let mut moved = 0.0f64;
            for at in 0..n {
                let row = &self.blocks[at * n..(at + 1) * n];
                let mut gap = -height[at] - approach;
                let mut slip = displacement;
                for ((block, t), t0) in row.iter().zip(&traction).zip(previous) {
                    for kind in 0..3 {
                        gap += block[0][kind] * t[kind];
                        slip[0] -= block[1][kind] * (t[kind] - t0[kind]);
                        slip[1] -= block[2][kind] * (t[kind] - t0[kind]);
                    }
                }
                let own = &row[at];
                let old = traction[at];
                let p = (old[0] - gap / own[0][0]).max(0.0);
                // Both components have the same step length, so the projection on the friction circle solves the friction law.
                let give = own[1][1].max(own[2][2]);
                let q = [old[1] + slip[0] / give, old[2] + slip[1] / give];
                let part = (friction * p / q[0].hypot(q[1])).min(1.0);
                traction[at] = [p, part * q[0], part * q[1]];
                for kind in 0..3 {
                    moved = moved.max((traction[at][kind] - old[kind]).abs());
                }
            }
            if moved < 1e-5 {
                return traction;
            }
        }
        panic!("the dense solution did not converge");
    }
}

fn interleaved(solution: &CoupledSolution) -> Vec<[f64; 3]> {
    let (p, q) = (&solution.normal.pressure, &solution.tangential.shear);
    (0..p.len()).map(|c| [p[c], q[0][c], q[1][c]]).collect()
}

fn difference(found: &[[f64; 3]], expected: &[[f64; 3]]) -> f64 {
    relative_l2(found.as_flattened(), expected.as_flattened())
}

#[test]
fn a_small_contact_is_its_dense_solution() {
    let grid = Grid {
        nx: 9,
        ny: 7,
        dx: 1.3e-5,
        dy: 1.9e-5,
    };
    let patch = Patch::full(grid);
    let mut height = paraboloid(grid, 0.01, (4e-6, -7e-6));
    for (c, h) in height.iter_mut().enumerate() {
        *h += 3e-9 * (1.3 * c as f64).sin();
    }
    for (pair, friction) in [
        (on_rigid(0.3), 0.15),
        (on_rigid(0.1), 0.6),
        (super::PAIR, 0.3),
    ] {
        let dense = Dense::new(grid, pair);
        let mut half_space = HalfSpace::new(grid, pair, Boundary::Free);
        let mut before = vec![[0.0; 3]; grid.len()];
        let mut last: Option<CoupledSolution> = None;
        let mut slipped = 0;
        // The load increases during the motion, and decreases during the return.
        for (load, displacement) in [
            (0.4, [0.0, 0.0]),
            (0.7, [1.5e-8 * friction, -0.4e-8 * friction]),
            (0.5, [-4e-8 * friction, 1e-8 * friction]),
        ] {
            let problem = CoupledProblem {
                normal: NormalProblem::new(&patch, &height, load),
                friction_coefficient: friction,
                previous: last.as_ref().map(CoupledSolution::tractions),
                drive: &moved_by(&displacement),
                rotation: None,
            };
            let found = coupled::solve(&mut half_space, &problem, None, tight()).unwrap();
            let expected = dense.solve(
                &height,
                found.normal.approach,
                friction,
                &before,
                displacement,
            );
            let error = difference(&interleaved(&found), &expected);
            // The errors of tractions exceed the residuals of the solver by one order of magnitude.
            assert!(error < 1e-5, "friction {friction}, load {load}: {error:e}");
            let closed = expected.iter().filter(|t| t[0] > 0.0).count();
            assert!(closed > 10 && closed < grid.len());
            let count = |s| found.tangential.state.iter().filter(|t| **t == s).count();
            assert_eq!(count(CellState::Stick) + count(CellState::Slip), closed);
            slipped += count(CellState::Slip).min(count(CellState::Stick));
            before = interleaved(&found);
            last = Some(found);
        }
        assert!(
            slipped > 3,
            "the test needs cells in stick and cells in slip"
        );
    }
}

#[test]
fn alike_bodies_are_solved_as_without_coupling() {
    let grid = Grid::over([1.5e-3, 1.1e-3], [30, 23]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.05, (1e-5, 3e-5));
    let pair = Pair::same(super::PAIR.lower);
    let options = CoupledOptions::default();
    let displacement = vec![2e-7, -1e-7];

    let mut half_space = HalfSpace::new(grid, pair, Boundary::Free);
    let (mut p, mut q): (Option<Vec<f64>>, Option<ByAxis<Vec<f64>>>) = (None, None);
    let mut last: Option<CoupledSolution> = None;
    let mut together = HalfSpace::new(grid, pair, Boundary::Free);
    for load in [60.0, 80.0, 50.0] {
        let problem = NormalProblem::new(&patch, &height, load);
        let pressing =
            normal::solve(&mut half_space, &problem, p.as_deref(), options.normal).unwrap();
        let limit = limit_of(0.4, &pressing.pressure);
        let drive = moved_by(&displacement);
        let step = sheared(&patch, &limit, q.as_ref(), &drive);
        let shearing = tangential::solve(&mut half_space, &step, None, options.tangential).unwrap();
        let step = CoupledProblem {
            normal: problem,
            friction_coefficient: 0.4,
            previous: last.as_ref().map(CoupledSolution::tractions),
            drive: &moved_by(&displacement),
            rotation: None,
        };
        let found = coupled::solve(&mut together, &step, None, options).unwrap();
        assert_eq!(found.normal, pressing);
        assert_eq!(found.tangential, shearing);
        (p, q, last) = (Some(pressing.pressure), Some(shearing.shear), Some(found));
    }
    assert_eq!(together.take_pairs(), half_space.take_pairs());
}

#[test]
fn a_bonded_flat_punch_has_its_closed_stiffness() {
    // The normal stiffness without slip is P/δ = 4Ga ln(3 − 4ν)/(1 − 2ν), and without friction 4Ga/(1 − ν) (Mossakovskii 1954, Spence
    // 1968).
    let grid = Grid::over([2.1e-3, 2.1e-3], [45, 51]);
    let radius = 1e-3;
    let kept = (0..grid.len())
        .map(|c| distance(grid, c, (0.0, 0.0)) < radius)
        .collect();
    let patch = Patch {
        grid,
        is_in_joint: kept,
    };
    let height = vec![0.0; grid.len()];
    for nu in [0.0f64, 0.2, 0.4] {
        let mut half_space = HalfSpace::new(grid, on_rigid(nu), Boundary::Free);
        let problem = NormalProblem::new(&patch, &height, 500.0);
        let free =
            normal::solve(&mut half_space, &problem, None, NormalOptions::default()).unwrap();
        let bonded = coupled::indent(
            &mut half_space,
            &problem,
            1e3,
            Shear::InPlane,
            &[500.0],
            CoupledOptions::default(),
            |_| (),
        )
        .unwrap();
        assert!(!bonded.tangential.state.contains(&CellState::Slip));
        let found = free.approach / bonded.normal.approach;
        let expected = (3.0 - 4.0 * nu).ln() * (1.0 - nu) / (1.0 - 2.0 * nu);
        // The oscillating tractions at the rim are one cell wide. The error of the staircase rim cancels in the ratio.
        let effect = (found - 1.0) / (expected - 1.0);
        assert!((effect - 1.0).abs() < 0.05, "{found} for {expected}");

        // Without slip, the contact is linear, so the secants are the stiffnesses. The punch is symmetric, so a shear does not lift the
        // punch.
        let set = &patch.is_in_joint;
        let kn = stiffness::coupled(
            &mut half_space,
            Direction::Normal,
            set,
            set,
            Shear::InPlane,
            stiffness::TOLERANCE,
        )
        .unwrap();
        assert!((kn.total * bonded.normal.approach / bonded.normal.load - 1.0).abs() < 1e-5);
        let kt = stiffness::coupled(
            &mut half_space,
            Direction::AlongX,
            set,
            set,
            Shear::InPlane,
            stiffness::TOLERANCE,
        )
        .unwrap();
        let displacement = vec![1e-7, 0.0];
        let step = CoupledProblem {
            normal: problem,
            friction_coefficient: 1e3,
            previous: Some(bonded.tractions()),
            drive: &moved_by(&displacement),
            rotation: None,
        };
        let moved =
            coupled::solve(&mut half_space, &step, None, CoupledOptions::default()).unwrap();
        let secant = moved.tangential.force[0] / displacement[0];
        assert!((secant / kt.total - 1.0).abs() < 1e-4);
        let alone = stiffness::tangential(&mut half_space, set, Shear::InPlane).unwrap();
        assert!(kt.total > alone.total);
    }
}

#[test]
fn stiffness_of_alike_bodies_is_that_of_the_blocks() {
    let grid = Grid::over([1.0e-3, 0.7e-3], [19, 14]);
    let pressed: Vec<bool> = (0..grid.len()).map(|c| c % 3 != 0).collect();
    let stuck: Vec<bool> = (0..grid.len()).map(|c| c % 4 != 0).collect();
    let mut half_space = HalfSpace::new(grid, Pair::same(super::PAIR.lower), Boundary::Free);
    let kn = stiffness::normal(&mut half_space, &pressed).unwrap();
    let kt = stiffness::tangential(&mut half_space, &stuck, Shear::AlongX).unwrap();
    for (direction, alone) in [(Direction::Normal, &kn), (Direction::AlongX, &kt)] {
        let found = stiffness::coupled(
            &mut half_space,
            direction,
            &pressed,
            &stuck,
            Shear::AlongX,
            stiffness::TOLERANCE,
        )
        .unwrap();
        assert_eq!(found.total, alone.total);
        assert_eq!(found.iterations, alone.iterations);
    }
}

#[test]
fn frictional_hertz_is_self_similar() {
    // The ratio of stick radius and contact radius does not depend on the load (Spence 1975). Without the effect of shear on pressure, the
    // ratio follows from (a/2c) ln((a + c)/(a − c)) = (µ/β) K'(c/a) (Johnson, Contact Mechanics, §5.4), to first order in β.
    let grid = Grid::over([1.0e-3, 0.9e-3], [61, 61]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.05, (0.0, 0.0));
    let pair = on_rigid(0.42);
    let beta = pair.dundurs_beta();
    let ratio = 0.6f64;
    let k = elliptic::complete(1.0 - ratio * ratio).0;
    let friction = beta * ((1.0 + ratio) / (1.0 - ratio)).ln() / (2.0 * ratio * k);
    let radius = 0.4e-3;
    let full = 4.0 * pair.effective_modulus() * f64::powi(radius, 3) / (3.0 * 0.05);
    let steps = 40;
    let loads: Vec<f64> = (1..=steps)
        .map(|k| full * (k as f64 / steps as f64).powi(3))
        .collect();
    let mut half_space = HalfSpace::new(grid, pair, Boundary::Free);
    let mut found = Vec::new();
    let last = coupled::indent(
        &mut half_space,
        &NormalProblem::new(&patch, &height, full),
        friction,
        Shear::InPlane,
        &loads,
        CoupledOptions::default(),
        |s| {
            let count = |t| s.tangential.state.iter().filter(|s| **s == t).count() as f64;
            let stick = count(CellState::Stick);
            found.push((stick / (stick + count(CellState::Slip))).sqrt());
        },
    )
    .unwrap();
    // The tolerance is one cell, with 25 cells per contact radius.
    for ratio_found in &found[steps / 2..] {
        assert!((ratio_found - ratio).abs() < 0.04, "{found:?}");
    }
    // The lower body is more compliant. Pressure moves its surface inwards, and the upper body slips outwards relative to the lower body.
    let mut outward = 0;
    for c in 0..grid.len() {
        if last.tangential.state[c] == CellState::Slip {
            let (i, j) = grid.cell(c);
            let (x, y) = grid.centre(i, j);
            let (slip, shear) = (&last.tangential.slip, &last.tangential.shear);
            assert!(slip[0][c] * x + slip[1][c] * y > 0.0);
            assert!(shear[0][c] * x + shear[1][c] * y > 0.0);
            outward += 1;
        }
    }
    assert!(outward > 100);
    // The resultant shear force is zero by symmetry.
    let load = full * friction;
    assert!(last.tangential.force.iter().all(|f| f.abs() < 1e-6 * load));
}

#[test]
fn bodies_exchanged_are_the_same_contact_seen_from_below() {
    // The rotation about x reverses y and z. The pressure does not change, and the shear changes only in its y component.
    let grid = Grid::over([1.0e-3, 0.7e-3], [33, 24]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.05, (3e-5, -5e-5));
    let mirrored: Vec<f64> = (0..grid.len())
        .map(|c| {
            let (i, j) = grid.cell(c);
            height[grid.index(i, grid.ny - 1 - j)]
        })
        .collect();
    let solve = |pair, height: &[f64], displacement: [f64; 2]| {
        let mut half_space = HalfSpace::new(grid, pair, Boundary::Free);
        let problem = CoupledProblem {
            normal: NormalProblem::new(&patch, height, 40.0),
            friction_coefficient: 0.3,
            previous: None,
            drive: &moved_by(&displacement),
            rotation: None,
        };
        coupled::solve(&mut half_space, &problem, None, tight()).unwrap()
    };
    let pair = on_rigid(0.2);
    let turned = Pair {
        lower: pair.upper,
        upper: pair.lower,
    };
    let above = solve(pair, &height, [5e-8, 2e-8]);
    // The relative motion of the exchanged bodies is opposite, and the rotation reverses its y component again. The shear is opposite, too.
    let below = solve(turned, &mirrored, [-5e-8, 2e-8]);
    for c in 0..grid.len() {
        let (i, j) = grid.cell(c);
        let d = grid.index(i, grid.ny - 1 - j);
        let peak = 1e9;
        assert!((above.normal.pressure[c] - below.normal.pressure[d]).abs() < 1e-6 * peak);
        for (axis, sign) in [(0, -1.0), (1, 1.0)] {
            let (a, b) = (
                above.tangential.shear[axis][c],
                sign * below.tangential.shear[axis][d],
            );
            assert!((a - b).abs() < 1e-4 * peak, "{a:e} {b:e}");
        }
    }
}

#[test]
fn caps_periodic_contacts_and_one_axis_hold_the_joint_conditions() {
    let grid = Grid::over([1.0e-3, 0.7e-3], [36, 27]);
    let patch = Patch::with_hole(grid, 1.5e-4);
    let height: Vec<f64> = (0..grid.len())
        .map(|c| {
            let (i, j) = grid.cell(c);
            2e-7 * ((0.9 * i as f64 + 0.3 * j as f64).sin()
                + (0.5 * i as f64 - 0.7 * j as f64).cos())
        })
        .collect();
    let pair = on_rigid(0.1);
    for (boundary, cap, axes) in [
        (Boundary::Free, Some(2.5e8), 2),
        (Boundary::Periodic, None, 2),
        (Boundary::Periodic, Some(2.5e8), 1),
        (Boundary::Free, None, 1),
    ] {
        let mut half_space = HalfSpace::new(grid, pair, boundary);
        let displacement = vec![3e-8; axes];
        let normal = NormalProblem {
            pressure_cap: cap,
            ..NormalProblem::new(&patch, &height, 5e7 * patch.area())
        };
        let problem = CoupledProblem {
            normal,
            friction_coefficient: 0.4,
            previous: None,
            drive: &moved_by(&displacement),
            rotation: None,
        };
        let found =
            coupled::solve(&mut half_space, &problem, None, CoupledOptions::default()).unwrap();
        let (p, q) = (&found.normal.pressure, &found.tangential.shear);
        let load: f64 = p.iter().sum::<f64>() * grid.cell_area();
        assert!((load / found.normal.load - 1.0).abs() < 1e-12);

        // The test recomputes gap and slip from the tractions.
        let mut opening = vec![0.0; grid.len()];
        let mut from_shear = vec![0.0; grid.len()];
        half_space.normal(p, &mut opening);
        half_space.normal_of_shear(q, &mut from_shear);
        let mut lag = vec![vec![0.0; grid.len()]; axes];
        let mut from_pressure = lag.clone();
        half_space.shear_of_normal(p, &mut from_pressure);
        match (&q[..], &mut lag[..]) {
            ([x], [ux]) => half_space.shear_x(x, ux),
            ([x, y], [ux, uy]) => half_space.shear([x, y], [ux, uy]),
            _ => unreachable!(),
        }
        let peak = p.iter().fold(0.0f64, |m, p| m.max(*p));
        let tolerance = 1.01e-6 * half_space.self_compliance() * peak;
        let (mut gap_of_duality, mut bound, mut capped) = (0.0, 0.0, 0);
        for c in (0..grid.len()).filter(|&c| patch.is_in_joint[c]) {
            let gap = opening[c] + from_shear[c] - height[c] - found.normal.approach;
            assert!((gap - found.normal.gap[c]).abs() < 0.01 * tolerance);
            let is_capped = cap.is_some_and(|cap| p[c] >= cap);
            capped += usize::from(is_capped);
            assert!(p[c] == 0.0 || gap < tolerance, "a loaded cell is open");
            assert!(
                is_capped || gap > -tolerance,
                "a cell overlaps although its pressure is below the cap"
            );
            let size =
                |f: &dyn Fn(usize) -> f64| (0..axes).map(|a| f(a).powi(2)).sum::<f64>().sqrt();
            let slip = |a: usize| displacement[a] - lag[a][c] - from_pressure[a][c];
            let limit = 0.4 * p[c];
            assert!(size(&|a| q[a][c]) <= limit * (1.0 + 1e-9));
            let along: f64 = (0..axes).map(|a| q[a][c] * slip(a)).sum();
            gap_of_duality += limit * size(&slip) - along;
            bound += limit * size(&slip);
        }
        assert_eq!(capped > 0, cap.is_some());
        assert!(
            gap_of_duality < 1.01e-4 * bound,
            "{gap_of_duality:e} of {bound:e}"
        );
    }
}

#[test]
fn forces_lead_to_the_displacements_that_lead_to_them() {
    let grid = Grid::over([1.0e-3, 0.7e-3], [33, 24]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.05, (3e-5, -5e-5));
    let mut half_space = HalfSpace::new(grid, on_rigid(0.2), Boundary::Free);
    let step = CoupledProblem {
        normal: NormalProblem::new(&patch, &height, 40.0),
        friction_coefficient: 0.3,
        previous: None,
        drive: &moved_by(&[8e-8, -3e-8]),
        rotation: Some(Drive::Displacement(2e-4)),
    };
    let given = coupled::solve(&mut half_space, &step, None, tight()).unwrap();
    let drive: Vec<Drive> = given
        .tangential
        .force
        .iter()
        .map(|f| Drive::Force(*f))
        .collect();
    let inverse = CoupledProblem {
        normal: NormalProblem {
            control: Control::Approach(given.normal.approach),
            ..step.normal
        },
        drive: &drive,
        rotation: Some(Drive::Force(given.tangential.moment)),
        ..step
    };
    let found = coupled::solve(&mut half_space, &inverse, None, tight()).unwrap();
    assert!((found.normal.load / 40.0 - 1.0).abs() < 1e-6);
    let moved = &found.tangential.displacement;
    assert!(
        (moved[0] / 8e-8 - 1.0).abs() < 1e-4 && (moved[1] / -3e-8 - 1.0).abs() < 1e-4,
        "{moved:?}"
    );
    assert!((found.tangential.rotation / 2e-4 - 1.0).abs() < 1e-4);
    assert!(difference(&interleaved(&found), &interleaved(&given)) < 1e-4);
}

#[test]
fn what_cannot_be_solved_is_said() {
    let grid = Grid::over([1.0e-3, 0.7e-3], [17, 12]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.05, (0.0, 0.0));
    let mut half_space = HalfSpace::new(grid, on_rigid(0.1), Boundary::Free);
    let displacement = vec![0.0, 0.0];
    let problem = CoupledProblem {
        normal: NormalProblem::new(&patch, &height, 40.0),
        friction_coefficient: 0.5,
        previous: None,
        drive: &moved_by(&displacement),
        rotation: None,
    };
    let mut failure = |problem: CoupledProblem, rounds| {
        let options = CoupledOptions {
            max_rounds: rounds,
            ..CoupledOptions::default()
        };
        coupled::solve(&mut half_space, &problem, None, options).unwrap_err()
    };
    match failure(problem, 1) {
        ContactError::NotConverged {
            problem: "coupled",
            iterations: 1,
            error,
            ..
        } => assert!(error > 1e-6 && error < 1.0),
        other => panic!("{other}"),
    }
    let refused = |e: ContactError| e.to_string();
    let negative = CoupledProblem {
        friction_coefficient: -0.1,
        ..problem
    };
    assert!(refused(failure(negative, 60)).contains("friction coefficient"));
    let short = (vec![0.0; 3], vec![vec![0.0; grid.len()]; 2]);
    let wrong = CoupledProblem {
        previous: Some(coupled::Tractions {
            pressure: &short.0,
            shear: &short.1,
        }),
        ..problem
    };
    assert!(refused(failure(wrong, 60)).contains("pressure before the step has 3"));
    let one_axis = (vec![0.0; grid.len()], vec![vec![0.0; grid.len()]]);
    let wrong = CoupledProblem {
        previous: Some(coupled::Tractions {
            pressure: &one_axis.0,
            shear: &one_axis.1,
        }),
        ..problem
    };
    assert!(refused(failure(wrong, 60)).contains("axes"));
    // Without load, all tractions are zero, whatever their former values.
    let before = (vec![1e8; grid.len()], vec![vec![1e7; grid.len()]; 2]);
    let released = CoupledProblem {
        normal: NormalProblem::new(&patch, &height, 0.0),
        previous: Some(coupled::Tractions {
            pressure: &before.0,
            shear: &before.1,
        }),
        ..problem
    };
    let found =
        coupled::solve(&mut half_space, &released, None, CoupledOptions::default()).unwrap();
    assert!(found.normal.pressure.iter().all(|p| *p == 0.0));
    let top = height.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!((found.normal.approach + top).abs() < 1e-18);
}
