//! What the paper claims, held against the tables of runs.
//!
//! Every statement of [A §2–4] that a run, or a set of runs, can confirm or contradict is measured and judged by a criterion that
//! stands beside it. A claim that does not hold is a result like one that does, with its numbers and, where the runs' own numbers
//! point to one, a likely cause. Which run plays which part (roughness, plasticity, update criterion) is read from its scene,
//! never from the name of its folder.

mod catalogue;
mod contact;
mod evidence;
mod plasticity;
mod roughness;
mod sets;
mod setting;
mod steps;
mod updates;
mod vibration;
mod words;
mod write;

use serde::Serialize;

use crate::report::{ReportError, RunTables};

pub use catalogue::{CLAIMS, Claim};
pub use evidence::{Columns, Evidence, Loop, Moment, Worn};
pub use setting::Setting;
pub use write::{markdown, section, table, write};

/// What a measurement says of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The criterion is met.
    Holds,
    /// It is not.
    Fails,
    /// These runs cannot tell.
    NotApplicable,
}

/// A claim judged on a run, or on a set of runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Number of the claim in [`CLAIMS`].
    pub claim: u32,
    /// Names of the runs that were looked at, those of a set together.
    pub runs: Vec<String>,
    /// The verdict.
    pub verdict: Verdict,
    /// The numbers behind it in words; the reason of a claim that is not applicable.
    pub measured: String,
    /// What the runs' numbers say of why it fails; empty if they say nothing, and of a claim that does not fail.
    pub cause: String,
}

impl Finding {
    fn not_applicable(claim: u32, runs: &[&Evidence], reason: impl Into<String>) -> Finding {
        Finding {
            claim,
            runs: runs.iter().map(|run| run.name.clone()).collect(),
            verdict: Verdict::NotApplicable,
            measured: reason.into(),
            cause: String::new(),
        }
    }

    fn judged(claim: u32, runs: &[&Evidence], holds: bool, measured: String) -> Finding {
        Finding {
            verdict: if holds {
                Verdict::Holds
            } else {
                Verdict::Fails
            },
            ..Finding::not_applicable(claim, runs, measured)
        }
    }

    /// The same with a likely cause, if it fails.
    fn because(mut self, cause: impl FnOnce() -> String) -> Finding {
        if self.verdict == Verdict::Fails {
            self.cause = cause();
        }
        self
    }

    /// The claim.
    pub fn statement(&self) -> &'static Claim {
        CLAIMS
            .iter()
            .find(|claim| claim.number == self.claim)
            .expect("findings are of claims")
    }
}

/// Judges all claims on runs, each alone and those that belong together.
///
/// # Errors
/// [`ReportError`] for a table that cannot be read.
pub fn evaluate(runs: &[RunTables]) -> Result<Vec<Finding>, ReportError> {
    let evidence = runs
        .iter()
        .map(Evidence::of)
        .collect::<Result<Vec<_>, _>>()?;
    Ok(judge(&evidence))
}

/// Judges all claims: sorted by number, then in the order of the runs. Every claim has a finding.
pub fn judge(runs: &[Evidence]) -> Vec<Finding> {
    let done: Vec<&Evidence> = runs.iter().filter(|run| run.done).collect();
    let mut findings = Vec::new();
    for run in &done {
        findings.extend(steps::single(run));
        findings.extend(roughness::single(run));
        findings.extend(contact::single(run));
        findings.extend(vibration::single(run));
        findings.extend(updates::single(run));
    }
    for set in sets::by_roughness(&done) {
        findings.extend(contact::by_roughness(&set));
        findings.extend(vibration::by_roughness(&set));
    }
    for set in sets::by_update(&done) {
        findings.extend(updates::by_update(&set));
    }
    for [elastic, plastic] in sets::plastic_pairs(&done) {
        findings.extend(plasticity::pair(elastic, plastic));
    }
    for set in sets::capped_spheres(&done) {
        findings.push(plasticity::spheres(&set));
    }
    for [few, many] in sets::by_harmonics(&done) {
        findings.push(vibration::harmonics(few, many));
    }
    let unfinished: Vec<&str> = runs
        .iter()
        .filter(|run| !run.done)
        .map(|run| run.name.as_str())
        .collect();
    for claim in CLAIMS {
        if findings.iter().all(|finding| finding.claim != claim.number) {
            let mut reason = claim.needs.to_owned();
            if !unfinished.is_empty() {
                reason += &format!("; not finished: {}", unfinished.join(", "));
            }
            findings.push(Finding::not_applicable(claim.number, &[], reason));
        }
    }
    findings.sort_by_key(|finding| finding.claim);
    merged(findings)
}

/// Runs that cannot tell for the same reason share a finding.
fn merged(findings: Vec<Finding>) -> Vec<Finding> {
    let mut merged: Vec<Finding> = Vec::new();
    for finding in findings {
        let same = merged.iter_mut().find(|earlier| {
            finding.verdict == Verdict::NotApplicable
                && (earlier.claim, earlier.verdict, &earlier.measured)
                    == (finding.claim, finding.verdict, &finding.measured)
        });
        match same {
            Some(earlier) => earlier.runs.extend(finding.runs),
            None => merged.push(finding),
        }
    }
    merged
}
