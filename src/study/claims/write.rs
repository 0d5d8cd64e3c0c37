//! Findings as a table and as Markdown.

use std::path::Path;

use super::{Finding, Verdict};
use crate::report::html::{escaped, table_of_markup};
use crate::report::output::replace;
use crate::report::text::{self, cell};
use crate::report::{ReportError, RunTables, Section};
use crate::tables::{Provenance, Table, TableError, TableName, TypedTable, to_parquet, typed};

impl Verdict {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Fails => "fails",
            Verdict::NotApplicable => "not applicable",
        }
    }
}

/// The table `claims`.
///
/// # Errors
/// [`TableError`] if the schema does not fit.
pub fn table(findings: &[Finding]) -> Result<Table, TableError> {
    let text = |of: &dyn Fn(&Finding) -> String| findings.iter().map(of).collect::<Vec<String>>();
    typed::Claims {
        claim: findings.iter().map(|f| f.claim as i32).collect(),
        place: text(&|f| f.statement().place.to_owned()),
        statement: text(&|f| f.statement().statement.to_owned()),
        criterion: text(&|f| f.statement().criterion.to_owned()),
        runs: text(&|f| f.runs.join(" ")),
        verdict: text(&|f| f.verdict.words().to_owned()),
        measured: text(&|f| f.measured.clone()),
        cause: text(&|f| f.cause.clone()),
    }
    .to_table()
}

/// Writes `claims.md` and `claims.parquet` into a folder. Files that are there are replaced.
///
/// # Errors
/// [`ReportError::Table`], [`ReportError::Io`].
pub fn write(findings: &[Finding], runs: &[RunTables], folder: &Path) -> Result<(), ReportError> {
    let hashes: Vec<&str> = runs
        .iter()
        .map(|run| run.record().scene_hash.as_str())
        .collect();
    let provenance = Provenance {
        scene_hash: hashes.join(" "),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let path = folder.join(TableName::Claims.file_name());
    let bytes = table(findings)
        .and_then(|table| to_parquet(&table, &provenance))
        .map_err(|source| ReportError::Table {
            path: path.clone(),
            source: Box::new(source),
        })?;
    for (path, bytes) in [
        (path, bytes),
        (folder.join("claims.md"), markdown(findings).into_bytes()),
    ] {
        replace(&path, &bytes).map_err(|source| ReportError::Io { path, source })?;
    }
    Ok(())
}

const HEAD: [&str; 5] = ["claim", "[A]", "statement", "verdict", "measured"];

/// A claim with one of its verdicts.
struct Row {
    /// Number, place, statement, verdict.
    head: [String; 4],
    criterion: &'static str,
    /// What was measured on each run, and likely causes.
    lines: Vec<String>,
}

fn rows(findings: &[Finding]) -> Vec<Row> {
    let mut rows = Vec::new();
    for claim in super::CLAIMS {
        let of_claim = |finding: &&Finding| finding.claim == claim.number;
        let of_claim: Vec<&Finding> = findings.iter().filter(of_claim).collect();
        for verdict in [Verdict::Holds, Verdict::Fails, Verdict::NotApplicable] {
            let same = of_claim.iter().copied();
            let same: Vec<&Finding> = same.filter(|f| f.verdict == verdict).collect();
            if same.is_empty() {
                continue;
            }
            let number = match (same.len(), of_claim.len()) {
                (1, 1) => String::new(),
                (some, all) => format!(", {some} of {all}"),
            };
            rows.push(Row {
                head: [
                    claim.number.to_string(),
                    claim.place.to_owned(),
                    claim.statement.to_owned(),
                    format!("{}{number}", verdict.words()),
                ],
                criterion: claim.criterion,
                lines: lines(&same),
            });
        }
    }
    rows
}

fn counts(findings: &[Finding]) -> String {
    let count = |verdict| findings.iter().filter(|f| f.verdict == verdict).count();
    format!(
        "{} findings on {} claims: {} hold, {} fail, {} not applicable",
        findings.len(),
        super::CLAIMS.len(),
        count(Verdict::Holds),
        count(Verdict::Fails),
        count(Verdict::NotApplicable)
    )
}

/// All findings as one Markdown table, a row for each claim and verdict, with a count, and the criteria under it.
pub fn markdown(findings: &[Finding]) -> String {
    let mut text = format!("{}.\n\n| {} |\n", counts(findings), HEAD.join(" | "));
    text += "|---:|---|---|---|---|\n";
    for row in rows(findings) {
        let mut cells = row.head.map(|text| cell(&text)).to_vec();
        let lines: Vec<String> = row.lines.iter().map(|line| text::markdown(line)).collect();
        cells.push(cell(&lines.join("<br>")));
        text += &format!("| {} |\n", cells.join(" | "));
    }
    text += "\nCriteria; thresholds marked * are this program's, not the paper's.\n\n";
    for claim in super::CLAIMS {
        text += &format!("{}. {}\n", claim.number, claim.criterion);
    }
    text
}

/// The findings as a part of a page, the same rows as [`markdown`].
pub fn section(findings: &[Finding]) -> Section {
    let rows: Vec<Vec<String>> = rows(findings)
        .into_iter()
        .map(|row| {
            let [claim, place, statement, verdict] = row.head.each_ref().map(|text| escaped(text));
            let criterion = escaped(row.criterion);
            let lines: Vec<String> = row.lines.iter().map(|line| escaped(line)).collect();
            vec![
                claim,
                place,
                format!("{statement} <small>({criterion})</small>"),
                verdict,
                lines.join("<br>"),
            ]
        })
        .collect();
    Section {
        id: "claims",
        title: "What the paper claims".to_owned(),
        html: format!(
            "<p>{}. Thresholds marked * are this program's, not the paper's.</p>\n{}",
            escaped(&counts(findings)),
            table_of_markup(&HEAD.map(str::to_owned), &rows, false)
        ),
    }
}

/// What was measured on each run, and likely causes, each said once.
fn lines(findings: &[&Finding]) -> Vec<String> {
    let mut lines: Vec<(String, String)> = Vec::new();
    let mut add =
        |runs: String, text: String| match lines.iter_mut().find(|(_, said)| *said == text) {
            Some((names, _)) => *names += &format!(", {runs}"),
            None => lines.push((runs, text)),
        };
    for finding in findings {
        add(finding.runs.join(", "), finding.measured.clone());
    }
    for finding in findings.iter().filter(|finding| !finding.cause.is_empty()) {
        let cause = format!("likely cause: {}", finding.cause);
        add(finding.runs.join(", "), cause);
    }
    lines
        .into_iter()
        .map(|(runs, text)| match runs.as_str() {
            "" => text,
            runs => format!("{runs}: {text}"),
        })
        .collect()
}
