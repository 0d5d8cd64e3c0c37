//! Tests of the cycles at which a history passes a level, by closed forms and by the monotone cubic of SciPy 1.16.

use fretwear::milestones::{Crossing, Figure, History, Milestone, Target};

fn history(cycles: &[f64], values: &[f64], bars: &[f64]) -> History {
    History {
        cycles: cycles.to_vec(),
        values: values.to_vec(),
        bars: bars.to_vec(),
        bend: 0.0,
    }
}

fn of(history: &History, level: f64) -> Crossing {
    history
        .crossing(level)
        .expect("a level that differs from the first value")
}

fn near(found: Option<f64>, wanted: f64) {
    let found = found.expect("a crossing");
    assert!((found / wanted - 1.0).abs() < 1e-9, "{found}, not {wanted}");
}

const CYCLES: [f64; 6] = [0.0, 3.0, 5.0, 9.0, 10.0, 16.0];
const VALUES: [f64; 6] = [0.0, 4.0, 5.0, 5.5, 5.2, 1.0];

#[test]
fn between_its_rows_a_history_is_a_monotone_cubic() {
    let history = history(&CYCLES, &VALUES, &[0.0; 6]);
    // The error bar includes the difference between the cubic and the straight line, so only the nominal cycles are compared.
    near(of(&history, 2.0).nominal, 1.202235230663567);
    near(of(&history, 4.5).nominal, 3.7751499831344058);
    // The expected values are from PchipInterpolator of SciPy at 7 and 9.5 cycles.
    near(of(&history, 5.357142857142857).nominal, 7.0);
    // A falling history passes the level at the same cycles.
    let falling: Vec<f64> = VALUES.iter().map(|value| 10.0 - value).collect();
    let history = self::history(&CYCLES, &falling, &[0.0; 6]);
    near(of(&history, 8.0).nominal, 1.202235230663567);
}

#[test]
fn a_straight_history_passes_between_what_its_bar_says() {
    let history = history(
        &[0.0, 1000.0, 4000.0],
        &[30.0, 29.0, 26.0],
        &[0.0, 0.1, 0.4],
    );
    let found = of(&history, 28.0);
    near(found.nominal, 2000.0);
    // The history with its error bar is 30 - t/1000 ∓ t/10 000.
    near(found.earliest, 2000.0 / 1.1);
    near(found.latest, 2000.0 / 0.9);
    assert!(found.is_known && found.returns.is_none(), "{found:?}");
    // The value passes the level before the last row, but the complete error bar does not.
    let found = of(&history, 26.1);
    near(found.earliest, 3900.0 / 1.1);
    near(found.nominal, 3900.0);
    assert_eq!(found.latest, None);
    // Only the error bar passes the level.
    let found = of(&history, 25.8);
    assert_eq!((found.nominal, found.latest), (None, None));
    near(found.earliest, 4200.0 / 1.1);
    assert!(found.is_known);
    // Neither the value nor the error bar passes the level.
    let none = Crossing {
        is_known: true,
        ..Crossing::default()
    };
    assert_eq!(of(&history, 25.0), none);
    assert_eq!(of(&history, 31.0), none);
}

#[test]
fn a_bar_larger_than_the_change_says_nothing() {
    let history = history(&[0.0, 10.0, 20.0], &[970.0, 971.0, 971.6], &[0.0, 5.0, 8.9]);
    let found = of(&history, 971.0);
    assert!(
        !found.is_known && found.latest.is_none() && found.earliest.is_some(),
        "{found:?}"
    );
    let found = of(&history, 975.0);
    assert!(
        !found.is_known && found.nominal.is_none() && found.earliest.is_some(),
        "{found:?}"
    );
    // The history is known not to pass a level outside the error bar.
    assert_eq!(of(&history, 990.0).earliest, None);
}

#[test]
fn a_history_that_turns_passes_once_and_says_that_it_is_back() {
    let history = history(
        &[0.0, 2.0, 4.0, 6.0],
        &[0.0, 2.0, 4.0, 0.0],
        &[0.0, 0.0, 0.0, 0.5],
    );
    let found = of(&history, 1.0);
    assert!(found.nominal < Some(2.0), "{found:?}");
    let back = found.returns.expect("a return");
    assert!(back > 4.0 && back < 6.0, "{back}");
    // The history turns before the level.
    assert_eq!(of(&history, 4.5).nominal, None);
    // The history does not pass a level on the other side of its first value.
    assert_eq!(of(&history, -1.0).earliest, None);
}

#[test]
fn how_a_history_begins_is_not_known_to_the_last_digit() {
    let straight = history(&[0.0, 8.0, 16.0], &[0.0, 8.0, 16.0], &[0.0; 3]);
    let bent = History {
        bend: 0.1,
        ..straight.clone()
    };
    let found = of(&bent, 4.0);
    near(found.nominal, 4.0);
    // At the earliest cycles, t + 0.1 · 8 · 4 · s(1 - s) with s = t/8 equals 4.
    let earliest = found.earliest.expect("passed");
    let s = earliest / 8.0;
    assert!(
        (earliest + 0.8 * 4.0 * s * (1.0 - s) - 4.0).abs() < 1e-9,
        "{found:?}"
    );
    assert_eq!(of(&bent, 12.0), of(&straight, 12.0));
}

#[test]
fn no_history_passes_where_it_begins() {
    let history = history(&[0.0, 1.0], &[3.0, 4.0], &[0.0, 0.0]);
    assert_eq!(history.crossing(3.0), None);
    assert_eq!(history.crossing(f64::NAN), None);
    assert_eq!(History::default().crossing(1.0), None);
    // The history of a run with only its first state has no crossing.
    let first = self::history(&[0.0], &[3.0], &[0.1]);
    assert_eq!(of(&first, 4.0).earliest, None);
}

#[test]
fn milestones_are_values_parts_and_changes() {
    let of =
        |figure, text| Milestone::parse(figure, text).unwrap_or_else(|error| panic!("{error}"));
    let level = |figure, text, unworn: f64| of(figure, text).level(unworn);
    assert_eq!(level(Figure::Preload, "90%", 30e3), 27e3);
    assert_eq!(level(Figure::Preload, "27 kN", 30e3), 27e3);
    assert_eq!(level(Figure::Preload, "-3kN", 30e3), 27e3);
    assert_eq!(level(Figure::Preload, "\u{2212}3kN", 30e3), 27e3);
    assert_eq!(level(Figure::Resonance, "+1Hz", 970.0), 971.0);
    assert_eq!(level(Figure::Resonance, " -10 % ", 970.0), 873.0);
    assert_eq!(of(Figure::Depth, "10um").target, Target::Value(10e-6));
    assert_eq!(of(Figure::Volume, "1mm^3").target, Target::Value(1e-9));
    let stiffness = |text| Milestone::parse_stiffness(text);
    let found = stiffness("kt-5%").expect("a milestone");
    assert_eq!((found.figure, found.level(2.0)), (Figure::Kt, 1.9));
    assert_eq!(
        stiffness("kn=250 N/um").expect("one").target,
        Target::Value(250e6)
    );
    for (wrong, says) in [
        (
            stiffness("+10%"),
            "does not say which stiffness: write kn+10%",
        ),
        (
            Milestone::parse(Figure::Depth, "50%"),
            "the largest depth of an unworn joint is zero",
        ),
        (
            Milestone::parse(Figure::Preload, "90"),
            "write 90%, -3kN or 27kN",
        ),
        (Milestone::parse(Figure::Preload, "100%"), "is no change"),
        (Milestone::parse(Figure::Resonance, "+0Hz"), "is no change"),
        (Milestone::parse(Figure::Volume, "-1mm^3"), "is no change"),
    ] {
        let said = wrong.expect_err(says).to_string();
        assert!(said.contains(says), "{said}");
    }
}
