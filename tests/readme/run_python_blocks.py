"""Runs the ```python blocks of the README and of the pages in docs/ as they stand, and holds what they read against the program
and its schemas.

    python tests/readme/run_python_blocks.py --program target/release/fretwear FOLDER

FOLDER contains `runs/prescribed_fretting` and `runs/lap_joint`, and any other runs. The blocks of a page run one after another, each
in a process of its own, in a folder of the page's own: its `runs` are those of FOLDER, its `pipelines` and `data` those of the
repository, and what the blocks write stays there. The module `fretwear` is that of src/python, and calls the program that is given.

What a block leaves in the names of READS is then compared, value by value, with the same files read one by one through pyarrow alone,
with the summary that the program itself prints, and with the units of `schemas/*.toml`. Every library and the module have to have given
every quantity, so a block that is dropped from the pages, or renames its result, fails too.

A ```toml block whose first line is `# NAME.toml` is a scene. It is written beside what the page's Python has written, and has to be one
that `fretwear plan` takes.
"""

import argparse
import json
import os
import pickle
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

REPOSITORY = Path(__file__).resolve().parents[2]
RUN = Path("runs/prescribed_fretting")
LIBRARIES = ("polars", "pandas", "duckdb")
MODULE = "fretwear"

# The results that blocks leave behind.
READS = ("curve", "pressure", "loop", "growth")
UNITS = ("units_pyarrow", "units_polars", "units_duckdb", "units_module")
ALL_RUNS = ("all_polars", "all_duckdb")

# Runs in the process of a block, after it: takes its results out as plain arrays, whatever the library.
EXTRACT = """
def _table(value):
    if type(value).__name__ == "DuckDBPyRelation":
        value = value.fetchnumpy()
    names = value.columns if hasattr(value, "columns") else value.keys()
    return {str(name): _array(value[name]) for name in names}

def _array(values):
    import numpy
    values = numpy.ma.asarray(values.to_numpy() if hasattr(values, "to_numpy") else values)
    return values.filled(numpy.nan) if values.dtype.kind == "f" else numpy.asarray(values.tolist())

import pickle as _pickle
_found = {}
for _name in %(names)r:
    if _name in globals():
        _value = globals()[_name]
        _is_plain = _name == "pressure" or _name.startswith("units_") or type(_value).__name__ == "ndarray"
        _found[_name] = _value if _is_plain else _table(_value)
with open(%(path)r, "wb") as _file:
    _pickle.dump(_found, _file)
"""


class Checks:
    """Counts what held, and says what did not."""

    def __init__(self):
        self.passed = 0
        self.failed = 0

    def check(self, what, holds, detail=""):
        if holds:
            self.passed += 1
        else:
            self.failed += 1
            print(f"FAILED {what}{': ' if detail else ''}{detail}")

    def equal(self, what, found, expected):
        """Bit for bit: all libraries read the same file, and none has a reason to round."""
        found, expected = np.asarray(found), np.asarray(expected)
        if found.shape != expected.shape:
            self.check(what, False, f"shape {found.shape}, expected {expected.shape}")
            return
        numeric = found.dtype.kind in "iufb" and expected.dtype.kind in "iufb"
        same = np.array_equal(found, expected, equal_nan=numeric)
        differing = np.flatnonzero(np.ravel(found != expected))
        detail = "" if same else f"first at {differing[:1]}: {np.ravel(found)[differing[:1]]}, expected {np.ravel(expected)[differing[:1]]}"
        self.check(what, same, detail)


def pages():
    """The README and the book."""
    return [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md"))]


def blocks(page, language):
    """(line, text) of each block in the language."""
    text = page.read_text(encoding="utf-8")
    return [
        (text.count("\n", 0, match.start()) + 2, match.group(1))
        for match in re.finditer(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    ]


def scenes(page):
    """(line, name, text) of each scene."""
    found = ((line, re.match(r"# (\w+\.toml)\n", text), text) for line, text in blocks(page, "toml"))
    return [(line, name.group(1), text) for line, name, text in found if name]


def folder_of_page(folder, scratch):
    """Where the blocks of a page run."""
    for name, target in (("runs", folder / "runs"), ("pipelines", REPOSITORY / "pipelines"), ("data", REPOSITORY / "data")):
        (scratch / name).symlink_to(target, target_is_directory=True)


def run_block(code, folder, program):
    """Runs a block; (its results, None) or (None, what it printed on stderr)."""
    with tempfile.TemporaryDirectory() as scratch:
        results = Path(scratch) / "results"
        script = Path(scratch) / "block.py"
        names = READS + UNITS + ALL_RUNS
        script.write_text(code + EXTRACT % {"names": names, "path": str(results)}, encoding="utf-8")
        environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "src/python"), "FRETWEAR": str(program)}
        done = subprocess.run([sys.executable, str(script)], cwd=folder, env=environment, capture_output=True, text=True)
        if done.returncode != 0:
            return None, done.stderr
        return pickle.loads(results.read_bytes()), None


def read(folder, k, table, run=RUN):
    """One file by itself: ParquetFile adds no column for the folder's name."""
    file = folder / run / "iterations" / f"wear_iteration={k}" / f"{table}.parquet"
    columns = pq.ParquetFile(file).read()
    return {name: columns[name].to_numpy() for name in columns.column_names}


def iterations(folder, run=RUN):
    names = (path.name for path in (folder / run / "iterations").iterdir())
    return sorted(int(name.removeprefix("wear_iteration=")) for name in names)


def expected_reads(folder):
    """The results of the blocks, by pyarrow and numpy alone."""
    ks = iterations(folder)
    before, last = ks[-2:]
    rows = [read(folder, k, "summary") for k in ks]
    curve = {name: np.concatenate([row[name] for row in rows]) for name in ("cycles", "wear_volume", "kn")}
    curve["wear_iteration"] = np.array(ks)

    field = read(folder, last, "contact_field")
    pressure = np.full((field["i"].max() + 1, field["j"].max() + 1), np.nan)
    pressure[field["i"], field["j"]] = field["pressure"]

    worn = {}
    for k in (before, last):
        wear = read(folder, k, "wear_field")
        worn[k] = dict(zip(zip(wear["i"].tolist(), wear["j"].tolist()), wear["wear_depth"].tolist()))
    cells = sorted(worn[last])
    growth = {
        "i": np.array([i for i, _ in cells]),
        "j": np.array([j for _, j in cells]),
        "wear_depth": np.array([worn[last][cell] - worn[before][cell] for cell in cells]),
    }
    return {"curve": curve, "pressure": pressure, "loop": read(folder, last, "hysteresis"), "growth": growth}


def compare_reads(checks, label, name, found, expected):
    if name == "pressure":
        checks.equal(f"{label}: pressure", found, expected)
        return
    if isinstance(found, np.ndarray):
        # On the grid of the pressure, as the module has fields.
        grid = np.full(found.shape, np.nan)
        grid[expected["i"], expected["j"]] = expected["wear_depth"]
        checks.equal(f"{label}: {name}", found, grid)
        return
    for column, values in expected.items():
        if column in found:
            order = np.lexsort((found["j"], found["i"])) if name == "growth" else slice(None)
            checks.equal(f"{label}: {name}.{column}", found[column][order], values)
        else:
            checks.check(f"{label}: {name}.{column}", False, "no such column")


def check_program(checks, program, folder, expected):
    """The last row of the curve is what the program itself says of the run."""
    done = subprocess.run(
        [program, "run", "--run", str(RUN), "--json", "--quiet"], cwd=folder, capture_output=True, text=True
    )
    checks.check("fretwear run --json ends with 0", done.returncode == 0, done.stderr)
    if done.returncode != 0:
        return
    printed = json.loads(done.stdout)
    summary = read(folder, iterations(folder)[-1], "summary")
    checks.check(
        "fretwear run --json has the columns of the summary",
        set(printed) == set(summary) | {"wear_iteration", "timing", "timing_fft_pairs", "cost", "notices", "warnings"},
        f"{sorted(set(printed) ^ set(summary))}",
    )
    for column, values in summary.items():
        checks.equal(f"fretwear run --json: {column}", printed.get(column), values[0])
    for column, values in expected["curve"].items():
        checks.equal(f"fretwear run --json: last {column} of the curve", printed.get(column), values[-1])


def check_scenes(checks, program, page, name_of_page, scratch):
    """The scenes of a page are such that the program plans them, files that they name and all."""
    for line, name, text in scenes(page):
        (scratch / name).write_text(text, encoding="utf-8")
        done = subprocess.run([program, "plan", name, "--no-rehearsal"], cwd=scratch, capture_output=True, text=True)
        checks.check(f"{name_of_page}:{line}: {name} is planned", done.returncode == 0, done.stderr)


def check_units(checks, label, units, folder):
    schema = tomllib.loads((REPOSITORY / "schemas/summary.toml").read_text(encoding="utf-8"))
    of_schema = {column["name"]: column["unit"] for column in schema["column"]}
    checks.check(
        f"{label} has the columns of the file",
        set(units) == set(read(folder, 0, "summary")),
        f"{sorted(units)}",
    )
    for column, unit in units.items():
        checks.check(f"{label}: {column}", unit == of_schema.get(column), f"{unit}, expected {of_schema.get(column)}")


def check_every_file(checks, folder):
    """Each column of each file of the run: its unit in both places, as the schema has it, and what it means in the run's schemas."""
    told = {schema["name"]: schema for schema in json.loads((folder / RUN / "schemas.json").read_text(encoding="utf-8"))}
    for file in sorted((folder / RUN).rglob("*/*.parquet")):
        schema = tomllib.loads((REPOSITORY / "schemas" / f"{file.stem}.toml").read_text(encoding="utf-8"))
        described = {column["name"]: column for column in schema["column"]}
        meant = {column["name"]: column for column in told[file.stem]["columns"]}
        parquet = pq.ParquetFile(file)
        arrow = parquet.schema_arrow
        entry = json.loads(parquet.metadata.metadata[b"fretwear"])
        wrong = [
            field.name
            for field in arrow
            if not (
                field.metadata[b"unit"].decode() == entry["columns"][field.name]["unit"] == described[field.name]["unit"]
                and all(meant[field.name][key] == described[field.name][key] for key in ("unit", "dimension", "description"))
            )
        ]
        name = file.relative_to(folder)
        checks.check(f"{name}: the table of its schema", entry["schema"] == schema["name"])
        checks.check(f"{name}: units and meaning of its columns", not wrong, ", ".join(wrong))


def check_history(checks, folder):
    """The history of the run: a row an iteration, with what its one-row tables say."""
    history = pq.ParquetFile(folder / RUN / "history.parquet").read()
    ks = iterations(folder)
    checks.equal("history: iterations", history["wear_iteration"].to_numpy(), ks)
    for table, before in (("summary", ""), ("static_contact", "static_contact_"), ("wear_step", "wear_step_")):
        rows = [read(folder, k, table) for k in ks]
        for column in rows[0]:
            expected = np.concatenate([row[column] for row in rows])
            checks.equal(f"history: {table}.{column}", history[before + column].to_numpy(), expected)


def check_all_runs(checks, label, found, folder):
    """Every iteration of every run, with nothing for what a run lacks."""
    runs = sorted({file.parents[2].name for file in folder.glob("runs/*/iterations/*/summary.parquet")})
    rows = [(run, k) for run in runs for k in iterations(folder, Path("runs") / run)]
    order = sorted(range(len(found["run"])), key=lambda row: (found["run"][row], found["wear_iteration"][row]))
    checks.check(
        f"{label}: rows", [(str(found["run"][row]), int(found["wear_iteration"][row])) for row in order] == rows
    )
    if len(order) != len(rows):
        return
    for column in ("kn", "wear_volume"):
        expected = [
            read(folder, k, "summary", Path("runs") / run).get(column, np.array([np.nan]))[0] for run, k in rows
        ]
        checks.equal(f"{label}: {column}", found[column][order], expected)


def check_results(checks, label, code, results, folder, expected):
    """Holds what a block left against what is expected; returns what that was."""
    seen = set()
    for name, found in results.items():
        if name in UNITS:
            check_units(checks, f"{label}: {name}", found, folder)
            seen.add(name)
        elif name in ALL_RUNS:
            check_all_runs(checks, f"{label}: {name}", found, folder)
            seen.add(name)
        else:
            [library] = [known for known in (*LIBRARIES, MODULE) if re.search(rf"^import {known}\b", code, re.MULTILINE)]
            compare_reads(checks, f"{label} ({library})", name, found, expected[name])
            seen.add((library, name))
    return seen


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="contains runs/prescribed_fretting and runs/lap_joint")
    parser.add_argument("--program", type=Path, required=True, help="the fretwear that computed the runs")
    arguments = parser.parse_args()
    folder, program = arguments.folder.resolve(), arguments.program.resolve()

    checks = Checks()
    expected = expected_reads(folder)
    seen = set()
    for page in pages():
        name_of_page = page.relative_to(REPOSITORY)
        with tempfile.TemporaryDirectory() as scratch:
            scratch = Path(scratch)
            folder_of_page(folder, scratch)
            for line, code in blocks(page, "python"):
                label = f"{name_of_page}:{line}"
                results, error = run_block(code, scratch, program)
                checks.check(f"{label} runs", error is None, error or "")
                if error is None:
                    seen |= check_results(checks, label, code, results, folder, expected)
            check_scenes(checks, program, page, name_of_page, scratch)
    wanted = {(library, name) for library in (*LIBRARIES, MODULE) for name in READS} | set(UNITS) | set(ALL_RUNS)
    checks.check("the pages read everything with every library and the module", wanted <= seen, f"missing {wanted - seen}")
    check_program(checks, program, folder, expected)
    check_every_file(checks, folder)
    check_history(checks, folder)

    print(f"{checks.passed} passed, {checks.failed} failed")
    return 1 if checks.failed else 0


if __name__ == "__main__":
    sys.exit(main())
