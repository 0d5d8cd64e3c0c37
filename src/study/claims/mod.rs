//! Claims of the paper, judged by the tables of runs.
//!
//! Each claim is a statement of [A §2–4] that runs can confirm or contradict. A claim names a quantity. A verdict
//! compares the quantity with a stated criterion. If runs in the setting of the paper exist, the verdict uses these
//! runs. Each claim gets one verdict per setting. A verdict on a claim combines the verdicts on the parts of the claim.
//! The report on a failed claim gives the numbers of the claim. If the numbers indicate a cause, the report also gives
//! the likely cause. The role of a run is, for example, roughness, plasticity or the update criterion. The scene of the
//! run determines the role. The name of the folder does not affect the role.

mod bars;
mod catalogue;
mod contact;
mod evidence;
mod figures;
mod form;
mod numbers;
mod plasticity;
mod roles;
mod roughness;
mod setting;
mod steps;
mod updates;
mod vibration;
mod words;
mod write;

use serde::Serialize;

use crate::report::{ReportError, RunTables};

pub use bars::ValueWithBar;
pub use catalogue::{CLAIMS, Claim, Kind};
pub use evidence::{Columns, ElementDistribution, Evidence, HysteresisLoop, Moment, WornSurface};
pub use figures::FIGURES;
pub use form::roughness as formless_roughness;
pub use numbers::{NumberComparison, compare_numbers};
pub use roles::Study;
pub use setting::Setting;
pub use write::{counts, markdown, section, table, write};

/// Verdict on a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The criterion is met.
    Holds,
    /// The criterion is not met.
    Fails,
    /// The claim is undecided. The error bar of the measured quantity is too large for the criterion, or a premise of
    /// the measurement is not met.
    Undecided,
    /// No run measures the claim.
    NotApplicable,
}

impl Verdict {
    /// Returns the verdict on a criterion that is met or not met.
    pub fn of(holds: bool) -> Verdict {
        if holds {
            Verdict::Holds
        } else {
            Verdict::Fails
        }
    }

    /// Combines verdicts. The result is `Fails` if a verdict fails. Otherwise the result is `Undecided` if a verdict
    /// does not hold.
    pub fn all(verdicts: impl IntoIterator<Item = Verdict>) -> Verdict {
        let mut combined = Verdict::Holds;
        for verdict in verdicts {
            combined = match (combined, verdict) {
                (Verdict::Fails, _) | (_, Verdict::Fails) => Verdict::Fails,
                (Verdict::Holds, Verdict::Holds) => Verdict::Holds,
                _ => Verdict::Undecided,
            };
        }
        combined
    }

    /// Combines two verdicts.
    pub fn and(self, other: Verdict) -> Verdict {
        Verdict::all([self, other])
    }
}

/// Verdict on a claim in a setting: on the whole claim, or on some of its runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Number of the claim in [`CLAIMS`].
    pub claim: u32,
    /// Setting, as in [`Study::name`]. Empty if there is no study.
    pub setting: String,
    /// True for the verdict on the whole claim, false for the verdict on one of its parts.
    pub whole: bool,
    /// Names of the evaluated runs.
    pub runs: Vec<String>,
    /// The verdict.
    pub verdict: Verdict,
    /// The measured numbers in words, or the reason why a claim is not applicable.
    pub measured: String,
    /// Likely cause of a failure, from the runs' numbers. The text is empty if the claim holds, or if the numbers
    /// indicate no cause.
    pub cause: String,
}

impl Finding {
    /// Returns the claim.
    pub fn statement(&self) -> &'static Claim {
        CLAIMS
            .iter()
            .find(|claim| claim.number == self.claim)
            .expect("findings are of claims")
    }
}

/// Verdict of one run, or of one set of runs, on a claim.
struct Part {
    runs: Vec<String>,
    /// Label that distinguishes the part. The label is empty if the verdict has only one part.
    of: String,
    verdict: Verdict,
    measured: String,
    cause: String,
}

impl Part {
    fn of(runs: &[&Evidence], verdict: Verdict, measured: String) -> Part {
        let of = match runs {
            [run] => match run.scene.rq {
                Some(rq) => format!("Rq {}", words::micrometres(rq)),
                None => run.name.clone(),
            },
            _ => String::new(),
        };
        Part {
            runs: runs.iter().map(|run| run.name.clone()).collect(),
            of,
            verdict,
            measured,
            cause: String::new(),
        }
    }

    /// Adds a likely cause to a part of a claim, unless the part holds.
    fn with_cause(mut self, cause: impl FnOnce() -> String) -> Part {
        if self.verdict != Verdict::Holds {
            self.cause = cause();
        }
        self
    }
}

/// Judges all claims on runs.
///
/// # Errors
/// [`ReportError`] for a table that cannot be read.
pub fn evaluate(runs: &[RunTables]) -> Result<(Vec<Evidence>, Vec<Finding>), ReportError> {
    let evidence = runs
        .iter()
        .map(Evidence::read)
        .collect::<Result<Vec<_>, _>>()?;
    let findings = judge(&evidence);
    Ok((evidence, findings))
}

/// Returns the studies among the finished runs.
pub fn studies(runs: &[Evidence]) -> Vec<Study<'_>> {
    let done: Vec<&Evidence> = runs.iter().filter(|run| run.done).collect();
    roles::studies(&done)
}

/// Judges all claims. Each claim has a verdict in each setting.
///
/// The findings are sorted by claim, then by setting. The verdict on a claim precedes the verdicts on its parts.
pub fn judge(runs: &[Evidence]) -> Vec<Finding> {
    let studies = studies(runs);
    let unfinished: Vec<&str> = (runs.iter().filter(|run| !run.done))
        .map(|run| run.name.as_str())
        .collect();
    let mut findings = Vec::new();
    for claim in &CLAIMS {
        if studies.is_empty() {
            findings.extend(combined_findings(claim, "", Vec::new(), &unfinished));
        }
        for study in &studies {
            findings.extend(combined_findings(
                claim,
                &study.name,
                parts(claim.number, study),
                &unfinished,
            ));
        }
    }
    findings
}

fn parts(claim: u32, study: &Study) -> Vec<Part> {
    match claim {
        1..=7 | 45 => steps::parts(claim, study),
        8..=14 => roughness::parts(claim, study),
        15..=22 => contact::parts(claim, study),
        29..=33 => updates::parts(claim, study),
        39..=43 => plasticity::parts(claim, study),
        _ => vibration::parts(claim, study),
    }
}

/// Returns the verdict on a claim, and the verdicts on its parts if there are several.
fn combined_findings(
    claim: &Claim,
    setting: &str,
    parts: Vec<Part>,
    unfinished: &[&str],
) -> Vec<Finding> {
    let finding = |whole, runs, verdict, measured, cause| Finding {
        claim: claim.number,
        setting: setting.to_owned(),
        whole,
        runs,
        verdict,
        measured,
        cause,
    };
    let mut parts = parts;
    match parts.len() {
        0 => {
            let mut reason = claim.needs.to_owned();
            if !unfinished.is_empty() {
                reason += &format!("; not finished: {}", unfinished.join(", "));
            }
            vec![finding(
                true,
                Vec::new(),
                Verdict::NotApplicable,
                reason,
                String::new(),
            )]
        }
        1 => {
            let part = parts.remove(0);
            vec![finding(
                true,
                part.runs,
                part.verdict,
                part.measured,
                part.cause,
            )]
        }
        _ => {
            let verdict = Verdict::all(parts.iter().map(|part| part.verdict));
            let mut texts = Vec::new();
            for kind in [Verdict::Holds, Verdict::Fails, Verdict::Undecided] {
                let names: Vec<&str> = (parts.iter().filter(|part| part.verdict == kind))
                    .map(|part| part.of.as_str())
                    .collect();
                if names.len() == parts.len() {
                    texts.push(format!("{} for all of {}", kind.words(), shortened(&names)));
                } else if !names.is_empty() {
                    texts.push(format!("{} for {}", kind.words(), shortened(&names)));
                }
            }
            let runs: Vec<String> = parts.iter().flat_map(|part| part.runs.clone()).collect();
            let mut findings = vec![finding(
                true,
                runs,
                verdict,
                texts.join("; "),
                String::new(),
            )];
            for part in parts {
                let measured = format!("{}: {}", part.of, part.measured);
                findings.push(finding(
                    false,
                    part.runs,
                    part.verdict,
                    measured,
                    part.cause,
                ));
            }
            findings
        }
    }
}

/// Shortens "Rq 0.5 µm, Rq 1 µm" to "Rq 0.5, 1 µm".
fn shortened(names: &[&str]) -> String {
    let numbers: Option<Vec<&str>> = names
        .iter()
        .map(|name| name.strip_prefix("Rq ")?.strip_suffix(" µm"))
        .collect();
    numbers.map_or_else(
        || names.join(", "),
        |numbers| format!("Rq {} µm", numbers.join(", ")),
    )
}
