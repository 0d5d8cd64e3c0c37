//! One structure from what several files have: which matrix is which, and on which rows.

use std::collections::HashMap;
use std::path::PathBuf;

use super::{CALCULIX_LIST, Named, ReadError, ReadProblem, Source, calculix};
use super::{is_structural_damping, role_of_name};
use crate::structure::matrices::{Dof, Matrices, Role, Triplets};

/// Rows of a structure for each entry of its matrices, at most: a row without any entry is none of a structure but where it is held, and memory is
/// bounded by what the files hold.
const ROWS_PER_ENTRY: usize = 32;

/// One structure from what all files have; `unread` says what was not read beside them.
pub(super) fn combined(sources: Vec<Source>, unread: Vec<String>) -> Result<Matrices, ReadError> {
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
    // CalculiX writes its matrices along the global axes in spite of *TRANSFORM.
    let is_calculix = (sources.iter())
        .any(|source| source.format == CALCULIX_LIST || calculix::is_own(&source.path));
    let mut found: HashMap<Role, (PathBuf, Named)> = HashMap::new();
    let mut list: Option<(PathBuf, Vec<Dof>)> = None;
    let mut nameless = Vec::new();
    let last = sources
        .iter()
        .rev()
        .find(|s| s.is_given)
        .map(|s| s.path.clone())
        .unwrap_or_default();
    let alone = sources
        .iter()
        .filter(|s| !s.parsed.matrices.is_empty())
        .count()
        == 1;
    for source in sources {
        let Source {
            path,
            role,
            format,
            is_given,
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
            list = Some((path.clone(), dofs));
        }
        let only = parsed.matrices.len() == 1;
        for mut named in parsed.matrices {
            let of_file = path
                .file_name()
                .map(|n| n.to_string_lossy().into_owned())
                .unwrap_or_default();
            let by_name = if only { role_of_name(&of_file) } else { None };
            let decided = role.filter(|_| only).or(named.role).or(by_name);
            if named.name.is_empty() {
                named.name = of_file;
            }
            match decided {
                Some(role) => put(&mut found, role, path.clone(), named)?,
                None => nameless.push((path.clone(), named)),
            }
        }
    }
    for (path, named) in nameless {
        let mut free = Role::BY_PLACE.into_iter();
        let Some(role) = free.find(|role| !found.contains_key(role)) else {
            return Err(ReadError {
                path,
                problem: ReadProblem::DoNotFit {
                    found: format!("the matrix {} is a fourth one", named.name),
                    advice: "give one stiffness, one mass and one damping, as stiffness=FILE mass=FILE damping=FILE".into(),
                },
            });
        };
        let why = if alone {
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
        put(&mut found, role, path, named)?;
    }
    if found.is_empty() {
        return Err(ReadError {
            path: last,
            problem: ReadProblem::DoNotFit {
                found: "no matrix is in the files".into(),
                advice: "give the files that hold stiffness and mass".into(),
            },
        });
    }
    let mut parts: Vec<(Role, PathBuf, Named)> = found
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
        joined(&mut matrices, parts);
    } else {
        aligned(&mut matrices, parts, list)?;
    }
    Ok(matrices)
}

fn put(
    found: &mut HashMap<Role, (PathBuf, Named)>,
    role: Role,
    path: PathBuf,
    named: Named,
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

/// Matrices whose files say what each row is: on the union of those.
fn joined(matrices: &mut Matrices, parts: Vec<(Role, PathBuf, Named)>) {
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
        set(matrices, role, named.matrix.renumbered(dofs.len(), &places));
    }
    matrices.size = dofs.len();
    matrices.dofs = Some(dofs);
}

/// Matrices whose rows are numbered, all alike.
fn aligned(
    matrices: &mut Matrices,
    parts: Vec<(Role, PathBuf, Named)>,
    list: Option<(PathBuf, Vec<Dof>)>,
) -> Result<(), ReadError> {
    // A list of coordinates does not say how many rows there are: the largest, and the list of freedoms, do.
    let most = parts
        .iter()
        .map(|part| part.2.matrix.size)
        .max()
        .unwrap_or(0);
    let own = parts
        .iter()
        .find_map(|part| Some((part.1.clone(), part.2.dofs.clone()?)));
    let list = own.or(list);
    let size = match &list {
        Some((_, dofs)) if dofs.len() >= most => dofs.len(),
        _ => most,
    };
    if let Some((path, dofs)) = &list
        && dofs.len() != size
    {
        let (_, of, named) = parts
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
                    of.display()
                ),
                advice: "give files of one and the same computation".into(),
            },
        });
    }
    let largest = parts.iter().find(|part| part.2.matrix.size == most);
    let largest = largest.map_or_else(String::new, |part| part.2.name.clone());
    for (role, path, mut named) in parts {
        let is_short = named.is_open && named.matrix.size < size;
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
        set(matrices, role, named.matrix);
    }
    matrices.size = size;
    matrices.dofs = list.map(|list| list.1);
    Ok(())
}

fn set(matrices: &mut Matrices, role: Role, matrix: Triplets) {
    match role {
        Role::Stiffness => matrices.stiffness = Some(matrix),
        Role::Mass => matrices.mass = Some(matrix),
        Role::Damping => matrices.damping = Some(matrix),
        Role::Hysteretic => matrices.hysteretic = Some(matrix),
    }
}
