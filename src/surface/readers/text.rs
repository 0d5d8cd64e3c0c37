//! Text: a matrix of heights, or a table of x, y, z.
//!
//! One line per x, its values along y, as `numpy.savetxt` writes the array whose axis 0 is x. Lines of exactly three numbers
//! are x, y, z. Separators are `;`, tab, `,` or blanks, found from the first line; `#` starts a comment; one line of column
//! names may come first. An empty field or `nan` is a hole.

use csv::{ReaderBuilder, Trim};

use super::error::ReadProblem;
use super::lattice::from_points;
use super::{MOST_POINTS, ReadOptions, required_unit, too_many};
use crate::surface::topography::Topography;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Topography, ReadProblem> {
    let unit = required_unit(options, "text")?;
    let text = std::str::from_utf8(bytes).map_err(|e| ReadProblem::Malformed {
        place: format!("byte {}", e.valid_up_to() + 1),
        found: "bytes that are not UTF-8 text".into(),
        expected: "numbers in plain text".into(),
    })?;
    let Numbers {
        columns,
        mut values,
    } = numbers(text.trim_start_matches('\u{feff}'))?;
    if columns == 0 {
        return Err(ReadProblem::Malformed {
            place: "the text".into(),
            found: "no numbers".into(),
            expected: "a matrix of heights, or lines of x, y, z".into(),
        });
    }
    if columns == 3 {
        let lateral = options.lateral_unit.unwrap_or(unit);
        let (rows, _) = values.as_chunks_mut::<3>();
        for row in &mut *rows {
            *row = [row[0] * lateral, row[1] * lateral, row[2] * unit];
        }
        return from_points(rows);
    }
    Ok(Topography {
        nx: values.len() / columns,
        ny: columns,
        spacing: None,
        heights: values.into_iter().map(|h| h * unit).collect(),
    })
}

/// Lines of as many numbers each.
struct Numbers {
    /// 0 without any.
    columns: usize,
    values: Vec<f64>,
}

fn numbers(text: &str) -> Result<Numbers, ReadProblem> {
    let first = text
        .lines()
        .find(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
        .unwrap_or_default();
    let separator = [';', '\t', ',']
        .into_iter()
        .find(|&s| first.trim().contains(s));
    // A separator at the end of every line ends a field, it does not start one.
    let mut ended = separator.is_some();
    if ended {
        each_line(text, separator, |_, fields| {
            ended &= fields.len() > 1 && fields[fields.len() - 1].is_empty();
            Ok(())
        })?;
    }
    let mut found = Numbers {
        columns: 0,
        values: Vec::new(),
    };
    let mut is_first = true;
    each_line(text, separator, |line, mut fields| {
        if ended {
            fields = &fields[..fields.len() - 1];
        }
        let names = std::mem::take(&mut is_first) && fields.iter().all(|field| is_name(field));
        if names {
            return Ok(());
        }
        for (column, field) in fields.iter().enumerate() {
            let value = number(field).ok_or_else(|| ReadProblem::Malformed {
                place: format!("line {line}, value {}", column + 1),
                found: format!("\"{field}\""),
                expected: "a number with a decimal point, or nothing or nan for a hole".into(),
            })?;
            found.values.push(value);
        }
        if found.columns == 0 {
            found.columns = fields.len();
        }
        if fields.len() != found.columns {
            return Err(ReadProblem::Malformed {
                place: format!("line {line}"),
                found: format!("{} values", fields.len()),
                expected: format!("{}, as in the first line of numbers", found.columns),
            });
        }
        // A line of three is one point.
        let points = found.values.len() / if found.columns == 3 { 3 } else { 1 };
        if points > MOST_POINTS {
            return Err(too_many(format!("{points} points up to line {line}")));
        }
        Ok(())
    })?;
    Ok(found)
}

/// Hands on the number of each line in the file, and its fields.
fn each_line(
    text: &str,
    separator: Option<char>,
    mut each: impl FnMut(u64, &[&str]) -> Result<(), ReadProblem>,
) -> Result<(), ReadProblem> {
    let mut fields: Vec<&str> = Vec::new();
    let Some(separator) = separator else {
        for (line, number) in text.lines().zip(1..) {
            if line.trim().is_empty() || line.trim_start().starts_with('#') {
                continue;
            }
            fields.clear();
            fields.extend(line.split_whitespace());
            each(number, &fields)?;
        }
        return Ok(());
    };
    let mut reader = ReaderBuilder::new()
        .delimiter(separator as u8)
        .comment(Some(b'#'))
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    for record in reader.records() {
        let record = record.map_err(|e| ReadProblem::Malformed {
            place: format!("line {}", e.position().map_or(0, |p| p.line())),
            found: e.to_string(),
            expected: format!("values separated by {separator:?}"),
        })?;
        let line = record.position().map_or(0, |p| p.line());
        let fields: Vec<&str> = record.iter().collect();
        if fields.iter().all(|field| field.is_empty()) && fields.len() == 1 {
            continue;
        }
        each(line, &fields)?;
    }
    Ok(())
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
