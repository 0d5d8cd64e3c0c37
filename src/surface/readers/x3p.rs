//! Reader of X3P files (ISO 25178-72, formerly ISO 5436-2). An X3P file is a zip archive with `main.xml` and a binary
//! file of points. The points are in metres, line by line, with x running fastest. The two files can be in a folder of
//! the archive. The reader verifies the checksums of the zip archive. The reader does not verify the additional MD5
//! sums of the standard.

use std::collections::HashMap;
use std::io::{Cursor, Read};

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE};
use quick_xml::Reader;
use quick_xml::events::Event;
use zip::ZipArchive;
use zip::read::ZipFile;

use super::encoding::decode;
use super::error::ReadProblem;
use super::{Content, ReadOptions, from_lines, points, stated_unit};
use crate::surface::topography::Topography;

/// First bytes of a zip archive.
pub(super) const MAGIC: &[u8] = b"PK\x03\x04";

/// Largest size of a description in bytes; a real one has a few kilobytes.
const LONGEST_DESCRIPTION: u64 = 16 << 20;

/// Largest depth of elements; the standard's elements are less than ten deep.
const DEEPEST_ELEMENT: usize = 64;

/// Paths of the XML elements that the reader uses, below the root element. The reader skips the text of all other
/// elements.
const ELEMENTS: [&str; 14] = [
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
    DATA_LIST,
];

/// Points as text, in place of a link to a member.
const DATA_LIST: &str = "Record3/DataList";

type Archive<'a> = ZipArchive<Cursor<&'a [u8]>>;

/// Rejects zip archives of other programs.
pub(super) fn check(bytes: &[u8]) -> Result<(), ReadProblem> {
    main_member(&open(bytes)?).map(|_| ())
}

fn open(bytes: &[u8]) -> Result<Archive<'_>, ReadProblem> {
    ZipArchive::new(Cursor::new(bytes))
        .map_err(|e| ReadProblem::malformed("the zip archive", e, "an X3P archive"))
}

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let mut archive = open(bytes)?;
    let main = main_member(&archive)?;
    let folder = main[..main.len() - MAIN.len()].to_owned();
    let description = Description::of(&mut archive, &main)?;
    let unit = stated_unit(options, 1.0)?;
    let mut remarks = Vec::new();

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
    // Integers count increments; floating-point heights are already in metres.
    let scale = match (kind, increment) {
        ("F" | "D", increment) => {
            if let Some(other) = increment.filter(|step| *step != 1.0) {
                remarks.push(format!(
                    "CZ/Increment, {other:e}, does not scale the points, which are metres of type {kind}"
                ));
            }
            1.0
        }
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
    if description.optional(DATA_LIST).is_some() {
        return Err(ReadProblem::Unsupported {
            found: "an X3P file whose points are text in main.xml (DataList)".into(),
            advice: "save it with a binary member of points (PointDataLink)".into(),
        });
    }
    let part = description.text("Record3/DataLink/PointDataLink")?;
    let reason = format!("{nx} x {ny} points of type {kind}");
    let data = member(
        &mut archive,
        &folder,
        part,
        (points * width) as u64,
        &reason,
    )?;
    let valid = match description.optional("Record3/DataLink/ValidPointsLink") {
        Some(part) => {
            let reason = format!("one bit for each of {nx} x {ny} points");
            Some(member(
                &mut archive,
                &folder,
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
        (raw * scale + offset) * unit
    };
    let topography = Topography {
        nx,
        ny,
        spacing: Some(spacing),
        heights: from_lines(nx, ny, point),
    };
    Ok((topography, Some(1.0), remarks))
}

/// File name of the description.
const MAIN: &str = "main.xml";

/// Returns the names of the members with `/` between folders. Some Windows programs write a backslash.
fn names(archive: &Archive) -> impl Iterator<Item = String> {
    let names = archive.file_names();
    names.map(|name| name.map_or_else(|_| String::new(), |name| slashed(&name)))
}

fn slashed(name: &str) -> String {
    name.replace('\\', "/")
}

/// Returns the path of the description: at the top, or in the only folder with one.
fn main_member(archive: &Archive) -> Result<String, ReadProblem> {
    let mut paths: Vec<String> = names(archive)
        .filter(|name| name.rsplit('/').next() == Some(MAIN))
        .collect();
    if paths.iter().any(|name| name == MAIN) {
        return Ok(MAIN.into());
    }
    match (paths.pop(), paths.len()) {
        (Some(name), 0) => Ok(name),
        (Some(name), more) => Err(ReadProblem::malformed(
            "the zip archive",
            format!("{} members main.xml, {name} the last", more + 1),
            "one, as X3P has it: pack the folder of one map",
        )),
        (None, _) => Err(another_archive(&names(archive).collect::<Vec<_>>())),
    }
}

/// Other files that are zip archives: a part of a member's name, the kind of file, and advice.
const OTHERS: [(&str, &str, &str); 5] = [
    (
        ".npy",
        "a NumPy archive (.npz)",
        "save one array with numpy.save",
    ),
    ("xl/", "an Excel workbook (.xlsx)", "save its sheet as CSV"),
    (
        "word/",
        "a Word document (.docx)",
        "save its numbers as plain text",
    ),
    (
        "content.xml",
        "an OpenDocument file (.ods)",
        "save its sheet as CSV",
    ),
    (
        "index.xml",
        "a Sensofar file (.plux)",
        "export the topography as X3P or SUR",
    ),
];

fn another_archive(names: &[String]) -> ReadProblem {
    let is_in = |part: &str| names.iter().any(|name| name.contains(part));
    match OTHERS.into_iter().find(|(part, ..)| is_in(part)) {
        Some((_, found, advice)) => ReadProblem::Unsupported {
            found: found.into(),
            advice: advice.into(),
        },
        None => ReadProblem::malformed(
            "the zip archive",
            format!("members {}, …", names[..names.len().min(2)].join(", ")),
            "a member main.xml, as X3P has it: unpack the archive and name the file in it",
        ),
    }
}

/// Returns the encoding that a description declares.
fn declared(bytes: &[u8]) -> Result<Option<&'static Encoding>, ReadProblem> {
    // Without a byte order mark, the first character `<` shows UTF-16.
    match bytes {
        [b'<', 0, ..] => return Ok(Some(UTF_16LE)),
        [0, b'<', ..] => return Ok(Some(UTF_16BE)),
        _ => {}
    }
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(256)]);
    let declaration = start.split("?>").next().unwrap_or_default();
    let Some((_, label)) = declaration.split_once("encoding") else {
        return Ok(Some(encoding_rs::UTF_8));
    };
    let label = label.split(['"', '\'']).nth(1).unwrap_or_default();
    match Encoding::for_label(label.as_bytes()) {
        // The declaration was readable as bytes, so that it is not UTF-16, whatever it says.
        Some(wide) if wide == UTF_16LE || wide == UTF_16BE => Ok(Some(encoding_rs::UTF_8)),
        Some(encoding) => Ok(Some(encoding)),
        None => Err(ReadProblem::malformed(
            "main.xml",
            format!("the encoding \"{label}\""),
            "one that is known, such as UTF-8, UTF-16, ISO-8859-1 or windows-1252",
        )),
    }
}

/// Texts of [`ELEMENTS`] in `main.xml`. Namespace prefixes are ignored.
struct Description(HashMap<&'static str, String>);

impl Description {
    fn of(archive: &mut Archive, main: &str) -> Result<Self, ReadProblem> {
        let mut bytes = Vec::new();
        find(archive, main)?
            .take(LONGEST_DESCRIPTION)
            .read_to_end(&mut bytes)
            .map_err(|e| ReadProblem::malformed("main.xml", e, "intact data"))?;
        let (text, _) = decode(&bytes, declared(&bytes)?)?;
        let mut texts: HashMap<&'static str, String> = HashMap::new();
        // Path of the current element, and its length at each element above.
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
                        let expected = format!("at most {DEEPEST_ELEMENT} nested elements");
                        return Err(ReadProblem::malformed(
                            &place,
                            "one more element",
                            &expected,
                        ));
                    }
                    // Paths do not contain the root.
                    if !above.is_empty() {
                        if !path.is_empty() {
                            path.push('/');
                        }
                        path.push_str(tag.local_name().into_inner());
                    }
                    above.push(path.len());
                    if path == DATA_LIST {
                        texts.insert(DATA_LIST, String::new());
                    }
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

    /// Returns the spacing along an axis, which must have equal steps.
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

/// Finds the member of the zip archive that has the path `name`.
fn find<'a, 'b>(
    archive: &'a mut Archive<'b>,
    name: &str,
) -> Result<ZipFile<'a, Cursor<&'b [u8]>>, ReadProblem> {
    let index = names(archive).position(|other| other == name);
    archive.by_index(index.unwrap_or(usize::MAX)).map_err(|e| {
        let expected = format!("the member {name} that main.xml names");
        ReadProblem::malformed("the zip archive", e, &expected)
    })
}

/// Reads a binary member of exactly `expected` bytes. Links are relative to the folder of the description.
fn member(
    archive: &mut Archive,
    folder: &str,
    link: &str,
    expected: u64,
    reason: &str,
) -> Result<Vec<u8>, ReadProblem> {
    let link = slashed(link);
    let name = format!(
        "{folder}{}",
        link.trim_start_matches("./").trim_start_matches('/')
    );
    let file = find(archive, &name)?;
    let wrong = |found| ReadProblem::Size {
        part: name.clone(),
        found,
        expected,
        reason: reason.to_owned(),
    };
    // The size in the directory is checked before anything is unpacked.
    if file.size() != expected {
        return Err(wrong(file.size()));
    }
    let mut data = Vec::new();
    // Reading one byte beyond the end makes the library compare the checksum.
    file.take(expected + 1)
        .read_to_end(&mut data)
        .map_err(|e| ReadProblem::malformed(&name, e, "intact data"))?;
    if data.len() as u64 != expected {
        return Err(wrong(data.len() as u64));
    }
    Ok(data)
}
