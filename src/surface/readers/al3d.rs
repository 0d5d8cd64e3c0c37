//! Reader of AL3D files of Alicona. An AL3D file has tags of fixed width and a depth image. The depths are in metres,
//! in single precision, line by line, with x fastest.
//!
//! A tag has a name of 20 bytes, a value of 30 bytes and a line end. NUL bytes pad the name and the value. Each line of
//! the image is padded to a multiple of eight points. The reader ignores a colour image after the depth image.

use super::error::ReadProblem;
use super::{Content, ReadOptions, from_lines, points, stated_unit};
use crate::surface::topography::Topography;

pub(super) const MAGIC: &[u8] = b"AliconaImaging\0\r\n";

const NAME: usize = 20;
const VALUE: usize = 30;
const TAG: usize = NAME + VALUE + 2;

/// Each line of a depth image has a multiple of `LINE_MULTIPLE` points.
const LINE_MULTIPLE: usize = 8;

/// Bytes per depth.
const WIDTH: usize = 4;

/// Largest relative difference between the depth of an invalid pixel and the value in the tag for invalid pixels. The
/// tag can have only seven digits.
const SAME_VALUE: f64 = 1e-6;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let tags = Tags::of(bytes)?;
    let version = tags.text("Version")?;
    if version != "1" {
        return Err(ReadProblem::Unsupported {
            found: format!("an AL3D file of version \"{version}\""),
            advice: "only version 1 is known: export it as X3P".into(),
        });
    }
    let unit = stated_unit(options, 1.0)?;
    let nx = tags.count("Cols")?;
    let ny = tags.count("Rows")?;
    let spacing = [
        tags.number("PixelSizeXMeter")?,
        tags.number("PixelSizeYMeter")?,
    ];
    let start = tags.count("DepthImageOffset")?;
    if start < tags.end {
        return Err(ReadProblem::malformed(
            &tag_place("DepthImageOffset"),
            start,
            &format!("at least {}, where the tags end", tags.end),
        ));
    }
    let invalid = match tags.optional("InvalidPixelValue") {
        Some(_) => Some(tags.number("InvalidPixelValue")?),
        None => None,
    };
    // Some programs omit the padding. Without padding, the depth image ends exactly after its points, or the colours
    // start there.
    let texture = tags.offset("TextureImageOffset")?;
    let room = texture.unwrap_or(bytes.len()).saturating_sub(start);
    let line = if room == nx.saturating_mul(ny).saturating_mul(WIDTH) {
        nx
    } else {
        nx.saturating_add(LINE_MULTIPLE - 1) / LINE_MULTIPLE * LINE_MULTIPLE
    };
    let end = line
        .checked_mul(ny)
        .and_then(|n| n.checked_mul(WIDTH))
        .and_then(|n| n.checked_add(start))
        .unwrap_or(usize::MAX);
    let data = bytes.get(start..end).ok_or_else(|| ReadProblem::Size {
        part: "the file".into(),
        found: bytes.len() as u64,
        expected: end as u64,
        reason: format!(
            "a depth image of {ny} lines of {line} points of {WIDTH} bytes from byte {start} on"
        ),
    })?;
    // If the offset of the colour image is within the depth image, the lines are shorter than the reader assumes.
    if let Some(texture) = texture
        && (start..end).contains(&texture)
    {
        return Err(ReadProblem::malformed(
            &tag_place("TextureImageOffset"),
            texture,
            &format!("at least {end}, where the depth image of {nx} x {ny} points ends"),
        ));
    }
    points(nx, ny)?;
    let point = |index: usize| {
        let at = WIDTH * (index / nx * line + index % nx);
        let depth = f64::from(f32::from_le_bytes([
            data[at],
            data[at + 1],
            data[at + 2],
            data[at + 3],
        ]));
        match invalid {
            Some(hole) if (depth - hole).abs() <= SAME_VALUE * hole.abs() => f64::NAN,
            _ => depth * unit,
        }
    };
    let topography = Topography {
        nx,
        ny,
        spacing: Some(spacing),
        heights: from_lines(nx, ny, point),
    };
    Ok((topography, Some(1.0), Vec::new()))
}

/// Tags in front of the images, and the byte where they end.
struct Tags {
    pairs: Vec<(String, String)>,
    end: usize,
}

impl Tags {
    fn of(bytes: &[u8]) -> Result<Self, ReadProblem> {
        let mut tags = Tags {
            pairs: Vec::new(),
            end: MAGIC.len(),
        };
        tags.take(bytes, "Version")?;
        tags.take(bytes, "TagCount")?;
        for _ in 0..tags.whole("TagCount")? {
            tags.take(bytes, "as many tags as TagCount says")?;
        }
        Ok(tags)
    }

    fn take(&mut self, bytes: &[u8], what: &str) -> Result<(), ReadProblem> {
        let at = self.end;
        let tag = bytes.get(at..at + TAG).ok_or_else(|| ReadProblem::Size {
            part: "the file".into(),
            found: bytes.len() as u64,
            expected: (at + TAG) as u64,
            reason: format!("the tag at byte {at} ({what})"),
        })?;
        if &tag[NAME + VALUE..] != b"\r\n" {
            return Err(ReadProblem::malformed(
                &format!("byte {}", at + NAME + VALUE),
                format!("\"{}\"", tag[NAME + VALUE..].escape_ascii()),
                "the line end of a tag of 52 bytes",
            ));
        }
        self.pairs
            .push((until_nul(&tag[..NAME]), until_nul(&tag[NAME..NAME + VALUE])));
        self.end += TAG;
        Ok(())
    }

    fn optional(&self, name: &str) -> Option<&str> {
        self.pairs
            .iter()
            .find(|(key, _)| key == name)
            .map(|(_, value)| value.as_str())
    }

    fn text(&self, name: &str) -> Result<&str, ReadProblem> {
        self.optional(name).ok_or_else(|| {
            ReadProblem::malformed("the tags", "nothing", &format!("the tag {name}"))
        })
    }

    fn number(&self, name: &str) -> Result<f64, ReadProblem> {
        let text = self.text(name)?;
        text.parse()
            .map_err(|_| quoted(name, text, "a number with a decimal point"))
    }

    fn whole(&self, name: &str) -> Result<usize, ReadProblem> {
        let text = self.text(name)?;
        text.parse()
            .map_err(|_| quoted(name, text, "a whole number"))
    }

    fn count(&self, name: &str) -> Result<usize, ReadProblem> {
        match self.whole(name)? {
            0 => Err(quoted(name, "0", "at least 1")),
            n => Ok(n),
        }
    }

    /// Returns the offset of an optional part of the file. If the part is missing, the offset in the file is 0, and the
    /// function returns `None`.
    fn offset(&self, name: &str) -> Result<Option<usize>, ReadProblem> {
        match self.optional(name) {
            Some(_) => self.whole(name).map(|n| (n > 0).then_some(n)),
            None => Ok(None),
        }
    }
}

fn tag_place(name: &str) -> String {
    format!("the tag {name}")
}

fn quoted(name: &str, text: &str, expected: &str) -> ReadProblem {
    ReadProblem::malformed(&tag_place(name), format!("\"{text}\""), expected)
}

fn until_nul(bytes: &[u8]) -> String {
    let text: String = bytes
        .iter()
        .take_while(|&&b| b != 0)
        .map(|&b| char::from(b))
        .collect();
    text.trim().to_owned()
}
