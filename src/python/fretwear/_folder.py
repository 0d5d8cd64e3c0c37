"""The folder of a run, read."""

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
    """A run by its folder, as `Run("runs/lap_joint")`. It holds the path alone: each call reads what is committed by then, so that a
    run may be read while it goes on. Nothing is checked against its hash but by `verify`. Raises Error if there is no run, or one of
    another layout."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).absolute()  # Who changes the working folder keeps the run.
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
        """The committed iterations that are kept, ascending; 0 is the unworn joint. Pruned ones are in `history` only."""
        found = self.folder.glob("iterations/wear_iteration=*/commit.json")
        numbers = (re.fullmatch(r"wear_iteration=(\d+)", commit.parent.name) for commit in found)
        return sorted(int(number[1]) for number in numbers if number)

    @property
    def latest(self) -> int:
        """The last committed iteration. Raises Error where there is none yet."""
        if not (iterations := self.iterations):
            raise Error(f"{self.folder} has no committed iteration yet")
        return iterations[-1]

    @property
    def scene(self) -> dict[str, Any]:
        """The scene as it was resolved, by section and key: quantities are numbers in SI units, defaults are filled in, what the scene
        has not is None. `scene.toml` in the folder has it as text."""
        scene: dict[str, Any] = self._record()["scene"]
        return scene

    def _repr_html_(self) -> str:
        """The figures of the run with their error bars, as a table: what `fretwear status` prints."""
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
        """A table of an iteration, or of the whole run (`surface`, `structure`, …), with rows in the order of the file, in SI units.

        - `iteration`: None is the last; "all" takes the rows of all kept iterations that have the table, ascending, with the column
          `wear_iteration` first.
        - `library`: "arrow" (a `pyarrow.Table`, whose schema has the units), "pandas" or "polars" (their `DataFrame`).

        Raises Error if there is no such iteration or table.
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
        """A table over all kept iterations as a Polars LazyFrame: files are read when it is collected, and only the columns in use.

        The column `wear_iteration` is first. Rows ascend by iteration; a column that an iteration lacks is null there. A table of the whole
        run (`surface`, `structure`, …) or "history" has its own rows. Collect it before the run prunes iterations (`output.keep`): a pruned
        file is an error of Polars. Raises Error if the run has no such table.
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
        """The course of the run: a row an iteration, ascending, pruned ones too. Columns of `summary` have their own names, those of
        other one-row tables begin with the table's. Raises Error where no iteration is committed yet."""
        return _as(library, pq.ParquetFile(self._history()).read())

    def _history(self) -> Path:
        if not (file := self.folder / "history.parquet").is_file():
            raise Error(f"{self.folder} has no committed iteration yet")
        return file

    def units(self, table: str) -> dict[str, str]:
        """The unit of each column of a table, or of "history", as {"kn": "N/m"}; "1" is no unit. Raises Error if the run has none."""
        file = self._history() if table == "history" else self._file(table, max(self._having(table), default=None))
        return _units(file)

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where cells are: x of each i and y of each j in m, from the middle of the joint, as NumPy arrays. Raises Error without grid."""
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
        """A column of `contact_field`, `wear_field` or `surface` on the grid of the joint, as "pressure" (Pa); `iteration` as in `table`.

        A NumPy array [i, j] of floats, i along x and j along y; NaN where there is no cell, as in the hole. With `as_xarray` an
        `xarray.DataArray` over x and y, the centres of cells in m, that knows its unit. Raises Error if there is no such field.
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
        """Draws a figure of the run with matplotlib, and returns it.

        - A field, as "pressure" or "wear_depth": a map of the joint at `iteration`, as in `table`.
        - A curve, "hysteresis", "indentation", "frf" or "joint_cycle": at `iteration`.
        - A column of `history`, as "wear_volume" or "resonance_frequency": its course over the cycles, with the error bar as a band.

        `axes`: where to draw; by default axes of a new figure. Raises Error if the run has no such figure.
        """
        from fretwear._plot import plot

        return plot(self, figure, iteration, axes)

    def verify(self) -> None:
        """Checks every file of the run against its hash. Raises Error with code 4 and a line for each file or iteration."""
        call("verify", "--", str(self.folder))

    def report(self, path: str | os.PathLike[str] | None = None) -> Path:
        """Writes a page with all figures, to `path` or to `report.html` in the run's folder; returns where. Raises Error."""
        page = self.folder / "report.html" if path is None else Path(path)
        call("report", f"--output={page}", "--", str(self.folder))
        return page
