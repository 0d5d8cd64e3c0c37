//! If an update is due, the stage computes the contact elements from the fine contact of the iteration. Otherwise the
//! stage copies the contact elements from the previous iteration.

use super::RunError;
use super::contact_elements::{element_table, parameters, slider_table};
use super::contact_state::compliance_of;
use super::declaration::Declaration;
use super::error::NumericsError;
use super::ledger::Drift;
use super::solvers::{Solvers, element_layout, smooth_compliance};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::model_update::{Compliance, CycleFigures, UpdateCause, UpdateCriterion, UpdateState};
use crate::recipe::{Contact, Part};
use crate::tables::{TableName, typed};
use crate::wear::FrettingJoint;
use crate::wear::implicit::{MiddleCycle, Step};

/// The current contact elements. The stage updates the contact elements when the update criterion requires an update,
/// [A §2e, §4d(i)].
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::ModelUpdate,
    when: When::Always,
    recipe: &[
        Part::Structure,
        Part::Surface,
        Part::Contact,
        Part::Elements,
        Part::Wear,
    ],
    reads: &[
        TableName::Surface,
        TableName::Reference,
        TableName::WearStep,
        TableName::StaticContact,
        TableName::ContactField,
    ],
    before: &[
        TableName::Summary,
        TableName::ModelUpdate,
        TableName::ContactElement,
        TableName::ContactSlider,
        TableName::Ledger,
    ],
    writes: &[
        TableName::ModelUpdate,
        TableName::ContactElement,
        TableName::ContactSlider,
    ],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let contact: typed::StaticContact = reads.table()?;
    let summary = reads
        .optional_previous_table::<typed::Summary>()?
        .unwrap_or_default();
    let volume_before = summary.wear_volume;
    let step = reads
        .optional_table::<typed::WearStep>()?
        .unwrap_or_default();
    let smooth = smooth_compliance(reads)?;
    let now = UpdateState {
        iteration: reads.wear_iteration,
        compliance: without_smooth(compliance_of(&contact)?, smooth),
        wear_volume: volume_before.unwrap_or(0.0) + step.volume,
        running_in: running_in(reads, &summary),
        cycle: end_cycle(&step),
    };
    let drift = drift(reads)?;
    let mut outputs = Outputs::default();
    let before = reads.optional_previous_table::<typed::ModelUpdate>()?;
    let elements_before = reads.optional_previous_table::<typed::ContactElement>()?;
    let before = before.zip(elements_before);
    let due = before
        .as_ref()
        .map(|(row, _)| criterion(reads).due(&reference_of(row, drift), &now));
    let reason = match due {
        Some(None) => {
            let (row, elements) = before.expect("due is none without it");
            outputs.add_table(&typed::ModelUpdate {
                updated: false,
                reason: String::new(),
                ..row
            })?;
            outputs.add_table(&typed::ContactElement {
                state: None,
                ..elements
            })?;
            if let Some(sliders) = reads.optional_previous_table::<typed::ContactSlider>()? {
                outputs.add_table(&sliders)?;
            }
            return Ok(outputs);
        }
        None => "",
        Some(Some(due)) => match due.to {
            UpdateCause::Kn => "kn",
            UpdateCause::Kt => "kt",
            UpdateCause::Force => "force_along_motion",
            UpdateCause::Energy => "dissipated_energy",
            UpdateCause::Iterations => "iterations",
            UpdateCause::WearVolume => "wear_volume",
            UpdateCause::VolumeGrowth => "volume_growth",
        },
    };
    let fine = match extrapolates(reads) {
        true => Some(compliance_of(&contact)?.tangential),
        false => None,
    };
    let (element_parameters, law_remainder) =
        parameters(reads, solvers, &contact, &reads.table()?)?;
    outputs.add_table(&typed::ModelUpdate {
        updated: true,
        reason: reason.to_owned(),
        updates: before.as_ref().map_or(0, |(row, _)| row.updates + 1),
        update_iteration: now.iteration as i64,
        compliance_normal: now.compliance.normal,
        compliance_tangential: now.compliance.tangential,
        wear_volume: now.wear_volume,
        law_remainder,
        fine_compliance: fine,
        previous_fine_compliance: before
            .and_then(|(row, _)| row.fine_compliance)
            .or(fine)
            .filter(|_| extrapolates(reads)),
    })?;
    outputs.add_table(&element_table(
        &element_layout(reads),
        &element_parameters,
        None,
    ))?;
    if let Some(sliders) = slider_table(&element_parameters) {
        outputs.add_table(&sliders)?;
    }
    Ok(outputs)
}

/// Reads the cycles of the fine contact at the last update and in the previous iteration. Returns `None` if updates do
/// not depend on cycles.
fn drift(reads: &StageInputs) -> Result<Option<Drift>, RunError> {
    let ledger = reads.optional_previous_table::<typed::Ledger>()?;
    Ok(ledger.as_ref().and_then(Drift::of))
}

/// Returns the cycle at the end of a wear step.
fn end_cycle(step: &typed::WearStep) -> Option<CycleFigures> {
    let pair = step.end_force.zip(step.end_energy);
    pair.map(|(force, energy)| CycleFigures { force, energy })
}

/// Returns the state at the last update.
fn reference_of(row: &typed::ModelUpdate, drift: Option<Drift>) -> UpdateState {
    UpdateState {
        iteration: row.update_iteration as u64,
        compliance: Compliance {
            normal: row.compliance_normal,
            tangential: row.compliance_tangential,
        },
        wear_volume: row.wear_volume,
        running_in: 0.0,
        cycle: drift.map(|drift| drift.at_update),
    }
}

/// Part of the final worn volume up to which a joint runs in. During running-in, the contact changes more within a
/// step than between two updates by volume growth.
const RUNNING_IN: f64 = 0.03;

/// Returns the worn volume at the end of running-in \[m³\], if wear continues at the wear rate of `summary`.
fn running_in(reads: &StageInputs, summary: &typed::Summary) -> f64 {
    let end = reads.recipe.wear.as_ref().map_or(0.0, |wear| {
        let remaining_cycles = wear.cycles.map_or(f64::INFINITY, |cycles| {
            cycles.saturating_sub(summary.cycles.unwrap_or(0) as u64) as f64
        });
        let by_cycles = summary.wear_volume.unwrap_or(0.0)
            + remaining_cycles * summary.wear_rate.unwrap_or(0.0);
        by_cycles.min(wear.volume.unwrap_or(f64::INFINITY))
    });
    if end.is_finite() {
        RUNNING_IN * end
    } else {
        0.0
    }
}

/// Returns true if the motion is extrapolated between updates.
pub fn extrapolates(reads: &StageInputs) -> bool {
    let elements = reads.recipe.elements();
    elements.is_some_and(|elements| elements.update.extrapolates)
}

/// Returns the criterion for updates of the contact elements.
fn criterion(reads: &StageInputs) -> UpdateCriterion {
    let elements = reads.recipe.elements();
    elements.map_or(UpdateCriterion::Never, |elements| elements.update.criterion)
}

/// Returns the compliance of the springs: the `total` compliance of the joint without the compliance of the smooth
/// patch.
fn without_smooth(total: Compliance, smooth: Option<Compliance>) -> Compliance {
    match smooth {
        Some(smooth) => total.subtract_series(smooth),
        None => total,
    }
}

/// Returns force and energy of the fine contact in the middle of a step. The function divides both by the relative
/// force and energy of the contact elements in the middle of the step. `moved` returns the relative force and energy of
/// the contact elements at a compliance of the fine contact.
pub fn figures_of(
    middle: &MiddleCycle,
    moved: &dyn Fn(Option<f64>) -> CycleFigures,
) -> CycleFigures {
    let fine = CycleFigures {
        force: middle.force,
        energy: middle.dissipation,
    };
    fine.relative_to(moved(middle.compliance))
}

/// The next update, as predicted at the beginning of a wear step.
pub struct NextUpdate {
    smooth: Option<Compliance>,
    criterion: UpdateCriterion,
    reference: UpdateState,
    running_in: f64,
    /// The cycle at the beginning of the step.
    cycle: Option<CycleFigures>,
    /// Progress towards the update at the beginning of the step; 1 where it is due.
    pub begin: f64,
    /// Worn volume at which the update is due by volume growth \[m³\]; `None` if the criterion ignores it.
    pub due_volume: Option<f64>,
}

impl NextUpdate {
    /// Predicts the update after the previous iteration; `None` if the length of a step does not affect updates.
    pub fn of(reads: &StageInputs) -> Result<Option<Self>, RunError> {
        let criterion = criterion(reads);
        let Some(row) = reads.optional_previous_table::<typed::ModelUpdate>()? else {
            return Ok(None);
        };
        if matches!(
            criterion,
            UpdateCriterion::Never | UpdateCriterion::Iterations(_)
        ) {
            return Ok(None);
        }
        let summary: typed::Summary = reads.before()?;
        let drift = drift(reads)?;
        let mut next = NextUpdate {
            smooth: smooth_compliance(reads)?,
            criterion,
            reference: reference_of(&row, drift),
            running_in: running_in(reads, &summary),
            cycle: drift.map(|drift| drift.now),
            begin: 0.0,
            due_volume: None,
        };
        next.due_volume = criterion.due_volume(&next.reference, next.running_in);
        let stiffness = |k: Option<f64>| k.unwrap_or(f64::INFINITY);
        let volume = summary.wear_volume.unwrap_or(0.0);
        let [kn, kt] = [summary.kn, summary.kt].map(stiffness);
        next.begin = next.progress_at(kn, kt, volume, next.cycle);
        Ok(Some(next))
    }

    fn progress_at(&self, kn: f64, kt: f64, wear_volume: f64, cycle: Option<CycleFigures>) -> f64 {
        let now = UpdateState {
            iteration: self.reference.iteration,
            compliance: without_smooth(Compliance::from_stiffness(kn, kt), self.smooth),
            wear_volume,
            running_in: self.running_in,
            cycle,
        };
        self.criterion.progress(&self.reference, &now)
    }

    /// Returns the progress towards the update after a step, for the total worn volume `wear_volume`; 1 where the
    /// update is due. `moved` returns force and energy of the elements at a compliance of the fine contact, relative
    /// to the response.
    pub fn progress(
        &self,
        joint: &mut FrettingJoint,
        contact: &Contact,
        step: &Step,
        wear_volume: f64,
        moved: &dyn Fn(Option<f64>) -> CycleFigures,
    ) -> Result<f64, NumericsError> {
        let pressure = &step.contact.pressure;
        let (kn, kt) = match self.criterion {
            UpdateCriterion::StiffnessChange { .. } => {
                joint.stiffness(pressure, contact.shear, contact.coupling)?
            }
            _ => (f64::INFINITY, f64::INFINITY),
        };
        let middle = figures_of(&step.middle, moved);
        let cycle = self.cycle.map(|begin| begin.at_end(middle));
        Ok(self.progress_at(kn, kt, wear_volume, cycle))
    }
}
