//! Tests of tangential steps at extreme inputs and of many random joints. The tests certify each solution and check the type of each error.
//!
//! The following command runs the tests at full size: `cargo test --release --test main -- --ignored --nocapture contact::sliding`

use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::tangential::{
    self, CellState, Drive, TangentialOptions, TangentialProblem, TangentialSolution,
};
use fretwear::contact::{Boundary, ContactError, HalfSpace, Pair};
use fretwear::grid::{ByAxis, Grid, Patch};

use super::battery::Joint;
use super::certificate::beyond;
use super::extremes::{BOTH, CELLS, GRID, UNITS, apart, in_units_of, rough, rubber_to_diamond};
use super::random::Random;
use super::{PAIR, moved_by, sheared};

/// Bound of the duality gap of a step, with a margin for the different sums of the test.
const DUALITY_GAP: f64 = 1.01e-4;

/// Lower bound of the motion in the certificate, relative to the displacement of one isolated cell under its friction limit.
const LEAST_MOTION: f64 = 1e-8;

/// Rounding error of shears and displacements: twice the allowance of the solver, because the test computes different sums.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Rounding error of the friction limit, relative to the limit.
const LIMIT: f64 = 1e-9;

/// Rounding error of a given force, relative to the largest friction force.
const FORCE: f64 = 1e-9;

/// A pressed joint before its first tangential step.
struct Pressed {
    patch: Patch,
    half_space: HalfSpace,
    limit: Vec<f64>,
    previous: Option<ByAxis<Vec<f64>>>,
}

impl Pressed {
    fn new(patch: &Patch, height: &[f64], load: f64, pair: Pair, boundary: Boundary) -> Pressed {
        let mut half_space = HalfSpace::new(patch.grid, pair, boundary);
        let problem = NormalProblem::new(patch, height, load);
        let found = normal::solve(&mut half_space, &problem, None, NormalOptions::default());
        Pressed {
            patch: patch.clone(),
            half_space,
            limit: found.expect("a converged contact").pressure,
            previous: None,
        }
    }

    fn with_friction(mut self, friction: f64) -> Pressed {
        self.limit.iter_mut().for_each(|l| *l *= friction);
        self
    }

    /// Largest friction force \[N\].
    fn carried(&self) -> f64 {
        self.limit.iter().sum::<f64>() * self.patch.grid.cell_area()
    }

    /// Approximate displacement of gross slip \[m\].
    fn reach(&mut self) -> f64 {
        let mut displacement = vec![0.0; self.limit.len()];
        self.half_space.shear_x(&self.limit, &mut displacement);
        let peak = self.limit.iter().copied().fold(0.0, f64::max);
        let own = peak * self.half_space.self_shear_compliance();
        displacement.into_iter().fold(own, f64::max)
    }

    fn solve(&mut self, drive: &ByAxis<Drive>) -> Result<TangentialSolution, ContactError> {
        let problem = sheared(&self.patch, &self.limit, self.previous.as_ref(), drive);
        let options = TangentialOptions::default();
        tangential::solve(&mut self.half_space, &problem, None, options)
    }

    /// Solves and certifies a step.
    fn step(&mut self, drive: &ByAxis<Drive>) -> Result<TangentialSolution, String> {
        let found = self
            .solve(drive)
            .map_err(|error| format!("{drive:?}: {error}"))?;
        self.certify(drive, &found)
            .map_err(|fault| format!("{drive:?}: {fault}"))?;
        Ok(found)
    }

    /// Checks that shears are within their friction limits, that the duality gap of the recomputed slip is within its bound, and that the
    /// solution has the given forces.
    fn certify(&mut self, drive: &ByAxis<Drive>, found: &TangentialSolution) -> Result<(), String> {
        let axes = drive.len();
        let mut change = found.shear.clone();
        if let Some(previous) = &self.previous {
            for (field, before) in change.iter_mut().zip(previous) {
                field.iter_mut().zip(before).for_each(|(q, q0)| *q -= q0);
            }
        }
        let mut moved = vec![vec![0.0; self.limit.len()]; axes];
        match &mut moved[..] {
            [x] => self.half_space.shear_x(&change[0], x),
            [x, y] => self.half_space.shear([&change[0], &change[1]], [x, y]),
            _ => unreachable!(),
        }
        let size = |v: &[f64]| v.iter().fold(0.0f64, |a, b| a.hypot(*b));
        let (mut gap, mut bound, mut reach) = (0.0, 0.0, size(&found.displacement));
        let mut done = 0.0;
        for (c, &limit) in self.limit.iter().enumerate() {
            let slip: Vec<f64> = (0..axes)
                .map(|a| found.displacement[a] - moved[a][c])
                .collect();
            let shear: Vec<f64> = (0..axes).map(|a| found.shear[a][c]).collect();
            let work: f64 = shear.iter().zip(&slip).map(|(q, s)| q * s).sum();
            if size(&shear) > limit * (1.0 + LIMIT) {
                return Err(format!("cell {c}: a shear of {shear:?}, at most {limit:e}"));
            }
            if (found.state[c] == CellState::Open) != (limit == 0.0) {
                return Err(format!("cell {c} is {:?} under {limit:e}", found.state[c]));
            }
            let told = found.slip.iter().map(|slip| slip[c]);
            match found.state[c] {
                CellState::Stick if told.into_iter().any(|slip| slip != 0.0) => {
                    return Err(format!("cell {c} sticks and slips"));
                }
                CellState::Slip if beyond(-work, 0.0) => {
                    return Err(format!("cell {c} is driven by friction"));
                }
                _ => (),
            }
            done += work;
            gap += limit * size(&slip) - work;
            bound += limit * size(&slip);
            reach = (0..axes).fold(reach, |reach, a| reach.max(moved[a][c].abs()));
        }
        let sum: f64 = self.limit.iter().sum();
        let own = self.half_space.self_shear_compliance();
        let peak = self.limit.iter().copied().fold(0.0, f64::max);
        let before = self.previous.iter().flatten().flatten();
        let largest = before.fold(peak, |peak, q| peak.max(q.abs()));
        // If nearly all cells stick, the duality gap is relative to a ten-thousandth of the work of gross slip.
        let floor = 1e-4 * sum * reach.max(LEAST_MOTION * own * peak);
        let allowed = DUALITY_GAP * bound.max(floor) + ROUNDING * own * largest * sum;
        if beyond(gap, allowed) {
            return Err(format!(
                "a duality gap of {gap:e} of {bound:e}, {allowed:e} allowed"
            ));
        }
        let area = self.patch.grid.cell_area();
        // The solver must not neglect more work of slip than the certificate allows.
        let dropped = (found.dissipation / area - done).abs();
        if beyond(dropped, allowed) {
            return Err(format!(
                "the dissipation neglects {dropped:e} of the work of friction"
            ));
        }
        for (axis, drive) in drive.iter().enumerate() {
            let sum = found.shear[axis].iter().sum::<f64>() * area;
            let asked = match drive {
                Drive::Displacement(increment) if found.displacement[axis] != *increment => {
                    return Err(format!("moved by {}", found.displacement[axis]));
                }
                Drive::Displacement(_) => sum,
                Drive::Force(force) => *force,
            };
            for told in [asked, found.force[axis]] {
                if beyond((sum - told).abs(), FORCE * self.carried()) {
                    return Err(format!("a force of {sum:e}, told or asked for {told:e}"));
                }
            }
        }
        Ok(())
    }
}

/// Direction of the motion: along x, or neither along an axis nor along a diagonal.
fn towards(stroke: f64, axes: usize) -> ByAxis<Drive> {
    moved_by(&[0.8 * stroke, -0.6 * stroke][..axes])
}

#[test]
fn from_a_nanometre_to_a_millimetre_with_and_without_friction() {
    let patch = Patch::full(GRID);
    for boundary in BOTH {
        for rq in [1e-9, 1e-7, 1e-5, 1e-3] {
            let height = rough(GRID, 5, rq);
            for load in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
                for friction in [0.0, 0.3, 5.0] {
                    for axes in [1, 2] {
                        let mut joint = Pressed::new(&patch, &height, load, PAIR, boundary)
                            .with_friction(friction);
                        let reach = joint.reach();
                        let about =
                            format!("{boundary:?} Rq {rq:e} {load:e} N µ {friction} {axes} axes");
                        // The motion consists of a forward step, a longer forward step, a short return and a long return.
                        for part in [1e-6, 0.3, -1e-3, -30.0] {
                            // Without friction, the problem has no length scale, and the test moves by 1 µm.
                            let stroke = part * if friction > 0.0 { reach } else { 1e-6 };
                            // In full contact of a periodic joint, only the unevenness of the friction limits resists a uniform motion. The
                            // solver may reject a motion far below the displacement of gross slip.
                            let complete = joint.limit.iter().all(|l| *l > 0.0);
                            if part.abs() < 0.1 && boundary == Boundary::Periodic && complete {
                                match joint.solve(&towards(stroke, axes)) {
                                    Err(ContactError::NotConverged { .. }) => continue,
                                    other => {
                                        other.unwrap_or_else(|error| panic!("{about}: {error}"))
                                    }
                                };
                            }
                            let found = joint
                                .step(&towards(stroke, axes))
                                .unwrap_or_else(|fault| panic!("{about} {part}: {fault}"));
                            let full = (found.force[0].hypot(*found.force.get(1).unwrap_or(&0.0))
                                / load
                                - friction)
                                .abs();
                            assert!(
                                part != -30.0 || full <= DUALITY_GAP * friction,
                                "{about}: {full:e}"
                            );
                            joint.previous = Some(found.shear);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn grids_of_every_awkward_shape() {
    for (nx, ny) in [
        (1, 1),
        (1, 2),
        (2, 2),
        (3, 1),
        (1, 64),
        (101, 1),
        (2, 61),
        (31, 37),
        (3, 128),
    ] {
        for (dx, dy) in CELLS {
            let grid = Grid { nx, ny, dx, dy };
            let patch = Patch::full(grid);
            let height = rough(grid, 2, 1e-7);
            for boundary in BOTH {
                for pressure in [1e4, 1e7, 1e9] {
                    for axes in [1, 2] {
                        let load = pressure * patch.area();
                        let mut joint =
                            Pressed::new(&patch, &height, load, PAIR, boundary).with_friction(0.4);
                        let reach = joint.reach();
                        let about = format!("{grid:?} {boundary:?} {pressure:e} Pa {axes} axes");
                        for part in [0.2, 0.7, -1.1] {
                            let found = joint
                                .step(&towards(part * reach, axes))
                                .unwrap_or_else(|fault| panic!("{about} {part}: {fault}"));
                            joint.previous = Some(found.shear);
                        }
                    }
                }
            }
        }
    }
}

/// One cell sticks up to δ = µp k; until then, its shear is proportional to the displacement.
#[test]
fn one_cell_sticks_and_slides() {
    let grid = Grid {
        nx: 1,
        ny: 1,
        ..GRID
    };
    let patch = Patch::full(grid);
    let mut joint = Pressed::new(&patch, &[0.0], 1.0, PAIR, Boundary::Free).with_friction(0.5);
    let mut own = [0.0];
    joint.half_space.shear_x(&[1.0], &mut own);
    let full = joint.limit[0] * own[0];
    for part in [1e-9, 0.5, 0.999, 1.001, 1e6] {
        let found = joint.step(&vec![Drive::Displacement(part * full)]).unwrap();
        let expected = joint.limit[0] * f64::min(part, 1.0);
        assert!((found.shear[0][0] / expected - 1.0).abs() < 1e-9, "{part}");
        let slip = full * (part - 1.0).max(0.0);
        assert!((found.slip[0][0] - slip).abs() <= 1e-9 * slip, "{part}");
    }
}

#[test]
fn from_rubber_to_diamond() {
    let patch = Patch::with_hole(GRID, 8e-4);
    let height = rough(GRID, 7, 2e-7);
    for pair in rubber_to_diamond() {
        for boundary in BOTH {
            for load in [1e-3, 1.0, 1e3] {
                let mut joint =
                    Pressed::new(&patch, &height, load, pair, boundary).with_friction(0.8);
                let reach = joint.reach();
                for (part, axes) in [(0.3, 1), (0.3, 2), (5.0, 2)] {
                    joint
                        .step(&towards(part * reach, axes))
                        .unwrap_or_else(|fault| panic!("{pair:?} {boundary:?} {load}: {fault}"));
                }
            }
        }
    }
}

#[test]
fn forces_up_to_what_friction_carries_and_beyond_it() {
    let patch = Patch::full(GRID);
    for boundary in BOTH {
        for (rq, load) in [(1e-9, 1.0), (1e-7, 100.0), (1e-5, 1e3), (1e-3, 1e-3)] {
            let height = rough(GRID, 9, rq);
            for friction in [0.01, 5.0] {
                let mut joint =
                    Pressed::new(&patch, &height, load, PAIR, boundary).with_friction(friction);
                let carried = joint.carried();
                for share in [0.0, 1e-9, 1e-3, 0.5, 0.99, 0.9999] {
                    for drive in [
                        vec![Drive::Force(share * carried)],
                        vec![
                            Drive::Force(0.6 * share * carried),
                            Drive::Force(-0.8 * share * carried),
                        ],
                        vec![Drive::Force(-share * carried), Drive::Displacement(0.0)],
                    ] {
                        joint.step(&drive).unwrap_or_else(|fault| {
                            panic!("{boundary:?} Rq {rq:e} µ {friction}: {fault}")
                        });
                    }
                }
                let beyond = vec![Drive::Force(1.0001 * carried)];
                match joint.solve(&beyond) {
                    Err(ContactError::FrictionExceeded { asked, limit, .. }) => {
                        assert!((asked / (1.0001 * carried) - 1.0).abs() < FORCE);
                        assert!(
                            (limit / carried - 1.0).abs() < 1e-6,
                            "{limit:e} {carried:e}"
                        );
                    }
                    other => panic!("{boundary:?} Rq {rq:e} µ {friction}: {other:?}"),
                }
            }
        }
    }
}

#[test]
fn input_without_sense_is_named() {
    let patch = Patch::full(GRID);
    let limit = vec![1e6; GRID.len()];
    let drive = towards(1e-7, 2);
    let good = sheared(&patch, &limit, None, &drive);
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
    let mut refused = |problem: &TangentialProblem| {
        tangential::solve(&mut half_space, problem, None, TangentialOptions::default()).unwrap_err()
    };
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut spoilt = limit.clone();
        // The error names the first wrong cell.
        for (i, j) in [(20, 3), (4, 16), (4, 5)] {
            spoilt[GRID.index(i, j)] = wrong;
        }
        let fields = vec![limit.clone(), spoilt.clone()];
        for (name, problem) in [
            (
                "friction limit",
                TangentialProblem {
                    limit: &spoilt,
                    ..good
                },
            ),
            (
                "shear before the step",
                TangentialProblem {
                    previous: Some(&fields),
                    ..good
                },
            ),
            (
                "offset",
                TangentialProblem {
                    offset: Some(&fields),
                    ..good
                },
            ),
        ] {
            match refused(&problem) {
                ContactError::NotFinite {
                    field,
                    i: 4,
                    j: 5,
                    value,
                } => {
                    assert_eq!((field, value.to_bits()), (name, wrong.to_bits()));
                }
                other => panic!("{name}: {other:?}"),
            }
        }
        for drive in [Drive::Displacement(wrong), Drive::Force(wrong)] {
            let drive = vec![Drive::Displacement(0.0), drive];
            let error = refused(&TangentialProblem {
                drive: &drive,
                ..good
            });
            assert!(matches!(error, ContactError::OutOfRange { .. }), "{error}");
        }
    }
    let mut negative = limit.clone();
    negative[7] = -1.0;
    let error = refused(&TangentialProblem {
        limit: &negative,
        ..good
    });
    assert!(matches!(
        error,
        ContactError::OutOfRange {
            name: "friction limit",
            value: -1.0,
            ..
        }
    ));
}

/// A solution does not depend on the units: metres and pascals, millimetres and megapascals, and powers of two.
#[test]
fn units_do_not_matter() {
    let height = rough(GRID, 12, 1e-7);
    let solved = |length: f64, modulus: f64, axes: usize| {
        let grid = Grid {
            dx: GRID.dx * length,
            dy: GRID.dy * length,
            ..GRID
        };
        let scaled: Vec<f64> = height.iter().map(|h| h * length).collect();
        let pair = in_units_of(modulus);
        let load = 10.0 * modulus * length * length;
        let patch = Patch::full(grid);
        let mut joint =
            Pressed::new(&patch, &scaled, load, pair, Boundary::Free).with_friction(0.4);
        let reach = joint.reach();
        joint.step(&towards(0.4 * reach, axes)).unwrap()
    };
    for axes in [1, 2] {
        let metres = solved(1.0, 1.0, axes);
        for (length, modulus) in UNITS {
            let found = solved(length, modulus, axes);
            let shear = metres.shear[0].iter().map(|q| q * modulus);
            // Pressures differ by their tolerance, and shears by the square root of the tolerance.
            let off = apart(&found.shear[0], shear);
            assert!(off < 1e-3, "{length:e} {modulus:e}: {off:e}");
            let work = metres.dissipation * modulus * length.powi(3);
            assert!((found.dissipation / work - 1.0).abs() < 1e-3);
        }
    }
}

/// Certifies successive steps of random joints, and returns the median and the largest number of FFT pairs per axis.
fn battery(joints: u64, cells: f64) -> (f64, f64) {
    let (mut faults, mut costs) = (Vec::new(), Vec::new());
    for seed in 0..joints {
        let joint = Joint::random(seed, cells);
        let mut random = Random::new(!seed);
        let friction = random.between(0.1, 1.0);
        let axes = if random.chance(0.3) { 1 } else { 2 };
        let about = format!("{}, µ {friction:.2}, {axes} axes", joint.about);
        let mut pressed = match joint.pressed() {
            Ok((half_space, pressure)) => Pressed {
                patch: joint.patch.clone(),
                half_space,
                limit: pressure,
                previous: None,
            }
            .with_friction(friction),
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        // The test skips periodic joints in full contact, because only uneven friction limits resist their motion.
        let periodic = pressed.half_space.boundary() == Boundary::Periodic;
        if periodic && pressed.limit.iter().all(|l| *l > 0.0) {
            continue;
        }
        let full = pressed.limit.clone();
        for step in 0..3 {
            let reach = pressed.reach();
            let angle = random.between(0.0, std::f64::consts::TAU);
            let along = [angle.cos(), angle.sin()];
            let drive: ByAxis<Drive> = if random.chance(0.3) {
                let share = random.between(0.0, 0.95) * pressed.carried();
                along[..axes]
                    .iter()
                    .map(|a| Drive::Force(a * share))
                    .collect()
            } else {
                let stroke = random.decades(0.02, 3.0) * reach;
                moved_by(&along.map(|a| a * stroke)[..axes])
            };
            pressed.half_space.take_pairs();
            match pressed.solve(&drive) {
                Ok(found) => {
                    let pairs = pressed.half_space.take_pairs() / axes as f64;
                    costs.push((pairs, format!("step {step} of {about} {drive:?}")));
                    if let Err(fault) = pressed.certify(&drive, &found) {
                        faults.push(format!("step {step} of {about}: {fault}"));
                    }
                    pressed.previous = Some(found.shear);
                }
                Err(error) => faults.push(format!("step {step} of {about} {drive:?}: {error}")),
            }
            // The load changes before the next step; the solver reduces shears to their new friction limits.
            let load = random.between(0.5, 1.5);
            pressed.limit = full.iter().map(|l| load * l).collect();
        }
    }
    assert!(
        faults.is_empty(),
        "{} steps:\n{}",
        faults.len(),
        faults.join("\n")
    );
    costs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (median, worst) = (costs[costs.len() / 2].0, costs[costs.len() - 1].0);
    println!(
        "{} steps of joints of about {cells} cells per side: {median:.1} FFT pairs per axis, median",
        costs.len()
    );
    for (cost, about) in costs.iter().rev().take(5) {
        println!("{cost:7.1}  {about}");
    }
    (median, worst)
}

/// The bounds have a margin for different rounding, as in `battery`.
#[test]
fn steps_of_small_joints() {
    let (median, worst) = battery(100, 30.0);
    assert!(median < 60.0, "{median}");
    assert!(worst < 400.0, "{worst}");
}

#[test]
#[ignore = "long: some minutes"]
fn steps_of_full_size() {
    let (median, worst) = battery(200, 256.0);
    assert!(median < 120.0, "{median}");
    assert!(worst < 1000.0, "{worst}");
}

#[test]
#[ignore = "long: a minute and 1.5 GB"]
fn four_million_cells() {
    let grid = Grid::over([40e-3, 30e-3], [2048, 2048]);
    let patch = Patch::full(grid);
    let mut random = Random::new(1);
    let height = super::battery::waves(grid, &mut random, 5e-6, [0.5e-3, 0.4e-3]);
    let mut joint = Pressed::new(&patch, &height, 30e3, PAIR, Boundary::Free).with_friction(0.6);
    let reach = joint.reach();
    joint.half_space.take_pairs();
    let begin = std::time::Instant::now();
    let drive = towards(0.3 * reach, 2);
    let found = joint.solve(&drive).unwrap();
    println!(
        "{:?}, {:.1} FFT pairs",
        begin.elapsed(),
        joint.half_space.take_pairs()
    );
    joint.certify(&drive, &found).unwrap();
}
