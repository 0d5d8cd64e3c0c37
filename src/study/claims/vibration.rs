//! The vibration, and the solvers behind it (claims 23–28, 34–38, 44–46).

use super::contact::{CONVERGED, roughnesses};
use super::words::{list, micrometres, never_falls, percent, rises, spread};
use super::{Evidence, Finding, Loop};
use crate::report::quantity::number;

/// * Deviation of the mean normal load, and its half range, of the bolt load.
const LOAD: [f64; 2] = [0.01, 0.05];
/// * Moments over load times lever.
const MOMENT: f64 = 0.05;
/// * Shift of a loop that is seen, of its half range.
const SHIFT: f64 = 0.01;
/// * What more harmonics may change: amplitude, frequency.
const HARMONICS: [f64; 2] = [0.01, 5e-4];
/// * A slight rise of the resonance.
const SLIGHT: f64 = 0.05;
/// * Of the resonance, that counts as no fall.
const SAME: f64 = 1e-5;
/// * Spread of rates that have converged.
const RATES: f64 = 0.1;
/// * Of µ N.
const SLIDING: f64 = 1e-3;
/// * A difference between fine contact and contact elements that explains another.
const APART: f64 = 0.1;

/// Claims on one run.
pub fn single(run: &Evidence) -> Vec<Finding> {
    let mut findings = Vec::new();
    if run.column("pressure").is_some() || run.column("max_pressure").is_some() {
        findings.extend([uncoupled(run), residuals(run)]);
    }
    if !run.scene.vibrates {
        return findings;
    }
    findings.extend(load(run));
    findings.extend(moments(run));
    findings.extend(shift(run));
    findings.extend(reduction(run));
    if run.cycles().is_some() {
        findings.extend(resonance(run));
        findings.extend(peak(run));
        findings.extend(loops(run));
        findings.extend(sliding(run));
    }
    findings
}

fn load(run: &Evidence) -> Option<Finding> {
    let [mean, half] = run.first.normal_load?;
    let bolt = run.scene.normal_load;
    let measured = format!(
        "unworn: mean {} N, half range {} N",
        number(mean),
        number(half)
    );
    let holds = (mean / bolt - 1.0).abs() <= LOAD[0] && half <= LOAD[1] * bolt;
    Some(Finding::judged(24, &[run], holds, measured))
}

fn moments(run: &Evidence) -> Option<Finding> {
    let most = |name: &str| Some(run.response.get(name)?.iter().copied().fold(0.0, f64::max));
    let bending = most("moment_variation")?;
    let mut measured = format!("half range at most {} of N × lever", percent(bending));
    if let Some(torsion) = most("torsion_variation") {
        measured += &format!(", torsion {}", percent(torsion));
    }
    Some(Finding::judged(25, &[run], bending < MOMENT, measured))
}

fn shift(run: &Evidence) -> Option<Finding> {
    let [mean, half] = run.first.displacement?;
    let measured = format!(
        "mean {} of a half range of {}: {}",
        micrometres(mean),
        micrometres(half),
        percent(mean / half)
    );
    let finding = Finding::judged(26, &[run], mean.abs() > SHIFT * half, measured);
    Some(finding.because(|| {
        let sliding = run.force.first().zip(run.scene.sliding_force);
        match sliding {
            Some((force, limit)) if *force > (1.0 - 10.0 * SLIDING) * limit => {
                format!("the joint slides nearly as a whole (T {} of µN): the mean of its displacement is then hardly determined", percent(force / limit))
            }
            _ => String::new(),
        }
    }))
}

fn reduction(run: &Evidence) -> Option<Finding> {
    let modes = run.modes?;
    let iterations = run.column("kn").map_or(1, <[f64]>::len);
    let measured = format!(
        "{modes} modes and their residual, written once, verified, used by {iterations} iterations"
    );
    Some(Finding::judged(45, &[run], true, measured))
}

fn uncoupled(run: &Evidence) -> Finding {
    let beta = run.scene.dundurs_beta;
    Finding::judged(28, &[run], beta == 0.0, format!("β = {}", number(beta)))
}

fn residuals(run: &Evidence) -> Finding {
    let most = |name: &str| {
        run.column(name)
            .map(|errors| errors.iter().copied().fold(0.0, f64::max))
    };
    let [normal, tangential] = run.scene.tolerances;
    let pairs = [
        ("normal", most("error_normal"), normal),
        ("tangential", most("error_tangential"), tangential),
    ];
    let known: Vec<_> = pairs
        .into_iter()
        .filter_map(|(name, most, bound)| Some((name, most?, bound)))
        .collect();
    let texts: Vec<String> = known
        .iter()
        .map(|(name, most, bound)| format!("{name} {most:.1e} (tolerance {bound:.0e})"))
        .collect();
    let holds = known.iter().all(|(_, most, bound)| most <= bound);
    Finding::judged(44, &[run], holds, texts.join(", "))
}

fn resonance(run: &Evidence) -> Option<Finding> {
    let values = run
        .worn_response
        .get("resonance_frequency")
        .filter(|values| values.len() > 1)?;
    let [first, last] = [values[0], values[values.len() - 1]];
    let change = last / first - 1.0;
    let measured = format!(
        "{} → {} Hz, {}, of {} worn states",
        number(first),
        number(last),
        percent(change),
        values.len()
    );
    let holds = never_falls(values, SAME * first) && change > 0.0 && change < SLIGHT;
    Some(Finding::judged(34, &[run], holds, measured))
}

/// The amplitude stayed while the joint became stiffer: then slip and loop grow.
fn driven_on(run: &Evidence) -> String {
    let amplitude = run.response.get("displacement_amplitude");
    let ends = amplitude.and_then(|values| Some([*values.first()?, *values.last()?]));
    let (Some([before, after]), Some([kt, stiffer])) = (ends, run.ends("kt")) else {
        return String::new();
    };
    if run.updates() == 0 && (after / before - 1.0).abs() < 1e-6 && stiffer > kt {
        format!(
            "no update: the displacement stays {} while kt rises by {}, so that slip (displacement less T/kt) and the area of the loop grow",
            micrometres(after),
            percent(stiffer / kt - 1.0)
        )
    } else {
        String::new()
    }
}

/// The worn joint no longer slides as a whole.
fn in_part(run: &Evidence) -> String {
    let share = |force: Option<&f64>| Some(force? / run.scene.sliding_force?);
    let (Some(first), Some(last)) = (share(run.force.first()), share(run.force.last())) else {
        return String::new();
    };
    let sticking = run.response.get("sticking_elements");
    let sticking = sticking.and_then(|counts| Some((counts.first()?, counts.last()?)));
    match sticking {
        Some((before, after)) if last < first - APART => format!(
            "the worn joint slips in part only (T {} → {} of µN, {before} → {after} elements stick): load gathers where it sticks",
            percent(first),
            percent(last)
        ),
        _ => String::new(),
    }
}

fn peak(run: &Evidence) -> Option<Finding> {
    let [first, last] = run.worn_ends("peak_amplitude")?;
    let [before, after] = run.ends("dissipated_energy")?;
    let (friction, input) = (
        run.worn_ends("friction_energy")?,
        run.worn_ends("input_energy")?,
    );
    let measured = format!(
        "peak {} → {}, fine contact {} → {} J a cycle; of the worn states' input, {} → {} J, friction takes {} → {}",
        micrometres(first),
        micrometres(last),
        number(before),
        number(after),
        number(input[0]),
        number(input[1]),
        percent(friction[0] / input[0]),
        percent(friction[1] / input[1])
    );
    let finding = Finding::judged(35, &[run], last > first && after < before, measured);
    Some(finding.because(|| {
        let on = driven_on(run);
        let balance = if last > first {
            "at resonance a force puts in π F X a cycle, so that a higher peak means more dissipation in all"
        } else {
            ""
        };
        let partial = in_part(run);
        let texts: Vec<&str> = [on.as_str(), balance, partial.as_str()].into_iter().filter(|text| !text.is_empty()).collect();
        texts.join("; ")
    }))
}

/// Slope after the reversal at the largest displacement \[N/m\], and enclosed area \[J\].
fn slope_and_area(cycle: &Loop) -> Option<[f64; 2]> {
    let (u, f) = (&cycle.displacement, &cycle.load);
    let n = u.len();
    let far = (0..n).max_by(|a, b| u[*a].total_cmp(&u[*b]))?;
    // The reversal may be written twice, as the end of one branch and the beginning of the next.
    let next = (1..n)
        .map(|k| (far + k) % n)
        .find(|k| u[far] - u[*k] > 1e-9 * u[far].abs())?;
    let area: f64 = (0..n)
        .map(|k| (k, (k + 1) % n))
        .map(|(k, l)| u[k] * f[l] - u[l] * f[k])
        .sum();
    Some([(f[far] - f[next]) / (u[far] - u[next]), 0.5 * area.abs()])
}

fn loops(run: &Evidence) -> Option<Finding> {
    let ends = (run.first.hysteresis.as_ref(), run.last.hysteresis.as_ref());
    let (Some(first), Some(last)) = ends else {
        return Some(Finding::not_applicable(
            36,
            &[run],
            "no hysteresis tables: output.curves_every is 0",
        ));
    };
    let ([slope, area], [steeper, smaller]) = (slope_and_area(first)?, slope_and_area(last)?);
    let measured = format!(
        "slope after the reversal {} → {} N/µm, area {} → {} J",
        number(1e-6 * slope),
        number(1e-6 * steeper),
        number(area),
        number(smaller)
    );
    let finding = Finding::judged(36, &[run], steeper > slope && smaller < area, measured);
    Some(finding.because(|| driven_on(run)))
}

fn sliding(run: &Evidence) -> Option<Finding> {
    let limit = run.scene.sliding_force.filter(|limit| *limit > 0.0)?;
    let most = run.force.iter().copied().fold(0.0, f64::max) / limit;
    let measured = format!("T at most {} of µN", percent(most));
    if most < 1.0 - SLIDING {
        return Some(Finding::not_applicable(
            46,
            &[run],
            format!("slips in part only: {measured}"),
        ));
    }
    Some(Finding::judged(46, &[run], most <= 1.0 + SLIDING, measured))
}

/// Harmonics 0 to 3 against more of them.
pub fn harmonics(few: &Evidence, many: &Evidence) -> Finding {
    let ends = |name| Some((few.worn_ends(name)?[0], many.worn_ends(name)?[0]));
    let (Some((peak, finer)), Some((f, finer_f))) =
        (ends("peak_amplitude"), ends("peak_frequency"))
    else {
        return Finding::not_applicable(27, &[few, many], "no response of the unworn state");
    };
    let [amplitude, frequency] = [(finer / peak - 1.0).abs(), (finer_f / f - 1.0).abs()];
    let measured = format!(
        "harmonics {}: amplitude {}, frequency {}",
        many.scene.harmonics,
        percent(amplitude),
        percent(frequency)
    );
    let holds = amplitude < HARMONICS[0] && frequency < HARMONICS[1];
    Finding::judged(27, &[few, many], holds, measured)
}

/// Claims on runs of different roughness, smoothest first.
pub fn by_roughness(set: &[&Evidence]) -> Vec<Finding> {
    let mut findings = Vec::new();
    findings.extend(unworn(set));
    findings.extend(worn(set));
    findings.extend(rates(set));
    findings
}

fn of_all(set: &[&Evidence], value: impl Fn(&Evidence) -> Option<f64>) -> Option<Vec<f64>> {
    set.iter().map(|run| value(run)).collect()
}

fn unworn(set: &[&Evidence]) -> Option<Finding> {
    let resonance = of_all(set, |run| Some(run.worn_ends("resonance_frequency")?[0]))?;
    let amplitude = of_all(set, |run| {
        run.response.get("displacement_amplitude")?.first().copied()
    })?;
    let energy = of_all(set, |run| Some(run.ends("dissipated_energy")?[0]))?;
    let softer: Vec<f64> = resonance.iter().map(|f| -f).collect();
    let elements = of_all(set, |run| Some(run.worn_ends("friction_energy")?[0]))?;
    let measured = format!(
        "{}: {} Hz, relative displacement {} µm, {} J a cycle in the fine contact ({} in the contact elements)",
        roughnesses(set),
        list(resonance),
        list(amplitude.iter().map(|u| 1e6 * u)),
        list(energy.iter().copied()),
        list(elements)
    );
    let holds = rises(&softer) && rises(&amplitude) && rises(&energy);
    Some(Finding::judged(23, set, holds, measured))
}

/// What sets the joints apart in the end: renewed elements move less, and wear less.
fn updates_apart(set: &[&Evidence]) -> String {
    let updates: Vec<String> = set.iter().map(|run| run.updates().to_string()).collect();
    let Some(amplitude) = of_all(set, |run| {
        run.response.get("displacement_amplitude")?.last().copied()
    }) else {
        return String::new();
    };
    let mut text = String::new();
    if updates.iter().any(|count| *count != updates[0]) {
        text = format!(
            "the runs were updated {} times, and in the end move by {} µm: the more often updated, the less they slip and wear; the paper's runs here are without updates",
            updates.join(", "),
            list(amplitude.iter().map(|u| 1e6 * u))
        );
    }
    for (run, partial) in set.iter().map(|run| (run, in_part(run))) {
        if !partial.is_empty() {
            let joint = if text.is_empty() { "" } else { "; " };
            text += &format!("{joint}{}: {partial}", run.name);
        }
    }
    let force = of_all(set, |run| {
        run.last.fine_over_elements.get("force_x [N]").copied()
    });
    if let Some(force) =
        force.filter(|ratios| ratios.iter().any(|ratio| (ratio - 1.0).abs() > APART))
    {
        if !text.is_empty() {
            text += "; ";
        }
        text += &format!(
            "the fine contact's force over that of the elements, {}, says how far one mean displacement for all elements carries",
            list(force)
        );
    }
    text
}

fn worn(set: &[&Evidence]) -> Option<Finding> {
    let ends = |name: &'static str| -> Option<[Vec<f64>; 2]> {
        let first = of_all(set, |run| Some(run.worn_ends(name)?[0]))?;
        Some([first, of_all(set, |run| Some(run.worn_ends(name)?[1]))?])
    };
    let (f, peak) = (ends("peak_frequency")?, ends("peak_amplitude")?);
    let [f0, f1, p0, p1] = [&f[0], &f[1], &peak[0], &peak[1]].map(|values| spread(values));
    let measured = format!(
        "{}: worn {} Hz, {} µm; spread of the frequency {} → {}, of the peak {} → {}",
        roughnesses(set),
        list(f[1].iter().copied()),
        list(peak[1].iter().map(|x| 1e6 * x)),
        percent(f0),
        percent(f1),
        percent(p0),
        percent(p1)
    );
    let holds = f1 <= CONVERGED * f0 && p1 <= CONVERGED * p0;
    Some(Finding::judged(37, set, holds, measured).because(|| updates_apart(set)))
}

fn rates(set: &[&Evidence]) -> Option<Finding> {
    let ends: Vec<[f64; 2]> = set
        .iter()
        .map(|run| run.ends("wear_rate"))
        .collect::<Option<_>>()?;
    let [first, last] = [0, 1].map(|end| {
        ends.iter()
            .map(|rate| 1e18 * rate[end])
            .collect::<Vec<f64>>()
    });
    let falls = ends.iter().all(|[first, last]| last < first);
    let measured = format!(
        "{}: {} → {} µm³ a cycle, spread {} → {}",
        roughnesses(set),
        list(first.iter().copied()),
        list(last.iter().copied()),
        percent(spread(&first)),
        percent(spread(&last))
    );
    let holds = rises(&first) && falls && spread(&last) <= RATES;
    Some(Finding::judged(38, set, holds, measured).because(|| {
        let mut texts: Vec<String> = set
            .iter()
            .zip(&ends)
            .filter(|(_, [first, last])| last >= first)
            .map(|(run, _)| (run, driven_on(run)))
            .filter(|(_, text)| !text.is_empty())
            .map(|(run, text)| format!("{}: {text}", run.name))
            .collect();
        texts.extend(Some(updates_apart(set)).filter(|text| !text.is_empty()));
        texts.join("; ")
    }))
}
