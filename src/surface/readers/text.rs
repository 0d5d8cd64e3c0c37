//! Text: a matrix of heights, or a table of x, y, z.
//!
//! One line per x, its values along y, as `numpy.savetxt` writes the array whose axis 0 is x. Lines of exactly three numbers
//! are x, y, z. Separators are `;`, tab, `,` or blanks, found from the first line; `#` starts a comment; a line with the column
//! names x, y, z may come first. An empty field or `nan` is a hole. A text that would be read wrongly is rejected.

use csv::{ReaderBuilder, Trim};

use super::error::ReadProblem;
use super::lattice::{from_points, reject_points};
use super::{MOST_POINTS, ReadOptions, required_unit, too_many};
use crate::surface::topography::Topography;

/// First words of the comments that Gwyddion writes above a matrix.
const GWYDDION: [&str; 4] = ["Channel:", "Width:", "Height:", "Value units:"];

/// No height has so many of any unit: programs write such numbers where nothing was measured.
const FILLER: f64 = 1e30;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Topography, ReadProblem> {
    let text = std::str::from_utf8(bytes).map_err(|e| ReadProblem::Malformed {
        place: format!("byte {}", e.valid_up_to() + 1),
        found: "bytes that are not UTF-8 text".into(),
        expected: "numbers in plain text".into(),
    })?;
    let text = text.trim_start_matches('\u{feff}');
    let Numbers {
        columns,
        mut values,
        line,
    } = numbers(text)?;
    if columns == 0 {
        return Err(ReadProblem::Malformed {
            place: "the text".into(),
            found: "no numbers".into(),
            expected: "a matrix of heights, or lines of x, y, z".into(),
        });
    }
    reject_labels(columns, &values, line)?;
    let unit = required_unit(options, "text")?;
    if columns == 3 {
        let lateral = options.lateral_unit.unwrap_or(unit);
        let (rows, _) = values.as_chunks_mut::<3>();
        for row in &mut *rows {
            *row = [row[0] * lateral, row[1] * lateral, row[2] * unit];
        }
        return from_points(rows);
    }
    reject_gwyddion(text)?;
    if columns > 3 {
        reject_points(columns, &values)?;
    }
    Ok(Topography {
        nx: values.len() / columns,
        ny: columns,
        spacing: None,
        heights: values.into_iter().map(|h| h * unit).collect(),
    })
}

/// Rejects a matrix below the header of Gwyddion, which contradicts how its lines are read.
fn reject_gwyddion(text: &str) -> Result<(), ReadProblem> {
    let comments = text.lines().map_while(|line| line.trim().strip_prefix('#'));
    let is_of_it = |comment: &&str| GWYDDION.iter().any(|name| comment.starts_with(name));
    let header: Vec<&str> = comments.map(str::trim).filter(is_of_it).collect();
    if header.len() + 1 < GWYDDION.len() {
        return Ok(());
    }
    Err(ReadProblem::Unsupported {
        found: format!("a matrix that Gwyddion exported as text ({})", header.join(", ")),
        advice: "each of its lines is one y, and a line of a text matrix is one x here: export it as XYZ, or turn it by numpy.save(\"map.npy\", numpy.loadtxt(FILE).T); then give surface.unit, surface.spacing and joint.size that agree with its header".into(),
    })
}

/// The only names of columns.
const XYZ: [&str; 3] = ["x", "y", "z"];

/// Names of columns without their units: `X`, `x [um]` and `x_um` are x.
fn column_names<'a>(fields: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let names = fields.into_iter().map(|field| {
        let field = field.trim_matches(['"', '\'']);
        let name = field.split(|c: char| !c.is_alphanumeric()).next();
        name.unwrap_or_default().to_lowercase()
    });
    names.filter(|name| !name.is_empty()).collect()
}

fn require_xyz(line: u64, names: &[String]) -> Result<(), ReadProblem> {
    if names == XYZ {
        return Ok(());
    }
    Err(ReadProblem::Malformed {
        place: format!("line {line}"),
        found: format!("columns named {}", names.join(", ")),
        expected: "x, y, z in this order and no other column; a matrix of heights has no names"
            .into(),
    })
}

/// Rejects a first line of numbers that are labels of the columns, as data frames are saved, also with labels of the rows.
fn reject_labels(columns: usize, values: &[f64], line: u64) -> Result<(), ReadProblem> {
    let (first, heights) = values.split_at(columns);
    let labels = if first[0].is_nan() {
        &first[1..]
    } else {
        first
    };
    let counts = labels.len() > 2
        && (labels[0] == 0.0 || labels[0] == 1.0)
        && labels.windows(2).all(|pair| pair[1] == pair[0] + 1.0);
    if !counts || heights.iter().all(|h| h.is_nan() || h.fract() == 0.0) {
        return Ok(());
    }
    Err(ReadProblem::Malformed {
        place: format!("line {line}"),
        found: format!("{}, {}, {}, …, the labels of columns", labels[0], labels[1], labels[2]),
        expected: "heights: save the map without labels of columns and rows (pandas: header=False, index=False)".into(),
    })
}

/// Lines of as many numbers each.
struct Numbers {
    /// 0 without any.
    columns: usize,
    values: Vec<f64>,
    /// The line of the first.
    line: u64,
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
        line: 0,
    };
    let mut is_first = true;
    let mut names = Vec::new();
    each_line(text, separator, |line, mut fields| {
        if ended {
            fields = &fields[..fields.len() - 1];
        }
        if std::mem::take(&mut is_first) && fields.iter().all(|field| is_name(field)) {
            names = column_names(fields.iter().copied());
            return require_xyz(line, &names);
        }
        for (column, field) in fields.iter().enumerate() {
            let value = number(field).filter(|v| !(FILLER..f64::INFINITY).contains(&v.abs()));
            let value = value.ok_or_else(|| ReadProblem::Malformed {
                place: format!("line {line}, value {}", column + 1),
                found: format!("\"{field}\""),
                expected: "a number with a decimal point; for a hole nothing or nan, and no filler such as 1e38".into(),
            })?;
            found.values.push(value);
        }
        if found.columns == 0 {
            (found.columns, found.line) = (fields.len(), line);
        }
        let (columns, above) = match names.len() {
            0 => (found.columns, "numbers"),
            named => (named, "names"),
        };
        if fields.len() != columns {
            return Err(ReadProblem::Malformed {
                place: format!("line {line}"),
                found: format!("{} values", fields.len()),
                expected: format!("{columns}, as in the first line of {above}"),
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
        // A record begins with the comments above it.
        let line = record.position().map_or(0, |start| {
            let lines = text[start.byte() as usize..].lines();
            let above = lines.take_while(|line| line.is_empty() || line.starts_with('#'));
            start.line() + above.count() as u64
        });
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
