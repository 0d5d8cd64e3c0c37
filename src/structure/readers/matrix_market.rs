//! Matrix Market exchange files. The reader supports coordinate and array files with real or integer values. The
//! matrices can be general, symmetric or skew-symmetric.

use super::error::ReadProblem;
use super::text::{Digits, last_number, quoted, text_of, whole};
use super::{NamedMatrix, ParsedFile, entries, rows, rows_of_few, square};
use crate::structure::matrices::Triplets;

const BANNER: &[u8] = b"%%matrixmarket";

pub(super) fn is(bytes: &[u8]) -> bool {
    bytes.len() >= BANNER.len() && bytes[..BANNER.len()].eq_ignore_ascii_case(BANNER)
}

pub(super) fn parse(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let text = text_of(bytes);
    let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    let (_, banner) = lines.next().unwrap_or((1, ""));
    let banner = banner.to_ascii_lowercase();
    let words: Vec<&str> = banner.split_whitespace().collect();
    let &[
        _,
        "matrix",
        form @ ("coordinate" | "array"),
        field,
        symmetry,
    ] = words.as_slice()
    else {
        return Err(ReadProblem::malformed(
            "line 1",
            quoted(&banner),
            "%%MatrixMarket matrix coordinate|array real|integer general|symmetric",
        ));
    };
    if !matches!(field, "real" | "double" | "integer") {
        return Err(ReadProblem::Unsupported {
            found: format!("a Matrix Market file of {field} numbers (line 1)"),
            advice: "stiffness, mass and damping are real: write it with `real`".into(),
        });
    }
    if !matches!(symmetry, "general" | "symmetric" | "skew-symmetric") {
        return Err(ReadProblem::malformed(
            "line 1",
            quoted(symmetry),
            "general, symmetric or skew-symmetric",
        ));
    }
    let mut content = lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('%'));
    let (line, sizes) = content.next().ok_or_else(|| {
        ReadProblem::truncated("the file", "its first line", "a line with the sizes")
    })?;
    let place = || format!("line {line}");
    let counts: Vec<u64> = sizes
        .split_whitespace()
        .map(|word| whole(word, "a count", place))
        .collect::<Result<_, _>>()?;
    let is_triangle = symmetry != "general";
    let (size, stored) = match (form, counts.as_slice()) {
        ("coordinate", &[m, n, nnz]) => {
            square(m, n, &place())?;
            (
                rows_of_few(m, &place())?,
                entries(nnz, bytes.len(), &place())?,
            )
        }
        ("array", &[m, n]) => {
            square(m, n, &place())?;
            let stored = match symmetry {
                "general" => m.saturating_mul(m),
                "symmetric" => (m + 1).saturating_mul(m) / 2,
                _ => m.saturating_mul(m - 1) / 2,
            };
            (
                rows(m, bytes.len(), &place())?,
                entries(stored, bytes.len(), &place())?,
            )
        }
        ("coordinate", _) => {
            return Err(ReadProblem::malformed(
                place(),
                quoted(sizes),
                "rows, columns and entries",
            ));
        }
        _ => {
            return Err(ReadProblem::malformed(
                place(),
                quoted(sizes),
                "rows and columns",
            ));
        }
    };
    let mut matrix = Triplets::new(size);
    let mut digits = Digits::default();
    let mut count = 0;
    // Next place of an array, column by column.
    let (mut row, mut column) = (usize::from(symmetry == "skew-symmetric"), 0);
    for (line, text) in content {
        let place = || format!("line {line}");
        if count == stored {
            return Err(ReadProblem::malformed(
                place(),
                quoted(text),
                format!("the end: {stored} entries are announced"),
            ));
        }
        count += 1;
        let mut words = text.split_whitespace();
        let (i, j) = if form == "array" {
            let at = (row, column);
            row += 1;
            if row == size {
                column += 1;
                row = match symmetry {
                    "general" => 0,
                    "symmetric" => column,
                    _ => column + 1,
                };
            }
            at
        } else {
            let mut index = |what: &str| -> Result<usize, ReadProblem> {
                let expected = format!("a {what} of 1 to {size}");
                let found: usize = whole(words.next().unwrap_or(""), &expected, place)?;
                if found == 0 || found > size {
                    return Err(ReadProblem::malformed(
                        place(),
                        format!("{what} {found}"),
                        expected,
                    ));
                }
                Ok(found - 1)
            };
            (index("row")?, index("column")?)
        };
        let value = last_number(words, &mut digits, "its value", place)?;
        if symmetry == "skew-symmetric" {
            matrix.entries.push((i as u32, j as u32, value));
            matrix.entries.push((j as u32, i as u32, -value));
        } else if is_triangle && i < j {
            return Err(ReadProblem::malformed(
                place(),
                format!("row {} of column {}", i + 1, j + 1),
                "an entry on or below the diagonal, as the first line says symmetric",
            ));
        } else if form == "coordinate" || value != 0.0 {
            matrix.entries.push((i as u32, j as u32, value));
        }
    }
    if count < stored {
        return Err(ReadProblem::truncated(
            "the file",
            format!("{count} entries"),
            format!("{stored} (line {line})"),
        ));
    }
    matrix.is_triangle = symmetry == "symmetric";
    matrix.precision = digits.precision();
    let mut notes = Vec::new();
    let one_side =
        matrix.entries.iter().all(|e| e.0 >= e.1) || matrix.entries.iter().all(|e| e.0 <= e.1);
    if !is_triangle && one_side && matrix.entries.iter().any(|e| e.0 != e.1) {
        notes.push("the first line of the Matrix Market file says general, but only one triangle has entries: if the matrix is symmetric, say symmetric there".to_owned());
    }
    Ok(ParsedFile {
        matrices: vec![NamedMatrix {
            name: String::new(),
            role: None,
            matrix,
            dofs: None,
            has_unknown_size: false,
        }],
        notes,
        ..ParsedFile::default()
    })
}
