//! The worn surface (claims 8–14).

use std::f64::consts::PI;

use super::steps::worst_of;
use super::words::{interpolated, micrometres, never_falls, percent};
use super::{Evidence, Part, Study, Verdict};
use crate::report::quantity::four_digits;

/// * Largest relative increase of Rq that counts as no increase.
const RISE: f64 = 1e-4;
/// * Largest relative difference between the fall of the mean height and the worn volume.
const MEAN: f64 = 1e-9;
/// * Largest skewness of a surface that counts as symmetric.
const SYMMETRIC: f64 = 0.1;
/// * Largest deviation of the kurtosis from 3 at which a surface counts as Gaussian.
const NORMAL: f64 = 0.2;
/// Kurtosis of a Gaussian surface.
const GAUSSIAN: f64 = 3.0;
/// * Cycles that count as "only a few": a hundredth of the study.
const FEW: f64 = 1e5;
/// * Smallest significant skewness, in standard deviations of the skewness of Gaussian surfaces.
const SIGNIFICANT: f64 = 3.0;
/// * Smallest changes that count as strong. The first value is for the mean height and for Rq, both divided by the
///   unworn Rq. The second value is for Sk, and the third value is for Ku.
const STRONG: [f64; 3] = [0.05, 0.3, 0.3];

/// Mean removed height, relative to Rq, at which the kurtosis of a flatly clipped Gaussian surface has returned to 3.
const CLIPPED: f64 = 0.13;

/// Judges a claim on the runs of a study.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    let worn = || (study.roughness_series.iter().copied()).filter(|run| run.cycles().is_some());
    // The wear of a single cycle is below the rounding errors of the mean height.
    let all = || {
        let is_unworn = |run: &Evidence| {
            study
                .harmonics
                .iter()
                .any(|other| std::ptr::eq(*other, run))
        };
        let rough = study
            .all
            .iter()
            .copied()
            .filter(|run| run.scene.rq.is_some());
        rough.filter(move |run| !is_unworn(run))
    };
    match claim {
        8 => study.main.and_then(valleys).into_iter().collect(),
        9 => worn().filter_map(rq_decrease).collect(),
        10 => worst_of(all().filter_map(mean_height)),
        11 => worn().filter_map(skewness).collect(),
        12 => worn().filter_map(kurtosis).collect(),
        13 => worn().filter_map(early_skewness).collect(),
        _ => worn().filter_map(strong_changes).collect(),
    }
}

fn valleys(run: &Evidence) -> Option<Part> {
    run.scene.rq?;
    let worn = run.worn.as_ref()?;
    let measured = format!(
        "{} cells never touched, worn by {} at most; deepest wear {}",
        worn.never_touched,
        micrometres(worn.never_touched_depth),
        micrometres(worn.deepest)
    );
    let holds = worn.never_touched > 0 && worn.never_touched_depth == 0.0 && worn.deepest > 0.0;
    Some(
        Part::of(&[run], Verdict::of(holds), measured).with_cause(|| {
            if worn.never_touched == 0 {
                "no valley is left: all cells have touched".to_owned()
            } else if run.scene.explicit.is_none() {
                "the steps are not explicit: a cell may touch within a step but not at its ends"
                    .to_owned()
            } else {
                String::new()
            }
        }),
    )
}

/// Returns the first and the last value.
fn ends(values: &[f64]) -> [f64; 2] {
    [values[0], values[values.len() - 1]]
}

/// Formats the first and the last value of a statistic of the heights without their form.
fn formless_text(run: &Evidence, name: &str, scale: f64) -> String {
    let Some(values) = run.formless.get(name) else {
        return String::new();
    };
    let [first, last] = ends(values);
    format!(
        "; without the form {} → {}",
        four_digits(scale * first),
        four_digits(scale * last)
    )
}

/// Explains a failure: checks if the criterion is met without the form, and reports the mean removed height.
fn form_cause(run: &Evidence, holds: impl Fn(&Evidence) -> Option<bool>) -> String {
    let (Some(heights), Some(rq)) = (run.ends("mean_height"), run.scene.rq) else {
        return String::new();
    };
    let removed = (heights[0] - heights[1]) / rq;
    let mut formless = run.clone();
    formless.summary.extend(run.formless.clone());
    let holds_formless = !run.formless.is_empty() && holds(&formless) == Some(true);
    match holds_formless {
        true => format!(
            "the statistics measure the worn form, not the roughness: {} Rq are worn away on average; without the form it holds",
            four_digits(removed)
        ),
        false => format!("{} Rq are worn away on average", four_digits(removed)),
    }
}

/// Explains a failure as [`form_cause`] does, and adds the effect of little wear on the kurtosis.
fn kurtosis_cause(run: &Evidence, holds: impl Fn(&Evidence) -> Option<bool>) -> String {
    let is_clipped = run.ends("mean_height").zip(run.scene.rq);
    let is_clipped = is_clipped.is_some_and(|([before, after], rq)| before - after < CLIPPED * rq);
    let form = form_cause(run, holds);
    match is_clipped {
        true => format!("{form}; flat clipping of a Gaussian surface first lowers Ku"),
        false => form,
    }
}

fn is_falling(run: &Evidence) -> Option<bool> {
    let rq = run.column("rq")?;
    let most = rq.iter().copied().fold(0.0, f64::max);
    let [first, last] = ends(rq);
    Some(most <= first * (1.0 + RISE) && last < first)
}

fn rq_decrease(run: &Evidence) -> Option<Part> {
    run.scene.rq?;
    let holds = is_falling(run)?;
    let [first, last] = ends(run.column("rq")?);
    let measured = format!(
        "{} → {} µm{}",
        four_digits(1e6 * first),
        four_digits(1e6 * last),
        formless_text(run, "rq", 1e6)
    );
    Some(Part::of(&[run], Verdict::of(holds), measured).with_cause(|| form_cause(run, is_falling)))
}

fn mean_height(run: &Evidence) -> Option<(f64, Part)> {
    let (heights, volumes) = (run.column("mean_height")?, run.column("wear_volume")?);
    let area = run.area?;
    let removed = volumes[volumes.len() - 1] / area;
    let deviations = heights
        .iter()
        .zip(volumes)
        .map(|(height, volume)| (heights[0] - height - volume / area).abs());
    let worst = deviations.fold(0.0, f64::max) / removed;
    let falling: Vec<f64> = heights.iter().map(|height| -height).collect();
    let measured = format!(
        "{}, fell by {}, {worst:.1e} off volume / area",
        run.name,
        micrometres(removed)
    );
    let holds = worst <= MEAN && never_falls(&falling, 0.0);
    Some((worst, Part::of(&[run], Verdict::of(holds), measured)))
}

fn is_skewed(run: &Evidence) -> Option<bool> {
    let [first, last] = ends(run.column("sk")?);
    Some(first.abs() < SYMMETRIC && last < -SYMMETRIC)
}

fn skewness(run: &Evidence) -> Option<Part> {
    run.scene.rq?;
    let holds = is_skewed(run)?;
    let [first, last] = ends(run.column("sk")?);
    let measured = format!(
        "{} → {}{}",
        four_digits(first),
        four_digits(last),
        formless_text(run, "sk", 1.0)
    );
    Some(Part::of(&[run], Verdict::of(holds), measured).with_cause(|| form_cause(run, is_skewed)))
}

fn is_peaked(run: &Evidence) -> Option<bool> {
    let [first, last] = ends(run.column("ku")?);
    Some((first - GAUSSIAN).abs() < NORMAL && last > GAUSSIAN && last > first)
}

fn kurtosis(run: &Evidence) -> Option<Part> {
    run.scene.rq?;
    let holds = is_peaked(run)?;
    let ku = run.column("ku")?;
    let [first, last] = ends(ku);
    let least = ku.iter().copied().fold(f64::INFINITY, f64::min);
    let measured = format!(
        "{} → {}, least {}{}",
        four_digits(first),
        four_digits(last),
        four_digits(least),
        formless_text(run, "ku", 1.0)
    );
    Some(
        Part::of(&[run], Verdict::of(holds), measured)
            .with_cause(|| kurtosis_cause(run, is_peaked)),
    )
}

/// Returns the standard deviation of the skewness of Gaussian surfaces with the area and the correlation lengths of the
/// run.
fn scatter(run: &Evidence) -> Option<f64> {
    let [clx, cly] = run.scene.correlation_length?;
    // The variance of the skewness is 6 / (independent cells), and the number of independent cells is A / ∫ρ³. The
    // integral is ∫ρ³ = π clx cly / 3 for ρ = exp(−(x²/clx² + y²/cly²)).
    Some((2.0 * PI * clx * cly / run.area?).sqrt())
}

fn early_skewness(run: &Evidence) -> Option<Part> {
    let (cycles, sk) = (run.cycles()?, run.column("sk")?);
    let sigma = scatter(run)?;
    if cycles[cycles.len() - 1] < FEW {
        return None;
    }
    let skewness = interpolated(cycles, sk, FEW);
    let measured = format!(
        "Sk {} at 10⁵ cycles; σ of surfaces of this size {}",
        four_digits(skewness),
        four_digits(sigma)
    );
    let holds = skewness.abs() > SIGNIFICANT * sigma;
    Some(
        Part::of(&[run], Verdict::of(holds), measured).with_cause(|| {
            let crossing = (cycles.iter().zip(sk)).find(|(_, sk)| sk.abs() > SIGNIFICANT * sigma);
            match crossing {
                Some((cycles, _)) => format!(
                    "it takes about {} cycles: fewer cycles wear too little of the surface",
                    four_digits(*cycles)
                ),
                None => "too little of the surface is worn".to_owned(),
            }
        }),
    )
}

/// Returns the changes of Rq (relative), Sk and Ku.
fn changes(run: &Evidence) -> Option<[f64; 3]> {
    let change = |name| {
        let [first, last] = ends(run.column(name)?);
        Some(last - first)
    };
    let rq = run.column("rq")?[0];
    Some([change("rq")? / rq, change("sk")?, change("ku")?])
}

fn is_strong(run: &Evidence) -> Option<bool> {
    let [rq, sk, ku] = changes(run)?;
    let heights = run.ends("mean_height")?;
    let removed = (heights[0] - heights[1]) / run.scene.rq?;
    Some(removed > STRONG[0] && rq < -STRONG[0] && sk < -STRONG[1] && ku > STRONG[2])
}

fn strong_changes(run: &Evidence) -> Option<Part> {
    let holds = is_strong(run)?;
    let [rq, sk, ku] = changes(run)?;
    let heights = run.ends("mean_height")?;
    let mut measured = format!(
        "mean height {} Rq, Rq {}, Sk {}, Ku {}",
        four_digits((heights[1] - heights[0]) / run.scene.rq?),
        percent(rq),
        four_digits(sk),
        four_digits(ku)
    );
    let mut formless = run.clone();
    formless.summary.extend(run.formless.clone());
    if let Some([rq, sk, ku]) = (!run.formless.is_empty())
        .then(|| changes(&formless))
        .flatten()
    {
        measured += &format!(
            "; without the form Rq {}, Sk {}, Ku {}",
            percent(rq),
            four_digits(sk),
            four_digits(ku)
        );
    }
    Some(
        Part::of(&[run], Verdict::of(holds), measured)
            .with_cause(|| kurtosis_cause(run, is_strong)),
    )
}
