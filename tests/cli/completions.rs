//! Tests of the shell completions.

use crate::support::Bench;

#[test]
fn every_shell_has_its_completions() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = bench.done(&["completions", shell]).stdout();
        for word in ["fretwear", "max-wall", "compare", "reproduce"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let did = bench.fretwear(&["completions", "csh"]);
    assert_eq!(did.code(), 2);
    assert!(did.stderr().contains("powershell"), "{}", did.stderr());
}

/// Completion of `fretwear tr<TAB>` by bash.
#[test]
fn bash_completes_a_command() {
    let bench = Bench::new();
    let script = bench.done(&["completions", "bash"]).stdout();
    bench.write("completions.bash", &script);
    let ask = "source completions.bash; COMP_WORDS=(fretwear tr); COMP_CWORD=1; _fretwear fretwear tr fretwear; echo \"${COMPREPLY[@]}\"";
    let output = std::process::Command::new("bash")
        .current_dir(bench.path("."))
        .args(["-c", ask])
        .output();
    match output {
        Ok(output) => assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "trade"),
        // The test skips a machine without bash.
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::NotFound),
    }
}
