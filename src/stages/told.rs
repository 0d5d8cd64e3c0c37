//! What a person is told of a steady response: harmonics that do not suffice, a structure reduced too far, a peak that is no clear one, a contact
//! that never closes.

use std::f64::consts::TAU;

use super::RunError;
use super::reads::{Outputs, Reads};
use crate::dynamics::cycle::JointCycle;
use crate::dynamics::{Candidate, CandidateKind, ContactElement, Resolved, Resonance, Vibration};
use crate::tables::typed;

/// Relative difference of two frequencies that are one but for rounding.
const SAME_FREQUENCY: f64 = 1e-9;
/// The harmonic of the drive that friction has most of beside the first.
const FRICTION: u32 = 3;
/// Error of the reduced structure there from which it is told.
const MUCH: f64 = 0.02;
/// Factor between the amplitudes before and after an update from which it is told: updates are due at changes of some per cent.
const LEAP: f64 = 1.25;
/// Share of the highest peak from which another is as high.
const TIE: f64 = 0.99;

/// Says so where harmonics could not be extended until they suffice.
pub fn tell_missed(outputs: &mut Outputs, tolerance: Option<f64>, resolved: &Resolved) {
    let Some(tolerance) = tolerance.filter(|_| !resolved.resonance.is_still) else {
        return;
    };
    let truncation = &resolved.truncation;
    let figures = [
        ("amplitude", truncation.amplitude),
        ("dissipation", truncation.friction_energy),
    ];
    let beyond = figures.iter().filter(|(_, error)| *error > tolerance);
    let left: Vec<String> = beyond
        .map(|(figure, error)| match *error < 1.0 {
            true => format!("an error of {error:.1e} in the {figure}"),
            false => format!("an error in the {figure} that is not known"),
        })
        .collect();
    if !left.is_empty() {
        outputs.notice(format!(
            "fidelity.harmonic_tolerance = {tolerance}: harmonics up to {} leave {}",
            resolved.balance.harmonics().highest(),
            left.join(", and ")
        ));
    }
}

/// Says so, once, where the reduced structure may be off at the harmonics that friction has most of.
pub fn tell_reduction(
    reads: &Reads,
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
pub fn tell_leap(
    reads: &Reads,
    outputs: &mut Outputs,
    before: &typed::DynamicResponse,
    now: &Resonance,
) {
    let (Some(amplitude), false) = (before.resonance_amplitude, now.is_still) else {
        return;
    };
    let change = now.amplitude / amplitude;
    if change.max(1.0 / change) > LEAP {
        outputs.notice(format!(
            "iteration {}: with the contact elements of this update the amplitude at resonance goes from {amplitude:.3e} to {:.3e} m; where a smaller \
             update.stiffness_change does not make smaller steps of it there are two steady responses, and no error bar holds which of them is taken",
            reads.wear_iteration, now.amplitude
        ));
    }
}

/// Says so where the contact never closes in the response in force. Other motions of the range may close it.
pub fn tell_open(outputs: &mut Outputs, elements: &[ContactElement], cycle: &JointCycle) {
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

/// Says so where the strongest resonance is no clear one: others are as strong, it is unstable, it lies at an end of the range, or parts
/// of the range have no branch.
pub fn tell_candidates(outputs: &mut Outputs, vibration: &Vibration, resonance: &Resonance) {
    if resonance.is_still {
        let rows = &resonance.peak.displacement;
        let largest = rows.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        outputs.notice(format!(
            "dynamics.response: the structure does not respond there: its amplitude is 0 but for rounding, beside {largest:.1e} m elsewhere; \
             name a direction along which something moves it"
        ));
        return;
    }
    let damping = &vibration.model.damping;
    if (0..damping.rows()).all(|k| damping.row(k).iter().all(|entry| *entry == 0.0)) {
        outputs.notice(
            "dynamics.damping_ratio: nothing but friction damps the structure: where loads supply more than it takes, no amplitude at a \
             resonance is the largest; give the damping of the structure",
        );
    }
    if resonance.phase.is_none() {
        let range = [vibration.range.0, vibration.range.1];
        outputs.notice(no_phase_resonance_between(range.map(|omega| omega / TAU)));
    }
    let above = |reach: f64| match reach {
        reach if reach <= resonance.peak_amplitude => "are not above the peak".to_owned(),
        reach if reach.is_finite() => format!("may reach {reach:.3e} m"),
        _ => "may be of any size: the peak is not known".to_owned(),
    };
    if resonance.unfollowed > resonance.peak_amplitude {
        outputs.notice(format!(
            "there are motions beside the branches of the harmonic balance that could not be followed: they {}",
            above(resonance.unfollowed)
        ));
    } else if resonance.is_in_time() {
        outputs.notice("the peak was found by integration in time, as the harmonic balance has no branch there");
    }
    if resonance.is_cut {
        outputs.notice("the search for further branches was ended, as it had cost as much as it may; some may be missing");
    }
    for gap in &resonance.gaps {
        let [low, high] = gap;
        let unseen = resonance.unseen.iter();
        let unseen = unseen.filter(|part| part.ends[0] < *high && *low < part.ends[1]);
        let known = above(unseen.fold(0.0, |most, part| most.max(part.reach)));
        outputs.notice(format!(
            "no branch of responses could be followed from {low:.6} to {high:.6} Hz; motions there {known}"
        ));
    }
    let peaks = resonance.candidates.iter();
    let peaks: Vec<&Candidate> = peaks
        .filter(|candidate| candidate.kind != CandidateKind::PhaseResonance)
        .collect();
    let Some(first) = peaks.first() else {
        return;
    };
    let at = |candidate: &Candidate| {
        let frequency = candidate.response.frequency();
        format!("{:.6e} m at {frequency:.6} Hz", candidate.amplitude)
    };
    if first.kind == CandidateKind::End {
        let (low, high) = vibration.range;
        let is_at = |end: f64| (first.response.omega / end - 1.0).abs() <= SAME_FREQUENCY;
        let why = match is_at(low) || is_at(high) {
            true => "an end of it: widen dynamics.frequency if the peak is meant",
            false => {
                "the end of a branch that could not be followed further: the peak may be higher"
            }
        };
        outputs.notice(format!(
            "the largest amplitude of the range, {}, lies at {why}",
            at(first)
        ));
    }
    if first.is_unstable() {
        let stable = peaks.iter().find(|peak| !peak.is_unstable());
        let stable = stable.map_or(String::new(), |peak| {
            format!("; the largest peak that is not is {}", at(peak))
        });
        outputs.notice(format!(
            "the peak of {} is unstable: a motion does not stay there{stable}",
            at(first)
        ));
    }
    if let Some(second) = peaks
        .get(1)
        .filter(|second| second.amplitude >= TIE * first.amplitude)
    {
        outputs.notice(format!(
            "two peaks are as high as each other: {}, and {}",
            at(first),
            at(second)
        ));
    }
}

/// What is said of a range \[Hz\] without a phase resonance.
pub fn no_phase_resonance_between([from, to]: [f64; 2]) -> String {
    format!(
        "dynamics.frequency: no phase resonance between {from:.6} and {to:.6} Hz; the peak stands for it"
    )
}
