//! The reduced structure, once a run and shared between runs.

use super::context::Clock;
use super::{Inputs, RunError, Stage};
use crate::linalg::Matrix;
use crate::scene::{Resonator, Structure};
use crate::store::{Cache, Kept, RunStore, StageKey};
use crate::structure::reduction::{Ports, Reduced};
use crate::tables::{Table, TableName};

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
    let Some(structure) = &inputs.scene.structure else {
        return Ok(None);
    };
    let mut parameters = inputs.sections(&["structure", "dynamics.modes"]);
    // Another version may mesh or reduce otherwise.
    parameters["version"] = env!("CARGO_PKG_VERSION").into();
    let key = StageKey::new(Stage::Structure.name(), &TABLES, &parameters, &[]);
    let Structure::Resonator { geometry } = structure else {
        return Ok(Some(Stored { reduced: None, key }));
    };
    let modes = inputs.scene.dynamics.as_ref().map_or(0, |d| d.modes);
    let tables = match own(store, &key)? {
        Some(tables) => tables,
        None => {
            let tables = match shared(cache, &key, clock) {
                Some(tables) => tables,
                None => clock.timed(Stage::Structure, || {
                    tables_of(&geometry.reduce(modes)?, geometry)
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
    let range = 0..count;
    let port = Table::builder(TableName::StructurePort)
        .column("port", range.clone().map(|p| p as i32).collect::<Vec<_>>())
        .column(
            "element",
            range
                .clone()
                .map(|p| element(p).map_or(-1, |e| e as i32))
                .collect::<Vec<_>>(),
        )
        .column(
            "point",
            range
                .clone()
                .map(|p| match element(p) {
                    Some(_) => String::new(),
                    None => ports.points[(p - contact) / 3].clone(),
                })
                .collect::<Vec<_>>(),
        )
        .column(
            "axis",
            range
                .clone()
                .map(|p| AXES[p % 3].to_owned())
                .collect::<Vec<_>>(),
        )
        .column(
            "x",
            range
                .clone()
                .map(|p| element(p).map_or(0.0, |e| centres[e][0]))
                .collect::<Vec<_>>(),
        )
        .column(
            "y",
            range
                .clone()
                .map(|p| element(p).map_or(0.0, |e| centres[e][1]))
                .collect::<Vec<_>>(),
        )
        .column(
            "area",
            range
                .map(|p| element(p).map_or(0.0, |_| geometry.contact_area()))
                .collect::<Vec<_>>(),
        )
        .build()?;
    let rigid = reduced.rigid.columns();
    let modes = rigid + reduced.omega.len();
    let mut columns = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for mode in 0..modes {
        for p in 0..count {
            columns.0.push(mode as i32);
            columns.1.push(p as i32);
            if mode < rigid {
                columns.2.push(0.0);
                columns.3.push(reduced.rigid[(p, mode)]);
            } else {
                columns
                    .2
                    .push(reduced.omega[mode - rigid] / std::f64::consts::TAU);
                columns.3.push(reduced.shapes[(p, mode - rigid)]);
            }
        }
    }
    let mode = Table::builder(TableName::StructureMode)
        .column("mode", columns.0)
        .column("port", columns.1)
        .column("frequency", columns.2)
        .column("shape", columns.3)
        .build()?;
    let mut columns = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for row in 0..count {
        for column in 0..=row {
            columns.0.push(row as i32);
            columns.1.push(column as i32);
            columns.2.push(reduced.residual[(row, column)]);
            columns.3.push(reduced.residual_slope[(row, column)]);
        }
    }
    let residual = Table::builder(TableName::StructureResidual)
        .column("row", columns.0)
        .column("column", columns.1)
        .column("residual", columns.2)
        .column("residual_slope", columns.3)
        .build()?;
    let structure = Table::builder(TableName::Structure)
        .column("mass", vec![reduced.mass])
        .column("contact_elements", vec![ports.contacts as i64])
        .column("error_modes", vec![reduced.mode_residual])
        .column("factor_entries", vec![reduced.factor_entries as i64])
        .build()?;
    Ok(vec![structure, port, mode, residual])
}

/// The reduced structure as its tables hold it, also right after it was computed: every run starts from the same numbers.
fn reduced_of(tables: &[Table]) -> Result<Reduced, RunError> {
    let [structure, port, mode, residual] = tables else {
        unreachable!("a structure has four tables");
    };
    let element = port.i32("element")?;
    let count = element.len();
    let contacts = element.iter().filter(|e| **e >= 0).count() / 3;
    let frequency = mode.f64("frequency")?;
    let shape = mode.f64("shape")?;
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
            points: port.text("point")?[3 * contacts..]
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
        residual: symmetric(residual.f64("residual")?),
        residual_slope: symmetric(residual.f64("residual_slope")?),
        mass: structure.f64("mass")?[0],
        mode_residual: structure.f64("error_modes")?[0],
        factor_entries: structure.i64("factor_entries")?[0] as usize,
    })
}
