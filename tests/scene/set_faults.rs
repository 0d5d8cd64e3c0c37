//! Messages for faults on the command line and for missing sections, word for word.

use super::{CASE, case, message_of};

/// Arguments of `--set` and message.
const IN_SET: &[(&[&str], &str)] = &[
    (
        &["wear.cycles"],
        "--set wear.cycles: is not key=value with a dotted key, such as --set wear.cycles=1e6",
    ),
    (
        &["wear..cycles=1"],
        "--set wear..cycles=1: is not key=value with a dotted key, such as --set wear.cycles=1e6",
    ),
    (
        &["base=other.toml"],
        r#"--set base=other.toml: base cannot be set; write it in a file: base = "other.toml""#,
    ),
    (
        &["wear.cycles=1e6.5"],
        r#"--set wear.cycles=1e6.5: wear.cycles = "1e6.5": must be an integer of 1 to 9007199254740992"#,
    ),
    (
        &["contact.normal_load=30"],
        r#"--set contact.normal_load=30: contact.normal_load: "30" has no unit; a force is wanted, such as "30 N" or "30 kN""#,
    ),
    (
        &["contact.normal_lod=30 kN"],
        r#"--set contact.normal_lod=30 kN: contact.normal_lod = "30 kN": there is no such key; did you mean contact.normal_load?"#,
    ),
    (
        &["surface.kind=sphere"],
        r#"case.toml: surface.radius is missing; add to [surface]: radius = "25 mm""#,
    ),
    (
        &[
            "surface.kind=sphere",
            "surface.rq=5 um",
            "surface.radius=1 mm",
        ],
        r#"--set surface.rq=5 um: surface.rq = "5 um" does not belong to surface.kind = "sphere", whose keys are: radius"#,
    ),
    (
        &[
            "contact.transverse=absent",
            r#"motion.amplitude=["1 um", "1 um"]"#,
        ],
        r#"--set motion.amplitude=["1 um", "1 um"]: motion.amplitude = ["1 um", "1 um"]: contact.transverse = "absent" allows no motion along y; give "0 um" for y, or transverse = "fixed""#,
    ),
    (
        &[r#"motion.amplitude=["0 um", "30 mm"]"#],
        r#"--set motion.amplitude=["0 um", "30 mm"]: motion.amplitude = ["0 um", "30 mm"]: must be less than the length of the joint, 30.0000 mm along y: slip is assumed to be small"#,
    ),
    (
        &["wear.cycles=1e300"],
        "--set wear.cycles=1e300: wear.cycles = 1e300: must be an integer of 1 to 9007199254740992",
    ),
    (
        &["motion.history=a", "motion.amplitude=1 um"],
        r#"--set motion.amplitude=1 um: motion.amplitude = "1 um": motion.history gives the whole cycle already; give one or the other"#,
    ),
    (
        &["wear.tolerance=0.1", "fidelity.wear_tolerance=0.1"],
        "--set fidelity.wear_tolerance=0.1: fidelity.wear_tolerance = 0.1: wear.tolerance has the same meaning; give one of them",
    ),
    (
        &["fidelity.steps_per_cycle=33"],
        "--set fidelity.steps_per_cycle=33: fidelity.steps_per_cycle = 33: must be an even integer of 4 to 65536",
    ),
    (
        &["fidelity.steps_per_cycle=2"],
        "--set fidelity.steps_per_cycle=2: fidelity.steps_per_cycle = 2: must be an even integer of 4 to 65536",
    ),
    (
        &["fidelity.preset=fast", "fidelity.tolerance=0.01"],
        "--set fidelity.tolerance=0.01: fidelity.tolerance = 0.01: fidelity.preset sets the same keys; give one of them",
    ),
    (
        &["fidelity.preset=papr"],
        r#"--set fidelity.preset=papr: fidelity.preset = "papr": must be one of "paper", "fast", "balanced", "reference"; did you mean "paper"?"#,
    ),
    (
        &["surface.kind=file", "surface.path="],
        r#"--set surface.path=: surface.path = "": must be a text, such as "heights.npy""#,
    ),
    (
        &["surface.kind=file", "surface.path=a.npy", "surface.unit=N"],
        r#"--set surface.unit=N: surface.unit = "N": must be the unit of a length alone, such as "um" (is a force)"#,
    ),
    (
        &["surface.kind=self_affine", "surface.hurst=1.2"],
        "--set surface.hurst=1.2: surface.hurst = 1.2: must be greater than 0 and at most 1",
    ),
    (
        &[
            "surface.kind=self_affine",
            "surface.hurst=0.8",
            "surface.cutoff_wavelength=50 mm",
        ],
        r#"--set surface.cutoff_wavelength=50 mm: surface.cutoff_wavelength = "50 mm": must be less than the rolloff_wavelength, 40 mm"#,
    ),
    (
        &["surface=5"],
        "--set surface=5: surface = 5: must be a section, [surface], with keys: kind, rq, correlation_length, hurst, rolloff_wavelength, cutoff_wavelength, seed, radius, path, unit, detrend, fill, spacing, transpose, correct, second",
    ),
    (
        &["surface.rq=5 micron"],
        r#"--set surface.rq=5 micron: surface.rq: "5 micron" has the unknown unit "micron"; a length is wanted, such as "5 um" or "5 mm""#,
    ),
    (
        &["surface.rq=5 KM"],
        r#"--set surface.rq=5 KM: surface.rq: "5 KM" has the unknown unit "KM" (did you mean "km"?); a length is wanted, such as "5 um" or "5 mm""#,
    ),
    (
        &[r#"surface.rq="""#],
        r#"--set surface.rq="": surface.rq: "" is empty; a length is wanted, such as "5 um" or "5 mm""#,
    ),
    (
        &["motion.history.file=a"],
        r#"--set motion.history.file=a: motion.history = { file = "a" }: must be a text, such as "cycle.parquet""#,
    ),
    (
        &["joint.size.x=5 mm"],
        r#"--set joint.size.x=5 mm: joint.size = { x = "5 mm" }: must be a list of two values, for x and y, such as ["40 mm", "30 mm"]"#,
    ),
    (
        &["wear.cycles=1e19"],
        "--set wear.cycles=1e19: wear.cycles = 10000000000000000000.0: must be an integer of 1 to 9007199254740992",
    ),
    (
        &["wear.cycles=inf"],
        "--set wear.cycles=inf: wear.cycles = inf: must be an integer of 1 to 9007199254740992",
    ),
    (
        &["wear.cycles=1e16"],
        "--set wear.cycles=1e16: wear.cycles = 10000000000000000.0: must be an integer of 1 to 9007199254740992",
    ),
    (
        &["output.curves_every=1e10"],
        "--set output.curves_every=1e10: output.curves_every = 10000000000.0: must be an integer of 0 to 1000000000",
    ),
    (
        &["output.keep.every=1e10"],
        "--set output.keep.every=1e10: output.keep.every = 10000000000.0: must be an integer of 1 to 1000000000",
    ),
    (
        &["title=2020-01-01"],
        r#"--set title=2020-01-01: title = 2020-01-01: must be a text, such as "Lap joint, Rq 5 um""#,
    ),
    (
        &["output.keep={}"],
        r#"--set output.keep={}: output.keep = {}: must be "all" or a table such as { every = 50, last = 3, updates = true }"#,
    ),
    (
        &["output.response_at=[1]"],
        "--set output.response_at=[1]: output.response_at = [1]: without [dynamics] there is no response; remove it or give []",
    ),
    (
        &["fidelity.aft_samples=64"],
        "--set fidelity.aft_samples=64: fidelity.aft_samples = 64: it applies to [dynamics], but there is none; remove it",
    ),
    (
        &["motion.phase=5 um"],
        r#"--set motion.phase=5 um: motion.phase: "5 um" is a length; an angle is wanted, such as "90 deg" or "90 rad""#,
    ),
    (
        &["contact.friction_coefficient=30 deg"],
        r#"--set contact.friction_coefficient=30 deg: contact.friction_coefficient: "30 deg" is an angle; a plain number is wanted, such as 0.6"#,
    ),
];

#[test]
fn faults_in_set() {
    for (sets, expected) in IN_SET {
        let faults = case().faults("case.toml", sets);
        assert!(
            faults.iter().any(|fault| fault == expected),
            "{sets:?}: {faults:#?}"
        );
    }
}

/// Section that the case omits, and message.
const LEFT_OUT: &[(&str, &str)] = &[
    (
        "joint",
        r#"case.toml: section [joint] is missing (the size of the joint); add for example:
[joint]
size = ["40 mm", "30 mm"]
grid = [256, 192]"#,
    ),
    (
        "material",
        r#"case.toml: section [material] is missing (the elastic constants); add for example:
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3"#,
    ),
    (
        "surface",
        r#"case.toml: section [surface] is missing (the heights of the contact); add for example:
[surface]
kind = "gaussian"
rq = "5 um"
correlation_length = ["0.5 mm", "0.5 mm"]"#,
    ),
    (
        "contact",
        r#"case.toml: section [contact] is missing (the load on the joint); add for example:
[contact]
normal_load = "30 kN""#,
    ),
    (
        "motion",
        r#"case.toml: section [motion] is missing ([wear] needs it, or [structure] and [dynamics]: without motion nothing wears); add for example:
[motion]
amplitude = ["5 um", "0 um"]"#,
    ),
];

#[test]
fn missing_sections() {
    for (section, expected) in LEFT_OUT {
        assert_eq!(message_of(&without(section), &[]), *expected, "{section}");
    }
}

/// [`CASE`] without one of its sections.
fn without(section: &str) -> String {
    let mut kept = true;
    CASE.lines()
        .filter(|line| {
            if line.starts_with('[') {
                kept = *line != format!("[{section}]");
            }
            kept
        })
        .map(|line| format!("{line}\n"))
        .collect()
}

#[test]
fn a_quantity_error_is_the_source_of_a_unit_fault() {
    let error = case()
        .load("case.toml", &["contact.normal_load=30"])
        .expect_err("a bare number");
    assert!(matches!(
        *error.problem,
        fretwear::scene::Problem::Quantity { ref key, .. } if key == "contact.normal_load"
    ));
}

/// The program rejects a key of very many names. A recursive function would exceed the stack.
#[test]
fn a_key_of_many_names() {
    let name = |count| vec!["a"; count].join(".");
    for count in [81, 60_000] {
        let set = format!("{}=1", name(count));
        let message = case().message("case.toml", &[&set]);
        let end = format!(
            ": has a key of {count} names; use at most 80, as in --set joint.hole.diameter=\"11 mm\""
        );
        assert!(message.ends_with(&end), "{count}");
    }
    let message = case().message("case.toml", &[&format!("{}=1", name(80))]);
    assert!(message.contains("there is no such key"), "{message}");
}
