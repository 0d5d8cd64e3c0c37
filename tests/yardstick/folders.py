"""Folders as tables, whatever their layout: of runs, campaigns, trades, backbones and comparisons.

A comparison asks a folder for the tables there are and for one of them, by the wear iteration it belongs to and its name. How a run lays
them out is the business of one class.
"""

import pyarrow.csv
import pyarrow.parquet as pq

# The iteration of a table that is written once a run.
ONCE = None


class TablesOfRun:
    """`once/TABLE.parquet`, `iterations/wear_iteration=N/TABLE.parquet`; `history.parquet` says again what is in them."""

    def __init__(self, root):
        self.files = {(ONCE, path.stem): path for path in (root / "once").glob("*.parquet")}
        for path in (root / "iterations").glob("wear_iteration=*/*.parquet"):
            self.files[int(path.parent.name.partition("=")[2]), path.stem] = path

    def tables(self):
        """(iteration, name) of every table."""
        return set(self.files)

    def read(self, iteration, name):
        """One of them."""
        # Not `read_table`, which takes the `wear_iteration=N` of the path for a column.
        return pq.ParquetFile(self.files[iteration, name]).read()


class TablesBelow(TablesOfRun):
    """Every Parquet and CSV file below a folder, by its path in the folder."""

    # How columns of seconds begin, and those of a history that are about files.
    UNCOMPARED = ("seconds", "cpu_seconds", "expected_seconds", "timing_", "commit", "bytes")

    def __init__(self, root):
        paths = [path for path in root.rglob("*") if path.suffix in (".parquet", ".csv")]
        self.files = {(ONCE, path.relative_to(root).as_posix().removesuffix(".parquet")): path for path in paths}

    def read(self, iteration, name):
        path = self.files[iteration, name]
        table = pyarrow.csv.read_csv(path) if path.suffix == ".csv" else super().read(iteration, name)
        return table.drop_columns([column for column in table.column_names if column.startswith(self.UNCOMPARED)])


def open_run(root):
    """The tables of a run; of none where there is no run."""
    return TablesOfRun(root) if (root / "run.json").exists() else None
