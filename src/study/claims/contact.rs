//! Area, pressure and stiffness of the contact (claims 15–22).

use super::steps::{STUDY, reaches};
use super::words::{interpolated, list, never_falls, percent, spread};
use super::{Evidence, Finding};
use crate::report::quantity::number;

/// * Fall of the area that counts as none, of the area.
const FALL: f64 = 0.01;
/// * Slope at first over slope at last, of what rises fast and then slowly.
const FAST: f64 = 5.0;
/// * R² of what is nearly linear.
const LINEAR: f64 = 0.95;
/// Points at which a line is fitted.
const POINTS: usize = 200;
/// Cycles of running-in, and from which on it is over*.
const EARLY: f64 = 1e5;
const LATE: f64 = 5e6;
/// * What a spread shrinks to, where runs converge.
pub const CONVERGED: f64 = 1.0 / 3.0;
/// * Deviation of kt/kn from that of a smooth, sticking contact.
const RATIO: f64 = 0.1;
/// A cell that dissipates less than this share of the most, sticks.
const STICKS: f64 = 1e-3;

/// Claims on one run.
pub fn single(run: &Evidence) -> Vec<Finding> {
    let mut findings = Vec::new();
    let (Some(cycles), Some(_)) = (run.cycles(), run.scene.rq) else {
        return findings;
    };
    findings.extend(area(run));
    findings.extend(pressure(run));
    if reaches(run, STUDY) {
        findings.extend(running_in(run, cycles, 19, "kn"));
        findings.extend(tangential(run, cycles));
    }
    findings.extend(local(run));
    findings
}

fn area(run: &Evidence) -> Option<Finding> {
    let area = run.column("contact_area_fraction")?;
    let [first, last] = run.ends("contact_area_fraction")?;
    let grows = area
        .windows(2)
        .all(|pair| pair[1] >= (1.0 - FALL) * pair[0]);
    let measured = format!("{} → {} of the joint", percent(first), percent(last));
    Some(Finding::judged(15, &[run], grows && last > first, measured))
}

fn pressure(run: &Evidence) -> Option<Finding> {
    let [first, last] = run.ends("max_pressure")?;
    let [high, low] = [run.first.high_pressure, run.last.high_pressure];
    let measured = format!(
        "largest {} → {} MPa, 99 % of the cells in contact below {} → {} MPa",
        number(1e-6 * first),
        number(1e-6 * last),
        number(1e-6 * high),
        number(1e-6 * low)
    );
    let finding = Finding::judged(16, &[run], last < first && low < high, measured);
    Some(finding.because(|| {
        let share = run.last.peak_dissipation;
        if share < STICKS {
            format!("the cell under the largest pressure sticks (it dissipates {share:.1e} of the most): it does not wear while its surroundings do, so that it carries ever more; a hardness limit would flatten it")
        } else {
            String::new()
        }
    }))
}

/// Slope at first over slope at last; kn or kt.
fn running_in(run: &Evidence, cycles: &[f64], claim: u32, name: &str) -> Option<Finding> {
    let values = run.column(name)?;
    let at = |n: f64| interpolated(cycles, values, n);
    let early = (at(EARLY) - values[0]) / EARLY;
    let late = (at(STUDY) - at(LATE)) / (STUDY - LATE);
    // A stiffness that no longer changes is slow enough.
    let rounding = 1e-9 * values[0] / (STUDY - LATE);
    let holds = early > FAST * late.max(0.0) && late >= -rounding;
    let measured = format!(
        "{} → {} N/µm, slope {} N/µm per 10⁶ cycles to 10⁵ cycles, {} after 5 × 10⁶",
        number(1e-6 * values[0]),
        number(1e-6 * values[values.len() - 1]),
        number(early),
        number(late)
    );
    Some(Finding::judged(claim, &[run], holds, measured))
}

fn tangential(run: &Evidence, cycles: &[f64]) -> Option<Finding> {
    let mut finding = running_in(run, cycles, 21, "kt")?;
    let (kn, kt) = (run.ends("kn")?, run.ends("kt")?);
    let ratio = kt[1] / kn[1];
    finding.measured += &format!("; kt/kn {} → {}", number(kt[0] / kn[0]), number(ratio));
    if let Some(nu) = run.scene.poisson_ratio {
        let stuck = 2.0 * (1.0 - nu) / (2.0 - nu);
        finding.measured += &format!(", sticking and smooth {}", number(stuck));
        if (ratio / stuck - 1.0).abs() > RATIO {
            finding.verdict = super::Verdict::Fails;
        }
    }
    Some(finding)
}

fn local(run: &Evidence) -> Option<Finding> {
    if !run.scene.tangent {
        return None;
    }
    let median = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let (first, last) = (
        median(&run.first.element_kn)?,
        median(&run.last.element_kn)?,
    );
    let [before, after] = run.ends("kn")?;
    let measured = format!(
        "median of the loaded elements {} → {} N/µm, joint {} → {} N/µm",
        number(1e-6 * first),
        number(1e-6 * last),
        number(1e-6 * before),
        number(1e-6 * after)
    );
    Some(Finding::judged(
        22,
        &[run],
        last < first && after > before,
        measured,
    ))
}

/// Claims on runs of different roughness, smoothest first.
pub fn by_roughness(set: &[&Evidence]) -> Vec<Finding> {
    let mut findings = Vec::new();
    findings.extend(areas(set));
    findings.extend(shapes(set));
    findings.extend(converge(set, 20, "kn"));
    findings.extend(converge(set, 21, "kt"));
    findings
}

fn firsts(set: &[&Evidence], name: &str) -> Option<[Vec<f64>; 2]> {
    let ends: Option<Vec<[f64; 2]>> = set.iter().map(|run| run.ends(name)).collect();
    let ends = ends?;
    Some([0, 1].map(|end| ends.iter().map(|pair| pair[end]).collect()))
}

/// Roughnesses of a set in words.
pub fn roughnesses(set: &[&Evidence]) -> String {
    let rq = set.iter().filter_map(|run| run.scene.rq);
    format!("Rq {} µm", list(rq.map(|rq| 1e6 * rq)))
}

fn areas(set: &[&Evidence]) -> Option<Finding> {
    let [first, _] = firsts(set, "contact_area_fraction")?;
    let falling: Vec<f64> = first.iter().map(|area| -area).collect();
    let measured = format!(
        "{}: {} %",
        roughnesses(set),
        list(first.iter().map(|area| 100.0 * area))
    );
    Some(Finding::judged(
        17,
        set,
        super::words::rises(&falling),
        measured,
    ))
}

fn shapes(set: &[&Evidence]) -> Option<Finding> {
    let (smooth, rough) = (set[0], set[set.len() - 1]);
    let curve = |run: &Evidence| -> Option<Vec<f64>> {
        let (cycles, area) = (run.cycles()?, run.column("contact_area_fraction")?);
        let end = cycles[cycles.len() - 1];
        let at = |k: usize| end * k as f64 / (POINTS - 1) as f64;
        Some(
            (0..POINTS)
                .map(|k| interpolated(cycles, area, at(k)))
                .collect(),
        )
    };
    let (smoothest, roughest) = (curve(smooth)?, curve(rough)?);
    let [tenth, half] = [POINTS / 10, POINTS / 2];
    let early = (smoothest[tenth] - smoothest[0]) / tenth as f64;
    let late = (smoothest[POINTS - 1] - smoothest[half]) / (POINTS - 1 - half) as f64;
    let asymptotic = early > FAST * late.max(0.0);
    let fit = r_squared(&roughest);
    let measured = format!(
        "smoothest: slope {} of the joint per 10 % of the cycles at first, {} at last; roughest: R² {} of a line",
        percent(early * tenth as f64),
        percent(late * tenth as f64),
        number(fit)
    );
    Some(Finding::judged(
        18,
        set,
        asymptotic && fit > LINEAR,
        measured,
    ))
}

/// R² of the best line through values at equal distances.
fn r_squared(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let [mid, mean] = [0.5 * (n - 1.0), values.iter().sum::<f64>() / n];
    let [mut sxx, mut sxy, mut syy] = [0.0; 3];
    for (k, value) in values.iter().enumerate() {
        let [x, y] = [k as f64 - mid, value - mean];
        sxx += x * x;
        sxy += x * y;
        syy += y * y;
    }
    sxy * sxy / (sxx * syy)
}

fn converge(set: &[&Evidence], claim: u32, name: &str) -> Option<Finding> {
    let [first, last] = firsts(set, name)?;
    let [before, after] = [spread(&first), spread(&last)];
    let measured = format!(
        "{}: {name} {} → {} N/µm, spread {} → {}",
        roughnesses(set),
        list(first.iter().map(|k| 1e-6 * k)),
        list(last.iter().map(|k| 1e-6 * k)),
        percent(before),
        percent(after)
    );
    Some(
        Finding::judged(claim, set, after <= CONVERGED * before, measured).because(|| {
            let still: Vec<String> = set
                .iter()
                .filter(|run| {
                    run.column(name)
                        .is_some_and(|k| never_falls(k, 0.0) && k[k.len() - 1] < 0.95 * last[0])
                })
                .map(|run| run.name.clone())
                .collect();
            if still.is_empty() {
                String::new()
            } else {
                format!("still rising: {}", still.join(", "))
            }
        }),
    )
}
