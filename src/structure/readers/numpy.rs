//! NumPy files. An NPY file has one dense matrix. An NPZ file has a sparse matrix of `scipy.sparse.save_npz` (CSR, CSC
//! or COO), or dense matrices with the names `K`, `M` and `C`.

use std::io::{Cursor, Read};

use npyz::{DType, NpyFile, Order, TypeChar};
use zip::ZipArchive;

use super::error::ReadProblem;
use super::{
    LONGEST_FILE, NamedMatrix, ParsedFile, entries, keep_matrices_with_role, role_of_name, rows,
    rows_of_few, square,
};
use crate::structure::matrices::Triplets;

/// Largest length of a header in bytes. A header of a two-dimensional array has some hundred bytes.
const LONGEST_HEADER: usize = 4096;

/// Largest depth of brackets in a header, which is a dictionary with a tuple. Each level doubles the time of the
/// library.
const DEEPEST_HEADER: usize = 8;

/// Largest number of members in an archive.
const MOST_MEMBERS: usize = 256;

pub(super) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY")
}

pub(super) fn is_npz(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

pub(super) fn parse_npy(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let matrix = dense(&array(bytes, "the array")?, "the array")?;
    let named = NamedMatrix {
        name: String::new(),
        role: None,
        matrix,
        dofs: None,
        has_unknown_size: false,
    };
    Ok(ParsedFile {
        matrices: vec![named],
        ..ParsedFile::default()
    })
}

/// Array of numbers.
struct Array {
    shape: Vec<u64>,
    values: Vec<f64>,
    is_fortran: bool,
    is_single: bool,
}

/// Checks the header before the library reads it. Returns the position of the data.
fn check_header(bytes: &[u8], name: &str) -> Result<usize, ReadProblem> {
    let at = |k: usize| usize::from(bytes.get(k).copied().unwrap_or(0));
    let (start, length) = match at(6) {
        1 => (10, at(8) + (at(9) << 8)),
        _ => (12, at(8) + (at(9) << 8) + (at(10) << 16) + (at(11) << 24)),
    };
    let place = format!("the header of {name}");
    if !is_npy(bytes) {
        return Err(ReadProblem::malformed(
            place,
            "another beginning",
            "that of an NPY array",
        ));
    }
    if length > LONGEST_HEADER {
        return Err(ReadProblem::malformed(
            place,
            format!("{length} bytes"),
            format!("at most {LONGEST_HEADER}"),
        ));
    }
    let mut depth: usize = 0;
    for byte in bytes.get(start..start + length).unwrap_or_default() {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST_HEADER {
            return Err(ReadProblem::malformed(
                place,
                "brackets within brackets",
                format!("at most {DEEPEST_HEADER} deep"),
            ));
        }
    }
    Ok((start + length).min(bytes.len()))
}

fn array(bytes: &[u8], name: &str) -> Result<Array, ReadProblem> {
    let header = check_header(bytes, name)?;
    let place = || format!("the header of {name}");
    let file =
        NpyFile::new(bytes).map_err(|e| ReadProblem::malformed(place(), e, "an NPY header"))?;
    let shape = file.shape().to_vec();
    let description = file.dtype().descr();
    let unsupported_type = || {
        ReadProblem::malformed(
            place(),
            format!("the type {description}"),
            "real numbers (`array.astype('f8')`); sparse matrices each by `scipy.sparse.save_npz`",
        )
    };
    let DType::Plain(kind) = file.dtype() else {
        return Err(unsupported_type());
    };
    let (kind, size) = (kind.type_char(), kind.size_field());
    let count = shape.iter().try_fold(1u64, |all, &n| all.checked_mul(n));
    let needed = count
        .and_then(|count| count.checked_mul(size.max(1)))
        .unwrap_or(u64::MAX);
    let data = (bytes.len() - header) as u64;
    if data < needed {
        return Err(ReadProblem::truncated(
            name,
            format!("{data} bytes of data"),
            format!("{needed} for the shape {shape:?}"),
        ));
    }
    let is_fortran = file.order() == Order::Fortran;
    let values = match (kind, size) {
        (TypeChar::Float, 8) => numbers::<f64>(file, name, |v| v)?,
        (TypeChar::Float, 4) => numbers::<f32>(file, name, f64::from)?,
        (TypeChar::Int, 1) => numbers::<i8>(file, name, f64::from)?,
        (TypeChar::Int, 2) => numbers::<i16>(file, name, f64::from)?,
        (TypeChar::Int, 4) => numbers::<i32>(file, name, f64::from)?,
        (TypeChar::Int, 8) => numbers::<i64>(file, name, |v| v as f64)?,
        (TypeChar::Uint, 1) => numbers::<u8>(file, name, f64::from)?,
        (TypeChar::Uint, 2) => numbers::<u16>(file, name, f64::from)?,
        (TypeChar::Uint, 4) => numbers::<u32>(file, name, f64::from)?,
        (TypeChar::Uint, 8) => numbers::<u64>(file, name, |v| v as f64)?,
        _ => return Err(unsupported_type()),
    };
    Ok(Array {
        shape,
        values,
        is_fortran,
        is_single: kind == TypeChar::Float && size == 4,
    })
}

fn numbers<T: npyz::Deserialize>(
    file: NpyFile<&[u8]>,
    name: &str,
    value: impl Fn(T) -> f64,
) -> Result<Vec<f64>, ReadProblem> {
    let values = file
        .into_vec::<T>()
        .map_err(|e| ReadProblem::malformed(name, e, "the numbers that the header announces"))?;
    Ok(values.into_iter().map(value).collect())
}

impl Array {
    fn precision(&self) -> f64 {
        if self.is_single {
            f64::from(f32::EPSILON) / 2.0
        } else {
            Triplets::new(0).precision
        }
    }

    /// Returns the values of the array as indices. Returns an error if a value is negative or not a whole number.
    fn indices(&self, name: &str) -> Result<Vec<u64>, ReadProblem> {
        let index = |(k, &v): (usize, &f64)| {
            let is_whole = v >= 0.0 && v.fract() == 0.0 && v <= u64::from(u32::MAX) as f64;
            let invalid = || {
                ReadProblem::malformed(
                    format!("{name}, number {}", k + 1),
                    v,
                    "a whole number of 0 or more",
                )
            };
            if is_whole {
                Ok(v as u64)
            } else {
                Err(invalid())
            }
        };
        self.values.iter().enumerate().map(index).collect()
    }
}

fn dense(array: &Array, name: &str) -> Result<Triplets, ReadProblem> {
    let &[m, n] = array.shape.as_slice() else {
        return Err(ReadProblem::malformed(
            name,
            format!("an array of shape {:?}", array.shape),
            "a square matrix",
        ));
    };
    square(m, n, name)?;
    let size = rows(m, array.values.len(), name)?;
    let mut matrix = Triplets::new(size);
    for (k, &value) in array.values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
        let (slow, fast) = ((k / size) as u32, (k % size) as u32);
        matrix.entries.push(if array.is_fortran {
            (fast, slow, value)
        } else {
            (slow, fast, value)
        });
    }
    matrix.precision = array.precision();
    Ok(matrix)
}

pub(super) fn parse_npz(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|e| ReadProblem::malformed("the zip archive", e, "an NPZ archive"))?;
    if archive.len() > MOST_MEMBERS {
        return Err(ReadProblem::TooMany {
            found: format!("{} arrays", archive.len()),
            limit: format!("at most {MOST_MEMBERS} are read"),
        });
    }
    let mut names: Vec<String> = archive
        .file_names()
        .filter_map(Result::ok)
        .map(|name| name.into_owned())
        .collect();
    names.sort();
    let mut member = |name: &str| -> Result<Vec<u8>, ReadProblem> {
        let wrong = |e: &dyn std::fmt::Display| {
            ReadProblem::malformed("the zip archive", e, format!("an intact member {name}"))
        };
        let file = archive.by_name(name).map_err(|e| wrong(&e))?;
        let mut data = Vec::new();
        file.take(LONGEST_FILE)
            .read_to_end(&mut data)
            .map_err(|e| wrong(&e))?;
        Ok(data)
    };
    if names.iter().any(|name| name == "format.npy") {
        let matrix = sparse(&mut member)?;
        let named = NamedMatrix {
            name: String::new(),
            role: None,
            matrix,
            dofs: None,
            has_unknown_size: false,
        };
        return Ok(ParsedFile {
            matrices: vec![named],
            ..ParsedFile::default()
        });
    }
    let mut parsed = ParsedFile::default();
    for name in names.iter().filter(|name| name.ends_with(".npy")) {
        let short = name.trim_end_matches(".npy").escape_debug().to_string();
        let role = role_of_name(&short);
        let matrix = array(&member(name)?, &short).and_then(|array| dense(&array, &short));
        match matrix {
            Ok(matrix) => parsed.matrices.push(NamedMatrix {
                name: short,
                role,
                matrix,
                dofs: None,
                has_unknown_size: false,
            }),
            Err(problem) if role.is_some() => return Err(problem),
            Err(_) => parsed.notes.push(format!(
                "{short} is no square matrix of numbers, and is left out"
            )),
        }
    }
    keep_matrices_with_role(&mut parsed);
    Ok(parsed)
}

/// Reads a sparse matrix of `scipy.sparse.save_npz`.
fn sparse(
    member: &mut impl FnMut(&str) -> Result<Vec<u8>, ReadProblem>,
) -> Result<Triplets, ReadProblem> {
    let text = member("format.npy")?;
    let start = check_header(&text, "format")?;
    // The text is bytes, or characters of four bytes each.
    let word: String = text[start..]
        .iter()
        .filter(|b| **b != 0)
        .take(16)
        .map(|&b| char::from(b))
        .collect();
    let mut read = |name: &str| array(&member(&format!("{name}.npy"))?, name);
    if !matches!(word.as_str(), "csr" | "csc" | "coo") {
        return Err(ReadProblem::Unsupported {
            found: format!("a sparse matrix in the form {}", word.escape_debug()),
            advice: "save it with `scipy.sparse.save_npz(file, matrix.tocsr())`".into(),
        });
    }
    let shape = read("shape")?.indices("shape")?;
    let &[m, n] = shape.as_slice() else {
        return Err(ReadProblem::malformed(
            "shape",
            format!("{} numbers", shape.len()),
            "two",
        ));
    };
    square(m, n, "shape")?;
    let data = read("data")?;
    let count = data.values.len();
    entries(count as u64, count, "data")?;
    let flat = |array: &Array, name: &str, length: usize| {
        let found = array.values.len();
        if found == length {
            return Ok(());
        }
        Err(ReadProblem::malformed(
            name,
            format!("{found} numbers"),
            format!("{length}, as data and shape say"),
        ))
    };
    let mut places: Vec<(u64, u64)> = Vec::with_capacity(count);
    if word == "coo" {
        let (row, column) = (read("row")?, read("col")?);
        flat(&row, "row", count)?;
        flat(&column, "col", count)?;
        places.extend(row.indices("row")?.into_iter().zip(column.indices("col")?));
    } else {
        let (starts, indices) = (read("indptr")?, read("indices")?);
        // The check of `indptr` limits the number of rows to the data in the file.
        if starts.values.len() as u64 != m + 1 {
            return Err(ReadProblem::malformed(
                "indptr",
                format!("{} numbers", starts.values.len()),
                format!("{}, as shape says", m + 1),
            ));
        }
        flat(&indices, "indices", count)?;
        let (starts, indices) = (starts.indices("indptr")?, indices.indices("indices")?);
        let rises = starts.windows(2).all(|w| w[0] <= w[1]);
        if starts[0] != 0 || !rises || starts[starts.len() - 1] != count as u64 {
            return Err(ReadProblem::malformed(
                "indptr",
                "numbers that do not rise from 0",
                format!("0 up to {count}"),
            ));
        }
        for line in 0..starts.len() - 1 {
            for &index in &indices[starts[line] as usize..starts[line + 1] as usize] {
                let place = (line as u64, index);
                places.push(if word == "csr" {
                    place
                } else {
                    (index, line as u64)
                });
            }
        }
    }
    if let Some(k) = places.iter().position(|&(i, j)| i >= m || j >= m) {
        let (i, j) = places[k];
        return Err(ReadProblem::malformed(
            format!("entry {}", k + 1),
            format!("row {i}, column {j} (from 0)"),
            format!("rows and columns below {m}"),
        ));
    }
    let size = rows_of_few(m, "shape")?;
    let mut matrix = Triplets::new(size);
    matrix.entries = places
        .iter()
        .zip(&data.values)
        .map(|(&(i, j), &v)| (i as u32, j as u32, v))
        .collect();
    matrix.precision = data.precision();
    Ok(matrix)
}
