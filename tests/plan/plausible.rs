//! Wrong by a thousand is caught: mistaken units, each named by its key, and no warning for what is shipped.

use std::path::Path;

use fretwear::scene::{Plan, load};

/// Pipeline, what a tired engineer typed, and the key that has to be named.
const MISTAKES: [(&str, &str, &str); 24] = [
    (
        "hertz_fretting",
        "contact.normal_load=\"90 kN\"",
        "contact.normal_load",
    ),
    (
        "hertz_fretting",
        "material.youngs_modulus=\"198.4 MPa\"",
        "material.youngs_modulus",
    ),
    (
        "hertz_fretting",
        "surface.radius=\"25 um\"",
        "surface.radius",
    ),
    (
        "hertz_fretting",
        "motion.amplitude=\"1.09 mm\"",
        "motion.amplitude",
    ),
    ("prescribed_fretting", "surface.rq=\"5 mm\"", "surface.rq"),
    (
        "prescribed_fretting",
        "surface.rq=\"5e-6 um\"",
        "surface.rq",
    ),
    (
        "prescribed_fretting",
        "contact.normal_load=\"30 MN\"",
        "contact.normal_load",
    ),
    (
        "prescribed_fretting",
        "material.youngs_modulus=\"198.4 MPa\"",
        "material.youngs_modulus",
    ),
    (
        "prescribed_fretting",
        "material.youngs_modulus=\"198.4 TPa\"",
        "material.youngs_modulus",
    ),
    (
        "prescribed_fretting",
        "wear.coefficient=\"2e3 mm^3/J\"",
        "wear.coefficient",
    ),
    (
        "prescribed_fretting",
        "wear.coefficient=\"2e9 um^3/J\"",
        "wear.coefficient",
    ),
    (
        "prescribed_fretting",
        "motion.amplitude=[\"5 m\", \"0 m\"]",
        "motion.amplitude",
    ),
    (
        "prescribed_fretting",
        "motion.amplitude=[\"5e-6 um\", \"0 m\"]",
        "motion.amplitude",
    ),
    (
        "prescribed_fretting",
        "joint.size=[\"40 m\", \"40 m\"]",
        "joint.size",
    ),
    (
        "prescribed_fretting",
        "surface.correlation_length=[\"0.5 um\", \"0.5 um\"]",
        "surface.correlation_length",
    ),
    (
        "prescribed_fretting",
        "surface.correlation_length=[\"0.5 m\", \"0.5 m\"]",
        "surface.correlation_length",
    ),
    (
        "prescribed_fretting_plastic",
        "contact.pressure_cap=\"600 GPa\"",
        "contact.pressure_cap",
    ),
    (
        "lap_joint",
        "dynamics.force.amplitude=\"1000 kN\"",
        "dynamics.force",
    ),
    (
        "lap_joint",
        "material.density=\"7949 g/cm^3\"",
        "material.density",
    ),
    (
        "lap_joint",
        "dynamics.frequency=[\"900 kHz\", \"1050 kHz\"]",
        "dynamics.frequency",
    ),
    (
        "lap_joint",
        "contact.friction_coefficient=60",
        "contact.friction_coefficient",
    ),
    (
        "lap_joint",
        "dynamics.damping_ratio=0.3",
        "dynamics.damping_ratio",
    ),
    (
        "lap_joint",
        "contact.bolt_stiffness=\"500 GN/um\"",
        "contact.bolt_stiffness",
    ),
    ("oscillator", "structure.mass=\"1e-9 kg\"", "structure"),
];

fn shipped(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("pipelines/{name}.toml"))
}

/// The page of the book that has them.
fn page(rows: &str) -> String {
    format!(
        "# Mistaken units\n\nAfter this page you know which mistakes the program finds before it computes, and what it says of them.\n\n\
         A unit that is mistaken is wrong by a thousand or more. `fretwear check`, `plan` and `run` look at figures by rules of thumb and warn by\n\
         the name of the key where one is so far from any joint that a unit must be wrong; what cannot be computed at all is an error. A test makes\n\
         each of these mistakes in a shipped scene, and holds that no shipped scene is warned of without one. Right but unusual values (rubber,\n\
         polished glass, a joint that only sticks) are not warned of.\n\n\
         | scene | mistake | what is said |\n|---|---|---|\n{rows}"
    )
}

#[test]
fn a_mistaken_unit_is_named() {
    let mut faults = Vec::new();
    let mut rows = String::new();
    for (pipeline, set, key) in MISTAKES {
        let told = match load(&shipped(pipeline), &[set.to_owned()]) {
            Err(error) => vec![error.to_string()],
            Ok(scene) => match Plan::of(&scene) {
                Err(error) => vec![error.to_string()],
                Ok(plan) => plan.warnings,
            },
        };
        let said = told.iter().find(|text| text.contains(key));
        rows += &format!(
            "| `{pipeline}` | `{set}` | {} |\n",
            said.map_or("", String::as_str).replace('|', "\\|")
        );
        if !told.iter().any(|text| text.contains(key)) {
            faults.push(format!("{pipeline} with {set}: {told:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/mistakes.md");
    if std::env::var_os("FRETWEAR_REWRITE_PAGES").is_some() {
        std::fs::write(&path, page(&rows)).expect("written");
    }
    let kept = std::fs::read_to_string(&path).expect("a page");
    assert_eq!(kept, page(&rows), "FRETWEAR_REWRITE_PAGES=1 writes it anew");
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

/// Values that are right, if unusual: rubber, a diamond tip, polished glass, a motion that only sticks.
#[test]
fn what_is_unusual_is_not_warned_of() {
    for (pipeline, sets) in [
        (
            "static_contact",
            vec![
                "material.youngs_modulus=\"10 MPa\"",
                "contact.normal_load=\"10 N\"",
            ],
        ),
        ("static_contact", vec!["material.youngs_modulus=\"1 TPa\""]),
        ("prescribed_fretting", vec!["surface.rq=\"20 nm\""]),
        (
            "prescribed_fretting",
            vec!["motion.amplitude=[\"20 nm\", \"0 m\"]"],
        ),
        (
            "prescribed_fretting",
            vec!["wear.coefficient=\"10 um^3/J\""],
        ),
        (
            "prescribed_fretting",
            vec!["wear.coefficient=\"3e5 um^3/J\""],
        ),
        ("lap_joint", vec!["dynamics.force.amplitude=\"1 N\""]),
        ("lap_joint", vec!["contact.normal_load=\"300 N\""]),
        ("lap_joint", vec!["contact.bolt_stiffness=\"500 N/um\""]),
    ] {
        let sets: Vec<String> = sets.into_iter().map(str::to_owned).collect();
        let plan = Plan::of(&load(&shipped(pipeline), &sets).expect("a scene")).expect("a plan");
        assert_eq!(plan.warnings, Vec::<String>::new(), "{pipeline} {sets:?}");
    }
}
