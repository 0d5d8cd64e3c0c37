//! Tests of `output.cycle_fields`: written cells and samples, and independence of all other tables.

use std::collections::BTreeSet;
use std::path::Path;

use fretwear::stages::Stage;
use fretwear::tables::{TableName, TypedTable, typed};

use super::Start;
use crate::support::{Bench, latest, reader, table, verified};

/// Small scene with fewer cycles, and with stepped cycles.
const SMALL: [&str; 3] = [
    "wear.cycles=60_000",
    "fidelity.cycle=stepped",
    "fidelity.steps_per_cycle=8",
];

fn fields(root: &Path, wear_iteration: u64) -> typed::CycleField {
    let table = table(root, wear_iteration, TableName::CycleField);
    typed::CycleField::of(&table).expect("its columns")
}

fn has_fields(root: &Path, wear_iteration: u64) -> bool {
    let reader = reader(root);
    let commit = reader.commit_of(wear_iteration).expect("a commit");
    commit.table("cycle_field").is_some()
}

fn run(bench: &Bench, file: &str, name: &str, sets: &[&str]) -> std::path::PathBuf {
    let root = bench.path(name);
    Start::new(bench.scene(file, sets), &root).done();
    root
}

#[test]
fn chosen_samples_and_cells_in_every_so_many_iterations() {
    let bench = Bench::new();
    let longer = ["wear.cycles=300_000"];
    let all = run(
        &bench,
        "small.toml",
        "all",
        &[&SMALL[..], &longer, &["output.cycle_fields=true"]].concat(),
    );
    let chosen = "output.cycle_fields={ samples = [2, 0], i = [3, 17], j = [9, 9], every = 2 }";
    let some = run(
        &bench,
        "small.toml",
        "some",
        &[&SMALL[..], &longer, &[chosen]].concat(),
    );
    let last = latest(&all);
    assert!(last >= 3 && last == latest(&some));
    for k in 0..=last {
        let whole = fields(&all, k);
        let cycle = typed::Cycle::of(&table(&all, k, TableName::Cycle)).expect("its columns");
        let samples: BTreeSet<i32> = whole.sample.iter().copied().collect();
        assert_eq!(samples, (0..cycle.time.len() as i32).collect());
        // Under constant load, the pressures equal those of the static contact. The table has one row per cell in contact.
        let contact = typed::ContactField::of(&table(&all, k, TableName::ContactField));
        let contact = contact.expect("its columns");
        let in_contact = contact.pressure.iter().filter(|p| **p > 0.0);
        assert_eq!(
            whole.pressure.len(),
            cycle.time.len() * in_contact.clone().count()
        );
        assert!(
            whole
                .pressure
                .iter()
                .zip(in_contact.cycle())
                .all(|(a, b)| a == b)
        );
        assert!(whole.gap.is_none() && whole.shear_y.is_some());
        for (row, sample) in whole.sample.iter().enumerate() {
            assert_eq!(whole.time[row], cycle.time[*sample as usize]);
        }
        assert_eq!(has_fields(&some, k), k % 2 == 0 || k == last, "{k}");
        if !has_fields(&some, k) {
            continue;
        }
        let part = fields(&some, k);
        let is_chosen = |row: &usize| {
            let (i, j) = (whole.i[*row], whole.j[*row]);
            [0, 2].contains(&whole.sample[*row]) && (3..=17).contains(&i) && j == 9
        };
        let rows: Vec<usize> = (0..whole.sample.len()).filter(is_chosen).collect();
        let pick = |values: &[f64]| -> Vec<f64> { rows.iter().map(|row| values[*row]).collect() };
        assert!(rows.len() > 4);
        assert_eq!(part.pressure, pick(&whole.pressure));
        assert_eq!(part.shear_x, pick(&whole.shear_x));
        assert_eq!(part.slip_x, pick(&whole.slip_x));
        assert_eq!(part.slip_y, whole.slip_y.as_deref().map(pick));
    }
    verified(&some);
}

/// The output of cycle fields changes no other table. Without the output, the keys of the stages do not contain it.
#[test]
fn nothing_else_hangs_on_them() {
    let bench = Bench::new();
    for (file, sets) in [
        ("small.toml", &SMALL[..]),
        ("small.toml", &["wear.cycles=60_000"]),
        (
            "resonator.toml",
            &[
                "wear.cycles=60_000",
                "fidelity.cycle=stepped",
                "fidelity.steps_per_cycle=8",
            ],
        ),
    ] {
        let without = run(&bench, file, "without", sets);
        let with = run(
            &bench,
            file,
            "with",
            &[sets, &["output.cycle_fields.every=2"]].concat(),
        );
        assert_eq!(latest(&with), latest(&without));
        for k in 0..=latest(&with) {
            for name in [
                TableName::ContactField,
                TableName::Cycle,
                TableName::WearField,
            ] {
                if k > 0 || name != TableName::WearField {
                    assert_eq!(
                        table(&with, k, name),
                        table(&without, k, name),
                        "{k} {name}"
                    );
                }
            }
            assert!(!has_fields(&without, k));
        }
        for root in [with, without] {
            std::fs::remove_dir_all(root).expect("removed");
        }
    }
}

#[test]
fn a_run_that_is_stopped_behind_them_goes_on_to_the_same() {
    let bench = Bench::new();
    let sets = [&SMALL[..], &["output.cycle_fields={ samples = [0, 3] }"]].concat();
    let whole = run(&bench, "small.toml", "whole", &sets);
    let root = bench.path("stopped");
    let start = || Start::new(bench.scene("small.toml", &sets), &root);
    start().until(Stage::FrettingCycle).done();
    let (_, seen) = start().done();
    // The second start uses the stored cycle of the draft.
    assert!(!seen.stages.borrow().contains(&(Stage::FrettingCycle, 0)));
    for k in 0..=latest(&whole) {
        assert_eq!(fields(&root, k), fields(&whole, k), "{k}");
    }
    verified(&root);
}

/// The load of this joint varies. Cells open within the cycle and then have a gap.
#[test]
fn a_load_that_varies_has_gaps() {
    let bench = Bench::new();
    let sets = [
        "wear.cycles=60_000",
        "fidelity.steps_per_cycle=8",
        "motion.normal_load_amplitude=100 N",
        "output.cycle_fields=true",
    ];
    let root = run(&bench, "small.toml", "run", &sets);
    let of = fields(&root, 0);
    let gap = of.gap.expect("a gap");
    let open = of.pressure.iter().zip(&gap).filter(|(p, _)| **p == 0.0);
    assert!(open.clone().count() > 10 && open.clone().all(|(_, gap)| *gap >= 0.0));
}
