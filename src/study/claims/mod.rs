//! What the paper claims, held against the tables of runs.
//!
//! Every statement of [A §2–4] that runs can confirm or contradict is measured on the quantity that its sentence names, in the paper's own
//! setting where there are such runs, and judged by a criterion that stands beside it: one verdict a claim and setting, with the verdicts
//! on single runs behind it. A claim that does not hold is a result like one that does, with its numbers and, where the runs' own numbers
//! point to one, a likely cause. Which run plays which part (roughness, plasticity, update criterion) is read from its scene, never from
//! the name of its folder.

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

pub use bars::Bar;
pub use catalogue::{CLAIMS, Claim, Kind};
pub use evidence::{Columns, ElementDistribution, Evidence, HysteresisLoop, Moment, WornSurface};
pub use figures::FIGURES;
pub use form::roughness as formless_roughness;
pub use numbers::{NumberComparison, beside};
pub use roles::Study;
pub use setting::Setting;
pub use write::{counts, markdown, section, table, write};

/// What a measurement says of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The criterion is met.
    Holds,
    /// It is not.
    Fails,
    /// Its error bar, or what it rests on, leaves both open.
    Undecided,
    /// There is no run that it can be measured on.
    NotApplicable,
}

impl Verdict {
    /// That of a criterion that is met, or is not.
    pub fn of(holds: bool) -> Verdict {
        if holds {
            Verdict::Holds
        } else {
            Verdict::Fails
        }
    }

    /// That of all of several: one that fails decides, then one that is undecided.
    pub fn all(verdicts: impl IntoIterator<Item = Verdict>) -> Verdict {
        let mut found = Verdict::Holds;
        for verdict in verdicts {
            found = match (found, verdict) {
                (Verdict::Fails, _) | (_, Verdict::Fails) => Verdict::Fails,
                (Verdict::Holds, Verdict::Holds) => Verdict::Holds,
                _ => Verdict::Undecided,
            };
        }
        found
    }

    /// That of both.
    pub fn and(self, other: Verdict) -> Verdict {
        Verdict::all([self, other])
    }
}

/// A claim judged in a setting: as a whole, or on some of its runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Number of the claim in [`CLAIMS`].
    pub claim: u32,
    /// The setting, as [`Study::name`] has it; empty where there is none.
    pub setting: String,
    /// True for the verdict on the claim, false for that on one of the parts that it is put together of.
    pub whole: bool,
    /// Names of the runs that were looked at.
    pub runs: Vec<String>,
    /// The verdict.
    pub verdict: Verdict,
    /// The numbers behind it in words; the reason of a claim that is not applicable.
    pub measured: String,
    /// What the runs' numbers say of why it fails; empty if they say nothing, and of a claim that holds.
    pub cause: String,
}

impl Finding {
    /// The claim.
    pub fn statement(&self) -> &'static Claim {
        CLAIMS
            .iter()
            .find(|claim| claim.number == self.claim)
            .expect("findings are of claims")
    }
}

/// What one run, or one set of runs, says of a claim.
struct Part {
    runs: Vec<String>,
    /// What tells it from the other parts; empty where there is one only.
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

    /// The part with a likely cause, unless it holds.
    fn because(mut self, cause: impl FnOnce() -> String) -> Part {
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
        .map(Evidence::of)
        .collect::<Result<Vec<_>, _>>()?;
    let findings = judge(&evidence);
    Ok((evidence, findings))
}

/// The studies among runs that are done.
pub fn studies(runs: &[Evidence]) -> Vec<Study<'_>> {
    let done: Vec<&Evidence> = runs.iter().filter(|run| run.done).collect();
    roles::studies(&done)
}

/// Judges all claims: sorted by number, then by setting; the verdict on a claim before those on its parts. Every claim has a verdict in
/// every setting.
pub fn judge(runs: &[Evidence]) -> Vec<Finding> {
    let studies = studies(runs);
    let unfinished: Vec<&str> = (runs.iter().filter(|run| !run.done))
        .map(|run| run.name.as_str())
        .collect();
    let mut findings = Vec::new();
    for claim in &CLAIMS {
        if studies.is_empty() {
            findings.extend(together(claim, "", Vec::new(), &unfinished));
        }
        for study in &studies {
            findings.extend(together(
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

/// The verdict on a claim, and on its parts where there are several.
fn together(claim: &Claim, setting: &str, parts: Vec<Part>, unfinished: &[&str]) -> Vec<Finding> {
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
            for one in [Verdict::Holds, Verdict::Fails, Verdict::Undecided] {
                let same: Vec<&str> = (parts.iter().filter(|part| part.verdict == one))
                    .map(|part| part.of.as_str())
                    .collect();
                if same.len() == parts.len() {
                    texts.push(format!("{} for all of {}", one.words(), shortened(&same)));
                } else if !same.is_empty() {
                    texts.push(format!("{} for {}", one.words(), shortened(&same)));
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

/// "Rq 0.5 µm, Rq 1 µm" as "Rq 0.5, 1 µm".
fn shortened(names: &[&str]) -> String {
    let bare: Option<Vec<&str>> = names
        .iter()
        .map(|name| name.strip_prefix("Rq ")?.strip_suffix(" µm"))
        .collect();
    bare.map_or_else(
        || names.join(", "),
        |bare| format!("Rq {} µm", bare.join(", ")),
    )
}
