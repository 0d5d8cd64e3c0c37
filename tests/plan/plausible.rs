//! Tests that the program detects values that are wrong by a factor of a thousand: it names the key of each mistaken unit, and does not
//! warn about shipped scenes.

use std::path::Path;

use fretwear::scene::{Plan, load};

/// Pipelines, each with typical typing errors that change a value by a factor of a thousand.
const MISTAKES: &[(&str, &[&str])] = &[
    (
        "hertz_fretting",
        &[
            "contact.normal_load=\"90 kN\"",
            "contact.normal_load=\"90 mN\"",
            "material.youngs_modulus=\"198.4 MPa\"",
            "surface.radius=\"25 um\"",
            "surface.radius=\"25 m\"",
            "motion.amplitude=\"1.09 mm\"",
            "motion.amplitude=\"1.09 nm\"",
        ],
    ),
    (
        "measured_surface",
        &[
            "contact.normal_load=\"189 kN\"",
            "contact.normal_load=\"189 mN\"",
            "motion.amplitude=[\"2 mm\", \"0 um\"]",
            "motion.amplitude=[\"2 nm\", \"0 um\"]",
            "surface.spacing=[\"16 mm\", \"12 mm\"]",
        ],
    ),
    (
        "static_contact",
        &[
            "contact.normal_load=\"30 MN\"",
            "contact.normal_load=\"30 N\"",
        ],
    ),
    (
        "prescribed_fretting",
        &[
            "joint.size=[\"40 m\", \"40 m\"]",
            "joint.size=[\"40 um\", \"40 um\"]",
            "joint.hole.diameter=\"11 um\"",
            "material.youngs_modulus=\"198.4 MPa\"",
            "material.youngs_modulus=\"198.4 TPa\"",
            "material.poisson_ratio=0.0003",
            "surface.rq=\"5 mm\"",
            "surface.rq=\"5 nm\"",
            "surface.correlation_length=[\"0.5 um\", \"0.5 um\"]",
            "surface.correlation_length=[\"0.5 m\", \"0.5 m\"]",
            "contact.normal_load=\"30 MN\"",
            "contact.normal_load=\"30 N\"",
            "contact.friction_coefficient=6e-4",
            "contact.bolt_stiffness=\"500 N/nm\"",
            "motion.amplitude=[\"5 mm\", \"0 m\"]",
            "motion.amplitude=[\"5 nm\", \"0 m\"]",
            "wear.coefficient=\"2e6 um^3/J\"",
            "wear.coefficient=\"2 um^3/J\"",
        ],
    ),
    (
        "prescribed_fretting_plastic",
        &[
            "contact.pressure_cap=\"600 GPa\"",
            "contact.pressure_cap=\"600 kPa\"",
        ],
    ),
    (
        "lap_joint",
        &[
            "joint.size=[\"40 m\", \"40 m\"]",
            "material.density=\"7949 g/cm^3\"",
            "material.density=\"7.949 kg/m^3\"",
            "surface.rq=\"5 nm\"",
            "contact.normal_load=\"30 N\"",
            "contact.friction_coefficient=6e-4",
            "dynamics.force.amplitude=\"1000 kN\"",
            "dynamics.frequency=[\"900 kHz\", \"1050 kHz\"]",
            "dynamics.frequency=[\"0.9 Hz\", \"1.05 Hz\"]",
            "dynamics.damping_ratio=3e-6",
            "structure.block_length=\"70 m\"",
            "structure.block_length=\"70 um\"",
            "structure.leaf_thickness=\"10 m\"",
        ],
    ),
    ("prescribed_fretting", &["wear.volume=\"1000 mm^3\""]),
    (
        "lap_joint",
        &[
            "structure.leaf_thickness=\"10 um\"",
            "structure.depth=\"60 m\"",
            "structure.depth=\"60 um\"",
            "structure.gap_length=\"6 m\"",
            "structure.gap_length=\"6 um\"",
            "structure.block_height=\"190 m\"",
            "wear.coefficient=\"2 um^3/J\"",
        ],
    ),
    (
        "resonator_springs",
        &[
            "contact.kn=\"12 N/um\"",
            "contact.kt=\"1e7 N/um\"",
            "dynamics.force.amplitude=\"1 N\"",
        ],
    ),
    (
        "oscillator",
        &[
            "structure.mass=\"1 g\"",
            "structure.mass=\"1 t\"",
            "structure.stiffness=\"4 N/mm\"",
            "structure.stiffness=\"4 N/nm\"",
            "structure.damping=\"20 kN s/m\"",
            "structure.damping=\"0.02 N s/m\"",
            "contact.kn=\"8 N/mm\"",
            "contact.kt=\"6 N/mm\"",
            "contact.kt=\"6 N/nm\"",
            "contact.normal_load=\"1000 kN\"",
            "contact.normal_load=\"1 N\"",
            "dynamics.force.amplitude=\"0.1 N\"",
            "dynamics.frequency=[\"0.16 Hz\", \"0.75 Hz\"]",
        ],
    ),
];

/// Values that also differ by a factor of a thousand and only cause a note, because they may be intended.
const MAY_BE_MEANT: &[(&str, &[&str])] = &[
    ("lap_joint", &["dynamics.force.amplitude=\"1 N\""]),
    ("prescribed_fretting", &["wear.cycles=10_000"]),
    ("measured_surface", &["wear.cycles=1_000"]),
];

fn shipped(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("pipelines/{name}.toml"))
}

/// Reference page with these mistakes.
fn page(warned: &str, remarked: &str) -> String {
    format!(
        "# Mistaken units\n\nThe program compares every scene with rules of thumb before it computes. A mistaken unit changes a value by a factor of a thousand or\n\
         more. `fretwear check`, `plan` and `run` name the key of an implausible value in a warning, and reject values that cannot be computed.\n\
         The tables list scenes of the sources in which one value is wrong by a factor of a thousand. This page is generated.\n\n\
         ## Mistakes with an error or a warning\n\n\
         | scene | mistake | message |\n|---|---|---|\n{warned}\n\
         ## Mistakes with a note\n\n\
         These values may be correct in another scene. `fretwear plan` prints a note, not a warning.\n\n\
         | scene | value | message |\n|---|---|---|\n{remarked}\n\
         ## Mistakes without a message\n\n\
         - A wrong number of cycles only makes the run longer. The program warns above 10\u{b9}\u{b2} cycles.\n\
         - A scene without `[structure]` does not use the density, so a wrong density has no effect.\n\
         - The program cannot judge tolerances, seeds, grids and other numbers without a unit.\n\
         - The program does not detect a value that is wrong by a factor of ten or less, because real joints differ by as much.\n\
         - The program does not detect a mistake that turns an unusual scene into a usual one.\n\n\
         Some warnings concern scenes that exist but that the grid does not resolve. For example, a load of 30 N on a plate of 16 cm\u{b2} presses\n\
         about two cells together.\n"
    )
}

/// Errors and warnings of a scene, and its notes.
fn said_of(pipeline: &str, set: &str) -> [Vec<String>; 2] {
    match load(&shipped(pipeline), &[set.to_owned()]) {
        Err(error) => [vec![error.to_string()], Vec::new()],
        Ok(scene) => match Plan::of(&scene) {
            Err(error) => [vec![error.to_string()], Vec::new()],
            Ok(plan) => {
                let remarks = plan.checks.into_iter().filter_map(|check| check.remark);
                [plan.warnings, remarks.collect()]
            }
        },
    }
}

/// Each pipeline with each of its mistakes.
fn each<'a>(mistakes: &'a [(&str, &[&str])]) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
    let of = |(pipeline, sets): &'a (&str, &[&str])| sets.iter().map(|set| (*pipeline, *set));
    mistakes.iter().flat_map(of)
}

/// One table row per mistake; panics if no message names the key.
fn rows(mistakes: &[(&str, &[&str])], kind: usize) -> String {
    let (mut faults, mut rows) = (Vec::new(), String::new());
    for (pipeline, set) in each(mistakes) {
        let said = said_of(pipeline, set);
        let (key, _) = set.split_once('=').expect("a key");
        // Messages about a force name the whole force.
        let key = key.replace("force.amplitude", "force");
        // The path of the file depends on the machine.
        let folder = format!("{}/pipelines/", env!("CARGO_MANIFEST_DIR"));
        match said[kind].iter().find(|text| text.contains(&key)) {
            Some(text) => {
                let text = text.replace(&folder, "").replace('|', "\\|");
                rows += &format!("| `{pipeline}` | `{set}` | {text} |\n");
            }
            None => faults.push(format!("{pipeline} with {set}: {said:?}")),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    rows
}

#[test]
fn a_mistaken_unit_is_named() {
    let page = page(&rows(MISTAKES, 0), &rows(MAY_BE_MEANT, 1));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/mistaken_units.md");
    if std::env::var_os("FRETWEAR_REWRITE_PAGES").is_some() {
        std::fs::write(&path, &page).expect("written");
    }
    let kept = std::fs::read_to_string(&path).expect("a page");
    assert_eq!(kept, page, "FRETWEAR_REWRITE_PAGES=1 writes the page again");
    // Values that may be intended cause no warning.
    for (pipeline, set) in each(MAY_BE_MEANT) {
        assert_eq!(said_of(pipeline, set)[0], [""; 0], "{set}");
    }
}

/// The contact model requires that slip is small compared with a cell: the program warns about a larger motion, also in `plan --json`.
#[test]
fn a_motion_beyond_a_cell_is_warned_of() {
    let [warnings, _] = said_of(
        "prescribed_fretting",
        "motion.amplitude=[\"0.5 mm\", \"0 m\"]",
    );
    let told = |part: &str| warnings.iter().any(|warning| warning.contains(part));
    assert!(
        told("motion.amplitude") && told("500 µm over 156.2 µm") && told("cells do not travel"),
        "{warnings:?}"
    );
    let [warnings, _] = said_of(
        "prescribed_fretting",
        "motion.amplitude=[\"0 m\", \"0.5 mm\"]",
    );
    assert!(
        warnings.iter().any(|w| w.contains("over a cell")),
        "{warnings:?}"
    );
    let half_a_cell = "motion.amplitude=[\"75 um\", \"0 m\"]";
    assert_eq!(
        said_of("prescribed_fretting", half_a_cell)[0],
        Vec::<String>::new()
    );
}

#[test]
fn no_shipped_scene_is_warned_of_and_all_have_figures_to_look_at() {
    for entry in std::fs::read_dir(shipped("x").parent().expect("a folder")).expect("pipelines") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let plan = Plan::of(&load(&path, &[]).expect("a scene")).expect("a plan");
        assert_eq!(plan.warnings, Vec::<String>::new(), "{}", path.display());
        assert!(
            plan.checks.len() >= 2,
            "{}: {:?}",
            path.display(),
            plan.checks
        );
        for check in &plan.checks {
            println!("{}: {}: {}", path.display(), check.what, check.value);
        }
    }
}

/// Correct but unusual values: rubber, a diamond tip, a lapped face, a motion that mostly sticks.
#[test]
fn what_is_unusual_is_not_warned_of() {
    let unusual: [(&str, &[&[&str]]); 5] = [
        (
            "static_contact",
            &[
                &[
                    "material.youngs_modulus=\"10 MPa\"",
                    "contact.normal_load=\"10 N\"",
                ],
                &["material.youngs_modulus=\"1 TPa\""],
                &["contact.normal_load=\"100 N\""],
                &["material.poisson_ratio=0"],
            ],
        ),
        (
            "prescribed_fretting",
            &[
                &["surface.rq=\"20 nm\""],
                &["motion.amplitude=[\"50 nm\", \"0 m\"]"],
                &["wear.coefficient=\"10 um^3/J\""],
                &["wear.coefficient=\"3e5 um^3/J\""],
                &["contact.friction_coefficient=0.05"],
                &["contact.normal_load=\"300 N\""],
                &["motion.amplitude=[\"100 um\", \"0 m\"]"],
            ],
        ),
        (
            "lap_joint",
            &[
                &["dynamics.force.amplitude=\"1 N\""],
                &["contact.normal_load=\"300 N\""],
                &[
                    "contact.bolt_stiffness=\"500 N/um\"",
                    "contact.pressing=\"punch\"",
                ],
                &["dynamics.damping_ratio=2e-5"],
                &[
                    "structure.leaf_thickness=\"1 mm\"",
                    "structure.gap_length=\"1 mm\"",
                ],
            ],
        ),
        (
            "oscillator",
            &[
                &["structure.damping=\"2000 N s/m\""],
                &["structure.stiffness=\"0 N/m\""],
                &["contact.kt=\"0.2 N/um\""],
                &["dynamics.frequency=[\"50 Hz\", \"60 Hz\"]"],
            ],
        ),
        (
            "resonator_springs",
            &[&["contact.kn=\"1000 N/um\"", "contact.kt=\"1000 N/um\""]],
        ),
    ];
    for (pipeline, scenes) in unusual {
        for sets in scenes {
            let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
            let scene = load(&shipped(pipeline), &sets).expect("a scene");
            let plan = Plan::of(&scene).expect("a plan");
            assert_eq!(plan.warnings, [""; 0], "{pipeline} {sets:?}");
        }
    }
}

/// Warnings or error of a shipped scene after the replacement of some of its lines.
fn said_of_edited(pipeline: &str, edits: &[(&str, &str)], map: Option<&str>) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut text = std::fs::read_to_string(shipped(pipeline)).expect("a scene");
    for (line, other) in edits {
        assert!(text.contains(line), "{line}");
        text = text.replace(line, other);
    }
    if let Some(map) = map {
        std::fs::write(folder.path().join("map.csv"), map).expect("written");
    }
    let path = folder.path().join("edited.toml");
    std::fs::write(&path, text).expect("written");
    let plan = load(&path, &[]).map_err(|error| error.to_string());
    match plan.and_then(|scene| Plan::of(&scene).map_err(|error| error.to_string())) {
        Ok(plan) => plan.warnings,
        Err(error) => vec![error],
    }
}

/// Motions and loads other than in the shipped scenes, with correct values and with values that are wrong by a factor of a thousand.
#[test]
fn other_motions_and_loads_are_looked_at() {
    const AMPLITUDE: &str = "amplitude = [\"5 um\", \"0 um\"]";
    const LOAD: &str = "normal_load = \"30 kN\"";
    let history = |load: f64, far: f64| {
        format!(
            "time,displacement_x,normal_load\n0,{far},{load}\n0.5,-{far},{load}\n0.75,0,{load}\n"
        )
    };
    for (pipeline, line, [right, wrong], key) in [
        (
            "static_contact",
            LOAD,
            ["approach = \"2 um\"", "approach = \"2 mm\""],
            "contact.approach",
        ),
        (
            "prescribed_fretting",
            AMPLITUDE,
            ["force = [\"9 kN\", \"0 N\"]", "force = [\"9 N\", \"0 N\"]"],
            "motion.force",
        ),
        (
            "prescribed_fretting",
            AMPLITUDE,
            ["rotation = \"0.2 mrad\"", "rotation = \"0.2 rad\""],
            "motion.rotation",
        ),
    ] {
        assert_eq!(
            said_of_edited(pipeline, &[(line, right)], None),
            Vec::<String>::new()
        );
        let said = said_of_edited(pipeline, &[(line, wrong)], None);
        assert!(
            said.iter().any(|text| text.contains(key)),
            "{wrong}: {said:?}"
        );
    }
    let shipped = [
        (AMPLITUDE, "history = \"map.csv\""),
        ("phase = \"0 deg\"", ""),
        ("normal_load_amplitude = \"0 N\"", ""),
    ];
    for (load, far, part) in [
        (30e3, 5e-6, None),
        (30.0, 5e-6, Some("motion.history, contact.normal_load")),
        (30e3, 0.0, Some("nothing moves")),
    ] {
        let said = said_of_edited("prescribed_fretting", &shipped, Some(&history(load, far)));
        match part {
            None => assert_eq!(said, Vec::<String>::new()),
            Some(part) => assert!(said.iter().any(|text| text.contains(part)), "{said:?}"),
        }
    }
    let tilted = "rotation = \"free\"\nmoment = [\"1000 N m\", \"0 N m\"]\nnormal_load = \"30 kN\"";
    let said = said_of_edited("static_contact", &[(LOAD, tilted)], None);
    assert!(
        said[0].contains("contact.moment") && said[0].contains("moves the resultant"),
        "{said:?}"
    );
}

/// Map with `nx` lines of `ny` values, rough enough to cause no other message.
fn map_of(nx: usize, ny: usize) -> String {
    let height = |i: usize, j: usize| (1.3 * i as f64).sin() + (0.7 * (i * j) as f64).cos();
    let line = |i: usize| {
        (0..ny)
            .map(|j| format!("{:.4}", height(i, j)))
            .collect::<Vec<_>>()
    };
    (0..nx).map(|i| line(i).join(",") + "\n").collect()
}

/// Messages about the spacing of such a map.
fn said_of_map(spacing: &str, nx: usize, ny: usize) -> Vec<String> {
    let line = format!("path = \"map.csv\"\nunit = \"um\"\n{spacing}");
    let edit = ("path = \"../data/ground_face.x3p\"", line.as_str());
    let mut said = said_of_edited("measured_surface", &[edit], Some(&map_of(nx, ny)));
    said.retain(|text| text.contains("surface.spacing, joint"));
    said
}

/// A joint on few points of a map does not resolve its roughness, whether the scene or the map states the spacing.
#[test]
fn few_points_of_a_map_are_warned_of() {
    let few =
        "surface.spacing, joint.size: the number of points of the map along a side of the joint is";
    // The joint has a size of 4.096 x 2.304 mm.
    let twice = said_of_map("spacing = [\"0.512 mm\", \"0.288 mm\"]", 12, 8);
    assert!(
        twice[0].starts_with(&format!("{few} 8 × 8, and should be at least 16")),
        "{twice:?}"
    );
    assert_eq!(twice.len(), 1);
    let enough = "spacing = [\"0.256 mm\", \"0.144 mm\"]";
    assert_eq!(said_of_map(enough, 16, 16), [""; 0]);
    let assumed = said_of_map("", 5, 4);
    assert!(
        assumed[0].starts_with(&format!("{few} 5 × 4")),
        "{assumed:?}"
    );
}

/// A map without spacing is assumed to cover the joint: cells with a large aspect ratio suggest that its axes are exchanged.
#[test]
fn long_cells_of_a_map_without_spacing_are_warned_of() {
    let aspect =
        "surface.spacing, joint.size: the spacing of the map's points along x over that along y is";
    // 4.096 over 2.304 mm equals 16 over 9.
    assert_eq!(said_of_map("", 32, 18), [""; 0]);
    assert_eq!(
        said_of_map("", 32, 36),
        [""; 0],
        "an aspect ratio of 2 causes no warning"
    );
    let exchanged = said_of_map("", 18, 32);
    assert!(
        exchanged[0].starts_with(&format!("{aspect} 3.16, and should be at most 2")),
        "{exchanged:?}"
    );
    let long = said_of_map("", 64, 16);
    assert!(long[0].contains("and should be at least 0.5"), "{long:?}");
    let given = "spacing = [\"64 um\", \"144 um\"]";
    assert_eq!(said_of_map(given, 64, 16), [""; 0]);
}
