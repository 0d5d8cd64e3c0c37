//! Campaign files: a scene, and the keys that vary.
//!
//! ```toml
//! scene = "prescribed_fretting.toml"      # relative to this file
//! [set]                                   # the same in all rows
//! wear.cycles = 1e6
//! [grid]                                  # all combinations; the last key varies fastest
//! surface.rq = ["1 um", "5 um"]
//! surface.seed = { from = 1, to = 16 }
//! [list]                                  # one value per row
//! [random]                                # random draws
//! n = 200
//! seed = 1
//! contact.friction_coefficient = { distribution = "normal", mean = 0.6, sd = 0.05, low = 0.1 }
//! ```
//!
//! The rows are all combinations of the points of `[grid]`, `[list]` and `[random]`. `[grid]` varies slowest and
//! `[random]` fastest. Every point of `[grid]` and `[list]` uses the same draws of `[random]`. The equal draws exclude
//! that chance causes differences between points of `[grid]` or `[list]`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use toml::{Table, Value};

use super::distribution::Distribution;
use super::error::CampaignError;
use super::folder::{KeepRuns, Section};
use super::table::ResolvedValue;
use crate::files;

/// Largest size of a campaign file \[B\].
const LONGEST: u64 = 16 << 20;
/// Largest number of rows of a campaign: the largest task array of a workload manager.
pub const MOST_ROWS: usize = 1_000_000;
/// Largest number of points of the Sobol sequence, a limit of `sobol_burley`.
const MOST_SOBOL: usize = 1 << 16;
/// Largest number of dimensions of the Sobol sequence, a limit of `sobol_burley`.
const SOBOL_KEYS: usize = sobol_burley::NUM_DIMENSIONS as usize;
/// Half the spacing of the numbers of `sobol_burley`. The program adds half the spacing to each number, so that no
/// number is 0.
const HALF_STEP: f64 = 1.0 / (1_u64 << 25) as f64;

/// Key of a scene, and the value of the key in a row of the campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Key of the scene.
    pub key: String,
    /// Value of the key.
    pub value: Value,
}

impl Setting {
    /// Returns the setting as an argument of `--set`.
    pub fn text(&self) -> String {
        match &self.value {
            // The Debug format writes small numbers like 1e-17 with an exponent. The Display format writes their zeros.
            Value::Float(number) => format!("{}={number:?}", self.key),
            value => format!("{}={value}", self.key),
        }
    }

    /// Returns the value as the campaign file has it.
    pub fn as_written(&self) -> ResolvedValue {
        match &self.value {
            Value::Integer(whole) => ResolvedValue::Whole(*whole),
            Value::Float(number) => ResolvedValue::Number(*number),
            Value::String(text) => ResolvedValue::Text(text.clone()),
            other => ResolvedValue::Text(other.to_string()),
        }
    }

    /// Returns true if the value is a number, with or without a unit.
    pub fn is_number(&self) -> bool {
        match &self.value {
            Value::Integer(_) | Value::Float(_) => true,
            Value::String(text) => {
                let number = text.split(' ').next().unwrap_or_default();
                number.parse::<f64>().is_ok()
            }
            _ => false,
        }
    }
}

/// Sequence of the random draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sequence {
    Sobol,
    Random,
}

#[derive(Debug, Clone)]
struct Random {
    n: usize,
    seed: u32,
    sequence: Sequence,
    keys: Vec<(String, Distribution)>,
}

/// A key and the values that it takes.
type Values = (String, Vec<Value>);

/// A campaign file.
#[derive(Debug, Clone)]
pub struct Definition {
    /// Title, if the file has one.
    pub title: Option<String>,
    /// Path of the scene file.
    pub scene: PathBuf,
    /// Which files of a completed run are kept.
    pub keep: KeepRuns,
    /// Settings that are the same in all rows.
    pub fixed: Vec<Setting>,
    /// Text of the file.
    pub text: String,
    grid: Vec<Values>,
    list: Vec<Values>,
    random: Option<Random>,
}

/// Top-level keys of a campaign file.
const NAMES: [&str; 7] = ["title", "scene", "keep", "set", "grid", "list", "random"];

/// Reader of a campaign file. `path` is the path of the file, for error messages. `is_path` returns true for keys whose
/// value is a path.
struct Reader<'a> {
    path: &'a Path,
    is_path: &'a dyn Fn(&str) -> bool,
}

impl Reader<'_> {
    fn value_error(&self, key: &str, value: &Value, instead: impl Into<String>) -> CampaignError {
        CampaignError::Value {
            path: self.path.to_owned(),
            key: key.to_owned(),
            value: value.to_string(),
            instead: instead.into(),
        }
    }

    fn missing_error(&self, what: impl Into<String>) -> CampaignError {
        CampaignError::Missing {
            path: self.path.to_owned(),
            what: what.into(),
        }
    }

    /// Returns the dotted keys below a section with their values. A table that has the key `leaf` is a value, and so is
    /// an empty table.
    fn leaves(&self, table: &Table, leaf: Option<&str>) -> Vec<(String, Value)> {
        let mut leaves = Vec::new();
        for (name, value) in table {
            match value {
                Value::Table(subtable)
                    if !subtable.is_empty()
                        && leaf.is_none_or(|leaf| !subtable.contains_key(leaf)) =>
                {
                    let subtable = self.leaves(subtable, leaf);
                    leaves.extend(
                        subtable
                            .into_iter()
                            .map(|(key, v)| (format!("{name}.{key}"), v)),
                    );
                }
                value => leaves.push((name.clone(), value.clone())),
            }
        }
        leaves
    }

    /// Makes the value of a key absolute if the value is a path relative to the campaign file.
    fn resolved(&self, key: &str, value: Value) -> Value {
        match value {
            Value::String(text) if (self.is_path)(key) && !text.is_empty() => {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                let path = folder.join(&text);
                let path = std::path::absolute(&path).unwrap_or(path);
                // A path that is not UTF-8 stays relative; reading its file then reports an error.
                Value::String(path.to_str().map_or(text, str::to_owned))
            }
            value => value,
        }
    }

    /// Returns the keys of `[grid]` or `[list]` with their values.
    fn varied(&self, section: &str, table: &Table) -> Result<Vec<Values>, CampaignError> {
        let mut all = Vec::new();
        for (key, value) in self.leaves(table, Some("from")) {
            let name = format!("[{section}] {key}");
            let values = match &value {
                Value::Array(values) if !values.is_empty() => values.clone(),
                Value::Array(_) => {
                    let instead = "give at least one value, or leave the key out";
                    return Err(self.value_error(&name, &value, instead));
                }
                Value::Table(range) if range.contains_key("from") => self.range(&name, range)?,
                value => {
                    let instead = "give a list of values, as in [1, 2], or { from = 1, to = 16 }; put a value that is the same in all rows into [set]";
                    return Err(self.value_error(&name, value, instead));
                }
            };
            let values = values.into_iter().map(|value| self.resolved(&key, value));
            let values = values.collect();
            all.push((key, values));
        }
        if all.is_empty() {
            let what = format!(
                "[{section}] names no key; give a list of values, as in surface.seed = [1, 2]"
            );
            return Err(self.missing_error(what));
        }
        Ok(all)
    }

    fn range(&self, name: &str, range: &Table) -> Result<Vec<Value>, CampaignError> {
        let shown = Value::Table(range.clone());
        let bound = |key: &str| range.get(key).and_then(Value::as_integer);
        let (Some(from), Some(to), 2) = (bound("from"), bound("to"), range.len()) else {
            let instead =
                "write a range as two whole numbers, as in { from = 1, to = 16 }; it includes both";
            return Err(self.value_error(name, &shown, instead));
        };
        let count = to.checked_sub(from);
        match count {
            Some(0..) if count < Some(MOST_ROWS as i64) => (),
            _ => {
                let instead = format!(
                    "`to` must not be below `from`, and a range has at most {MOST_ROWS} values"
                );
                return Err(self.value_error(name, &shown, instead));
            }
        }
        Ok((from..=to).map(Value::Integer).collect())
    }

    fn random(&self, table: &Table) -> Result<Random, CampaignError> {
        let mut table = table.clone();
        let mut whole = |key: &str, most: i64| {
            let name = format!("[random] {key}");
            let Some(value) = table.remove(key) else {
                return Err(self.missing_error(format!(
                    "{name} is missing: a whole number, as in {key} = 64"
                )));
            };
            let number = value.as_integer().filter(|n| (0..=most).contains(n));
            number.ok_or_else(|| {
                self.value_error(
                    &name,
                    &value,
                    format!("must be a whole number from 0 to {most}"),
                )
            })
        };
        let n = whole("n", MOST_ROWS as i64)? as usize;
        let seed = whole("seed", i64::from(u32::MAX))? as u32;
        if n == 0 {
            return Err(self.value_error("[random] n", &Value::Integer(0), "must be 1 or more"));
        }
        let sequence = match table.remove("sequence") {
            None => Sequence::Sobol,
            Some(Value::String(word)) if word == "sobol" => Sequence::Sobol,
            Some(Value::String(word)) if word == "random" => Sequence::Random,
            Some(value) => {
                let instead = "must be \"sobol\" (evenly spread, the default) or \"random\"";
                return Err(self.value_error("[random] sequence", &value, instead));
            }
        };
        let mut keys = Vec::new();
        for (key, value) in self.leaves(&table, Some("distribution")) {
            let name = format!("[random] {key}");
            let Value::Table(distribution_table) = &value else {
                let instead = "give a distribution, as in { distribution = \"uniform\", low = 0.4, high = 0.8 }; put a value that is the same in all rows into [set]";
                return Err(self.value_error(&name, &value, instead));
            };
            let mut distribution_table = distribution_table.clone();
            if let Some(Value::Array(values)) = distribution_table.get_mut("values") {
                for value in values {
                    *value = self.resolved(&key, value.clone());
                }
            }
            let distribution = Distribution::parse(&distribution_table);
            keys.push((
                key,
                distribution.map_err(|instead| self.value_error(&name, &value, instead))?,
            ));
        }
        if keys.is_empty() {
            return Err(self.missing_error("[random] draws no key; give a distribution, as in contact.friction_coefficient = { distribution = \"uniform\", low = 0.4, high = 0.8 }"));
        }
        if sequence == Sequence::Sobol && (n > MOST_SOBOL || keys.len() > SOBOL_KEYS) {
            let instead = format!(
                "the Sobol sequence is limited to {MOST_SOBOL} points and {SOBOL_KEYS} keys; give sequence = \"random\""
            );
            return Err(self.value_error("[random] n", &Value::Integer(n as i64), instead));
        }
        Ok(Random {
            n,
            seed,
            sequence,
            keys,
        })
    }
}

impl Definition {
    /// Reads a campaign file. `is_path` returns true for keys whose values are paths. Paths in a campaign file are
    /// relative to the file.
    ///
    /// # Errors
    /// [`CampaignError`] names the file, the key, its value and the expected value.
    pub fn read(path: &Path, is_path: &dyn Fn(&str) -> bool) -> Result<Definition, CampaignError> {
        let text = files::read_text(path, LONGEST).map_err(|source| CampaignError::Io {
            action: "read",
            path: path.to_owned(),
            source,
        })?;
        let table: Table = text.parse().map_err(|error: toml::de::Error| {
            let reason = error.to_string().trim_end().to_owned();
            let path = path.to_owned();
            CampaignError::Syntax { path, reason }
        })?;
        let reader = Reader { path, is_path };
        if let Some((key, value)) = table.iter().find(|(key, _)| !NAMES.contains(&key.as_str())) {
            let instead = format!(
                "a campaign file has no such key; its keys are {}",
                NAMES.join(", ")
            );
            return Err(reader.value_error(key, value, instead));
        }
        let text_of = |key: &str| match table.get(key) {
            None => Ok(None),
            Some(Value::String(text)) if !text.is_empty() => Ok(Some(text.clone())),
            Some(value) => Err(reader.value_error(key, value, "must be a text that is not empty")),
        };
        let Some(scene) = text_of("scene")? else {
            return Err(reader.missing_error("scene is missing: the path of a scene, relative to this file, as in scene = \"joint.toml\""));
        };
        let keep = match text_of("keep")?.as_deref() {
            None | Some("runs") => KeepRuns::All,
            Some("history") => KeepRuns::History,
            Some(_) => {
                let instead = "must be \"runs\" (whole run folders, the default) or \"history\" (only the history of each run)";
                return Err(reader.value_error("keep", &table["keep"], instead));
            }
        };
        let section = |name: &str| match table.get(name) {
            None => Ok(None),
            Some(Value::Table(section)) => Ok(Some(section)),
            Some(value) => {
                Err(reader.value_error(name, value, format!("must be a section, [{name}]")))
            }
        };
        let varied = |name: &str| match section(name)? {
            None => Ok(Vec::new()),
            Some(table) => reader.varied(name, table),
        };
        let fixed = section("set")?.map_or_else(Vec::new, |set| reader.leaves(set, None));
        let fixed = fixed.into_iter().map(|(key, value)| Setting {
            value: reader.resolved(&key, value),
            key,
        });
        let definition = Definition {
            title: text_of("title")?,
            scene: path.parent().unwrap_or(Path::new("")).join(scene),
            keep,
            fixed: fixed.collect(),
            grid: varied("grid")?,
            list: varied("list")?,
            random: section("random")?
                .map(|table| reader.random(table))
                .transpose()?,
            text: String::new(),
        };
        definition.check(&reader)?;
        Ok(Definition { text, ..definition })
    }

    fn check(&self, reader: &Reader) -> Result<(), CampaignError> {
        if self.grid.is_empty() && self.list.is_empty() && self.random.is_none() {
            return Err(
                reader.missing_error("nothing varies: give a section [grid], [list] or [random]")
            );
        }
        let mut seen = BTreeSet::new();
        let fixed = self.fixed.iter().map(|setting| &setting.key);
        for key in fixed.chain(self.keys()) {
            if !seen.insert(key) {
                return Err(reader.missing_error(format!(
                    "{key} appears in two of [set], [grid], [list], [random]; put each key into one section"
                )));
            }
        }
        if let Some((first, values)) = self.list.first()
            && let Some((key, others)) = self.list.iter().find(|(_, v)| v.len() != values.len())
        {
            return Err(reader.missing_error(format!(
                "[list] {key} has {} values and {first} has {}; [list] takes one value per row, so give both the same number ([grid] combines all values)",
                others.len(),
                values.len()
            )));
        }
        let counts = self.grid.iter().map(|(_, values)| values.len());
        let mut rows = counts.chain([self.listed(), self.drawn()]);
        let rows = rows.try_fold(1_usize, |rows, n| rows.checked_mul(n));
        match rows.filter(|rows| *rows <= MOST_ROWS) {
            Some(_) => Ok(()),
            None => {
                Err(reader.missing_error(format!("more than {MOST_ROWS} rows; give fewer values")))
            }
        }
    }

    fn listed(&self) -> usize {
        self.list.first().map_or(1, |(_, values)| values.len())
    }

    fn drawn(&self) -> usize {
        self.random.as_ref().map_or(1, |random| random.n)
    }

    /// Returns the keys that vary, in the order of the sections.
    pub fn keys(&self) -> impl Iterator<Item = &String> {
        let drawn = self.random.iter().flat_map(|random| &random.keys);
        let listed = self.grid.iter().chain(&self.list).map(|(key, _)| key);
        listed.chain(drawn.map(|(key, _)| key))
    }

    /// Returns the sections of the campaign: one section per key of the grid, then the list, then the random draws. The
    /// rows are all combinations of the points of the sections. The first section varies slowest.
    pub fn sections(&self) -> Vec<Section> {
        let grid = self.grid.iter().map(|(key, values)| Section {
            points: values.len(),
            keys: vec![key.clone()],
            is_random: false,
        });
        let list = (!self.list.is_empty()).then(|| Section {
            points: self.listed(),
            keys: self.list.iter().map(|(key, _)| key.clone()).collect(),
            is_random: false,
        });
        let drawn = self.random.iter().map(|random| Section {
            points: random.n,
            keys: random.keys.iter().map(|(key, _)| key.clone()).collect(),
            is_random: true,
        });
        grid.chain(list).chain(drawn).collect()
    }

    /// Returns the settings of the varying keys for each row, in the order of the rows.
    pub fn rows(&self) -> Vec<Vec<Setting>> {
        let setting = |(key, value): (&String, Value)| Setting {
            key: key.clone(),
            value,
        };
        let draws: Vec<Vec<Setting>> = match &self.random {
            None => vec![Vec::new()],
            Some(random) => {
                let points = random.points();
                let draw = |point: &Vec<f64>| {
                    let keys = random.keys.iter().zip(point);
                    keys.map(|((key, distribution), u)| setting((key, distribution.at(*u))))
                        .collect()
                };
                points.iter().map(draw).collect()
            }
        };
        let grid: usize = self.grid.iter().map(|(_, values)| values.len()).product();
        let mut rows = Vec::with_capacity(grid * self.listed() * draws.len());
        for mut grid_index in 0..grid {
            let mut point: Vec<Setting> = Vec::with_capacity(self.grid.len());
            for (key, values) in self.grid.iter().rev() {
                point.push(setting((key, values[grid_index % values.len()].clone())));
                grid_index /= values.len();
            }
            point.reverse();
            for row in 0..self.listed() {
                let listed = self.list.iter();
                let listed = listed.map(|(key, values)| setting((key, values[row].clone())));
                let before: Vec<Setting> = point.iter().cloned().chain(listed).collect();
                rows.extend(draws.iter().map(|draw| [&before[..], draw].concat()));
            }
        }
        rows
    }
}

impl Random {
    /// Returns one number between 0 and 1 (both excluded) per draw and key. A larger `n` keeps the earlier draws.
    fn points(&self) -> Vec<Vec<f64>> {
        let keys = self.keys.len() as u32;
        if self.sequence == Sequence::Sobol {
            let coordinate = |draw: u32, key| f64::from(sobol_burley::sample(draw, key, self.seed));
            let point = |draw| {
                (0..keys)
                    .map(|key| coordinate(draw, key) + HALF_STEP)
                    .collect()
            };
            return (0..self.n as u32).map(point).collect();
        }
        // Build the key of the random generator from the seed directly. The library's own expansion of a seed may
        // change between versions.
        let mut key = [0; 32];
        key[..4].copy_from_slice(&self.seed.to_le_bytes());
        let mut generator = ChaCha12Rng::from_seed(key);
        let mut next = || ((generator.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64;
        (0..self.n)
            .map(|_| (0..keys).map(|_| next()).collect())
            .collect()
    }
}
