//! `fretwear export RUN --vtu FOLDER`: the joint and the structure of a run for ParaView.

use std::io::{self, Cursor};
use std::path::Path;
use std::sync::Arc;

use fretwear::grid::Patch;
use fretwear::recipe::{Recipe, StoredPlan};
use fretwear::store::{RealFileSystem, RunReader, StoreError};
use fretwear::tables::{Table, TableName, TypedTable, typed};
use fretwear::vtu::{UnstructuredGrid, VtuError, write_series};

use super::export::make_folder;
use super::run::parse_source;
use super::{CliError, Exit};
use crate::terminal::Results;

/// Writes the cells and the contact elements of the stored iterations of a run, and the edges of the structure. Two
/// collection files list the files of the cells and of the contact elements over the cycles. For `RUN@N`, `export_vtu`
/// writes only iteration N.
pub fn export_vtu(run: &Path, folder: &Path, out: &mut Results) -> Result<Exit, CliError> {
    let text = run.to_string_lossy();
    let is_iteration = text.contains('@') && !run.is_dir();
    let source = is_iteration.then(|| parse_source(&text)).transpose();
    let source = source.map_err(CliError::NoIteration)?;
    let (root, single_iteration) = match &source {
        Some(source) => (source.run.as_path(), Some(source.wear_iteration)),
        None => (run, None),
    };
    let reader = RunReader::open(Arc::new(RealFileSystem), root)?;
    let recipe = reader.plan(StoredPlan::of)?.recipe;
    let iterations: Vec<u64> = match single_iteration {
        Some(iteration) => vec![iteration],
        None => reader.iterations().collect(),
    };
    make_folder(folder)?;
    let mut written = Vec::new();
    let kinds: [(&str, Grid); 2] = [("joint", joint), ("elements", contact_elements)];
    for (kind, grid) in kinds {
        let mut series = Vec::new();
        for &iteration in &iterations {
            let Some(grid) = grid(&reader, &recipe, iteration)? else {
                continue;
            };
            let name = format!("{kind}_{iteration:05}.vtu");
            save(folder, &name, |to| grid.write(kind, to))?;
            let summary: typed::Summary = reader.typed(iteration)?;
            series.push((summary.cycles.unwrap_or(iteration as i64) as f64, name));
        }
        if !series.is_empty() {
            let name = format!("{kind}.pvd");
            save(folder, &name, |to| write_series(&series, to))?;
            let s = if series.len() == 1 { "" } else { "s" };
            written.push(format!("{name} ({} iteration{s})", series.len()));
        }
    }
    let once = |table: TableName| reader.read_once(table);
    let outline = once(TableName::StructureOutline)?.zip(once(TableName::StructureOutlineMode)?);
    if let Some((lines, modes)) = outline {
        let grid = UnstructuredGrid::outline(&typed_table(&lines)?, &typed_table(&modes)?);
        save(folder, "structure.vtu", |to| grid.write("structure", to))?;
        written.push("structure.vtu".to_owned());
    }
    if written.is_empty() {
        return Err(CliError::NothingToDraw {
            path: root.to_owned(),
        });
    }
    writeln!(out, "{}: {}", folder.display(), written.join(", "));
    Ok(Exit::Done)
}

/// Builds the grid of an iteration, if the run has it.
type Grid = fn(&RunReader, &Recipe, u64) -> Result<Option<UnstructuredGrid>, CliError>;

fn joint(
    reader: &RunReader,
    recipe: &Recipe,
    iteration: u64,
) -> Result<Option<UnstructuredGrid>, CliError> {
    let (Some(surface_recipe), Some(surface)) =
        (recipe.surface(), reader.read_once(TableName::Surface)?)
    else {
        return Ok(None);
    };
    let patch = Patch {
        grid: surface_recipe.grid(),
        is_in_joint: typed_table::<typed::Surface>(&surface)?.kept,
    };
    let mut tables = vec![surface];
    for table in [TableName::WearField, TableName::ContactField] {
        tables.extend(read_optional(reader, iteration, table)?);
    }
    Ok(Some(UnstructuredGrid::joint(&patch, &tables)))
}

fn contact_elements(
    reader: &RunReader,
    _recipe: &Recipe,
    iteration: u64,
) -> Result<Option<UnstructuredGrid>, CliError> {
    let Some(elements) = read_optional(reader, iteration, TableName::ContactElement)? else {
        return Ok(None);
    };
    let response = read_optional(reader, iteration, TableName::Response)?;
    let response = response.map(|table| typed_table(&table)).transpose()?;
    let elements = typed_table(&elements)?;
    Ok(Some(UnstructuredGrid::contact_elements(
        &elements,
        response.as_ref(),
    )))
}

/// Reads a table of an iteration. Returns `None` if the iteration lacks it.
fn read_optional(
    reader: &RunReader,
    iteration: u64,
    table: TableName,
) -> Result<Option<Table>, CliError> {
    match reader.read(iteration, table) {
        Ok(table) => Ok(Some(table)),
        Err(StoreError::NoTable { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn typed_table<T: TypedTable>(table: &Table) -> Result<T, CliError> {
    T::of(table).map_err(|error| CliError::Run(error.into()))
}

fn save(
    folder: &Path,
    name: &str,
    write: impl FnOnce(&mut Cursor<Vec<u8>>) -> Result<(), VtuError>,
) -> Result<(), CliError> {
    super::export::save(folder, name, |to| write(to).map_err(io::Error::other))
}
