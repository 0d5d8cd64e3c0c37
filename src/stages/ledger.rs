//! The fine contact against the contact elements of the structure: what both say of the same quantity.

use super::RunError;
use super::declaration::Declaration;
use super::reads::{Outputs, Reads};
use super::solvers::{Solvers, smooth};
use super::stage::{Stage, When};
use crate::dynamics::cycle::half_range;
use crate::model_update::Compliance;
use crate::recipe::Part;
use crate::tables::{TableName, typed};

/// A difference above this between both is told: the step from one to the other is then no small matter.
const TOLD: f64 = 0.1;

/// What is told of.
const TOLD_OF: [&str; 3] = ["normal_load [N]", "force_x [N]", "dissipated_energy [J]"];

/// True if two values of one quantity are too far apart to pass over.
fn differ(fine: f64, dynamic: f64) -> bool {
    (fine - dynamic).abs() > TOLD * fine.abs().max(dynamic.abs())
}

/// Load, force, displacement, energy and compliance on both scales.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Ledger,
    when: When::Always,
    recipe: &[Part::Surface],
    reads: &[
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

fn compute(reads: &Reads, _: &mut Solvers) -> Result<Outputs, RunError> {
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
    let mut fine = Compliance::of(contact.kn, contact.kt);
    if let Some(smooth) = smooth(reads)? {
        fine = fine.without(smooth);
    }
    // The joint's stiffness is that of its loaded elements.
    let compliance = |k: &[f64]| {
        let pairs = k.iter().zip(&elements.normal_load);
        1.0 / pairs
            .filter(|(_, load)| **load > 0.0)
            .map(|(k, _)| k)
            .sum::<f64>()
    };
    let half_range = |values: &[f64]| half_range(values.iter().copied());
    let rows = [
        ("normal_load [N]", load, mean(&joint.normal_load)),
        (
            "force_x [N]",
            half_range(&cycle.force_x),
            half_range(&joint.force_x),
        ),
        (
            "displacement_x [m]",
            half_range(&cycle.displacement_x),
            half_range(&joint.displacement_x),
        ),
        (
            "dissipated_energy [J]",
            of_cycle.dissipated_energy,
            response.friction_energy,
        ),
        (
            // What friction takes is what the exciter supplies beyond what damping takes.
            "work_of_the_loads_less_damping [J]",
            of_cycle.dissipated_energy,
            response.input_energy - response.viscous_energy,
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
        .maybe_before::<typed::Ledger>()?
        .filter(|_| !update.updated);
    let was_open = |quantity: &str| {
        before.as_ref().is_some_and(|ledger| {
            let row = ledger.quantity.iter().position(|q| q == quantity);
            row.is_some_and(|row| differ(ledger.fine[row], ledger.dynamic[row]))
        })
    };
    for (quantity, fine, dynamic) in &rows {
        if TOLD_OF.contains(quantity) && differ(*fine, *dynamic) && !was_open(quantity) {
            outputs.notice(format!(
                "{quantity}: {fine:.4e} in the fine contact, {dynamic:.4e} in the contact elements of the structure"
            ));
        }
    }
    outputs.put(&typed::Ledger {
        quantity: rows.iter().map(|r| r.0.to_owned()).collect(),
        fine: rows.iter().map(|r| r.1).collect(),
        dynamic: rows.iter().map(|r| r.2).collect(),
    })?;
    Ok(outputs)
}
