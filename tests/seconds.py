#!/usr/bin/env python3
"""Measures the seconds of every test except doctests, and lists the slowest tests.

    python3 tests/seconds.py [--threads N] [--ignored] [--slowest N] [--table FILE] [--before FILE] [FILTER ...]

The script builds the tests like `cargo test --release`, runs all tests (or the tests with a FILTER in their names) and prints the slowest
tests, the sum of each module, and the total. `--ignored` also runs the ignored tests. `--table` writes a CSV file with the columns test,
seconds, result. `--before` reads such a table of another version and prints its seconds in a second column. Seconds are wall time while
other tests run. The exit code is 1 if a test fails.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import time
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def executables():
    """Builds the tests and returns their executables."""
    build = ["cargo", "test", "--release", "--no-run", "--message-format=json-render-diagnostics"]
    done = subprocess.run(build, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    messages = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    return [m["executable"] for m in messages if m.get("executable") and m["profile"]["test"]]


def run(executable, options):
    """Runs the tests of an executable; yields name, seconds and result of each. The test harness reports seconds only with an unstable
    option, which needs an environment variable. The build must not have this variable."""
    command = [executable, "-Z", "unstable-options", "--report-time", "--format", "json", *options]
    config = tomllib.loads((ROOT / ".cargo/config.toml").read_text(encoding="utf-8"))
    environment = {**os.environ, **config["env"], "RUSTC_BOOTSTRAP": "1"}
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True) as tests:
        for line in tests.stdout:
            # Some tests print other lines.
            event = json.loads(line) if line.startswith('{ "type"') or line.startswith('{"type"') else {}
            if event.get("type") == "test" and event["event"] in ("ok", "failed", "ignored"):
                yield event["name"], event.get("exec_time", 0.0), event["event"]
                if event["event"] == "failed":
                    print(f"{event['name']} failed:\n{event.get('stdout', '')}", file=sys.stderr)
    # Exit code 101 means failed tests.
    if tests.returncode not in (0, 101):
        sys.exit(f"{executable} ended with exit code {tests.returncode}")


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return {row["test"]: float(row["seconds"]) for row in csv.DictReader(file)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("filters", nargs="*", metavar="FILTER")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--ignored", action="store_true")
    parser.add_argument("--slowest", type=int, default=30)
    parser.add_argument("--table", type=Path)
    parser.add_argument("--before", type=Path)
    arguments = parser.parse_args()
    options = [f"--test-threads={arguments.threads}", *arguments.filters]
    if arguments.ignored:
        options.append("--include-ignored")

    programs = executables()
    begun = time.monotonic()
    tests = [test for program in programs for test in run(program, options)]
    whole = time.monotonic() - begun
    tests.sort(key=lambda test: -test[1])
    if arguments.table:
        with open(arguments.table, "w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["test", "seconds", "result"])
            rows.writerows((name, f"{seconds:.3f}", result) for name, seconds, result in tests)

    before = read(arguments.before) if arguments.before else {}
    column = lambda name: f"{before[name]:9.2f}" if name in before else " " * 9 * bool(before)
    print("seconds" + "   before" * bool(before) + "  test")
    for name, seconds, result in tests[: arguments.slowest]:
        print(f"{seconds:7.2f}{column(name)}  {name}" + (f" ({result})" if result != "ok" else ""))
    modules, modules_before = defaultdict(float), defaultdict(float)
    for name, seconds, _ in tests:
        modules[name.split("::")[0]] += seconds
    for name, seconds in before.items():
        modules_before[name.split("::")[0]] += seconds
    print("\nseconds" + "   before" * bool(before) + "  module")
    for name, seconds in sorted(modules.items(), key=lambda module: -module[1]):
        print(f"{seconds:7.2f}" + (f"{modules_before[name]:9.2f}" if before else "") + f"  {name}")
    results = [result for _, _, result in tests]
    counts = {kind: results.count(kind) for kind in ("ok", "failed", "ignored")}
    print(f"\n{counts['ok']} passed, {counts['failed']} failed, {counts['ignored']} ignored in {whole:.0f} s")
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
