//! Findings as a table and as Markdown.

use std::fmt::Write;
use std::path::Path;

use super::super::{ReportError, RunTables};
use super::{Finding, Verdict};
use crate::tables::{Provenance, Table, TableError, TableName, to_parquet};

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
    Table::builder(TableName::Claims)
        .column(
            "claim",
            findings
                .iter()
                .map(|finding| finding.claim as i32)
                .collect::<Vec<_>>(),
        )
        .column(
            "place",
            text(&|finding| finding.statement().place.to_owned()),
        )
        .column(
            "statement",
            text(&|finding| finding.statement().statement.to_owned()),
        )
        .column(
            "criterion",
            text(&|finding| finding.statement().criterion.to_owned()),
        )
        .column("runs", text(&|finding| finding.runs.join(" ")))
        .column(
            "verdict",
            text(&|finding| finding.verdict.words().to_owned()),
        )
        .column("measured", text(&|finding| finding.measured.clone()))
        .column("cause", text(&|finding| finding.cause.clone()))
        .build()
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
            source,
        })?;
    for (path, bytes) in [
        (path, bytes),
        (folder.join("claims.md"), markdown(findings).into_bytes()),
    ] {
        std::fs::write(&path, bytes).map_err(|source| ReportError::Io { path, source })?;
    }
    Ok(())
}

/// All findings as one Markdown table, with a count, and the criteria under it.
pub fn markdown(findings: &[Finding]) -> String {
    let count = |verdict| {
        findings
            .iter()
            .filter(|finding| finding.verdict == verdict)
            .count()
    };
    let mut text = format!(
        "{} findings on {} claims: {} hold, {} fail, {} not applicable.\n\n",
        findings.len(),
        super::CLAIMS.len(),
        count(Verdict::Holds),
        count(Verdict::Fails),
        count(Verdict::NotApplicable)
    );
    text += "| claim | [A] | statement | runs | verdict | measured |\n|---:|---|---|---|---|---|\n";
    for finding in findings {
        let claim = finding.statement();
        let mut measured = finding.measured.clone();
        if !finding.cause.is_empty() {
            write!(measured, "; likely cause: {}", finding.cause)
                .expect("a text takes what is written");
        }
        let cells = [
            finding.claim.to_string(),
            claim.place.to_owned(),
            claim.statement.to_owned(),
            finding.runs.join(", "),
            match finding.verdict {
                Verdict::Fails => "**fails**".to_owned(),
                verdict => verdict.words().to_owned(),
            },
            measured,
        ];
        // A bar would end the cell.
        let cells = cells.map(|cell| cell.replace('|', "\\|"));
        writeln!(text, "| {} |", cells.join(" | ")).expect("a text takes what is written");
    }
    text += "\nCriteria; thresholds marked * are this program's, not the paper's.\n\n";
    for claim in super::CLAIMS {
        writeln!(text, "{}. {}", claim.number, claim.criterion)
            .expect("a text takes what is written");
    }
    text
}
