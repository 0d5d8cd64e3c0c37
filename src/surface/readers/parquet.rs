//! Reader of Parquet tables. The columns are `i, j, height`, as in fretwear's `surface.parquet`, or `x, y, z`. The
//! metadata of a column can state the `unit` of the column. The unit that the user passes applies to columns without a
//! `unit`.

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrowPrimitiveType, RecordBatch};
use arrow_schema::{DataType, Schema};
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::file::metadata::ParquetMetaData;

use super::error::ReadProblem;
use super::lattice::from_points;
use super::{
    Content, MOST_POINTS, ReadOptions, length_unit, points, required_unit, stated_unit, too_many,
};
use crate::surface::topography::Topography;
use crate::tables;

/// Column of `surface.parquet` that is false for a cell outside the joint.
const KEPT: &str = "kept";

/// Smallest number of rows, as a fraction of the cells that the indices span. The reader
/// rejects a table with fewer rows, because its indices are not a grid.
const FILLED: f64 = 0.05;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    tables::catching_panics(|| decode(bytes, options)).map_err(|e| broken(&e))?
}

fn broken(found: &dyn std::fmt::Display) -> ReadProblem {
    ReadProblem::malformed("the table", found, "a readable Parquet file")
}

fn decode(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let builder = ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes))
        .map_err(|e| broken(&e))?;
    let schema = builder.schema().clone();
    let has = |names: [&str; 3]| {
        names
            .iter()
            .all(|name| schema.field_with_name(name).is_ok())
    };
    let indexed = has(["i", "j", "height"]);
    if !indexed && !has(["x", "y", "z"]) {
        let names: Vec<_> = schema.fields().iter().map(|f| f.name().as_str()).collect();
        return Err(ReadProblem::malformed(
            "the columns",
            names.join(", "),
            "i, j, height or x, y, z",
        ));
    }
    let names = if indexed {
        ["i", "j", "height"]
    } else {
        ["x", "y", "z"]
    };
    let stated = unit_of(&schema, names[2])?;
    let height_unit = match stated {
        Some(stated) => stated_unit(options, stated)?,
        None => required_unit(options, "Parquet")?,
    };
    check(builder.metadata())?;
    // Other columns may have any type and size. A cell that a run removed from its joint has no height.
    let has_kept = (schema.field_with_name(KEPT))
        .is_ok_and(|field| indexed && field.data_type() == &DataType::Boolean);
    let read = names.into_iter().chain(has_kept.then_some(KEPT));
    let places = read.filter_map(|name| schema.index_of(name).ok());
    let mask = ProjectionMask::roots(builder.parquet_schema(), places);
    let builder = builder.with_projection(mask);
    let mut rows: Vec<[f64; 3]> = Vec::new();
    for batch in builder.build().map_err(|e| broken(&e))? {
        let batch = batch.map_err(|e| broken(&e))?;
        let [a, b, c] = [
            column(&batch, names[0])?,
            column(&batch, names[1])?,
            column(&batch, names[2])?,
        ];
        let kept = batch.column_by_name(KEPT).filter(|_| has_kept);
        let kept = kept.and_then(|kept| kept.as_boolean_opt());
        let height = |k: usize| match kept {
            Some(kept) if kept.is_valid(k) && !kept.value(k) => f64::NAN,
            _ => c[k] * height_unit,
        };
        rows.extend((0..batch.num_rows()).map(|k| [a[k], b[k], height(k)]));
        // The file has more rows than it announced.
        if rows.len() > MOST_POINTS {
            return Err(too_many(format!("{} rows or more", rows.len())));
        }
    }
    if indexed {
        return from_indices(&rows).map(|topography| (topography, stated, Vec::new()));
    }
    // Positions use the unit of the heights. A correction changes the unit of the heights only.
    let otherwise = stated.or(options.height_unit).unwrap_or(height_unit);
    let lateral = |name| -> Result<f64, ReadProblem> {
        let stated = unit_of(&schema, name)?;
        Ok(stated.or(options.lateral_unit).unwrap_or(otherwise))
    };
    let (ux, uy) = (lateral("x")?, lateral("y")?);
    for row in &mut rows {
        row[0] *= ux;
        row[1] *= uy;
    }
    let topography = from_points(&rows)?;
    Ok((topography, stated, Vec::new()))
}

/// Checks the announced size before anything is unpacked.
fn check(metadata: &ParquetMetaData) -> Result<(), ReadProblem> {
    let rows = tables::declared_rows(metadata);
    if rows > MOST_POINTS as i64 {
        return Err(too_many(format!("{rows} rows")));
    }
    match tables::unread_codec(metadata) {
        Some(codec) => Err(ReadProblem::Unsupported {
            found: format!("a Parquet file compressed as {codec}"),
            advice: format!("read are {}", tables::codecs()),
        }),
        None => Ok(()),
    }
}

/// Builds the grid. Cells that the table omits (the bolt hole) are holes.
fn from_indices(rows: &[[f64; 3]]) -> Result<Topography, ReadProblem> {
    let mut shape = [0usize; 2];
    for (row, point) in rows.iter().enumerate() {
        for (axis, extent) in shape.iter_mut().enumerate() {
            let index = point[axis];
            // An index above the range of u32 cannot be meant.
            if !(index >= 0.0 && index.fract() == 0.0 && index <= f64::from(u32::MAX)) {
                return Err(ReadProblem::NotRegular {
                    row: row + 1,
                    found: format!("{} is {index}", ["i", "j"][axis]),
                });
            }
            *extent = (*extent).max(index as usize + 1);
        }
    }
    let [nx, ny] = shape;
    let first = [0, 1].map(|axis| rows.iter().fold(f64::INFINITY, |m, row| m.min(row[axis])));
    if first == [1.0; 2] {
        return Err(ReadProblem::malformed(
            "the table",
            "i and j that begin at 1",
            "indices from 0",
        ));
    }
    if rows.is_empty() || (rows.len() as f64) < FILLED * nx as f64 * ny as f64 {
        return Err(ReadProblem::malformed(
            "the table",
            format!("{} rows for {nx} x {ny} cells", rows.len()),
            "a row for each cell of a grid",
        ));
    }
    let count = points(nx, ny)?;
    let mut heights = vec![f64::NAN; count];
    let mut seen = vec![false; count];
    for (row, point) in rows.iter().enumerate() {
        let index = point[0] as usize * ny + point[1] as usize;
        if std::mem::replace(&mut seen[index], true) {
            return Err(ReadProblem::NotRegular {
                row: row + 1,
                found: format!("the cell ({}, {}) occurs twice", point[0], point[1]),
            });
        }
        heights[index] = point[2];
    }
    Ok(Topography {
        nx,
        ny,
        spacing: None,
        heights,
    })
}

/// Returns the length of a column's unit \[m\], if it has a unit.
fn unit_of(schema: &Schema, name: &str) -> Result<Option<f64>, ReadProblem> {
    let Some(text) = schema
        .field_with_name(name)
        .ok()
        .and_then(|field| field.metadata().get("unit"))
    else {
        return Ok(None);
    };
    length_unit(text).map(Some).ok_or_else(|| {
        ReadProblem::malformed(
            &format!("the unit of column {name}"),
            text,
            "m, mm, um or nm",
        )
    })
}

/// Returns the numbers of a column; null becomes NaN.
fn column(batch: &RecordBatch, name: &str) -> Result<Vec<f64>, ReadProblem> {
    fn values<T: ArrowPrimitiveType>(
        array: &dyn Array,
        value: impl Fn(T::Native) -> f64,
    ) -> Vec<f64> {
        let array = array.as_primitive::<T>();
        array.iter().map(|v| v.map_or(f64::NAN, &value)).collect()
    }
    let array = batch
        .column_by_name(name)
        .ok_or_else(|| ReadProblem::malformed("the columns", "a batch without this column", name))?
        .as_ref();
    Ok(match array.data_type() {
        DataType::Float64 => values::<Float64Type>(array, |v| v),
        DataType::Float32 => values::<Float32Type>(array, f64::from),
        DataType::Int8 => values::<Int8Type>(array, f64::from),
        DataType::Int16 => values::<Int16Type>(array, f64::from),
        DataType::Int32 => values::<Int32Type>(array, f64::from),
        DataType::Int64 => values::<Int64Type>(array, |v| v as f64),
        DataType::UInt8 => values::<UInt8Type>(array, f64::from),
        DataType::UInt16 => values::<UInt16Type>(array, f64::from),
        DataType::UInt32 => values::<UInt32Type>(array, f64::from),
        DataType::UInt64 => values::<UInt64Type>(array, |v| v as f64),
        other => {
            return Err(ReadProblem::malformed(
                &format!("column {name}"),
                format!("the type {other}"),
                "a number",
            ));
        }
    })
}
