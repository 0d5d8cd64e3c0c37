//! Wear of extreme joints. Each scene ends with finite tables and an error bar, or the program rejects the scene with the reason.

use fretwear::scene::load;
use fretwear::tables::{Column, TableName};

use super::Start;
use crate::support::{Bench, latest, reader, summary, table};

/// Columns that may be infinite: the stiffness of a joint without roughness, and the compliance of elements without friction
/// (`dynamic` of the ledger).
const INFINITE: [&str; 3] = ["kn", "kt", "dynamic"];

/// Names and changes of the small scene.
const SCENES: [(&str, &[&str]); 25] = [
    ("Rq 10 nm", &["surface.rq=\"10 nm\""]),
    ("Rq 100 nm", &["surface.rq=\"100 nm\""]),
    ("Rq 10 um", &["surface.rq=\"10 um\""]),
    ("Rq 100 um", &["surface.rq=\"100 um\""]),
    ("wear 1e-3", &["wear.coefficient=\"2 um^3/J\""]),
    ("wear 1e3", &["wear.coefficient=\"2e6 um^3/J\""]),
    ("stuck", &["motion.amplitude=\"1 pm\""]),
    ("nearly stuck", &["motion.amplitude=\"1 nm\""]),
    ("gross slip", &["motion.amplitude=\"10 um\""]),
    ("ten times gross slip", &["motion.amplitude=\"100 um\""]),
    ("1 N", &["contact.normal_load=\"1 N\""]),
    ("10 kN", &["contact.normal_load=\"10 kN\""]),
    ("10 MN", &["contact.normal_load=\"10 MN\""]),
    ("capped", &["contact.pressure_cap=\"100 MPa\""]),
    ("nearly all capped", &["contact.pressure_cap=\"17 MPa\""]),
    ("mu 0.01", &["contact.friction_coefficient=0.01"]),
    ("mu 2", &["contact.friction_coefficient=2.0"]),
    ("1e9 cycles", &["wear.cycles=1_000_000_000"]),
    (
        "an explicit step a thousand times too long",
        &[
            "wear.scheme=\"explicit\"",
            "wear.depth_step=\"100 um\"",
            "wear.cycles=100_000_000",
        ],
    ),
    (
        "a semi-implicit step a thousand times too long",
        &[
            "wear.scheme=\"semi_implicit\"",
            "wear.depth_step=\"100 um\"",
            "wear.cycles=100_000_000",
        ],
    ),
    (
        "through the deepest valley",
        &["motion.amplitude=\"20 um\"", "wear.cycles=1_000_000_000"],
    ),
    (
        "through the deepest valley of a capped joint",
        &[
            "motion.amplitude=\"20 um\"",
            "wear.cycles=1_000_000_000",
            "contact.pressure_cap=\"100 MPa\"",
        ],
    ),
    ("rubber", &["material.youngs_modulus=\"1 MPa\""]),
    (
        "a load that all but leaves",
        &[
            "motion.normal_load_amplitude=\"199 N\"",
            "fidelity.steps_per_cycle=8",
        ],
    ),
    (
        "an orbit",
        &[
            "motion.amplitude=[\"2 um\", \"2 um\"]",
            "motion.phase=[\"0 deg\", \"90 deg\"]",
            "fidelity.steps_per_cycle=8",
        ],
    ),
];

/// Largest number of iterations of each scene.
const ITERATIONS: u64 = 150;

fn wear_at(scenes: impl Iterator<Item = (&'static str, &'static [&'static str])>) {
    let bench = Bench::new();
    let mut faults = Vec::new();
    for (k, (name, sets)) in scenes.enumerate() {
        let root = bench.path(&format!("run-{k}"));
        let all = [&["wear.tolerance=0.02"], sets].concat();
        match Start::new(bench.scene("small.toml", &all), &root).run().0 {
            Err(error) => faults.push(format!("{name}: {error}")),
            Ok(_) => {
                let end = latest(&root);
                let [volume, bar, cycles] = ["wear_volume", "error_wear_volume", "cycles"]
                    .map(|column| summary(&root, end, column));
                println!(
                    "{name}: {end} iterations, {cycles:e} cycles, {volume:.3e} m3, bar {bar:.1e}"
                );
                if end > ITERATIONS {
                    faults.push(format!("{name}: {end} iterations"));
                }
                faults.extend(
                    strange(&root)
                        .into_iter()
                        .map(|fault| format!("{name}: {fault}")),
                );
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn wear_at_some_extremes() {
    wear_at(SCENES.into_iter().step_by(4));
}

#[test]
#[ignore = "long: half a minute"]
fn wear_at_the_extremes() {
    wear_at(SCENES.into_iter());
}

/// Columns with NaN, or with infinite values outside [`INFINITE`].
fn strange(root: &std::path::Path) -> Vec<String> {
    let mut found = Vec::new();
    for k in 0..=latest(root) {
        let commit = reader(root).commit_of(k).expect("committed").clone();
        for name in commit.tables.into_keys() {
            let name = TableName::ALL.into_iter().find(|t| t.as_str() == name);
            let name = name.expect("a table");
            for (schema, column) in table(root, k, name).columns() {
                if let Column::F64(values) = column {
                    let rigid = INFINITE.contains(&schema.name.as_str());
                    if values
                        .iter()
                        .any(|v| v.is_nan() || (v.is_infinite() && !rigid))
                    {
                        found.push(format!(
                            "{}.{} of iteration {k}",
                            name.as_str(),
                            schema.name
                        ));
                    }
                }
            }
        }
    }
    found
}

/// The program rejects impossible scenes and suggests a correct value.
#[test]
fn what_cannot_be_is_refused() {
    let bench = Bench::new();
    let folder = bench.path("run");
    let by_scene = |set: &str| match load(&bench.path("small.toml"), &[set.to_owned()]) {
        Ok(scene) => Start::new(scene, &folder).refused(),
        Err(error) => error.to_string(),
    };
    for (set, reason) in [
        ("contact.pressure_cap=\"16 MPa\"", "16.6667 MPa"),
        ("motion.normal_load_amplitude=\"200 N\"", "normal_load"),
        (
            "wear.coefficient=\"2e9 um^3/J\"",
            "a single cycle wears too much; raise wear.tolerance",
        ),
    ] {
        let refused = by_scene(set);
        assert!(refused.contains(reason), "{set}: {refused}");
    }
}

/// Wide range for the search of the resonance.
const ANYWHERE: &str = "dynamics.frequency=[\"20 Hz\", \"2000 Hz\"]";

/// Names and changes of the small resonator, for any law of its contact elements.
const VIBRATING: [(&str, &[&str]); 7] = [
    ("no friction", &[ANYWHERE, "contact.friction_coefficient=0"]),
    (
        "mu 1e-4",
        &[
            ANYWHERE,
            "contact.friction_coefficient=1e-4",
            "dynamics.force.amplitude=\"1 N\"",
        ],
    ),
    (
        "10 N",
        &[
            ANYWHERE,
            "contact.normal_load=\"10 N\"",
            "dynamics.force.amplitude=\"0.1 N\"",
        ],
    ),
    ("stuck", &["dynamics.force.amplitude=\"1 N\""]),
    (
        "contact nearly all over",
        &["surface.rq=\"0.5 um\"", "wear.cycles=2000"],
    ),
    (
        "few elements loaded, some open",
        &[
            ANYWHERE,
            "contact.normal_load=\"300 N\"",
            "surface.rq=\"10 um\"",
            "wear.cycles=1000",
        ],
    ),
    (
        "slides as a whole",
        &["dynamics.force.amplitude=\"1500 N\"", "wear.cycles=500"],
    ),
];

/// The loop of vibration and wear ends with either law of the contact elements. The fine contact dissipates at most the energy
/// of the exciter, within the error bar.
#[test]
#[ignore = "long: half a minute"]
fn vibration_at_the_extremes() {
    let bench = Bench::new();
    let mut faults = Vec::new();
    for (k, (name, sets)) in VIBRATING.into_iter().enumerate() {
        for law in ["sliders", "total"] {
            let root = bench.path(&format!("run-{law}-{k}"));
            let stiffness = format!("contact.stiffness={law}");
            let all = [&[stiffness.as_str()], sets].concat();
            if let Err(error) = Start::new(bench.scene("resonator.toml", &all), &root)
                .run()
                .0
            {
                faults.push(format!("{name}, {law}: {error}"));
                continue;
            }
            let end = latest(&root);
            let [volume, bar, closure] = ["wear_volume", "error_wear_volume", "error_closure"]
                .map(|column| summary(&root, end, column));
            println!(
                "{name}, {law}: {end} iterations, {volume:.3e} m3, bar {bar:.1e}, of which closure {closure:.1e}"
            );
            let found = strange(&root).into_iter();
            faults.extend(found.map(|fault| format!("{name}, {law}: {fault}")));
            let ledger = table(&root, end, TableName::Ledger);
            let row = |quantity: &str| {
                let named = ledger.text("quantity").expect("quantities");
                named
                    .iter()
                    .position(|q| q.starts_with(quantity))
                    .expect("a row")
            };
            let side = |of: &str, quantity: &str| ledger.f64(of).expect("a side")[row(quantity)];
            let supplied = side("dynamic", "work_of_the_loads");
            let taken = side("fine", "dissipated_energy");
            let input = table(&root, end, TableName::DynamicResponse);
            let input = input.f64("input_energy").expect("energy")[0];
            // The error bar is relative to the dissipated energy, as it is relative to the worn volume.
            if taken * (1.0 - bar) > supplied + BALANCE * input {
                faults.push(format!(
                    "{name}, {law}: friction dissipates {taken:e} J of {supplied:e} J, bar {bar:e}"
                ));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Largest error of the energy balance of a converged vibration, relative to the energy of the exciter.
const BALANCE: f64 = 1e-4;

/// The program rejects a joint that the vibration opens completely, since its resonance cannot be followed. The message suggests a remedy.
#[test]
#[ignore = "long: 7 seconds"]
fn a_vibration_that_opens_the_joint_is_refused() {
    let bench = Bench::new();
    let sets = [
        ANYWHERE,
        "contact.stiffness=sliders",
        "dynamics.force={amplitude=\"30 N\",at=\"far_wall\",direction=\"z\"}",
        "contact.normal_load=\"100 N\"",
        "wear.cycles=1000",
    ];
    let refused = Start::new(bench.scene("resonator.toml", &sets), &bench.path("run")).refused();
    assert!(
        refused.contains("the phase resonance could not be tracked")
            && refused.contains("contact.normal_load"),
        "{refused}"
    );
}
