//! `fretwear campaign plan`.

use std::collections::BTreeMap;
use std::thread;

use fretwear::campaign::{
    Campaign, CampaignFolder, Definition, KeyColumn, PlannedRun, ResolvedValue, Setting,
    StoredCampaign,
};
use fretwear::json::flatten;
use fretwear::recipe::ResourceEstimate;
use fretwear::rehearsal;
use fretwear::report::shell_word;
use fretwear::scene::{self, Plan};
use serde_json::{Value, json};

use super::{CliError, Exit, PlanArguments, content_key, folder, plan_of};
use crate::progress::duration;
use crate::terminal::{Results, say};

/// Largest number of groups that are rehearsed. A rehearsal takes at most about five seconds.
const MOST_REHEARSED: usize = 12;

/// Numerical keys that affect the cost of a run. Two rows are in different groups if the rows have different values of
/// a key in `SEPARATING`. Two rows with different words or lists as values of a key are in different groups.
const SEPARATING: [&str; 13] = [
    "joint.",
    "fidelity.",
    "output.",
    "update.",
    "wear.cycles",
    "wear.volume",
    "wear.until.",
    "wear.depth_step",
    "wear.tolerance",
    "dynamics.modes",
    "dynamics.points",
    "dynamics.harmonics",
    "structure.",
];

/// A resolved row, before the rehearsals.
struct Resolution {
    row: PlannedRun,
    like: String,
    warnings: Vec<String>,
}

pub fn plan(arguments: &PlanArguments, out: &mut Results) -> Result<Exit, CliError> {
    let definition = Definition::read(&arguments.campaign, &scene::is_path)?;
    let folder = folder(&arguments.dir);
    folder.check()?;
    let fixed: Vec<String> = definition.fixed.iter().map(Setting::text).collect();
    let name = |path: &std::path::Path| {
        path.file_stem()
            .map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
    };
    let title = definition.title.clone();
    let about = StoredCampaign::new(
        title.unwrap_or_else(|| name(&arguments.campaign)),
        name(&definition.scene),
        scene::text_of(&definition.scene, &fixed)?,
        definition.keep,
        definition.sections(),
    );
    let keys: Vec<String> = definition.keys().cloned().collect();
    let settings = definition.rows();
    let mut resolved = resolutions(&folder, &about, &definition, &fixed, &settings)?;
    let groups = grouped(&mut resolved);
    let mut costs: Vec<Cost> = Vec::new();
    for (group, first) in groups.iter().enumerate() {
        let plan = plan_of(&folder, &about, &resolved[*first].row.settings)?;
        let is_rehearsed = !arguments.no_rehearsal && group < MOST_REHEARSED;
        costs.push(Cost::of(&plan, is_rehearsed));
    }
    warn_once_per_kind(resolved.iter().map(|resolution| &resolution.warnings[..]));
    let mut rows: Vec<PlannedRun> = resolved
        .into_iter()
        .map(|resolution| resolution.row)
        .collect();
    for row in &mut rows {
        let cost = &costs[row.group as usize];
        (row.seconds, row.memory) = (cost.seconds, cost.memory as i64);
    }
    let duplicate_rows = duplicate_rows(&rows);
    let campaign = Campaign {
        keys: keys.into_iter().map(|name| KeyColumn { name }).collect(),
        rows,
    };
    let rows_before = folder.plan(&about, &definition.text, &campaign)?;
    let seconds: Option<f64> = campaign.rows.iter().map(|row| row.seconds).sum();
    let rows_of_group = |group: usize| {
        let rows = campaign.rows.iter().filter(|row| row.group == group as i64);
        rows.count()
    };
    if arguments.json {
        let groups = costs.iter().enumerate().map(|(group, cost)| {
            json!({
                "group": group,
                "rows": rows_of_group(group),
                "first": groups[group],
                "expected_seconds": cost.seconds,
                "memory": cost.memory,
                "disk_bytes": cost.disk,
            })
        });
        out.json(&json!({
            "dir": arguments.dir.display().to_string(),
            "rows": campaign.rows.len(),
            "rows_before": rows_before,
            "keys": campaign.keys.iter().map(|key| &key.name).collect::<Vec<_>>(),
            "groups": groups.collect::<Vec<Value>>(),
            "expected_seconds": seconds,
            "same_content": duplicate_rows.map(|(count, _)| count).unwrap_or(0),
        }));
        return Ok(Exit::Done);
    }
    if let Some((count, [first, second])) = duplicate_rows {
        say(&format!(
            "warning: {count} rows repeat the content of an earlier row (row {second} repeats row {first}); all of them will be run"
        ));
    }
    let new = match rows_before {
        0 => String::new(),
        rows_before => format!(", {} of them new", campaign.rows.len() - rows_before),
    };
    writeln!(
        out,
        "{}: {} rows{new}",
        arguments.dir.display(),
        campaign.rows.len()
    );
    for (k, key) in campaign.keys.iter().enumerate() {
        writeln!(
            out,
            "  {:<28} {}",
            key.name,
            range(campaign.rows.iter().map(|row| &row.values[k]))
        );
    }
    for (group, cost) in costs.iter().enumerate().take(MOST_REHEARSED) {
        let count = rows_of_group(group);
        writeln!(
            out,
            "  {:<28} {count} rows like row {}: {}",
            format!("group {group}"),
            groups[group],
            cost.words()
        );
    }
    if costs.len() > MOST_REHEARSED {
        writeln!(
            out,
            "  {} more groups of similar rows, which are not rehearsed",
            costs.len() - MOST_REHEARSED
        );
    }
    if let Some(seconds) = seconds {
        writeln!(
            out,
            "  {:<28} about {} on one core of this machine",
            "all rows",
            duration(seconds)
        );
    }
    writeln!(
        out,
        "run them:  fretwear campaign run --dir {} --jobs J",
        shell_word(&arguments.dir)
    );
    Ok(Exit::Done)
}

/// Cost of a row of a group.
struct Cost {
    seconds: Option<f64>,
    memory: u64,
    disk: Option<f64>,
}

impl Cost {
    fn of(plan: &Plan, is_rehearsed: bool) -> Cost {
        let mut cost = Cost {
            seconds: None,
            memory: ResourceEstimate::least_memory(&plan.inputs),
            disk: None,
        };
        if is_rehearsed {
            let estimate = rehearsal::rehearse(&plan.inputs, rehearsal::TIME_LIMIT);
            cost.seconds = estimate.seconds.map(|seconds| seconds.expected);
            cost.disk = estimate.cost.disk.map(|disk| disk.expected);
        }
        cost
    }

    fn words(&self) -> String {
        let seconds = match self.seconds {
            Some(seconds) => format!("about {seconds:.1} s, "),
            None => "time unknown, ".to_owned(),
        };
        let disk = self.disk.map_or(String::new(), |disk| {
            format!(", {:.2} MB of disk", disk / 1e6)
        });
        format!(
            "{seconds}{:.0} MB of memory{disk}",
            self.memory as f64 / 1e6
        )
    }
}

/// Resolves all rows, with several threads.
fn resolutions(
    folder: &CampaignFolder,
    about: &StoredCampaign,
    definition: &Definition,
    fixed: &[String],
    settings: &[Vec<Setting>],
) -> Result<Vec<Resolution>, CliError> {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let part = settings.len().div_ceil(threads).max(1);
    let of_row = |row: &Vec<Setting>| {
        let texts: Vec<String> = row.iter().map(Setting::text).collect();
        resolution(folder, about, row, texts)
    };
    let results: Vec<Result<Resolution, CliError>> = thread::scope(|scope| {
        let parts = settings.chunks(part);
        let parts =
            parts.map(|part| scope.spawn(move || part.iter().map(of_row).collect::<Vec<_>>()));
        let parts: Vec<_> = parts.collect();
        let joined = parts
            .into_iter()
            .map(|part| part.join().expect("planning does not panic"));
        joined.flatten().collect()
    });
    let error_count = results.iter().filter(|result| result.is_err()).count();
    let mut rows = Vec::with_capacity(results.len());
    for (index, result) in results.into_iter().enumerate() {
        match result {
            Ok(result) => rows.push(result),
            Err(error) => {
                let texts: Vec<String> = settings[index].iter().map(Setting::text).collect();
                // Load the original file, whose error names the line.
                let sets: Vec<String> = fixed.iter().chain(&texts).cloned().collect();
                let located_error = scene::load(&definition.scene, &sets)
                    .err()
                    .map(CliError::from);
                return Err(CliError::Row {
                    index,
                    settings: texts.join(", "),
                    others: error_count - 1,
                    source: Box::new(located_error.unwrap_or(error)),
                });
            }
        }
    }
    Ok(rows)
}

fn resolution(
    folder: &CampaignFolder,
    about: &StoredCampaign,
    row: &[Setting],
    settings: Vec<String>,
) -> Result<Resolution, CliError> {
    let plan = plan_of(folder, about, &settings)?;
    let scene = flatten(&plan.inputs.identity.scene);
    let value = |setting: &Setting| {
        let lower_key = setting.key.replace("material.", "material.lower.");
        let resolved = scene.get(&setting.key).or_else(|| scene.get(&lower_key));
        match resolved.map(ResolvedValue::of) {
            Some(resolved) if resolved != ResolvedValue::Absent => resolved,
            // Paths of files, and keys that have another name in the resolved scene.
            _ => setting.as_written(),
        }
    };
    let like = row
        .iter()
        .filter(|setting| separates(setting))
        .map(Setting::text);
    let like = like.collect::<Vec<_>>().join(", ");
    Ok(Resolution {
        row: PlannedRun {
            values: row.iter().map(value).collect(),
            settings,
            content_key: content_key(&plan),
            group: 0,
            seconds: None,
            memory: 0,
        },
        like,
        warnings: plan.warnings,
    })
}

/// Returns true if the key of `setting` affects the cost of a run.
fn separates(setting: &Setting) -> bool {
    !setting.is_number()
        || SEPARATING
            .iter()
            .any(|prefix| setting.key.starts_with(prefix))
}

/// Numbers the groups of rows with similar cost, in the order of their first rows. Returns these first rows.
fn grouped(resolved: &mut [Resolution]) -> Vec<usize> {
    let mut groups: BTreeMap<String, usize> = BTreeMap::new();
    let mut firsts = Vec::new();
    for (index, resolution) in resolved.iter_mut().enumerate() {
        let group = *groups.entry(resolution.like.clone()).or_insert_with(|| {
            firsts.push(index);
            firsts.len() - 1
        });
        resolution.row.group = group as i64;
    }
    firsts
}

/// Counts the rows with the content of an earlier row, and returns the first pair of rows with equal content.
fn duplicate_rows(rows: &[PlannedRun]) -> Option<(usize, [usize; 2])> {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut count, mut pair) = (0, None);
    for (index, row) in rows.iter().enumerate() {
        match seen.get(row.content_key.as_str()) {
            Some(first) => {
                count += 1;
                pair.get_or_insert([*first, index]);
            }
            None => drop(seen.insert(&row.content_key, index)),
        }
    }
    pair.map(|pair| (count, pair))
}

/// Prints the first warning of each kind, and the number of warnings of the kind in all rows.
fn warn_once_per_kind<'a>(warnings_of_rows: impl Iterator<Item = &'a [String]>) {
    let mut kinds: BTreeMap<&str, (usize, usize, &str)> = BTreeMap::new();
    for (index, warnings) in warnings_of_rows.enumerate() {
        for warning in warnings {
            // The numbers after the colon differ from row to row.
            let kind = warning.split(':').next().unwrap_or_default();
            kinds.entry(kind).or_insert((0, index, warning)).0 += 1;
        }
    }
    for (count, first, warning) in kinds.values() {
        say(&format!("warning: row {first} ({count} in all): {warning}"));
    }
}

/// Describes the values of a key.
fn range<'a>(values: impl Iterator<Item = &'a ResolvedValue> + Clone) -> String {
    let numbers: Option<Vec<f64>> = values.clone().map(ResolvedValue::number).collect();
    let mut different: Vec<String> = values.map(ResolvedValue::text).collect();
    different.sort();
    different.dedup();
    let count = different.len();
    match numbers {
        Some(numbers) => {
            let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
            let most = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{count} values from {least:e} to {most:e}, in SI units")
        }
        None => {
            let shown: Vec<String> = different.into_iter().take(6).collect();
            format!("{count} values: {}", shown.join(", "))
        }
    }
}
