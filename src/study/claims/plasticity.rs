//! The hardness limit (claims 39–43).

use super::bars::Bar;
use super::words::{interpolated, percent, rises};
use super::{Evidence, Part, Study, Verdict};
use crate::report::quantity::number;

/// * Of the cap: rounding.
const CAP: f64 = 1e-9;
/// * Of the load.
const LOAD: f64 = 1e-6;
/// * Share of the cells in contact that makes a plateau.
const PLATEAU: f64 = 0.01;
/// * Growth of an area that is small, or slight.
const SLIGHT: f64 = 0.5;
/// From here on the stiffnesses agree, and the rates \[cycles\] [A §4d(iii)].
const LATER: f64 = 2e6;
/// * Stiffnesses and rates that are nearly the same.
const SAME: f64 = 0.05;
/// * The initial phase, in which dissipation differs, ends here \[cycles\].
const INITIAL: f64 = 1e5;
/// * Until when "approximately 2 million cycles" are looked at \[cycles\].
const MEET: f64 = 4e6;
/// Cycles at which ratios are looked at in a range.
const POINTS: usize = 40;

/// What the runs of a study say of a claim.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    if claim == 39 {
        let spheres = (study.spheres.len() > 1).then(|| spheres(&study.spheres));
        return spheres.flatten().into_iter().collect();
    }
    let Some(set) = study.plastic else {
        return Vec::new();
    };
    let reached = set.iter().all(|run| super::steps::reaches(run, MEET));
    let found = match claim {
        40 => peaks(set),
        41 => start(set),
        42 if reached => later(set),
        43 if reached => energies(set),
        _ => None,
    };
    let unlimited = || Some(Part::of(&set, Verdict::Undecided, below_limit(set)?));
    found
        .map(|part| unlimited().unwrap_or(part))
        .into_iter()
        .collect()
}

/// That the elastic joint nowhere bears as much as the limit, so that both joints are one; none where it does.
pub fn below_limit(set: [&Evidence; 2]) -> Option<String> {
    let (most, cap) = (set[0].ends("max_pressure")?[0], set[1].scene.pressure_cap?);
    (most <= cap).then(|| {
        format!(
            "the limit limits nothing: the largest pressure of the elastic joint is {} of {} MPa",
            number(1e-6 * most),
            number(1e-6 * cap)
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
        number(1e-6 * elastic),
        number(1e-6 * plastic),
        percent(share),
        number(1e-6 * cap)
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
        number(1e-6 * kn.value),
        number(1e-6 * lower.value)
    );
    let slightly = larger > area && larger < (1.0 + SLIGHT) * area;
    let verdict = Verdict::of(slightly).and(kn.less(lower).above(0.0));
    let part = Part::of(&set, verdict, measured);
    Some(part.because(|| {
        if larger >= (1.0 + SLIGHT) * area {
            "elastic peaks here go far beyond the limit, so that much more has to touch: the area of the elastic joint hangs on the cells of the grid".to_owned()
        } else {
            String::new()
        }
    }))
}

/// The plastic over the elastic joint where that is farthest from 1 in a range of cycles, and the smallest and the largest.
fn ratios(set: [&Evidence; 2], name: &str, range: [f64; 2]) -> Option<(Bar, [f64; 2])> {
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    let mut farthest = Bar::exact(0.0);
    for k in 0..POINTS {
        let at = range[0] + (range[1] - range[0]) * k as f64 / (POINTS - 1) as f64;
        let [elastic, plastic] = set.map(|run| run.bar_at(name, at));
        let ratio = plastic?.over(elastic?);
        found = [found[0].min(ratio.value), found[1].max(ratio.value)];
        let off = ratio.less(Bar::exact(1.0)).size();
        if off.value >= farthest.value {
            farthest = off;
        }
    }
    Some((farthest, found))
}

fn later(set: [&Evidence; 2]) -> Option<Part> {
    let end = set
        .iter()
        .filter_map(|run| run.cycles()?.last().copied())
        .fold(f64::INFINITY, f64::min);
    let (farthest, found) = ratios(set, "kn", [LATER, end])?;
    let measured = format!(
        "plastic over elastic {} to {}",
        number(found[0]),
        number(found[1])
    );
    Some(Part::of(&set, farthest.below(SAME), measured))
}

fn energies(set: [&Evidence; 2]) -> Option<Part> {
    let (farthest, early) = ratios(set, "dissipated_energy", [0.0, INITIAL])?;
    let (off, meet) = ratios(set, "dissipated_energy", [LATER, MEET])?;
    let measured = format!(
        "plastic over elastic {} to {} before 10⁵ cycles, {} to {} from 2 to 4 × 10⁶",
        number(early[0]),
        number(early[1]),
        number(meet[0]),
        number(meet[1])
    );
    let part = Part::of(&set, farthest.above(SAME).and(off.below(SAME)), measured);
    Some(part.because(|| {
        let slides = set.iter().all(|run| {
            let first = run.sliding.first();
            first.is_some_and(|share| *share > 0.99)
        });
        let moves = set.map(|run| {
            let amplitude = run.response.get("displacement_amplitude");
            amplitude.and_then(|values| values.first().copied()).unwrap_or(f64::NAN)
        });
        let mut texts = Vec::new();
        if farthest.value <= SAME && slides {
            texts.push("both slide nearly as a whole from the first cycle on: dissipation is then µN times slip, whatever the pressure is".to_owned());
        }
        if off.value > SAME && (moves[1] / moves[0] - 1.0).abs() > SAME {
            texts.push(format!(
                "each joint keeps its own unworn motion, {} and {} µm, as neither is updated",
                number(1e6 * moves[0]),
                number(1e6 * moves[1])
            ));
        }
        texts.join("; ")
    }))
}

/// Spheres, that without a limit first, then from the largest limit down.
fn spheres(set: &[&Evidence]) -> Option<Part> {
    let found: Option<Vec<[f64; 2]>> = set
        .iter()
        .map(|run| {
            Some([
                run.ends("max_pressure")?[0],
                run.ends("contact_area_fraction")?[0],
            ])
        })
        .collect();
    let found = found?;
    let capped = set.iter().zip(&found).skip(1);
    let at_cap = capped.clone().all(|(run, [pressure, _])| {
        let cap = run.scene.pressure_cap.unwrap_or(f64::INFINITY);
        (pressure / cap - 1.0).abs() <= CAP && run.first.share_at_cap > PLATEAU
    });
    let borne = set
        .iter()
        .all(|run| (run.first.load / run.scene.normal_load - 1.0).abs() <= LOAD);
    let areas: Vec<f64> = found.iter().map(|[_, area]| *area).collect();
    let small = areas.iter().all(|area| *area < (1.0 + SLIGHT) * areas[0]);
    let texts: Vec<String> = (set.iter().zip(&found))
        .map(|(run, [pressure, area])| {
            format!(
                "{} MPa on {} of the area, {} of it at the limit",
                number(1e-6 * pressure),
                percent(*area),
                percent(run.first.share_at_cap)
            )
        })
        .collect();
    let holds = at_cap && borne && small && rises(&areas);
    Some(Part::of(set, Verdict::of(holds), texts.join("; ")))
}

/// Cycles from which on the dissipation of a plastic joint is within 5 %* of that of the elastic one; none if it never is, and where the
/// limit limits nothing.
pub fn cycles_to_agreement(set: [&Evidence; 2]) -> Option<f64> {
    if below_limit(set).is_some() {
        return None;
    }
    let curves = set.map(|run| Some((run.cycles()?, run.column("dissipated_energy")?)));
    let (elastic, plastic) = (curves[0]?, curves[1]?);
    let apart = |n: f64| {
        let ratio = interpolated(plastic.0, plastic.1, n) / interpolated(elastic.0, elastic.1, n);
        (ratio - 1.0).abs() > SAME
    };
    let mut all: Vec<f64> = elastic.0.iter().chain(plastic.0).copied().collect();
    all.sort_by(f64::total_cmp);
    let last = all.iter().rposition(|n| apart(*n));
    match last {
        None => Some(0.0),
        Some(k) => all.get(k + 1).copied(),
    }
}
