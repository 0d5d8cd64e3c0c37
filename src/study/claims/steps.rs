//! Verdicts on wear steps and on the sums of wear steps (claims 1–7, 45).

use super::bars::ValueWithBar;
use super::roles::MAIN;
use super::words::{interpolated, micrometres, percent};
use super::{Evidence, Part, Study, Verdict};
use crate::report::quantity::four_digits;

/// Wear iterations at Rq 5 µm [A §4b].
pub const ITERATIONS: f64 = 231.0;
/// Depth of a wear iteration \[m\] [A §4a].
pub const DEPTH_STEP: f64 = 0.1e-6;
/// * Factor of uncertainty from unknown dimensions and damping.
const FACTOR: f64 = 1.5;
/// Cycles of the study.
pub const STUDY: f64 = 1e7;
/// * Largest relative difference of volumes that are summed in different order.
const BOOKKEEPING: f64 = 1e-10;
/// * Largest deviation of an explicit step, relative to the deepest wear.
const EXACT: f64 = 1e-12;
/// Time of a fretting cycle \[s\] [A §4b].
pub const SECONDS_A_CYCLE: f64 = 70.0;
/// Total time, 4 h 29 min \[s\] [A §4b].
pub const SECONDS: f64 = 16_140.0;
/// * Largest change of the dissipation per 10⁶ cycles in a steady state, relative to the last value.
const STEADY: f64 = 0.05;
/// Number of cycles at the end of the study. The change of the dissipation is measured over the last `LAST` cycles.
const LAST: f64 = 2e6;
/// * Largest ratio of the deepest wear to the shorter side that counts as very small.
const SHALLOW: f64 = 1e-3;
/// Relative rounding error of a ratio. A nearly whole ratio may be rounded down or up.
const ROUNDING: f64 = 1e-9;

/// Judges a claim on the runs of a study.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    let worn = || study.all.iter().copied().filter(|run| run.worn.is_some());
    let to_the_end = || (study.roughness_series.iter().copied()).filter(|run| reaches(run, STUDY));
    let explicit = study.explicit;
    match claim {
        1 => (explicit.filter(|run| is_main(run)))
            .and_then(iteration_count)
            .into_iter()
            .collect(),
        2 => explicit.and_then(step_lengths).into_iter().collect(),
        3 => explicit.and_then(material_removal).into_iter().collect(),
        4 => worst_of(worn().filter_map(volume)),
        5 => {
            let main = study.main.filter(|run| is_main(run) && reaches(run, STUDY));
            main.and_then(depth).into_iter().collect()
        }
        6 => explicit
            .filter(|run| reaches(run, STUDY))
            .map(computing_time)
            .into_iter()
            .collect(),
        7 => to_the_end().filter_map(steady).collect(),
        _ => study
            .roughness_series
            .iter()
            .copied()
            .filter_map(shallow)
            .collect(),
    }
}

/// Combines the parts of many runs into one, with the measurement of the worst run.
pub fn worst_of(parts: impl Iterator<Item = (f64, Part)>) -> Vec<Part> {
    let mut worst: Option<(f64, Part)> = None;
    let (mut runs, mut verdicts) = (Vec::new(), Vec::new());
    for (deviation, part) in parts {
        runs.extend(part.runs.clone());
        verdicts.push(part.verdict);
        if worst.as_ref().is_none_or(|(most, _)| deviation > *most) {
            worst = Some((deviation, part));
        }
    }
    let combined = worst.map(|(_, part)| Part {
        measured: format!("{} runs, worst: {}", runs.len(), part.measured),
        verdict: Verdict::all(verdicts),
        runs,
        of: String::new(),
        cause: part.cause,
    });
    combined.into_iter().collect()
}

/// Returns true if the run reaches that many cycles of wear.
pub fn reaches(run: &Evidence, cycles: f64) -> bool {
    run.cycles()
        .and_then(|all| all.last())
        .is_some_and(|last| *last >= cycles)
}

/// Returns true for the roughness whose steps the paper counts.
fn is_main(run: &Evidence) -> bool {
    run.scene
        .rq
        .is_some_and(|rq| (rq / MAIN - 1.0).abs() < 1e-6)
}

fn iteration_count(run: &Evidence) -> Option<Part> {
    let step = run.scene.explicit?;
    if (step / DEPTH_STEP - 1.0).abs() > 1e-6 || !reaches(run, STUDY) {
        return None;
    }
    let cycles = run.cycles()?;
    let steps = cycles.iter().position(|n| *n >= STUDY)? as f64;
    let holds = (ITERATIONS / FACTOR..=ITERATIONS * FACTOR).contains(&steps);
    let measured = format!(
        "{steps:.0} iterations, {} of 231",
        percent(steps / ITERATIONS)
    );
    let part = Part::of(&[run], Verdict::of(holds), measured);
    Some(part.with_cause(|| {
        let [first, last] = [run.depth_rate[0], run.depth_rate[run.depth_rate.len() - 1]];
        format!(
            "dimensions and damping of the rig, which determine the slip, are not published: here 0.1 µm takes {} cycles at first and {} at last, against 43 472 on average in the paper",
            four_digits(DEPTH_STEP / first),
            four_digits(DEPTH_STEP / last)
        )
    }))
}

fn step_lengths(run: &Evidence) -> Option<Part> {
    let depth_step = run.scene.explicit?;
    let steps = run.column("n_cycles")?.get(1..)?;
    // The end of the run cuts the last step.
    let steps = &steps[..steps.len().saturating_sub(usize::from(run.done))];
    let is_wrong = |(steps, rate): (&f64, &f64)| {
        let ratio = depth_step / rate;
        let slack = ROUNDING * ratio;
        let [low, high] = [ratio - slack, ratio + slack].map(|ratio| ratio.floor().max(1.0));
        *steps < low || *steps > high
    };
    let wrong_count = steps
        .iter()
        .zip(&run.depth_rate)
        .filter(|pair| is_wrong(*pair))
        .count();
    let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let most = steps.iter().copied().fold(0.0, f64::max);
    let measured = format!(
        "{wrong_count} of {} steps are not floor(Δh_max / max Δh); {least:.0} to {most:.0} cycles per step",
        steps.len()
    );
    let holds = wrong_count == 0 && most > least;
    Some(Part::of(&[run], Verdict::of(holds), measured))
}

fn material_removal(run: &Evidence) -> Option<Part> {
    let worn = run.worn.as_ref()?;
    let holds = worn.least_growth >= 0.0 && worn.rule_error <= EXACT;
    let measured = format!(
        "smallest growth of a cell in a step {}, steps deviate from N Δh by {:.1e} of the deepest wear",
        micrometres(worn.least_growth),
        worn.rule_error
    );
    Some(Part::of(&[run], Verdict::of(holds), measured))
}

fn volume(run: &Evidence) -> Option<(f64, Part)> {
    let last = |name| run.ends(name).map(|ends| ends[1]);
    let (volume, energy) = (last("wear_volume")?, last("dissipated_energy_total")?);
    let local = (run.worn.as_ref()?.volume / volume - 1.0).abs();
    let global = (run.scene.coefficient? * energy / volume - 1.0).abs();
    let deviation = local.max(global);
    let measured = format!(
        "{}, sum of depths deviates by {local:.1e}, α × energy by {global:.1e}",
        run.name
    );
    Some((
        deviation,
        Part::of(&[run], Verdict::of(deviation <= BOOKKEEPING), measured),
    ))
}

fn depth(run: &Evidence) -> Option<Part> {
    let deepest = run.deepest_wear()?;
    let bound = ITERATIONS * DEPTH_STEP;
    let measured = format!(
        "deepest wear {} ± {}, of at most {}",
        micrometres(deepest.value),
        micrometres(deepest.error),
        micrometres(bound)
    );
    let part = Part::of(&[run], deepest.below(bound * (1.0 + EXACT)), measured);
    Some(part.with_cause(|| {
        "this joint slips more than the paper's, or more at one place: dimensions and damping of the rig are not published".to_owned()
    }))
}

fn computing_time(run: &Evidence) -> Part {
    let iterations = run.cycles().map_or(1, |cycles| cycles.len() - 1).max(1);
    let each = run.seconds / iterations as f64;
    let measured = format!(
        "{} s per iteration, {:.0} s in total: {} and {} of the paper's times",
        four_digits(each),
        run.seconds,
        percent(each / SECONDS_A_CYCLE),
        percent(run.seconds / SECONDS)
    );
    let holds = each <= SECONDS_A_CYCLE && run.seconds <= SECONDS;
    Part::of(&[run], Verdict::of(holds), measured)
}

fn steady(run: &Evidence) -> Option<Part> {
    let cycles = run.cycles()?;
    let energy = run.column("dissipated_energy")?;
    let end = cycles[cycles.len() - 1];
    let last = run.bar("dissipated_energy", cycles.len() - 1)?;
    let earlier = interpolated(cycles, energy, end - LAST);
    let per_million = 1e6 / LAST;
    // Neighbours share the error of the wear steps, so the difference only has the growth of the bar. The errors of the
    // cycles are independent.
    let earlier_bar = run.bar_at("dissipated_energy", end - LAST)?;
    let solves = run
        .column("error_cycle")
        .and_then(|errors| errors.last().copied());
    let solves = 2.0 * solves.filter(|error| error.is_finite()).unwrap_or(0.0);
    let change = ValueWithBar {
        value: (last.value - earlier) * per_million / last.value,
        error: ((last.error - earlier_bar.error).abs() / last.value + solves) * per_million,
    };
    let measured = format!("{} per 10⁶ cycles", percent(change.value));
    Some(Part::of(&[run], change.magnitude().below(STEADY), measured))
}

fn shallow(run: &Evidence) -> Option<Part> {
    let (deepest, side) = (run.deepest_wear()?, run.scene.side?);
    let modes = run.modes?;
    let share = deepest.value / side;
    let measured = format!(
        "deepest wear {} of the shorter side; one structure of {modes} modes for all iterations",
        percent(share)
    );
    let bar = ValueWithBar::relative(share, deepest.error / deepest.value);
    Some(Part::of(&[run], bar.below(SHALLOW), measured))
}
