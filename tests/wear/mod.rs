//! Steady cycle and wear steps on a small rough joint. The joint is never square, and dx never equals dy.

mod coarse;
mod cycle;
mod drives;
mod event_search;
mod fields;
mod left_out;
mod local_load;
mod motion;
mod pressing;
mod sampled;
mod step;
mod superposition;

use fretwear::contact::normal::{NormalOptions, Rotation};
use fretwear::contact::tangential::TangentialOptions;
use fretwear::contact::{Boundary, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};
use fretwear::wear::cycle::March;
use fretwear::wear::implicit::{Limits, Step, advance};
use fretwear::wear::joint::{FrettingOptions, WornState};
use fretwear::wear::{FrettingJoint, Harmonic, HarmonicMotion, Motion, WearLaw};

use crate::contact::STEEL;

/// Wear coefficient of the published case \[m³/J\].
pub const COEFFICIENT: f64 = 2e-15;

/// The wear law of the published case.
pub const LAW: WearLaw = WearLaw {
    coefficient: COEFFICIENT,
};

/// Load on the small joint \[N\]: mean pressure 20 MPa.
pub const LOAD: f64 = 320.0;

/// Friction coefficient.
pub const FRICTION: f64 = 0.6;

/// Tolerances far below the tolerances of the tests.
pub const EXACT: FrettingOptions = FrettingOptions {
    normal: NormalOptions {
        tolerance: 1e-9,
        max_iterations: 4000,
    },
    tangential: TangentialOptions {
        tolerance: 1e-8,
        max_steps: 400,
        max_iterations: 20_000,
        ..TangentialOptions::DEFAULT
    },
    cycle_tolerance: 1e-6,
    extrapolate: true,
    least_extrapolated: FrettingOptions::LEAST_EXTRAPOLATED,
    checks_per_span: FrettingOptions::CHECKS_PER_SPAN,
};

/// A displacement or a force with its largest value at the beginning of the cycle.
pub fn harmonic(amplitude: f64, is_force: bool) -> Harmonic {
    Harmonic {
        amplitude,
        phase: 0.0,
        is_force,
    }
}

/// Motion of these channels under [`LOAD`], in 16 samples.
pub fn driven(axes: &[Harmonic], rotation: Option<Harmonic>) -> Motion {
    let motion = HarmonicMotion {
        axes: axes.to_vec(),
        rotation,
        normal_load_amplitude: 0.0,
    };
    motion.sampled(LOAD, 16)
}

/// Rough joint of 4 × 4 mm with 40 × 32 cells. The heights are a fixed sum of waves with an amplitude near 1 µm.
pub fn joint(motion: Motion, march: March) -> FrettingJoint {
    let grid = Grid::over([4e-3, 4e-3], [40, 32]);
    let waves = [
        (3.0, 1.0, 0.3),
        (2.0, -4.0, 1.1),
        (5.0, 3.0, 2.3),
        (-4.0, 6.0, 0.7),
        (1.0, 5.0, 4.0),
        (6.0, -2.0, 5.1),
    ];
    let height = (0..grid.len()).map(|index| {
        let (i, j) = grid.cell(index);
        let (x, y) = grid.centre(i, j);
        let angle =
            |(m, n, phase): (f64, f64, f64)| std::f64::consts::TAU * (m * x + n * y) / 4e-3 + phase;
        waves.iter().map(|&wave| 0.6e-6 * angle(wave).cos()).sum()
    });
    FrettingJoint {
        half_space: HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free),
        patch: Patch::full(grid),
        height: height.collect(),
        pressing: None,
        rotation: Rotation::FIXED,
        pressure_cap: None,
        friction_coefficient: FRICTION,
        motion,
        evolving_motion: None,
        march,
        options: EXACT,
    }
}

/// State of the unworn joint with its cycle.
pub fn unworn(joint: &mut FrettingJoint) -> WornState {
    let wear = vec![0.0; joint.patch.grid.len()];
    let contact = joint.static_contact(&wear, None).expect("static contact");
    let cycle = joint.cycle(&wear, &contact, None).expect("cycle");
    WornState {
        wear,
        pressure: contact.pressure,
        cycle,
    }
}

/// State of the joint after a wear step.
pub fn after(joint: &mut FrettingJoint, step: Step) -> WornState {
    let contact = joint
        .static_contact(&step.wear, Some(&step.contact.pressure))
        .expect("static contact");
    let cycle = joint
        .cycle(&step.wear, &contact, Some(&step.shear))
        .expect("cycle");
    WornState {
        wear: step.wear,
        pressure: contact.pressure,
        cycle,
    }
}

/// Wears the unworn joint by equal implicit steps without error control. Returns the state and the sum of the estimated errors.
pub fn wear_by_equal_steps(joint: &mut FrettingJoint, cycles: u64, steps: u64) -> (WornState, f64) {
    let mut state = unworn(joint);
    let mut error = 0.0;
    for _ in 0..steps {
        let step = step_of(joint, &state, cycles / steps);
        error += step.error;
        state = after(joint, step);
    }
    (state, error)
}

/// Implicit step without a limit of the error.
pub fn step_of(joint: &mut FrettingJoint, state: &WornState, cycles: u64) -> Step {
    let limits = Limits {
        tolerance: f64::INFINITY,
        depth_step: None,
        remaining: u64::MAX,
        safety: Limits::SAFETY,
    };
    advance(joint, state, LAW, cycles as f64, limits).expect("wear step")
}

/// Largest of |a − b| over the largest of |b|.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    a.iter()
        .zip(b)
        .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
        / largest
}

/// Σ|a − b| / Σ|b|.
pub fn difference_l1(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>()
        / b.iter().map(|b| b.abs()).sum::<f64>()
}
