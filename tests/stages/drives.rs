//! Tables of driven joints: given channels follow the scene, and free channels have zero force.

use std::f64::consts::TAU;
use std::path::Path;

use fretwear::scene::{InputError, Plan};
use fretwear::tables::{Table, TableName};

use super::Start;
use crate::support::{Bench, latest, summary, table, verified};

/// Tolerance of given and free channels, relative to the friction force or to its moment.
const OFF: f64 = 1e-6;
/// Largest moment at free rotations, relative to load times length.
const MOMENT: f64 = 1e-9;
/// Load [N] and longer side [m] of the small joint, and its friction force [N].
const LOAD: f64 = 200.0;
const LENGTH: f64 = 4e-3;
const FRICTION: f64 = 120.0;

fn run(bench: &Bench, sets: &[&str]) -> std::path::PathBuf {
    let root = bench.path("run");
    let mut all = vec!["wear.cycles=60_000"];
    all.extend(sets);
    Start::new(bench.scene("small.toml", &all), &root).done();
    verified(&root);
    root
}

fn cycles(root: &Path) -> impl Iterator<Item = Table> + '_ {
    (0..=latest(root)).map(move |k| table(root, k, TableName::Cycle))
}

fn column<'t>(table: &'t Table, name: &str) -> &'t [f64] {
    table.f64(name).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn free_rotations_leave_no_moments_and_are_reported() {
    let bench = Bench::new();
    let root = run(&bench, &["contact.rotation=free"]);
    for k in 0..=latest(&root) {
        let contact = table(&root, k, TableName::StaticContact);
        let row = table(&root, k, TableName::Summary);
        for (moment, rotation) in [("moment_x", "rotation_x"), ("moment_y", "rotation_y")] {
            let value = column(&contact, moment)[0];
            assert!(
                value.abs() < MOMENT * LOAD * LENGTH,
                "{moment} = {value:e} N m"
            );
            assert_ne!(column(&contact, rotation)[0], 0.0);
            assert_eq!(column(&contact, rotation), column(&row, rotation));
        }
    }
}

#[test]
fn given_moments_are_borne_and_fixed_rotations_have_reactions() {
    let bench = Bench::new();
    let root = run(
        &bench,
        &[
            "contact.rotation=free",
            r#"contact.moment=["0.04 N m", "-0.02 N m"]"#,
        ],
    );
    let row = table(&root, latest(&root), TableName::Summary);
    for (name, asked) in [("moment_x", 0.04), ("moment_y", -0.02)] {
        let found = column(&row, name)[0];
        assert!(
            (found - asked).abs() < MOMENT * LOAD * LENGTH,
            "{name} = {found} N m"
        );
    }
    let bench = Bench::new();
    let root = run(&bench, &[]);
    let row = table(&root, latest(&root), TableName::Summary);
    assert!(!row.has("rotation_x"), "fixed rotations must be absent");
    assert!(column(&row, "moment_x")[0].abs() > MOMENT * LOAD * LENGTH);
}

#[test]
fn a_given_force_is_followed_and_the_displacement_found() {
    for (march, phase) in [("reversal", 0.0f64), ("reversal", 0.7), ("stepped", 0.7)] {
        let bench = Bench::new();
        let root = run(
            &bench,
            &[
                "motion.force=60 N",
                &format!("motion.phase=\"{phase} rad\""),
                &format!("fidelity.cycle={march}"),
            ],
        );
        for cycle in cycles(&root) {
            let (time, force) = (column(&cycle, "time"), column(&cycle, "force_x"));
            for (t, force) in time.iter().zip(force) {
                let asked = 60.0 * (TAU * t + phase).cos();
                assert!(
                    (force - asked).abs() < OFF * FRICTION,
                    "{march}: {force} N at {t}"
                );
            }
            let displacement = column(&cycle, "displacement_x");
            let most = displacement.iter().copied().fold(f64::MIN, f64::max);
            let least = displacement.iter().copied().fold(f64::MAX, f64::min);
            assert!(most > 0.0, "{march}: the joint must move");
            assert!(
                (most + least).abs() < 1e-3 * most,
                "{march}: the mean must be small"
            );
        }
        assert!(summary(&root, latest(&root), "dissipated_energy") > 0.0);
    }
}

#[test]
fn a_free_transverse_direction_bears_nothing() {
    for march in ["reversal", "stepped"] {
        let bench = Bench::new();
        let cycle = format!("fidelity.cycle={march}");
        let root = run(&bench, &["contact.transverse=free", &cycle]);
        for cycle in cycles(&root) {
            for force in column(&cycle, "force_y") {
                assert!(force.abs() < OFF * FRICTION, "{march}: {force:e} N along y");
            }
            assert!(column(&cycle, "displacement_y").iter().any(|u| *u != 0.0));
        }
    }
}

#[test]
fn a_rotation_about_z_and_a_moment() {
    for (key, value, name) in [
        ("motion.rotation", "0.2 mrad", "rotation_z"),
        ("motion.moment", "0.04 N m", "moment_z"),
    ] {
        let bench = Bench::new();
        let root = run(
            &bench,
            &[
                "motion.amplitude=0 um",
                &format!("{key}=\"{value}\""),
                "fidelity.cycle=stepped",
            ],
        );
        let asked = if name == "rotation_z" { 2e-4 } else { 0.04 };
        for cycle in cycles(&root) {
            let (time, values) = (column(&cycle, "time"), column(&cycle, name));
            for (t, value) in time.iter().zip(values) {
                let wanted = asked * (TAU * t).cos();
                assert!(
                    (value - wanted).abs() < OFF * asked.max(FRICTION * LENGTH),
                    "{key}: {value} at {t}"
                );
            }
            let other = if name == "rotation_z" {
                "moment_z"
            } else {
                "rotation_z"
            };
            assert!(column(&cycle, other).iter().any(|v| *v != 0.0));
        }
        assert!(summary(&root, latest(&root), "dissipated_energy") > 0.0);
    }
}

/// The plan rejects a force that exceeds the friction force.
#[test]
fn a_force_beyond_friction_is_refused_by_the_plan() {
    let bench = Bench::new();
    let error = Plan::of(&bench.scene("small.toml", &["motion.force=120 N"])).expect_err("refused");
    assert!(matches!(error, InputError::Plan(_)), "{error}");
    assert!(
        error.to_string().contains("`motion.force` reaches 1.2"),
        "{error}"
    );
    Plan::of(&bench.scene("small.toml", &["motion.force=119 N"])).expect("held");
}

/// The plan rejects a moment above the largest possible friction moment: the whole load on the outermost cell.
#[test]
fn a_moment_beyond_friction_is_refused_by_the_plan() {
    const SHORTER: f64 = 3e-3;
    const CELLS: [f64; 2] = [26.0, 22.0];
    // Largest moment: the friction force at the centre of the corner cell.
    let half = |length: f64, cells: f64| 0.5 * length * (1.0 - 1.0 / cells);
    let corner = half(LENGTH, CELLS[0]).hypot(half(SHORTER, CELLS[1]));
    let most = FRICTION * corner;
    let bench = Bench::new();
    let plan = |moment: f64| {
        Plan::of(&bench.scene(
            "small.toml",
            &[
                "motion.amplitude=0 um",
                &format!("motion.moment=\"{moment:e} N m\""),
            ],
        ))
    };
    let error = plan(1.001 * most).expect_err("refused").to_string();
    assert!(error.contains("`motion.moment` reaches"), "{error}");
    assert!(error.contains("N m or N mm"), "{error}");
    plan(0.999 * most).expect("held");
}
