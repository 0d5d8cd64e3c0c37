//! The run warns about a steady response with too few harmonics or with an unclear peak. The run warns about an
//! inaccurate reduced structure and about a contact that never closes.

use std::f64::consts::TAU;

use super::RunError;
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::cycle::JointCycle;
use crate::dynamics::{
    ContactElement, Extension, ResolvedResonance, Resonance, ResonanceKind, Vibration,
};
use crate::tables::typed;

/// Harmonic with the largest friction after the first harmonic.
const FRICTION_HARMONIC: u32 = 3;
/// The run warns if the relative error of the reduced structure exceeds `LARGEST_REDUCTION_ERROR`.
const LARGEST_REDUCTION_ERROR: f64 = 0.02;
/// The run warns if an update of the contact elements changes the amplitude by more than the factor `LARGEST_JUMP`.
/// Updates are due at changes of a few percent.
const LARGEST_JUMP: f64 = 1.25;
/// Warns if the harmonics could not be extended far enough.
pub fn warn_missing_harmonics(
    outputs: &mut Outputs,
    tolerance: Option<f64>,
    resolved: &ResolvedResonance,
) {
    let Some(tolerance) = tolerance.filter(|_| !resolved.resonance.is_still) else {
        return;
    };
    let truncation = &resolved.truncation;
    let figures = [
        ("amplitude", truncation.amplitude),
        ("dissipation", truncation.friction_energy),
    ];
    // Without friction the contact dissipates no energy, so the error of the dissipation does not matter.
    let mut elements = resolved.balance.elements().iter();
    let has_friction = elements
        .any(|element| element.friction_coefficient > 0.0 && element.tangential_stiffness() > 0.0);
    let figures = if has_friction {
        &figures[..]
    } else {
        &figures[..1]
    };
    let beyond = figures.iter().filter(|(_, error)| *error > tolerance);
    let exceeded: Vec<String> = beyond
        .map(|(figure, error)| match *error < 1.0 {
            true => format!("an error of {error:.1e} in the {figure}"),
            false => format!("an unknown error in the {figure}"),
        })
        .collect();
    if !exceeded.is_empty() {
        outputs.notice(format!(
            "fidelity.harmonic_tolerance = {tolerance} is not met: harmonics up to {} and {} samples per cycle leave {}; give more dynamics.harmonics",
            resolved.balance.harmonics().highest(),
            resolved.balance.sampling().samples(),
            exceeded.join(", and ")
        ));
    }
}

/// Notes the error and the cost of each extension of the harmonics, if there were several.
pub fn note_extensions(outputs: &mut Outputs, extensions: &[Extension]) {
    if extensions.len() < 2 {
        return;
    }
    let steps = extensions.iter().map(|extension| {
        format!(
            "up to {}, error {:.2} % ({} Newton iterations of {} unknowns)",
            extension.highest,
            100.0 * extension.error,
            extension.iterations,
            extension.unknowns
        )
    });
    let steps: Vec<String> = steps.collect();
    outputs.notice(format!(
        "harmonics were extended: {}; the error is the larger of amplitude and dissipation",
        steps.join("; ")
    ));
}

/// Warns once if the reduced structure is inaccurate at the harmonics with the largest friction.
pub fn warn_reduction(
    reads: &StageInputs,
    outputs: &mut Outputs,
    resolved: &ResolvedResonance,
) -> Result<(), RunError> {
    let row: Option<typed::Structure> = reads.optional_table()?;
    let Some((row, structure)) = row.zip(reads.recipe.structure.as_ref()) else {
        return Ok(());
    };
    let (Some(error), Some(checked)) = (row.error_receptance, row.checked_frequency) else {
        return Ok(());
    };
    let highest = resolved
        .balance
        .harmonics()
        .highest()
        .min(FRICTION_HARMONIC);
    let frequency = f64::from(highest) * resolved.resonance.governing().frequency();
    let local_error = error * (frequency / checked).powi(2);
    if reads.wear_iteration == 0 && local_error > LARGEST_REDUCTION_ERROR {
        outputs.notice(format!(
            "dynamics.modes = {}: the receptance of the reduced structure has an error of {:.1} % of its largest value at {frequency:.0} Hz \
             (harmonic {highest}); increase dynamics.modes",
            structure.modes,
            100.0 * local_error
        ));
    }
    Ok(())
}

/// Warns if an update changes the amplitude strongly. If the amplitude changes strongly, the joint may have two steady
/// responses, or the updates may be too far apart.
pub fn warn_jump(
    reads: &StageInputs,
    outputs: &mut Outputs,
    before: &typed::DynamicResponse,
    now: &Resonance,
) {
    if now.is_still {
        return;
    }
    let amplitude = before.resonance_amplitude.unwrap_or(before.peak_amplitude);
    let change = now.amplitude / amplitude;
    if change.max(1.0 / change) > LARGEST_JUMP {
        outputs.notice(format!(
            "iteration {}: this update of the contact elements changes the amplitude from {amplitude:.3e} to {:.3e} m. Reduce update.stiffness_change. \
             If the step remains, there are two steady responses, and no error bar covers the choice between them",
            reads.wear_iteration, now.amplitude
        ));
    }
}

/// Warns if the contact never closes in the current response. Other motions in the frequency range may close the
/// contact.
pub fn warn_open(outputs: &mut Outputs, elements: &[ContactElement], cycle: &JointCycle) {
    if cycle.force.iter().any(|force| force[2] != 0.0) {
        return;
    }
    let sliders = elements.iter().flat_map(|element| &element.sliders);
    let closing_displacement =
        sliders.map(|slider| slider.gap - slider.normal_load / slider.normal_stiffness);
    let closing_displacement = closing_displacement.fold(f64::INFINITY, f64::min);
    if closing_displacement.is_infinite() {
        return;
    }
    let largest_displacement = cycle.displacement.iter().map(|u| u[2]);
    let largest_displacement = largest_displacement.fold(f64::NEG_INFINITY, f64::max);
    outputs.notice(format!(
        "contact.gap, contact.normal_load: the contact stays open throughout the computed motion. It closes at a normal displacement of \
         {closing_displacement:.3e} m, and the motion reaches {largest_displacement:.3e} m; reduce the gap or increase the normal load if the contact must close"
    ));
}

/// Warns if the resonance is unclear. A resonance is unclear without response, damping or phase resonance, or if the
/// peak is at an end of the range or of a branch.
pub fn warn_resonance(outputs: &mut Outputs, vibration: &Vibration, resonance: &Resonance) {
    if resonance.is_still {
        let rows = &resonance.peak.displacement;
        let largest = rows.iter().fold(0.0_f64, |largest, u| largest.max(u.abs()));
        outputs.notice(format!(
            "dynamics.response: the amplitude at this point is zero up to rounding, and {largest:.1e} m elsewhere; \
             choose a direction in which the loads move the structure"
        ));
        return;
    }
    if resonance.peak_kind == ResonanceKind::Forced {
        return;
    }
    let model = &vibration.model;
    let mut damping = model
        .damping
        .values()
        .iter()
        .chain(model.hysteretic.values());
    if damping.all(|entry| *entry == 0.0) {
        outputs.notice(
            "dynamics.damping_ratio: friction alone damps the structure. Where the loads supply more energy than friction dissipates, the \
             amplitude at resonance is unbounded; give the damping of the structure",
        );
    }
    if resonance.phase.is_none() {
        let range = [vibration.range.0, vibration.range.1];
        outputs.notice(no_resonance_message(range.map(|omega| omega / TAU)));
    }
    if resonance.peak_kind == ResonanceKind::End {
        let why = match vibration.is_at_end(resonance.peak.omega) {
            true => "an end of dynamics.frequency: widen the range to find the peak",
            false => {
                "the end of a branch that could not be followed further: the peak may be higher"
            }
        };
        outputs.notice(format!(
            "the largest amplitude of the range, {:.6e} m at {:.6} Hz, lies at {why}",
            resonance.peak_amplitude, resonance.peak_frequency
        ));
    }
}

/// Returns the message for a range \[Hz\] without a phase resonance.
pub fn no_resonance_message([from, to]: [f64; 2]) -> String {
    format!(
        "dynamics.frequency: no phase resonance between {from:.6} and {to:.6} Hz. The run uses the response peak instead"
    )
}
