//! `fretwear export`.

use std::io::Write;
use std::path::Path;

use fretwear::structure::deck::Deck;
use fretwear::structure::resonator::Resonator;
use serde_json::json;

use super::{CliError, Exit, ExportArguments};

/// Writes the resonator's input deck, and says on demand what its frequencies are here.
pub fn export(arguments: &ExportArguments) -> Result<Exit, CliError> {
    let stiffness = arguments.kt.zip(arguments.kn);
    let resonator = Resonator {
        tied: stiffness.is_none(),
        ..Resonator::default()
    };
    write(
        &resonator,
        stiffness,
        arguments.modes,
        &arguments.output,
        arguments.frequencies,
    )
}

/// `stiffness`: kt and kn \[N/m\] of the whole joint, shared by area.
fn write(
    resonator: &Resonator,
    stiffness: Option<(f64, f64)>,
    modes: usize,
    path: &Path,
    frequencies: bool,
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
    if frequencies {
        let found = deck.frequencies()?;
        let object = json!({
            "rigid_modes": found.rigid,
            "elastic_frequencies": found.elastic,
            "mass": found.mass,
        });
        writeln!(std::io::stdout().lock(), "{object}")?;
    }
    Ok(Exit::Done)
}
