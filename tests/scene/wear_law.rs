//! Tests of Archard's coefficient and of the coefficient per energy: units, laws and resolved values.

use super::{CASE, case_with, faults_of, replaced, scene_of};

/// Tolerance for two quotients of the same numbers in different units: a few roundings.
const ROUNDING: f64 = 1e-15;

/// Coefficients in units of either law, all equal to 2e-15 in SI units.
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

/// Coefficients in units per energy, all equal to 2e-15 in SI units.
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
    case_with(&sets).recipe.wear.expect("wear").coefficient
}

/// [`CASE`] with Archard's law and another friction coefficient.
fn by_archard(friction: &str) -> String {
    let text = replaced(CASE, "2e3 um^3/J\"", "2e-15 1/Pa\"\nlaw = \"archard\"");
    let friction = format!("friction_coefficient = {friction}");
    replaced(&text, "friction_coefficient = 0.6", &friction)
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
        let faults = faults_of(&replaced(CASE, "2e3 um^3/J", unit), &[]);
        let expected = format!(
            "case.toml, line 20: wear.coefficient = \"{unit}\": this unit fits both alpha (volume per dissipated energy) and Archard's k (volume per load and slip); state which one it is: wear.law = \"energy\", or wear.law = \"archard\" (alpha = k/mu)"
        );
        assert_eq!(faults, [expected]);
    }
}

#[test]
fn a_coefficient_is_that_of_the_law() {
    for unit in OF_BOTH.iter().chain(&OF_ENERGY) {
        assert_is(coefficient(unit, &["wear.law=energy"]), 2e-15, unit);
        assert_is(coefficient(unit, &["wear.law=archard"]), 2e-15 / 0.6, unit);
    }
    for unit in OF_ENERGY {
        assert_is(coefficient(unit, &[]), 2e-15, unit);
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
    // The order of both keys does not matter.
    let scene = scene_of(&by_archard("0.25"), &[]);
    assert_is(scene.recipe.wear.expect("wear").coefficient, 8e-15, "0.25");
}

#[test]
fn archards_law_needs_friction() {
    let faults = faults_of(&by_archard("0"), &[]);
    assert_eq!(
        faults,
        [
            "case.toml, line 21: wear.law = \"archard\": alpha = k/mu, and contact.friction_coefficient is 0: give a friction coefficient greater than zero"
        ]
    );
    // An invalid friction coefficient is the only fault.
    let faults = faults_of(&by_archard("-1"), &[]);
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(
        faults[0].contains("contact.friction_coefficient"),
        "{faults:?}"
    );
}

/// A scene resolves to the coefficient per energy only. Equal scenes therefore have equal keys in the cache.
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
