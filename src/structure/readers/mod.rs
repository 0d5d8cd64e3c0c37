//! Readers for matrices from finite-element programs. The readers convert bytes to [`Matrices`].
//!
//! A format is one module with a function from bytes to its content, and one row in `FORMATS`. No other code depends
//! on the list of formats. Readers allocate memory for the data in a file, never for the size that its header
//! announces.

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

use combined::combine;
pub use error::{ReadError, ReadProblem};

use super::element::Formulation;
use super::matrices::{Dof, Matrices, Role, Triplets, Unit};

/// Largest file size in bytes. A stiffness of 10^6 degrees of freedom with 10^8 entries is about as long as text.
const LONGEST_FILE: u64 = 4 << 30;

/// Largest number of entries of a matrix, some 4 GB.
const MOST_ENTRIES: usize = 1 << 28;

/// Largest number of rows of a matrix.
const MOST_ROWS: usize = 1 << 26;

/// File of the user, with an optional role of its matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Path of the file.
    pub path: PathBuf,
    /// Role of the matrix. `None` if the content, the name or the order of the files determines it.
    pub role: Option<Role>,
}

/// File format of matrices. A format has a name, words that select the format, a test of the content of a file, and a
/// parser.
struct Format {
    name: &'static str,
    words: &'static [&'static str],
    is: fn(&[u8]) -> bool,
    parse: fn(&[u8]) -> Result<ParsedFile, ReadProblem>,
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

/// Returns the words by which a user names a format, each once.
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

/// Content of one file.
#[derive(Default)]
struct ParsedFile {
    matrices: Vec<NamedMatrix>,
    /// Degrees of freedom of the rows of matrices. The matrices are in the same file or in another file.
    dofs: Option<Vec<Dof>>,
    sets: HashMap<String, Vec<i64>>,
    positions: HashMap<i64, [f64; 3]>,
    outline: Vec<Vec<i64>>,
    faces: Vec<Vec<i64>>,
    hexahedra: Option<Formulation>,
    local_axes: Vec<(String, Vec<i64>)>,
    /// Units of a neutral folder. The inner value is `None` if the folder does not specify them.
    units: Option<Option<Unit>>,
    unread: Vec<String>,
    notes: Vec<String>,
}

/// Matrix of a file, with the name of the matrix in the file.
struct NamedMatrix {
    name: String,
    role: Option<Role>,
    matrix: Triplets,
    dofs: Option<Vec<Dof>>,
    /// True if the file does not have the number of rows, only rows with entries.
    has_unknown_size: bool,
}

/// File after reading.
struct Source {
    path: PathBuf,
    role: Option<Role>,
    format: &'static str,
    /// True if the user named the file. False if the file was found next to another file.
    is_user_file: bool,
    parsed: ParsedFile,
}

/// Reads the matrices of a structure from one or several files.
///
/// `word` selects a format (one of [`words`]); otherwise the content determines it. For CalculiX, one file of matrices
/// is enough. `read` finds the other files, and the deck with the node sets, in the folder of the file. A folder is an
/// output of `fretwear-import`.
///
/// # Errors
/// [`ReadError`] with the file, the invalid content and the expected content.
pub fn read(inputs: &[Input], word: Option<&str>) -> Result<Matrices, ReadError> {
    let (mut sources, mut unread) = (Vec::new(), Vec::new());
    let mut note_unread = |error: ReadError| {
        let path = error.path.display();
        unread.push(format!("{path} beside it is not read: {}", error.problem));
    };
    let mut seen = HashSet::new();
    for input in inputs {
        if input.path.is_dir() {
            sources.extend(neutral::sources(&input.path)?);
            continue;
        }
        for path in calculix::analysis_files(&input.path) {
            if !seen.insert(path.clone()) {
                continue;
            }
            let role = input.role.filter(|_| path == input.path);
            sources.push(open_source(path, role, word, true)?);
        }
    }
    let has =
        |what: fn(&ParsedFile) -> bool, sources: &[Source]| sources.iter().any(|s| what(&s.parsed));
    for input in inputs {
        for path in deck::candidate_decks(&input.path) {
            let wanted = !has(|p| !p.positions.is_empty() || !p.sets.is_empty(), &sources);
            if wanted && path.is_file() && seen.insert(path.clone()) {
                sources.extend(open_source(path, None, None, false).map_err(&mut note_unread));
            }
        }
    }
    let has_matrices = has(|p| !p.matrices.is_empty(), &sources);
    let decks = sources
        .iter_mut()
        .filter(|s| s.is_user_file && s.format == DECK);
    for source in decks.filter(|_| !has_matrices) {
        let fail = |problem| ReadError {
            path: source.path.clone(),
            problem,
        };
        let (bytes, line_note) = included::read_with_includes(&source.path)?;
        let mesh = assembled(&bytes).map_err(|problem| fail(problem.with_line_note(line_note)));
        if let Some(assembled) = mesh? {
            (source.format, source.parsed) = (MESH, assembled);
        }
    }
    combine(sources, unread)
}

/// Name of the format of an input deck.
pub const DECK: &str = "Abaqus input deck";
/// Name of the format of CalculiX's list of matrix rows.
pub const CALCULIX_LIST: &str = "CalculiX list of freedoms";
/// Name of the format of a mesh that was assembled.
const MESH: &str = "mesh of an Abaqus input deck";

/// Assembles the mesh of a deck. Returns `None` for any other file.
fn assembled(bytes: &[u8]) -> Result<Option<ParsedFile>, ReadProblem> {
    let is_mesh = deck::is(bytes) && mesh_deck::has_mesh(bytes);
    is_mesh.then(|| mesh_assembly::assemble(bytes)).transpose()
}

fn open_source(
    path: PathBuf,
    role: Option<Role>,
    word: Option<&str>,
    is_given: bool,
) -> Result<Source, ReadError> {
    let fail = |problem| ReadError {
        path: path.clone(),
        problem,
    };
    let (bytes, line_note) = included::read_with_includes(&path)?;
    let (format, parsed) =
        parsed(&bytes, word).map_err(|problem| fail(problem.with_line_note(line_note)))?;
    Ok(Source {
        path,
        role,
        format,
        is_user_file: is_given,
        parsed,
    })
}

/// Reads the bytes of one file without any file system. Other files are not searched.
///
/// # Errors
/// As [`read`]. `path` only appears in the errors.
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
        is_user_file: true,
        parsed,
    };
    combine(vec![source], Vec::new())
}

fn parsed(bytes: &[u8], word: Option<&str>) -> Result<(&'static str, ParsedFile), ReadProblem> {
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
        let invalid = named.matrix.entries.iter().find(|e| !e.2.is_finite());
        if let Some(&(i, j, v)) = invalid {
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

/// Returns the role of a file or matrix by its name. The name of a file or matrix states a role by a word such as
/// `stif`. The name may also be a letter, alone or before a Nastran set (`KAA`, `K2GG`).
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

/// Returns true if a lower-case name means structural damping, for example `DMPS1` of Abaqus or `K4AA` of Nastran.
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

/// Largest angle between an axis and the parallel global axis. The tolerance allows for the digits of a file.
const PARALLEL: f64 = 1e-6;

/// Returns true if axes are parallel to the global ones. `axis` must be along axis k, and `in_plane` in the plane of
/// k and l, on the side of l.
fn is_global([axis, in_plane]: [[f64; 3]; 2], [k, l]: [usize; 2]) -> bool {
    let other = 3 - k - l;
    axis[k] > 0.0
        && axis[l].hypot(axis[other]) <= PARALLEL * axis[k]
        && in_plane[l] > 0.0
        && in_plane[other].abs() <= PARALLEL * in_plane[l]
}

/// Checks the number of rows in a header before memory is allocated. A row has at least one entry, and an entry has
/// at least one byte.
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

/// Checks the number of rows in a header of a matrix with many empty rows, such as a damping matrix.
///
/// [`combine`] checks the number of rows again with all matrices before it allocates memory for the rows.
fn rows_of_few(announced: u64, place: &str) -> Result<usize, ReadProblem> {
    usize::try_from(announced)
        .ok()
        .filter(|&n| n <= MOST_ROWS)
        .ok_or_else(|| ReadProblem::TooMany {
            found: format!("{place} announces {announced} rows"),
            limit: format!("a structure has at most {MOST_ROWS}"),
        })
}

/// Checks the number of entries in a header before memory is allocated. An entry has at least one byte.
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

/// Rejects a matrix that is not square.
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

/// Drops the matrices without a role if any matrix has a role. If no matrix has a role, drops the 1×1 matrices.
fn keep_matrices_with_role(parsed: &mut ParsedFile) {
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
