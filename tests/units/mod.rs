//! Quantities with units: values, errors and exactness.

use fretwear::units::{Dimension, UnitProblem, from_number, parse, parse_unit};
use proptest::prelude::*;

use Dimension as D;

#[test]
fn values() {
    let table: &[(&str, D, f64)] = &[
        ("30 kN", D::FORCE, 3e4),
        ("30kN", D::FORCE, 3e4),
        ("  30   kN  ", D::FORCE, 3e4),
        ("-30 N", D::FORCE, -30.0),
        ("+.5 N", D::FORCE, 0.5),
        ("5. N", D::FORCE, 5.0),
        ("1_000 N", D::FORCE, 1000.0),
        ("1e3 N", D::FORCE, 1000.0),
        ("1E+3 N", D::FORCE, 1000.0),
        ("30 kg m/s^2", D::FORCE, 30.0),
        ("30 kg*m*s^-2", D::FORCE, 30.0),
        ("30 kg·m·s⁻²", D::FORCE, 30.0),
        ("2e3 um^3/J", D::WEAR_COEFFICIENT, 2e-15),
        ("2e3 µm³/J", D::WEAR_COEFFICIENT, 2e-15),
        ("2e3 um**3 / J", D::WEAR_COEFFICIENT, 2e-15),
        ("2e3 um^3 J^-1", D::WEAR_COEFFICIENT, 2e-15),
        ("2e-6 mm^3/(N m)", D::WEAR_COEFFICIENT, 2e-15),
        ("2e-6 mm^3/(N*m)", D::WEAR_COEFFICIENT, 2e-15),
        ("2e-6 mm^3/N/m", D::WEAR_COEFFICIENT, 2e-15),
        ("2e-6 mm^3/Nm", D::WEAR_COEFFICIENT, 2e-15),
        ("2e-15 1/Pa", D::WEAR_COEFFICIENT, 2e-15),
        ("2e-15 /Pa", D::WEAR_COEFFICIENT, 2e-15),
        ("7949 kg/m^3", D::DENSITY, 7949.0),
        ("7949 kg/m3", D::DENSITY, 7949.0),
        ("7.949 g/cm^3", D::DENSITY, 7949.0),
        ("7.949e-9 t/mm^3", D::DENSITY, 7949.0),
        ("0.6", D::NONE, 0.6),
        ("10 %", D::NONE, 0.1),
        ("-0", D::NONE, 0.0),
        ("5 µm", D::LENGTH, 5e-6),
        ("5 μm", D::LENGTH, 5e-6),
        ("5 um", D::LENGTH, 5e-6),
        ("1 m", D::LENGTH, 1.0),
        ("1 mm", D::LENGTH, 1e-3),
        ("1 dm", D::LENGTH, 0.1),
        ("1 dam", D::LENGTH, 10.0),
        ("600 MPa", D::PRESSURE, 6e8),
        ("600 N/mm^2", D::PRESSURE, 6e8),
        ("600 mPa", D::PRESSURE, 0.6),
        ("6 hPa", D::PRESSURE, 600.0),
        ("6 bar", D::PRESSURE, 6e5),
        ("90 deg", D::ANGLE, std::f64::consts::FRAC_PI_2),
        ("90°", D::ANGLE, std::f64::consts::FRAC_PI_2),
        ("1 rad", D::ANGLE, 1.0),
        ("1 mrad", D::ANGLE, 1e-3),
        ("1 mm^3", D::VOLUME, 1e-9),
        ("1e4 N/um", D::STIFFNESS, 1e10),
        ("12 kN/mm", D::STIFFNESS, 1.2e7),
        ("1500 g", D::MASS, 1.5),
        ("5 N s/m", D::DAMPING, 5.0),
        ("5 kg/s", D::DAMPING, 5.0),
        ("0.9 kHz", D::FREQUENCY, 900.0),
        ("1 kW s/m", D::FORCE, 1e3),
        ("1 kHz", D { s: -1, ..D::NONE }, 1e3),
        ("8 h", D { s: 1, ..D::NONE }, 28_800.0),
        ("90 min", D { s: 1, ..D::NONE }, 5400.0),
        ("2 d", D { s: 1, ..D::NONE }, 172_800.0),
        ("1e-400 m", D::LENGTH, 0.0),
        ("0e99999999999999999999 m", D::LENGTH, 0.0),
        // Halfway cases. A multiplication by 1e-6 or a division by 1e6 would round twice.
        ("0.1 um", D::LENGTH, 1e-7),
        ("0.3 um", D::LENGTH, 3e-7),
        ("4.35 um", D::LENGTH, 4.35e-6),
        ("198.4 GPa", D::PRESSURE, 198.4e9),
    ];
    for (text, dimension, expected) in table {
        match parse(text, *dimension) {
            Ok(value) => assert_eq!(value.to_bits(), expected.to_bits(), "{text}: {value:e}"),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn faults() {
    let table: &[(&str, D, &str)] = &[
        (
            "",
            D::FORCE,
            r#""" is empty; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "kN",
            D::FORCE,
            r#""kN" does not start with a number; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "- 5 N",
            D::FORCE,
            r#""- 5 N" does not start with a number; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            ".",
            D::NONE,
            r#""." does not start with a number; a plain number is wanted, such as 0.6"#,
        ),
        (
            "42",
            D::FORCE,
            r#""42" has no unit; a force is wanted, such as "42 N" or "42 kN""#,
        ),
        (
            "nan N",
            D::FORCE,
            r#""nan N" is not a finite number; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "-inf",
            D::NONE,
            r#""-inf" is not a finite number; a plain number is wanted, such as 0.6"#,
        ),
        (
            "1e999 N",
            D::FORCE,
            r#""1e999 N" is not a finite number; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "1e99999999999999999999 N",
            D::FORCE,
            r#""1e99999999999999999999 N" is not a finite number; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "0,5 mm",
            D::LENGTH,
            r#""0,5 mm" has a comma where the decimal point should be; a length is wanted, such as "5 um" or "5 mm""#,
        ),
        (
            "5 Um",
            D::LENGTH,
            r#""5 Um" has the unknown unit "Um" (did you mean "um"?); a length is wanted, such as "5 um" or "5 mm""#,
        ),
        (
            "5 kn",
            D::FORCE,
            r#""5 kn" has the unknown unit "kn" (did you mean "kN"?); a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "5 Mpa",
            D::PRESSURE,
            r#""5 Mpa" has the unknown unit "Mpa" (did you mean "MPa"?); a pressure is wanted, such as "600 MPa" or "600 GPa""#,
        ),
        (
            "5 furlong",
            D::LENGTH,
            r#""5 furlong" has the unknown unit "furlong"; a length is wanted, such as "5 um" or "5 mm""#,
        ),
        (
            "2 um^3/N m",
            D::WEAR_COEFFICIENT,
            r#""2 um^3/N m" multiplies after a division: put the divisor in parentheses, as in "mm^3/(N m)"; a wear coefficient (volume per energy, or per load and slip) is wanted, such as "2e3 um^3/J""#,
        ),
        (
            "5 mm",
            D::FORCE,
            r#""5 mm" is a length; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "5 m^2/s",
            D::VOLUME,
            r#""5 m^2/s" is a quantity in m^2 s^-1; a volume is wanted, such as "1 um^3" or "1 mm^3""#,
        ),
        (
            "5 deg",
            D::NONE,
            r#""5 deg" is an angle; a plain number is wanted, such as 0.6"#,
        ),
        (
            "5 N/(m",
            D::STIFFNESS,
            r#""5 N/(m" cannot be read from "" on; a stiffness is wanted, such as "1e4 N/um""#,
        ),
        (
            "5 N)",
            D::FORCE,
            r#""5 N)" cannot be read from ")" on; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "5 mm^",
            D::LENGTH,
            r#""5 mm^" cannot be read from "^" on; a length is wanted, such as "5 um" or "5 mm""#,
        ),
        (
            "5 mm^100",
            D::LENGTH,
            r#""5 mm^100" cannot be read from "^100" on; a length is wanted, such as "5 um" or "5 mm""#,
        ),
        (
            "5 N/",
            D::FORCE,
            r#""5 N/" cannot be read from "" on; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "5 6 N",
            D::FORCE,
            r#""5 6 N" cannot be read from "6 N" on; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "5 N; 6 N",
            D::FORCE,
            r#""5 N; 6 N" cannot be read from "; 6 N" on; a force is wanted, such as "30 N" or "30 kN""#,
        ),
        (
            "0x10 N",
            D::FORCE,
            r#""0x10 N" has the unknown unit "x"; a force is wanted, such as "30 N" or "30 kN""#,
        ),
    ];
    for (text, dimension, expected) in table {
        match parse(text, *dimension) {
            Ok(value) => panic!("{text} was taken for {value}"),
            Err(error) => assert_eq!(error.to_string(), *expected),
        }
    }
}

#[test]
fn bare_numbers_are_pure_numbers_only() {
    assert_eq!(from_number(0.6, D::NONE), Ok(0.6));
    let problem = |number, dimension| from_number(number, dimension).map_err(|e| e.problem);
    assert_eq!(problem(30.0, D::FORCE), Err(UnitProblem::MissingUnit));
    assert_eq!(problem(90.0, D::ANGLE), Err(UnitProblem::MissingUnit));
    assert_eq!(problem(f64::NAN, D::NONE), Err(UnitProblem::NotFinite));
    assert_eq!(
        problem(f64::INFINITY, D::FORCE),
        Err(UnitProblem::NotFinite)
    );
}

#[test]
fn a_unit_alone() {
    assert_eq!(parse_unit(" um ", D::LENGTH), Ok(1e-6));
    assert_eq!(parse_unit("m", D::LENGTH), Ok(1.0));
    let error = parse_unit("kN", D::LENGTH).expect_err("a force");
    assert_eq!(error.text, "kN");
    assert_eq!(
        error.problem,
        UnitProblem::WrongDimension { found: D::FORCE }
    );
    // Inches, and the mass that a pound-force accelerates by one inch per second squared.
    assert_eq!(parse_unit("25.4 mm", D::LENGTH), Ok(0.0254));
    assert_eq!(parse_unit("175.1268 kg", D::MASS), Ok(175.1268));
    for (text, problem) in [
        ("0 mm", UnitProblem::NotPositive),
        ("-1 mm", UnitProblem::NotPositive),
        ("1e-3", UnitProblem::MissingUnit),
    ] {
        assert_eq!(
            parse_unit(text, D::LENGTH).expect_err("a fault").problem,
            problem
        );
    }
    assert!(parse_unit("", D::LENGTH).is_err());
}

proptest! {
    /// Every finite number is unchanged after writing and reading in SI.
    #[test]
    fn written_and_read_again(value in any::<f64>().prop_filter("finite", |v| v.is_finite())) {
        for text in [format!("{value} m"), format!("{value:e} m")] {
            // Zero has no sign, so equal quantities have equal digits.
            prop_assert_eq!(parse(&text, D::LENGTH), Ok(value + 0.0));
        }
    }

    /// A prefix equals an exponent, and a different prefix equals a moved decimal point, to the last bit.
    #[test]
    fn prefixes_move_the_point(digits in 1u64..=u64::MAX, point in 0usize..25) {
        let text = format!("{digits:025}");
        let moved = |places: usize| format!("{}.{}", &text[..places], &text[places..]);
        let metres: f64 = format!("{}e-6", moved(point)).parse().expect("a number");
        prop_assert_eq!(parse(&format!("{} um", moved(point)), D::LENGTH), Ok(metres));
        if point >= 3 {
            prop_assert_eq!(parse(&format!("{} mm", moved(point - 3)), D::LENGTH), Ok(metres));
        }
        let cubic: f64 = format!("{}e-18", moved(point)).parse().expect("a number");
        prop_assert_eq!(parse(&format!("{} um^3/J", moved(point)), D::WEAR_COEFFICIENT), Ok(cubic));
    }

    /// For any text, the result is a finite number or an error that quotes the text.
    #[test]
    fn no_text_panics(text in "[-+0-9.eE_, ]{0,6}[a-zA-Zµ°%^*/()0-9⁻³· ]{0,12}") {
        match parse(&text, D::LENGTH) {
            Ok(value) => prop_assert!(value.is_finite()),
            Err(error) => prop_assert!(error.to_string().contains(&text)),
        }
    }
}

#[test]
fn units_of_inches_and_pounds_are_named_with_their_worth() {
    for (text, dimension, says) in [
        (
            "29 Mpsi",
            Dimension::PRESSURE,
            "has the unit \"Mpsi\", which is not supported: write it in SI, with 1 Mpsi = 6.89476 GPa",
        ),
        ("500 lbf", Dimension::FORCE, "1 lbf = 4.44822 N"),
        ("1.5 in", Dimension::LENGTH, "1 in = 25.4 mm"),
        ("3 lbf/in", Dimension::STIFFNESS, "1 lbf = 4.44822 N"),
    ] {
        let said = parse(text, dimension).expect_err(text).to_string();
        assert!(said.contains(says), "{said}");
    }
}
