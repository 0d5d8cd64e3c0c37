//! A shell accepts the command that continues a run.

use std::fs;
use std::process::Command;

use crate::support::{Bench, latest, verified};

/// Names with characters that a shell or the program could interpret.
const NAMES: [&str; 6] = [
    "it's $HOME; touch owned",
    "-x",
    "two  spaces",
    "a\"b`touch owned`\\",
    "~",
    "#* &",
];

#[cfg(unix)]
#[test]
fn the_command_to_go_on_can_be_pasted() {
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_fretwear"));
    let path = format!(
        "{}:{}",
        program.parent().expect("a folder").display(),
        std::env::var("PATH").unwrap_or_default()
    );
    for name in NAMES {
        let bench = Bench::new();
        let run = format!("--run={name}");
        let mut begin = vec!["run", "small.toml", &run, "--max-wall", "1 us"];
        begin.extend(["--set", "wear.cycles=150_000"]);
        let did = bench.fretwear(&begin);
        let said = did.stderr();
        assert_eq!(did.code(), 75, "{said}");
        let last = said.lines().last().expect("a last line");
        let command = last
            .strip_prefix("stopped; continue with: ")
            .expect("a command");
        let status = bench.done(&["status", "--json", "--", name]).json();
        assert_eq!(status["continue"], command);
        let words = bench.done(&["status", "--", name]).stdout();
        assert!(words.contains(&format!(" {command}\n")), "{words}");

        let output = Command::new("sh")
            .args(["-c", command])
            .current_dir(bench.path("."))
            .env("PATH", &path)
            .env("FRETWEAR_CACHE", "")
            .output()
            .expect("a shell");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {said}");
        let root = bench.path(name);
        assert!(latest(&root) > 0, "{command}");
        verified(&root);
        let entries = fs::read_dir(bench.path(".")).expect("a folder");
        assert_eq!(entries.count(), 3, "{command} created another file");
    }
}

/// The report of an interrupted run contains the same command.
#[cfg(feature = "polars")]
#[test]
fn the_page_of_a_run_has_the_same_command() {
    let bench = Bench::new();
    let begin = ["run", "small.toml", "--run=-x y", "--max-wall", "1 us"];
    assert_eq!(bench.fretwear(&begin).code(), 75);
    bench.done(&["report", "--output", "page.html", "--", "-x y"]);
    let page = fs::read_to_string(bench.path("page.html")).expect("a page");
    let command = "(continue it with `fretwear run --run './-x y'`)";
    assert!(page.contains(command), "{page}");
}
