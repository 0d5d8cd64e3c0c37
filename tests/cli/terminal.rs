//! Tests of a closed or full stdout and stderr, and of control characters in foreign texts.

use std::fs;
use std::process::Stdio;

use crate::support::{Bench, Did, OSCILLATOR, SMALL, flip};

/// A full disk.
#[cfg(target_os = "linux")]
fn full() -> Stdio {
    let file = fs::File::options().write(true).open("/dev/full");
    file.expect("a full disk").into()
}

/// A pipe whose reader is closed.
#[cfg(target_os = "linux")]
fn unread() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

/// A folder with the input of the commands: a finished, a damaged and an interrupted run.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("tiny.toml", SMALL.replace("600_000", "100_000"));
    bench.write("mass.toml", OSCILLATOR);
    bench.done(&["run", "tiny.toml", "--run", "done"]);
    bench.done(&["run", "tiny.toml", "--run", "damaged"]);
    flip(&bench.path("damaged/iterations/wear_iteration=1/cycle.parquet"));
    let limited = ["run", "tiny.toml", "--run", "stopped", "--max-wall", "1 us"];
    assert_eq!(bench.fretwear(&limited).code(), 75);
    bench
}

/// Every command with its exit code.
fn commands() -> Vec<(Vec<&'static str>, i32)> {
    let mut commands = vec![
        (vec!["run", "tiny.toml", "--run", "done"], 0),
        (vec!["run", "tiny.toml", "--run", "done", "--json"], 0),
        (vec!["run", "tiny.toml", "--until", "surface"], 0),
        (vec!["plan", "tiny.toml"], 0),
        (vec!["plan", "tiny.toml", "--json"], 0),
        (vec!["status", "done"], 0),
        (vec!["status", "done", "--json"], 0),
        (vec!["status", "damaged"], 4),
        (vec!["verify", "done"], 0),
        (vec!["verify", "damaged"], 4),
        (vec!["schema"], 0),
        (vec!["schema", "--markdown"], 0),
        (vec!["schema", "--json"], 0),
        (vec!["schema", "scene"], 0),
        (vec!["schema", "scene", "--json-schema"], 0),
        (vec!["schema", "contact"], 0),
        (vec!["schema", "contact.kn", "--json"], 0),
        (vec!["completions", "bash"], 0),
        (vec!["completions", "zsh"], 0),
        (vec!["doctor", "new"], 0),
        (vec!["doctor", "new", "--json"], 0),
        (vec!["backbone", "mass.toml"], 0),
        (vec!["backbone", "mass.toml", "--json"], 0),
        (vec!["trade", "tiny.toml", "--knob", "cycle"], 0),
        (vec!["trade", "tiny.toml", "--knob", "cycle", "--json"], 0),
        (vec!["export", "-o", "a.inp", "--frequencies"], 0),
        (vec!["--help"], 0),
        (vec!["--version"], 0),
    ];
    if cfg!(feature = "polars") {
        commands.extend([
            (vec!["compare", "done"], 0),
            (vec!["compare", "done", "damaged"], 4),
            (vec!["report", "done"], 0),
            (vec!["report", "damaged"], 4),
        ]);
    }
    commands
}

/// Command that continues the run by one iteration.
const STOPPED: [&str; 7] = [
    "run",
    "--run",
    "stopped",
    "--set",
    "wear.cycles=6e6",
    "--max-wall",
    "1 us",
];

#[cfg(target_os = "linux")]
#[test]
fn a_result_that_cannot_be_printed() {
    let bench = bench();
    for (arguments, code) in commands() {
        let heard = Did(bench
            .command(&arguments)
            .stdout(full())
            .output()
            .expect("the program runs"));
        let said = heard.stderr();
        // The exit code of a failed run takes precedence over the code for an output error.
        let expected = if code == 0 { 1 } else { code };
        assert_eq!(heard.code(), expected, "{arguments:?}: {said}");
        assert!(
            said.contains("error: cannot write the result: "),
            "{arguments:?}: {said}"
        );
        assert!(!said.contains("panicked"), "{arguments:?}: {said}");

        // The test skips these commands because of their computing time.
        if ["trade", "doctor", "export"].contains(&arguments[0]) {
            continue;
        }
        let mut unheard = bench.command(&arguments);
        let unheard = unheard.stdout(unread()).output();
        let unheard = Did(unheard.expect("the program runs"));
        let said = unheard.stderr();
        assert_eq!(unheard.code(), code, "{arguments:?}: {said}");
        assert!(!said.contains("cannot write"), "{arguments:?}: {said}");
    }
    let stopped = bench.command(&STOPPED).stdout(full()).output();
    let stopped = Did(stopped.expect("the program runs"));
    assert_eq!(stopped.code(), 75);
    let said = stopped.stderr();
    assert!(said.contains("error: cannot write the result: "), "{said}");
    assert!(said.contains("fretwear run --run stopped\n"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_log_that_cannot_be_written() {
    let bench = bench();
    // The commands include commands with progress messages and commands that end with an error.
    let mut commands = commands();
    commands.retain(|(arguments, code)| arguments[0] == "run" || *code != 0);
    let not_converged = ["fidelity.cycle=stepped", "fidelity.normal_tolerance=1e-17"];
    let [stepped, tolerance] = not_converged;
    commands.extend([
        (vec!["run", "none.toml"], 2),
        (vec!["frobnicate"], 2),
        (
            vec![
                "run",
                "tiny.toml",
                "--run",
                "b",
                "--set",
                stepped,
                "--set",
                tolerance,
            ],
            3,
        ),
        (
            vec!["trade", "tiny.toml", "--dir", "t", "--max-wall", "1 us"],
            75,
        ),
        (vec!["run", "tiny.toml", "--run", "c"], 0),
    ]);
    for (arguments, code) in commands {
        let did = bench.command(&arguments).stderr(full()).output();
        let did = Did(did.expect("the program runs"));
        assert_eq!(did.code(), code, "{arguments:?}");
    }
    // An interrupted run exits with code 75 even if stdout and stderr cannot be written.
    for nowhere in [full, unread] {
        let mut command = bench.command(&STOPPED);
        let status = command.stdout(nowhere()).stderr(nowhere()).status();
        assert_eq!(status.expect("the program runs").code(), Some(75));
    }
}

/// Control characters that clear the screen, set the window title and reverse the text.
const HOSTILE: &str = "a\u{1b}[2J\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}b\u{2066}\u{7f}\r";
const SHOWN: &str = "a\\u{1b}[2J\\u{1b}]0;owned\\u{7}\\u{9b}2J\\u{202e}b\\u{2066}\\u{7f}\\u{d}";

fn obeyed(text: &str) -> Option<char> {
    text.chars().find(|c| {
        (c.is_control() && !['\n', '\t'].contains(c))
            || ('\u{202a}'..='\u{202e}').contains(c)
            || ('\u{2066}'..='\u{2069}').contains(c)
    })
}

#[cfg(unix)]
#[test]
fn nothing_in_the_texts_of_others_is_obeyed() {
    let bench = Bench::new();
    // JSON and TOML use the same escapes.
    let escaped: String = HOSTILE
        .chars()
        .map(|c| format!("\\u{:04x}", c as u32))
        .collect();
    let scene = SMALL
        .replace("Small", &escaped)
        .replace("600_000", "100_000");
    bench.write("hostile.toml", &scene);
    bench.write("key.toml", format!("{scene}\"{escaped}\" = 1\n"));
    bench.write("value.toml", scene.replace("1 um", &escaped));
    bench.write("broken.x3p", HOSTILE);
    let measured = format!("file = \"broken.x3p\"\nunit = \"{escaped}\"");
    bench.write("unit.toml", scene.replace("seed = 3", &measured));
    let mut commands = vec![
        (vec!["plan", "hostile.toml"], 0, true),
        (vec!["plan", "key.toml"], 2, true),
        (vec!["plan", "value.toml"], 2, true),
        (vec!["plan", "unit.toml"], 2, false),
        (vec!["plan", HOSTILE], 2, true),
        (vec!["run", "hostile.toml", "--run", HOSTILE], 0, true),
        (vec!["status", HOSTILE], 0, true),
        (vec!["verify", HOSTILE], 0, false),
        (vec!["run", "key.toml", "--run", HOSTILE], 2, true),
        (vec!["schema", HOSTILE], 2, true),
        (vec!["schema", HOSTILE], 2, true),
    ];
    if cfg!(feature = "polars") {
        commands.push((vec!["compare", HOSTILE], 0, true));
        commands.push((vec!["report", HOSTILE], 0, true));
    }
    for (arguments, code, named) in commands {
        // The terminal is so wide that the program does not wrap names.
        let did = bench.command(&arguments).env("COLUMNS", "400").output();
        let did = Did(did.expect("the program runs"));
        let said = did.stdout() + &did.stderr();
        assert_eq!(did.code(), code, "{arguments:?}: {said:?}");
        assert_eq!(obeyed(&said), None, "{arguments:?}: {said:?}");
        assert!(!named || said.contains(SHOWN), "{arguments:?}: {said}");
    }
    // The JSON object contains the unescaped name, but its text contains no control characters.
    let limited = ["run", "hostile.toml", "--run", HOSTILE, "--set"];
    let limited = [&limited[..], &["wear.cycles=6e6", "--max-wall", "1 us"]].concat();
    let did = bench.fretwear(&limited);
    assert_eq!((did.code(), obeyed(&did.stderr())), (75, None));
    let status = bench.done(&["status", "--json", HOSTILE]);
    assert_eq!(obeyed(&status.stdout()), None);
    let command = format!("fretwear run --run '{HOSTILE}'");
    assert_eq!(status.json()["continue"], command);
}
