//! Updates of the dynamic model (claims 29–33).

use super::bars::Bar;
use super::steps::{STUDY, reaches};
use super::words::{list, micrometres, percent};
use super::{Evidence, Part, Study, Verdict};

/// * Fall of the dissipation at an update that is a jump.
const JUMP: f64 = 0.01;
/// From here on the criteria agree \[cycles\] [A §4d(i)].
const AGREE: f64 = 1e6;
/// * Rates that are nearly the same.
const RATES: f64 = 0.05;
/// * Stiffnesses that hardly depend on the updates.
const STIFFNESS: f64 = 0.03;
/// * Responses that are identical: frequency, peak.
const RESPONSE: [f64; 2] = [1e-3, 0.02];
/// * Motions of single elements that are far from the mean.
const APART: f64 = 0.1;
/// Cycles at which curves are compared, on a logarithmic scale.
const POINTS: usize = 40;
/// The first of them.
const FIRST: f64 = 1e4;

/// What the runs of a study say of a claim.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    let updated = study.updated.as_slice();
    let ends = updated
        .iter()
        .filter_map(|run| run.cycles()?.last().copied());
    let end = ends.fold(f64::INFINITY, f64::min);
    let several = updated.len() > 1;
    let never = study.main.filter(|run| run.scene.update == "never");
    let found = match claim {
        29 => return updated.iter().copied().filter_map(jumps).collect(),
        30 if several && end > AGREE => rates(updated, end),
        31 if several => stiffness(updated, end),
        32 if several && end >= STUDY => responses(updated, &pairs(updated)),
        33 => match (never, updated.first()) {
            (Some(never), Some(finest)) if reaches(never, STUDY) && reaches(finest, STUDY) => {
                responses(&[finest, never], &[(finest, never)])
                    .map(|part| volumes(part, finest, never))
            }
            _ => None,
        },
        _ => None,
    };
    found.into_iter().collect()
}

/// Energy of a cycle at the end of the step to an iteration, under the vibration before it \[J\]: what was written, or what follows from
/// the volume of the step and the energy at its beginning, if it fell linearly or exponentially.
fn before(run: &Evidence, k: usize) -> Option<Bar> {
    let step = |name: &str| run.step.get(name)?.get(k).copied();
    if let Some(energy) = step("end_energy").filter(|energy| energy.is_finite()) {
        return Some(Bar::exact(energy));
    }
    let begin = *run.column("dissipated_energy")?.get(k - 1)?;
    let mean = step("volume")? / (run.scene.coefficient? * step("n_cycles")?);
    let (linear, exponential) = (2.0 * mean - begin, mean * mean / begin);
    Some(Bar {
        value: 0.5 * (linear + exponential),
        error: 0.5 * (linear - exponential).abs(),
    })
}

fn jumps(run: &Evidence) -> Option<Part> {
    let (updated, energy) = (run.column("updated")?, run.column("dissipated_energy")?);
    let (cycles, solves) = (run.cycles()?, run.column("error_cycle"));
    let at: Vec<usize> = (1..updated.len()).filter(|&k| updated[k] > 0.0).collect();
    let mut part = match at.is_empty() {
        true => {
            let reason = "the criterion never called for an update: kn and kt changed too little";
            Part::of(&[run], Verdict::Undecided, reason.to_owned())
        }
        false => {
            let jump = |&k: &usize| {
                let error = solves.and_then(|e| e.get(k).copied()).unwrap_or(0.0);
                let after = Bar::relative(energy[k], error);
                Some((k, after.over(before(run, k)?).less(Bar::exact(1.0))))
            };
            let jumps: Vec<(usize, Bar)> = at.iter().map(jump).collect::<Option<_>>()?;
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

/// Cycles from `first` to `last`, evenly on a logarithmic scale.
fn cycles(first: f64, last: f64) -> Vec<f64> {
    let ratio = (last / first).ln() / (POINTS - 1) as f64;
    (0..POINTS)
        .map(|k| first * (ratio * k as f64).exp())
        .collect()
}

/// Largest relative difference of a column between two runs at these cycles, with its bar.
fn apart(a: &Evidence, b: &Evidence, column: &str, at: &[f64]) -> Option<Bar> {
    let mut most = Bar::exact(0.0);
    for &n in at {
        let ratio = a.bar_at(column, n)?.over(b.bar_at(column, n)?);
        let off = ratio.less(Bar::exact(1.0)).size();
        if off.value >= most.value {
            most = off;
        }
    }
    Some(most)
}

type Pair<'a> = (&'a Evidence, &'a Evidence);

/// The runs, each with each.
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

/// Differences of pairs in words, and whether all are below a bound. Of two runs that were never updated none can tell what updates do.
fn differences(
    pairs: &[Pair],
    bound: f64,
    of: impl Fn(&Evidence, &Evidence) -> Option<Bar>,
) -> Option<(Verdict, String)> {
    let all: Vec<Bar> = pairs.iter().map(|(a, b)| of(a, b)).collect::<Option<_>>()?;
    let texts: Vec<String> = pairs
        .iter()
        .zip(&all)
        .map(|((a, b), difference)| {
            let (one, other) = (criterion(a), criterion(b));
            let told = match is_updated(a, b) {
                true => percent(difference.value),
                false => NEVER.to_owned(),
            };
            format!("{one} against {other}: {told}")
        })
        .collect();
    let verdict = |((a, b), difference): (&Pair, &Bar)| match is_updated(a, b) {
        true => difference.below(bound),
        false => Verdict::Undecided,
    };
    let verdict = Verdict::all(pairs.iter().zip(&all).map(verdict));
    Some((verdict, texts.join(", ")))
}

/// What is said of two runs whose criteria never called for an update.
const NEVER: &str = "neither called for an update";

fn is_updated(a: &Evidence, b: &Evidence) -> bool {
    a.updates() + b.updates() > 0
}

/// How far the runs differ in what drives them in the end.
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
        "updated {} times; the relative displacement in the end is {} µm: each criterion freezes it at the state of its last update",
        updates.join(", "),
        list(all.iter().map(|u| 1e6 * u))
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
    let at = cycles(AGREE, end);
    let (verdict, measured) =
        differences(&pairs(set), RATES, |a, b| apart(a, b, "wear_rate", &at))?;
    Some(Part::of(set, verdict, measured).because(|| amplitudes(set)))
}

fn stiffness(set: &[&Evidence], end: f64) -> Option<Part> {
    let at = cycles(FIRST.min(0.1 * end), end);
    let (verdict, measured) = differences(&pairs(set), STIFFNESS, |a, b| apart(a, b, "kn", &at))?;
    Some(Part::of(set, verdict, measured))
}

fn responses(set: &[&Evidence], pairs: &[Pair]) -> Option<Part> {
    let of = |name: &'static str| {
        move |a: &Evidence, b: &Evidence| {
            let ratio = a.worn_end_bars(name)?[1].over(b.worn_end_bars(name)?[1]);
            Some(ratio.less(Bar::exact(1.0)).size())
        }
    };
    let (frequency, f_text) = differences(pairs, RESPONSE[0], of("peak_frequency"))?;
    let (peak, p_text) = differences(pairs, RESPONSE[1], of("peak_amplitude"))?;
    let measured = format!("frequency: {f_text}; peak: {p_text}");
    Some(Part::of(set, frequency.and(peak), measured).because(|| amplitudes(set)))
}

/// The part with what both runs have worn.
fn volumes(mut part: Part, finest: &Evidence, never: &Evidence) -> Part {
    let of = |run: &Evidence| run.ends("wear_volume").map(|ends| ends[1]);
    let depth = |run: &Evidence| run.worn.as_ref().map(|worn| worn.deepest);
    if let (Some(a), Some(b), Some(deep), Some(deeper)) =
        (of(finest), of(never), depth(finest), depth(never))
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

/// Cycles from which on the wear rates of all are within 5 %*; none if they never are, and where no run was updated.
pub fn agreement(set: &[&Evidence]) -> Option<f64> {
    let ends = set.iter().filter_map(|run| run.cycles()?.last().copied());
    let end = ends.fold(f64::INFINITY, f64::min);
    let is_told = set.iter().any(|run| run.updates() > 0);
    if set.len() < 2 || !end.is_finite() || !is_told {
        return None;
    }
    let at = cycles(FIRST.min(0.1 * end), end);
    let agree = |n: f64| {
        let each = pairs(set);
        let off = each.iter().map(|(a, b)| apart(a, b, "wear_rate", &[n]));
        off.into_iter()
            .all(|off| off.is_some_and(|off| off.value <= RATES))
    };
    let last = at.iter().rposition(|n| !agree(*n));
    match last {
        None => at.first().copied(),
        Some(k) => at.get(k + 1).copied(),
    }
}
