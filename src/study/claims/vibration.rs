//! Vibration and solvers (claims 23–28, 34–38, 44, 46, 47).

use super::bars::{ValueWithBar, rises, spread};
use super::contact::{converged, roughnesses, two_or_more};
use super::steps::worst_of;
use super::words::{micrometres, number_list, percent};
use super::{Evidence, HysteresisLoop, Part, Study, Verdict};
use crate::report::quantity::four_digits;

/// * Largest deviation of the mean normal load, and its largest half range, relative to the bolt load.
const LOAD: [f64; 2] = [0.01, 0.05];
/// * Largest ratio of moments to load times lever.
const MOMENT: f64 = 0.05;
/// * Smallest clear shift of a loop, relative to its half range.
const SHIFT: f64 = 0.05;
/// * Largest relative change by more harmonics: amplitude, frequency.
const HARMONICS: [f64; 2] = [0.01, 5e-4];
/// * Largest relative rise of the resonance that counts as slight.
const SLIGHT: f64 = 0.05;
/// * Largest spread of rates that have converged.
const RATES: f64 = 0.1;
/// * Largest deviation of the tangential force from µN, relative to µN.
const SLIDING: f64 = 1e-3;
/// * Smallest relative difference between fine contact and contact elements that explains another difference.
const APART: f64 = 0.1;

/// Judges a claim on the runs of a study.
pub fn parts(claim: u32, study: &Study) -> Vec<Part> {
    let vibrating = || {
        study
            .roughness_series
            .iter()
            .copied()
            .filter(|run| run.scene.vibrates)
    };
    let main = study.main.filter(|run| run.scene.vibrates);
    let wearing = main.filter(|run| run.cycles().is_some());
    let set =
        two_or_more(&study.roughness_series).filter(|set| set.iter().all(|run| run.scene.vibrates));
    let contacts = || {
        let rough = |run: &&Evidence| run.column("max_pressure").is_some();
        study.all.iter().copied().filter(rough)
    };
    let as_list = |part: Option<Part>| part.into_iter().collect();
    match claim {
        23 => as_list(set.and_then(unworn_trend)),
        24 => vibrating().filter_map(load).collect(),
        25 => vibrating().filter_map(moments).collect(),
        26 => as_list(main.and_then(shift)),
        27 => as_list(main.and_then(|main| harmonics(main, &study.harmonics))),
        28 => worst_of(contacts().map(uncoupled)),
        34 => as_list(wearing.and_then(resonance)),
        35 => as_list(wearing.and_then(peak)),
        36 => as_list(wearing.and_then(loops)),
        37 => as_list(set.and_then(worn_convergence)),
        38 => as_list(set.and_then(rates)),
        44 => worst_of(contacts().filter_map(residuals)),
        46 => as_list(wearing.and_then(sliding)),
        _ => vibrating().filter_map(energy_balance).collect(),
    }
}

fn load(run: &Evidence) -> Option<Part> {
    let [mean, half] = run.first.normal_load?;
    let bolt = run.scene.normal_load;
    let measured = format!(
        "mean {} N, half range {} N",
        four_digits(mean),
        four_digits(half)
    );
    let holds = (mean / bolt - 1.0).abs() <= LOAD[0] && half <= LOAD[1] * bolt;
    Some(Part::of(&[run], Verdict::of(holds), measured))
}

fn moments(run: &Evidence) -> Option<Part> {
    let [bending, torsion] = run.first.moments?;
    let lever = run.scene.normal_load * 0.5 * run.scene.length?;
    let measured = format!(
        "at most {} of N × half the side, {} N m; torsion {}",
        percent(bending / lever),
        four_digits(bending),
        percent(torsion / lever)
    );
    Some(Part::of(
        &[run],
        Verdict::of(bending < MOMENT * lever),
        measured,
    ))
}

fn shift(run: &Evidence) -> Option<Part> {
    let [mean, half] = run.first.displacement?;
    let measured = format!(
        "mean {} of a half range of {}: {}",
        micrometres(mean),
        micrometres(half),
        percent(mean / half)
    );
    let slides = run
        .sliding
        .first()
        .is_some_and(|first| *first > 1.0 - SLIDING);
    let verdict = match slides {
        true => Verdict::Undecided,
        false => Verdict::of(mean.abs() > SHIFT * half),
    };
    let part = Part::of(&[run], verdict, measured);
    Some(part.with_cause(|| {
        match slides {
            true => "the joint slides as a whole, so its mean displacement is nearly indeterminate"
                .to_owned(),
            false => String::new(),
        }
    }))
}

/// Compares harmonics 0 to 3 with more harmonics. The difference between the two runs with most harmonics bounds the
/// error of the comparison.
fn harmonics(few: &Evidence, more: &[&Evidence]) -> Option<Part> {
    let most = *more.last()?;
    let value = |run: &Evidence, name: &str| run.worn_ends(name).map(|ends| ends[0]);
    let change = |name: &str| {
        let (few, most) = (value(few, name)?, value(most, name)?);
        let before = match more.len().checked_sub(2) {
            Some(k) => value(more[k], name)?,
            None => most,
        };
        Some(ValueWithBar {
            value: (most / few - 1.0).abs(),
            error: (most - before).abs() / few,
        })
    };
    let (amplitude, frequency) = (change("peak_amplitude")?, change("peak_frequency")?);
    let peaks: Option<Vec<f64>> = [few]
        .iter()
        .chain(more)
        .map(|run| value(run, "peak_amplitude"))
        .collect();
    let measured = format!(
        "amplitude {} µm with harmonics up to {}: it changes by {} ± {}, and the frequency by {} ± {}",
        number_list(peaks?.into_iter().map(|x| 1e6 * x)),
        [few]
            .iter()
            .chain(more)
            .map(|run| highest(run))
            .collect::<Vec<_>>()
            .join(", "),
        percent(amplitude.value),
        percent(amplitude.error),
        percent(frequency.value),
        percent(frequency.error)
    );
    let mut set = vec![few];
    set.extend(more);
    let verdict = amplitude
        .below(HARMONICS[0])
        .and(frequency.below(HARMONICS[1]));
    Some(Part::of(&set, verdict, measured))
}

fn highest(run: &Evidence) -> String {
    let orders = run.scene.harmonics.trim_matches(['[', ']']);
    orders.rsplit(',').next().unwrap_or_default().to_owned()
}

fn uncoupled(run: &Evidence) -> (f64, Part) {
    let beta = run.scene.dundurs_beta;
    let measured = format!("β = {}", four_digits(beta));
    (
        beta.abs(),
        Part::of(&[run], Verdict::of(beta == 0.0), measured),
    )
}

fn residuals(run: &Evidence) -> Option<(f64, Part)> {
    let most = |name: &str| {
        run.column(name)
            .map(|errors| errors.iter().copied().fold(0.0, f64::max))
    };
    let [normal, tangential] = run.scene.tolerances;
    let pairs = [
        ("normal", most("error_normal"), normal),
        ("tangential", most("error_tangential"), tangential),
    ];
    let available: Vec<_> = pairs
        .into_iter()
        .filter_map(|(name, most, bound)| Some((name, most?, bound)))
        .collect();
    let texts: Vec<String> = available
        .iter()
        .map(|(name, most, bound)| format!("{name} {most:.1e} (tolerance {bound:.0e})"))
        .collect();
    let worst = available
        .iter()
        .map(|(_, most, bound)| most / bound)
        .fold(0.0, f64::max);
    let measured = format!("{}, {}", run.name, texts.join(", "));
    Some((worst, Part::of(&[run], Verdict::of(worst <= 1.0), measured)))
}

fn resonance(run: &Evidence) -> Option<Part> {
    let bars = run
        .worn_bars("peak_frequency")
        .filter(|bars| bars.len() > 1)?;
    let (first, last) = (bars[0], bars[bars.len() - 1]);
    let change = last.ratio(first).difference(ValueWithBar::exact(1.0));
    let measured = format!(
        "{} Hz: {}",
        bars.iter()
            .map(|bar| format!("{:.2}", bar.value))
            .collect::<Vec<_>>()
            .join(", "),
        percent(change.value)
    );
    let above = Verdict::all(bars[1..].iter().map(|bar| bar.difference(first).above(0.0)));
    Some(Part::of(&[run], above.and(change.below(SLIGHT)), measured))
}

/// Explains a growing loop: without updates the amplitude is constant while the joint becomes stiffer.
fn constant_amplitude_cause(run: &Evidence) -> String {
    let amplitude = run.response.get("displacement_amplitude");
    let ends = amplitude.and_then(|values| Some([*values.first()?, *values.last()?]));
    let (Some([before, after]), Some([kt, stiffer])) = (ends, run.ends("kt")) else {
        return String::new();
    };
    if run.updates() == 0 && (after / before - 1.0).abs() < 1e-6 && stiffer > kt {
        format!(
            "without updates the displacement stays {} while kt rises by {}, so slip (displacement − T/kt) and the area of the loop grow",
            micrometres(after),
            percent(stiffer / kt - 1.0)
        )
    } else {
        String::new()
    }
}

/// Explains a change by partial slip: the worn joint no longer slides as a whole.
fn partial_slip_cause(run: &Evidence) -> String {
    let (Some(&first), Some(&last)) = (run.sliding.first(), run.sliding.last()) else {
        return String::new();
    };
    let sticking = run.response.get("sticking_elements");
    let sticking = sticking.and_then(|counts| Some((counts.first()?, counts.last()?)));
    match sticking {
        Some((before, after)) if last < first - APART => format!(
            "the worn joint is in partial slip (T {} → {} of µN, {before} → {after} elements stick): load concentrates where it sticks",
            percent(first),
            percent(last)
        ),
        _ => String::new(),
    }
}

fn peak(run: &Evidence) -> Option<Part> {
    let [first, last] = run.worn_end_bars("peak_amplitude")?;
    let [before, after] = run.worn_end_bars("friction_energy")?;
    let (input, viscous) = (
        run.worn_ends("input_energy")?,
        run.worn_ends("viscous_energy")?,
    );
    let share = viscous[0] / input[0];
    let measured = format!(
        "peak {} → {}; friction {} → {} J per cycle, of {} → {} J supplied",
        micrometres(first.value),
        micrometres(last.value),
        four_digits(before.value),
        four_digits(after.value),
        four_digits(input[0]),
        four_digits(input[1])
    );
    let higher = last.difference(first).above(0.0);
    let part = Part::of(
        &[run],
        higher.and(before.difference(after).above(0.0)),
        measured,
    );
    Some(part.with_cause(|| {
        let (rise, rule) = (
            last.value / first.value - 1.0,
            "at resonance π F X = E_friction + c X². If the peak rises by a fraction x, friction falls only if (2 + x) times the damping share of the energy is above 1",
        );
        let balance = match rise > 0.0 {
            true => format!(
                "{rule}. The damping share is {}, which makes {}",
                percent(share),
                four_digits((2.0 + rise) * share)
            ),
            false => format!("{rule}. The damping share is {}, and the peak does not rise", percent(share)),
        };
        let partial = partial_slip_cause(run);
        let texts: Vec<&str> = [balance.as_str(), partial.as_str()].into_iter().filter(|text| !text.is_empty()).collect();
        texts.join("; ")
    }))
}

/// Returns the slope after the reversal at the largest displacement \[N/m\], and the enclosed area \[J\].
fn slope_and_area(cycle: &HysteresisLoop) -> Option<[f64; 2]> {
    let (u, f) = (&cycle.displacement, &cycle.load);
    let n = u.len();
    let reversal = (0..n).max_by(|a, b| u[*a].total_cmp(&u[*b]))?;
    // The reversal may be stored twice, as the end of one branch and the beginning of the next.
    let next = (1..n)
        .map(|k| (reversal + k) % n)
        .find(|k| u[reversal] - u[*k] > 1e-9 * u[reversal].abs())?;
    let area: f64 = (0..n)
        .map(|k| (k, (k + 1) % n))
        .map(|(k, l)| u[k] * f[l] - u[l] * f[k])
        .sum();
    Some([
        (f[reversal] - f[next]) / (u[reversal] - u[next]),
        0.5 * area.abs(),
    ])
}

/// Returns the area of a loop divided by the area of a parallelogram. The parallelogram has the force, the half range
/// and the slope of the loop. The ratio is 1 if the whole joint changes from stick to slip at once.
///
/// The error bar is the relative difference between two energies. One energy is the area of the polygon through the
/// points of the loop. The other energy is the friction energy `friction` of the cycle \[J\].
fn fullness(cycle: &HysteresisLoop, friction: f64) -> Option<ValueWithBar> {
    let [slope, area] = slope_and_area(cycle)?;
    let half = |values: &[f64]| {
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        0.5 * (most - least)
    };
    let (reach, force) = (half(&cycle.displacement), half(&cycle.load));
    let whole = 4.0 * force * (reach - force / slope);
    (whole > 0.0).then(|| ValueWithBar::relative(area / whole, area / friction - 1.0))
}

fn loops(run: &Evidence) -> Option<Part> {
    let [slope, steeper] = run.end_bars("kt")?;
    let [before, after] = run.worn_end_bars("friction_energy")?;
    let [first, last] = run.ends("dissipated_energy")?;
    let fullness_of =
        |moment: &super::Moment, friction| fullness(moment.hysteresis.as_ref()?, friction);
    let (fullness_before, fullness_after) =
        (fullness_of(&run.first, first), fullness_of(&run.last, last));
    let sharper = match (fullness_before, fullness_after) {
        (Some(fullness_before), Some(fullness_after)) => {
            fullness_after.difference(fullness_before).above(0.0)
        }
        _ => Verdict::Undecided,
    };
    let share = |bar: Option<ValueWithBar>| {
        let text = |bar: ValueWithBar| format!("{} ± {}", percent(bar.value), percent(bar.error));
        bar.map_or("–".to_owned(), text)
    };
    let measured = format!(
        "kt {} → {} N/µm; the loop fills {} → {} of its parallelogram; friction {} → {} J per cycle",
        four_digits(1e-6 * slope.value),
        four_digits(1e-6 * steeper.value),
        share(fullness_before),
        share(fullness_after),
        four_digits(before.value),
        four_digits(after.value)
    );
    let verdict = Verdict::all([
        steeper.difference(slope).above(0.0),
        sharper,
        before.difference(after).above(0.0),
    ]);
    Some(Part::of(&[run], verdict, measured).with_cause(|| match fullness_before.zip(fullness_after) {
        Some((fullness_before, fullness_after)) if fullness_after.difference(fullness_before).above(0.0) == Verdict::Undecided => {
            "the loops have too few points to decide which is sharper".to_owned()
        }
        None => "no loops are stored (output.curves_every is 0), or they are in partial slip".to_owned(),
        Some(_) if after.value > before.value => {
            "a sliding loop encloses 4 µN (u − µN/kt): a stiffer joint encloses more unless it moves less".to_owned()
        }
        Some(_) => partial_slip_cause(run),
    }))
}

fn sliding(run: &Evidence) -> Option<Part> {
    // Without friction there is no friction limit.
    run.scene.friction_coefficient.filter(|mu| *mu > 0.0)?;
    let most = run.sliding.iter().copied().reduce(f64::max)?;
    let measured = format!("T at most {} of µN at the same instant", percent(most));
    let holds = (1.0 - SLIDING..=1.0 + SLIDING).contains(&most);
    Some(
        Part::of(&[run], Verdict::of(holds), measured).with_cause(|| {
            if most < 1.0 {
                "the joint is in partial slip".to_owned()
            } else {
                String::new()
            }
        }),
    )
}

/// Compares friction with the input energy, for every iteration and every response of a worn state.
fn energy_balance(run: &Evidence) -> Option<Part> {
    let supplied = run.response.get("input_energy")?;
    let places = 0..supplied.len();
    let fine = places.filter_map(|k| {
        let energy = run.bar("dissipated_energy", k)?;
        Some(energy.ratio(ValueWithBar::exact(supplied[k])))
    });
    let worn = run
        .worn_response
        .get("input_energy")
        .map(Vec::as_slice)
        .unwrap_or_default();
    let friction = run.worn_bars("friction_energy").unwrap_or_default();
    let worn_responses = friction
        .iter()
        .zip(worn)
        .map(|(friction, input)| friction.ratio(ValueWithBar::exact(*input)));
    let largest =
        |bars: Vec<ValueWithBar>| bars.into_iter().max_by(|a, b| a.value.total_cmp(&b.value));
    let (fine, worn_responses) = (largest(fine.collect()), largest(worn_responses.collect()));
    let measured = format!(
        "friction of the fine contact at most {} of the input energy, of the worn responses {}",
        fine.map_or("–".to_owned(), |bar| percent(bar.value)),
        worn_responses.map_or("–".to_owned(), |bar| percent(bar.value))
    );
    let most = [fine, worn_responses].into_iter().flatten();
    let verdict = Verdict::all(most.map(|bar| bar.below(1.0)));
    Some(Part::of(&[run], verdict, measured).with_cause(|| {
        let first = run.response.get("friction_energy").zip(run.column("dissipated_energy"));
        let unworn = first.and_then(|(elements, fine)| Some(fine.first()? / elements.first()?));
        unworn.map_or_else(String::new, |ratio| format!(
            "the vibration stays the same while the contact changes, and the motion that drives the fine contact is only a part of the motion of its elements: unworn, it dissipates {} of their friction energy",
            percent(ratio)
        ))
    }))
}

fn all_values<T>(set: &[&Evidence], value: impl Fn(&Evidence) -> Option<T>) -> Option<Vec<T>> {
    set.iter().map(|run| value(run)).collect()
}

fn values(bars: &[ValueWithBar], scale: f64) -> String {
    number_list(bars.iter().map(|bar| scale * bar.value))
}

fn unworn_trend(set: &[&Evidence]) -> Option<Part> {
    let frequency = all_values(set, |run| Some(run.worn_end_bars("peak_frequency")?[0]))?;
    let amplitude = all_values(set, |run| {
        let first = run.response.get("displacement_amplitude")?.first().copied();
        first.map(ValueWithBar::exact)
    })?;
    let energy = all_values(set, |run| Some(run.worn_end_bars("friction_energy")?[0]))?;
    let softer: Vec<ValueWithBar> = frequency
        .iter()
        .map(|f| ValueWithBar {
            value: -f.value,
            ..*f
        })
        .collect();
    let measured = format!(
        "{}: {} Hz, relative displacement {} µm, friction {} J per cycle",
        roughnesses(set),
        number_list(frequency.iter().map(|f| f.value)),
        values(&amplitude, 1e6),
        values(&energy, 1.0)
    );
    let verdict = Verdict::all([rises(&softer), rises(&amplitude), rises(&energy)]);
    Some(Part::of(set, verdict, measured).with_cause(|| {
        "a sliding joint dissipates 4 µN (u − µN/kt) per cycle of the energy π F X that the exciter supplies at the peak: if a rougher joint lowers X, less energy is left for friction".to_owned()
    }))
}

/// Explains why the joints differ at the end. Joints with more updates of the elements slip less and wear less.
fn update_cause(set: &[&Evidence]) -> String {
    let updates: Vec<String> = set.iter().map(|run| run.updates().to_string()).collect();
    let Some(amplitude) = all_values(set, |run| {
        run.response.get("displacement_amplitude")?.last().copied()
    }) else {
        return String::new();
    };
    let mut text = String::new();
    if updates.iter().any(|count| *count != updates[0]) {
        text = format!(
            "the runs were updated {} times, and their final displacement is {} µm: more updates mean less slip and wear; the paper's runs for this claim have no updates",
            updates.join(", "),
            number_list(amplitude.iter().map(|u| 1e6 * u))
        );
    }
    for (run, partial) in set.iter().map(|run| (run, partial_slip_cause(run))) {
        if !partial.is_empty() {
            let joint = if text.is_empty() { "" } else { "; " };
            text += &format!("{joint}{}: {partial}", run.name);
        }
    }
    let force = all_values(set, |run| {
        run.last
            .fine_over_elements
            .get("force_along_motion [N]")
            .copied()
    });
    if let Some(force) =
        force.filter(|ratios| ratios.iter().any(|ratio| (ratio - 1.0).abs() > APART))
    {
        if !text.is_empty() {
            text += "; ";
        }
        text += &format!(
            "the force of the fine contact is {} of the force of the elements, which shows how well one mean displacement represents all elements",
            number_list(force)
        );
    }
    text
}

fn worn_convergence(set: &[&Evidence]) -> Option<Part> {
    let ends = |name: &'static str| -> Option<[Vec<ValueWithBar>; 2]> {
        let first = all_values(set, |run| Some(run.worn_end_bars(name)?[0]))?;
        Some([
            first,
            all_values(set, |run| Some(run.worn_end_bars(name)?[1]))?,
        ])
    };
    let (f, peak) = (ends("peak_frequency")?, ends("peak_amplitude")?);
    let [f0, f1, p0, p1] = [&f[0], &f[1], &peak[0], &peak[1]].map(|values| spread(values));
    let measured = format!(
        "{}: {} → {} Hz, {} → {} µm; spread of the frequency {} → {}, of the peak {} → {}",
        roughnesses(set),
        number_list(f[0].iter().map(|f| f.value)),
        number_list(f[1].iter().map(|f| f.value)),
        values(&peak[0], 1e6),
        values(&peak[1], 1e6),
        percent(f0.value),
        percent(f1.value),
        percent(p0.value),
        percent(p1.value)
    );
    let verdict = converged(f0, f1).and(converged(p0, p1));
    Some(Part::of(set, verdict, measured).with_cause(|| update_cause(set)))
}

fn rates(set: &[&Evidence]) -> Option<Part> {
    let ends: Vec<[ValueWithBar; 2]> = all_values(set, |run| run.end_bars("wear_rate"))?;
    let [first, last] = [0, 1].map(|end| {
        ends.iter()
            .map(|rate| rate[end])
            .collect::<Vec<ValueWithBar>>()
    });
    let falls = Verdict::all(
        ends.iter()
            .map(|[first, last]| first.difference(*last).above(0.0)),
    );
    let (before, after) = (spread(&first), spread(&last));
    let measured = format!(
        "{}: {} → {} µm³ per cycle, spread {} → {}",
        roughnesses(set),
        values(&first, 1e18),
        values(&last, 1e18),
        percent(before.value),
        percent(after.value)
    );
    let verdict = Verdict::all([rises(&first), falls, after.below(RATES)]);
    Some(Part::of(set, verdict, measured).with_cause(|| {
        let mut texts: Vec<String> = set
            .iter()
            .zip(&ends)
            .filter(|(_, [first, last])| last.value >= first.value)
            .map(|(run, _)| (run, constant_amplitude_cause(run)))
            .filter(|(_, text)| !text.is_empty())
            .map(|(run, text)| format!("{}: {text}", run.name))
            .collect();
        texts.extend(Some(update_cause(set)).filter(|text| !text.is_empty()));
        texts.join("; ")
    }))
}
