"""Executes each notebook of the documentation in a separate folder.

    python tests/python/notebooks.py [--keep FOLDER] [NAME…]

A notebook must be stored without outputs. It must end without an error within 30 s, and its grid must have at most 64 x 48 cells.
With `--keep`, the script writes the notebooks with their outputs to a folder. The script needs nbclient, ipykernel, matplotlib, pandas
and polars. It finds the program as test_fretwear.py does.
"""

import argparse
import re
import sys
import tempfile
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
# Time limit of a notebook in s, and a factor for a busy machine.
LONGEST = 30.0
SPARE = 4.0


def execute(path, keep):
    """Executes a notebook and returns the time in s. Raises an error if a cell fails."""
    notebook = nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code), f"{path.name} is stored with outputs"
    for x, y in re.findall(r'"grid": \[(\d+), (\d+)\]', "\n".join(cell.source for cell in code)):
        assert int(x) <= 64 and int(y) <= 48, f"{path.name} has a grid of {x} x {y}"
    with tempfile.TemporaryDirectory() as folder:
        begun = time.monotonic()
        NotebookClient(notebook, timeout=SPARE * LONGEST, kernel_name="python3", resources={"metadata": {"path": folder}}).execute()
        seconds = time.monotonic() - begun
    assert any("text/html" in output.get("data", {}) for cell in code for output in cell.outputs), f"{path.name} shows no table"
    assert any("image/png" in output.get("data", {}) for cell in code for output in cell.outputs), f"{path.name} shows no picture"
    if keep:
        keep.mkdir(parents=True, exist_ok=True)
        nbformat.write(notebook, keep / path.name)
    return seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    paths = [path for path in sorted(NOTEBOOKS.glob("*.ipynb")) if not given.names or path.stem in given.names]
    if not paths:
        sys.exit(f"no notebook with a name in {given.names} in {NOTEBOOKS}")
    for path in paths:
        seconds = execute(path, given.keep)
        print(f"{path.name}: {seconds:.1f} s", flush=True)
        assert seconds < SPARE * LONGEST, path.name


if __name__ == "__main__":
    main()
