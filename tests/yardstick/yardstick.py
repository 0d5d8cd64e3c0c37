#!/usr/bin/env python3
"""Hold one build of the program to the results of another, to the bit.

    python tests/yardstick/yardstick.py OLD NEW [--full] [--case NAME] [--allow COLUMN=REL] [--new-table TABLE] [--json] [FOLDER]
    python tests/yardstick/yardstick.py --self-test PROGRAM

OLD and NEW are two fretwear programs. Both run every scene of `pipelines/`, made small unless `--full` is given, drawn scenes of
every kind, structures as matrices and meshes, a campaign, a trade, a backbone and a comparison (scenes.py). Compared are every
table of every run, campaign, trade, backbone and comparison but the timings: the iterations there are, the tables of each, columns
and their order, rows, and values bit by bit; what `--json` prints but for times, cost and notices; exit codes; and what a start
says that does not end well. Each program must also find its own runs sound (`verify`). Exit code 0 if all is equal, or within
what is allowed.

`--allow COLUMN=REL` (as `kn`, `summary.kn`, `a/summary.kn`, or `*` for all; more than once) lets values of a column differ by this
part of the largest magnitude that it has in the same table; relative to itself, a field that passes through zero would never do.
`--new-table TABLE` lets the new program write a table that the old one does not know.

How a folder lays out its tables is known to folders.py alone. Wants pyarrow and numpy. Runs go into FOLDER and stay there;
without it they are removed. `--self-test` doctors a small run of PROGRAM, and other folders, in every way that must be found.
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

# A start that takes longer hangs [s]; the longest of `--full` takes minutes.
LONGEST = 7200.0
# Findings of a case that are listed; there are more in `--json`.
LISTED = 12


@dataclass
class Did:
    code: int | None
    printed: str
    error: str


@dataclass
class Side:
    """One of the two programs, and where it runs."""

    program: str
    folder: Path

    def start(self, folder, arguments):
        environment = {**os.environ, "FRETWEAR_CACHE": str(self.folder / "cache")}
        # Usage errors name the program as it was called.
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
        # Paths of files are absolute in some messages.
        return Did(done.returncode, done.stdout, done.stderr.replace(str(folder), "."))

    def run(self, case):
        """What every start did, the runs by name, and the seconds."""
        folder = self.folder / case.name
        case.prepare(folder)
        begun = time.monotonic()
        did = [(f"start {k}", self.start(folder, arguments)) for k, arguments in enumerate(case.starts, 1)]
        seconds = time.monotonic() - begun
        runs = {path.name: open_run(path) for path in sorted((folder / "runs").glob("*")) if path.is_dir()}
        for name in runs:
            verified = self.start(folder, ["verify", f"runs/{name}"])
            # Its words are about files, which are no results.
            did.append((f"verify {name}", Did(verified.code, "", verified.error if verified.code else "")))
        return did, runs | {name: TablesBelow(folder / name) for name in case.folders}, seconds


def compare_case(case, sides, keep):
    (did_old, old, seconds_old), (did_new, new, seconds_new) = (side.run(case) for side in sides)
    findings = Findings()
    # A run that one program alone leaves has no second start to hold its verification against.
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
    """A line of the table, and below it what differs."""
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
    parser.add_argument("old", nargs="?", metavar="OLD", help="the program that is the yardstick")
    parser.add_argument("new", nargs="?", metavar="NEW", help="the program that is held to it")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="where runs go and stay")
    parser.add_argument("--full", action="store_true", help="shipped scenes as they are: hours")
    parser.add_argument("--case", action="append", help="only this case; may be repeated")
    parser.add_argument("--allow", action="append", default=[], metavar="COLUMN=REL", help="may differ by this part")
    parser.add_argument("--new-table", action="append", default=[], metavar="TABLE", help="may be there with NEW alone")
    parser.add_argument("--json", action="store_true", help="print one JSON object in place of the table")
    parser.add_argument("--self-test", metavar="PROGRAM", help="does it find what is doctored in a run of this program?")
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
            sys.exit(f"no case {name}; there are {', '.join(sorted(names))}")
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
            # What is there, a cache of structures above all, is of other programs.
            if side.folder.exists():
                sys.exit(f"{side.folder} is there already: give an empty folder")
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
