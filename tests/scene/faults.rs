//! Messages for all faults, word for word: each one names file, line, key and value, and suggests a correct value.

use super::{CASE, Folder, assert_faults, edited, message_of};

/// Replaced text of the case, new text, and message.
const IN_FILE: &[(&str, &str, &str)] = &[
    (
        r#"title = "Case""#,
        "title = 5",
        r#"case.toml, line 1: title = 5: must be a text, such as "Lap joint, Rq 5 um""#,
    ),
    (
        r#"title = "Case""#,
        r#"titel = "Case""#,
        r#"case.toml, line 1: titel = "Case": there is no such key; did you mean title?"#,
    ),
    (
        r#"title = "Case""#,
        r#"normal_load = "3 N""#,
        r#"case.toml, line 1: normal_load = "3 N": there is no such key; did you mean contact.normal_load?"#,
    ),
    (
        r#"title = "Case""#,
        r#""contact.normal_load" = "3 N""#,
        r#"case.toml, line 1: "contact.normal_load" = "3 N": there is no such key; did you mean contact.normal_load?"#,
    ),
    (
        r#"title = "Case""#,
        "joints = 1",
        "case.toml, line 1: joints = 1: there is no such key; did you mean joint?",
    ),
    (
        r#"title = "Case""#,
        "zzz = 1",
        "case.toml, line 1: zzz = 1: there is no such key; known here: title, joint, material, surface, contact, structure, dynamics, motion, wear, update, fidelity, output",
    ),
    (
        r#"title = "Case""#,
        r#"structure.kind = "resonator""#,
        r#"case.toml: section [dynamics] is missing ([structure] needs it: the forces that make it vibrate); add for example:
[dynamics]
force = { amplitude = "1000 N", at = "far_wall", direction = "x" }
frequency = ["900 Hz", "1050 Hz"]"#,
    ),
    (
        r#"title = "Case""#,
        "dynamics = { modes = 30 }",
        r#"case.toml: section [structure] is missing ([dynamics] needs it: the structure that vibrates); add for example:
[structure]
kind = "resonator""#,
    ),
    (
        r#"title = "Case""#,
        "update = { stiffness_change = 0.1 }",
        "case.toml, line 1: section [update]: it updates the contact elements of a structure, but there is none; add [structure] and [dynamics], or remove it",
    ),
    (
        r#"keep = "all""#,
        "response_at = [0, 1e6]",
        "case.toml, line 23: output.response_at = [0, 1000000.0]: without [dynamics] there is no response; remove it or give []",
    ),
    (
        r#"size = ["40 mm", "30 mm"]"#,
        "",
        r#"case.toml: joint.size is missing; add to [joint]: size = ["40 mm", "30 mm"]"#,
    ),
    (
        r#""30 mm""#,
        "30",
        r#"case.toml, line 3: joint.size: "30" has no unit; a length is wanted, such as "30 um" or "30 mm""#,
    ),
    (
        r#""30 mm""#,
        r#""30""#,
        r#"case.toml, line 3: joint.size: "30" has no unit; a length is wanted, such as "30 um" or "30 mm""#,
    ),
    (
        r#""30 mm""#,
        r#""30 kN""#,
        r#"case.toml, line 3: joint.size: "30 kN" is a force; a length is wanted, such as "5 um" or "5 mm""#,
    ),
    (
        r#""30 mm""#,
        r#""-30 mm""#,
        r#"case.toml, line 3: joint.size = ["40 mm", "-30 mm"]: must be greater than zero"#,
    ),
    (
        r#""30 mm""#,
        "true",
        r#"case.toml, line 3: joint.size = ["40 mm", true]: must be a length, such as ["40 mm", "30 mm"]"#,
    ),
    (
        r#"size = ["40 mm", "30 mm"]"#,
        r#"size = "40 mm""#,
        r#"case.toml, line 3: joint.size = "40 mm": must be a list of two values, for x and y, such as ["40 mm", "30 mm"]"#,
    ),
    (
        "[64, 40]",
        "[64]",
        "case.toml, line 4: joint.grid = [64]: must be a list of two integers of 1 to 16384, such as [256, 192]",
    ),
    (
        "[64, 40]",
        "[64, 0]",
        "case.toml, line 4: joint.grid = [64, 0]: must be a list of two integers of 1 to 16384, such as [256, 192]",
    ),
    (
        "[64, 40]",
        "[64, 40.5]",
        "case.toml, line 4: joint.grid = [64, 40.5]: must be a list of two integers of 1 to 16384, such as [256, 192]",
    ),
    (
        "[64, 40]",
        "[64, 1_000_000]",
        "case.toml, line 4: joint.grid = [64, 1000000]: must be a list of two integers of 1 to 16384, such as [256, 192]",
    ),
    (
        "[64, 40]",
        "[1, 1]",
        "case.toml, line 4: joint.grid = [1, 1]: must be finer: no cell has its centre outside the hole",
    ),
    (
        r#"{ diameter = "11 mm" }"#,
        r#""11 mm""#,
        r#"case.toml, line 5: joint.hole = "11 mm": must be a section, [joint.hole], with keys: diameter"#,
    ),
    (
        r#"{ diameter = "11 mm" }"#,
        r#"{ radius = "11 mm" }"#,
        r#"case.toml, line 5: joint.hole.radius = "11 mm": there is no such key; known here: diameter"#,
    ),
    (
        r#"{ diameter = "11 mm" }"#,
        "{}",
        r#"case.toml: joint.hole.diameter is missing; add to [joint.hole]: diameter = "11 mm""#,
    ),
    (
        r#"{ diameter = "11 mm" }"#,
        r#"{ diameter = "30 mm" }"#,
        r#"case.toml, line 5: joint.hole.diameter = "30 mm": must be less than the shorter side of joint.size"#,
    ),
    (
        "198.4 GPa",
        "198.4 Gpa",
        r#"case.toml, line 7: material.youngs_modulus: "198.4 Gpa" has the unknown unit "Gpa" (did you mean "GPa"?); a pressure is wanted, such as "600 MPa" or "600 GPa""#,
    ),
    (
        "198.4 GPa",
        "198,4 GPa",
        r#"case.toml, line 7: material.youngs_modulus: "198,4 GPa" has a comma where the decimal point should be; a pressure is wanted, such as "600 MPa" or "600 GPa""#,
    ),
    (
        "poisson_ratio = 0.3",
        "poisson_ratio = 0.6",
        "case.toml, line 8: material.poisson_ratio = 0.6: must be greater than -1 and at most 0.5",
    ),
    (
        "poisson_ratio = 0.3",
        "poisson_ratio = nan",
        r#"case.toml, line 8: material.poisson_ratio: "NaN" is not a finite number; a plain number is wanted, such as 0.6"#,
    ),
    (
        "poisson_ratio = 0.3",
        r#"poisson_ratio = "0.3 mm""#,
        r#"case.toml, line 8: material.poisson_ratio: "0.3 mm" is a length; a plain number is wanted, such as 0.6"#,
    ),
    (
        "poisson_ratio = 0.3",
        "poison_ratio = 0.3",
        "case.toml, line 8: material.poison_ratio = 0.3: there is no such key; did you mean material.poisson_ratio?",
    ),
    (
        "poisson_ratio = 0.3",
        "lower = { poisson_ratio = 0.3 }",
        "case.toml: material.poisson_ratio is missing; add to [material]: poisson_ratio = 0.3",
    ),
    (
        r#"kind = "gaussian""#,
        "",
        r#"case.toml: surface.kind is missing; add to [surface]: kind = "gaussian""#,
    ),
    (
        r#"kind = "gaussian""#,
        r#"kind = "gausian""#,
        r#"case.toml, line 10: surface.kind = "gausian": must be one of "gaussian", "exponential", "self_affine", "flat", "sphere", "file"; did you mean "gaussian"?"#,
    ),
    (
        r#"kind = "gaussian""#,
        r#"kind = "sphere""#,
        r#"case.toml, line 11: surface.rq = "5 um" does not belong to surface.kind = "sphere", whose keys are: radius"#,
    ),
    (
        r#"rq = "5 um""#,
        "",
        r#"case.toml: surface.rq is missing; add to [surface]: rq = "5 um""#,
    ),
    (
        r#"rq = "5 um""#,
        "rq = 5",
        r#"case.toml, line 11: surface.rq: "5" has no unit; a length is wanted, such as "5 um" or "5 mm""#,
    ),
    (
        r#"rq = "5 um""#,
        r#"rq = "0 um""#,
        r#"case.toml, line 11: surface.rq = "0 um": must be greater than zero"#,
    ),
    (
        r#"rq = "5 um""#,
        r#"rq = "5 mu""#,
        r#"case.toml, line 11: surface.rq: "5 mu" has the unknown unit "mu" (did you mean "mm"?); a length is wanted, such as "5 um" or "5 mm""#,
    ),
    (
        "seed = 3",
        "seed = -3",
        "case.toml, line 13: surface.seed = -3: must be an integer of 0 or more",
    ),
    (
        "seed = 3",
        r#"seed = "three""#,
        r#"case.toml, line 13: surface.seed = "three": must be an integer of 0 or more"#,
    ),
    (
        "seed = 3",
        r#"radius = "3 mm""#,
        r#"case.toml, line 13: surface.radius = "3 mm" does not belong to surface.kind = "gaussian", whose keys are: rq, correlation_length, seed"#,
    ),
    (
        "friction_coefficient = 0.6",
        "",
        "case.toml: contact.friction_coefficient is missing; add to [contact]: friction_coefficient = 0.6",
    ),
    (
        "friction_coefficient = 0.6",
        "friction_coefficient = -0.1",
        "case.toml, line 15: contact.friction_coefficient = -0.1: must be zero or greater",
    ),
    (
        "friction_coefficient = 0.6",
        "mu = 0.6",
        "case.toml, line 15: contact.mu = 0.6: there is no such key; did you mean contact.friction_coefficient?",
    ),
    (
        "friction_coefficient = 0.6",
        "friction = 0.6",
        "case.toml, line 15: contact.friction = 0.6: there is no such key; did you mean contact.friction_coefficient?",
    ),
    (
        "friction_coefficient = 0.6",
        "colour = 0.6",
        "case.toml, line 15: contact.colour = 0.6: there is no such key; known here: friction_coefficient, normal_load, preload, approach, kn, kt, elements, gap, pressure_cap, boundary, transverse, rotation, moment, pressing, stiffness, distribution, bolt_stiffness, bolt",
    ),
    (
        "friction_coefficient = 0.6",
        r#"rotation = "free"
boundary = "periodic""#,
        r#"case.toml, line 15: contact.rotation = "free": with contact.boundary = "periodic" a rotated body would not be periodic; use "fixed""#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"moment = ["2 N m", "0 N m"]"#,
        r#"case.toml, line 15: contact.moment = ["2 N m", "0 N m"]: with contact.rotation = "fixed" the moments are computed and reported; use "free", or remove moment"#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"rotation = "free"
moment = ["2 N", "0 N"]"#,
        r#"case.toml, line 16: contact.moment: "2 N" is a force; a moment is wanted, such as "2 N m""#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"rotation = "fix""#,
        r#"case.toml, line 15: contact.rotation = "fix": must be one of "fixed", "free"; did you mean "fixed"?"#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"stiffness = "tangent""#,
        r#"case.toml, line 15: contact.stiffness = "tangent": it applies to the contact elements of a structure, but there is none; add [structure] and [dynamics], or remove the key"#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"kn = "1e4 N/um""#,
        r#"case.toml, line 15: contact.kn = "1e4 N/um": a contact of given stiffness is part of a structure; add [structure] and [dynamics], or give [surface], from which the contact stiffness is computed"#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"distribution = "by_load""#,
        r#"case.toml, line 15: contact.distribution = "by_load": it applies to the contact elements of a structure, but there is none; add [structure] and [dynamics], or remove the key"#,
    ),
    (
        "friction_coefficient = 0.6",
        r#"gap = "1 um""#,
        r#"case.toml, line 15: contact.gap = "1 um": the gap follows from the surface; it is given only together with contact.kn and contact.kt"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        "",
        r#"case.toml: contact.normal_load is missing; add to [contact]: normal_load = "30 kN""#,
    ),
    (
        r#"normal_load = "30 kN""#,
        "normal_load = 30",
        r#"case.toml, line 16: contact.normal_load: "30" has no unit; a force is wanted, such as "30 N" or "30 kN""#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "1e400 N""#,
        r#"case.toml, line 16: contact.normal_load: "1e400 N" is not a finite number; a force is wanted, such as "30 N" or "30 kN""#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
pressure_cap = "10 MPa""#,
        r#"case.toml, line 17: contact.pressure_cap = "10 MPa": must be greater than the largest load over the area of the joint, 27.1647 MPa"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
boundary = "Periodic""#,
        r#"case.toml, line 17: contact.boundary = "Periodic": must be one of "free", "periodic"; did you mean "periodic"?"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        "",
        r#"case.toml: motion.amplitude is missing; add to [motion]: amplitude = ["5 um", "0 um"]   (or force, rotation, moment)"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"amplitude = ["0 um", "0 um"]"#,
        r#"case.toml, line 18: motion.amplitude = ["0 um", "0 um"]: nothing moves; give a value greater than zero, or remove [motion] for a static contact"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"amplitude = ["5 um", "0 um", "0 um"]"#,
        r#"case.toml, line 18: motion.amplitude = ["5 um", "0 um", "0 um"]: must be a list of two values, for x and y, such as ["5 um", "0 um"]"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"amplitude = "5 um"
phase = 90"#,
        r#"case.toml, line 19: motion.phase: "90" has no unit; an angle is wanted, such as "90 deg" or "90 rad""#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"amplitude = "5 um"
history = "cycle.parquet""#,
        r#"case.toml, line 18: motion.amplitude = "5 um": motion.history gives the whole cycle already; give one or the other"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"amplitude = "5 um"
normal_load_amplitude = "30 kN""#,
        r#"case.toml, line 19: motion.normal_load_amplitude = "30 kN": must be less than contact.normal_load, 30000 N, or the joint would lift off"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"force = ["100 N", "0 N"]
amplitude = "5 um""#,
        r#"case.toml, line 18: motion.force = ["100 N", "0 N"]: motion.amplitude gives the displacement already; give one or the other"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"phase = "0 deg""#,
        r#"case.toml: motion.amplitude is missing; add to [motion]: amplitude = ["5 um", "0 um"]   (or force, rotation, moment)"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"rotation = "0.1 mrad"
moment = "2 N m""#,
        r#"case.toml, line 19: motion.moment = "2 N m": motion.rotation gives the rotation already; give one or the other"#,
    ),
    (
        r#"amplitude = ["5 um", "0 um"]"#,
        r#"force = "0 N""#,
        r#"case.toml, line 18: motion.force = "0 N": nothing moves; give a value greater than zero, or remove [motion] for a static contact"#,
    ),
    (
        r#"coefficient = "2e3 um^3/J""#,
        "",
        r#"case.toml: wear.coefficient is missing; add to [wear]: coefficient = "2e3 um^3/J""#,
    ),
    (
        r#"coefficient = "2e3 um^3/J""#,
        r#"coefficient = "2e3 um^3/N m""#,
        r#"case.toml, line 20: wear.coefficient: "2e3 um^3/N m" multiplies after a division: put the divisor in parentheses, as in "mm^3/(N m)"; a wear coefficient (volume per energy, or per load and slip) is wanted, such as "2e3 um^3/J""#,
    ),
    (
        r#"coefficient = "2e3 um^3/J""#,
        r#"coefficient = "2e3 um^2/J""#,
        r#"case.toml, line 20: wear.coefficient: "2e3 um^2/J" is a quantity in kg^-1 s^2; a wear coefficient (volume per energy, or per load and slip) is wanted, such as "2e3 um^3/J""#,
    ),
    (
        "cycles = 10_000_000",
        "",
        r#"case.toml: wear.cycles is missing; add to [wear]: cycles = 10_000_000   (or volume = "1 mm^3")"#,
    ),
    (
        "cycles = 10_000_000",
        "cycles = 0",
        "case.toml, line 21: wear.cycles = 0: must be an integer of 1 to 9007199254740992",
    ),
    (
        "cycles = 10_000_000",
        "cycles = 1.5",
        "case.toml, line 21: wear.cycles = 1.5: must be an integer of 1 to 9007199254740992",
    ),
    (
        "cycles = 10_000_000",
        "cycle = 5",
        "case.toml, line 21: wear.cycle = 5: there is no such key; did you mean wear.cycles?",
    ),
    (
        "cycles = 10_000_000",
        r#"cycles = 5
scheme = "explicit""#,
        r#"case.toml: wear.depth_step is missing; add to [wear]: depth_step = "0.1 um"   (this scheme needs it to choose its steps)"#,
    ),
    (
        "cycles = 10_000_000",
        r"cycles = 5
tolerance = 2",
        "case.toml, line 22: wear.tolerance = 2: must be greater than 0 and less than 1, such as 1e-4",
    ),
    (
        r#"keep = "all""#,
        r#"keep = "al""#,
        r#"case.toml, line 23: output.keep = "al": must be "all" or a table such as { every = 50, last = 3, updates = true }"#,
    ),
    (
        r#"keep = "all""#,
        "keep = { last = 0 }",
        "case.toml, line 23: output.keep.last = 0: must be an integer of 1 to 1000000000",
    ),
    (
        r#"keep = "all""#,
        r#"cycle_fields = "yes""#,
        r#"case.toml, line 23: output.cycle_fields = "yes": must be true, false or a table such as { samples = [0, 16, 32], j = [20, 20], every = 10 }"#,
    ),
    (
        r#"keep = "all""#,
        "cycle_fields = { j = [20, 10] }",
        "case.toml, line 23: output.cycle_fields.j = [20, 10]: must be a list of two integers of 0 or more, the first and the last, such as [20, 20]",
    ),
    (
        r#"keep = "all""#,
        "cycle_fields = { samples = [] }",
        "case.toml, line 23: output.cycle_fields.samples = []: must be a list of different numbers of samples, such as [0, 16, 32]",
    ),
];

#[test]
fn faults_in_a_file() {
    assert_faults(CASE, IN_FILE);
}

#[test]
fn a_file_that_is_not_there() {
    let message = Folder::new().message("nowhere.toml", &[]);
    assert!(
        message.starts_with("nowhere.toml: cannot be read: "),
        "{message}"
    );
}

#[test]
fn syntax() {
    let broken = [
        ("[joint]", "[joint", "line 2"),
        ("seed = 3", "seed = 3\nseed = 4", "line 14"),
        ("seed = 3", "seed = 3 mm", "line 13"),
    ];
    for (from, to, line) in broken {
        let message = message_of(&edited(from, to), &[]);
        assert!(
            message.starts_with("case.toml: is not valid TOML: ") && message.contains(line),
            "{message}"
        );
    }
}

/// The program rejects pipes, devices and folders as scenes, without waiting for data.
#[cfg(unix)]
#[test]
fn what_is_no_file() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.toml");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo").success());
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.toml")).expect("a link");
    std::fs::create_dir(folder.path("folder.toml")).expect("a folder");
    for (name, what) in [
        ("pipe.toml", "a pipe or a device"),
        ("zero.toml", "a pipe or a device"),
        ("folder.toml", "a folder"),
    ] {
        assert_eq!(
            folder.message(name, &[]),
            format!("{name}: cannot be read: it is {what}, not a regular file")
        );
    }
    let folder = folder.with("based.toml", "base = \"pipe.toml\"");
    let message = folder.message("based.toml", &[]);
    assert!(message.contains("it is a pipe or a device"), "{message}");
    // A link to a file is a valid scene.
    let folder = folder.with("case.toml", CASE);
    std::os::unix::fs::symlink(folder.path("case.toml"), folder.path("link.toml")).expect("a link");
    folder.scene("link.toml", &[]);
}

#[test]
fn a_file_of_too_many_bytes() {
    let long = format!("{CASE}# {}\n", "x".repeat(16 << 20));
    let message = message_of(&long, &[]);
    assert!(
        message.starts_with("case.toml: cannot be read: it has 167")
            && message.ends_with("at most 16777216 are read"),
        "{message}"
    );
}

/// Limit of the time \[s\], several times the time on a loaded machine. Recounting the lines for each key would take ten times the limit.
const SECONDS: u64 = 4;

#[test]
fn a_file_of_many_keys() {
    let keys: String = (0..60_000).map(|k| format!("k{k} = {k}\n")).collect();
    let folder = Folder::new().with("case.toml", &format!("{CASE}{keys}"));
    let begin = std::time::Instant::now();
    let faults = folder.faults("case.toml", &[]);
    assert!(begin.elapsed().as_secs() < SECONDS, "{:?}", begin.elapsed());
    assert_eq!(faults.len(), fretwear::scene::MOST_FAULTS);
    assert_eq!(
        faults[0],
        "case.toml, line 24: output.k0 = 0: there is no such key; known here: keep, cycle_fields, curves_every, stiffness, response_at, resonance, durability"
    );
    // A long name is not compared with each known key letter by letter.
    let folder = Folder::new().with("case.toml", &format!("{} = 1", "x".repeat(1 << 20)));
    let begin = std::time::Instant::now();
    assert!(folder.message("case.toml", &[]).contains("no such key"));
    assert!(begin.elapsed().as_secs() < SECONDS, "{:?}", begin.elapsed());
}

/// The TOML reader rejects text that is nested too deeply for a recursive function.
#[test]
fn deep_nesting() {
    let deep = 100_000;
    for text in [
        format!("{} = 1", vec!["a"; deep].join(".")),
        format!("[{}]", vec!["a"; deep].join(".")),
        format!("a = {}{}", "[".repeat(deep), "]".repeat(deep)),
        format!("a = {}1{}", "{a=".repeat(deep), "}".repeat(deep)),
    ] {
        let message = message_of(&text, &[]);
        assert!(message.starts_with("case.toml: is not valid TOML: "));
    }
}
