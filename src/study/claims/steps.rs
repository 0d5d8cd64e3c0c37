//! Wear steps and what they add up to (claims 1–7).

use super::words::{integral, interpolated, percent};
use super::{Evidence, Finding};
use crate::report::quantity::number;

/// Wear iterations at Rq 5 µm [A §4b].
const ITERATIONS: f64 = 231.0;
/// Depth of one of them \[m\] [A §4a].
const DEPTH_STEP: f64 = 0.1e-6;
/// * What unknown dimensions and damping leave open.
const FACTOR: f64 = 1.5;
/// Roughness at which they were counted \[m\].
const RQ: f64 = 5e-6;
/// Cycles of the study.
pub const STUDY: f64 = 1e7;
/// * Of the volume, between sums in different order.
const BOOKKEEPING: f64 = 1e-10;
/// * Of the deepest wear.
const EXACT: f64 = 1e-12;
/// * What the trapezoidal rule may miss of a falling rate.
const QUADRATURE: f64 = 0.05;
/// 4 h 29 min \[s\] [A §4b].
const SECONDS: f64 = 16_140.0;
/// * Change of dissipation per 10⁶ cycles, of its value at the end.
const STEADY: f64 = 0.05;
/// Steps whose mean length is compared at both ends.
const MANY: usize = 10;

/// Claims on one run.
pub fn single(run: &Evidence) -> Vec<Finding> {
    let Some(cycles) = run.cycles() else {
        return Vec::new();
    };
    let mut findings = vec![lengths(run), removal(run), volume(run), depth(run, cycles)];
    findings.extend(count(run, cycles));
    if reaches(run, STUDY) {
        findings.extend([time(run), steady(run, cycles)]);
    }
    findings.retain(|finding| !finding.measured.is_empty());
    findings
}

/// True if the run wears to that many cycles.
pub fn reaches(run: &Evidence, cycles: f64) -> bool {
    run.cycles()
        .and_then(|all| all.last())
        .is_some_and(|last| *last >= cycles)
}

/// Steps of 0.1 µm that the wear of each iteration stands for, summed up.
pub fn explicit_steps(run: &Evidence) -> Option<Vec<f64>> {
    let depth = integral(run.cycles()?, &run.depth_rate);
    Some(depth.into_iter().map(|depth| depth / DEPTH_STEP).collect())
}

fn count(run: &Evidence, cycles: &[f64]) -> Option<Finding> {
    let rq = run.scene.rq.filter(|rq| (rq / RQ - 1.0).abs() < 1e-6)?;
    if run.scene.pressure_cap.is_some() || !reaches(run, STUDY) {
        return None;
    }
    let (steps, how) = match run.scene.explicit {
        Some(step) if (step / DEPTH_STEP - 1.0).abs() < 1e-6 => {
            ((cycles.len() - 1) as f64, "explicit iterations".to_owned())
        }
        _ => (
            interpolated(cycles, &explicit_steps(run)?, STUDY),
            format!(
                "steps of 0.1 µm in place of the {} taken, ∫ dn · (deepest wear per cycle) / 0.1 µm",
                cycles.len() - 1
            ),
        ),
    };
    let holds = (ITERATIONS / FACTOR..=ITERATIONS * FACTOR).contains(&steps);
    let measured = format!("{steps:.0} {how}, at Rq {} µm", number(1e6 * rq));
    Some(Finding::judged(1, &[run], holds, measured).because(|| {
        let [first, last] = [run.depth_rate[0], run.depth_rate[run.depth_rate.len() - 1]];
        format!(
            "dimensions and damping of the rig are not published, and set the slip: here the deepest wear goes from {} to {} cycles for 0.1 µm, {} updates on the way",
            number(DEPTH_STEP / first),
            number(DEPTH_STEP / last),
            run.updates()
        )
    }))
}

fn lengths(run: &Evidence) -> Finding {
    let steps = &run.column("n_cycles").unwrap_or_default()[1..];
    // The last one ends where the run does.
    let steps = &steps[..steps.len().saturating_sub(usize::from(run.done))];
    let Some(depth_step) = run.scene.explicit else {
        let reason = "not an explicit run: its steps follow from their error";
        return Finding::not_applicable(2, &[run], reason);
    };
    if steps.len() < 2 * MANY {
        let reason = format!("fewer than {} explicit steps", 2 * MANY);
        return Finding::not_applicable(2, &[run], reason);
    }
    // A ratio that is a whole number but for rounding may be taken down or up.
    let off = |(steps, rate): (&f64, &f64)| {
        let ratio = depth_step / rate;
        let slack = 1e-9 * ratio;
        let [low, high] = [ratio - slack, ratio + slack].map(|ratio| ratio.floor().max(1.0));
        *steps < low || *steps > high
    };
    let wrong = steps
        .iter()
        .zip(&run.depth_rate)
        .filter(|pair| off(*pair))
        .count();
    let mean = |steps: &[f64]| steps.iter().sum::<f64>() / steps.len() as f64;
    let [early, late] = [mean(&steps[..MANY]), mean(&steps[steps.len() - MANY..])];
    let measured = format!(
        "{wrong} of {} steps are not floor(Δh_max / max Δh); {} cycles a step at first, {} at last",
        steps.len(),
        number(early),
        number(late)
    );
    Finding::judged(2, &[run], wrong == 0 && late > early, measured)
}

fn removal(run: &Evidence) -> Finding {
    let Some(worn) = &run.worn else {
        return Finding::not_applicable(3, &[run], "no wear fields");
    };
    let mut holds = worn.least_growth >= 0.0;
    let mut measured = format!(
        "least growth of a cell in a step {} µm",
        number(1e6 * worn.least_growth)
    );
    if run.scene.explicit.is_some() {
        holds &= worn.rule_error <= EXACT;
        measured += &format!(
            ", steps off N Δh by {:.1e} of the deepest wear",
            worn.rule_error
        );
    } else {
        measured += "; the steps are not explicit";
    }
    Finding::judged(3, &[run], holds, measured)
}

fn volume(run: &Evidence) -> Finding {
    let last = |name| run.ends(name).map(|ends| ends[1]);
    let (Some(volume), Some(energy), Some(worn), Some(coefficient)) = (
        last("wear_volume"),
        last("dissipated_energy_total"),
        &run.worn,
        run.scene.coefficient,
    ) else {
        return Finding::not_applicable(4, &[run], "no wear fields");
    };
    let local = (worn.volume / volume - 1.0).abs();
    let global = (coefficient * energy / volume - 1.0).abs();
    let measured = format!("sum of depths off by {local:.1e}, α × energy by {global:.1e}");
    Finding::judged(
        4,
        &[run],
        local <= BOOKKEEPING && global <= BOOKKEEPING,
        measured,
    )
}

fn depth(run: &Evidence, cycles: &[f64]) -> Finding {
    let (Some(worn), Some(steps)) = (&run.worn, explicit_steps(run)) else {
        return Finding::not_applicable(5, &[run], "no wear fields");
    };
    let bound = match run.scene.explicit {
        Some(step) => (cycles.len() - 1) as f64 * step,
        None => steps[steps.len() - 1] * DEPTH_STEP * (1.0 + QUADRATURE),
    };
    let measured = format!(
        "deepest wear {} µm, bound {} µm",
        number(1e6 * worn.deepest),
        number(1e6 * bound)
    );
    Finding::judged(5, &[run], worn.deepest <= bound * (1.0 + EXACT), measured)
}

fn time(run: &Evidence) -> Finding {
    let measured = format!(
        "{:.0} s of computing, {} of {SECONDS} s",
        run.seconds,
        percent(run.seconds / SECONDS)
    );
    Finding::judged(6, &[run], run.seconds < SECONDS, measured)
}

fn steady(run: &Evidence, cycles: &[f64]) -> Finding {
    let Some(energy) = run.column("dissipated_energy") else {
        return Finding::not_applicable(7, &[run], "no dissipation");
    };
    let end = cycles[cycles.len() - 1];
    let last = energy[energy.len() - 1];
    let change = (last - interpolated(cycles, energy, end - 2e6)) / (2.0 * last);
    let measured = format!("{} per 10⁶ cycles", percent(change));
    Finding::judged(7, &[run], change.abs() < STEADY, measured)
}
