//! The reduced structure of a run, from its tables.

use super::RunError;
use super::reads::Reads;
use crate::linalg::Matrix;
use crate::store::RunReader;
use crate::structure::reduction::{Ports, Reduced};
use crate::tables::{TableName, TypedTable, typed};

/// The tables of a reduced structure.
pub const TABLES: [TableName; 5] = [
    TableName::Structure,
    TableName::StructurePort,
    TableName::StructureMode,
    TableName::StructureResidual,
    TableName::StructureDamping,
];

/// The reduced structure as its tables hold it; none of an oscillator.
pub fn reduced_of(reads: &Reads) -> Result<Option<Reduced>, RunError> {
    let Some(structure) = reads.maybe::<typed::Structure>()? else {
        return Ok(None);
    };
    let tables = ReducedTables {
        structure,
        port: reads.table()?,
        mode: reads.table()?,
        residual: reads.table()?,
        damping: reads.maybe()?,
    };
    Ok(Some(tables.reduced()))
}

/// What a run has of its reduced structure.
pub struct ReducedTables {
    pub structure: typed::Structure,
    pub port: typed::StructurePort,
    pub mode: typed::StructureMode,
    pub residual: typed::StructureResidual,
    pub damping: Option<typed::StructureDamping>,
}

impl ReducedTables {
    /// The tables of a run; none where it has no structure in finite elements.
    ///
    /// # Errors
    /// [`RunError`] for a table that cannot be read.
    pub fn of(run: &RunReader) -> Result<Option<ReducedTables>, RunError> {
        fn read<T: TypedTable>(run: &RunReader, table: TableName) -> Result<Option<T>, RunError> {
            let table = run.read_once(table)?;
            Ok(table.as_ref().map(T::of).transpose()?)
        }
        let [structure, port, mode, residual, damping] = TABLES;
        let found = (
            read(run, structure)?,
            read(run, port)?,
            read(run, mode)?,
            read(run, residual)?,
        );
        let (Some(structure), Some(port), Some(mode), Some(residual)) = found else {
            return Ok(None);
        };
        Ok(Some(ReducedTables {
            structure,
            port,
            mode,
            residual,
            damping: read(run, damping)?,
        }))
    }

    /// The reduced structure.
    pub fn reduced(&self) -> Reduced {
        let ReducedTables {
            structure,
            port,
            mode: typed::StructureMode {
                frequency, shape, ..
            },
            residual,
            damping,
        } = self;
        let count = port.element.len();
        let contacts = port.element.iter().filter(|e| **e >= 0).count() / 3;
        let of_mode: Vec<f64> = frequency.iter().copied().step_by(count).collect();
        let rigid = of_mode.iter().filter(|f| **f == 0.0).count();
        let part = |first: usize, modes: usize| {
            Matrix::from_fn(count, modes, |p, r| shape[(first + r) * count + p])
        };
        let symmetric = |values: &[f64], size: usize| {
            Matrix::from_fn(size, size, |i, j| {
                let (row, column) = (i.max(j), i.min(j));
                values[row * (row + 1) / 2 + column]
            })
        };
        Reduced {
            ports: Ports {
                // What a port is a combination of matters to the reduction alone.
                combinations: vec![Vec::new(); count],
                contacts,
                points: port.point[3 * contacts..]
                    .iter()
                    .step_by(3)
                    .cloned()
                    .collect(),
            },
            rigid: part(0, rigid),
            omega: of_mode[rigid..]
                .iter()
                .map(|f| f * std::f64::consts::TAU)
                .collect(),
            shapes: part(rigid, of_mode.len() - rigid),
            residual: symmetric(&residual.residual, count),
            residual_slope: symmetric(&residual.residual_slope, count),
            damping: damping
                .as_ref()
                .map(|found| symmetric(&found.damping, of_mode.len())),
            mass: structure.mass,
            mode_residual: structure.error_modes,
            factor_entries: structure.factor_entries as usize,
            checked: None,
        }
    }
}
