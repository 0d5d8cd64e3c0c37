//! Start of a run: creates a new run, or checks and repairs an existing one.

use super::chain;
use super::commit::Commit;
use super::date;
use super::draft::clean_staging;
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::{FileSystem, LockGuard};
use super::files::{Files, hash, json};
use super::history;
use super::inspection::{PastAndHistory, has_gap};
use super::layout::{ENTRIES_AFTER_RECORD, FILES, FOLDERS, Layout, iteration_name};
use super::reader::RunReader;
use super::record::{Continuation, Machine, Origin, RunIdentity, RunRecord};
use super::record_file::{RecordRead, read_record, written_scene};
use super::sealed::sealed;
use super::survey::check_folder;
use crate::COMMIT;
use crate::json::{KeyChange, as_read, differences, matches, user_changes};
use crate::tables::{TableLocation, TableName};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Findings and actions of a start, to be printed by the caller.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Opening {
    /// True if the run is new.
    pub created: bool,
    /// The iteration from which the run continues.
    pub latest: Option<u64>,
    /// Iterations from which the run cannot continue, ascending. The start moved the damaged iterations to `damaged/`.
    pub set_aside: Vec<DamagedIteration>,
    /// Repaired damage that affects no result. For a damaged `run.json`, the start restored `run.json` from
    /// `run.copy.json`. If a damaged table affects no result, the start moved the table to `damaged/` and removed the
    /// table from the commit.
    pub repaired: Vec<Damage>,
    /// Damage of `history.parquet`, if the rows of pruned iterations are lost by it.
    pub history_lost: Option<Damage>,
    /// Completed stages of an unfinished iteration, by name. The run reuses the tables of a completed stage if the
    /// inputs of the stage are the same.
    pub drafts_kept: Vec<String>,
    /// Leftovers that were removed from `staging/`.
    pub drafts_removed: Vec<PathBuf>,
    /// Free keys whose values changed.
    pub changed_keys: Vec<KeyChange>,
    /// Program versions of the previous and the current start, if the program version changed. Results need not be
    /// bit-identical to results of a single version.
    pub program_changed: Option<(String, String)>,
    /// Numbers of threads of the previous and the current start, if the number of threads changed. Results need not be
    /// bit-identical to results with a constant number.
    pub threads_changed: Option<(usize, usize)>,
    /// Machines of the previous and the current start, if the machine changed.
    pub machine_changed: Option<(Machine, Machine)>,
}

/// An iteration that was moved to `damaged/`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DamagedIteration {
    /// The iteration.
    pub wear_iteration: u64,
    /// The damage.
    pub damage: Vec<Damage>,
    /// The new path.
    pub moved_to: PathBuf,
}

impl Opening {
    /// Returns the findings as sentences, the most important ones first.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        for damaged in &self.set_aside {
            notices.push(format!(
                "iteration {} is damaged ({}); it was moved to {}",
                damaged.wear_iteration,
                super::error::list(&damaged.damage),
                damaged.moved_to.display()
            ));
        }
        for damage in &self.repaired {
            notices.push(format!("repaired damage that affects no result: {damage}"));
        }
        if let Some(damage) = &self.history_lost {
            notices.push(format!(
                "{damage}; the figures of pruned iterations are lost, because no other file had them; further results do not depend on them"
            ));
        }
        for change in &self.changed_keys {
            notices.push(format!("changed since the last start: {change}"));
        }
        let changed = |what: &str, before: &dyn std::fmt::Display, now: &dyn std::fmt::Display| {
            format!(
                "{what} changed from {before} to {now}: results need not be bit-identical to those of an uninterrupted run"
            )
        };
        if let Some((before, now)) = &self.program_changed {
            notices.push(changed("the program version", before, now));
        }
        if let Some((before, now)) = &self.threads_changed {
            notices.push(changed("the number of threads", before, now));
        }
        if let Some((before, now)) = &self.machine_changed
            && (&before.architecture, &before.cpu_features)
                != (&now.architecture, &now.cpu_features)
        {
            notices.push(changed("the processor", &describe(before), &describe(now)));
        }
        notices
    }
}

fn describe(machine: &Machine) -> String {
    format!(
        "{} ({})",
        machine.architecture,
        machine.cpu_features.join(" ")
    )
}

/// A locked run folder.
pub(super) struct LockedRun {
    pub files: Files,
    pub layout: Layout,
    pub guard: Box<dyn LockGuard>,
    /// `None` if the folder is new, or its creation was not completed.
    pub record: Option<RecordRead>,
    /// The origin of a sibling whose copy was not completed.
    pub unfinished: Option<Origin>,
}

/// Creates the folder if needed and takes its lock.
pub(super) fn lock(fs: Arc<dyn FileSystem>, root: &Path) -> Result<LockedRun, StoreError> {
    let files = Files(fs);
    let layout = Layout::at(root);
    check_folder(&files, &layout)?;
    if !files.is_there(&layout.record())? && !files.is_there(&layout.record_copy())? {
        refuse_foreign(&files, &layout)?;
    }
    files.make_dir(root)?;
    // A rejected folder is not changed: no lock file is created in it.
    read_record(&files, &layout)?;
    let guard = files.lock(&layout.lock(), root)?;
    let record = read_record(&files, &layout)?;
    let mut unfinished = None;
    if record.is_none() {
        // An unreadable marker was cut off when the process ended. Nothing was copied yet.
        let marker = files.read_metadata(&layout.copying())?.ok();
        unfinished = marker.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        if unfinished.is_none() && !chain::folders(&files, &layout)?.is_empty() {
            return Err(StoreError::Damaged(Damage {
                path: layout.record(),
                kind: DamageKind::Missing,
            }));
        }
    }
    Ok(LockedRun {
        files,
        layout,
        guard,
        record,
        unfinished,
    })
}

/// Rejects a folder without `run.json` that contains anything but the files of an unfinished run.
fn refuse_foreign(files: &Files, layout: &Layout) -> Result<(), StoreError> {
    for entry in files.list_root(layout)? {
        let name = entry.name.strip_suffix(".new").unwrap_or(&entry.name);
        let is_of_run = FILES.contains(&name) || FOLDERS.contains(&name);
        if !is_of_run || ENTRIES_AFTER_RECORD.contains(&name) {
            return Err(StoreError::NotARun {
                path: layout.root.clone(),
                found: entry.name,
            });
        }
    }
    Ok(())
}

/// Creates the folder of a run. `run.json` comes last and makes the folder a run.
pub(super) fn create(
    files: &Files,
    layout: &Layout,
    identity: &RunIdentity,
    origin: Option<Origin>,
) -> Result<RunRecord, StoreError> {
    for folder in [layout.once(), layout.iterations(), layout.staging()] {
        files.make_dir(&folder)?;
    }
    let mut record = RunRecord::new(identity, origin);
    write_identity(files, layout, identity, &mut record)?;
    write_record(files, layout, &record)?;
    // Read the record from the disk, so that the first start and all later starts use the same record.
    let found = read_record(files, layout)?.ok_or_else(|| StoreError::NoRun {
        path: layout.root.clone(),
    })?;
    Ok(found.record)
}

/// Updates `scene.toml`, `scene.original.toml`, `plan.json` and `schemas.json`. Updates the entries of the four files
/// in the record.
fn write_identity(
    files: &Files,
    layout: &Layout,
    identity: &RunIdentity,
    record: &mut RunRecord,
) -> Result<(), StoreError> {
    files.replace_if_different(&layout.scene(), identity.scene_toml.as_bytes())?;
    if identity.scene_written.is_some() {
        record.scene_written.clone_from(&identity.scene_written);
    }
    if let Some(written) = &record.scene_written {
        files.replace_if_different(&layout.written_scene(), written.as_bytes())?;
    }
    record.scene_toml.clone_from(&identity.scene_toml);
    let plan = layout.plan();
    let bytes = json(&plan, &identity.plan)?;
    record.plan_hash = hash(&bytes);
    files.replace_if_different(&plan, &bytes)?;
    let schemas = layout.schemas();
    let run_schemas = TableName::ALL.iter().map(|table| table.schema());
    let run_schemas = run_schemas.filter(|schema| schema.place != TableLocation::Beside);
    let bytes = json(&schemas, &run_schemas.collect::<Vec<_>>())?;
    record.schemas_hash = hash(&bytes);
    files.replace_if_different(&schemas, &bytes)
}

/// Writes `run.json` first and `run.copy.json` second. At any instant at least one of the two files is complete, and
/// `run.copy.json` lacks at most the last change.
pub(super) fn write_record(
    files: &Files,
    layout: &Layout,
    record: &RunRecord,
) -> Result<(), StoreError> {
    let path = layout.record();
    let bytes = sealed(&path, record)?;
    files.replace_if_different(&path, &bytes)?;
    files.replace_if_different(&layout.record_copy(), &bytes)
}

/// Compares an existing run with `identity` and repairs the run. The repair moves damaged iterations to `damaged/`,
/// completes interrupted pruning and cleans `staging/`.
pub(super) fn check_and_repair(
    files: Files,
    layout: Layout,
    found: RecordRead,
    identity: &RunIdentity,
) -> Result<(RunReader, Opening), StoreError> {
    let mut record = found.record;
    let mut opening = Opening {
        repaired: found.damage.into_iter().collect(),
        ..Opening::default()
    };
    let (changed, forbidden): (Vec<_>, Vec<_>) =
        differences(&record.scene, &as_read(&identity.scene))
            .into_iter()
            .partition(|change| matches(&change.key, &identity.free_keys));
    if !forbidden.is_empty() {
        // Without commits the scene may still be changed, as after a failed first attempt. The stage keys show which
        // results are still valid.
        let committed = !chain::folders(&files, &layout)?.is_empty()
            || record.origin.is_some()
            || files.is_there(&layout.damaged())?;
        if committed {
            let current_text = written_scene(&files, &layout)?.ok();
            return Err(StoreError::SceneChanged {
                path: layout.root,
                keys: user_changes(forbidden, &identity.following_keys),
                edited: current_text.is_some_and(|current_text| current_text != record.scene_toml),
            });
        }
        let written_scene_text = record.scene_written;
        record = RunRecord::new(identity, None);
        record.scene_written = written_scene_text;
    }
    opening.changed_keys = changed;
    // Store the scene from memory. If the program stored the scene from the file, the text of a floating-point number
    // could change.
    record.scene = identity.scene.clone();
    record.scene_hash = identity.scene_hash();
    files.remove_file_if_there(&layout.copying())?;
    files.remove_file_if_there(&layout.failure())?;
    for folder in [layout.once(), layout.iterations(), layout.staging()] {
        files.make_dir(&folder)?;
    }
    let past = PastAndHistory::read(&files, &layout)?;
    discard(&files, &layout, past.past.pruned.keys().copied())?;

    let mut chain = chain::verify_chain(&files, &layout, &past.past)?;
    opening.latest = chain.sound.keys().next_back().copied();
    let mut reports = std::mem::take(&mut chain.reports);
    for report in &mut reports {
        if let Some(commit) = chain.sound.get_mut(&report.wear_iteration)
            && !report.unchained_damage.is_empty()
        {
            drop_damaged(&files, &layout, commit, &report.unchained_damage)?;
            opening.repaired.append(&mut report.unchained_damage);
        }
    }
    // Move the highest iteration first. After a crash in between, the lower ones are found damaged again.
    for report in reports.iter().rev() {
        let beyond = opening
            .latest
            .is_none_or(|latest| report.wear_iteration > latest);
        if beyond && files.is_there(&layout.iteration(report.wear_iteration))? {
            let moved_to = set_aside(&files, &layout, report.wear_iteration)?;
            opening.set_aside.push(DamagedIteration {
                wear_iteration: report.wear_iteration,
                damage: report.damage.clone(),
                moved_to,
            });
        }
    }
    opening.set_aside.reverse();
    reports.retain(|report| report.damage.is_empty());
    // Without a gap the folders have all content of the history, so damage of its file does not matter.
    if has_gap(&chain, &past.past) {
        opening.history_lost = past.damage(&layout, &chain);
    }
    // Iterations that were pruned beyond the latest one will be computed again.
    let file_rows = past.rows();
    let agreeing_history = past.matching_rows(&chain);
    let agreeing_rows = agreeing_history.len();
    let mut reader = RunReader {
        files,
        layout,
        record,
        commits: chain.sound,
        reports,
        history: agreeing_history,
    };
    let history = std::mem::take(&mut reader.history);
    reader.history = reader.completed(history)?;
    let RunReader {
        files,
        layout,
        record,
        history,
        ..
    } = &mut reader;
    if [file_rows, agreeing_rows] != [history.len(); 2] {
        history::write(files, layout, history)?;
    }

    let next = opening.latest.map_or(0, |latest| latest + 1);
    (opening.drafts_kept, opening.drafts_removed) = clean_staging(files, layout, next)?;
    note_circumstances(record, &mut opening, identity);
    write_identity(files, layout, identity, record)?;
    write_record(files, layout, record)?;
    Ok((reader, opening))
}

/// Formats a version with the commit that it was built from.
fn with_commit(version: &str, commit: Option<&str>) -> String {
    match commit {
        Some(commit) => format!("{version} ({commit})"),
        None => version.to_owned(),
    }
}

/// Records a start with another version, machine, scene or number of threads than the last one.
fn note_circumstances(record: &mut RunRecord, opening: &mut Opening, identity: &RunIdentity) {
    let (version, threads, machine) = record.circumstances();
    let this_machine = Machine::this();
    // The commit of a packaged program is unknown. An unknown commit does not count as a change of the program.
    let rebuilt = record
        .commit()
        .zip(COMMIT)
        .filter(|(then, now)| then != now);
    if version != identity.program_version || rebuilt.is_some() {
        let (then, now) = rebuilt.unzip();
        opening.program_changed = Some((
            with_commit(version, then),
            with_commit(&identity.program_version, now),
        ));
    }
    if threads != identity.threads {
        opening.threads_changed = Some((threads, identity.threads));
    }
    if *machine != this_machine {
        opening.machine_changed = Some((machine.clone(), this_machine.clone()));
    }
    if opening.program_changed.is_some()
        || opening.threads_changed.is_some()
        || opening.machine_changed.is_some()
        || !opening.changed_keys.is_empty()
    {
        record.continued.push(Continuation {
            wear_iteration: opening.latest,
            began: date::now(),
            program_version: identity.program_version.clone(),
            program_commit: COMMIT.map(str::to_owned),
            threads: identity.threads,
            machine: this_machine,
            changed_keys: opening
                .changed_keys
                .iter()
                .map(ToString::to_string)
                .collect(),
        });
    }
}

/// Moves an iteration to `damaged/`.
fn set_aside(files: &Files, layout: &Layout, wear_iteration: u64) -> Result<PathBuf, StoreError> {
    let name = iteration_name(wear_iteration);
    let target = move_to_damaged(files, layout, &layout.iteration(wear_iteration), &name)?;
    files.sync_dir(&layout.iterations())?;
    Ok(target)
}

/// Moves a file or folder to `damaged/` without replacing an earlier one of the same name.
fn move_to_damaged(
    files: &Files,
    layout: &Layout,
    path: &Path,
    name: &str,
) -> Result<PathBuf, StoreError> {
    let folder = layout.damaged();
    files.make_dir(&folder)?;
    let mut target = folder.join(name);
    let mut count = 1;
    while files.is_there(&target)? {
        count += 1;
        target = folder.join(format!("{name}.{count}"));
    }
    files.rename(path, &target)?;
    files.sync_dir(&folder)?;
    Ok(target)
}

/// Removes damaged tables outside the chain from a commit. The hash of the commit does not include tables outside the
/// chain.
fn drop_damaged(
    files: &Files,
    layout: &Layout,
    commit: &mut Commit,
    damage: &[Damage],
) -> Result<(), StoreError> {
    let folder = layout.iteration(commit.wear_iteration);
    for Damage { path, .. } in damage {
        // Move the damaged file before removing the entry of the file. If the process ends between the two steps, the
        // next start finds the file missing and removes the entry.
        if files.is_there(path)? {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            let name = format!("{}-{file}", iteration_name(commit.wear_iteration));
            move_to_damaged(files, layout, path, &name)?;
        }
        commit
            .unchained
            .retain(|_, entry| folder.join(&entry.file) != *path);
    }
    let manifest = layout.commit(commit.wear_iteration);
    files.replace(&manifest, &sealed(&manifest, commit)?)
}

/// Removes pruned iterations. Each pruned iteration disappears for readers in one step.
pub(super) fn discard(
    files: &Files,
    layout: &Layout,
    iterations: impl Iterator<Item = u64>,
) -> Result<(), StoreError> {
    let present = chain::folders(files, layout)?;
    let target = layout.discarded();
    files.remove_dir_if_there(&target)?;
    let pruned_iterations: Vec<u64> = iterations.filter(|k| present.contains(k)).collect();
    if pruned_iterations.is_empty() {
        return Ok(());
    }
    files.make_dir_unsynced(&target)?;
    for wear_iteration in pruned_iterations {
        files.rename(
            &layout.iteration(wear_iteration),
            &target.join(iteration_name(wear_iteration)),
        )?;
    }
    files.sync_dir(&layout.iterations())?;
    files.remove_dir_if_there(&target)
}
