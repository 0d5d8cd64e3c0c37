//! Text: a matrix of heights, or a table of x, y, z.
//!
//! One line per x, its values along y, as `numpy.savetxt` writes the array whose axis 0 is x. Lines of exactly three numbers
//! are x, y, z. Separators are `;`, tab, `,` or blanks, found from the first line; `#` starts a comment; one line of column
//! names may come first. An empty field or `nan` is a hole.

use csv::{ReaderBuilder, Trim};

use super::error::ReadProblem;
use super::lattice::from_points;
use super::{ReadOptions, required_unit};
use crate::surface::topography::Topography;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Topography, ReadProblem> {
    let unit = required_unit(options, "text")?;
    let text = std::str::from_utf8(bytes).map_err(|e| ReadProblem::Malformed {
        place: format!("byte {}", e.valid_up_to() + 1),
        found: "bytes that are not UTF-8 text".into(),
        expected: "numbers in plain text".into(),
    })?;
    let lines = numbers(text.trim_start_matches('\u{feff}'))?;
    let Some((_, first)) = lines.first() else {
        return Err(ReadProblem::Malformed {
            place: "the text".into(),
            found: "no numbers".into(),
            expected: "a matrix of heights, or lines of x, y, z".into(),
        });
    };
    let columns = first.len();
    if let Some((line, found)) = lines.iter().find(|(_, v)| v.len() != columns) {
        return Err(ReadProblem::Malformed {
            place: format!("line {line}"),
            found: format!("{} values", found.len()),
            expected: format!("{columns}, as in the first line of numbers"),
        });
    }
    if columns == 3 {
        let lateral = options.lateral_unit.unwrap_or(unit);
        let rows: Vec<[f64; 3]> = lines
            .iter()
            .map(|(_, v)| [v[0] * lateral, v[1] * lateral, v[2] * unit])
            .collect();
        return from_points(&rows);
    }
    Ok(Topography {
        nx: lines.len(),
        ny: columns,
        spacing: None,
        heights: lines
            .iter()
            .flat_map(|(_, v)| v)
            .map(|h| h * unit)
            .collect(),
    })
}

/// The numbers of each line, with the line's number in the file.
fn numbers(text: &str) -> Result<Vec<(u64, Vec<f64>)>, ReadProblem> {
    let first = text
        .lines()
        .find(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
        .unwrap_or_default();
    let separator = [';', '\t', ',']
        .into_iter()
        .find(|&s| first.trim().contains(s));
    let lines = match separator {
        Some(separator) => separated(text, separator)?,
        None => text
            .lines()
            .zip(1..)
            .filter(|(line, _)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
            .map(|(line, number)| (number, line.split_whitespace().map(String::from).collect()))
            .collect(),
    };
    // A separator at the end of every line ends a field, it does not start one.
    let ended = lines.iter().all(|(_, fields): &(u64, Vec<String>)| {
        fields.len() > 1 && fields[fields.len() - 1].is_empty()
    });
    let mut found = Vec::with_capacity(lines.len());
    for (position, (line, mut fields)) in lines.into_iter().enumerate() {
        if ended {
            fields.pop();
        }
        let names = position == 0 && fields.iter().all(|field| is_name(field));
        if names {
            continue;
        }
        let values = fields
            .iter()
            .enumerate()
            .map(|(column, field)| {
                number(field).ok_or_else(|| ReadProblem::Malformed {
                    place: format!("line {line}, value {}", column + 1),
                    found: format!("\"{field}\""),
                    expected: "a number with a decimal point, or nothing or nan for a hole".into(),
                })
            })
            .collect::<Result<Vec<f64>, _>>()?;
        found.push((line, values));
    }
    Ok(found)
}

fn separated(text: &str, separator: char) -> Result<Vec<(u64, Vec<String>)>, ReadProblem> {
    let mut reader = ReaderBuilder::new()
        .delimiter(separator as u8)
        .comment(Some(b'#'))
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    let mut lines = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| ReadProblem::Malformed {
            place: format!("line {}", e.position().map_or(0, |p| p.line())),
            found: e.to_string(),
            expected: format!("values separated by {separator:?}"),
        })?;
        let line = record.position().map_or(0, |p| p.line());
        let fields: Vec<String> = record.iter().map(String::from).collect();
        if fields.iter().all(String::is_empty) && fields.len() == 1 {
            continue;
        }
        lines.push((line, fields));
    }
    Ok(lines)
}

/// A name, as against a number that is misspelt.
fn is_name(field: &str) -> bool {
    let begins_a_number = |c: char| c.is_ascii_digit() || "+-.,".contains(c);
    number(field).is_none() && !field.starts_with(begins_a_number)
}

fn number(field: &str) -> Option<f64> {
    if field.is_empty() {
        Some(f64::NAN)
    } else {
        field.parse().ok()
    }
}
