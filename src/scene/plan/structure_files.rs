//! Reading of structure files from other programs.

use std::path::{Path, PathBuf};

use super::files::{InputError, hash_of};
use crate::files;
use crate::recipe::Import;
use crate::scene::Scene;
use crate::scene::keys::dynamics::DAMPING_RATIO;
use crate::structure::imported::{
    FacingNodes, ImportError, ImportedStructure, Options, UnitSystem, name_rows,
};
use crate::structure::matrices::Unit;
use crate::structure::node_tables::{self, NodeTableError};
use crate::structure::readers::{self, Input, ReadError};
use crate::units::{self, Dimension, UnitError};

/// Most bytes of a table of nodes: about ten million nodes.
const LONGEST_TABLE: u64 = 1 << 30;

/// Error in the files of a structure.
#[derive(Debug, thiserror::Error)]
pub enum StructureFileError {
    /// The matrices cannot be read.
    #[error("structure: {0}")]
    Read(#[from] ReadError),
    /// A table of nodes cannot be read.
    #[error("{key} {}: {problem}", path.display())]
    Table {
        /// The key.
        key: &'static str,
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: NodeTableError,
    },
    /// Neither the folder of the structure nor the scene states the units of the matrices.
    #[error(
        "structure.file: the units of this folder are unknown; give structure.unit = {{ length = \"mm\", mass = \"t\", time = \"s\" }}, or the correct units"
    )]
    NoUnit,
    /// The units of the folder are not valid.
    #[error("structure.file: structure.json of the folder: {0}")]
    Unit(#[from] UnitError),
    /// The scene states other units than the folder.
    #[error(
        "structure.unit differs from the units of the folder, whose structure.json has {}, {} and {}; remove structure.unit, or import with the right --unit", .0[0], .0[1], .0[2]
    )]
    OtherUnit([String; 3]),
    /// The matrices do not match the structure of the scene.
    #[error("structure: {0}")]
    Import(#[from] ImportError),
}

/// Reads the matrices of a scene's structure, and updates the scene from them.
pub fn read(scene: &mut Scene) -> Result<Option<ImportedStructure>, InputError> {
    let points = points(scene);
    let is_ratio_given = scene.given_value(DAMPING_RATIO.name).is_some();
    let is_unit_given = scene.given_value("structure.unit").is_some();
    let structure = scene.recipe.structure.as_mut();
    let import = structure.and_then(|structure| structure.source.import_mut());
    let Some(import) = import else {
        return Ok(None);
    };
    let joint = scene.joint.as_ref();
    let joint = joint.map_or(([0.0; 2], None), |joint| (joint.size, joint.elements));
    let is_bonded = scene.contact.is_none();
    let ends = scene
        .contact
        .as_ref()
        .and_then(|contact| contact.preload.as_ref());
    let ends = ends.map(|preload| &preload.ends);
    let (imported, unit, is_damped) =
        imported(import, joint, &points, ends, [is_unit_given, is_bonded])?;
    import.unit = unit;
    import.points = points;
    import.preload = imported.preload.clone();
    import.hexahedra = imported.hexahedra;
    import.content = Some(hash_of(|update| imported.hash_parts(update)));
    import.apparent_modulus = imported.apparent_modulus();
    import.has_damping = imported.has_damping();
    import.has_outline = imported.has_outline();
    import.joint = imported.interface.clone();
    if let Some(response) = &mut scene.recipe.response
        && is_damped
        && !is_ratio_given
    {
        response.damping_ratio = 0.0;
    }
    Ok(Some(imported))
}

/// Lists the points where forces act and displacements are read, without repetition.
fn points(scene: &Scene) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    if let Some(response) = &scene.recipe.response {
        let forces = response.forces.iter().map(|force| &force.port);
        for port in forces.chain([&response.at]) {
            if !names.contains(&port.at) {
                names.push(port.at.clone());
            }
        }
    }
    names
}

fn imported(
    import: &Import,
    (size, elements): ([f64; 2], Option<[usize; 2]>),
    points: &[String],
    preload: Option<&[String; 2]>,
    [is_unit_given, is_bonded]: [bool; 2],
) -> Result<(ImportedStructure, UnitSystem, bool), StructureFileError> {
    let inputs: Vec<Input> = (import.files.matrices.iter())
        .map(|(role, path)| Input {
            path: path.clone(),
            role: *role,
        })
        .collect();
    let mut matrices = readers::read(&inputs, import.format.as_deref())?;
    let unit = match matrices.unit.take() {
        Some(None) if !is_unit_given => return Err(StructureFileError::NoUnit),
        None | Some(None) => import.unit,
        Some(Some(unit)) => {
            let folder_unit = UnitSystem {
                length: units::parse_unit(&unit.length, Dimension::LENGTH)?,
                mass: units::parse_unit(&unit.mass, Dimension::MASS)?,
                time: units::parse_unit(&unit.time, Dimension::TIME)?,
            };
            if is_unit_given && !import.unit.is_near(&folder_unit) {
                let Unit { length, mass, time } = unit;
                return Err(StructureFileError::OtherUnit([length, mass, time]));
            }
            folder_unit
        }
    };
    let mut order = Vec::new();
    if let Some(path) = &import.files.nodes {
        let nodes = table("structure.nodes", path, node_tables::positions)?;
        (matrices.positions, order) = (nodes.of_node, nodes.order);
    }
    name_rows(&mut matrices, &order)?;
    let facing = match (&import.files.pairs, &import.sets) {
        (Some(path), _) => {
            FacingNodes::Pairs(table("structure.interface", path, node_tables::pairs)?)
        }
        (None, Some(sets)) => FacingNodes::Sets {
            upper: sets.upper.clone(),
            lower: sets.lower.clone(),
        },
        (None, None) => FacingNodes::Pairs(Vec::new()),
    };
    let imported = ImportedStructure::new(
        &matrices,
        &Options {
            unit,
            fixed: import.fixed.as_deref(),
            facing: &facing,
            wanted: &import.wanted,
            size,
            elements,
            is_bonded,
            points,
            preload,
        },
    )?;
    let damping = [&matrices.damping, &matrices.hysteretic];
    let is_damped = damping
        .into_iter()
        .flatten()
        .any(|matrix| matrix.largest() > 0.0);
    Ok((imported, unit, is_damped))
}

fn table<T>(
    key: &'static str,
    path: &Path,
    parse: fn(&[u8]) -> Result<T, NodeTableError>,
) -> Result<T, StructureFileError> {
    let read = files::read(path, LONGEST_TABLE);
    let parsed = read
        .map_err(NodeTableError::from)
        .and_then(|bytes| parse(&bytes));
    parsed.map_err(|problem| StructureFileError::Table {
        key,
        path: path.to_owned(),
        problem,
    })
}
