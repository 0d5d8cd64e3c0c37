//! Relations between energies and amplitudes of a run with vibration.

use std::f64::consts::PI;
use std::path::Path;

use fretwear::tables::{Table, TableName};

use super::Start;
use super::alone::found;
use crate::support::{Bench, OSCILLATOR, SLIDER, latest, reader, summary, table, verified};

const FORCE: f64 = 300.0;
const COEFFICIENT: f64 = 2e5 * 1e-18;
/// Relative error of the energy balance of a converged solution.
const BALANCE: f64 = 1e-6;

fn number(table: &Table, column: &str) -> f64 {
    table.f64(column).expect("a column")[0]
}

/// Checks the rows of a forced response. The force acts at the response point.
fn check_frf(root: &Path, k: u64, force: f64) {
    let frf = table(root, k, TableName::Frf);
    let of = |column| found(&frf, column);
    let (input, friction, viscous) = (
        of("input_energy"),
        of("friction_energy"),
        of("viscous_energy"),
    );
    let most = input.iter().fold(0.0f64, |m, e| m.max(e.abs()));
    assert!(most > 0.0);
    for row in 0..frf.rows() {
        assert_eq!(frf.f64("force").expect("a column")[row], force);
        let left = input[row] - friction[row] - viscous[row];
        assert!(
            left.abs() <= BALANCE * most,
            "{left:e} J of {most:e} J at row {row} of {k}"
        );
        // Work of the force on the first harmonic. The force does no work on other harmonics.
        let work = PI * force * of("amplitude")[row] * of("phase_lag")[row].sin();
        assert!(
            (work - input[row]).abs() <= 1e-9 * most,
            "{work:e} J at row {row}"
        );
    }
}

#[test]
fn energies_of_a_resonator_that_wears() {
    let bench = Bench::new();
    let root = bench.path("a");
    let sets = ["wear.cycles=200_000", "dynamics.points=5"];
    Start::new(bench.scene("resonator.toml", &sets), &root).done();
    verified(&root);
    for k in 0..=latest(&root) {
        let response = table(&root, k, TableName::DynamicResponse);
        assert!(
            number(&response, "error_energy") <= BALANCE,
            "iteration {k}"
        );
        let input = number(&response, "input_energy");
        let spent = number(&response, "friction_energy") + number(&response, "viscous_energy");
        assert!((input - spent).abs() <= BALANCE * input, "iteration {k}");
        // At the phase resonance, the displacement lags behind the force by 90°.
        let work = PI * FORCE * number(&response, "resonance_amplitude");
        assert!((work / input - 1.0).abs() <= 1e-9, "iteration {k}");
        let counts = ["sticking_elements", "slipping_elements", "open_elements"];
        let counts = counts.map(|column| response.i64(column).expect("a count")[0]);
        assert_eq!(counts.iter().sum::<i64>(), 60);
        assert!(counts[0] > 0 && counts[1] > 0, "{counts:?}");
        let elements = table(&root, k, TableName::ContactElement);
        let states = elements.text("state").expect("a state");
        for (state, count) in ["stick", "slip", "open"].iter().zip(counts) {
            let found = states.iter().filter(|s| s == state).count();
            assert_eq!(found as i64, count, "{state} of {k}");
        }
        // The summary repeats values of the response.
        for column in ["resonance_frequency", "peak_frequency", "peak_amplitude"] {
            assert_eq!(summary(&root, k, column), number(&response, column));
        }
        // The peak is at least as high as the resonance.
        let (peak, resonance) = (
            number(&response, "peak_amplitude"),
            number(&response, "resonance_amplitude"),
        );
        assert!(
            peak >= resonance * (1.0 - 1e-9),
            "{peak:e} below {resonance:e}"
        );
        // Work of the joint's forces over its cycle, from the table that drives the fine contact. Its sign equals the sign of the friction
        // energy.
        // Differences between the elements change the amount.
        let cycle = table(&root, k, TableName::JointCycle);
        let of = |column: &str| cycle.f64(column).expect("a column");
        let n = cycle.rows();
        let work: f64 = (0..n)
            .map(|a| {
                let b = (a + 1) % n;
                let along =
                    |force, by| 0.5 * (of(force)[a] + of(force)[b]) * (of(by)[b] - of(by)[a]);
                along("force_x", "displacement_x") + along("force_y", "displacement_y")
            })
            .sum();
        let friction = number(&response, "friction_energy");
        assert!(
            work.signum() == friction.signum(),
            "{work:e} J against {friction:e} J"
        );

        // The friction energy of the fine contact determines the wear, as with a prescribed motion.
        let cell = (40e-3 / 45.0) * (36e-3 / 36.0);
        let fields = table(&root, k, TableName::ContactField);
        let fine: f64 = fields
            .f64("dissipation")
            .expect("energy")
            .iter()
            .sum::<f64>()
            * cell;
        let cycle_energy = summary(&root, k, "dissipated_energy");
        assert!((fine / cycle_energy - 1.0).abs() < 1e-12, "iteration {k}");
        let rate = summary(&root, k, "wear_rate");
        assert!((rate / (COEFFICIENT * cycle_energy) - 1.0).abs() < 1e-12);
        let field = table(&root, k, TableName::WearField);
        let worn: f64 = field.f64("wear_depth").expect("depth").iter().sum::<f64>() * cell;
        let volume = summary(&root, k, "wear_volume");
        assert!((worn - volume).abs() <= 1e-12 * volume, "iteration {k}");
        let total = summary(&root, k, "dissipated_energy_total");
        assert!(
            (volume - COEFFICIENT * total).abs() <= 1e-12 * volume,
            "iteration {k}"
        );
        // The ledger contains the energies of both sides.
        let ledger = table(&root, k, TableName::Ledger);
        let sides = |quantity: &str| {
            let names = ledger.text("quantity").expect("names");
            let row = names.iter().position(|name| name == quantity);
            let row = row.expect("a row");
            ["fine", "dynamic"].map(|side| ledger.f64(side).expect("a side")[row])
        };
        assert_eq!(sides("dissipated_energy [J]"), [cycle_energy, friction]);
        // Under a drive along x, the total force is the force along x, since the force along y is nearly zero.
        let along_x = [TableName::Cycle, TableName::JointCycle].map(|of| {
            let table = table(&root, k, of);
            let force = table.f64("force_x").expect("a force").to_vec();
            let [least, most] = [f64::min, f64::max].map(|f| force.iter().copied().fold(0.0, f));
            0.5 * (most - least)
        });
        for (total, along_x) in sides("total_force [N]").into_iter().zip(along_x) {
            assert!((total / along_x - 1.0).abs() < 1e-4 && total >= along_x);
        }

        let committed = reader(&root);
        let tables = &committed.commit_of(k).expect("committed").tables;
        if tables.contains_key("frf") {
            check_frf(&root, k, FORCE);
        }
    }
}

#[test]
fn energies_of_an_oscillator_that_slips() {
    let bench = Bench::new();
    bench.write("slider.toml", format!("{OSCILLATOR}{SLIDER}"));
    let root = bench.path("a");
    Start::new(bench.scene("slider.toml", &[]), &root).done();
    check_frf(&root, 0, 100.0);
}
