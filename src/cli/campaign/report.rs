//! `fretwear campaign report`.

use fretwear::campaign::Findings;
use fretwear::report::campaign::{CampaignReport, figure_row, sensitivity_text, title};
use serde_json::{Value, json};

use super::super::report::rows;
use super::{CliError, Exit, ReportArguments, folder};
use crate::terminal::Results;

/// Number of keys that are listed for a figure.
const NAMED: usize = 2;

pub fn report(arguments: &ReportArguments, out: &mut Results) -> Result<Exit, CliError> {
    let folder = folder(&arguments.dir);
    let (about, campaign) = folder.open()?;
    let states = folder.states(campaign.rows.len())?;
    let report = CampaignReport {
        findings: &Findings::of(&folder, &about, &campaign)?,
        failures: &folder.failures(&states)?,
        about: &about,
        campaign: &campaign,
        states: &states,
    };
    let written = report.write(arguments.output.as_deref(), &arguments.dir)?;
    if arguments.json {
        let tables = report.findings.tables().map_err(|source| {
            let path = written[0].clone();
            let source = Box::new(source);
            CliError::from(fretwear::campaign::CampaignError::Table { path, source })
        })?;
        let [figures, bands, sensitivities] = tables.map(|table| Value::from(rows(&table)));
        out.json(&json!({
            "page": written[0].display().to_string(),
            "runs": report.findings.runs.rows.len(),
            "figures": figures,
            "bands": bands,
            "sensitivities": sensitivities,
        }));
        return Ok(Exit::Done);
    }
    writeln!(out, "{}: {}", about.title, report.counts());
    writeln!(
        out,
        "  {:<24} {:>20} {:>20} {:>20}  moved by",
        "", "5 %", "median", "95 %"
    );
    for figure in &report.findings.figures {
        let [_, _, low, median, high] = figure_row(figure);
        let movers = report.influential_keys(figure.name).into_iter().take(NAMED);
        let movers = movers.map(|s| format!("{} ({})", s.key, sensitivity_text(s)));
        let movers = movers.collect::<Vec<_>>().join(", ");
        writeln!(
            out,
            "  {:<24} {low:>20} {median:>20} {high:>20}  {movers}",
            title(figure.name)
        );
    }
    for path in written {
        writeln!(out, "{}", path.display());
    }
    Ok(Exit::Done)
}
