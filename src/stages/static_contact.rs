//! Pressure and gap under the mean load, and the stiffness of the contact.

use super::context::{Context, Keys, gather, kept, kept_cells};
use super::{RunError, Stage, curves};
use crate::contact::normal::NormalSolution;
use crate::contact::stiffness;
use crate::grid::ByAxis;
use crate::store::Draft;
use crate::tables::{Table, TableBuilder, TableError, TableName};

/// The static contact of an iteration.
pub struct StaticContact {
    pub solution: NormalSolution,
    pub kn: f64,
    pub kt: f64,
    pub fft_pairs: f64,
}

/// A contact near the one to be found: what a wear step predicts.
pub struct Predicted {
    pub gap: Vec<f64>,
    pub pressure: Vec<f64>,
    pub shear: ByAxis<Vec<f64>>,
}

/// The names of the shear columns, by axis.
pub const SHEAR: [&str; 2] = ["shear_x", "shear_y"];

impl Predicted {
    /// As a `contact_field` that is not complete yet.
    pub fn table(&self, context: &Context) -> Result<Table, TableError> {
        self.columns(context).build()
    }

    fn columns(&self, context: &Context) -> TableBuilder {
        let patch = &context.joint.patch;
        let (i, j) = kept_cells(patch);
        let mut table = Table::builder(TableName::ContactField)
            .column("i", i)
            .column("j", j)
            .column("gap", gather(patch, &self.gap))
            .column("pressure", gather(patch, &self.pressure));
        for (name, shear) in SHEAR.iter().zip(&self.shear) {
            table = table.column(name, gather(patch, shear));
        }
        table
    }

    /// From such a table.
    pub fn of(context: &Context, table: &Table) -> Result<Predicted, RunError> {
        let shear = SHEAR
            .iter()
            .filter(|name| table.has(name))
            .map(|name| context.field(table, name));
        Ok(Predicted {
            gap: context.field(table, "gap")?,
            pressure: context.field(table, "pressure")?,
            shear: shear.collect::<Result<_, _>>()?,
        })
    }
}

/// Solves the static contact of the surface of which `wear` is gone, or takes it from the draft. The result holds the
/// predicted shear too, for the cycle to start from.
pub fn static_contact(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
    wear: &[f64],
    predicted: Option<Predicted>,
) -> Result<(StaticContact, ByAxis<Vec<f64>>), RunError> {
    // The cycle replaces the fields by its own, under its key: they hold the same gap and pressure.
    let fields = match kept(draft, TableName::ContactField, &keys.static_contact)? {
        Some(table) => Some(table),
        None => kept(draft, TableName::ContactField, &keys.fretting_cycle)?,
    };
    let row = kept(draft, TableName::StaticContact, &keys.static_contact)?;
    let curve_done = !context.curves_due()
        || kept(draft, TableName::Indentation, &keys.static_contact)?.is_some();
    if let (Some(fields), Some(row), true) = (fields, row, curve_done) {
        let Predicted {
            gap,
            pressure,
            shear,
        } = Predicted::of(context, &fields)?;
        let solution = NormalSolution {
            pressure,
            gap,
            approach: row.f64("approach")?[0],
            iterations: row.i64("iterations")?[0] as usize,
            exchanges: 0,
            error: row.f64("error")?[0],
        };
        let (kn, kt, fft_pairs) = (
            row.f64("kn")?[0],
            row.f64("kt")?[0],
            row.f64("fft_pairs")?[0],
        );
        return Ok((
            StaticContact {
                solution,
                kn,
                kt,
                fft_pairs,
            },
            shear,
        ));
    }

    let shear_axes = context.inputs.plan.shear;
    let curve_due = context.curves_due();
    let start = predicted.as_ref().map(|p| &p.pressure[..]);
    let ((solution, kn, kt, curve), fft_pairs) = context.timed(Stage::StaticContact, |joint| {
        let solution = joint.static_contact(wear, start)?;
        let cap = joint.pressure_cap.unwrap_or(f64::INFINITY);
        let elastic: Vec<bool> = solution
            .pressure
            .iter()
            .map(|&p| p > 0.0 && p < cap)
            .collect();
        let closed: Vec<bool> = solution.pressure.iter().map(|&p| p > 0.0).collect();
        let kn = stiffness::normal(&mut joint.half_space, &elastic)?.total;
        let kt = stiffness::tangential(&mut joint.half_space, &closed, shear_axes)?.total;
        let curve = curve_due
            .then(|| curves::indentation(joint, wear, &solution))
            .transpose()?;
        Ok((solution, kn, kt, curve))
    })?;
    if let Some(curve) = curve {
        draft.put(
            TableName::Indentation,
            &keys.static_contact,
            &curve.table(TableName::Indentation)?,
        )?;
    }
    let row = Table::builder(TableName::StaticContact)
        .column("approach", vec![solution.approach])
        .column("kn", vec![kn])
        .column("kt", vec![kt])
        .column("error", vec![solution.error])
        .column("iterations", vec![solution.iterations as i64])
        .column("fft_pairs", vec![fft_pairs])
        .build()?;
    draft.put(TableName::StaticContact, &keys.static_contact, &row)?;
    let shear = predicted.map_or_else(Vec::new, |p| p.shear);
    let fields = Predicted {
        gap: solution.gap.clone(),
        pressure: solution.pressure.clone(),
        shear,
    };
    draft.put(
        TableName::ContactField,
        &keys.static_contact,
        &fields.table(context)?,
    )?;
    Ok((
        StaticContact {
            solution,
            kn,
            kt,
            fft_pairs,
        },
        fields.shear,
    ))
}
