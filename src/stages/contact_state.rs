//! The contact of a joint as the tables hold it: fields on its kept cells, and what moves it.

use super::RunError;
use super::solvers::Solvers;
use super::stage_inputs::StageInputs;
use crate::contact::Shear;
use crate::contact::normal::NormalSolution;
use crate::dynamics::Harmonics;
use crate::grid::{ByAxis, Patch};
use crate::model_update::{Compliance, ContactElements, ElementParameters, Sliders};
use crate::recipe::{Contact, Recipe};
use crate::tables::{TableError, TableName, typed};
use crate::wear::Motion;
use crate::wear::cycle::CycleSolution;
use crate::wear::joint::WornState;

/// The fields of a contact on all cells of the grid.
pub struct Fields {
    pub gap: Vec<f64>,
    pub pressure: Vec<f64>,
    /// One field an axis; of none where the contact has no shear yet.
    pub shear: ByAxis<Vec<f64>>,
}

impl Fields {
    /// From a table.
    pub fn of(patch: &Patch, table: &typed::ContactField) -> Fields {
        let shear = [&table.shear_x, &table.shear_y].into_iter().flatten();
        Fields {
            gap: patch.spread(&table.gap),
            pressure: patch.spread(&table.pressure),
            shear: shear.map(|shear| patch.spread(shear)).collect(),
        }
    }

    /// As a table, without the fields of a cycle.
    pub fn table(&self, patch: &Patch) -> typed::ContactField {
        let (i, j) = patch.indices();
        let mut shear = self.shear.iter().map(|shear| patch.gather(shear));
        typed::ContactField {
            i,
            j,
            gap: patch.gather(&self.gap),
            pressure: patch.gather(&self.pressure),
            shear_x: shear.next(),
            shear_y: shear.next(),
            slip_path: None,
            dissipation: None,
        }
    }
}

/// A worn state as its tables hold it.
pub fn worn_state(
    recipe: &Recipe,
    patch: &Patch,
    wear: Option<typed::WearField>,
    fields: &typed::ContactField,
    cycle: &typed::FrettingCycle,
) -> Result<WornState, TableError> {
    let Fields {
        pressure, shear, ..
    } = Fields::of(patch, fields);
    let field = |values: &Option<Vec<f64>>, column| -> Result<Vec<f64>, TableError> {
        Ok(patch.spread(there(TableName::ContactField, values, column)?))
    };
    Ok(WornState {
        wear: wear_of(patch, wear),
        pressure,
        cycle: CycleSolution {
            shear: on_axes(recipe, patch, shear),
            slip_path: field(&fields.slip_path, "slip_path")?,
            energy: field(&fields.dissipation, "dissipation")?,
            dissipation: cycle.dissipated_energy,
            instants: Vec::new(),
            steps: 0,
            error: cycle.error_tangential,
            dissipation_error: cycle.error_cycle * cycle.dissipated_energy,
        },
    })
}

/// The static contact of both its tables.
pub fn solution_of(row: &typed::StaticContact, fields: Fields) -> NormalSolution {
    let or_zero = |pair: [Option<f64>; 2]| pair.map(|value| value.unwrap_or(0.0));
    NormalSolution {
        pressure: fields.pressure,
        gap: fields.gap,
        approach: row.approach,
        iterations: row.iterations as usize,
        rotation: or_zero([row.rotation_x, row.rotation_y]),
        load: row.normal_load,
        moment: [row.moment_x, row.moment_y],
        error: row.error,
    }
}

/// Compliance of the fine contact, in runs whose contact elements are made of it.
pub fn compliance_of(row: &typed::StaticContact) -> Result<Compliance, TableError> {
    let kn = there(TableName::StaticContact, &row.kn, "kn")?;
    let kt = there(TableName::StaticContact, &row.kt, "kt")?;
    Ok(Compliance::of(*kn, *kt))
}

/// Tangential compliance of a static contact \[m/N\]; none where it was not asked for.
pub fn tangential_compliance(row: &typed::StaticContact) -> Option<f64> {
    row.kt.map(f64::recip)
}

/// A column that every state of wear has.
pub fn there<'a, T>(
    table: TableName,
    value: &'a Option<T>,
    column: &str,
) -> Result<&'a T, TableError> {
    value.as_ref().ok_or_else(|| TableError::MissingColumn {
        table: table.as_str().to_owned(),
        column: column.to_owned(),
    })
}

/// The wear of an iteration on all cells; none of the unworn state and in a scene without wear.
pub fn wear_of(patch: &Patch, field: Option<typed::WearField>) -> Vec<f64> {
    match field {
        Some(field) => patch.spread(&field.wear_depth),
        None => vec![0.0; patch.grid.len()],
    }
}

/// The rough contact of a stage that declares it.
pub fn contact_of(recipe: &Recipe) -> &Contact {
    recipe
        .contact()
        .expect("a stage that solves a contact declares it")
}

/// Shear along the axes that a recipe has: what was inherited may have another one less, or more. No shear at all stays none.
pub fn on_axes(recipe: &Recipe, patch: &Patch, mut shear: ByAxis<Vec<f64>>) -> ByAxis<Vec<f64>> {
    if !shear.is_empty() {
        shear.resize_with(axes(recipe), || vec![0.0; patch.grid.len()]);
    }
    shear
}

pub fn axes(recipe: &Recipe) -> usize {
    match contact_of(recipe).shear {
        Shear::AlongX => 1,
        Shear::InPlane => 2,
    }
}

/// Parameters of contact elements as their tables have them.
pub fn parameters_of(
    elements: &typed::ContactElement,
    sliders: Option<typed::ContactSlider>,
) -> ElementParameters {
    ElementParameters {
        normal_load: elements.normal_load.clone(),
        gap: elements.gap.clone(),
        kn: elements.kn.clone(),
        kt: elements.kt.clone(),
        sliders: sliders.map(|table| Sliders {
            element: table.element.iter().map(|&e| e as usize).collect(),
            normal_load: table.normal_load,
            gap: table.gap,
            kn: table.kn,
            kt: table.kt,
        }),
    }
}

/// The fine contact at rest.
pub struct AtRest {
    /// Wear depth \[m\].
    pub wear: Vec<f64>,
    /// Under its load.
    pub contact: NormalSolution,
    /// Shear that is there already; of no axis if there is none \[Pa\].
    pub start: ByAxis<Vec<f64>>,
}

impl AtRest {
    /// That of an iteration.
    pub fn of(reads: &StageInputs, solvers: &mut Solvers) -> Result<AtRest, RunError> {
        let patch = solvers.joint(reads)?.patch.clone();
        let mut fields = Fields::of(&patch, &reads.table()?);
        let start = on_axes(&reads.recipe, &patch, std::mem::take(&mut fields.shear));
        Ok(AtRest {
            wear: wear_of(&patch, reads.maybe()?),
            contact: solution_of(&reads.table()?, fields),
            start,
        })
    }

    /// The shear that is there already; none if there is none.
    pub fn start(&self) -> Option<&ByAxis<Vec<f64>>> {
        (!self.start.is_empty()).then_some(&self.start)
    }
}

/// Coefficients in the order of a [`Harmonics`], those of cosine and sine one after the other; of the mean there is a cosine alone.
pub fn coefficients_of(orders: &[i32], cosine: &[f64], sine: &[f64]) -> Vec<f64> {
    let mut coefficients = Vec::with_capacity(2 * orders.len());
    for (order, (cosine, sine)) in orders.iter().zip(cosine.iter().zip(sine)) {
        coefficients.push(*cosine);
        if *order > 0 {
            coefficients.push(*sine);
        }
    }
    coefficients
}

/// Harmonics of a response, and its coefficients, ports slow.
pub fn harmonics_of(response: &typed::Response) -> Result<(Harmonics, Vec<f64>), RunError> {
    let orders = &response.harmonic;
    let (cosine, sine) = (&response.displacement_cosine, &response.displacement_sine);
    let displacement = coefficients_of(orders, cosine, sine);
    let mut of_a_port: Vec<u32> = orders.iter().map(|order| *order as u32).collect();
    of_a_port.sort_unstable();
    of_a_port.dedup();
    Ok((Harmonics::new(&of_a_port)?, displacement))
}

/// Displacement of each element at the end of a straight motion, along x and y \[m\].
pub fn reach_of(elements: &ContactElements, motion: &Motion) -> Vec<[f64; 2]> {
    let mut reach = vec![[0.0; 2]; elements.len()];
    let Some(straight) = motion.straight() else {
        return reach;
    };
    let (all, own) = straight.end.split_at(motion.channels().count());
    let own = elements.nodes().filter(|_| !own.is_empty()).map(|of| {
        let axes = own.chunks_exact(of.interpolation.nodes());
        (axes, &of.numbers)
    });
    for axis in 0..motion.drive.len() {
        reach.iter_mut().for_each(|reach| reach[axis] = all[axis]);
    }
    if let Some((axes, numbers)) = own {
        for (axis, nodes) in axes.enumerate() {
            for (reach, &node) in reach.iter_mut().zip(numbers) {
                reach[axis] += nodes[node];
            }
        }
    }
    reach
}
