//! The worn surface (claims 8–14).

use std::f64::consts::PI;

use super::steps::explicit_steps;
use super::words::{interpolated, never_falls, percent};
use super::{Evidence, Finding};
use crate::report::quantity::number;

/// * Rise of Rq that counts as none, of Rq.
const RISE: f64 = 1e-4;
/// * Between the mean height and the worn volume.
const MEAN: f64 = 1e-9;
/// * Skewness of what counts as symmetric.
const SYMMETRIC: f64 = 0.1;
/// * Deviation from a kurtosis of 3 that counts as none.
const NORMAL: f64 = 0.2;
/// Kurtosis of a Gaussian surface.
const GAUSSIAN: f64 = 3.0;
/// * "Only a few" steps.
const FEW: f64 = 10.0;
/// * Standard deviations of the skewness.
const SIGNIFICANT: f64 = 3.0;
/// Up to this roughness the paper's steps are a tenth \[m\] [A §4a].
const SMOOTH: f64 = 1e-6;
/// * Changes that are strong: of Rq, relative, and of Sk and Ku.
const STRONG: [f64; 3] = [0.05, 0.1, 0.1];
/// From this roughness on \[m\], a smaller change of Rq counts*.
const ROUGH: f64 = 10e-6;
/// * That change.
const LESS: f64 = 0.01;

/// Claims on one run.
pub fn single(run: &Evidence) -> Vec<Finding> {
    let mut findings = Vec::new();
    let Some(cycles) = run.cycles() else {
        return findings;
    };
    findings.extend(valleys(run));
    if run.scene.rq.is_none() {
        return findings;
    }
    let columns = (run.column("rq"), run.column("sk"), run.column("ku"));
    let (Some(rq), Some(sk), Some(ku)) = columns else {
        return findings;
    };
    findings.extend([
        falls(run, rq),
        skewness(run, sk),
        kurtosis(run, ku),
        strong(run, rq, sk, ku),
    ]);
    findings.extend(mean(run));
    findings.extend(few(run, cycles, sk));
    findings
}

fn valleys(run: &Evidence) -> Option<Finding> {
    let worn = run.worn.as_ref()?;
    let measured = format!(
        "{} cells never touched, worn by {} µm at most; deepest wear {} µm",
        worn.never_touched,
        number(1e6 * worn.never_touched_depth),
        number(1e6 * worn.deepest)
    );
    if worn.never_touched == 0 {
        return Some(Finding::not_applicable(
            8,
            &[run],
            "no cell is left that never touched",
        ));
    }
    let holds = worn.never_touched_depth == 0.0 && worn.deepest > 0.0;
    Some(Finding::judged(8, &[run], holds, measured).because(|| {
        if run.scene.explicit.is_none() && worn.deepest > 0.0 {
            "the steps are not explicit: within one a cell may touch that does not at its ends"
                .to_owned()
        } else {
            String::new()
        }
    }))
}

/// The worn form where more is removed than the surface is rough: what then changes is no longer its roughness.
fn form(run: &Evidence) -> String {
    let (Some(heights), Some(rq)) = (run.ends("mean_height"), run.scene.rq) else {
        return String::new();
    };
    let removed = (heights[0] - heights[1]) / rq;
    if removed > 1.0 {
        format!(
            "{} Rq are worn away on average, deepest where the rigid patch carries most: what the statistics see in the end is the worn form, not the roughness",
            number(removed)
        )
    } else if removed < 0.13 {
        // Clipping a Gaussian surface: Ku is back at 3 where 0.13 Rq are removed on average.
        format!(
            "only {} Rq are worn away on average; flat clipping of a Gaussian surface first lowers Ku",
            number(removed)
        )
    } else {
        String::new()
    }
}

fn falls(run: &Evidence, rq: &[f64]) -> Finding {
    let [first, last] = [rq[0], rq[rq.len() - 1]];
    let falling: Vec<f64> = rq.iter().map(|rq| -rq / first).collect();
    let least = rq.iter().copied().fold(f64::INFINITY, f64::min);
    let measured = format!(
        "{} µm → {} µm, least {} µm",
        number(1e6 * first),
        number(1e6 * last),
        number(1e6 * least)
    );
    let holds = never_falls(&falling, RISE) && last < first;
    Finding::judged(9, &[run], holds, measured).because(|| form(run))
}

fn mean(run: &Evidence) -> Option<Finding> {
    let (heights, volumes) = (run.column("mean_height")?, run.column("wear_volume")?);
    let area = run.area?;
    let removed = volumes[volumes.len() - 1] / area;
    let off = heights
        .iter()
        .zip(volumes)
        .map(|(height, volume)| (heights[0] - height - volume / area).abs());
    let worst = off.fold(0.0, f64::max) / removed;
    let falling: Vec<f64> = heights.iter().map(|height| -height).collect();
    let measured = format!(
        "fell by {} µm, {worst:.1e} off volume / area",
        number(1e6 * removed)
    );
    let holds = worst <= MEAN && never_falls(&falling, 0.0);
    Some(Finding::judged(10, &[run], holds, measured))
}

fn skewness(run: &Evidence, sk: &[f64]) -> Finding {
    let [first, last] = [sk[0], sk[sk.len() - 1]];
    let least = sk.iter().copied().fold(f64::INFINITY, f64::min);
    let measured = format!(
        "{} → {}, least {}",
        number(first),
        number(last),
        number(least)
    );
    let holds = first.abs() < SYMMETRIC && last < -SYMMETRIC;
    Finding::judged(11, &[run], holds, measured).because(|| form(run))
}

fn kurtosis(run: &Evidence, ku: &[f64]) -> Finding {
    let [first, last] = [ku[0], ku[ku.len() - 1]];
    let least = ku.iter().copied().fold(f64::INFINITY, f64::min);
    let most = ku.iter().copied().fold(0.0, f64::max);
    let measured = format!(
        "{} → {}, on the way {} to {}; the dip is no part of the claim",
        number(first),
        number(last),
        number(least),
        number(most)
    );
    let holds = (first - GAUSSIAN).abs() < NORMAL && last > GAUSSIAN;
    Finding::judged(12, &[run], holds, measured).because(|| form(run))
}

/// Skewness after ten steps of the paper, against what surfaces of this size scatter by.
fn few(run: &Evidence, cycles: &[f64], sk: &[f64]) -> Option<Finding> {
    let [clx, cly] = run.scene.correlation_length?;
    let area = run.area?;
    // Variance 6 / (independent cells), A / ∫ρ³ of them; ∫ρ³ = π clx cly / 3 for ρ = exp(−(x²/clx² + y²/cly²)).
    let sigma = (2.0 * PI * clx * cly / area).sqrt();
    let steps = explicit_steps(run)?;
    let tenth = run.scene.rq? <= SMOOTH * (1.0 + 1e-9);
    let few = if tenth { 0.1 * FEW } else { FEW };
    if steps[steps.len() - 1] < few {
        return Some(Finding::not_applicable(
            13,
            &[run],
            "wears by less than ten steps",
        ));
    }
    let at = interpolated(&steps, cycles, few);
    let found = interpolated(cycles, sk, at);
    let measured = format!(
        "Sk {} at {} cycles, where ten steps end; σ of surfaces of this size {}",
        number(found),
        number(at),
        number(sigma)
    );
    let holds = found.abs() > SIGNIFICANT * sigma;
    Some(Finding::judged(13, &[run], holds, measured).because(|| {
        let passed = steps
            .iter()
            .zip(sk)
            .find(|(_, sk)| sk.abs() > SIGNIFICANT * sigma);
        passed.map_or_else(String::new, |(steps, _)| {
            format!(
                "it takes some {steps:.0} steps of 0.1 µm: a few touch too little of the surface"
            )
        })
    }))
}

fn strong(run: &Evidence, rq: &[f64], sk: &[f64], ku: &[f64]) -> Finding {
    let change = |values: &[f64]| values[values.len() - 1] - values[0];
    let changes = [change(rq) / rq[0], change(sk), change(ku)];
    let rough = run.scene.rq.is_some_and(|rq| rq >= ROUGH * (1.0 - 1e-9));
    let bounds = [if rough { LESS } else { STRONG[0] }, STRONG[1], STRONG[2]];
    let measured = format!(
        "Rq {}, Sk {}, Ku {}",
        percent(changes[0]),
        number(changes[1]),
        number(changes[2])
    );
    let holds = changes
        .iter()
        .zip(bounds)
        .all(|(change, bound)| change.abs() > bound);
    Finding::judged(14, &[run], holds, measured)
}
