"""Tables of the folders of runs, campaigns, trades, backbones and comparisons, for any layout.

A comparison asks a folder for its list of tables, and for one table by its wear iteration and name. One class contains the layout of a
run folder.
"""

import pyarrow.csv
import pyarrow.parquet as pq

# Iteration of a table that a run writes once.
ONCE = None


class TablesOfRun:
    """Tables in `once/TABLE.parquet` and `iterations/wear_iteration=N/TABLE.parquet`. `history.parquet` repeats their values."""

    def __init__(self, root):
        self.files = {(ONCE, path.stem): path for path in (root / "once").glob("*.parquet")}
        for path in (root / "iterations").glob("wear_iteration=*/*.parquet"):
            self.files[int(path.parent.name.partition("=")[2]), path.stem] = path

    def tables(self):
        """Returns the pair (iteration, name) of every table."""
        return set(self.files)

    def read(self, iteration, name):
        """Returns one table."""
        # `read_table` would read the `wear_iteration=N` of the path as a column.
        return pq.ParquetFile(self.files[iteration, name]).read()


class TablesBelow(TablesOfRun):
    """All Parquet and CSV files below a folder, by their paths in the folder."""

    # Prefixes of columns with seconds, and of columns of a history about files.
    UNCOMPARED = ("seconds", "cpu_seconds", "expected_seconds", "timing_", "commit", "bytes")

    def __init__(self, root):
        paths = [path for path in root.rglob("*") if path.suffix in (".parquet", ".csv")]
        self.files = {(ONCE, path.relative_to(root).as_posix().removesuffix(".parquet")): path for path in paths}

    def read(self, iteration, name):
        path = self.files[iteration, name]
        table = pyarrow.csv.read_csv(path) if path.suffix == ".csv" else super().read(iteration, name)
        return table.drop_columns([column for column in table.column_names if column.startswith(self.UNCOMPARED)])


def open_run(root):
    """Returns the tables of a run, or `None` without a run."""
    return TablesOfRun(root) if (root / "run.json").exists() else None
