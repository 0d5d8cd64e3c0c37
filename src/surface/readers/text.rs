//! Reader of text files. A text file contains a matrix of heights or a table of x, y and z.
//!
//! Each line of a matrix contains the heights at one x, in ascending order of y. `numpy.savetxt` writes the same order
//! for an array with axis 0 along x. Below a header of Gwyddion or SPIP, each line contains the heights at one y. The
//! reader reads a table of points if the columns are named x, y, z, or if every line has exactly three numbers. The
//! separator of numbers is `;`, tab, `,` or blanks. The reader finds the separator in the first lines of the text. `#`
//! starts a comment. The reader rejects a text that it could misread.

use csv::{ReaderBuilder, Trim};

use super::encoding::{decode, reject_controls};
use super::error::ReadProblem;
use super::headers::{self, Header};
use super::lattice::{from_points, reject_points};
use super::{
    Content, MOST_POINTS, ReadOptions, from_lines, length_unit, required_unit, same_unit,
    stated_unit, too_many,
};
use crate::surface::topography::Topography;

/// Smallest magnitude of a number that the reader treats as a hole. Programs write numbers of 1e30 or more at
/// unmeasured points.
const FILLER: f64 = 1e30;

/// Texts that mark a hole, as the reader's remarks name these texts. The reader ignores the case of the texts. A hole
/// may also be a longer run of `*` or of `-`.
const HOLES: [&str; 10] = [
    "",
    "nan",
    "NA",
    "N/A",
    "null",
    "Bad",
    "No Data",
    "***",
    "---",
    "1e30 or more",
];

/// Advice against labels.
const NO_LABELS: &str =
    "heights: save the map without labels of columns and rows (pandas: header=False, index=False)";

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let (text, encoding) = decode(bytes, None)?;
    reject_controls(&text, encoding)?;
    headers::reject_instruments(&text)?;
    let comments = headers::comments(&text);
    let header = Header::of(&comments)?;
    if header.is_some() {
        headers::reject_several(&text)?;
    }
    let numbers = Numbers::of(&text, &comments)?;
    if numbers.columns == 0 {
        return Err(ReadProblem::Malformed {
            place: "the text".into(),
            found: "no numbers".into(),
            expected: "a matrix of heights, or lines of x, y, z".into(),
        });
    }
    let mut remarks = Vec::new();
    if encoding != "UTF-8" {
        remarks.push(format!("the text is read as {encoding}"));
    }
    remarks.extend(numbers.remarks());
    let (topography, stated_unit) = match (numbers.names.is_some(), header) {
        (false, Some(header)) => below_header(&header, numbers, options, &mut remarks)?,
        (named, _) => {
            if !named {
                reject_labels(numbers.columns, &numbers.values, numbers.line)?;
            }
            if named || numbers.columns == 3 {
                let units = headers::units_of_points(&comments)?;
                points(numbers, units, options, &mut remarks)?
            } else {
                (matrix(numbers, options, &mut remarks)?, None)
            }
        }
    };
    Ok((topography, stated_unit, remarks))
}

/// Reads a matrix with one line per x.
fn matrix(
    numbers: Numbers,
    options: &ReadOptions,
    remarks: &mut Vec<String>,
) -> Result<Topography, ReadProblem> {
    let columns = numbers.columns;
    let unit = required_unit(options, "text")?;
    if columns > 3 {
        reject_points(columns, &numbers.values)?;
    }
    let nx = numbers.values.len() / columns;
    remarks.push(format!(
        "{nx} lines of {columns} values: {}",
        if options.transpose {
            "a line of the text is one y, by surface.transpose"
        } else {
            "a line of the text is one x; surface.transpose = true makes it one y"
        }
    ));
    Ok(Topography {
        nx,
        ny: columns,
        spacing: None,
        heights: numbers.values.into_iter().map(|h| h * unit).collect(),
    })
}

/// Reads the matrix of heights below `header`, with one line of numbers per y.
fn below_header(
    header: &Header,
    mut numbers: Numbers,
    options: &ReadOptions,
    remarks: &mut Vec<String>,
) -> Result<(Topography, Option<f64>), ReadProblem> {
    let nx = numbers.columns;
    let mut lines = numbers.values.len() / nx;
    let masked = |[_, y]: [usize; 2]| lines.is_multiple_of(2) && lines / 2 == y;
    if header.voids && header.points.is_some_and(masked) {
        // The lower half is a mask: 0 for unmeasured points, 1 for others.
        lines /= 2;
        let (heights, mask) = numbers.values.split_at_mut(lines * nx);
        if let Some(found) = mask.iter().find(|v| **v != 0.0 && **v != 1.0) {
            let expected = "as many lines of 0 and 1 below the heights as the heights have, since voidpixels is not 0";
            return Err(ReadProblem::malformed("the mask", found, expected));
        }
        for (height, _) in heights.iter_mut().zip(mask).filter(|(_, m)| **m == 0.0) {
            *height = f64::NAN;
        }
    } else if header.voids && !numbers.values.iter().any(|h| h.is_nan()) {
        let expected = "a mask of 0 and 1 below the heights, or values such as nan";
        return Err(ReadProblem::malformed(
            "the header's voidpixels",
            "points that were not measured, and no mark of them",
            expected,
        ));
    }
    if let Some([x, y]) = header.points.filter(|points| *points != [nx, lines]) {
        return Err(ReadProblem::malformed(
            "the matrix",
            format!("{lines} lines of {nx} values"),
            &format!("{y} lines of {x}, as the header says"),
        ));
    }
    let unit = match header.unit {
        Some(stated) => stated_unit(options, stated)?,
        None => required_unit(options, "text")?,
    };
    let size = header.size.as_ref();
    remarks.push(format!(
        "the header of {} {}: {}",
        header.program,
        size.map_or("states no size".into(), |(_, text)| format!("says {text}")),
        if options.transpose {
            "a line of the text is one x, by surface.transpose"
        } else {
            "a line of the text is one y; surface.transpose = true makes it one x"
        }
    ));
    let topography = Topography {
        nx,
        ny: lines,
        spacing: size.map(|([x, y], _)| [x / nx as f64, y / lines as f64]),
        heights: from_lines(nx, lines, |index| numbers.values[index] * unit),
    };
    Ok((topography, header.unit))
}

/// Reads points x, y, z. `comments` contains the units of positions and of heights that the comments state.
fn points(
    mut numbers: Numbers,
    comments: [Option<f64>; 2],
    options: &ReadOptions,
    remarks: &mut Vec<String>,
) -> Result<(Topography, Option<f64>), ReadProblem> {
    let names = numbers.names.as_ref();
    let name = |axis: usize| names.map_or("", |names| &names.all[names.xyz[axis]]);
    let stated = bracketed_unit(name(2))?.or(comments[1]);
    let unit = match stated {
        Some(stated) => stated_unit(options, stated)?,
        None => required_unit(options, "text")?,
    };
    // Positions use the unit of the heights. A correction changes the unit of the heights only.
    let user_unit = options.lateral_unit.or(options.height_unit);
    let mut units = [user_unit.or(stated).unwrap_or(unit); 3];
    for axis in 0..2 {
        match bracketed_unit(name(axis))?.or(comments[0]) {
            Some(own) => units[axis] = own,
            None if stated.is_some() => remarks.push(format!(
                "{} is read in the unit of z, {:e} m",
                ["x", "y"][axis],
                units[axis]
            )),
            None => {}
        }
    }
    units[2] = unit;
    // A correction may contradict the name of z.
    let checked = if options.correct.unit.is_some() { 2 } else { 3 };
    for (axis, unit) in units.into_iter().enumerate().take(checked) {
        if ending_unit(name(axis)).is_some_and(|hint| !same_unit(hint, unit)) {
            return Err(ReadProblem::malformed(
                &format!("column {}", name(axis)),
                format!("another unit in its name than surface.unit, {unit:e} m"),
                "the same, or a unit in brackets, such as z [nm], which is read",
            ));
        }
    }
    let (rows, _) = numbers.values.as_chunks_mut::<3>();
    for row in &mut *rows {
        for (value, unit) in row.iter_mut().zip(units) {
            *value *= unit;
        }
    }
    from_points(rows).map(|topography| (topography, stated))
}

/// Names of all columns, and the indices of x, y and z.
struct Names {
    all: Vec<String>,
    xyz: [usize; 3],
}

impl Names {
    fn of(fields: &[&str], place: &str) -> Result<Names, ReadProblem> {
        let mut all: Vec<String> = Vec::new();
        for field in fields {
            let field = field.trim_matches(['"', '\'']);
            match all.last_mut() {
                // A field that begins with a bracket is a unit: join the unit to the name before the blank.
                Some(name) if field.starts_with(['[', '(']) => *name = format!("{name} {field}"),
                _ => all.push(field.to_owned()),
            }
        }
        let places = |part_of_name: fn(&str) -> &str, axis: &str| -> Vec<usize> {
            let is_axis = |&k: &usize| part_of_name(&all[k]).eq_ignore_ascii_case(axis);
            (0..all.len()).filter(is_axis).collect()
        };
        let matches = ["x", "y", "z"].map(|axis| match places(bare, axis) {
            none if none.is_empty() => places(first_word, axis),
            exact => exact,
        });
        match matches.each_ref().map(|places| &places[..]) {
            [&[x], &[y], &[z]] => Ok(Names {
                all,
                xyz: [x, y, z],
            }),
            [&[_], &[], &[_]] => Err(ReadProblem::Unsupported {
                found: format!("a profile ({place}: columns x and z without y)"),
                advice: "a surface has points x, y, z, or a matrix of heights".into(),
            }),
            _ => {
                all.retain(|name| !name.is_empty());
                let expected = "x, y and z, each once and in any order, beside others; a matrix of heights has no names (pandas: header=False, index=False)";
                let names = format!("columns named {}", all.join(", "));
                Err(ReadProblem::malformed(place, names, expected))
            }
        }
    }

    fn remark(&self) -> Option<String> {
        let unread = (0..self.all.len()).filter(|k| !self.xyz.contains(k));
        let unread: Vec<String> = unread.map(|k| format!("\"{}\"", self.all[k])).collect();
        let names = self.all.join(", ");
        match unread.len() {
            0 if self.xyz.is_sorted() => None,
            0 => Some(format!("columns {names}, by their names")),
            _ => Some(format!("columns {names}: not read {}", unread.join(", "))),
        }
    }
}

/// Returns the name of a column without the unit of the column: `z` for `z [nm]` and for `z_nm`.
fn bare(name: &str) -> &str {
    let name = name.split(['[', '(']).next().unwrap_or_default().trim();
    match name.rsplit_once('_') {
        Some((plain, _)) if ending_unit(name).is_some() => plain,
        _ => name,
    }
}

fn first_word(name: &str) -> &str {
    let mut words = name.split(|c: char| !c.is_alphanumeric());
    words.next().unwrap_or_default()
}

/// Returns the unit in brackets after a name \[m\].
fn bracketed_unit(name: &str) -> Result<Option<f64>, ReadProblem> {
    let Some((_, rest)) = name.split_once(['[', '(']) else {
        return Ok(None);
    };
    let text = rest.split([']', ')']).next().unwrap_or_default();
    length_unit(text).map(Some).ok_or_else(|| {
        let expected = "m, mm, um or nm, or no brackets";
        ReadProblem::malformed(&format!("the unit of column {name}"), text, expected)
    })
}

/// Returns the unit that a name seems to end with, as in `z_nm` \[m\].
fn ending_unit(name: &str) -> Option<f64> {
    name.rsplit_once('_')
        .and_then(|(_, unit)| length_unit(unit))
}

/// Rejects a matrix whose first line contains labels or positions of the columns. Rejects a matrix whose first column
/// numbers the lines. A saved data frame contains labels of its columns and lines.
fn reject_labels(columns: usize, values: &[f64], line: u64) -> Result<(), ReadProblem> {
    let corner = usize::from(values[0].is_nan());
    let lines = values.chunks_exact(columns);
    let first_line = &values[corner..columns];
    let second_line = lines.clone().nth(1).map_or(&[][..], |next| &next[corner..]);
    let column = |k: usize| lines.clone().skip(corner).map(move |line| line[k]);
    let (first_column, second_column): (Vec<f64>, Vec<f64>) = match columns {
        // Points, or one value per line.
        1 | 3 => (Vec::new(), Vec::new()),
        _ => (column(0).collect(), column(1).collect()),
    };
    let along_line = steps(first_line);
    let along_column = steps(&first_column);
    let both = corner == 1 && along_line.is_some() && along_column.is_some();
    let whole = |heights: &[f64]| heights.iter().all(|h| h.is_nan() || h.fract() == 0.0);
    // Equally spaced numbers may be heights instead of labels: integer heights, or heights on a plane.
    let counts =
        |labels: &[f64], steps_found: Option<(f64, f64)>, neighbours: &[f64]| match steps_found {
            Some((start, step)) => {
                let by_one = step == 1.0 && (start == 0.0 || start == 1.0);
                let positions = labels.len() > 4 || start == 0.0 && labels.len() > 3;
                (by_one || positions)
                    && steps(neighbours).is_none_or(|(_, other)| !near(other, step, step))
            }
            None => false,
        };
    let fail = |place: String, labels: &[f64], of: &str| {
        let [a, b, c] = [labels[0], labels[1], labels[2]];
        Err(ReadProblem::Malformed {
            place,
            found: format!("{a}, {b}, {c}, …, the labels of {of}"),
            expected: NO_LABELS.into(),
        })
    };
    if both || counts(first_line, along_line, second_line) && !whole(values) {
        return fail(format!("line {line}"), first_line, "columns");
    }
    let numbered = along_column.is_some_and(|(_, step)| step == 1.0 || first_column.len() > 4);
    if numbered && counts(&first_column, along_column, &second_column) && !whole(values) {
        return fail("column 1".into(), &first_column, "rows");
    }
    Ok(())
}

/// Returns start and step of three or more equally spaced numbers, up to the rounding of printed digits.
fn steps(values: &[f64]) -> Option<(f64, f64)> {
    let (&[start, ..], &[.., end]) = (values, values) else {
        return None;
    };
    let step = (end - start) / (values.len() - 1) as f64;
    let equal = || {
        (0..)
            .zip(values)
            .all(|(k, &v)| near(v, start + f64::from(k) * step, step))
    };
    (values.len() > 2 && step != 0.0 && equal()).then_some((start, step))
}

fn near(a: f64, b: f64, step: f64) -> bool {
    (a - b).abs() <= 0.01 * step.abs()
}

/// Lines with equally many numbers.
struct Numbers {
    /// Numbers per line; 0 without numbers.
    columns: usize,
    /// Numbers line by line. If the file names its columns, `values` contains x, y and z of each line in this order.
    values: Vec<f64>,
    /// Number of the first line.
    line: u64,
    names: Option<Names>,
    /// Number of occurrences of each of [`HOLES`].
    holes: [usize; HOLES.len()],
    /// First lines with a decimal comma and with a decimal point.
    comma: Option<u64>,
    point: Option<u64>,
}

impl Numbers {
    /// Parses the numbers of a text. One of the `comments` above the numbers may name the columns.
    fn of(text: &str, comments: &[&str]) -> Result<Numbers, ReadProblem> {
        let separator = separator(text);
        // A separator at the end of every line does not start another field.
        let mut has_trailing_separator = separator.is_some();
        if has_trailing_separator {
            each_line(text, separator, |_, fields| {
                has_trailing_separator &= fields.len() > 1 && fields[fields.len() - 1].is_empty();
                Ok(())
            })?;
        }
        let mut numbers = Numbers {
            columns: 0,
            values: Vec::new(),
            line: 0,
            names: None,
            holes: [0; HOLES.len()],
            comma: None,
            point: None,
        };
        let mut is_first = true;
        // Fields per line.
        let mut count = 0;
        each_line(text, separator, |line, mut fields| {
            if has_trailing_separator {
                fields = &fields[..fields.len() - 1];
            }
            if std::mem::take(&mut is_first) {
                if numbers.take_names(line, fields)? {
                    return Ok(());
                }
                numbers.names = comments.iter().rev().find_map(|comment| {
                    let names: Vec<&str> = match separator {
                        Some(separator) => comment.split(separator).map(str::trim).collect(),
                        None => comment.split_whitespace().collect(),
                    };
                    let names = Names::of(&names, "the comment").ok();
                    names.filter(|names| names.all.len() == fields.len())
                });
            }
            if numbers.columns == 0 {
                numbers.line = line;
                count = numbers.names.as_ref().map_or(fields.len(), |n| n.all.len());
                numbers.columns = if numbers.names.is_some() { 3 } else { count };
            }
            if fields.len() != count {
                let above = if numbers.names.is_some() {
                    "names"
                } else {
                    "numbers"
                };
                return Err(ReadProblem::Malformed {
                    place: format!("line {line}"),
                    found: format!("{} values", fields.len()),
                    expected: format!("{count}, as in the first line of {above}"),
                });
            }
            match numbers.names.as_ref().map(|n| n.xyz) {
                Some(xyz) => xyz
                    .into_iter()
                    .try_for_each(|k| numbers.take(line, k, fields[k], separator))?,
                None => (0..)
                    .zip(fields)
                    .try_for_each(|(k, field)| numbers.take(line, k, field, separator))?,
            }
            // Three numbers are one point.
            let points = numbers.values.len() / if numbers.columns == 3 { 3 } else { 1 };
            if points > MOST_POINTS {
                return Err(too_many(format!("{points} points up to line {line}")));
            }
            Ok(())
        })?;
        match (numbers.comma, numbers.point) {
            (Some(comma), Some(point)) => Err(ReadProblem::malformed(
                &format!("line {comma}"),
                format!("a decimal comma, and a decimal point in line {point}"),
                "one kind of decimal mark in the whole text",
            )),
            _ => Ok(numbers),
        }
    }

    /// Reads the names of the columns if the first line has names instead of numbers. Returns true if the first line
    /// has names.
    fn take_names(&mut self, line: u64, fields: &[&str]) -> Result<bool, ReadProblem> {
        let names = fields.iter().filter(|field| is_name(field)).count();
        let empty = fields.iter().filter(|field| field.is_empty()).count();
        if names == 0 || names + empty < fields.len() {
            if fields.len() > 2 && names == 1 && is_name(fields[0]) {
                return Err(ReadProblem::malformed(
                    &format!("line {line}"),
                    format!("\"{}\" before numbers, the labels of columns", fields[0]),
                    NO_LABELS,
                ));
            }
            return Ok(false);
        }
        self.names = Some(Names::of(fields, &format!("line {line}"))?);
        Ok(true)
    }

    /// Appends the number in a field.
    fn take(
        &mut self,
        line: u64,
        column: usize,
        field: &str,
        separator: Option<char>,
    ) -> Result<(), ReadProblem> {
        let parsed = field.parse::<f64>().ok();
        let value = match (parsed, hole(field, parsed)) {
            (_, Some(kind)) => {
                self.holes[kind] += 1;
                f64::NAN
            }
            (Some(value), None) => {
                if self.point.is_none() && field.contains('.') {
                    self.point = Some(line);
                }
                value
            }
            (None, None) => {
                let decimal = || field.replacen(',', ".", 1).parse().ok();
                let allowed =
                    separator != Some(',') && !field.contains('.') && !field.ends_with(',');
                let value: Option<f64> = allowed.then(decimal).flatten();
                self.comma = self.comma.or(Some(line));
                value.ok_or_else(|| ReadProblem::Malformed {
                    place: format!("line {line}, value {}", column + 1),
                    found: format!("\"{field}\""),
                    expected: if field.matches(['.', ',']).count() > 1 {
                        "a number with one decimal point or one decimal comma, and no mark of thousands"
                    } else {
                        "a number with a decimal point; for a hole nothing, nan, NA, Bad, *** or ---"
                    }
                    .into(),
                })?
            }
        };
        self.values.push(value);
        Ok(())
    }

    /// Returns the decisions on the numbers.
    fn remarks(&self) -> impl Iterator<Item = String> {
        let names = self.names.as_ref().and_then(Names::remark);
        let commas = self
            .comma
            .map(|_| "commas are read as decimal points".to_owned());
        let counts = self
            .holes
            .iter()
            .zip(HOLES)
            .filter(|(count, _)| **count > 0);
        let holes: Vec<String> = counts.map(|(n, kind)| format!("{n} \"{kind}\"")).collect();
        let holes =
            (!holes.is_empty()).then(|| format!("values read as holes: {}", holes.join(", ")));
        [names, commas, holes].into_iter().flatten()
    }
}

/// Returns the separator of values: `;`, tab or `,` if the first line contains one of the three. Returns `None` if
/// blanks separate the values.
fn separator(text: &str) -> Option<char> {
    let lines = text.lines().map(str::trim);
    let mut lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let first = lines.clone().next().unwrap_or_default();
    let candidate = [';', '\t', ','].into_iter().find(|&s| first.contains(s))?;
    // If blanks separate the numbers, commas within the numbers are decimal commas, as in "1,5 2,5".
    let numbers =
        lines.find(|line| line.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c)));
    let words = numbers.unwrap_or_default().split_whitespace();
    let decimal = words.clone().nth(1).is_some()
        && words
            .clone()
            .all(|word| !word.starts_with(',') && !word.ends_with(','));
    (candidate != ',' || !decimal).then_some(candidate)
}

/// Calls `each` with every line's number in the file and its fields.
fn each_line(
    text: &str,
    separator: Option<char>,
    mut each: impl FnMut(u64, &[&str]) -> Result<(), ReadProblem>,
) -> Result<(), ReadProblem> {
    /// The only value for a hole that has two words.
    const NO_DATA: &str = "No Data";
    let mut fields: Vec<&str> = Vec::new();
    let Some(separator) = separator else {
        for (line, number) in text.lines().zip(1..) {
            if line.trim().is_empty() || line.trim_start().starts_with('#') {
                continue;
            }
            fields.clear();
            for word in line.split_whitespace() {
                match fields.last_mut() {
                    Some(last) if word == "Data" && *last == "No" => *last = NO_DATA,
                    _ => fields.push(word),
                }
            }
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
        // A record includes the comments above it.
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

/// Returns true for a name, and false for a misspelt number.
fn is_name(field: &str) -> bool {
    let parsed = field.parse::<f64>().ok();
    let begins_a_number = |c: char| c.is_ascii_digit() || "+-.,".contains(c);
    parsed.is_none() && hole(field, None).is_none() && !field.starts_with(begins_a_number)
}

/// Returns the index in [`HOLES`] if the field is a hole. `parsed` is the number in the field.
fn hole(field: &str, parsed: Option<f64>) -> Option<usize> {
    let run_of = |c: u8| field.bytes().all(|byte| byte == c);
    match parsed {
        Some(value) if value.is_nan() => Some(1),
        Some(value) => (FILLER..f64::INFINITY).contains(&value.abs()).then_some(9),
        None if field.len() > 2 && run_of(b'*') => Some(7),
        None if field.len() > 1 && run_of(b'-') => Some(8),
        None => HOLES[..7]
            .iter()
            .position(|word| word.eq_ignore_ascii_case(field)),
    }
}
