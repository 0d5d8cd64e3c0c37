"""Finds differences between two runs, and between the outputs of two programs."""

import json
import math
from dataclasses import asdict, dataclass

import numpy as np
import pyarrow as pa

# Seconds differ between runs. FFT pairs and costs per stage belong to the timings. Notices are texts and not results.
SPENT = {"timing", "timing_fft_pairs", "cost", "seconds", "cpu_seconds", "noise", "notices", "warnings"}
# Tables with seconds.
UNCOMPARED = {"timing"}
# Name of the table of values that `--json` prints.
PRINTED = "printed"
# Finding for a table that only the new program writes.
NEW_TABLE = "only the new program writes the table"


@dataclass
class Finding:
    """One difference: a column or anything else."""

    where: str
    what: str
    # For a column with different values. `of_largest` is relative to its largest magnitude in the same table.
    count: int = 0
    absolute: float = 0.0
    relative: float = 0.0
    of_largest: float = 0.0
    iteration: int | None = None

    def is_allowed(self, allowed):
        """True if values differ within the allowed difference of the column, or if a new table is allowed (`+TABLE`)."""
        if self.what == NEW_TABLE:
            return "+" + self.where.partition("/")[2].partition(",")[0] in allowed
        if self.what != "values":
            return False
        names = (self.where, self.where.partition("/")[2], self.where.rpartition(".")[2], "*")
        return any(self.of_largest <= allowed[name] for name in names if name in allowed)

    def line(self):
        if self.what != "values":
            return f"{self.where}: {self.what}"
        at = "" if self.iteration is None else f", first in iteration {self.iteration}"
        return (
            f"{self.where}: {self.count} values, by {self.absolute:.2g}, relative {self.relative:.2g}, "
            f"of the largest {self.of_largest:.2g}{at}"
        )

    def to_json(self):
        # JSON does not support infinity.
        return {key: str(value) if value in (math.inf, -math.inf) else value for key, value in asdict(self).items()}


class Findings:
    """Findings of a case. The differences of a column over all iterations are one finding."""

    def __init__(self):
        self.found = []
        self.columns = {}
        self.compared = 0

    def say(self, where, what):
        self.found.append(Finding(where, what))

    def values(self, where, iteration, count, absolute, relative, of_largest):
        finding = self.columns.get(where)
        if finding is None:
            finding = self.columns[where] = Finding(where, "values", iteration=iteration)
            self.found.append(finding)
        finding.count += count
        finding.absolute = max(finding.absolute, absolute)
        finding.relative = max(finding.relative, relative)
        finding.of_largest = max(finding.of_largest, of_largest)


def as_numpy(column):
    """Returns the values and a mask of the missing values."""
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    absent = np.asarray(array.is_null())
    if pa.types.is_floating(array.type) or pa.types.is_integer(array.type):
        return np.ascontiguousarray(array.fill_null(0).to_numpy(zero_copy_only=False)), absent
    return np.array(array.to_pylist(), dtype=object), absent


def compare_column(findings, where, iteration, old, new):
    """Compares a column bit by bit. Any NaN equals any other NaN."""
    findings.compared += len(old)
    (a, none_a), (b, none_b) = as_numpy(old), as_numpy(new)
    if a.dtype == object:
        differs = np.array([x != y for x, y in zip(a, b)], dtype=bool)
        if differs.any():
            findings.values(where, iteration, int(differs.sum()), math.inf, math.inf, math.inf)
        return
    bits = f"u{a.dtype.itemsize}"
    differs = (a.view(bits) != b.view(bits)) & ~(np.isnan(a) & np.isnan(b))
    differs |= none_a != none_b
    if not differs.any():
        return
    with np.errstate(all="ignore"):
        x, y = a[differs].astype(float), b[differs].astype(float)
        absolute = np.abs(x - y)
        # A number instead of a missing value, NaN or infinity has an infinite difference.
        absolute[~np.isfinite(absolute) | (none_a != none_b)[differs]] = math.inf
        magnitude = np.maximum(np.abs(x), np.abs(y))
        # Zeros of different sign differ in their bits, with a difference of 0.
        relative = np.where(absolute == 0.0, 0.0, np.where(np.isinf(absolute), math.inf, absolute / magnitude))
        both = np.abs(np.concatenate([a, b]).astype(float))
        largest = both[np.isfinite(both)].max(initial=0.0)
        most = float(absolute.max())
        of_largest = most if most in (0.0, math.inf) else most / largest
    findings.values(where, iteration, int(differs.sum()), most, float(relative.max()), of_largest)


def compare_table(findings, where, iteration, old, new):
    at = where if iteration is None else f"{where}, iteration {iteration}"
    if old.column_names != new.column_names:
        gone = [name for name in old.column_names if name not in new.column_names]
        come = [name for name in new.column_names if name not in old.column_names]
        findings.say(at, f"columns: without {gone}, with {come}" if gone or come else "columns: in another order")
    if old.num_rows != new.num_rows:
        findings.say(at, f"rows: {old.num_rows} and {new.num_rows}")
        return
    for name in old.column_names:
        if name not in new.column_names:
            continue
        a, b = old[name], new[name]
        if a.type != b.type:
            findings.say(f"{at}.{name}", f"type: {a.type} and {b.type}")
        else:
            compare_column(findings, f"{where}.{name}", iteration, a, b)


def compare_runs(findings, name, old, new):
    """Compares every table of two runs."""
    if old is None or new is None:
        if old is not new:
            findings.say(name, f"only the {'new' if old is None else 'old'} program writes the folder")
        return
    there = [{key for key in run.tables() if key[1].rpartition("/")[2] not in UNCOMPARED} for run in (old, new)]
    iterations = [{k for k, _ in tables if k is not None} for tables in there]
    for which, only in (("old", iterations[0] - iterations[1]), ("new", iterations[1] - iterations[0])):
        if only:
            findings.say(name, f"only the {which} program has iterations {sorted(only)}")
    both = iterations[0] & iterations[1]
    for which, only in (("old", there[0] - there[1]), ("new", there[1] - there[0])):
        for k, table in sorted(only, key=lambda key: (-1 if key[0] is None else key[0], key[1])):
            if k is None or k in both:
                at = "" if k is None else f", iteration {k}"
                findings.say(f"{name}/{table}{at}", f"only the {which} program writes the table")
    for k, table in sorted(there[0] & there[1], key=lambda key: (-1 if key[0] is None else key[0], key[1])):
        compare_table(findings, f"{name}/{table}", k, old.read(k, table), new.read(k, table))


def flatten(value, prefix=""):
    """Flattens nested objects and lists into one object with dotted keys, without times and costs."""
    if isinstance(value, list):
        value = {str(index): inner for index, inner in enumerate(value)}
    if not isinstance(value, dict) or not value:
        return {prefix: value}
    flat = {}
    for key, inner in value.items():
        if key not in SPENT:
            flat |= flatten(inner, f"{prefix}.{key}" if prefix else key)
    return flat


def compare_printed(findings, where, old, new):
    """Compares two outputs of `--json`."""
    try:
        rows = [flatten(json.loads(text)) for text in (old, new)]
    except json.JSONDecodeError:
        if old != new:
            findings.say(where, f"printed {old.strip()[:200]!r} and {new.strip()[:200]!r}")
        return
    for name in sorted(rows[0].keys() | rows[1].keys()):
        at = f"{where}/{PRINTED}.{name}"
        if (name in rows[0]) != (name in rows[1]):
            findings.say(at, f"only the {'old' if name in rows[0] else 'new'} program prints this value")
            continue
        a, b = rows[0][name], rows[1][name]
        if type(a) is type(b) and isinstance(a, (int, float)) and not isinstance(a, bool):
            compare_column(findings, at, None, pa.array([a]), pa.array([b]))
        elif type(a) is not type(b) or a != b:
            findings.say(at, f"printed {a!r} and {b!r}")


def compare_starts(findings, where, old, new):
    """Compares the exit codes, the output, and the error message of a failed start."""
    if old.code != new.code:
        findings.say(where, f"exit code {old.code} and {new.code}: {old.error.strip()[-300:]!r} and {new.error.strip()[-300:]!r}")
        return
    if old.code != 0 and old.error != new.error:
        findings.say(where, f"error message {old.error.strip()!r} and {new.error.strip()!r}")
    compare_printed(findings, where, old.printed, new.printed)
