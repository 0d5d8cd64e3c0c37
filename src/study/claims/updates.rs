//! Updates of the dynamic model (claims 29–33).

use super::bars::ValueWithBar;
use super::steps::{STUDY, reaches};
use super::words::{micrometres, number_list, percent};
use super::{Evidence, Part, Study, Verdict};

/// * Smallest relative decrease of the dissipation at an update that counts as a jump.
const JUMP: f64 = 0.01;
/// Cycles from which on the criteria agree [A §4d(i)].
const AGREE: f64 = 1e6;
/// * Largest relative difference of nearly equal rates.
const RATES: f64 = 0.05;
/// * Largest relative difference of stiffnesses that hardly depend on the updates.
const STIFFNESS: f64 = 0.03;
/// * Largest relative differences of identical responses: frequency, peak amplitude.
const RESPONSE: [f64; 2] = [1e-3, 0.02];
/// * Smallest relative deviation of the motion of an element that counts as far from the mean.
const APART: f64 = 0.1;
/// Number of samples at which curves are compared, on a logarithmic scale of cycles.
const POINTS: usize = 40;
/// Cycles of the first sample.
const FIRST: f64 = 1e4;

/// Judges a claim on the runs of a study.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    let updated = study.updated.as_slice();
    let ends = updated
        .iter()
        .filter_map(|run| run.cycles()?.last().copied());
    let end = ends.fold(f64::INFINITY, f64::min);
    let several = updated.len() > 1;
    let never = study.main.filter(|run| run.scene.update == "never");
    let part = match claim {
        29 => return updated.iter().copied().filter_map(jumps).collect(),
        30 if several && end > AGREE => rates(updated, end),
        31 if several => stiffness(updated, end),
        32 if several && end >= STUDY => responses(updated, &pairs(updated)),
        33 => match (never, updated.first()) {
            (Some(never), Some(finest)) if reaches(never, STUDY) && reaches(finest, STUDY) => {
                responses(&[finest, never], &[(finest, never)])
                    .map(|part| with_volumes(part, finest, never))
            }
            _ => None,
        },
        _ => None,
    };
    part.into_iter().collect()
}

/// Returns the energy per cycle at the end of the step to an iteration, under the vibration before the update \[J\].
///
/// The run may store the energy before the update. If the run does not store the energy, the energy follows from the
/// volume of the step and from the energy at the beginning of the step. The energy is the mean of the values for a
/// linear and for an exponential decrease.
fn energy_before_update(run: &Evidence, k: usize) -> Option<ValueWithBar> {
    let step = |name: &str| run.step.get(name)?.get(k).copied();
    if let Some(energy) = step("end_energy").filter(|energy| energy.is_finite()) {
        return Some(ValueWithBar::exact(energy));
    }
    let begin = *run.column("dissipated_energy")?.get(k - 1)?;
    let mean = step("volume")? / (run.scene.coefficient? * step("n_cycles")?);
    let (linear, exponential) = (2.0 * mean - begin, mean * mean / begin);
    Some(ValueWithBar {
        value: 0.5 * (linear + exponential),
        error: 0.5 * (linear - exponential).abs(),
    })
}

fn jumps(run: &Evidence) -> Option<Part> {
    let (updated, energy) = (run.column("updated")?, run.column("dissipated_energy")?);
    let (cycles, solves) = (run.cycles()?, run.column("error_cycle"));
    let update_rows: Vec<usize> = (1..updated.len()).filter(|&k| updated[k] > 0.0).collect();
    let mut part = match update_rows.is_empty() {
        true => {
            let reason = "the criterion never triggered an update: kn and kt changed too little";
            Part::of(&[run], Verdict::Undecided, reason.to_owned())
        }
        false => {
            let jump = |&k: &usize| {
                let error = solves.and_then(|e| e.get(k).copied()).unwrap_or(0.0);
                let after = ValueWithBar::relative(energy[k], error);
                Some((
                    k,
                    after
                        .ratio(energy_before_update(run, k)?)
                        .difference(ValueWithBar::exact(1.0)),
                ))
            };
            let jumps: Vec<(usize, ValueWithBar)> =
                update_rows.iter().map(jump).collect::<Option<_>>()?;
            let texts: Vec<String> = (jumps.iter())
                .map(|(k, jump)| format!("{} at {:.0} cycles", percent(jump.value), cycles[*k]))
                .collect();
            let verdict = Verdict::all(jumps.iter().map(|(_, jump)| jump.below(-JUMP)));
            Part::of(&[run], verdict, texts.join(", "))
        }
    };
    part.of = format!("updates at {}", criterion(run));
    Some(part)
}

/// Returns cycles from `first` to `last` on a logarithmic scale.
fn sample_cycles(first: f64, last: f64) -> Vec<f64> {
    let ratio = (last / first).ln() / (POINTS - 1) as f64;
    (0..POINTS)
        .map(|k| first * (ratio * k as f64).exp())
        .collect()
}

/// Returns the largest relative difference of `column` between the runs `a` and `b` at the cycles `samples`, with an
/// error bar.
fn largest_difference(
    a: &Evidence,
    b: &Evidence,
    column: &str,
    samples: &[f64],
) -> Option<ValueWithBar> {
    let mut most = ValueWithBar::exact(0.0);
    for &n in samples {
        let ratio = a.bar_at(column, n)?.ratio(b.bar_at(column, n)?);
        let difference = ratio.difference(ValueWithBar::exact(1.0)).magnitude();
        if difference.value >= most.value {
            most = difference;
        }
    }
    Some(most)
}

type Pair<'a> = (&'a Evidence, &'a Evidence);

/// Returns all pairs of runs.
fn pairs<'a>(set: &[&'a Evidence]) -> Vec<Pair<'a>> {
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

/// Formats the differences of pairs, and judges if all are below a bound. Two runs that were never updated do not show
/// the effect of updates.
fn differences(
    pairs: &[Pair],
    bound: f64,
    difference_of: impl Fn(&Evidence, &Evidence) -> Option<ValueWithBar>,
) -> Option<(Verdict, String)> {
    let all: Vec<ValueWithBar> = pairs
        .iter()
        .map(|(a, b)| difference_of(a, b))
        .collect::<Option<_>>()?;
    let texts: Vec<String> = pairs
        .iter()
        .zip(&all)
        .map(|((a, b), difference)| {
            let (first, second) = (criterion(a), criterion(b));
            let text = match is_updated(a, b) {
                true => percent(difference.value),
                false => NEVER.to_owned(),
            };
            format!("{first} against {second}: {text}")
        })
        .collect();
    let verdict = |((a, b), difference): (&Pair, &ValueWithBar)| match is_updated(a, b) {
        true => difference.below(bound),
        false => Verdict::Undecided,
    };
    let verdict = Verdict::all(pairs.iter().zip(&all).map(verdict));
    Some((verdict, texts.join(", ")))
}

/// Text for two runs without any update.
const NEVER: &str = "neither run was updated";

fn is_updated(a: &Evidence, b: &Evidence) -> bool {
    a.updates() + b.updates() > 0
}

/// Describes how the final motions of the runs differ.
fn amplitudes(set: &[&Evidence]) -> String {
    let last = |run: &&Evidence| run.response.get("displacement_amplitude")?.last().copied();
    let all: Option<Vec<f64>> = set.iter().map(last).collect();
    let Some(all) = all else {
        return String::new();
    };
    if set.iter().all(|run| run.updates() == 0) {
        return String::new();
    }
    let updates: Vec<String> = set.iter().map(|run| run.updates().to_string()).collect();
    let mut text = format!(
        "updated {} times; the final relative displacement is {} µm: each criterion freezes it at the state of its last update",
        updates.join(", "),
        number_list(all.iter().map(|u| 1e6 * u))
    );
    let spread = set
        .iter()
        .filter_map(|run| run.response.get("displacement_spread")?.last().copied())
        .fold(0.0, f64::max);
    if spread > APART {
        text += &format!(
            ", and single elements move by up to {} more or less than the mean that drives the fine contact",
            percent(spread)
        );
    }
    text
}

fn rates(set: &[&Evidence], end: f64) -> Option<Part> {
    let samples = sample_cycles(AGREE, end);
    let (verdict, measured) = differences(&pairs(set), RATES, |a, b| {
        largest_difference(a, b, "wear_rate", &samples)
    })?;
    Some(Part::of(set, verdict, measured).with_cause(|| amplitudes(set)))
}

fn stiffness(set: &[&Evidence], end: f64) -> Option<Part> {
    let samples = sample_cycles(FIRST.min(0.1 * end), end);
    let (verdict, measured) = differences(&pairs(set), STIFFNESS, |a, b| {
        largest_difference(a, b, "kn", &samples)
    })?;
    Some(Part::of(set, verdict, measured))
}

fn responses(set: &[&Evidence], pairs: &[Pair]) -> Option<Part> {
    let difference_of = |name: &'static str| {
        move |a: &Evidence, b: &Evidence| {
            let ratio = a.worn_end_bars(name)?[1].ratio(b.worn_end_bars(name)?[1]);
            Some(ratio.difference(ValueWithBar::exact(1.0)).magnitude())
        }
    };
    let (frequency, f_text) = differences(pairs, RESPONSE[0], difference_of("peak_frequency"))?;
    let (peak, p_text) = differences(pairs, RESPONSE[1], difference_of("peak_amplitude"))?;
    let measured = format!("frequency: {f_text}; peak: {p_text}");
    Some(Part::of(set, frequency.and(peak), measured).with_cause(|| amplitudes(set)))
}

/// Adds the worn volumes and depths of both runs to a part.
fn with_volumes(mut part: Part, finest: &Evidence, never: &Evidence) -> Part {
    let volume = |run: &Evidence| run.ends("wear_volume").map(|ends| ends[1]);
    let depth = |run: &Evidence| run.worn.as_ref().map(|worn| worn.deepest);
    if let (Some(a), Some(b), Some(deep), Some(deeper)) =
        (volume(finest), volume(never), depth(finest), depth(never))
    {
        part.measured += &format!(
            "; worn volume never over finest {}, deepest wear {} and {}",
            percent(b / a),
            micrometres(deeper),
            micrometres(deep)
        );
    }
    part
}

/// Returns the cycles from which on the wear rates of all runs are within 5 %*.
///
/// Returns `None` if the wear rates never agree within 5 %*, or if no run has a model update.
pub fn agreement(set: &[&Evidence]) -> Option<f64> {
    let ends = set.iter().filter_map(|run| run.cycles()?.last().copied());
    let end = ends.fold(f64::INFINITY, f64::min);
    let is_any_updated = set.iter().any(|run| run.updates() > 0);
    if set.len() < 2 || !end.is_finite() || !is_any_updated {
        return None;
    }
    let samples = sample_cycles(FIRST.min(0.1 * end), end);
    let agree = |n: f64| {
        let each = pairs(set);
        let difference = each
            .iter()
            .map(|(a, b)| largest_difference(a, b, "wear_rate", &[n]));
        difference
            .into_iter()
            .all(|difference| difference.is_some_and(|difference| difference.value <= RATES))
    };
    let last = samples.iter().rposition(|n| !agree(*n));
    match last {
        None => samples.first().copied(),
        Some(k) => samples.get(k + 1).copied(),
    }
}
