//! Reading of the files that a scene names: surface, motion history and matrices of a structure. A run is identified by
//! the contents of its files, never by their paths or times.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json};

use super::PlanError;
use super::element_table::{self, ElementTableError};
use super::rough::{Contents, motion_of};
use super::structure_files::{self, StructureFileError};
use crate::files;
use crate::recipe::{Identity, Inputs, Mirror};
use crate::scene::record::FOLLOWING_KEYS;
use crate::scene::{Contact, Motion as SceneMotion, RoughJoint, Scene, Transverse};
use crate::surface::prepare::{self, Notice, PrepareError, PrepareOptions, PreparedSurface};
use crate::surface::readers::{self, Correction, ReadError, ReadOptions, Reading};
use crate::tables::{self, TableError, TableName, TypedTable, typed};
use crate::wear::{Channel, Motion, mean_of};

/// Relative tolerance at which two values count as the same sample.
const SAME: f64 = 1e-9;

/// Most bytes of a motion history: a million samples as text.
const LONGEST_HISTORY: u64 = 64 << 20;

/// Error of a valid scene that cannot be run. The cause is the scene or an input file of the scene.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The scene cannot be run.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The surface file cannot be read.
    #[error("surface.path: {0}")]
    Read(#[from] ReadError),
    /// The file of the second face cannot be read.
    #[error("surface.second.path: {0}")]
    ReadSecond(ReadError),
    /// The measured surface does not fit the joint.
    #[error("{key} {}: {source}", path.display())]
    Prepare {
        /// `surface.path` or `surface.second.path`.
        key: &'static str,
        /// The file.
        path: PathBuf,
        /// The error.
        source: PrepareError,
    },
    /// The files of the structure cannot be used.
    #[error(transparent)]
    Structure(#[from] StructureFileError),
    /// The table of contact elements cannot be used.
    #[error(transparent)]
    Elements(#[from] ElementTableError),
    /// The motion history is not valid.
    #[error("motion.history {}: {problem}", path.display())]
    History {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: Box<HistoryProblem>,
    },
}

/// Error in a motion history.
#[derive(Debug, thiserror::Error)]
pub enum HistoryProblem {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The file is not a table of numbers.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// The file is not a `cycle` table.
    #[error("{0}")]
    Table(#[from] TableError),
    /// A column is missing.
    #[error(
        "there is no column `{column}`; a history has time (fraction of the period), displacement_x [m] and optionally displacement_y [m] and normal_load [N]"
    )]
    MissingColumn {
        /// The column.
        column: &'static str,
    },
    /// A value is not a number.
    #[error("row {row}, column `{column}`: \"{value}\" is not a finite number")]
    NotANumber {
        /// The row, from 1.
        row: usize,
        /// The column.
        column: String,
        /// The text.
        value: String,
    },
    /// Too few samples.
    #[error("{rows} rows; a cycle needs at least 3 samples")]
    TooShort {
        /// Number of rows, without the repeated first one.
        rows: usize,
    },
    /// Time does not increase from 0 to 1.
    #[error("row {row}: time is {time}; time must increase from 0 to at most 1 (the period)")]
    Time {
        /// The row, from 1.
        row: usize,
        /// The time.
        time: f64,
    },
    /// The last sample, at time 1, differs from the first.
    #[error("the cycle does not close: {column} is {first:e} at time 0 and {last:e} at time 1")]
    NotClosed {
        /// The column.
        column: &'static str,
        /// Value of the column at time 0.
        first: f64,
        /// Value of the column at time 1.
        last: f64,
    },
    /// The displacement and the normal load are the same in all rows of the history.
    #[error(
        "nothing moves: displacement and normal_load are the same in all {rows} rows; remove [motion] for a static contact"
    )]
    NoMotion {
        /// Number of rows.
        rows: usize,
    },
    /// The history moves along y, but the scene has no y direction.
    #[error("displacement_y is not zero, but `contact.transverse` is \"absent\"; use \"fixed\"")]
    TransverseAbsent,
    /// The history moves along y, but the scene prescribes zero force along y.
    #[error(
        "displacement_y is not zero, but `contact.transverse` is \"free\", which computes it from zero force along y; use \"fixed\""
    )]
    TransverseFree,
}

/// Contents of the files of a scene.
pub(super) struct Files {
    /// The scene, updated from the files of its structure and load.
    pub scene: Scene,
    /// Hashes of the files.
    pub contents: Contents,
    /// The inputs of a run from the files. The recipe is not complete yet.
    pub inputs: Inputs,
}

/// Returns the hash of data that is written in parts.
pub(super) fn hash_of(write: impl FnOnce(&mut dyn FnMut(&[u8]))) -> String {
    let mut hasher = blake3::Hasher::new();
    write(&mut |part| {
        hasher.update(part);
    });
    hasher.finalize().to_hex().to_string()
}

impl Files {
    /// Reads the files of a scene, each once.
    pub fn read(scene: &Scene) -> Result<Files, InputError> {
        let mut canonical = scene.canonical();
        let mut scene = scene.clone();
        let elements = element_table::read(&mut scene)?;
        if let Some(content) = elements {
            canonical["contact"]["content"] = json!(content);
        }
        let imported = structure_files::read(&mut scene)?.map(Arc::new);
        if let Some(structure) = scene
            .recipe
            .structure
            .as_ref()
            .filter(|_| scene.contact.is_some())
        {
            element_table::check(&scene, &structure.layout())?;
        }
        if let Some(import) = scene.structure().and_then(|s| s.import()) {
            canonical["structure"]["content"] = json!(import.content);
            if let Some(response) = &scene.recipe.response {
                canonical["dynamics"]["damping_ratio"] = json!(response.damping_ratio);
            }
        }
        let mut contents = Contents::default();
        let mut measured = None;
        let hash = |bytes: &[u8]| blake3::hash(bytes).to_hex().to_string();
        if let Some(file) = scene.surface.as_mut().and_then(|s| s.file_mut()) {
            let bytes = readers::bytes(&file.path)?;
            let content = hash(&bytes);
            canonical["surface"]["content"] = json!(content);
            contents.surface = Some(content);
            let second_bytes = match &mut file.second {
                Some(second) => {
                    let bytes = readers::bytes(&second.path).map_err(InputError::ReadSecond)?;
                    let content = hash(&bytes);
                    canonical["surface"]["second"]["content"] = json!(content);
                    second.content = Some(content);
                    Some(bytes)
                }
                None => None,
            };
            if let Some(rough) = scene.rough() {
                measured = on_joint(&rough, bytes, second_bytes)?.map(Arc::new);
            }
        }
        let motion = match (&scene.contact, &scene.motion) {
            (Some(contact), Some(SceneMotion::History { path })) => {
                let wrong = |problem: HistoryProblem| InputError::History {
                    path: path.clone(),
                    problem: Box::new(problem),
                };
                let bytes = files::read(path, LONGEST_HISTORY).map_err(|e| wrong(e.into()))?;
                let content = hash(&bytes);
                canonical["motion"]["content"] = json!(content);
                let halved = scene.fidelity.cycle_extrapolation;
                contents.history = Some((content, halved));
                // A history has the same number of steps as any other stepped cycle. The number of steps includes the
                // midpoints that extrapolation needs.
                let steps = scene.fidelity.steps_per_cycle;
                let motion = history(contact, path, &bytes).map_err(wrong)?;
                match halved {
                    true => motion.refined(steps.div_ceil(2)).with_midpoints(),
                    false => motion.refined(steps),
                }
            }
            (Some(contact), _) => motion_of(&scene, contact),
            (None, _) => Motion::at_rest(0.0),
        };
        if let Some(conditions) = scene.contact.as_mut().and_then(|c| c.conditions.as_mut()) {
            // The loads in a history file override contact.normal_load.
            conditions.normal_load = motion.mean_load;
        }
        let inputs = Inputs {
            recipe: scene.recipe.clone(),
            motion,
            measured,
            grid_twin: None,
            imported,
            identity: Identity {
                scene: canonical,
                following: FOLLOWING_KEYS,
                scene_toml: scene.to_toml(),
                scene_written: None,
                plan: Value::Null,
            },
        };
        Ok(Files {
            scene,
            contents,
            inputs,
        })
    }
}

/// Reads the measured heights from the bytes of the surface file, and interpolates the heights to the cells of the
/// joint. If the surface has a second face, the function also reads the second face. Returns `None` for a generated
/// surface. The function drops the map of the heights, because the map can be much larger than the grid.
fn on_joint(
    rough: &RoughJoint,
    bytes: Vec<u8>,
    second_bytes: Option<Vec<u8>>,
) -> Result<Option<PreparedSurface>, InputError> {
    let Some(file) = rough.surface.file() else {
        return Ok(None);
    };
    let patch = rough.patch();
    let prepare = |key, path: &Path, read: Reading, shift| {
        let options = PrepareOptions {
            detrend: file.detrend,
            fill: file.fill,
            shift,
        };
        let prepared = prepare::onto_joint(&read.topography, &patch, options)
            .and_then(|prepared| prepared.fit.check().map(|()| prepared));
        let mut prepared = prepared.map_err(|source| InputError::Prepare {
            key,
            path: path.to_owned(),
            source,
        })?;
        let remarks = read.remarks.into_iter().map(Notice::Remark);
        prepared.notices.splice(0..0, remarks);
        Ok::<_, InputError>(prepared)
    };
    let options = ReadOptions {
        height_unit: file.unit,
        lateral_unit: None,
        spacing: file.spacing,
        transpose: file.transpose,
        correct: file.correct,
    };
    let read = readers::parse(&file.path, &bytes, &options)?;
    drop(bytes);
    let first = prepare("surface.path", &file.path, read, [0.0; 2])?;
    let Some((second, bytes)) = file.second.as_ref().zip(second_bytes) else {
        return Ok(Some(first));
    };
    let options = ReadOptions {
        height_unit: second.unit,
        lateral_unit: None,
        spacing: second.spacing,
        transpose: second.transpose,
        correct: Correction::default(),
    };
    let read = readers::parse(&second.path, &bytes, &options);
    let mut read = read.map_err(InputError::ReadSecond)?;
    drop(bytes);
    match second.mirror {
        Mirror::None => {}
        Mirror::X => read.topography = read.topography.mirrored_along_x(),
        Mirror::Y => read.topography = read.topography.mirrored_along_y(),
    }
    let second = prepare("surface.second.path", &second.path, read, second.shift)?;
    Ok(Some(first.composite(second)))
}

/// Columns of a history: time, displacement_x, and the optional displacement_y and normal_load.
struct Columns {
    time: Vec<f64>,
    displacement_x: Vec<f64>,
    displacement_y: Option<Vec<f64>>,
    normal_load: Option<Vec<f64>>,
}

/// Reads a motion from a `cycle` table (Parquet), or from a CSV file with the same column names, in SI units.
fn history(contact: &Contact, path: &Path, bytes: &[u8]) -> Result<Motion, HistoryProblem> {
    let parquet = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
    let mut columns = if parquet {
        from_parquet(bytes)?
    } else {
        from_csv(bytes)?
    };
    if columns.time.last().is_some_and(|t| (t - 1.0).abs() <= SAME) {
        columns.remove_repeated_sample()?;
    }
    let rows = columns.time.len();
    if rows < 3 {
        return Err(HistoryProblem::TooShort { rows });
    }
    for row in 0..rows {
        let time = columns.time[row];
        let early = if row == 0 {
            time != 0.0
        } else {
            time <= columns.time[row - 1]
        };
        if early || time >= 1.0 {
            return Err(HistoryProblem::Time { row: row + 1, time });
        }
    }
    let moves_along_y = columns
        .displacement_y
        .as_ref()
        .is_some_and(|y| y.iter().any(|v| *v != 0.0));
    let mut drive = vec![Channel::Displacement(columns.displacement_x)];
    match contact.transverse {
        Transverse::Absent if moves_along_y => return Err(HistoryProblem::TransverseAbsent),
        Transverse::Free if moves_along_y => return Err(HistoryProblem::TransverseFree),
        Transverse::Absent => {}
        Transverse::Free => drive.push(Channel::Force(vec![0.0; rows])),
        Transverse::Fixed => drive.push(Channel::Displacement(
            columns.displacement_y.unwrap_or_else(|| vec![0.0; rows]),
        )),
    }
    let load = contact.normal_load();
    let mean_load = columns.normal_load.as_deref().map_or(load, mean_of);
    let normal_load = columns.normal_load.unwrap_or_else(|| vec![load; rows]);
    let changes = |values: &[f64]| values.iter().any(|value| *value != values[0]);
    let mut channels = drive.iter().map(|channel| &channel.values()[..]);
    if !channels.any(changes) && !changes(&normal_load) {
        return Err(HistoryProblem::NoMotion { rows });
    }
    Ok(Motion {
        time: columns.time,
        by_order: true,
        drive,
        rotation: None,
        normal_load,
        mean_load,
        nodal_motion: None,
    })
}

impl Columns {
    /// Removes the last sample, which must repeat the first.
    fn remove_repeated_sample(&mut self) -> Result<(), HistoryProblem> {
        let named = [
            ("displacement_x", Some(&mut self.displacement_x)),
            ("displacement_y", self.displacement_y.as_mut()),
            ("normal_load", self.normal_load.as_mut()),
        ];
        for (column, values) in named.into_iter().filter_map(|(name, v)| Some((name, v?))) {
            let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let (first, last) = (values[0], values.pop().unwrap_or(f64::NAN));
            if (last - first).abs() > SAME * largest {
                return Err(HistoryProblem::NotClosed {
                    column,
                    first,
                    last,
                });
            }
        }
        self.time.pop();
        Ok(())
    }
}

fn from_parquet(bytes: &[u8]) -> Result<Columns, HistoryProblem> {
    let table = tables::from_parquet(bytes, TableName::Cycle.schema())?;
    let cycle = typed::Cycle::of(&table)?;
    Ok(Columns {
        time: cycle.time,
        displacement_x: cycle.displacement_x,
        displacement_y: cycle.displacement_y,
        normal_load: Some(cycle.normal_load),
    })
}

fn from_csv(bytes: &[u8]) -> Result<Columns, HistoryProblem> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let names: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for (row, record) in reader.records().enumerate() {
        for (column, text) in record?.iter().enumerate() {
            let number = text.parse().ok().filter(|v: &f64| v.is_finite());
            values[column].push(number.ok_or_else(|| HistoryProblem::NotANumber {
                row: row + 1,
                column: names[column].clone(),
                value: text.to_owned(),
            })?);
        }
    }
    let mut take = |name: &str| {
        names
            .iter()
            .position(|n| n == name)
            .map(|k| std::mem::take(&mut values[k]))
    };
    Ok(Columns {
        time: take("time").ok_or(HistoryProblem::MissingColumn { column: "time" })?,
        displacement_x: take("displacement_x").ok_or(HistoryProblem::MissingColumn {
            column: "displacement_x",
        })?,
        displacement_y: take("displacement_y"),
        normal_load: take("normal_load"),
    })
}
