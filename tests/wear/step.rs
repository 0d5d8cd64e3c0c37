use fretwear::wear::cycle::March;
use fretwear::wear::explicit;
use fretwear::wear::implicit::{Limits, advance, first_proposal};
use fretwear::wear::joint::WornState;
use fretwear::wear::{FrettingJoint, Motion, WearError, WearLaw};

use super::{
    COEFFICIENT, LAW, LOAD, after, difference_l1, joint, step_of, unworn, wear_by_equal_steps,
};

/// Expected order of a second-order scheme. The band bounds the error of a fit over a few halvings.
const ORDER: f64 = 2.0;
const ORDER_BAND: f64 = 0.3;
/// Rounding error of sums over fields.
const ROUNDING: f64 = 1e-12;

fn reversal(amplitude: f64) -> FrettingJoint {
    joint(
        Motion::harmonic(&[(amplitude, 0.0), (0.0, 0.0)], LOAD, 0.0, 16),
        March::Reversal,
    )
}

/// Wears the unworn joint by `cycles` with error control. Returns the state and the number of steps.
fn wear(
    joint: &mut FrettingJoint,
    law: WearLaw,
    tolerance: f64,
    cycles: u64,
) -> Result<(WornState, u64), WearError> {
    let mut state = unworn(joint);
    let mut proposal = first_proposal(joint, &state, law);
    let (mut done, mut steps) = (0, 0);
    while done < cycles {
        let limits = Limits {
            tolerance,
            depth_step: None,
            remaining: cycles - done,
            safety: Limits::SAFETY,
        };
        let step = advance(joint, &state, law, proposal, limits)?;
        (done, proposal, steps) = (done + step.cycles, step.proposal, steps + 1);
        state = after(joint, step);
    }
    assert_eq!(done, cycles);
    Ok((state, steps))
}

/// Amplitudes in partial and gross slip, each with a number of cycles far into the running-in.
const CASES: [(f64, u64); 2] = [(0.35e-6, 1_600_000), (3e-6, 160_000)];

#[test]
fn the_implicit_step_is_of_second_order() {
    for (amplitude, cycles) in CASES {
        let mut joint = reversal(amplitude);
        let steps = [4, 8, 16, 32];
        let fields: Vec<_> = steps
            .iter()
            .map(|&n| wear_by_equal_steps(&mut joint, cycles, n).0.wear)
            .collect();
        let differences: Vec<f64> = fields
            .windows(2)
            .map(|w| difference_l1(&w[0], &w[1]))
            .collect();
        let order = (differences[0] / differences[2]).log2() / 2.0;
        assert!(
            (order - ORDER).abs() <= ORDER_BAND,
            "amplitude {amplitude}: order {order:.2}, differences {differences:?}"
        );
    }
}

#[test]
fn the_embedded_error_is_of_the_size_of_the_true_one() {
    for (amplitude, cycles) in CASES {
        let mut joint = reversal(amplitude);
        let (truth, _) = wear_by_equal_steps(&mut joint, cycles, 64);
        let (coarse, estimate) = wear_by_equal_steps(&mut joint, cycles, 8);
        let error = difference_l1(&coarse.wear, &truth.wear);
        let estimate = estimate / joint.volume(&coarse.wear);
        // The estimate sets the step by its square root, so a small factor is acceptable.
        assert!(
            estimate > error / 4.0 && estimate < error * 6.0,
            "amplitude {amplitude}: {estimate:.2e} for {error:.2e}"
        );
    }
}

#[test]
fn controlled_steps_land_on_the_cycles_within_the_tolerance() {
    for (amplitude, cycles) in CASES {
        let mut joint = reversal(amplitude);
        let (truth, _) = wear_by_equal_steps(&mut joint, cycles, 64);
        for tolerance in [0.03, 0.003] {
            let (state, _) = wear(&mut joint, LAW, tolerance, cycles).expect("wear steps");
            let error = difference_l1(&state.wear, &truth.wear);
            assert!(
                error < 2.0 * tolerance,
                "amplitude {amplitude}, tolerance {tolerance}: error {error:.2e}"
            );
        }
    }
}

#[test]
fn only_cells_that_slipped_in_contact_are_touched() {
    let mut joint = reversal(CASES[0].0);
    let state = unworn(&mut joint);
    let step = step_of(&mut joint, &state, 200_000);
    let worn: Vec<bool> = step.wear.iter().map(|&w| w > 0.0).collect();
    let next = after(&mut joint, step.clone());
    let mut counts = [0; 2];
    for c in 0..worn.len() {
        assert!(step.wear[c] >= 0.0);
        let touched = state.pressure[c] > 0.0 || next.pressure[c] > 0.0;
        let slipped = state.cycle.slip_path[c] > 0.0 || next.cycle.slip_path[c] > 0.0;
        counts[usize::from(worn[c])] += 1;
        assert!(
            !worn[c] || (touched && slipped),
            "cell {c} wore by {} without slip in contact",
            step.wear[c]
        );
    }
    assert!(
        counts.iter().all(|&n| n > 20),
        "untouched and worn cells: {counts:?}"
    );
}

#[test]
fn the_step_wears_what_it_dissipates() {
    // A very short step changes nothing and wears N α E_d of the cycle at its beginning.
    for (amplitude, _) in CASES {
        let mut joint = reversal(amplitude);
        let state = unworn(&mut joint);
        let step = step_of(&mut joint, &state, 4);
        let ratio = joint.volume(&step.wear) / (4.0 * COEFFICIENT * state.cycle.dissipation);
        // Four of about 10⁵ cycles change the rate by about 1e-4.
        assert!((ratio - 1.0).abs() < 1e-3, "amplitude {amplitude}: {ratio}");
    }
}

#[test]
fn the_local_wear_sums_to_the_global_one() {
    // V = α Σ E_d [A eq. 2.5] against the sum of [A eq. 2.6] over the cells.
    let mut joint = reversal(CASES[1].0);
    let state = unworn(&mut joint);
    let wear = explicit::advance(&state.wear, &state.cycle.energy, LAW, 1000);
    let ratio = joint.volume(&wear) / (1000.0 * COEFFICIENT * state.cycle.dissipation);
    assert!((ratio - 1.0).abs() < ROUNDING);
}

#[test]
fn the_explicit_step_takes_whole_cycles_up_to_its_depth() {
    assert_eq!(explicit::cycles(0.1e-6, 3e-12), 33_333);
    assert_eq!(explicit::cycles(0.1e-6, 0.2e-6), 1);
    assert_eq!(explicit::cycles(0.1e-6, 0.0), u64::MAX);
}

#[test]
fn short_explicit_steps_and_the_implicit_step_agree() {
    let (amplitude, cycles) = (CASES[1].0, 20_000);
    let mut joint = reversal(amplitude);
    let (reference, _) = wear_by_equal_steps(&mut joint, cycles, 16);
    let mut errors = Vec::new();
    for steps in [20, 40] {
        let mut state = unworn(&mut joint);
        for _ in 0..steps {
            let wear = explicit::advance(&state.wear, &state.cycle.energy, LAW, cycles / steps);
            let contact = joint
                .static_contact(&wear, Some(&state.pressure))
                .expect("static contact");
            let cycle = joint
                .cycle(&wear, &contact, Some(&state.cycle.shear))
                .expect("cycle");
            state = WornState {
                wear,
                pressure: contact.pressure,
                cycle,
            };
        }
        errors.push(difference_l1(&state.wear, &reference.wear));
    }
    // The published step is of first order: half the step halves the difference.
    let order = (errors[0] / errors[1]).log2();
    assert!(
        (order - 1.0).abs() <= ORDER_BAND,
        "order {order:.2}, errors {errors:?}"
    );
}

#[test]
fn a_depth_step_caps_the_implicit_step() {
    let mut joint = reversal(CASES[1].0);
    let state = unworn(&mut joint);
    let limits = Limits {
        tolerance: 0.5,
        depth_step: Some(0.02e-6),
        remaining: u64::MAX,
        safety: Limits::SAFETY,
    };
    let step = advance(&mut joint, &state, LAW, 1e9, limits).expect("wear step");
    let deepest = step.wear.iter().fold(0.0f64, |m, w| m.max(*w));
    assert!(deepest <= 0.02e-6, "deepest wear {deepest}");
    assert!(step.cycles > 1);
}

#[test]
fn a_changing_load_wears_cells_that_the_mean_load_does_not_touch() {
    let motion = Motion::harmonic(&[(3e-6, 0.5)], LOAD, 0.5 * LOAD, 16);
    let mut joint = joint(motion, March::Stepped);
    let state = unworn(&mut joint);
    let step = step_of(&mut joint, &state, 100);
    let outside = (0..step.wear.len())
        .filter(|&c| state.pressure[c] == 0.0 && step.wear[c] > 0.0)
        .count();
    assert!(
        outside > 5,
        "{outside} cells outside the static contact wore"
    );
    let ratio = joint.volume(&step.wear) / (100.0 * COEFFICIENT * state.cycle.dissipation);
    assert!((ratio - 1.0).abs() < 1e-2, "wear against energy: {ratio}");
}

/// Cells that touch only under the largest load wear equally in few long steps and in many short steps. An explicit wear of cells without
/// pressure under the mean load would be 9 % larger.
#[test]
fn cells_that_touch_for_a_part_of_the_cycle_wear_alike_in_long_steps() {
    const CYCLES: u64 = 8_000_000;
    const OFF: f64 = 0.03;
    let worn = |steps: u64| {
        let motion = Motion::harmonic(&[(1e-6, 0.5)], LOAD, 0.5 * LOAD, 16);
        let mut joint = joint(motion, March::Stepped);
        joint.options.cycle_tolerance = 1e-3;
        joint.options.tangential.tolerance = 1e-3;
        let (state, _) = wear_by_equal_steps(&mut joint, CYCLES, steps);
        joint.volume(&state.wear)
    };
    let off = worn(3) / worn(48) - 1.0;
    assert!(off.abs() < OFF, "off by {off:e}");
}

#[test]
fn steps_of_any_size_stay_finite_and_positive() {
    for cycles in [0, 3, 6, 9, 12].map(|decade| 10_u64.pow(decade)) {
        let mut joint = reversal(CASES[1].0);
        let state = unworn(&mut joint);
        let step = step_of(&mut joint, &state, cycles);
        assert!(
            step.wear.iter().all(|w| w.is_finite() && *w >= 0.0),
            "{cycles} cycles"
        );
        assert!(step.error.is_finite());
    }
}

/// The worn volume depends only on the wear coefficient times the number of cycles, over 15 decades. The solver returns the same volume, or
/// an error if a single cycle is too long a step.
#[test]
fn coefficient_times_cycles_decides_or_a_single_cycle_is_refused() {
    const CYCLES: f64 = 1e8;
    let worn = |factor: f64| -> Result<f64, WearError> {
        let law = WearLaw {
            coefficient: COEFFICIENT * factor,
        };
        let cycles = (CYCLES / factor).round().max(1.0) as u64;
        let mut joint = reversal(CASES[1].0);
        let (state, _) = wear(&mut joint, law, 0.015, cycles)?;
        Ok(joint.volume(&state.wear))
    };
    let exact = worn(1.0).expect("the volume of steel");
    let mut refused = 0;
    for decade in [-3, 3, 5, 7, 8, 9, 10, 12, 20, 30] {
        match worn(10f64.powi(decade)) {
            Ok(volume) if decade <= 8 => {
                let off = (volume / exact - 1.0).abs();
                assert!(off < 0.02, "1e{decade}: off by {off:e}");
            }
            // With a larger factor, one cycle wears more than all cycles of steel. The solver must return an error.
            Ok(volume) => panic!("1e{decade}: {volume:e} of {exact:e}"),
            Err(_) => refused += 1,
        }
    }
    assert!(refused >= 5, "{refused} refused");
}

#[test]
fn wear_that_dies_out_comes_to_its_end() {
    let mut joint = reversal(CASES[0].0);
    joint.options.normal.tolerance = 1e-6;
    joint.options.tangential.tolerance = 1e-4;
    let cycles = 1_000_000_000_000;
    let first = unworn(&mut joint).cycle.dissipation;
    let (state, steps) = wear(&mut joint, LAW, 0.01, cycles).expect("wear steps");
    assert!(
        state.cycle.dissipation < 1e-6 * first,
        "friction does not end: {} J of {first} J",
        state.cycle.dissipation
    );
    assert!(steps < 60, "{steps} steps");
}

#[test]
fn the_explicit_limit_is_where_alternating_pressures_begin_to_grow() {
    // Slip c is uniform on a flat patch. In one step, a pressure that alternates from cell to cell changes by −N α c / λ times itself. The
    // pressure inverts in the step N α c = 2 λ. The half space gives λ.
    let mut joint = reversal(CASES[1].0);
    let grid = joint.patch.grid;
    let alternating: Vec<f64> = (0..grid.len())
        .map(|index| {
            let (i, j) = grid.cell(index);
            if (i + j).is_multiple_of(2) { 1.0 } else { -1.0 }
        })
        .collect();
    let mut displacement = vec![0.0; grid.len()];
    joint.half_space.normal(&alternating, &mut displacement);
    let product: f64 = alternating
        .iter()
        .zip(&displacement)
        .map(|(p, u)| p * u)
        .sum();
    let lambda = product / grid.len() as f64;
    let slip = vec![1e-6; grid.len()];
    let pressure = vec![1e7; grid.len()];
    let cycles = 1_000_000;
    let exact = cycles as f64 * COEFFICIENT * 0.6 * 1e-6 / (2.0 * lambda);
    let compliance = joint.half_space.self_compliance();
    let found = explicit::stability_ratio(&slip, &pressure, 0.6, LAW, cycles, compliance);
    // The limit serves a warning, so only its order of magnitude matters. Cells are not square, and edges are softer.
    assert!((found / exact - 1.0).abs() < 0.2, "{found} for {exact}");
    let open = vec![0.0; grid.len()];
    assert_eq!(
        explicit::stability_ratio(&slip, &open, 0.6, LAW, cycles, compliance),
        0.0
    );
}

/// For stepped cycles, the cycle at the end of a step equals the cycle of the next state bit by bit and costs the same work.
#[test]
fn the_cycle_at_the_end_of_a_step_is_that_of_the_next_state() {
    let motion = Motion::harmonic(&[(0.5e-6, 0.0), (0.35e-6, 1.2)], LOAD, 0.0, 16);
    let mut joint = joint(motion, March::Stepped);
    let state = unworn(&mut joint);
    let mut step = step_of(&mut joint, &state, 100_000);
    let end = step.end.take().expect("a cycle");
    let contact = joint.static_contact(&step.wear, Some(&step.contact.pressure));
    let contact = contact.expect("a contact");
    joint.half_space.take_pairs();
    let cycle = joint.cycle(&step.wear, &contact, Some(&step.shear));
    assert_eq!(joint.half_space.take_pairs(), end.fft_pairs);
    assert_eq!((end.wear, end.pressure), (step.wear, contact.pressure));
    assert_eq!(end.cycle, cycle.expect("a cycle"));
    assert_eq!((end.motion, end.start), (joint.motion, step.shear));
}
