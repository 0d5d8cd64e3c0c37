//! `fretwear export RUN --reduced FOLDER`: the reduced structure of a run as matrices.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use fretwear::linalg::Matrix;
use fretwear::stages::ReducedTables;
use fretwear::store::{RealFileSystem, RunReader};
use fretwear::structure::matrix_files::{npz, symmetric_matrix_market};
use fretwear::structure::superelement::Superelement;
use fretwear::tables::typed;

use super::export::{make_folder, save};
use super::{CliError, Exit};
use crate::terminal::Results;

/// Writes the matrices as `K.mtx`, `M.mtx`, `C.mtx` and `Ks.mtx`. `reduced.npz` has all four matrices, and `rows.csv`
/// describes the rows of the matrices.
pub fn export_reduced(run: &Path, folder: &Path, out: &mut Results) -> Result<Exit, CliError> {
    let reader = RunReader::open(Arc::new(RealFileSystem), run)?;
    let Some(tables) = ReducedTables::of(&reader)? else {
        return Err(CliError::NothingReduced {
            path: run.to_owned(),
        });
    };
    let Superelement {
        stiffness,
        mass,
        damping,
        hysteretic,
    } = Superelement::new(&tables.reduced())?;
    make_folder(folder)?;
    let mut matrices: Vec<(&str, &Matrix)> = vec![("K", &stiffness), ("M", &mass)];
    matrices.extend(damping.as_ref().map(|damping| ("C", damping)));
    matrices.extend(hysteretic.as_ref().map(|damping| ("Ks", damping)));
    for (name, matrix) in &matrices {
        let file = format!("{name}.mtx");
        save(folder, &file, |to| symmetric_matrix_market(matrix, to))?;
    }
    save(folder, "reduced.npz", |to| npz(&matrices, to))?;
    save(folder, "rows.csv", |to| {
        rows(&tables.port, &tables.mode, to)
    })?;
    let ports = tables.port.port.len();
    writeln!(
        out,
        "{}: {} rows, {ports} of ports and {} of modes",
        folder.display(),
        stiffness.rows(),
        stiffness.rows() - ports
    );
    Ok(Exit::Done)
}

/// Writes one line per row of the matrices: ports of contact elements (upper less lower body), ports of points, then
/// modes.
fn rows(
    port: &typed::StructurePort,
    mode: &typed::StructureMode,
    to: &mut impl Write,
) -> io::Result<()> {
    writeln!(to, "row,kind,element,point,axis,x,y,frequency")?;
    let ports = port.port.len();
    for p in 0..ports {
        let (kind, element) = match port.element[p] {
            element if element >= 0 => ("contact", element.to_string()),
            _ => ("point", String::new()),
        };
        let (point, axis, x, y) = (&port.point[p], &port.axis[p], port.x[p], port.y[p]);
        writeln!(to, "{},{kind},{element},{point},{axis},{x:e},{y:e},", p + 1)?;
    }
    let frequencies = mode.frequency.iter().step_by(ports.max(1));
    for (m, frequency) in frequencies.enumerate() {
        writeln!(to, "{},mode,,,,,,{frequency:e}", ports + m + 1)?;
    }
    Ok(())
}
