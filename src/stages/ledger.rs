//! The fine contact against the contact elements of the structure: what both say of the same quantity.

use super::RunError;
use super::context::{Context, VibrationKeys, kept, put};
use super::fretting_cycle::Cycle;
use super::static_contact::StaticContact;
use super::vibrating::{Driven, Vibrating};
use crate::dynamics::cycle::half_range;
use crate::model_update::Compliance;
use crate::store::{Draft, StageKey};
use crate::tables::typed;

/// A difference above this between both is told: the step from one to the other is then no small matter.
const TOLD: f64 = 0.1;

/// Writes the `ledger` of an iteration, and says where both sides are far apart if the elements are new.
pub fn ledger(
    context: &Context,
    vibrating: &Vibrating,
    draft: &mut Draft,
    keys: (&VibrationKeys, &StageKey),
    driven: &Driven,
    contact: &StaticContact,
    cycle: &Cycle,
) -> Result<(), RunError> {
    let Some(joint) = kept::<typed::JointCycle>(draft, &keys.0.dynamic_response)? else {
        unreachable!("the response comes before its ledger");
    };
    let patch = &context.joint.patch;
    let load = contact.solution.pressure.iter().sum::<f64>() * patch.grid.cell_area();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let instants = &cycle.solution.instants;
    let mut fine = Compliance::of(contact.kn, contact.kt);
    if let Some(smooth) = vibrating.smooth {
        fine = fine.without(smooth);
    }
    let parameters = &driven.model.parameters;
    // The joint's stiffness is that of its loaded elements.
    let compliance = |k: &[f64]| {
        let pairs = k.iter().zip(&parameters.normal_load);
        1.0 / pairs
            .filter(|(_, load)| **load > 0.0)
            .map(|(k, _)| k)
            .sum::<f64>()
    };
    let rows = [
        ("normal_load [N]", load, mean(&joint.normal_load)),
        (
            "force_x [N]",
            half_range(instants.iter().map(|i| i.force[0])),
            half_range(joint.force_x.iter().copied()),
        ),
        (
            "displacement_x [m]",
            half_range(instants.iter().map(|i| i.displacement[0])),
            half_range(joint.displacement_x.iter().copied()),
        ),
        (
            "dissipated_energy [J]",
            cycle.solution.dissipation,
            driven.shaken.friction_energy,
        ),
        (
            "compliance_normal [m/N]",
            fine.normal,
            compliance(&parameters.kn),
        ),
        (
            "compliance_tangential [m/N]",
            fine.tangential,
            compliance(&parameters.kt),
        ),
    ];
    if driven.model.updated {
        for (quantity, fine, dynamic) in &rows[..2] {
            let largest = fine.abs().max(dynamic.abs());
            if (fine - dynamic).abs() > TOLD * largest {
                context.clock.observer.notice(&format!(
                    "{quantity}: {fine:.4e} in the fine contact, {dynamic:.4e} in the contact elements of the structure"
                ));
            }
        }
    }
    let table = typed::Ledger {
        quantity: rows.iter().map(|r| r.0.to_owned()).collect(),
        fine: rows.iter().map(|r| r.1).collect(),
        dynamic: rows.iter().map(|r| r.2).collect(),
    };
    put(draft, keys.1, &table)
}
