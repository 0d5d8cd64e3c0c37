//! The hardness limit (claims 39–43).

use super::bars::ValueWithBar;
use super::words::{interpolated, percent, rises};
use super::{Evidence, Part, Study, Verdict};
use crate::report::quantity::four_digits;

/// * Largest relative deviation from the cap, for rounding.
const CAP: f64 = 1e-9;
/// * Largest relative deviation of the load.
const LOAD: f64 = 1e-6;
/// * Smallest share of the cells in contact that makes a plateau.
const PLATEAU: f64 = 0.01;
/// * Largest relative growth of an area that counts as small or slight.
const SLIGHT: f64 = 0.5;
/// Cycles from which on the stiffnesses and the rates agree [A §4d(iii)].
const LATER: f64 = 2e6;
/// * Largest relative difference of stiffnesses and rates that are nearly equal.
const SAME: f64 = 0.05;
/// * Cycles at the end of the initial phase, in which dissipation differs.
const INITIAL: f64 = 1e5;
/// * Cycles up to which the agreement after "approximately 2 million cycles" is checked.
const MEET: f64 = 4e6;
/// Number of samples of a ratio over a range of cycles.
const POINTS: usize = 40;

/// Judges a claim on the runs of a study.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    if claim == 39 {
        let spheres = (study.spheres.len() > 1).then(|| spheres(&study.spheres));
        return spheres.flatten().into_iter().collect();
    }
    let Some(set) = study.plastic else {
        return Vec::new();
    };
    let reached = set.iter().all(|run| super::steps::reaches(run, MEET));
    let part_of_claim = match claim {
        40 => peaks(set),
        41 => start(set),
        42 if reached => later(set),
        43 if reached => energies(set),
        _ => None,
    };
    let without_effect = || Some(Part::of(&set, Verdict::Undecided, below_limit(set)?));
    part_of_claim
        .map(|part| without_effect().unwrap_or(part))
        .into_iter()
        .collect()
}

/// Reports that the largest pressure of the elastic joint is not above the cap. The joint with the cap is then
/// identical to the elastic joint. Returns `None` if the largest pressure is above the cap.
pub fn below_limit(set: [&Evidence; 2]) -> Option<String> {
    let (most, cap) = (set[0].ends("max_pressure")?[0], set[1].scene.pressure_cap?);
    (most <= cap).then(|| {
        format!(
            "the pressure cap has no effect: the largest pressure of the elastic joint is {} MPa, and the cap is {} MPa",
            four_digits(1e-6 * most),
            four_digits(1e-6 * cap)
        )
    })
}

fn peaks(set: [&Evidence; 2]) -> Option<Part> {
    let cap = set[1].scene.pressure_cap?;
    let [elastic, plastic] = set.map(|run| run.ends("max_pressure").map(|ends| ends[0]));
    let (elastic, plastic) = (elastic?, plastic?);
    let share = set[1].first.share_at_cap;
    let measured = format!(
        "largest pressure {} MPa elastic, {} MPa plastic; {} of the cells in contact at the cap of {} MPa",
        four_digits(1e-6 * elastic),
        four_digits(1e-6 * plastic),
        percent(share),
        four_digits(1e-6 * cap)
    );
    let holds = (plastic / cap - 1.0).abs() <= CAP && share > PLATEAU;
    Some(Part::of(&set, Verdict::of(holds), measured))
}

fn start(set: [&Evidence; 2]) -> Option<Part> {
    let [elastic, plastic] = set;
    let (kn, lower) = (elastic.bar("kn", 0)?, plastic.bar("kn", 0)?);
    let area = |run: &Evidence| run.ends("contact_area_fraction").map(|ends| ends[0]);
    let (area, larger) = (area(elastic)?, area(plastic)?);
    let measured = format!(
        "area {} elastic, {} plastic; kn {} and {} N/µm",
        percent(area),
        percent(larger),
        four_digits(1e-6 * kn.value),
        four_digits(1e-6 * lower.value)
    );
    let slightly = larger > area && larger < (1.0 + SLIGHT) * area;
    let verdict = Verdict::of(slightly).and(kn.difference(lower).above(0.0));
    let part = Part::of(&set, verdict, measured);
    Some(part.with_cause(|| {
        if larger >= (1.0 + SLIGHT) * area {
            "elastic peaks far exceed the limit here, so much more area must touch: the area of the elastic joint depends on the cells of the grid".to_owned()
        } else {
            String::new()
        }
    }))
}

/// Samples the ratio of the plastic to the elastic joint over a range of cycles.
///
/// Returns the largest deviation from 1, and the smallest and the largest ratio.
fn ratios(set: [&Evidence; 2], name: &str, range: [f64; 2]) -> Option<(ValueWithBar, [f64; 2])> {
    let mut extremes = [f64::INFINITY, f64::NEG_INFINITY];
    let mut farthest = ValueWithBar::exact(0.0);
    for k in 0..POINTS {
        let at = range[0] + (range[1] - range[0]) * k as f64 / (POINTS - 1) as f64;
        let [elastic, plastic] = set.map(|run| run.bar_at(name, at));
        let ratio = plastic?.ratio(elastic?);
        extremes = [extremes[0].min(ratio.value), extremes[1].max(ratio.value)];
        let deviation = ratio.difference(ValueWithBar::exact(1.0)).magnitude();
        if deviation.value >= farthest.value {
            farthest = deviation;
        }
    }
    Some((farthest, extremes))
}

fn later(set: [&Evidence; 2]) -> Option<Part> {
    let end = set
        .iter()
        .filter_map(|run| run.cycles()?.last().copied())
        .fold(f64::INFINITY, f64::min);
    let (farthest, extremes) = ratios(set, "kn", [LATER, end])?;
    let measured = format!(
        "plastic over elastic {} to {}",
        four_digits(extremes[0]),
        four_digits(extremes[1])
    );
    Some(Part::of(&set, farthest.below(SAME), measured))
}

fn energies(set: [&Evidence; 2]) -> Option<Part> {
    let (early_deviation, early_ratios) = ratios(set, "dissipated_energy", [0.0, INITIAL])?;
    let (later_deviation, later_ratios) = ratios(set, "dissipated_energy", [LATER, MEET])?;
    let measured = format!(
        "plastic over elastic {} to {} before 10⁵ cycles, {} to {} from 2 to 4 × 10⁶",
        four_digits(early_ratios[0]),
        four_digits(early_ratios[1]),
        four_digits(later_ratios[0]),
        four_digits(later_ratios[1])
    );
    let part = Part::of(
        &set,
        early_deviation.above(SAME).and(later_deviation.below(SAME)),
        measured,
    );
    Some(part.with_cause(|| {
        let slides = set.iter().all(|run| {
            let first = run.sliding.first();
            first.is_some_and(|share| *share > 0.99)
        });
        let amplitudes = set.map(|run| {
            let amplitude = run.response.get("displacement_amplitude");
            amplitude.and_then(|values| values.first().copied()).unwrap_or(f64::NAN)
        });
        let mut texts = Vec::new();
        if early_deviation.value <= SAME && slides {
            texts.push("both joints slide nearly as a whole from the first cycle on: dissipation is then µN times slip for any pressure".to_owned());
        }
        if later_deviation.value > SAME && (amplitudes[1] / amplitudes[0] - 1.0).abs() > SAME {
            texts.push(format!(
                "each joint keeps its unworn motion ({} and {} µm), because neither is updated",
                four_digits(1e6 * amplitudes[0]),
                four_digits(1e6 * amplitudes[1])
            ));
        }
        texts.join("; ")
    }))
}

/// Judges spheres: the one without a limit first, then by decreasing limit.
fn spheres(set: &[&Evidence]) -> Option<Part> {
    let pressures_and_areas: Option<Vec<[f64; 2]>> = set
        .iter()
        .map(|run| {
            Some([
                run.ends("max_pressure")?[0],
                run.ends("contact_area_fraction")?[0],
            ])
        })
        .collect();
    let pressures_and_areas = pressures_and_areas?;
    let capped = set.iter().zip(&pressures_and_areas).skip(1);
    let at_cap = capped.clone().all(|(run, [pressure, _])| {
        let cap = run.scene.pressure_cap.unwrap_or(f64::INFINITY);
        (pressure / cap - 1.0).abs() <= CAP && run.first.share_at_cap > PLATEAU
    });
    let is_load_carried = set
        .iter()
        .all(|run| (run.first.load / run.scene.normal_load - 1.0).abs() <= LOAD);
    let areas: Vec<f64> = pressures_and_areas.iter().map(|[_, area]| *area).collect();
    let is_slight = areas.iter().all(|area| *area < (1.0 + SLIGHT) * areas[0]);
    let texts: Vec<String> = (set.iter().zip(&pressures_and_areas))
        .map(|(run, [pressure, area])| {
            format!(
                "{} MPa on {} of the area, {} of it at the limit",
                four_digits(1e-6 * pressure),
                percent(*area),
                percent(run.first.share_at_cap)
            )
        })
        .collect();
    let holds = at_cap && is_load_carried && is_slight && rises(&areas);
    Some(Part::of(set, Verdict::of(holds), texts.join("; ")))
}

/// Returns the cycles from which on the dissipation of the plastic joint is within 5 %* of the elastic one.
///
/// Returns `None` if the dissipations never agree within 5 %*, or if the pressure cap has no effect.
pub fn cycles_to_agreement(set: [&Evidence; 2]) -> Option<f64> {
    if below_limit(set).is_some() {
        return None;
    }
    let curves = set.map(|run| Some((run.cycles()?, run.column("dissipated_energy")?)));
    let (elastic, plastic) = (curves[0]?, curves[1]?);
    let differs = |n: f64| {
        let ratio = interpolated(plastic.0, plastic.1, n) / interpolated(elastic.0, elastic.1, n);
        (ratio - 1.0).abs() > SAME
    };
    let mut all: Vec<f64> = elastic.0.iter().chain(plastic.0).copied().collect();
    all.sort_by(f64::total_cmp);
    let last = all.iter().rposition(|n| differs(*n));
    match last {
        None => Some(0.0),
        Some(k) => all.get(k + 1).copied(),
    }
}
