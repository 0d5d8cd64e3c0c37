//! The ledger: the same quantities in the fine contact and in the contact elements of the structure.

use super::RunError;
use super::contact_state::{compliance_of, contact_of, required_column};
use super::declaration::Declaration;
use super::solvers::{Solvers, smooth_compliance};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::cycle::half_range;
use crate::model_update::{Compliance, CycleFigures};
use crate::recipe::Part;
use crate::tables::{TableName, typed};

/// The run reports a larger relative difference between fine contact and contact elements.
const REPORT_THRESHOLD: f64 = 0.1;
/// The run reports a larger relative difference directly after an update with new laws, where both should agree.
const REPORT_THRESHOLD_AT_UPDATE: f64 = 0.03;

/// Quantities that are reported.
const REPORTED_QUANTITIES: [&str; 3] = ["normal_load [N]", FORCE, ENERGY];

/// Quantities that can make an update due.
const ENERGY: &str = "dissipated_energy [J]";
const FORCE: &str = "force_along_motion [N]";
/// Resultant over all elements or cells. Sticking and slipping elements or cells count equally.
const TOTAL_FORCE: &str = "total_force [N]";

/// Cycles of the fine contact under the current vibration.
#[derive(Debug, Clone, Copy)]
pub struct Drift {
    /// Cycle in the iteration of the last update.
    pub at_update: CycleFigures,
    /// Cycle in the iteration of the ledger, corrected to the motion of the last update. The correction factor is the
    /// value of the elements at the update, divided by the value under the present motion.
    pub now: CycleFigures,
}

impl Drift {
    /// Reads the drift from a ledger; `None` if updates do not depend on cycles.
    pub fn of(ledger: &typed::Ledger) -> Option<Drift> {
        let figures = |values: &[f64]| -> Option<CycleFigures> {
            let value_of = |name: &str| {
                let row = ledger.quantity.iter().position(|q| q == name)?;
                values.get(row).copied()
            };
            Some(CycleFigures {
                force: value_of(FORCE)?,
                energy: value_of(ENERGY)?,
            })
        };
        let elements = figures(ledger.dynamic_at_update.as_ref()?)?;
        Some(Drift {
            at_update: figures(ledger.fine_at_update.as_ref()?)?,
            now: figures(&ledger.fine)?
                .relative_to(figures(&ledger.dynamic)?.relative_to(elements)),
        })
    }
}

/// The ledger does not report a difference of energies below `LEAST_ENERGY` times the energy of the exciter.
const LEAST_ENERGY: f64 = 0.01;

/// Returns true if two values of a quantity differ by more than the fraction `part` of the larger value.
fn differ(fine: f64, dynamic: f64, part: f64) -> bool {
    (fine - dynamic).abs() > part * fine.abs().max(dynamic.abs())
}

/// Load, force, displacement, energy and compliance of the fine contact and of the contact elements.
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
    let fretting_cycle: typed::FrettingCycle = reads.table()?;
    let elements: typed::ContactElement = reads.table()?;
    let response: typed::DynamicResponse = reads.table()?;
    let update: typed::ModelUpdate = reads.table()?;
    let surface = reads.recipe.surface();
    let cell_area = surface.map_or(0.0, |surface| surface.grid().cell_area());
    let load = fields.pressure.iter().sum::<f64>() * cell_area;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let fine = compliance(reads, solvers, &contact, &fields)?;
    // The stiffness of the joint is the sum over its loaded elements.
    let compliance = |k: &[f64]| {
        let pairs = k.iter().zip(&elements.normal_load);
        1.0 / pairs
            .filter(|(_, load)| **load > 0.0)
            .map(|(k, _)| k)
            .sum::<f64>()
    };
    let half_range = |values: &[f64]| half_range(values.iter().copied());
    let force_along = required_column(TableName::Cycle, &cycle.force_along, "force_along")?;
    // Combines both half ranges; exact for a straight motion.
    let total = |x: &[f64], y: &[f64]| half_range(x).hypot(half_range(y));
    let of_elements = |value: &Option<f64>, column: &str| -> Result<f64, RunError> {
        Ok(*required_column(TableName::FrettingCycle, value, column)?)
    };
    let energy = of_elements(&fretting_cycle.elements_energy, "elements_energy")?;
    let rows = [
        ("normal_load [N]", load, mean(&joint.normal_load)),
        (
            FORCE,
            half_range(force_along),
            of_elements(&fretting_cycle.elements_force, "elements_force")?,
        ),
        (
            TOTAL_FORCE,
            total(&cycle.force_x, cycle.force_y.as_deref().unwrap_or_default()),
            of_elements(&fretting_cycle.elements_total_force, "elements_total_force")?,
        ),
        (
            "displacement_x [m]",
            half_range(&cycle.displacement_x),
            of_elements(
                &fretting_cycle.elements_displacement,
                "elements_displacement",
            )?,
        ),
        (ENERGY, fretting_cycle.dissipated_energy, energy),
        (
            // Friction dissipates the energy of the exciter minus the energy of the damping.
            "work_of_the_loads_less_damping [J]",
            fretting_cycle.dissipated_energy,
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
    // Between updates, a difference is reported when it first exceeds the threshold, not in every iteration.
    let before = reads
        .optional_previous_table::<typed::Ledger>()?
        .filter(|_| !update.updated);
    let was_open = |quantity: &str| {
        before.as_ref().is_some_and(|ledger| {
            let row = ledger.quantity.iter().position(|q| q == quantity);
            row.is_some_and(|row| differ(ledger.fine[row], ledger.dynamic[row], REPORT_THRESHOLD))
        })
    };
    let has_laws = update.law_remainder.is_some();
    let threshold = match update.updated && has_laws {
        true => REPORT_THRESHOLD_AT_UPDATE,
        false => REPORT_THRESHOLD,
    };
    for (quantity, fine, dynamic) in &rows {
        // If the joint almost sticks, the friction energy is negligible and not reported.
        let matters =
            *quantity != ENERGY || (fine - dynamic).abs() > LEAST_ENERGY * response.input_energy;
        let opens = differ(*fine, *dynamic, threshold) && !was_open(quantity);
        if REPORTED_QUANTITIES.contains(quantity) && opens && matters {
            let coverage = match *quantity == ENERGY {
                true => "error_closure includes its effect on the wear that follows",
                false => "no error bar covers it, except through the energy",
            };
            outputs.notice(format!(
                "iteration {}: {quantity}: {fine:.4e} in the fine contact, {dynamic:.4e} in the contact elements of the structure; {coverage}",
                reads.wear_iteration
            ));
        }
    }
    let fine: Vec<f64> = rows.iter().map(|r| r.1).collect();
    let dynamic: Vec<f64> = rows.iter().map(|r| r.2).collect();
    let at_update = before.map(|ledger| (ledger.fine_at_update, ledger.dynamic_at_update));
    let (fine_at_update, dynamic_at_update) = at_update.unwrap_or_default();
    outputs.add_table(&typed::Ledger {
        quantity: rows.iter().map(|r| r.0.to_owned()).collect(),
        fine_at_update: has_laws.then(|| fine_at_update.unwrap_or_else(|| fine.clone())),
        dynamic_at_update: has_laws.then(|| dynamic_at_update.unwrap_or_else(|| dynamic.clone())),
        fine,
        dynamic,
    })?;
    Ok(outputs)
}

/// Returns the compliance of the fine contact without the compliance that the structure of the elements already
/// contains.
fn compliance(
    reads: &StageInputs,
    solvers: &mut Solvers,
    contact: &typed::StaticContact,
    fields: &typed::ContactField,
) -> Result<Compliance, RunError> {
    let of_recipe = contact_of(&reads.recipe);
    if of_recipe.structure_mesh.is_some() {
        let (shear, coupling) = (of_recipe.shear, of_recipe.coupling);
        let ((kn, kt), _) = solvers.timed(reads, None, |joint| {
            let pressure = joint.patch.scatter(&fields.pressure);
            Ok(joint.stiffness_beyond_mesh(&pressure, shear, coupling)?)
        })?;
        return Ok(Compliance::from_stiffness(kn, kt));
    }
    let total = compliance_of(contact)?;
    Ok(match smooth_compliance(reads)? {
        Some(smooth) => total.subtract_series(smooth),
        None => total,
    })
}
