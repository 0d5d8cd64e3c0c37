"""Checks that the comparison finds each modification of a small run."""

import json
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from compare import NEW_TABLE, Finding, Findings, compare_column, compare_runs, compare_starts
from folders import TablesBelow, open_run

REPOSITORY = Path(__file__).resolve().parents[2]
# A run with several iterations, with tables of one row and of many rows.
SCENE = REPOSITORY / "pipelines/prescribed_fretting.toml"
SMALL = ["joint.grid=[24, 18]", "wear.cycles=200_000", "output.curves_every=1"]
ITERATION = 1
LAST_BIT, SIGN_BIT = 0, 63


@dataclass
class Said:
    code: int
    printed: str
    error: str


def rewrite(root, table, change):
    """Replaces a table of ITERATION by the result of `change`."""
    path = root / f"iterations/wear_iteration={ITERATION}/{table}.parquet"
    pq.write_table(change(pq.ParquetFile(path).read()), path)


def with_column(table, name, values):
    at = table.column_names.index(name)
    return table.set_column(at, table.schema.field(at), pa.array(values, table.schema.field(at).type))


def flipped(name, row, bit):
    def change(table):
        values = table[name].to_numpy().copy()
        values.view(np.uint64)[row] ^= np.uint64(1 << bit)
        return with_column(table, name, values)

    return change


def put(name, row, value):
    def change(table):
        values = table[name].to_pylist()
        values[row] = value
        return with_column(table, name, values)

    return change


def exchanged(table):
    names = table.column_names
    return table.select([names[1], names[0], *names[2:]])


def narrowed(table):
    at = table.column_names.index("pressure")
    return table.set_column(at, "pressure", table["pressure"].cast(pa.float32()))


# Change of a table, and a part of each expected finding. No other finding may occur.
TABLES = [
    ("contact_field", lambda table: table, []),
    ("contact_field", flipped("pressure", 7, LAST_BIT), ["a/contact_field.pressure: 1 values"]),
    ("summary", flipped("kn", 0, LAST_BIT), ["a/summary.kn: 1 values"]),
    ("summary", flipped("kn", 0, SIGN_BIT), ["a/summary.kn: 1 values"]),
    ("cycle", put("force_x", 0, float("nan")), ["a/cycle.force_x: 1 values"]),
    ("wear_field", put("i", 0, 99), ["a/wear_field.i: 1 values"]),
    ("contact_field", exchanged, ["in another order"]),
    ("contact_field", lambda table: table.drop_columns(["gap"]), ["without ['gap']"]),
    ("contact_field", lambda table: table.slice(1), ["rows: "]),
    ("contact_field", narrowed, ["type: double and float"]),
    ("timing", lambda table: table.slice(1), []),
]


def remove_table(root):
    (root / f"iterations/wear_iteration={ITERATION}/hysteresis.parquet").unlink(missing_ok=True)
    (root / f"iterations/wear_iteration={ITERATION}/cycle.parquet").unlink()


# Change of a folder, and a part of an expected finding.
FOLDERS = [
    (lambda root: shutil.rmtree(root / f"iterations/wear_iteration={ITERATION}"), f"only the old program has iterations [{ITERATION}]"),
    (remove_table, f"cycle, iteration {ITERATION}: only the old program writes the table"),
    (lambda root: (root / "once/surface.parquet").unlink(), "surface: only the old program writes the table"),
    (lambda root: (root / "run.json").unlink(), "only the old program writes the folder"),
]

# Paths of tables in other folders: a campaign, a trade, backbones, a comparison.
OTHERS = ["campaign", "collected/shard-00000", "ended/000001", "trade", "fast/iterations/wear_iteration=1/summary", "worn", "last.csv"]
OTHER = pa.table({"state": ["a", "b"], "kn": [2.5, 3.5], "cpu_seconds": [0.1, 0.2], "timing_seconds_wear": [0.3, 0.4]})
# Change of such a table, and the expected finding, if any.
CHANGES = [
    (lambda table: table, None),
    (flipped("kn", 1, LAST_BIT), ".kn: 1 values"),
    (put("state", 0, "c"), ".state: 1 values"),
    (flipped("cpu_seconds", 1, SIGN_BIT), None),
    (flipped("timing_seconds_wear", 1, SIGN_BIT), None),
    (lambda table: None, ": only the old program writes the table"),
]

ROW = {"kn": 2.5e9, "cycles": 1000, "updated": False, "ku": None, "timing": {"wear": 0.1}}
# Two starts, and the expected finding, if any.
STARTS = [
    (Said(0, json.dumps(ROW), ""), Said(0, json.dumps(ROW | {"timing": {"wear": 0.2}}), "chatter"), None),
    (Said(0, json.dumps(ROW), ""), Said(0, json.dumps(ROW | {"kn": np.nextafter(2.5e9, 3e9)}), ""), "printed.kn: 1 values"),
    (Said(0, json.dumps(ROW), ""), Said(0, json.dumps(ROW | {"updated": True}), ""), "printed False and True"),
    (Said(0, json.dumps(ROW), ""), Said(0, json.dumps(ROW | {"ku": 3.0}), ""), "printed None and 3.0"),
    (Said(0, json.dumps(ROW), ""), Said(0, json.dumps(ROW | {"kt": 1.0}), ""), "only the new program prints this value"),
    (Said(0, json.dumps({"rows": [ROW, ROW]}), ""), Said(0, json.dumps({"rows": [ROW, ROW | {"kn": 3.0}]}), ""), "rows.1.kn: 1 values"),
    (Said(0, json.dumps(ROW | {"notices": ["a"]}), ""), Said(0, json.dumps(ROW | {"notices": ["b", "c"]}), ""), None),
    (Said(2, "", "error: a"), Said(2, "", "error: a"), None),
    (Said(2, "", "error: a"), Said(2, "", "error: b"), "error message 'error: a' and 'error: b'"),
    (Said(2, "", "error: a"), Said(3, "", "error: a"), "exit code 2 and 3"),
]


def make_run(program, root):
    sets = [word for key in SMALL for word in ("--set", key)]
    subprocess.run([program, "run", SCENE, "--run", root, "--quiet", *sets], check=True, capture_output=True)


def compared(run, doctor):
    """Returns the findings for a run and a modified copy."""
    findings = Findings()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "run"
        shutil.copytree(run, copy)
        doctor(copy)
        compare_runs(findings, "a", open_run(run), open_run(copy))
    return findings


def with_table(root, name, table):
    """Returns a folder with this table, or without a table."""
    path = root / (name if name.endswith(".csv") else f"{name}.parquet")
    path.parent.mkdir(parents=True)
    if table is not None:
        (pyarrow.csv.write_csv if path.suffix == ".csv" else pq.write_table)(table, path)
    return TablesBelow(root)


def check(found, parts):
    lines = [finding.line() for finding in found]
    assert len(lines) == len(parts), f"{lines} found for {parts}"
    for line, part in zip(lines, parts):
        assert part in line, f"{line!r} found for {part!r}"


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        make_run(program, run)
        check_all(run)
    print(f"{len(TABLES) + len(FOLDERS) + len(OTHERS) * len(CHANGES) + len(STARTS)} modified pairs compared correctly")
    return 0


def check_all(run):
    for table, change, parts in TABLES:
        findings = compared(run, lambda root: rewrite(root, table, change))
        check(findings.found, parts)
        assert all(f.iteration in (None, ITERATION) for f in findings.found)
    for doctor, part in FOLDERS:
        # A removed table may remove other tables.
        found = compared(run, doctor).found
        assert any(part in finding.line() for finding in found), f"{[f.line() for f in found]} found for {part!r}"
    for name, (change, part) in product(OTHERS, CHANGES):
        findings = Findings()
        with tempfile.TemporaryDirectory() as folder:
            old, new = (with_table(Path(folder) / which, name, table) for which, table in (("old", OTHER), ("new", change(OTHER))))
            compare_runs(findings, "a", old, new)
        check(findings.found, [] if part is None else [f"a/{name}{part}"])
    for old, new, part in STARTS:
        findings = Findings()
        compare_starts(findings, "start 1", old, new)
        check(findings.found, [] if part is None else [part])

    # All NaN are equal. Zeros of different sign differ in their bits, with a difference of 0.
    nan = np.array([np.nan])
    other = (nan.view(np.uint64) | np.uint64(1)).view(np.float64)
    findings = Findings()
    compare_column(findings, "nan", None, pa.array(nan), pa.array(other))
    compare_column(findings, "zero", None, pa.array([0.0]), pa.array([-0.0]))
    check(findings.found, ["zero: 1 values, by 0, relative 0,"])

    # A new table is allowed by its name.
    new = Finding("a/cycle, iteration 1", NEW_TABLE)
    assert new.is_allowed({"+cycle": 0.0}) and not new.is_allowed({"+wear_step": 0.0, "*": 1.0})
    # An allowed difference applies to one column, up to its size, and only to values.
    (last_bit,) = compared(run, lambda root: rewrite(root, "summary", flipped("kn", 0, LAST_BIT))).found
    (sign,) = compared(run, lambda root: rewrite(root, "summary", flipped("kn", 0, SIGN_BIT))).found
    (rows,) = compared(run, lambda root: rewrite(root, "contact_field", lambda table: table.slice(1))).found
    assert all(last_bit.is_allowed({name: 1e-15}) for name in ("kn", "summary.kn", "a/summary.kn", "*"))
    assert not last_bit.is_allowed({"kt": 1.0}) and not last_bit.is_allowed({"kn": 1e-17})
    assert not sign.is_allowed({"kn": 1e-3}) and abs(sign.of_largest - 2.0) < 1e-15
    assert not rows.is_allowed({"*": 1.0, "a/contact_field, iteration 1": 1.0})
