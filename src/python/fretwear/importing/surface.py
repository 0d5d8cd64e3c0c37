"""Converts measured topographies of instruments and of SPM programs: `fretwear-import --surface FILE -o map.parquet`.

SurfaceTopography (MIT licence) reads the file in a child process. The extension or --format selects the reader, and the library never
detects the format. This module rejects formats that `fretwear` reads directly.

**Axes.** The first index of the heights is x and the second index is y, both in the library and in `Topography` of
`surface/topography.rs`. y counts the lines from the upper edge of the picture, like the readers of `fretwear` for X3P, SUR, SDF and AL3D.
With x to the right and y upwards, the map is therefore a mirror image of the surface. The mirror image has the same statistics, contact
and wear. The script `tests/python/judge_surface.py` compares the axes with a second library.

**Spacing.** The length of a side is its number of points times the spacing, as in the library. The module ignores periodicity.

**Output.** The table has the columns x, y and z in m, with one row per point. The value of z is null at a point without a measurement.
The key `fretwear_import` of the metadata is a JSON object with the contents of the file and the given options.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import tempfile
from argparse import Namespace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, child, folder
from fretwear.importing.scene import scale

LIBRARY, EXTRA = "SurfaceTopography", "surface"
OLDEST, NEXT = (1, 27), (2, 0)
#: File extensions of each reader of the library.
READERS = {
    "bcr": "bcr bcrf",
    "datx": "datx",
    "di": "spm",  # and .001 to .999
    "ezd": "ezd nid",
    "frt": "frt",
    "gwy": "gwy",
    "hgt": "hgt",
    "ibw": "ibw",
    "jpk": "jpk",
    "mdt": "mdt",
    "metropro": "dat",
    "mi": "mi",
    "mnt": "mnt",
    "nc": "nc",
    "nms": "nms",
    "oir": "oir",
    "opd": "opd",
    "opdx": "opdx",
    "os3d": "os3d",
    "plu": "plu apx",
    "plux": "plux",
    "poir": "poir",
    "ps": "tif tiff",
    "tmd": "tmd",
    "vk": "vk3 vk4 vk6 vk7",
    "wsxm": "cur stp tom top",
    "zmg": "zmg",
    "zon": "zon",
}
#: Extensions of files that `fretwear` reads directly, which are also the names of the corresponding readers of the library.
OWN = {"txt", "csv", "xyz", "tsv", "asc", "npy", "x3p", "sur", "sdf", "al3d", "parquet"}
#: Formats that the library reads but this module rejects, with the reason.
REJECTED = {
    "lext": "the library ignores which points were not measured; export X3P or SUR",
    "mat": "the file contains an array without a unit; save the array as NPY, which `fretwear` reads directly",
    "h5": "the file contains an array without a unit; save the array as NPY, which `fretwear` reads directly",
    "npz": "the file contains an array without a unit; save the array as NPY, which `fretwear` reads directly",
}
#: First bytes of the versions of MetroPro files.
METROPRO = (b"\x88\x1b\x03\x6f", b"\x88\x1b\x03\x70", b"\x88\x1b\x03\x71")
#: Units of length that --unit and --size accept.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "pm": 1e-12}
#: Units of length that the library returns.
STATED = LENGTHS | {"µm": 1e-6, "μm": 1e-6, "Å": 1e-10, "fm": 1e-15, "km": 1e3, "Mm": 1e6, "Gm": 1e9}
#: Smallest and largest length of a side of a map, in m.
SMALLEST, LARGEST = 1e-6, 1.0
#: Largest number of points of a map, as in `surface/readers`.
MOST_POINTS = 1 << 27


def _own(file: Path) -> Rejected:
    return Rejected(f'{file}: `fretwear` reads this format directly; write surface.path = "{file.name}" in the scene without an import')


def reader_of(file: Path, named: str | None) -> str:
    """Returns the name of the reader of the library. Raises Rejected."""
    extension = file.suffix.lower().removeprefix(".")
    if named in OWN or extension in OWN:
        raise _own(file)
    known = ", ".join(f"{name} (.{' .'.join(extensions.split())})" for name, extensions in READERS.items())
    if named:
        if named not in READERS:
            raise Rejected(f"--format {named}: {REJECTED.get(named, 'this reader does not exist')}; the known readers are {known}")
        return named
    if extension in REJECTED:
        raise Rejected(f"{file}: fretwear-import does not read .{extension} files: {REJECTED[extension]}")
    if extension == "dat":
        with file.open("rb") as opened:
            start = opened.read(4096)
        if start.startswith(METROPRO):
            return "metropro"
        if b"\0" not in start:
            raise _own(file)
        raise Rejected(
            f"{file}: several formats have the extension .dat, and this file does not begin like MetroPro; "
            f"give --format NAME with one of the readers {known}"
        )
    if re.fullmatch(r"\d{3}", extension):
        return "di"
    for name, extensions in READERS.items():
        if extension in extensions.split():
            return name
    raise Rejected(f"{file}: no reader has the extension of this file; give --format NAME with one of the readers {known}")


def _text(unit: Any) -> str:
    return "no unit" if unit is None else f"the unit {str(unit)!r}"


def library_map(file: str, reader: str, channel: str | None) -> dict[str, Any]:
    """Returns the heights of a channel, with the sides and the units that the file states. Runs in the child process."""
    version = metadata.version(LIBRARY)
    if not OLDEST <= tuple(int(part) for part in re.findall(r"\d+", version)[:2]) < NEXT:
        raise ImportError(f"version {version} is installed")
    from SurfaceTopography.IO import open_topography
    from SurfaceTopography.IO.Reader import DataKind

    with open_topography(file, format=reader) as opened:
        channels = list(opened.channels)
        titles = [str(one.name) for one in channels]
        names, units = [], []
        for k, one in enumerate(channels):
            # The name equals ChannelInfo.channel_id.
            names.append(titles[k] if titles.count(titles[k]) == 1 else f"{titles[k]}#{titles[: k + 1].count(titles[k])}")
            if isinstance(one.unit, tuple):
                # The Nanoscope reader returns raw digits for a quantity that is not a length.
                units.append((one.unit[0], None))
            elif reader == "ibw" and one._data_unit is None:
                # ChannelInfo.data_unit would return the unit of the sides.
                units.append((one.unit, None))
            elif one.unit in STATED and one.is_height_channel:
                # The library scales heights to the unit of the sides.
                units.append((one.unit, one.unit))
            else:
                units.append((one.unit, one.data_unit))
        shapes = [" x ".join(map(str, one.nb_grid_pts or ())) for one in channels]
        listed = [f"{name!r} ({shape}, {_text(unit[1])})" for name, shape, unit in zip(names, shapes, units, strict=True)]
        known = "; ".join(listed[:20]) or "none"
        if channel is not None:
            chosen = [k for k, name in enumerate(names) if name == channel]
            if not chosen:
                raise Rejected(f"{file}: the file has no channel {channel!r}; its channels are {known}")
        else:
            chosen = [k for k, one in enumerate(channels) if one.data_kind == DataKind.HEIGHT and not isinstance(one.unit, tuple)]
            chosen = list(range(len(channels))) if not chosen and len(channels) == 1 else chosen
            if len(chosen) != 1:
                raise Rejected(f"{file}: {len(chosen)} channels contain heights; give one with --channel NAME; the channels are {known}")
        one = channels[chosen[0]]
        points, sides = [int(n) for n in one.nb_grid_pts or ()], [float(side) for side in one.physical_sizes or ()]
        if one.dim != 2 or one.is_uniform is False or len(points) != 2 or min(points) < 2:
            raise Rejected(f"{file}: the channel {names[chosen[0]]!r} is a profile ({shapes[chosen[0]]} points); give a map of heights")
        if points[0] * points[1] > MOST_POINTS:
            raise Rejected(f"{file}: the map has {shapes[chosen[0]]} points, more than {MOST_POINTS}; export a smaller map")
        # Some readers require a size if the file states none. The import does not use this size.
        topography = opened.topography(channel_index=chosen[0], **({} if sides else {"physical_sizes": (1.0, 1.0)}))
        heights = np.ma.filled(np.ma.asarray(topography.heights()).astype(float), np.nan)
    lateral, unit = units[chosen[0]]
    return {
        "heights": np.ascontiguousarray(heights),
        "points": points,
        "sides": sides if len(sides) == 2 and np.isfinite(sides).all() else None,
        "lateral": lateral if lateral is None else str(lateral),
        "unit": unit if unit is None else str(unit),
        "channel": names[chosen[0]],
        "version": version,
    }


def _length(text: str, option: str) -> float:
    try:
        value = scale(text.strip().replace("µ", "u").replace("μ", "u"), LENGTHS)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise Rejected(f"{option}: the value is {text!r}; give one of the units {', '.join(LENGTHS)}, or a multiple such as '12.5 nm'")
    return value


def _shown(*lengths: float) -> str:
    largest = max(map(abs, lengths))
    unit = next((unit for unit, one in LENGTHS.items() if unit != "cm" and largest >= one), "pm")
    return " x ".join(f"{length / LENGTHS[unit]:.6g} {unit}" for length in lengths)


def _sides(found: dict[str, Any], given: str | None, file: Path) -> tuple[list[float], str]:
    """Returns the lengths of the map along x and y in m, and a note if the file states other lengths. Raises Rejected."""
    unit = STATED.get(found["lateral"])
    stated = [side * unit for side in found["sides"]] if unit and found["sides"] else None
    says = f"states {_shown(*stated)}" if stated else "states no size"
    if found["sides"] and not stated:
        says = f"states {found['sides'][0]:g} x {found['sides'][1]:g} in {_text(found['lateral'])}"
    if given is not None:
        parts = given.split(",")
        sides = [_length(part, "--size") for part in parts]
        if len(sides) != 2 or not all(SMALLEST <= side <= LARGEST for side in sides):
            raise Rejected(
                f"--size {given} is not valid; give the lengths along x and y, each from 1 um to 1 m, such as '1.2 mm,0.9 mm'"
            )
        return sides, "" if stated and np.allclose(sides, stated, rtol=1e-9, atol=0.0) else f"from --size; the file {says}"
    if stated is None or not all(SMALLEST <= side <= LARGEST for side in stated):
        raise Rejected(
            f"{file}: the map needs sides from 1 um to 1 m, but the file {says}; give the size, such as --size '1.2 mm,0.9 mm'"
        )
    return stated, ""


def _heights(found: dict[str, Any], given: str | None, sides: list[float], file: Path) -> tuple[np.ndarray, str]:
    """Returns the heights in m, and a note if the file states no unit of length. Raises Rejected."""
    stated, note = STATED.get(found["unit"]), ""
    unit = stated if given is None else _length(given, "--unit")
    if unit is None:
        raise Rejected(
            f"{file}: the heights of {found['channel']!r} have {_text(found['unit'])}, but the import needs a unit of length; "
            "give the length of one unit of height, such as --unit um or --unit '12.5 nm'"
        )
    if stated is None:
        note = f"from --unit {given}; the file has {_text(found['unit'])}"
    elif not math.isclose(unit, stated, rel_tol=1e-9):
        raise Rejected(
            f"--unit {given}: {file} states the unit {found['unit']}; remove --unit, which applies only to files without a unit of length"
        )
    heights: np.ndarray = found["heights"] * unit
    measured = heights[~np.isnan(heights)]
    if list(heights.shape) != found["points"] or not measured.size:
        raise Rejected(
            f"{file}: the file has {measured.size} heights for {' x '.join(map(str, found['points']))} points; the file may be damaged"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        span = float(measured.max() - measured.min())
    if not span <= max(sides):
        raise Rejected(
            f"{file}: the heights span {span:.3g} m on a map of {_shown(*sides)}; the unit or the size is wrong, or points without a "
            "measurement have a wrong height; export X3P from the software of the instrument"
        )
    return heights, note


def _write(heights: np.ndarray, spacing: list[float], about: dict[str, Any], output: Path) -> None:
    """Writes the table under a temporary name and then renames it, so that `output` is complete or absent."""
    import pyarrow as pa
    from pyarrow import parquet

    nx, ny = heights.shape
    unit = {"unit": "m"}
    schema = pa.schema(
        [pa.field("x", pa.float64(), False, unit), pa.field("y", pa.float64(), False, unit), pa.field("z", pa.float64(), True, unit)],
        {"fretwear_import": json.dumps(about)},
    )
    output.parent.mkdir(parents=True, exist_ok=True)
    stage = Path(tempfile.mkdtemp(prefix=f".{output.name}-", dir=output.parent))
    try:
        y = np.arange(ny) * spacing[1]
        lines = max(1, (1 << 20) // ny)
        with parquet.ParquetWriter(stage / "new", schema, compression="zstd") as writer:
            for i in range(0, nx, lines):
                block = heights[i : i + lines]
                x = np.repeat(np.arange(i, i + len(block)) * spacing[0], ny)
                z = pa.array(block.ravel(), from_pandas=True)
                writer.write_table(pa.table([pa.array(x), pa.array(np.tile(y, len(block))), z], schema=schema))
        os.replace(stage / "new", output)
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def convert(options: Namespace) -> str:
    """Reads the file and writes the table. Returns the text to print. Raises Rejected."""
    file, output = options.surface, options.output
    if output.suffix != ".parquet":
        raise Rejected(f"-o {output}: the name of the table of a surface must end with .parquet")
    if output.is_dir() or ((output.exists() or output.is_symlink()) and not options.force):
        raise Rejected(f"{output} already exists; give another name{'' if output.is_dir() else ', or give --force to replace it'}")
    if not file.is_file():
        raise Rejected(f"{file}: there is no such file; check the path")
    reader = reader_of(file, options.format)
    arguments = {"file": str(file), "reader": reader, "channel": options.channel}
    found = child.call("fretwear.importing.surface:library_map", arguments, files=[file], library=LIBRARY, extra=EXTRA)
    sides, size_note = _sides(found, options.size, file)
    heights, unit_note = _heights(found, options.unit, sides, file)
    spacing = [side / points for side, points in zip(sides, heights.shape, strict=True)]
    holes = int(np.isnan(heights).sum())
    about = {
        "file": folder._record(file),
        "written_by": {"program": "fretwear-import", "version": folder._version("fretwear")},
        "library": {"name": LIBRARY, "version": found["version"], "reader": reader, "channel": found["channel"]},
        "stated": {"sides": found["sides"], "lateral_unit": found["lateral"], "unit": found["unit"]},
        "given": {"size": options.size, "unit": options.unit},
        "corrected": [note for note in (size_note and f"size {size_note}", unit_note and f"unit {unit_note}") if note],
        "points": list(heights.shape),
        "spacing": spacing,
        "holes": holes,
    }
    _write(heights, spacing, about, output)
    path = json.dumps(str(output), ensure_ascii=False)
    unit = _text(found["unit"]) + (unit_note and f" ({unit_note})")
    return f"""\
fretwear-import wrote the table {output}
  points   {heights.shape[0]} x {heights.shape[1]} along x and y
  spacing  {_shown(*spacing)}
  size     {_shown(*sides)}{size_note and f" ({size_note})"}
  heights  {_shown(np.nanmin(heights))} to {_shown(np.nanmax(heights))}, stored in m; the file has {unit}
  holes    {holes}
  reader   {reader} of {LIBRARY} {found["version"]}, channel {found["channel"]!r}
A scene in the current folder reads the table with these lines:

[surface]
kind = "file"
path = {path}"""
