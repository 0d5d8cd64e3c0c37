//! ANSYS `.full` files.
//!
//! The file is a sequence of records of 4-byte words. The file stores the length of each record before and after the
//! record. Two headers are followed by the nodes in the order of the equations. After the nodes, the file has one row
//! of the upper triangle per equation. A row has the column numbers, with the number of the equation last, and the
//! values. Fixed degrees of freedom are unit rows.

use super::error::ReadProblem;
use super::{NamedMatrix, ParsedFile, entries, rows};
use crate::structure::matrices::{Dof, Role, Triplets};

/// Size of a word in bytes.
const WORD: usize = 4;
/// Marker before a record of integers. Doubles have 0. Other bits mark compressed records.
const WHOLE: u32 = 0x8000_0000;
/// Number of words of each header.
const HEADER: usize = 100;
/// File type: the first word of the first header.
const FULL: i32 = 4;
/// First word of the second header in files with assembled matrices.
const ASSEMBLED: i32 = -4;

/// Indices of words in the second header, from 0.
mod at {
    pub const KIND: usize = 0;
    pub const EQUATIONS: usize = 1;
    pub const STIFFNESS_TERMS: [usize; 2] = [8, 9];
    pub const LUMPED: usize = 10;
    pub const UNSYMMETRIC: usize = 13;
    pub const STIFFNESS: usize = 18;
    pub const CONSTRAINTS: usize = 20;
    pub const MASS_TERMS: [usize; 2] = [33, 21];
    pub const MASS: usize = 26;
    pub const DAMPING: usize = 28;
    pub const NODES: usize = 32;
    pub const DAMPING_TERMS: [usize; 2] = [34, 39];
    pub const FREEDOMS: usize = 35;
}

/// First words of a file in its byte order.
const BEGIN: [i32; 3] = [HEADER as i32, WHOLE as i32, FULL];

pub(super) fn is(bytes: &[u8]) -> bool {
    let file = Words { bytes };
    let begins_with = |expected: [i32; 3]| (0..3).all(|k| file.word(k) == Some(expected[k]));
    begins_with(BEGIN) || begins_with(BEGIN.map(i32::swap_bytes))
}

pub(super) fn parse(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let file = Words { bytes };
    if file.word(0) != Some(BEGIN[0]) {
        return Err(ReadProblem::Unsupported {
            found: "the byte order of the file, the largest byte first,".into(),
            advice: "write it on a little-endian machine (Intel, ARM)".into(),
        });
    }
    let mut place = 0;
    file.whole(&mut place, "the standard header")?;
    let header = file.whole(&mut place, "the header of the file")?;
    if header.len() < HEADER {
        let expected = format!("{HEADER} words");
        return Err(ReadProblem::truncated(
            "the header of the file",
            format!("{} words", header.len()),
            expected,
        ));
    }
    for (word, is_read, found, advice) in [
        (
            at::KIND,
            header[at::KIND] == ASSEMBLED,
            "a file of the frontal solver",
            "solve with the sparse solver (EQSLV,SPARSE)",
        ),
        (
            at::LUMPED,
            header[at::LUMPED] == 0,
            "a lumped mass matrix",
            "write a consistent one (LUMPM,OFF)",
        ),
        (
            at::UNSYMMETRIC,
            header[at::UNSYMMETRIC] == 0,
            "unsymmetric matrices",
            "remove the cause (NROPT,FULL,,OFF; friction, gyroscopic terms)",
        ),
        (
            at::CONSTRAINTS,
            header[at::CONSTRAINTS] == 0,
            "constraint equations in the matrices",
            "give the bodies without them (CE, CERIG, RBE3, bonded contact)",
        ),
    ] {
        if !is_read {
            return Err(ReadProblem::Unsupported {
                found: format!(
                    "{found} (word {} of the header: {})",
                    word + 1,
                    header[word]
                ),
                advice: advice.into(),
            });
        }
    }
    file.whole(&mut place, "the list of kinds of freedoms")?;
    let nodes = file.whole(&mut place, "the list of nodes")?;
    let equations = u64::try_from(header[at::EQUATIONS]).unwrap_or(0);
    let equations = rows(equations, bytes.len(), "the header of the file")?;
    let mut place = file.pointer(&header, [at::FREEDOMS, at::FREEDOMS + 1]);
    let counts = file.whole(&mut place, "the numbers of freedoms of the nodes")?;
    let kinds = file.whole(&mut place, "the kinds of the freedoms")?;
    let listed: i64 = counts.iter().map(|count| i64::from(*count)).sum();
    let is_consistent = counts.len() == nodes.len() && counts.iter().all(|count| *count >= 0);
    if !is_consistent || listed != equations as i64 || kinds.len() != equations {
        return Err(ReadProblem::malformed(
            "the lists of freedoms",
            format!(
                "{} nodes, {} numbers of freedoms with a sum of {listed}, {} kinds",
                nodes.len(),
                counts.len(),
                kinds.len()
            ),
            format!(
                "{} nodes and {equations} freedoms, as the header has them",
                header[at::NODES]
            ),
        ));
    }
    let node_counts = nodes.iter().zip(&counts);
    let node = node_counts.flat_map(|(node, count)| vec![i64::from(*node); *count as usize]);
    let all_dofs: Vec<Dof> = node
        .zip(&kinds)
        .map(|(node, kind)| Dof {
            node,
            direction: kind.unsigned_abs(),
        })
        .collect();
    // A negative kind is a fixed degree of freedom.
    let mut free = Vec::with_capacity(equations);
    let mut dofs = Vec::new();
    for (dof, kind) in all_dofs.iter().zip(&kinds) {
        free.push((*kind > 0).then_some(dofs.len() as u32));
        if *kind > 0 {
            dofs.push(*dof);
        }
    }
    let mut parsed = ParsedFile::default();
    if dofs.len() < equations {
        parsed.notes.push(format!(
            "{} of {equations} freedoms are fixed in the file, and are left out",
            equations - dofs.len()
        ));
    }
    for (role, pointer, terms) in [
        (Role::Stiffness, at::STIFFNESS, at::STIFFNESS_TERMS),
        (Role::Mass, at::MASS, at::MASS_TERMS),
        (Role::Damping, at::DAMPING, at::DAMPING_TERMS),
    ] {
        let begin = file.pointer(&header, [pointer, pointer + 1]);
        if begin > 0 {
            let announced = file.pointer(&header, terms);
            let (matrix, found) = triangle(&file, begin, role.name(), &free, dofs.len())?;
            if found != announced {
                return Err(ReadProblem::malformed(
                    role.name(),
                    format!("{found} entries"),
                    format!("{announced}, as the header has it"),
                ));
            }
            parsed.matrices.push(NamedMatrix {
                name: role.name().to_owned(),
                role: Some(role),
                matrix,
                dofs: Some(dofs.clone()),
                has_unknown_size: false,
            });
        }
    }
    Ok(parsed)
}

/// Reads the matrix that begins at word `begin`, and counts its entries. The matrix has the free rows only, the count
/// all rows.
fn triangle(
    file: &Words,
    begin: usize,
    name: &str,
    free: &[Option<u32>],
    size: usize,
) -> Result<(Triplets, usize), ReadProblem> {
    let mut matrix = Triplets::new(size);
    matrix.is_triangle = true;
    let mut entry_count = 0;
    let mut place = begin;
    for (row, own_row) in free.iter().enumerate() {
        let part = || format!("{name}, row {}", row + 1);
        let columns = file.whole(&mut place, &part())?;
        let values = file.doubles(&mut place, &part())?;
        if columns.len() != values.len() {
            return Err(ReadProblem::malformed(
                part(),
                format!("{} columns and {} values", columns.len(), values.len()),
                "as many values as columns",
            ));
        }
        entry_count += columns.len();
        for (column, value) in columns.into_iter().zip(values) {
            let other_row = usize::try_from(column).ok().and_then(|c| c.checked_sub(1));
            let other_row = other_row.and_then(|c| free.get(c).copied());
            let Some(other_row) = other_row else {
                return Err(ReadProblem::malformed(
                    part(),
                    format!("column {column}"),
                    format!("1 to {}", free.len()),
                ));
            };
            if let (Some(i), Some(j)) = (*own_row, other_row) {
                matrix.entries.push((i.max(j), i.min(j), value));
            }
        }
        entries(matrix.entries.len() as u64, file.bytes.len(), name)?;
    }
    Ok((matrix, entry_count))
}

/// File as a sequence of words.
struct Words<'a> {
    bytes: &'a [u8],
}

impl Words<'_> {
    fn word(&self, at: usize) -> Option<i32> {
        let begin = at.checked_mul(WORD)?;
        let bytes = self.bytes.get(begin..begin.checked_add(WORD)?)?;
        Some(i32::from_le_bytes(bytes.try_into().ok()?))
    }

    /// Returns a number that the header has in two words, the lower word first.
    fn pointer(&self, header: &[i32], at: [usize; 2]) -> usize {
        let [low, high] = at.map(|word| u64::from(header[word] as u32));
        usize::try_from(high << 32 | low).unwrap_or(usize::MAX)
    }

    /// Returns the bytes of the record at `place`, and moves `place` to the next record.
    fn record(&self, place: &mut usize, kind: u32, part: &str) -> Result<&[u8], ReadProblem> {
        let truncated = || {
            ReadProblem::truncated(
                part,
                format!("{} words", self.bytes.len() / WORD),
                format!("a record at word {place}"),
            )
        };
        let length = self.word(*place).ok_or_else(truncated)?;
        let found = self.word(place.saturating_add(1)).ok_or_else(truncated)? as u32;
        if found != kind {
            let known_kinds = [0, WHOLE];
            let unsupported = |found: u32| ReadProblem::Unsupported {
                found: format!("a record of the kind {found:#010x} ({part})"),
                advice: "write the file without compression (/FCOMP,FULL,0), in double precision"
                    .into(),
            };
            return Err(match known_kinds.contains(&found) {
                true => ReadProblem::malformed(
                    part,
                    format!("a record of the kind {found:#010x}"),
                    format!("{kind:#010x}"),
                ),
                false => unsupported(found),
            });
        }
        let words = usize::try_from(length).map_err(|_| {
            ReadProblem::malformed(part, format!("a record of {length} words"), "0 or more")
        })?;
        let begin = (*place + 2) * WORD;
        let end = begin.saturating_add(words.saturating_mul(WORD));
        let bytes = self.bytes.get(begin..end).ok_or_else(truncated)?;
        let again = self.word(*place + 2 + words).ok_or_else(truncated)?;
        if again != length {
            return Err(ReadProblem::malformed(
                part,
                format!("a record of {length} words that ends with {again}"),
                "its length at both ends",
            ));
        }
        *place += words + 3;
        Ok(bytes)
    }

    fn whole(&self, place: &mut usize, part: &str) -> Result<Vec<i32>, ReadProblem> {
        let bytes = self.record(place, WHOLE, part)?;
        let words = bytes.chunks_exact(WORD);
        Ok(words
            .map(|word| i32::from_le_bytes(word.try_into().expect("a word")))
            .collect())
    }

    fn doubles(&self, place: &mut usize, part: &str) -> Result<Vec<f64>, ReadProblem> {
        let bytes = self.record(place, 0, part)?;
        if !bytes.len().is_multiple_of(2 * WORD) {
            return Err(ReadProblem::malformed(
                part,
                format!("{} words", bytes.len() / WORD),
                "two words a value",
            ));
        }
        let values = bytes.chunks_exact(2 * WORD);
        Ok(values
            .map(|value| f64::from_le_bytes(value.try_into().expect("two words")))
            .collect())
    }
}
