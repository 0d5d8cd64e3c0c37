//! What a person is told of a steady response: harmonics that do not suffice, a structure reduced too far, a peak that is no clear one, a contact
//! that never closes.

use std::f64::consts::TAU;

use super::RunError;
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::cycle::JointCycle;
use crate::dynamics::{ContactElement, Extension, Resolved, Resonance, ResonanceKind, Vibration};
use crate::tables::typed;

/// The harmonic of the drive that friction has most of beside the first.
const FRICTION: u32 = 3;
/// Error of the reduced structure there from which it is told.
const MUCH: f64 = 0.02;
/// Factor between the amplitudes before and after an update from which it is told: updates are due at changes of some per cent.
const LEAP: f64 = 1.25;
/// Says so where harmonics could not be extended until they suffice.
pub fn warn_missing_harmonics(outputs: &mut Outputs, tolerance: Option<f64>, resolved: &Resolved) {
    let Some(tolerance) = tolerance.filter(|_| !resolved.resonance.is_still) else {
        return;
    };
    let truncation = &resolved.truncation;
    let figures = [
        ("amplitude", truncation.amplitude),
        ("dissipation", truncation.friction_energy),
    ];
    // Without friction nothing is dissipated, and no error of it is a fault.
    let mut elements = resolved.balance.elements().iter();
    let has_friction = elements
        .any(|element| element.friction_coefficient > 0.0 && element.tangential_stiffness() > 0.0);
    let figures = if has_friction {
        &figures[..]
    } else {
        &figures[..1]
    };
    let beyond = figures.iter().filter(|(_, error)| *error > tolerance);
    let left: Vec<String> = beyond
        .map(|(figure, error)| match *error < 1.0 {
            true => format!("an error of {error:.1e} in the {figure}"),
            false => format!("an error in the {figure} that is not known"),
        })
        .collect();
    if !left.is_empty() {
        outputs.notice(format!(
            "fidelity.harmonic_tolerance = {tolerance}: harmonics up to {} and {} samples a cycle leave {}",
            resolved.balance.harmonics().highest(),
            resolved.balance.sampling().samples(),
            left.join(", and ")
        ));
    }
}

/// Says what each extension of the harmonics has left of an error, and what it took, where there were several.
pub fn note_extensions(outputs: &mut Outputs, extensions: &[Extension]) {
    if extensions.len() < 2 {
        return;
    }
    let steps = extensions.iter().map(|of| {
        format!(
            "up to {} ({} Newton iterations of {} unknowns): {:.2} %",
            of.highest,
            of.iterations,
            of.unknowns,
            100.0 * of.error
        )
    });
    let steps: Vec<String> = steps.collect();
    outputs.notice(format!(
        "harmonics were extended, and leave of amplitude or dissipation {}",
        steps.join(", ")
    ));
}

/// Says so, once, where the reduced structure may be off at the harmonics that friction has most of.
pub fn warn_reduction(
    reads: &StageInputs,
    outputs: &mut Outputs,
    resolved: &Resolved,
) -> Result<(), RunError> {
    let row: Option<typed::Structure> = reads.maybe()?;
    let Some((row, structure)) = row.zip(reads.recipe.structure.as_ref()) else {
        return Ok(());
    };
    let (Some(error), Some(checked)) = (row.error_receptance, row.checked_frequency) else {
        return Ok(());
    };
    let highest = resolved.balance.harmonics().highest().min(FRICTION);
    let frequency = f64::from(highest) * resolved.resonance.in_force().frequency();
    let there = error * (frequency / checked).powi(2);
    if reads.wear_iteration == 0 && there > MUCH {
        outputs.notice(format!(
            "dynamics.modes = {}: the reduced structure's receptance is off that of all freedoms by some {:.1} % of its largest at {frequency:.0} Hz, \
             harmonic {highest}; keep more modes",
            structure.modes,
            100.0 * there
        ));
    }
    Ok(())
}

/// Says so where the response to the contact elements of an update is far from that `before` it: there may be two, or updates are too far apart.
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
    if change.max(1.0 / change) > LEAP {
        outputs.notice(format!(
            "iteration {}: with the contact elements of this update the amplitude of the response goes from {amplitude:.3e} to {:.3e} m; where a smaller \
             update.stiffness_change does not make smaller steps of it there are two steady responses, and no error bar holds which of them is taken",
            reads.wear_iteration, now.amplitude
        ));
    }
}

/// Says so where the contact never closes in the response in force. Other motions of the range may close it.
pub fn warn_open(outputs: &mut Outputs, elements: &[ContactElement], cycle: &JointCycle) {
    if cycle.force.iter().any(|force| force[2] != 0.0) {
        return;
    }
    let sliders = elements.iter().flat_map(|element| &element.sliders);
    let closes = sliders.map(|slider| slider.gap - slider.normal_load / slider.normal_stiffness);
    let closes = closes.fold(f64::INFINITY, f64::min);
    if closes.is_infinite() {
        return;
    }
    let reached = cycle.displacement.iter().map(|u| u[2]);
    let reached = reached.fold(f64::NEG_INFINITY, f64::max);
    outputs.notice(format!(
        "contact.gap, contact.normal_load: in the motion that was found the contact is open throughout: it would close at a normal displacement \
         of {closes:.3e} m, and reaches {reached:.3e} m; a smaller gap or more normal load, if it is meant to close"
    ));
}

/// Says so where the resonance is no clear one: nothing responds or damps, there is no phase resonance, or the peak lies at an end of the range or
/// of a branch.
pub fn warn_resonance(outputs: &mut Outputs, vibration: &Vibration, resonance: &Resonance) {
    if resonance.is_still {
        let rows = &resonance.peak.displacement;
        let largest = rows.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        outputs.notice(format!(
            "dynamics.response: the structure does not respond there: its amplitude is 0 but for rounding, beside {largest:.1e} m elsewhere; \
             name a direction along which something moves it"
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
            "dynamics.damping_ratio: nothing but friction damps the structure: where loads supply more than it takes, no amplitude at a \
             resonance is the largest; give the damping of the structure",
        );
    }
    if resonance.phase.is_none() {
        let range = [vibration.range.0, vibration.range.1];
        outputs.notice(no_resonance_message(range.map(|omega| omega / TAU)));
    }
    if resonance.peak_kind == ResonanceKind::End {
        let why = match vibration.is_at_end(resonance.peak.omega) {
            true => "an end of it: widen dynamics.frequency if the peak is meant",
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

/// What is said of a range \[Hz\] without a phase resonance.
pub fn no_resonance_message([from, to]: [f64; 2]) -> String {
    format!(
        "dynamics.frequency: no phase resonance between {from:.6} and {to:.6} Hz; the peak stands for it"
    )
}
