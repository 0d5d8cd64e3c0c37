//! Combination of several files into one structure: assigns the roles and the rows of the matrices.

use std::collections::HashMap;
use std::path::PathBuf;

use super::{CALCULIX_LIST, NamedMatrix, ReadError, ReadProblem, Source, calculix};
use super::{is_structural_damping, role_of_name};
use crate::structure::matrices::{Dof, Matrices, Role, Triplets};

/// Largest number of rows per entry. Only fixed rows of a matrix have no entries, so more rows per entry mean a wrong
/// header. The limit of rows per entry bounds the memory by the size of the files.
const ROWS_PER_ENTRY: usize = 32;

/// Combines the contents of all files into one structure. `unread` are the reasons why other files were not read.
pub(super) fn combine(sources: Vec<Source>, unread: Vec<String>) -> Result<Matrices, ReadError> {
    let mut matrices = Matrices {
        size: 0,
        dofs: None,
        stiffness: None,
        mass: None,
        damping: None,
        hysteretic: None,
        sets: HashMap::new(),
        positions: HashMap::new(),
        local_axes: Vec::new(),
        unit: None,
        notes: unread.clone(),
        unread,
        outline: Vec::new(),
        faces: Vec::new(),
        hexahedra: None,
        formats: Vec::new(),
    };
    // CalculiX writes matrices along the global axes, even if the deck has *TRANSFORM.
    let is_calculix = (sources.iter())
        .any(|source| source.format == CALCULIX_LIST || calculix::is_calculix_file(&source.path));
    let mut by_role: HashMap<Role, (PathBuf, NamedMatrix)> = HashMap::new();
    let mut dof_list: Option<(PathBuf, Vec<Dof>)> = None;
    let mut nameless = Vec::new();
    let last = sources
        .iter()
        .rev()
        .find(|s| s.is_user_file)
        .map(|s| s.path.clone())
        .unwrap_or_default();
    let has_one_file = sources
        .iter()
        .filter(|s| !s.parsed.matrices.is_empty())
        .count()
        == 1;
    for source in sources {
        let Source {
            path,
            role,
            format,
            is_user_file: is_given,
            parsed,
        } = source;
        if !is_given {
            matrices.notes.push(format!(
                "{} beside it is read too ({format})",
                path.display()
            ));
        }
        if !matrices.formats.contains(&format) {
            matrices.formats.push(format);
        }
        matrices.notes.extend(parsed.notes);
        matrices.unit = matrices.unit.or(parsed.units);
        matrices.sets.extend(parsed.sets);
        matrices.positions.extend(parsed.positions);
        matrices.outline.extend(parsed.outline);
        matrices.faces.extend(parsed.faces);
        matrices.hexahedra = matrices.hexahedra.or(parsed.hexahedra);
        for (why, nodes) in parsed.local_axes.into_iter().filter(|_| !is_calculix) {
            let why = format!("{why}, as {} says", path.display());
            let (first, count) = (nodes.iter().min().unwrap_or(&0), nodes.len());
            let note = format!("node {first}, one of {count}, has {why}: a scene cannot use it");
            matrices.notes.push(note);
            matrices.local_axes.push((why, nodes));
        }
        for reason in parsed.unread {
            matrices
                .unread
                .push(format!("{}: {reason}", path.display()));
        }
        if let Some(dofs) = parsed.dofs {
            dof_list = Some((path.clone(), dofs));
        }
        let is_single = parsed.matrices.len() == 1;
        for mut named in parsed.matrices {
            let file_name = path
                .file_name()
                .map(|n| n.to_string_lossy().into_owned())
                .unwrap_or_default();
            let by_name = if is_single {
                role_of_name(&file_name)
            } else {
                None
            };
            let known_role = role.filter(|_| is_single).or(named.role).or(by_name);
            if named.name.is_empty() {
                named.name = file_name;
            }
            match known_role {
                Some(role) => insert_matrix(&mut by_role, role, path.clone(), named)?,
                None => nameless.push((path.clone(), named)),
            }
        }
    }
    for (path, named) in nameless {
        let mut free = Role::IN_FILE_ORDER.into_iter();
        let Some(role) = free.find(|role| !by_role.contains_key(role)) else {
            return Err(ReadError {
                path,
                problem: ReadProblem::DoNotFit {
                    found: format!("the matrix {} is a fourth one", named.name),
                    advice: "give one stiffness, one mass and one damping, as stiffness=FILE mass=FILE damping=FILE".into(),
                },
            });
        };
        let why = if has_one_file {
            "nothing says what it is"
        } else {
            "by its place: no name says what it is"
        };
        matrices.notes.push(format!(
            "{} is taken for the {}, {why}; say {}=FILE where that is wrong",
            named.name,
            role.name(),
            role.name()
        ));
        insert_matrix(&mut by_role, role, path, named)?;
    }
    if by_role.is_empty() {
        return Err(ReadError {
            path: last,
            problem: ReadProblem::DoNotFit {
                found: "no matrix is in the files".into(),
                advice: "give the files that hold stiffness and mass".into(),
            },
        });
    }
    let mut parts: Vec<(Role, PathBuf, NamedMatrix)> = by_role
        .into_iter()
        .map(|(role, (path, named))| (role, path, named))
        .collect();
    parts.sort_by_key(|part| part.0);
    let entries: usize = parts.iter().map(|part| part.2.matrix.entries.len()).sum();
    let most = ROWS_PER_ENTRY.saturating_mul(entries);
    if let Some((_, path, named)) = parts.iter().find(|part| part.2.matrix.size > most) {
        return Err(ReadError {
            path: path.clone(),
            problem: ReadProblem::TooMany {
                found: format!("{} announces {} rows", named.name, named.matrix.size),
                limit: format!("{entries} entries of all matrices are of at most {most} rows"),
            },
        });
    }
    if let [(Role::Stiffness, first, k), (Role::Mass, path, m), ..] = &parts[..]
        && k.matrix.entries == m.matrix.entries
    {
        return Err(ReadError {
            path: path.clone(),
            problem: ReadProblem::DoNotFit {
                found: format!(
                    "the mass is the stiffness of {}, number for number",
                    first.display()
                ),
                advice: "give the files of both".into(),
            },
        });
    }
    if parts.iter().all(|part| part.2.dofs.is_some()) {
        join_by_dofs(&mut matrices, parts);
    } else {
        join_by_rows(&mut matrices, parts, dof_list)?;
    }
    Ok(matrices)
}

fn insert_matrix(
    found: &mut HashMap<Role, (PathBuf, NamedMatrix)>,
    role: Role,
    path: PathBuf,
    named: NamedMatrix,
) -> Result<(), ReadError> {
    if role == Role::Damping && is_structural_damping(&named.name.to_ascii_lowercase()) {
        let problem = ReadProblem::DoNotFit {
            found: format!("{} is structural damping by its name", named.name),
            advice: "give it as structural_damping=FILE, or viscous damping under another name"
                .into(),
        };
        return Err(ReadError { path, problem });
    }
    if let Some((other, first)) = found.get(&role) {
        let problem = ReadProblem::DoNotFit {
            found: format!(
                "the matrix {} is a second {}, after {} of {}",
                named.name,
                role.name(),
                first.name,
                other.display()
            ),
            advice: "inspect one structure at a time, or say which is which: stiffness=FILE mass=FILE damping=FILE".into(),
        };
        return Err(ReadError { path, problem });
    }
    found.insert(role, (path, named));
    Ok(())
}

/// Joins matrices with known degrees of freedom on the union of their rows.
fn join_by_dofs(matrices: &mut Matrices, parts: Vec<(Role, PathBuf, NamedMatrix)>) {
    let mut dofs: Vec<Dof> = Vec::new();
    let mut place: HashMap<Dof, u32> = HashMap::new();
    for dof in parts.iter().flat_map(|part| part.2.dofs.iter().flatten()) {
        place.entry(*dof).or_insert_with(|| {
            dofs.push(*dof);
            dofs.len() as u32 - 1
        });
    }
    for (role, _, named) in parts {
        let places: Vec<u32> = named.dofs.iter().flatten().map(|dof| place[dof]).collect();
        store_matrix(matrices, role, named.matrix.renumbered(dofs.len(), &places));
    }
    matrices.size = dofs.len();
    matrices.dofs = Some(dofs);
}

/// Joins matrices whose degrees of freedom are row numbers. A row number must have the same degree of freedom in all
/// files.
fn join_by_rows(
    matrices: &mut Matrices,
    parts: Vec<(Role, PathBuf, NamedMatrix)>,
    list: Option<(PathBuf, Vec<Dof>)>,
) -> Result<(), ReadError> {
    // A coordinate file does not have the number of rows. The largest matrix and the list of freedoms determine it.
    let most = parts
        .iter()
        .map(|part| part.2.matrix.size)
        .max()
        .unwrap_or(0);
    let own_list = parts
        .iter()
        .find_map(|part| Some((part.1.clone(), part.2.dofs.clone()?)));
    let list = own_list.or(list);
    let size = match &list {
        Some((_, dofs)) if dofs.len() >= most => dofs.len(),
        _ => most,
    };
    if let Some((path, dofs)) = &list
        && dofs.len() != size
    {
        let (_, matrix_path, named) = parts
            .iter()
            .find(|part| part.2.matrix.size == most)
            .expect("the largest");
        return Err(ReadError {
            path: path.clone(),
            problem: ReadProblem::DoNotFit {
                found: format!(
                    "it lists {} freedoms, but {} of {} has {most} rows",
                    dofs.len(),
                    named.name,
                    matrix_path.display()
                ),
                advice: "give files of one and the same computation".into(),
            },
        });
    }
    let largest = parts.iter().find(|part| part.2.matrix.size == most);
    let largest = largest.map_or_else(String::new, |part| part.2.name.clone());
    for (role, path, mut named) in parts {
        let is_short = named.has_unknown_size && named.matrix.size < size;
        if named.matrix.size != size && !is_short {
            return Err(ReadError {
                path,
                problem: ReadProblem::DoNotFit {
                    found: if list.is_some() && named.matrix.size == most {
                        format!(
                            "the matrix {} has {} rows, but {size} freedoms are listed",
                            named.name, named.matrix.size
                        )
                    } else {
                        format!(
                            "the matrix {} has {} rows, but {largest} has {most}",
                            named.name, named.matrix.size
                        )
                    },
                    advice: "give files of one and the same computation".into(),
                },
            });
        }
        named.matrix.size = size;
        store_matrix(matrices, role, named.matrix);
    }
    matrices.size = size;
    matrices.dofs = list.map(|list| list.1);
    Ok(())
}

fn store_matrix(matrices: &mut Matrices, role: Role, matrix: Triplets) {
    match role {
        Role::Stiffness => matrices.stiffness = Some(matrix),
        Role::Mass => matrices.mass = Some(matrix),
        Role::Damping => matrices.damping = Some(matrix),
        Role::Hysteretic => matrices.hysteretic = Some(matrix),
    }
}
