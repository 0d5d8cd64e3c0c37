//! Nastran DMIG entries, as punched (`PARAM,EXTOUT,DMIGPCH`) or within a deck: small, large and free fields.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::error::ReadProblem;
use super::text::{Digits, number, numbers, shown, text_of, whole};
use super::{Named, Parsed, is_global, role_of_name};
use crate::structure::matrices::{Dof, Triplets};

fn is_entry(line: &str, name: &str) -> bool {
    let head = line.get(..name.len()).unwrap_or("");
    let next = line.as_bytes().get(name.len());
    head.eq_ignore_ascii_case(name) && matches!(next, None | Some(b' ' | b'*' | b',' | b'\t'))
}

/// DMIG entries, or the list of freedoms of an external superelement.
pub(super) fn is(bytes: &[u8]) -> bool {
    text_of(bytes)
        .lines()
        .any(|line| is_entry(line, "DMIG") || is_entry(line, "EXTRN"))
}

/// The fields of a line from the second on.
fn fields(line: &str) -> Vec<&str> {
    if line.contains(',') {
        let mut fields: Vec<&str> = line.split(',').skip(1).map(str::trim).collect();
        // Fields that are missing at the end of a line are blank. The ninth field marks the next line.
        fields.resize(fields.len().next_multiple_of(4).min(8), "");
        return fields;
    }
    let first = line.get(..8.min(line.len())).unwrap_or("");
    let is_large = first.contains('*');
    let (width, count) = if is_large { (16, 4) } else { (8, 8) };
    let fields = (0..count).map(|k| {
        let (from, to) = (8 + k * width, (8 + (k + 1) * width).min(line.len()));
        if from < to {
            line.get(from..to).unwrap_or("").trim()
        } else {
            ""
        }
    });
    fields.collect()
}

/// An entry of the deck: its fields after the name of the entry, over all its lines.
struct Entry<'a> {
    line: usize,
    fields: Vec<(usize, &'a str)>,
}

fn entries<'a>(text: &'a str, name: &str) -> Vec<Entry<'a>> {
    let mut found: Vec<Entry> = Vec::new();
    let mut open = false;
    let lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    for (number, line) in
        lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('$'))
    {
        let continues = line.starts_with(['*', '+', ' ', ',']);
        if continues && open {
            let entry = found.last_mut().expect("an open entry");
            entry
                .fields
                .extend(fields(line).into_iter().map(|field| (number, field)));
        } else {
            open = is_entry(line, name);
            if open {
                let fields = fields(line)
                    .into_iter()
                    .map(|field| (number, field))
                    .collect();
                found.push(Entry {
                    line: number,
                    fields,
                });
            }
        }
    }
    found
}

/// A matrix between its header and its columns.
struct Open {
    name: String,
    is_half: bool,
    is_square: bool,
    dofs: Vec<Dof>,
    place: HashMap<Dof, u32>,
    matrix: Triplets,
    digits: Digits,
}

impl Open {
    fn place(&mut self, dof: Dof) -> u32 {
        *self.place.entry(dof).or_insert_with(|| {
            self.dofs.push(dof);
            self.dofs.len() as u32 - 1
        })
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, ReadProblem> {
    let text = text_of(bytes);
    let mut parsed = Parsed {
        dofs: external(&text)?,
        local_axes: local_axes(&text)?,
        ..Parsed::default()
    };
    let mut open: Vec<Open> = Vec::new();
    for entry in entries(&text, "DMIG") {
        let line = entry.line;
        let place = || format!("line {line}");
        let field = |k: usize| entry.fields.get(k).map_or("", |f| f.1);
        let name = field(0);
        if name.is_empty() {
            return Err(ReadProblem::malformed(
                place(),
                "a DMIG entry without a name",
                "DMIG, NAME, …",
            ));
        }
        if field(1) == "0" {
            open.push(header(&entry, name)?);
            continue;
        }
        let Some(matrix) = open.iter_mut().find(|m| m.name == name) else {
            return Err(ReadProblem::malformed(
                place(),
                format!("a column of {}", shown(name)),
                format!("before it the header DMIG, {name}, 0, …"),
            ));
        };
        let column = dof(field(1), field(2), line)?;
        let column = matrix.place(column);
        // Two fields that a header has and a column has not, then groups of four.
        let rest = entry.fields.get(4..).unwrap_or(&[]);
        for group in rest.chunks(4) {
            let text = |k: usize| group.get(k).map_or("", |f| f.1);
            let line = group[0].0;
            if (0..4).all(|k| text(k).is_empty()) {
                continue;
            }
            let row = dof(text(0), text(1), line)?;
            let value = number(text(2), || format!("line {line}"))?;
            let imaginary = if text(3).is_empty() {
                0.0
            } else {
                number(text(3), || format!("line {line}"))?
            };
            if imaginary != 0.0 {
                return Err(ReadProblem::Unsupported {
                    found: format!("a complex number (line {line})"),
                    advice: "stiffness, mass and damping are real: write structural damping into a matrix of its own".into(),
                });
            }
            matrix.digits.see(text(2));
            let row = matrix.place(row);
            matrix.matrix.entries.push((row, column, value));
        }
    }
    for mut matrix in open {
        let role = role_of_name(&matrix.name);
        let Some(role) = role.filter(|_| matrix.is_square) else {
            parsed.notes.push(format!(
                "DMIG {} is no stiffness, mass or damping, and is left out",
                matrix.name
            ));
            continue;
        };
        let mut order: Vec<u32> = (0..matrix.dofs.len() as u32).collect();
        order.sort_by_key(|&k| matrix.dofs[k as usize]);
        let mut places = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            places[old as usize] = new as u32;
        }
        matrix.dofs.sort_unstable();
        let size = matrix.dofs.len();
        let mut found = matrix.matrix.renumbered(size, &places);
        found.is_half = matrix.is_half;
        found.precision = matrix.digits.precision();
        if matrix.is_half {
            let before = found.entries.len();
            let mut places: Vec<(u32, u32)> = found
                .entries
                .iter()
                .map(|e| (e.0.min(e.1), e.0.max(e.1)))
                .collect();
            places.sort_unstable();
            places.dedup();
            if places.len() < before {
                return Err(ReadProblem::malformed(
                    format!("DMIG {}", matrix.name),
                    format!("{} of {before} terms a second time", before - places.len()),
                    "each pair of freedoms once, as its header says symmetric (6)",
                ));
            }
        }
        parsed.matrices.push(Named {
            name: format!("DMIG {}", matrix.name),
            role: Some(role),
            matrix: found,
            dofs: Some(matrix.dofs),
            is_open: false,
        });
    }
    Ok(parsed)
}

fn header(entry: &Entry, name: &str) -> Result<Open, ReadProblem> {
    let field = |k: usize| entry.fields.get(k).map_or("", |f| f.1);
    let place = || format!("line {}", entry.line);
    let form: u32 = whole(field(2), "the form 1, 2, 6 or 9", place)?;
    let kind: u32 = whole(field(3), "the type 1, 2, 3 or 4", place)?;
    if !matches!(form, 1 | 2 | 6 | 9) {
        return Err(ReadProblem::malformed(
            place(),
            format!("the form {form}"),
            "1, 2, 6 or 9",
        ));
    }
    if !(1..=4).contains(&kind) {
        return Err(ReadProblem::malformed(
            place(),
            format!("the type {kind}"),
            "1 to 4",
        ));
    }
    Ok(Open {
        name: name.to_owned(),
        is_half: form == 6,
        is_square: form == 1 || form == 6,
        dofs: Vec::new(),
        place: HashMap::new(),
        matrix: Triplets::new(0),
        digits: Digits::default(),
    })
}

fn dof(node: &str, direction: &str, line: usize) -> Result<Dof, ReadProblem> {
    let place = || format!("line {line}");
    let direction = if direction.is_empty() {
        0
    } else {
        whole(direction, "a component of 0 to 6", place)?
    };
    if direction > 6 {
        return Err(ReadProblem::malformed(
            place(),
            format!("the component {direction}"),
            "a component of 0 to 6",
        ));
    }
    Ok(Dof {
        node: whole(node, "the number of a grid point", place)?,
        direction,
    })
}

/// Points whose displacements are along the axes of a CD (on `GRID` or `GRDSET`) that is no `CORD2R` parallel to the basic system.
fn local_axes<'a>(text: &'a str) -> Result<Vec<(String, Vec<i64>)>, ReadProblem> {
    let mut global = HashSet::from([0]);
    for entry in entries(text, "CORD2R") {
        let fields: Vec<&str> = entry.fields.iter().map(|field| field.1).collect();
        // Two points of the z axis, and one of the plane of x and z.
        if let Ok([system, of, a, b, c, d, e, f, g, h, i]) = numbers(&fields, String::new)
            && global.contains(&(of as i64))
            && is_global([[d - a, e - b, f - c], [g - a, h - b, i - c]], [2, 0])
        {
            global.insert(system as i64);
        }
    }
    let axes = |entry: &Entry<'a>| Some(entry.fields.get(5)?.1).filter(|cd| !cd.is_empty());
    let default = entries(text, "GRDSET").first().and_then(axes);
    let mut turned: BTreeMap<i64, Vec<i64>> = BTreeMap::new();
    for entry in entries(text, "GRID") {
        let place = || format!("line {}", entry.line);
        let cd = axes(&entry).or(default).unwrap_or("0");
        let cd = whole(cd, "the number of a coordinate system", place)?;
        if !global.contains(&cd) {
            let node = whole(entry.fields[0].1, "the number of a grid point", place)?;
            turned.entry(cd).or_default().push(node);
        }
    }
    let told = |(cd, nodes)| {
        let why = format!(
            "displacements along the axes CD = {cd} of its GRID (no CORD2R {cd} is parallel to the basic axes)"
        );
        (why, nodes)
    };
    Ok(turned.into_iter().map(told).collect())
}

/// The freedoms of an external superelement in the order of its matrices: `EXTRN`, pairs of a point and its components.
fn external(text: &str) -> Result<Option<Vec<Dof>>, ReadProblem> {
    let mut dofs = Vec::new();
    for entry in entries(text, "EXTRN") {
        for pair in entry.fields.chunks(2) {
            let (line, node) = pair[0];
            let components = pair.get(1).map_or("", |f| f.1);
            if node.is_empty() {
                continue;
            }
            let place = || format!("line {line}");
            let node: i64 = whole(node, "the number of a grid point", place)?;
            if components.is_empty() || components == "0" {
                dofs.push(Dof { node, direction: 0 });
                continue;
            }
            for c in components.chars() {
                let direction = c.to_digit(10).filter(|d| (1..=6).contains(d));
                let direction = direction.ok_or_else(|| {
                    ReadProblem::malformed(
                        place(),
                        shown(components),
                        "components, as 123456, or 0",
                    )
                })?;
                dofs.push(Dof { node, direction });
            }
        }
    }
    // The matrices have the points in the order of their numbers.
    dofs.sort_unstable();
    Ok((!dofs.is_empty()).then_some(dofs))
}
