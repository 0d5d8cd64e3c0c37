//! `fretwear export`.

use std::io::Write;
use std::path::Path;

use fretwear::scene::{self, Contact};
use fretwear::structure::deck::Deck;
use fretwear::structure::resonator::Resonator;
use serde_json::json;

use super::arguments::ExportArguments;
use super::{CliError, Exit};
use crate::terminal::Results;

/// Writes the resonator's input deck, and says on demand what its frequencies are here.
pub fn export(arguments: &ExportArguments, out: &mut Results) -> Result<Exit, CliError> {
    let (geometry, contact) = match &arguments.scene {
        None => (Resonator::default(), None),
        Some(path) => {
            let scene = scene::load(path, &arguments.sets)?;
            let resonator = scene.structure.as_ref().and_then(|s| s.resonator());
            let Some(resonator) = resonator.cloned() else {
                return Err(CliError::NothingToExport { path: path.clone() });
            };
            (resonator, scene.contact)
        }
    };
    let stiffness = match (arguments.kt.zip(arguments.kn), &contact) {
        _ if arguments.tied => None,
        (Some(stiffness), _) => Some(stiffness),
        (None, None) => None,
        (None, Some(contact)) => Some(at_rest(contact).ok_or(CliError::UnknownStiffness)?),
    };
    let resonator = Resonator {
        tied: stiffness.is_none(),
        ..geometry
    };
    write(
        &resonator,
        stiffness,
        arguments.modes,
        &arguments.output,
        arguments.frequencies.then_some(out),
    )
}

/// kt and kn \[N/m\] of a contact at rest, if the scene says them: a gap bears nothing.
fn at_rest(contact: &Contact) -> Option<(f64, f64)> {
    let given = contact.given?;
    Some(if given.gap > 0.0 {
        (0.0, 0.0)
    } else {
        (given.kt, given.kn)
    })
}

/// `stiffness`: kt and kn \[N/m\] of the whole joint, shared by area; `frequencies`: where they are printed.
fn write(
    resonator: &Resonator,
    stiffness: Option<(f64, f64)>,
    modes: usize,
    path: &Path,
    frequencies: Option<&mut Results>,
) -> Result<Exit, CliError> {
    let mesh = resonator.mesh()?;
    // All cells of the lap have one area.
    let share = 1.0 / mesh.contacts.len() as f64;
    let (kt, kn) = stiffness.unwrap_or_default();
    let springs = vec![[kt * share, kt * share, kn * share]; mesh.contacts.len()];
    let deck = Deck::new(&mesh, &springs, modes)?;
    let cannot = |source| CliError::Export {
        path: path.to_owned(),
        source,
    };
    let file = std::fs::File::create(path).map_err(cannot)?;
    let mut file = std::io::BufWriter::new(file);
    write!(file, "{deck}").map_err(cannot)?;
    file.into_inner()
        .map_err(|error| cannot(error.into_error()))?;
    if let Some(out) = frequencies {
        let found = deck.frequencies()?;
        out.json(&json!({
            "rigid_modes": found.rigid,
            "elastic_frequencies": found.elastic,
            "mass": found.mass,
        }));
    }
    Ok(Exit::Done)
}
