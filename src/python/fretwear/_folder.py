"""Reads the folder of a run."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from html import escape
from typing import TYPE_CHECKING, Any, Literal, overload

import pyarrow as pa
import pyarrow.parquet as pq

from fretwear._program import Error, call

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import polars as pl
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

Library = Literal["arrow", "pandas", "polars"]

#: Layout number of run folders: that of the program.
LAYOUT = 10
#: Exit code of the program for a damaged or mismatched run.
MISMATCHED = 4


def _as(library: Library, table: pa.Table) -> Any:
    if library == "arrow":
        return table
    if library == "pandas":
        return table.to_pandas()
    if library == "polars":
        import polars

        return polars.from_arrow(table)
    raise ValueError(f'library is {library!r}; it is one of "arrow", "pandas", "polars"')


def _units(file: Path) -> dict[str, str]:
    return {field.name: (field.metadata or {})[b"unit"].decode() for field in pq.read_schema(file)}


class Run:
    """Reads the run in a folder, such as `Run("runs/joint")`.

    Each call reads the iterations that are committed at that time, so you may read a run while the program computes it. Only `verify`
    compares files with their hashes. The constructor raises Error if the folder has no run, or a run of another layout.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).absolute()  # The run stays valid if the working folder changes.
        if not (self.folder / "run.json").is_file():
            raise Error(f"there is no run at {self.folder}: run.json is missing")
        record = self._record()
        if (found := record.get("format")) != LAYOUT:
            version, commit = record.get("program_version"), record.get("program_commit")
            program = f" of fretwear {version}" if version else ""
            program += f" (commit {commit})" if version and commit else ""
            raise Error(
                f"the run {self.folder} has layout {found}{program}; this module reads only layout {LAYOUT}: read the run with the program "
                "that made it, or start a new run in another folder",
                MISMATCHED,
            )

    def __repr__(self) -> str:
        return f"Run({str(self.folder)!r})"

    def __fspath__(self) -> str:
        return str(self.folder)

    def _record(self) -> dict[str, Any]:
        file = self.folder / "run.json"
        try:
            record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        except ValueError as error:
            raise Error(f"{file} cannot be read: {error}; `fretwear run` writes it again from its copy", MISMATCHED) from None
        return record

    def _path(self, table: str, iteration: int) -> Path:
        return self.folder / "iterations" / f"wear_iteration={iteration}" / f"{table}.parquet"

    def _having(self, table: str) -> list[int]:
        return [k for k in self.iterations if self._path(table, k).is_file()]

    def _file(self, table: str, iteration: int | None) -> Path:
        """The file of a table of the whole run, or of an iteration."""
        once = self.folder / "once" / f"{table}.parquet"
        if once.is_file():
            return once
        k = self.latest if iteration is None else iteration
        if k not in self.iterations:
            raise Error(f"{self.folder} has no iteration {k}; kept are {self.iterations}")
        file = self._path(table, k)
        if not file.is_file():
            raise Error(f"iteration {k} of {self.folder} has no table {table}; iterations that have it: {self._having(table)}")
        return file

    @property
    def iterations(self) -> list[int]:
        """Numbers of the stored iterations, ascending. Iteration 0 is the unworn joint. Only `history` has rows of pruned iterations."""
        found = self.folder.glob("iterations/wear_iteration=*/commit.json")
        numbers = (re.fullmatch(r"wear_iteration=(\d+)", commit.parent.name) for commit in found)
        return sorted(int(number[1]) for number in numbers if number)

    @property
    def latest(self) -> int:
        """Number of the last committed iteration. Raises Error if no iteration is committed."""
        if not (iterations := self.iterations):
            raise Error(f"{self.folder} has no committed iteration yet")
        return iterations[-1]

    @property
    def scene(self) -> dict[str, Any]:
        """The resolved scene, by section and key.

        Quantities are numbers in SI units. Keys with a default have their value, and absent sections are None. The file `scene.toml` in
        the folder of the run has the same scene as text.
        """
        scene: dict[str, Any] = self._record()["scene"]
        return scene

    def _repr_html_(self) -> str:
        """The figures that `fretwear status` prints, with error bars, as an HTML table."""
        status = json.loads(call("status", "--json", "--", str(self.folder)))
        title = f"{escape(str(self.folder))}: iteration {status['wear_iteration']}, {status['state']}"
        if status["wear_iteration"] is None:
            return f"<p>{escape(str(self.folder))}: no iteration yet, {status['state']}</p>"
        cycles = f"{status.get('cycles') or 0:,}".replace(",", "&#8239;")
        rows = [("", "unworn", f"after {cycles} cycles"), *((row["figure"], row["unworn"], row["worn"] or "") for row in status["figures"])]
        cells = ("".join(f"<td style='text-align: left'>{text if '&#' in text else escape(text)}</td>" for text in row) for row in rows)
        return f"<table><caption>{title}</caption>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"

    @overload
    def table(self, table: str, iteration: int | Literal["all"] | None = None, library: Literal["arrow"] = "arrow") -> pa.Table: ...
    @overload
    def table(self, table: str, iteration: int | Literal["all"] | None = None, *, library: Literal["pandas"]) -> pd.DataFrame: ...
    @overload
    def table(self, table: str, iteration: int | Literal["all"] | None, library: Literal["pandas"]) -> pd.DataFrame: ...
    @overload
    def table(self, table: str, iteration: int | Literal["all"] | None = None, *, library: Literal["polars"]) -> pl.DataFrame: ...
    @overload
    def table(self, table: str, iteration: int | Literal["all"] | None, library: Literal["polars"]) -> pl.DataFrame: ...
    def table(self, table: str, iteration: int | Literal["all"] | None = None, library: Library = "arrow") -> Any:
        """Returns a table of one iteration, of all iterations, or of the whole run (`surface`, `structure`, …), in SI units.

        - `iteration`: number of the iteration, or None for the last one. "all" returns the rows of all stored iterations, ascending, with
          the first column `wear_iteration`.
        - `library`: "arrow" returns a `pyarrow.Table` with the units in its schema; "pandas" and "polars" return a `DataFrame`.

        Raises Error if the run does not have the iteration or the table.
        """
        if iteration != "all":
            return _as(library, pq.ParquetFile(self._file(table, iteration)).read())
        number = pa.field("wear_iteration", pa.int64(), metadata={"unit": "1"})
        parts = [(k, pq.ParquetFile(self._path(table, k)).read()) for k in self._having(table)]
        if not parts:
            raise Error(f"no iteration of {self.folder} has a table {table}")
        numbered = [part.add_column(0, number, pa.array([k] * part.num_rows, pa.int64())) for k, part in parts]
        return _as(library, pa.concat_tables(numbered, promote_options="default"))

    def scan(self, table: str) -> pl.LazyFrame:
        """Returns a table over all stored iterations as a Polars LazyFrame.

        Polars reads the files at `collect`, and only the columns in use. The first column is `wear_iteration`, and rows ascend by
        iteration. A column that an iteration does not have is null in its rows. A table of the whole run (`surface`, `structure`, …) and
        "history" have no further column. Call `collect` before the run prunes iterations (`output.keep`), because Polars raises an
        error for a pruned file. Raises Error if the run does not have the table.
        """
        import polars as pl

        if table == "history":
            # The program replaces this file at every iteration, so that it is read at once.
            return pl.LazyFrame(self.history("polars"))
        once = self.folder / "once" / f"{table}.parquet"
        if once.is_file():
            return pl.scan_parquet(once)
        having = self._having(table)
        if not having:
            raise Error(f"no iteration of {self.folder} has a table {table}")
        files = ((k, pl.scan_parquet(self._path(table, k), hive_partitioning=False)) for k in having)
        return pl.concat([part.select(pl.lit(k, pl.Int64).alias("wear_iteration"), pl.all()) for k, part in files], how="diagonal")

    @overload
    def history(self, library: Literal["arrow"] = "arrow") -> pa.Table: ...
    @overload
    def history(self, library: Literal["pandas"]) -> pd.DataFrame: ...
    @overload
    def history(self, library: Literal["polars"]) -> pl.DataFrame: ...
    def history(self, library: Library = "arrow") -> Any:
        """Returns one row per iteration, ascending, with pruned iterations.

        Columns of the table `summary` keep their names. The names of columns of other one-row tables begin with the name of the table.
        Raises Error if no iteration is committed.
        """
        return _as(library, pq.ParquetFile(self._history()).read())

    def _history(self) -> Path:
        if not (file := self.folder / "history.parquet").is_file():
            raise Error(f"{self.folder} has no committed iteration yet")
        return file

    def units(self, table: str) -> dict[str, str]:
        """Returns the unit of each column of a table or of "history", such as {"kn": "N/m"}.

        The unit "1" belongs to a dimensionless column. Raises Error if the run does not have the table.
        """
        file = self._history() if table == "history" else self._file(table, max(self._having(table), default=None))
        return _units(file)

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns the centres of the cells as two NumPy arrays: x of each i, and y of each j, in m.

        The origin is the middle of the joint. Raises Error if the scene has no grid.
        """
        import numpy as np

        joint = self.scene["joint"] or {}
        if not joint.get("grid"):
            raise Error(f"{self.folder} has no grid: its scene has no [surface]")
        x, y = ((np.arange(n) + 0.5 - 0.5 * n) * (size / n) for n, size in zip(joint["grid"], joint["size"], strict=True))
        return x, y

    @overload
    def field(self, column: str, iteration: int | None = None, *, as_xarray: Literal[False] = False) -> NDArray[np.float64]: ...
    @overload
    def field(self, column: str, iteration: int | None = None, *, as_xarray: Literal[True]) -> xr.DataArray: ...
    def field(self, column: str, iteration: int | None = None, *, as_xarray: bool = False) -> Any:
        """Returns a column of `contact_field`, `wear_field` or `surface` on the grid of the joint, such as "pressure" (Pa).

        - `iteration`: number of the iteration, or None for the last one.
        - `as_xarray`: True returns an `xarray.DataArray` over x and y, the centres of the cells in m, with its unit.

        By default the result is a NumPy array [i, j] of floats, with i along x and j along y. Positions without a cell, such as the hole,
        are NaN. Raises Error if the run does not have the field.
        """
        import numpy as np

        k = self.latest if iteration is None else iteration
        if k not in self.iterations:
            raise Error(f"{self.folder} has no iteration {k}; kept are {self.iterations}")
        # Other tables of cells have columns of the same names: the coarse trajectory, and samples of a cycle.
        beside = self._path("contact_field", k).parent
        files = [self.folder / "once/surface.parquet", beside / "contact_field.parquet", beside / "wear_field.parquet"]
        fields = {of: file for file in files if file.exists() for of in set(pq.read_schema(file).names) - {"i", "j"}}
        if column not in fields:
            raise Error(f"iteration {k} of {self.folder} has no field {column}; it has {sorted(fields)}, and kept are {self.iterations}")
        cells = pq.ParquetFile(fields[column]).read(columns=["i", "j", column])
        x, y = self.centres()
        values = np.full((len(x), len(y)), np.nan)
        values[cells["i"].to_numpy(), cells["j"].to_numpy()] = cells[column].to_numpy()
        if not as_xarray:
            return values
        import xarray

        axes = {name: (name, at, {"units": "m"}) for name, at in (("x", x), ("y", y))}
        unit = _units(fields[column])[column]
        return xarray.DataArray(values, axes, ("x", "y"), name=column, attrs={"units": unit})

    def plot(self, figure: str, iteration: int | None = None, *, axes: Axes | None = None) -> Figure:
        """Draws a figure of the run with matplotlib, and returns the figure.

        - `figure`: a field such as "pressure" or "wear_depth" draws a map of the joint. The curves are "hysteresis", "indentation", "frf"
          and "joint_cycle". A column of `history`, such as "wear_volume", draws its values over the cycles, with the error bar as a band.
        - `iteration`: number of the iteration for a field or a curve, or None for the last one.
        - `axes`: axes to draw on. The default is a new figure.

        Raises Error if the run does not have the figure.
        """
        from fretwear._plot import plot

        return plot(self, figure, iteration, axes)

    def verify(self) -> None:
        """Compares every file of the run with its hash.

        Raises Error with code 4 and one line per damaged file or iteration.
        """
        call("verify", "--", str(self.folder))

    def report(self, path: str | os.PathLike[str] | None = None) -> Path:
        """Writes an HTML page with all figures and returns its path.

        The default of `path` is `report.html` in the folder of the run. Raises Error if the page cannot be written.
        """
        page = self.folder / "report.html" if path is None else Path(path)
        call("report", f"--output={page}", "--", str(self.folder))
        return page
