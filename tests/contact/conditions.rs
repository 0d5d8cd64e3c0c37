//! The conditions of contact and friction on rough surfaces, cell by cell, for whatever surface and load come.

use fretwear::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use fretwear::contact::tangential::{self, CellState, Drive, TangentialOptions, TangentialProblem};
use fretwear::contact::{Boundary, ContactError, HalfSpace, Pair};
use fretwear::grid::{ByAxis, Grid, Patch};
use fretwear::reference::CircularPunch;
use proptest::prelude::*;

use super::PAIR;

const GRID: Grid = Grid {
    nx: 21,
    ny: 16,
    dx: 1.1e-4,
    dy: 1.6e-4,
};

/// What the tangential solver promises of every step.
const DUALITY_GAP: f64 = 1e-4;

/// Heights of a few random waves of a few cells and longer: as rough as the grid resolves.
fn rough(seed: u64, rq: f64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let waves: Vec<[f64; 4]> = (0..24)
        .map(|_| {
            [
                random() * 2.0,
                (random() - 0.5) * 4.0,
                random() * 6.3,
                random(),
            ]
        })
        .collect();
    let mut height: Vec<f64> = (0..GRID.len())
        .map(|index| {
            let (i, j) = GRID.cell(index);
            waves
                .iter()
                .map(|[kx, ky, phase, size]| size * (kx * i as f64 + ky * j as f64 + phase).sin())
                .sum()
        })
        .collect();
    let mean = height.iter().sum::<f64>() / height.len() as f64;
    let square = height.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / height.len() as f64;
    height
        .iter_mut()
        .for_each(|h| *h = (*h - mean) * rq / square.sqrt());
    height
}

/// The displacement of one cell alone: the scale of the solver's error.
fn scale(pair: Pair, solution: &NormalSolution) -> f64 {
    let peak = solution.pressure.iter().copied().fold(0.0, f64::max);
    HalfSpace::new(GRID, pair, Boundary::Free).self_compliance() * peak
}

#[derive(Debug, Clone)]
struct Case {
    seed: u64,
    rq: f64,
    mean_pressure: f64,
    cap: Option<f64>,
    hole: bool,
    periodic: bool,
}

impl Case {
    fn patch(&self) -> Patch {
        if self.hole {
            Patch::with_hole(GRID, 8.0e-4)
        } else {
            Patch::full(GRID)
        }
    }

    fn boundary(&self) -> Boundary {
        if self.periodic {
            Boundary::Periodic
        } else {
            Boundary::Free
        }
    }
}

fn cases() -> impl Strategy<Value = Case> {
    (
        any::<u64>(),
        -7.5..-5.0f64,
        6.0..8.3f64,
        prop::option::of(0.1..1.0f64),
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(|(seed, rq, pressure, cap, hole, periodic)| {
            let mean_pressure = 10f64.powf(pressure);
            // A cap from just above the mean pressure to ten times it.
            let cap = cap.map(|share| mean_pressure / share);
            Case {
                seed,
                rq: 10f64.powf(rq),
                mean_pressure,
                cap,
                hole,
                periodic,
            }
        })
}

fn solve(
    case: &Case,
    patch: &Patch,
    half_space: &mut HalfSpace,
) -> Result<NormalSolution, ContactError> {
    let height = rough(case.seed, case.rq);
    let load = case.mean_pressure * patch.area();
    let problem = NormalProblem {
        patch,
        height: &height,
        compliance: None,
        control: Control::Load(load),
        rotation: Rotation::FIXED,
        pressure_cap: case.cap,
    };
    normal::solve(half_space, &problem, None, NormalOptions::default())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn normal_conditions_hold_on_every_cell(case in cases()) {
        let patch = case.patch();
        let mut half_space = HalfSpace::new(GRID, PAIR, case.boundary());
        let found = solve(&case, &patch, &mut half_space).unwrap();
        let cap = case.cap.unwrap_or(f64::INFINITY);
        let load = found.pressure.iter().sum::<f64>() * GRID.cell_area();
        prop_assert!((load / (case.mean_pressure * patch.area()) - 1.0).abs() < 1e-10);
        let slack = 2e-6 * scale(PAIR, &found);
        // The gap anew from the pressure, not as the solver reports it.
        let mut displacement = vec![0.0; GRID.len()];
        half_space.normal(&found.pressure, &mut displacement);
        let height = rough(case.seed, case.rq);
        for c in 0..GRID.len() {
            let p = found.pressure[c];
            if !patch.kept[c] {
                prop_assert_eq!(p, 0.0);
                prop_assert_eq!(found.gap[c], 0.0);
                continue;
            }
            let gap = displacement[c] - height[c] - found.approach;
            prop_assert!((gap - found.gap[c]).abs() <= slack, "cell {}: {:e} reported {:e}", c, gap, found.gap[c]);
            prop_assert!((0.0..=cap).contains(&p), "cell {c}: {p:e}");
            prop_assert!(p >= cap || gap >= -slack, "cell {c} penetrates by {gap:e}");
            prop_assert!(p == 0.0 || gap <= slack, "cell {c} is loaded at a gap of {gap:e}");
        }
    }

    #[test]
    fn friction_holds_on_every_cell_from_stick_to_sliding(
        case in cases(),
        axes in 1..=2usize,
        strokes in prop::collection::vec((-2.5..1.2f64, 0.0..6.3f64), 1..4),
    ) {
        let patch = case.patch();
        let mut half_space = HalfSpace::new(GRID, PAIR, case.boundary());
        let pressure = solve(&case, &patch, &mut half_space).unwrap().pressure;
        let limit: Vec<f64> = pressure.iter().map(|p| 0.6 * p).collect();
        // As stiff as a punch of its area: the scale of the motion, whatever the shape of the contact.
        let area = limit.iter().filter(|l| **l > 0.0).count() as f64 * GRID.cell_area();
        let kt = CircularPunch { radius: (area / std::f64::consts::PI).sqrt(), pair: PAIR }.tangential_stiffness();
        let sliding = limit.iter().sum::<f64>() * GRID.cell_area() / kt;
        let mut previous: Option<ByAxis<Vec<f64>>> = None;
        for (size, angle) in strokes {
            // From 0.003 to 16 times the displacement at which a stuck contact would reach its limit.
            let stroke = 10f64.powf(size) * sliding;
            let displacement: ByAxis<f64> =
                if axes == 1 { vec![stroke * f64::cos(angle).signum()] } else { vec![stroke * f64::cos(angle), stroke * f64::sin(angle)] };
            let drive = displacement.iter().map(|d| Drive::Displacement(*d)).collect();
            let problem = TangentialProblem { patch: &patch, limit: &limit, previous: previous.as_ref(), drive: &drive, rotation: None, offset: None };
            let found = tangential::solve(&mut half_space, &problem, None, TangentialOptions::default()).unwrap();

            // Slip anew from the change of shear.
            let mut change = found.shear.clone();
            if let Some(previous) = &previous {
                for (field, before) in change.iter_mut().zip(previous) {
                    field.iter_mut().zip(before).for_each(|(q, q0)| *q -= q0);
                }
            }
            let mut moved = vec![vec![0.0; GRID.len()]; axes];
            match &mut moved[..] {
                [x] => half_space.shear_x(&change[0], x),
                [x, y] => half_space.shear([&change[0], &change[1]], [x, y]),
                _ => unreachable!(),
            }
            let (mut gap, mut bound, mut dissipation, mut reach) = (0.0, 0.0, 0.0, 0.0f64);
            for c in 0..GRID.len() {
                let slip: Vec<f64> = (0..axes).map(|a| displacement[a] - moved[a][c]).collect();
                let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                let shear: Vec<f64> = (0..axes).map(|a| found.shear[a][c]).collect();
                let work: f64 = shear.iter().zip(&slip).map(|(q, s)| q * s).sum();
                prop_assert!(size(&shear) <= limit[c] * (1.0 + 1e-9), "cell {c} is beyond its limit");
                gap += limit[c] * size(&slip) - work;
                bound += limit[c] * size(&slip);
                dissipation += work * GRID.cell_area();
                reach = reach.max((0..axes).map(|a| moved[a][c].abs()).fold(0.0, f64::max));
                match found.state[c] {
                    CellState::Open => prop_assert!(limit[c] == 0.0 && size(&shear) == 0.0),
                    CellState::Stick => prop_assert!(found.slip.iter().all(|s| s[c] == 0.0)),
                    CellState::Slip => prop_assert!(work > 0.0, "cell {c} is driven by friction"),
                }
            }
            // Where nearly everything sticks the relative gap has the floor of a ten-thousandth of gross slip.
            let floor = 1e-4 * limit.iter().sum::<f64>() * stroke.abs().max(reach);
            prop_assert!(gap <= 1.01 * DUALITY_GAP * bound.max(floor), "gap {:e} of {bound:e}", gap / bound.max(floor));
            // What is reported is what the certificate is about: no slip is taken as none beyond it.
            let dropped = (found.dissipation - dissipation).abs() / GRID.cell_area();
            prop_assert!(dropped <= 1.01 * DUALITY_GAP * bound.max(floor), "dropped {:e}", dropped / bound.max(floor));
            previous = Some(found.shear);
        }
    }
}

#[test]
fn a_masked_bump_is_not_there() {
    let patch = Patch::with_hole(GRID, 8.0e-4);
    let case = Case {
        seed: 5,
        rq: 1e-6,
        mean_pressure: 2e7,
        cap: None,
        hole: true,
        periodic: false,
    };
    let load = case.mean_pressure * patch.area();
    let plain = rough(case.seed, case.rq);
    let mut bumped = plain.clone();
    for c in (0..GRID.len()).filter(|&c| !patch.kept[c]) {
        bumped[c] = if c % 2 == 0 { 1.0 } else { f64::NAN };
    }
    let solve = |height: &[f64]| {
        let problem = NormalProblem {
            patch: &patch,
            height,
            compliance: None,
            control: Control::Load(load),
            rotation: Rotation::FIXED,
            pressure_cap: None,
        };
        let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
        normal::solve(&mut half_space, &problem, None, NormalOptions::default()).unwrap()
    };
    assert_eq!(solve(&plain), solve(&bumped));
    assert!(patch.cells() < GRID.len());
}

#[test]
fn diagonal_compliance_adds_to_the_gap() {
    // The implicit wear step's problem: the gap of a loaded cell is K p + D p − h − δ = 0.
    let patch = Patch::full(GRID);
    let height = rough(11, 2e-6);
    let compliance: Vec<f64> = (0..GRID.len())
        .map(|c| {
            if c % 3 == 0 {
                0.0
            } else {
                3e-14 * (c % 7) as f64
            }
        })
        .collect();
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
    let load = 4e7 * patch.area();
    let problem = NormalProblem {
        patch: &patch,
        height: &height,
        compliance: Some(&compliance),
        control: Control::Load(load),
        rotation: Rotation::FIXED,
        pressure_cap: None,
    };
    let found = normal::solve(&mut half_space, &problem, None, NormalOptions::default()).unwrap();
    let worn: Vec<f64> = (0..GRID.len())
        .map(|c| height[c] - compliance[c] * found.pressure[c])
        .collect();
    // Without D, on the heights worn by it, the same pressure must come out.
    let again = NormalProblem {
        height: &worn,
        compliance: None,
        ..problem
    };
    let expected = normal::solve(&mut half_space, &again, None, NormalOptions::default()).unwrap();
    assert!(super::relative_l2(&found.pressure, &expected.pressure) < 1e-5);
    assert!((found.approach - expected.approach).abs() < 1e-5 * found.approach.abs());
}

#[test]
fn wrong_input_is_refused_by_name() {
    let patch = Patch::full(GRID);
    let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
    let height = vec![0.0; GRID.len()];
    let good = NormalProblem {
        patch: &patch,
        height: &height,
        compliance: None,
        control: Control::Load(1.0),
        rotation: Rotation::FIXED,
        pressure_cap: None,
    };
    let mut refused = |problem: NormalProblem| {
        normal::solve(&mut half_space, &problem, None, NormalOptions::default())
            .unwrap_err()
            .to_string()
    };
    let mut spoilt = height.clone();
    spoilt[GRID.index(4, 9)] = f64::NAN;
    assert!(
        refused(NormalProblem {
            height: &spoilt,
            ..good
        })
        .contains("(4, 9)")
    );
    assert!(
        refused(NormalProblem {
            height: &height[1..],
            ..good
        })
        .contains("335")
    );
    assert!(
        refused(NormalProblem {
            control: Control::Load(-1.0),
            ..good
        })
        .contains("load")
    );
    assert!(
        refused(NormalProblem {
            control: Control::Load(f64::NAN),
            ..good
        })
        .contains("load")
    );
    assert!(
        refused(NormalProblem {
            pressure_cap: Some(0.0),
            ..good
        })
        .contains("pressure cap")
    );
}
