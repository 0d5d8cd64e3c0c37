//! The fine contact against the contact elements of the structure: what both say of the same quantity.

use super::RunError;
use super::contact_state::{compliance_of, contact_of, there};
use super::declaration::Declaration;
use super::solvers::{Solvers, smooth};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::cycle::half_range;
use crate::model_update::{Compliance, CycleFigures};
use crate::recipe::Part;
use crate::tables::{TableName, typed};

/// A difference above this between both is told: the step from one to the other is then no small matter.
const TOLD: f64 = 0.1;
/// A difference above this between the fine contact and the contact elements is told where the elements have just got laws from the fine contact:
/// both should say the same then.
const TOLD_AT_UPDATE: f64 = 0.03;

/// What is told of.
const TOLD_OF: [&str; 3] = ["normal_load [N]", FORCE, ENERGY];

/// Rows by which an update falls due.
const ENERGY: &str = "dissipated_energy [J]";
const FORCE: &str = "force_along_motion [N]";
/// The resultant over all elements or cells, of which those at rest count as much as those that slip.
const TOTAL_FORCE: &str = "total_force [N]";

/// Cycles of the fine contact under the vibration in force.
#[derive(Debug, Clone, Copy)]
pub struct Drift {
    /// In the iteration of the last update.
    pub at_update: CycleFigures,
    /// In that of the ledger, under the motion of the last update: where it has gone on to change, over that of the elements under the same
    /// motion, times theirs at the update.
    pub now: CycleFigures,
}

impl Drift {
    /// Of a ledger; none where updates do not look at cycles.
    pub fn of(ledger: &typed::Ledger) -> Option<Drift> {
        let figures = |values: &[f64]| -> Option<CycleFigures> {
            let of = |name: &str| {
                let row = ledger.quantity.iter().position(|q| q == name)?;
                values.get(row).copied()
            };
            Some(CycleFigures {
                force: of(FORCE)?,
                energy: of(ENERGY)?,
            })
        };
        let elements = figures(ledger.dynamic_at_update.as_ref()?)?;
        Some(Drift {
            at_update: figures(ledger.fine_at_update.as_ref()?)?,
            now: figures(&ledger.fine)?.over(figures(&ledger.dynamic)?.over(elements)),
        })
    }
}

/// Part of the exciter's energy that two energies have to differ by to be told of.
const WORTH: f64 = 0.01;

/// True if two values of one quantity are farther apart than this part of the larger.
fn differ(fine: f64, dynamic: f64, part: f64) -> bool {
    (fine - dynamic).abs() > part * fine.abs().max(dynamic.abs())
}

/// Load, force, displacement, energy and compliance on both scales.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Ledger,
    when: When::Always,
    recipe: &[Part::Surface, Part::Contact],
    reads: &[
        TableName::Surface,
        TableName::Reference,
        TableName::StaticContact,
        TableName::ContactField,
        TableName::Cycle,
        TableName::FrettingCycle,
        TableName::ModelUpdate,
        TableName::ContactElement,
        TableName::DynamicResponse,
        TableName::JointCycle,
    ],
    before: &[TableName::Ledger],
    writes: &[TableName::Ledger],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let joint: typed::JointCycle = reads.table()?;
    let contact: typed::StaticContact = reads.table()?;
    let fields: typed::ContactField = reads.table()?;
    let cycle: typed::Cycle = reads.table()?;
    let of_cycle: typed::FrettingCycle = reads.table()?;
    let elements: typed::ContactElement = reads.table()?;
    let response: typed::DynamicResponse = reads.table()?;
    let update: typed::ModelUpdate = reads.table()?;
    let surface = reads.recipe.surface();
    let cell_area = surface.map_or(0.0, |surface| surface.grid().cell_area());
    let load = fields.pressure.iter().sum::<f64>() * cell_area;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let fine = compliance(reads, solvers, &contact, &fields)?;
    // The joint's stiffness is that of its loaded elements.
    let compliance = |k: &[f64]| {
        let pairs = k.iter().zip(&elements.normal_load);
        1.0 / pairs
            .filter(|(_, load)| **load > 0.0)
            .map(|(k, _)| k)
            .sum::<f64>()
    };
    let half_range = |values: &[f64]| half_range(values.iter().copied());
    let force_along = there(TableName::Cycle, &cycle.force_along, "force_along")?;
    // Both half ranges as one: exact along a line.
    let total = |x: &[f64], y: &[f64]| half_range(x).hypot(half_range(y));
    let of_elements = |value: &Option<f64>, column: &str| -> Result<f64, RunError> {
        Ok(*there(TableName::FrettingCycle, value, column)?)
    };
    let energy = of_elements(&of_cycle.elements_energy, "elements_energy")?;
    let rows = [
        ("normal_load [N]", load, mean(&joint.normal_load)),
        (
            FORCE,
            half_range(force_along),
            of_elements(&of_cycle.elements_force, "elements_force")?,
        ),
        (
            TOTAL_FORCE,
            total(&cycle.force_x, cycle.force_y.as_deref().unwrap_or_default()),
            of_elements(&of_cycle.elements_total_force, "elements_total_force")?,
        ),
        (
            "displacement_x [m]",
            half_range(&cycle.displacement_x),
            of_elements(&of_cycle.elements_displacement, "elements_displacement")?,
        ),
        (ENERGY, of_cycle.dissipated_energy, energy),
        (
            // What friction takes is what the exciter supplies beyond what damping takes.
            "work_of_the_loads_less_damping [J]",
            of_cycle.dissipated_energy,
            response.input_energy - response.viscous_energy - response.hysteretic_energy,
        ),
        (
            "compliance_normal [m/N]",
            fine.normal,
            compliance(&elements.kn),
        ),
        (
            "compliance_tangential [m/N]",
            fine.tangential,
            compliance(&elements.kt),
        ),
    ];
    let mut outputs = Outputs::default();
    // Between updates a gap is told when it opens, not at every iteration that it stays open.
    let before = reads
        .optional_before::<typed::Ledger>()?
        .filter(|_| !update.updated);
    let was_open = |quantity: &str| {
        before.as_ref().is_some_and(|ledger| {
            let row = ledger.quantity.iter().position(|q| q == quantity);
            row.is_some_and(|row| differ(ledger.fine[row], ledger.dynamic[row], TOLD))
        })
    };
    let has_laws = update.law_remainder.is_some();
    let told = match update.updated && has_laws {
        true => TOLD_AT_UPDATE,
        false => TOLD,
    };
    for (quantity, fine, dynamic) in &rows {
        // Of a joint that all but sticks, friction is no part of the balance worth a word.
        let matters = *quantity != ENERGY || (fine - dynamic).abs() > WORTH * response.input_energy;
        let opens = differ(*fine, *dynamic, told) && !was_open(quantity);
        if TOLD_OF.contains(quantity) && opens && matters {
            let where_it_is = match *quantity == ENERGY {
                true => "error_closure has what it makes wrong in the wear that follows",
                false => "it is in no error bar but by the energy",
            };
            outputs.notice(format!(
                "iteration {}: {quantity}: {fine:.4e} in the fine contact, {dynamic:.4e} in the contact elements of the structure; {where_it_is}",
                reads.wear_iteration
            ));
        }
    }
    let fine: Vec<f64> = rows.iter().map(|r| r.1).collect();
    let dynamic: Vec<f64> = rows.iter().map(|r| r.2).collect();
    let at_update = before.map(|ledger| (ledger.fine_at_update, ledger.dynamic_at_update));
    let (fine_at_update, dynamic_at_update) = at_update.unwrap_or_default();
    outputs.put(&typed::Ledger {
        quantity: rows.iter().map(|r| r.0.to_owned()).collect(),
        fine_at_update: has_laws.then(|| fine_at_update.unwrap_or_else(|| fine.clone())),
        dynamic_at_update: has_laws.then(|| dynamic_at_update.unwrap_or_else(|| dynamic.clone())),
        fine,
        dynamic,
    })?;
    Ok(outputs)
}

/// Compliance of the fine contact beyond what the elements' structure has of the bodies.
fn compliance(
    reads: &StageInputs,
    solvers: &mut Solvers,
    contact: &typed::StaticContact,
    fields: &typed::ContactField,
) -> Result<Compliance, RunError> {
    let of_recipe = contact_of(&reads.recipe);
    if of_recipe.structure_mesh.is_some() {
        let (shear, coupling) = (of_recipe.shear, of_recipe.coupling);
        let ((kn, kt), _) = solvers.work(reads, None, |joint| {
            let pressure = joint.patch.spread(&fields.pressure);
            Ok(joint.stiffness_beyond_mesh(&pressure, shear, coupling)?)
        })?;
        return Ok(Compliance::of(kn, kt));
    }
    let total = compliance_of(contact)?;
    Ok(match smooth(reads)? {
        Some(smooth) => total.without(smooth),
        None => total,
    })
}
