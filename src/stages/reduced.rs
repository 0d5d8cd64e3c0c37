//! The reduced structure of a run, read from its tables.

use super::RunError;
use super::stage_inputs::StageInputs;
use super::structure::AXES;
use crate::linalg::Matrix;
use crate::recipe::Recipe;
use crate::store::{Damage, DamageKind, Layout, RunReader, StoreError};
use crate::structure::reduction::{Ports, ReducedStructure};
use crate::tables::{TableName, Tables, TypedTable, typed};

/// The tables of a reduced structure.
pub const TABLES: [TableName; 5] = [
    TableName::Structure,
    TableName::StructurePort,
    TableName::StructureMode,
    TableName::StructureResidual,
    TableName::StructureDamping,
];

/// Builds the reduced structure from the tables of the stage `structure`. Returns `None` for an oscillator.
pub fn reduced_of(reads: &StageInputs) -> Result<Option<ReducedStructure>, RunError> {
    let Some(structure) = reads.optional_table::<typed::Structure>()? else {
        return Ok(None);
    };
    let tables = ReducedTables {
        structure,
        port: reads.table()?,
        mode: reads.table()?,
        residual: reads.table()?,
        damping: reads.optional_table()?,
    };
    Ok(Some(tables.reduced()))
}

/// Tables of a reduced structure.
pub struct ReducedTables {
    pub structure: typed::Structure,
    pub port: typed::StructurePort,
    pub mode: typed::StructureMode,
    pub residual: typed::StructureResidual,
    pub damping: Option<typed::StructureDamping>,
}

impl ReducedTables {
    /// Reads the tables of a run; `None` if the run has no finite element structure.
    ///
    /// # Errors
    /// [`RunError`] if a table cannot be read. [`StoreError::Damaged`] if the tables do not match each other.
    pub fn of(run: &RunReader) -> Result<Option<ReducedTables>, RunError> {
        fn read<T: TypedTable>(run: &RunReader, table: TableName) -> Result<Option<T>, RunError> {
            let table = run.read_once(table)?;
            Ok(table.as_ref().map(T::of).transpose()?)
        }
        let [structure, port, mode, residual, damping] = TABLES;
        let once_tables = (
            read(run, structure)?,
            read(run, port)?,
            read(run, mode)?,
            read(run, residual)?,
        );
        let (Some(structure), Some(port), Some(mode), Some(residual)) = once_tables else {
            return Ok(None);
        };
        let tables = ReducedTables {
            structure,
            port,
            mode,
            residual,
            damping: read(run, damping)?,
        };
        match tables.check() {
            Ok(()) => Ok(Some(tables)),
            Err(reason) => Err(RunError::Store(StoreError::Damaged(Damage {
                path: Layout::at(run.path()).once_table(TABLES[1]),
                kind: DamageKind::Unreadable { reason },
            }))),
        }
    }

    /// Returns the damage if the tables of a run do not match each other.
    ///
    /// # Errors
    /// [`RunError`] for a table that cannot be read.
    pub fn damage(run: &RunReader) -> Result<Option<Damage>, RunError> {
        match ReducedTables::of(run) {
            Ok(_) => Ok(None),
            Err(RunError::Store(StoreError::Damaged(damage))) => Ok(Some(damage)),
            Err(error) => Err(error),
        }
    }

    /// Checks that stored tables describe one structure and contain the points of the recipe. Tables of other stages
    /// pass.
    ///
    /// # Errors
    /// A sentence that states the mismatch.
    pub fn check_stored(stored: &Tables, recipe: &Recipe) -> Result<(), String> {
        fn read<T: TypedTable>(stored: &Tables) -> Result<Option<T>, String> {
            let table = stored.get(&T::TABLE).map(T::of).transpose();
            table.map_err(|error| error.to_string())
        }
        let stored_tables = (read(stored)?, read(stored)?, read(stored)?, read(stored)?);
        let (Some(structure), Some(port), Some(mode), Some(residual)) = stored_tables else {
            return Ok(());
        };
        let tables = ReducedTables {
            structure,
            port,
            mode,
            residual,
            damping: read(stored)?,
        };
        tables.check()?;
        let points = recipe.structure.as_ref().zip(recipe.response.as_ref());
        let points = points
            .map(|(structure, response)| structure.points(response, recipe.elements().is_some()));
        let points = points.into_iter().flatten().map(|port| port.at);
        let pressing = recipe
            .contact()
            .and_then(|contact| contact.pressing.as_ref());
        let pressed = pressing.into_iter().flat_map(|pressing| pressing.points());
        for point in points.chain(pressed) {
            if !tables.port.point.contains(&point) {
                return Err(format!("structure_port has no point {point}"));
            }
        }
        Ok(())
    }

    /// Checks that the tables describe one structure. The tables must contain three ports per contact element and per
    /// point, and every mode at every port. The matrices must be lower triangles with the matching number of rows.
    ///
    /// # Errors
    /// A sentence that states the mismatch.
    fn check(&self) -> Result<(), String> {
        let ReducedTables {
            structure,
            port,
            mode,
            residual,
            damping,
        } = self;
        let count = port.port.len();
        let contacts = usize::try_from(structure.contact_elements).ok();
        let contacts = contacts.and_then(|elements| elements.checked_mul(3));
        let Some(contacts) = contacts.filter(|contacts| *contacts <= count) else {
            return Err(format!(
                "structure has {} contact elements, structure_port has {count} rows",
                structure.contact_elements
            ));
        };
        let is_port = |p: usize| {
            let is_contact = p < contacts;
            let element = if is_contact { (p / 3) as i32 } else { -1 };
            port.port[p] == p as i32
                && port.element[p] == element
                && port.axis[p] == AXES[p % 3]
                && port.point[p].is_empty() == is_contact
                && port.point[p] == port.point[p - p % 3]
        };
        if count == 0 || count % 3 != 0 || !(0..count).all(is_port) {
            return Err(
                "structure_port does not have three ports for each contact element and point"
                    .to_owned(),
            );
        }
        let is_mode = |k: usize| {
            mode.mode[k] == (k / count) as i32
                && mode.port[k] == (k % count) as i32
                && mode.frequency[k] == mode.frequency[k - k % count]
                && mode.frequency[k] >= 0.0
        };
        let rigid_first = |pair: &[f64]| pair[0] == 0.0 || pair[1] > 0.0;
        let rows = mode.mode.len();
        if rows % count != 0
            || !(0..rows).all(is_mode)
            || !mode.frequency.windows(2).all(rigid_first)
        {
            return Err(format!(
                "structure_mode does not have all modes, rigid ones first, at the {count} ports"
            ));
        }
        let is_triangle = |row: &[i32], column: &[i32], size: usize| {
            let places = (0..size).flat_map(|row| (0..=row).map(move |column| [row, column]));
            let stored_places = row.iter().zip(column).map(|(row, column)| [*row, *column]);
            places
                .map(|place| place.map(|k| k as i32))
                .eq(stored_places)
        };
        if !is_triangle(&residual.row, &residual.column, count) {
            return Err(format!("structure_residual does not have {count} rows"));
        }
        let modes = rows / count;
        if let Some(damping) = damping
            && !is_triangle(&damping.row, &damping.column, modes)
        {
            return Err(format!("structure_damping does not have {modes} rows"));
        }
        Ok(())
    }

    /// Builds the reduced structure.
    pub fn reduced(&self) -> ReducedStructure {
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
        let frequencies: Vec<f64> = frequency.iter().copied().step_by(count).collect();
        let rigid = frequencies.iter().filter(|f| **f == 0.0).count();
        let part = |first: usize, modes: usize| {
            Matrix::from_fn(count, modes, |p, r| shape[(first + r) * count + p])
        };
        let symmetric = |values: &[f64], size: usize| {
            Matrix::from_fn(size, size, |i, j| {
                let (row, column) = (i.max(j), i.min(j));
                values[row * (row + 1) / 2 + column]
            })
        };
        ReducedStructure {
            ports: Ports {
                // Only the reduction of the structure needs the combinations of the ports.
                combinations: vec![Vec::new(); count],
                contacts,
                points: port.point[3 * contacts..]
                    .iter()
                    .step_by(3)
                    .cloned()
                    .collect(),
            },
            rigid: part(0, rigid),
            omega: frequencies[rigid..]
                .iter()
                .map(|f| f * std::f64::consts::TAU)
                .collect(),
            shapes: part(rigid, frequencies.len() - rigid),
            residual: symmetric(&residual.residual, count),
            residual_slope: symmetric(&residual.residual_slope, count),
            damping: damping
                .as_ref()
                .map(|damping| symmetric(&damping.damping, frequencies.len())),
            hysteretic: damping
                .as_ref()
                .map(|damping| symmetric(&damping.hysteretic, frequencies.len())),
            mass: structure.mass,
            mode_residual: structure.error_modes,
            factor_entries: structure.factor_entries as usize,
            reference: None,
        }
    }
}
