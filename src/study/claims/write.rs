//! Output of findings as a table, as Markdown and as a section of a page. The verdicts come first, then words, numbers
//! and causes.

use std::path::Path;

use maud::{Markup, html};

use super::numbers::{NumberComparison, compare_numbers};
use super::{CLAIMS, Claim, Evidence, Finding, Kind, Verdict};
use crate::report::output::replace;
use crate::report::quantity::four_digits;
use crate::report::table::table as html_table;
use crate::report::text::NONE;
use crate::report::text::{self, cell};
use crate::report::{ReportError, RunTables, Section};
use crate::tables::{Provenance, Table, TableError, TableName, TypedTable, to_parquet, typed};

impl Verdict {
    /// Returns the verdict in words.
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Fails => "fails",
            Verdict::Undecided => "undecided",
            Verdict::NotApplicable => "not applicable",
        }
    }
}

impl Kind {
    /// Returns the kind in one word.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Result => "result",
            Kind::Method => "method",
            Kind::Check => "check",
        }
    }
}

/// Builds the table `claims`.
///
/// # Errors
/// [`TableError`] if the schema does not fit.
pub fn table(findings: &[Finding]) -> Result<Table, TableError> {
    let text =
        |value: &dyn Fn(&Finding) -> String| findings.iter().map(value).collect::<Vec<String>>();
    typed::Claims {
        claim: findings.iter().map(|f| f.claim as i32).collect(),
        kind: text(&|f| f.statement().kind.word().to_owned()),
        place: text(&|f| f.statement().place.to_owned()),
        statement: text(&|f| f.statement().statement.to_owned()),
        words: text(&|f| f.statement().words.to_owned()),
        criterion: text(&|f| f.statement().criterion.to_owned()),
        setting: text(&|f| f.setting.clone()),
        whole: findings.iter().map(|f| f.whole).collect(),
        runs: text(&|f| f.runs.join(" ")),
        verdict: text(&|f| f.verdict.words().to_owned()),
        measured: text(&|f| f.measured.clone()),
        cause: text(&|f| f.cause.clone()),
    }
    .to_table()
}

/// Writes `claims.md` and `claims.parquet` into a folder. Replaces existing files.
///
/// # Errors
/// [`ReportError::Table`], [`ReportError::Io`].
pub fn write(
    findings: &[Finding],
    evidence: &[Evidence],
    runs: &[RunTables],
    folder: &Path,
) -> Result<(), ReportError> {
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
        (
            folder.join("claims.md"),
            markdown(findings, evidence).into_bytes(),
        ),
    ] {
        replace(&path, &bytes).map_err(|source| ReportError::Io { path, source })?;
    }
    Ok(())
}

/// Returns each setting of the findings once, in the order of the findings.
fn settings(findings: &[Finding]) -> Vec<&str> {
    let mut settings: Vec<&str> = Vec::new();
    for finding in findings {
        if !settings.contains(&finding.setting.as_str()) {
            settings.push(&finding.setting);
        }
    }
    settings
}

/// Returns the finding on a whole claim in a setting.
fn claim_finding<'a>(findings: &'a [Finding], claim: u32, setting: &str) -> Option<&'a Finding> {
    let fits = |f: &&Finding| f.whole && f.claim == claim && f.setting == setting;
    findings.iter().find(fits)
}

/// Counts the results of the paper in a setting by verdict. The verdicts are: the result holds, fails, is undecided, or
/// has no run. Only claims of the kind [`Kind::Result`] count.
pub fn counts(findings: &[Finding], setting: &str) -> [usize; 4] {
    let results = CLAIMS.iter().filter(|claim| claim.kind == Kind::Result);
    let mut counts = [0; 4];
    for finding in results.filter_map(|claim| claim_finding(findings, claim.number, setting)) {
        counts[finding.verdict as usize] += 1;
    }
    counts
}

/// Returns the label of a setting in a line of text.
fn setting_label(setting: &str) -> &str {
    match setting {
        "" => "no run",
        setting => setting,
    }
}

fn count_text(findings: &[Finding], setting: &str) -> String {
    let [hold, fail, undecided, none] = counts(findings, setting);
    let mut text = format!(
        "{}: of {} results of the paper {hold} hold, {fail} fail, {undecided} are undecided",
        setting_label(setting),
        hold + fail + undecided + none
    );
    if none > 0 {
        text += &format!(", {none} have no run");
    }
    text
}

const ABOUT: &str = "Claims of the kind “method” follow from the definition of the method. These claims and the check do not count. Thresholds marked * come from this program, not from the paper.";

/// Returns all findings as Markdown. A first table lists the verdicts, and a second table compares the numbers of the
/// paper with our numbers. For each claim, the text gives the words of the paper, the criterion, the measurements and
/// likely causes.
pub fn markdown(findings: &[Finding], evidence: &[Evidence]) -> String {
    let settings = settings(findings);
    let mut text = String::new();
    for setting in &settings {
        text += &format!("- {}\n", text::markdown(&count_text(findings, setting)));
    }
    text += &format!("\n{ABOUT}\n\n");
    let row = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|text| cell(text)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let mut heads: Vec<String> = ["claim", "[A]", "statement"].map(str::to_owned).into();
    heads.extend(
        settings
            .iter()
            .map(|name| text::markdown(setting_label(name))),
    );
    text += &row(&heads);
    text += &format!("|---:|---|---|{}\n", "---|".repeat(settings.len()));
    for claim in &CLAIMS {
        let mut cells = vec![
            claim.number.to_string(),
            claim.place.to_owned(),
            claim.statement.to_owned(),
        ];
        cells.extend(
            settings
                .iter()
                .map(|setting| verdict(findings, claim, setting)),
        );
        text += &row(&cells);
    }
    let numbers = numbers(evidence);
    if !numbers.is_empty() {
        text += "\n| number | [A] | the paper's | ours | ratio | setting |\n|---|---|---:|---:|---:|---|\n";
        for row_of in &numbers {
            let [paper, ours, ratio] = number_texts(row_of);
            let setting = text::markdown(&row_of.setting);
            let cells = [
                row_of.what.to_owned(),
                row_of.place.to_owned(),
                paper,
                ours,
                ratio,
                setting,
            ];
            text += &row(&cells);
        }
    }
    for claim in &CLAIMS {
        text += &format!(
            "\n{}. **{}** ({})\n",
            claim.number, claim.statement, claim.place
        );
        if !claim.words.is_empty() {
            text += &format!("   - the paper: “{}”\n", claim.words);
        }
        text += &format!("   - criterion: {}\n", claim.criterion);
        for line in lines(findings, claim) {
            let indent = if line.whole { "   " } else { "     " };
            text += &format!("{indent}- {}\n", text::markdown(&line.text));
        }
    }
    text
}

fn verdict(findings: &[Finding], claim: &Claim, setting: &str) -> String {
    let words = claim_finding(findings, claim.number, setting).map_or(NONE, |f| f.verdict.words());
    match claim.kind {
        Kind::Result => words.to_owned(),
        kind => format!("{words} ({})", kind.word()),
    }
}

/// Compares the paper's numbers with all studies.
fn numbers(evidence: &[Evidence]) -> Vec<NumberComparison> {
    let studies = super::studies(evidence);
    let all = studies.iter().flat_map(compare_numbers);
    all.filter(|row| row.ours.is_some()).collect()
}

/// Formats the paper's number, ours and the ratio.
fn number_texts(row: &NumberComparison) -> [String; 3] {
    let with_unit = |value: f64| match row.unit {
        "" => four_digits(value),
        unit => format!("{}\u{a0}{unit}", four_digits(value)),
    };
    [
        with_unit(row.paper),
        row.ours.map_or(NONE.to_owned(), with_unit),
        row.ratio().map_or(NONE.to_owned(), four_digits),
    ]
}

/// Line of text on a claim.
struct Line {
    whole: bool,
    verdict: Verdict,
    text: String,
}

/// Returns the measurements in each setting, the claim before its parts, with likely causes. Settings with equal
/// findings share a line.
fn lines(findings: &[Finding], claim: &Claim) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let of_claim = || findings.iter().filter(|f| f.claim == claim.number);
    let mut reported: Vec<&str> = Vec::new();
    for setting in settings(findings) {
        if reported.contains(&setting) {
            continue;
        }
        let key = |setting: &str| -> Vec<(Verdict, &str, &str)> {
            let in_setting = of_claim().filter(|f| f.setting == setting);
            in_setting
                .map(|f| (f.verdict, f.measured.as_str(), f.cause.as_str()))
                .collect()
        };
        let mut equal_settings: Vec<&str> = self::settings(findings);
        equal_settings.retain(|other| key(other) == key(setting));
        reported.extend(equal_settings.iter().copied());
        let names: Vec<&str> = equal_settings
            .iter()
            .map(|name| setting_label(name))
            .collect();
        for finding in of_claim().filter(|f| f.setting == setting) {
            let mut text = match finding.whole {
                true => format!("{}: {}", names.join(" | "), finding.verdict.words()),
                false => finding.verdict.words().to_owned(),
            };
            text += &format!(": {}", finding.measured);
            if !finding.cause.is_empty() {
                text += &format!(". Likely cause: {}", finding.cause);
            }
            lines.push(Line {
                whole: finding.whole,
                verdict: finding.verdict,
                text,
            });
        }
    }
    lines
}

/// Returns the findings as a section of a page. The content is that of [`markdown`], in a layout for narrow screens.
pub fn section(findings: &[Finding], evidence: &[Evidence]) -> Section {
    let settings = settings(findings);
    let heads = ["#", "claim"].into_iter();
    let heads: Vec<&str> = heads
        .chain(settings.iter().map(|name| setting_label(name)))
        .collect();
    let verdict = |claim: &Claim, setting: &str| {
        let finding = claim_finding(findings, claim.number, setting);
        let finding = finding.map_or(Verdict::NotApplicable, |f| f.verdict);
        html! {
            (verdict_label(finding))
            @if claim.kind != Kind::Result { " " small { "(" (claim.kind.word()) ")" } }
        }
    };
    let row = |claim: &Claim| {
        let number = claim.number;
        let link = html! { a href={ "#claim-" (number) } { (number) } };
        let verdicts = settings.iter().map(|setting| verdict(claim, setting));
        [link, html! { (claim.statement) }]
            .into_iter()
            .chain(verdicts)
            .collect()
    };
    let rows: Vec<Vec<Markup>> = CLAIMS.iter().map(row).collect();
    let numbers = numbers(evidence);
    let numbers_in = |setting: &str| -> Vec<Vec<String>> {
        let in_setting = numbers.iter().filter(|row| row.setting == setting);
        let cells = in_setting.map(|row| {
            [
                [row.what, row.place].map(str::to_owned).to_vec(),
                number_texts(row).to_vec(),
            ]
            .concat()
        });
        cells.collect()
    };
    let each = settings
        .iter()
        .map(|setting| (setting, numbers_in(setting)));
    Section {
        id: "claims",
        title: "Claims of the paper".to_owned(),
        html: html! {
            ul { "\n" @for setting in &settings { li { (count_text(findings, setting)) } "\n" } } "\n"
            p.note { (ABOUT) } "\n"
            (html_table(&heads, &rows, false))
            @for (setting, rows) in each.filter(|(_, rows)| !rows.is_empty()) {
                h3 { "The paper's numbers and ours: " (setting_label(setting)) } "\n"
                (html_table(&["number", "[A]", "the paper's", "ours", "ratio"], &rows, false))
            }
            @for claim in &CLAIMS { (article(findings, claim)) }
        },
    }
}

/// Returns a coloured label of a verdict.
fn verdict_label(verdict: Verdict) -> Markup {
    let class = match verdict {
        Verdict::NotApplicable => "none",
        verdict => verdict.words(),
    };
    html! { span class={ "verdict " (class) } { (verdict.words()) } }
}

fn article(findings: &[Finding], claim: &Claim) -> Markup {
    let class = |line: &Line| {
        let part = if line.whole { "whole" } else { "part" };
        format!("{part} {}", line.verdict.words().replace(' ', "-"))
    };
    html! {
        article id={ "claim-" (claim.number) } {
            h3 { (claim.number) " " (claim.statement) " " small { "[A] " (claim.place) } } "\n"
            @if !claim.words.is_empty() { blockquote { (claim.words) } "\n" }
            p.note { "Criterion: " (claim.criterion) } "\n"
            ul {
                @for line in lines(findings, claim) { li class=(class(&line)) { (line.text) } "\n" }
            } "\n"
        } "\n"
    }
}
