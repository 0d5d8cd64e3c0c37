//! Formats that `fretwear-import` reads, by how their files begin.

use super::error::ReadProblem;
use super::text::text_of;

/// Bytes that a format is recognised by.
const ENOUGH: usize = 1 << 16;

struct Format {
    name: &'static str,
    is: fn(&[u8]) -> bool,
}

const FORMATS: [Format; 6] = [
    Format {
        name: "a MATLAB MAT-file",
        is: |bytes| bytes.starts_with(b"MATLAB ") || bytes.starts_with(b"\x89HDF"),
    },
    Format {
        name: "a mesh of Gmsh",
        is: |bytes| bytes.starts_with(b"$MeshFormat"),
    },
    Format {
        name: "a Nastran OUTPUT4 file",
        is: |bytes| is_binary_op4(bytes) || is_text_op4(bytes),
    },
    Format {
        name: "a Nastran bulk data file",
        is: is_bulk,
    },
    Format {
        name: "an ANSYS archive (.cdb)",
        is: |bytes| {
            has_line(bytes, |line| {
                line.starts_with("/COM") || line.starts_with("NBLOCK")
            })
        },
    },
    Format {
        name: "a universal file",
        is: |bytes| has_line(bytes, |line| line.trim() == "-1"),
    },
];

/// What to do with a file that begins like one of these.
pub(super) fn advice_on(bytes: &[u8]) -> Option<ReadProblem> {
    let first = &bytes[..bytes.len().min(ENOUGH)];
    let format = FORMATS.iter().find(|format| (format.is)(first))?;
    Some(ReadProblem::Unsupported {
        found: format!("{}, as this seems to be,", format.name),
        advice: "fretwear-import FILE -o FOLDER writes a folder that is read".to_owned(),
    })
}

/// Whether a line among the first few that are no comments is such.
fn has_line(bytes: &[u8], is: fn(&str) -> bool) -> bool {
    const FEW: usize = 20;
    let text = text_of(bytes);
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let first = lines.next().into_iter();
    first.chain(lines.take(FEW)).any(is)
}

/// A record of Fortran with the header of a matrix: six or seven words of four or eight bytes, four of them integers, in either byte order.
fn is_binary_op4(bytes: &[u8]) -> bool {
    let Some(length) = bytes.first_chunk::<4>() else {
        return false;
    };
    let lengths = [u32::from_le_bytes(*length), u32::from_be_bytes(*length)];
    lengths.into_iter().any(|length| {
        let end = bytes.get(4 + length as usize..8 + length as usize);
        matches!(length, 24 | 28 | 48 | 56) && end == Some(&bytes[..4])
    })
}

/// Four integers of eight columns (sixteen in long files), a name, and the format of the numbers.
fn is_text_op4(bytes: &[u8]) -> bool {
    let text = text_of(bytes);
    let first = text.lines().find(|line| !line.trim().is_empty());
    let Some(first) = first.filter(|line| line.is_ascii() && line.contains('P')) else {
        return false;
    };
    [8, 16].into_iter().any(|width| {
        let field = |k: usize| first.get(k * width..(k + 1) * width).map(str::trim);
        (0..4).all(|k| field(k).is_some_and(|text| text.parse::<i64>().is_ok()))
    })
}

fn is_bulk(bytes: &[u8]) -> bool {
    const CARDS: [&str; 10] = [
        "DMIG", "GRID", "CORD2R", "CORD2C", "CORD2S", "CHEXA", "CTETRA", "CPENTA", "EXTRN", "ASET1",
    ];
    let text = text_of(bytes);
    text.lines().any(|line| {
        let card = line.split([',', ' ', '\t']).next().unwrap_or("");
        let card = card.trim_end_matches('*').to_ascii_uppercase();
        CARDS.contains(&card.as_str()) || line.trim().eq_ignore_ascii_case("BEGIN BULK")
    })
}
