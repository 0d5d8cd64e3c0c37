//! The reduced structure, once per run and shared between runs.

use super::RunError;
use super::declaration::Declaration;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::reduced::reduction_error;
use crate::linalg::Matrix;
use crate::recipe::{Layout, Part};
use crate::structure::outline::Outline;
use crate::structure::reduction::{ReducedStructure, ReferenceFlexibility};
use crate::tables::{TableName, typed};

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Tables of a structure: the tables of the reduced structure, and its outline, which no stage reads.
const TABLES: [TableName; 7] = {
    let [structure, port, mode, residual, damping] = super::reduced::TABLES;
    [
        structure,
        port,
        mode,
        residual,
        damping,
        TableName::StructureOutline,
        TableName::StructureOutlineMode,
    ]
};

/// Modes, residual flexibility and outline of a structure. The modes and the flexibility refer to the contact elements
/// and the points of the structure.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Structure,
    when: When::Once,
    recipe: &[Part::Structure],
    reads: &[],
    before: &[],
    writes: &TABLES,
    is_due: |_| true,
    shared: true,
    compute,
};

fn compute(reads: &StageInputs, _: &mut Solvers) -> Result<Outputs, RunError> {
    let Some(structure) = &reads.recipe.structure else {
        unreachable!("a run with this stage has a structure");
    };
    match structure.reduce(reads.imported())? {
        Some((reduced, outline)) => {
            let mut outputs = tables_of(&reduced, &structure.layout())?;
            if let Some(outline) = outline {
                put_outline(&outline, &mut outputs)?;
            }
            for note in reads.imported().iter().flat_map(|imported| &imported.notes) {
                outputs.notice(note.clone());
            }
            Ok(outputs)
        }
        None => unreachable!("a structure without a reduction has no such stage"),
    }
}

fn tables_of(reduced: &ReducedStructure, layout: &Layout) -> Result<Outputs, RunError> {
    let ports = &reduced.ports;
    let count = ports.combinations.len();
    let contact = ports.contact_ports();
    let element = |port: usize| (port < contact).then_some(port / 3);
    let mut port = typed::StructurePort::default();
    for p in 0..count {
        let [x, y] = element(p).map_or([0.0; 2], |e| layout.centres[e]);
        port.port.push(p as i32);
        port.element.push(element(p).map_or(-1, |e| e as i32));
        port.point.push(match element(p) {
            Some(_) => String::new(),
            None => ports.points[(p - contact) / 3].clone(),
        });
        port.axis.push(AXES[p % 3].to_owned());
        port.x.push(x);
        port.y.push(y);
        port.area.push(element(p).map_or(0.0, |e| layout.areas[e]));
    }
    let rigid = reduced.rigid.columns();
    let mut mode = typed::StructureMode::default();
    for m in 0..rigid + reduced.omega.len() {
        for p in 0..count {
            let (frequency, shape) = match m.checked_sub(rigid) {
                None => (0.0, reduced.rigid[(p, m)]),
                Some(elastic) => (
                    reduced.omega[elastic] / std::f64::consts::TAU,
                    reduced.shapes[(p, elastic)],
                ),
            };
            mode.mode.push(m as i32);
            mode.port.push(p as i32);
            mode.frequency.push(frequency);
            mode.shape.push(shape);
        }
    }
    let mut residual = typed::StructureResidual::default();
    for row in 0..count {
        for column in 0..=row {
            residual.row.push(row as i32);
            residual.column.push(column as i32);
            residual.residual.push(reduced.residual[(row, column)]);
            residual
                .residual_slope
                .push(reduced.residual_slope[(row, column)]);
        }
    }
    let structure = typed::Structure {
        mass: reduced.mass,
        contact_elements: ports.contacts as i64,
        error_modes: reduced.mode_residual,
        error_receptance: reduction_error(reduced)?,
        checked_frequency: reduced
            .reference
            .as_ref()
            .map(ReferenceFlexibility::frequency),
        factor_entries: reduced.factor_entries as i64,
    };
    let mut outputs = Outputs::default();
    outputs.add_table(&structure)?;
    outputs.add_table(&port)?;
    outputs.add_table(&mode)?;
    outputs.add_table(&residual)?;
    if reduced.damping.is_some() || reduced.hysteretic.is_some() {
        let mut rows = typed::StructureDamping::default();
        let entry = |matrix: &Option<Matrix>, row: usize, column: usize| {
            let matrix = matrix.as_ref();
            matrix.map_or(0.0, |matrix| matrix[(row, column)])
        };
        for row in 0..reduced.rigid.columns() + reduced.omega.len() {
            for column in 0..=row {
                rows.row.push(row as i32);
                rows.column.push(column as i32);
                rows.damping.push(entry(&reduced.damping, row, column));
                rows.hysteretic
                    .push(entry(&reduced.hysteretic, row, column));
            }
        }
        outputs.add_table(&rows)?;
        if has_residual(reduced) {
            outputs.notice(format!(
                "dynamics.modes = {}: the damping matrix of the structure files acts on these modes only; the residual flexibility of the other modes is undamped. \
                 Peaks are too high where much of the energy is close to the joint; increase dynamics.modes until the peaks no longer change",
                reduced.omega.len()
            ));
        }
    }
    Ok(outputs)
}

/// Adds the tables of the outline and of its modes.
fn put_outline(outline: &Outline, outputs: &mut Outputs) -> Result<(), RunError> {
    let mut points = typed::StructureOutline::default();
    let mut positions = outline.positions.iter().enumerate();
    for (line, (part, count)) in outline.lines.iter().enumerate() {
        for (point, &[x, y, z]) in positions.by_ref().take(*count) {
            points.point.push(point as i32);
            points.line.push(line as i32);
            points.part.push(part.clone());
            points.x.push(x);
            points.y.push(y);
            points.z.push(z);
        }
    }
    let mut modes = typed::StructureOutlineMode::default();
    for mode in 0..outline.shapes.columns() {
        let shape = outline.shapes.column(mode);
        for (point, along) in shape.chunks_exact(3).enumerate() {
            modes.mode.push(mode as i32);
            modes.point.push(point as i32);
            modes.shape_x.push(along[0]);
            modes.shape_y.push(along[1]);
            modes.shape_z.push(along[2]);
        }
    }
    outputs.add_table(&points)?;
    outputs.add_table(&modes)
}

/// Returns true if the omitted modes contribute more flexibility than rounding errors.
fn has_residual(reduced: &ReducedStructure) -> bool {
    const ROUNDING: f64 = 1e-9;
    (0..reduced.ports.len()).any(|port| {
        let mode_flexibility = |r: usize| (reduced.shapes[(port, r)] / reduced.omega[r]).powi(2);
        let modal_flexibility: f64 = (0..reduced.omega.len()).map(mode_flexibility).sum();
        reduced.residual[(port, port)] > ROUNDING * modal_flexibility
    })
}
