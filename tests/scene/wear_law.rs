//! Archard's coefficient and the one per energy: which unit says which, and what becomes of either.

use fretwear::scene::{LAW_BEGUN_WITH, lacks_wear_law};

use super::{CASE, Folder, case_with, replaced};

/// A quotient against the quotient of the same numbers in another unit: a few roundings.
const ROUNDING: f64 = 1e-15;

/// Units of either law, all of 2e-15 in SI.
const OF_BOTH: [&str; 13] = [
    "2e-6 mm^3/(N m)",
    "2e-9 mm^3/(N mm)",
    "2e-6 mm^3/N/m",
    "2e-6 mm^3/Nm",
    "2e-6 mm^3 N^-1 m^-1",
    "2e3 um^3/(N·m)",
    "2e-9 mm^3/(kN um)",
    "2e-3 um^2/N",
    "2e-15 1/Pa",
    "2e-15 /Pa",
    "2e-6 1/GPa",
    "2e-9 /MPa",
    "2e-10 1/bar",
];

/// Units of a coefficient per energy, all of 2e-15 in SI.
const OF_ENERGY: [&str; 5] = [
    "2e3 um^3/J",
    "2e-6 mm^3/J",
    "2e3 um^3/(W s)",
    "2e-15 m s^2/kg",
    "2e-15 m^3/(kg m^2 s^-2)",
];

fn coefficient(unit: &str, sets: &[&str]) -> f64 {
    let coefficient = format!("wear.coefficient={unit}");
    let sets = [&[coefficient.as_str()], sets].concat();
    case_with(&sets).wear.expect("wear").coefficient
}

fn assert_is(found: f64, expected: f64, what: &str) {
    assert!(
        (found / expected - 1.0).abs() < ROUNDING,
        "{what}: {found:e} for {expected:e}"
    );
}

#[test]
fn a_unit_of_both_laws_needs_the_law() {
    for unit in OF_BOTH {
        let text = replaced(CASE, "2e3 um^3/J", unit);
        let faults = Folder::new()
            .with("case.toml", &text)
            .faults("case.toml", &[]);
        let expected = format!(
            "case.toml, line 20: wear.coefficient = \"{unit}\": this unit is that of alpha (volume per dissipated energy) and of Archard's k (volume per load and slip); say which it is: wear.law = \"energy\", or wear.law = \"archard\" (alpha = k/mu)"
        );
        assert_eq!(faults, [expected]);
        assert_is(coefficient(unit, &["wear.law=energy"]), 2e-15, unit);
        assert_is(coefficient(unit, &["wear.law=archard"]), 2e-15 / 0.6, unit);
    }
}

#[test]
fn a_unit_of_energy_is_one_unless_the_law_is_given() {
    for unit in OF_ENERGY {
        assert_is(coefficient(unit, &[]), 2e-15, unit);
        assert_is(coefficient(unit, &["wear.law=energy"]), 2e-15, unit);
        assert_is(coefficient(unit, &["wear.law=archard"]), 2e-15 / 0.6, unit);
    }
}

#[test]
fn archards_coefficient_is_divided_by_the_friction_that_is_set() {
    for (friction, mu) in [("0.3", 0.3), ("45 %", 0.45)] {
        let sets = [
            "wear.law=archard",
            &format!("contact.friction_coefficient={friction}"),
        ];
        assert_is(coefficient("2e-15 1/Pa", &sets), 2e-15 / mu, friction);
    }
    // In whatever place both stand.
    let text = replaced(CASE, "2e3 um^3/J\"", "2e-15 1/Pa\"\nlaw = \"archard\"");
    let text = replaced(
        &text,
        "friction_coefficient = 0.6",
        "friction_coefficient = 0.25",
    );
    let scene = Folder::new()
        .with("case.toml", &text)
        .scene("case.toml", &[]);
    assert_is(scene.wear.expect("wear").coefficient, 8e-15, "0.25");
}

#[test]
fn archards_law_needs_friction() {
    let text = replaced(CASE, "2e3 um^3/J\"", "2e-15 1/Pa\"\nlaw = \"archard\"");
    let frictionless = replaced(
        &text,
        "friction_coefficient = 0.6",
        "friction_coefficient = 0",
    );
    let faults = Folder::new()
        .with("case.toml", &frictionless)
        .faults("case.toml", &[]);
    assert_eq!(
        faults,
        [
            "case.toml, line 21: wear.law = \"archard\": alpha = k/mu, and contact.friction_coefficient is 0: give a friction coefficient greater than zero"
        ]
    );
    // A friction that is wrong is the only fault.
    let wrong = replaced(
        &text,
        "friction_coefficient = 0.6",
        "friction_coefficient = -1",
    );
    let faults = Folder::new()
        .with("case.toml", &wrong)
        .faults("case.toml", &[]);
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(
        faults[0].contains("contact.friction_coefficient"),
        "{faults:?}"
    );
}

/// Nothing but the coefficient per energy is resolved: keys and caches of equal scenes are equal.
#[test]
fn a_scene_by_archards_law_is_that_of_its_coefficient_per_energy() {
    let energy = case_with(&["wear.coefficient=4e-15 m^3/J"]).canonical();
    let archard = case_with(&[
        "wear.coefficient=1e-15 1/Pa",
        "wear.law=archard",
        "contact.friction_coefficient=0.25",
    ]);
    let friction = case_with(&[
        "wear.coefficient=4e-15 m^3/J",
        "contact.friction_coefficient=0.25",
    ]);
    assert_eq!(
        archard.canonical().to_string(),
        friction.canonical().to_string()
    );
    assert_eq!(energy["wear"], archard.canonical()["wear"]);
}

#[test]
fn only_what_a_stored_scene_leaves_open_is_taken_as_energy() {
    let open = replaced(CASE, "2e3 um^3/J", "2e-15 1/Pa");
    assert!(lacks_wear_law(&open, &[]));
    assert!(!lacks_wear_law(&open, &[LAW_BEGUN_WITH.to_owned()]));
    assert!(!lacks_wear_law(&open, &["wear.law=archard".to_owned()]));
    assert!(!lacks_wear_law(
        &open,
        &["wear.coefficient=2e3 um^3/J".to_owned()]
    ));
    assert!(!lacks_wear_law(CASE, &[]));
    assert!(lacks_wear_law(
        CASE,
        &["wear.coefficient=2e-15 1/Pa".to_owned()]
    ));
    assert!(!lacks_wear_law("no TOML [", &[]));
}
