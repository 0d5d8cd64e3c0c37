#!/usr/bin/env python3
"""Plants faults in the source, one at a time, and shows that the test named for each fails with it and passes without it.

    python tests/faults/plant.py [--only NAME ...] [--folder FOLDER]
    python tests/faults/plant.py --search NAME [FILTER ...] [--folder FOLDER]
    python tests/faults/plant.py --list

faults.toml lists the faults. The sources of the checkout are copied to FOLDER (`planted` in cargo's target folder) and all faults are
planted there at once, each behind a switch: the environment variable FRETWEAR_PLANTED names the fault that is on. So the tests are built
once, with the dependencies of the checkout. A second start builds only what has changed.

Each test runs with the switch off, then on. Printed are area, fault, test, verdict, and the seconds of the test with the switch off. Exit
code 1 if a fault is not found, or if a test fails without one.

`--only` takes a few faults. `--search` runs the whole suite with one fault, or the tests whose names contain a filter, and lists the tests
that find it. `--list` prints the faults and checks that their lines are still there, without a build.

Tests that read the sources themselves (imports.rs, manifest.rs) say nothing here. The program in the target folder is the planted one
afterwards. With the switch off it does what the real one does, and the next `cargo build` of the checkout replaces it.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import time
import tomllib
from collections import namedtuple
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SWITCH = "FRETWEAR_PLANTED"
# A single test that takes longer hangs [s].
LONGEST = 600.0
# Sources of the program, which know the library by its name.
PROGRAM = ("src/cli/", "src/progress/", "src/terminal.rs", "src/main.rs")
MODULE = "src/planted.rs"
MODULE_TEXT = """//! Which of the planted faults is on. Written by tests/faults/plant.py.

use std::sync::LazyLock;

const NAMES: [&str; %d] = [%s];

static ON: LazyLock<Option<usize>> = LazyLock::new(|| {
    let name = std::env::var("%s").ok()?;
    let number = NAMES.iter().position(|known| *known == name);
    Some(number.unwrap_or_else(|| panic!("no fault is called {name}")))
});

/// Whether the fault of this number is on.
#[inline]
pub fn is(number: usize) -> bool {
    *ON == Some(number)
}
"""

Fault = namedtuple("Fault", "name area file line right wrong test finds")
# What tests printed, how many passed and failed, and their seconds.
Did = namedtuple("Did", "text passed failed seconds")


def read_faults():
    tables = tomllib.loads((Path(__file__).parent / "faults.toml").read_text(encoding="utf-8"))["fault"]
    faults = [Fault(**table) for table in tables]
    if len({fault.name for fault in faults}) < len(faults):
        sys.exit("two faults have the same name")
    return faults


def sources():
    """The files of the checkout as they are, with uncommitted changes."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    return {name: (ROOT / name).read_bytes() for name in names if name and (ROOT / name).is_file()}


def planted(files, faults):
    """The files with all faults behind their switch; exits with every fault that has lost its line."""
    files, lost = dict(files), []
    for number, fault in enumerate(faults):
        lines = files.get(fault.file, b"").decode().split("\n")
        places = [k for k, line in enumerate(lines) if line.strip() == fault.line]
        if len(places) != 1:
            lost.append(f"{fault.name}: {fault.file} has this line {len(places)} times, not once: {fault.line}")
        elif fault.line.count(fault.right) != 1:
            lost.append(f"{fault.name}: the line has `{fault.right}` {fault.line.count(fault.right)} times, not once: {fault.line}")
        else:
            module = "fretwear" if fault.file.startswith(PROGRAM) else "crate"
            switch = f"(if {module}::planted::is({number}) {{ {fault.wrong} }} else {{ {fault.right} }})"
            lines[places[0]] = lines[places[0]].replace(fault.right, switch)
            files[fault.file] = "\n".join(lines).encode()
    if lost:
        sys.exit("\n".join(lost))
    names = ", ".join(f'"{fault.name}"' for fault in faults)
    files[MODULE] = (MODULE_TEXT % (len(faults), names, SWITCH)).encode()
    files["src/lib.rs"] = b"#![allow(unused_parens)]\n" + files["src/lib.rs"] + b"#[doc(hidden)]\npub mod planted;\n"
    # Under its own name cargo would take what it built of one for the other.
    for name in ("Cargo.toml", "Cargo.lock"):
        files[name] = files[name].replace(b'name = "fretwear"\n', b'name = "planted"\n', 1)
    files["Cargo.toml"] = files["Cargo.toml"].replace(b"[lib]\n", b'[lib]\nname = "fretwear"\n')
    return files


def write(folder, files):
    """Writes the files that differ from those in the folder: cargo goes by their times."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / MODULE).is_file():
        sys.exit(f"{folder} holds something else: give an empty folder")
    for path in folder.rglob("*"):
        if path.is_file() and path.relative_to(folder).as_posix() not in files:
            path.unlink()
    for name, content in files.items():
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


def build(folder, target):
    """The names of all tests, each with the executable that has it."""
    command = ["cargo", "test", "--release", "--no-run", "--message-format=json-render-diagnostics"]
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    done = subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit("the planted sources do not compile")
    messages = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    tests = {}
    for executable in [m["executable"] for m in messages if m.get("executable") and m["profile"]["test"]]:
        listed = start(executable, folder, ["--list", "--format=terse"]).text.splitlines()
        tests |= {line.removesuffix(": test"): executable for line in listed if line.endswith(": test")}
    return tests


def start(executable, folder, arguments, fault=None):
    """Runs tests as cargo does, with a fault on or with none."""
    config = tomllib.loads((folder / ".cargo/config.toml").read_text(encoding="utf-8"))
    environment = {name: value for name, value in os.environ.items() if name != SWITCH} | config["env"]
    if fault:
        environment[SWITCH] = fault.name
    limit = LONGEST if "--exact" in arguments else None
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    begun = time.monotonic()
    try:
        done = subprocess.run([executable, *arguments], cwd=folder, env=environment, timeout=limit, **pipes)
        text, ended_well = done.stdout.decode(errors="replace"), done.returncode == 0
    except subprocess.TimeoutExpired:
        text, ended_well = "", False
    counts = re.search(r"^test result: .* (\d+) passed; (\d+) failed", text, re.MULTILINE)
    # A test that ends its process, or never ends, has failed.
    passed, failed = map(int, counts.groups()) if counts else (0, int(not ended_well))
    return Did(text, passed, failed, time.monotonic() - begun)


def judge(tests, folder, fault):
    """The verdict of the test of a fault, and the seconds of the test without the fault."""
    if fault.test not in tests:
        sys.exit(f"{fault.name}: there is no test {fault.test}")
    off, on = (start(tests[fault.test], folder, ["--exact", fault.test], switched) for switched in (None, fault))
    if off.passed + off.failed == 0:
        sys.exit(f"{fault.name}: the test {fault.test} is ignored")
    if off.failed:
        return "test fails without a fault", off.seconds
    return ("found" if on.failed else "NOT FOUND"), off.seconds


def search(tests, folder, fault, filters):
    """Prints the tests that fail with a fault and pass without it."""
    found = 0
    for executable in dict.fromkeys(tests.values()):
        did = start(executable, folder, filters, fault)
        if did.failed and "test result:" not in did.text:
            print(f"the fault ends {executable} early:\n{did.text[-2000:]}")
        for test in re.findall(r"^test (\S+).* \.\.\. FAILED$", did.text, re.MULTILINE):
            alone = start(executable, folder, ["--exact", test])
            found += alone.passed
            print(f"{alone.seconds:7.1f} s  {test}{'' if alone.passed else ', which fails without the fault too'}", flush=True)
    print(f"{found} tests find {fault.name}")
    return 0 if found else 1


def row(fault, *columns):
    return f"{fault.area:10s} {fault.name:32s} {fault.test:92s} " + " ".join(columns)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="a few of the faults")
    parser.add_argument("--search", nargs="+", metavar=("NAME", "FILTER"), help="which tests find this fault?")
    parser.add_argument("--list", action="store_true", help="check that the lines are there, without a build")
    parser.add_argument("--folder", type=Path, help="where the planted sources go")
    arguments = parser.parse_args()
    faults = read_faults()
    wanted = arguments.only or (arguments.search or [])[:1]
    if unknown := set(wanted) - {fault.name for fault in faults}:
        sys.exit(f"no fault is called {', '.join(sorted(unknown))}")
    chosen = [fault for fault in faults if not wanted or fault.name in wanted]
    files = planted(sources(), faults)
    if arguments.list:
        print("\n".join(row(fault, fault.finds) for fault in chosen))
        return 0
    target = Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target").resolve()
    folder = (arguments.folder or target / "planted").resolve()
    write(folder, files)
    tests = build(folder, target)
    if arguments.search:
        return search(tests, folder, chosen[0], arguments.search[1:])
    begun, missed = time.monotonic(), 0
    for fault in chosen:
        verdict, seconds = judge(tests, folder, fault)
        missed += verdict != "found"
        print(row(fault, f"{seconds:6.1f} s  {verdict}"), flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} faults found, {time.monotonic() - begun:.0f} s beside the build")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
