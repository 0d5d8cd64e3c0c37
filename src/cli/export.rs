//! `fretwear export` writes the resonator as an input deck or as matrices. From a run, `fretwear export` writes the
//! reduced structure, the contact, or files for ParaView.

use std::io::{self, Cursor, Write};
use std::path::Path;

use fretwear::recipe::ElementStiffness;
use fretwear::report::output;
use fretwear::scene::{self, Contact, Scene};
use fretwear::structure::deck::Deck;
use fretwear::structure::matrix_files::MatrixFiles;
use fretwear::structure::resonator::Resonator;
use serde_json::json;

use super::arguments::ExportArguments;
use super::export_contact::export_contact;
use super::export_reduced::export_reduced;
use super::export_vtu::export_vtu;
use super::{CliError, Exit};
use crate::terminal::Results;

/// Runs the requested export. By default, `export` writes the input deck of the resonator, and prints the frequencies
/// of the resonator on request.
pub fn export(arguments: &ExportArguments, out: &mut Results) -> Result<Exit, CliError> {
    if let (Some(folder), Some(run)) = (&arguments.vtu, &arguments.scene) {
        return export_vtu(run, folder, out);
    }
    if let (Some(_), Some(folder), Some(run)) =
        (arguments.contact, &arguments.output, &arguments.scene)
    {
        return export_contact(run, folder, arguments, out);
    }
    if let (Some(folder), Some(run)) = (&arguments.reduced, &arguments.scene) {
        return export_reduced(run, folder, out);
    }
    let (geometry, scene) = match &arguments.scene {
        None => (Resonator::default(), None),
        Some(path) => {
            let scene = scene::load(path, &arguments.sets)?;
            let resonator = scene.structure().and_then(|s| s.resonator());
            let Some(resonator) = resonator.cloned() else {
                return Err(CliError::NothingToExport { path: path.clone() });
            };
            (resonator, Some(scene))
        }
    };
    if let Some(folder) = &arguments.matrices {
        return write_matrices(&geometry, scene.as_ref(), folder);
    }
    let contact = scene.and_then(|scene| scene.contact);
    let Some(output) = &arguments.output else {
        unreachable!("the command line requires a file or a folder");
    };
    let stiffness = match (arguments.kt.zip(arguments.kn), &contact) {
        _ if arguments.tied => None,
        (Some(stiffness), _) => Some(stiffness),
        (None, None) => None,
        (None, Some(contact)) => Some(rest_stiffness(contact).ok_or(CliError::UnknownStiffness)?),
    };
    let resonator = Resonator {
        tied: stiffness.is_none(),
        ..geometry
    };
    write(
        &resonator,
        stiffness,
        arguments.modes,
        output,
        arguments.frequencies.then_some(out),
    )
}

/// Keys of a structure that is read from the files of [`write_matrices`].
const READ: [(&str, &str); 5] = [
    ("kind", "matrices"),
    ("stiffness", "stiffness.mtx"),
    ("mass", "mass.mtx"),
    ("nodes", "nodes.csv"),
    ("interface", "pairs.csv"),
];

/// Writes the matrices of a resonator to a folder. If `scene` is given, the function writes a scene that reads the
/// matrices.
fn write_matrices(
    resonator: &Resonator,
    scene: Option<&Scene>,
    folder: &Path,
) -> Result<Exit, CliError> {
    let resonator = Resonator {
        tied: false,
        ..resonator.clone()
    };
    let mesh = resonator.mesh()?;
    let files = MatrixFiles::new(&mesh, resonator.contact_array())?;
    make_folder(folder)?;
    save(folder, "stiffness.mtx", |to| files.stiffness(to))?;
    save(folder, "mass.mtx", |to| files.mass(to))?;
    save(folder, "nodes.csv", |to| files.nodes(to))?;
    save(folder, "pairs.csv", |to| files.pairs(to))?;
    if let Some(scene) = scene {
        let text = scene.reading_matrices(READ, |point| files.point(point));
        save(folder, "scene.toml", |to| to.write_all(text.as_bytes()))?;
    }
    Ok(Exit::Done)
}

/// Creates the folder for the files.
pub(super) fn make_folder(folder: &Path) -> Result<(), CliError> {
    let path = folder.to_owned();
    if folder.is_file() {
        return Err(CliError::NotAFolder { path });
    }
    std::fs::create_dir_all(folder).map_err(|source| CliError::Export { path, source })
}

pub(super) fn save(
    folder: &Path,
    name: &str,
    write: impl FnOnce(&mut Cursor<Vec<u8>>) -> io::Result<()>,
) -> Result<(), CliError> {
    let path = folder.join(name);
    // Write to memory first: a library that writes to a file hides why the disk rejects it.
    let mut bytes = Cursor::default();
    let written = write(&mut bytes).and_then(|()| output::replace(&path, bytes.get_ref()));
    written.map_err(|source| CliError::Export { path, source })
}

/// Returns kt and kn \[N/m\] of a contact at rest, if the scene gives them. A gap has no stiffness.
fn rest_stiffness(contact: &Contact) -> Option<(f64, f64)> {
    match contact.elements {
        ElementStiffness::Given { gap, .. } if gap > 0.0 => Some((0.0, 0.0)),
        ElementStiffness::Given { kn, kt, .. } => Some((kt, kn)),
        ElementStiffness::Contact { .. } => None,
    }
}

/// Writes the deck. `stiffness` is kt and kn \[N/m\] of the whole joint, shared by area. The frequencies are printed to
/// `frequencies`.
fn write(
    resonator: &Resonator,
    stiffness: Option<(f64, f64)>,
    modes: usize,
    path: &Path,
    frequencies: Option<&mut Results>,
) -> Result<Exit, CliError> {
    let mesh = resonator.mesh()?;
    // All cells of the lap have the same area.
    let share = 1.0 / mesh.contacts.len() as f64;
    let (kt, kn) = stiffness.unwrap_or_default();
    let springs = vec![[kt * share, kt * share, kn * share]; mesh.contacts.len()];
    let deck = Deck::new(&mesh, &springs, modes)?;
    output::write(path, deck.to_string().as_bytes()).map_err(|source| CliError::Export {
        path: path.to_owned(),
        source,
    })?;
    if let Some(out) = frequencies {
        let spectrum = deck.frequencies()?;
        out.json(&json!({
            "rigid_modes": spectrum.rigid,
            "elastic_frequencies": spectrum.elastic,
            "mass": spectrum.mass,
        }));
    }
    Ok(Exit::Done)
}
