//! Reader of NumPy arrays with two axes. Axis 0 of the array is x. The reader accepts floating-point and integer
//! numbers, both byte orders, and both C and Fortran order.

use std::io::Read;

use npyz::{DType, NpyFile, Order, TypeChar};

use super::error::ReadProblem;
use super::lattice::reject_points;
use super::{Content, ReadOptions, points, required_unit};
use crate::surface::topography::Topography;

/// Largest length of a header in bytes. A header of a numeric array with two axes has some hundred bytes.
const LONGEST_HEADER: usize = 4096;

/// Largest depth of brackets in a header. A header is a dictionary with a tuple in it; a structured array is
/// a little deeper. Each further level doubles the time of the library.
const DEEPEST_HEADER: usize = 8;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let header = check_header(bytes)?;
    let file = NpyFile::new(bytes)
        .map_err(|e| ReadProblem::malformed("the header", e, "an NPY header"))?;
    let &[nx, ny] = file.shape() else {
        return Err(ReadProblem::malformed(
            "the header",
            format!("an array of shape {:?}", file.shape()),
            "two axes, x and y",
        ));
    };
    let dtype = file.dtype();
    let description = dtype.descr();
    let DType::Plain(kind) = &dtype else {
        return Err(not_a_number(&description));
    };
    let (kind, size) = (kind.type_char(), kind.size_field());
    if !matches!(kind, TypeChar::Float | TypeChar::Int | TypeChar::Uint) {
        return Err(not_a_number(&description));
    }
    if nx == 0 || ny == 0 {
        return Err(ReadProblem::malformed(
            "the header",
            format!("{nx} x {ny} points"),
            "at least one point",
        ));
    }
    let needed = nx.saturating_mul(ny).saturating_mul(size);
    let data = (bytes.len() - header) as u64;
    if data < needed {
        return Err(ReadProblem::Size {
            part: "the data".into(),
            found: data,
            expected: needed,
            reason: format!("{nx} x {ny} numbers of {size} bytes"),
        });
    }
    // The numbers fit into usize, because so many values are in memory.
    let (nx, ny) = (nx as usize, ny as usize);
    points(nx, ny)?;
    let unit = required_unit(options, "NPY")?;
    let order = file.order();
    let values = match (kind, size) {
        (TypeChar::Float, 8) => numbers::<f64, _>(file, |v| v)?,
        (TypeChar::Float, 4) => numbers::<f32, _>(file, f64::from)?,
        (TypeChar::Int, 1) => numbers::<i8, _>(file, f64::from)?,
        (TypeChar::Int, 2) => numbers::<i16, _>(file, f64::from)?,
        (TypeChar::Int, 4) => numbers::<i32, _>(file, f64::from)?,
        (TypeChar::Int, 8) => numbers::<i64, _>(file, |v| v as f64)?,
        (TypeChar::Uint, 1) => numbers::<u8, _>(file, f64::from)?,
        (TypeChar::Uint, 2) => numbers::<u16, _>(file, f64::from)?,
        (TypeChar::Uint, 4) => numbers::<u32, _>(file, f64::from)?,
        (TypeChar::Uint, 8) => numbers::<u64, _>(file, |v| v as f64)?,
        _ => return Err(not_a_number(&description)),
    };
    let at = |index: usize| match order {
        Order::C => values[index],
        Order::Fortran => values[(index % ny) * nx + index / ny],
    };
    let heights: Vec<f64> = (0..nx * ny).map(|index| unit * at(index)).collect();
    if ny > 2 {
        reject_points(ny, &heights)?;
    }
    let topography = Topography {
        nx,
        ny,
        spacing: None,
        heights,
    };
    let axis = "axis 0 of the array is x; surface.transpose = true makes it y";
    let remarks = if options.transpose {
        vec![]
    } else {
        vec![axis.into()]
    };
    Ok((topography, None, remarks))
}

/// Returns the number of bytes of magic, version and header text. The data follow.
fn check_header(bytes: &[u8]) -> Result<usize, ReadProblem> {
    let at = |k: usize| usize::from(bytes.get(k).copied().unwrap_or(0));
    let (start, length) = match at(6) {
        1 => (10, at(8) + (at(9) << 8)),
        _ => (12, at(8) + (at(9) << 8) + (at(10) << 16) + (at(11) << 24)),
    };
    let wrong =
        |found: String, expected: &str| Err(ReadProblem::malformed("the header", found, expected));
    if length > LONGEST_HEADER {
        let expected = format!("an NPY header of at most {LONGEST_HEADER} bytes");
        return wrong(format!("{length} bytes"), &expected);
    }
    let text = bytes.get(start..start + length).unwrap_or_default();
    let mut depth: usize = 0;
    for byte in text {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST_HEADER {
            let expected =
                format!("an NPY header with at most {DEEPEST_HEADER} levels of brackets");
            return wrong("more levels of brackets".into(), &expected);
        }
    }
    Ok((start + length).min(bytes.len()))
}

fn numbers<T: npyz::Deserialize, R: Read>(
    file: NpyFile<R>,
    value: impl Fn(T) -> f64,
) -> Result<Vec<f64>, ReadProblem> {
    let values = file.into_vec::<T>().map_err(|e| {
        ReadProblem::malformed("the data", e, "the numbers that the header announces")
    })?;
    Ok(values.into_iter().map(value).collect())
}

fn not_a_number(description: &str) -> ReadProblem {
    ReadProblem::malformed(
        "the header",
        format!("the type {description}"),
        "f4, f8, or an integer type (save with `array.astype('f8')`)",
    )
}
