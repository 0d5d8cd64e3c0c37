//! The reduced structure, once a run and shared between runs.

use super::context::{Clock, parts};
use super::{RunError, Stage};
use crate::linalg::Matrix;
use crate::recipe::{Inputs, StructureSource};
use crate::store::{Cache, Kept, RunStore, StageKey};
use crate::structure::reduction::{Ports, Reduced};
use crate::structure::resonator::Resonator;
use crate::tables::{Table, TableName, TypedTable, typed};

const TABLES: [TableName; 4] = [
    TableName::Structure,
    TableName::StructurePort,
    TableName::StructureMode,
    TableName::StructureResidual,
];

const AXES: [&str; 3] = ["x", "y", "z"];

/// The structure of a run.
pub struct Stored {
    /// None for an oscillator, which needs no reduction.
    pub reduced: Option<Reduced>,
    pub key: StageKey,
}

/// The reduced structure: that of this run, that of another one of the same structure, or computed.
pub fn structure(
    inputs: &Inputs,
    store: &mut RunStore,
    cache: Option<&Cache>,
    clock: &mut Clock,
) -> Result<Option<Stored>, RunError> {
    let Some(structure) = &inputs.recipe.structure else {
        return Ok(None);
    };
    let mut parameters = parts(&inputs.recipe, &["structure"]);
    // Another version may mesh or reduce otherwise.
    parameters["version"] = env!("CARGO_PKG_VERSION").into();
    let key = StageKey::new(Stage::Structure.name(), &TABLES, &parameters, &[]);
    let StructureSource::Resonator { geometry } = &structure.source else {
        return Ok(Some(Stored { reduced: None, key }));
    };
    let tables = match own(store, &key)? {
        Some(tables) => tables,
        None => {
            let tables = match shared(cache, &key, clock) {
                Some(tables) => tables,
                None => clock.timed(Stage::Structure, || {
                    tables_of(&geometry.reduce(structure.modes)?, geometry)
                })?,
            };
            for (name, table) in TABLES.iter().zip(&tables) {
                store.put_once(*name, &key, table)?;
            }
            share(cache, store, &key, &tables, clock);
            tables
        }
    };
    Ok(Some(Stored {
        reduced: Some(reduced_of(&tables)?),
        key,
    }))
}

fn own(store: &RunStore, key: &StageKey) -> Result<Option<Vec<Table>>, RunError> {
    let mut found = Vec::with_capacity(TABLES.len());
    for name in TABLES {
        match store.once(name, key)? {
            Kept::Valid(table) => found.push(table),
            Kept::Stale(_) => return Ok(None),
        }
    }
    Ok(Some(found))
}

/// No run fails for its cache: it computes what it cannot find, and says so.
fn shared(cache: Option<&Cache>, key: &StageKey, clock: &Clock) -> Option<Vec<Table>> {
    let cache = cache?;
    match cache.get(&TABLES, key) {
        Ok(Some(tables)) => {
            clock.observer.notice(&format!(
                "the reduced structure is there already, in {}",
                cache.root().display()
            ));
            Some(tables)
        }
        Ok(None) => None,
        Err(error) => {
            clock
                .observer
                .notice(&format!("the cache of structures cannot be read: {error}"));
            None
        }
    }
}

fn share(cache: Option<&Cache>, store: &RunStore, key: &StageKey, tables: &[Table], clock: &Clock) {
    let Some(cache) = cache else {
        return;
    };
    if matches!(cache.get(&TABLES, key), Ok(Some(_))) {
        return;
    }
    let named: Vec<(TableName, &Table)> = TABLES.into_iter().zip(tables).collect();
    if let Err(error) = cache.put(key, &named, store.provenance()) {
        clock.observer.notice(&format!(
            "the structure is not shared with other runs: {error}"
        ));
    }
}

fn tables_of(reduced: &Reduced, geometry: &Resonator) -> Result<Vec<Table>, RunError> {
    let ports = &reduced.ports;
    let count = ports.combinations.len();
    let contact = ports.contact_ports();
    let centres = geometry.contact_centres();
    let element = |port: usize| (port < contact).then_some(port / 3);
    let mut port = typed::StructurePort::default();
    for p in 0..count {
        let [x, y] = element(p).map_or([0.0; 2], |e| centres[e]);
        port.port.push(p as i32);
        port.element.push(element(p).map_or(-1, |e| e as i32));
        port.point.push(match element(p) {
            Some(_) => String::new(),
            None => ports.points[(p - contact) / 3].clone(),
        });
        port.axis.push(AXES[p % 3].to_owned());
        port.x.push(x);
        port.y.push(y);
        port.area
            .push(element(p).map_or(0.0, |_| geometry.contact_area()));
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
        factor_entries: reduced.factor_entries as i64,
    };
    Ok(vec![
        structure.to_table()?,
        port.to_table()?,
        mode.to_table()?,
        residual.to_table()?,
    ])
}

/// The reduced structure as its tables hold it, also right after it was computed: every run starts from the same numbers.
fn reduced_of(tables: &[Table]) -> Result<Reduced, RunError> {
    let [structure, port, mode, residual] = tables else {
        unreachable!("a structure has four tables");
    };
    let structure = typed::Structure::of(structure)?;
    let port = typed::StructurePort::of(port)?;
    let typed::StructureMode {
        frequency, shape, ..
    } = typed::StructureMode::of(mode)?;
    let residual = typed::StructureResidual::of(residual)?;
    let count = port.element.len();
    let contacts = port.element.iter().filter(|e| **e >= 0).count() / 3;
    let of_mode: Vec<f64> = frequency.iter().copied().step_by(count).collect();
    let rigid = of_mode.iter().filter(|f| **f == 0.0).count();
    let part = |first: usize, modes: usize| {
        Matrix::from_fn(count, modes, |p, r| shape[(first + r) * count + p])
    };
    let symmetric = |values: &[f64]| {
        Matrix::from_fn(count, count, |i, j| {
            let (row, column) = (i.max(j), i.min(j));
            values[row * (row + 1) / 2 + column]
        })
    };
    Ok(Reduced {
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
        residual: symmetric(&residual.residual),
        residual_slope: symmetric(&residual.residual_slope),
        mass: structure.mass,
        mode_residual: structure.error_modes,
        factor_entries: structure.factor_entries as usize,
    })
}
