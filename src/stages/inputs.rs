//! The files that a scene names: a surface, a motion history. They enter keys by their content, never by path or time.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use super::error::{HistoryProblem, RunError};
use crate::files;
use crate::scene::{
    Contact, Motion as SceneMotion, Plan, Scene, Surface, Transverse,
    plan::{Texture, motion_of},
};
use crate::surface::prepare::Prepared;
use crate::surface::readers;
use crate::tables::{self, TableName, TypedTable, typed};
use crate::wear::{Channel, Motion};

/// Two values this close, relative to the largest, are the same sample.
const SAME: f64 = 1e-9;

/// Bytes of the longest motion history: a million samples in text.
const LONGEST_HISTORY: u64 = 64 << 20;

/// A scene with what its files say, and the plan for it.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// The scene.
    pub scene: Scene,
    /// Its motion over a cycle; of no axis without `[motion]`.
    pub motion: Motion,
    /// Whether every other of its samples is one in the middle between those of a history.
    pub halved: bool,
    /// The heights of a surface from a file on the joint's cells; none of another surface. The file is read once: these are the
    /// heights of the very bytes that `canonical` names.
    pub measured: Option<Arc<Prepared>>,
    /// What is decided.
    pub plan: Plan,
    /// [`Scene::canonical`] with the hashes of the files.
    pub canonical: Value,
}

impl Inputs {
    /// Reads the files of a scene, each once, and plans it.
    ///
    /// # Errors
    /// [`RunError`] for a file that cannot be used, and for a scene that cannot be run.
    pub fn of(scene: Scene) -> Result<Inputs, RunError> {
        let mut canonical = scene.canonical();
        let mut measured = None;
        if let Some(Surface::File { path, .. }) = &scene.surface {
            let bytes = readers::bytes(path)?;
            canonical["surface"]["content"] = json!(blake3::hash(&bytes).to_hex().as_str());
            if let Some(rough) = scene.rough() {
                measured = super::surface::measured(&rough, bytes)?.map(Arc::new);
            }
        }
        let contact = scene.contact.as_ref();
        let mut halved = false;
        let motion = match (contact, &scene.motion) {
            (Some(contact), Some(SceneMotion::History { path })) => {
                let wrong = |problem: HistoryProblem| RunError::History {
                    path: path.clone(),
                    problem: Box::new(problem),
                };
                let bytes = files::read(path, LONGEST_HISTORY).map_err(|e| wrong(e.into()))?;
                canonical["motion"]["content"] = json!(blake3::hash(&bytes).to_hex().as_str());
                halved = scene.fidelity.cycle_extrapolation;
                let motion = history(contact, path, &bytes).map_err(wrong)?;
                if halved { motion.halved() } else { motion }
            }
            (Some(contact), _) => motion_of(&scene, contact),
            (None, _) => Motion::none(0.0),
        };
        let texture = measured
            .as_deref()
            .map(|on_joint| Texture::of(&on_joint.patch, &on_joint.heights));
        let plan = Plan::decide(&scene, Some(&motion), texture)?;
        Ok(Inputs {
            scene,
            motion,
            halved,
            measured,
            plan,
            canonical,
        })
    }

    /// Sections and keys (`section.key`) of the canonical scene, by name: what a stage reads goes into its key.
    pub fn sections(&self, names: &[&str]) -> Value {
        let value = |name: &str| {
            name.split('.')
                .fold(&self.canonical, |value, part| &value[part])
                .clone()
        };
        names
            .iter()
            .map(|name| ((*name).to_owned(), value(name)))
            .collect::<serde_json::Map<_, _>>()
            .into()
    }
}

/// The columns of a history: time, displacement_x, and the optional displacement_y and normal_load.
struct Columns {
    time: Vec<f64>,
    displacement_x: Vec<f64>,
    displacement_y: Option<Vec<f64>>,
    normal_load: Option<Vec<f64>>,
}

/// A motion from a `cycle` table (Parquet), or from a CSV file with columns of the same names, in SI units.
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
        columns.close()?;
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
    let normal_load = columns
        .normal_load
        .unwrap_or_else(|| vec![contact.normal_load; rows]);
    Ok(Motion {
        time: columns.time,
        drive,
        rotation: None,
        normal_load,
    })
}

impl Columns {
    /// Takes the last sample away, which repeats the first.
    fn close(&mut self) -> Result<(), HistoryProblem> {
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
