#!/usr/bin/env python3
"""Compares the results of two builds of the program bit by bit.

    python tests/yardstick/yardstick.py OLD NEW [--full] [--case NAME] [--allow COLUMN=REL] [--new-table TABLE] [--json] [FOLDER]
    python tests/yardstick/yardstick.py --self-test PROGRAM

OLD and NEW are two fretwear programs. Both run every scene of `pipelines/` at a reduced size (or at full size with `--full`), random
scenes of every kind, structures as matrices and meshes, a campaign, a trade, a backbone and a comparison (scenes.py). The script
compares every table of every run, campaign, trade, backbone and comparison, except the timings: iterations, tables per iteration,
columns and their order, rows, and values bit by bit. It also compares the output of `--json` without times, cost and notices, the
exit codes, and the error messages of failed starts. Each program must also verify its own runs (`verify`). The exit code is 0 if
all results are equal or within the allowed differences.

`--allow COLUMN=REL` (as `kn`, `summary.kn`, `a/summary.kn`, or `*` for all columns; more than once) allows a difference in a column,
relative to the largest magnitude of the column in the same table. A relative difference of single values would fail for fields that
pass through zero. `--new-table TABLE` allows a table that only the new program writes.

Only folders.py contains the layout of the tables in a folder. The script needs pyarrow and numpy. Runs go into FOLDER and remain
there. Without FOLDER, the script deletes the runs. `--self-test` modifies a small run of PROGRAM and other folders and checks that the
comparison finds each modification.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import scenes
from compare import Findings, compare_runs, compare_starts
from folders import TablesBelow, open_run

# Time limit of a start [s]. The longest start of `--full` takes minutes.
LONGEST = 7200.0
# Largest number of listed findings of a case. `--json` prints all findings.
LISTED = 12


@dataclass
class Did:
    code: int | None
    printed: str
    error: str


@dataclass
class Side:
    """One of the two programs and the folder of its runs."""

    program: str
    folder: Path

    def start(self, folder, arguments):
        environment = {**os.environ, "FRETWEAR_CACHE": str(self.folder / "cache")}
        # A usage error contains the name of the called program.
        try:
            done = subprocess.run(
                ["fretwear", *arguments],
                executable=self.program,
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                timeout=LONGEST,
                stdin=subprocess.DEVNULL,
            )
        except subprocess.TimeoutExpired:
            return Did(None, "", f"no end after {LONGEST} s")
        # Some messages contain absolute paths of files.
        return Did(done.returncode, done.stdout, done.stderr.replace(str(folder), "."))

    def run(self, case):
        """Returns the outcome of every start, the runs by name, and the seconds."""
        folder = self.folder / case.name
        case.prepare(folder)
        begun = time.monotonic()
        did = [(f"start {k}", self.start(folder, arguments)) for k, arguments in enumerate(case.starts, 1)]
        seconds = time.monotonic() - begun
        runs = {path.name: open_run(path) for path in sorted((folder / "runs").glob("*")) if path.is_dir()}
        for name in runs:
            verified = self.start(folder, ["verify", f"runs/{name}"])
            # The output of `verify` concerns files and is not a result.
            did.append((f"verify {name}", Did(verified.code, "", verified.error if verified.code else "")))
        return did, runs | {name: TablesBelow(folder / name) for name in case.folders}, seconds


def compare_case(case, sides, keep):
    (did_old, old, seconds_old), (did_new, new, seconds_new) = (side.run(case) for side in sides)
    findings = Findings()
    # If only one program creates a run, the other program has no verification to compare.
    by_name = dict(did_new)
    for where, did in did_old:
        if where in by_name:
            compare_starts(findings, where, did, by_name[where])
    for name in sorted(old.keys() | new.keys()):
        compare_runs(findings, name, old.get(name), new.get(name))
    for side in () if keep else sides:
        shutil.rmtree(side.folder / case.name)
    return {
        "case": case.name,
        "codes": [did.code for where, did in did_old if where.startswith("start")],
        "iterations": sum(len({k for k, _ in run.tables() if k is not None}) for run in old.values() if run),
        "values": findings.compared,
        "seconds": [seconds_old, seconds_new],
        "findings": findings.found,
    }


def row_of(result, allowed):
    """Returns a line of the table, followed by the differences."""
    differing = [finding for finding in result["findings"] if not finding.is_allowed(allowed)]
    verdict = "equal"
    if differing:
        verdict = f"DIFFERS in {len(differing)}"
    elif result["findings"]:
        most = max(finding.of_largest for finding in result["findings"])
        verdict = f"allowed: {len(result['findings'])} columns differ by up to {most:.1e}"
    codes = ",".join("-" if code is None else str(code) for code in result["codes"])
    old, new = result["seconds"]
    lines = [f"{result['case']:42s} {codes:>10s} {result['iterations']:5d} {result['values']:9d} {old:8.2f} {new:8.2f}  {verdict}"]
    shown = differing[:LISTED]
    lines += [f"    {finding.line()}" for finding in shown]
    if len(differing) > len(shown):
        lines.append(f"    and {len(differing) - len(shown)} more")
    return "\n".join(lines)


def parse_allowed(texts):
    allowed = {}
    for text in texts:
        column, _, part = text.partition("=")
        try:
            allowed[column] = float(part)
        except ValueError:
            part = ""
        if not column or not part:
            sys.exit(f"--allow {text}: write COLUMN=REL, as in --allow kn=1e-9")
    return allowed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", nargs="?", metavar="OLD", help="the reference program")
    parser.add_argument("new", nargs="?", metavar="NEW", help="the program to compare with OLD")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="folder of the runs; the runs remain there")
    parser.add_argument("--full", action="store_true", help="run the shipped scenes at full size (hours)")
    parser.add_argument("--case", action="append", help="run only this case; may be repeated")
    parser.add_argument("--allow", action="append", default=[], metavar="COLUMN=REL", help="allow this relative difference in a column")
    parser.add_argument("--new-table", action="append", default=[], metavar="TABLE", help="allow a table that only NEW writes")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of the table")
    parser.add_argument("--self-test", metavar="PROGRAM", help="check that the comparison finds modifications of a run of this program")
    arguments = parser.parse_args()
    if arguments.self_test:
        import self_test

        return self_test.main(arguments.self_test)
    if not arguments.new:
        parser.error("give OLD and NEW, or --self-test")
    allowed = parse_allowed(arguments.allow) | {f"+{table}": 0.0 for table in arguments.new_table}
    cases = [*scenes.shipped(arguments.full), *scenes.drawn()]
    names = {case.name for case in cases}
    for name in arguments.case or []:
        if name not in names:
            sys.exit(f"no case {name}; the cases are {', '.join(sorted(names))}")
    cases = [case for case in cases if not arguments.case or case.name in arguments.case]
    out = sys.stderr if arguments.json else sys.stdout
    print(f"{'case':42s} {'exit codes':>10s} {'iter.':>5s} {'values':>9s} {'old [s]':>8s} {'new [s]':>8s}", file=out)
    begun = time.monotonic()
    results = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary).resolve()
        sides = [
            Side(str(Path(program).resolve()), folder / which)
            for which, program in (("old", arguments.old), ("new", arguments.new))
        ]
        for side in sides:
            # An existing folder, in particular its cache of structures, belongs to other programs.
            if side.folder.exists():
                sys.exit(f"{side.folder} exists already: give a new folder")
        for case in cases:
            results.append(compare_case(case, sides, keep=arguments.folder))
            print(row_of(results[-1], allowed), file=out, flush=True)
    differ = [r["case"] for r in results if not all(finding.is_allowed(allowed) for finding in r["findings"])]
    values = sum(result["values"] for result in results)
    seconds = time.monotonic() - begun
    print(f"{len(results) - len(differ)} of {len(results)} cases equal or as allowed, {values} values, {seconds:.0f} s", file=out)
    if arguments.json:
        for result in results:
            result["findings"] = [f.to_json() | {"allowed": f.is_allowed(allowed)} for f in result["findings"]]
        print(json.dumps({"equal": not differ, "seconds": seconds, "cases": results}, indent=1))
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
