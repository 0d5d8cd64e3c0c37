//! `fretwear inspect MAP`: describes the file of a measured surface.

use std::path::Path;

use fretwear::grid::{Grid, Patch};
use fretwear::report::quantity::{self, Units, with_best_unit};
use fretwear::surface::correlation::autocorrelation;
use fretwear::surface::prepare::{Form, PLAUSIBLE_HEIGHTS, PLAUSIBLE_SIDES};
use fretwear::surface::readers::{self, ReadError, ReadOptions, Reading};
use fretwear::surface::statistics::{Roughness, roughness};
use serde_json::{Value, json};

use super::{CliError, Exit};
use crate::terminal::Results;

/// Largest number of points along a side for the autocorrelation. A larger map is cropped to its middle.
const MOST_CORRELATED: usize = 2048;

/// Figures of a map.
struct MapFigures {
    reading: Reading,
    /// True if the unit of the heights is known; they are then in m.
    is_unit_known: bool,
    form: Option<Form>,
    /// Roughness of the measured points, without their plane.
    roughness: Option<Roughness>,
    /// Correlation lengths along x and y \[m\], or in points if the file has no spacing.
    correlation_length: [Option<f64>; 2],
}

/// Reads a map and prints a description of the map.
pub fn inspect_map(
    path: &Path,
    options: &ReadOptions,
    as_json: bool,
    out: &mut Results,
) -> Result<Exit, CliError> {
    let figures = MapFigures::of(path, options)?;
    if as_json {
        out.json(&figures.json(path));
    } else {
        figures.write(out);
    }
    Ok(Exit::Done)
}

impl MapFigures {
    fn of(path: &Path, options: &ReadOptions) -> Result<MapFigures, ReadError> {
        let bytes = readers::bytes(path)?;
        let (reading, is_unit_known) = match readers::parse(path, &bytes, options) {
            Err(error) if error.is_unit_missing() => {
                let as_numbers = ReadOptions {
                    height_unit: Some(1.0),
                    ..*options
                };
                (readers::parse(path, &bytes, &as_numbers)?, false)
            }
            read => (read?, true),
        };
        let map = &reading.topography;
        let form = Form::fit(map);
        let level: Vec<f64> = match &form {
            Some(form) => form.without_plane(map),
            None => map.heights.clone(),
        };
        let [dx, dy] = map.spacing.unwrap_or([1.0; 2]);
        let shape = [map.nx, map.ny].map(|count| count.min(MOST_CORRELATED));
        let corner = [(map.nx - shape[0]) / 2, (map.ny - shape[1]) / 2];
        let middle: Vec<f64> = (0..shape[0] * shape[1])
            .map(|k| level[(corner[0] + k / shape[1]) * map.ny + corner[1] + k % shape[1]])
            .collect();
        let [nx, ny] = shape;
        let correlated = Patch {
            is_in_joint: middle.iter().map(|h| !h.is_nan()).collect(),
            grid: Grid { nx, ny, dx, dy },
        };
        let whole = Patch {
            is_in_joint: level.iter().map(|h| !h.is_nan()).collect(),
            grid: Grid {
                nx: map.nx,
                ny: map.ny,
                dx,
                dy,
            },
        };
        let correlation = autocorrelation(&correlated, &middle).ok();
        Ok(MapFigures {
            roughness: roughness(&whole, &level).ok(),
            correlation_length: correlation
                .map_or([None; 2], |correlation| correlation.correlation_length()),
            form,
            is_unit_known,
            reading,
        })
    }

    fn json(&self, path: &Path) -> Value {
        let map = &self.reading.topography;
        let has_spacing = map.spacing.is_some();
        let length = |value: f64| (self.is_unit_known).then_some(value);
        let shape = self.roughness;
        json!({
            "file": path.display().to_string(),
            "format": self.reading.format,
            "points": [map.nx, map.ny],
            "spacing": map.spacing,
            "size": map.size(),
            "stated_unit": self.reading.stated_unit,
            "is_unit_known": self.is_unit_known,
            "holes": map.holes(),
            "rq": shape.and_then(|roughness| length(roughness.rq)),
            "sk": shape.map(|roughness| roughness.sk),
            "ku": shape.map(|roughness| roughness.ku),
            "correlation_length": has_spacing.then_some(self.correlation_length),
            "correlation_length_in_points": self.in_points(),
            "rise": self.form.as_ref().and_then(|form| self.is_unit_known.then_some(form.rise)),
            "bow": self.form.as_ref().and_then(|form| self.is_unit_known.then_some(form.bow)),
            "notes": self.reading.remarks,
            "warnings": self.warnings(),
        })
    }

    /// Warns of sizes and heights beyond the range of instruments.
    fn warnings(&self) -> Vec<String> {
        let map = &self.reading.topography;
        let mut warnings = Vec::new();
        let sides = map.size().into_iter().flatten();
        if let Some(side) = sides
            .into_iter()
            .find(|side| beyond(*side, PLAUSIBLE_SIDES))
        {
            warnings.push(format!(
                "a side of {side:e} m is outside of 1 um to 1 m; surface.correct.spacing overrides the file"
            ));
        }
        let rq = self.roughness.map_or(0.0, |roughness| roughness.rq);
        if self.is_unit_known && rq > 0.0 && beyond(rq, PLAUSIBLE_HEIGHTS) {
            warnings.push(format!(
                "an Rq of {rq:e} m is outside of 1 nm to 1 mm; surface.correct.unit overrides the file"
            ));
        }
        warnings
    }

    fn in_points(&self) -> [Option<f64>; 2] {
        let spacing = self.reading.topography.spacing.unwrap_or([1.0; 2]);
        [0, 1].map(|axis| Some(self.correlation_length[axis]? / spacing[axis]))
    }

    fn write(&self, out: &mut Results) {
        let map = &self.reading.topography;
        let mut line = |what: &str, text: String| writeln!(out, "{what:<20}{text}");
        line("format", self.reading.format.to_owned());
        line("points", format!("{} along x, {} along y", map.nx, map.ny));
        match map.spacing.zip(map.size()) {
            Some((spacing, size)) => {
                line("spacing", along_axes(spacing, quantity::LENGTH));
                line("size", along_axes(size, quantity::LENGTH));
            }
            None => line(
                "spacing",
                "not in the file: give surface.spacing, or the map is assumed to cover the joint"
                    .to_owned(),
            ),
        }
        let unit = match (self.reading.stated_unit, self.is_unit_known) {
            (Some(unit), _) => format!("{}, from the file", unit_name(unit)),
            (None, true) => "as given".to_owned(),
            (None, false) => {
                "not in the file: give surface.unit; heights below are the numbers of the file"
                    .to_owned()
            }
        };
        line("unit of heights", unit);
        let share = 100.0 * map.holes() as f64 / map.heights.len() as f64;
        line("holes", format!("{} points, {share:.2} %", map.holes()));
        let height = |value: f64| match self.is_unit_known {
            true => with_best_unit(value, quantity::LENGTH),
            false => format!("{value:.4}"),
        };
        if let Some(form) = &self.form {
            let [along_x, along_y] = form.rise.map(height);
            line(
                "plane",
                format!("rises by {along_x} along x, {along_y} along y"),
            );
            let [along_x, along_y] = form.bow.map(height);
            line(
                "curvature",
                format!("the ends are {along_x} along x, {along_y} along y above the middle"),
            );
        }
        if let Some(shape) = self.roughness {
            line("Rq, less the plane", height(shape.rq));
            line("Sk, Ku", format!("{:.3}, {:.3}", shape.sk, shape.ku));
        }
        let [along_x, along_y] = [0, 1].map(|axis| {
            let points = self.in_points()[axis];
            match (points, map.spacing, self.correlation_length[axis]) {
                (Some(points), Some(_), Some(length)) => {
                    format!(
                        "{} ({points:.1} points)",
                        with_best_unit(length, quantity::LENGTH)
                    )
                }
                (Some(points), ..) => format!("{points:.1} points"),
                _ => "not within the map".to_owned(),
            }
        });
        line(
            "correlation length",
            format!("{along_x} along x, {along_y} along y"),
        );
        for remark in &self.reading.remarks {
            writeln!(out, "note: {remark}");
        }
        for warning in self.warnings() {
            writeln!(out, "warning: {warning}");
        }
    }
}

fn beyond(value: f64, [least, most]: [f64; 2]) -> bool {
    !(least..=most).contains(&value)
}

/// Returns the symbol of a unit of length \[m\].
fn unit_name(unit: f64) -> String {
    const SYMBOLS: [(&str, f64); 5] = [
        ("m", 1.0),
        ("mm", 1e-3),
        ("µm", 1e-6),
        ("nm", 1e-9),
        ("pm", 1e-12),
    ];
    let entry = SYMBOLS
        .iter()
        .find(|(_, size)| (unit / size - 1.0).abs() < 1e-9);
    entry.map_or_else(|| format!("{unit:e} m"), |(symbol, _)| (*symbol).to_owned())
}

fn along_axes(values: [f64; 2], units: Units) -> String {
    let [x, y] = values.map(|value| with_best_unit(value, units));
    format!("{x} along x, {y} along y")
}
