"""Draws figures of a run with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from matplotlib.ticker import EngFormatter, MaxNLocator

from fretwear._program import Error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fretwear._folder import Run

#: Abscissa and ordinate of each table that is a curve.
CURVES = {
    "hysteresis": ("displacement", "load"),
    "indentation": ("displacement", "load"),
    "frf": ("frequency", "amplitude"),
    "joint_cycle": ("displacement_x", "force_x"),
}
#: Columns of error bars whose names differ from the names of their figures.
BARS = {
    "corrected_area_fraction": "error_corrected_area",
    "dissipated_energy_total": "error_wear_volume",
    "loaded_area_fraction": "error_loaded_area",
    "wear_rate": "error_dissipated_energy",
}
#: Units that take an SI prefix. A prefix would be cubed in m^3.
PREFIXED = ("m", "N", "Pa", "Hz", "J", "N/m")
#: Tables with fields on the grid.
FIELDS = ("surface", "contact_field", "wear_field")


def plot(run: Run, figure: str, iteration: int | None, axes: Axes | None) -> Figure:
    """Draws a figure of a run. `Run.plot` documents the arguments."""
    if axes is None:
        # pyplot selects the backend. After `close`, a notebook shows the figure only once.
        from matplotlib import pyplot

        new = pyplot.figure(layout="constrained")
        pyplot.close(new)
        axes = new.add_subplot()
    if figure in CURVES:
        _curve(run, figure, iteration, axes)
    elif figure in run.history().column_names:
        _course(run, figure, axes)
    else:
        _map(run, figure, iteration, axes)
    return axes.get_figure(root=True)  # type: ignore[return-value]


def _label(name: str, unit: str) -> str:
    return name.replace("_", " ") + (f" [{unit}]" if unit not in ("1", *PREFIXED) else "")


def _name_axis(axis: Axis, name: str, unit: str) -> None:
    """Labels an axis. The ticks have an SI prefix if the unit takes one, such as 2 mm."""
    axis.set_label_text(_label(name, unit))
    if unit in PREFIXED:
        axis.set_major_formatter(EngFormatter(unit=unit))


def _numbers(column: Any) -> NDArray[np.float64]:
    """Returns a column of a pyarrow table as floats. A null value becomes NaN."""
    values: NDArray[np.float64] = column.cast(pa.float64()).fill_null(np.nan).to_numpy()
    return values


def _curve(run: Run, figure: str, iteration: int | None, axes: Axes) -> None:
    table, units = run.table(figure, iteration), run.units(figure)
    x, y = CURVES[figure]
    across, up = _numbers(table[x]), _numbers(table[y])
    if figure == "frf":
        # One curve per force level. A branch may turn back in frequency, and rows without a response interrupt the line.
        for force in dict.fromkeys(table["force"].to_pylist()):
            rows = np.array(table["force"]) == force
            axes.plot(across[rows], up[rows], label=f"{force:g} N")
        axes.legend(title="force")
    elif figure == "joint_cycle":
        axes.plot(np.append(across, across[:1]), np.append(up, up[:1]))
    else:
        axes.plot(across, up)
    _name_axis(axes.xaxis, x, units[x])
    _name_axis(axes.yaxis, y, units[y])


def _course(run: Run, figure: str, axes: Axes) -> None:
    history, units = run.history(), run.units("history")
    if not (pa.types.is_floating(history.schema.field(figure).type) or pa.types.is_integer(history.schema.field(figure).type)):
        raise Error(f"the column {figure} of {run.folder} has no numbers to draw; give a numeric column of history")
    # A run without wear has no column `cycles` and only iteration 0.
    along = "cycles" if "cycles" in history.column_names else "wear_iteration"
    cycles, values = _numbers(history[along]), _numbers(history[figure])
    axes.plot(cycles, values, marker=".")
    bar = BARS.get(figure, f"error_{figure}")
    if bar in history.column_names:
        # The error bar is relative to the value and equals half the width of the band.
        half = np.abs(values) * _numbers(history[bar])
        axes.fill_between(cycles, values - half, values + half, alpha=0.25, label="error bar")
        axes.legend()
    axes.set(xlabel=along.replace("_", " "))
    _name_axis(axes.yaxis, figure, units[figure])


def _map(run: Run, figure: str, iteration: int | None, axes: Axes) -> None:
    try:
        values = run.field(figure, iteration)
    except Error as error:
        raise Error(
            f"the run has no figure {figure}: {error}; the curves are {sorted(CURVES)}, and each column of history is a figure"
        ) from None
    x, y = run.centres()
    edges = [0.5 * (at[0] * 3 - at[1]) if end == 0 else 0.5 * (at[-1] * 3 - at[-2]) for at in (x, y) for end in (0, 1)]
    image = axes.imshow(values.T, origin="lower", extent=(edges[0], edges[1], edges[2], edges[3]), interpolation="nearest")
    unit = next(units[figure] for units in map(run.units, _tables(run)) if figure in units)
    scale = EngFormatter(unit=unit) if unit in PREFIXED else None
    axes.get_figure(root=True).colorbar(image, ax=axes, label=_label(figure, unit), format=scale)  # type: ignore[union-attr]
    _name_axis(axes.xaxis, "x", "m")
    _name_axis(axes.yaxis, "y", "m")
    axes.set(aspect="equal")
    axes.xaxis.set_major_locator(MaxNLocator(5))


def _tables(run: Run) -> list[str]:
    """Returns the tables with fields that a run has."""
    found = []
    for table in FIELDS:
        try:
            run.units(table)
        except Error:
            continue
        found.append(table)
    return found
