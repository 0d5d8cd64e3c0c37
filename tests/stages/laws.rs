//! Relations between the tables of one run, for any kind of scene.

use std::path::Path;

use fretwear::grid::Grid;
use fretwear::tables::TableName;

use super::Start;
use crate::support::{Bench, SMALL, latest, summary, table, verified};

/// Rounding of sums over a few hundred cells in another order.
const ROUNDING: f64 = 1e-12;

const COEFFICIENT: f64 = 2e-15;
const FRICTION: f64 = 0.6;
const LOAD: f64 = 200.0;
/// Contact modulus E / (2 (1 − ν²)) of two equal bodies.
const CONTACT_MODULUS: f64 = 198.4e9 / (2.0 * (1.0 - 0.3 * 0.3));
/// Tolerance of the preset `balanced`.
const NORMAL_TOLERANCE: f64 = 1e-6;
const AREA: f64 = 4e-3 * 3e-3;

fn grid() -> Grid {
    Grid::over([4e-3, 3e-3], [26, 22])
}

/// Column of a field. In these scenes, the tables contain all cells.
fn field(root: &Path, k: u64, name: TableName, column: &str) -> Vec<f64> {
    let table = table(root, k, name);
    let (i, j) = (table.i32("i").expect("i"), table.i32("j").expect("j"));
    for c in 0..table.rows() {
        assert_eq!(grid().cell(c), (i[c] as usize, j[c] as usize));
    }
    assert_eq!(table.rows(), grid().len());
    table.f64(column).expect("a column").to_vec()
}

fn sum_over_area(field: &[f64]) -> f64 {
    field.iter().sum::<f64>() * grid().cell_area()
}

fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs(),
        "{what}: {found:e} instead of {expected:e}"
    );
}

fn run(bench: &Bench, sets: &[&str]) -> std::path::PathBuf {
    let root = bench.path("run");
    Start::new(bench.scene("small.toml", sets), &root).done();
    verified(&root);
    assert!(latest(&root) >= 3, "{} iterations", latest(&root));
    root
}

/// Checks relations of any run with wear.
fn check(root: &Path) {
    let last = latest(root);
    let unworn = summary(root, 0, "mean_height");
    assert_eq!(summary(root, 0, "n_cycles"), 0.0);
    assert_eq!(summary(root, 0, "wear_volume"), 0.0);
    let mut ever_slipped = vec![false; grid().len()];
    let mut before = vec![0.0; grid().len()];
    for k in 0..=last {
        let at = |what: &str| format!("{what} at iteration {k}");
        let worn = field(root, k, TableName::WearField, "wear_depth");
        let volume = summary(root, k, "wear_volume");
        let depth = sum_over_area(&worn);
        assert_close(depth, volume, ROUNDING, &at("volume of the wear field"));
        let spent = summary(root, k, "dissipated_energy_total");
        assert_close(
            COEFFICIENT * spent,
            volume,
            ROUNDING,
            &at("volume by energy"),
        );
        let drop = unworn - summary(root, k, "mean_height");
        // The heights have the size 1 µm. Their mean therefore has a rounding error even if the wear is small.
        assert!(
            (drop - volume / AREA).abs() <= ROUNDING * 1e-6,
            "{}",
            at("drop")
        );
        for c in 0..worn.len() {
            assert!(
                worn[c] >= before[c],
                "{} of cell {c}",
                at("wear depth shrinks")
            );
            if !ever_slipped[c] {
                assert_eq!(
                    worn[c],
                    0.0,
                    "{} of cell {c}, which never slipped",
                    at("wear")
                );
            }
        }

        let pressure = field(root, k, TableName::ContactField, "pressure");
        let slip = field(root, k, TableName::ContactField, "slip_path");
        let energy = field(root, k, TableName::ContactField, "dissipation");
        let gap = field(root, k, TableName::ContactField, "gap");
        let shear =
            ["shear_x", "shear_y"].map(|name| field(root, k, TableName::ContactField, name));
        // Displacement of a cell under the largest pressure, as a scale of violations of the contact conditions.
        let scale = pressure.iter().fold(0.0f64, |m, p| m.max(*p)) * grid().dx / CONTACT_MODULUS;
        let violation = 2.0 * NORMAL_TOLERANCE * scale;
        for c in 0..pressure.len() {
            assert!(pressure[c] >= 0.0 && slip[c] >= 0.0 && energy[c] >= 0.0);
            assert!(gap[c] >= -violation, "{}: {:e}", at("penetration"), gap[c]);
            assert!(
                pressure[c] == 0.0 || gap[c] <= violation,
                "{}: {:e}",
                at("a gap under pressure"),
                gap[c]
            );
            let traction = shear[0][c].hypot(shear[1][c]);
            assert!(
                traction <= FRICTION * pressure[c] * (1.0 + ROUNDING),
                "{} of cell {c}",
                at("shear beyond friction")
            );
            ever_slipped[c] |= slip[c] > 0.0;
        }
        assert_close(sum_over_area(&pressure), LOAD, 1e-9, &at("load"));
        let cycle = summary(root, k, "dissipated_energy");
        assert_close(
            sum_over_area(&energy),
            cycle,
            ROUNDING,
            &at("energy of a cycle"),
        );
        let rate = summary(root, k, "wear_rate");
        assert_close(rate, COEFFICIENT * cycle, ROUNDING, &at("wear rate"));
        if k > 0 {
            let cycles = summary(root, k - 1, "cycles") + summary(root, k, "n_cycles");
            assert_eq!(summary(root, k, "cycles"), cycles);
        }
        let step = table(root, k, TableName::WearStep);
        assert_eq!(
            step.i64("n_cycles").expect("a column")[0] as f64,
            summary(root, k, "n_cycles")
        );
        before = worn;
    }
    assert!(
        ever_slipped.iter().any(|slipped| !slipped),
        "some cells must not slip"
    );
    assert!(before.iter().any(|w| *w > 0.0), "the joint must wear");
}

#[test]
fn an_implicit_run_obeys_its_laws_and_lands_on_its_cycles() {
    let bench = Bench::new();
    let root = run(&bench, &["wear.cycles=234_567"]);
    check(&root);
    assert_eq!(summary(&root, latest(&root), "cycles"), 234_567.0);
}

#[test]
fn a_stepped_run_obeys_its_laws() {
    let bench = Bench::new();
    let sets = [
        "wear.cycles=200_000",
        "fidelity.cycle=stepped",
        "fidelity.steps_per_cycle=12",
    ];
    check(&run(&bench, &sets));
}

/// Check of the step rule [A eq. 2.7–2.8] with the tables of the run.
#[test]
fn an_explicit_run_makes_the_published_steps() {
    const DEPTH: f64 = 0.01e-6;
    const CYCLES: f64 = 123_457.0;
    let bench = Bench::new();
    let sets = [
        "wear.cycles=123_457",
        "wear.scheme=explicit",
        "wear.depth_step=\"0.01 um\"",
    ];
    let root = run(&bench, &sets);
    check(&root);
    let last = latest(&root);
    for k in 1..=last {
        let energy = field(&root, k - 1, TableName::ContactField, "dissipation");
        let deepest = COEFFICIENT * energy.iter().fold(0.0f64, |m, e| m.max(*e));
        // The last step ends at the last cycle of the run.
        let left = CYCLES - summary(&root, k - 1, "cycles");
        let cycles = (DEPTH / deepest).floor().min(left);
        assert!(cycles > 1.0);
        assert_eq!(summary(&root, k, "n_cycles"), cycles, "iteration {k}");
        let before = field(&root, k - 1, TableName::WearField, "wear_depth");
        let worn = field(&root, k, TableName::WearField, "wear_depth");
        for c in 0..worn.len() {
            let expected = before[c] + cycles * COEFFICIENT * energy[c];
            assert!(
                (worn[c] - expected).abs() <= ROUNDING * expected,
                "cell {c} of {k}"
            );
        }
        let total = summary(&root, k, "cycles");
        assert_eq!(
            total == CYCLES,
            k == last,
            "{total} cycles at iteration {k}"
        );
    }
}

#[test]
fn a_step_of_less_than_a_cycle_is_one_cycle() {
    let bench = Bench::new();
    let sets = [
        "wear.cycles=3",
        "wear.scheme=explicit",
        "wear.depth_step=\"1e-9 um\"",
    ];
    let root = run(&bench, &sets);
    assert_eq!(latest(&root), 3);
    for k in 1..=3 {
        assert_eq!(summary(&root, k, "n_cycles"), 1.0);
    }
}

#[test]
fn a_run_stops_at_its_volume() {
    for scheme in [
        &["wear.scheme=implicit"][..],
        &["wear.scheme=explicit", "wear.depth_step=\"0.02 um\""],
    ] {
        let bench = Bench::new();
        bench.write(
            "volume.toml",
            SMALL.replace("cycles = 600_000", "volume = \"5e-5 mm^3\""),
        );
        let root = bench.path("run");
        Start::new(bench.scene("volume.toml", scheme), &root).done();
        let last = latest(&root);
        assert!(last >= 2);
        let volume = |k| summary(&root, k, "wear_volume");
        assert!(
            volume(last) >= 5e-14 && volume(last - 1) < 5e-14,
            "{scheme:?}"
        );
        if scheme.len() == 1 {
            assert!(
                volume(last) < 1.1 * 5e-14,
                "{:e} is far beyond the volume",
                volume(last)
            );
        }
        check(&root);
    }
}

/// A joint that sticks completely does not wear. Its cycles take one step, and it never reaches a wear volume.
#[test]
fn a_joint_that_does_not_slip() {
    let bench = Bench::new();
    let root = bench.path("run");
    let still = [
        "motion.amplitude=\"1e-12 um\"",
        "contact.friction_coefficient=5.0",
    ];
    bench.write(
        "flat.toml",
        SMALL.replace("cycles = 600_000", "volume = \"1 mm^3\""),
    );
    let did = bench.fretwear(&[
        "run",
        "flat.toml",
        "--run",
        "v",
        "--set",
        still[0],
        "--set",
        still[1],
    ]);
    if summary(&bench.path("v"), 0, "dissipated_energy") == 0.0 {
        assert_eq!(did.code(), 3, "{}", did.stderr());
        assert!(
            did.stderr().contains("is never reached"),
            "{}",
            did.stderr()
        );
    }
    Start::new(bench.scene("small.toml", &still), &root).done();
    assert_eq!(summary(&root, latest(&root), "cycles"), 6e5);
}
