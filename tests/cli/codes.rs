//! Tests of exit codes, and of messages that name the key or file, its value and the expected value.

use crate::support::{Bench, SMALL};

const USAGE: i32 = 2;
const NOT_CONVERGED: i32 = 3;
const DAMAGED: i32 = 4;

/// Runs a command, and checks the exit code and that the error message contains all `parts`.
fn fails(bench: &Bench, arguments: &[&str], code: i32, parts: &[&str]) {
    let did = bench.fretwear(arguments);
    let said = did.stderr();
    assert_eq!(did.code(), code, "{arguments:?}: {said}");
    assert_eq!(did.stdout(), "", "{arguments:?} printed a result");
    assert!(said.contains("error: "), "{arguments:?}: {said}");
    for part in parts {
        assert!(
            said.contains(part),
            "{arguments:?}: {part:?} is missing in {said}"
        );
    }
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn usage() {
    let bench = Bench::new();
    fails(&bench, &["frobnicate"], USAGE, &["frobnicate"]);
    fails(&bench, &["run"], USAGE, &["SCENE"]);
    fails(&bench, &["run", "small.toml", "--frob"], USAGE, &["--frob"]);
    fails(
        &bench,
        &["schema", "nope"],
        USAGE,
        &["nope: there is no such key", "no table has that name"],
    );
    fails(
        &bench,
        &["schema", "--json-schema"],
        USAGE,
        &["fretwear schema scene --json-schema"],
    );
    fails(
        &bench,
        &["schema", "contact.nomal_load"],
        USAGE,
        &["contact.nomal_load: there is no such key; did you mean contact.normal_load?"],
    );
    fails(
        &bench,
        &["run", "small.toml", "--until", "polish"],
        USAGE,
        &["\"polish\" is not a stage", "static_contact"],
    );
    fails(
        &bench,
        &["run", "--from", "a@x"],
        USAGE,
        &["\"x\" is not an iteration", "RUN@N"],
    );
    fails(&bench, &["run", "--from", "a"], USAGE, &["RUN@N"]);
    for (time, said) in [
        ("3", "\"3\" has no unit"),
        ("3 m", "is a length"),
        ("-1 s", "longer than 0 s"),
        ("0 h", "longer than 0 s"),
    ] {
        let limit = format!("--max-wall={time}");
        fails(&bench, &["run", "small.toml", &limit], USAGE, &[said]);
    }
    assert!(
        !bench.path("runs").exists(),
        "a wrong command created a folder"
    );
}

#[test]
fn scenes() {
    let bench = Bench::new();
    fails(
        &bench,
        &["run", "none.toml"],
        USAGE,
        &["none.toml", "cannot be read"],
    );
    fails(&bench, &["plan", "none.toml"], USAGE, &["none.toml"]);
    for (set, parts) in [
        (
            "contact.nomal_load=3",
            &["contact.nomal_load", "did you mean contact.normal_load"][..],
        ),
        (
            "contact.normal_load=\"3 um\"",
            &["contact.normal_load", "3 um", "N"],
        ),
        ("wear.tolerance=-1", &["wear.tolerance", "-1"]),
        (
            "contact.pressure_cap=\"1 Pa\"",
            &["contact.pressure_cap", "1 Pa", "16.6667 MPa"],
        ),
        (
            "motion.normal_load_amplitude=\"300 N\"",
            &[
                "motion.normal_load_amplitude",
                "300 N",
                "less than contact.normal_load",
            ],
        ),
        (
            "contact.moment=[\"1 N m\", \"0 N m\"]",
            &["contact.moment", "contact.rotation", "\"free\""],
        ),
        (
            "output.cycle_fields.i=[3, 26]",
            &["output.cycle_fields.i", "[3, 26]", "from 0 to 25"],
        ),
        (
            "output.cycle_fields.samples=[0, 3]",
            &[
                "`output.cycle_fields.samples` has 3",
                "0 to 2",
                "fidelity.cycle = \"stepped\"",
            ],
        ),
        ("wear.scheme=explicit", &["wear.depth_step"]),
        ("joint.hole.diameter=\"1 m\"", &["joint.hole.diameter"]),
    ] {
        for command in ["run", "plan"] {
            fails(&bench, &[command, "small.toml", "--set", set], USAGE, parts);
        }
    }
    fails(
        &bench,
        &[
            "plan",
            "small.toml",
            "--set",
            "fidelity.cycle=stepped",
            "--set",
            "output.cycle_fields.samples=[65]",
        ],
        USAGE,
        &[
            "`output.cycle_fields.samples` has 65",
            "0 to 64",
            "fidelity.steps_per_cycle",
        ],
    );
    fails(
        &bench,
        &[
            "plan",
            "resonator.toml",
            "--set",
            "output.cycle_fields.samples=[0, 32]",
        ],
        USAGE,
        &["output.cycle_fields.samples", "fidelity.cycle"],
    );
    let (still, _) = SMALL.split_once("[motion]").expect("a motion");
    bench.write(
        "still.toml",
        format!("{still}[output]\ncycle_fields = true\n"),
    );
    fails(
        &bench,
        &["plan", "still.toml"],
        USAGE,
        &["output.cycle_fields = true", "[motion]"],
    );
    let history = SMALL.replace("amplitude = \"1 um\"", "history = \"h.csv\"");
    bench.write("history.toml", history);
    fails(
        &bench,
        &["run", "history.toml"],
        USAGE,
        &["h.csv", "motion.history"],
    );
    for (csv, parts) in [
        ("time\n0\n", &["no column `displacement_x`"][..]),
        (
            "time,displacement_x\n0,1\n0.5,abc\n",
            &["row 2", "\"abc\"", "displacement_x"],
        ),
        (
            "time,displacement_x\n0,1\n0.5,2\n",
            &["2 rows", "at least 3"],
        ),
        (
            "time,displacement_x\n0,1\n0.7,2\n0.5,3\n",
            &["row 3", "0.5"],
        ),
        (
            "time,displacement_x\n0,1\n0.5,2\n0.7,0\n1,3\n",
            &["does not close", "displacement_x"],
        ),
    ] {
        bench.write("h.csv", csv);
        fails(
            &bench,
            &["plan", "history.toml"],
            USAGE,
            &[parts, &["h.csv"]].concat(),
        );
    }
    assert!(!bench.path("runs").exists(), "a wrong scene created a run");
}

#[test]
fn runs_that_are_not_there() {
    let bench = Bench::new();
    for command in ["status", "verify"] {
        fails(
            &bench,
            &[command, "none"],
            USAGE,
            &["there is no run at none"],
        );
    }
    fails(
        &bench,
        &["run", "--run", "none"],
        USAGE,
        &["there is no run at none"],
    );
    fails(
        &bench,
        &["run", "--from", "none@1"],
        USAGE,
        &["there is no run at none"],
    );
    fails(
        &bench,
        &["status", "small.toml"],
        USAGE,
        &["small.toml is a file, but a run is a folder"],
    );
    fails(
        &bench,
        &["status"],
        USAGE,
        &["there is no run at runs, and no folder of runs"],
    );
    std::fs::create_dir(bench.path("other")).expect("made");
    bench.write("other/letter.txt", "hello");
    fails(
        &bench,
        &["run", "small.toml", "--run", "other"],
        DAMAGED,
        &["other is not a run", "letter.txt", "another folder"],
    );
    bench.write("file", "hello");
    fails(
        &bench,
        &["run", "small.toml", "--run", "file"],
        1,
        &["file"],
    );
}

#[test]
fn not_converged() {
    let bench = Bench::new();
    let mut sets = vec!["run", "small.toml", "--run", "a"];
    sets.extend(["--set", "fidelity.normal_tolerance=1e-17"]);
    let parts = [
        "static_contact of iteration 0",
        "did not converge",
        "1.0e-17",
        "committed iterations in a are kept",
    ];
    fails(&bench, &sets, NOT_CONVERGED, &parts);
    // The run keeps the tables of the completed stages and continues with a larger tolerance.
    assert!(bench.path("a/once/surface.parquet").is_file());
    sets.pop();
    sets.extend([
        "fidelity.normal_tolerance=1e-6",
        "--until",
        "fretting_cycle",
    ]);
    bench.done(&sets);
    bench.done(&["verify", "a"]);
}

/// Help and version exit with code 0.
#[test]
fn help() {
    let bench = Bench::new();
    for arguments in [
        &["--help"][..],
        &["run", "--help"],
        &["--version"],
        &["plan", "--help"],
    ] {
        let did = bench.done(arguments);
        assert!(!did.stdout().is_empty());
        assert_eq!(did.stderr(), "");
    }
    let help = bench.done(&["--help"]).stdout();
    for code in [
        "0 done",
        "2 wrong usage",
        "3 not converged",
        "4 damaged",
        "75 stopped",
    ] {
        assert!(help.contains(code), "{help}");
    }
}

#[cfg(not(feature = "polars"))]
#[test]
fn a_program_without_polars_names_the_commands_that_it_lacks() {
    let bench = Bench::new();
    let lacking: [&[&str]; 5] = [
        &["compare", "runs/a", "--all"],
        &["report", "runs/a", "-o", "page.html"],
        &["reproduce", "--jobs", "1"],
        &["campaign", "report", "--dir", "c"],
        &["backbone", "scene.toml", "--svg", "b.svg"],
    ];
    let named = ["`compare`", "`report`", "`reproduce`", "`campaign report`"];
    for arguments in lacking {
        fails(&bench, arguments, USAGE, &named);
    }
}
