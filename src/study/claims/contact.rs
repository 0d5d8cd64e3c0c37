//! Area, pressure and stiffness of the contact (claims 15–22).

use super::bars::{ValueWithBar, spread};
use super::steps::{STUDY, reaches};
use super::words::{interpolated, never_falls, number_list, percent};
use super::{Evidence, Part, Study, Verdict};
use crate::report::quantity::four_digits;

/// * Largest relative decrease of the area that counts as no decrease.
const FALL: f64 = 0.01;
/// * Smallest ratio of the first to the last slope of a curve that rises fast and then slowly.
const FAST: f64 = 5.0;
/// * Smallest R² of a nearly linear curve.
const LINEAR: f64 = 0.95;
/// Number of points of a linear fit.
const POINTS: usize = 200;
/// Largest roughness of the smoother surfaces \[m\]: 0.5 and 1 µm, against 5 and 10 µm [A §4a].
const SMOOTHER: f64 = 1e-6;
/// * The area of the smoothest surface counts as much larger if it exceeds `MUCH` times the area of the roughest
///   surface.
const MUCH: f64 = 2.0;
/// * The last pressure of a run counts as much lower if it is at most `LOWER` times the first pressure.
const LOWER: f64 = 0.5;
/// Limits of running-in in cycles. Running-in contains the first `EARLY` cycles, and is over after `LATE` cycles*.
const EARLY: f64 = 1e5;
const LATE: f64 = 5e6;
/// * Largest ratio of the last to the first spread of runs that converge.
pub const CONVERGED: f64 = 1.0 / 3.0;
/// A cell sticks if its dissipation is less than `STICKS` times the largest dissipation of a cell.
const STICKS: f64 = 1e-3;

/// Judges a claim on the runs of a study.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    let worn = || (study.roughness_series.iter().copied()).filter(|run| run.cycles().is_some());
    let rough_runs = || study.roughness_series.as_slice();
    let as_list = |part: Option<Part>| part.into_iter().collect();
    match claim {
        15 => worn().filter_map(area).collect(),
        16 => as_list(study.main.and_then(pressure)),
        17 => as_list(two_or_more(rough_runs()).and_then(areas)),
        18 => match two_or_more(rough_runs()) {
            Some(_) => worn().filter_map(shape).collect(),
            None => Vec::new(),
        },
        19 => to_the_end(study)
            .filter_map(|run| running_in(run, "kn"))
            .collect(),
        20 => as_list(two_or_more(rough_runs()).and_then(|rough_runs| converge(rough_runs, "kn"))),
        21 => {
            let each = to_the_end(study).filter_map(|run| running_in(run, "kt"));
            let mut parts: Vec<Part> = each.collect();
            parts.extend(
                two_or_more(rough_runs()).and_then(|rough_runs| converge(rough_runs, "kt")),
            );
            parts
        }
        _ => as_list(study.tangent_run.and_then(local)),
    }
}

/// Returns the runs that reach the end of the study.
fn to_the_end<'a>(study: &'a Study) -> impl Iterator<Item = &'a Evidence> {
    (study.roughness_series.iter().copied()).filter(|run| reaches(run, STUDY))
}

/// Returns the runs of different roughness, if there are at least two.
pub fn two_or_more<'a, 'b>(set: &'b [&'a Evidence]) -> Option<&'b [&'a Evidence]> {
    let rough = set.iter().all(|run| run.scene.rq.is_some());
    (set.len() > 1 && rough).then_some(set)
}

fn area(run: &Evidence) -> Option<Part> {
    let area = run.column("contact_area_fraction")?;
    let [first, last] = run.ends("contact_area_fraction")?;
    let grows = area
        .windows(2)
        .all(|pair| pair[1] >= (1.0 - FALL) * pair[0]);
    let measured = format!("{} → {} of the joint", percent(first), percent(last));
    Some(Part::of(
        &[run],
        Verdict::of(grows && last > first),
        measured,
    ))
}

fn median(values: &[f64]) -> Option<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)?;
    Some(0.5 * (values[middle / 2] + values[middle.div_ceil(2)]))
}

fn pressure(run: &Evidence) -> Option<Part> {
    run.cycles()?;
    let [first, last] = run.ends("max_pressure")?;
    let (before, after) = (&run.first, &run.last);
    let sections = [
        median(&before.section_peaks)?,
        median(&after.section_peaks)?,
    ];
    let uneven = [before, after].map(|moment| moment.high_pressure / moment.mean_pressure);
    let measured = format!(
        "median of the largest pressures of all sections {} → {} MPa; 99 % of the cells in contact below {} → {} MPa, {} → {} times the mean; largest pressure {} → {} MPa",
        four_digits(1e-6 * sections[0]),
        four_digits(1e-6 * sections[1]),
        four_digits(1e-6 * before.high_pressure),
        four_digits(1e-6 * after.high_pressure),
        four_digits(uneven[0]),
        four_digits(uneven[1]),
        four_digits(1e-6 * first),
        four_digits(1e-6 * last)
    );
    let holds = sections[1] <= LOWER * sections[0]
        && after.high_pressure <= LOWER * before.high_pressure
        && uneven[1] < uneven[0];
    let part = Part::of(&[run], Verdict::of(holds), measured);
    Some(part.with_cause(|| {
        let share = after.peak_dissipation;
        if share < STICKS {
            format!("the cell under the largest pressure sticks (its dissipation is {share:.1e} of the largest): it does not wear while its surroundings do, so its pressure keeps rising; a hardness limit would flatten it")
        } else {
            String::new()
        }
    }))
}

/// Compares the first and the last slope of kn or kt.
fn running_in(run: &Evidence, name: &str) -> Option<Part> {
    run.scene.rq?;
    let values = run.column(name)?;
    let at = |n: f64| run.bar_at(name, n);
    let slope = |from: ValueWithBar, to: ValueWithBar, cycles: f64| {
        // The two values of a slope share their error, except for the growth of the error bar.
        ValueWithBar {
            value: (to.value - from.value) / cycles,
            error: (to.error - from.error).abs() / cycles,
        }
    };
    let early = slope(run.bar(name, 0)?, at(EARLY)?, EARLY);
    let late = slope(at(LATE)?, at(STUDY)?, STUDY - LATE);
    // The slope of a constant stiffness is a rounding error.
    let rounding = 1e-9 * values[0] / (STUDY - LATE);
    let scaled = ValueWithBar {
        value: FAST * late.value.max(0.0),
        error: FAST * late.error,
    };
    let verdict = (early.difference(scaled).above(0.0)).and(late.above(-rounding));
    let measured = format!(
        "{name} {} → {} N/µm, slope {} N/µm per 10⁶ cycles to 10⁵ cycles, {} ± {} after 5 × 10⁶",
        four_digits(1e-6 * values[0]),
        four_digits(1e-6 * values[values.len() - 1]),
        four_digits(early.value),
        four_digits(late.value),
        four_digits(late.error)
    );
    Some(Part::of(&[run], verdict, measured))
}

fn local(run: &Evidence) -> Option<Part> {
    let [first, last] = run.local.as_ref()?;
    let (density, worn) = (median(&first.density)?, median(&last.density)?);
    let (kn, worn_kn) = (median(&first.kn)?, median(&last.kn)?);
    let ends = (run.ends("kn")?, run.ends("contact_area_fraction")?);
    let ([before, after], [area, grown]) = ends;
    let measured = format!(
        "median over loaded elements {} → {} N/µm per mm² in contact ({} → {} N/µm per element); joint {} → {} N/µm on {} → {} of its area",
        four_digits(1e-12 * density),
        four_digits(1e-12 * worn),
        four_digits(1e-6 * kn),
        four_digits(1e-6 * worn_kn),
        four_digits(1e-6 * before),
        four_digits(1e-6 * after),
        percent(area),
        percent(grown)
    );
    let holds = worn < density && after > before && grown > area;
    Some(Part::of(&[run], Verdict::of(holds), measured))
}

/// Formats the roughnesses of a set.
pub fn roughnesses(set: &[&Evidence]) -> String {
    let rq = set.iter().filter_map(|run| run.scene.rq);
    format!("Rq {} µm", number_list(rq.map(|rq| 1e6 * rq)))
}

fn areas(set: &[&Evidence]) -> Option<Part> {
    let first: Option<Vec<f64>> = (set.iter())
        .map(|run| run.ends("contact_area_fraction").map(|ends| ends[0]))
        .collect();
    let first = first?;
    let falling: Vec<f64> = first.iter().map(|area| -area).collect();
    let measured = format!(
        "{}: {} %",
        roughnesses(set),
        number_list(first.iter().map(|area| 100.0 * area))
    );
    let holds = super::words::rises(&falling) && first[0] > MUCH * first[first.len() - 1];
    Some(Part::of(set, Verdict::of(holds), measured))
}

/// Judges the area over the cycles: asymptotic for a smoother surface, nearly linear for a rougher one.
fn shape(run: &Evidence) -> Option<Part> {
    let rq = run.scene.rq?;
    let (cycles, area) = (run.cycles()?, run.column("contact_area_fraction")?);
    let end = cycles[cycles.len() - 1];
    let at = |k: usize| interpolated(cycles, area, end * k as f64 / (POINTS - 1) as f64);
    let curve: Vec<f64> = (0..POINTS).map(at).collect();
    let [tenth, half] = [POINTS / 10, POINTS / 2];
    let early = (curve[tenth] - curve[0]) / tenth as f64;
    let late = (curve[POINTS - 1] - curve[half]) / (POINTS - 1 - half) as f64;
    let fit = r_squared(&curve);
    let measured = format!(
        "slope {} of the joint per 10 % of the cycles at first, {} at last; R² {} of a line",
        percent(early * tenth as f64),
        percent(late * tenth as f64),
        four_digits(fit)
    );
    let holds = match rq <= SMOOTHER * (1.0 + 1e-9) {
        true => early > FAST * late.max(0.0),
        false => fit > LINEAR,
    };
    Some(Part::of(&[run], Verdict::of(holds), measured))
}

/// Returns R² of the best line through equidistant values.
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

/// Judges if a spread has fallen to a third.
pub fn converged(before: ValueWithBar, after: ValueWithBar) -> Verdict {
    let scaled = ValueWithBar {
        value: CONVERGED * before.value,
        error: CONVERGED * before.error,
    };
    after.difference(scaled).below(f64::MIN_POSITIVE)
}

fn converge(set: &[&Evidence], name: &str) -> Option<Part> {
    let ends: Option<Vec<[ValueWithBar; 2]>> = set.iter().map(|run| run.end_bars(name)).collect();
    let ends = ends?;
    let [first, last] = [0, 1].map(|end| {
        ends.iter()
            .map(|pair| pair[end])
            .collect::<Vec<ValueWithBar>>()
    });
    let [before, after] = [spread(&first), spread(&last)];
    let values = |bars: &[ValueWithBar]| number_list(bars.iter().map(|bar| 1e-6 * bar.value));
    let measured = format!(
        "{}: {name} {} → {} N/µm, spread {} → {} ± {}",
        roughnesses(set),
        values(&first),
        values(&last),
        percent(before.value),
        percent(after.value),
        percent(after.error)
    );
    let mut part = Part::of(set, converged(before, after), measured);
    part.of = "the spread".to_owned();
    Some(part.with_cause(|| {
        let rising: Vec<String> = set
            .iter()
            .filter(|run| {
                run.column(name)
                    .is_some_and(|k| never_falls(k, 0.0) && k[k.len() - 1] < 0.95 * last[0].value)
            })
            .map(|run| run.name.clone())
            .collect();
        if rising.is_empty() {
            String::new()
        } else {
            format!("still rising: {}", rising.join(", "))
        }
    }))
}
