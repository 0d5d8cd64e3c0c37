//! Neutral folder of `fretwear-import`. The folder has `structure.json` and either matrices or a flat deck. The folder
//! has tables of rows, nodes and sets for the matrices.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use sha2::{Digest, Sha256};

use super::{ParsedFile, ReadError, ReadProblem, Source, open_source};
use crate::files;
use crate::structure::matrices::{Role, Unit};
use crate::structure::node_tables::{self, NodeTableError};

/// Name of the format of a neutral folder.
const NAME: &str = "folder of fretwear-import";
/// Newest supported version.
const VERSION: u32 = 1;
/// Largest size of a table in bytes, for some ten million nodes.
const LONGEST_TABLE: u64 = 1 << 30;

/// The fields of `structure.json` that are used.
#[derive(Deserialize)]
struct Described {
    layout: String,
    version: u32,
    kind: Kind,
    #[serde(default)]
    unit: Option<Unit>,
    #[serde(default)]
    left_out: Vec<String>,
    /// SHA-256 hashes of the files in the folder.
    #[serde(default)]
    contents: BTreeMap<String, String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Matrices,
    Mesh,
}

/// Reads the files of a folder.
pub(super) fn sources(folder: &Path) -> Result<Vec<Source>, ReadError> {
    let path = folder.join("structure.json");
    let fail = |problem| ReadError {
        path: path.clone(),
        problem,
    };
    let text = files::read_text(&path, LONGEST_TABLE)
        .map_err(|source| fail(ReadProblem::Io { source }))?;
    let expected = "what fretwear-import writes, with layout, version and kind";
    let described: Described = serde_json::from_str(&text)
        .map_err(|error| fail(ReadProblem::malformed("the folder", error, expected)))?;
    if described.layout != "fretwear-structure" || described.version > VERSION {
        let found = format!("layout {} {}", described.layout, described.version);
        let expected = format!("fretwear-structure, version {VERSION} at most");
        return Err(fail(ReadProblem::malformed("the folder", found, expected)));
    }
    let mut folder_data = ParsedFile {
        notes: described.left_out.clone(),
        unread: described.left_out,
        units: Some(described.unit),
        ..ParsedFile::default()
    };
    for (name, hash) in &described.contents {
        let file = folder.join(name);
        let bytes = files::read(&file, super::LONGEST_FILE).map_err(|source| ReadError {
            path: file.clone(),
            problem: ReadProblem::Io { source },
        })?;
        let is_same = format!("{:x}", Sha256::digest(&bytes)) == *hash;
        if !is_same {
            let note = format!("{name} is not as fretwear-import wrote it");
            folder_data.notes.push(note.clone());
            folder_data.unread.push(note);
        }
    }
    let mut sources = Vec::new();
    match described.kind {
        Kind::Mesh => sources.push(open_source(folder.join("mesh.inp"), None, None, true)?),
        Kind::Matrices => {
            let all = [
                ("K", Role::Stiffness, true),
                ("M", Role::Mass, true),
                ("C", Role::Damping, false),
                ("Ks", Role::Hysteretic, false),
            ];
            for (name, role, is_needed) in all {
                let file = folder.join(format!("{name}.npz"));
                if is_needed || file.is_file() {
                    sources.push(open_source(file, Some(role), Some("numpy"), true)?);
                }
            }
            folder_data.dofs = Some(table(folder.join("rows.csv"), node_tables::dofs)?);
            let nodes = folder.join("nodes.csv");
            if nodes.is_file() {
                folder_data.positions = table(nodes, node_tables::positions)?.of_node;
            }
            let sets = folder.join("sets.csv");
            if sets.is_file() {
                folder_data.sets = table(sets, node_tables::sets)?;
            }
        }
    }
    sources.push(Source {
        path: folder.to_owned(),
        role: None,
        format: NAME,
        is_user_file: true,
        parsed: folder_data,
    });
    Ok(sources)
}

fn table<T>(path: PathBuf, parse: fn(&[u8]) -> Result<T, NodeTableError>) -> Result<T, ReadError> {
    let read = files::read(&path, LONGEST_TABLE).map_err(NodeTableError::from);
    read.and_then(|bytes| parse(&bytes)).map_err(|error| {
        let problem = match error {
            NodeTableError::Io(source) => ReadProblem::Io { source },
            error => ReadProblem::malformed("the table", error, "a table of fretwear-import"),
        };
        ReadError { path, problem }
    })
}
