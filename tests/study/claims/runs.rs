//! Claims on small real runs.

use fretwear::report::RunTables;
use fretwear::study::claims::{Evidence, Finding, Verdict, evaluate};
use fretwear::tables::TableName;

use crate::support::{Bench, RESONATOR, SMALL, latest, summary, table};

fn open(bench: &Bench, run: &str) -> RunTables {
    RunTables::open(&bench.path(run)).unwrap_or_else(|error| panic!("{error}"))
}

fn finding<'a>(findings: &'a [Finding], claim: u32, run: &str) -> &'a Finding {
    let of_run =
        |finding: &&Finding| finding.claim == claim && finding.runs.iter().any(|name| name == run);
    findings
        .iter()
        .find(of_run)
        .unwrap_or_else(|| panic!("no claim {claim} on {run}"))
}

/// The bookkeeping of an explicit run is exact. The evidence agrees with the tables.
#[test]
fn an_explicit_run() {
    let bench = Bench::new();
    let scene = SMALL.replace(
        "tolerance = 1e-3",
        "scheme = \"explicit\"\ndepth_step = \"0.015 um\"",
    );
    bench.write("explicit.toml", scene);
    bench.done(&["run", "explicit.toml", "--run", "explicit"]);
    let run = open(&bench, "explicit");
    let evidence = Evidence::read(&run).expect("readable");
    let root = bench.path("explicit");
    assert!(evidence.done && !evidence.scene.vibrates);
    assert_eq!(evidence.scene.explicit, Some(0.015e-6));
    let steps = latest(&root) as usize;
    assert!(steps >= 20, "{steps}");
    assert_eq!(evidence.depth_rate.len(), steps + 1);
    let worn = evidence.worn.as_ref().expect("it wears");
    let field = table(&root, latest(&root), TableName::WearField);
    let deepest = field
        .f64("wear_depth")
        .expect("depths")
        .iter()
        .copied()
        .fold(0.0, f64::max);
    assert_eq!(worn.deepest, deepest);
    let volume = summary(&root, latest(&root), "wear_volume");
    assert!((worn.volume / volume - 1.0).abs() < 1e-12);
    let (_, findings) = evaluate(&[run]).expect("readable");
    for claim in [2, 3, 4, 10, 28, 44] {
        let found = finding(&findings, claim, "explicit");
        assert_eq!(found.verdict, Verdict::Holds, "{found:?}");
    }
    // The filtered heights of the unworn surface are less rough than the heights, but not smooth.
    let (bare, raw) = (
        evidence.formless["rq"][0],
        evidence.column("rq").expect("Rq")[0],
    );
    assert!(bare < raw && bare > 0.1 * raw, "{bare} of {raw}");
    // A run with a prescribed motion has no structure.
    let no_structure = findings
        .iter()
        .find(|f| f.claim == 45)
        .expect("every claim");
    assert_eq!(no_structure.verdict, Verdict::NotApplicable);
}

/// The scenes decide which runs belong together: two roughnesses, and one run with a pressure cap.
#[test]
#[ignore = "long: 15 seconds"]
fn vibrating_runs_of_one_study() {
    let bench = Bench::new().sharing();
    let capped = RESONATOR.replace(
        "normal_load = \"30 kN\"",
        "normal_load = \"30 kN\"\npressure_cap = \"150 MPa\"",
    );
    bench.write(
        "rough.toml",
        RESONATOR.replace("rq = \"2 um\"", "rq = \"4 um\""),
    );
    bench.write("capped.toml", capped);
    for scene in ["resonator", "rough", "capped"] {
        bench.done(&["run", &format!("{scene}.toml"), "--run", scene]);
    }
    let runs: Vec<RunTables> = ["capped", "rough", "resonator"]
        .map(|run| open(&bench, run))
        .into();
    let (all, findings) = evaluate(&runs).expect("readable");
    let whole = |claim: u32| {
        let found = findings.iter().find(|f| f.claim == claim && f.whole);
        found.unwrap_or_else(|| panic!("no verdict on {claim}"))
    };
    assert!((1..=47).all(|claim| whole(claim).claim == claim));
    let areas = whole(17);
    assert_eq!(areas.runs, ["resonator", "rough"]);
    let pair = whole(40);
    assert_eq!(pair.runs, ["resonator", "capped"]);
    let evidence = &all[0];
    let pressure = summary(&bench.path("capped"), 0, "max_pressure");
    assert_eq!(
        evidence.ends("max_pressure").expect("pressures")[0],
        pressure
    );
    assert_eq!(pair.verdict, Verdict::Holds, "{pair:?}");
    for claim in [4, 10, 24, 44, 45] {
        assert_eq!(whole(claim).verdict, Verdict::Holds, "{:?}", whole(claim));
    }
    // The runs store no curves.
    assert!(whole(36).cause.contains("curves_every"), "{:?}", whole(36));
    assert_ne!(whole(36).verdict, Verdict::Holds);
    assert!(whole(45).runs.len() == 2);
    let parts = findings.iter().filter(|f| f.claim == 45 && !f.whole);
    assert!(parts.into_iter().all(|f| f.measured.contains("16 modes")));
    assert!(whole(29).measured.contains(" cycles"), "{:?}", whole(29));
}

/// A run that is still in progress gets no verdict.
#[test]
fn a_run_that_is_not_finished() {
    let bench = Bench::new();
    bench.fretwear(&["run", "small.toml", "--run", "a", "--max-wall", "1 ms"]);
    let run = open(&bench, "a");
    assert!(!Evidence::read(&run).expect("readable").done);
    let (_, findings) = evaluate(&[run]).expect("readable");
    assert!(findings.iter().all(|f| f.verdict == Verdict::NotApplicable));
    assert!(
        findings[0].measured.ends_with("; not finished: a"),
        "{:?}",
        findings[0]
    );
}
