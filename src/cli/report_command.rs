//! `fretwear report`.

use std::path::PathBuf;

use fretwear::report::{Report, RunTables, one_line_name};
use fretwear::study::claims;

use super::arguments::ReportArguments;
use super::compare::report_skipped;
use super::{CliError, Exit};
use crate::terminal::{Results, say};

/// Writes the page on the runs, and prints its path.
pub fn report(arguments: &ReportArguments, out: &mut Results) -> Result<Exit, CliError> {
    let (runs, passed_over) = RunTables::open_all(&arguments.runs)?;
    let mut exit = report_skipped(&passed_over);
    let mut report = Report::new(&runs)?;
    if arguments.claims {
        let (evidence, findings) = claims::evaluate(&runs)?;
        report.add_section(claims::section(&findings, &evidence));
    }
    let page = match (&arguments.output, &arguments.runs[..]) {
        (Some(page), _) => page.clone(),
        (None, [run]) => run.join("report.html"),
        (None, _) => PathBuf::from("report.html"),
    };
    match arguments.output {
        Some(_) => report.write(&page)?,
        None => report.replace(&page)?,
    }
    if let Some(folder) = &arguments.svg {
        report.write_svgs(folder)?;
    }
    writeln!(out, "{}", page.display());
    for damage in runs.iter().flat_map(RunTables::damage) {
        say(&one_line_name(&format!(
            "damaged: {damage}; the iterations from there on are left out"
        )));
        exit = Exit::Damaged;
    }
    Ok(exit)
}
