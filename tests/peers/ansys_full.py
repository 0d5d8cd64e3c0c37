"""Compares `fretwear inspect` of an ANSYS .full file with the vendor's reader and scipy.

    python ansys_full.py [PROGRAM]                      (ansys-mapdl-reader, which ships a .full, and scipy)

The frequencies of K φ = ω² M φ without the fixed freedoms, and the numbers of freedoms and nodes, must agree.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np
import scipy.sparse.linalg
from ansys.mapdl import reader

MODES = 8
# Relative tolerance, from the iteration of scipy for double modes.
SAME = 1e-8


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else "fretwear"
    path = pathlib.Path(reader.__file__).parent / "examples" / "file.full"
    full = reader.read_binary(str(path))
    freedoms, stiffness, mass = full.load_km(sort=False)
    free = np.flatnonzero(stiffness.diagonal() > 0)

    def whole(matrix):
        matrix = matrix[free][:, free]
        return (matrix + matrix.T - scipy.sparse.diags(matrix.diagonal())).tocsc()

    squares, _ = scipy.sparse.linalg.eigsh(whole(stiffness), k=MODES, M=whole(mass), sigma=1.0)
    expected = np.sqrt(np.sort(squares)) / (2 * np.pi)
    said = subprocess.run(
        [program, "inspect", str(path), "--json", "--modes", str(MODES)], check=True, capture_output=True, text=True
    )
    found = json.loads(said.stdout)
    assert found["dofs"] == len(free) and found["nodes"] == len(set(freedoms[free, 0])), found
    for ours, theirs in zip(found["frequencies"], expected):
        print(f"{ours:14.6f} {theirs:14.6f} Hz")
        assert abs(ours / theirs - 1) < SAME


if __name__ == "__main__":
    main()
