//! Comparison of declared keys with loaded scenes: the program reads each key, accepts each example, and applies each default.

use std::collections::BTreeSet;

use fretwear::recipe::Part;
use fretwear::scene::explain::{About, KeyDescription, explain, sections};
use fretwear::scene::{Motion, Plan, Preset, Scene, SceneError};

use super::{CASE, Folder, OSCILLATOR, ROUGH, SPRINGS, replaced};

/// Bolt with its dimensions.
fn bolt(thread: &str) -> String {
    format!(
        "bolt = {{ {thread}, clamp_length = \"40 mm\", bearing_diameter = \"14.6 mm\", hole = \"11 mm\", outer_diameter = \"40 mm\" }}\n"
    )
}

/// Scenes for tests of keys. Each key belongs in at least one scene and is absent from at least one scene.
fn scenes() -> Vec<(&'static str, String)> {
    let gaussian = "kind = \"gaussian\"\nrq = \"5 um\"\ncorrelation_length = [\"0.5 mm\", \"0.4 mm\"]\nseed = 3\n";
    let surface = |text: &str| replaced(CASE, gaussian, text);
    let after = |case: &str, line: &str, more: &str| replaced(case, line, &format!("{line}{more}"));
    let of_files = |lines: &str| {
        let kind = "kind = \"resonator\"\n";
        let structure = format!("kind = \"matrices\"\n{lines}");
        let rough = replaced(ROUGH, "elements = [19, 19]\n", "");
        replaced(
            &replaced(&rough, kind, &structure),
            "\"far_wall\"",
            "\"17\"",
        )
    };
    let (still, _) = CASE.split_once("[motion]").expect("a motion");
    vec![
        ("case", CASE.to_owned()),
        ("rough", ROUGH.to_owned()),
        ("springs", SPRINGS.to_owned()),
        ("oscillator", OSCILLATOR.to_owned()),
        (
            "shaken",
            format!("{OSCILLATOR}base = {{ acceleration = \"1 m/s^2\" }}\n"),
        ),
        (
            "stopped",
            after(
                OSCILLATOR,
                "mass = \"1 kg\"\n",
                "stop_stiffness = \"1 N/um\"\n",
            ),
        ),
        ("still", still.replace("friction_coefficient = 0.6\n", "")),
        (
            "exponential",
            surface("kind = \"exponential\"\nrq = \"5 um\"\ncorrelation_length = \"1 mm\"\n"),
        ),
        (
            "self_affine",
            surface("kind = \"self_affine\"\nrq = \"5 um\"\nhurst = 0.7\n"),
        ),
        ("sphere", surface("kind = \"sphere\"\nradius = \"20 mm\"\n")),
        ("file", surface("kind = \"file\"\npath = \"other.npy\"\n")),
        (
            "two_faces",
            surface("kind = \"file\"\npath = \"other.npy\"\nsecond = { path = \"upper.npy\" }\n"),
        ),
        (
            "tilting",
            after(CASE, "normal_load = \"30 kN\"\n", "rotation = \"free\"\n"),
        ),
        (
            "bolted",
            after(CASE, "normal_load = \"30 kN\"\n", &bolt("size = \"M10\"")),
        ),
        (
            "bolted_in_inches",
            after(
                CASE,
                "normal_load = \"30 kN\"\n",
                &bolt("diameter = \"9.525 mm\", core_diameter = \"7.8 mm\""),
            ),
        ),
        (
            "by_table",
            replaced(
                SPRINGS,
                &SPRINGS[SPRINGS.find("[contact]").expect("a contact")
                    ..SPRINGS.find("[structure]").expect("a structure")],
                "[contact]\nelements = \"contact.csv\"\n",
            ),
        ),
        ("pruned", replaced(CASE, "\"all\"", "{ every = 2 }")),
        ("halved", replaced(CASE, "[64, 40]", "[64, 66]")),
        (
            "fields",
            after(CASE, "keep = \"all\"\n", "cycle_fields = { j = [0, 3] }\n"),
        ),
        (
            "open",
            replaced(OSCILLATOR, "normal_load = \"1 kN\"", "gap = \"2 um\""),
        ),
        (
            "low",
            after(
                ROUGH,
                "kind = \"resonator\"\n",
                "window_height = \"39 mm\"\n",
            ),
        ),
        ("plain", replaced(ROUGH, "elements = [19, 19]\n", "")),
        (
            "matrices",
            of_files("stiffness = \"K.mtx\"\nmass = \"M.mtx\"\ninterface = \"pairs.csv\"\n"),
        ),
        (
            "superelement",
            of_files("file = \"K.op4\"\ninterface = { upper = \"A\", lower = \"B\" }\n"),
        ),
        (
            "mesh",
            replaced(
                &of_files("file = \"model.inp\"\ninterface = \"pairs.csv\"\n"),
                "\"matrices\"",
                "\"mesh\"",
            ),
        ),
        (
            "preloaded",
            replaced(
                &of_files("file = \"K.op4\"\ninterface = { upper = \"A\", lower = \"B\" }\n"),
                "normal_load = \"30 kN\"",
                "preload = { force = \"30 kN\", head = \"HEAD\", nut = \"NUT\" }",
            ),
        ),
    ]
}

/// Folder of scenes, and their names.
struct Scenes(Folder, Vec<&'static str>);

impl Scenes {
    fn new() -> Scenes {
        let mut folder = Folder::new();
        let mut names = Vec::new();
        for (name, text) in scenes() {
            folder = folder.with(&format!("{name}.toml"), &text);
            names.push(name);
        }
        Scenes(folder, names)
    }

    fn load(&self, name: &str, sets: &[&str]) -> Result<Scene, SceneError> {
        self.0.load(&format!("{name}.toml"), sets)
    }

    /// True if the text of the scene contains the key.
    fn has(&self, name: &str, key: &str) -> bool {
        let scene = self.load(name, &[]).expect("a scene");
        let mut parts = key.split('.');
        let first = parts.next().and_then(|part| scene.document().get(part));
        parts.fold(first, |found, part| found?.get(part)).is_some()
    }
}

/// All keys except `base`, which only a file may contain.
fn keys() -> Vec<KeyDescription> {
    let keys = sections().into_iter().flat_map(|section| section.keys);
    keys.filter(|key| key.key != "base").collect()
}

/// Example of a key as an argument of `--set`.
fn example(key: &KeyDescription) -> String {
    let value = key.example.split_once(" = ").expect("a line").1;
    format!("{}={value}", key.key)
}

#[test]
fn every_example_is_accepted_and_every_key_is_read() {
    let scenes = Scenes::new();
    for key in keys() {
        let set = example(&key);
        let accepting: Vec<&str> = scenes
            .1
            .iter()
            .copied()
            .filter(|name| scenes.load(name, &[&set]).is_ok())
            .collect();
        assert!(!accepting.is_empty(), "no scene accepts {set}");
        // A date is never a valid value.
        let set = format!("{}=1979-05-27", key.key);
        for name in accepting {
            let error = scenes.load(name, &[&set]).expect_err("a date").to_string();
            let begin = format!("--set {set}: {} = 1979-05-27: must be ", key.key);
            assert!(error.starts_with(&begin), "{name}: {error}");
        }
    }
}

/// Parts of a recipe that stages read.
const PARTS: [Part; 8] = [
    Part::Structure,
    Part::Surface,
    Part::Contact,
    Part::Cycle,
    Part::Elements,
    Part::Response,
    Part::Wear,
    Part::ResponseAt,
];

/// The hash of a scene covers all inputs of a run: each change of the recipe changes the record.
#[test]
fn what_moves_the_recipe_moves_the_record() {
    let scenes = Scenes::new();
    let recipe = |scene: &Scene| {
        let plan = Plan::of(scene).ok()?;
        Some((plan.inputs.recipe, plan.inputs.motion))
    };
    let mut moved = 0;
    for name in &scenes.1 {
        let before = scenes.load(name, &[]).expect("a scene");
        let Some(of_before) = recipe(&before) else {
            continue;
        };
        for key in keys().iter().filter(|key| key.key != "title") {
            let words = key.choices.iter().map(|choice| choice.word);
            let words = words.map(|word| format!("{}={word}", key.key));
            for set in words.chain([example(key)]) {
                let Ok(after) = scenes.load(name, &[&set]) else {
                    continue;
                };
                let Some(of_after) = recipe(&after) else {
                    continue;
                };
                // Reasons are omitted, since a reason names each key that the scene contains, even with its default value.
                let [parts, other] = [&of_before, &of_after].map(|(recipe, motion)| {
                    let parameters = recipe.parameters(&PARTS);
                    (parameters, format!("{motion:?}"), recipe.output.clone())
                });
                if parts != other {
                    moved += 1;
                    assert_ne!(before.canonical(), after.canonical(), "{name}: {set}");
                }
            }
        }
    }
    assert!(moved > 500, "{moved}");
}

#[test]
fn every_word_is_accepted() {
    let scenes = Scenes::new();
    for key in keys() {
        for choice in &key.choices {
            let set = format!("{}={}", key.key, choice.word);
            let known = scenes
                .1
                .iter()
                .any(|name| match scenes.load(name, &[&set]) {
                    Ok(_) => true,
                    // A word may need other keys. Such an error differs from the error for an unknown word.
                    Err(error) => !error.to_string().contains("must be one of"),
                });
            assert!(known, "{set}");
            assert!(
                !choice.meaning.is_empty() && !choice.meaning.ends_with('.'),
                "{set}"
            );
        }
    }
}

/// Test of the kind of a scene.
type OfScene = fn(&Scene) -> bool;

/// Keys with a default that differs from the preset in scenes of some kind. An oscillator has more samples.
/// A joint that vibrates has longer wear steps. A motion from a history has more steps per cycle.
const OTHER_THAN_THE_PRESET: [(&str, OfScene); 4] = [
    ("fidelity.harmonic_tolerance", |scene| {
        scene.recipe.wear.is_some()
    }),
    ("fidelity.aft_samples", |scene| scene.joint.is_none()),
    ("fidelity.wear_tolerance", |scene| {
        scene.recipe.response.is_some()
    }),
    ("fidelity.steps_per_cycle", |scene| {
        matches!(scene.motion, Some(Motion::History { .. }))
    }),
];

#[test]
fn every_default_is_what_an_absent_key_gives() {
    const PRESETS: [(&str, Preset); 4] = [
        ("paper", Preset::Paper),
        ("fast", Preset::Fast),
        ("balanced", Preset::Balanced),
        ("reference", Preset::Reference),
    ];
    let scenes = Scenes::new();
    let mut count = 0;
    for key in keys() {
        let defaults = PRESETS.map(|(_, preset)| key.default_under(preset));
        let same = defaults.iter().all(|default| *default == defaults[0]);
        for ((preset, _), default) in PRESETS.into_iter().zip(defaults) {
            let Some(default) = default else { continue };
            let preset = format!("fidelity.preset={preset}");
            let under: &[&str] = if same { &[] } else { &[&preset] };
            let set = format!("{}={default}", key.key);
            let sets = [under, &[&set]].concat();
            let mut held = false;
            for name in scenes.1.iter().filter(|name| !scenes.has(name, key.key)) {
                // A key of a table would create the table in a scene without the table.
                let tables = [
                    ("output.keep.", "pruned"),
                    ("contact.bolt.", "bolted"),
                    ("surface.second.", "two_faces"),
                    ("output.cycle_fields.", "fields"),
                    ("structure.interface.", "superelement"),
                ];
                let of_table =
                    |(table, with): (&str, &str)| key.key.starts_with(table) && *name != with;
                if tables.into_iter().any(of_table) {
                    continue;
                }
                // The program rejects keys that do not belong in the scene.
                let (Ok(without), Ok(with)) = (scenes.load(name, under), scenes.load(name, &sets))
                else {
                    continue;
                };
                let mut others = OTHER_THAN_THE_PRESET.iter();
                if others.any(|(other, is_so)| key.key == *other && is_so(&without)) {
                    continue;
                }
                assert_eq!(
                    without.canonical(),
                    with.canonical(),
                    "{name}: {set} {under:?}"
                );
                held = true;
            }
            assert!(held, "no scene tests {set}");
            count += 1;
        }
    }
    assert!(count > 80, "{count} defaults");
}

/// Each default that the documentation describes in words equals the default of an absent key.
#[test]
fn rules_are_what_an_absent_key_gives() {
    let scenes = Scenes::new();
    for (name, under, set) in [
        (
            "plain",
            "fidelity.preset=balanced",
            "joint.elements=[19, 19]",
        ),
        (
            "case",
            "fidelity.preset=fast",
            "material.lower.youngs_modulus=198.4 GPa",
        ),
        (
            "case",
            "fidelity.preset=fast",
            "material.upper.poisson_ratio=0.3",
        ),
        (
            "self_affine",
            "fidelity.preset=fast",
            "surface.rolloff_wavelength=40 mm",
        ),
        (
            "springs",
            "fidelity.preset=paper",
            "dynamics.harmonics=[0, 1, 2, 3]",
        ),
        (
            "springs",
            "fidelity.preset=fast",
            "dynamics.damping_ratio=0.002",
        ),
        (
            "oscillator",
            "fidelity.preset=fast",
            "dynamics.damping_ratio=0",
        ),
        (
            "springs",
            "dynamics.force.at=block",
            "dynamics.response.at=block",
        ),
        (
            "springs",
            "dynamics.force.direction=z",
            "dynamics.response.direction=z",
        ),
        (
            "springs",
            "fidelity.preset=fast",
            "dynamics.force.at=far_wall",
        ),
        (
            "oscillator",
            "fidelity.preset=fast",
            "dynamics.force.at=mass",
        ),
        ("case", "fidelity.preset=paper", "wear.depth_step=0.1 um"),
        (
            "case",
            "fidelity.wear_tolerance=0.02",
            "fidelity.wear_tolerance=0.02",
        ),
        ("case", "fidelity.preset=fast", "wear.law=energy"),
    ] {
        let [without, with] = [&[under][..], &[under, set]].map(|sets| scenes.load(name, sets));
        let [without, with] =
            [without, with].map(|scene| scene.unwrap_or_else(|error| panic!("{name}: {error}")));
        assert_eq!(without.canonical(), with.canonical(), "{name}: {set}");
    }
}

#[test]
fn every_key_is_told_in_plain_sentences() {
    let mut seen = BTreeSet::new();
    for section in sections() {
        assert!(section.meaning.ends_with('.'), "[{}]", section.section);
        for key in section.keys {
            assert!(seen.insert(key.key), "{} twice", key.key);
            let (meaning, summary) = (&key.meaning, key.summary());
            assert!(
                meaning.ends_with('.') && !meaning.contains("  "),
                "{}: {meaning}",
                key.key
            );
            assert!((5..=110).contains(&summary.len()), "{}: {summary}", key.key);
            assert!(meaning.starts_with(summary), "{}: {summary}", key.key);
            assert!(
                !key.kind.is_empty() && !key.default.is_empty(),
                "{}",
                key.key
            );
            assert_eq!(
                explain(key.key).map(|about| matches!(about, About::Key(_))),
                Ok(![
                    "update",
                    "output.keep",
                    "output.cycle_fields",
                    "structure.interface",
                    "dynamics.force"
                ]
                .contains(&key.key))
            );
            for other in &key.instead {
                assert!(
                    matches!(explain(other), Ok(About::Key(_))),
                    "{}: {other}",
                    key.key
                );
            }
        }
    }
    assert!(seen.len() > 110, "{}", seen.len());
}

#[test]
fn a_section_is_told_by_its_keys() {
    let Ok(About::Section(section)) = explain("dynamics") else {
        panic!("the section is missing");
    };
    let names: Vec<&str> = section.keys.iter().map(|key| key.key).collect();
    assert_eq!(
        names[..3],
        [
            "dynamics.force",
            "dynamics.force.amplitude",
            "dynamics.force.at"
        ]
    );
    let Ok(About::Section(inner)) = explain("dynamics.response") else {
        panic!("the section is missing");
    };
    assert_eq!(inner.keys.len(), 2);
    for (name, hint) in [
        (
            "normal_load",
            "normal_load: there is no such key; did you mean contact.normal_load?",
        ),
        (
            "contact.nomal_load",
            "contact.nomal_load: there is no such key; did you mean contact.normal_load?",
        ),
        (
            "joint.hole.zzz",
            "joint.hole.zzz: there is no such key; known here: diameter",
        ),
        (
            "[contact]",
            "[contact]: there is no such key; did you mean contact?",
        ),
    ] {
        assert_eq!(explain(name).expect_err("none").to_string(), hint);
    }
}
