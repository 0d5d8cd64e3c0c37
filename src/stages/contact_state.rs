//! The contact of a joint, read from tables: fields on its kept cells, and harmonics of its motion.

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

/// Fields of a contact on all cells of the grid.
pub struct Fields {
    pub gap: Vec<f64>,
    pub pressure: Vec<f64>,
    /// One field per axis; empty while the contact has no shear.
    pub shear: ByAxis<Vec<f64>>,
}

impl Fields {
    /// Reads the fields from a table.
    pub fn of(patch: &Patch, table: &typed::ContactField) -> Fields {
        let shear = [&table.shear_x, &table.shear_y].into_iter().flatten();
        Fields {
            gap: patch.scatter(&table.gap),
            pressure: patch.scatter(&table.pressure),
            shear: shear.map(|shear| patch.scatter(shear)).collect(),
        }
    }

    /// Writes the fields as a table, without the fields of a cycle.
    pub fn table(&self, patch: &Patch) -> typed::ContactField {
        let (i, j) = patch.indices();
        let mut shear = self.shear.iter().map(|shear| patch.joint_values(shear));
        typed::ContactField {
            i,
            j,
            gap: patch.joint_values(&self.gap),
            pressure: patch.joint_values(&self.pressure),
            shear_x: shear.next(),
            shear_y: shear.next(),
            slip_path: None,
            dissipation: None,
        }
    }
}

/// Returns the worn state in the tables of wear, contact fields and fretting cycle.
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
        Ok(patch.scatter(required_column(TableName::ContactField, values, column)?))
    };
    Ok(WornState {
        wear: wear_of(patch, wear),
        pressure,
        cycle: CycleSolution {
            shear: match_axes(recipe, patch, shear),
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

/// Returns the solution of the static contact in a row of the static contact and in the contact fields.
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

/// Returns the compliance of the fine contact, in runs that compute contact elements from it.
pub fn compliance_of(row: &typed::StaticContact) -> Result<Compliance, TableError> {
    let kn = required_column(TableName::StaticContact, &row.kn, "kn")?;
    let kt = required_column(TableName::StaticContact, &row.kt, "kt")?;
    Ok(Compliance::from_stiffness(*kn, *kt))
}

/// Returns the tangential compliance of a static contact \[m/N\]; `None` if the run does not compute it.
pub fn tangential_compliance(row: &typed::StaticContact) -> Option<f64> {
    row.kt.map(f64::recip)
}

/// Returns the value of a column that every worn state has.
pub fn required_column<'a, T>(
    table: TableName,
    value: &'a Option<T>,
    column: &str,
) -> Result<&'a T, TableError> {
    value.as_ref().ok_or_else(|| TableError::MissingColumn {
        table: table.as_str().to_owned(),
        column: column.to_owned(),
    })
}

/// Returns the wear of an iteration on all cells; zero without a wear field.
pub fn wear_of(patch: &Patch, field: Option<typed::WearField>) -> Vec<f64> {
    match field {
        Some(field) => patch.scatter(&field.wear_depth),
        None => vec![0.0; patch.grid.len()],
    }
}

/// Returns the rough contact of a stage that declares it.
pub fn contact_of(recipe: &Recipe) -> &Contact {
    recipe
        .contact()
        .expect("a stage that solves a contact declares it")
}

/// Returns the shear along the axes of the recipe. Inherited fields may have fewer or more axes. An empty field stays
/// empty.
pub fn match_axes(recipe: &Recipe, patch: &Patch, mut shear: ByAxis<Vec<f64>>) -> ByAxis<Vec<f64>> {
    if !shear.is_empty() {
        shear.resize_with(axes(recipe), || vec![0.0; patch.grid.len()]);
    }
    shear
}

/// Returns the number of axes with shear.
pub fn axes(recipe: &Recipe) -> usize {
    match contact_of(recipe).shear {
        Shear::AlongX => 1,
        Shear::InPlane => 2,
    }
}

/// Reads the parameters of contact elements from their tables.
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
pub struct StaticState {
    /// Wear depth \[m\].
    pub wear: Vec<f64>,
    /// Contact under the static load.
    pub contact: NormalSolution,
    /// Initial shear \[Pa\]; empty if the contact has no initial shear.
    pub start: ByAxis<Vec<f64>>,
}

impl StaticState {
    /// Reads the fine contact of an iteration.
    pub fn of(reads: &StageInputs, solvers: &mut Solvers) -> Result<StaticState, RunError> {
        let patch = solvers.joint(reads)?.patch.clone();
        let mut fields = Fields::of(&patch, &reads.table()?);
        let start = match_axes(&reads.recipe, &patch, std::mem::take(&mut fields.shear));
        Ok(StaticState {
            wear: wear_of(&patch, reads.optional_table()?),
            contact: solution_of(&reads.table()?, fields),
            start,
        })
    }

    /// Returns the initial shear, if there is one.
    pub fn start(&self) -> Option<&ByAxis<Vec<f64>>> {
        (!self.start.is_empty()).then_some(&self.start)
    }
}

/// Returns coefficients in the order of a [`Harmonics`]: the cosine and the sine coefficient of each order. The mean
/// has a cosine coefficient only.
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

/// Returns the harmonics of a response and its coefficients. Harmonics vary fastest, ports slowest.
pub fn harmonics_of(response: &typed::Response) -> Result<(Harmonics, Vec<f64>), RunError> {
    let orders = &response.harmonic;
    let (cosine, sine) = (&response.displacement_cosine, &response.displacement_sine);
    let displacement = coefficients_of(orders, cosine, sine);
    let mut port_orders: Vec<u32> = orders.iter().map(|order| *order as u32).collect();
    port_orders.sort_unstable();
    port_orders.dedup();
    Ok((Harmonics::new(&port_orders)?, displacement))
}

/// Returns the displacement of each element at the end of a straight motion, along x and y \[m\].
pub fn reach_of(elements: &ContactElements, motion: &Motion) -> Vec<[f64; 2]> {
    let mut reach = vec![[0.0; 2]; elements.len()];
    let Some(straight) = motion.straight() else {
        return reach;
    };
    let (common_motion, nodal_motion) = straight.end.split_at(motion.channels().count());
    let nodal_motion = elements
        .nodes()
        .filter(|_| !nodal_motion.is_empty())
        .map(|nodal_grid| {
            let axes = nodal_motion.chunks_exact(nodal_grid.interpolation.nodes());
            (axes, &nodal_grid.numbers)
        });
    for axis in 0..motion.drive.len() {
        reach
            .iter_mut()
            .for_each(|reach| reach[axis] = common_motion[axis]);
    }
    if let Some((axes, numbers)) = nodal_motion {
        for (axis, nodes) in axes.enumerate() {
            for (reach, &node) in reach.iter_mut().zip(numbers) {
                reach[axis] += nodes[node];
            }
        }
    }
    reach
}
