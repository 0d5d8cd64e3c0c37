//! Updates of the dynamic model (claims 29–33).

use super::words::{interpolated, list, percent};
use super::{Evidence, Finding};

/// * Fall of the dissipation at an update that is one.
const JUMP: f64 = 0.01;
/// From here on the criteria agree \[cycles\] [A §4d(i)].
const AGREE: f64 = 1e6;
/// * Rates that are nearly the same: well, and barely.
const RATES: [f64; 2] = [0.05, 0.1];
/// * Stiffnesses that hardly depend on the updates.
const STIFFNESS: f64 = 0.03;
/// * Responses that are identical: frequency, peak.
const RESPONSE: [f64; 2] = [1e-3, 0.02];
/// Cycles at which curves are compared, on a logarithmic scale.
const POINTS: usize = 40;
/// The first of them.
const FIRST: f64 = 1e4;

/// Claims on one run.
pub fn single(run: &Evidence) -> Vec<Finding> {
    let found = || -> Option<Finding> {
        let (updated, energy) = (run.column("updated")?, run.column("dissipated_energy")?);
        let cycles = run.cycles()?;
        let at: Vec<usize> = (1..updated.len()).filter(|&k| updated[k] > 0.0).collect();
        if at.is_empty() {
            let reason = if run.scene.update == "never" {
                "never updated, as the scene says"
            } else {
                "the criterion never called for an update: kn and kt changed too little"
            };
            return Some(Finding::not_applicable(29, &[run], reason));
        }
        let jumps: Vec<f64> = at
            .iter()
            .map(|&k| energy[k] / energy[k - 1] - 1.0)
            .collect();
        let texts: Vec<String> = at
            .iter()
            .zip(&jumps)
            .map(|(&k, jump)| format!("{} at {:.0} cycles", percent(*jump), cycles[k]))
            .collect();
        let holds = jumps.iter().all(|jump| *jump < -JUMP);
        Some(Finding::judged(29, &[run], holds, texts.join(", ")))
    };
    found().into_iter().collect()
}

/// Cycles from `first` to `last`, evenly on a logarithmic scale.
fn cycles(first: f64, last: f64) -> Vec<f64> {
    let ratio = (last / first).ln() / (POINTS - 1) as f64;
    (0..POINTS)
        .map(|k| first * (ratio * k as f64).exp())
        .collect()
}

/// Largest relative difference of a column between two runs at these cycles.
fn apart(a: &Evidence, b: &Evidence, column: &str, at: &[f64]) -> Option<f64> {
    let curve = |run: &Evidence| -> Option<Vec<f64>> {
        let (cycles, values) = (run.cycles()?, run.column(column)?);
        Some(
            at.iter()
                .map(|n| interpolated(cycles, values, *n))
                .collect(),
        )
    };
    let (a, b) = (curve(a)?, curve(b)?);
    Some(
        a.iter()
            .zip(&b)
            .map(|(a, b)| (a / b - 1.0).abs())
            .fold(0.0, f64::max),
    )
}

/// The runs, each with each.
fn pairs<'a>(set: &[&'a Evidence]) -> Vec<(&'a Evidence, &'a Evidence)> {
    let mut pairs = Vec::new();
    for (k, &a) in set.iter().enumerate() {
        pairs.extend(set[k + 1..].iter().map(|&b| (a, b)));
    }
    pairs
}

fn criterion(run: &Evidence) -> String {
    run.scene
        .stiffness_change
        .map_or_else(|| run.scene.update.clone(), percent)
}

/// Claims on runs of different criteria, the finest first and none last.
pub fn by_update(set: &[&Evidence]) -> Vec<Finding> {
    let end = set
        .iter()
        .filter_map(|run| run.cycles()?.last().copied())
        .fold(f64::INFINITY, f64::min);
    let mut findings = Vec::new();
    let updating: Vec<&Evidence> = set
        .iter()
        .copied()
        .filter(|run| run.scene.update != "never")
        .collect();
    if end.is_finite() {
        if end > AGREE {
            findings.extend(rates(&updating, end));
        }
        findings.extend(stiffness(set, end));
    }
    findings.extend(responses(&updating, 32, &pairs(&updating)));
    let never = set.iter().find(|run| run.scene.update == "never");
    if let (Some(never), Some(finest)) = (never, updating.first()) {
        findings.extend(responses(&[finest, never], 33, &[(finest, never)]));
    }
    findings
}

fn differences(
    pairs: &[(&Evidence, &Evidence)],
    of: impl Fn(&Evidence, &Evidence) -> Option<f64>,
) -> Option<(Vec<f64>, String)> {
    let all: Vec<f64> = pairs.iter().map(|(a, b)| of(a, b)).collect::<Option<_>>()?;
    let texts: Vec<String> = pairs
        .iter()
        .zip(&all)
        .map(|((a, b), difference)| {
            format!(
                "{} against {}: {}",
                criterion(a),
                criterion(b),
                percent(*difference)
            )
        })
        .collect();
    Some((all, texts.join(", ")))
}

/// How far the runs differ in what drives them in the end.
fn amplitudes(set: &[&Evidence]) -> String {
    let last = |run: &&Evidence| run.response.get("displacement_amplitude")?.last().copied();
    let all: Option<Vec<f64>> = set.iter().map(last).collect();
    let Some(all) = all else {
        return String::new();
    };
    let updates: Vec<String> = set.iter().map(|run| run.updates().to_string()).collect();
    let mut text = format!(
        "updated {} times; the relative displacement in the end is {} µm: each criterion freezes it at the state of its last update",
        updates.join(", "),
        list(all.iter().map(|u| 1e6 * u))
    );
    let spread = set
        .iter()
        .filter_map(|run| run.response.get("displacement_spread")?.last().copied())
        .fold(0.0, f64::max);
    if spread > RATES[1] {
        text += &format!(
            ", and single elements move by up to {} more or less than the mean that drives the fine contact",
            percent(spread)
        );
    }
    text
}

fn rates(set: &[&Evidence], end: f64) -> Option<Finding> {
    let pairs = pairs(set);
    if pairs.is_empty() {
        return None;
    }
    let at = cycles(AGREE, end);
    let (all, mut measured) = differences(&pairs, |a, b| apart(a, b, "wear_rate", &at))?;
    let most = all.iter().copied().fold(0.0, f64::max);
    if most <= RATES[1] {
        measured += if most <= RATES[0] {
            " (well)"
        } else {
            " (barely)"
        };
    }
    Some(Finding::judged(30, set, most <= RATES[1], measured).because(|| amplitudes(set)))
}

fn stiffness(set: &[&Evidence], end: f64) -> Option<Finding> {
    let at = cycles(FIRST.min(0.1 * end), end);
    let (all, measured) = differences(&pairs(set), |a, b| apart(a, b, "kn", &at))?;
    Some(Finding::judged(
        31,
        set,
        all.iter().all(|d| *d <= STIFFNESS),
        measured,
    ))
}

fn responses(set: &[&Evidence], claim: u32, pairs: &[(&Evidence, &Evidence)]) -> Option<Finding> {
    if pairs.is_empty() {
        return None;
    }
    let of = |name: &'static str| {
        move |a: &Evidence, b: &Evidence| {
            Some((a.worn_ends(name)?[1] / b.worn_ends(name)?[1] - 1.0).abs())
        }
    };
    let (frequency, f_text) = differences(pairs, of("peak_frequency"))?;
    let (peak, p_text) = differences(pairs, of("peak_amplitude"))?;
    let holds =
        frequency.iter().all(|d| *d <= RESPONSE[0]) && peak.iter().all(|d| *d <= RESPONSE[1]);
    let measured = format!("frequency: {f_text}; peak: {p_text}");
    Some(Finding::judged(claim, set, holds, measured).because(|| amplitudes(set)))
}
