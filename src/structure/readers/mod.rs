//! Matrices that finite-element programs write: bytes in, [`Matrices`] out.
//!
//! A format is one module with a function from bytes to what the file has, and one row in `FORMATS`; nothing else knows which formats
//! there are. Readers allocate for what is in a file, never for what its header announces.

mod abaqus;
mod ansys_full;
mod calculix;
mod combined;
mod deck;
mod elsewhere;
mod error;
mod included;
mod matrix_market;
mod mesh_assembly;
mod mesh_constraints;
mod mesh_deck;
mod mesh_keywords;
mod neutral;
mod numpy;
mod text;

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use combined::combined;
pub use error::{ReadError, ReadProblem};

use super::element::Formulation;
use super::matrices::{Dof, Matrices, Role, Triplets, Unit};

/// Bytes of the longest file. A stiffness of 10^6 freedoms with 10^8 entries is about as long as text.
const LONGEST_FILE: u64 = 4 << 30;

/// Most entries of a matrix: some 4 GB.
const MOST_ENTRIES: usize = 1 << 28;

/// Most rows of a matrix.
const MOST_ROWS: usize = 1 << 26;

/// A file given by the user, and what its matrix is where the user says so.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// The file.
    pub path: PathBuf,
    /// What the matrix in it is; otherwise what the file, its name or its place says.
    pub role: Option<Role>,
}

/// A file format: what it is called, the word for it, how it is recognised, who reads it.
struct Format {
    name: &'static str,
    words: &'static [&'static str],
    is: fn(&[u8]) -> bool,
    parse: fn(&[u8]) -> Result<Parsed, ReadProblem>,
}

const FORMATS: [Format; 9] = [
    Format {
        name: "Matrix Market",
        words: &["matrix_market"],
        is: matrix_market::is,
        parse: matrix_market::parse,
    },
    Format {
        name: "NPZ",
        words: &["numpy"],
        is: numpy::is_npz,
        parse: numpy::parse_npz,
    },
    Format {
        name: "NPY",
        words: &["numpy"],
        is: numpy::is_npy,
        parse: numpy::parse_npy,
    },
    Format {
        name: "ANSYS .full",
        words: &["ansys"],
        is: ansys_full::is,
        parse: ansys_full::parse,
    },
    Format {
        name: "Abaqus substructure",
        words: &["abaqus"],
        is: abaqus::is_substructure,
        parse: abaqus::parse_substructure,
    },
    Format {
        name: DECK,
        words: &["abaqus", "calculix"],
        is: deck::is,
        parse: deck::parse,
    },
    Format {
        name: "Abaqus matrix by labels",
        words: &["abaqus"],
        is: abaqus::is_labels,
        parse: abaqus::parse_labels,
    },
    Format {
        name: CALCULIX_LIST,
        words: &["calculix"],
        is: calculix::is_dof,
        parse: calculix::parse_dof,
    },
    Format {
        name: "coordinates (CalculiX, Abaqus)",
        words: &["calculix", "abaqus"],
        is: calculix::is_coordinates,
        parse: calculix::parse_coordinates,
    },
];

/// The words by which a user names a format, each once.
pub fn words() -> Vec<&'static str> {
    let mut words: Vec<_> = FORMATS
        .iter()
        .flat_map(|format| format.words)
        .copied()
        .collect();
    words.sort_unstable();
    words.dedup();
    words
}

/// What one file has.
#[derive(Default)]
struct Parsed {
    matrices: Vec<Named>,
    /// What the rows of the matrices stand for, where the file says it for all of them, or for those of another file.
    dofs: Option<Vec<Dof>>,
    sets: HashMap<String, Vec<i64>>,
    positions: HashMap<i64, [f64; 3]>,
    outline: Vec<Vec<i64>>,
    faces: Vec<Vec<i64>>,
    hexahedra: Option<Formulation>,
    local_axes: Vec<(String, Vec<i64>)>,
    /// The units of a neutral folder, which may not say them.
    units: Option<Option<Unit>>,
    unread: Vec<String>,
    notes: Vec<String>,
}

/// A matrix under the name that the file gives it.
struct Named {
    name: String,
    role: Option<Role>,
    matrix: Triplets,
    dofs: Option<Vec<Dof>>,
    /// The file does not say how many rows there are, only which have entries.
    is_open: bool,
}

/// A file after reading.
struct Source {
    path: PathBuf,
    role: Option<Role>,
    format: &'static str,
    /// The user named it; otherwise it was found beside one.
    is_given: bool,
    parsed: Parsed,
}

/// Reads the matrices of a structure from one file or several. `word` names the format (of [`words`]) where the content is not to
/// decide. Of CalculiX one file is enough: the others are found beside it; so is the deck with the sets of nodes. A folder
/// is one of `fretwear-import`.
///
/// # Errors
/// [`ReadError`] names the file, what was found, and what would be right.
pub fn read(inputs: &[Input], word: Option<&str>) -> Result<Matrices, ReadError> {
    let (mut sources, mut unread) = (Vec::new(), Vec::new());
    let mut not_read = |error: ReadError| {
        let path = error.path.display();
        unread.push(format!("{path} beside it is not read: {}", error.problem));
    };
    let mut seen = HashSet::new();
    for input in inputs {
        if input.path.is_dir() {
            sources.extend(neutral::sources(&input.path)?);
            continue;
        }
        for path in calculix::together(&input.path) {
            if !seen.insert(path.clone()) {
                continue;
            }
            let role = input.role.filter(|_| path == input.path);
            sources.push(opened(path, role, word, true)?);
        }
    }
    let has =
        |what: fn(&Parsed) -> bool, sources: &[Source]| sources.iter().any(|s| what(&s.parsed));
    for input in inputs {
        for path in deck::beside(&input.path) {
            let wanted = !has(|p| !p.positions.is_empty() || !p.sets.is_empty(), &sources);
            if wanted && path.is_file() && seen.insert(path.clone()) {
                sources.extend(opened(path, None, None, false).map_err(&mut not_read));
            }
        }
    }
    let has_matrices = has(|p| !p.matrices.is_empty(), &sources);
    let decks = sources
        .iter_mut()
        .filter(|s| s.is_given && s.format == DECK);
    for source in decks.filter(|_| !has_matrices) {
        let fail = |problem| ReadError {
            path: source.path.clone(),
            problem,
        };
        let (bytes, told) = included::read(&source.path)?;
        let found = assembled(&bytes).map_err(|problem| fail(problem.counted(told)));
        if let Some(assembled) = found? {
            (source.format, source.parsed) = (MESH, assembled);
        }
    }
    combined(sources, unread)
}

/// What a deck of nodes is called.
pub const DECK: &str = "Abaqus input deck";
/// What CalculiX's list of the rows of its matrices is called.
pub const CALCULIX_LIST: &str = "CalculiX list of freedoms";
/// What a file is called whose mesh was assembled.
const MESH: &str = "mesh of an Abaqus input deck";

/// The matrices of the mesh of a deck; none of another file.
fn assembled(bytes: &[u8]) -> Result<Option<Parsed>, ReadProblem> {
    let is_mesh = deck::is(bytes) && mesh_deck::has_mesh(bytes);
    is_mesh.then(|| mesh_assembly::assemble(bytes)).transpose()
}

fn opened(
    path: PathBuf,
    role: Option<Role>,
    word: Option<&str>,
    is_given: bool,
) -> Result<Source, ReadError> {
    let fail = |problem| ReadError {
        path: path.clone(),
        problem,
    };
    let (bytes, told) = included::read(&path)?;
    let (format, parsed) = parsed(&bytes, word).map_err(|problem| fail(problem.counted(told)))?;
    Ok(Source {
        path,
        role,
        format,
        is_given,
        parsed,
    })
}

/// What stands in the bytes of one file, with nothing from beside it: for who has no file system.
///
/// # Errors
/// As [`read`]; `path` is only named.
pub fn parse(path: &Path, bytes: &[u8], word: Option<&str>) -> Result<Matrices, ReadError> {
    let fail = |problem| ReadError {
        path: path.to_owned(),
        problem,
    };
    let (mut format, mut parsed) = parsed(bytes, word).map_err(fail)?;
    if parsed.matrices.is_empty()
        && let Some(mesh) = assembled(bytes).map_err(fail)?
    {
        (format, parsed) = (MESH, mesh);
    }
    let source = Source {
        path: path.to_owned(),
        role: None,
        format,
        is_given: true,
        parsed,
    };
    combined(vec![source], Vec::new())
}

fn parsed(bytes: &[u8], word: Option<&str>) -> Result<(&'static str, Parsed), ReadProblem> {
    let wanted = |format: &&Format| word.is_none_or(|word| format.words.contains(&word));
    let Some(format) = FORMATS
        .iter()
        .filter(wanted)
        .find(|format| (format.is)(bytes))
    else {
        let names: Vec<_> = FORMATS
            .iter()
            .filter(wanted)
            .map(|format| format.name)
            .collect();
        if let Some(problem) = elsewhere::advice_on(bytes) {
            return Err(problem);
        }
        let first = &bytes[..bytes.len().min(32)];
        return Err(ReadProblem::UnknownFormat {
            found: first.escape_ascii().to_string(),
            supported: names.join(", "),
        });
    };
    let parsed = (format.parse)(bytes)?;
    for named in &parsed.matrices {
        let bad = named.matrix.entries.iter().find(|e| !e.2.is_finite());
        if let Some(&(i, j, v)) = bad {
            let place = format!("{} row {}, column {}", named.name, i + 1, j + 1);
            return Err(ReadProblem::malformed(place.trim(), v, "a finite number"));
        }
        if format.name.starts_with("NP") && named.matrix.has_one_triangle() {
            let found = format!("{} one triangle of a matrix", named.name);
            let expected = "both triangles: K + K.T less its diagonal, of a symmetric K";
            return Err(ReadProblem::malformed("the array", found.trim(), expected));
        }
    }
    Ok((format.name, parsed))
}

/// What a name of a file or matrix says of it: words as `stif`, or a letter alone or before a Nastran set (`KAA`, `K2GG`).
fn role_of_name(name: &str) -> Option<Role> {
    let name = name.to_ascii_lowercase();
    if is_structural_damping(&name) {
        return Some(Role::Hysteretic);
    }
    let contains = |word: &str| name.contains(word);
    if contains("stif") || contains(".sti") {
        return Some(Role::Stiffness);
    }
    if contains("mass") || contains(".mas") {
        return Some(Role::Mass);
    }
    if contains("damp") {
        return Some(Role::Damping);
    }
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    words.rev().find_map(|word| match word {
        "k" | "kmat" | "kaa" | "kaax" | "kgg" | "kff" | "kll" | "kxx" | "k2gg" | "k2pp" => {
            Some(Role::Stiffness)
        }
        "m" | "mmat" | "maa" | "maax" | "mgg" | "mff" | "mll" | "mxx" | "m2gg" | "m2pp" => {
            Some(Role::Mass)
        }
        "c" | "d" | "cmat" | "baa" | "baax" | "bgg" | "bff" | "bxx" | "b2gg" | "b2pp" => {
            Some(Role::Damping)
        }
        _ if word.starts_with("dmpv") => Some(Role::Damping),
        _ => None,
    })
}

/// Whether a matrix is structural damping by its name in small letters, as Abaqus' `DMPS1` and Nastran's `K4AA`.
fn is_structural_damping(name: &str) -> bool {
    let mut words = name.split(|c: char| !c.is_ascii_alphanumeric());
    let is_word = |word: &str| {
        word.starts_with("dmps")
            || matches!(
                word,
                "ks" | "k4" | "k4aa" | "k4aax" | "k4gg" | "k4ff" | "k4xx"
            )
    };
    (name.contains("structural") && name.contains("damp")) || words.any(is_word)
}

/// Axes may be off the global ones by this angle: what the digits of a file leave.
const PARALLEL: f64 = 1e-6;

/// Whether axes are parallel to the global ones, where `axis` is along axis k and `in_plane` in the plane of k and l, on the side of l.
fn is_global([axis, in_plane]: [[f64; 3]; 2], [k, l]: [usize; 2]) -> bool {
    let other = 3 - k - l;
    axis[k] > 0.0
        && axis[l].hypot(axis[other]) <= PARALLEL * axis[k]
        && in_plane[l] > 0.0
        && in_plane[other].abs() <= PARALLEL * in_plane[l]
}

/// The number of rows that a header announces, before anything of that size is allocated. A row without any entry is none of a
/// structure, and an entry has at least a byte.
fn rows(announced: u64, bytes: usize, place: &str) -> Result<usize, ReadProblem> {
    let most = bytes.min(MOST_ROWS);
    usize::try_from(announced)
        .ok()
        .filter(|&n| n <= most)
        .ok_or_else(|| ReadProblem::TooMany {
            found: format!("{place} announces {announced} rows"),
            limit: format!("{bytes} bytes have entries for at most {most}"),
        })
}

/// The number of rows that a header announces of a matrix that may have entries in few of them, as a damping matrix has. Nothing of that size is
/// allocated before [`combined`] has looked at all matrices.
fn rows_of_few(announced: u64, place: &str) -> Result<usize, ReadProblem> {
    usize::try_from(announced)
        .ok()
        .filter(|&n| n <= MOST_ROWS)
        .ok_or_else(|| ReadProblem::TooMany {
            found: format!("{place} announces {announced} rows"),
            limit: format!("a structure has at most {MOST_ROWS}"),
        })
}

/// The number of entries that a header announces, before anything of that size is allocated. An entry has at least a byte.
fn entries(announced: u64, bytes: usize, place: &str) -> Result<usize, ReadProblem> {
    let most = bytes.min(MOST_ENTRIES);
    usize::try_from(announced)
        .ok()
        .filter(|&n| n <= most)
        .ok_or_else(|| ReadProblem::TooMany {
            found: format!("{place} announces {announced} entries"),
            limit: format!("{bytes} bytes hold at most {most}"),
        })
}

/// A matrix that is not square is none of a structure.
fn square(rows: u64, columns: u64, name: &str) -> Result<(), ReadProblem> {
    if rows == columns && rows > 0 {
        return Ok(());
    }
    Err(ReadProblem::malformed(
        name,
        format!("{rows} rows and {columns} columns"),
        "as many rows as columns, at least one",
    ))
}

/// Of the matrices of a file that names them: those whose names say what they are, if any do.
fn chosen(parsed: &mut Parsed) {
    if parsed.matrices.iter().any(|named| named.role.is_some()) {
        for named in parsed.matrices.iter().filter(|named| named.role.is_none()) {
            parsed.notes.push(format!(
                "{} is no stiffness, mass or damping by its name, and is left out",
                named.name
            ));
        }
        parsed.matrices.retain(|named| named.role.is_some());
    } else if parsed.matrices.iter().any(|named| named.matrix.size > 1) {
        parsed.matrices.retain(|named| named.matrix.size > 1);
    }
}
