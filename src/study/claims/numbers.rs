//! Numbers of the paper compared with numbers of runs.

use serde::Serialize;

use super::plasticity::{below_limit, cycles_to_agreement};
use super::steps::{DEPTH_STEP, ITERATIONS, SECONDS, SECONDS_A_CYCLE, STUDY};
use super::updates::agreement;
use super::{Evidence, Study};

/// Number of the paper, and of a study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NumberComparison {
    /// The study.
    pub setting: String,
    /// Description of the number.
    pub what: &'static str,
    /// Place in the paper.
    pub place: &'static str,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// Value in the paper.
    pub paper: f64,
    /// Value of the study, or `None` if the study lacks the runs.
    pub ours: Option<f64>,
}

impl NumberComparison {
    /// Returns the ratio of our value to the paper's. Returns `None` if the paper's is 0, or if ours is missing.
    pub fn ratio(&self) -> Option<f64> {
        let ratio = self.ours? / self.paper;
        (self.paper != 0.0).then_some(ratio)
    }
}

/// Cycles at the end of the paper's run [A §4b].
const CYCLES: f64 = 10_041_928.0;
/// Cycles from which on the update criteria agree [A §4d(i)].
const AGREE: f64 = 1e6;
/// Cycles from which on plastic and elastic wear rates agree [A §4d(iii)].
const MEET: f64 = 2e6;

/// Compares the numbers of the paper with a study.
pub fn compare_numbers(study: &Study) -> Vec<NumberComparison> {
    let is_complete = |run: &&Evidence| super::steps::reaches(run, STUDY);
    let explicit = study.explicit.filter(is_complete);
    let main = study.main.filter(is_complete);
    let iterations = explicit.and_then(|run| {
        let iteration = run.cycles()?.iter().position(|n| *n >= STUDY)?;
        Some(iteration as f64)
    });
    let reached = explicit.and_then(|run| run.cycles()?.last().copied());
    let ends = |name: &str, end: usize| study.main.and_then(|run| run.ends(name)).map(|e| e[end]);
    let rows: [(&str, &str, &str, f64, Option<f64>); 12] = [
        (
            "wear iterations of 0.1 µm to 10⁷ cycles, explicit",
            "4b",
            "",
            ITERATIONS,
            iterations,
        ),
        (
            "average cycles per iteration",
            "4b",
            "",
            CYCLES / ITERATIONS,
            reached.zip(iterations).map(|(n, k)| n / k),
        ),
        (
            "deepest wear, at most",
            "4b",
            "µm",
            1e6 * ITERATIONS * DEPTH_STEP,
            main.and_then(|run| run.deepest_wear())
                .map(|bar| 1e6 * bar.value),
        ),
        (
            "time per iteration",
            "4b",
            "s",
            SECONDS_A_CYCLE,
            explicit.zip(iterations).map(|(run, k)| run.seconds / k),
        ),
        (
            "total time",
            "4b",
            "s",
            SECONDS,
            explicit.map(|run| run.seconds),
        ),
        (
            "mean normal load at resonance",
            "4a",
            "kN",
            30.0,
            study
                .main
                .and_then(|run| run.first.normal_load)
                .map(|[mean, _]| 1e-3 * mean),
        ),
        ("unworn skewness", "4b", "", 0.0, ends("sk", 0)),
        ("unworn kurtosis", "4b", "", 3.0, ends("ku", 0)),
        (
            "largest unworn pressure with the hardness limit",
            "4d(iii)",
            "MPa",
            600.0,
            study
                .plastic
                .filter(|set| below_limit(*set).is_none())
                .and_then(|[_, plastic]| plastic.ends("max_pressure"))
                .map(|e| 1e-6 * e[0]),
        ),
        (
            "cycles until the update criteria agree in their wear rates (within 5 %*)",
            "4d(i)",
            "million",
            1e-6 * AGREE,
            agreement(&study.updated).map(|n| 1e-6 * n),
        ),
        (
            "cycles until plastic and elastic joint agree in their wear rates (within 5 %*)",
            "4d(iii)",
            "million",
            1e-6 * MEET,
            study
                .plastic
                .and_then(cycles_to_agreement)
                .map(|n| 1e-6 * n),
        ),
        (
            "cycles to the steady state, at most",
            "4",
            "million",
            1e-6 * STUDY,
            main.and_then(steady_from).map(|n| 1e-6 * n),
        ),
    ];
    rows.into_iter()
        .map(|(what, place, unit, paper, ours)| NumberComparison {
            setting: study.name.clone(),
            what,
            place,
            unit,
            paper,
            ours,
        })
        .collect()
}

/// * Largest relative change of the dissipation per 10⁶ cycles in a steady state.
const STEADY: f64 = 0.05;

/// Returns the number of cycles after which the dissipation is steady. The dissipation is steady if it changes by at
/// most 5 %* per 10⁶ cycles between iterations. Returns `None` if the dissipation never becomes steady.
fn steady_from(run: &Evidence) -> Option<f64> {
    let (cycles, energy) = (run.cycles()?, run.column("dissipated_energy")?);
    let is_fast = |k: usize| {
        let change = (energy[k] - energy[k - 1]).abs() / energy[k];
        change / (cycles[k] - cycles[k - 1]) * 1e6 > STEADY
    };
    match (1..cycles.len()).rev().find(|k| is_fast(*k)) {
        None => cycles.first().copied(),
        Some(k) if k + 1 < cycles.len() => Some(cycles[k]),
        Some(_) => None,
    }
}
