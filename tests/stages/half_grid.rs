//! Tests of half the grid: its stepped cycles give a correction of the cycles between two ends, and its worn volume gives an error bar.

use std::path::Path;

use fretwear::scene;
use fretwear::stages::{Ending, Stage};
use fretwear::tables::TableName;

use super::Start;
use crate::support::{Bench, assert_same, content, latest, summary, table};

/// Joint with an even number of cells. Its contact elements are sliders.
const LAP: [&str; 6] = [
    "joint.grid=[72, 64]",
    "contact.stiffness=sliders",
    "dynamics.force.amplitude=1000 N",
    "update.stiffness_change=0.1",
    "update.volume_growth=0.4",
    "wear.coefficient=2e3 um^3/J",
];

#[test]
fn both_scales_take_the_energy_of_stepped_cycles_and_the_bar_that_of_the_grid() {
    let bench = Bench::new();
    let sets = [
        &LAP[..],
        &["wear.cycles=1_000_000", "fidelity.grid_check=true"],
    ]
    .concat();
    let scene = bench.scene("resonator.toml", &sets);
    let (whole, parts) = (bench.path("whole"), bench.path("parts"));
    Start::new(scene.clone(), &whole).done();
    let end = latest(&whole);
    let of = |k: u64, name, column| table(&whole, k, name).f64(column).expect("a number")[0];

    // The factor of a check applies from the next update on.
    let found = |k| of(k, TableName::FrettingCycle, "stepped_part");
    let in_force = |k| of(k, TableName::DynamicResponse, "stepped_part");
    let updated = |k: u64| {
        table(&whole, k, TableName::ModelUpdate)
            .bool("updated")
            .expect("a flag")[0]
    };
    let first = (0..=end).find(|&k| found(k) != 1.0).expect("a check");
    assert!((0.8..1.2).contains(&found(first)), "{}", found(first));
    let next = (first + 1..=end)
        .find(|&k| updated(k))
        .expect("an update behind it");
    for k in 0..=end {
        let asked = match k < next {
            true => 1.0,
            false => found((0..k).rev().find(|&k| updated(k + 1)).expect("an update")),
        };
        assert_eq!(in_force(k), asked, "iteration {k}");
        let error = of(k, TableName::FrettingCycle, "error_between_ends");
        let asked = match k < first {
            true => 0.0,
            false => (in_force(k) / found(k) - 1.0).abs() + 0.006,
        };
        assert!(
            (error - asked).abs() < 1e-12,
            "iteration {k}: {error} for {asked}"
        );
    }
    // The contact elements dissipate the same energy as the fine contact. Both energies contain the factor.
    let (fine, elements) = (
        of(next, TableName::FrettingCycle, "dissipated_energy"),
        of(next, TableName::DynamicResponse, "friction_energy"),
    );
    assert!(
        (fine / elements - 1.0).abs() < 0.03,
        "{fine} and {elements}"
    );

    // The twin is a separate run.
    let twin = whole.join("grid_twin");
    let volume = |run: &Path| summary(run, latest(run), "wear_volume");
    let is_of_the_twin = |run: &Path| {
        let asked = 3.0 * (volume(&run.join("grid_twin")) / volume(run) - 1.0).abs();
        let error = summary(run, latest(run), "error_grid");
        assert!(
            (error - asked.max(0.015)).abs() < 1e-9,
            "{error} for {asked}"
        );
    };
    is_of_the_twin(&whole);
    let error = summary(&whole, end, "error_grid");
    let without = ["error_cycles", "error_harmonics", "error_closure"];
    let without: f64 = without
        .iter()
        .map(|column| summary(&whole, end, column))
        .sum();
    assert!(summary(&whole, end, "error_wear_volume") > error + without);

    // A restart gives the same bits after an interruption on half the grid and on the full grid.
    let part = || Start::new(scene.clone(), &parts);
    let (outcome, _) = part().stopped_after(2).done();
    assert_eq!(outcome.ending, Ending::Stopped);
    assert_eq!(outcome.wear_iteration, None);
    part().until(Stage::DynamicResponse).done();
    part().until(Stage::Summary).done();
    part().done();
    assert_same(&content(&parts), &content(&whole), "interrupted");

    // The twin continues with its run. A sibling cannot start from a twin.
    let farther = [
        &LAP[..],
        &["wear.cycles=1_100_000", "fidelity.grid_check=true"],
    ]
    .concat();
    let farther = bench.scene("resonator.toml", &farther);
    Start::new(farther.clone(), &parts).done();
    is_of_the_twin(&parts);
    let other = bench.path("other");
    let message = Start::new(farther, &other).from(&whole, 1).refused();
    assert!(
        message.contains("starts from the unworn scene"),
        "{message}"
    );
    assert!(!other.exists());
    let from = bench.scene("resonator.toml", &LAP);
    Start::new(from, &other).from(&twin, 1).refused();
}

#[test]
fn a_grid_without_a_half_is_refused() {
    let bench = Bench::new();
    let sets = ["fidelity.grid_check=true".to_owned()];
    let refused = scene::load(&bench.path("resonator.toml"), &sets);
    let message = refused.expect_err("no half").to_string();
    assert!(message.contains("45 x 36"), "{message}");
}
