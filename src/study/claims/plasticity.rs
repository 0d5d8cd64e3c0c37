//! The hardness limit (claims 39–43).

use super::words::{interpolated, percent, rises};
use super::{Evidence, Finding};
use crate::report::quantity::number;

/// * Of the cap: rounding.
const CAP: f64 = 1e-9;
/// * Of the load.
const LOAD: f64 = 1e-6;
/// * Share of the cells in contact that makes a plateau.
const PLATEAU: f64 = 0.01;
/// From here on the stiffnesses agree \[cycles\] [A §4d(iii)].
const LATER: f64 = 2e6;
/// * Stiffnesses and rates that are nearly the same.
const SAME: f64 = 0.05;
/// * The initial phase, in which dissipation differs, ends here \[cycles\].
const INITIAL: f64 = 1e5;
/// * About "approximately 2 million cycles" \[cycles\].
const MEET: [f64; 2] = [1.5e6, 4e6];
/// Cycles at which ratios are looked at in a range.
const POINTS: usize = 40;

/// Claims on a rough joint without and with the limit.
pub fn pair(elastic: &Evidence, plastic: &Evidence) -> Vec<Finding> {
    let set = [elastic, plastic];
    let mut findings = Vec::new();
    findings.extend(peaks(set));
    findings.extend(start(set));
    let reached = |n: f64| set.iter().all(|run| super::steps::reaches(run, n));
    if reached(MEET[1]) {
        findings.extend(later(set));
        findings.extend(energies(set));
    }
    findings
}

fn peaks(set: [&Evidence; 2]) -> Option<Finding> {
    let cap = set[1].scene.pressure_cap?;
    let [elastic, plastic] = set.map(|run| run.ends("max_pressure").map(|ends| ends[0]));
    let (elastic, plastic) = (elastic?, plastic?);
    let share = set[1].first.share_at_cap;
    let measured = format!(
        "largest pressure {} MPa elastic, {} MPa plastic; {} of the cells in contact at the cap of {} MPa",
        number(1e-6 * elastic),
        number(1e-6 * plastic),
        percent(share),
        number(1e-6 * cap)
    );
    let holds = elastic > cap && (plastic / cap - 1.0).abs() <= CAP && share > PLATEAU;
    Some(Finding::judged(40, &set, holds, measured))
}

fn start(set: [&Evidence; 2]) -> Option<Finding> {
    let ends = |name| {
        Some(set.map(|run| run.ends(name).map(|ends| ends[0])))
            .and_then(|[elastic, plastic]| Some([elastic?, plastic?]))
    };
    let ([area, larger], [kn, lower]) = (ends("contact_area_fraction")?, ends("kn")?);
    let measured = format!(
        "area {} elastic, {} plastic; kn {} and {} N/µm",
        percent(area),
        percent(larger),
        number(1e-6 * kn),
        number(1e-6 * lower)
    );
    Some(Finding::judged(
        41,
        &set,
        larger > area && lower < kn,
        measured,
    ))
}

/// Smallest and largest of plastic / elastic in a range of cycles.
fn ratios(set: [&Evidence; 2], name: &str, range: [f64; 2]) -> Option<[f64; 2]> {
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    for k in 0..POINTS {
        let at = range[0] + (range[1] - range[0]) * k as f64 / (POINTS - 1) as f64;
        let [elastic, plastic] =
            set.map(|run| Some(interpolated(run.cycles()?, run.column(name)?, at)));
        let ratio = plastic? / elastic?;
        found = [found[0].min(ratio), found[1].max(ratio)];
    }
    Some(found)
}

/// The largest deviation of such ratios from 1.
fn deviation([least, most]: [f64; 2]) -> f64 {
    (most - 1.0).max(1.0 - least)
}

fn later(set: [&Evidence; 2]) -> Option<Finding> {
    let end = set
        .iter()
        .filter_map(|run| run.cycles()?.last().copied())
        .fold(f64::INFINITY, f64::min);
    let found = ratios(set, "kn", [LATER, end])?;
    let measured = format!(
        "plastic over elastic {} to {}",
        number(found[0]),
        number(found[1])
    );
    Some(Finding::judged(
        42,
        &set,
        deviation(found) <= SAME,
        measured,
    ))
}

fn energies(set: [&Evidence; 2]) -> Option<Finding> {
    let early = ratios(set, "dissipated_energy", [0.0, INITIAL])?;
    let meet = ratios(set, "dissipated_energy", MEET)?;
    let measured = format!(
        "plastic over elastic {} to {} before 10⁵ cycles, {} to {} from 1.5 to 4 × 10⁶",
        number(early[0]),
        number(early[1]),
        number(meet[0]),
        number(meet[1])
    );
    let holds = deviation(early) > SAME && deviation(meet) <= SAME;
    Some(Finding::judged(43, &set, holds, measured).because(|| {
        let slides = set.iter().all(|run| {
            let limit = run.scene.sliding_force.unwrap_or(f64::INFINITY);
            run.force.first().is_some_and(|force| *force > 0.99 * limit)
        });
        if deviation(early) <= SAME && slides {
            "both slide nearly as a whole from the first cycle on: dissipation is then µN times slip, whatever the pressure is".to_owned()
        } else {
            String::new()
        }
    }))
}

/// Claim on spheres, that without a limit first, then from the largest limit down.
pub fn spheres(set: &[&Evidence]) -> Finding {
    let found: Option<Vec<[f64; 2]>> = set
        .iter()
        .map(|run| {
            Some([
                run.ends("max_pressure")?[0],
                run.ends("contact_area_fraction")?[0],
            ])
        })
        .collect();
    let Some(found) = found else {
        return Finding::not_applicable(39, set, "no pressure");
    };
    let at_cap = set.iter().zip(&found).all(|(run, [pressure, _])| {
        run.scene
            .pressure_cap
            .is_none_or(|cap| (pressure / cap - 1.0).abs() <= CAP)
    });
    let borne = set
        .iter()
        .all(|run| (run.first.load / run.scene.normal_load - 1.0).abs() <= LOAD);
    let areas: Vec<f64> = found.iter().map(|[_, area]| *area).collect();
    let texts: Vec<String> = found
        .iter()
        .map(|[pressure, area]| format!("{} MPa on {}", number(1e-6 * pressure), percent(*area)))
        .collect();
    Finding::judged(39, set, at_cap && borne && rises(&areas), texts.join(", "))
}
