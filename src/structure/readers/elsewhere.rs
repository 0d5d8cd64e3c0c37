//! Formats that only `fretwear-import` reads, recognised by the beginning of the file.

use super::error::ReadProblem;
use super::text::text_of;

/// Number of bytes that are examined.
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

/// Returns an error with advice if the file begins like a format in [`FORMATS`].
pub(super) fn advice_on(bytes: &[u8]) -> Option<ReadProblem> {
    let beginning = &bytes[..bytes.len().min(ENOUGH)];
    let format = FORMATS.iter().find(|format| (format.is)(beginning))?;
    Some(ReadProblem::Unsupported {
        found: format!("{}, as this seems to be,", format.name),
        advice: "convert it with fretwear-import FILE -o FOLDER, and give the folder".to_owned(),
    })
}

/// Returns true if `is` accepts one of the first nonempty lines.
fn has_line(bytes: &[u8], is: fn(&str) -> bool) -> bool {
    const FEW: usize = 20;
    let text = text_of(bytes);
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let first = lines.next().into_iter();
    first.chain(lines.take(FEW)).any(is)
}

/// Returns true if the bytes begin with a Fortran record that is the header of a matrix. The header has six or seven
/// words of four or eight bytes, in either byte order.
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

/// Returns true if the first line has four integers of eight columns (sixteen in long files) and a number format.
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
