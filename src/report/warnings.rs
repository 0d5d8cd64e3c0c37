//! Warnings about runs, and the figures and sections that they concern.

use super::figures::{ReportedRun, ReportedRuns, heading, with_run_name};
use super::quantity::{self, CYCLES, with_best_unit};
use super::run_tables::numeric_column;
use super::template::Warning;
use super::text::continue_command;
use super::{ReportError, WEAR_ITERATION};

/// Places of a warning about the whole page.
const EVERYTHING: &[&str] = &[];
/// Places of a warning about a peak pressure beyond yield.
const PEAK: &[&str] = &["fig-pressure", "results"];
const VIBRATION: &[&str] = &["fig-forced-response", "fig-resonance", "results"];

/// Beginnings of warnings about a scene (mostly keys), and the places that the warnings concern. The first match
/// counts.
const SUBJECTS: [(&str, &[&str]); 15] = [
    ("surface.", &["fig-surface", "results"]),
    ("joint.", &["fig-surface", "results"]),
    ("contact.kn", VIBRATION),
    ("contact.kt", VIBRATION),
    ("contact.bolt_stiffness", &["fig-stiffness", "results"]),
    (
        "contact.friction_coefficient",
        &["fig-hysteresis-loops", "fig-forced-response", "results"],
    ),
    ("contact.", PEAK),
    ("material.density", VIBRATION),
    ("material.", &["fig-stiffness", "fig-pressure", "results"]),
    ("motion.", &["fig-hysteresis-loops", "results"]),
    ("dynamics.", VIBRATION),
    // The prefix `structure` matches warnings about keys of `[structure]` and about the matrices of an imported
    // structure.
    ("structure", VIBRATION),
    // A warning about an explicit step beyond its stability limit.
    ("wear.depth_step = ", &["fig-contact-area", "results"]),
    ("wear.", &["fig-wear-rate", "results"]),
    ("", EVERYTHING),
];

/// Returns all warnings about the runs, in the order of the runs.
///
/// # Errors
/// [`ReportError::Run`] for a lock that cannot be read.
pub fn warnings(study: &ReportedRuns) -> Result<Vec<Warning>, ReportError> {
    let urgent = |text: String| Warning {
        text,
        places: EVERYTHING,
    };
    let mut warnings = Vec::new();
    for run in &study.runs {
        warnings.extend(progress(run)?.map(urgent));
        warnings.extend(run.tables.warnings().map(|text| Warning {
            text: with_run_name(study, run, text),
            places: places_of(text),
        }));
        warnings.extend(scene(study, run));
        warnings.extend(peak(study, run));
        warnings.extend(run.tables.damage().iter().map(|damage| {
            urgent(format!(
                "Damaged: {damage}. The page leaves out this iteration and all later ones."
            ))
        }));
    }
    Ok(warnings)
}

fn places_of(warning: &str) -> &'static [&'static str] {
    let mut subjects = SUBJECTS.iter();
    let subject = subjects.find(|(begin, _)| warning.starts_with(begin));
    subject.map_or(EVERYTHING, |(_, places)| places)
}

/// Warns if the file of the original scene is damaged.
fn scene(study: &ReportedRuns, run: &ReportedRun) -> Option<Warning> {
    let damage = match run.tables.reader().written_scene_damage() {
        Ok(damage) => damage?.to_string(),
        Err(error) => error.to_string(),
    };
    let text = format!("Damaged: {damage}. The scene on this page comes from run.json.");
    Some(Warning {
        text: with_run_name(study, run, &text),
        places: &["scene"],
    })
}

/// Warns about the first state whose peak pressure a real contact would not bear.
fn peak(study: &ReportedRuns, run: &ReportedRun) -> Option<Warning> {
    let contact = run.tables.recipe().contact()?;
    let states = numeric_column(&run.summary, WEAR_ITERATION)?;
    let mut peaks = states.into_iter().zip(run.column("max_pressure")?);
    peaks.find_map(|(k, peak)| {
        let state = heading(study, run, &run.state(k as u64));
        let remark = contact.peak_pressure_note(peak)?;
        Some(Warning {
            text: format!("{state}: {remark}."),
            places: PEAK,
        })
    })
}

/// Reports the progress of a run that has not reached its end.
fn progress(run: &ReportedRun) -> Result<Option<String>, ReportError> {
    let last = |column: &str| run.column(column)?.last().copied();
    let tables = run.tables;
    let wear = tables.recipe().wear.as_ref();
    let Some(((wear, cycles), volume)) = wear.zip(last("cycles")).zip(last("wear_volume")) else {
        return Ok(None);
    };
    let before = |column: &str| run.column(column)?.into_iter().rev().nth(1);
    let (load, bar) = (before("normal_load"), before("error_normal_load"));
    if wear.is_reached(cycles as u64, volume) || tables.recipe().ends_after(load, bar) {
        return Ok(None);
    }
    let holder = tables.reader().holder();
    let lock_holder = holder.map_err(|source| ReportError::Run {
        run: tables.root().to_owned(),
        source,
    })?;
    let state = match lock_holder {
        Some(_) => "is running".to_owned(),
        None => format!(
            "stopped before its end (continue it with `{}`)",
            continue_command(tables.root())
        ),
    };
    let part = |done: f64, end: f64| with_best_unit(done / end, quantity::SHARE);
    let progress = match (wear.cycles, wear.volume) {
        (Some(end), _) => format!(
            "{} of {}, {}",
            with_best_unit(cycles, CYCLES),
            with_best_unit(end as f64, CYCLES),
            part(cycles, end as f64)
        ),
        (None, Some(end)) => format!(
            "{} of {}, {}",
            with_best_unit(volume, quantity::VOLUME),
            with_best_unit(end, quantity::VOLUME),
            part(volume, end)
        ),
        (None, None) => with_best_unit(cycles, CYCLES),
    };
    Ok(Some(format!(
        "In progress: {} {state}. Iteration {}, {progress}.",
        tables.name(),
        tables.latest()
    )))
}
