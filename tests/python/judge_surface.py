"""Compares maps of `fretwear-import --surface` and of the program with surfalize: spacing, holes, and the height at each point.

    PYTHONPATH=src/python python tests/python/judge_surface.py [--program PROGRAM] FILE...

The script needs SurfaceTopography, pyarrow and surfalize. surfalize is under the GPL: only this script imports it. FILEs are real
files, in addition to the files of surfaces.py. The script corrects two faults of surfalize: surfalize adds the largest height of NMS
instead of the smallest, and it reads the millimetres of TMD as micrometres. Two formats are omitted: surfalize begins PLU two points
early, and its table of MetroPro's resolutions begins at 1. test_import.py compares both formats with closed forms.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import surfaces
from fretwear.importing.surface import OWN, STATED, library_map
from pyarrow import parquet
from surfalize import Surface

#: Formats of surfaces.py that surfalize reads.
MADE = ("nms", "os3d", "tmd", "opd", "plux", "zmg", "gwy")
#: Tolerance relative to the largest height. The files of surfaces.py have single precision.
TOLERANCE = 1e-12
#: surfalize multiplies in another order, and in single precision for two formats.
SPACING_TOLERANCE = 1e-6


def grid(table, axes):
    """Heights[i, j] and spacing in m from a table of points or of indices."""
    x, y, z = (table[name].to_numpy(zero_copy_only=False) for name in axes)
    (xs, i), (ys, j) = np.unique(x, return_inverse=True), np.unique(y, return_inverse=True)
    heights = np.full((len(xs), len(ys)), np.nan)
    heights[i, j] = z
    return heights, [float(line[-1] - line[0]) / (len(line) - 1) for line in (xs, ys)]


def imported(file, spacing, folder):
    """Map of the importer. For a format that the program reads, the map comes from the library."""
    kind = file.suffix[1:]
    if kind in OWN:
        found = library_map(str(file), kind, None)
        unit = STATED[found["unit"]]
        return found["heights"] * unit, [side * unit / n for side, n in zip(found["sides"], found["points"], strict=True)], file
    table = folder / f"{file.stem}_{kind}.parquet"
    command = [sys.executable, "-m", "fretwear.importing", "--surface", file, "-o", table]
    if kind == "nms":
        nx, ny = library_map(str(file), kind, None)["points"]
        command += ["--size", f"{spacing[0] * nx * 1e6!r} um,{spacing[1] * ny * 1e6!r} um"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return *grid(parquet.read_table(table), "xyz"), table


def run(program, path, shape, spacing, folder):
    """Map that the program stores after reading."""
    scene = folder / "scene.toml"
    size = [f"{n * float(step)!r} m" for n, step in zip(shape, spacing, strict=True)]
    scene.write_text(f"""
joint = {{ size = {json.dumps(size)}, grid = {json.dumps(list(shape))} }}
material = {{ youngs_modulus = "210 GPa", poisson_ratio = 0.3 }}
surface = {{ kind = "file", path = {json.dumps(str(path.resolve()))}, detrend = "none" }}
contact = {{ normal_load = "0.01 N" }}
""")
    command = [program, "run", scene, "--run", folder / "run", "--until", "surface", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and "resampled" not in done.stderr, done.stderr
    table = parquet.read_table(folder / "run" / "once" / "surface.parquet")
    heights = np.full(shape, np.nan)
    heights[table["i"].to_numpy(), table["j"].to_numpy()] = table["height"].to_numpy()
    return heights


def compare(name, heights, right, tolerance):
    """Largest difference relative to the largest height. Holes must be at the same points."""
    assert heights.shape == right.shape, (name, heights.shape, right.shape)
    assert (np.isnan(heights) == np.isnan(right)).all(), (name, "holes")
    difference = np.nanmax(np.abs(heights - right)) / np.nanmax(np.abs(right))
    assert difference <= tolerance, (name, difference)
    return difference


def judge(file, program, tolerance):
    kind = file.suffix[1:]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        judged = Surface.load(file)
    unit = 1e-3 if kind == "tmd" else 1e-6
    # Lines from the upper end of the map; x varies fastest.
    right = judged.data.T * unit
    steps = [step * unit for step in (judged.step_x, judged.step_y)]
    with tempfile.TemporaryDirectory() as folder:
        heights, spacing, path = imported(file, steps, Path(folder))
        if kind == "nms":
            right = right - (np.nanmax(right) - np.nanmax(heights))
        assert np.allclose(spacing, steps, rtol=SPACING_TOLERANCE, atol=0.0), (file, spacing, steps)
        said = f"{file.name}: {heights.shape[0]} x {heights.shape[1]}, {np.isnan(heights).sum()} holes"
        said += f", importer {compare(file, heights, right, tolerance):.1e}"
        # Each mirror image must differ.
        for other in (right[::-1], right[:, ::-1], right[::-1, ::-1], *([right.T] if len(set(right.shape)) == 1 else [])):
            assert np.nanmax(np.abs(heights - other)) > 1e3 * tolerance * np.nanmax(np.abs(right)), (file, "a mirror image")
        if program:
            read = run(program, path, heights.shape, spacing, Path(folder))
            # The program fills the holes.
            read[np.isnan(heights)] = np.nan
            said += f", program {compare(file, read, heights, TOLERANCE):.1e}"
    print(said)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", help="program whose readers of maps and of tables are also compared")
    parser.add_argument("files", nargs="*", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for kind in MADE:
            writer, holes = surfaces.WRITERS[kind]
            made = Path(folder, f"made.{kind}")
            made.write_bytes(writer(surfaces.heights(holes), surfaces.SPACING))
            judge(made, options.program, 1e-7)
        for file in options.files:
            judge(file, options.program, TOLERANCE)


if __name__ == "__main__":
    main()
