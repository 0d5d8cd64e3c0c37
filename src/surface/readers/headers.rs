//! Headers that programs write above the numbers of a text.

use super::error::ReadProblem;
use super::length_unit;

/// Largest number of lines of a header.
const LONGEST_HEADER: usize = 200;

/// Names of the lines in Gwyddion's header, in the languages of its user interface.
const CHANNEL: &str = "Channel|Kanál|Kanal|Canal|Canale|チャネル|채널|Канал";
const WIDTH: &str = "Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина";
const HEIGHT: &str = "Height|Výška|Höhe|Altura|Hauteur|Altezza|高さ|높이|Высота";
const VALUE_UNITS: &str = "Value units|Jednotky hodnot|Einheiten|Unités|unità valore|値の単位|값 단위|Unidades de valor|Единицы измерения";

/// Header above a matrix of heights that has one line of numbers per y.
pub(super) struct Header {
    /// Name of the program that writes headers of this format.
    pub program: &'static str,
    /// Lengths of the map along x and y \[m\], and their text in the header.
    pub size: Option<([f64; 2], String)>,
    /// Points along x and y.
    pub points: Option<[usize; 2]>,
    /// Length of one unit of height \[m\].
    pub unit: Option<f64>,
    /// Whether a mask of the measured points follows the heights.
    pub voids: bool,
}

/// Returns the comments above the numbers, without their mark.
pub(super) fn comments(text: &str) -> Vec<&str> {
    let lines = text.lines().take(LONGEST_HEADER).map(str::trim);
    lines
        .take_while(|line| line.is_empty() || line.starts_with('#'))
        .filter_map(|line| line.strip_prefix('#'))
        .map(str::trim)
        .collect()
}

/// Returns the value of the first comment `name: value` or `name = value` with one of the names.
fn value<'a>(comments: &[&'a str], names: &str) -> Option<&'a str> {
    comments.iter().find_map(|comment| {
        let (key, value) = comment.split_once([':', '=', '：'])?;
        let is_named = names.split('|').any(|name| name == key.trim());
        is_named.then_some(value.trim())
    })
}

fn wrong(name: &str, found: Option<&str>, expected: &str) -> ReadProblem {
    let name = name.split('|').next().unwrap_or_default();
    let found = found.map_or("nothing".into(), |text| format!("\"{text}\""));
    ReadProblem::malformed(&format!("the header's {name}"), found, expected)
}

fn number<T: std::str::FromStr>(comments: &[&str], name: &str) -> Result<T, ReadProblem> {
    let found = value(comments, name);
    let parsed = found.and_then(|text| text.replace(',', ".").parse().ok());
    parsed.ok_or_else(|| wrong(name, found, "a number"))
}

/// Returns the length of the unit in a comment, if there is one.
fn unit(comments: &[&str], name: &str) -> Result<Option<f64>, ReadProblem> {
    let Some(found) = value(comments, name) else {
        return Ok(None);
    };
    let unit = length_unit(found.trim_matches(['[', ']']));
    let expected = "a unit of length, m, mm, um or nm: export the channel of heights";
    unit.map(Some)
        .ok_or_else(|| wrong(name, Some(found), expected))
}

impl Header {
    pub fn of(comments: &[&str]) -> Result<Option<Header>, ReadProblem> {
        if value(comments, "x-pixels").is_some() && value(comments, "y-pixels").is_some() {
            return Header::of_spip(comments).map(Some);
        }
        let names = [CHANNEL, WIDTH, HEIGHT, VALUE_UNITS];
        let present = names.iter().filter(|name| value(comments, name).is_some());
        if present.count() < 3 {
            return Ok(None);
        }
        let length = |name: &str| {
            let found = value(comments, name);
            let parse = |text: &str| {
                let (number, unit) = text.rsplit_once(char::is_whitespace)?;
                let number: f64 = number.trim().replace(',', ".").parse().ok()?;
                Some(number * length_unit(unit)?)
            };
            let length = found.and_then(parse);
            length.ok_or_else(|| wrong(name, found, "a length with its unit, such as 100 um"))
        };
        let text = |name| value(comments, name).unwrap_or_default();
        Ok(Some(Header {
            program: "Gwyddion",
            size: Some((
                [length(WIDTH)?, length(HEIGHT)?],
                format!("{} x {}", text(WIDTH), text(HEIGHT)),
            )),
            points: None,
            unit: unit(comments, VALUE_UNITS)?,
            voids: false,
        }))
    }

    /// Parses a header of SPIP. Lengths are in nanometres unless `x-unit` differs. Heights are in `z-unit`,
    /// or else in `Bit2nm` nanometres.
    fn of_spip(comments: &[&str]) -> Result<Header, ReadProblem> {
        let along_x = unit(comments, "x-unit")?.unwrap_or(1e-9);
        let along_y = unit(comments, "y-unit")?.unwrap_or(along_x);
        let size = match value(comments, "x-length") {
            Some(text) => {
                let x: f64 = number(comments, "x-length")?;
                let y: f64 = number(comments, "y-length")?;
                let stated = format!(
                    "{text} {} x {y} {}",
                    value(comments, "x-unit").unwrap_or("nm"),
                    value(comments, "y-unit").unwrap_or("nm")
                );
                Some(([x * along_x, y * along_y], stated))
            }
            None => None,
        };
        let mut height = unit(comments, "z-unit")?;
        if let Some(text) = value(comments, "Bit2nm") {
            let step: f64 = number(comments, "Bit2nm")?;
            let is_plausible = match height {
                Some(_) => step == 1.0,
                None => step.is_finite() && step > 0.0,
            };
            if !is_plausible {
                let expected = "a positive number, and 1 beside a z-unit";
                return Err(wrong("Bit2nm", Some(text), expected));
            }
            height = height.or(Some(step * 1e-9));
        }
        let voids = value(comments, "voidpixels");
        Ok(Header {
            program: "SPIP",
            size,
            points: Some([number(comments, "x-pixels")?, number(comments, "y-pixels")?]),
            unit: height,
            voids: voids.is_some_and(|count| count.parse().is_ok_and(|count: u64| count > 0)),
        })
    }
}

/// Returns the units of positions and of heights \[m\] that Gwyddion writes above points.
pub(super) fn units_of_points(comments: &[&str]) -> Result<[Option<f64>; 2], ReadProblem> {
    match value(comments, "Lateral units") {
        Some(_) => Ok([
            unit(comments, "Lateral units")?,
            unit(comments, VALUE_UNITS)?,
        ]),
        None => Ok([None, None]),
    }
}

/// Rejects a text of several maps, each with a header.
pub(super) fn reject_several(text: &str) -> Result<(), ReadProblem> {
    let comments = text.lines().filter_map(|line| line.strip_prefix('#'));
    let maps = comments.filter(|comment| {
        let names = [WIDTH, "x-pixels"];
        names.iter().any(|name| value(&[comment], name).is_some())
    });
    match maps.count() {
        0 | 1 => Ok(()),
        several => Err(ReadProblem::Unsupported {
            found: format!("a text of {several} maps"),
            advice: "export the map of heights alone".into(),
        }),
    }
}

/// Rejects texts of interferometers, whose numbers are not heights in a unit.
pub(super) fn reject_instruments(text: &str) -> Result<(), ReadProblem> {
    const BEGINNINGS: [(&str, &str); 7] = [
        ("Zygo XYZ Data File", "a Zygo XYZ file"),
        ("Zygo ASCII Data File", "a Zygo ASCII file"),
        ("Wyko ASCII Data File", "a Wyko ASCII file"),
        ("X Size", "an ASCII file of Wyko, Veeco or Bruker"),
        ("Pixel_size", "an ASCII file of Wyko, Veeco or Bruker"),
        ("Wavelength", "an ASCII file of Wyko, Veeco or Bruker"),
        ("RAW_DATA", "an ASCII file of Wyko, Veeco or Bruker"),
    ];
    let lines = text.lines().take(LONGEST_HEADER).map(|line| {
        let line = line.trim().trim_start_matches('"');
        BEGINNINGS.iter().find(|(words, _)| line.starts_with(words))
    });
    match lines.flatten().next() {
        Some((words, name)) => Err(ReadProblem::Unsupported {
            found: format!("{name} (\"{words}\" in its header)"),
            advice: "export X3P or SDF, or points x y z without a header and give surface.unit"
                .into(),
        }),
        None => Ok(()),
    }
}
