//! X3P (ISO 25178-72, formerly ISO 5436-2): a zip with `main.xml` and a binary file of points, line by line, x fastest, in
//! metres. The zip's own checksums are verified on unpacking, so the MD5 sums that the standard adds are not.

use std::collections::HashMap;
use std::io::{Cursor, Read};

use quick_xml::Reader;
use quick_xml::events::Event;
use zip::ZipArchive;

use super::error::ReadProblem;
use super::{ReadOptions, from_lines, points, stated_unit};
use crate::surface::topography::Topography;

/// A description is a few kilobytes; one of more than this is none.
const LONGEST_DESCRIPTION: u64 = 16 << 20;

/// The elements of the standard are less than ten deep; what nests deeper than this is none of its descriptions.
const DEEPEST_ELEMENT: usize = 64;

/// The elements that are read, by their path below the root. No other text is kept.
const ELEMENTS: [&str; 13] = [
    "Record1/FeatureType",
    "Record1/Axes/CX/AxisType",
    "Record1/Axes/CX/Increment",
    "Record1/Axes/CY/AxisType",
    "Record1/Axes/CY/Increment",
    "Record1/Axes/CZ/DataType",
    "Record1/Axes/CZ/Increment",
    "Record1/Axes/CZ/Offset",
    "Record3/MatrixDimension/SizeX",
    "Record3/MatrixDimension/SizeY",
    "Record3/MatrixDimension/SizeZ",
    "Record3/DataLink/PointDataLink",
    "Record3/DataLink/ValidPointsLink",
];

type Archive<'a> = ZipArchive<Cursor<&'a [u8]>>;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Topography, ReadProblem> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|e| ReadProblem::malformed("the zip archive", e, "an X3P archive"))?;
    let description = Description::of(&mut archive)?;
    stated_unit(options, 1.0)?;

    let feature = description.text("Record1/FeatureType")?;
    if feature != "SUR" {
        return Err(ReadProblem::Unsupported {
            found: format!("an X3P file of feature type {feature}"),
            advice: "only SUR, a surface, is a height map".into(),
        });
    }
    let nx = description.count("Record3/MatrixDimension/SizeX")?;
    let ny = description.count("Record3/MatrixDimension/SizeY")?;
    let layers = description.count("Record3/MatrixDimension/SizeZ")?;
    if layers != 1 {
        return Err(ReadProblem::Unsupported {
            found: format!("an X3P file of {layers} layers"),
            advice: "export the layer to be used alone".into(),
        });
    }
    let spacing = [description.increment("CX")?, description.increment("CY")?];

    let kind = description.text("Record1/Axes/CZ/DataType")?;
    let width = match kind {
        "I" => 2,
        "L" | "F" => 4,
        "D" => 8,
        _ => {
            return Err(ReadProblem::malformed(
                "main.xml, CZ/DataType",
                kind,
                "I, L, F or D",
            ));
        }
    };
    let offset = description.number("Record1/Axes/CZ/Offset")?.unwrap_or(0.0);
    let increment = description.number("Record1/Axes/CZ/Increment")?;
    // Integers count increments; floating-point heights are metres already.
    let scale = match (kind, increment) {
        ("F" | "D", _) => 1.0,
        (_, Some(increment)) => increment,
        (_, None) => {
            return Err(ReadProblem::malformed(
                "main.xml, CZ/Increment",
                "nothing",
                "the height of one step, since the points are integers",
            ));
        }
    };
    let points = points(nx, ny)?;
    let part = description.text("Record3/DataLink/PointDataLink")?;
    let reason = format!("{nx} x {ny} points of type {kind}");
    let data = member(&mut archive, part, (points * width) as u64, &reason)?;
    let valid = match description.optional("Record3/DataLink/ValidPointsLink") {
        Some(part) => {
            let reason = format!("one bit for each of {nx} x {ny} points");
            Some(member(
                &mut archive,
                part,
                points.div_ceil(8) as u64,
                &reason,
            )?)
        }
        None => None,
    };

    let point = |index: usize| {
        // Bit k % 8, lowest first, of byte k / 8 is set for a valid point k.
        if valid
            .as_ref()
            .is_some_and(|v| v[index / 8] >> (index % 8) & 1 == 0)
        {
            return f64::NAN;
        }
        let at = &data[index * width..(index + 1) * width];
        let raw = match (kind, at) {
            ("I", &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
            ("L", &[a, b, c, d]) => f64::from(i32::from_le_bytes([a, b, c, d])),
            ("F", &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            (_, &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => unreachable!("the width follows from the type"),
        };
        raw * scale + offset
    };
    Ok(Topography {
        nx,
        ny,
        spacing: Some(spacing),
        heights: from_lines(nx, ny, point),
    })
}

/// The texts of [`ELEMENTS`] in `main.xml`, which may have namespace prefixes there.
struct Description(HashMap<&'static str, String>);

impl Description {
    fn of(archive: &mut Archive) -> Result<Self, ReadProblem> {
        let mut text = String::new();
        archive
            .by_name("main.xml")
            .map_err(|e| {
                let expected = "a member main.xml, as X3P has it; .npz, .plux and .xlsx are zip archives too and are not read: save an array with numpy.save";
                ReadProblem::malformed("the zip archive", e, expected)
            })?
            .take(LONGEST_DESCRIPTION)
            .read_to_string(&mut text)
            .map_err(|e| ReadProblem::malformed("main.xml", e, "UTF-8 text"))?;
        let mut texts: HashMap<&'static str, String> = HashMap::new();
        // Where the reader is, and how long that was at each element above.
        let mut path = String::new();
        let mut above: Vec<usize> = Vec::new();
        let mut reader = Reader::from_str(&text);
        loop {
            match reader.read_event() {
                Err(e) => {
                    let place = format!("main.xml, byte {}", reader.error_position());
                    return Err(ReadProblem::malformed(&place, e, "well-formed XML"));
                }
                Ok(Event::Eof) => break,
                Ok(Event::Start(tag)) => {
                    if above.len() == DEEPEST_ELEMENT {
                        let place = format!("main.xml, byte {}", reader.buffer_position());
                        let expected = format!("at most {DEEPEST_ELEMENT}, one in another");
                        return Err(ReadProblem::malformed(
                            &place,
                            "one more element",
                            &expected,
                        ));
                    }
                    // The root is in no path.
                    if !above.is_empty() {
                        if !path.is_empty() {
                            path.push('/');
                        }
                        path.push_str(tag.local_name().into_inner());
                    }
                    above.push(path.len());
                }
                Ok(Event::End(_)) => {
                    above.pop();
                    path.truncate(above.last().copied().unwrap_or(0));
                }
                Ok(Event::Text(piece)) => {
                    if let Some(element) = ELEMENTS.iter().find(|element| **element == path) {
                        let piece = piece.xml10_content();
                        if !piece.trim().is_empty() {
                            texts.entry(element).or_default().push_str(piece.trim());
                        }
                    }
                }
                Ok(_) => {}
            }
        }
        Ok(Description(texts))
    }

    fn optional(&self, path: &str) -> Option<&str> {
        self.0.get(path).map(String::as_str)
    }

    fn text(&self, path: &str) -> Result<&str, ReadProblem> {
        self.optional(path).ok_or_else(|| {
            ReadProblem::malformed("main.xml", "nothing", &format!("the element {path}"))
        })
    }

    fn number(&self, path: &str) -> Result<Option<f64>, ReadProblem> {
        let parse = |text: &str| {
            text.parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| {
                    ReadProblem::malformed(
                        &format!("main.xml, {path}"),
                        format!("\"{text}\""),
                        "a number",
                    )
                })
        };
        self.optional(path).map(parse).transpose()
    }

    fn count(&self, path: &str) -> Result<usize, ReadProblem> {
        let text = self.text(path)?;
        text.parse::<usize>()
            .ok()
            .filter(|&n| n > 0)
            .ok_or_else(|| {
                ReadProblem::malformed(
                    &format!("main.xml, {path}"),
                    format!("\"{text}\""),
                    "a count of at least 1",
                )
            })
    }

    /// The spacing along an axis, which must be one of equal steps.
    fn increment(&self, axis: &str) -> Result<f64, ReadProblem> {
        let kind = self.text(&format!("Record1/Axes/{axis}/AxisType"))?;
        if kind != "I" {
            return Err(ReadProblem::Unsupported {
                found: format!("an X3P file whose {axis} axis is of type {kind}"),
                advice: "only equal steps, type I, are read: resample it when exporting".into(),
            });
        }
        let path = format!("Record1/Axes/{axis}/Increment");
        self.number(&path)?.ok_or_else(|| {
            ReadProblem::malformed("main.xml", "nothing", &format!("the element {path}"))
        })
    }
}

/// A binary member of exactly `expected` bytes.
fn member(
    archive: &mut Archive,
    name: &str,
    expected: u64,
    reason: &str,
) -> Result<Vec<u8>, ReadProblem> {
    let file = archive.by_name(name).map_err(|e| {
        ReadProblem::malformed(
            "the zip archive",
            e,
            &format!("the member {name} that main.xml names"),
        )
    })?;
    let wrong = |found| ReadProblem::Size {
        part: name.to_owned(),
        found,
        expected,
        reason: reason.to_owned(),
    };
    // The size of the directory entry, before anything is unpacked.
    if file.size() != expected {
        return Err(wrong(file.size()));
    }
    let mut data = Vec::new();
    // One byte beyond the end: the archive compares its checksum when it meets the end of the member.
    file.take(expected + 1)
        .read_to_end(&mut data)
        .map_err(|e| ReadProblem::malformed(name, e, "intact data"))?;
    if data.len() as u64 != expected {
        return Err(wrong(data.len() as u64));
    }
    Ok(data)
}
